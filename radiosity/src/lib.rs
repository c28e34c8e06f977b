//! Radiosity of diffuse scenes.
//!
//! Light travels one way, and so does this library:
//!
//! ```text
//! Scene -> Patches -> FormFactors -> Solution -> Picture
//! ```

// In the order light travels: a module imports only from those above it.
pub mod geometry;
pub mod light;
pub mod watch;
pub mod scene;
pub mod patches;
pub mod visibility;
pub mod form_factors;
pub mod solve;
pub mod shade;
pub mod export;
pub mod bake;
