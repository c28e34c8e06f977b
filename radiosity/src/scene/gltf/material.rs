//! What radiosity takes from a material.

use gltf::material::{AlphaMode, Material};
use gltf::texture::Info;

use super::part;
use super::solution::{SOLUTION_KEY, SolvedMaterial};
use crate::light::Rgb;
use crate::scene::mesh_builder::DEFAULT_REFLECTANCE;

/// Reflectance and emission, each a factor and, it may be, a texture.
pub(super) struct Looks<'a> {
    pub(super) diffuse: Rgb,
    pub(super) diffuse_texture: Option<Info<'a>>,
    pub(super) emission: Rgb,
    pub(super) emission_texture: Option<Info<'a>>,
    /// Whether vertex colours are part of the reflectance; in a file of ours they are the light.
    pub(super) vertex_colours: bool,
    pub(super) double_sided: bool,
}

/// Things worth a warning, each with the first part it was found in and how often.
#[derive(Default)]
pub(super) struct Notes(Vec<(String, String, usize)>);

impl Notes {
    pub(super) fn add(&mut self, what: impl Into<String>, part: String) {
        let what = what.into();
        match self.0.iter_mut().find(|(other, ..)| *other == what) {
            Some((_, first, times)) if *first != part => *times += 1,
            Some(_) => {}
            None => self.0.push((what, part, 1)),
        }
    }

    /// Each as a sentence.
    pub(super) fn told(self) -> impl Iterator<Item = String> {
        self.0.into_iter().map(|(what, part, times)| match times {
            1 => format!("{part}: {what}"),
            _ => format!("{part} and others: {what}"),
        })
    }
}

/// What a material looks like under diffuse light.
pub(super) fn looks<'a>(material: &Material<'a>, notes: &mut Notes) -> Looks<'a> {
    let Some(index) = material.index() else {
        return Looks {
            diffuse: DEFAULT_REFLECTANCE,
            diffuse_texture: None,
            emission: Rgb::BLACK,
            emission_texture: None,
            vertex_colours: true,
            double_sided: false,
        };
    };
    let solved = material.extras().as_ref().and_then(|extras| SolvedMaterial::parse(extras.get()));
    if let Some(SolvedMaterial { reflectance, emission }) = solved {
        return Looks {
            diffuse: reflectance,
            diffuse_texture: None,
            emission,
            emission_texture: None,
            vertex_colours: false,
            // Backs of ours are surfaces of their own, or the scene says that they are lit.
            double_sided: false,
        };
    }
    let mut note = |what: &str| notes.add(what, part("materials", index, material.name()));
    let base = material.pbr_metallic_roughness();
    let [r, g, b, alpha] = base.base_color_factor();
    if material.alpha_mode() != AlphaMode::Opaque && (alpha < 1.0 || base.base_color_texture().is_some()) {
        note("it is transparent, and taken as opaque");
    }
    if material.unlit() {
        note(
            "it is unlit (KHR_materials_unlit): its colour is taken as a reflectance; for a lamp give it an \
             emissiveFactor",
        );
    } else if base.metallic_factor() > 0.5 {
        note(
            "it is a metal (metallicFactor, 1 unless told otherwise), and taken as matt, of its base colour",
        );
    }
    let strength = f64::from(material.emissive_strength().unwrap_or(1.0));
    let [emitted_r, emitted_g, emitted_b] = material.emissive_factor().map(f64::from);
    let colour = |values: [f32; 3]| Rgb::from(values.map(f64::from));
    Looks {
        diffuse: colour([r, g, b]),
        diffuse_texture: base.base_color_texture(),
        emission: Rgb::new(emitted_r, emitted_g, emitted_b) * strength,
        emission_texture: material.emissive_texture(),
        vertex_colours: true,
        double_sided: material.double_sided(),
    }
}

/// Whether every channel is a number that light can be computed with.
pub(super) fn sound(colour: Rgb) -> bool {
    colour.to_array().iter().all(|channel| (0.0..=1e15).contains(channel))
}

/// What `extras` of a mesh or a material hold of ours, as JSON.
pub(super) fn ours(extras: &str) -> Option<serde_json::Value> {
    let mut extras: serde_json::Value = serde_json::from_str(extras).ok()?;
    extras.get_mut(SOLUTION_KEY).map(serde_json::Value::take)
}
