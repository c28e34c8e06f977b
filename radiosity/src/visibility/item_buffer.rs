//! The item buffer: what is nearest in each cell of a view, by rasterising.

use std::ops::Range;

use crate::simd::{LANES, Simd};

/// What a cell holds that sees no facet.
pub const NOTHING: u32 = u32::MAX;

/// The nearest facet, and how near, in each cell of a view.
#[derive(Clone, Debug, Default)]
pub struct ItemBuffer {
    width: usize,
    height: usize,
    /// Cells from one row to the next: the width, rounded up to whole blocks. What stands beyond the width is infinitely
    /// near.
    stride: usize,
    label: Vec<u32>,
    inverse_depth: Vec<f32>,
    /// For each tile, [`LANES`] columns and [`TILE_ROWS`] rows, how near its farthest cell is; `None` where something was put
    /// into it since that was found.
    farthest: Vec<Option<f32>>,
}

/// Rows of a tile.
const TILE_ROWS: usize = 8;

/// Cells from and up to which something may be seen, and how near it comes at most.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rect {
    pub(super) columns: [i32; 2],
    pub(super) rows: [i32; 2],
    /// 1 / distance along the view's forward.
    pub(super) nearest: f32,
}

impl Rect {
    pub(super) const NONE: Self = Self { columns: [0; 2], rows: [0; 2], nearest: 0.0 };

    /// The tiles that it meets, along columns and along rows.
    #[inline(always)]
    fn tiles(&self) -> (Range<usize>, Range<usize>) {
        let columns = self.columns[0] as usize / LANES..(self.columns[1] as usize).div_ceil(LANES);
        let rows = self.rows[0] as usize / TILE_ROWS..(self.rows[1] as usize).div_ceil(TILE_ROWS);
        (columns, rows)
    }
}

/// A block of cells of one row.
pub(super) struct Cells<'a> {
    inverse_depth: &'a mut [f32; LANES],
    label: &'a mut [u32; LANES],
}

/// A facet, ready to be put into one block of cells after another.
pub(super) struct Stamp<S: Simd> {
    /// How much the inverse depth of each cell of a block differs from that of its first.
    pub(super) steps: S::Floats,
    pub(super) steps_in_double: S::Doubles,
    /// The inverse depth that nothing seen may have.
    pub(super) nearest: S::Floats,
    pub(super) label: S::Ints,
}

impl<S: Simd> Stamp<S> {
    /// Put the label into each cell `inside` a block (from and up to) where it is nearer than what stands there, or as near
    /// and less; `start` is its inverse depth in the block's first cell. That may lie far outside of a facet that is `STEEP`,
    /// seen nearly edge-on, where the depth is another by orders of magnitude: then the sum takes double precision.
    #[inline(always)]
    pub(super) fn print<const STEEP: bool>(
        &self,
        simd: S,
        start: f64,
        [from, to]: [u32; 2],
        cells: Cells<'_>,
    ) {
        let here = match STEEP {
            true => simd.narrow(simd.add_double(simd.splat_double(start), self.steps_in_double)),
            false => simd.add(simd.splat(start as f32), self.steps),
        };
        let (depth, stood) = (simd.load(cells.inverse_depth), simd.load_int(cells.label));
        let inside = simd.mask((1 << to.min(LANES as u32)) - (1 << from));
        let as_near = simd.and(simd.equal(here, depth), simd.greater_int(stood, self.label));
        let wins = simd.and(simd.or(simd.greater(here, depth), as_near), simd.greater(self.nearest, here));
        let wins = simd.and(wins, inside);
        simd.store(simd.select(wins, here, depth), cells.inverse_depth);
        simd.store_int(simd.select_int(wins, self.label, stood), cells.label);
    }
}

impl ItemBuffer {
    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The nearest facet in each cell of row `y`, or [`NOTHING`].
    #[inline(always)]
    pub fn facets(&self, y: usize) -> &[u32] {
        &self.label[y * self.stride..][..self.width]
    }

    /// The same to the end of the last block and a block more; beyond the width it means nothing.
    #[inline(always)]
    pub(crate) fn labels(&self, y: usize) -> &[u32] {
        &self.label[y * self.stride..][..self.stride + LANES]
    }

    /// What every cell holds.
    pub(super) fn all_labels(&mut self) -> impl Iterator<Item = &mut u32> {
        self.label.iter_mut()
    }

    /// 1 / distance along the view's `forward` to what each cell of row `y` shows.
    #[inline]
    pub fn inverse_depths(&self, y: usize) -> &[f32] {
        &self.inverse_depth[y * self.stride..][..self.width]
    }

    /// Make room for a screen that shows nothing.
    #[inline(always)]
    pub(super) fn clear(&mut self, [width, height]: [usize; 2], background: u32, inverse_far: f32) {
        (self.width, self.height) = (width, height);
        self.stride = width.next_multiple_of(LANES);
        self.label.clear();
        self.label.resize(self.stride * height + LANES, background);
        self.inverse_depth.clear();
        self.inverse_depth.resize(self.stride * height, inverse_far);
        for row in self.inverse_depth.chunks_exact_mut(self.stride) {
            row[width..].fill(f32::INFINITY);
        }
        self.farthest.clear();
        self.farthest.resize(self.stride / LANES * height.div_ceil(TILE_ROWS), Some(inverse_far));
    }

    /// The block of cells that begins at this column of this row.
    #[inline(always)]
    pub(super) fn cells(&mut self, [column, row]: [usize; 2]) -> Cells<'_> {
        let at = row * self.stride + column;
        Cells {
            inverse_depth: self.inverse_depth[at..].first_chunk_mut().expect("rows are whole blocks"),
            label: self.label[at..].first_chunk_mut().expect("rows are whole blocks"),
        }
    }

    /// The same as [`Stamp::print`], in one cell.
    #[inline(always)]
    pub(super) fn put(&mut self, [column, row]: [usize; 2], here: f32, nearest: f32, label: u32) {
        let at = row * self.stride + column;
        let (depth, stood) = (&mut self.inverse_depth[at], &mut self.label[at]);
        let as_near = here == *depth && (label as i32) < (*stood as i32);
        if (here > *depth || as_near) && here < nearest {
            *depth = here;
            *stood = label;
        }
    }

    /// Remember that something was put into these cells.
    #[inline(always)]
    pub(super) fn touch(&mut self, cover: &Rect) {
        let (columns, rows) = cover.tiles();
        for row in rows {
            self.farthest[row * (self.stride / LANES)..][columns.clone()].fill(None);
        }
    }

    /// Whether what stands in all these cells already is nearer than anything in the rectangle can be.
    #[inline(always)]
    pub(super) fn hides<S: Simd>(&mut self, simd: S, cover: &Rect) -> bool {
        let across = self.stride / LANES;
        let (columns, rows) = cover.tiles();
        for row in rows {
            for column in columns.clone() {
                let farthest = match self.farthest[row * across + column] {
                    Some(farthest) => farthest,
                    None => self.find_farthest(simd, row, column),
                };
                if farthest <= cover.nearest {
                    return false;
                }
            }
        }
        true
    }

    #[inline(always)]
    fn find_farthest<S: Simd>(&mut self, simd: S, row: usize, column: usize) -> f32 {
        let mut least = simd.splat(f32::INFINITY);
        for y in row * TILE_ROWS..((row + 1) * TILE_ROWS).min(self.height) {
            let cells = self.inverse_depth[y * self.stride + column * LANES..].first_chunk();
            least = simd.min(simd.load(cells.expect("rows are whole blocks")), least);
        }
        let mut cells = [0.0; LANES];
        simd.store(least, &mut cells);
        let farthest = cells.into_iter().fold(f32::INFINITY, |a, b| if b < a { b } else { a });
        self.farthest[row * (self.stride / LANES) + column] = Some(farthest);
        farthest
    }
}
