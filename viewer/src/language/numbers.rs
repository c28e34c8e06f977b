//! Numbers as people write them.

use super::Language;

/// So many significant digits, no zeros at the end; an exponent where there would be many zeros.
pub(super) fn significant(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return if value.is_nan() { "–".into() } else { format!("{value}") };
    }
    if value == 0.0 {
        return "0".into();
    }
    let decade = value.abs().log10().floor() as i32;
    if !(-5..7).contains(&decade) {
        let text = format!("{value:.*e}", digits.saturating_sub(1));
        return match text.split_once('e') {
            Some((mantissa, exponent)) => format!("{}e{exponent}", trimmed(mantissa)),
            None => text,
        };
    }
    let decimals = (digits as i32 - 1 - decade).max(0) as usize;
    trimmed(&format!("{value:.decimals$}")).to_owned()
}

fn trimmed(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

pub(super) fn with_comma(language: Language, text: String) -> String {
    match language {
        Language::English => text,
        Language::French => text.replace('.', ","),
    }
}

pub(super) fn grouped(language: Language, value: usize) -> String {
    let separator = match language {
        Language::English => ',',
        Language::French => '\u{a0}',
    };
    let digits = value.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(separator);
        }
        text.push(digit);
    }
    text
}
