//! The item buffer: which facet is nearest in each cell of a view, by rasterising all of them.
//!
//! A facet is covered by edge functions in homogeneous coordinates (\[OG97\] Olano & Greer, Triangle Scan
//! Conversion using 2D Homogeneous Coordinates, 1997): with the eye at the origin, the edge from corner a to
//! corner b lets through the directions d with d · (a × b) >= 0. Nothing is divided, so a facet may pass
//! beside and behind the eye; two facets that share an edge compute the same numbers up to sign, so no cell
//! falls between them.

use glam::DVec3;

use super::{Facet, Facets, View};

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
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// A cell's nearest facet, or [`NOTHING`]; row by row.
    pub facet: Vec<u32>,
    /// 1 / distance along the view's `forward`; row by row.
    pub inverse_depth: Vec<f32>,
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

impl ItemBuffer {
    /// Fill the buffer with what `view` sees of `facets`.
    pub fn draw(&mut self, facets: &Facets, view: &View) {
        self.draw_only(facets, 0..facets.as_slice().len() as u32, view);
    }

    /// The same, as if only the `candidates` among the facets existed. Of two facets equally near the one
    /// that comes first stays.
    pub fn draw_only(&mut self, facets: &Facets, candidates: impl IntoIterator<Item = u32>, view: &View) {
        (self.width, self.height) = (view.width, view.height);
        self.facet.clear();
        self.facet.resize(view.width * view.height, NOTHING);
        self.inverse_depth.clear();
        self.inverse_depth.resize(view.width * view.height, (1.0 / view.far) as f32);
        self.drawn.clear();
        let lens = Lens::new(view);
        for number in candidates {
            if let Some(inverse_depth) = self.fill(&lens, number, &facets[number]) {
                self.drawn.push(Drawn { facet: number, inverse_depth });
            }
        }
    }

    /// Draw one facet; its inverse depth where it may be seen.
    fn fill(&mut self, lens: &Lens<'_>, number: u32, facet: &Facet) -> Option<DVec3> {
        let (corners, count) = facet.corners();
        let corners = &corners.map(|corner| lens.to_view(corner))[..count];
        let (low, high) = lens.row_bounds(corners)?;

        // The plane n·p = n·c0 meets the ray t d at 1/t = n·d / n·c0.
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let offset = normal.dot(corners[0]);
        let reach = corners.iter().map(|c| c.length_squared()).fold(0.0, f64::max).sqrt();
        if offset.abs() <= EDGE_ON * reach * normal.length() {
            return None;
        }
        let inverse_depth = lens.view.local_in_cells(normal / offset);
        let mut edges = [DVec3::ZERO; 4];
        for (k, edge) in edges[..count].iter_mut().enumerate() {
            let e = lens.view.local_in_cells(corners[k].cross(corners[(k + 1) % count]) * offset.signum());
            *edge = e + DVec3::Z * (EDGE_TOLERANCE * (e.x.abs() + e.y.abs()));
        }

        let last = (self.width - 1) as f64;
        let nearest = (1.0 / lens.view.near) as f32;
        for row in low..high {
            let y = row as f64;
            let (mut from, mut to) = (0.0_f64, last);
            for edge in &edges[..count] {
                let along_row = edge.y * y + edge.z;
                if edge.x > 0.0 {
                    from = from.max(-along_row / edge.x);
                } else if edge.x < 0.0 {
                    to = to.min(-along_row / edge.x);
                } else if along_row < 0.0 {
                    to = -1.0;
                }
            }
            if from > to {
                continue;
            }
            let (from, to) = (from.ceil() as usize, to.floor() as usize + 1);
            if from < to {
                let cells = row * self.width + from..row * self.width + to;
                let start = inverse_depth.dot(DVec3::new(from as f64, y, 1.0)) as f32;
                fill_span(
                    &mut self.inverse_depth[cells.clone()],
                    &mut self.facet[cells],
                    start,
                    inverse_depth.x as f32,
                    nearest,
                    number,
                );
            }
        }
        Some(inverse_depth)
    }
}

/// Put `number` into each cell of a span where it is nearer than what stands there; `start` is its inverse
/// depth in the first cell, `step` what each further cell adds. Written for the compiler to vectorise.
fn fill_span(depths: &mut [f32], numbers: &mut [u32], start: f32, step: f32, nearest: f32, number: u32) {
    for (x, (depth, cell)) in (0_i32..).zip(depths.iter_mut().zip(numbers)) {
        let here = start + step * x as f32;
        let wins = here > *depth && here <= nearest;
        *depth = if wins { here } else { *depth };
        *cell = if wins { number } else { *cell };
    }
}

/// A view made ready for drawing.
struct Lens<'a> {
    view: &'a View,
}

impl<'a> Lens<'a> {
    fn new(view: &'a View) -> Self {
        Self { view }
    }

    /// World to the view's own axes: right, up, forward. The difference is taken in double precision, so that
    /// nearness keeps its digits.
    fn to_view(&self, point: DVec3) -> DVec3 {
        let p = point - self.view.eye;
        DVec3::new(p.dot(self.view.right), p.dot(self.view.up), p.dot(self.view.forward))
    }

    /// The rows that a polygon may touch, `None` where it is wholly out of view.
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
        let mut crossed = [false; 4];
        for (side, crossed) in sides.iter().zip(&mut crossed) {
            let outside = corners.iter().filter(|c| side.dot(**c) < 0.0).count();
            if outside == corners.len() {
                return None;
            }
            *crossed = outside > 0;
        }
        let mut clipped = Clipped::new(corners);
        for (side, _) in sides.iter().zip(crossed).filter(|(_, crossed)| *crossed) {
            clipped.cut(*side);
        }
        let rows = clipped.corners().iter().filter(|c| c.z > 0.0).map(|c| {
            ((c.y / c.z - self.view.vertical[0]) / self.view.cell_height() - 0.5)
                .clamp(-1.0, self.view.height as f64)
        });
        let (low, high) = rows.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), y| (l.min(y), h.max(y)));
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
