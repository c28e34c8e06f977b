//! Bad scenes: one error with its place and a cure, no file written, nothing left behind.

use std::process::Stdio;

use crate::folder::{Ended, FURNACE, Folder, VIEW};

/// `scene` is refused by every command, at `place`.
#[track_caller]
fn refused_at(scene: &str, place: &str, words: &[&str]) {
    let folder = Folder::with("bad.scn", scene);
    for line in
        ["render bad.scn -o p.png", "solve bad.scn -o p.csv", "factors bad.scn -o p.npz", "info bad.scn"]
    {
        let ended = folder.run(line).refused(1, &[&format!("--> bad.scn:{place}\n"), "help: "]);
        for word in words {
            assert!(ended.stderr.contains(word), "'{word}' is not in: {}", ended.stderr);
        }
    }
    assert_eq!(folder.names(), ["bad.scn"]);
}

#[test]
fn a_word_in_place_of_a_number() {
    refused_at("QD 4 8\n  0 0 0  1 0 0  oops 0 0  0 1 0 ID\n", "2:17", &["2 |", "oops", "^^^^"]);
}

#[test]
fn a_word_that_is_no_keyword() {
    refused_at("QD 1 1 0 0 0 1 0 0 1 1 0 0 1 0\nXX 1 2 3\nID\n", "2:1", &["XX"]);
    refused_at("qd 1 1 0 0 0 1 0 0 1 1 0 0 1 0 ID\n", "1:1", &["qd"]);
}

#[test]
fn a_file_that_ends_too_soon() {
    let end = "OC\nQD 4 8\n  0 0 0  1 0 0\n";
    let folder = Folder::with("bad.scn", end);
    folder.run("solve bad.scn -o p.csv").refused(1, &["--> bad.scn:", "QD needs 4 points", "help: "]);
    assert_eq!(folder.names(), ["bad.scn"]);
}

#[test]
fn numbers_that_are_none() {
    for number in ["nan", "1e999", "0x10", "1,5"] {
        let scene = format!("QD 1 1\n 0 0 {number}  1 0 0  1 1 0  0 1 0 ID\n");
        refused_at(&scene, "2:6", &[]);
    }
}

#[test]
fn files_that_are_no_text() {
    let folder = Folder::new();
    folder.write("bad.scn", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR");
    folder.run("info bad.scn").refused(1, &["bad.scn", "help: "]);
    folder.write("bad.scn", "");
    folder.run("info bad.scn").refused(1, &["bad.scn"]);
    folder.write("bad.scn", "# nothing but a comment\n");
    folder.run("solve bad.scn -o p.csv").refused(1, &["bad.scn"]);
    assert_eq!(folder.names(), ["bad.scn"]);
}

#[test]
fn files_that_are_not_there() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("folder.scn")).expect("a folder");
    folder.run("render none.scn -o p.png").refused(1, &["none.scn"]);
    folder.run("render folder.scn -o p.png").refused(1, &["folder.scn"]);
    folder.write("s.scn", FURNACE);
    folder.run("render s.scn -o p.png --camera none.vsn").refused(1, &["none.vsn"]);
    assert_eq!(folder.names(), ["folder.scn", "s.scn"]);
}

#[test]
fn a_view_that_is_wrong() {
    let folder = Folder::with("s.scn", FURNACE);
    folder.write("bad.vsn", "0 0 here\n");
    folder
        .run("render s.scn -o p.png --camera bad.vsn")
        .refused(1, &["--> bad.vsn:1:5\n", "0 0 here", "help: "]);
    // The one beside the scene is read too.
    folder.write("s.vsn", VIEW.replace("0.4", "-0.4"));
    folder.run("render s.scn -o p.png").refused(1, &["--> s.vsn:2:6\n"]);
    assert_eq!(folder.names(), ["bad.vsn", "s.scn", "s.vsn"]);
}

/// Where in its line the excerpt has `fault`, and where the line below has its caret, in characters.
fn columns(ended: &Ended, fault: &str) -> (Option<usize>, Option<usize>) {
    let mut lines = ended.stderr.lines().skip_while(|line| !line.contains("-->")).skip(2);
    let mut column = |what: &str| {
        let line = lines.next()?;
        Some(line[..line.find(what)?].chars().count())
    };
    (column(fault), column("^"))
}

#[test]
fn the_caret_stands_under_the_fault() {
    for (scene, place) in [
        ("QD oops\n", "1:4"),
        ("\tQD\t4 oops\n", "1:7"),
        ("\t\t\t\toops\n", "1:5"),
        ("\u{feff}QD oops\n", "1:4"),
        ("QD 4\r\n  oops\r\n", "2:3"),
    ] {
        let folder = Folder::with("bad.scn", scene);
        let ended = folder.run("info bad.scn").refused(1, &[&format!("bad.scn:{place}\n")]);
        let (fault, caret) = columns(&ended, "oops");
        assert!(fault.is_some() && fault == caret, "{scene:?}: {}", ended.stderr);
    }
}

#[test]
fn a_very_long_line_is_cut_and_its_columns_are_true() {
    let scene = format!("{}oops", "QD 1 1 0 0 0 1 0 0 1 1 0 0 1 0 ID ".repeat(20_000));
    let folder = Folder::with("bad.scn", &scene);
    let ended = folder.run("info bad.scn").refused(1, &[&format!("bad.scn:1:{}\n", scene.len() - 3)]);
    assert!(ended.stderr.len() < 1000, "{}", ended.stderr.len());
    let (fault, caret) = columns(&ended, "oops");
    assert!(fault.is_some() && fault == caret, "{}", ended.stderr);
}

#[test]
fn colour_is_for_terminals() {
    let folder = Folder::with("bad.scn", "QD oops\n");
    let plain = folder.run("info bad.scn").refused(1, &[]);
    assert!(!plain.stderr.contains('\x1b'), "{:?}", plain.stderr);
    let forced = folder.command("info bad.scn").env("CLICOLOR_FORCE", "1").output().expect("it runs");
    assert!(Ended::from(forced).stderr.contains('\x1b'));
}

#[test]
fn what_a_stranger_wrote_does_not_reach_the_terminal() {
    let folder = Folder::with("bad.scn", "QD \x1b[31moops\x1b]0;title\x07\n");
    let output = folder.command("info bad.scn").env("CLICOLOR_FORCE", "1").output().expect("it runs");
    let stderr = Ended::from(output).stderr;
    assert!(!stderr.contains("\x1b[31moops") && !stderr.contains("\x1b]"), "{stderr:?}");
}

#[test]
fn a_scene_that_reflects_all_is_named_as_such() {
    let folder = Folder::with("bad.scn", FURNACE.replace("CD 0.5 0.5 0.5", "CD 1.2 0.5 0.5"));
    folder.run("solve bad.scn -o p.csv --precision 20").refused(1, &["does not converge", "1.2"]);
    assert_eq!(folder.names(), ["bad.scn"]);
}

#[test]
fn a_scene_too_large_for_the_memory_is_refused() {
    let folder = Folder::with("s.scn", FURNACE);
    folder
        .run("solve s.scn -o p.csv --memory-limit 0.00001")
        .refused(1, &["--memory-limit", "--subdivision"]);
    folder.run("solve s.scn -o p.csv --subdivision 2000").refused(1, &["--memory-limit", "--subdivision"]);
    folder.run("solve s.scn -o p.csv --subdivision 1e9").refused(1, &["subdivision"]);
    assert_eq!(folder.names(), ["s.scn"]);
}

#[test]
fn a_reader_that_has_had_enough_is_no_error() {
    let folder = Folder::with("s.scn", FURNACE);
    for line in ["info s.scn", "info s.scn --json", "--help"] {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let output = folder.command(line).stdout(writer).output().expect("it runs");
        let ended = Ended::from(output);
        assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""), "{line}");
    }
}

#[test]
fn nobody_to_tell_an_error_to() {
    let folder = Folder::with("bad.scn", "QD oops\n");
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    let status = folder.command("info bad.scn").stdout(Stdio::null()).stderr(writer).status();
    assert_eq!(status.expect("it runs").code(), Some(1));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error() {
    let folder = Folder::with("s.scn", FURNACE);
    let full = std::fs::File::create("/dev/full").expect("Linux has one");
    let output = folder.command("info s.scn").stdout(full).output().expect("it runs");
    Ended::from(output).refused(1, &["standard output"]);
}
