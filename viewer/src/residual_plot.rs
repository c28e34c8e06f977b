//! How the residual shrinks, on a logarithmic scale.

use eframe::egui::Ui;
use egui_plot::{GridMark, HLine, Line, Plot, PlotPoints, Points};
use radiosity::bake::Solver;

use crate::app::App;

pub(crate) fn show(app: &mut App, ui: &mut Ui) {
    let (texts, language) = (app.texts(), app.language());
    let light = &app.session.light;
    if light.history.is_empty() {
        ui.weak(texts.no_residual);
        return;
    }
    let epsilon = app.session.request.epsilon;
    let points = decades(&light.history);
    let abscissa = if app.session.solver == Solver::Progressive { texts.round } else { texts.sweep };
    let (least, greatest) = points.iter().fold((epsilon.log10(), f64::NEG_INFINITY), |(low, high), point| {
        (low.min(point[1]), high.max(point[1]))
    });
    let residual = texts.residual;
    let history = light.history.clone();
    Plot::new("residual")
        .height(170.0)
        .allow_zoom(false)
        .allow_drag(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .show_x(false)
        .show_y(false)
        .include_x(0.0)
        .include_x(points.len().max(5) as f64)
        .include_y((least - 0.5).floor())
        .include_y((greatest + 0.5).ceil())
        .x_axis_label(abscissa)
        .y_axis_label(residual)
        .y_grid_spacer(|input| {
            let (low, high) = input.bounds;
            let step = (((high - low) / 5.0).ceil() as i64).max(1);
            // Within the plot: a mark beyond it would be written over its neighbours.
            let from = (low / step as f64).ceil() as i64;
            let marks = from..=(high / step as f64).floor() as i64;
            marks.map(|k| GridMark { value: (k * step) as f64, step_size: step as f64 }).collect()
        })
        .y_axis_formatter(|mark, _| format!("1e{}", mark.value.round() as i64))
        .x_axis_formatter(|mark, _| {
            if mark.value >= 0.0 && mark.value.fract() == 0.0 {
                format!("{}", mark.value)
            } else {
                String::new()
            }
        })
        .label_formatter(move |position| {
            let egui_plot::HoverPosition::NearDataPoint { position, .. } = position else { return None };
            let step = position.x.round() as usize;
            let value = history.get(step.checked_sub(1)?)?;
            Some(format!("{abscissa} {}\n{residual} {}", language.count(step), language.number(*value, 3)))
        })
        .show(ui, |plot| {
            plot.hline(HLine::new("ε", epsilon.log10()));
            plot.line(Line::new(residual, PlotPoints::from(points.clone())));
            plot.points(Points::new(residual, PlotPoints::from(points)).radius(2.0));
        });
}

/// (sweep, log10 residual) of each sweep, but for those that have no logarithm.
fn decades(history: &[f64]) -> Vec<[f64; 2]> {
    let numbered = history.iter().enumerate().map(|(index, residual)| [(index + 1) as f64, residual.log10()]);
    numbered.filter(|point| point[1].is_finite()).collect()
}

#[cfg(test)]
mod tests {
    #[test]
    fn nothing_without_a_logarithm_is_drawn() {
        let drawn = super::decades(&[100.0, 0.0, f64::NAN, 1e-3]);
        assert_eq!(drawn, [[1.0, 2.0], [4.0, -3.0]]);
    }
}
