//! `radiosity info`.

use crate::folder::{FURNACE, Folder, LAMP, VIEW};

/// The text after a label.
#[track_caller]
fn line<'a>(told: &'a str, label: &str) -> &'a str {
    let found = told.lines().find_map(|line| line.strip_prefix(label)).map(str::trim);
    found.unwrap_or_else(|| panic!("no '{label}' in: {told}"))
}

#[test]
fn it_tells_what_is_in_a_scene() {
    let folder = Folder::with("s.scn", LAMP);
    let told = folder.run("info s.scn").done().stdout;
    assert_eq!(line(&told, "scene"), "s.scn");
    assert_eq!(line(&told, "objects"), "2 parallelograms, 1 polygon");
    assert_eq!(line(&told, "lights"), "1");
    assert_eq!(line(&told, "patches"), "41");
    assert_eq!(line(&told, "area"), "6");
    assert!(line(&told, "power").starts_with("20 20 20"));
    assert_eq!(line(&told, "reflectance"), "0 to 0.8");
    assert_eq!(line(&told, "from"), "0 0 0");
    assert_eq!(line(&told, "to"), "2 2 1.5");
    assert_eq!(line(&told, "back faces"), "lit");
    assert!(line(&told, "camera").ends_with("(chosen: there is no .vsn)"));
    assert!(line(&told, "memory").contains("form factors"));
    assert!(line(&folder.run("info s.scn --subdivision 2").done().stdout, "patches").starts_with("161"));
    folder.write("s.vsn", VIEW);
    assert!(line(&folder.run("info s.scn").done().stdout, "camera").starts_with("at 0.5 "));
}

#[test]
fn it_tells_scripts_the_same() {
    let folder = Folder::with("s.scn", LAMP);
    let told = folder.run("info s.scn --json --report r.json").done().stdout;
    let told: serde_json::Value = serde_json::from_str(&told).expect("JSON");
    assert_eq!(told["patches"], 41);
    assert_eq!(told["objects"]["parallelograms"], 2);
    assert_eq!(told["total_area"], 6.0);
    assert!(told["need"]["bytes"].as_u64().is_some_and(|bytes| bytes > 0));
    assert!(told["refused"].is_null() && told["camera"]["from"] == "framed");
    let report = folder.json("r.json");
    assert_eq!(report["patches"], 41);
    assert!(report["form_factors"].is_null() && report["solve"].is_null());
}

#[test]
fn it_tells_of_what_cannot_be_solved() {
    let folder = Folder::with("s.scn", FURNACE);
    for options in ["--memory-limit 0.00001", "--subdivision 2000", "--subdivision 1e12"] {
        let told = folder.run(&format!("info s.scn {options}")).done().stdout;
        assert_eq!(line(&told, "area"), "6", "{options}");
        assert!(line(&told, "refused").contains("subdivision"), "{options}");
    }
    let told = folder.run("info s.scn --memory-limit 0.00005").done().stdout;
    assert!(told.contains("rows are recomputed"), "{told}");
    folder.write("s.scn", FURNACE.replace("CD 0.5", "CD 1.5"));
    assert!(line(&folder.run("info s.scn").done().stdout, "reflectance").contains("need not settle"));
}

#[test]
fn it_foretells_the_memory_that_a_solution_takes() {
    // The rows are most of it: 1,350 patches, each of which sees most of the others.
    let folder = Folder::with("s.scn", FURNACE);
    let told = folder.run("info s.scn --subdivision 5 --json").done().stdout;
    let told: serde_json::Value = serde_json::from_str(&told).expect("JSON");
    folder.run("solve s.scn --subdivision 5 --threads 2 -o s.csv --report r.json").done();
    let report = folder.json("r.json");
    assert_eq!(report["patches"], told["patches"]);
    let (need, peak) = (&told["need"]["bytes"], &report["peak_memory_bytes"]);
    // Only where the system tells.
    if let (Some(need), Some(peak)) = (need.as_f64(), peak.as_f64()) {
        assert!((need / peak - 1.0).abs() < 0.2, "foretold {need}, taken {peak}");
    }
}

#[test]
fn it_tells_what_a_patch_size_would_give() {
    let folder = Folder::with("s.scn", LAMP);
    let patches = |options: &str| {
        let told = folder.run(&format!("info s.scn {options}")).done().stdout;
        line(&told, "patches").to_owned()
    };
    assert_eq!(patches("--patch-size 100"), "3, no edge longer than 100");
    let told = folder.run("info s.scn --patches 1000 --json").done().stdout;
    let told: serde_json::Value = serde_json::from_str(&told).expect("JSON");
    let count = told["patches"].as_u64().expect("a number");
    assert!((900..=1020).contains(&count), "{count}");
    assert!(told["subdivision"].is_null());
    let size = told["patch_size"].as_f64().expect("a number");
    // The same size asked for gives the same patches.
    let again = patches(&format!("--patch-size {size}"));
    assert!(again.replace(',', "").starts_with(&format!("{count} no edge")), "{again}");
    let told = folder.run("info s.scn --patch-size 1e-9").done().stdout;
    assert!(line(&told, "refused").contains("larger --patch-size"), "{told}");
    folder.run("info s.scn --patches 2").refused(1, &["as few as 2 patches", "at least 3"]);
}

#[test]
fn it_names_surfaces_that_lie_on_one_another() {
    let folder = Folder::new();
    let square = "QD 2 2 0 0 0 1 0 0 1 1 0 0 1 0 CD .5 .5 .5 ID\n";
    folder.write("s.scn", format!("{square}SP ID\n  PG 1 1 0 0 1 0 0 0 0 1 0 0 1 1 0 ID"));
    let ended = folder.run("info s.scn");
    assert!(
        ended.stderr.contains("s.scn:3:3: object 2 lies exactly on object 0 of line 1"),
        "{}",
        ended.stderr
    );
    let told: serde_json::Value =
        serde_json::from_str(&folder.run("info s.scn --json -q").done().stdout).expect("JSON");
    assert_eq!(told["coincident"], serde_json::json!([[0, 2]]));
    assert_eq!((&told["objects"]["spheres"], &told["objects"]["polygons"]), (&1.into(), &1.into()));
}

#[test]
fn it_tells_of_what_is_split_and_what_overlaps() {
    let folder = Folder::new();
    // A wall on a floor of 4 cells, across all of them, and a rug in the floor's plane half beyond it.
    let floor = "QD 2 2 0 0 0 4 0 0 4 4 0 0 4 0 CD .5 .5 .5 ID\n";
    let wall = "QD 1 1 1 0 0 1 4 0 1 4 2 1 0 2 CE 1 1 1 ID\n";
    folder.write("s.scn", format!("{floor}{wall}"));
    let patches = |options: &str| {
        let told = folder.run(&format!("info s.scn --json -q {options}")).done().stdout;
        let told: serde_json::Value = serde_json::from_str(&told).expect("JSON");
        (told["patches"].as_u64(), told["split"].as_u64())
    };
    assert_eq!(patches(""), (Some(5), None));
    assert_eq!(patches("--split on"), (Some(7), Some(2)));
    assert_eq!(patches("--patch-size 2"), (Some(8), Some(2)));
    assert_eq!(patches("--patch-size 2 --split off"), (Some(6), None));
    let (graded, more) = patches("--patch-size 2 --grading 2");
    assert!(graded > Some(50) && more.is_some(), "{graded:?}");
    let told = folder.run("info s.scn --split on").done().stdout;
    assert!(told.contains("of which 2 for surfaces split"), "{told}");
    folder.run("solve s.scn --split on -o s.csv --report r.json").done();
    assert_eq!(folder.json("r.json")["patches"], 7);
    folder.run("info s.scn --grading 7").refused(2, &["--grading"]);

    folder.write("s.scn", format!("{floor}QD 1 1 3 1 0 5 1 0 5 2 0 3 2 0 CD .5 .5 .5 ID"));
    let ended = folder.run("info s.scn");
    let told = "s.scn:2:1: object 1 lies on object 0 of line 1 in one plane, over an area of 1 ";
    assert!(ended.stderr.contains(told), "{}", ended.stderr);
}
