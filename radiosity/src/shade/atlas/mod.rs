//! Surfaces laid out in one texture, so that each point of them has a texel of its own: what light maps are baked on.

mod charts;
mod packing;
mod texels;

use glam::DVec2;
use rayon::prelude::*;

use super::picture::{Picture, ScreenPicture};
use super::smooth::ShadedSurfaces;
use super::tone::{self, ToneMap};
use crate::patches::Patches;
use crate::scene::Scene;
use crate::visibility::Facets;
use packing::Place;
use texels::Baking;

/// Texels around each chart that hold what lies nearest on it. Filtering reads one beyond the border.
pub const PADDING: u32 = 2;
/// The least side of an atlas, which holds a chart or two.
pub const MIN_ATLAS_SIDE: u32 = 16;
/// The greatest: what today's graphics cards take.
pub const MAX_ATLAS_SIDE: u32 = 16_384;

/// The most bytes that a texel takes while a light map is made, its place in the file included.
const BYTES_PER_TEXEL: u64 = 48;

/// Where every facet of a scene lies in a texture.
///
/// Facets that are laid out together are a *chart*. A parallelogram's is a rectangle, and as each of its patches has an odd
/// number of texels along a side, one of them in the middle, bilinear filtering gives the bilinear shading itself. A
/// sphere's is its longitudes and latitudes, a cylinder's is unrolled; whatever else is in pieces is parted at its creases
/// and flattened (by the crate `uvunwrap`: least squares conformal maps). Charts do not overlap, and each has [`PADDING`]
/// texels about it that belong to no other.
#[derive(Clone, Debug, PartialEq)]
pub struct Atlas {
    /// Columns of texels.
    width: u32,
    /// Rows.
    height: u32,
    /// Texels a unit of length.
    density: f64,
    charts: Vec<Chart>,
    /// For each facet, where its corners at (0, 0), (1, 0) and (0, 1) lie. \[texels from the upper left corner\]
    facets: Vec<[DVec2; 3]>,
}

/// Facets that lie together in the texture.
#[derive(Clone, Debug, PartialEq)]
struct Chart {
    /// By number.
    facets: Vec<u32>,
    place: Place,
    /// Whether it is one facet, cut into a grid of patches.
    grid: bool,
}

/// Why a scene cannot be laid out.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum AtlasError {
    /// The side is none that a texture can have.
    #[error("a light map of {0} texels a side: it takes {MIN_ATLAS_SIDE} to {MAX_ATLAS_SIDE}")]
    Side(u32),
    /// There are too many charts, however small each is.
    #[error(
        "{charts} charts do not fit into a light map of {side} x {side} texels, though each be of the fewest texels that it \
         can have: {cure}"
    )]
    TooMany {
        /// How many.
        charts: usize,
        /// The side that was asked for.
        side: u32,
        /// What to do.
        cure: String,
    },
    /// A mesh that cannot be flattened.
    #[error("surface {surface} cannot be laid out in a light map ({why}): write vertex colours instead")]
    Unwrap {
        /// By number.
        surface: usize,
        /// What the unwrapper says.
        why: String,
    },
}

impl Atlas {
    /// Lay out `facets`, which are those of `scene` cut into `patches`, with as many texels a unit of length as fit into
    /// `side` x `side`; the atlas is no larger than what they take.
    ///
    /// # Errors
    /// [`AtlasError`].
    pub fn new(scene: &Scene, patches: &Patches, facets: &Facets, side: u32) -> Result<Self, AtlasError> {
        if !(MIN_ATLAS_SIDE..=MAX_ATLAS_SIDE).contains(&side) {
            return Err(AtlasError::Side(side));
        }
        let flat = charts::charts(scene, patches, facets)?;
        let packed = packing::pack(&flat, side)?;
        let mut corners = vec![[DVec2::ZERO; 3]; facets.as_slice().len()];
        let mut charts = Vec::with_capacity(flat.len());
        for (chart, place) in flat.into_iter().zip(packed.places) {
            for (facet, at) in &chart.facets {
                corners[*facet as usize] = at.map(|point| place.texel(&chart, point));
            }
            charts.push(Chart {
                facets: chart.facets.iter().map(|&(facet, _)| facet).collect(),
                place,
                grid: chart.cells.is_some(),
            });
        }
        let [width, height] = packed.size;
        Ok(Self { width, height, density: packed.density, charts, facets: corners })
    }

    /// Columns and rows of texels.
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// How many charts there are.
    pub fn charts(&self) -> usize {
        self.charts.len()
    }

    /// Texels a unit of the scene's length, about: a chart's sides are whole numbers of them.
    pub fn density(&self) -> f64 {
        self.density
    }

    /// The texture coordinates of the point (u, v) of a facet: 0..1 from the upper left corner of the texture, as glTF has
    /// them.
    pub fn coordinates(&self, facet: u32, u: f64, v: f64) -> [f64; 2] {
        let [origin, first, second] = self.facets[facet as usize];
        let at = origin + (first - origin) * u + (second - origin) * v;
        [at.x / f64::from(self.width), at.y / f64::from(self.height)]
    }

    /// The rectangle of texels that a chart has for itself, without the [`PADDING`] about it: first column and row, and
    /// how many.
    pub fn chart_texels(&self, chart: usize) -> ([u32; 2], [u32; 2]) {
        let place = &self.charts[chart].place;
        (place.first, place.texels)
    }

    /// The facets of a chart, by number.
    pub fn chart_facets(&self, chart: usize) -> &[u32] {
        &self.charts[chart].facets
    }

    /// The most bytes that making a light map of `side` x `side` takes.
    pub fn bytes(side: u32) -> u64 {
        u64::from(side).pow(2) * BYTES_PER_TEXEL
    }

    /// The values of `surfaces` in linear light and their own unit, a texel each, the top row first.
    ///
    /// A texel whose centre lies on a chart has the value of that point. Texels about a chart are chosen so that bilinear
    /// filtering gives at its border what the surface has there: where two charts meet smoothly no seam is seen. What lies
    /// farther off shows the mean of what is near, for programs that make smaller copies of the texture.
    pub fn light_map(&self, surfaces: &ShadedSurfaces<'_>) -> Picture {
        let pixels = self.bake(surfaces, f32::MAX, |colour| colour);
        Picture { width: self.width as usize, height: self.height as usize, pixels }
    }

    /// The same as a screen shows it.
    pub fn screen_light_map(&self, surfaces: &ShadedSurfaces<'_>, tone: ToneMap) -> ScreenPicture {
        let pixels = self.bake(surfaces, 1.0, tone.develop());
        let pixels = pixels.into_par_iter().map(tone::bytes).collect();
        ScreenPicture { width: self.width as usize, height: self.height as usize, pixels }
    }

    /// All texels, of values that `develop` makes something of between 0 and `most`.
    fn bake(
        &self,
        surfaces: &ShadedSurfaces<'_>,
        most: f32,
        develop: impl Fn([f32; 3]) -> [f32; 3] + Sync,
    ) -> Vec<[f32; 3]> {
        let value = |facet: u32, u: f64, v: f64| {
            // Beyond its border a grid goes on straight to what the next one has there, if need be below nought.
            develop(surfaces.at(facet, u, v).to_array().map(|channel| (channel as f32).max(0.0)))
        };
        let baking = Baking { facets: &self.facets, value: &value, most };
        // Some at a time, so that the largest and their copies in the atlas are not all there at once.
        let mut texels = vec![None; self.width as usize * self.height as usize];
        for some in self.charts.chunks(64) {
            let baked: Vec<_> = some.par_iter().map(|chart| baking.chart(chart)).collect();
            for (chart, baked) in some.iter().zip(baked) {
                let [width, height] = chart.place.padded().map(|side| side as usize);
                let [left, top] = chart.place.first.map(|first| (first - PADDING) as usize);
                for row in 0..height {
                    let start = (top + row) * self.width as usize + left;
                    texels[start..start + width].copy_from_slice(&baked[row * width..][..width]);
                }
            }
        }
        texels::filled(texels, [self.width as usize, self.height as usize])
    }
}
