//! Along a row of a face, the runs of cells that show the same, and the patches that a facet of many shows.

use glam::DVec3;

use crate::simd::{LANES, Simd};
use crate::visibility::{Cells, Facet, View};

/// Runs of cells with equal labels along one row, in order.
#[derive(Clone, Debug, Default)]
pub(super) struct Runs {
    count: usize,
    /// Of each its label, and the column it begins at.
    label: Vec<u32>,
    from: Vec<u32>,
}

/// No facet's label, nor a patch's.
const NO_LABEL: i32 = -1;

impl Runs {
    /// Room for all the runs that a row of `width` cells may have.
    pub(super) fn make_room(&mut self, width: usize) {
        self.label.resize(width + LANES, 0);
        self.from.resize(width + LANES, 0);
    }

    /// Forget all.
    #[inline(always)]
    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    /// How many.
    #[inline(always)]
    pub(super) fn len(&self) -> usize {
        self.count
    }

    /// The label of run `k`, and the columns from which and up to which it goes, in a row of `width` cells.
    #[inline(always)]
    pub(super) fn get(&self, k: usize, width: usize) -> (u32, usize, usize) {
        let to = if k + 1 < self.count { self.from[k + 1] as usize } else { width };
        (self.label[k], self.from[k] as usize, to)
    }

    /// Those among the first `width` labels of a row; a block more stands there, which means nothing.
    #[inline(always)]
    pub(super) fn find<S: Simd>(&mut self, simd: S, labels: &[u32], width: usize) {
        let mut list = List { label: &mut self.label, from: &mut self.from, count: 0 };
        let mut earlier = simd.splat_int(NO_LABEL);
        for block in (0..width).step_by(LANES) {
            let these = simd.load_int(labels[block..].first_chunk().expect("a block more than the row"));
            let begin = begin(simd, earlier, these, width - block);
            // Few facets: most blocks show one.
            if begin != 0 {
                list.push(simd, begin, block, these);
            }
            earlier = these;
        }
        self.count = list.count;
    }

    #[inline(always)]
    pub(super) fn push(&mut self, label: u32, from: usize) {
        self.label[self.count] = label;
        self.from[self.count] = from as u32;
        self.count += 1;
    }

    /// Add the weights of each run to its patch, half its label: `sums` are those of the row's first 0, 1, ... `width` cells.
    #[inline(always)]
    pub(super) fn add_to(&mut self, row: &mut [f64], sums: &[f64], width: usize) {
        self.from[self.count] = width as u32;
        let mut before = 0.0;
        for (&label, &to) in self.label[..self.count].iter().zip(&self.from[1..=self.count]) {
            let up_to = sums[to as usize];
            row[(label >> 1) as usize] += up_to - before;
            before = up_to;
        }
    }
}

/// [`Runs`] being found, its count in a register.
struct List<'a> {
    label: &'a mut [u32],
    from: &'a mut [u32],
    count: usize,
}

impl List<'_> {
    /// Those that begin in these lanes of the block at column `at`.
    #[inline(always)]
    fn push<S: Simd>(&mut self, simd: S, begin: u32, at: usize, labels: S::Ints) {
        let columns = simd.add_int(simd.ramp_int(), simd.splat_int(at as i32));
        let room = "a block more than the row";
        simd.compress_int(begin, labels, self.label[self.count..].first_chunk_mut().expect(room));
        simd.compress_int(begin, columns, self.from[self.count..].first_chunk_mut().expect(room));
        self.count += begin.count_ones() as usize;
    }
}

/// A bit for each of the first `count` labels of a block that is not the one before it; the first follows the last of
/// `earlier`.
#[inline(always)]
fn begin<S: Simd>(simd: S, earlier: S::Ints, labels: S::Ints, count: usize) -> u32 {
    simd.differing(labels, simd.shifted(earlier, labels)) & ((1 << count.min(LANES)) - 1)
}

/// The grid of patches of a facet as it appears on a face: linear forms over (x, y, 1) in cells. Along the ray
/// through a cell, u and v are quotients of two of them.
#[derive(Clone, Copy, Debug)]
pub(super) struct GridOnFace {
    pub(super) first: u32,
    columns: i32,
    rows: i32,
    /// (columns * u - 1/2) * inverse depth: rounding the quotient gives the column.
    across: DVec3,
    /// (rows * v - 1/2) * inverse depth.
    up: DVec3,
    inverse_depth: DVec3,
}

impl GridOnFace {
    #[inline(always)]
    pub(super) fn new(facet: &Facet, view: &View) -> Self {
        let (first, columns, rows) = match facet.cells {
            Cells::One(patch) => (patch, 1, 1),
            Cells::Grid { first, columns, rows } => (first, columns as i32, rows as i32),
        };
        // p = eye + d / inverse_depth, and u = (p - origin) · dual; so u inverse_depth is linear in d.
        let to_eye = view.eye - facet.origin;
        let inverse_depth = view.in_cells(facet.normal) / -facet.normal.dot(to_eye);
        let form = |dual: DVec3, cells: i32| {
            let coordinate = view.in_cells(dual) + inverse_depth * to_eye.dot(dual);
            coordinate * f64::from(cells) - inverse_depth * 0.5
        };
        let [dual_u, dual_v] = facet.duals();
        let (across, up) = (form(dual_u, columns), form(dual_v, rows));
        Self { first, columns, rows, across, up, inverse_depth }
    }

    /// Add to `runs` the patches that the cells from (x, y) along the row up to column `to` show, this facet being what is
    /// nearest.
    #[inline(always)]
    pub(super) fn find_runs<S: Simd>(&self, simd: S, at: [usize; 2], to: usize, runs: &mut Runs) {
        self.find::<S, false>(simd, at, to, runs);
    }

    /// The same where each cell of the grid is two of `patches`, one beyond the diagonal from (1, 0) to (0, 1).
    #[inline(always)]
    pub(super) fn find_runs_of_halves<S: Simd>(
        &self,
        simd: S,
        at: [usize; 2],
        to: usize,
        patches: &[u32],
        runs: &mut Runs,
    ) {
        let before = runs.count;
        self.find::<S, true>(simd, at, to, runs);
        for label in &mut runs.label[before..runs.count] {
            *label = 2 * patches[*label as usize];
        }
    }

    /// Runs of patches' labels; of `HALVES`, of the numbers that these have in the grid.
    #[inline(always)]
    fn find<S: Simd, const HALVES: bool>(&self, simd: S, [x, y]: [usize; 2], to: usize, runs: &mut Runs) {
        let most_across = simd.splat((self.columns - 1) as f32);
        let most_up = simd.splat((self.rows - 1) as f32);
        let first = if HALVES { 0 } else { self.first as i32 };
        let (first, columns) = (simd.splat_int(first), simd.splat_int(self.columns));
        let (across, up) = (Along::new(simd, self.across, y), Along::new(simd, self.up, y));
        let depth = Along::new(simd, self.inverse_depth, y);
        // Where the facet runs along the row, its distance is the same everywhere.
        let level = (depth.step * LEVEL).abs() < depth.start.abs();
        let (across, up) = match level {
            true => (across.times(simd, 1.0 / depth.start), up.times(simd, 1.0 / depth.start)),
            false => (across, up),
        };
        let mut at = x;
        let mut earlier = simd.splat_int(NO_LABEL);
        let mut list = List { label: &mut runs.label, from: &mut runs.from, count: runs.count };
        while at < to {
            let (mut column, mut row) = (across.at(simd, at), up.at(simd, at));
            if !level {
                let depth = simd.div(simd.splat(1.0), depth.at(simd, at));
                column = simd.mul(column, depth);
                row = simd.mul(row, depth);
            }
            let place = [column, row];
            let (column, row) = (rounded(simd, column, most_across), rounded(simd, row, most_up));
            let patch = simd.add_int(first, simd.add_int(simd.mul_int(row, columns), column));
            let mut labels = simd.add_int(patch, patch);
            if HALVES {
                // Beside the middle of the diagonal, in cells of the grid.
                let aside = simd
                    .add(simd.sub(place[0], simd.to_float(column)), simd.sub(place[1], simd.to_float(row)));
                let beyond = simd.greater(aside, simd.splat(0.0));
                labels = simd.add_int(labels, simd.select_int(beyond, simd.splat_int(1), simd.splat_int(0)));
            }
            list.push(simd, begin(simd, earlier, labels, to - at), at, labels);
            earlier = labels;
            at += LANES;
        }
        runs.count = list.count;
    }
}

/// A distance that changes by less than this share of itself from one cell to the next is the same along a row: 4096 cells,
/// the most there are, do not move a patch's edge by a thousandth of a cell.
const LEVEL: f64 = 1e11;

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

    /// This form times a number.
    #[inline(always)]
    fn times(self, simd: S, by: f64) -> Self {
        let step = self.step * by;
        let steps = simd.mul(simd.ramp(), simd.splat(step as f32));
        Self { start: self.start * by, step, steps }
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
