//! Images, and their mean over triangles, in linear light.

use std::collections::HashMap;
use std::io::Cursor;

use gltf::texture::{Info, WrappingMode};
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::buffers::{Buffers, fetch};
use super::container::Opened;
use crate::light::{Rgb, linear_from_srgb};

/// Pixels of an image.
const MOST_PIXELS: usize = 1 << 26;
/// Bytes of images that are kept for the next triangles that want them.
const KEPT_BYTES: usize = 1 << 30;
/// Samples along a triangle's side.
const MOST_ALONG: f64 = 256.0;
/// Samples of all triangles of a primitive together.
const MOST_SAMPLES: f64 = (1_u32 << 26) as f64;

/// An image of eight bits a channel, red, green and blue, the top row first.
#[derive(Debug)]
pub(super) struct Image {
    width: usize,
    height: usize,
    pixels: Vec<u8>,
}

/// Images, each decoded when it is first wanted.
#[derive(Default)]
pub(super) struct Images {
    kept: HashMap<usize, Result<Image, String>>,
    bytes: usize,
}

impl Images {
    /// The image of a number, or why there is none.
    pub(super) fn get(
        &mut self,
        index: usize,
        opened: &Opened<'_>,
        buffers: &Buffers<'_>,
        resource: &mut impl FnMut(&str) -> Result<Vec<u8>, String>,
    ) -> Result<&Image, &str> {
        if !self.kept.contains_key(&index) {
            if self.bytes > KEPT_BYTES {
                self.kept.clear();
                self.bytes = 0;
            }
            let image = encoded(index, opened, buffers, resource).and_then(|bytes| decode(&bytes));
            self.bytes += image.as_ref().map_or(0, |image| image.pixels.len());
            self.kept.insert(index, image);
        }
        self.kept[&index].as_ref().map_err(String::as_str)
    }
}

/// The bytes of an image file.
fn encoded(
    index: usize,
    opened: &Opened<'_>,
    buffers: &Buffers<'_>,
    resource: &mut impl FnMut(&str) -> Result<Vec<u8>, String>,
) -> Result<Vec<u8>, String> {
    let image = &opened.document.as_json().images[index];
    if let Some(uri) = &image.uri {
        return fetch(uri, resource);
    }
    let view = image.buffer_view.and_then(|view| opened.document.views().nth(view.value()));
    let view = view.ok_or("it has neither a uri nor a bufferView")?;
    buffers.view(&view).map(<[u8]>::to_vec).map_err(|fault| fault.0)
}

fn decode(bytes: &[u8]) -> Result<Image, String> {
    let damaged = |why: String| format!("it is damaged: {why}");
    let fits = |width: usize, height: usize| match width.checked_mul(height) {
        Some(1..=MOST_PIXELS) => Ok(()),
        _ => Err(format!("{width} x {height} pixels are more than are read, 2^26: make it smaller")),
    };
    if bytes.starts_with(b"\x89PNG") {
        let limits = png::Limits { bytes: 16 * MOST_PIXELS };
        let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), limits);
        decoder.set_transformations(png::Transformations::normalize_to_color8());
        let mut reader = decoder.read_info().map_err(|error| damaged(error.to_string()))?;
        let (width, height) = (reader.info().width as usize, reader.info().height as usize);
        fits(width, height)?;
        let mut pixels = vec![0; reader.output_buffer_size().unwrap_or(0)];
        let frame = reader.next_frame(&mut pixels).map_err(|error| damaged(error.to_string()))?;
        let channels = frame.color_type.samples();
        let pixels = pixels.chunks_exact(channels).flat_map(|pixel| match channels {
            1 | 2 => [pixel[0]; 3],
            _ => [pixel[0], pixel[1], pixel[2]],
        });
        return Ok(Image { width, height, pixels: pixels.collect() });
    }
    if bytes.starts_with(b"\xff\xd8") {
        let options = DecoderOptions::default().jpeg_set_out_colorspace(ColorSpace::RGB);
        let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
        decoder.decode_headers().map_err(|error| damaged(error.to_string()))?;
        let (width, height) = decoder.dimensions().ok_or("it has no size")?;
        fits(width, height)?;
        let pixels = decoder.decode().map_err(|error| damaged(error.to_string()))?;
        if pixels.len() != 3 * width * height {
            return Err(damaged("its pixels do not fill it".into()));
        }
        return Ok(Image { width, height, pixels });
    }
    Err("it is neither PNG nor JPEG: convert it to one of them".into())
}

/// How an image lies on triangles.
pub(super) struct Placing {
    wrap: [WrappingMode; 2],
    /// Of KHR_texture_transform, with (u, v) taken to (a u + b v + c, d u + e v + f).
    transform: [[f64; 3]; 2],
    /// Which set of coordinates it goes by.
    pub(super) set: u32,
}

impl Placing {
    pub(super) fn new(info: &Info<'_>) -> Self {
        let sampler = info.texture().sampler();
        let mut placing = Self {
            wrap: [sampler.wrap_s(), sampler.wrap_t()],
            transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            set: info.tex_coord(),
        };
        if let Some(transform) = info.texture_transform() {
            let (sin, cos) = f64::from(transform.rotation()).sin_cos();
            let [x, y] = transform.offset().map(f64::from);
            let [across, down] = transform.scale().map(f64::from);
            placing.transform = [[cos * across, sin * down, x], [-sin * across, cos * down, y]];
            placing.set = transform.tex_coord().unwrap_or(placing.set);
        }
        placing
    }

    fn place(&self, [u, v]: [f32; 2]) -> [f64; 2] {
        self.transform.map(|[a, b, c]| a * f64::from(u) + b * f64::from(v) + c)
    }
}

/// The colour of each triangle: the mean of the image over it, in linear light. Coordinates are as the file has them,
/// v downwards.
///
/// A triangle is cut into k² like it, k its longest side in pixels, and the pixels at their centres count alike; k is
/// at most 256, or fewer where there are very many triangles.
pub(super) fn means(
    image: &Image,
    placing: &Placing,
    coordinates: &[[f32; 2]],
    triangles: &[[u32; 3]],
) -> Vec<Rgb> {
    let linear: Vec<f64> =
        (0..=255_u8).map(|code| linear_from_srgb(f32::from(code) / 255.0).into()).collect();
    let most = (MOST_SAMPLES / triangles.len().max(1) as f64).sqrt().clamp(1.0, MOST_ALONG);
    let size = [image.width as f64, image.height as f64];
    let mean = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|k| placing.place(coordinates[k as usize]));
        let along = |from: [f64; 2], to: [f64; 2]| {
            (0..2).map(|k| ((to[k] - from[k]) * size[k]).abs()).fold(0.0, f64::max)
        };
        // Coordinates that are no numbers give no number of pixels: one sample then.
        let cuts = along(a, b).max(along(b, c)).max(along(c, a)).ceil().min(most).max(1.0) as usize;
        let at = |row: usize, column: usize, third: f64| {
            // The centre of a small triangle: a third, or two thirds, of the way across its cell.
            let (s, t) = ((column as f64 + third) / cuts as f64, (row as f64 + third) / cuts as f64);
            let uv: [f64; 2] = std::array::from_fn(|k| a[k] + (b[k] - a[k]) * s + (c[k] - a[k]) * t);
            let [x, y] =
                std::array::from_fn(|k| texel(uv[k], placing.wrap[k], [image.width, image.height][k]));
            let pixel = &image.pixels[3 * (y * image.width + x)..][..3];
            Rgb::new(linear[pixel[0] as usize], linear[pixel[1] as usize], linear[pixel[2] as usize])
        };
        let mut sum = Rgb::BLACK;
        for row in 0..cuts {
            for column in 0..cuts - row {
                sum += at(row, column, 1.0 / 3.0);
                if row + column + 2 <= cuts {
                    sum += at(row, column, 2.0 / 3.0);
                }
            }
        }
        sum * (1.0 / (cuts * cuts) as f64)
    };
    triangles.iter().map(mean).collect()
}

/// The pixel, counted along one side, that a coordinate falls on.
fn texel(coordinate: f64, wrap: WrappingMode, pixels: usize) -> usize {
    let within = match wrap {
        WrappingMode::Repeat => coordinate - coordinate.floor(),
        WrappingMode::ClampToEdge => coordinate,
        WrappingMode::MirroredRepeat => 1.0 - (coordinate - 2.0 * (coordinate / 2.0).floor() - 1.0).abs(),
    };
    // A cast takes what is no number to 0.
    ((within * pixels as f64) as usize).min(pixels - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: [[f64; 3]; 2] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    /// Black but for the right half, which is white.
    fn halves() -> Image {
        let pixels = (0..8 * 8).flat_map(|k| [if k % 8 < 4 { 0 } else { 255 }; 3]);
        Image { width: 8, height: 8, pixels: pixels.collect() }
    }

    #[test]
    fn a_mean_is_of_what_the_triangle_covers() {
        let placing = Placing { wrap: [WrappingMode::Repeat; 2], transform: PLAIN, set: 0 };
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 1.0], [8.0, 0.0], [8.0, 8.0]];
        let triangles = [[0, 1, 2], [0, 2, 3], [0, 4, 3], [0, 5, 6]];
        let means: Vec<f64> =
            means(&halves(), &placing, &corners, &triangles).iter().map(|mean| mean.g).collect();
        // Of the unit square's lower triangle three quarters lie right of the middle.
        for (mean, exact) in means.iter().zip([0.75, 0.25, 0.0, 0.5]) {
            assert!((mean - exact).abs() < 0.08, "{means:?}");
        }
    }

    #[test]
    fn coordinates_wrap_as_told() {
        let texel = |coordinate, wrap| texel(coordinate, wrap, 4);
        assert_eq!([-0.1, 0.0, 0.99, 1.1, 2.6].map(|c| texel(c, WrappingMode::Repeat)), [3, 0, 3, 0, 2]);
        assert_eq!([-0.1, 0.0, 0.99, 1.1].map(|c| texel(c, WrappingMode::ClampToEdge)), [0, 0, 3, 3]);
        assert_eq!(
            [-0.1, 0.1, 0.9, 1.1, 1.9].map(|c| texel(c, WrappingMode::MirroredRepeat)),
            [0, 0, 3, 3, 0]
        );
        assert_eq!(texel(f64::NAN, WrappingMode::Repeat), 0);
        assert_eq!(texel(f64::INFINITY, WrappingMode::MirroredRepeat), 0);
    }

    #[test]
    fn a_damaged_image_is_refused() {
        let mut png = Vec::new();
        let mut encoder = png::Encoder::new(&mut png, 2, 1);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.write_header().unwrap().write_image_data(&[7, 9]).unwrap();
        assert_eq!(decode(&png).unwrap().pixels, [7, 7, 7, 9, 9, 9]);
        for length in 0..png.len() - 12 {
            assert!(decode(&png[..length]).is_err(), "{length}");
        }
        assert!(decode(b"GIF89a").unwrap_err().contains("neither PNG nor JPEG"));
        assert!(decode(b"\xff\xd8\xff\xe0").is_err());
    }
}
