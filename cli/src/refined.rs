//! A scene refined until a target error, a line a round.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use radiosity::refine::{Refined, Refining, Round, Stop, Target};
use radiosity::scene::Scene;
use radiosity::watch::Progress;

use crate::failure::Failure;
use crate::job::Job;
use crate::numbers::{grouped, measure, percent};
use crate::progress::Bar;
use crate::report::{FormFactorsDone, RefinementDone, RoundDone};
use crate::{diagnostics, interrupt, stages};

/// What the report needs to know of a refinement besides its result.
pub(crate) struct Rounds {
    pub(crate) refinement: RefinementDone,
    /// Time that went into rows of form factors, and into the solver.
    pub(crate) form_factors: Duration,
    pub(crate) solve: Duration,
    /// Time that went into second looks, from which errors are told and taken away.
    pub(crate) looks: Duration,
}

/// Run it.
pub(crate) fn refined(job: &Job, scene: &Scene, target: &Target) -> Result<(Refined, Rounds), Failure> {
    let mut clock = Clock::new();
    let mut told = Vec::new();
    let mut since = Instant::now();
    let mut tell = |rounds: &[Round]| {
        if let Some(round) = rounds.get(told.len()) {
            let done = RoundDone::new(round, since.elapsed().as_secs_f64());
            told.push(done);
            since = Instant::now();
            if !job.quiet {
                done.tell(told.len());
            }
        }
    };
    let mut bar = Bar::new(job.quiet);
    let started = Refining::new(scene, &job.request, target, &job.run, &mut |at| clock.watch(at, &mut bar));
    bar.clear();
    let mut refining = started?;
    let stop = loop {
        interrupt::check()?;
        tell(refining.rounds());
        clock.last = Instant::now();
        let mut bar = Bar::new(job.quiet);
        let stop = refining.step(&mut |at| clock.watch(at, &mut bar));
        bar.clear();
        if let Some(stop) = stop? {
            break stop;
        }
    };
    let refined = refining.into_refined(stop);
    let reached = refined.rounds.last().map_or(0.0, |round| round.error);
    let (stopped, why) = why(stop, reached, target, job, &refined);
    if stop != Stop::Target && !job.quiet {
        diagnostics::warning(&format!("--target-error: {why}"));
    }
    let refinement = RefinementDone { target: target.error, reached, stopped, rounds: told, why };
    let Clock { form_factors, solve, looks, .. } = clock;
    Ok((refined, Rounds { refinement, form_factors, solve, looks }))
}

/// What ended it, for scripts and for people.
fn why(stop: Stop, reached: f64, target: &Target, job: &Job, refined: &Refined) -> (&'static str, String) {
    let (wanted, reached) = (percent(target.error), percent(reached));
    let missed = format!("{wanted} is not reached, the light is known to within {reached}");
    let precision = match job.request.method.precision() {
        Some(_) => "higher --precision, or --method exact",
        None => "smaller --accuracy",
    };
    match stop {
        Stop::Target => ("target", format!("{wanted} is reached, the light is known to within {reached}")),
        Stop::MostPatches => {
            let most = grouped(target.most_patches);
            (
                "most-patches",
                format!("{missed}: more than {most} patches are not allowed; raise --most-patches"),
            )
        }
        Stop::Memory => {
            ("memory", format!("{missed}: more patches do not fit into memory; raise --memory-limit"))
        }
        Stop::SmallestPatch => {
            let smallest = measure(refined.smallest_patch);
            let told = format!("{missed}: what is left to quarter would be narrower than {smallest}");
            ("smallest-patch", format!("{told}; use a smaller --smallest-patch"))
        }
        Stop::FormFactors => (
            "form-factors",
            format!("{missed}: what is left is the error of the form factors; use a {precision}"),
        ),
        Stop::Residual => (
            "residual",
            format!("{missed}: what is left is what the solver has not done; use a smaller --epsilon"),
        ),
    }
}

/// Of form factors that are all there.
pub(crate) fn form_factors_done(job: &Job, refined: &Refined, rounds: &Rounds) -> FormFactorsDone {
    let baked = &refined.baked;
    let factors = &baked.form_factors;
    let found: usize = refined.rounds.iter().map(|round| round.rows_found).sum();
    let seconds = rounds.form_factors.as_secs_f64();
    let done = stages::found(job, found, factors.nonzeros(), factors.row_sum_range(), seconds);
    let repair = baked.closing.map(|closing| stages::closed(job, closing));
    FormFactorsDone { repair, ..done }
}

/// Which stage the time went into: each moment to what is told of at its end.
struct Clock {
    last: Instant,
    form_factors: Duration,
    solve: Duration,
    looks: Duration,
}

impl Clock {
    fn new() -> Self {
        let nothing = Duration::ZERO;
        Self { last: Instant::now(), form_factors: nothing, solve: nothing, looks: nothing }
    }

    fn watch(&mut self, at: &Progress, bar: &mut Bar) -> ControlFlow<()> {
        let now = Instant::now();
        let spent = now - self.last;
        self.last = now;
        match at {
            Progress::FormFactors { .. } => self.form_factors += spent,
            Progress::Looks { .. } => self.looks += spent,
            Progress::Solve { .. } | Progress::Picture { .. } => self.solve += spent,
        }
        bar.watch(at)
    }
}
