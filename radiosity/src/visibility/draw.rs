//! Drawing what an eye sees: boxes of facets from the nearest to the farthest, sixteen facets at a time.
//!
//! One eye may look through several screens at once, as a hemicube does through its five faces. What lies beyond a screen's
//! sides, below the horizon, between the centres of cells or behind what is drawn already is left out, box by box where
//! it can be, else facet by facet (\[Greene\] Greene, Kass & Miller, Hierarchical Z-Buffer Visibility, 1993).
//!
//! A facet is covered by edge functions in homogeneous coordinates (\[OG97\] Olano & Greer, Triangle Scan Conversion using
//! 2D Homogeneous Coordinates, 1997): with the eye at the origin, the edge from corner a to corner b lets through the
//! directions d with d · (a × b) >= 0. Nothing is divided before the decision, so a facet may pass beside and behind the
//! eye; two facets that share an edge compute the same numbers up to sign, so no cell falls between them.

use glam::DVec3;

use super::View;
use super::blocks::{Block, BlockTree, Branch, Inside, Vectors};
use super::item_buffer::{ItemBuffer, Rect, Stamp};
use crate::simd::{LANES, Simd};

/// Facets reach this much beyond their edges, in cells (city-block distance). Where three edges meet in a
/// T, or two edges were placed by different arithmetic, rounding would otherwise open a gap that a cell's
/// centre can fall through; cells that symmetric scenes put exactly on an edge make that likely.
const EDGE_TOLERANCE: f64 = 1e-6;

/// A facet whose plane passes the eye closer than this, relative to its distance, is seen edge-on: it covers
/// nothing.
const EDGE_ON: f64 = 1e-10;

/// What bounds a facet or a box from outside is computed in single precision and taken wider by this, relative to the
/// numbers it is made of.
const SLACK: f32 = 2e-6;

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
    /// What each facet puts into the cells it covers, seen from its front and from its back. Of two equally near the
    /// lesser one stays.
    pub(crate) labels: [&'a [u32]; 2],
}

/// A view's cells in the axes of a [`Sight`], wherever its eye is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Screen {
    /// Which of the sight's axes are the view's right, up and forward.
    axes: [usize; 3],
    /// Whether forward is along that axis (1) or against it (-1).
    sign: f64,
    /// Of columns, then of rows: a cell's size, and where the centre of the first lies.
    size: [f64; 2],
    first: [f64; 2],
    /// Of columns, then of rows: how many.
    cells: [usize; 2],
    near: f64,
    far: f64,
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
    fn sides(&self, along: usize) -> [f64; 2] {
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
}

/// Memory to draw in.
#[derive(Clone, Debug, Default)]
pub(crate) struct Canvas {
    waiting: Vec<Waiting>,
    placed: Placed,
}

/// The most screens that are drawn at once.
pub(crate) const SCREENS: usize = 5;

/// A box yet to be looked into.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    inside: Inside,
    /// A bit for each screen it may be seen on, and where.
    screens: u32,
    cover: [Rect; SCREENS],
}

/// A vector for each lane, in registers.
type Registers<S> = [<S as Simd>::Doubles; 3];

#[inline(always)]
fn load<S: Simd>(simd: S, v: &Vectors) -> Registers<S> {
    [simd.load_double(&v[0]), simd.load_double(&v[1]), simd.load_double(&v[2])]
}

#[inline(always)]
fn store<S: Simd>(simd: S, v: Registers<S>, to: &mut Vectors) {
    for axis in 0..3 {
        simd.store_double(v[axis], &mut to[axis]);
    }
}

#[inline(always)]
fn splat<S: Simd>(simd: S, v: DVec3) -> Registers<S> {
    [simd.splat_double(v.x), simd.splat_double(v.y), simd.splat_double(v.z)]
}

#[inline(always)]
fn add<S: Simd>(simd: S, a: Registers<S>, b: Registers<S>) -> Registers<S> {
    [simd.add_double(a[0], b[0]), simd.add_double(a[1], b[1]), simd.add_double(a[2], b[2])]
}

#[inline(always)]
fn dot<S: Simd>(simd: S, a: Registers<S>, b: Registers<S>) -> S::Doubles {
    let xy = simd.add_double(simd.mul_double(a[0], b[0]), simd.mul_double(a[1], b[1]));
    simd.add_double(xy, simd.mul_double(a[2], b[2]))
}

#[inline(always)]
fn scale<S: Simd>(simd: S, a: Registers<S>, by: S::Doubles) -> Registers<S> {
    [simd.mul_double(a[0], by), simd.mul_double(a[1], by), simd.mul_double(a[2], by)]
}

#[inline(always)]
fn cross<S: Simd>(simd: S, a: Registers<S>, b: Registers<S>) -> Registers<S> {
    [
        simd.sub_double(simd.mul_double(a[1], b[2]), simd.mul_double(b[1], a[2])),
        simd.sub_double(simd.mul_double(a[2], b[0]), simd.mul_double(b[2], a[0])),
        simd.sub_double(simd.mul_double(a[0], b[1]), simd.mul_double(b[0], a[1])),
    ]
}

/// In axes given as registers.
#[inline(always)]
fn turn<S: Simd>(simd: S, axes: &[Registers<S>; 3], v: Registers<S>) -> Registers<S> {
    [dot(simd, axes[0], v), dot(simd, axes[1], v), dot(simd, axes[2], v)]
}

#[inline(always)]
fn magnitude<S: Simd>(simd: S, a: S::Doubles) -> S::Doubles {
    simd.max_double(a, simd.sub_double(simd.splat_double(0.0), a))
}

/// Fill the screens' buffers with what the sight shows of the facets; `background` stands where it shows none.
#[inline(always)]
pub(crate) fn draw<S: Simd>(
    simd: S,
    tree: &BlockTree,
    sight: &Sight<'_>,
    screens: &[Screen],
    background: u32,
    buffers: &mut [ItemBuffer],
    canvas: &mut Canvas,
) {
    for (screen, buffer) in screens.iter().zip(buffers.iter_mut()) {
        buffer.clear(screen.cells, background, (1.0 / screen.far) as f32);
    }
    let Canvas { waiting, placed } = canvas;
    waiting.clear();
    open(simd, &tree.branches[0], sight, screens, u32::MAX, waiting);
    while let Some(mut next) = waiting.pop() {
        let mut left = next.screens;
        while left != 0 {
            let index = left.trailing_zeros() as usize;
            left &= left - 1;
            if buffers[index].hides(simd, &next.cover[index]) {
                next.screens &= !(1 << index);
            }
        }
        if next.screens == 0 {
            continue;
        }
        match next.inside {
            Inside::Branch(branch) => {
                open(simd, &tree.branches[branch as usize], sight, screens, next.screens, waiting);
            }
            Inside::Block(block) => {
                let block = &tree.blocks[block as usize];
                placed.place(simd, block, sight);
                let mut left = next.screens;
                while left != 0 && placed.seen != 0 {
                    let index = left.trailing_zeros() as usize;
                    left &= left - 1;
                    placed.project(simd, &screens[index]);
                    placed.fill(simd, block, sight, &screens[index], &mut buffers[index]);
                }
            }
        }
    }
}

/// Put the boxes of a branch that may be seen on `wanted` screens on the stack, the nearest on top.
#[inline(always)]
fn open<S: Simd>(
    simd: S,
    branch: &Branch,
    sight: &Sight<'_>,
    screens: &[Screen],
    wanted: u32,
    waiting: &mut Vec<Waiting>,
) {
    let axes = sight.axes.map(|axis| splat(simd, axis));
    let eye = splat(simd, -sight.eye);
    let centre = turn(simd, &axes, add(simd, load(simd, &branch.centre), eye));
    let half = load(simd, &branch.half);
    let mut widths = half;
    for axis in 0..3 {
        let [x, y, z] = axes[axis];
        let across = [magnitude(simd, x), magnitude(simd, y), magnitude(simd, z)];
        widths[axis] = dot(simd, across, half);
    }
    let mut seen = !0 >> (u32::BITS - branch.count as u32);
    if let Some(horizon) = sight.horizon {
        // The facets are judged exactly; their box may differ by a rounding error.
        let top = simd.add_double(centre[2], widths[2]);
        seen &= simd.lanes(simd.greater_double(top, simd.splat_double(0.5 * horizon)));
    }
    if seen == 0 {
        return;
    }

    // From here in single precision, the boxes taken a little larger.
    let zero = simd.splat(0.0);
    let one = simd.splat(1.0);
    let (mut middle, mut reach) = ([zero; 3], [zero; 3]);
    let (mut far, mut distance) = (zero, zero);
    for axis in 0..3 {
        let (c, w) = (simd.narrow(centre[axis]), simd.narrow(widths[axis]));
        let apart = simd.max(c, simd.mul(c, simd.splat(-1.0)));
        middle[axis] = c;
        reach[axis] = simd.add(w, simd.mul(simd.add(apart, w), simd.splat(SLACK)));
        far = simd.max(far, simd.add(apart, w));
        let gap = simd.max(simd.sub(apart, w), zero);
        distance = simd.add(distance, simd.mul(gap, gap));
    }
    let mut distances = [0.0; LANES];
    simd.store(distance, &mut distances);

    let base = waiting.len();
    for lane in 0..branch.count {
        if seen >> lane & 1 == 1 {
            let waits = Waiting { inside: branch.inside[lane], screens: 0, cover: [Rect::NONE; SCREENS] };
            waiting.push(waits);
        }
    }
    for (index, screen) in screens.iter().enumerate() {
        if wanted >> index & 1 == 0 {
            continue;
        }
        let sign = simd.splat(screen.sign as f32);
        let [right, up, forward] = screen.axes;
        let (z, deep) = (simd.mul(middle[forward], sign), reach[forward]);
        let (least, most) = (simd.sub(z, deep), simd.add(z, deep));
        let mut on = seen & simd.lanes(simd.greater(most, zero));
        if on == 0 {
            continue;
        }
        // A box that reaches beside or behind the eye may be seen anywhere that its sides allow.
        let before = simd.greater(least, simd.mul(far, simd.splat(SLACK)));
        let (nearest, farthest) = (simd.div(one, least), simd.div(one, most));
        let mut cover = [[0_u32; LANES]; 4];
        for (along, axis) in [right, up].into_iter().enumerate() {
            let (low, high) = (simd.sub(middle[axis], reach[axis]), simd.add(middle[axis], reach[axis]));
            let [from, to] = screen.sides(along).map(|side| side as f32);
            let beyond = |side: f32| (simd.mul(z, simd.splat(side)), simd.mul(deep, simd.splat(side.abs())));
            let (at, spread) = beyond(from);
            on &= simd.lanes(simd.greater(high, simd.sub(at, spread)));
            let (at, spread) = beyond(to);
            on &= simd.lanes(simd.greater(simd.add(at, spread), low));
            let low = simd.mul(low, simd.select(simd.greater(low, zero), farthest, nearest));
            let high = simd.mul(high, simd.select(simd.greater(high, zero), nearest, farthest));
            let span = cells_between(simd, screen, along, [low, high], before);
            on &= simd.lanes(simd.greater_int(span[1], span[0]));
            simd.store_int(span[0], &mut cover[2 * along]);
            simd.store_int(span[1], &mut cover[2 * along + 1]);
        }
        let mut nearness = [0.0; LANES];
        let nearest = simd.mul(nearest, simd.splat(1.0 + SLACK));
        simd.store(simd.select(before, nearest, simd.splat(f32::INFINITY)), &mut nearness);
        let mut place = base;
        for lane in 0..branch.count {
            if seen >> lane & 1 == 0 {
                continue;
            }
            if on >> lane & 1 == 1 {
                let waits = &mut waiting[place];
                waits.screens |= 1 << index;
                waits.cover[index] = Rect {
                    columns: [cover[0][lane] as i32, cover[1][lane] as i32],
                    rows: [cover[2][lane] as i32, cover[3][lane] as i32],
                    nearest: nearness[lane],
                };
            }
            place += 1;
        }
    }

    // Keep those on a screen, the nearest last; few enough for the plainest sorting.
    let (mut kept, mut place) = (base, base);
    let mut keys = [0.0; LANES];
    for lane in 0..branch.count {
        if seen >> lane & 1 == 0 {
            continue;
        }
        let waits = waiting[place];
        place += 1;
        if waits.screens == 0 {
            continue;
        }
        let mut slot = kept;
        while slot > base && keys[slot - 1 - base] < distances[lane] {
            waiting[slot] = waiting[slot - 1];
            keys[slot - base] = keys[slot - 1 - base];
            slot -= 1;
        }
        waiting[slot] = waits;
        keys[slot - base] = distances[lane];
        kept += 1;
    }
    waiting.truncate(kept);
}

/// The cells from which and up to which a facet or box may cover, given where its sides are seen along columns or rows
/// (at distance 1), or all of them where it is not wholly `before` the eye.
#[inline(always)]
fn cells_between<S: Simd>(
    simd: S,
    screen: &Screen,
    along: usize,
    [low, high]: [S::Floats; 2],
    before: S::Mask,
) -> [S::Ints; 2] {
    let scale = simd.splat((1.0 / screen.size[along]) as f32);
    let shift = simd.splat((-screen.first[along] / screen.size[along]) as f32);
    let slack = simd.splat(screen.slack(along));
    let (a, b) = (simd.add(simd.mul(low, scale), shift), simd.add(simd.mul(high, scale), shift));
    // In this order a number that is none becomes the bound.
    let (least, most) = (simd.splat(-1.0), simd.splat(screen.cells[along] as f32));
    let low = simd.sub(simd.min(a, b), slack);
    let high = simd.add(simd.max(a, b), slack);
    let low = simd.min(simd.max(simd.select(before, low, least), least), most);
    let high = simd.min(simd.max(simd.select(before, high, most), least), simd.sub(most, simd.splat(0.5)));
    // One more, cut to the whole part: the first cell not before `low`, and the one past the last not after `high`.
    let one = simd.splat(1.0);
    [simd.to_int(simd.add(low, one)), simd.to_int(simd.add(high, one))]
}

/// The facets of a block before an eye, and then on one screen.
#[derive(Clone, Debug)]
struct Placed {
    /// A bit for each facet that may be seen, and for each whose front is.
    seen: u32,
    fronts: u32,
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

    /// A bit for each facet that may cover a cell of the screen.
    drawn: u32,
    /// The columns, then the rows, from which and up to which it may.
    bounds: [[u32; LANES]; 4],
    /// Edges that bound from the left, as column = slope * row + start; those of other edges bound nothing.
    left: [[[f64; LANES]; 2]; 4],
    /// Edges that bound from the right.
    right: [[[f64; LANES]; 2]; 4],
    /// 1 / distance along the screen's forward, over (column, row, 1).
    nearness: Vectors,
}

impl Default for Placed {
    fn default() -> Self {
        Self {
            seen: 0,
            fronts: 0,
            corners: 0,
            corner: [[[0.0; LANES]; 3]; 4],
            reach: [0.0; LANES],
            edge: [[[0.0; LANES]; 3]; 4],
            inverse_depth: [[0.0; LANES]; 3],
            drawn: 0,
            bounds: [[0; LANES]; 4],
            left: [[[0.0; LANES]; 2]; 4],
            right: [[[0.0; LANES]; 2]; 4],
            nearness: [[0.0; LANES]; 3],
        }
    }
}

/// Rows whose spans are found together.
const ROWS: usize = 8;

impl Placed {
    /// Place a block before the eye. Differences are taken in double precision, so that nearness keeps its digits.
    #[inline(always)]
    fn place<S: Simd>(&mut self, simd: S, block: &Block, sight: &Sight<'_>) {
        let axes = sight.axes.map(|axis| splat(simd, axis));
        let origin = add(simd, load(simd, &block.origin), splat(simd, -sight.eye));
        let normal = load(simd, &block.normal);
        let offset = dot(simd, normal, origin);
        let a = turn(simd, &axes, origin);
        let u = turn(simd, &axes, load(simd, &block.u));
        let v = turn(simd, &axes, load(simd, &block.v));
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
        let edge_on = simd.mul_double(reach, simd.splat_double(EDGE_ON * EDGE_ON));
        let mut seen = simd.lanes(simd.greater_double(squared, edge_on));
        seen &= !0 >> (u32::BITS - block.count as u32);
        if let Some(horizon) = sight.horizon {
            let horizon = simd.splat_double(horizon);
            seen &= simd.lanes(simd.greater_double(magnitude(simd, offset), horizon));
            seen &= simd.lanes(simd.greater_double(top, horizon));
        }
        self.seen = seen;
        if seen == 0 {
            return;
        }
        let behind = simd.greater_double(offset, zero);
        self.fronts = !(simd.lanes(behind) ^ block.flipped);
        // The view's axes may be left-handed, and products with them.
        let [right, up, forward] = sight.axes;
        let hand = right.cross(up).dot(forward).signum();
        let side = simd.select_double(behind, simd.splat_double(hand), simd.splat_double(-hand));
        for k in 0..self.corners {
            let next = if k + 1 < self.corners { k + 1 } else { 0 };
            let edge = cross(simd, corner[k], corner[next]);
            store(simd, scale(simd, edge, side), &mut self.edge[k]);
        }
        // The plane n·p = offset meets the ray t d at 1/t = n·d / offset.
        let inverse = simd.div_double(simd.splat_double(1.0), offset);
        store(simd, scale(simd, turn(simd, &axes, normal), inverse), &mut self.inverse_depth);
        simd.store(simd.root(simd.narrow(reach)), &mut self.reach);
    }

    /// Find where on a screen the facets may be seen, and their outlines there.
    #[inline(always)]
    fn project<S: Simd>(&mut self, simd: S, screen: &Screen) {
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
        for along in 0..2 {
            let [from, to] = cells_between(simd, screen, along, [low[along], high[along]], before);
            drawn &= simd.lanes(simd.greater_int(to, from));
            simd.store_int(from, &mut self.bounds[2 * along]);
            simd.store_int(to, &mut self.bounds[2 * along + 1]);
        }
        if drawn & !simd.lanes(before) != 0 {
            drawn &= !self.beyond(simd, screen);
        }
        self.drawn = drawn;
        if drawn == 0 {
            return;
        }
        store(simd, in_cells(simd, screen, &self.inverse_depth), &mut self.nearness);
        let zero = simd.splat_double(0.0);
        for k in 0..self.corners {
            let [x, y, z] = in_cells(simd, screen, &self.edge[k]);
            let reach = simd.add_double(magnitude(simd, x), magnitude(simd, y));
            let z = simd.add_double(z, simd.mul_double(reach, simd.splat_double(EDGE_TOLERANCE)));
            // An edge along a row bounds from one side or the other, infinitely steeply: all of a row, or nothing. One without
            // length bounds nothing, for it gives no number.
            let least = simd.mul_double(reach, simd.splat_double(1e-30));
            let x = simd.select_double(simd.greater_double(magnitude(simd, x), least), x, least);
            let minus_inverse = simd.div_double(simd.splat_double(-1.0), x);
            let (slope, start) = (simd.mul_double(y, minus_inverse), simd.mul_double(z, minus_inverse));
            let (is_left, is_right) = (simd.greater_double(x, zero), simd.greater_double(zero, x));
            let nowhere = simd.splat_double(1e30);
            simd.store_double(simd.select_double(is_left, slope, zero), &mut self.left[k][0]);
            simd.store_double(simd.select_double(is_right, slope, zero), &mut self.right[k][0]);
            simd.store_double(simd.select_double(is_right, start, nowhere), &mut self.right[k][1]);
            let nowhere = simd.splat_double(-1e30);
            simd.store_double(simd.select_double(is_left, start, nowhere), &mut self.left[k][1]);
        }
    }

    /// A bit for each facet that lies wholly beyond one side of the screen.
    #[inline(always)]
    fn beyond<S: Simd>(&self, simd: S, screen: &Screen) -> u32 {
        let [right, up, forward] = screen.axes;
        let sign = simd.splat(screen.sign as f32);
        let (zero, none) = (simd.splat(0.0), simd.splat(f32::NEG_INFINITY));
        let mut beyond = 0;
        for (along, axis) in [right, up].into_iter().enumerate() {
            let [from, to] = screen.sides(along).map(|side| simd.splat(side as f32));
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

    /// Put the facets into the buffer.
    #[inline(always)]
    fn fill<S: Simd>(
        &self,
        simd: S,
        block: &Block,
        sight: &Sight<'_>,
        screen: &Screen,
        buffer: &mut ItemBuffer,
    ) {
        let nearest = simd.splat(((1.0 / screen.near) as f32).next_up());
        let mut left = self.drawn;
        while left != 0 {
            let lane = left.trailing_zeros() as usize % LANES;
            left &= left - 1;
            let facet = block.facet[lane] as usize;
            let label = sight.labels[usize::from(self.fronts >> lane & 1 == 0)][facet];
            let [step, climb, start] =
                [self.nearness[0][lane], self.nearness[1][lane], self.nearness[2][lane]];
            let stamp = Stamp {
                steps: simd.mul(simd.ramp(), simd.splat(step as f32)),
                nearest,
                label: simd.splat_int(label as i32),
            };
            let bounds = [0, 1, 2, 3].map(|side| self.bounds[side][lane] as usize);
            let [first, last, bottom, top] = bounds;
            buffer.touch([first, last], [bottom, top]);
            let mut row = bottom;
            while row < top {
                let spans = self.spans(lane, row, [first, last]);
                let rows = ROWS.min(top - row);
                for (y, &[from, to]) in (row..top).zip(&spans[..rows]) {
                    if from >= to {
                        continue;
                    }
                    let mut column = from as usize / LANES * LANES;
                    while column < to as usize {
                        let here = step * column as f64 + climb * y as f64 + start;
                        let inside = [from - column as i32, to - column as i32];
                        stamp.print(simd, here as f32, inside, buffer.cells([column, y]));
                        column += LANES;
                    }
                }
                row += ROWS;
            }
        }
    }

    /// The cells from which and up to which a facet covers each of [`ROWS`] rows from `first`, within these columns; an
    /// empty span may be turned about.
    #[inline(always)]
    fn spans(&self, lane: usize, first: usize, [low, high]: [usize; 2]) -> [[i32; 2]; ROWS] {
        let mut from = [low as f64; ROWS];
        let mut to = [high as f64 - 1.0; ROWS];
        let mut y = [0.0; ROWS];
        for (row, y) in y.iter_mut().enumerate() {
            *y = (first + row) as f64;
        }
        for k in 0..self.corners {
            let [slope, start] = [self.left[k][0][lane], self.left[k][1][lane]];
            for row in 0..ROWS {
                let x = slope * y[row] + start;
                from[row] = if x > from[row] { x } else { from[row] };
            }
            let [slope, start] = [self.right[k][0][lane], self.right[k][1][lane]];
            for row in 0..ROWS {
                let x = slope * y[row] + start;
                to[row] = if x < to[row] { x } else { to[row] };
            }
        }
        let mut spans = [[0; 2]; ROWS];
        for row in 0..ROWS {
            // Both are within the screen's width by now, or the span is empty.
            let from = if from[row] < 1e9 { from[row] } else { 1e9 };
            let to = if to[row] > -1.0 { to[row] } else { -1.0 };
            spans[row] = [not_below(from), above(to)];
        }
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

/// The least whole number not below `x` >= 0. Casts are an instruction on any processor, where `ceil` may be a call.
#[inline(always)]
fn not_below(x: f64) -> i32 {
    let whole = x as i32;
    whole + i32::from(x > f64::from(whole))
}

/// The least whole number above `x` >= -1.
#[inline(always)]
fn above(x: f64) -> i32 {
    let whole = x as i32;
    whole + i32::from(x >= f64::from(whole))
}
