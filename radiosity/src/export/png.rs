//! PNG: eight bits of sRGB, and a chunk that says so.

use std::io;
use std::path::Path;

use super::{ExportError, whole_file};
use crate::shade::ScreenPicture;

/// Write a picture as a PNG of eight bits a channel, marked as sRGB (with the gamma and chromaticities that the
/// specification recommends beside it).
pub fn write_png(path: &Path, picture: &ScreenPicture) -> Result<(), ExportError> {
    whole_file(path, |writer| encode(writer, picture))
}

/// The same, to wherever the bytes are wanted.
pub(super) fn encode(writer: impl io::Write, picture: &ScreenPicture) -> io::Result<()> {
    let side = |pixels: usize| u32::try_from(pixels).map_err(io::Error::other);
    let mut encoder = png::Encoder::new(writer, side(picture.width)?, side(picture.height)?);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let mut png = encoder.write_header()?;
    let mut rows = png.stream_writer()?;
    for pixel in picture.pixels.chunks(4096) {
        io::Write::write_all(&mut rows, pixel.as_flattened())?;
    }
    rows.finish()?;
    png.finish()?;
    Ok(())
}
