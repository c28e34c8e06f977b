//! Refinement until the light is known as well as was asked, everywhere: solve, estimate the error of each patch, quarter those
//! that hold most of it, and solve again.
//!
//! What is brought below the target is what one value a patch is off the true light, as a root mean square over the area,
//! emitters left out, relative to the radiosities': how far the value may be off the patch's mean ([`ErrorEstimate`]),
//! and how much the light varies within the patch: as its neighbours show ([`Variation`]), and as the light straight from the
//! lamps does at places spread over it ([`straight_variation`]). That is what quartering takes away: by half where
//! light changes evenly, less where a shadow's edge runs; so patches gather at shadows, at contacts and near lamps.
//!
//! Of two cuts one after the other most patches are the same. Their rows are kept (`reuse.rs`), and the solver starts from
//! the answer before.

mod choice;
mod reuse;

use std::collections::HashMap;

use glam::DVec3;

use crate::bake::{self, BakeError, Baked, Correction, Method, Request, Run, Solver};
use crate::estimate::{ErrorEstimate, OverallError, Variation};
use crate::form_factors::{Closing, ExchangeAreas, FormFactors};
use crate::light::Rgb;
use crate::patches::{self, Cutting, Origin, Patches, Place, Refinement};
use crate::scene::Scene;
use crate::shade::straight_variation;
use crate::solve::Solution;
use crate::visibility::Facets;
use crate::watch::Watch;

/// When to be content, and when to give up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// The error to reach, a share: 0.02 is 2 %.
    pub error: f64,
    /// No cut has more patches.
    pub most_patches: u64,
    /// No patch is quartered whose quarters would be narrower, by the root of their area; `None` for a thousandth of the scene's
    /// longest side. \[the scene's unit of length\]
    pub smallest_patch: Option<f64>,
}

impl Target {
    /// The most patches, unless told.
    pub const MOST_PATCHES: u64 = 20_000;

    /// This error, and the usual limits.
    pub fn new(error: f64) -> Self {
        Self { error, most_patches: Self::MOST_PATCHES, smallest_patch: None }
    }
}

/// The narrowest patch, unless told, as a share of the scene's longest side.
const SMALLEST: f64 = 1e-3;

/// Why a refinement ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The error is below the target.
    Target,
    /// Another round would make more patches than were allowed.
    MostPatches,
    /// Another round would take more memory than is allowed.
    Memory,
    /// What is left to quarter is as small as may be.
    SmallestPatch,
    /// What is left is the error of the form factors, which smaller patches do not take away.
    FormFactors,
    /// What is left is what the solver has not done.
    Residual,
}

/// One cut, and how far its answer may be off.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Round {
    /// Patches.
    pub patches: usize,
    /// Rows of form factors that were found for it; the others are those of the cut before.
    pub rows_found: usize,
    /// By how much the patches' values may be off their means.
    pub means: OverallError,
    /// By how much light varies within patches, likewise as a share of all.
    pub within: f64,
    /// Patches without neighbours, of which it is not known how much light varies within them.
    pub alone: usize,
    /// All of it together: what is held against the target.
    pub error: f64,
}

/// What came of it.
#[derive(Clone, Debug)]
pub struct Refined {
    /// Every stage's value, for the last cut. Its patches know their parents, those of the cut that was begun with.
    pub baked: Baked,
    /// How much light varies within each patch.
    pub variation: Variation,
    /// Every cut, from the first.
    pub rounds: Vec<Round>,
    /// Why there are no more.
    pub stop: Stop,
    /// No patch was quartered into narrower ones than this.
    pub smallest_patch: f64,
}

/// Refine until the target is reached, or a limit.
///
/// # Errors
/// As of [`Refining::new`] and [`Refining::step`].
pub fn refine(
    scene: &Scene,
    request: &Request,
    target: &Target,
    run: &Run,
    watch: &mut Watch<'_>,
) -> Result<Refined, BakeError> {
    let mut refining = Refining::new(scene, request, target, run, watch)?;
    loop {
        if let Some(stop) = refining.step(watch)? {
            return Ok(refining.into_refined(stop));
        }
    }
}

/// A refinement between two rounds.
#[derive(Debug)]
pub struct Refining<'a> {
    scene: &'a Scene,
    request: Request,
    target: Target,
    run: Run,
    cutting: Cutting,
    refinement: Refinement,
    /// The cut that was begun with.
    start: Cut,
    now: Answer,
    rounds: Vec<Round>,
}

/// Patches, and where each comes from.
#[derive(Clone, Debug)]
struct Cut {
    patches: Patches,
    origins: Vec<Origin>,
}

/// All that is known of a cut.
#[derive(Debug)]
struct Answer {
    cut: Cut,
    facets: Facets,
    /// As they were found.
    factors: FormFactors,
    /// As they were solved with, where they were to be repaired.
    repaired: Option<(FormFactors, Closing)>,
    solution: Solution,
    correction: Option<Correction>,
    error: ErrorEstimate,
    variation: Variation,
}

/// What is hidden within patches is told by some points of each: so much more of it is allowed for.
const SAFETY: f64 = 1.1;

/// Two rounds have brought nothing where they leave more than this of the error, of so many times the patches.
const NO_PROGRESS: f64 = 0.95;
const GROWTH: f64 = 1.3;

impl<'a> Refining<'a> {
    /// The first round: the scene as `request` has it cut.
    ///
    /// # Errors
    /// Those of [`bake::bake`], and [`BakeError::Memory`] where the form factors do not fit: they are not found anew here for every
    /// step; [`BakeError::BadRequest`] for a target that is no positive share.
    pub fn new(
        scene: &'a Scene,
        request: &Request,
        target: &Target,
        run: &Run,
        watch: &mut Watch<'_>,
    ) -> Result<Self, BakeError> {
        let positive = |number: f64| number.is_finite() && number > 0.0;
        if !positive(target.error) || target.smallest_patch.is_some_and(|size| !positive(size)) {
            let message =
                "the target error and the smallest patch must be positive numbers, and not infinite";
            return Err(BakeError::BadRequest(message.into()));
        }
        let request = Request { error: true, ..*request };
        // Refused as ever where it is too large.
        let (patches, origins) = bake::patches_with_origins(scene, &request, run)?;
        let cutting = request.cutting().for_scene(scene)?;
        let mut start = Cut { patches, origins };
        start.patches.parent = (0..start.patches.len() as u32).collect();
        let facets = Facets::new(scene, &start.patches);
        let factors = bake::form_factors(scene, &start.patches, &facets, &request, run, watch)?;
        let rows_found = start.patches.len();
        let now = Answer::new(scene, start.clone(), facets, factors, None, &request, run, watch)?;
        let rounds = vec![now.round(rows_found)];
        let (target, run, refinement) = (*target, *run, Refinement::default());
        Ok(Self { scene, request, target, run, cutting, refinement, start, now, rounds })
    }

    /// Every round so far.
    pub fn rounds(&self) -> &[Round] {
        &self.rounds
    }

    /// Another round; or why there is none.
    ///
    /// # Errors
    /// Those of [`bake::bake`].
    pub fn step(&mut self, watch: &mut Watch<'_>) -> Result<Option<Stop>, BakeError> {
        if let Some(stop) = self.enough() {
            return Ok(Some(stop));
        }
        let smallest = self.smallest_patch();
        let Cut { patches, origins } = &self.now.cut;
        let aim = self.aim();
        let chosen = choice::worst(patches, origins, &self.now.variation, smallest, aim);
        if chosen.is_empty() {
            return Ok(Some(self.left().unwrap_or(Stop::SmallestPatch)));
        }
        let Some((refinement, cut)) = self.quartered(&chosen)? else { return Ok(Some(Stop::MostPatches)) };
        let facets = Facets::new(self.scene, &cut.patches);
        let need = bake::need(&cut.patches, &facets, &self.request)?;
        let limit = bake::memory_limit(&self.run);
        let repair = if self.request.repair { ExchangeAreas::bytes(need.nonzeros) } else { 0 };
        if need.bytes.saturating_add(repair) > limit {
            return Ok(Some(Stop::Memory));
        }
        let start = self.starting_from(&cut);
        let was = self.same_as_before(&cut);
        let back_faces = self.request.back_faces.unwrap_or(self.scene.back_faces);
        let (factors, found) = {
            let row = bake::row_finder(&cut.patches, &facets, &self.request, back_faces)?;
            let before = reuse::Before { patches: &self.now.cut.patches, factors: &self.now.factors };
            let threads = self.run.threads.unwrap_or(0);
            let exact = matches!(self.request.method, Method::Exact { .. });
            // Where both do not fit, those before are let go.
            if need.bytes.saturating_add(before.bytes(exact)) <= limit {
                reuse::rows(&before, &cut.patches, &was, exact, row, threads, watch)?
            } else {
                self.now.factors = FormFactors::default();
                self.now.repaired = None;
                drop(row);
                let all =
                    bake::form_factors(self.scene, &cut.patches, &facets, &self.request, &self.run, watch)?;
                (all, cut.patches.len())
            }
        };
        self.now.repaired = None;
        self.now =
            Answer::new(self.scene, cut, facets, factors, Some(start), &self.request, &self.run, watch)?;
        self.refinement = refinement;
        self.rounds.push(self.now.round(found));
        Ok(None)
    }

    /// The answer as it stands.
    pub fn into_refined(self, stop: Stop) -> Refined {
        let smallest_patch = self.smallest_patch();
        let Answer { cut, facets, factors, repaired, solution, correction, error, variation } = self.now;
        let (form_factors, closing) = match repaired {
            Some((repaired, closing)) => (repaired, Some(closing)),
            None => (factors, None),
        };
        let patches = cut.patches;
        let error = Some(error);
        let recomputed = None;
        let baked = Baked { patches, facets, form_factors, recomputed, closing, solution, correction, error };
        Refined { baked, variation, rounds: self.rounds, stop, smallest_patch }
    }

    fn smallest_patch(&self) -> f64 {
        self.target.smallest_patch.unwrap_or_else(|| SMALLEST * self.now.facets.extent())
    }

    /// Whether to go on is in vain, or not needed.
    fn enough(&self) -> Option<Stop> {
        let last = self.rounds.last()?;
        if last.error <= self.target.error {
            // Of those alone nothing is known yet.
            let known = last.alone == 0 || {
                let Cut { patches, origins } = &self.now.cut;
                choice::alone(patches, origins, &self.now.variation, self.smallest_patch()).is_empty()
            };
            return known.then_some(Stop::Target);
        }
        if last.means.residual >= self.target.error {
            return Some(Stop::Residual);
        }
        let exact = matches!(self.request.method, Method::Exact { .. });
        if exact && last.means.form_factors >= self.target.error {
            return Some(Stop::FormFactors);
        }
        let before = self.rounds.len().checked_sub(3).map(|before| &self.rounds[before])?;
        if (last.patches as f64) < GROWTH * before.patches as f64 {
            return None;
        }
        let no_better = |part: fn(&Round) -> f64| part(last) > NO_PROGRESS * part(before);
        if last.means.form_factors >= self.target.error && no_better(|round| round.means.form_factors) {
            return Some(Stop::FormFactors);
        }
        if no_better(|round| round.error) { self.left() } else { None }
    }

    /// The share of what patches hide, squared, that is to be left for the target to be reached.
    fn aim(&self) -> f64 {
        let Some(Round { means, within, .. }) = self.rounds.last() else { return 0.0 };
        let allowed = self.target.error.powi(2) - means.relative.powi(2);
        (allowed / within.powi(2)).clamp(0.0, 1.0)
    }

    /// Which part that smaller patches do not take away holds most of the error, where one does.
    fn left(&self) -> Option<Stop> {
        let Round { means, within, .. } = self.rounds.last()?;
        let patches = within.hypot(means.discretisation);
        match means.form_factors.max(means.residual) {
            most if most < patches => None,
            most if most == means.residual => Some(Stop::Residual),
            _ => Some(Stop::FormFactors),
        }
    }

    /// The cut with as many of these quartered, the first of them, as the most patches allow; none where that is less than a quarter
    /// of them.
    fn quartered(&self, chosen: &[Place]) -> Result<Option<(Refinement, Cut)>, BakeError> {
        let mut count = chosen.len();
        while 4 * count >= chosen.len() {
            let mut refinement = self.refinement.clone();
            chosen[..count].iter().for_each(|&place| refinement.quarter(place));
            // Three more each, if not for those that come with them.
            let least = self.now.cut.patches.len() as u64 + 2 * count as u64;
            if least <= self.target.most_patches {
                let (patches, origins) = patches::refined(self.scene, self.cutting, &refinement)?;
                if patches.len() as u64 <= self.target.most_patches {
                    let mut cut = Cut { patches, origins };
                    cut.patches.parent = self.start.parents_of(&cut);
                    return Ok(Some((refinement, cut)));
                }
            }
            count = count * 7 / 10;
            if count == 0 {
                break;
            }
        }
        Ok(None)
    }

    /// For each patch of a cut, the patch of the last one that it is, where it is one.
    fn same_as_before(&self, cut: &Cut) -> Vec<Option<u32>> {
        let before = &self.now.cut;
        let known = before.by_origin();
        let near = DIGITS * self.now.facets.extent();
        let same = |(i, origin): (usize, &Origin)| {
            let &was = known.get(origin)?;
            let j = was as usize;
            let area = before.patches.area[j];
            let moved = cut.patches.centre[i].distance(before.patches.centre[j]);
            (moved <= near && (cut.patches.area[i] - area).abs() <= DIGITS * area).then_some(was)
        };
        cut.origins.iter().enumerate().map(same).collect()
    }

    /// Radiosities to start from: each patch has the light that what it was part of had.
    fn starting_from(&self, cut: &Cut) -> Vec<Rgb> {
        let Answer { cut: before, solution, .. } = &self.now;
        let known = before.by_origin();
        let irradiance = |origin: &Origin| -> Rgb {
            let mut place = Some(origin.place);
            while let Some(at) = place {
                let part = |part| known.get(&Origin { place: at, part });
                if let Some(&was) = part(origin.part).or_else(|| part(0)) {
                    return solution.irradiance[was as usize];
                }
                place = at.parent();
            }
            Rgb::BLACK
        };
        let light = |(i, origin): (usize, &Origin)| {
            cut.patches.emission[i] + cut.patches.reflectance[i] * irradiance(origin)
        };
        cut.origins.iter().enumerate().map(light).collect()
    }
}

/// How much light varies within patches: as neighbours show, or as the lamps' own light does, whichever is more.
fn within(
    scene: &Scene,
    patches: &Patches,
    facets: &Facets,
    solution: &Solution,
    request: &Request,
    run: &Run,
) -> Variation {
    let mut variation = Variation::new(patches, solution);
    let back_faces = request.back_faces.unwrap_or(scene.back_faces);
    let straight = || straight_variation(patches, facets, back_faces);
    let threads = rayon::ThreadPoolBuilder::new().num_threads(run.threads.unwrap_or(0)).build();
    // Where no thread can be had the caller's does.
    let straight = threads.map_or_else(|_| straight(), |threads| threads.install(straight));
    for ((within, straight), &reflectance) in
        variation.radiosity.iter_mut().zip(straight).zip(&patches.reflectance)
    {
        let straight = reflectance * straight;
        *within = Rgb::new(within.r.max(straight.r), within.g.max(straight.g), within.b.max(straight.b));
    }
    variation
}

/// What agrees in so many digits is the same.
const DIGITS: f64 = 1e-10;

impl Cut {
    fn by_origin(&self) -> HashMap<Origin, u32> {
        self.origins.iter().copied().zip(0..).collect()
    }

    /// For each patch of a finer cut the patch of this one that it is part of.
    fn parents_of(&self, finer: &Self) -> Vec<u32> {
        let cell = |origin: &Origin| (origin.place.surface, origin.place.cell);
        let parent = |(i, origin): (usize, &Origin)| {
            let first = self.origins.partition_point(|other| cell(other) < cell(origin));
            let last = self.origins.partition_point(|other| cell(other) <= cell(origin));
            if last - first == 1 {
                return first as u32;
            }
            // Of the parts of a cell, that on which its centre lies, or comes nearest to lying.
            let centre = finer.patches.centre[i];
            let pieces = self.patches.pieces[origin.place.surface as usize].iter();
            let pieces = pieces.flat_map(|pieces| pieces.patch.iter().zip(&pieces.triangles));
            let candidates = pieces.filter(|&(&patch, _)| (first..last).contains(&(patch as usize)));
            let depth = |(_, triangle): &(&u32, &[DVec3; 3])| inside(triangle, centre);
            candidates.max_by(|a, b| depth(a).total_cmp(&depth(b))).map_or(first as u32, |(&patch, _)| patch)
        };
        finer.origins.iter().enumerate().map(parent).collect()
    }
}

/// The least of a point's barycentric coordinates: negative outside.
fn inside(&[a, b, c]: &[DVec3; 3], point: DVec3) -> f64 {
    let area = (b - a).cross(c - a);
    let share = |p: DVec3, q: DVec3| (q - p).cross(point - p).dot(area) / area.length_squared();
    share(a, b).min(share(b, c)).min(share(c, a))
}

impl Answer {
    #[expect(clippy::too_many_arguments, reason = "every stage's value, what is asked and how it is run")]
    fn new(
        scene: &Scene,
        cut: Cut,
        facets: Facets,
        factors: FormFactors,
        start: Option<Vec<Rgb>>,
        request: &Request,
        run: &Run,
        watch: &mut Watch<'_>,
    ) -> Result<Self, BakeError> {
        let patches = &cut.patches;
        let mut repaired = None;
        if request.repair {
            let (areas, closing) = bake::repaired(patches, &factors, run)?;
            repaired = Some((areas.form_factors().on_threads(run.threads.unwrap_or(0)), closing));
        }
        let rows = repaired.as_ref().map_or(&factors, |(rows, _)| rows);
        let start = start.filter(|_| request.solver == Solver::GaussSeidel);
        let solution = bake::solve_from(patches, rows, start, request, watch)?;
        let (solution, correction) =
            bake::corrected(scene, patches, &facets, rows, solution, request, run, watch)?;
        let error = bake::error(scene, patches, &facets, rows, &solution, request, run, watch)?;
        let variation = within(scene, patches, &facets, &solution, request, run);
        Ok(Self { cut, facets, factors, repaired, solution, correction, error, variation })
    }

    fn round(&self, rows_found: usize) -> Round {
        let patches = &self.cut.patches;
        let means = self.error.overall(patches, &self.solution);
        let counted = choice::counted(patches);
        let size = |light: &[Rgb]| -> f64 {
            let all = (0..light.len()).filter(|&i| counted(i));
            all.map(|i| patches.area[i] * light[i].norm_squared()).sum::<f64>().sqrt()
        };
        let whole = size(&self.solution.radiosity);
        let within = if whole > 0.0 { SAFETY * size(&self.variation.radiosity) / whole } else { 0.0 };
        let alone = self.variation.alone.iter().filter(|&&i| counted(i as usize)).count();
        Round {
            patches: patches.len(),
            rows_found,
            means,
            within,
            alone,
            error: means.relative.hypot(within),
        }
    }
}
