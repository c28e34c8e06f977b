//! The facets of a block before an eye: placed, projected onto a screen, and put into its buffer.
//!
//! A facet is covered by edge functions in homogeneous coordinates (\[OG97\] Olano & Greer, Triangle Scan Conversion using
//! 2D Homogeneous Coordinates, 1997): with the eye at the origin, the edge from corner a to corner b lets through the
//! directions d with d · (a × b) >= 0. Nothing is divided before the decision, so a facet may pass beside and behind the
//! eye; two facets that share an edge compute the same numbers up to sign, so no cell falls between them.

#![allow(
    clippy::needless_range_loop,
    reason = "columns are indexed alike; what iterators are adapted by is not compiled for the wide registers"
)]

use super::blocks::Block;
use super::item_buffer::{ItemBuffer, Stamp};
use super::sight::{EDGE_TOLERANCE, SLACK, Screen, Sight};
use super::vectors::{
    Registers, Vectors, add, cross, dot, load, magnitude, scale, splat, splat_axes, store, turn,
};
use crate::simd::{LANES, Simd};

/// A facet whose plane passes the eye closer than this, relative to its distance, is seen edge-on: it covers
/// nothing.
const EDGE_ON: f64 = 1e-10;

/// A facet that may cover no more columns and rows than this is small: its edges are asked at each of those cells, for all
/// small facets of the block at once. Of others, the columns from and to which they cover each row are found.
const SMALL: usize = 4;

/// A facet is steep where its inverse depth changes by more than this from one cell to the next, times the inverse of how far
/// its farthest corner is: else sixteen cells are found from the first to within 2e-6 in single precision.
const STEEP: f64 = 0.5;

/// Rows whose spans are found together.
const ROWS: usize = LANES;

/// The facets of a block before an eye, and then on one screen.
#[derive(Clone, Debug)]
pub(super) struct Placed {
    /// A bit for each facet that may be seen, and for each whose front is.
    pub(super) seen: u32,
    fronts: u32,
    labels: [u32; LANES],
    /// A bit for each that sends no light this way.
    dark: u32,
    /// How many corners count: 3 where all are triangles.
    corners: usize,
    /// The corners, in the sight's axes about the eye, rounded.
    corner: [[[f32; LANES]; 3]; 4],
    /// How far the farthest of them is.
    reach: [f32; LANES],
    /// The edges as forms over directions, positive within, from each corner to the next.
    edge: [Vectors; 4],
    /// 1 / distance, as a form over directions.
    inverse_depth: Vectors,

    /// A bit for each facet that may cover cells of the screen: few of them, or many.
    pub(super) small: u32,
    pub(super) large: u32,
    /// The columns, then the rows, from which and up to which it may.
    bounds: [[u32; LANES]; 4],
    /// Of large facets, edges that bound from the left, as column = slope * row + start; those of other edges bound nothing.
    left: [[[f64; LANES]; 2]; 4],
    /// Edges that bound from the right.
    right: [[[f64; LANES]; 2]; 4],
    /// Of small facets, the edges as forms over columns and rows beyond their first, and 1.
    inside: [[[f32; LANES]; 3]; 4],
    /// 1 / distance along the screen's forward, over (column, row, 1).
    nearness: Vectors,
}

impl Default for Placed {
    fn default() -> Self {
        Self {
            seen: 0,
            fronts: 0,
            labels: [0; LANES],
            dark: 0,
            corners: 0,
            corner: [[[0.0; LANES]; 3]; 4],
            reach: [0.0; LANES],
            edge: [[[0.0; LANES]; 3]; 4],
            inverse_depth: [[0.0; LANES]; 3],
            small: 0,
            large: 0,
            bounds: [[0; LANES]; 4],
            left: [[[0.0; LANES]; 2]; 4],
            right: [[[0.0; LANES]; 2]; 4],
            inside: [[[0.0; LANES]; 3]; 4],
            nearness: [[0.0; LANES]; 3],
        }
    }
}

impl Placed {
    /// Place a block before the eye. Differences are taken in double precision, so that nearness keeps its digits.
    #[inline(always)]
    pub(super) fn place<S: Simd>(&mut self, simd: S, block: &Block, sight: &Sight<'_>) {
        let axes = splat_axes(simd, sight.axes);
        let origin = add(simd, load(simd, &block.origin), splat(simd, -sight.eye));
        let a = turn(simd, &axes, origin);
        let u = turn(simd, &axes, load(simd, &block.u));
        let v = turn(simd, &axes, load(simd, &block.v));
        let normal = cross(simd, u, v);
        let offset = dot(simd, normal, a);
        let along_u = add(simd, a, u);
        let along_v = add(simd, a, v);
        let mut corner = [a, along_u, along_v, along_v];
        self.corners = 3;
        if !block.triangles {
            corner[2] = add(simd, along_v, scale(simd, u, simd.load_double(&block.opposite)));
            self.corners = 4;
        }

        let zero = simd.splat_double(0.0);
        let (mut reach, mut top) = (zero, simd.splat_double(f64::NEG_INFINITY));
        for k in 0..self.corners {
            reach = simd.max_double(dot(simd, corner[k], corner[k]), reach);
            top = simd.max_double(corner[k][2], top);
            for axis in 0..3 {
                simd.store(simd.narrow(corner[k][axis]), &mut self.corner[k][axis]);
            }
        }
        // Not seen edge-on, and above the horizon.
        let squared = simd.mul_double(offset, offset);
        let length = dot(simd, normal, normal);
        let edge_on = simd.mul_double(reach, simd.splat_double(EDGE_ON * EDGE_ON));
        let mut seen = simd.lanes(simd.greater_double(squared, simd.mul_double(edge_on, length)));
        seen &= !0 >> (u32::BITS - block.count as u32);
        if let Some(horizon) = sight.horizon {
            let flush = simd.mul_double(length, simd.splat_double(horizon * horizon));
            seen &= simd.lanes(simd.greater_double(squared, flush));
            seen &= simd.lanes(simd.greater_double(top, simd.splat_double(horizon)));
        }
        self.seen = seen;
        if seen == 0 {
            return;
        }
        // The sight's axes may be left-handed, and with them the product u × v.
        let behind = simd.greater_double(offset, zero);
        let [right, up, forward] = sight.axes;
        let mirrored = if right.cross(up).dot(forward) < 0.0 { u32::MAX } else { 0 };
        self.fronts = !(simd.lanes(behind) ^ block.flipped ^ mirrored);
        let side = simd.select_double(behind, simd.splat_double(1.0), simd.splat_double(-1.0));
        for k in 0..self.corners {
            let next = if k + 1 < self.corners { k + 1 } else { 0 };
            let edge = cross(simd, corner[k], corner[next]);
            store(simd, scale(simd, edge, side), &mut self.edge[k]);
        }
        // The plane n·p = offset meets the ray t d at 1/t = n·d / offset.
        let inverse = simd.div_double(simd.splat_double(1.0), offset);
        store(simd, scale(simd, normal, inverse), &mut self.inverse_depth);
        simd.store(simd.root(simd.narrow(reach)), &mut self.reach);
    }

    /// Find where on a screen the facets may be seen, and their outlines there.
    #[inline(always)]
    pub(super) fn project<S: Simd>(&mut self, simd: S, screen: &Screen) {
        let [right, up, forward] = screen.axes;
        let sign = simd.splat(screen.sign as f32);
        let (most, none) = (simd.splat(f32::INFINITY), simd.splat(f32::NEG_INFINITY));
        let (mut near, mut far) = (most, none);
        let (mut low, mut high) = ([most; 2], [none; 2]);
        for corner in &self.corner[..self.corners] {
            let z = simd.mul(simd.load(&corner[forward]), sign);
            near = simd.min(z, near);
            far = simd.max(z, far);
            let inverse = simd.div(simd.splat(1.0), z);
            for (along, axis) in [right, up].into_iter().enumerate() {
                let at = simd.mul(simd.load(&corner[axis]), inverse);
                low[along] = simd.min(at, low[along]);
                high[along] = simd.max(at, high[along]);
            }
        }
        let before = simd.greater(near, simd.mul(simd.load(&self.reach), simd.splat(SLACK)));
        let mut drawn = self.seen & simd.lanes(simd.greater(far, simd.splat(0.0)));
        let mut small = drawn;
        for along in 0..2 {
            let [from, to] = screen.cells_between(simd, along, [low[along], high[along]], before);
            drawn &= simd.lanes(simd.greater_int(to, from));
            small &= !simd.lanes(simd.greater_int(simd.sub_int(to, from), simd.splat_int(SMALL as i32)));
            simd.store_int(from, &mut self.bounds[2 * along]);
            simd.store_int(to, &mut self.bounds[2 * along + 1]);
        }
        if drawn & !simd.lanes(before) != 0 {
            drawn &= !self.beyond(simd, screen);
        }
        (self.small, self.large) = (drawn & small, drawn & !small);
        if drawn == 0 {
            return;
        }
        store(simd, in_cells(simd, screen, &self.inverse_depth), &mut self.nearness);
        let [first_column, first_row] = self.first_cells(simd);
        let tolerance = simd.splat(EDGE_TOLERANCE as f32);
        let less = simd.mul(tolerance, simd.splat(-1.0));
        let tolerance = simd.widen(simd.select(simd.mask(self.dark), less, tolerance));
        for k in 0..self.corners {
            let [x, y, z] = in_cells(simd, screen, &self.edge[k]);
            let reach = simd.add_double(magnitude(simd, x), magnitude(simd, y));
            let z = simd.add_double(z, simd.mul_double(reach, tolerance));
            if self.small != 0 {
                let over = simd.add_double(simd.mul_double(x, first_column), simd.mul_double(y, first_row));
                simd.store(simd.narrow(x), &mut self.inside[k][0]);
                simd.store(simd.narrow(y), &mut self.inside[k][1]);
                simd.store(simd.narrow(simd.add_double(over, z)), &mut self.inside[k][2]);
            }
            if self.large != 0 {
                self.bound(simd, k, [x, y, z], reach);
            }
        }
    }

    /// The first column and row that each facet may cover.
    #[inline(always)]
    fn first_cells<S: Simd>(&self, simd: S) -> [S::Doubles; 2] {
        let (column, row) = (simd.load_int(&self.bounds[0]), simd.load_int(&self.bounds[2]));
        [simd.widen(simd.to_float(column)), simd.widen(simd.to_float(row))]
    }

    /// Keep edge k as what it bounds: what has `x column + y row + z >= 0` is inside.
    #[inline(always)]
    fn bound<S: Simd>(&mut self, simd: S, k: usize, [x, y, z]: Registers<S>, reach: S::Doubles) {
        let zero = simd.splat_double(0.0);
        // An edge along a row bounds from one side or the other, infinitely steeply: all of a row, or nothing. One without
        // length bounds nothing, for it gives no number.
        let least = simd.mul_double(reach, simd.splat_double(1e-30));
        let x = simd.select_double(simd.greater_double(magnitude(simd, x), least), x, least);
        let minus_inverse = simd.div_double(simd.splat_double(-1.0), x);
        let (slope, start) = (simd.mul_double(y, minus_inverse), simd.mul_double(z, minus_inverse));
        let (is_left, is_right) = (simd.greater_double(x, zero), simd.greater_double(zero, x));
        simd.store_double(simd.select_double(is_left, slope, zero), &mut self.left[k][0]);
        let nowhere = simd.splat_double(-1e30);
        simd.store_double(simd.select_double(is_left, start, nowhere), &mut self.left[k][1]);
        simd.store_double(simd.select_double(is_right, slope, zero), &mut self.right[k][0]);
        let nowhere = simd.splat_double(1e30);
        simd.store_double(simd.select_double(is_right, start, nowhere), &mut self.right[k][1]);
    }

    /// A bit for each facet that lies wholly beyond one side of the screen.
    #[inline(always)]
    fn beyond<S: Simd>(&self, simd: S, screen: &Screen) -> u32 {
        let [right, up, forward] = screen.axes;
        let sign = simd.splat(screen.sign as f32);
        let (zero, none) = (simd.splat(0.0), simd.splat(f32::NEG_INFINITY));
        let mut beyond = 0;
        for (along, axis) in [right, up].into_iter().enumerate() {
            let [from, to] = screen.sides(along);
            let (from, to) = (simd.splat(from as f32), simd.splat(to as f32));
            let mut within = [none; 2];
            for corner in &self.corner[..self.corners] {
                let (at, z) = (simd.load(&corner[axis]), simd.mul(simd.load(&corner[forward]), sign));
                within[0] = simd.max(simd.sub(at, simd.mul(from, z)), within[0]);
                within[1] = simd.max(simd.sub(simd.mul(to, z), at), within[1]);
            }
            beyond |= simd.lanes(simd.greater(zero, within[0]));
            beyond |= simd.lanes(simd.greater(zero, within[1]));
        }
        beyond
    }

    /// Give each facet the label of the side that is seen.
    #[inline(always)]
    pub(super) fn label<S: Simd>(&mut self, simd: S, [front, back]: &[[u32; LANES]; 2], dark_above: u32) {
        let fronts = simd.mask(self.fronts);
        let label = simd.select_int(fronts, simd.load_int(front), simd.load_int(back));
        simd.store_int(label, &mut self.labels);
        self.dark = simd.lanes(simd.greater_int(label, simd.splat_int(dark_above as i32)));
    }

    /// Put the facets into the screen's buffer.
    #[inline(always)]
    pub(super) fn fill<S: Simd>(&self, simd: S, screen: &Screen, buffer: &mut ItemBuffer) {
        let nearest = ((1.0 / screen.near) as f32).next_up();
        if self.small != 0 {
            self.fill_small(simd, nearest, buffer);
        }
        let mut left = self.large;
        while left != 0 {
            let lane = left.trailing_zeros() as usize % LANES;
            left &= left - 1;
            // The inverse of how far the farthest corner is, is the least inverse depth there is to tell.
            let [step, reach] = [self.nearness[0][lane].abs(), f64::from(self.reach[lane])];
            if step * reach <= STEEP {
                self.fill_large::<S, false>(simd, lane, nearest, buffer);
            } else {
                self.fill_large::<S, true>(simd, lane, nearest, buffer);
            }
        }
    }

    /// Ask every small facet's edges at every cell it may cover: a cell of each facet at a time.
    #[inline(always)]
    fn fill_small<S: Simd>(&self, simd: S, nearest: f32, buffer: &mut ItemBuffer) {
        let wide = simd.sub_int(simd.load_int(&self.bounds[1]), simd.load_int(&self.bounds[0]));
        let tall = simd.sub_int(simd.load_int(&self.bounds[3]), simd.load_int(&self.bounds[2]));
        let [x, y, z] = load(simd, &self.nearness);
        let [first_column, first_row] = self.first_cells(simd);
        let over = simd.add_double(simd.mul_double(x, first_column), simd.mul_double(y, first_row));
        let start = simd.add_double(over, z);
        let (zero, mut depths) = (simd.splat(0.0), [0.0; LANES]);
        let mut in_row = self.small;
        for row in 0..SMALL {
            in_row &= simd.lanes(simd.greater_int(tall, simd.splat_int(row as i32)));
            if in_row == 0 {
                break;
            }
            let along = simd.splat(row as f32);
            let mut edges = [zero; 4];
            for k in 0..self.corners {
                let form = &self.inside[k];
                edges[k] = simd.add(simd.load(&form[2]), simd.mul(simd.load(&form[1]), along));
            }
            let nearness = simd.add_double(start, simd.mul_double(y, simd.splat_double(row as f64)));
            let mut in_column = in_row;
            for column in 0..SMALL {
                in_column &= simd.lanes(simd.greater_int(wide, simd.splat_int(column as i32)));
                if in_column == 0 {
                    break;
                }
                let mut outside = 0;
                for k in 0..self.corners {
                    outside |= simd.lanes(simd.greater(zero, edges[k]));
                    edges[k] = simd.add(edges[k], simd.load(&self.inside[k][0]));
                }
                let mut covered = in_column & !outside;
                if covered == 0 {
                    continue;
                }
                let along = simd.mul_double(x, simd.splat_double(column as f64));
                simd.store(simd.narrow(simd.add_double(nearness, along)), &mut depths);
                while covered != 0 {
                    let lane = covered.trailing_zeros() as usize % LANES;
                    covered &= covered - 1;
                    let cell = [self.bounds[0][lane] as usize + column, self.bounds[2][lane] as usize + row];
                    buffer.put(cell, depths[lane], nearest, self.labels[lane]);
                }
            }
        }
    }

    /// Put one facet into the buffer, row by row.
    #[inline(always)]
    fn fill_large<S: Simd, const STEEP: bool>(
        &self,
        simd: S,
        lane: usize,
        nearest: f32,
        buffer: &mut ItemBuffer,
    ) {
        let [step, climb, start] = [self.nearness[0][lane], self.nearness[1][lane], self.nearness[2][lane]];
        let stamp = Stamp {
            steps: simd.mul(simd.ramp(), simd.splat(step as f32)),
            steps_in_double: simd.mul_double(simd.widen(simd.ramp()), simd.splat_double(step)),
            nearest: simd.splat(nearest),
            label: simd.splat_int(self.labels[lane] as i32),
        };
        let [first, last] = [self.bounds[0][lane] as usize, self.bounds[1][lane] as usize];
        let [bottom, top] = [self.bounds[2][lane] as usize, self.bounds[3][lane] as usize];
        let mut row = bottom;
        while row < top {
            let [from, to] = self.spans(simd, lane, row, [first, last]);
            for y in row..top.min(row + ROWS) {
                let (from, to) = (from[y - row], to[y - row]);
                if from >= to {
                    continue;
                }
                let mut column = from / LANES as u32 * LANES as u32;
                while column < to {
                    let here = step * f64::from(column) + climb * y as f64 + start;
                    let inside = [from.saturating_sub(column), to - column];
                    stamp.print::<STEEP>(simd, here, inside, buffer.cells([column as usize, y]));
                    column += LANES as u32;
                }
            }
            row += ROWS;
        }
    }

    /// The columns from which and up to which a facet covers each of [`ROWS`] rows from `first`, of those between `low` and
    /// `high`; an empty span may be turned about.
    #[inline(always)]
    fn spans<S: Simd>(
        &self,
        simd: S,
        lane: usize,
        first: usize,
        [low, high]: [usize; 2],
    ) -> [[u32; LANES]; 2] {
        let y = simd.add_double(simd.widen(simd.ramp()), simd.splat_double(first as f64));
        let mut from = simd.splat_double(low as f64);
        let mut to = simd.splat_double(high as f64 - 1.0);
        for k in 0..self.corners {
            let [slope, start] = [self.left[k][0][lane], self.left[k][1][lane]];
            let x = simd.add_double(simd.mul_double(y, simd.splat_double(slope)), simd.splat_double(start));
            from = simd.max_double(x, from);
            let [slope, start] = [self.right[k][0][lane], self.right[k][1][lane]];
            let x = simd.add_double(simd.mul_double(y, simd.splat_double(slope)), simd.splat_double(start));
            to = simd.min_double(x, to);
        }
        // Cut to the whole part: the first column not before `from`, but for a billionth, and the one past the last not
        // after `to`; both brought within the screen, for they may be anything.
        let from = simd.min_double(from, simd.splat_double(high as f64));
        let to = simd.max_double(to, simd.splat_double(-1.0));
        let mut spans = [[0; LANES]; 2];
        let up = simd.add_double(from, simd.splat_double(1.0 - 1e-9));
        simd.store_int(simd.double_to_int(up), &mut spans[0]);
        simd.store_int(simd.double_to_int(simd.add_double(to, simd.splat_double(1.0))), &mut spans[1]);
        spans
    }
}

/// A form over directions in the sight's axes, as one over (column, row, 1).
#[inline(always)]
fn in_cells<S: Simd>(simd: S, screen: &Screen, form: &Vectors) -> Registers<S> {
    let [right, up, forward] = screen.axes;
    let (x, y) = (simd.load_double(&form[right]), simd.load_double(&form[up]));
    let z = simd.mul_double(simd.load_double(&form[forward]), simd.splat_double(screen.sign));
    let at_first = simd.add_double(
        simd.mul_double(x, simd.splat_double(screen.first[0])),
        simd.mul_double(y, simd.splat_double(screen.first[1])),
    );
    [
        simd.mul_double(x, simd.splat_double(screen.size[0])),
        simd.mul_double(y, simd.splat_double(screen.size[1])),
        simd.add_double(at_first, z),
    ]
}
