//! Whatever bytes an .obj file holds, and its .mtl, reading it ends, and a scene that is read can be cut into patches.

#![no_main]

use libfuzzer_sys::fuzz_target;
use radiosity::patches;
use radiosity::scene::{SceneError, check_meshes, obj};

fuzz_target!(|bytes: &[u8]| {
    // The file is its own material file, should it name one.
    match obj::parse_scene("fuzz.obj", bytes, |_| Some(Ok(("fuzz.mtl".into(), bytes.to_vec())))) {
        Err(SceneError::Syntax { line, caret, length, place, message, help, .. }) => {
            assert!(place.line >= 1 && place.column >= 1 && length >= 1);
            assert!(caret as usize <= line.chars().count() && line.chars().count() < 200);
            assert!(!line.contains(['\n', '\r', '\t', '\0']) && !message.is_empty() && !help.is_empty());
        }
        Err(error @ SceneError::File { .. }) => panic!("{error}: nothing was opened"),
        Ok(scene) => {
            assert!(!scene.surfaces.is_empty());
            check_meshes(&scene);
            let patches = patches::subdivide(&scene, 1.0).expect("few patches");
            assert!(patches.area.iter().all(|&area| area.is_finite() && area > 0.0));
            assert!(patches.normal.iter().all(|normal| (normal.length() - 1.0).abs() < 1e-9));
            assert!(patches.centre.iter().all(|centre| centre.is_finite()));
        }
    }
});
