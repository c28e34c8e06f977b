//! Views: the camera that N3D's numbers describe, and the files they stand in.

use std::fs;

use glam::DVec3;
use radiosity::scene::n3d::{parse_view, read, read_view};
use radiosity::scene::{self, SceneError};

/// N3D's own default camera.
const DEFAULT: &str = "0 0 0  0 0 1  0 1 0  -1 0  -1 1 -1 1  0 1 0 1  -1 100";
const SCENE: &str = "TI 0 0 0 1 0 0 0 1 0 ID";

#[test]
fn the_default_camera_stands_one_behind_its_window() {
    let camera = parse_view("a.vsn", DEFAULT.as_bytes()).unwrap();
    assert_eq!(camera.eye, DVec3::NEG_Z);
    assert_eq!((camera.forward, camera.up), (DVec3::Z, DVec3::Y));
    assert_eq!(camera.right, DVec3::Z.cross(DVec3::Y));
    assert_eq!((camera.horizontal, camera.vertical), ([-1.0, 1.0], [-1.0, 1.0]));
    assert_eq!((camera.near, camera.far), (0.0, 101.0));
    assert_eq!(camera.viewport, [0.0, 1.0, 0.0, 1.0]);
}

#[test]
fn extents_are_counted_at_distance_one_and_up_is_made_perpendicular() {
    let text = "1 2 3  0 0 -5  0 3 -3  -6 -2  -2 6 -1 3  0 .5 0 1  -8 14 # behind the eye clips nothing";
    let camera = parse_view("a.vsn", text.as_bytes()).unwrap();
    assert_eq!(camera.eye, DVec3::new(1.0, 2.0, 9.0));
    assert_eq!((camera.right, camera.up), (DVec3::X, DVec3::Y));
    assert_eq!((camera.horizontal, camera.vertical), ([-0.5, 1.5], [-0.25, 0.75]));
    assert_eq!((camera.near, camera.far), (0.0, 20.0));
}

#[test]
fn each_fault_has_its_place() {
    let light = "1 1 1  1 1 1  0 0 0\n";
    // The numbers of the default camera, some of them changed; line 1 is PR VN VH, line 2 the rest.
    let view = |vectors: &str, rest: &str| format!("0 0 0 {vectors}\n{rest}");
    let good = "0 0 1 0 1 0";
    for (text, message) in [
        (String::new(), "1:1: the view holds no numbers: it begins with PR, the reference point"),
        ("0 0 0 1".into(), "1:7: VN, the direction of view, needs 3 numbers, the file ends after 1"),
        ("0 0 0 1 0 0".into(), "1:11: VH, the upward vector, needs 3 numbers, the file ends before them"),
        ("0 0\n TI".into(), "2:2: TI is not a number: views have no keywords"),
        ("0 0 x".into(), "1:5: `x` is not a number"),
        (view("0 0 0 0 1 0", "-1 0 -1 1 -1 1 0 1 0 1 -1 9"), "1:7: VN, the direction of view, is zero"),
        (view("0 0 1 0 0 0", "-1 0 -1 1 -1 1 0 1 0 1 -1 9"), "1:13: VH, the upward vector, is zero"),
        (
            view("0 0 1 0 0 2", "-1 0 -1 1 -1 1 0 1 0 1 -1 9"),
            "1:13: VH, the upward vector, is parallel to VN, the direction of view",
        ),
        (
            view(good, "0 0 -1 1 -1 1 0 1 0 1 -1 9"),
            "2:3: DV, the distance of the window, is not greater than DO, that of the eye",
        ),
        (
            view(good, "0 1e-18 -1 1 -1 1 0 1 0 1 -1 9"),
            "2:3: DV, the distance of the window, is all but DO, that of the eye",
        ),
        (view(good, "-1 0 1 1 -1 1 0 1 0 1 -1 9"), "2:8: the window is empty"),
        (view(good, "-1 0 -1 1 2 1 0 1 0 1 -1 9"), "2:13: the window is empty"),
        (view(good, "-1 0 -1 1 -1 1 0 1.5 0 1 -1 9"), "2:18: the viewport reaches out of 0..1"),
        (view(good, "-1 0 -1 1 -1 1 0 0 0 1 -1 9"), "2:18: the viewport is empty"),
        (
            view(good, "-1 0 -1 1 -1 1 0 1 0 1 -9 -2"),
            "2:27: DY, the far clipping plane, lies behind the eye: nothing is seen",
        ),
        (
            view(good, "-1 0 -1 1 -1 1 0 1 0 1 5 4"),
            "2:26: DY, the far clipping plane, does not lie behind DH, the near one",
        ),
        (format!("{DEFAULT}\n1 2"), "2:3: light 1 needs 9 numbers, the file ends after 2"),
        (format!("{DEFAULT}\n{}7", light.repeat(8)), "10:1: `7` after 8 lights: a view has no more"),
    ] {
        let error = parse_view("a.vsn", text.as_bytes()).unwrap_err();
        assert_eq!(error.to_string(), format!("a.vsn:{message}"));
        assert!(matches!(error, SceneError::Syntax { help, .. } if !help.is_empty()));
    }
    assert!(parse_view("a.vsn", format!("{DEFAULT}\n{}", light.repeat(8)).as_bytes()).is_ok());
}

#[test]
fn a_view_beside_its_scene_is_read_whatever_its_case() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("room.scn");
    fs::write(&scene, SCENE).unwrap();
    assert_eq!(read(&scene).unwrap().camera, None);
    fs::write(folder.path().join("ROOM.VSN"), format!("{DEFAULT} 1 1 1 1 1 1 0 0 0")).unwrap();
    let with_view = read(&scene).unwrap();
    assert!(with_view.camera.is_some());
    let warning = with_view.warnings[0].to_string();
    let expected = "ROOM.VSN:1:55: 1 point light is left out: in radiosity, light comes from objects with CE";
    assert!(warning.ends_with(expected), "{warning}");
    // The very name goes first, and what is wrong in it is wrong with the scene.
    let view = folder.path().join("room.vsn");
    fs::write(&view, "0 0 O").unwrap();
    let message = format!("{}:1:5: `O` is not a number", view.display());
    assert_eq!(read(&scene).unwrap_err().to_string(), message);
    assert_eq!(read_view(&view).unwrap_err().to_string(), message);
}

#[test]
fn files_that_cannot_be_read_say_why() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("kitchen.scn"), SCENE).unwrap();
    let told = |name: &str| {
        let error = scene::read(&folder.path().join(name)).unwrap_err();
        assert!(matches!(error, SceneError::File { .. }));
        error.to_string().replace(&format!("{}/", folder.path().display()), "")
    };
    assert_eq!(told("kitchn.scn"), "kitchn.scn: there is no such file: did you mean kitchen.scn?");
    assert_eq!(told("kitchen"), "kitchen: there is no such file: did you mean kitchen.scn?");
    assert_eq!(told("bathroom.scn"), "bathroom.scn: there is no such file: check its name and directory");
    assert_eq!(
        told("kitchen.vsn"),
        "kitchen.vsn: this is a view, a camera without a scene: name the .scn file it belongs to"
    );
    assert!(told("").ends_with("this is a directory: name a file in it, such as kitchen.scn"));
    // Longer than is read, though it takes no room on the disk.
    let huge = fs::File::create(folder.path().join("huge.scn")).unwrap();
    huge.set_len((1 << 30) + 1).unwrap();
    assert_eq!(
        told("huge.scn"),
        "huge.scn: the file is larger than 1 GiB, more than is read: split the scene"
    );
}

#[cfg(unix)]
#[test]
fn a_device_without_end_is_not_read_to_its_end() {
    let error = read(std::path::Path::new("/dev/zero")).unwrap_err();
    assert_eq!(error.to_string(), "/dev/zero:1:1: a NUL byte: the file is binary, not text");
}
