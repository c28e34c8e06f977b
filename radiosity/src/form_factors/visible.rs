//! Exact form factors times visibility: what a patch sends to another were nothing else there, and how much of that
//! arrives.
//!
//! Every patch is flat convex *parts*, and what two parts exchange, G = A_i F_ij, is found by one function of both, the
//! one of lesser number first: A_i F_ij = A_j F_ji to the last bit before a row is rounded, and yet each row is found
//! by itself. The areas of this law are those of the flat parts, for only so do rows sum to 1 inside a sphere.
//!
//! Whether anything can stand between is asked of shafts, from wide to narrow: between a row of cells and a group of
//! patches, a patch and the group, two patches. Most pairs are left without any facet in their shaft, and in full
//! sight; the others are `partial.rs`'s.

use glam::{DVec2, DVec3};

use super::cutting::FlatPieces;
use super::exchange::exchange;
use super::partial::{self, Pair, mixed, past};
use super::parts::{Outline, Part};
use super::rows::{Packing, Row};
use crate::patches::Patches;
use crate::scene::BackFaces;
use crate::simd::{self, Level, Simd};
use crate::visibility::{Blockers, Candidates, Cells, End, Facet, Facets, Shaft, in_plane_of};

/// Off a plane by less than this, relative to the scene's extent, is in the plane.
const HORIZON: f64 = 1e-9;

/// The accuracies that make sense.
pub const ACCURACIES: std::ops::RangeInclusive<f64> = 1e-7..=1e-2;

/// By how much a form factor may be off where the patch is partly hidden, unless told.
pub const DEFAULT_ACCURACY: f64 = 1e-4;

/// Cells along a side of a group of them, and parts in a group of others.
const TILE: u32 = 4;
const GROUP: usize = 16;

/// Patches in a run that looks out together, where they are no cells.
const RUN: usize = 8;

/// By which share of the margin a facet must reach into shafts, from wide to narrow: what a wide one leaves out no
/// narrow one within it would have kept, whatever the rounding.
const SHARES: [f64; 3] = [0.25, 0.5, 1.0];

/// How much thinner than the patch a sliver is that is as good as nothing.
const SLIVER: f64 = 1e-9;

/// Exact form factors of patches that see one another past facets.
#[derive(Clone, Debug)]
pub struct ExactVisible {
    parts: Vec<Part>,
    /// The patch of each part.
    patch: Vec<u32>,
    /// The parts that patches look out from, patch by patch, and for each patch where its own begin; one more entry
    /// ends the last.
    order: Vec<u32>,
    starts: Vec<u32>,
    /// The sum of a patch's parts.
    area: Vec<f64>,
    /// For each part, the run of patches that it looks out with.
    run_of: Vec<u32>,
    runs: Vec<End>,
    groups: Vec<Group>,
    blockers: Blockers,
    lit: bool,
    accuracy: f64,
    margin: f64,
}

/// Parts near one another, as they are seen.
#[derive(Clone, Debug)]
struct Group {
    parts: Vec<u32>,
    end: End,
}

/// Memory that one row after another is worked out in.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    row: Vec<f64>,
    packing: Packing,
    /// The run that `wide` is of, and what can stand between it and each group, once asked.
    run: Option<u32>,
    wide: Vec<Option<Candidates>>,
    narrow: Candidates,
    between: Vec<u32>,
    pair: partial::Scratch,
}

/// Adds up parts and who they belong to.
struct Builder<'a> {
    facets: &'a Facets,
    parts: Vec<Part>,
    patch: Vec<u32>,
    run_of: Vec<u32>,
    runs: Vec<End>,
    groups: Vec<Group>,
    lit: bool,
    margin: f64,
}

impl ExactVisible {
    /// Of `patches`, which lie on `facets`. Where a patch is partly hidden its form factor may be off by about
    /// `accuracy`; others are within a few millionths of themselves. `None` where that is out of [`ACCURACIES`].
    pub fn new(patches: &Patches, facets: &Facets, back_faces: BackFaces, accuracy: f64) -> Option<Self> {
        if !ACCURACIES.contains(&accuracy) {
            return None;
        }
        let margin = HORIZON * facets.extent();
        let lit = back_faces == BackFaces::Lit;
        let blockers = Blockers::new(facets, margin);
        let (parts, patch, run_of) = (Vec::new(), Vec::new(), Vec::new());
        let mut builder =
            Builder { facets, parts, patch, run_of, runs: Vec::new(), groups: Vec::new(), lit, margin };
        builder.look_out();
        builder.be_seen();
        let Builder { parts, patch, run_of, runs, groups, .. } = builder;
        let mut area = vec![0.0; patches.len()];
        let mut order: Vec<u32> = (0..run_of.len() as u32).collect();
        order.sort_by_key(|&part| patch[part as usize]);
        let mut starts = vec![0; patches.len() + 1];
        for &part in &order {
            let patch = patch[part as usize] as usize;
            area[patch] += parts[part as usize].area;
            starts[patch + 1] += 1;
        }
        for patch in 0..patches.len() {
            starts[patch + 1] += starts[patch];
        }
        Some(Self {
            parts,
            patch,
            order,
            starts,
            area,
            run_of,
            runs,
            groups,
            blockers,
            lit,
            accuracy,
            margin,
        })
    }

    /// Row i.
    pub fn row(&self, patch: usize, scratch: &mut Scratch) -> Row {
        self.row_at(Level::best(), patch, scratch)
    }

    /// The same with no more of the processor than `level`; the bits do not depend on it.
    pub fn row_at(&self, level: Level, patch: usize, scratch: &mut Scratch) -> Row {
        simd::run(level, FindRow { method: self, patch, scratch })
    }

    #[inline(always)]
    fn find_row<S: Simd>(&self, simd: S, patch: usize, scratch: &mut Scratch) -> Row {
        scratch.row.resize(self.area.len(), 0.0);
        scratch.wide.resize(self.groups.len(), None);
        for place in self.starts[patch]..self.starts[patch + 1] {
            let part = self.order[place as usize];
            let run = self.run_of[part as usize];
            if scratch.run != Some(run) {
                scratch.run = Some(run);
                scratch.wide.fill(None);
            }
            for group in 0..self.groups.len() {
                self.add_group(simd, part, group, scratch);
            }
        }
        if self.area[patch] > 0.0 {
            let scale = 1.0 / self.area[patch];
            for value in &mut scratch.row {
                *value *= scale;
            }
        }
        Row::take_dense(&mut scratch.row, &mut scratch.packing)
    }

    /// Add what a part exchanges with each of a group.
    #[inline(always)]
    fn add_group<S: Simd>(&self, simd: S, number: u32, group: usize, scratch: &mut Scratch) {
        let part = &self.parts[number as usize];
        let Group { parts, end } = &self.groups[group];
        let (_, most) = end.heights(part.centre, part.normal);
        if most <= self.margin {
            return;
        }
        // Where the group is flat, which of its sides is looked at.
        let mut seen = *end;
        if let Some(normal) = end.normal {
            let (low, high) = part.heights(end.corners[0], normal);
            if high <= self.margin {
                if !self.lit || low >= -self.margin {
                    return;
                }
                seen = end.turned();
            } else if self.lit && low < -self.margin {
                seen.normal = None;
            }
        }
        let mut clear = self.blockers.is_empty();
        if !clear {
            let run = self.run_of[number as usize] as usize;
            if scratch.wide[group].is_none() {
                let mut found = Candidates::default();
                self.blockers.in_shaft(simd, &self.wide_shaft(run, group), &mut found);
                scratch.wide[group] = Some(found);
            }
            let Some(wide) = &scratch.wide[group] else { return };
            clear = wide.is_empty();
            if !clear {
                let here = End::flat(part.outline().corners(), part.normal);
                let shaft = Shaft::new(&here, &seen, &self.blockers, SHARES[1]);
                scratch.narrow.narrowed(simd, wide, &shaft);
                clear = scratch.narrow.is_empty();
            }
        }
        for &other in parts {
            let there = &self.parts[other as usize];
            let (_, most) = there.heights(part.centre, part.normal);
            if most <= self.margin {
                continue;
            }
            let (low, high) = part.heights(there.centre, there.normal);
            let mut sum = 0.0;
            if high > self.margin {
                let (first, second) = if number < other { (part, there) } else { (there, part) };
                let seed = mixed(number.min(other)).wrapping_add(number.max(other));
                sum += self.pair(simd, first, second, clear, seed, scratch);
            }
            if self.lit && low < -self.margin {
                let seed = mixed(number).wrapping_add(other);
                sum += self.pair(simd, part, &there.turned(), clear, seed, scratch);
            }
            scratch.row[self.patch[other as usize] as usize] += sum;
        }
    }

    /// What two parts exchange, front to front, past those of `scratch.narrow` that stand between, or past nothing.
    #[inline(always)]
    fn pair<S: Simd>(
        &self,
        simd: S,
        first: &Part,
        second: &Part,
        clear: bool,
        seed: u32,
        scratch: &mut Scratch,
    ) -> f64 {
        let above = first.heights(second.centre, second.normal).0 >= -self.margin;
        let other_above = second.heights(first.centre, first.normal).0 >= -self.margin;
        scratch.between.clear();
        let outlines = if clear && above && other_above {
            None
        } else {
            let level = |part: &Part| part.normal.dot(part.centre);
            let [outline, _] = first.outline().parted(second.normal, level(second), self.margin);
            let [other, _] = second.outline().parted(first.normal, level(first), self.margin);
            if outline.is_empty() || other.is_empty() {
                return 0.0;
            }
            Some((outline, other))
        };
        if let (false, Some((outline, other))) = (clear, &outlines) {
            let ends =
                [(outline, first), (other, second)].map(|(o, part)| End::flat(o.corners(), part.normal));
            let shaft = Shaft::new(&ends[0], &ends[1], &self.blockers, SHARES[2]);
            scratch.narrow.numbers(simd, &shaft, &mut scratch.between);
        }
        if above && other_above {
            return self.visible(simd, first, second, seed, scratch);
        }
        let Some((outline, other)) = outlines else { return 0.0 };
        let mut sum = 0.0;
        let mut seed = seed;
        let halves = |part: &Part, whole: bool, outline: &Outline| {
            let mut parts = [*part; 4];
            if whole {
                return (parts, 1);
            }
            let mut count = 0;
            for (place, triangle) in parts.iter_mut().zip(outline.triangles()) {
                *place = triangle;
                count += 1;
            }
            (parts, count)
        };
        let (firsts, count) = halves(first, above, &outline);
        let (seconds, other_count) = halves(second, other_above, &other);
        for first in &firsts[..count] {
            for second in &seconds[..other_count] {
                seed = seed.wrapping_add(0x9e37_79b9);
                sum += self.visible(simd, first, second, seed, scratch);
            }
        }
        sum
    }

    /// The same where each is above the other's plane, past `scratch.between`.
    #[inline(always)]
    fn visible<S: Simd>(
        &self,
        simd: S,
        first: &Part,
        second: &Part,
        seed: u32,
        scratch: &mut Scratch,
    ) -> f64 {
        let whole = exchange(simd, first, second);
        if scratch.between.is_empty() || whole == 0.0 {
            return whole;
        }
        let allowed = self.accuracy * first.area.min(second.area);
        let pair = Pair { first, second, whole, allowed, seed, margin: self.margin };
        let blockers = scratch.between.iter().map(|&number| self.blockers.facet(number));
        past(simd, &pair, blockers, &mut scratch.pair)
    }

    /// The shaft between a run of patches and a group.
    fn wide_shaft(&self, run: usize, group: usize) -> Shaft {
        let (here, there) = (&self.runs[run], &self.groups[group].end);
        let mut seen = *there;
        if let (true, Some(normal)) = (self.lit, there.normal) {
            let (low, high) = here.heights(there.corners[0], normal);
            if high <= self.margin {
                seen = there.turned();
            } else if low < -self.margin {
                seen.normal = None;
            }
        }
        Shaft::new(here, &seen, &self.blockers, SHARES[0])
    }
}

/// Find one row.
struct FindRow<'a> {
    method: &'a ExactVisible,
    patch: usize,
    scratch: &'a mut Scratch,
}

impl simd::Kernel for FindRow<'_> {
    type Output = Row;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Row {
        self.method.find_row(simd, self.patch, self.scratch)
    }
}

impl Builder<'_> {
    /// Every part, in the order of facets, and the runs that look out together.
    fn look_out(&mut self) {
        let mut pieces = Vec::new();
        let facets = self.facets.as_slice();
        for (k, facet) in facets.iter().enumerate() {
            match facet.cells {
                Cells::Grid { first, columns, rows } => {
                    // Those of this surface that came before it, where it is split.
                    if !pieces.is_empty() {
                        self.runs.push(end_about(&pieces, self.margin));
                        pieces.clear();
                    }
                    for row in 0..rows {
                        let run = self.runs.len() as u32;
                        self.runs.push(tile(facet, [0, row], [columns, row + 1], [columns, rows]));
                        for column in 0..columns {
                            let part = Part::cell(facet, [column, row], [columns, rows]);
                            self.add(part, first + row * columns + column, run);
                        }
                    }
                }
                Cells::One(patch) => {
                    let part = Part::cell(facet, [0, 0], [1, 1]);
                    self.add(part, patch, self.runs.len() as u32);
                    pieces.push(part);
                    let ends = facets.get(k + 1).is_none_or(|next| next.surface != facet.surface);
                    if ends || pieces.len() == RUN {
                        self.runs.push(end_about(&pieces, self.margin));
                        pieces.clear();
                    }
                }
            }
        }
    }

    fn add(&mut self, part: Part, patch: u32, run: u32) {
        self.parts.push(part);
        self.patch.push(patch);
        self.run_of.push(run);
    }

    /// The groups, of the parts as they are seen: without what lies flush before them.
    fn be_seen(&mut self) {
        let mut next = 0;
        let mut of_surface: Vec<u32> = Vec::new();
        let facets = self.facets.as_slice();
        for (facet, number) in facets.iter().zip(0_u32..) {
            let covers = self.covers(number);
            match facet.cells {
                Cells::Grid { columns, rows, .. } => {
                    let cell = |column: u32, row: u32| next + row * columns + column;
                    for row in (0..rows).step_by(TILE as usize) {
                        for column in (0..columns).step_by(TILE as usize) {
                            let to = [(column + TILE).min(columns), (row + TILE).min(rows)];
                            let mut parts = Vec::new();
                            for row in row..to[1] {
                                for column in column..to[0] {
                                    self.uncovered(cell(column, row), &covers, &mut parts);
                                }
                            }
                            let end = tile(facet, [column, row], to, [columns, rows]);
                            self.groups.push(Group { parts, end });
                        }
                    }
                    next += columns * rows;
                }
                Cells::One(_) => {
                    self.uncovered(next, &covers, &mut of_surface);
                    next += 1;
                }
            }
            let ends = facets.get(number as usize + 1).is_none_or(|other| other.surface != facet.surface);
            if ends && !of_surface.is_empty() {
                let mut parts = std::mem::take(&mut of_surface);
                self.divide(&mut parts);
            }
        }
    }

    /// Groups of the parts, by where they lie.
    fn divide(&mut self, parts: &mut [u32]) {
        if parts.len() <= GROUP {
            let all: Vec<Part> = parts.iter().map(|&part| self.parts[part as usize]).collect();
            self.groups.push(Group { parts: parts.to_vec(), end: end_about(&all, self.margin) });
            return;
        }
        let centre = |part: &u32| self.parts[*part as usize].centre;
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (low, high) = parts.iter().map(centre).fold(none, |(low, high), p| (low.min(p), high.max(p)));
        let axis = (high - low).max_position();
        let half = parts.len() / 2;
        parts.select_nth_unstable_by(half, |a, b| centre(a)[axis].total_cmp(&centre(b)[axis]).then(a.cmp(b)));
        let (left, right) = parts.split_at_mut(half);
        self.divide(left);
        self.divide(right);
    }

    /// The facets that lie on a facet and are seen in its place: of two equally near the one whose patches come first
    /// is.
    fn covers(&self, number: u32) -> Vec<u32> {
        let facet = &self.facets[number];
        let mut found = in_plane_of(self.facets, number, self.margin);
        found.retain(|&other| {
            let same_side = self.facets[other].normal.dot(facet.normal) > 0.0;
            first_patch(&self.facets[other]) < first_patch(facet) && (self.lit || same_side)
        });
        found
    }

    /// What is seen of a part past its covers: itself, where that is all of it.
    fn uncovered(&mut self, number: u32, covers: &[u32], found: &mut Vec<u32>) {
        if covers.is_empty() {
            found.push(number);
            return;
        }
        let part = self.parts[number as usize];
        let [x, y] = [part.u, part.normal.cross(part.u)];
        let flat = |corner: DVec3| DVec2::new((corner - part.origin).dot(x), (corner - part.origin).dot(y));
        let mut pieces = FlatPieces::default();
        pieces.push(part.outline().corners().iter().map(|&corner| flat(corner)));
        let mut rest = FlatPieces::default();
        let mut inside = [Vec::new(), Vec::new()];
        for &cover in covers {
            let (corners, count) = self.facets[cover].corners();
            let mut corners: Vec<DVec2> = corners[..count].iter().map(|&corner| flat(corner)).collect();
            if self.facets[cover].u.cross(self.facets[cover].v).dot(part.normal) < 0.0 {
                corners.reverse();
            }
            rest.clear();
            for piece in pieces.iter() {
                let edges = corners.iter().zip(corners.iter().cycle().skip(1));
                let lines = edges.map(|(&a, &b)| {
                    let inward = (b - a).perp();
                    [-inward.dot(a), inward.x, inward.y]
                });
                rest.add_outside(piece, lines, &mut inside);
            }
            std::mem::swap(&mut pieces, &mut rest);
        }
        let scale = 1.0 / x.length_squared();
        let solid = |corner: DVec2| part.origin + (x * corner.x + y * corner.y) * scale;
        let mut triangles = Vec::new();
        for piece in pieces.iter() {
            for k in 2..piece.len() {
                triangles.push(Part::triangle([piece[0], piece[k - 1], piece[k]].map(solid)));
            }
        }
        let area: f64 = triangles.iter().map(|triangle| triangle.area).sum();
        if area >= part.area * (1.0 - SLIVER) {
            found.push(number);
            return;
        }
        for triangle in triangles.into_iter().filter(|triangle| triangle.area > SLIVER * part.area) {
            found.push(self.parts.len() as u32);
            self.parts.push(triangle);
            self.patch.push(self.patch[number as usize]);
        }
    }
}

fn first_patch(facet: &Facet) -> u32 {
    match facet.cells {
        Cells::One(patch) => patch,
        Cells::Grid { first, .. } => first,
    }
}

/// The cells of a facet from one to before another.
fn tile(facet: &Facet, from: [u32; 2], to: [u32; 2], [columns, rows]: [u32; 2]) -> End {
    let at = |column: u32, row: u32| {
        let (u, v) = (f64::from(column) / f64::from(columns), f64::from(row) / f64::from(rows));
        facet.origin + facet.u * u + facet.v * v
    };
    let mut corners = [at(from[0], from[1]), at(to[0], from[1]), at(to[0], to[1]), at(from[0], to[1])];
    if facet.u.cross(facet.v).dot(facet.normal) < 0.0 {
        corners.reverse();
    }
    End::flat(&corners, facet.normal)
}

/// About parts: a rectangle where they are flat, else a box.
fn end_about(parts: &[Part], margin: f64) -> End {
    let Part { origin, u, normal, .. } = parts[0];
    let corners = || parts.iter().flat_map(|part| part.outline().corners().to_vec());
    let flat = parts.iter().all(|part| part.normal.dot(normal) > 0.5)
        && corners().all(|corner| normal.dot(corner - origin).abs() <= margin);
    if !flat || normal == DVec3::ZERO {
        return End::about(corners());
    }
    let x = u.normalize_or_zero();
    let y = normal.cross(x);
    let none = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let (low, high) = corners().fold(none, |(low, high), corner| {
        let place = [x.dot(corner - origin), y.dot(corner - origin)];
        ([low[0].min(place[0]), low[1].min(place[1])], [high[0].max(place[0]), high[1].max(place[1])])
    });
    let at = |s: f64, t: f64| origin + x * s + y * t;
    End::flat(&[at(low[0], low[1]), at(high[0], low[1]), at(high[0], high[1]), at(low[0], high[1])], normal)
}
