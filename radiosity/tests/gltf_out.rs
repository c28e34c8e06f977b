//! glTF and VTK out: what is written holds what was solved, and is read back as the scene it was.

mod rooms;

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::fs;
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use glam::{DVec2, DVec3};
use radiosity::bake::{Baked, Method, Request, Run, bake};
use radiosity::export::{GltfForm, LightMap, SolvedScene, write_gltf, write_vtu};
use radiosity::light::Rgb;
use radiosity::patches;
use radiosity::scene::{self, BackFaces, Camera, Material, Mesh, Place, Scene, Shape, Surface};
use radiosity::shade::{
    Atlas, AtlasError, PADDING, ShadedSurfaces, Shading, ToneCurve, ToneMap, automatic_exposure, frame,
    linear_from_srgb, srgb_from_linear,
};
use radiosity::visibility::{Cells, Facets};
use radiosity::watch::ignore;
use serde_json::Value;

const TONE: ToneMap = ToneMap { exposure: 0.5, curve: ToneCurve::Neutral };

fn solved(scene: &Scene) -> Baked {
    let request = Request { method: Method::Hemicube { precision: 30 }, ..Request::default() };
    bake(scene, &request, &Run::default(), &mut ignore).unwrap()
}

/// A room with a lamp, a coloured wall and a mesh whose two triangles differ.
fn room() -> Scene {
    let mut scene = rooms::cube(5);
    rooms::paint(&mut scene, |surface| match surface {
        1 => (Rgb::new(3.0, 2.0, 1.0), Rgb::grey(0.1)),
        2 => (Rgb::BLACK, Rgb::new(0.7, 1.0 / 3.0, 0.1)),
        _ => (Rgb::BLACK, Rgb::grey(0.6)),
    });
    let mesh = Mesh {
        vertices: [[0.25, 0.25, 0.5], [0.75, 0.25, 0.5], [0.75, 0.75, 0.5], [0.25, 0.75, 0.625]]
            .map(DVec3::from)
            .into(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        diffuse: vec![Rgb::grey(0.25), Rgb::grey(0.75)],
        ..Mesh::default()
    };
    scene.surfaces.push(Surface {
        name: "Table \"top\"".into(),
        shape: Shape::Mesh(mesh),
        material: Material { diffuse: Rgb::grey(0.5), ..Material::default() },
        place: Place::default(),
    });
    scene
}

fn shaded<'a>(scene: &Scene, baked: &'a Baked, light: &'a [Rgb]) -> ShadedSurfaces<'a> {
    ShadedSurfaces::new(scene, &baked.patches, &baked.facets, light, Shading::Smooth)
}

fn write(scene: &Scene, baked: &Baked, path: &Path, form: GltfForm) -> Camera {
    write_with(scene, baked, path, form, None)
}

/// With a light map where an atlas is given.
fn write_with(scene: &Scene, baked: &Baked, path: &Path, form: GltfForm, atlas: Option<&Atlas>) -> Camera {
    let camera = scene.camera.unwrap_or_else(|| frame(scene));
    let shaded = shaded(scene, baked, &baked.solution.radiosity);
    let picture = atlas.map(|atlas| atlas.screen_light_map(&shaded, TONE));
    let solved = SolvedScene {
        scene,
        patches: &baked.patches,
        facets: &baked.facets,
        solution: &baked.solution,
        camera: &camera,
        tone: TONE,
        back_faces: scene.back_faces,
        light_map: atlas.zip(picture.as_ref()).map(|(atlas, picture)| LightMap { atlas, picture }),
    };
    write_gltf(path, &solved, form).unwrap();
    camera
}

/// JSON and numbers of a .glb.
fn open(path: &Path) -> (Value, Vec<u8>) {
    let bytes = fs::read(path).unwrap();
    let word = |at: usize| u32::from_le_bytes(*bytes[at..].first_chunk().unwrap()) as usize;
    assert_eq!((&bytes[..4], word(4), word(8)), (&b"glTF"[..], 2, bytes.len()));
    let json = word(12);
    assert_eq!((&bytes[16..20], json % 4), (&b"JSON"[..], 0));
    assert_eq!((word(20 + json), &bytes[24 + json..28 + json]), (bytes.len() - 28 - json, &b"BIN\0"[..]));
    (serde_json::from_slice(&bytes[20..20 + json]).unwrap(), bytes[28 + json..].to_vec())
}

/// Vectors of an accessor.
fn vectors(json: &Value, bytes: &[u8], accessor: &Value) -> Vec<[f32; 3]> {
    let accessor = &json["accessors"][accessor.as_u64().unwrap() as usize];
    let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
    let (start, count) =
        (view["byteOffset"].as_u64().unwrap() as usize, accessor["count"].as_u64().unwrap() as usize);
    let numbers =
        bytes[start..][..12 * count].chunks_exact(4).map(|b| f32::from_le_bytes(*b.first_chunk().unwrap()));
    let numbers: Vec<f32> = numbers.collect();
    numbers.chunks_exact(3).map(|v| [v[0], v[1], v[2]]).collect()
}

#[test]
fn every_patchs_light_is_in_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("room.glb");
    let scene = room();
    let baked = solved(&scene);
    write(&scene, &baked, &path, GltfForm::Binary);
    let (json, bytes) = open(&path);
    // The crate's own check, too, which is the standard's in so far as it goes.
    gltf::Gltf::from_slice(&fs::read(&path).unwrap()).unwrap();
    assert_eq!(json["extensionsUsed"], serde_json::json!(["KHR_materials_unlit"]));

    let tone = TONE;
    for (surface, block) in baked.patches.blocks.iter().enumerate() {
        let attributes = &json["meshes"][surface]["primitives"][0]["attributes"];
        let [positions, light, colours] =
            ["POSITION", "_RADIOSITY", "COLOR_0"].map(|name| vectors(&json, &bytes, &attributes[name]));
        for patch in block.patches() {
            let expected = baked.solution.radiosity[patch].to_array().map(|channel| channel as f32);
            assert!(light.contains(&expected), "patch {patch}: {expected:?}");
            if surface < 6 {
                // A grid has a vertex in the middle of each patch.
                let centre = baked.patches.centre[patch].to_array().map(|x| x as f32);
                let near = |p: &[f32; 3]| (0..3).all(|k| (p[k] - centre[k]).abs() < 1e-6);
                let vertex = positions.iter().position(near).unwrap();
                assert_eq!(light[vertex], expected);
                assert_eq!(colours[vertex], tone.apply(expected));
            }
        }
        assert!(colours.as_flattened().iter().all(|channel| (0.0..=1.0).contains(channel)));
        // The bounds are those of the numbers, to the bit.
        let bounds = &json["accessors"][attributes["POSITION"].as_u64().unwrap() as usize];
        for k in 0..3 {
            let low = positions.iter().map(|p| p[k]).fold(f32::INFINITY, f32::min);
            assert_eq!(bounds["min"][k].as_f64(), Some(low.into()));
        }
    }
    assert_eq!(json["nodes"][6]["name"], "Table \"top\"");
    assert_eq!(json["nodes"][7]["camera"], 0);
}

#[test]
fn it_is_read_back_as_the_scene_it_was() {
    let folder = tempfile::tempdir().unwrap();
    for back_faces in [BackFaces::Lit, BackFaces::Black] {
        let mut scene = room();
        scene.back_faces = back_faces;
        let baked = solved(&scene);
        let atlas = Atlas::new(&scene, &baked.patches, &baked.facets, 64).unwrap();
        for (name, form, atlas) in [
            ("room.glb", GltfForm::Binary, None),
            ("room.gltf", GltfForm::Text, None),
            ("mapped.glb", GltfForm::Binary, Some(&atlas)),
            ("mapped.gltf", GltfForm::Text, Some(&atlas)),
        ] {
            let path = folder.path().join(name);
            let camera = write_with(&scene, &baked, &path, form, atlas);
            let again = scene::read(&path).unwrap();
            assert_eq!((again.back_faces, again.warnings.len()), (back_faces, 0));
            for (before, after) in scene.surfaces.iter().zip(&again.surfaces).take(6) {
                assert_eq!((&before.shape, before.material), (&after.shape, after.material));
            }
            let (Shape::Mesh(before), Shape::Mesh(after)) =
                (&scene.surfaces[6].shape, &again.surfaces[6].shape)
            else {
                panic!("a mesh is a mesh")
            };
            // All its numbers are exact in single precision.
            assert_eq!(before, after);
            let seen = again.camera.unwrap();
            assert!(
                (seen.eye - camera.eye).length() < 1e-5 && (seen.forward - camera.forward).length() < 1e-6
            );
            assert!((seen.horizontal[1] - camera.horizontal[1]).abs() < 1e-6);
            assert!((seen.vertical[0] - camera.vertical[0]).abs() < 1e-6);
            // So that the same light comes out.
            assert_eq!(solved(&again).solution.radiosity, baked.solution.radiosity);
        }
    }
}

/// What somebody moved in another program is where they moved it.
#[test]
fn a_mesh_that_was_changed_since_is_what_its_triangles_are() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("room.gltf");
    let scene = rooms::cube(3);
    let baked = solved(&scene);
    write(&scene, &baked, &path, GltfForm::Text);
    let mut json: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    json["nodes"][0]["scale"] = serde_json::json!([2, -2, 1]);
    json["meshes"][1]["extras"]["radiosity"]["parallelogram"]["u"] = serde_json::json!([3, 0, 0]);
    fs::write(&path, serde_json::to_vec(&json).unwrap()).unwrap();
    let again = scene::read(&path).unwrap();
    let Shape::Parallelogram(moved) = &again.surfaces[0].shape else { panic!() };
    assert_eq!((moved.u, moved.v, moved.normal), (DVec3::X * 2.0, DVec3::Y * -2.0, DVec3::Z));
    let Shape::Mesh(mesh) = &again.surfaces[1].shape else { panic!() };
    assert!((patches::subdivide(&again, 1.0).unwrap().total_area() - 9.0).abs() < 1e-6);
    assert_eq!(mesh.triangles.len(), 2 * 4 * 4);
}

#[test]
fn the_same_scene_has_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let scene = room();
    let bytes: Vec<Vec<u8>> = ["one.glb", "other.glb"]
        .iter()
        .map(|name| {
            let path = folder.path().join(name);
            write(&scene, &solved(&scene), &path, GltfForm::Binary);
            fs::read(path).unwrap()
        })
        .collect();
    assert!(bytes[0] == bytes[1]);
}

/// Every kind of surface, lit from one side: a sphere, a cylinder, an L, a twisted quadrilateral, a ring with a hole, over a
/// floor.
fn all_shapes() -> (Scene, Baked) {
    let text = b"
        QD 9 7   -3 0 3  3 0 3  3 0 -3  -3 0 -3   CD .7 .6 .5  ID
        QD 1 1   4 1 1   4 1 -1  4 3 -1  4 3 1    CE 40 35 30  ID
        SP NM 24 12   HO 0 0 0  1 0 0  .6  HO 0 0 0  0 1 0  .6  HO 0 0 0  0 0 1  .6  TR -1 1 0  CD .5 .6 .9  ID
        CL NM 20 5    HO 0 0 0  0 1 0  .3  HO 0 0 0  0 0 1  .3  TR 0 .5 1.5  CD .6 .6 .3  ID
        PG -2 .5 -2  0 .5 -2  0 1 -2  -1 1 -2  -1 2 -2  -2 2 -2  -2 .5 -2  CD .4 .7 .4  ID
        QD 6 6   1 .2 -2  2 .2 -2  2 1.2 -2.6  1 1 -2  CD .7 .4 .4  ID";
    let mut scene = scene::n3d::parse_scene("shapes", text).unwrap();
    let mut ring = Mesh::default();
    let (around, across) = (28_u32, 14_u32);
    for i in 0..around {
        for j in 0..across {
            let (a, b) = (f64::from(i) / f64::from(around), f64::from(j) / f64::from(across));
            let ((sin_a, cos_a), (sin_b, cos_b)) = ((a * TAU).sin_cos(), (b * TAU).sin_cos());
            let radius = 0.5 + 0.2 * cos_b;
            ring.vertices.push(DVec3::new(1.5 + radius * cos_a, 0.6 + radius * sin_a, 0.2 * sin_b));
            let vertex = |i: u32, j: u32| i % around * across + j % across;
            let (p, q, r, s) = (vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1));
            ring.triangles.extend([[p, q, r], [p, r, s]]);
        }
    }
    scene.surfaces.push(Surface {
        name: "ring".into(),
        shape: Shape::Mesh(ring),
        material: Material { diffuse: Rgb::new(0.8, 0.7, 0.3), ..Material::default() },
        place: Place::default(),
    });
    let request = Request { method: Method::Hemicube { precision: 20 }, ..Request::default() };
    let baked = bake(&scene, &request, &Run::default(), &mut ignore).unwrap();
    (scene, baked)
}

/// What bilinear filtering gives at texture coordinates.
fn filtered(size: [u32; 2], texel: impl Fn(usize) -> [f32; 3], [u, v]: [f64; 2]) -> [f64; 3] {
    let last = size.map(|side| f64::from(side - 1));
    let at = |s: f64, k: usize| (s * f64::from(size[k]) - 0.5).clamp(0.0, last[k]);
    let (x, y) = (at(u, 0), at(v, 1));
    let (s, t) = (x.fract(), y.fract());
    let get = |x: f64, y: f64, k: usize| {
        let index = y.min(last[1]) as usize * size[0] as usize + x.min(last[0]) as usize;
        f64::from(texel(index)[k])
    };
    let (x, y) = (x.floor(), y.floor());
    std::array::from_fn(|k| {
        let row = |y: f64| get(x, y, k) * (1.0 - s) + get(x + 1.0, y, k) * s;
        row(y) * (1.0 - t) + row(y + 1.0) * t
    })
}

/// A side of a facet, by number: the ends' (u, v).
type Side = (u32, [DVec2; 2]);

/// Sides that two facets share and across which shading goes on, on either.
fn smooth_sides(facets: &Facets, shaded: &ShadedSurfaces<'_>) -> Vec<[Side; 2]> {
    let mut sides: BTreeMap<[[i64; 3]; 2], Vec<Side>> = BTreeMap::new();
    for number in 0..facets.as_slice().len() as u32 {
        let (corners, count) = facets[number].corners();
        if count == 3 {
            let key = |k: usize| corners[k].to_array().map(|x| (x * 1e7).round() as i64);
            let uv = [DVec2::ZERO, DVec2::X, DVec2::Y];
            for (k, l) in [(0, 1), (1, 2), (2, 0)] {
                let turned = key(k) > key(l);
                let (k, l) = if turned { (l, k) } else { (k, l) };
                sides.entry([key(k), key(l)]).or_default().push((number, [uv[k], uv[l]]));
            }
        }
    }
    let continues = |one: &Side, other: &Side| {
        (0..2).all(|end| {
            let [a, b] = [one, other].map(|side| shaded.at(side.0, side.1[end].x, side.1[end].y));
            (a - b).norm_squared() < 1e-18
        })
    };
    let pairs = sides.into_values().filter(|both| both.len() == 2 && continues(&both[0], &both[1]));
    pairs.map(|both| [both[0], both[1]]).collect()
}

#[test]
fn charts_keep_apart_and_facets_within_them() {
    let (scene, baked) = all_shapes();
    let facets = &baked.facets;
    for side in [64, 300] {
        let atlas = Atlas::new(&scene, &baked.patches, facets, side).unwrap();
        let [width, height] = atlas.size();
        assert!(width <= side && height <= side && atlas.density() > 0.0);
        let mut owner = vec![usize::MAX; (width * height) as usize];
        let mut charted = vec![0; facets.as_slice().len()];
        for chart in 0..atlas.charts() {
            // With its padding it is in the atlas, and no texel of that is another's.
            let (first, texels) = atlas.chart_texels(chart);
            for y in first[1] - PADDING..first[1] + texels[1] + PADDING {
                for x in first[0] - PADDING..first[0] + texels[0] + PADDING {
                    let there = &mut owner[(y * width + x) as usize];
                    assert_eq!(*there, usize::MAX, "charts {chart} and {there} share texel {x}, {y}");
                    *there = chart;
                }
            }
            let mut covered = vec![0; (width * height) as usize];
            for &facet in atlas.chart_facets(chart) {
                charted[facet as usize] += 1;
                for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)] {
                    let [x, y] = atlas.coordinates(facet, u, v);
                    let at = [x * f64::from(width), y * f64::from(height)];
                    for k in 0..2 {
                        let (low, high) = (f64::from(first[k]), f64::from(first[k] + texels[k]));
                        assert!((low - 1e-9..=high + 1e-9).contains(&at[k]), "facet {facet}");
                    }
                }
                texels_on(&atlas, facets, facet, 1e-3).iter().for_each(|&(texel, ..)| covered[texel] += 1);
            }
            assert!(covered.iter().all(|&times| times <= 1), "chart {chart} lies on itself");
        }
        assert!(charted.iter().all(|&times| times == 1), "each facet is in one chart");
    }
}

/// Texels whose centres lie within a facet, `within` of its border in (u, v), and where.
fn texels_on(atlas: &Atlas, facets: &Facets, facet: u32, within: f64) -> Vec<(usize, f64, f64)> {
    let size = DVec2::from(atlas.size().map(f64::from));
    let corner = |u, v| DVec2::from(atlas.coordinates(facet, u, v)) * size;
    let (origin, first, second) = (corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0));
    let (along, upward) = (first - origin, second - origin);
    let all = [origin, first, second, first + upward];
    let low = all.into_iter().fold(DVec2::INFINITY, DVec2::min).floor().max(DVec2::ZERO);
    let high = all.into_iter().fold(DVec2::ZERO, DVec2::max).ceil().min(size);
    let mut found = Vec::new();
    for y in low.y as usize..high.y as usize {
        for x in low.x as usize..high.x as usize {
            let p = DVec2::new(x as f64 + 0.5, y as f64 + 0.5) - origin;
            let area = along.perp_dot(upward);
            let (u, v) = (p.perp_dot(upward) / area, along.perp_dot(p) / area);
            let end = match facets[facet].cells {
                Cells::Grid { .. } => u.max(v),
                Cells::One(_) => u + v,
            };
            if u > within && v > within && end < 1.0 - within {
                found.push((y * size.x as usize + x, u, v));
            }
        }
    }
    found
}

#[test]
fn texels_have_the_shading_of_their_place() {
    let (scene, baked) = all_shapes();
    let atlas = Atlas::new(&scene, &baked.patches, &baked.facets, 400).unwrap();
    for light in [&baked.solution.radiosity, &baked.solution.irradiance] {
        let shaded = shaded(&scene, &baked, light);
        let linear = atlas.light_map(&shaded).pixels;
        let screen = atlas.screen_light_map(&shaded, TONE);
        let mut seen = 0;
        for facet in 0..baked.facets.as_slice().len() as u32 {
            for (texel, u, v) in texels_on(&atlas, &baked.facets, facet, 0.02) {
                let expected = shaded.at(facet, u, v).to_array().map(|channel| channel as f32);
                for k in 0..3 {
                    assert!(
                        (linear[texel][k] - expected[k]).abs() <= 1e-5 * expected[k].abs(),
                        "facet {facet}"
                    );
                    let code = 255.0 * srgb_from_linear(TONE.apply(expected)[k]);
                    assert!((f32::from(screen.pixels[texel][k]) - code).abs() < 0.51);
                }
                seen += 1;
            }
        }
        assert!(seen > 60_000, "{seen}");
    }
}

/// Parallelograms are not only sampled but are the shading itself, everywhere, up to their borders.
#[test]
fn filtering_gives_the_shading_of_grids() {
    let scene = room();
    let baked = solved(&scene);
    let shaded = shaded(&scene, &baked, &baked.solution.radiosity);
    let atlas = Atlas::new(&scene, &baked.patches, &baked.facets, 128).unwrap();
    let map = atlas.light_map(&shaded).pixels;
    for facet in 0..6 {
        for step in 0..400 {
            let [u, v] = [f64::from(step % 20) / 19.0, f64::from(step / 20) / 19.0];
            let got = filtered(atlas.size(), |k| map[k], atlas.coordinates(facet, u, v));
            let expected = shaded.at(facet, u, v).to_array();
            assert!((0..3).all(|k| (got[k] - expected[k]).abs() < 1e-5 * expected[k]), "{facet} {u} {v}");
        }
    }
}

/// Across the sides where charts part a smooth surface, what is filtered from the two charts is the same colour.
#[test]
fn no_seam_is_seen() {
    let (scene, baked) = all_shapes();
    let (patches, light) = (&baked.patches, &baked.solution.radiosity);
    let shaded = shaded(&scene, &baked, light);
    let tone = ToneMap { exposure: automatic_exposure(patches, light), ..TONE };
    let atlas = Atlas::new(&scene, patches, &baked.facets, 1024).unwrap();
    let picture = atlas.screen_light_map(&shaded, tone);
    let texel = |k: usize| picture.pixels[k].map(|byte| linear_from_srgb(f32::from(byte) / 255.0));
    let code = |colour: [f64; 3]| colour.map(|x| f64::from(255.0 * srgb_from_linear(x as f32)));
    let at = |(facet, uv): (u32, DVec2)| atlas.coordinates(facet, uv.x, uv.y);
    let (mut greatest, mut sum, mut count) = (0.0_f64, 0.0, 0.0);
    for [one, other] in smooth_sides(&baked.facets, &shaded) {
        let apart = |end: usize| {
            DVec2::from(at((one.0, one.1[end]))).distance(at((other.0, other.1[end])).into()) > 1e-6
        };
        if !apart(0) && !apart(1) {
            continue;
        }
        for step in 0..=8 {
            let [a, b] = [one, other].map(|(facet, ends)| {
                let uv = ends[0].lerp(ends[1], f64::from(step) / 8.0);
                code(filtered(atlas.size(), texel, at((facet, uv))))
            });
            for k in 0..3 {
                greatest = greatest.max((a[k] - b[k]).abs());
                sum += (a[k] - b[k]).abs();
                count += 1.0;
            }
        }
    }
    // In grey levels of 255, and each side is rounded to one.
    assert!(count > 2000.0 && greatest < 1.5 && sum / count < 0.25, "{count} {greatest} {}", sum / count);
}

/// In a room where everything glows alike, everything in the texture does, between the charts too.
#[test]
fn the_furnace_is_one_colour() {
    let (mut scene, _) = all_shapes();
    scene.surfaces.extend(rooms::sides([-9.0; 3], [9.0; 3], 3, true));
    rooms::paint(&mut scene, |_| (Rgb::grey(0.3), Rgb::grey(0.4)));
    let baked = solved(&scene);
    let atlas = Atlas::new(&scene, &baked.patches, &baked.facets, 256).unwrap();
    for pixel in atlas.light_map(&shaded(&scene, &baked, &baked.solution.radiosity)).pixels {
        assert!(pixel.iter().all(|channel| (channel - 0.5).abs() < 1e-5), "{pixel:?}");
    }
}

#[test]
fn a_light_map_is_a_texture_of_every_material() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("room.glb");
    let scene = room();
    let baked = solved(&scene);
    let atlas = Atlas::new(&scene, &baked.patches, &baked.facets, 100).unwrap();
    write_with(&scene, &baked, &path, GltfForm::Binary, Some(&atlas));
    let (json, bytes) = open(&path);
    gltf::Gltf::from_slice(&fs::read(&path).unwrap()).unwrap();

    let view = &json["bufferViews"][json["images"][0]["bufferView"].as_u64().unwrap() as usize];
    let [start, length] = ["byteOffset", "byteLength"].map(|name| view[name].as_u64().unwrap() as usize);
    let mut png = png::Decoder::new(std::io::Cursor::new(&bytes[start..][..length])).read_info().unwrap();
    let mut pixels = vec![0; png.output_buffer_size().unwrap()];
    let frame = png.next_frame(&mut pixels).unwrap();
    assert_eq!([frame.width, frame.height], atlas.size());
    let shaded = shaded(&scene, &baked, &baked.solution.radiosity);
    assert!(pixels == atlas.screen_light_map(&shaded, TONE).pixels.as_flattened());

    for material in json["materials"].as_array().unwrap() {
        let texture = &material["pbrMetallicRoughness"]["baseColorTexture"];
        assert_eq!(*texture, serde_json::json!({"index": 0, "texCoord": 1}));
        assert!(material["extensions"]["KHR_materials_unlit"].is_object());
    }
    for (mesh, surface) in json["meshes"].as_array().unwrap().iter().zip(&scene.surfaces) {
        let attributes = &mesh["primitives"][0]["attributes"];
        // Colours of vertices would be multiplied in.
        assert!(attributes["COLOR_0"].is_null());
        assert_eq!(attributes["TEXCOORD_0"], attributes["TEXCOORD_1"]);
        let coordinates = &json["accessors"][attributes["TEXCOORD_1"].as_u64().unwrap() as usize];
        assert_eq!(
            (coordinates["type"].as_str(), coordinates["componentType"].as_u64()),
            (Some("VEC2"), Some(5126))
        );
        let corners = if matches!(surface.shape, Shape::Parallelogram(_)) { 4 } else { 6 };
        assert_eq!(coordinates["count"], corners);
    }
}

#[test]
fn a_light_map_is_the_same_on_any_number_of_threads() {
    let (scene, baked) = all_shapes();
    let maps: Vec<_> = [1, 3]
        .map(|threads| {
            let threads = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            threads.install(|| {
                let atlas = Atlas::new(&scene, &baked.patches, &baked.facets, 200).unwrap();
                let map = atlas.light_map(&shaded(&scene, &baked, &baked.solution.radiosity));
                (atlas, map)
            })
        })
        .into();
    assert!(maps[0] == maps[1]);
}

#[test]
fn an_atlas_that_cannot_be_is_refused_with_its_cure() {
    let mut scene = rooms::cube(1);
    let of = |scene: &Scene, side| {
        let patches = patches::subdivide(scene, 1.0).unwrap();
        Atlas::new(scene, &patches, &Facets::new(scene, &patches), side)
    };
    assert_eq!(of(&scene, 7), Err(AtlasError::Side(7)));
    assert_eq!(of(&scene, 16_385), Err(AtlasError::Side(16_385)));
    // Six charts of one texel, each with two texels around it: 5 x 5, of which nine have room.
    assert!(of(&scene, 16).unwrap().size().iter().all(|&side| side <= 15));
    let plate = scene.surfaces[0].clone();
    scene.surfaces.resize(400, plate);
    let told = of(&scene, 64).unwrap_err().to_string();
    assert!(told.contains("400 charts do not fit into a light map of 64 x 64"), "{told}");
    assert!(told.contains("take a side of 128 or more"), "{told}");
    assert!(of(&scene, 128).is_ok());
}

/// The bytes of an array of a .vtu, without the length before them.
fn array(text: &str, name: &str) -> Vec<u8> {
    let (_, after) = text.split_once(&format!("Name=\"{name}\"")).unwrap();
    let content = after.split_once('>').unwrap().1.split_once('<').unwrap().0;
    let bytes = BASE64_STANDARD.decode(content).unwrap();
    let (length, values) = bytes.split_first_chunk().unwrap();
    assert_eq!(u64::from_le_bytes(*length), values.len() as u64, "{name}");
    values.to_vec()
}

fn doubles(text: &str, name: &str) -> Vec<f64> {
    array(text, name).chunks_exact(8).map(|b| f64::from_le_bytes(*b.first_chunk().unwrap())).collect()
}

fn whole(text: &str, name: &str) -> Vec<i64> {
    array(text, name).chunks_exact(8).map(|b| i64::from_le_bytes(*b.first_chunk().unwrap())).collect()
}

#[test]
fn vtk_has_a_cell_a_patch_with_every_quantity() {
    let folder = tempfile::tempdir().unwrap();
    let path: PathBuf = folder.path().join("room.vtu");
    let mut scene = room();
    let pentagon =
        [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.05, 0.2], [0.0, 0.1]].map(|[x, y]| DVec3::new(x, y, 0.3));
    scene.surfaces.push(Surface {
        shape: Shape::Polygon(radiosity::scene::Polygon { vertices: pentagon.into() }),
        ..scene.surfaces[0].clone()
    });
    let baked = solved(&scene);
    let patches = &baked.patches;
    write_vtu(&path, &scene, patches, &baked.facets, &baked.solution, None).unwrap();
    let text = fs::read_to_string(&path).unwrap();
    let count = patches.len();
    assert!(text.contains(&format!("NumberOfCells=\"{count}\"")));

    let rgb = |values: &[Rgb]| values.iter().flat_map(|value| value.to_array()).collect::<Vec<_>>();
    assert_eq!(doubles(&text, "radiosity"), rgb(&baked.solution.radiosity));
    assert_eq!(doubles(&text, "irradiance"), rgb(&baked.solution.irradiance));
    assert_eq!(doubles(&text, "emission"), rgb(&patches.emission));
    assert_eq!(doubles(&text, "reflectance"), rgb(&patches.reflectance));
    assert_eq!(doubles(&text, "area"), patches.area);
    assert_eq!(whole(&text, "patch"), (0..count as i64).collect::<Vec<_>>());
    assert_eq!(whole(&text, "object"), patches.surface.iter().map(|&s| i64::from(s)).collect::<Vec<_>>());

    // Each cell has its patch's area, and its front.
    let points: Vec<DVec3> = doubles(&text, "Points").chunks(3).map(DVec3::from_slice).collect();
    let corners = whole(&text, "connectivity");
    let mut start = 0;
    for (patch, end) in whole(&text, "offsets").into_iter().enumerate() {
        let cell: Vec<DVec3> = corners[start..end as usize].iter().map(|&k| points[k as usize]).collect();
        let area = radiosity::geometry::polygon::area_vector(&cell);
        assert!((area - patches.normal[patch] * patches.area[patch]).length() < 1e-12, "patch {patch}");
        start = end as usize;
    }
    let types = array(&text, "types");
    assert_eq!((types[0], types[count - 3], types[count - 1]), (9, 5, 7));
    // A square of 5 x 5 patches has 6 x 6 points, shared by its cells.
    assert_eq!(points.len(), 6 * 36 + 4 + 5);
}
