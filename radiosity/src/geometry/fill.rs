//! A polygon filled with well-shaped triangles of about one size, by constrained Delaunay refinement (Ruppert 1995).

use glam::DVec3;
use spade::{AngleLimit, ConstrainedDelaunayTriangulation, Point2, RefinementParameters, Triangulation};

use super::polygon;

/// No angle less than this, where the polygon itself has none. \[degrees\]
const LEAST_ANGLE: f64 = 25.0;
/// The largest area, as a part of the square of the size. An equilateral triangle has 0.43; at 0.35 the fewest triangles are
/// left when those with an edge that is longer have been halved (an L, a pentagon, a disc, a floor plan: 6 to 15 % more at
/// 0.25 and at 0.6).
const LARGEST_AREA: f64 = 0.35;
/// More triangles than this are not worth the shaping.
const MOST: f64 = 2e6;

/// Triangles that cover the polygon `corners`, wound as it is, with edges of about `size`, some a little longer. `None`
/// where it is not simple, or would take millions.
pub fn triangles(corners: &[DVec3], size: f64) -> Option<Vec<[DVec3; 3]>> {
    let area_vector = polygon::area_vector(corners);
    let normal = area_vector.try_normalize()?;
    let largest = LARGEST_AREA * size * size;
    let expected = area_vector.length() / largest;
    if expected.is_nan() || expected >= MOST {
        return None;
    }
    // In the polygon's plane, in units of the size.
    let x = normal.any_orthonormal_vector();
    let y = normal.cross(x);
    let flat = |p: DVec3| Point2::new((p - corners[0]).dot(x) / size, (p - corners[0]).dot(y) / size);
    let mut mesh = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    let mut at = Vec::with_capacity(corners.len());
    for &corner in corners {
        at.push(mesh.insert(flat(corner)).ok()?);
    }
    for k in 0..at.len() {
        let (from, to) = (at[k], at[(k + 1) % at.len()]);
        if !mesh.can_add_constraint(from, to) {
            return None;
        }
        mesh.add_constraint(from, to);
    }
    let parameters = RefinementParameters::new()
        .exclude_outer_faces(true)
        .with_angle_limit(AngleLimit::from_deg(LEAST_ANGLE))
        .with_max_allowed_area(LARGEST_AREA)
        .with_max_additional_vertices(10 * (expected as usize + corners.len()) + 1_000);
    let outer = mesh.refine(parameters).excluded_faces;
    let mut inside = vec![true; mesh.num_all_faces()];
    for face in outer {
        inside[face.index()] = false;
    }
    // The polygon's own corners as they are; what was put between lies in its plane.
    let mut place: Vec<DVec3> = Vec::with_capacity(mesh.num_vertices());
    for vertex in mesh.vertices() {
        let p = vertex.position();
        place.push(corners[0] + x * (p.x * size) + y * (p.y * size));
    }
    for (&corner, vertex) in corners.iter().zip(&at) {
        place[vertex.index()] = corner;
    }
    let faces = mesh.inner_faces().filter(|face| inside[face.index()]);
    Some(faces.map(|face| face.vertices().map(|vertex| place[vertex.index()])).collect())
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use proptest::prelude::*;

    use super::*;

    fn flat(points: &[[f64; 2]]) -> Vec<DVec3> {
        points.iter().map(|p| DVec3::new(p[0], 3.0, -p[1])).collect()
    }

    /// An L, a floor plan with doors and niches, a disc of 48 corners.
    fn shapes() -> [Vec<DVec3>; 3] {
        let disc = (0..48).map(|k| (f64::from(k) / 48.0 * TAU).sin_cos()).map(|(sin, cos)| [cos, sin]);
        [
            flat(&[[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]]),
            flat(&[
                [0.0, 0.0],
                [10.0, 0.0],
                [10.0, 4.0],
                [7.0, 4.0],
                [7.0, 3.8],
                [6.0, 3.8],
                [6.0, 8.0],
                [3.0, 8.0],
                [3.0, 7.9],
                [2.8, 7.9],
                [2.8, 8.0],
                [0.0, 8.0],
            ]),
            flat(&disc.collect::<Vec<_>>()),
        ]
    }

    #[test]
    fn it_covers_the_polygon_with_well_shaped_triangles() {
        for corners in shapes() {
            for size in [0.1, 0.3, 1.0] {
                let triangles = triangles(&corners, size).unwrap();
                let normal = polygon::area_vector(&corners);
                let mut sum = 0.0;
                for &[a, b, c] in &triangles {
                    let area = (b - a).cross(c - a).dot(normal.normalize()) * 0.5;
                    assert!(area > 0.0 && area <= LARGEST_AREA * size * size * (1.0 + 1e-9));
                    sum += area;
                    for [p, q, r] in [[a, b, c], [b, c, a], [c, a, b]] {
                        assert!((q - p).angle_between(r - p).to_degrees() > LEAST_ANGLE - 1e-6);
                    }
                }
                assert!((sum / normal.length() - 1.0).abs() < 1e-12);
                for corner in &corners {
                    assert!(triangles.iter().flatten().any(|p| p == corner));
                }
            }
        }
    }

    #[test]
    fn it_is_the_same_every_time() {
        let [_, plan, _] = shapes();
        let first = triangles(&plan, 0.2);
        assert!((0..20).all(|_| triangles(&plan, 0.2) == first));
    }

    #[test]
    fn what_cannot_be_filled_is_left() {
        let bow = flat(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.2]]);
        assert_eq!(triangles(&bow, 0.1), None);
        assert_eq!(triangles(&flat(&[[0.0, 0.0], [1.0, 1.0]]), 0.1), None);
        for size in [1e-9, 0.0, f64::NAN] {
            assert_eq!(triangles(&shapes()[0], size), None);
        }
    }

    proptest! {
        #[test]
        fn any_simple_polygon_is_filled(
            reaches in prop::collection::vec(0.001_f64..1.0, 5..40),
            size in 0.05_f64..2.0,
            unit in prop_oneof![Just(1.0), Just(1e-12), Just(1e12)],
        ) {
            // Seen whole from the middle, with spikes and bays.
            let count = reaches.len() as f64;
            let corners: Vec<_> = reaches.iter().zip(0..).map(|(reach, k)| {
                let (sin, cos) = (f64::from(k) / count * TAU).sin_cos();
                DVec3::new(cos, sin, 0.5 * cos) * (*reach * unit)
            }).collect();
            prop_assume!(polygon::triangulate(&corners).is_some());
            let triangles = triangles(&corners, size * unit).unwrap();
            let area: f64 = triangles.iter().map(|&[a, b, c]| (b - a).cross(c - a).length() * 0.5).sum();
            prop_assert!((area / polygon::area_vector(&corners).length() - 1.0).abs() < 1e-6);
        }
    }
}
