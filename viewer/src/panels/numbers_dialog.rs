//! Asking for another precision or subdivision factor.

use eframe::egui;
use radiosity::form_factors::hemicube::PRECISIONS;

use crate::app::App;

/// The question, and what is typed.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct NumbersDialog {
    of: Of,
    typed: String,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Of {
    Precision,
    Subdivision,
}

/// An answer that makes sense.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Answer {
    Precision(u32),
    Subdivision(f64),
}

impl NumbersDialog {
    pub(crate) fn precision(now: u32) -> Self {
        Self { of: Of::Precision, typed: now.to_string() }
    }

    pub(crate) fn subdivision(now: f64) -> Self {
        Self { of: Of::Subdivision, typed: now.to_string() }
    }

    fn answer(&self, parse: impl Fn(&str) -> Option<f64>) -> Option<Answer> {
        let number = parse(&self.typed)?;
        match self.of {
            Of::Precision => {
                let whole = number as u32;
                let right =
                    f64::from(whole) == number && PRECISIONS.contains(&whole) && whole.is_multiple_of(2);
                right.then_some(Answer::Precision(whole))
            }
            Of::Subdivision => (number.is_finite() && number > 0.0).then_some(Answer::Subdivision(number)),
        }
    }
}

pub(crate) fn show(app: &mut App, ctx: &egui::Context) {
    let (texts, language) = (app.texts(), app.language());
    let Some(dialog) = &mut app.numbers else { return };
    let (title, tip) = match dialog.of {
        Of::Precision => (texts.other_precision, texts.precision_even),
        Of::Subdivision => {
            (texts.other_subdivision, (texts.action)(crate::action::Action::SubdivisionOther).1)
        }
    };
    let mut decided = None;
    let modal = egui::Modal::new(egui::Id::unique("numbers")).show(ctx, |ui| {
        ui.set_max_width(280.0);
        let label = ui.strong(title).id;
        ui.label(tip);
        let field =
            ui.add(egui::TextEdit::singleline(&mut dialog.typed).desired_width(120.0)).labelled_by(label);
        let answer = dialog.answer(|typed| language.parse(typed));
        let entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        if !field.has_focus() && !entered {
            field.request_focus();
        }
        ui.horizontal(|ui| {
            if ui.add_enabled(answer.is_some(), egui::Button::new(texts.ok)).clicked()
                || (entered && answer.is_some())
            {
                decided = Some(answer);
            }
            if ui.button(texts.cancel).clicked() {
                decided = Some(None);
            }
        });
    });
    if modal.should_close() {
        decided = decided.or(Some(None));
    }
    if let Some(answer) = decided {
        app.numbers = None;
        match answer {
            Some(Answer::Precision(precision)) => app.set_precision(precision),
            Some(Answer::Subdivision(factor)) => app.session.set_subdivision(factor),
            None => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::Language;

    #[test]
    fn only_what_makes_sense_is_taken() {
        let parse = |typed: &str| Language::French.parse(typed);
        let precision = |typed: &str| NumbersDialog { of: Of::Precision, typed: typed.into() }.answer(parse);
        assert_eq!(precision("64"), Some(Answer::Precision(64)));
        for wrong in ["", "31", "0", "-2", "1e9", "64.5", "NaN", "x"] {
            assert_eq!(precision(wrong), None, "{wrong}");
        }
        let factor = |typed: &str| NumbersDialog { of: Of::Subdivision, typed: typed.into() }.answer(parse);
        assert_eq!(factor("1,5"), Some(Answer::Subdivision(1.5)));
        for wrong in ["0", "-1", "inf", "NaN", ""] {
            assert_eq!(factor(wrong), None, "{wrong}");
        }
    }
}
