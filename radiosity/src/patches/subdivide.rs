//! From surfaces to patches.

use super::cut::{Lie, Plan, cut};
use super::{Block, MOST_PATCHES, Patches, SubdivideError, Subdivision};
use crate::scene::{Scene, Shape};

/// Bytes that [`Patches`] keep a patch, where it is a cell of a parallelogram; in pieces it takes up to twice as many.
pub const BYTES_PER_PATCH: u64 = 4 * 24 + 8 + 2 * 24 + 4;

/// What becomes of each surface.
fn plans(scene: &Scene, subdivision: Subdivision) -> Result<Vec<Plan>, SubdivideError> {
    let positive = |number: f64| number.is_finite() && number > 0.0;
    let planned = |plan: &dyn Fn(&Shape) -> Plan| {
        Ok(scene.surfaces.iter().map(|surface| plan(&surface.shape)).collect())
    };
    match subdivision {
        Subdivision::Factor(factor) if positive(factor) => planned(&|shape| Plan::by_factor(shape, factor)),
        Subdivision::Factor(_) => Err(SubdivideError::BadFactor),
        Subdivision::PatchSize(size) if positive(size) => planned(&|shape| Plan::by_size(shape, size)),
        Subdivision::PatchSize(_) => Err(SubdivideError::BadSize),
        Subdivision::Patches(_) => plans(scene, subdivision.for_scene(scene)?),
    }
}

/// How many patches [`subdivide`] would make, saturating; where they are too many to be solved for, perhaps a lower bound.
///
/// # Errors
/// [`SubdivideError`], but never that they are too many.
pub fn count(scene: &Scene, subdivision: impl Into<Subdivision>) -> Result<u64, SubdivideError> {
    let plans = plans(scene, subdivision.into())?;
    Ok(plans.iter().map(|plan| plan.count()).fold(0, u64::saturating_add))
}

/// Cut every surface of `scene` into patches.
///
/// By a factor ([`Subdivision::Factor`], or just a number) each n and m is multiplied by it; polygons are one patch,
/// meshes one a triangle, whatever the factor. By size, polygons and triangles are cut too: quadrilaterals into a grid,
/// others into triangles that meet corner to corner.
///
/// Step 1 of the assignment, `DeterminerPieces`.
///
/// # Errors
/// [`SubdivideError`].
pub fn subdivide(scene: &Scene, subdivision: impl Into<Subdivision>) -> Result<Patches, SubdivideError> {
    let plans = plans(scene, subdivision.into())?;
    let total = plans.iter().map(|plan| plan.count()).fold(0, u64::saturating_add);
    if total > MOST_PATCHES {
        return Err(SubdivideError::TooMany { patches: total });
    }
    let mut patches = Patches::default();
    for (index, (surface, &plan)) in scene.surfaces.iter().zip(&plans).enumerate() {
        let first = patches.len() as u32;
        let pieces = cut(&surface.shape, plan, first, |Lie { centre, normal, tangents, area, triangle }| {
            let (emission, reflectance) = surface.coefficients(triangle);
            patches.centre.push(centre);
            patches.normal.push(normal);
            patches.tangent_u.push(tangents[0]);
            patches.tangent_v.push(tangents[1]);
            patches.area.push(area);
            patches.emission.push(emission);
            patches.reflectance.push(reflectance);
            patches.surface.push(index as u32);
        });
        let (columns, rows) = match plan {
            Plan::Grid(columns, rows) => (columns as u32, rows as u32),
            Plan::Whole(_) | Plan::Triangles(..) | Plan::Filled(..) => (patches.len() as u32 - first, 1),
        };
        patches.blocks.push(Block { first, columns, rows });
        patches.pieces.push(pieces);
    }
    Ok(patches)
}
