//! glTF 2.0, as `.gltf` (text) or `.glb` (binary).
//!
//! # What is read
//! The default scene (the first, where none is), its nodes with their transforms, instances and mirrors included;
//! triangles, strips and fans, with indices of every type, sparse accessors, quantised positions; `data:` URIs and
//! files beside. Each primitive of each node becomes a surface, a mesh with one material. The first camera in
//! perspective is the scene's.
//!
//! - **Reflectance** is the base colour: factor, texture and vertex colours multiplied. A texture (PNG or JPEG) is decoded
//!   from sRGB to linear light, and a patch has its mean ([`super::Paint`]). Radiosity is of matt surfaces: metals and
//!   whatever shines or lets through are taken as matt, of their base colour, and a warning says so. Where no material
//!   is told, a grey that reflects half.
//! - **Emission** is the emitted exitance E: `emissiveFactor` x `emissiveStrength` (KHR_materials_emissive_strength) x
//!   texture, the number as it stands, in the scene's own unit of power per area, as `CE` of a .scn. A viewer that
//!   takes the number for a luminance in nits shows a surface of E = π times it.
//! - **`doubleSided`** makes two surfaces of one: the second faces the other way, three millionths of the scene's
//!   size behind, so that from each side the one that faces it is nearer.
//! - **Lamps of KHR_lights_punctual** have no surface and are left out, with a warning: give a surface an emission.
//!
//! # Conventions
//! Metres, y up, right-handed: axes are as they stand. A front is where corners run counter-clockwise, under a
//! mirroring transform the other way round; backs are black. Vertices at the same position are one; triangles without
//! area, and those that are there already, are left out and counted. A surface is called as its node, else its mesh.
//!
//! A file that `export::write_gltf` wrote carries reflectances, emissions and parallelograms beside the light it
//! shows: they are read back, and the light, which is an answer and no question, is not.
//!
//! # Limits
//! Files of 1 GiB each and 2 GiB in all; 2²⁵ triangles, instances counted as often as they stand; images of 2²⁶
//! pixels, which together take 2 GiB: those that come after are made coarser.

mod accessor;
mod buffers;
mod container;
mod instances;
mod material;
mod solution;
mod texture;

use std::path::Path;

use super::{Scene, SceneError, file, n3d};

pub(crate) use solution::{SOLUTION_KEY, SolvedMaterial, SolvedMesh};

/// What is wrong, and the cure; which file it is in is for others to add.
#[derive(Debug)]
struct Fault(String);

fn fault<T>(message: impl Into<String>) -> Result<T, Fault> {
    Err(Fault(message.into()))
}

/// `nodes[3] (Lamp)`: a part of the document as messages call it.
fn part(kind: &str, index: usize, name: Option<&str>) -> String {
    match name {
        Some(name) if !name.is_empty() => {
            let shown: String = name.chars().filter(|c| !c.is_control()).take(40).collect();
            format!("{kind}[{index}] ({shown})")
        }
        _ => format!("{kind}[{index}]"),
    }
}

/// Read NAME.gltf or NAME.glb with the files that it names, and NAME.vsn where it stands beside it, whose camera goes
/// before that of the file.
///
/// # Errors
/// [`SceneError::File`] for the first thing wrong: the part of the document, what is wrong with it, and the cure.
pub fn read(path: &Path) -> Result<Scene, SceneError> {
    let bytes = file::binary(path, "gltf")?;
    let mut scene = parse_scene(&path.display().to_string(), &bytes, |uri| {
        let beside = path.with_file_name(uri.replace('\\', "/"));
        file::binary(&beside, "bin").map_err(|error| error.to_string())
    })?;
    n3d::add_view_beside(path, &mut scene)?;
    Ok(scene)
}

/// The scene that the bytes of a .gltf or .glb file describe. `name` is what messages call the file; `resource` gives
/// the bytes of a file that it names (its URI, with escapes undone), or says why it cannot.
///
/// # Errors
/// As of [`read`].
///
/// ```
/// use radiosity::scene::gltf::parse_scene;
///
/// let error = parse_scene("room.gltf", br#"{"asset": {"version": "2.0"}}"#, |_| Err("not here".into())).unwrap_err();
/// assert_eq!(error.to_string(), "room.gltf: the scene has no triangle, so there is nothing to light");
/// ```
pub fn parse_scene(
    name: &str,
    bytes: &[u8],
    mut resource: impl FnMut(&str) -> Result<Vec<u8>, String>,
) -> Result<Scene, SceneError> {
    container::open(bytes)
        .and_then(|opened| {
            let buffers = buffers::Buffers::load(&opened, &mut resource)?;
            instances::scene(name, &opened, &buffers, &mut resource)
        })
        .map_err(|Fault(message)| SceneError::File { file: name.to_owned(), message })
}
