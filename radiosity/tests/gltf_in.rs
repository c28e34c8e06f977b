//! glTF in: geometry, transforms, materials and cameras as the standard has them, and what damaged files are told.

mod rooms;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use glam::DVec3;
use proptest::prelude::*;
use radiosity::form_factors::hemicube::{CellWeights, Hemicube, Scratch};
use radiosity::light::Rgb;
use radiosity::patches::{self, Cutting, Subdivision};
use radiosity::scene::{BackFaces, LeftOut, Mesh, Scene, SceneError, Shape, Surface, gltf};
use radiosity::visibility::{Facets, RayTree};
use serde_json::{Value, json};

/// A document and its one buffer, which grows.
struct Draft {
    json: Value,
    bytes: Vec<u8>,
}

impl Draft {
    fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0, "name": "Thing"}],
            "meshes": [{"primitives": [{"attributes": {}, "material": 0}]}],
            "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 0.125, 1], "metallicFactor": 0}}],
            "accessors": [], "bufferViews": [],
        });
        Self { json, bytes: Vec::new() }
    }

    /// A new view of these bytes; its number.
    fn view(&mut self, bytes: &[u8]) -> usize {
        while !self.bytes.len().is_multiple_of(4) {
            self.bytes.push(0);
        }
        let view = json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()});
        self.bytes.extend(bytes);
        let views = self.json["bufferViews"].as_array_mut().unwrap();
        views.push(view);
        views.len() - 1
    }

    /// A new accessor of these bytes; its number.
    fn accessor(&mut self, kind: &str, component: u32, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        let accessors = self.json["accessors"].as_array_mut().unwrap();
        accessors.push(json!({"bufferView": view, "componentType": component, "count": count, "type": kind}));
        accessors.len() - 1
    }

    fn floats<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
        self.accessor(["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1], 5126, values.len(), &bytes)
    }

    fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    /// Give the primitive its positions.
    fn positions(mut self, positions: &[[f32; 3]]) -> Self {
        let accessor = self.floats(positions);
        self.primitive()["attributes"]["POSITION"] = accessor.into();
        self
    }

    fn indices(mut self, component: u32, indices: &[u32]) -> Self {
        let size = if component == 5121 {
            1
        } else if component == 5123 {
            2
        } else {
            4
        };
        let bytes: Vec<u8> = indices.iter().flat_map(|index| index.to_le_bytes()[..size].to_vec()).collect();
        let accessor = self.accessor("SCALAR", component, indices.len(), &bytes);
        self.primitive()["indices"] = accessor.into();
        self
    }

    fn with(mut self, pointer: &str, value: Value) -> Self {
        let (at, name) = pointer.rsplit_once('/').unwrap();
        match self.json.pointer_mut(at).unwrap() {
            Value::Array(list) => list[name.parse::<usize>().unwrap()] = value,
            object => object[name] = value,
        }
        self
    }

    fn text(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        let uri = format!("data:application/octet-stream;base64,{}", BASE64_STANDARD.encode(&self.bytes));
        json["buffers"] = json!([{"uri": uri, "byteLength": self.bytes.len()}]);
        serde_json::to_vec(&json).unwrap()
    }

    fn binary(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"] = json!([{"byteLength": self.bytes.len()}]);
        let mut json = serde_json::to_vec(&json).unwrap();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut bin = self.bytes.clone();
        bin.resize(bin.len().next_multiple_of(4), 0);
        let word = |n: usize| (n as u32).to_le_bytes();
        let header =
            [*b"glTF", word(2), word(12 + 8 + json.len() + 8 + bin.len()), word(json.len()), *b"JSON"];
        [header.as_flattened(), &json, &word(bin.len()), b"BIN\0", &bin].concat()
    }

    fn read(&self) -> Result<Scene, SceneError> {
        parse(&self.text())
    }

    fn scene(&self) -> Scene {
        self.read().unwrap_or_else(|error| panic!("{error}"))
    }
}

fn parse(bytes: &[u8]) -> Result<Scene, SceneError> {
    gltf::parse_scene("a.gltf", bytes, |uri| Err(format!("there is no {uri}")))
}

fn mesh(surface: &Surface) -> &Mesh {
    match &surface.shape {
        Shape::Mesh(mesh) => mesh,
        other => panic!("{other:?}"),
    }
}

const SQUARE: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

/// A unit square in the plane z = 0, facing +z.
fn square() -> Draft {
    Draft::new().positions(&SQUARE).indices(5123, &[0, 1, 2, 0, 2, 3])
}

fn normals(scene: &Scene) -> Vec<DVec3> {
    patches::subdivide(scene, 1.0).unwrap().normal
}

fn close(a: Rgb, b: Rgb) -> bool {
    (a - b).norm_squared() < 1e-12
}

#[test]
fn a_square_is_read_from_text_and_from_binary() {
    let draft = square();
    let scene = draft.scene();
    let surface = &scene.surfaces[0];
    assert_eq!((surface.name.as_str(), scene.back_faces), ("Thing", BackFaces::Black));
    assert!(close(surface.material.diffuse, Rgb::new(0.5, 0.25, 0.125)));
    assert_eq!(surface.material.emission, Rgb::BLACK);
    assert_eq!(mesh(surface).triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(normals(&scene), [DVec3::Z; 2]);
    assert_eq!(scene.warnings, []);
    let binary = parse(&draft.binary()).unwrap();
    assert_eq!(binary, scene);
    // Beside the file, with an escape in its name.
    let mut beside = draft.json.clone();
    beside["buffers"] = json!([{"uri": "my%20room.bin", "byteLength": draft.bytes.len()}]);
    let read = gltf::parse_scene("a.gltf", &serde_json::to_vec(&beside).unwrap(), |uri| {
        assert_eq!(uri, "my room.bin");
        Ok(draft.bytes.clone())
    });
    assert_eq!(read.unwrap(), scene);
}

#[test]
fn every_mode_and_every_type_of_index_gives_the_same_square() {
    for (mode, component, indices) in [
        (4, 5121, &[0, 1, 2, 0, 2, 3][..]),
        (4, 5125, &[0, 1, 2, 0, 2, 3]),
        (5, 5123, &[0, 1, 3, 2]),
        (6, 5121, &[0, 1, 2, 3]),
    ] {
        let draft = Draft::new().positions(&SQUARE).indices(component, indices);
        let scene = draft.with("/meshes/0/primitives/0/mode", mode.into()).scene();
        let patches = patches::subdivide(&scene, 1.0).unwrap();
        assert_eq!(patches.total_area(), 1.0, "mode {mode}");
        assert_eq!(patches.normal, [DVec3::Z; 2], "mode {mode}");
    }
    let without = Draft::new().positions(&[SQUARE[0], SQUARE[1], SQUARE[2]]).scene();
    assert_eq!(mesh(&without.surfaces[0]).triangles, [[0, 1, 2]]);
    let points = square().with("/meshes/0/primitives/0/mode", 0.into()).read().unwrap_err();
    assert!(points.to_string().contains("no triangle"));
}

#[test]
fn strides_sparse_elements_and_quantised_positions_are_read() {
    // A fourth vertex that the sparse part moves from (0, 0, 9) to (0, 1, 0).
    let mut moved = SQUARE;
    moved[3] = [0.0, 0.0, 9.0];
    let mut draft = Draft::new().positions(&moved).indices(5121, &[0, 1, 2, 0, 2, 3]);
    let places = draft.view(&3_u16.to_le_bytes());
    let bytes: Vec<u8> = SQUARE[3].iter().flat_map(|value| value.to_le_bytes()).collect();
    let values = draft.view(&bytes);
    draft.json["accessors"][0]["sparse"] = json!({
        "count": 1,
        "indices": {"bufferView": places, "componentType": 5123},
        "values": {"bufferView": values},
    });
    assert_eq!(draft.scene().surfaces, square().scene().surfaces);

    // Normalised bytes with padding after each.
    let mut draft = Draft::new();
    let bytes: Vec<u8> = SQUARE.iter().flat_map(|p| [127 * p[0] as u8, 127 * p[1] as u8, 0, 99]).collect();
    let accessor = draft.accessor("VEC3", 5120, 4, &bytes);
    draft.json["accessors"][accessor]["normalized"] = true.into();
    draft.json["bufferViews"][0]["byteStride"] = 4.into();
    draft.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    draft.primitive()["attributes"]["POSITION"] = accessor.into();
    assert_eq!(draft.indices(5121, &[0, 1, 2, 0, 2, 3]).scene().surfaces, square().scene().surfaces);
}

#[test]
fn instances_stand_where_their_nodes_take_them() {
    let nodes = json!([
        {"children": [1, 2, 3, 4], "translation": [10, 0, 0]},
        {"mesh": 0, "scale": [2, 3, 1]},
        // A quarter turn about x takes +z to -y.
        {"mesh": 0, "rotation": [std::f64::consts::FRAC_1_SQRT_2, 0, 0, std::f64::consts::FRAC_1_SQRT_2]},
        {"mesh": 0, "scale": [-1, 1, 1]},
        {"mesh": 0, "matrix": [0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1]},
    ]);
    let scene = square().with("/nodes", nodes).scene();
    assert_eq!(scene.surfaces.len(), 4);
    let patches = patches::subdivide(&scene, 1.0).unwrap();
    let area = |surface: usize| patches.blocks[surface].patches().map(|i| patches.area[i]).sum::<f64>();
    assert_eq!([area(0), area(2), area(3)], [6.0, 1.0, 1.0]);
    let normal = |surface: usize| patches.normal[patches.blocks[surface].patches().start];
    assert_eq!((normal(0), normal(3)), (DVec3::Z, DVec3::Z));
    assert!((normal(1) - DVec3::NEG_Y).length() < 1e-6);
    // Mirrored, the front stays the front.
    assert_eq!(normal(2), DVec3::Z);
    let centre = |surface: usize| patches.centre[patches.blocks[surface].patches().start];
    assert!((centre(3) - DVec3::new(10.0 - 1.0 / 3.0, 2.0 / 3.0, 5.0)).length() < 1e-6, "{}", centre(3));
}

#[test]
fn emission_is_factor_times_strength() {
    let material = json!({
        "emissiveFactor": [1, 0.5, 0.25],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 20}},
        "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0},
    });
    let draft = square().with("/materials/0", material);
    let scene = draft.with("/extensionsUsed", json!(["KHR_materials_emissive_strength"])).scene();
    assert!(close(scene.surfaces[0].material.emission, Rgb::new(20.0, 10.0, 5.0)));
    assert_eq!(scene.warnings, []);
}

/// A PNG of two pixels, sRGB 188 (linear 0.503) and black, as a data: URI.
fn two_pixels() -> String {
    let mut png = Vec::new();
    let mut encoder = png::Encoder::new(&mut png, 2, 1);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header().unwrap().write_image_data(&[188, 188, 188, 0, 0, 0]).unwrap();
    format!("data:image/png;base64,{}", BASE64_STANDARD.encode(&png))
}

#[test]
fn textures_and_vertex_colours_give_each_triangle_its_own() {
    // The first triangle lies on the left pixel, the second on the right one.
    let coordinates = [[0.05_f32, 0.5], [0.2, 0.5], [0.4, 0.5], [0.6, 0.5], [0.7, 0.5], [0.9, 0.5]];
    let corners = [SQUARE[0], SQUARE[1], SQUARE[2], SQUARE[0], SQUARE[2], SQUARE[3]];
    let mut draft = Draft::new().positions(&corners);
    let accessor = draft.floats(&coordinates);
    draft.primitive()["attributes"]["TEXCOORD_0"] = accessor.into();
    draft.json["images"] = json!([{"uri": two_pixels()}]);
    draft.json["textures"] = json!([{"source": 0}]);
    draft.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": 0});
    draft.json["materials"][0]["emissiveTexture"] = json!({"index": 0});
    draft.json["materials"][0]["emissiveFactor"] = json!([1, 1, 1]);
    let scene = draft.scene();
    let light = f64::from(radiosity::shade::linear_from_srgb(188.0 / 255.0));
    let patches = patches::subdivide(&scene, 1.0).unwrap();
    assert!(close(patches.reflectance[0], Rgb::new(0.5, 0.25, 0.125) * light), "{:?}", patches.reflectance);
    assert_eq!(patches.reflectance[1], Rgb::BLACK);
    assert!(close(patches.emission[0], Rgb::grey(light)) && patches.emission[1].is_black());
    // The material is the mean, by area.
    assert!(close(scene.surfaces[0].material.emission, Rgb::grey(light / 2.0)));

    let colours: Vec<[f32; 3]> =
        (0..6).map(|k| if k < 3 { [1.0, 0.5, 0.0] } else { [0.0, 1.0, 1.0] }).collect();
    let accessor = draft.floats(&colours);
    draft.primitive()["attributes"]["COLOR_0"] = accessor.into();
    draft.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"].take();
    let patches = patches::subdivide(&draft.scene(), 1.0).unwrap();
    assert!(close(patches.reflectance[0], Rgb::new(0.5, 0.125, 0.0)));
    assert!(close(patches.reflectance[1], Rgb::new(0.0, 0.25, 0.125)));

    // An image that cannot be had is a warning, and the factor counts alone.
    draft.json["images"] = json!([{"uri": "wood.jpg"}]);
    let scene = draft.scene();
    assert!(scene.warnings[0].message.contains("there is no wood.jpg"), "{:?}", scene.warnings);
}

#[test]
fn texture_coordinates_are_transformed_as_khr_texture_transform_has_it() {
    let mut draft = square();
    let accessor = draft.floats(&[[0.0_f32, 0.0], [0.4, 0.0], [0.4, 1.0], [0.0, 1.0]]);
    draft.primitive()["attributes"]["TEXCOORD_0"] = accessor.into();
    draft.json["images"] = json!([{"uri": two_pixels()}]);
    draft.json["textures"] = json!([{"source": 0}]);
    for (transform, left) in [
        (json!({}), true),
        (json!({"offset": [0.55, 0]}), false),
        // A quarter turn: u comes from v, which runs over both pixels; scaled to the left one alone.
        (json!({"rotation": std::f64::consts::FRAC_PI_2, "scale": [0.1, 0.4]}), true),
    ] {
        let extensions = json!({"KHR_texture_transform": transform});
        draft.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] =
            json!({"index": 0, "extensions": extensions});
        let scene = draft.scene();
        assert_eq!(!scene.surfaces[0].material.diffuse.is_black(), left, "{extensions}");
    }
}

/// A square image of shades of grey (codes), as a data: URI.
fn image(side: u32, codes: &[u8]) -> String {
    let mut png = Vec::new();
    let mut encoder = png::Encoder::new(&mut png, side, side);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.write_header().unwrap().write_image_data(codes).unwrap();
    format!("data:image/png;base64,{}", BASE64_STANDARD.encode(&png))
}

/// The unit square under an image that it has all of, once, as a white floor and a lamp of three units.
fn textured_square(side: u32, codes: &[u8]) -> Draft {
    let mut draft = square();
    let accessor = draft.floats(&[[0.0_f32, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]);
    draft.primitive()["attributes"]["TEXCOORD_0"] = accessor.into();
    draft.json["images"] = json!([{"uri": image(side, codes)}]);
    draft.json["textures"] = json!([{"source": 0}]);
    draft.json["materials"] = json!([{
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0},
        "emissiveTexture": {"index": 0}, "emissiveFactor": [1, 1, 1],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 3}},
    }]);
    draft
}

/// Sixteen squares, black and white by turns; the one at the top left is white.
fn checkerboard() -> Vec<u8> {
    (0..16).map(|k| if (k % 4 + k / 4) % 2 == 0 { 255 } else { 0 }).collect()
}

/// Whether the square of four by four that a point of the unit square is in is white; y is upwards.
fn white(centre: DVec3) -> bool {
    ((centre.x * 4.0) as u32 + ((1.0 - centre.y) * 4.0) as u32).is_multiple_of(2)
}

fn cutting(size: f64, split: bool, grading: u32) -> Cutting {
    Cutting { subdivision: Subdivision::PatchSize(size), split, grading }
}

#[test]
fn each_patch_has_the_texture_of_its_own_part() {
    let draft = textured_square(4, &checkerboard());
    let scene = draft.scene();
    assert_eq!(scene.warnings, []);
    // As it comes, each half has as much white as black.
    let whole = patches::subdivide(&scene, 1.0).unwrap();
    assert!(whole.reflectance.iter().all(|&r| close(r, Rgb::grey(0.5))), "{:?}", whole.reflectance);
    // Edges of a quarter and their diagonals: every patch lies within one square.
    let patches = patches::subdivide(&scene, cutting(0.3536, false, 0)).unwrap();
    assert_eq!(patches.len(), 32);
    for patch in 0..patches.len() {
        let there = if white(patches.centre[patch]) { 1.0 } else { 0.0 };
        assert_eq!(patches.reflectance[patch], Rgb::grey(there), "{}", patches.centre[patch]);
        assert_eq!(patches.emission[patch], Rgb::grey(3.0 * there));
    }
    // The same of a mirrored instance, and of the back of a sheet.
    let mirrored =
        draft.with("/nodes/0/scale", json!([-1, 1, 1])).with("/materials/0/doubleSided", true.into());
    let patches = patches::subdivide(&mirrored.scene(), cutting(0.3536, false, 0)).unwrap();
    assert_eq!(patches.len(), 64);
    for (centre, found) in patches.centre.iter().zip(&patches.reflectance) {
        assert_eq!(found.r == 1.0, white(DVec3::new(-centre.x, centre.y, 0.0)), "{centre}");
    }
}

/// However a textured lamp is cut, split and graded, its power is that of its triangles, and of its texels.
#[test]
fn a_textured_lamp_keeps_its_power() {
    let codes: Vec<u8> = (0..49_u32).map(|k| (k * 97 % 251) as u8).collect();
    let exact: f64 = codes.iter().map(|&code| light(code)).sum::<f64>() * 3.0 / 49.0;
    let mut scene = textured_square(7, &codes).scene();
    // Two walls stand on it, one across it and one that ends within.
    scene.surfaces.push(rooms::plate([0.3, -1.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 1.0], 1));
    scene.surfaces.push(rooms::plate([0.1, 0.45, 0.0], [0.43, 0.2, 0.0], [0.0, 0.0, 1.0], 1));
    let mut counts = Vec::new();
    for cutting in [1.0.into(), cutting(0.4, false, 0), cutting(0.13, true, 0), cutting(0.21, true, 2)] {
        let patches = patches::subdivide(&scene, cutting).unwrap();
        let power = patches.total_power();
        assert!((power.r / exact - 1.0).abs() < 1e-9, "{cutting:?}: {} for {exact}", power.r);
        let block = patches.blocks[0].patches();
        counts.push(block.len());
        // No triangle's own mean: they differ within each.
        let far = |a: Rgb, b: Rgb| (a - b).norm_squared() > 0.01;
        assert!(block.len() == 2 || block.skip(1).any(|k| far(patches.emission[k], patches.emission[0])));
    }
    assert!(counts[0] == 2 && counts[2] > 150 && counts[3] > 300, "{counts:?}");
}

fn light(code: u8) -> f64 {
    radiosity::shade::linear_from_srgb(f32::from(code) / 255.0).into()
}

#[test]
fn colours_at_vertices_run_across_patches() {
    let mut draft = square();
    let colours = draft.floats(&[[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.5], [1.0, 1.0, 0.5], [0.0, 1.0, 0.0]]);
    draft.primitive()["attributes"]["COLOR_0"] = colours.into();
    let patches = patches::subdivide(&draft.scene(), cutting(0.2, false, 0)).unwrap();
    assert!(patches.len() > 40);
    for (centre, found) in patches.centre.iter().zip(&patches.reflectance) {
        assert!(close(*found, Rgb::new(0.5 * centre.x, 0.25 * centre.y, 0.0625 * centre.x)), "{centre}");
    }
}

#[test]
fn a_double_sided_surface_is_two() {
    let scene = square().with("/materials/0/doubleSided", true.into()).scene();
    assert_eq!(scene.surfaces.len(), 2);
    assert_eq!(scene.surfaces[1].name, "Thing (back)");
    let patches = patches::subdivide(&scene, 1.0).unwrap();
    assert_eq!(patches.normal, [DVec3::Z, DVec3::Z, DVec3::NEG_Z, DVec3::NEG_Z]);
    assert_eq!(patches.centre[..2], patches.centre[2..]);
}

/// From each side of a double-sided sheet the side that faces it is seen, whole, and nothing of the other.
#[test]
fn a_double_sided_surface_is_seen_right_from_each_side() {
    // A unit square in the plane z = 1, between two unit plates that face it, at z = 0 and 2.
    let sheet = square().with("/materials/0/doubleSided", true.into());
    let mut scene = sheet.with("/nodes/0/translation", json!([0, 0, 1])).scene();
    scene.surfaces.push(rooms::plate([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 6));
    scene.surfaces.push(rooms::plate([0.0, 0.0, 2.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], 6));
    let patches = patches::subdivide(&scene, 1.0).unwrap();
    let facets = Facets::new(&scene, &patches);
    let hemicube = Hemicube::new(&patches, &facets, scene.back_faces, CellWeights::new(100).unwrap());
    let tree = RayTree::new(&facets);
    let mut scratch = Scratch::default();
    for (plate, facing, away) in [(2, 1, 0), (3, 0, 1)] {
        let mut sums = [0.0; 2];
        for patch in patches.blocks[plate].patches() {
            for row in [hemicube.row(patch, &mut scratch), hemicube.row_by_rays(patch, &tree)] {
                let to = |surface: usize| patches.blocks[surface].patches().map(|j| row.get(j)).sum::<f64>();
                sums[0] += to(facing) / 72.0;
                assert_eq!(to(away), 0.0);
                sums[1] += to(5 - plate);
            }
        }
        // Unit squares face to face; and the other plate is behind the sheet.
        assert!((sums[0] / 0.199_824_9 - 1.0).abs() < 0.02, "{sums:?}");
        assert!(sums[1] < 72.0 * 0.07, "{sums:?}");
    }
}

#[test]
fn the_camera_is_the_nodes() {
    let mut draft = square();
    draft.json["cameras"] = json!([
        {"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "znear": 0.1, "zfar": 9}},
        {"type": "perspective", "perspective": {"yfov": 2.0 * 0.5_f64.atan(), "aspectRatio": 2, "znear": 0.25}},
    ]);
    draft.json["scenes"][0]["nodes"] = json!([0, 1, 2]);
    draft.json["nodes"] = json!([
        {"mesh": 0},
        {"camera": 0},
        // Half a turn about y: it looks along +z.
        {"camera": 1, "translation": [1, 2, 3], "rotation": [0, 1, 0, 0]},
    ]);
    let scene = draft.scene();
    let camera = scene.camera.unwrap();
    assert_eq!((camera.eye, camera.near, camera.far), (DVec3::new(1.0, 2.0, 3.0), 0.25, f64::INFINITY));
    assert!((camera.forward - DVec3::Z).length() < 1e-7 && (camera.right - DVec3::NEG_X).length() < 1e-7);
    assert!((camera.vertical[1] - 0.5).abs() < 1e-6 && (camera.horizontal[1] - 1.0).abs() < 1e-6);
    assert!(scene.warnings.iter().any(|warning| warning.message.contains("orthographic")));
}

#[test]
fn what_plays_no_part_is_told() {
    let draft = square()
        .with(
            "/extensionsUsed",
            json!(["KHR_lights_punctual", "KHR_materials_unlit", "KHR_materials_clearcoat"]),
        )
        .with("/extensions", json!({"KHR_lights_punctual": {"lights": [{"type": "point"}]}}))
        .with("/nodes/0/extensions", json!({"KHR_lights_punctual": {"light": 0}}))
        .with("/materials/0/extensions", json!({"KHR_materials_unlit": {}}))
        .with("/materials/0/alphaMode", "BLEND".into())
        .with("/materials/0/pbrMetallicRoughness/baseColorFactor/3", 0.5.into());
    let told: Vec<String> = draft.scene().warnings.iter().map(ToString::to_string).collect();
    for (told, expected) in told.iter().zip([
        "a.gltf: 1 lamp without surface (KHR_lights_punctual) is left out",
        "a.gltf: materials[0]: it is transparent",
        "a.gltf: materials[0]: it is unlit",
        "a.gltf: extensionsUsed: KHR_materials_clearcoat play no part",
    ]) {
        assert!(told.starts_with(expected), "{told}");
    }
    assert_eq!(told.len(), 4, "{told:?}");
    let mut plain = square();
    plain.primitive()["material"].take();
    let scene = plain.scene();
    assert_eq!(scene.surfaces[0].material.diffuse, Rgb::grey(0.5));
    assert!(scene.warnings[0].message.contains("a grey that reflects 0.5"));
}

#[test]
fn dirt_is_mended() {
    let indices = [0, 1, 2, 0, 2, 3, 4, 2, 3, 0, 0, 1, 0, 1, 1];
    let mut corners = SQUARE.to_vec();
    corners.push(SQUARE[0]);
    let scene = Draft::new().positions(&corners).indices(5121, &indices).scene();
    let mesh = mesh(&scene.surfaces[0]);
    assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (4, 2));
    assert_eq!(mesh.left_out, LeftOut { flat: 2, repeated: 1 });
}

#[test]
fn each_fault_is_told_with_its_part() {
    let huge: u64 = 4_000_000_000;
    for (draft, told) in [
        (square().with("/asset/version", "1.0".into()), "this is glTF 1.0"),
        (
            square().with("/extensionsRequired", json!(["KHR_draco_mesh_compression"])),
            "extensionsRequired: KHR_draco",
        ),
        (
            square().with("/accessors/0/count", huge.into()),
            "accessors[0]: its 4000000000 elements reach beyond bufferViews[0]",
        ),
        (square().with("/accessors/0/byteOffset", u64::MAX.into()), "accessors[0]"),
        (
            square().with("/bufferViews/0/byteLength", huge.into()),
            "bufferViews[0]: it reaches beyond the end of buffers[0]",
        ),
        (square().with("/bufferViews/0/byteStride", 252.into()), "accessors[0]: its 4 elements reach beyond"),
        (square().with("/accessors/0/type", "VEC2".into()), "accessors[0]: vectors of 3 numbers"),
        (square().with("/accessors/1/componentType", 5126.into()), "accessors[1]: indices must be"),
        (
            square().with("/accessors/0/bufferView", 77.into()),
            "accessors[0].bufferView: there is no such index",
        ),
        (
            square().with("/meshes/0/primitives/0/attributes/POSITION", 77.into()),
            "meshes[0].primitives[0].attributes.POSITION",
        ),
        (square().with("/nodes/0/mesh", 7.into()), "nodes[0].mesh: there is no such index"),
        (square().with("/nodes/0/children", json!([0])), "nodes[0] (Thing): it stands in the scene twice"),
        (
            square().with("/nodes/0/scale", json!([1e38, 1, 1])),
            "nodes[0] (Thing): its transform is not finite",
        ),
        (square().with("/materials/0/emissiveFactor", json!([-1, 0, 0])), "materials[0]: the colour -1 0 0"),
        (
            square().with(
                "/accessors/0",
                json!({"componentType": 5126, "count": huge, "type": "VEC3", "sparse": {
            "count": 1, "indices": {"bufferView": 0, "componentType": 5121}, "values": {"bufferView": 0}}}),
            ),
            "accessors[0]: 4000000000 elements without a buffer",
        ),
        (
            Draft::new().positions(&SQUARE).indices(5121, &[0, 1, 9]),
            "meshes[0].primitives[0]: index 9 is beyond its 4",
        ),
        (Draft::new().positions(&[[f32::NAN; 3]; 3]), "meshes[0].primitives[0]: its vertex 0 is not finite"),
        (Draft::new().positions(&[[0.0; 3]; 3]), "the scene has no triangle"),
    ] {
        let error = draft.read().expect_err(told).to_string();
        assert!(error.starts_with(&format!("a.gltf: {told}")), "{error}");
    }
    for (bytes, told) in [
        (&b""[..], "this is no glTF"),
        (b"PK\x03\x04", "this is no glTF"),
        (b"glTF", "the file is cut short in its header"),
        (b"glTF\x02\0\0\0\x05\0\0\0", "the binary glTF has no JSON"),
        (b"glTF\x01\0\0\0\x05\0\0\0", "this is a binary glTF 1"),
        (b"{\"asset\": 7}", "the JSON is not that of a glTF 2.0"),
    ] {
        let error = parse(bytes).unwrap_err().to_string();
        assert!(error.starts_with(&format!("a.gltf: {told}")), "{error}");
    }
    let cut = square().binary();
    let error = parse(&cut[..cut.len() - 1]).unwrap_err().to_string();
    assert!(error.contains("cut short"), "{error}");
    let mut web = square().json;
    web["buffers"] = json!([{"uri": "https://example.org/a.bin", "byteLength": 4}]);
    let error = parse(&serde_json::to_vec(&web).unwrap()).unwrap_err().to_string();
    assert!(error.contains("buffers[0]: nothing is fetched from the network"), "{error}");
}

/// A thousand instances of a thousand instances: told, and not attempted.
#[test]
fn instances_without_number_are_refused() {
    let mut draft = Draft::new().positions(&SQUARE).indices(5121, &[0; 60_000]);
    let count = 2000;
    draft.json["nodes"] = (0..count).map(|_| json!({"mesh": 0})).collect();
    draft.json["scenes"][0]["nodes"] = (0..count).collect();
    let error = draft.read().unwrap_err().to_string();
    assert!(error.contains("more than 33554432 triangles"), "{error}");
}

/// Whatever comes: reading ends, and what is read can be cut and looked at.
fn survives(bytes: &[u8]) {
    if let Ok(scene) = parse(bytes) {
        let patches = patches::subdivide(&scene, 1.0).unwrap();
        rooms::assert_sound(&patches);
    }
}

proptest! {
    #[test]
    fn a_damaged_file_is_refused_or_read(place in 0.0..1.0, byte: u8, cut in 0.0..1.0, binary: bool) {
        let mut draft = square();
        let accessor = draft.floats(&[[0.1_f32, 0.2], [0.4, 0.0], [0.4, 1.0], [0.0, 1.0]]);
        draft.primitive()["attributes"]["TEXCOORD_0"] = accessor.into();
        draft.json["images"] = json!([{"uri": two_pixels()}]);
        draft.json["textures"] = json!([{"source": 0}]);
        draft.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": 0});
        draft.json["nodes"][0]["scale"] = json!([1, -2, 1]);
        let mut bytes = if binary { draft.binary() } else { draft.text() };
        let at = (place * bytes.len() as f64) as usize;
        bytes[at] = byte;
        survives(&bytes);
        bytes.truncate((cut * bytes.len() as f64) as usize);
        survives(&bytes);
    }

    /// Any number of the JSON replaced by another.
    #[test]
    fn numbers_that_lie_are_refused_or_read(
        which in 0_usize..100,
        value in prop::sample::select(vec![
            json!(-1), json!(0), json!(1), json!(3), json!(255), json!(4_294_967_295_u64), json!(1e300), json!("x"), json!([]),
            json!(null), json!(5121), json!(u64::MAX),
        ]),
    ) {
        let mut draft = square();
        let mut left = which;
        replace(&mut draft.json, &mut left, &value);
        survives(&draft.text());
    }
}

/// Replace the number that `left` numbers stand before.
fn replace(json: &mut Value, left: &mut usize, value: &Value) -> bool {
    match json {
        Value::Number(_) if *left == 0 => {
            *json = value.clone();
            true
        }
        Value::Number(_) => {
            *left -= 1;
            false
        }
        Value::Array(list) => list.iter_mut().any(|item| replace(item, left, value)),
        Value::Object(object) => object.values_mut().any(|item| replace(item, left, value)),
        _ => false,
    }
}
