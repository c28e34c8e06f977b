//! Estimated errors held against true ones: scenes solved by exact form factors, several times as fine, averaged back.

mod rooms;

use radiosity::bake::{Baked, Method, Request, Run, Solver, bake};
use radiosity::light::Rgb;
use radiosity::patches::Subdivision;
use radiosity::scene::{BackFaces, Scene, n3d};
use radiosity::watch::ignore;

use rooms::{cube, furnished_room, paint, plate, scene_of, sides, tilted_room};

const QUICK: Method = Method::Hemicube { precision: 50 };
const USUAL: Method = Method::Hemicube { precision: 100 };
const EXACT: Method = Method::Exact { accuracy: 1e-3 };

/// What each scene keeps by itself; `docs/error.md` has them all, and the means, which are 95 % and below 3.
const LEAST_SHARE: f64 = 0.92;
const MOST_RATIO: f64 = 3.8;

fn solved(scene: &Scene, request: Request) -> Baked {
    bake(scene, &request, &Run::default(), &mut ignore).unwrap()
}

/// The mean over each patch of `coarse` of what `finer` times as many cells along a side make of it.
fn truth(scene: &Scene, coarse: &Baked, finer: u32) -> Vec<Rgb> {
    let method = Method::Exact { accuracy: 1e-3 };
    let request = Request { subdivision: f64::from(finer).into(), method, ..Request::default() };
    let fine = solved(scene, request);
    let mut truth = vec![Rgb::BLACK; coarse.patches.len()];
    let mut area = vec![0.0; coarse.patches.len()];
    for (few, many) in coarse.patches.blocks.iter().zip(&fine.patches.blocks) {
        assert_eq!([few.columns * finer, few.rows * finer], [many.columns, many.rows]);
        for k in 0..many.columns * many.rows {
            let (column, row) = (k % many.columns / finer, k / many.columns / finer);
            let (i, j) = ((few.first + row * few.columns + column) as usize, (many.first + k) as usize);
            truth[i] += fine.solution.radiosity[j] * fine.patches.area[j];
            area[i] += fine.patches.area[j];
        }
    }
    truth.iter().zip(area).map(|(&sum, area)| sum * (1.0 / area)).collect()
}

/// The share of patches whose true error is within the estimate in every channel, and mean(estimate) / mean(true).
fn calibration(name: &str, baked: &Baked, truth: &[Rgb]) -> (f64, f64) {
    let error = baked.error.as_ref().unwrap();
    let n = truth.len();
    let (mut within, mut estimated, mut found) = (0, 0.0, 0.0);
    for (i, &true_light) in truth.iter().enumerate() {
        let off = (baked.solution.radiosity[i] - true_light).to_array().map(f64::abs);
        let told = error.radiosity[i].to_array();
        within += usize::from(off.iter().zip(told).all(|(&off, told)| off <= told));
        estimated += baked.patches.area[i] * told.iter().sum::<f64>();
        found += baked.patches.area[i] * off.iter().sum::<f64>();
    }
    let size: f64 =
        truth.iter().zip(&baked.patches.area).map(|(b, a)| a * b.to_array().iter().sum::<f64>()).sum();
    let (share, ratio) = (within as f64 / n as f64, estimated / found);
    let overall = error.overall(&baked.patches, &baked.solution);
    println!(
        "| {name} | {n} | {:.2} % | {:.2} % | {:.1} % | {ratio:.2} | {:.2} {:.2} {:.4} |",
        100.0 * found / size,
        100.0 * estimated / size,
        100.0 * share,
        100.0 * overall.discretisation,
        100.0 * overall.form_factors,
        100.0 * overall.residual,
    );
    (share, ratio)
}

fn assert_calibrated(name: &str, scene: &Scene, requests: &[(&str, Request)], finer: u32) {
    let mut known = None;
    for &(how, request) in requests {
        let baked = solved(scene, Request { error: true, ..request });
        let truth = known.get_or_insert_with(|| truth(scene, &baked, finer));
        let (share, ratio) = calibration(&format!("{name}, {how}"), &baked, truth);
        assert!(share >= LEAST_SHARE, "{name}, {how}: {share}");
        assert!((1.0..=MOST_RATIO).contains(&ratio), "{name}, {how}: {ratio}");
    }
}

fn by(method: Method) -> Request {
    Request { method, ..Request::default() }
}

fn bright_cube(cells: u32, reflectance: f64) -> Scene {
    let mut scene = cube(cells);
    paint(&mut scene, |k| (Rgb::grey(if k == 0 { 1.0 } else { 0.0 }), Rgb::grey(reflectance)));
    scene
}

fn coloured(mut scene: Scene) -> Scene {
    paint(&mut scene, |k| {
        let channel = |shift: usize| 0.1 + 0.8 * ((k * 7 + shift * 5) % 13) as f64 / 13.0;
        let lamp = Rgb::grey(if k == 1 { 10.0 } else { 0.0 });
        (lamp, Rgb::new(channel(0), channel(1), channel(2)))
    });
    scene
}

#[test]
fn tuned_on_a_cube_with_a_bright_floor() {
    let scene = bright_cube(6, 0.5);
    let requests = [("hemicube 100", by(USUAL)), ("hemicube 50", by(QUICK)), ("exact", by(EXACT))];
    assert_calibrated("cube", &scene, &requests, 4);
}

#[test]
#[ignore = "the tilted room, not tilted: for the table of docs/error.md"]
fn tuned_on_a_furnished_room() {
    let scene = coloured(furnished_room());
    let requests = [("hemicube 100", by(USUAL)), ("hemicube 50", by(QUICK)), ("exact", by(EXACT))];
    assert_calibrated("furnished", &scene, &requests, 3);
}

#[test]
fn boxes_in_a_room_with_a_lamp() {
    // No two reflectances alike, nothing where a patch begins.
    let mut surfaces = sides([0.0; 3], [3.0, 2.0, 1.5], 6, true);
    surfaces.extend(sides([0.63, 0.52, 0.41], [1.37, 1.21, 0.93], 3, false));
    surfaces.push(plate([2.9, 0.4, 0.31], [0.0, 1.1, 0.0], [-0.7, 0.0, 0.5], 4));
    surfaces.push(plate([1.2, 0.7, 1.4], [0.0, 0.6, 0.0], [0.6, 0.0, 0.0], 3));
    let mut scene = scene_of(surfaces);
    scene.back_faces = BackFaces::Black;
    paint(&mut scene, |k| {
        let rho = |shift: usize| 0.2 + 0.06 * ((k * 5 + shift * 4) % 11) as f64;
        (Rgb::grey(if k == 13 { 20.0 } else { 0.0 }), Rgb::new(rho(0), rho(1), rho(2)))
    });
    let requests = [
        ("hemicube 100", by(USUAL)),
        ("hemicube 50", by(QUICK)),
        ("exact", by(EXACT)),
        ("repair", Request { repair: true, ..by(USUAL) }),
    ];
    assert_calibrated("boxes", &scene, &requests, 3);
}

#[test]
fn a_tilted_room() {
    let requests = [
        ("progressive", Request { solver: Solver::Progressive, epsilon: 1e-3, ..by(USUAL) }),
        ("cg", Request { solver: Solver::ConjugateGradients, ..by(USUAL) }),
        ("exact", by(EXACT)),
    ];
    assert_calibrated("tilted", &coloured(tilted_room()), &requests, 3);
}

#[test]
fn a_long_bright_room() {
    let surfaces = sides([0.0; 3], [4.0, 1.0, 1.0], 8, true);
    let mut scene = scene_of(surfaces);
    paint(&mut scene, |k| (Rgb::grey(if k == 4 { 1.0 } else { 0.0 }), Rgb::new(0.8, 0.6, 0.3)));
    let requests = [("hemicube 100", by(USUAL)), ("hemicube 50", by(QUICK)), ("exact", by(EXACT))];
    assert_calibrated("long", &scene, &requests, 3);
}

#[test]
fn a_sphere_in_a_cube() {
    let walls = "
        QD 6 6  -2 -2 -2  2 -2 -2  2 2 -2  -2 2 -2  CD .5 .5 .5 CE 3 2 1 ID
        QD 6 6  -2 -2 2  -2 2 2  2 2 2  2 -2 2  CD .7 .6 .5 ID
        QD 6 6  -2 -2 -2  -2 -2 2  2 -2 2  2 -2 -2  CD .7 .3 .5 ID
        QD 6 6  -2 2 -2  2 2 -2  2 2 2  -2 2 2  CD .7 .6 .2 ID
        QD 6 6  -2 -2 -2  -2 2 -2  -2 2 2  -2 -2 2  CD .7 .6 .5 ID
        QD 6 6  2 -2 -2  2 -2 2  2 2 2  2 2 -2  CD .4 .6 .5 ID
        SP NM 16 8 CD .6 .6 .6 ID";
    let scene = n3d::parse_scene("sphere", format!("OC {walls} FI ID").as_bytes()).unwrap();
    // A finer sphere is another polyhedron, and what that changes is not estimated: fewer patches are within.
    let baked = solved(&scene, Request { error: true, ..by(USUAL) });
    let (share, ratio) = calibration("sphere, hemicube 100", &baked, &truth(&scene, &baked, 3));
    assert!(share > 0.9 && ratio < 4.2, "{share} {ratio}");
}

#[test]
#[ignore = "2,000 exact rows: for the table of docs/error.md"]
fn a_finer_cube() {
    let requests = [("hemicube 100", by(USUAL))];
    assert_calibrated("fine cube", &bright_cube(12, 0.5), &requests, 2);
    let scene = bright_cube(12, 0.5);
    let baked = solved(&scene, Request { error: true, ..by(EXACT) });
    // Told too high: the light of an empty room gets better faster than the level coarser lets one hope.
    let (share, ratio) = calibration("fine cube, exact", &baked, &truth(&scene, &baked, 2));
    assert!(share > 0.95 && ratio < 6.0, "{share} {ratio}");
}

#[test]
fn a_furnace_has_hardly_any() {
    let mut scene = furnished_room();
    paint(&mut scene, |_| (Rgb::WHITE, Rgb::grey(0.5)));
    let baked = solved(&scene, Request { error: true, ..by(USUAL) });
    let overall = baked.error.as_ref().unwrap().overall(&baked.patches, &baked.solution);
    // Every row sees the same light, whatever it sees; all surfaces emit, and so all count.
    assert!(overall.relative < 1e-4, "{overall:?}");
}

#[test]
fn stopping_early_is_told() {
    let scene = coloured(furnished_room());
    let fine = solved(&scene, Request { epsilon: 1e-9, ..by(QUICK) });
    for (solver, epsilon) in [(Solver::GaussSeidel, 1.0), (Solver::Jacobi, 1.0)] {
        let baked = solved(&scene, Request { error: true, solver, epsilon, ..by(QUICK) });
        let told = &baked.error.as_ref().unwrap().residual;
        let size = |light: &mut dyn Iterator<Item = Rgb>| light.map(|b| b.norm_squared()).sum::<f64>().sqrt();
        let (b, known) = (&baked.solution.radiosity, &fine.solution.radiosity);
        let found = size(&mut b.iter().zip(known).map(|(&b, &known)| b - known));
        let ratio = size(&mut told.iter().copied()) / found;
        assert!((1.0 / 3.0..6.0).contains(&ratio), "{solver:?}: {ratio}");
    }
}

#[test]
fn the_same_on_any_number_of_threads_and_from_recomputed_rows() {
    let scene = coloured(furnished_room());
    let request = Request { error: true, ..by(QUICK) };
    let known = solved(&scene, request);
    let little = Some(200_000);
    for run in [Run { threads: Some(1), ..Run::default() }, Run { threads: Some(3), memory_limit: little }] {
        let baked = bake(&scene, &request, &run, &mut ignore).unwrap();
        assert_eq!(baked.recomputed.is_some(), run.memory_limit.is_some());
        assert_eq!(baked.error, known.error);
    }
}

#[test]
fn meshes_split_patches_and_surroundings_have_one_too() {
    let mesh = "QD 4 4 0 0 0  4 0 0  4 4 0  0 4 0 CD .5 .5 .5 ID
        QD 1 1 1 1 2  1 2 2  2 2 2  2 1 2 CE 9 9 9 ID
        VO 1 0 0 4  1 1 0  3 1 0  2 3 0  2 2 1  3  1 2 4  2 3 4  3 1 4 CD .4 .5 .6 ID";
    let scene = n3d::parse_scene("mesh", format!("OC {mesh} FI ID").as_bytes()).unwrap();
    let surroundings = Rgb::grey(1.0);
    for (subdivision, split) in
        [(1.0.into(), None), (Subdivision::PatchSize(0.7), None), (1.0.into(), Some(true))]
    {
        for method in [QUICK, EXACT] {
            let baked =
                solved(&scene, Request { error: true, subdivision, split, surroundings, ..by(method) });
            let error = baked.error.unwrap();
            let overall = error.overall(&baked.patches, &baked.solution);
            assert!(overall.relative > 1e-4 && overall.relative < 0.5, "{overall:?}");
            assert!(error.radiosity.iter().all(|e| e.to_array().iter().all(|&e| e >= 0.0 && e.is_finite())));
        }
    }
}
