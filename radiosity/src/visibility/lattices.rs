//! Triangles that lie in one plane and side by side, all alike, as a hemicube draws them: one facet.
//!
//! What a triangle is cut into, or a wall modelled as a fine grid, is hundreds of patches that are a triangle each. Where they
//! make a lattice, which of them a point lies on follows from (u, v), as it does on a parallelogram cut into cells.

use std::collections::{HashMap, HashSet};

use glam::DVec3;

use super::facets::EQUAL;
use super::{Cells, Facet, FacetShape, Facets};
use crate::patches::Pieces;

/// Facets, those taken together that make lattices.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Lattices {
    /// Of a lattice, `cells` are its parallelograms, each of them two patches, and `first` is one of these.
    pub(crate) facets: Facets,
    /// For each facet that is a lattice where its patches begin; [`NO_LATTICE`] for others.
    start: Vec<u32>,
    /// The patches of all lattices: in each parallelogram that where the shares of u and v make less than 1, then the other.
    patch: Vec<u32>,
}

/// For a facet that is none.
const NO_LATTICE: u32 = u32::MAX;

/// Fewer triangles are left alone: to find the patches of a facet that carries many takes longer than to draw so few.
pub(super) const FEWEST: usize = 64;

/// Of a surface's triangles this share at least must lie beside the one before them like a lattice's, or it is not searched.
const REGULAR: f64 = 0.25;

/// No triangle.
const NONE: u32 = u32::MAX;

impl Lattices {
    /// Find those of `facets` that are `fewest` triangles or more, surface by surface, among the surfaces that have `pieces`; `None`
    /// where there are none.
    pub(super) fn new<'a>(
        facets: &[Facet],
        starts: &[u32],
        fewest: usize,
        pieces: impl Fn(usize) -> Option<&'a Pieces>,
    ) -> Option<Box<Self>> {
        let (mut together, mut ends) = (Vec::new(), vec![0]);
        let (mut start, mut patch) = (Vec::new(), Vec::new());
        for (surface, bounds) in starts.windows(2).enumerate() {
            let own = &facets[bounds[0] as usize..bounds[1] as usize];
            let found = pieces(surface).map_or_else(Vec::new, |pieces| shapes_of(pieces, own, fewest));
            let mut left = vec![true; own.len()];
            for Shape { facet, patches, triangles } in found {
                for triangle in triangles {
                    left[triangle as usize] = false;
                }
                together.push(facet);
                start.push(patch.len() as u32);
                patch.extend(patches);
            }
            together.extend(own.iter().zip(left).filter_map(|(facet, left)| left.then_some(*facet)));
            start.resize(together.len(), NO_LATTICE);
            ends.push(together.len() as u32);
        }
        let facets = (!patch.is_empty()).then(|| Facets::plain(together, ends))?;
        Some(Box::new(Self { facets, start, patch }))
    }

    /// The patches of a facet that is a lattice.
    #[inline(always)]
    pub(crate) fn patches(&self, facet: u32) -> Option<&[u32]> {
        let start = self.start[facet as usize];
        (start != NO_LATTICE).then(|| &self.patch[start as usize..])
    }

    /// The patch of a facet at (u, v), as [`Facet::patch_at`].
    pub(crate) fn patch_at(&self, facet: u32, u: f64, v: f64) -> u32 {
        let number = facet;
        let facet = &self.facets[number];
        match (self.patches(number), facet.cells) {
            (Some(patches), Cells::Grid { columns, rows, .. }) => {
                let (x, y) = (u * f64::from(columns), v * f64::from(rows));
                let (column, row) = ((x as u32).min(columns - 1), (y as u32).min(rows - 1));
                let beyond = x - f64::from(column) + y - f64::from(row) > 1.0;
                patches[(2 * (row * columns + column) + u32::from(beyond)) as usize]
            }
            _ => facet.patch_at(u, v),
        }
    }
}

/// A lattice: the facet it makes, its patches, and the triangles they are.
struct Shape {
    facet: Facet,
    patches: Vec<u32>,
    triangles: Vec<u32>,
}

/// The lattices of a surface, whose facets are its pieces.
fn shapes_of(pieces: &Pieces, facets: &[Facet], fewest: usize) -> Vec<Shape> {
    let patches_differ = pieces.patch.windows(2).all(|pair| pair[0] < pair[1]);
    let enough = facets.len() >= fewest && facets.len() == pieces.triangles.len();
    if !enough || !patches_differ || !may_be_lattice(&pieces.triangles) {
        return Vec::new();
    }
    let net = Net { triangles: &pieces.triangles, beside: beside(&pieces.triangles), fewest };
    let mut taken = vec![false; facets.len()];
    let mut shapes = Vec::new();
    for seed in 0..facets.len() as u32 {
        if taken[seed as usize] {
            continue;
        }
        // Which of its edges are the sides of parallelograms and which the diagonals, whatever makes the fewest facets tells.
        let regions = [0, 1, 2].map(|corner| net.grown(seed, corner, &taken));
        let found = regions.iter().map(|region| {
            let shapes = net.shapes(region, pieces, facets);
            let together: usize = shapes.iter().map(|shape| shape.triangles.len()).sum();
            (region.len() - together + shapes.len(), shapes)
        });
        let fewest = found.min_by_key(|(count, _)| *count).map(|(_, shapes)| shapes);
        // What they leave of the region would come to the same region again.
        for lie in regions.iter().flatten() {
            taken[lie.triangle as usize] = true;
        }
        shapes.extend(fewest.into_iter().flatten());
    }
    shapes
}

/// Whether it is worth while to look: in a lattice most triangles are the one before them, turned about the middle of an edge.
fn may_be_lattice(triangles: &[[DVec3; 3]]) -> bool {
    let turned = |[a, b, c]: [DVec3; 3], other: [DVec3; 3]| {
        // Nothing is nearer than infinity, where numbers are too great for their squares.
        let tolerance = EQUAL * (a.distance(b) + a.distance(c));
        let across = [a + b - c, b + c - a, c + a - b];
        other.iter().any(|p| across.iter().any(|q| p.distance(*q) < tolerance))
    };
    let count = triangles.windows(2).filter(|pair| turned(pair[0], pair[1])).count();
    count as f64 >= REGULAR * triangles.len() as f64
}

/// For each triangle the one on the other side of the edge from corner 0 to 1, from 1 to 2, and from 2 to 0, or [`NONE`].
fn beside(triangles: &[[DVec3; 3]]) -> Vec<[u32; 3]> {
    let mut numbers = HashMap::new();
    let mut number = |corner: DVec3| {
        let next = numbers.len() as u32;
        *numbers.entry((corner + DVec3::ZERO).to_array().map(f64::to_bits)).or_insert(next)
    };
    let mut edges = Vec::with_capacity(3 * triangles.len());
    for (triangle, corners) in triangles.iter().zip(0_u32..).map(|(corners, k)| (k, corners)) {
        let corners = corners.map(&mut number);
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            edges.push((a.min(b), a.max(b), triangle, k));
        }
    }
    edges.sort_unstable();
    let mut beside = vec![[NONE; 3]; triangles.len()];
    for edge in edges.chunk_by(|one, other| (one.0, one.1) == (other.0, other.1)) {
        if let &[(_, _, one, k), (_, _, other, l)] = edge {
            beside[one as usize][k] = other;
            beside[other as usize][l] = one;
        }
    }
    beside
}

/// A triangle in a lattice of parallelograms, each parted by the diagonal between the corners at (1, 0) and (0, 1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Lie {
    row: i32,
    column: i32,
    /// Whether it is that beyond the diagonal.
    beyond: bool,
    triangle: u32,
    /// Which of its corners faces the diagonal.
    corner: usize,
}

/// Triangles, and which share edges.
struct Net<'a> {
    triangles: &'a [[DVec3; 3]],
    beside: Vec<[u32; 3]>,
    fewest: usize,
}

impl Net<'_> {
    /// The lattice about a triangle, `corner` of which faces the diagonal; in rows.
    fn grown(&self, seed: u32, corner: usize, taken: &[bool]) -> Vec<Lie> {
        let [origin, next, last] = self.corners(seed, corner);
        let (u, v) = (next - origin, last - origin);
        let tolerance = EQUAL * (u.length() + v.length());
        let mut found = vec![Lie { row: 0, column: 0, beyond: false, triangle: seed, corner }];
        // A surface that winds over itself, like a ramp pressed flat, comes to one place again.
        let (mut seen, mut places_seen) = (HashSet::from([seed]), HashSet::from([[0, 0, 0]]));
        let mut done = 0;
        while let Some(&Lie { row, column, beyond, triangle, corner }) = found.get(done) {
            done += 1;
            for edge in 0..3 {
                let other = self.beside[triangle as usize][(corner + edge) % 3];
                if other == NONE || taken[other as usize] || seen.contains(&other) {
                    continue;
                }
                let [right, up] = match (edge, beyond) {
                    (0, false) => [0, -1],
                    (2, false) => [-1, 0],
                    (0, true) => [0, 1],
                    (2, true) => [1, 0],
                    _ => [0, 0],
                };
                let (row, column, beyond) = (row + up, column + right, !beyond);
                // The corners from the one that faces the diagonal, where they should be.
                let places = match beyond {
                    false => [[0, 0], [1, 0], [0, 1]],
                    true => [[1, 1], [0, 1], [1, 0]],
                };
                let places = places.map(|[x, y]| origin + u * f64::from(column + x) + v * f64::from(row + y));
                let near = |p: &DVec3, q: &DVec3| p.distance(*q) < tolerance;
                let fits = |&corner: &usize| {
                    self.corners(other, corner).iter().zip(&places).all(|(p, q)| near(p, q))
                };
                if let Some(corner) = (0..3).find(fits)
                    && places_seen.insert([row, column, i32::from(beyond)])
                {
                    seen.insert(other);
                    found.push(Lie { row, column, beyond, triangle: other, corner });
                }
            }
        }
        found.sort_unstable();
        found
    }

    /// A triangle's corners, from one of them on.
    fn corners(&self, triangle: u32, first: usize) -> [DVec3; 3] {
        let corners = self.triangles[triangle as usize];
        [0, 1, 2].map(|k| corners[(first + k) % 3])
    }

    /// The triangle or the parallelograms that part of a lattice makes, those of few triangles left out.
    fn shapes(&self, region: &[Lie], pieces: &Pieces, facets: &[Facet]) -> Vec<Shape> {
        if region.len() < self.fewest {
            return Vec::new();
        }
        if let Some(shape) = self.triangle(region, pieces, facets) {
            return vec![shape];
        }
        // Rows of whole parallelograms, each onto the one below where that begins and ends alike.
        let mut blocks: Vec<(Vec<[&Lie; 2]>, usize)> = Vec::new();
        let mut newest = HashMap::new();
        for row in region.chunk_by(|one, other| one.row == other.row) {
            let whole: Vec<_> = row
                .windows(2)
                .filter(|pair| pair[0].column == pair[1].column)
                .map(|pair| [&pair[0], &pair[1]])
                .collect();
            for run in whole.chunk_by(|one, other| one[0].column + 1 == other[0].column) {
                let block = newest.entry((run[0][0].column, run.len())).or_insert(blocks.len());
                match blocks.get_mut(*block) {
                    Some((block, columns)) if block[block.len() - *columns][0].row + 1 == row[0].row => {
                        block.extend(run);
                    }
                    _ => {
                        *block = blocks.len();
                        blocks.push((run.to_vec(), run.len()));
                    }
                }
            }
        }
        blocks.retain(|(block, _)| 2 * block.len() >= self.fewest);
        let shape = |(block, columns): (Vec<[&Lie; 2]>, usize)| {
            let [origin, next, last] = [0, columns - 1, block.len() - columns].map(|k| block[k][0]);
            let triangles: Vec<u32> = block.iter().flatten().map(|lie| lie.triangle).collect();
            let cells = [columns, block.len() / columns].map(|count| count as u32);
            let facet = self.facet([origin, next, last], FacetShape::Parallelogram, cells, pieces, facets);
            let patches = triangles.iter().map(|&triangle| pieces.patch[triangle as usize]).collect();
            Shape { facet, patches, triangles }
        };
        blocks.into_iter().map(shape).collect()
    }

    /// A triangle cut into k² like itself.
    fn triangle(&self, region: &[Lie], pieces: &Pieces, facets: &[Facet]) -> Option<Shape> {
        let [row, column] = [|lie: &Lie| lie.row, |lie: &Lie| lie.column]
            .map(|of| region.iter().map(of).fold(i32::MAX, i32::min));
        let along = region.len().isqrt();
        let lies_in = |lie: &Lie| {
            let reach = (lie.row - row) as usize + (lie.column - column) as usize + usize::from(lie.beyond);
            reach < along
        };
        if along * along != region.len() || !region.iter().all(lies_in) {
            return None;
        }
        // What lies beyond its longest row of parallelograms is asked for by rounding errors alone.
        let mut lies = region.iter().peekable();
        let mut patches = Vec::with_capacity(2 * along * along);
        let mut ends = Vec::with_capacity(along);
        for _ in 0..along {
            let begin = lies.peek()?;
            let (in_row, start) = (begin.row, patches.len());
            let mut end = *begin;
            while let Some(lie) = lies.next_if(|lie| lie.row == in_row) {
                patches.push(pieces.patch[lie.triangle as usize]);
                end = lie;
            }
            ends.push(end);
            patches.resize(start + 2 * along, pieces.patch[end.triangle as usize]);
        }
        let corners = [&region[0], ends[0], ends[along - 1]];
        let cells = [along as u32; 2];
        let facet = self.facet(corners, FacetShape::Triangle, cells, pieces, facets);
        Some(Shape { facet, patches, triangles: region.iter().map(|lie| lie.triangle).collect() })
    }

    /// The facet whose corners are the first corner of one triangle, the second of another, and the third of a third.
    fn facet(
        &self,
        [origin, next, last]: [&Lie; 3],
        shape: FacetShape,
        [columns, rows]: [u32; 2],
        pieces: &Pieces,
        facets: &[Facet],
    ) -> Facet {
        let corner = |lie: &Lie, k: usize| self.corners(lie.triangle, lie.corner)[k];
        let at = corner(origin, 0);
        let first = pieces.patch[origin.triangle as usize];
        Facet {
            origin: at,
            u: corner(next, 1) - at,
            v: corner(last, 2) - at,
            shape,
            cells: Cells::Grid { first, columns, rows },
            ..facets[origin.triangle as usize]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turn() -> glam::DMat3 {
        glam::DMat3::from_axis_angle(DVec3::new(0.36, 0.48, 0.8), 1.1)
    }

    /// A wall of 5 x 4 parallelograms in two triangles each, in an order where these follow each other.
    fn wall(keep: impl Fn(u32, u32) -> bool) -> Vec<[DVec3; 3]> {
        let at = |x: u32, y: u32| {
            turn() * DVec3::new(f64::from(x) * 0.3 + f64::from(y) * 0.1 + 7.0, f64::from(y) * 0.37, 2.0)
        };
        let mut cells: Vec<_> = (0..4).flat_map(|y| (0..5).map(move |x| (x, y))).collect();
        cells.sort_by_key(|&(x, y)| (x * 7 + y * 11) % 13);
        let cells = cells.into_iter().filter(|&(x, y)| keep(x, y));
        let halves = |(x, y)| {
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            // Whichever corner comes first.
            if (x + y) % 2 == 0 { [[a, b, c], [c, d, a]] } else { [[b, c, a], [a, c, d]] }
        };
        cells.flat_map(halves).collect()
    }

    /// The lattices of such a surface, after making sure that every patch lies where it should.
    fn lattices(triangles: &[[DVec3; 3]]) -> Option<Box<Lattices>> {
        let patch: Vec<u32> = (10..).take(triangles.len()).collect();
        let pieces = Pieces { triangles: triangles.to_vec(), patch, smooth: false, sharp: Vec::new() };
        let facets: Vec<Facet> = triangles
            .iter()
            .zip(&pieces.patch)
            .map(|(&[a, b, c], &patch)| Facet {
                origin: a,
                u: b - a,
                v: c - a,
                normal: (b - a).cross(c - a).normalize(),
                shape: FacetShape::Triangle,
                surface: 0,
                cells: Cells::One(patch),
            })
            .collect();
        let lattices = Lattices::new(&facets, &[0, facets.len() as u32], 4, |_| Some(&pieces))?;
        for (&[a, b, c], &patch) in triangles.iter().zip(&pieces.patch) {
            // Near its corners, and in the middle.
            let middle = (a + b + c) / 3.0;
            for point in [a, b, c, middle].map(|p| middle + (p - middle) * 0.99) {
                let on = lattices.facets.as_slice().iter().zip(0_u32..).filter(|(facet, _)| {
                    let (u, v) = facet.uv(point);
                    let most = if facet.shape == FacetShape::Triangle { u + v } else { u.max(v) };
                    u >= 0.0 && v >= 0.0 && most <= 1.0
                });
                let found: Vec<u32> = on
                    .map(|(facet, number)| {
                        let (u, v) = facet.uv(point);
                        lattices.patch_at(number, u, v)
                    })
                    .collect();
                assert_eq!(found, [patch]);
            }
        }
        for facet in lattices.facets.as_slice() {
            assert!(facet.normal.dot(facet.u.cross(facet.v).normalize()) > 1.0 - 1e-12);
        }
        Some(lattices)
    }

    fn count(triangles: &[[DVec3; 3]]) -> usize {
        lattices(triangles).map_or(triangles.len(), |lattices| lattices.facets.as_slice().len())
    }

    #[test]
    fn a_wall_of_triangles_is_one_facet() {
        assert_eq!(count(&wall(|_, _| true)), 1);
        // One with a window is four or so, and one in two parts two.
        assert!(count(&wall(|x, y| x.abs_diff(2) > 0 || y.abs_diff(2) > 0)) <= 5);
        assert_eq!(count(&wall(|x, _| x != 2)), 2);
        // Bent along the middle: two.
        let mut bent = wall(|_, _| true);
        for corner in bent.iter_mut().flatten() {
            let above = (turn().transpose() * *corner).y - 2.0 * 0.37;
            *corner += turn() * DVec3::Z * above.max(0.0);
        }
        assert_eq!(count(&bent), 2);
    }

    #[test]
    fn what_a_triangle_is_cut_into_is_one_facet() {
        let [a, b, c] = [DVec3::new(3.0, 1.0, 0.2), DVec3::new(4.1, 1.3, 0.9), DVec3::new(3.2, 2.7, -0.4)];
        for k in 2..9 {
            let mut pieces = Vec::new();
            crate::geometry::refine::Parts::Equal(k).pieces([a, b, c], &mut |piece| pieces.push(piece));
            assert_eq!(count(&pieces), 1, "{k}");
            // Both halves of a wall.
            crate::geometry::refine::Parts::Equal(k).pieces([c, b, b + c - a], &mut |p| pieces.push(p));
            assert_eq!(count(&pieces), 1, "{k}");
        }
    }

    #[test]
    fn triangles_that_are_not_alike_are_left_alone() {
        let mut askew = wall(|_, _| true);
        for corner in askew.iter_mut().flatten() {
            *corner += DVec3::new((corner.x * 91.0).sin(), (corner.x * 57.0).cos(), 0.0) * 0.02;
        }
        assert_eq!(count(&askew), askew.len());
        // Alike, but for a millionth.
        let mut all_but = wall(|_, _| true);
        for corner in all_but.iter_mut().flatten() {
            *corner += DVec3::new((corner.x * 91.0).sin(), (corner.x * 57.0).cos(), 0.0) * 1e-6;
        }
        assert!(count(&all_but) > 15);
    }
}
