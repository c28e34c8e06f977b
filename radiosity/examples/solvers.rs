//! Residual against time for every solver: `cargo run --release --example solvers -- scenes/cornell.scn ...`
//!
//! First, sweeps of Gauss-Seidel and plain reading of as many bytes, one thread each: the limit of the machine as it is just
//! then. Both as it comes when they follow one another, and after the caches were emptied. Medians, in brackets the quartiles.
//!
//! Times are the processor's, so that others on the machine disturb less.
//!
//! All on the same stored rows, each on one thread. The residual is each solver's own: what its stopping test measures.
//! The error is the relative root mean square, over the area and the channels, against the same solver run on (shooting,
//! which takes long, not as far); it is taken beside the clock. A line for the first step that comes to each power of ten
//! of the residual, relative to the size of the answer.
//!
//! `cargo run --release --example solvers -- threads scenes/cornell.scn 1 2 2.85`: passes over the rows on one thread and on
//! all, in turn, of a scene whose n and m are taken times each of the numbers. Wall time: the best, in brackets the median.

use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use cpu_time::ProcessTime;
use radiosity::bake::{self, Request, Run, Solver};
use radiosity::form_factors::{FormFactors, GreyBlocks, LightBlocks, Passes};
use radiosity::light::Rgb;
use radiosity::patches::{Patches, Subdivision};
use radiosity::scene;
use radiosity::solve::GaussSeidel;
use radiosity::visibility::Facets;
use radiosity::watch::{Progress, ignore};

fn main() {
    let named: Vec<String> = std::env::args().skip(1).collect();
    if let [first, scene, factors @ ..] = &named[..]
        && first == "threads"
    {
        for factor in factors {
            on_threads(scene, factor.parse().expect("what n and m are taken times"));
        }
        return;
    }
    let scenes = if named.is_empty() { vec!["scenes/cornell.scn".into()] } else { named };
    for name in scenes {
        let scene = scene::read(Path::new(&name)).unwrap_or_else(|error| panic!("{error}"));
        let (request, run) = (Request::default(), Run { threads: Some(1), ..Run::default() });
        let patches = bake::patches(&scene, &request, &run).expect("patches");
        let facets = Facets::new(&scene, &patches);
        let started = ProcessTime::now();
        let factors = bake::form_factors(&scene, &patches, &facets, &request, &run, &mut ignore);
        let factors = factors.expect("form factors");
        let (n, seconds) = (patches.len(), started.elapsed().as_secs_f64());
        println!(
            "\n{name}: {n} patches, {} form factors in {seconds:.2} s of processor time\n",
            factors.nonzeros()
        );
        sweeps_beside_reading(&patches, &factors);
        println!("\n| solver | steps | ms | residual | error |\n|---|---|---|---|---|");
        for (solver, called) in [
            (Solver::GaussSeidel, "gauss-seidel"),
            (Solver::ConjugateGradients, "cg"),
            (Solver::Jacobi, "jacobi"),
            (Solver::Progressive, "progressive"),
        ] {
            let solve = |epsilon: f64, watch: &mut dyn FnMut(&Progress) -> ControlFlow<()>| {
                let request = Request { solver, epsilon, ..request };
                bake::solve(&patches, &factors, &request, watch).expect("it converges")
            };
            let digits = if solver == Solver::Progressive { 3 } else { 7 };
            let rough = solve(f64::MAX, &mut ignore).radiosity;
            let size_of = |light: &[Rgb]| light.iter().map(|b| b.norm_squared()).sum::<f64>().sqrt();
            let exact = solve(size_of(&rough) * 10_f64.powi(-digits - 2), &mut ignore).radiosity;
            let size = size_of(&exact);
            for digits in 1..=digits {
                let started = ProcessTime::now();
                let solution = solve(size * 10_f64.powi(-digits), &mut ignore);
                let milliseconds = started.elapsed().as_secs_f64() * 1e3;
                let off = |b: &[Rgb]| {
                    let off = (0..n).map(|i| patches.area[i] * (b[i] - exact[i]).norm_squared()).sum::<f64>();
                    (off / (0..n).map(|i| patches.area[i] * exact[i].norm_squared()).sum::<f64>()).sqrt()
                };
                let residual = solution.history.last().copied().unwrap_or(f64::NAN) / size;
                let (steps, error) = (solution.iterations, off(&solution.radiosity));
                println!("| {called} | {steps} | {milliseconds:.2} | {residual:.1e} | {error:.1e} |");
            }
        }
    }
}

/// What a sweep takes, and what it takes to read as much memory.
fn sweeps_beside_reading(patches: &Patches, factors: &FormFactors) {
    // More than any cache holds, so that it comes from memory, and nothing else is left in the caches.
    let far = vec![1_u64; 256 << 17];
    let near = vec![1_u64; factors.bytes() as usize / 8];
    let mut solver = GaussSeidel::new(patches, factors);
    let [mut whole, mut changes, mut whole_far, mut changes_far, mut again, mut from_memory] =
        [const { Vec::new() }; 6];
    for step in 0..160 {
        let emptied = step % 32 < 16;
        if emptied {
            std::hint::black_box(sum(&far));
        }
        let sweep = timed(|| solver.step());
        match (step % 8 == 0, emptied) {
            (true, false) => whole.push(sweep),
            (false, false) => changes.push(sweep),
            (true, true) => whole_far.push(sweep),
            (false, true) => changes_far.push(sweep),
        }
    }
    for step in 0..160 {
        let emptied = step % 32 < 16;
        if emptied {
            std::hint::black_box(sum(&far));
        }
        if emptied { &mut from_memory } else { &mut again }.push(timed(|| sum(&near)));
    }
    println!("| of {:.1} MB | ms | GB/s |\n|---|---|---|", factors.bytes() as f64 / 1e6);
    for (what, mut seconds) in [
        ("a sweep of changes, one after another", changes),
        ("a sweep of all (one of eight)", whole),
        ("reading as many bytes, again and again", again),
        ("a sweep of changes, from memory", changes_far),
        ("a sweep of all, from memory", whole_far),
        ("reading as many from memory", from_memory),
    ] {
        seconds.sort_by(f64::total_cmp);
        let [low, median, high] = [1, 2, 3].map(|quarter| seconds[seconds.len() * quarter / 4]);
        let rate = |seconds: f64| factors.bytes() as f64 / seconds / 1e9;
        let (ms, gb) = ([low, median, high].map(|s| s * 1e3), [high, median, low].map(rate));
        println!(
            "| {what} | {:.2} ({:.2}-{:.2}) | {:.1} ({:.1}-{:.1}) |",
            ms[1], ms[0], ms[2], gb[1], gb[0], gb[2]
        );
    }
}

/// What each kind of pass takes on one thread and on all.
fn on_threads(name: &str, factor: f64) {
    let scene = scene::read(Path::new(name)).unwrap_or_else(|error| panic!("{error}"));
    let request = Request { subdivision: Subdivision::Factor(factor), ..Request::default() };
    let run = Run::default();
    let patches = bake::patches(&scene, &request, &run).expect("patches");
    let facets = Facets::new(&scene, &patches);
    let all =
        bake::form_factors(&scene, &patches, &facets, &request, &run, &mut ignore).expect("form factors");
    println!("\n{name}: {} patches, {:.1} MB", patches.len(), all.bytes() as f64 / 1e6);
    let of = [all.clone().on_threads(1), all];
    let light: LightBlocks = patches.reflectance.iter().copied().collect();
    let grey = GreyBlocks::new(&patches.area);
    let (power, grey_power) = (vec![[1.0; 3]; patches.len()], vec![[1.0]; patches.len()]);
    let mut taken = [const { [Vec::new(), Vec::new()] }; 5];
    for _ in 0..9 {
        for (rows, on) in of.iter().zip(0..) {
            let mut solver = GaussSeidel::new(&patches, rows);
            let mut took = |what: usize, work: &mut dyn FnMut()| {
                let started = Instant::now();
                work();
                taken[what][on].push(started.elapsed().as_secs_f64());
            };
            for step in 0..8 {
                took(usize::from(step == 0), &mut || {
                    std::hint::black_box(solver.step());
                });
            }
            for _ in 0..3 {
                took(2, &mut || drop(std::hint::black_box(rows.gather(&mut ignore, &light))));
                took(3, &mut || {
                    drop(std::hint::black_box(rows.gather_and_scatter(&mut ignore, &light, &power)))
                });
                took(4, &mut || {
                    drop(std::hint::black_box(rows.gather_and_scatter(&mut ignore, &grey, &grey_power)));
                });
            }
        }
    }
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    println!("| pass | one thread, ms | {threads} threads, ms | |\n|---|---|---|---|");
    let names = [
        "Gauss-Seidel, changes",
        "Gauss-Seidel, all",
        "Jacobi, irradiance",
        "conjugate gradients",
        "its scaling",
    ];
    for (name, taken) in names.into_iter().zip(&mut taken) {
        let [one, all] = taken.each_mut().map(|seconds| {
            seconds.sort_by(f64::total_cmp);
            [seconds[0] * 1e3, seconds[seconds.len() / 2] * 1e3]
        });
        println!(
            "| {name} | {:.2} ({:.2}) | {:.2} ({:.2}) | {:.1} times |",
            one[0],
            one[1],
            all[0],
            all[1],
            one[0] / all[0]
        );
    }
}

fn timed<T>(work: impl FnOnce() -> T) -> f64 {
    let started = ProcessTime::now();
    std::hint::black_box(work());
    started.elapsed().as_secs_f64()
}

/// Read all of it.
fn sum(numbers: &[u64]) -> u64 {
    let (blocks, rest) = numbers.as_chunks::<32>();
    let mut sums = [0_u64; 32];
    for block in blocks {
        for (sum, number) in sums.iter_mut().zip(block) {
            *sum = sum.wrapping_add(*number);
        }
    }
    sums.iter().chain(rest).fold(0, |a, b| a.wrapping_add(*b))
}
