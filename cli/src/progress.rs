//! A progress bar on a terminal, and nothing anywhere else.

use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use radiosity::watch::Progress;

use crate::interrupt;
use crate::numbers::seconds;

/// A job shorter than this shows no bar: it would only flicker.
const PATIENCE: Duration = Duration::from_millis(300);
/// The engine may tell of every row; eyes do not need more than this.
const BETWEEN_DRAWINGS: Duration = Duration::from_millis(80);
/// Steps of the solver's bar, which shows a logarithm and counts nothing.
const STEPS: u64 = 1000;

/// The bar that stands on the screen, for whoever has to wipe it off without holding the [`Bar`].
static SHOWN: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// Wipe any bar off the screen, for other lines to follow.
pub(crate) fn wipe() {
    let shown = SHOWN.lock().ok().and_then(|mut shown| shown.take());
    if let Some(bar) = shown {
        bar.finish_and_clear();
    }
}

/// What watches a computation for the person at the terminal.
pub(crate) struct Bar {
    /// Whether there is anybody to draw for.
    wanted: bool,
    started: Instant,
    drawn: Instant,
    stage: Option<(Stage, ProgressBar)>,
    /// The residual after the first sweep, where the solver's bar begins.
    first_residual: f64,
}

#[derive(Clone, Copy, PartialEq)]
enum Stage {
    FormFactors,
    Solve,
    Looks,
    Picture,
}

impl Bar {
    pub(crate) fn new(quiet: bool) -> Self {
        let now = Instant::now();
        Self { wanted: wanted(quiet), started: now, drawn: now, stage: None, first_residual: f64::NAN }
    }

    /// The engine's watch: asked between steps, it answers whether to go on.
    pub(crate) fn watch(&mut self, progress: &Progress) -> ControlFlow<()> {
        if interrupt::requested() {
            self.clear();
            return ControlFlow::Break(());
        }
        if let Progress::Solve { iteration: 1, residual, .. } = *progress {
            self.first_residual = residual;
        }
        if self.wanted && self.started.elapsed() >= PATIENCE && self.drawn.elapsed() >= BETWEEN_DRAWINGS {
            self.draw(progress);
            self.drawn = Instant::now();
        }
        ControlFlow::Continue(())
    }

    /// Wipe the bar off the screen, for other lines to follow.
    pub(crate) fn clear(&mut self) {
        self.stage = None;
        wipe();
    }

    fn draw(&mut self, progress: &Progress) {
        match *progress {
            Progress::FormFactors { done, total } => {
                let left = time_left(self.started.elapsed(), done, total);
                let bar = self.bar(Stage::FormFactors, total as u64);
                bar.set_position(done as u64);
                bar.set_message(left);
            }
            Progress::Looks { done, total } => {
                let left = time_left(self.started.elapsed(), done, total);
                let bar = self.bar(Stage::Looks, total as u64);
                bar.set_position(done as u64);
                bar.set_message(left);
            }
            Progress::Picture { done, total } => {
                let left = time_left(self.started.elapsed(), done, total);
                let bar = self.bar(Stage::Picture, total as u64);
                bar.set_position(done as u64);
                bar.set_message(left);
            }
            Progress::Solve { iteration, residual, epsilon } => {
                let share = share_of_way(self.first_residual, residual, epsilon);
                let bar = self.bar(Stage::Solve, STEPS);
                bar.set_position((share * STEPS as f64) as u64);
                bar.set_message(format!("step {iteration}, residual {residual:.1e}, down to {epsilon:.0e}"));
            }
        }
    }

    fn bar(&mut self, stage: Stage, length: u64) -> &ProgressBar {
        if self.stage.as_ref().is_none_or(|(now, _)| *now != stage) {
            self.clear();
        }
        &self
            .stage
            .get_or_insert_with(|| {
                let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr());
                bar.set_style(style(stage));
                if let Ok(mut shown) = SHOWN.lock() {
                    *shown = Some(bar.clone());
                }
                (stage, bar)
            })
            .1
    }
}

/// Whether there is anybody to draw for.
fn wanted(quiet: bool) -> bool {
    let dumb = std::env::var_os("TERM").is_some_and(|terminal| terminal == "dumb");
    !quiet && !dumb && std::io::stderr().is_terminal()
}

/// Do some work that does not tell how far it is: what it does stands on the screen with a clock, once it takes long.
pub(crate) fn clocked<T>(quiet: bool, what: &'static str, work: impl FnOnce() -> T) -> T {
    if !wanted(quiet) {
        return work();
    }
    std::thread::scope(|scope| {
        let (done, ended) = mpsc::channel::<()>();
        scope.spawn(move || {
            if ended.recv_timeout(PATIENCE) != Err(RecvTimeoutError::Timeout) {
                return;
            }
            let clock = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
            let style = ProgressStyle::with_template("{msg}, {elapsed}");
            clock.set_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
            clock.set_message(what);
            if let Ok(mut shown) = SHOWN.lock() {
                *shown = Some(clock.clone());
            }
            clock.enable_steady_tick(BETWEEN_DRAWINGS);
            // Until the other end is dropped.
            let _ = ended.recv();
            wipe();
        });
        let result = work();
        drop(done);
        result
    })
}

/// What is left of a job whose steps all take about as long: `, 12.3 s left`. Nothing before there is enough to go by.
fn time_left(elapsed: Duration, done: usize, total: usize) -> String {
    if done < 3 {
        return String::new();
    }
    let left = elapsed.as_secs_f64() / done as f64 * total.saturating_sub(done) as f64;
    // Hundredths of a second are not known, and would only flicker.
    if left < 9.5 { format!(", {left:.0} s left") } else { format!(", {} left", seconds(left.round())) }
}

/// How far a residual has fallen from its first value to epsilon, by its logarithm: 0 to 1.
fn share_of_way(first: f64, residual: f64, epsilon: f64) -> f64 {
    let share = (first / residual).ln() / (first / epsilon).ln();
    if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 }
}

fn style(stage: Stage) -> ProgressStyle {
    let template = match stage {
        Stage::FormFactors => "form factors {wide_bar} {human_pos} of {human_len} rows{msg}",
        Stage::Solve => "solve        {wide_bar} {msg}",
        Stage::Looks => "second looks {wide_bar} {human_pos} of {human_len} places{msg}",
        Stage::Picture => "picture      {wide_bar} {human_pos} of {human_len} rows of pixels{msg}",
    };
    let characters = if unicode() { "━╸ " } else { "=> " };
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    style.progress_chars(characters)
}

/// Whether the user's language setting says that the terminal shows more than ASCII.
fn unicode() -> bool {
    let mut settings = ["LC_ALL", "LC_CTYPE", "LANG"].into_iter().filter_map(std::env::var_os);
    let decides = settings.find(|value| !value.is_empty()).unwrap_or_default();
    let decides = decides.to_string_lossy().to_lowercase();
    cfg!(windows) || decides.contains("utf-8") || decides.contains("utf8")
}

#[cfg(test)]
mod tests {
    use super::share_of_way;

    #[test]
    fn the_solver_s_bar_grows_with_each_digit() {
        assert_eq!(share_of_way(1.0, 1.0, 1e-6), 0.0);
        assert!((share_of_way(1.0, 1e-3, 1e-6) - 0.5).abs() < 1e-12);
        assert_eq!(share_of_way(1.0, 1e-7, 1e-6), 1.0);
    }

    #[test]
    fn the_solver_s_bar_survives_every_residual() {
        for (first, residual) in [(0.0, 0.0), (f64::NAN, 1.0), (1.0, f64::INFINITY), (1e-6, 1e-6), (1.0, 9.0)]
        {
            let share = share_of_way(first, residual, 1e-6);
            assert!((0.0..=1.0).contains(&share), "{first} {residual}: {share}");
        }
    }
}
