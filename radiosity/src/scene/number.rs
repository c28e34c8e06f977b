//! Numbers as C writes them.

use super::source::quoted;

/// The greatest magnitude that a number may have. With it no product of lengths, areas and normals
/// overflows in any later stage, some of which compute in float32.
pub(super) const GREATEST: f64 = 1e15;

/// What is wrong with a number, and the cure.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct BadNumber {
    pub(super) message: String,
    pub(super) help: String,
}

fn bad(message: impl Into<String>, help: impl Into<String>) -> BadNumber {
    BadNumber { message: message.into(), help: help.into() }
}

/// A decimal real: `2`, `-.5`, `+3.`, `1e-3`.
pub(super) fn real(text: &str) -> Result<f64, BadNumber> {
    let bare = text.trim_start_matches(['+', '-']).to_ascii_lowercase();
    if bare.starts_with("nan") || bare.starts_with("inf") || bare.starts_with("1.#") {
        return Err(bad(
            format!("{} is no number a scene can use", quoted(text)),
            "write a decimal number; whatever program wrote this file had computed nonsense here",
        ));
    }
    // `parse` knows words for infinity, so the alphabet is checked as well.
    let decimal = text.bytes().all(|b| matches!(b, b'0'..=b'9' | b'+' | b'-' | b'.' | b'e' | b'E'));
    match text.parse::<f64>() {
        Ok(value) if decimal && value.abs() <= GREATEST => Ok(value),
        Ok(_) if decimal => Err(bad(
            format!("{} is too large: numbers go up to 1e15", quoted(text)),
            "choose a unit of length, or of light, in which the scene is of ordinary size",
        )),
        _ => Err(bad(format!("{} is not a number", quoted(text)), cure(text))),
    }
}

/// A whole number.
pub(super) fn whole(text: &str) -> Result<i64, BadNumber> {
    let digits = text.strip_prefix(['+', '-']).unwrap_or(text);
    if !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit()) {
        return text.parse().map_err(|_| {
            bad(format!("{} is too large", quoted(text)), "write a whole number of a few digits")
        });
    }
    real(text)?;
    Err(bad(format!("{} is not a whole number", quoted(text)), "write it without point and exponent"))
}

/// What the author probably meant.
fn cure(text: &str) -> String {
    let numeric = |part: &str| part.parse::<f64>().is_ok();
    if let Some((before, after)) = text.split_once(',') {
        if numeric(before) && !after.is_empty() && numeric(after) {
            return format!(
                "numbers are written with a point, as {}, and separated by white space",
                quoted(&format!("{before}.{after}"))
            );
        }
        return "numbers are separated by white space, without commas".to_owned();
    }
    if text.strip_suffix(['f', 'F', ';', ')', ']', '}']).is_some_and(numeric)
        || text.strip_prefix(['(', '[', '{']).is_some_and(numeric)
    {
        return "write the number alone, with white space around it".to_owned();
    }
    "numbers are written as 2, -0.5 or 1e-3, separated by white space".to_owned()
}
