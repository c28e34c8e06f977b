//! What a patch hides that sends light as if it were equally bright all over.
//!
//! Where more light arrives on a patch it may see other things than where less does: under a lamp that lies close below a ceiling the
//! ceiling is bright, and sees hardly anything but the lamp. What so arrives at patch k unknown to the answer is, by the
//! reciprocity of places, A_i / A_k ρ_i times the covariance, over patch i, of what arrives at a place and what the place
//! sees of k. Four places know both, by a hemicube each.
//!
//! It is the error where it arises, with its sign, and no level coarser is asked. What two places do not tell apart stays
//! hidden, and so does what a patch sends from a lit back.

use glam::DVec3;

use super::looks::{area, pieces_of};
use crate::form_factors::{LightBlocks, Row};
use crate::light::Rgb;
use crate::patches::{Patches, Pieces};

/// How many places a patch is looked out from.
pub const PLACES: usize = 4;

/// Where they are, in eighths of the patch from its middle: no two as far along either side, so that an edge that runs along a side,
/// as a wall's or a shelf's does, parts them wherever it runs.
const AT: [[f64; 2]; PLACES] = [[3.0, 1.0], [-1.0, 3.0], [-3.0, -1.0], [1.0, -3.0]];

/// The variance of what changes evenly along a side, 1/12 of its square, over that of the places.
const SPREAD: f64 = 16.0 / 15.0;

/// The patches with their centres moved to each of the places; where they are curved their normals are those of the piece that the
/// place lies on.
#[derive(Clone, Debug)]
pub struct Places([Patches; PLACES]);

impl Places {
    /// On these patches.
    pub fn new(patches: &Patches) -> Self {
        let mut places = std::array::from_fn(|_| patches.clone());
        for (block, pieces) in patches.blocks.iter().zip(&patches.pieces) {
            let of_patch = pieces.as_ref().map(|pieces| pieces_of(block, pieces));
            for i in block.patches() {
                for (moved, at) in places.iter_mut().zip(AT) {
                    // Mirrored from patch to patch.
                    let [u, v] = if i.is_multiple_of(2) { at } else { [at[1], at[0]] }.map(|at| at / 8.0);
                    (moved.centre[i], moved.normal[i]) = match (pieces, &of_patch) {
                        (Some(pieces), Some(of_patch)) => {
                            on_pieces(patches, i, pieces, &of_patch[i - block.first as usize], [u, v])
                        }
                        _ => {
                            let step = patches.tangent_u[i] * u + patches.tangent_v[i] * v;
                            (patches.centre[i] + step, patches.normal[i])
                        }
                    };
                }
            }
        }
        Self(places)
    }

    /// The patches, moved to each of the places.
    pub fn each(&self) -> &[Patches; PLACES] {
        &self.0
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

    /// What patch i hides: `rows` are what it sees from each of the `places`, lit by `light` and, from beyond, by the surroundings.
    pub fn add(
        &mut self,
        places: &Places,
        i: usize,
        rows: [&Row; PLACES],
        light: &LightBlocks,
        surroundings: Rgb,
    ) {
        let arrives = rows.map(|row| row.gather_blocks(light) + surroundings * row.elsewhere().surroundings);
        let mean = arrives.into_iter().sum::<Rgb>() * (PLACES as f64).recip();
        for ((moved, row), arrives) in places.0.iter().zip(rows).zip(arrives) {
            let share = moved.area[i] * SPREAD / PLACES as f64;
            let sent = moved.reflectance[i] * (arrives - mean) * share;
            for (k, seen) in row.iter() {
                // A back is seen where backs are lit, but nothing arrives at a patch from behind it.
                if !moved.is_behind(i, k) {
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
