//! The menus and the keys: all that they offer is an [`Action`].

use eframe::egui::{self, Button, Ui};

use crate::action::Action;
use crate::app::App;
use crate::quantities::Quantity;
use crate::session::Activity;

/// The menu bar.
pub(crate) fn bar(app: &mut App, ui: &mut Ui) {
    let texts = app.texts();
    egui::MenuBar::new().ui(ui, |ui| {
        ui.menu_button(texts.menu_file, |ui| {
            item(app, ui, Action::Open);
            recent(app, ui);
            items(app, ui, &[Action::OpenLast, Action::Reload]);
            ui.separator();
            items(app, ui, &[Action::SavePicture, Action::SaveSolution]);
            ui.separator();
            item(app, ui, Action::Quit);
        });
        ui.menu_button(texts.menu_radiosity, |ui| radiosity(app, ui));
        ui.menu_button(texts.menu_show, |ui| {
            items(app, ui, &Quantity::ALL.map(Action::Show));
            ui.separator();
            item(app, ui, Action::FalseColours);
        });
        ui.menu_button(texts.menu_view, |ui| view(app, ui));
        ui.menu_button(texts.menu_panels, |ui| items(app, ui, &Action::PANELS));
        ui.menu_button(texts.menu_language, |ui| items(app, ui, &Action::LANGUAGES));
        ui.menu_button(texts.menu_help, |ui| item(app, ui, Action::Help));
    });
}

/// The menu under the right button.
pub(crate) fn context(app: &mut App, ui: &mut Ui) {
    let texts = app.texts();
    if app.session.loaded.is_none() {
        item(app, ui, Action::Open);
        recent(app, ui);
        return;
    }
    radiosity(app, ui);
    ui.separator();
    ui.menu_button(texts.menu_show, |ui| {
        items(app, ui, &Quantity::ALL.map(Action::Show));
        ui.separator();
        item(app, ui, Action::FalseColours);
    });
    ui.menu_button(texts.menu_view, |ui| view(app, ui));
    ui.separator();
    items(app, ui, &[Action::FrameAll, Action::ResetCamera]);
    ui.separator();
    items(app, ui, &[Action::Open, Action::SavePicture]);
}

fn radiosity(app: &mut App, ui: &mut Ui) {
    let texts = app.texts();
    items(app, ui, &Action::SOLVE);
    ui.separator();
    ui.menu_button(texts.menu_method, |ui| {
        items(app, ui, &Action::METHOD);
        ui.separator();
        items(app, ui, &Action::CORRECTION);
    });
    ui.menu_button(texts.menu_precision, |ui| items(app, ui, &Action::PRECISION));
    ui.menu_button(texts.menu_subdivision, |ui| items(app, ui, &Action::SUBDIVISION));
    ui.separator();
    item(app, ui, Action::ResetMaterials);
}

fn view(app: &mut App, ui: &mut Ui) {
    let texts = app.texts();
    items(app, ui, &Action::CAMERA);
    ui.separator();
    items(app, ui, &Action::DRAWING);
    ui.separator();
    ui.menu_button(texts.menu_exposure, |ui| items(app, ui, &Action::EXPOSURE));
    ui.menu_button(texts.menu_tone, |ui| items(app, ui, &Action::TONE));
}

fn recent(app: &mut App, ui: &mut Ui) {
    let texts = app.texts();
    ui.menu_button(texts.menu_recent, |ui| {
        let mut chosen = None;
        for path in &app.settings.recent {
            let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
            if ui.button(name).on_hover_text(path.display().to_string()).clicked() {
                chosen = Some(path.clone());
            }
        }
        if app.settings.recent.is_empty() {
            ui.weak(texts.no_recent);
        }
        if let Some(path) = chosen {
            app.open(&path);
            ui.close();
        }
    });
}

fn items(app: &mut App, ui: &mut Ui, actions: &[Action]) {
    for &action in actions {
        item(app, ui, action);
    }
}

fn item(app: &mut App, ui: &mut Ui, action: Action) {
    let texts = app.texts();
    let (mut name, tooltip) = (texts.action)(action);
    if action == Action::StopOrResume {
        name = if matches!(app.session.activity, Activity::Paused(_)) { texts.resume } else { texts.stop };
    }
    let key = app.key(action, ui.ctx());
    let mut button = Button::new(name).shortcut_text(key);
    if app.is_on(action) == Some(true) {
        button = button.selected(true);
    }
    let response = ui.add_enabled(app.can(action), button);
    // Beside the menu, where it hides no other item.
    let mut tip = egui::Tooltip::for_enabled(&response);
    if !response.enabled() {
        tip = egui::Tooltip::for_disabled(&response);
    }
    tip.popup =
        tip.popup.align(egui::RectAlign::RIGHT).align_alternatives(&[egui::RectAlign::LEFT]).gap(12.0);
    tip.show(|ui| ui.label(tooltip));
    if response.clicked() {
        app.act(action, ui.ctx());
        ui.close();
    }
}

/// Actions whose key was pressed.
pub(crate) fn keys(app: &mut App, ctx: &egui::Context) {
    if ctx.text_edit_focused() {
        return;
    }
    for action in Action::all() {
        // The view looks for these itself: what they frame depends on what is chosen.
        if matches!(action, Action::FrameAll | Action::ResetCamera) {
            continue;
        }
        let shortcut = action.shortcut();
        let pressed = ctx.input_mut(|input| {
            let anew = input.events.iter().any(|event| {
                matches!(event, egui::Event::Key { key, pressed: true, repeat, .. }
                    if *key == shortcut.logical_key && (!repeat || action.repeats()))
            });
            anew && input.modifiers.matches_exact(shortcut.modifiers) && input.consume_shortcut(&shortcut)
        });
        if pressed {
            app.act(action, ctx);
        }
    }
}
