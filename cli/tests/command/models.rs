//! Scenes from modelling programs, and solved scenes for viewers.

use crate::folder::{Folder, LAMP, VIEW};

const MTL: &str = "newmtl matt\nKd .5 .5 .5\nnewmtl lamp\nKe 9 9 9\n";
/// A floor of one square and a lamp over it that faces down.
const OBJ: &str = "mtllib s.mtl\nv 0 0 0\nv 0 0 1\nv 1 0 1\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 1 1 1\nv 0 1 1\n\
                   g floor\nusemtl matt\nf 1 2 3 4\ng lamp\nusemtl lamp\nf 5 6 7 8\n";

#[test]
fn an_obj_is_solved_and_shown() {
    let folder = Folder::with("s.obj", OBJ);
    folder.write("s.mtl", MTL);
    folder.write("s.vsn", VIEW);
    folder.run("render s.obj -o p.png --precision 20 --size 40x30").done();
    let told = folder.run("info s.obj").done().stdout;
    assert!(told.contains("2 meshes of 4 triangles") && told.contains("back faces    black"), "{told}");
    assert!(told.contains("8 open edges, such as at 0 0 0.5 of floor"), "{told}");
    assert!(told.contains("(the scene's own)"), "{told}");
    folder.run("solve s.obj -o s.csv --precision 20").done();
    assert_eq!(folder.text("s.csv").lines().count(), 5);
}

#[test]
fn a_missing_material_file_is_a_warning_and_darkness_another() {
    let folder = Folder::with("s.obj", OBJ);
    let ended = folder.run("solve s.obj -o s.csv --precision 20").done();
    for told in ["s.obj:1:1: there is no material file s.mtl", "no surface emits light", "Ke"] {
        assert!(ended.stderr.contains(told), "{}", ended.stderr);
    }
}

#[test]
fn backs_before_the_camera_are_told() {
    let folder = Folder::with("s.obj", OBJ.replace("f 5 6 7 8", "f 8 7 6 5"));
    folder.write("s.mtl", MTL);
    // From between the two, straight up.
    folder.write("s.vsn", ".5 .5 .5  0 1 0  0 0 1  -.1 1  -1 1 -1 1  0 1 0 1  -.1 100");
    let ended = folder.run("render s.obj -o p.png --precision 20 --size 40x30").done();
    assert!(ended.stderr.contains("shows backs, which are black (lamp)"), "{}", ended.stderr);
    assert!(folder.run("info s.obj").done().stdout.contains("--back-faces lit"));
    let ended = folder.run("render s.obj -o p.png --precision 20 --size 40x30 --back-faces lit").done();
    assert!(!ended.stderr.contains("shows backs"), "{}", ended.stderr);
}

#[test]
fn a_fault_names_its_place_and_its_cure() {
    let folder = Folder::with("s.obj", "v 0 0 0\nf 1 2 3\n");
    folder.run("render s.obj -o p.png").refused(1, &["s.obj:2:5", "there is no vertex 2", "f 1 2 3"]);
    folder.write("s.glb", "glTF");
    folder.run("render s.glb -o p.png").refused(1, &["s.glb: the file is cut short"]);
    folder.write("s.gltf", "{\"asset\": {\"version\": \"2.0\"}}");
    folder.run("render s.gltf -o p.png").refused(1, &["s.gltf: the scene has no triangle"]);
    folder.run("render gone.glb -o p.png").refused(1, &["gone.glb: there is no such file"]);
}

/// N3D to glTF and back: the very same patches, and the very same light.
#[test]
fn a_solved_scene_is_read_back() {
    let folder =
        Folder::with("s.scn", LAMP.replace("TI  0 0 0  0 2 0  0 0 1", "QD 3 3  0 0 0  0 2 0  0 2 1  0 0 1"));
    folder.run("solve s.scn -o s.csv --precision 30").done();
    for lit in ["lit.glb", "lit.gltf"] {
        folder.run(&format!("solve s.scn -o {lit} --precision 30")).done();
        folder.run(&format!("solve {lit} -o again.csv --precision 30")).done();
        assert!(folder.text("again.csv") == folder.text("s.csv"), "{lit}");
    }
    folder.run("solve s.scn -o s.vtu --precision 30").done();
    assert!(folder.text("s.vtu").contains("Name=\"irradiance\""));
}

#[test]
fn a_light_map_stands_in_the_model_and_its_light_beside() {
    let folder = Folder::with("s.scn", LAMP);
    folder.run("solve s.scn -o s.csv --precision 20").done();
    let line =
        "solve s.scn -o lit.gltf --precision 20 --light-map 64 --irradiance-map h.exr --radiosity-map b.exr";
    let ended = folder.run(line).done();
    assert!(ended.stderr.contains("light map") && ended.stderr.contains("3 charts"), "{}", ended.stderr);
    let written = folder.json("lit.gltf");
    assert_eq!(written["images"][0]["mimeType"], "image/png");
    assert!(written["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"].is_u64());
    for exr in ["h.exr", "b.exr"] {
        assert_eq!(folder.read(exr)[..4], [0x76, 0x2f, 0x31, 0x01], "{exr}");
    }
    // As many threads as there be, the same bits; and the same scene again.
    folder.run(&line.replace("lit.gltf", "one.gltf --threads 1").replace("b.exr", "c.exr")).done();
    assert!(folder.read("one.gltf") == folder.read("lit.gltf"));
    assert!(folder.read("b.exr") == folder.read("c.exr"));
    folder.run("solve lit.gltf -o again.csv --precision 20").done();
    assert!(folder.text("again.csv") == folder.text("s.csv"));
}

#[test]
fn light_maps_that_cannot_be_are_refused_before_anything_is_solved() {
    let folder = Folder::with("s.scn", LAMP);
    let refused = |options: &str, code: i32, words: &[&str]| {
        folder.run(&format!("solve s.scn {options}")).refused(code, words);
        assert_eq!(folder.names(), ["s.scn"]);
    };
    refused("-o s.csv --light-map 64", 2, &["--light-map is for models", "s.csv", ".glb or .gltf"]);
    refused("-o s.glb --light-map 15", 2, &["15", "16..=16384"]);
    refused("-o s.glb --light-map many", 2, &["many"]);
    refused("-o s.glb --irradiance-map h.exr", 2, &["--light-map"]);
    refused("-o s.glb --light-map 64 --irradiance-map h.png", 2, &["--irradiance-map h.png", ".exr"]);
    let both = "--irradiance-map h.exr --radiosity-map h.exr";
    refused(&format!("-o s.glb --light-map 64 {both}"), 2, &["--radiosity-map h.exr", "overwrite"]);
    refused("-o s.glb --light-map 64 --radiosity-map gone/b.exr", 1, &["no folder gone"]);
    refused("-o s.glb --light-map 16384 --memory-limit 1", 1, &["13 GB", "limit is 1.0 GB", "--light-map"]);
    let lamps = "TI 0 0 0 0 2 0 0 0 1 CE 1 1 1 ID ".repeat(200);
    folder.write("many.scn", lamps);
    let told = ["200 charts do not fit into a light map of 64 x 64", "side of 128"];
    folder.run("solve many.scn -o s.glb --light-map 64").refused(1, &told);
}

#[test]
fn what_a_model_is_seen_by_is_for_models() {
    let folder = Folder::with("s.scn", LAMP);
    folder.write("v.vsn", VIEW);
    let ended = folder.run("solve s.scn -o s.csv --precision 20 --exposure 1").done();
    assert!(ended.stderr.contains("play no part"), "{}", ended.stderr);
    let ended = folder.run("solve s.scn -o s.gltf --precision 20 --exposure 1 --camera v.vsn").done();
    assert!(ended.stderr.contains("exposure +1.00 EV"), "{}", ended.stderr);
    let written = folder.json("s.gltf");
    assert_eq!(written["asset"]["extras"]["radiosity"]["exposure"], 1.0);
    let camera = written["nodes"].as_array().and_then(|nodes| nodes.iter().find(|node| node["camera"] == 0));
    assert_eq!(camera.map(|node| node["translation"][0].as_f64()), Some(Some(0.5)));
}
