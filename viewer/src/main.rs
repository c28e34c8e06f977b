//! The window: open a scene, watch its radiosity arrive, walk through the light.

mod action;
mod app;
mod dialogs;
mod hemicube_panel;
mod language;
mod menu;
mod panels;
mod quantities;
mod residual_plot;
mod saving;
mod scene_file;
mod session;
mod settings;
#[cfg(test)]
mod tests;
mod view3d;
mod worker;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, ValueEnum};
use eframe::egui;
use radiosity::bake::Solver;
use radiosity::form_factors::hemicube::PRECISIONS;

use crate::app::{App, MethodName, Start};
use crate::language::Language;

/// Open a scene in a window, find its radiosity, and walk through the light.
#[derive(Debug, Parser)]
#[command(name = "radiosity-viewer", version)]
struct Arguments {
    /// The scene to open (.scn, .obj, .gltf, .glb)
    scene: Option<PathBuf>,
    /// Cells along a side of the hemicube; even
    #[arg(long, value_name = "N", value_parser = precision)]
    precision: Option<u32>,
    /// How form factors are found
    #[arg(long, value_name = "METHOD", default_value = "hemicube")]
    method: MethodName,
    /// Of exact and hemicube-exact: find what patches hide that send light evenly, and send it after
    #[arg(long)]
    correct: bool,
    /// Every number of patches is multiplied by this
    #[arg(long, value_name = "F", value_parser = positive)]
    subdivision: Option<f64>,
    /// Find the radiosity at once, by this solver
    #[arg(long, value_name = "SOLVER")]
    solve: Option<SolverName>,
    /// The window's language, instead of the system's
    #[arg(long, value_name = "fr|en")]
    language: Option<LanguageName>,
    /// The window's size, in points
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<[f32; 2]>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum SolverName {
    GaussSeidel,
    Progressive,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum LanguageName {
    Fr,
    En,
}

fn precision(typed: &str) -> Result<u32, String> {
    let (least, most) = (PRECISIONS.start(), PRECISIONS.end());
    let number: Option<u32> = typed.parse().ok();
    number
        .filter(|number| PRECISIONS.contains(number) && number.is_multiple_of(2))
        .ok_or_else(|| format!("an even number from {least} to {most} is needed"))
}

fn positive(typed: &str) -> Result<f64, String> {
    let number: Option<f64> = typed.parse().ok();
    number
        .filter(|number| number.is_finite() && *number > 0.0)
        .ok_or_else(|| "a number above 0 is needed".into())
}

fn size(typed: &str) -> Result<[f32; 2], String> {
    let sides = typed.split_once(['x', 'X', '×']);
    let sides = sides.and_then(|(width, height)| Some([width.parse().ok()?, height.parse().ok()?]));
    sides
        .filter(|sides: &[f32; 2]| sides.iter().all(|side| (1.0..=16384.0).contains(side)))
        .ok_or_else(|| "two numbers are needed, as in 1280x800".into())
}

/// Where there is no display, or none that can be drawn to.
const NO_WINDOW: &str = "no window can be opened here";
const INSTEAD: &str = "use `radiosity render SCENE -o PICTURE.png` to make a picture without one";

/// Whether there is a display to open a window on.
fn has_display() -> bool {
    let named = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    !cfg!(all(unix, not(target_os = "macos")))
        || named("DISPLAY")
        || named("WAYLAND_DISPLAY")
        || named("WAYLAND_SOCKET")
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    if arguments.correct && arguments.method == MethodName::Hemicube {
        let message = "--correct is for --method exact and hemicube-exact: choose one of these";
        Arguments::command().error(ErrorKind::ArgumentConflict, message).exit();
    }
    if !has_display() {
        eprintln!("error: {NO_WINDOW}, for there is no display: {INSTEAD}");
        return ExitCode::FAILURE;
    }
    let start = Start {
        scene: arguments.scene.map(|path| std::path::absolute(&path).unwrap_or(path)),
        precision: arguments.precision,
        method: arguments.method,
        correct: arguments.correct,
        subdivision: arguments.subdivision,
        solve: arguments.solve.map(|solver| match solver {
            SolverName::GaussSeidel => Solver::GaussSeidel,
            SolverName::Progressive => Solver::Progressive,
        }),
        language: arguments.language.map(|language| match language {
            LanguageName::Fr => Language::French,
            LanguageName::En => Language::English,
        }),
    };
    let size = arguments.size;
    let mut viewport = egui::ViewportBuilder::default()
        .with_app_id("radiosity-viewer")
        .with_title("radiosity")
        .with_min_inner_size([320.0, 240.0])
        .with_inner_size(size.unwrap_or([1280.0, 800.0]));
    viewport.drag_and_drop = Some(true);
    let options = eframe::NativeOptions {
        viewport,
        renderer: eframe::Renderer::Glow,
        // A size that is asked for goes before the one that is remembered.
        persist_window: size.is_none(),
        ..Default::default()
    };
    let begin = Box::new(move |context: &eframe::CreationContext<'_>| {
        let settings = App::remembered(context.storage);
        Ok(Box::new(App::new(&start, settings, &context.egui_ctx)) as Box<dyn eframe::App>)
    });
    match eframe::run_native("radiosity-viewer", options, begin) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let why = match error {
                eframe::Error::Winit(_) | eframe::Error::WinitEventLoop(_) => {
                    "the display does not answer".into()
                }
                eframe::Error::Glutin(_) | eframe::Error::NoGlutinConfigs(..) => {
                    "the display has no OpenGL".into()
                }
                other => other.to_string(),
            };
            eprintln!("error: {NO_WINDOW}, for {why}: {INSTEAD}");
            ExitCode::FAILURE
        }
    }
}

#[cfg(test)]
mod argument_tests {
    use super::*;

    #[test]
    fn arguments_are_checked() {
        assert_eq!(precision("100"), Ok(100));
        assert!(precision("31").is_err() && precision("0").is_err() && precision("x").is_err());
        assert!(positive("0").is_err() && positive("inf").is_err() && positive("2.5") == Ok(2.5));
        assert_eq!(size("1280x800"), Ok([1280.0, 800.0]));
        assert!(size("1280").is_err() && size("0x0").is_err() && size("NaNx3").is_err());
    }
}
