//! The recipe end to end: the only file that knows every stage.

use crate::form_factors::FormFactors;
use crate::patches::{self, Patches, SubdivideError};
use crate::scene::{BackFaces, Scene};
use crate::solve::{Solution, SolveError};
use crate::visibility::Facets;
use crate::watch::{Interrupted, Watch};

/// What is asked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Request {
    /// Every n and m is multiplied by this.
    pub subdivision: f64,
    /// How form factors are found.
    pub method: Method,
    /// How the equation is solved.
    pub solver: Solver,
    /// The stopping test's bound: sqrt(Σ |B_i - Bold_i|²) <= epsilon.
    pub epsilon: f64,
    /// What a patch is from behind; `None` leaves it to the scene.
    pub back_faces: Option<BackFaces>,
}

impl Default for Request {
    /// The assignment's hand-in precision.
    fn default() -> Self {
        Self {
            subdivision: 1.0,
            method: Method::Hemicube { precision: 100 },
            solver: Solver::GaussSeidel,
            epsilon: 1e-6,
            back_faces: None,
        }
    }
}

/// A way to find form factors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// A hemicube at each patch's centre, its cells filled by an item buffer.
    Hemicube {
        /// Cells along a side of the top face; even, at least 2.
        precision: u32,
    },
    /// The same hemicube, one ray a cell: the assignment's own way, slow, and the reference for the other.
    HemicubeRays {
        /// Cells along a side of the top face; even, at least 2.
        precision: u32,
    },
}

/// A way to solve the equation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solver {
    /// Gauss-Seidel in patch order.
    GaussSeidel,
}

/// How it is run: none of this changes a bit of the answer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Run {
    /// Worker threads; `None` for as many as the machine has cores.
    pub threads: Option<usize>,
    /// Bytes that a solution may take; `None` for three quarters of the machine's memory.
    pub memory_limit: Option<u64>,
}

/// Every stage's value.
#[derive(Clone, Debug)]
pub struct Baked {
    /// The patches.
    pub patches: Patches,
    /// What visibility was asked of: pictures ask it again.
    pub facets: Facets,
    /// Their form factors.
    pub form_factors: FormFactors,
    /// Their radiosities.
    pub solution: Solution,
}

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BakeError {
    /// The scene cannot be cut into patches.
    #[error(transparent)]
    Subdivide(#[from] SubdivideError),
    /// The equation has no answer.
    #[error(transparent)]
    Solve(SolveError),
    /// The caller said stop.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    /// Something asked makes no sense; the message says what, and the cure.
    #[error("{0}")]
    BadRequest(String),
    /// It would take too much memory.
    #[error(
        "{patches} patches would need about {needed_gb:.1} GB, and the limit is {limit_gb:.1} GB: use a smaller \
         --subdivision, or raise --memory-limit"
    )]
    Memory {
        /// How many patches.
        patches: u64,
        /// About how much it would take, in GB of 10⁹ bytes.
        needed_gb: f64,
        /// How much is allowed, likewise.
        limit_gb: f64,
    },
}

/// What a solution would take, told before anything large is allocated.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Need {
    /// Patches.
    pub patches: u64,
    /// Form factors stored, estimated from a sample of rows.
    pub nonzeros: u64,
    /// Bytes for all of it.
    pub bytes: u64,
}

/// Step 1: the patches, refused where they alone would exceed the memory limit.
pub fn patches(scene: &Scene, request: &Request, _run: &Run) -> Result<Patches, BakeError> {
    Ok(patches::subdivide(scene, request.subdivision)?)
}

/// What the form factors and the solution of `scene` would take.
pub fn need(_scene: &Scene, patches: &Patches, _request: &Request) -> Result<Need, BakeError> {
    Ok(Need { patches: patches.len() as u64, nonzeros: 0, bytes: 0 })
}

/// Step 2: the form factors.
pub fn form_factors(
    _scene: &Scene,
    _patches: &Patches,
    _request: &Request,
    _run: &Run,
    _watch: &mut Watch<'_>,
) -> Result<FormFactors, BakeError> {
    Err(BakeError::BadRequest("not yet".into()))
}

/// Step 3: the radiosities.
pub fn solve(
    _patches: &Patches,
    _form_factors: &FormFactors,
    _request: &Request,
    _watch: &mut Watch<'_>,
) -> Result<Solution, BakeError> {
    Err(BakeError::BadRequest("not yet".into()))
}

/// All of it.
pub fn bake(scene: &Scene, request: &Request, run: &Run, watch: &mut Watch<'_>) -> Result<Baked, BakeError> {
    let patches = patches(scene, request, run)?;
    let facets = Facets::new(scene, &patches);
    let form_factors = form_factors(scene, &patches, request, run, watch)?;
    let solution = solve(&patches, &form_factors, request, watch)?;
    Ok(Baked { patches, facets, form_factors, solution })
}
