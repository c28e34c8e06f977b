//! Scenes that are right: what is read is what was written, wherever its transforms take it.

use glam::DVec3;
use proptest::prelude::*;
use radiosity::geometry::polygon;
use radiosity::light::Rgb;
use radiosity::patches::{self, Patches};
use radiosity::scene::n3d::{parse_scene, parse_view};
use radiosity::scene::{Place, Scene, Shape};

fn scene(text: &str) -> Scene {
    parse_scene("a.scn", text.as_bytes()).unwrap_or_else(|error| panic!("{error}: {text:.400}"))
}

fn patches(text: &str) -> Patches {
    patches::subdivide(&scene(text), 1.0).unwrap()
}

const LAMP: &str = "QD 4 8\n  0 0 0 1 0 0 1 2 0 0 2 0\nCE 20 20 20\nID\n";
/// An L, concave.
const L: &str = "PG 0 0 0  2 0 0  2 1 0  1 1 0  1 3 0  0 3 0  0 0 0";
const TETRAHEDRON: &str = "VO 1.5 2 3  4  0 0 0  1 0 0  0 1 0  0 0 1  4  1 3 2  1 2 4  2 3 4  3 1 4";

#[test]
fn the_assignments_example() {
    let scene = scene(LAMP);
    let Shape::Parallelogram(lamp) = &scene.surfaces[0].shape else { panic!() };
    assert_eq!((lamp.columns, lamp.rows), (4, 8));
    assert_eq!((lamp.u, lamp.v, lamp.normal), (DVec3::X, DVec3::Y * 2.0, DVec3::Z));
    assert_eq!(scene.surfaces[0].material.emission, Rgb::grey(20.0));
    assert_eq!(scene.surfaces[0].material.diffuse, Rgb::BLACK);
    assert_eq!(scene.warnings, []);
    assert_eq!(patches(LAMP).len(), 32);
}

#[test]
fn every_kind_of_object_and_attribute_is_read() {
    let text = format!(
        "# une pièce\r\nOC {LAMP} // la lampe\r OC {L} GD .5 ID {TETRAHEDRON} ID FI ID\n\
         PT 1 2 3 CA 1 1 1 ID SG 0 0 0 1 1 1 ID TI 0 0 0 1 0 0 0 1 0 HD LK ID\n\
         FI CD .1 .2 .3 CE 1 1 1 CS 1 0 0 CA 0 1 0 TD 0 0 1 TS 2 0 0 TA 0 2 0 CR 0 0 2 CT 3 0 0 CO 0 3 0\n\
         CZ 0 0 0 0 0 1 1 0 0  AV 1 0 0 0 1 0  MA 1 0 0 0 0 1 0 0 0 0 1 0  2 0 0 0 0 1 0 0 0 0 1 0 ID"
    );
    let scene = scene(&text);
    assert_eq!(scene.surfaces.len(), 4);
    let material = |k: usize| scene.surfaces[k].material;
    // A child's own goes first; the rest it inherits.
    assert_eq!((material(0).emission, material(0).diffuse), (Rgb::grey(20.0), Rgb::new(0.1, 0.2, 0.3)));
    assert_eq!((material(1).emission, material(1).diffuse), (Rgb::grey(1.0), Rgb::grey(0.5)));
    assert_eq!(material(2).shadow, Rgb::new(0.0, 3.0, 0.0));
    assert_eq!(material(2).mirror, Rgb::new(0.0, 0.0, 2.0));
    assert_eq!(scene.surfaces[3].place, Place { line: 8, column: 40 });
    let told: Vec<String> = scene.warnings.iter().map(|w| w.message.clone()).collect();
    assert_eq!(told.iter().filter(|w| w.contains("CA (ambient reflectance)")).count(), 1);
    assert!(told.iter().any(|w| w.starts_with("PT is a point")));
    assert!(told.iter().any(|w| w.starts_with("HD hides")));
    assert!(told.iter().any(|w| w.starts_with("CZ is read as")));
    assert!(told.iter().any(|w| w.starts_with("MA's second matrix is not the inverse")));
    assert_eq!(told.len(), 13);
}

#[test]
fn a_later_definition_overrides_an_earlier_one() {
    let scene = scene(&format!("{L} CD 1 0 0 GD .5 CE 1 1 1 CE 2 2 2 ID"));
    let material = scene.surfaces[0].material;
    assert_eq!((material.diffuse, material.emission), (Rgb::grey(0.5), Rgb::grey(2.0)));
    assert_eq!(scene.surfaces.len(), 1);
}

#[test]
fn the_first_written_transform_acts_first_and_the_composites_last() {
    let first = |text: &str| scene(text).surfaces[0].shape.vertices()[0];
    let quarter = "RT 0 0 0 0 0 1 1.5707963267948966";
    let near = |a: DVec3, x: f64, y: f64| assert!(a.abs_diff_eq(DVec3::new(x, y, 0.0), 1e-12), "{a}");
    near(first(&format!("{L} TR 1 0 0 {quarter} ID")), 0.0, 1.0);
    near(first(&format!("{L} {quarter} TR 1 0 0 ID")), 1.0, 0.0);
    near(first(&format!("OC {L} TR 1 0 0 ID FI {quarter} TR 5 0 0 ID")), 5.0, 1.0);
}

#[test]
fn a_mirror_keeps_the_front_and_the_numbers() {
    let mirror = "HO 0 0 0 1 0 0 -1";
    for object in [LAMP.trim_end().trim_end_matches("ID"), L, TETRAHEDRON] {
        let (plain, mirrored) =
            (patches(&format!("{object} ID")), patches(&format!("OC {object} ID FI {mirror} ID")));
        let flip = |p: DVec3| DVec3::new(-p.x, p.y, p.z);
        for k in 0..plain.len() {
            assert!(mirrored.normal[k].abs_diff_eq(flip(plain.normal[k]), 1e-12), "{object}: patch {k}");
            assert!(mirrored.centre[k].abs_diff_eq(flip(plain.centre[k]), 1e-12));
            assert!((mirrored.area[k] - plain.area[k]).abs() < 1e-12);
        }
        // Twice mirrored is not mirrored.
        assert_eq!(patches(&format!("OC {object} {mirror} ID FI {mirror} ID")).normal, plain.normal);
    }
}

#[test]
fn many_objects_and_long_files_take_linear_time() {
    let many = "OC TI 0 0 0 1 0 0 0 1 0 TR 1 0 0 ID FI CD .5 .5 .5 ID ".repeat(50_000);
    assert_eq!(scene(&many).surfaces.len(), 50_000);
    let nested = format!("{}{}{}", "OC ".repeat(900), many, "FI TR 0 1 0 ID ".repeat(900));
    assert_eq!(scene(&nested).surfaces[49_999].shape.vertices()[0], DVec3::new(1.0, 900.0, 0.0));
    // A thousand corners, concave.
    let teeth: String = (0..1_000).rev().map(|k| format!("{k} {} 0 ", 5 * (k % 2))).collect();
    assert_eq!(scene(&format!("PG 0 -1 0 999 -1 0 {teeth} 0 -1 0 ID ").repeat(10)).surfaces.len(), 10);
}

// Random scenes.

/// An object in its own coordinates, its transforms, and its place among composites.
#[derive(Clone, Debug)]
struct Written {
    object: String,
    own: Vec<String>,
    around: Vec<Vec<String>>,
}

impl Written {
    /// With its composites, or with all transforms on the object itself.
    fn text(&self, flat: bool) -> String {
        if flat {
            let all: Vec<_> = self.own.iter().chain(self.around.iter().flatten()).cloned().collect();
            return format!("{} CD .5 .25 .125 {} ID", self.object, all.join(" "));
        }
        let mut text = format!("{} {} ID", self.object, self.own.join(" "));
        for transforms in &self.around {
            text = format!("OC\n{text}\nFI {} ID", transforms.join(" "));
        }
        // The outermost gives the colour.
        format!("OC {text} FI CD .5 .25 .125 ID")
    }
}

fn vector() -> impl Strategy<Value = String> {
    prop::array::uniform3(-3.0_f64..3.0)
        .prop_filter("some length", |v| DVec3::from_array(*v).length() > 0.5)
        .prop_map(|[x, y, z]| format!("{x} {y} {z}"))
}

fn transform() -> impl Strategy<Value = String> {
    prop_oneof![
        vector().prop_map(|v| format!("TR {v}")),
        (vector(), vector(), prop_oneof![-2.0..-0.5, 0.5..2.0])
            .prop_map(|(p, v, r): (_, _, f64)| format!("HO {p} {v} {r}")),
        (vector(), vector(), -4.0_f64..4.0).prop_map(|(p, v, a)| format!("RT {p} {v} {a}")),
        (vector(), vector()).prop_map(|(a, b)| format!("AV {a} {b}")),
        vector().prop_map(|p| format!("CZ {p} 0 0 1 0.5 -0.7 0")),
        // A turn about the diagonal and a stretch, with the inverse that belongs to it.
        Just("MA 0 0 2 5  1 0 0 6  0 1 0 7  0 1 0 -6  0 0 1 -7  .5 0 0 -2.5".to_owned()),
    ]
}

/// Transforms on an object and on composites around it.
fn placed(object: impl Strategy<Value = String>) -> impl Strategy<Value = Written> {
    let transforms = || prop::collection::vec(transform(), 0..3);
    (object, transforms(), prop::collection::vec(transforms(), 0..4))
        .prop_map(|(object, own, around)| Written { object, own, around })
}

/// Spheres, cylinders, quadrilaterals that are no parallelograms, a fractal.
fn rounder() -> impl Strategy<Value = Written> {
    placed(prop_oneof![
        (3..9, 2..6, any::<bool>())
            .prop_map(|(n, m, inward)| format!("SP NM {n} {m} {}", if inward { "IN" } else { "" })),
        (3..9, 1..5).prop_map(|(n, m)| format!("CL NM {n} {m}")),
        (1..5, 1..5, -0.5..0.5)
            .prop_map(|(n, m, up): (i32, i32, f64)| format!("QD {n} {m} 0 0 0 2 0 {up} 1.5 1 0 0 1.2 .1")),
        (0.0..0.3).prop_map(|roughness: f64| format!("FR 2 {roughness} 3 0 0 0 1 0 0 0 1 0")),
    ])
}

fn written() -> impl Strategy<Value = Written> {
    let qd = (prop::array::uniform3(-3.0_f64..3.0), 0.1_f64..3.0, 0.1_f64..3.0, 1..5, 1..5).prop_map(
        |([x, y, z], u, v, n, m)| {
            let (right, top) = (x + u, y + v);
            format!("QD {n} {m} {x} {y} {z} {right} {y} {z} {right} {top} {z} {x} {top} {z}")
        },
    );
    let object = prop_oneof![
        qd,
        Just(L.to_owned()),
        Just(TETRAHEDRON.to_owned()),
        Just("TI 0 0 0 1 0 0 0 1 .5".to_owned())
    ];
    placed(object)
}

fn near(a: &Patches, b: &Patches) -> Result<(), TestCaseError> {
    prop_assert_eq!(a.len(), b.len());
    for k in 0..a.len() {
        prop_assert!(a.centre[k].abs_diff_eq(b.centre[k], 1e-7 * (1.0 + a.centre[k].length())));
        prop_assert!(a.normal[k].abs_diff_eq(b.normal[k], 1e-6));
        prop_assert!((a.area[k] - b.area[k]).abs() < 1e-7 * (1.0 + a.area[k]));
    }
    Ok(())
}

/// A scene in the format's own words.
fn write(scene: &Scene) -> String {
    let point = |p: &DVec3| format!(" {} {} {}", p.x, p.y, p.z);
    let mut text = String::new();
    for surface in &scene.surfaces {
        match &surface.shape {
            Shape::Parallelogram(p) => {
                text += &format!("QD {} {}", p.columns, p.rows);
                text.extend(p.corners().iter().map(point));
            }
            Shape::Polygon(p) => {
                text += "PG";
                text.extend(p.vertices.iter().chain(&p.vertices[..1]).map(point));
            }
            Shape::Quadrilateral(q) => {
                text += &format!("QD {} {}", q.columns, q.rows);
                text.extend(q.corners.iter().map(point));
            }
            Shape::Sphere(_) | Shape::Cylinder(_) | Shape::Fractal(_) => unreachable!("not in these scenes"),
            Shape::Mesh(m) => {
                text += &format!("VO 0 0 0 {}", m.vertices.len());
                text.extend(m.vertices.iter().map(point));
                text += &format!(" {}", m.triangles.len());
                text.extend(m.triangles.iter().map(|[a, b, c]| format!(" {} {} {}", a + 1, b + 1, c + 1)));
            }
        }
        let (diffuse, emission) = (surface.material.diffuse, surface.material.emission);
        text += &format!("\nCD {} {} {}", diffuse.r, diffuse.g, diffuse.b);
        text += &format!(" CE {} {} {}\nID\n", emission.r, emission.g, emission.b);
    }
    text
}

proptest! {
    #[test]
    fn composites_and_their_flattened_scenes_agree(written in prop_oneof![written(), rounder()]) {
        let (nested, flat) = (scene(&written.text(false)), scene(&written.text(true)));
        prop_assert_eq!(nested.surfaces[0].material, flat.surfaces[0].material);
        near(&patches::subdivide(&nested, 1.0).unwrap(), &patches::subdivide(&flat, 1.0).unwrap())?;
    }

    #[test]
    fn what_is_written_is_read_back(all in prop::collection::vec(written(), 1..6), emission in 0.0_f64..50.0) {
        // Coordinates are moved off the grid by their transforms; a polygon is exact, a QD as exact as u and v.
        let text: String = all.iter().map(|w| w.text(false) + "\n").collect();
        let first = scene(&(text + &LAMP.replace("20", &emission.to_string())));
        let second = scene(&write(&first));
        prop_assert_eq!(first.surfaces.len(), second.surfaces.len());
        for (a, b) in first.surfaces.iter().zip(&second.surfaces) {
            prop_assert_eq!(a.material, b.material);
            match (&a.shape, &b.shape) {
                (Shape::Parallelogram(a), Shape::Parallelogram(b)) => {
                    prop_assert_eq!((a.columns, a.rows), (b.columns, b.rows));
                    prop_assert!(a.corners().iter().zip(b.corners()).all(|(a, b)| a.abs_diff_eq(b, 1e-9 * (1.0 + a.length()))));
                }
                (a, b) => prop_assert_eq!(a, b),
            }
        }
    }

    #[test]
    fn a_uniform_scale_squares_into_the_area(factor in 0.01_f64..100.0, written in prop_oneof![written(), rounder()]) {
        let scale = format!("HO 0 0 0 1 0 0 {factor} HO 0 0 0 0 1 0 {factor} HO 0 0 0 0 0 1 -{factor}");
        let (plain, scaled) = (patches(&written.text(false)), patches(&format!("OC {} FI {scale} ID", written.text(false))));
        for (a, b) in plain.area.iter().zip(&scaled.area) {
            prop_assert!((a * factor * factor / b - 1.0).abs() < 1e-6);
        }
        for (a, b) in plain.normal.iter().zip(&scaled.normal) {
            prop_assert!(b.abs_diff_eq(DVec3::new(a.x, a.y, -a.z), 1e-6));
        }
    }

    #[test]
    fn any_bytes_come_to_an_end(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = (parse_scene("a.scn", &bytes), parse_view("a.vsn", &bytes));
    }

    #[test]
    fn any_damage_to_a_scene_comes_to_an_end(
        written in prop_oneof![written(), rounder()],
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..4), 1..5),
    ) {
        let mut bytes = (written.text(false) + LAMP).into_bytes();
        for (at, byte, kind) in damage {
            if bytes.is_empty() {
                break;
            }
            let at = at.index(bytes.len());
            match kind {
                0 => bytes[at] = byte,
                1 if bytes.len() > 1 => { bytes.remove(at); }
                2 => bytes.truncate(at.max(1)),
                _ => bytes.insert(at, b" 0-.eQDI#\n"[byte as usize % 10]),
            }
        }
        if let Ok(scene) = parse_scene("a.scn", &bytes) {
            for surface in &scene.surfaces {
                if let Shape::Polygon(p) = &surface.shape {
                    prop_assert!(polygon::triangulate(&p.vertices).is_some());
                }
            }
        }
    }

    #[test]
    fn an_error_stands_where_the_fault_was_put(
        before in prop::collection::vec(prop::sample::select(vec!["\n", "\r\n", "\r", " ", "\t", "# é\n", "// x\r"]), 0..20),
        objects in 0_usize..4,
    ) {
        let mut text = "TI 0 0 0 1 0 0 0 1 0 ID\n".repeat(objects) + &before.concat();
        // Lines and columns counted another way.
        let lines: Vec<String> = text.replace("\r\n", "\n").replace('\r', "\n").split('\n').map(str::to_owned).collect();
        let place = Place { line: lines.len() as u32, column: lines.last().unwrap().chars().count() as u32 + 1 };
        text += "@@ ";
        let error = parse_scene("a.scn", text.as_bytes()).unwrap_err();
        prop_assert_eq!(error.to_string(), format!("a.scn:{}: `@@` begins no object", place));
    }
}
