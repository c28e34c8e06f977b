//! The hemicube's form factors against their laws, known answers, and each other.

mod rooms;

use radiosity::form_factors::hemicube::{
    CellWeights, Face, Hemicube, Scratch, delta_form_factor_side, delta_form_factor_top,
};
use radiosity::form_factors::{FormFactors, compute_rows};
use radiosity::patches::{Patches, subdivide};
use radiosity::scene::{BackFaces, Scene};
use radiosity::simd::Level;
use radiosity::visibility::{Facets, RayTree};
use radiosity::watch::ignore;

use rooms::{cube, furnished_room, plate, scene_of, tilted_room};

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
    for (name, scene) in [("cube", cube(8)), ("furnished", furnished_room()), ("tilted", tilted_room())] {
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
    for scene in [cube(5), furnished_room(), tilted_room()] {
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
    for scene in [cube(9), furnished_room(), tilted_room()] {
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
fn every_level_of_the_processor_gives_the_same_bits() {
    for (scene, precision) in [(cube(7), 100), (furnished_room(), 34), (tilted_room(), 100)] {
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
