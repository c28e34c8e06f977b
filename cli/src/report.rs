//! What was done: as JSON for scripts, in a few lines for people.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::time::Instant;

use radiosity::bake::Correction;
use radiosity::estimate::OverallError;
use radiosity::export;
use radiosity::patches::Patches;
use radiosity::refine::Round;
use radiosity::scene::Scene;
use serde::Serialize;

use crate::diagnostics;
use crate::failure::Failure;
use crate::job::Job;
use crate::numbers::{bytes, grouped, measure, percent, seconds};

/// What `--report` writes. Scripts rely on these names.
#[derive(Debug, Serialize)]
pub(crate) struct Report {
    pub(crate) scene: String,
    pub(crate) patches: usize,
    /// Null where none were asked for.
    pub(crate) form_factors: Option<FormFactorsDone>,
    /// Null where nothing was solved.
    pub(crate) solve: Option<SolveDone>,
    /// Only there where it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) correction: Option<CorrectionDone>,
    /// Likewise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) error: Option<ErrorDone>,
    /// Likewise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) refinement: Option<RefinementDone>,
    /// From the start of the command to its last file.
    pub(crate) total_seconds: f64,
    pub(crate) threads: usize,
    /// Null where the system does not tell.
    pub(crate) peak_memory_bytes: Option<u64>,
}

/// How the form factors were found.
#[derive(Debug, Serialize)]
pub(crate) struct FormFactorsDone {
    pub(crate) method: String,
    /// Null where there is no hemicube.
    pub(crate) precision: Option<u32>,
    /// Cells of all hemicubes, each of which stands for one ray of the assignment; null likewise.
    pub(crate) rays: Option<u64>,
    pub(crate) nonzeros: usize,
    pub(crate) seconds: f64,
    pub(crate) row_sum_min: f64,
    pub(crate) row_sum_max: f64,
    /// Only there where it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) repair: Option<RepairDone>,
    /// Only there where the form factors did not fit into memory.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) recomputed: Option<RecomputedRows>,
}

/// How form factors were brought to reciprocity and closure.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct RepairDone {
    /// The most that a row, with what goes elsewhere, was off 1 once both ways were averaged, and in the end.
    pub(crate) closure_before: f64,
    pub(crate) closure_after: f64,
    /// The greatest share that any of the averages was changed by.
    pub(crate) greatest_change: f64,
}

/// Form factors that did not fit into memory, and were found anew for every step of the solver.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct RecomputedRows {
    /// Rows that were kept all the same.
    pub(crate) kept: usize,
    /// What a solution with all of them would have taken.
    pub(crate) needed_bytes: u64,
}

/// How the equation was solved. Numbers that are not finite become null: JSON has none.
#[derive(Debug, Serialize)]
pub(crate) struct SolveDone {
    pub(crate) solver: String,
    pub(crate) iterations: usize,
    /// What the stopping test measured last.
    pub(crate) residual: Option<f64>,
    pub(crate) seconds: f64,
    /// What it measured after each iteration.
    pub(crate) history: Vec<f64>,
}

/// How the answer was corrected for patches that send light evenly.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct CorrectionDone {
    /// By how much it moved the radiosities: a share of their root mean square over the area, emitters left out.
    pub(crate) change: f64,
    /// The solver's steps for it.
    pub(crate) iterations: usize,
    /// Only there where patches were not refined, round by round.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) seconds: Option<f64>,
}

impl CorrectionDone {
    pub(crate) fn new(correction: &Correction, seconds: Option<f64>) -> Self {
        let Correction { change, iterations } = *correction;
        Self { change, iterations, seconds }
    }
}

/// By how much the radiosities may be off: shares of their root mean square over the area, emitters left out.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct ErrorDone {
    pub(crate) relative: f64,
    /// Its parts; the whole is the root of the sum of their squares, with a margin.
    pub(crate) discretisation: f64,
    pub(crate) form_factors: f64,
    pub(crate) residual: f64,
    /// The greatest of any patch and channel, a power per area, and the patch.
    pub(crate) greatest: f64,
    pub(crate) greatest_patch: u32,
    /// Patches that have no neighbours to be compared with: their discretisation is not known.
    pub(crate) patches_alone: usize,
    pub(crate) seconds: f64,
}

impl ErrorDone {
    pub(crate) fn new(overall: &OverallError, patches_alone: usize, seconds: f64) -> Self {
        let OverallError { relative, discretisation, form_factors, residual, greatest } = *overall;
        let (greatest, greatest_patch) = greatest;
        Self {
            relative,
            discretisation,
            form_factors,
            residual,
            greatest,
            greatest_patch,
            patches_alone,
            seconds,
        }
    }
}

/// How patches were refined.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct RefinementDone {
    /// The error that was asked for, and the one that was reached, as shares.
    pub(crate) target: f64,
    pub(crate) reached: f64,
    /// What ended it: target, most-patches, memory, smallest-patch, form-factors or residual.
    pub(crate) stopped: &'static str,
    pub(crate) rounds: Vec<RoundDone>,
    /// The same for people.
    #[serde(skip)]
    pub(crate) why: String,
}

/// One cut and its answer.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct RoundDone {
    pub(crate) patches: usize,
    /// Rows of form factors that were found for it; the others were known from the round before.
    pub(crate) rows_found: usize,
    /// What one value a patch is off the light at every point, and its parts: the light's variation within patches, and by how
    /// much their values may be off their means.
    pub(crate) relative: f64,
    pub(crate) within_patches: f64,
    pub(crate) means: f64,
    pub(crate) seconds: f64,
}

impl RoundDone {
    pub(crate) fn new(round: &Round, seconds: f64) -> Self {
        let Round { patches, rows_found, means, within, error, .. } = *round;
        Self { patches, rows_found, relative: error, within_patches: within, means: means.relative, seconds }
    }

    /// A line while it goes on.
    pub(crate) fn tell(&self, number: usize) {
        diagnostics::plain(&format!(
            "{:<13} {} patches, {} rows found, within {} of the light everywhere ({} within patches, {} of their means), {}",
            format!("round {number}"),
            grouped(self.patches),
            grouped(self.rows_found),
            percent(self.relative),
            percent(self.within_patches),
            percent(self.means),
            seconds(self.seconds),
        ));
    }
}

/// What became of the stages that a command ran.
pub(crate) struct StagesDone {
    pub(crate) form_factors: FormFactorsDone,
    pub(crate) solve: Option<SolveDone>,
    pub(crate) correction: Option<CorrectionDone>,
    pub(crate) error: Option<ErrorDone>,
    pub(crate) refinement: Option<RefinementDone>,
}

/// All that is told at a command's end, once its file is written.
pub(crate) struct Done {
    started: Instant,
    patches: usize,
    surfaces: usize,
    stages: StagesDone,
    /// A line on the picture, where there is one.
    picture: Option<String>,
    /// A line on the light map.
    light_map: Option<String>,
}

impl Done {
    pub(crate) fn new(started: Instant, scene: &Scene, patches: &Patches, stages: StagesDone) -> Self {
        let (patches, surfaces) = (patches.len(), scene.surfaces.len());
        Self { started, patches, surfaces, stages, picture: None, light_map: None }
    }

    pub(crate) fn picture(self, what: String) -> Self {
        Self { picture: Some(what), ..self }
    }

    pub(crate) fn light_map(self, what: String) -> Self {
        Self { light_map: Some(what), ..self }
    }

    /// Write the report where one is asked for, and tell the summary.
    pub(crate) fn tell(self, job: &Job, output: &Path) -> Result<(), Failure> {
        let total_seconds = self.started.elapsed().as_secs_f64();
        if !job.quiet {
            self.summary(total_seconds, output);
        }
        let report = Report {
            scene: job.scene.display().to_string(),
            patches: self.patches,
            form_factors: Some(self.stages.form_factors),
            solve: self.stages.solve,
            correction: self.stages.correction,
            error: self.stages.error,
            refinement: self.stages.refinement,
            total_seconds,
            threads: job.threads,
            peak_memory_bytes: peak_memory(),
        };
        report.write(job)
    }

    fn summary(&self, total_seconds: f64, output: &Path) {
        let line = |label: &str, text: String| diagnostics::plain(&format!("{label:<13} {text}"));
        line("patches", format!("{} from {} surfaces", grouped(self.patches), grouped(self.surfaces)));
        let found = &self.stages.form_factors;
        line(
            "form factors",
            format!(
                "{}, {}{}, {} nonzero, row sums {:.4} to {:.4}",
                seconds(found.seconds),
                found.method,
                found.precision.map_or(String::new(), |precision| format!(" precision {precision}")),
                grouped(found.nonzeros),
                found.row_sum_min,
                found.row_sum_max,
            ),
        );
        if let Some(repair) = found.repair {
            line(
                "repair",
                format!(
                    "rows closed from {:.1e} to {:.1e}, no form factor changed by more than {}",
                    repair.closure_before,
                    repair.closure_after,
                    percent(repair.greatest_change),
                ),
            );
        }
        if let Some(recomputed) = found.recomputed {
            line(
                "memory",
                format!(
                    "rows recomputed: {} patches would need about {}; {} rows kept",
                    grouped(self.patches),
                    bytes(recomputed.needed_bytes),
                    grouped(recomputed.kept)
                ),
            );
        }
        if let Some(solve) = &self.stages.solve {
            let residual = solve.residual.map_or("none".into(), |residual| format!("{residual:.1e}"));
            line(
                "solve",
                format!(
                    "{}, {} in {} steps, residual {residual}",
                    seconds(solve.seconds),
                    solve.solver,
                    solve.iterations
                ),
            );
        }
        if let Some(correction) = &self.stages.correction {
            line(
                "correction",
                format!(
                    "{}{} steps, for what patches hide that send evenly; it moved the light by {}",
                    correction.seconds.map_or(String::new(), |taken| format!("{}, ", seconds(taken))),
                    correction.iterations,
                    percent(correction.change)
                ),
            );
        }
        if let Some(error) = &self.stages.error {
            let alone = match error.patches_alone {
                0 => String::new(),
                alone => {
                    format!("; {} patches without neighbours, finer ones would tell more", grouped(alone))
                }
            };
            line(
                "error",
                format!(
                    "{}, within {} (discretisation {}, form factors {}, residual {}), at most {} at patch {}{alone}",
                    seconds(error.seconds),
                    percent(error.relative),
                    percent(error.discretisation),
                    percent(error.form_factors),
                    percent(error.residual),
                    measure(error.greatest),
                    error.greatest_patch,
                ),
            );
        }
        if let Some(refinement) = &self.stages.refinement {
            line("refinement", refinement.why.clone());
        }
        if let Some(picture) = &self.picture {
            line("picture", picture.clone());
        }
        if let Some(light_map) = &self.light_map {
            line("light map", light_map.clone());
        }
        line("wrote", format!("{} in {}", output.display(), seconds(total_seconds)));
    }
}

impl Report {
    /// Write it where the job wants it, if it wants it.
    pub(crate) fn write(&self, job: &Job) -> Result<(), Failure> {
        let Some(file) = &job.report else { return Ok(()) };
        export::whole_file(file, |writer| {
            serde_json::to_writer_pretty(&mut *writer, self)?;
            writeln!(writer)
        })?;
        Ok(())
    }
}

/// The most memory this process has held so far, where the system tells (Linux).
pub(crate) fn peak_memory() -> Option<u64> {
    kilobytes(&fs::read_to_string("/proc/self/status").ok()?, "VmHWM:")
}

/// The bytes that a line such as `VmHWM:  1234 kB` tells of.
fn kilobytes(table: &str, label: &str) -> Option<u64> {
    let line = table.lines().find_map(|line| line.strip_prefix(label))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_read_from_a_table() {
        assert_eq!(kilobytes("VmPeak:\t 9 kB\nVmHWM:\t    1234 kB\n", "VmHWM:"), Some(1234 * 1024));
        assert_eq!(kilobytes("VmPeak:\t 9 kB\n", "VmHWM:"), None);
        assert_eq!(kilobytes("VmHWM: many kB", "VmHWM:"), None);
    }

    #[test]
    fn what_is_not_finite_is_null() {
        let done = SolveDone {
            solver: "gauss-seidel".into(),
            iterations: 1,
            residual: Some(f64::NAN),
            seconds: 0.5,
            history: vec![f64::INFINITY],
        };
        let json = serde_json::to_string(&done).expect("serialises");
        assert!(json.contains(r#""residual":null"#) && json.contains("[null]"), "{json}");
    }
}
