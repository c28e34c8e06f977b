//! What a patch hides that sends light as if it were equally bright all over.
//!
//! Where more light arrives on a patch it may see other things than where less does: under a lamp that lies close below a ceiling the
//! ceiling is bright, and sees hardly anything but the lamp. What so arrives at patch k unknown to the answer is, by the
//! reciprocity of places, A_i / A_k ρ_i times the covariance, over patch i, of what arrives at a place and what the place
//! sees of k. A few places on it know both, by a hemicube each.
//!
//! It is the error where it arises, with its sign, and no level coarser is asked: told as an error, or taken away (\[Sloan76\]: an
//! answer put into the exact equation once more is of a higher order). What two places do not tell apart stays
//! hidden, and so does what a patch sends from a lit back.
//!
//! \[Sloan76\] Sloan, Improvement by Iteration for Compact Operator Equations, 1976.

use glam::DVec3;

use super::looks::{area, pieces_of};
use crate::form_factors::hemicube::{Eye, axes_about};
use crate::form_factors::{LightBlocks, Row};
use crate::light::Rgb;
use crate::patches::{Patches, Pieces};

/// Places on a patch, as far from its middle along both sides as these are of the last number: turned about it by quarters, and
/// no two as far along either side, so that an edge that runs along a side, as a wall's or a shelf's does, parts them wherever it
/// runs.
const FOUR: ([[f64; 2]; 4], f64) = ([[3.0, 1.0], [-1.0, 3.0], [-3.0, -1.0], [1.0, -3.0]], 8.0);

/// Likewise.
const EIGHT: ([[f64; 2]; 8], f64) = (
    [[7.0, 3.0], [-3.0, 7.0], [-7.0, -3.0], [3.0, -7.0], [5.0, -1.0], [1.0, 5.0], [-5.0, 1.0], [-1.0, -5.0]],
    16.0,
);

/// Places on each patch to look out from; where it is curved the normals there are those of the piece that the place lies on.
#[derive(Clone, Debug)]
pub struct Places<'a> {
    patches: &'a Patches,
    /// Of each patch that is made of triangles, which.
    pieces: Vec<Vec<usize>>,
    at: &'static [[f64; 2]],
    of: f64,
}

impl<'a> Places<'a> {
    /// Four on each of these patches.
    pub fn four(patches: &'a Patches) -> Self {
        Self::new(patches, &FOUR.0, FOUR.1)
    }

    /// Eight on each, and none of those four.
    pub fn eight(patches: &'a Patches) -> Self {
        Self::new(patches, &EIGHT.0, EIGHT.1)
    }

    fn new(patches: &'a Patches, at: &'static [[f64; 2]], of: f64) -> Self {
        let mut pieces = vec![Vec::new(); patches.len()];
        for (block, of_surface) in patches.blocks.iter().zip(&patches.pieces) {
            if let Some(of_surface) = of_surface {
                pieces[block.patches()].clone_from_slice(&pieces_of(block, of_surface));
            }
        }
        Self { patches, pieces, at, of }
    }

    /// How many there are on each patch.
    pub fn count(&self) -> usize {
        self.at.len()
    }

    /// The patches.
    pub fn patches(&self) -> &'a Patches {
        self.patches
    }

    /// The k-th of patch i.
    pub fn of(&self, i: usize, k: usize) -> Eye {
        let patches = self.patches;
        let at = self.at[k];
        // Mirrored from patch to patch.
        let [u, v] = if i.is_multiple_of(2) { at } else { [at[1], at[0]] }.map(|at| at / self.of);
        let (point, normal) = match &patches.pieces[patches.surface[i] as usize] {
            Some(pieces) => on_pieces(patches, i, pieces, &self.pieces[i], [u, v]),
            None => {
                let step = patches.tangent_u[i] * u + patches.tangent_v[i] * v;
                (patches.centre[i] + step, patches.normal[i])
            }
        };
        Eye { point, axes: axes_about(normal, patches.tangent_u[i]) }
    }

    /// The variance of what changes evenly along a side, 1/12 of its square, over that of the places.
    fn spread(&self) -> f64 {
        1.0 / (1.0 - (self.count() as f64).powi(-2))
    }
}

/// The place that a unit square's point goes to when the square is bent to cover the pieces, evenly, and the normal there.
fn on_pieces(patches: &Patches, i: usize, pieces: &Pieces, own: &[usize], at: [f64; 2]) -> (DVec3, DVec3) {
    let [s, t] = at.map(|at| at + 0.5);
    let all: f64 = own.iter().map(|&piece| area(pieces, piece).length()).sum();
    let mut left = s * all;
    for &piece in own {
        let normal = area(pieces, piece);
        let size = normal.length();
        if left < size {
            let [a, b, c] = pieces.triangles[piece];
            let root = (left / size).sqrt();
            let place = a + (b - a) * (root * (1.0 - t)) + (c - a) * (root * t);
            return (place, normal.normalize_or(patches.normal[i]));
        }
        left -= size;
    }
    (patches.centre[i], patches.normal[i])
}

/// What patches hide, as power that arrives at those who are not told; gathered one sender after another, in the same order for the
/// same bits.
#[derive(Clone, Debug)]
pub struct Hidden(Vec<Rgb>);

impl Hidden {
    /// Nothing yet, of `count` patches.
    pub fn new(count: usize) -> Self {
        Self(vec![Rgb::BLACK; count])
    }

    /// What patch i hides: `rows` are what it sees from each of its `places`, lit by `light` and, from beyond, by the surroundings.
    pub fn add(
        &mut self,
        places: &Places<'_>,
        i: usize,
        rows: &[Row],
        light: &LightBlocks,
        surroundings: Rgb,
    ) {
        let patches = places.patches;
        let arrives = |row: &Row| row.gather_blocks(light) + surroundings * row.elsewhere().surroundings;
        let arrives: Vec<Rgb> = rows.iter().map(arrives).collect();
        let per_place = (rows.len() as f64).recip();
        let mean = arrives.iter().copied().sum::<Rgb>() * per_place;
        let share = patches.area[i] * places.spread() * per_place;
        for (number, (row, arrives)) in rows.iter().zip(arrives).enumerate() {
            let eye = places.of(i, number);
            let sent = patches.reflectance[i] * (arrives - mean) * share;
            for (k, seen) in row.iter() {
                // A back is seen where backs are lit, but nothing arrives at a patch from behind it.
                if !patches.turns_its_back(k, eye.point) {
                    self.0[k] += sent * seen;
                }
            }
        }
    }

    /// The irradiance that the answer lacks of each patch, and where it has too much below 0.
    pub fn irradiance(self, patches: &Patches) -> Vec<Rgb> {
        self.0.iter().zip(&patches.area).map(|(&power, area)| power * area.recip()).collect()
    }
}
