//! A picture of shaded surfaces through a camera, in linear light.

use std::ops::Range;

use rayon::prelude::*;

use super::smooth::ShadedSurfaces;
use super::tone::{self, ToneMap};
use crate::scene::{BackFaces, Camera};
use crate::visibility::{Facet, Facets, ItemBuffer, NOTHING, View};

/// The most pixels along a side.
pub const MAX_PICTURE_SIDE: usize = 65_535;
/// The most pixels in all: 16,384 squared. A linear picture takes 12 bytes a pixel, one for the screen 3.
pub const MAX_PICTURE_PIXELS: usize = 1 << 28;
/// The most samples along a pixel's side.
pub const MAX_SAMPLING: u32 = 16;

/// What a camera sees, in linear light.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Red, green, blue, in the unit of the scene's emissions; row by row, the top row first.
    pub pixels: Vec<[f32; 3]>,
}

/// A picture as a screen shows it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ScreenPicture {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Red, green, blue in sRGB; row by row, the top row first.
    pub pixels: Vec<[u8; 3]>,
}

/// What picture is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PictureRequest {
    /// Columns, 1 to [`MAX_PICTURE_SIDE`].
    pub width: usize,
    /// Rows, likewise.
    pub height: usize,
    /// Each pixel is the mean of this many samples squared, 1 to [`MAX_SAMPLING`].
    pub sampling: u32,
    /// What a surface is when seen from behind.
    pub back_faces: BackFaces,
}

impl Default for PictureRequest {
    /// 800 x 600, sixteen samples a pixel.
    fn default() -> Self {
        Self { width: 800, height: 600, sampling: 4, back_faces: BackFaces::default() }
    }
}

/// Why there is no picture.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PictureError {
    /// No pixels, or too many.
    #[error(
        "a picture of {width}x{height} cannot be made: each side must be 1 to {MAX_PICTURE_SIDE} pixels, and all \
         together at most {MAX_PICTURE_PIXELS} (16384x16384)"
    )]
    Size {
        /// Columns asked for.
        width: usize,
        /// Rows asked for.
        height: usize,
    },
    /// No samples, or too many.
    #[error("{0} samples along a pixel's side: it must be 1 to {MAX_SAMPLING}")]
    Sampling(u32),
    /// The camera has no window or no viewport.
    #[error("the camera's {0} is empty or not finite: nothing can be seen through it")]
    Camera(&'static str),
}

/// The picture that `camera` takes of `surfaces`, linear and unexposed: what is to be measured, or kept as EXR.
///
/// A pixel is the mean, in linear light, of its samples, which lie on a regular grid in it (a box filter: it never
/// rings, and adds up to the light that falls on the pixel). What sees no surface, or lies outside the camera's
/// viewport, is black. Where the window's shape is not the viewport's, the whole window is in view, with more beside
/// it or above and below.
///
/// Rows are shared among the threads of the rayon pool it is called in; their number does not change a bit.
pub fn picture(
    surfaces: &ShadedSurfaces<'_>,
    camera: &Camera,
    request: &PictureRequest,
) -> Result<Picture, PictureError> {
    let pixels = draw(surfaces, camera, request, |sample| sample, |mean| mean)?;
    Ok(Picture { width: request.width, height: request.height, pixels })
}

/// The picture as a screen shows it, each sample tone-mapped before a pixel's mean is taken.
///
/// It differs from [`super::tone_map`] of [`picture()`] along the edges of what is brighter than white, where it is
/// better: a lamp a hundred times as bright as white, covering a ninth of a pixel, makes the mean of the light eleven
/// times white, and a staircase on the screen; the mean of what is shown is a ninth of the way to white, and smooth.
/// It also takes a quarter of the memory.
pub fn screen_picture(
    surfaces: &ShadedSurfaces<'_>,
    camera: &Camera,
    request: &PictureRequest,
    tone: ToneMap,
) -> Result<ScreenPicture, PictureError> {
    let pixels = draw(surfaces, camera, request, tone.develop(), tone::bytes)?;
    Ok(ScreenPicture { width: request.width, height: request.height, pixels })
}

/// The pixels of a picture: each sample goes through `develop`, their mean through `finish`.
fn draw<P: Copy + Send>(
    surfaces: &ShadedSurfaces<'_>,
    camera: &Camera,
    request: &PictureRequest,
    develop: impl Fn([f32; 3]) -> [f32; 3] + Sync,
    finish: impl Fn([f32; 3]) -> P + Sync,
) -> Result<Vec<P>, PictureError> {
    let samples = request.sampling as usize;
    let shade = |strip: &Strip<'_>, (): &mut (), sums: &mut [[f64; 3]]| {
        for (row, sums) in strip.rows.clone().zip(sums.chunks_mut(strip.width)) {
            for y in row * samples..(row + 1) * samples {
                shade_row(surfaces, strip.view, strip.buffer, y, request, |x, sample| {
                    let sum = &mut sums[x / samples];
                    let sample = develop(sample);
                    (0..3).for_each(|channel| sum[channel] += f64::from(sample[channel]));
                });
            }
        }
    };
    draw_strips(surfaces.facets, camera, request, || (), shade, finish)
}

/// The most rows of pixels in a strip.
pub(super) const STRIP: usize = 8;

/// A few rows of pixels, seen and not yet shaded.
pub(super) struct Strip<'a> {
    /// What the buffer shows: of each pixel its samples.
    pub(super) view: &'a View,
    pub(super) buffer: &'a ItemBuffer,
    /// Which rows of pixels of the view.
    pub(super) rows: Range<usize>,
    /// Pixels in each.
    pub(super) width: usize,
}

/// The pixels of a picture of `facets`: `shade` adds to the sums of a strip's pixels, row by row, the colour of each
/// sample; their mean goes through `finish`. Each thread shades with memory of its own.
pub(super) fn draw_strips<P: Copy + Send, M: Send>(
    facets: &Facets,
    camera: &Camera,
    request: &PictureRequest,
    memory: impl Fn() -> M + Send + Sync,
    shade: impl Fn(&Strip<'_>, &mut M, &mut [[f64; 3]]) + Sync,
    finish: impl Fn([f32; 3]) -> P + Sync,
) -> Result<Vec<P>, PictureError> {
    let &PictureRequest { width, height, sampling, .. } = request;
    let side = 1..=MAX_PICTURE_SIDE;
    if !side.contains(&width) || !side.contains(&height) || width * height > MAX_PICTURE_PIXELS {
        return Err(PictureError::Size { width, height });
    }
    if !(1..=MAX_SAMPLING).contains(&sampling) {
        return Err(PictureError::Sampling(sampling));
    }
    let mut pixels = vec![finish([0.0; 3]); width * height];
    let Some((area, window)) = fit(camera, width, height)? else { return Ok(pixels) };

    // Bands of whole rows, whose height depends on the picture alone: each has its own item buffer, so a large
    // picture does not need a large one.
    let samples = sampling as usize;
    let band_height = band_height(area.width(), area.height(), samples);
    let start = || (ItemBuffer::default(), memory());
    pixels[area.top * width..area.bottom * width]
        .par_chunks_mut(band_height * width)
        .enumerate()
        .for_each_init(start, |(buffer, memory), (band, pixels)| {
            let rows = pixels.len() / width;
            let edge = |row: usize| {
                let down = row as f64 / area.height() as f64;
                window.vertical[0] + (window.vertical[1] - window.vertical[0]) * down
            };
            let view = View {
                width: area.width() * samples,
                height: rows * samples,
                vertical: [edge(band * band_height), edge(band * band_height + rows)],
                ..window
            };
            buffer.draw(facets, &view);
            // In double precision, so that the mean of equal samples is that sample.
            let mut sums = vec![[0.0_f64; 3]; area.width() * STRIP.min(rows)];
            for (strip, pixels) in pixels.chunks_mut(STRIP * width).enumerate() {
                let first = strip * STRIP;
                let rows = first..first + pixels.len() / width;
                sums.fill([0.0; 3]);
                shade(&Strip { view: &view, buffer, rows, width: area.width() }, memory, &mut sums);
                let count = (samples * samples) as f64;
                for (pixels, sums) in pixels.chunks_mut(width).zip(sums.chunks(area.width())) {
                    for (pixel, sum) in pixels[area.left..area.right].iter_mut().zip(sums) {
                        *pixel = finish(sum.map(|value| (value / count) as f32));
                    }
                }
            }
        });
    Ok(pixels)
}

/// Hand the colour of each sample of row `y` that sees a lit surface to `put`, with its column.
#[inline]
fn shade_row(
    surfaces: &ShadedSurfaces<'_>,
    view: &View,
    buffer: &ItemBuffer,
    y: usize,
    request: &PictureRequest,
    mut put: impl FnMut(usize, [f32; 3]),
) {
    let seen = buffer.facets(y);
    let mut x = 0;
    while x < seen.len() {
        // A run of samples that see the same facet.
        let number = seen[x];
        let run = seen[x..].iter().take_while(|&&other| other == number).count();
        let samples = x..x + run;
        x += run;
        if number == NOTHING {
            continue;
        }
        let facet = &surfaces.facets[number];
        if request.back_faces == BackFaces::Black && !facet.faces(view.eye) {
            continue;
        }
        let trace = Trace::new(facet, view, y);
        for x in samples {
            let (u, v) = trace.uv(x as f64);
            put(x, surfaces.on(number, facet, u, v).to_array().map(|value| value as f32));
        }
    }
}

/// Where the samples of one row of a view meet a facet's plane. With the ray eye + t d and the plane n · p = h, both
/// 1 / t and (u, v) / t are linear along the row: one division a sample, and no vectors.
pub(super) struct Trace {
    /// n · d at column 0, and its change a column.
    facing: [f64; 2],
    /// n · (origin - eye), so that t = height / (n · d).
    height: f64,
    /// u at the eye; then, for u's dual, the same two as `facing`.
    u: [f64; 3],
    /// v likewise.
    v: [f64; 3],
}

impl Trace {
    pub(super) fn new(facet: &Facet, view: &View, y: usize) -> Self {
        let from_origin = view.eye - facet.origin;
        let along_row = |form| {
            let form = view.in_cells(form);
            [form.y * y as f64 + form.z, form.x]
        };
        let coordinate = |dual: glam::DVec3| {
            let [start, step] = along_row(dual);
            [dual.dot(from_origin), start, step]
        };
        let [dual_u, dual_v] = facet.duals();
        Self {
            facing: along_row(facet.normal),
            height: -facet.normal.dot(from_origin),
            u: coordinate(dual_u),
            v: coordinate(dual_v),
        }
    }

    #[inline]
    pub(super) fn uv(&self, x: f64) -> (f64, f64) {
        let t = self.height / (self.facing[0] + x * self.facing[1]);
        let at = |[eye, start, step]: [f64; 3]| eye + t * (start + x * step);
        (at(self.u), at(self.v))
    }
}

/// Rows of pixels a band. About 2^19 samples keep an item buffer in the cache; but a scene is drawn once a band, so a
/// huge picture takes larger bands instead of more and more of them, up to 2^23 samples, 64 MB a thread.
fn band_height(width: usize, height: usize, samples: usize) -> usize {
    let all = width * height * samples * samples;
    let wanted = (all / 256).clamp(1 << 19, 1 << 23);
    (wanted / (width * samples * samples)).clamp(1, height)
}

/// The part of a picture that is drawn to, in pixels: left <= x < right, top <= y < bottom.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PictureArea {
    /// The first column drawn to.
    pub left: usize,
    /// The first column beside it again.
    pub right: usize,
    /// The first row drawn to, counted from above.
    pub top: usize,
    /// The first row below it again.
    pub bottom: usize,
}

impl PictureArea {
    /// Columns drawn to.
    pub fn width(&self) -> usize {
        self.right - self.left
    }

    /// Rows drawn to.
    pub fn height(&self) -> usize {
        self.bottom - self.top
    }
}

/// The camera's viewport in a picture of this size, in pixels, to the nearest, and the view that fills it, a cell a
/// pixel; `None` where the viewport is less than a pixel. Where the window's shape is not the viewport's, the whole
/// window is in view, with more beside it or above and below.
///
/// # Errors
///
/// [`PictureError::Camera`].
pub fn fit(
    camera: &Camera,
    width: usize,
    height: usize,
) -> Result<Option<(PictureArea, View)>, PictureError> {
    let [left, right, bottom, top] = camera.viewport;
    if !(left < right && bottom < top) {
        return Err(PictureError::Camera("viewport"));
    }
    let pixel = |share: f64, pixels: usize| (share.clamp(0.0, 1.0) * pixels as f64).round() as usize;
    let area = PictureArea {
        left: pixel(left, width),
        right: pixel(right, width),
        top: pixel(1.0 - top, height),
        bottom: pixel(1.0 - bottom, height),
    };

    let extent = |[from, to]: [f64; 2]| (to - from).abs();
    let (across, upward) = (extent(camera.horizontal), extent(camera.vertical));
    if !(across > 0.0 && upward > 0.0 && across.is_finite() && upward.is_finite()) {
        return Err(PictureError::Camera("window"));
    }
    if area.width() == 0 || area.height() == 0 {
        return Ok(None);
    }
    // Square pixels: the direction in which the window is too narrow for the viewport shows more.
    let widen = |[from, to]: [f64; 2], by: f64| {
        let (centre, half) = ((from + to) * 0.5, (to - from) * 0.5 * by);
        [centre - half, centre + half]
    };
    let stretch = (area.width() as f64 / area.height() as f64) / (across / upward);
    let view = View {
        eye: camera.eye,
        right: camera.right,
        up: camera.up,
        forward: camera.forward,
        horizontal: if stretch > 1.0 { widen(camera.horizontal, stretch) } else { camera.horizontal },
        vertical: {
            let [lower, upper] =
                if stretch < 1.0 { widen(camera.vertical, 1.0 / stretch) } else { camera.vertical };
            [upper, lower]
        },
        width: area.width(),
        height: area.height(),
        near: camera.near,
        far: camera.far,
    };
    Ok(Some((area, view)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn camera() -> Camera {
        Camera {
            eye: DVec3::ZERO,
            forward: DVec3::NEG_Z,
            right: DVec3::X,
            up: DVec3::Y,
            horizontal: [-1.0, 1.0],
            vertical: [-1.0, 1.0],
            near: 0.0,
            far: f64::INFINITY,
            viewport: [0.0, 1.0, 0.0, 1.0],
        }
    }

    #[test]
    fn the_whole_window_stays_in_view() {
        let (_, wide) = fit(&camera(), 200, 100).unwrap().unwrap();
        assert_eq!((wide.horizontal, wide.vertical), ([-2.0, 2.0], [1.0, -1.0]));
        let (_, tall) = fit(&camera(), 100, 400).unwrap().unwrap();
        assert_eq!((tall.horizontal, tall.vertical), ([-1.0, 1.0], [4.0, -4.0]));
        // An off-axis window grows about its own centre.
        let off_axis = Camera { horizontal: [0.0, 1.0], vertical: [0.0, 1.0], ..camera() };
        let (_, wide) = fit(&off_axis, 300, 100).unwrap().unwrap();
        assert_eq!((wide.horizontal, wide.vertical), ([-1.0, 2.0], [1.0, 0.0]));
    }

    #[test]
    fn the_viewport_counts_from_below() {
        let upper_left = Camera { viewport: [0.0, 0.5, 0.75, 1.0], ..camera() };
        let (area, view) = fit(&upper_left, 80, 60).unwrap().unwrap();
        assert_eq!(area, PictureArea { left: 0, right: 40, top: 0, bottom: 15 });
        assert_eq!((view.width, view.height), (40, 15));
    }

    #[test]
    fn an_empty_camera_is_named() {
        let no_viewport = Camera { viewport: [0.5, 0.5, 0.0, 1.0], ..camera() };
        assert_eq!(fit(&no_viewport, 8, 6), Err(PictureError::Camera("viewport")));
        let no_window = Camera { vertical: [1.0, 1.0], ..camera() };
        assert_eq!(fit(&no_window, 8, 6), Err(PictureError::Camera("window")));
        let sliver = Camera { viewport: [0.5, 0.501, 0.0, 1.0], ..camera() };
        assert_eq!(fit(&sliver, 8, 6), Ok(None));
    }

    #[test]
    fn bands_stay_small_and_few() {
        for (width, height, samples) in [(1, 1, 1), (800, 600, 3), (16_000, 16_000, 3), (65_535, 4096, 16)] {
            let rows = band_height(width, height, samples);
            assert!((1..=height).contains(&rows));
            assert!(rows == 1 || rows * width * samples * samples <= 1 << 23);
        }
        assert!(800_usize.div_ceil(band_height(800, 600, 3)) > 2);
    }
}
