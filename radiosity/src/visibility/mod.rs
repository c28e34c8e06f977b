//! What is seen from a point: asked of the scene's surfaces, not of its patches.
//!
//! A quadrilateral cut into 10,000 patches is one [`Facet`] here; which patch a point of it belongs to
//! follows from the facet's own (u, v).

mod blocks;
mod draw;
mod facets;
mod item_buffer;
mod lattices;
mod placed;
mod rays;
mod shafts;
mod sight;
pub(crate) mod vectors;
mod view;

pub(crate) use blocks::Labels;
pub(crate) use draw::{Canvas, SCREENS, draw};
pub use facets::{Cells, Facet, FacetShape, Facets};
pub use item_buffer::{ItemBuffer, NOTHING};
pub(crate) use lattices::Lattices;
pub use rays::{Hit, RayTree};
pub(crate) use shafts::{Blockers, Candidates, End, Ends, Reach, Shaft, Standing, in_plane_of};
pub(crate) use sight::{Screen, Sight};
pub use view::View;
