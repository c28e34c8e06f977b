//! What can stand between two flat convex things: the facets that reach into the shaft that they span.
//!
//! All tests are conservative: a facet that is left out hides nothing but for rounding. Facets flush with either end
//! are left out, so that nothing that lies on a patch, or that a patch lies on, hides it.
//!
//! \[HW\] Haines & Wallace, Shaft Culling for Efficient Ray-Traced Radiosity, 1991.

use glam::DVec3;

use super::blocks::{Block, BlockTree, Branch, Inside};
use super::vectors::{Registers, cross, dot, load, magnitude, splat};
use super::{Facet, Facets};
use crate::simd::{LANES, Simd};

/// The most corners of one end.
pub(crate) const MOST_ENDS: usize = 8;

/// The facets of a scene that can stand between two others: not those that have all of it on one side, as the walls of
/// a room.
#[derive(Clone, Debug)]
pub(crate) struct Blockers {
    facets: Vec<Facet>,
    tree: BlockTree,
    /// Reaching into a shaft by no more than this is rounding.
    margin: f64,
}

/// Facets that may stand between two things, in no set order, sixteen by sixteen.
#[derive(Clone, Debug, Default)]
pub(crate) struct Candidates {
    blocks: Vec<Block>,
}

/// One end of a shaft: the corners of something convex.
#[derive(Clone, Copy, Debug)]
pub(crate) struct End {
    pub(crate) corners: [DVec3; MOST_ENDS],
    pub(crate) count: usize,
    /// Where the corners go around a flat outline, counter-clockwise about it: the unit normal of the side from which
    /// it is seen. Only what lies before it matters to the other end.
    pub(crate) normal: Option<DVec3>,
}

/// The planes that all rays between two ends lie above.
#[derive(Clone, Debug)]
pub(crate) struct Shaft {
    planes: [(DVec3, f64); 24],
    count: usize,
    ends: [End; 2],
    margin: f64,
}

impl End {
    /// A flat outline of few corners, counter-clockwise about `normal`.
    pub(crate) fn flat(outline: &[DVec3], normal: DVec3) -> Self {
        let mut end = Self { corners: [DVec3::ZERO; MOST_ENDS], count: 0, normal: Some(normal) };
        for &corner in outline.iter().take(MOST_ENDS) {
            end.corners[end.count] = corner;
            end.count += 1;
        }
        end
    }

    /// The box about `points`.
    pub(crate) fn about(points: impl Iterator<Item = DVec3>) -> Self {
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (low, high) = points.fold(none, |(low, high), p| (low.min(p), high.max(p)));
        let corner = |k: usize| {
            let of = |axis: usize| if k >> axis & 1 == 1 { high[axis] } else { low[axis] };
            DVec3::new(of(0), of(1), of(2))
        };
        Self { corners: std::array::from_fn(corner), count: MOST_ENDS, normal: None }
    }

    pub(crate) fn corners(&self) -> &[DVec3] {
        &self.corners[..self.count]
    }

    /// The same seen from behind.
    pub(crate) fn turned(mut self) -> Self {
        self.corners[..self.count].reverse();
        self.normal = self.normal.map(|normal| -normal);
        self
    }

    /// The least and the greatest height of the corners above a plane.
    pub(crate) fn heights(&self, point: DVec3, normal: DVec3) -> (f64, f64) {
        self.corners().iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &corner| {
            let height = normal.dot(corner - point);
            (low.min(height), high.max(height))
        })
    }
}

impl Shaft {
    /// Between two ends; facets that reach into it by `share` of the blockers' margin count. What was sought with a
    /// lesser share holds all that is found with a greater one.
    pub(crate) fn new(first: &End, second: &End, blockers: &Blockers, share: f64) -> Self {
        let mut shaft = Self::open(first, second, blockers, share);
        shaft.close(blockers);
        shaft
    }

    /// The same without its sides: what lies before both ends, with something of them on either side of it. That is soon
    /// made, and often tells that nothing can stand between.
    pub(crate) fn open(first: &End, second: &End, blockers: &Blockers, share: f64) -> Self {
        let mut shaft = Self {
            planes: [(DVec3::ZERO, 0.0); 24],
            count: 0,
            ends: [*first, *second],
            margin: blockers.margin * share,
        };
        for end in [first, second] {
            if let Some(normal) = end.normal {
                shaft.push(normal, end.corners[0]);
            }
        }
        shaft
    }

    /// Give it its sides.
    pub(crate) fn close(&mut self, blockers: &Blockers) {
        let [first, second] = self.ends;
        for (one, other) in [(&first, &second), (&second, &first)] {
            match one.normal {
                Some(normal) => self.sides(one, normal, other, blockers.margin),
                None => self.about(),
            }
        }
    }

    fn push(&mut self, normal: DVec3, through: DVec3) {
        if let Some(plane) = self.planes.get_mut(self.count) {
            *plane = (normal, normal.dot(through));
            self.count += 1;
        }
    }

    /// The planes through the edges of a flat end that just touch the other (\[HW\] has them of boxes).
    fn sides(&mut self, one: &End, normal: DVec3, other: &End, margin: f64) {
        for k in 0..one.count {
            let (a, b) = (one.corners[k], one.corners[if k + 1 == one.count { 0 } else { k + 1 }]);
            let inward = normal.cross(b - a).normalize_or_zero();
            if inward == DVec3::ZERO {
                continue;
            }
            // Of the other's corners, that which leans out the most.
            let (mut out, mut up) = (1.0, 0.0);
            let mut below = false;
            for &corner in other.corners() {
                let (y, z) = (inward.dot(corner - a), normal.dot(corner - a));
                if z < margin {
                    // Where it reaches below this end's plane, what is above may lean out without bounds.
                    below |= z < -margin || y < 0.0;
                    continue;
                }
                if y * up < out * z || up == 0.0 {
                    (out, up) = (y, z);
                }
            }
            if !below && up > 0.0 {
                let length = (out * out + up * up).sqrt();
                self.push((inward * up - normal * out) / length, a);
            }
        }
    }

    /// The box about both ends.
    fn about(&mut self) {
        let [first, second] = self.ends;
        let both = End::about(first.corners().iter().chain(second.corners()).copied());
        for axis in DVec3::AXES {
            self.push(axis, both.corners[0]);
            self.push(-axis, both.corners[MOST_ENDS - 1]);
        }
    }

    /// A bit for each facet of the block that reaches into the shaft, and has ends on both sides of its plane.
    #[inline(always)]
    fn reached<S: Simd>(&self, simd: S, block: &Block) -> u32 {
        let (origin, u, v) = (load(simd, &block.origin), load(simd, &block.u), load(simd, &block.v));
        let opposite = simd.load_double(&block.opposite);
        let (zero, margin) = (simd.splat_double(0.0), simd.splat_double(self.margin));
        let mut mask = (1_u32 << block.count) - 1;
        for k in 0..self.count {
            let (normal, level) = self.planes[k];
            let normal = splat(simd, normal);
            let (along_u, along_v) = (dot(simd, normal, u), dot(simd, normal, v));
            let corner = simd.add_double(along_v, simd.mul_double(opposite, along_u));
            let most = simd.max_double(simd.max_double(along_u, zero), simd.max_double(along_v, corner));
            let start = simd.sub_double(dot(simd, normal, origin), simd.splat_double(level));
            mask &= simd.lanes(simd.greater_double(simd.add_double(start, most), margin));
            if mask == 0 {
                return 0;
            }
        }
        let normal = cross(simd, u, v);
        let start = dot(simd, normal, origin);
        // Heights are in lengths of the normal, of which this is one and three quarters at most.
        let sum = simd.add_double(magnitude(simd, normal[0]), magnitude(simd, normal[1]));
        let margin = simd.mul_double(simd.add_double(sum, magnitude(simd, normal[2])), margin);
        let (mut least, mut most) = (simd.splat_double(f64::INFINITY), simd.splat_double(f64::NEG_INFINITY));
        for end in 0..2 {
            for k in 0..self.ends[end].count {
                let corner: Registers<S> = splat(simd, self.ends[end].corners[k]);
                let height = simd.sub_double(dot(simd, normal, corner), start);
                least = simd.min_double(height, least);
                most = simd.max_double(height, most);
            }
        }
        let above = simd.greater_double(most, margin);
        let below = simd.greater_double(simd.sub_double(zero, margin), least);
        mask & simd.lanes(simd.and(above, below))
    }

    /// A bit for each box of the branch that reaches into the shaft.
    #[inline(always)]
    fn reached_boxes<S: Simd>(&self, simd: S, branch: &Branch) -> u32 {
        let (centre, half) = (load(simd, &branch.centre), load(simd, &branch.half));
        let mut mask = (1_u32 << branch.count) - 1;
        for k in 0..self.count {
            let (normal, level) = self.planes[k];
            let most = dot(simd, splat(simd, normal.abs()), half);
            let middle = simd.sub_double(dot(simd, splat(simd, normal), centre), simd.splat_double(level));
            // As of a facet's corners but for rounding, so without the margin.
            mask &= simd.lanes(simd.greater_double(simd.add_double(middle, most), simd.splat_double(0.0)));
        }
        mask
    }
}

impl Blockers {
    /// Those of `facets`. Lengths up to `margin` are rounding.
    pub(crate) fn new(facets: &Facets, margin: f64) -> Self {
        let parted = |facet: &Facet| {
            let level = facet.normal.dot(facet.origin);
            let tree = facets.blocks();
            facet.u.cross(facet.v).length_squared() > 0.0
                && rises_above(tree, facet.normal, level + margin)
                && rises_above(tree, -facet.normal, margin - level)
        };
        let facets: Vec<Facet> = facets.as_slice().iter().filter(|facet| parted(facet)).copied().collect();
        let tree = BlockTree::new(&facets);
        Self { facets, tree, margin }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.facets.is_empty()
    }

    /// By number.
    pub(crate) fn facet(&self, number: u32) -> &Facet {
        &self.facets[number as usize]
    }

    /// All that reach into the shaft.
    #[inline(always)]
    pub(crate) fn in_shaft<S: Simd>(&self, simd: S, shaft: &Shaft, found: &mut Candidates) {
        found.blocks.clear();
        if self.is_empty() {
            return;
        }
        let mut open = vec![0];
        while let Some(number) = open.pop() {
            let branch = &self.tree.branches[number as usize];
            let mut boxes = shaft.reached_boxes(simd, branch);
            while boxes != 0 {
                let lane = boxes.trailing_zeros() as usize;
                boxes &= boxes - 1;
                match branch.inside[lane] {
                    Inside::Branch(further) => open.push(further),
                    Inside::Block(block) => {
                        let block = &self.tree.blocks[block as usize];
                        found.take(block, shaft.reached(simd, block));
                    }
                }
            }
        }
    }
}

impl Candidates {
    pub(crate) fn is_empty(&self) -> bool {
        self.blocks.is_empty()
    }

    /// How many blocks of sixteen they lie in.
    pub(crate) fn blocks(&self) -> usize {
        self.blocks.len()
    }

    /// Those of `wider` that reach into the shaft.
    #[inline(always)]
    pub(crate) fn narrowed<S: Simd>(&mut self, simd: S, wider: &Self, shaft: &Shaft) {
        self.blocks.clear();
        for k in 0..wider.blocks.len() {
            let block = &wider.blocks[k];
            let mask = shaft.reached(simd, block);
            self.take(block, mask);
        }
    }

    /// Whether any reaches into the shaft.
    #[inline(always)]
    pub(crate) fn any<S: Simd>(&self, simd: S, shaft: &Shaft) -> bool {
        for k in 0..self.blocks.len() {
            if shaft.reached(simd, &self.blocks[k]) != 0 {
                return true;
            }
        }
        false
    }

    /// The numbers of those that reach into the shaft, ascending.
    #[inline(always)]
    pub(crate) fn numbers<S: Simd>(&self, simd: S, shaft: &Shaft, found: &mut Vec<u32>) {
        found.clear();
        for k in 0..self.blocks.len() {
            let block = &self.blocks[k];
            let mut mask = shaft.reached(simd, block);
            while mask != 0 {
                found.push(block.facet[mask.trailing_zeros() as usize]);
                mask &= mask - 1;
            }
        }
        found.sort_unstable();
    }

    /// Take those lanes of a block.
    fn take(&mut self, block: &Block, mut lanes: u32) {
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize;
            lanes &= lanes - 1;
            if self.blocks.last().is_none_or(|last| last.count == LANES) {
                self.blocks.push(Block { count: 0, ..block.clone() });
            }
            if let Some(to) = self.blocks.last_mut() {
                let place = to.count;
                for axis in 0..3 {
                    to.origin[axis][place] = block.origin[axis][lane];
                    to.u[axis][place] = block.u[axis][lane];
                    to.v[axis][place] = block.v[axis][lane];
                }
                to.opposite[place] = block.opposite[lane];
                to.facet[place] = block.facet[lane];
                to.count += 1;
            }
        }
    }
}

/// Whether any facet rises above the plane normal · x = level.
fn rises_above(tree: &BlockTree, normal: DVec3, level: f64) -> bool {
    let mut open = vec![0_u32];
    while let Some(number) = open.pop() {
        let branch = &tree.branches[number as usize];
        for lane in 0..branch.count {
            let of = |v: &[[f64; LANES]; 3]| DVec3::new(v[0][lane], v[1][lane], v[2][lane]);
            let (middle, reach) = (normal.dot(of(&branch.centre)), normal.abs().dot(of(&branch.half)));
            if middle + reach <= level {
                continue;
            }
            match branch.inside[lane] {
                Inside::Branch(further) => open.push(further),
                Inside::Block(block) => {
                    let block = &tree.blocks[block as usize];
                    let rises = |k: usize| {
                        let of = |v: &[[f64; LANES]; 3]| normal.dot(DVec3::new(v[0][k], v[1][k], v[2][k]));
                        let (u, v) = (of(&block.u), of(&block.v));
                        of(&block.origin) + u.max(0.0).max(v.max(v + block.opposite[k] * u)) > level
                    };
                    if (0..block.count).any(rises) {
                        return true;
                    }
                }
            }
        }
    }
    false
}

/// The facets in the plane of another, within `margin` of it, whose boxes meet its box.
pub(crate) fn in_plane_of(facets: &Facets, number: u32, margin: f64) -> Vec<u32> {
    let facet = &facets[number];
    let (normal, level) = (facet.normal, facet.normal.dot(facet.origin));
    let (corners, count) = facet.corners();
    let box_of = |corners: &[DVec3]| {
        corners
            .iter()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), &c| (low.min(c), high.max(c)))
    };
    let (low, high) = box_of(&corners[..count]);
    let tree = facets.blocks();
    let mut found = Vec::new();
    let mut open = vec![0_u32];
    while let Some(branch) = open.pop() {
        let branch = &tree.branches[branch as usize];
        for lane in 0..branch.count {
            let of = |v: &[[f64; LANES]; 3]| DVec3::new(v[0][lane], v[1][lane], v[2][lane]);
            let (centre, half) = (of(&branch.centre), of(&branch.half) + margin);
            let apart = (centre - half).cmpgt(high).any() || (centre + half).cmplt(low).any();
            if apart || (normal.dot(centre) - level).abs() > normal.abs().dot(half) {
                continue;
            }
            match branch.inside[lane] {
                Inside::Branch(further) => open.push(further),
                Inside::Block(block) => {
                    let block = &tree.blocks[block as usize];
                    found.extend(block.facet[..block.count].iter().copied().filter(|&other| {
                        let (corners, count) = facets[other].corners();
                        let corners = &corners[..count];
                        let (other_low, other_high) = box_of(corners);
                        other != number
                            && corners.iter().all(|corner| (normal.dot(*corner) - level).abs() <= margin)
                            && other_low.cmple(high + margin).all()
                            && other_high.cmpge(low - margin).all()
                    }));
                }
            }
        }
    }
    found.sort_unstable();
    found
}
