//! What the window says, in English and French. A text that one of them lacks does not compile.

mod en;
mod fr;
mod numbers;

use std::time::Duration;

use radiosity::bake::BakeError;
use serde::{Deserialize, Serialize};

use crate::action::Action;
use crate::quantities::{Quantity, Unit};

/// A language of the window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Language {
    #[default]
    English,
    French,
}

/// Keys that are not named by their letter. (Canadian and French keyboards print Ctrl and Maj.)
const FRENCH_KEYS: [(&str, &str); 5] = [
    ("Space", "Espace"),
    ("Shift", "Maj"),
    ("Home", "Origine"),
    ("PageUp", "Page préc."),
    ("PageDown", "Page suiv."),
];

/// A menu item's name, and what its tooltip says.
pub(crate) type Named = (&'static str, &'static str);

/// All texts of one language.
pub(crate) struct Texts {
    pub(crate) action: fn(Action) -> Named,
    pub(crate) quantity: fn(Quantity) -> Named,
    pub(crate) unit: fn(Unit) -> &'static str,
    pub(crate) bake_error: fn(&BakeError, Language) -> String,

    pub(crate) menu_file: &'static str,
    pub(crate) menu_recent: &'static str,
    pub(crate) no_recent: &'static str,
    pub(crate) menu_radiosity: &'static str,
    pub(crate) menu_method: &'static str,
    pub(crate) menu_precision: &'static str,
    pub(crate) menu_subdivision: &'static str,
    pub(crate) menu_view: &'static str,
    pub(crate) menu_show: &'static str,
    pub(crate) menu_exposure: &'static str,
    pub(crate) menu_tone: &'static str,
    pub(crate) menu_panels: &'static str,
    pub(crate) menu_language: &'static str,
    pub(crate) menu_help: &'static str,
    pub(crate) stop: &'static str,
    pub(crate) resume: &'static str,

    pub(crate) welcome: &'static str,
    pub(crate) welcome_how: &'static str,
    pub(crate) ready: fn(&str) -> String,
    pub(crate) reading: fn(&str) -> String,
    pub(crate) rows: fn(&str, &str) -> String,
    pub(crate) sweeps: fn(&str, &str) -> String,
    pub(crate) shots: fn(&str, &str, &str, &str) -> String,
    pub(crate) looks: fn(&str, &str) -> String,
    pub(crate) correction: fn(&str, &str) -> String,
    pub(crate) left: fn(&str) -> String,
    pub(crate) paused: &'static str,
    pub(crate) done: fn(&str, &str, &str) -> String,
    pub(crate) done_shots: fn(&str, &str, &str) -> String,
    pub(crate) within: fn(&str) -> String,
    pub(crate) seconds: fn(&str) -> String,

    pub(crate) trouble_scene: &'static str,
    pub(crate) trouble_kept: &'static str,
    pub(crate) trouble_solve: &'static str,
    pub(crate) trouble_bug: &'static str,
    pub(crate) trouble_save: &'static str,
    pub(crate) what_to_do: &'static str,
    pub(crate) close: &'static str,
    pub(crate) cancel: &'static str,
    pub(crate) ok: &'static str,
    pub(crate) warnings: &'static str,
    pub(crate) saved: fn(&str) -> String,
    pub(crate) saving: &'static str,
    pub(crate) not_solved: &'static str,
    pub(crate) no_scene: &'static str,

    pub(crate) panel_display: &'static str,
    pub(crate) panel_materials: &'static str,
    pub(crate) panel_patch: &'static str,
    pub(crate) panel_hemicube: &'static str,
    pub(crate) panel_residual: &'static str,

    pub(crate) quantity_label: &'static str,
    pub(crate) colour_map: &'static str,
    pub(crate) colour_map_name: fn(&'static str) -> &'static str,
    pub(crate) logarithmic: &'static str,
    pub(crate) fixed_range: &'static str,
    pub(crate) from: &'static str,
    pub(crate) to: &'static str,
    pub(crate) exposure: &'static str,
    pub(crate) stops: &'static str,
    pub(crate) tone: &'static str,
    pub(crate) back_faces: &'static str,
    pub(crate) back_faces_lit: &'static str,
    pub(crate) back_faces_black: &'static str,
    pub(crate) back_faces_marked: &'static str,
    pub(crate) back_faces_hidden: &'static str,
    pub(crate) field_of_view: &'static str,
    pub(crate) only_false_colours: &'static str,

    pub(crate) click_a_patch: &'static str,
    pub(crate) patch: &'static str,
    pub(crate) object: &'static str,
    pub(crate) place: &'static str,
    pub(crate) line_column: fn(u32, u32) -> String,
    pub(crate) centre: &'static str,
    pub(crate) normal: &'static str,
    pub(crate) area: &'static str,
    pub(crate) row_sum: &'static str,
    pub(crate) unknown: &'static str,
    pub(crate) sees_most: &'static str,
    pub(crate) sees_nothing: &'static str,
    pub(crate) seen_from_behind: &'static str,

    pub(crate) cells_see: &'static str,
    pub(crate) cells_weigh: &'static str,
    pub(crate) cell: fn(&str, &str) -> String,
    pub(crate) cell_empty: fn(&str) -> String,

    pub(crate) sweep: &'static str,
    pub(crate) round: &'static str,
    pub(crate) residual: &'static str,
    pub(crate) no_residual: &'static str,

    pub(crate) lights: &'static str,
    pub(crate) surfaces: &'static str,
    pub(crate) one_by_one: &'static str,
    pub(crate) one_by_one_hint: &'static str,
    pub(crate) on_off: &'static str,
    pub(crate) emission: &'static str,
    pub(crate) intensity: &'static str,
    pub(crate) reflectance: &'static str,
    pub(crate) group: fn(usize, usize, &str) -> String,

    pub(crate) picture_size: &'static str,
    pub(crate) picture_samples: &'static str,
    pub(crate) as_on_screen: &'static str,
    pub(crate) save: &'static str,
    pub(crate) path_prompt: &'static str,
    pub(crate) path_hint: &'static str,
    pub(crate) other_precision: &'static str,
    pub(crate) other_subdivision: &'static str,
    pub(crate) precision_even: &'static str,

    pub(crate) keys: &'static str,
    pub(crate) mouse: &'static [Named],
    pub(crate) scenes: &'static str,
    pub(crate) pictures: &'static str,
    pub(crate) solutions: &'static str,
}

impl Language {
    /// Its texts.
    pub(crate) fn texts(self) -> &'static Texts {
        match self {
            Self::English => &en::TEXTS,
            Self::French => &fr::TEXTS,
        }
    }

    /// By `fr`, `fr_CA.UTF-8`, `fr-CH`, ...; all that is not French is English.
    pub(crate) fn of_locale(locale: &str) -> Self {
        let tongue = locale.split(['_', '-', '.', '@']).next().unwrap_or_default();
        if tongue.eq_ignore_ascii_case("fr") { Self::French } else { Self::English }
    }

    /// The user's own: LC_ALL, else LC_MESSAGES, else LANG, as everywhere under Unix; elsewhere what the system says.
    pub(crate) fn of_system() -> Self {
        let named = ["LC_ALL", "LC_MESSAGES", "LANG"]
            .into_iter()
            .find_map(|name| std::env::var(name).ok().filter(|value| !value.is_empty()));
        Self::of_locale(&named.or_else(sys_locale::get_locale).unwrap_or_default())
    }

    /// A number with so many significant digits.
    pub(crate) fn number(self, value: f64, digits: usize) -> String {
        numbers::with_comma(self, numbers::significant(value, digits))
    }

    /// A number with so many digits after the point.
    pub(crate) fn fixed(self, value: f64, decimals: usize) -> String {
        let text = format!("{value:.decimals$}");
        // Rounded to nothing, a number has no sign.
        let nothing = text.starts_with('-') && !text.contains(['1', '2', '3', '4', '5', '6', '7', '8', '9']);
        numbers::with_comma(self, if nothing { text[1..].to_owned() } else { text })
    }

    /// The name of a key, or several, as it is printed on keyboards; `keys` has the English ones.
    pub(crate) fn keys(self, keys: String) -> String {
        let printed = match self {
            Self::English => &[][..],
            Self::French => &FRENCH_KEYS,
        };
        printed.iter().fold(keys, |keys, (english, own)| keys.replace(english, own))
    }

    /// A whole number, its digits in groups.
    pub(crate) fn count(self, value: usize) -> String {
        numbers::grouped(self, value)
    }

    /// What someone typed, with a point or a comma.
    pub(crate) fn parse(self, typed: &str) -> Option<f64> {
        typed.trim().replace(',', ".").replace(['\u{a0}', '\u{202f}', ' '], "").replace('−', "-").parse().ok()
    }

    /// A span of time, in words short enough for a status bar.
    pub(crate) fn span(self, span: Duration) -> String {
        let seconds = span.as_secs_f64();
        if seconds < 10.0 {
            (self.texts().seconds)(&self.fixed(seconds, 1))
        } else if seconds < 100.0 {
            (self.texts().seconds)(&self.fixed(seconds, 0))
        } else if seconds < 5400.0 {
            format!("{} min", self.fixed(seconds / 60.0, 0))
        } else {
            format!("{} h", self.fixed(seconds / 3600.0, 1))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_locale_chooses() {
        for (locale, language) in [
            ("fr_CA.UTF-8", Language::French),
            ("fr", Language::French),
            ("fr-FR", Language::French),
            ("en_GB", Language::English),
            ("C", Language::English),
            ("frr_DE", Language::English),
            ("", Language::English),
        ] {
            assert_eq!(Language::of_locale(locale), language, "{locale}");
        }
    }

    #[test]
    fn numbers_have_their_language() {
        let (en, fr) = (Language::English, Language::French);
        assert_eq!(en.number(0.123456, 4), "0.1235");
        assert_eq!(fr.number(0.123456, 4), "0,1235");
        assert_eq!(en.number(1.5e-7, 3), "1.5e-7");
        assert_eq!(fr.number(1.5e-7, 3), "1,5e-7");
        assert_eq!(en.number(123456.0, 3), "123456");
        assert_eq!(en.number(2.5e9, 3), "2.5e9");
        assert_eq!(en.number(0.0, 3), "0");
        assert_eq!(en.number(-0.00012, 3), "-0.00012");
        assert_eq!(en.number(f64::NAN, 3), "–");
        assert_eq!(en.count(1234567), "1,234,567");
        assert_eq!(fr.count(1234567), "1\u{a0}234\u{a0}567");
        assert_eq!(fr.parse("1,5"), Some(1.5));
        assert_eq!(fr.parse("1.5"), Some(1.5));
        assert_eq!(en.parse("x"), None);
        assert_eq!(en.fixed(-0.02, 1), "0.0");
        assert_eq!(en.fixed(-0.06, 1), "-0.1");
        assert_eq!(fr.keys("Ctrl+Shift+S".into()), "Ctrl+Maj+S");
    }

    #[test]
    fn every_action_has_a_name_and_a_tooltip_and_no_two_the_same() {
        for language in [Language::English, Language::French] {
            let mut names = Vec::new();
            for action in Action::all() {
                let (name, tooltip) = (language.texts().action)(action);
                assert!(!name.is_empty() && tooltip.len() > name.len() / 2, "{action:?}");
                assert!(!names.contains(&name), "{name}");
                names.push(name);
            }
        }
    }
}
