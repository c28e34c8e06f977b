//! An error with every solution: how far its radiosities may be from the truth, patch by patch and in all.
//!
//! The truth about a patch is the mean of the exact radiosity over it. What is told is an estimate, not a proof: made so that the true
//! error lies below it for about 95 % of patches, and it is about three times the true one on average, on scenes whose answers are
//! known (`docs/error.md` has the figures, and where it falls short; `tests/error.rs` holds them).
//!
//! Three things are wrong with an answer, and each is first found where it arises, as a radiosity with its sign:
//!
//! - **discretisation**: a patch sends as if it were equally bright all over. What that hides is seen, where form factors are
//!   exact or nearly so, from four places within each patch ([`Hidden`]). With hemicubes it is seen one level coarser, where
//!   the answer knows what a group of four patches would hide from the others: F (B - P B), P being the mean over the group;
//! - **form factors**: looks from two other places on the patch, turned, gathered with the light of the answer ([`Looks`]).
//!   They know what the hemicube at its centre mistakes, be it the cells or the centre. Every second patch looks,
//!   and its neighbours share what it finds. Exact form factors have no centre, and an accuracy;
//! - **residual**: what the equation lacks of being solved, E + ρ H - B, and what steps that were not made any more would have
//!   added, the last one times q / (1 - q) with the observed rate of convergence q.
//!
//! Each then travels as light does, e = s + ρ F e, for an error is reflected by all who see it. What is left of the series
//! when it has all but ended is taken for geometric.
//!
//! \[LSG94\] Lischinski, Smits & Greenberg, Bounds and Error Estimates for Radiosity, 1994.

mod groups;
mod looks;
mod variation;
mod within;

pub use looks::Looks;
pub use variation::Variation;
pub use within::{Hidden, Places};

use crate::form_factors::{LightBlocks, Passes};
use crate::light::Rgb;
use crate::patches::Patches;
use crate::solve::Solution;
use crate::watch::{Interrupted, Watch};
use groups::Groups;

/// How an error's parts are known, patch by patch; power per area, never negative, a channel each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ErrorEstimate {
    /// What |B - the truth| is below for about 95 % of patches.
    pub radiosity: Vec<Rgb>,
    /// The part that comes of patches being equally bright all over.
    pub discretisation: Vec<Rgb>,
    /// The part that comes of the method that found the form factors.
    pub form_factors: Vec<Rgb>,
    /// The part that comes of the solver having stopped.
    pub residual: Vec<Rgb>,
    /// Patches that have no neighbours on their surface to be taken together with, where a level coarser is looked at: their part of
    /// the discretisation is not known.
    pub alone: usize,
}

/// The same of all patches together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OverallError {
    /// sqrt(Σ A e² / Σ A B²) over all patches that emit nothing, r, g and b together. Where all emit, over all.
    pub relative: f64,
    /// The same of its parts.
    pub discretisation: f64,
    /// Likewise.
    pub form_factors: f64,
    /// Likewise.
    pub residual: f64,
    /// The greatest error in any channel, and its patch. \[power per area\]
    pub greatest: (f64, u32),
}

/// What is known of the form factors' own error.
#[derive(Clone, Debug)]
pub enum Local {
    /// For each patch that looked a second time ([`Looks::wanted`]), the mean irradiance of both places, with the light of the
    /// answer.
    Looked(Vec<Option<Rgb>>),
    /// A share of the irradiance that they are known to.
    Accuracy(f64),
}

/// The most bounces that an error is followed for, and the share of all that the last of them may bring.
const MOST_BOUNCES: usize = 16;
const LAST_BOUNCE: f64 = 0.02;

impl ErrorEstimate {
    /// Of `solution`, found with `rows` (or by any other solver of these patches). `hidden` is the irradiance that each patch
    /// lacks because others send evenly ([`Hidden::irradiance`]); without, it is seen a level coarser.
    ///
    /// # Errors
    /// [`Interrupted`] where `watch`, told of rows that are found for it, says stop.
    pub fn new(
        patches: &Patches,
        rows: &impl Passes,
        solution: &Solution,
        local: &Local,
        hidden: Option<&[Rgb]>,
        watch: &mut Watch<'_>,
    ) -> Result<Self, Interrupted> {
        let n = patches.len();
        let reflected = |light: &[Rgb]| -> Vec<Rgb> {
            light.iter().zip(&patches.reflectance).map(|(&light, &reflectance)| reflectance * light).collect()
        };
        let [few, many] = [2, 4].map(|side| Groups::new(patches, side));
        let discretisation = match hidden {
            Some(hidden) => reflected(hidden),
            None => {
                // Hemicubes at centres get better with the first order, so that as much is left at this level.
                let means = few.means(patches, &solution.irradiance);
                let off: Vec<Rgb> =
                    solution.irradiance.iter().zip(means).map(|(&h, mean)| h - mean).collect();
                let [coarser] = gathered(rows, [reflected(&off)], watch)?;
                reflected(&few.means(patches, &coarser))
            }
        };

        let form_factors = match local {
            Local::Looked(seen) => reflected(&looked(patches, &few, seen, &solution.irradiance)),
            Local::Accuracy(share) => {
                let off: Vec<Rgb> = solution.irradiance.iter().map(|&h| h * *share).collect();
                reflected(&off)
            }
        };
        let residual: Vec<Rgb> = (0..n)
            .map(|i| {
                let bounce = patches.reflectance[i] * solution.irradiance[i];
                patches.emission[i] + bounce - solution.radiosity[i]
            })
            .collect();

        let sources = [discretisation, form_factors, residual];
        let everywhere = travelled(patches, rows, &sources, watch)?;
        let [discretisation, form_factors, mut residual] = [0, 1, 2].map(|part| -> Vec<Rgb> {
            let around = spread(patches, &many, &sources[part]);
            let here: Vec<Rgb> = everywhere[part]
                .iter()
                .zip(around)
                .map(|(&whole, around)| each(whole, around, f64::hypot))
                .collect();
            let least = typical(patches, &here);
            let both = here.iter().zip(&patches.reflectance);
            both.map(|(&here, &reflectance)| each(here, least * reflectance, f64::hypot)).collect()
        });
        let not_made = steps_not_made(&solution.history) / ((3 * n.max(1)) as f64).sqrt();
        for (residual, reflectance) in residual.iter_mut().zip(&patches.reflectance) {
            *residual += each(*reflectance, Rgb::BLACK, |rho, _| if rho > 0.0 { not_made } else { 0.0 });
        }
        let parts = discretisation.iter().zip(&form_factors).zip(&residual);
        let radiosity =
            parts.map(|((&d, &f), &r)| each(each(d, f, f64::hypot), r, f64::hypot) * SAFETY).collect();
        let alone = match hidden {
            Some(_) => 0,
            None => few.iter().filter(|group| group.len() == 1).count(),
        };
        Ok(Self { radiosity, discretisation, form_factors, residual, alone })
    }

    /// The error and its parts, by the names that files have them under.
    pub fn columns(&self) -> [(&'static str, &Vec<Rgb>); 4] {
        [
            ("error", &self.radiosity),
            ("error_discretisation", &self.discretisation),
            ("error_form_factors", &self.form_factors),
            ("error_residual", &self.residual),
        ]
    }

    /// Of all patches together.
    pub fn overall(&self, patches: &Patches, solution: &Solution) -> OverallError {
        let all_emit = !patches.emission.iter().any(|emission| emission.is_black());
        let counted = |i: &usize| all_emit || patches.emission[*i].is_black();
        let size = |light: &[Rgb]| -> f64 {
            (0..light.len())
                .filter(counted)
                .map(|i| patches.area[i] * light[i].norm_squared())
                .sum::<f64>()
                .sqrt()
        };
        let whole = size(&solution.radiosity);
        let share = |part: &[Rgb]| if whole > 0.0 { size(part) / whole } else { 0.0 };
        let greater = |greatest: (f64, u32), (error, patch): (&Rgb, u32)| {
            if error.max_channel() > greatest.0 { (error.max_channel(), patch) } else { greatest }
        };
        OverallError {
            relative: share(&self.radiosity),
            discretisation: share(&self.discretisation),
            form_factors: share(&self.form_factors),
            residual: share(&self.residual),
            greatest: self.radiosity.iter().zip(0..).fold((0.0, 0), greater),
        }
    }
}

/// What is expected, times this, is exceeded by no more than about one patch in twenty.
const SAFETY: f64 = 1.1;

/// The same function of each channel.
fn each(a: Rgb, b: Rgb, f: impl Fn(f64, f64) -> f64) -> Rgb {
    Rgb::new(f(a.r, b.r), f(a.g, b.g), f(a.b, b.b))
}

/// sqrt(Σ A x² / Σ A), all channels together.
fn rms(patches: &Patches, light: &[Rgb]) -> f64 {
    let sum: f64 = light.iter().zip(&patches.area).map(|(light, area)| area * light.norm_squared()).sum();
    (sum / patches.total_area()).sqrt()
}

/// F x of each of these, in one pass.
fn gathered<const N: usize>(
    rows: &impl Passes,
    light: [Vec<Rgb>; N],
    watch: &mut Watch<'_>,
) -> Result<[Vec<Rgb>; N], Interrupted> {
    let blocks = light.map(|light| light.into_iter().collect::<LightBlocks>());
    let mut arrived = std::array::from_fn(|_| vec![Rgb::BLACK; rows.count()]);
    rows.pass(watch, |i, row| {
        for (arrived, blocks) in arrived.iter_mut().zip(&blocks) {
            arrived[i] = row.gather_blocks(blocks);
        }
    })?;
    Ok(arrived)
}

/// By how much second looks differ from the irradiance of the answer; a patch that did not look has the mean of its
/// neighbours that did.
fn looked(patches: &Patches, few: &Groups, seen: &[Option<Rgb>], irradiance: &[Rgb]) -> Vec<Rgb> {
    let mut off = vec![Rgb::BLACK; patches.len()];
    for group in few.iter() {
        let found = |i: u32| seen[i as usize].map(|seen| seen - irradiance[i as usize]);
        let (sum, area) = group.iter().fold((Rgb::BLACK, 0.0), |(sum, area), &i| match found(i) {
            Some(found) => (sum + found * patches.area[i as usize], area + patches.area[i as usize]),
            None => (sum, area),
        });
        let mean = if area > 0.0 { sum * (1.0 / area) } else { Rgb::BLACK };
        for &i in group {
            off[i as usize] = found(i).unwrap_or(mean);
        }
    }
    off
}

/// The root of the mean square over each group, for each of its patches.
fn spread(patches: &Patches, groups: &Groups, light: &[Rgb]) -> Vec<Rgb> {
    let squares: Vec<Rgb> = light.iter().map(|&light| light * light).collect();
    let root = |mean: Rgb| each(mean, mean, |mean, _| mean.sqrt());
    groups.means(patches, &squares).into_iter().map(root).collect()
}

/// The mean over the area of an error, for a patch that reflects all: so much may be wrong anywhere, though nothing tells.
fn typical(patches: &Patches, error: &[Rgb]) -> Rgb {
    let mean =
        |light: &[Rgb]| -> Rgb { light.iter().zip(&patches.area).map(|(&light, &area)| light * area).sum() };
    let over = |error: f64, reflectance: f64| if reflectance > 0.0 { error / reflectance } else { 0.0 };
    each(mean(error), mean(&patches.reflectance), over)
}

/// e = s + ρ F e of each of the sources.
fn travelled(
    patches: &Patches,
    rows: &impl Passes,
    sources: &[Vec<Rgb>; 3],
    watch: &mut Watch<'_>,
) -> Result<[Vec<Rgb>; 3], Interrupted> {
    let (mut sum, mut bounce) = (sources.clone(), sources.clone());
    for _ in 0..MOST_BOUNCES {
        let before = [0, 1, 2].map(|part: usize| rms(patches, &bounce[part]));
        bounce = gathered(rows, bounce, watch)?;
        let mut last = true;
        for (part, sum) in sum.iter_mut().enumerate() {
            for (i, light) in bounce[part].iter_mut().enumerate() {
                *light = patches.reflectance[i] * *light;
                sum[i] += *light;
            }
            last &= rms(patches, &bounce[part]) <= LAST_BOUNCE * rms(patches, sum);
        }
        if last || before == [0.0; 3] {
            break;
        }
    }
    Ok(sum)
}

/// How far the steps that a solver did not make would have moved its answer, as the stopping test measures it, going by its last
/// ones: a geometric series.
fn steps_not_made(history: &[f64]) -> f64 {
    let Some(&last) = history.last() else { return 0.0 };
    let before = history.len().saturating_sub(RATED + 1);
    let steps = history.len() - 1 - before;
    if steps == 0 {
        return last;
    }
    let rate = (last / history[before]).powf(1.0 / steps as f64);
    if rate.is_finite() { last * rate / (1.0 - rate.min(SLOWEST)) } else { last }
}

/// The last steps that tell a solver's rate, and the slowest that is believed.
const RATED: usize = 4;
const SLOWEST: f64 = 0.999_999;
