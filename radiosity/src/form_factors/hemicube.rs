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

use super::rows::{Elsewhere, Packing, Row};
use super::runs::{GridOnFace, Runs};
use crate::light::Rgb;
use crate::patches::Patches;
use crate::scene::BackFaces;
use crate::simd::{self, Level, Simd};
use crate::visibility::{
    Canvas, Cells, Facet, Facets, ItemBuffer, Labels, Lattices, RayTree, SCREENS, Screen, Sight, View, draw,
};

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

    /// Which of the hemicube's axes are the face's right, up and forward, and whether forward is along its axis or against it.
    pub(super) fn axes(self) -> ([usize; 3], f64) {
        match self {
            Self::Top => ([0, 1, 2], 1.0),
            Self::Right => ([1, 2, 0], 1.0),
            Self::Left => ([1, 2, 0], -1.0),
            Self::Back => ([0, 2, 1], 1.0),
            Self::Front => ([0, 2, 1], -1.0),
        }
    }

    /// What the face shows: a grid of cells seen from the centre of the hemicube.
    pub fn view(self, centre: DVec3, axes: [DVec3; 3], precision: usize) -> View {
        let ([right, up, forward], sign) = self.axes();
        let (bottom, height) = if self == Self::Top { (-1.0, precision) } else { (0.0, precision / 2) };
        let [across, upward] = BESIDE.map(|shift| shift * 2.0 / precision as f64);
        View {
            eye: centre,
            right: axes[right],
            up: axes[up],
            forward: axes[forward] * sign,
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
    axes_about(patches.normal[patch], patches.tangent_u[patch])
}

/// The axes of a hemicube on a surface of this unit normal, the first of them along a tangent.
pub fn axes_about(normal: DVec3, tangent: DVec3) -> [DVec3; 3] {
    let x = (tangent - normal * normal.dot(tangent)).try_normalize();
    let x = x.unwrap_or_else(|| normal.any_orthonormal_vector());
    [x, normal.cross(x), normal]
}

/// Where a hemicube stands, and its axes, as [`frame`] has them: two along the surface, and its normal.
#[derive(Clone, Copy, Debug)]
pub struct Eye {
    /// Where it stands.
    pub point: DVec3,
    /// Its axes.
    pub axes: [DVec3; 3],
}

impl Eye {
    /// At a patch's centre.
    pub fn at(patches: &Patches, patch: usize) -> Self {
        Self { point: patches.centre[patch], axes: frame(patches, patch) }
    }
}

/// What hemicubes are taken of, and how finely.
#[derive(Clone, Debug)]
pub struct Hemicube<'a> {
    patches: &'a Patches,
    facets: &'a Facets,
    /// What is drawn in their place, where triangles of theirs make lattices.
    lattices: Option<&'a Lattices>,
    back_faces: BackFaces,
    weights: CellWeights,
    horizon: f64,
    screens: [Screen; SCREENS],
    /// What each facet puts into the item buffer, seen from its front and from its back. Twice the number of its first patch,
    /// and one more where it carries several, so that of two equally near the first stays; [`dark`] where it
    /// sends no light that way.
    labels: Labels,
    /// For the first patch of each facet that carries several, the facet; empty where none does.
    facet_of: Vec<u32>,
}

/// Memory that one hemicube after another is worked out in.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    buffers: [ItemBuffer; SCREENS],
    canvas: Canvas,
    /// For the first patch of each facet of several, where its grid stands among those of this face, or [`UNPLACED`].
    place: Vec<u32>,
    grids: Vec<GridOnFace>,
    /// The runs of one row of cells, of facets and of patches.
    facets_seen: Runs,
    runs: Runs,
    row: Vec<f64>,
    packing: Packing,
}

impl Scratch {
    /// The dense row, with two more entries for what goes elsewhere.
    #[inline(always)]
    pub(super) fn row_mut(&mut self) -> &mut [f64] {
        &mut self.row
    }

    /// Where sparse rows are packed.
    pub(super) fn packing(&mut self) -> &mut Packing {
        &mut self.packing
    }

    /// Take what the faces show, and leave others to be drawn in.
    pub(super) fn swap_buffers(&mut self, others: &mut [ItemBuffer; SCREENS]) {
        std::mem::swap(&mut self.buffers, others);
    }
}

/// A grid that is not among those of this face.
const UNPLACED: u32 = u32::MAX;

/// The label of a cell that sees nothing at all: of a patch beyond the last.
fn nothing(patches: &Patches) -> u32 {
    2 * patches.len() as u32
}

/// The label of what is seen and sends no light, black backs: of a patch beyond that.
fn dark(patches: &Patches) -> u32 {
    nothing(patches) + 2
}

impl<'a> Hemicube<'a> {
    /// Hemicubes at the centres of `patches` seeing `facets`.
    pub fn new(
        patches: &'a Patches,
        facets: &'a Facets,
        back_faces: BackFaces,
        weights: CellWeights,
    ) -> Self {
        Self::drawing(patches, facets, facets.lattices(), back_faces, weights)
    }

    /// The same, each facet drawn by itself: what a cell of the item buffer holds is a label of that facet.
    pub(super) fn facet_by_facet(self) -> Self {
        Self::drawing(self.patches, self.facets, None, self.back_faces, self.weights)
    }

    fn drawing(
        patches: &'a Patches,
        facets: &'a Facets,
        lattices: Option<&'a Lattices>,
        back_faces: BackFaces,
        weights: CellWeights,
    ) -> Self {
        let drawn = lattices.map_or(facets, |lattices| &lattices.facets);
        let screens = Face::ALL.map(|face| {
            let (axes, sign) = face.axes();
            Screen::new(&face.view(DVec3::ZERO, DVec3::AXES, weights.precision), axes, sign)
        });
        let mut facet_of = Vec::new();
        let mut front = Vec::with_capacity(drawn.as_slice().len());
        for (facet, number) in drawn.as_slice().iter().zip(0..) {
            front.push(match facet.cells {
                Cells::One(patch) | Cells::Grid { first: patch, columns: 1, rows: 1 } => 2 * patch,
                Cells::Grid { first, .. } => {
                    facet_of.resize(patches.len(), 0);
                    facet_of[first as usize] = number;
                    2 * first + 1
                }
            });
        }
        let of = |facet: u32| front[facet as usize];
        let back = |facet: u32| match back_faces {
            BackFaces::Lit => of(facet),
            BackFaces::Black => dark(patches),
        };
        let (horizon, labels) = (HORIZON * facets.extent(), drawn.labels(of, back));
        Self { patches, facets, lattices, back_faces, weights, horizon, screens, labels, facet_of }
    }

    /// The facets that are drawn.
    #[inline(always)]
    fn drawn(&self) -> &'a Facets {
        self.lattices.map_or(self.facets, |lattices| &lattices.facets)
    }

    /// What the hemicube at a patch sees.
    fn sight(&self, patch: usize) -> Sight<'_> {
        self.sight_from(Eye::at(self.patches, patch))
    }

    /// What a hemicube anywhere sees.
    pub(super) fn sight_from(&self, eye: Eye) -> Sight<'_> {
        Sight {
            eye: eye.point,
            axes: eye.axes,
            horizon: Some(self.horizon),
            labels: &self.labels,
            dark_above: nothing(self.patches),
        }
    }

    /// The cells' weights.
    pub fn weights(&self) -> &CellWeights {
        &self.weights
    }

    /// The sums of the first 0, 1, ... N weights along a row of a face.
    #[inline(always)]
    pub(super) fn sums(&self, face: Face, y: usize) -> &[f64] {
        self.weights.rows(face).row(y)
    }

    /// Row i by the item buffer: each face is rasterised, the patch that each cell shows follows from (u, v), and
    /// the weights of a run of cells that show one patch are added at once, as a difference of prefix sums.
    pub fn row(&self, patch: usize, scratch: &mut Scratch) -> Row {
        self.row_at(Level::best(), patch, scratch)
    }

    /// The same with no more of the processor than `level`; the bits do not depend on it.
    pub fn row_at(&self, level: Level, patch: usize, scratch: &mut Scratch) -> Row {
        self.row_by(level, Eye::at(self.patches, patch), scratch)
    }

    /// The row of a hemicube that stands anywhere: the form factors of a point to all patches.
    pub fn row_from(&self, eye: Eye, scratch: &mut Scratch) -> Row {
        self.row_by(Level::best(), eye, scratch)
    }

    fn row_by(&self, level: Level, eye: Eye, scratch: &mut Scratch) -> Row {
        self.fill_row(level, &self.sight_from(eye), scratch);
        let (seen, elsewhere) = scratch.row.split_at_mut(self.patches.len());
        let [surroundings, backs] = [0, 1].map(|k| std::mem::take(&mut elsewhere[k]));
        Row::take_dense(seen, &mut scratch.packing).with_elsewhere(Elsewhere { surroundings, backs })
    }

    /// The light that arrives at any point of a surface, where each patch sends its part of `light`, and what lies about the
    /// scene `surroundings`: as [`Hemicube::row`] would gather it.
    pub fn gather(&self, eye: Eye, light: &[Rgb], surroundings: Rgb, scratch: &mut Scratch) -> Rgb {
        self.fill_row(Level::best(), &self.sight_from(eye), scratch);
        let (seen, elsewhere) = scratch.row.split_at_mut(self.patches.len());
        let mut sum = surroundings * elsewhere[0];
        elsewhere.fill(0.0);
        for (share, &light) in seen.iter_mut().zip(light) {
            if *share != 0.0 {
                sum += light * std::mem::take(share);
            }
        }
        sum
    }

    /// Add what is seen from anywhere to the dense row ([`Scratch::row_mut`]). Whoever reads that leaves zeros behind.
    pub(super) fn look(&self, level: Level, eye: Eye, scratch: &mut Scratch) {
        self.fill_row(level, &self.sight_from(eye), scratch);
    }

    /// Add what `sight` sees to the dense row, and to its two more entries, for what goes elsewhere. Whoever reads the row leaves
    /// zeros behind.
    fn fill_row(&self, level: Level, sight: &Sight<'_>, scratch: &mut Scratch) {
        match self.lattices {
            None => simd::run(level, FillRow::<false> { hemicube: self, sight, scratch }),
            Some(_) => simd::run(level, FillRow::<true> { hemicube: self, sight, scratch }),
        }
    }

    /// The same, with these registers. `LATTICES`: whether any facet is one.
    #[inline(always)]
    fn fill_row_with<S: Simd, const LATTICES: bool>(
        &self,
        simd: S,
        sight: &Sight<'_>,
        scratch: &mut Scratch,
    ) {
        let Scratch { buffers, canvas, place, grids, facets_seen, runs, row, .. } = scratch;
        row.resize(self.patches.len() + 2, 0.0);
        place.resize(self.patches.len(), UNPLACED);
        let width = self.weights.precision;
        facets_seen.make_room(width);
        runs.make_room(width);
        draw(simd, self.drawn(), sight, &self.screens, nothing(self.patches), &mut *buffers, canvas);
        for (face, buffer) in Face::ALL.into_iter().zip(buffers) {
            let view = face.view(sight.eye, sight.axes, width);
            for y in 0..view.height {
                if !self.facet_of.is_empty() {
                    // Where a facet carries many patches its run is many.
                    facets_seen.find(simd, buffer.labels(y), width);
                    runs.clear();
                    for k in 0..facets_seen.len() {
                        let (label, from, to) = facets_seen.get(k, width);
                        if label & 1 == 0 {
                            runs.push(label, from);
                            continue;
                        }
                        let first = (label >> 1) as usize;
                        if place[first] == UNPLACED {
                            place[first] = grids.len() as u32;
                            grids.push(GridOnFace::new(&self.drawn()[self.facet_of[first]], &view));
                        }
                        let grid = &grids[place[first] as usize];
                        if LATTICES && let Some(patches) = self.lattice(first) {
                            grid.find_runs_of_halves(simd, [from, y], to, patches, runs);
                        } else {
                            grid.find_runs(simd, [from, y], to, runs);
                        }
                    }
                } else {
                    runs.find(simd, buffer.labels(y), width);
                }
                runs.add_to(row, self.weights.rows(face).row(y), width);
            }
            for grid in grids.drain(..) {
                place[grid.first as usize] = UNPLACED;
            }
        }
    }

    /// The patches of the lattice that begins with this one, if one does.
    #[inline(always)]
    fn lattice(&self, first: usize) -> Option<&'a [u32]> {
        self.lattices.and_then(|lattices| lattices.patches(self.facet_of[first]))
    }

    /// Row i as the assignment has it (`FacteursFormePiece`): one ray a cell, the nearest hit, its weight added
    /// to the patch it hits. The reference that [`Hemicube::row`] is held against.
    pub fn row_by_rays(&self, patch: usize, tree: &RayTree<'_>) -> Row {
        let count = self.patches.len();
        let mut row = vec![0.0; count + 2];
        for face in Face::ALL {
            let sums = self.weights.rows(face);
            let width = self.weights.precision;
            for (k, label) in self.labels_by_rays(patch, face, tree).into_iter().enumerate() {
                row[label as usize / 2] += sums.between(k / width, k % width, k % width + 1);
            }
        }
        let elsewhere = Elsewhere { surroundings: row[count], backs: row[count + 1] };
        Row::from_dense(&row[..count]).with_elsewhere(elsewhere)
    }

    /// The patch that each cell of a face sees, by one ray a cell; row by row from the bottom.
    pub fn face_by_rays(&self, patch: usize, face: Face, tree: &RayTree<'_>) -> Vec<Option<u32>> {
        let patch_of = |label| (label < nothing(self.patches)).then_some(label / 2);
        self.labels_by_rays(patch, face, tree).into_iter().map(patch_of).collect()
    }

    /// The same as labels: twice the patch, or what stands for none.
    fn labels_by_rays(&self, patch: usize, face: Face, tree: &RayTree<'_>) -> Vec<u32> {
        let centre = self.patches.centre[patch];
        let view = face.view(centre, frame(self.patches, patch), self.weights.precision);
        let normal = self.patches.normal[patch];
        let label = |number: u32| {
            let facet = &self.facets[number];
            // What sends no light gives way to what does.
            let dark = u32::from(!self.shows_light(facet, centre));
            self.is_above(facet, centre, normal).then_some(dark)
        };
        let cells = (0..view.height).flat_map(|y| (0..view.width).map(move |x| (x, y)));
        cells
            .map(|(x, y)| {
                let direction = view.direction(x as f64, y as f64);
                let Some(hit) = tree.nearest(centre, direction, f64::INFINITY, label) else {
                    return nothing(self.patches);
                };
                let facet = &self.facets[hit.facet];
                match self.shows_light(facet, centre) {
                    true => 2 * facet.patch_at(hit.u, hit.v),
                    false => dark(self.patches),
                }
            })
            .collect()
    }

    /// The patch that each cell of a face sees, by the item buffer; row by row from the bottom.
    pub fn face(&self, patch: usize, face: Face, scratch: &mut Scratch) -> Vec<Option<u32>> {
        let sight = self.sight(patch);
        let view = face.view(sight.eye, sight.axes, self.weights.precision);
        simd::run(Level::best(), DrawFace { hemicube: self, sight: &sight, face, scratch });
        let cells = (0..view.height).flat_map(|y| (0..view.width).map(move |x| (x, y)));
        cells
            .map(|(x, y)| {
                let label = scratch.buffers[0].facets(y)[x];
                let first = label >> 1;
                if label >= nothing(self.patches) {
                    return None;
                }
                if label & 1 == 0 {
                    return Some(first);
                }
                let number = self.facet_of[first as usize];
                let facet = &self.drawn()[number];
                let direction = view.direction(x as f64, y as f64);
                let (u, v) = facet.uv(view.eye + direction * facet.plane_distance(view.eye, direction));
                Some(match self.lattices {
                    None => facet.patch_at(u, v),
                    Some(lattices) => lattices.patch_at(number, u, v),
                })
            })
            .collect()
    }

    /// Whether a facet can be seen from a patch's centre: it reaches above the patch's plane (a flat surface never
    /// reaches above its own), and its own plane does not pass through the centre, edge-on.
    fn is_above(&self, facet: &Facet, centre: DVec3, normal: DVec3) -> bool {
        facet.greatest_height(centre, normal) > self.horizon
            && facet.normal.dot(facet.origin - centre).abs() > self.horizon
    }

    /// Whether what `eye` sees of a facet sends light: its front does, its back where back faces are lit.
    fn shows_light(&self, facet: &Facet, eye: DVec3) -> bool {
        self.back_faces == BackFaces::Lit || facet.faces(eye)
    }
}

/// Draw one face of the hemicube into the first buffer.
struct DrawFace<'a, 'b> {
    hemicube: &'a Hemicube<'b>,
    sight: &'a Sight<'a>,
    face: Face,
    scratch: &'a mut Scratch,
}

impl simd::Kernel for DrawFace<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { hemicube, sight, face, scratch } = self;
        let screens = &hemicube.screens[face as usize..][..1];
        let (buffers, nothing) = (&mut scratch.buffers[..1], nothing(hemicube.patches));
        draw(simd, hemicube.drawn(), sight, screens, nothing, buffers, &mut scratch.canvas);
    }
}

/// Fill the dense row with what is seen.
struct FillRow<'a, 'b, const LATTICES: bool> {
    hemicube: &'a Hemicube<'b>,
    sight: &'a Sight<'a>,
    scratch: &'a mut Scratch,
}

impl<const LATTICES: bool> simd::Kernel for FillRow<'_, '_, LATTICES> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        self.hemicube.fill_row_with::<S, LATTICES>(simd, self.sight, self.scratch);
    }
}
