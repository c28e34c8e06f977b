//! Boxes in a tree: which of many overlap one.

use glam::DVec3;

/// An axis-parallel box, its least and its greatest corner.
pub type Bounds = [DVec3; 2];

/// Boxes that are not parted any more.
const LEAF: usize = 4;

/// The box about some points, `margin` wider all around.
pub fn bounds(points: &[DVec3], margin: f64) -> Bounds {
    let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = points.iter().fold(none, |(low, high), &p| (low.min(p), high.max(p)));
    [low - margin, high + margin]
}

/// Boxes, halved again and again at the middle one across the longest side.
#[derive(Clone, Debug, Default)]
pub struct BoxTree {
    /// In the order of a walk that takes the left branch first.
    nodes: Vec<Node>,
    /// The boxes as the leaves hold them, with their numbers.
    leaves: Vec<(Bounds, u32)>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Bounds,
    /// Where its boxes are.
    first: u32,
    last: u32,
    /// The node after the last below this one: what a walk goes on with that leaves this one out.
    next: u32,
}

impl BoxTree {
    /// The tree of these boxes, numbered from 0.
    pub fn new(boxes: impl Iterator<Item = Bounds>) -> Self {
        let mut tree = Self { nodes: Vec::new(), leaves: boxes.zip(0..).collect() };
        if !tree.leaves.is_empty() {
            tree.part(0, tree.leaves.len());
        }
        tree
    }

    fn part(&mut self, first: usize, last: usize) {
        let about = |boxes: &[(Bounds, u32)]| {
            let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
            boxes.iter().fold(none, |[low, high], (b, _)| [low.min(b[0]), high.max(b[1])])
        };
        let bounds = about(&self.leaves[first..last]);
        let node = self.nodes.len();
        self.nodes.push(Node { bounds, first: first as u32, last: last as u32, next: 0 });
        if last - first > LEAF {
            let axis = (bounds[1] - bounds[0]).max_position();
            let centre = |(b, number): &(Bounds, u32)| (b[0][axis] + b[1][axis], *number);
            let middle = (last - first) / 2;
            self.leaves[first..last].select_nth_unstable_by(middle, |one, other| {
                let (one, other) = (centre(one), centre(other));
                one.0.total_cmp(&other.0).then(one.1.cmp(&other.1))
            });
            self.part(first, first + middle);
            self.part(first + middle, last);
        }
        self.nodes[node].next = self.nodes.len() as u32;
    }

    /// Hand every box that overlaps `wanted`, or touches it, to `visit`, by number.
    pub fn overlapping(&self, wanted: Bounds, mut visit: impl FnMut(u32)) {
        let meets = |b: &Bounds| b[0].cmple(wanted[1]).all() && wanted[0].cmple(b[1]).all();
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            if !meets(&node.bounds) {
                at = node.next as usize;
                continue;
            }
            if node.next as usize == at + 1 {
                let boxes = &self.leaves[node.first as usize..node.last as usize];
                boxes.iter().filter(|(b, _)| meets(b)).for_each(|&(_, number)| visit(number));
            }
            at += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn it_finds_what_a_look_at_each_finds(
            corners in prop::collection::vec((prop::array::uniform3(-4.0_f64..4.0), prop::array::uniform3(0.0_f64..2.0)), 0..60),
            at in prop::array::uniform3(-4.0_f64..4.0),
            size in 0.0_f64..3.0,
        ) {
            let boxes: Vec<Bounds> =
                corners.iter().map(|&(low, size)| [DVec3::from(low), DVec3::from(low) + DVec3::from(size)]).collect();
            let wanted = bounds(&[DVec3::from(at)], size);
            let mut found = Vec::new();
            BoxTree::new(boxes.iter().copied()).overlapping(wanted, |number| found.push(number));
            found.sort_unstable();
            let meets = |b: &Bounds| (0..3).all(|k| b[0][k] <= wanted[1][k] && wanted[0][k] <= b[1][k]);
            let each: Vec<u32> = (0..).zip(&boxes).filter(|(_, b)| meets(b)).map(|(number, _)| number).collect();
            prop_assert_eq!(found, each);
        }
    }
}
