//! The recipe end to end: the only file that knows every stage.

use std::ops::ControlFlow;

use crate::estimate::{ErrorEstimate, Hidden, Local, Looks, PLACES, Places};
use crate::form_factors::hemicube::{self, CellWeights, Hemicube};
use crate::form_factors::shares::{self, Shares};
use crate::form_factors::visible::{self, ExactVisible};
use crate::form_factors::{
    Band, Closing, Elsewhere, ExchangeAreas, FormFactors, LightBlocks, Passes, RecomputedRows, Row, WAITING,
    compute_rows, compute_rows_of,
};
use crate::light::Rgb;
use crate::patches::{self, Cutting, MOST_PATCHES, Origin, Patches, Refinement, SubdivideError, Subdivision};
use crate::scene::{BackFaces, Scene};
use crate::simd::LANES;
use crate::solve::{self, Solution, SolveError};
use crate::visibility::{Facets, RayTree};
use crate::watch::{Interrupted, Progress, Watch};

/// What is asked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Request {
    /// How finely surfaces are cut into patches.
    pub subdivision: Subdivision,
    /// Whether patches are parted where another surface crosses theirs or stands on it; `None` does so where they are made by
    /// size or number, and leaves them as they are where the author's n and m (and triangles) count.
    pub split: Option<bool>,
    /// How often patches that are split are quartered towards where surfaces meet; see [`Cutting::grading`].
    pub grading: u32,
    /// How form factors are found.
    pub method: Method,
    /// How the equation is solved.
    pub solver: Solver,
    /// The stopping test's bound: sqrt(Σ |B_i - Bold_i|²) <= epsilon.
    pub epsilon: f64,
    /// What a patch is from behind; `None` leaves it to the scene.
    pub back_faces: Option<BackFaces>,
    /// Whether form factors are made to keep reciprocity and closure to the last digit ([`ExchangeAreas`]).
    pub repair: bool,
    /// The radiosity of what lies beyond an open scene, all about: what goes out of it is lost, and this comes in.
    pub surroundings: Rgb,
    /// Whether the answer's error is estimated ([`ErrorEstimate`]): about as long again as the form factors take by hemicube, and a
    /// few passes over the rows.
    pub error: bool,
}

impl Default for Request {
    /// The assignment's hand-in precision.
    fn default() -> Self {
        Self {
            subdivision: Subdivision::Factor(1.0),
            split: None,
            grading: 0,
            method: Method::Hemicube { precision: 100 },
            solver: Solver::GaussSeidel,
            epsilon: 1e-6,
            back_faces: None,
            repair: false,
            surroundings: Rgb::BLACK,
            error: false,
        }
    }
}

impl Request {
    /// How the scene is to be cut into patches.
    pub fn cutting(&self) -> Cutting {
        let by_author = matches!(self.subdivision, Subdivision::Factor(_));
        let split = self.split.unwrap_or(!by_author);
        Cutting { subdivision: self.subdivision, split, grading: self.grading }
    }
}

/// A way to find form factors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// A hemicube at each patch's centre, its cells filled by an item buffer.
    Hemicube {
        /// Cells along a side of the top face; even, at least 2.
        precision: u32,
    },
    /// The same hemicube, one ray a cell: the assignment's own way, slow, and the reference for the other.
    HemicubeRays {
        /// Cells along a side of the top face; even, at least 2.
        precision: u32,
    },
    /// Exact form factors from patch to patch, times the share of each that hemicubes see; those of lamps as [`Method::Exact`]
    /// has them.
    HemicubeExact {
        /// Cells along a side of the top face, of all hemicubes along a side of a patch together.
        precision: u32,
        /// Hemicubes along each side of a patch; see [`shares::EYES`].
        eyes: u32,
        /// By how much a lamp's form factor may be off where it is partly hidden; see [`visible::ACCURACIES`].
        accuracy: f64,
    },
    /// Exact form factors from patch to patch, times how much of each is seen from the other.
    Exact {
        /// By how much a row's sum may be off where patches are partly hidden, as a standard deviation; see
        /// [`visible::ACCURACIES`].
        accuracy: f64,
    },
}

impl Method {
    /// Cells along a side of the hemicube's top face; `None` where there is no hemicube.
    pub fn precision(self) -> Option<u32> {
        match self {
            Self::Hemicube { precision }
            | Self::HemicubeRays { precision }
            | Self::HemicubeExact { precision, .. } => Some(precision),
            Self::Exact { .. } => None,
        }
    }
}

/// A way to solve the equation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solver {
    /// Gauss-Seidel in patch order.
    GaussSeidel,
    /// Progressive refinement: shooting, the most unshot power first.
    Progressive,
    /// Conjugate gradients on the symmetric system of reciprocity-averaged form factors.
    ConjugateGradients,
    /// Jacobi: a bounce of light a step.
    Jacobi,
}

/// How it is run: none of this changes a bit of the answer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Run {
    /// Worker threads; `None` for as many as the machine has cores.
    pub threads: Option<usize>,
    /// Bytes that a solution may take; `None` for three quarters of the machine's memory.
    pub memory_limit: Option<u64>,
}

/// Every stage's value.
#[derive(Clone, Debug)]
pub struct Baked {
    /// The patches.
    pub patches: Patches,
    /// What visibility was asked of: pictures ask it again.
    pub facets: Facets,
    /// Their form factors; none where they did not fit into memory, and were found anew for every step of the solver.
    pub form_factors: FormFactors,
    /// Where they did not: what they would have taken.
    pub recomputed: Option<Recomputed>,
    /// How closure was restored, where that was asked.
    pub closing: Option<Closing>,
    /// Their radiosities.
    pub solution: Solution,
    /// By how much those may be off, where that was asked.
    pub error: Option<ErrorEstimate>,
}

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BakeError {
    /// The scene cannot be cut into patches.
    #[error(transparent)]
    Subdivide(#[from] SubdivideError),
    /// The equation has no answer.
    #[error(transparent)]
    Solve(SolveError),
    /// The caller said stop.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    /// Something asked makes no sense; the message says what, and the cure.
    #[error("{0}")]
    BadRequest(String),
    /// It would take too much memory.
    #[error(
        "{patches} patches would need about {needed_gb:.1} GB, and the limit is {limit_gb:.1} GB: use a smaller \
         --subdivision or a larger --patch-size, or raise --memory-limit"
    )]
    Memory {
        /// How many patches.
        patches: u64,
        /// About how much it would take, in GB of 10⁹ bytes.
        needed_gb: f64,
        /// How much is allowed, likewise.
        limit_gb: f64,
    },
}

/// What a solution would take, told before anything large is allocated.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Need {
    /// Patches.
    pub patches: u64,
    /// Form factors stored, estimated from a sample of rows.
    pub nonzeros: u64,
    /// Bytes for all of it.
    pub bytes: u64,
}

/// Bytes a patch apart from its form factors: the patch itself, its radiosity, irradiance and what the solver that
/// keeps most (conjugate gradients) keeps besides.
const BYTES_PER_SOLVED_PATCH: u64 = patches::BYTES_PER_PATCH + 8 * 24;

/// What the allocator adds to a row, about.
const BYTES_BESIDES_A_ROW: u64 = 2 * 16;

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
    hemicube: hemicube::Scratch,
    exact: visible::Scratch,
    shares: shares::Scratch,
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

    fn pass_bands(&self, watch: &mut Watch<'_>, visit: impl FnMut(Band<'_>)) -> Result<(), Interrupted> {
        match self {
            Self::Stored(form_factors) => form_factors.pass_bands(watch, visit),
            Self::Recomputed(rows, _) => rows.pass_bands(watch, visit),
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

/// What an entry takes at most while its row is found, by whatever method, and while it is solved with.
const MOST_BYTES_PER_ENTRY: u64 = 16;

/// Rows that [`need`] looks at to foretell the rest.
const SAMPLED_ROWS: usize = 64;

/// And of each, where it is an exact one, so many blocks of sixteen columns: a second's work among 100,000 triangles.
const SAMPLED_BLOCKS: usize = 8;

/// Multiples of it, less their whole parts, keep apart.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// The most patches that [`foretell`] has a scene cut into.
const SAMPLED_PATCHES: u64 = 500_000;

/// The same of exact form factors, whose rows take the longer the more patches there are.
const SAMPLED_PATCHES_EXACT: u64 = 20_000;

/// Step 1: the patches, refused where they alone would exceed the memory limit.
///
/// # Errors
/// [`BakeError::Subdivide`], [`BakeError::Memory`], or [`BakeError::BadRequest`] where there is none at all.
pub fn patches(scene: &Scene, request: &Request, run: &Run) -> Result<Patches, BakeError> {
    Ok(patches_with_origins(scene, request, run)?.0)
}

/// The same, with where each comes from.
pub(crate) fn patches_with_origins(
    scene: &Scene,
    request: &Request,
    run: &Run,
) -> Result<(Patches, Vec<Origin>), BakeError> {
    let cutting = request.cutting().for_scene(scene)?;
    // Before they are made, and again with those that are split.
    allow_patches(scene, patches::count(scene, cutting.subdivision)?, run)?;
    if cutting.grading > 0 {
        allow_patches(scene, patches::count(scene, cutting)?, run)?;
    }
    let (patches, origins) = patches::refined(scene, cutting, &Refinement::default())?;
    allow_patches(scene, patches.len() as u64, run)?;
    Ok((patches, origins))
}

/// Refuse so many patches where there is none, or where they alone would exceed the memory limit.
fn allow_patches(scene: &Scene, count: u64, run: &Run) -> Result<(), BakeError> {
    if count == 0 {
        return Err(BakeError::BadRequest(format!("{}: there is no surface in the scene", scene.name)));
    }
    allow(Need { patches: count, nonzeros: 0, bytes: count.saturating_mul(BYTES_PER_SOLVED_PATCH) }, run)?;
    if count > MOST_PATCHES {
        return Err(SubdivideError::TooMany { patches: count }.into());
    }
    Ok(())
}

/// What the form factors and the solution would take, foretold from a sample of rows; where the request does not tell what a
/// patch is from behind, as if it were lit.
///
/// # Errors
/// [`BakeError::BadRequest`] where the precision makes no hemicube, or the accuracy makes no sense.
pub fn need(patches: &Patches, facets: &Facets, request: &Request) -> Result<Need, BakeError> {
    let count = patches.len();
    let row = sampler(patches, facets, request)?;
    let (mut scratch, mut some) = (Scratch::default(), vec![false; count]);
    let sampled = count.min(SAMPLED_ROWS);
    let blocks = count.div_ceil(LANES);
    let exact = request.method.precision().is_none();
    let record = Row::default().bytes() as f64;
    let (mut found, mut bytes) = (0.0, 0.0);
    for k in 0..sampled {
        // Of columns other ones for each row, spread as multiples of the golden ratio are.
        some.fill(blocks <= SAMPLED_BLOCKS);
        if blocks > SAMPLED_BLOCKS {
            for k in k * SAMPLED_BLOCKS..(k + 1) * SAMPLED_BLOCKS {
                let block = ((k as f64 * GOLDEN).fract() * blocks as f64) as usize;
                some[block * LANES..count.min((block + 1) * LANES)].fill(true);
            }
        }
        // Spread over all patches, and not in step with their grids.
        let (row, whole) = row(k * count / sampled, &some, &mut scratch);
        let among = some.iter().filter(|&&among| among).count();
        let of_it = if whole { 1.0 } else { count as f64 / among as f64 };
        let of_row = |bytes: u64| record + (bytes as f64 - record) * of_it;
        // Exact rows are found together, and the solver's share is not there yet.
        let waiting = if exact { of_row(row.bytes()) * WAITING } else { 0.0 };
        found += row.len() as f64 * of_it;
        bytes += of_row(row.bytes_at_work()).max(waiting) + BYTES_BESIDES_A_ROW as f64;
    }
    let of_all = |sum: f64| (sum / sampled.max(1) as f64 * count as f64) as u64;
    let bytes = of_all(bytes) + count as u64 * BYTES_PER_SOLVED_PATCH;
    Ok(Need { patches: count as u64, nonzeros: of_all(found), bytes })
}

/// Finds a row to foretell others by, and tells whether it is whole; else it is of the patches whose flags are set alone.
type Sampler<'a> = Box<dyn Fn(usize, &[bool], &mut Scratch) -> (Row, bool) + 'a>;

/// Whole rows of hemicubes, and some columns of exact ones: those take the longer the more patches there are.
fn sampler<'a>(
    patches: &'a Patches,
    facets: &'a Facets,
    request: &Request,
) -> Result<Sampler<'a>, BakeError> {
    let back_faces = request.back_faces.unwrap_or(BackFaces::Lit);
    Ok(match request.method {
        Method::Exact { accuracy } => {
            let exact = ExactRows::new(patches, facets, back_faces, accuracy)?;
            Box::new(move |patch, some, scratch| {
                (exact.visible.row_among(patch, some, &mut scratch.exact), false)
            })
        }
        Method::HemicubeExact { precision, eyes, accuracy } => {
            let shares = shares(patches, facets, back_faces, precision, eyes, accuracy)?;
            Box::new(move |patch, some, scratch| match shares.of_lamp(patch) {
                Some(exact) => (exact.row_among(patch, some, &mut scratch.exact), false),
                None => (shares.row_without_lamps(patch, &mut scratch.shares), true),
            })
        }
        Method::Hemicube { .. } | Method::HemicubeRays { .. } => {
            let row = row_finder(patches, facets, request, back_faces)?;
            Box::new(move |patch, _, scratch| (row(patch, scratch), true))
        }
    })
}

/// The same of a scene, in a second or so however finely it is to be cut: of more than half a million patches a coarser
/// cut is sampled. A hemicube of C cells sees no more than C patches, and about C (1 - exp(-n / n₀)) of n, as many as
/// are hit where n are shot at C times; an exact row sees the same share of however many.
///
/// # Errors
/// [`BakeError::Memory`] where the patches alone would exceed the limit; else those of [`patches()`] and [`need`].
pub fn foretell(scene: &Scene, request: &Request, run: &Run) -> Result<Need, BakeError> {
    let cutting = request.cutting().for_scene(scene)?;
    allow_patches(scene, patches::count(scene, cutting.subdivision)?, run)?;
    let count = patches::count(scene, cutting)?;
    allow_patches(scene, count, run)?;
    let exact = request.method.precision().is_none();
    let most = if exact { SAMPLED_PATCHES_EXACT } else { SAMPLED_PATCHES };
    let share = (most as f64 / count as f64).sqrt().min(1.0);
    let coarser = Cutting { subdivision: cutting.subdivision.coarser(share), ..cutting };
    let patches = patches::subdivide(scene, coarser)?;
    let sampled = need(&patches, &Facets::new(scene, &patches), &settled(scene, request))?;
    let finer = count as f64 / sampled.patches as f64;
    let rows = sampled.bytes - sampled.patches * BYTES_PER_SOLVED_PATCH;
    let cells =
        request.method.precision().map_or(f64::INFINITY, |precision| 3.0 * f64::from(precision).powi(2));
    let share = (sampled.nonzeros as f64 / sampled.patches as f64 / cells).min(1.0 - f64::EPSILON);
    let more = match finer > 1.0 {
        true if share > 0.0 => finer * (1.0 - (1.0 - share).powf(finer)) / share,
        // Of no end of cells.
        true => finer * finer,
        false => 1.0,
    };
    let times = |sum: u64| (sum as f64 * more) as u64;
    let bytes = times(rows).saturating_add(count.saturating_mul(BYTES_PER_SOLVED_PATCH));
    Ok(Need { patches: count, nonzeros: times(sampled.nonzeros), bytes })
}

/// What is asked, where the scene has a say in it.
fn settled(scene: &Scene, request: &Request) -> Request {
    Request { back_faces: Some(request.back_faces.unwrap_or(scene.back_faces)), ..*request }
}

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
    let mut areas = ExchangeAreas::average(&patches.area, factors, |i, j| patches.is_behind(i, j));
    let closing = areas.close();
    Ok((areas, closing))
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
            Ok((Rows::Stored(areas.form_factors()), closing))
        }
        Rows::Recomputed(_, Recomputed { need, .. }) => {
            let bytes = need.bytes.saturating_add(ExchangeAreas::bytes(need.nonzeros));
            Err(over_limit(Need { bytes, ..need }, memory_limit(run)))
        }
    }
}

/// Whether the rows would fit even if every patch saw every other: then nobody need look at a sample of them.
fn surely_fits(patches: &Patches, run: &Run) -> bool {
    let count = patches.len() as u64;
    let row = count.saturating_mul(MOST_BYTES_PER_ENTRY) + BYTES_PER_SOLVED_PATCH + BYTES_BESIDES_A_ROW;
    count.saturating_mul(row) <= memory_limit(run)
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
struct ExactRows<'a> {
    visible: ExactVisible,
    hemicube: Hemicube<'a>,
    back_faces: BackFaces,
}

impl<'a> ExactRows<'a> {
    fn new(
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

/// Step 3: the radiosities.
///
/// # Errors
/// [`BakeError::Solve`], [`BakeError::Interrupted`], or [`BakeError::BadRequest`] for an epsilon that is not positive.
pub fn solve(
    patches: &Patches,
    rows: &impl Passes,
    request: &Request,
    watch: &mut Watch<'_>,
) -> Result<Solution, BakeError> {
    solve_from(patches, rows, None, request, watch)
}

/// The same from an earlier answer, where there is one and the solver is one that can begin with it: Gauss-Seidel.
///
/// # Errors
/// As of [`solve()`].
pub fn solve_from(
    patches: &Patches,
    rows: &impl Passes,
    start: Option<Vec<Rgb>>,
    request: &Request,
    watch: &mut Watch<'_>,
) -> Result<Solution, BakeError> {
    if !(request.epsilon > 0.0 && request.epsilon.is_finite()) {
        return Err(BakeError::BadRequest("epsilon must be a positive number, and not infinite".into()));
    }
    let solver = |patches: &Patches, watch: &mut Watch<'_>| {
        let solution = match request.solver {
            Solver::GaussSeidel => {
                let start = start.unwrap_or_else(|| patches.emission.clone());
                solve::gauss_seidel_from(patches, rows, start, request.epsilon, watch)
            }
            Solver::Progressive => solve::progressive(patches, rows, request.epsilon, watch),
            Solver::ConjugateGradients => solve::conjugate_gradients(patches, rows, request.epsilon, watch),
            Solver::Jacobi => solve::jacobi(patches, rows, request.epsilon, watch),
        };
        solution.map_err(|error| match error {
            SolveError::Interrupted(interrupted) => interrupted.into(),
            other => BakeError::Solve(other),
        })
    };
    if request.surroundings.is_black() {
        return solver(patches, watch);
    }
    // What the surroundings send is reflected as if it were emitted: to the solver it is.
    let mut arriving = Vec::with_capacity(patches.len());
    rows.pass(watch, |_, row| arriving.push(request.surroundings * row.elsewhere().surroundings))?;
    let mut lit = patches.clone();
    for (i, &light) in arriving.iter().enumerate() {
        lit.emission[i] += patches.reflectance[i] * light;
    }
    let mut solution = solver(&lit, watch)?;
    for (irradiance, light) in solution.irradiance.iter_mut().zip(arriving) {
        *irradiance += light;
    }
    Ok(solution)
}

/// Step 4, where [`Request::error`] asks for it: by how much the radiosities may be off. With hemicubes every second patch looks
/// out anew from two places, which takes as long as its form factors did; with exact form factors, or shares, every patch from
/// four, by small hemicubes.
///
/// # Errors
/// [`BakeError::Interrupted`], or [`BakeError::BadRequest`] as of [`rows`].
#[expect(clippy::too_many_arguments, reason = "every stage's value, what is asked and how it is run")]
pub fn error(
    scene: &Scene,
    patches: &Patches,
    facets: &Facets,
    rows: &impl Passes,
    solution: &Solution,
    request: &Request,
    run: &Run,
    watch: &mut Watch<'_>,
) -> Result<ErrorEstimate, BakeError> {
    let back_faces = request.back_faces.unwrap_or(scene.back_faces);
    let threads = run.threads.unwrap_or(0);
    let light: LightBlocks = solution.radiosity.iter().copied().collect();
    let looks = match request.method {
        Method::Exact { .. } => None,
        _ => Some(Looks::new(patches)),
    };
    let within = match request.method {
        Method::Hemicube { .. } | Method::HemicubeRays { .. } => None,
        Method::HemicubeExact { .. } | Method::Exact { .. } => Some(Places::new(patches)),
    };
    let (places, again) = match (&looks, request.method) {
        (None, _) => (Vec::new(), *request),
        // Several hemicubes know what one at the centre does not; more of them, and elsewhere, know better.
        (Some(_), Method::HemicubeExact { precision, eyes, accuracy }) => {
            let other = if eyes < *shares::EYES.end() { eyes + 1 } else { eyes - 1 };
            let precision = precision.div_ceil(eyes) * other;
            let method = Method::HemicubeExact { precision, eyes: other, accuracy };
            (vec![patches], Request { method, ..*request })
        }
        (Some(looks), _) => (vec![&looks.one, &looks.other], *request),
    };
    let wanted = looks.as_ref().map_or(&[][..], |looks| &looks.wanted);
    let total = places.len() * wanted.len() + if within.is_some() { PLACES * patches.len() } else { 0 };
    let mut done = 0;
    let mut step = || {
        done += 1;
        watch(&Progress::FormFactors { done, total })
    };

    let share = (places.len().max(1) as f64).recip();
    let mut seen = vec![None; patches.len()];
    for moved in places {
        let row = row_finder(moved, facets, &again, back_faces)?;
        let end = compute_rows_of(wanted, threads, Scratch::default, row, |patch, row| {
            let arrives = row.gather_blocks(&light) + request.surroundings * row.elsewhere().surroundings;
            let before = seen[patch].unwrap_or(Rgb::BLACK);
            seen[patch] = Some(before + arrives * share);
            step()
        });
        if end.is_break() {
            return Err(Interrupted.into());
        }
    }
    let local = match request.method {
        Method::Exact { accuracy } => Local::Accuracy(accuracy),
        _ => Local::Looked(seen),
    };
    let hidden = match &within {
        Some(within) => {
            let hidden =
                hidden(within, facets, &light, request.surroundings, back_faces, threads, &mut step)?;
            Some(hidden.irradiance(patches))
        }
        None => None,
    };
    Ok(ErrorEstimate::new(patches, rows, solution, &local, hidden.as_deref(), watch)?)
}

/// Of the hemicubes that look out from four places on each patch: together as many cells as one of the usual precision has.
const WITHIN_PRECISION: u32 = 50;

/// The patches that are looked out from at a time: their rows take 30 MB at most.
const WITHIN_BATCH: usize = 128;

/// What patches hide that send evenly, as four places on each know it.
fn hidden(
    within: &Places,
    facets: &Facets,
    light: &LightBlocks,
    surroundings: Rgb,
    back_faces: BackFaces,
    threads: usize,
    step: &mut impl FnMut() -> ControlFlow<()>,
) -> Result<Hidden, BakeError> {
    let mut cubes = Vec::with_capacity(PLACES);
    for moved in within.each() {
        cubes.push(hemicube(moved, facets, back_faces, WITHIN_PRECISION)?);
    }
    let count = within.each()[0].len();
    let mut hidden = Hidden::new(count);
    let every: Vec<u32> = (0..count as u32).collect();
    for batch in every.chunks(WITHIN_BATCH) {
        let mut found = [(); PLACES].map(|()| vec![Row::default(); batch.len()]);
        for (cube, rows) in cubes.iter().zip(&mut found) {
            let row = |patch: usize, scratch: &mut hemicube::Scratch| cube.row(patch, scratch);
            let end = compute_rows_of(batch, threads, hemicube::Scratch::default, row, |patch, row| {
                rows[patch - batch[0] as usize] = row;
                step()
            });
            if end.is_break() {
                return Err(Interrupted.into());
            }
        }
        for (k, &patch) in batch.iter().enumerate() {
            let rows = std::array::from_fn(|place| &found[place][k]);
            hidden.add(within, patch as usize, rows, light, surroundings);
        }
    }
    Ok(hidden)
}

/// All of it.
///
/// # Errors
/// Those of each step.
pub fn bake(scene: &Scene, request: &Request, run: &Run, watch: &mut Watch<'_>) -> Result<Baked, BakeError> {
    let patches = patches(scene, request, run)?;
    let facets = Facets::new(scene, &patches);
    let mut rows = rows(scene, &patches, &facets, request, run, watch)?;
    let mut closing = None;
    if request.repair {
        let (repaired, closed) = repaired_rows(&patches, rows, run)?;
        (rows, closing) = (repaired, Some(closed));
    }
    let solution = solve(&patches, &rows, request, watch)?;
    let estimated =
        |watch: &mut Watch<'_>| error(scene, &patches, &facets, &rows, &solution, request, run, watch);
    let error = request.error.then(|| estimated(watch)).transpose()?;
    let recomputed = rows.recomputed();
    let form_factors = rows.into_form_factors();
    Ok(Baked { patches, facets, form_factors, recomputed, closing, solution, error })
}

/// The memory that a run may take, in bytes: what it says, or three quarters of what the machine (or the
/// container about us) has. Where the machine does not tell, three quarters of 8 GB.
pub fn memory_limit(run: &Run) -> u64 {
    run.memory_limit.unwrap_or_else(|| machine_memory().unwrap_or(8_000_000_000) / 4 * 3)
}

/// The machine's memory in bytes, where it tells.
pub fn machine_memory() -> Option<u64> {
    let mut machine = sysinfo::System::new().ok()?;
    machine.refresh_memory();
    let container = machine.cgroup_limits().map_or(u64::MAX, |limits| limits.total_memory);
    Some(machine.total_memory().min(container)).filter(|&bytes| bytes > 0)
}

/// Refuse what would take more than the limit.
///
/// # Errors
/// [`BakeError::Memory`].
pub fn allow(need: Need, run: &Run) -> Result<(), BakeError> {
    let limit = memory_limit(run);
    if need.bytes > limit { Err(over_limit(need, limit)) } else { Ok(()) }
}

fn over_limit(need: Need, limit: u64) -> BakeError {
    let in_gb = |bytes: u64| bytes as f64 / 1e9;
    BakeError::Memory { patches: need.patches, needed_gb: in_gb(need.bytes), limit_gb: in_gb(limit) }
}

fn no_such_accuracy(accuracy: f64) -> BakeError {
    let (least, most) = (visible::ACCURACIES.start(), visible::ACCURACIES.end());
    BakeError::BadRequest(format!(
        "form factors cannot be found to an accuracy of {accuracy}: it takes a number from {least:e} to {most:e}"
    ))
}

fn shares<'a>(
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

fn hemicube<'a>(
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
