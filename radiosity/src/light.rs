//! Light in three channels, and the units it is counted in.
//!
//! A scene names its own unit: `CE 20 20 20` is an exitance of 20 units of power per unit of area, in each
//! of three independent channels. Radiosity, irradiance and emission are all in that unit; reflectance has
//! none. Nothing here assumes watts or lumens.

use std::iter::Sum;
use std::ops::{Add, AddAssign, Mul, MulAssign, Sub};

/// Three independent channels: red, green, blue. A power per area, or a reflectance: the field says which.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rgb {
    /// Red.
    pub r: f64,
    /// Green.
    pub g: f64,
    /// Blue.
    pub b: f64,
}

impl Rgb {
    /// No light; a surface that reflects nothing.
    pub const BLACK: Self = Self::grey(0.0);
    /// One in each channel.
    pub const WHITE: Self = Self::grey(1.0);

    /// The three channels, red first.
    pub const fn new(r: f64, g: f64, b: f64) -> Self {
        Self { r, g, b }
    }

    /// The same value in each channel.
    pub const fn grey(value: f64) -> Self {
        Self::new(value, value, value)
    }

    /// The channels as an array, red first.
    pub const fn to_array(self) -> [f64; 3] {
        [self.r, self.g, self.b]
    }

    /// The largest of the three channels.
    pub fn max_channel(self) -> f64 {
        self.r.max(self.g).max(self.b)
    }

    /// Relative luminance under the sRGB primaries (ITU-R BT.709).
    pub fn luminance(self) -> f64 {
        0.2126 * self.r + 0.7152 * self.g + 0.0722 * self.b
    }

    /// dr² + dg² + db² of a difference: what N3D's `couleur - couleur` computes.
    pub fn norm_squared(self) -> f64 {
        self.r * self.r + self.g * self.g + self.b * self.b
    }

    /// Whether all three channels are zero.
    pub fn is_black(self) -> bool {
        self == Self::BLACK
    }
}

/// The code value, 0..1, of a linear one, clamped to 0..1 first (sRGB, IEC 61966-2-1:1999).
#[inline]
pub fn srgb_from_linear(linear: f32) -> f32 {
    let linear = linear.clamp(0.0, 1.0);
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The linear value of a code value in 0..1: the inverse of [`srgb_from_linear`].
#[inline]
pub fn linear_from_srgb(code: f32) -> f32 {
    if code <= 0.040_45 { code / 12.92 } else { ((code + 0.055) / 1.055).powf(2.4) }
}

impl From<[f64; 3]> for Rgb {
    fn from([r, g, b]: [f64; 3]) -> Self {
        Self::new(r, g, b)
    }
}

impl Add for Rgb {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.r + other.r, self.g + other.g, self.b + other.b)
    }
}

impl AddAssign for Rgb {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Sub for Rgb {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::new(self.r - other.r, self.g - other.g, self.b - other.b)
    }
}

impl Mul for Rgb {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self::new(self.r * other.r, self.g * other.g, self.b * other.b)
    }
}

impl Mul<f64> for Rgb {
    type Output = Self;
    fn mul(self, scale: f64) -> Self {
        Self::new(self.r * scale, self.g * scale, self.b * scale)
    }
}

impl MulAssign<f64> for Rgb {
    fn mul_assign(&mut self, scale: f64) {
        *self = *self * scale;
    }
}

impl Sum for Rgb {
    fn sum<I: Iterator<Item = Self>>(lights: I) -> Self {
        lights.fold(Self::BLACK, Add::add)
    }
}
