//! By how much light varies within patches: what one value a patch hides of it.
//!
//! Light that changes across a patch has changed half as much at the edge between it and a neighbour as from the one's middle to
//! the other's. Of a square across which it changes evenly the mean square of what its value hides is a sixth of the sum of what
//! it is off at the four edges, squared; a shadow's edge hides up to thrice as much. A quarter is taken.

use std::collections::HashMap;

use glam::DVec3;

use crate::light::Rgb;
use crate::patches::{Patches, Pieces};
use crate::solve::Solution;

/// Within a surface that is not smooth by nature, patches on either side of an edge that bends by more than this are no neighbours:
/// the cosine of 40 degrees, as of smooth shading.
const CREASE: f64 = 0.766_044_443_118_978;

/// What one value a patch does not show.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Variation {
    /// For each patch, the root of the mean square over it of B - its mean. \[power per area\]
    pub radiosity: Vec<Rgb>,
    /// The patches that have no neighbours: of them nothing is known.
    pub alone: Vec<u32>,
}

impl Variation {
    /// Of the radiosities of an answer.
    pub fn new(patches: &Patches, solution: &Solution) -> Self {
        let mut sums = vec![(Rgb::BLACK, 0.0); patches.len()];
        let mut meet = |one: usize, other: usize, reaches: [f64; 2], length: f64| {
            let change = solution.irradiance[other] - solution.irradiance[one];
            let across = (reaches[0] + reaches[1]).max(f64::MIN_POSITIVE);
            for (patch, reach) in [(one, reaches[0]), (other, reaches[1])] {
                let off = patches.reflectance[patch] * change * (reach / across);
                sums[patch].0 += off * off * length;
                sums[patch].1 += length;
            }
        };
        for (block, pieces) in patches.blocks.iter().zip(&patches.pieces) {
            match pieces {
                Some(pieces) => over_edges(patches, pieces, &mut meet),
                None => {
                    for i in block.patches() {
                        let k = (i - block.patches().start) as u32;
                        let [along_u, along_v] =
                            [patches.tangent_u[i], patches.tangent_v[i]].map(DVec3::length);
                        if !(k + 1).is_multiple_of(block.columns) {
                            meet(i, i + 1, [0.5 * along_u; 2], along_v);
                        }
                        if k / block.columns + 1 < block.rows {
                            meet(i, i + block.columns as usize, [0.5 * along_v; 2], along_u);
                        }
                    }
                }
            }
        }
        let root = |(sum, length): &(Rgb, f64)| {
            let mean = *sum * (1.0 / length.max(f64::MIN_POSITIVE));
            Rgb::new(mean.r.sqrt(), mean.g.sqrt(), mean.b.sqrt())
        };
        let radiosity = sums.iter().map(root).collect();
        let alone = (0..).zip(&sums).filter(|(_, (_, length))| *length == 0.0).map(|(i, _)| i).collect();
        Self { radiosity, alone }
    }
}

/// Each edge of a surface's pieces between two patches that are neighbours: both, how far their centres are from it, and its
/// length.
fn over_edges(patches: &Patches, pieces: &Pieces, meet: &mut impl FnMut(usize, usize, [f64; 2], f64)) {
    let key = |p: DVec3| (p + DVec3::ZERO).to_array().map(f64::to_bits);
    let normal = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).normalize_or_zero();
    let mut open: HashMap<[[u64; 3]; 2], Vec<usize>> = HashMap::new();
    for (piece, triangle) in pieces.triangles.iter().enumerate() {
        for k in 0..3 {
            let sharp = pieces.sharp.get(piece).is_some_and(|sharp| sharp >> k & 1 == 1);
            let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
            if sharp || a == b {
                continue;
            }
            let ends = [key(a), key(b)];
            let before = open.entry([ends[0].min(ends[1]), ends[0].max(ends[1])]).or_default();
            for &other in before.iter() {
                let [one, two] = [other, piece].map(|piece| pieces.patch[piece] as usize);
                let bends = || normal(pieces.triangles[other]).dot(normal(*triangle)) < CREASE;
                if one != two && (pieces.smooth || !bends()) {
                    let middle = (a + b) * 0.5;
                    meet(one, two, [one, two].map(|i| patches.centre[i].distance(middle)), a.distance(b));
                }
            }
            before.push(piece);
        }
    }
}
