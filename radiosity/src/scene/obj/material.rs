//! Materials of MTL files.

use std::collections::HashMap;

use super::words::{Statement, Statements, Word};
use crate::light::Rgb;
use crate::scene::mesh_builder::DEFAULT_REFLECTANCE;
use crate::scene::source::Source;
use crate::scene::{Material, Place, SceneError, Warning, Wrap, number};

/// Materials by their names.
pub(super) type Materials = HashMap<String, Told>;

/// What a file tells of a material: its reflectance and its emission, and the textures of both.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Told {
    pub(super) diffuse: Option<Rgb>,
    pub(super) emission: Option<Rgb>,
    pub(super) diffuse_map: Option<Map>,
    pub(super) emission_map: Option<Map>,
}

impl Told {
    /// The material, without textures: what is not told is grey, and sends no light.
    pub(super) fn material(&self) -> Material {
        Material {
            diffuse: self.diffuse.unwrap_or(DEFAULT_REFLECTANCE),
            emission: self.emission.unwrap_or_default(),
            ..Material::default()
        }
    }
}

/// A texture, as a material names it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Map {
    /// The image file.
    pub(super) image: String,
    pub(super) wrap: Wrap,
    /// From (x, y), y upwards, to (u, v), v downwards.
    pub(super) transform: [[f64; 3]; 2],
    /// The file that names it, and where.
    pub(super) file: String,
    pub(super) place: Place,
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
            materials.insert(named.clone(), Told::default());
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
        let told = materials.entry(of.clone()).or_default();
        match keyword.text {
            "Kd" | "Ke" => match colour(&statements, &statement)? {
                Some(colour) if keyword.text == "Kd" => told.diffuse = Some(colour),
                Some(colour) => told.emission = Some(colour),
                None => warn(format!(
                    "{} of the material {of} is told as a spectrum or in CIE XYZ, which is not read: write its red, \
                     green and blue",
                    keyword.text
                )),
            },
            "map_Kd" | "map_Ke" => {
                let (map, left_out) = map(name, &statements, &statement)?;
                if let Some(option) = left_out {
                    warn(format!("the option {option} of a texture of the material {of} is left out"));
                }
                match keyword.text {
                    "map_Kd" => told.diffuse_map = Some(map),
                    _ => told.emission_map = Some(map),
                }
            }
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

/// The texture that `map_Kd` or `map_Ke` tells, and the first of its options that is left out.
fn map<'a>(
    file: &str,
    statements: &Statements<'a>,
    statement: &Statement<'a>,
) -> Result<(Map, Option<&'a str>), SceneError> {
    let (keyword, mut words) = (statement.words[0], &statement.words[1..]);
    let (mut wrap, mut scale, mut offset, mut left_out) = (Wrap::Repeat, [1.0; 2], [0.0; 2], None);
    while let [option, rest @ ..] = words
        && option.text.starts_with('-')
    {
        // As many of the words that follow as are numbers, or one that is none.
        let numbers: Vec<f64> = rest.iter().take(3).map_while(|word| number::real(word.text).ok()).collect();
        let wanted = match option.text {
            "-s" | "-o" | "-t" => numbers.len(),
            "-mm" => 2.min(rest.len()),
            "-blendu" | "-blendv" | "-cc" | "-clamp" | "-texres" | "-imfchan" | "-bm" | "-boost"
            | "-type" => 1.min(rest.len()),
            // A file may be called so.
            _ => break,
        };
        for (k, &value) in numbers.iter().take(2).enumerate() {
            match option.text {
                "-s" => scale[k] = value,
                "-o" => offset[k] = value,
                _ => {}
            }
        }
        match option.text {
            "-clamp" if rest.first().is_some_and(|word| word.text == "on") => wrap = Wrap::Clamp,
            "-s" | "-o" | "-clamp" | "-blendu" | "-blendv" | "-texres" => {}
            _ => left_out = left_out.or(Some(option.text)),
        }
        words = &rest[wanted..];
    }
    let (Some(first), Some(last)) = (words.first(), words.last()) else {
        let message = format!("{} names no image file", keyword.text);
        return Err(statements.error(keyword, message, "write the file's name, or leave the line out"));
    };
    let image = statements.source.text[first.start..last.start + last.text.len()].to_owned();
    // Of OBJ the first row of an image is the one at the top, y = 1.
    let transform = [[scale[0], 0.0, offset[0]], [0.0, -scale[1], 1.0 - offset[1]]];
    let place = statements.place(keyword);
    Ok((Map { image, wrap, transform, file: file.to_owned(), place }, left_out))
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
