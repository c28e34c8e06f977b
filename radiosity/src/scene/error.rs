//! Errors and warnings that carry their place.

use std::fmt;

/// A place in a scene file, both counted from 1; columns count characters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// Line.
    pub line: u32,
    /// Column.
    pub column: u32,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.line, self.column)
    }
}

/// What was read, but plays no part.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// Where it stands.
    pub place: Place,
    /// What it is, in plain words.
    pub message: String,
}

/// Why a file is no scene.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The file could not be read at all.
    #[error("{file}: {message}")]
    File {
        /// The path, as given.
        file: String,
        /// What is wrong, and the cure.
        message: String,
    },
    /// Something written in the file is wrong.
    #[error("{file}:{place}: {message}")]
    Syntax {
        /// The path, as given.
        file: String,
        /// Where.
        place: Place,
        /// How many characters of the line are at fault, at least 1.
        length: u32,
        /// The line itself, without its end; cut to a readable length by the reader.
        line: String,
        /// What is wrong.
        message: String,
        /// What to do about it.
        help: String,
    },
}
