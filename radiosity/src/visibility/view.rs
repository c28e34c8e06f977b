//! A rectangle of cells before an eye: a face of a hemicube, or a picture.

use glam::DVec3;

/// A grid of cells on the plane at distance 1 before the eye. Cell (x, y) is looked at through its centre,
/// along [`View::direction`]. `right`, `up` and `forward` are unit vectors at right angles, of either
/// handedness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The centre of projection.
    pub eye: DVec3,
    /// Columns run along it.
    pub right: DVec3,
    /// Rows run along it.
    pub up: DVec3,
    /// Where it looks.
    pub forward: DVec3,
    /// Where column 0 begins and the last one ends, along `right`.
    pub horizontal: [f64; 2],
    /// Where row 0 begins and the last one ends, along `up`. A picture, whose first row is its top, gives
    /// the upper edge first.
    pub vertical: [f64; 2],
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Nothing nearer than this, measured along `forward`, is seen; 0 sees all.
    pub near: f64,
    /// Nothing farther than this, measured along `forward`, is seen; may be infinite.
    pub far: f64,
}

impl View {
    /// Through the centre of cell (x, y), fractions allowed: (0.5, 0.5) past a cell's corner is its centre
    /// already, so whole numbers are what an item buffer looks through. Not normalised: its component along
    /// `forward` is 1.
    pub fn direction(&self, x: f64, y: f64) -> DVec3 {
        let h = self.horizontal[0] + (x + 0.5) * self.cell_width();
        let v = self.vertical[0] + (y + 0.5) * self.cell_height();
        self.right * h + self.up * v + self.forward
    }

    /// Signed width of a cell.
    pub fn cell_width(&self) -> f64 {
        (self.horizontal[1] - self.horizontal[0]) / self.width as f64
    }

    /// Signed height of a cell.
    pub fn cell_height(&self) -> f64 {
        (self.vertical[1] - self.vertical[0]) / self.height as f64
    }

    /// A linear form over world directions (its dot product with [`View::direction`]), as one over (x, y, 1).
    pub(crate) fn in_cells(&self, form: DVec3) -> DVec3 {
        self.local_in_cells(DVec3::new(form.dot(self.right), form.dot(self.up), form.dot(self.forward)))
    }

    /// The same of a form over directions in the view's own axes: right, up, forward.
    pub(crate) fn local_in_cells(&self, form: DVec3) -> DVec3 {
        let (dx, dy) = (self.cell_width(), self.cell_height());
        let (x0, y0) = (self.horizontal[0] + 0.5 * dx, self.vertical[0] + 0.5 * dy);
        DVec3::new(form.x * dx, form.y * dy, form.x * x0 + form.y * y0 + form.z)
    }
}
