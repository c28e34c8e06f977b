//! `radiosity solve`: the light, as a row of numbers for each patch or as a model to walk about in.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, anyhow};
use radiosity::bake;
use radiosity::export::{self, GltfForm, LightMap, SolvedScene};
use radiosity::patches::Patches;
use radiosity::scene::n3d;
use radiosity::shade::{self, Atlas, ShadedSurfaces, Shading, ToneMap};
use radiosity::visibility::Facets;

use crate::args::{self, Solve};
use crate::failure::Failure;
use crate::job::{self, Job};
use crate::numbers::{bytes, grouped, measure};
use crate::report::Done;
use crate::{diagnostics, interrupt, progress, stages};

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
    let mut job = Job::new(&typed.common)?.refined(&typed.target);
    job.request.error = typed.error;
    job.check_output(output, typed.camera.as_deref())?;
    let looks = typed.camera.is_some() || typed.exposure.is_some() || typed.tone_curve.is_some();
    if looks && !matches!(format, Format::Gltf(_)) && !job.quiet {
        diagnostics::warning(
            "--camera, --exposure and --tone-curve are for a .glb or .gltf: they play no part here",
        );
    }

    check_light_map(typed, &job, format)?;

    let scene = stages::read(&job)?;
    let view = typed.camera.as_deref().map(n3d::read_view).transpose()?;
    let (patches, facets) = stages::patches(&job, &scene)?;
    let threads = rayon::ThreadPoolBuilder::new().num_threads(job.threads).build();
    let threads = threads.context("cannot start threads")?;
    // Now, for what cannot be laid out need not be solved.
    let laid_out = |patches: &Patches, facets: &Facets, side| {
        progress::clocked(job.quiet, "light map    surfaces made flat and packed", || {
            threads.install(|| Atlas::new(&scene, patches, facets, side))
        })
    };
    let atlas = typed.light_map.map(|side| laid_out(&patches, &facets, side));
    let mut atlas = atlas.transpose().map_err(anyhow::Error::new)?;
    interrupt::check()?;
    let (solved, done) = stages::solved(&job, &scene, patches, facets)?;
    let stages::Solved { patches, facets, solution, error } = solved;
    if let (Some(side), Some(_)) = (typed.light_map, job.target) {
        atlas = Some(laid_out(&patches, &facets, side).map_err(anyhow::Error::new)?);
        interrupt::check()?;
    }
    let error = error.as_ref();
    let done = Done::new(started, &scene, &patches, done);
    let Format::Gltf(form) = format else {
        return interrupt::writing(|| {
            match format {
                Format::Npz => export::write_solution_npz(output, &patches, &solution, error)?,
                Format::Vtu => export::write_vtu(output, &scene, &patches, &facets, &solution, error)?,
                _ => export::write_solution_csv(output, &patches, &solution, error)?,
            }
            done.tell(&job, output)
        });
    };

    let shaded = |light| ShadedSurfaces::new(&scene, &patches, &facets, light, Shading::Smooth);
    let exposure = typed.exposure.unwrap_or_else(|| shade::automatic_exposure(&patches, &solution.radiosity));
    let tone = ToneMap { exposure, curve: args::tone_curve(typed.tone_curve) };
    let baked = |atlas: &Atlas| {
        progress::clocked(job.quiet, "light map    baked", || {
            threads.install(|| atlas.screen_light_map(&shaded(&solution.radiosity), tone))
        })
    };
    let picture = atlas.as_ref().map(baked);
    interrupt::check()?;
    let camera = view.or(scene.camera).unwrap_or_else(|| shade::frame(&scene));
    let solved = SolvedScene {
        scene: &scene,
        patches: &patches,
        facets: &facets,
        solution: &solution,
        camera: &camera,
        tone,
        back_faces: job.request.back_faces.unwrap_or(scene.back_faces),
        light_map: atlas.as_ref().zip(picture.as_ref()).map(|(atlas, picture)| LightMap { atlas, picture }),
    };
    interrupt::writing(|| {
        export::write_gltf(output, &solved, form)?;
        for (file, light) in
            [(&typed.irradiance_map, &solution.irradiance), (&typed.radiosity_map, &solution.radiosity)]
        {
            if let (Some(file), Some(atlas)) = (file, &atlas) {
                let map = progress::clocked(job.quiet, "light map    baked", || {
                    threads.install(|| atlas.light_map(&shaded(light)))
                });
                export::write_exr(file, &map)?;
            }
        }
        let how = if typed.exposure.is_some() { "" } else { " (chosen)" };
        let curve = args::name(&typed.tone_curve.unwrap_or_default());
        let mut done = done.picture(format!("exposure {exposure:+.2} EV{how}, tone curve {curve}"));
        if let Some(atlas) = &atlas {
            done = done.light_map(told(atlas));
        }
        done.tell(&job, output)
    })
}

/// Whether a light map is asked for that can be made, and can be written without harm to other files.
fn check_light_map(typed: &Solve, job: &Job, format: Format) -> Result<(), Failure> {
    let Some(side) = typed.light_map else { return Ok(()) };
    if !matches!(format, Format::Gltf(_)) {
        let output = typed.output.display();
        return Err(Failure::Usage(format!("--light-map is for models: {output} must be a .glb or .gltf")));
    }
    let mut others: Vec<&Path> = vec![&typed.output];
    others.extend(typed.camera.as_deref());
    for (option, file) in
        [("--irradiance-map", &typed.irradiance_map), ("--radiosity-map", &typed.radiosity_map)]
    {
        let Some(file) = file else { continue };
        if file.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("exr")) {
            return Err(Failure::Usage(format!("{option} {}: the name must end in .exr", file.display())));
        }
        job.check_written(option, file, &others)?;
        others.push(file);
    }
    let (needed, limit) = (Atlas::bytes(side), bake::memory_limit(&job.run));
    if needed > limit {
        return Err(anyhow!(
            "a light map of {side} x {side} texels would need {} to make, and the limit is {}: use a smaller --light-map, \
             or raise --memory-limit",
            bytes(needed),
            bytes(limit)
        )
        .into());
    }
    Ok(())
}

/// An atlas in a line.
fn told(atlas: &Atlas) -> String {
    let [width, height] = atlas.size();
    format!(
        "{} x {} texels, {} charts, {} texels a unit of length",
        grouped(width),
        grouped(height),
        grouped(atlas.charts()),
        measure((atlas.density() * 100.0).round() / 100.0)
    )
}
