//! The flat pieces that visibility is asked of.

use glam::DVec3;

use super::blocks::{BlockTree, Labels};
use super::lattices::{FEWEST, Lattices};
use crate::patches::{Patches, Pieces};
use crate::scene::{Scene, Shape};

/// A parallelogram or triangle of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facet {
    /// The corner where u = v = 0.
    pub origin: DVec3,
    /// From the origin to the corner where u = 1.
    pub u: DVec3,
    /// From the origin to the corner where v = 1.
    pub v: DVec3,
    /// Unit normal of the front.
    pub normal: DVec3,
    /// How far u and v reach.
    pub shape: FacetShape,
    /// The surface it is a piece of.
    pub surface: u32,
    /// The patches on it.
    pub cells: Cells,
}

/// The domain of a facet's (u, v).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FacetShape {
    /// 0 <= u, 0 <= v, u + v <= 1.
    Triangle,
    /// 0 <= u <= 1, 0 <= v <= 1.
    Parallelogram,
}

/// Which patch lies where on a facet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cells {
    /// The facet is (part of) this patch.
    One(u32),
    /// Equal cells, columns along u first.
    Grid {
        /// The patch at u = v = 0.
        first: u32,
        /// Cells along u.
        columns: u32,
        /// Cells along v.
        rows: u32,
    },
}

/// Every facet of a scene, with the patches that they carry.
#[derive(Clone, Debug, PartialEq)]
pub struct Facets {
    facets: Vec<Facet>,
    /// For each surface, where its facets begin; one more entry ends the last.
    starts: Vec<u32>,
    /// The same facets as the item buffer draws them.
    blocks: BlockTree,
    /// Their numbers, as a picture wants them put into its cells.
    numbers: Labels,
    /// Fewer facets, where some can be taken together.
    fewer: Option<Box<Facets>>,
    /// And fewer still, as hemicubes draw them, where triangles make lattices.
    lattices: Option<Box<Lattices>>,
}

/// What a facet's number is marked with while its back is what is seen.
pub(super) const BACK: u32 = 1 << 30;

/// Cells that differ by less than this, relative to their size, are equal.
pub(super) const EQUAL: f64 = 1e-9;

impl Facets {
    /// The facets of `scene`, numbered in its order, carrying `patches` (which were cut from that scene).
    pub fn new(scene: &Scene, patches: &Patches) -> Self {
        let mut facets = Vec::new();
        let mut starts = vec![0];
        let surfaces = scene.surfaces.iter().zip(&patches.blocks).zip(&patches.pieces);
        for (((surface, block), pieces), index) in surfaces.zip(0..) {
            match pieces {
                Some(pieces) => {
                    // A polygon may be out of its plane by a little, but as one patch it has one normal.
                    let normal = match &surface.shape {
                        Shape::Polygon(_) if block.patches().len() == 1 => {
                            Some(patches.normal[block.first as usize])
                        }
                        _ => None,
                    };
                    facets.extend(pieces.triangles.iter().zip(&pieces.patch).map(|(&[a, b, c], &patch)| {
                        Facet {
                            origin: a,
                            u: b - a,
                            v: c - a,
                            normal: normal.unwrap_or_else(|| (b - a).cross(c - a).normalize_or_zero()),
                            shape: FacetShape::Triangle,
                            surface: index,
                            cells: Cells::One(patch),
                        }
                    }));
                }
                None => facets.extend(surface.shape.parallelogram().map(|p| Facet {
                    origin: p.origin,
                    u: p.u,
                    v: p.v,
                    normal: p.normal,
                    shape: FacetShape::Parallelogram,
                    surface: index,
                    cells: Cells::Grid { first: block.first, columns: block.columns, rows: block.rows },
                })),
            }
            starts.push(facets.len() as u32);
        }
        // Only what is split has edges that something may stand on.
        let split = |pieces: &Option<Pieces>| pieces.as_ref().is_some_and(|pieces| !pieces.sharp.is_empty());
        let fewer = patches.pieces.iter().any(split).then(|| {
            let (mut together, mut ends) = (Vec::new(), vec![0]);
            for (index, (surface, pieces)) in scene.surfaces.iter().zip(&patches.pieces).enumerate() {
                let own = &facets[starts[index] as usize..starts[index + 1] as usize];
                if split(pieces) {
                    let along = surface.shape.parallelogram().map(|p| p.u);
                    taken_together(own, along, &mut together);
                } else {
                    together.extend_from_slice(own);
                }
                ends.push(together.len() as u32);
            }
            Self::plain(together, ends)
        });
        let lattices = |facets: &Self| {
            let pieces = |surface: usize| patches.pieces[surface].as_ref();
            Lattices::new(&facets.facets, &facets.starts, FEWEST, |surface| {
                pieces(surface).filter(|_| !split(&patches.pieces[surface]))
            })
        };
        let facets = Self::plain(facets, starts);
        match fewer {
            Some(fewer) => {
                let lattices = lattices(&fewer);
                Self { fewer: Some(Box::new(Self { lattices, ..fewer })), ..facets }
            }
            None => Self { lattices: lattices(&facets), ..facets },
        }
    }

    /// These, none taken together.
    pub(super) fn plain(facets: Vec<Facet>, starts: Vec<u32>) -> Self {
        let blocks = BlockTree::new(&facets);
        let numbers = Labels::new(&blocks, |number| number, |number| number | BACK);
        Self { facets, starts, blocks, numbers, fewer: None, lattices: None }
    }

    /// The same, with as few facets as it takes to tell which patch is seen: of a surface that is split or refined, patches that
    /// are parallelograms or triangles are one facet each, and of a parallelogram equal ones side by side are taken
    /// together. For hemicubes and rays; what is shaded is told apart by the pieces.
    pub fn fewest(&self) -> &Self {
        self.fewer.as_deref().unwrap_or(self)
    }

    /// The same as hemicubes draw them, where that is another thing.
    pub(crate) fn lattices(&self) -> Option<&Lattices> {
        self.lattices.as_deref()
    }

    /// All of them.
    pub fn as_slice(&self) -> &[Facet] {
        &self.facets
    }

    /// Sixteen at a time, for drawing.
    pub(super) fn blocks(&self) -> &BlockTree {
        &self.blocks
    }

    /// Each facet's number, seen from behind with [`BACK`].
    pub(super) fn numbers(&self) -> &Labels {
        &self.numbers
    }

    /// Labels for who draws these facets: of their fronts and of their backs, by number.
    pub(crate) fn labels(&self, front: impl Fn(u32) -> u32, back: impl Fn(u32) -> u32) -> Labels {
        Labels::new(&self.blocks, front, back)
    }

    /// The longest side of the box about all of them.
    pub fn extent(&self) -> f64 {
        let corners = self.facets.iter().flat_map(|facet| {
            let (corners, count) = facet.corners();
            corners.into_iter().take(count)
        });
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (low, high) = corners.fold(none, |(low, high), c| (low.min(c), high.max(c)));
        (high - low).max_element().max(0.0)
    }

    /// The facets, by number, of a surface.
    pub fn of_surface(&self, surface: u32) -> std::ops::Range<u32> {
        self.starts[surface as usize]..self.starts[surface as usize + 1]
    }
}

/// The triangles of a split surface, those that make one parallelogram or triangle of a patch as one facet, with the equal cells
/// after it in its row, and the rows after that. `along` is the direction of rows, where there are any.
fn taken_together(triangles: &[Facet], along: Option<DVec3>, put: &mut Vec<Facet>) {
    let begin = put.len();
    let mut patches = triangles.chunk_by(|one, other| one.cells == other.cells).peekable();
    while let Some(pieces) = patches.next() {
        let cell = match (pieces, whole(pieces, along)) {
            ([_], _) | (_, None) => {
                put.extend_from_slice(pieces);
                continue;
            }
            (_, Some(cell)) => cell,
        };
        // Onto the row that it goes on with, or as the first of its own.
        match put[begin..].last_mut().and_then(|row| Some((beside(row, &cell, [1, 0])?, row))) {
            Some((longer, row)) => *row = longer,
            None => put.push(cell),
        }
        // A row that the next one is not on to may lie on the rows before it.
        let next = patches.peek().and_then(|pieces| whole(pieces, along));
        let ends = next.is_none_or(|next| put.last().is_none_or(|row| beside(row, &next, [1, 0]).is_none()));
        if let (true, [.., below, row]) = (ends, &mut put[begin..])
            && let Some(higher) = beside(below, row, [0, 1])
        {
            *below = higher;
            put.pop();
        }
    }
}

/// The triangles of a patch as the parallelogram or triangle that they make; u of a parallelogram is the side nearest to
/// `along`.
fn whole(pieces: &[Facet], along: Option<DVec3>) -> Option<Facet> {
    let Cells::One(patch) = pieces.first()?.cells else { return None };
    let edges: Vec<[DVec3; 2]> = pieces
        .iter()
        .flat_map(|piece| {
            let ([a, b, c, _], _) = piece.corners();
            // A corner comes by the same sum wherever it is another piece's origin or end.
            [[a, b], [b, c], [c, a]]
        })
        .collect();
    let tolerance = EQUAL * edges.iter().map(|[a, b]| a.distance(*b)).fold(0.0, f64::max);
    let near = |p: DVec3, q: DVec3| p.distance(q) <= tolerance;
    let mut border: Vec<[DVec3; 2]> = edges
        .iter()
        .filter(|[a, b]| !edges.iter().any(|[c, d]| near(*a, *d) && near(*b, *c)))
        .copied()
        .collect();
    let mut outline = Vec::with_capacity(border.len());
    let [start, mut at] = border.pop()?;
    outline.push(start);
    while !near(at, start) {
        let next = border.iter().position(|&[from, _]| near(from, at))?;
        outline.push(at);
        at = border.swap_remove(next)[1];
    }
    let count = outline.len();
    let corner = |k: usize| {
        let (last, next) = (outline[(k + count - 1) % count], outline[(k + 1) % count]);
        let [before, after] = [outline[k] - last, next - outline[k]];
        before.cross(after).length() > EQUAL * before.length() * after.length()
    };
    let corners: Vec<DVec3> = (0..count).filter(|&k| corner(k)).map(|k| outline[k]).collect();
    if !border.is_empty() {
        return None;
    }
    let one = &pieces[0];
    match corners[..] {
        [a, b, c] => Some(Facet { origin: a, u: b - a, v: c - a, ..*one }),
        [a, b, c, d] if near(a + c, b + d) => {
            let towards = along.unwrap_or(one.u);
            let side = |k: usize| (corners[(k + 1) % 4] - corners[k]).normalize_or_zero().dot(towards);
            let k = (1..4).fold(0, |best, k| if side(k) > side(best) { k } else { best });
            let [origin, next, last] = [k, k + 1, k + 3].map(|k| corners[k % 4]);
            Some(Facet {
                origin,
                u: next - origin,
                v: last - origin,
                shape: FacetShape::Parallelogram,
                cells: Cells::Grid { first: patch, columns: 1, rows: 1 },
                ..*one
            })
        }
        _ => None,
    }
}

/// Two grids of equal cells as one, where the second goes on with the first along u (`step` is \[1, 0\]) or v (\[0, 1\]), in
/// place and in number.
fn beside(one: &Facet, other: &Facet, step: [u32; 2]) -> Option<Facet> {
    let (Cells::Grid { first, columns, rows }, Cells::Grid { first: next, columns: wide, rows: high }) =
        (one.cells, other.cells)
    else {
        return None;
    };
    let [along_u, along_v] = step.map(f64::from);
    let origin = one.origin + one.u * along_u + one.v * along_v;
    let cell =
        |facet: &Facet, columns: u32, rows: u32| [facet.u / f64::from(columns), facet.v / f64::from(rows)];
    let (mine, its) = (cell(one, columns, rows), cell(other, wide, high));
    let near = |p: DVec3, q: DVec3| p.distance(q) <= EQUAL * (mine[0].length() + mine[1].length());
    let fits = match step {
        [1, 0] => rows == 1 && high == 1,
        _ => columns == wide,
    };
    let goes_on = fits && next == first + columns * rows;
    let joined = match step {
        [1, 0] => Facet {
            u: other.origin + other.u - one.origin,
            cells: Cells::Grid { first, columns: columns + wide, rows },
            ..*one
        },
        _ => Facet {
            v: other.origin + other.v - one.origin,
            cells: Cells::Grid { first, columns, rows: rows + high },
            ..*one
        },
    };
    (goes_on && near(origin, other.origin) && near(mine[0], its[0]) && near(mine[1], its[1]))
        .then_some(joined)
}

impl std::ops::Index<u32> for Facets {
    type Output = Facet;
    fn index(&self, facet: u32) -> &Facet {
        &self.facets[facet as usize]
    }
}

impl Facet {
    /// The corners, counter-clockwise about `u × v`, and how many of them count.
    pub fn corners(&self) -> ([DVec3; 4], usize) {
        let (a, b, c) = (self.origin, self.origin + self.u, self.origin + self.v);
        match self.shape {
            FacetShape::Triangle => ([a, b, c, c], 3),
            FacetShape::Parallelogram => ([a, b, b + self.v, c], 4),
        }
    }

    /// The vectors by which a point of the plane has u = (p - origin) · first and v = (p - origin) · second.
    pub fn duals(&self) -> [DVec3; 2] {
        let cross = self.u.cross(self.v);
        let scale = 1.0 / cross.length_squared();
        [self.v.cross(cross) * scale, cross.cross(self.u) * scale]
    }

    /// (u, v) of a point of the facet's plane; not clamped.
    pub fn uv(&self, point: DVec3) -> (f64, f64) {
        let [dual_u, dual_v] = self.duals();
        let p = point - self.origin;
        (p.dot(dual_u), p.dot(dual_v))
    }

    /// How far the facet rises above the plane through `point` with this unit normal; negative where all of it
    /// lies below.
    pub fn greatest_height(&self, point: DVec3, normal: DVec3) -> f64 {
        let (u, v) = (normal.dot(self.u), normal.dot(self.v));
        let above_origin = match self.shape {
            FacetShape::Triangle => u.max(v).max(0.0),
            FacetShape::Parallelogram => u.max(0.0) + v.max(0.0),
        };
        normal.dot(self.origin - point) + above_origin
    }

    /// Whether `eye` is on the side of the front.
    pub fn faces(&self, eye: DVec3) -> bool {
        self.normal.dot(eye - self.origin) > 0.0
    }

    /// The patch at (u, v), which may lie outside the facet by a rounding error.
    pub fn patch_at(&self, u: f64, v: f64) -> u32 {
        match self.cells {
            Cells::One(patch) => patch,
            Cells::Grid { first, columns, rows } => {
                let column = ((u * f64::from(columns)) as u32).min(columns - 1);
                let row = ((v * f64::from(rows)) as u32).min(rows - 1);
                first + row * columns + column
            }
        }
    }

    /// Where the ray `eye + t direction` meets the facet's plane: t, which may be negative or not finite.
    pub fn plane_distance(&self, eye: DVec3, direction: DVec3) -> f64 {
        self.normal.dot(self.origin - eye) / self.normal.dot(direction)
    }
}
