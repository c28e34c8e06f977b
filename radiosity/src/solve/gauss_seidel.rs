//! Gauss-Seidel: each patch in turn gathers from the newest radiosities of all others.

use super::{Solution, SolveError};
use crate::form_factors::FormFactors;
use crate::light::Rgb;
use crate::patches::Patches;
use crate::watch::{Progress, Watch, tell};

/// The assignment's `EPS_B`.
pub const DEFAULT_EPSILON: f64 = 1e-6;

/// Sweeps over which the residual must have shrunk somewhat, or the solver gives up.
const PATIENCE: usize = 32;

/// The most sweeps that the solver undertakes.
const MOST_SWEEPS: f64 = 1e6;

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
        Self::resume(patches, form_factors, radiosity, Vec::new())
    }

    /// Go on where another solver of the same equation left off, with its radiosities and history.
    pub fn resume(
        patches: &'a Patches,
        form_factors: &'a FormFactors,
        radiosity: Vec<Rgb>,
        history: Vec<f64>,
    ) -> Self {
        Self { patches, form_factors, radiosity, history }
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

    /// Whether going on is in vain: the residual is not finite, has not shrunk for many sweeps though it is far above
    /// rounding, or shrinks so slowly that `epsilon` is out of reach.
    fn hopeless(&self, epsilon: f64) -> bool {
        let [.., now] = self.history[..] else { return false };
        if !now.is_finite() {
            return true;
        }
        let Some(before) = self.history.len().checked_sub(PATIENCE + 1).map(|k| self.history[k]) else {
            return false;
        };
        let rate = (now / before).powf(1.0 / PATIENCE as f64);
        let sweeps_left = (epsilon / now).ln() / rate.ln();
        rate >= 1.0 || self.history.len() as f64 + sweeps_left > MOST_SWEEPS
    }

    /// Whether the answer moves by no more than the last bits of its own numbers: it will not come closer.
    fn moves_by_rounding_only(&self) -> bool {
        let size = self.radiosity.iter().map(|b| b.norm_squared()).sum::<f64>().sqrt();
        self.history.last().is_some_and(|&residual| residual <= 4.0 * f64::EPSILON * size)
    }

    /// What to do after a step: the stopping test, `Ok(true)` where the answer is there.
    ///
    /// # Errors
    /// [`SolveError::Diverges`] where going on is in vain.
    pub fn converged(&self, epsilon: f64) -> Result<bool, SolveError> {
        let Some(&residual) = self.history.last() else { return Ok(false) };
        if residual <= epsilon || self.moves_by_rounding_only() {
            return Ok(true);
        }
        if self.hopeless(epsilon) {
            let max_reflectance =
                self.patches.reflectance.iter().map(|r| r.max_channel()).fold(0.0, f64::max);
            return Err(SolveError::Diverges { iterations: self.history.len(), residual, max_reflectance });
        }
        Ok(false)
    }

    /// B and the history, for [`GaussSeidel::resume`].
    pub fn into_parts(self) -> (Vec<Rgb>, Vec<f64>) {
        (self.radiosity, self.history)
    }

    /// The answer as it stands, with the irradiance that it brings to each patch.
    pub fn into_solution(self) -> Solution {
        let irradiance = self.form_factors.rows().iter().map(|row| row.gather(&self.radiosity)).collect();
        Solution { radiosity: self.radiosity, irradiance, history: self.history }
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
