//! `radiosity render`: a picture of the solved scene.

use std::time::Instant;

use crate::args::Render;
use crate::failure::Failure;
use crate::job::{self, Job};
use crate::report::Done;
use crate::stages;

#[derive(Clone, Copy)]
enum Format {
    Png,
    Exr,
}

pub(crate) fn run(typed: &Render) -> Result<(), Failure> {
    let started = Instant::now();
    let output = &typed.output;
    let format = job::format(output, &[("png", Format::Png), ("exr", Format::Exr)])?;
    let job = Job::new(&typed.common)?;
    job.check_output(output)?;

    let scene = stages::read(&job)?;
    let (patches, facets) = stages::patches(&job, &scene)?;
    let (factors, form_factors) = stages::form_factors(&job, &scene, &patches, &facets)?;
    let (_solution, solve) = stages::solve(&job, &patches, &factors)?;
    match format {
        Format::Png | Format::Exr => return Err(anyhow::anyhow!("pictures are not written yet").into()),
    }
    #[expect(unreachable_code)]
    let done = Done {
        started,
        patches: patches.len(),
        surfaces: scene.surfaces.len(),
        form_factors,
        solve: Some(solve),
        picture: None,
    };
    done.tell(&job, output)
}
