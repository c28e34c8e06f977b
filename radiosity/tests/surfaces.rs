//! Spheres, cylinders, general quadrilaterals, fractals and polygons cut by size: their areas, form factors and shading
//! against known answers (Howell's catalogue; Hamilton & Morgan 1952; Feingold 1978).

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};
use std::fmt::Write;

use glam::DVec3;
use radiosity::form_factors::hemicube::{CellWeights, Hemicube, Scratch};
use radiosity::form_factors::{FormFactors, compute_rows};
use radiosity::light::Rgb;
use radiosity::patches::{Patches, SubdivideError, Subdivision, count, subdivide};
use radiosity::scene::n3d::parse_scene;
use radiosity::scene::{BackFaces, Scene};
use radiosity::shade::{ShadedSurfaces, Shading};
use radiosity::solve;
use radiosity::visibility::{FacetShape, Facets, RayTree};
use radiosity::watch::ignore;

fn scene(text: &str) -> Scene {
    parse_scene("a.scn", text.as_bytes()).unwrap_or_else(|error| panic!("{error}: {text:.400}"))
}

fn patches(text: &str) -> Patches {
    subdivide(&scene(text), 1.0).unwrap()
}

fn factors(scene: &Scene, subdivision: impl Into<Subdivision>, precision: u32) -> (Patches, FormFactors) {
    let patches = subdivide(scene, subdivision).unwrap();
    let facets = Facets::new(scene, &patches);
    let weights = CellWeights::new(precision).unwrap();
    let hemicube = Hemicube::new(&patches, &facets, scene.back_faces, weights);
    let row = |patch, scratch: &mut Scratch| hemicube.row(patch, scratch);
    let found = compute_rows(patches.len(), 0, Scratch::default, row, &mut ignore).unwrap();
    (patches, found)
}

/// The form factor from all of one surface to all of another.
fn between(patches: &Patches, factors: &FormFactors, from: usize, to: usize) -> f64 {
    let [from, to] = [from, to].map(|surface| patches.blocks[surface].patches());
    let of_row =
        |i: usize| factors.row(i).iter().filter(|(j, _)| to.contains(j)).map(|(_, f)| f).sum::<f64>();
    let power: f64 = from.clone().map(|i| patches.area[i] * of_row(i)).sum();
    power / from.map(|i| patches.area[i]).sum::<f64>()
}

#[track_caller]
fn near(found: f64, exact: f64, tolerance: f64) {
    assert!((found / exact - 1.0).abs() < tolerance, "{found} is not {exact}: {}", found / exact - 1.0);
}

/// Every row sums to 1.
#[track_caller]
fn closed(factors: &FormFactors) {
    let (low, high) = factors.row_sum_range();
    assert!((low - 1.0).abs() < 1e-5 && (high - 1.0).abs() < 1e-5, "{low} to {high}");
}

/// A disc in the plane x = `x`, of rings of `around` triangles and quadrilaterals, as a VO; its front is towards +x, or -x.
/// Its corners are those of a CL of as many columns.
fn disc(x: f64, radius: f64, around: u32, rings: u32, front: f64) -> String {
    let mut text = format!("VO 0 0 0 {} {x} 0 0", 1 + around * rings);
    for ring in 1..=rings {
        for k in 0..around {
            let (sin, cos) = (TAU * (f64::from(k) / f64::from(around))).sin_cos();
            let radius = radius * (f64::from(ring) / f64::from(rings));
            write!(text, " {x} {} {}", radius * cos, radius * sin).unwrap();
        }
    }
    let at = |ring: u32, k: u32| if ring == 0 { 1 } else { 2 + (ring - 1) * around + k % around };
    write!(text, " {}", around * (2 * rings - 1)).unwrap();
    let mut triangle = |[a, b, c]: [u32; 3]| {
        let [b, c] = if front > 0.0 { [b, c] } else { [c, b] };
        write!(text, " {a} {b} {c}").unwrap();
    };
    for ring in 0..rings {
        for k in 0..around {
            triangle([at(ring, k), at(ring + 1, k), at(ring + 1, k + 1)]);
            if ring > 0 {
                triangle([at(ring, k), at(ring + 1, k + 1), at(ring, k + 1)]);
            }
        }
    }
    text + " ID\n"
}

#[test]
fn a_sphere_has_its_area_and_faces_outward_wherever_it_is_taken() {
    let sphere = patches("SP ID");
    assert_eq!((sphere.blocks[0].columns, sphere.blocks[0].rows, sphere.len()), (24, 12, 288));
    near(sphere.total_area(), 4.0 * PI, 1e-13);
    // A band's area is that of its height (Archimedes).
    let height = (PI / 12.0).cos();
    near(sphere.area[0], TAU * (1.0 - height) / 24.0, 1e-12);
    for (attributes, side) in [
        ("", 1.0),
        ("IN", -1.0),
        ("HO 0 0 0 1 0 0 -1", 1.0),
        ("IN HO 0 0 0 1 0 0 -1", -1.0),
        ("HO 0 0 0 0 1 0 -3 RT 1 2 3 1 1 0 .4 CZ 0 0 0 0 0 1 1 0 0", 1.0),
    ] {
        let sphere = patches(&format!("SP NM 13 7 {attributes} TR 7 8 9 ID"));
        let middle = sphere.centre.iter().sum::<DVec3>() / sphere.len() as f64;
        for (centre, normal) in sphere.centre.iter().zip(&sphere.normal) {
            assert!(side * (*centre - middle).dot(*normal) > 0.1, "{attributes}: {centre} {normal}");
            assert!((normal.length() - 1.0).abs() < 1e-12);
        }
    }
    // Shear keeps volumes, not areas; a mirror keeps both.
    near(patches("SP HO 0 0 0 1 0 0 -1 ID").total_area(), 4.0 * PI, 1e-13);
}

#[test]
fn a_cylinder_has_its_area_and_faces_outward() {
    let cylinder = patches("CL NM 9 2 HO 0 0 0 1 0 0 5 HO 0 0 0 0 1 0 2 HO 0 0 0 0 0 1 2 ID");
    near(cylinder.total_area(), TAU * 2.0 * 5.0, 1e-13);
    near(cylinder.area[4], TAU * 10.0 / 18.0, 1e-12);
    for (centre, normal) in cylinder.centre.iter().zip(&cylinder.normal) {
        assert!(centre.dot(*normal) > 0.9 && normal.x.abs() < 1e-15, "{centre} {normal}");
    }
    let room = patches("CL IN ID");
    assert!(room.centre.iter().zip(&room.normal).all(|(centre, normal)| centre.dot(*normal) < -0.9));
}

/// The pieces that stand for a curved surface come to its area, and their normals to its own, at second order.
#[test]
fn pieces_converge_at_second_order() {
    let off = |n: u32, shape: &str| {
        let patches = patches(&format!("{shape} NM {} {n} HO 0 0 0 1 0 0 2 ID", 2 * n));
        let pieces = patches.pieces[0].as_ref().unwrap();
        let area = |t: &[DVec3; 3]| (t[1] - t[0]).cross(t[2] - t[0]).length() * 0.5;
        (pieces.triangles.iter().map(area).sum::<f64>() / patches.total_area() - 1.0).abs()
    };
    // A sphere's are blown up to its area; of an ellipsoid's, and of a cylinder's, something is left.
    for (shape, least) in [("SP", 1e-2), ("CL", 1e-2)] {
        let [coarse, fine] = [off(10, shape), off(20, shape)];
        assert!(coarse < least && (3.5..4.5).contains(&(coarse / fine)), "{shape}: {coarse} {fine}");
    }
    let worst_normal = |n: u32| {
        let sphere = patches(&format!("SP NM {} {n} ID", 2 * n));
        // Against the sphere's own normal above the cell's centre.
        let off = sphere.centre.iter().zip(&sphere.normal).map(|(c, n)| c.normalize().angle_between(*n));
        off.fold(0.0, f64::max)
    };
    assert!(worst_normal(40) < worst_normal(10) / 3.0 && worst_normal(40) < 0.02);
}

#[test]
fn inside_a_sphere_every_factor_is_its_share_of_the_area() {
    let (patches, factors) = factors(&scene("SP NM 32 16 IN ID"), 1.0, 200);
    closed(&factors);
    let (mut squares, mut octant_squares) = (0.0, 0.0);
    for i in 0..patches.len() {
        let mut octants = [[0.0; 2]; 8];
        for j in 0..patches.len() {
            let (found, exact) = (factors.row(i).get(j), patches.area[j] / (4.0 * PI));
            if i != j {
                squares += (found / exact - 1.0).powi(2);
            }
            let c = patches.centre[j];
            let octant = usize::from(c.x > 0.0) | usize::from(c.y > 0.0) << 1 | usize::from(c.z > 0.0) << 2;
            octants[octant][0] += found;
            octants[octant][1] += exact;
        }
        octant_squares += octants.iter().map(|[found, exact]| (found / exact - 1.0).powi(2)).sum::<f64>();
    }
    // Single factors of .001 to .003, a hundred cells each, of flat cells that see their neighbours more edge-on than the
    // sphere would; and their sums.
    let spread = (squares / (patches.len() as f64).powi(2)).sqrt();
    let of_octants = (octant_squares / (8 * patches.len()) as f64).sqrt();
    assert!(spread < 0.07 && of_octants < 0.02, "{spread} {of_octants}");
}

#[test]
fn light_inside_a_sphere_is_the_same_everywhere() {
    let (mut patches, factors) = factors(&scene("SP NM 24 12 IN ID"), 1.0, 100);
    // Half of it emits and reflects half, the other reflects four fifths: H = mean(E) / (1 - mean(ρ)).
    for k in 0..patches.len() {
        let lower = patches.centre[k].y < 0.0;
        patches.emission[k] = Rgb::grey(if lower { 1.0 } else { 0.0 });
        patches.reflectance[k] = Rgb::grey(if lower { 0.5 } else { 0.8 });
    }
    let solution = solve::gauss_seidel(&patches, &factors, 1e-9, &mut ignore).unwrap();
    for irradiance in &solution.irradiance {
        near(irradiance.r, 1.428571429, 0.01);
    }
    // A bowl: what is within 60° of the top is open, and all else emits and reflects half.
    for k in 0..patches.len() {
        let open = patches.centre[k].normalize().y > 0.5;
        patches.emission[k] = Rgb::grey(if open { 0.0 } else { 0.5 });
        patches.reflectance[k] = patches.emission[k];
    }
    let solution = solve::gauss_seidel(&patches, &factors, 1e-9, &mut ignore).unwrap();
    for (k, radiosity) in solution.radiosity.iter().enumerate() {
        if patches.emission[k].r > 0.0 {
            near(radiosity.r, 0.8, 0.006);
        }
    }
}

#[test]
fn nothing_leaks_out_of_any_ellipsoid() {
    for attributes in [
        "NM 3 2",
        "NM 7 5 HO 0 0 0 1 0 0 4",
        "NM 24 12 HO 0 0 0 0 1 0 .2 RT 0 0 0 1 2 3 .7 TR 100 -50 30",
        "NM 16 9 CZ 0 0 0 0 1 0 1.5 0 .5 HO 0 0 0 1 0 0 -2",
    ] {
        let (_, factors) = factors(&scene(&format!("SP IN {attributes} ID")), 1.0, 50);
        closed(&factors);
    }
}

#[test]
fn a_convex_body_does_not_see_itself() {
    for text in
        ["SP ID", "CL ID", "SP HO 0 0 0 0 1 0 .1 RT 0 0 0 1 2 3 .7 TR 5 5 5 ID", "CL HO 0 0 0 0 1 0 .1 ID"]
    {
        let (_, factors) = factors(&scene(text), 1.0, 50);
        assert_eq!(factors.row_sum_range(), (0.0, 0.0), "{text}");
    }
}

#[test]
fn a_closed_cylinder() {
    // Radius and height 1: Howell C-41, C-78, C-79.
    let text = format!("CL NM 48 10 IN ID\n{}{}", disc(0.0, 1.0, 48, 8, 1.0), disc(1.0, 1.0, 48, 8, -1.0));
    let (patches, factors) = factors(&scene(&text), 1.0, 100);
    closed(&factors);
    near(between(&patches, &factors, 1, 2), 0.381966011250, 0.01);
    near(between(&patches, &factors, 1, 0), 0.618033988750, 0.01);
    near(between(&patches, &factors, 0, 1), 0.309016994375, 0.01);
    near(between(&patches, &factors, 0, 0), 0.381966011250, 0.01);
}

#[test]
fn polygons_of_as_many_corners_cap_a_cylinder() {
    let cap = |x: f64, order: &dyn Fn(u32) -> u32| {
        let corner = |k: u32| {
            let (sin, cos) = (TAU * (f64::from(order(k) % 24) / 24.0)).sin_cos();
            if order(k).is_multiple_of(24) { format!("{x} 1 0 ") } else { format!("{x} {cos} {sin} ") }
        };
        format!("PG {} ID ", (0..=24).map(corner).collect::<String>())
    };
    let text = format!("CL IN ID {} {}", cap(0.0, &|k| k), cap(1.0, &|k| 24 - k));
    let (patches, factors) = factors(&scene(&text), 1.0, 50);
    assert_eq!(patches.len(), 98);
    closed(&factors);
    // From a cap's middle, where its one patch looks out: half sees the other cap, but for what a polygon of 24 corners lacks.
    near(factors.row(96).get(97), 0.5, 0.01);
}

#[test]
fn coaxial_cylinders() {
    // Outer radius 2, inner radius 1, height 2: Howell C-91.
    let wider = "HO 0 0 0 0 1 0 2 HO 0 0 0 0 0 1 2";
    let text = format!("CL NM 48 10 IN HO 0 0 0 1 0 0 2 {wider} ID CL NM 48 10 HO 0 0 0 1 0 0 2 ID");
    let (patches, factors) = factors(&scene(&text), 1.0, 100);
    near(between(&patches, &factors, 0, 1), 0.337106027519, 0.01);
    near(between(&patches, &factors, 0, 0), 0.228481018988, 0.01);
}

#[test]
fn an_element_sees_a_sphere_by_its_tilt_and_distance() {
    // cos t / H², H the distance in radii: Howell B-29.
    for (distance, tilt) in [(2.0, 0.0_f64), (2.0, 0.5), (3.0, 0.9), (1.2, 0.0)] {
        let text = format!(
            "TI -.00001 -.00001 0  .00002 -.00001 0  -.00001 .00002 0 RT 0 0 0 1 0 0 {tilt} ID SP TR 0 0 {distance} ID"
        );
        let (_, factors) = factors(&scene(&text), 1.0, 200);
        let found: f64 = factors.row(0).iter().filter(|&(j, _)| j > 0).map(|(_, factor)| factor).sum();
        near(found, tilt.cos() / (distance * distance), 0.006);
    }
}

#[test]
fn a_sphere_sees_a_disc() {
    // (1 - 1/√(1 + (rd/h)²)) / 2: Howell C-121.
    let text = format!("SP NM 32 16 RT 0 0 0 0 0 1 1.5707963267948966 ID {}", disc(2.0, 1.0, 48, 3, -1.0));
    let (patches, factors) = factors(&scene(&text), 1.0, 200);
    near(between(&patches, &factors, 0, 1), 0.0527864045, 0.01);
    near(between(&patches, &factors, 1, 0) / 4.0, 0.0527864045, 0.01);
}

#[test]
fn spheres_that_touch() {
    let (patches, factors) = factors(&scene("SP NM 48 24 ID SP NM 48 24 TR 2 0 0 ID"), 1.0, 100);
    near(between(&patches, &factors, 0, 1), 0.0755868184, 0.01);
}

#[test]
fn furnace_in_an_ellipsoid() {
    let text = "SP IN NM 20 10 HO 0 0 0 1 0 0 2 CD .5 .8 .9 CE 1 1 1 ID";
    let (patches, factors) = factors(&scene(text), 1.0, 100);
    let solution = solve::gauss_seidel(&patches, &factors, 1e-9, &mut ignore).unwrap();
    for radiosity in &solution.radiosity {
        near(radiosity.r, 2.0, 1e-4);
        near(radiosity.g, 5.0, 1e-4);
        near(radiosity.b, 10.0, 1e-4);
    }
}

/// A room whose ceiling is not flat; its walls are trapezoids.
const TENT: &str = "
    QD 6 6  0 0 0  1 0 0  1 1 0  0 1 0 ID
    QD 7 5  0 0 1  0 1 1.2  1 1 .9  1 0 1.3 ID
    QD 4 6  0 0 0  0 0 1  1 0 1.3  1 0 0 ID
    QD 6 4  1 0 0  1 0 1.3  1 1 .9  1 1 0 ID
    QD 5 5  1 1 0  1 1 .9  0 1 1.2  0 1 0 ID
    QD 5 5  0 1 0  0 1 1.2  0 0 1  0 0 0 ID";

#[test]
fn general_quadrilaterals_enclose_a_room() {
    for subdivision in [Subdivision::Factor(1.0), Subdivision::Factor(2.0), Subdivision::PatchSize(0.19)] {
        let (patches, factors) = factors(&scene(TENT), subdivision, 60);
        closed(&factors);
        let middle = DVec3::new(0.5, 0.5, 0.5);
        assert!((0..patches.len()).all(|k| (middle - patches.centre[k]).dot(patches.normal[k]) > 0.0));
    }
}

#[test]
fn a_trapezoid_and_a_saddle_have_their_areas_and_normals() {
    let trapezoid = patches("QD 3 4  0 0 0  4 0 0  3 2 0  1 2 0  ID");
    assert_eq!(trapezoid.len(), 12);
    near(trapezoid.total_area(), 6.0, 1e-14);
    // Between opposite sides: the first row's cells are a twelfth of the longer side wide below, and a quarter of the rest up.
    near(trapezoid.area[0], 0.5 * (4.0 / 3.0 + 3.5 / 3.0) * 0.5, 1e-13);
    assert!(trapezoid.normal.iter().all(|normal| normal.abs_diff_eq(DVec3::Z, 1e-12)));
    let mirrored = patches("QD 3 4  0 0 0  4 0 0  3 2 0  1 2 0  HO 0 0 0 1 0 0 -1 ID");
    assert!(mirrored.normal.iter().all(|normal| normal.abs_diff_eq(DVec3::Z, 1e-12)));
    // z = x y over the unit square: ∫∫ √(1 + x² + y²) = 1.2807895...
    let saddle = patches("QD 5 5  0 0 0  1 0 0  1 1 1  0 1 0  ID");
    let simpson = |n: usize| {
        let weight = |k: usize| {
            if k == 0 || k == n {
                1.0
            } else if k % 2 == 1 {
                4.0
            } else {
                2.0
            }
        };
        let at = |k: usize| k as f64 / n as f64;
        let height = |x: f64, y: f64| (1.0 + x * x + y * y).sqrt();
        let sum: f64 =
            (0..=n).flat_map(|i| (0..=n).map(move |j| weight(i) * weight(j) * height(at(i), at(j)))).sum();
        sum / (9.0 * (n * n) as f64)
    };
    near(saddle.total_area(), simpson(200), 1e-10);
    for (centre, normal) in saddle.centre.iter().zip(&saddle.normal) {
        let exact = DVec3::new(-centre.y, -centre.x, 1.0).normalize();
        assert!(normal.abs_diff_eq(exact, 0.02), "{normal} {exact}");
        assert!((centre.z - centre.x * centre.y).abs() < 0.02);
    }
}

#[test]
fn what_is_a_parallelogram_stays_one() {
    let exact = patches("QD 3 2  0 0 0  3 0 0  3 2 0  0 2 0 ID");
    let rounded = patches("QD 3 2  0 0 0  3 0 0  3.0001 2 .0001  0 2 0 ID");
    assert_eq!(exact, rounded);
    let off = scene("QD 3 2  0 0 0  3 0 0  3.001 2 0  0 2 0 ID");
    assert_eq!(Facets::new(&off, &subdivide(&off, 1.0).unwrap()).as_slice().len(), 12);
}

#[test]
fn a_tetrahedron_of_triangles_cut_by_size() {
    // Edges of the cube's diagonals; any face sees any other by a third.
    let text = "TI 0 0 0  1 1 0  0 1 1 ID TI 0 0 0  0 1 1  1 0 1 ID TI 0 0 0  1 0 1  1 1 0 ID TI 1 1 0  1 0 1  0 1 1 ID";
    let (patches, factors) = factors(&scene(text), Subdivision::PatchSize(0.15), 100);
    // The edges are √2: ten parts, a hundred triangles.
    assert_eq!(patches.len(), 400);
    closed(&factors);
    for [from, to] in [[0, 1], [1, 2], [3, 0]] {
        near(between(&patches, &factors, from, to), 1.0 / 3.0, 0.01);
    }
}

#[test]
fn a_pentagon_and_a_square() {
    let text = "PG 0 0 0  0 1 0  .5 2 0  1 1 0  1 0 0  0 0 0 HO 0 0 0 0 0 1 -1 ID QD 1 1  0 0 0  0 1 0  0 1 1  0 0 1 ID";
    let (patches, factors) = factors(&scene(text), Subdivision::PatchSize(0.1), 100);
    near(between(&patches, &factors, 0, 1), 0.154124318249, 0.015);
    near(between(&patches, &factors, 1, 0) / 1.5, 0.154124318249, 0.015);
}

#[test]
fn a_concave_polygon_is_seen_as_the_sum_of_its_parts() {
    // An L, and the two rectangles that it is made of.
    let element = "QD 4 4  -1 -1 2  -1 2 2  2 2 2  2 -1 2 ID";
    let l = format!("{element} PG 0 0 0  2 0 0  2 1 0  1 1 0  1 3 0  0 3 0  0 0 0 ID");
    let parts = format!("{element} QD 1 1 0 0 0 2 0 0 2 1 0 0 1 0 ID QD 1 1 0 1 0 1 1 0 1 3 0 0 3 0 ID");
    let ((patches, whole), (_, parts)) = (factors(&scene(&l), 1.0, 100), factors(&scene(&parts), 1.0, 100));
    for i in 0..16 {
        near(whole.row(i).get(16), parts.row(i).get(16) + parts.row(i).get(17), 1e-6);
    }
    // It looks out from where it is.
    let c = patches.centre[16];
    assert!((0.0..2.0).contains(&c.x) && (0.0..3.0).contains(&c.y) && (c.x < 1.0 || c.y < 1.0), "{c}");
    near(whole.row(16).sum(), parts.row(16).sum(), 0.5);
}

/// Twelve shapes of every kind, of very different sizes.
const MANY: &str = "
    QD 1 1  0 0 0  4 0 0  4 3 0  0 3 0 ID       QD 2 2  0 0 1  4 0 1  3 2 1.5  0 2 1 ID
    PG 0 0 2  2 0 2  2 1 2  1 1 2  1 3 2  0 3 2  0 0 2 ID
    PG 5 0 0  7 0 0  7 2 0  5 2 0  5 0 0 ID      PG 5 0 1  7 0 1  6.5 2 1  5.5 2 1  5 0 1 ID
    TI 0 0 3  3 0 3  0 .2 3 ID  SP HO 0 0 0 1 0 0 3 TR 10 0 0 ID  CL HO 0 0 0 0 1 0 .3 CZ 0 0 0 0 0 1 1 0 0 ID
    FR 2 .1 5  0 0 5  1 0 5  0 1 5 ID
    VO 0 0 0 4  20 0 0  21 0 0  20 5 0  20 0 .3  4  1 3 2  1 2 4  2 3 4  3 1 4 ID";

#[test]
fn no_edge_is_longer_than_asked() {
    let scene = scene(MANY);
    for size in [3.0, 0.7, 0.21] {
        let patches = subdivide(&scene, Subdivision::PatchSize(size)).unwrap();
        assert_eq!(patches.len() as u64, count(&scene, Subdivision::PatchSize(size)).unwrap());
        for (surface, pieces) in patches.pieces.iter().enumerate() {
            let block = patches.blocks[surface];
            match pieces {
                None => {
                    let i = block.first as usize;
                    let longest = patches.tangent_u[i].length().max(patches.tangent_v[i].length());
                    assert!(longest <= size * (1.0 + 1e-6), "surface {surface}");
                }
                Some(pieces) => {
                    // The edges about each patch: those within it, run along both ways, are none.
                    let mut edges = HashMap::new();
                    let key = |p: DVec3| p.to_array().map(f64::to_bits);
                    for (t, patch) in pieces.triangles.iter().zip(&pieces.patch) {
                        for k in 0..3 {
                            let (a, b) = (t[k], t[(k + 1) % 3]);
                            let ends = [key(a).min(key(b)), key(a).max(key(b))];
                            *edges.entry((patch, ends)).or_insert((0, a.distance(b))) =
                                (edges.get(&(patch, ends)).map_or(0, |&(n, _)| n) + 1, a.distance(b));
                        }
                    }
                    for ((patch, _), (runs, length)) in edges {
                        assert!(
                            runs == 2 || length <= size * (1.0 + 1e-6),
                            "surface {surface}, patch {patch}: {length}"
                        );
                    }
                }
            }
        }
        // What is cut is what was there.
        let whole = subdivide(&scene, 1.0).unwrap();
        for surface in [0, 1, 2, 3, 4, 5, 8, 9] {
            let area =
                |patches: &Patches| patches.blocks[surface].patches().map(|i| patches.area[i]).sum::<f64>();
            near(area(&patches), area(&whole), 1e-9);
        }
    }
}

#[test]
fn about_so_many_patches() {
    let scene = scene(MANY);
    for wanted in [300, 1_000, 5_000, 40_000] {
        let patches = subdivide(&scene, Subdivision::Patches(wanted)).unwrap().len() as f64;
        assert!((0.9..=1.02).contains(&(patches / wanted as f64)), "{wanted}: {patches}");
    }
    let refused = count(&scene, Subdivision::Patches(10)).unwrap_err();
    let SubdivideError::TooFew { asked: 10, least } = refused else { panic!("{refused:?}") };
    assert_eq!(count(&scene, Subdivision::Patches(least)), Ok(least));
    let Ok(Subdivision::PatchSize(size)) = Subdivision::Patches(700).for_scene(&scene) else { panic!() };
    assert_eq!(count(&scene, Subdivision::PatchSize(size)), count(&scene, Subdivision::Patches(700)));
    for size in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(count(&scene, Subdivision::PatchSize(size)), Err(SubdivideError::BadSize));
    }
    // Told at once, and not counted one by one.
    for size in [1e-7, 1e-300] {
        assert!(count(&scene, Subdivision::PatchSize(size)).unwrap() > 1_000_000_000_000);
        let refused = subdivide(&scene, Subdivision::PatchSize(size)).unwrap_err();
        assert!(matches!(refused, SubdivideError::TooMany { .. }));
    }
}

#[test]
fn a_factor_scales_what_has_numbers() {
    let counts = |factor: f64| {
        let patches = subdivide(&scene(MANY), factor).unwrap();
        patches.blocks.iter().map(|block| block.patches().len()).collect::<Vec<_>>()
    };
    assert_eq!(counts(1.0), [1, 4, 1, 1, 1, 1, 288, 96, 16, 4]);
    assert_eq!(counts(2.0), [4, 16, 1, 1, 1, 1, 4 * 288, 4 * 96, 64, 4]);
    // However coarse, a sphere stays one.
    assert_eq!(counts(1e-9), [1, 1, 1, 1, 1, 1, 32, 8, 16, 4]);
    assert_eq!(subdivide(&scene("SP NM 4 2 ID"), 0.1).unwrap().len(), 8);
}

#[test]
fn a_fractal_is_one_piece() {
    let scene = scene(
        "FR 4 .15 3  0 0 0  2 0 0  0 2 0 CD .5 .5 .5 ID FR 4 .15 3  2 0 0  2 2 0  0 2 0 CD .5 .5 .5 ID",
    );
    let patches = subdivide(&scene, 1.0).unwrap();
    assert_eq!(patches.len(), 512);
    // Every edge but those of the square's rim, four times sixteen, is run along twice.
    let mut edges: HashMap<_, u32> = HashMap::new();
    let key = |p: DVec3| (p + DVec3::ZERO).to_array().map(f64::to_bits);
    for t in patches.pieces.iter().flatten().flat_map(|pieces| &pieces.triangles) {
        for k in 0..3 {
            let (a, b) = (key(t[k]), key(t[(k + 1) % 3]));
            *edges.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    assert_eq!(edges.values().filter(|&&runs| runs == 1).count(), 64);
    assert!(patches.centre.iter().any(|centre| centre.z.abs() > 0.05));
}

/// The colour at each corner of each facet, by its place.
fn corners(
    scene: &Scene,
    subdivision: impl Into<Subdivision>,
    value: impl Fn(DVec3) -> f64,
) -> Vec<(DVec3, f64)> {
    let patches = subdivide(scene, subdivision).unwrap();
    let facets = Facets::new(scene, &patches);
    let values: Vec<Rgb> = patches.centre.iter().map(|&centre| Rgb::grey(value(centre))).collect();
    let shaded = ShadedSurfaces::new(scene, &patches, &facets, &values, Shading::Smooth);
    let mut found = Vec::new();
    for (facet, number) in facets.as_slice().iter().zip(0..) {
        let mut at = |u, v| found.push((facet.origin + facet.u * u + facet.v * v, shaded.at(number, u, v).r));
        at(0.0, 0.0);
        at(1.0, 0.0);
        at(0.0, 1.0);
        if facet.shape == FacetShape::Parallelogram {
            at(1.0, 1.0);
        }
    }
    found
}

/// How far apart the colours are of those that are at one place.
fn widest_break(corners: &[(DVec3, f64)]) -> f64 {
    let mut places: HashMap<[i64; 3], [f64; 2]> = HashMap::new();
    for (place, value) in corners {
        let key = (*place * 1e6).round().to_array().map(|x| x as i64);
        let span = places.entry(key).or_insert([*value; 2]);
        *span = [span[0].min(*value), span[1].max(*value)];
    }
    places.values().map(|[low, high]| high - low).fold(0.0, f64::max)
}

#[test]
fn shading_is_continuous_over_a_curved_surface_and_its_seam() {
    for text in ["SP ID", "SP NM 5 3 ID", "CL ID", "CL NM 6 2 IN ID", "QD 4 5 0 0 0 1 0 0 1 1 1 0 1 0 ID"] {
        let corners = corners(&scene(text), 1.0, |p| p.x + 2.0 * p.y + 3.0 * p.z);
        assert!(widest_break(&corners) < 1e-12, "{text}");
    }
    for text in ["PG 0 0 2  2 0 2  2 1 2  1 1 2  1 3 2  0 3 2  0 0 2 ID", "TI 0 0 3  3 0 3  0 .2 3 ID"] {
        let corners = corners(&scene(text), Subdivision::PatchSize(0.2), |p| p.x + 2.0 * p.y);
        assert!(widest_break(&corners) < 1e-12, "{text}");
    }
    // And near to what it stands for: a height over a sphere.
    let sphere = corners(&scene("SP NM 48 24 ID"), 1.0, |p| p.y);
    assert!(sphere.iter().all(|(place, value)| (place.y - value).abs() < 0.01));
}

#[test]
fn shading_breaks_at_creases_and_other_colours() {
    let rim = |attributes: &str| {
        let text = format!("CL NM 12 2 {attributes} ID {}", disc(1.0, 1.0, 12, 2, 1.0));
        widest_break(&corners(&scene(&text), 1.0, |p| if p.x > 0.99 { 1.0 } else { 0.0 }))
    };
    assert_eq!(rim(""), 1.0);
    // Two halves of one flat floor, of one colour or of two.
    let floor = |colour: &str| {
        let text = format!("TI 0 0 0 1 0 0 0 1 0 CD .5 .5 .5 ID TI 1 0 0 1 1 0 0 1 0 {colour} ID");
        widest_break(&corners(&scene(&text), 1.0, |p| if p.x + p.y < 1.0 { 1.0 } else { 0.0 }))
    };
    assert_eq!(floor("CD .6 .5 .5"), 1.0);
    assert!(floor("CD .5 .5 .5") < 1e-12);
}

#[test]
fn a_sphere_from_behind_is_as_the_setting_says() {
    // A lamp inside a sphere that faces outward: lit, its backs are seen from within; black, they are not.
    let mut scene = scene("SP ID QD 1 1 -.1 -.1 0 .1 -.1 0 .1 .1 0 -.1 .1 0 CE 1 1 1 ID");
    let (_, lit) = factors(&scene, 1.0, 50);
    near(lit.row(288).sum(), 1.0, 1e-5);
    scene.back_faces = BackFaces::Black;
    let (_, black) = factors(&scene, 1.0, 50);
    assert_eq!(black.row(288).sum(), 0.0);
}

#[test]
fn rays_see_of_curved_surfaces_what_the_item_buffer_sees() {
    let text = "SP IN NM 12 6 HO 0 0 0 1 0 0 2 ID SP NM 10 5 HO 0 0 0 0 1 0 .5 TR .3 .1 .2 ID
        CL NM 9 2 HO 0 0 0 0 1 0 .2 HO 0 0 0 0 0 1 .3 TR -1 0 0 ID  QD 3 3 -1 -.6 -.3 1 -.6 -.3 .6 -.5 .4 -.6 -.7 .3 ID";
    let scene = scene(text);
    let (patches, factors) = factors(&scene, 1.0, 60);
    let facets = Facets::new(&scene, &patches);
    let tree = RayTree::new(&facets);
    let weights = CellWeights::new(60).unwrap();
    let hemicube = Hemicube::new(&patches, &facets, scene.back_faces, weights);
    for i in (0..patches.len()).step_by(5) {
        let by_rays = hemicube.row_by_rays(i, &tree);
        let apart: f64 = (0..patches.len()).map(|j| (by_rays.get(j) - factors.row(i).get(j)).abs()).sum();
        // Cells that an edge runs through may go to either side of it.
        assert!(apart < 0.01, "patch {i}: {apart}");
    }
}
