//! Whatever bytes a .gltf or .glb file holds, reading it ends, and a scene that is read can be cut into patches and
//! looked at.

#![no_main]

mod sound;

use libfuzzer_sys::fuzz_target;
use radiosity::patches;
use radiosity::scene::{SceneError, check_meshes, gltf};

fuzz_target!(|bytes: &[u8]| match gltf::parse_scene("fuzz.gltf", bytes, |_| Ok(bytes.to_vec())) {
    Err(SceneError::File { message, .. }) => assert!(!message.is_empty()),
    Err(error @ SceneError::Syntax { .. }) => panic!("{error}: there are no lines"),
    Ok(scene) => {
        assert!(!scene.surfaces.is_empty());
        check_meshes(&scene);
        let patches = patches::subdivide(&scene, 1.0).expect("few patches");
        sound::patches(&patches);
        if let Some(camera) = scene.camera {
            let (right, up, forward) = (camera.right, camera.up, camera.forward);
            assert!([right, up, forward].iter().all(|axis| (axis.length() - 1.0).abs() < 1e-9));
            assert!(forward.cross(up).dot(right) > 0.5 && camera.far > camera.near);
        }
    }
});
