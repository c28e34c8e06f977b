//! Lights and materials, to be changed while the light follows.

use eframe::egui::{self, Ui};
use radiosity::light::Rgb;

use super::drag;
use crate::action::Action;
use crate::app::App;
use crate::session::SurfaceLight;

/// Surfaces that are changed together.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Group {
    pub(crate) surfaces: Vec<usize>,
    /// Line of the first in the file.
    line: u32,
}

/// Surfaces of the same material as the file has it stand together, in its order; `one_by_one` each stands alone.
pub(crate) fn groups(scene: &radiosity::scene::Scene, one_by_one: bool) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    let mut by_material = std::collections::HashMap::new();
    for (index, surface) in scene.surfaces.iter().enumerate() {
        let bits = |colour: Rgb| colour.to_array().map(f64::to_bits);
        let material = (bits(surface.material.emission), bits(surface.material.diffuse));
        let alone = Group { surfaces: vec![index], line: surface.place.line };
        if one_by_one {
            groups.push(alone);
        } else {
            let place = *by_material.entry(material).or_insert(groups.len());
            match groups.get_mut(place) {
                Some(group) => group.surfaces.push(index),
                None => groups.push(alone),
            }
        }
    }
    groups
}

pub(crate) fn show(app: &mut App, ui: &mut Ui) {
    let texts = app.texts();
    let Some(loaded) = app.session.loaded.clone() else {
        ui.weak(texts.no_scene);
        return;
    };
    ui.horizontal_wrapped(|ui| {
        ui.checkbox(&mut app.one_by_one, texts.one_by_one).on_hover_text(texts.one_by_one_hint);
        let (name, tip) = (texts.action)(Action::ResetMaterials);
        let key = app.key(Action::ResetMaterials, ui.ctx());
        if ui.button(name).on_hover_text(format!("{tip} ({key})")).clicked() {
            app.act(Action::ResetMaterials, ui.ctx());
        }
    });
    let groups = groups(&loaded.scene, app.one_by_one);
    let shines = |group: &Group| {
        let first = group.surfaces[0];
        !loaded.scene.surfaces[first].material.emission.is_black()
            || app.session.materials.get(first).is_some_and(|material| !material.emission.is_black())
    };
    let selected = app.session.selected.and_then(|patch| loaded.patches.surface.get(patch as usize).copied());
    let (lights, others): (Vec<&Group>, Vec<&Group>) = groups.iter().partition(|group| shines(group));
    let mut changed = false;
    for (title, list, is_light) in [(texts.lights, lights, true), (texts.surfaces, others, false)] {
        if list.is_empty() {
            continue;
        }
        ui.add_space(6.0);
        ui.label(egui::RichText::new(title).strong());
        for group in list {
            let chosen = selected.is_some_and(|surface| group.surfaces.contains(&(surface as usize)));
            changed |= ui.push_id(group.surfaces[0], |ui| one(app, ui, group, is_light, chosen)).inner;
        }
    }
    if changed {
        app.session.materials_changed();
    }
}

/// A group's line. Whether it was changed.
fn one(app: &mut App, ui: &mut Ui, group: &Group, is_light: bool, chosen: bool) -> bool {
    let (texts, language) = (app.texts(), app.language());
    let Some(&material) = app.session.materials.get(group.surfaces[0]) else { return false };
    let mut new = material;
    let name = (texts.group)(group.surfaces.len(), group.surfaces[0], &group.line.to_string());
    let name = if chosen { format!("• {name}") } else { name };
    ui.horizontal(|ui| {
        if is_light {
            ui.checkbox(&mut new.on, "").on_hover_text(texts.on_off);
        }
        let label = egui::RichText::new(name);
        let label = egui::Label::new(if chosen { label.strong() } else { label }).truncate();
        let label = ui.add(label.sense(egui::Sense::click()));
        if label.clicked()
            && let Some(loaded) = &app.session.loaded
        {
            let first = loaded.patches.blocks[group.surfaces[0]].first;
            app.session.select(Some(first));
        }
    });
    ui.horizontal(|ui| {
        ui.add_space(14.0);
        let mut colour = colour_of(new.reflectance);
        ui.label("ρ").on_hover_text(texts.reflectance);
        if ui.color_edit_button_rgb(&mut colour).on_hover_text(texts.reflectance).changed() {
            new.reflectance = Rgb::from(colour.map(|value| f64::from(value.clamp(0.0, 1.0))));
        }
        let mut grey = new.reflectance.max_channel();
        let slider = drag(language, &mut grey).speed(0.005).range(0.0..=1.0);
        if ui.add(slider).on_hover_text(texts.reflectance).changed() {
            new.reflectance = scaled(new.reflectance, grey);
        }
        ui.add_space(4.0);
        ui.label("E").on_hover_text(texts.emission);
        let mut hue = colour_of(new.hue);
        if ui.color_edit_button_rgb(&mut hue).on_hover_text(texts.emission).changed() {
            let hue = Rgb::from(hue.map(|value| f64::from(value.clamp(0.0, 1.0))));
            let intensity = new.emission.max_channel();
            new.hue = hue;
            new.emission = hue * (intensity / hue.max_channel().max(1e-6));
        }
        let mut intensity = new.emission.max_channel();
        let speed = (intensity * 0.01).max(0.02);
        let value = drag(language, &mut intensity).speed(speed).range(0.0..=1e9);
        if ui.add(value).on_hover_text(texts.intensity).changed() {
            new.emission = new.hue * (intensity / new.hue.max_channel().max(1e-6));
        }
    });
    let changed = new != material;
    if changed {
        apply(&mut app.session.materials, group, new);
    }
    changed
}

fn apply(materials: &mut [SurfaceLight], group: &Group, new: SurfaceLight) {
    for &surface in &group.surfaces {
        if let Some(material) = materials.get_mut(surface) {
            *material = new;
        }
    }
}

fn colour_of(colour: Rgb) -> [f32; 3] {
    colour.to_array().map(|value| value.clamp(0.0, 1.0) as f32)
}

/// The same colour with `greatest` as its largest channel.
fn scaled(colour: Rgb, greatest: f64) -> Rgb {
    let now = colour.max_channel();
    if now > 0.0 { colour * (greatest / now) } else { Rgb::grey(greatest) }
}
