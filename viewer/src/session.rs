//! What is open and what is known of it, as the worker told: the window's state, without a window.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use radiosity::bake::{Method, Request, Run, Solver};
use radiosity::light::Rgb;
use radiosity::patches::Subdivision;
use radiosity::solve::Solution;

use crate::worker::{
    Coefficients, Inspection, Light, Loaded, News, Order, Stage, Trouble, Worker, coefficients_of,
};

/// A scene, its light, and whoever works on it.
pub(crate) struct Session {
    worker: Worker,
    /// What is asked of the solver.
    pub(crate) request: Request,
    /// The scene, once one was read.
    pub(crate) loaded: Option<Loaded>,
    /// The light as it stands.
    pub(crate) light: Light,
    /// Whether any light has arrived yet.
    pub(crate) lit: bool,
    /// What the worker does.
    pub(crate) activity: Activity,
    /// The solver that was asked for last.
    pub(crate) solver: Solver,
    /// Why the last thing asked was not done, until it is put away.
    pub(crate) trouble: Option<Trouble>,
    /// The patch that was clicked upon.
    pub(crate) selected: Option<u32>,
    /// What it sees.
    pub(crate) inspection: Option<Box<Inspection>>,
    /// The surfaces' materials as they are set now.
    pub(crate) materials: Vec<SurfaceLight>,
    /// Whether the light follows an edit, and not a fresh start.
    pub(crate) follows_edit: bool,
    /// The path of what is being read, or was last asked for.
    pub(crate) asked_path: Option<PathBuf>,
    /// How long the answer took.
    pub(crate) seconds: f64,
}

/// What the worker does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) enum Activity {
    #[default]
    Idle,
    Reading,
    /// It began, and has not yet told how far it is.
    Begun,
    At(Stage),
    /// It has stopped and would go on.
    Paused(Option<Stage>),
    /// The light is there.
    Done,
}

/// A surface's material as it is set now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SurfaceLight {
    /// E when switched on.
    pub(crate) emission: Rgb,
    /// The emission's colour, its largest channel 1: kept while the intensity is 0.
    pub(crate) hue: Rgb,
    /// ρ.
    pub(crate) reflectance: Rgb,
    /// Whether it shines.
    pub(crate) on: bool,
}

impl SurfaceLight {
    fn new(coefficients: Coefficients) -> Self {
        let Coefficients { emission, reflectance } = coefficients;
        Self { emission, hue: hue_of(emission), reflectance, on: true }
    }

    /// What the solver is given.
    pub(crate) fn coefficients(self) -> Coefficients {
        let emission = if self.on { self.emission } else { Rgb::BLACK };
        Coefficients { emission, reflectance: self.reflectance }
    }
}

/// A colour whose largest channel is 1; white for black.
pub(crate) fn hue_of(emission: Rgb) -> Rgb {
    let intensity = emission.max_channel();
    if intensity > 0.0 && intensity.is_finite() { emission * (1.0 / intensity) } else { Rgb::WHITE }
}

/// What the window should know of what was heard.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Heard {
    /// Another scene is there; whether its camera is to be kept.
    pub(crate) scene: Option<KeepCamera>,
    /// The light has changed.
    pub(crate) light: bool,
    /// What the chosen patch sees has changed.
    pub(crate) inspection: bool,
    /// The answer is there.
    pub(crate) done: bool,
}

/// Whether a scene is the one that was there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum KeepCamera {
    Yes,
    No,
}

impl Session {
    /// With nothing open. `wake` is called from the worker's thread whenever there is something to [`Session::hear`].
    pub(crate) fn new(request: Request, run: Run, wake: impl Fn() + Send + 'static) -> Self {
        let worker = Worker::start(run, wake);
        worker.order(Order::Set(request));
        Self {
            worker,
            request,
            loaded: None,
            light: Light::default(),
            lit: false,
            activity: Activity::Idle,
            solver: Solver::GaussSeidel,
            trouble: None,
            selected: None,
            inspection: None,
            materials: Vec::new(),
            follows_edit: false,
            asked_path: None,
            seconds: 0.0,
        }
    }

    /// Open a scene, and find its light at once where `solve` says by what.
    pub(crate) fn open(&mut self, path: &Path, solve: Option<Solver>) {
        self.asked_path = Some(path.to_owned());
        self.activity = Activity::Reading;
        if let Some(solver) = solve {
            self.solver = solver;
        }
        self.worker.order(Order::Open { path: path.to_owned(), solve });
    }

    /// Read the file again; where there was light, find it again.
    pub(crate) fn reload(&mut self) {
        if let Some(path) = self.asked_path.clone() {
            let wanted = self.lit || self.is_busy();
            self.open(&path, wanted.then_some(self.solver));
        }
    }

    #[cfg(test)]
    pub(crate) fn show(&mut self, scene: radiosity::scene::Scene) {
        self.worker.order(Order::Show(Box::new(scene)));
    }

    /// Find the light.
    pub(crate) fn solve(&mut self, solver: Solver) {
        if self.loaded.is_some() {
            self.solver = solver;
            self.follows_edit = false;
            self.activity = Activity::Begun;
            self.trouble = None;
            self.worker.order(Order::Solve(solver));
        }
    }

    /// Stop, or go on.
    pub(crate) fn stop_or_resume(&mut self) {
        match self.activity {
            Activity::Begun | Activity::At(_) => self.worker.order(Order::Pause),
            Activity::Paused(_) => self.worker.order(Order::Resume),
            _ => {}
        }
    }

    /// Another way to find form factors.
    pub(crate) fn set_method(&mut self, method: Method) {
        let correct = self.request.correct && method.from_patch_to_patch();
        self.set(Request { method, correct, ..self.request });
    }

    /// Whether what patches hide that send light evenly is found, and sent after.
    pub(crate) fn set_correct(&mut self, correct: bool) {
        if self.can_correct() {
            self.set(Request { correct, ..self.request });
        }
    }

    /// Whether the method is one whose answers are corrected.
    pub(crate) fn can_correct(&self) -> bool {
        self.request.method.from_patch_to_patch()
    }

    /// Cells along a side of the hemicube's top; `None` where form factors are exact.
    pub(crate) fn precision(&self) -> Option<u32> {
        self.request.method.precision()
    }

    /// Find out how far the answer may be off, where there is one and that is not known.
    pub(crate) fn want_error(&mut self) {
        if self.activity == Activity::Done && self.light.complete && self.light.error.is_none() {
            self.activity = Activity::Begun;
            self.worker.order(Order::Estimate);
        }
    }

    /// Another subdivision factor.
    pub(crate) fn set_subdivision(&mut self, factor: f64) {
        self.set(Request { subdivision: factor.into(), ..self.request });
    }

    /// What the author's n and m are multiplied by.
    pub(crate) fn subdivision(&self) -> f64 {
        match self.request.subdivision {
            Subdivision::Factor(factor) => factor,
            // The window asks for nothing else.
            Subdivision::PatchSize(_) | Subdivision::Patches(_) => 1.0,
        }
    }

    /// Whether patches are parted where surfaces meet, from now on.
    pub(crate) fn set_split(&mut self, split: bool) {
        self.set(Request { split: Some(split), ..self.request });
    }

    /// Whether patches are parted where surfaces meet.
    pub(crate) fn split(&self) -> bool {
        self.request.cutting().split
    }

    fn set(&mut self, request: Request) {
        if request != self.request {
            self.request = request;
            self.worker.order(Order::Set(request));
            // Light that was there is wanted with the new settings too.
            if self.lit || self.is_busy() {
                self.solve(self.solver);
            } else if let Some(patch) = self.selected {
                self.worker.order(Order::Inspect(patch));
            }
        }
    }

    /// Choose a patch, or none.
    pub(crate) fn select(&mut self, patch: Option<u32>) {
        self.selected = patch;
        match patch {
            Some(patch) => self.worker.order(Order::Inspect(patch)),
            None => self.inspection = None,
        }
    }

    /// The materials were changed: the light follows.
    pub(crate) fn materials_changed(&mut self) {
        self.follows_edit = true;
        let coefficients = self.materials.iter().map(|material| material.coefficients()).collect();
        self.worker.order(Order::Edit(coefficients));
    }

    /// Materials as the file has them.
    pub(crate) fn reset_materials(&mut self) {
        if let Some(loaded) = &self.loaded {
            let of_file = loaded.scene.surfaces.iter().map(|surface| Coefficients {
                emission: surface.material.emission,
                reflectance: surface.material.diffuse,
            });
            self.materials = of_file.map(SurfaceLight::new).collect();
            self.materials_changed();
        }
    }

    /// Whether a computation runs or waits to go on.
    pub(crate) fn is_busy(&self) -> bool {
        matches!(self.activity, Activity::Begun | Activity::At(_) | Activity::Paused(_))
    }

    /// The answer, where it is there.
    pub(crate) fn solution(&self) -> Option<Solution> {
        let irradiance = self.light.irradiance.as_ref().filter(|_| self.light.complete)?;
        Some(Solution {
            radiosity: self.light.radiosity.to_vec(),
            irradiance: irradiance.to_vec(),
            iterations: self.light.iterations,
            history: self.light.history.to_vec(),
        })
    }

    /// Take in all that the worker has told.
    pub(crate) fn hear(&mut self) -> Heard {
        let mut heard = Heard::default();
        while let Some(news) = self.worker.news() {
            match news {
                News::Reading(path) => {
                    self.asked_path = Some(path);
                    self.activity = Activity::Reading;
                }
                News::Loaded { loaded, recut } => self.take(loaded, recut, &mut heard),
                News::At(stage) => {
                    if !matches!(self.activity, Activity::Paused(_)) {
                        self.activity = Activity::At(stage);
                    }
                }
                News::Light(light) => {
                    // Light of an earlier cut comes too late.
                    if self.loaded.as_ref().is_some_and(|l| l.patches.len() == light.patches.len()) {
                        self.light = light;
                        self.lit = true;
                        heard.light = true;
                    }
                }
                News::Paused => {
                    let stage = if let Activity::At(stage) = self.activity { Some(stage) } else { None };
                    self.activity = Activity::Paused(stage);
                }
                News::Resumed => {
                    self.activity = match self.activity {
                        Activity::Paused(Some(stage)) => Activity::At(stage),
                        _ => Activity::Begun,
                    };
                }
                News::Done { seconds } => {
                    self.activity = Activity::Done;
                    self.seconds = seconds;
                    self.trouble = None;
                    heard.done = true;
                }
                News::Error(error) => {
                    // That of an earlier answer comes too late.
                    let patches = error.estimate.radiosity.len();
                    if self.light.complete && self.light.patches.len() == patches {
                        self.light.error = Some(error);
                        self.activity = Activity::Done;
                        heard.light = true;
                    }
                }
                News::Trouble(trouble) => {
                    self.activity = match (&trouble, self.light.complete) {
                        (Trouble::Scene(_), true) => Activity::Done,
                        _ => Activity::Idle,
                    };
                    self.trouble = Some(trouble);
                }
                News::Inspected(inspection) => {
                    let current = self.loaded.as_ref().is_some_and(|l| l.patches.len() == inspection.patches);
                    if current && self.selected == Some(inspection.patch) {
                        self.inspection = Some(inspection);
                        heard.inspection = true;
                    }
                }
            }
        }
        heard
    }

    fn take(&mut self, loaded: Loaded, recut: bool, heard: &mut Heard) {
        let same_file =
            self.loaded.as_ref().is_some_and(|last| last.path.is_some() && last.path == loaded.path);
        let same_patches = same_file
            && self.loaded.as_ref().is_some_and(|last| last.patches.blocks == loaded.patches.blocks);
        heard.scene = Some(if recut || same_file { KeepCamera::Yes } else { KeepCamera::No });
        if !recut {
            self.materials = coefficients_of(&loaded.patches).into_iter().map(SurfaceLight::new).collect();
            self.activity = Activity::Idle;
        }
        if !same_patches {
            // Another cut has other patches.
            (self.selected, self.inspection) = (None, None);
        }
        self.light = Light {
            patches: loaded.patches.clone(),
            radiosity: Arc::new(loaded.patches.emission.clone()),
            direct: Arc::new(vec![None; loaded.patches.len()]),
            row_sum: Arc::new(vec![None; loaded.patches.len()]),
            ..Light::default()
        };
        self.lit = false;
        self.follows_edit = false;
        self.trouble = None;
        self.loaded = Some(loaded);
        if let Some(patch) = self.selected {
            self.worker.order(Order::Inspect(patch));
        }
    }

    /// How far the work is, 0..1, and how long it will take; `None` while nobody knows.
    pub(crate) fn progress(&self) -> (Option<f32>, Option<Duration>) {
        let (Activity::At(stage) | Activity::Paused(Some(stage))) = self.activity else {
            return (None, None);
        };
        match stage {
            Stage::Rows { done, total, left } => (Some(done as f32 / total.max(1) as f32), left),
            Stage::Sweeps { residual, left, .. } => (self.converged_share(residual), left),
            Stage::Shots { residual, .. } => (self.converged_share(residual), None),
            Stage::Looks { done, total } | Stage::Correction { done, total } => {
                (Some(done as f32 / total.max(1) as f32), None)
            }
        }
    }

    /// On a logarithmic scale: how much of the way from the first residual to epsilon is behind us.
    fn converged_share(&self, residual: f64) -> Option<f32> {
        let sum: f64 = self.light.patches.emission.iter().map(|e| e.norm_squared()).sum();
        let (first, epsilon) = (sum.sqrt(), self.request.epsilon);
        let share = (first / residual).ln() / (first / epsilon).ln();
        share.is_finite().then_some(share.clamp(0.0, 1.0) as f32)
    }
}
