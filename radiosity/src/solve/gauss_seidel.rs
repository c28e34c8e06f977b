//! Gauss-Seidel: each patch in turn gathers from the newest radiosities of all others.

use super::{Solution, SolveError, convergence};
use crate::form_factors::{FormFactors, LightBlocks, Passes};
use crate::light::Rgb;
use crate::patches::Patches;
use crate::watch::{Interrupted, Progress, Watch, ignore, tell};

/// The assignment's `EPS_B`.
pub const DEFAULT_EPSILON: f64 = 1e-6;

/// The state between two sweeps.
#[derive(Clone, Debug)]
pub struct GaussSeidel<'a, R = FormFactors> {
    patches: &'a Patches,
    rows: &'a R,
    radiosity: Vec<Rgb>,
    /// The same, as rows read it.
    blocks: LightBlocks,
    history: Vec<f64>,
}

impl<'a, R: Passes> GaussSeidel<'a, R> {
    /// Start from B = E, as the assignment does.
    pub fn new(patches: &'a Patches, rows: &'a R) -> Self {
        Self::from(patches, rows, patches.emission.clone())
    }

    /// Start from an earlier answer.
    pub fn from(patches: &'a Patches, rows: &'a R, radiosity: Vec<Rgb>) -> Self {
        let blocks = radiosity.iter().copied().collect();
        Self { patches, rows, radiosity, blocks, history: Vec::new() }
    }

    /// One sweep over all patches, in order: B_i = E_i + ρ_i Σ_j F_ij B_j with the B_j of this sweep where j
    /// has had its turn. Returns how far the answer moved, sqrt(Σ_i |B_i - Bold_i|²) over all three channels.
    ///
    /// # Errors
    /// [`Interrupted`] where `watch`, told of rows that are found for this sweep, says stop; the sweep is then half done.
    pub fn step_watched(&mut self, watch: &mut Watch<'_>) -> Result<f64, Interrupted> {
        let mut moved = 0.0;
        self.rows.pass(watch, |i, row| {
            let irradiance = row.gather_blocks(&self.blocks);
            let new = self.patches.emission[i] + self.patches.reflectance[i] * irradiance;
            moved += (new - self.radiosity[i]).norm_squared();
            self.radiosity[i] = new;
            self.blocks.set(i, new);
        })?;
        let residual = moved.sqrt();
        self.history.push(residual);
        Ok(residual)
    }

    /// B now.
    pub fn radiosity(&self) -> &[Rgb] {
        &self.radiosity
    }

    /// What each step returned.
    pub fn history(&self) -> &[f64] {
        &self.history
    }

    /// After a step: whether the answer is there, by the stopping test.
    ///
    /// # Errors
    /// [`SolveError::Diverges`] where going on is in vain.
    pub fn converged(&self, epsilon: f64) -> Result<bool, SolveError> {
        convergence::converged(self.patches, &self.radiosity, &self.history, epsilon)
    }

    /// The answer as it stands, with the irradiance that it brings to each patch.
    ///
    /// # Errors
    /// [`Interrupted`] where `watch`, told of rows that are found for it, says stop.
    pub fn into_solution_watched(self, watch: &mut Watch<'_>) -> Result<Solution, Interrupted> {
        super::gathered(self.rows, self.radiosity, &self.blocks, self.history, watch)
    }
}

/// Over stored rows, which need no watching.
impl GaussSeidel<'_> {
    /// [`GaussSeidel::step_watched`] by nobody.
    pub fn step(&mut self) -> f64 {
        self.step_watched(&mut ignore).unwrap_or(f64::NAN)
    }

    /// [`GaussSeidel::into_solution_watched`] by nobody.
    pub fn into_solution(self) -> Solution {
        self.into_solution_watched(&mut ignore).unwrap_or_default()
    }
}

/// Solve by Gauss-Seidel until sqrt(Σ_i |B_i - Bold_i|²) <= `epsilon`, the assignment's test, or until the
/// answer moves by rounding errors only. Step 3 of the assignment, `Gauss_Seidel`.
///
/// # Errors
/// [`SolveError::Diverges`] where the scene reflects more than it receives, or so nearly all that a million
/// sweeps would not do; [`SolveError::Interrupted`] where `watch`, asked after every sweep, says stop.
pub fn gauss_seidel(
    patches: &Patches,
    rows: &impl Passes,
    epsilon: f64,
    watch: &mut Watch<'_>,
) -> Result<Solution, SolveError> {
    let mut solver = GaussSeidel::new(patches, rows);
    loop {
        let residual = solver.step_watched(watch)?;
        let iteration = solver.history.len();
        tell(watch, Progress::Solve { iteration, residual, epsilon })?;
        if solver.converged(epsilon)? {
            return Ok(solver.into_solution_watched(watch)?);
        }
    }
}
