//! The thread that reads scenes and solves them, so that the window never waits.
//!
//! Who sends what to whom:
//!
//! ```text
//! window ── Order ──> worker       open, solve, pause, resume, edit, inspect; the newest edit is the one that counts
//! worker ── News ───> window       what was read, how far it is, the light as it stands, what went wrong
//! worker ── patch ──> row threads  (form_factors::compute_rows_of) which row is to be found next
//! row threads ─ row > worker       each row as it is done
//! ```
//!
//! The window holds no lock and waits for nothing. The worker looks for orders between two rows, two sweeps or two
//! shots, so it answers within one of those. Its large messages, the light, are sent only when the window has taken the
//! last one, but for the final one, which always is.

use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use radiosity::bake::{self, BakeError, Request, Run, Solver};
use radiosity::estimate::{ErrorEstimate, OverallError};
use radiosity::form_factors::hemicube::{self, CellWeights, Face, Hemicube};
use radiosity::form_factors::{FormFactors, Row, compute_rows_of};
use radiosity::light::Rgb;
use radiosity::patches::Patches;
use radiosity::scene::{self, Scene, SceneError};
use radiosity::solve::{GaussSeidel, Progressive, Solution};
use radiosity::visibility::Facets;
use radiosity::watch::Progress;

/// Between two pictures of the light as it arrives.
const SHOW_EVERY: Duration = Duration::from_millis(33);
/// An answer that follows an edit by shooting begins from darkness; nobody wants to see that where it takes no longer.
const QUIET: Duration = Duration::from_millis(200);
/// Cells along a side of the hemicube that is shown of a patch where the form factors were found without one.
const SHOWN_PRECISION: u32 = 100;
/// Rows found ahead, a thread, when shots ask for one that is missing.
const ROWS_AHEAD: usize = 8;

/// What the window asks for.
#[derive(Debug)]
pub(crate) enum Order {
    /// Read this file; what is there now stays if that fails. `solve` at once where it is given.
    Open { path: PathBuf, solve: Option<Solver> },
    /// The same for a scene that is no file's (tests).
    #[cfg(test)]
    Show(Box<Scene>),
    /// Precision, subdivision and the stopping test, from now on.
    Set(Request),
    /// Find the light.
    Solve(Solver),
    /// Stop where you are, and keep all that is done.
    Pause,
    /// Go on.
    Resume,
    /// Emission and reflectance, one a surface.
    Edit(Vec<Coefficients>),
    /// Tell what a patch sees.
    Inspect(u32),
    /// Tell how far the answer may be off.
    Estimate,
}

/// What radiosity needs to know of a surface's material.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Coefficients {
    /// E.
    pub(crate) emission: Rgb,
    /// ρ.
    pub(crate) reflectance: Rgb,
}

/// What the worker tells.
#[derive(Debug)]
pub(crate) enum News {
    /// It began to read.
    Reading(PathBuf),
    /// A scene is there, or the same one cut anew (`recut`).
    Loaded { loaded: Loaded, recut: bool },
    /// How far the light is.
    At(Stage),
    /// The light as it stands.
    Light(Light),
    /// It has stopped, and would go on.
    Paused,
    /// It goes on.
    Resumed,
    /// The light is there, after so many seconds of work.
    Done { seconds: f64 },
    /// How far it may be off.
    Error(Arc<AnswerError>),
    /// What was asked cannot be done.
    Trouble(Trouble),
    /// What a patch sees.
    Inspected(Box<Inspection>),
}

/// A scene, cut.
#[derive(Clone, Debug)]
pub(crate) struct Loaded {
    pub(crate) path: Option<PathBuf>,
    pub(crate) scene: Arc<Scene>,
    pub(crate) patches: Arc<Patches>,
    pub(crate) facets: Arc<Facets>,
}

/// How far the light is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Stage {
    Rows {
        done: usize,
        total: usize,
        left: Option<Duration>,
    },
    Sweeps {
        done: usize,
        residual: f64,
        left: Option<Duration>,
    },
    Shots {
        done: usize,
        residual: f64,
        rows: usize,
        total: usize,
    },
    /// Second looks, from which the error is estimated.
    Looks {
        done: usize,
        total: usize,
    },
    /// Places within patches that tell what those hide that send evenly.
    Correction {
        done: usize,
        total: usize,
    },
}

/// The light as it stands. Every column has one entry a patch.
#[derive(Clone, Debug, Default)]
pub(crate) struct Light {
    /// The patches it falls on, with the materials it was found for.
    pub(crate) patches: Arc<Patches>,
    /// B: what has arrived so far, or the answer.
    pub(crate) radiosity: Arc<Vec<Rgb>>,
    /// H, once the answer is there.
    pub(crate) irradiance: Option<Arc<Vec<Rgb>>>,
    /// The irradiance that the emitters alone bring, where the row is known.
    pub(crate) direct: Arc<Vec<Option<Rgb>>>,
    /// Σ_j F_ij, where the row is known.
    pub(crate) row_sum: Arc<Vec<Option<f64>>>,
    /// What the stopping test measured.
    pub(crate) history: Arc<Vec<f64>>,
    /// Whether this is the answer.
    pub(crate) complete: bool,
    /// Steps made.
    pub(crate) iterations: usize,
    /// How far the answer may be off, once that was asked.
    pub(crate) error: Option<Arc<AnswerError>>,
}

/// How far an answer may be off: patch by patch, and in all.
#[derive(Clone, Debug)]
pub(crate) struct AnswerError {
    pub(crate) estimate: ErrorEstimate,
    pub(crate) overall: OverallError,
}

/// What one patch sees.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Inspection {
    pub(crate) patch: u32,
    /// Its row of form factors.
    pub(crate) row: Row,
    /// The patch that each cell sees, face by face in the order of [`Face::ALL`], row by row from the bottom.
    pub(crate) faces: [Vec<Option<u32>>; 5],
    pub(crate) weights: CellWeights,
    /// How many patches there were: what belongs to another cut says nothing.
    pub(crate) patches: usize,
}

/// Why there is no scene, or no light.
#[derive(Clone, Debug)]
pub(crate) enum Trouble {
    /// The file is no scene.
    Scene(SceneError),
    /// It cannot be cut or solved.
    Bake(BakeError),
    /// A fault of ours.
    Bug(String),
}

impl From<BakeError> for Trouble {
    fn from(error: BakeError) -> Self {
        Self::Bake(error)
    }
}

/// The window's end of it. Dropping it ends the thread.
pub(crate) struct Worker {
    orders: Option<Sender<Order>>,
    news: Receiver<News>,
    light_on_its_way: Arc<AtomicBool>,
    end: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Worker {
    /// Start it; `wake` is called whenever there is news.
    pub(crate) fn start(run: Run, wake: impl Fn() + Send + 'static) -> Self {
        let (orders, received) = channel();
        let (told, news) = channel();
        let (light_on_its_way, end) = (Arc::<AtomicBool>::default(), Arc::<AtomicBool>::default());
        let mut bench = Bench {
            orders: received,
            waiting: VecDeque::new(),
            tell: Tell {
                news: told,
                wake: Box::new(wake),
                light_on_its_way: light_on_its_way.clone(),
                last_light: None,
                last_stage: None,
            },
            end: end.clone(),
            paused: false,
            run,
            request: Request::default(),
            loaded: None,
            known: Known::default(),
            goal: None,
            answered_by: Solver::GaussSeidel,
            answer: None,
            error_wanted: false,
            spent: Duration::ZERO,
        };
        let thread = std::thread::Builder::new().name("radiosity".into()).spawn(move || bench.serve());
        Self { orders: Some(orders), news, light_on_its_way, end, thread: thread.ok() }
    }

    /// Ask for something.
    pub(crate) fn order(&self, order: Order) {
        if let Some(orders) = &self.orders {
            // Nobody is there any more only when the window is closing.
            let _ = orders.send(order);
        }
    }

    /// The next piece of news, if there is one.
    pub(crate) fn news(&self) -> Option<News> {
        let news = self.news.try_recv().ok()?;
        if matches!(news, News::Light(_)) {
            self.light_on_its_way.store(false, Ordering::Release);
        }
        Some(news)
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.end.store(true, Ordering::Release);
        self.orders = None;
        // It ends within a row or a sweep; should one take longer than anyone would wait, the process ends it.
        let patience = Instant::now() + Duration::from_secs(2);
        if let Some(thread) = self.thread.take() {
            while !thread.is_finished() && Instant::now() < patience {
                std::thread::sleep(Duration::from_millis(2));
            }
            if thread.is_finished() {
                let _ = thread.join();
            }
        }
    }
}

/// Where news goes.
struct Tell {
    news: Sender<News>,
    wake: Box<dyn Fn() + Send>,
    light_on_its_way: Arc<AtomicBool>,
    last_light: Option<Instant>,
    last_stage: Option<Instant>,
}

impl Tell {
    fn news(&mut self, news: News) {
        let _ = self.news.send(news);
        (self.wake)();
    }

    fn due(last: &mut Option<Instant>) -> bool {
        let due = last.is_none_or(|last| last.elapsed() >= SHOW_EVERY);
        if due {
            *last = Some(Instant::now());
        }
        due
    }

    /// Now and then.
    fn stage(&mut self, stage: impl FnOnce() -> Stage) {
        if Self::due(&mut self.last_stage) {
            self.news(News::At(stage()));
        }
    }

    /// Now and then, and never more than one ahead of the window.
    fn light_is_due(&mut self) -> bool {
        !self.light_on_its_way.load(Ordering::Acquire) && Self::due(&mut self.last_light)
    }

    /// In any case.
    fn last_light(&mut self, light: Light) {
        self.light_on_its_way.store(true, Ordering::Release);
        self.news(News::Light(light));
    }
}

/// What has been found out about the patches. It depends on geometry, precision and back faces alone, but for `direct`.
#[derive(Default)]
struct Known {
    /// The rows found, one a patch; empty once all of them are in `factors`.
    rows: Vec<Option<Row>>,
    factors: Option<Arc<FormFactors>>,
    row_sum: Vec<Option<f64>>,
    direct: Vec<Option<Rgb>>,
    /// Whether there is memory enough.
    allowed: bool,
    /// The last radiosities of a solver, for these patches.
    radiosity: Option<Vec<Rgb>>,
}

impl Known {
    fn nothing(patches: usize) -> Self {
        Self {
            rows: vec![None; patches],
            factors: None,
            row_sum: vec![None; patches],
            direct: vec![None; patches],
            allowed: false,
            radiosity: None,
        }
    }

    fn row(&self, patch: usize) -> Option<&Row> {
        match &self.factors {
            Some(factors) => Some(factors.row(patch)),
            None => self.rows.get(patch)?.as_ref(),
        }
    }

    fn keep(&mut self, patch: usize, row: Row, emission: &[Rgb]) {
        self.row_sum[patch] = Some(row.sum());
        self.direct[patch] = Some(row.gather(emission));
        self.rows[patch] = Some(row);
    }

    fn missing(&self) -> Vec<u32> {
        if self.factors.is_some() {
            return Vec::new();
        }
        (0_u32..).zip(&self.rows).filter(|(_, row)| row.is_none()).map(|(patch, _)| patch).collect()
    }

    /// All rows are there: make them a matrix.
    fn complete(&mut self) {
        if self.factors.is_none() {
            let rows = std::mem::take(&mut self.rows).into_iter().map(Option::unwrap_or_default).collect();
            self.factors = Some(Arc::new(FormFactors::from_rows(rows)));
        }
    }

    /// The light of the emitters, for other emissions.
    fn light_anew(&mut self, emission: &[Rgb]) {
        for patch in 0..self.direct.len() {
            self.direct[patch] = self.row(patch).map(|row| row.gather(emission));
        }
    }
}

/// What is to be reached.
#[derive(Clone, Copy, Debug)]
struct Goal {
    solver: Solver,
    /// Start from the last answer, if there is one.
    from_last: bool,
}

/// The worker's own state.
struct Bench {
    orders: Receiver<Order>,
    /// Orders taken in but not yet carried out.
    waiting: VecDeque<Order>,
    tell: Tell,
    end: Arc<AtomicBool>,
    paused: bool,
    run: Run,
    request: Request,
    loaded: Option<Loaded>,
    known: Known,
    goal: Option<Goal>,
    /// The solver that found `known.radiosity`.
    answered_by: Solver,
    /// The answer, while it is that to the scene as it stands.
    answer: Option<Solution>,
    /// Whether its error is to be estimated.
    error_wanted: bool,
    /// Time spent on the goal, pauses left out.
    spent: Duration,
}

/// Something else is to be done first.
struct CalledAway;

enum Outcome {
    Reached,
    CalledAway,
}

impl Bench {
    /// Until the window closes.
    fn serve(&mut self) {
        while !self.ended() {
            let next = match self.waiting.pop_front() {
                Some(order) => Some(order),
                None if self.has_work() && !self.paused => match self.orders.try_recv() {
                    Ok(order) => Some(order),
                    Err(TryRecvError::Empty) => None,
                    Err(TryRecvError::Disconnected) => return,
                },
                None => match self.orders.recv() {
                    Ok(order) => Some(order),
                    Err(_) => return,
                },
            };
            let done = catch_unwind(AssertUnwindSafe(|| match next {
                Some(order) => self.carry_out(order),
                None => self.pursue(),
            }));
            let trouble = match done {
                Ok(Ok(())) => continue,
                Ok(Err(trouble)) => trouble,
                Err(panic) => {
                    let text = panic.downcast_ref::<String>().cloned();
                    let text = text.or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned()));
                    // Half-made things are thrown away.
                    if let Some(loaded) = &self.loaded {
                        self.known = Known::nothing(loaded.patches.len());
                    }
                    Trouble::Bug(text.unwrap_or_default())
                }
            };
            (self.goal, self.error_wanted) = (None, false);
            self.tell.news(News::Trouble(trouble));
        }
    }

    fn has_work(&self) -> bool {
        self.goal.is_some() || self.error_wanted
    }

    /// The scene or what is asked of it has changed: the answer is none any more.
    fn forget_answer(&mut self) {
        (self.answer, self.error_wanted) = (None, false);
    }

    fn ended(&self) -> bool {
        self.end.load(Ordering::Acquire)
    }

    fn carry_out(&mut self, order: Order) -> Result<(), Trouble> {
        match order {
            Order::Open { path, solve } => {
                self.tell.news(News::Reading(path.clone()));
                let scene = read(&path)?;
                self.take(scene, Some(path), solve)?;
            }
            #[cfg(test)]
            Order::Show(scene) => self.take(*scene, None, None)?,
            Order::Set(request) => self.set(request)?,
            Order::Solve(solver) => {
                if self.loaded.is_some() {
                    self.goal = Some(Goal { solver, from_last: false });
                    self.forget_answer();
                    self.paused = false;
                    self.spent = Duration::ZERO;
                }
            }
            Order::Pause => self.pause(),
            Order::Resume => self.resume(),
            Order::Edit(coefficients) => self.edit(&coefficients),
            Order::Inspect(patch) => self.inspect(patch)?,
            Order::Estimate => {
                self.error_wanted = self.answer.is_some();
                self.paused = false;
            }
        }
        Ok(())
    }

    /// A scene was read. Where its geometry is the last one's, all form factors stay, and the light follows at once.
    fn take(&mut self, scene: Scene, path: Option<PathBuf>, solve: Option<Solver>) -> Result<(), Trouble> {
        let patches = bake::patches(&scene, &self.request, &self.run)?;
        let facets = Facets::new(&scene, &patches);
        let same = self.loaded.as_ref().is_some_and(|last| same_geometry(&last.scene, &scene));
        let loaded =
            Loaded { path, scene: Arc::new(scene), patches: Arc::new(patches), facets: Arc::new(facets) };
        if same {
            self.known.light_anew(&loaded.patches.emission);
        } else {
            self.known = Known::nothing(loaded.patches.len());
        }
        self.loaded = Some(loaded.clone());
        self.forget_answer();
        self.tell.news(News::Loaded { loaded, recut: false });
        self.goal = solve.map(|solver| Goal { solver, from_last: same });
        self.paused = false;
        self.spent = Duration::ZERO;
        Ok(())
    }

    fn set(&mut self, request: Request) -> Result<(), Trouble> {
        let last = std::mem::replace(&mut self.request, request);
        let Some(loaded) = &mut self.loaded else { return Ok(()) };
        if last.cutting() != request.cutting() {
            let patches = bake::patches(&loaded.scene, &request, &self.run);
            let mut patches = patches.inspect_err(|_| self.request = last)?;
            // Edited materials stay.
            let edited = coefficients_of(&loaded.patches);
            give(&mut patches, &edited);
            loaded.facets = Arc::new(Facets::new(&loaded.scene, &patches));
            loaded.patches = Arc::new(patches);
            let loaded = loaded.clone();
            self.known = Known::nothing(loaded.patches.len());
            self.goal = None;
            self.forget_answer();
            self.tell.news(News::Loaded { loaded, recut: true });
        } else if last.method != request.method || last.back_faces != request.back_faces {
            self.known = Known::nothing(loaded.patches.len());
            self.goal = None;
            self.forget_answer();
        }
        Ok(())
    }

    fn pause(&mut self) {
        if self.has_work() && !self.paused {
            self.paused = true;
            self.tell.news(News::Paused);
        }
    }

    fn resume(&mut self) {
        if self.paused {
            self.paused = false;
            self.tell.news(News::Resumed);
        }
    }

    fn edit(&mut self, coefficients: &[Coefficients]) {
        let Some(loaded) = &mut self.loaded else { return };
        if coefficients.len() != loaded.patches.blocks.len() {
            return;
        }
        let mut patches = (*loaded.patches).clone();
        give(&mut patches, coefficients);
        let emission_changed = patches.emission != loaded.patches.emission;
        loaded.patches = Arc::new(patches);
        (self.answer, self.error_wanted) = (None, false);
        if self.known.radiosity.is_some() {
            // An answer follows the edit at once, from where it stands.
            self.goal = Some(Goal { solver: self.answered_by, from_last: true });
            self.spent = Duration::ZERO;
            self.resume();
            return;
        }
        // Half an answer goes on with the rows that it has.
        if emission_changed {
            self.known.light_anew(&loaded.patches.emission);
        }
        if self.goal.is_none() || self.paused {
            let light = self.light_so_far();
            self.tell.last_light(light);
        }
    }

    fn inspect(&mut self, patch: u32) -> Result<(), Trouble> {
        let Some(loaded) = &self.loaded else { return Ok(()) };
        if patch as usize >= loaded.patches.len() {
            return Ok(());
        }
        let hemicube = hemicube(loaded, &self.request)?;
        let mut scratch = hemicube::Scratch::default();
        let faces = Face::ALL.map(|face| hemicube.face(patch as usize, face, &mut scratch));
        let row = match self.known.row(patch as usize) {
            Some(row) => row.clone(),
            None => row_finder(loaded, &self.request)?(patch as usize, &mut bake::Scratch::default()),
        };
        let weights = hemicube.weights().clone();
        let patches = loaded.patches.len();
        self.tell.news(News::Inspected(Box::new(Inspection { patch, row, faces, weights, patches })));
        Ok(())
    }

    /// Look for orders. What can be done beside the work is done at once; while paused, that is all there is. Anything
    /// else calls the worker away.
    fn look_up(&mut self) -> Result<(), CalledAway> {
        loop {
            if self.ended() {
                return Err(CalledAway);
            }
            let order = if self.paused {
                self.orders.recv().map_err(|_| CalledAway)?
            } else {
                match self.orders.try_recv() {
                    Ok(order) => order,
                    Err(TryRecvError::Empty) => return Ok(()),
                    Err(TryRecvError::Disconnected) => return Err(CalledAway),
                }
            };
            match order {
                Order::Pause => self.pause(),
                Order::Resume => self.resume(),
                Order::Inspect(patch) => {
                    // It was a precision that the work itself has already taken.
                    let _ = self.inspect(patch);
                }
                other => {
                    self.waiting.push_back(other);
                    self.gather_edits();
                    return Err(CalledAway);
                }
            }
        }
    }

    /// Of edits that wait one after the other only the last counts.
    fn gather_edits(&mut self) {
        while let Some(Order::Edit(_)) = self.waiting.back() {
            match self.orders.try_recv() {
                Ok(newer @ Order::Edit(_)) => {
                    self.waiting.pop_back();
                    self.waiting.push_back(newer);
                }
                Ok(other) => self.waiting.push_back(other),
                Err(_) => return,
            }
        }
    }

    /// Work on the goal until it is reached or something else is to be done.
    fn pursue(&mut self) -> Result<(), Trouble> {
        let Some(loaded) = self.loaded.clone() else { return Ok(()) };
        let Some(goal) = self.goal else { return self.estimate(&loaded) };
        self.allow(&loaded)?;
        let shoots = goal.solver == Solver::Progressive;
        if !shoots {
            let missing = self.known.missing();
            if self.find_rows(&loaded, &missing, true)?.is_away() {
                return Ok(());
            }
            self.known.complete();
        }
        // The window offers two solvers of the engine's four.
        let outcome =
            if shoots { self.shoot(&loaded, goal.from_last)? } else { self.sweep(&loaded, goal.from_last)? };
        if outcome.is_away() || (self.request.correct && self.correct(&loaded, goal.solver)?.is_away()) {
            return Ok(());
        }
        self.goal = None;
        self.tell.news(News::Done { seconds: self.spent.as_secs_f64() });
        Ok(())
    }

    /// Send after what patches hide that send evenly. The next edit begins from the answer without.
    fn correct(&mut self, loaded: &Loaded, solver: Solver) -> Result<Outcome, Trouble> {
        let Some(answer) = self.answer.take() else { return Ok(Outcome::CalledAway) };
        // Shots may have needed only some of the rows.
        let missing = self.known.missing();
        if self.find_rows(loaded, &missing, false)?.is_away() {
            return Ok(Outcome::CalledAway);
        }
        self.known.complete();
        let factors = self.known.factors.clone().unwrap_or_default();
        let Loaded { scene, patches, facets, .. } = loaded;
        let (request, run) = (Request { solver, ..self.request }, self.run);
        let begun = Instant::now();
        let mut watch = |progress: &Progress| {
            if let &Progress::Looks { done, total } = progress {
                self.tell.stage(|| Stage::Correction { done, total });
            }
            if self.look_up().is_err() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let corrected =
            bake::corrected(scene, patches, facets, &*factors, answer, &request, &run, &mut watch);
        self.spent += begun.elapsed();
        let answer = match corrected {
            Ok((answer, _)) => answer,
            Err(BakeError::Interrupted(_)) => return Ok(Outcome::CalledAway),
            Err(other) => return Err(other.into()),
        };
        let light = Light {
            irradiance: Some(Arc::new(answer.irradiance.clone())),
            history: Arc::new(answer.history.clone()),
            complete: true,
            iterations: answer.iterations,
            ..self.light_of(patches, answer.radiosity.clone())
        };
        self.answer = Some(answer);
        self.tell.last_light(light);
        Ok(Outcome::Reached)
    }

    /// Tell how far the answer may be off.
    fn estimate(&mut self, loaded: &Loaded) -> Result<(), Trouble> {
        let Some(answer) = self.answer.clone() else {
            self.error_wanted = false;
            return Ok(());
        };
        // Shots may have needed only some of the rows.
        self.allow(loaded)?;
        let missing = self.known.missing();
        if self.find_rows(loaded, &missing, false)?.is_away() {
            return Ok(());
        }
        self.known.complete();
        let factors = self.known.factors.clone().unwrap_or_default();
        let Loaded { scene, patches, facets, .. } = loaded;
        let (request, run) = (self.request, self.run);
        let mut watch = |progress: &Progress| {
            if let &Progress::Looks { done, total } = progress {
                self.tell.stage(|| Stage::Looks { done, total });
            }
            if self.look_up().is_err() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        match bake::error(scene, patches, facets, &*factors, &answer, &request, &run, &mut watch) {
            Ok(estimate) => {
                let overall = estimate.overall(patches, &answer);
                self.error_wanted = false;
                self.tell.news(News::Error(Arc::new(AnswerError { estimate, overall })));
                Ok(())
            }
            // The order that called away tells whether it is still wanted.
            Err(BakeError::Interrupted(_)) => Ok(()),
            Err(other) => Err(other.into()),
        }
    }

    /// Refuse what would take more memory than there is.
    fn allow(&mut self, loaded: &Loaded) -> Result<(), Trouble> {
        if !self.known.allowed {
            bake::allow(bake::need(&loaded.patches, &loaded.facets, &self.request)?, &self.run)?;
            self.known.allowed = true;
        }
        Ok(())
    }

    /// Find the rows `wanted`, on every core, showing the direct light of those that are there.
    fn find_rows(&mut self, loaded: &Loaded, wanted: &[u32], show: bool) -> Result<Outcome, Trouble> {
        let find = row_finder(loaded, &self.request)?;
        let total = loaded.patches.len();
        let mut wanted = wanted.to_vec();
        while !wanted.is_empty() {
            let (already, begun) = (total - wanted.len(), Instant::now());
            let mut done = 0;
            let mut away = false;
            let _ = compute_rows_of(
                &wanted,
                self.run.threads.unwrap_or(0),
                bake::Scratch::default,
                &find,
                |patch, row| {
                    self.known.keep(patch, row, &loaded.patches.emission);
                    done += 1;
                    if show {
                        let left = begun.elapsed().mul_f64((wanted.len() - done) as f64 / done as f64);
                        let left = (done >= 16 || done * 20 > total).then_some(left);
                        self.tell.stage(|| Stage::Rows { done: already + done, total, left });
                        if self.tell.light_is_due() {
                            let light = self.light_so_far();
                            self.tell.last_light(light);
                        }
                    }
                    // A pause is waited for outside: the other threads are to stop too.
                    if self.paused {
                        return ControlFlow::Break(());
                    }
                    match self.orders.try_recv() {
                        Ok(Order::Inspect(patch)) => {
                            let _ = self.inspect(patch);
                        }
                        Ok(Order::Pause) => {
                            self.pause();
                            return ControlFlow::Break(());
                        }
                        Ok(Order::Resume) => self.resume(),
                        Ok(other) => {
                            self.waiting.push_back(other);
                            self.gather_edits();
                            away = true;
                            return ControlFlow::Break(());
                        }
                        Err(TryRecvError::Disconnected) => {
                            away = true;
                            return ControlFlow::Break(());
                        }
                        Err(TryRecvError::Empty) => {}
                    }
                    if self.ended() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
                },
            );
            self.spent += begun.elapsed();
            if show && self.paused {
                let light = self.light_so_far();
                self.tell.last_light(light);
            }
            if away || self.look_up().is_err() {
                return Ok(Outcome::CalledAway);
            }
            wanted.retain(|&patch| self.known.rows[patch as usize].is_none());
        }
        Ok(Outcome::Reached)
    }

    /// The light while rows are being found: what a patch whose row is there has from the emitters directly; of the
    /// others their emission.
    fn light_so_far(&self) -> Light {
        let Some(loaded) = &self.loaded else { return Light::default() };
        let patches = &loaded.patches;
        let lit = (0..patches.len()).map(|i| {
            let direct = self.known.direct[i].unwrap_or_default();
            patches.emission[i] + patches.reflectance[i] * direct
        });
        Light { radiosity: Arc::new(lit.collect()), ..self.light_of(patches, Vec::new()) }
    }

    fn light_of(&self, patches: &Arc<Patches>, radiosity: Vec<Rgb>) -> Light {
        Light {
            patches: patches.clone(),
            radiosity: Arc::new(radiosity),
            direct: Arc::new(self.known.direct.clone()),
            row_sum: Arc::new(self.known.row_sum.clone()),
            ..Light::default()
        }
    }

    /// Gauss-Seidel, sweep by sweep: the same steps as `solve::gauss_seidel`, so the same bits.
    fn sweep(&mut self, loaded: &Loaded, from_last: bool) -> Result<Outcome, Trouble> {
        let last = self.known.radiosity.take().filter(|_| from_last);
        let emission_changed = last.is_some();
        let factors = self.known.factors.clone().unwrap_or_default();
        let outcome = self.sweep_with(loaded, &factors, last);
        let (mut light, solution) = match outcome {
            Ok(Some(reached)) => reached,
            Ok(None) => return Ok(Outcome::CalledAway),
            Err(trouble) => return Err(trouble),
        };
        self.known.radiosity = Some(solution);
        self.answered_by = Solver::GaussSeidel;
        if emission_changed {
            self.known.light_anew(&loaded.patches.emission);
            light.direct = Arc::new(self.known.direct.clone());
        }
        self.tell.last_light(light);
        Ok(Outcome::Reached)
    }

    /// The light and the radiosities, or `None` where the worker was called away.
    fn sweep_with(
        &mut self,
        loaded: &Loaded,
        factors: &FormFactors,
        last: Option<Vec<Rgb>>,
    ) -> Result<Option<(Light, Vec<Rgb>)>, Trouble> {
        let patches = &loaded.patches;
        let mut solver = match last {
            Some(last) => GaussSeidel::from(patches, factors, last),
            None => GaussSeidel::new(patches, factors),
        };
        let epsilon = self.request.epsilon;
        let mut taken = Duration::ZERO;
        loop {
            let begun = Instant::now();
            let residual = solver.step();
            let converged = solver.converged(epsilon);
            let history = solver.history();
            let done = history.len();
            taken += begun.elapsed();
            self.spent += begun.elapsed();
            if converged.map_err(BakeError::Solve)? {
                let history = Arc::new(history.to_vec());
                let solution = solver.into_solution();
                self.answer = Some(solution.clone());
                let light = Light {
                    irradiance: Some(Arc::new(solution.irradiance)),
                    history,
                    complete: true,
                    iterations: done,
                    ..self.light_of(patches, solution.radiosity.clone())
                };
                return Ok(Some((light, solution.radiosity)));
            }
            let left = sweeps_left(history, epsilon).map(|sweeps| taken.mul_f64(sweeps / done as f64));
            self.tell.stage(|| Stage::Sweeps { done, residual, left });
            if self.tell.light_is_due() {
                let light = Light {
                    history: Arc::new(history.to_vec()),
                    iterations: done,
                    ..self.light_of(patches, solver.radiosity().to_vec())
                };
                self.tell.last_light(light);
            }
            if self.look_up().is_err() {
                // An edit begins from what has been reached.
                self.answered_by = Solver::GaussSeidel;
                self.known.radiosity = Some(solver.radiosity().to_vec());
                return Ok(None);
            }
        }
    }

    /// Progressive refinement, shot by shot: the same shots as `solve::progressive`, so the same bits. Rows are found
    /// when a shot needs them, and those that the next shots are likely to need along with them.
    fn shoot(&mut self, loaded: &Loaded, from_last: bool) -> Result<Outcome, Trouble> {
        let patches = loaded.patches.clone();
        let count = patches.len();
        let epsilon = self.request.epsilon;
        let mut solver = Progressive::new(&patches);
        let quiet = self.known.radiosity.take().filter(|_| from_last).map(|_| Instant::now());
        let mut rows = count - self.known.missing().len();
        while let Some(shooter) = solver.next_shooter() {
            let begun = Instant::now();
            if self.known.row(shooter).is_none() {
                let wanted = self.next_rows(&solver, &patches, shooter);
                let spent = self.spent;
                if self.find_rows(loaded, &wanted, false)?.is_away() {
                    return Ok(Outcome::CalledAway);
                }
                self.spent = spent;
                rows += wanted.len();
            }
            let Some(row) = self.known.row(shooter) else { return Ok(Outcome::CalledAway) };
            solver.shoot(shooter, row);
            let (shots, residual) = (solver.shots(), solver.residual());
            self.spent += begun.elapsed();
            if solver.converged(residual, epsilon).map_err(BakeError::Solve)? {
                break;
            }
            self.tell.stage(|| Stage::Shots { done: shots, residual, rows, total: count });
            if quiet.is_none_or(|begun| begun.elapsed() > QUIET) && self.tell.light_is_due() {
                let mut history = solver.history().to_vec();
                history.push(residual);
                let light = Light {
                    history: Arc::new(history),
                    iterations: shots,
                    ..self.light_of(&patches, solver.display_radiosity())
                };
                self.tell.last_light(light);
            }
            if self.look_up().is_err() {
                // The next edit is quiet too.
                self.known.radiosity = quiet.map(|_| Vec::new());
                return Ok(Outcome::CalledAway);
            }
        }
        let answer = solver.into_solution();
        self.answer = Some(answer.clone());
        let Solution { radiosity, irradiance, iterations, history } = answer;
        if quiet.is_some() {
            self.known.light_anew(&patches.emission);
        }
        let light = Light {
            irradiance: Some(Arc::new(irradiance)),
            history: Arc::new(history),
            complete: true,
            iterations,
            ..self.light_of(&patches, radiosity.clone())
        };
        self.known.radiosity = Some(radiosity);
        self.answered_by = Solver::Progressive;
        if rows == count {
            self.known.complete();
        }
        self.tell.last_light(light);
        Ok(Outcome::Reached)
    }

    /// The row that is needed now, and for each thread some of those with the most power to shoot.
    fn next_rows(&self, solver: &Progressive<'_>, patches: &Patches, shooter: usize) -> Vec<u32> {
        let cores = || std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        let ahead = ROWS_AHEAD * self.run.threads.unwrap_or_else(cores);
        let power = |patch: usize| {
            let Rgb { r, g, b } = solver.unshot()[patch];
            (r + g + b) * patches.area[patch]
        };
        let mut missing = self.known.missing();
        missing.retain(|&patch| power(patch as usize) > 0.0 && patch as usize != shooter);
        missing.sort_by(|&a, &b| power(b as usize).total_cmp(&power(a as usize)));
        missing.truncate(ahead - 1);
        missing.insert(0, shooter as u32);
        missing
    }
}

impl Outcome {
    fn is_away(&self) -> bool {
        matches!(self, Self::CalledAway)
    }
}

/// Read a scene; what reads it has never seen the file, and may have a fault of its own.
fn read(path: &Path) -> Result<Scene, Trouble> {
    scene::read(path).map_err(Trouble::Scene)
}

fn hemicube<'a>(loaded: &'a Loaded, request: &Request) -> Result<Hemicube<'a>, Trouble> {
    let precision = request.method.precision().unwrap_or(SHOWN_PRECISION);
    let weights = CellWeights::new(precision).ok_or_else(|| {
        BakeError::BadRequest(format!("a hemicube of precision {precision} cannot be built"))
    })?;
    let back_faces = request.back_faces.unwrap_or(loaded.scene.back_faces);
    Ok(Hemicube::new(&loaded.patches, &loaded.facets, back_faces, weights))
}

fn row_finder<'a>(loaded: &'a Loaded, request: &Request) -> Result<bake::RowFinder<'a>, Trouble> {
    let back_faces = request.back_faces.unwrap_or(loaded.scene.back_faces);
    Ok(bake::row_finder(&loaded.patches, &loaded.facets, request, back_faces)?)
}

/// Whether form factors of one are form factors of the other.
fn same_geometry(one: &Scene, other: &Scene) -> bool {
    one.back_faces == other.back_faces
        && one.surfaces.len() == other.surfaces.len()
        && one.surfaces.iter().zip(&other.surfaces).all(|(one, other)| one.shape == other.shape)
}

/// The coefficients of each surface's patches.
pub(crate) fn coefficients_of(patches: &Patches) -> Vec<Coefficients> {
    let of = |first: usize| Coefficients {
        emission: patches.emission.get(first).copied().unwrap_or_default(),
        reflectance: patches.reflectance.get(first).copied().unwrap_or_default(),
    };
    patches.blocks.iter().map(|block| of(block.first as usize)).collect()
}

/// Give the patches of each surface its coefficients. A surface whose own are not changed stays as it is, textures and
/// all.
fn give(patches: &mut Patches, coefficients: &[Coefficients]) {
    let before = coefficients_of(patches);
    for ((block, coefficients), before) in patches.blocks.clone().iter().zip(coefficients).zip(&before) {
        if coefficients == before {
            continue;
        }
        patches.emission[block.patches()].fill(coefficients.emission);
        patches.reflectance[block.patches()].fill(coefficients.reflectance);
    }
}

/// How many more sweeps it takes at the pace of the last few.
fn sweeps_left(history: &[f64], epsilon: f64) -> Option<f64> {
    let [.., now] = *history else { return None };
    let back = history.len().checked_sub(5)?;
    let pace = (now / history[back]).ln() / (history.len() - 1 - back) as f64;
    (pace < 0.0).then(|| ((epsilon / now).ln() / pace).max(0.0))
}
