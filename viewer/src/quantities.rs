//! What can be looked at: quantities with one value a patch.

use eframe::egui::Key;
use radiosity::form_factors::Row;
use radiosity::light::Rgb;
use radiosity::patches::Patches;

use crate::worker::Light;

/// Something that every patch has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(crate) enum Quantity {
    /// B: all that leaves the patch.
    #[default]
    Radiosity,
    /// H: all that arrives at it.
    Irradiance,
    /// E.
    Emission,
    /// ρ.
    Reflectance,
    /// What one would see without interreflection: E + ρ Σ_j F_ij E_j.
    Direct,
    /// What interreflection adds: B less the direct light. The two together are B.
    Indirect,
    /// The patch's area.
    Area,
    /// Row sum - 1: above 0 where a hemicube sees more than there is, below where the scene is open.
    Closure,
    /// F_ij of the patch i that was clicked upon.
    FormFactors,
    /// By how much B may be off: the estimate's luminance.
    Error,
}

/// What a quantity is measured in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unit {
    /// The scene's own unit of emission: power per area.
    Light,
    /// The scene's own unit of length, squared.
    Area,
    /// A share or ratio.
    None,
}

impl Quantity {
    /// All of them, as the menu has them.
    pub(crate) const ALL: [Self; 10] = [
        Self::Radiosity,
        Self::Irradiance,
        Self::Emission,
        Self::Reflectance,
        Self::Direct,
        Self::Indirect,
        Self::Area,
        Self::Closure,
        Self::FormFactors,
        Self::Error,
    ];

    /// The key that chooses it: a digit while there are digits.
    pub(crate) fn key(self) -> Key {
        match self {
            Self::Radiosity => Key::Num1,
            Self::Irradiance => Key::Num2,
            Self::Emission => Key::Num3,
            Self::Reflectance => Key::Num4,
            Self::Direct => Key::Num5,
            Self::Indirect => Key::Num6,
            Self::Area => Key::Num7,
            Self::Closure => Key::Num8,
            Self::FormFactors => Key::Num9,
            Self::Error => Key::I,
        }
    }

    /// Its unit.
    pub(crate) fn unit(self) -> Unit {
        match self {
            Self::Radiosity
            | Self::Irradiance
            | Self::Emission
            | Self::Direct
            | Self::Indirect
            | Self::Error => Unit::Light,
            Self::Reflectance | Self::Closure | Self::FormFactors => Unit::None,
            Self::Area => Unit::Area,
        }
    }

    /// Whether it has three channels, which can be shown as a colour. The others are numbers, in false colours only.
    pub(crate) fn is_colour(self) -> bool {
        !matches!(self, Self::Area | Self::Closure | Self::FormFactors | Self::Error)
    }

    /// Whether exposure is for it.
    pub(crate) fn is_light(self) -> bool {
        self.unit() == Unit::Light
    }
}

/// A quantity's values, one a patch.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Column {
    /// Three channels.
    Colour(Vec<Rgb>),
    /// A number; not one (NaN) where it is not known.
    Number(Vec<f64>),
}

/// The values of `quantity` in `light`; `row` is that of the patch that was clicked upon.
pub(crate) fn column(quantity: Quantity, light: &Light, row: Option<&Row>) -> Column {
    let patches: &Patches = &light.patches;
    let count = patches.len();
    let each = |value: &dyn Fn(usize) -> Rgb| Column::Colour((0..count).map(value).collect());
    match quantity {
        Quantity::Radiosity => Column::Colour(light.radiosity.to_vec()),
        Quantity::Irradiance => each(&|i| irradiance(light, i)),
        Quantity::Emission => Column::Colour(patches.emission.clone()),
        Quantity::Reflectance => Column::Colour(patches.reflectance.clone()),
        Quantity::Direct => each(&|i| direct(light, i)),
        Quantity::Indirect => each(&|i| indirect(light, i)),
        Quantity::Area => Column::Number(patches.area.clone()),
        Quantity::Closure => Column::Number((0..count).map(|i| closure(light, i)).collect()),
        Quantity::FormFactors => {
            let mut full = vec![if row.is_some() { 0.0 } else { f64::NAN }; count];
            for (j, factor) in row.into_iter().flat_map(Row::iter) {
                if let Some(place) = full.get_mut(j) {
                    *place = factor;
                }
            }
            Column::Number(full)
        }
        Quantity::Error => Column::Number(match &light.error {
            Some(error) => error.estimate.radiosity.iter().map(|error| error.luminance()).collect(),
            None => vec![f64::NAN; count],
        }),
    }
}

/// H of a patch. Until the answer is there it is what would explain B: (B - E) / ρ, and where nothing is reflected the
/// direct light.
pub(crate) fn irradiance(light: &Light, patch: usize) -> Rgb {
    if let Some(irradiance) = &light.irradiance {
        return irradiance[patch];
    }
    let direct = light.direct.get(patch).copied().flatten().unwrap_or_default().to_array();
    let reflected = (light.radiosity[patch] - light.patches.emission[patch]).to_array();
    let reflectance = light.patches.reflectance[patch].to_array();
    let channel = |k: usize| if reflectance[k] > 0.0 { reflected[k] / reflectance[k] } else { direct[k] };
    Rgb::from(std::array::from_fn(channel))
}

/// E + ρ Σ_j F_ij E_j.
pub(crate) fn direct(light: &Light, patch: usize) -> Rgb {
    let direct = light.direct.get(patch).copied().flatten().unwrap_or_default();
    light.patches.emission[patch] + light.patches.reflectance[patch] * direct
}

/// B less the direct light, at least 0: rounding may take it below where there is none.
pub(crate) fn indirect(light: &Light, patch: usize) -> Rgb {
    let more = (light.radiosity[patch] - direct(light, patch)).to_array();
    Rgb::from(more.map(|value| value.max(0.0)))
}

/// Σ_j F_ij - 1.
pub(crate) fn closure(light: &Light, patch: usize) -> f64 {
    light.row_sum.get(patch).copied().flatten().map_or(f64::NAN, |sum| sum - 1.0)
}

impl Column {
    /// One number a patch: of a colour its luminance.
    pub(crate) fn numbers(&self) -> Vec<f64> {
        match self {
            Self::Colour(colours) => colours.iter().map(|colour| colour.luminance()).collect(),
            Self::Number(numbers) => numbers.clone(),
        }
    }
}

/// The least and the greatest of `numbers`, those that are none left out; with `logarithmic`, of those above zero, and
/// no more than `DECADES` below the greatest.
pub(crate) fn range_of(numbers: &[f64], logarithmic: bool) -> [f64; 2] {
    let counts = |value: f64| value.is_finite() && (!logarithmic || value > 0.0);
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for &value in numbers.iter().filter(|&&value| counts(value)) {
        low = low.min(value);
        high = high.max(value);
    }
    if low > high {
        return if logarithmic { [0.01, 1.0] } else { [0.0, 1.0] };
    }
    if logarithmic {
        low = low.max(high * 10_f64.powi(-DECADES));
    }
    // A colour for each end, even where all values are the same.
    if high - low <= 1e-9 * high.abs().max(low.abs()) {
        return match (logarithmic, high) {
            (true, _) => [high / 10.0, high],
            (false, 0.0) => [0.0, 1.0],
            (false, _) => [high.min(0.0), high.max(0.0)],
        };
    }
    [low, high]
}

/// The numbers that an automatic scale is to hold: of light, that of the surfaces which do not emit, or a lamp would
/// leave no colours to the room.
pub(crate) fn to_be_scaled(quantity: Quantity, numbers: &[f64], patches: &Patches) -> Vec<f64> {
    if !quantity.is_light() || quantity == Quantity::Emission {
        return numbers.to_vec();
    }
    let lit = |(&number, emission): (&f64, &Rgb)| emission.is_black().then_some(number);
    let room: Vec<f64> = numbers.iter().zip(&patches.emission).filter_map(lit).collect();
    if room.is_empty() { numbers.to_vec() } else { room }
}

/// Decades that a logarithmic scale spans at most.
const DECADES: i32 = 5;

/// Where `value` stands in `range`, 0..1 (clamped).
pub(crate) fn place_in(range: [f64; 2], logarithmic: bool, value: f64) -> f32 {
    let [low, high] = range;
    let place = if logarithmic {
        (value.max(1e-300) / low).ln() / (high / low).ln()
    } else {
        (value - low) / (high - low)
    };
    if place.is_nan() { 0.0 } else { place.clamp(0.0, 1.0) as f32 }
}

/// Round numbers within `range` to write beside a scale: at most about `count`.
pub(crate) fn ticks(range: [f64; 2], logarithmic: bool, count: usize) -> Vec<f64> {
    let [low, high] = range;
    if !(low.is_finite() && high.is_finite() && low < high) {
        return Vec::new();
    }
    if logarithmic && low > 0.0 && high / low >= 10.0 {
        let (from, to) = ((low.log10() - 1e-9).ceil() as i32, (high.log10() + 1e-9).floor() as i32);
        return (from..=to).map(|decade| 10_f64.powi(decade)).collect();
    }
    let rough = (high - low) / count.max(1) as f64;
    let magnitude = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|k| k * magnitude).into_iter().find(|&step| step >= rough * 0.999);
    let step = step.unwrap_or(magnitude * 10.0);
    let (from, to) = ((low / step - 1e-9).ceil() as i64, (high / step + 1e-9).floor() as i64);
    (from..=to.min(from.saturating_add(64))).map(|k| k as f64 * step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_hold_all_and_are_never_empty() {
        assert_eq!(range_of(&[1.0, 3.0, f64::NAN, 2.0], false), [1.0, 3.0]);
        assert_eq!(range_of(&[0.0, 1e-9, 1.0], true), [1e-5, 1.0]);
        assert_eq!(range_of(&[], false), [0.0, 1.0]);
        assert_eq!(range_of(&[2.0, 2.0], false), [0.0, 2.0]);
        assert_eq!(range_of(&[-2.0], false), [-2.0, 0.0]);
        assert_eq!(range_of(&[0.0, f64::INFINITY], false), [0.0, 1.0]);
        for numbers in [vec![0.0; 3], vec![-1.0, 0.0], vec![5.0]] {
            for logarithmic in [false, true] {
                let [low, high] = range_of(&numbers, logarithmic);
                assert!(low < high, "{numbers:?} {logarithmic}");
            }
        }
    }

    #[test]
    fn places_run_from_0_to_1() {
        assert_eq!(place_in([1.0, 3.0], false, 2.0), 0.5);
        assert_eq!(place_in([0.01, 1.0], true, 0.1), 0.5);
        assert_eq!(place_in([0.01, 1.0], true, 0.0), 0.0);
        assert_eq!(place_in([0.0, 1.0], false, f64::NAN), 0.0);
    }

    #[test]
    fn ticks_are_round() {
        assert_eq!(ticks([0.0, 10.0], false, 5), [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
        assert_eq!(ticks([0.002, 5.0], true, 5), [0.01, 0.1, 1.0]);
        assert!(ticks([1.0, 1.0], false, 5).is_empty());
    }
}
