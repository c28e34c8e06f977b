//! When a solver is done, and when going on is in vain.

use super::SolveError;
use crate::light::Rgb;
use crate::patches::Patches;

/// Steps over which the residual must have shrunk somewhat.
const PATIENCE: usize = 32;

/// The most steps that a solver undertakes.
const MOST_STEPS: f64 = 1e6;

/// Whether a solver with this history of residuals will not come down to `epsilon`: the last residual is not
/// finite, or over the last steps it has not shrunk, or so slowly that more than a million steps would be needed.
pub(super) fn is_hopeless(history: &[f64], epsilon: f64) -> bool {
    let [.., now] = *history else { return false };
    if !now.is_finite() {
        return true;
    }
    let Some(before) = history.len().checked_sub(PATIENCE + 1).map(|k| history[k]) else { return false };
    let rate = (now / before).powf(1.0 / PATIENCE as f64);
    let steps_left = (epsilon / now).ln() / rate.ln();
    rate >= 1.0 || history.len() as f64 + steps_left > MOST_STEPS
}

/// After a step of a solver that has come to `radiosity` with this history of residuals: whether it is done, because the
/// last residual is at most `epsilon`, or only the last bits of its own numbers, below which it will not come.
pub(super) fn converged(
    patches: &Patches,
    radiosity: &[Rgb],
    history: &[f64],
    epsilon: f64,
) -> Result<bool, SolveError> {
    let Some(&residual) = history.last() else { return Ok(false) };
    let rounding = || {
        let size = radiosity.iter().map(|b| b.norm_squared()).sum::<f64>().sqrt();
        residual <= 4.0 * f64::EPSILON * size
    };
    if residual <= epsilon || rounding() {
        return Ok(true);
    }
    if is_hopeless(history, epsilon) {
        return Err(SolveError::diverges(patches, history.len(), residual));
    }
    Ok(false)
}

#[cfg(test)]
mod tests {
    use super::is_hopeless;

    fn geometric(rate: f64, steps: i32) -> Vec<f64> {
        (0..steps).map(|k| rate.powi(k)).collect()
    }

    #[test]
    fn only_what_does_not_come_down_is_hopeless() {
        for (rate, hopeless) in [(0.5, false), (0.999, false), (0.999999, true), (1.0, true), (1.01, true)] {
            assert_eq!(is_hopeless(&geometric(rate, 100), 1e-6), hopeless, "{rate}");
        }
        assert!(!is_hopeless(&[], 1e-6));
        assert!(!is_hopeless(&geometric(2.0, 20), 1e-6), "too soon to tell");
        assert!(is_hopeless(&[1.0, f64::NAN], 1e-6));
        assert!(is_hopeless(&[1.0, f64::INFINITY], 1e-6));
    }
}
