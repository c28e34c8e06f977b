//! `radiosity solve`: the light, as a row of numbers for each patch or as a model to walk about in.

use std::time::Instant;

use radiosity::export::{self, GltfForm, SolvedScene};
use radiosity::scene::n3d;
use radiosity::shade::{self, ToneMap};

use crate::args::{self, Solve};
use crate::failure::Failure;
use crate::job::{self, Job};
use crate::report::Done;
use crate::{diagnostics, interrupt, stages};

#[derive(Clone, Copy)]
enum Format {
    Csv,
    Npz,
    Gltf(GltfForm),
    Vtu,
}

/// Every ending, and what it stands for.
const FORMATS: [(&str, Format); 5] = [
    ("csv", Format::Csv),
    ("npz", Format::Npz),
    ("glb", Format::Gltf(GltfForm::Binary)),
    ("gltf", Format::Gltf(GltfForm::Text)),
    ("vtu", Format::Vtu),
];

pub(crate) fn run(typed: &Solve) -> Result<(), Failure> {
    let started = Instant::now();
    let output = &typed.output;
    let format = job::format(output, &FORMATS)?;
    let job = Job::new(&typed.common)?;
    job.check_output(output, typed.camera.as_deref())?;
    let looks = typed.camera.is_some() || typed.exposure.is_some() || typed.tone_curve.is_some();
    if looks && !matches!(format, Format::Gltf(_)) && !job.quiet {
        diagnostics::warning(
            "--camera, --exposure and --tone-curve are for a .glb or .gltf: they play no part here",
        );
    }

    let scene = stages::read(&job)?;
    let view = typed.camera.as_deref().map(n3d::read_view).transpose()?;
    let (patches, facets) = stages::patches(&job, &scene)?;
    let (rows, form_factors) = stages::rows(&job, &scene, &patches, &facets)?;
    let (solution, solve) = stages::solve(&job, &patches, &rows)?;
    // A model can be large, and form factors are the largest of all.
    drop(rows);
    let mut done = Done::new(started, &scene, &patches, form_factors, Some(solve));
    interrupt::writing(|| {
        match format {
            Format::Csv => export::write_solution_csv(output, &patches, &solution)?,
            Format::Npz => export::write_solution_npz(output, &patches, &solution)?,
            Format::Vtu => export::write_vtu(output, &scene, &patches, &facets, &solution)?,
            Format::Gltf(form) => {
                let camera = view.or(scene.camera).unwrap_or_else(|| shade::frame(&scene));
                let chosen = || shade::automatic_exposure(&patches, &solution.radiosity);
                let exposure = typed.exposure.unwrap_or_else(chosen);
                let how = if typed.exposure.is_some() { "" } else { " (chosen)" };
                let curve = args::tone_curve(typed.tone_curve);
                let solved = SolvedScene {
                    scene: &scene,
                    patches: &patches,
                    facets: &facets,
                    solution: &solution,
                    camera: &camera,
                    tone: ToneMap { exposure, curve },
                    back_faces: job.request.back_faces.unwrap_or(scene.back_faces),
                };
                export::write_gltf(output, &solved, form)?;
                let curve = args::name(&typed.tone_curve.unwrap_or_default());
                done = done.picture(format!("exposure {exposure:+.2} EV{how}, tone curve {curve}"));
            }
        }
        done.tell(&job, output)
    })
}
