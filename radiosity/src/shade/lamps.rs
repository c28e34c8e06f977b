//! Light straight from the lamps: at a point, exactly.
//!
//! What of a lamp is above the point's horizon sends it E times its form factor, by Lambert's formula. What stands between, if
//! anything, is found for many points of one facet at once, by a shaft from them to the lamp; then what each blocker hides is cut
//! out of the lamp's outline as the point sees it. Where blockers are many the lamp is cut into strips instead, and of the middle
//! line of each strip every blocker hides an interval.

use glam::{DVec2, DVec3};

use crate::form_factors::{FlatPieces, Outline, seen_from};
use crate::light::Rgb;
use crate::patches::Patches;
use crate::scene::BackFaces;
use crate::simd::{self, Level, Simd};
use crate::visibility::{Blockers, Candidates, Cells, End, Facet, FacetShape, Facets, Shaft, Standing};

/// Lengths up to this, relative to the scene's extent, are rounding.
const ROUNDING: f64 = 1e-9;

/// A surface with more facets than this that emit is no lamp here: its light is gathered as if it were reflected.
const MOST_FACETS: usize = 1024;

/// More blockers than this, of those that a point sees before a lamp, are not cut out: pieces multiply.
const MOST_CUT: usize = 12;

/// The strips that a lamp is cut into then.
const STRIPS: usize = 32;

/// The most corners of a blocker before a lamp's plane.
const MOST_EDGES: usize = 6;

/// What emits, and what can stand before it.
#[derive(Clone, Debug)]
pub(super) struct Lamps {
    groups: Vec<Group>,
    lamps: Vec<Lamp>,
    blockers: Blockers,
    margin: f64,
}

/// The lamps of one surface.
#[derive(Clone, Debug)]
struct Group {
    lamps: std::ops::Range<usize>,
    /// The lamp itself or, of several, the box about them.
    end: End,
    /// Whether none stands before any other.
    convex: bool,
    /// Whether these are the backs of a convex closed body, which nobody sees from without.
    within: bool,
}

/// One side of a flat facet that emits.
#[derive(Clone, Copy, Debug)]
struct Lamp {
    origin: DVec3,
    /// u × v points where it shines.
    u: DVec3,
    v: DVec3,
    shape: FacetShape,
    normal: DVec3,
    emission: Rgb,
    surface: u32,
}

/// A point that light falls on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Receiver {
    pub(super) point: DVec3,
    /// Unit normal of the side that is lit: of a curved surface the true one, not the facet's.
    pub(super) normal: DVec3,
}

/// Where receivers are that are asked about together: on one facet.
pub(super) struct Receivers<'a> {
    pub(super) points: &'a [Receiver],
    /// The corners of a parallelogram of the facet that they all lie in, around it.
    pub(super) outline: [DVec3; 4],
    /// The facet's own normal.
    pub(super) normal: DVec3,
    /// Of a facet that stands for a curved surface, the number of that.
    pub(super) curved: Option<u32>,
}

/// A blocker before a lamp's plane.
#[derive(Clone, Copy, Debug)]
struct Cutter {
    outline: Outline,
    /// Of its plane: the unit normal about which the outline runs counter-clockwise, and that of its front.
    normal: DVec3,
    front: DVec3,
    surface: u32,
}

/// A blocker as a point sees it before a lamp: the lines of the lamp's plane that it lies within. (x, y) is within a line
/// (a, b, c) where a + b x + c y >= 0.
#[derive(Clone, Copy, Debug)]
struct Shadow {
    lines: [[f64; 3]; MOST_EDGES],
    count: usize,
}

/// A lamp's outline in its own (u, v), cut by one line at most.
#[derive(Clone, Copy, Debug, Default)]
struct Whole {
    corners: [DVec2; 5],
    count: usize,
}

/// Memory that one group of receivers after another is worked out in.
#[derive(Clone, Debug, Default)]
pub(super) struct LampScratch {
    group: Candidates,
    numbers: Vec<u32>,
    cutters: Vec<Cutter>,
    shadows: Vec<Shadow>,
    hidden: Vec<[f64; 2]>,
    pieces: FlatPieces,
    rest: FlatPieces,
    inside: [Vec<DVec2>; 2],
}

impl Lamps {
    /// Those among `facets` whose patches emit. A lamp's back shines, too, where backs are lit.
    pub(super) fn new(patches: &Patches, facets: &Facets, back_faces: BackFaces) -> Self {
        let margin = ROUNDING * facets.extent();
        let (mut groups, mut lamps) = (Vec::new(), Vec::new());
        for surface in 0..patches.blocks.len() as u32 {
            let first = lamps.len();
            for number in facets.of_surface(surface) {
                let facet = &facets[number];
                let emission = patches.emission[first_patch(facet) as usize];
                if !emission.is_black()
                    && let Some(lamp) = Lamp::new(facet, emission)
                {
                    lamps.push(lamp);
                }
            }
            if lamps.len() - first > MOST_FACETS {
                lamps.truncate(first);
            }
            if lamps.len() == first {
                continue;
            }
            let end = lamps.len();
            let front = Group::new(&lamps, first..end, margin);
            let within = front.convex && is_closed(&lamps[first..]);
            groups.push(front);
            if back_faces == BackFaces::Lit {
                lamps.extend_from_within(first..end);
                lamps[end..].iter_mut().for_each(Lamp::turn);
                groups.push(Group { within, ..Group::new(&lamps, end..lamps.len(), margin) });
            }
        }
        Self { groups, lamps, blockers: Blockers::new(facets, margin), margin }
    }

    /// The surfaces whose own light comes from these lamps; one may be named twice.
    pub(super) fn surfaces(&self) -> impl Iterator<Item = u32> {
        self.groups.iter().map(|group| self.lamps[group.lamps.start].surface)
    }

    /// Whether anything stands in the space between a flat convex outline of a facet, counter-clockwise about its `normal`, and
    /// the same `height` above it.
    pub(super) fn anything_on(&self, outline: [DVec3; 4], normal: DVec3, height: f64) -> bool {
        let below = End::flat(&outline, normal);
        let above = End::flat(&outline.map(|corner| corner + normal * height), normal).turned();
        let shaft = Shaft::new(&below, &above, &self.blockers, 1.0);
        let mut found = Candidates::default();
        simd::run(Level::best(), Find { blockers: &self.blockers, shaft: &shaft, found: &mut found });
        !found.is_empty()
    }

    /// Add to `light`, one a receiver, what comes straight from the lamps: irradiance, in the unit of the emissions.
    pub(super) fn add_light(&self, receivers: &Receivers<'_>, light: &mut [Rgb], scratch: &mut LampScratch) {
        let here = match receivers.curved {
            // The true horizon is not the facet's.
            Some(_) => End::about(receivers.points.iter().map(|receiver| receiver.point)),
            None => End::flat(&receivers.outline, receivers.normal),
        };
        for group in &self.groups {
            if receivers.curved.is_none() {
                let (_, highest) = group.end.heights(receivers.outline[0], receivers.normal);
                if highest <= self.margin {
                    continue;
                }
            }
            if let Some(normal) = group.end.normal
                && here.heights(group.end.corners[0], normal).1 <= self.margin
            {
                continue;
            }
            let lamps = &self.lamps[group.lamps.clone()];
            let behind = |lamp: &Lamp| here.heights(lamp.origin, lamp.normal).1 <= self.margin;
            if group.within && lamps.iter().any(behind) {
                continue;
            }
            let shaft = Shaft::new(&here, &group.end, &self.blockers, 1.0);
            let find = Find { blockers: &self.blockers, shaft: &shaft, found: &mut scratch.group };
            simd::run(Level::best(), find);
            for lamp in lamps {
                self.add_lamp(lamp, group, receivers, &here, light, scratch);
            }
        }
    }

    fn add_lamp(
        &self,
        lamp: &Lamp,
        group: &Group,
        receivers: &Receivers<'_>,
        here: &End,
        light: &mut [Rgb],
        scratch: &mut LampScratch,
    ) {
        if here.heights(lamp.origin, lamp.normal).1 <= self.margin {
            return;
        }
        scratch.cutters.clear();
        scratch.numbers.clear();
        if !scratch.group.is_empty() {
            let shaft = Shaft::new(here, &lamp.end(), &self.blockers, 1.0);
            let LampScratch { group: wider, numbers, .. } = &mut *scratch;
            simd::run(Level::best(), Narrow { wider, shaft: &shaft, numbers });
        }
        for &number in &scratch.numbers {
            let facet = self.blockers.facet(number);
            if group.convex && facet.surface == lamp.surface {
                continue;
            }
            let (corners, count) = facet.corners();
            // What reaches behind the lamp hides nothing there.
            let level = lamp.normal.dot(lamp.origin);
            let [outline, _] = Outline::of(&corners[..count]).parted(lamp.normal, level, self.margin);
            if !outline.is_empty() {
                let normal = facet.u.cross(facet.v).normalize_or_zero();
                let surface = facet.surface;
                scratch.cutters.push(Cutter { outline, normal, front: facet.normal, surface });
            }
        }
        for (receiver, light) in receivers.points.iter().zip(light) {
            let factor = self.from(lamp, receiver, receivers.curved, scratch);
            if factor > 0.0 {
                *light += lamp.emission * factor;
            }
        }
    }

    /// The form factor from a receiver to what it sees of a lamp.
    fn from(&self, lamp: &Lamp, receiver: &Receiver, curved: Option<u32>, scratch: &mut LampScratch) -> f64 {
        let &Receiver { point, normal } = receiver;
        if lamp.normal.dot(point - lamp.origin) <= self.margin {
            return 0.0;
        }
        let to_lamp = lamp.origin - point;
        let horizon = [normal.dot(to_lamp), normal.dot(lamp.u), normal.dot(lamp.v)];
        let whole = Whole::new(lamp.shape).above(horizon, self.margin);
        if whole.count == 0 {
            return 0.0;
        }
        let outline = whole.corners();
        scratch.shadows.clear();
        for cutter in &scratch.cutters {
            let corners = cutter.outline.corners();
            let height = cutter.normal.dot(point - corners[0]);
            if height.abs() <= self.margin || curved.is_some_and(|surface| cutter.is_own(receiver, surface)) {
                continue;
            }
            // The planes through the point and its edges, where they meet the plane of the lamp.
            let mut shadow = Shadow { lines: [[0.0; 3]; MOST_EDGES], count: 0 };
            let mut before = corners[corners.len() - 1] - point;
            let (mut apart, mut within) = (false, true);
            for &corner in corners {
                let corner = corner - point;
                let plane = before.cross(corner) * -height.signum();
                before = corner;
                // An edge that runs through the point bounds nothing that it sees.
                if plane == DVec3::ZERO {
                    continue;
                }
                let line = [plane.dot(to_lamp), plane.dot(lamp.u), plane.dot(lamp.v)];
                let side = |at: &DVec2| line[0] + line[1] * at.x + line[2] * at.y;
                apart |= outline.iter().all(|at| side(at) <= 0.0);
                within &= outline.iter().all(|at| side(at) >= 0.0);
                shadow.lines[shadow.count] = line;
                shadow.count += 1;
            }
            if apart {
                continue;
            }
            if within {
                return 0.0;
            }
            scratch.shadows.push(shadow);
        }
        let seen = |corners: &[DVec2]| {
            let corner = |at: &DVec2| point + to_lamp + lamp.u * at.x + lamp.v * at.y;
            seen_from(point, normal, corners.iter().map(corner)).max(0.0)
        };
        match scratch.shadows.len() {
            0 => seen(outline),
            1..=MOST_CUT => {
                let LampScratch { shadows, pieces, rest, inside, .. } = scratch;
                pieces.clear();
                pieces.push(outline.iter().copied());
                for shadow in shadows.iter() {
                    rest.clear();
                    for piece in pieces.iter() {
                        rest.add_outside(piece, shadow.lines[..shadow.count].iter().copied(), inside);
                    }
                    std::mem::swap(pieces, rest);
                }
                pieces.iter().map(seen).sum()
            }
            _ => in_strips(&whole, &scratch.shadows, &mut scratch.hidden, seen),
        }
    }
}

impl Group {
    fn new(lamps: &[Lamp], range: std::ops::Range<usize>, margin: f64) -> Self {
        let own = &lamps[range.clone()];
        let corners = |lamp: &Lamp| {
            let end = lamp.end();
            end.corners.into_iter().take(end.count)
        };
        let behind = |lamp: &Lamp| {
            let mut others = own.iter().flat_map(corners);
            others.all(|corner| lamp.normal.dot(corner - lamp.origin) <= margin)
        };
        let end = match own {
            [lamp] => lamp.end(),
            _ => End::about(own.iter().flat_map(corners)),
        };
        Self { lamps: range, end, convex: own.iter().all(behind), within: false }
    }
}

impl Lamp {
    /// `None` of a facet without area.
    fn new(facet: &Facet, emission: Rgb) -> Option<Self> {
        let &Facet { origin, u, v, shape, surface, normal, .. } = facet;
        let cross = u.cross(v).try_normalize()?;
        let mut lamp = Self { origin, u, v, shape, normal: cross, emission, surface };
        // A facet's own normal may be turned against u × v.
        if cross.dot(normal) < 0.0 {
            lamp.turn();
        }
        Some(lamp)
    }

    /// Make it the other side.
    fn turn(&mut self) {
        (self.u, self.v, self.normal) = (self.v, self.u, -self.normal);
    }

    fn end(&self) -> End {
        let (a, b, c) = (self.origin, self.origin + self.u, self.origin + self.v);
        match self.shape {
            FacetShape::Triangle => End::flat(&[a, b, c], self.normal),
            FacetShape::Parallelogram => End::flat(&[a, b, b + self.v, c], self.normal),
        }
    }
}

impl Cutter {
    /// Whether it hides from a point of a curved surface only what the surface itself hides below its true horizon: facets of the
    /// same surface, lying much as it does there, that the way up passes from behind.
    fn is_own(&self, receiver: &Receiver, surface: u32) -> bool {
        self.surface == surface
            && self.front.dot(receiver.normal).abs() > OWN
            && self.front.dot(receiver.normal) * self.front.dot(receiver.point - self.outline.corners()[0])
                <= 0.0
    }
}

/// The cosine of the angle up to which facets of a curved surface lie as a point of it does.
const OWN: f64 = 0.5;

impl Whole {
    fn new(shape: FacetShape) -> Self {
        match shape {
            FacetShape::Triangle => {
                Self { corners: [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ZERO, DVec2::ZERO], count: 3 }
            }
            FacetShape::Parallelogram => {
                Self { corners: [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y, DVec2::ZERO], count: 4 }
            }
        }
    }

    fn corners(&self) -> &[DVec2] {
        &self.corners[..self.count]
    }

    /// What lies within a line; within `margin` of it is on it. Empty where nothing lies beyond that.
    fn above(self, [a, b, c]: [f64; 3], margin: f64) -> Self {
        let height = |at: DVec2| {
            let height = a + b * at.x + c * at.y;
            if height.abs() <= margin { 0.0 } else { height }
        };
        let heights = self.corners.map(height);
        let heights = &heights[..self.count];
        if heights.iter().all(|&height| height >= 0.0) && heights.iter().any(|&height| height > 0.0) {
            return self;
        }
        let mut kept = Self::default();
        if heights.iter().all(|&height| height <= 0.0) {
            return kept;
        }
        let mut keep = |corner| {
            kept.corners[kept.count] = corner;
            kept.count += 1;
        };
        for k in 0..self.count {
            let next = if k + 1 == self.count { 0 } else { k + 1 };
            let (from, to) = (heights[k], heights[next]);
            if from >= 0.0 {
                keep(self.corners[k]);
            }
            if from * to < 0.0 {
                keep(self.corners[k] + (self.corners[next] - self.corners[k]) * (from / (from - to)));
            }
        }
        kept
    }

    /// The x between which it lies at this y.
    fn across(&self, y: f64) -> [f64; 2] {
        let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
        for k in 0..self.count {
            let (from, to) = (self.corners[k], self.corners[if k + 1 == self.count { 0 } else { k + 1 }]);
            if (from.y - y) * (to.y - y) <= 0.0 && from.y != to.y {
                let x = from.x + (to.x - from.x) * ((y - from.y) / (to.y - from.y));
                ends = [ends[0].min(x), ends[1].max(x)];
            }
        }
        ends
    }
}

/// Whether convex lamps are all of a body: they fill the whole sphere about the middle of their corners.
fn is_closed(lamps: &[Lamp]) -> bool {
    let middle = lamps.iter().map(|lamp| lamp.origin).sum::<DVec3>() / lamps.len() as f64;
    let triangle = |corners: [DVec3; 3]| {
        let [a, b, c] = corners.map(|corner| (corner - middle).normalize_or_zero());
        // Van Oosterom & Strackee, The Solid Angle of a Plane Triangle, 1983.
        2.0 * a.dot(b.cross(c)).atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
    };
    let angle = |lamp: &Lamp| {
        let (a, b, c) = (lamp.origin, lamp.origin + lamp.u, lamp.origin + lamp.v);
        match lamp.shape {
            FacetShape::Triangle => triangle([a, b, c]),
            FacetShape::Parallelogram => triangle([a, b, c]) + triangle([b, b + lamp.v, c]),
        }
    };
    (lamps.iter().map(angle).sum::<f64>() / (4.0 * std::f64::consts::PI) - 1.0).abs() < ROUNDING
}

/// What is left of a lamp behind many shadows: `seen` tells the form factor of any part of it.
fn in_strips(
    whole: &Whole,
    shadows: &[Shadow],
    hidden: &mut Vec<[f64; 2]>,
    seen: impl Fn(&[DVec2]) -> f64,
) -> f64 {
    let ends = whole
        .corners()
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(at.y), high.max(at.y)]);
    let width = (ends[1] - ends[0]) / STRIPS as f64;
    let (mut open, mut all) = (0.0, 0.0);
    for strip in 0..STRIPS {
        let low = ends[0] + width * strip as f64;
        let y = low + 0.5 * width;
        let [from, to] = whole.across(y);
        if from >= to {
            continue;
        }
        let part = |from: f64, to: f64| {
            let (low, high) = (low, low + width);
            seen(&[DVec2::new(from, low), DVec2::new(to, low), DVec2::new(to, high), DVec2::new(from, high)])
        };
        let of_strip = part(from, to);
        all += of_strip;
        hidden.clear();
        for shadow in shadows {
            let mut interval = [from, to];
            for &[a, b, c] in &shadow.lines[..shadow.count] {
                let start = a + c * y;
                if b > 0.0 {
                    interval[0] = interval[0].max(-start / b);
                } else if b < 0.0 {
                    interval[1] = interval[1].min(-start / b);
                } else if start < 0.0 {
                    interval[1] = interval[0];
                }
            }
            if interval[0] < interval[1] {
                hidden.push(interval);
            }
        }
        if hidden.is_empty() {
            open += of_strip;
            continue;
        }
        hidden.sort_unstable_by(|one, other| one[0].total_cmp(&other[0]).then(one[1].total_cmp(&other[1])));
        let mut at = from;
        for &[start, end] in hidden.iter() {
            // What rounding leaves between two facets that share an edge is no gap.
            if start - at > GAP * (to - from) {
                open += part(at, start);
            }
            at = at.max(end);
        }
        if to - at > GAP * (to - from) {
            open += part(at, to);
        }
    }
    // The strips' ends are square: what that adds or takes away cancels out.
    if all > 0.0 { seen(whole.corners()) * (open / all) } else { 0.0 }
}

/// A gap between two shadows that is rounding, as a share of the lamp's width there.
const GAP: f64 = 1e-6;

/// A facet carries patches of one surface, and those of a grid are alike: its first patch tells of all.
fn first_patch(facet: &Facet) -> u32 {
    match facet.cells {
        Cells::One(patch) | Cells::Grid { first: patch, .. } => patch,
    }
}

/// Find all blockers in a shaft.
struct Find<'a> {
    blockers: &'a Blockers,
    shaft: &'a Shaft,
    found: &'a mut Candidates,
}

impl simd::Kernel for Find<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        self.blockers.in_shaft(simd, self.shaft, self.found);
    }
}

/// Find those of a wider shaft's that reach into this one, by number.
struct Narrow<'a> {
    wider: &'a Candidates,
    shaft: &'a Shaft,
    numbers: &'a mut Vec<u32>,
}

impl simd::Kernel for Narrow<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        Standing::all(self.wider).numbers(simd, self.shaft, self.numbers);
    }
}
