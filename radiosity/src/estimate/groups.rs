//! Neighbouring patches taken together: what the scene cut more coarsely would have as one.

use glam::DVec3;

use crate::light::Rgb;
use crate::patches::Patches;

/// Patches of one surface in groups of neighbours.
#[derive(Clone, Debug)]
pub(super) struct Groups {
    /// The patches, group by group.
    order: Vec<u32>,
    /// Where in `order` each group ends.
    ends: Vec<usize>,
}

impl Groups {
    /// Groups of `side` x `side` cells where the surface is a grid, of at most as many neighbours where it is none.
    pub(super) fn new(patches: &Patches, side: u32) -> Self {
        let mut groups = Self { order: Vec::with_capacity(patches.len()), ends: Vec::new() };
        for block in &patches.blocks {
            if block.rows > 1 {
                for row in (0..block.rows).step_by(side as usize) {
                    for column in (0..block.columns).step_by(side as usize) {
                        for y in row..block.rows.min(row + side) {
                            for x in column..block.columns.min(column + side) {
                                groups.order.push(block.first + y * block.columns + x);
                            }
                        }
                        groups.ends.push(groups.order.len());
                    }
                }
            } else {
                let mut of_surface: Vec<u32> = block.patches().map(|patch| patch as u32).collect();
                groups.part(patches, &mut of_surface, (side * side) as usize);
            }
        }
        groups
    }

    /// Halve what is too many where it is longest, in space or in the directions that the patches face.
    fn part(&mut self, patches: &Patches, some: &mut [u32], most: usize) {
        if some.len() <= most {
            self.order.extend_from_slice(some);
            self.ends.push(self.order.len());
            return;
        }
        let span = |value: &dyn Fn(usize) -> DVec3| {
            let values = some.iter().map(|&patch| value(patch as usize));
            let all = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            let (low, high) = values.fold(all, |(low, high), p| (low.min(p), high.max(p)));
            high - low
        };
        let wide = span(&|patch| patches.centre[patch]);
        // Opposite directions are as far apart as the two ends of the surface.
        let turned = span(&|patch| patches.normal[patch]) * (0.5 * wide.max_element());
        let (of, span) = if turned.max_element() > wide.max_element() {
            (&patches.normal, turned)
        } else {
            (&patches.centre, wide)
        };
        let axis = span.max_position();
        some.sort_by(|&a, &b| of[a as usize][axis].total_cmp(&of[b as usize][axis]).then(a.cmp(&b)));
        let (below, above) = some.split_at_mut(some.len() / 2);
        self.part(patches, below, most);
        self.part(patches, above, most);
    }

    /// The patches of each.
    pub(super) fn iter(&self) -> impl Iterator<Item = &[u32]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| &self.order[start..end])
    }

    /// The mean over each group, weighted by area, for each of its patches.
    pub(super) fn means(&self, patches: &Patches, values: &[Rgb]) -> Vec<Rgb> {
        let mut means = vec![Rgb::BLACK; values.len()];
        for group in self.iter() {
            let area: f64 = group.iter().map(|&i| patches.area[i as usize]).sum();
            let sum: Rgb = group.iter().map(|&i| values[i as usize] * patches.area[i as usize]).sum();
            for &i in group {
                means[i as usize] = sum * (1.0 / area);
            }
        }
        means
    }
}
