//! Where parallelograms that are cut into grids meet smoothly along an edge: what lies beyond the border of each.

use glam::DVec3;

use super::crease::CREASE_ANGLE;
use super::smooth::{mix, neighbours};
use crate::geometry::boxes::{BoxTree, bounds};
use crate::light::Rgb;
use crate::scene::{Scene, TOUCHING};
use crate::visibility::{Cells, Facet, FacetShape, Facets};

/// Grids that others go on with: their values are told with a ring of cells about them, chosen so that what is bilinear
/// between the centres has at the border what the neighbours' has there.
///
/// A neighbour goes on with a grid along an edge where it has the same colours, where the two differ by less than 40 degrees,
/// and where nothing stands between them.
#[derive(Clone, Debug)]
pub struct Joints {
    grids: Vec<Grid>,
    /// For each grid, side by side, the grid beyond each cell.
    beyond: Vec<[Vec<Option<u32>>; 4]>,
    /// For each facet, where its values begin, and [`NONE`] where nobody goes on with it; none where nobody does at all.
    starts: Vec<u32>,
    tolerance: f64,
}

const NONE: u32 = u32::MAX;

/// A facet that is cut into a grid.
#[derive(Clone, Debug)]
struct Grid {
    facet: Facet,
    first: u32,
    cells: [u32; 2],
    /// Unit vectors inward from the sides where u = 0 and v = 0, and how far it is from there to the opposite ones.
    inward: [DVec3; 2],
    width: [f64; 2],
}

/// A side of a grid: where u (`across` 0) or v (1) is 0, or 1 where it is `far`.
#[derive(Clone, Copy, PartialEq)]
struct Side {
    across: usize,
    far: bool,
}

const SIDES: [Side; 4] = [
    Side { across: 0, far: false },
    Side { across: 0, far: true },
    Side { across: 1, far: false },
    Side { across: 1, far: true },
];

impl Grid {
    fn new(facet: &Facet) -> Option<Self> {
        let Cells::Grid { first, columns, rows } = facet.cells else { return None };
        let duals = facet.duals();
        Some(Self {
            facet: *facet,
            first,
            cells: [columns, rows],
            inward: duals.map(DVec3::normalize_or_zero),
            width: duals.map(|dual| 1.0 / dual.length()),
        })
    }

    fn inward(&self, side: Side) -> DVec3 {
        self.inward[side.across] * if side.far { -1.0 } else { 1.0 }
    }

    /// The side of the grid that a point is on.
    fn side_at(&self, point: DVec3, tolerance: f64) -> Option<Side> {
        let to = point - self.facet.origin;
        if to.dot(self.facet.normal).abs() > tolerance {
            return None;
        }
        // How far it is within each side.
        let within = SIDES.map(|side| {
            let from_near = to.dot(self.inward[side.across]);
            if side.far { self.width[side.across] - from_near } else { from_near }
        });
        let nearest = (0..4).min_by(|&i, &j| within[i].total_cmp(&within[j]))?;
        (within[nearest].abs() <= tolerance).then_some(SIDES[nearest])
    }

    /// The point (s, t) of the facet.
    fn point(&self, [s, t]: [f64; 2]) -> DVec3 {
        self.facet.origin + self.facet.u * s + self.facet.v * t
    }

    /// The middle of a cell's edge on a side.
    fn middle(&self, side: Side, cell: u32) -> DVec3 {
        let mut at = [0.0; 2];
        at[side.across] = if side.far { 1.0 } else { 0.0 };
        at[1 - side.across] = (f64::from(cell) + 0.5) / f64::from(self.cells[1 - side.across]);
        self.point(at)
    }

    /// The value at a point, as if nobody went on with it.
    fn alone(&self, values: &[Rgb], point: DVec3) -> Rgb {
        let (u, v) = self.facet.uv(point);
        let [columns, rows] = self.cells;
        let (left, right, s) = neighbours(u, columns);
        let (lower, upper, t) = neighbours(v, rows);
        let patch = |column: u32, row: u32| values[(self.first + row * columns + column) as usize];
        let below = mix(patch(left, lower), patch(right, lower), s);
        mix(below, mix(patch(left, upper), patch(right, upper), s), t)
    }

    /// How far the centres of the outermost cells are from a side. \[length\]
    fn half_cell(&self, side: Side) -> f64 {
        0.5 * self.width[side.across] / f64::from(self.cells[side.across])
    }

    /// Where a cell is in the values with a ring about them, its column and row counted from -1.
    fn ringed(&self, at: [i64; 2]) -> usize {
        ((at[1] + 1) * (i64::from(self.cells[0]) + 2) + at[0] + 1) as usize
    }
}

impl Joints {
    /// Those of `facets`, made of `scene`.
    pub fn new(scene: &Scene, facets: &Facets) -> Self {
        let (numbers, grids): (Vec<u32>, Vec<Grid>) = (0..)
            .zip(facets.as_slice())
            .filter_map(|(number, facet)| Some((number, Grid::new(facet)?)))
            .unzip();
        let tolerance = TOUCHING * facets.extent();
        let beyond = beyond(scene, facets, &grids, tolerance);
        let (mut starts, mut start) = (Vec::new(), 0);
        for ((grid, number), beyond) in grids.iter().zip(numbers).zip(&beyond) {
            if beyond.iter().flatten().any(Option::is_some) {
                starts.resize(facets.as_slice().len(), NONE);
                starts[number as usize] = start;
                start += grid.cells.map(|cells| cells + 2).iter().product::<u32>();
            }
        }
        Self { grids, beyond, starts, tolerance }
    }

    /// Where the values of a facet begin among those of all; `None` where nobody goes on with it.
    #[inline]
    pub fn start(&self, facet: u32) -> Option<u32> {
        self.starts.get(facet as usize).copied().filter(|&start| start != NONE)
    }

    /// Of `values`, one a patch, those of all grids that others go on with: row by row, a column and a row more on every
    /// side.
    pub fn values(&self, values: &[Rgb]) -> Vec<Rgb> {
        let goes_on = |&index: &usize| self.beyond[index].iter().flatten().any(Option::is_some);
        (0..self.grids.len()).filter(goes_on).flat_map(|index| self.ringed(index, values)).collect()
    }

    /// The value at (u, v) of a facet that is cut into a grid, of those that [`Joints::values`] gave, where others go on with it.
    #[inline]
    pub(super) fn at(
        &self,
        ringed: &[Rgb],
        facet: u32,
        [columns, rows]: [u32; 2],
        u: f64,
        v: f64,
    ) -> Option<Rgb> {
        let start = self.start(facet)?;
        let place = |s: f64, cells: u32| {
            let along = (s * f64::from(cells) + 0.5).max(0.0).min(f64::from(cells) + 1.0);
            let before = (along as u32).min(cells);
            (before, along - f64::from(before))
        };
        let ((column, s), (row, t)) = (place(u, columns), place(v, rows));
        let value = |column: u32, row: u32| ringed[(start + row * (columns + 2) + column) as usize];
        let below = mix(value(column, row), value(column + 1, row), s);
        Some(mix(below, mix(value(column, row + 1), value(column + 1, row + 1), s), t))
    }

    /// The grid beyond a cell of a side.
    fn other(&self, grid: usize, side: usize, cell: u32) -> Option<u32> {
        self.beyond[grid][side].get(cell as usize).copied().flatten()
    }

    /// The values of a grid's cells, with those of the ring about them.
    fn ringed(&self, index: usize, values: &[Rgb]) -> Vec<Rgb> {
        let tolerance = self.tolerance;
        let grid = &self.grids[index];
        let [columns, rows] = grid.cells.map(i64::from);
        let mut ringed = Vec::with_capacity(((columns + 2) * (rows + 2)) as usize);
        let own = |column: i64, row: i64| {
            let [column, row] = [column.clamp(0, columns - 1), row.clamp(0, rows - 1)];
            values[(i64::from(grid.first) + row * columns + column) as usize]
        };
        for row in -1..=rows {
            ringed.extend((-1..=columns).map(|column| own(column, row)));
        }
        for (k, side) in SIDES.into_iter().enumerate() {
            for cell in 0..grid.cells[1 - side.across] {
                let Some(other) = self.other(index, k, cell) else { continue };
                let (other, point) = (&self.grids[other as usize], grid.middle(side, cell));
                let Some(its) = other.side_at(point, tolerance) else { continue };
                // What is linear from the one's centres to the other's has this at the border.
                let (here, there) = (grid.half_cell(side), other.half_cell(its));
                let mut at = [i64::from(cell); 2];
                at[side.across] = if side.far { grid.cells[side.across].into() } else { -1 };
                let own = ringed[grid.ringed(at)];
                let border = mix(own, other.alone(values, point), here / (here + there));
                ringed[grid.ringed(at)] = border * 2.0 - own;
            }
        }
        for [far_u, far_v] in [[false, false], [true, false], [false, true], [true, true]] {
            let corner = grid.point([far_u, far_v].map(|far| if far { 1.0 } else { 0.0 }));
            let meeting = self.meeting(index, corner);
            let sum: Rgb = meeting.iter().map(|&k| self.grids[k].alone(values, corner)).sum();
            let mean = sum * (1.0 / meeting.len() as f64);
            let [inner, outer] = [
                [if far_u { columns - 1 } else { 0 }, if far_v { rows - 1 } else { 0 }],
                [if far_u { columns } else { -1 }, if far_v { rows } else { -1 }],
            ];
            let at = |at: [i64; 2]| ringed[grid.ringed(at)];
            let others = at(inner) + at([outer[0], inner[1]]) + at([inner[0], outer[1]]);
            ringed[grid.ringed(outer)] = mean * 4.0 - others;
        }
        ringed
    }

    /// The grids that meet in a corner of one, each going on with another of them.
    fn meeting(&self, index: usize, corner: DVec3) -> Vec<usize> {
        let mut meeting = vec![index];
        let mut next = 0;
        while let Some(&index) = meeting.get(next) {
            next += 1;
            let grid = &self.grids[index];
            for (k, side) in SIDES.into_iter().enumerate() {
                let along = grid.cells[1 - side.across];
                for (cell, end) in [(0, 0.0), (along - 1, 1.0)] {
                    let mut at = [end; 2];
                    at[side.across] = if side.far { 1.0 } else { 0.0 };
                    let there = grid.point(at).distance(corner) <= 4.0 * self.tolerance;
                    if let Some(other) = self.other(index, k, cell).filter(|_| there)
                        && !meeting.contains(&(other as usize))
                    {
                        meeting.push(other as usize);
                    }
                }
            }
        }
        // The same sum for each of them, to the bit.
        meeting.sort_unstable();
        meeting
    }
}

/// For each grid, side by side, the grid that goes on beyond each cell.
fn beyond(scene: &Scene, facets: &Facets, grids: &[Grid], tolerance: f64) -> Vec<[Vec<Option<u32>>; 4]> {
    let crease = CREASE_ANGLE.to_radians().cos();
    let alike = |one: &Facet, other: &Facet| {
        let [one, other] = [one, other].map(|f| scene.surfaces[f.surface as usize].material);
        (one.diffuse, one.emission) == (other.diffuse, other.emission)
    };
    let smooth = |one: &Facet, other: &Facet| one.normal.dot(other.normal) > crease && alike(one, other);
    let box_of = |facet: &Facet, margin: f64| bounds(&facet.corners().0[..facet.corners().1], margin);
    let tree = BoxTree::new(grids.iter().map(|grid| box_of(&grid.facet, 0.0)));
    // Made when the first two meet.
    let mut all: Option<BoxTree> = None;
    let mut found = Vec::with_capacity(grids.len());
    for (index, grid) in grids.iter().enumerate() {
        let mut near = Vec::new();
        tree.overlapping(box_of(&grid.facet, tolerance), |other| {
            if other as usize != index && smooth(&grid.facet, &grids[other as usize].facet) {
                near.push(other);
            }
        });
        near.sort_unstable();
        let beyond = SIDES.map(|side| {
            let inward = grid.inward(side);
            let mut at = |cell: u32| {
                let point = grid.middle(side, cell);
                let goes_on = |other: &u32| {
                    let other = &grids[*other as usize];
                    let its = other.side_at(point, tolerance);
                    its.is_some_and(|its| other.inward(its).dot(inward) < -0.5)
                };
                let other = near.iter().copied().find(goes_on)?;
                let all = all.get_or_insert_with(|| {
                    BoxTree::new(facets.as_slice().iter().map(|facet| box_of(facet, 0.0)))
                });
                let mut stands = false;
                all.overlapping(bounds(&[point], tolerance), |third| {
                    let third = &facets[third];
                    stands |= !smooth(&grid.facet, third) && rises(&grid.facet, third, point, tolerance);
                });
                (!stands).then_some(other)
            };
            match near.is_empty() {
                true => Vec::new(),
                false => (0..grid.cells[1 - side.across]).map(&mut at).collect(),
            }
        });
        found.push(beyond);
    }
    found
}

/// Whether a facet that a point of `floor` is on rises above its front there.
fn rises(floor: &Facet, facet: &Facet, point: DVec3, tolerance: f64) -> bool {
    let to = point - facet.origin;
    if to.dot(facet.normal).abs() > tolerance {
        return false;
    }
    let [dual_u, dual_v] = facet.duals();
    let (u, v) = (to.dot(dual_u), to.dot(dual_v));
    let (off_u, off_v) = (tolerance * dual_u.length(), tolerance * dual_v.length());
    let within = match facet.shape {
        FacetShape::Triangle => u + v <= 1.0 + off_u + off_v,
        FacetShape::Parallelogram => u <= 1.0 + off_u && v <= 1.0 + off_v,
    };
    within && u >= -off_u && v >= -off_v && facet.greatest_height(point, floor.normal) > 4.0 * tolerance
}
