//! Whether a shape can carry light: it must have an area, and be flat where N3D holds it for flat.

use glam::DVec3;

use super::number::GREATEST;
use crate::geometry::polygon;
use crate::scene::{Curved, Mesh, Parallelogram, Polygon, Quadrilateral, Shape};

/// An area below this part of the square of the longest side is none: what is left of three points in a line
/// when their coordinates have been rounded.
const NO_AREA: f64 = 1e-12;
/// Corners that need a slab thicker than this part of the diameter make no planar polygon.
const UNEVEN: f64 = 1e-4;
/// A sphere or cylinder squashed to less than this part of its width is no body any more.
const FLATTENED: f64 = 1e-9;
/// Sizes below this would underflow in products of areas.
const SMALLEST: f64 = 1.0 / GREATEST;

/// What is wrong with a shape, and the cure.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct BadShape {
    pub(super) message: String,
    pub(super) help: String,
    /// Of a mesh, which triangle it is; of a polygon, which corner.
    pub(super) part: Option<usize>,
}

fn bad(message: impl Into<String>, help: impl Into<String>, part: Option<usize>) -> BadShape {
    BadShape { message: message.into(), help: help.into(), part }
}

/// Whether the shape, in whichever space its coordinates are, can be cut into patches.
pub(super) fn check(shape: &Shape) -> Result<(), BadShape> {
    match shape {
        Shape::Parallelogram(p) => parallelogram(p),
        Shape::Polygon(p) => simple_polygon(p),
        Shape::Quadrilateral(q) => quadrilateral(q),
        Shape::Mesh(m) | Shape::Fractal(m) => mesh(m),
        Shape::Sphere(c) | Shape::Cylinder(c) => curved(shape, c),
    }
}

fn size(points: &[DVec3]) -> Result<(), BadShape> {
    // NaN is not less than anything, so it is refused too.
    if !points.iter().all(|p| p.abs().max_element() <= GREATEST) {
        return Err(bad("reaches beyond 1e15", "choose a larger unit of length, or a smaller scale", None));
    }
    if polygon::diameter(points) < SMALLEST {
        let message = match points.iter().all(|p| *p == points[0]) {
            true => "has all its points in one place",
            false => "is smaller than 1e-15",
        };
        return Err(bad(message, "give it a size, or choose a smaller unit of length", None));
    }
    Ok(())
}

fn parallelogram(p: &Parallelogram) -> Result<(), BadShape> {
    size(&p.corners())?;
    for (side, name, part) in [(p.u, "1 and 2", 1), (p.v, "1 and 4", 3)] {
        if side == DVec3::ZERO {
            return Err(bad(
                format!("has its points {name} in one place: no area"),
                "give four different corners",
                Some(part),
            ));
        }
    }
    let longest = p.u.length().max(p.v.length());
    if p.u.cross(p.v).length() <= NO_AREA * longest * longest {
        return Err(bad("has all its points on one line: no area", "give corners that span an area", None));
    }
    Ok(())
}

fn quadrilateral(q: &Quadrilateral) -> Result<(), BadShape> {
    let corners = &q.corners;
    size(corners)?;
    let longest = (0..4).map(|k| corners[k].distance(corners[(k + 1) % 4])).fold(0.0, f64::max);
    if let Some(k) = (0..4).find(|&k| corners[k] == corners[(k + 1) % 4]) {
        let (first, second) = (k + 1, (k + 1) % 4 + 1);
        return Err(bad(
            format!("has its points {first} and {second} in one place"),
            "give four different corners, or write three as a TI",
            Some((k + 1) % 4),
        ));
    }
    let least = NO_AREA * longest * longest;
    let flat_or_less = |corners: &[DVec3; 4]| -> Vec<(usize, f64)> {
        turns(corners).into_iter().enumerate().filter(|&(_, turn)| turn <= least).collect()
    };
    let [one, two, three, four] = *corners;
    match flat_or_less(corners)[..] {
        [] => Ok(()),
        [(k, turn)] if turn >= -least => Err(bad(
            format!("has its point {} on the line between its neighbours", k + 1),
            "move the point, or write the other three as a TI",
            Some(k),
        )),
        [(k, _)] => Err(bad(
            format!(
                "is concave at its point {}: it is cut between opposite sides, which takes a convex one",
                k + 1
            ),
            "write it as a PG where it is flat, else as two TI that part it at that point",
            Some(k),
        )),
        _ if flat_or_less(&[one, two, four, three]).is_empty() => Err(bad(
            "crosses itself",
            "exchange its last two points: corners are written around the outline",
            Some(2),
        )),
        _ => Err(bad(
            "crosses itself, is folded over, or has all its points on one line",
            "write its corners around the outline; cut one that is folded into two TI",
            None,
        )),
    }
}

/// How far each corner of a quadrilateral turns the way that the whole does, as twice an area. Over the surface the normal
/// is linear in u and in v, so where all four corners face one way, all of it does.
fn turns(corners: &[DVec3; 4]) -> [f64; 4] {
    let whole = polygon::area_vector(corners).normalize_or_zero();
    [0, 1, 2, 3].map(|k| {
        let (before, here, after) = (corners[(k + 3) % 4], corners[k], corners[(k + 1) % 4]);
        (after - here).cross(before - here).dot(whole)
    })
}

fn curved(shape: &Shape, c: &Curved) -> Result<(), BadShape> {
    size(&shape.vertices())?;
    let (there, back) = (c.map.matrix3, c.map.matrix3.inverse());
    let norm = |m: glam::DMat3| m.to_cols_array().into_iter().map(|x| x * x).sum::<f64>().sqrt();
    // NaN is not more than anything, so it is refused too.
    if norm(there) * norm(back) < 1.0 / FLATTENED {
        Ok(())
    } else {
        Err(bad(
            "is squashed flat",
            "scale it less along one axis than along the others, or write a PG or QD",
            None,
        ))
    }
}

fn simple_polygon(p: &Polygon) -> Result<(), BadShape> {
    let corners = &p.vertices;
    size(corners)?;
    let n = corners.len();
    let diameter = polygon::diameter(corners);
    if let Some(k) = (0..n).find(|&k| corners[k] == corners[(k + 1) % n]) {
        let (first, second) = (k + 1, (k + 1) % n + 1);
        return Err(bad(
            format!("has its points {first} and {second} in one place"),
            "write each corner once",
            Some((k + 1) % n),
        ));
    }
    // Twice the area with the first corner's farthest: zero when all lie on one line.
    let far = corners
        .iter()
        .map(|p| *p - corners[0])
        .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    let far = far.unwrap_or_default();
    if corners.iter().all(|p| far.cross(*p - corners[0]).length() <= NO_AREA * diameter * diameter) {
        return Err(bad("has all its points on one line: no area", "give corners that span an area", None));
    }
    let thickness = polygon::thickness(corners);
    if thickness > UNEVEN * diameter {
        return Err(bad(
            format!("is not flat: its points lie up to {} out of one plane", short(thickness)),
            "move the point into the plane, or cut the polygon into TI",
            None,
        ));
    }
    if polygon::triangulate(corners).is_some() {
        return Ok(());
    }
    let Some([i, j]) = polygon::crossing(corners) else {
        return Err(bad(
            "is too thin somewhere to be cut into triangles",
            "leave out points that lie all but on one another, or cut it into TI",
            None,
        ));
    };
    let edge = |k: usize| format!("{}-{}", k + 1, (k + 1) % n + 1);
    Err(bad(
        format!("crosses or touches itself: see its edges {} and {}", edge(i), edge(j)),
        "order the points around the outline; cut an outline that meets itself into several PG",
        None,
    ))
}

fn mesh(m: &Mesh) -> Result<(), BadShape> {
    size(&m.vertices)?;
    m.triangles
        .iter()
        .enumerate()
        .try_for_each(|(k, triangle)| mesh_triangle(triangle.map(|index| m.vertices[index as usize]), k))
}

/// Triangle `k`, counted from 0, of a mesh.
pub(super) fn mesh_triangle([a, b, c]: [DVec3; 3], k: usize) -> Result<(), BadShape> {
    let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    if (b - a).cross(c - a).length() <= NO_AREA * longest || longest < SMALLEST * SMALLEST {
        return Err(bad(
            format!("has no area in its triangle {}", k + 1),
            "leave the triangle out, or give it three corners that are not on one line",
            Some(k),
        ));
    }
    Ok(())
}

/// A length as people read it.
fn short(length: f64) -> String {
    if (1e-3..1e6).contains(&length) { format!("{length:.4}") } else { format!("{length:.1e}") }
}
