//! Surfaces that are split where others cross them or stand on them: no light leaks past a wall, nothing is lost or counted
//! twice, and the parts fit together.

use std::collections::HashMap;
use std::path::Path;

use glam::DVec3;
use radiosity::bake::{Baked, Method, Request, Run, bake};
use radiosity::light::Rgb;
use radiosity::patches::{Cutting, Patches, Subdivision, count, subdivide};
use radiosity::scene::n3d::parse_scene;
use radiosity::scene::{self, Scene};
use radiosity::shade::{ShadedSurfaces, Shading};
use radiosity::visibility::{Cells, Facets};
use radiosity::watch::ignore;

fn leaks() -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/leaks.scn");
    scene::read(&path).unwrap_or_else(|error| panic!("{error}"))
}

fn scene(text: &str) -> Scene {
    parse_scene("a.scn", text.as_bytes()).unwrap_or_else(|error| panic!("{error}"))
}

fn cutting(subdivision: impl Into<Subdivision>) -> Cutting {
    Cutting { split: true, ..Cutting::from(subdivision) }
}

fn split(text: &str) -> Patches {
    subdivide(&scene(text), cutting(1.0)).unwrap()
}

fn solved(scene: &Scene, split: bool) -> Baked {
    let method = Method::Hemicube { precision: 50 };
    let request = Request { split: Some(split), method, ..Request::default() };
    bake(scene, &request, &Run::default(), &mut ignore).unwrap()
}

/// Of the shell and the walls between, the patches in the dark room.
fn dark_room(patches: &Patches) -> Vec<usize> {
    let of_room =
        |&i: &usize| patches.surface[i] < 8 && patches.surface[i] != 6 && patches.centre[i].x >= 2.2;
    (0..patches.len()).filter(of_room).collect()
}

#[test]
fn a_dark_room_stays_dark() {
    let scene = leaks();
    let brightest = |baked: &Baked| {
        let room = dark_room(&baked.patches);
        assert!(room.len() > 60);
        room.into_iter().map(|i| baked.solution.radiosity[i].r).fold(0.0, f64::max)
    };
    assert!(brightest(&solved(&scene, false)) > 0.01);
    let baked = solved(&scene, true);
    assert!(brightest(&baked) < 1e-9, "{}", brightest(&baked));
    // Nor does smooth shading carry any light past the wall.
    let light = &baked.solution.radiosity;
    let shaded = ShadedSurfaces::new(&scene, &baked.patches, &baked.facets, light, Shading::Smooth);
    for (facet, number) in baked.facets.as_slice().iter().zip(0..) {
        let corners =
            [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|[u, v]| facet.origin + facet.u * u + facet.v * v);
        let shell = facet.surface < 6 && corners.iter().all(|corner| corner.x > 2.1999);
        assert!(!shell || shaded.at(number, 0.3, 0.3).r < 1e-9, "facet {number}: {corners:?}");
    }
}

#[test]
fn rooms_stay_closed() {
    let baked = solved(&leaks(), true);
    for i in 0..baked.patches.len() {
        // What of the sunk box is under the floor looks into the void.
        if baked.patches.centre[i].y >= 0.0 {
            let sum = baked.form_factors.row(i).sum();
            assert!((sum - 1.0).abs() < 1e-6, "patch {i} of {}: {sum}", baked.patches.surface[i]);
        }
    }
}

/// E = 1 - ρ: whatever stands where, all glows at 1.
#[test]
fn a_white_furnace_of_split_surfaces() {
    let mut scene = leaks();
    // Without the sunk box, parts of which are outside.
    scene.surfaces.drain(13..18);
    for (k, surface) in scene.surfaces.iter_mut().enumerate() {
        let rho = [0.9, 0.3, 0.7][k % 3];
        surface.material.diffuse = Rgb::grey(rho);
        surface.material.emission = Rgb::grey(1.0 - rho);
    }
    for (i, b) in solved(&scene, true).solution.radiosity.iter().enumerate() {
        assert!((b.r - 1.0).abs() < 2e-5, "patch {i}: {b:?}");
    }
}

/// Shapes of every kind that run through one another.
const CROSSING: &str = "
    QD 5 5  -2 -2 0  2 -2 0  2 2 0  -2 2 0 ID
    QD 3 2  -1.3 -1.9 -1  -1.3 1.7 -.8  -1.3 1.7 1  -1.3 -1.9 1 ID
    PG -1 -1 -.5  1.7 -1 .9  1.7 1 .9  .08 .3 .06  -1 1 -.5  -1 -1 -.5 ID
    SP NM 12 7 TR .3 .2 .1 ID   CL NM 9 3 HO 0 0 0 0 1 0 .4 RT 0 0 0 1 1 1 .7 TR -.9 -.4 .2 ID
    QD 3 3  -1.8 .4 -.4  1.8 .5 -.3  1.7 .6 .7  -1.9 .3 .4 ID
    QD 3 2  -1.7 1.9 -.4  1.5 1.9 -.4  1.2 1.9 .7  -1.3 1.9 .7 ID
    FR 3 .1 4  -1.9 -1.6 .3  1.9 -1.5 -.4  .1 1.8 .35 ID
    VO 0 0 0 4  -.5 -.5 -.6  .9 -.4 -.5  .1 .8 -.6  .2 .1 .9  4  1 3 2  1 2 4  2 3 4  3 1 4 ID";

/// Each edge of a surface's pieces, by its ends, with how often it is run along in either direction.
fn edges(patches: &Patches, surface: usize) -> HashMap<[[u64; 3]; 2], [u32; 2]> {
    let key = |p: DVec3| (p + DVec3::ZERO).to_array().map(f64::to_bits);
    let mut edges: HashMap<_, [u32; 2]> = HashMap::new();
    for triangle in &patches.pieces[surface].as_ref().unwrap().triangles {
        for k in 0..3 {
            let (a, b) = (key(triangle[k]), key(triangle[(k + 1) % 3]));
            edges.entry([a.min(b), a.max(b)]).or_default()[usize::from(a > b)] += 1;
        }
    }
    edges
}

#[test]
fn the_parts_have_the_area_of_the_whole_and_fit_corner_to_corner() {
    let scene = scene(CROSSING);
    for subdivision in [Subdivision::Factor(1.0), Subdivision::PatchSize(0.45)] {
        let whole = subdivide(&scene, subdivision).unwrap();
        let parted = subdivide(&scene, cutting(subdivision)).unwrap();
        assert!(parted.len() > whole.len() + 100);
        assert_eq!(count(&scene, cutting(subdivision)), Ok(parted.len() as u64));
        for surface in 0..scene.surfaces.len() {
            let block = parted.blocks[surface];
            assert_eq!((block.rows, block.first as usize), (1, block.patches().start));
            assert!(block.patches().all(|i| parted.surface[i] as usize == surface));
            let area =
                |patches: &Patches| patches.blocks[surface].patches().map(|i| patches.area[i]).sum::<f64>();
            assert!((area(&parted) / area(&whole) - 1.0).abs() < 1e-9, "surface {surface}");
            // The pieces too, and what they are the outline of is what it was: an open edge more would be a T-junction.
            let pieces = parted.pieces[surface].as_ref().unwrap();
            let sizes = pieces.triangles.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a).length() * 0.5);
            assert!(sizes.clone().all(|size| size > 0.0), "surface {surface}");
            if !matches!(surface, 3 | 4) {
                let flat: f64 = sizes.sum();
                assert!((flat / area(&whole) - 1.0).abs() < if surface == 5 { 2e-2 } else { 1e-9 });
            }
            let open = |[a, b]: &[[u64; 3]; 2]| {
                DVec3::from_array(a.map(f64::from_bits)).distance(DVec3::from_array(b.map(f64::from_bits)))
            };
            let rim: f64 = edges(&parted, surface)
                .iter()
                .filter(|(_, runs)| **runs != [1, 1])
                .map(|(ends, _)| open(ends))
                .sum();
            let expected = match surface {
                0 => 16.0,
                3 | 8 => 0.0,
                // The rims of a cylinder of ellipses, drawn as polygons: as they were.
                4 => {
                    let whole = edges(&whole, 4);
                    whole.iter().filter(|(_, runs)| **runs != [1, 1]).map(|(ends, _)| open(ends)).sum()
                }
                _ => {
                    let corners = scene.surfaces[surface].shape.vertices();
                    if matches!(surface, 7) {
                        rim
                    } else {
                        corners.iter().zip(corners.iter().cycle().skip(1)).map(|(a, b)| a.distance(*b)).sum()
                    }
                }
            };
            assert!(
                (rim - expected).abs() < 1e-9 * (1.0 + expected),
                "surface {surface}: {rim}, not {expected}"
            );
        }
        // A patch looks out from within itself.
        for (triangles, patch) in parted.pieces.iter().flatten().map(|p| (&p.triangles, &p.patch)) {
            for (triangle, &patch) in triangles.iter().zip(patch) {
                let (centre, normal) = (parted.centre[patch as usize], parted.normal[patch as usize]);
                let size = triangle[0].distance(triangle[1]) + triangle[1].distance(triangle[2]);
                assert!(triangle.iter().all(|corner| (*corner - centre).dot(normal) < 1e-3 * size));
            }
        }
    }
}

/// How far a patch of the floor (object 0 of the scene) reaches to either side of the plane x = `x`, at most.
fn straddle(patches: &Patches, x: f64) -> f64 {
    let pieces = patches.pieces[0].as_ref().unwrap();
    let mut reach: HashMap<u32, [f64; 2]> = HashMap::new();
    for (triangle, &patch) in pieces.triangles.iter().zip(&pieces.patch) {
        for corner in triangle {
            let [low, high] = reach.entry(patch).or_insert([0.0; 2]);
            (*low, *high) = (low.min(corner.x - x), high.max(corner.x - x));
        }
    }
    reach.values().map(|[low, high]| high.min(-low)).fold(0.0, f64::max)
}

#[test]
fn no_patch_lies_on_both_sides_of_a_wall() {
    let floor = "QD 5 4 0 0 0 10 0 0 10 8 0 0 8 0 ID";
    // Standing on it, sunk into it, of triangles, a sheet seen from either side, and a line oblique to all cells.
    for wall in [
        "QD 1 1 4.3 0 0 4.3 8 0 4.3 8 2 4.3 0 2 ID",
        "QD 3 3 4.3 8 -1 4.3 0 -1 4.3 0 2 4.3 8 2 ID",
        "VO 0 0 0 4 4.3 -1 0 4.3 9 0 4.3 9 1 4.3 -1 3 2 1 2 3 1 3 4 ID",
    ] {
        let patches = split(&format!("{floor} {wall}"));
        assert_eq!(straddle(&patches, 4.3), 0.0, "{wall}");
        assert_eq!(patches.blocks[0].patches().len(), 24, "{wall}");
    }
    // As near to a corner of the cells as a hundredth of their width the line runs through it: no slivers.
    for (x, patches, off) in [(4.019, 20, 0.0191), (4.021, 24, 0.0)] {
        let wall = format!("QD 1 1 {x} 0 0 {x} 8 0 {x} 8 2 {x} 0 2 ID");
        let parted = split(&format!("{floor} {wall}"));
        assert_eq!(parted.blocks[0].patches().len(), patches);
        assert!(straddle(&parted, x) <= off);
    }
    // What does not reach the floor parts nothing, and the floor stays one parallelogram; nor does what is below it, or
    // stands at its border.
    for apart in [
        "QD 1 1 4.3 0 .21 4.3 8 .21 4.3 8 2 4.3 0 2 ID",
        "QD 1 1 4.3 0 -2 4.3 8 -2 4.3 8 0 4.3 0 0 ID",
        "QD 1 1 10 0 0 10 8 0 10 8 2 10 0 2 ID",
    ] {
        let patches = split(&format!("{floor} {apart}"));
        assert!(patches.pieces[0].is_none() && patches.len() == 21, "{apart}");
    }
    // Where a wall ends within a cell that cell is parted, and the next one is not.
    assert_eq!(split(&format!("{floor} QD 1 1 4.3 0 0 4.3 3 0 4.3 3 2 4.3 0 2 ID")).len(), 20 + 2 + 1);
}

#[test]
fn what_has_many_facets_parts_a_floor_into_few() {
    // A column of 240 sides through two floors, and rough ground of 16,384 triangles through them.
    let floors = "QD 3 3 -5 -5 0 5 -5 0 5 5 0 -5 5 0 ID QD 40 40 -5 -5 .1 5 -5 .1 5 5 .1 -5 5 .1 ID";
    let column = "CL NM 240 1 HO 0 0 0 1 0 0 4 RT 0 0 0 0 1 0 1.5707963267948966 TR .3 .2 2 ID";
    let ground = "FR 7 .1 3 -5 -4 -.6 5 -4 .4 0 5 .3 ID";
    for (body, most) in [(column, [300, 2_300]), (ground, [1_500, 6_000])] {
        let patches = split(&format!("{floors} {body}"));
        for (surface, most) in [0, 1].into_iter().zip(most) {
            let block = patches.blocks[surface].patches();
            assert!(block.len() < most, "{body}: {}", block.len());
            assert!((block.map(|i| patches.area[i]).sum::<f64>() - 100.0).abs() < 1e-9, "{body}");
        }
    }
}

#[test]
fn about_so_many_patches_are_so_many_when_split() {
    let scene = leaks();
    for wanted in [800, 3_000] {
        let cutting = cutting(Subdivision::Patches(wanted));
        let made = subdivide(&scene, cutting).unwrap().len() as u64;
        assert_eq!(count(&scene, cutting), Ok(made));
        assert!((0.9..=1.02).contains(&(made as f64 / wanted as f64)), "{wanted}: {made}");
    }
}

/// The least and the greatest colour that smooth shading gives the floor, object 0, on the line x = `x`, where patches to
/// the left of it are black and those to the right of it white.
fn shades_on(text: &str, x: f64) -> [f64; 2] {
    let scene = scene(text);
    let patches = subdivide(&scene, cutting(1.0)).unwrap();
    let facets = Facets::new(&scene, &patches);
    let values: Vec<Rgb> =
        patches.centre.iter().map(|centre| Rgb::grey(if centre.x < x { 0.0 } else { 1.0 })).collect();
    let shaded = ShadedSurfaces::new(&scene, &patches, &facets, &values, Shading::Smooth);
    let mut shades = [1.0_f64, 0.0];
    for number in facets.of_surface(0) {
        for [u, v] in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]] {
            let place = facets[number].origin + facets[number].u * u + facets[number].v * v;
            if (place.x - x).abs() < 1e-9 {
                let shade = shaded.at(number, u, v).r;
                shades = [shades[0].min(shade), shades[1].max(shade)];
            }
        }
    }
    shades
}

#[test]
fn shading_breaks_under_a_wall_and_not_at_the_edge_of_a_tile() {
    let floor = "QD 5 4 0 0 0 10 0 0 10 8 0 0 8 0 ID";
    // At a wall across a cell, and at one on the line between two cells.
    for x in [4.3, 4.0] {
        assert_eq!(shades_on(&format!("{floor} QD 1 1 {x} 0 0 {x} 8 0 {x} 8 2 {x} 0 2 ID"), x), [0.0, 1.0]);
    }
    // A rug that ends there hides nothing.
    let [low, high] = shades_on(&format!("{floor} QD 1 1 4.3 -1 0 12 -1 0 12 9 0 4.3 9 0 ID"), 4.3);
    assert!(low > 0.1 && high < 0.9, "{low} {high}");
}

/// A rug a twentieth of a patch above the floor hides it as one that lies on it does.
#[test]
fn what_hovers_closely_parts_what_it_hovers_over() {
    let floor = "QD 5 4 0 0 0 10 0 0 10 8 0 0 8 0 CD .5 .5 .5 ID";
    let rug = |height: f64| {
        format!("QD 4 5 4.3 -1 {height} 9 -1 {height} 9 9 {height} 4.3 9 {height} CD .2 .2 .2 ID")
    };
    let flush = split(&format!("{floor} {}", rug(0.0)));
    for height in [0.01, 0.1, 0.19] {
        let parted = split(&format!("{floor} {}", rug(height)));
        assert_eq!((straddle(&parted, 4.3), straddle(&parted, 9.0)), (0.0, 0.0), "{height}");
        assert_eq!(
            parted.centre[..parted.blocks[0].patches().end],
            flush.centre[..flush.blocks[0].patches().end]
        );
        // What is dark under the rug does not creep out from under it.
        assert_eq!(shades_on(&format!("{floor} {}", rug(height)), 4.3), [0.0, 1.0]);
    }
    // Nor where the rug ends on a line between two triangles of a mesh.
    let mesh = "VO 1 0 0 6 0 0 0 4 0 0 10 0 0 0 8 0 4 8 0 10 8 0 4 1 2 5 1 5 4 2 3 6 2 6 5 CD .5 .5 .5 ID";
    let rug_from_4 = "QD 4 5 4 -1 .1 9 -1 .1 9 9 .1 4 9 .1 CD .2 .2 .2 ID";
    assert_eq!(shades_on(&format!("{mesh} {rug_from_4}"), 4.0), [0.0, 1.0]);
    // Higher up it does not; the rug's own underside, and what is behind, parts nothing.
    assert_eq!(split(&format!("{floor} {}", rug(0.21))).blocks[0].patches().len(), 20);
    // Under a lamp the floor beside the rug is bright, and under it dark.
    let lamp = "QD 1 1 0 0 5 0 8 5 10 8 5 10 0 5 CE 9 9 9 ID";
    let baked = solved(&scene(&format!("{floor} {} {lamp}", rug(0.05))), true);
    let light: Vec<(f64, f64)> = (baked.patches.blocks[0].patches())
        .map(|i| (baked.patches.centre[i].x, baked.solution.irradiance[i].r))
        .collect();
    assert!(light.iter().filter(|(x, _)| *x < 4.0).all(|(_, light)| *light > 2.0), "{light:?}");
    // (Backs are lit: a little comes down from the rug's.)
    assert!(light.iter().filter(|(x, _)| (5.0..8.0).contains(x)).all(|(_, light)| *light < 1.0), "{light:?}");
}

#[test]
fn patches_get_smaller_towards_a_wall() {
    // A fifth of a floor away from a wall.
    let text = "QD 10 10 0 0 0 10 0 0 10 10 0 0 10 0 ID QD 1 1 3.97 0 0 3.97 10 0 3.97 10 9 3.97 0 9 ID";
    let scene = scene(text);
    let cutting = Cutting { grading: 3, ..cutting(1.0) };
    let patches = subdivide(&scene, cutting).unwrap();
    assert_eq!(count(&scene, cutting), Ok(patches.len() as u64));
    let floor = || patches.blocks[0].patches();
    assert!((floor().map(|i| patches.area[i]).sum::<f64>() - 100.0).abs() < 1e-9);
    for i in floor() {
        let (size, far) = (patches.area[i].sqrt(), (patches.centre[i].x - 3.97).abs());
        assert!(size <= 0.2 || far >= 0.5 * size && far >= 0.12, "{size} at {far}");
        assert!(far < 2.6 || size > 0.9, "{size} at {far}");
    }
    assert_eq!(straddle(&patches, 3.97), 0.0);
    // Without gaps: what is run along once is the border.
    let open: f64 = edges(&patches, 0)
        .iter()
        .filter(|(_, runs)| **runs != [1, 1])
        .map(|([a, b], _)| {
            DVec3::from_array(a.map(f64::from_bits)).distance(DVec3::from_array(b.map(f64::from_bits)))
        })
        .sum();
    assert!((open - 40.0).abs() < 1e-9, "{open}");
}

#[test]
fn whole_cells_of_a_split_floor_are_seen_together() {
    // A wall across the corner of a floor of 400 cells, and a mirrored floor.
    let wall = "QD 1 1 4.3 0 0 0 5.1 0 0 5.1 2 4.3 0 2 ID";
    for turn in ["", "HO 0 0 0 1 0 0 -1 TR 10 0 0"] {
        let scene = scene(&format!("QD 20 20 0 0 0 10 0 0 10 8 0 0 8 0 {turn} ID {wall}"));
        let patches = subdivide(&scene, cutting(1.0)).unwrap();
        let facets = Facets::new(&scene, &patches);
        let fewest = facets.fewest();
        assert!(patches.pieces[0].is_some() && facets.as_slice().len() > 800);
        let (mut area, mut seen) = (0.0, vec![0; patches.len()]);
        for facet in fewest.as_slice() {
            let (corners, count) = facet.corners();
            area += (corners[1] - corners[0]).cross(corners[count - 1] - corners[0]).length()
                * if count == 4 { 1.0 } else { 0.5 };
            assert!(facet.normal.dot(facet.u.cross(facet.v)) > 0.0);
            let Cells::Grid { columns, rows, .. } = facet.cells else { continue };
            for (column, row) in (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row))) {
                let [u, v] = [(column, columns), (row, rows)]
                    .map(|(k, count)| (f64::from(k) + 0.5) / f64::from(count));
                let patch = facet.patch_at(u, v) as usize;
                let place = facet.origin + facet.u * u + facet.v * v;
                assert!(place.distance(patches.centre[patch]) < 1e-9, "patch {patch}");
                seen[patch] += 1;
            }
        }
        assert!((area - patches.total_area()).abs() < 1e-9);
        assert!(seen.iter().all(|&times| times <= 1));
        assert!(fewest.as_slice().len() < 160, "{}", fewest.as_slice().len());
    }
    // Half a floor away from the wall a few facets do.
    let straight = "QD 1 1 4.3 -1 0 4.3 9 0 4.3 9 2 4.3 -1 2 ID";
    let scene = scene(&format!("QD 20 20 0 0 0 10 0 0 10 8 0 0 8 0 ID {straight}"));
    let patches = subdivide(&scene, cutting(1.0)).unwrap();
    assert!(Facets::new(&scene, &patches).fewest().of_surface(0).len() <= 20 * (2 + 4));
}
