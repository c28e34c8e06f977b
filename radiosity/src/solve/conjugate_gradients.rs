//! Conjugate gradients: all that earlier steps have learnt goes into the next.
//!
//! \[HS52\] Hestenes & Stiefel, Methods of Conjugate Gradients for Solving Linear Systems, 1952.
//!
//! The method wants a symmetric system, and physics has one: A_i F_ij = A_j F_ji. A hemicube keeps this only to within its
//! own error, so the two are averaged, and that costs closure: a patch's averaged factors sum to 1 only as nearly as what
//! all others say of it does, which in a room of reflectance 0.99 comes back a hundredfold, or makes light without end. A
//! factor d_i a patch, near 1, puts that right:
//!
//! ```text
//! G_ij = d_i (A_i F_ij + A_j F_ji) / 2 d_j,   d such that Σ_j G_ij / A_i is the sum of row i of F
//! ```
//!
//! which is symmetric still (Sinkhorn's scaling, a dozen passes over the rows). With B_i = E_i + ρ_i Σ_j G_ij B_j / A_i
//! divided by ρ_i / A_i the system is
//!
//! ```text
//! S B = A E / ρ,   S = diag(A_i / ρ_i) - G
//! ```
//!
//! in each channel by itself. Where ρ_i is 0 the radiosity is known, B_i = E_i, and stands among the constants. G is never
//! stored: G x = d (A (F y) + Fᵀ (A y)) / 2, y = d x, comes of one pass over the rows of F, all three channels together.
//!
//! S is positive definite just where the bounces of light die away (the spectral radius of ρ G / A is below 1), so a
//! direction p with p · S p <= 0 proves that the scene reflects more than it receives.
//!
//! **Deflation.** Where nearly all light is reflected, nearly all of the work is one number a channel, how bright the scene is
//! on the whole: x = 1 wherever light is reflected, which S hardly changes. It is solved for directly and kept out of all
//! directions (\[Nico87\], \[SYEG00\]): the start is E and as much light everywhere as balances the whole, and of a
//! direction p so much of 1 is taken that 1 · S p = 0. One more pass at the start, S 1, saves five steps of seventeen in a
//! furnished room of reflectance 0.99.
//!
//! \[Nico87\] Nicolaides, Deflation of Conjugate Gradients with Applications to Boundary Value Problems, 1987.
//! \[SYEG00\] Saad, Yeung, Erhel & Guyomarc'h, A Deflated Version of the Conjugate Gradient Algorithm, 2000.
//!
//! **Which laws the answer keeps.** Reciprocity exactly, and closure to a millionth: so the furnace comes out right, as by
//! Gauss-Seidel on the rows as they are, *and* the energy, as by shooting along them. Where N3D's lit backs are seen there
//! is no reciprocity to be had, and the answer means little.

use super::{Solution, SolveError, convergence};
use crate::form_factors::{GreyBlocks, LightBlocks, Passes};
use crate::light::Rgb;
use crate::patches::Patches;
use crate::watch::{Interrupted, Progress, Watch, tell};

/// A bounce that keeps more than all but this of the light is taken for one that keeps all: as with the other solvers,
/// whose bounces are steps, a million of them would not do.
const LEAST_LOST: f64 = 1e-6;

/// How near the scaled factors come to closure, and within how many passes over the rows; where so many do not bring it, or
/// they bring nothing more, no scaling does, and what there is must serve.
const CLOSURE: f64 = 1e-6;
const MOST_SCALINGS: usize = 40;

/// The state between two steps.
#[derive(Clone, Debug)]
pub struct ConjugateGradients<'a, R> {
    patches: &'a Patches,
    rows: &'a R,
    /// d.
    scale: Vec<f64>,
    radiosity: Vec<Rgb>,
    /// r = A E / ρ - S B, by the recurrence; 0 where ρ is.
    residual: Vec<Rgb>,
    /// The residual at the start.
    first: Vec<Rgb>,
    /// S 1.
    whole: Vec<Rgb>,
    /// 1 / 1 · S 1; 0 in a channel where nothing is reflected, or nothing lost.
    inverse: Rgb,
    /// p.
    direction: Vec<Rgb>,
    /// r · z a channel, where z = ρ r / A is the residual as a radiosity: what a bounce more would add.
    size: [f64; 3],
    history: Vec<f64>,
    diverges: bool,
}

impl<'a, R: Passes> ConjugateGradients<'a, R> {
    /// Start from B = E, where the residual is what the emission lights, r = G E, and a mean light that balances it.
    ///
    /// # Errors
    /// [`Interrupted`] where `watch`, told of rows that are found for this pass, says stop.
    pub fn new(patches: &'a Patches, rows: &'a R, watch: &mut Watch<'_>) -> Result<Self, Interrupted> {
        let radiosity = patches.emission.clone();
        let scale = closing_scale(patches, rows, watch)?;
        let reflecting = |light: Rgb, i: usize| each(light, patches.reflectance[i], where_reflected);
        let mut residual = symmetric(patches, rows, &scale, |i| radiosity[i], watch)?;
        let mut whole = symmetric(patches, rows, &scale, |i| reflecting(Rgb::WHITE, i), watch)?;
        for i in 0..patches.len() {
            residual[i] = reflecting(residual[i], i);
            let diagonal = each(reflecting(Rgb::grey(patches.area[i]), i), patches.reflectance[i], over);
            whole[i] = diagonal - reflecting(whole[i], i);
        }
        let mut solver = Self {
            patches,
            rows,
            scale,
            radiosity,
            first: residual.clone(),
            residual,
            whole,
            inverse: Rgb::BLACK,
            direction: Vec::new(),
            size: [0.0; 3],
            history: Vec::new(),
            diverges: false,
        };
        solver.know_the_whole();
        solver.balance();
        solver.direction = (0..patches.len()).map(|i| solver.bounce(i)).collect();
        let shift = solver.shift();
        for (i, direction) in solver.direction.iter_mut().enumerate() {
            *direction += reflecting(shift, i);
        }
        solver.size = dot(&solver.residual, |i| solver.bounce(i));
        Ok(solver)
    }

    /// Find 1 / 1 · S 1, and whether the light that comes in is lost again.
    fn know_the_whole(&mut self) {
        let patches = self.patches;
        let lost = self.whole.iter().copied().sum::<Rgb>().to_array();
        let wanted = self.residual.iter().copied().sum::<Rgb>().to_array();
        let held = |i: usize| {
            each(
                each(Rgb::grey(patches.area[i]), patches.reflectance[i], where_reflected),
                patches.reflectance[i],
                over,
            )
        };
        let held = (0..patches.len()).map(held).sum::<Rgb>().to_array();
        let mut inverse = [0.0; 3];
        for channel in 0..3 {
            if lost[channel] > LEAST_LOST * held[channel] {
                inverse[channel] = 1.0 / lost[channel];
            } else {
                // The light that comes in is never lost again.
                self.diverges |= wanted[channel] > 0.0;
            }
        }
        self.inverse = Rgb::from(inverse);
    }

    /// Bring in so much light everywhere that 1 · r = 0: twice, for what is left of a residual that was this light alone is
    /// rounding, and of that, too, directions without 1 could take away nothing, by ever longer steps.
    fn balance(&mut self) {
        for _ in 0..2 {
            let light = self.residual.iter().copied().sum::<Rgb>() * self.inverse;
            for (i, &reflectance) in self.patches.reflectance.iter().enumerate() {
                self.radiosity[i] += each(light, reflectance, where_reflected);
                self.residual[i] = self.residual[i] - self.whole[i] * light;
            }
        }
    }

    /// How much light everywhere to add to a direction that begins as the bounce z, so that 1 · S p = 0.
    fn shift(&self) -> Rgb {
        Rgb::BLACK - Rgb::from(dot(&self.whole, |i| self.bounce(i))) * self.inverse
    }

    /// z_i = ρ_i r_i / A_i = E_i + ρ_i H_i - B_i: by how much a bounce more would change patch i.
    fn bounce(&self, i: usize) -> Rgb {
        self.patches.reflectance[i] * self.residual[i] * (1.0 / self.patches.area[i])
    }

    /// One step in all channels that are not done. Returns the greater of how far the answer moved, sqrt(Σ_i |B_i -
    /// Bold_i|²), and how far a bounce more would move it, sqrt(Σ_i |E_i + ρ_i H_i - B_i|²), each over all three channels.
    ///
    /// # Errors
    /// [`Interrupted`] where `watch`, told of rows that are found for this step, says stop; nothing has changed then.
    pub fn step(&mut self, watch: &mut Watch<'_>) -> Result<f64, Interrupted> {
        let patches = self.patches;
        let n = patches.len();
        // q = S p, and 0 where nothing is reflected.
        let mut image = symmetric(patches, self.rows, &self.scale, |i| self.direction[i], watch)?;
        for (i, q) in image.iter_mut().enumerate() {
            let p = self.direction[i] * patches.area[i];
            let reflected = each(*q, patches.reflectance[i], where_reflected);
            *q = each(p, patches.reflectance[i], over) - reflected;
        }
        // α = r·z / p·q ([HS52] eq. 3:1b), in each channel.
        let curvature = dot(&image, |i| self.direction[i]);
        let mut step = [0.0; 3];
        for channel in 0..3 {
            if self.size[channel] > 0.0 {
                self.diverges |= curvature[channel] <= 0.0;
                step[channel] = self.size[channel] / curvature[channel];
            }
        }
        let step = Rgb::from(step);
        let mut moved = 0.0;
        for (i, image) in image.iter().enumerate() {
            let change = self.direction[i] * step;
            moved += change.norm_squared();
            self.radiosity[i] += change;
            self.residual[i] = self.residual[i] - *image * step;
        }
        self.balance();
        // β = r·z / the r·z before (eq. 3:1e); the next direction is p = z + β p.
        let size = dot(&self.residual, |i| self.bounce(i));
        let mut turn = [0.0; 3];
        for channel in 0..3 {
            if self.size[channel] > 0.0 {
                turn[channel] = size[channel] / self.size[channel];
            }
        }
        let (turn, shift) = (Rgb::from(turn), self.shift());
        let mut left = 0.0;
        for i in 0..n {
            let bounce = self.bounce(i);
            left += bounce.norm_squared();
            let shift = each(shift, patches.reflectance[i], where_reflected);
            self.direction[i] = bounce + shift + self.direction[i] * turn;
        }
        self.size = size;
        let residual = moved.max(left).sqrt();
        self.history.push(residual);
        Ok(residual)
    }

    /// d: what scales the averaged factors to closure.
    pub fn scale(&self) -> &[f64] {
        &self.scale
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
    /// [`SolveError::Diverges`] where the system is not positive definite, or so nearly not that a million bounces of
    /// light would not do.
    pub fn converged(&self, epsilon: f64) -> Result<bool, SolveError> {
        if self.diverges || self.loses_nothing() {
            let residual = self.history.last().copied().unwrap_or(f64::NAN);
            return Err(SolveError::diverges(self.patches, self.history.len(), residual));
        }
        convergence::converged(self.patches, &self.radiosity, &self.history, epsilon)
    }

    /// Whether what has come to E in all, x = B - E, would hardly lose anything by a bounce more: the share lost is
    /// x · S x / x · (A / ρ) x, and S x is the residual's change.
    fn loses_nothing(&self) -> bool {
        let gained = |i: usize| self.radiosity[i] - self.patches.emission[i];
        let n = self.patches.len();
        let change: Vec<Rgb> = (0..n).map(|i| self.first[i] - self.residual[i]).collect();
        let lost = dot(&change, gained);
        let whole: Vec<Rgb> = (0..n)
            .map(|i| {
                let x = gained(i) * self.patches.area[i];
                each(x, self.patches.reflectance[i], over)
            })
            .collect();
        let whole = dot(&whole, gained);
        (0..3).any(|channel| whole[channel] > 0.0 && lost[channel] <= LEAST_LOST * whole[channel])
    }

    /// The answer as it stands, with the irradiance G B / A that it brings to each patch.
    ///
    /// # Errors
    /// [`Interrupted`] where `watch`, told of rows that are found for it, says stop.
    pub fn into_solution(self, watch: &mut Watch<'_>) -> Result<Solution, Interrupted> {
        let mut irradiance = symmetric(self.patches, self.rows, &self.scale, |i| self.radiosity[i], watch)?;
        for (irradiance, &area) in irradiance.iter_mut().zip(&self.patches.area) {
            *irradiance *= 1.0 / area;
        }
        let iterations = self.history.len();
        Ok(Solution { radiosity: self.radiosity, irradiance, iterations, history: self.history })
    }
}

/// G x = d (A (F y) + Fᵀ (A y)) / 2 of y = d x, in one pass over the rows.
fn symmetric(
    patches: &Patches,
    rows: &impl Passes,
    scale: &[f64],
    x: impl Fn(usize) -> Rgb,
    watch: &mut Watch<'_>,
) -> Result<Vec<Rgb>, Interrupted> {
    let y: LightBlocks = scale.iter().enumerate().map(|(i, &d)| x(i) * d).collect();
    let half = |i: usize| 0.5 * patches.area[i];
    let power: Vec<[f64; 3]> = (0..patches.len()).map(|i| (y.get(i) * half(i)).to_array()).collect();
    let (gathered, scattered) = rows.gather_and_scatter(watch, &y, &power)?;
    let all = gathered.into_iter().enumerate();
    Ok(all.map(|(i, gathered)| (Rgb::from(gathered) * half(i) + scattered.get(i)) * scale[i]).collect())
}

/// d: factors such that each row of G sums to what that row of F does, times A_i.
///
/// With ratio_i = wanted / found, d_i takes ratio_i^(2/3) to itself: where the light mixes well the error falls to a third
/// or a half in a pass. Kept within a factor of 4, for where light goes one way only no scaling closes a row.
fn closing_scale(
    patches: &Patches,
    rows: &impl Passes,
    watch: &mut Watch<'_>,
) -> Result<Vec<f64>, Interrupted> {
    let n = patches.len();
    let (mut wanted, mut scale) = (Vec::new(), vec![1.0; n]);
    let mut history = Vec::new();
    while history.len() < MOST_SCALINGS {
        let factors = GreyBlocks::new(&scale);
        let power: Vec<[f64; 1]> = (0..n).map(|i| [scale[i] * 0.5 * patches.area[i]]).collect();
        let (gathered, scattered) = rows.gather_and_scatter(watch, &factors, &power)?;
        if history.is_empty() {
            // Of factors 1 each row gathers what it sums to.
            wanted = (0..n).map(|i| patches.area[i] * gathered[i][0]).collect();
        }
        let mut off = 0.0_f64;
        for i in 0..n {
            let found = scale[i] * (gathered[i][0] * 0.5 * patches.area[i] + scattered.channels(i)[0]);
            if wanted[i] > 0.0 && found > 0.0 {
                let ratio = wanted[i] / found;
                off = off.max((ratio - 1.0).abs());
                scale[i] = (scale[i] * ratio.powf(2.0 / 3.0)).clamp(0.25, 4.0);
            }
        }
        history.push(off);
        // Two passes without gain: lit backs, which no scaling closes.
        if off <= CLOSURE || matches!(*history, [.., before, _, _] if off >= before) {
            break;
        }
    }
    Ok(scale)
}

/// x where something is reflected, else 0.
fn where_reflected(x: f64, reflectance: f64) -> f64 {
    if reflectance > 0.0 { x } else { 0.0 }
}

/// x / ρ, and 0 where x is: the direction is 0 wherever nothing is reflected.
fn over(x: f64, reflectance: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x / reflectance }
}

/// The same function of each channel.
fn each(a: Rgb, b: Rgb, f: impl Fn(f64, f64) -> f64) -> Rgb {
    Rgb::new(f(a.r, b.r), f(a.g, b.g), f(a.b, b.b))
}

/// Σ_i a_i b(i), a channel at a time, in patch order.
fn dot(a: &[Rgb], b: impl Fn(usize) -> Rgb) -> [f64; 3] {
    a.iter().enumerate().map(|(i, &a)| a * b(i)).sum::<Rgb>().to_array()
}

/// Solve by conjugate gradients on the symmetric system until a step moves the answer by no more than `epsilon`,
/// sqrt(Σ_i |B_i - Bold_i|²), *and* what it leaves of the equation, sqrt(Σ_i |E_i + ρ_i H_i - B_i|²), is no more than
/// that either: the assignment's test, and one that no short step can deceive. Or until rounding ends it.
///
/// # Errors
/// As for [`super::gauss_seidel`].
pub fn conjugate_gradients(
    patches: &Patches,
    rows: &impl Passes,
    epsilon: f64,
    watch: &mut Watch<'_>,
) -> Result<Solution, SolveError> {
    let mut solver = ConjugateGradients::new(patches, rows, watch)?;
    loop {
        let residual = solver.step(watch)?;
        tell(watch, Progress::Solve { iteration: solver.history.len(), residual, epsilon })?;
        if solver.converged(epsilon)? {
            return Ok(solver.into_solution(watch)?);
        }
    }
}
