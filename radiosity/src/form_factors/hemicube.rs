//! Form factors by a hemicube at each patch's centre.
//!
//! Half a cube of side 2 stands over the patch; its faces are cut into cells, N x N on top and N x N/2 on
//! each of the four sides. A cell's weight is the form factor from the patch's centre to the cell, and F_ij
//! is the sum of the weights of the cells through which patch j is the nearest thing seen.
//!
//! \[CG85\] Cohen & Greenberg, The Hemi-Cube: A Radiosity Solution for Complex Environments, 1985.
//! \[Howell\] Howell, A Catalog of Radiation Heat Transfer Configuration Factors, B-3 and B-4.

use std::f64::consts::{FRAC_1_PI, PI};

use glam::DVec3;

use super::rows::Row;
use crate::patches::Patches;
use crate::scene::BackFaces;
use crate::visibility::{Cells, Drawn, Facet, Facets, ItemBuffer, NOTHING, RayTree, View};

/// The least and the greatest precision that make sense.
pub const PRECISIONS: std::ops::RangeInclusive<u32> = 2..=4096;

/// Off a plane by less than this, relative to the scene's extent, is in the plane: a patch's own surface and
/// those flush with it are not above it.
const HORIZON: f64 = 1e-9;

/// Cells are looked through this far beside their centres (across, up), in cells. In a scene of round numbers
/// the edges of surfaces and patches run exactly through cells' centres, along whole rows at a time; a
/// rounding error, or the item buffer's tolerance, would then decide for all of them alike, and a square
/// would gain a row of cells on either side. Beside the centre it gains on one side what it loses on the
/// other.
const BESIDE: [f64; 2] = [1e-4, 0.618e-4];

/// \[CG85\] eq. 5: the weight of a cell of area `area` centred at (x, y) on the top face, were the kernel the
/// same all over the cell.
pub fn delta_form_factor_top(x: f64, y: f64, area: f64) -> f64 {
    area / (PI * (x * x + y * y + 1.0).powi(2))
}

/// \[CG85\] eq. 6: the same for a side face, y along the horizon and z above it.
pub fn delta_form_factor_side(y: f64, z: f64, area: f64) -> f64 {
    z * area / (PI * (y * y + z * z + 1.0).powi(2))
}

/// The exact form factor from the centre to the rectangle (0, 0)-(x, y) of the top face (\[Howell\] B-3),
/// odd in x and in y.
fn top_corner(x: f64, y: f64) -> f64 {
    let (a, b) = (x.hypot(1.0), y.hypot(1.0));
    0.5 * FRAC_1_PI * (x / a * (y / a).atan() + y / b * (x / b).atan())
}

/// The exact form factor from the centre to the rectangle (0, 0)-(y, z) of a side face (\[Howell\] B-4), odd
/// in y.
fn side_corner(y: f64, z: f64) -> f64 {
    let b = z.hypot(1.0);
    0.5 * FRAC_1_PI * (y.atan() - (y / b).atan() / b)
}

/// The weights of a hemicube's cells, exactly integrated over each cell, so that all of them sum to 1 at any
/// precision. The delta form factors at the cells' centres, which the first papers used, sum to 1 + 5.4e-5
/// at 100 cells; a room of reflectance 0.99 would return that error a hundredfold.
#[derive(Clone, Debug, PartialEq)]
pub struct CellWeights {
    precision: usize,
    /// For each row of a face, the sums of its first 0, 1, ... N weights.
    top: Vec<f64>,
    side: Vec<f64>,
}

impl CellWeights {
    /// For N = `precision` cells along a side; `None` where it is odd or out of [`PRECISIONS`].
    pub fn new(precision: u32) -> Option<Self> {
        if !precision.is_multiple_of(2) || !PRECISIONS.contains(&precision) {
            return None;
        }
        let n = precision as usize;
        let edge = |k: usize| 2.0 * k as f64 / n as f64;
        let prefix = |corner: fn(f64, f64) -> f64, rows: usize, bottom: f64| {
            let row = |y: usize| {
                let (low, high) = (bottom + edge(y), bottom + edge(y + 1));
                let up_to = move |x: f64| corner(x, high) - corner(x, low);
                (0..=n).map(move |x| up_to(edge(x) - 1.0) - up_to(-1.0))
            };
            (0..rows).flat_map(row).collect()
        };
        Some(Self { precision: n, top: prefix(top_corner, n, -1.0), side: prefix(side_corner, n / 2, 0.0) })
    }

    /// N: cells along a side of the top face.
    pub fn precision(&self) -> usize {
        self.precision
    }

    /// The weight of cell (x, y) of the top face.
    pub fn top(&self, x: usize, y: usize) -> f64 {
        self.rows(Face::Top).between(y, x, x + 1)
    }

    /// The weight of cell (x, y) of any side face, y = 0 at the horizon.
    pub fn side(&self, x: usize, y: usize) -> f64 {
        self.rows(Face::Right).between(y, x, x + 1)
    }

    /// The sum of all weights.
    pub fn sum(&self) -> f64 {
        let n = self.precision;
        let face = |face, rows| (0..rows).map(|y| self.rows(face).between(y, 0, n)).sum::<f64>();
        face(Face::Top, n) + 4.0 * face(Face::Right, n / 2)
    }

    fn rows(&self, face: Face) -> PrefixSums<'_> {
        let sums = if face == Face::Top { &self.top } else { &self.side };
        PrefixSums { sums, stride: self.precision + 1 }
    }
}

/// Sums of weights along each row of a face.
#[derive(Clone, Copy)]
struct PrefixSums<'a> {
    sums: &'a [f64],
    stride: usize,
}

impl PrefixSums<'_> {
    /// The weights of cells `from..to` of `row`, together.
    fn between(self, row: usize, from: usize, to: usize) -> f64 {
        let row = &self.sums[row * self.stride..][..self.stride];
        row[to] - row[from]
    }
}

/// The five faces of a hemicube.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Face {
    /// Parallel to the patch.
    Top,
    /// Towards +V1.
    Right,
    /// Towards -V1.
    Left,
    /// Towards the third direction, n × V1.
    Back,
    /// Opposite to it.
    Front,
}

impl Face {
    /// All five.
    pub const ALL: [Self; 5] = [Self::Top, Self::Right, Self::Left, Self::Back, Self::Front];

    /// What the face shows: a grid of cells seen from the centre of the hemicube.
    pub fn view(self, centre: DVec3, [x, y, normal]: [DVec3; 3], precision: usize) -> View {
        let (right, up, forward) = match self {
            Self::Top => (x, y, normal),
            Self::Right => (y, normal, x),
            Self::Left => (y, normal, -x),
            Self::Back => (x, normal, y),
            Self::Front => (x, normal, -y),
        };
        let (bottom, height) = if self == Self::Top { (-1.0, precision) } else { (0.0, precision / 2) };
        let [across, upward] = BESIDE.map(|shift| shift * 2.0 / precision as f64);
        View {
            eye: centre,
            right,
            up,
            forward,
            horizontal: [-1.0 + across, 1.0 + across],
            vertical: [bottom + upward, 1.0 + upward],
            width: precision,
            height,
            near: 0.0,
            far: f64::INFINITY,
        }
    }
}

/// The hemicube's axes at a patch: V1 made a unit vector, the third direction, and the normal.
pub fn frame(patches: &Patches, patch: usize) -> [DVec3; 3] {
    let normal = patches.normal[patch];
    let tangent = patches.tangent_u[patch];
    let x = (tangent - normal * normal.dot(tangent)).try_normalize();
    let x = x.unwrap_or_else(|| normal.any_orthonormal_vector());
    [x, normal.cross(x), normal]
}

/// What hemicubes are taken of, and how finely.
#[derive(Clone, Debug)]
pub struct Hemicube<'a> {
    patches: &'a Patches,
    facets: &'a Facets,
    back_faces: BackFaces,
    weights: CellWeights,
    horizon: f64,
}

/// Memory that one hemicube after another is worked out in.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    buffer: ItemBuffer,
    candidates: Vec<u32>,
    /// Where a facet stands among those drawn in this face; only entries of facets drawn mean anything.
    place: Vec<u32>,
    grids: Vec<GridOnFace>,
    row: Vec<f64>,
}

impl<'a> Hemicube<'a> {
    /// Hemicubes at the centres of `patches` seeing `facets`.
    pub fn new(
        patches: &'a Patches,
        facets: &'a Facets,
        back_faces: BackFaces,
        weights: CellWeights,
    ) -> Self {
        Self { patches, facets, back_faces, weights, horizon: HORIZON * facets.extent() }
    }

    /// The cells' weights.
    pub fn weights(&self) -> &CellWeights {
        &self.weights
    }

    /// Row i by the item buffer: each face is rasterised, and each run of cells that show one facet is cut
    /// where it passes from patch to patch.
    pub fn row(&self, patch: usize, scratch: &mut Scratch) -> Row {
        scratch.row.clear();
        scratch.row.resize(self.patches.len(), 0.0);
        self.candidates_above(patch, &mut scratch.candidates);
        scratch.place.resize(self.facets.as_slice().len(), 0);
        let (centre, axes) = (self.patches.centre[patch], frame(self.patches, patch));
        for face in Face::ALL {
            let view = face.view(centre, axes, self.weights.precision);
            scratch.buffer.draw_only(self.facets, scratch.candidates.iter().copied(), &view);
            scratch.grids.clear();
            for (place, drawn) in scratch.buffer.drawn.iter().enumerate() {
                scratch.place[drawn.facet as usize] = place as u32;
                scratch.grids.push(GridOnFace::new(self, drawn, &view));
            }
            let sums = self.weights.rows(face);
            for y in 0..view.height {
                let cells = &scratch.buffer.facet[y * view.width..][..view.width];
                let mut from = 0;
                for run in cells.chunk_by(|a, b| a == b) {
                    let to = from + run.len();
                    if run[0] != NOTHING {
                        let place = scratch.place[run[0] as usize];
                        scratch.grids[place as usize].add_run(y, from..to, sums, &mut scratch.row);
                    }
                    from = to;
                }
            }
        }
        Row::from_dense(&scratch.row)
    }

    /// Row i as the assignment has it (`FacteursFormePiece`): one ray a cell, the nearest hit, its weight added
    /// to the patch it hits. The reference that [`Hemicube::row`] is held against.
    pub fn row_by_rays(&self, patch: usize, tree: &RayTree<'_>) -> Row {
        let mut row = vec![0.0; self.patches.len()];
        for face in Face::ALL {
            let sums = self.weights.rows(face);
            let seen = self.face_by_rays(patch, face, tree);
            let width = self.weights.precision;
            for (k, patch) in seen.into_iter().enumerate() {
                if let Some(j) = patch {
                    row[j as usize] += sums.between(k / width, k % width, k % width + 1);
                }
            }
        }
        Row::from_dense(&row)
    }

    /// The patch that each cell of a face sees, by one ray a cell; row by row from the bottom.
    pub fn face_by_rays(&self, patch: usize, face: Face, tree: &RayTree<'_>) -> Vec<Option<u32>> {
        let centre = self.patches.centre[patch];
        let view = face.view(centre, frame(self.patches, patch), self.weights.precision);
        let mut above = Vec::new();
        self.candidates_above(patch, &mut above);
        let above = |facet: u32| above.binary_search(&facet).is_ok();
        let cells = (0..view.height).flat_map(|y| (0..view.width).map(move |x| (x, y)));
        cells
            .map(|(x, y)| {
                let direction = view.direction(x as f64, y as f64);
                let hit = tree.nearest(centre, direction, f64::INFINITY, above)?;
                let facet = &self.facets[hit.facet];
                self.shows_light(facet, centre).then(|| facet.patch_at(hit.u, hit.v))
            })
            .collect()
    }

    /// The patch that each cell of a face sees, by the item buffer; row by row from the bottom.
    pub fn face(&self, patch: usize, face: Face, scratch: &mut Scratch) -> Vec<Option<u32>> {
        let centre = self.patches.centre[patch];
        let view = face.view(centre, frame(self.patches, patch), self.weights.precision);
        self.candidates_above(patch, &mut scratch.candidates);
        scratch.buffer.draw_only(self.facets, scratch.candidates.iter().copied(), &view);
        let cells = (0..view.height).flat_map(|y| (0..view.width).map(move |x| (x, y)));
        cells
            .zip(&scratch.buffer.facet)
            .map(|((x, y), &number)| {
                let facet = (number != NOTHING).then(|| &self.facets[number])?;
                let direction = view.direction(x as f64, y as f64);
                let (u, v) = facet.uv(centre + direction * facet.plane_distance(centre, direction));
                self.shows_light(facet, centre).then(|| facet.patch_at(u, v))
            })
            .collect()
    }

    /// The facets that can be seen from a patch's centre, in order: those that reach above its plane (a flat
    /// surface never reaches above its own), but for those whose own plane passes through it, edge-on.
    fn candidates_above(&self, patch: usize, candidates: &mut Vec<u32>) {
        let (centre, normal) = (self.patches.centre[patch], self.patches.normal[patch]);
        let seen = |facet: &Facet| {
            facet.greatest_height(centre, normal) > self.horizon
                && facet.normal.dot(facet.origin - centre).abs() > self.horizon
        };
        let numbered = (0_u32..).zip(self.facets.as_slice());
        candidates.clear();
        candidates.extend(numbered.filter(|(_, facet)| seen(facet)).map(|(number, _)| number));
    }

    /// Whether what `eye` sees of a facet sends light: its front does, its back where back faces are lit.
    fn shows_light(&self, facet: &Facet, eye: DVec3) -> bool {
        self.back_faces == BackFaces::Lit || facet.faces(eye)
    }
}

/// The grid of patches of a facet as it appears on a face: linear forms over (x, y, 1) in cells.
///
/// u = u_over / inverse_depth along the ray through a cell, so the line u = k / columns between two columns
/// of patches is where u_over - inverse_depth k / columns = 0: straight, and found by one division a row.
#[derive(Clone, Copy, Debug)]
struct GridOnFace {
    first: u32,
    columns: i32,
    rows: i32,
    /// columns * u * inverse depth.
    across: DVec3,
    /// rows * v * inverse depth.
    up: DVec3,
    inverse_depth: DVec3,
    /// Whether it sends light this way.
    lit: bool,
}

impl GridOnFace {
    fn new(hemicube: &Hemicube<'_>, drawn: &Drawn, view: &View) -> Self {
        let facet = &hemicube.facets[drawn.facet];
        let lit = hemicube.shows_light(facet, view.eye);
        let inverse_depth = drawn.inverse_depth;
        let (first, columns, rows) = match facet.cells {
            Cells::One(patch) => (patch, 1, 1),
            Cells::Grid { first, columns, rows } => (first, columns as i32, rows as i32),
        };
        let mut grid =
            Self { first, columns, rows, across: DVec3::ZERO, up: DVec3::ZERO, inverse_depth, lit };
        if columns > 1 || rows > 1 {
            // p = eye + d / inverse_depth, and u = (p - origin) · dual; so u inverse_depth is linear in d.
            let to_eye = view.eye - facet.origin;
            let form = |dual: DVec3, cells: i32| {
                (view.in_cells(dual) + inverse_depth * to_eye.dot(dual)) * f64::from(cells)
            };
            let [dual_u, dual_v] = facet.duals();
            (grid.across, grid.up) = (form(dual_u, columns), form(dual_v, rows));
        }
        grid
    }

    /// Add the weights of `cells` of row `y`, all of which show this facet, to the patches they show.
    fn add_run(&self, y: usize, cells: std::ops::Range<usize>, sums: PrefixSums<'_>, row: &mut [f64]) {
        if !self.lit {
            return;
        }
        if self.columns == 1 && self.rows == 1 {
            row[self.first as usize] += sums.between(y, cells.start, cells.end);
            return;
        }
        let along = |form: DVec3| Linear { slope: form.x, start: form.y * y as f64 + form.z };
        let inverse_depth = along(self.inverse_depth);
        let mut column = Walk::new(along(self.across), inverse_depth, self.columns, &cells);
        let mut upward = Walk::new(along(self.up), inverse_depth, self.rows, &cells);
        let mut from = cells.start;
        while from < cells.end {
            let to = column.next.min(upward.next).min(cells.end);
            if to > from {
                let patch = self.first as i32 + upward.index * self.columns + column.index;
                row[patch as usize] += sums.between(y, from, to);
                from = to;
            }
            if column.next <= from {
                column.advance();
            }
            if upward.next <= from {
                upward.advance();
            }
        }
    }
}

/// slope x + start.
#[derive(Clone, Copy, Debug)]
struct Linear {
    slope: f64,
    start: f64,
}

impl Linear {
    fn at(self, x: f64) -> f64 {
        self.slope * x + self.start
    }
}

/// A walk along a row of cells through the columns (or the rows) of patches that they show. The quotient of
/// two linear forms is monotone where the facet is before the eye, so the walk only ever goes one way.
struct Walk {
    over: Linear,
    under: Linear,
    count: i32,
    step: i32,
    /// The column shown now.
    index: i32,
    /// Where it began to be shown.
    reached: f64,
    /// The first cell that shows the next one.
    next: usize,
}

impl Walk {
    fn new(over: Linear, under: Linear, count: i32, cells: &std::ops::Range<usize>) -> Self {
        let reached = cells.start as f64;
        let index = ((over.at(reached) / under.at(reached)) as i32).clamp(0, count - 1);
        // The sign of the quotient's derivative.
        let rising = over.slope * under.start - over.start * under.slope > 0.0;
        let mut walk =
            Self { over, under, count, step: if rising { 1 } else { -1 }, index, reached, next: 0 };
        walk.find_next();
        walk
    }

    /// Find where the line between this column and the next is crossed.
    fn find_next(&mut self) {
        self.next = usize::MAX;
        let line = if self.step > 0 { self.index + 1 } else { self.index };
        if line <= 0 || line >= self.count {
            return;
        }
        let k = f64::from(line);
        let slope = self.over.slope - k * self.under.slope;
        let crossing = (k * self.under.start - self.over.start) / slope;
        // A crossing that lies back by more than rounding is one of the plane's part behind the eye: there is
        // none ahead. Nor where the line runs along the row.
        if crossing.is_finite() && crossing > self.reached - 0.5 {
            self.reached = crossing;
            self.next = crossing.ceil().max(0.0) as usize;
        }
    }

    fn advance(&mut self) {
        self.index += self.step;
        self.find_next();
    }
}
