//! `radiosity check`, and what it looks at: `--repair`, `--surroundings`.

use crate::folder::{FURNACE, Folder, LAMP};

/// The findings that `check` tells scripts of, and how it ended.
fn findings(folder: &Folder, options: &str) -> (Option<i32>, serde_json::Value) {
    let ended = folder.run(&format!("check s.scn --json --precision 30 {options}"));
    assert_eq!(ended.stderr, "");
    (ended.code, serde_json::from_str(&ended.stdout).expect("JSON"))
}

/// The verdict on `what`; none where nothing is told of it.
fn verdict<'a>(findings: &'a serde_json::Value, what: &str) -> Option<&'a str> {
    let all = findings["findings"].as_array().expect("a list");
    all.iter().find(|finding| finding["what"] == what).and_then(|finding| finding["verdict"].as_str())
}

#[test]
fn a_furnace_is_all_right() {
    let folder = Folder::with("s.scn", FURNACE);
    let told = folder.run("check s.scn").done().stdout;
    assert!(told.lines().count() > 5 && told.lines().all(|line| line.starts_with("ok ")), "{told}");
    let (code, found) = findings(&folder, "");
    assert_eq!((code, &found["wrong"], &found["patches"]), (Some(0), &0.into(), &96.into()));
}

#[test]
fn what_is_wrong_is_named_with_its_cure() {
    let side = "QD 4 4  1 0 0  1 0 1  1 1 1  1 1 0  ID\n";
    assert!(FURNACE.contains(side));
    for (what, name, scene) in [
        // A slit, a hundredth wide, where a side does not reach the ceiling.
        ("leaks", "surface 4", FURNACE.replace(side, "QD 4 4  1 0 0  1 0 .99  1 1 .99  1 1 0  ID\n")),
        ("duplicates", "surface 4", FURNACE.replace(side, &format!("{side}{side}"))),
        ("black backs", "surface 0", FURNACE.replace(side, "QD 4 4  1 0 0  1 1 0  1 1 1  1 0 1  ID\n")),
        ("reflectance", "surface 0", FURNACE.replace("CD 0.5 0.5", "CD 0.5 1.2")),
        ("solution", "does not converge", FURNACE.replace("CD 0.5 0.5", "CD 0.5 1.2")),
        ("lamps", "nothing emits", FURNACE.replace("CE 1 1 1", "")),
    ] {
        let folder = Folder::with("s.scn", &scene);
        let (code, found) = findings(&folder, "--back-faces black");
        assert_eq!((code, verdict(&found, what)), (Some(1), Some("wrong")), "{what}: {found}");
        let told = folder.run("check s.scn --precision 30 --back-faces black").stdout;
        let line =
            told.lines().find(|line| line.starts_with("WRONG") && line.contains(what)).expect("a line");
        assert!(line.contains(name), "{told}");
    }
}

#[test]
fn an_open_scene_is_no_leak_and_a_lamp_that_looks_away_is_wrong() {
    let folder = Folder::with("s.scn", LAMP);
    let (code, found) = findings(&folder, "");
    assert_eq!(
        (code, verdict(&found, "open"), verdict(&found, "leaks")),
        (Some(0), Some("note"), None),
        "{found}"
    );
    // The lamp turned up, to the empty sky.
    let up = "0.5 0.5 1.5  1.5 0.5 1.5  1.5 1.5 1.5  0.5 1.5 1.5";
    folder.write("s.scn", LAMP.replace("0.5 0.5 1.5  0.5 1.5 1.5  1.5 1.5 1.5  1.5 0.5 1.5", up));
    let (code, found) = findings(&folder, "--back-faces black");
    assert_eq!((code, verdict(&found, "seeing nothing")), (Some(1), Some("wrong")), "{found}");
}

#[test]
fn repaired_form_factors_close_to_the_last_digit() {
    let folder = Folder::with("s.scn", LAMP);
    let run = |options: &str| {
        folder.run(&format!("factors s.scn -o f.npz --precision 30 --report r.json {options}")).done()
    };
    run("");
    assert!(folder.json("r.json")["form_factors"]["repair"].is_null());
    let single = folder.read("f.npz").len();
    let told = run("--repair --with-surroundings").stderr;
    assert!(told.contains("rows closed from"), "{told}");
    let repair = &folder.json("r.json")["form_factors"]["repair"];
    assert!(repair["closure_before"].as_f64() > Some(1e-4) && repair["closure_after"].as_f64() < Some(1e-12));
    assert!(folder.read("f.npz").len() > single, "in double precision, with a column more");
}

#[test]
fn amid_bright_surroundings_all_is_as_bright() {
    // E = 1 - ρ and surroundings of radiosity 1: B = 1 on all of an open scene.
    let folder = Folder::with("s.scn", LAMP.replace("CE 20 20 20", "CD .3 .3 .3 CE .7 .7 .7"));
    let text = folder.text("s.scn").replace("CD 0.7 0.6 0.5", "CD .6 .6 .6 CE .4 .4 .4");
    folder.write("s.scn", text.replace("CD 0.2 0.8 0.2", "CD .2 .2 .2 CE .8 .8 .8"));
    for options in ["--surroundings 1", "--surroundings 1,1,1 --repair --solver cg"] {
        folder.run(&format!("solve s.scn -o s.csv --precision 30 {options}")).done();
        for line in folder.text("s.csv").lines().skip(1) {
            let radiosity: f64 = line.rsplit(',').next().expect("a column").parse().expect("a number");
            assert!((radiosity - 1.0).abs() < 1e-5, "{options}: {line}");
        }
    }
    folder.run("solve s.scn -o s.csv --surroundings warm").refused(2, &["293K"]);
    folder.run("solve s.scn -o s.csv --surroundings 1,2").refused(2, &["293K"]);
}
