//! The window: what it holds, and a frame of it.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use eframe::egui;
use radiosity::bake::{Method, Request, Run, Solver};
use radiosity::form_factors::shares::DEFAULT_EYES;
use radiosity::form_factors::visible::DEFAULT_ACCURACY;
use radiosity::light::Rgb;
use radiosity::scene::{BackFaces, Scene};
use radiosity::shade::{Shading, ToneCurve, ToneMap, automatic_exposure};

use crate::action::Action;
use crate::dialogs::{FileQuestion, Purpose};
use crate::hemicube_panel::HemicubePanel;
use crate::language::{Language, Texts};
use crate::menu;
use crate::panels::{self, numbers_dialog::NumbersDialog};
use crate::quantities::{self, Column, Quantity};
use crate::saving::{Colours, PictureOrder, Saving, SolutionOrder};
use crate::scene_file::SceneFile;
use crate::session::{Activity, KeepCamera, Session};
use crate::settings::Settings;
use crate::view3d::{BackFaceStyle, ColourMap, Look, Pick, Values, View3d};

/// A third of a stop.
const EXPOSURE_STEP: f32 = 1.0 / 3.0;
/// How long a passing message stays.
const TOAST: Duration = Duration::from_secs(6);

/// What the command line asks.
#[derive(Clone, Debug, Default)]
pub(crate) struct Start {
    pub(crate) scene: Option<PathBuf>,
    pub(crate) precision: Option<u32>,
    pub(crate) method: MethodName,
    pub(crate) correct: bool,
    pub(crate) subdivision: Option<f64>,
    pub(crate) solve: Option<Solver>,
    pub(crate) language: Option<Language>,
}

/// A way to find form factors, by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum MethodName {
    #[default]
    Hemicube,
    HemicubeExact,
    Exact,
}

impl MethodName {
    /// With hemicubes of this precision, where it takes any.
    fn method(self, precision: u32) -> Method {
        let (eyes, accuracy) = (DEFAULT_EYES, DEFAULT_ACCURACY);
        match self {
            Self::Hemicube => Method::Hemicube { precision },
            Self::HemicubeExact => Method::HemicubeExact { precision, eyes, accuracy },
            Self::Exact => Method::Exact { accuracy },
        }
    }
}

/// The window.
pub(crate) struct App {
    pub(crate) session: Session,
    pub(crate) settings: Settings,
    pub(crate) view: View3d,
    /// Set by the worker's thread when there is something to hear.
    called: Arc<AtomicBool>,
    system_language: Language,
    scene_file: Option<SceneFile>,
    questions: FileQuestion,
    saving: Option<Saving>,
    toast: Option<(String, Instant)>,
    pub(crate) help: bool,
    pub(crate) numbers: Option<NumbersDialog>,
    /// Whether the size of the picture is being asked for.
    pub(crate) picture_dialog: bool,
    pub(crate) back_faces: BackFaceStyle,
    pub(crate) exposure: f32,
    pub(crate) automatic_exposure: bool,
    /// The scale's ends, where they are fixed.
    pub(crate) fixed_range: Option<[f64; 2]>,
    /// What is shown now.
    pub(crate) shown: Shown,
    stale: bool,
    pub(crate) hovered: Option<Pick>,
    /// Lights and materials: every surface by itself.
    pub(crate) one_by_one: bool,
    pub(crate) hemicube: HemicubePanel,
    pub(crate) warnings_open: bool,
    /// The view's size, in pixels.
    pub(crate) view_size: [usize; 2],
    title: String,
}

/// The values on the surfaces.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shown {
    /// As colours, or one number a patch.
    pub(crate) column: Option<Column>,
    /// The scale, where false colours are on.
    pub(crate) scale: Option<Scale>,
}

/// A scale of false colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scale {
    pub(crate) range: [f64; 2],
    pub(crate) logarithmic: bool,
    /// Whether there are values below, and above.
    pub(crate) beyond: [bool; 2],
}

impl App {
    /// The window, before its first frame.
    pub(crate) fn new(start: &Start, settings: Settings, ctx: &egui::Context) -> Self {
        let settings = settings.sane();
        let called = Arc::<AtomicBool>::default();
        let precision = start.precision.unwrap_or(settings.precision);
        let (method, subdivision) = (start.method.method(precision), start.subdivision.unwrap_or(1.0).into());
        let request = Request { subdivision, method, correct: start.correct, ..Request::default() };
        let wake = {
            let (ctx, called) = (ctx.clone(), called.clone());
            move || {
                called.store(true, Ordering::Release);
                ctx.request_repaint();
            }
        };
        let mut app = Self {
            session: Session::new(request, Run::default(), wake),
            settings,
            view: View3d::new(),
            called,
            system_language: Language::of_system(),
            scene_file: None,
            questions: FileQuestion::default(),
            saving: None,
            toast: None,
            help: false,
            numbers: None,
            picture_dialog: false,
            back_faces: BackFaceStyle::Lit,
            exposure: 0.0,
            automatic_exposure: true,
            fixed_range: None,
            shown: Shown::default(),
            stale: true,
            hovered: None,
            one_by_one: false,
            hemicube: HemicubePanel::default(),
            warnings_open: false,
            view_size: [800, 600],
            title: String::new(),
        };
        if start.language.is_some() {
            app.settings.language = start.language;
        }
        ctx.all_styles_mut(|style| {
            style.interaction.tooltip_delay = 0.4;
            style.spacing.menu_width = 200.0;
        });
        if let Some(scene) = &start.scene {
            app.session.open(scene, start.solve);
        }
        app
    }

    /// The language spoken now.
    pub(crate) fn language(&self) -> Language {
        self.settings.language.unwrap_or(self.system_language)
    }

    /// Its texts.
    pub(crate) fn texts(&self) -> &'static Texts {
        self.language().texts()
    }

    /// What is printed on an action's key.
    pub(crate) fn key(&self, action: Action, ctx: &egui::Context) -> String {
        self.language().keys(ctx.format_shortcut(&action.shortcut()))
    }

    /// The name of what is open.
    pub(crate) fn name(&self) -> Option<String> {
        let path = self.session.loaded.as_ref()?.path.as_ref()?;
        Some(path.file_stem()?.to_string_lossy().into_owned())
    }

    /// A whole frame.
    pub(crate) fn show(&mut self, ui: &mut egui::Ui) {
        self.hear(ui.ctx());
        self.watch_file(ui.ctx());
        self.take_dropped(ui.ctx());
        menu::keys(self, ui.ctx());

        egui::Panel::top("menu").show(ui, |ui| menu::bar(self, ui));
        egui::Panel::bottom("status").show(ui, |ui| panels::status::show(self, ui));
        panels::sides(self, ui);
        let frame = egui::Frame::NONE.fill(egui::Color32::BLACK);
        egui::CentralPanel::no_frame().frame(frame).show(ui, |ui| self.view(ui));

        panels::trouble::show(self, ui.ctx());
        panels::help::show(self, ui.ctx());
        panels::numbers_dialog::show(self, ui.ctx());
        panels::picture_dialog::show(self, ui.ctx());
        panels::warnings::show(self, ui.ctx());
        self.files(ui.ctx());
        self.retitle(ui.ctx());
    }

    fn hear(&mut self, ctx: &egui::Context) {
        self.called.store(false, Ordering::Release);
        let heard = self.session.hear();
        if let Some(keep) = heard.scene {
            self.scene_changed(keep, ctx);
        }
        if heard.light
            || heard.scene.is_some()
            || (heard.inspection && self.quantity() == Quantity::FormFactors)
        {
            self.stale = true;
        }
        if heard.inspection {
            self.hemicube.forget();
        }
        if self.quantity() == Quantity::Error {
            self.session.want_error();
        }
        if (heard.light || heard.done) && self.automatic_exposure && !self.session.follows_edit {
            self.expose();
        }
    }

    fn scene_changed(&mut self, keep: KeepCamera, ctx: &egui::Context) {
        let Some(loaded) = &self.session.loaded else { return };
        self.view.set_scene(
            loaded.scene.clone(),
            loaded.patches.clone(),
            loaded.facets.clone(),
            keep == KeepCamera::Yes,
        );
        if keep == KeepCamera::No {
            self.back_faces = match loaded.scene.back_faces {
                BackFaces::Lit => BackFaceStyle::Lit,
                BackFaces::Black => BackFaceStyle::Black,
            };
            self.automatic_exposure = true;
            self.exposure = 0.0;
            self.warnings_open = false;
        }
        self.hovered = None;
        self.hemicube.forget();
        if let Some(path) = loaded.path.clone() {
            self.settings.opened(&path);
            if self.scene_file.as_ref().is_none_or(|file| file.path() != path) {
                let ctx = ctx.clone();
                self.scene_file = Some(SceneFile::watch(&path, move || ctx.request_repaint()));
            }
        }
    }

    /// The exposure that suits the light as it stands.
    pub(crate) fn expose(&mut self) {
        let light = &self.session.light;
        if self.session.lit {
            self.exposure = automatic_exposure(&light.patches, &light.radiosity) as f32;
        }
    }

    fn watch_file(&mut self, ctx: &egui::Context) {
        // A scene that could not be opened the first time is watched too: it may be mended.
        if self.scene_file.is_none()
            && self.session.loaded.is_none()
            && self.session.trouble.is_some()
            && let Some(path) = self.session.asked_path.clone()
        {
            let ctx = ctx.clone();
            self.scene_file = Some(SceneFile::watch(&path, move || ctx.request_repaint()));
        }
        if let Some(file) = &mut self.scene_file {
            match file.saved() {
                Ok(()) => {
                    if self.session.asked_path.as_deref() == Some(file.path()) {
                        self.session.reload();
                    }
                }
                Err(later) => ctx.request_repaint_after(later),
            }
        }
    }

    fn take_dropped(&mut self, ctx: &egui::Context) {
        let dropped = ctx.input(|input| input.raw.dropped_files.first().map(|file| file.path().to_owned()));
        if let Some(path) = dropped {
            self.open(&path);
        }
    }

    /// Open a scene.
    pub(crate) fn open(&mut self, path: &Path) {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        self.session.trouble = None;
        if self.session.loaded.is_none() {
            self.scene_file = None;
        }
        self.session.open(&path, None);
    }

    /// What is shown on the surfaces.
    pub(crate) fn quantity(&self) -> Quantity {
        self.settings.drawing.quantity
    }

    /// Whether numbers are shown by a scale.
    pub(crate) fn false_colours(&self) -> bool {
        self.settings.drawing.false_colours || !self.quantity().is_colour()
    }

    pub(crate) fn colour_map(&self) -> ColourMap {
        ColourMap::ALL.get(self.settings.drawing.colour_map).copied().unwrap_or_default()
    }

    pub(crate) fn tone(&self) -> ToneCurve {
        ToneCurve::ALL.get(self.settings.drawing.tone).copied().unwrap_or_default()
    }

    /// Exposure and curve for what is shown: a reflectance needs neither.
    pub(crate) fn tone_map(&self) -> ToneMap {
        if self.quantity().is_light() {
            ToneMap { exposure: f64::from(self.exposure), curve: self.tone() }
        } else {
            ToneMap { exposure: 0.0, curve: ToneCurve::Linear }
        }
    }

    /// What is shown has changed.
    pub(crate) fn refresh(&mut self) {
        self.stale = true;
    }

    /// Values for the view, anew where something has changed.
    fn update_values(&mut self) {
        if !std::mem::take(&mut self.stale) || self.session.loaded.is_none() {
            return;
        }
        let (quantity, light) = (self.quantity(), &self.session.light);
        let waits_for_light = matches!(
            quantity,
            Quantity::Radiosity
                | Quantity::Irradiance
                | Quantity::Direct
                | Quantity::Indirect
                | Quantity::Closure
        );
        let row = self.session.inspection.as_deref().map(|inspection| &inspection.row);
        let waits_for_other = match quantity {
            Quantity::FormFactors => row.is_none(),
            Quantity::Error => light.error.is_none(),
            _ => false,
        };
        if (waits_for_light && !self.session.lit) || waits_for_other {
            self.shown = Shown::default();
            self.view.set_values(Values::Colour(Vec::new()));
            return;
        }
        let column = quantities::column(quantity, light, row);
        let scale = self.false_colours().then(|| {
            let logarithmic = self.settings.drawing.logarithmic && quantity != Quantity::Closure;
            let range = self.fixed_range.filter(|&[low, high]| low < high && (!logarithmic || low > 0.0));
            let numbers = column.numbers();
            let range = range.unwrap_or_else(|| {
                quantities::range_of(
                    &quantities::to_be_scaled(quantity, &numbers, &light.patches),
                    logarithmic,
                )
            });
            let beyond = [
                numbers.iter().any(|&number| number < range[0]),
                numbers.iter().any(|&number| number > range[1]),
            ];
            Scale { range, logarithmic, beyond }
        });
        self.view.set_values(match (&scale, &column) {
            (None, Column::Colour(colours)) => Values::Colour(colours.clone()),
            (scale, column) => {
                let (range, logarithmic) =
                    scale.map_or(([0.0, 1.0], false), |scale| (scale.range, scale.logarithmic));
                Values::Scalar {
                    values: column.numbers().iter().map(|&value| value as f32).collect(),
                    range: range.map(|end| end as f32),
                    logarithmic,
                }
            }
        });
        self.shown = Shown { column: Some(column), scale };
        self.hemicube.forget();
    }

    fn look(&self) -> Look {
        let drawing = &self.settings.drawing;
        let tone = self.tone_map();
        Look {
            shading: if drawing.smooth { Shading::Smooth } else { Shading::Flat },
            exposure: tone.exposure as f32,
            tone: tone.curve,
            colour_map: self.colour_map(),
            edges: drawing.edges,
            wireframe: drawing.wireframe,
            normals: drawing.normals,
            back_faces: self.back_faces,
            selected: self.session.selected,
            background: [0.0; 3],
        }
    }

    fn view(&mut self, ui: &mut egui::Ui) {
        self.update_values();
        let area = ui.available_rect_before_wrap();
        if self.session.loaded.is_none() {
            let response = ui.allocate_rect(area, egui::Sense::click());
            if area.width() > 1.0 && area.height() > 1.0 {
                panels::welcome(self, ui, area);
            }
            response.context_menu(|ui| menu::context(self, ui));
            return;
        }
        self.view_size =
            [area.width(), area.height()].map(|side| (side * ui.pixels_per_point()).round() as usize);
        let look = self.look();
        let seen = self.view.show(ui, &look);
        self.hovered = seen.hovered;
        if let Some(pick) = seen.clicked {
            self.session.select(Some(pick.patch));
        } else if seen.response.clicked() {
            self.session.select(None);
            self.refresh();
        }
        if area.width() > 60.0 && area.height() > 60.0 {
            panels::legend::paint(self, ui, area);
            self.paint_toast(ui, area);
        }
        seen.response.context_menu(|ui| menu::context(self, ui));
    }

    /// The colour in which each patch is shown now.
    pub(crate) fn patch_colour(&self, patch: u32) -> egui::Color32 {
        let patch = patch as usize;
        match (&self.shown.column, self.shown.scale) {
            (Some(column), Some(Scale { range, logarithmic, .. })) => {
                let value = match column {
                    Column::Colour(colours) => colours.get(patch).map_or(0.0, |colour| colour.luminance()),
                    Column::Number(numbers) => numbers.get(patch).copied().unwrap_or(0.0),
                };
                let [r, g, b] = self.colour_map().rgb(quantities::place_in(range, logarithmic, value));
                egui::Color32::from_rgb(r, g, b)
            }
            (Some(Column::Colour(colours)), None) => {
                let colour = colours.get(patch).copied().unwrap_or_default();
                on_screen(self.tone_map(), colour)
            }
            _ => {
                let reflectance = &self.session.light.patches.reflectance;
                on_screen(ToneMap::default(), reflectance.get(patch).copied().unwrap_or_default())
            }
        }
    }

    fn files(&mut self, ctx: &egui::Context) {
        if let Some((purpose, path)) = self.questions.answer(ctx, self.texts()) {
            match purpose {
                Purpose::OpenScene => self.open(&path),
                Purpose::SavePicture => self.save_picture(&path, ctx),
                Purpose::SaveSolution => self.save_solution(&path, ctx),
            }
        }
        if let Some(ended) = self.saving.as_ref().and_then(Saving::ended) {
            self.saving = None;
            let texts = self.texts();
            match ended {
                Ok(path) => self.tell((texts.saved)(&path.display().to_string())),
                Err(why) => self.tell(format!("{}: {why}", texts.trouble_save)),
            }
        }
    }

    /// Say something in passing.
    pub(crate) fn tell(&mut self, message: String) {
        self.toast = Some((message, Instant::now()));
    }

    fn paint_toast(&mut self, ui: &egui::Ui, area: egui::Rect) {
        let message = match (&self.toast, &self.saving) {
            (Some((message, since)), _) if since.elapsed() < TOAST => {
                ui.ctx().request_repaint_after(TOAST.saturating_sub(since.elapsed()));
                message.as_str()
            }
            (_, Some(_)) => self.texts().saving,
            _ => return,
        };
        let font = egui::TextStyle::Body.resolve(ui.style());
        let text = ui.painter().layout(message.to_owned(), font, egui::Color32::WHITE, area.width() - 40.0);
        let at = egui::pos2(area.center().x - text.size().x / 2.0, area.top() + 12.0);
        let back = egui::Rect::from_min_size(at, text.size()).expand2(egui::vec2(10.0, 6.0));
        ui.painter().rect_filled(back, 5.0, egui::Color32::from_black_alpha(190));
        ui.painter().galley(at, text, egui::Color32::WHITE);
    }

    /// Save what is seen.
    pub(crate) fn save_picture(&mut self, path: &Path, ctx: &egui::Context) {
        let Some(loaded) = self.session.loaded.clone() else { return };
        let values = match &self.shown.column {
            Some(Column::Colour(colours)) if self.shown.scale.is_none() => colours.clone(),
            Some(column) => column.numbers().into_iter().map(Rgb::grey).collect(),
            None => loaded.patches.reflectance.clone(),
        };
        let colours = match self.shown.scale {
            Some(Scale { range, logarithmic, .. }) => {
                Colours::False { map: self.colour_map(), range, logarithmic }
            }
            None => Colours::Toned(self.tone_map()),
        };
        let picture = self.settings.picture;
        let order = PictureOrder {
            back_faces: self.back_faces_of(&loaded.scene),
            loaded,
            values,
            shading: self.look().shading,
            camera: self.view.camera(),
            size: [picture.width, picture.height],
            sampling: picture.sampling,
            colours,
        };
        self.saving = Some(Saving::picture(path, order, ctx));
    }

    pub(crate) fn save_solution(&mut self, path: &Path, ctx: &egui::Context) {
        let (Some(loaded), Some(solution)) = (self.session.loaded.clone(), self.session.solution()) else {
            return;
        };
        let order = SolutionOrder {
            back_faces: self.back_faces_of(&loaded.scene),
            loaded,
            patches: self.session.light.patches.clone(),
            solution,
            error: self.session.light.error.clone(),
            camera: self.view.camera(),
            tone: self.tone_map(),
        };
        self.saving = Some(Saving::solution(path, order, ctx));
    }

    /// What backs are in what is saved.
    fn back_faces_of(&self, scene: &Scene) -> BackFaces {
        match self.back_faces {
            BackFaceStyle::Lit => BackFaces::Lit,
            BackFaceStyle::Black => BackFaces::Black,
            _ => scene.back_faces,
        }
    }

    /// Ask where a picture of the chosen size is to be saved.
    pub(crate) fn ask_for_picture_file(&mut self, ctx: &egui::Context) {
        let name = self.name().unwrap_or_else(|| "radiosity".into());
        self.questions.ask(Purpose::SavePicture, &name, self.texts(), ctx);
    }

    /// Whether an action can be taken now.
    pub(crate) fn can(&self, action: Action) -> bool {
        let session = &self.session;
        match action {
            Action::GaussSeidel | Action::Progressive | Action::FrameAll | Action::ResetCamera => {
                session.loaded.is_some()
            }
            Action::SavePicture | Action::ResetMaterials => session.loaded.is_some(),
            Action::SaveSolution => session.light.complete,
            Action::Correct => session.can_correct(),
            Action::StopOrResume => session.is_busy(),
            Action::Reload => session.asked_path.is_some(),
            Action::OpenLast => self.settings.recent.len() > 1,
            _ => true,
        }
    }

    /// For what can be on or off, or is one of several: whether it is on.
    pub(crate) fn is_on(&self, action: Action) -> Option<bool> {
        let (drawing, panels) = (&self.settings.drawing, &self.settings.panels);
        let (precision, subdivision) = (self.session.precision(), self.session.subdivision());
        Some(match action {
            Action::MethodHemicube => matches!(self.session.request.method, Method::Hemicube { .. }),
            Action::MethodShares => matches!(self.session.request.method, Method::HemicubeExact { .. }),
            Action::MethodExact => matches!(self.session.request.method, Method::Exact { .. }),
            Action::Correct => self.session.request.correct,
            Action::PrecisionQuick => precision == Some(30),
            Action::PrecisionHandIn => precision == Some(100),
            Action::PrecisionFine => precision == Some(200),
            Action::PrecisionOther => precision.is_some_and(|other| ![30, 100, 200].contains(&other)),
            Action::SubdivisionHalf => subdivision == 0.5,
            Action::SubdivisionOne => subdivision == 1.0,
            Action::SubdivisionTwo => subdivision == 2.0,
            Action::SubdivisionOther => ![0.5, 1.0, 2.0].contains(&subdivision),
            Action::Split => self.session.split(),
            Action::Smooth => drawing.smooth,
            Action::Edges => drawing.edges,
            Action::Wireframe => drawing.wireframe,
            Action::Normals => drawing.normals,
            Action::FalseColours => self.false_colours(),
            Action::AutoExposure => self.automatic_exposure,
            Action::ToneNeutral => self.tone() == ToneCurve::Neutral,
            Action::ToneReinhard => self.tone() == ToneCurve::Reinhard,
            Action::ToneLinear => self.tone() == ToneCurve::Linear,
            Action::Show(quantity) => self.quantity() == quantity,
            Action::DisplayPanel => panels.display,
            Action::MaterialsPanel => panels.materials,
            Action::PatchPanel => panels.patch,
            Action::HemicubePanel => panels.hemicube,
            Action::ResidualPanel => panels.residual,
            Action::English => self.language() == Language::English,
            Action::French => self.language() == Language::French,
            _ => return None,
        })
    }

    /// Do it.
    pub(crate) fn act(&mut self, action: Action, ctx: &egui::Context) {
        if !self.can(action) {
            match action {
                Action::SaveSolution => self.tell(self.texts().not_solved.into()),
                Action::GaussSeidel | Action::Progressive | Action::SavePicture => {
                    self.tell(self.texts().no_scene.into());
                }
                _ => {}
            }
            return;
        }
        let drawing = &mut self.settings.drawing;
        let panels = &mut self.settings.panels;
        match action {
            Action::Open => self.questions.ask(Purpose::OpenScene, "", self.language().texts(), ctx),
            Action::OpenLast => {
                if let Some(path) = self.settings.recent.get(1).cloned() {
                    self.open(&path);
                }
            }
            Action::Reload => self.session.reload(),
            Action::SavePicture => self.picture_dialog = true,
            Action::SaveSolution => {
                let name = self.name().unwrap_or_else(|| "radiosity".into());
                self.questions.ask(Purpose::SaveSolution, &name, self.language().texts(), ctx);
            }
            Action::Quit => ctx.send_viewport_cmd(egui::ViewportCommand::Close),
            Action::GaussSeidel => self.solve(Solver::GaussSeidel),
            Action::Progressive => self.solve(Solver::Progressive),
            Action::StopOrResume => self.session.stop_or_resume(),
            Action::MethodHemicube => self.set_method(MethodName::Hemicube),
            Action::MethodShares => self.set_method(MethodName::HemicubeExact),
            Action::MethodExact => self.set_method(MethodName::Exact),
            Action::Correct => self.session.set_correct(!self.session.request.correct),
            Action::PrecisionQuick => self.set_precision(30),
            Action::PrecisionHandIn => self.set_precision(100),
            Action::PrecisionFine => self.set_precision(200),
            Action::PrecisionOther => {
                self.numbers = Some(NumbersDialog::precision(self.settings.precision));
            }
            Action::SubdivisionHalf => self.session.set_subdivision(0.5),
            Action::SubdivisionOne => self.session.set_subdivision(1.0),
            Action::SubdivisionTwo => self.session.set_subdivision(2.0),
            Action::Split => self.session.set_split(!self.session.split()),
            Action::SubdivisionOther => {
                self.numbers = Some(NumbersDialog::subdivision(self.session.subdivision()));
            }
            Action::ResetMaterials => self.session.reset_materials(),
            Action::FrameAll => self.view.frame_all(),
            Action::ResetCamera => self.view.reset(),
            Action::Smooth => drawing.smooth = !drawing.smooth,
            Action::Edges => drawing.edges = !drawing.edges,
            Action::Wireframe => drawing.wireframe = !drawing.wireframe,
            Action::Normals => drawing.normals = !drawing.normals,
            Action::BackFaces => {
                let all = BackFaceStyle::ALL;
                let now = all.iter().position(|style| *style == self.back_faces).unwrap_or(0);
                self.back_faces = all[(now + 1) % all.len()];
            }
            Action::FalseColours => {
                drawing.false_colours = !drawing.false_colours;
                self.stale = true;
            }
            Action::ExposureUp => self.nudge_exposure(EXPOSURE_STEP),
            Action::ExposureDown => self.nudge_exposure(-EXPOSURE_STEP),
            Action::AutoExposure => {
                self.automatic_exposure = !self.automatic_exposure;
                if self.automatic_exposure {
                    self.expose();
                }
            }
            Action::ToneNeutral => drawing.tone = 0,
            Action::ToneReinhard => drawing.tone = 1,
            Action::ToneLinear => drawing.tone = 2,
            Action::Show(quantity) => {
                drawing.quantity = quantity;
                self.fixed_range = None;
                self.stale = true;
            }
            Action::DisplayPanel => panels.display = !panels.display,
            Action::MaterialsPanel => panels.materials = !panels.materials,
            Action::PatchPanel => panels.patch = !panels.patch,
            Action::HemicubePanel => panels.hemicube = !panels.hemicube,
            Action::ResidualPanel => panels.residual = !panels.residual,
            Action::English => self.settings.language = Some(Language::English),
            Action::French => self.settings.language = Some(Language::French),
            Action::Help => self.help = !self.help,
        }
    }

    fn solve(&mut self, solver: Solver) {
        // Whoever asks for radiosity wants to see it.
        if matches!(self.quantity(), Quantity::Emission | Quantity::Reflectance | Quantity::Area) {
            self.settings.drawing.quantity = Quantity::Radiosity;
        }
        self.session.solve(solver);
        self.refresh();
    }

    fn set_method(&mut self, name: MethodName) {
        self.session.set_method(name.method(self.settings.precision));
    }

    /// Another precision, remembered, of hemicubes alone where there were none.
    pub(crate) fn set_precision(&mut self, precision: u32) {
        self.settings.precision = precision;
        self.set_method(match self.session.request.method {
            Method::HemicubeExact { .. } => MethodName::HemicubeExact,
            _ => MethodName::Hemicube,
        });
    }

    fn nudge_exposure(&mut self, step: f32) {
        self.automatic_exposure = false;
        self.exposure = (self.exposure + step).clamp(-20.0, 20.0);
    }

    fn retitle(&mut self, ctx: &egui::Context) {
        let title = match (&self.name(), self.session.activity) {
            (Some(name), Activity::At(_)) => match self.session.progress().0 {
                Some(share) => format!("{:.0} % · {name} · radiosity", share * 100.0),
                None => format!("{name} · radiosity"),
            },
            (Some(name), _) => format!("{name} · radiosity"),
            (None, _) => "radiosity".into(),
        };
        if title != self.title {
            ctx.send_viewport_cmd(egui::ViewportCommand::Title(title.clone()));
            self.title = title;
        }
    }
}

/// A colour in linear light as the screen shows it.
pub(crate) fn on_screen(tone: ToneMap, colour: Rgb) -> egui::Color32 {
    let shown = tone.apply(colour.to_array().map(|value| value as f32));
    let [r, g, b] = shown.map(|value| (radiosity::shade::srgb_from_linear(value) * 255.0 + 0.5) as u8);
    egui::Color32::from_rgb(r, g, b)
}

const STORE_KEY: &str = "radiosity settings";

impl App {
    /// What was remembered; nothing where it cannot be read.
    pub(crate) fn remembered(storage: Option<&dyn eframe::Storage>) -> Settings {
        storage.and_then(|storage| eframe::get_value(storage, STORE_KEY)).unwrap_or_default()
    }
}

impl eframe::App for App {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        self.show(ui);
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        eframe::set_value(storage, STORE_KEY, &self.settings);
    }

    fn on_exit(&mut self, gl: Option<&eframe::glow::Context>) {
        if let Some(gl) = gl {
            self.view.destroy(gl);
        }
    }

    fn clear_color(&self, _visuals: &egui::Visuals) -> [f32; 4] {
        [0.0, 0.0, 0.0, 1.0]
    }
}
