//! N3D's transforms: TR, HO, RT, CZ, AV and MA.
//!
//! Points are columns, as in `world = M local`. The first transform written acts first, and a composite's act
//! after those of the objects in it, so each later one multiplies from the left.

use glam::{DAffine3, DMat3, DVec3};

use super::number::GREATEST;

/// Below this a factor, or a determinant relative to its matrix, counts as zero.
const SINGULAR: f64 = 1e-12;

/// An invertible affine map, and whether it turns right hands into left ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Transform {
    pub(super) map: DAffine3,
    /// Kept beside the map: a product of many determinants may underflow, a count of mirrors cannot.
    pub(super) mirrors: bool,
}

/// Why numbers make no transform: what is wrong, and the cure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct BadTransform {
    pub(super) message: &'static str,
    pub(super) help: &'static str,
}

const fn bad(message: &'static str, help: &'static str) -> BadTransform {
    BadTransform { message, help }
}

impl Transform {
    pub(super) const IDENTITY: Self = Self { map: DAffine3::IDENTITY, mirrors: false };

    /// This one first, then `later`. `None` where the product's numbers are out of all proportion.
    pub(super) fn then(self, later: Self) -> Option<Self> {
        let map = later.map * self.map;
        // NaN is not less than anything, so it is refused too.
        let ordinary = map.to_cols_array().iter().all(|x| x.abs() < GREATEST * GREATEST);
        ordinary.then_some(Self { map, mirrors: self.mirrors != later.mirrors })
    }

    /// `linear` about `centre`, which stays where it is.
    fn about(centre: DVec3, linear: DMat3) -> Self {
        Self {
            map: DAffine3 { matrix3: linear, translation: centre - linear * centre },
            mirrors: linear.determinant() < 0.0,
        }
    }
}

/// The vector's direction.
fn direction(vector: DVec3, message: &'static str) -> Result<DVec3, BadTransform> {
    vector.try_normalize().ok_or(bad(message, "give a vector of some length: only its direction counts"))
}

/// `a bᵀ`: what `b` measures, along `a`.
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// `TR`: move by `offset`.
pub(super) fn translate(offset: DVec3) -> Transform {
    Transform { map: DAffine3::from_translation(offset), mirrors: false }
}

/// `HO`: distances from `centre` along `axis` are multiplied by `factor`, those across it stay.
pub(super) fn scale_along(centre: DVec3, axis: DVec3, factor: f64) -> Result<Transform, BadTransform> {
    let axis = direction(axis, "HO's vector is zero")?;
    if factor.abs() < SINGULAR {
        return Err(bad(
            "HO by a factor of zero would flatten the object",
            "give a factor other than 0; 1 changes nothing, -1 mirrors",
        ));
    }
    Ok(Transform::about(centre, DMat3::IDENTITY + outer(axis, axis) * (factor - 1.0)))
}

/// `RT`: turn about the axis through `centre`, by `angle` radians, counter-clockwise seen with the axis
/// pointing at the eye (right-handed).
pub(super) fn rotate(centre: DVec3, axis: DVec3, angle: f64) -> Result<Transform, BadTransform> {
    let axis = direction(axis, "RT's axis is zero")?;
    Ok(Transform { mirrors: false, ..Transform::about(centre, DMat3::from_axis_angle(axis, angle)) })
}

/// `CZ`: a point moves by `slide` times its height above the plane through `centre` across `height_axis`.
/// Where `slide` is not in that plane, this scales as well.
pub(super) fn shear(centre: DVec3, height_axis: DVec3, slide: DVec3) -> Result<Transform, BadTransform> {
    let axis = direction(height_axis, "CZ's first vector is zero")?;
    // det(1 + w ûᵀ) = 1 + û·w
    if (1.0 + axis.dot(slide)).abs() < SINGULAR * (1.0 + slide.length()) {
        return Err(bad(
            "CZ with these vectors would flatten the object",
            "take a second vector at a right angle to the first",
        ));
    }
    Ok(Transform::about(centre, DMat3::IDENTITY + outer(slide, axis)))
}

/// `AV`: the smallest turn about the origin that takes the direction of `from` to that of `to`. Opposite
/// vectors: half a turn about `from` x the coordinate axis that is farthest from it (x before y before z).
pub(super) fn align(from: DVec3, to: DVec3) -> Result<Transform, BadTransform> {
    let from = direction(from, "AV's first vector is zero")?;
    let to = direction(to, "AV's second vector is zero")?;
    let cross = from.cross(to);
    let (sine, cosine) = (cross.length(), from.dot(to));
    let linear = if sine > SINGULAR {
        DMat3::from_axis_angle(cross / sine, sine.atan2(cosine))
    } else if cosine > 0.0 {
        DMat3::IDENTITY
    } else {
        let a = from.abs();
        let farthest = if a.x <= a.y && a.x <= a.z {
            DVec3::X
        } else if a.y <= a.z {
            DVec3::Y
        } else {
            DVec3::Z
        };
        let axis = from.cross(farthest).normalize();
        // Half a turn is 2 a aᵀ - 1.
        outer(axis, axis) * 2.0 - DMat3::IDENTITY
    };
    Ok(Transform { mirrors: false, ..Transform::about(DVec3::ZERO, linear) })
}

/// The first twelve numbers of `MA`, rows of three coefficients and an offset; and whether the other twelve
/// are its inverse, as they should be.
pub(super) fn matrix(numbers: &[f64; 24]) -> Result<(Transform, bool), BadTransform> {
    let affine = |n: &[f64]| {
        let rows = [0, 4, 8].map(|k| DVec3::new(n[k], n[k + 1], n[k + 2]));
        DAffine3 {
            matrix3: DMat3::from_cols_array_2d(&rows.map(|row| row.to_array())).transpose(),
            translation: DVec3::new(n[3], n[7], n[11]),
        }
    };
    let (map, inverse) = (affine(&numbers[..12]), affine(&numbers[12..]));
    let determinant = map.matrix3.determinant();
    let rows = map.matrix3.transpose();
    let size = rows.x_axis.length() * rows.y_axis.length() * rows.z_axis.length();
    // A row of zeros makes both sides zero.
    if determinant.abs() <= SINGULAR * size {
        return Err(bad(
            "MA's matrix is singular: it would flatten the object",
            "give three independent rows, each of three coefficients and an offset",
        ));
    }
    // Files carry few decimals, so only a gross difference counts.
    let product = map * inverse;
    let tolerance = 1e-3;
    let inverts = product.matrix3.abs_diff_eq(DMat3::IDENTITY, tolerance)
        && product.translation.length() <= tolerance * (1.0 + map.translation.length());
    Ok((Transform { map, mirrors: determinant < 0.0 }, inverts))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::*;

    const X: DVec3 = DVec3::X;
    const Y: DVec3 = DVec3::Y;
    const Z: DVec3 = DVec3::Z;

    fn moved(transform: Transform, point: [f64; 3]) -> DVec3 {
        transform.map.transform_point3(point.into())
    }

    fn near(a: DVec3, b: [f64; 3]) {
        assert!(a.abs_diff_eq(b.into(), 1e-12), "{a} is not {b:?}");
    }

    #[test]
    fn each_moves_a_point_as_its_sentence_says() {
        near(moved(translate(DVec3::new(1.0, 2.0, 3.0)), [1.0, 1.0, 1.0]), [2.0, 3.0, 4.0]);
        let stretched = scale_along(DVec3::ONE, X * 7.0, 3.0).unwrap();
        near(moved(stretched, [2.0, 5.0, 5.0]), [4.0, 5.0, 5.0]);
        near(moved(stretched, [1.0, 1.0, 1.0]), [1.0, 1.0, 1.0]);
        let quarter = rotate(X, Z * 2.0, FRAC_PI_2).unwrap();
        near(moved(quarter, [2.0, 0.0, 5.0]), [1.0, 1.0, 5.0]);
        let slid = shear(Z, Z * 4.0, X * 2.0).unwrap();
        near(moved(slid, [0.0, 0.0, 1.0]), [0.0, 0.0, 1.0]);
        near(moved(slid, [0.0, 0.0, 2.5]), [3.0, 0.0, 2.5]);
    }

    #[test]
    fn align_takes_the_first_to_the_second_even_when_opposed() {
        for (from, to) in [(X, Y), (X, X * 3.0), (X, -X), (Y, -Y), (Z, -Z), (DVec3::ONE, DVec3::NEG_ONE)] {
            let turned = align(from * 2.0, to).unwrap();
            near(turned.map.matrix3 * from.normalize(), to.normalize().to_array());
            assert!((turned.map.matrix3.determinant() - 1.0).abs() < 1e-12);
        }
        let slightly_off = DVec3::new(-1.0, 1e-9, 0.0);
        near(align(X, slightly_off).unwrap().map.matrix3 * X, slightly_off.normalize().to_array());
        // The smallest turn leaves what is across both alone.
        near(align(X, Y).unwrap().map.matrix3 * Z, [0.0, 0.0, 1.0]);
    }

    #[test]
    fn a_matrix_is_rows_of_coefficients_and_offset() {
        let there = [0.0, -1.0, 0.0, 10.0, 1.0, 0.0, 0.0, 20.0, 0.0, 0.0, 2.0, 30.0];
        let back = [0.0, 1.0, 0.0, -20.0, -1.0, 0.0, 0.0, 10.0, 0.0, 0.0, 0.5, -15.0];
        let mut numbers = [0.0; 24];
        numbers[..12].copy_from_slice(&there);
        numbers[12..].copy_from_slice(&back);
        let (turned, inverts) = matrix(&numbers).unwrap();
        assert!(inverts && !turned.mirrors);
        near(moved(turned, [1.0, 0.0, 1.0]), [10.0, 21.0, 32.0]);
        numbers[12] = 1.0;
        assert!(!matrix(&numbers).unwrap().1);
        numbers[10] = 0.0;
        assert!(matrix(&numbers).is_err());
    }

    #[test]
    fn order_and_mirrors() {
        let there = translate(X);
        let turn = rotate(DVec3::ZERO, Z, PI).unwrap();
        near(moved(there.then(turn).unwrap(), [0.0, 0.0, 0.0]), [-1.0, 0.0, 0.0]);
        near(moved(turn.then(there).unwrap(), [0.0, 0.0, 0.0]), [1.0, 0.0, 0.0]);
        let mirror = scale_along(DVec3::ZERO, X, -1.0).unwrap();
        assert!(
            mirror.mirrors && mirror.then(turn).unwrap().mirrors && !mirror.then(mirror).unwrap().mirrors
        );
    }

    #[test]
    fn what_cannot_be_undone_is_refused() {
        assert!(scale_along(X, DVec3::ZERO, 2.0).is_err());
        assert!(scale_along(X, X, 0.0).is_err());
        assert!(rotate(X, DVec3::ZERO, 2.0).is_err());
        assert!(shear(X, DVec3::ZERO, X).is_err());
        assert!(shear(X, Z, -Z).is_err());
        assert!(align(DVec3::ZERO, X).is_err() && align(X, DVec3::ZERO).is_err());
        assert!(matrix(&[0.0; 24]).is_err());
    }
}
