//! The statements of an OBJ file, and the surfaces they make.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec3;

use super::material::{self, Map, Materials, Told, warning};
use super::words::{Statement, Statements, Word};
use crate::geometry::polygon;
use crate::light::Rgb;
use crate::scene::image::ImageMemory;
use crate::scene::mesh_builder::{DEFAULT_REFLECTANCE, MeshBuilder};
use crate::scene::source::{Source, Spot};
use crate::scene::{
    BackFaces, Paint, Place, Scene, SceneError, Shape, Surface, Texture, TextureOn, Warning, number,
};

/// More corners than this a face has not; cutting it takes time in their square.
const MOST_CORNERS: usize = 2000;

/// The texture coordinate of a corner that has none.
const NONE: u32 = u32::MAX;

/// Gives the name and bytes of a file, or what is wrong with it; `None` where there is none.
type Files<'f> = dyn FnMut(&str) -> Option<Result<(String, Vec<u8>), SceneError>> + 'f;

/// Faces of one group and one material.
struct Part {
    group: String,
    material: Option<String>,
    line: u32,
    faces: Vec<Face>,
}

/// Corners `first .. first + count` of the list of all.
#[derive(Clone, Copy)]
struct Face {
    first: usize,
    count: u32,
    /// Where in the text its keyword stands.
    start: usize,
}

/// All that the statements say.
#[derive(Default)]
struct Said {
    vertices: Vec<DVec3>,
    /// Texture coordinates.
    coordinates: Vec<[f32; 2]>,
    /// Vertices of faces, from 0, and their texture coordinates, [`NONE`] where they have none.
    corners: Vec<[u32; 2]>,
    parts: Vec<Part>,
    /// A part by its group and material.
    places: HashMap<(String, Option<String>), usize>,
    materials: Materials,
    /// Whether any material file was read, or is missing.
    library: bool,
    warnings: Vec<Warning>,
    /// The first place of each kind of statement that is left out, and their number.
    left_out: Vec<(&'static str, Place, usize)>,
}

pub(super) fn parse(
    name: &str,
    bytes: &[u8],
    mut library: impl FnMut(&str) -> Option<Result<(String, Vec<u8>), SceneError>>,
) -> Result<Scene, SceneError> {
    let source = Source::new(name, bytes)?;
    let mut statements = Statements::new(&source);
    let mut said = Said::default();
    let (mut object, mut group, mut used) = (String::new(), String::new(), None);
    let mut part = None;
    let mut statement = Statement::default();
    while statements.next(&mut statement) {
        let keyword = statement.words[0];
        match keyword.text {
            "v" => said.vertices.push(DVec3::from(statements.numbers::<3>(&statement)?)),
            "f" | "fo" => {
                let at = *part.get_or_insert_with(|| {
                    let group = if group.is_empty() { &object } else { &group };
                    said.part(group, &used, statement.line)
                });
                said.face(&statements, &statement, at)?;
            }
            "o" => {
                (object, group) = (statement.rest.to_owned(), String::new());
                part = None;
            }
            "g" => {
                group = statement.rest.to_owned();
                part = None;
            }
            "usemtl" => {
                used = Some(statement.rest.to_owned()).filter(|name| !name.is_empty());
                part = None;
            }
            "mtllib" => said.read_library(name, &statements, &statement, &mut library)?,
            "vt" => {
                // v is nought where it is not told.
                let numbers = statement.words.len() - 1;
                let at = match numbers {
                    0 | 1 => [statements.numbers::<1>(&statement)?[0], 0.0],
                    _ => statements.numbers::<2>(&statement)?,
                };
                said.coordinates.push(at.map(|x| x as f32));
            }
            "vn" | "vp" | "s" | "bevel" | "c_interp" | "d_interp" | "lod" | "shadow_obj" | "trace_obj" => {}
            "l" | "p" => said.leave_out("a line or point, which has no area, is left out", &statements, keyword),
            "curv" | "curv2" | "surf" | "cstype" | "deg" | "bmat" | "step" | "parm" | "trim" | "hole" | "scrv"
            | "sp" | "end" | "con" => said.leave_out(
                "free-form curves and surfaces are left out: let the program that wrote them make polygons of them",
                &statements,
                keyword,
            ),
            _ => said.leave_out("this is no statement of OBJ, and left out", &statements, keyword),
        }
    }
    said.into_scene(name, &statements, &mut library)
}

/// Images by their names, each decoded when it is first wanted; with each whether it had to be made coarser.
#[derive(Default)]
struct Images {
    kept: HashMap<String, Result<(Arc<Texture>, bool), String>>,
    memory: ImageMemory,
}

impl Images {
    fn get(&mut self, name: &str, files: &mut Files<'_>) -> Result<(Arc<Texture>, bool), String> {
        if let Some(there) = self.kept.get(name) {
            return there.clone();
        }
        let read = match files(name) {
            Some(Ok((_, bytes))) => self.memory.decode(&bytes),
            Some(Err(error)) => Err(error.to_string()),
            None => Err("there is no such file: put it beside the .obj".to_owned()),
        };
        let image = read.map(|(texture, coarser)| (Arc::new(texture), coarser));
        self.kept.insert(name.to_owned(), image.clone());
        image
    }
}

impl Said {
    /// The part of this group and material.
    fn part(&mut self, group: &str, material: &Option<String>, line: u32) -> usize {
        *self.places.entry((group.to_owned(), material.clone())).or_insert_with(|| {
            self.parts.push(Part {
                group: group.to_owned(),
                material: material.clone(),
                line,
                faces: Vec::new(),
            });
            self.parts.len() - 1
        })
    }

    fn leave_out(&mut self, what: &'static str, statements: &Statements<'_>, keyword: Word<'_>) {
        match self.left_out.iter_mut().find(|(other, ..)| *other == what) {
            Some((_, _, times)) => *times += 1,
            None => self.left_out.push((what, statements.place(keyword), 1)),
        }
    }

    /// Take in `f`, whose vertices may still come.
    fn face(
        &mut self,
        statements: &Statements<'_>,
        statement: &Statement<'_>,
        part: usize,
    ) -> Result<(), SceneError> {
        let [keyword, words @ ..] = &statement.words[..] else { return Ok(()) };
        if words.len() > MOST_CORNERS {
            let message = format!("this face has {} corners: at most {MOST_CORNERS} are read", words.len());
            return Err(statements.error(*keyword, message, "cut it into smaller ones"));
        }
        let first = self.corners.len();
        for word in words {
            // `v/vt/vn`: the normal plays no part.
            let (index, others) = word.text.split_once('/').unwrap_or((word.text, ""));
            let coordinate = self.coordinate(others.split_once('/').map_or(others, |(index, _)| index));
            let fault = |message: String, help: &str| {
                Err(statements.error(Word { text: index, start: word.start }, message, help))
            };
            let corner = match number::whole(index) {
                Ok(0) => {
                    return fault(
                        "there is no vertex 0: OBJ counts from 1".into(),
                        "count from 1, or from -1 back",
                    );
                }
                Ok(from_end @ ..0) => self.vertices.len() as i64 + from_end,
                Ok(index) => index - 1,
                Err(bad) => return fault(bad.message, &bad.help),
            };
            match u32::try_from(corner) {
                Ok(corner) => self.corners.push([corner, coordinate]),
                Err(_) if corner < 0 => {
                    let count = self.vertices.len();
                    let message = format!("there is no vertex {index}: {count} stand before this line");
                    return fault(message, "negative indices count back from the last vertex so far");
                }
                Err(_) => return fault(format!("there is no vertex {index}"), "count from 1"),
            }
        }
        let count = words.len() as u32;
        self.parts[part].faces.push(Face { first, count, start: keyword.start });
        Ok(())
    }

    /// The texture coordinate that an index means, or none: who has no texture needs none.
    fn coordinate(&self, index: &str) -> u32 {
        let coordinate = match number::whole(index) {
            Ok(from_end @ ..0) => self.coordinates.len() as i64 + from_end,
            Ok(index) => index - 1,
            Err(_) => -1,
        };
        u32::try_from(coordinate).unwrap_or(NONE)
    }

    fn read_library(
        &mut self,
        file: &str,
        statements: &Statements<'_>,
        statement: &Statement<'_>,
        library: &mut impl FnMut(&str) -> Option<Result<(String, Vec<u8>), SceneError>>,
    ) -> Result<(), SceneError> {
        self.library = true;
        let names: Vec<&str> = statement.words[1..].iter().map(|word| word.text).collect();
        // One name, which may have spaces in it, or several.
        let found = library(statement.rest).map(|found| vec![found]);
        let found = found.or_else(|| names.iter().map(|name| library(name)).collect());
        let Some(found) = found.filter(|_| !names.is_empty()) else {
            let message = format!(
                "there is no material file {}: its materials are taken as grey, reflecting {}; put it beside the .obj",
                statement.rest, DEFAULT_REFLECTANCE.r
            );
            self.warnings.push(warning(file, statements.place(statement.words[0]), message));
            return Ok(());
        };
        for found in found {
            let (name, bytes) = found?;
            material::parse(&name, &bytes, &mut self.materials, &mut self.warnings)?;
        }
        Ok(())
    }

    fn into_scene(
        mut self,
        name: &str,
        statements: &Statements<'_>,
        files: &mut Files<'_>,
    ) -> Result<Scene, SceneError> {
        if self.parts.is_empty() {
            return Err(statements.source.error(
                Spot::START,
                "the file holds no face, so there is nothing to light",
                "an OBJ file lists vertices as `v x y z` and faces as `f 1 2 3`",
            ));
        }
        let mut several: HashMap<&str, usize> = HashMap::new();
        for part in &self.parts {
            *several.entry(&part.group).or_default() += 1;
        }
        let mut surfaces = Vec::with_capacity(self.parts.len());
        let mut unknown = Vec::new();
        let (mut crossing, mut images) = (None, Images::default());
        for part in &self.parts {
            let known = part.material.as_ref().map(|name| self.materials.get(name));
            // Of a file that is missing altogether a warning is there already.
            if known.is_none_or(|known| known.is_none() && (!self.library || !self.materials.is_empty())) {
                unknown.push(part);
            }
            let mut builder = MeshBuilder::default();
            // Of each triangle that has them at all corners.
            let mut coordinates = Vec::new();
            for face in &part.faces {
                if !self.cut(face, statements, &mut builder, &mut coordinates)? {
                    crossing.get_or_insert(face.start);
                }
            }
            let told = known.flatten().cloned().unwrap_or_default();
            let [diffuse, emission] = paints(&told, builder.count(), coordinates, |map| {
                texture(map, &mut images, files, &mut self.warnings)
            });
            builder.paint(diffuse, emission);
            let (mesh, material) = builder.finish(told.material());
            if mesh.triangles.is_empty() {
                continue;
            }
            let shared = several.get(part.group.as_str()).is_some_and(|&parts| parts > 1);
            let named = match (&part.material, part.group.is_empty(), shared) {
                (Some(material), true, _) => material.clone(),
                (Some(material), false, true) => format!("{}: {material}", part.group),
                _ => part.group.clone(),
            };
            let place = Place { line: part.line, column: 1 };
            surfaces.push(Surface { name: named, shape: Shape::Mesh(mesh), material, place });
        }
        if surfaces.is_empty() {
            return Err(statements.source.error(
                Spot::START,
                "no face of the file has an area, so there is nothing to light",
                "check the scale and the vertices that the program wrote",
            ));
        }
        if let Some(part) = unknown.first() {
            let what = match &part.material {
                Some(material) => format!("the material {material} is in no material file"),
                None => "no material is told for these faces".to_owned(),
            };
            let message = format!(
                "{what}: a grey that reflects {} is taken{}",
                DEFAULT_REFLECTANCE.r,
                match unknown.len() {
                    1 => String::new(),
                    surfaces => format!(", for {surfaces} surfaces in all"),
                }
            );
            self.warnings.push(warning(name, Place { line: part.line, column: 1 }, message));
        }
        if let Some(start) = crossing {
            let message = "a face crosses or touches itself: it is cut into triangles about its first corner";
            let place = statements.place(Word { text: "f", start });
            self.warnings.push(warning(name, place, message.into()));
        }
        for (what, place, times) in self.left_out {
            let more = if times > 1 { format!(" ({times} lines)") } else { String::new() };
            self.warnings.push(warning(name, place, format!("{what}{more}")));
        }
        Ok(Scene {
            name: name.to_owned(),
            surfaces,
            camera: None,
            back_faces: BackFaces::Black,
            warnings: self.warnings,
        })
    }

    /// Cut a face into triangles of `builder`; whether it is a simple polygon. Texture coordinates of the triangles that have
    /// them go to `coordinates`.
    fn cut(
        &self,
        face: &Face,
        statements: &Statements<'_>,
        builder: &mut MeshBuilder,
        coordinates: &mut Vec<[[f32; 2]; 3]>,
    ) -> Result<bool, SceneError> {
        let mut corners: Vec<DVec3> = Vec::with_capacity(face.count as usize);
        let mut on_texture: Vec<Option<[f32; 2]>> = Vec::with_capacity(face.count as usize);
        for (k, &[corner, coordinate]) in self.corners[face.first..][..face.count as usize].iter().enumerate()
        {
            let Some(&position) = self.vertices.get(corner as usize) else {
                let message = format!(
                    "there is no vertex {}: the file has {}",
                    u64::from(corner) + 1,
                    self.vertices.len()
                );
                let help = "check the index, and that the file is whole";
                return Err(statements.error(statements.word_after(face.start, k + 1), message, help));
            };
            // A corner that is written twice in a row is one.
            if corners.last() != Some(&position) {
                corners.push(position);
                on_texture.push(self.coordinates.get(coordinate as usize).copied());
            }
        }
        if corners.len() > 1 && corners.first() == corners.last() {
            corners.pop();
        }
        let mut add = |triangle: [usize; 3]| {
            if builder.triangle(triangle.map(|k| corners[k]))
                && let [Some(a), Some(b), Some(c)] = triangle.map(|k| on_texture[k])
            {
                coordinates.push([a, b, c]);
            }
        };
        match corners.len() {
            ..3 => builder.leave_out(),
            3 => add([0, 1, 2]),
            count => {
                if let Some(triangles) = polygon::triangulate(&corners) {
                    triangles.into_iter().for_each(|triangle| add(triangle.map(|k| k as usize)));
                } else {
                    (1..count - 1).for_each(|k| add([0, k, k + 1]));
                    return Ok(false);
                }
            }
        }
        Ok(true)
    }
}

/// What varies over the triangles of a surface: its reflectance and its emission, where there are textures. They are
/// `coordinates.len()` with coordinates of `triangles` in all.
fn paints(
    told: &Told,
    triangles: usize,
    coordinates: Vec<[[f32; 2]; 3]>,
    mut texture: impl FnMut(Result<&Map, (&Map, &str)>) -> Option<Arc<Texture>>,
) -> [Option<Paint>; 2] {
    let Told { diffuse, emission, diffuse_map, emission_map } = told;
    [(diffuse_map, diffuse), (emission_map, emission)].map(|(map, factor)| {
        // A texture alone tells all.
        let (map, factor) = (map.as_ref()?, factor.unwrap_or(Rgb::WHITE));
        let wanted = if factor.is_black() {
            Err((map, "it is multiplied by a colour that is black"))
        } else if coordinates.len() < triangles {
            Err((map, "there are faces without texture coordinates"))
        } else {
            Ok(map)
        };
        let texture = TextureOn {
            texture: texture(wanted)?,
            wrap: [map.wrap; 2],
            transform: map.transform,
            coordinates: coordinates.clone(),
        };
        Some(Paint { factor, texture: Some(texture), colours: Vec::new() })
    })
}

/// The texture of a map, or a warning that says why it is left out.
fn texture(
    map: Result<&Map, (&Map, &str)>,
    images: &mut Images,
    files: &mut Files<'_>,
    warnings: &mut Vec<Warning>,
) -> Option<Arc<Texture>> {
    let (map, found) = match map {
        Ok(map) => (map, images.get(&map.image, files)),
        Err((map, why)) => (map, Err(why.to_owned())),
    };
    let (texture, message) = match found {
        Ok((texture, false)) => return Some(texture),
        Ok((texture, true)) => {
            let [width, height] = texture.size();
            let message = format!(
                "the images of the scene take more memory than is kept for them, 2 GiB: {} is taken as {width} x {height} \
                 pixels; make them smaller",
                map.image
            );
            (Some(texture), message)
        }
        Err(why) => (None, format!("the texture {} is left out: {why}", map.image)),
    };
    let told = warning(&map.file, map.place, message);
    if !warnings.contains(&told) {
        warnings.push(told);
    }
    texture
}
