//! Triangles cut into smaller ones, so that no edge is longer than a bound and neighbours meet corner to corner.
//!
//! An edge of length ℓ is cut into ⌈ℓ / bound⌉ equal parts, whichever triangle asks: two that share an edge put the same
//! points on it, to the bit, without knowing of each other. A triangle whose three edges have k parts each is cut into k²
//! like itself; any other is parted from the middle of its longest edge, or the point next to it, and each half taken
//! likewise (longest-edge bisection: from true middles no angle falls below half the least of the triangle, Rosenberg &
//! Stenger 1975; from the points next to them few do, and not far).

use glam::DVec3;

/// A hair by which an edge may exceed the bound: three parts of a third are not four.
const ROUNDING: f64 = 1e-9;
/// Beyond this many triangles they are not counted one by one.
const COUNTED: f64 = 5e7;
/// How many more triangles the regular cut of all into k² may take than the graded one, and still be preferred: its
/// triangles are all like those they come from.
const REGULAR: f64 = 1.25;

/// How triangles are cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Parts {
    /// Every edge into so many: each triangle into their square.
    Equal(u32),
    /// Every edge into as many as leave none longer than this.
    NoLongerThan(f64),
}

impl Parts {
    /// The better way to cut all of `triangles` so that no edge is longer than `bound`: alike, where that takes hardly more
    /// of them, else each as its own edges want it; and how many it makes. That number is a lower bound where it is
    /// beyond what anybody could solve for.
    pub fn for_bound(triangles: impl Iterator<Item = [DVec3; 3]> + Clone, bound: f64) -> (Self, u64) {
        let graded = Self::NoLongerThan(bound);
        let (mut count, mut longest, mut least) = (0_u64, 0.0_f64, 0.0);
        for [a, b, c] in triangles.clone() {
            let edge = longest_edge([a, b, c]);
            // None is larger than the equilateral one.
            let area = (b - a).cross(c - a).length() * 0.5;
            least += (area / (0.433_012_701_9 * bound * bound)).max(edge / bound);
            longest = longest.max(edge);
            count += 1;
        }
        if least > COUNTED {
            return (graded, least.min(1e18) as u64);
        }
        let needed: u64 = triangles
            .map(|triangle| if longest_edge(triangle) <= bound { 1 } else { graded.count(triangle) })
            .sum();
        let k = parts(longest, bound);
        let regular = u64::from(k).saturating_mul(k.into()).saturating_mul(count);
        if regular as f64 <= REGULAR * needed as f64 { (Self::Equal(k), regular) } else { (graded, needed) }
    }

    /// How many triangles one is cut into.
    fn count(self, triangle: [DVec3; 3]) -> u64 {
        let mut count = 0;
        self.cut(triangle, &mut |piece| {
            let k = u64::from(piece[0].parts());
            count += k * k;
        });
        count
    }

    /// Hand the triangles that one is cut into to `put`, each wound as it is.
    pub fn pieces(self, triangle: [DVec3; 3], put: &mut impl FnMut([DVec3; 3])) {
        self.cut(triangle, &mut |piece| regular(piece, put));
    }

    /// Halve a triangle until each piece has three edges of equally many parts.
    fn cut(self, [a, b, c]: [DVec3; 3], put: &mut impl FnMut([Edge; 3])) {
        let mut open = vec![[Edge::new(self, a, b), Edge::new(self, b, c), Edge::new(self, c, a)]];
        while let Some(edges) = open.pop() {
            let [first, second, third] = edges.map(|edge| edge.parts());
            if first == second && second == third {
                put(edges);
                continue;
            }
            let longest = (1..3)
                .fold(0, |longest, k| if edges[k].length() > edges[longest].length() { k } else { longest });
            let [base, next, last] = [0, 1, 2].map(|step| edges[(longest + step) % 3]);
            let middle = base.middle();
            let [before, after] = [Edge { to: middle, ..base }, Edge { from: middle, ..base }];
            let across = Edge::new(self, base.point(middle), last.start());
            open.push([after, next, across.turned()]);
            open.push([before, across, last]);
        }
    }
}

fn longest_edge([a, b, c]: [DVec3; 3]) -> f64 {
    a.distance(b).max(b.distance(c)).max(c.distance(a))
}

/// Into how many parts an edge is cut.
fn parts(length: f64, bound: f64) -> u32 {
    ((length / bound - ROUNDING).ceil()).clamp(1.0, 1e9) as u32
}

/// Part of an edge, from one of the points on it to another.
#[derive(Clone, Copy, Debug)]
struct Edge {
    /// The whole edge, the end that comes first in the order of coordinates first.
    ends: [DVec3; 2],
    /// The parts of the whole edge.
    whole: u32,
    from: u32,
    to: u32,
}

impl Edge {
    fn new(cut: Parts, a: DVec3, b: DVec3) -> Self {
        let (a, b) = (a + DVec3::ZERO, b + DVec3::ZERO);
        let whole = match cut {
            Parts::Equal(parts) => parts,
            Parts::NoLongerThan(bound) => parts(a.distance(b), bound),
        };
        match a.to_array().partial_cmp(&b.to_array()) {
            Some(std::cmp::Ordering::Greater) => Self { ends: [b, a], whole, from: whole, to: 0 },
            _ => Self { ends: [a, b], whole, from: 0, to: whole },
        }
    }

    fn turned(self) -> Self {
        Self { from: self.to, to: self.from, ..self }
    }

    fn parts(&self) -> u32 {
        self.from.abs_diff(self.to)
    }

    fn length(&self) -> f64 {
        self.ends[0].distance(self.ends[1]) * f64::from(self.parts()) / f64::from(self.whole)
    }

    /// The point in the middle, or the one before it; the same whichever way the edge runs.
    fn middle(&self) -> u32 {
        self.from.min(self.to) + self.parts() / 2
    }

    fn point(&self, at: u32) -> DVec3 {
        let [a, b] = self.ends;
        if at == 0 {
            a
        } else if at == self.whole {
            b
        } else {
            a + (b - a) * (f64::from(at) / f64::from(self.whole))
        }
    }

    fn start(&self) -> DVec3 {
        self.point(self.from)
    }

    /// The k-th point from the start.
    fn step(&self, k: u32) -> DVec3 {
        self.point(if self.to > self.from { self.from + k } else { self.from - k })
    }
}

/// k² like itself, of a triangle whose edges have k parts each.
fn regular(edges: [Edge; 3], put: &mut impl FnMut([DVec3; 3])) {
    let [left, base, right] = edges;
    let (k, right) = (left.parts(), right.turned());
    // Rows from the first corner to the edge across.
    let point = |row: u32, at: u32| {
        if at == 0 {
            left.step(row)
        } else if at == row {
            right.step(row)
        } else if row == k {
            base.step(at)
        } else {
            left.step(row).lerp(right.step(row), f64::from(at) / f64::from(row))
        }
    };
    for row in 0..k {
        for at in 0..=row {
            put([point(row, at), point(row + 1, at), point(row + 1, at + 1)]);
            if at < row {
                put([point(row, at), point(row + 1, at + 1), point(row, at + 1)]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use proptest::prelude::*;

    use super::*;

    fn cut(triangles: &[[DVec3; 3]], bound: f64) -> Vec<[DVec3; 3]> {
        let (parts, count) = Parts::for_bound(triangles.iter().copied(), bound);
        let mut pieces = Vec::new();
        for triangle in triangles {
            parts.pieces(*triangle, &mut |piece| pieces.push(piece));
        }
        assert_eq!(pieces.len() as u64, count);
        pieces
    }

    fn area_vector([a, b, c]: [DVec3; 3]) -> DVec3 {
        (b - a).cross(c - a) * 0.5
    }

    fn least_angle(triangle: [DVec3; 3]) -> f64 {
        let at = |k: usize| {
            let [here, next, last] = [0, 1, 2].map(|step| triangle[(k + step) % 3]);
            (next - here).angle_between(last - here)
        };
        at(0).min(at(1)).min(at(2))
    }

    /// Each edge of the pieces, with how often it is run along in either direction.
    fn edges(pieces: &[[DVec3; 3]]) -> HashMap<[[u64; 3]; 2], [u32; 2]> {
        let key = |p: DVec3| (p + DVec3::ZERO).to_array().map(f64::to_bits);
        let mut edges: HashMap<_, [u32; 2]> = HashMap::new();
        for piece in pieces {
            for k in 0..3 {
                let (a, b) = (key(piece[k]), key(piece[(k + 1) % 3]));
                edges.entry([a.min(b), a.max(b)]).or_default()[usize::from(a > b)] += 1;
            }
        }
        edges
    }

    #[test]
    fn an_equilateral_triangle_is_cut_into_squares_of_whole_numbers() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::new(0.5, 0.75_f64.sqrt(), 0.0)];
        for k in 1..9_u32 {
            assert_eq!(cut(&[corners], 1.0 / f64::from(k)).len(), (k * k) as usize);
        }
    }

    /// A tetrahedron, a thing without border: after any cut each edge is still run along once each way.
    #[test]
    fn what_is_closed_stays_closed() {
        let [a, b, c, d] =
            [[0.0, 0.0, 0.0], [1.0, 0.1, 0.0], [0.2, 3.0, 0.3], [0.1, 0.2, 0.7]].map(DVec3::from);
        let solid = [[a, c, b], [a, b, d], [b, c, d], [c, a, d]];
        for bound in [2.0, 0.9, 0.31, 0.1, 0.037] {
            let pieces = cut(&solid, bound);
            assert!(edges(&pieces).values().all(|&runs| runs == [1, 1]), "{bound}");
        }
    }

    proptest! {
        #[test]
        fn pieces_fit_cover_and_meet(
            points in prop::collection::vec(prop::array::uniform3(-4.0_f64..4.0), 4),
            bound in 0.2_f64..3.0,
        ) {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| DVec3::from(points[k]));
            let pair = [[a, b, c], [b, a, d]];
            prop_assume!(pair.iter().all(|&t| area_vector(t).length() > 0.05));
            let pieces = cut(&pair, bound);
            let least = pair.map(least_angle).into_iter().fold(f64::INFINITY, f64::min);
            for piece in &pieces {
                for k in 0..3 {
                    prop_assert!(piece[k].distance(piece[(k + 1) % 3]) <= bound * (1.0 + 1e-6));
                }
                prop_assert!(least_angle(*piece) > 0.2 * least);
            }
            let area = |all: &[[DVec3; 3]]| all.iter().map(|&t| area_vector(t).length()).sum::<f64>();
            prop_assert!((area(&pieces) / area(&pair) - 1.0).abs() < 1e-9);
            // Inside each edge is run along once each way; no corner lies on the middle of another's edge.
            let edges = edges(&pieces);
            let once = edges.values().filter(|runs| **runs != [1, 1]).count();
            let sides: u32 = [(a, c), (b, c), (a, d), (b, d)].iter().map(|(p, q)| {
                let k = parts(p.distance(*q), bound);
                match Parts::for_bound(pair.iter().copied(), bound).0 { Parts::Equal(k) => k, Parts::NoLongerThan(_) => k }
            }).sum();
            prop_assert_eq!(once, sides as usize);
        }
    }
}
