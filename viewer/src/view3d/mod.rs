//! The scene, drawn by the GPU into an egui panel, and the camera that the mouse and the keys move through it.
//!
//! What is shown is what [`radiosity::shade::screen_picture`] takes from the same camera: the fragment shader finds the
//! patch from (u, v) and shades as [`radiosity::shade::ShadedSurfaces`] does, so a parallelogram is two triangles
//! however finely it is cut, and new values are an upload of one texel a patch.
//!
//! ```text
//! mod.rs             input, picks, the panel          camera_control.rs  gestures to cameras
//! pick.rs            what lies under the pointer      projection.rs      a camera to clip space
//! scene_buffers.rs   a scene to vertices and texels   colour_map.rs      a number to a false colour
//! gl_renderer.rs     a frame                          gl_objects.rs      programs, textures, targets
//! ```

mod camera_control;
mod colour_map;
mod gl_objects;
mod gl_renderer;
// Apple has no EGL.
#[cfg(all(test, not(target_vendor = "apple")))]
mod offscreen;
mod pick;
mod projection;
mod scene_buffers;

use std::collections::HashSet;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use eframe::egui::{self, Key, PointerButton, Pos2, Rect, Sense};
use eframe::{egui_glow, glow};
use glam::DVec3;
use radiosity::patches::Patches;
use radiosity::scene::{Camera, Scene};
use radiosity::shade::{self, Shading, ToneCurve, fit};
use radiosity::visibility::{Facets, View};

use camera_control::CameraControl;
use gl_renderer::{Content, Frame, Renderer, Viewport};
use pick::Picker;
use projection::Bounds;
use scene_buffers::{SceneBuffers, Texel};

pub(crate) use colour_map::ColourMap;
pub(crate) use pick::Pick;
pub(crate) use scene_buffers::Values;

/// How far a notch of the wheel (50 points or so) goes: e^-(points · this) times the distance.
const WHEEL: f32 = 0.004;
/// How long nothing must move until a picture drawn by the processor is worth its antialiasing, which takes longer than
/// all the rest. \[s\]
const REST: f64 = 0.15;
/// Half a turn takes a drag across the whole height.
const TURN: f64 = std::f64::consts::PI;

/// How the scene is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Look {
    /// Smooth or flat.
    pub(crate) shading: Shading,
    /// Colours are multiplied by 2^exposure. [stops, EV]
    pub(crate) exposure: f32,
    /// What brings them into 0..1.
    pub(crate) tone: ToneCurve,
    /// What scalars are shown in.
    pub(crate) colour_map: ColourMap,
    /// Lines between patches.
    pub(crate) edges: bool,
    /// Nothing but those lines, and what is behind them.
    pub(crate) wireframe: bool,
    /// A short line from each patch's centre along its normal.
    pub(crate) normals: bool,
    /// What surfaces are from behind.
    pub(crate) back_faces: BackFaceStyle,
    /// A patch to outline.
    pub(crate) selected: Option<u32>,
    /// Where there is no surface: sRGB, each in 0..1.
    pub(crate) background: [f32; 3],
}

impl Default for Look {
    fn default() -> Self {
        Self {
            shading: Shading::default(),
            exposure: 0.0,
            tone: ToneCurve::default(),
            colour_map: ColourMap::default(),
            edges: false,
            wireframe: false,
            normals: false,
            back_faces: BackFaceStyle::default(),
            selected: None,
            background: [0.0; 3],
        }
    }
}

/// What a surface is when seen from behind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum BackFaceStyle {
    /// As lit as its front, which is N3D's way.
    #[default]
    Lit,
    /// Black.
    Black,
    /// In a checked warning colour: a surface that is inside out is found at once.
    Marked,
    /// Not drawn: one looks into a closed room through its walls.
    Culled,
}

impl BackFaceStyle {
    /// All of them, the default first.
    pub(crate) const ALL: [Self; 4] = [Self::Lit, Self::Black, Self::Marked, Self::Culled];
}

/// What the view has to say about this frame.
#[derive(Clone, Debug)]
pub(crate) struct ViewResponse {
    /// Of the view's whole area. A secondary click without a drag is the caller's.
    pub(crate) response: egui::Response,
    /// What is under the pointer.
    pub(crate) hovered: Option<Pick>,
    /// What was clicked on with the primary button.
    pub(crate) clicked: Option<Pick>,
}

/// The view.
#[derive(Debug)]
pub(crate) struct View3d {
    renderer: Arc<Mutex<Renderer>>,
    control: CameraControl,
    scene: Option<ShownScene>,
    /// The view's size in the last frame. \[pixels\]
    size: [usize; 2],
    gesture: Gesture,
    held: HashSet<Key>,
    /// Something was set since the last frame.
    changed: bool,
    /// The camera of the last frame.
    seen_from: Option<Camera>,
    /// When the picture last changed. \[s\]
    moved: f64,
}

#[derive(Debug)]
struct ShownScene {
    scene: Arc<Scene>,
    patches: Arc<Patches>,
    buffers: Arc<SceneBuffers>,
    picker: Picker,
}

/// What a drag does, decided when it begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Gesture {
    Orbit,
    Look,
    Pan,
}

impl Default for View3d {
    fn default() -> Self {
        Self::new()
    }
}

impl View3d {
    /// A view of nothing.
    pub(crate) fn new() -> Self {
        let nowhere = Camera {
            eye: DVec3::ZERO,
            forward: DVec3::NEG_Z,
            right: DVec3::X,
            up: DVec3::Y,
            horizontal: [-0.5, 0.5],
            vertical: [-0.375, 0.375],
            near: 0.0,
            far: f64::INFINITY,
            viewport: [0.0, 1.0, 0.0, 1.0],
        };
        Self {
            renderer: Arc::default(),
            control: CameraControl::new(nowhere, Bounds::around([])),
            scene: None,
            size: [4, 3],
            gesture: Gesture::Orbit,
            held: HashSet::new(),
            changed: false,
            seen_from: None,
            moved: f64::NEG_INFINITY,
        }
    }

    /// Show another scene, cut into `patches` and `facets`. Until it is given values its shapes are shown. The camera
    /// goes to the author's, or to one that frames the scene, unless it is to be kept.
    pub(crate) fn set_scene(
        &mut self,
        scene: Arc<Scene>,
        patches: Arc<Patches>,
        facets: Arc<Facets>,
        keep_camera: bool,
    ) {
        let buffers = Arc::new(SceneBuffers::new(&scene, &patches, &facets));
        let home = scene.camera.unwrap_or_else(|| shade::frame(&scene));
        if keep_camera && self.scene.is_some() {
            self.control.set_scene(home, buffers.bounds);
        } else {
            self.control = CameraControl::new(home, buffers.bounds);
        }
        {
            let mut renderer = self.renderer();
            renderer.pending.scene = Some(Arc::clone(&buffers));
            renderer.pending.values = None;
        }
        self.scene = Some(ShownScene { scene, patches, buffers, picker: Picker::new(facets) });
    }

    /// Show these values on the surfaces from now on. Where there is not one a patch, only shapes are shown.
    pub(crate) fn set_values(&mut self, values: Values) {
        let Some(scene) = &self.scene else { return };
        debug_assert!(scene.buffers.patch_count() == scene.patches.len());
        let pending = uploads(&scene.buffers, &values);
        self.renderer().pending.values = Some(pending);
        self.changed = true;
    }

    /// The camera that the view is seen through: a picture of the same size shows the same.
    pub(crate) fn camera(&self) -> Camera {
        *self.control.camera()
    }

    /// Look through `camera`, exactly, at once: a view that was kept, or read from a .vsn.
    #[allow(dead_code, reason = "the author's camera comes with the scene; this is for any other")]
    pub(crate) fn set_camera(&mut self, camera: &Camera) {
        self.control.jump(*camera);
    }

    /// Step back, or forward, until all is in view.
    pub(crate) fn frame_all(&mut self) {
        let aspect = self.size[0] as f64 / self.size[1] as f64;
        let framed = self.control.framing(&self.control.bounds().corners(), aspect);
        self.control.glide_to(framed);
    }

    /// Back to the scene's first view.
    pub(crate) fn reset(&mut self) {
        self.control.glide_to(*self.control.home());
    }

    /// The vertical angle of view of the camera's window. \[degrees\]
    pub(crate) fn field_of_view(&self) -> f64 {
        self.control.field_of_view().to_degrees()
    }

    /// Another vertical angle of view, about the line of sight: an off-axis window is let go. \[degrees\]
    pub(crate) fn set_field_of_view(&mut self, degrees: f64) {
        self.control.set_field_of_view(degrees.to_radians());
    }

    /// Delete what lives on the GPU; it is made anew should the view be shown again.
    pub(crate) fn destroy(&mut self, gl: &glow::Context) {
        self.renderer().destroy(gl);
        if let Some(scene) = &self.scene {
            let buffers = Arc::clone(&scene.buffers);
            self.renderer().pending.scene = Some(buffers);
        }
    }

    /// Fill what is left of `ui` with the view, and move the camera as the mouse and the keys say.
    pub(crate) fn show(&mut self, ui: &mut egui::Ui, look: &Look) -> ViewResponse {
        let rect = ui.available_rect_before_wrap();
        let response = ui.allocate_rect(rect, Sense::click_and_drag());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, ui.is_enabled(), "view3d"));
        let pixels_per_point = ui.ctx().pixels_per_point();
        self.size =
            [rect.width(), rect.height()].map(|side| (side * pixels_per_point).round().max(0.0) as usize);
        if self.size.contains(&0) {
            return ViewResponse { response, hovered: None, clicked: None };
        }

        let lens = Lens { rect, pixels_per_point };
        let culled = look.back_faces == BackFaceStyle::Culled;
        if self.scene.is_some() {
            self.handle_pointer(ui, &response, &lens, culled);
            self.handle_keys(ui, &response, look);
        }

        let hovered = response.hover_pos().filter(|_| !response.dragged());
        let hovered = hovered.and_then(|at| self.pick(&lens, at, culled));
        let clicked = response.interact_pointer_pos().filter(|_| response.clicked());
        let clicked = clicked.and_then(|at| self.pick(&lens, at, culled));

        self.paint(ui, rect, look, pixels_per_point);
        ViewResponse { response, hovered, clicked }
    }

    /// Whether the picture changes from frame to frame.
    fn is_moving(&mut self, ui: &egui::Ui) -> bool {
        let now = ui.input(|input| input.time);
        let camera = self.camera();
        let turned = self.seen_from.replace(camera).is_some_and(|before| before != camera);
        if std::mem::take(&mut self.changed) || turned {
            self.moved = now;
        }
        let moving = now - self.moved < REST;
        if moving && self.renderer().is_software() {
            ui.ctx().request_repaint_after(Duration::from_secs_f64(REST));
        }
        moving
    }

    fn paint(&mut self, ui: &mut egui::Ui, rect: Rect, look: &Look, pixels_per_point: f32) {
        let draft = self.is_moving(ui);
        let error = self.renderer().error().map(str::to_owned);
        let renderer = Arc::clone(&self.renderer);
        let frame = Frame { camera: self.camera(), look: *look, pixels_per_point, draft };
        let callback = egui_glow::CallbackFn::new(move |info, painter| {
            let at = info.viewport_in_pixels();
            let viewport = Viewport {
                left: at.left_px,
                bottom: at.from_bottom_px,
                width: at.width_px,
                height: at.height_px,
            };
            locked(&renderer).paint(painter.gl(), &frame, viewport);
        });
        ui.painter().add(egui::PaintCallback { rect, callback: Arc::new(callback) });
        if let Some(error) = error {
            let text = egui::RichText::new(error).color(ui.visuals().error_fg_color);
            ui.put(rect.shrink(16.0), egui::Label::new(text).wrap());
        }
    }

    fn handle_pointer(&mut self, ui: &egui::Ui, response: &egui::Response, lens: &Lens, culled: bool) {
        let modifiers = ui.input(|input| input.modifiers);
        for button in [PointerButton::Primary, PointerButton::Secondary, PointerButton::Middle] {
            if response.drag_started_by(button) {
                let grasped = ui.input(|input| input.pointer.press_origin());
                let grasped = grasped.and_then(|at| self.pick(lens, at, culled));
                self.gesture = if button != PointerButton::Primary || modifiers.shift {
                    Gesture::Pan
                } else if (self.is_indoors() || !self.held.is_empty()) != modifiers.alt {
                    // Within a room the hand turns the head: to turn the room would put the eye through its walls.
                    Gesture::Look
                } else {
                    Gesture::Orbit
                };
                self.control.grasp(grasped.map(|pick| pick.point));
            }
        }
        let moved = response.drag_delta();
        if let Some(at) = response.interact_pointer_pos().filter(|_| moved != egui::Vec2::ZERO)
            && response.dragged()
            && let Some((view, x, y)) = self.cell(lens, at)
        {
            let (dx, dy) = (f64::from(moved.x), f64::from(moved.y));
            let scale = f64::from(lens.pixels_per_point);
            match self.gesture {
                Gesture::Orbit => {
                    let step = TURN / f64::from(lens.rect.height());
                    self.control.orbit(dx * step, -dy * step);
                }
                Gesture::Look => {
                    let step = scale * view.cell_height().abs();
                    self.control.look_around(-dx * step, dy * step);
                }
                Gesture::Pan => {
                    let before = view.direction(x - dx * scale, y - dy * scale);
                    self.control.pan(before, view.direction(x, y));
                }
            }
        }

        if let Some(at) = response.hover_pos() {
            let (scroll, pinch) = ui.input(|input| (input.smooth_scroll_delta().y, input.zoom_delta()));
            let factor = (-scroll * WHEEL).exp() / pinch.max(1e-3);
            if factor != 1.0
                && let Some((view, x, y)) = self.cell(lens, at)
            {
                let point = self.pick(lens, at, culled).map(|pick| pick.point);
                self.control.zoom(point, view.direction(x, y), f64::from(factor));
            }
        }
        if response.double_clicked()
            && let Some(at) = response.interact_pointer_pos()
        {
            match self.pick(lens, at, culled) {
                Some(pick) => self.look_at(pick.point, pick.surface),
                None => self.frame_all(),
            }
        }
    }

    fn handle_keys(&mut self, ui: &egui::Ui, response: &egui::Response, look: &Look) {
        let elsewhere =
            ui.ctx().memory(|memory| memory.focused()).is_some_and(|focused| focused != response.id);
        let (mut frame, mut home) = (false, false);
        let (seconds, fast) = ui.input(|input| {
            if elsewhere || !input.focused || input.modifiers.command || input.modifiers.alt {
                self.held.clear();
            } else {
                for event in &input.events {
                    if let egui::Event::Key { key, physical_key, pressed, .. } = event {
                        // Flying is a shape under the left hand: where the keys lie, not what is printed on them.
                        let place = physical_key.unwrap_or(*key);
                        if !pressed {
                            self.held.remove(&place);
                        } else if [Key::W, Key::A, Key::S, Key::D, Key::Q, Key::E].contains(&place) {
                            self.held.insert(place);
                        }
                        frame |= *pressed && *key == Key::F;
                        home |= *pressed && *key == Key::Home;
                    }
                }
            }
            (f64::from(input.stable_dt), input.modifiers.shift)
        });
        if frame {
            let selected = look.selected.and_then(|patch| {
                let patches = &self.scene.as_ref()?.patches;
                let patch = patch as usize;
                Some((*patches.centre.get(patch)?, *patches.surface.get(patch)?))
            });
            match selected {
                Some((point, surface)) => self.look_at(point, surface),
                None => self.frame_all(),
            }
        }
        if home {
            self.reset();
        }
        let axis = |plus: Key, minus: Key| {
            f64::from(i8::from(self.held.contains(&plus)) - i8::from(self.held.contains(&minus)))
        };
        let wish = DVec3::new(axis(Key::D, Key::A), axis(Key::E, Key::Q), axis(Key::W, Key::S));
        let flies = self.control.fly(wish, fast, seconds);
        let glides = self.control.tick(seconds);
        if flies || glides {
            ui.ctx().request_repaint();
        }
    }

    /// Go where all of `surface` is seen, with `point` of it in the middle. Along the line of sight, which is free; and
    /// within a room only nearer.
    fn look_at(&mut self, point: DVec3, surface: u32) {
        let Some(scene) = &self.scene else { return };
        let Some(surface) = scene.scene.surfaces.get(surface as usize) else { return };
        let reach =
            surface.shape.vertices().into_iter().map(|vertex| vertex.distance(point)).fold(0.0, f64::max);
        let aspect = self.size[0] as f64 / self.size[1] as f64;
        let to = self.control.looking_at(point, reach, aspect, self.is_indoors());
        self.control.glide_to(to);
    }

    fn is_indoors(&self) -> bool {
        self.scene.as_ref().is_some_and(|scene| scene.picker.indoors(self.control.camera().eye))
    }

    /// The view through the whole panel, and which of its cells lies at `at`.
    fn cell(&self, lens: &Lens, at: Pos2) -> Option<(View, f64, f64)> {
        let (area, view) = fit(self.control.camera(), self.size[0], self.size[1]).ok()??;
        let from_corner = (at - lens.rect.min) * lens.pixels_per_point;
        let x = f64::from(from_corner.x) - area.left as f64 - 0.5;
        let y = f64::from(from_corner.y) - area.top as f64 - 0.5;
        Some((view, x, y))
    }

    fn pick(&self, lens: &Lens, at: Pos2, culled: bool) -> Option<Pick> {
        let (view, x, y) = self.cell(lens, at)?;
        let within = |at: f64, cells: usize| at >= -0.5 && at <= cells as f64 - 0.5;
        if !within(x, view.width) || !within(y, view.height) {
            return None;
        }
        self.scene.as_ref()?.picker.pick(&view, x, y, culled)
    }

    fn renderer(&self) -> MutexGuard<'_, Renderer> {
        locked(&self.renderer)
    }
}

/// What the GPU is to be given of `values`.
fn uploads(buffers: &SceneBuffers, values: &Values) -> (Content, [Vec<Texel>; 2]) {
    let Some(texels) = buffers.texels(values) else { return (Content::None, [Vec::new(), Vec::new()]) };
    let holes = texels.iter().flatten().any(|texel| texel[3] == 0.0);
    let content = match *values {
        Values::Colour(_) => Content::Colour { holes },
        Values::Scalar { range, logarithmic, .. } => Content::Scalar { holes, range, logarithmic },
    };
    (content, texels)
}

/// Where the view lies in the window.
struct Lens {
    rect: Rect,
    pixels_per_point: f32,
}

/// A renderer whose drawing once panicked is drawn with all the same.
fn locked(renderer: &Mutex<Renderer>) -> MutexGuard<'_, Renderer> {
    renderer.lock().unwrap_or_else(PoisonError::into_inner)
}
