//! Step 2: the form factors, by whatever method is asked, and as many of them kept as memory allows.

use super::memory::{
    BYTES_PER_SOLVED_PATCH, Need, allow, memory_limit, need, over_limit, settled, surely_fits,
};
use super::{BakeError, Method, Request, Run};
use crate::form_factors::hemicube::{self, CellWeights, Hemicube};
use crate::form_factors::shares::{self, Shares};
use crate::form_factors::visible::{self, ExactVisible};
use crate::form_factors::{
    Blocks, Closing, Elsewhere, ExchangeAreas, FormFactors, Gathered, LightBlocks, Passes, RecomputedRows,
    Row, Stretch, compute_rows,
};
use crate::light::Rgb;
use crate::patches::Patches;
use crate::scene::{BackFaces, Scene};
use crate::visibility::{Facets, RayTree};
use crate::watch::{Interrupted, Watch};

/// The fewest and the most rows that are found anew at a time.
const BATCH: (u64, u64) = (32, 4096);

/// Form factors that do not fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recomputed {
    /// What all of it would take.
    pub need: Need,
    /// How many of the rows are kept all the same, from the first; the others are found anew for every step.
    pub kept: usize,
}

/// The form factors as memory allows, for solvers to make passes over.
#[derive(Debug)]
pub enum Rows<'a> {
    /// All of them are there.
    Stored(FormFactors),
    /// As many as fit are kept, and the others found anew for every step: the same bits, and so the same answer.
    Recomputed(FoundRows<'a>, Recomputed),
}

/// Rows found when they are wanted.
pub type FoundRows<'a> = RecomputedRows<Scratch, fn() -> Scratch, RowFinder<'a>>;

/// Memory that one row after another is worked out in, whatever the method.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    pub(super) hemicube: hemicube::Scratch,
    pub(super) exact: visible::Scratch,
    pub(super) shares: shares::Scratch,
}

/// How a row is found; the method and what it sees are within.
pub type RowFinder<'a> = Box<dyn Fn(usize, &mut Scratch) -> Row + Send + Sync + 'a>;

impl Rows<'_> {
    /// How many form factors there are, not counting zeros.
    pub fn nonzeros(&self) -> usize {
        match self {
            Self::Stored(form_factors) => form_factors.nonzeros(),
            Self::Recomputed(rows, _) => rows.nonzeros(),
        }
    }

    /// As of [`FormFactors::row_sum_range`].
    pub fn row_sum_range(&self) -> (f64, f64) {
        match self {
            Self::Stored(form_factors) => form_factors.row_sum_range(),
            Self::Recomputed(rows, _) => rows.row_sum_range(),
        }
    }

    /// The form factors; none where they do not fit.
    pub fn into_form_factors(self) -> FormFactors {
        match self {
            Self::Stored(form_factors) => form_factors,
            Self::Recomputed(..) => FormFactors::default(),
        }
    }

    /// What they would take, where they do not fit.
    pub fn recomputed(&self) -> Option<Recomputed> {
        match self {
            Self::Stored(_) => None,
            Self::Recomputed(_, recomputed) => Some(*recomputed),
        }
    }
}

impl Passes for Rows<'_> {
    fn count(&self) -> usize {
        match self {
            Self::Stored(form_factors) => form_factors.count(),
            Self::Recomputed(rows, _) => rows.count(),
        }
    }

    fn pass(&self, watch: &mut Watch<'_>, visit: impl FnMut(usize, &Row)) -> Result<(), Interrupted> {
        match self {
            Self::Stored(form_factors) => form_factors.pass(watch, visit),
            Self::Recomputed(rows, _) => rows.pass(watch, visit),
        }
    }

    fn pass_stretches(
        &self,
        watch: &mut Watch<'_>,
        visit: impl FnMut(Stretch<'_>) + Send,
    ) -> Result<(), Interrupted> {
        match self {
            Self::Stored(form_factors) => form_factors.pass_stretches(watch, visit),
            Self::Recomputed(rows, _) => rows.pass_stretches(watch, visit),
        }
    }

    fn gather(&self, watch: &mut Watch<'_>, b: &LightBlocks) -> Result<Vec<Rgb>, Interrupted> {
        match self {
            Self::Stored(form_factors) => form_factors.gather(watch, b),
            Self::Recomputed(rows, _) => rows.gather(watch, b),
        }
    }

    fn gather_and_scatter<const CHANNELS: usize>(
        &self,
        watch: &mut Watch<'_>,
        b: &Blocks<CHANNELS>,
        power: &[[f64; CHANNELS]],
    ) -> Result<Gathered<CHANNELS>, Interrupted> {
        match self {
            Self::Stored(form_factors) => form_factors.gather_and_scatter(watch, b, power),
            Self::Recomputed(rows, _) => rows.gather_and_scatter(watch, b, power),
        }
    }

    fn with_row<T>(&self, patch: usize, visit: impl FnOnce(&Row) -> T) -> T {
        match self {
            Self::Stored(form_factors) => form_factors.with_row(patch, visit),
            Self::Recomputed(rows, _) => rows.with_row(patch, visit),
        }
    }
}

/// Of the hemicubes that tell whether anything leaves the scene, or meets black backs, where exact form factors do not sum to 1.
const ELSEWHERE_PRECISION: u32 = 50;

/// What a row lacks by more than this is beyond the error of any.
const PARTLY_UNDER: f64 = 0.02;

/// What an exact row may lack of 1 by rounding.
const NEGLIGIBLE: f64 = 1e-6;

/// Step 2: the form factors, refused beforehand where they would exceed the memory limit.
///
/// # Errors
/// [`BakeError::Memory`], [`BakeError::Interrupted`], or [`BakeError::BadRequest`] where the precision makes no
/// hemicube, or the accuracy makes no sense.
pub fn form_factors(
    scene: &Scene,
    patches: &Patches,
    facets: &Facets,
    request: &Request,
    run: &Run,
    watch: &mut Watch<'_>,
) -> Result<FormFactors, BakeError> {
    if !surely_fits(patches, run) {
        allow(need(patches, facets, &settled(scene, request))?, run)?;
    }
    stored(patches, facets, request, request.back_faces.unwrap_or(scene.back_faces), run, watch)
}

/// Step 2, the other door, for whoever wants a solution and not the form factors themselves: where they would exceed
/// the memory limit they are not refused, but found anew as the solver needs them.
///
/// # Errors
/// [`BakeError::Interrupted`], or [`BakeError::BadRequest`] where the precision makes no hemicube, or the accuracy makes
/// no sense.
pub fn rows<'a>(
    scene: &Scene,
    patches: &'a Patches,
    facets: &'a Facets,
    request: &Request,
    run: &Run,
    watch: &mut Watch<'_>,
) -> Result<Rows<'a>, BakeError> {
    let back_faces = request.back_faces.unwrap_or(scene.back_faces);
    let keep = |watch: &mut Watch<'_>| stored(patches, facets, request, back_faces, run, watch);
    if surely_fits(patches, run) {
        return Ok(Rows::Stored(keep(watch)?));
    }
    let need = need(patches, facets, &settled(scene, request))?;
    let limit = memory_limit(run);
    if need.bytes <= limit {
        return Ok(Rows::Stored(keep(watch)?));
    }
    let row = row_finder(patches, facets, request, back_faces)?;
    // What the patches leave, to a quarter for the rows that are found at a time, and the rest for those that are kept.
    let count = patches.len() as u64;
    let besides = count * BYTES_PER_SOLVED_PATCH;
    let left = limit.saturating_sub(besides);
    let row_bytes = need.bytes.saturating_sub(besides) / count.max(1);
    let batch = (left / 4 / row_bytes.max(1)).clamp(BATCH.0, BATCH.1);
    let kept_bytes = left.saturating_sub(2 * batch * row_bytes);
    let sizes = (batch as usize, kept_bytes);
    let scratch: fn() -> Scratch = Scratch::default;
    let rows = RecomputedRows::new(patches.len(), run.threads.unwrap_or(0), sizes, scratch, row, watch)?;
    let kept = rows.kept();
    Ok(Rows::Recomputed(rows, Recomputed { need, kept }))
}

/// Step 2 continued, where [`Request::repair`] asks for it: form factors with reciprocity, and closure to the last digit. Rounded
/// to single precision ([`ExchangeAreas::form_factors`]) they serve any solver.
///
/// # Errors
/// [`BakeError::Memory`].
pub fn repaired(
    patches: &Patches,
    factors: &FormFactors,
    run: &Run,
) -> Result<(ExchangeAreas, Closing), BakeError> {
    let nonzeros = factors.nonzeros() as u64;
    let count = patches.len() as u64;
    let bytes = factors.bytes() + ExchangeAreas::bytes(nonzeros) + count * BYTES_PER_SOLVED_PATCH;
    allow(Need { patches: count, nonzeros, bytes }, run)?;
    let closed = || {
        let mut areas = ExchangeAreas::average(&patches.area, factors, |i, j| patches.is_behind(i, j));
        let closing = areas.close();
        (areas, closing)
    };
    let threads = rayon::ThreadPoolBuilder::new().num_threads(run.threads.unwrap_or(0)).build();
    Ok(threads.map_or_else(|_| closed(), |threads| threads.install(closed)))
}

/// [`repaired`] rows, for a solver.
///
/// # Errors
/// As of [`repaired`]; and [`BakeError::Memory`] where the rows were not stored.
pub fn repaired_rows<'a>(
    patches: &Patches,
    rows: Rows<'a>,
    run: &Run,
) -> Result<(Rows<'a>, Closing), BakeError> {
    match rows {
        Rows::Stored(factors) => {
            let (areas, closing) = repaired(patches, &factors, run)?;
            Ok((Rows::Stored(areas.form_factors().on_threads(run.threads.unwrap_or(0))), closing))
        }
        Rows::Recomputed(_, Recomputed { need, .. }) => {
            let bytes = need.bytes.saturating_add(ExchangeAreas::bytes(need.nonzeros));
            Err(over_limit(Need { bytes, ..need }, memory_limit(run)))
        }
    }
}

/// All rows, found once and kept.
fn stored(
    patches: &Patches,
    facets: &Facets,
    request: &Request,
    back_faces: BackFaces,
    run: &Run,
    watch: &mut Watch<'_>,
) -> Result<FormFactors, BakeError> {
    let threads = run.threads.unwrap_or(0);
    if let Method::Exact { accuracy } = request.method {
        let exact = ExactRows::new(patches, facets, back_faces, accuracy)?;
        let finisher = || {
            let mut scratch = hemicube::Scratch::default();
            let exact = &exact;
            move |patch, row| exact.with_elsewhere(patch, row, &mut scratch)
        };
        return Ok(exact.visible.rows(threads, finisher, watch)?);
    }
    let row = row_finder(patches, facets, request, back_faces)?;
    Ok(compute_rows(patches.len(), threads, Scratch::default, row, watch)?)
}

/// Exact rows, and the hemicubes that tell where goes what they lack.
pub(super) struct ExactRows<'a> {
    pub(super) visible: ExactVisible,
    hemicube: Hemicube<'a>,
    back_faces: BackFaces,
}

impl<'a> ExactRows<'a> {
    pub(super) fn new(
        patches: &'a Patches,
        facets: &'a Facets,
        back_faces: BackFaces,
        accuracy: f64,
    ) -> Result<Self, BakeError> {
        let visible = ExactVisible::new(patches, facets.fewest(), back_faces, accuracy)
            .ok_or_else(|| no_such_accuracy(accuracy))?;
        let hemicube = hemicube(patches, facets, back_faces, ELSEWHERE_PRECISION)?;
        Ok(Self { visible, hemicube, back_faces })
    }

    /// A row, told where goes what it lacks.
    fn with_elsewhere(&self, patch: usize, row: Row, scratch: &mut hemicube::Scratch) -> Row {
        let missing = 1.0 - row.sum();
        if missing <= NEGLIGIBLE {
            return row;
        }
        // What is missing has gone where a hemicube sees that something goes; else it is the method's error.
        let Elsewhere { surroundings, backs } = self.hemicube.row(patch, scratch).elsewhere();
        let seen = surroundings + backs;
        if seen == 0.0 {
            // So much is no error: the patch lies in part under something, and its centre does not.
            let under = self.back_faces == BackFaces::Black && missing > PARTLY_UNDER;
            let backs = if under { missing } else { 0.0 };
            return row.with_elsewhere(Elsewhere { surroundings: 0.0, backs });
        }
        let of = |share: f64| missing * (share / seen);
        row.with_elsewhere(Elsewhere { surroundings: of(surroundings), backs: of(backs) })
    }
}

/// How the request's method finds a row: for whoever finds rows in an order of their own, as a window does.
///
/// # Errors
/// [`BakeError::BadRequest`] where the precision makes no hemicube, or the accuracy makes no sense.
pub fn row_finder<'a>(
    patches: &'a Patches,
    facets: &'a Facets,
    request: &Request,
    back_faces: BackFaces,
) -> Result<RowFinder<'a>, BakeError> {
    Ok(match request.method {
        Method::Hemicube { precision } => {
            let hemicube = hemicube(patches, facets, back_faces, precision)?;
            Box::new(move |patch, scratch| hemicube.row(patch, &mut scratch.hemicube))
        }
        Method::HemicubeRays { precision } => {
            let hemicube = hemicube(patches, facets, back_faces, precision)?;
            let tree = RayTree::new(facets.fewest());
            Box::new(move |patch, _| hemicube.row_by_rays(patch, &tree))
        }
        Method::HemicubeExact { precision, eyes, accuracy } => {
            let shares = shares(patches, facets, back_faces, precision, eyes, accuracy)?;
            Box::new(move |patch, scratch| shares.row(patch, &mut scratch.shares))
        }
        Method::Exact { accuracy } => {
            let exact = ExactRows::new(patches, facets, back_faces, accuracy)?;
            Box::new(move |patch, scratch| {
                let row = exact.visible.row(patch, &mut scratch.exact);
                exact.with_elsewhere(patch, row, &mut scratch.hemicube)
            })
        }
    })
}

fn no_such_accuracy(accuracy: f64) -> BakeError {
    let (least, most) = (visible::ACCURACIES.start(), visible::ACCURACIES.end());
    BakeError::BadRequest(format!(
        "form factors cannot be found to an accuracy of {accuracy}: it takes a number from {least:e} to {most:e}"
    ))
}

pub(super) fn shares<'a>(
    patches: &'a Patches,
    facets: &'a Facets,
    back_faces: BackFaces,
    precision: u32,
    eyes: u32,
    accuracy: f64,
) -> Result<Shares<'a>, BakeError> {
    if !shares::EYES.contains(&eyes) {
        let (least, most) = (shares::EYES.start(), shares::EYES.end());
        return Err(BakeError::BadRequest(format!(
            "a patch cannot have {eyes} hemicubes along a side: it takes a number from {least} to {most}"
        )));
    }
    // As many cells in all as one hemicube of the precision has.
    let each = precision.div_ceil(eyes).next_multiple_of(2);
    let hemicube = hemicube(patches, facets, back_faces, each)?;
    Shares::new(patches, facets.fewest(), back_faces, hemicube, eyes, accuracy)
        .ok_or_else(|| no_such_accuracy(accuracy))
}

pub(super) fn hemicube<'a>(
    patches: &'a Patches,
    facets: &'a Facets,
    back_faces: BackFaces,
    precision: u32,
) -> Result<Hemicube<'a>, BakeError> {
    let weights = CellWeights::new(precision).ok_or_else(|| {
        let (least, most) = (hemicube::PRECISIONS.start(), hemicube::PRECISIONS.end());
        BakeError::BadRequest(format!(
            "a hemicube of precision {precision} cannot be built: it takes an even number from {least} to {most}"
        ))
    })?;
    Ok(Hemicube::new(patches, facets.fewest(), back_faces, weights))
}
