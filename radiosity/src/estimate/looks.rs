//! A second look from within a patch: what a hemicube at its centre cannot know.
//!
//! Of the mean over a patch the value at its centre is off by the second moments of the light that arrives, and by what the
//! cells of that one hemicube happen to show. Two more, at opposite places and turned, know both: what changes
//! evenly across the patch cancels between them, and at the root of the second moment from the centre their mean is that of
//! the patch to the third order (Gauss's two points).

use glam::{DQuat, DVec3};

use super::groups::Groups;
use crate::patches::{Block, Patches, Pieces};

/// Two opposite places on each patch to look out from, and which of the patches do.
#[derive(Clone, Debug)]
pub struct Looks {
    /// The patches with their centres moved one way and their tangents turned; where they are curved their normals are those of
    /// the piece that the place lies on.
    pub one: Patches,
    /// The same with the opposite places.
    pub other: Patches,
    /// Every second patch of each few neighbours.
    pub wanted: Vec<u32>,
}

/// Of a parallelogram's diagonal, from its centre: what Gauss's points are at in a square.
const GAUSS: f64 = 0.288_675_134_594_812_9;

/// How far from its centroid to the corner that is farthest from the patch's centre the place on one of several pieces lies: at
/// Gauss's point where two right triangles make a square.
const ON_A_PIECE: f64 = 0.366;

/// Half a turn times this from patch to patch (the golden ratio's), so that neighbours' cells show different things.
const TURN: f64 = 0.618_033_988_749_895;

/// How often a place that lies beside the patch is brought nearer to the centre.
const TRIALS: u32 = 6;

/// A piece is in the plane of its patch where their normals are as near as this.
const FLAT: f64 = 1e-9;

impl Looks {
    /// For these patches.
    pub fn new(patches: &Patches) -> Self {
        let (mut one, mut other) = (patches.clone(), patches.clone());
        for (block, pieces) in patches.blocks.iter().zip(&patches.pieces) {
            let of_patch = pieces.as_ref().map(|pieces| pieces_of(block, pieces));
            for i in block.patches() {
                let places = match (pieces, &of_patch) {
                    (Some(pieces), Some(of_patch)) => {
                        on_pieces(patches, i, pieces, &of_patch[i - block.first as usize])
                    }
                    _ => along(patches, i),
                };
                for (k, (moved, (place, normal))) in
                    [&mut one, &mut other].into_iter().zip(places).enumerate()
                {
                    moved.centre[i] = place;
                    moved.normal[i] = normal;
                    let turns = (2 * i + k + 1) as f64 * TURN;
                    let turn = DQuat::from_axis_angle(normal, std::f64::consts::PI * turns.fract());
                    moved.tangent_u[i] = turn * patches.tangent_u[i];
                }
            }
        }
        let few = Groups::new(patches, 2);
        // Of two by two cells, those on a diagonal.
        let chosen = few.iter().flat_map(|group| {
            group.iter().enumerate().filter(|(k, _)| matches!(k, 0 | 3)).map(|(_, &patch)| patch)
        });
        let mut wanted: Vec<u32> = chosen.collect();
        wanted.sort_unstable();
        Self { one, other, wanted }
    }
}

/// Which pieces each patch of the surface is made of.
pub(super) fn pieces_of(block: &Block, pieces: &Pieces) -> Vec<Vec<usize>> {
    let mut of_patch = vec![Vec::new(); block.patches().len()];
    for (piece, &patch) in pieces.patch.iter().enumerate() {
        of_patch[(patch - block.first) as usize].push(piece);
    }
    of_patch
}

/// Twice the area of a piece, along its normal.
pub(super) fn area(pieces: &Pieces, piece: usize) -> DVec3 {
    let [a, b, c] = pieces.triangles[piece];
    (b - a).cross(c - a)
}

/// A place and the normal there, twice.
type Places = [(DVec3, DVec3); 2];

/// On the diagonals of a cell, in turn.
fn along(patches: &Patches, i: usize) -> Places {
    let (u, v) = (patches.tangent_u[i], patches.tangent_v[i]);
    let step = (if i.is_multiple_of(2) { u + v } else { u - v }) * GAUSS;
    [1.0, -1.0].map(|sign| (patches.centre[i] + step * sign, patches.normal[i]))
}

fn on_pieces(patches: &Patches, i: usize, pieces: &Pieces, own: &[usize]) -> Places {
    let (centre, normal) = (patches.centre[i], patches.normal[i]);
    let area = |piece: usize| area(pieces, piece);
    if own.iter().any(|&piece| area(piece).normalize_or_zero().dot(normal) < 1.0 - FLAT) && own.len() > 1 {
        let mut largest: Vec<usize> = own.to_vec();
        largest.sort_by(|&a, &b| area(b).length().total_cmp(&area(a).length()).then(a.cmp(&b)));
        return [largest[0], largest[1]].map(|piece| {
            let corners = pieces.triangles[piece];
            let centroid = (corners[0] + corners[1] + corners[2]) / 3.0;
            let far = farthest(centre, &corners);
            (centroid + (far - centroid) * ON_A_PIECE, area(piece).normalize_or(normal))
        });
    }
    let corners: Vec<DVec3> = own.iter().flat_map(|&piece| pieces.triangles[piece]).collect();
    let out = farthest(centre, &corners) - centre;
    let mut length = (patches.area[i] / 6.0).sqrt().min(0.45 * out.length());
    let within = |place: DVec3| own.iter().any(|&piece| contains(&pieces.triangles[piece], normal, place));
    for _ in 0..TRIALS {
        let step = out.normalize_or_zero() * length;
        if within(centre + step) && within(centre - step) {
            return [1.0, -1.0].map(|sign| (centre + step * sign, normal));
        }
        length *= 0.7;
    }
    [(centre, normal); 2]
}

fn farthest(from: DVec3, points: &[DVec3]) -> DVec3 {
    let nearer = |a: &&DVec3, b: &&DVec3| from.distance(**a).total_cmp(&from.distance(**b));
    points.iter().max_by(nearer).copied().unwrap_or(from)
}

fn contains(corners: &[DVec3; 3], normal: DVec3, place: DVec3) -> bool {
    (0..3).all(|k| {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        (b - a).cross(place - a).dot(normal) >= 0.0
    })
}
