//! Progressive refinement: the patch with the most unshot power sends it out, again and again.
//!
//! \[CCWG88\] Cohen, Chen, Wallace & Greenberg, A Progressive Refinement Approach to Fast Radiosity Image
//! Generation, 1988.
//!
//! Shooting needs one row at a time, of the shooter, so the first pictures come long before all rows are
//! known. It takes F_ji = F_ij A_i / A_j from the shooter's row. Since a hemicube's rows keep closure but
//! not reciprocity, shooting keeps the energy exactly (each shot lands whole in a closed scene), where
//! gathering keeps the furnace exactly; between them the two answers differ by the hemicube's own error.

use super::{Solution, SolveError, convergence};
use crate::form_factors::{Passes, Row};
use crate::light::Rgb;
use crate::patches::Patches;
use crate::watch::{Progress, Watch, tell};

/// The state between two shots.
#[derive(Clone, Debug)]
pub struct Progressive<'a> {
    patches: &'a Patches,
    radiosity: Vec<Rgb>,
    unshot: Vec<Rgb>,
    irradiance: Vec<Rgb>,
    shots: usize,
    history: Vec<f64>,
}

impl<'a> Progressive<'a> {
    /// Everything that is emitted is unshot.
    pub fn new(patches: &'a Patches) -> Self {
        Self {
            patches,
            radiosity: patches.emission.clone(),
            unshot: patches.emission.clone(),
            irradiance: vec![Rgb::BLACK; patches.len()],
            shots: 0,
            history: Vec::new(),
        }
    }

    /// The patch with the most unshot power A ΔB, all channels together, which shoots next; of equals the
    /// first. Where what is sent is a difference of light, power below 0 counts as much. `None` when all has been shot.
    pub fn next_shooter(&self) -> Option<usize> {
        let power = |i: usize| {
            let Rgb { r, g, b } = self.unshot[i];
            self.patches.area[i] * (r.abs() + g.abs() + b.abs())
        };
        let mut best = (None, 0.0);
        for i in 0..self.patches.len() {
            let power = power(i);
            if power > best.1 {
                best = (Some(i), power);
            }
        }
        best.0
    }

    /// `shooter` sends out all that it has not yet sent, along its own `row` of form factors:
    /// ΔB_j = ρ_j ΔB_i F_ij A_i / A_j (\[CCWG88\] eq. 5).
    pub fn shoot(&mut self, shooter: usize, row: &Row) {
        let power = self.unshot[shooter] * self.patches.area[shooter];
        self.unshot[shooter] = Rgb::BLACK;
        for (j, factor) in row.iter() {
            let arriving = power * (factor / self.patches.area[j]);
            let leaving = self.patches.reflectance[j] * arriving;
            self.irradiance[j] += arriving;
            self.radiosity[j] += leaving;
            self.unshot[j] += leaving;
        }
        self.shots += 1;
    }

    /// What is yet to be shot: sqrt(Σ_i |ΔB_i|²), over all three channels. It is what the answer moved by and
    /// has not yet passed on, and so stands where Gauss-Seidel's residual stands.
    pub fn residual(&self) -> f64 {
        self.unshot.iter().map(|unshot| unshot.norm_squared()).sum::<f64>().sqrt()
    }

    /// After a shot that left this `residual`: whether the answer is there, by the stopping test. Keeps the history,
    /// one entry for every as many shots as there are patches, and one for the last.
    ///
    /// # Errors
    /// [`SolveError::Diverges`] where going on is in vain.
    pub fn converged(&mut self, residual: f64, epsilon: f64) -> Result<bool, SolveError> {
        let done = residual <= epsilon;
        let round = self.shots.is_multiple_of(self.patches.len());
        if done || round {
            self.history.push(residual);
        }
        if !done && round && convergence::is_hopeless(&self.history, epsilon) {
            return Err(SolveError::diverges(self.patches, self.shots, residual));
        }
        Ok(done)
    }

    /// What [`Progressive::converged`] kept.
    pub fn history(&self) -> &[f64] {
        &self.history
    }

    /// ΔB: what each patch has yet to send out.
    pub fn unshot(&self) -> &[Rgb] {
        &self.unshot
    }

    /// The answer as it stands.
    pub fn into_solution(self) -> Solution {
        Solution {
            radiosity: self.radiosity,
            irradiance: self.irradiance,
            iterations: self.shots,
            history: self.history,
        }
    }

    /// B of all that has been shot.
    pub fn radiosity(&self) -> &[Rgb] {
        &self.radiosity
    }

    /// Shots so far.
    pub fn shots(&self) -> usize {
        self.shots
    }

    /// The ambient term (\[CCWG88\] eqs. 8-11): the unshot power spread over the whole scene, with all its
    /// interreflections, R Σ ΔB_i A_i / Σ A_i where R = 1 / (1 - mean ρ). A guess at the irradiance that is yet to
    /// come, for display only; black where the mean reflectance is 1 or more.
    pub fn ambient(&self) -> Rgb {
        let total = self.patches.total_area();
        let mean = |light: &[Rgb]| -> Rgb {
            let sum: Rgb = light.iter().zip(&self.patches.area).map(|(&light, &area)| light * area).sum();
            sum * (1.0 / total)
        };
        let (unshot, reflectance) = (mean(&self.unshot), mean(&self.patches.reflectance));
        let spread = |unshot: f64, reflectance: f64| {
            if reflectance < 1.0 { unshot / (1.0 - reflectance) } else { 0.0 }
        };
        Rgb::new(
            spread(unshot.r, reflectance.r),
            spread(unshot.g, reflectance.g),
            spread(unshot.b, reflectance.b),
        )
    }

    /// What to show meanwhile: B plus what the ambient term would have each patch reflect.
    pub fn display_radiosity(&self) -> Vec<Rgb> {
        let ambient = self.ambient();
        let lit = self.radiosity.iter().zip(&self.patches.reflectance);
        lit.map(|(&radiosity, &reflectance)| radiosity + reflectance * ambient).collect()
    }
}

/// Shoot until sqrt(Σ_i |unshot ΔB_i|²) <= `epsilon`.
///
/// The history has one entry for every as many shots as there are patches, and one for the last;
/// `iterations` counts shots. `watch` is asked after every shot.
///
/// # Errors
/// As for [`super::gauss_seidel`].
pub fn progressive(
    patches: &Patches,
    rows: &impl Passes,
    epsilon: f64,
    watch: &mut Watch<'_>,
) -> Result<Solution, SolveError> {
    let mut solver = Progressive::new(patches);
    while let Some(shooter) = solver.next_shooter() {
        rows.with_row(shooter, |row| solver.shoot(shooter, row));
        let residual = solver.residual();
        tell(watch, Progress::Solve { iteration: solver.shots, residual, epsilon })?;
        if solver.converged(residual, epsilon)? {
            break;
        }
    }
    Ok(solver.into_solution())
}
