//! How finely a scene is to be cut, and what cannot be cut so.

use glam::DVec3;

use super::subdivide::count;
use crate::scene::Scene;

/// The most patches that can be numbered: whoever draws them keeps two bits of the number for himself, and two numbers for
/// what is no patch.
pub const MOST_PATCHES: u64 = (1 << 30) - 2;

/// The most often that patches are quartered towards where surfaces meet.
pub const MOST_GRADING: u32 = 6;

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

/// All that is asked of the patches: how fine, and what of surfaces that meet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cutting {
    /// How finely surfaces are cut.
    pub subdivision: Subdivision,
    /// Whether patches are parted where another surface crosses theirs or stands on it. Without, one that a wall stands on
    /// has one light for both sides of the wall.
    pub split: bool,
    /// Where they are split, how often patches are quartered towards where another surface stands: 0 to [`MOST_GRADING`].
    /// Each is about twice as long as the next nearer one.
    pub grading: u32,
}

/// Sizes that are tried until the parts of split patches are allowed for.
const TRIALS: u32 = 12;
/// So many times what was tried last is as coarse as it gets.
const COARSEST: f64 = 1e3;

impl Cutting {
    /// The same, but a number of patches as the size that gives it in `scene`: to be found once, where it is used again.
    ///
    /// # Errors
    /// [`SubdivideError::TooFew`].
    pub fn for_scene(self, scene: &Scene) -> Result<Self, SubdivideError> {
        let subdivision = self.subdivision.for_scene(scene)?;
        let (Subdivision::Patches(wanted), Subdivision::PatchSize(mut size)) =
            (self.subdivision, subdivision)
        else {
            return Ok(Self { subdivision, ..self });
        };
        if !self.split {
            return Ok(Self { subdivision, ..self });
        }
        let most = (wanted as f64 * OVER) as u64;
        let made = |size: f64| count(scene, Self { subdivision: Subdivision::PatchSize(size), ..self });
        let (mut best, mut too_fine, mut fits) = (None::<(u64, f64)>, None, None);
        for _ in 0..TRIALS {
            let count = made(size)?;
            if count <= most {
                fits = Some(size);
                if best.is_none_or(|(best, _)| count.abs_diff(wanted) < best.abs_diff(wanted)) {
                    best = Some((count, size));
                }
            } else {
                too_fine = Some(size);
            }
            if best.is_some_and(|(best, _)| best as f64 >= NEAR * wanted as f64) {
                break;
            }
            let by_count = size * (count as f64 / wanted as f64).sqrt();
            size = match (too_fine, fits) {
                (Some(fine), Some(coarse)) => 0.5 * (fine + coarse),
                (Some(_), None) => by_count.max(1.1 * size),
                (None, _) => by_count,
            };
        }
        let size = match best {
            Some((_, size)) => size,
            None => {
                let coarsest = size * COARSEST;
                let least = made(coarsest)?;
                if least > most {
                    return Err(SubdivideError::TooFew { asked: wanted, least });
                }
                coarsest
            }
        };
        Ok(Self { subdivision: Subdivision::PatchSize(size), ..self })
    }
}

impl<S: Into<Subdivision>> From<S> for Cutting {
    /// Patches as they are asked for, and not split.
    fn from(subdivision: S) -> Self {
        Self { subdivision: subdivision.into(), ..Self::default() }
    }
}

/// Why a scene cannot be cut into patches.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SubdivideError {
    /// More patches than can be numbered.
    #[error(
        "{patches} patches are more than the {MOST_PATCHES} that can be numbered; use a smaller subdivision factor, or \
         larger patches"
    )]
    TooMany {
        /// How many it would be, or more.
        patches: u64,
    },
    /// The factor is no positive number.
    #[error("the subdivision factor must be a positive number, and not infinite")]
    BadFactor,
    /// Patches quartered too often.
    #[error("patches can be graded by at most {MOST_GRADING} halvings")]
    BadGrading,
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
/// What is so near to what was asked for is not improved upon.
const NEAR: f64 = 0.995;
/// Halvings of the span from a size that is too small to its double, in which the best one lies.
const HALVINGS: u32 = 24;

impl Subdivision {
    /// The same with edges of patches longer by 1 / `share`, as far as it is for the subdivision to say.
    pub fn coarser(self, share: f64) -> Self {
        match self {
            Self::Factor(factor) => Self::Factor(factor * share),
            Self::PatchSize(size) => Self::PatchSize(size / share),
            Self::Patches(patches) => Self::Patches((patches as f64 * share * share) as u64),
        }
    }

    /// The same, but a number of patches as the size that gives it in `scene`: to be found once, where it is used again.
    ///
    /// # Errors
    /// [`SubdivideError::TooFew`].
    pub fn for_scene(self, scene: &Scene) -> Result<Self, SubdivideError> {
        match self {
            Self::Patches(patches) => Ok(Self::PatchSize(patch_size(scene, patches)?)),
            other => Ok(other),
        }
    }
}

/// The patch size by which `scene` is cut into as near to `patches` as may be, and never 2 % more.
///
/// # Errors
/// [`SubdivideError::TooFew`] where even the coarsest cut has more.
fn patch_size(scene: &Scene, patches: u64) -> Result<f64, SubdivideError> {
    let most = (patches as f64 * OVER) as u64;
    let made = |size: f64| count(scene, Subdivision::PatchSize(size));
    // Nothing in a scene is longer than twice the box about it.
    let vertices = scene.surfaces.iter().flat_map(|surface| surface.shape.vertices());
    let (low, high) =
        vertices.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let largest = 2.0 * (high - low).length();
    let least = made(largest)?;
    if least > most {
        return Err(SubdivideError::TooFew { asked: patches, least });
    }
    let mut best = (least, largest);
    // Of what was met, the nearest is kept: the count need not fall with every growth of the size.
    let mut fits = |size: f64| {
        let count = made(size)?;
        if count <= most && count.abs_diff(patches) < best.0.abs_diff(patches) {
            best = (count, size);
        }
        Ok((count <= most, best.0 as f64 >= NEAR * patches as f64))
    };
    // From coarse to fine, and no finer than is needed: what is far too fine takes long to be counted.
    let mut coarse = largest;
    while fits(coarse * 0.5)?.0 {
        coarse *= 0.5;
    }
    let mut fine = coarse * 0.5;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (fine + coarse);
        match fits(middle)? {
            (_, true) => break,
            (true, false) => coarse = middle,
            (false, false) => fine = middle,
        }
    }
    Ok(best.1)
}
