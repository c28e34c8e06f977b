//! Asking for the size of a picture to save.

use eframe::egui::{self, DragValue};

use crate::app::App;

pub(crate) fn show(app: &mut App, ctx: &egui::Context) {
    if !app.picture_dialog {
        return;
    }
    let texts = app.texts();
    let on_screen = app.view_size;
    let mut decided = None;
    let modal = egui::Modal::new(egui::Id::unique("picture")).show(ctx, |ui| {
        ui.set_max_width(320.0);
        ui.strong((texts.action)(crate::action::Action::SavePicture).0);
        let picture = &mut app.settings.picture;
        ui.horizontal(|ui| {
            let label = ui.label(texts.picture_size).id;
            ui.add(DragValue::new(&mut picture.width).range(1..=16384)).labelled_by(label);
            ui.label("×");
            ui.add(DragValue::new(&mut picture.height).range(1..=16384)).labelled_by(label);
        });
        if ui.button(texts.as_on_screen).clicked() {
            [picture.width, picture.height] = on_screen.map(|side| side.clamp(1, 16384));
        }
        ui.horizontal(|ui| {
            let slider =
                egui::Slider::new(&mut picture.sampling, 1..=8).custom_formatter(|k, _| format!("{k} × {k}"));
            ui.add(slider.text(texts.picture_samples));
        });
        ui.horizontal(|ui| {
            if ui.button(texts.save).clicked() {
                decided = Some(true);
            }
            if ui.button(texts.cancel).clicked() {
                decided = Some(false);
            }
        });
    });
    if modal.should_close() {
        decided = decided.or(Some(false));
    }
    if let Some(save) = decided {
        app.picture_dialog = false;
        if save {
            app.ask_for_picture_file(ctx);
        }
    }
}
