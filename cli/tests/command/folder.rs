//! A folder of a test's own, and the scenes that tests share.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::{fs, str};

/// A closed unit cube whose faces all emit 1 and reflect 0.5, seen from inside: its radiosity is 1 / (1 - 0.5) = 2
/// everywhere.
pub(crate) const FURNACE: &str = "\
OC
QD 4 4  0 0 0  1 0 0  1 1 0  0 1 0  ID
QD 4 4  0 0 1  0 1 1  1 1 1  1 0 1  ID
QD 4 4  0 0 0  0 1 0  0 1 1  0 0 1  ID
QD 4 4  1 0 0  1 0 1  1 1 1  1 1 0  ID
QD 4 4  0 0 0  0 0 1  1 0 1  1 0 0  ID
QD 4 4  0 1 0  1 1 0  1 1 1  0 1 1  ID
FI
CD 0.5 0.5 0.5
CE 1 1 1
ID
";

/// A lamp over a floor, with a triangle and a mesh beside it: open, with every kind of surface.
pub(crate) const LAMP: &str = "\
# a lamp over a floor
OC
  QD 6 6  0 0 0  2 0 0  2 2 0  0 2 0  CD 0.7 0.6 0.5 ID
  QD 2 2  0.5 0.5 1.5  0.5 1.5 1.5  1.5 1.5 1.5  1.5 0.5 1.5  CE 20 20 20 ID
  TI  0 0 0  0 2 0  0 0 1  CD 0.2 0.8 0.2 ID
FI ID
";

/// A view of both from within the cube.
pub(crate) const VIEW: &str = "\
0.5 0.05 0.5   0 1 0   0 0 1
-0.1 0.4  -0.5 0.5 -0.5 0.5  0 1 0 1  0 100
";

/// A folder that goes with the test.
pub(crate) struct Folder(tempfile::TempDir);

/// How a command ended.
#[derive(Debug)]
pub(crate) struct Ended {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Folder {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    /// With one file in it.
    pub(crate) fn with(name: &str, content: impl AsRef<[u8]>) -> Self {
        let folder = Self::new();
        folder.write(name, content);
        folder
    }

    pub(crate) fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.path(name), content).expect("the folder can be written");
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    pub(crate) fn text(&self, name: &str) -> String {
        String::from_utf8(self.read(name)).expect("UTF-8")
    }

    pub(crate) fn json(&self, name: &str) -> serde_json::Value {
        serde_json::from_slice(&self.read(name)).expect("JSON")
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn root(&self) -> &Path {
        self.0.path()
    }

    /// The names of all that is in it, hidden files too.
    pub(crate) fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.root()).expect("the folder can be read");
        let name = |entry: fs::DirEntry| entry.file_name().to_string_lossy().into_owned();
        let mut names: Vec<_> = entries.map(|entry| name(entry.expect("an entry"))).collect();
        names.sort();
        names
    }

    /// The command, to be run in this folder: `line` is split at white space.
    pub(crate) fn command(&self, line: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_radiosity"));
        command.args(line.split_whitespace()).current_dir(self.root()).stdin(Stdio::null());
        // As on a machine where nobody has said anything about colours.
        for variable in ["NO_COLOR", "CLICOLOR", "CLICOLOR_FORCE", "RUST_BACKTRACE", "RAYON_NUM_THREADS"] {
            command.env_remove(variable);
        }
        command
    }

    pub(crate) fn run(&self, line: &str) -> Ended {
        let output = self.command(line).output().expect("the binary runs");
        let ended = Ended::from(output);
        assert!(!ended.stderr.contains("panicked"), "{line}: {}", ended.stderr);
        ended
    }
}

impl From<Output> for Ended {
    fn from(output: Output) -> Self {
        let text = |bytes: &[u8]| str::from_utf8(bytes).expect("UTF-8").to_owned();
        Self { code: output.status.code(), stdout: text(&output.stdout), stderr: text(&output.stderr) }
    }
}

impl Ended {
    /// It went well.
    #[track_caller]
    pub(crate) fn done(self) -> Self {
        assert_eq!(self.code, Some(0), "{}", self.stderr);
        self
    }

    /// It ended with `code`, and told one error that contains `words`.
    #[track_caller]
    pub(crate) fn refused(self, code: i32, words: &[&str]) -> Self {
        assert_eq!(self.code, Some(code), "{}", self.stderr);
        assert_eq!(self.stdout, "", "an error is no result");
        let errors = self.stderr.lines().filter(|line| line.starts_with("error: ")).count();
        assert_eq!(errors, 1, "one error, not {errors}: {}", self.stderr);
        for word in words {
            assert!(self.stderr.contains(word), "'{word}' is not in: {}", self.stderr);
        }
        self
    }
}
