//! Exact form factors times the share of each patch that hemicubes see.
//!
//! What two patches exchange were nothing else there is known exactly. How much of it arrives is asked of an item buffer:
//! of the cells through which a patch lies, weighed as a hemicube weighs them, the share that show it. Both counts are
//! of the same cells, so that what nothing hides is in full sight, however few cells it fills, and only shadows' edges are as
//! coarse as cells. Several hemicubes a patch see what one at its centre does not.
//!
//! Lamps are small, and what they send makes the sharpest shadows: what a patch exchanges with those that emit is found as
//! [`super::visible`] does, past what stands between.
//!
//! Cells that show a patch are those of [`Hemicube`]. Those that something nearer hides are found facet by facet: the
//! cells of each row between the facet's edges that do not show it.

use std::f64::consts::PI;
use std::ops::Range;

use glam::{DQuat, DVec3};

use super::exchange::exchange;
use super::hemicube::{self, Eye, Face, Hemicube, axes_about};
use super::parts::Part;
use super::rows::{Elsewhere, Row};
use super::runs::{GridOnFace, Runs};
use super::visible::{self, ExactVisible};
use crate::patches::Patches;
use crate::scene::BackFaces;
use crate::simd::{self, Level, Simd};
use crate::visibility::{Cells, Facet, FacetShape, Facets, ItemBuffer, SCREENS, Sight};

/// Off a plane by less than this, relative to the scene's extent, is in the plane.
const HORIZON: f64 = 1e-9;

/// How many hemicubes a patch may have along each of its sides.
pub const EYES: std::ops::RangeInclusive<u32> = 1..=8;

/// How many it has unless told.
pub const DEFAULT_EYES: u32 = 2;

/// Where more than this share of the patches emit none of them is taken for a lamp.
const MOST_LAMPS: f64 = 0.25;

/// Steps from place to place of a square that keep apart (the plastic number's).
const SPREAD: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];

/// Half a turn times this from one hemicube of a patch to the next (the golden ratio's), so that their cells show different
/// things.
const TURN: f64 = 0.618_033_988_749_895;

/// Form factors of patches by what they would exchange, and the share of it that hemicubes see.
#[derive(Clone, Debug)]
pub struct Shares<'a> {
    patches: &'a Patches,
    facets: &'a Facets,
    hemicube: Hemicube<'a>,
    lit: bool,
    margin: f64,
    eyes: u32,
    /// The flat parts of patches, patch by patch, the facet of each, and where those of each patch begin; one more entry ends
    /// the last.
    parts: Vec<Part>,
    facet_of: Vec<u32>,
    starts: Vec<u32>,
    /// The sum of a patch's parts.
    area: Vec<f64>,
    frames: [Frame; SCREENS],
    lamps: Option<Lamps>,
}

/// The patches that emit.
#[derive(Clone, Debug)]
struct Lamps {
    exact: ExactVisible,
    /// Those of its groups that any of them is in.
    groups: Vec<usize>,
}

/// Memory that one row after another is worked out in.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    hemicube: hemicube::Scratch,
    /// What each eye's hemicube showed.
    seen: Vec<[ItemBuffer; SCREENS]>,
    /// The weights of cells that something nearer hides, by patch; and room for the row itself.
    hidden: Vec<f64>,
    row: Vec<f64>,
    exact: visible::Scratch,
    /// Facets that some eye saw, and which those are.
    is_seen: Vec<bool>,
    facets: Vec<u32>,
    runs: Runs,
}

impl<'a> Shares<'a> {
    /// Of the patches that `hemicube` is taken of, which lie on `facets`, with `eyes` times `eyes` hemicubes each; what lamps
    /// send to within `accuracy`, as of [`ExactVisible::new`]. `None` where those are out of [`EYES`], or this out of
    /// [`visible::ACCURACIES`].
    pub fn new(
        patches: &'a Patches,
        facets: &'a Facets,
        back_faces: BackFaces,
        hemicube: Hemicube<'a>,
        eyes: u32,
        accuracy: f64,
    ) -> Option<Self> {
        if !EYES.contains(&eyes) {
            return None;
        }
        let exact = ExactVisible::new(patches, facets, back_faces, accuracy)?;
        let emits = |patch: u32| !patches.emission[patch as usize].is_black();
        let count = (0..patches.len() as u32).filter(|&patch| emits(patch)).count();
        let few = count > 0 && count as f64 <= MOST_LAMPS * patches.len() as f64;
        let lamps = few.then(|| Lamps { groups: exact.groups_of(emits), exact });
        let mut found = Vec::new();
        for (facet, number) in facets.as_slice().iter().zip(0_u32..) {
            match facet.cells {
                Cells::One(patch) => found.push((patch, number, Part::cell(facet, [0, 0], [1, 1]))),
                Cells::Grid { first, columns, rows } => {
                    let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| [column, row]));
                    found.extend(cells.map(|[column, row]| {
                        let part = Part::cell(facet, [column, row], [columns, rows]);
                        (first + row * columns + column, number, part)
                    }));
                }
            }
        }
        found.sort_by_key(|&(patch, facet, _)| (patch, facet));
        let mut starts = vec![0; patches.len() + 1];
        let mut area = vec![0.0; patches.len()];
        for (patch, _, part) in &found {
            starts[*patch as usize + 1] += 1;
            area[*patch as usize] += part.area;
        }
        for patch in 0..patches.len() {
            starts[patch + 1] += starts[patch];
        }
        let facet_of = found.iter().map(|&(_, facet, _)| facet).collect();
        let parts = found.into_iter().map(|(.., part)| part).collect();
        let (lit, margin) = (back_faces == BackFaces::Lit, HORIZON * facets.extent());
        // Which facet a cell shows must be told.
        let hemicube = hemicube.facet_by_facet();
        let frames = Face::ALL.map(|face| Frame::new(face, hemicube.weights().precision()));
        Some(Self {
            patches,
            facets,
            hemicube,
            lit,
            margin,
            eyes,
            parts,
            facet_of,
            starts,
            area,
            frames,
            lamps,
        })
    }

    /// Row i.
    pub fn row(&self, patch: usize, scratch: &mut Scratch) -> Row {
        self.row_at(Level::best(), patch, scratch)
    }

    /// The same with no more of the processor than `level`; the bits do not depend on it.
    pub fn row_at(&self, level: Level, patch: usize, scratch: &mut Scratch) -> Row {
        self.row_with(level, patch, self.lamps.as_ref(), scratch)
    }

    /// The same with lamps taken for patches like any others.
    pub fn row_without_lamps(&self, patch: usize, scratch: &mut Scratch) -> Row {
        self.row_with(Level::best(), patch, None, scratch)
    }

    /// How the row of a lamp is found; `None` of what is none.
    pub fn of_lamp(&self, patch: usize) -> Option<&ExactVisible> {
        let emits = !self.patches.emission[patch].is_black();
        self.lamps.as_ref().filter(|_| emits).map(|lamps| &lamps.exact)
    }

    fn row_with(&self, level: Level, patch: usize, lamps: Option<&Lamps>, scratch: &mut Scratch) -> Row {
        let count = self.patches.len();
        let of_lamps = |scratch: &mut Scratch| {
            let Lamps { exact, groups } = lamps?;
            // A lamp looks out as it is seen.
            Some(match self.patches.emission[patch].is_black() {
                true => exact.row_of_groups(level, patch, groups, &mut scratch.exact),
                false => exact.row_at(level, patch, &mut scratch.exact),
            })
        };
        let of_lamps = of_lamps(scratch);
        let lamp = of_lamps.is_some() && !self.patches.emission[patch].is_black();
        let eyes = if lamp { vec![self.centre(patch)] } else { self.eyes_of(patch) };
        scratch.seen.resize(eyes.len().max(scratch.seen.len()), Default::default());
        for (&eye, seen) in eyes.iter().zip(&mut scratch.seen) {
            self.hemicube.look(level, eye, &mut scratch.hemicube);
            scratch.hemicube.swap_buffers(seen);
        }
        let per_eye = 1.0 / eyes.len() as f64;
        let [surroundings, backs] =
            [0, 1].map(|k| std::mem::take(&mut scratch.hemicube.row_mut()[count + k]) * per_eye);
        let elsewhere = Elsewhere { surroundings, backs };
        if let (true, Some(row)) = (lamp, &of_lamps) {
            scratch.hemicube.row_mut().fill(0.0);
            return row.clone().with_elsewhere(elsewhere);
        }
        let lamps = lamps.is_some();
        simd::run(level, FindRow { method: self, patch, eyes: &eyes, lamps, scratch });
        if let Some(row) = of_lamps {
            for (j, &factor) in row.columns().zip(row.values()) {
                if !self.patches.emission[j as usize].is_black() {
                    scratch.row[j as usize] = f64::from(factor);
                }
            }
        }
        let Scratch { row, hemicube, .. } = scratch;
        Row::take_dense(row, hemicube.packing()).with_elsewhere(elsewhere)
    }

    /// Fill the dense row with what is exchanged past what the eyes see, but for `lamps`, where they are told apart.
    #[inline(always)]
    fn find_row<S: Simd>(&self, simd: S, patch: usize, eyes: &[Eye], lamps: bool, scratch: &mut Scratch) {
        let count = self.patches.len();
        scratch.hidden.resize(count, 0.0);
        scratch.row.resize(count, 0.0);
        scratch.is_seen.resize(self.facets.as_slice().len(), false);
        scratch.runs.make_room(self.hemicube.weights().precision());
        for j in 0..count {
            if scratch.hemicube.row_mut()[j] > 0.0 {
                for k in self.of(j) {
                    let facet = self.facet_of[k];
                    if !scratch.is_seen[facet as usize] {
                        scratch.is_seen[facet as usize] = true;
                        scratch.facets.push(facet);
                    }
                }
            }
        }
        for (&eye, seen) in eyes.iter().zip(&scratch.seen) {
            let sight = self.hemicube.sight_from(eye);
            for &facet in &scratch.facets {
                self.add_hidden(simd, &sight, facet, seen, &mut scratch.runs, &mut scratch.hidden);
            }
        }
        for facet in scratch.facets.drain(..) {
            scratch.is_seen[facet as usize] = false;
        }
        let per_area = 1.0 / self.area[patch];
        for j in 0..count {
            let seen = std::mem::take(&mut scratch.hemicube.row_mut()[j]);
            let hidden = std::mem::take(&mut scratch.hidden[j]);
            if seen > 0.0 && (!lamps || self.patches.emission[j].is_black()) {
                let share = if hidden > 0.0 { seen / (seen + hidden) } else { 1.0 };
                scratch.row[j] = share * self.unhidden(simd, patch, j) * per_area;
            }
        }
    }

    /// The hemicube at a patch's centre.
    fn centre(&self, patch: usize) -> Eye {
        Eye::at(self.patches, patch)
    }

    /// The parts of a patch.
    fn of(&self, patch: usize) -> Range<usize> {
        self.starts[patch] as usize..self.starts[patch + 1] as usize
    }

    /// Where the hemicubes of a patch stand: at its centre, or at the middles of equal pieces of it.
    fn eyes_of(&self, patch: usize) -> Vec<Eye> {
        let centre = self.centre(patch);
        if self.eyes == 1 {
            return vec![centre];
        }
        let parts = &self.parts[self.of(patch)];
        let count = self.eyes * self.eyes;
        let mut eyes = Vec::with_capacity(count as usize);
        let (mut part, mut before) = (0, 0.0);
        for e in 0..count {
            // As many on each part as its share of the area asks.
            let to = (f64::from(e) + 0.5) / f64::from(count) * self.area[patch];
            while part + 1 < parts.len() && before + parts[part].area < to {
                before += parts[part].area;
                part += 1;
            }
            let Part { origin, u, v, shape, normal, .. } = parts[part];
            let turn = DQuat::from_axis_angle(normal, PI * (f64::from(e) * TURN).fract());
            let along = axes_about(normal, centre.axes[0])[0];
            let x = turn * along;
            let [mut s, mut t] = match parts {
                [_] => [e % self.eyes, e / self.eyes].map(|k| (f64::from(k) + 0.5) / f64::from(self.eyes)),
                // Of several parts, places that keep apart from one another on each.
                _ => SPREAD.map(|step| (0.5 + f64::from(e) * step).fract()),
            };
            if shape == FacetShape::Triangle {
                let root = s.sqrt();
                (s, t) = (root * (1.0 - t), root * t);
            }
            eyes.push(Eye { point: origin + u * s + v * t, axes: [x, normal.cross(x), normal] });
        }
        eyes
    }

    /// Add the weights of the cells through which a facet lies and another is seen to its patches.
    #[inline(always)]
    fn add_hidden<S: Simd>(
        &self,
        simd: S,
        sight: &Sight<'_>,
        number: u32,
        buffers: &[ItemBuffer; SCREENS],
        runs: &mut Runs,
        hidden: &mut [f64],
    ) {
        let facet = &self.facets[number];
        let before = facet.normal.dot(sight.eye - facet.origin);
        if before.abs() <= self.margin
            || (before < 0.0 && !self.lit)
            || facet.greatest_height(sight.eye, sight.axes[2]) <= self.margin
        {
            return;
        }
        let (label, patch) = match facet.cells {
            Cells::One(patch) | Cells::Grid { first: patch, columns: 1, rows: 1 } => (2 * patch, Some(patch)),
            Cells::Grid { first, .. } => (2 * first + 1, None),
        };
        let width = self.hemicube.weights().precision();
        let seen = Placed::new(facet, sight, before);
        for (face, buffer) in Face::ALL.into_iter().zip(buffers) {
            let frame = &self.frames[face as usize];
            let Some(rows) = seen.rows(frame) else { continue };
            let edges = seen.edges(frame);
            let mut grid = None;
            for y in rows {
                let (mut low, mut high) = (0.0_f64, width as f64);
                for &(level, slope, inverse) in &edges {
                    let crossing = -(level + slope * y as f64) * inverse;
                    // `max` and `min` pass over what is no number: 0 times infinity.
                    if inverse > 0.0 {
                        low = low.max(crossing.ceil());
                    } else {
                        high = high.min(crossing.floor() + 1.0);
                    }
                }
                if low >= high {
                    continue;
                }
                let (low, high) = (low as usize, high as usize);
                let labels = &buffer.labels(y)[..high];
                let mut shown = 0;
                for &here in &labels[low..] {
                    shown += u32::from(here == label);
                }
                if shown as usize == high - low {
                    continue;
                }
                let sums = self.hemicube.sums(face, y);
                let mut x = low;
                while x < high {
                    if labels[x] == label {
                        x += 1;
                        continue;
                    }
                    let from = x;
                    while x < high && labels[x] != label {
                        x += 1;
                    }
                    if let Some(patch) = patch {
                        hidden[patch as usize] += sums[x] - sums[from];
                        continue;
                    }
                    let of_face = || GridOnFace::new(facet, &face.view(sight.eye, sight.axes, width));
                    let grid = grid.get_or_insert_with(of_face);
                    runs.clear();
                    grid.find_runs(simd, [from, y], x, runs);
                    for k in 0..runs.len() {
                        let (label, from, to) = runs.get(k, x);
                        hidden[(label >> 1) as usize] += sums[to] - sums[from];
                    }
                }
            }
        }
    }

    /// What two patches exchange, were nothing else there: what of the first's front sees the second's front, or back where
    /// backs are lit.
    #[inline(always)]
    fn unhidden<S: Simd>(&self, simd: S, i: usize, j: usize) -> f64 {
        let mut sum = 0.0;
        for here in self.of(i) {
            let part = &self.parts[here];
            for other in self.of(j) {
                let there = &self.parts[other];
                if there.heights(part.centre, part.normal).1 <= self.margin {
                    continue;
                }
                let (low, high) = part.heights(there.centre, there.normal);
                let turned = there.turned();
                for back in [false, true] {
                    // The one of lesser number first: the same both ways.
                    let pair = match back {
                        false if high > self.margin && here < other => [part, there],
                        false if high > self.margin => [there, part],
                        true if self.lit && low < -self.margin => [part, &turned],
                        _ => continue,
                    };
                    let (fronts, counts) = self.before_each_other(pair);
                    for first in &fronts[0][..counts[0]] {
                        for second in &fronts[1][..counts[1]] {
                            sum += exchange(simd, first, second);
                        }
                    }
                }
            }
        }
        sum
    }

    /// What of each of two parts lies before the other, in up to four pieces.
    fn before_each_other(&self, pair: [&Part; 2]) -> ([[Part; 4]; 2], [usize; 2]) {
        let mut pieces = pair.map(|part| [*part; 4]);
        let mut counts = [1; 2];
        for (k, other) in [(0, 1), (1, 0)] {
            let (part, plane) = (pair[k], pair[other]);
            if part.heights(plane.centre, plane.normal).0 >= -self.margin {
                continue;
            }
            let level = plane.normal.dot(plane.centre);
            let [above, _] = part.outline().parted(plane.normal, level, self.margin);
            counts[k] = 0;
            for triangle in above.triangles() {
                pieces[k][counts[k]] = triangle;
                counts[k] += 1;
            }
        }
        (pieces, counts)
    }
}

/// The cells of a face in the axes of its hemicube.
#[derive(Clone, Copy, Debug)]
struct Frame {
    /// Which of the axes are the face's right, up and forward, and whether forward is along its axis or against it.
    axes: [usize; 3],
    sign: f64,
    /// Where the cells begin, and end, across and up, at distance 1.
    sides: [[f64; 2]; 2],
    /// The size of a cell, and how many rows of them there are.
    cell: f64,
    rows: usize,
}

impl Frame {
    fn new(face: Face, precision: usize) -> Self {
        let view = face.view(DVec3::ZERO, DVec3::AXES, precision);
        let (axes, sign) = face.axes();
        Self {
            axes,
            sign,
            sides: [view.horizontal, view.vertical],
            cell: view.cell_width(),
            rows: view.height,
        }
    }

    /// Right, up and forward of a vector in the hemicube's axes.
    #[inline(always)]
    fn turned(&self, vector: [f64; 3]) -> [f64; 3] {
        let [right, up, forward] = self.axes;
        [vector[right], vector[up], vector[forward] * self.sign]
    }
}

/// A facet as an eye sees it, in the axes of its hemicube.
struct Placed {
    corners: [[f64; 3]; 4],
    /// Linear forms of directions that are not negative where the facet is seen: one for each side of it.
    sides: [[f64; 3]; 4],
}

impl Placed {
    /// Of a facet whose front, or back, this height above its plane looks at.
    #[inline(always)]
    fn new(facet: &Facet, sight: &Sight<'_>, before: f64) -> Self {
        let [x, y, z] = sight.axes;
        let local = |v: DVec3| [v.dot(x), v.dot(y), v.dot(z)];
        let (corners, _) = facet.corners();
        let corners = corners.map(|corner| local(corner - sight.eye));
        // As in `GridOnFace`: u and v times the inverse depth are linear in the direction.
        let to_eye = sight.eye - facet.origin;
        let depth = facet.normal / -before;
        let [u, v] = facet.duals().map(|dual| dual + depth * to_eye.dot(dual));
        let sides = match facet.shape {
            FacetShape::Triangle => [u, v, depth - u - v, depth],
            FacetShape::Parallelogram => [u, v, depth - u, depth - v],
        };
        Self { corners, sides: sides.map(local) }
    }

    /// The rows of a face in which it may be seen; `None` where it falls between all cells' middles, or beside the face.
    #[inline(always)]
    fn rows(&self, frame: &Frame) -> Option<Range<usize>> {
        let [[left, right], [bottom, top]] = frame.sides;
        let mut beyond = 0b1111_u32;
        let mut before = true;
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for corner in self.corners {
            let [across, up, forward] = frame.turned(corner);
            beyond &= u32::from(across < left * forward)
                | u32::from(across > right * forward) << 1
                | u32::from(up < bottom * forward) << 2
                | u32::from(up > top * forward) << 3;
            before &= forward > 0.0;
            let near = 1.0 / forward;
            low = [low[0].min(across * near), low[1].min(up * near)];
            high = [high[0].max(across * near), high[1].max(up * near)];
        }
        if beyond != 0 {
            return None;
        }
        if !before {
            return Some(0..frame.rows);
        }
        // Middles of cells are at whole numbers and a half.
        let cells = |along: usize, at: f64| (at - frame.sides[along][0]) / frame.cell;
        if (cells(0, low[0]) - 0.5).ceil() > (cells(0, high[0]) - 0.5).floor() {
            return None;
        }
        let from = (cells(1, low[1]) - 0.5).ceil().max(0.0) as usize;
        let to = ((cells(1, high[1]) + 0.5).floor().max(0.0) as usize).min(frame.rows);
        (from < to).then_some(from..to)
    }

    /// Its sides on a face: cell (x, y) looks through it where level + slope y + x / inverse >= 0 for each.
    #[inline(always)]
    fn edges(&self, frame: &Frame) -> [(f64, f64, f64); 4] {
        let [left, bottom] = [0, 1].map(|along| frame.sides[along][0] + 0.5 * frame.cell);
        self.sides.map(|side| {
            let [across, up, forward] = frame.turned(side);
            (across * left + up * bottom + forward, up * frame.cell, 1.0 / (across * frame.cell))
        })
    }
}

/// Find one row.
struct FindRow<'a, 'b> {
    method: &'a Shares<'b>,
    patch: usize,
    eyes: &'a [Eye],
    lamps: bool,
    scratch: &'a mut Scratch,
}

impl simd::Kernel for FindRow<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        self.method.find_row(simd, self.patch, self.eyes, self.lamps, self.scratch);
    }
}
