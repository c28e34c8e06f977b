//! What is asked, and how it is run.

use crate::light::Rgb;
use crate::patches::{Cutting, Subdivision};
use crate::scene::BackFaces;

/// What is asked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Request {
    /// How finely surfaces are cut into patches.
    pub subdivision: Subdivision,
    /// Whether patches are parted where another surface crosses theirs or stands on it; `None` does so where they are made by
    /// size or number, and leaves them as they are where the author's n and m (and triangles) count.
    pub split: Option<bool>,
    /// How often patches that are split are quartered towards where surfaces meet; see [`Cutting::grading`].
    pub grading: u32,
    /// How form factors are found.
    pub method: Method,
    /// How the equation is solved.
    pub solver: Solver,
    /// The stopping test's bound: sqrt(Σ |B_i - Bold_i|²) <= epsilon.
    pub epsilon: f64,
    /// What a patch is from behind; `None` leaves it to the scene.
    pub back_faces: Option<BackFaces>,
    /// Whether form factors are made to keep reciprocity and closure to the last digit ([`ExchangeAreas`](crate::form_factors::ExchangeAreas)).
    pub repair: bool,
    /// The radiosity of what lies beyond an open scene, all about: what goes out of it is lost, and this comes in.
    pub surroundings: Rgb,
    /// Whether the light that patches hide which send it evenly is found, and sent after ([`corrected`](super::corrected)): with
    /// exact form factors, and shares, for a quarter of their time, about a third of the error is left.
    pub correct: bool,
    /// Whether the answer's error is estimated ([`ErrorEstimate`](crate::estimate::ErrorEstimate)): about as long again as the form factors take by hemicube, and a
    /// few passes over the rows.
    pub error: bool,
}

impl Default for Request {
    /// The assignment's hand-in precision.
    fn default() -> Self {
        Self {
            subdivision: Subdivision::Factor(1.0),
            split: None,
            grading: 0,
            method: Method::Hemicube { precision: 100 },
            solver: Solver::GaussSeidel,
            epsilon: 1e-6,
            back_faces: None,
            repair: false,
            surroundings: Rgb::BLACK,
            correct: false,
            error: false,
        }
    }
}

impl Request {
    /// How the scene is to be cut into patches.
    pub fn cutting(&self) -> Cutting {
        let by_author = matches!(self.subdivision, Subdivision::Factor(_));
        let split = self.split.unwrap_or(!by_author);
        Cutting { subdivision: self.subdivision, split, grading: self.grading }
    }
}

/// A way to find form factors.
#[derive(Clone, Copy, Debug, PartialEq)]
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
    /// Exact form factors from patch to patch, times the share of each that hemicubes see; those of lamps as [`Method::Exact`]
    /// has them.
    HemicubeExact {
        /// Cells along a side of the top face, of all hemicubes along a side of a patch together.
        precision: u32,
        /// Hemicubes along each side of a patch; see [`EYES`](crate::form_factors::shares::EYES).
        eyes: u32,
        /// By how much a lamp's form factor may be off where it is partly hidden; see [`ACCURACIES`](crate::form_factors::visible::ACCURACIES).
        accuracy: f64,
    },
    /// Exact form factors from patch to patch, times how much of each is seen from the other.
    Exact {
        /// By how much a row's sum may be off where patches are partly hidden, as a standard deviation; see
        /// [`ACCURACIES`](crate::form_factors::visible::ACCURACIES).
        accuracy: f64,
    },
}

impl Method {
    /// Whether form factors are those from patch to patch, not from a patch's centre: what is left of the error is then that
    /// patches send light evenly, which can be told and taken away.
    pub fn from_patch_to_patch(self) -> bool {
        match self {
            Self::Hemicube { .. } | Self::HemicubeRays { .. } => false,
            Self::HemicubeExact { .. } | Self::Exact { .. } => true,
        }
    }

    /// Cells along a side of the hemicube's top face; `None` where there is no hemicube.
    pub fn precision(self) -> Option<u32> {
        match self {
            Self::Hemicube { precision }
            | Self::HemicubeRays { precision }
            | Self::HemicubeExact { precision, .. } => Some(precision),
            Self::Exact { .. } => None,
        }
    }
}

/// A way to solve the equation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solver {
    /// Gauss-Seidel in patch order.
    GaussSeidel,
    /// Progressive refinement: shooting, the most unshot power first.
    Progressive,
    /// Conjugate gradients on the symmetric system of reciprocity-averaged form factors.
    ConjugateGradients,
    /// Jacobi: a bounce of light a step.
    Jacobi,
}

/// How it is run: none of this changes a bit of the answer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Run {
    /// Worker threads; `None` for as many as the machine has cores.
    pub threads: Option<usize>,
    /// Bytes that a solution may take; `None` for three quarters of the machine's memory.
    pub memory_limit: Option<u64>,
}
