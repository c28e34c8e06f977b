//! Error against time, by a judge of another kind: `cargo bench --bench reference`, `... -- office` for one scene,
//! `... -- office x0.5 512` for one cut of it and so many walks a set and patch (of eight sets). One thread, processor time; backs are black.
//!
//! The judge walks at random (`tests/walks`), and knows neither form factors nor how finely the senders are cut. Its own
//! noise is told by how its sets differ, and is taken out of the errors, which without it would be without bias; they are
//! area-weighted, relative, root mean square over the channels of all patches that emit nothing. What it found is kept in
//! `target/reference`, for it takes minutes.

#[path = "../tests/walks/mod.rs"]
mod walks;

use std::fs;
use std::path::Path;
use std::time::Instant;

use cpu_time::ProcessTime;
use radiosity::bake::{self, Baked, Method, Request, Run, bake};
use radiosity::light::Rgb;
use radiosity::patches::Subdivision;
use radiosity::scene::{self, BackFaces, Scene};
use radiosity::visibility::Facets;
use radiosity::watch::ignore;
use walks::{Reference, SETS, Walks};

const RUN: Run = Run { threads: Some(1), memory_limit: None };

/// The scenes, and the cuts of each that are tried.
const SCENES: [(&str, &[f64]); 3] =
    [("cornell", &[0.35, 0.5, 0.7, 1.0, 1.5]), ("office", &[0.35, 0.5, 0.7, 1.0, 1.5]), ("gallery", &[1.0])];

/// Solutions are timed so often, and the quickest counts.
const TIMES: usize = 2;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let count = words.iter().find_map(|word| word.parse().ok()).unwrap_or(512);
    let cut = words.iter().find_map(|word| word.strip_prefix('x')?.parse::<f64>().ok());
    let any = !words.iter().any(|word| SCENES.iter().any(|(name, _)| word == name));
    let named = |scene: &str| any || words.iter().any(|word| word == scene);
    for (name, factors) in SCENES.iter().filter(|(name, _)| named(name)) {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
        let path = ["scn", "gltf"].map(|ending| folder.join(name).with_extension(ending));
        let scene = scene::read(path.iter().find(|path| path.exists()).expect("a scene")).expect("a scene");
        println!("\n| {name}: method | patches | s | error, % | ± |\n|---|---|---|---|---|");
        for &factor in factors.iter().filter(|&&factor| cut.is_none_or(|cut| cut == factor)) {
            errors(name, &scene, factor, count);
        }
    }
}

/// What is tried, by name.
fn requests() -> Vec<(String, Request)> {
    let mut all = Vec::new();
    let mut add = |name: String, method| {
        let plain = Request { method, ..Request::default() };
        all.push((name.clone(), plain));
        all.push((name.clone() + ", repair", Request { repair: true, ..plain }));
        if method.from_patch_to_patch() {
            all.push((name + ", correct", Request { correct: true, ..plain }));
        }
    };
    for precision in [50, 100, 200, 400] {
        add(format!("hemicube {precision}"), Method::Hemicube { precision });
    }
    for (precision, eyes) in [(50, 1), (100, 1), (40, 2), (60, 2), (100, 2), (90, 3)] {
        let method = Method::HemicubeExact { precision, eyes, accuracy: 1e-3 };
        add(format!("hemicube-exact {precision}, {eyes} eyes"), method);
    }
    for accuracy in [1e-2, 1e-3, 1e-4] {
        add(format!("exact {accuracy:e}"), Method::Exact { accuracy });
    }
    all
}

fn errors(name: &str, scene: &Scene, factor: f64, count: u32) {
    let asked = |request: Request| Request {
        subdivision: Subdivision::Factor(factor),
        back_faces: Some(BackFaces::Black),
        ..request
    };
    let request = asked(Request::default());
    let patches = bake::patches(scene, &request, &RUN).expect("patches");
    let facets = Facets::new(scene, &patches);
    let kept = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/reference");
    let kept = kept.join(format!("{name}-{}-{count}", patches.len()));
    let started = Instant::now();
    let reference = recalled(&kept, patches.len()).unwrap_or_else(|| {
        let reference = Walks::new(scene, &patches, &facets, BackFaces::Black).radiosities(count);
        keep(&kept, &reference);
        reference
    });
    println!(
        "| the walks: {SETS} x {count} a patch | {} | {:.0} | noise {:.2} | |",
        patches.len(),
        started.elapsed().as_secs_f64(),
        100.0 * reference.noise(&patches)
    );
    for (name, request) in requests() {
        let timed = |_| -> (f64, Baked) {
            let start = ProcessTime::now();
            let baked = bake(scene, &asked(request), &RUN, &mut ignore).expect("an answer");
            (start.elapsed().as_secs_f64(), baked)
        };
        let quickest = (0..TIMES).map(timed).min_by(|a, b| a.0.total_cmp(&b.0)).expect("once at least");
        let (seconds, baked) = quickest;
        let (error, spread) = reference.error(&patches, &baked.solution.radiosity);
        println!(
            "| {name} | {} | {seconds:.2} | {:.2} | {:.2} |",
            patches.len(),
            100.0 * error,
            100.0 * spread
        );
    }
}

fn keep(path: &Path, reference: &Reference) {
    let numbers = reference.sets.iter().flatten().flat_map(|light| light.to_array());
    let bytes: Vec<u8> = numbers.flat_map(f64::to_le_bytes).collect();
    fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
    fs::write(path, bytes).expect("a file");
}

fn recalled(path: &Path, patches: usize) -> Option<Reference> {
    let bytes = fs::read(path).ok()?;
    let numbers: Vec<f64> =
        bytes.chunks_exact(8).map(|n| f64::from_le_bytes(n.try_into().expect("eight"))).collect();
    let light: Vec<Rgb> = numbers.chunks_exact(3).map(|c| Rgb::new(c[0], c[1], c[2])).collect();
    (light.len() == SETS * patches)
        .then(|| Reference { sets: light.chunks_exact(patches).map(<[Rgb]>::to_vec).collect() })
}
