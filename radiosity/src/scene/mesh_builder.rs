//! Meshes from modelling programs: vertices in one place become one, triangles that can carry no light are left out.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use glam::DVec3;

use super::{Material, Mesh, Paint};
use crate::light::Rgb;

/// What a surface reflects of whose material nobody told anything.
pub(super) const DEFAULT_REFLECTANCE: Rgb = Rgb::grey(0.5);

/// A triangle whose area is below this part of the square of its longest side has none: what rounding leaves of three
/// points in a line.
const NO_AREA: f64 = 1e-12;
/// Sides below this would underflow in products of areas.
const SMALLEST: f64 = 1e-15;

/// A mesh as it grows.
#[derive(Debug, Default)]
pub(super) struct MeshBuilder {
    mesh: Mesh,
    /// Each position that is there, to the bit, and its vertex.
    vertices: HashMap<[u64; 3], u32>,
    /// The triangles that are there, their least corner first.
    triangles: HashSet<[u32; 3]>,
}

impl MeshBuilder {
    /// The vertex at a position: the one that is there already, or a new one.
    fn vertex(&mut self, position: DVec3) -> u32 {
        // Adding zero makes -0 and 0 the same position.
        let position = position + DVec3::ZERO;
        *self.vertices.entry(position.to_array().map(f64::to_bits)).or_insert_with(|| {
            self.mesh.vertices.push(position);
            self.mesh.vertices.len() as u32 - 1
        })
    }

    /// Add a triangle, counter-clockwise seen from its front, unless it has no area or is there already. Whether it
    /// was added.
    pub(super) fn triangle(&mut self, corners: [DVec3; 3]) -> bool {
        if !has_area(corners) {
            self.mesh.left_out.flat += 1;
            return false;
        }
        let triangle = corners.map(|corner| self.vertex(corner));
        let least = (0..3).min_by_key(|&k| triangle[k]).unwrap_or(0);
        if !self.triangles.insert(std::array::from_fn(|k| triangle[(least + k) % 3])) {
            self.mesh.left_out.repeated += 1;
            return false;
        }
        self.mesh.triangles.push(triangle);
        true
    }

    /// The same, with coefficients of its own: diffuse reflectance and emission.
    pub(super) fn coloured_triangle(
        &mut self,
        corners: [DVec3; 3],
        [diffuse, emission]: [Option<Rgb>; 2],
    ) -> bool {
        let added = self.triangle(corners);
        if added {
            self.mesh.diffuse.extend(diffuse);
            self.mesh.emission.extend(emission);
        }
        added
    }

    /// Give the triangles what varies over them, reflectance and emission.
    pub(super) fn paint(&mut self, diffuse: Option<Paint>, emission: Option<Paint>) {
        let means = |paint: &Option<Paint>| paint.as_ref().map(Paint::means).unwrap_or_default();
        (self.mesh.diffuse, self.mesh.emission) = (means(&diffuse), means(&emission));
        (self.mesh.diffuse_paint, self.mesh.emission_paint) = (diffuse.map(Arc::new), emission.map(Arc::new));
    }

    /// How many triangles there are.
    pub(super) fn count(&self) -> usize {
        self.mesh.triangles.len()
    }

    /// What could not be made a triangle at all.
    pub(super) fn leave_out(&mut self) {
        self.mesh.left_out.flat += 1;
    }

    /// The mesh, and its material, which becomes the mean of what the triangles have of their own.
    pub(super) fn finish(self, material: Material) -> (Mesh, Material) {
        let mesh = self.mesh;
        let areas = || {
            mesh.triangles.iter().map(|triangle| {
                let [a, b, c] = triangle.map(|k| mesh.vertices[k as usize]);
                (b - a).cross(c - a).length()
            })
        };
        let total: f64 = areas().sum();
        let mean = |column: &[Rgb], all: Rgb| match column.is_empty() || total == 0.0 {
            true => all,
            false => column.iter().zip(areas()).map(|(&own, area)| own * (area / total)).sum(),
        };
        let material = Material {
            diffuse: mean(&mesh.diffuse, material.diffuse),
            emission: mean(&mesh.emission, material.emission),
            ..material
        };
        (mesh, material)
    }
}

/// Whether three points span an area that can be computed with.
fn has_area([a, b, c]: [DVec3; 3]) -> bool {
    let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    (b - a).cross(c - a).length() > NO_AREA * longest && longest >= SMALLEST * SMALLEST
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_in_one_place_are_one_and_useless_triangles_none() {
        let mut builder = MeshBuilder::default();
        let [a, b, c, d] = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
        assert!(builder.triangle([a, b, c]));
        assert!(builder.triangle([-a, c, d]));
        assert!(!builder.triangle([b, c, a]), "the first again, from another corner");
        assert!(builder.triangle([a, c, b]), "its back is another");
        assert!(!builder.triangle([a, b, b]));
        assert!(!builder.triangle([a, b, b * 0.3]));
        let (mesh, _) = builder.finish(Material::default());
        assert_eq!(mesh.vertices, [a, b, c, d]);
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 2, 1]]);
        assert_eq!((mesh.left_out.flat, mesh.left_out.repeated), (2, 1));
    }

    #[test]
    fn the_material_is_the_mean_by_area() {
        let mut builder = MeshBuilder::default();
        let small = [DVec3::ZERO, DVec3::X, DVec3::Y];
        builder.coloured_triangle(small, [Some(Rgb::grey(0.9)), None]);
        builder.coloured_triangle(small.map(|p| p * 3.0 + DVec3::Z), [Some(Rgb::grey(0.1)), None]);
        let lamp = Material { emission: Rgb::grey(7.0), ..Material::default() };
        let (mesh, material) = builder.finish(lamp);
        assert_eq!(mesh.diffuse.len(), 2);
        assert!(mesh.emission.is_empty());
        assert!((material.diffuse.r - 0.18).abs() < 1e-12, "{material:?}");
        assert_eq!(material.emission, lamp.emission);
    }
}
