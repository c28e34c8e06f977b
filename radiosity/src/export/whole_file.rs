//! Files that are there whole, or not at all.

use std::fs::{self, File};
use std::io::{self, BufWriter, Seek, Write};
use std::path::{Path, PathBuf};

/// Why a file was not written. Whatever stood at its path before still stands there.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The folder it is to lie in does not exist.
    #[error("cannot write {}: there is no folder {}; create it first", path.display(), folder.display())]
    NoFolder {
        /// The file.
        path: PathBuf,
        /// Its folder.
        folder: PathBuf,
    },
    /// Its path is a folder's.
    #[error("cannot write {}: it is a folder; give the name of a file in it", .0.display())]
    IsFolder(PathBuf),
    /// A file that may not be changed stands there.
    #[error("cannot write {}: the file that is there is write-protected", .0.display())]
    WriteProtected(PathBuf),
    /// Writing failed: no permission, the disk is full, or worse.
    #[error("cannot write {}: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        error: io::Error,
    },
}

/// Write the file at `path` by `write`, so that it appears whole or not at all.
///
/// It is written to a temporary file in the same folder, flushed to the disk, and takes its name at the very end. Where
/// anything fails, or the program ends before, the temporary is removed and `path` is as it was. The file has the
/// permissions of the one it replaces, or those that any new file would have. A symbolic link is followed.
///
/// What is neither a file nor a folder (`/dev/stdout`, a pipe) cannot be replaced: it is given the bytes once all of
/// them are known.
pub fn whole_file(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>,
) -> Result<(), ExportError> {
    let io_error = |error| ExportError::Io { path: path.into(), error };

    let there = fs::metadata(path).ok();
    if there.as_ref().is_some_and(fs::Metadata::is_dir) {
        return Err(ExportError::IsFolder(path.into()));
    }
    if there.as_ref().is_some_and(|there| !there.is_file()) {
        let mut temporary = tempfile::tempfile().map_err(io_error)?;
        fill(&mut temporary, write).map_err(io_error)?;
        return pour(&mut temporary, path).map_err(io_error);
    }
    if there.as_ref().is_some_and(|there| there.permissions().readonly()) {
        return Err(ExportError::WriteProtected(path.into()));
    }

    // Replace what a link points to, not the link.
    let target = if fs::symlink_metadata(path).is_ok_and(|there| there.is_symlink()) {
        fs::canonicalize(path).map_err(io_error)?
    } else {
        path.to_path_buf()
    };
    let Some(name) = target.file_name() else { return Err(ExportError::IsFolder(path.into())) };
    let folder = match target.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        return Err(ExportError::NoFolder { path: path.into(), folder: folder.into() });
    }

    // Hidden, and named after the file, should it ever be found after a power cut.
    let mut prefix = std::ffi::OsString::from(".");
    prefix.push(name);
    prefix.push(".");
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(".part");
    new_file_permissions(&mut builder);
    let mut temporary = match builder.tempfile_in(folder) {
        // A name near the longest that the file system takes leaves no room for ours.
        Err(error) if error.kind() == io::ErrorKind::InvalidFilename => {
            builder.prefix(".radiosity.").tempfile_in(folder)
        }
        other => other,
    }
    .map_err(io_error)?;
    fill(temporary.as_file_mut(), write).map_err(io_error)?;
    if let Some(there) = there {
        temporary.as_file().set_permissions(there.permissions()).map_err(io_error)?;
    }
    temporary.as_file().sync_all().map_err(io_error)?;
    temporary.persist(&target).map_err(|failed| io_error(failed.error))?;
    Ok(())
}

fn fill(file: &mut File, write: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>) -> io::Result<()> {
    let mut writer = BufWriter::with_capacity(1 << 17, file);
    write(&mut writer)?;
    writer.flush()
}

/// All of `file` to what stands at `path` and cannot be replaced.
fn pour(file: &mut File, path: &Path) -> io::Result<()> {
    file.rewind()?;
    let mut target = fs::OpenOptions::new().write(true).open(path)?;
    io::copy(file, &mut target)?;
    target.flush()
}

/// What open(2) is asked for when any program creates a file; the user's umask takes its part away. Left alone, a
/// temporary file is its owner's only.
#[cfg(unix)]
fn new_file_permissions(builder: &mut tempfile::Builder<'_, '_>) {
    use std::os::unix::fs::PermissionsExt;
    builder.permissions(fs::Permissions::from_mode(0o666));
}

#[cfg(not(unix))]
fn new_file_permissions(_: &mut tempfile::Builder<'_, '_>) {}
