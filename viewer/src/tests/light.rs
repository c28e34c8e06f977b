//! The worker's answers: those of `bake`, whatever happened on the way.

use std::time::{Duration, Instant};

use radiosity::bake::{self, BakeError, Baked, Method, Request, Run, Solver};
use radiosity::light::Rgb;
use radiosity::scene::Scene;
use radiosity::solve::SolveError;
use radiosity::watch::ignore;

use super::{request, rooms, sample, session, until, until_done};
use crate::quantities::{self, Column, Quantity};
use crate::session::{Activity, Session};
use crate::worker::{Stage, Trouble};

fn baked(scene: &Scene, solver: Solver) -> Baked {
    let request = Request { solver, ..request() };
    bake::bake(scene, &request, &Run::default(), &mut ignore).unwrap()
}

fn shown(scene: &Scene) -> Session {
    let mut session = session();
    session.show(scene.clone());
    until(&mut session, |session, _| session.loaded.is_some());
    session
}

fn farthest(one: &[Rgb], other: &[Rgb]) -> f64 {
    assert_eq!(one.len(), other.len());
    one.iter().zip(other).map(|(&a, &b)| (a - b).norm_squared()).sum::<f64>().sqrt()
}

#[test]
fn the_answer_is_that_of_bake_to_the_bit() {
    let scene = rooms::cube(6);
    for solver in [Solver::GaussSeidel, Solver::Progressive] {
        let mut session = shown(&scene);
        session.solve(solver);
        until_done(&mut session);
        let (answer, expected) = (session.solution().unwrap(), baked(&scene, solver).solution);
        assert_eq!(answer, expected, "{solver:?}");
    }
}

#[test]
fn exact_form_factors_are_a_choice() {
    let scene = rooms::cube(3);
    let method = Method::Exact { accuracy: 1e-3 };
    let request = Request { method, ..request() };
    let expected = bake::bake(&scene, &request, &Run::default(), &mut ignore).unwrap();
    let mut session = shown(&scene);
    session.solve(Solver::GaussSeidel);
    until_done(&mut session);
    let by_hemicube = session.solution().unwrap();
    // Light that was there follows; a hemicube is shown of a patch all the same.
    session.set_method(method);
    session.select(Some(5));
    until(&mut session, |session, _| session.light.complete && session.inspection.is_some());
    until_done(&mut session);
    assert_ne!(by_hemicube, expected.solution);
    assert_eq!(session.solution().unwrap(), expected.solution);
    assert_eq!(session.inspection.unwrap().row, *expected.form_factors.row(5));
}

#[test]
fn a_corrected_answer_is_that_of_bake() {
    let scene = rooms::cube(3);
    let method = Method::Exact { accuracy: 1e-3 };
    for solver in [Solver::GaussSeidel, Solver::Progressive] {
        let request = Request { method, solver, correct: true, error: true, ..request() };
        let expected = bake::bake(&scene, &request, &Run::default(), &mut ignore).unwrap();
        let mut session = shown(&scene);
        session.set_correct(true);
        assert!(!session.request.correct, "a hemicube's answers are not corrected");
        session.set_method(method);
        session.solve(solver);
        until_done(&mut session);
        let plain = session.solution().unwrap();
        // Light that was there follows.
        session.set_correct(true);
        until_done(&mut session);
        assert_ne!(plain, expected.solution);
        assert_eq!(session.solution().unwrap(), expected.solution, "{solver:?}");
        session.want_error();
        until_done(&mut session);
        assert_eq!(session.light.error.as_ref().map(|error| &error.estimate), expected.error.as_ref());

        // An edit is followed by an answer that is corrected, too; another method is not.
        session.materials[1].emission = Rgb::new(1.0, 2.0, 3.0);
        session.materials_changed();
        let edited = |session: &Session| session.light.patches.emission.contains(&Rgb::new(1.0, 2.0, 3.0));
        until(&mut session, |session, heard| heard.done && edited(session));
        assert!(session.light.complete && session.request.correct);
        session.set_method(Method::Hemicube { precision: 30 });
        assert!(!session.request.correct);
        until_done(&mut session);
    }
}

#[test]
fn the_error_is_that_of_bake_and_goes_with_its_answer() {
    let scene = rooms::cube(4);
    for solver in [Solver::GaussSeidel, Solver::Progressive] {
        let request = Request { solver, error: true, ..request() };
        let expected = bake::bake(&scene, &request, &Run::default(), &mut ignore).unwrap();
        let mut session = shown(&scene);
        session.want_error();
        assert_eq!(session.activity, Activity::Idle, "there is no answer yet");
        session.solve(solver);
        until_done(&mut session);
        let unknown = quantities::column(Quantity::Error, &session.light, None).numbers();
        assert!(unknown.iter().all(|error| error.is_nan()));
        session.want_error();
        until_done(&mut session);
        let error = session.light.error.clone().unwrap();
        assert_eq!(Some(&error.estimate), expected.error.as_ref(), "{solver:?}");
        let shown = quantities::column(Quantity::Error, &session.light, None).numbers();
        assert_eq!(shown[3], error.estimate.radiosity[3].luminance());
        assert!(error.overall.relative > 0.0);

        // Another light has another error; one that is being estimated gives way to the edit.
        session.materials[1].emission = Rgb::new(1.0, 2.0, 3.0);
        session.materials_changed();
        let edited = |session: &Session| session.light.patches.emission.contains(&Rgb::new(1.0, 2.0, 3.0));
        until(&mut session, |session, heard| heard.done && edited(session));
        assert!(session.light.complete && session.light.error.is_none());
        session.want_error();
        session.materials[1].emission = Rgb::new(3.0, 2.0, 1.0);
        session.materials_changed();
        let edited = |session: &Session| session.light.patches.emission.contains(&Rgb::new(3.0, 2.0, 1.0));
        until(&mut session, |session, heard| heard.done && edited(session));
        assert!(session.light.complete && session.light.error.is_none());
    }
}

#[test]
fn stopped_and_resumed_it_is_the_same_to_the_bit() {
    let scene = rooms::cube(14);
    for solver in [Solver::GaussSeidel, Solver::Progressive] {
        let expected = baked(&scene, solver).solution;
        let mut session = shown(&scene);
        session.solve(solver);
        let mut stops = 0;
        while session.activity != Activity::Done && stops < 12 {
            // Stop wherever it happens to be.
            std::thread::sleep(Duration::from_millis(15));
            session.stop_or_resume();
            until(&mut session, |session, _| {
                matches!(session.activity, Activity::Paused(_) | Activity::Done)
            });
            if let Activity::Paused(_) = session.activity {
                stops += 1;
                // It does rest.
                std::thread::sleep(Duration::from_millis(20));
                let heard = session.hear();
                assert!(!heard.done);
                session.stop_or_resume();
            }
            session.hear();
        }
        assert!(stops > 0, "it was too quick to be stopped");
        until_done(&mut session);
        assert_eq!(session.solution().unwrap(), expected, "{solver:?} after {stops} stops");
    }
}

#[test]
fn light_arrives_little_by_little() {
    // So fine that it takes a second: what is over sooner is shown at once.
    let request = Request { method: Method::Hemicube { precision: 400 }, ..request() };
    let mut session = Session::new(request, Run::default(), || {});
    session.open(&sample("cornell.scn"), Some(Solver::GaussSeidel));
    let (mut partly, mut rows) = (0, false);
    until(&mut session, |session, heard| {
        rows |= matches!(session.activity, Activity::At(Stage::Rows { .. }));
        partly += usize::from(heard.light && !session.light.complete);
        session.activity == Activity::Done
    });
    assert!(rows && partly > 2, "{partly}");
}

#[test]
fn edits_equal_a_fresh_solve() {
    let mut scene = rooms::cube(8);
    for solver in [Solver::GaussSeidel, Solver::Progressive] {
        let mut session = shown(&scene);
        session.solve(solver);
        until_done(&mut session);
        // Many edits at once, as a dragged slider makes them: the last one counts.
        for k in 0..20 {
            session.materials[1].emission = Rgb::new(1.0 + f64::from(k), 2.0, 8.0);
            session.materials[4].reflectance = Rgb::new(0.9, 0.02 * f64::from(k), 0.1);
            session.materials_changed();
        }
        let wanted = session.materials[1].emission;
        until(&mut session, |session, _| {
            session.light.complete && session.light.patches.emission.contains(&wanted)
        });
        let mut edited = scene.clone();
        edited.surfaces[1].material.emission = wanted;
        edited.surfaces[4].material.diffuse = session.materials[4].reflectance;
        let fresh = baked(&edited, solver).solution;
        let answer = session.solution().unwrap();
        // Each is within the tail of the stopping test, epsilon over (1 - how much a sweep leaves).
        let apart = farthest(&answer.radiosity, &fresh.radiosity);
        assert!(apart < 2e-5, "{solver:?}: {apart}");
        assert!(farthest(&answer.irradiance, &fresh.irradiance) < 4e-5);

        // Off: its emission is gone, its reflectance stays.
        session.materials[1].on = false;
        session.materials_changed();
        until(&mut session, |session, _| {
            session.light.complete && session.light.patches.emission.iter().all(|e| e.is_black())
        });
        assert!(session.light.radiosity.iter().all(|b| b.max_channel() < 1e-5));

        session.reset_materials();
        until(&mut session, |session, _| {
            session.light.complete && session.light.patches.emission.contains(&Rgb::new(4.0, 3.0, 2.0))
        });
        let apart = farthest(&session.light.radiosity, &baked(&scene, solver).solution.radiosity);
        assert!(apart < 2e-5, "{apart}");
        scene.name.push('2');
    }
}

#[test]
fn two_thousand_patches_follow_an_edit_at_once() {
    // Three rounds, the best counts: other work may have the machine meanwhile.
    let mut session = session();
    session.open(&sample("cornell.scn"), Some(Solver::GaussSeidel));
    until_done(&mut session);
    assert!(session.light.patches.len() > 2000);
    let lamp = session.materials.iter().position(|material| !material.emission.is_black()).unwrap();
    let mut best = (Duration::MAX, Duration::MAX);
    for round in 0..5 {
        let wanted = session.materials[lamp].emission * 1.03;
        session.materials[lamp].emission = wanted;
        let begun = Instant::now();
        session.materials_changed();
        let mut first = None;
        until(&mut session, |session, heard| {
            if heard.light && session.light.patches.emission.contains(&wanted) {
                first.get_or_insert(begun.elapsed());
            }
            session.light.complete && session.light.patches.emission.contains(&wanted)
        });
        println!("edit {round}: shown {:?}, answer {:?}", first.unwrap(), begun.elapsed());
        best = best.min((first.unwrap(), begun.elapsed()));
    }
    assert!(best.0 < Duration::from_millis(50), "{best:?}");
}

#[test]
fn quantities_have_their_values() {
    let scene = rooms::cube(6);
    let baked = baked(&scene, Solver::GaussSeidel);
    let mut session = shown(&scene);
    session.solve(Solver::GaussSeidel);
    session.select(Some(7));
    until_done(&mut session);
    until(&mut session, |session, _| session.inspection.is_some());
    let (light, factors) = (&session.light, &baked.form_factors);
    let row = session.inspection.as_ref().map(|inspection| &inspection.row);
    assert_eq!(row, Some(factors.row(7)));
    let colours = |quantity| match quantities::column(quantity, light, row) {
        Column::Colour(colours) => colours,
        Column::Number(_) => panic!("{quantity:?}"),
    };
    let numbers = |quantity| quantities::column(quantity, light, row).numbers();

    assert_eq!(colours(Quantity::Radiosity), baked.solution.radiosity);
    assert_eq!(colours(Quantity::Irradiance), baked.solution.irradiance);
    assert_eq!(colours(Quantity::Emission), baked.patches.emission);
    assert_eq!(colours(Quantity::Reflectance), baked.patches.reflectance);
    assert_eq!(numbers(Quantity::Area), baked.patches.area);
    for (i, error) in numbers(Quantity::Closure).into_iter().enumerate() {
        assert_eq!(error, factors.row(i).sum() - 1.0);
        assert!(error.abs() < 1e-5, "the cube is closed: {error}");
    }
    let (direct, indirect) = (colours(Quantity::Direct), colours(Quantity::Indirect));
    for i in 0..baked.patches.len() {
        let gathered = factors.row(i).gather(&baked.patches.emission);
        let expected = baked.patches.emission[i] + baked.patches.reflectance[i] * gathered;
        assert_eq!(direct[i], expected);
        assert!((direct[i] + indirect[i] - baked.solution.radiosity[i]).norm_squared().sqrt() < 1e-12);
        // B = E + ρ H, to the stopping test.
        let again = baked.patches.emission[i] + baked.patches.reflectance[i] * baked.solution.irradiance[i];
        assert!((again - baked.solution.radiosity[i]).norm_squared().sqrt() < 1e-6);
    }
    let seen = numbers(Quantity::FormFactors);
    assert!((seen.iter().sum::<f64>() - factors.row(7).sum()).abs() < 1e-9);
    // Σ over the cells of the hemicube that see j is F_ij.
    let inspection = session.inspection.as_ref().unwrap();
    let mut by_cells = vec![0.0; seen.len()];
    for (k, face) in inspection.faces.iter().enumerate() {
        let n = inspection.weights.precision();
        for (index, patch) in face.iter().enumerate() {
            let (x, y) = (index % n, index / n);
            let weight = if k == 0 { inspection.weights.top(x, y) } else { inspection.weights.side(x, y) };
            if let Some(patch) = patch {
                by_cells[*patch as usize] += weight;
            }
        }
    }
    for (by_cells, factor) in by_cells.iter().zip(&seen) {
        assert!((by_cells - factor).abs() < 1e-6, "{by_cells} {factor}");
    }
}

#[test]
fn what_cannot_be_opened_leaves_what_is_there() {
    let folder = tempfile::tempdir().unwrap();
    let binary = folder.path().join("picture.scn");
    std::fs::write(&binary, (0..40_000_u32).map(|k| (k * 7919 % 251) as u8).collect::<Vec<_>>()).unwrap();
    let wrong = folder.path().join("wrong.scn");
    std::fs::write(&wrong, "QD 2 2\n 0 0 0  1 0 0  1 oops 0\n").unwrap();
    let empty = folder.path().join("empty.scn");
    std::fs::write(&empty, "").unwrap();
    let mut session = shown(&rooms::cube(2));
    for path in
        [binary.as_path(), wrong.as_path(), empty.as_path(), folder.path(), &folder.path().join("none.scn")]
    {
        session.open(path, None);
        until(&mut session, |session, _| session.trouble.is_some());
        assert!(session.loaded.as_ref().is_some_and(|loaded| loaded.scene.name == "cube"), "{path:?}");
        session.trouble = None;
    }
    // And it still solves.
    session.solve(Solver::GaussSeidel);
    until_done(&mut session);
}

#[test]
fn too_large_is_refused_beforehand() {
    let run = Run { memory_limit: Some(60_000), ..Run::default() };
    let mut session = Session::new(request(), run, || {});
    session.show(rooms::cube(4));
    until(&mut session, |session, _| session.loaded.is_some());
    // Its patches fit, its form factors do not.
    session.solve(Solver::GaussSeidel);
    until(&mut session, |session, _| session.trouble.is_some());
    assert!(
        matches!(session.trouble, Some(Trouble::Bake(BakeError::Memory { .. }))),
        "{:?}",
        session.trouble
    );
    // More patches than there is room for: the last cut stays.
    session.trouble = None;
    session.set_subdivision(1000.0);
    until(&mut session, |session, _| session.trouble.is_some());
    assert_eq!(session.loaded.as_ref().unwrap().patches.len(), 96);
}

#[test]
fn a_scene_that_makes_light_is_named() {
    let mut scene = rooms::cube(2);
    for surface in &mut scene.surfaces {
        surface.material.diffuse = Rgb::grey(1.1);
    }
    for solver in [Solver::GaussSeidel, Solver::Progressive] {
        let mut session = shown(&scene);
        session.solve(solver);
        until(&mut session, |session, _| session.trouble.is_some());
        let diverges =
            matches!(session.trouble, Some(Trouble::Bake(BakeError::Solve(SolveError::Diverges { .. }))));
        assert!(diverges, "{:?}", session.trouble);
    }
}

#[test]
fn closed_in_the_midst_it_ends_at_once() {
    for (solver, wait) in [(Solver::GaussSeidel, 30), (Solver::Progressive, 30), (Solver::GaussSeidel, 0)] {
        let mut session = shown(&rooms::cube(40));
        session.solve(solver);
        std::thread::sleep(Duration::from_millis(wait));
        let begun = Instant::now();
        drop(session);
        assert!(begun.elapsed() < Duration::from_millis(1500), "{:?}", begun.elapsed());
    }
}

#[test]
fn new_settings_while_it_works_begin_anew() {
    let scene = rooms::cube(6);
    let mut session = shown(&scene);
    session.solve(Solver::GaussSeidel);
    session.set_method(Method::Hemicube { precision: 50 });
    session.set_subdivision(2.0);
    session.set_subdivision(0.5);
    until_done(&mut session);
    until(&mut session, |session, _| session.light.complete && session.light.patches.len() == 6 * 9);
    let request =
        Request { subdivision: 0.5.into(), method: bake::Method::Hemicube { precision: 50 }, ..request() };
    let expected = bake::bake(&scene, &request, &Run::default(), &mut ignore).unwrap();
    assert_eq!(session.solution().unwrap(), expected.solution);
}
