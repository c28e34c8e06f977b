//! Every way to end without an answer, told once, in one manner.

use std::io;

use radiosity::bake::BakeError;
use radiosity::export::ExportError;
use radiosity::scene::SceneError;
use radiosity::solve::SolveError;

use crate::{diagnostics, interrupt};

/// Why a command gave no answer.
#[derive(Debug)]
pub(crate) enum Failure {
    /// What was asked makes no sense: the caller must ask something else.
    Usage(String),
    /// The scene cannot be read.
    Scene(SceneError),
    /// Anything else that went wrong.
    Failed(anyhow::Error),
    /// Somebody said stop.
    Interrupted,
    /// Whoever read our output has had enough: no error, `head` does so all the time.
    BrokenPipe,
}

impl Failure {
    /// Tell the user; the exit code that goes with it.
    pub(crate) fn tell(&self) -> u8 {
        match self {
            Self::Usage(message) => {
                diagnostics::error(message);
                diagnostics::plain("\nFor more information, try '--help'.");
            }
            Self::Scene(error) => diagnostics::scene_error(error),
            Self::Failed(error) => diagnostics::error(&format!("{error:#}")),
            Self::Interrupted => interrupt::tell(),
            Self::BrokenPipe => {}
        }
        match self {
            Self::Usage(_) => 2,
            Self::Scene(_) | Self::Failed(_) => 1,
            Self::Interrupted => interrupt::EXIT_CODE,
            Self::BrokenPipe => 0,
        }
    }
}

impl From<BakeError> for Failure {
    fn from(error: BakeError) -> Self {
        match error {
            BakeError::Interrupted(_) | BakeError::Solve(SolveError::Interrupted(_)) => Self::Interrupted,
            other => Self::Failed(other.into()),
        }
    }
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        Self::Scene(error)
    }
}

impl From<anyhow::Error> for Failure {
    fn from(error: anyhow::Error) -> Self {
        Self::Failed(error)
    }
}

impl From<ExportError> for Failure {
    fn from(error: ExportError) -> Self {
        Self::Failed(error.into())
    }
}

/// From writing to standard output; files have messages of their own.
impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::BrokenPipe => Self::BrokenPipe,
            _ => Self::Failed(anyhow::Error::new(error).context("cannot write to standard output")),
        }
    }
}
