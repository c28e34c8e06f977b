//! What was read from the file, but plays no part.

use eframe::egui;

use crate::app::App;

pub(crate) fn show(app: &mut App, ctx: &egui::Context) {
    let Some(loaded) = app.session.loaded.as_ref().filter(|_| app.warnings_open) else { return };
    let mut open = true;
    egui::Window::new(app.texts().warnings)
        .id(egui::Id::unique("warnings"))
        .open(&mut open)
        .default_width(480.0)
        .show(ctx, |ui| {
            let height = ui.text_style_height(&egui::TextStyle::Body);
            let warnings = &loaded.scene.warnings;
            egui::ScrollArea::both().max_height(300.0).show_rows(ui, height, warnings.len(), |ui, rows| {
                for warning in &warnings[rows] {
                    ui.add(egui::Label::new(warning.to_string()).extend());
                }
            });
        });
    app.warnings_open = open;
}
