//! The sample scenes: each reads, solves, and gives the answer its own comment states.

use std::path::{Path, PathBuf};

use radiosity::bake::{Baked, Method, Request, Run, bake};
use radiosity::scene::{self, Scene, check_meshes};
use radiosity::watch::ignore;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes")
}

fn read(name: &str) -> Scene {
    scene::read(&folder().join(name)).unwrap_or_else(|error| panic!("{error}"))
}

fn solved(name: &str, precision: u32) -> (Scene, Baked) {
    let scene = read(name);
    let request = Request { method: Method::Hemicube { precision }, ..Request::default() };
    let baked = bake(&scene, &request, &Run::default(), &mut ignore).unwrap();
    (scene, baked)
}

/// The area-weighted mean radiosity of a surface, red.
fn mean(baked: &Baked, surface: usize) -> f64 {
    let patches = || baked.patches.blocks[surface].patches();
    let power: f64 = patches().map(|i| baked.patches.area[i] * baked.solution.radiosity[i].r).sum();
    power / patches().map(|i| baked.patches.area[i]).sum::<f64>()
}

#[test]
fn every_scene_reads_cleanly_and_says_what_it_shows() {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder()).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|ending| ending != "scn") {
            continue;
        }
        let scene = scene::read(&path).unwrap_or_else(|error| panic!("{error}"));
        // Only that N3D's own rule for a shear is not known.
        let others = scene.warnings.iter().filter(|warning| !warning.message.starts_with("CZ"));
        assert_eq!(others.collect::<Vec<_>>(), [] as [&radiosity::scene::Warning; 0], "{}", path.display());
        let patches = radiosity::patches::count(&scene, 1.0).unwrap();
        assert!((200..=8000).contains(&patches), "{}: {patches} patches", path.display());
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.starts_with('#') || text.starts_with("//"), "{} opens with no comment", path.display());
        names.push(path.file_stem().unwrap().to_string_lossy().into_owned());
    }
    for name in
        ["cornell", "cube", "furnace", "office", "radio1", "radio7", "sphere", "two_plates", "white_furnace"]
    {
        assert!(names.iter().any(|found| found == name), "{name} is missing");
    }
    for number in 1..=7 {
        assert!(read(&format!("radio{number}.scn")).camera.is_some(), "radio{number}.vsn");
    }
}

#[test]
fn the_models_read_cleanly() {
    for (name, patches, lamps) in [("attic.obj", 2000..3000, 1), ("gallery.gltf", 2000..3000, 2)] {
        let scene = read(name);
        assert_eq!(scene.warnings, [], "{name}");
        assert!(patches.contains(&radiosity::patches::count(&scene, 1.0).unwrap()), "{name}");
        let shines = scene.surfaces.iter().filter(|surface| !surface.material.emission.is_black());
        assert_eq!(shines.count(), lamps, "{name}");
        assert!(scene.camera.is_some() && scene.surfaces.iter().all(|surface| !surface.name.is_empty()));
    }
    let attic = check_meshes(&read("attic.obj"));
    assert_eq!((attic.open.count, attic.crowded.count, attic.turned.count), (0, 0, 0), "{attic:?}");
    // The rug in its own colours, by its texture.
    let gallery = read("gallery.gltf");
    let rug = gallery.surfaces.iter().find(|surface| surface.name == "rug").unwrap();
    assert!((0..200).any(|k| rug.coefficients(k).1.b > 0.2) && rug.material.diffuse.b < 0.2);
}

/// From within, nothing is seen through a wall: what faces inward sees only what is there.
#[test]
fn model_rooms_are_closed() {
    for name in ["attic.obj", "gallery.gltf"] {
        let (scene, baked) = solved(name, 50);
        for (surface, block) in scene.surfaces.iter().zip(&baked.patches.blocks) {
            if ["roof", "left wall", "right wall"].contains(&surface.name.as_str()) {
                for patch in block.patches() {
                    let sum = baked.form_factors.row(patch).sum();
                    assert!((sum - 1.0).abs() < 1e-3, "{name}, {}, patch {patch}: {sum}", surface.name);
                }
            }
        }
    }
}

#[test]
fn closed_rooms_are_closed() {
    for name in ["radio1.scn", "radio2.scn", "cube.scn", "furnace.scn", "sphere.scn", "white_furnace.scn"] {
        let (_, baked) = solved(name, 50);
        let (low, high) = baked.form_factors.row_sum_range();
        assert!((low - 1.0).abs() < 5e-6 && (high - 1.0).abs() < 5e-6, "{name}: {low} to {high}");
    }
}

#[test]
fn furnaces() {
    for name in ["furnace.scn", "sphere.scn"] {
        glows_alike(&solved(name, 100).1);
    }
}

/// B = E / (1 - ρ) everywhere.
fn glows_alike(baked: &Baked) {
    for (i, b) in baked.solution.radiosity.iter().enumerate() {
        let (e, rho) = (baked.patches.emission[i], baked.patches.reflectance[i]);
        for ((b, e), rho) in b.to_array().into_iter().zip(e.to_array()).zip(rho.to_array()) {
            assert!((b * (1.0 - rho) / e - 1.0).abs() < 2e-4, "patch {i}: {b}");
        }
    }
}

#[test]
fn white_furnace() {
    let (_, baked) = solved("white_furnace.scn", 100);
    let all = baked.solution.radiosity.iter().flat_map(|b| b.to_array());
    assert!(all.into_iter().all(|b| (b - 1.0).abs() < 2e-4));
}

#[test]
fn cube() {
    let (_, baked) = solved("cube.scn", 100);
    let floor = baked.patches.emission.iter().position(|e| e.r > 0.0).unwrap();
    let floor = baked.patches.surface[floor] as usize;
    let mut means: Vec<f64> = (0..6).filter(|&k| k != floor).map(|k| mean(&baked, k)).collect();
    means.sort_by(f64::total_cmp);
    assert!((mean(&baked, floor) / 1.104362 - 1.0).abs() < 0.01);
    assert!((means[0] / 0.171216 - 1.0).abs() < 0.01, "{means:?}");
    assert!(means[1..].iter().all(|mean| (mean / 0.181106 - 1.0).abs() < 0.01), "{means:?}");
}

#[test]
fn two_plates() {
    let (_, baked) = solved("two_plates.scn", 100);
    let [a, b] = [0, 1].map(|k| baked.patches.blocks[k].patches());
    let count = a.len() as f64;
    let factor: f64 =
        a.map(|i| b.clone().map(|j| baked.form_factors.row(i).get(j)).sum::<f64>()).sum::<f64>() / count;
    assert!((factor / 0.199824895698 - 1.0).abs() < 0.015, "{factor}");
}
