//! The patches ("pièces"): what a scene's surfaces are cut into, and what radiosity is solved for.

mod cut;
mod joints;
mod meetings;
mod refinement;
mod split;
mod subdivide;
mod subdivision;

use glam::DVec3;

pub use refinement::{MOST_HALVINGS, Origin, Place, Refinement};
pub use subdivide::{BYTES_PER_PATCH, count, refined, subdivide};
pub use subdivision::{Cutting, MOST_GRADING, MOST_PATCHES, SubdivideError, Subdivision};

use crate::light::Rgb;

/// The patches of a scene, in columns: entry i of each describes patch i. Numbered as N3D numbers them:
/// surface by surface in file order, and within one column by column, then row by row. The parts of a cell that is split
/// follow one another where the cell would be.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Patches {
    /// Where the hemicube stands: a point of the patch, its centroid where that lies on it.
    pub centre: Vec<DVec3>,
    /// Unit normal of the front.
    pub normal: Vec<DVec3>,
    /// Along the surface's u, not normalised: the patch's own extent (V1 of N3D's, one patch long).
    pub tangent_u: Vec<DVec3>,
    /// Along the surface's v, likewise (V2).
    pub tangent_v: Vec<DVec3>,
    /// Area.
    pub area: Vec<f64>,
    /// Emitted exitance E.
    pub emission: Vec<Rgb>,
    /// Diffuse reflectance ρ.
    pub reflectance: Vec<Rgb>,
    /// The surface (object number) each patch is of.
    pub surface: Vec<u32>,
    /// Where patches are quartered by a [`Refinement`], the patch that each would be (part of) without; else empty.
    pub parent: Vec<u32>,
    /// For each *surface*, its block of patches.
    pub blocks: Vec<Block>,
    /// For each *surface*, the triangles that its patches are made of; `None` where it is a parallelogram cut into equal
    /// cells, and not split.
    pub pieces: Vec<Option<Pieces>>,
}

/// The flat triangles that the patches of a surface are made of. Those that share an edge share its ends to the bit, and no
/// corner lies within another's edge.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pieces {
    /// The corners, counter-clockwise seen from the front.
    pub triangles: Vec<[DVec3; 3]>,
    /// The patch that each is (part of).
    pub patch: Vec<u32>,
    /// Whether it is one smooth surface, such as a sphere, whatever the angles between its pieces: else there may be
    /// creases, to be found by those.
    pub smooth: bool,
    /// Of each triangle, the edges that another surface stands on or crosses, so that light may differ on the other side: bit
    /// k is the edge from corner k to the next. Empty where there is none.
    pub sharp: Vec<u8>,
}

/// The patches of one surface: `first + row * columns + column`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block {
    /// The surface's first patch.
    pub first: u32,
    /// Patches along u; where they are no grid, all of them.
    pub columns: u32,
    /// Patches along v; 1 where they are no grid.
    pub rows: u32,
}

impl Block {
    /// The patches of the surface.
    pub fn patches(&self) -> std::ops::Range<usize> {
        let first = self.first as usize;
        first..first + self.columns as usize * self.rows as usize
    }
}

impl Patches {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.area.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.area.is_empty()
    }

    /// Whether patch i, from its centre, would see the back of patch j.
    pub fn is_behind(&self, i: usize, j: usize) -> bool {
        self.turns_its_back(j, self.centre[i])
    }

    /// Whether a point would see the back of patch j.
    pub fn turns_its_back(&self, j: usize, point: DVec3) -> bool {
        (point - self.centre[j]).dot(self.normal[j]) < 0.0
    }

    /// The total area.
    pub fn total_area(&self) -> f64 {
        self.area.iter().sum()
    }

    /// The emitted power: the sum of A E.
    pub fn total_power(&self) -> Rgb {
        self.area.iter().zip(&self.emission).map(|(&area, &emission)| emission * area).sum()
    }
}
