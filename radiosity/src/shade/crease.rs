//! Where a mesh is smooth and where it has an edge: values at the corners of its triangles.

use glam::DVec3;

use crate::light::Rgb;
use crate::scene::Mesh;

/// Two triangles that share an edge are one smooth surface where their normals differ by less than this. \[degrees\]
///
/// Between the 30° that modelling programs begin with and the 45° of a sphere of eight sides, which nobody wants to
/// see as a sphere anyway.
pub(super) const CREASE_ANGLE: f64 = 40.0;

/// Which corners of a mesh's triangles share a value, and by what weights: the mesh's own part of smooth shading, to be
/// found once and used for any values.
///
/// Corners that meet in a vertex and are joined by smooth edges share one value: the mean of their triangles, each
/// counting by the angle it takes up there, so that it does not matter how a flat piece happens to be triangulated.
/// Vertices are the same where their positions are the same to the bit, whatever their index.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshCorners {
    /// For each corner, 3 × triangle + 0..3, the one that stands for all that share its value.
    shared: Vec<u32>,
    /// The angle of the triangle at each corner. \[radians\]
    angle: Vec<f64>,
}

impl MeshCorners {
    /// Those of `mesh`.
    pub fn new(mesh: &Mesh) -> Self {
        let vertex = merged_vertices(mesh);
        let normals: Vec<DVec3> = mesh.triangles.iter().map(|t| normal(mesh, *t)).collect();

        // Join corners across every smooth edge.
        let mut groups = Groups::new(3 * mesh.triangles.len());
        let mut edges: Vec<([u32; 2], u32, u8)> = Vec::with_capacity(3 * mesh.triangles.len());
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            for k in 0..3 {
                let [a, b] = [triangle[k], triangle[(k + 1) % 3]].map(|at| vertex[at as usize]);
                if a != b {
                    edges.push(([a.min(b), a.max(b)], index as u32, k as u8));
                }
            }
        }
        edges.sort_unstable();
        let smooth = CREASE_ANGLE.to_radians().cos();
        for shared in edges.chunk_by(|one, other| one.0 == other.0) {
            // Two triangles an edge as a rule; where more meet, each pair is judged by itself, among the first few.
            for (at, &(ends, first, first_side)) in shared.iter().enumerate() {
                for &(_, second, second_side) in shared[at + 1..].iter().take(8) {
                    if normals[first as usize].dot(normals[second as usize]) > smooth {
                        for end in ends {
                            let corner = |triangle: u32, side: u8| {
                                let start = mesh.triangles[triangle as usize][usize::from(side)];
                                let starts_here = vertex[start as usize] == end;
                                let k =
                                    if starts_here { usize::from(side) } else { (usize::from(side) + 1) % 3 };
                                3 * triangle as usize + k
                            };
                            groups.join(corner(first, first_side), corner(second, second_side));
                        }
                    }
                }
            }
        }
        let corners = 0..3 * mesh.triangles.len();
        Self {
            shared: corners.clone().map(|corner| groups.root(corner) as u32).collect(),
            angle: corners.map(|corner| corner_angle(mesh, corner)).collect(),
        }
    }

    /// A value at each corner of each triangle, from one value a triangle.
    ///
    /// # Panics
    ///
    /// Where there are not as many values as triangles.
    pub fn values(&self, values: &[Rgb]) -> Vec<[Rgb; 3]> {
        assert_eq!(3 * values.len(), self.shared.len(), "one value a triangle");
        // The mean of each group, summed in the order of the triangles.
        let mut sums = vec![(Rgb::BLACK, 0.0_f64); self.shared.len()];
        for (corner, (&shared, &angle)) in self.shared.iter().zip(&self.angle).enumerate() {
            let sum = &mut sums[shared as usize];
            sum.0 += values[corner / 3] * angle;
            sum.1 += angle;
        }
        let at = |corner: usize| {
            let (sum, weight) = sums[self.shared[corner] as usize];
            if weight > 0.0 { sum * (1.0 / weight) } else { values[corner / 3] }
        };
        (0..values.len()).map(|triangle| std::array::from_fn(|k| at(3 * triangle + k))).collect()
    }
}

/// For each vertex, the first one, by index, at the same position.
fn merged_vertices(mesh: &Mesh) -> Vec<u32> {
    // Adding zero makes -0 and 0 the same position.
    let key = |index: u32| (mesh.vertices[index as usize] + DVec3::ZERO).to_array().map(f64::to_bits);
    let mut order: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
    order.sort_unstable_by_key(|&index| (key(index), index));
    let mut merged = vec![0; mesh.vertices.len()];
    for same in order.chunk_by(|&one, &other| key(one) == key(other)) {
        for &index in same {
            merged[index as usize] = same[0];
        }
    }
    merged
}

fn normal(mesh: &Mesh, triangle: [u32; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(|k| mesh.vertices[k as usize]);
    (b - a).cross(c - a).normalize_or_zero()
}

/// The angle of a triangle at a corner, 0 where it has none. \[radians\]
fn corner_angle(mesh: &Mesh, corner: usize) -> f64 {
    let triangle = mesh.triangles[corner / 3];
    let [here, next, last] = [0, 1, 2].map(|step| mesh.vertices[triangle[(corner + step) % 3] as usize]);
    let angle = (next - here).angle_between(last - here);
    if angle.is_finite() { angle } else { 0.0 }
}

/// Sets that can only be joined (union-find); the least member stands for its set.
struct Groups(Vec<u32>);

impl Groups {
    fn new(members: usize) -> Self {
        Self((0..members as u32).collect())
    }

    fn root(&mut self, member: usize) -> usize {
        let mut at = member;
        while self.0[at] as usize != at {
            // Halve the path, for the next who come this way.
            self.0[at] = self.0[self.0[at] as usize];
            at = self.0[at] as usize;
        }
        at
    }

    fn join(&mut self, one: usize, other: usize) {
        let (one, other) = (self.root(one), self.root(other));
        self.0[one.max(other)] = one.min(other) as u32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles over the edge (0,0,0)-(0,1,0), folded by `fold` degrees.
    fn fold(degrees: f64) -> Mesh {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Mesh {
            vertices: vec![DVec3::ZERO, DVec3::Y, DVec3::new(-1.0, 0.5, 0.0), DVec3::new(cos, 0.5, sin)],
            triangles: vec![[0, 1, 2], [1, 0, 3]],
            ..Mesh::default()
        }
    }

    fn corner_values(mesh: &Mesh, values: &[Rgb]) -> Vec<[Rgb; 3]> {
        MeshCorners::new(mesh).values(values)
    }

    const VALUES: [Rgb; 2] = [Rgb::grey(1.0), Rgb::grey(3.0)];

    #[test]
    fn a_gentle_fold_is_smooth() {
        let corners = corner_values(&fold(39.0), &VALUES);
        assert_eq!(corners[0][0], corners[1][1]);
        assert_eq!(corners[0][1], corners[1][0]);
        assert!((corners[0][0].r - 2.0).abs() < 1e-12, "{:?}", corners[0][0]);
        assert_eq!(corners[0][2], VALUES[0]);
        assert_eq!(corners[1][2], VALUES[1]);
    }

    #[test]
    fn a_sharp_fold_is_a_crease() {
        assert_eq!(corner_values(&fold(41.0), &VALUES), VALUES.map(|value| [value; 3]));
    }

    #[test]
    fn equal_positions_are_one_vertex() {
        let mut mesh = fold(0.0);
        mesh.vertices.extend([DVec3::new(-0.0, 0.0, 0.0), DVec3::Y]);
        mesh.triangles[1] = [5, 4, 3];
        let corners = corner_values(&mesh, &VALUES);
        assert_eq!(corners[0][0], corners[1][1]);
        assert!((corners[0][0].r - 2.0).abs() < 1e-12);
    }

    /// A box of triangles: every face is one flat piece, no value crosses an edge of the box.
    #[test]
    fn a_box_keeps_its_edges() {
        let vertices: Vec<DVec3> =
            (0..8).map(|k| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2))).collect();
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let values: Vec<Rgb> = (0..12).map(|k| Rgb::grey(f64::from(k / 2))).collect();
        let corners = corner_values(&Mesh { vertices, triangles, ..Mesh::default() }, &values);
        for (triangle, value) in corners.iter().zip(&values) {
            for corner in triangle {
                assert!((corner.r - value.r).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_triangle_without_area_keeps_its_own_value() {
        let mut mesh = fold(0.0);
        mesh.triangles.push([0, 1, 1]);
        let corners = corner_values(&mesh, &[VALUES[0], VALUES[1], Rgb::grey(9.0)]);
        assert!(corners.iter().flatten().all(|corner| corner.r.is_finite()));
        assert!((corners[0][0].r - 2.0).abs() < 1e-12);
    }
}
