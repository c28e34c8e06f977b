//! From linear light to the eight bits of a screen.
//!
//! \[K24\] Khronos Group, PBR Neutral Tone Mapper, specification, 2024
//!       (github.com/KhronosGroup/ToneMapping, PBR_Neutral).
//! \[R02\] Reinhard, Stark, Shirley, Ferwerda, Photographic Tone Reproduction for Digital Images, SIGGRAPH 2002.

use rayon::prelude::*;

use super::picture::{Picture, ScreenPicture};
pub use crate::light::{linear_from_srgb, srgb_from_linear};

/// How the range above white, which a screen cannot show, is brought down to it. Each curve takes black to black, is
/// monotone, and stays within 0..1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneCurve {
    /// Colours are true as long as their brightest channel is below 0.8; above, hue is kept and brightness compressed,
    /// turning to white only far beyond: the shoulder and the desaturation of Khronos' PBR Neutral \[K24\].
    ///
    /// Its toe is left out. It takes away 0.04, the mirror reflection of a common dielectric, which a purely diffuse
    /// world does not have; here it would only crush the dark corners (0.02 would become 0.0025).
    #[default]
    Neutral,
    /// Reinhard's operator on luminance, with burn-out: L (1 + L / Lw²) / (1 + L), \[R02\] eq. 4, where Lw = 4 is the
    /// least luminance shown white. Colours keep their ratios; a channel that ends beyond 1 is clipped.
    Reinhard,
    /// Nothing is compressed: what is beyond 1 is clipped, channel by channel. For measuring, not for looking.
    Linear,
}

impl ToneCurve {
    /// All of them, the default first.
    pub const ALL: [Self; 3] = [Self::Neutral, Self::Reinhard, Self::Linear];

    /// Its name in a command or a menu.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Neutral => "neutral",
            Self::Reinhard => "reinhard",
            Self::Linear => "linear",
        }
    }

    /// The colour, in linear light, that the screen shows for `colour`: each channel in 0..1, for whatever comes.
    #[inline]
    pub fn apply(self, colour: [f32; 3]) -> [f32; 3] {
        // No number is no light; and what is brighter than any lamp must not overflow below.
        #[expect(clippy::manual_clamp, reason = "max takes NaN to 0, clamp would keep it")]
        let colour = colour.map(|value| value.max(0.0).min(1e9));
        let shown = match self {
            Self::Neutral => neutral(colour),
            Self::Reinhard => reinhard(colour),
            Self::Linear => colour,
        };
        shown.map(|value| value.min(1.0))
    }
}

/// Where compression begins (K_s of \[K24\], before its Fresnel term is taken off).
const START_COMPRESSION: f32 = 0.8;
/// How fast bright colours turn to white (K_d of \[K24\]).
const DESATURATION: f32 = 0.15;

#[inline]
fn neutral(colour: [f32; 3]) -> [f32; 3] {
    let peak = colour[0].max(colour[1]).max(colour[2]);
    if peak < START_COMPRESSION {
        return colour;
    }
    let d = 1.0 - START_COMPRESSION;
    let new_peak = 1.0 - d * d / (peak + d - START_COMPRESSION);
    let g = 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    let scale = new_peak / peak;
    colour.map(|value| new_peak + (value * scale - new_peak) * g)
}

/// The least luminance that Reinhard's curve shows white (L_white of \[R02\]): two stops above 1.
const REINHARD_WHITE: f32 = 4.0;

#[inline]
fn reinhard(colour: [f32; 3]) -> [f32; 3] {
    let luminance = 0.2126 * colour[0] + 0.7152 * colour[1] + 0.0722 * colour[2];
    let scale = (1.0 + luminance / (REINHARD_WHITE * REINHARD_WHITE)) / (1.0 + luminance);
    colour.map(|value| value * scale)
}

/// Exposure and curve: what stands between a picture in linear light and a screen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToneMap {
    /// Values are multiplied by 2^exposure. \[stops, EV\]
    pub exposure: f64,
    /// Then this brings them into 0..1.
    pub curve: ToneCurve,
}

impl ToneMap {
    /// The colour, in linear light, that the screen shows for `colour`.
    pub fn apply(self, colour: [f32; 3]) -> [f32; 3] {
        self.develop()(colour)
    }

    /// [`ToneMap::apply`] for many colours: 2^exposure is taken once.
    pub(super) fn develop(self) -> impl Fn([f32; 3]) -> [f32; 3] + Sync {
        let scale = self.exposure.exp2() as f32;
        move |colour| self.curve.apply(colour.map(|value| value * scale))
    }
}

/// A colour in linear light as three bytes of sRGB, to the nearest.
#[inline]
pub(super) fn bytes(shown: [f32; 3]) -> [u8; 3] {
    shown.map(|value| (srgb_from_linear(value) * 255.0 + 0.5) as u8)
}

/// The picture as a screen shows it: times 2^exposure, through the curve, in sRGB, rounded to eight bits.
///
/// There is no dither: equal light gives equal bytes, whatever the place, so that pictures can be compared.
pub fn tone_map(picture: &Picture, tone: ToneMap) -> ScreenPicture {
    let develop = tone.develop();
    ScreenPicture {
        width: picture.width,
        height: picture.height,
        pixels: picture.pixels.par_iter().map(|&colour| bytes(develop(colour))).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const fn grey(value: f32) -> [f32; 3] {
        [value; 3]
    }

    #[test]
    fn srgb_has_the_values_of_the_standard() {
        // The usual table: mid grey 0.2140 is code 0.5; 18 % is 118; the two pieces meet.
        assert!((srgb_from_linear(0.214_041_14) - 0.5).abs() < 1e-6);
        assert!((linear_from_srgb(0.5) - 0.214_041_14).abs() < 1e-6);
        assert_eq!(bytes(grey(0.18)), [118; 3]);
        assert_eq!(bytes([0.0, 1.0, 0.5]), [0, 255, 188]);
        assert_eq!(bytes([-1.0, f32::INFINITY, f32::NAN]), [0, 255, 0]);
        assert!((srgb_from_linear(0.003_130_8) - 0.040_449_936).abs() < 1e-7);
    }

    #[test]
    fn every_byte_comes_back() {
        for byte in 0..=255_u8 {
            assert_eq!(bytes(grey(linear_from_srgb(f32::from(byte) / 255.0))), [byte; 3]);
        }
    }

    #[test]
    fn neutral_has_the_shoulder_of_the_specification() {
        // Below 0.8 nothing happens.
        for colour in [grey(0.0), grey(0.02), [0.79, 0.1, 0.0], [0.3, 0.5, 0.7]] {
            assert_eq!(ToneCurve::Neutral.apply(colour), colour);
        }
        // By hand: peak 2, d 0.2: 1 - 0.04 / 1.4.
        let shown = ToneCurve::Neutral.apply(grey(2.0));
        assert!((shown[0] - (1.0 - 0.04 / 1.4)).abs() < 1e-6 && shown[0] == shown[1], "{shown:?}");
        // Saturated and bright: g = 1 - 1 / (0.15 (2 - 0.97142857) + 1) = 0.13365... of the way to grey.
        let [r, g, b] = ToneCurve::Neutral.apply([2.0, 0.0, 0.0]);
        assert!((r - 0.971_428_6).abs() < 1e-6 && g == b);
        assert!((g - 0.971_428_6 * (1.0 - 1.0 / (0.15 * (2.0 - 0.971_428_6) + 1.0))).abs() < 1e-6);
        // And it is continuous where it begins.
        let just_above = ToneCurve::Neutral.apply([0.800_01, 0.4, 0.2]);
        for (shown, expected) in just_above.iter().zip([0.8, 0.4, 0.2]) {
            assert!((shown - expected).abs() < 1e-4);
        }
    }

    #[test]
    fn reinhard_has_the_values_of_equation_4() {
        assert!((ToneCurve::Reinhard.apply(grey(1.0))[0] - 17.0 / 32.0).abs() < 1e-6);
        assert!((ToneCurve::Reinhard.apply(grey(4.0))[0] - 1.0).abs() < 1e-6);
        assert_eq!(ToneCurve::Reinhard.apply(grey(0.0)), grey(0.0));
    }

    #[test]
    fn exposure_counts_in_stops() {
        let tone = ToneMap { exposure: -2.0, curve: ToneCurve::Linear };
        assert_eq!(tone.apply([2.0, 1.0, 8.0]), [0.5, 0.25, 1.0]);
    }

    #[test]
    fn nothing_upsets_a_curve() {
        for curve in ToneCurve::ALL {
            for exposure in [-2000.0, 0.0, 2000.0] {
                for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -1.0, 0.0] {
                    let shown = ToneMap { exposure, curve }.apply([value, 1.0, 0.0]);
                    assert!(shown.iter().all(|v| (0.0..=1.0).contains(v)), "{curve:?} {value} {shown:?}");
                }
            }
        }
    }

    proptest! {
        #[test]
        fn curves_are_monotone_in_brightness(
            r in 0.0_f32..1.0, g in 0.0_f32..1.0, b in 0.0_f32..1.0, low in 0.0_f32..50.0, more in 1.0_f32..4.0,
        ) {
            for curve in ToneCurve::ALL {
                let dark = curve.apply([r, g, b].map(|value| value * low));
                let light = curve.apply([r, g, b].map(|value| value * low * more));
                for (dark, light) in dark.iter().zip(light) {
                    prop_assert!(light >= dark - 1e-6, "{curve:?}: {dark} then {light}");
                    prop_assert!((0.0..=1.0).contains(&light));
                }
            }
        }
    }
}
