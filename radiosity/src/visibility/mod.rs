//! What is seen from a point: asked of the scene's surfaces, not of its patches.
//!
//! A quadrilateral cut into 10,000 patches is one [`Facet`] here; which patch a point of it belongs to
//! follows from the facet's own (u, v).

mod blocks;
mod draw;
mod facets;
mod item_buffer;
mod rays;
mod view;

pub use facets::{Cells, Facet, FacetShape, Facets};
pub(crate) use draw::{Canvas, SCREENS, Screen, Sight, draw};
pub use item_buffer::{ItemBuffer, NOTHING};
pub use rays::{Hit, RayTree};
pub use view::View;
