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

/// What was read, but plays no part, or not surely the part its author meant. Its `Display` is
/// `file:line:column: message`, without a place
/// `file: message`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// The file it stands in, as given: the scene's, or that of the view beside it.
    pub file: String,
    /// Where it stands; the first place, where there are several. [`Place::default`], 0:0, where the format has no
    /// lines: the message then names the part.
    pub place: Place,
    /// What it is, in plain words.
    pub message: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.place.line {
            0 => write!(f, "{}: {}", self.file, self.message),
            _ => write!(f, "{}:{}: {}", self.file, self.place, self.message),
        }
    }
}

/// Why a file is no scene.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SceneError {
    /// The file could not be read at all, or something in a file without lines is wrong.
    #[error("{file}: {message}")]
    File {
        /// The path, as given.
        file: String,
        /// What is wrong, in which part, and the cure.
        message: String,
    },
    /// Something written in the file is wrong.
    #[error("{file}:{place}: {message}")]
    Syntax {
        /// The path, as given.
        file: String,
        /// Where.
        place: Place,
        /// How many characters of `line` are at fault, at least 1.
        length: u32,
        /// The line itself, without its end. A long one is cut about the fault, with `…` for what is left
        /// out; every control character, a tab too, stands as one visible character or one space.
        line: String,
        /// Where in `line` the fault begins, in characters from 0. It is `place.column - 1` unless the
        /// line was cut on its left. It may stand one past the last character.
        caret: u32,
        /// What is wrong.
        message: String,
        /// What to do about it.
        help: String,
    },
}
