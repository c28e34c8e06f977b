//! What the arguments mean: checked together, and against the file system, before anything is computed.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use radiosity::bake::{Method, Request, Run, Solver};
use radiosity::scene::BackFaces;

use crate::args::{self, Common};
use crate::failure::Failure;

/// A scene, what is asked of it, and how that is run.
#[derive(Debug)]
pub(crate) struct Job {
    pub(crate) scene: PathBuf,
    pub(crate) request: Request,
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
                subdivision: typed.subdivision,
                method: match typed.method {
                    args::Method::Hemicube => Method::Hemicube { precision },
                    args::Method::HemicubeRays => Method::HemicubeRays { precision },
                },
                solver: match typed.solver {
                    args::Solver::GaussSeidel => Solver::GaussSeidel,
                },
                epsilon: typed.epsilon,
                back_faces: typed.back_faces.map(|back_faces| match back_faces {
                    args::BackFaces::Black => BackFaces::Black,
                    args::BackFaces::Lit => BackFaces::Lit,
                }),
            },
            run: Run {
                threads: Some(threads),
                memory_limit: typed.memory_limit.map(|gigabytes| (gigabytes * 1e9) as u64),
            },
            threads,
            report: typed.report.clone(),
            quiet: typed.quiet,
        };
        if let Some(report) = &job.report {
            writable(report, "--report", &[&job.scene])?;
        }
        Ok(job)
    }

    /// Whether the file that `-o` names can be written without harm to any that the command reads or writes besides.
    pub(crate) fn check_output(&self, output: &Path) -> Result<(), Failure> {
        let others = [Some(&self.scene), self.report.as_ref()];
        writable(output, "-o", &others.into_iter().flatten().map(PathBuf::as_path).collect::<Vec<_>>())
    }
}

/// The method's name, as it is typed.
pub(crate) fn method_name(method: Method) -> &'static str {
    match method {
        Method::Hemicube { .. } => "hemicube",
        Method::HemicubeRays { .. } => "hemicube-rays",
    }
}

/// Cells along a side of the hemicube's top face.
pub(crate) fn precision(method: Method) -> u32 {
    match method {
        Method::Hemicube { precision } | Method::HemicubeRays { precision } => precision,
    }
}

/// The solver's name, as it is typed.
pub(crate) fn solver_name(solver: Solver) -> &'static str {
    match solver {
        Solver::GaussSeidel => "gauss-seidel",
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

/// Whether `file` can be written without harm to any of `others`; better told now than after an hour.
fn writable(file: &Path, option: &str, others: &[&Path]) -> Result<(), Failure> {
    let shown = file.display();
    if file.is_dir() {
        return Err(anyhow!("{option} {shown}: this is a folder; name a file in it").into());
    }
    if file.file_name().is_none() {
        return Err(Failure::Usage(format!("{option} '{shown}': this names no file")));
    }
    for other in others {
        if same(file, other) {
            return Err(Failure::Usage(format!(
                "{option} {shown}: this would overwrite {}, which the same command uses",
                other.display()
            )));
        }
    }
    let folder = folder(file);
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
