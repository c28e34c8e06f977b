//! Surfaces that the camera sees from behind, where that is black.

use radiosity::scene::{BackFaces, Camera, Scene};
use radiosity::shade;
use radiosity::visibility::Facets;
use serde::Serialize;

/// Less of the picture than this is what many a scene shows of its backs here and there.
const MUCH: f64 = 0.01;
/// Surfaces that are named.
const NAMED: usize = 3;

/// What the camera sees from behind.
#[derive(Debug, Serialize)]
pub(crate) struct Backs {
    /// Of the picture, 0 to 1.
    pub(crate) share: f64,
    /// Those that show most of it.
    pub(crate) surfaces: Vec<String>,
}

/// Black backs before the camera, where they are much of what it sees: as a rule they were wound the wrong way round.
pub(crate) fn seen(scene: &Scene, facets: &Facets, camera: &Camera, back_faces: BackFaces) -> Option<Backs> {
    if back_faces == BackFaces::Lit {
        return None;
    }
    let seen = shade::backs_seen(facets, camera);
    let share = seen.iter().map(|(_, share)| share).sum();
    let surfaces = seen.iter().take(NAMED).map(|&(surface, _)| named(scene, surface)).collect();
    (share > MUCH).then_some(Backs { share, surfaces })
}

impl Backs {
    /// In plain words, with the cure.
    pub(crate) fn told(&self) -> String {
        format!(
            "{:.0} % of the picture shows backs, which are black ({}): turn them round, or use --back-faces lit",
            100.0 * self.share,
            self.surfaces.join(", ")
        )
    }
}

/// What messages call a surface: its name, else its number and place.
pub(crate) fn named(scene: &Scene, surface: u32) -> String {
    match &scene.surfaces[surface as usize] {
        one if !one.name.is_empty() => one.name.clone(),
        one if one.place.line > 0 => format!("surface {surface}, line {}", one.place.line),
        _ => format!("surface {surface}"),
    }
}
