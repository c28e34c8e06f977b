//! How one surface is cut: into a grid of cells, into triangles, or not at all.

use std::f64::consts::PI;

use glam::{DAffine3, DMat3, DVec3};

use super::Pieces;
use crate::geometry::curved::{Parametric, equal_area_scale, greatest_stretch};
use crate::geometry::refine::Parts;
use crate::geometry::{fill, polygon};
use crate::scene::{Curved, Mesh, Polygon, Quadrilateral, Shape};

/// The fewest cells of a sphere or cylinder once around, and of a sphere from pole to pole, unless its author asked for
/// fewer: coarser, it is none.
const FEWEST_AROUND: u32 = 8;
const FEWEST_POLE_TO_POLE: u32 = 4;

/// Corners that a slab this thick holds, relative to their distance, are flat: what rounding makes of flat ones. Far below
/// what a hemicube takes for its own plane.
const FLAT: f64 = 1e-10;

/// What becomes of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Plan {
    /// A grid of columns x rows.
    Grid(u64, u64),
    /// A polygon as one patch, or a mesh as one a triangle.
    Whole(u64),
    /// Its triangles, each cut further, and how many that makes.
    Triangles(Parts, u64),
    /// A polygon filled with triangles of this size, and how many.
    Filled(f64, u64),
}

impl Plan {
    pub(super) fn count(self) -> u64 {
        match self {
            Self::Grid(columns, rows) => columns.saturating_mul(rows),
            Self::Whole(count) | Self::Triangles(_, count) | Self::Filled(_, count) => count,
        }
    }

    /// A shape's own n and m times a factor.
    pub(super) fn by_factor(shape: &Shape, factor: f64) -> Self {
        // To the nearest whole number, at least 1.
        let scaled = |cells: u32| ((f64::from(cells) * factor).round() as u64).max(1);
        let at_least = |cells: u32, fewest: u32| scaled(cells).max(cells.min(fewest).into());
        match shape {
            Shape::Parallelogram(p) => Self::Grid(scaled(p.columns), scaled(p.rows)),
            Shape::Quadrilateral(q) => Self::Grid(scaled(q.columns), scaled(q.rows)),
            Shape::Polygon(_) => Self::Whole(1),
            Shape::Mesh(m) => Self::Whole(m.triangles.len() as u64),
            Shape::Fractal(m) => match scaled(1) {
                1 => Self::Whole(m.triangles.len() as u64),
                k => {
                    let count = k.saturating_mul(k).saturating_mul(m.triangles.len() as u64);
                    Self::Triangles(Parts::Equal(k.min(u32::MAX.into()) as u32), count)
                }
            },
            Shape::Sphere(c) => {
                Self::Grid(at_least(c.columns, FEWEST_AROUND), at_least(c.rows, FEWEST_POLE_TO_POLE))
            }
            Shape::Cylinder(c) => Self::Grid(at_least(c.columns, FEWEST_AROUND), scaled(c.rows)),
        }
    }

    /// So that no edge of a patch is longer than `size`.
    pub(super) fn by_size(shape: &Shape, size: f64) -> Self {
        let parts = |length: f64| ((length / size - 1e-9).ceil() as u64).max(1);
        if let Some(p) = shape.parallelogram() {
            return Self::Grid(parts(p.u.length()), parts(p.v.length()));
        }
        let quadrilateral = |[a, b, c, d]: [DVec3; 4]| {
            // A line between opposite sides is no longer than the longer of the other two.
            let columns = parts(a.distance(b).max(c.distance(d)));
            Self::Grid(columns, parts(a.distance(d).max(b.distance(c))))
        };
        match shape {
            Shape::Quadrilateral(q) => quadrilateral(q.corners),
            Shape::Polygon(p) => match p.vertices[..] {
                [a, b, c, d] if polygon::is_convex(&p.vertices) => quadrilateral([a, b, c, d]),
                _ if polygon::diameter(&p.vertices) <= size => Self::Whole(1),
                [_, _, _] => Self::triangles(polygon_triangles(p), size),
                _ => {
                    let (_, count) = Parts::for_bound(filling(p, size).iter().copied(), size);
                    Self::Filled(size, count)
                }
            },
            Shape::Mesh(m) | Shape::Fractal(m) => Self::triangles(mesh_triangles(m), size),
            Shape::Sphere(c) => sphere_by_size(c, size),
            Shape::Cylinder(c) => {
                let [x, y, z] = c.axes();
                // Across the axis an edge is a chord of an ellipse.
                let widest = greatest_stretch(DMat3::from_cols(DVec3::ZERO, y, z));
                Self::Grid(around(2.0 * widest, size, PI, FEWEST_AROUND), parts(x.length()))
            }
            Shape::Parallelogram(_) => unreachable!("it is a parallelogram"),
        }
    }

    fn triangles(triangles: impl Iterator<Item = [DVec3; 3]> + Clone, size: f64) -> Self {
        let (parts, count) = Parts::for_bound(triangles, size);
        Self::Triangles(parts, count)
    }
}

/// Into how many equal parts an arc of the angle `half` on either side is to be cut, so that the chords of a circle of
/// this diameter are no longer than `size`.
fn around(diameter: f64, size: f64, half: f64, fewest: u32) -> u64 {
    let ratio = size / diameter;
    let parts = if ratio >= 1.0 { 1 } else { (half / ratio.asin() - 1e-9).ceil() as u64 };
    parts.max(fewest.into())
}

fn sphere_by_size(sphere: &Curved, size: f64) -> Plan {
    let [x, _, z] = sphere.axes();
    let equator = 2.0 * greatest_stretch(DMat3::from_cols(x, DVec3::ZERO, z));
    let meridian = 2.0 * greatest_stretch(sphere.map.matrix3);
    let cells = |scale: f64| {
        let columns = around(equator * scale, size, PI, FEWEST_AROUND);
        (columns, around(meridian * scale, size, PI / 2.0, FEWEST_POLE_TO_POLE))
    };
    // The finer, the less the cells are blown up: what is enough for the first guess's is enough for its own.
    let (columns, rows) = cells(1.0);
    if columns.max(rows) > u64::from(u32::MAX) {
        return Plan::Grid(columns, rows);
    }
    let (columns, rows) = cells(equal_area_scale(columns as u32, rows as u32));
    Plan::Grid(columns, rows)
}

fn polygon_triangles(p: &Polygon) -> impl Iterator<Item = [DVec3; 3]> + Clone + '_ {
    let triangles = polygon::triangulate(&p.vertices).unwrap_or_default();
    triangles.into_iter().map(|triangle| triangle.map(|k| p.vertices[k as usize]))
}

/// Triangles of about a size that a polygon is filled with, to be cut on where an edge is longer.
fn filling(p: &Polygon, size: f64) -> Vec<[DVec3; 3]> {
    fill::triangles(&p.vertices, size).unwrap_or_else(|| polygon_triangles(p).collect())
}

fn mesh_triangles(m: &Mesh) -> impl Iterator<Item = [DVec3; 3]> + Clone + '_ {
    m.triangles.iter().map(|triangle| triangle.map(|k| m.vertices[k as usize]))
}

/// A patch's own: where it is, and how it lies.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lie {
    pub(super) centre: DVec3,
    pub(super) normal: DVec3,
    pub(super) tangents: [DVec3; 2],
    pub(super) area: f64,
    /// The triangle of a mesh that it is (cut from); 0 of any other surface.
    pub(super) triangle: usize,
}

/// Cut `shape` by `plan`, the first patch being number `first`. Each patch is handed to `put`; the pieces that they are
/// made of come back, unless they are the cells of a parallelogram.
pub(super) fn cut(shape: &Shape, plan: Plan, first: u32, put: impl FnMut(Lie)) -> Option<Pieces> {
    let mut cutter = Cutter { pieces: Pieces::default(), patch: first, put };
    match (plan, shape) {
        (Plan::Grid(columns, rows), _) => {
            let (columns, rows) = (columns as u32, rows as u32);
            if let Some(p) = shape.parallelogram() {
                let (du, dv) = (p.u / f64::from(columns), p.v / f64::from(rows));
                let area = du.cross(dv).length();
                for row in 0..rows {
                    for column in 0..columns {
                        let s = (f64::from(column) + 0.5) / f64::from(columns);
                        let t = (f64::from(row) + 0.5) / f64::from(rows);
                        let centre = p.origin + p.u * s + p.v * t;
                        (cutter.put)(Lie { centre, normal: p.normal, tangents: [du, dv], area, triangle: 0 });
                    }
                }
                return None;
            }
            cutter.grid(&grid_of(shape, columns, rows), columns, rows);
            cutter.pieces.smooth = true;
        }
        (Plan::Whole(_), Shape::Polygon(p)) => {
            let area_vector = polygon::area_vector(&p.vertices);
            let normal = area_vector.normalize_or_zero();
            let tangent = p.vertices[1] - p.vertices[0];
            cutter.pieces.triangles.extend(polygon_triangles(p));
            cutter.pieces.patch.resize(cutter.pieces.triangles.len(), first);
            (cutter.put)(Lie {
                centre: polygon::inner_point(&p.vertices),
                normal,
                tangents: [tangent, normal.cross(tangent)],
                area: area_vector.length(),
                triangle: 0,
            });
        }
        (Plan::Triangles(parts, _), Shape::Polygon(p)) => {
            cutter.pieces.smooth = true;
            polygon_triangles(p).for_each(|t| parts.pieces(t, &mut |piece| cutter.triangle(piece, 0)));
        }
        (Plan::Filled(size, _), Shape::Polygon(p)) => {
            cutter.pieces.smooth = true;
            let triangles = filling(p, size);
            let (parts, _) = Parts::for_bound(triangles.iter().copied(), size);
            triangles.into_iter().for_each(|t| parts.pieces(t, &mut |piece| cutter.triangle(piece, 0)));
        }
        (Plan::Whole(_), Shape::Mesh(m) | Shape::Fractal(m)) => {
            for (piece, of) in mesh_triangles(m).zip(0..) {
                cutter.triangle(piece, of);
            }
        }
        (Plan::Triangles(parts, _), Shape::Mesh(m) | Shape::Fractal(m)) => {
            for (triangle, of) in mesh_triangles(m).zip(0..) {
                parts.pieces(triangle, &mut |piece| cutter.triangle(piece, of));
            }
        }
        _ => unreachable!("a grid is cut as a grid"),
    }
    Some(cutter.pieces)
}

/// A surface over (u, v), ready to be cut into cells.
struct Grid {
    surface: Parametric,
    /// Where it lies, for its true area.
    map: DAffine3,
    /// By how much its corners are blown up first.
    scale: f64,
    /// Whether the front is where u × v does not point.
    turned: bool,
}

fn grid_of(shape: &Shape, columns: u32, rows: u32) -> Grid {
    let flat = |corners, turned| Grid {
        surface: Parametric::Bilinear(corners),
        map: DAffine3::IDENTITY,
        scale: 1.0,
        turned,
    };
    let curved = |surface, c: &Curved, scale| Grid {
        surface,
        map: c.map,
        scale,
        turned: c.inward != (c.map.matrix3.determinant() < 0.0),
    };
    match shape {
        Shape::Quadrilateral(Quadrilateral { corners, mirrored, .. }) => flat(*corners, *mirrored),
        Shape::Polygon(p) => match p.vertices[..] {
            [a, b, c, d] => flat([a, b, c, d], false),
            _ => unreachable!("a polygon of four corners"),
        },
        Shape::Sphere(c) => curved(Parametric::Sphere, c, equal_area_scale(columns, rows)),
        // Not blown up: its ends lie on the circles that caps are made for.
        Shape::Cylinder(c) => curved(Parametric::Cylinder, c, 1.0),
        Shape::Parallelogram(_) | Shape::Mesh(_) | Shape::Fractal(_) => unreachable!("no grid"),
    }
}

/// Makes patches and their pieces.
struct Cutter<P> {
    pieces: Pieces,
    /// The next patch.
    patch: u32,
    put: P,
}

impl<P: FnMut(Lie)> Cutter<P> {
    /// A triangle that is a patch, and which triangle of a mesh it is cut from.
    fn triangle(&mut self, [a, b, c]: [DVec3; 3], triangle: usize) {
        let area_vector = (b - a).cross(c - a) * 0.5;
        self.pieces.triangles.push([a, b, c]);
        self.pieces.patch.push(self.patch);
        self.patch += 1;
        (self.put)(Lie {
            centre: (a + b + c) / 3.0,
            normal: area_vector.normalize_or_zero(),
            tangents: [b - a, c - a],
            area: area_vector.length(),
            triangle,
        });
    }

    fn grid(&mut self, grid: &Grid, columns: u32, rows: u32) {
        let along = |k: u32, count: u32| f64::from(k) / f64::from(count);
        let corners_of = |row: u32| -> Vec<DVec3> {
            let v = along(row, rows);
            let corner = |column| grid.surface.point(along(column, columns), v) * grid.scale;
            (0..=columns).map(|column| grid.map.transform_point3(corner(column))).collect()
        };
        let mut below = corners_of(0);
        for row in 0..rows {
            let above = corners_of(row + 1);
            for column in 0..columns {
                let k = column as usize;
                let corners = [below[k], below[k + 1], above[k + 1], above[k]];
                let spans =
                    [(column, columns), (row, rows)].map(|(k, count)| [along(k, count), along(k + 1, count)]);
                let area = grid.surface.area(grid.map.matrix3, spans[0], spans[1]);
                self.cell(corners, grid.turned, area);
            }
            below = above;
        }
    }

    /// A cell with these corners, counter-clockwise about u × v, as two triangles, or one at a pole. Where it is not flat they
    /// are parted by the diagonal that stands out on the front, so that its own pieces are nowhere above the patch's centre,
    /// which is that diagonal's middle.
    fn cell(&mut self, [a, b, c, d]: [DVec3; 4], turned: bool, area: f64) {
        let front = if turned { -1.0 } else { 1.0 };
        let normal = (c - a).cross(d - b).normalize_or_zero() * front;
        // How far the diagonal from a to c stands above that from b to d, at their middles.
        let ridge = (a + c - b - d).dot(normal) * 0.5;
        let flat = ridge.abs() <= FLAT * a.distance(c).max(b.distance(d));
        let by_ac = flat || ridge > 0.0;
        let halves = if by_ac { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
        let (mut moment, mut sum) = (DVec3::ZERO, 0.0);
        for [p, q, r] in halves {
            // At a pole two corners are one.
            if p == q || q == r || r == p {
                continue;
            }
            let size = (q - p).cross(r - p).length();
            moment += (p - a + q - a + r - a) * (size / 3.0);
            sum += size;
            self.pieces.triangles.push(if turned { [p, r, q] } else { [p, q, r] });
            self.pieces.patch.push(self.patch);
        }
        let centre = match (flat, by_ac) {
            (true, _) => a + moment / sum,
            (false, true) => (a + c) * 0.5,
            (false, false) => (b + d) * 0.5,
        };
        self.patch += 1;
        let tangents = [(b - a + c - d) * 0.5, (d - a + c - b) * 0.5];
        (self.put)(Lie { centre, normal, tangents, area, triangle: 0 });
    }
}
