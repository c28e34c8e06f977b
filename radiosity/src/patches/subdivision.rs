//! How finely a scene is to be cut, and what cannot be cut so.

use super::subdivide::count;
use crate::scene::Scene;

/// How finely surfaces are cut into patches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Subdivision {
    /// As their author wrote: every n and m times this. Polygons and the triangles of meshes are one patch each, those of
    /// fractals the square of it, rounded.
    Factor(f64),
    /// No edge of a patch longer than this, whatever the author wrote. \[the scene's unit of length\]
    PatchSize(f64),
    /// About so many patches in all, of one size; never more by over 2 %.
    Patches(u64),
}

impl Default for Subdivision {
    /// What the author wrote.
    fn default() -> Self {
        Self::Factor(1.0)
    }
}

impl From<f64> for Subdivision {
    fn from(factor: f64) -> Self {
        Self::Factor(factor)
    }
}

/// Why a scene cannot be cut into patches.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SubdivideError {
    /// More patches than can be numbered.
    #[error(
        "{patches} patches are more than the {} that can be numbered; use a smaller subdivision factor, or larger \
         patches",
        u32::MAX
    )]
    TooMany {
        /// How many it would be, or more.
        patches: u64,
    },
    /// The factor is no positive number.
    #[error("the subdivision factor must be a positive number, and not infinite")]
    BadFactor,
    /// The size is no positive number.
    #[error("the size of patches must be a positive number, and not infinite")]
    BadSize,
    /// Fewer patches than there are pieces to make patches of.
    #[error(
        "the scene cannot be cut into as few as {asked} patches: it takes at least {least}; ask for so many or more"
    )]
    TooFew {
        /// How many were asked for.
        asked: u64,
        /// How many it takes.
        least: u64,
    },
}

/// What more than asked for still counts as about so many.
const OVER: f64 = 1.02;
/// Larger than any surface.
const LARGEST: f64 = 1e17;
/// Halvings of the span from a size that is too small to its double, in which the best one lies.
const HALVINGS: u32 = 32;

/// The patch size by which `scene` is cut into as near to `patches` as may be, and never 2 % more.
///
/// # Errors
/// [`SubdivideError::TooFew`] where even the coarsest cut has more.
pub fn patch_size(scene: &Scene, patches: u64) -> Result<f64, SubdivideError> {
    let most = (patches as f64 * OVER) as u64;
    let made = |size: f64| count(scene, Subdivision::PatchSize(size));
    let least = made(LARGEST)?;
    if least > most {
        return Err(SubdivideError::TooFew { asked: patches, least });
    }
    let mut best = (least, LARGEST);
    // Of what was met, the nearest is kept: the count need not fall with every growth of the size.
    let mut fits = |size: f64| {
        let count = made(size)?;
        if count <= most && count.abs_diff(patches) < best.0.abs_diff(patches) {
            best = (count, size);
        }
        Ok(count <= most)
    };
    // What a scene's unit of length is nobody knows; and to come from far below would make many to be counted.
    let mut coarse = LARGEST;
    while fits(coarse * 0.5)? {
        coarse *= 0.5;
    }
    let mut fine = coarse * 0.5;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (fine + coarse);
        if fits(middle)? {
            coarse = middle;
        } else {
            fine = middle;
        }
    }
    Ok(best.1)
}
