//! Gauss-Seidel: each patch in turn gathers from the newest radiosities of all others.

use super::{Solution, SolveError, convergence};
use crate::form_factors::FormFactors;
use crate::light::Rgb;
use crate::patches::Patches;
use crate::watch::{Progress, Watch, tell};

/// The assignment's `EPS_B`.
pub const DEFAULT_EPSILON: f64 = 1e-6;

/// The state between two sweeps.
#[derive(Clone, Debug)]
pub struct GaussSeidel<'a> {
    patches: &'a Patches,
    form_factors: &'a FormFactors,
    radiosity: Vec<Rgb>,
    history: Vec<f64>,
}

impl<'a> GaussSeidel<'a> {
    /// Start from B = E, as the assignment does.
    pub fn new(patches: &'a Patches, form_factors: &'a FormFactors) -> Self {
        Self::from(patches, form_factors, patches.emission.clone())
    }

    /// Start from an earlier answer.
    pub fn from(patches: &'a Patches, form_factors: &'a FormFactors, radiosity: Vec<Rgb>) -> Self {
        Self { patches, form_factors, radiosity, history: Vec::new() }
    }

    /// One sweep over all patches, in order: B_i = E_i + ρ_i Σ_j F_ij B_j with the B_j of this sweep where j
    /// has had its turn. Returns how far the answer moved, sqrt(Σ_i |B_i - Bold_i|²) over all three channels.
    pub fn step(&mut self) -> f64 {
        let mut moved = 0.0;
        for (i, row) in self.form_factors.rows().iter().enumerate() {
            let irradiance = row.gather(&self.radiosity);
            let new = self.patches.emission[i] + self.patches.reflectance[i] * irradiance;
            moved += (new - self.radiosity[i]).norm_squared();
            self.radiosity[i] = new;
        }
        let residual = moved.sqrt();
        self.history.push(residual);
        residual
    }

    /// B now.
    pub fn radiosity(&self) -> &[Rgb] {
        &self.radiosity
    }

    /// What each step returned.
    pub fn history(&self) -> &[f64] {
        &self.history
    }

    /// Whether the answer moves by no more than the last bits of its own numbers: it will not come closer.
    fn moves_by_rounding_only(&self) -> bool {
        let size = self.radiosity.iter().map(|b| b.norm_squared()).sum::<f64>().sqrt();
        self.history.last().is_some_and(|&residual| residual <= 4.0 * f64::EPSILON * size)
    }

    /// After a step: whether the answer is there, by the stopping test.
    ///
    /// # Errors
    /// [`SolveError::Diverges`] where going on is in vain.
    pub fn converged(&self, epsilon: f64) -> Result<bool, SolveError> {
        let Some(&residual) = self.history.last() else { return Ok(false) };
        if residual <= epsilon || self.moves_by_rounding_only() {
            return Ok(true);
        }
        if convergence::is_hopeless(&self.history, epsilon) {
            return Err(SolveError::diverges(self.patches, self.history.len(), residual));
        }
        Ok(false)
    }

    /// The answer as it stands, with the irradiance that it brings to each patch.
    pub fn into_solution(self) -> Solution {
        let irradiance = self.form_factors.rows().iter().map(|row| row.gather(&self.radiosity)).collect();
        let iterations = self.history.len();
        Solution { radiosity: self.radiosity, irradiance, iterations, history: self.history }
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
    form_factors: &FormFactors,
    epsilon: f64,
    watch: &mut Watch<'_>,
) -> Result<Solution, SolveError> {
    let mut solver = GaussSeidel::new(patches, form_factors);
    loop {
        let residual = solver.step();
        let iteration = solver.history.len();
        tell(watch, Progress::Solve { iteration, residual, epsilon })?;
        if solver.converged(epsilon)? {
            return Ok(solver.into_solution());
        }
    }
}
