//! From bytes to a document whose indices all lead somewhere.

use gltf::Document;
use gltf::json::validation::{Error, Validate};
use gltf::json::{Root, mesh::Semantic, validation::Checked};

use super::{Fault, fault};

/// A document, and the binary chunk of a .glb.
pub(super) struct Opened<'a> {
    pub(super) document: Document,
    pub(super) blob: Option<&'a [u8]>,
    /// Extensions it uses that play no part.
    pub(super) passed_over: Vec<String>,
}

/// Extensions that are read.
const READ: [&str; 5] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

pub(super) fn open(bytes: &[u8]) -> Result<Opened<'_>, Fault> {
    let (json, blob) = if bytes.starts_with(b"glTF") { split(bytes)? } else { (bytes, None) };
    let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
    if json.iter().find(|byte| !byte.is_ascii_whitespace()) != Some(&b'{') {
        return fault("this is no glTF, neither text (it begins with no `{`) nor binary (nor with `glTF`)");
    }
    let mut root: Root = serde_json::from_slice(json).map_err(|error| {
        Fault(format!("the JSON is not that of a glTF 2.0: {error}; export the scene again"))
    })?;
    if !root.asset.version.starts_with("2.") {
        let version: String = root.asset.version.chars().take(8).collect();
        return fault(format!("this is glTF {version}, and only 2.0 is read: export it as 2.0"));
    }
    // What only colours or shines differently can be passed over; what the geometry is packed in cannot.
    for name in std::mem::take(&mut root.extensions_required) {
        if !READ.contains(&name.as_str()) && !name.starts_with("KHR_materials_") {
            return fault(format!(
                "extensionsRequired: {name} is not read; export the scene without it (without compression, with PNG or \
                 JPEG textures)"
            ));
        }
    }
    let passed_over =
        root.extensions_used.iter().filter(|name| !READ.contains(&name.as_str())).cloned().collect();
    check(&root)?;
    Ok(Opened { document: Document::from_json_without_validation(root), blob, passed_over })
}

/// The JSON and the binary chunk of a .glb.
fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), Fault> {
    let word = |at: usize| Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?));
    match (word(4), word(8)) {
        (Some(2), Some(length)) if length as usize <= bytes.len() => {}
        (Some(2), Some(length)) => {
            let count = bytes.len();
            return fault(format!(
                "the file is cut short: it says {length} bytes, and has {count}; copy it again"
            ));
        }
        (Some(version), Some(_)) => {
            return fault(format!(
                "this is a binary glTF {version}, and only 2 is read: export it as glTF 2.0"
            ));
        }
        _ => return fault("the file is cut short in its header; copy it again"),
    }
    let (mut json, mut blob) = (None, None);
    let mut at = 12;
    while let (Some(length), Some(kind)) = (word(at), word(at + 4)) {
        let Some(chunk) = (at + 8).checked_add(length as usize).and_then(|end| bytes.get(at + 8..end)) else {
            return fault(format!(
                "the file is cut short: its chunk at byte {at} goes beyond its end; copy it again"
            ));
        };
        match &kind.to_le_bytes() {
            b"JSON" => {
                json.get_or_insert(chunk);
            }
            b"BIN\0" => {
                blob.get_or_insert(chunk);
            }
            _ => {}
        }
        at += 8 + chunk.len();
    }
    match json {
        Some(json) => Ok((json, blob)),
        None => fault("the binary glTF has no JSON in it; export the scene again"),
    }
}

/// Refuse a document with an index that leads nowhere, or with what glTF 2.0 has no name for.
fn check(root: &Root) -> Result<(), Fault> {
    // The crate's own check looks these up before it has looked at them.
    for (mesh, index) in root.meshes.iter().zip(0..) {
        for (primitive, number) in mesh.primitives.iter().zip(0..) {
            let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
            if positions.is_some_and(|accessor| accessor.value() >= root.accessors.len()) {
                return fault(format!(
                    "meshes[{index}].primitives[{number}].attributes.POSITION: there is no such accessor; export the \
                     scene again"
                ));
            }
        }
    }
    let mut first = None;
    root.validate(root, gltf::json::Path::new, &mut |path, error| {
        if first.is_some() {
            return;
        }
        let path = path().to_string();
        // Not asked for here, and often left out or written wrongly: the bounds of positions, names of other
        // attributes.
        let harmless = match error {
            Error::Missing | Error::Invalid => path.contains(".attributes"),
            _ => false,
        };
        if !harmless {
            first = Some((path, error));
        }
    });
    match first {
        None => Ok(()),
        Some((path, error)) => {
            let what = match error {
                Error::IndexOutOfBounds => "there is no such index",
                Error::Invalid => "this is no value that glTF 2.0 knows",
                Error::Missing => "it is missing",
                Error::Oversize => "it is too large",
                Error::Unsupported => "it is not read",
            };
            fault(format!("{path}: {what}; export the scene again"))
        }
    }
}
