//! glTF 2.0 with the light in it: a scene to walk about in any viewer, unlit, with vertex colours or a light map.
//!
//! \[G2\] Khronos Group, glTF 2.0 Specification, 2021. KHR_materials_unlit: github.com/KhronosGroup/glTF.

use std::collections::HashMap;
use std::io::{self, Write};
use std::path::Path;

use base64::prelude::BASE64_STANDARD;
use base64::write::EncoderWriter;
use glam::{DMat3, DQuat, DVec3};
use serde_json::{Value, json};

use super::{ExportError, png, whole_file};
use crate::light::Rgb;
use crate::patches::Patches;
use crate::scene::gltf::{SOLUTION_KEY, SolvedMaterial, SolvedMesh};
use crate::scene::{BackFaces, Camera, Scene, Shape};
use crate::shade::{Atlas, ScreenPicture, ShadedSurfaces, Shading, ToneMap};
use crate::solve::Solution;
use crate::visibility::{Cells, Facet, FacetShape, Facets};

/// The two shapes of a glTF file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GltfForm {
    /// `.glb`: JSON and numbers in one binary file.
    Binary,
    /// `.gltf`: JSON, with the numbers in it as a `data:` URI; no file stands beside.
    Text,
}

/// A solved scene, as it is written and as it is to be seen.
#[derive(Clone, Copy, Debug)]
pub struct SolvedScene<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its patches.
    pub patches: &'a Patches,
    /// Its facets.
    pub facets: &'a Facets,
    /// The light.
    pub solution: &'a Solution,
    /// Where it is looked at from; a window that is not centred is written with the centred one around it.
    pub camera: &'a Camera,
    /// Exposure and tone curve of the colours that are shown.
    pub tone: ToneMap,
    /// What a surface is from behind.
    pub back_faces: BackFaces,
    /// What is seen on the surfaces; `None` for vertex colours.
    pub light_map: Option<LightMap<'a>>,
}

/// A light map and where the facets lie in it.
#[derive(Clone, Copy, Debug)]
pub struct LightMap<'a> {
    /// Where they lie.
    pub atlas: &'a Atlas,
    /// What a screen shows there: [`Atlas::screen_light_map`].
    pub picture: &'a ScreenPicture,
}

/// Write a solved scene as glTF 2.0. Each surface is a node with a mesh of its own, called as the surface; the camera
/// is another.
///
/// Without a light map a vertex has `COLOR_0`, what the screen shows there: the smooth shading's value after exposure and tone curve,
/// linear, in 0..1 (materials are KHR_materials_unlit, and viewers encode to sRGB alone); and `_RADIOSITY`, the light
/// itself, linear, in the scene's unit. Vertices of a grid of patches stand at the patches' centres and along the
/// border, so that every patch's radiosity is there as it was solved; triangles share no vertices, and each has its
/// own. Numbers are float32, as the standard has them.
///
/// With one the vertices are the facets' corners, and all materials have one texture, a PNG within the file, with what the
/// screen shows, in sRGB. Its coordinates are `TEXCOORD_1`; `TEXCOORD_0` are the same numbers, for the standard wants both,
/// a scene has no others, and there are viewers that know only one set.
///
/// Reflectances, emissions and parallelograms stand in `extras`, and where they differ from triangle to triangle as
/// `_REFLECTANCE` and `_EMISSION`: [`crate::scene::gltf`] reads the scene back from them, and its parallelograms to
/// the bit.
///
/// # Errors
/// [`ExportError`]; a .glb cannot be larger than 4 GiB.
///
/// # Panics
/// Where the patches, the facets and the solution are not of the same scene.
pub fn write_gltf(path: &Path, solved: &SolvedScene<'_>, form: GltfForm) -> Result<(), ExportError> {
    whole_file(path, |writer| {
        let (document, bytes) = document(solved)?;
        write(writer, document, &bytes, form)
    })
}

fn write(writer: &mut impl Write, mut document: Value, bytes: &[u8], form: GltfForm) -> io::Result<()> {
    match form {
        GltfForm::Binary => {
            document["buffers"] = json!([{"byteLength": bytes.len()}]);
            let mut text = serde_json::to_vec(&document)?;
            text.resize(text.len().next_multiple_of(4), b' ');
            let word = |length: usize| {
                let too_large =
                    "the scene makes more than the 4 GiB that a .glb can hold: write a .csv or .npz";
                u32::try_from(length).map(u32::to_le_bytes).map_err(|_| io::Error::other(too_large))
            };
            // Every buffer view is a whole number of words, and so is the buffer.
            writer.write_all(b"glTF")?;
            writer.write_all(&word(2)?)?;
            writer.write_all(&word(12 + 8 + text.len() + 8 + bytes.len())?)?;
            writer.write_all(&word(text.len())?)?;
            writer.write_all(b"JSON")?;
            writer.write_all(&text)?;
            writer.write_all(&word(bytes.len())?)?;
            writer.write_all(b"BIN\0")?;
            writer.write_all(bytes)
        }
        GltfForm::Text => {
            // The JSON with a mark for the numbers, which are encoded on the way out.
            const MARK: &str = "@numbers@";
            document["buffers"] = json!([{"byteLength": bytes.len(), "uri": MARK}]);
            let text = serde_json::to_string(&document)?;
            let quoted = format!("\"uri\":\"{MARK}\"");
            let (before, after) = text.split_once(&quoted).ok_or_else(|| io::Error::other("no buffer"))?;
            write!(writer, "{before}\"uri\":\"data:application/octet-stream;base64,")?;
            let mut encoder = EncoderWriter::new(&mut *writer, &BASE64_STANDARD);
            encoder.write_all(bytes)?;
            encoder.finish()?;
            drop(encoder);
            writeln!(writer, "\"{after}")
        }
    }
}

/// The document, without its buffer, and the buffer's bytes.
fn document(solved: &SolvedScene<'_>) -> io::Result<(Value, Vec<u8>)> {
    let &SolvedScene { scene, patches, facets, solution, camera, tone, back_faces, light_map } = solved;
    let light = &solution.radiosity;
    let shaded = ShadedSurfaces::new(scene, patches, facets, light, Shading::Smooth);
    let mut numbers = Numbers::default();
    let mut materials = Materials::default();
    let (mut nodes, mut meshes) = (Vec::new(), Vec::new());
    for (index, surface) in scene.surfaces.iter().enumerate() {
        let name = match surface.name.as_str() {
            "" => format!("surface {index}"),
            name => name.to_owned(),
        };
        let mut drawn = Drawn::default();
        for number in facets.of_surface(index as u32) {
            match light_map {
                None => drawn.patches(&facets[number], number),
                Some(_) => drawn.corners(&facets[number], number),
            }
        }
        if drawn.triangles.is_empty() {
            continue;
        }
        let vertices = &drawn.vertices;
        let mut attributes =
            json!({"POSITION": numbers.positions(vertices.iter().map(|vertex| vertex.position))});
        match light_map {
            None => {
                let shown = |vertex: &Vertex| shaded.at(vertex.facet, vertex.uv.0, vertex.uv.1);
                let colours = vertices.iter().map(|vertex| tone.apply(single(shown(vertex))));
                attributes["COLOR_0"] = numbers.vectors(colours).into();
                let radiosity = vertices.iter().map(|vertex| match facets[vertex.facet].cells {
                    Cells::Grid { .. } => single(shown(vertex)),
                    Cells::One(patch) => single(light[patch as usize]),
                });
                attributes["_RADIOSITY"] = numbers.vectors(radiosity).into();
            }
            Some(LightMap { atlas, .. }) => {
                let coordinates = vertices.iter().map(|vertex| {
                    atlas.coordinates(vertex.facet, vertex.uv.0, vertex.uv.1).map(|x| x as f32)
                });
                let coordinates = numbers.vectors(coordinates);
                attributes["TEXCOORD_0"] = coordinates.into();
                attributes["TEXCOORD_1"] = coordinates.into();
            }
        }
        let block = patches.blocks[index].patches();
        for (name, column, all) in [
            ("_REFLECTANCE", &patches.reflectance, surface.material.diffuse),
            ("_EMISSION", &patches.emission, surface.material.emission),
        ] {
            if column[block.clone()].iter().any(|&own| own != all) {
                let of_vertex = |vertex: &Vertex| {
                    let patch = facets[vertex.facet].patch_at(vertex.uv.0, vertex.uv.1);
                    single(column[patch as usize])
                };
                attributes[name] = numbers.vectors(vertices.iter().map(of_vertex)).into();
            }
        }
        let material =
            SolvedMaterial { reflectance: surface.material.diffuse, emission: surface.material.emission };
        let mut mesh = json!({
            "name": &name,
            "primitives": [{
                "attributes": attributes,
                "indices": numbers.indices(&drawn.triangles, vertices.len()),
                "material": materials.number(material),
            }],
        });
        if let Shape::Parallelogram(parallelogram) = surface.shape {
            mesh["extras"] = SolvedMesh(parallelogram).to_json();
        }
        nodes.push(json!({"name": name, "mesh": meshes.len()}));
        meshes.push(mesh);
    }
    let (lens, node) = self::camera(camera, facets.extent());
    nodes.push(node);
    let materials = materials.documents(back_faces, light_map.is_some());
    let mut document = json!({
        "asset": {
            "version": "2.0",
            "generator": concat!("radiosity ", env!("CARGO_PKG_VERSION")),
            "extras": {SOLUTION_KEY: {
                "backFaces": if back_faces == BackFaces::Lit { "lit" } else { "black" },
                "exposure": tone.exposure,
                "toneCurve": tone.curve.name(),
            }},
        },
        "extensionsUsed": ["KHR_materials_unlit"],
        "scene": 0,
        "scenes": [{"nodes": (0..nodes.len()).collect::<Vec<_>>()}],
        "nodes": nodes,
        "meshes": meshes,
        "cameras": [lens],
        "materials": materials,
    });
    if let Some(LightMap { picture, .. }) = light_map {
        let view = numbers.png(picture)?;
        document["images"] = json!([{"name": "light map", "mimeType": "image/png", "bufferView": view}]);
        // No smaller copies: in those, charts would run into each other.
        document["samplers"] = json!([{
            "magFilter": LINEAR, "minFilter": LINEAR, "wrapS": CLAMP_TO_EDGE, "wrapT": CLAMP_TO_EDGE,
        }]);
        document["textures"] = json!([{"name": "light map", "sampler": 0, "source": 0}]);
    }
    document["accessors"] = numbers.accessors.into();
    document["bufferViews"] = numbers.views.into();
    Ok((document, numbers.bytes))
}

/// A camera, and the node that carries it.
fn camera(camera: &Camera, extent: f64) -> (Value, Value) {
    // The least centred window that holds the whole of the camera's own.
    let half = |[from, to]: [f64; 2]| from.abs().max(to.abs());
    let (across, upward) = (half(camera.horizontal), half(camera.vertical));
    // The standard wants a near plane before the eye.
    let near = camera.near.max(1e-4 * extent).max(f64::from(f32::MIN_POSITIVE));
    let mut lens = json!({
        "type": "perspective",
        "perspective": {"yfov": 2.0 * upward.atan(), "aspectRatio": across / upward, "znear": near},
    });
    if camera.far.is_finite() && camera.far > near {
        lens["perspective"]["zfar"] = camera.far.into();
    }
    let turn = DQuat::from_mat3(&DMat3::from_cols(camera.right, camera.up, -camera.forward)).normalize();
    let node = json!({
        "name": "camera",
        "camera": 0,
        "translation": camera.eye.to_array(),
        "rotation": turn.to_array(),
    });
    (lens, node)
}

/// A corner of a triangle.
struct Vertex {
    position: DVec3,
    facet: u32,
    /// Where on the facet.
    uv: (f64, f64),
}

/// A surface in triangles.
#[derive(Default)]
struct Drawn {
    vertices: Vec<Vertex>,
    triangles: Vec<[u32; 3]>,
}

impl Drawn {
    /// Add a facet with vertices enough for the light of each of its patches.
    fn patches(&mut self, facet: &Facet, number: u32) {
        match facet.cells {
            Cells::Grid { columns, rows, .. } => self.grid(facet, number, &lines(columns), &lines(rows)),
            Cells::One(_) => self.corners(facet, number),
        }
    }

    /// Add a facet with its corners.
    fn corners(&mut self, facet: &Facet, number: u32) {
        match facet.shape {
            FacetShape::Parallelogram => self.grid(facet, number, &[0.0, 1.0], &[0.0, 1.0]),
            FacetShape::Triangle => {
                let first = self.vertices.len() as u32;
                let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)];
                self.vertices.extend(corners.map(|uv| Vertex::new(facet, number, uv)));
                self.triangle(facet, [first, first + 1, first + 2]);
            }
        }
    }

    /// Add a facet with vertices at these u and v.
    fn grid(&mut self, facet: &Facet, number: u32, across: &[f64], upward: &[f64]) {
        let first = self.vertices.len() as u32;
        for &v in upward {
            self.vertices.extend(across.iter().map(|&u| Vertex::new(facet, number, (u, v))));
        }
        let width = across.len() as u32;
        for row in 0..upward.len() as u32 - 1 {
            for column in 0..width - 1 {
                let a = first + row * width + column;
                let (b, c, d) = (a + 1, a + width + 1, a + width);
                self.triangle(facet, [a, b, c]);
                self.triangle(facet, [a, c, d]);
            }
        }
    }

    /// Add a triangle that runs counter-clockwise about the facet's u x v.
    fn triangle(&mut self, facet: &Facet, [a, b, c]: [u32; 3]) {
        let turned = facet.u.cross(facet.v).dot(facet.normal) < 0.0;
        self.triangles.push(if turned { [a, c, b] } else { [a, b, c] });
    }
}

impl Vertex {
    fn new(facet: &Facet, number: u32, uv: (f64, f64)) -> Self {
        Self { position: facet.origin + facet.u * uv.0 + facet.v * uv.1, facet: number, uv }
    }
}

/// Where a grid's vertices stand along one side, 0..1: at the border and at the centres of its cells, between which
/// smooth shading is linear. Of one cell both borders say all.
fn lines(cells: u32) -> Vec<f64> {
    let centres = (0..cells).map(|cell| (f64::from(cell) + 0.5) / f64::from(cells));
    let centres = centres.take(if cells > 1 { cells as usize } else { 0 });
    std::iter::once(0.0).chain(centres).chain([1.0]).collect()
}

fn single(colour: Rgb) -> [f32; 3] {
    colour.to_array().map(|channel| channel as f32)
}

/// Materials, each once.
#[derive(Default)]
struct Materials {
    numbers: HashMap<[u64; 6], usize>,
    all: Vec<SolvedMaterial>,
}

impl Materials {
    fn number(&mut self, material: SolvedMaterial) -> usize {
        let [a, b, c] = material.reflectance.to_array().map(f64::to_bits);
        let [d, e, f] = material.emission.to_array().map(f64::to_bits);
        *self.numbers.entry([a, b, c, d, e, f]).or_insert_with(|| {
            self.all.push(material);
            self.all.len() - 1
        })
    }

    fn documents(self, back_faces: BackFaces, light_map: bool) -> Vec<Value> {
        let document = |(index, material): (usize, SolvedMaterial)| {
            let mut document = json!({
                "name": format!("{} {index}", if material.emission.is_black() { "matt" } else { "lamp" }),
                "doubleSided": back_faces == BackFaces::Lit,
                "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 1.0},
                "extensions": {"KHR_materials_unlit": {}},
                "extras": material.to_json(),
            });
            if light_map {
                document["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": 0, "texCoord": 1});
            }
            document
        };
        self.all.into_iter().enumerate().map(document).collect()
    }
}

/// The buffer as it grows, with the views and accessors on it.
#[derive(Default)]
struct Numbers {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

/// Targets and types of components \[G2, 5.11, 5.1\].
const VERTICES: u32 = 34_962;
const INDICES: u32 = 34_963;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;
/// Filtering and wrapping of textures \[G2, 5.26\].
const LINEAR: u32 = 9729;
const CLAMP_TO_EDGE: u32 = 33_071;

impl Numbers {
    /// A view of what was added since `start`, whose number it gives.
    fn view(&mut self, start: usize) -> usize {
        let length = self.bytes.len() - start;
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(json!({"buffer": 0, "byteOffset": start, "byteLength": length}));
        self.views.len() - 1
    }

    /// The same for vertices or indices, and an accessor on it, whose number it gives.
    fn accessor(&mut self, start: usize, target: u32, mut accessor: Value) -> usize {
        let view = self.view(start);
        self.views[view]["target"] = target.into();
        accessor["bufferView"] = view.into();
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// An image, whose view it gives.
    fn png(&mut self, picture: &ScreenPicture) -> io::Result<usize> {
        let start = self.bytes.len();
        png::encode(&mut self.bytes, picture)?;
        Ok(self.view(start))
    }

    fn vectors<const N: usize>(&mut self, vectors: impl ExactSizeIterator<Item = [f32; N]>) -> usize {
        let (start, count) = (self.bytes.len(), vectors.len());
        self.bytes.extend(vectors.flatten().flat_map(f32::to_le_bytes));
        let accessor = json!({"componentType": FLOAT, "count": count, "type": format!("VEC{N}")});
        self.accessor(start, VERTICES, accessor)
    }

    /// The same, with their bounds, which the standard wants of positions.
    fn positions(&mut self, positions: impl ExactSizeIterator<Item = DVec3>) -> usize {
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        let positions = positions.map(|position| {
            let position = position.to_array().map(|x| x as f32);
            low = std::array::from_fn(|k| low[k].min(position[k]));
            high = std::array::from_fn(|k| high[k].max(position[k]));
            position
        });
        let accessor = self.vectors(positions);
        self.accessors[accessor]["min"] = json!(low);
        self.accessors[accessor]["max"] = json!(high);
        accessor
    }

    /// Indices, in the fewest bytes that hold them.
    fn indices(&mut self, triangles: &[[u32; 3]], vertices: usize) -> usize {
        let start = self.bytes.len();
        let all = triangles.as_flattened();
        // 65,535 itself means a break in the strip.
        let component = if vertices <= usize::from(u16::MAX) {
            self.bytes.extend(all.iter().flat_map(|&index| (index as u16).to_le_bytes()));
            UNSIGNED_SHORT
        } else {
            self.bytes.extend(all.iter().flat_map(|index| index.to_le_bytes()));
            UNSIGNED_INT
        };
        let accessor = json!({"componentType": component, "count": all.len(), "type": "SCALAR"});
        self.accessor(start, INDICES, accessor)
    }
}
