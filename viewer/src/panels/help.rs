//! Every key.

use eframe::egui::{self, Grid, RichText};

use crate::action::Action;
use crate::app::App;

pub(crate) fn show(app: &mut App, ctx: &egui::Context) {
    if !app.help {
        return;
    }
    let texts = app.texts();
    let mut open = true;
    let screen = ctx.content_rect();
    egui::Window::new(texts.keys)
        .id(egui::Id::unique("help"))
        .open(&mut open)
        .default_width(520.0_f32.min(screen.width() - 32.0))
        .max_width((screen.width() - 32.0).max(100.0))
        .max_height((screen.height() - 96.0).max(60.0))
        .show(ctx, |ui| {
            egui::ScrollArea::both().show(ui, |ui| {
                Grid::new("keys").num_columns(2).striped(true).show(ui, |ui| {
                    for (gesture, what) in texts.mouse {
                        ui.label(RichText::new(*gesture).strong());
                        ui.label(*what);
                        ui.end_row();
                    }
                    for action in Action::all() {
                        let (name, tooltip) = (texts.action)(action);
                        ui.label(RichText::new(app.key(action, ui.ctx())).strong());
                        ui.label(name).on_hover_text(tooltip);
                        ui.end_row();
                    }
                });
            });
        });
    app.help = open && !ctx.input(|input| input.key_pressed(egui::Key::Escape));
}
