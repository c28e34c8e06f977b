//! glTF and VTK out: what is written holds what was solved, and is read back as the scene it was.

mod rooms;

use std::fs;
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use glam::DVec3;
use radiosity::bake::{Baked, Method, Request, Run, bake};
use radiosity::export::{GltfForm, SolvedScene, write_gltf, write_vtu};
use radiosity::light::Rgb;
use radiosity::patches;
use radiosity::scene::{self, BackFaces, Camera, Material, Mesh, Place, Scene, Shape, Surface};
use radiosity::shade::{Atlas, ToneMap, frame};
use radiosity::watch::ignore;
use serde_json::Value;

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

fn write(scene: &Scene, baked: &Baked, path: &Path, form: GltfForm) -> Camera {
    write_with(scene, baked, path, form, None)
}

fn write_with(scene: &Scene, baked: &Baked, path: &Path, form: GltfForm, atlas: Option<&Atlas>) -> Camera {
    let camera = scene.camera.unwrap_or_else(|| frame(scene));
    let solved = SolvedScene {
        scene,
        patches: &baked.patches,
        facets: &baked.facets,
        solution: &baked.solution,
        camera: &camera,
        tone: ToneMap { exposure: 0.5, ..ToneMap::default() },
        back_faces: scene.back_faces,
        atlas,
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

    let tone = ToneMap { exposure: 0.5, ..ToneMap::default() };
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
        for (name, form) in [("room.glb", GltfForm::Binary), ("room.gltf", GltfForm::Text)] {
            let path = folder.path().join(name);
            let camera = write(&scene, &baked, &path, form);
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
    write_vtu(&path, &scene, patches, &baked.facets, &baked.solution).unwrap();
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
