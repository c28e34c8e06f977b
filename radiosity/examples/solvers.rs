//! Residual against time for every solver: `cargo run --release --example solvers -- scenes/cornell.scn ...`
//!
//! All on the same stored rows, each on one thread. The residual is each solver's own: what its stopping test measures.
//! The error is the relative root mean square, over the area and the channels, against the same solver run on (shooting, which
//! takes long, not as far); it is taken beside the clock. A line for the first step that comes to each power of ten of the residual, relative to the
//! size of the answer.

use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use radiosity::bake::{self, Request, Run, Solver};
use radiosity::light::Rgb;
use radiosity::scene;
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
        let started = Instant::now();
        let factors = bake::form_factors(&scene, &patches, &facets, &request, &run, &mut ignore);
        let factors = factors.expect("form factors");
        let (n, seconds) = (patches.len(), started.elapsed().as_secs_f64());
        println!("{name}: {n} patches, {} form factors in {seconds:.2} s", factors.nonzeros());
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
            println!("  {called:12}  {:>8} {:>10} {:>10} {:>10}", "steps", "ms", "residual", "error");
            for digits in 1..=digits {
                let started = Instant::now();
                let solution = solve(size * 10_f64.powi(-digits), &mut ignore);
                let milliseconds = started.elapsed().as_secs_f64() * 1e3;
                let off = |b: &[Rgb]| {
                    let off = (0..n).map(|i| patches.area[i] * (b[i] - exact[i]).norm_squared()).sum::<f64>();
                    (off / (0..n).map(|i| patches.area[i] * exact[i].norm_squared()).sum::<f64>()).sqrt()
                };
                let residual = solution.history.last().copied().unwrap_or(f64::NAN) / size;
                let (steps, error) = (solution.iterations, off(&solution.radiosity));
                println!("  {:12}  {steps:>8} {milliseconds:>10.2} {residual:>10.1e} {error:>10.1e}", "");
            }
        }
    }
}
