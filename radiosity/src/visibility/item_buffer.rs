//! The item buffer: which facet is nearest in each cell of a view, by rasterising all of them.
//!
//! A facet is covered by edge functions in homogeneous coordinates (\[OG97\] Olano & Greer, Triangle Scan
//! Conversion using 2D Homogeneous Coordinates, 1997): with the eye at the origin, the edge from corner a to
//! corner b lets through the directions d with d · (a × b) >= 0. Nothing is divided, so a facet may pass
//! beside and behind the eye; two facets that share an edge compute the same numbers up to sign, so no cell
//! falls between them.

use glam::DVec3;

use super::{Facet, FacetShape, Facets, View};
use crate::simd::{self, LANES, Level, Simd};

/// What a cell holds that sees no facet.
pub const NOTHING: u32 = u32::MAX;

/// Facets reach this much beyond their edges, in cells (city-block distance). Where three edges meet in a
/// T, or two edges were placed by different arithmetic, rounding would otherwise open a gap that a cell's
/// centre can fall through; cells that symmetric scenes put exactly on an edge make that likely.
const EDGE_TOLERANCE: f64 = 1e-6;

/// A facet whose plane passes the eye closer than this, relative to its distance, is seen edge-on: it covers
/// nothing.
const EDGE_ON: f64 = 1e-10;

/// The nearest facet, and how near, in each cell of a view.
#[derive(Clone, Debug, Default)]
pub struct ItemBuffer {
    width: usize,
    height: usize,
    /// Cells from one row to the next: the width, rounded up to whole registers.
    stride: usize,
    facet: Vec<u32>,
    inverse_depth: Vec<f32>,
    /// The facets that were drawn in the view, hidden or not, with what it took to draw them.
    pub(crate) drawn: Vec<Drawn>,
}

/// A facet in a view.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drawn {
    /// Its number.
    pub(crate) facet: u32,
    /// 1 / distance along `forward`, linear in the cell's coordinates (x, y, 1).
    pub(crate) inverse_depth: DVec3,
}

/// A facet in the axes of a view (right, up, forward) about its eye.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    /// The facet's number.
    pub(crate) facet: u32,
    /// How many of the corners count.
    pub(crate) count: usize,
    /// The corners in order.
    pub(crate) corners: [DVec3; 4],
}

impl Piece {
    /// Facet `number`, whose corners are given in axes about an eye. The differences are taken in double precision, so that
    /// nearness keeps its digits.
    #[inline(always)]
    pub(crate) fn new(number: u32, facet: &Facet, eye: DVec3, [right, up, forward]: [DVec3; 3]) -> Self {
        let in_axes = |v: DVec3| DVec3::new(v.dot(right), v.dot(up), v.dot(forward));
        let (a, u, v) = (in_axes(facet.origin - eye), in_axes(facet.u), in_axes(facet.v));
        let (corners, count) = match facet.shape {
            FacetShape::Triangle => ([a, a + u, a + v, a + v], 3),
            FacetShape::Parallelogram => ([a, a + u, a + u + v, a + v], 4),
        };
        Self { facet: number, count, corners }
    }
}

/// Draw facets in a view.
struct Draw<'a> {
    buffer: &'a mut ItemBuffer,
    facets: &'a Facets,
    view: &'a View,
}

impl simd::Kernel for Draw<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let axes = [self.view.right, self.view.up, self.view.forward];
        let numbered = self.facets.as_slice().iter().zip(0..);
        let pieces = numbered.map(|(facet, number)| Piece::new(number, facet, self.view.eye, axes));
        self.buffer.draw_pieces(simd, pieces, self.view);
    }
}

impl ItemBuffer {
    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The nearest facet in each cell of row `y`, or [`NOTHING`].
    #[inline]
    pub fn facets(&self, y: usize) -> &[u32] {
        &self.facet[y * self.stride..][..self.width]
    }

    /// 1 / distance along the view's `forward` to what each cell of row `y` shows.
    #[inline]
    pub fn inverse_depths(&self, y: usize) -> &[f32] {
        &self.inverse_depth[y * self.stride..][..self.width]
    }

    /// Fill the buffer with what `view` sees of `facets`. Of two equally near the one that comes first stays.
    pub fn draw(&mut self, facets: &Facets, view: &View) {
        simd::run(Level::best(), Draw { buffer: self, facets, view });
    }

    /// The same of these pieces, which are in the view's own axes; for use within a kernel.
    #[inline(always)]
    pub(crate) fn draw_pieces<S: Simd>(&mut self, simd: S, pieces: impl Iterator<Item = Piece>, view: &View) {
        (self.width, self.height) = (view.width, view.height);
        self.stride = view.width.next_multiple_of(LANES);
        self.facet.clear();
        self.facet.resize(self.stride * view.height, NOTHING);
        self.inverse_depth.clear();
        self.inverse_depth.resize(self.stride * view.height, (1.0 / view.far) as f32);
        self.drawn.clear();
        let lens = Lens { view };
        for piece in pieces {
            if let Some(inverse_depth) = self.fill(simd, &lens, &piece) {
                self.drawn.push(Drawn { facet: piece.facet, inverse_depth });
            }
        }
    }

    /// Draw one piece; its inverse depth where it may be seen.
    #[inline(always)]
    fn fill<S: Simd>(&mut self, simd: S, lens: &Lens<'_>, piece: &Piece) -> Option<DVec3> {
        let (count, number) = (piece.count, piece.facet);
        let corners = &piece.corners[..count];
        let (low, high) = lens.row_bounds(corners)?;

        // The plane n·p = n·c0 meets the ray t d at 1/t = n·d / n·c0.
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let offset = normal.dot(corners[0]);
        let mut reach = 0.0_f64;
        for corner in corners {
            reach = reach.max(corner.length_squared());
        }
        let reach = reach.sqrt();
        if offset.abs() <= EDGE_ON * reach * normal.length() {
            return None;
        }
        let inverse_depth = lens.view.local_in_cells(normal / offset);
        let mut outline = Outline::new(self.width, low, high);
        for (k, corner) in corners.iter().enumerate() {
            let next = corners[if k + 1 < count { k + 1 } else { 0 }];
            let edge = lens.view.local_in_cells(corner.cross(next) * offset.signum());
            outline.add(edge + DVec3::Z * (EDGE_TOLERANCE * (edge.x.abs() + edge.y.abs())));
        }

        let nearest = (1.0 / lens.view.near) as f32;
        let stamp = Stamp {
            steps: simd.mul(simd.ramp(), simd.splat(inverse_depth.x as f32)),
            // Beyond what is too near.
            nearest: simd.splat(nearest.next_up()),
            number: simd.splat_int(number as i32),
        };
        let mut first = outline.low;
        while first < outline.high {
            let spans = outline.spans(first);
            for (y, &[from, to]) in (first..outline.high).zip(&spans) {
                let mut block = from as usize / LANES * LANES;
                while block < to as usize {
                    let start = inverse_depth.x * block as f64 + inverse_depth.y * y as f64 + inverse_depth.z;
                    let at = y * self.stride + block;
                    let depths = self.inverse_depth[at..].first_chunk_mut().expect("rows are whole blocks");
                    let numbers = self.facet[at..].first_chunk_mut().expect("rows are whole blocks");
                    let inside = [from - block as i32, to - block as i32];
                    stamp.print(simd, start as f32, inside, depths, numbers);
                    block += LANES;
                }
            }
            first += ROWS;
        }
        Some(inverse_depth)
    }
}

/// A facet, ready to be put into one block of cells after another.
struct Stamp<S: Simd> {
    /// How much the inverse depth of each cell of a block differs from that of its first.
    steps: S::Floats,
    /// The inverse depth that nothing seen may have.
    nearest: S::Floats,
    number: S::Ints,
}

impl<S: Simd> Stamp<S> {
    /// Put the number into each cell `inside` a block (from and up to) where it is nearer than what stands there; `start`
    /// is its inverse depth in the block's first cell.
    #[inline(always)]
    fn print(
        &self,
        simd: S,
        start: f32,
        [from, to]: [i32; 2],
        depths: &mut [f32; LANES],
        numbers: &mut [u32; LANES],
    ) {
        let here = simd.add(simd.splat(start), self.steps);
        let (depth, stood, lanes) = (simd.load(depths), simd.load_int(numbers), simd.ramp_int());
        let after = simd.greater_int(lanes, simd.splat_int(from - 1));
        let before = simd.greater_int(simd.splat_int(to), lanes);
        let nearer = simd.and(simd.greater(here, depth), simd.greater(self.nearest, here));
        let wins = simd.and(simd.and(after, before), nearer);
        simd.store(simd.select(wins, here, depth), depths);
        simd.store_int(simd.select_int(wins, self.number, stood), numbers);
    }
}

/// Rows whose spans are found together.
const ROWS: usize = 8;

/// Where a convex polygon begins and ends in each row: between the last of the edges that bound it from the left
/// and the first of those that bound it from the right.
struct Outline {
    /// Edges as x = slope y + start.
    left: [[f64; 2]; 4],
    lefts: usize,
    right: [[f64; 2]; 4],
    rights: usize,
    /// The view's last column.
    last: f64,
    low: usize,
    high: usize,
}

impl Outline {
    #[inline(always)]
    fn new(width: usize, low: usize, high: usize) -> Self {
        let last = (width - 1) as f64;
        Self { left: [[0.0; 2]; 4], lefts: 0, right: [[0.0; 2]; 4], rights: 0, last, low, high }
    }

    /// Keep what has `edge · (x, y, 1) >= 0`.
    #[inline(always)]
    fn add(&mut self, edge: DVec3) {
        if edge.x == 0.0 {
            // A horizontal edge bounds the rows.
            let y = -edge.z / edge.y;
            if edge.y > 0.0 {
                self.low = self.low.max(y.ceil().max(0.0) as usize);
            } else if edge.y < 0.0 {
                self.high = self.high.min((y.floor() + 1.0).max(0.0) as usize);
            } else if edge.z < 0.0 {
                self.high = 0;
            }
            return;
        }
        let line = [-edge.y / edge.x, -edge.z / edge.x];
        if edge.x > 0.0 {
            self.left[self.lefts] = line;
            self.lefts += 1;
        } else {
            self.right[self.rights] = line;
            self.rights += 1;
        }
    }

    /// The cells from which and up to which the polygon covers each of [`ROWS`] rows from `first`; an empty span
    /// may be turned about.
    #[inline(always)]
    fn spans(&self, first: usize) -> [[i32; 2]; ROWS] {
        let mut from = [0.0_f64; ROWS];
        let mut to = [self.last; ROWS];
        let mut y = [0.0; ROWS];
        for (row, y) in y.iter_mut().enumerate() {
            *y = (first + row) as f64;
        }
        for [slope, start] in &self.left[..self.lefts] {
            for row in 0..ROWS {
                let x = slope * y[row] + start;
                from[row] = if x > from[row] { x } else { from[row] };
            }
        }
        for [slope, start] in &self.right[..self.rights] {
            for row in 0..ROWS {
                let x = slope * y[row] + start;
                to[row] = if x < to[row] { x } else { to[row] };
            }
        }
        let mut spans = [[0; 2]; ROWS];
        for row in 0..ROWS {
            // Both are within the view's width by now, or the span is empty.
            let from = if from[row] < 1e9 { from[row] } else { 1e9 };
            let to = if to[row] > -1.0 { to[row] } else { -1.0 };
            spans[row] = [not_below(from), above(to)];
        }
        spans
    }
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

/// A view made ready for drawing.
struct Lens<'a> {
    view: &'a View,
}

impl Lens<'_> {
    /// The rows that a polygon may touch, `None` where it is wholly out of view.
    #[inline(always)]
    fn row_bounds(&self, corners: &[DVec3]) -> Option<(usize, usize)> {
        let ordered = |[a, b]: [f64; 2]| if a < b { [a, b] } else { [b, a] };
        let [left, right] = ordered(self.view.horizontal);
        let [bottom, top] = ordered(self.view.vertical);
        // Together the four say that the point lies before the eye.
        let sides = [
            DVec3::new(1.0, 0.0, -left),
            DVec3::new(-1.0, 0.0, right),
            DVec3::new(0.0, 1.0, -bottom),
            DVec3::new(0.0, -1.0, top),
        ];
        let mut clipped = Clipped::new(corners);
        for side in sides {
            let mut outside = 0;
            for corner in corners {
                outside += usize::from(side.dot(*corner) < 0.0);
            }
            if outside == corners.len() {
                return None;
            }
            if outside > 0 {
                clipped.cut(side);
            }
        }
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for corner in clipped.corners() {
            if corner.z > 0.0 {
                let y = (corner.y / corner.z - self.view.vertical[0]) / self.view.cell_height() - 0.5;
                low = if y < low { y } else { low };
                high = if y > high { y } else { high };
            }
        }
        let (low, high) = (low.max(-1.0), high.min(self.view.height as f64));
        // One row to spare on either side: which cells are covered is for the edges to say.
        let (low, high) = (low.floor().max(0.0), (high.ceil() + 1.0).min(self.view.height as f64));
        (low < high).then_some((low as usize, high as usize))
    }
}

/// A convex polygon being clipped by the sides of a view: 4 corners, and each of 4 sides may add one.
struct Clipped {
    corners: [DVec3; 8],
    count: usize,
}

impl Clipped {
    fn new(corners: &[DVec3]) -> Self {
        let mut kept = [DVec3::ZERO; 8];
        kept[..corners.len()].copy_from_slice(corners);
        Self { corners: kept, count: corners.len() }
    }

    fn corners(&self) -> &[DVec3] {
        &self.corners[..self.count]
    }

    /// Keep what has `side · p >= 0` (Sutherland & Hodgman).
    fn cut(&mut self, side: DVec3) {
        let before = Self { ..*self };
        self.count = 0;
        for (k, &a) in before.corners().iter().enumerate() {
            let b = before.corners[(k + 1) % before.count];
            let (da, db) = (side.dot(a), side.dot(b));
            if da >= 0.0 {
                self.push(a);
            }
            if (da < 0.0) != (db < 0.0) {
                self.push(a + (b - a) * (da / (da - db)));
            }
        }
    }

    fn push(&mut self, corner: DVec3) {
        if self.count < self.corners.len() {
            self.corners[self.count] = corner;
            self.count += 1;
        }
    }
}
