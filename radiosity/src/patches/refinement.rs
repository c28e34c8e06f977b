//! Which patches are quartered, and which of their quarters: a refinement as plain data, which the cut applies.

use std::collections::BTreeSet;

/// The most often that a patch is quartered, and its quarters again.
pub const MOST_HALVINGS: u32 = 12;

/// A cell of a surface's cut, or a quarter of a quarter of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Place {
    /// The surface.
    pub surface: u32,
    /// The patch of the surface that it would be (part of) if nothing was split, counted from the surface's first.
    pub cell: u32,
    /// Where that cell is not one flat triangle or convex quadrilateral: which of its flat faces.
    pub face: u32,
    /// From the face down: 1 for the face itself, and two bits a level for which quarter.
    pub path: u32,
}

/// Where a patch comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Origin {
    /// The cell, or the quarter of it.
    pub place: Place,
    /// Where that is parted by what meets it: which of its parts.
    pub part: u32,
}

impl Place {
    /// The path of a face that is not quartered.
    pub const WHOLE: u32 = 1;

    /// A whole cell.
    pub fn of_cell(surface: u32, cell: u32) -> Self {
        Self { surface, cell, face: 0, path: Self::WHOLE }
    }

    /// One of its four quarters.
    pub(super) fn quarter(self, k: u32) -> Self {
        Self { path: self.path << 2 | k, ..self }
    }

    /// What it is a quarter of; of a whole face, the cell.
    pub fn parent(self) -> Option<Self> {
        if self.path == Self::WHOLE {
            return (self.face > 0).then_some(Self { face: 0, ..self });
        }
        Some(Self { path: self.path >> 2, ..self })
    }

    /// How often its cell was quartered.
    pub fn halvings(self) -> u32 {
        self.path.ilog2() / 2
    }
}

/// What is to be quartered of a scene's cut. The same refinement of the same cut makes the same patches.
///
/// Faces are quartered besides, as [`refined`](super::refined) makes them, until of two that share an edge none is more than
/// twice as long as the other.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Refinement {
    quartered: BTreeSet<Place>,
}

impl Refinement {
    /// Quarter this, and all that it is a quarter of. A cell that is not one face is quartered face by face. Nothing is
    /// quartered more often than [`MOST_HALVINGS`].
    pub fn quarter(&mut self, place: Place) {
        let mut next = (place.halvings() < MOST_HALVINGS).then_some(place);
        while let Some(place) = next {
            // The faces of a cell are quartered together.
            let place = if place.path == Place::WHOLE { Place { face: 0, ..place } } else { place };
            self.quartered.insert(place);
            next = match place.path {
                Place::WHOLE => None,
                _ => place.parent(),
            };
        }
    }

    /// Whether a place is quartered.
    pub fn is_quartered(&self, place: Place) -> bool {
        let place = if place.path == Place::WHOLE { Place { face: 0, ..place } } else { place };
        self.quartered.contains(&place)
    }

    /// Whether nothing is.
    pub fn is_empty(&self) -> bool {
        self.quartered.is_empty()
    }

    /// How many places are.
    pub fn len(&self) -> usize {
        self.quartered.len()
    }
}
