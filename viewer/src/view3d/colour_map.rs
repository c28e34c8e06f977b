//! False colours: from 0..1 to a colour on the screen.
//!
//! \[V15\] van der Walt & Smith, A better default colormap for Matplotlib, SciPy 2015: viridis, inferno; here by the
//!       degree-6 polynomials of Matt Zucker (shadertoy.com/view/WlfXRN, CC0), within 1 % of the tables.
//! \[M19\] Mikhailov, Turbo, an improved rainbow colormap for visualization, Google AI Blog, 2019, by the polynomial
//!       published with it (Apache-2.0): as even as the table, its two ends a little darker.

/// A scale of false colours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum ColourMap {
    /// Dark blue over green to yellow. Its lightness rises evenly, for colour-blind eyes and in print too \[V15\].
    #[default]
    Viridis,
    /// Black over red to pale yellow, as of glowing iron: the dark end stays dark \[V15\].
    Inferno,
    /// The rainbow that lighting programs show, evened out \[M19\]. It separates more steps; its lightness misleads.
    Turbo,
    /// Black to white.
    Grey,
}

impl ColourMap {
    /// All of them, the default first.
    pub(crate) const ALL: [Self; 4] = [Self::Viridis, Self::Inferno, Self::Turbo, Self::Grey];

    /// Its name in a menu.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Viridis => "viridis",
            Self::Inferno => "inferno",
            Self::Turbo => "turbo",
            Self::Grey => "grey",
        }
    }

    /// The colour, in sRGB, of `t` in 0..1; what lies outside is clamped, what is no number is 0.
    pub(crate) fn rgb(self, t: f32) -> [u8; 3] {
        #[expect(clippy::manual_clamp, reason = "max takes NaN to 0, clamp would keep it")]
        let t = t.max(0.0).min(1.0);
        let colour = match self {
            Self::Viridis => polynomial(&VIRIDIS, t),
            Self::Inferno => polynomial(&INFERNO, t),
            Self::Turbo => polynomial(&TURBO, t),
            Self::Grey => [t; 3],
        };
        colour.map(|value| (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8)
    }
}

/// Horner's scheme, the constant first in the table.
fn polynomial(coefficients: &[[f32; 3]], t: f32) -> [f32; 3] {
    coefficients.iter().rev().fold([0.0; 3], |sum, c| std::array::from_fn(|k| sum[k] * t + c[k]))
}

const VIRIDIS: [[f32; 3]; 7] = [
    [0.277_727_3, 0.005_407_344, 0.334_099_8],
    [0.105_093_04, 1.404_613_5, 1.384_590_2],
    [-0.330_861_84, 0.214_847_56, 0.095_095_165],
    [-4.634_230_5, -5.799_101, -19.332_441],
    [6.228_27, 14.179_933, 56.690_55],
    [4.776_385, -13.745_145, -65.353_03],
    [-5.435_456, 4.645_852_6, 26.312_435],
];

const INFERNO: [[f32; 3]; 7] = [
    [0.000_218_940_37, 0.001_651_004_6, -0.019_480_899],
    [0.106_513_42, 0.563_956_44, 3.932_712_4],
    [11.602_493, -3.972_854, -15.942_394],
    [-41.703_995, 17.436_398, 44.354_145],
    [77.162_94, -33.402_36, -81.807_31],
    [-71.319_43, 32.626_064, 73.209_52],
    [25.131_126, -12.242_669, -23.070_325],
];

const TURBO: [[f32; 3]; 6] = [
    [0.135_721_38, 0.091_402_61, 0.106_673_3],
    [4.615_392_6, 2.194_188_4, 12.641_946],
    [-42.660_324, 4.842_966_6, -60.582_048],
    [132.131_08, -14.185_033, 110.362_77],
    [-152.942_4, 4.277_298_6, -89.903_11],
    [59.286_38, 2.829_566, 27.348_25],
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_as_in_the_tables() {
        let close = |map: ColourMap, t: f32, wanted: [u8; 3]| {
            let tolerance = if map == ColourMap::Turbo { 24 } else { 8 };
            let got = map.rgb(t);
            let off = got.iter().zip(wanted).map(|(&a, b)| a.abs_diff(b)).max();
            assert!(off <= Some(tolerance), "{map:?} at {t}: {got:?}, not {wanted:?}");
        };
        close(ColourMap::Viridis, 0.0, [68, 1, 84]);
        close(ColourMap::Viridis, 0.5, [33, 145, 140]);
        close(ColourMap::Viridis, 1.0, [253, 231, 37]);
        close(ColourMap::Inferno, 0.0, [0, 0, 4]);
        close(ColourMap::Inferno, 0.5, [188, 55, 84]);
        close(ColourMap::Inferno, 1.0, [252, 255, 164]);
        close(ColourMap::Turbo, 0.5, [164, 252, 60]);
        assert_eq!(ColourMap::Grey.rgb(0.5), [128; 3]);
    }

    #[test]
    fn lightness_rises_where_it_is_promised() {
        for map in [ColourMap::Viridis, ColourMap::Inferno, ColourMap::Grey] {
            let light = |k: u8| {
                let [r, g, b] = map.rgb(f32::from(k) / 50.0).map(f32::from);
                0.2126 * r + 0.7152 * g + 0.0722 * b
            };
            assert!((1..=50).all(|k| light(k) >= light(k - 1)), "{map:?}");
        }
    }

    #[test]
    fn whatever_comes_has_a_colour() {
        for map in ColourMap::ALL {
            assert_eq!(map.rgb(f32::NAN), map.rgb(0.0));
            assert_eq!(map.rgb(-3.0), map.rgb(0.0));
            assert_eq!(map.rgb(f32::INFINITY), map.rgb(1.0));
        }
    }
}
