//! Whatever bytes an .obj file holds, and its .mtl, reading it ends, and a scene that is read can be cut into patches.

#![no_main]

mod sound;

use libfuzzer_sys::fuzz_target;
use radiosity::patches;
use radiosity::scene::{check_meshes, obj};

fuzz_target!(|bytes: &[u8]| {
    // The file is its own material file, should it name one.
    match obj::parse_scene("fuzz.obj", bytes, |_| Some(Ok(("fuzz.mtl".into(), bytes.to_vec())))) {
        Err(error) => sound::error_in_text(&error),
        Ok(scene) => {
            assert!(!scene.surfaces.is_empty());
            check_meshes(&scene);
            let patches = patches::subdivide(&scene, 1.0).expect("few patches");
            sound::patches(&patches);
        }
    }
});
