//! Materials of MTL files.

use std::collections::HashMap;

use super::words::{Statement, Statements, Word};
use crate::light::Rgb;
use crate::scene::mesh_builder::DEFAULT_REFLECTANCE;
use crate::scene::source::Source;
use crate::scene::{Material, Place, SceneError, Warning};

/// Materials by their names.
pub(super) type Materials = HashMap<String, Material>;

/// What is taken where a material is not told.
pub(super) fn default_material() -> Material {
    Material { diffuse: DEFAULT_REFLECTANCE, ..Material::default() }
}

/// Read a material file into `materials`; of two of one name the later counts.
pub(super) fn parse(
    name: &str,
    bytes: &[u8],
    materials: &mut Materials,
    warnings: &mut Vec<Warning>,
) -> Result<(), SceneError> {
    let source = Source::new(name, bytes)?;
    let mut statements = Statements::new(&source);
    let mut statement = Statement::default();
    let mut current: Option<String> = None;
    while statements.next(&mut statement) {
        let keyword = statement.words[0];
        let mut warn = |message: String| warnings.push(warning(name, statements.place(keyword), message));
        if keyword.text == "newmtl" {
            let named = statement.rest.to_owned();
            materials.insert(named.clone(), default_material());
            current = Some(named);
            continue;
        }
        let Some(of) = &current else {
            if matches!(keyword.text, "Kd" | "Ke") {
                let message = format!("{} stands before any newmtl", keyword.text);
                return Err(statements.error(keyword, message, "begin each material with newmtl NAME"));
            }
            continue;
        };
        let material = materials.entry(of.clone()).or_default();
        match keyword.text {
            "Kd" | "Ke" => match colour(&statements, &statement)? {
                Some(colour) if keyword.text == "Kd" => material.diffuse = colour,
                Some(colour) => material.emission = colour,
                None => warn(format!(
                    "{} of the material {of} is told as a spectrum or in CIE XYZ, which is not read: write its red, \
                     green and blue",
                    keyword.text
                )),
            },
            "map_Kd" | "map_Ke" => warn(format!(
                "the texture of the material {of} is left out, and its {} taken everywhere: textures are read from glTF",
                &keyword.text[4..]
            )),
            "d" | "Tr" => {
                let [share] = statements.numbers(&statement)?;
                if (keyword.text == "d") == (share < 1.0) && share != 0.0 {
                    warn(format!("the material {of} is transparent: it is taken as opaque"));
                }
            }
            _ => {}
        }
    }
    Ok(())
}

/// Red, green and blue, or one grey; `None` where it is told otherwise.
fn colour(statements: &Statements<'_>, statement: &Statement<'_>) -> Result<Option<Rgb>, SceneError> {
    let numbers: &[Word<'_>] = &statement.words[1..];
    if numbers.first().is_some_and(|word| matches!(word.text, "spectral" | "xyz")) {
        return Ok(None);
    }
    let colour = match numbers {
        [_] => Rgb::grey(statements.numbers::<1>(statement)?[0]),
        _ => Rgb::from(statements.numbers::<3>(statement)?),
    };
    match numbers.iter().zip(colour.to_array()).find(|(_, value)| *value < 0.0) {
        Some((word, _)) => Err(statements.error(
            *word,
            format!("{} must not be negative", statement.words[0].text),
            "write 0 for a surface that reflects or emits nothing",
        )),
        None => Ok(Some(colour)),
    }
}

/// A warning at a place of a file.
pub(super) fn warning(file: &str, place: Place, message: String) -> Warning {
    Warning { file: file.to_owned(), place, message }
}
