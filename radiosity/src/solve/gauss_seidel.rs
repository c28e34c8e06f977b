//! Gauss-Seidel: each patch in turn gathers from the newest radiosities of all others.
//!
//! A sweep reads every form factor once, and its speed is that of the memory as long as the arithmetic keeps up. So most
//! sweeps gather not B but only what it has *changed by* since the patch last gathered, which single precision tells well
//! enough: H_i += Σ_j F_ij ΔB_j. What rounding keeps back of a change, 2⁻²⁴ of it, is sent with the next one, so that what
//! the patches are told comes as near to B as double precision has it. What the sums lose, about a millionth of what they
//! add to H, stays; so every eighth sweep gathers all of B anew, in double precision. In the sweeps between, the error is
//! thus bounded by the *steps* taken since, not by the light: where steps shrink to a third each time it is still below a
//! hundredth of the smallest. The sweeps, and their number, are those of plain Gauss-Seidel to within that.

use super::{Solution, SolveError, convergence};
use crate::form_factors::{ChangeBlocks, FormFactors, LightBlocks, Passes};
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
    /// H: what each patch has gathered.
    irradiance: Vec<Rgb>,
    /// The radiosity that the others have been told of.
    told: LightBlocks,
    /// By how much they have been told that it changed, when last they were, in `unit`.
    changes: ChangeBlocks,
    /// A power of two near the greatest radiosity at the start, so that no light is too strong or weak for changes.
    unit: f64,
    /// 1 / `unit`.
    per_unit: f64,
    /// Sweeps of changes until all is gathered anew.
    until_whole: usize,
    history: Vec<f64>,
}

/// One sweep of so many gathers all of B.
const WHOLE_EVERY: usize = 8;

impl<'a, R: Passes> GaussSeidel<'a, R> {
    /// Start from B = E, as the assignment does.
    pub fn new(patches: &'a Patches, rows: &'a R) -> Self {
        Self::from(patches, rows, patches.emission.clone())
    }

    /// Start from an earlier answer.
    pub fn from(patches: &'a Patches, rows: &'a R, radiosity: Vec<Rgb>) -> Self {
        let told = radiosity.iter().copied().collect();
        let greatest = radiosity.iter().map(|b| b.max_channel()).fold(0.0, f64::max);
        let unit = if greatest > 0.0 { greatest.log2().round().clamp(-1000.0, 1000.0).exp2() } else { 1.0 };
        Self {
            patches,
            rows,
            irradiance: vec![Rgb::BLACK; radiosity.len()],
            told,
            changes: ChangeBlocks::none(radiosity.len()),
            unit,
            per_unit: 1.0 / unit,
            until_whole: 0,
            radiosity,
            history: Vec::new(),
        }
    }

    /// One sweep over all patches, in order: B_i = E_i + ρ_i Σ_j F_ij B_j with the B_j of this sweep where j
    /// has had its turn. Returns how far the answer moved, sqrt(Σ_i |B_i - Bold_i|²) over all three channels.
    ///
    /// # Errors
    /// [`Interrupted`] where `watch`, told of rows that are found for this sweep, says stop; the sweep is then half done.
    pub fn step_watched(&mut self, watch: &mut Watch<'_>) -> Result<f64, Interrupted> {
        let rows = self.rows;
        let (mut moved, mut gathered) = (0.0, Vec::new());
        // A sweep that is interrupted leaves changes that some patches know of and some do not: the next begins anew.
        let until_whole = std::mem::take(&mut self.until_whole);
        let whole = until_whole == 0;
        rows.pass_stretches(watch, |stretch| {
            match whole {
                true => stretch.gather(&self.told, &mut gathered),
                false => stretch.gather_changes(&self.changes, &mut gathered),
            }
            for (i, &gathered) in (stretch.first()..).zip(&gathered) {
                let irradiance = &mut self.irradiance[i];
                *irradiance = if whole { gathered } else { *irradiance + gathered * self.unit };
                moved += self.reflect(i);
            }
        })?;
        self.until_whole = if whole { WHOLE_EVERY } else { until_whole } - 1;
        let residual = moved.sqrt();
        self.history.push(residual);
        Ok(residual)
    }

    /// B_i = E_i + ρ_i H_i, and the others are told. Returns |B_i - Bold_i|².
    fn reflect(&mut self, i: usize) -> f64 {
        let new = self.patches.emission[i] + self.patches.reflectance[i] * self.irradiance[i];
        let moved = (new - self.radiosity[i]).norm_squared();
        self.radiosity[i] = new;
        let told = self.told.get(i);
        let change = self.changes.set(i, (new - told) * self.per_unit) * self.unit;
        self.told.set(i, told + change);
        moved
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
        let blocks = self.radiosity.iter().copied().collect();
        super::gathered(self.rows, self.radiosity, &blocks, self.history, watch)
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
    gauss_seidel_from(patches, rows, patches.emission.clone(), epsilon, watch)
}

/// The same from an earlier answer.
///
/// # Errors
/// As of [`gauss_seidel`].
pub fn gauss_seidel_from(
    patches: &Patches,
    rows: &impl Passes,
    radiosity: Vec<Rgb>,
    epsilon: f64,
    watch: &mut Watch<'_>,
) -> Result<Solution, SolveError> {
    let mut solver = GaussSeidel::from(patches, rows, radiosity);
    loop {
        let residual = solver.step_watched(watch)?;
        let iteration = solver.history.len();
        tell(watch, Progress::Solve { iteration, residual, epsilon })?;
        if solver.converged(epsilon)? {
            return Ok(solver.into_solution_watched(watch)?);
        }
    }
}
