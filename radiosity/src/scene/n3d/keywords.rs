//! N3D's keywords, and what a word that is none was meant to be.

use super::lexer::Token;
use super::source::quoted;
use super::suggest::nearest;

/// A coefficient of an object, with the field of the material that it fills.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Coefficient {
    Diffuse,
    Emission,
    Specular,
    Ambient,
    DiffuseTransmission,
    SpecularTransmission,
    AmbientTransmission,
    Mirror,
    Transparency,
    Shadow,
}

/// The words that begin an object.
pub(super) const OBJECTS: [&str; 11] = ["OC", "PG", "TI", "QD", "SP", "CL", "PT", "SG", "PL", "FR", "VO"];

/// The words that stand between an object and its ID. NM and IN are ours, not N3D's.
pub(super) const ATTRIBUTES: [&str; 21] = [
    "TR", "HO", "RT", "CZ", "AV", "MA", "GD", "CD", "CS", "CA", "TD", "TS", "TA", "CR", "CT", "CO", "CE",
    "HD", "LK", "NM", "IN",
];

/// Whether a word is a keyword, of either kind.
pub(super) fn is_keyword(word: &str) -> bool {
    OBJECTS.contains(&word) || ATTRIBUTES.contains(&word) || word == "FI" || word == "ID"
}

/// The coefficient that a keyword of three numbers fills, and its name in words.
pub(super) fn coefficient(keyword: &str) -> Option<(Coefficient, &'static str)> {
    Some(match keyword {
        "CD" => (Coefficient::Diffuse, "diffuse reflectance"),
        "CE" => (Coefficient::Emission, "emission"),
        "CS" => (Coefficient::Specular, "specular reflectance"),
        "CA" => (Coefficient::Ambient, "ambient reflectance"),
        "TD" => (Coefficient::DiffuseTransmission, "diffuse transmission"),
        "TS" => (Coefficient::SpecularTransmission, "specular transmission"),
        "TA" => (Coefficient::AmbientTransmission, "ambient transmission"),
        "CR" => (Coefficient::Mirror, "mirror reflection"),
        "CT" => (Coefficient::Transparency, "transparency"),
        "CO" => (Coefficient::Shadow, "shadow"),
        _ => return None,
    })
}

/// The cure for a word that is no keyword, where one of `expected` was.
pub(super) fn cure(token: &Token<'_>, expected: &[&'static str], otherwise: &str) -> String {
    let known = expected.iter().copied();
    let text = token.text;
    if text.starts_with("/*") || text.starts_with(['%', ';', '!']) || text.starts_with("--") {
        return "comments begin with # or // and end with the line".to_owned();
    }
    if let Some(keyword) = known.clone().find(|keyword| text.eq_ignore_ascii_case(keyword)) {
        return format!("did you mean {keyword}? Keywords are two capital letters");
    }
    // `QD4`, or `ID.`: a keyword with something glued to it.
    let glued = known.clone().find_map(|keyword| {
        let head = text.get(..keyword.len())?;
        let tail = &text[keyword.len()..];
        let letters = tail.starts_with(|c: char| c.is_alphabetic());
        (head.eq_ignore_ascii_case(keyword) && !letters).then_some((keyword, tail))
    });
    if let Some((keyword, tail)) = glued {
        let number = tail.parse::<f64>().is_ok();
        return match number {
            true => format!(
                "did you mean {keyword}? Put white space after it: {}",
                quoted(&format!("{keyword} {tail}"))
            ),
            false => format!("did you mean {keyword}? Put white space after it"),
        };
    }
    match nearest(text, known) {
        Some(keyword) => format!("did you mean {keyword}?"),
        None => otherwise.to_owned(),
    }
}
