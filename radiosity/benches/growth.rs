//! How cost grows with the number of patches: `cargo bench --bench growth`, `... -- office 32000` for one scene and a
//! greatest number of patches (8,000 unless told), `... -- hidden` for how it grows with what is not seen.
//!
//! Each scene is cut finer and finer, and each stage timed on one thread, in processor time, so that others on the
//! machine disturb less: rows at hand-in precision, the solve to 1e-6, a picture of 800 x 600. Medians, in brackets the
//! least and the most. An exponent is the slope of log(cost) over log(patches), fitted to all sizes.

use std::fmt::Write;
use std::path::Path;

use cpu_time::ProcessTime;
use glam::DVec3;
use radiosity::bake::{self, Request, Run};
use radiosity::form_factors::Row;
use radiosity::form_factors::hemicube::{CellWeights, Hemicube, Scratch};
use radiosity::patches;
use radiosity::scene::{self, Mesh, Scene, Shape, Surface};
use radiosity::shade::{PictureRequest, ShadedSurfaces, Shading, ToneCurve, ToneMap, frame, screen_picture};
use radiosity::visibility::Facets;
use radiosity::watch::ignore;

const SCENES: [&str; 2] = ["cornell", "office"];
const SIZES: [u64; 7] = [500, 1000, 2000, 4000, 8000, 16_000, 32_000];

/// A stage is run again until it has taken this many seconds, and three times at least, unless once takes so long.
const LONG_ENOUGH: f64 = 1.0;
const TOO_LONG: f64 = 10.0;

const STAGES: [&str; 4] = ["rows, s", "rows, bytes", "solve, s", "picture, s"];

fn main() {
    // Cargo adds flags of its own.
    let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let most = words.iter().find_map(|word| word.parse().ok()).unwrap_or(8000);
    let named = |scene: &&&str| words.iter().any(|word| word == **scene);
    let mut chosen: Vec<_> = SCENES.iter().filter(named).collect();
    if chosen.is_empty() {
        chosen = SCENES.iter().collect();
    }
    if words.iter().any(|word| word == "hidden") || chosen.len() == SCENES.len() {
        hidden();
    }
    if words.iter().any(|word| word == "hidden") {
        return;
    }
    // Pictures are drawn in parallel; everything is on one thread here.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    for name in chosen {
        println!("\n| {name}: patches | entries a row | sweeps | {} |", STAGES.join(" | "));
        println!("|---|---|---|{}", "---|".repeat(STAGES.len()));
        let scene = read(name);
        let mut costs: Vec<(f64, [f64; 4])> = Vec::new();
        for size in SIZES.into_iter().filter(|&size| size <= most) {
            let subdivision = subdivision_for(&scene, size);
            let count = patches::count(&scene, subdivision).expect("a positive factor") as f64;
            // Where most patches are triangles of the scene itself, it cannot be cut as coarsely as that.
            if costs.last().is_none_or(|(before, _)| count > 1.2 * before) {
                costs.push((count, pool.install(|| costs_of(&scene, subdivision))));
            }
        }
        let mut line = "| exponent | | |".to_owned();
        for stage in 0..STAGES.len() {
            let points = costs.iter().map(|(count, cost)| (count.ln(), cost[stage].ln()));
            write!(line, " {:.2} |", slope(&points.collect::<Vec<_>>())).expect("a string takes all");
        }
        println!("{line}");
    }
}

/// How a row's cost grows with what it does not see: a crowd of triangles behind the walls of the Cornell box, in the space
/// that each of the 2,140 patches looks out on.
fn hidden() {
    println!("\n| triangles behind the walls | a row, us | of an empty one's |\n|---|---|---|");
    let mut empty = None;
    for count in [0, 1_000, 10_000, 100_000] {
        let mut scene = read("cornell");
        let room: Vec<DVec3> = scene.surfaces.iter().flat_map(|surface| surface.shape.vertices()).collect();
        let low = room.iter().fold(DVec3::INFINITY, |low, &p| low.min(p));
        let high = room.iter().fold(DVec3::NEG_INFINITY, |high, &p| high.max(p));
        // Fractions of multiples of the golden ratio's kin: spread evenly, and the same each time.
        let spread = |k: usize| DVec3::new(0.819_172_5, 0.671_043_6, 0.549_700_5) * k as f64;
        let corner = |k: usize| {
            let at = (spread(k) - spread(k).floor()) * (high - low);
            // Below the floor, and beyond the back wall.
            low + at - if k.is_multiple_of(2) { DVec3::Y } else { DVec3::NEG_Z } * (high - low) * 1.01
        };
        let vertices =
            (1..=count).flat_map(|k| [corner(k), corner(k) + DVec3::X * 9.0, corner(k) + DVec3::Y * 9.0]);
        let mesh = Mesh {
            vertices: vertices.collect(),
            triangles: (0..count as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect(),
            ..Mesh::default()
        };
        let seen = patches::count(&scene, 1.0).expect("a positive factor") as usize;
        let crowd = Surface { shape: Shape::Mesh(mesh), ..scene.surfaces[0].clone() };
        if count > 0 {
            scene.surfaces.push(crowd);
        }
        let patches = patches::subdivide(&scene, 1.0).expect("patches");
        let facets = Facets::new(&scene, &patches);
        let weights = CellWeights::new(100).expect("a precision");
        let hemicube = Hemicube::new(&patches, &facets, scene.back_faces, weights);
        let mut scratch = Scratch::default();
        let (_, times) =
            timed(|| (0..seen).step_by(7).map(|i| hemicube.row(i, &mut scratch).len()).sum::<usize>());
        let row = times.median / seen.div_ceil(7) as f64 * 1e6;
        let empty = *empty.get_or_insert(row);
        println!("| {count} | {row:.0} | {:.2} |", row / empty);
    }
}

fn read(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes").join(name).with_extension("scn");
    scene::read(&path).unwrap_or_else(|error| panic!("{error}"))
}

/// The subdivision that comes nearest to so many patches.
fn subdivision_for(scene: &Scene, wanted: u64) -> f64 {
    let count = |factor| patches::count(scene, factor).expect("a positive factor");
    let (mut low, mut high) = (1e-3, 1e3);
    for _ in 0..50 {
        let middle = f64::sqrt(low * high);
        (low, high) = if count(middle) < wanted { (middle, high) } else { (low, middle) };
    }
    if count(high) - wanted < wanted.abs_diff(count(low)) { high } else { low }
}

/// What each of [`STAGES`] costs; prints the line.
fn costs_of(scene: &Scene, subdivision: f64) -> [f64; 4] {
    let (request, run) = (
        Request { subdivision: subdivision.into(), ..Request::default() },
        Run { threads: Some(1), ..Run::default() },
    );
    let patches = bake::patches(scene, &request, &run).expect("patches");
    let facets = Facets::new(scene, &patches);
    let (factors, rows) =
        timed(|| bake::form_factors(scene, &patches, &facets, &request, &run, &mut ignore).expect("rows"));
    let (solution, solve) =
        timed(|| bake::solve(&patches, &factors, &request, &mut ignore).expect("a solution"));
    let camera = scene.camera.unwrap_or_else(|| frame(scene));
    let tone = ToneMap { exposure: 0.0, curve: ToneCurve::default() };
    let (_, picture) = timed(|| {
        let surfaces = ShadedSurfaces::new(scene, &patches, &facets, &solution.radiosity, Shading::Smooth);
        screen_picture(&surfaces, &camera, &PictureRequest::default(), tone).expect("a picture")
    });
    let entries = factors.nonzeros();
    let bytes = factors.rows().iter().map(Row::bytes).sum::<u64>() as f64;
    let (count, sweeps) = (patches.len(), solution.iterations);
    println!(
        "| {count} | {} | {sweeps} | {} | {:.1} MB | {} | {} |",
        entries / count,
        rows.show(),
        bytes / 1e6,
        solve.show(),
        picture.show()
    );
    [rows.median, bytes, solve.median, picture.median]
}

/// Seconds: the median of several runs, and how far they spread.
struct Times {
    least: f64,
    median: f64,
    most: f64,
}

impl Times {
    fn show(&self) -> String {
        format!("{:.3} ({:.3}-{:.3})", self.median, self.least, self.most)
    }
}

fn timed<T>(mut work: impl FnMut() -> T) -> (T, Times) {
    let mut times = Vec::new();
    loop {
        let start = ProcessTime::now();
        let answer = work();
        times.push(start.elapsed().as_secs_f64());
        let sum: f64 = times.iter().sum();
        if sum >= TOO_LONG || (sum >= LONG_ENOUGH && times.len() >= 3) {
            times.sort_by(f64::total_cmp);
            let (least, most) = (times[0], times[times.len() - 1]);
            return (answer, Times { least, median: times[times.len() / 2], most });
        }
    }
}

/// Of the straight line through points, by least squares.
fn slope(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let (x, y) =
        (points.iter().map(|p| p.0).sum::<f64>() / count, points.iter().map(|p| p.1).sum::<f64>() / count);
    let above = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>();
    above / points.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>()
}
