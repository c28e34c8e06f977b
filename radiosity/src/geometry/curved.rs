//! The unit sphere, the unit cylinder and the bilinear quadrilateral over their parameters (u, v), 0..1 each, and the
//! area of a part of them wherever an affine map takes them.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3};

/// A surface over the parameters (u, v).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Parametric {
    /// Radius 1 about the origin: u goes once around from +z towards +x, v from the pole at -y to the one at +y.
    Sphere,
    /// Radius 1 about the x axis: u goes once around from +y towards +z, v along x from 0 to 1.
    Cylinder,
    /// The corners at (0, 0), (1, 0), (1, 1), (0, 1), and straight lines between opposite sides.
    Bilinear([DVec3; 4]),
}

/// Nodes and weights of Gauss and Legendre's rule of eight points over -1..1; the other half is their mirror image.
const GAUSS: [[f64; 2]; 4] = [
    [0.183_434_642_495_649_8, 0.362_683_783_378_362],
    [0.525_532_409_916_329, 0.313_706_645_877_887_27],
    [0.796_666_477_413_626_7, 0.222_381_034_453_374_48],
    [0.960_289_856_497_536_3, 0.101_228_536_290_376_26],
];

impl Parametric {
    /// The point at (u, v). Where u is a whole number or v is 0 or 1, it is the same to the bit from either side: no seam,
    /// and one point a pole.
    pub fn point(&self, u: f64, v: f64) -> DVec3 {
        match self {
            Self::Sphere => {
                let (sin_u, cos_u) = around(u);
                let (radius, height) = meridian(v);
                DVec3::new(radius * sin_u, height, radius * cos_u)
            }
            Self::Cylinder => {
                let (sin_u, cos_u) = around(u);
                DVec3::new(v, cos_u, sin_u)
            }
            Self::Bilinear([a, b, c, d]) => {
                // Each corner comes out to the bit, and each side depends on its own two corners alone.
                let along = |from: DVec3, to: DVec3, s: f64| from * (1.0 - s) + to * s;
                along(along(*a, *b, u), along(*d, *c, u), v)
            }
        }
    }

    /// The derivatives by u and by v. u × v is the outward normal, or the side from which a quadrilateral's corners run
    /// counter-clockwise; its length is area a parameter area.
    pub fn derivatives(&self, u: f64, v: f64) -> [DVec3; 2] {
        match self {
            Self::Sphere => {
                let ((sin_u, cos_u), (sin_v, cos_v)) = ((TAU * u).sin_cos(), (PI * v).sin_cos());
                [
                    DVec3::new(cos_u, 0.0, -sin_u) * (TAU * sin_v),
                    DVec3::new(cos_v * sin_u, sin_v, cos_v * cos_u) * PI,
                ]
            }
            Self::Cylinder => {
                let (sin_u, cos_u) = (TAU * u).sin_cos();
                [DVec3::new(0.0, -sin_u, cos_u) * TAU, DVec3::X]
            }
            Self::Bilinear([a, b, c, d]) => [(*b - *a).lerp(*c - *d, v), (*d - *a).lerp(*c - *b, u)],
        }
    }

    /// The area of the cell `u` by `v` where `map` takes it: by an eight by eight Gauss-Legendre rule, exact to rounding
    /// for a sphere, a right cylinder and a flat quadrilateral in cells of up to a third of a turn.
    pub fn area(&self, map: DMat3, u: [f64; 2], v: [f64; 2]) -> f64 {
        let nodes = |[from, to]: [f64; 2]| {
            let (middle, half) = ((from + to) * 0.5, (to - from) * 0.5);
            GAUSS.into_iter().flat_map(move |[x, weight]| [-x, x].map(|x| (middle + half * x, half * weight)))
        };
        let mut sum = 0.0;
        for (v, weight_v) in nodes(v) {
            for (u, weight_u) in nodes(u) {
                let [along_u, along_v] = self.derivatives(u, v).map(|along| map * along);
                sum += along_u.cross(along_v).length() * weight_u * weight_v;
            }
        }
        sum
    }
}

/// Sine and cosine of u turns; a whole number of turns is none.
fn around(u: f64) -> (f64, f64) {
    if u.fract() == 0.0 { (0.0, 1.0) } else { (TAU * u).sin_cos() }
}

/// Distance from the axis and height at v of the way from pole to pole.
fn meridian(v: f64) -> (f64, f64) {
    if v == 0.0 {
        (0.0, -1.0)
    } else if v == 1.0 {
        (0.0, 1.0)
    } else {
        let (sin, cos) = (PI * v).sin_cos();
        (sin, -cos)
    }
}

/// By how much an unit sphere cut into `columns` by `rows` flat cells must be blown up for the cells' area to be the
/// sphere's. A convex body's shadow, averaged over all directions, is a quarter of its area (Cauchy): so blown up it takes
/// up as much of what others see as the sphere would.
pub fn equal_area_scale(columns: u32, rows: u32) -> f64 {
    let (sin, cos) = (PI / f64::from(columns)).sin_cos();
    let mut area = 0.0;
    let mut before = meridian(0.0);
    for row in 1..=rows {
        let here = meridian(f64::from(row) / f64::from(rows));
        // A trapezoid: two chords, and the distance between their middles.
        let height = ((here.0 - before.0) * cos).hypot(here.1 - before.1);
        area += (here.0 + before.0) * sin * height * f64::from(columns);
        before = here;
    }
    (2.0 * TAU / area).sqrt()
}

/// The most that a linear map stretches any vector: its greatest singular value.
pub fn greatest_stretch(map: DMat3) -> f64 {
    // The greatest eigenvalue of the symmetric map' map, in closed form (Smith 1961).
    let gram = map.transpose() * map;
    let mean = (gram.x_axis.x + gram.y_axis.y + gram.z_axis.z) / 3.0;
    let off = gram - DMat3::from_diagonal(DVec3::splat(mean));
    let spread =
        (off.x_axis.length_squared() + off.y_axis.length_squared() + off.z_axis.length_squared()) / 6.0;
    if spread <= 0.0 {
        return mean.max(0.0).sqrt();
    }
    let size = spread.sqrt();
    let half_determinant = ((off * (1.0 / size)).determinant() * 0.5).clamp(-1.0, 1.0);
    (mean + 2.0 * size * (half_determinant.acos() / 3.0).cos()).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn total(surface: Parametric, map: DMat3, columns: u32, rows: u32) -> f64 {
        let cells = |count: u32| {
            let at = move |k: u32| f64::from(k) / f64::from(count);
            (0..count).map(move |k| [at(k), at(k + 1)])
        };
        cells(rows).flat_map(|v| cells(columns).map(move |u| surface.area(map, u, v))).sum()
    }

    #[test]
    fn areas_of_a_sphere_and_a_right_cylinder_are_exact() {
        for (columns, rows) in [(3, 2), (4, 2), (24, 12)] {
            let sphere = total(Parametric::Sphere, DMat3::from_diagonal(DVec3::splat(3.0)), columns, rows);
            assert!((sphere / (9.0 * 4.0 * PI) - 1.0).abs() < 1e-13, "{sphere}");
            let map = DMat3::from_diagonal(DVec3::new(5.0, 2.0, 2.0));
            let cylinder = total(Parametric::Cylinder, map, columns, rows);
            assert!((cylinder / (2.0 * TAU * 5.0) - 1.0).abs() < 1e-13, "{cylinder}");
        }
    }

    #[test]
    fn the_area_of_a_spheroid_is_the_textbooks() {
        // Oblate, a = 2, c = 1: 2 π a² + π c²/e ln((1 + e) / (1 - e)), e² = 1 - c²/a².
        let e = 0.75_f64.sqrt();
        let oblate = 8.0 * PI + PI / e * ((1.0 + e) / (1.0 - e)).ln();
        let map = DMat3::from_diagonal(DVec3::new(2.0, 1.0, 2.0));
        assert!((total(Parametric::Sphere, map, 24, 12) / oblate - 1.0).abs() < 1e-10);
        // Prolate, a = 1, c = 3, its axis along x: 2 π a² (1 + c/(a e) asin e), e² = 1 - a²/c².
        let e = (1.0_f64 - 1.0 / 9.0).sqrt();
        let prolate = TAU * (1.0 + 3.0 / e * e.asin());
        let map = DMat3::from_diagonal(DVec3::new(3.0, 1.0, 1.0));
        assert!((total(Parametric::Sphere, map, 24, 12) / prolate - 1.0).abs() < 1e-10);
    }

    #[test]
    fn derivatives_are_those_of_the_point() {
        let saddle = [DVec3::ZERO, DVec3::X, DVec3::new(1.2, 1.0, 0.5), DVec3::Y];
        for surface in [Parametric::Sphere, Parametric::Cylinder, Parametric::Bilinear(saddle)] {
            for (u, v) in [(0.1, 0.2), (0.6, 0.7), (0.9, 0.4)] {
                let step = 1e-6;
                let by_u = (surface.point(u + step, v) - surface.point(u - step, v)) / (2.0 * step);
                let by_v = (surface.point(u, v + step) - surface.point(u, v - step)) / (2.0 * step);
                let [along_u, along_v] = surface.derivatives(u, v);
                assert!(by_u.abs_diff_eq(along_u, 1e-8) && by_v.abs_diff_eq(along_v, 1e-8), "{surface:?}");
                if !matches!(surface, Parametric::Bilinear(_)) {
                    let outward = surface.point(u, v) * DVec3::new(1.0, 1.0, 1.0)
                        - if surface == Parametric::Cylinder { DVec3::X * v } else { DVec3::ZERO };
                    let normal = along_u.cross(along_v).normalize();
                    assert!(normal.abs_diff_eq(outward, 1e-12), "{surface:?}: {normal} at {outward}");
                }
            }
        }
    }

    #[test]
    fn the_seam_and_the_poles_are_one_place() {
        for surface in [Parametric::Sphere, Parametric::Cylinder] {
            assert_eq!(surface.point(0.0, 0.3), surface.point(1.0, 0.3));
        }
        for v in [0.0, 1.0] {
            assert_eq!(Parametric::Sphere.point(0.37, v), Parametric::Sphere.point(0.0, v));
        }
    }

    #[test]
    fn cells_blown_up_have_the_spheres_area() {
        for (columns, rows) in [(3, 2), (8, 4), (24, 12)] {
            let scale = equal_area_scale(columns, rows);
            let mut area = 0.0;
            for row in 0..rows {
                for column in 0..columns {
                    let at = |c: u32, r: u32| {
                        let (u, v) = (f64::from(c) / f64::from(columns), f64::from(r) / f64::from(rows));
                        Parametric::Sphere.point(u, v) * scale
                    };
                    let (a, b) = (at(column, row), at(column + 1, row));
                    let (c, d) = (at(column + 1, row + 1), at(column, row + 1));
                    area += (c - a).cross(d - b).length() * 0.5;
                }
            }
            assert!((area / (2.0 * TAU) - 1.0).abs() < 1e-12, "{columns} x {rows}: {area}");
        }
        // Second order: twice as fine, a quarter as far off.
        let off = |n: u32| equal_area_scale(2 * n, n) - 1.0;
        assert!((off(16) / off(32) - 4.0).abs() < 0.05);
    }

    #[test]
    fn the_greatest_stretch_is_the_greatest_singular_value() {
        let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7);
        let other = DMat3::from_axis_angle(DVec3::new(-3.0, 1.0, 1.0).normalize(), 2.1);
        for sizes in [[1.0, 1.0, 1.0], [1.0, 2.0, 3.0], [5.0, 5.0, 0.1], [0.2, 0.2, 7.0]] {
            let map = turn * DMat3::from_diagonal(sizes.into()) * other;
            let greatest = sizes.into_iter().fold(0.0, f64::max);
            assert!((greatest_stretch(map) / greatest - 1.0).abs() < 1e-7, "{sizes:?}");
        }
    }
}
