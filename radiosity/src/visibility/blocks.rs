//! Facets sixteen at a time, in a tree of boxes: what the item buffer draws from.
//!
//! Sixteen facets lie side by side in columns, so that all are made ready for drawing with the same instructions;
//! sixteen boxes likewise. A branch holds up to sixteen boxes about further branches or about facets.

use std::ops::Range;

use glam::DVec3;

use super::vectors::Vectors;
use super::{Facet, FacetShape};
use crate::simd::LANES;

/// Up to sixteen facets. Lanes beyond [`Block::count`] hold facets without area, which nothing sees.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Block {
    /// How many there are.
    pub(super) count: usize,
    /// Their numbers.
    pub(super) facet: [u32; LANES],
    /// The corner where u = v = 0.
    pub(super) origin: Vectors,
    /// From the origin to the corner where u = 1.
    pub(super) u: Vectors,
    /// From the origin to the corner where v = 1.
    pub(super) v: Vectors,
    /// From the corner at v = 1 the next lies this many u away: 1 for a parallelogram, 0 for a triangle, which has none.
    pub(super) opposite: [f64; LANES],
    /// Whether all are triangles.
    pub(super) triangles: bool,
    /// A bit for each whose front is not where u × v points.
    pub(super) flipped: u32,
}

/// Up to sixteen boxes. Lanes beyond [`Branch::count`] mean nothing.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Branch {
    /// How many there are.
    pub(super) count: usize,
    /// Their centres.
    pub(super) centre: Vectors,
    /// Half their sides.
    pub(super) half: Vectors,
    /// What is in each.
    pub(super) inside: [Inside; LANES],
}

/// What is in a box, by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Inside {
    /// Further boxes.
    Branch(u32),
    /// Facets.
    Block(u32),
}

/// All facets of a scene. The first branch is the root.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct BlockTree {
    pub(super) blocks: Vec<Block>,
    pub(super) branches: Vec<Branch>,
}

/// What each facet puts into the cells it covers, seen from its front and from its back. Of two equally near the lesser
/// one stays.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Labels {
    /// Facet by facet, as they stand in each block: of their fronts, of their backs.
    pub(super) sides: Vec<[[u32; LANES]; 2]>,
}

impl Labels {
    /// Given for each facet, by number.
    pub(super) fn new(tree: &BlockTree, front: impl Fn(u32) -> u32, back: impl Fn(u32) -> u32) -> Self {
        let sides = |block: &Block| {
            let mut sides = [[0; LANES]; 2];
            for (lane, &facet) in block.facet[..block.count].iter().enumerate() {
                (sides[0][lane], sides[1][lane]) = (front(facet), back(facet));
            }
            sides
        };
        Self { sides: tree.blocks.iter().map(sides).collect() }
    }
}

/// A facet's box.
#[derive(Clone, Copy)]
struct Bounds {
    low: DVec3,
    high: DVec3,
}

impl Bounds {
    const NONE: Self = Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };

    fn of(facet: &Facet) -> Self {
        let (corners, count) = facet.corners();
        corners[..count]
            .iter()
            .fold(Self::NONE, |bounds, &corner| bounds.with(Self { low: corner, high: corner }))
    }

    fn with(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Twice its centre.
    fn middle(&self) -> DVec3 {
        self.low + self.high
    }
}

impl BlockTree {
    /// The tree over `facets`. Every block but a few is full, and the tree is shallow, whatever the facets.
    pub(super) fn new(facets: &[Facet]) -> Self {
        let bounds: Vec<_> = facets.iter().map(Bounds::of).collect();
        let mut order: Vec<u32> = (0..facets.len() as u32).collect();
        let mut tree = Self { blocks: Vec::new(), branches: Vec::new() };
        tree.branch(facets, &bounds, &mut order);
        tree
    }

    /// Make a branch over the facets of `order`, and all below it; its number.
    fn branch(&mut self, facets: &[Facet], bounds: &[Bounds], order: &mut [u32]) -> u32 {
        let this = self.branches.len();
        self.branches.push(Branch {
            count: 0,
            centre: [[0.0; LANES]; 3],
            half: [[0.0; LANES]; 3],
            inside: [Inside::Branch(0); LANES],
        });
        let mut parts = Vec::new();
        divide(bounds, order, 0, order.len().div_ceil(LANES).min(LANES), &mut parts);
        for (lane, part) in parts.into_iter().enumerate() {
            let order = &mut order[part];
            let about = order.iter().fold(Bounds::NONE, |about, &k| about.with(bounds[k as usize]));
            let inside = if order.len() <= LANES {
                order.sort_unstable();
                self.blocks.push(Block::new(facets, order));
                Inside::Block(self.blocks.len() as u32 - 1)
            } else {
                Inside::Branch(self.branch(facets, bounds, order))
            };
            let branch = &mut self.branches[this];
            branch.count = lane + 1;
            branch.inside[lane] = inside;
            for axis in 0..3 {
                branch.centre[axis][lane] = 0.5 * about.middle()[axis];
                branch.half[axis][lane] = 0.5 * (about.high - about.low)[axis];
            }
        }
        this as u32
    }
}

/// Divide `order`, which begins at `start` of the whole, into so many parts of whole blocks, by halving at right angles to
/// the axis along which the facets' centres lie farthest apart.
fn divide(bounds: &[Bounds], order: &mut [u32], start: usize, parts: usize, found: &mut Vec<Range<usize>>) {
    if order.is_empty() {
        return;
    }
    if parts <= 1 {
        found.push(start..start + order.len());
        return;
    }
    let middle = |k: &u32| bounds[*k as usize].middle();
    let spread =
        order.iter().map(middle).fold(Bounds::NONE, |spread, m| spread.with(Bounds { low: m, high: m }));
    let axis = (spread.high - spread.low).max_position();
    let blocks = order.len().div_ceil(LANES);
    let half = (blocks * (parts / 2)).div_ceil(parts) * LANES;
    // The numbers decide between equals, so that the tree is the same whatever the sorting.
    let before = |a: &u32, b: &u32| middle(a)[axis].total_cmp(&middle(b)[axis]).then(a.cmp(b));
    if half < order.len() {
        order.select_nth_unstable_by(half, before);
    }
    let (left, right) = order.split_at_mut(half.min(order.len()));
    divide(bounds, left, start, parts / 2, found);
    divide(bounds, right, start + half, parts - parts / 2, found);
}

impl Block {
    fn new(facets: &[Facet], numbers: &[u32]) -> Self {
        let none = [[0.0; LANES]; 3];
        let mut block = Self {
            count: numbers.len(),
            facet: [0; LANES],
            origin: none,
            u: none,
            v: none,
            opposite: [0.0; LANES],
            triangles: true,
            flipped: 0,
        };
        for (lane, &number) in numbers.iter().enumerate() {
            let facet = &facets[number as usize];
            block.facet[lane] = number;
            for (column, vector) in
                [(&mut block.origin, facet.origin), (&mut block.u, facet.u), (&mut block.v, facet.v)]
            {
                for axis in 0..3 {
                    column[axis][lane] = vector[axis];
                }
            }
            if facet.shape == FacetShape::Parallelogram {
                block.opposite[lane] = 1.0;
                block.triangles = false;
            }
            block.flipped |= u32::from(facet.u.cross(facet.v).dot(facet.normal) < 0.0) << lane;
        }
        block
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::visibility::Cells;

    fn facets(count: usize) -> Vec<Facet> {
        let at = |k: usize, step: f64| (k as f64 * step).sin() * 10.0;
        (0..count)
            .map(|k| Facet {
                origin: DVec3::new(at(k, 0.37), at(k, 1.91), if k % 3 == 0 { 0.0 } else { at(k, 0.011) }),
                u: DVec3::X,
                v: DVec3::Y,
                normal: DVec3::Z,
                shape: if k % 5 == 0 { FacetShape::Parallelogram } else { FacetShape::Triangle },
                surface: 0,
                cells: Cells::One(k as u32),
            })
            .collect()
    }

    /// The facets below a box, each within it.
    fn below(tree: &BlockTree, inside: Inside, within: Bounds, facets: &[Facet], found: &mut Vec<u32>) {
        let holds = |outer: &Bounds, inner: &Bounds| {
            outer.low.cmple(inner.low + 1e-12).all() && outer.high.cmpge(inner.high - 1e-12).all()
        };
        match inside {
            Inside::Block(block) => {
                let block = &tree.blocks[block as usize];
                for &facet in &block.facet[..block.count] {
                    assert!(holds(&within, &Bounds::of(&facets[facet as usize])));
                    found.push(facet);
                }
            }
            Inside::Branch(branch) => {
                let branch = &tree.branches[branch as usize];
                for lane in 0..branch.count {
                    let take = |v: &Vectors| DVec3::new(v[0][lane], v[1][lane], v[2][lane]);
                    let (centre, half) = (take(&branch.centre), take(&branch.half));
                    let bounds = Bounds { low: centre - half, high: centre + half };
                    assert!(holds(&within, &bounds));
                    below(tree, branch.inside[lane], bounds, facets, found);
                }
            }
        }
    }

    #[test]
    fn every_facet_is_in_its_boxes_once() {
        for count in [0, 1, 15, 16, 17, 255, 256, 257, 1000, 5000] {
            let facets = facets(count);
            let tree = BlockTree::new(&facets);
            let all = Bounds { low: DVec3::NEG_INFINITY, high: DVec3::INFINITY };
            let mut found = Vec::new();
            below(&tree, Inside::Branch(0), all, &facets, &mut found);
            found.sort_unstable();
            assert_eq!(found, (0..count as u32).collect::<Vec<_>>());
            assert!(
                tree.blocks.len() <= count.div_ceil(LANES) + count / 100,
                "{count}: {}",
                tree.blocks.len()
            );
        }
    }
}
