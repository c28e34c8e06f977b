//! What the arguments mean: checked together, and against the file system, before anything is computed.

use std::fs;
use std::path::{Path, PathBuf, is_separator};

use anyhow::anyhow;
use radiosity::bake::{Method, Request, Run, Solver};
use radiosity::patches::Subdivision;
use radiosity::refine::Target;
use radiosity::scene::BackFaces;

use crate::args::{self, Common};
use crate::failure::Failure;

/// A scene, what is asked of it, and how that is run.
#[derive(Debug)]
pub(crate) struct Job {
    pub(crate) scene: PathBuf,
    pub(crate) request: Request,
    /// To be refined until this is reached.
    pub(crate) target: Option<Target>,
    /// What the method and the solver are called where they are typed.
    pub(crate) method: String,
    pub(crate) solver: String,
    pub(crate) run: Run,
    /// The threads that `run` will have.
    pub(crate) threads: usize,
    pub(crate) report: Option<PathBuf>,
    pub(crate) quiet: bool,
}

impl Job {
    pub(crate) fn new(typed: &Common) -> Result<Self, Failure> {
        let threads = match typed.threads {
            Some(threads) => threads.into(),
            None => std::thread::available_parallelism().map_or(1, usize::from),
        };
        let precision = typed.precision;
        let job = Self {
            scene: typed.scene.clone(),
            request: Request {
                subdivision: match (typed.patch_size, typed.patches) {
                    (Some(size), _) => Subdivision::PatchSize(size),
                    (_, Some(patches)) => Subdivision::Patches(patches),
                    _ => Subdivision::Factor(typed.subdivision),
                },
                split: typed.split.map(|split| split == args::Split::On),
                grading: typed.grading,
                method: match typed.method {
                    args::Method::Hemicube => Method::Hemicube { precision },
                    args::Method::HemicubeRays => Method::HemicubeRays { precision },
                    args::Method::HemicubeExact => {
                        Method::HemicubeExact { precision, eyes: typed.eyes, accuracy: typed.accuracy }
                    }
                    args::Method::Exact => Method::Exact { accuracy: typed.accuracy },
                },
                solver: match typed.solver {
                    args::Solver::GaussSeidel => Solver::GaussSeidel,
                    args::Solver::Progressive => Solver::Progressive,
                    args::Solver::Cg => Solver::ConjugateGradients,
                    args::Solver::Jacobi => Solver::Jacobi,
                },
                epsilon: typed.epsilon,
                back_faces: typed.back_faces.map(|back_faces| match back_faces {
                    args::BackFaces::Black => BackFaces::Black,
                    args::BackFaces::Lit => BackFaces::Lit,
                }),
                repair: typed.repair,
                surroundings: typed.surroundings,
                correct: false,
                error: false,
            },
            target: None,
            method: args::name(&typed.method),
            solver: args::name(&typed.solver),
            run: Run {
                threads: Some(threads),
                memory_limit: typed.memory_limit.map(|gigabytes| (gigabytes * 1e9) as u64),
            },
            threads,
            report: typed.report.clone(),
            quiet: typed.quiet,
        };
        if let Some(report) = &job.report {
            distinct(report, "--report", &job.scene)?;
            writable(report, "--report")?;
        }
        Ok(job)
    }

    /// The same to be corrected, and refined, where that was asked.
    pub(crate) fn refined(self, typed: &args::Target) -> Self {
        let request = Request { correct: typed.correct, ..self.request };
        let target = typed.target_error.map(|error| Target {
            most_patches: typed.most_patches.unwrap_or(Target::MOST_PATCHES),
            smallest_patch: typed.smallest_patch,
            ..Target::new(error)
        });
        Self { request, target, ..self }
    }

    /// Whether the file that `-o` names can be written without harm to any that the command reads or writes
    /// besides.
    pub(crate) fn check_output(&self, output: &Path, camera: Option<&Path>) -> Result<(), Failure> {
        if let (Some(report), Some(camera)) = (&self.report, camera) {
            distinct(report, "--report", camera)?;
        }
        self.check_written("-o", output, camera.as_slice())
    }

    /// The same of another file, which `option` names; the command reads or writes `others` besides.
    pub(crate) fn check_written(&self, option: &str, file: &Path, others: &[&Path]) -> Result<(), Failure> {
        let ours = [Some(self.scene.as_path()), self.report.as_deref()];
        for other in ours.into_iter().flatten().chain(others.iter().copied()) {
            distinct(file, option, other)?;
        }
        writable(file, option)
    }
}

/// What the ending of the file that `-o` names stands for; `known` lists each ending and its meaning.
pub(crate) fn format<F: Copy>(output: &Path, known: &[(&str, F)]) -> Result<F, Failure> {
    let ending = output.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    if let Some((_, format)) = known.iter().find(|(name, _)| *name == ending) {
        return Ok(*format);
    }
    let expected: Vec<_> = known.iter().map(|(name, _)| format!(".{name}")).collect();
    let expected = expected.join(" or ");
    Err(Failure::Usage(match (output.to_str(), ending.is_empty()) {
        (Some("-"), _) => format!("-o needs the name of a file that ends in {expected}: '-' is none"),
        (_, true) => {
            format!("-o {}: the name must end in {expected}, which tells the format", output.display())
        }
        (_, false) => {
            format!("-o {}: cannot write .{ending} here; the name must end in {expected}", output.display())
        }
    }))
}

/// Whether writing `file` leaves `other` alone.
fn distinct(file: &Path, option: &str, other: &Path) -> Result<(), Failure> {
    if !same(file, other) {
        return Ok(());
    }
    let (file, other) = (file.display(), other.display());
    Err(Failure::Usage(format!("{option} {file}: this would overwrite {other}, which the same command uses")))
}

/// Whether `file` can be written; better told now than after an hour.
pub(crate) fn writable(file: &Path, option: &str) -> Result<(), Failure> {
    let shown = file.display();
    let there = fs::metadata(file).ok();
    if there.as_ref().is_some_and(fs::Metadata::is_dir) {
        return Err(anyhow!("{option} {shown}: this is a folder; name a file in it").into());
    }
    let separated = file.as_os_str().as_encoded_bytes().last().is_some_and(|&b| is_separator(b.into()));
    if separated || file.file_name().is_none() {
        return Err(Failure::Usage(format!("{option} '{shown}': this names a folder; name a file in it")));
    }
    if there.as_ref().is_some_and(|there| there.permissions().readonly()) {
        return Err(anyhow!("{option} {shown}: the file that is there is write-protected").into());
    }
    // A pipe or a device is written to where it is, and not replaced.
    if there.as_ref().is_some_and(|there| !there.is_file()) {
        return Ok(());
    }
    let target = led_to(file);
    let folder = folder(&target);
    if !folder.is_dir() {
        return Err(
            anyhow!("{option} {shown}: there is no folder {}; create it first", folder.display()).into()
        );
    }
    // The only sure way to know is to try: a file without a name, or one that is gone at once.
    tempfile::tempfile_in(folder).map(drop).map_err(|error| {
        anyhow!("{option} {shown}: cannot write in the folder {}: {error}", folder.display())
    })?;
    Ok(())
}

/// Where a link leads, be there a file or not; other names as they are.
fn led_to(file: &Path) -> PathBuf {
    match fs::read_link(file) {
        Ok(link) => fs::canonicalize(file).unwrap_or_else(|_| folder(file).join(link)),
        Err(_) => file.into(),
    }
}

/// The folder that `file` stands in.
fn folder(file: &Path) -> &Path {
    match file.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Whether two names are one file, there already or not.
fn same(a: &Path, b: &Path) -> bool {
    let full = |path: &Path| {
        fs::canonicalize(path)
            .ok()
            .or_else(|| Some(fs::canonicalize(folder(path)).ok()?.join(path.file_name()?)))
    };
    match (full(a), full(b)) {
        (Some(a), Some(b)) => a == b,
        _ => a == b,
    }
}
