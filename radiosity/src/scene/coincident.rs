//! Surfaces that lie on one another.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use glam::{DMat3, DVec3};

use super::{BackFaces, Curved, Scene, Shape};
use crate::geometry::polygon;

/// Points nearer than this, relative to the scene's size, are one: what different ways to compute a corner leave.
const ONE_PLACE: f64 = 1e-9;

/// Pairs of surfaces, the later second, that lie on one another exactly: of equal corners, or the same sphere or cylinder.
/// Where backs are black those that face apart are no pair, but the two sides of a sheet. Of a mesh each triangle counts; one that has a triangle twice is paired with itself. A surface
/// is named once, with the first that it lies on.
///
/// Which of two such surfaces is seen is left to their order in the file, so one of them is a slip as a rule. Surfaces that
/// overlap only in part are not found. Takes time in proportion to the number of corners.
pub fn coincident(scene: &Scene, back_faces: BackFaces) -> Vec<[u32; 2]> {
    let (low, high) = scene
        .surfaces
        .iter()
        .flat_map(|surface| surface.shape.vertices())
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let sided = back_faces == BackFaces::Black;
    let grid = Grid { origin: low, step: (high - low).max_element() * ONE_PLACE, sided };
    let mut first_at: HashMap<Vec<[i64; 3]>, u32> = HashMap::new();
    let mut pairs = Vec::new();
    for (surface, index) in scene.surfaces.iter().zip(0..) {
        // The first that any part of it lies on; known to its own later parts too.
        let mut on = None;
        for key in grid.keys(&surface.shape) {
            match first_at.entry(key) {
                Entry::Occupied(first) => {
                    on.get_or_insert(*first.get());
                }
                Entry::Vacant(none) => {
                    none.insert(index);
                }
            }
        }
        pairs.extend(on.map(|first| [first, index]));
    }
    pairs
}

/// Where points are told apart.
struct Grid {
    origin: DVec3,
    step: f64,
    /// Whether it matters which way a shape faces.
    sided: bool,
}

impl Grid {
    fn place(&self, point: DVec3) -> [i64; 3] {
        ((point - self.origin) / self.step).round().to_array().map(|x| x as i64)
    }

    /// What is the same for shapes that lie on one another: corners in one order.
    fn outline(&self, corners: &[DVec3]) -> Vec<[i64; 3]> {
        let mut places: Vec<_> = corners.iter().map(|&corner| self.place(corner)).collect();
        places.sort_unstable();
        places
    }

    /// The outline, and which way a flat shape of this normal faces: the sign of the normal's greatest part.
    fn flat(&self, corners: &[DVec3], normal: DVec3) -> Vec<[i64; 3]> {
        let mut key = self.outline(corners);
        if self.sided {
            key.push([normal[normal.abs().max_position()].signum() as i64, 0, 0]);
        }
        key
    }

    fn keys(&self, shape: &Shape) -> Vec<Vec<[i64; 3]>> {
        match shape {
            Shape::Parallelogram(p) => vec![self.flat(&p.corners(), p.normal)],
            Shape::Polygon(_) | Shape::Quadrilateral(_) => {
                let corners = shape.vertices();
                let mirrored = matches!(shape, Shape::Quadrilateral(q) if q.mirrored);
                let normal = polygon::area_vector(&corners);
                vec![self.flat(&corners, if mirrored { -normal } else { normal })]
            }
            Shape::Mesh(m) | Shape::Fractal(m) => {
                let triangle = |t: &[u32; 3]| {
                    let corners = t.map(|k| m.vertices[k as usize]);
                    self.flat(&corners, polygon::area_vector(&corners))
                };
                m.triangles.iter().map(triangle).collect()
            }
            Shape::Sphere(c) => {
                let [x, y, z] = c.axes();
                vec![self.ellipsoid(c, &[c.map.translation], [x, y, z])]
            }
            Shape::Cylinder(c) => {
                let [x, y, z] = c.axes();
                vec![self.ellipsoid(c, &[c.map.translation, c.map.translation + x], [DVec3::ZERO, y, z])]
            }
        }
    }

    /// An ellipse, or an ellipsoid, about each of `centres`, whichever of its half axes are given.
    fn ellipsoid(&self, c: &Curved, centres: &[DVec3], half_axes: [DVec3; 3]) -> Vec<[i64; 3]> {
        let mut key = self.outline(centres);
        let [x, y, z] = half_axes;
        let axes = DMat3::from_cols(x, y, z);
        let form = axes * axes.transpose();
        // An area now; brought back to a length by the shape's own size.
        let size = c.axes().into_iter().map(DVec3::length).fold(0.0, f64::max);
        key.extend([form.x_axis, form.y_axis, form.z_axis].map(|axis| self.place(self.origin + axis / size)));
        if self.sided {
            key.push([i64::from(c.inward), 0, 0]);
        }
        key
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::n3d::parse_scene;

    fn pairs(text: &str) -> Vec<[u32; 2]> {
        paired(text, BackFaces::Lit)
    }

    fn paired(text: &str, back_faces: BackFaces) -> Vec<[u32; 2]> {
        let scene = parse_scene("a.scn", text.as_bytes()).unwrap_or_else(|error| panic!("{error}"));
        coincident(&scene, back_faces)
    }

    #[test]
    fn what_lies_on_another_is_named() {
        let square = "QD 3 3 0 0 0 .1 0 0 .1 .3 0 0 .3 0 ID";
        let turned = "PG .1 .3 0 .1 0 0 0 0 0 0 .3 0 .1 .3 0 ID";
        let there = "QD 1 1 1 0 0 1.1 0 0 1.1 .3 0 1 .3 0 TR -1 0 0 ID";
        assert_eq!(pairs(&format!("{square} {turned} {there}")), [[0, 1], [0, 2]]);
        assert_eq!(
            pairs(&format!("{square} QD 3 3 0 0 0 .1 0 0 .1 .3001 0 0 .3001 0 ID")),
            [] as [[u32; 2]; 0]
        );
        assert_eq!(pairs("SP ID SP RT 0 0 0 1 2 3 .7 IN ID SP TR 0 0 1e-3 ID CL ID"), [[0, 1]]);
        assert_eq!(
            pairs("CL ID CL RT 0 0 0 1 0 0 .3 ID CL HO .5 0 0 1 0 0 -1 ID CL TR .1 0 0 ID"),
            [[0, 1], [0, 2]]
        );
        let mesh = "VO 0 0 0 4 0 0 0 1 0 0 0 1 0 0 0 1";
        assert_eq!(pairs(&format!("{mesh} 2 1 2 3 1 2 4 ID TI 0 1 0 0 0 0 1 0 0 ID")), [[0, 1]]);
        assert_eq!(pairs(&format!("{mesh} 2 1 2 3 2 1 3 ID")), [[0, 0]]);
        assert_eq!(pairs(&format!("{mesh} 2 1 2 3 1 2 4 ID")), [] as [[u32; 2]; 0]);
    }
    #[test]
    fn the_two_sides_of_a_sheet_are_no_slip() {
        let square = "QD 3 3 0 0 0 1 0 0 1 3 0 0 3 0 ID";
        let turned = "PG 1 3 0 1 0 0 0 0 0 0 3 0 1 3 0 ID";
        let same = "PG 1 0 0 1 3 0 0 3 0 0 0 0 1 0 0 ID";
        assert_eq!(paired(&format!("{square} {turned}"), BackFaces::Black), [] as [[u32; 2]; 0]);
        assert_eq!(paired(&format!("{square} {same}"), BackFaces::Black), [[0, 1]]);
        assert_eq!(paired("SP ID SP IN ID SP IN ID", BackFaces::Black), [[1, 2]]);
    }
}
