//! Files from disk: found, and read no further than is sensible.

use std::fs::{self, File};
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

use super::SceneError;
use super::suggest::nearest;

/// More than this is no scene that a person or a modeller wrote, and may have no end.
const LARGEST: u64 = 1 << 30;

/// All of a text file, which should end in `.{kind}`; of one that is binary, and so no text, only as much as shows it.
pub(super) fn bytes(path: &Path, kind: &str) -> Result<Vec<u8>, SceneError> {
    // What is binary need not be read to its end, which a device such as /dev/zero has not.
    read(path, kind, |bytes| bytes.contains(&0))
}

/// All of a file, whatever it holds.
pub(super) fn binary(path: &Path, kind: &str) -> Result<Vec<u8>, SceneError> {
    read(path, kind, |_| false)
}

fn read(path: &Path, kind: &str, enough: impl Fn(&[u8]) -> bool) -> Result<Vec<u8>, SceneError> {
    let fail = |message: String| SceneError::File { file: path.display().to_string(), message };
    let too_large = || fail("the file is larger than 1 GiB, more than is read: split the scene".to_owned());
    let unreadable = |error: std::io::Error| match error.kind() {
        ErrorKind::NotFound => fail(format!("there is no such file{}", near_names(path, kind))),
        ErrorKind::PermissionDenied => fail("the file may not be read: its permissions forbid it".to_owned()),
        ErrorKind::IsADirectory => directory(path, kind),
        _ => fail(format!("the file cannot be read: {error}")),
    };
    let mut file = File::open(path).map_err(unreadable)?;
    let about = file.metadata().map_err(unreadable)?;
    if about.is_dir() {
        return Err(directory(path, kind));
    }
    if about.is_file() && about.len() > LARGEST {
        return Err(too_large());
    }
    let mut bytes = Vec::new();
    loop {
        let read = (&mut file).take(1 << 20).read_to_end(&mut bytes).map_err(unreadable)?;
        if read == 0 || enough(&bytes[bytes.len() - read..]) {
            return Ok(bytes);
        }
        if bytes.len() as u64 > LARGEST {
            return Err(too_large());
        }
    }
}

/// NAME.vsn beside NAME.scn, in any mixture of upper and lower case; the very name first.
pub(super) fn view_beside(scene: &Path) -> Option<PathBuf> {
    let exact = scene.with_extension("vsn");
    if exact.is_file() {
        return Some(exact);
    }
    // `/dev/stdin` has no neighbours.
    scene.extension()?;
    let wanted = exact.file_name()?.to_str()?;
    let like = |name: &str| name.eq_ignore_ascii_case(wanted);
    let mut found: Vec<String> = names_beside(scene).filter(|name| like(name)).collect();
    // Directories list in no order; the answer must not depend on it.
    found.sort();
    Some(scene.with_file_name(found.first()?))
}

fn directory(path: &Path, kind: &str) -> SceneError {
    let mut names: Vec<String> = names_in(path).filter(|name| is_kind(name, kind)).collect();
    names.sort();
    const SHOWN: usize = 5;
    let more = names.len().saturating_sub(SHOWN);
    names.truncate(SHOWN);
    let mut list = match names.is_empty() {
        true => format!(", and there is no .{kind} file in it"),
        false => format!(": name a file in it, such as {}", names.join(", ")),
    };
    if more > 0 {
        list += &format!(" ({more} more)");
    }
    SceneError::File { file: path.display().to_string(), message: format!("this is a directory{list}") }
}

/// `: did you mean kitchen.scn?`, where a file of that name is there.
fn near_names(path: &Path, kind: &str) -> String {
    let Some(name) = path.file_name().and_then(|name| name.to_str()) else { return String::new() };
    let names: Vec<String> = names_beside(path).filter(|name| is_kind(name, kind)).collect();
    let with_ending = format!("{name}.{kind}");
    let found = names
        .iter()
        .find(|candidate| candidate.eq_ignore_ascii_case(&with_ending))
        .map(String::as_str)
        .or_else(|| nearest(name, names.iter().map(String::as_str)));
    match found {
        Some(found) => format!(": did you mean {}?", path.with_file_name(found).display()),
        None => ": check its name and directory".to_owned(),
    }
}

fn is_kind(name: &str, kind: &str) -> bool {
    Path::new(name).extension().is_some_and(|ending| ending.eq_ignore_ascii_case(kind))
}

fn names_beside(path: &Path) -> impl Iterator<Item = String> {
    let directory = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    names_in(directory)
}

/// The names in a directory, as far as they can be read; a directory of millions is not read to its end.
fn names_in(directory: &Path) -> impl Iterator<Item = String> {
    fs::read_dir(directory)
        .into_iter()
        .flatten()
        .take(10_000)
        .flatten()
        .filter_map(|entry| entry.file_name().into_string().ok())
}
