//! The scale of false colours, over the view.

use eframe::egui::{self, Align2, Color32, Rect, TextStyle, Ui, pos2, vec2};

use super::over_view;
use crate::app::{App, Scale};
use crate::quantities::{place_in, ticks};

/// Paint the scale at the right edge of `area`.
pub(crate) fn paint(app: &App, ui: &Ui, area: Rect) {
    let (texts, language) = (app.texts(), app.language());
    let font = egui::FontId::new(11.5, TextStyle::Body.resolve(ui.style()).family);
    let (name, _) = (texts.quantity)(app.quantity());
    let painter = ui.painter().with_clip_rect(area);
    let Some(Scale { range, logarithmic, beyond }) = app.shown.scale else {
        over_view(&painter, area.left_bottom() + vec2(10.0, -8.0), Align2::LEFT_BOTTOM, name, font);
        return;
    };
    let height = (area.height() - 90.0).clamp(40.0, 260.0);
    let bar =
        Rect::from_min_size(pos2(area.right() - 28.0, area.center().y - height / 2.0), vec2(14.0, height));
    let steps = height.round() as usize;
    for step in 0..steps {
        let t = 1.0 - (step as f32 + 0.5) / steps as f32;
        let [r, g, b] = app.colour_map().rgb(t);
        let top = bar.top() + bar.height() * step as f32 / steps as f32;
        let slice =
            Rect::from_min_size(pos2(bar.left(), top), vec2(bar.width(), bar.height() / steps as f32 + 0.5));
        painter.rect_filled(slice, 0.0, Color32::from_rgb(r, g, b));
    }
    painter.rect_stroke(bar, 0.0, egui::Stroke::new(1.0, Color32::from_gray(200)), egui::StrokeKind::Outside);

    let label = |sign: &str, value: f64, y: f32| {
        painter.line_segment([pos2(bar.left() - 4.0, y), pos2(bar.left(), y)], (1.0, Color32::WHITE));
        over_view(
            &painter,
            pos2(bar.left() - 7.0, y),
            Align2::RIGHT_CENTER,
            &format!("{sign}{}", language.number(value, 4)),
            font.clone(),
        );
    };
    let y_of = |value: f64| bar.bottom() - bar.height() * place_in(range, logarithmic, value);
    let line = font.size + 6.0;
    // The ends say what they are; between them, round numbers that do not touch them.
    label(if beyond[0] { "≤ " } else { "" }, range[0], bar.bottom());
    label(if beyond[1] { "≥ " } else { "" }, range[1], bar.top());
    let mut last = bar.bottom();
    for tick in ticks(range, logarithmic, (height / 40.0) as usize) {
        let y = y_of(tick);
        if last - y >= line && y - bar.top() >= line {
            label("", tick, y);
            last = y;
        }
    }
    let right = bar.right() + 2.0;
    over_view(&painter, pos2(right, bar.top() - 14.0 - line), Align2::RIGHT_BOTTOM, name, font.clone());
    let unit = (texts.unit)(app.quantity().unit());
    over_view(&painter, pos2(right, bar.top() - 10.0), Align2::RIGHT_BOTTOM, unit, font);
}
