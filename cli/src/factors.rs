//! `radiosity factors`: the form factors, as a sparse matrix.

use std::time::Instant;

use radiosity::export;

use crate::args::Factors;
use crate::failure::Failure;
use crate::job::{self, Job};
use crate::report::{Done, StagesDone};
use crate::{interrupt, stages};

pub(crate) fn run(typed: &Factors) -> Result<(), Failure> {
    let started = Instant::now();
    let output = &typed.output;
    job::format(output, &[("npz", ())])?;
    let job = Job::new(&typed.common)?;
    job.check_output(output, None)?;

    let scene = stages::read(&job)?;
    let (patches, facets) = stages::patches(&job, &scene)?;
    let (factors, mut form_factors) = stages::form_factors(&job, &scene, &patches, &facets)?;
    let surroundings = typed.with_surroundings;
    let repaired = match job.request.repair {
        true => {
            let (areas, repair) = stages::repaired(&job, &patches, &factors)?;
            form_factors.repair = Some(repair);
            Some(areas)
        }
        false => None,
    };
    interrupt::writing(|| {
        match &repaired {
            Some(areas) => export::write_exchange_npz(output, areas, surroundings)?,
            None => export::write_form_factors_npz(output, &factors, surroundings)?,
        }
        let done = StagesDone { form_factors, solve: None, correction: None, error: None, refinement: None };
        Done::new(started, &scene, &patches, done).tell(&job, output)
    })
}
