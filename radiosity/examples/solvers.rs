//! Residual against time for every solver: `cargo run --release --example solvers -- scenes/cornell.scn ...`
//!
//! First, sweeps of Gauss-Seidel in turn with plain reading of as many bytes, one thread each: the limit of the machine as
//! it is just then. Medians, in brackets the quartiles.
//!
//! Times are the processor's, so that others on the machine disturb less.
//!
//! All on the same stored rows, each on one thread. The residual is each solver's own: what its stopping test measures.
//! The error is the relative root mean square, over the area and the channels, against the same solver run on (shooting,
//! which takes long, not as far); it is taken beside the clock. A line for the first step that comes to each power of ten
//! of the residual, relative to the size of the answer.

use std::ops::ControlFlow;
use std::path::Path;

use cpu_time::ProcessTime;
use radiosity::bake::{self, Request, Run, Solver};
use radiosity::form_factors::FormFactors;
use radiosity::light::Rgb;
use radiosity::patches::Patches;
use radiosity::scene;
use radiosity::solve::GaussSeidel;
use radiosity::visibility::Facets;
use radiosity::watch::{Progress, ignore};

fn main() {
    let named: Vec<String> = std::env::args().skip(1).collect();
    let scenes = if named.is_empty() { vec!["scenes/cornell.scn".into()] } else { named };
    for name in scenes {
        let scene = scene::read(Path::new(&name)).unwrap_or_else(|error| panic!("{error}"));
        let (request, run) = (Request::default(), Run::default());
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
    // More than any cache holds, so that it comes from memory.
    let far = vec![1_u64; 256 << 17];
    let near = vec![1_u64; factors.bytes() as usize / 8];
    let mut solver = GaussSeidel::new(patches, factors);
    let (mut whole, mut changes, mut beside, mut from_memory) = (vec![], vec![], vec![], vec![]);
    for step in 0..64 {
        let sweep = timed(|| solver.step());
        if step % 8 == 0 { &mut whole } else { &mut changes }.push(sweep);
        beside.push(timed(|| sum(&near)));
        if step % 4 == 0 {
            from_memory.push(timed(|| sum(&far)) * near.len() as f64 / far.len() as f64);
        }
    }
    println!("| of {:.1} MB | ms | GB/s |\n|---|---|---|", factors.bytes() as f64 / 1e6);
    for (what, mut seconds) in [
        ("a sweep of changes", changes),
        ("a sweep of all (one of eight)", whole),
        ("reading as many bytes, again and again", beside),
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
