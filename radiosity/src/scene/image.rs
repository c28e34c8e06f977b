//! Image files: PNG and JPEG.

use std::io::Cursor;

use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::texture::Texture;

/// Pixels of an image.
const MOST_PIXELS: usize = 1 << 26;
/// Bytes of all images of a scene.
const MOST_BYTES: usize = 2 << 30;
/// The share of what is left of them that one image may take.
const ROOM: usize = 4;

/// The memory that the images of a scene take.
#[derive(Default)]
pub(super) struct ImageMemory {
    taken: usize,
}

impl ImageMemory {
    /// The texture that the bytes of an image are, and whether it had to be made coarser, the images before having taken
    /// most of the memory that there is for them.
    pub(super) fn decode(&mut self, bytes: &[u8]) -> Result<(Texture, bool), String> {
        let texture = decode(bytes)?;
        let size = texture.size();
        let texture = texture.within((MOST_BYTES - self.taken) / ROOM);
        self.taken = (self.taken + texture.bytes()).min(MOST_BYTES);
        let coarser = texture.size() != size;
        Ok((texture, coarser))
    }
}

fn decode(bytes: &[u8]) -> Result<Texture, String> {
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
        let pixels = pixels.chunks_exact(channels).take(width * height).map(|pixel| match channels {
            1 | 2 => [pixel[0]; 3],
            _ => [pixel[0], pixel[1], pixel[2]],
        });
        return Ok(Texture::new(width, height, pixels.collect()));
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
        return Ok(Texture::new(width, height, pixels.as_chunks().0.to_vec()));
    }
    Err("it is neither PNG nor JPEG: convert it to one of them".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn png(width: u32, height: u32, codes: &[u8]) -> Vec<u8> {
        let mut png = Vec::new();
        let mut encoder = png::Encoder::new(&mut png, width, height);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.write_header().unwrap().write_image_data(codes).unwrap();
        png
    }

    #[test]
    fn a_damaged_image_is_refused() {
        let whole = png(2, 1, &[7, 9]);
        assert_eq!(decode(&whole).unwrap(), Texture::new(2, 1, vec![[7; 3], [9; 3]]));
        for length in 0..whole.len() - 12 {
            assert!(decode(&whole[..length]).is_err(), "{length}");
        }
        assert!(decode(b"GIF89a").unwrap_err().contains("neither PNG nor JPEG"));
        assert!(decode(b"\xff\xd8\xff\xe0").is_err());
    }

    #[test]
    fn a_size_that_nobody_means_is_told() {
        // Width and height stand in the first chunk, whose checksum follows; nothing is made of such a size.
        let mut huge = png(2, 1, &[7, 9]);
        huge[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
        let checksum = crc32(&huge[12..29]);
        huge[29..33].copy_from_slice(&checksum.to_be_bytes());
        let why = decode(&huge).unwrap_err();
        assert!(why.contains("more than are read") || why.contains("imit"), "{why}");
        // The same of a JPEG's frame header.
        let jpeg =
            b"\xff\xd8\xff\xc0\0\x11\x08\xff\xff\xff\xff\x03\x01\x11\0\x02\x11\0\x03\x11\0\xff\xda\0\x0c\x03\
                     \x01\0\x02\0\x03\0\0\x3f\0\xff\xd9";
        let why = decode(jpeg).unwrap_err();
        assert!(
            why.contains("65535 x 65535 pixels are more than are read") || why.contains("damaged"),
            "{why}"
        );
    }

    fn crc32(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(!0_u32, |crc, &byte| {
            (0..8).fold(crc ^ u32::from(byte), |crc, _| crc >> 1 ^ (0xedb8_8320 & (crc & 1).wrapping_neg()))
        })
    }

    #[test]
    fn images_share_the_memory_there_is() {
        let mut memory = ImageMemory { taken: MOST_BYTES - ROOM * 100 };
        let (texture, coarser) = memory.decode(&png(8, 4, &[7; 32])).unwrap();
        assert!(coarser && texture.bytes() <= 100 && memory.taken < MOST_BYTES, "{texture:?}");
        assert!(!ImageMemory::default().decode(&png(8, 4, &[7; 32])).unwrap().1);
    }
}
