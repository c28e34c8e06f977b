//! OpenEXR: linear light, as it was computed.

use std::io;
use std::path::Path;

use exr::image::write::WritableImage;
use exr::image::{Blocks, Encoding, Image, SpecificChannels};
use exr::prelude::{Compression, LineOrder, Vec2};

use super::{ExportError, whole_file};
use crate::shade::Picture;

/// Write a picture as OpenEXR: channels R, G, B in 32-bit floats, linear, bit for bit, in the unit of the scene's
/// emissions; ZIP-compressed scan lines. The file names no chromaticities, which means Rec. 709, sRGB's own.
pub fn write_exr(path: &Path, picture: &Picture) -> Result<(), ExportError> {
    whole_file(path, |writer| {
        let pixels = SpecificChannels::rgb(|Vec2(x, y)| {
            let [r, g, b] = picture.pixels[y * picture.width + x];
            (r, g, b)
        });
        let encoding = Encoding {
            compression: Compression::ZIP16,
            blocks: Blocks::ScanLines,
            line_order: LineOrder::Increasing,
        };
        Image::from_encoded_channels((picture.width, picture.height), encoding, pixels)
            .write()
            .to_buffered(writer)
            .map_err(|error| match error {
                exr::error::Error::Io(error) => error,
                other => io::Error::other(other),
            })
    })
}
