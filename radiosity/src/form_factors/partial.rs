//! What two flat parts exchange past what stands between them.
//!
//! A facet that every line between corners passes through hides all. Else rays are shot between both, sixteen at a
//! time, in a low-discrepancy sequence of all four dimensions, each weighed with the light that it carries; few tell
//! how much is hidden, and so how many it takes. Where it takes many, what each of few facets hides is cut out of the
//! one part as points of the other see it, exactly, and integrated over these, which are halved where they differ.

use std::sync::LazyLock;

use glam::{DVec2, DVec3};

use super::cutting::FlatPieces;
use super::exact::seen_from;
use super::exchange::gauss;
use super::parts::{Outline, Part};
use crate::simd::{LANES, Simd};
use crate::visibility::{Facet, FacetShape};

/// Facets reach this much beyond their edges, in (u, v), for rays in single precision not to slip between two.
const EDGE_TOLERANCE: f32 = 1e-6;

/// Packets of sixteen rays: so many first, and no more than these.
const FIRST_PACKETS: u32 = 4;
const MOST_PACKETS: u32 = 1024;

/// More rays than this take longer than cutting, where there are few facets.
const PACKETS_BEFORE_CUTTING: f64 = 128.0;
const MOST_CUT: usize = 16;
const MOST_CUT_NEAR: usize = 64;

/// Between parts nearer than this sum of their radii over their distance few rays carry most of the light, and cutting
/// is the better way whatever it takes: rays that contradict it make its points denser, but are not taken instead.
const NEAR: f64 = 0.8;

/// N rays of a share p err by about √(p (1 - p)) N^-0.7 of the whole.
const RAY_ORDER: f64 = 0.7;

/// √(p (1 - p)) at most; and where no ray of the first tells of a shadow's edge it is as if so much did.
const MOST_SPREAD: f64 = 0.5;
const LEAST_SPREAD: f64 = 0.1;

/// How often the points' part is quartered at most, and how often whatever the differences where they contradict the
/// rays.
const QUARTERINGS: u32 = 8;
const MOST_FORCED: u32 = 3;
const FORCED_NEAR: u32 = 2;

/// Where many facets cross, each quartering costs more and tells less: no more points than these look for one pair. They are
/// counted, not the cuts, so that a facet more that hides nothing changes nothing. Among triangles that pass through one
/// another nearly all near pairs would take more.
const MOST_POINTS: u32 = 1 << 12;

/// Before points count as dense enough, the quarters may differ from what the points before foretold by so many times
/// what is allowed, together.
const ASTRAY: f64 = 8.0;

/// The packets that cutting is held against, and by how many times their error it may differ: a shadow that falls
/// between all points, or a gap, is told by them.
const JUDGING_PACKETS: u32 = 32;
const JUDGED: f64 = 4.0;

/// The four coordinates of rays, in 2⁻³²: Sobol's sequence (direction numbers of Joe & Kuo, Constructing Sobol
/// Sequences with Better Two-Dimensional Projections, 2008), each dimension scrambled as Burley has it (Practical
/// Hash-Based Owen Scrambling, 2020). A lattice, or multiples of irrational numbers, resonates with the rows of slats
/// and legs that furniture is made of.
static PLACES: LazyLock<Vec<[[u32; LANES]; 4]>> = LazyLock::new(|| {
    let directions: [[u32; 32]; 4] = std::array::from_fn(sobol_directions);
    let place = |n: u32, dimension: usize| {
        let bits = (0..32).filter(|bit| n >> bit & 1 == 1);
        scrambled(bits.fold(0, |place, bit| place ^ directions[dimension][bit]), dimension)
    };
    let of_packet = |packet: u32| {
        let first = packet * LANES as u32;
        std::array::from_fn(|dimension| std::array::from_fn(|lane| place(first + lane as u32, dimension)))
    };
    (0..MOST_PACKETS).map(of_packet).collect()
});

/// For each dimension the first direction numbers, and the inner coefficients of its polynomial.
const SOBOL: [(&[u32], u32); 4] = [(&[], 0), (&[1], 0), (&[1, 3], 1), (&[1, 3, 1], 1)];

fn sobol_directions(dimension: usize) -> [u32; 32] {
    let (first, polynomial) = SOBOL[dimension];
    let degree = first.len();
    let mut directions = [0_u32; 32];
    for bit in 0..32 {
        directions[bit] = match first.get(bit) {
            _ if degree == 0 => 1 << (31 - bit),
            Some(number) => number << (31 - bit),
            None => {
                let far = directions[bit - degree];
                let inner = (1..degree).filter(|k| polynomial >> (degree - 1 - k) & 1 == 1);
                inner.fold(far ^ far >> degree, |direction, k| direction ^ directions[bit - k])
            }
        };
    }
    directions
}

/// Each bit turned over or not, by the bits above it.
fn scrambled(place: u32, dimension: usize) -> u32 {
    let mut bits = place.reverse_bits();
    bits = bits.wrapping_add(mixed(dimension as u32 + 1));
    for factor in [0x6c50_b47c, 0xb82f_1e52, 0xc7af_e638, 0x8d22_f6e6_u32] {
        bits ^= bits.wrapping_mul(factor);
    }
    bits.reverse_bits()
}

/// A facet as rays meet it: height above its plane, and u and v, of a point.
#[derive(Clone, Copy, Debug)]
struct Met {
    height: [f32; 4],
    u: [f32; 4],
    v: [f32; 4],
    triangle: bool,
}

/// Memory that one pair after another is worked out in.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    met: Vec<Met>,
    cutters: Vec<Cutter>,
    pieces: FlatPieces,
    rest: FlatPieces,
    inside: [Vec<DVec2>; 2],
}

/// A blocker cut to what lies between two parts.
#[derive(Clone, Copy, Debug)]
struct Cutter {
    outline: Outline,
    /// Of its plane: the unit normal about which the outline runs counter-clockwise.
    normal: DVec3,
}

/// What is asked of a pair.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair<'a> {
    /// Each above the other's plane, or on it.
    pub(super) first: &'a Part,
    pub(super) second: &'a Part,
    /// What they exchange where nothing stands between.
    pub(super) whole: f64,
    /// By how much the answer may be off.
    pub(super) allowed: f64,
    /// For the rays' sequence to begin elsewhere with each pair.
    pub(super) seed: u32,
    /// Lengths up to this are rounding.
    pub(super) margin: f64,
}

/// What a pair exchanges past `blockers`.
#[inline(always)]
pub(super) fn past<'a, S: Simd>(
    simd: S,
    pair: &Pair<'_>,
    blockers: impl Iterator<Item = &'a Facet> + Clone,
    scratch: &mut Scratch,
) -> f64 {
    let frame = Frame::new(pair);
    scratch.met.clear();
    for facet in blockers.clone() {
        scratch.met.push(frame.met(facet));
    }
    if frame.is_covered(simd, pair, &scratch.met) {
        return 0.0;
    }
    let mut sums = [simd.splat_double(0.0); 2];
    let share = |sums: [S::Doubles; 2]| {
        let (seen, all) = (simd.sum_double(sums[0]), simd.sum_double(sums[1]));
        if all > 0.0 { seen / all } else { 0.0 }
    };
    let packets_for = |spread: f64| (pair.whole * spread / pair.allowed).powf(1.0 / RAY_ORDER) / LANES as f64;
    let enough = packets_for(MOST_SPREAD);
    if enough <= f64::from(FIRST_PACKETS) {
        frame.shoot(simd, pair, &scratch.met, 0..enough.ceil() as u32, &mut sums);
        return pair.whole * share(sums);
    }
    frame.shoot(simd, pair, &scratch.met, 0..FIRST_PACKETS, &mut sums);
    let seen = share(sums);
    let spread = (seen * (1.0 - seen)).max(0.0).sqrt().max(LEAST_SPREAD);
    let packets = packets_for(spread);
    if packets <= f64::from(FIRST_PACKETS) {
        return pair.whole * seen;
    }
    let distance = pair.first.centre.distance(pair.second.centre);
    let near = pair.first.radius + pair.second.radius > NEAR * distance;
    let mut shot = FIRST_PACKETS;
    let most_cut = if near { MOST_CUT_NEAR } else { MOST_CUT };
    if (near || packets > PACKETS_BEFORE_CUTTING) && scratch.met.len() <= most_cut {
        frame.shoot(simd, pair, &scratch.met, shot..JUDGING_PACKETS, &mut sums);
        shot = JUDGING_PACKETS;
        let by_rays = pair.whole * share(sums);
        let rays = f64::from(JUDGING_PACKETS) * LANES as f64;
        // Where parts are near the rays tell less.
        let error = pair.whole * spread * rays.powf(-RAY_ORDER) * if near { JUDGED } else { 1.0 };
        let mut before = f64::INFINITY;
        for forced in if near { FORCED_NEAR } else { 0 }..=MOST_FORCED {
            let by_cutting = (pair.whole - hidden(pair, blockers.clone(), forced, scratch)).max(0.0);
            let by_rays_too = (by_cutting - by_rays).abs() <= JUDGED * error + pair.allowed;
            if by_rays_too || (near && (by_cutting - before).abs() <= pair.allowed) {
                return by_cutting;
            }
            before = by_cutting;
        }
        if near {
            // Few rays carry most of the light: however many they are, the points know better.
            return before;
        }
    }
    let most = packets.min(f64::from(MOST_PACKETS)) as u32;
    frame.shoot(simd, pair, &scratch.met, shot..most, &mut sums);
    pair.whole * share(sums)
}

/// Where rays are shot: from the middle between both, their distance for unit.
struct Frame {
    middle: DVec3,
    scale: f64,
}

impl Frame {
    fn new(pair: &Pair<'_>) -> Self {
        let (first, second) = (pair.first, pair.second);
        let reach = first.centre.distance(second.centre).max(first.radius).max(second.radius);
        Self { middle: (first.centre + second.centre) * 0.5, scale: 1.0 / reach }
    }

    fn place(&self, point: DVec3) -> [f32; 3] {
        ((point - self.middle) * self.scale).to_array().map(|x| x as f32)
    }

    fn met(&self, facet: &Facet) -> Met {
        let origin = facet.origin - self.middle;
        let measure = |along: DVec3, scale: f64| {
            let [x, y, z] = (along * scale).to_array().map(|x| x as f32);
            [x, y, z, (-along.dot(origin) * scale * self.scale) as f32]
        };
        let [u, v] = facet.duals();
        Met {
            height: measure(facet.normal, 1.0),
            u: measure(u, 1.0 / self.scale),
            v: measure(v, 1.0 / self.scale),
            triangle: facet.shape == FacetShape::Triangle,
        }
    }

    /// Whether a facet stands across all lines between the corners of both.
    #[inline(always)]
    fn is_covered<S: Simd>(&self, simd: S, pair: &Pair<'_>, met: &[Met]) -> bool {
        let (first, second) = (pair.first.outline(), pair.second.outline());
        let (first, second) = (first.corners(), second.corners());
        let mut from = [[0.0; LANES]; 3];
        let mut to = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            let a = self.place(first[(lane / 4).min(first.len() - 1)]);
            let b = self.place(second[(lane % 4).min(second.len() - 1)]);
            for axis in 0..3 {
                from[axis][lane] = a[axis];
                to[axis][lane] = b[axis];
            }
        }
        let from = [simd.load(&from[0]), simd.load(&from[1]), simd.load(&from[2])];
        let to = [simd.load(&to[0]), simd.load(&to[1]), simd.load(&to[2])];
        for met in met {
            if meets(simd, met, from, to) == 0xffff {
                return true;
            }
        }
        false
    }

    /// Shoot packets of rays; to the sums are added the light of those that arrive, and of all.
    #[inline(always)]
    fn shoot<S: Simd>(
        &self,
        simd: S,
        pair: &Pair<'_>,
        met: &[Met],
        packets: std::ops::Range<u32>,
        sums: &mut [S::Doubles; 2],
    ) {
        let sides = |part: &Part| {
            let side = |side: DVec3| (side * self.scale).to_array().map(|x| x as f32);
            [self.place(part.origin), side(part.u), side(part.v)]
        };
        let [first, second] = [sides(pair.first), sides(pair.second)];
        let [first_folds, second_folds] =
            [pair.first, pair.second].map(|part| part.shape == FacetShape::Triangle);
        let [normal, other_normal] =
            [pair.first.normal, pair.second.normal].map(|normal| normal.to_array().map(|x| x as f32));
        let zero = simd.splat(0.0);
        let table = &*PLACES;
        for packet in packets {
            let mut at = [zero; 4];
            for dimension in 0..4 {
                let start = mixed(pair.seed.wrapping_add(dimension as u32));
                let along = simd.load_int(&table[packet as usize][dimension]);
                let along = simd.add_int(along, simd.splat_int(start as i32));
                // Of all 2³² values those below zero come first.
                at[dimension] =
                    simd.fused(simd.to_float(along), simd.splat(2.0_f32.powi(-32)), simd.splat(0.5));
            }
            let from = on_part(simd, first, first_folds, at[0], at[1]);
            let to = on_part(simd, second, second_folds, at[2], at[3]);
            let ray = [simd.sub(to[0], from[0]), simd.sub(to[1], from[1]), simd.sub(to[2], from[2])];
            let squared = dot(simd, ray, ray);
            let out = dot(simd, ray, splat(simd, normal));
            let into = simd.sub(zero, dot(simd, ray, splat(simd, other_normal)));
            let light =
                simd.div(simd.mul(simd.max(out, zero), simd.max(into, zero)), simd.mul(squared, squared));
            let mut hidden = 0;
            for met in met {
                hidden |= meets(simd, met, from, to);
                if hidden == 0xffff {
                    break;
                }
            }
            let arriving = simd.select(simd.mask(hidden), zero, light);
            sums[0] = simd.add_double(sums[0], simd.widen(arriving));
            sums[1] = simd.add_double(sums[1], simd.widen(light));
        }
    }
}

/// The bits of a number well mixed (Murmur3's last step).
pub(super) fn mixed(mut bits: u32) -> u32 {
    bits = (bits ^ bits >> 16).wrapping_mul(0x85eb_ca6b);
    bits = (bits ^ bits >> 13).wrapping_mul(0xc2b2_ae35);
    bits ^ bits >> 16
}

#[inline(always)]
fn splat<S: Simd>(simd: S, v: [f32; 3]) -> [S::Floats; 3] {
    [simd.splat(v[0]), simd.splat(v[1]), simd.splat(v[2])]
}

#[inline(always)]
fn dot<S: Simd>(simd: S, a: [S::Floats; 3], b: [S::Floats; 3]) -> S::Floats {
    simd.fused(a[2], b[2], simd.fused(a[1], b[1], simd.mul(a[0], b[0])))
}

/// Points of a part from a square.
#[inline(always)]
fn on_part<S: Simd>(
    simd: S,
    [origin, u, v]: [[f32; 3]; 3],
    folds: bool,
    mut s: S::Floats,
    mut t: S::Floats,
) -> [S::Floats; 3] {
    if folds {
        // The square's other half lies over this one.
        let one = simd.splat(1.0);
        let beyond = simd.greater(simd.add(s, t), one);
        s = simd.select(beyond, simd.sub(one, s), s);
        t = simd.select(beyond, simd.sub(one, t), t);
    }
    let (origin, u, v) = (splat(simd, origin), splat(simd, u), splat(simd, v));
    [
        simd.fused(v[0], t, simd.fused(u[0], s, origin[0])),
        simd.fused(v[1], t, simd.fused(u[1], s, origin[1])),
        simd.fused(v[2], t, simd.fused(u[2], s, origin[2])),
    ]
}

/// A bit for each ray that a facet stands across.
#[inline(always)]
fn meets<S: Simd>(simd: S, met: &Met, from: [S::Floats; 3], to: [S::Floats; 3]) -> u32 {
    let (zero, tolerance) = (simd.splat(0.0), simd.splat(-EDGE_TOLERANCE));
    let [height, other_height] = measured(simd, met.height, from, to);
    // On different sides of its plane.
    let across = simd.greater(zero, simd.mul(height, other_height));
    let along = simd.div(height, simd.sub(height, other_height));
    let [u, other_u] = measured(simd, met.u, from, to);
    let [v, other_v] = measured(simd, met.v, from, to);
    let u = simd.fused(simd.sub(other_u, u), along, u);
    let v = simd.fused(simd.sub(other_v, v), along, v);
    let reach = if met.triangle { simd.add(u, v) } else { simd.max(u, v) };
    let within = simd.and(simd.greater(u, tolerance), simd.greater(v, tolerance));
    let within = simd.and(within, simd.greater(simd.splat(1.0 + EDGE_TOLERANCE), reach));
    simd.lanes(simd.and(across, within))
}

#[inline(always)]
fn measured<S: Simd>(simd: S, m: [f32; 4], from: [S::Floats; 3], to: [S::Floats; 3]) -> [S::Floats; 2] {
    let (x, y, z, start) = (simd.splat(m[0]), simd.splat(m[1]), simd.splat(m[2]), simd.splat(m[3]));
    [
        simd.fused(z, from[2], simd.fused(y, from[1], simd.fused(x, from[0], start))),
        simd.fused(z, to[2], simd.fused(y, to[1], simd.fused(x, to[0], start))),
    ]
}

/// What the blockers hide of what the pair exchanges, by cutting; points are made denser `forced` times in any case.
fn hidden<'a>(
    pair: &Pair<'_>,
    blockers: impl Iterator<Item = &'a Facet>,
    forced: u32,
    scratch: &mut Scratch,
) -> f64 {
    // Points of the smaller see the larger.
    let turned = pair.second.area < pair.first.area;
    let (here, there) = if turned { (pair.second, pair.first) } else { (pair.first, pair.second) };
    let Scratch { cutters, pieces, rest, inside, .. } = scratch;
    cutters.clear();
    for facet in blockers {
        let (corners, count) = facet.corners();
        let mut outline = Outline::of(&corners[..count]);
        for part in [here, there] {
            let [above, _] = outline.parted(part.normal, part.normal.dot(part.centre), pair.margin);
            outline = above;
        }
        if !outline.is_empty() {
            cutters.push(Cutter { outline, normal: facet.u.cross(facet.v).normalize_or_zero() });
        }
    }
    let (there, margin) = (Flat::new(there), pair.margin);
    let mut seer = Seer { there, cutters, pieces, rest, inside, margin, points: 0 };
    let coarse = seer.over(here);
    seer.finer(here, &coarse, pair.allowed, Depth { quarterings: 0, forced, points: MOST_POINTS })
}

/// A part in a plane of its own: points are origin + x axes[0] + y axes[1].
struct Flat {
    origin: DVec3,
    axes: [DVec3; 2],
    corners: [DVec2; 4],
    count: usize,
}

impl Flat {
    fn new(part: &Part) -> Self {
        // The sides themselves will do: what is cut by lines stays so in any coordinates.
        let corners = match part.shape {
            FacetShape::Triangle => [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::Y],
            FacetShape::Parallelogram => [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y],
        };
        let count = if part.shape == FacetShape::Triangle { 3 } else { 4 };
        Self { origin: part.origin, axes: [part.u, part.v], corners, count }
    }

    fn point(&self, at: DVec2) -> DVec3 {
        self.origin + self.axes[0] * at.x + self.axes[1] * at.y
    }
}

/// Points along a part's sides and weights.
type FlatQuadrature = Vec<([f64; 2], f64)>;

/// The Gauss points of a part for [`hidden`]: two along each side.
static POINTS: LazyLock<[FlatQuadrature; 2]> = LazyLock::new(|| {
    let along = gauss(2);
    let pairs = || along.iter().flat_map(|s| along.iter().map(move |t| (*s, *t)));
    [
        pairs().map(|((s, a), (t, b))| ([s, t], a * b)).collect(),
        // A triangle is a square one of whose sides is a point.
        pairs().map(|((s, a), (t, b))| ([s * (1.0 - t), s * t], 2.0 * s * a * b)).collect(),
    ]
});

/// Sees a part past what stands before it.
struct Seer<'a> {
    there: Flat,
    cutters: &'a [Cutter],
    pieces: &'a mut FlatPieces,
    rest: &'a mut FlatPieces,
    inside: &'a mut [Vec<DVec2>; 2],
    margin: f64,
    /// How many points have looked so far.
    points: u32,
}

/// How far quartering has gone, and may go.
#[derive(Clone, Copy)]
struct Depth {
    quarterings: u32,
    /// So often whatever the differences.
    forced: u32,
    /// Until so many points have looked in all.
    points: u32,
}

/// What four points of a part see of what is hidden.
struct Hidden {
    values: [f64; 4],
    /// The integral over the part.
    sum: f64,
}

impl Hidden {
    /// What the plane or saddle through the points' values has at another point of the part.
    fn at(&self, part: &Part, point: DVec3) -> f64 {
        let from_origin = point - part.origin;
        let unit = part.u.cross(part.v).dot(part.normal);
        let mut s = from_origin.cross(part.v).dot(part.normal) / unit;
        let mut t = part.u.cross(from_origin).dot(part.normal) / unit;
        if part.shape == FacetShape::Triangle {
            (s, t) = (s + t, t / (s + t));
        }
        let along = |x: f64, from: f64, to: f64| from + (to - from) * (0.5 + (x - 0.5) * 3.0_f64.sqrt());
        let [a, b, c, d] = self.values;
        along(s, along(t, a, b), along(t, c, d))
    }
}

impl Seer<'_> {
    /// The integral over a part of what is hidden, by four points.
    fn over(&mut self, here: &Part) -> Hidden {
        let points = &POINTS[usize::from(here.shape == FacetShape::Triangle)];
        let mut hidden = Hidden { values: [0.0; 4], sum: 0.0 };
        for (value, &([s, t], weight)) in hidden.values.iter_mut().zip(points) {
            *value = self.from(here.origin + here.u * s + here.v * t, here.normal);
            hidden.sum += weight * *value;
        }
        hidden.sum *= here.area;
        hidden
    }

    /// The same, with points as dense as it takes.
    fn finer(&mut self, here: &Part, coarse: &Hidden, allowed: f64, depth: Depth) -> f64 {
        let [left, right] = here.halves();
        let [[a, b], [c, d]] = [left.halves(), right.halves()];
        let quarters = [a, b, c, d];
        let fine = [self.over(&a), self.over(&b), self.over(&c), self.over(&d)];
        let sum = fine[0].sum + fine[1].sum + fine[2].sum + fine[3].sum;
        // Four times as many points err by a third of the difference or less. But a shadow that some points miss can
        // leave the sum as it was: each quarter is to be as the four points foretell, too.
        let mut astray = 0.0;
        for (quarter, fine) in quarters.iter().zip(&fine) {
            astray += (fine.sum - coarse.at(here, quarter.centre) * quarter.area).abs();
        }
        let agree = (sum - coarse.sum).abs() <= 2.0 * allowed && astray <= ASTRAY * allowed;
        let Depth { quarterings, forced, points } = depth;
        let stands = quarterings >= forced && agree;
        if stands || quarterings == QUARTERINGS || self.points >= points {
            return sum;
        }
        let mut sum = 0.0;
        for ((quarter, coarse), sharing) in quarters.iter().zip(&fine).zip((1..=4).rev()) {
            // What one quarter does not need is left to the others.
            let points = self.points + points.saturating_sub(self.points) / sharing;
            let depth = Depth { quarterings: quarterings + 1, forced, points };
            sum += self.finer(quarter, coarse, 0.5 * allowed, depth);
        }
        sum
    }

    /// The form factor from a point to what is hidden from it.
    fn from(&mut self, point: DVec3, normal: DVec3) -> f64 {
        self.points += 1;
        self.pieces.clear();
        self.pieces.push(self.there.corners[..self.there.count].iter().copied());
        let mut hidden = 0.0;
        let to_there = self.there.origin - point;
        let [x, y] = self.there.axes;
        for cutter in self.cutters {
            let corners = cutter.outline.corners();
            let height = cutter.normal.dot(point - corners[0]);
            if height.abs() <= self.margin {
                continue;
            }
            // The planes through the point and its edges, where they meet the plane of the part.
            let mut lines = [[0.0; 3]; 6];
            let mut before = corners[corners.len() - 1] - point;
            for (line, &corner) in lines.iter_mut().zip(corners) {
                let corner = corner - point;
                let plane = before.cross(corner) * -height.signum();
                *line = [plane.dot(to_there), plane.dot(x), plane.dot(y)];
                before = corner;
            }
            self.rest.clear();
            for piece in self.pieces.iter() {
                self.rest.add_outside(piece, lines[..corners.len()].iter().copied(), self.inside);
                let inside = &self.inside[0];
                if inside.len() >= 3 {
                    let corner = |k: usize| self.there.point(inside[k]);
                    hidden += seen_from(point, normal, (0..inside.len()).map(corner)).max(0.0);
                }
            }
            std::mem::swap(self.pieces, self.rest);
        }
        hidden
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_are_spread_evenly() {
        let first =
            |count: usize| PLACES.iter().flat_map(|p| (0..LANES).map(|lane| p.map(|d| d[lane]))).take(count);
        // Of 4,096 points one in each of as many intervals, in each dimension.
        for dimension in 0..4 {
            let mut seen = vec![false; 4096];
            first(4096).for_each(|place| seen[(place[dimension] >> 20) as usize] = true);
            assert!(seen.iter().all(|&seen| seen), "{dimension}");
        }
        // Of 256 one in each square of 16 x 16, in the first two.
        let mut seen = vec![false; 256];
        first(256).for_each(|place| seen[(place[0] >> 28 << 4 | place[1] >> 28) as usize] = true);
        assert!(seen.iter().all(|&seen| seen));
    }
}
