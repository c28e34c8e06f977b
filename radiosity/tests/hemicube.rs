//! The hemicube's form factors against their laws, known answers, and each other.

mod rooms;

use radiosity::bake::{Baked, Method, Request, Run, bake};
use radiosity::form_factors::hemicube::{
    CellWeights, Face, Hemicube, Scratch, delta_form_factor_side, delta_form_factor_top,
};
use radiosity::form_factors::shares::{self, Shares};
use radiosity::form_factors::{ExchangeAreas, FormFactors, compute_rows};
use radiosity::light::Rgb;
use radiosity::patches::{Patches, Subdivision, subdivide};
use radiosity::scene::{BackFaces, Scene};
use radiosity::simd::Level;
use radiosity::visibility::{Facets, RayTree};
use radiosity::watch::ignore;

use rooms::{cube, furnished_room, paint, plate, scene_of, sides, tilted, tilted_room, triangulated};

/// Patches, facets and form factors of a scene, both sides lit.
fn factors(scene: &Scene, precision: u32) -> (Patches, Facets, FormFactors) {
    let patches = subdivide(scene, 1.0).unwrap();
    let facets = Facets::new(scene, &patches);
    let weights = CellWeights::new(precision).unwrap();
    let hemicube = Hemicube::new(&patches, &facets, BackFaces::Lit, weights);
    let row = |patch, scratch: &mut Scratch| hemicube.row(patch, scratch);
    let found = compute_rows(patches.len(), 0, Scratch::default, row, &mut ignore).unwrap();
    (patches, facets, found)
}

/// The form factor from all of surface 0 to all of surface 1.
fn between_surfaces(patches: &Patches, factors: &FormFactors) -> f64 {
    let [first, second] = [patches.blocks[0].patches(), patches.blocks[1].patches()];
    let power: f64 = first
        .clone()
        .map(|i| patches.area[i] * second.clone().map(|j| factors.row(i).get(j)).sum::<f64>())
        .sum();
    power / first.map(|i| patches.area[i]).sum::<f64>()
}

#[test]
fn weights_sum_to_one_at_any_precision() {
    for precision in [2, 10, 30, 50, 100, 512] {
        let sum = CellWeights::new(precision).unwrap().sum();
        assert!((sum - 1.0).abs() < 1e-13, "{precision}: {sum}");
    }
}

#[test]
fn weights_at_cell_centres_are_the_papers_delta_form_factors() {
    // Published sums: 1 + 5.4e-5 at 100 cells, 1 + 2.2e-4 at 50; and each cell's exact weight is near its own.
    for (precision, excess) in [(100_u32, 5.4e-5), (50, 2.2e-4)] {
        let weights = CellWeights::new(precision).unwrap();
        let n = precision as usize;
        let area = 4.0 / f64::from(precision).powi(2);
        let centre = |k: usize, from: f64| from + (k as f64 + 0.5) * 2.0 / n as f64;
        let mut sum = 0.0;
        let mut check = |exact: f64, delta: f64, copies: f64| {
            assert!((exact / delta - 1.0).abs() < 2.0 * area, "{exact} {delta}");
            sum += copies * delta;
        };
        for y in 0..n {
            for x in 0..n {
                let top = delta_form_factor_top(centre(x, -1.0), centre(y, -1.0), area);
                check(weights.top(x, y), top, 1.0);
            }
        }
        for y in 0..n / 2 {
            for x in 0..n {
                let side = delta_form_factor_side(centre(x, -1.0), centre(y, 0.0), area);
                check(weights.side(x, y), side, 4.0);
            }
        }
        assert!((sum - 1.0 - excess).abs() < 0.02 * excess, "{precision}: 1 + {}", sum - 1.0);
    }
}

#[test]
fn odd_tiny_and_absurd_precisions_make_no_hemicube() {
    for precision in [0, 1, 3, 99, 101, 4098, u32::MAX] {
        assert_eq!(CellWeights::new(precision), None, "{precision}");
    }
}

#[test]
fn every_row_of_a_closed_scene_sums_to_one() {
    let scenes = [
        ("cube", cube(8)),
        ("furnished", furnished_room()),
        ("tilted", tilted_room()),
        ("triangles", triangulated(tilted_room())),
    ];
    for (name, scene) in scenes {
        for precision in [30, 100] {
            let (_, _, factors) = factors(&scene, precision);
            let (low, high) = factors.row_sum_range();
            assert!((low - 1.0).abs() < 2e-6 && (high - 1.0).abs() < 2e-6, "{name}: {low} to {high}");
        }
    }
}

#[test]
fn parallel_squares() {
    // Howell C-11: unit squares face to face at distance 1.
    let exact = 0.199824895698;
    let mut errors = Vec::new();
    for (cells, precision) in [(4, 30), (10, 100), (20, 200)] {
        let scene = scene_of([
            plate([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], cells),
            plate([0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], cells),
        ]);
        let (patches, _, factors) = factors(&scene, precision);
        errors.push((between_surfaces(&patches, &factors) / exact - 1.0).abs());
    }
    assert!(errors[1] < 0.015, "{errors:?}");
    assert!(errors[2] < errors[0] / 4.0, "{errors:?}");
}

#[test]
fn perpendicular_squares() {
    // Howell C-14: unit squares with a common edge at a right angle.
    let exact = 0.200043776075;
    let mut errors = Vec::new();
    for (cells, precision) in [(5, 50), (10, 100), (20, 200)] {
        let scene = scene_of([
            plate([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], cells),
            plate([0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], cells),
        ]);
        let (patches, _, factors) = factors(&scene, precision);
        errors.push((between_surfaces(&patches, &factors) / exact - 1.0).abs());
    }
    assert!(errors[1] < 0.015 && errors[2] < 0.006, "{errors:?}");
    assert!(errors[2] < errors[0] / 3.0, "{errors:?}");
}

/// Σ |A_i F_ij - A_j F_ji| over Σ (A_i F_ij + A_j F_ji).
fn reciprocity_error(patches: &Patches, factors: &FormFactors) -> f64 {
    let (mut apart, mut total) = (0.0, 0.0);
    for i in 0..patches.len() {
        for (j, factor) in factors.row(i).iter() {
            let (there, back) = (patches.area[i] * factor, patches.area[j] * factors.row(j).get(i));
            apart += (there - back).abs();
            total += there + back;
        }
    }
    apart / total
}

#[test]
fn reciprocity_within_the_hemicubes_own_error() {
    // What N cells resolve, down to what the centre's standing for the whole patch leaves.
    let errors = [30, 100, 300].map(|precision| {
        let (patches, _, factors) = factors(&cube(8), precision);
        reciprocity_error(&patches, &factors)
    });
    assert!(errors[0] < 0.12 && errors[1] < 0.04 && errors[2] < 0.025, "{errors:?}");
    assert!(errors[2] < errors[1] && errors[1] < errors[0], "{errors:?}");
}

#[test]
fn the_item_buffer_sees_what_rays_see() {
    for scene in [cube(5), furnished_room(), tilted_room(), triangulated(tilted_room())] {
        let patches = subdivide(&scene, 1.0).unwrap();
        let facets = Facets::new(&scene, &patches);
        let tree = RayTree::new(&facets);
        let weights = CellWeights::new(50).unwrap();
        let hemicube = Hemicube::new(&patches, &facets, BackFaces::Lit, weights);
        let mut scratch = Scratch::default();
        let (mut cells, mut inner_differences) = (0, 0);
        for patch in (0..patches.len()).step_by(7) {
            for face in Face::ALL {
                let by_rays = hemicube.face_by_rays(patch, face, &tree);
                let by_items = hemicube.face(patch, face, &mut scratch);
                assert_eq!(by_rays.len(), by_items.len());
                let width = 50;
                let height = by_rays.len() / width;
                for (k, (ray, item)) in by_rays.iter().zip(&by_items).enumerate() {
                    cells += 1;
                    if ray == item {
                        continue;
                    }
                    // Only where an edge crosses the cell may they differ: then a neighbour differs too.
                    let (x, y) = (k % width, k / width);
                    let around = (y.saturating_sub(1)..(y + 2).min(height))
                        .flat_map(|y| (x.saturating_sub(1)..(x + 2).min(width)).map(move |x| y * width + x));
                    if around.clone().all(|k| by_rays[k] == *ray) {
                        inner_differences += 1;
                    }
                }
                let differing = by_rays.iter().zip(&by_items).filter(|(a, b)| a != b).count();
                assert!(differing * 200 < by_rays.len() * 3, "{differing} of {}", by_rays.len());
            }
        }
        assert!(cells > 0);
        assert_eq!(inner_differences, 0, "of {cells}");
    }
}

#[test]
fn rows_by_runs_are_rows_by_cells() {
    // The row that adds whole runs of cells at once, against its own faces added cell by cell.
    for scene in [cube(9), furnished_room(), tilted_room(), triangulated(tilted_room())] {
        let patches = subdivide(&scene, 1.0).unwrap();
        let facets = Facets::new(&scene, &patches);
        let weights = CellWeights::new(100).unwrap();
        let hemicube = Hemicube::new(&patches, &facets, BackFaces::Lit, weights.clone());
        let mut scratch = Scratch::default();
        for patch in (0..patches.len()).step_by(11) {
            let mut by_cells = vec![0.0; patches.len()];
            for face in Face::ALL {
                for (k, seen) in hemicube.face(patch, face, &mut scratch).into_iter().enumerate() {
                    let (x, y) = (k % 100, k / 100);
                    let weight = if face == Face::Top { weights.top(x, y) } else { weights.side(x, y) };
                    if let Some(j) = seen {
                        by_cells[j as usize] += weight;
                    }
                }
            }
            let row = hemicube.row(patch, &mut scratch);
            let difference: f64 = (0..patches.len()).map(|j| (row.get(j) - by_cells[j]).abs()).sum();
            // A cell whose centre lies on a line between two patches may be either's.
            assert!(difference < 2e-3, "patch {patch}: {difference}");
        }
    }
}

#[test]
fn two_halves_of_a_cell_are_seen_where_the_cell_is() {
    // From a plate in a room whose walls are cut into cells, and in the same of triangles.
    let plate = || plate([-0.2, -0.3, 0.1], [0.5, 0.1, 0.0], [0.0, 0.6, 0.2], 1);
    let room = || sides([-1.0, -1.1, -1.2], [0.9, 1.2, 1.3], 7, true);
    let whole = scene_of([plate()].into_iter().chain(room()));
    let halves = scene_of([plate()].into_iter().chain(triangulated(scene_of(room())).surfaces));
    let [whole, halves] = [whole, halves].map(|scene| {
        let patches = subdivide(&scene, 1.0).unwrap();
        let facets = Facets::new(&scene, &patches);
        let weights = CellWeights::new(100).unwrap();
        Hemicube::new(&patches, &facets, BackFaces::Lit, weights).row(0, &mut Scratch::default())
    });
    let mut apart = 0.0;
    for cell in 0..6 * 49 {
        let [first, second] = [1, 2].map(|half| halves.get(2 * cell + half));
        apart += (whole.get(1 + cell) - first - second).abs();
        // Triangles of one size, side by side, are seen alike but for perspective, and the cells' size.
        assert!(first < 3.0 * second + 1e-3 && second < 3.0 * first + 1e-3, "{cell}: {first} {second}");
    }
    assert!(whole.sum() > 0.999 && apart < 3e-4, "{apart}");
}

#[test]
fn what_triangles_are_cut_into_is_seen_where_it_lies() {
    // The walls as two triangles each, cut by size into some hundreds, by rays too.
    let room = triangulated(tilted(scene_of(sides([0.0; 3], [1.0, 1.2, 0.9], 1, true))));
    let patches = subdivide(&room, Subdivision::PatchSize(0.15)).unwrap();
    assert!(patches.len() > 1000);
    let facets = Facets::new(&room, &patches);
    let tree = RayTree::new(&facets);
    let hemicube = Hemicube::new(&patches, &facets, BackFaces::Black, CellWeights::new(50).unwrap());
    let mut scratch = Scratch::default();
    for patch in (0..patches.len()).step_by(37) {
        let (row, by_rays) = (hemicube.row(patch, &mut scratch), hemicube.row_by_rays(patch, &tree));
        assert!((row.sum() - 1.0).abs() < 2e-6, "patch {patch}: {}", row.sum());
        let apart: f64 = (0..patches.len()).map(|j| (row.get(j) - by_rays.get(j)).abs()).sum();
        assert!(apart < 0.01, "patch {patch}: {apart}");
    }
}

#[test]
fn every_level_of_the_processor_gives_the_same_bits() {
    let scenes =
        [(cube(7), 100), (furnished_room(), 34), (tilted_room(), 100), (triangulated(tilted_room()), 100)];
    for (scene, precision) in scenes {
        let patches = subdivide(&scene, 1.0).unwrap();
        let facets = Facets::new(&scene, &patches);
        let weights = CellWeights::new(precision).unwrap();
        let hemicube = Hemicube::new(&patches, &facets, BackFaces::Black, weights);
        let mut scratch = Scratch::default();
        for patch in 0..patches.len() {
            let plain = hemicube.row_at(Level::Portable, patch, &mut scratch);
            for level in Level::available() {
                assert_eq!(hemicube.row_at(level, patch, &mut scratch), plain, "{level:?}, patch {patch}");
            }
        }
    }
}

#[test]
fn black_backs_take_light_and_lit_backs_send_it() {
    // A plate faces away from the other: seen from behind.
    let scene = scene_of([
        plate([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 3),
        plate([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 3),
    ]);
    let patches = subdivide(&scene, 1.0).unwrap();
    let facets = Facets::new(&scene, &patches);
    let tree = RayTree::new(&facets);
    for (back_faces, seen) in [(BackFaces::Black, false), (BackFaces::Lit, true)] {
        let hemicube = Hemicube::new(&patches, &facets, back_faces, CellWeights::new(20).unwrap());
        let row = hemicube.row(4, &mut Scratch::default());
        assert_eq!(row.sum() > 0.1, seen);
        assert_eq!(hemicube.row_by_rays(4, &tree).sum() > 0.1, seen);
    }
}

/// A solution, backs being this.
fn shared(scene: &Scene, method: Method, back_faces: BackFaces) -> Baked {
    let request = Request { method, back_faces: Some(back_faces), ..Request::default() };
    bake(scene, &request, &Run::default(), &mut ignore).unwrap()
}

const SHARES: Method = Method::HemicubeExact { precision: 60, eyes: 2, accuracy: 1e-4 };

#[test]
fn shares_of_what_nothing_hides_are_whole() {
    // Howell C-11, however few cells tell it.
    let plates = |gap: f64| {
        let floor = plate([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 4);
        scene_of([floor, plate([0.0, 0.0, gap], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], 4)])
    };
    for (gap, exact) in [(0.1, 0.826_994_522_397), (1.0, 0.199_824_895_698)] {
        for eyes in [1, 2, 3] {
            let method = Method::HemicubeExact { precision: 50 * eyes, eyes, accuracy: 1e-4 };
            let baked = shared(&plates(gap), method, BackFaces::Black);
            let found = between_surfaces(&baked.patches, &baked.form_factors);
            assert!((found / exact - 1.0).abs() < 1e-5, "{gap}, {eyes}: {found}");
        }
    }
    // A quarter of it hidden.
    let mut scene = plates(1.0);
    scene.surfaces.push(plate([0.0, 0.0, 0.5], [0.0, 0.5, 0.0], [0.5, 0.0, 0.0], 1));
    let baked = shared(&scene, SHARES, BackFaces::Black);
    let found = between_surfaces(&baked.patches, &baked.form_factors);
    assert!((found / 0.149_868_671_774 - 1.0).abs() < 0.01, "{found}");
}

#[test]
fn shares_are_nearer_to_exact_than_hemicubes_whatever_backs_are() {
    let mut scene = furnished_room();
    let lamp = |k: usize| if k == 1 { Rgb::grey(5.0) } else { Rgb::BLACK };
    paint(&mut scene, |k| (lamp(k), Rgb::new(0.7, 0.5, 0.1 + 0.05 * k as f64)));
    for back_faces in [BackFaces::Black, BackFaces::Lit] {
        let exact = shared(&scene, Method::Exact { accuracy: 1e-4 }, back_faces);
        let off = |baked: &Baked| {
            let both = baked.solution.radiosity.iter().zip(&exact.solution.radiosity);
            let (off, all) = both.fold((0.0, 0.0), |(off, all), (&b, &known)| {
                (off + (b - known).norm_squared(), all + known.norm_squared())
            });
            f64::sqrt(off / all)
        };
        let (baked, plain) = (
            shared(&scene, SHARES, back_faces),
            shared(&scene, Method::Hemicube { precision: 60 }, back_faces),
        );
        let (found, by_hemicube) = (off(&baked), off(&plain));
        println!("{back_faces:?}: {found:.4}, hemicube {by_hemicube:.4}");
        assert!(found < 0.01 && found < 0.5 * by_hemicube, "{found}, by hemicube {by_hemicube}");
        if back_faces == BackFaces::Black {
            let imbalance = |baked: &Baked| {
                ExchangeAreas::average(&baked.patches.area, &baked.form_factors, |_, _| false).imbalance()
            };
            assert!(imbalance(&baked) < 0.5 * imbalance(&plain));
            // The room is closed, and rows know it to what shadows' edges are told by; under the box in the corner are backs.
            let all = baked.form_factors.rows().iter().map(|row| row.sum() + row.elsewhere().backs);
            let sums: Vec<f64> = all.collect();
            let mean = sums.iter().sum::<f64>() / sums.len() as f64;
            assert!((mean - 1.0).abs() < 0.01, "{mean}");
            assert!(sums.iter().all(|sum| (sum - 1.0).abs() < 0.1), "{sums:?}");
        }
    }
}

#[test]
fn shares_know_what_leaves_an_open_scene() {
    let floor = plate([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 3);
    let ceiling = plate([0.0, 0.0, 0.5], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], 3);
    let shelf = plate([0.2, 0.2, 0.25], [0.3, 0.0, 0.0], [0.0, 0.3, 0.0], 1);
    let baked = shared(&scene_of([floor, ceiling, shelf]), SHARES, BackFaces::Black);
    for (i, row) in baked.form_factors.rows().iter().enumerate() {
        let elsewhere = row.elsewhere();
        let all = row.sum() + elsewhere.surroundings + elsewhere.backs;
        assert!((all - 1.0).abs() < 0.05, "{i}: {all}");
        assert!(elsewhere.surroundings > 0.05, "{i}: {elsewhere:?}");
    }
}

#[test]
fn shares_are_the_same_bits_at_every_level() {
    let mut scene = tilted_room();
    scene.surfaces[1].material.emission = Rgb::WHITE;
    let patches = subdivide(&scene, 0.5).unwrap();
    let facets = Facets::new(&scene, &patches);
    for back_faces in [BackFaces::Black, BackFaces::Lit] {
        let hemicube = Hemicube::new(&patches, &facets, back_faces, CellWeights::new(20).unwrap());
        let shares = Shares::new(&patches, &facets, back_faces, hemicube, 2, 1e-3).unwrap();
        let mut scratch = shares::Scratch::default();
        for patch in 0..patches.len() {
            let known = shares.row(patch, &mut scratch);
            for level in Level::available() {
                assert!(shares.row_at(level, patch, &mut scratch) == known, "{patch} {level:?}");
            }
        }
    }
}
