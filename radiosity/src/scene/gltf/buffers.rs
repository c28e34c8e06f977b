//! The bytes that accessors and images are made of.

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use gltf::buffer::{Source, View};
use percent_encoding::percent_decode_str;

use super::container::Opened;
use super::{Fault, fault, part};

/// Bytes of all buffers together; more is nobody's scene, and may be one file named again and again.
const MOST_BYTES: usize = 2 << 30;

/// Every buffer's bytes, in full length.
pub(super) struct Buffers<'a>(Vec<std::borrow::Cow<'a, [u8]>>);

impl<'a> Buffers<'a> {
    pub(super) fn load(
        opened: &Opened<'a>,
        resource: &mut impl FnMut(&str) -> Result<Vec<u8>, String>,
    ) -> Result<Self, Fault> {
        let mut buffers = Vec::new();
        let mut total = 0_usize;
        for buffer in opened.document.buffers() {
            let called = part("buffers", buffer.index(), buffer.name());
            let bytes = match buffer.source() {
                Source::Bin => match opened.blob {
                    Some(blob) => blob.into(),
                    None => {
                        return fault(format!(
                            "{called}: it has no uri, and the file no binary chunk; export it again"
                        ));
                    }
                },
                Source::Uri(uri) => {
                    fetch(uri, resource).map_err(|why| Fault(format!("{called}: {why}")))?.into()
                }
            };
            let bytes: std::borrow::Cow<'a, [u8]> = bytes;
            if bytes.len() < buffer.length() {
                let (wanted, there) = (buffer.length(), bytes.len());
                return fault(format!(
                    "{called}: it should have {wanted} bytes, and has {there}; copy its file again"
                ));
            }
            total += bytes.len();
            if total > MOST_BYTES {
                return fault(format!(
                    "{called}: the buffers together are larger than 2 GiB: split the scene"
                ));
            }
            buffers.push(bytes);
        }
        Ok(Self(buffers))
    }

    /// The bytes of a view.
    pub(super) fn view(&self, view: &View<'_>) -> Result<&[u8], Fault> {
        let buffer = view.buffer();
        let bytes = self.0.get(buffer.index()).map_or(&[][..], |bytes| bytes);
        let end = view.offset().checked_add(view.length());
        end.and_then(|end| bytes.get(view.offset()..end)).ok_or_else(|| {
            let (called, buffer) = (part("bufferViews", view.index(), view.name()), buffer.index());
            Fault(format!("{called}: it reaches beyond the end of buffers[{buffer}]; export the scene again"))
        })
    }
}

/// The bytes that a URI stands for, or why there are none.
pub(super) fn fetch(
    uri: &str,
    resource: &mut impl FnMut(&str) -> Result<Vec<u8>, String>,
) -> Result<Vec<u8>, String> {
    if let Some(data) = uri.strip_prefix("data:") {
        let Some((kind, data)) = data.split_once(',') else {
            return Err("its data: URI has no comma, and so no data".into());
        };
        if !kind.ends_with(";base64") {
            return Ok(percent_decode_str(data).collect());
        }
        // Some programs leave the padding out.
        let lenient = GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent);
        return GeneralPurpose::new(&STANDARD, lenient)
            .decode(data)
            .map_err(|error| format!("its data: URI is no base64 ({error}); export the scene again"));
    }
    if let Some((scheme, _)) = uri.split_once("://") {
        let scheme: String = scheme.chars().take(12).collect();
        return Err(format!(
            "nothing is fetched from the network ({scheme}://): put the file beside the scene"
        ));
    }
    resource(&percent_decode_str(uri).decode_utf8_lossy())
}
