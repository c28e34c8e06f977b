//! How bright a picture should be, found from the solution.

use crate::light::Rgb;
use crate::patches::Patches;

/// Where the middle of a scene is put: the log-average of its lit area. The 18 % grey that photographers meter on.
const MIDDLE: f64 = 0.18;
/// Where the bright end of a scene is put: the tone curves leave colours true below it.
const BRIGHT: f64 = 0.8;
/// Which share of the lit area is darker than the bright end.
const BRIGHT_SHARE: f64 = 0.95;
/// How far the bright end may pull the exposure below and above the middle's. Less down than up: a room lit from a cove
/// or a doorway may burn out there, but must be seen. \[stops\]
const LEEWAY: [f64; 2] = [0.75, 1.5];

/// The exposure, in stops (EV), that shows `radiosity` well: a picture's values are multiplied by 2^EV. It is asked of
/// the patches and not of a picture, so walking about does not change it.
///
/// Let B be a patch's brightest channel. Emitters are left out, for nobody wants the room black so that the lamp can be
/// grey; so are patches that no light reaches. Of the rest, by area,
///
/// ```text
/// EV_middle = log2(0.18 / exp(mean of ln B))           Reinhard et al. 2002, eq. 1, with their key of 0.18
/// EV_bright = log2(0.8 / B95)                           B95: 95 % of the area is darker
/// EV        = EV_bright, but within EV_middle - 0.75 and EV_middle + 1.5
/// ```
///
/// so that in an evenly lit room nearly every colour stays below 0.8, where tone curves leave it true, while a spot of
/// sunlight on one wall may burn out rather than drown the room. Values below B95 / 1000 count as that. Where nothing
/// but emitters is lit they are what one sees, and count. 0 where all is black.
///
/// # Panics
///
/// Where `radiosity` and `patches` differ in length.
pub fn automatic_exposure(patches: &Patches, radiosity: &[Rgb]) -> f64 {
    assert_eq!(radiosity.len(), patches.len(), "one radiosity a patch");
    let lit = |emitters: bool| -> Vec<(f64, f64)> {
        (0..patches.len())
            .filter(|&i| emitters || patches.emission[i].is_black())
            .map(|i| (radiosity[i].max_channel(), patches.area[i]))
            .filter(|&(value, area)| value.is_finite() && value > 0.0 && area.is_finite() && area > 0.0)
            .collect()
    };
    let mut samples = lit(false);
    if samples.is_empty() {
        samples = lit(true);
    }
    if samples.is_empty() {
        return 0.0;
    }

    // Equal values may come in any order: their areas add to the same.
    samples.sort_by(|one, other| one.0.total_cmp(&other.0));
    let total: f64 = samples.iter().map(|&(_, area)| area).sum();
    let mut darker = 0.0;
    let bright = samples
        .iter()
        .find(|&&(_, area)| {
            darker += area;
            darker >= BRIGHT_SHARE * total
        })
        .unwrap_or(&samples[samples.len() - 1])
        .0;
    let log_mean =
        samples.iter().map(|&(value, area)| value.max(bright / 1000.0).ln() * area).sum::<f64>() / total;

    let middle_stops = (MIDDLE / log_mean.exp()).log2();
    let bright_stops = (BRIGHT / bright).log2();
    bright_stops.clamp(middle_stops - LEEWAY[0], middle_stops + LEEWAY[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn patches(areas: &[f64], emitters: &[usize]) -> Patches {
        let mut emission = vec![Rgb::BLACK; areas.len()];
        for &emitter in emitters {
            emission[emitter] = Rgb::grey(50.0);
        }
        Patches { area: areas.to_vec(), emission, ..Patches::default() }
    }

    #[test]
    fn black_is_zero() {
        assert_eq!(automatic_exposure(&Patches::default(), &[]), 0.0);
        assert_eq!(automatic_exposure(&patches(&[1.0, 2.0], &[0]), &[Rgb::BLACK; 2]), 0.0);
    }

    #[test]
    fn emitters_do_not_count() {
        let patches = patches(&[1.0, 1.0, 0.5], &[2]);
        let room = |lamp| automatic_exposure(&patches, &[Rgb::grey(0.1), Rgb::grey(0.4), Rgb::grey(lamp)]);
        assert_eq!(room(10.0), room(1e6));
        assert!((room(10.0) - (0.8_f64 / 0.4).log2()).abs() < 1e-12);
    }

    #[test]
    fn it_follows_the_light() {
        let patches = patches(&[1.0, 3.0, 2.0], &[]);
        let values = [0.1, 0.5, 0.7].map(Rgb::grey);
        let eight_times = values.map(|value| value * 8.0);
        let change = automatic_exposure(&patches, &eight_times) - automatic_exposure(&patches, &values);
        assert!((change + 3.0).abs() < 1e-12);
    }

    #[test]
    fn only_areas_count_not_how_they_are_cut() {
        let coarse = automatic_exposure(&patches(&[2.0, 1.0], &[]), &[0.1, 0.7].map(Rgb::grey));
        let fine =
            automatic_exposure(&patches(&[1.0, 1.0, 0.5, 0.5], &[]), &[0.1, 0.1, 0.7, 0.7].map(Rgb::grey));
        assert!((coarse - fine).abs() < 1e-12);
    }

    #[test]
    fn a_pool_of_light_does_not_drown_the_room() {
        let patches = patches(&[9.0, 1.0], &[]);
        let ev = automatic_exposure(&patches, &[0.01, 1.0].map(Rgb::grey));
        assert!(0.01 * ev.exp2() > 0.03, "the room stays visible: {ev}");
    }

    #[test]
    fn alone_an_emitter_counts() {
        let ev = automatic_exposure(&patches(&[1.0], &[0]), &[Rgb::grey(20.0)]);
        let shown = 20.0 * ev.exp2();
        assert!(shown > 0.3 && shown <= 0.8, "{shown}");
    }

    #[test]
    fn what_is_no_number_is_passed_over() {
        let ev = automatic_exposure(&patches(&[1.0, 1.0], &[]), &[Rgb::grey(f64::NAN), Rgb::grey(0.8)]);
        assert!(ev.is_finite());
    }
}
