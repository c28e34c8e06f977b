//! Where the surfaces of a scene meet: the lines that their patches are to be parted along.

use glam::DVec3;

use super::cut::{Plan, cut};
use crate::geometry::contact::{Contact, Plate, contacts};
use crate::geometry::polygon;
use crate::scene::{Scene, Shape, TOUCHING};

/// What is over a surface by no more than this share of its patches' width is taken as lying on it: the light that reaches in
/// under it does not reach far into a patch.
const HOVER: f64 = 0.1;

/// For each surface of a scene, the lines on it where others meet it; and how near counts as touching, as a length.
pub(super) fn meetings(scene: &Scene, plans: &[Plan]) -> (Vec<Vec<Contact>>, f64) {
    let (mut plates, mut surface_of, mut hover) = (Vec::new(), Vec::new(), Vec::new());
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for ((surface, &plan), index) in scene.surfaces.iter().zip(plans).zip(0..) {
        let own = plates_of(&surface.shape, plan, index);
        let area: f64 = own.iter().map(Plate::area).sum();
        plates.extend(own);
        surface_of.resize(plates.len(), index);
        hover.resize(plates.len(), HOVER * (area / plan.count() as f64).sqrt());
        for vertex in surface.shape.vertices() {
            (low, high) = (low.min(vertex), high.max(vertex));
        }
    }
    let tolerance = (high - low).max_element().max(0.0) * TOUCHING;
    let mut found = vec![Vec::new(); scene.surfaces.len()];
    for contact in contacts(&plates, &hover, tolerance) {
        found[surface_of[contact.plate as usize] as usize].push(contact);
    }
    (found, tolerance)
}

/// The flat plates that a shape is made of. What is curved is what is drawn of it, and has no contact with itself.
fn plates_of(shape: &Shape, plan: Plan, surface: u32) -> Vec<Plate> {
    shape.plates().unwrap_or_else(|| {
        let pieces = cut(shape, plan, 0, |_| {}).unwrap_or_default();
        let plate = |corners: &[DVec3; 3]| {
            let normal = polygon::area_vector(corners).normalize_or_zero();
            Plate::new(corners, normal, 0b111, Some(surface))
        };
        pieces.triangles.iter().map(plate).collect()
    })
}
