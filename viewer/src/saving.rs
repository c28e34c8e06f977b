//! Pictures and solutions to files, on a thread of their own.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use eframe::egui;
use radiosity::export::{self, GltfForm, SolvedScene};
use radiosity::light::Rgb;
use radiosity::patches::Patches;
use radiosity::scene::{BackFaces, Camera};
use radiosity::shade::{
    Picture, PictureRequest, ScreenPicture, ShadedSurfaces, Shading, ToneMap, linear_from_srgb, picture,
    screen_picture, srgb_from_linear,
};
use radiosity::solve::Solution;

use crate::quantities::place_in;
use crate::view3d::ColourMap;
use crate::worker::{AnswerError, Loaded};

/// A picture to be taken and saved.
pub(crate) struct PictureOrder {
    pub(crate) loaded: Loaded,
    /// One a patch.
    pub(crate) values: Vec<Rgb>,
    pub(crate) shading: Shading,
    pub(crate) camera: Camera,
    pub(crate) size: [usize; 2],
    pub(crate) sampling: u32,
    pub(crate) back_faces: BackFaces,
    pub(crate) colours: Colours,
}

/// A solution to be saved, and how it is looked at.
pub(crate) struct SolutionOrder {
    pub(crate) loaded: Loaded,
    /// With the lamps and colours that were solved for.
    pub(crate) patches: Arc<Patches>,
    pub(crate) solution: Solution,
    /// How far it may be off, where that is known.
    pub(crate) error: Option<Arc<AnswerError>>,
    pub(crate) camera: Camera,
    pub(crate) tone: ToneMap,
    pub(crate) back_faces: BackFaces,
}

/// How values become colours on a screen.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Colours {
    /// By exposure and tone curve.
    Toned(ToneMap),
    /// By a scale of false colours; the values are grey.
    False { map: ColourMap, range: [f64; 2], logarithmic: bool },
}

/// A file being written.
pub(crate) struct Saving {
    path: PathBuf,
    ended: Receiver<Result<(), String>>,
}

impl Saving {
    fn start(
        path: &Path,
        ctx: &egui::Context,
        write: impl FnOnce(&Path) -> Result<(), String> + Send + 'static,
    ) -> Self {
        let (sender, ended) = channel();
        let (ctx, to) = (ctx.clone(), path.to_owned());
        // Should no thread be had, the sender is dropped, and that is told as a failure.
        let _ = std::thread::Builder::new().name("saving".into()).spawn(move || {
            let _ = sender.send(write(&to));
            ctx.request_repaint();
        });
        Self { path: path.to_owned(), ended }
    }

    /// Take and save a picture: PNG as the screen shows it, EXR in linear light.
    pub(crate) fn picture(path: &Path, order: PictureOrder, ctx: &egui::Context) -> Self {
        Self::start(path, ctx, move |path| write_picture(path, &order))
    }

    /// Save a solution: as a table, a NumPy archive, a model lit as it is seen, or a grid for ParaView.
    pub(crate) fn solution(path: &Path, order: SolutionOrder, ctx: &egui::Context) -> Self {
        Self::start(path, ctx, move |path| write_solution(path, &order))
    }

    /// How it ended, once it has: the file, or why not.
    pub(crate) fn ended(&self) -> Option<Result<PathBuf, String>> {
        match self.ended.try_recv() {
            Ok(result) => Some(result.map(|()| self.path.clone())),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err(self.path.display().to_string())),
        }
    }
}

fn ending(path: &Path) -> String {
    path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default()
}

fn unknown(path: &Path, ending: &str, known: &str) -> String {
    format!("{}: “{ending}” ≠ {known}", path.display())
}

fn shaded<'a>(order: &'a PictureOrder, values: &'a [Rgb]) -> ShadedSurfaces<'a> {
    let Loaded { scene, patches, facets, .. } = &order.loaded;
    ShadedSurfaces::new(scene, patches, facets, values, order.shading)
}

/// Endings that a solution is saved under.
pub(crate) const SOLUTION_ENDINGS: [&str; 5] = ["csv", "npz", "glb", "gltf", "vtu"];

fn write_solution(path: &Path, order: &SolutionOrder) -> Result<(), String> {
    let SolutionOrder { loaded: Loaded { scene, facets, .. }, patches, solution, .. } = order;
    let error = order.error.as_deref().map(|error| &error.estimate);
    let gltf = |form| {
        let (camera, tone, back_faces) = (&order.camera, order.tone, order.back_faces);
        let light_map = None;
        let solved = SolvedScene { scene, patches, facets, solution, camera, tone, back_faces, light_map };
        export::write_gltf(path, &solved, form)
    };
    match ending(path).as_str() {
        "csv" => export::write_solution_csv(path, patches, solution, error),
        "npz" => export::write_solution_npz(path, patches, solution, error),
        "glb" => gltf(GltfForm::Binary),
        "gltf" => gltf(GltfForm::Text),
        "vtu" => export::write_vtu(path, scene, patches, facets, solution, error),
        other => {
            return Err(unknown(path, other, &SOLUTION_ENDINGS.map(|known| format!(".{known}")).join(", ")));
        }
    }
    .map_err(|error| error.to_string())
}

fn write_picture(path: &Path, order: &PictureOrder) -> Result<(), String> {
    let request = PictureRequest {
        width: order.size[0],
        height: order.size[1],
        sampling: order.sampling,
        back_faces: order.back_faces,
    };
    let text = |error: &dyn std::error::Error| error.to_string();
    match ending(path).as_str() {
        "exr" => {
            let picture =
                picture(&shaded(order, &order.values), &order.camera, &request).map_err(|e| text(&e))?;
            export::write_exr(path, &picture).map_err(|e| text(&e))
        }
        "png" => {
            let screen = match order.colours {
                Colours::Toned(tone) => {
                    screen_picture(&shaded(order, &order.values), &order.camera, &request, tone)
                        .map_err(|e| text(&e))?
                }
                Colours::False { map, range, logarithmic } => {
                    let take = |values: &[Rgb]| {
                        picture(&shaded(order, values), &order.camera, &request).map_err(|error| text(&error))
                    };
                    let ones = vec![Rgb::WHITE; order.values.len()];
                    let (values, cover) = (take(&order.values)?, take(&ones)?);
                    in_false_colours(&values, &cover, map, range, logarithmic)
                }
            };
            export::write_png(path, &screen).map_err(|e| text(&e))
        }
        other => Err(unknown(path, other, ".png, .exr")),
    }
}

/// `values` through the scale, over black where `cover` says that there is no surface.
fn in_false_colours(
    values: &Picture,
    cover: &Picture,
    map: ColourMap,
    range: [f64; 2],
    logarithmic: bool,
) -> ScreenPicture {
    let pixel = |(value, cover): (&[f32; 3], &[f32; 3])| {
        let share = cover[0];
        if share <= 0.0 {
            return [0; 3];
        }
        let shown = map.rgb(place_in(range, logarithmic, f64::from(value[0] / share)));
        shown.map(|byte| {
            let linear = linear_from_srgb(f32::from(byte) / 255.0) * share;
            (srgb_from_linear(linear) * 255.0 + 0.5) as u8
        })
    };
    ScreenPicture {
        width: values.width,
        height: values.height,
        pixels: values.pixels.iter().zip(&cover.pixels).map(pixel).collect(),
    }
}
