//! From surfaces to patches: every parallelogram's own n x m, times a factor.

use glam::DVec3;

use super::{Block, Patches};
use crate::geometry::polygon;
use crate::scene::{Scene, Shape, Surface};

/// Bytes that [`Patches`] keep a patch.
pub const BYTES_PER_PATCH: u64 = 4 * 24 + 8 + 2 * 24 + 4;

/// Why a scene cannot be cut into patches.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SubdivideError {
    /// More patches than can be numbered.
    #[error(
        "{patches} patches are more than the {} that can be numbered; use a smaller subdivision factor",
        u32::MAX
    )]
    TooMany {
        /// How many it would be.
        patches: u64,
    },
    /// The factor is no positive number.
    #[error("the subdivision factor must be a positive number, and not infinite")]
    BadFactor,
}

/// n or m times the factor, to the nearest whole number, at least 1.
fn scaled(cells: u32, factor: f64) -> u64 {
    ((f64::from(cells) * factor).round() as u64).max(1)
}

/// Columns and rows of a surface's block of patches.
fn grid(surface: &Surface, factor: f64) -> (u64, u64) {
    match &surface.shape {
        Shape::Parallelogram(p) => (scaled(p.columns, factor), scaled(p.rows, factor)),
        Shape::Polygon(_) => (1, 1),
        Shape::Mesh(m) => (m.triangles.len() as u64, 1),
    }
}

/// How many patches [`subdivide`] would make, saturating; it allocates nothing.
///
/// # Errors
/// [`SubdivideError::BadFactor`].
pub fn count(scene: &Scene, factor: f64) -> Result<u64, SubdivideError> {
    if !(factor.is_finite() && factor > 0.0) {
        return Err(SubdivideError::BadFactor);
    }
    Ok(scene.surfaces.iter().fold(0, |sum: u64, surface| {
        let (columns, rows) = grid(surface, factor);
        sum.saturating_add(columns.saturating_mul(rows))
    }))
}

/// Cut every surface of `scene` into patches. A parallelogram's n and m are each multiplied by `factor`;
/// polygons are one patch, meshes one a triangle, whatever the factor.
///
/// Step 1 of the assignment, `DeterminerPieces`.
///
/// # Errors
/// [`SubdivideError`].
pub fn subdivide(scene: &Scene, factor: f64) -> Result<Patches, SubdivideError> {
    let total = count(scene, factor)?;
    if total >= u64::from(u32::MAX) {
        return Err(SubdivideError::TooMany { patches: total });
    }
    let mut patches = Patches::default();
    for (index, surface) in scene.surfaces.iter().enumerate() {
        let (columns, rows) = grid(surface, factor);
        let (columns, rows) = (columns as u32, rows as u32);
        patches.blocks.push(Block { first: patches.len() as u32, columns, rows });
        let mut push = |centre: DVec3, normal, tangents: [DVec3; 2], area, triangle| {
            let (emission, reflectance) = surface.coefficients(triangle);
            patches.centre.push(centre);
            patches.normal.push(normal);
            patches.tangent_u.push(tangents[0]);
            patches.tangent_v.push(tangents[1]);
            patches.area.push(area);
            patches.emission.push(emission);
            patches.reflectance.push(reflectance);
            patches.surface.push(index as u32);
        };
        match &surface.shape {
            Shape::Parallelogram(p) => {
                let (du, dv) = (p.u / f64::from(columns), p.v / f64::from(rows));
                let area = du.cross(dv).length();
                for row in 0..rows {
                    for column in 0..columns {
                        let s = (f64::from(column) + 0.5) / f64::from(columns);
                        let t = (f64::from(row) + 0.5) / f64::from(rows);
                        push(p.origin + p.u * s + p.v * t, p.normal, [du, dv], area, 0);
                    }
                }
            }
            Shape::Polygon(p) => {
                let area_vector = polygon::area_vector(&p.vertices);
                let normal = area_vector.normalize_or_zero();
                let tangent = p.vertices[1] - p.vertices[0];
                push(
                    polygon::inner_point(&p.vertices),
                    normal,
                    [tangent, normal.cross(tangent)],
                    area_vector.length(),
                    0,
                );
            }
            Shape::Mesh(m) => {
                for (index, triangle) in m.triangles.iter().enumerate() {
                    let [a, b, c] = triangle.map(|k| m.vertices[k as usize]);
                    let area_vector = (b - a).cross(c - a) * 0.5;
                    push(
                        (a + b + c) / 3.0,
                        area_vector.normalize_or_zero(),
                        [b - a, c - a],
                        area_vector.length(),
                        index,
                    );
                }
            }
        }
    }
    Ok(patches)
}
