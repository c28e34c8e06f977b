//! Exact form factors times visibility: what a patch sends to another were nothing else there, and how much of that
//! arrives.
//!
//! Every patch is flat convex *parts*, and what two parts exchange, G = A_i F_ij, is found by one function of both, the
//! one of lesser number first: A_i F_ij = A_j F_ji to the last bit before a row is rounded, and yet each row is found
//! by itself. The areas of this law are those of the flat parts, for only so do rows sum to 1 inside a sphere.
//!
//! Whether anything can stand between is asked of shafts, from wide to narrow: between a row of cells and a group of
//! patches, a patch and the group, two patches. Most pairs are left without any facet in their shaft, and in full
//! sight; the others are `partial.rs`'s. Shafts are asked sixteen at a time: those of the patches of a row, and those
//! to the patches of a group; one by one only where a patch touches the plane of the other or reaches across it.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::{DVec2, DVec3};

use super::abreast::Abreast;
use super::cutting::FlatPieces;
use super::exchange::exchange;
use super::partial::{self, Pair, mixed, past};
use super::parts::{Outline, Part};
use super::rows::{Packing, Row};
use crate::patches::Patches;
use crate::scene::BackFaces;
use crate::simd::{self, LANES, Level, Simd};
use crate::visibility::{
    Blockers, Candidates, Cells, End, Ends, Facet, Facets, Reach, Shaft, Standing, in_plane_of,
};

/// Off a plane by less than this, relative to the scene's extent, is in the plane.
const HORIZON: f64 = 1e-9;

/// The accuracies that make sense.
pub const ACCURACIES: std::ops::RangeInclusive<f64> = 1e-7..=1e-2;

/// By how much a row's sum may be off where patches are partly hidden, as a standard deviation, unless told.
pub const DEFAULT_ACCURACY: f64 = 1e-3;

/// Cells along a side of a group of them, and parts in a group of others.
const TILE: u32 = 4;
const GROUP: usize = 16;

/// A facet of fewer cells than this is taken together with others of its surface: of a refined one most have four.
const FEW: u32 = 8;

/// Patches in a run that looks out together, where they are no cells.
const RUN: usize = 8;

/// The most blocks of sixteen facets, of 1.4 kB each, that are kept between a run and all groups. What is beyond is sought for
/// each patch of the run anew: among 100,000 triangles afloat all would take more memory than the rows.
const MOST_KEPT: usize = 1 << 13;

/// Shafts to fewer parts than these are asked one by one.
const TOGETHER: u32 = 2;

/// Groups of fewer parts are laid side by side anew whenever they are looked at: it takes the room of sixteen, 2 kB.
const KEPT_ABREAST: usize = 4;

/// Patches whose run is wider than this many of them do not lie side by side.
const SCATTERED: f64 = 16.0;

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
    /// For each part, the run of patches that it looks out with; no end where those are far apart, and each is asked for itself.
    run_of: Vec<u32>,
    runs: Vec<Option<End>>,
    /// The first part of each run; one more entry ends the last.
    run_starts: Vec<u32>,
    groups: Vec<Group>,
    /// For each part that looks out, the group in which others see it as it is, all of it; none where they do not.
    group_of: Vec<Option<u32>>,
    /// For each patch, what its exchanges are rounded by; see [`ExactVisible::rounded`].
    grain: Vec<f64>,
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
    /// The same sixteen by sixteen, unless they are few.
    abreast: Vec<Abreast>,
}

/// Which of the exchanges that a patch has are asked for.
#[derive(Clone, Copy, Debug)]
pub(super) enum Asked<'a> {
    /// All.
    Row,
    /// Of those that go both ways the ones that this patch is the first of; and all that go one way only.
    Once,
    /// The same of pairs of which at least one is new, a flag a patch: of one new and one that is not the new one is the
    /// first.
    New(&'a [bool]),
    /// Those with some patches only, a flag a patch.
    Among(&'a [bool]),
}

impl Asked<'_> {
    /// Whether what `patch` exchanges with `other` is asked of it.
    fn wants(self, patch: u32, other: u32, both_ways: bool) -> bool {
        match self {
            Self::Row => true,
            Self::Once => !both_ways || patch <= other,
            Self::New(new) => match (new[patch as usize], new[other as usize]) {
                (true, true) => !both_ways || patch <= other,
                (true, false) => true,
                (false, other) => other && !both_ways,
            },
            Self::Among(some) => some[other as usize],
        }
    }
}

/// What a part exchanges with another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    /// The other's patch.
    pub(super) patch: u32,
    /// Whether it is the same for both.
    pub(super) both_ways: bool,
    pub(super) exchange: f64,
}

/// Two parts of which it is asked what they exchange.
#[derive(Clone, Copy, Debug)]
struct Between<'a> {
    /// The one of lesser number first, where both see one another.
    first: &'a Part,
    second: &'a Part,
    /// Whether nothing stands between, or what can.
    clear: bool,
    standing: &'a Standing<'a>,
    /// Whether what does stand between is in the scratch already.
    known: bool,
    /// What they exchange where nothing stands between, if that is known.
    exchanged: Option<f64>,
    /// For the rays.
    seed: u32,
    /// The lesser of the areas of their patches.
    least: f64,
    /// Where it is the same for both, the one that is looked at, and the group that it sees the other in.
    back: Option<(u32, u32)>,
}

/// Who looks.
#[derive(Clone, Copy, Debug)]
struct Looker<'a> {
    number: u32,
    /// Whether nothing stands between it and any of the group that it looks at, or what can.
    clear: bool,
    standing: Standing<'a>,
    /// The group that it is seen in.
    group: Option<u32>,
}

/// What can stand between a run and a group, and of that between up to sixteen parts of the run and the group.
#[derive(Clone, Debug, Default)]
struct Passing {
    candidates: Candidates,
    /// The first of the sixteen, by number, and a bit for each that was asked together with the others.
    sixteen: Option<u32>,
    whole: u32,
    /// And of these, for each that sees nothing of the group.
    hidden: u32,
    reach: Reach,
}

/// Up to sixteen parts that are looked at, and a bit a part.
#[derive(Clone, Copy, Debug)]
struct Seen<'a> {
    parts: &'a [u32],
    abreast: &'a Abreast,
    /// Those that are asked for; and of these those that have all of the looker before them, and are wholly before it.
    lanes: u32,
    whole: u32,
    /// Those with which the exchange goes both ways.
    shared: u32,
    /// Whether they are seen from behind.
    behind: bool,
}

/// Memory that one row after another is worked out in.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    row: Vec<f64>,
    packing: Packing,
    /// The run that `wide` is of, and what can stand between it and each group, once asked.
    run: Option<u32>,
    wide: Vec<Option<Passing>>,
    /// The blocks kept there.
    kept: usize,
    /// Up to sixteen parts of the run, and the first of them, by number.
    beside: Option<u32>,
    ends: Ends,
    narrow: Candidates,
    back: [Candidates; 2],
    /// The facets that reach into a shaft to any of sixteen parts, with a bit for each of these.
    reaching: Vec<(u32, u32)>,
    between: Vec<u32>,
    pair: partial::Scratch,
    found: Vec<Found>,
}

/// Adds up parts and who they belong to.
struct Builder<'a> {
    facets: &'a Facets,
    parts: Vec<Part>,
    patch: Vec<u32>,
    run_of: Vec<u32>,
    runs: Vec<Option<End>>,
    groups: Vec<Group>,
    lit: bool,
    margin: f64,
}

impl ExactVisible {
    /// Of `patches`, which lie on `facets`. Where patches are partly hidden the sum of a row may be off by about
    /// `accuracy`, as a standard deviation, and each of its form factors by about that times its own root; the others
    /// are within a few millionths of themselves. `None` where that is out of [`ACCURACIES`].
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
        let Builder { parts, patch, run_of, runs, mut groups, .. } = builder;
        for group in groups.iter_mut().filter(|group| group.parts.len() >= KEPT_ABREAST) {
            group.abreast = group.parts.chunks(LANES).map(|sixteen| abreast_of(&parts, sixteen)).collect();
        }
        let mut group_of = vec![None; run_of.len()];
        for (group, number) in groups.iter().zip(0..) {
            for &part in &group.parts {
                // Parts beyond are what is left of others under something.
                if let Some(group_of) = group_of.get_mut(part as usize) {
                    *group_of = Some(number);
                }
            }
        }
        // The parts of a run follow one another.
        let mut run_starts = vec![run_of.len() as u32; runs.len() + 1];
        for number in (0..run_of.len()).rev() {
            run_starts[run_of[number] as usize] = number as u32;
        }
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
        let grain = area.iter().map(|&area| grain(area)).collect();
        Some(Self {
            parts,
            patch,
            order,
            starts,
            area,
            run_of,
            runs,
            run_starts,
            groups,
            group_of,
            grain,
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
        self.row_within(level, patch, None, scratch)
    }

    /// The same, of the patches of these groups alone.
    pub(super) fn row_of_groups(
        &self,
        level: Level,
        patch: usize,
        groups: &[usize],
        scratch: &mut Scratch,
    ) -> Row {
        self.row_within(level, patch, Some(groups), scratch)
    }

    fn row_within(&self, level: Level, patch: usize, groups: Option<&[usize]>, scratch: &mut Scratch) -> Row {
        self.row_asked(level, patch, Asked::Row, groups, scratch)
    }

    /// The same, of some patches alone (a flag a patch): the row has no others.
    pub fn row_among(&self, patch: usize, some: &[bool], scratch: &mut Scratch) -> Row {
        let groups = self.groups_of(|other| some[other as usize]);
        self.row_asked(Level::best(), patch, Asked::Among(some), Some(&groups), scratch)
    }

    fn row_asked(
        &self,
        level: Level,
        patch: usize,
        asked: Asked<'_>,
        groups: Option<&[usize]>,
        scratch: &mut Scratch,
    ) -> Row {
        let mut row = std::mem::take(&mut scratch.row);
        row.resize(self.count(), 0.0);
        simd::run(level, LookOut { method: self, patch, asked, groups, stop: None, scratch });
        for found in scratch.found.drain(..) {
            let other = found.patch as usize;
            row[other] += self.rounded(patch, other, found.exchange);
        }
        let found = self.row_of(patch, &mut row, &mut scratch.packing);
        scratch.row = row;
        found
    }

    /// Those groups that any of `patches` is seen in.
    pub(super) fn groups_of(&self, patches: impl Fn(u32) -> bool) -> Vec<usize> {
        let any =
            |group: &usize| self.groups[*group].parts.iter().any(|&part| patches(self.patch[part as usize]));
        (0..self.groups.len()).filter(any).collect()
    }

    /// How many patches there are.
    pub(super) fn count(&self) -> usize {
        self.area.len()
    }

    /// Whether there is anything that only one of two sees: backs, or what lies in part under something.
    pub(super) fn one_way(&self) -> bool {
        self.lit || self.group_of.contains(&None)
    }

    /// Row i of its exchanges, which are black again when it comes back.
    pub(super) fn row_of(&self, patch: usize, exchanges: &mut [f64], packing: &mut Packing) -> Row {
        if self.area[patch] > 0.0 {
            let scale = 1.0 / self.area[patch];
            for value in exchanges.iter_mut() {
                *value *= scale;
            }
        }
        Row::take_dense(exchanges, packing)
    }

    /// An exchange of two patches rounded so that such numbers add up without rounding, in whatever order they come.
    pub(super) fn rounded(&self, patch: usize, other: usize, exchange: f64) -> f64 {
        let grain = self.grain[patch].min(self.grain[other]);
        (exchange + grain) - grain
    }

    /// Show what a patch exchanges with others, part by part; once `stop` is set, no more than what is found by then.
    pub(super) fn exchanges(
        &self,
        level: Level,
        patch: usize,
        asked: Asked<'_>,
        stop: &AtomicBool,
        scratch: &mut Scratch,
        show: impl FnMut(Found),
    ) {
        simd::run(level, LookOut { method: self, patch, asked, groups: None, stop: Some(stop), scratch });
        scratch.found.drain(..).for_each(show);
    }

    /// Add what a part exchanges with each of a group to `scratch.found`.
    #[inline(always)]
    fn look_at<S: Simd>(&self, simd: S, number: u32, group: usize, asked: Asked<'_>, scratch: &mut Scratch) {
        let (part, patch) = (&self.parts[number as usize], self.patch[number as usize]);
        let Group { parts, end, abreast } = &self.groups[group];
        let bare = |part: u32| self.group_of.get(part as usize).copied().flatten();
        let own_group = bare(number);
        let both_ways = |other: u32| own_group.is_some() && bare(other).is_some();
        let of_patch = |other: u32| self.patch[other as usize];
        let wanted = |&other: &u32| asked.wants(patch, of_patch(other), both_ways(other) && !self.lit);
        if !parts.iter().any(wanted) {
            return;
        }
        // A group is left out by less than a part of it would be.
        let margin = self.margin * SHARES[1];
        let (_, most) = end.heights(part.centre, part.normal);
        let heights = part.heights(end.corners[0], end.normal.unwrap_or_default());
        let Some(side) = self.side_seen(heights, end, margin) else { return };
        if most <= margin {
            return;
        }
        // What can stand between, and whether anything does.
        let (mut narrow, mut wide, mut shaft) = (std::mem::take(&mut scratch.narrow), None, None);
        let mut clear = self.blockers.is_empty();
        if !clear && self.runs[self.run_of[number as usize] as usize].is_some() {
            let mut passing = self.passing(simd, number, group, scratch);
            clear = passing.candidates.is_empty();
            if !clear {
                shaft = self.shaft_of_run(simd, number, end, &mut passing, scratch);
                if shaft.is_none() {
                    let all = Standing::all(&passing.candidates);
                    narrow.narrowed(simd, &all, &self.narrow_shaft(part, &side));
                }
            }
            wide = Some(passing);
        } else if !clear {
            self.blockers.in_shaft(simd, &self.narrow_shaft(part, &side), &mut narrow);
        }
        let standing = match (&wide, shaft) {
            (Some(passing), Some(shaft)) => Standing::of(&passing.candidates, &passing.reach, shaft),
            _ => Standing::all(&narrow),
        };
        clear = clear || standing.is_empty();
        let hidden = |passing: &Passing| shaft.is_some_and(|shaft| passing.hidden >> shaft & 1 == 1);
        let seen = if wide.as_ref().is_some_and(hidden) { &[] } else { &parts[..] };
        for (k, sixteen) in seen.chunks(LANES).enumerate() {
            let made;
            let abreast = match abreast.get(k) {
                Some(abreast) => abreast,
                None => {
                    made = abreast_of(&self.parts, sixteen);
                    &made
                }
            };
            let sights = abreast.sights(simd, part, self.margin);
            let (mut fronts, mut backs, mut shared) = (0, 0, 0);
            for (lane, &other) in sixteen.iter().enumerate() {
                let (other_patch, both_ways) = (of_patch(other), both_ways(other));
                fronts |= u32::from(asked.wants(patch, other_patch, both_ways)) << lane;
                backs |= u32::from(self.lit && asked.wants(patch, other_patch, false)) << lane;
                shared |= u32::from(both_ways) << lane;
            }
            let looker = Looker { number, clear, standing, group: own_group };
            fronts &= sights.rise & sights.before;
            backs &= sights.rise & sights.behind;
            let ways = [(fronts, sights.all_before, shared, false), (backs, sights.all_behind, 0, true)];
            for (lanes, whole, shared, behind) in ways {
                if lanes != 0 {
                    let seen = Seen { parts: sixteen, abreast, lanes, whole: whole & lanes, shared, behind };
                    self.look_at_sixteen(simd, &looker, &seen, scratch);
                }
            }
        }
        scratch.narrow = narrow;
        if let Some(passing) = wide {
            let kept = scratch.kept + passing.candidates.blocks();
            if kept <= MOST_KEPT {
                scratch.kept = kept;
                scratch.wide[group] = Some(passing);
            }
        }
    }

    /// What can stand between the run of a part and a group, taken out of what is kept.
    #[inline(always)]
    fn passing<S: Simd>(&self, simd: S, number: u32, group: usize, scratch: &mut Scratch) -> Passing {
        if let Some(passing) = scratch.wide[group].take() {
            scratch.kept -= passing.candidates.blocks();
            return passing;
        }
        let mut passing = Passing::default();
        if let Some(run) = &self.runs[self.run_of[number as usize] as usize] {
            self.blockers.in_shaft(simd, &self.wide_shaft(run, group), &mut passing.candidates);
        }
        passing
    }

    /// Have the shafts between a group and sixteen parts of the run, of which a part is one, asked together, unless they
    /// are: which of them is the part's; none where it is not wholly before the group, or behind it.
    #[inline(always)]
    fn shaft_of_run<S: Simd>(
        &self,
        simd: S,
        number: u32,
        end: &End,
        passing: &mut Passing,
        scratch: &mut Scratch,
    ) -> Option<usize> {
        let normal = end.normal?;
        let run = self.run_of[number as usize] as usize;
        let [first, last] = [self.run_starts[run], self.run_starts[run + 1]];
        let from = first + (number - first) / LANES as u32 * LANES as u32;
        if scratch.beside != Some(from) {
            let parts = &self.parts[from as usize..last.min(from + LANES as u32) as usize];
            scratch.ends = Abreast::new(parts.iter()).ends(simd, false);
            scratch.beside = Some(from);
        }
        if passing.sixteen != Some(from) {
            let there = (1_u32 << (last - from).min(LANES as u32)) - 1;
            // What lies at a plane or across it is asked by itself, and so is what is all but there.
            let margin = 2.0 * self.margin;
            let before = there & scratch.ends.facing(simd, end, normal, margin);
            let turned = end.turned();
            let behind =
                if self.lit { there & scratch.ends.facing(simd, &turned, -normal, margin) } else { 0 };
            passing.reach.clear();
            passing.reach.resize(passing.candidates.blocks(), [0; LANES]);
            passing.hidden = 0;
            for (end, lanes) in [(end, before), (&turned, behind)] {
                if lanes != 0 {
                    let (others, margin) = ((&scratch.ends, lanes), (&self.blockers, SHARES[1]));
                    passing.hidden |= passing.candidates.reach(simd, end, others, margin, &mut passing.reach);
                }
            }
            (passing.sixteen, passing.whole) = (Some(from), before | behind);
        }
        let shaft = number - from;
        (passing.whole >> shaft & 1 == 1).then_some(shaft as usize)
    }

    /// The same of those of sixteen that are asked for, all from the front or all from behind.
    #[inline(always)]
    fn look_at_sixteen<S: Simd>(&self, simd: S, looker: &Looker<'_>, seen: &Seen<'_>, scratch: &mut Scratch) {
        let &Looker { number, clear, ref standing, group } = looker;
        let (part, patch) = (&self.parts[number as usize], self.patch[number as usize]);
        // Those that each have all of the other before them are asked together, and the others one by one.
        let together = !clear && seen.whole.count_ones() >= TOGETHER;
        scratch.reaching.clear();
        if together {
            let here = (&End::flat(part.outline().corners(), part.normal), part.normal);
            let others = seen.abreast.ends(simd, seen.behind);
            standing.between(simd, here, (&others, seen.whole), &self.blockers, &mut scratch.reaching);
        }
        let mut exchanges = [0.0; LANES];
        let far = seen.whole & seen.abreast.exchange_far(simd, part, seen.behind, &mut exchanges);
        let known = if clear || together { seen.whole } else { 0 };
        let mut lanes = seen.lanes;
        while lanes != 0 {
            let lane = lanes.trailing_zeros();
            lanes &= lanes - 1;
            let (other, is) = (seen.parts[lane as usize], |mask: u32| mask >> lane & 1 == 1);
            let other_patch = self.patch[other as usize];
            let (both_ways, known) = (is(seen.shared), is(known));
            let exchanged = is(far).then_some(exchanges[lane as usize]);
            if known {
                scratch.between.clear();
                let reaching = scratch.reaching.iter().filter(|(_, lanes)| is(*lanes));
                scratch.between.extend(reaching.map(|&(facet, _)| facet));
            }
            let exchange = match exchanged {
                Some(exchanged) if known && scratch.between.is_empty() => exchanged,
                _ => {
                    let there = self.parts[other as usize];
                    let there = if seen.behind { there.turned() } else { there };
                    let turned_about = both_ways && number > other;
                    let (first, second) = if turned_about { (&there, part) } else { (part, &there) };
                    let (before, after) = if turned_about { (other, number) } else { (number, other) };
                    let seed = mixed(before).wrapping_add(after);
                    let least = self.area[patch as usize].min(self.area[other_patch as usize]);
                    let back = group.filter(|_| both_ways).map(|group| (other, group));
                    let asked =
                        Between { first, second, clear, standing, known, exchanged, seed, least, back };
                    self.pair(simd, &asked, scratch)
                }
            };
            scratch.found.push(Found { patch: other_patch, both_ways, exchange });
        }
    }

    /// A flat end as it is seen by what has these heights above its plane: from the front, from the back, or, where backs
    /// are lit and it is on either side, from both; `None` where it is not seen.
    fn side_seen(&self, (low, high): (f64, f64), end: &End, margin: f64) -> Option<End> {
        let mut seen = *end;
        if end.normal.is_some() {
            if high <= margin {
                if !self.lit || low >= -margin {
                    return None;
                }
                seen = end.turned();
            } else if self.lit && low < -margin {
                seen.normal = None;
            }
        }
        Some(seen)
    }

    fn narrow_shaft(&self, part: &Part, seen: &End) -> Shaft {
        let here = End::flat(part.outline().corners(), part.normal);
        Shaft::new(&here, seen, &self.blockers, SHARES[1])
    }

    /// What two parts exchange, front to front, past what stands between, or past nothing.
    #[inline(always)]
    fn pair<S: Simd>(&self, simd: S, asked: &Between<'_>, scratch: &mut Scratch) -> f64 {
        let &Between { first, second, known, mut seed, .. } = asked;
        let (mut above, mut other_above) = (true, true);
        let mut outlines = [Outline::NONE; 2];
        if !known {
            let low = first.heights(second.centre, second.normal).0;
            let other_low = second.heights(first.centre, first.normal).0;
            (above, other_above) = (low >= -self.margin, other_low >= -self.margin);
            scratch.between.clear();
            if !(asked.clear && above && other_above) {
                let level = |part: &Part| part.normal.dot(part.centre);
                let [outline, _] = first.outline().parted(second.normal, level(second), self.margin);
                let [other, _] = second.outline().parted(first.normal, level(first), self.margin);
                if outline.is_empty() || other.is_empty() {
                    return 0.0;
                }
                outlines = [outline, other];
            }
            if !asked.clear {
                self.find_between(simd, asked, &outlines, low.min(other_low) <= self.margin, scratch);
            }
        }
        let triangles = |whole: bool, outline: &Outline| -> Vec<Part> {
            if whole { Vec::new() } else { outline.triangles().collect() }
        };
        let (cut, other_cut) = (triangles(above, &outlines[0]), triangles(other_above, &outlines[1]));
        let firsts = if above { std::slice::from_ref(first) } else { &cut };
        let seconds = if other_above { std::slice::from_ref(second) } else { &other_cut };
        let whole = above && other_above;
        let exchanged = asked.exchanged.filter(|_| whole);
        let mut sum = 0.0;
        for first in firsts {
            for second in seconds {
                if !whole {
                    seed = seed.wrapping_add(0x9e37_79b9);
                }
                let unhidden = match exchanged {
                    Some(exchanged) => exchanged,
                    None => exchange(simd, first, second),
                };
                sum += self.visible(simd, (first, second), unhidden, asked.least, seed, scratch);
            }
        }
        sum
    }

    /// Fill `scratch.between` with what can stand between two parts, of which these outlines lie above each other's
    /// planes, or on them (`touching`).
    #[inline(always)]
    fn find_between<S: Simd>(
        &self,
        simd: S,
        asked: &Between<'_>,
        [outline, other]: &[Outline; 2],
        touching: bool,
        scratch: &mut Scratch,
    ) {
        let ends = [
            End::flat(outline.corners(), asked.first.normal),
            End::flat(other.corners(), asked.second.normal),
        ];
        let mut shaft = Shaft::open(&ends[0], &ends[1], &self.blockers, SHARES[2]);
        if asked.standing.any(simd, &shaft) {
            shaft.close(&self.blockers);
            asked.standing.numbers(simd, &shaft, &mut scratch.between);
        }
        // Where one touches the plane of the other the shaft has not all sides that it might have, and may be wider
        // than those that led to it: what those of the way back leave out goes, too, so that both find the same.
        if let (false, Some(back), true) = (scratch.between.is_empty(), asked.back, touching) {
            self.looking_back(simd, back, &shaft, asked.standing, scratch);
        }
    }

    /// Of `scratch.between`, those that a part finds when it looks at a group.
    #[inline(always)]
    fn looking_back<S: Simd>(
        &self,
        simd: S,
        (number, group): (u32, u32),
        shaft: &Shaft,
        standing: &Standing<'_>,
        scratch: &mut Scratch,
    ) {
        let (part, end) = (&self.parts[number as usize], &self.groups[group as usize].end);
        let heights = part.heights(end.corners[0], end.normal.unwrap_or_default());
        let Some(seen) = self.side_seen(heights, end, self.margin * SHARES[1]) else { return };
        let Scratch { back: [wide, back], between, .. } = scratch;
        let all;
        let mut wider = standing;
        if let Some(run) = &self.runs[self.run_of[number as usize] as usize] {
            wide.narrowed(simd, standing, &self.wide_shaft(run, group as usize));
            all = Standing::all(wide);
            wider = &all;
        }
        back.narrowed(simd, wider, &self.narrow_shaft(part, &seen));
        Standing::all(back).numbers(simd, shaft, between);
    }

    /// What two parts exchange where each is above the other's plane, past `scratch.between`, of `unhidden`.
    #[inline(always)]
    fn visible<S: Simd>(
        &self,
        simd: S,
        (first, second): (&Part, &Part),
        unhidden: f64,
        least: f64,
        seed: u32,
        scratch: &mut Scratch,
    ) -> f64 {
        if scratch.between.is_empty() || unhidden == 0.0 {
            return unhidden;
        }
        // A row's errors add up as their squares do: where each is the root of the form factor, that of all is 1.
        let allowed = self.accuracy * (least * unhidden).sqrt();
        let pair = Pair { first, second, whole: unhidden, allowed, seed, margin: self.margin };
        let blockers = scratch.between.iter().map(|&number| self.blockers.facet(number));
        past(simd, &pair, blockers, &mut scratch.pair)
    }

    /// The shaft between a run of patches and a group.
    fn wide_shaft(&self, here: &End, group: usize) -> Shaft {
        let there = &self.groups[group].end;
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

/// Have a patch look at every group.
struct LookOut<'a> {
    method: &'a ExactVisible,
    patch: usize,
    asked: Asked<'a>,
    /// Those to look at, where it is not all.
    groups: Option<&'a [usize]>,
    /// Once it is set, the rest is not wanted any more.
    stop: Option<&'a AtomicBool>,
    scratch: &'a mut Scratch,
}

impl simd::Kernel for LookOut<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { method, patch, asked, groups, stop, scratch } = self;
        scratch.wide.resize_with(method.groups.len(), || None);
        for place in method.starts[patch]..method.starts[patch + 1] {
            let part = method.order[place as usize];
            let run = method.run_of[part as usize];
            if scratch.run != Some(run) {
                scratch.run = Some(run);
                scratch.beside = None;
                scratch.wide.fill_with(|| None);
                scratch.kept = 0;
            }
            for k in 0..groups.map_or(method.groups.len(), <[usize]>::len) {
                if stop.is_some_and(|stop| stop.load(Ordering::Relaxed)) {
                    return;
                }
                let group = groups.map_or(k, |groups| groups[k]);
                method.look_at(simd, part, group, asked, scratch);
            }
        }
    }
}

impl Builder<'_> {
    /// Every part, in the order of facets, and the runs that look out together.
    fn look_out(&mut self) {
        let mut pieces = Vec::new();
        let facets = self.facets.as_slice();
        for (k, facet) in facets.iter().enumerate() {
            let ([columns, rows], first) = grid(facet);
            if columns * rows >= FEW {
                // Those of this surface that came before it, where it is split.
                if !pieces.is_empty() {
                    self.runs.push(run_of(&pieces, self.margin));
                    pieces.clear();
                }
                for row in 0..rows {
                    let run = self.runs.len() as u32;
                    self.runs.push(Some(tile(facet, [0, row], [columns, row + 1], [columns, rows])));
                    for column in 0..columns {
                        let part = Part::cell(facet, [column, row], [columns, rows]);
                        self.add(part, first + row * columns + column, run);
                    }
                }
                continue;
            }
            for cell in 0..columns * rows {
                let part = Part::cell(facet, [cell % columns, cell / columns], [columns, rows]);
                self.add(part, first + cell, self.runs.len() as u32);
                pieces.push(part);
                let last = cell + 1 == columns * rows;
                let ends = last && facets.get(k + 1).is_none_or(|next| next.surface != facet.surface);
                if ends || pieces.len() == RUN {
                    self.runs.push(run_of(&pieces, self.margin));
                    pieces.clear();
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
            let ([columns, rows], _) = grid(facet);
            let cell = |column: u32, row: u32| next + row * columns + column;
            if columns * rows >= FEW {
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
                        self.groups.push(Group { parts, end, abreast: Vec::new() });
                    }
                }
            } else {
                (0..columns * rows).for_each(|k| self.uncovered(next + k, &covers, &mut of_surface));
            }
            next += columns * rows;
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
            let end = end_about(&all, self.margin);
            self.groups.push(Group { parts: parts.to_vec(), end, abreast: Vec::new() });
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

fn abreast_of(parts: &[Part], numbers: &[u32]) -> Abreast {
    Abreast::new(numbers.iter().map(|&part| &parts[part as usize]))
}

/// What rounds shares of an area, added to them and taken away again, to multiples of 2⁻⁵⁰ of a power of two below the
/// area: sums of such numbers up to four times the area are exact.
fn grain(area: f64) -> f64 {
    // The power of two at or below it, and its sixfold, from which on numbers in double precision stand so far apart.
    let power = f64::from_bits(area.to_bits() & !((1 << 52) - 1));
    power * 6.0
}

fn first_patch(facet: &Facet) -> u32 {
    grid(facet).1
}

/// Its columns and rows of cells, and the first patch.
fn grid(facet: &Facet) -> ([u32; 2], u32) {
    match facet.cells {
        Cells::One(patch) => ([1, 1], patch),
        Cells::Grid { first, columns, rows } => ([columns, rows], first),
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

/// The end about the parts of a run; none where they lie so far apart that hardly any shaft of it would be free.
fn run_of(parts: &[Part], margin: f64) -> Option<End> {
    let end = end_about(parts, margin);
    let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = end.corners().iter().fold(none, |(low, high), &c| (low.min(c), high.max(c)));
    let widest = parts.iter().fold(0.0, |widest: f64, part| widest.max(2.0 * part.radius));
    (low.distance(high) <= SCATTERED * widest).then_some(end)
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
