//! Ctrl-C and a polite kill: remembered, and asked about between steps.
//!
//! The engine asks after every row and sweep, and the tidy way out is the usual one. Where a single step is longer
//! than anybody wants to wait (one hemicube of 50 million rays, a picture of 200 million pixels), the program ends
//! without it; a file that is being written is let finish, so that none is left half-written.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::failure::Failure;

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Held while a file is written.
static WRITING: Mutex<()> = Mutex::new(());

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

/// Tell that it is over, once: the two ways out may meet.
pub(crate) fn tell() {
    static TOLD: AtomicBool = AtomicBool::new(false);
    if !TOLD.swap(true, Ordering::Relaxed) {
        crate::diagnostics::plain("interrupted");
    }
}

/// Write files: all of them, or, where somebody has said stop, nothing.
pub(crate) fn writing<T>(write: impl FnOnce() -> Result<T, Failure>) -> Result<T, Failure> {
    // Poisoned or not: it guards no data.
    let _held = WRITING.lock();
    check()?;
    write()
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
            std::thread::spawn(end_untidily);
        }
    });
}

/// No tidy end here: the system ends the program.
#[cfg(not(unix))]
pub(crate) fn listen() {}

/// How long the tidy way out may take.
#[cfg(unix)]
const GRACE: std::time::Duration = std::time::Duration::from_millis(700);

/// End the program if it has not ended by itself.
#[cfg(unix)]
fn end_untidily() {
    std::thread::sleep(GRACE);
    let _held = WRITING.lock();
    crate::progress::wipe();
    std::process::exit(Failure::Interrupted.tell().into());
}

/// Whether the parent process asked that `signal` be ignored (Linux tells; elsewhere: no).
#[cfg(unix)]
fn ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|hexadecimal| u64::from_str_radix(hexadecimal.trim(), 16).ok());
    mask.unwrap_or(0) & (1 << (signal - 1)) != 0
}
