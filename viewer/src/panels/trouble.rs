//! What went wrong, with its place in the file.

use eframe::egui::{self, Color32, RichText, Ui};
use radiosity::scene::SceneError;

use crate::app::App;
use crate::worker::Trouble;

pub(crate) fn show(app: &mut App, ctx: &egui::Context) {
    let Some(trouble) = &app.session.trouble else { return };
    let (texts, language) = (app.texts(), app.language());
    let title = match trouble {
        Trouble::Scene(_) => texts.trouble_scene,
        Trouble::Bake(_) => texts.trouble_solve,
        Trouble::Bug(_) => texts.trouble_bug,
    };
    let mut closed = false;
    let screen = ctx.content_rect();
    let width = (screen.width() - 48.0).clamp(120.0, 620.0);
    egui::Window::new(RichText::new(title).color(Color32::from_rgb(255, 120, 100)))
        .id(egui::Id::unique("trouble"))
        .collapsible(false)
        .resizable(false)
        .default_width(width)
        .max_height((screen.height() - 80.0).max(60.0))
        .anchor(egui::Align2::CENTER_TOP, [0.0, 40.0])
        .show(ctx, |ui| {
            ui.set_max_width(width);
            egui::ScrollArea::vertical().show(ui, |ui| {
                match trouble {
                    Trouble::Scene(error) => scene_error(ui, error, texts.what_to_do),
                    Trouble::Bake(error) => {
                        ui.label((texts.bake_error)(error, language));
                    }
                    Trouble::Bug(message) => {
                        ui.label(RichText::new(message).monospace());
                    }
                }
                if matches!(trouble, Trouble::Scene(_)) && app.session.loaded.is_some() {
                    ui.add_space(4.0);
                    ui.weak(texts.trouble_kept);
                }
                ui.add_space(6.0);
                closed = ui.button(texts.close).clicked();
            });
        });
    if closed || ctx.input(|input| input.key_pressed(egui::Key::Escape)) {
        app.session.trouble = None;
    }
}

fn scene_error(ui: &mut Ui, error: &SceneError, what_to_do: &str) {
    match error {
        SceneError::File { file, message } => {
            ui.label(RichText::new(file).monospace());
            ui.label(message);
        }
        SceneError::Syntax { file, place, length, line, caret, message, help } => {
            ui.label(RichText::new(format!("{file}:{place}")).monospace());
            ui.label(RichText::new(message).strong());
            ui.add_space(4.0);
            // The line, with what is at fault marked under it.
            let number = place.line.to_string();
            let gap = " ".repeat(number.len());
            let before = " ".repeat(*caret as usize);
            let marks = "^".repeat(*length as usize);
            // The reader's signs for control characters are in no font of ours.
            let line: String =
                line.chars().map(|c| if ('\u{2400}'..='\u{243f}').contains(&c) { '·' } else { c }).collect();
            let excerpt = format!("{number} │ {line}\n{gap} │ {before}{marks}");
            egui::ScrollArea::horizontal().show(ui, |ui| {
                egui::Frame::NONE.fill(ui.visuals().extreme_bg_color).inner_margin(6.0).show(ui, |ui| {
                    ui.add(egui::Label::new(RichText::new(excerpt).monospace()).extend());
                });
            });
            if !help.is_empty() {
                ui.add_space(4.0);
                ui.label(format!("{what_to_do}: {help}"));
            }
        }
    }
}
