//! Whatever bytes a .vsn file holds, reading it ends, and a camera that is read can be looked through.

#![no_main]

use libfuzzer_sys::fuzz_target;
use radiosity::scene::n3d;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(camera) = n3d::parse_view("fuzz.vsn", bytes) {
        assert!(camera.eye.is_finite());
        let (right, up, forward) = (camera.right, camera.up, camera.forward);
        assert!([right, up, forward].iter().all(|axis| (axis.length() - 1.0).abs() < 1e-9));
        assert!(right.dot(up).abs() < 1e-9 && up.dot(forward).abs() < 1e-9 && forward.dot(right).abs() < 1e-9);
        assert!(forward.cross(up).dot(right) > 0.5);
        assert!(camera.horizontal[0] < camera.horizontal[1] && camera.vertical[0] < camera.vertical[1]);
        assert!(camera.near >= 0.0 && camera.far > camera.near);
    }
});
