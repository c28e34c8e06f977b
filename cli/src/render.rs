//! `radiosity render`: a picture of the solved scene.

use std::time::Instant;

use anyhow::{Context, anyhow};
use radiosity::scene::n3d;
use radiosity::shade::{self, PictureRequest, ShadedSurfaces, Shading, ToneMap};
use radiosity::{bake, export};

use crate::args::{self, Render, Size};
use crate::failure::Failure;
use crate::job::{self, Job};
use crate::numbers::bytes;
use crate::report::Done;
use crate::{backs, diagnostics, interrupt, stages};

#[derive(Clone, Copy, PartialEq)]
enum Format {
    Png,
    Exr,
}

pub(crate) fn run(typed: &Render) -> Result<(), Failure> {
    let started = Instant::now();
    let output = &typed.output;
    let format = job::format(output, &[("png", Format::Png), ("exr", Format::Exr)])?;
    let mut job = Job::new(&typed.common)?;
    job.request.error = typed.error;
    job.check_output(output, typed.camera.as_deref())?;
    let shading = match typed.shading {
        args::Shading::Smooth => Shading::Smooth,
        args::Shading::Flat => Shading::Flat,
    };
    let curve = args::tone_curve(typed.tone_curve);
    if format == Format::Exr && (typed.exposure.is_some() || typed.tone_curve.is_some()) && !job.quiet {
        diagnostics::warning("a .exr holds the light itself: --exposure and --tone-curve play no part in it");
    }

    room_for_picture(&job, typed.size, format)?;

    let scene = stages::read(&job)?;
    let view = typed.camera.as_deref().map(n3d::read_view).transpose()?;
    let (patches, facets) = stages::patches(&job, &scene)?;
    let camera = view.or(scene.camera).unwrap_or_else(|| shade::frame(&scene));
    let back_faces = job.request.back_faces.unwrap_or(scene.back_faces);
    if let Some(backs) = backs::seen(&scene, &facets, &camera, back_faces).filter(|_| !job.quiet) {
        diagnostics::warning(&backs.told());
    }
    let (rows, form_factors) = stages::rows(&job, &scene, &patches, &facets)?;
    let (solution, solve) = stages::solve(&job, &patches, &rows)?;
    let error = stages::error(&job, &scene, &patches, &facets, &rows, &solution)?.map(|(_, done)| done);
    // A picture can be large, and form factors are the largest of all.
    drop(rows);

    let surfaces = ShadedSurfaces::new(&scene, &patches, &facets, &solution.radiosity, shading);
    let request = PictureRequest {
        width: typed.size.width,
        height: typed.size.height,
        back_faces,
        ..PictureRequest::default()
    };
    let threads = rayon::ThreadPoolBuilder::new().num_threads(job.threads).build();
    let threads = threads.context("cannot start threads")?;
    let what = format!("{} x {}, {}", request.width, request.height, args::name(&typed.shading));
    match format {
        Format::Png => {
            let chosen = || shade::automatic_exposure(&patches, &solution.radiosity);
            let exposure = typed.exposure.unwrap_or_else(chosen);
            let how = if typed.exposure.is_some() { "" } else { " (chosen)" };
            let tone = ToneMap { exposure, curve };
            let picture = threads.install(|| shade::screen_picture(&surfaces, &camera, &request, tone));
            let picture = picture.context("cannot make the picture")?;
            let curve = args::name(&typed.tone_curve.unwrap_or_default());
            let what = format!("{what}, exposure {exposure:+.2} EV{how}, tone curve {curve}");
            interrupt::writing(|| {
                export::write_png(output, &picture)?;
                Done::new(started, &scene, &patches, form_factors, Some(solve))
                    .error(error)
                    .picture(what)
                    .tell(&job, output)
            })
        }
        Format::Exr => {
            let picture = threads.install(|| shade::picture(&surfaces, &camera, &request));
            let picture = picture.context("cannot make the picture")?;
            interrupt::writing(|| {
                export::write_exr(output, &picture)?;
                let what = format!("{what}, linear light");
                Done::new(started, &scene, &patches, form_factors, Some(solve))
                    .error(error)
                    .picture(what)
                    .tell(&job, output)
            })
        }
    }
}

/// Refuse now what would run out of memory after all the rest is done.
fn room_for_picture(job: &Job, size: Size, format: Format) -> Result<(), Failure> {
    let bytes_per_pixel = match format {
        Format::Png => size_of::<[u8; 3]>(),
        Format::Exr => size_of::<[f32; 3]>(),
    };
    let needed = (size.width * size.height * bytes_per_pixel) as u64;
    let limit = bake::memory_limit(&job.run);
    if needed <= limit {
        return Ok(());
    }
    Err(anyhow!(
        "the picture alone would need {}, and the limit is {}: use a smaller --size, or raise --memory-limit",
        bytes(needed),
        bytes(limit)
    )
    .into())
}
