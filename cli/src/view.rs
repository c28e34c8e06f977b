//! `radiosity view`: starts the window, which is a program of its own.

use std::env;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use anyhow::anyhow;

use crate::args::View;
use crate::failure::Failure;

const VIEWER: &str = "radiosity-viewer";

pub(crate) fn run(typed: &View) -> Result<ExitCode, Failure> {
    let Some(viewer) = find() else {
        return Err(anyhow!(
            "the window is a program of its own, {VIEWER}, and it is neither beside this one nor on the PATH; \
             build it with\n\n    cargo build --release -p {VIEWER}\n\nin the folder that radiosity was built in"
        )
        .into());
    };
    start(Command::new(&viewer).args(&typed.arguments), &viewer)
}

/// Beside this program, where cargo puts both; then wherever the system looks for programs.
fn find() -> Option<PathBuf> {
    let name = format!("{VIEWER}{}", env::consts::EXE_SUFFIX);
    let beside = env::current_exe().ok().and_then(|own| Some(own.parent()?.to_owned()));
    let path = env::var_os("PATH").unwrap_or_default();
    let folders = beside.into_iter().chain(env::split_paths(&path));
    folders.map(|folder| folder.join(&name)).find(|program| runnable(program))
}

#[cfg(unix)]
fn runnable(program: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt;
    program.metadata().is_ok_and(|file| file.is_file() && file.permissions().mode() & 0o111 != 0)
}

#[cfg(not(unix))]
fn runnable(program: &Path) -> bool {
    program.is_file()
}

/// The viewer takes this process's place: signals, exit code and terminal are its own.
#[cfg(unix)]
fn start(command: &mut Command, viewer: &Path) -> Result<ExitCode, Failure> {
    use std::os::unix::process::CommandExt;
    let error = command.exec();
    Err(anyhow!("cannot start {}: {error}", viewer.display()).into())
}

#[cfg(not(unix))]
fn start(command: &mut Command, viewer: &Path) -> Result<ExitCode, Failure> {
    let status = command.status().map_err(|error| anyhow!("cannot start {}: {error}", viewer.display()))?;
    Ok(ExitCode::from(status.code().map_or(1, |code| u8::try_from(code).unwrap_or(1))))
}
