//! Step 3 continued, where [`Request::correct`] asks for it: the light that patches hide which send it evenly is found, and
//! sent after.

use super::hidden::Lit;
use super::{BakeError, Request, Run, solve};
use crate::estimate::Places;
use crate::form_factors::Passes;
use crate::light::Rgb;
use crate::patches::Patches;
use crate::scene::Scene;
use crate::solve::Solution;
use crate::visibility::Facets;
use crate::watch::{Progress, Watch};

/// What a correction did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Correction {
    /// By how much it moved the answer: sqrt(Σ A |ΔB|² / Σ A |B|²) over patches that emit nothing, r, g and b together.
    pub change: f64,
    /// The solver's steps for it; [`Solution::iterations`] counts them, too.
    pub iterations: usize,
}

/// Of the hemicubes that look out from eight places on each patch. Finer ones cost time, and bring nothing that can be
/// measured (`docs/correction.md`).
const PRECISION: u32 = 24;

/// The answer, and, where [`Request::correct`] asks for it, what it lacks because patches send light as if they were equally
/// bright all over: the irradiance c that eight places within each patch know to be missing
/// ([`Hidden`](crate::estimate::Hidden)) is reflected, ΔB = ρ c + ρ F ΔB, and added. In a closed scene it moves light and
/// neither makes nor takes any. H has c in it, so that B = E + ρ H still, and the history is that of the answer it began with.
///
/// # Errors
/// As of [`solve()`]; [`BakeError::BadRequest`] where the form factors are a hemicube's, which have errors as large of another kind.
#[expect(clippy::too_many_arguments, reason = "every stage's value, what is asked and how it is run")]
pub fn corrected(
    scene: &Scene,
    patches: &Patches,
    facets: &Facets,
    rows: &impl Passes,
    solution: Solution,
    request: &Request,
    run: &Run,
    watch: &mut Watch<'_>,
) -> Result<(Solution, Option<Correction>), BakeError> {
    if !request.correct {
        return Ok((solution, None));
    }
    check(request)?;
    let lit = Lit::new(scene, facets, &solution.radiosity, request, run);
    let places = Places::eight(patches);
    let (mut done, total) = (0, places.count() * patches.len());
    let mut step = || {
        done += 1;
        watch(&Progress::Looks { done, total })
    };
    let missing = lit.hidden(&places, PRECISION, &mut step)?;

    // To a solver it is what patches emit, and what they do not where it is negative.
    let mut sources = patches.clone();
    for (i, &missing) in missing.iter().enumerate() {
        sources.emission[i] = patches.reflectance[i] * missing;
    }
    let within = Request { surroundings: Rgb::BLACK, ..*request };
    let more = solve(&sources, rows, &within, watch)?;

    let Solution { mut radiosity, mut irradiance, iterations, history } = solution;
    let (mut moved, mut all) = (0.0, 0.0);
    for i in 0..patches.len() {
        let arrives = irradiance[i] + missing[i] + more.irradiance[i];
        // No light is less than none.
        irradiance[i] = Rgb::new(arrives.r.max(0.0), arrives.g.max(0.0), arrives.b.max(0.0));
        let leaves = patches.emission[i] + patches.reflectance[i] * irradiance[i];
        if patches.emission[i].is_black() {
            moved += patches.area[i] * (leaves - radiosity[i]).norm_squared();
            all += patches.area[i] * leaves.norm_squared();
        }
        radiosity[i] = leaves;
    }
    let change = if all > 0.0 { (moved / all).sqrt() } else { 0.0 };
    let correction = Correction { change, iterations: more.iterations };
    let iterations = iterations + more.iterations;
    Ok((Solution { radiosity, irradiance, iterations, history }, Some(correction)))
}

/// Refuse to correct what cannot be.
pub(super) fn check(request: &Request) -> Result<(), BakeError> {
    if request.correct && !request.method.from_patch_to_patch() {
        return Err(BakeError::BadRequest(
            "what patches hide that send light evenly is less than what a hemicube at their centre mistakes: to correct \
             the answer (--correct) use --method exact or hemicube-exact"
                .into(),
        ));
    }
    Ok(())
}
