//! How fast each stage is: `cargo bench`, or `cargo bench -- cornell` for one scene.
//!
//! Rows are on one thread, counted in rays (cells of the hemicube) a second. A sweep of Gauss-Seidel is on
//! one thread too, counted in bytes of form factors read. `whole` is everything from the scene to its
//! radiosities at hand-in precision, on all cores.

use std::path::Path;

use divan::Bencher;
use divan::counter::{BytesCount, ItemsCount};
use radiosity::bake::{Baked, Method, Request, Run, bake};
use radiosity::form_factors::hemicube::{CellWeights, Hemicube, Scratch};
use radiosity::form_factors::{Packing, Row};
use radiosity::scene::{self, BackFaces, Camera, Scene};
use radiosity::shade::{PictureRequest, ShadedSurfaces, Shading, ToneCurve, ToneMap, frame, screen_picture};
use radiosity::simd::Level;
use radiosity::solve::{
    ConjugateGradients, DEFAULT_EPSILON, GaussSeidel, Jacobi, conjugate_gradients, gauss_seidel,
};
use radiosity::visibility::RayTree;
use radiosity::watch::ignore;

const SCENES: [&str; 3] = ["cornell", "radio5", "office"];
const PRECISION: u32 = 100;
const RAYS: usize = 3 * (PRECISION * PRECISION) as usize;

fn main() {
    divan::main();
}

fn read(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes").join(name).with_extension("scn");
    scene::read(&path).unwrap_or_else(|error| panic!("{error}"))
}

fn solved(scene: &Scene, precision: u32) -> Baked {
    let request = Request { method: Method::Hemicube { precision }, ..Request::default() };
    bake(scene, &request, &Run::default(), &mut ignore).unwrap()
}

/// Patch after patch, round and round, so that a sample holds patches of all kinds.
fn every_patch(count: usize) -> impl FnMut() -> usize {
    // A stride that shares no factor with the count visits all of them, far apart.
    let stride = (count / 3..).find(|&s| s > 0 && gcd(s, count) == 1).unwrap_or(1);
    let mut patch = 0;
    move || {
        patch = (patch + stride) % count;
        patch
    }
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[divan::bench(args = SCENES, sample_size = 64, sample_count = 60)]
fn row_by_item_buffer(bencher: Bencher<'_, '_>, name: &str) {
    let baked = solved(&read(name), 10);
    let weights = CellWeights::new(PRECISION).unwrap();
    let hemicube = Hemicube::new(&baked.patches, &baked.facets, BackFaces::Lit, weights);
    let (mut scratch, mut next) = (Scratch::default(), every_patch(baked.patches.len()));
    bencher.counter(ItemsCount::new(RAYS)).bench_local(|| hemicube.row(next(), &mut scratch));
}

/// The same with no more of the processor than each level.
#[divan::bench(args = Level::available(), consts = [0, 1, 2], sample_size = 16, sample_count = 60)]
fn row_by_level<const SCENE: usize>(bencher: Bencher<'_, '_>, level: Level) {
    let baked = solved(&read(SCENES[SCENE]), 10);
    let weights = CellWeights::new(PRECISION).unwrap();
    let hemicube = Hemicube::new(&baked.patches, &baked.facets, BackFaces::Lit, weights);
    let (mut scratch, mut next) = (Scratch::default(), every_patch(baked.patches.len()));
    bencher.counter(ItemsCount::new(RAYS)).bench_local(|| hemicube.row_at(level, next(), &mut scratch));
}

#[divan::bench(args = SCENES, sample_size = 4, sample_count = 20)]
fn row_by_rays(bencher: Bencher<'_, '_>, name: &str) {
    let baked = solved(&read(name), 10);
    let weights = CellWeights::new(PRECISION).unwrap();
    let hemicube = Hemicube::new(&baked.patches, &baked.facets, BackFaces::Lit, weights);
    let (tree, mut next) = (RayTree::new(&baked.facets), every_patch(baked.patches.len()));
    bencher.counter(ItemsCount::new(RAYS)).bench_local(|| hemicube.row_by_rays(next(), &tree));
}

#[divan::bench(args = SCENES, sample_count = 30)]
fn gauss_seidel_sweep(bencher: Bencher<'_, '_>, name: &str) {
    let baked = solved(&read(name), PRECISION);
    let bytes = baked.form_factors.bytes() as usize;
    let mut solver = GaussSeidel::new(&baked.patches, &baked.form_factors);
    bencher.counter(BytesCount::new(bytes)).bench_local(|| solver.step());
}

/// The most that a solver on one thread can hope for: as many bytes as the form factors have, read and added up.
#[divan::bench(args = SCENES, sample_count = 30)]
fn gauss_seidel_limit_read(bencher: Bencher<'_, '_>, name: &str) {
    let bytes = solved(&read(name), PRECISION).form_factors.bytes() as usize;
    let numbers = vec![1_u64; bytes / 8];
    bencher.counter(BytesCount::new(bytes)).bench_local(|| {
        let (blocks, rest) = numbers.as_chunks::<32>();
        let mut sums = [0_u64; 32];
        for block in blocks {
            for (sum, number) in sums.iter_mut().zip(block) {
                *sum = sum.wrapping_add(*number);
            }
        }
        sums.iter().chain(rest).fold(0_u64, |a, b| a.wrapping_add(*b))
    });
}

#[divan::bench(args = SCENES, sample_count = 30)]
fn jacobi_step(bencher: Bencher<'_, '_>, name: &str) {
    let baked = solved(&read(name), PRECISION);
    let bytes = baked.form_factors.bytes() as usize;
    let mut solver = Jacobi::new(&baked.patches, &baked.form_factors);
    bencher.counter(BytesCount::new(bytes)).bench_local(|| solver.step(&mut ignore).unwrap());
}

#[divan::bench(args = SCENES, sample_count = 30)]
fn conjugate_gradients_step(bencher: Bencher<'_, '_>, name: &str) {
    let baked = solved(&read(name), PRECISION);
    let bytes = baked.form_factors.bytes() as usize;
    let mut solver = ConjugateGradients::new(&baked.patches, &baked.form_factors, &mut ignore).unwrap();
    bencher.counter(BytesCount::new(bytes)).bench_local(|| solver.step(&mut ignore).unwrap());
}

/// From the form factors to the answer, scaling them to closure included.
#[divan::bench(args = SCENES, sample_size = 1, sample_count = 10)]
fn conjugate_gradients_solve(bencher: Bencher<'_, '_>, name: &str) {
    let baked = solved(&read(name), PRECISION);
    bencher.bench_local(|| {
        conjugate_gradients(&baked.patches, &baked.form_factors, DEFAULT_EPSILON, &mut ignore).unwrap()
    });
}

#[divan::bench(args = SCENES, sample_size = 1, sample_count = 10)]
fn gauss_seidel_solve(bencher: Bencher<'_, '_>, name: &str) {
    let baked = solved(&read(name), PRECISION);
    bencher.bench_local(|| {
        gauss_seidel(&baked.patches, &baked.form_factors, DEFAULT_EPSILON, &mut ignore).unwrap()
    });
}

/// A dense row of the scene's size, a third of it seen, made sparse.
#[divan::bench(args = SCENES, sample_size = 64, sample_count = 60)]
fn row_packed(bencher: Bencher<'_, '_>, name: &str) {
    let baked = solved(&read(name), 10);
    let dense: Vec<f64> = (0..baked.patches.len()).map(|j| if j / 7 % 3 == 0 { 1e-3 } else { 0.0 }).collect();
    let (mut full, mut packing) = (dense.clone(), Packing::default());
    bencher.counter(ItemsCount::new(dense.len())).bench_local(|| {
        // It comes back black.
        full.copy_from_slice(&dense);
        Row::take_dense(&mut full, &mut packing)
    });
}

#[divan::bench(args = SCENES, sample_size = 1, sample_count = 5)]
fn whole(bencher: Bencher<'_, '_>, name: &str) {
    let scene = read(name);
    bencher.bench_local(|| solved(&scene, PRECISION));
}

#[divan::bench(args = SCENES, sample_size = 1, sample_count = 10)]
fn picture_800x600(bencher: Bencher<'_, '_>, name: &str) {
    let scene = read(name);
    let baked = solved(&scene, 10);
    let camera: Camera = scene.camera.unwrap_or_else(|| frame(&scene));
    let light = &baked.solution.radiosity;
    let tone = ToneMap { exposure: 0.0, curve: ToneCurve::default() };
    bencher.bench_local(|| {
        let surfaces = ShadedSurfaces::new(&scene, &baked.patches, &baked.facets, light, Shading::Smooth);
        screen_picture(&surfaces, &camera, &PictureRequest::default(), tone).unwrap()
    });
}
