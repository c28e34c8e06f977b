//! What can stand between two flat convex things: the facets that reach into the shaft that they span.
//!
//! All tests are conservative: a facet that is left out hides nothing but for rounding. Facets flush with either end
//! are left out, so that nothing that lies on a patch, or that a patch lies on, hides it.
//!
//! \[HW\] Haines & Wallace, Shaft Culling for Efficient Ray-Traced Radiosity, 1991.

use glam::DVec3;

use super::blocks::{Block, BlockTree, Branch, Inside};
use super::vectors::{Registers, Vectors, cross, dot, load, magnitude, scale, splat, sub};
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

/// Sixteen flat ends of up to four corners, side by side. Where one has fewer its last stands in for the others.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ends {
    pub(crate) corners: [Vectors; 4],
    pub(crate) normal: Vectors,
}

/// A facet in every lane.
struct Everywhere<S: Simd> {
    origin: Registers<S>,
    u: Registers<S>,
    v: Registers<S>,
    opposite: S::Doubles,
}

/// Planes, one a lane: a normal, and its product with a point of the plane.
type Planes<S> = (Registers<S>, <S as Simd>::Doubles);

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
                self.push((inward * up - normal * out) * (1.0 / length), a);
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

impl Ends {
    /// Of sixteen, a bit for each that lies before `other`, all of it, and has all of `other` before it, by more than
    /// `margin`.
    #[inline(always)]
    pub(crate) fn facing<S: Simd>(&self, simd: S, other: &End, normal: DVec3, margin: f64) -> u32 {
        let mut least = simd.splat_double(f64::INFINITY);
        let (there, up) = (splat(simd, other.corners[0]), splat(simd, normal));
        for corner in &self.corners {
            least = simd.min_double(dot(simd, up, sub(simd, load(simd, corner), there)), least);
        }
        let (here, up) = (load(simd, &self.corners[0]), load(simd, &self.normal));
        for k in 0..other.count {
            let corner = splat(simd, other.corners[k]);
            least = simd.min_double(dot(simd, up, sub(simd, corner, here)), least);
        }
        simd.lanes(simd.greater_double(least, simd.splat_double(margin)))
    }

    /// The planes through the edges of these ends that just touch the other, which lies before each of them: what
    /// [`Shaft::sides`] finds, and the same bits.
    #[inline(always)]
    fn sides<S: Simd>(&self, simd: S, other: &End, planes: &mut [Planes<S>]) {
        let normal = load(simd, &self.normal);
        let zero = simd.splat_double(0.0);
        for (k, plane) in planes.iter_mut().enumerate().take(4) {
            let (a, b) = (load(simd, &self.corners[k]), load(simd, &self.corners[(k + 1) % 4]));
            let inward = cross(simd, normal, sub(simd, b, a));
            let per_length =
                simd.div_double(simd.splat_double(1.0), simd.root_double(dot(simd, inward, inward)));
            let inward = scale(simd, inward, per_length);
            let (mut out, mut up) = (zero, zero);
            for (number, &corner) in other.corners().iter().enumerate() {
                let corner = sub(simd, splat(simd, corner), a);
                (out, up) = steeper(
                    simd,
                    number == 0,
                    (out, up),
                    dot(simd, inward, corner),
                    dot(simd, normal, corner),
                );
            }
            let (tilted, level) = touching(simd, inward, normal, (out, up), a);
            // An edge without length has no plane.
            let is_edge = simd.greater_double(simd.splat_double(f64::INFINITY), per_length);
            *plane = (
                [
                    simd.select_double(is_edge, tilted[0], zero),
                    simd.select_double(is_edge, tilted[1], zero),
                    simd.select_double(is_edge, tilted[2], zero),
                ],
                simd.select_double(is_edge, level, simd.splat_double(f64::NEG_INFINITY)),
            );
        }
    }
}

impl End {
    /// The same through the edges of this end, which all the others lie before. Tells how many there are.
    #[inline(always)]
    fn sides<S: Simd>(&self, simd: S, normal: DVec3, others: &Ends, planes: &mut [Planes<S>]) -> usize {
        let mut count = 0;
        let up_there = splat(simd, normal);
        let zero = simd.splat_double(0.0);
        for k in 0..self.count {
            let (a, b) = (self.corners[k], self.corners[if k + 1 == self.count { 0 } else { k + 1 }]);
            let inward = normal.cross(b - a).normalize_or_zero();
            if inward == DVec3::ZERO || count == planes.len() {
                continue;
            }
            let (inward, a) = (splat(simd, inward), splat(simd, a));
            let (mut out, mut up) = (zero, zero);
            for corner in 0..4 {
                let at = sub(simd, load(simd, &others.corners[corner]), a);
                (out, up) =
                    steeper(simd, corner == 0, (out, up), dot(simd, inward, at), dot(simd, up_there, at));
            }
            planes[count] = touching(simd, inward, up_there, (out, up), a);
            count += 1;
        }
        count
    }
}

/// Of two ways, along and up, the one that leans out more.
#[inline(always)]
fn steeper<S: Simd>(
    simd: S,
    first: bool,
    (out, up): (S::Doubles, S::Doubles),
    along: S::Doubles,
    above: S::Doubles,
) -> (S::Doubles, S::Doubles) {
    if first {
        return (along, above);
    }
    let leans = simd.greater_double(simd.mul_double(out, above), simd.mul_double(along, up));
    (simd.select_double(leans, along, out), simd.select_double(leans, above, up))
}

/// The plane through an edge from `a` that leans so far.
#[inline(always)]
fn touching<S: Simd>(
    simd: S,
    inward: Registers<S>,
    normal: Registers<S>,
    (out, up): (S::Doubles, S::Doubles),
    a: Registers<S>,
) -> Planes<S> {
    let squared = simd.add_double(simd.mul_double(out, out), simd.mul_double(up, up));
    let per_length = simd.div_double(simd.splat_double(1.0), simd.root_double(squared));
    let tilted = sub(simd, scale(simd, inward, up), scale(simd, normal, out));
    let tilted = scale(simd, tilted, per_length);
    (tilted, dot(simd, tilted, a))
}

impl<S: Simd> Everywhere<S> {
    #[inline(always)]
    fn new(simd: S, block: &Block, lane: usize) -> Self {
        let of = |v: &Vectors| DVec3::new(v[0][lane], v[1][lane], v[2][lane]);
        Self {
            origin: splat(simd, of(&block.origin)),
            u: splat(simd, of(&block.u)),
            v: splat(simd, of(&block.v)),
            opposite: simd.splat_double(block.opposite[lane]),
        }
    }

    /// A bit for each plane that it reaches above.
    #[inline(always)]
    fn above(&self, simd: S, (normal, level): Planes<S>, margin: S::Doubles) -> u32 {
        let zero = simd.splat_double(0.0);
        let (along_u, along_v) = (dot(simd, normal, self.u), dot(simd, normal, self.v));
        let corner = simd.add_double(along_v, simd.mul_double(self.opposite, along_u));
        let most = simd.max_double(simd.max_double(along_u, zero), simd.max_double(along_v, corner));
        let start = simd.sub_double(dot(simd, normal, self.origin), level);
        simd.lanes(simd.greater_double(simd.add_double(start, most), margin))
    }

    /// A bit for each of the others that, with `here`, has something on both sides of its plane.
    #[inline(always)]
    fn between(&self, simd: S, here: &End, others: &Ends, margin: S::Doubles) -> u32 {
        let normal = cross(simd, self.u, self.v);
        let start = dot(simd, normal, self.origin);
        let sum = simd.add_double(magnitude(simd, normal[0]), magnitude(simd, normal[1]));
        let margin = simd.mul_double(simd.add_double(sum, magnitude(simd, normal[2])), margin);
        let (mut least, mut most) = (simd.splat_double(f64::INFINITY), simd.splat_double(f64::NEG_INFINITY));
        for k in 0..here.count {
            let height = simd.sub_double(dot(simd, normal, splat(simd, here.corners[k])), start);
            least = simd.min_double(height, least);
            most = simd.max_double(height, most);
        }
        for corner in &others.corners {
            let height = simd.sub_double(dot(simd, normal, load(simd, corner)), start);
            least = simd.min_double(height, least);
            most = simd.max_double(height, most);
        }
        let above = simd.greater_double(most, margin);
        let below = simd.greater_double(simd.sub_double(simd.splat_double(0.0), margin), least);
        simd.lanes(simd.and(above, below))
    }
}

/// Shafts between a flat end and each of sixteen others, all of which lie before it, and it before them, by more than
/// the margin. They hold what each [`Shaft`] by itself holds.
struct Shafts<'a, S: Simd> {
    here: &'a End,
    normal: DVec3,
    others: &'a Ends,
    margin: S::Doubles,
    /// The planes of the ends; and their sides, once they are asked for.
    ends: [Planes<S>; 2],
    sides: [Planes<S>; 8],
    count: usize,
}

impl<'a, S: Simd> Shafts<'a, S> {
    /// Facets that reach into them by `margin` count.
    #[inline(always)]
    fn new(simd: S, here: &'a End, normal: DVec3, others: &'a Ends, margin: f64) -> Self {
        let plane_here = (splat(simd, normal), simd.splat_double(normal.dot(here.corners[0])));
        let normal_there = load(simd, &others.normal);
        let plane_there = (normal_there, dot(simd, normal_there, load(simd, &others.corners[0])));
        let margin = simd.splat_double(margin);
        Self {
            here,
            normal,
            others,
            margin,
            ends: [plane_here, plane_there],
            sides: [plane_here; 8],
            count: 0,
        }
    }

    /// Of `lanes`, a bit for each shaft that a facet reaches into.
    #[inline(always)]
    fn reached(&mut self, simd: S, lanes: u32, block: &Block, place: usize) -> u32 {
        let facet = Everywhere::new(simd, block, place);
        let mut mask = lanes & facet.above(simd, self.ends[0], self.margin);
        if mask != 0 {
            mask &= facet.above(simd, self.ends[1], self.margin);
        }
        if mask != 0 {
            mask &= facet.between(simd, self.here, self.others, self.margin);
        }
        if mask != 0 && self.count == 0 {
            self.others.sides(simd, self.here, &mut self.sides[..4]);
            self.count = 4 + self.here.sides(simd, self.normal, self.others, &mut self.sides[4..]);
        }
        let mut side = 0;
        while mask != 0 && side < self.count {
            mask &= facet.above(simd, self.sides[side], self.margin);
            side += 1;
        }
        mask
    }

    /// Of `lanes`, a bit for each shaft all of whose lines a facet stands across, and goes beyond them: what lies in the
    /// one end sees nothing of the other.
    #[inline(always)]
    fn covered(&self, simd: S, mut lanes: u32, facet: &Facet, margin: f64) -> u32 {
        let normal = facet.u.cross(facet.v);
        let per_length = 1.0 / normal.length();
        let level = normal.dot(facet.origin);
        let (low, high) = self.here.heights(facet.origin, normal * per_length);
        let way = if low > margin {
            1.0
        } else if high < -margin {
            -1.0
        } else {
            return 0;
        };
        // Along `normal`, from the others to this end, all of it measured in lengths of the normal.
        let normal = normal * way;
        let mut below = [simd.splat_double(0.0); 4];
        let least = simd.splat_double(-margin / per_length);
        for (below, corner) in below.iter_mut().zip(&self.others.corners) {
            let corner = load(simd, corner);
            *below = simd.sub_double(dot(simd, splat(simd, normal), corner), simd.splat_double(level * way));
            lanes &= simd.lanes(simd.greater_double(least, *below));
        }
        let (corners, count) = facet.corners();
        for edge in 0..count {
            let (p, q) = (corners[edge], corners[if edge + 1 == count { 0 } else { edge + 1 }]);
            // Times the height that a line rises by: how far it passes the edge, times the edge's length.
            let beyond = simd.splat_double(WELL_BEYOND * margin * p.distance(q) * per_length);
            let mut k = 0;
            while k < 4 && lanes != 0 {
                let from = load(simd, &self.others.corners[k]);
                let plane = cross(simd, sub(simd, splat(simd, p), from), sub(simd, splat(simd, q), from));
                let plane = scale(simd, plane, simd.splat_double(way));
                for corner in 0..self.here.count {
                    let to = self.here.corners[corner];
                    let past = dot(simd, plane, sub(simd, splat(simd, to), from));
                    let rise = simd.sub_double(simd.splat_double(normal.dot(to) - level * way), below[k]);
                    lanes &= simd.lanes(simd.greater_double(past, simd.mul_double(rise, beyond)));
                }
                k += 1;
            }
        }
        lanes
    }
}

/// What stands across all lines between two things goes this many margins beyond them, for whoever asks anew of parts of
/// them, in single precision, to find the same.
const WELL_BEYOND: f64 = 1e3;

/// For each block of [`Candidates`], of each of sixteen shafts the facets that reach into it, a bit a facet.
pub(crate) type Reach = Vec<[u16; LANES]>;

/// What is left of candidates in a narrower shaft.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Standing<'a> {
    candidates: &'a Candidates,
    /// Those of one of sixteen shafts; else all.
    of: Option<(&'a Reach, usize)>,
}

impl<'a> Standing<'a> {
    /// All of them.
    pub(crate) fn all(candidates: &'a Candidates) -> Self {
        Self { candidates, of: None }
    }

    /// Those of one of the sixteen shafts that [`Candidates::reach`] was asked of.
    pub(crate) fn of(candidates: &'a Candidates, reach: &'a Reach, shaft: usize) -> Self {
        Self { candidates, of: Some((reach, shaft)) }
    }

    pub(crate) fn is_empty(&self) -> bool {
        match self.of {
            Some((reach, shaft)) => reach.iter().all(|block| block[shaft] == 0),
            None => self.candidates.blocks.is_empty(),
        }
    }

    /// A bit for each facet of a block.
    #[inline(always)]
    fn facets(&self, block: usize) -> u32 {
        match self.of {
            Some((reach, shaft)) => u32::from(reach[block][shaft]),
            None => (1 << self.candidates.blocks[block].count) - 1,
        }
    }

    /// Those of them that reach into the shaft, a bit for each.
    #[inline(always)]
    fn reached<S: Simd>(&self, simd: S, shaft: &Shaft, block: usize) -> u32 {
        let facets = self.facets(block);
        if facets == 0 { 0 } else { facets & shaft.reached(simd, &self.candidates.blocks[block]) }
    }

    /// Whether any reaches into the shaft.
    #[inline(always)]
    pub(crate) fn any<S: Simd>(&self, simd: S, shaft: &Shaft) -> bool {
        for k in 0..self.candidates.blocks.len() {
            if self.reached(simd, shaft, k) != 0 {
                return true;
            }
        }
        false
    }

    /// The numbers of those that reach into the shaft, ascending.
    #[inline(always)]
    pub(crate) fn numbers<S: Simd>(&self, simd: S, shaft: &Shaft, found: &mut Vec<u32>) {
        found.clear();
        for k in 0..self.candidates.blocks.len() {
            let mut mask = self.reached(simd, shaft, k);
            while mask != 0 {
                found.push(self.candidates.blocks[k].facet[mask.trailing_zeros() as usize]);
                mask &= mask - 1;
            }
        }
        found.sort_unstable();
    }

    /// The numbers of those that reach into any of the shafts between `here` and each of sixteen others that has its bit
    /// in `lanes`, and a bit for each of these shafts, by ascending number. All of the others must lie before `here`, and
    /// `here` before them, by more than the margin.
    #[inline(always)]
    pub(crate) fn between<S: Simd>(
        &self,
        simd: S,
        (here, normal): (&End, DVec3),
        (others, lanes): (&Ends, u32),
        blockers: &Blockers,
        found: &mut Vec<(u32, u32)>,
    ) {
        found.clear();
        let mut shafts = Shafts::new(simd, here, normal, others, blockers.margin);
        for k in 0..self.candidates.blocks.len() {
            let block = &self.candidates.blocks[k];
            let mut facets = self.facets(k);
            while facets != 0 {
                let place = facets.trailing_zeros() as usize;
                facets &= facets - 1;
                let mask = shafts.reached(simd, lanes, block, place);
                if mask != 0 {
                    found.push((block.facet[place], mask));
                }
            }
        }
        found.sort_unstable();
    }
}

impl Candidates {
    /// Those that reach into each of the shafts between `here` and each of sixteen others that has its bit in `lanes`, by
    /// `share` of the margin: added to `reach`, which has an entry for each block. The others lie as in
    /// [`Standing::between`]. Tells of which shafts one of them stands across all lines: a bit for each.
    #[inline(always)]
    pub(crate) fn reach<S: Simd>(
        &self,
        simd: S,
        here: &End,
        (others, lanes): (&Ends, u32),
        (blockers, share): (&Blockers, f64),
        reach: &mut Reach,
    ) -> u32 {
        let Some(normal) = here.normal else { return 0 };
        let mut hidden = 0;
        let mut shafts = Shafts::new(simd, here, normal, others, blockers.margin * share);
        for (block, reach) in self.blocks.iter().zip(reach) {
            for place in 0..block.count {
                let mut mask = shafts.reached(simd, lanes, block, place);
                if mask & !hidden != 0 {
                    let facet = blockers.facet(block.facet[place]);
                    hidden |= shafts.covered(simd, mask & !hidden, facet, blockers.margin);
                }
                while mask != 0 {
                    reach[mask.trailing_zeros() as usize] |= 1 << place;
                    mask &= mask - 1;
                }
            }
        }
        hidden
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.blocks.is_empty()
    }

    /// How many blocks of sixteen they lie in.
    pub(crate) fn blocks(&self) -> usize {
        self.blocks.len()
    }

    /// Those of `wider` that reach into the shaft.
    #[inline(always)]
    pub(crate) fn narrowed<S: Simd>(&mut self, simd: S, wider: &Standing<'_>, shaft: &Shaft) {
        self.blocks.clear();
        for k in 0..wider.candidates.blocks.len() {
            let mask = wider.reached(simd, shaft, k);
            self.take(&wider.candidates.blocks[k], mask);
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::chance::random;
    use crate::patches;
    use crate::scene::n3d;
    use crate::simd::{self, Kernel, Level};
    use crate::visibility::FacetShape;

    /// The facets between an end and each of sixteen others: asked one by one, together, and of sixteen shafts at once.
    struct ThreeWays<'a> {
        blockers: &'a Blockers,
        here: End,
        others: &'a [End],
    }

    impl Kernel for ThreeWays<'_> {
        type Output = ([Vec<Vec<u32>>; 3], u32);

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Self::Output {
            let Self { blockers, here, others } = self;
            let mut all = Candidates::default();
            let everything = End::about([DVec3::splat(-9.0), DVec3::splat(9.0)].into_iter());
            blockers.in_shaft(simd, &Shaft::new(&everything, &everything, blockers, 0.0), &mut all);
            let mut abreast = Ends::default();
            for (lane, other) in others.iter().enumerate() {
                for k in 0..4 {
                    let corner = other.corners[k.min(other.count - 1)];
                    for axis in 0..3 {
                        abreast.corners[k][axis][lane] = corner[axis];
                        abreast.normal[axis][lane] = other.normal.expect("a flat end")[axis];
                    }
                }
            }
            let normal = here.normal.expect("a flat end");
            let lanes = abreast.facing(simd, &here, normal, blockers.margin);
            assert_eq!(lanes, 0xffff);
            let standing = Standing::all(&all);
            let (mut one_by_one, mut numbers) = (Vec::new(), Vec::new());
            for other in others {
                standing.numbers(simd, &Shaft::new(&here, other, blockers, 1.0), &mut numbers);
                one_by_one.push(numbers.clone());
            }
            let mut found = Vec::new();
            standing.between(simd, (&here, normal), (&abreast, lanes), blockers, &mut found);
            let of = |lane: usize| found.iter().filter(move |(_, lanes)| lanes >> lane & 1 == 1);
            let together = (0..LANES).map(|lane| of(lane).map(|&(facet, _)| facet).collect()).collect();
            let mut reach = vec![[0; LANES]; all.blocks()];
            let hidden = all.reach(simd, &here, (&abreast, lanes), (blockers, 1.0), &mut reach);
            let mut at_once = Vec::new();
            for (lane, other) in others.iter().enumerate() {
                let standing = Standing::of(&all, &reach, lane);
                standing.numbers(simd, &Shaft::open(&here, other, blockers, 0.0), &mut numbers);
                assert_eq!(standing.is_empty(), numbers.is_empty());
                at_once.push(numbers.clone());
            }
            // What is said to be covered is so from everywhere: lines between points of both meet one of them.
            for (other, _) in others.iter().zip(0..).filter(|&(_, lane)| hidden >> lane & 1 == 1) {
                for (s, t) in (0..25).map(|k| (f64::from(k % 5) / 4.0, f64::from(k / 5) / 4.0)) {
                    let on = |end: &End, s: f64, t: f64| {
                        let [a, b, c] = [0, 1, end.count - 1].map(|k| end.corners[k]);
                        a + (b - a) * s + (c - a) * (if end.count == 3 { t * (1.0 - s) } else { t })
                    };
                    let (from, to) = (on(&here, s, t), on(other, t, s));
                    let meets = |facet: &Facet| {
                        let along = facet.plane_distance(from, to - from);
                        let (u, v) = facet.uv(from + (to - from) * along);
                        let reach = if facet.shape == FacetShape::Triangle { u + v } else { u.max(v) };
                        (0.0..1.0).contains(&along) && u.min(v) >= 0.0 && reach <= 1.0
                    };
                    assert!(blockers.facets.iter().any(meets));
                }
            }
            ([one_by_one, together, at_once], hidden.count_ones())
        }
    }

    #[test]
    fn sixteen_shafts_hold_what_each_holds_by_itself() {
        let mut random = random();
        let mut next = || random() - 0.5;
        let mut hidden = 0;
        for corners_here in [3, 4].into_iter().cycle().take(20) {
            let mut text = String::new();
            if corners_here == 3 {
                text += "QD 1 1 -.9 -.9 0 .9 -.9 .1 .9 .9 0 -.9 .9 -.1 ID\n";
            }
            for k in 0..40 {
                let mut vector = |size: f64| DVec3::new(next(), next(), next()) * size;
                let (a, u, v) = (vector(2.0), vector(1.0), vector(1.0));
                let corners = [a, a + u, a + u + v, a + v];
                let (word, corners) =
                    if k % 2 == 0 { ("QD 1 1", &corners[..]) } else { ("TI", &corners[..3]) };
                let numbers = corners.iter().flat_map(|c| c.to_array()).map(|x| x.to_string());
                text += &format!("{word} {} ID\n", numbers.collect::<Vec<_>>().join(" "));
            }
            let scene = n3d::parse_scene("", text.as_bytes()).expect("a scene");
            let patches = patches::subdivide(&scene, 1.0).expect("patches");
            let blockers = Blockers::new(&Facets::new(&scene, &patches), 1e-9);
            // Below and above, three or four corners each.
            let mut end = |height: f64, corners: usize| {
                let tilt = DVec3::new(0.3 * next(), 0.3 * next(), -height.signum()).normalize();
                let [u, v] = [DVec3::X, -DVec3::Y * height.signum()]
                    .map(|side| (side - tilt * side.dot(tilt)) * (0.3 + 0.5 * next().abs()));
                let at = DVec3::new(next(), next(), height);
                End::flat(&[at, at + u, at + u + v, at + v][..corners], tilt)
            };
            let here = end(-2.0, corners_here);
            let others: Vec<End> = (0..LANES).map(|k| end(2.0, 3 + k % 2)).collect();
            let mut before = None;
            for level in Level::available() {
                let ([one_by_one, together, at_once], covered) =
                    simd::run(level, ThreeWays { blockers: &blockers, here, others: &others });
                hidden += covered;
                assert_eq!(one_by_one, together);
                assert_eq!(one_by_one, at_once);
                assert!(one_by_one.iter().any(|found| !found.is_empty()));
                assert!(before.is_none_or(|before| before == one_by_one), "{level:?}");
                before = Some(one_by_one);
            }
        }
        assert!(hidden > 100, "{hidden}");
    }
}
