//! Textures: the images behind them, and how they lie on triangles.

use std::collections::HashMap;
use std::sync::Arc;

use gltf::texture::{Info, WrappingMode};

use super::buffers::{Buffers, fetch};
use super::container::Opened;
use crate::scene::image::ImageMemory;
use crate::scene::texture::{Texture, Wrap};

/// Images, each decoded when it is first wanted.
#[derive(Default)]
pub(super) struct Images {
    kept: HashMap<usize, Result<(Arc<Texture>, bool), String>>,
    memory: ImageMemory,
}

impl Images {
    /// The image of a number, and whether it had to be made coarser; or why there is none.
    pub(super) fn get(
        &mut self,
        index: usize,
        opened: &Opened<'_>,
        buffers: &Buffers<'_>,
        resource: &mut impl FnMut(&str) -> Result<Vec<u8>, String>,
    ) -> Result<(Arc<Texture>, bool), String> {
        let memory = &mut self.memory;
        let decoded = || {
            let bytes = encoded(index, opened, buffers, resource)?;
            let (texture, coarser) = memory.decode(&bytes)?;
            Ok((Arc::new(texture), coarser))
        };
        self.kept.entry(index).or_insert_with(decoded).clone()
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

/// How an image lies on triangles.
pub(super) struct Placing {
    pub(super) wrap: [Wrap; 2],
    /// Of KHR_texture_transform, with (u, v) taken to (a u + b v + c, d u + e v + f).
    pub(super) transform: [[f64; 3]; 2],
    /// Which set of coordinates it goes by.
    pub(super) set: u32,
}

impl Placing {
    pub(super) fn new(info: &Info<'_>) -> Self {
        let sampler = info.texture().sampler();
        let wrap = |mode| match mode {
            WrappingMode::Repeat => Wrap::Repeat,
            WrappingMode::MirroredRepeat => Wrap::Mirror,
            WrappingMode::ClampToEdge => Wrap::Clamp,
        };
        let mut placing = Self {
            wrap: [wrap(sampler.wrap_s()), wrap(sampler.wrap_t())],
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
}
