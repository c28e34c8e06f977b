//! `radiosity factors`: the form factors, as a sparse matrix.

use std::time::Instant;

use crate::args::Factors;
use crate::failure::Failure;
use crate::job::{self, Job};
use crate::report::Done;
use crate::stages;

pub(crate) fn run(typed: &Factors) -> Result<(), Failure> {
    let started = Instant::now();
    let output = &typed.output;
    job::format(output, &[("npz", ())])?;
    let job = Job::new(&typed.common)?;
    job.check_output(output)?;

    let scene = stages::read(&job)?;
    let (patches, facets) = stages::patches(&job, &scene)?;
    let (_factors, form_factors) = stages::form_factors(&job, &scene, &patches, &facets)?;
    return Err(anyhow::anyhow!("matrices are not written yet").into());
    #[expect(unreachable_code)]
    let done = Done {
        started,
        patches: patches.len(),
        surfaces: scene.surfaces.len(),
        form_factors,
        solve: None,
        picture: None,
    };
    done.tell(&job, output)
}
