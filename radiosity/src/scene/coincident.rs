//! Surfaces that lie on one another.

use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, HashMap};

use glam::{DMat3, DVec3};

use super::{BackFaces, Curved, Scene, Shape, TOUCHING};
use crate::geometry::{contact, polygon};

/// Points nearer than this, relative to the scene's size, are one: what different ways to compute a corner leave.
const ONE_PLACE: f64 = 1e-9;

/// Pairs of surfaces, the later second, that lie on one another exactly: of equal corners, or the same sphere or cylinder.
/// Where backs are black those that face apart are no pair, but the two sides of a sheet. Of a mesh each triangle counts; one that has a triangle twice is paired with itself. A surface
/// is named once, with the first that it lies on.
///
/// Which of two such surfaces is seen is left to their order in the file, so one of them is a slip as a rule. Those that
/// lie on one another only in part are found by [`overlaps`]. Takes time in proportion to the number of corners.
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

/// Two surfaces that lie on one another in part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// Which they are, the later second; a mesh may lie on itself.
    pub surfaces: [u32; 2],
    /// The area that they share.
    pub area: f64,
    /// A point of it.
    pub at: DVec3,
}

/// Flat surfaces that face one way in one plane and lie on one another, in part or wholly, as a rug does that is as high as the
/// floor. Which of the two is seen there is left to chance in most programs, and to their order in the file here. Those that
/// face apart, as the floor and the bottom of a box that stands on it, hide each other and are no slip.
pub fn overlaps(scene: &Scene) -> Vec<Overlap> {
    let (mut plates, mut surface_of) = (Vec::new(), Vec::new());
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for (surface, index) in scene.surfaces.iter().zip(0_u32..) {
        for vertex in surface.shape.vertices() {
            (low, high) = (low.min(vertex), high.max(vertex));
        }
        plates.extend(surface.shape.plates().unwrap_or_default());
        surface_of.resize(plates.len(), index);
    }
    let tolerance = (high - low).max_element().max(0.0) * TOUCHING;
    let mut found: BTreeMap<[u32; 2], Overlap> = BTreeMap::new();
    for (pair, area, at) in contact::overlaps(&plates, tolerance) {
        let mut surfaces = pair.map(|plate| surface_of[plate as usize]);
        surfaces.sort_unstable();
        found.entry(surfaces).or_insert(Overlap { surfaces, area: 0.0, at }).area += area;
    }
    found.into_values().collect()
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
    fn what_lies_on_another_in_part_is_named_with_its_area() {
        let found = |text: &str| {
            let scene = parse_scene("a.scn", text.as_bytes()).unwrap_or_else(|error| panic!("{error}"));
            let found = overlaps(&scene).into_iter();
            found.map(|overlap| (overlap.surfaces, (overlap.area * 1e6).round() / 1e6)).collect::<Vec<_>>()
        };
        let floor = "QD 3 3 0 0 0 4 0 0 4 4 0 0 4 0 ID";
        // A rug half on the floor, a triangle within it, a tile beside it, a box's bottom, a rug that lies a little higher.
        let rug = "QD 1 1 3 1 0 5 1 0 5 2 0 3 2 0 ID";
        let triangle = "TI 1 1 0 2 1 0 1 2 0 ID";
        assert_eq!(found(&format!("{floor} {rug} {triangle}")), [([0, 1], 1.0), ([0, 2], 0.5)]);
        for none in [
            "QD 1 1 4 0 0 5 0 0 5 4 0 4 4 0 ID",
            "QD 1 1 1 1 0 1 2 0 2 2 0 2 1 0 ID",
            "QD 1 1 1 1 .001 2 1 .001 2 2 .001 1 2 .001 ID",
            "QD 1 1 1 1 0 2 1 0 2 1 1 1 1 1 ID",
        ] {
            assert_eq!(found(&format!("{floor} {none}")), [], "{none}");
        }
        let mesh = "VO 0 0 0 5 0 0 0 2 0 0 2 2 0 0 2 0 1 1 0";
        assert_eq!(found(&format!("{mesh} 3 1 2 3 1 3 4 1 2 5 ID")), [([0, 0], 1.0)]);
        let concave = "PG 5 5 0 3 5 0 3 3.5 0 3.5 3.5 0 5 3 0 5 5 0 ID";
        assert_eq!(found(&format!("{floor} {concave}")), [([0, 1], 0.541667)]);
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
