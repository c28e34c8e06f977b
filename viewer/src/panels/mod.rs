//! What stands about the view.

pub(crate) mod display;
pub(crate) mod help;
pub(crate) mod legend;
pub(crate) mod materials;
pub(crate) mod numbers_dialog;
pub(crate) mod patch;
pub(crate) mod picture_dialog;
pub(crate) mod status;
pub(crate) mod trouble;
pub(crate) mod warnings;

use eframe::egui::{self, Align2, Color32, Rect, ScrollArea, TextStyle, Ui};

use crate::action::Action;
use crate::app::App;
use crate::language::Language;
use crate::residual_plot;

/// Narrower than this, the view would be left with too little: panels wait until there is room.
const LEAST_VIEW: f32 = 240.0;
const LEFT: f32 = 250.0;
const RIGHT: f32 = 300.0;

/// The panels to the left and to the right.
pub(crate) fn sides(app: &mut App, ui: &mut Ui) {
    let panels = app.settings.panels;
    let width = ui.available_width();
    if (panels.display || panels.materials) && width > LEAST_VIEW + LEFT {
        egui::Panel::left("left").resizable(true).default_size(LEFT).size_range(200.0..=420.0).show(
            ui,
            |ui| {
                ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                    if panels.display {
                        section(app, ui, Action::DisplayPanel, app.texts().panel_display, display::show);
                    }
                    if panels.materials {
                        section(
                            app,
                            ui,
                            Action::MaterialsPanel,
                            app.texts().panel_materials,
                            materials::show,
                        );
                    }
                });
            },
        );
    }
    let width = ui.available_width();
    if (panels.patch || panels.hemicube || panels.residual) && width > LEAST_VIEW + RIGHT {
        egui::Panel::right("right").resizable(true).default_size(RIGHT).size_range(240.0..=700.0).show(
            ui,
            |ui| {
                ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                    if panels.patch {
                        section(app, ui, Action::PatchPanel, app.texts().panel_patch, patch::show);
                    }
                    if panels.hemicube {
                        section(
                            app,
                            ui,
                            Action::HemicubePanel,
                            app.texts().panel_hemicube,
                            crate::hemicube_panel::show,
                        );
                    }
                    if panels.residual {
                        section(
                            app,
                            ui,
                            Action::ResidualPanel,
                            app.texts().panel_residual,
                            residual_plot::show,
                        );
                    }
                });
            },
        );
    }
}

/// A titled part of a panel, with a cross to close it.
fn section(app: &mut App, ui: &mut Ui, action: Action, title: &str, content: fn(&mut App, &mut Ui)) {
    ui.add_space(4.0);
    ui.horizontal(|ui| {
        ui.strong(title);
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            let key = app.key(action, ui.ctx());
            let hint = format!("{} ({key})", app.texts().close);
            if ui.small_button("×").on_hover_text(hint).clicked() {
                app.act(action, ui.ctx());
            }
        });
    });
    ui.separator();
    ui.push_id(title, |ui| content(app, ui));
    ui.add_space(8.0);
}

/// What stands where no scene is open.
pub(crate) fn welcome(app: &App, ui: &Ui, area: Rect) {
    let texts = app.texts();
    let painter = ui.painter();
    let wide = area.width() - 24.0;
    let big = painter.layout(
        texts.welcome.into(),
        TextStyle::Heading.resolve(ui.style()),
        Color32::from_gray(220),
        wide,
    );
    let small = painter.layout(
        texts.welcome_how.into(),
        TextStyle::Body.resolve(ui.style()),
        Color32::from_gray(160),
        wide,
    );
    let top = area.center().y - (big.size().y + small.size().y) / 2.0;
    let at = |size: egui::Vec2, y: f32| egui::pos2(area.center().x - size.x / 2.0, y);
    let (big_size, small_size) = (big.size(), small.size());
    painter.galley(at(big_size, top), big, Color32::WHITE);
    painter.galley(at(small_size, top + big_size.y + 8.0), small, Color32::WHITE);
}

/// A number to drag or type, in the language's own way.
pub(crate) fn drag<'a>(language: Language, value: &'a mut f64) -> egui::DragValue<'a> {
    egui::DragValue::new(value)
        .custom_formatter(move |value, _| language.number(value, 4))
        .custom_parser(move |typed| language.parse(typed))
}

/// Text over the view, on a shade that keeps it readable in any light.
fn over_view(painter: &egui::Painter, at: egui::Pos2, align: Align2, text: &str, font: egui::FontId) {
    let text = painter.layout_no_wrap(text.to_owned(), font, Color32::WHITE);
    let area = align.anchor_size(at, text.size());
    painter.rect_filled(area.expand2(egui::vec2(4.0, 1.0)), 3.0, Color32::from_black_alpha(150));
    painter.galley(area.min, text, Color32::WHITE);
}
