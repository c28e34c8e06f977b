//! The stages of the engine as every command runs them: timed, watched, and stopped by Ctrl-C.

use std::time::Instant;

use radiosity::bake::{self, Baked, Method, Rows};
use radiosity::estimate::ErrorEstimate;
use radiosity::form_factors::{Closing, ExchangeAreas, FormFactors};
use radiosity::patches::Patches;
use radiosity::scene::{self, Scene};
use radiosity::solve::Solution;
use radiosity::visibility::Facets;
use radiosity::watch::Progress;

use crate::failure::Failure;
use crate::job::Job;
use crate::numbers::grouped;
use crate::progress::Bar;
use crate::report::{
    CorrectionDone, ErrorDone, FormFactorsDone, RecomputedRows, RepairDone, SolveDone, StagesDone,
};
use crate::{diagnostics, interrupt, refined};

/// Read the scene, and tell what in it plays no part.
pub(crate) fn read(job: &Job) -> Result<Scene, Failure> {
    let scene = scene::read(&job.scene)?;
    interrupt::check()?;
    if !job.quiet {
        diagnostics::warnings(&scene);
        if scene.surfaces.iter().all(|surface| surface.material.emission.is_black()) {
            diagnostics::warning(&format!(
                "{}: no surface emits light, so all will be black: {}",
                job.scene.display(),
                match job.scene.extension().and_then(|ending| ending.to_str()).unwrap_or_default() {
                    "obj" => "give a lamp's material a Ke",
                    "gltf" | "glb" => "give a lamp's material an emissiveFactor",
                    _ => "give a lamp CE",
                }
            ));
        }
    }
    Ok(scene)
}

/// Cut the scene into patches, and make the facets that visibility is asked of.
pub(crate) fn patches(job: &Job, scene: &Scene) -> Result<(Patches, Facets), Failure> {
    let patches = bake::patches(scene, &job.request, &job.run)?;
    interrupt::check()?;
    let facets = Facets::new(scene, &patches);
    interrupt::check()?;
    warn_of_pairs(job, patches.len() as u64);
    Ok((patches, facets))
}

/// More patches than this have pairs for hours where much stands between them.
const MANY_EXACT: u64 = 20_000;

/// Exact form factors are asked of every pair of patches: with very many of them that is the wrong tool.
pub(crate) fn warn_of_pairs(job: &Job, patches: u64) {
    if matches!(job.request.method, Method::Exact { .. }) && patches > MANY_EXACT && !job.quiet {
        let millions = (patches as f64).powi(2) / 2e6;
        diagnostics::warning(&format!(
            "--method exact looks at every pair of patches, {} million here, which takes minutes in a plain room and many hours \
             where much stands between them: --method hemicube takes time as the patches do; or use fewer patches",
            grouped(millions as usize)
        ));
    }
}

/// Find the form factors; they are wanted themselves, so that what does not fit into memory is refused.
pub(crate) fn form_factors(
    job: &Job,
    scene: &Scene,
    patches: &Patches,
    facets: &Facets,
) -> Result<(FormFactors, FormFactorsDone), Failure> {
    let started = Instant::now();
    let mut bar = Bar::new(job.quiet);
    let factors = bake::form_factors(scene, patches, facets, &job.request, &job.run, &mut |at| bar.watch(at));
    bar.clear();
    let form_factors = factors?;
    let seconds = started.elapsed().as_secs_f64();
    interrupt::check()?;
    let done = found(job, patches.len(), form_factors.nonzeros(), form_factors.row_sum_range(), seconds);
    Ok((form_factors, done))
}

/// Find the form factors for a solver, or as many of them as memory allows.
pub(crate) fn rows<'a>(
    job: &Job,
    scene: &Scene,
    patches: &'a Patches,
    facets: &'a Facets,
) -> Result<(Rows<'a>, FormFactorsDone), Failure> {
    let started = Instant::now();
    let mut bar = Bar::new(job.quiet);
    let all = bake::rows(scene, patches, facets, &job.request, &job.run, &mut |at| bar.watch(at));
    bar.clear();
    let mut rows = all?;
    interrupt::check()?;
    let mut repair = None;
    if job.request.repair {
        let (repaired, closing) = bake::repaired_rows(patches, rows, &job.run)?;
        (rows, repair) = (repaired, Some(closed(job, closing)));
    }
    let seconds = started.elapsed().as_secs_f64();
    interrupt::check()?;
    let done = FormFactorsDone {
        repair,
        ..found(job, patches.len(), rows.nonzeros(), rows.row_sum_range(), seconds)
    };
    let recomputed = rows
        .recomputed()
        .map(|recomputed| RecomputedRows { kept: recomputed.kept, needed_bytes: recomputed.need.bytes });
    Ok((rows, FormFactorsDone { recomputed, ..done }))
}

/// Of form factors that are wanted themselves: with reciprocity, and closure to the last digit.
pub(crate) fn repaired(
    job: &Job,
    patches: &Patches,
    factors: &FormFactors,
) -> Result<(ExchangeAreas, RepairDone), Failure> {
    let (areas, closing) = bake::repaired(patches, factors, &job.run)?;
    interrupt::check()?;
    Ok((areas, closed(job, closing)))
}

/// How the rows were closed; a warning where they were not.
pub(crate) fn closed(job: &Job, closing: Closing) -> RepairDone {
    if closing.after > NOT_CLOSED && !job.quiet {
        diagnostics::warning(&format!(
            "--repair: the rows do not close by any symmetric correction; the worst still lacks {:.1e}. As a rule a patch sees \
             nothing, or far too little, of what sees it: use a higher --precision or smaller patches",
            closing.after
        ));
    }
    RepairDone {
        closure_before: closing.before,
        closure_after: closing.after,
        greatest_change: closing.greatest_change,
    }
}

/// Repaired rows that are off closure by more than this are not repaired.
const NOT_CLOSED: f64 = 1e-10;

/// How `rows` rows were found.
pub(crate) fn found(
    job: &Job,
    rows: usize,
    nonzeros: usize,
    (row_sum_min, row_sum_max): (f64, f64),
    seconds: f64,
) -> FormFactorsDone {
    FormFactorsDone {
        method: job.method.clone(),
        precision: job.request.method.precision(),
        rays: job.request.method.precision().map(|precision| rows as u64 * cells(precision)),
        nonzeros,
        seconds,
        row_sum_min,
        row_sum_max,
        repair: None,
        recomputed: None,
    }
}

/// Solve for the radiosities.
pub(crate) fn solve(job: &Job, patches: &Patches, rows: &Rows<'_>) -> Result<(Solution, SolveDone), Failure> {
    let started = Instant::now();
    let mut bar = Bar::new(job.quiet);
    let found = bake::solve(patches, rows, &job.request, &mut |at| bar.watch(at));
    bar.clear();
    let solution = found?;
    let seconds = started.elapsed().as_secs_f64();
    interrupt::check()?;

    let done = solved_in(job, &solution, seconds);
    Ok((solution, done))
}

fn solved_in(job: &Job, solution: &Solution, seconds: f64) -> SolveDone {
    SolveDone {
        solver: job.solver.clone(),
        iterations: solution.iterations,
        residual: solution.history.last().copied(),
        seconds,
        history: solution.history.clone(),
    }
}

/// The answer, and what it lacks because patches send light evenly, where that is asked.
pub(crate) fn corrected(
    job: &Job,
    scene: &Scene,
    patches: &Patches,
    facets: &Facets,
    rows: &Rows<'_>,
    solution: Solution,
) -> Result<(Solution, Option<CorrectionDone>), Failure> {
    let started = Instant::now();
    let mut bar = Bar::new(job.quiet);
    let watch = &mut |at: &Progress| bar.watch(at);
    let found = bake::corrected(scene, patches, facets, rows, solution, &job.request, &job.run, watch);
    bar.clear();
    let (solution, correction) = found?;
    let seconds = started.elapsed().as_secs_f64();
    interrupt::check()?;
    Ok((solution, correction.map(|correction| CorrectionDone::new(&correction, Some(seconds)))))
}

/// By how much the radiosities may be off, where that is asked.
pub(crate) fn error(
    job: &Job,
    scene: &Scene,
    patches: &Patches,
    facets: &Facets,
    rows: &Rows<'_>,
    solution: &Solution,
) -> Result<Option<(ErrorEstimate, ErrorDone)>, Failure> {
    if !job.request.error {
        return Ok(None);
    }
    let started = Instant::now();
    let mut bar = Bar::new(job.quiet);
    let watch = &mut |at: &Progress| bar.watch(at);
    let found = bake::error(scene, patches, facets, rows, solution, &job.request, &job.run, watch);
    bar.clear();
    let error = found?;
    let seconds = started.elapsed().as_secs_f64();
    interrupt::check()?;
    let done = ErrorDone::new(&error.overall(patches, solution), error.alone, seconds);
    Ok(Some((error, done)))
}

/// What commands go on with once a scene is solved.
pub(crate) struct Solved {
    pub(crate) patches: Patches,
    pub(crate) facets: Facets,
    pub(crate) solution: Solution,
    pub(crate) error: Option<ErrorEstimate>,
}

/// Form factors, radiosities and errors; where a target is asked for, of patches that are refined for it in place of these. The
/// form factors are let go: a picture or a model can be large, and they are the largest of all.
pub(crate) fn solved(
    job: &Job,
    scene: &Scene,
    patches: Patches,
    facets: Facets,
) -> Result<(Solved, StagesDone), Failure> {
    let Some(target) = &job.target else {
        let (rows, form_factors) = rows(job, scene, &patches, &facets)?;
        let (solution, solve) = solve(job, &patches, &rows)?;
        let (solution, correction) = corrected(job, scene, &patches, &facets, &rows, solution)?;
        let (error, error_done) = error(job, scene, &patches, &facets, &rows, &solution)?.unzip();
        drop(rows);
        let solve = Some(solve);
        let done = StagesDone { form_factors, solve, correction, error: error_done, refinement: None };
        return Ok((Solved { patches, facets, solution, error }, done));
    };
    drop((patches, facets));
    let (refined, rounds) = refined::refined(job, scene, target)?;
    let form_factors = refined::form_factors_done(job, &refined, &rounds);
    let Baked { patches, facets, solution, correction, error, .. } = refined.baked;
    let solve = Some(solved_in(job, &solution, rounds.solve.as_secs_f64()));
    let correction = correction.map(|correction| CorrectionDone::new(&correction, None));
    let looks = rounds.looks.as_secs_f64();
    let told =
        |error: &ErrorEstimate| ErrorDone::new(&error.overall(&patches, &solution), error.alone, looks);
    let overall = error.as_ref().map(told);
    let refinement = Some(rounds.refinement);
    let done = StagesDone { form_factors, solve, correction, error: overall, refinement };
    Ok((Solved { patches, facets, solution, error }, done))
}

/// Cells of a hemicube: N x N on top, and N x N/2 on each of four sides.
fn cells(precision: u32) -> u64 {
    3 * u64::from(precision).pow(2)
}
