//! Closure, reciprocity and energy: how well they are kept, and how they are restored.

mod rooms;

use proptest::prelude::*;
use radiosity::bake::{self, Method, Request, Run, Solver, bake};
use radiosity::check::{Energy, Laws};
use radiosity::form_factors::{Elsewhere, ExchangeAreas, FormFactors, Row};
use radiosity::light::Rgb;
use radiosity::patches::Patches;
use radiosity::scene::{BackFaces, Scene};
use radiosity::visibility::Facets;
use radiosity::watch::ignore;

use rooms::{furnished_room, paint, plate, scene_of, sides};

const SOLVERS: [Solver; 4] =
    [Solver::GaussSeidel, Solver::Progressive, Solver::ConjugateGradients, Solver::Jacobi];

fn factors_of(scene: &Scene, request: &Request) -> (Patches, FormFactors) {
    let run = Run::default();
    let patches = bake::patches(scene, request, &run).unwrap();
    let facets = Facets::new(scene, &patches);
    let factors = bake::form_factors(scene, &patches, &facets, request, &run, &mut ignore).unwrap();
    (patches, factors)
}

/// A box without its lid, and another that floats in it.
fn open_box() -> Scene {
    let mut surfaces = sides([0.0; 3], [1.0, 1.2, 0.8], 4, true);
    surfaces.remove(1);
    surfaces.extend(sides([0.3, 0.4, 0.2], [0.6, 0.7, 0.6], 2, false));
    scene_of(surfaces)
}

#[test]
fn repair_closes_every_row_and_keeps_reciprocity() {
    for (name, scene) in [("furnished room", furnished_room()), ("open box", open_box())] {
        let back_faces = Some(BackFaces::Black);
        let request =
            Request { method: Method::Hemicube { precision: 50 }, back_faces, ..Request::default() };
        let (patches, factors) = factors_of(&scene, &request);
        let before = Laws::of(&patches, &factors);
        assert!(before.reciprocity > 0.005, "{name}: a hemicube keeps none: {}", before.reciprocity);

        let mut areas = ExchangeAreas::average(&patches.area, &factors, |i, j| patches.is_behind(i, j));
        let closing = areas.close();
        assert!(closing.before > 1e-3 && closing.after < 1e-12 && closing.rounds > 0, "{name}: {closing:?}");
        for i in 0..patches.len() {
            let Elsewhere { surroundings, backs } = areas.elsewhere(i);
            let sum: f64 = areas.row(i).map(|(_, factor)| factor).sum();
            assert!((1.0 - sum - surroundings - backs).abs() < 1e-12, "{name}, patch {i}: {sum}");
            for (j, factor) in areas.row(i) {
                let j = j as usize;
                let back = areas.row(j).find(|&(k, _)| k as usize == i).unwrap().1;
                let (there, back) = (factor * patches.area[i], back * patches.area[j]);
                assert!((there / back - 1.0).abs() < 1e-15 * 4.0, "{name}: {i}, {j}");
                assert!(factor > 0.0, "{name}: {i}, {j}: {factor}");
                // What nobody saw is not there.
                assert!(factors.row(i).get(j) > 0.0 || factors.row(j).get(i) > 0.0);
            }
        }
        // As solvers read them: to single precision.
        let laws = Laws::of(&patches, &areas.form_factors());
        assert!(laws.closure.0 < 1e-7 && laws.reciprocity < 1e-7, "{name}: {laws:?}");
    }
}

#[test]
fn a_repaired_room_keeps_furnace_and_energy_at_once() {
    let mut scene = furnished_room();
    scene.back_faces = BackFaces::Black;
    paint(&mut scene, |k| (Rgb::grey(if k == 1 { 20.0 } else { 0.0 }), Rgb::grey(0.9)));
    let energy = |request: &Request| {
        let baked = bake(&scene, request, &Run::default(), &mut ignore).unwrap();
        let (patches, rows) = (&baked.patches, &baked.form_factors);
        Energy::of(patches, rows, &baked.solution, request.surroundings, &mut ignore).unwrap().imbalance().g
    };
    let as_found = Request { method: Method::Hemicube { precision: 30 }, ..Request::default() };
    assert!(energy(&as_found).abs() > 1e-4, "{}", energy(&as_found));
    let repaired = Request { repair: true, ..as_found };
    for solver in SOLVERS {
        let request = Request { solver, epsilon: 1e-8, ..repaired };
        assert!(energy(&request).abs() < 2e-6, "{solver:?}: {}", energy(&request));
    }

    let mut furnace = furnished_room();
    paint(&mut furnace, |_| (Rgb::WHITE, Rgb::new(0.5, 0.8, 0.99)));
    let baked = bake(&furnace, &Request { epsilon: 1e-8, ..repaired }, &Run::default(), &mut ignore).unwrap();
    for b in &baked.solution.radiosity {
        assert!((b.r - 2.0).abs() < 1e-6 && (b.g - 5.0).abs() < 1e-5 && (b.b - 100.0).abs() < 2e-2, "{b:?}");
    }
    assert!(baked.closing.unwrap().after < 1e-12);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Any symmetric matrix with rows that close, seen through errors of a third, closes again; none turns its sign.
    #[test]
    fn whatever_can_be_closed_is(
        exchange in proptest::collection::vec(0.0..1.0_f64, 12 * 12),
        noise in proptest::collection::vec(-0.33..0.33_f64, 12 * 12),
        sky in proptest::collection::vec(prop_oneof![Just(0.0), 0.0..3.0_f64], 12),
    ) {
        let n = 12;
        let of = |i: usize, j: usize| if i == j { 0.0 } else { exchange[i.min(j) * n + i.max(j)].powi(3) };
        let area: Vec<f64> = (0..n).map(|i| (0..n).map(|j| of(i, j)).sum::<f64>() + sky[i]).collect();
        let rows = (0..n).map(|i| {
            let full: Vec<f64> = (0..n).map(|j| of(i, j) / area[i] * (1.0 + noise[i * n + j])).collect();
            Row::from_dense(&full).with_elsewhere(Elsewhere { surroundings: sky[i] / area[i], backs: 0.0 })
        });
        let factors = FormFactors::from_rows(rows.collect());
        let mut areas = ExchangeAreas::average(&area, &factors, |_, _| false);
        let closing = areas.close();
        prop_assert!(closing.after < 1e-12, "{:?}", closing);
        prop_assert_eq!(closing.after, areas.closure_error());
        for i in 0..n {
            prop_assert!(areas.row(i).all(|(j, factor)| factor > 0.0 && of(i, j as usize) > 0.0));
        }
    }
}

#[test]
fn what_cannot_be_closed_stays_as_near_as_it_comes() {
    // Two patches that see only each other, of areas 1 and 2: no symmetric exchange is all of both.
    let rows = [[0.0, 1.0], [0.6, 0.0]].map(|row| Row::from_dense(&row));
    let mut areas = ExchangeAreas::average(&[1.0, 2.0], &FormFactors::from_rows(rows.into()), |_, _| false);
    let closing = areas.close();
    assert!(closing.after > 0.1 && closing.after <= closing.before, "{closing:?}");
    assert!(areas.row(0).all(|(_, factor)| factor.is_finite() && factor > 0.0));
    // One that sees nothing, and knows not where its energy goes.
    let mut alone =
        ExchangeAreas::average(&[1.0], &FormFactors::from_rows(vec![Row::default()]), |_, _| false);
    assert_eq!((alone.close().after, alone.is_empty(), alone.nonzeros()), (1.0, false, 0));
}

#[test]
fn what_lit_backs_send_is_closed_as_it_is() {
    // A box that stands open on a floor: within, the floor sees the backs of its sides, which do not see the floor.
    let floor = plate([-1.0, -1.0, 0.0], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0], 9);
    let scene = scene_of(sides([0.0; 3], [1.0; 3], 3, false).into_iter().skip(1).chain([floor]));
    let (patches, factors) = factors_of(&scene, &Request::default());
    assert!(Laws::of(&patches, &factors).behind > 0.1);
    let mut areas = ExchangeAreas::average(&patches.area, &factors, |i, j| patches.is_behind(i, j));
    assert!(areas.close().after < 1e-12);
    let repaired = areas.form_factors();
    for (i, j) in (0..patches.len()).flat_map(|i| (0..patches.len()).map(move |j| (i, j))) {
        let (there, back) =
            (repaired.row(i).get(j) * patches.area[i], repaired.row(j).get(i) * patches.area[j]);
        match patches.is_behind(i, j) || patches.is_behind(j, i) {
            true => assert!(there == 0.0 || back == 0.0, "{i}, {j}"),
            false => assert!((there - back).abs() <= 1e-7 * there, "{i}, {j}: {there} {back}"),
        }
    }
}

#[test]
fn amid_surroundings_as_bright_as_itself_an_open_scene_is_a_furnace() {
    // E = 1 - ρ and B = 1 all about: B = 1 everywhere, whatever is open.
    let mut scene = open_box();
    paint(&mut scene, |k| {
        let rho = 0.1 + 0.11 * (k % 8) as f64;
        (Rgb::grey(1.0 - rho), Rgb::grey(rho))
    });
    for (solver, repair) in SOLVERS.into_iter().flat_map(|solver| [(solver, false), (solver, true)]) {
        let request = Request { solver, repair, surroundings: Rgb::WHITE, ..Request::default() };
        let baked = bake(&scene, &request, &Run::default(), &mut ignore).unwrap();
        // Shooting along a hemicube's rows keeps no furnace.
        let tolerance = if solver == Solver::Progressive && !repair { 0.1 } else { 1e-5 };
        for (i, (b, h)) in baked.solution.radiosity.iter().zip(&baked.solution.irradiance).enumerate() {
            assert!(
                (b.g - 1.0).abs() < tolerance && (h.g - 1.0).abs() < 2.0 * tolerance,
                "{solver:?} {i}: {b:?} {h:?}"
            );
        }
        let energy =
            Energy::of(&baked.patches, &baked.form_factors, &baked.solution, Rgb::WHITE, &mut ignore)
                .unwrap();
        assert!(
            energy.received.g > 0.5 && energy.lost.g > 0.5 && energy.imbalance().g.abs() < 0.02,
            "{energy:?}"
        );
    }
}

#[test]
fn black_backs_are_no_surroundings() {
    // Within a closed room a plate with one side only: what meets its back is gone, but not out of the room.
    let mut surfaces = sides([0.0; 3], [1.0; 3], 3, true);
    surfaces.push(plate([0.2, 0.2, 0.5], [0.6, 0.0, 0.0], [0.0, 0.6, 0.0], 2));
    let request = Request { back_faces: Some(BackFaces::Black), ..Request::default() };
    for method in [Method::Hemicube { precision: 40 }, Method::HemicubeRays { precision: 40 }] {
        let (patches, factors) = factors_of(&scene_of(surfaces.clone()), &Request { method, ..request });
        let laws = Laws::of(&patches, &factors);
        assert!(laws.closure.0 < 2e-6, "{laws:?}");
        assert!(laws.surroundings.iter().all(|&share| share == 0.0));
        // The floor's middle sees the plate's back; the ceiling does not, and nothing is blind.
        assert!(laws.backs[4] > 0.3 && laws.backs[9..18].iter().all(|&share| share == 0.0), "{laws:?}");
        assert_eq!(laws.blind().count(), 0);
    }
}

#[test]
fn no_black_back_is_seen_past_a_silhouette() {
    // A solid in the air, of round coordinates, so that its edges run through the centres of cells as seen from many a patch.
    let mut surfaces = sides([0.0; 3], [1.0; 3], 8, true);
    surfaces.extend(sides([0.3, 0.2, 0.4], [0.7, 0.6, 0.9], 4, false));
    for precision in [50, 100, 200] {
        let back_faces = Some(BackFaces::Black);
        let request = Request { method: Method::Hemicube { precision }, back_faces, ..Request::default() };
        let (patches, factors) = factors_of(&scene_of(surfaces.clone()), &request);
        let laws = Laws::of(&patches, &factors);
        assert!(
            laws.backs.iter().chain(&laws.surroundings).all(|&share| share == 0.0),
            "{precision}: {laws:?}"
        );
    }
}

#[test]
fn exact_form_factors_know_what_leaves_the_scene() {
    // Through the open top, and to black backs of a plate; in a closed room nothing goes elsewhere, whatever the method's error.
    let request = Request {
        method: Method::Exact { accuracy: 1e-4 },
        back_faces: Some(BackFaces::Black),
        ..Request::default()
    };
    let mut open = open_box();
    open.surfaces.push(plate([0.1, 0.1, 0.7], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], 1));
    let (patches, factors) = factors_of(&open, &request);
    let laws = Laws::of(&patches, &factors);
    assert!(laws.closure.0 < 3e-3, "{:?}", laws.closure);
    let mean = |shares: &[f64]| shares.iter().zip(&patches.area).map(|(s, a)| s * a).sum::<f64>();
    let by_hemicube = Request { method: Method::Hemicube { precision: 200 }, ..request };
    let hemicubes = Laws::of(&patches, &factors_of(&open, &by_hemicube).1);
    for (exact, hemicube) in [(&laws.surroundings, &hemicubes.surroundings), (&laws.backs, &hemicubes.backs)]
    {
        let (exact, hemicube) = (mean(exact), mean(hemicube));
        assert!((exact / hemicube - 1.0).abs() < 0.1 && hemicube > 1e-3, "{exact} {hemicube}");
    }

    let mut closed = scene_of(sides([0.0; 3], [1.0; 3], 3, true));
    closed.surfaces.extend(sides([0.3, 0.2, 0.4], [0.7, 0.6, 0.9], 2, false));
    let (patches, factors) = factors_of(&closed, &request);
    let laws = Laws::of(&patches, &factors);
    assert!(laws.surroundings.iter().chain(&laws.backs).all(|&share| share == 0.0), "{laws:?}");
    let mut areas = ExchangeAreas::average(&patches.area, &factors, |i, j| patches.is_behind(i, j));
    assert!(areas.close().after < 1e-12);
}

#[test]
fn who_sees_nothing_is_told() {
    let scene = scene_of([plate([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 2)]);
    let (patches, factors) = factors_of(&scene, &Request::default());
    let laws = Laws::of(&patches, &factors);
    assert_eq!(laws.blind().collect::<Vec<_>>(), [0, 1, 2, 3]);
    assert_eq!(laws.reciprocity, 0.0);
}
