//! How exact `--method exact` is, and what it takes: `cargo bench --bench exact`, two or three minutes of one thread.
//! Processor time. `-- times 5` times form factors alone, so often, and tells a digest of their bits: what two builds
//! are compared by (`-- times 5 office 1e-3`: one room, to that accuracy).
//!
//! First closed rooms, whose rows sum to 1. Then the error of radiosities: area-weighted, relative, root mean square
//! over the channels of all patches that emit nothing, against a finer cut of the same scene, whose patches are
//! averaged over those that hold their centres. The reference is of exact form factors itself: that it has converged
//! no line shows, and the last ones of a table, which are nearest to it, flatter the method.

#[path = "../tests/rooms/mod.rs"]
mod rooms;

use std::hash::{DefaultHasher, Hasher};
use std::path::Path;

use cpu_time::ProcessTime;
use radiosity::bake::{self, Baked, Method, Request, Run, bake};
use radiosity::light::Rgb;
use radiosity::patches::Subdivision;
use radiosity::scene::{self, BackFaces, Scene};
use radiosity::visibility::{Facet, FacetShape, Facets};
use radiosity::watch::ignore;

const RUN: Run = Run { threads: Some(1), memory_limit: None };

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    if words.first().is_some_and(|word| word == "times") {
        let number = words.get(1).and_then(|times| times.parse().ok());
        let accuracy = words.get(3).and_then(|accuracy| accuracy.parse().ok());
        times(number.unwrap_or(5), words.get(2).map(String::as_str), accuracy);
        return;
    }
    println!("| room | patches | accuracy | s | rows below 1 by | above by |\n|---|---|---|---|---|---|");
    rows("empty cube", &rooms::cube(16), 1e-3);
    let mut with_box = rooms::cube(8);
    with_box.surfaces.extend(rooms::sides([0.3; 3], [0.6; 3], 4, false));
    for accuracy in [1e-3, 1e-4, 5e-5, 2e-5] {
        rows("cube with a box", &with_box, accuracy);
    }
    // Factors that nest: halves and doubles of the author's n and m.
    errors("cornell", 2.0, &[0.5, 1.0]);
    errors("office", 1.0, &[0.5]);
}

fn request(subdivision: f64, method: Method) -> Request {
    let back_faces = Some(BackFaces::Black);
    Request { subdivision: Subdivision::Factor(subdivision), method, back_faces, ..Request::default() }
}

fn rows(name: &str, scene: &Scene, accuracy: f64) {
    let request = request(1.0, Method::Exact { accuracy });
    let patches = bake::patches(scene, &request, &RUN).expect("patches");
    let facets = Facets::new(scene, &patches);
    let start = ProcessTime::now();
    let found = bake::form_factors(scene, &patches, &facets, &request, &RUN, &mut ignore).expect("rows");
    let seconds = start.elapsed().as_secs_f64();
    let (low, high) = found.row_sum_range();
    let (below, above) = (1.0 - low, high - 1.0);
    println!("| {name} | {} | {accuracy:e} | {seconds:.3} | {below:.1e} | {above:.1e} |", patches.len());
}

/// Of each room, or of the one named to another accuracy: seconds of each time, in order.
fn times(number: usize, only: Option<&str>, other: Option<f64>) {
    let mut with_box = rooms::cube(8);
    with_box.surfaces.extend(rooms::sides([0.3; 3], [0.6; 3], 4, false));
    let black = Some(BackFaces::Black);
    let scenes = [
        ("cube", rooms::cube(16), 1.0, 1e-3, black),
        ("box", with_box, 1.0, 1e-4, black),
        ("cornell", read("cornell"), 0.5, 1e-2, black),
        ("office", read("office"), 0.5, 1e-2, black),
        ("radio6", read("radio6"), 1.0, 1e-2, None),
    ];
    println!("| room | patches | form factors | digest | s, median | all |\n|---|---|---|---|---|---|");
    for (name, scene, factor, accuracy, back_faces) in scenes {
        if only.is_some_and(|only| only != name) {
            continue;
        }
        let method = Method::Exact { accuracy: other.unwrap_or(accuracy) };
        let request = Request { back_faces, ..request(factor, method) };
        let patches = bake::patches(&scene, &request, &RUN).expect("patches");
        let facets = Facets::new(&scene, &patches);
        let mut seconds = Vec::new();
        let (mut digest, mut nonzeros) = (0, 0);
        for _ in 0..number {
            let start = ProcessTime::now();
            let found = bake::form_factors(&scene, &patches, &facets, &request, &RUN, &mut ignore);
            let found = found.expect("rows");
            seconds.push(start.elapsed().as_secs_f64());
            let mut hasher = DefaultHasher::new();
            for (column, factor) in found.rows().iter().flat_map(radiosity::form_factors::Row::iter) {
                hasher.write_usize(column);
                hasher.write_u64(factor.to_bits());
            }
            (digest, nonzeros) = (hasher.finish(), found.nonzeros());
        }
        seconds.sort_by(f64::total_cmp);
        let all: Vec<String> = seconds.iter().map(|seconds| format!("{seconds:.4}")).collect();
        let (count, median) = (patches.len(), seconds[seconds.len() / 2]);
        println!("| {name} | {count} | {nonzeros} | {digest:016x} | {median:.4} | {} |", all.join(" "));
    }
}

fn read(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes").join(name).with_extension("scn");
    scene::read(&path).expect("a scene")
}

fn solved(scene: &Scene, subdivision: f64, method: Method) -> (Baked, f64) {
    let start = ProcessTime::now();
    let baked = bake(scene, &request(subdivision, method), &RUN, &mut ignore).expect("an answer");
    (baked, start.elapsed().as_secs_f64())
}

fn errors(name: &str, finest: f64, factors: &[f64]) {
    let scene = read(name);
    let exact = |accuracy: f64| Method::Exact { accuracy };
    let (reference, seconds) = solved(&scene, finest, exact(1e-3));
    let count = reference.patches.len();
    println!(
        "\n| {name}, against {count} patches in {seconds:.0} s | patches | s | error, % |\n|---|---|---|---|"
    );
    for &factor in factors {
        let methods = [100, 400].map(|precision| Method::Hemicube { precision });
        for method in methods.into_iter().chain([1e-2, 3e-3, 1e-3, 3e-4].map(exact)) {
            let (baked, seconds) = solved(&scene, factor, method);
            let error = 100.0 * error(&baked, &reference);
            println!("| {method:?} | {} | {seconds:.2} | {error:.2} |", baked.patches.len());
        }
    }
}

fn error(baked: &Baked, reference: &Baked) -> f64 {
    let (patches, finer) = (&baked.patches, &reference.patches);
    let mut sums = vec![(Rgb::BLACK, 0.0); patches.len()];
    for j in 0..finer.len() {
        let centre = finer.centre[j];
        let inside = |facet: &Facet| {
            let (u, v) = facet.uv(centre);
            let reach = if facet.shape == FacetShape::Triangle { u + v } else { u.max(v) };
            (u.min(v) >= -1e-9 && reach <= 1.0 + 1e-9).then(|| facet.patch_at(u, v))
        };
        let mut of_surface = baked.facets.of_surface(finer.surface[j]);
        if let Some(patch) = of_surface.find_map(|number| inside(&baked.facets[number])) {
            let (sum, area) = &mut sums[patch as usize];
            *sum += reference.solution.radiosity[j] * finer.area[j];
            *area += finer.area[j];
        }
    }
    let (mut off, mut all) = (0.0, 0.0);
    for (i, (sum, area)) in sums.into_iter().enumerate() {
        if area == 0.0 || !patches.emission[i].is_black() {
            continue;
        }
        let answer = sum * (1.0 / area);
        for (found, answer) in baked.solution.radiosity[i].to_array().into_iter().zip(answer.to_array()) {
            off += area * (found - answer).powi(2);
            all += area * answer * answer;
        }
    }
    (off / all).sqrt()
}
