//! The exact form factors against the catalogue: Howell, A Catalog of Radiation Heat Transfer Configuration Factors.

use std::f64::consts::PI;

use glam::DVec3;
use proptest::prelude::*;
use radiosity::form_factors::exact::{between, from_point};
use radiosity::geometry::polygon::area_vector;

/// A rectangle of these sides in the plane z = 0, facing up, moved by `at`.
fn floor(width: f64, depth: f64, at: DVec3) -> Vec<DVec3> {
    [(0.0, 0.0), (width, 0.0), (width, depth), (0.0, depth)].map(|(x, y)| at + DVec3::new(x, y, 0.0)).to_vec()
}

/// The same, facing down.
fn ceiling(width: f64, depth: f64, at: DVec3) -> Vec<DVec3> {
    floor(width, depth, at).into_iter().rev().collect()
}

/// A wall on the edge from the origin along y, leaning by this angle against the floor x > 0.
fn wall(width: f64, height: f64, angle: f64) -> Vec<DVec3> {
    let up = DVec3::new(angle.cos(), 0.0, angle.sin()) * height;
    vec![DVec3::ZERO, DVec3::Y * width, DVec3::Y * width + up, up]
}

fn close(found: f64, exact: f64, what: &str) {
    assert!((found / exact - 1.0).abs() < 1e-10, "{what}: {found}, not {exact}");
}

/// Howell C-11.
fn parallel(x: f64, y: f64) -> f64 {
    let (xx, yy) = (1.0 + x * x, 1.0 + y * y);
    2.0 / (PI * x * y)
        * ((xx * yy / (1.0 + x * x + y * y)).sqrt().ln()
            + x * yy.sqrt() * (x / yy.sqrt()).atan()
            + y * xx.sqrt() * (y / xx.sqrt()).atan()
            - x * x.atan()
            - y * y.atan())
}

/// Howell C-14.
fn perpendicular(h: f64, w: f64) -> f64 {
    let (hh, ww) = (h * h, w * w);
    let angles =
        w * (1.0 / w).atan() + h * (1.0 / h).atan() - (hh + ww).sqrt() * (1.0 / (hh + ww).sqrt()).atan();
    let logarithm = (1.0 + ww).ln() + (1.0 + hh).ln() - (1.0 + ww + hh).ln()
        + ww * (ww * (1.0 + ww + hh) / ((1.0 + ww) * (ww + hh))).ln()
        + hh * (hh * (1.0 + hh + ww) / ((1.0 + hh) * (hh + ww))).ln();
    (angles + 0.25 * logarithm) / (PI * w)
}

#[test]
fn parallel_rectangles() {
    let published = [
        (0.1, 0.826994522397),
        (0.5, 0.415253283577),
        (1.0, 0.199824895698),
        (2.0, 0.0685895888186),
        (10.0, 0.00316205683876),
    ];
    for (gap, exact) in published {
        let found = between(&floor(1.0, 1.0, DVec3::ZERO), &ceiling(1.0, 1.0, DVec3::Z * gap));
        close(found, exact, "squares");
        close(found, parallel(1.0 / gap, 1.0 / gap), "squares, C-11");
    }
    for (width, exact) in [(2.0, 0.285875384851), (10.0, 0.386382489266)] {
        close(between(&floor(width, 1.0, DVec3::ZERO), &ceiling(width, 1.0, DVec3::Z)), exact, "rectangles");
    }
    let aside = between(&floor(1.0, 1.0, DVec3::ZERO), &ceiling(1.0, 1.0, DVec3::ONE));
    close(aside, 0.0433274095741, "offset squares");
}

#[test]
fn rectangles_with_a_common_edge() {
    let square = floor(1.0, 1.0, DVec3::ZERO);
    for (degrees, exact) in
        [(90.0_f64, 0.200043776075), (30.0, 0.619028323091), (60.0, 0.370905321150), (120.0, 0.0866150011183)]
    {
        close(between(&square, &wall(1.0, 1.0, degrees.to_radians())), exact, &format!("{degrees} degrees"));
    }
    for (height, exact) in [(2.0, 0.232852602795), (0.1, 0.0432513694007), (1.0, 0.200043776075)] {
        let found = between(&square, &wall(1.0, height, 0.5 * PI));
        close(found, exact, "perpendicular");
        close(found, perpendicular(height, 1.0), "perpendicular, C-14");
    }
}

#[test]
fn triangles_and_a_pentagon() {
    let floor = [DVec3::ZERO, DVec3::X, DVec3::Y];
    let wall = [DVec3::ZERO, DVec3::Y, DVec3::Z];
    close(between(&floor, &wall), (3.0 - 3.0_f64.sqrt()) / 6.0, "triangles that share a leg");

    let corners =
        [DVec3::ONE, DVec3::new(1.0, -1.0, -1.0), DVec3::new(-1.0, 1.0, -1.0), DVec3::new(-1.0, -1.0, 1.0)];
    let faces = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]].map(|face| {
        let face: Vec<DVec3> = face.iter().map(|&k: &usize| corners[k]).collect();
        // Facing inwards.
        if area_vector(&face).dot(face[0]) > 0.0 { face.into_iter().rev().collect() } else { face }
    });
    for from in &faces {
        for to in &faces {
            if from != to {
                close(between(from, to), 1.0 / 3.0, "tetrahedron");
            }
        }
    }

    let flat = |x: f64, y: f64| DVec3::new(x, y, 0.0);
    let pentagon = [flat(0.0, 0.0), flat(1.0, 0.0), flat(1.0, 1.0), flat(0.5, 2.0), flat(0.0, 1.0)];
    let square = [DVec3::ZERO, DVec3::Y, DVec3::Y + DVec3::Z, DVec3::Z];
    close(between(&pentagon, &square), 0.154124318249, "pentagon");
}

#[test]
fn what_lies_behind_exchanges_nothing() {
    let square = floor(1.0, 1.0, DVec3::ZERO);
    assert_eq!(between(&square, &floor(1.0, 1.0, DVec3::Z)), 0.0);
    assert_eq!(between(&square, &ceiling(1.0, 1.0, -DVec3::Z)), 0.0);
    assert_eq!(between(&square, &floor(1.0, 1.0, DVec3::X * 3.0)), 0.0);
    assert_eq!(between(&square, &[DVec3::Z, DVec3::Z, DVec3::Z]), 0.0);
    // A wall that reaches below the floor sees it with its upper half only.
    let wall = wall(1.0, 1.0, 0.5 * PI);
    let sunk: Vec<DVec3> = wall.iter().map(|c| if c.z == 0.0 { *c - DVec3::Z } else { *c }).collect();
    close(between(&square, &sunk), 0.200043776075, "sunk");
    close(between(&sunk, &square), 0.5 * 0.200043776075, "sunk, back");
}

#[test]
fn a_concave_polygon_is_the_sum_of_its_parts() {
    let flat = |x: f64, y: f64| DVec3::new(x, y, 0.0);
    let l_shape =
        [flat(0.0, 0.0), flat(2.0, 0.0), flat(2.0, 1.0), flat(1.0, 1.0), flat(1.0, 2.0), flat(0.0, 2.0)];
    let lamp = ceiling(0.5, 0.7, DVec3::new(1.2, 1.3, 0.8));
    let parts = between(&lamp, &floor(2.0, 1.0, DVec3::ZERO)) + between(&lamp, &floor(1.0, 1.0, DVec3::Y));
    close(between(&lamp, &l_shape), parts, "L");
    // A wall cuts it: its far side is out of the wall's sight, in two parts.
    let wall = [flat(1.5, 3.0), flat(1.5, -1.0), flat(1.5, -1.0) + DVec3::Z, flat(1.5, 3.0) + DVec3::Z];
    let seen = [floor(1.5, 1.0, DVec3::ZERO), floor(1.0, 1.0, DVec3::Y)];
    let parts: f64 = seen.iter().map(|part| between(&wall, part)).sum();
    close(between(&wall, &l_shape), parts, "L before a wall");
}

#[test]
fn from_a_point() {
    // Howell B-4: over a corner of the unit square, at distance 1.
    let square = ceiling(1.0, 1.0, DVec3::Z);
    let exact = 0.138531605995;
    close(from_point(DVec3::ZERO, DVec3::Z, &square), exact, "over a corner");
    close(
        from_point(DVec3::ZERO, DVec3::Z, &ceiling(2.0, 2.0, DVec3::new(-1.0, -1.0, 1.0))),
        4.0 * exact,
        "over the middle",
    );
    assert_eq!(from_point(DVec3::ZERO, -DVec3::Z, &square), 0.0);
    assert_eq!(from_point(DVec3::Z * 2.0, -DVec3::Z, &square), 0.0);
    // A polygon of many corners is a disc, r² / (r² + h²).
    let disc: Vec<DVec3> = (0..4000)
        .map(|k| f64::from(k) * -2.0 * PI / 4000.0)
        .map(|angle| DVec3::new(angle.cos(), angle.sin(), 1.0))
        .collect();
    assert!((from_point(DVec3::ZERO, DVec3::Z, &disc) - 0.5).abs() < 1e-6);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn reciprocity_closure_and_the_mean_of_points(
        low in proptest::array::uniform3(-1.0..0.0_f64),
        size in proptest::array::uniform3(0.05..3.0_f64),
        at in (0.01..0.99_f64, 0.01..0.99_f64),
    ) {
        let (low, size) = (DVec3::from(low) * 100.0, DVec3::from(size));
        let (x, y, z) = (DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z);
        let face = |origin: DVec3, u: DVec3, v: DVec3| vec![origin, origin + u, origin + u + v, origin + v];
        let sides = [
            face(low, x, y), face(low + z, y, x), face(low, z, x), face(low + y, x, z), face(low, y, z), face(low + x, z, y),
        ];
        let area = |k: usize| area_vector(&sides[k]).length();
        for i in 0..6 {
            let row: Vec<f64> = (0..6).map(|j| if i == j { 0.0 } else { between(&sides[i], &sides[j]) }).collect();
            prop_assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-11, "{:?}", row);
            for j in (0..6).filter(|&j| j != i) {
                let back = between(&sides[j], &sides[i]);
                prop_assert!((area(i) * row[j] - area(j) * back).abs() < 1e-11 * area(i).max(area(j)));
            }
        }
        // From a point of the floor, the other five sides are all there is.
        let point = low + x * at.0 + y * at.1;
        let seen: f64 = (1..6).map(|j| from_point(point, DVec3::Z, &sides[j])).sum();
        prop_assert!((seen - 1.0).abs() < 1e-12, "{}", seen);
    }
}
