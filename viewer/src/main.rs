//! The window: open a scene, watch its radiosity arrive, walk through the light.
fn main() {}
