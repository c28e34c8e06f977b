//! Draws the scene: into a picture of its own, with depth and several samples a pixel, then onto the window.
//!
//! The picture is drawn again only when something about it has changed; a window that is repainted because the pointer
//! moves over a panel costs one copy.
#![allow(
    unsafe_code,
    reason = "setting OpenGL's state is an unsafe function in glow; none is handed a pointer here"
)]

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;

use eframe::glow::{self, HasContext as _};
use radiosity::scene::Camera;
use radiosity::shade::{Shading, ToneCurve, fit, linear_from_srgb};

use super::colour_map::ColourMap;
use super::gl_objects::{Abilities, Attributes, Program, Target, TexelKind, TexelList, Vertices};
use super::projection::Projection;
use super::scene_buffers::{SceneBuffers, Texel};
use super::{BackFaceStyle, Look};

const SRGB: &str = include_str!("shaders/srgb.glsl");
const SURFACE_ATTRIBUTES: Attributes = &[(TexelKind::Float, 3), (TexelKind::Uint, 1)];
const NORMAL_ATTRIBUTES: Attributes = &[(TexelKind::Float, 4)];

/// What the shown values are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Content {
    /// There are none: shapes alone.
    None,
    Colour {
        /// Some of them are no numbers.
        holes: bool,
    },
    Scalar {
        /// Likewise.
        holes: bool,
        range: [f32; 2],
        logarithmic: bool,
    },
}

/// What a program for surfaces is compiled for: the names that its source looks for.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
struct Variant(Vec<&'static str>);

impl Variant {
    fn new(content: Content, look: &Look, encode: bool) -> Self {
        let shown = match content {
            Content::None => "CONTENT_NONE",
            Content::Colour { .. } => "CONTENT_COLOUR",
            Content::Scalar { .. } => "CONTENT_SCALAR",
        };
        let tone = match look.tone {
            ToneCurve::Neutral => "TONE_NEUTRAL",
            ToneCurve::Reinhard => "TONE_REINHARD",
            ToneCurve::Linear => "TONE_LINEAR",
        };
        let back = match look.back_faces {
            BackFaceStyle::Lit | BackFaceStyle::Culled => "BACK_LIT",
            BackFaceStyle::Black => "BACK_BLACK",
            BackFaceStyle::Marked => "BACK_MARKED",
        };
        let switches = [
            ("SMOOTH", look.shading == Shading::Smooth),
            ("LOGARITHMIC", matches!(content, Content::Scalar { logarithmic: true, .. })),
            (
                "HOLES",
                matches!(content, Content::Colour { holes: true } | Content::Scalar { holes: true, .. }),
            ),
            ("EDGES", look.edges),
            ("WIREFRAME", look.wireframe),
            ("SELECTED", look.selected.is_some()),
            ("ENCODE", encode),
        ];
        let switches = switches.into_iter().filter(|(_, on)| *on).map(|(name, _)| name);
        Self([shown, tone, back].into_iter().chain(switches).collect())
    }

    fn of_grids(mut self) -> Self {
        self.0.push("GRIDS");
        self
    }

    fn definitions(&self) -> String {
        self.0.iter().map(|name| format!("#define {name}\n")).collect()
    }
}

/// A picture that is wanted.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Frame {
    pub(super) camera: Camera,
    pub(super) look: Look,
    pub(super) pixels_per_point: f32,
    /// Drawn on the way to another one: quickly, where the processor draws.
    pub(super) draft: bool,
}

/// Where on the window, in pixels from its lower left corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Viewport {
    pub(super) left: i32,
    pub(super) bottom: i32,
    pub(super) width: i32,
    pub(super) height: i32,
}

/// What is yet to be handed to the GPU.
#[derive(Debug, Default)]
pub(super) struct Pending {
    pub(super) scene: Option<Arc<SceneBuffers>>,
    pub(super) values: Option<(Content, [Vec<Texel>; 2])>,
}

/// All that lives on the GPU, and what still has to get there.
#[derive(Debug, Default)]
pub(super) struct Renderer {
    pub(super) pending: Pending,
    gpu: Option<Gpu>,
    /// Why nothing can be drawn. What the driver could not do once it is not asked again, until there is another scene.
    error: Option<String>,
}

#[derive(Debug)]
struct Gpu {
    abilities: Abilities,
    /// Made when they are first wanted.
    surfaces: HashMap<Variant, Program>,
    normals: Program,
    screen: Program,
    patch_values: TexelList,
    corner_values: TexelList,
    facets: TexelList,
    colour_map: TexelList,
    map_shown: Option<ColourMap>,
    /// What the screen's one triangle is drawn with: core profiles want an array, if an empty one.
    nothing: Vertices,
    target: Option<Target>,
    /// What drafts are drawn to.
    draft: Option<Target>,
    scene: Option<SceneOnGpu>,
    content: Content,
    /// What the target holds.
    drawn: Option<Frame>,
}

#[derive(Debug)]
struct SceneOnGpu {
    buffers: Arc<SceneBuffers>,
    grids: Vertices,
    triangles: Vertices,
    /// Made when they are first wanted.
    normals: Option<Vertices>,
}

impl Renderer {
    /// Why nothing can be drawn.
    pub(super) fn error(&self) -> Option<&str> {
        self.error.as_deref()
    }

    /// Whether the processor draws, for want of a graphics card, as far as is known.
    pub(super) fn is_software(&self) -> bool {
        self.gpu.as_ref().is_some_and(|gpu| gpu.abilities.is_software())
    }

    /// Put the picture that `frame` asks for on the framebuffer that is bound, at `viewport`, within whatever scissor is
    /// set. The state that egui does not set anew by itself is left as it was found.
    pub(super) fn paint(&mut self, gl: &glow::Context, frame: &Frame, viewport: Viewport) {
        if self.pending.scene.is_some() {
            self.error = None;
        }
        if self.error.is_some() || viewport.width <= 0 || viewport.height <= 0 {
            return;
        }
        // SAFETY: queries and settings of state that GL 3.0 and ES 3.0 have.
        let window = unsafe { gl.get_parameter_framebuffer(glow::DRAW_FRAMEBUFFER_BINDING) };
        let painted = self.prepare(gl).and_then(|gpu| gpu.draw(gl, frame, viewport));
        // SAFETY: as above; the framebuffer is the one that was bound.
        unsafe {
            gl.bind_framebuffer(glow::FRAMEBUFFER, window);
            gl.enable(glow::SCISSOR_TEST);
            gl.disable(glow::DEPTH_TEST);
            gl.disable(glow::BLEND);
            gl.viewport(viewport.left, viewport.bottom, viewport.width, viewport.height);
        }
        match (painted, &self.gpu) {
            (Ok(()), Some(gpu)) => gpu.show(gl, viewport),
            (Err(message), _) => self.error = Some(message),
            (Ok(()), None) => {}
        }
    }

    /// The GPU's side, with all that was pending handed over.
    fn prepare(&mut self, gl: &glow::Context) -> Result<&mut Gpu, String> {
        let gpu = match &mut self.gpu {
            Some(gpu) => gpu,
            none => none.insert(Gpu::new(gl)?),
        };
        if let Some(buffers) = self.pending.scene.take() {
            gpu.set_scene(gl, buffers)?;
        }
        if let Some((content, [patches, corners])) = self.pending.values.take() {
            gpu.drawn = None;
            gpu.content = content;
            if content != Content::None {
                gpu.patch_values.upload(gl, &gpu.abilities, &patches)?;
                gpu.corner_values.upload(gl, &gpu.abilities, &corners)?;
            }
        }
        Ok(gpu)
    }

    /// Delete everything.
    pub(super) fn destroy(&mut self, gl: &glow::Context) {
        if let Some(gpu) = self.gpu.take() {
            gpu.delete(gl);
        }
    }
}

impl Gpu {
    fn new(gl: &glow::Context) -> Result<Self, String> {
        let abilities = Abilities::of(gl)?;
        let program = |vertex: &str, fragment: &str| {
            Program::new(gl, &abilities, "", [vertex, &format!("{SRGB}{fragment}")])
        };
        let nothing = [[0.0_f32; 4]; 3];
        Ok(Self {
            surfaces: HashMap::new(),
            normals: program(include_str!("shaders/normals.vert"), include_str!("shaders/normals.frag"))?,
            screen: program(include_str!("shaders/screen.vert"), include_str!("shaders/screen.frag"))?,
            patch_values: TexelList::new(gl, TexelKind::Float)?,
            corner_values: TexelList::new(gl, TexelKind::Float)?,
            facets: TexelList::new(gl, TexelKind::Uint)?,
            colour_map: TexelList::new(gl, TexelKind::Float)?,
            map_shown: None,
            nothing: Vertices::new(gl, &nothing, &[])?,
            target: None,
            draft: None,
            scene: None,
            content: Content::None,
            drawn: None,
            abilities,
        })
    }

    fn set_scene(&mut self, gl: &glow::Context, buffers: Arc<SceneBuffers>) -> Result<(), String> {
        self.drawn = None;
        self.content = Content::None;
        if let Some(old) = self.scene.take() {
            old.delete(gl);
        }
        self.facets.upload(gl, &self.abilities, &buffers.facets)?;
        let grids = Vertices::new(gl, &buffers.grids, SURFACE_ATTRIBUTES)?;
        match Vertices::new(gl, &buffers.triangles, SURFACE_ATTRIBUTES) {
            Ok(triangles) => self.scene = Some(SceneOnGpu { buffers, grids, triangles, normals: None }),
            Err(message) => {
                grids.delete(gl);
                return Err(message);
            }
        }
        Ok(())
    }

    /// Draw the picture, unless it is there already.
    fn draw(&mut self, gl: &glow::Context, frame: &Frame, viewport: Viewport) -> Result<(), String> {
        let size = [viewport.width, viewport.height].map(|side| side.min(self.abilities.max_side()));
        let draft = frame.draft && self.abilities.is_software();
        for target in [&mut self.target, &mut self.draft] {
            if let Some(old) = target.take_if(|target| target.size() != size) {
                old.delete(gl);
                self.drawn = None;
            }
        }
        if self.drawn.as_ref() == Some(frame) {
            return Ok(());
        }
        self.drawn = None;
        let target = match if draft { &mut self.draft } else { &mut self.target } {
            Some(target) => target,
            none => none.insert(Target::new(gl, &self.abilities, size, draft)?),
        };
        target.bind(gl);
        let look = &frame.look;
        let to_target = |colour: f32| if target.is_linear() { linear_from_srgb(colour) } else { colour };
        let [r, g, b] = look.background.map(|value| to_target(value.clamp(0.0, 1.0)));
        // SAFETY: settings of state that GL 3.0 and ES 3.0 have. Depth is cleared with depth writing on.
        unsafe {
            gl.disable(glow::SCISSOR_TEST);
            gl.disable(glow::BLEND);
            gl.color_mask(true, true, true, true);
            gl.depth_mask(true);
            gl.viewport(0, 0, size[0], size[1]);
            gl.clear_color(r, g, b, 1.0);
            gl.clear_depth_f32(1.0);
            gl.clear(glow::COLOR_BUFFER_BIT | glow::DEPTH_BUFFER_BIT);
        }
        let area = fit(&frame.camera, size[0] as usize, size[1] as usize);
        if let (Some(scene), Ok(Some((area, view)))) = (&mut self.scene, area) {
            let projection = Projection::new(&view, &scene.buffers.bounds);
            let wireframe = look.wireframe;
            // SAFETY: as above. Of two facets equally near the first stays, as in the engine's item buffer.
            unsafe {
                let bottom = size[1] - area.bottom as i32;
                gl.viewport(area.left as i32, bottom, area.width() as i32, area.height() as i32);
                gl.enable(glow::DEPTH_TEST);
                gl.depth_func(glow::LESS);
                gl.front_face(if projection.mirrored { glow::CW } else { glow::CCW });
                if look.back_faces == BackFaceStyle::Culled {
                    gl.enable(glow::CULL_FACE);
                    gl.cull_face(glow::BACK);
                }
                if wireframe && target.is_multisampled() {
                    gl.enable(glow::SAMPLE_ALPHA_TO_COVERAGE);
                }
            }
            if self.map_shown != Some(look.colour_map) {
                let colours: Vec<Texel> = (0..256_u16)
                    .map(|k| {
                        let [r, g, b] = look.colour_map.rgb(f32::from(k) / 255.0);
                        let [r, g, b] = [r, g, b].map(|value| linear_from_srgb(f32::from(value) / 255.0));
                        [r, g, b, 1.0]
                    })
                    .collect();
                self.colour_map.upload(gl, &self.abilities, &colours)?;
                self.map_shown = Some(look.colour_map);
            }
            let lists = [&self.facets, &self.patch_values, &self.corner_values, &self.colour_map];
            lists.into_iter().zip(0..).for_each(|(list, unit)| list.bind(gl, unit));
            let range = match self.content {
                Content::Scalar { range, logarithmic, .. } => ends(range, logarithmic),
                Content::None | Content::Colour { .. } => [0.0, 1.0],
            };
            let from_centre = (view.eye - scene.buffers.bounds.centre()).as_vec3().to_array();
            let luminance = 0.2126 * r + 0.7152 * g + 0.0722 * b;
            let variant = Variant::new(self.content, look, !target.is_linear());
            for (variant, vertices) in
                [(variant.clone().of_grids(), &scene.grids), (variant, &scene.triangles)]
            {
                if vertices.is_empty() {
                    continue;
                }
                let program = match self.surfaces.entry(variant) {
                    Entry::Occupied(made) => made.into_mut(),
                    Entry::Vacant(wanted) => {
                        let fragment = format!("{SRGB}{}", include_str!("shaders/surfaces.frag"));
                        let sources = [include_str!("shaders/surfaces.vert"), &fragment];
                        let definitions = wanted.key().definitions();
                        wanted.insert(Program::new(gl, &self.abilities, &definitions, sources)?)
                    }
                };
                program
                    .bind(gl)
                    .matrix("clip_from_scene", &projection.clip_from_scene)
                    .int("facets", 0)
                    .int("patch_values", 1)
                    .int("corner_values", 2)
                    .int("colour_map", 3)
                    .float("exposure", look.exposure.exp2().min(f32::MAX))
                    .pair("range", range)
                    .triple(
                        "wire_colour",
                        if luminance < 0.2 { [0.70, 0.74, 0.80] } else { [0.02, 0.03, 0.05] },
                    )
                    .float("pixels_per_point", frame.pixels_per_point)
                    .uint("selected", look.selected.unwrap_or(u32::MAX))
                    .triple("eye", from_centre);
                if !scene.buffers.sheets || look.back_faces == BackFaceStyle::Culled {
                    vertices.draw(gl, glow::TRIANGLES);
                    continue;
                }
                // Of the two sides of a sheet the one that faces the eye is seen: backs are drawn a hair farther away.
                for (hidden, offset) in [(glow::BACK, 0.0), (glow::FRONT, 1.0)] {
                    // SAFETY: state of this context, set back below.
                    unsafe {
                        gl.enable(glow::CULL_FACE);
                        gl.cull_face(hidden);
                        gl.enable(glow::POLYGON_OFFSET_FILL);
                        gl.polygon_offset(offset, 2.0 * offset);
                    }
                    vertices.draw(gl, glow::TRIANGLES);
                }
            }
            // SAFETY: as above.
            unsafe {
                gl.disable(glow::POLYGON_OFFSET_FILL);
                gl.disable(glow::SAMPLE_ALPHA_TO_COVERAGE);
                gl.disable(glow::CULL_FACE);
                gl.front_face(glow::CCW);
            }
            if look.normals {
                let lines = match &mut scene.normals {
                    Some(lines) => lines,
                    none => none.insert(Vertices::new(gl, &scene.buffers.normals, NORMAL_ATTRIBUTES)?),
                };
                self.normals
                    .bind(gl)
                    .matrix("clip_from_scene", &projection.clip_from_scene)
                    .flag("encode", !target.is_linear());
                lines.draw(gl, glow::LINES);
            }
        }
        target.resolve(gl);
        self.drawn = Some(frame.clone());
        Ok(())
    }

    /// Copy the picture to the framebuffer that is bound.
    fn show(&self, gl: &glow::Context, viewport: Viewport) {
        let draft = self.drawn.as_ref().is_some_and(|frame| frame.draft) && self.abilities.is_software();
        let Some(target) = (if draft { &self.draft } else { &self.target }) else { return };
        target.bind_texture(gl);
        self.screen
            .bind(gl)
            .int("picture", 0)
            .int_pair("corner", [viewport.left, viewport.bottom])
            .flag("encode", target.is_linear());
        self.nothing.draw(gl, glow::TRIANGLES);
        // SAFETY: unbinding.
        unsafe { gl.bind_texture(glow::TEXTURE_2D, None) };
    }

    fn delete(self, gl: &glow::Context) {
        for program in self.surfaces.into_values().chain([self.normals, self.screen]) {
            program.delete(gl);
        }
        for list in [self.patch_values, self.corner_values, self.facets, self.colour_map] {
            list.delete(gl);
        }
        self.nothing.delete(gl);
        self.target.into_iter().chain(self.draft).for_each(|target| target.delete(gl));
        self.scene.into_iter().for_each(|scene| scene.delete(gl));
    }
}

impl SceneOnGpu {
    fn delete(self, gl: &glow::Context) {
        self.grids.delete(gl);
        self.triangles.delete(gl);
        self.normals.into_iter().for_each(|normals| normals.delete(gl));
    }
}

/// The ends of the colour map as the shader wants them: apart, and their logarithms where those are spread evenly.
fn ends([low, high]: [f32; 2], logarithmic: bool) -> [f32; 2] {
    let [low, high] = if logarithmic {
        let high = if high > 0.0 { high } else { 1.0 };
        // A scale that is asked to begin at nothing begins six decades below its end.
        let low = if low > 0.0 { low } else { high * 1e-6 };
        [low.ln(), high.ln()]
    } else {
        [low, high]
    };
    // All one value: it is the middle of the map.
    if low == high { [low - 0.5, high + 0.5] } else { [low, high] }
}
