//! The window: open a scene, watch its radiosity arrive, walk through the light.
mod view3d;
fn main() {}
