//! `radiosity validate`: what is known, and what this program makes of it, on the user's own machine.

mod cases;
mod convergence;
mod plot;

use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::ops::ControlFlow;
use std::time::Instant;

use glam::DVec3;
use radiosity::bake::{self, Baked, Method, Request, Run};
use radiosity::export;
use radiosity::form_factors::{Closing, exact};
use radiosity::patches::Subdivision;
use radiosity::scene::{BackFaces, Parallelogram, Shape, n3d};
use radiosity::visibility::Facets;
use radiosity::watch::Progress;

use crate::args::Validate;
use crate::failure::Failure;
use crate::job;
use crate::numbers::{grouped, percent};
use crate::{diagnostics, interrupt};
use cases::{Asked, Bounds, Case};

/// A method that every case is put to.
#[derive(Clone, Copy)]
enum Tried {
    /// Hemicubes of so many cells.
    Hemicube(u32),
    /// Exact form factors, to the accuracy of the case.
    Exact,
}

impl Tried {
    fn method(self, accuracy: f64) -> Method {
        match self {
            Self::Hemicube(precision) => Method::Hemicube { precision },
            Self::Exact => Method::Exact { accuracy },
        }
    }

    fn name(self, accuracy: f64) -> String {
        match self {
            Self::Hemicube(precision) => format!("hemicube {precision}"),
            Self::Exact => format!("exact, {accuracy:e}"),
        }
    }

    fn bound(self, bounds: Bounds) -> f64 {
        match self {
            Self::Hemicube(_) => bounds.hemicube,
            Self::Exact => bounds.exact,
        }
    }
}

/// To which accuracy the exact form factors of closed scenes are found.
const ACCURACY: f64 = 3e-5;

/// What a method made of a case.
struct Outcome {
    method: String,
    computed: f64,
    /// As a share of the known value.
    off: f64,
    bound: f64,
    patches: usize,
    seconds: f64,
}

impl Outcome {
    fn passes(&self) -> bool {
        self.off.abs() <= self.bound
    }
}

/// How two polygons as they are are told from patches of them.
const ONE_PAIR: &str = "one pair";

/// What is tried.
const METHODS: [Tried; 3] = [Tried::Hemicube(100), Tried::Hemicube(400), Tried::Exact];
const QUICK_METHODS: [Tried; 2] = [Tried::Hemicube(100), Tried::Exact];

/// Whether everything came out as it is known.
pub(crate) fn run(typed: &Validate) -> Result<bool, Failure> {
    if let Some(output) = &typed.output {
        job::format(output, &[("md", ())])?;
        job::writable(output, "-o")?;
        job::writable(&output.with_extension("svg"), "-o")?;
    }
    let run = Run { threads: typed.threads.map(usize::from), memory_limit: None };
    let methods = if typed.quick { &QUICK_METHODS[..] } else { &METHODS };
    let cases = cases::all(typed.quick);
    let mut outcomes = Vec::with_capacity(cases.len());
    for (number, case) in cases.iter().enumerate() {
        if !typed.quiet {
            diagnostics::plain(&format!("{} of {}: {}", number + 1, cases.len(), case.name));
        }
        let of_case = methods.iter().map(|&tried| outcome(case, tried, &run));
        let mut of_case = of_case.collect::<Result<Vec<_>, _>>()?;
        of_case.extend(one_pair(case)?);
        outcomes.push(of_case);
        interrupt::check()?;
    }

    let closed = cases::closed(typed.quick).into_iter().map(|(name, text)| laws(name, &text, methods, &run));
    let closed = closed.collect::<Result<Vec<_>, _>>()?.concat();

    let mut report = report(&cases, &outcomes) + &told_laws(&closed);
    if !typed.quick {
        if !typed.quiet {
            diagnostics::plain("error against time");
        }
        let points = convergence::points(&run)?;
        let picture = typed.output.as_ref().map(|output| output.with_extension("svg"));
        if let Some(picture) = &picture {
            export::whole_file(picture, |writer| writer.write_all(plot::svg(&points).as_bytes()))?;
        }
        let name = picture.as_ref().and_then(|picture| picture.file_name()?.to_str());
        report += &convergence::told(&points, name);
    }
    match &typed.output {
        Some(output) => export::whole_file(output, |writer| writer.write_all(report.as_bytes()))?,
        None => {
            let mut out = io::stdout().lock();
            out.write_all(report.as_bytes())?;
            out.flush()?;
        }
    }
    Ok(outcomes.iter().flatten().all(Outcome::passes) && closed.iter().all(LawsKept::passes))
}

/// Put a method to a case.
fn outcome(case: &Case, tried: Tried, run: &Run) -> Result<Outcome, Failure> {
    let scene = n3d::parse_scene(&case.name, case.scene.as_bytes())?;
    let subdivision = match case.patch_size {
        Some(size) => Subdivision::PatchSize(size),
        None => Subdivision::Factor(1.0),
    };
    let request = Request {
        subdivision,
        method: tried.method(case.bounds.accuracy),
        epsilon: 1e-9,
        back_faces: Some(BackFaces::Black),
        ..Request::default()
    };
    let started = Instant::now();
    let baked = bake::bake(&scene, &request, run, &mut { stop_asked })?;
    let seconds = started.elapsed().as_secs_f64();
    let computed = measured(&baked, case);
    let bound = tried.bound(case.bounds);
    let (method, patches) = (tried.name(case.bounds.accuracy), baked.patches.len());
    Ok(Outcome { method, computed, off: computed / case.exact - 1.0, bound, patches, seconds })
}

/// Two polygons of a case that nothing stands between, uncut and without rows in single precision.
fn one_pair(case: &Case) -> Result<Option<Outcome>, Failure> {
    let (Asked::FormFactor(from, to), Some(bound)) = (&case.asked, case.bounds.pair) else { return Ok(None) };
    let scene = n3d::parse_scene(&case.name, case.scene.as_bytes())?;
    let [from, to] = [*from, *to].map(|surface| corners(&scene.surfaces[surface].shape));
    let started = Instant::now();
    let computed = exact::between(&from, &to);
    let (method, off) = (ONE_PAIR.to_owned(), computed / case.exact - 1.0);
    let seconds = started.elapsed().as_secs_f64();
    Ok(Some(Outcome { method, computed, off, bound, patches: 2, seconds }))
}

/// The outline of a polygon, counter-clockwise seen from its front; none of what is no polygon.
fn corners(shape: &Shape) -> Vec<DVec3> {
    match shape {
        Shape::Parallelogram(Parallelogram { origin, u, v, normal, .. }) => {
            let (u, v) = if u.cross(*v).dot(*normal) < 0.0 { (*v, *u) } else { (*u, *v) };
            vec![*origin, *origin + u, *origin + u + v, *origin + v]
        }
        Shape::Polygon(polygon) => polygon.vertices.clone(),
        _ => Vec::new(),
    }
}

/// How far a row of a closed scene may be off 1. What is partly hidden adds up: a hundred such patches, each to within 1e-6.
const CLOSED: f64 = 5e-4;

/// How well a method keeps the laws in a closed scene.
#[derive(Clone, Debug)]
struct LawsKept {
    scene: &'static str,
    method: String,
    patches: usize,
    /// The most that a row's sum is off 1.
    closure: f64,
    reciprocity: f64,
    repaired: Closing,
    /// Processor seconds for all rows.
    seconds: f64,
}

impl LawsKept {
    fn passes(&self) -> bool {
        self.closure <= CLOSED && self.repaired.after <= 1e-12
    }
}

fn laws(scene: &'static str, text: &str, methods: &[Tried], run: &Run) -> Result<Vec<LawsKept>, Failure> {
    let of = |&tried: &Tried| {
        let parsed = n3d::parse_scene(scene, text.as_bytes())?;
        let request = Request {
            method: tried.method(ACCURACY),
            back_faces: Some(BackFaces::Black),
            ..Request::default()
        };
        let patches = bake::patches(&parsed, &request, run)?;
        let facets = Facets::new(&parsed, &patches);
        let started = cpu_time::ProcessTime::now();
        let factors = bake::form_factors(&parsed, &patches, &facets, &request, run, &mut { stop_asked })?;
        let seconds = started.elapsed().as_secs_f64();
        let sums = factors.rows().iter().map(|row| (1.0 - row.sum()).abs());
        let (areas, repaired) = bake::repaired(&patches, &factors, run)?;
        Ok(LawsKept {
            scene,
            method: tried.name(ACCURACY),
            patches: patches.len(),
            closure: sums.fold(0.0, f64::max),
            reciprocity: areas.imbalance(),
            repaired,
            seconds,
        })
    };
    methods.iter().map(of).collect()
}

/// Ctrl-C, between steps.
fn stop_asked(_: &Progress) -> ControlFlow<()> {
    if interrupt::requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
}

/// What was asked of a solution.
fn measured(baked: &Baked, case: &Case) -> f64 {
    let Baked { patches, form_factors, solution, .. } = baked;
    let mean = |surface: usize, of: &dyn Fn(usize) -> f64| {
        let all = patches.blocks[surface].patches();
        let area: f64 = all.clone().map(|i| patches.area[i]).sum();
        all.map(|i| patches.area[i] * of(i)).sum::<f64>() / area
    };
    match case.asked {
        Asked::FormFactor(from, to) => {
            let to = patches.blocks[to].patches();
            mean(from, &|i| {
                let factors = form_factors.row(i).iter().filter(|(j, _)| to.contains(j));
                factors.map(|(_, factor)| factor).sum()
            })
        }
        Asked::Radiosity(surface) => mean(surface, &|i| solution.radiosity[i].g),
        Asked::Irradiance(surface) => mean(surface, &|i| solution.irradiance[i].g),
        Asked::WorstRadiosity => {
            let all = solution.radiosity.iter().map(|b| b.g);
            let farther =
                |a: f64, b: f64| if (b - case.exact).abs() > (a - case.exact).abs() { b } else { a };
            all.reduce(farther).unwrap_or(f64::NAN)
        }
    }
}

/// The report, in Markdown.
fn report(cases: &[Case], outcomes: &[Vec<Outcome>]) -> String {
    let mut text = String::from("# Validation\n\nWritten by `radiosity validate`, on version ");
    let _ = writeln!(text, "{}.\n", env!("CARGO_PKG_VERSION"));
    text += "Each case is a scene whose answer is known. *Off* is the difference as a share of the known value, *bound* how far the\n\
        method may be off: flat surfaces leave exact form factors nothing but rounding, curved ones what their facets lack, and\n\
        hemicubes their cells and where they stand. Exact form factors are found to the accuracy named. *One pair* is two polygons that\n\
        nothing stands between, whole, by the integral that judges the methods, in double precision. Solutions are Gauss-Seidel to 1e-9.\n\n\
        [Howell] J. R. Howell, M. P. Mengüç, A Catalog of Radiation Heat Transfer Configuration Factors, third edition.\n\n";
    text += "| case | known | from | method | patches | computed | off | bound | |\n|---|---|---|---|---|---|---|---|---|\n";
    for (case, outcomes) in cases.iter().zip(outcomes) {
        // A bound of 1e-10 is of more digits than others.
        let digits = if case.bounds.pair.is_some() { 12 } else { 10 };
        for (first, outcome) in outcomes.iter().enumerate() {
            let Outcome { method, computed, off, bound, patches, .. } = outcome;
            let [name, known, source] = match first {
                0 => [case.name.clone(), told(case.exact, digits), case.source.to_owned()],
                _ => Default::default(),
            };
            let verdict = if outcome.passes() { "ok" } else { "**off**" };
            let _ = writeln!(
                text,
                "| {name} | {known} | {source} | {method} | {} | {} | {off:+.1e} | {bound:.0e} | {verdict} |",
                grouped(*patches),
                told(*computed, digits),
            );
        }
    }
    let off = outcomes.iter().flatten().filter(|outcome| !outcome.passes()).count();
    let seconds: f64 = outcomes.iter().flatten().map(|outcome| outcome.seconds).sum();
    let count = outcomes.iter().map(Vec::len).sum::<usize>();
    let _ = match off {
        0 => writeln!(text, "\nAll {count} within their bounds, in {seconds:.1} s."),
        n => writeln!(text, "\n**{n} of {count} beyond their bounds**, in {seconds:.1} s."),
    };
    let pairs = || outcomes.iter().flatten().filter(|outcome| outcome.method == ONE_PAIR);
    if let Some(bound) =
        pairs().map(|pair| pair.bound).reduce(f64::max).filter(|_| pairs().all(Outcome::passes))
    {
        let _ = writeln!(
            text,
            "Every one of the {} cases of two polygons that nothing stands between is within {bound:e} of the known value for one \
             pair, shared edges included.",
            pairs().count()
        );
    }
    text
}

/// The part of the report on closed scenes.
fn told_laws(closed: &[LawsKept]) -> String {
    let mut text = String::from(
        "\n## Closed scenes\n\n*Closure* is the most that a row's sum is off 1, *reciprocity* Σ |A_i F_ij - A_j F_ji| over the sum of \
         both.\n`--repair` averages both ways and then changes each as little as closes the rows.\n\n\
         | scene | method | patches | CPU seconds | closure | reciprocity | closure repaired | changed by at most | |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    for kept in closed {
        let verdict = if kept.passes() { "ok" } else { "**off**" };
        let _ = writeln!(
            text,
            "| {} | {} | {} | {:.2} | {:.1e} | {:.1e} | {:.1e} | {} | {verdict} |",
            kept.scene,
            kept.method,
            grouped(kept.patches),
            kept.seconds,
            kept.closure,
            kept.reciprocity,
            kept.repaired.after,
            percent(kept.repaired.greatest_change),
        );
    }
    text
}

/// To so many digits, but to no more than that many behind the point.
fn told(number: f64, digits: i32) -> String {
    let whole = number.abs().max(1e-9).log10().floor() as i32 + 1;
    let behind = (digits - whole).clamp(0, digits + 2) as usize;
    format!("{number:.behind$}")
}
