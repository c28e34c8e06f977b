//! The hemicube of the patch that was clicked upon: its five faces unfolded to a cross, by what each cell sees and by
//! what it weighs.

use eframe::egui::{self, Color32, ColorImage, Rect, Sense, TextureHandle, TextureOptions, Ui, pos2, vec2};
use radiosity::form_factors::hemicube::{CellWeights, Face};

use crate::app::App;
use crate::view3d::ColourMap;
use crate::worker::Inspection;

/// The two pictures, kept until something changes.
#[derive(Default)]
pub(crate) struct HemicubePanel {
    pictures: Option<[TextureHandle; 2]>,
}

impl HemicubePanel {
    /// What is seen, or its colours, have changed.
    pub(crate) fn forget(&mut self) {
        self.pictures = None;
    }
}

/// The cell at a pixel of the cross, (0, 0) at the top left, which is 2N by 2N: the top face in the middle, the sides
/// about it with the horizon outermost. It is laid out as the patch sees it: what the patch has on its left is left.
pub(crate) fn cell_at(precision: usize, x: usize, y: usize) -> Option<(Face, usize, usize)> {
    let (n, half) = (precision, precision / 2);
    if x >= 2 * n || y >= 2 * n {
        return None;
    }
    // Seen from below the V1 axis runs to the left; pictures count rows from the top.
    let (across, up) = (2 * n - 1 - x, 2 * n - 1 - y);
    let middle = half..half + n;
    match (middle.contains(&across), middle.contains(&up)) {
        (true, true) => Some((Face::Top, across - half, up - half)),
        // The sides' rows are counted from the horizon.
        (false, true) if across >= half + n => Some((Face::Right, up - half, 2 * n - 1 - across)),
        (false, true) => Some((Face::Left, up - half, across)),
        (true, false) if up >= half + n => Some((Face::Back, across - half, 2 * n - 1 - up)),
        (true, false) => Some((Face::Front, across - half, up)),
        (false, false) => None,
    }
}

/// A cell's weight.
fn weight(weights: &CellWeights, face: Face, x: usize, y: usize) -> f64 {
    if face == Face::Top { weights.top(x, y) } else { weights.side(x, y) }
}

/// What a cell sees.
fn seen(inspection: &Inspection, face: Face, x: usize, y: usize) -> Option<u32> {
    let index = Face::ALL.iter().position(|other| *other == face)?;
    *inspection.faces[index].get(y * inspection.weights.precision() + x)?
}

pub(crate) fn show(app: &mut App, ui: &mut Ui) {
    let texts = app.texts();
    let Some(inspection) = app.session.inspection.take() else {
        ui.weak(texts.click_a_patch);
        return;
    };
    let mut panel = std::mem::take(&mut app.hemicube);
    let [sees, weighs] = panel.pictures.get_or_insert_with(|| paint(app, &inspection, ui.ctx()));
    let width = ui.available_width();
    // Side by side where there is room.
    let beside = width > 440.0;
    let side = if beside { (width - 12.0) / 2.0 } else { width.min(360.0) }.max(1.0);
    let mut chosen = None;
    let mut cross = |ui: &mut Ui, title: &str, picture: &TextureHandle| {
        ui.vertical(|ui| {
            ui.label(title);
            let (area, response) = ui.allocate_exact_size(vec2(side, side), Sense::click());
            let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
            ui.painter().image(picture.id(), area, whole, Color32::WHITE);
            if let Some(at) = response.hover_pos() {
                chosen = hover(app, ui, &response, &inspection, area, at).or(chosen);
            }
        });
    };
    if beside {
        ui.horizontal(|ui| {
            cross(ui, texts.cells_see, sees);
            cross(ui, texts.cells_weigh, weighs);
        });
    } else {
        cross(ui, texts.cells_see, sees);
        cross(ui, texts.cells_weigh, weighs);
    }
    app.hemicube = panel;
    app.session.inspection = Some(inspection);
    if chosen.is_some() {
        app.session.select(chosen);
    }
}

/// Tell of the cell under the pointer; the patch, if it was clicked upon.
fn hover(
    app: &App,
    ui: &Ui,
    response: &egui::Response,
    inspection: &Inspection,
    area: Rect,
    at: egui::Pos2,
) -> Option<u32> {
    let (texts, language) = (app.texts(), app.language());
    let precision = inspection.weights.precision();
    let cells = 2.0 * precision as f32;
    let place = (at - area.min) / area.size() * cells;
    let (face, x, y) = cell_at(precision, place.x.max(0.0) as usize, place.y.max(0.0) as usize)?;
    let weight = language.number(weight(&inspection.weights, face, x, y), 4);
    let patch = seen(inspection, face, x, y);
    let text = match patch {
        Some(patch) => (texts.cell)(&patch.to_string(), &weight),
        None => (texts.cell_empty)(&weight),
    };
    let cell = Rect::from_min_size(
        area.min + vec2(place.x.floor(), place.y.floor()) / cells * area.size(),
        area.size() / cells,
    );
    ui.painter().rect_stroke(cell, 0.0, (1.5, Color32::WHITE), egui::StrokeKind::Outside);
    response.clone().on_hover_text_at_pointer(text);
    patch.filter(|_| response.clicked())
}

fn paint(app: &App, inspection: &Inspection, ctx: &egui::Context) -> [TextureHandle; 2] {
    let weights = &inspection.weights;
    let precision = weights.precision();
    let n = precision;
    let greatest = weights.top(n / 2, n / 2).max(f64::MIN_POSITIVE);
    let nowhere = Color32::TRANSPARENT;
    let nothing = Color32::from_gray(20);
    // The colour of each patch is found once.
    let mut colours = std::collections::HashMap::new();
    let mut colour = |patch: u32| *colours.entry(patch).or_insert_with(|| app.patch_colour(patch));
    let cells = || (0..2 * n).flat_map(|y| (0..2 * n).map(move |x| (x, y)));
    let sees = cells().map(|(x, y)| match cell_at(n, x, y) {
        Some((face, x, y)) => seen(inspection, face, x, y).map_or(nothing, &mut colour),
        None => nowhere,
    });
    let sees: Vec<Color32> = sees.collect();
    let weighs = cells().map(|(x, y)| match cell_at(n, x, y) {
        Some((face, x, y)) => {
            let [r, g, b] = ColourMap::default().rgb((weight(weights, face, x, y) / greatest) as f32);
            Color32::from_rgb(r, g, b)
        }
        None => nowhere,
    });
    let weighs: Vec<Color32> = weighs.collect();
    // Where cells are larger than pixels they are to be seen as cells.
    let options = TextureOptions { magnification: egui::TextureFilter::Nearest, ..TextureOptions::LINEAR };
    let texture = |name: &str, pixels| {
        let image = ColorImage::new([2 * n, 2 * n], pixels);
        ctx.load_texture(name, image, options)
    };
    [texture("hemicube sees", sees), texture("hemicube weighs", weighs)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cross_holds_every_cell_once() {
        let n = 6;
        let mut cells = std::collections::HashSet::new();
        for y in 0..2 * n {
            for x in 0..2 * n {
                if let Some((face, column, row)) = cell_at(n, x, y) {
                    let height = if face == Face::Top { n } else { n / 2 };
                    assert!(column < n && row < height, "{face:?} {column} {row}");
                    assert!(cells.insert((format!("{face:?}"), column, row)));
                }
            }
        }
        assert_eq!(cells.len(), n * n + 4 * n * n / 2);
    }

    #[test]
    fn neighbours_on_the_cross_are_neighbours_on_the_hemicube() {
        // Across each fold from the top face to a side lies the side's highest row, at the same place along the fold.
        let n = 8;
        let (half, end) = (n / 2, n / 2 + n);
        for k in half..end {
            for ((x, y), (beside_x, beside_y)) in [
                ((half, k), (half - 1, k)),
                ((end - 1, k), (end, k)),
                ((k, half), (k, half - 1)),
                ((k, end - 1), (k, end)),
            ] {
                let Some((Face::Top, column, row)) = cell_at(n, x, y) else { panic!("top") };
                let Some((face, along, height)) = cell_at(n, beside_x, beside_y) else { panic!("side") };
                assert_eq!(height, half - 1, "{face:?}");
                let fold = if matches!(face, Face::Right | Face::Left) { row } else { column };
                assert_eq!(along, fold, "{face:?}");
            }
        }
    }
}
