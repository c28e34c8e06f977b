//! Help, and what is refused before a scene is even opened.

use crate::folder::{FURNACE, Folder};

const COMMANDS: [&str; 5] = ["render", "solve", "factors", "info", "view"];

#[test]
fn help_goes_to_standard_output() {
    let folder = Folder::new();
    let help = folder.run("--help").done();
    assert_eq!(help.stderr, "");
    for command in COMMANDS {
        assert!(help.stdout.contains(command), "{command}");
        let own = folder.run(&format!("{command} --help")).done();
        assert!(own.stdout.contains(&format!("Usage: radiosity {command}")), "{}", own.stdout);
        assert!(own.stdout.contains("Example"), "{}", own.stdout);
        assert_eq!(folder.run(&format!("help {command}")).done().stdout, own.stdout);
    }
}

#[test]
fn help_tells_every_common_option_and_its_default() {
    let folder = Folder::new();
    for command in ["render", "solve", "factors", "info"] {
        let help = folder.run(&format!("{command} --help")).done().stdout;
        for told in [
            "--precision",
            "[default: 100]",
            "--subdivision",
            "[default: 1.0]",
            "--patch-size",
            "--patches",
            "--epsilon",
            "[default: 1e-6]",
            "--method",
            "[default: hemicube]",
            "--solver",
            "[default: gauss-seidel]",
            "--back-faces",
            "--threads",
            "--memory-limit",
            "--report",
            "--quiet",
        ] {
            assert!(help.contains(told), "{command} {told}: {help}");
        }
    }
}

#[test]
fn a_target_is_a_share() {
    let folder = Folder::with("s.scn", FURNACE);
    for (options, told) in [
        ("--target-error 2", "2%"),
        ("--target-error 0", "above 0"),
        ("--target-error 150%", "below 100%"),
        ("--most-patches 100", "--target-error"),
        ("--target-error 2% --smallest-patch -1", "above 0"),
    ] {
        folder.run(&format!("solve s.scn -o p.csv {options}")).refused(2, &[told]);
    }
}

#[test]
fn help_fits_a_terminal() {
    let folder = Folder::new();
    for command in COMMANDS {
        let help = folder.run(&format!("{command} --help")).done().stdout;
        for line in help.lines() {
            assert!(line.chars().count() <= 100, "{command}: {line}");
        }
    }
}

#[test]
fn the_version_is_told() {
    let version = Folder::new().run("--version").done();
    assert_eq!(version.stdout, format!("radiosity {}\n", env!("CARGO_PKG_VERSION")));
}

#[test]
fn no_command_shows_the_commands() {
    let ended = Folder::new().run("");
    assert_eq!(ended.code, Some(2));
    assert!(ended.stderr.contains("Usage: radiosity <COMMAND>"), "{}", ended.stderr);
}

#[test]
fn wrong_usage_is_told_and_nothing_is_written() {
    let folder = Folder::with("s.scn", FURNACE);
    for (line, told) in [
        ("rendre s.scn -o p.png", "'rendre'"),
        ("render", "<SCENE>"),
        ("render s.scn", "--output"),
        ("render s.scn -o p.png --presicion 30", "--precision"),
        ("render s.scn t.scn -o p.png", "t.scn"),
        ("render s.scn -o p.png --size 800", "800x600"),
        ("render s.scn -o p.png --size 800x", "height"),
        ("render s.scn -o p.png --size 0x600", "width"),
        ("render s.scn -o p.png --size 99999x600", "65535"),
        ("render s.scn -o p.png --size 65535x65535", "16384x16384"),
        ("render s.scn -o p.png --exposure bright", "expected a number"),
        ("render s.scn -o p.png --exposure nan", "expected a number"),
        ("render s.scn -o p.png --shading gouraud", "smooth, flat"),
        ("render s.scn -o p.png --tone-curve sepia", "neutral, reinhard, linear"),
        ("render s.scn -o p.png --precision 101", "100 or 102"),
        ("render s.scn -o p.png --precision 0", "at least 2"),
        ("render s.scn -o p.png --precision 1e2", "whole number"),
        ("render s.scn -o p.png --subdivision 0", "above 0"),
        ("render s.scn -o p.png --subdivision -1", "above 0"),
        ("render s.scn -o p.png --subdivision inf", "expected a number"),
        ("render s.scn -o p.png --patch-size 0", "above 0"),
        ("render s.scn -o p.png --patch-size nan", "expected a number"),
        ("render s.scn -o p.png --patches 0", "not in 1.."),
        ("render s.scn -o p.png --patches 1.5", "invalid digit"),
        ("render s.scn -o p.png --patch-size 1 --subdivision 2", "cannot be used with"),
        ("render s.scn -o p.png --patches 9 --subdivision 2", "cannot be used with"),
        ("render s.scn -o p.png --patches 9 --patch-size 2", "cannot be used with"),
        ("render s.scn -o p.png --epsilon 0", "above 0"),
        ("render s.scn -o p.png --epsilon nan", "expected a number"),
        ("render s.scn -o p.png --threads 0", "1..=1024"),
        ("render s.scn -o p.png --threads -1", "1..=1024"),
        ("render s.scn -o p.png --memory-limit 0", "above 0"),
        ("render s.scn -o p.png --method ray", "hemicube, hemicube-rays"),
        ("render s.scn -o p.png --method hemicube-exact --eyes 0", "1..=8"),
        ("render s.scn -o p.png --solver sor", "gauss-seidel"),
        ("render s.scn -o p.png --back-faces green", "black, lit"),
        ("render s.scn -o p.jpg", ".jpg"),
        ("render s.scn -o p", ".png or .exr"),
        ("render s.scn -o -", ".png or .exr"),
        ("render s.scn -o .png", ".png or .exr"),
        ("render s.scn -o p.png/", "folder"),
        ("solve s.scn -o p.png", ".csv or .npz or .glb or .gltf or .vtu"),
        ("factors s.scn -o p.csv", ".npz"),
        ("view", "<SCENE>"),
    ] {
        let ended = folder.run(line);
        assert_eq!(ended.code, Some(2), "{line}: {}", ended.stderr);
        ended.refused(2, &[told, "--help"]);
    }
    assert_eq!(folder.names(), ["s.scn"]);
}

#[test]
fn no_file_of_the_user_s_is_overwritten_by_mistake() {
    let folder = Folder::new();
    folder.write("s.csv", FURNACE);
    folder.run("solve s.csv -o s.csv").refused(2, &["overwrite"]);
    folder.run("solve s.csv -o ./s.csv").refused(2, &["overwrite"]);
    folder.run("solve s.csv -o t.csv --report s.csv").refused(2, &["overwrite"]);
    folder.run("solve s.csv -o t.csv --report ./t.csv").refused(2, &["overwrite"]);
    folder.run("info s.csv --report s.csv").refused(2, &["overwrite"]);
    assert_eq!(folder.text("s.csv"), FURNACE);
    assert_eq!(folder.names(), ["s.csv"]);
}

#[test]
fn an_output_that_cannot_be_written_is_refused_at_once() {
    let folder = Folder::with("s.scn", FURNACE);
    std::fs::create_dir(folder.path("folder.png")).expect("a folder");
    folder.run("render s.scn -o nowhere/p.png").refused(1, &["there is no folder nowhere"]);
    folder.run("render s.scn -o s.scn/p.png").refused(1, &["there is no folder s.scn"]);
    folder.run("render s.scn -o folder.png").refused(1, &["this is a folder"]);
    // A link is followed to where it leads.
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("nowhere/p.png", folder.path("link.png")).expect("a link");
        folder.run("render s.scn -o link.png").refused(1, &["link.png", "there is no folder"]);
        std::fs::remove_file(folder.path("link.png")).expect("it is there");
    }
    folder.run("solve s.scn -o p.csv --report nowhere/r.json").refused(1, &["--report", "nowhere"]);
    folder.run("solve s.scn -o p.csv --report folder.png").refused(1, &["--report", "this is a folder"]);
    assert_eq!(folder.names(), ["folder.png", "s.scn"]);
}

#[test]
fn a_file_that_is_write_protected_is_refused_at_once() {
    let folder = Folder::with("s.scn", FURNACE);
    folder.write("p.png", "precious");
    let mut permissions = std::fs::metadata(folder.path("p.png")).expect("it is there").permissions();
    permissions.set_readonly(true);
    std::fs::set_permissions(folder.path("p.png"), permissions).expect("its permissions");
    folder.run("render s.scn -o p.png").refused(1, &["write-protected"]);
    assert_eq!(folder.text("p.png"), "precious");
}

#[test]
fn a_picture_that_does_not_fit_the_memory_is_refused_at_once() {
    let folder = Folder::with("s.scn", FURNACE);
    let line = "render s.scn -o p.exr --precision 10 --size 16384x16384 --memory-limit 1";
    folder.run(line).refused(1, &["3.2 GB", "--size", "--memory-limit"]);
}

#[cfg(unix)]
#[test]
fn a_folder_that_is_read_only_is_refused_at_once() {
    use std::fs::{self, Permissions};
    use std::os::unix::fs::PermissionsExt;

    let folder = Folder::with("s.scn", FURNACE);
    let closed = folder.path("closed");
    fs::create_dir(&closed).expect("a folder");
    fs::set_permissions(&closed, Permissions::from_mode(0o555)).expect("its permissions");
    // The superuser may write anywhere: nothing is refused then.
    if fs::write(closed.join("probe"), "").is_err() {
        folder.run("render s.scn -o closed/p.png").refused(1, &["cannot write in the folder closed"]);
    }
    fs::set_permissions(&closed, Permissions::from_mode(0o755)).expect("its permissions");
}

#[cfg(unix)]
#[test]
fn the_window_is_a_program_of_its_own() {
    use std::fs::{self, Permissions};
    use std::os::unix::fs::PermissionsExt;

    let folder = Folder::with("s.scn", FURNACE);
    // A copy of the command, so that no viewer stands beside it.
    let own = folder.path("radiosity");
    fs::copy(env!("CARGO_BIN_EXE_radiosity"), &own).expect("a copy");
    let view = |path: &str| {
        let mut command = std::process::Command::new(&own);
        command.args(["view", "s.scn", "--precision", "30"]).current_dir(folder.root()).env("PATH", path);
        // A program just written is "busy" as long as a process that another test is starting holds it open.
        loop {
            match command.output() {
                Err(error) if error.kind() == std::io::ErrorKind::ExecutableFileBusy => {}
                output => {
                    let ended = crate::folder::Ended::from(output.expect("it runs"));
                    if !ended.stderr.contains("busy") {
                        return ended;
                    }
                }
            }
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
    };
    view("").refused(1, &["radiosity-viewer", "cargo build --release -p radiosity-viewer"]);

    // One on the PATH is found; one beside the command goes before it; its arguments and exit code are passed on.
    let install = |folder: &std::path::Path, says: &str| {
        fs::create_dir_all(folder).expect("a folder");
        let viewer = folder.join("radiosity-viewer");
        fs::write(&viewer, format!("#!/bin/sh\necho {says} \"$@\"\nexit 7\n")).expect("a script");
        fs::set_permissions(&viewer, Permissions::from_mode(0o755)).expect("its permissions");
    };
    let elsewhere = folder.path("elsewhere");
    install(&elsewhere, "elsewhere");
    let ended = view(elsewhere.to_str().expect("UTF-8"));
    assert_eq!((ended.code, ended.stdout.as_str()), (Some(7), "elsewhere s.scn --precision 30\n"));
    install(folder.root(), "beside");
    let ended = view(elsewhere.to_str().expect("UTF-8"));
    assert_eq!((ended.code, ended.stdout.as_str()), (Some(7), "beside s.scn --precision 30\n"));
}
