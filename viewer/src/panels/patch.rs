//! All numbers of the patch that was clicked upon.

use eframe::egui::{self, Grid, Ui};
use radiosity::light::Rgb;

use crate::app::App;
use crate::quantities;

/// So many of the patches that it sees most are listed.
const LISTED: usize = 6;

pub(crate) fn show(app: &mut App, ui: &mut Ui) {
    let (texts, language) = (app.texts(), app.language());
    let session = &app.session;
    let (Some(number), Some(loaded)) = (session.selected, &session.loaded) else {
        ui.weak(texts.click_a_patch);
        return;
    };
    let patch = number as usize;
    let light = &session.light;
    let patches = &light.patches;
    if patch >= patches.len() {
        return;
    }
    let surface = patches.surface[patch] as usize;
    let numbers = |values: [f64; 3]| values.map(|value| language.number(value, 4)).join("  ");
    let known = |value: Option<String>| value.unwrap_or_else(|| texts.unknown.into());
    let light_of = |value: Rgb| session.lit.then(|| numbers(value.to_array()));
    Grid::new("patch").num_columns(2).striped(true).show(ui, |ui| {
        let mut line = |name: &str, value: String, colour: Option<egui::Color32>| {
            ui.label(name);
            ui.horizontal(|ui| {
                if let Some(colour) = colour {
                    let (at, _) = ui.allocate_exact_size(egui::vec2(12.0, 12.0), egui::Sense::hover());
                    ui.painter().rect_filled(at, 2.0, colour);
                }
                ui.add(egui::Label::new(egui::RichText::new(value).monospace()).wrap());
            });
            ui.end_row();
        };
        line(texts.patch, number.to_string(), Some(app.patch_colour(number)));
        let written = loaded.scene.surfaces.get(surface);
        let name = written.map_or("", |surface| &surface.name);
        line(texts.object, format!("{surface} {name}").trim_end().to_owned(), None);
        // A format without lines has no place to tell.
        if let Some(surface) = written.filter(|surface| surface.place.line > 0) {
            line(texts.place, (texts.line_column)(surface.place.line, surface.place.column), None);
        }
        line(texts.centre, numbers(patches.centre[patch].to_array()), None);
        line(texts.normal, numbers(patches.normal[patch].to_array()), None);
        line(texts.area, language.number(patches.area[patch], 5), None);
        line("E", numbers(patches.emission[patch].to_array()), None);
        line("ρ", numbers(patches.reflectance[patch].to_array()), None);
        line("B", known(light_of(light.radiosity[patch])), None);
        if let Some(error) = &light.error {
            line("± B", numbers(error.estimate.radiosity[patch].to_array()), None);
        }
        line("H", known(light_of(quantities::irradiance(light, patch))), None);
        let sum = light.row_sum.get(patch).copied().flatten();
        let sum = sum
            .or_else(|| app.session.inspection.as_ref().filter(|i| i.patch == number).map(|i| i.row.sum()));
        line(texts.row_sum, known(sum.map(|sum| language.fixed(sum, 6))), None);
    });

    let Some(inspection) = session.inspection.as_deref().filter(|inspection| inspection.patch == number)
    else {
        return;
    };
    let mut seen: Vec<(usize, f64)> = inspection.row.iter().collect();
    seen.sort_by(|one, other| other.1.total_cmp(&one.1));
    ui.add_space(4.0);
    if seen.is_empty() {
        ui.label(texts.sees_nothing);
        return;
    }
    ui.label(texts.sees_most);
    let mut chosen = None;
    Grid::new("seen").num_columns(2).striped(true).show(ui, |ui| {
        for &(j, factor) in seen.iter().take(LISTED) {
            ui.horizontal(|ui| {
                let (at, _) = ui.allocate_exact_size(egui::vec2(12.0, 12.0), egui::Sense::hover());
                ui.painter().rect_filled(at, 2.0, app.patch_colour(j as u32));
                if ui.link(format!("{} {j}", texts.patch)).clicked() {
                    chosen = Some(j as u32);
                }
            });
            ui.monospace(format!("F = {}", language.number(factor, 4)));
            ui.end_row();
        }
    });
    if chosen.is_some() {
        app.session.select(chosen);
    }
}
