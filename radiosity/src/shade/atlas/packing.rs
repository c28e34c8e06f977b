//! How large each chart is in the texture, and where it lies.

use glam::DVec2;
use guillotiere::{SimpleAtlasAllocator, size2};

use super::charts::FlatChart;
use super::{AtlasError, MAX_ATLAS_SIDE, PADDING};

/// A chart's texels, without the padding about them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    /// First column and row.
    pub(super) first: [u32; 2],
    /// How many.
    pub(super) texels: [u32; 2],
}

impl Place {
    /// Texels with the padding.
    pub(super) fn padded(&self) -> [u32; 2] {
        self.texels.map(|side| side + 2 * PADDING)
    }

    /// Where a point of a chart lies. \[texels from the corner of the atlas; a texel's centre is half a texel in\]
    ///
    /// A grid's border is that of its outermost texels. Any other chart reaches from the centre of the first to that of
    /// the last: straight borders then are filtered from texels that lie on them.
    pub(super) fn texel(&self, chart: &FlatChart, point: DVec2) -> DVec2 {
        let inset = if chart.cells.is_some() { 0.0 } else { 0.5 };
        let along = |k: usize| {
            let share = if chart.extent[k] > 0.0 { point[k] / chart.extent[k] } else { 0.0 };
            f64::from(self.first[k]) + inset + share * (f64::from(self.texels[k]) - 2.0 * inset)
        };
        DVec2::new(along(0), along(1))
    }
}

/// All charts with their places.
pub(super) struct Packed {
    pub(super) places: Vec<Place>,
    /// Columns and rows of the atlas.
    pub(super) size: [u32; 2],
    /// Texels a unit of length.
    pub(super) density: f64,
}

/// Pack `charts` into at most `side` x `side` texels, with as many a unit of length as fit.
pub(super) fn pack(charts: &[FlatChart], side: u32) -> Result<Packed, AtlasError> {
    let sizes = |density: f64| charts.iter().map(|chart| texels(chart, density)).collect::<Vec<_>>();
    let fewest = sizes(0.0);
    let Some(mut places) = placed(&fewest, side) else { return Err(too_many(&fewest, side)) };
    // Four times what would fill the atlas without a gap, or its side with the longest; then halves.
    let area: f64 = charts.iter().map(|chart| chart.extent.x * chart.extent.y).sum();
    let longest = charts.iter().map(longest).fold(0.0, f64::max);
    let (mut low, mut high) = (0.0, 4.0 * f64::from(side) / longest.max(area.sqrt()).max(f64::MIN_POSITIVE));
    for step in 0..20 {
        let density = if step == 0 { high } else { (low + high) / 2.0 };
        match placed(&sizes(density), side) {
            Some(found) => (places, low) = (found, density),
            None => high = density,
        }
        if low == high {
            break;
        }
    }
    let end = |k: usize| places.iter().map(|p| p.first[k] + p.texels[k] + PADDING).max().unwrap_or(1);
    Ok(Packed { size: [end(0), end(1)], places, density: low })
}

/// The longer of a chart's sides along which it has more than a texel.
fn longest(chart: &FlatChart) -> f64 {
    let varies = |k: &usize| chart.cells.is_none_or(|cells| cells[*k] > 1);
    (0..2).filter(varies).map(|k| chart.extent[k]).fold(0.0, f64::max)
}

/// Columns and rows of a chart at so many texels a unit of length.
fn texels(chart: &FlatChart, density: f64) -> [u32; 2] {
    std::array::from_fn(|k| {
        // What is wider than any atlas is refused by the packer.
        let wanted = (chart.extent[k] * density).min(f64::from(2 * MAX_ATLAS_SIDE));
        match chart.cells.map(|cells| cells[k]) {
            // Shading is constant along it.
            Some(1) => 1,
            // An odd number a cell, so that its centre, where the shading bends, is a texel's.
            Some(cells) if wanted >= f64::from(cells) => {
                let each = (wanted / f64::from(cells)) as u32;
                cells * (each - (each + 1) % 2)
            }
            Some(_) => (wanted.round() as u32).max(1),
            None => (wanted.round() as u32).max(1) + 1,
        }
    })
}

/// By what charts of a size come before others.
type Greatness = fn([u32; 2]) -> (u32, u32);

/// Where charts of these sizes lie, if they fit one way or another.
fn placed(sizes: &[[u32; 2]], side: u32) -> Option<Vec<Place>> {
    let padded = |texels: u32| u64::from(texels + 2 * PADDING);
    let area: u64 = sizes.iter().map(|&[width, height]| padded(width) * padded(height)).sum();
    if area > u64::from(side).pow(2) {
        return None;
    }
    // The tallest first, or the longest, or the largest: now one packs best, now the other.
    let greatness: [Greatness; 3] = [
        |[width, height]| (height, width),
        |[width, height]| (width.max(height), width.min(height)),
        |[width, height]| (width * height, height),
    ];
    greatness.into_iter().find_map(|greatness| {
        let mut order: Vec<usize> = (0..sizes.len()).collect();
        order.sort_by_key(|&chart| (std::cmp::Reverse(greatness(sizes[chart])), chart));
        placed_in(&order, sizes, side)
    })
}

/// Where charts of these sizes lie that are placed in this order, if all find room.
fn placed_in(order: &[usize], sizes: &[[u32; 2]], side: u32) -> Option<Vec<Place>> {
    let mut atlas = SimpleAtlasAllocator::new(size2(side as i32, side as i32));
    let mut places = vec![Place { first: [0; 2], texels: [0; 2] }; sizes.len()];
    for &chart in order {
        let texels = sizes[chart];
        let [width, height] = texels.map(|side| (side + 2 * PADDING) as i32);
        let corner = atlas.allocate(size2(width, height))?.min;
        places[chart] = Place { first: [corner.x as u32 + PADDING, corner.y as u32 + PADDING], texels };
    }
    Some(places)
}

fn too_many(fewest: &[[u32; 2]], side: u32) -> AtlasError {
    let charts = fewest.len();
    let enough = std::iter::successors(Some(side.next_power_of_two()), |side| Some(2 * side))
        .take_while(|&side| side <= MAX_ATLAS_SIDE)
        .find(|&larger| larger > side && placed(fewest, larger).is_some());
    let cure = match enough {
        Some(larger) => format!("take a side of {larger} or more, or write vertex colours instead"),
        None => "write vertex colours instead, or light maps of parts of the scene".to_owned(),
    };
    AtlasError::TooMany { charts, side, cure }
}
