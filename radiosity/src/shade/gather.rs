//! Final gather: a picture whose light is found anew at every point that it shows.
//!
//! The solution tells the light of whole patches, and shadows are no sharper than these. Here each point asks for itself,
//!
//! ```text
//! B(x) = E + ρ (H_direct + H_reflected)
//! ```
//!
//! H_direct straight from the lamps and past what hides them ([`Lamps`]), exactly; H_reflected from all patches as the solution
//! has them, B - E, by a hemicube. The latter changes slowly over a flat facet, and is found on a lattice some pixels wide and
//! blended; only where something stands on the facet it is found point by point, so that nothing leaks past it. On curved
//! surfaces it is found at the patches and spread smoothly.

use std::collections::HashMap;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::crease::PieceCorners;
use super::lamps::{LampScratch, Lamps, Receiver, Receivers};
use super::picture::{
    Picture, PictureError, PictureRequest, STRIP, ScreenPicture, Strip, Trace, draw_strips,
};
use super::tone::{self, ToneMap};
use crate::form_factors::hemicube::{CellWeights, Eye, Hemicube, Scratch};
use crate::light::Rgb;
use crate::patches::Patches;
use crate::scene::{BackFaces, Camera, Scene};
use crate::visibility::{Facet, FacetShape, Facets, NOTHING};
use crate::watch::{Interrupted, Progress};

/// Cells along a hemicube's side.
const PRECISION: u32 = 100;

/// The least distance between points of the finer of two lattices that are blended, in pixels; the greatest is twice that.
const SPACING: f64 = 6.0;

/// A small picture's lattice is no coarser than this: 2^5 cells along the scene.
const LEAST_LEVEL: f64 = 5.0;

/// Where something stands on a cell of the lattice, finer ones are tried so many times over.
const FINER: i32 = 2;

/// The most cells of the lattice along a facet's side.
const MOST_CELLS: f64 = 65536.0;

/// Of a cell: how far into the facet the points of the lattice lie that stand for its edges, where walls may be.
const INSET: f64 = 1.0 / 16.0;

/// Of a cell: how far beyond it what stands counts as on it, for points of the lattice to have a wall on neither side.
const BESIDE: f64 = 1.0 / 32.0;

/// Of a cell: how high above it.
const HEIGHT: f64 = 0.25;

/// Normals that differ by less than this are one: facets that are flat, whatever is beside them.
const FLAT: f64 = 1e-6;

/// The light of a solved scene, ready to be gathered at any point.
#[derive(Debug)]
pub struct FinalGather<'a> {
    patches: &'a Patches,
    facets: &'a Facets,
    lamps: Lamps,
    hemicube: Hemicube<'a>,
    /// What each patch sends besides the lamps' own light.
    reflected: Vec<Rgb>,
    surroundings: Rgb,
    curved: Curved,
    extent: f64,
}

/// What is known of facets that stand for curved surfaces.
#[derive(Debug, Default)]
struct Curved {
    /// For each surface its first piece, where it has curved ones.
    first_piece: Vec<Option<usize>>,
    /// For each piece, at its corners: the true normal, and the light that is reflected on it.
    normals: Vec<[DVec3; 3]>,
    light: Vec<[Rgb; 3]>,
}

/// Memory that one strip of a picture after another is worked out in.
#[derive(Default)]
struct Memory {
    hemicube: Scratch,
    lamps: LampScratch,
    /// Points of the lattice, and whether something stands on its cells, as far as they were asked for.
    nodes: HashMap<Place, Rgb>,
    busy: HashMap<Place, bool>,
    samples: Vec<Sample>,
    /// Of each pixel of a tile, the last of its samples.
    last: Vec<Option<u32>>,
    receivers: Vec<Receiver>,
    light: Vec<Rgb>,
}

/// A point or a cell of the lattice over a facet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Place {
    facet: u32,
    /// Of all cells along u and v: the point or the cell.
    cells: [u32; 2],
    at: [u32; 2],
}

/// What a pixel sees of one facet, all samples as one at their mean.
#[derive(Clone, Copy, Debug)]
struct Sample {
    facet: u32,
    pixel: u32,
    /// The one before it of the same pixel.
    before: Option<u32>,
    uv: DVec2,
    count: u32,
}

impl<'a> FinalGather<'a> {
    /// Of `scene`, of which `patches` and `facets` were made, with its solved `radiosity`, a value a patch. `surroundings` is the
    /// radiosity of all that lies about an open scene.
    ///
    /// Takes the memory of a few numbers a patch, and for each patch of a curved surface a hemicube's time.
    ///
    /// # Panics
    ///
    /// Where `radiosity` and `patches` differ in length.
    pub fn new(
        scene: &Scene,
        patches: &'a Patches,
        facets: &'a Facets,
        radiosity: &[Rgb],
        back_faces: BackFaces,
        surroundings: Rgb,
    ) -> Self {
        assert_eq!(radiosity.len(), patches.len(), "one value a patch");
        let facets = facets.fewest();
        let lamps = Lamps::new(patches, facets, back_faces);
        let mut reflected = radiosity.to_vec();
        for surface in lamps.surfaces() {
            for patch in patches.blocks[surface as usize].patches() {
                reflected[patch] = radiosity[patch] - patches.emission[patch];
            }
        }
        let weights = CellWeights::new(PRECISION).expect("an even number within bounds");
        let hemicube = Hemicube::new(patches, facets, back_faces, weights);
        let extent = facets.extent();
        let curved = Curved::default();
        let mut gather = Self { patches, facets, lamps, hemicube, reflected, surroundings, curved, extent };
        gather.curved = gather.find_curved(scene);
        gather
    }

    fn find_curved(&self, scene: &Scene) -> Curved {
        let corners = PieceCorners::new(scene, self.patches);
        let surfaces = 0..scene.surfaces.len() as u32;
        // Parallelograms in pieces are flat, and their facets other than the pieces.
        let in_pieces = |surface: u32| scene.surfaces[surface as usize].shape.parallelogram().is_none();
        let mut flat = Vec::new();
        for pieces in self.patches.pieces.iter().flatten() {
            flat.extend(pieces.triangles.iter().map(|&[a, b, c]| (b - a).cross(c - a).normalize_or_zero()));
        }
        let normals = corners.normals(&flat);
        let bends = |piece: usize| normals[piece].iter().any(|n| n.distance(flat[piece]) > FLAT);
        let first_piece: Vec<Option<usize>> = surfaces
            .map(|surface| {
                let mut pieces = corners.of_surface(surface);
                let first = pieces.start;
                (in_pieces(surface) && pieces.any(bends)).then_some(first)
            })
            .collect();
        let of_patch =
            |patch: usize| first_piece[self.patches.surface[patch] as usize].is_some().then_some(patch);
        let wanted: Vec<usize> = (0..self.patches.len()).filter_map(of_patch).collect();
        let found: Vec<Rgb> = wanted
            .par_iter()
            .map_init(Scratch::default, |scratch, &patch| {
                let eye = Eye::at(self.patches, patch);
                self.hemicube.gather(eye, &self.reflected, self.surroundings, scratch)
            })
            .collect();
        let mut light = vec![Rgb::BLACK; self.patches.len()];
        for (patch, found) in wanted.into_iter().zip(found) {
            light[patch] = found;
        }
        Curved { first_piece, light: corners.values(&light), normals }
    }

    /// The piece that a facet of a curved surface is.
    fn curved_piece(&self, number: u32, facet: &Facet) -> Option<usize> {
        let first = self.curved.first_piece[facet.surface as usize]?;
        Some(first + (number - self.facets.of_surface(facet.surface).start) as usize)
    }

    /// The radiosity of points of one facet, given by (u, v), where a pixel is so large on the surface.
    fn shade(&self, number: u32, points: &[(DVec2, f64)], memory: &mut Memory) {
        let facet = &self.facets[number];
        let piece = self.curved_piece(number, facet);
        let place = |at: DVec2| facet.origin + facet.u * at.x + facet.v * at.y;
        let Memory { receivers, light, lamps, .. } = &mut *memory;
        receivers.clear();
        let mut ends = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        for &(at, _) in points {
            let normal = match piece {
                Some(piece) => between(self.curved.normals[piece], at).normalize_or_zero(),
                None => facet.normal,
            };
            receivers.push(Receiver { point: place(at), normal });
            ends = [ends[0].min(at), ends[1].max(at)];
        }
        light.clear();
        light.resize(points.len(), Rgb::BLACK);
        let [low, high] = ends;
        let about = Receivers {
            points: receivers,
            outline: self.outline(facet, [low, high]),
            normal: facet.normal,
            curved: piece.map(|_| facet.surface),
        };
        self.lamps.add_light(&about, light, lamps);
        for (k, &(at, size)) in points.iter().enumerate() {
            let reflected = match piece {
                Some(piece) => between_colours(self.curved.light[piece], at),
                None => self.reflected_at(number, facet, at, size, memory),
            };
            let patch = facet.patch_at(at.x, at.y) as usize;
            let arriving = memory.light[k] + reflected;
            memory.light[k] = self.patches.emission[patch] + self.patches.reflectance[patch] * arriving;
        }
    }

    /// The corners of a parallelogram in (u, v), counter-clockwise about the facet's normal.
    fn outline(&self, facet: &Facet, [low, high]: [DVec2; 2]) -> [DVec3; 4] {
        let place = |x: f64, y: f64| facet.origin + facet.u * x + facet.v * y;
        let mut outline =
            [place(low.x, low.y), place(high.x, low.y), place(high.x, high.y), place(low.x, high.y)];
        if facet.u.cross(facet.v).dot(facet.normal) < 0.0 {
            outline.reverse();
        }
        outline
    }

    /// The reflected light that arrives at a point of a flat facet.
    fn reflected_at(&self, number: u32, facet: &Facet, at: DVec2, size: f64, memory: &mut Memory) -> Rgb {
        // Two lattices, one twice as fine as the other, blended so that neither's end is seen.
        let level = (self.extent / (SPACING * size).max(self.extent / MOST_CELLS)).log2().max(LEAST_LEVEL);
        let (fine, share) = (level.floor() as i32, level.fract());
        for level in fine - 1..=fine + FINER {
            let place = self.cell(number, facet, at, level);
            if self.is_busy(facet, place, memory) {
                continue;
            }
            let light = self.blended(facet, place, at, memory);
            let next = self.cell(number, facet, at, level + 1);
            if level >= fine || next.cells == place.cells {
                return light;
            }
            return light + (self.blended(facet, next, at, memory) - light) * share;
        }
        self.gathered(facet, facet.origin + facet.u * at.x + facet.v * at.y, memory)
    }

    /// The cell of a facet's lattice of this level, 2^level cells along the scene, that a point is in.
    fn cell(&self, number: u32, facet: &Facet, at: DVec2, level: i32) -> Place {
        let cells = |side: DVec3| {
            let wanted = side.length() / self.extent * 2.0_f64.powi(level);
            (wanted.ceil() as u32).clamp(1, MOST_CELLS as u32)
        };
        let cells = match facet.shape {
            FacetShape::Parallelogram => [cells(facet.u), cells(facet.v)],
            // The same both ways, for the third side to run through corners of cells.
            FacetShape::Triangle => [cells(facet.u).max(cells(facet.v)); 2],
        };
        let along = |at: f64, cells: u32| ((at * f64::from(cells)) as u32).min(cells - 1);
        Place { facet: number, cells, at: [along(at.x, cells[0]), along(at.y, cells[1])] }
    }

    /// Whether anything stands on a cell, so that light differs on both sides of it.
    fn is_busy(&self, facet: &Facet, place: Place, memory: &mut Memory) -> bool {
        *memory.busy.entry(place).or_insert_with(|| {
            let cells = DVec2::new(f64::from(place.cells[0]), f64::from(place.cells[1]));
            let at = DVec2::new(f64::from(place.at[0]), f64::from(place.at[1]));
            // Walls along the facet's own edges part nothing.
            let low = (at - BESIDE).max(DVec2::splat(BESIDE)) / cells;
            let high = (at + 1.0 + BESIDE).min(cells - BESIDE) / cells;
            let size = (facet.u.length() / cells.x).min(facet.v.length() / cells.y);
            self.lamps.anything_on(self.outline(facet, [low, high]), facet.normal, HEIGHT * size)
        })
    }

    /// The light in a cell, from those at its corners.
    fn blended(&self, facet: &Facet, cell: Place, at: DVec2, memory: &mut Memory) -> Rgb {
        let [i, j] = cell.at;
        let (s, t) = (
            (at.x * f64::from(cell.cells[0]) - f64::from(i)).clamp(0.0, 1.0),
            (at.y * f64::from(cell.cells[1]) - f64::from(j)).clamp(0.0, 1.0),
        );
        let mut corner = |k: u32, l: u32| self.node(facet, Place { at: [i + k, j + l], ..cell }, memory);
        let (right, upper) = (corner(1, 0), corner(0, 1));
        match facet.shape {
            FacetShape::Triangle if s + t <= 1.0 || i + j + 2 > cell.cells[0] => {
                let (s, t) = (s / (s + t).max(1.0), t / (s + t).max(1.0));
                let first = corner(0, 0);
                first + (right - first) * s + (upper - first) * t
            }
            FacetShape::Triangle => {
                let last = corner(1, 1);
                last + (upper - last) * (1.0 - s) + (right - last) * (1.0 - t)
            }
            FacetShape::Parallelogram => {
                let (first, last) = (corner(0, 0), corner(1, 1));
                let below = first + (right - first) * s;
                let above = upper + (last - upper) * s;
                below + (above - below) * t
            }
        }
    }

    /// The light at a point of the lattice.
    fn node(&self, facet: &Facet, place: Place, memory: &mut Memory) -> Rgb {
        if let Some(&light) = memory.nodes.get(&place) {
            return light;
        }
        let along = |k: usize| {
            let (at, cells) = (f64::from(place.at[k]), f64::from(place.cells[k]));
            match facet.shape {
                FacetShape::Parallelogram => at.clamp(INSET, cells - INSET) / cells,
                // Towards the middle.
                FacetShape::Triangle => at / cells + (1.0 / 3.0 - at / cells) * INSET / cells,
            }
        };
        let light = self.gathered(facet, facet.origin + facet.u * along(0) + facet.v * along(1), memory);
        memory.nodes.insert(place, light);
        light
    }

    /// The same by a hemicube there, turned from point to point for its cells to make no pattern.
    fn gathered(&self, facet: &Facet, point: DVec3, memory: &mut Memory) -> Rgb {
        let normal = facet.normal;
        let tangent = facet.u.try_normalize().unwrap_or_else(|| normal.any_orthonormal_vector());
        let (sin, cos) = (turn(point) * std::f64::consts::FRAC_PI_2).sin_cos();
        let first = tangent * cos + normal.cross(tangent) * sin;
        let axes = [first, normal.cross(first), normal];
        self.hemicube.gather(Eye { point, axes }, &self.reflected, self.surroundings, &mut memory.hemicube)
    }

    /// Shade a strip: the sums of its pixels take up the developed colours of all samples.
    fn shade_strip(
        &self,
        strip: &Strip<'_>,
        request: &PictureRequest,
        develop: &impl Fn([f32; 3]) -> [f32; 3],
        memory: &mut Memory,
        sums: &mut [[f64; 3]],
    ) {
        let pixel =
            f64::from(request.sampling) * (strip.view.cell_width() * strip.view.cell_height()).abs().sqrt();
        let mut points = Vec::new();
        for left in (0..strip.width).step_by(STRIP) {
            let columns = left..(left + STRIP).min(strip.width);
            self.find_samples(strip, columns, request, memory);
            let samples = std::mem::take(&mut memory.samples);
            for same in samples.chunk_by(|one, other| one.facet == other.facet) {
                let facet = &self.facets[same[0].facet];
                points.clear();
                points.extend(same.iter().map(|sample| {
                    let at = sample.uv / f64::from(sample.count);
                    let point = facet.origin + facet.u * at.x + facet.v * at.y;
                    let to_point = point - strip.view.eye;
                    let depth = strip.view.forward.dot(to_point);
                    let facing = (facet.normal.dot(to_point) / depth).abs();
                    (at, pixel * depth.abs() / facing.max(1e-6).sqrt())
                }));
                self.shade(same[0].facet, &points, memory);
                for (sample, light) in same.iter().zip(&memory.light) {
                    let colour = develop(light.to_array().map(|value| value as f32));
                    let sum = &mut sums[sample.pixel as usize];
                    (0..3).for_each(|k| sum[k] += f64::from(colour[k]) * f64::from(sample.count));
                }
            }
            memory.samples = samples;
        }
    }

    /// What the pixels of a tile see, in order of the facets, then of the pixels.
    fn find_samples(
        &self,
        strip: &Strip<'_>,
        columns: std::ops::Range<usize>,
        request: &PictureRequest,
        memory: &mut Memory,
    ) {
        let Memory { samples, last, .. } = memory;
        let side = request.sampling as usize;
        samples.clear();
        last.clear();
        last.resize(STRIP * STRIP, None);
        for (row, pixel_row) in strip.rows.clone().enumerate() {
            for y in pixel_row * side..(pixel_row + 1) * side {
                let seen = &strip.buffer.facets(y)[..columns.end * side];
                let mut x = columns.start * side;
                while x < seen.len() {
                    let number = seen[x];
                    let run = x..x + seen[x..].iter().take_while(|&&other| other == number).count();
                    x = run.end;
                    if number == NOTHING {
                        continue;
                    }
                    let facet = &self.facets[number];
                    if request.back_faces == BackFaces::Black && !facet.faces(strip.view.eye) {
                        continue;
                    }
                    let trace = Trace::new(facet, strip.view, y);
                    for x in run {
                        let at = on_facet(facet, trace.uv(x as f64));
                        let column = x / side;
                        let last = &mut last[row * STRIP + column - columns.start];
                        let mut known = *last;
                        while let Some(k) = known
                            && samples[k as usize].facet != number
                        {
                            known = samples[k as usize].before;
                        }
                        match known {
                            Some(k) => {
                                let sample = &mut samples[k as usize];
                                (sample.uv, sample.count) = (sample.uv + at, sample.count + 1);
                            }
                            None => {
                                let pixel = (row * strip.width + column) as u32;
                                let sample = Sample { facet: number, pixel, before: *last, uv: at, count: 1 };
                                *last = Some(samples.len() as u32);
                                samples.push(sample);
                            }
                        }
                    }
                }
            }
        }
        samples.sort_unstable_by_key(|sample| (sample.facet, sample.pixel));
    }

    fn draw<P: Copy + Send>(
        &self,
        camera: &Camera,
        request: &PictureRequest,
        develop: impl Fn([f32; 3]) -> [f32; 3] + Sync,
        finish: impl Fn([f32; 3]) -> P + Sync,
        watch: &(dyn Fn(&Progress) -> ControlFlow<()> + Sync),
    ) -> Result<Vec<P>, GatherError> {
        let (rows, stopped) = (AtomicUsize::new(0), AtomicBool::new(false));
        let total = request.height;
        let shade = |strip: &Strip<'_>, memory: &mut Memory, sums: &mut [[f64; 3]]| {
            if stopped.load(Ordering::Relaxed) {
                return;
            }
            self.shade_strip(strip, request, &develop, memory, sums);
            let done = rows.fetch_add(strip.rows.len(), Ordering::Relaxed) + strip.rows.len();
            if watch(&Progress::Picture { done, total }).is_break() {
                stopped.store(true, Ordering::Relaxed);
            }
        };
        let pixels = draw_strips(self.facets, camera, request, Memory::default, shade, finish)?;
        if stopped.into_inner() {
            return Err(Interrupted.into());
        }
        Ok(pixels)
    }
}

/// Why there is no gathered picture.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GatherError {
    /// As of any picture.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// The caller said stop.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
}

/// The picture that `camera` takes of the gathered light, linear and unexposed, as [`super::picture()`] takes it of shaded
/// surfaces.
///
/// The samples of a pixel that see one facet take the light at their mean: light from a lamp that has any size has no sharper
/// edge. `watch` is asked after every few rows, on any thread, and may say stop.
///
/// Rows are shared among the threads of the rayon pool it is called in; their number does not change a bit. Takes some MB a
/// thread besides the picture.
pub fn gathered_picture(
    light: &FinalGather<'_>,
    camera: &Camera,
    request: &PictureRequest,
    watch: &(dyn Fn(&Progress) -> ControlFlow<()> + Sync),
) -> Result<Picture, GatherError> {
    let pixels = light.draw(camera, request, |sample| sample, |mean| mean, watch)?;
    Ok(Picture { width: request.width, height: request.height, pixels })
}

/// The same as a screen shows it, each sample tone-mapped before a pixel's mean is taken, as
/// [`super::screen_picture`] has it.
pub fn gathered_screen_picture(
    light: &FinalGather<'_>,
    camera: &Camera,
    request: &PictureRequest,
    tone: ToneMap,
    watch: &(dyn Fn(&Progress) -> ControlFlow<()> + Sync),
) -> Result<ScreenPicture, GatherError> {
    let pixels = light.draw(camera, request, tone.develop(), tone::bytes, watch)?;
    Ok(ScreenPicture { width: request.width, height: request.height, pixels })
}

/// A point of a facet, with whatever the eye's rounding put outside of it brought back.
fn on_facet(facet: &Facet, (u, v): (f64, f64)) -> DVec2 {
    let at = DVec2::new(u, v).max(DVec2::ZERO);
    match facet.shape {
        FacetShape::Parallelogram => at.min(DVec2::ONE),
        FacetShape::Triangle => at / (at.x + at.y).max(1.0),
    }
}

/// What lies between the corners of a triangle.
fn between([a, b, c]: [DVec3; 3], at: DVec2) -> DVec3 {
    a + (b - a) * at.x + (c - a) * at.y
}

fn between_colours([a, b, c]: [Rgb; 3], at: DVec2) -> Rgb {
    a + (b - a) * at.x + (c - a) * at.y
}

/// A number, 0..1, that follows from a point and looks like chance (SplitMix64's last step).
fn turn(point: DVec3) -> f64 {
    let mut bits = 0_u64;
    for coordinate in point.to_array() {
        bits = (bits ^ coordinate.to_bits()).wrapping_add(0x9e37_79b9_7f4a_7c15);
        bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        bits ^= bits >> 31;
    }
    (bits >> 11) as f64 / (1_u64 << 53) as f64
}
