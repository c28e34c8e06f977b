//! What holds of whatever a reader answers.

use radiosity::patches::Patches;
use radiosity::scene::SceneError;

/// Patches have an area, a normal and a place.
pub fn patches(patches: &Patches) {
    assert!(patches.area.iter().all(|&area| area.is_finite() && area > 0.0));
    assert!(patches.normal.iter().all(|normal| (normal.length() - 1.0).abs() < 1e-9));
    assert!(patches.centre.iter().all(|centre| centre.is_finite()));
}

/// An error in a text has a place in it, an excerpt that can be shown, and a cure.
#[allow(dead_code, reason = "glTF has no lines")]
pub fn error_in_text(error: &SceneError) {
    let SceneError::Syntax { line, caret, length, place, message, help, .. } = error else {
        panic!("{error}: nothing was opened")
    };
    assert!(place.line >= 1 && place.column >= 1 && *length >= 1);
    assert!(*caret as usize <= line.chars().count() && line.chars().count() < 200);
    assert!(!line.contains(['\n', '\r', '\t', '\0']) && !message.is_empty() && !help.is_empty());
}
