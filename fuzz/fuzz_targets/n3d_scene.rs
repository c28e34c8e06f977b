//! Whatever bytes a .scn file holds, reading it ends, and a scene that is read can be cut into patches.

#![no_main]

use libfuzzer_sys::fuzz_target;
use radiosity::geometry::polygon;
use radiosity::patches::{self, Subdivision};
use radiosity::scene::{SceneError, Shape, n3d};

fuzz_target!(|bytes: &[u8]| match n3d::parse_scene("fuzz.scn", bytes) {
    Err(SceneError::Syntax { line, caret, length, place, message, help, .. }) => {
        assert!(place.line >= 1 && place.column >= 1 && length >= 1);
        assert!(caret as usize <= line.chars().count() && line.chars().count() < 200);
        assert!(!line.contains(['\n', '\r', '\t', '\0']) && !message.is_empty() && !help.is_empty());
    }
    Err(error @ SceneError::File { .. }) => panic!("{error}: nothing was opened"),
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
            assert!(patches.area.iter().all(|&area| area.is_finite() && area > 0.0));
            assert!(patches.normal.iter().all(|normal| (normal.length() - 1.0).abs() < 1e-9));
            assert!(patches.centre.iter().all(|centre| centre.is_finite()));
        }
    }
});
