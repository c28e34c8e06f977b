//! Whatever bytes a .scn file holds, reading it ends, and a scene that is read can be cut into patches.

#![no_main]

mod sound;

use libfuzzer_sys::fuzz_target;
use radiosity::geometry::polygon;
use radiosity::patches::{self, Subdivision};
use radiosity::scene::{Shape, n3d};

fuzz_target!(|bytes: &[u8]| match n3d::parse_scene("fuzz.scn", bytes) {
    Err(error) => sound::error_in_text(&error),
    Ok(scene) => {
        assert!(!scene.surfaces.is_empty());
        for surface in &scene.surfaces {
            assert!(surface.shape.vertices().iter().all(|vertex| vertex.is_finite()));
            if let Shape::Polygon(polygon) = &surface.shape {
                assert!(polygon::triangulate(&polygon.vertices).is_some());
            }
        }
        for subdivision in [Subdivision::Factor(1.0), Subdivision::Patches(500)] {
            if patches::count(&scene, subdivision).map_or(true, |count| count >= 10_000) {
                continue;
            }
            let patches = patches::subdivide(&scene, subdivision).expect("few patches");
            sound::patches(&patches);
        }
    }
});
