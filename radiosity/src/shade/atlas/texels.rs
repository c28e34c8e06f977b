//! The values of a chart's texels, and of those around it.

use glam::DVec2;
use rayon::prelude::*;

use super::{Chart, PADDING};

/// A value where there is one.
pub(super) type Texel = Option<[f32; 3]>;

/// How far from a chart, along either axis, its padding reaches. \[texels\]
const REACH: f64 = PADDING as f64;
/// A texel's centre this near to a chart is on it: what single precision leaves of a border that runs through it. \[texels\]
const ON: f64 = 1e-3;
/// Times that the border's samples are fitted.
const SWEEPS: usize = 12;
/// What a texel of little weight in a sample is held back by.
const DAMPING: f32 = 0.05;

/// What charts are baked from.
pub(super) struct Baking<'a, V> {
    /// For each facet of the scene, where its corners lie. \[texels\]
    pub(super) facets: &'a [[DVec2; 3]],
    /// The value at (u, v) of a facet, or at the nearest point of it.
    pub(super) value: &'a V,
    /// The greatest value there is.
    pub(super) most: f32,
}

impl<V: Fn(u32, f64, f64) -> [f32; 3] + Sync> Baking<'_, V> {
    /// The texels of a chart and its padding, row by row.
    pub(super) fn chart(&self, chart: &Chart) -> Vec<Texel> {
        let [width, height] = chart.place.padded().map(|side| side as usize);
        if let (true, &[facet]) = (chart.grid, &chart.facets[..]) {
            let along = |texel: usize, texels: u32| (texel as f64 - REACH + 0.5) / f64::from(texels);
            let [columns, rows] = chart.place.texels;
            let texel = |k| Some((self.value)(facet, along(k % width, columns), along(k / width, rows)));
            return (0..width * height).into_par_iter().map(texel).collect();
        }
        self.pieces(chart, width, height)
    }

    fn pieces(&self, chart: &Chart, width: usize, height: usize) -> Vec<Texel> {
        // Coordinates in which the centre of the padding's first texel is 0.
        let corner = DVec2::new(chart.place.first[0].into(), chart.place.first[1].into()) - REACH + 0.5;
        let corners = |facet: u32| self.facets[facet as usize].map(|p| p - corner);
        let mut nearest = vec![(f32::INFINITY, u32::MAX); width * height];
        for &facet in &chart.facets {
            let at = corners(facet);
            if !has_area(at) {
                continue;
            }
            let (low, high) = (at[0].min(at[1]).min(at[2]), at[0].max(at[1]).max(at[2]));
            let range = |low: f64, high: f64, end: usize| {
                (low - REACH - ON).ceil().max(0.0) as usize
                    ..((high + REACH + ON).floor() as usize + 1).min(end)
            };
            for y in range(low.y, high.y, height) {
                for x in range(low.x, high.x, width) {
                    let point = DVec2::new(x as f64, y as f64);
                    let away = closest(at, point).1.distance(point);
                    // On it, it is the first facet's.
                    let away = if away <= ON { 0.0 } else { away as f32 };
                    if away < nearest[y * width + x].0 {
                        nearest[y * width + x] = (away, facet);
                    }
                }
            }
        }
        let evaluated = |(index, &(_, facet)): (usize, &(f32, u32))| {
            (facet != u32::MAX).then(|| {
                let point = DVec2::new((index % width) as f64, (index / width) as f64);
                let (u, v) = closest(corners(facet), point).0;
                (self.value)(facet, u, v)
            })
        };
        let mut texels: Vec<Texel> = nearest.par_iter().enumerate().map(evaluated).collect();
        self.fit_border(chart, corners, width, &mut texels, |index| nearest[index].0 > 0.0);
        texels
    }

    /// Choose the texels off the chart (`free`) so that bilinear filtering gives at its border what the surface has there.
    ///
    /// Sample by sample, the free texels that it is filtered from share what is amiss (Kaczmarz), a few times over.
    fn fit_border(
        &self,
        chart: &Chart,
        corners: impl Fn(u32) -> [DVec2; 3],
        width: usize,
        texels: &mut [Texel],
        free: impl Fn(usize) -> bool,
    ) {
        let mut samples = Vec::new();
        for (facet, k) in border(chart, &corners) {
            let (from, to) = (corners(facet)[k], corners(facet)[(k + 1) % 3]);
            let count = (2.0 * from.distance(to)).ceil().max(1.0);
            for step in 0..=count as usize {
                let along = step as f64 / count;
                let point = from.lerp(to, along);
                let (x, y) = (point.x.floor(), point.y.floor());
                let (s, t) = ((point.x - x) as f32, (point.y - y) as f32);
                let first = y as usize * width + x as usize;
                let weights = [(1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t];
                let indices = [first, first + 1, first + width, first + width + 1];
                if (0..4).any(|k| free(indices[k]) && weights[k] > 0.0) {
                    let (u, v) = on_side(k, along);
                    samples.push((indices, weights, (self.value)(facet, u, v)));
                }
            }
        }
        for _ in 0..SWEEPS {
            for (indices, weights, wanted) in &samples {
                let shared: f32 = (0..4).filter(|&k| free(indices[k])).map(|k| weights[k] * weights[k]).sum();
                for channel in 0..3 {
                    let value = |k: usize| texels[indices[k]].map_or(0.0, |texel| texel[channel]);
                    let filtered: f32 = (0..4).map(|k| weights[k] * value(k)).sum();
                    let step = (wanted[channel] - filtered) / (shared + DAMPING);
                    for k in (0..4).filter(|&k| free(indices[k])) {
                        if let Some(texel) = &mut texels[indices[k]] {
                            texel[channel] = (texel[channel] + step * weights[k]).clamp(0.0, self.most);
                        }
                    }
                }
            }
        }
    }
}

/// The sides of a chart's facets that no other of its facets has: the facet, and the corner that the side begins at.
fn border(chart: &Chart, corners: impl Fn(u32) -> [DVec2; 3]) -> Vec<(u32, usize)> {
    // Corners are the same that differ by less than any texel shows.
    let key = |point: DVec2| [point.x, point.y].map(|x| (x * 4096.0).round() as i64);
    let mut sides = Vec::with_capacity(3 * chart.facets.len());
    for &facet in &chart.facets {
        let at = corners(facet);
        if has_area(at) {
            let ends = at.map(key);
            for k in 0..3 {
                let [a, b] = [ends[k], ends[(k + 1) % 3]];
                sides.push(([a.min(b), a.max(b)], facet, k));
            }
        }
    }
    sides.sort_unstable();
    let alone = sides.chunk_by(|one, other| one.0 == other.0).filter(|shared| shared.len() == 1);
    let mut border: Vec<_> = alone.map(|shared| (shared[0].1, shared[0].2)).collect();
    border.sort_unstable();
    border
}

/// (u, v) of a triangle's point on the side from corner `k` to the next, `along` it.
fn on_side(k: usize, along: f64) -> (f64, f64) {
    match k {
        0 => (along, 0.0),
        1 => (1.0 - along, along),
        _ => (0.0, 1.0 - along),
    }
}

/// Whether a triangle covers anything.
fn has_area([a, b, c]: [DVec2; 3]) -> bool {
    let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    (b - a).perp_dot(c - a).abs() > 1e-9 * longest
}

/// The point of a triangle that is nearest to `point`: its (u, v), and where it is.
fn closest(at: [DVec2; 3], point: DVec2) -> ((f64, f64), DVec2) {
    let [a, b, c] = at;
    let (first, second) = (b - a, c - a);
    let area = first.perp_dot(second);
    let (u, v) = ((point - a).perp_dot(second) / area, first.perp_dot(point - a) / area);
    if u >= 0.0 && v >= 0.0 && u + v <= 1.0 {
        return ((u, v), point);
    }
    let on = |k: usize| {
        let (from, to) = (at[k], at[(k + 1) % 3]);
        let side = to - from;
        let length = side.length_squared();
        let along = if length > 0.0 { ((point - from).dot(side) / length).clamp(0.0, 1.0) } else { 0.0 };
        (on_side(k, along), from + side * along)
    };
    let (mut best, mut found) = (f64::INFINITY, on(0));
    for k in 0..3 {
        let candidate = on(k);
        let away = candidate.1.distance_squared(point);
        if away < best {
            (best, found) = (away, candidate);
        }
    }
    found
}

/// Every texel; those without a value show the mean of those near them that have one, from ever larger squares (pull and
/// push).
pub(super) fn filled(texels: Vec<Texel>, [width, height]: [usize; 2]) -> Vec<[f32; 3]> {
    if texels.iter().all(Option::is_some) || texels.len() <= 1 {
        return texels.into_iter().map(Option::unwrap_or_default).collect();
    }
    let half = [width.div_ceil(2), height.div_ceil(2)];
    let mean = |index: usize| {
        let (x, y) = (2 * (index % half[0]), 2 * (index / half[0]));
        let four = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
        let there = four.into_iter().filter(|&(x, y)| x < width && y < height);
        let values = there.filter_map(|(x, y)| texels[y * width + x]);
        let (sum, count) = values.fold(([0.0; 3], 0.0), |(sum, count), value| {
            (std::array::from_fn(|k| sum[k] + value[k]), count + 1.0)
        });
        (count > 0.0).then(|| sum.map(|channel: f32| channel / count))
    };
    let smaller = filled((0..half[0] * half[1]).map(mean).collect(), half);
    let of = |index: usize| smaller[index / width / 2 * half[0] + index % width / 2];
    texels.iter().enumerate().map(|(index, texel)| texel.unwrap_or_else(|| of(index))).collect()
}
