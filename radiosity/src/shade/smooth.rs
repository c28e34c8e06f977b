//! From one value a patch to a value at every point of every surface.

use super::crease::PieceCorners;
use super::joints::Joints;
use crate::light::Rgb;
use crate::patches::Patches;
use crate::scene::Scene;
use crate::visibility::{Cells, Facet, Facets};

/// How the values between the patches' centres are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shading {
    /// Continuous over each smooth surface. On a parallelogram bilinear between the patches' centres and constant
    /// beyond the outermost ones, which is N3D's display, unless another one of the same colours goes on there smoothly, and
    /// nothing stands between the two: then they have one value at their border. On anything else linear between the corners of the flat pieces
    /// that its patches are made of, each corner the mean of the patches that meet there, with a break where there is
    /// an edge, or another colour.
    #[default]
    Smooth,
    /// Each patch shows its own value: what was solved, and nothing else.
    Flat,
}

/// A scene's surfaces with a colour at every point.
///
/// The colour may be any quantity that has one value a patch: radiosity, irradiance, reflectance, one row of form
/// factors. It comes out in the unit it went in with, and never beyond the least and greatest that went in.
#[derive(Clone, Debug)]
pub struct ShadedSurfaces<'a> {
    pub(super) facets: &'a Facets,
    values: &'a [Rgb],
    /// Where shading is smooth, the colours at the corners of all surfaces that are in pieces.
    corners: Option<CornerColours>,
}

#[derive(Clone, Debug)]
struct CornerColours {
    corners: PieceCorners,
    colours: Vec<[Rgb; 3]>,
    /// Grids that others go on with, and their values.
    joints: Joints,
    ringed: Vec<Rgb>,
}

impl<'a> ShadedSurfaces<'a> {
    /// Spread `values`, one a patch, over the surfaces of `scene`, of which `patches` and `facets` were made.
    ///
    /// # Panics
    ///
    /// Where `values` and `patches` differ in length.
    pub fn new(
        scene: &Scene,
        patches: &Patches,
        facets: &'a Facets,
        values: &'a [Rgb],
        shading: Shading,
    ) -> Self {
        assert_eq!(values.len(), patches.len(), "one value a patch");
        let corners = (shading == Shading::Smooth).then(|| {
            let corners = PieceCorners::new(scene, patches);
            let joints = Joints::new(scene, facets);
            let (colours, ringed) = (corners.values(values), joints.values(values));
            CornerColours { corners, colours, joints, ringed }
        });
        Self { facets, values, corners }
    }

    /// The facets whose points can be asked about.
    pub fn facets(&self) -> &'a Facets {
        self.facets
    }

    /// The colour of a facet at (u, v), which may lie outside the facet by a rounding error.
    pub fn at(&self, facet: u32, u: f64, v: f64) -> Rgb {
        self.on(facet, &self.facets[facet], u, v)
    }

    /// As [`ShadedSurfaces::at`], for who has the facet at hand.
    #[inline]
    pub(super) fn on(&self, number: u32, facet: &Facet, u: f64, v: f64) -> Rgb {
        let Some(corners) = &self.corners else { return self.values[facet.patch_at(u, v) as usize] };
        match facet.cells {
            Cells::Grid { first, columns, rows } => {
                if let Some(value) = corners.joints.at(&corners.ringed, number, [columns, rows], u, v) {
                    return value;
                }
                let (left, right, s) = neighbours(u, columns);
                let (lower, upper, t) = neighbours(v, rows);
                let patch = |column: u32, row: u32| self.values[(first + row * columns + column) as usize];
                let below = mix(patch(left, lower), patch(right, lower), s);
                let above = mix(patch(left, upper), patch(right, upper), s);
                mix(below, above, t)
            }
            Cells::One(_) => {
                let piece = number - self.facets.of_surface(facet.surface).start;
                let first = corners.corners.of_surface(facet.surface).start;
                let [a, b, c] = corners.colours[first + piece as usize];
                // Barycentric, with whatever rounding put outside the triangle brought back to its border.
                let (u, v) = (u.max(0.0), v.max(0.0));
                let beyond = (u + v).max(1.0);
                let (u, v) = (u / beyond, v / beyond);
                a + (b - a) * u + (c - a) * v
            }
        }
    }
}

/// The two of `cells` whose centres `s`, 0..1 along them, lies between, and how far it is from the first to the
/// second. Before the first centre and past the last, that one alone counts.
#[inline]
pub(super) fn neighbours(s: f64, cells: u32) -> (u32, u32, f64) {
    let last = cells - 1;
    let along = (s * f64::from(cells) - 0.5).max(0.0).min(f64::from(last));
    let before = along as u32;
    (before, (before + 1).min(last), along - f64::from(before))
}

#[inline]
pub(super) fn mix(from: Rgb, to: Rgb, share: f64) -> Rgb {
    from * (1.0 - share) + to * share
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn neighbours_clamp_at_both_ends() {
        assert_eq!(neighbours(0.0, 4), (0, 1, 0.0));
        assert_eq!(neighbours(0.1, 4), (0, 1, 0.0));
        assert_eq!(neighbours(0.25, 4), (0, 1, 0.5));
        assert_eq!(neighbours(0.95, 4), (3, 3, 0.0));
        assert_eq!(neighbours(1.0, 1), (0, 0, 0.0));
        // A point that is no number is still somewhere.
        assert_eq!(neighbours(f64::NAN, 4), (0, 1, 0.0));
    }

    proptest! {
        #[test]
        fn neighbours_find_the_place_again(s in 0.0..1.0, cells in 1_u32..100) {
            let (before, after, share) = neighbours(s, cells);
            let centre = |cell: u32| (f64::from(cell) + 0.5) / f64::from(cells);
            let place = centre(before) * (1.0 - share) + centre(after) * share;
            let clamped = s.clamp(centre(0), centre(cells - 1));
            prop_assert!((place - clamped).abs() < 1e-12);
            prop_assert!(after < cells && (0.0..1.0).contains(&share));
        }
    }
}
