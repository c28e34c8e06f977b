//! Ctrl-C and a polite kill: an end within about a second, and nothing left behind.
#![cfg(unix)]

use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use crate::folder::{Ended, FURNACE, Folder};

/// Minutes of work, told of row by row.
const MANY_ROWS: &str = "--method hemicube-rays --precision 300 --subdivision 8";
/// Minutes of work of which the first row alone takes many seconds.
const LONG_ROWS: &str = "--method hemicube-rays --precision 4096";

fn send(signal: &str, child: &Child) {
    let sent = Command::new("kill").args([signal, &child.id().to_string()]).status();
    assert!(sent.is_ok_and(|status| status.success()), "kill {signal}");
}

/// Whether whoever runs these tests ignores Ctrl-C (Linux tells; elsewhere: no).
fn interrupt_is_ignored() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|hexadecimal| u64::from_str_radix(hexadecimal.trim(), 16).ok());
    mask.unwrap_or(0) & 0b10 != 0
}

/// Start a long job, let it get under way, and stop it by `signals`.
#[track_caller]
fn stopped_by(signals: &[&str], line: &str) {
    let folder = Folder::with("s.scn", FURNACE);
    let mut command = folder.command(line);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it runs");
    thread::sleep(Duration::from_millis(500));
    let sent = Instant::now();
    for &signal in signals {
        // What these tests' own parent ignores, their children do: a shell has it so for jobs in the background.
        send(if signal == "-INT" && interrupt_is_ignored() { "-TERM" } else { signal }, &child);
    }
    let ended = Ended::from(child.wait_with_output().expect("it ends"));
    // About a second, and as much again for a machine that does other things besides.
    assert!(sent.elapsed() < Duration::from_secs(2), "{line}: {:?}", sent.elapsed());
    assert_eq!(ended.code, Some(130), "{line}: {}", ended.stderr);
    assert_eq!(ended.stdout, "");
    if signals.len() == 1 {
        assert_eq!(ended.stderr, "interrupted\n");
    }
    assert_eq!(folder.names(), ["s.scn"]);
}

#[test]
fn ctrl_c_stops_a_long_job() {
    stopped_by(&["-INT"], &format!("solve s.scn -o p.csv --report r.json {MANY_ROWS}"));
    stopped_by(&["-INT"], &format!("render s.scn -o p.png {MANY_ROWS}"));
}

#[test]
fn a_polite_kill_does_too() {
    stopped_by(&["-TERM"], &format!("factors s.scn -o p.npz {MANY_ROWS}"));
}

#[test]
fn even_where_a_single_row_is_long() {
    stopped_by(&["-INT"], &format!("solve s.scn -o p.csv {LONG_ROWS}"));
}

#[test]
fn a_second_ctrl_c_does_not_wait() {
    stopped_by(&["-INT", "-TERM"], &format!("solve s.scn -o p.csv {LONG_ROWS}"));
}

#[test]
fn a_picture_of_many_pixels_is_stopped_too() {
    stopped_by(&["-INT"], "render s.scn -o p.exr --precision 10 --size 16384x16384");
}

/// `nohup` and shells have a job ignore signals: so does it.
#[test]
fn what_the_parent_ignores_is_ignored() {
    let folder = Folder::with("s.scn", FURNACE);
    let script = format!(
        "trap '' INT; exec '{}' solve s.scn -o p.csv --method hemicube-rays --precision 60",
        env!("CARGO_BIN_EXE_radiosity")
    );
    let mut command = Command::new("sh");
    command.args(["-c", &script]).current_dir(folder.root()).stderr(Stdio::piped());
    let child = command.spawn().expect("it runs");
    thread::sleep(Duration::from_millis(100));
    send("-INT", &child);
    let ended = Ended::from(child.wait_with_output().expect("it ends"));
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    assert_eq!(folder.names(), ["p.csv", "s.scn"]);
}
