//! A pinhole camera with an off-axis window and clipping planes.

use glam::DVec3;

/// A perspective camera. `right`, `up` and `forward` are unit vectors at right angles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The centre of projection.
    pub eye: DVec3,
    /// Where it looks.
    pub forward: DVec3,
    /// To the right in the picture: `forward × up`.
    pub right: DVec3,
    /// Upwards in the picture.
    pub up: DVec3,
    /// The window's extent along `right`, at distance 1 from the eye: left, then right edge.
    pub horizontal: [f64; 2],
    /// The window's extent along `up`, at distance 1 from the eye: lower, then upper edge.
    pub vertical: [f64; 2],
    /// Nothing nearer than this along `forward` is seen; at least 0.
    pub near: f64,
    /// Nothing farther than this along `forward` is seen; infinite where nobody said.
    pub far: f64,
    /// The part of the picture that is drawn to, in 0..1: left, right, bottom, top.
    pub viewport: [f64; 4],
}
