//! Refinement until a target error: that it is reached, where patches are quartered, that the cut is graded and without cracks, and
//! that rows which are kept are those that would be found.

mod rooms;

use std::collections::HashMap;
use std::ops::ControlFlow;

use glam::DVec3;
use radiosity::bake::{self, BakeError, Baked, Method, Request, Run, Solver, bake};
use radiosity::light::Rgb;
use radiosity::patches::{Cutting, Origin, Patches, Place, Refinement, refined as cut};
use radiosity::refine::{Refined, Stop, Target, refine};
use radiosity::scene::n3d::parse_scene;
use radiosity::scene::{BackFaces, Scene};
use radiosity::shade::{ShadedSurfaces, Shading};
use radiosity::visibility::{FacetShape, Facets};
use radiosity::watch::ignore;

use rooms::{cube, paint, plate, scene_of, sides};

const QUICK: Method = Method::Hemicube { precision: 50 };
const EXACT: Method = Method::Exact { accuracy: 1e-3 };

fn by(method: Method) -> Request {
    Request { method, ..Request::default() }
}

fn refined(scene: &Scene, request: Request, target: Target) -> Refined {
    refine(scene, &request, &target, &Run::default(), &mut ignore).unwrap()
}

/// A box that stands on the floor of a room, and a lamp under its ceiling.
fn room(cells: u32) -> Scene {
    let mut surfaces = sides([0.0; 3], [3.0, 3.0, 2.0], cells, true);
    // Its floor is the room's.
    surfaces.extend(sides([1.0, 1.2, 0.0], [1.8, 2.0, 0.9], cells / 2, false).split_off(1));
    surfaces.push(plate([0.5, 0.3, 1.9], [0.0, 0.8, 0.0], [0.8, 0.0, 0.0], 1));
    let mut scene = scene_of(surfaces);
    scene.back_faces = BackFaces::Black;
    let lamp = scene.surfaces.len() - 1;
    paint(&mut scene, |k| (Rgb::grey(if k == lamp { 20.0 } else { 0.0 }), Rgb::grey(0.5)));
    scene
}

/// For each point, the patch of its surface that it lies on.
fn patches_at(facets: &Facets, points: &[(u32, DVec3)]) -> Vec<usize> {
    let at = |&(surface, point): &(u32, DVec3)| {
        let facets = facets.fewest();
        let depth = |facet: u32| {
            let (u, v) = facets[facet].uv(point);
            match facets[facet].shape {
                FacetShape::Triangle => u.min(v).min(1.0 - u - v),
                FacetShape::Parallelogram => u.min(v).min(1.0 - u).min(1.0 - v),
            }
        };
        let facet = facets.of_surface(surface).max_by(|&a, &b| depth(a).total_cmp(&depth(b))).unwrap();
        let (u, v) = facets[facet].uv(point);
        facets[facet].patch_at(u, v) as usize
    };
    points.iter().map(at).collect()
}

/// How far the values of an answer are off the light at every point, as the root of the mean square, relative.
fn true_error(answer: &Baked, truth: &Baked) -> f64 {
    let fine = &truth.patches;
    let points: Vec<(u32, DVec3)> = fine.surface.iter().copied().zip(fine.centre.iter().copied()).collect();
    let on = patches_at(&answer.facets, &points);
    let (mut off, mut all) = (0.0, 0.0);
    for (i, patch) in on.into_iter().enumerate().filter(|&(i, _)| fine.emission[i].is_black()) {
        let light = truth.solution.radiosity[i];
        off += fine.area[i] * (answer.solution.radiosity[patch] - light).norm_squared();
        all += fine.area[i] * light.norm_squared();
    }
    (off / all).sqrt()
}

/// The same at many points, each of which looks out by a fine hemicube.
fn truth(scene: &Scene, finer: f64) -> Baked {
    let request = Request { subdivision: finer.into(), ..by(Method::Hemicube { precision: 200 }) };
    bake(scene, &request, &Run::default(), &mut ignore).unwrap()
}

fn per_cent(share: f64) -> String {
    format!("{:.2} %", 100.0 * share)
}

/// A room with a lamp close to a wall, which it faces.
fn hot_spot(cells: u32) -> Scene {
    let mut surfaces = sides([0.0; 3], [3.0, 3.0, 2.0], cells, true);
    surfaces.push(plate([0.3, 1.2, 0.9], [0.0, 0.0, 0.4], [0.0, 0.4, 0.0], 1));
    let mut scene = scene_of(surfaces);
    scene.back_faces = BackFaces::Black;
    paint(&mut scene, |k| (Rgb::grey(if k == 6 { 20.0 } else { 0.0 }), Rgb::grey(0.5)));
    scene
}

#[test]
fn the_target_is_reached_and_takes_far_fewer_patches_than_a_uniform_cut() {
    let scene = hot_spot(4);
    let truth = truth(&scene, 7.0);
    let found = refined(&scene, by(EXACT), Target::new(0.1));
    let (last, true_found) = (found.rounds.last().unwrap(), true_error(&found.baked, &truth));
    println!("{} patches, told {}, true {}", last.patches, per_cent(last.error), per_cent(true_found));
    assert_eq!(found.stop, Stop::Target);
    assert!(last.error <= 0.1 && true_found <= 0.1 && true_found > 0.03, "{true_found}");
    // Twice as many of one size do not do.
    let finer = (2.0 * last.patches as f64 / 97.0).sqrt().ceil();
    let request = Request { subdivision: finer.into(), ..by(EXACT) };
    let uniform = bake(&scene, &request, &Run::default(), &mut ignore).unwrap();
    let true_uniform = true_error(&uniform, &truth);
    println!("uniform: {} patches, true {}", uniform.patches.len(), per_cent(true_uniform));
    assert!(uniform.patches.len() > 2 * last.patches);
    assert!(true_uniform > true_found, "{true_uniform} {true_found}");
}

/// A floor under a small lamp, and a sheet between them that hides half of it: a shadow's edge where x is 2.
const SHADOW: &str = "
    QD 6 6  0 0 0  0 0 4  4 0 4  4 0 0  CD .5 .5 .5 ID
    QD 1 1  1.95 2 1.8  2.05 2 1.8  2.05 2 2.2  1.95 2 2.2  CE 90 90 90 ID
    QD 1 1  2 1 0  4 1 0  4 1 4  2 1 4  ID";

#[test]
fn patches_gather_at_a_shadow_s_edge() {
    let mut scene = parse_scene("a.scn", SHADOW.as_bytes()).unwrap();
    scene.back_faces = BackFaces::Black;
    for method in [Method::Hemicube { precision: 100 }, EXACT] {
        let found = refined(&scene, by(method), Target { most_patches: 1500, ..Target::new(0.1) });
        let patches = &found.baked.patches;
        let floor = || patches.blocks[0].patches();
        let smallest = floor().map(|i| patches.area[i]).fold(f64::INFINITY, f64::min);
        println!("{method:?}: {:?}, {} patches, down to {smallest}", found.stop, patches.len());
        assert!(smallest < 1.1 * 16.0 / 48.0 / 48.0, "{smallest}");
        for i in floor().filter(|&i| patches.area[i] < 1.5 * smallest) {
            let (x, side) = (patches.centre[i].x, patches.area[i].sqrt());
            assert!((x - 2.0).abs() < 0.1 + 2.0 * side, "{method:?}: {side} wide at {x}");
        }
        // What is in the dark stays as it was.
        assert!(floor().any(|i| patches.area[i] > 0.44));
    }
}

#[test]
fn a_furnace_is_as_it_should_be_in_the_first_round() {
    let mut scene = cube(3);
    paint(&mut scene, |_| (Rgb::grey(0.5), Rgb::grey(0.5)));
    let found = refined(&scene, by(EXACT), Target::new(0.01));
    assert_eq!((found.stop, found.rounds.len(), found.baked.patches.len()), (Stop::Target, 1, 54));
    // Alone on its surface, nothing is known of a patch: then a round more.
    let mut scene = cube(1);
    paint(&mut scene, |k| (Rgb::grey(0.5 - 0.08 * k as f64), Rgb::grey(0.5 + 0.08 * k as f64)));
    let found = refined(&scene, by(EXACT), Target::new(0.01));
    assert_eq!((found.stop, found.rounds.len(), found.baked.patches.len()), (Stop::Target, 2, 24));
}

/// Surfaces of every kind; the first two go on in one another.
const KINDS: &str = "
    QD 4 4  0 0 0  4 0 0  4 4 0  0 4 0 ID   QD 4 4  4 0 0  8 0 0  8 4 0  4 4 0 ID
    QD 3 3  0 0 9  3 0 9  3 3 9.4  0 3 9.1 ID  PG 3 0 9  6 0 9  6 2 9  5 3 9  3 3 9  3 0 9 ID
    SP NM 12 7 TR 2 2 4 ID   CL NM 9 3 TR 5 5 5 ID
    TI 0 0 7  1 0 7  0 1 7 ID
    VO 0 0 0 4  -.5 -.5 -6  .9 -.4 -5  .1 .8 -6  .2 .1 -3  4  1 3 2  1 2 4  2 3 4  3 1 4 ID
    FR 2 .1 4  0 0 -9  2 0 -9  0 2 -9 ID
    QD 1 1  2.3 -1 0  2.3 5 0  2.3 5 2  2.3 -1 2 ID";

/// The cut with the cell that is nearest to a corner of each surface quartered again and again.
fn quartered(scene: &Scene, halvings: u32, split: bool) -> (Patches, Vec<Origin>) {
    let cutting = Cutting { split, ..Cutting::default() };
    let mut refinement = Refinement::default();
    let (mut patches, mut origins) = cut(scene, cutting, &refinement).unwrap();
    for _ in 0..halvings {
        for block in &patches.blocks {
            // Off the middle, at the border, so that others have to follow.
            let first = patches.centre[block.first as usize];
            let far = |i: &usize| patches.centre[*i].distance(first);
            let nearest_to = |at: DVec3| {
                let near = |i: &usize| patches.centre[*i].distance(at);
                block.patches().min_by(|a, b| near(a).total_cmp(&near(b))).unwrap()
            };
            let last = block.patches().max_by(|a, b| far(a).total_cmp(&far(b))).unwrap();
            for i in [block.patches().start, last, nearest_to(patches.centre[last].lerp(first, 0.4))] {
                refinement.quarter(origins[i].place);
            }
        }
        (patches, origins) = cut(scene, cutting, &refinement).unwrap();
    }
    (patches, origins)
}

type Edge = [[u64; 3]; 2];

/// The pieces on either side of each edge: which surface, which piece, which patch.
fn sides_of_edges(patches: &Patches, surfaces: &[usize]) -> HashMap<Edge, Vec<(usize, usize, u32)>> {
    let key = |p: DVec3| (p + DVec3::ZERO).to_array().map(f64::to_bits);
    let mut edges: HashMap<Edge, Vec<(usize, usize, u32)>> = HashMap::new();
    for &surface in surfaces {
        let pieces = patches.pieces[surface].as_ref().unwrap();
        for (piece, triangle) in pieces.triangles.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (key(triangle[k]), key(triangle[(k + 1) % 3]));
                if a != b {
                    let side = (surface, piece, pieces.patch[piece]);
                    edges.entry([a.min(b), a.max(b)]).or_default().push(side);
                }
            }
        }
    }
    edges
}

fn length([a, b]: &Edge) -> f64 {
    DVec3::from_array(a.map(f64::from_bits)).distance(DVec3::from_array(b.map(f64::from_bits)))
}

#[test]
fn neighbours_are_at_most_twice_as_long_and_fit_corner_to_corner() {
    let scene = parse_scene("a.scn", KINDS.as_bytes()).unwrap();
    for split in [false, true] {
        let (whole, _) = quartered(&scene, 0, false);
        let (patches, origins) = quartered(&scene, 4, split);
        assert_eq!(origins.len(), patches.len());
        assert!(origins.iter().any(|origin| origin.place.halvings() == 4));
        for surface in 0..scene.surfaces.len() {
            let area = |patches: &Patches| -> f64 {
                patches.blocks[surface].patches().map(|i| patches.area[i]).sum()
            };
            assert!((area(&patches) / area(&whole) - 1.0).abs() < 1e-9, "surface {surface}");
        }
        let groups: [&[usize]; 9] = [&[0, 1], &[2], &[3], &[4], &[5], &[6], &[7], &[8], &[9]];
        for group in groups {
            let edges = sides_of_edges(&patches, group);
            for sides in edges.values() {
                if let [(_, _, one), (_, _, other)] = sides[..] {
                    let halvings = [one, other].map(|i| origins[i as usize].place.halvings());
                    assert!(halvings[0].abs_diff(halvings[1]) <= 1, "{group:?}: {halvings:?}");
                }
                assert!(sides.len() <= 2);
            }
            // What has a piece on one side only is the outline, as it was.
            let rim: f64 =
                edges.iter().filter(|(_, sides)| sides.len() == 1).map(|(edge, _)| length(edge)).sum();
            let expected = match group {
                [0, 1] => 24.0,
                [4] | [7] => 0.0,
                [6] => 2.0 + 2.0_f64.sqrt(),
                [9] => 16.0,
                _ => continue,
            };
            assert!((rim - expected).abs() < 1e-9, "{group:?}: {rim}");
        }
    }
}

#[test]
fn the_same_refinement_makes_the_same_patches_and_names_where_they_are() {
    let scene = parse_scene("a.scn", KINDS.as_bytes()).unwrap();
    let (patches, origins) = quartered(&scene, 3, true);
    assert_eq!(quartered(&scene, 3, true), (patches.clone(), origins.clone()));
    for (i, origin) in origins.iter().enumerate() {
        assert_eq!(origin.place.surface, patches.surface[i]);
    }
    let mut sorted = origins.clone();
    sorted.dedup();
    assert_eq!(sorted, origins);
    // Deeper than anybody may ask is not quartered.
    let mut refinement = Refinement::default();
    let mut place = Place::of_cell(0, 5);
    for _ in 0..20 {
        refinement.quarter(place);
        place = Place { path: place.path << 2 | 3, ..place };
        if place.halvings() > 13 {
            break;
        }
    }
    let (_, origins) = cut(&scene, Cutting::default(), &refinement).unwrap();
    assert_eq!(origins.iter().map(|origin| origin.place.halvings()).max(), Some(12));
}

#[test]
fn smooth_shading_has_no_cracks() {
    let scene = parse_scene("a.scn", KINDS.as_bytes()).unwrap();
    let (patches, _) = quartered(&scene, 4, false);
    let facets = Facets::new(&scene, &patches);
    let values: Vec<Rgb> = (0..patches.len()).map(|i| Rgb::grey(((i * 37) % 101) as f64)).collect();
    let shaded = ShadedSurfaces::new(&scene, &patches, &facets, &values, Shading::Smooth);
    // The two floors as one, the sphere, the cylinder: of others creases part the faces.
    for group in [&[0, 1][..], &[4], &[5]] {
        let mut compared = 0;
        for (edge, sides) in sides_of_edges(&patches, group) {
            let [one, other] = sides[..] else { continue };
            let ends = edge.map(|end| DVec3::from_array(end.map(f64::from_bits)));
            for share in [0.0, 0.3, 1.0] {
                let point = ends[0].lerp(ends[1], share);
                let [here, there] = [one, other].map(|(surface, piece, _)| {
                    let facet = facets.of_surface(surface as u32).start + piece as u32;
                    let (u, v) = facets[facet].uv(point);
                    shaded.at(facet, u, v).r
                });
                assert!((here - there).abs() < 1e-6, "{group:?}: {here} and {there} at {point}");
                compared += 1;
            }
        }
        assert!(compared > 300, "{compared}");
    }
}

/// Two rooms with nothing in common, each with its own light.
fn two_rooms() -> Scene {
    let mut surfaces = sides([0.0; 3], [1.0, 1.0, 1.0], 3, true);
    surfaces.extend(sides([5.0, 0.0, 0.0], [6.0, 1.0, 1.0], 3, true));
    surfaces.push(plate([0.3, 0.2, 0.6], [0.0, 0.3, 0.0], [0.3, 0.0, 0.0], 2));
    let mut scene = scene_of(surfaces);
    scene.back_faces = BackFaces::Black;
    paint(&mut scene, |k| {
        let light = if k == 12 {
            5.0
        } else if k >= 6 {
            0.5
        } else {
            0.0
        };
        (Rgb::grey(light), Rgb::grey(0.5))
    });
    scene
}

#[test]
fn rows_that_are_kept_are_those_that_would_be_found() {
    // A furnace beside a room: of its rows none is ever found again.
    let scene = two_rooms();
    for method in [QUICK, EXACT] {
        let found = refined(&scene, by(method), Target { most_patches: 700, ..Target::new(0.1) });
        let (patches, facets) = (&found.baked.patches, &found.baked.facets);
        assert!(found.rounds.len() > 2);
        for pair in found.rounds.windows(2) {
            assert!(pair[1].rows_found + 54 <= pair[1].patches, "{pair:?}");
        }
        let fresh =
            bake::form_factors(&scene, patches, facets, &by(method), &Run::default(), &mut ignore).unwrap();
        if method == QUICK {
            assert!(found.baked.form_factors == fresh);
            continue;
        }
        // By reciprocity within the accuracy, most to the last digits of single precision.
        let (mut alike, mut all) = (0, 0);
        for i in 0..patches.len() {
            let (kept, row) = (found.baked.form_factors.row(i), fresh.row(i));
            assert!((kept.sum() - row.sum()).abs() < 1e-2, "{} {}", kept.sum(), row.sum());
            for (j, factor) in row.iter() {
                let off = (kept.get(j) - factor).abs();
                assert!(off < 5e-3, "{i} {j}: {factor} {off}");
                alike += usize::from(off <= 1e-6 * factor);
                all += 1;
            }
        }
        assert!(alike as f64 > 0.9 * f64::from(all), "{alike} of {all}");
        assert!(found.rounds.last().unwrap().rows_found < patches.len() * 9 / 10);
    }
}

#[test]
fn every_solver_and_option_goes_with_it() {
    let scene = room(2);
    let target = Target { most_patches: 400, ..Target::new(0.2) };
    let usual = by(QUICK);
    let requests = [
        Request { solver: Solver::Progressive, epsilon: 1e-3, ..usual },
        Request { solver: Solver::ConjugateGradients, ..usual },
        Request { solver: Solver::Jacobi, ..usual },
        Request { repair: true, ..usual },
        Request { split: Some(true), grading: 1, ..usual },
        Request { surroundings: Rgb::grey(1.0), ..usual },
        by(Method::HemicubeRays { precision: 20 }),
    ];
    let plain = refined(&scene, usual, target);
    assert!(plain.rounds.len() > 1);
    for request in requests {
        let found = refined(&scene, request, target);
        assert!(found.rounds.len() > 1, "{request:?}");
        assert!(found.baked.patches.parent.len() == found.baked.patches.len());
        assert_eq!(found.baked.closing.is_some(), request.repair);
        let mean = |found: &Refined| {
            let Baked { patches, solution, .. } = &found.baked;
            let light = solution.radiosity.iter().zip(&patches.area).map(|(b, area)| b.r * area);
            light.sum::<f64>() / patches.total_area()
        };
        let (here, there) = (mean(&found), mean(&plain));
        assert!((here / there - 1.0).abs() < 0.15, "{request:?}: {here} {there}");
    }
}

#[test]
fn the_same_bits_on_any_number_of_threads() {
    let scene = room(2);
    let target = Target { most_patches: 300, ..Target::new(0.15) };
    let on = |threads| {
        let run = Run { threads: Some(threads), ..Run::default() };
        let found = refine(&scene, &by(EXACT), &target, &run, &mut ignore).unwrap();
        (found.baked.patches, found.baked.solution, found.rounds)
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn parents_are_the_patches_of_the_first_cut() {
    let scene = room(3);
    let request = Request { split: Some(true), ..by(QUICK) };
    let start = bake::patches(&scene, &request, &Run::default()).unwrap();
    let found = refined(&scene, request, Target { most_patches: 600, ..Target::new(0.15) });
    let patches = &found.baked.patches;
    assert!(patches.len() > start.len());
    let mut area = vec![0.0; start.len()];
    for (i, &parent) in patches.parent.iter().enumerate() {
        assert_eq!(patches.surface[i], start.surface[parent as usize]);
        area[parent as usize] += patches.area[i];
    }
    for (found, known) in area.iter().zip(&start.area) {
        assert!((found / known - 1.0).abs() < 1e-9, "{found} {known}");
    }
}

#[test]
fn limits_say_which() {
    let scene = room(2);
    let stop = |request: Request, target: Target, run: Run| {
        let found = refine(&scene, &request, &target, &run, &mut ignore).unwrap();
        assert!(found.baked.patches.len() as u64 <= target.most_patches);
        assert!(found.stop == Stop::Target || found.rounds.last().unwrap().error > target.error);
        found.stop
    };
    let (usual, run) = (by(EXACT), Run::default());
    assert_eq!(stop(usual, Target::new(0.5), run), Stop::Target);
    assert_eq!(stop(usual, Target { most_patches: 200, ..Target::new(0.01) }, run), Stop::MostPatches);
    let coarse = Target { smallest_patch: Some(0.6), ..Target::new(0.01) };
    assert_eq!(stop(usual, coarse, run), Stop::SmallestPatch);
    let rough = by(Method::Exact { accuracy: 1e-2 });
    assert_eq!(stop(rough, Target::new(0.003), run), Stop::FormFactors);
    let few_cells = by(Method::Hemicube { precision: 6 });
    assert_eq!(stop(few_cells, Target { most_patches: 3000, ..Target::new(0.02) }, run), Stop::FormFactors);
    let loose = Request { epsilon: 3.0, solver: Solver::Jacobi, ..usual };
    assert_eq!(stop(loose, Target::new(0.02), run), Stop::Residual);
    let little = Run { memory_limit: Some(300_000), ..run };
    assert_eq!(stop(usual, Target::new(0.01), little), Stop::Memory);
}

#[test]
fn what_cannot_be_is_refused_and_stop_is_stop() {
    let scene = room(2);
    let usual = by(QUICK);
    for error in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = refine(&scene, &usual, &Target::new(error), &Run::default(), &mut ignore);
        assert!(matches!(refused, Err(BakeError::BadRequest(_))), "{error}");
    }
    let none = Run { memory_limit: Some(10_000), ..Run::default() };
    let refused = refine(&scene, &usual, &Target::new(0.1), &none, &mut ignore);
    assert!(matches!(refused, Err(BakeError::Memory { .. })));
    // Wherever it is.
    for after in [0, 40, 150] {
        let mut told = 0;
        let mut watch = |_: &_| {
            told += 1;
            if told > after { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let stopped = refine(&scene, &usual, &Target::new(0.01), &Run::default(), &mut watch);
        assert!(matches!(stopped, Err(BakeError::Interrupted(_))), "{after}");
    }
}

/// The table of `docs/refinement.md`.
#[test]
#[ignore = "takes minutes"]
fn table_of_targets() {
    for (what, scene) in [("room", room(4)), ("hot spot", hot_spot(4))] {
        let truth = truth(&scene, 10.0);
        for (name, method) in [("exact", EXACT), ("hemicube 100", Method::Hemicube { precision: 100 })] {
            for factor in [1.0, 2.0, 3.0, 4.0, 5.0, 6.0] {
                let started = std::time::Instant::now();
                let request = Request { subdivision: factor.into(), ..by(method) };
                let uniform = bake(&scene, &request, &Run::default(), &mut ignore).unwrap();
                let seconds = started.elapsed().as_secs_f64();
                let error = per_cent(true_error(&uniform, &truth));
                println!(
                    "| {what} | {name} | uniform | {} | | {error} | {seconds:.2} |",
                    uniform.patches.len()
                );
            }
            for target in [0.2, 0.1, 0.07, 0.05] {
                let started = std::time::Instant::now();
                let found = refined(&scene, by(method), Target::new(target));
                let seconds = started.elapsed().as_secs_f64();
                let error = per_cent(true_error(&found.baked, &truth));
                let told = found.rounds.last().unwrap();
                println!(
                    "| {what} | {name} | {} | {} | {} | {error} | {seconds:.2} | {:?} {:?}",
                    per_cent(target),
                    told.patches,
                    per_cent(told.error),
                    found.stop,
                    found.rounds.iter().map(|round| (round.patches, round.rows_found)).collect::<Vec<_>>(),
                );
            }
        }
    }
}
