//! `radiosity render`: a picture of the solved scene.

use std::ops::ControlFlow;
use std::sync::Mutex;
use std::time::Instant;

use anyhow::{Context, anyhow};
use radiosity::scene::n3d;
use radiosity::shade::{
    self, FinalGather, GatherError, PictureError, PictureRequest, ShadedSurfaces, Shading, ToneMap,
};
use radiosity::watch::Progress;
use radiosity::{bake, export};

use crate::args::{self, Render, Size};
use crate::failure::Failure;
use crate::job::{self, Job};
use crate::numbers::bytes;
use crate::progress::Bar;
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
    let mut job = Job::new(&typed.common)?.refined(&typed.target);
    job.request.error = typed.error;
    job.check_output(output, typed.camera.as_deref())?;
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
    let (solved, done) = stages::solved(&job, &scene, patches, facets)?;
    let stages::Solved { patches, facets, solution, .. } = solved;

    let shaded = |shading| {
        Light::Shaded(Box::new(ShadedSurfaces::new(&scene, &patches, &facets, &solution.radiosity, shading)))
    };
    let request = PictureRequest {
        width: typed.size.width,
        height: typed.size.height,
        back_faces,
        ..PictureRequest::default()
    };
    let threads = rayon::ThreadPoolBuilder::new().num_threads(job.threads).build();
    let threads = threads.context("cannot start threads")?;
    let light = threads.install(|| match typed.shading {
        args::Shading::Gather => Light::Gathered(Box::new(FinalGather::new(
            &scene,
            &patches,
            &facets,
            &solution.radiosity,
            back_faces,
            job.request.surroundings,
        ))),
        args::Shading::Smooth => shaded(Shading::Smooth),
        args::Shading::Flat => shaded(Shading::Flat),
    });
    let what = format!("{} x {}, {}", request.width, request.height, args::name(&typed.shading));
    match format {
        Format::Png => {
            let chosen = || shade::automatic_exposure(&patches, &solution.radiosity);
            let exposure = typed.exposure.unwrap_or_else(chosen);
            let how = if typed.exposure.is_some() { "" } else { " (chosen)" };
            let tone = ToneMap { exposure, curve };
            let picture = match &light {
                Light::Shaded(surfaces) => threads
                    .install(|| shade::screen_picture(surfaces, &camera, &request, tone))
                    .map_err(failed)?,
                Light::Gathered(light) => watched(&job, |watch| {
                    threads.install(|| shade::gathered_screen_picture(light, &camera, &request, tone, watch))
                })?,
            };
            let curve = args::name(&typed.tone_curve.unwrap_or_default());
            let what = format!("{what}, exposure {exposure:+.2} EV{how}, tone curve {curve}");
            interrupt::writing(|| {
                export::write_png(output, &picture)?;
                Done::new(started, &scene, &patches, done).picture(what).tell(&job, output)
            })
        }
        Format::Exr => {
            let picture = match &light {
                Light::Shaded(surfaces) => {
                    threads.install(|| shade::picture(surfaces, &camera, &request)).map_err(failed)?
                }
                Light::Gathered(light) => watched(&job, |watch| {
                    threads.install(|| shade::gathered_picture(light, &camera, &request, watch))
                })?,
            };
            interrupt::writing(|| {
                export::write_exr(output, &picture)?;
                let what = format!("{what}, linear light");
                Done::new(started, &scene, &patches, done).picture(what).tell(&job, output)
            })
        }
    }
}

/// Where a picture's colours come from.
enum Light<'a> {
    Shaded(Box<ShadedSurfaces<'a>>),
    Gathered(Box<FinalGather<'a>>),
}

/// Gather a picture, with a progress bar, until it is done or Ctrl-C.
fn watched<T>(
    job: &Job,
    gather: impl FnOnce(&(dyn Fn(&Progress) -> ControlFlow<()> + Sync)) -> Result<T, GatherError>,
) -> Result<T, Failure> {
    let bar = Mutex::new(Bar::new(job.quiet));
    let found = gather(&|at| match bar.lock() {
        Ok(mut bar) => bar.watch(at),
        // A thread that panicked has told why.
        Err(_) => ControlFlow::Break(()),
    });
    if let Ok(mut bar) = bar.into_inner() {
        bar.clear();
    }
    found.map_err(|error| match error {
        GatherError::Interrupted(_) => Failure::Interrupted,
        GatherError::Picture(error) => failed(error),
    })
}

fn failed(error: PictureError) -> Failure {
    anyhow::Error::new(error).context("cannot make the picture").into()
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
