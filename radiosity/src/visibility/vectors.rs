//! Vectors, one a lane.

use glam::DVec3;

use crate::simd::{LANES, Simd};

/// A vector for each lane, component by component.
pub(crate) type Vectors = [[f64; LANES]; 3];

/// A vector for each lane, in registers.
pub(crate) type Registers<S> = [<S as Simd>::Doubles; 3];

#[inline(always)]
pub(crate) fn load<S: Simd>(simd: S, v: &Vectors) -> Registers<S> {
    [simd.load_double(&v[0]), simd.load_double(&v[1]), simd.load_double(&v[2])]
}

#[inline(always)]
pub(crate) fn store<S: Simd>(simd: S, v: Registers<S>, to: &mut Vectors) {
    for axis in 0..3 {
        simd.store_double(v[axis], &mut to[axis]);
    }
}

#[inline(always)]
pub(crate) fn splat<S: Simd>(simd: S, v: DVec3) -> Registers<S> {
    [simd.splat_double(v.x), simd.splat_double(v.y), simd.splat_double(v.z)]
}

/// Three vectors, each in every lane.
#[inline(always)]
pub(crate) fn splat_axes<S: Simd>(simd: S, [x, y, z]: [DVec3; 3]) -> [Registers<S>; 3] {
    [splat(simd, x), splat(simd, y), splat(simd, z)]
}

#[inline(always)]
pub(crate) fn add<S: Simd>(simd: S, a: Registers<S>, b: Registers<S>) -> Registers<S> {
    [simd.add_double(a[0], b[0]), simd.add_double(a[1], b[1]), simd.add_double(a[2], b[2])]
}

#[inline(always)]
pub(crate) fn sub<S: Simd>(simd: S, a: Registers<S>, b: Registers<S>) -> Registers<S> {
    [simd.sub_double(a[0], b[0]), simd.sub_double(a[1], b[1]), simd.sub_double(a[2], b[2])]
}

#[inline(always)]
pub(crate) fn dot<S: Simd>(simd: S, a: Registers<S>, b: Registers<S>) -> S::Doubles {
    let xy = simd.add_double(simd.mul_double(a[0], b[0]), simd.mul_double(a[1], b[1]));
    simd.add_double(xy, simd.mul_double(a[2], b[2]))
}

#[inline(always)]
pub(crate) fn scale<S: Simd>(simd: S, a: Registers<S>, by: S::Doubles) -> Registers<S> {
    [simd.mul_double(a[0], by), simd.mul_double(a[1], by), simd.mul_double(a[2], by)]
}

#[inline(always)]
pub(crate) fn cross<S: Simd>(simd: S, a: Registers<S>, b: Registers<S>) -> Registers<S> {
    [
        simd.sub_double(simd.mul_double(a[1], b[2]), simd.mul_double(b[1], a[2])),
        simd.sub_double(simd.mul_double(a[2], b[0]), simd.mul_double(b[2], a[0])),
        simd.sub_double(simd.mul_double(a[0], b[1]), simd.mul_double(b[0], a[1])),
    ]
}

/// In axes given as registers.
#[inline(always)]
pub(crate) fn turn<S: Simd>(simd: S, axes: &[Registers<S>; 3], v: Registers<S>) -> Registers<S> {
    [dot(simd, axes[0], v), dot(simd, axes[1], v), dot(simd, axes[2], v)]
}

#[inline(always)]
pub(crate) fn magnitude<S: Simd>(simd: S, a: S::Doubles) -> S::Doubles {
    simd.max_double(a, simd.sub_double(simd.splat_double(0.0), a))
}
