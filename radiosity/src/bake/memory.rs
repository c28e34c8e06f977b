//! What a solution would take in memory, foretold before anything large is made, and refused beyond the limit.

use super::rows::{ExactRows, Scratch, row_finder, shares};
use super::{BakeError, Method, Request, Run};
use crate::form_factors::{Row, WAITING};
use crate::patches::{self, Cutting, MOST_PATCHES, Patches, SubdivideError};
use crate::scene::{BackFaces, Scene};
use crate::simd::LANES;
use crate::visibility::Facets;

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
pub(super) const BYTES_PER_SOLVED_PATCH: u64 = patches::BYTES_PER_PATCH + 11 * 24;

/// What the allocator adds to a row, about.
const BYTES_BESIDES_A_ROW: u64 = 2 * 16;

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

/// Refuse so many patches where there is none, or where they alone would exceed the memory limit.
pub(super) fn allow_patches(scene: &Scene, count: u64, run: &Run) -> Result<(), BakeError> {
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
    let record = Row::from_dense(&[]).bytes() as f64;
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
/// [`BakeError::Memory`] where the patches alone would exceed the limit; else those of [`patches()`](super::patches()) and [`need`].
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
pub(super) fn settled(scene: &Scene, request: &Request) -> Request {
    Request { back_faces: Some(request.back_faces.unwrap_or(scene.back_faces)), ..*request }
}

/// Whether the rows would fit even if every patch saw every other: then nobody need look at a sample of them.
pub(super) fn surely_fits(patches: &Patches, run: &Run) -> bool {
    let count = patches.len() as u64;
    let row = count.saturating_mul(MOST_BYTES_PER_ENTRY) + BYTES_PER_SOLVED_PATCH + BYTES_BESIDES_A_ROW;
    count.saturating_mul(row) <= memory_limit(run)
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

pub(super) fn over_limit(need: Need, limit: u64) -> BakeError {
    let in_gb = |bytes: u64| bytes as f64 / 1e9;
    BakeError::Memory { patches: need.patches, needed_gb: in_gb(need.bytes), limit_gb: in_gb(limit) }
}
