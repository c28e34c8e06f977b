//! Ctrl-C and a polite kill: remembered, and asked about between steps.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::failure::Failure;

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// The exit code that says "interrupted": 128 + SIGINT, as shells have it.
pub(crate) const EXIT_CODE: u8 = 130;

/// Whether somebody said stop.
pub(crate) fn requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}

/// Asked between stages, as the engine's watch asks between steps.
pub(crate) fn check() -> Result<(), Failure> {
    if requested() { Err(Failure::Interrupted) } else { Ok(()) }
}

/// Listen from now on. The first signal asks for a tidy end; a second one does not wait for it.
#[cfg(unix)]
pub(crate) fn listen() {
    use signal_hook::consts::{SIGINT, SIGTERM};

    // What the parent chose to ignore stays ignored: a shell does so for SIGINT of jobs in the background.
    let wanted = [SIGINT, SIGTERM].into_iter().filter(|&signal| !ignored(signal));
    let Ok(mut signals) = signal_hook::iterator::Signals::new(wanted) else {
        // Without a handler, Ctrl-C still ends the program: only less tidily.
        return;
    };
    std::thread::spawn(move || {
        for _ in signals.forever() {
            if REQUESTED.swap(true, Ordering::Relaxed) {
                std::process::exit(EXIT_CODE.into());
            }
        }
    });
}

/// No tidy end here: the system ends the program.
#[cfg(not(unix))]
pub(crate) fn listen() {}

/// Whether the parent process asked that `signal` be ignored (Linux tells; elsewhere: no).
#[cfg(unix)]
fn ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|hexadecimal| u64::from_str_radix(hexadecimal.trim(), 16).ok());
    mask.unwrap_or(0) & (1 << (signal - 1)) != 0
}
