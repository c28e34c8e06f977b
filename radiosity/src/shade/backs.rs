//! Which surfaces a camera sees from behind.

use super::picture::fit;
use crate::scene::Camera;
use crate::visibility::{Facets, ItemBuffer, NOTHING};

/// Cells of the picture that is judged.
const SIZE: [usize; 2] = [320, 240];

/// The surfaces that `camera` sees from behind, each with its share of the picture, 0..1, the greatest first. In
/// scenes whose backs are black they are black: as a rule somebody wound them the wrong way round.
pub fn backs_seen(facets: &Facets, camera: &Camera) -> Vec<(u32, f64)> {
    let Ok(Some((_, view))) = fit(camera, SIZE[0], SIZE[1]) else { return Vec::new() };
    let mut buffer = ItemBuffer::default();
    buffer.draw(facets, &view);
    let mut seen: Vec<(u32, usize)> = Vec::new();
    for number in (0..view.height).flat_map(|y| buffer.facets(y)) {
        if *number == NOTHING || facets[*number].faces(view.eye) {
            continue;
        }
        let surface = facets[*number].surface;
        match seen.iter_mut().find(|(other, _)| *other == surface) {
            Some((_, cells)) => *cells += 1,
            None => seen.push((surface, 1)),
        }
    }
    seen.sort_by_key(|&(surface, cells)| (std::cmp::Reverse(cells), surface));
    let all = (view.width * view.height) as f64;
    seen.into_iter().map(|(surface, cells)| (surface, cells as f64 / all)).collect()
}
