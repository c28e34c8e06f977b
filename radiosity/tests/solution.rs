//! Solved scenes against known answers, a dense direct solve, and their own energy.

mod rooms;

use std::ops::ControlFlow;

use radiosity::bake::{self, BakeError, Baked, Method, Request, Run, Solver, bake};
use radiosity::light::Rgb;
use radiosity::patches::BYTES_PER_PATCH;
use radiosity::scene::{BackFaces, Scene};
use radiosity::solve::{ConjugateGradients, GaussSeidel, Progressive, SolveError};
use radiosity::visibility::Facets;
use radiosity::watch::{Progress, ignore};

use rooms::{cube, furnished_room, paint, plate, scene_of, sides, tilted_room};

const SOLVERS: [Solver; 4] =
    [Solver::GaussSeidel, Solver::Progressive, Solver::ConjugateGradients, Solver::Jacobi];

fn solved(scene: &Scene, request: &Request) -> Baked {
    bake(scene, request, &Run::default(), &mut ignore).unwrap()
}

fn assert_all_near(baked: &Baked, expected: Rgb, tolerance: f64, name: &str) {
    for (i, b) in baked.solution.radiosity.iter().enumerate() {
        for (b, e) in b.to_array().into_iter().zip(expected.to_array()) {
            assert!((b / e - 1.0).abs() < tolerance, "{name}, patch {i}: {b}, not {e}");
        }
    }
}

#[test]
fn furnace() {
    // Closed, E and ρ the same everywhere: B = E / (1 - ρ), whatever stands inside.
    for (name, scene) in [("cube", cube(6)), ("furnished", furnished_room()), ("tilted", tilted_room())] {
        let mut scene = scene;
        paint(&mut scene, |_| (Rgb::WHITE, Rgb::new(0.5, 0.8, 0.9)));
        for precision in [30, 100] {
            let baked =
                solved(&scene, &Request { method: Method::Hemicube { precision }, ..Request::default() });
            assert_all_near(&baked, Rgb::new(2.0, 5.0, 10.0), 2e-5, name);
        }
    }
}

#[test]
fn white_furnace() {
    // E_i = 1 - ρ_i, any ρ: B = 1 everywhere.
    let mut scene = furnished_room();
    paint(&mut scene, |k| {
        let rho = |k: usize| 0.15 + 0.07 * (k % 11) as f64;
        let reflectance = Rgb::new(rho(k), rho(k * 3 + 1), rho(k * 5 + 2));
        (Rgb::WHITE - reflectance, reflectance)
    });
    assert_all_near(&solved(&scene, &Request::default()), Rgb::WHITE, 2e-5, "white furnace");
}

#[test]
fn cube_with_a_bright_floor() {
    let mut scene = cube(10);
    paint(&mut scene, |k| (Rgb::grey(if k == 0 { 1.0 } else { 0.0 }), Rgb::grey(0.5)));
    let baked = solved(&scene, &Request::default());
    // Mesh-converged means, by surface: floor, ceiling, four sides.
    let expected = [1.104362, 0.171216, 0.181106, 0.181106, 0.181106, 0.181106];
    for (block, expected) in baked.patches.blocks.iter().zip(expected) {
        let power: f64 = block.patches().map(|i| baked.patches.area[i] * baked.solution.radiosity[i].r).sum();
        let area: f64 = block.patches().map(|i| baked.patches.area[i]).sum();
        assert!((power / area / expected - 1.0).abs() < 0.01, "{} {expected}", power / area);
    }
}

/// A room where every surface differs, with occluders and one lamp.
fn coloured_room() -> Scene {
    coloured(furnished_room())
}

/// Paint every surface differently; the second is the lamp.
fn coloured(mut scene: Scene) -> Scene {
    paint(&mut scene, |k| {
        let channel = |shift: usize| 0.1 + 0.8 * ((k * 7 + shift * 5) % 13) as f64 / 13.0;
        let emission = if k == 1 { Rgb::new(20.0, 18.0, 15.0) } else { Rgb::BLACK };
        (emission, Rgb::new(channel(0), channel(1), channel(2)))
    });
    scene
}

#[test]
fn emitted_power_is_absorbed_power() {
    // Σ A_i E_i = Σ A_i (1 - ρ_i) H_i in a closed scene; the hemicube keeps closure but not reciprocity, so
    // here within its own error. No back may be seen: one that is lit sends what it never received.
    let mut room = sides([0.0; 3], [4.0, 3.0, 2.5], 12, true);
    room.extend(sides([1.0, 1.0, 0.2], [2.0, 1.7, 0.8], 6, false));
    let baked = solved(&coloured(scene_of(room)), &Request::default());
    let absorbed: Rgb = (0..baked.patches.len())
        .map(|i| {
            (Rgb::WHITE - baked.patches.reflectance[i]) * baked.solution.irradiance[i] * baked.patches.area[i]
        })
        .sum();
    let emitted = baked.patches.total_power();
    for (a, e) in absorbed.to_array().into_iter().zip(emitted.to_array()) {
        assert!((a / e - 1.0).abs() < 0.01, "absorbed {a}, emitted {e}");
    }
    // And each patch's own balance, to the solver's tolerance: B = E + ρ H.
    for i in 0..baked.patches.len() {
        let balance = baked.patches.emission[i] + baked.patches.reflectance[i] * baked.solution.irradiance[i]
            - baked.solution.radiosity[i];
        assert!(balance.norm_squared().sqrt() < 2e-6, "patch {i}: {balance:?}");
    }
}

/// Solve a dense system by Gaussian elimination with partial pivoting.
#[expect(clippy::needless_range_loop, reason = "the indices are the mathematics")]
fn eliminate(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Vec<f64> {
    let n = b.len();
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs())).unwrap();
        a.swap(k, pivot);
        b.swap(k, pivot);
        for i in k + 1..n {
            let factor = a[i][k] / a[k][k];
            for j in k..n {
                a[i][j] -= factor * a[k][j];
            }
            b[i] -= factor * b[k];
        }
    }
    for k in (0..n).rev() {
        b[k] = (b[k] - (k + 1..n).map(|j| a[k][j] * b[j]).sum::<f64>()) / a[k][k];
    }
    b
}

#[test]
fn a_direct_dense_solve_agrees() {
    let baked = solved(&coloured_room(), &Request::default());
    let n = baked.patches.len();
    for channel in 0..3 {
        let matrix = (0..n)
            .map(|i| {
                let mut row = vec![0.0; n];
                row[i] = 1.0;
                for (j, factor) in baked.form_factors.row(i).iter() {
                    row[j] -= baked.patches.reflectance[i].to_array()[channel] * factor;
                }
                row
            })
            .collect();
        let emission = baked.patches.emission.iter().map(|e| e.to_array()[channel]).collect();
        for (i, direct) in eliminate(matrix, emission).into_iter().enumerate() {
            let iterated = baked.solution.radiosity[i].to_array()[channel];
            assert!((direct - iterated).abs() < 2e-6, "patch {i}: {iterated}, directly {direct}");
        }
    }
}

#[test]
fn sweeps_are_those_of_plain_gauss_seidel() {
    // The plain twin: all of B in double precision, a patch at a time. Each sweep comes to where its own does, to a fiftieth
    // of what it still moves, and so in as many sweeps; however bright the light is, or faint.
    for (reflectance, most, brightness) in
        [(0.7, 40, 1.0), (0.99, 300, 1.0), (0.7, 40, 1e100), (0.7, 40, 1e-100)]
    {
        let mut scene = furnished_room();
        paint(&mut scene, |k| {
            let emission = if k == 1 { Rgb::new(20.0, 18.0, 15.0) * brightness } else { Rgb::BLACK };
            (emission, Rgb::new(0.3, 0.8, 1.0) * reflectance)
        });
        let request =
            Request { method: Method::Hemicube { precision: 50 }, epsilon: f64::MAX, ..Request::default() };
        let Baked { patches, form_factors, .. } = solved(&scene, &request);
        let mut solver = GaussSeidel::new(&patches, &form_factors);
        let mut plain = patches.emission.clone();
        for sweep in 0..most {
            let residual = solver.step();
            let mut moved = 0.0;
            for i in 0..patches.len() {
                let gathered = form_factors.row(i).iter().map(|(j, factor)| plain[j] * factor).sum::<Rgb>();
                let new = patches.emission[i] + patches.reflectance[i] * gathered;
                moved += (new - plain[i]).norm_squared();
                plain[i] = new;
            }
            let plainly: f64 = moved.sqrt();
            let off = plain
                .iter()
                .zip(solver.radiosity())
                .map(|(&a, &b)| (a - b).norm_squared())
                .sum::<f64>()
                .sqrt();
            let size = plain.iter().map(|b| b.norm_squared()).sum::<f64>().sqrt();
            assert!(off <= 0.02 * plainly + 1e-14 * size, "{reflectance}, sweep {sweep}: {off} of {plainly}");
            assert!((residual - plainly).abs() <= 0.02 * plainly + 1e-14 * size, "{residual} {plainly}");
        }
    }
}

#[test]
fn the_same_bits_on_any_number_of_threads() {
    let scene = coloured_room();
    let shares = Method::HemicubeExact { precision: 40, eyes: 2, accuracy: 1e-3 };
    for method in [Method::Hemicube { precision: 50 }, shares] {
        let request = Request { method, ..Request::default() };
        let on = |threads| {
            let run = Run { threads: Some(threads), memory_limit: None };
            bake(&scene, &request, &run, &mut ignore).unwrap()
        };
        let one = on(1);
        for threads in [2, 3, 7] {
            let several = on(threads);
            assert_eq!(one.form_factors, several.form_factors, "{method:?}");
            assert_eq!(one.solution, several.solution, "{method:?}");
        }
    }
}

#[test]
fn passes_that_are_shared_give_the_same_bits_on_any_number_of_threads() {
    // Enough rows for passes to be worth sharing, and of several surfaces: each is a stretch of Gauss-Seidel's sweeps.
    let mut scene = cube(16);
    paint(&mut scene, |k| (Rgb::new(k as f64, 1.0, 0.3 + k as f64), Rgb::new(0.6, 0.1 * k as f64, 0.3)));
    for solver in [Solver::GaussSeidel, Solver::ConjugateGradients, Solver::Jacobi] {
        let method = Method::Hemicube { precision: 20 };
        let request = Request { method, solver, epsilon: 1e-9, ..Request::default() };
        let on = |threads, repair| {
            let run = Run { threads: Some(threads), memory_limit: None };
            bake(&scene, &Request { repair, ..request }, &run, &mut ignore).unwrap()
        };
        let (one, repaired) = (on(1, false), on(1, true));
        assert!(one.form_factors.nonzeros() > 500_000, "too few: {}", one.form_factors.nonzeros());
        for threads in [2, 3] {
            assert_eq!(on(threads, false).solution, one.solution, "{solver:?} on {threads}");
            assert_eq!(on(threads, true).solution, repaired.solution, "{solver:?} on {threads}, repaired");
        }
    }
}

#[test]
fn rays_and_item_buffer_give_the_same_light() {
    let scene = coloured_room();
    let precision = 40;
    let items = solved(&scene, &Request { method: Method::Hemicube { precision }, ..Request::default() });
    let rays = solved(&scene, &Request { method: Method::HemicubeRays { precision }, ..Request::default() });
    for (a, b) in items.solution.radiosity.iter().zip(&rays.solution.radiosity) {
        assert!((*a - *b).norm_squared().sqrt() < 2e-3 * b.max_channel(), "{a:?} {b:?}");
    }
}

#[test]
fn shooting_conserves_energy_and_agrees_with_gathering() {
    // A box in the air: no back is seen.
    let mut room = sides([0.0; 3], [4.0, 3.0, 2.5], 8, true);
    room.extend(sides([1.0, 1.0, 0.2], [2.0, 1.7, 0.8], 4, false));
    let scene = coloured(scene_of(room));
    let gathered = solved(&scene, &Request::default());
    let shot = solved(&scene, &Request { solver: Solver::Progressive, ..Request::default() });
    let patches = &shot.patches;
    let absorbed: Rgb = (0..patches.len())
        .map(|i| (Rgb::WHITE - patches.reflectance[i]) * shot.solution.irradiance[i] * patches.area[i])
        .sum();
    let emitted = patches.total_power();
    for (a, e) in absorbed.to_array().into_iter().zip(emitted.to_array()) {
        assert!((a / e - 1.0).abs() < 1e-6, "absorbed {a}, emitted {e}");
    }
    let mean = |baked: &Baked| -> f64 {
        (0..patches.len()).map(|i| patches.area[i] * baked.solution.radiosity[i].luminance()).sum()
    };
    assert!((mean(&shot) / mean(&gathered) - 1.0).abs() < 0.02, "{} {}", mean(&shot), mean(&gathered));
    assert!(*shot.solution.history.last().unwrap() <= 1e-6);
    assert!(shot.solution.iterations > patches.len());
}

fn by_conjugate_gradients() -> Request {
    Request { solver: Solver::ConjugateGradients, ..Request::default() }
}

/// The symmetric factors of conjugate gradients in full: G_ij = d_i (A_i F_ij + A_j F_ji) / 2 d_j.
fn symmetric_factors(baked: &Baked) -> Vec<Vec<f64>> {
    let solver = ConjugateGradients::new(&baked.patches, &baked.form_factors, &mut ignore).unwrap();
    let (scale, area) = (solver.scale(), &baked.patches.area);
    let n = area.len();
    let mut factors = vec![vec![0.0; n]; n];
    for i in 0..n {
        for (j, factor) in baked.form_factors.row(i).iter() {
            let half = scale[i] * area[i] * factor * scale[j] / 2.0;
            factors[i][j] += half;
            factors[j][i] += half;
        }
    }
    factors
}

#[test]
fn symmetric_factors_keep_closure() {
    // A plate in the air among them, whose lower side nobody sees from above.
    for (name, scene) in [("cube", cube(6)), ("furnished", furnished_room()), ("tilted", tilted_room())] {
        let baked = solved(&scene, &by_conjugate_gradients());
        for (i, row) in symmetric_factors(&baked).iter().enumerate() {
            let closure = row.iter().sum::<f64>() / baked.patches.area[i];
            assert!(
                (closure / baked.form_factors.row(i).sum() - 1.0).abs() < 2e-6,
                "{name}, patch {i}: {closure}"
            );
        }
    }
}

#[test]
fn conjugate_gradients_in_a_furnace() {
    // Closure holds to a millionth, which a furnace of 0.9 returns tenfold.
    for (name, scene) in [("cube", cube(6)), ("furnished", furnished_room()), ("tilted", tilted_room())] {
        let mut scene = scene;
        paint(&mut scene, |_| (Rgb::WHITE, Rgb::new(0.5, 0.8, 0.9)));
        let baked = solved(&scene, &by_conjugate_gradients());
        assert_all_near(&baked, Rgb::new(2.0, 5.0, 10.0), 2e-5, name);
    }
}

#[test]
fn conjugate_gradients_where_one_channel_is_a_furnace_and_the_others_are_not() {
    // Blue is known at once; red and green take a dozen steps more, and blue must bear them.
    let mut scene = cube(8);
    paint(&mut scene, |k| {
        let k = k as f64;
        (Rgb::new(k, 1.0, 0.3), Rgb::new(0.6, 0.1 * k, 0.3))
    });
    for epsilon in [1e-6, 1e-9, 1e-12] {
        let method = Method::Hemicube { precision: 30 };
        let baked = solved(&scene, &Request { epsilon, method, ..by_conjugate_gradients() });
        assert!(baked.solution.iterations <= 30, "{epsilon}: {}", baked.solution.iterations);
        assert!(baked.solution.radiosity.iter().all(|b| (b.b / (0.3 / 0.7) - 1.0).abs() < 1e-5));
    }
}

#[test]
fn conjugate_gradients_lose_and_gain_no_energy() {
    // Emitted power is absorbed power, Σ A_i E_i = Σ A_i (1 - ρ_i) H_i, in a closed scene: to what is left of closure.
    let baked = solved(&coloured_room(), &by_conjugate_gradients());
    let (patches, solution) = (&baked.patches, &baked.solution);
    let absorbed: Rgb = (0..patches.len())
        .map(|i| (Rgb::WHITE - patches.reflectance[i]) * solution.irradiance[i] * patches.area[i])
        .sum();
    for (a, e) in absorbed.to_array().into_iter().zip(patches.total_power().to_array()) {
        assert!((a / e - 1.0).abs() < 1e-5, "absorbed {a}, emitted {e}");
    }
    // And each patch's own balance, B = E + ρ H, to the stopping test.
    let balance = (0..patches.len()).map(|i| {
        patches.emission[i] + patches.reflectance[i] * solution.irradiance[i] - solution.radiosity[i]
    });
    let off = balance.map(|off| off.norm_squared()).sum::<f64>().sqrt();
    assert!(off <= 1e-6, "{off}");
}

#[test]
fn conjugate_gradients_agree_with_a_direct_solve_of_the_symmetric_system() {
    let mut scene = coloured_room();
    // Surfaces that reflect nothing, in one channel or in all, are among the constants.
    scene.surfaces[3].material.diffuse = Rgb::new(0.0, 0.4, 0.7);
    scene.surfaces[4].material.diffuse = Rgb::BLACK;
    let baked = solved(&scene, &Request { epsilon: 1e-11, ..by_conjugate_gradients() });
    let factors = symmetric_factors(&baked);
    for channel in 0..3 {
        let mut matrix = factors.clone();
        for (i, row) in matrix.iter_mut().enumerate() {
            let reflectance = baked.patches.reflectance[i].to_array()[channel];
            row.iter_mut().for_each(|g| *g *= -reflectance / baked.patches.area[i]);
            row[i] += 1.0;
        }
        let emission = baked.patches.emission.iter().map(|e| e.to_array()[channel]).collect();
        for (i, direct) in eliminate(matrix, emission).into_iter().enumerate() {
            let iterated = baked.solution.radiosity[i].to_array()[channel];
            assert!((direct - iterated).abs() < 1e-8, "patch {i}: {iterated}, directly {direct}");
        }
    }
}

/// The mean radiosity over the area.
fn mean_luminance(baked: &Baked) -> f64 {
    let lit = baked.patches.area.iter().zip(&baked.solution.radiosity);
    lit.map(|(a, b)| a * b.luminance()).sum::<f64>() / baked.patches.total_area()
}

#[test]
fn solvers_agree() {
    let mut room = sides([0.0; 3], [4.0, 3.0, 2.5], 8, true);
    room.extend(sides([1.0, 1.0, 0.2], [2.0, 1.7, 0.8], 4, false));
    let scene = coloured(scene_of(room));
    let gathered = solved(&scene, &Request::default());
    // On the same factors, to the solvers' tolerance.
    let jacobi = solved(&scene, &Request { solver: Solver::Jacobi, ..Request::default() });
    for (a, b) in jacobi.solution.radiosity.iter().zip(&gathered.solution.radiosity) {
        assert!((*a - *b).norm_squared().sqrt() < 1e-5, "{a:?} {b:?}");
    }
    assert!(jacobi.solution.iterations > gathered.solution.iterations);
    // On averaged ones, to within what the hemicube lacks in reciprocity.
    let conjugate = solved(&scene, &by_conjugate_gradients());
    let (a, b) = (mean_luminance(&conjugate), mean_luminance(&gathered));
    assert!((a / b - 1.0).abs() < 0.02, "{a} {b}");
    let off = conjugate.solution.radiosity.iter().zip(&gathered.solution.radiosity);
    let off = off.map(|(a, b)| (a.luminance() - b.luminance()).powi(2)).sum::<f64>();
    let size = gathered.solution.radiosity.iter().map(|b| b.luminance().powi(2)).sum::<f64>();
    assert!((off / size).sqrt() < 0.03, "{}", (off / size).sqrt());
}

#[test]
fn conjugate_gradients_take_few_steps_where_nearly_all_is_reflected() {
    // A lamp in a closed room of reflectance 0.99: within 12 steps neither a step nor what it leaves of the equation is
    // more than a millionth of the answer. Furniture makes nooks, such as the gap under a box, that light leaves slowly.
    for (name, scene, most) in
        [("cube", cube(8), 8), ("furnished", furnished_room(), 12), ("tilted", tilted_room(), 12)]
    {
        let mut scene = scene;
        paint(&mut scene, |k| (Rgb::grey(if k == 1 { 1.0 } else { 0.0 }), Rgb::grey(0.99)));
        let conjugate = solved(&scene, &Request { epsilon: 1e-9, ..by_conjugate_gradients() });
        let history = &conjugate.solution.history;
        let size = conjugate.solution.radiosity.iter().map(|b| b.norm_squared()).sum::<f64>().sqrt();
        let steps = history.iter().position(|&residual| residual <= 1e-6 * size).unwrap() + 1;
        assert!(steps <= most, "{name}: {steps} steps, {history:?}");
        let jacobi = solved(&scene, &Request { solver: Solver::Jacobi, epsilon: 1e-3, ..Request::default() });
        assert!(jacobi.solution.iterations > 500, "{name}: {}", jacobi.solution.iterations);
    }
}

#[test]
fn the_ambient_term_guesses_the_mean_of_what_is_to_come() {
    // In a furnace the guess is right from the start: the ambient irradiance is E / (1 - ρ).
    let mut scene = cube(4);
    paint(&mut scene, |_| (Rgb::WHITE, Rgb::new(0.5, 0.8, 0.9)));
    let patches = radiosity::patches::subdivide(&scene, 1.0).unwrap();
    let start = Progressive::new(&patches);
    let display = start.display_radiosity();
    for (b, expected) in display[7].to_array().into_iter().zip([2.0, 5.0, 10.0]) {
        assert!((b / expected - 1.0).abs() < 1e-12, "{b} {expected}");
    }
}

#[test]
fn the_stopping_test_is_the_assignments() {
    let baked = solved(&coloured_room(), &Request::default());
    let history = &baked.solution.history;
    let (last, before) = (history.last().unwrap(), &history[..history.len() - 1]);
    assert!(*last <= 1e-6 && before.iter().all(|&r| r > 1e-6));
}

#[test]
fn a_room_that_reflects_all_is_named_and_does_not_loop() {
    for reflectance in [1.0, 1.2] {
        let mut scene = cube(3);
        paint(&mut scene, |_| (Rgb::WHITE, Rgb::grey(reflectance)));
        for solver in SOLVERS {
            match bake(&scene, &Request { solver, ..Request::default() }, &Run::default(), &mut ignore) {
                Err(BakeError::Solve(error @ SolveError::Diverges { .. })) => {
                    assert!(error.to_string().contains("make every reflectance (CD, GD) less than 1"));
                }
                other => panic!("{reflectance}, {solver:?}: {other:?}"),
            }
        }
    }
    // An open scene may reflect all that it gets, and more.
    let mut scene = scene_of([
        plate([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 3),
        plate([0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], 3),
    ]);
    paint(&mut scene, |k| (Rgb::grey(k as f64), Rgb::grey(1.5)));
    for solver in SOLVERS {
        solved(&scene, &Request { solver, ..Request::default() });
    }
}

#[test]
fn an_epsilon_below_rounding_still_ends() {
    let baked = solved(&coloured_room(), &Request { epsilon: 1e-300, ..Request::default() });
    assert!(*baked.solution.history.last().unwrap() < 1e-11);
}

#[test]
fn a_dark_scene_is_black() {
    let baked = solved(&cube(2), &Request::default());
    assert!(baked.solution.radiosity.iter().all(|b| b.is_black()));
    assert_eq!(baked.solution.history, [0.0]);
}

#[test]
fn stop_is_obeyed_at_once() {
    let scene = cube(8);
    let mut rows = 0;
    let result = bake(&scene, &Request::default(), &Run::default(), &mut |_| {
        rows += 1;
        if rows == 5 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert!(matches!(result, Err(BakeError::Interrupted(_))));
    assert_eq!(rows, 5);
    let mut sweeps = 0;
    let result = bake(&coloured_room(), &Request::default(), &Run::default(), &mut |progress| {
        sweeps += usize::from(matches!(progress, Progress::Solve { .. }));
        if sweeps == 2 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert!(matches!(result, Err(BakeError::Interrupted(_))));
    assert_eq!(sweeps, 2);
}

#[test]
fn too_much_is_refused_before_it_is_begun() {
    let mut scene = cube(60_000);
    let error = bake(&scene, &Request::default(), &Run::default(), &mut ignore).unwrap_err();
    assert!(matches!(error, BakeError::Memory { patches: 21_600_000_000, .. }), "{error:?}");
    assert!(error.to_string().contains("--subdivision"));
    // The patches would fit, their form factors would not: whoever wants these themselves is refused.
    scene = cube(20);
    let run = Run { threads: None, memory_limit: Some(4_000_000) };
    let patches = bake::patches(&scene, &Request::default(), &run).unwrap();
    let facets = Facets::new(&scene, &patches);
    let error =
        bake::form_factors(&scene, &patches, &facets, &Request::default(), &run, &mut ignore).unwrap_err();
    assert!(matches!(error, BakeError::Memory { patches: 2400, .. }), "{error:?}");
}

#[test]
fn what_does_not_fit_is_solved_all_the_same() {
    // Few rows kept, or none; the answer is the stored rows' own, bit for bit.
    let scene = coloured_room();
    let count = solved(&scene, &Request::default()).patches.len();
    for solver in SOLVERS {
        let request = Request { solver, method: Method::Hemicube { precision: 30 }, ..Request::default() };
        let stored = solved(&scene, &request);
        assert!(stored.recomputed.is_none() && !stored.form_factors.is_empty());
        for (memory_limit, some_kept) in [(260_000, true), (count as u64 * 492, false)] {
            let run = Run { threads: Some(2), memory_limit: Some(memory_limit) };
            let found = bake(&scene, &request, &run, &mut ignore).unwrap();
            let recomputed = found.recomputed.expect("it does not fit");
            assert_eq!(recomputed.kept > 0, some_kept, "{recomputed:?}");
            assert!(recomputed.kept < count && recomputed.need.bytes > memory_limit);
            assert_eq!(found.solution, stored.solution, "{solver:?}");
        }
    }
}

#[test]
fn rows_that_are_recomputed_stop_at_once() {
    let scene = coloured_room();
    let run = Run { threads: Some(2), memory_limit: Some(260_000) };
    let mut told = 0;
    let result = bake(&scene, &Request::default(), &run, &mut |_| {
        told += 1;
        if told == 600 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert!(matches!(result, Err(BakeError::Interrupted(_))));
    assert_eq!(told, 600);
}

#[test]
fn what_is_foretold_is_needed() {
    for scene in [cube(12), furnished_room(), tilted_room()] {
        let request = Request::default();
        let baked = solved(&scene, &request);
        let need = radiosity::bake::need(&baked.patches, &baked.facets, &request).unwrap();
        let found = baked.form_factors.nonzeros() as f64;
        assert!((need.nonzeros as f64 / found - 1.0).abs() < 0.2, "{need:?} {found}");
        let rows = baked.form_factors.rows().iter().map(|row| row.bytes_at_work()).sum::<u64>() as f64;
        let foretold = (need.bytes - baked.patches.len() as u64 * (BYTES_PER_PATCH + 11 * 24)) as f64;
        assert!((foretold / rows - 1.0).abs() < 0.2, "{foretold} {rows}");
        assert_eq!(bake::foretell(&scene, &request, &Run::default()).unwrap(), need);
    }
}

#[test]
fn of_exact_rows_some_columns_foretell_the_rest() {
    let exact = Method::Exact { accuracy: 1e-3 };
    let shares = Method::HemicubeExact { precision: 60, eyes: 2, accuracy: 1e-3 };
    for (scene, method) in [(cube(12), exact), (tilted_room(), exact), (cube(12), shares)] {
        let request = Request { method, ..Request::default() };
        let baked = solved(&scene, &request);
        let need = bake::need(&baked.patches, &baked.facets, &request).unwrap();
        let found = baked.form_factors.nonzeros() as f64;
        assert!((need.nonzeros as f64 / found - 1.0).abs() < 0.1, "{method:?} {need:?} {found}");
    }
}

#[test]
fn what_is_too_fine_to_be_cut_is_foretold_from_a_coarser_cut() {
    // Somewhat more patches than are sampled: as of all of them.
    let request = Request { method: Method::Hemicube { precision: 30 }, ..Request::default() };
    let run = Run { threads: None, memory_limit: Some(1_000_000_000_000) };
    let scene = cube(340);
    let patches = bake::patches(&scene, &request, &run).unwrap();
    let all = bake::need(&patches, &Facets::new(&scene, &patches), &request).unwrap();
    let foretold = bake::foretell(&scene, &request, &run).unwrap();
    assert_eq!(foretold.patches, all.patches);
    assert!((foretold.bytes as f64 / all.bytes as f64 - 1.0).abs() < 0.1, "{foretold:?} {all:?}");
    // A thousand million, at once; no row has more entries than its hemicube has cells.
    let foretold = bake::foretell(&cube(13_000), &request, &run).unwrap();
    assert_eq!(foretold.patches, 6 * 13_000 * 13_000);
    let a_row = foretold.nonzeros as f64 / foretold.patches as f64;
    assert!(a_row <= 2700.0 && a_row > 2000.0, "{a_row}");
}

#[test]
fn requests_without_sense_are_refused() {
    let scene = cube(2);
    let refused =
        |request: Request| bake(&scene, &request, &Run::default(), &mut ignore).unwrap_err().to_string();
    let odd = Method::Hemicube { precision: 99 };
    assert!(refused(Request { method: odd, ..Request::default() }).contains("precision 99"));
    for epsilon in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(refused(Request { epsilon, ..Request::default() }).contains("epsilon"));
    }
    for subdivision in [0.0, -2.0, f64::NAN, f64::INFINITY] {
        assert!(
            refused(Request { subdivision: subdivision.into(), ..Request::default() })
                .contains("subdivision factor")
        );
    }
    assert!(
        bake(&scene_of([]), &Request::default(), &Run::default(), &mut ignore)
            .unwrap_err()
            .to_string()
            .contains("no surface")
    );
    assert_eq!(Request::default().solver, Solver::GaussSeidel);
}

#[test]
fn black_backs_darken() {
    // A lamp over the back of a plate: seen from below, the plate's back is black, or as lit as its front.
    let mut scene = scene_of([
        plate([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 4),
        plate([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 4),
    ]);
    paint(&mut scene, |k| (Rgb::grey(k as f64), Rgb::grey(0.5)));
    let light = |back_faces| {
        let request = Request { back_faces: Some(back_faces), ..Request::default() };
        solved(&scene, &request).solution.radiosity[5].r
    };
    assert_eq!(light(BackFaces::Black), 0.0);
    assert!(light(BackFaces::Lit) > 0.05);
}
