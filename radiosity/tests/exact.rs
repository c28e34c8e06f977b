//! The exact form factors against the catalogue: Howell, A Catalog of Radiation Heat Transfer Configuration Factors.

use std::f64::consts::PI;
use std::ops::ControlFlow;

use glam::DVec3;
use proptest::prelude::*;
use radiosity::form_factors::exact::{between, from_point};
use radiosity::form_factors::visible::{ExactVisible, Scratch};
use radiosity::form_factors::{FormFactors, compute_rows};
use radiosity::geometry::polygon::area_vector;
use radiosity::patches::{self, Patches};
use radiosity::scene::{BackFaces, Scene, n3d};
use radiosity::simd::Level;
use radiosity::visibility::{Cells, FacetShape, Facets, RayTree};
use radiosity::watch::{Progress, ignore};

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

// What follows is the method: exact form factors times visibility, through the whole of it.

/// The six sides of the box from `low` to `high`, each of n x n patches, facing out or in.
fn sides(low: f64, high: f64, cells: usize, inward: bool) -> String {
    let (l, h) = (low, high);
    let inner = [
        [[l, l, l], [l, l, h], [h, l, h], [h, l, l]],
        [[l, h, l], [h, h, l], [h, h, h], [l, h, h]],
        [[l, l, l], [h, l, l], [h, h, l], [l, h, l]],
        [[l, l, h], [l, h, h], [h, h, h], [h, l, h]],
        [[l, l, l], [l, h, l], [l, h, h], [l, l, h]],
        [[h, l, l], [h, l, h], [h, h, h], [h, h, l]],
    ];
    let quad = |mut corners: [[f64; 3]; 4]| {
        if !inward {
            corners.swap(1, 3);
        }
        let numbers: Vec<String> = corners.iter().flatten().map(f64::to_string).collect();
        format!("QD {cells} {cells} {} ID\n", numbers.join(" "))
    };
    inner.map(quad).concat()
}

fn scene(text: &str, back_faces: BackFaces) -> Scene {
    Scene { back_faces, ..n3d::parse_scene("test.scn", text.as_bytes()).expect("a scene") }
}

fn exact_rows(scene: &Scene, accuracy: f64) -> (Patches, FormFactors) {
    let patches = patches::subdivide(scene, 1.0).expect("patches");
    let facets = Facets::new(scene, &patches);
    let exact = ExactVisible::new(&patches, &facets, scene.back_faces, accuracy).expect("an accuracy");
    let row = |patch, scratch: &mut Scratch| exact.row(patch, scratch);
    let factors = compute_rows(patches.len(), 1, Scratch::default, row, &mut ignore).expect("rows");
    (patches, factors)
}

/// From all patches of one surface to all of another.
fn from_surface(patches: &Patches, factors: &FormFactors, from: usize, to: usize) -> f64 {
    let [senders, receivers] = [from, to].map(|surface| patches.blocks[surface].patches());
    let area: f64 = patches.area[senders.clone()].iter().sum();
    let sent = senders.map(|i| {
        let arriving: f64 =
            factors.row(i).iter().filter(|(j, _)| receivers.contains(j)).map(|(_, f)| f).sum();
        patches.area[i] * arriving
    });
    sent.sum::<f64>() / area
}

/// A_i F_ij = A_j F_ji, but for the rounding of rows to single precision.
fn assert_reciprocal(patches: &Patches, factors: &FormFactors) {
    for i in 0..patches.len() {
        for (j, factor) in factors.row(i).iter() {
            let (there, back) = (patches.area[i] * factor, patches.area[j] * factors.row(j).get(i));
            assert!((there - back).abs() <= 2e-7 * there.max(back), "{i} {j}: {there} {back}");
        }
    }
}

#[test]
fn what_stands_between_hides_its_share() {
    let plates = |cells: usize, low: f64, high: f64| {
        format!(
            "QD {cells} {cells} 0 0 0 1 0 0 1 1 0 0 1 0 ID
             QD {cells} {cells} 0 0 1 0 1 1 1 1 1 1 0 1 ID
             QD 1 1 {low} {low} .5 {high} {low} .5 {high} {high} .5 {low} {high} .5 ID"
        )
    };
    for (low, high, answer) in [(0.0, 0.5, 0.149868671774), (0.25, 0.75, 0.0995062945990)] {
        for cells in [1, 3] {
            let scene = scene(&plates(cells, low, high), BackFaces::Black);
            let (patches, factors) = exact_rows(&scene, 1e-5);
            let found = from_surface(&patches, &factors, 0, 1);
            assert!((found - answer).abs() < 1e-5, "{low} {cells}: {found}, not {answer}");
            assert_reciprocal(&patches, &factors);
        }
    }
    // A screen that is wider than either hides all.
    let hidden = scene(&plates(2, -1.0, 2.0), BackFaces::Black);
    let (patches, factors) = exact_rows(&hidden, 1e-5);
    assert_eq!(from_surface(&patches, &factors, 0, 1), 0.0);
}

#[test]
fn a_gap_behind_a_cabinet_lets_its_light_through_and_no_more() {
    // A cabinet stands three hundredths before the wall: of the floor only the strip behind it sees the wall, and all
    // of it.
    let text = "QD 1 1 .8 0 .6 1.4 0 .6 1.4 0 0 .8 0 0 ID   QD 1 1 1 0 0 2 0 0 2 1 0 1 1 0 ID
        QD 1 1 1.4 0 .03 .2 0 .03 .2 .75 .03 1.4 .75 .03 ID
        QD 1 1 1.4 0 .6 1.4 0 .03 1.4 .75 .03 1.4 .75 .6 ID
        QD 1 1 .2 .75 .6 1.4 .75 .6 1.4 .75 .03 .2 .75 .03 ID";
    let corners = |corners: [[f64; 3]; 4]| corners.map(DVec3::from);
    let strip = corners([[0.8, 0.0, 0.03], [1.4, 0.0, 0.03], [1.4, 0.0, 0.0], [0.8, 0.0, 0.0]]);
    let screen = corners([[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [1.0, 1.0, 0.0]]);
    let answer = between(&strip, &screen) * 0.03 * 0.6;
    let (_, factors) = exact_rows(&scene(text, BackFaces::Black), 1e-5);
    let found = factors.row(1).get(0);
    // The strip is a twentieth of the floor. Rays alone are off by all of the answer, and points no nearer to one another
    // than a sixty-fourth of it by six hundredths.
    assert!((found - answer).abs() < 0.02 * answer, "{found}, not {answer}");
}

#[test]
fn rows_of_an_empty_cube_sum_to_1() {
    let (patches, factors) = exact_rows(&scene(&sides(0.0, 1.0, 8, true), BackFaces::Black), 1e-5);
    let (low, high) = factors.row_sum_range();
    assert!(low > 1.0 - 1e-6 && high < 1.0 + 1e-6, "{low} to {high}");
    assert_reciprocal(&patches, &factors);
    let (across, beside) = (from_surface(&patches, &factors, 0, 1), from_surface(&patches, &factors, 0, 2));
    assert!((across - 0.199824895698).abs() < 1e-7 && (beside - 0.200043776075).abs() < 1e-7);
}

#[test]
fn rows_of_a_cube_with_a_box_inside_sum_to_1() {
    let text = sides(0.0, 1.0, 4, true) + &sides(0.3, 0.6, 4, false);
    let (patches, factors) = exact_rows(&scene(&text, BackFaces::Black), 3e-5);
    let (low, high) = factors.row_sum_range();
    assert!(low > 1.0 - 1e-4 && high < 1.0 + 1e-4, "{low} to {high}");
    assert_reciprocal(&patches, &factors);
}

#[test]
fn a_white_furnace_stays_white_past_what_stands_in_it() {
    // One box stands on the floor, another through it, and a sheet of two sides hangs above.
    let box_at = |x: f64, y: f64, turn: f64| {
        format!("OC {} FI RT .5 .5 .5 0 1 0 {turn} TR {x} {y} 0 ID\n", sides(0.35, 0.65, 2, false))
    };
    let sheet =
        "QD 2 2 .2 .8 .2 .8 .8 .2 .8 .8 .8 .2 .8 .8 ID QD 2 2 .2 .8 .2 .2 .8 .8 .8 .8 .8 .8 .8 .2 ID\n";
    let text = sides(0.0, 1.0, 4, true) + &box_at(0.15, -0.35, 0.4) + &box_at(-0.2, -0.35, 0.0) + sheet;
    let scene = scene(&text, BackFaces::Black);
    let (patches, factors) = exact_rows(&scene, 3e-4);
    assert_reciprocal(&patches, &factors);
    // Patches of the floor that a box stands on see the black inside of it.
    for i in patches.blocks[1].patches().chain(patches.blocks[2].patches()) {
        let sum = factors.row(i).sum();
        assert!((sum - 1.0).abs() < 1e-3, "{i}: {sum}");
    }
    for i in 0..patches.len() {
        let sum = factors.row(i).sum();
        assert!(sum < 1.0 + 3e-3, "{i}: {sum}");
    }
}

#[test]
fn backs_are_black_or_lit() {
    // The upper plate shows its back to the lower.
    let text = "QD 2 2 0 0 0 1 0 0 1 1 0 0 1 0 ID  QD 2 2 0 0 1 1 0 1 1 1 1 0 1 1 ID";
    for (back_faces, answer) in [(BackFaces::Black, 0.0), (BackFaces::Lit, 0.199824895698)] {
        let (patches, factors) = exact_rows(&scene(text, back_faces), 1e-5);
        assert!((from_surface(&patches, &factors, 0, 1) - answer).abs() < 1e-7);
        assert_eq!(from_surface(&patches, &factors, 1, 0), 0.0);
    }
    // A wall that the floor's plane passes through shows its front to one half of it, and its back to the other.
    let crossed = "QD 1 1 -1 0 0 1 0 0 1 1 0 -1 1 0 ID  QD 1 1 0 0 0 0 1 0 0 1 1 0 0 1 ID";
    for (back_faces, answer) in [(BackFaces::Black, 0.5), (BackFaces::Lit, 1.0)] {
        let (patches, factors) = exact_rows(&scene(crossed, back_faces), 1e-5);
        let found = from_surface(&patches, &factors, 0, 1);
        assert!((found - answer * 0.200043776075).abs() < 1e-6, "{found}");
    }
}

#[test]
fn sheets_in_one_place_do_not_hide_each_other() {
    let floor = "QD 2 2 0 0 0 1 0 0 1 1 0 0 1 0 ID\n";
    let ceiling = "QD 2 2 0 0 1 0 1 1 1 1 1 1 0 1 ID\n";
    let sheet = "QD 1 1 0 0 1 1 0 1 1 1 1 0 1 1 ID\n";
    // The two sides of a sheet: its lower one is seen from below.
    for text in [format!("{floor}{ceiling}{sheet}"), format!("{floor}{sheet}{ceiling}")] {
        let (patches, factors) = exact_rows(&scene(&text, BackFaces::Black), 1e-5);
        let seen: f64 = [1, 2].iter().map(|&to| from_surface(&patches, &factors, 0, to)).sum();
        assert!((seen - 0.199824895698).abs() < 1e-7, "{seen}");
    }
    // Of two that face one way, and lie on one another in part, the first is seen and what it leaves of the second.
    let half = "QD 1 1 0 0 1 0 1 1 .5 1 1 .5 0 1 ID\n";
    let (patches, factors) = exact_rows(&scene(&format!("{floor}{half}{ceiling}"), BackFaces::Black), 1e-5);
    let [half, rest] = [1, 2].map(|to| from_surface(&patches, &factors, 0, to));
    assert!((half - rest).abs() < 1e-7 && (half + rest - 0.199824895698).abs() < 1e-7, "{half} {rest}");
}

#[test]
fn within_a_sphere_all_see_all_alike() {
    let (patches, factors) = exact_rows(&scene("SP NM 16 8 IN ID", BackFaces::Black), 1e-5);
    let (low, high) = factors.row_sum_range();
    assert!(low > 1.0 - 1e-5 && high < 1.0 + 1e-5, "{low} to {high}");
    for i in (0..patches.len()).step_by(7) {
        for j in (0..patches.len()).filter(|&j| j != i) {
            let share = patches.area[j] / (4.0 * PI);
            let found = factors.row(i).get(j);
            // Near ones lie flat beside one another, where the sphere's would not.
            let near = patches.centre[i].distance(patches.centre[j]) < 0.8;
            assert!(near || (found / share - 1.0).abs() < 0.15, "{i} {j}: {found}, not {share}");
        }
    }
}

/// Numbers from 0 to 1, the same at every run.
fn random() -> impl FnMut() -> f64 {
    let mut seed = 7_u64;
    move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as f64 / (1_u64 << 31) as f64
    }
}

/// Triangles and parallelograms of all kinds in a cube, through one another.
fn jumble(count: usize) -> String {
    let mut next = random();
    let mut text = sides(0.0, 1.0, 2, true);
    for k in 0..count {
        let mut v = |size: f64| [0; 3].map(|_| (next() - 0.5) * size);
        let (at, u, v) = (v(0.8).map(|x| x + 0.5), v(0.5), v(0.5));
        let sum = |a: [f64; 3], b: [f64; 3]| [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
        let corners = [at, sum(at, u), sum(sum(at, u), v), sum(at, v)];
        let corners = if k % 2 == 0 { &corners[..] } else { &corners[..3] };
        let numbers: Vec<String> = corners.iter().flatten().map(f64::to_string).collect();
        text += &format!("{} {} ID\n", if k % 2 == 0 { "QD 2 1" } else { "TI" }, numbers.join(" "));
    }
    text
}

#[test]
fn a_jumble_is_as_rays_without_number_have_it() {
    let scene = scene(&jumble(12), BackFaces::Black);
    let (patches, factors) = exact_rows(&scene, 3e-4);
    assert_reciprocal(&patches, &factors);
    let facets = Facets::new(&scene, &patches);
    let tree = RayTree::new(&facets);
    let mut next = random();
    let on = |patch: usize, s: f64, t: f64| {
        let facet = facets.of_surface(patches.surface[patch]).map(|k| facets[k]).next().expect("a facet");
        let (s, t) =
            if facet.shape == FacetShape::Triangle && s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
        match facet.cells {
            Cells::One(_) => facet.origin + facet.u * s + facet.v * t,
            Cells::Grid { first, columns, rows } => {
                let k = patch as u32 - first;
                let (u, v) = (
                    (f64::from(k % columns) + s) / f64::from(columns),
                    (f64::from(k / columns) + t) / f64::from(rows),
                );
                facet.origin + facet.u * u + facet.v * v
            }
        }
    };
    // Rows of the walls and of the jumble, a few: rays leave with the cosine's own density, so each tells of all patches.
    for i in (0..patches.len()).step_by(5) {
        let normal = patches.normal[i];
        let x = normal.any_orthonormal_vector();
        let y = normal.cross(x);
        const RAYS: usize = 20_000;
        let mut hits = vec![0.0; patches.len()];
        for _ in 0..RAYS {
            let (from, angle, sine) = (on(i, next(), next()), 2.0 * PI * next(), next());
            let (r, z) = (sine.sqrt(), (1.0 - sine).sqrt());
            let way = x * (r * angle.cos()) + y * (r * angle.sin()) + normal * z;
            let own = patches.surface[i];
            let seen = tree.nearest(from, way, f64::INFINITY, |k| (facets[k].surface != own).then_some(k));
            if let Some(hit) = seen.filter(|hit| facets[hit.facet].faces(from)) {
                hits[facets[hit.facet].patch_at(hit.u, hit.v) as usize] += 1.0 / RAYS as f64;
            }
        }
        for (j, &hit) in hits.iter().enumerate() {
            let found = factors.row(i).get(j);
            // Five standard deviations, and one ray.
            let bound = 5.0 * (found.max(hit) / RAYS as f64).sqrt() + 1.0 / RAYS as f64;
            assert!((found - hit).abs() < bound, "{i} {j}: {found}, rays {hit}");
        }
    }
}

/// Triangles of this size in a cube, through one another, each with a front on either side.
fn crowd(count: usize, size: f64) -> String {
    let mut next = random();
    let mut text = sides(0.0, 1.0, 2, true);
    for _ in 0..count {
        let mut v = |size: f64| [0; 3].map(|_| (next() - 0.5) * size);
        let at = v(0.6).map(|x| x + 0.5);
        let corners = [0; 3].map(|_| {
            let from = v(size);
            [0, 1, 2].map(|axis| at[axis] + from[axis])
        });
        for corners in [corners, [corners[0], corners[2], corners[1]]] {
            let numbers: Vec<String> = corners.iter().flatten().map(f64::to_string).collect();
            text += &format!("TI {} ID\n", numbers.join(" "));
        }
    }
    text
}

#[test]
fn a_crowd_of_triangles_through_one_another_closes_in_a_moment() {
    // Nearly all near pairs have crossing edges between them: without a bound on cuts this took minutes.
    let scene = scene(&crowd(40, 0.35), BackFaces::Black);
    let (patches, factors) = exact_rows(&scene, 1e-3);
    assert_reciprocal(&patches, &factors);
    let mean: f64 =
        (0..patches.len()).map(|i| (factors.row(i).sum() - 1.0).powi(2)).sum::<f64>() / patches.len() as f64;
    assert!(mean.sqrt() < 3e-3, "{}", mean.sqrt());
}

#[test]
fn some_columns_of_a_row_are_those_of_the_whole() {
    // Of scattered runs and of runs side by side.
    for (text, back_faces) in [(crowd(60, 0.02), BackFaces::Black), (jumble(6), BackFaces::Lit)] {
        let scene = scene(&text, back_faces);
        let patches = patches::subdivide(&scene, 1.0).expect("patches");
        let facets = Facets::new(&scene, &patches);
        let exact = ExactVisible::new(&patches, &facets, back_faces, 1e-3).expect("an accuracy");
        let mut scratch = Scratch::default();
        let some: Vec<bool> = (0..patches.len()).map(|j| j % 3 == 1).collect();
        for patch in 0..patches.len() {
            let whole = exact.row(patch, &mut scratch);
            let part = exact.row_among(patch, &some, &mut scratch);
            let wanted: Vec<_> = whole.iter().filter(|&(j, _)| some[j]).collect();
            assert_eq!(part.iter().collect::<Vec<_>>(), wanted, "{patch}");
        }
        // And pairs that are worked out once have the bits of rows found alone.
        let pairs = exact.rows(2, || |_, row| row, &mut ignore).expect("rows");
        assert!((0..patches.len()).all(|i| *pairs.row(i) == exact.row(i, &mut scratch)));
    }
}

#[test]
fn the_bits_depend_neither_on_threads_nor_on_the_processor() {
    let scene = scene(&(jumble(4) + "SP NM 8 4 HO .5 .5 .5 1 0 0 .2 ID"), BackFaces::Lit);
    let patches = patches::subdivide(&scene, 1.0).expect("patches");
    let facets = Facets::new(&scene, &patches);
    let exact = ExactVisible::new(&patches, &facets, BackFaces::Lit, 1e-3).expect("an accuracy");
    let rows = |threads, level| {
        let row = |patch, scratch: &mut Scratch| exact.row_at(level, patch, scratch);
        compute_rows(patches.len(), threads, Scratch::default, row, &mut ignore).expect("rows")
    };
    let one = rows(1, Level::best());
    assert_eq!(one, rows(3, Level::best()));
    for level in Level::available() {
        assert_eq!(one, rows(2, level), "{level:?}");
    }
    for accuracy in [0.0, 1.0, f64::NAN] {
        assert!(ExactVisible::new(&patches, &facets, BackFaces::Lit, accuracy).is_none());
    }
}

/// Scenes of all kinds: backs lit and black, what lies in part on something, patches of several flat parts that see one
/// another.
fn all_kinds() -> Vec<Scene> {
    let flush = "QD 3 1 .1 0 .1 .1 0 .6 .7 0 .6 .7 0 .1 ID QD 2 2 .5 0 .5 .5 0 .9 .9 0 .9 .9 0 .5 ID\n";
    let within = "SP NM 5 3 IN HO .3 .3 .3 1 0 0 .2 ID\n";
    let without = "SP NM 5 3 HO .5 .5 .5 1 0 0 .2 ID\n";
    let text = jumble(2) + flush + within + without;
    vec![scene(&text, BackFaces::Lit), scene(&text, BackFaces::Black)]
}

#[test]
fn pairs_worked_out_once_make_the_rows_that_each_patch_finds_by_itself() {
    for scene in all_kinds() {
        let patches = patches::subdivide(&scene, 1.0).expect("patches");
        let facets = Facets::new(&scene, &patches);
        let exact = ExactVisible::new(&patches, &facets, scene.back_faces, 1e-2).expect("an accuracy");
        let row = |patch, scratch: &mut Scratch| exact.row(patch, scratch);
        let alone = compute_rows(patches.len(), 1, Scratch::default, row, &mut ignore).expect("rows");
        for threads in [1, 3] {
            let mut told = Vec::new();
            let together = exact.rows(threads, || |_, row| row, &mut |progress| {
                told.push(*progress);
                ControlFlow::Continue(())
            });
            let together = together.expect("rows");
            for patch in 0..patches.len() {
                let [one, other] = [&alone, &together].map(|rows| rows.row(patch).iter().collect::<Vec<_>>());
                let differing = one.iter().zip(&other).find(|(one, other)| one != other);
                assert_eq!(
                    (differing, one.len()),
                    (None, other.len()),
                    "row {patch}, {:?}",
                    scene.back_faces
                );
            }
            let total = patches.len();
            assert_eq!(told.last(), Some(&Progress::FormFactors { done: total, total }));
            assert!(told.is_sorted_by_key(|progress| match progress {
                Progress::FormFactors { done, .. } => *done,
                _ => usize::MAX,
            }));
        }
        // New patches among old ones: whole rows of these, and what the others send them.
        let new: Vec<bool> = (0..patches.len()).map(|patch| patch % 7 == 3 || patch / 20 == 2).collect();
        let mut given = vec![None; patches.len()];
        let end = exact.rows_of_new(
            &new,
            2,
            || |_, row| row,
            |patch, row| {
                given[patch] = Some(row);
                ControlFlow::Continue(())
            },
        );
        assert_eq!(end, ControlFlow::Continue(()));
        for (patch, row) in given.into_iter().enumerate() {
            let seen: Vec<_> =
                alone.row(patch).iter().filter(|&(other, _)| new[patch] || new[other]).collect();
            assert_eq!(row.map(|row| row.iter().collect::<Vec<_>>()), Some(seen), "{patch}");
        }
    }
}

#[test]
fn pairs_are_left_when_the_caller_says_stop() {
    let scene = scene(&sides(0.0, 1.0, 6, true), BackFaces::Black);
    let patches = patches::subdivide(&scene, 1.0).expect("patches");
    let facets = Facets::new(&scene, &patches);
    let exact = ExactVisible::new(&patches, &facets, BackFaces::Black, 1e-3).expect("an accuracy");
    for threads in [1, 2] {
        let mut asked = 0;
        let found = exact.rows(threads, || |_, row| row, &mut |_| {
            asked += 1;
            ControlFlow::Break(())
        });
        assert!(found.is_err());
        assert_eq!(asked, 1);
    }
}
