//! Step 3: the radiosities, by whatever solver is asked.

use super::{BakeError, Request, Solver};
use crate::form_factors::Passes;
use crate::light::Rgb;
use crate::patches::Patches;
use crate::solve::{self, Solution, SolveError};
use crate::watch::Watch;

/// Step 3: the radiosities.
///
/// # Errors
/// [`BakeError::Solve`], [`BakeError::Interrupted`], or [`BakeError::BadRequest`] for an epsilon that is not positive.
pub fn solve(
    patches: &Patches,
    rows: &impl Passes,
    request: &Request,
    watch: &mut Watch<'_>,
) -> Result<Solution, BakeError> {
    solve_from(patches, rows, None, request, watch)
}

/// The same from an earlier answer, where there is one and the solver is one that can begin with it: Gauss-Seidel.
///
/// # Errors
/// As of [`solve()`].
pub fn solve_from(
    patches: &Patches,
    rows: &impl Passes,
    start: Option<Vec<Rgb>>,
    request: &Request,
    watch: &mut Watch<'_>,
) -> Result<Solution, BakeError> {
    if !(request.epsilon > 0.0 && request.epsilon.is_finite()) {
        return Err(BakeError::BadRequest("epsilon must be a positive number, and not infinite".into()));
    }
    let solver = |patches: &Patches, watch: &mut Watch<'_>| {
        let solution = match request.solver {
            Solver::GaussSeidel => {
                let start = start.unwrap_or_else(|| patches.emission.clone());
                solve::gauss_seidel_from(patches, rows, start, request.epsilon, watch)
            }
            Solver::Progressive => solve::progressive(patches, rows, request.epsilon, watch),
            Solver::ConjugateGradients => solve::conjugate_gradients(patches, rows, request.epsilon, watch),
            Solver::Jacobi => solve::jacobi(patches, rows, request.epsilon, watch),
        };
        solution.map_err(|error| match error {
            SolveError::Interrupted(interrupted) => interrupted.into(),
            other => BakeError::Solve(other),
        })
    };
    if request.surroundings.is_black() {
        return solver(patches, watch);
    }
    // What the surroundings send is reflected as if it were emitted: to the solver it is.
    let mut arriving = Vec::with_capacity(patches.len());
    rows.pass(watch, |_, row| arriving.push(request.surroundings * row.elsewhere().surroundings))?;
    let mut lit = patches.clone();
    for (i, &light) in arriving.iter().enumerate() {
        lit.emission[i] += patches.reflectance[i] * light;
    }
    let mut solution = solver(&lit, watch)?;
    for (irradiance, light) in solution.irradiance.iter_mut().zip(arriving) {
        *irradiance += light;
    }
    Ok(solution)
}
