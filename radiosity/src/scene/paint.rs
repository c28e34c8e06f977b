//! What varies over the triangles of a mesh: textures, and colours at corners.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::texture::{Texture, Wrap};
use crate::light::Rgb;

/// Texels that the triangles of a mesh are across, all of them together: where there are more, their texture is taken
/// coarser, but no triangle need be content with fewer than [`FEWEST_ACROSS`].
const MOST_ACROSS: f64 = (1 << 26) as f64;
const FEWEST_ACROSS: f64 = 128.0;
const FINEST_ACROSS: f64 = 65_536.0;

/// A coefficient that varies over the triangles of a mesh: a factor, times a texture, times colours at the corners.
#[derive(Clone, Debug, PartialEq)]
pub struct Paint {
    /// What the others are multiplied by.
    pub factor: Rgb,
    /// The texture, where there is one.
    pub texture: Option<TextureOn>,
    /// A colour at each corner of each triangle, linear between them; empty where there are none.
    pub colours: Vec<[[f32; 3]; 3]>,
}

/// A texture, and where triangles lie on it.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureOn {
    /// The texture, which others may share.
    pub texture: Arc<Texture>,
    /// What it is beyond its borders, along u and along v.
    pub wrap: [Wrap; 2],
    /// Takes coordinates (x, y) to (u, v) = (a x + b y + c, d x + e y + f): 0 to 1 over the texture, v downwards.
    pub transform: [[f64; 3]; 2],
    /// At each corner of each triangle.
    pub coordinates: Vec<[[f32; 2]; 3]>,
}

/// All of a triangle.
const WHOLE: [DVec2; 3] = [DVec2::ZERO, DVec2::X, DVec2::Y];

impl Paint {
    /// How many triangles it is of.
    fn triangles(&self) -> usize {
        self.texture.as_ref().map_or(self.colours.len(), |on| on.coordinates.len())
    }

    /// The mean over each triangle.
    pub(super) fn means(&self) -> Vec<Rgb> {
        (0..self.triangles()).into_par_iter().map(|triangle| self.mean(triangle, &[WHOLE])).collect()
    }

    /// The mean over parts of a triangle, which has these corners: of the texture by area, exactly, in linear light, and of
    /// the colours.
    pub fn over(&self, triangle: usize, [a, b, c]: [DVec3; 3], parts: &[[DVec3; 3]]) -> Rgb {
        let (u, v) = (b - a, c - a);
        let normal = u.cross(v);
        let shares = |corner: DVec3| {
            let to = corner - a;
            DVec2::new(to.cross(v).dot(normal), u.cross(to).dot(normal)) / normal.length_squared()
        };
        let parts: Vec<[DVec2; 3]> = parts.iter().map(|part| part.map(shares)).collect();
        self.mean(triangle, &parts)
    }

    fn mean(&self, triangle: usize, parts: &[[DVec2; 3]]) -> Rgb {
        let mut mean = self.factor;
        if let Some(on) = &self.texture {
            let corners = on.coordinates[triangle]
                .map(|[x, y]| on.transform.map(|[a, b, c]| a * f64::from(x) + b * f64::from(y) + c));
            let most = (MOST_ACROSS / self.triangles() as f64).clamp(FEWEST_ACROSS, FINEST_ACROSS);
            mean = mean * on.texture.under(on.wrap, corners, most).mean(parts);
        }
        if let Some(&colours) = self.colours.get(triangle) {
            let [a, b, c] = colours.map(|colour| Rgb::from(colour.map(f64::from)));
            let DVec2 { x, y } = centroid(parts);
            mean = mean * (a * (1.0 - x - y) + b * x + c * y);
        }
        mean
    }

    /// That of these triangles alone, their second and third corners exchanged where they are `turned`.
    pub(super) fn of(&self, triangles: &[u32], turned: bool) -> Self {
        fn picked<T: Copy>(all: &[[T; 3]], triangles: &[u32], turned: bool) -> Vec<[T; 3]> {
            let corners = |[a, b, c]: [T; 3]| if turned { [a, c, b] } else { [a, b, c] };
            if all.is_empty() {
                Vec::new()
            } else {
                triangles.iter().map(|&k| corners(all[k as usize])).collect()
            }
        }
        Self {
            factor: self.factor,
            texture: self.texture.as_ref().map(|on| TextureOn {
                coordinates: picked(&on.coordinates, triangles, turned),
                texture: Arc::clone(&on.texture),
                ..*on
            }),
            colours: picked(&self.colours, triangles, turned),
        }
    }

    /// The same with every triangle turned about.
    pub(super) fn turned(&self) -> Self {
        self.of(&(0..self.triangles() as u32).collect::<Vec<_>>(), true)
    }
}

/// The centroid of triangles.
fn centroid(parts: &[[DVec2; 3]]) -> DVec2 {
    let (mut moment, mut sum) = (DVec2::ZERO, 0.0);
    for &[a, b, c] in parts {
        let twice = (b - a).perp_dot(c - a);
        moment += (a + b + c) * (twice / 3.0);
        sum += twice;
    }
    if sum == 0.0 { DVec2::splat(1.0 / 3.0) } else { moment / sum }
}
