//! Solvers of B_i = E_i + ρ_i Σ_j F_ij B_j, a file each.

mod conjugate_gradients;
mod convergence;
mod gauss_seidel;
mod jacobi;
mod progressive;

pub use conjugate_gradients::{ConjugateGradients, conjugate_gradients};
pub use gauss_seidel::{DEFAULT_EPSILON, GaussSeidel, gauss_seidel, gauss_seidel_from};
pub use jacobi::{Jacobi, jacobi};
pub use progressive::{Progressive, progressive};

use crate::form_factors::{LightBlocks, Passes};
use crate::light::Rgb;
use crate::patches::Patches;
use crate::watch::{Interrupted, Watch};

/// The answer.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Solution {
    /// Radiosity B a patch: all that leaves it, power per area, in the unit of the scene's emissions.
    pub radiosity: Vec<Rgb>,
    /// Irradiance H a patch: all that arrives at it, in the same unit.
    pub irradiance: Vec<Rgb>,
    /// Steps made: sweeps of Gauss-Seidel, shots of progressive refinement, passes over the rows otherwise.
    pub iterations: usize,
    /// What the stopping test measured, sweep by sweep (shooting: every as many shots as there are patches); the
    /// last one is at most epsilon, or where rounding lets it come no lower.
    pub history: Vec<f64>,
}

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// The caller said stop.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    /// More light comes back than was sent: no finite radiosity satisfies the equation, or none that can be reached.
    #[error(
        "the solution does not converge: after {iterations} iterations the residual is {residual:.3e} and no longer \
         shrinks. The scene reflects more than it receives: make every reflectance (CD, GD) less than 1; the \
         largest here is {max_reflectance}"
    )]
    Diverges {
        /// Sweeps or shots made.
        iterations: usize,
        /// The last residual.
        residual: f64,
        /// The largest reflectance of any patch and channel.
        max_reflectance: f64,
    },
}

impl SolveError {
    fn diverges(patches: &Patches, iterations: usize, residual: f64) -> Self {
        let max_reflectance = patches.reflectance.iter().map(|r| r.max_channel()).fold(0.0, f64::max);
        Self::Diverges { iterations, residual, max_reflectance }
    }
}

/// The answer of a solver that gathers along rows, with the irradiance that it brings, H_i = Σ_j F_ij B_j; `blocks` is
/// its radiosity as rows read it.
fn gathered(
    rows: &impl Passes,
    radiosity: Vec<Rgb>,
    blocks: &LightBlocks,
    history: Vec<f64>,
    watch: &mut Watch<'_>,
) -> Result<Solution, Interrupted> {
    let irradiance = rows.gather(watch, blocks)?;
    Ok(Solution { radiosity, irradiance, iterations: history.len(), history })
}
