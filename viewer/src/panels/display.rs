//! What is shown on the surfaces, and how.

use eframe::egui::{self, ComboBox, Slider, Ui};
use radiosity::shade::ToneCurve;

use super::drag;
use crate::action::Action;
use crate::app::App;
use crate::language::Texts;
use crate::quantities::Quantity;
use crate::view3d::{BackFaceStyle, ColourMap};

pub(crate) fn show(app: &mut App, ui: &mut Ui) {
    let (texts, language) = (app.texts(), app.language());
    let (name, hint) = (texts.quantity)(app.quantity());
    let label = ui.label(texts.quantity_label).id;
    let list = ComboBox::from_id_salt("quantity").width(ui.available_width() - 8.0).height(400.0);
    let list = list.selected_text(name).show_ui(ui, |ui| {
        for quantity in Quantity::ALL {
            let (name, hint) = (texts.quantity)(quantity);
            let chosen = ui.selectable_label(app.quantity() == quantity, name).on_hover_text(hint);
            if chosen.clicked() {
                app.act(Action::Show(quantity), ui.ctx());
            }
        }
    });
    list.response.labelled_by(label);
    ui.weak(hint);
    if app.quantity() == Quantity::FormFactors && app.session.selected.is_none() {
        ui.label(texts.click_a_patch);
    }
    ui.add_space(6.0);

    check(app, ui, Action::FalseColours, app.quantity().is_colour());
    if app.false_colours() {
        ui.indent("scale", |ui| scale(app, ui));
    } else if app.quantity().is_light() {
        ui.add_space(6.0);
        exposure(app, ui);
    }
    ui.add_space(6.0);
    for action in [Action::Smooth, Action::Edges, Action::Wireframe, Action::Normals] {
        check(app, ui, action, true);
    }
    ui.horizontal(|ui| {
        let label = ui.label(texts.back_faces).id;
        let list = ComboBox::from_id_salt("back faces")
            .width(90.0)
            .selected_text(back_faces(texts, app.back_faces))
            .show_ui(ui, |ui| {
                for style in BackFaceStyle::ALL {
                    ui.selectable_value(&mut app.back_faces, style, back_faces(texts, style));
                }
            });
        list.response.labelled_by(label);
    });
    let mut angle = app.view.field_of_view();
    if app.session.loaded.is_some() {
        ui.horizontal(|ui| {
            let label = ui.label(texts.field_of_view).id;
            let value = egui::DragValue::new(&mut angle)
                .range(5.0..=150.0)
                .speed(0.3)
                .custom_formatter(move |value, _| format!("{}°", language.fixed(value, 0)))
                .custom_parser(move |typed| language.parse(typed.trim_end_matches('°')));
            if ui.add(value).labelled_by(label).changed() {
                app.view.set_field_of_view(angle);
            }
        });
    }
}

fn back_faces(texts: &Texts, style: BackFaceStyle) -> &'static str {
    match style {
        BackFaceStyle::Lit => texts.back_faces_lit,
        BackFaceStyle::Black => texts.back_faces_black,
        BackFaceStyle::Marked => texts.back_faces_marked,
        BackFaceStyle::Culled => texts.back_faces_hidden,
    }
}

/// A box that stands for an action.
fn check(app: &mut App, ui: &mut Ui, action: Action, enabled: bool) {
    let (name, tooltip) = (app.texts().action)(action);
    let key = app.key(action, ui.ctx());
    let mut on = app.is_on(action).unwrap_or(false);
    let tooltip = if enabled { tooltip } else { app.texts().only_false_colours };
    let box_ = ui.add_enabled(enabled, egui::Checkbox::new(&mut on, name));
    let tip = format!("{tooltip} ({key})");
    if box_.on_hover_text(&tip).on_disabled_hover_text(tip).clicked() {
        app.act(action, ui.ctx());
    }
}

fn scale(app: &mut App, ui: &mut Ui) {
    let (texts, language) = (app.texts(), app.language());
    let map_name = |map: ColourMap| (texts.colour_map_name)(map.name());
    ui.horizontal(|ui| {
        let label = ui.label(texts.colour_map).id;
        let list = ComboBox::from_id_salt("colours").width(90.0).selected_text(map_name(app.colour_map()));
        let list = list.show_ui(ui, |ui| {
            for (index, map) in ColourMap::ALL.into_iter().enumerate() {
                if ui.selectable_label(app.colour_map() == map, map_name(map)).clicked() {
                    app.settings.drawing.colour_map = index;
                    app.refresh();
                }
            }
        });
        list.response.labelled_by(label);
    });
    if app.quantity() != Quantity::Closure
        && ui.checkbox(&mut app.settings.drawing.logarithmic, texts.logarithmic).changed()
    {
        app.fixed_range = None;
        app.refresh();
    }
    let mut fixed = app.fixed_range.is_some();
    if ui.checkbox(&mut fixed, texts.fixed_range).changed() {
        let now = app.shown.scale.map_or([0.0, 1.0], |scale| scale.range);
        app.fixed_range = fixed.then_some(now);
        app.refresh();
    }
    if let Some(mut range) = app.fixed_range {
        ui.horizontal_wrapped(|ui| {
            let speed = ((range[1] - range[0]).abs() * 0.01).max(1e-9);
            let from = ui.label(texts.from).id;
            let mut changed = ui.add(drag(language, &mut range[0]).speed(speed)).labelled_by(from).changed();
            let to = ui.label(texts.to).id;
            changed |= ui.add(drag(language, &mut range[1]).speed(speed)).labelled_by(to).changed();
            if changed {
                app.fixed_range = Some(range);
                app.refresh();
            }
        });
    }
    ui.weak((texts.unit)(app.quantity().unit()));
}

fn exposure(app: &mut App, ui: &mut Ui) {
    let (texts, language) = (app.texts(), app.language());
    ui.horizontal(|ui| {
        ui.label(texts.exposure);
        check(app, ui, Action::AutoExposure, true);
    });
    let hint = texts.exposure;
    let slider = Slider::new(&mut app.exposure, -10.0..=10.0)
        .clamping(egui::SliderClamping::Edits)
        .custom_formatter(move |value, _| language.fixed(value, 1))
        .custom_parser(move |typed| language.parse(typed))
        .text(texts.stops);
    if ui.add(slider).on_hover_text(hint).changed() {
        app.automatic_exposure = false;
    }
    let tones = [Action::ToneNeutral, Action::ToneReinhard, Action::ToneLinear];
    let now = ToneCurve::ALL.iter().position(|tone| *tone == app.tone()).unwrap_or(0);
    let label = ui.label(texts.tone).id;
    let list = ComboBox::from_id_salt("tone").width(ui.available_width() - 8.0);
    let list = list.selected_text((texts.action)(tones[now]).0).show_ui(ui, |ui| {
        for (index, action) in tones.into_iter().enumerate() {
            let (name, tip) = (texts.action)(action);
            if ui.selectable_label(index == now, name).on_hover_text(tip).clicked() {
                app.act(action, ui.ctx());
            }
        }
    });
    list.response.labelled_by(label);
}
