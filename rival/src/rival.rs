//! Embree's hemicubes, by the C beside this file.

use glam::{DVec3, Vec3};
use radiosity::form_factors::hemicube::{CellWeights, Face, frame};
use radiosity::patches::Patches;
use radiosity::visibility::{Cells, FacetShape, Facets};

const LANES: usize = 16;

/// Nothing nearer than this, relative to the scene's extent, is hit: the patch's own surface, whose float corners may lie
/// a rounding error before the patch. The flattest rays of a hemicube of 100 rise 1 in 100.
const NEAR: f64 = 2e-5;

/// As in embree.c.
#[repr(C)]
struct FlatFacet {
    corners: [[f32; 3]; 4],
    count: u32,
    first: u32,
    columns: u32,
    rows: u32,
}

/// As in embree.c.
#[repr(C)]
#[derive(Clone)]
struct Packet {
    x: [f32; LANES],
    y: [f32; LANES],
    normal: [f32; LANES],
    valid: [i32; LANES],
    cell: [i32; LANES],
    weight: [f64; LANES],
    sum: f64,
}

/// Embree wants `valid` at an address of whole registers.
#[repr(C, align(64))]
#[derive(Clone)]
struct Aligned(Packet);

enum Opaque {}

unsafe extern "C" {
    fn rival_new(facets: *const FlatFacet, count: u32, patches: u32, robust: i32) -> *mut Opaque;
    fn rival_free(rival: *mut Opaque);
    fn rival_about(rival: *const Opaque, about: *mut [i64; 2]);
    fn rival_cast(
        rival: *const Opaque,
        packets: *const Aligned,
        count: u32,
        centre: *const [f32; 3],
        axes: *const [[f32; 3]; 3],
        near: f32,
        row: *mut f64,
        seen: *mut u32,
    );
    fn rival_seconds() -> f64;
}

/// The processor time that this thread has taken.
pub fn seconds() -> f64 {
    // SAFETY: it takes nothing.
    unsafe { rival_seconds() }
}

/// A scene in Embree's hands, and the rays of a hemicube.
pub struct Embree<'a> {
    patches: &'a Patches,
    packets: Vec<Aligned>,
    near: f32,
    rival: *mut Opaque,
}

impl<'a> Embree<'a> {
    pub fn new(patches: &'a Patches, facets: &Facets, weights: &CellWeights, robust: bool) -> Self {
        let flat: Vec<_> = facets
            .as_slice()
            .iter()
            .map(|facet| {
                let (corners, count) = facet.corners();
                assert!(count == if facet.shape == FacetShape::Triangle { 3 } else { 4 });
                let (first, columns, rows) = match facet.cells {
                    Cells::One(patch) => (patch, 1, 1),
                    Cells::Grid { first, columns, rows } => (first, columns, rows),
                };
                let corners = corners.map(|c| c.as_vec3().to_array());
                FlatFacet { corners, count: count as u32, first, columns, rows }
            })
            .collect();
        // SAFETY: the pointer and the count are of one slice; the C copies what it needs.
        let rival =
            unsafe { rival_new(flat.as_ptr(), flat.len() as u32, patches.len() as u32, robust.into()) };
        assert!(!rival.is_null(), "Embree gives no device");
        Self { patches, packets: packets(weights), near: (NEAR * facets.extent()) as f32, rival }
    }

    /// Version and whether packets of 16 are traced as such.
    pub fn about(&self) -> (i64, bool) {
        let mut about = [0; 2];
        // SAFETY: `rival` lives as long as self.
        unsafe { rival_about(self.rival, &mut about) };
        (about[0], about[1] != 0)
    }

    /// Add row i to `row`, zeros with one more entry than there are patches (for what is missed), and write the
    /// patch of each cell, face after face, into `seen` where that is wanted.
    pub fn cast(&self, patch: usize, row: &mut [f64], seen: Option<&mut [u32]>) {
        assert!(row.len() == self.patches.len() + 1);
        self.call(patch, row.as_mut_ptr(), seen.map_or(std::ptr::null_mut(), |seen| seen.as_mut_ptr()));
    }

    /// Trace the rays and forget what they hit.
    pub fn trace(&self, patch: usize) {
        self.call(patch, std::ptr::null_mut(), std::ptr::null_mut());
    }

    fn call(&self, patch: usize, row: *mut f64, seen: *mut u32) {
        let centre = self.patches.centre[patch].as_vec3().to_array();
        let axes = frame(self.patches, patch).map(|axis| axis.as_vec3().to_array());
        let count = self.packets.len() as u32;
        // SAFETY: the packets are of one slice; row and seen are long enough, or null.
        unsafe { rival_cast(self.rival, self.packets.as_ptr(), count, &centre, &axes, self.near, row, seen) };
    }
}

impl Drop for Embree<'_> {
    fn drop(&mut self) {
        // SAFETY: made by rival_new, freed once.
        unsafe { rival_free(self.rival) };
    }
}

/// The cells of a hemicube in packets of 4 x 4; the last two rows of a face whose height is no multiple of
/// four in packets of 8 x 2. Cells are numbered face after face, row by row.
fn packets(weights: &CellWeights) -> Vec<Aligned> {
    let precision = weights.precision();
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let mut packets = Vec::new();
    let mut before = 0;
    for face in Face::ALL {
        let view = face.view(DVec3::ZERO, axes, precision);
        let weight = |x, y| if face == Face::Top { weights.top(x, y) } else { weights.side(x, y) };
        let mut bottom = 0;
        while bottom < view.height {
            let rows = if view.height - bottom >= 4 { 4 } else { 2 };
            for left in (0..view.width).step_by(LANES / rows) {
                let zeros = [0.0; LANES];
                let mut packet = Packet {
                    x: zeros,
                    y: zeros,
                    normal: [1.0; LANES],
                    valid: [0; LANES],
                    cell: [-1; LANES],
                    weight: [0.0; LANES],
                    sum: 0.0,
                };
                for lane in 0..LANES {
                    let (x, y) = (left + lane % (LANES / rows), bottom + lane / (LANES / rows));
                    if x < view.width && y < view.height {
                        let Vec3 { x: along, y: across, z: up } =
                            view.direction(x as f64, y as f64).as_vec3();
                        (packet.x[lane], packet.y[lane], packet.normal[lane]) = (along, across, up);
                        packet.valid[lane] = -1;
                        packet.cell[lane] = (before + y * view.width + x) as i32;
                        packet.weight[lane] = weight(x, y);
                        packet.sum += weight(x, y);
                    }
                }
                packets.push(Aligned(packet));
            }
            bottom += rows;
        }
        before += view.width * view.height;
    }
    packets
}
