//! Pictures: what is where, how bright, and which way up.

mod rooms;

use glam::DVec3;
use proptest::prelude::*;
use radiosity::bake::{Request, Run, bake};
use radiosity::form_factors::exact::from_point;
use radiosity::light::Rgb;
use radiosity::patches::{self, Patches};
use radiosity::scene::n3d;
use radiosity::scene::{BackFaces, Camera, Material, Mesh, Place, Scene, Shape, Surface};
use radiosity::shade::{
    FinalGather, GatherError, Picture, PictureError, PictureRequest, ShadedSurfaces, Shading, ToneCurve,
    ToneMap, frame, gathered_picture, picture, screen_picture, tone_map,
};
use radiosity::visibility::{Facets, ItemBuffer, NOTHING, View};
use radiosity::watch::ignore;

use rooms::{furnished_room, paint, plate, scene_of, sides};

/// From z = 4 towards -z: x to the right, y up. At z = 0 the window reaches from -2 to 2 both ways.
fn camera() -> Camera {
    Camera {
        eye: DVec3::new(0.0, 0.0, 4.0),
        forward: DVec3::NEG_Z,
        right: DVec3::X,
        up: DVec3::Y,
        horizontal: [-0.5, 0.5],
        vertical: [-0.5, 0.5],
        near: 0.0,
        far: f64::INFINITY,
        viewport: [0.0, 1.0, 0.0, 1.0],
    }
}

const RED: Rgb = Rgb::new(1.0, 0.0, 0.0);
const GREEN: Rgb = Rgb::new(0.0, 1.0, 0.0);

/// A picture of `scene` where each surface emits its own colour and shows it.
fn take(scene: &Scene, camera: &Camera, request: PictureRequest) -> Picture {
    let patches = patches::subdivide(scene, 1.0).unwrap();
    let facets = Facets::new(scene, &patches);
    let shaded = ShadedSurfaces::new(scene, &patches, &facets, &patches.emission, Shading::Flat);
    picture(&shaded, camera, &request).unwrap()
}

fn square(x: f64, y: f64, side: f64, colour: Rgb) -> Surface {
    let mut square = plate([x, y, 0.0], [side, 0.0, 0.0], [0.0, side, 0.0], 1);
    square.material.emission = colour;
    square
}

fn size(width: usize, height: usize) -> PictureRequest {
    PictureRequest { width, height, sampling: 3, ..PictureRequest::default() }
}

fn at(picture: &Picture, x: usize, y: usize) -> [f32; 3] {
    picture.pixels[y * picture.width + x]
}

#[test]
fn right_is_right_and_up_is_up() {
    // Red at the right, green at the left and higher.
    let scene = scene_of([square(1.0, -0.5, 1.0, RED), square(-2.0, 1.0, 1.0, GREEN)]);
    let picture = take(&scene, &camera(), size(40, 40));
    assert_eq!(at(&picture, 35, 20), [1.0, 0.0, 0.0]);
    assert_eq!(at(&picture, 5, 5), [0.0, 1.0, 0.0]);
    assert_eq!(at(&picture, 5, 20), [0.0; 3]);
    assert_eq!(at(&picture, 35, 5), [0.0; 3]);
}

#[test]
fn coverage_is_area() {
    // A square a quarter of the window wide and high, its edges a third of the way into a pixel.
    let side = 1.0;
    let offset = 0.1 / 3.0;
    let scene = scene_of([square(-0.5 + offset, -0.5 + offset, side, Rgb::WHITE)]);
    let picture = take(&scene, &camera(), size(40, 40));
    let light: f64 = picture.pixels.iter().map(|pixel| f64::from(pixel[0])).sum();
    assert!((light - 100.0).abs() < 1e-3, "{light}");
    // The left edge's pixels are two thirds covered, the corner's four ninths.
    assert!((at(&picture, 15, 20)[0] - 2.0 / 3.0).abs() < 1e-6);
    assert!((at(&picture, 15, 24)[0] - 4.0 / 9.0).abs() < 1e-6);
}

#[test]
fn a_back_is_black_where_backs_are_black() {
    let front = scene_of([square(-1.0, -1.0, 2.0, RED)]);
    let mut back = front.clone();
    if let Shape::Parallelogram(p) = &mut back.surfaces[0].shape {
        (p.u, p.v, p.normal) = (p.v, p.u, -p.normal);
    }
    let show = |scene: &Scene, back_faces| {
        at(&take(scene, &camera(), PictureRequest { back_faces, ..size(20, 20) }), 10, 10)[0]
    };
    assert_eq!(show(&front, BackFaces::Black), 1.0);
    assert_eq!(show(&back, BackFaces::Lit), 1.0);
    assert_eq!(show(&back, BackFaces::Black), 0.0);
    // Black, but not gone: it hides what is behind.
    back.surfaces.push(plate([-1.0, -1.0, -1.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], 1));
    back.surfaces[1].material.emission = GREEN;
    assert_eq!(
        at(&take(&back, &camera(), PictureRequest { back_faces: BackFaces::Black, ..size(20, 20) }), 10, 10),
        [0.0; 3]
    );
}

#[test]
fn clipping_planes_clip() {
    let scene = scene_of([square(-1.0, -1.0, 2.0, RED)]);
    let middle = |near, far| at(&take(&scene, &Camera { near, far, ..camera() }, size(20, 20)), 10, 10)[0];
    assert_eq!(middle(3.9, 4.1), 1.0);
    assert_eq!(middle(4.1, 9.0), 0.0);
    assert_eq!(middle(0.0, 3.9), 0.0);
}

#[test]
fn the_viewport_is_where_it_is_drawn() {
    // The window is full of red; the viewport is the picture's lower right quarter.
    let scene = scene_of([square(-9.0, -9.0, 18.0, RED)]);
    let camera = Camera { viewport: [0.5, 1.0, 0.0, 0.5], ..camera() };
    let picture = take(&scene, &camera, size(60, 40));
    for y in 0..40 {
        for x in 0..60 {
            let inside = x >= 30 && y >= 20;
            assert_eq!(at(&picture, x, y), if inside { [1.0, 0.0, 0.0] } else { [0.0; 3] }, "{x} {y}");
        }
    }
}

#[test]
fn pixels_are_square_whatever_the_shape() {
    let scene = scene_of([square(-2.0, -2.0, 4.0, RED)]);
    // The square is the whole window: it fills the smaller side and stays a square.
    for (width, height) in [(60, 30), (30, 60), (30, 30)] {
        let picture = take(&scene, &camera(), size(width, height));
        let red = picture.pixels.iter().filter(|pixel| pixel[0] == 1.0).count();
        assert_eq!(red, 900, "{width}x{height}");
        assert_eq!(at(&picture, width / 2, height / 2)[0], 1.0);
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let (scene, patches, values) = shining_room();
    let facets = Facets::new(&scene, &patches);
    let shaded = ShadedSurfaces::new(&scene, &patches, &facets, &values, Shading::Smooth);
    let camera = frame(&scene);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let request = PictureRequest { sampling: 5, ..size(701, 503) };
        pool.install(|| picture(&shaded, &camera, &request).unwrap())
    };
    let one = on(1);
    assert!(one.pixels.iter().any(|pixel| pixel[0] > 0.0));
    assert!(one == on(2) && one == on(7));
}

/// A furnished room and made-up radiosities on it.
fn shining_room() -> (Scene, Patches, Vec<Rgb>) {
    let scene = rooms::furnished_room();
    let patches = patches::subdivide(&scene, 1.0).unwrap();
    let values =
        patches.centre.iter().map(|c| Rgb::new(c.x, 1.0 + c.y.sin(), 0.3 * c.z) + Rgb::grey(0.1)).collect();
    (scene, patches, values)
}

#[test]
fn an_impossible_picture_is_refused() {
    let (scene, patches, values) = shining_room();
    let facets = Facets::new(&scene, &patches);
    let shaded = ShadedSurfaces::new(&scene, &patches, &facets, &values, Shading::Smooth);
    for (width, height) in [(0, 10), (10, 0), (70_000, 10), (60_000, 60_000), (usize::MAX, usize::MAX)] {
        let refused = picture(&shaded, &camera(), &size(width, height)).unwrap_err();
        assert_eq!(refused, PictureError::Size { width, height });
        assert!(refused.to_string().contains("65535"), "{refused}");
    }
    for sampling in [0, 17] {
        let request = PictureRequest { sampling, ..size(8, 6) };
        assert_eq!(picture(&shaded, &camera(), &request), Err(PictureError::Sampling(sampling)));
    }
}

#[test]
fn a_lamps_edge_is_smooth_on_the_screen() {
    // A lamp a thousand times white covers one sample in nine of the pixels at its left edge.
    let left = -0.5 + 0.2 / 3.0;
    let scene = scene_of([square(left, -2.0, 4.0, Rgb::grey(1000.0))]);
    let patches = patches::subdivide(&scene, 1.0).unwrap();
    let facets = Facets::new(&scene, &patches);
    let shaded = ShadedSurfaces::new(&scene, &patches, &facets, &patches.emission, Shading::Smooth);
    let request = size(40, 40);
    let tone = ToneMap::default();
    let screen = screen_picture(&shaded, &camera(), &request, tone).unwrap();
    let linear = picture(&shaded, &camera(), &request).unwrap();
    let row = 20 * 40;
    // A third of the way to white, in linear light, is code 156.
    assert_eq!(screen.pixels[row + 14..row + 17], [[0; 3], [156; 3], [255; 3]]);
    // The linear picture keeps the light itself.
    assert!((linear.pixels[row + 15][0] - 1000.0 / 3.0).abs() < 1e-2);
    // Where no edge is, both ways agree.
    assert_eq!(tone_map(&linear, tone).pixels[row + 16], screen.pixels[row + 16]);
}

#[test]
fn both_ways_to_the_screen_agree_inside_surfaces() {
    let (scene, patches, values) = shining_room();
    let facets = Facets::new(&scene, &patches);
    let shaded = ShadedSurfaces::new(&scene, &patches, &facets, &values, Shading::Smooth);
    let tone = ToneMap { exposure: -1.5, curve: ToneCurve::Neutral };
    let request = PictureRequest { sampling: 1, ..size(160, 120) };
    let camera = frame(&scene);
    let linear = picture(&shaded, &camera, &request).unwrap();
    assert_eq!(tone_map(&linear, tone), screen_picture(&shaded, &camera, &request, tone).unwrap());
}

/// One parallelogram of columns x rows patches, with a value each.
fn grid(columns: u32, rows: u32) -> (Scene, Patches, Facets) {
    let mut plate = plate([1.0, 2.0, 3.0], [3.0, 0.5, 0.0], [0.2, 1.5, 1.0], 1);
    if let Shape::Parallelogram(p) = &mut plate.shape {
        (p.columns, p.rows) = (columns, rows);
    }
    let scene = scene_of([plate]);
    let patches = patches::subdivide(&scene, 1.0).unwrap();
    let facets = Facets::new(&scene, &patches);
    (scene, patches, facets)
}

proptest! {
    #[test]
    fn smooth_shading_reproduces_linear_functions(
        columns in 1_u32..9, rows in 1_u32..9, u in 0.0..1.0, v in 0.0..1.0,
    ) {
        let (scene, patches, facets) = grid(columns, rows);
        let linear = |p: DVec3| Rgb::new(p.x - 2.0 * p.y, p.z, 3.0);
        let values: Vec<Rgb> = patches.centre.iter().map(|&centre| linear(centre)).collect();
        let shaded = ShadedSurfaces::new(&scene, &patches, &facets, &values, Shading::Smooth);
        // Beyond the outermost centres the nearest of them counts.
        let clamp = |s: f64, cells: u32| {
            let half = 0.5 / f64::from(cells);
            s.clamp(half, 1.0 - half)
        };
        let facet = &facets[0];
        let place = facet.origin + facet.u * clamp(u, columns) + facet.v * clamp(v, rows);
        let off = shaded.at(0, u, v) - linear(place);
        prop_assert!(off.norm_squared().sqrt() < 1e-12, "{off:?}");
    }

    #[test]
    fn smooth_shading_is_continuous_and_stays_between(
        u in 0.0..1.0, v in 0.0..1.0, seed in prop::collection::vec(0.0..1.0, 12),
    ) {
        let (scene, patches, facets) = grid(4, 3);
        let values: Vec<Rgb> = seed.iter().map(|&value| Rgb::grey(value)).collect();
        let shaded = ShadedSurfaces::new(&scene, &patches, &facets, &values, Shading::Smooth);
        let here = shaded.at(0, u, v).r;
        let step = 1e-7;
        for (du, dv) in [(step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step)] {
            // No steeper than the whole range from one centre to the next.
            prop_assert!((shaded.at(0, u + du, v + dv).r - here).abs() <= 4.0 * step * 1.001);
        }
        let least = seed.iter().copied().fold(f64::INFINITY, f64::min);
        let most = seed.iter().copied().fold(0.0, f64::max);
        prop_assert!(here >= least - 1e-12 && here <= most + 1e-12);
    }

    #[test]
    fn flat_shading_shows_each_patch(columns in 1_u32..9, rows in 1_u32..9) {
        let (scene, patches, facets) = grid(columns, rows);
        let values: Vec<Rgb> = (0..patches.len()).map(|k| Rgb::grey(k as f64)).collect();
        let shaded = ShadedSurfaces::new(&scene, &patches, &facets, &values, Shading::Flat);
        for (patch, &centre) in patches.centre.iter().enumerate() {
            let (u, v) = facets[0].uv(centre);
            prop_assert_eq!(shaded.at(0, u, v), values[patch]);
        }
    }
}

/// What smooth shading shows of two parallelograms on either side of x = 1 along that line, at y: on the left and on the right.
fn at_the_seam(others: &str, y: f64) -> [f64; 2] {
    let text = format!("QD 4 3 0 0 0 1 0 0 1 3 0 0 3 0 CD .5 .5 .5 ID {others}");
    let scene = n3d::parse_scene("seam.scn", text.as_bytes()).unwrap();
    let patches = patches::subdivide(&scene, 1.0).unwrap();
    let facets = Facets::new(&scene, &patches);
    let values: Vec<Rgb> =
        patches.centre.iter().map(|p| Rgb::grey((7.0 * p.x + 3.0 * p.y * p.y).sin())).collect();
    let shaded = ShadedSurfaces::new(&scene, &patches, &facets, &values, Shading::Smooth);
    [0, 1].map(|facet| {
        let (u, v) = facets[facet].uv(DVec3::new(1.0, y, 0.0));
        shaded.at(facet, u, v).r
    })
}

#[test]
fn grids_that_meet_smoothly_have_no_seam() {
    let apart = |others: &str| {
        let ys = (0..=60).map(|k| f64::from(k) * 0.05);
        ys.map(|y| {
            let [left, right] = at_the_seam(others, y);
            (left - right).abs()
        })
        .fold(0.0, f64::max)
    };
    let tile =
        |columns: u32, rest: &str| format!("QD {columns} 3 1 0 0 2 0 0 2 3 0 1 3 0 CD .5 .5 .5 ID {rest}");
    // Of other cells across, turned about, bent a little; with two more that meet them in a corner.
    for beyond in [
        tile(4, ""),
        tile(2, ""),
        "QD 3 2 2 0 0 2 3 0 1 3 0 1 0 0 CD .5 .5 .5 ID".to_owned(),
        "QD 2 3 1 0 0 2 0 .5 2 3 .5 1 3 0 CD .5 .5 .5 ID".to_owned(),
        tile(
            4,
            "QD 4 2 0 3 0 1 3 0 1 5 0 0 5 0 CD .5 .5 .5 ID QD 4 2 1 3 0 2 3 0 2 5 0 1 5 0 CD .5 .5 .5 ID",
        ),
        tile(4, "QD 2 2 0 -2 0 2 -2 0 2 0 0 0 0 0 CD .5 .5 .5 ID"),
        // What hangs below stands on nothing.
        tile(4, "QD 1 1 1 0 0 1 3 0 1 3 -2 1 0 -2 CD .5 .5 .5 ID"),
    ] {
        assert!(apart(&beyond) < 1e-12, "{beyond}: {}", apart(&beyond));
    }
    // Of other cells along, hardly any.
    assert!(
        apart("QD 4 6 1 0 0 2 0 0 2 3 0 1 3 0 CD .5 .5 .5 ID")
            < 0.3 * apart("QD 4 6 1 0 0 2 0 0 2 3 0 1 3 0 CD .4 .5 .5 ID")
    );
    // Where there is another colour, a crease, a wall on the line or nobody, each is as ever.
    let alone = at_the_seam("QD 4 3 9 0 0 10 0 0 10 3 0 9 3 0 CD .5 .5 .5 ID", 1.3)[0];
    for parted in [
        "QD 4 3 1 0 0 2 0 0 2 3 0 1 3 0 CD .5 .5 .4 ID".to_owned(),
        "QD 4 3 1 0 0 2 0 1 2 3 1 1 3 0 CD .5 .5 .5 ID".to_owned(),
        tile(4, "QD 1 1 1 0 0 1 3 0 1 3 2 1 0 2 CD .5 .5 .5 ID"),
        "QD 4 3 2 0 0 1 0 0 1 3 0 2 3 0 CD .5 .5 .5 ID".to_owned(),
        "QD 4 3 0 0 0 1 0 0 1 3 0 0 3 0 CD .5 .5 .5 ID".to_owned(),
    ] {
        assert_eq!(at_the_seam(&parted, 1.3)[0], alone, "{parted}");
    }
}

/// A lid over the origin: eight triangles round a raised middle, gentle enough to be smooth.
fn lid(height: f64) -> Scene {
    let mut vertices = vec![DVec3::new(0.0, 0.0, height)];
    vertices.extend((0..8).map(|k| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / 8.0).sin_cos();
        DVec3::new(cos, sin, 0.0)
    }));
    let triangles = (0..8).map(|k| [0, 1 + k, 1 + (k + 1) % 8]).collect();
    scene_of([Surface {
        name: String::new(),
        shape: Shape::Mesh(Mesh { vertices, triangles, ..Mesh::default() }),
        material: Material::default(),
        place: Place::default(),
    }])
}

#[test]
fn a_mesh_is_continuous_where_it_is_smooth() {
    let values: Vec<Rgb> = (0..8).map(|k| Rgb::grey(f64::from(k * k))).collect();
    let across_first_edge = |scene: &Scene, shading| {
        let patches = patches::subdivide(scene, 1.0).unwrap();
        let facets = Facets::new(scene, &patches);
        let shaded = ShadedSurfaces::new(scene, &patches, &facets, &values, shading);
        // The edge from the middle to vertex 2 is v of triangle 0 and u of triangle 1.
        (shaded.at(0, 0.0, 0.6).r, shaded.at(1, 0.6, 0.0).r)
    };
    let (one, other) = across_first_edge(&lid(0.2), Shading::Smooth);
    assert!((one - other).abs() < 1e-12 && one > 0.0, "{one} {other}");
    // The middle is the mean of all eight, the rim's vertex of two: 0.4 x 17.5 + 0.6 x 0.5.
    assert!((one - 7.3).abs() < 1e-12, "{one}");
    assert_eq!(across_first_edge(&lid(0.2), Shading::Flat), (0.0, 1.0));
    // As a steep tent it has an edge there.
    assert_eq!(across_first_edge(&lid(3.0), Shading::Smooth), (0.0, 1.0));
}

/// What a camera shows, a number of cells for each surface seen from its front, from behind (`None`: nothing).
fn seen(scene: &Scene, camera: &Camera) -> (Vec<usize>, usize, usize) {
    let patches = patches::subdivide(scene, 1.0).unwrap();
    let facets = Facets::new(scene, &patches);
    let view = View {
        eye: camera.eye,
        right: camera.right,
        up: camera.up,
        forward: camera.forward,
        horizontal: camera.horizontal,
        vertical: [camera.vertical[1], camera.vertical[0]],
        width: 80,
        height: 60,
        near: 0.0,
        far: f64::INFINITY,
    };
    let mut buffer = ItemBuffer::default();
    buffer.draw(&facets, &view);
    let (mut front, mut back, mut nothing) = (vec![0; scene.surfaces.len()], 0, 0);
    for &facet in (0..buffer.height()).flat_map(|y| buffer.facets(y)) {
        match facet {
            NOTHING => nothing += 1,
            facet if facets[facet].faces(camera.eye) => front[facets[facet].surface as usize] += 1,
            _ => back += 1,
        }
    }
    (front, back, nothing)
}

#[test]
fn a_closed_room_is_seen_from_within() {
    let scene = scene_of(sides([-1.0, 0.0, -2.0], [3.0, 2.5, 3.0], 4, true));
    let (front, back, nothing) = seen(&scene, &frame(&scene));
    assert_eq!((back, nothing), (0, 0));
    assert!(front.iter().filter(|&&cells| cells > 0).count() >= 4, "{front:?}");
}

#[test]
fn furniture_is_not_sat_in() {
    let mut surfaces = sides([0.0, 0.0, 0.0], [6.0, 3.0, 5.0], 4, true);
    // A block right where the middle of the room is, and a cupboard in a corner, both closed.
    surfaces.extend(sides([2.0, 0.0, 2.0], [4.0, 2.2, 3.5], 2, false));
    surfaces.extend(sides([0.0, 0.0, 0.0], [1.5, 2.9, 1.5], 2, false));
    let scene = scene_of(surfaces);
    let camera = frame(&scene);
    let (front, back, nothing) = seen(&scene, &camera);
    assert_eq!((back, nothing), (0, 0), "{camera:?}");
    assert!(front[6..12].iter().sum::<usize>() > 100, "the block is in the picture: {front:?}");
    assert!(front[..6].iter().sum::<usize>() > 1000, "and so is the room: {front:?}");
}

#[test]
fn an_open_side_is_looked_in_through() {
    // Each side of the box is the open one in turn: 0, 1 the z sides, 2, 3 the y sides, 4, 5 the x sides.
    for (open, back_faces) in (0..6).flat_map(|open| [(open, BackFaces::Lit), (open, BackFaces::Black)]) {
        let mut surfaces = sides([0.0; 3], [4.0, 3.0, 5.0], 4, true);
        surfaces.remove(open);
        let scene = Scene { back_faces, ..scene_of(surfaces) };
        let camera = frame(&scene);
        let (front, back, _) = seen(&scene, &camera);
        assert_eq!(back, 0, "open side {open}: {camera:?}");
        assert!(front.iter().all(|&cells| cells > 50), "open side {open}: {front:?}");
    }
}

#[test]
fn a_carelessly_wound_room_is_still_a_room() {
    // Backs are lit, so its author never saw that every other wall faces outward.
    for careless in [[0, 2], [1, 5], [3, 4]] {
        let mut scene = scene_of(sides([-1.0, 0.0, -2.0], [3.0, 2.5, 3.0], 4, true));
        for wall in careless {
            if let Shape::Parallelogram(p) = &mut scene.surfaces[wall].shape {
                (p.u, p.v, p.normal) = (p.v, p.u, -p.normal);
            }
        }
        let camera = frame(&scene);
        let inside =
            camera.eye.cmpgt(DVec3::new(-1.0, 0.0, -2.0)) & camera.eye.cmplt(DVec3::new(3.0, 2.5, 3.0));
        assert!(inside.all(), "{careless:?}: {camera:?}");
    }
}

#[test]
fn a_thing_is_seen_from_outside_and_above() {
    let scene = scene_of(sides([-1.0, 0.0, -1.0], [1.0, 1.5, 1.0], 4, false));
    let camera = frame(&scene);
    let (front, back, nothing) = seen(&scene, &camera);
    assert_eq!(front.iter().filter(|&&cells| cells > 100).count(), 3, "{front:?}");
    assert_eq!(back, 0);
    assert!(nothing > 400);
    assert!(camera.eye.y > 1.5 && camera.up.y > 0.5, "{camera:?}");
}

#[test]
fn a_thing_on_a_floor_is_seen_from_above() {
    let mut surfaces = sides([-0.5, 0.01, -0.5], [0.5, 1.0, 0.5], 2, false);
    surfaces.push(plate([-2.0, 0.0, -2.0], [0.0, 0.0, 4.0], [4.0, 0.0, 0.0], 8));
    let scene = scene_of(surfaces);
    let camera = frame(&scene);
    let (front, back, _) = seen(&scene, &camera);
    assert!(camera.eye.y > 1.0 && back == 0, "{camera:?}");
    assert!(front[6] > 500 && front[..6].iter().filter(|&&cells| cells > 30).count() >= 3, "{front:?}");
}

#[test]
fn a_lone_square_is_faced() {
    for (u, v) in [(DVec3::X, DVec3::Y), (DVec3::Y, DVec3::X), (DVec3::Y, DVec3::Z), (DVec3::Z, DVec3::X)] {
        let scene = scene_of([plate([5.0; 3], u.to_array(), v.to_array(), 4)]);
        let (front, back, _) = seen(&scene, &frame(&scene));
        assert!(front[0] > 1000 && back == 0, "{u} {v}: {front:?}");
    }
}

#[test]
fn a_scene_of_nothing_has_a_camera_too() {
    let camera = frame(&scene_of([]));
    assert!(camera.eye.is_finite() && camera.forward.is_normalized());
}

#[test]
fn a_frame_is_the_same_at_any_scale() {
    let small = rooms::furnished_room();
    let mut large = small.clone();
    for surface in &mut large.surfaces {
        if let Shape::Parallelogram(p) = &mut surface.shape {
            (p.origin, p.u, p.v) = (p.origin * 1024.0, p.u * 1024.0, p.v * 1024.0);
        }
    }
    let (one, other) = (frame(&small), frame(&large));
    assert!((one.eye * 1024.0 - other.eye).length() < 1e-6 * other.eye.length());
    assert!((one.forward - other.forward).length() < 1e-9);
}

/// Hills of 33,000 triangles, seen from above and from its lit side.
#[test]
fn a_large_mesh_is_framed_too() {
    let side = 129_u32;
    let vertices = (0..side * side).map(|k| {
        let (x, z) = (f64::from(k % side), f64::from(k / side));
        DVec3::new(x, 6.0 * (x / 9.0).sin() * (z / 14.0).cos(), z)
    });
    let triangles = (0..(side - 1) * (side - 1)).flat_map(|k| {
        let a = k / (side - 1) * side + k % (side - 1);
        [[a, a + side, a + 1], [a + 1, a + side, a + side + 1]]
    });
    let mut scene = lid(0.0);
    scene.surfaces[0].shape =
        Shape::Mesh(Mesh { vertices: vertices.collect(), triangles: triangles.collect(), ..Mesh::default() });
    let camera = frame(&scene);
    let (front, back, _) = seen(&scene, &camera);
    assert!(front[0] > 1500 && back < 20, "{camera:?} {front:?} {back}");
    assert!(camera.forward.y < 0.0);
}

/// A gathered picture of a scene whose patches have this light.
fn gather(
    scene: &Scene,
    light: impl Fn(&Patches) -> Vec<Rgb>,
    camera: &Camera,
    request: PictureRequest,
) -> Picture {
    let patches = patches::subdivide(scene, 1.0).unwrap();
    let facets = Facets::new(scene, &patches);
    let light = light(&patches);
    let gather = FinalGather::new(scene, &patches, &facets, &light, request.back_faces, Rgb::BLACK);
    gathered_picture(&gather, camera, &request, &ignore).unwrap()
}

/// From just above the origin, down: its one pixel has its centre there.
fn at_origin() -> (Camera, PictureRequest) {
    let camera = Camera {
        eye: DVec3::new(0.0, 0.0, 0.1),
        horizontal: [-1e-9, 1e-9],
        vertical: [-1e-9, 1e-9],
        ..camera()
    };
    (camera, PictureRequest { sampling: 1, ..size(1, 1) })
}

/// A floor, and over the corner at its middle a lamp one by one, one above.
fn floor_and_lamp() -> Scene {
    let floor = plate([-1.0, -1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], 2);
    let mut lamp = plate([0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], 3);
    lamp.material.emission = Rgb::grey(20.0);
    scene_of([floor, lamp])
}

/// From an element to a parallel rectangle a x b at distance 1, the normal through a corner (Howell B-3).
fn rectangle_over_corner(a: f64, b: f64) -> f64 {
    let half = |a: f64, b: f64| a / a.hypot(1.0) * (b / a.hypot(1.0)).atan();
    (half(a, b) + half(b, a)) / std::f64::consts::TAU
}

#[test]
fn gathered_light_straight_from_a_lamp_is_exact() {
    let (camera, request) = at_origin();
    let seen = |scene: &Scene| {
        f64::from(gather(scene, |patches| patches.emission.clone(), &camera, request).pixels[0][0])
    };
    let lit = floor_and_lamp();
    let whole = rectangle_over_corner(1.0, 1.0);
    assert!((whole - 0.138_531_605_995).abs() < 1e-12);
    assert!((seen(&lit) / (0.5 * 20.0 * whole) - 1.0).abs() < 1e-6);

    // From there a plate halfway up hides the half of the lamp.
    let half = whole - rectangle_over_corner(0.5, 1.0);
    let mut hidden = lit.clone();
    hidden.surfaces.push(plate([0.0, -0.1, 0.5], [0.25, 0.0, 0.0], [0.0, 0.7, 0.0], 1));
    assert!((seen(&hidden) / (0.5 * 20.0 * half) - 1.0).abs() < 1e-5, "{}", seen(&hidden));
    // In so many parts that they are not cut out one by one it is the same.
    let mut parts = lit.clone();
    for k in 0..25 {
        let (x, y) = (f64::from(k % 5) * 0.05, f64::from(k / 5) * 0.14 - 0.1);
        parts.surfaces.push(plate([x, y, 0.5], [0.05, 0.0, 0.0], [0.0, 0.14, 0.0], 1));
    }
    assert!((seen(&parts) / (0.5 * 20.0 * half) - 1.0).abs() < 1e-4, "{}", seen(&parts));
    // And one that is large enough hides all.
    hidden.surfaces.push(plate([-0.1, -0.1, 0.6], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], 1));
    assert_eq!(seen(&hidden), 0.0);
}

/// A camera within the furnished room, looking along it.
fn in_the_room() -> Camera {
    Camera {
        eye: DVec3::new(3.5, 2.5, 1.5),
        forward: DVec3::NEG_X,
        right: DVec3::Y,
        up: DVec3::Z,
        ..camera()
    }
}

#[test]
fn a_gathered_furnace_is_flat() {
    // E = 1 - ρ everywhere: B = 1, behind and beside whatever stands about. Where all reflect alike nothing is left but rounding;
    // else the hemicubes' errors are.
    let mut scene = furnished_room();
    let camera = Camera { horizontal: [-1.0, 1.0], vertical: [-1.0, 1.0], ..in_the_room() };
    for (uneven, bound, mean_bound) in [(0.0, 1e-4, 1e-4), (0.1, 6e-3, 1e-3)] {
        paint(&mut scene, |k| {
            let reflectance = 0.3 + uneven * (k % 6) as f64;
            (Rgb::grey(1.0 - reflectance), Rgb::grey(reflectance))
        });
        let picture = gather(&scene, |patches| vec![Rgb::WHITE; patches.len()], &camera, size(40, 40));
        for (k, pixel) in picture.pixels.iter().enumerate() {
            assert!((pixel[0] - 1.0).abs() < bound, "{pixel:?} at {}, {}, beyond {bound}", k % 40, k / 40);
        }
        let off: f32 = picture.pixels.iter().map(|pixel| (pixel[0] - 1.0).abs()).sum();
        let mean = f64::from(off) / picture.pixels.len() as f64;
        assert!(mean < mean_bound, "{mean} on the mean, beyond {mean_bound}");
    }
}

#[test]
fn gathered_light_is_nearer_to_the_truth_than_the_patches() {
    // A room with a lamp below the ceiling and a plate below that, whose shadow the floor's patches are too coarse for.
    let mut scene = scene_of(sides([0.0; 3], [1.0; 3], 4, true));
    let mut lamp = plate([0.35, 0.35, 0.95], [0.0, 0.3, 0.0], [0.3, 0.0, 0.0], 2);
    lamp.material.emission = Rgb::grey(20.0);
    scene.surfaces.extend([lamp, plate([0.15, 0.3, 0.5], [0.3, 0.0, 0.0], [0.0, 0.4, 0.0], 2)]);
    scene.back_faces = BackFaces::Black;
    let request = Request { back_faces: Some(BackFaces::Black), ..Request::default() };
    let coarse = bake(&scene, &request, &Run::default(), &mut ignore).unwrap();
    let mut finer = scene.clone();
    for surface in &mut finer.surfaces {
        if let Shape::Parallelogram(p) = &mut surface.shape {
            (p.columns, p.rows) = (4 * p.columns, 4 * p.rows);
        }
    }
    let fine = bake(&finer, &request, &Run::default(), &mut ignore).unwrap();

    // From right above the floor's middle all of it is in view, evenly.
    let camera = Camera {
        eye: DVec3::new(0.5, 0.5, 0.25),
        horizontal: [-2.0, 2.0],
        vertical: [-2.0, 2.0],
        ..camera()
    };
    let view = PictureRequest { back_faces: BackFaces::Black, ..size(32, 32) };
    let light = &coarse.solution.radiosity;
    let shaded = ShadedSurfaces::new(&scene, &coarse.patches, &coarse.facets, light, Shading::Smooth);
    let smooth = picture(&shaded, &camera, &view).unwrap();
    let gathered =
        FinalGather::new(&scene, &coarse.patches, &coarse.facets, light, BackFaces::Black, Rgb::BLACK);
    let gathered = gathered_picture(&gathered, &camera, &view, &ignore).unwrap();

    // Of each fine patch of the floor, 16 x 16, its four pixels; rows of the picture begin at the far end.
    let error = |picture: &Picture| {
        let mut sums = [0.0; 2];
        for k in 0..256 {
            let (column, row) = (k % 16, k / 16);
            let pixel = |x: usize, y: usize| f64::from(at(picture, 2 * column + x, 31 - 2 * row - y)[0]);
            let mean = (pixel(0, 0) + pixel(1, 0) + pixel(0, 1) + pixel(1, 1)) / 4.0;
            let truth = fine.solution.radiosity[k].r;
            sums = [sums[0] + (mean - truth).powi(2), sums[1] + truth * truth];
        }
        (sums[0] / sums[1]).sqrt()
    };
    let (smooth, gathered) = (error(&smooth), error(&gathered));
    assert!(gathered < 0.03 && smooth > 3.5 * gathered, "smooth {smooth}, gathered {gathered}");
}

#[test]
fn a_gathered_sphere_is_round() {
    // Twelve facets around; its light is that of the true sphere.
    let scene = n3d::parse_scene(
        "sphere.scn",
        b"SP NM 24 12 CD .5 .5 .5 ID   QD 1 1 -2 -2 9  -2 2 9  2 2 9  2 -2 9  CE 20 20 20 ID",
    )
    .unwrap();
    let picture = gather(&scene, |patches| patches.emission.clone(), &camera(), size(80, 80));
    let lamp = [[-2.0, -2.0], [-2.0, 2.0], [2.0, 2.0], [2.0, -2.0]].map(|[x, y]| DVec3::new(x, y, 9.0));
    let mut worst: f64 = 0.0;
    for (k, pixel) in picture.pixels.iter().enumerate() {
        let direction = DVec3::new((k % 80) as f64 / 80.0 - 0.49375, 0.49375 - (k / 80) as f64 / 80.0, -1.0);
        let (a, b) = (direction.length_squared(), 4.0 * direction.z);
        let root = b * b - a * 15.0;
        if root <= 0.25 * a {
            continue;
        }
        let point = DVec3::new(0.0, 0.0, 4.0) + direction * ((-b - root.sqrt()) / a);
        let truth = 0.5 * 20.0 * from_point(point, point.normalize(), &lamp);
        worst = worst.max((f64::from(pixel[0]) - truth).abs());
    }
    let brightest = 0.5 * 20.0 * from_point(DVec3::Z, DVec3::Z, &lamp);
    assert!(worst < 0.02 * brightest, "{worst} of {brightest}");
}

#[test]
fn gathering_is_the_same_on_any_number_of_threads_and_can_be_stopped() {
    let (mut scene, request) = (furnished_room(), PictureRequest { sampling: 2, ..size(64, 48) });
    scene.surfaces[1].material.emission = Rgb::grey(3.0);
    let camera = in_the_room();
    let patches = patches::subdivide(&scene, 1.0).unwrap();
    let facets = Facets::new(&scene, &patches);
    let light: Vec<Rgb> =
        (0..patches.len()).map(|k| Rgb::grey(0.1 + 0.01 * (k % 7) as f64) + patches.emission[k]).collect();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let gather = FinalGather::new(&scene, &patches, &facets, &light, BackFaces::Lit, Rgb::BLACK);
            gathered_picture(&gather, &camera, &request, &ignore).unwrap()
        })
    };
    let one = on(1);
    assert!(one == on(3));
    assert!(one.pixels.iter().all(|pixel| pixel.iter().all(|value| value.is_finite())));

    let gather = FinalGather::new(&scene, &patches, &facets, &light, BackFaces::Lit, Rgb::BLACK);
    let stopped = gathered_picture(&gather, &camera, &request, &|_| std::ops::ControlFlow::Break(()));
    assert!(matches!(stopped, Err(GatherError::Interrupted(_))));
}
