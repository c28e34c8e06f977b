//! Single rays against the facets: the plain way to ask what is seen, and the judge of the faster ones.
//!
//! A binary tree of boxes, split at the median, all in double precision: simple and exact before fast.

use std::ops::Deref;
use std::sync::Arc;

use glam::DVec3;

use super::{Facet, FacetShape, Facets};

/// Facets reach this much beyond their edges, in (u, v): no ray slips between two that share one.
const EDGE_TOLERANCE: f64 = 1e-9;

/// Facets in a leaf, at most.
const LEAF: usize = 4;

/// Where a ray first meets a facet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The facet's number.
    pub facet: u32,
    /// The point is `origin + distance * direction`.
    pub distance: f64,
    /// Where on the facet.
    pub u: f64,
    /// Where on the facet.
    pub v: f64,
}

/// A tree of boxes about facets.
#[derive(Clone, Debug)]
pub struct RayTree<'a> {
    facets: Held<'a>,
    nodes: Vec<Node>,
    order: Vec<u32>,
}

/// Whose the facets are: a stage's, for as long as it runs, or shared with whoever keeps the tree.
#[derive(Clone, Debug)]
enum Held<'a> {
    Borrowed(&'a Facets),
    Shared(Arc<Facets>),
}

impl Deref for Held<'_> {
    type Target = Facets;
    fn deref(&self) -> &Facets {
        match self {
            Self::Borrowed(facets) => facets,
            Self::Shared(facets) => facets,
        }
    }
}

/// A box, with either two further nodes (the first follows at once) or a leaf's facets.
#[derive(Clone, Debug)]
struct Node {
    low: DVec3,
    high: DVec3,
    inside: Inside,
}

#[derive(Clone, Debug)]
enum Inside {
    Second(usize),
    Facets(std::ops::Range<usize>),
}

impl<'a> RayTree<'a> {
    /// Build the tree over all of `facets`.
    pub fn new(facets: &'a Facets) -> Self {
        Self::build(Held::Borrowed(facets))
    }

    /// The same, sharing the facets: for who keeps the tree longer than a stage runs, as a window does.
    pub fn shared(facets: Arc<Facets>) -> RayTree<'static> {
        RayTree::build(Held::Shared(facets))
    }

    fn build(facets: Held<'a>) -> Self {
        let boxes: Vec<_> = facets.as_slice().iter().map(bounds).collect();
        let mut tree = Self { facets, nodes: Vec::new(), order: (0..boxes.len() as u32).collect() };
        let mut order = std::mem::take(&mut tree.order);
        if !order.is_empty() {
            tree.split(&boxes, &mut order, 0);
        }
        tree.order = order;
        tree
    }

    /// Make the node over `order`, which begins at `start` of the whole order. Halving keeps it shallow.
    fn split(&mut self, boxes: &[(DVec3, DVec3)], order: &mut [u32], start: usize) {
        let union = |(low, high): (DVec3, DVec3), &k: &u32| {
            (low.min(boxes[k as usize].0), high.max(boxes[k as usize].1))
        };
        let (low, high) = order.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), union);
        let this = self.nodes.len();
        self.nodes.push(Node { low, high, inside: Inside::Facets(start..start + order.len()) });
        if order.len() <= LEAF {
            return;
        }
        let middle = |k: &u32| boxes[*k as usize].0 + boxes[*k as usize].1;
        let spread = order.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), k| {
            (low.min(middle(k)), high.max(middle(k)))
        });
        let axis = (spread.1 - spread.0).max_position();
        let half = order.len() / 2;
        order.select_nth_unstable_by(half, |a, b| middle(a)[axis].total_cmp(&middle(b)[axis]).then(a.cmp(b)));
        let (left, right) = order.split_at_mut(half);
        self.split(boxes, left, start);
        self.nodes[this].inside = Inside::Second(self.nodes.len());
        self.split(boxes, right, start + half);
    }

    /// The nearest facet along `origin + t direction`, 0 < t < `limit`, among those that have a label. Of two equally near
    /// the one with the lesser label; of two with the same, the one with the lower number.
    pub fn nearest(
        &self,
        origin: DVec3,
        direction: DVec3,
        limit: f64,
        label: impl Fn(u32) -> Option<u32>,
    ) -> Option<Hit> {
        let facets: &Facets = &self.facets;
        let inverse = direction.recip();
        let mut best: Option<Hit> = None;
        let mut best_label = u32::MAX;
        let mut stack = vec![0];
        while let Some(index) = stack.pop() {
            let Some(node) = self.nodes.get(index) else { break };
            let reach = best.map_or(limit, |hit| hit.distance);
            if !node.is_met(origin, inverse, reach) {
                continue;
            }
            match &node.inside {
                Inside::Second(second) => stack.extend([*second, index + 1]),
                Inside::Facets(range) => {
                    for &number in &self.order[range.clone()] {
                        let hit = meet(&facets[number], number, origin, direction);
                        let Some(hit) = hit.filter(|hit| hit.distance <= reach && hit.distance < limit)
                        else {
                            continue;
                        };
                        let Some(label) = label(number) else { continue };
                        let nearer =
                            |b: Hit| (hit.distance, label, number) < (b.distance, best_label, b.facet);
                        if best.is_none_or(nearer) {
                            (best, best_label) = (Some(hit), label);
                        }
                    }
                }
            }
        }
        best
    }
}

impl Node {
    /// Whether the ray meets the box before `reach` (the slab test). A ray that runs in a slab's own face
    /// gives 0 * infinity, which `min` and `max` pass over.
    fn is_met(&self, origin: DVec3, inverse: DVec3, reach: f64) -> bool {
        let (mut enter, mut leave) = (0.0_f64, reach);
        for axis in 0..3 {
            let a = (self.low[axis] - origin[axis]) * inverse[axis];
            let b = (self.high[axis] - origin[axis]) * inverse[axis];
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        // A box may be flat: leave it the rounding of the products above.
        enter <= leave * (1.0 + 1e-12) + f64::MIN_POSITIVE
    }
}

/// The box of a facet, a little larger than its corners.
fn bounds(facet: &Facet) -> (DVec3, DVec3) {
    let (corners, count) = facet.corners();
    let (low, high) = corners[..count]
        .iter()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), &c| (low.min(c), high.max(c)));
    let margin = DVec3::splat(EDGE_TOLERANCE * (high - low).max_element());
    (low - margin, high + margin)
}

/// Where a ray meets a facet, if it does.
fn meet(facet: &Facet, number: u32, origin: DVec3, direction: DVec3) -> Option<Hit> {
    let distance = facet.plane_distance(origin, direction);
    if !(distance > 0.0 && distance.is_finite()) {
        return None;
    }
    let (u, v) = facet.uv(origin + direction * distance);
    let inside = u >= -EDGE_TOLERANCE
        && v >= -EDGE_TOLERANCE
        && match facet.shape {
            FacetShape::Triangle => u + v <= 1.0 + EDGE_TOLERANCE,
            FacetShape::Parallelogram => u.max(v) <= 1.0 + EDGE_TOLERANCE,
        };
    inside.then_some(Hit { facet: number, distance, u, v })
}
