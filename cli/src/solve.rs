//! `radiosity solve`: a row of numbers for each patch.

use std::time::Instant;

use radiosity::export;

use crate::args::Solve;
use crate::failure::Failure;
use crate::job::{self, Job};
use crate::report::Done;
use crate::{interrupt, stages};

#[derive(Clone, Copy)]
enum Format {
    Csv,
    Npz,
}

pub(crate) fn run(typed: &Solve) -> Result<(), Failure> {
    let started = Instant::now();
    let output = &typed.output;
    let format = job::format(output, &[("csv", Format::Csv), ("npz", Format::Npz)])?;
    let job = Job::new(&typed.common)?;
    job.check_output(output, None)?;

    let scene = stages::read(&job)?;
    let (patches, facets) = stages::patches(&job, &scene)?;
    let (rows, form_factors) = stages::rows(&job, &scene, &patches, &facets)?;
    let (solution, solve) = stages::solve(&job, &patches, &rows)?;
    interrupt::writing(|| {
        match format {
            Format::Csv => export::write_solution_csv(output, &patches, &solution)?,
            Format::Npz => export::write_solution_npz(output, &patches, &solution)?,
        }
        Done::new(started, &scene, &patches, form_factors, Some(solve)).tell(&job, output)
    })
}
