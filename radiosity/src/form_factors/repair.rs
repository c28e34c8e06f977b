//! Exchange areas: form factors with reciprocity, and brought to closure.
//!
//! The exchange area of two patches, G_ij = A_i F_ij = A_j F_ji, is one number for both ways (the *direct exchange area* of
//! \[HS67\]). No method finds both ways alike; here they are averaged. That costs closure, which what was found hardly ever has
//! to the last digit anyway:
//!
//! ```text
//! Σ_j G_ij + A_i (what goes elsewhere) = A_i
//! ```
//!
//! and so the areas are corrected, each as little as will do: of all corrections that restore closure, the one with the least
//! Σ (ΔG_ij)² / G_ij (\[Loehrke95\], \[Lawson95\]; a method's error in an exchange area grows about with its root). By Lagrange's
//! multipliers that is
//!
//! ```text
//! ΔG_ij = G_ij (λ_i + λ_j),   Σ_j G_ij (λ_i + λ_j) + A_i (elsewhere) λ_i = what row i lacks
//! ```
//!
//! a symmetric, positive semidefinite system of one unknown a patch. The correction keeps zeros, and reciprocity by its very
//! form; where it would turn a sign it is taken in several smaller steps.
//!
//! \[HS67\] Hottel & Sarofim, Radiative Transfer, 1967, chapter 7.
//! \[Loehrke95\] Loehrke, Dolaghan & Burns, Smoothing Monte Carlo Exchange Factors, Journal of Heat Transfer 117, 1995.
//! \[Lawson95\] Lawson, An Improved Method for Smoothing Approximate Exchange Areas, Int. J. Heat and Mass Transfer 38, 1995.

use rayon::prelude::*;

use super::rows::{Elsewhere, FormFactors, Packing, Row};

/// Closure this near is reached: a sum in double precision tells no more.
const REACHED: f64 = 2e-15;

/// Rounds of correction, and steps of each.
const MOST_ROUNDS: usize = 40;
const MOST_STEPS: usize = 500;

/// What one round may leave of an exchange area.
const LEAST_LEFT: f64 = 0.5;

/// Rows that a thread takes at a time, at the least.
const ROWS_A_THREAD: usize = 64;

/// In front of a column: what is seen there is a lit back, which sends what it never received. There is no way back to average
/// it with, and it is corrected by the row that it stands in alone.
const ONE_WAY: u32 = 1 << 31;

/// Exchange areas, symmetric to the bit but for what is seen on lit backs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExchangeAreas {
    area: Vec<f64>,
    /// Where each row begins; one more entry ends the last.
    starts: Vec<usize>,
    columns: Vec<u32>,
    /// G_ij, in the unit of the areas.
    values: Vec<f64>,
    /// What arrives at no patch, times the area: to the surroundings, to black backs.
    elsewhere: Vec<[f64; 2]>,
    /// Σ |A_i F_ij - A_j F_ji|, Σ (A_i F_ij + A_j F_ji), and what is seen on lit backs.
    found: [f64; 3],
}

/// How closure was restored.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Closing {
    /// Rounds of correction.
    pub rounds: usize,
    /// The greatest |1 - Σ_j F_ij - elsewhere| of any patch once both ways were averaged, and after the correction. Where the
    /// latter is far from 0 no symmetric correction closes the rows: two patches that see only each other, and differ in area.
    pub before: f64,
    /// After it.
    pub after: f64,
    /// The greatest share that any form factor was changed by.
    pub greatest_change: f64,
}

impl ExchangeAreas {
    /// About how many bytes it takes to make them of so many form factors, at the most.
    pub fn bytes(nonzeros: u64) -> u64 {
        // Transposed, averaged, and as they were before they are corrected.
        nonzeros.saturating_mul((4 + 4) + (4 + 8) + 8)
    }

    /// The average of A_i F_ij and A_j F_ji, but where `from_behind(i, j)` tells that i sees the back of j.
    pub fn average(area: &[f64], factors: &FormFactors, from_behind: impl Fn(usize, usize) -> bool) -> Self {
        let n = factors.len();
        let mut ends = vec![0; n + 1];
        for row in factors.rows() {
            row.columns().for_each(|j| ends[j as usize + 1] += 1);
        }
        for j in 0..n {
            ends[j + 1] += ends[j];
        }
        // Transposed: entry by entry in ascending order, for the rows come so.
        let mut from = vec![(0_u32, 0.0_f32); ends[n]];
        let mut next = ends.clone();
        for (i, row) in factors.rows().iter().enumerate() {
            for (j, &value) in row.columns().zip(row.values()) {
                let place = &mut next[j as usize];
                from[*place] = (i as u32, value);
                *place += 1;
            }
        }
        let mut areas = Self { area: area.to_vec(), starts: vec![0], ..Self::default() };
        for (i, row) in factors.rows().iter().enumerate() {
            let mut back = from[ends[i]..ends[i + 1]].iter().copied().peekable();
            let mut there = row.columns().zip(row.values().iter().copied()).peekable();
            while let Some(j) = there.peek().map(|e| e.0).into_iter().chain(back.peek().map(|e| e.0)).min() {
                let value = |entry: Option<(u32, f32)>| entry.map_or(0.0, |(_, value)| f64::from(value));
                let sent = area[i] * value(there.next_if(|entry| entry.0 == j));
                let received = area[j as usize] * value(back.next_if(|entry| entry.0 == j));
                // Who sees the back of a patch is not seen by it, unless parts of either stand before the other.
                let k = j as usize;
                if sent > 0.0 && from_behind(i, k) && (received == 0.0 || from_behind(k, i)) {
                    areas.found[2] += sent;
                    areas.columns.push(j | ONE_WAY);
                    areas.values.push(sent);
                } else if sent > 0.0 || !from_behind(k, i) {
                    areas.found[0] += (sent - received).abs();
                    areas.found[1] += sent + received;
                    areas.columns.push(j);
                    areas.values.push(0.5 * (sent + received));
                }
            }
            areas.starts.push(areas.columns.len());
            let Elsewhere { surroundings, backs } = row.elsewhere();
            areas.elsewhere.push([surroundings * area[i], backs * area[i]]);
        }
        areas
    }

    /// By how much the form factors were off reciprocity: Σ |A_i F_ij - A_j F_ji| / Σ (A_i F_ij + A_j F_ji), 0 to 1, of all
    /// that is not seen on lit backs.
    pub fn imbalance(&self) -> f64 {
        let [apart, both, _] = self.found;
        if both > 0.0 { apart / both } else { 0.0 }
    }

    /// Of all energy exchanged, the share that is seen on lit backs.
    pub fn behind(&self) -> f64 {
        // Each exchange stands in two rows, and there counts both ways.
        let [_, both, behind] = self.found;
        if behind > 0.0 { behind / (0.5 * both + behind) } else { 0.0 }
    }

    /// How many patches.
    pub fn len(&self) -> usize {
        self.area.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.area.is_empty()
    }

    /// How many are stored: those of each pair twice.
    pub fn nonzeros(&self) -> usize {
        self.values.len()
    }

    /// (j, F_ij) of every patch that i exchanges energy with, in ascending order.
    pub fn row(&self, patch: usize) -> impl Iterator<Item = (u32, f64)> + '_ {
        let per_area = 1.0 / self.area[patch];
        self.entries(patch).map(move |(j, value)| (j & !ONE_WAY, value * per_area))
    }

    /// How many those are.
    pub fn row_len(&self, patch: usize) -> usize {
        self.starts[patch + 1] - self.starts[patch]
    }

    /// What of patch i's energy arrives at no patch.
    pub fn elsewhere(&self, patch: usize) -> Elsewhere {
        let [surroundings, backs] = self.elsewhere[patch].map(|part| part / self.area[patch]);
        Elsewhere { surroundings, backs }
    }

    /// (j, G_ij), j marked where it is seen from behind.
    fn entries(&self, patch: usize) -> impl Iterator<Item = (u32, f64)> + '_ {
        let range = self.starts[patch]..self.starts[patch + 1];
        self.columns[range.clone()].iter().copied().zip(self.values[range].iter().copied())
    }

    /// Of each row, found on the threads about; the bits do not depend on their number.
    fn each<T: Send>(&self, of: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        (0..self.len()).into_par_iter().with_min_len(ROWS_A_THREAD).map(of).collect()
    }

    /// What each row lacks of its patch's area.
    fn lacks(&self) -> Vec<f64> {
        let lack = |i: usize| {
            let [surroundings, backs] = self.elsewhere[i];
            self.area[i] - self.entries(i).map(|(_, value)| value).sum::<f64>() - surroundings - backs
        };
        self.each(lack)
    }

    /// The greatest |1 - Σ_j F_ij - elsewhere| of any patch.
    pub fn closure_error(&self) -> f64 {
        greatest_share(&self.lacks(), &self.area)
    }

    /// Correct the areas to closure, as the head of this file tells. In a closed scene every row then sums to 1 to within the
    /// rounding of a sum (1e-14); G_ij = G_ji still, and what was zero is.
    ///
    /// Rows are shared among the threads of the rayon pool it is called in; their number does not change a bit.
    pub fn close(&mut self) -> Closing {
        let found = self.values.clone();
        let mut lacks = self.lacks();
        let before = greatest_share(&lacks, &self.area);
        let mut closing = Closing { rounds: 0, before, after: before, greatest_change: 0.0 };
        while closing.after > REACHED && closing.rounds < MOST_ROUNDS {
            let mut lambda = self.multipliers(&lacks);
            let least = self.least_correction(&lambda);
            if least < LEAST_LEFT - 1.0 {
                lambda.iter_mut().for_each(|lambda| *lambda *= (LEAST_LEFT - 1.0) / least);
            }
            self.correct(&lambda, |value, factor| value * factor);
            lacks = self.lacks();
            let after = greatest_share(&lacks, &self.area);
            if after >= closing.after {
                // No correction closes the rows any better.
                self.correct(&lambda, |value, factor| value / factor);
                break;
            }
            closing.after = after;
            closing.rounds += 1;
        }
        let changes = self.values.iter().zip(&found).map(|(value, found)| (value / found - 1.0).abs());
        closing.greatest_change = changes.fold(0.0, f64::max);
        closing
    }

    /// The least λ_i + λ_j of an exchange, or λ_i of what goes elsewhere.
    fn least_correction(&self, lambda: &[f64]) -> f64 {
        let of = |i: usize| {
            self.entries(i).fold(lambda[i], |least, (j, _)| least.min(lambda[i] + other(lambda, j)))
        };
        self.each(of).into_iter().fold(0.0, f64::min)
    }

    /// Correct each area by its factor 1 + λ_i + λ_j, or 1 + λ_i. The same for (i, j) and for (j, i), for the sum of two
    /// numbers is.
    fn correct(&mut self, lambda: &[f64], by: impl Fn(f64, f64) -> f64 + Sync) {
        let Self { starts, columns, values, elsewhere, .. } = self;
        let mut left = &mut values[..];
        let mut rows = Vec::with_capacity(lambda.len());
        for (elsewhere, ends) in elsewhere.iter_mut().zip(starts.windows(2)) {
            let (row, behind) = std::mem::take(&mut left).split_at_mut(ends[1] - ends[0]);
            rows.push((elsewhere, &columns[ends[0]..ends[1]], row));
            left = behind;
        }
        let rows = rows.into_par_iter().with_min_len(ROWS_A_THREAD).zip(lambda);
        rows.for_each(|((elsewhere, columns, values), &own)| {
            *elsewhere = elsewhere.map(|part| by(part, 1.0 + own));
            for (value, &j) in values.iter_mut().zip(columns) {
                *value = by(*value, 1.0 + (own + other(lambda, j)));
            }
        });
    }

    /// λ, by conjugate gradients scaled by the diagonal; 0 where a patch exchanges energy with nothing.
    fn multipliers(&self, lacks: &[f64]) -> Vec<f64> {
        let n = self.len();
        let diagonal = self.each(|i| {
            let [surroundings, backs] = self.elsewhere[i];
            surroundings + backs + self.entries(i).map(|(_, value)| value).sum::<f64>()
        });
        let scaled = |r: &[f64]| -> Vec<f64> {
            r.iter().zip(&diagonal).map(|(&r, &d)| if d > 0.0 { r / d } else { 0.0 }).collect()
        };
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut lambda = vec![0.0; n];
        let mut residual: Vec<f64> =
            lacks.iter().zip(&diagonal).map(|(&r, &d)| if d > 0.0 { r } else { 0.0 }).collect();
        let mut direction = scaled(&residual);
        let mut size = dot(&residual, &direction);
        let enough = size * 1e-28;
        for _ in 0..MOST_STEPS {
            if size <= enough {
                break;
            }
            let image = self.each(|i| {
                let others = self.entries(i).map(|(j, value)| value * other(&direction, j));
                diagonal[i] * direction[i] + others.sum::<f64>()
            });
            let curvature = dot(&direction, &image);
            let step = size / curvature;
            if !step.is_finite() {
                break;
            }
            for i in 0..n {
                lambda[i] += step * direction[i];
                residual[i] -= step * image[i];
            }
            let bounce = scaled(&residual);
            let new = dot(&residual, &bounce);
            let turn = new / size;
            size = new;
            for (direction, bounce) in direction.iter_mut().zip(bounce) {
                *direction = bounce + turn * *direction;
            }
        }
        lambda
    }

    /// As form factors, rounded to the single precision that solvers read.
    pub fn form_factors(&self) -> FormFactors {
        let memory = || (vec![0.0; self.len()], Packing::default());
        let rows = (0..self.len()).into_par_iter().with_min_len(ROWS_A_THREAD);
        let rows = rows.map_init(memory, |(full, packing), i| {
            self.row(i).for_each(|(j, factor)| full[j as usize] = factor);
            Row::take_dense(full, packing).with_elsewhere(self.elsewhere(i))
        });
        FormFactors::from_rows(rows.collect())
    }
}

/// What stands at the other end of an exchange; 0 where it is one-way.
fn other(of: &[f64], column: u32) -> f64 {
    if column & ONE_WAY == 0 { of[column as usize] } else { 0.0 }
}

/// The greatest |part / whole|.
fn greatest_share(parts: &[f64], wholes: &[f64]) -> f64 {
    parts.iter().zip(wholes).map(|(part, whole)| (part / whole).abs()).fold(0.0, f64::max)
}
