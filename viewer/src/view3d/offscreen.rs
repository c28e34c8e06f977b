//! The view held against the engine's pictures, without a window: OpenGL through EGL, on whatever there is (Mesa's
//! llvmpipe, where there is no graphics card).
//!
//! `RADIOSITY_VIEW_PICTURES=DIR cargo test -p radiosity-viewer` leaves what was compared in DIR, as PNG.
#![allow(unsafe_code, reason = "makes the OpenGL context that a window would bring")]

use std::path::Path;
use std::sync::{Mutex, MutexGuard};

use eframe::glow::{self, HasContext as _};
use glutin::api::egl::{device::Device, display::Display};
use glutin::config::{ConfigSurfaceTypes, ConfigTemplateBuilder};
use glutin::context::{ContextApi, ContextAttributesBuilder, GlProfile, Version};
use glutin::prelude::*;
use radiosity::light::Rgb;
use radiosity::patches::subdivide;
use radiosity::scene::{self, BackFaces};
use radiosity::shade::{PictureRequest, ShadedSurfaces, ToneMap, screen_picture};

use super::gl_renderer::Pending;
use super::*;

/// Each test has its own context, one at a time: threads of the software renderer would only get into each other's way.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// A framebuffer as a window has it: 8 bits, no depth, no several samples.
struct Offscreen {
    gl: glow::Context,
    framebuffer: glow::Framebuffer,
    _context: glutin::api::egl::context::PossiblyCurrentContext,
    _alone: MutexGuard<'static, ()>,
}

impl Offscreen {
    /// A context, or why there is none.
    fn new(embedded: bool) -> Result<Self, String> {
        let alone = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
        let mut why = String::from("EGL has no device");
        for device in Device::query_devices().map_err(|error| error.to_string())? {
            match Self::on(&device, embedded) {
                Ok((gl, framebuffer, context)) => {
                    return Ok(Self { gl, framebuffer, _context: context, _alone: alone });
                }
                Err(error) => why = error,
            }
        }
        Err(why)
    }

    fn on(
        device: &Device,
        embedded: bool,
    ) -> Result<(glow::Context, glow::Framebuffer, glutin::api::egl::context::PossiblyCurrentContext), String>
    {
        let text = |error: glutin::error::Error| error.to_string();
        let api = if embedded {
            ContextApi::Gles(Some(Version::new(3, 0)))
        } else {
            ContextApi::OpenGl(Some(Version::new(3, 3)))
        };
        // SAFETY: the display outlives the context, which keeps it; no native window is handed over.
        unsafe {
            let display = Display::with_device(device, None).map_err(text)?;
            let template =
                ConfigTemplateBuilder::new().with_surface_type(ConfigSurfaceTypes::empty()).build();
            let config = display.find_configs(template).map_err(text)?.next().ok_or("no configuration")?;
            let attributes = ContextAttributesBuilder::new()
                .with_context_api(api)
                .with_profile(GlProfile::Core)
                .build(None);
            let context = display.create_context(&config, &attributes).map_err(text)?;
            let context = context.make_current_surfaceless().map_err(text)?;
            let gl = glow::Context::from_loader_function_cstr(|name| display.get_proc_address(name).cast());
            let framebuffer = gl.create_framebuffer()?;
            Ok((gl, framebuffer, context))
        }
    }

    /// What `renderer` paints into a window of this size, the top row first.
    fn paint(&self, renderer: &mut Renderer, frame: &Frame, [width, height]: [i32; 2]) -> Vec<[u8; 3]> {
        let gl = &self.gl;
        // SAFETY: the buffer that is read into has four bytes a pixel; what is made is deleted.
        unsafe {
            let colour = gl.create_renderbuffer().unwrap();
            gl.bind_renderbuffer(glow::RENDERBUFFER, Some(colour));
            gl.renderbuffer_storage(glow::RENDERBUFFER, glow::RGBA8, width, height);
            gl.bind_framebuffer(glow::FRAMEBUFFER, Some(self.framebuffer));
            let place = glow::COLOR_ATTACHMENT0;
            gl.framebuffer_renderbuffer(glow::FRAMEBUFFER, place, glow::RENDERBUFFER, Some(colour));
            assert_eq!(gl.check_framebuffer_status(glow::FRAMEBUFFER), glow::FRAMEBUFFER_COMPLETE);
            gl.scissor(0, 0, width, height);
            renderer.paint(gl, frame, Viewport { left: 0, bottom: 0, width, height });
            assert_eq!(renderer.error(), None);
            assert_eq!(
                gl.get_parameter_framebuffer(glow::DRAW_FRAMEBUFFER_BINDING),
                Some(self.framebuffer),
                "the window's framebuffer is bound again"
            );
            let mut bytes = vec![0; 4 * width as usize * height as usize];
            let pack = glow::PixelPackData::Slice(Some(&mut bytes));
            gl.read_pixels(0, 0, width, height, glow::RGBA, glow::UNSIGNED_BYTE, pack);
            assert_eq!(gl.get_error(), glow::NO_ERROR);
            gl.delete_renderbuffer(colour);
            let rows = bytes.chunks_exact(4 * width as usize).rev();
            rows.flat_map(|row| row.chunks_exact(4).map(|p| [p[0], p[1], p[2]])).collect()
        }
    }
}

/// A context, or a printed reason to do without this test.
fn offscreen(embedded: bool) -> Option<Offscreen> {
    Offscreen::new(embedded).map_err(|why| println!("skipped: no OpenGL without a window here: {why}")).ok()
}

/// A scene with some light in it.
struct Case {
    name: String,
    scene: Scene,
    patches: Patches,
    facets: Facets,
    light: Vec<Rgb>,
    buffers: Arc<SceneBuffers>,
}

impl Case {
    fn new(name: &str, subdivision: f64) -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes").join(name).with_extension("scn");
        Self::of(name, scene::read(&path).unwrap(), subdivision)
    }

    fn of(name: &str, scene: Scene, subdivision: f64) -> Self {
        let patches = subdivide(&scene, subdivision).unwrap();
        let facets = Facets::new(&scene, &patches);
        let size = facets.extent();
        // Not the solution, but as bright and as varied: pools of light on coloured walls, lamps far above white.
        let light = (0..patches.len()).map(|i| {
            let p = patches.centre[i] / size * 9.0;
            let pool = 0.8 + 0.5 * p.x.sin() + 0.4 * (p.y * 1.3).cos() + 0.35 * (p.z * 0.7 + p.x).sin();
            patches.emission[i] + patches.reflectance[i] * (pool * pool * (0.8 + 0.2 * (i % 3) as f64))
        });
        let light = light.collect();
        let buffers = Arc::new(SceneBuffers::new(&scene, &patches, &facets));
        Self { name: name.into(), light, scene, patches, facets, buffers }
    }

    fn camera(&self) -> Camera {
        self.scene.camera.unwrap_or_else(|| shade::frame(&self.scene))
    }

    fn renderer(&self, values: &Values) -> Renderer {
        let values = Some(uploads(&self.buffers, values));
        let mut renderer = Renderer::default();
        renderer.pending = Pending { scene: Some(Arc::clone(&self.buffers)), values };
        renderer
    }

    fn lit(&self) -> Renderer {
        self.renderer(&Values::Colour(self.light.clone()))
    }

    fn engine(&self, camera: &Camera, look: &Look, [width, height]: [i32; 2]) -> Vec<[u8; 3]> {
        let surfaces =
            ShadedSurfaces::new(&self.scene, &self.patches, &self.facets, &self.light, look.shading);
        let back_faces =
            if look.back_faces == BackFaceStyle::Black { BackFaces::Black } else { BackFaces::Lit };
        let request = PictureRequest {
            width: width as usize,
            height: height as usize,
            back_faces,
            ..Default::default()
        };
        let tone = ToneMap { exposure: f64::from(look.exposure), curve: look.tone };
        screen_picture(&surfaces, camera, &request, tone).unwrap().pixels
    }
}

fn frame_of(camera: Camera, look: &Look) -> Frame {
    Frame { camera, look: *look, pixels_per_point: 1.0, draft: false }
}

/// The mean difference of two pictures, in levels of 255.
fn mean_difference(one: &[[u8; 3]], other: &[[u8; 3]]) -> f64 {
    assert_eq!(one.len(), other.len());
    let sum: u64 =
        one.iter().flatten().zip(other.iter().flatten()).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    sum as f64 / (3 * one.len()) as f64
}

/// Leave a picture for the eye, where that was asked for.
fn keep(name: &str, pixels: &[[u8; 3]], [width, height]: [i32; 2]) {
    let Some(folder) = std::env::var_os("RADIOSITY_VIEW_PICTURES") else { return };
    std::fs::create_dir_all(&folder).unwrap();
    let file = std::fs::File::create(Path::new(&folder).join(format!("{name}.png"))).unwrap();
    let mut encoder = png::Encoder::new(std::io::BufWriter::new(file), width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header().unwrap().write_image_data(pixels.as_flattened()).unwrap();
}

/// Compare, and say by how much the two differ.
fn compare(
    offscreen: &Offscreen,
    case: &Case,
    camera: Camera,
    look: &Look,
    size: [i32; 2],
    name: &str,
) -> f64 {
    let mut renderer = case.lit();
    let shown = offscreen.paint(&mut renderer, &frame_of(camera, look), size);
    renderer.destroy(&offscreen.gl);
    let wanted = case.engine(&camera, look, size);
    let difference = mean_difference(&shown, &wanted);
    println!("{:9} {name:28} {:4}x{:<4} {difference:.3}", case.name, size[0], size[1]);
    keep(&format!("{}-{name}-view", case.name), &shown, size);
    keep(&format!("{}-{name}-engine", case.name), &wanted, size);
    let black = wanted.iter().filter(|pixel| **pixel == [0; 3]).count();
    assert!(black < wanted.len() * 19 / 20, "{}: there is something to compare", case.name);
    difference
}

const SCENES: [&str; 6] = ["cornell", "office", "radio2", "radio5", "radio6", "two_plates"];

#[test]
fn the_view_is_the_engines_picture() {
    for embedded in [false, true] {
        let Some(offscreen) = offscreen(embedded) else { return };
        println!("{:?}", offscreen.gl.version());
        for name in SCENES {
            let case = Case::new(name, 1.0);
            for shading in [Shading::Smooth, Shading::Flat] {
                let look = Look { shading, exposure: -0.5, ..Look::default() };
                let name = format!("{shading:?}{}", if embedded { "-es" } else { "" });
                let difference = compare(&offscreen, &case, case.camera(), &look, [400, 300], &name);
                assert!(difference < 0.5, "{difference}");
            }
        }
    }
}

#[test]
fn every_curve_and_exposure_is_the_engines() {
    let Some(offscreen) = offscreen(false) else { return };
    let case = Case::new("radio6", 1.0);
    for tone in ToneCurve::ALL {
        for exposure in [-3.0, 0.0, 2.5] {
            let look = Look { tone, exposure, ..Look::default() };
            let name = format!("{}-{exposure}", tone.name());
            let difference = compare(&offscreen, &case, case.camera(), &look, [320, 240], &name);
            assert!(difference < 0.5, "{difference}");
        }
    }
}

#[test]
fn every_window_and_camera_is_the_engines() {
    let Some(offscreen) = offscreen(false) else { return };
    let case = Case::new("radio4", 1.0);
    let author = case.camera();
    assert!(author.vertical[0] != -author.vertical[1], "an off-axis window, as its author wrote it");
    let mut control = CameraControl::new(author, case.buffers.bounds);
    control.orbit(0.3, -0.2);
    control.zoom(None, author.forward, 0.7);
    let turned = *control.camera();
    let far_off = Camera { horizontal: [0.1, 0.7], vertical: [-0.6, -0.2], ..author };
    let mirrored = Camera { horizontal: [author.horizontal[1], author.horizontal[0]], ..author };
    let part = Camera { viewport: [0.1, 0.75, 0.25, 0.9], ..author };
    let cut = Camera { near: author.near + 2.0, far: author.near + 3.5, ..author };
    let cameras =
        [("author", author), ("turned", turned), ("off", far_off), ("mirrored", mirrored), ("part", part)];
    for (name, camera) in cameras.into_iter().chain([("cut", cut)]) {
        for size in [[400, 300], [500, 120], [120, 300], [37, 41]] {
            for back_faces in [BackFaceStyle::Lit, BackFaceStyle::Black] {
                let look = Look { back_faces, ..Look::default() };
                let name = format!("{name}-{back_faces:?}-{}", size[0]);
                let difference = compare(&offscreen, &case, camera, &look, size, &name);
                // Edges are a larger share of a small picture.
                let bound = if size[0] < 50 { 2.0 } else { 0.6 };
                assert!(difference < bound, "{difference}");
            }
        }
    }
}

/// A scene a million of its own sizes from the origin is as still as it is there.
#[test]
fn far_from_the_origin_nothing_shakes() {
    let Some(offscreen) = offscreen(false) else { return };
    let near = Case::new("cornell", 1.0);
    let shift = DVec3::new(3e8, -2e8, 1e8);
    let mut scene = near.scene.clone();
    for surface in &mut scene.surfaces {
        match &mut surface.shape {
            scene::Shape::Parallelogram(p) => p.origin += shift,
            scene::Shape::Polygon(p) => p.vertices.iter_mut().for_each(|v| *v += shift),
            scene::Shape::Quadrilateral(q) => q.corners.iter_mut().for_each(|v| *v += shift),
            scene::Shape::Sphere(c) | scene::Shape::Cylinder(c) => c.map.translation += shift,
            scene::Shape::Mesh(m) | scene::Shape::Fractal(m) => {
                m.vertices.iter_mut().for_each(|v| *v += shift);
            }
        }
    }
    let camera = Camera { eye: near.camera().eye + shift, ..near.camera() };
    let far = Case { light: near.light.clone(), ..Case::of("far", scene, 1.0) };
    let look = Look::default();
    let difference = compare(&offscreen, &far, camera, &look, [300, 300], "away");
    assert!(difference < 0.5, "{difference}");
    let shown = |case: &Case, camera| offscreen.paint(&mut case.lit(), &frame_of(camera, &look), [300, 300]);
    assert!(mean_difference(&shown(&near, near.camera()), &shown(&far, camera)) < 0.05);
}

#[test]
fn scalars_go_through_the_colour_map() {
    let Some(offscreen) = offscreen(false) else { return };
    let case = Case::new("radio5", 1.0);
    let size = [320, 240];
    let values: Vec<f32> = case.light.iter().map(|light| light.luminance() as f32).collect();
    let grey: Vec<Rgb> = values.iter().map(|&value| Rgb::grey(f64::from(value))).collect();
    let surfaces = ShadedSurfaces::new(&case.scene, &case.patches, &case.facets, &grey, Shading::Smooth);
    let camera = case.camera();
    let (_, view) = fit(&camera, 320, 240).unwrap().unwrap();
    let picker = Picker::new(Arc::new(case.facets.clone()));
    for colour_map in ColourMap::ALL {
        for (range, logarithmic) in [([0.1, 1.5], false), ([0.02, 3.0], true)] {
            let look = Look { colour_map, ..Look::default() };
            let shown = Values::Scalar { values: values.clone(), range, logarithmic };
            let shown = offscreen.paint(&mut case.renderer(&shown), &frame_of(camera, &look), size);
            keep(&format!("scalar-{}-{logarithmic}", colour_map.name()), &shown, size);
            let (mut sum, mut count) = (0.0, 0);
            for y in (0..240).step_by(3) {
                for x in (0..320).step_by(3) {
                    let Some(pick) = picker.pick(&view, x as f64, y as f64, false) else { continue };
                    let facet = case.facets.of_surface(pick.surface).find(|&facet| {
                        let (u, v) = case.facets[facet].uv(pick.point);
                        case.facets[facet].patch_at(u, v) == pick.patch && (u - pick.u).abs() < 1e-9
                    });
                    let value = surfaces.at(facet.unwrap(), pick.u, pick.v).r as f32;
                    let [low, high] = range;
                    let t = if logarithmic {
                        (value / low).ln() / (high / low).ln()
                    } else {
                        (value - low) / (high - low)
                    };
                    let wanted = colour_map.rgb(t);
                    let got = shown[y * 320 + x];
                    sum +=
                        f64::from(wanted.iter().zip(got).map(|(a, b)| u32::from(a.abs_diff(b))).sum::<u32>());
                    count += 3;
                }
            }
            let difference = sum / f64::from(count);
            println!("{colour_map:?} logarithmic: {logarithmic}: {difference:.3}");
            assert!(count > 5000 && difference < 1.0);
        }
    }
}

/// What a picture shows, in a few numbers.
fn share(pixels: &[[u8; 3]], wanted: impl Fn([f32; 3]) -> bool) -> f64 {
    let found = pixels.iter().filter(|pixel| wanted(pixel.map(f32::from))).count();
    found as f64 / pixels.len() as f64
}

#[test]
fn overlays_show_what_they_are_for() {
    let Some(offscreen) = offscreen(false) else { return };
    for name in ["cornell", "radio6", "office"] {
        let case = Case::new(name, 1.0);
        let camera = case.camera();
        let size = [800, 600];
        let mut renderer = case.lit();
        let mut shown = |name: &str, look: Look| {
            let pixels = offscreen.paint(&mut renderer, &frame_of(camera, &look), size);
            keep(&format!("{}-look-{name}", case.name), &pixels, size);
            pixels
        };
        let plain = Look { exposure: -0.5, ..Look::default() };
        let bare = shown("plain", plain);
        let flat = shown("flat", Look { shading: Shading::Flat, ..plain });
        let edges = shown("edges", Look { edges: true, shading: Shading::Flat, ..plain });
        assert!((0.3..20.0).contains(&mean_difference(&flat, &edges)));
        let wires = shown("wireframe", Look { wireframe: true, ..plain });
        let drawn = share(&wires, |pixel| pixel != [0.0; 3]);
        assert!((0.02..0.7).contains(&drawn), "{drawn}");
        shown("wireframe-light", Look { wireframe: true, background: [0.95; 3], ..plain });
        let normals = shown("normals", Look { normals: true, ..plain });
        assert!(mean_difference(&bare, &normals) > 0.3);
        let marked = shown("marked", Look { back_faces: BackFaceStyle::Marked, ..plain });
        let culled = shown("culled", Look { back_faces: BackFaceStyle::Culled, ..plain });
        // These scenes have no surface that is inside out: hardly a back is seen.
        println!("{name}: {} {}", mean_difference(&bare, &marked), mean_difference(&bare, &culled));

        // The patch in the middle, outlined: orange, and nowhere else.
        let (_, view) = fit(&camera, 800, 600).unwrap().unwrap();
        let picker = Picker::new(Arc::new(case.facets.clone()));
        let pick = picker.pick(&view, 400.0, 400.0, false).unwrap();
        let selected = shown("selected", Look { selected: Some(pick.patch), ..plain });
        let orange = |[r, g, b]: [f32; 3]| (r - 255.0).abs() < 2.0 && (g - 160.0).abs() < 12.0 && b < 30.0;
        let outlined = share(&selected, orange);
        assert!(outlined > 3e-5 && outlined < 0.1, "{outlined}");

        // An unlit scene with edges can be walked through.
        let black = vec![Rgb::BLACK; case.patches.len()];
        let mut unlit = case.renderer(&Values::Colour(black));
        let look = Look { edges: true, ..plain };
        let pixels = offscreen.paint(&mut unlit, &frame_of(camera, &look), size);
        keep(&format!("{name}-look-unlit"), &pixels, size);
        assert!(share(&pixels, |pixel| pixel[2] > 30.0) > 0.01);

        // No values, too few values, and values that are no numbers show something as well.
        let mut none = case.renderer(&Values::Colour(Vec::new()));
        let pixels = offscreen.paint(&mut none, &frame_of(camera, &look), size);
        keep(&format!("{name}-look-none"), &pixels, size);
        assert!(share(&pixels, |pixel| pixel[0] > 40.0) > 0.2);
        let mut unknown = vec![Rgb::grey(f64::NAN); case.patches.len()];
        unknown[..case.patches.len() / 2].copy_from_slice(&case.light[..case.patches.len() / 2]);
        let mut unknown = case.renderer(&Values::Colour(unknown));
        let pixels = offscreen.paint(&mut unknown, &frame_of(camera, &plain), size);
        keep(&format!("{name}-look-half"), &pixels, size);
    }
}

/// Shaders are put together when they are wanted: none may be wanted in vain.
#[test]
fn every_shader_is_accepted() {
    for embedded in [false, true] {
        let Some(offscreen) = offscreen(embedded) else { return };
        let case = Case::new("radio6", 0.5);
        let mut holes = case.light.clone();
        holes[7] = Rgb::grey(f64::NAN);
        let scalar = |holes: bool, logarithmic| Values::Scalar {
            values: (0..case.patches.len())
                .map(|i| if holes && i == 7 { f32::NAN } else { i as f32 })
                .collect(),
            range: [0.0, 100.0],
            logarithmic,
        };
        let contents = [
            Values::Colour(Vec::new()),
            Values::Colour(case.light.clone()),
            Values::Colour(holes),
            scalar(false, false),
            scalar(true, true),
        ];
        for values in &contents {
            let mut renderer = case.renderer(values);
            let plain = Look::default();
            let backs = BackFaceStyle::ALL.map(|back_faces| Look { back_faces, ..plain });
            let overlays = [
                Look { shading: Shading::Flat, ..plain },
                Look { edges: true, normals: true, ..plain },
                Look { wireframe: true, ..plain },
                Look { selected: Some(3), shading: Shading::Flat, ..plain },
                Look { edges: true, wireframe: true, selected: Some(3), ..plain },
            ];
            for look in backs.iter().chain(&overlays) {
                offscreen.paint(&mut renderer, &frame_of(case.camera(), look), [16, 12]);
            }
            renderer.destroy(&offscreen.gl);
        }
    }
}

#[test]
fn any_size_and_any_order_of_calls() {
    let Some(offscreen) = offscreen(false) else { return };
    let case = Case::new("cornell", 1.0);
    let mut renderer = case.lit();
    let look = Look::default();
    for size in [[1, 1], [2, 300], [300, 2], [64, 64], [1, 1], [640, 480]] {
        let frame = frame_of(case.camera(), &look);
        let first = offscreen.paint(&mut renderer, &frame, size);
        let again = offscreen.paint(&mut renderer, &frame, size);
        assert_eq!(first, again);
        // A draft is the same picture, its edges apart.
        let draft = offscreen.paint(&mut renderer, &Frame { draft: true, ..frame.clone() }, size);
        if size == [640, 480] {
            assert!((0.001..1.0).contains(&mean_difference(&first, &draft)));
        }
        assert_eq!(first, offscreen.paint(&mut renderer, &frame, size));
    }
    // Nothing to draw, nowhere to draw, and back again after everything was deleted.
    renderer.paint(
        &offscreen.gl,
        &frame_of(case.camera(), &look),
        Viewport { left: 0, bottom: 0, width: 0, height: 9 },
    );
    renderer.destroy(&offscreen.gl);
    let empty = offscreen.paint(&mut renderer, &frame_of(case.camera(), &look), [30, 20]);
    assert!(empty.iter().all(|pixel| *pixel == [0; 3]));
    let nothing = Case::of("nothing", Scene { surfaces: Vec::new(), ..case.scene.clone() }, 1.0);
    let look = Look { background: [0.2, 0.4, 0.6], normals: true, edges: true, ..look };
    let pixels = offscreen.paint(&mut nothing.lit(), &frame_of(case.camera(), &look), [30, 20]);
    assert!(pixels.iter().all(|pixel| *pixel == [51, 102, 153]), "{:?}", pixels[0]);
    let broken = Camera { horizontal: [0.0, 0.0], ..case.camera() };
    offscreen.paint(&mut case.lit(), &frame_of(broken, &look), [30, 20]);
}

/// `cargo test -p radiosity-viewer -- --ignored --nocapture frame_time`. Reading the picture back counts as well: "nothing
/// new" is that alone.
#[test]
#[ignore = "measures, and says nothing about right or wrong"]
fn frame_time() {
    let Some(offscreen) = offscreen(false) else { return };
    // SAFETY: a query.
    println!("{}", unsafe { offscreen.gl.get_parameter_string(glow::RENDERER) });
    for (name, subdivision) in [("cornell", 1.0), ("radio6", 4.0), ("office", 3.4)] {
        let case = Case::new(name, subdivision);
        let size = [1000, 700];
        let values = Values::Colour(case.light.clone());
        let mut renderer = case.renderer(&values);
        let mut control = CameraControl::new(case.camera(), case.buffers.bounds);
        let plain = Look::default();
        for (what, look, upload, draft) in [
            ("smooth", plain, false, true),
            ("smooth, new values", plain, true, true),
            ("flat", Look { shading: Shading::Flat, ..plain }, false, true),
            ("edges", Look { edges: true, ..plain }, false, true),
            ("smooth, at rest", plain, false, false),
            ("nothing new", plain, false, false),
        ] {
            let mut times: Vec<f64> = (0..30)
                .map(|_| {
                    if what != "nothing new" {
                        control.look_around(0.002, 0.001);
                    }
                    let started = std::time::Instant::now();
                    if upload {
                        renderer.pending.values = Some(uploads(&case.buffers, &values));
                    }
                    let frame = Frame { draft, ..frame_of(*control.camera(), &look) };
                    offscreen.paint(&mut renderer, &frame, size);
                    started.elapsed().as_secs_f64() * 1e3
                })
                .collect();
            times.sort_by(f64::total_cmp);
            println!(
                "{name:8} {:6} patches, {what:18}: median {:5.1} ms, {:.1} to {:.1}",
                case.patches.len(),
                times[15],
                times[1],
                times[28]
            );
        }
    }
}
