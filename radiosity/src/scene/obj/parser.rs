//! The statements of an OBJ file, and the surfaces they make.

use std::collections::HashMap;

use glam::DVec3;

use super::material::{self, Materials, default_material, warning};
use super::words::{Statement, Statements, Word};
use crate::geometry::polygon;
use crate::scene::mesh_builder::MeshBuilder;
use crate::scene::source::{Source, Spot};
use crate::scene::{BackFaces, Place, Scene, SceneError, Shape, Surface, Warning, number};

/// More corners than this a face has not; cutting it takes time in their square.
const MOST_CORNERS: usize = 2000;

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
    /// Vertices of faces, from 0.
    corners: Vec<u32>,
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
            "vt" | "vn" | "vp" | "s" | "bevel" | "c_interp" | "d_interp" | "lod" | "shadow_obj" | "trace_obj" => {}
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
    said.into_scene(name, &statements)
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
            // `v/vt/vn`: the vertex is all that counts.
            let (index, _) = word.text.split_once('/').unwrap_or((word.text, ""));
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
                Ok(corner) => self.corners.push(corner),
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
                statement.rest,
                default_material().diffuse.r
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

    fn into_scene(mut self, name: &str, statements: &Statements<'_>) -> Result<Scene, SceneError> {
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
        let mut crossing = None;
        for part in &self.parts {
            let known = part.material.as_ref().map(|name| self.materials.get(name));
            // Of a file that is missing altogether a warning is there already.
            if known.is_none_or(|known| known.is_none() && (!self.library || !self.materials.is_empty())) {
                unknown.push(part);
            }
            let mut builder = MeshBuilder::default();
            for face in &part.faces {
                if !self.cut(face, statements, &mut builder)? {
                    crossing.get_or_insert(face.start);
                }
            }
            let (mesh, material) = builder.finish(known.flatten().copied().unwrap_or_else(default_material));
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
                default_material().diffuse.r,
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

    /// Cut a face into triangles of `builder`; whether it is a simple polygon.
    fn cut(
        &self,
        face: &Face,
        statements: &Statements<'_>,
        builder: &mut MeshBuilder,
    ) -> Result<bool, SceneError> {
        let mut corners: Vec<DVec3> = Vec::with_capacity(face.count as usize);
        for (k, &corner) in self.corners[face.first..][..face.count as usize].iter().enumerate() {
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
            }
        }
        if corners.len() > 1 && corners.first() == corners.last() {
            corners.pop();
        }
        match corners.len() {
            ..3 => builder.leave_out(),
            3 => {
                builder.triangle([corners[0], corners[1], corners[2]]);
            }
            _ => {
                if let Some(triangles) = polygon::triangulate(&corners) {
                    for triangle in triangles {
                        builder.triangle(triangle.map(|k| corners[k as usize]));
                    }
                } else {
                    for pair in corners[1..].windows(2) {
                        builder.triangle([corners[0], pair[0], pair[1]]);
                    }
                    return Ok(false);
                }
            }
        }
        Ok(true)
    }
}
