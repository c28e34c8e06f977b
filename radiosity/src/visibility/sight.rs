//! An eye, and the screens it looks through.

use glam::DVec3;

use super::View;
use super::blocks::Labels;
use crate::simd::Simd;

/// Facets reach this much beyond their edges, in cells (city-block distance). Where three edges meet in a
/// T, or two edges were placed by different arithmetic, rounding would otherwise open a gap that a cell's
/// centre can fall through; cells that symmetric scenes put exactly on an edge make that likely.
pub(super) const EDGE_TOLERANCE: f64 = 4e-6;

/// What bounds a facet or a box from outside is computed in single precision and taken wider by this, relative to the
/// numbers it is made of.
pub(super) const SLACK: f32 = 2e-6;

/// An eye, and what it is to see.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight<'a> {
    /// Where it is.
    pub(crate) eye: DVec3,
    /// Unit vectors at right angles. The third is the zenith where there is a horizon.
    pub(crate) axes: [DVec3; 3],
    /// Only facets that rise above the plane of the first two axes by more than this are seen, and only those whose own plane
    /// passes the eye farther than this. `None`: all.
    pub(crate) horizon: Option<f64>,
    /// What each facet puts into the cells it covers.
    pub(crate) labels: &'a Labels,
    /// Labels above this are of what sends no light. A solid's back would else be seen past its silhouette, where the fronts that
    /// hide it end in the same edge: it reaches less far than they.
    pub(crate) dark_above: u32,
}

/// A view's cells in the axes of a [`Sight`], wherever its eye is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Screen {
    /// Which of the sight's axes are the view's right, up and forward.
    pub(super) axes: [usize; 3],
    /// Whether forward is along that axis (1) or against it (-1).
    pub(super) sign: f64,
    /// Of columns, then of rows: a cell's size, and where the centre of the first lies.
    pub(super) size: [f64; 2],
    pub(super) first: [f64; 2],
    /// Of columns, then of rows: how many.
    pub(super) cells: [usize; 2],
    pub(super) near: f64,
    pub(super) far: f64,
}

impl Screen {
    /// The screen of `view`, whose right, up and forward are these of the sight's axes, forward times `sign`.
    pub(crate) fn new(view: &View, axes: [usize; 3], sign: f64) -> Self {
        let size = [view.cell_width(), view.cell_height()];
        Self {
            axes,
            sign,
            size,
            first: [view.horizontal[0] + 0.5 * size[0], view.vertical[0] + 0.5 * size[1]],
            cells: [view.width, view.height],
            near: view.near,
            far: view.far,
        }
    }

    /// The cells' edges, in order, along columns (0) or rows (1).
    pub(super) fn sides(&self, along: usize) -> [f64; 2] {
        let from = self.first[along] - 0.5 * self.size[along];
        let to = from + self.size[along] * self.cells[along] as f64;
        if from < to { [from, to] } else { [to, from] }
    }

    /// How far bounds in cells are moved outwards, along columns (0) or rows (1).
    fn slack(&self, along: usize) -> f32 {
        let [from, to] = self.sides(along);
        let size = self.size[along].abs();
        (f64::from(SLACK) * from.abs().max(to.abs()) / size + EDGE_TOLERANCE) as f32
    }

    /// The cells from which and up to which a facet or box may cover, given where its sides are seen along columns or rows
    /// (at distance 1), or all of them where it is not wholly `before` the eye.
    #[inline(always)]
    pub(super) fn cells_between<S: Simd>(
        &self,
        simd: S,
        along: usize,
        [low, high]: [S::Floats; 2],
        before: S::Mask,
    ) -> [S::Ints; 2] {
        let scale = simd.splat((1.0 / self.size[along]) as f32);
        let shift = simd.splat((-self.first[along] / self.size[along]) as f32);
        let slack = simd.splat(self.slack(along));
        let (a, b) = (simd.add(simd.mul(low, scale), shift), simd.add(simd.mul(high, scale), shift));
        // In this order a number that is none becomes the bound.
        let (least, most) = (simd.splat(-1.0), simd.splat(self.cells[along] as f32));
        let low = simd.sub(simd.min(a, b), slack);
        let high = simd.add(simd.max(a, b), slack);
        let low = simd.min(simd.max(simd.select(before, low, least), least), most);
        let high =
            simd.min(simd.max(simd.select(before, high, most), least), simd.sub(most, simd.splat(0.5)));
        // One more, cut to the whole part: the first cell not before `low`, and the one past the last not after `high`.
        let one = simd.splat(1.0);
        [simd.to_int(simd.add(low, one)), simd.to_int(simd.add(high, one))]
    }
}
