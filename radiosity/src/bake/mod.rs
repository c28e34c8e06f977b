//! The recipe end to end: the only module that knows every stage.

mod correction;
mod error;
mod hidden;
mod memory;
mod request;
mod rows;
mod solution;

pub use correction::{Correction, corrected};
pub use error::error;
pub use memory::{Need, allow, foretell, machine_memory, memory_limit, need};
pub use request::{Method, Request, Run, Solver};
pub use rows::{
    FoundRows, Recomputed, RowFinder, Rows, Scratch, form_factors, repaired, repaired_rows, row_finder, rows,
};
pub use solution::{solve, solve_from};

use crate::estimate::ErrorEstimate;
use crate::form_factors::{Closing, FormFactors};
use crate::patches::{self, Origin, Patches, Refinement, SubdivideError};
use crate::scene::Scene;
use crate::solve::{Solution, SolveError};
use crate::visibility::Facets;
use crate::watch::{Interrupted, Watch};
use memory::allow_patches;

/// Every stage's value.
#[derive(Clone, Debug)]
pub struct Baked {
    /// The patches.
    pub patches: Patches,
    /// What visibility was asked of: pictures ask it again.
    pub facets: Facets,
    /// Their form factors; none where they did not fit into memory, and were found anew for every step of the solver.
    pub form_factors: FormFactors,
    /// Where they did not: what they would have taken.
    pub recomputed: Option<Recomputed>,
    /// How closure was restored, where that was asked.
    pub closing: Option<Closing>,
    /// Their radiosities.
    pub solution: Solution,
    /// What was done about patches that send light evenly, where that was asked.
    pub correction: Option<Correction>,
    /// By how much those may be off, where that was asked.
    pub error: Option<ErrorEstimate>,
}

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BakeError {
    /// The scene cannot be cut into patches.
    #[error(transparent)]
    Subdivide(#[from] SubdivideError),
    /// The equation has no answer.
    #[error(transparent)]
    Solve(SolveError),
    /// The caller said stop.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    /// Something asked makes no sense; the message says what, and the cure.
    #[error("{0}")]
    BadRequest(String),
    /// It would take too much memory.
    #[error(
        "{patches} patches would need about {needed_gb:.1} GB, and the limit is {limit_gb:.1} GB: use a smaller \
         --subdivision or a larger --patch-size, or raise --memory-limit"
    )]
    Memory {
        /// How many patches.
        patches: u64,
        /// About how much it would take, in GB of 10⁹ bytes.
        needed_gb: f64,
        /// How much is allowed, likewise.
        limit_gb: f64,
    },
}

/// Step 1: the patches, refused where they alone would exceed the memory limit.
///
/// # Errors
/// [`BakeError::Subdivide`], [`BakeError::Memory`], or [`BakeError::BadRequest`] where there is none at all.
pub fn patches(scene: &Scene, request: &Request, run: &Run) -> Result<Patches, BakeError> {
    Ok(patches_with_origins(scene, request, run)?.0)
}

/// The same, with where each comes from.
pub(crate) fn patches_with_origins(
    scene: &Scene,
    request: &Request,
    run: &Run,
) -> Result<(Patches, Vec<Origin>), BakeError> {
    correction::check(request)?;
    let cutting = request.cutting().for_scene(scene)?;
    // Before they are made, and again with those that are split.
    allow_patches(scene, patches::count(scene, cutting.subdivision)?, run)?;
    if cutting.grading > 0 {
        allow_patches(scene, patches::count(scene, cutting)?, run)?;
    }
    let (patches, origins) = patches::refined(scene, cutting, &Refinement::default())?;
    allow_patches(scene, patches.len() as u64, run)?;
    Ok((patches, origins))
}

/// All of it.
///
/// # Errors
/// Those of each step.
pub fn bake(scene: &Scene, request: &Request, run: &Run, watch: &mut Watch<'_>) -> Result<Baked, BakeError> {
    let patches = patches(scene, request, run)?;
    let facets = Facets::new(scene, &patches);
    let mut rows = rows(scene, &patches, &facets, request, run, watch)?;
    let mut closing = None;
    if request.repair {
        let (repaired, closed) = repaired_rows(&patches, rows, run)?;
        (rows, closing) = (repaired, Some(closed));
    }
    let solution = solve(&patches, &rows, request, watch)?;
    let (solution, correction) = corrected(scene, &patches, &facets, &rows, solution, request, run, watch)?;
    let estimated =
        |watch: &mut Watch<'_>| error(scene, &patches, &facets, &rows, &solution, request, run, watch);
    let error = request.error.then(|| estimated(watch)).transpose()?;
    let recomputed = rows.recomputed();
    let form_factors = rows.into_form_factors();
    Ok(Baked { patches, facets, form_factors, recomputed, closing, solution, correction, error })
}
