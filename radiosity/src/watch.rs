//! How a long computation tells where it is, and how its caller says stop.
//!
//! One closure serves a progress bar, Ctrl-C, a window's stop button and a test's recorder alike.

use std::ops::ControlFlow;

/// Where a computation stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Progress {
    /// Rows of form factors finished, of all that there are.
    FormFactors {
        /// Rows done.
        done: usize,
        /// Rows in all.
        total: usize,
    },
    /// Second looks out of patches, from which an answer's error is told or taken away.
    Looks {
        /// Looks done.
        done: usize,
        /// Looks in all.
        total: usize,
    },
    /// A step of a solver has ended: a sweep of Gauss-Seidel, or a shot.
    Solve {
        /// Steps done.
        iteration: usize,
        /// What the stopping test measures now; the solver ends when it is at most `epsilon`.
        residual: f64,
        /// The stopping test's bound.
        epsilon: f64,
    },
    /// Rows of a picture's pixels that have their light, of all that there are.
    Picture {
        /// Rows done.
        done: usize,
        /// Rows in all.
        total: usize,
    },
}

/// Told of progress between steps; answers whether to go on.
pub type Watch<'a> = dyn FnMut(&Progress) -> ControlFlow<()> + 'a;

/// The caller said stop: nothing is wrong, and there is no answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("interrupted")]
pub struct Interrupted;

/// Tell `watch` of `progress`; `Err(Interrupted)` where it says stop.
pub fn tell(watch: &mut Watch<'_>, progress: Progress) -> Result<(), Interrupted> {
    match watch(&progress) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(Interrupted),
    }
}

/// A watcher that never stops anything.
pub fn ignore(_: &Progress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}
