//! Which patches are quartered: those that hold most of what patches hide.

use crate::estimate::Variation;
use crate::patches::{MOST_HALVINGS, Origin, Patches, Place};

/// At least and at most the worst patches are quartered that together hold this share of the squared error.
const SHARE: (f64, f64) = (0.15, 0.7);

/// What quartering a patch leaves of its squared error: a quarter where light changes evenly, a half at an edge.
const LEFT: f64 = 0.4;

/// Whether a patch counts in the error: emitters do not, unless all are.
pub(super) fn counted(patches: &Patches) -> impl Fn(usize) -> bool + '_ {
    let all_emit = !patches.emission.iter().any(|emission| emission.is_black());
    move |i| all_emit || patches.emission[i].is_black()
}

/// Whether a patch may be quartered, and there is something to gain by it.
fn may_be(patches: &Patches, origins: &[Origin], smallest: f64) -> impl Fn(usize) -> bool {
    let counted = counted(patches);
    let may = |i: usize| {
        counted(i)
            && patches.reflectance[i].max_channel() > 0.0
            && origins[i].place.halvings() < MOST_HALVINGS
            && patches.area[i].sqrt() >= 2.0 * smallest
    };
    let may: Vec<bool> = (0..patches.len()).map(may).collect();
    move |i| may[i]
}

/// The patches that nothing is known of unless they are quartered.
pub(super) fn alone(
    patches: &Patches,
    origins: &[Origin],
    variation: &Variation,
    smallest: f64,
) -> Vec<Place> {
    let may = may_be(patches, origins, smallest);
    let alone = variation.alone.iter().map(|&i| i as usize);
    // Once quartered, a part without neighbours is a sliver between lines.
    let whole = alone.filter(|&i| may(i) && origins[i].place.path == Place::WHOLE);
    whole.map(|i| origins[i].place).collect()
}

/// The places to be quartered, the worst first: of patches that are alone, all; of others no more than it takes, as far as can be
/// told beforehand, to leave the share `aim` of the squared error.
pub(super) fn worst(
    patches: &Patches,
    origins: &[Origin],
    variation: &Variation,
    smallest: f64,
    aim: f64,
) -> Vec<Place> {
    let (counted, may) = (counted(patches), may_be(patches, origins, smallest));
    let error = |i: usize| patches.area[i] * variation.radiosity[i].norm_squared();
    let all: f64 = (0..patches.len()).filter(|&i| counted(i)).map(error).sum();
    let mut order: Vec<(f64, usize)> = (0..patches.len())
        .filter(|&i| may(i))
        .map(|i| (error(i), i))
        .filter(|(error, _)| *error > 0.0)
        .collect();
    order.sort_by(|one, other| other.0.total_cmp(&one.0).then(one.1.cmp(&other.1)));
    let mut chosen = alone(patches, origins, variation, smallest);
    let enough = all * ((1.0 - aim) / (1.0 - LEFT)).clamp(SHARE.0, SHARE.1);
    let mut held = 0.0;
    for (error, i) in order {
        if held > enough {
            break;
        }
        held += error;
        chosen.push(origins[i].place);
    }
    chosen
}
