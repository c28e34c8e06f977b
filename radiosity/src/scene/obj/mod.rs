//! Wavefront's OBJ, with materials from MTL.
//!
//! # What is read
//! `v`, `f` (polygons of any number of corners, `/` and all; indices from 1, negative ones from the end), `o`, `g`,
//! `usemtl`, `mtllib`; of materials `newmtl`, `Kd` (the diffuse reflectance) and `Ke` (the emitted exitance, a power
//! per area in the scene's own unit), each times its texture, `map_Kd` and `map_Ke` (PNG or JPEG, with `-s`, `-o` and
//! `-clamp`; coordinates by `vt`). Each object or group becomes a surface, one for each material in it. Normals and
//! smoothing groups play no part: creases are found by angle. What else a file may hold is left out, with a warning where
//! that changes the light.
//!
//! # Conventions
//! Axes and the unit of length stay as they are; programs that write OBJ mean y up as a rule. A face's front is where
//! its corners run counter-clockwise, and its back is black. A material that is not told is a grey that reflects half.
//! Polygons are cut into triangles, one that crosses itself into a fan about its first corner. Vertices at the same
//! position are one; triangles without area, and those that are there already, are left out and counted
//! ([`super::Mesh::left_out`]).
//!
//! # Limits
//! Files of 1 GiB, images of 2²⁶ pixels, numbers up to 1e15, 2,000 corners a face, 2³² vertices.

mod material;
mod parser;
mod words;

use std::path::Path;

use super::{Scene, SceneError, file, n3d};

/// Read NAME.obj with the material files that it names, and NAME.vsn where it stands beside it.
///
/// # Errors
/// The first thing wrong in any of the files, with its place and the cure. A material file that is not there is a
/// warning, and its materials are grey.
pub fn read(path: &Path) -> Result<Scene, SceneError> {
    let bytes = file::bytes(path, "obj")?;
    let mut scene = parse_scene(&path.display().to_string(), &bytes, |name| {
        // Written on another system, or in a folder that is no more: then the file itself may stand beside.
        let name = name.replace('\\', "/");
        let beside = Path::new(&name).file_name().map(|file| path.with_file_name(file));
        let places = [Some(path.with_file_name(&name)), beside];
        let found = places.into_iter().flatten().find(|place| place.is_file())?;
        let ending = found.extension().unwrap_or_default().to_ascii_lowercase();
        let read = match ending.to_str() {
            Some("png" | "jpg" | "jpeg") => file::binary,
            _ => file::bytes,
        };
        Some(read(&found, "mtl").map(|bytes| (found.display().to_string(), bytes)))
    })?;
    n3d::add_view_beside(path, &mut scene)?;
    Ok(scene)
}

/// The scene that the bytes of an .obj file describe, without a camera. `name` is what messages call the file;
/// `library` gives the name and bytes of a material file that it names, or of an image that this one does, `None` where
/// there is none.
///
/// # Errors
/// The first thing wrong in any of them: [`SceneError::Syntax`], or what `library` answers.
///
/// ```
/// use radiosity::scene::obj::parse_scene;
///
/// let room = b"mtllib room.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl lamp\nf 1 2 3";
/// let lamp = b"newmtl lamp\nKe 20 20 20";
/// let scene = parse_scene("room.obj", room, |name| Some(Ok((name.into(), lamp.to_vec())))).unwrap();
/// assert_eq!(scene.surfaces[0].material.emission.r, 20.0);
///
/// let error = parse_scene("room.obj", b"v 0 0 0\nf 1 2 3", |_| None).unwrap_err();
/// assert_eq!(error.to_string(), "room.obj:2:5: there is no vertex 2: the file has 1");
/// ```
pub fn parse_scene(
    name: &str,
    bytes: &[u8],
    library: impl FnMut(&str) -> Option<Result<(String, Vec<u8>), SceneError>>,
) -> Result<Scene, SceneError> {
    parser::parse(name, bytes, library)
}
