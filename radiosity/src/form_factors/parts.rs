//! Flat convex parts of patches: what exact form factors are found between.

use glam::DVec3;

use crate::visibility::{Facet, FacetShape};

/// The most corners of an outline: a part's four, and one more for each of the two planes that it is cut by at most.
const MOST_CORNERS: usize = 6;

/// A parallelogram or a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Part {
    /// The corner where both sides begin.
    pub(super) origin: DVec3,
    /// The sides, u × v towards the front.
    pub(super) u: DVec3,
    pub(super) v: DVec3,
    pub(super) shape: FacetShape,
    /// Unit normal of the front.
    pub(super) normal: DVec3,
    pub(super) centre: DVec3,
    pub(super) area: f64,
    /// From the centre to the farthest corner.
    pub(super) radius: f64,
}

impl Part {
    pub(super) fn new(origin: DVec3, u: DVec3, v: DVec3, shape: FacetShape) -> Self {
        let cross = u.cross(v);
        let (middle, share) = match shape {
            FacetShape::Parallelogram => ((u + v) * 0.5, 1.0),
            FacetShape::Triangle => ((u + v) / 3.0, 0.5),
        };
        let from_middle = [DVec3::ZERO, u, v, u + v].map(|corner| (corner - middle).length());
        let count = if shape == FacetShape::Triangle { 3 } else { 4 };
        Self {
            origin,
            u,
            v,
            shape,
            normal: cross.normalize_or_zero(),
            centre: origin + middle,
            area: cross.length() * share,
            radius: from_middle[..count].iter().fold(0.0, |most, &far| f64::max(most, far)),
        }
    }

    /// Of a facet, or of a cell of it: the `columns` x `rows` cells, this one of them.
    pub(super) fn cell(facet: &Facet, [column, row]: [u32; 2], [columns, rows]: [u32; 2]) -> Self {
        // A facet's own normal may be turned against u × v.
        let (u, v) = match facet.u.cross(facet.v).dot(facet.normal) < 0.0 {
            true => (facet.v / f64::from(rows), facet.u / f64::from(columns)),
            false => (facet.u / f64::from(columns), facet.v / f64::from(rows)),
        };
        let at = |k: u32, count: u32| f64::from(k) / f64::from(count);
        let origin = facet.origin + facet.u * at(column, columns) + facet.v * at(row, rows);
        Self::new(origin, u, v, facet.shape)
    }

    pub(super) fn triangle([a, b, c]: [DVec3; 3]) -> Self {
        Self::new(a, b - a, c - a, FacetShape::Triangle)
    }

    /// The other side of it.
    pub(super) fn turned(&self) -> Self {
        Self { u: self.v, v: self.u, normal: -self.normal, ..*self }
    }

    /// The corners, counter-clockwise seen from the front.
    pub(super) fn outline(&self) -> Outline {
        let (a, b, c) = (self.origin, self.origin + self.u, self.origin + self.v);
        match self.shape {
            FacetShape::Triangle => Outline::of(&[a, b, c]),
            FacetShape::Parallelogram => Outline::of(&[a, b, b + self.v, c]),
        }
    }

    /// The least and the greatest height of the corners above the plane through `point` with this unit normal.
    #[inline(always)]
    pub(super) fn heights(&self, point: DVec3, normal: DVec3) -> (f64, f64) {
        let (u, v) = (normal.dot(self.u), normal.dot(self.v));
        let origin = normal.dot(self.origin - point);
        match self.shape {
            FacetShape::Triangle => (origin + u.min(v).min(0.0), origin + u.max(v).max(0.0)),
            FacetShape::Parallelogram => (origin + u.min(0.0) + v.min(0.0), origin + u.max(0.0) + v.max(0.0)),
        }
    }

    /// Cut in two across its longer side.
    pub(super) fn halves(&self) -> [Self; 2] {
        match self.shape {
            FacetShape::Parallelogram if self.u.length_squared() >= self.v.length_squared() => {
                let half = self.u * 0.5;
                [self.origin, self.origin + half].map(|origin| Self::new(origin, half, self.v, self.shape))
            }
            FacetShape::Parallelogram => {
                let half = self.v * 0.5;
                [self.origin, self.origin + half].map(|origin| Self::new(origin, self.u, half, self.shape))
            }
            FacetShape::Triangle => {
                let [a, b, c] = [self.origin, self.origin + self.u, self.origin + self.v];
                let sides = [(a, b, c), (b, c, a), (c, a, b)];
                let longer = |x: &(DVec3, DVec3, DVec3), y: &(DVec3, DVec3, DVec3)| {
                    x.0.distance_squared(x.1).total_cmp(&y.0.distance_squared(y.1))
                };
                let (from, to, apex) = sides.into_iter().max_by(longer).unwrap_or(sides[0]);
                let middle = (from + to) * 0.5;
                [Self::triangle([from, middle, apex]), Self::triangle([middle, to, apex])]
            }
        }
    }
}

/// A convex polygon of few corners, in place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Outline {
    corners: [DVec3; MOST_CORNERS],
    count: usize,
}

impl Outline {
    pub(crate) const NONE: Self = Self { corners: [DVec3::ZERO; MOST_CORNERS], count: 0 };

    pub(crate) fn of(corners: &[DVec3]) -> Self {
        let mut outline = Self::NONE;
        for &corner in corners {
            outline.push(corner);
        }
        outline
    }

    fn push(&mut self, corner: DVec3) {
        // Each cut adds a corner at most.
        if let Some(place) = self.corners.get_mut(self.count) {
            *place = corner;
            self.count += 1;
        }
    }

    pub(crate) fn corners(&self) -> &[DVec3] {
        &self.corners[..self.count]
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.count < 3
    }

    /// Parted by the plane normal · x = level: what lies above, and what below. Within `margin` of the plane is on it.
    pub(crate) fn parted(&self, normal: DVec3, level: f64, margin: f64) -> [Self; 2] {
        let mut sides = [Self::NONE; 2];
        let mut reach = [false; 2];
        let height = |corner: DVec3| {
            let height = normal.dot(corner) - level;
            if height.abs() <= margin { 0.0 } else { height }
        };
        let Some(&last) = self.corners().last() else { return sides };
        let (mut before, mut from) = (last, height(last));
        for &corner in self.corners() {
            let to = height(corner);
            if from * to < 0.0 {
                let crossing = before + (corner - before) * (from / (from - to));
                sides[0].push(crossing);
                sides[1].push(crossing);
            }
            if to >= 0.0 {
                sides[0].push(corner);
            }
            if to <= 0.0 {
                sides[1].push(corner);
            }
            reach[0] |= to > 0.0;
            reach[1] |= to < 0.0;
            (before, from) = (corner, to);
        }
        for (side, reach) in sides.iter_mut().zip(reach) {
            if !reach {
                side.count = 0;
            }
        }
        sides
    }

    /// Triangles that cover it.
    pub(super) fn triangles(&self) -> impl Iterator<Item = Part> + '_ {
        let corners = self.corners();
        (2..corners.len()).map(|k| Part::triangle([corners[0], corners[k - 1], corners[k]]))
    }
}
