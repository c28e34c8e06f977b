//! Error against time as a picture, both axes logarithmic.

use std::fmt::Write as _;

use super::convergence::{Point, methods};

const SIZE: [f64; 2] = [640.0, 400.0];
/// Left, right, above, below.
const MARGINS: [f64; 4] = [64.0, 150.0, 16.0, 48.0];
/// Told apart by colour-blind eyes, too (Okabe & Ito).
const COLOURS: [&str; 7] = ["#56b4e9", "#0072b2", "#009e73", "#cc79a7", "#cc79a7", "#d55e00", "#d55e00"];

/// Labels nearer than this, across and down, would stand on one another.
const LABEL: [f64; 2] = [130.0, 15.0];

/// An SVG of one line a method.
pub(super) fn svg(points: &[Point]) -> String {
    let range = |of: fn(&Point) -> f64| {
        let logarithms = || points.iter().map(|point| of(point).max(1e-9).log10());
        let (low, high) =
            logarithms().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        (low.floor(), high.ceil().max(low.floor() + 1.0))
    };
    let (seconds, errors) = (range(|point| point.seconds), range(|point| point.error));
    let [left, right, above, below] = MARGINS;
    let (width, height) = (SIZE[0] - left - right, SIZE[1] - above - below);
    let x = |value: f64| left + width * (value.max(1e-9).log10() - seconds.0) / (seconds.1 - seconds.0);
    let y = |value: f64| above + height * (errors.1 - value.max(1e-9).log10()) / (errors.1 - errors.0);

    let [w, h] = SIZE;
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w} {h}\" font-family=\"sans-serif\" font-size=\"13\">\n\
         <rect width=\"{w}\" height=\"{h}\" fill=\"white\"/>\n"
    );
    let mut line = |x1: f64, y1: f64, x2: f64, y2: f64| {
        let _ = writeln!(text, "<path d=\"M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}\" stroke=\"#ddd\"/>");
    };
    for decade in seconds.0 as i32..=seconds.1 as i32 {
        let at = x(10_f64.powi(decade));
        line(at, above, at, above + height);
    }
    for decade in errors.0 as i32..=errors.1 as i32 {
        let at = y(10_f64.powi(decade));
        line(left, at, left + width, at);
    }
    for decade in seconds.0 as i32..=seconds.1 as i32 {
        let (at, value) = (x(10_f64.powi(decade)), 10_f64.powi(decade));
        let _ = writeln!(
            text,
            "<text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{value} s</text>",
            h - below + 18.0
        );
    }
    for decade in errors.0 as i32..=errors.1 as i32 {
        let (at, value) = (y(10_f64.powi(decade)) + 4.0, 10_f64.powi(decade + 2));
        let _ = writeln!(
            text,
            "<text x=\"{:.1}\" y=\"{at:.1}\" text-anchor=\"end\">{value} %</text>",
            left - 8.0
        );
    }
    let _ = writeln!(
        text,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">processor time</text>",
        left + width / 2.0,
        h - 8.0
    );

    let mut labels: Vec<(f64, f64, String)> = Vec::new();
    for (number, ((name, request), colour)) in methods().into_iter().zip(COLOURS).enumerate() {
        let own: Vec<&Point> = points.iter().filter(|point| point.method == number).collect();
        let places: Vec<String> =
            own.iter().map(|point| format!("{:.1} {:.1}", x(point.seconds), y(point.error))).collect();
        let Some(last) = own.last() else { continue };
        let _ = writeln!(
            text,
            "<path d=\"M{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"{}/>",
            places.join("L"),
            if request.correct { " stroke-dasharray=\"6 4\"" } else { "" }
        );
        for point in &own {
            let _ = writeln!(
                text,
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"3.5\" fill=\"{colour}\"/>",
                x(point.seconds),
                y(point.error)
            );
        }
        let label = format!("fill=\"{colour}\">{name}");
        labels.push((x(last.seconds) + 8.0, y(last.error) + 4.0, label));
    }
    labels.sort_by(|one, other| one.1.total_cmp(&other.1));
    for k in 0..labels.len() {
        let (above, rest) = labels.split_at_mut(k);
        let (x, y, label) = &mut rest[0];
        for (_, higher, _) in above.iter().filter(|(beside, ..)| (beside - *x).abs() < LABEL[0]) {
            *y = y.max(higher + LABEL[1]);
        }
        let _ = writeln!(text, "<text x=\"{x:.1}\" y=\"{y:.1}\" {label}</text>");
    }
    text + "</svg>\n"
}
