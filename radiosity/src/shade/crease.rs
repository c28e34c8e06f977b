//! Where triangles are one smooth surface and where they have an edge: values at their corners.

use glam::DVec3;

use crate::light::Rgb;
use crate::patches::Patches;
use crate::scene::Scene;

/// Two triangles that share an edge are one smooth surface where their normals differ by less than this. \[degrees\]
///
/// Between the 30° that modelling programs begin with and the 45° of a sphere of eight sides, which nobody wants to
/// see as a sphere anyway.
pub(super) const CREASE_ANGLE: f64 = 40.0;

/// Which corners of a scene's pieces share a value, and by what weights: the geometry's own part of smooth shading, to be
/// found once and used for any values.
///
/// Corners that meet in a point and are joined by smooth edges share one value: the mean of their patches, each
/// counting by the angle it takes up there, so that it does not matter how a flat piece happens to be triangulated.
/// Points are the same where their coordinates are the same to the bit. Within a surface that is smooth by its nature, such
/// as a sphere, every edge is; any other is where its two triangles, be they of one surface or of two of the same colours,
/// differ by less than 40 degrees. But where another surface stands on an edge ([`Pieces::sharp`](crate::patches::Pieces)) the
/// two sides have values of their own, whatever the angle.
#[derive(Clone, Debug, PartialEq)]
pub struct PieceCorners {
    /// For each corner, 3 × piece + 0..3, the one that stands for all that share its value.
    shared: Vec<u32>,
    /// The angle of the piece at each corner. \[radians\]
    angle: Vec<f64>,
    /// The patch of each piece.
    patch: Vec<u32>,
    /// For each surface, where its pieces begin; one more entry ends the last.
    starts: Vec<u32>,
}

impl PieceCorners {
    /// Those of `scene`, of which `patches` were cut.
    pub fn new(scene: &Scene, patches: &Patches) -> Self {
        let (mut triangles, mut patch, mut starts) = (Vec::new(), Vec::new(), vec![0]);
        // The edges that something stands on, bit by bit a triangle.
        let mut sharp: Vec<u8> = Vec::new();
        for pieces in &patches.pieces {
            if let Some(pieces) = pieces {
                triangles.extend_from_slice(&pieces.triangles);
                patch.extend_from_slice(&pieces.patch);
                sharp.extend_from_slice(&pieces.sharp);
                sharp.resize(patch.len(), 0);
            }
            starts.push(patch.len() as u32);
        }
        let vertex = merged_vertices(&triangles);
        let normals: Vec<DVec3> = triangles.iter().map(|&triangle| normal(triangle)).collect();
        let alike = |one: u32, other: u32| {
            let [one, other] = [one, other].map(|surface| scene.surfaces[surface as usize].material);
            (one.diffuse, one.emission) == (other.diffuse, other.emission)
        };
        let surface = |piece: u32| patches.surface[patch[piece as usize] as usize];
        let crease = CREASE_ANGLE.to_radians().cos();
        let smooth = |one: u32, other: u32| {
            let (here, there) = (surface(one), surface(other));
            let whole = patches.pieces[here as usize].as_ref().is_some_and(|pieces| pieces.smooth);
            if here == there && whole {
                return true;
            }
            normals[one as usize].dot(normals[other as usize]) > crease && alike(here, there)
        };

        // Join corners across every smooth edge.
        let mut groups = Groups::new(3 * triangles.len());
        let mut edges: Vec<([u32; 2], u32, u8)> = Vec::with_capacity(3 * triangles.len());
        for index in 0..triangles.len() {
            for k in 0..3 {
                let [a, b] = [k, (k + 1) % 3].map(|k| vertex[3 * index + k]);
                if a != b {
                    edges.push(([a.min(b), a.max(b)], index as u32, k as u8));
                }
            }
        }
        edges.sort_unstable();
        for shared in edges.chunk_by(|one, other| one.0 == other.0) {
            if shared.iter().any(|&(_, piece, side)| sharp[piece as usize] >> side & 1 == 1) {
                continue;
            }
            // Two triangles an edge as a rule; where more meet, each pair is judged by itself, among the first few.
            for (at, &(ends, first, first_side)) in shared.iter().enumerate() {
                for &(_, second, second_side) in shared[at + 1..].iter().take(8) {
                    if smooth(first, second) {
                        for end in ends {
                            let corner = |triangle: u32, side: u8| {
                                let start = 3 * triangle as usize + usize::from(side);
                                let next = 3 * triangle as usize + (usize::from(side) + 1) % 3;
                                if vertex[start] == end { start } else { next }
                            };
                            groups.join(corner(first, first_side), corner(second, second_side));
                        }
                    }
                }
            }
        }
        let corners = 0..3 * triangles.len();
        Self {
            shared: corners.clone().map(|corner| groups.root(corner) as u32).collect(),
            angle: corners.map(|corner| corner_angle(triangles[corner / 3], corner % 3)).collect(),
            patch,
            starts,
        }
    }

    /// The normal at each corner of each piece, where `normal` has that of each piece: of those that share a value, the mean
    /// by their angles.
    pub(super) fn normals(&self, normal: &[DVec3]) -> Vec<[DVec3; 3]> {
        let mut sums = vec![DVec3::ZERO; self.shared.len()];
        for (corner, (&shared, &angle)) in self.shared.iter().zip(&self.angle).enumerate() {
            sums[shared as usize] += normal[corner / 3] * angle;
        }
        let at =
            |corner: usize| sums[self.shared[corner] as usize].try_normalize().unwrap_or(normal[corner / 3]);
        (0..self.patch.len()).map(|piece| std::array::from_fn(|k| at(3 * piece + k))).collect()
    }

    /// The pieces, by number, of a surface; none where it is in none.
    pub fn of_surface(&self, surface: u32) -> std::ops::Range<usize> {
        self.starts[surface as usize] as usize..self.starts[surface as usize + 1] as usize
    }

    /// For each corner of a piece, the one that stands for all that share its value.
    pub(super) fn shared(&self, piece: usize) -> [u32; 3] {
        std::array::from_fn(|k| self.shared[3 * piece + k])
    }

    /// A value at each corner of each piece, from one value a patch.
    pub fn values(&self, values: &[Rgb]) -> Vec<[Rgb; 3]> {
        // The mean of each group, in the order of the pieces: of how they differ from the first, so that the mean of equal
        // values is that value to the bit.
        let mut sums = vec![(Rgb::BLACK, 0.0_f64, Rgb::BLACK); self.shared.len()];
        for (corner, (&shared, &angle)) in self.shared.iter().zip(&self.angle).enumerate() {
            let (value, sum) = (values[self.patch[corner / 3] as usize], &mut sums[shared as usize]);
            if sum.1 == 0.0 {
                sum.2 = value;
            }
            sum.0 += (value - sum.2) * angle;
            sum.1 += angle;
        }
        let at = |corner: usize| {
            let (sum, weight, first) = sums[self.shared[corner] as usize];
            if weight > 0.0 { first + sum * (1.0 / weight) } else { values[self.patch[corner / 3] as usize] }
        };
        (0..self.patch.len()).map(|piece| std::array::from_fn(|k| at(3 * piece + k))).collect()
    }
}

/// For each corner of each triangle, the first one at the same position.
pub(super) fn merged_vertices(triangles: &[[DVec3; 3]]) -> Vec<u32> {
    // Adding zero makes -0 and 0 the same position.
    let key = |corner: u32| {
        let corner = corner as usize;
        (triangles[corner / 3][corner % 3] + DVec3::ZERO).to_array().map(f64::to_bits)
    };
    let mut order: Vec<u32> = (0..3 * triangles.len() as u32).collect();
    order.sort_unstable_by_key(|&corner| (key(corner), corner));
    let mut merged = vec![0; order.len()];
    for same in order.chunk_by(|&one, &other| key(one) == key(other)) {
        for &corner in same {
            merged[corner as usize] = same[0];
        }
    }
    merged
}

fn normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a).normalize_or_zero()
}

/// The angle of a triangle at a corner, 0 where it has none. \[radians\]
fn corner_angle(triangle: [DVec3; 3], k: usize) -> f64 {
    let [here, next, last] = [0, 1, 2].map(|step| triangle[(k + step) % 3]);
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
    use crate::patches::subdivide;
    use crate::scene::{BackFaces, Material, Mesh, Place, Polygon, Shape, Surface};

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
        corner_values_of(&[(Shape::Mesh(mesh.clone()), 0.5)], values)
    }

    /// Of shapes with their reflectances.
    fn corner_values_of(shapes: &[(Shape, f64)], values: &[Rgb]) -> Vec<[Rgb; 3]> {
        let surface = |(shape, grey): &(Shape, f64)| Surface {
            name: String::new(),
            shape: shape.clone(),
            material: Material { diffuse: Rgb::grey(*grey), ..Material::default() },
            place: Place::default(),
        };
        let scene = Scene {
            name: "test".into(),
            surfaces: shapes.iter().map(surface).collect(),
            camera: None,
            back_faces: BackFaces::Lit,
            warnings: Vec::new(),
        };
        let patches = subdivide(&scene, 1.0).unwrap();
        assert_eq!(patches.len(), values.len());
        PieceCorners::new(&scene, &patches).values(values)
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
    fn two_surfaces_of_one_colour_are_as_smooth_as_one() {
        let of_fold = |degrees: f64, greys: [f64; 2]| {
            let mesh = fold(degrees);
            let shape = |k: usize| {
                let vertices = mesh.triangles[k].map(|at| mesh.vertices[at as usize]).to_vec();
                (Shape::Polygon(Polygon { vertices }), greys[k])
            };
            corner_values_of(&[shape(0), shape(1)], &VALUES)
        };
        let smooth = of_fold(39.0, [0.5, 0.5]);
        assert_eq!(smooth[0][0], smooth[1][1]);
        assert!((smooth[0][0].r - 2.0).abs() < 1e-12 && smooth[0][2] == VALUES[0]);
        assert_eq!(of_fold(41.0, [0.5, 0.5]), VALUES.map(|value| [value; 3]));
        assert_eq!(of_fold(0.0, [0.5, 0.6]), VALUES.map(|value| [value; 3]));
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
