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
use crate::simd::{self, LANES, Level, Simd};
use crate::visibility::{Cells, Drawn, Facet, Facets, ItemBuffer, NOTHING, Piece, RayTree, View};

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

impl<'a> PrefixSums<'a> {
    /// The sums along one row.
    #[inline(always)]
    fn row(self, y: usize) -> &'a [f64] {
        &self.sums[y * self.stride..][..self.stride]
    }

    /// The weights of cells `from..to` of `row`, together.
    fn between(self, row: usize, from: usize, to: usize) -> f64 {
        let row = self.row(row);
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

    /// Those of `pieces`, given in the hemicube's axes, that may be seen through this face, in the axes of its view.
    #[inline(always)]
    fn pieces(self, pieces: &[(Piece, u8)]) -> impl Iterator<Item = Piece> + '_ {
        let bit = 1 << self as u8;
        pieces.iter().filter(move |(_, faces)| faces & bit != 0).map(move |(piece, _)| {
            let [a, b, c, d] = piece.corners;
            Piece { corners: [self.turn(a), self.turn(b), self.turn(c), self.turn(d)], ..*piece }
        })
    }

    /// From the hemicube's axes to those of the face's view.
    #[inline(always)]
    fn turn(self, c: DVec3) -> DVec3 {
        match self {
            Self::Top => c,
            Self::Right => DVec3::new(c.y, c.z, c.x),
            Self::Left => DVec3::new(c.y, c.z, -c.x),
            Self::Back => DVec3::new(c.x, c.z, c.y),
            Self::Front => DVec3::new(c.x, c.z, -c.y),
        }
    }

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

/// The faces, a bit each, that a piece in the hemicube's axes may be seen through: all but those of which it lies wholly
/// beyond one side.
#[inline(always)]
fn faces_met(piece: &Piece) -> u8 {
    // The planes between the faces, and on which side of each all corners lie.
    let (mut beyond, mut within) = ([true; 6], [true; 6]);
    for corner in &piece.corners[..piece.count] {
        let DVec3 { x, y, z } = *corner;
        let sides = [x - z, -x - z, y - z, -y - z, x - y, x + y];
        for k in 0..6 {
            beyond[k] &= sides[k] > 0.0;
            within[k] &= sides[k] < 0.0;
        }
    }
    let top = !(beyond[0] | beyond[1] | beyond[2] | beyond[3]);
    let right = !(within[0] | within[4] | within[5]);
    let left = !(within[1] | beyond[4] | beyond[5]);
    let back = !(within[2] | beyond[4] | within[5]);
    let front = !(within[3] | within[4] | beyond[5]);
    [top, right, left, back, front].iter().zip(0..).map(|(&met, bit)| u8::from(met) << bit).sum()
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
    /// The facets above the patch in the hemicube's axes, and the faces each may be seen through.
    pieces: Vec<(Piece, u8)>,
    /// Where a facet stands among those drawn in this face; only entries of facets drawn mean anything.
    place: Vec<u32>,
    grids: Vec<GridOnFace>,
    row: Vec<f64>,
    /// The patch that each cell of a row of the face shows.
    shown: Vec<u32>,
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

    /// Row i by the item buffer: each face is rasterised, the patch that each cell shows follows from (u, v), and
    /// the weights of a run of cells that show one patch are added at once, as a difference of prefix sums.
    pub fn row(&self, patch: usize, scratch: &mut Scratch) -> Row {
        self.row_at(Level::best(), patch, scratch)
    }

    /// The same with no more of the processor than `level`; the bits do not depend on it.
    pub fn row_at(&self, level: Level, patch: usize, scratch: &mut Scratch) -> Row {
        simd::run(level, FindRow { hemicube: self, patch, scratch })
    }

    #[inline(always)]
    fn find_row<S: Simd>(&self, simd: S, patch: usize, scratch: &mut Scratch) -> Row {
        let Scratch { buffer, pieces, place, grids, row, shown } = scratch;
        // One more entry, for what sends no light here.
        let nowhere = self.patches.len() as u32;
        row.clear();
        row.resize(self.patches.len() + 1, 0.0);
        self.pieces_above(patch, pieces);
        place.resize(self.facets.as_slice().len(), 0);
        shown.resize(self.weights.precision + LANES, nowhere);
        let (centre, axes) = (self.patches.centre[patch], frame(self.patches, patch));
        for face in Face::ALL {
            let view = face.view(centre, axes, self.weights.precision);
            buffer.draw_pieces(simd, face.pieces(pieces), &view);
            grids.clear();
            for (drawn, at) in buffer.drawn.iter().zip(0..) {
                place[drawn.facet as usize] = at;
                grids.push(GridOnFace::new(self, drawn, &view));
            }
            let sums = self.weights.rows(face);
            for y in 0..view.height {
                for (facet, from, to) in Runs::new(simd, buffer.facets(y)) {
                    let shown = &mut shown[from..to + LANES];
                    if facet == NOTHING {
                        shown[..to - from].fill(nowhere);
                    } else {
                        let grid = &grids[place[facet as usize] as usize];
                        grid.patches_shown(simd, [from, y], shown, nowhere);
                    }
                }
                let sums = sums.row(y);
                let mut before = 0.0;
                for (patch, _, to) in Runs::new(simd, &shown[..view.width]) {
                    let up_to = sums[to];
                    row[patch as usize] += up_to - before;
                    before = up_to;
                }
            }
        }
        Row::from_dense(&row[..self.patches.len()])
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
        let normal = self.patches.normal[patch];
        let above = |facet: u32| self.is_above(&self.facets[facet], centre, normal);
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
        self.pieces_above(patch, &mut scratch.pieces);
        simd::run(Level::best(), DrawFace { scratch, face, view: &view });
        let cells = (0..view.height).flat_map(|y| (0..view.width).map(move |x| (x, y)));
        cells
            .map(|(x, y)| {
                let number = scratch.buffer.facets(y)[x];
                let facet = (number != NOTHING).then(|| &self.facets[number])?;
                let direction = view.direction(x as f64, y as f64);
                let (u, v) = facet.uv(centre + direction * facet.plane_distance(centre, direction));
                self.shows_light(facet, centre).then(|| facet.patch_at(u, v))
            })
            .collect()
    }

    /// Whether a facet can be seen from a patch's centre: it reaches above the patch's plane (a flat surface never
    /// reaches above its own), and its own plane does not pass through the centre, edge-on.
    #[inline(always)]
    fn is_above(&self, facet: &Facet, centre: DVec3, normal: DVec3) -> bool {
        facet.greatest_height(centre, normal) > self.horizon
            && facet.normal.dot(facet.origin - centre).abs() > self.horizon
    }

    /// Those facets, in order, in the hemicube's axes.
    #[inline(always)]
    fn pieces_above(&self, patch: usize, pieces: &mut Vec<(Piece, u8)>) {
        let (centre, axes) = (self.patches.centre[patch], frame(self.patches, patch));
        pieces.clear();
        for (facet, number) in self.facets.as_slice().iter().zip(0..) {
            if self.is_above(facet, centre, axes[2]) {
                let piece = Piece::new(number, facet, centre, axes);
                pieces.push((piece, faces_met(&piece)));
            }
        }
    }

    /// Whether what `eye` sees of a facet sends light: its front does, its back where back faces are lit.
    fn shows_light(&self, facet: &Facet, eye: DVec3) -> bool {
        self.back_faces == BackFaces::Lit || facet.faces(eye)
    }
}

/// The grid of patches of a facet as it appears on a face: linear forms over (x, y, 1) in cells. Along the ray
/// through a cell, u and v are quotients of two of them.
#[derive(Clone, Copy, Debug)]
struct GridOnFace {
    first: u32,
    columns: i32,
    rows: i32,
    /// (columns * u - 1/2) * inverse depth: rounding the quotient gives the column.
    across: DVec3,
    /// (rows * v - 1/2) * inverse depth.
    up: DVec3,
    inverse_depth: DVec3,
    /// Whether it sends light this way.
    lit: bool,
}

impl GridOnFace {
    #[inline(always)]
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
                let coordinate = view.in_cells(dual) + inverse_depth * to_eye.dot(dual);
                coordinate * f64::from(cells) - inverse_depth * 0.5
            };
            let [dual_u, dual_v] = facet.duals();
            (grid.across, grid.up) = (form(dual_u, columns), form(dual_v, rows));
        }
        grid
    }

    /// Write into `shown` the patch that each cell from (x, y) along the row shows, this facet being what is
    /// nearest. [`LANES`] cells more than are asked for may be written.
    #[inline(always)]
    fn patches_shown<S: Simd>(&self, simd: S, [x, y]: [usize; 2], shown: &mut [u32], nowhere: u32) {
        let wanted = shown.len() - LANES;
        if !self.lit || (self.columns == 1 && self.rows == 1) {
            shown[..wanted].fill(if self.lit { self.first } else { nowhere });
            return;
        }
        let (across, up, inverse_depth) = (
            Along::new(simd, self.across, y),
            Along::new(simd, self.up, y),
            Along::new(simd, self.inverse_depth, y),
        );
        let most_across = simd.splat((self.columns - 1) as f32);
        let most_up = simd.splat((self.rows - 1) as f32);
        let (first, columns) = (simd.splat_int(self.first as i32), simd.splat_int(self.columns));
        let mut at = 0;
        while at < wanted {
            let depth = simd.div(simd.splat(1.0), inverse_depth.at(simd, x + at));
            let column = rounded(simd, simd.mul(across.at(simd, x + at), depth), most_across);
            let row = rounded(simd, simd.mul(up.at(simd, x + at), depth), most_up);
            let patch = simd.add_int(first, simd.add_int(simd.mul_int(row, columns), column));
            simd.store_int(patch, shown[at..].first_chunk_mut().expect("a block more than wanted"));
            at += LANES;
        }
    }
}

/// A linear form along a row of cells.
struct Along<S: Simd> {
    /// What it is at column 0, and adds a column.
    start: f64,
    step: f64,
    /// What it adds from the first to each cell of a block.
    steps: S::Floats,
}

impl<S: Simd> Along<S> {
    #[inline(always)]
    fn new(simd: S, form: DVec3, y: usize) -> Self {
        let steps = simd.mul(simd.ramp(), simd.splat(form.x as f32));
        Self { start: form.y * y as f64 + form.z, step: form.x, steps }
    }

    /// In the block that begins at column `x`. Its first cell is found in double precision.
    #[inline(always)]
    fn at(&self, simd: S, x: usize) -> S::Floats {
        simd.add(simd.splat((self.start + self.step * x as f64) as f32), self.steps)
    }
}

/// `x`, brought into 0..=most (what is no number to 0), rounded to a whole number. Adding 1.5 * 2²³ leaves no bits
/// for a fraction, and the integer in the last ones: cheaper than a cast, and the same at any width.
#[inline(always)]
fn rounded<S: Simd>(simd: S, x: S::Floats, most: S::Floats) -> S::Ints {
    const SHIFT: f32 = 12_582_912.0;
    // In this order, for both take their second argument where the first is no number.
    let x = simd.max(simd.min(x, most), simd.splat(0.0));
    simd.sub_int(simd.bits(simd.add(x, simd.splat(SHIFT))), simd.splat_int(SHIFT.to_bits() as i32))
}

/// The runs of equal values, in order: (value, from, to).
struct Runs<'a, S> {
    simd: S,
    values: &'a [u32],
    /// Where the run at hand begins.
    from: usize,
    /// The block at hand, and a bit for each value of it, not yet passed, that differs from the one after it.
    block: usize,
    ends: u32,
}

impl<'a, S: Simd> Runs<'a, S> {
    #[inline(always)]
    fn new(simd: S, values: &'a [u32]) -> Self {
        Self { simd, values, from: 0, block: 0, ends: ends(simd, values, 0) }
    }
}

impl<S: Simd> Iterator for Runs<'_, S> {
    type Item = (u32, usize, usize);

    #[inline(always)]
    fn next(&mut self) -> Option<Self::Item> {
        while self.ends == 0 && self.block + LANES < self.values.len() {
            self.block += LANES;
            self.ends = ends(self.simd, self.values, self.block);
        }
        let from = self.from;
        if self.ends == 0 {
            // The last run has no other after it.
            self.from = self.values.len();
            return (from < self.values.len()).then(|| (self.values[from], from, self.values.len()));
        }
        let to = self.block + self.ends.trailing_zeros() as usize + 1;
        self.ends &= self.ends - 1;
        self.from = to;
        Some((self.values[from], from, to))
    }
}

/// A bit for each value of a block that differs from the one after it.
#[inline(always)]
fn ends<S: Simd>(simd: S, values: &[u32], block: usize) -> u32 {
    let these = &values[block..];
    match (these.first_chunk(), these.get(1..).and_then(<[u32]>::first_chunk)) {
        (Some(these), Some(next)) => simd.differing(simd.load_int(these), simd.load_int(next)),
        _ => {
            let pairs = these.windows(2).zip(0_u32..);
            pairs.fold(0, |ends, (pair, lane)| ends | u32::from(pair[0] != pair[1]) << lane)
        }
    }
}

/// Draw one face of the hemicube whose pieces stand ready.
struct DrawFace<'a> {
    scratch: &'a mut Scratch,
    face: Face,
    view: &'a View,
}

impl simd::Kernel for DrawFace<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Scratch { buffer, pieces, .. } = self.scratch;
        buffer.draw_pieces(simd, self.face.pieces(pieces), self.view);
    }
}

/// Find one row.
struct FindRow<'a, 'b> {
    hemicube: &'a Hemicube<'b>,
    patch: usize,
    scratch: &'a mut Scratch,
}

impl simd::Kernel for FindRow<'_, '_> {
    type Output = Row;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Row {
        self.hemicube.find_row(simd, self.patch, self.scratch)
    }
}
