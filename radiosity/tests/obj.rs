//! Wavefront's OBJ: what is read, what is mended, and what each mistake is told as.

mod rooms;

use glam::DVec3;
use proptest::prelude::*;
use radiosity::light::Rgb;
use radiosity::patches::{self, Subdivision};
use radiosity::scene::{BackFaces, LeftOut, Mesh, Scene, SceneError, Shape, obj};

const MTL: &str = "newmtl white paint\n  Kd 0.8 0.7 0.6 # matt\n\nnewmtl lamp\nKd 0\nKe 20 19 18\n";

fn read(text: &str) -> Result<Scene, SceneError> {
    obj::parse_scene("a.obj", text.as_bytes(), |name| {
        (name == "a.mtl").then(|| Ok((name.to_owned(), MTL.as_bytes().to_vec())))
    })
}

fn scene(text: &str) -> Scene {
    read(text).unwrap_or_else(|error| panic!("{error}"))
}

fn mesh(scene: &Scene, surface: usize) -> &Mesh {
    match &scene.surfaces[surface].shape {
        Shape::Mesh(mesh) => mesh,
        other => panic!("{other:?}"),
    }
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn objects_groups_and_materials_make_surfaces() {
    let scene = scene(&format!(
        "mtllib a.mtl\n{SQUARE}v 0 0 1\nvn 0 0 1\nvt .5 .5\no room\ng floor\nusemtl white paint\ns off\n\
         f 1/1/1 2//1 3/1 4\ng lamp\nusemtl lamp\nf -1 -5 \\\n-2\nusemtl white paint\nf 1 2 5\ng floor\nf 2 3 5\n"
    ));
    let names: Vec<&str> = scene.surfaces.iter().map(|surface| surface.name.as_str()).collect();
    assert_eq!(names, ["floor", "lamp: lamp", "lamp: white paint"]);
    assert_eq!(scene.surfaces[0].place.line, 13);
    assert_eq!(scene.back_faces, BackFaces::Black);
    assert_eq!(scene.warnings, []);
    let (floor, lamp) = (&scene.surfaces[0].material, &scene.surfaces[1].material);
    assert_eq!((floor.diffuse, floor.emission), (Rgb::new(0.8, 0.7, 0.6), Rgb::BLACK));
    assert_eq!((lamp.diffuse, lamp.emission), (Rgb::BLACK, Rgb::new(20.0, 19.0, 18.0)));
    // The square in two triangles, and the face of the later `g floor` with them.
    assert_eq!(mesh(&scene, 0).triangles.len(), 3);
    // -1 is the fifth vertex, -5 the first, -2 the fourth.
    let vertices = &mesh(&scene, 1).vertices;
    assert_eq!(vertices, &[DVec3::Z, DVec3::ZERO, DVec3::Y]);
}

#[test]
fn a_concave_face_keeps_its_area_and_its_front() {
    let scene = scene("v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\nf 1 2 3 4 5");
    let patches = patches::subdivide(&scene, 1.0).unwrap();
    assert!((patches.total_area() - 10.0).abs() < 1e-12);
    assert!(patches.normal.iter().all(|normal| normal.z == 1.0));
}

#[test]
fn dirt_is_mended_and_told() {
    let scene = scene(&format!(
        "{SQUARE}v 0 0 0\nv 2 0 0\nf 1 2 3\nf 5 3 4\nf 2 3 1\nf 1 2 6\nf 1 1 2\nf 1 2\nl 1 2\nl 2 3\nwhatever 3\n"
    ));
    let mesh = mesh(&scene, 0);
    // The fifth vertex stands where the first does.
    assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (4, 2));
    assert_eq!(mesh.left_out, LeftOut { flat: 3, repeated: 1 });
    assert_eq!(scene.surfaces[0].material.diffuse, Rgb::grey(0.5));
    let told: Vec<String> = scene.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(
        told,
        [
            "a.obj:7:1: no material is told for these faces: a grey that reflects 0.5 is taken",
            "a.obj:13:1: a line or point, which has no area, is left out (2 lines)",
            "a.obj:15:1: this is no statement of OBJ, and left out",
        ]
    );
}

#[test]
fn a_face_that_crosses_itself_is_told() {
    let scene = scene("v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 1 .5\nf 1 2 3 4");
    assert!(scene.warnings.iter().any(|warning| warning.to_string().contains("a.obj:5:1: a face crosses")));
}

#[test]
fn a_missing_material_file_is_one_warning() {
    let scene = scene(&format!("mtllib gone.mtl\n{SQUARE}usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4"));
    assert_eq!(scene.warnings.len(), 1);
    let told = scene.warnings[0].to_string();
    assert!(told.starts_with("a.obj:1:1: there is no material file gone.mtl"), "{told}");
    assert!(scene.surfaces.iter().all(|surface| surface.material.diffuse == Rgb::grey(0.5)));
}

/// Reads with a material file, and a PNG of 2 x 2 pixels, white at the top left and the bottom right, black beside.
fn textured(mtl: &str, text: &str) -> Scene {
    let mut png = Vec::new();
    let mut encoder = png::Encoder::new(&mut png, 2, 2);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.write_header().unwrap().write_image_data(&[255, 0, 0, 255]).unwrap();
    let read = obj::parse_scene("a.obj", text.as_bytes(), |name| match name {
        "a.mtl" => Some(Ok((name.to_owned(), mtl.as_bytes().to_vec()))),
        "my tiles.png" => Some(Ok((name.to_owned(), png.clone()))),
        _ => None,
    });
    read.unwrap_or_else(|error| panic!("{error}"))
}

const TEXTURED: &str = "mtllib a.mtl\nusemtl tiles\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n\
                        vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/-2 4/4\n";

#[test]
fn textures_lie_as_their_coordinates_say() {
    let size = Subdivision::PatchSize(0.7072);
    let reflectances = |scene: &Scene| {
        let patches = patches::subdivide(scene, size).unwrap();
        // The patches' quarter of the square: of the left half, of the lower half.
        patches.centre.iter().map(|p| (p.x < 0.5, p.y < 0.5)).zip(patches.reflectance).collect::<Vec<_>>()
    };
    let whole = textured("newmtl tiles\nKd .8 .4 .2\nmap_Kd my tiles.png\n", TEXTURED);
    assert_eq!(whole.warnings, []);
    assert_eq!(whole.surfaces[0].material.diffuse, Rgb::new(0.4, 0.2, 0.1));
    let found = reflectances(&whole);
    assert_eq!(found.len(), 8);
    for ((left, lower), found) in found {
        // White at the top left.
        assert_eq!(found, Rgb::new(0.8, 0.4, 0.2) * if left != lower { 1.0 } else { 0.0 });
    }
    // Half as large and moved by half of that: every patch has one white tile and one black, but at the clamped border.
    let small = textured("newmtl tiles\nmap_Kd -s 4 4 1 -o .5 .5 -clamp off my tiles.png", TEXTURED);
    assert!(reflectances(&small).iter().all(|(_, found)| (*found - Rgb::grey(0.5)).norm_squared() < 1e-20));
    let clamped = textured("newmtl tiles\nmap_Kd -o 1 -1 -clamp on my tiles.png", TEXTURED);
    assert!(reflectances(&clamped).iter().all(|(_, found)| *found == Rgb::WHITE));
    // A lamp.
    let lamp = textured("newmtl tiles\nKd 0\nKe 6 4 2\nmap_Ke my tiles.png", TEXTURED);
    assert_eq!(patches::subdivide(&lamp, size).unwrap().total_power(), Rgb::new(3.0, 2.0, 1.0));
}

#[test]
fn a_texture_that_cannot_be_used_is_told() {
    let without = TEXTURED.replace("2/2", "2");
    for (mtl, text, why) in [
        ("newmtl tiles\nmap_Kd none.png", TEXTURED, "there is no such file"),
        ("newmtl tiles\nmap_Kd a.mtl", TEXTURED, "neither PNG nor JPEG"),
        ("newmtl tiles\nKd 0\nmap_Kd my tiles.png", TEXTURED, "a colour that is black"),
        ("newmtl tiles\nmap_Kd my tiles.png", &without, "without texture coordinates"),
        ("newmtl tiles\nmap_Kd -mm 0 2 my tiles.png", TEXTURED, "the option -mm"),
    ] {
        let scene = textured(mtl, text);
        let [warning] = &scene.warnings[..] else { panic!("{mtl}: {:?}", scene.warnings) };
        assert!(warning.message.contains(why) && warning.file == "a.mtl", "{warning:?}");
        assert!(warning.place.line >= 2, "{warning:?}");
    }
}

#[test]
fn each_fault_is_told_at_its_place() {
    for (text, told) in [
        ("", "a.obj:1:1: the file holds no face"),
        ("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3", "a.obj:1:1: no face of the file has an area"),
        ("v 0 0", "a.obj:1:1: v needs 3 numbers, only 2 follow"),
        ("v 0 0 x", "a.obj:1:7: `x` is not a number"),
        ("v 0 0 nan", "a.obj:1:7: `nan` is no number a scene can use"),
        ("v 0 0 1e300", "a.obj:1:7: `1e300` is too large"),
        ("v 0 0 0\r\nf 0 1 1", "a.obj:2:3: there is no vertex 0"),
        ("v 0 0 0\nf 1 -2 1", "a.obj:2:5: there is no vertex -2: 1 stand before this line"),
        ("v 0 0 0\nf 1 7 1", "a.obj:2:5: there is no vertex 7: the file has 1"),
        ("f 99999999999", "a.obj:1:3: there is no vertex 99999999999"),
        ("f 1/2/3 b/c", "a.obj:1:9: `b` is not a number"),
        ("f 1.5 2 3", "a.obj:1:3: `1.5` is not a whole number"),
    ] {
        let error = read(text).expect_err(text).to_string();
        assert!(error.starts_with(told), "{text}: {error}");
    }
    for (mtl, told) in [
        ("newmtl a\nKd 1 2", "b.mtl:2:1: Kd needs 3 numbers, only 2 follow"),
        ("Kd 1 1 1", "b.mtl:1:1: Kd stands before any newmtl"),
        ("newmtl a\nKe 1 -1 0", "b.mtl:2:6: Ke must not be negative"),
    ] {
        let read = obj::parse_scene("a.obj", b"mtllib b.mtl", |name| Some(Ok((name.into(), mtl.into()))));
        let error = read.expect_err(mtl).to_string();
        assert!(error.starts_with(told), "{mtl}: {error}");
    }
    let corners = "f".to_owned() + &" 1".repeat(2001);
    assert!(read(&corners).unwrap_err().to_string().contains("2001 corners: at most 2000"));
}

/// Whatever comes: reading ends, and what is read can be cut.
fn survives(text: &[u8]) {
    if let Ok(scene) = obj::parse_scene("a.obj", text, |_| Some(Ok(("a.mtl".into(), text.to_vec())))) {
        let patches = patches::subdivide(&scene, 1.0).unwrap();
        rooms::assert_sound(&patches);
    }
}

proptest! {
    #[test]
    fn nothing_upsets_the_reader(
        words in prop::collection::vec(
            prop::sample::select(vec![
                "v", "f", "o", "g", "usemtl", "mtllib", "newmtl", "Kd", "Ke", "\n", "\n", "\r\n", "\\\n", "#", "1", "2",
                "3", "-1", "-2", "1/1", "0", ".5", "1e15", "1e-300", "a.mtl", "spectral", "é", "\u{0}",
            ]),
            0..80,
        ),
    ) {
        survives(words.join(" ").as_bytes());
    }

    #[test]
    fn a_damaged_file_is_refused_or_read(at in 0_usize..200, byte: u8, cut in 0_usize..200) {
        let mut bytes = format!("mtllib a.mtl\n{SQUARE}v .3 .2 1\nusemtl x\nf 1 2 3 4\nf 1 2 5\nf -1 -2 -3\n{MTL}").into_bytes();
        let at = at % bytes.len();
        bytes[at] = byte;
        survives(&bytes);
        bytes.truncate(cut);
        survives(&bytes);
    }
}
