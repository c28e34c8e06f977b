//! Pictures on surfaces, and their mean over any part of a triangle, in linear light.
//!
//! A texel is a square of one colour. With P(x, y) the sum of a row's texels up to x, the integral of the picture over a
//! polygon is that of P along its border, ∮ P dy (Green), so that a mean is exact, and takes as long as the border crosses
//! texels, however many it encloses. Of a picture that lies on triangles in too many texels a coarser one is taken.

use std::fmt::{self, Debug, Formatter};
use std::ops::Range;
use std::sync::OnceLock;

use glam::DVec2;

use crate::light::{Rgb, linear_from_srgb};

/// After so many texels a row's sum is kept.
const STEP: usize = 32;

/// Corners nearer to one line than this are drawn apart to it. \[texels\]
const APART: f64 = 1e-3;

/// A picture that surfaces carry, of texels in linear light, 0 to 1.
pub struct Texture {
    finest: Level,
    /// Each with half as many texels a side as the one before, the last with one; made when they are first wanted.
    coarser: OnceLock<Vec<Level>>,
}

/// What a texture is beyond its borders, along one side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The same again.
    #[default]
    Repeat,
    /// Its mirror image, then the same again.
    Mirror,
    /// The texel at the border.
    Clamp,
}

#[derive(PartialEq)]
struct Level {
    width: usize,
    height: usize,
    texels: Texels,
    /// Row by row the sums of the texels before every [`STEP`]th, then of all.
    sums: Vec<Rgb>,
}

#[derive(PartialEq)]
enum Texels {
    /// Red, green, blue in sRGB, the top row first.
    Codes(Vec<[u8; 3]>),
    Linear(Vec<[f32; 3]>),
}

impl Texture {
    /// A picture of red, green and blue in sRGB, the top row first.
    ///
    /// # Panics
    /// Where there is no texel, or not `width` times `height` of them.
    pub fn new(width: usize, height: usize, codes: Vec<[u8; 3]>) -> Self {
        Self { finest: Level::new(width, height, Texels::Codes(codes)), coarser: OnceLock::new() }
    }

    /// Columns and rows.
    pub fn size(&self) -> [usize; 2] {
        [self.finest.width, self.finest.height]
    }

    /// What it takes of memory, without the coarser ones. \[bytes\]
    pub(super) fn bytes(&self) -> usize {
        self.finest.bytes()
    }

    /// A coarser picture that takes no more than `room` bytes, or one texel; itself where it fits.
    pub(super) fn within(self, room: usize) -> Self {
        if self.bytes() <= room {
            return self;
        }
        let mut finest = self.finest;
        while finest.bytes() > room && finest.width * finest.height > 1 {
            finest = finest.halved();
        }
        Self { finest, coarser: OnceLock::new() }
    }

    /// The picture, halved so many times, or as often as it can be.
    fn level(&self, halvings: usize) -> &Level {
        let Some(index) = halvings.checked_sub(1) else { return &self.finest };
        let coarser = self.coarser.get_or_init(|| {
            let mut all: Vec<Level> = Vec::new();
            while let level = all.last().unwrap_or(&self.finest)
                && level.width * level.height > 1
            {
                all.push(level.halved());
            }
            all
        });
        coarser.get(index).or(coarser.last()).unwrap_or(&self.finest)
    }

    /// Where a triangle with its corners at these (u, v) lies on the picture, v downwards. Where it is more than `most` texels
    /// across, the picture is taken coarser.
    pub(super) fn under(&self, wrap: [Wrap; 2], corners: [[f64; 2]; 3], most: f64) -> Footprint<'_> {
        // What is no number is nowhere in particular.
        let corners = corners.map(|corner| corner.map(|x| if x.is_finite() { x } else { 0.0 }));
        // Whole periods change nothing, and take digits.
        let first: [f64; 2] = std::array::from_fn(|k| {
            let least = corners.iter().map(|corner| corner[k]).fold(f64::INFINITY, f64::min);
            match wrap[k] {
                Wrap::Repeat => least.floor(),
                Wrap::Mirror => (least * 0.5).floor() * 2.0,
                Wrap::Clamp => 0.0,
            }
        });
        let corners = corners.map(|corner| DVec2::from(std::array::from_fn(|k| corner[k] - first[k])));
        let across = (0..2).map(|k| {
            let along = corners.map(|corner| match wrap[k] {
                Wrap::Clamp => corner[k].clamp(0.0, 1.0),
                Wrap::Repeat | Wrap::Mirror => corner[k],
            });
            let (low, high) =
                along.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &x| (l.min(x), h.max(x)));
            (high - low) * self.size()[k] as f64
        });
        let halvings = (across.fold(0.0, f64::max) / most).log2().ceil().max(0.0) as usize;
        let level = self.level(halvings);
        let size = DVec2::new(level.width as f64, level.height as f64);
        Footprint { level, wrap, corners: apart(corners.map(|corner| corner * size)) }
    }
}

impl Debug for Texture {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "Texture({} x {})", self.finest.width, self.finest.height)
    }
}

impl PartialEq for Texture {
    fn eq(&self, other: &Self) -> bool {
        self.finest == other.finest
    }
}

/// Corners on one line, or in one point, as models have them that take their colours from a palette, drawn apart by a hair:
/// their triangle has an area then, and its parts have their shares of it.
fn apart(corners: [DVec2; 3]) -> [DVec2; 3] {
    let edge = |k: usize| corners[(k + 2) % 3] - corners[(k + 1) % 3];
    let longest = (1..3).fold(0, |best, k| if edge(k).length() > edge(best).length() { k } else { best });
    let length = edge(longest).length();
    let twice_area = (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]);
    if twice_area.abs() >= APART * length.max(APART) {
        return corners;
    }
    let mut moved = corners;
    if length < APART {
        moved[1] = corners[0] + DVec2::X * APART;
        moved[2] = corners[0] + DVec2::Y * APART;
    } else {
        moved[longest] += edge(longest).perp() * (APART / length).copysign(twice_area);
    }
    let back = (corners.iter().sum::<DVec2>() - moved.iter().sum::<DVec2>()) / 3.0;
    moved.map(|corner| corner + back)
}

impl Level {
    fn new(width: usize, height: usize, texels: Texels) -> Self {
        let mut level = Self { width, height, texels, sums: Vec::new() };
        assert_eq!(level.texels.len(), width * height, "{width} x {height} texels");
        assert!(width * height > 0, "a picture of nothing");
        let mut sums = Vec::with_capacity(height * level.sums_a_row());
        for row in 0..height {
            let mut sum = Rgb::BLACK;
            for column in 0..width {
                if column % STEP == 0 {
                    sums.push(sum);
                }
                sum += level.texel(row, column);
            }
            sums.push(sum);
        }
        level.sums = sums;
        level
    }

    fn sums_a_row(&self) -> usize {
        self.width.div_ceil(STEP) + 1
    }

    fn bytes(&self) -> usize {
        let texel = match self.texels {
            Texels::Codes(_) => size_of::<[u8; 3]>(),
            Texels::Linear(_) => size_of::<[f32; 3]>(),
        };
        self.width * self.height * texel + self.height * self.sums_a_row() * size_of::<Rgb>()
    }

    fn texel(&self, row: usize, column: usize) -> Rgb {
        match &self.texels {
            Texels::Codes(codes) => {
                let [r, g, b] = codes[row * self.width + column].map(linear);
                Rgb::new(r, g, b)
            }
            Texels::Linear(texels) => Rgb::from(texels[row * self.width + column].map(f64::from)),
        }
    }

    /// The sum of a row's texels before `column`, 0 to the width.
    fn sum(&self, row: usize, column: usize) -> Rgb {
        let kept = column / STEP;
        let sum = self.sums[row * self.sums_a_row() + kept];
        (kept * STEP..column).fold(sum, |sum, column| sum + self.texel(row, column))
    }

    /// The sum of all texels of a row.
    fn row_sum(&self, row: usize) -> Rgb {
        self.sums[(row + 1) * self.sums_a_row() - 1]
    }

    /// Half as many texels a side, rounded up: each the mean of what it covers.
    fn halved(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        // A texel covers whole ones and parts of others, where a side is odd.
        let covered = |of: usize, among: usize, texels: usize| {
            let side = texels as f64 / among as f64;
            let (from, to) = (of as f64 * side, (of + 1) as f64 * side);
            let range = from as usize..(to.ceil() as usize).min(texels);
            range.map(move |k| (k, ((k + 1) as f64).min(to) - (k as f64).max(from)))
        };
        let mean = |row: usize, column: usize| {
            let (mut sum, mut weight) = (Rgb::BLACK, 0.0);
            for (y, high) in covered(row, height, self.height) {
                for (x, wide) in covered(column, width, self.width) {
                    sum += self.texel(y, x) * (high * wide);
                    weight += high * wide;
                }
            }
            (sum * (1.0 / weight)).to_array().map(|channel| channel as f32)
        };
        let texels = (0..height).flat_map(|row| (0..width).map(move |column| (row, column)));
        let texels = texels.map(|(row, column)| mean(row, column)).collect();
        Self::new(width, height, Texels::Linear(texels))
    }
}

impl Texels {
    fn len(&self) -> usize {
        match self {
            Self::Codes(codes) => codes.len(),
            Self::Linear(texels) => texels.len(),
        }
    }
}

/// The linear light of a code of eight bits.
fn linear(code: u8) -> f64 {
    static LINEAR: OnceLock<[f64; 256]> = OnceLock::new();
    let table =
        LINEAR.get_or_init(|| std::array::from_fn(|code| linear_from_srgb(code as f32 / 255.0).into()));
    table[usize::from(code)]
}

/// Texels along one side, within and beyond.
#[derive(Clone, Copy)]
struct Side {
    wrap: Wrap,
    count: i64,
}

impl Side {
    /// The cell that a place is in, all beyond a clamped border being one.
    fn cell(self, at: f64) -> i64 {
        let cell = at.floor() as i64;
        if self.wrap == Wrap::Clamp { cell.clamp(-1, self.count) } else { cell }
    }

    /// Where the next cell begins.
    fn end(self, cell: i64) -> f64 {
        if self.wrap == Wrap::Clamp && cell == self.count { f64::INFINITY } else { (cell + 1) as f64 }
    }

    /// Where a cell's own sum begins: at its near end, but of what lies before a clamped border at that border.
    fn begin(self, cell: i64) -> i64 {
        if self.wrap == Wrap::Clamp { cell.max(0) } else { cell }
    }

    /// The texel of a cell.
    fn texel(self, cell: i64) -> usize {
        let texel = match self.wrap {
            Wrap::Repeat => cell.rem_euclid(self.count),
            Wrap::Clamp => cell.clamp(0, self.count - 1),
            Wrap::Mirror => {
                let texel = cell.rem_euclid(2 * self.count);
                texel.min(2 * self.count - 1 - texel)
            }
        };
        texel as usize
    }
}

/// A triangle's place on a texture. Points of it are told by their shares (s, t) of the ways from its first corner to the
/// second and the third.
pub(super) struct Footprint<'a> {
    level: &'a Level,
    wrap: [Wrap; 2],
    /// In texels.
    corners: [DVec2; 3],
}

impl Footprint<'_> {
    /// The mean over triangular parts of the triangle, all of them together.
    pub(super) fn mean(&self, parts: &[[DVec2; 3]]) -> Rgb {
        if self.level.width * self.level.height == 1 {
            return self.level.texel(0, 0);
        }
        let [a, b, c] = self.corners;
        let place = |at: DVec2| a + (b - a) * at.x + (c - a) * at.y;
        let (mut integral, mut area) = (Rgb::BLACK, 0.0);
        for part in parts {
            let corners = part.map(place);
            let twice = (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]);
            area += 0.5 * twice;
            integral += match self.one_texel(corners) {
                Some(texel) => texel * (0.5 * twice),
                None => self.integral(corners),
            };
        }
        // What has less of it than rounding leaves is as its middle.
        if area.abs() < 1e-12 {
            let middle = parts.as_flattened().iter().map(|&at| place(at)).sum::<DVec2>();
            return self.at(middle / (3 * parts.len()).max(1) as f64);
        }
        let within = |channel: f64| (channel / area).clamp(0.0, 1.0);
        Rgb::from(integral.to_array().map(within))
    }

    fn sides(&self) -> [Side; 2] {
        let [columns, rows] = [self.level.width, self.level.height].map(|count| count as i64);
        [Side { wrap: self.wrap[0], count: columns }, Side { wrap: self.wrap[1], count: rows }]
    }

    fn at(&self, place: DVec2) -> Rgb {
        let [columns, rows] = self.sides();
        self.level.texel(rows.texel(rows.cell(place.y)), columns.texel(columns.cell(place.x)))
    }

    /// The texel that all of a triangle lies on, if it is one.
    fn one_texel(&self, corners: [DVec2; 3]) -> Option<Rgb> {
        let [columns, rows] = self.sides();
        let cells = corners.map(|corner| [columns.cell(corner.x), rows.cell(corner.y)]);
        (cells[0] == cells[1] && cells[1] == cells[2]).then(|| self.at(corners[0]))
    }

    /// The integral over a triangle; negative where it runs clockwise.
    fn integral(&self, corners: [DVec2; 3]) -> Rgb {
        let [columns, _] = self.sides();
        // Sums begin near at hand: around a whole border it makes no difference where.
        let least = corners.iter().map(|corner| corner.x).fold(f64::INFINITY, f64::min);
        let origin = columns.begin(columns.cell(least));
        (0..3).map(|k| self.along(corners[k], corners[(k + 1) % 3], origin)).sum()
    }

    /// ∫ P dy along an edge, P counted from the column `origin`; the other way round its negative, to the bit.
    fn along(&self, from: DVec2, to: DVec2, origin: i64) -> Rgb {
        if to.y < from.y {
            return self.along(to, from, origin) * -1.0;
        }
        let [_, rows] = self.sides();
        let slope = (to.x - from.x) / (to.y - from.y);
        let place = |y: f64| if y == to.y { to.x } else { from.x + (y - from.y) * slope };
        let (mut y, mut sum) = (from.y, Rgb::BLACK);
        while y < to.y {
            let row = rows.cell(y);
            let end = rows.end(row).min(to.y);
            sum += self.across(rows.texel(row), [place(y), place(end)], origin) * (end - y);
            y = end;
        }
        sum
    }

    /// The mean of P along a row between two places.
    fn across(&self, row: usize, [from, to]: [f64; 2], origin: i64) -> Rgb {
        let [columns, _] = self.sides();
        let (low, high) = (from.min(to), from.max(to));
        let mut column = columns.cell(low);
        let mut before = self.between(row, origin..columns.begin(column));
        let (mut x, mut sum) = (low, Rgb::BLACK);
        loop {
            let texel = self.level.texel(row, columns.texel(column));
            let end = columns.end(column).min(high);
            let middle = before + texel * (0.5 * (x + end) - columns.begin(column) as f64);
            if low == high {
                return middle;
            }
            sum += middle * ((end - x) / (high - low));
            if end >= high {
                return sum;
            }
            before += texel * (columns.begin(column + 1) - columns.begin(column)) as f64;
            (x, column) = (end, column + 1);
        }
    }

    /// The sum of a row's texels from one column to another, none of them beyond a clamped border; the negative one from
    /// there to here where the range is turned about.
    fn between(&self, row: usize, Range { start, end }: Range<i64>) -> Rgb {
        let [columns, _] = self.sides();
        if (0..=STEP as i64).contains(&(end - start)) {
            return (start..end).map(|column| self.level.texel(row, columns.texel(column))).sum();
        }
        let (count, all) = (columns.count, self.level.row_sum(row));
        let up_to = |column: i64| match columns.wrap {
            Wrap::Clamp => self.level.sum(row, column as usize),
            Wrap::Repeat => {
                let rest = self.level.sum(row, column.rem_euclid(count) as usize);
                all * column.div_euclid(count) as f64 + rest
            }
            Wrap::Mirror => {
                let rest = match column.rem_euclid(2 * count) {
                    rest if rest <= count => self.level.sum(row, rest as usize),
                    rest => all * 2.0 - self.level.sum(row, (2 * count - rest) as usize),
                };
                all * (2 * column.div_euclid(2 * count)) as f64 + rest
            }
        };
        up_to(end) - up_to(start)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const WHOLE: [DVec2; 3] = [DVec2::ZERO, DVec2::X, DVec2::Y];

    fn noise(width: usize, height: usize) -> Texture {
        let code = |k: usize| (k.wrapping_mul(2_654_435_761) >> 13) as u8;
        Texture::new(
            width,
            height,
            (0..width * height).map(|k| [code(3 * k), code(3 * k + 1), code(k)]).collect(),
        )
    }

    fn grey(width: usize, codes: &[u8]) -> Texture {
        Texture::new(width, codes.len() / width, codes.iter().map(|&code| [code; 3]).collect())
    }

    /// The mean, of very many places.
    fn sampled(footprint: &Footprint<'_>) -> Rgb {
        const CUTS: usize = 100;
        let mut sum = Rgb::BLACK;
        for row in 0..CUTS {
            for column in 0..CUTS - row {
                for third in [1.0, 2.0].iter().take(if row + column + 2 <= CUTS { 2 } else { 1 }) {
                    let [s, t] = [column, row].map(|k| (k as f64 + third / 3.0) / CUTS as f64);
                    let [a, b, c] = footprint.corners;
                    sum += footprint.at(a + (b - a) * s + (c - a) * t);
                }
            }
        }
        sum * (1.0 / (CUTS * CUTS) as f64)
    }

    fn differ(a: Rgb, b: Rgb) -> f64 {
        (a - b).norm_squared().sqrt()
    }

    #[test]
    fn a_mean_is_of_what_the_triangle_covers() {
        let halves = grey(8, &[[0; 4], [255; 4]].concat().repeat(8));
        // Of the unit square's lower triangle three quarters lie right of the middle.
        for (corners, exact) in [
            ([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], 0.75),
            ([[0.0, 0.0], [1.0, 1.0], [0.0, 1.0]], 0.25),
            ([[0.0, 0.0], [0.5, 1.0], [0.0, 1.0]], 0.0),
            ([[0.0, 0.0], [8.0, 0.0], [8.0, 8.0]], 0.5 + 0.25 / 8.0),
        ] {
            let footprint = halves.under([Wrap::Repeat; 2], corners, 1e4);
            assert!((footprint.mean(&[WHOLE]).g - exact).abs() < 1e-12, "{corners:?}");
        }
    }

    #[test]
    fn beyond_the_border_it_is_as_told() {
        let ramp = grey(4, &[0, 85, 170, 255]);
        let texels = [0, 85, 170, 255].map(linear);
        for (wrap, around) in [
            (Wrap::Repeat, [3, 0, 1, 2, 3, 0, 1]),
            (Wrap::Mirror, [0, 0, 1, 2, 3, 3, 2]),
            (Wrap::Clamp, [0, 0, 1, 2, 3, 3, 3]),
        ] {
            for (cell, texel) in (-1..).zip(around) {
                let u = (f64::from(cell) + 0.5) / 4.0;
                let footprint = ramp.under([wrap; 2], [[u, 0.4], [u, 0.4], [u, 0.4]], 1e4);
                assert_eq!(footprint.mean(&[WHOLE]).r, texels[texel], "{wrap:?} {cell}");
            }
            // A line along all of it has the mean by length, weighted as its triangle is wide.
            let footprint = ramp.under([wrap; 2], [[0.0, 0.5], [1.0, 0.5], [0.0, 0.5]], 1e4);
            let exact: f64 = texels.iter().zip([7.0, 5.0, 3.0, 1.0]).map(|(texel, w)| texel * w / 16.0).sum();
            assert!((footprint.mean(&[WHOLE]).r - exact).abs() < 1e-6, "{wrap:?}");
        }
    }

    #[test]
    fn coordinates_that_are_none_end_too() {
        let texture = noise(7, 5);
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for far in [f64::NAN, f64::INFINITY, 1e30, -1e30, 1e9, 1e150] {
                for corners in [[[far, 0.0], [1.0, far], [0.0, 0.0]], [[far, far], [far, 1.0], [far, -far]]] {
                    let mean = texture.under([wrap; 2], corners, 1e4).mean(&[WHOLE]).to_array();
                    assert!(mean.iter().all(|x| (0.0..=1.0).contains(x)), "{wrap:?} {corners:?}: {mean:?}");
                }
            }
        }
    }

    #[test]
    fn coarser_pictures_have_the_same_mean() {
        let texture = noise(101, 37);
        let all = |level: &Level| {
            (0..level.height).map(|row| level.row_sum(row)).sum::<Rgb>()
                * (1.0 / (level.width * level.height) as f64)
        };
        let mean = all(&texture.finest);
        for halvings in 1..9 {
            assert!(differ(all(texture.level(halvings)), mean) < 1e-6);
        }
        assert_eq!([texture.level(2).width, texture.level(2).height], [26, 10]);
        assert_eq!(texture.level(9).texels.len(), 1);
        let small = noise(101, 37).within(500);
        assert!(small.bytes() <= 500 && small.size() == [7, 3] && differ(all(&small.finest), mean) < 1e-6);
    }

    proptest! {
        #[test]
        fn means_are_those_of_many_places(
            corners in prop::array::uniform3(prop::array::uniform2(-2.0_f64..3.0)),
            wrap in prop::array::uniform2(prop::sample::select(&[Wrap::Repeat, Wrap::Mirror, Wrap::Clamp][..])),
            (width, height) in (1_usize..80, 1_usize..5),
        ) {
            let texture = noise(width, height);
            let footprint = texture.under(wrap, corners, 1e4);
            let found = footprint.mean(&[WHOLE]);
            prop_assert!(differ(found, sampled(&footprint)) < 0.05);
        }

        /// The parts have together what the whole has, however it is cut.
        #[test]
        fn parts_add_up(
            corners in prop::array::uniform3(prop::array::uniform2(-3.0_f64..3.0)),
            wrap in prop::array::uniform2(prop::sample::select(&[Wrap::Repeat, Wrap::Mirror, Wrap::Clamp][..])),
            [s, t] in prop::array::uniform2(0.0_f64..1.0),
            flat in 0..4,
        ) {
            let corners = match flat {
                0 => corners.map(|corner| [corner[0], corners[0][1]]),
                1 => [corners[0]; 3],
                _ => corners,
            };
            let texture = noise(67, 45);
            let footprint = texture.under(wrap, corners, 1e4);
            let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
            let inner = DVec2::new(s, t);
            let parts = [0, 1, 2].map(|k| [WHOLE[k], WHOLE[(k + 1) % 3], inner]);
            let area = |[a, b, c]: [DVec2; 3]| (b - a).perp_dot(c - a);
            let sum: Rgb = parts.iter().map(|&part| footprint.mean(&[part]) * area(part)).sum();
            prop_assert!(differ(sum, footprint.mean(&[WHOLE])) < 1e-7);
            prop_assert!(differ(footprint.mean(&parts), footprint.mean(&[WHOLE])) < 1e-9);
        }
    }
}
