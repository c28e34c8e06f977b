//! The bar at the foot: how far the work is, and what is under the pointer.

use eframe::egui::{self, Align, Layout, ProgressBar, Ui};
use radiosity::bake::Solver;

use crate::action::Action;
use crate::app::App;
use crate::quantities;
use crate::session::Activity;
use crate::worker::Stage;

pub(crate) fn show(app: &mut App, ui: &mut Ui) {
    let (texts, language) = (app.texts(), app.language());
    ui.horizontal(|ui| {
        ui.set_min_height(ui.spacing().interact_size.y);
        let text = what_is_done(app);
        if app.session.is_busy() {
            let paused = matches!(app.session.activity, Activity::Paused(_));
            let label = if paused { texts.resume } else { texts.stop };
            let key = app.key(Action::StopOrResume, ui.ctx());
            let tip = format!("{} ({key})", (texts.action)(Action::StopOrResume).1);
            if ui.button(label).on_hover_text(tip).clicked() {
                app.act(Action::StopOrResume, ui.ctx());
            }
            let (share, left) = app.session.progress();
            let bar = ProgressBar::new(share.unwrap_or(0.0)).desired_width(100.0).desired_height(10.0);
            ui.add(bar);
            if let Some(left) = left.filter(|_| !paused) {
                ui.label((texts.left)(&language.span(left)));
            }
        } else if app.session.activity == Activity::Reading {
            ui.spinner();
        }
        // What is done goes before what is under the pointer, which has the room that is left.
        let most = ui.available_width();
        ui.scope(|ui| {
            ui.set_max_width(most);
            ui.add(egui::Label::new(text).truncate());
        });
        warnings_button(app, ui);
        if let Some(hovered) = under_pointer(app) {
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                ui.add(egui::Label::new(hovered).truncate());
            });
        }
    });
}

fn warnings_button(app: &mut App, ui: &mut Ui) {
    let count = app.session.loaded.as_ref().map_or(0, |loaded| loaded.scene.warnings.len());
    if count > 0 {
        let label = format!("{} ({count})", app.texts().warnings);
        if ui.small_button(label).clicked() {
            app.warnings_open = !app.warnings_open;
        }
    }
}

/// What is being done, or has been, in words.
pub(crate) fn what_is_done(app: &App) -> String {
    let (texts, language, session) = (app.texts(), app.language(), &app.session);
    let stage = |stage: Stage| match stage {
        Stage::Rows { done, total, .. } => (texts.rows)(&language.count(done), &language.count(total)),
        Stage::Sweeps { done, residual, .. } => {
            (texts.sweeps)(&language.count(done), &language.number(residual, 2))
        }
        Stage::Shots { done, residual, rows, total } => (texts.shots)(
            &language.count(done),
            &language.number(residual, 2),
            &language.count(rows),
            &language.count(total),
        ),
        Stage::Looks { done, total } => (texts.looks)(&language.count(done), &language.count(total)),
        Stage::Correction { done, total } => {
            (texts.correction)(&language.count(done), &language.count(total))
        }
    };
    match session.activity {
        Activity::Reading => {
            let name = session.asked_path.as_ref().and_then(|path| path.file_name());
            (texts.reading)(&name.unwrap_or_default().to_string_lossy())
        }
        Activity::Begun => String::new(),
        Activity::At(at) => stage(at),
        Activity::Paused(at) => match at {
            Some(at) => format!("{} · {}", texts.paused, stage(at)),
            None => texts.paused.into(),
        },
        Activity::Done => {
            let light = &session.light;
            let patches = language.count(light.patches.len());
            let steps = language.count(light.iterations);
            let time = language.span(std::time::Duration::from_secs_f64(session.seconds));
            let done = match session.solver {
                Solver::Progressive => (texts.done_shots)(&patches, &steps, &time),
                _ => (texts.done)(&patches, &steps, &time),
            };
            match &light.error {
                Some(error) => {
                    let percent = language.number(100.0 * error.overall.relative, 2);
                    format!("{done}, {}", (texts.within)(&percent))
                }
                None => done,
            }
        }
        Activity::Idle => match &session.loaded {
            Some(loaded) => (texts.ready)(&language.count(loaded.patches.len())),
            None => String::new(),
        },
    }
}

/// The numbers of the patch under the pointer.
fn under_pointer(app: &App) -> Option<String> {
    let (texts, language, light) = (app.texts(), app.language(), &app.session.light);
    let pick = app.hovered.as_ref()?;
    let patch = pick.patch as usize;
    if patch >= light.patches.len() {
        return None;
    }
    let rgb = |value: radiosity::light::Rgb| {
        let [r, g, b] = value.to_array().map(|channel| language.number(channel, 3));
        if r == g && g == b { r } else { format!("{r}  {g}  {b}") }
    };
    let mut text = format!("{} {} · {} {}", texts.patch, pick.patch, texts.object, pick.surface);
    if !pick.front {
        text += &format!(" ({})", texts.seen_from_behind);
    }
    if app.session.lit {
        text += &format!(" · B {}", rgb(light.radiosity[patch]));
        text += &format!(" · H {}", rgb(quantities::irradiance(light, patch)));
    }
    text += &format!(" · ρ {}", rgb(light.patches.reflectance[patch]));
    if let Some(quantities::Column::Number(numbers)) = &app.shown.column
        && let Some(&value) = numbers.get(patch)
    {
        text += &format!(" · {} {}", (texts.quantity)(app.quantity()).0, language.number(value, 4));
    }
    Some(text)
}
