//! Sixteen parts abreast: one part looks at all of them with the same instructions.
//!
//! Of parallelograms that are small for their distance what they exchange, G = A_i F_ij, is told from two points along
//! each side of both: exact to the third power of the sides, and of the fourth but for those of one side alone, which
//! are added as the derivatives at the centres have them. What is left goes as the sixth power of size over distance.
//!
//! Whoever of two looks at the other finds the same bits: every sum is taken in an order that does not change when both
//! change places.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use super::parts::Part;
use crate::simd::{LANES, Simd};
use crate::visibility::vectors::{Registers, Vectors, add, dot, load, scale, splat, store, sub};
use crate::visibility::{Ends, FacetShape};

/// Parallelograms up to this sum of their radii over the distance of their centres are far from one another: what they
/// exchange is off by a few millionths of it at most, by a millionth where it is two thirds of this, and mostly by no more
/// than single precision is (the tests hold it to the judge, [`super::exact`]).
const FAR: f64 = 0.15;

/// The points lie this share of a side from the centre: 1 / (2 √3), as Gauss has it.
const ASIDE: f64 = 0.288_675_134_594_812_9;

/// What the fourth derivatives along a side add to two points on it, in fourths of how far these lie from the centre:
/// 9 (1/5 - 1/9).
const FOURTH: f32 = 0.8;

/// Up to sixteen parts. Lanes beyond the last hold what has no area.
#[derive(Clone, Debug)]
pub(super) struct Abreast {
    origin: Vectors,
    u: Vectors,
    v: Vectors,
    normal: Vectors,
    centre: Vectors,
    area: [f64; LANES],
    radius: [f64; LANES],
    /// A bit for each that is there, and for each that is a parallelogram.
    there: u32,
    parallelograms: u32,
}

/// What a part and each of the others have of one another, a bit for each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sights {
    /// Those that rise above the part's plane.
    pub(super) rise: u32,
    /// Those before which anything of the part lies, and those behind which anything does.
    pub(super) before: u32,
    pub(super) behind: u32,
    /// Those wholly above the part's plane, with all of the part before them, or all of it behind.
    pub(super) all_before: u32,
    pub(super) all_behind: u32,
}

fn put(v: DVec3, to: &mut Vectors, lane: usize) {
    (to[0][lane], to[1][lane], to[2][lane]) = (v.x, v.y, v.z);
}

/// Vectors in single precision.
type Narrow<S> = [<S as Simd>::Floats; 3];

impl Abreast {
    /// These, sixteen at most.
    pub(super) fn new<'a>(parts: impl Iterator<Item = &'a Part>) -> Self {
        let none = [[0.0; LANES]; 3];
        let mut abreast = Self {
            origin: none,
            u: none,
            v: none,
            normal: none,
            centre: none,
            area: [0.0; LANES],
            radius: [0.0; LANES],
            there: 0,
            parallelograms: 0,
        };
        for (lane, part) in parts.enumerate().take(LANES) {
            put(part.origin, &mut abreast.origin, lane);
            put(part.u, &mut abreast.u, lane);
            put(part.v, &mut abreast.v, lane);
            put(part.normal, &mut abreast.normal, lane);
            put(part.centre, &mut abreast.centre, lane);
            (abreast.area[lane], abreast.radius[lane]) = (part.area, part.radius);
            abreast.there |= 1 << lane;
            abreast.parallelograms |= u32::from(part.shape == FacetShape::Parallelogram) << lane;
        }
        abreast
    }

    /// Their outlines as [`Part::outline`] has them; `behind`, those of [`Part::turned`].
    #[inline(always)]
    pub(super) fn ends<S: Simd>(&self, simd: S, behind: bool) -> Ends {
        let origin = load(simd, &self.origin);
        let (first, last) = if behind { (&self.v, &self.u) } else { (&self.u, &self.v) };
        let (first, last) = (load(simd, first), load(simd, last));
        let (b, d) = (add(simd, origin, first), add(simd, origin, last));
        let opposite = add(simd, b, last);
        let parallelogram = simd.mask(self.parallelograms);
        let c = [
            simd.select_double(parallelogram, opposite[0], d[0]),
            simd.select_double(parallelogram, opposite[1], d[1]),
            simd.select_double(parallelogram, opposite[2], d[2]),
        ];
        let mut ends = Ends { corners: [[[0.0; LANES]; 3]; 4], normal: self.normal };
        store(simd, origin, &mut ends.corners[0]);
        store(simd, b, &mut ends.corners[1]);
        store(simd, c, &mut ends.corners[2]);
        store(simd, d, &mut ends.corners[3]);
        if behind {
            let turned = scale(simd, load(simd, &self.normal), simd.splat_double(-1.0));
            store(simd, turned, &mut ends.normal);
        }
        ends
    }

    /// The least and the greatest height of what has this origin and these sides above planes: [`Part::heights`], and
    /// the same bits.
    #[inline(always)]
    fn heights<S: Simd>(
        simd: S,
        [origin, u, v]: [Registers<S>; 3],
        parallelogram: S::Mask,
        (point, normal): (Registers<S>, Registers<S>),
    ) -> (S::Doubles, S::Doubles) {
        let zero = simd.splat_double(0.0);
        let (u, v) = (dot(simd, normal, u), dot(simd, normal, v));
        let origin = dot(simd, normal, sub(simd, origin, point));
        let (under, over) = (simd.min_double(u, zero), simd.max_double(u, zero));
        let low = simd.add_double(simd.add_double(origin, under), simd.min_double(v, zero));
        let high = simd.add_double(simd.add_double(origin, over), simd.max_double(v, zero));
        let (under, over) =
            (simd.min_double(simd.min_double(u, v), zero), simd.max_double(simd.max_double(u, v), zero));
        let (low_of_three, high_of_three) = (simd.add_double(origin, under), simd.add_double(origin, over));
        (
            simd.select_double(parallelogram, low, low_of_three),
            simd.select_double(parallelogram, high, high_of_three),
        )
    }

    /// What `part` and each of these have of one another. Lengths up to `margin` are rounding.
    #[inline(always)]
    pub(super) fn sights<S: Simd>(&self, simd: S, part: &Part, margin: f64) -> Sights {
        let (origin, u, v) = (load(simd, &self.origin), load(simd, &self.u), load(simd, &self.v));
        let plane = (splat(simd, part.centre), splat(simd, part.normal));
        let (low, high) = Self::heights(simd, [origin, u, v], simd.mask(self.parallelograms), plane);
        let (u, v) = (splat(simd, part.u), splat(simd, part.v));
        let plane = (load(simd, &self.centre), load(simd, &self.normal));
        let all = if part.shape == FacetShape::Parallelogram { u32::MAX } else { 0 };
        let (other_low, other_high) =
            Self::heights(simd, [splat(simd, part.origin), u, v], simd.mask(all), plane);
        let (above, below) = (simd.splat_double(margin), simd.splat_double(-margin));
        let rise = simd.lanes(simd.greater_double(high, above));
        let before = simd.lanes(simd.greater_double(other_high, above));
        let behind = simd.lanes(simd.greater_double(below, other_low));
        let whole = simd.lanes(simd.greater_double(low, above));
        let wholly_before = simd.lanes(simd.greater_double(other_low, above));
        let wholly_behind = simd.lanes(simd.greater_double(below, other_high));
        let there = self.there;
        Sights {
            rise: rise & there,
            before: before & there,
            behind: behind & there,
            all_before: whole & wholly_before & there,
            all_behind: whole & wholly_behind & there,
        }
    }

    /// What `part` exchanges with each of these, front to front, or, `behind`, with their backs, where both are
    /// parallelograms far from one another, and each is above the other's plane: a bit for each of these.
    #[inline(always)]
    pub(super) fn exchange_far<S: Simd>(
        &self,
        simd: S,
        part: &Part,
        behind: bool,
        exchanges: &mut [f64; LANES],
    ) -> u32 {
        let between = sub(simd, load(simd, &self.centre), splat(simd, part.centre));
        let squared = dot(simd, between, between);
        let radii = simd.add_double(simd.load_double(&self.radius), simd.splat_double(part.radius));
        let least = simd.mul_double(simd.mul_double(radii, radii), simd.splat_double(1.0 / (FAR * FAR)));
        let far = self.parallelograms & self.there & simd.lanes(simd.greater_double(squared, least));
        if far == 0 || part.shape == FacetShape::Triangle {
            return 0;
        }
        let scale = simd.div_double(simd.splat_double(1.0), simd.root_double(squared));
        let (normal, other_normal) = (splat(simd, part.normal), load(simd, &self.normal));
        let (u, v) = (splat(simd, part.u), splat(simd, part.v));
        let (other_u, other_v) = (load(simd, &self.u), load(simd, &self.v));
        // Seen from behind the others' planes are turned over.
        let over = simd.splat_double(if behind { -1.0 } else { 1.0 });
        let centre = simd.mul_double(over, dot(simd, other_normal, between));
        let centre = simd.sub_double(simd.splat_double(0.0), centre);
        let sides = [
            simd.mul_double(over, dot(simd, other_normal, u)),
            simd.mul_double(over, dot(simd, other_normal, v)),
        ];
        let heights = Heights::new(simd, centre, sides, scale);
        let sides = [dot(simd, normal, other_u), dot(simd, normal, other_v)];
        let other_heights = Heights::new(simd, dot(simd, normal, between), sides, scale);
        let (u, v) = (points_aside(simd, u, scale), points_aside(simd, v, scale));
        let (other_u, other_v) = (points_aside(simd, other_u, scale), points_aside(simd, other_v, scale));
        let half = simd.mul_double(scale, simd.splat_double(0.5));
        let half_way = narrow(simd, between, half);
        let points = four_points(simd, half_way, simd.splat(-1.0), u, v);
        let others = four_points(simd, half_way, simd.splat(1.0), other_u, other_v);
        let mean = simd.mul(
            sum_of_pairs(simd, (&points, &heights.of_points), (&others, &other_heights.of_points)),
            simd.splat(1.0 / 16.0),
        );
        let way = add_narrow(simd, half_way, half_way);
        let zero = simd.splat(0.0);
        let back = [simd.sub(zero, way[0]), simd.sub(zero, way[1]), simd.sub(zero, way[2])];
        let one = simd.add(
            fourth(simd, back, u, (heights.centre, heights.sides[0]), other_heights.centre),
            fourth(simd, back, v, (heights.centre, heights.sides[1]), other_heights.centre),
        );
        let other = simd.add(
            fourth(simd, way, other_u, (other_heights.centre, other_heights.sides[0]), heights.centre),
            fourth(simd, way, other_v, (other_heights.centre, other_heights.sides[1]), heights.centre),
        );
        let mean = simd.fused(simd.add(one, other), simd.splat(FOURTH), mean);
        let areas = simd.mul_double(simd.load_double(&self.area), simd.splat_double(part.area));
        let per_square = simd.mul_double(simd.mul_double(scale, scale), simd.splat_double(FRAC_1_PI));
        let found = simd.mul_double(simd.mul_double(simd.widen(mean), areas), per_square);
        simd.store_double(simd.max_double(found, simd.splat_double(0.0)), exchanges);
        far
    }
}

/// How far a part's four points rise above the other's plane, its centre, and how that changes along its sides from the
/// centre to the points.
struct Heights<S: Simd> {
    of_points: [S::Floats; 4],
    centre: S::Floats,
    sides: [S::Floats; 2],
}

impl<S: Simd> Heights<S> {
    #[inline(always)]
    fn new(simd: S, centre: S::Doubles, [u, v]: [S::Doubles; 2], scale: S::Doubles) -> Self {
        let aside = simd.mul_double(scale, simd.splat_double(ASIDE));
        let centre = simd.narrow(simd.mul_double(centre, scale));
        let (u, v) = (simd.narrow(simd.mul_double(u, aside)), simd.narrow(simd.mul_double(v, aside)));
        let (less, more) = (simd.sub(centre, u), simd.add(centre, u));
        let of_points = [simd.sub(less, v), simd.sub(more, v), simd.add(less, v), simd.add(more, v)];
        Self { of_points, centre, sides: [u, v] }
    }
}

#[inline(always)]
fn narrow<S: Simd>(simd: S, v: Registers<S>, scale: S::Doubles) -> Narrow<S> {
    [
        simd.narrow(simd.mul_double(v[0], scale)),
        simd.narrow(simd.mul_double(v[1], scale)),
        simd.narrow(simd.mul_double(v[2], scale)),
    ]
}

/// From the centre of a side to the points on it.
#[inline(always)]
fn points_aside<S: Simd>(simd: S, side: Registers<S>, scale: S::Doubles) -> Narrow<S> {
    narrow(simd, side, simd.mul_double(scale, simd.splat_double(ASIDE)))
}

#[inline(always)]
fn add_narrow<S: Simd>(simd: S, a: Narrow<S>, b: Narrow<S>) -> Narrow<S> {
    [simd.add(a[0], b[0]), simd.add(a[1], b[1]), simd.add(a[2], b[2])]
}

#[inline(always)]
fn dot_narrow<S: Simd>(simd: S, a: Narrow<S>, b: Narrow<S>) -> S::Floats {
    simd.fused(a[2], b[2], simd.fused(a[1], b[1], simd.mul(a[0], b[0])))
}

/// The four points about a centre, which lies `side` times `half_way` from the middle between both parts.
#[inline(always)]
fn four_points<S: Simd>(
    simd: S,
    half_way: Narrow<S>,
    side: S::Floats,
    u: Narrow<S>,
    v: Narrow<S>,
) -> [Narrow<S>; 4] {
    let mut points = [half_way; 4];
    for axis in 0..3 {
        let centre = simd.mul(half_way[axis], side);
        let (less, more) = (simd.sub(centre, u[axis]), simd.add(centre, u[axis]));
        points[0][axis] = simd.sub(less, v[axis]);
        points[1][axis] = simd.sub(more, v[axis]);
        points[2][axis] = simd.add(less, v[axis]);
        points[3][axis] = simd.add(more, v[axis]);
    }
    points
}

/// Pairs of points, two and two: of these the second is the first with both parts in each other's place, or each is its own.
const TWO_PAIRS: [[[usize; 2]; 2]; 8] = [
    [[0, 0], [1, 1]],
    [[2, 2], [3, 3]],
    [[0, 1], [1, 0]],
    [[0, 2], [2, 0]],
    [[0, 3], [3, 0]],
    [[1, 2], [2, 1]],
    [[1, 3], [3, 1]],
    [[2, 3], [3, 2]],
];

/// Σ of height times height over the fourth power of the distance, over all pairs of points; two pairs share a division.
#[inline(always)]
fn sum_of_pairs<S: Simd>(
    simd: S,
    (points, heights): (&[Narrow<S>; 4], &[S::Floats; 4]),
    (others, other_heights): (&[Narrow<S>; 4], &[S::Floats; 4]),
) -> S::Floats {
    let mut sum = simd.splat(0.0);
    for [[a, b], [c, d]] in TWO_PAIRS {
        let (over, under) = pair(simd, points[a], heights[a], others[b], other_heights[b]);
        let (other_over, other_under) = pair(simd, points[c], heights[c], others[d], other_heights[d]);
        let over = simd.add(simd.mul(over, other_under), simd.mul(other_over, under));
        sum = simd.add(sum, simd.div(over, simd.mul(under, other_under)));
    }
    sum
}

/// What a pair of points adds: a number, and what it is divided by.
#[inline(always)]
fn pair<S: Simd>(
    simd: S,
    point: Narrow<S>,
    height: S::Floats,
    other: Narrow<S>,
    other_height: S::Floats,
) -> (S::Floats, S::Floats) {
    let x = simd.sub(other[0], point[0]);
    let y = simd.sub(other[1], point[1]);
    let z = simd.sub(other[2], point[2]);
    let r = simd.fused(z, z, simd.fused(y, y, simd.mul(x, x)));
    (simd.mul(height, other_height), simd.mul(r, r))
}

/// The coefficient of t⁴ in (h + s t) k / (r²)², where a part moves along a side by t times `side`, and so does the
/// line of length 1 to it (`way`): h and s are its own height above the other's plane and that of `side`, k the
/// other's above its own. By Gegenbauer's polynomials, (1 + 2 x t + q t²)⁻² = Σ C_n tⁿ.
#[inline(always)]
fn fourth<S: Simd>(
    simd: S,
    way: Narrow<S>,
    side: Narrow<S>,
    (height, slope): (S::Floats, S::Floats),
    other_height: S::Floats,
) -> S::Floats {
    let (x, q) = (dot_narrow(simd, way, side), dot_narrow(simd, side, side));
    let squared = simd.mul(x, x);
    // C_3 = x (12 q - 32 x²), C_4 = 3 q² + x² (80 x² - 48 q).
    let third = simd.mul(x, simd.fused(squared, simd.splat(-32.0), simd.mul(q, simd.splat(12.0))));
    let inner = simd.fused(squared, simd.splat(80.0), simd.mul(q, simd.splat(-48.0)));
    let fourth = simd.fused(squared, inner, simd.mul(simd.splat(3.0), simd.mul(q, q)));
    simd.mul(other_height, simd.fused(height, fourth, simd.mul(slope, third)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factors::exact;
    use crate::geometry::chance::random;
    use crate::simd::{self, Kernel, Level};

    /// What the first exchanges with the others, and they with it.
    struct BothWays<'a>(&'a Part, &'a [Part], bool);

    impl Kernel for BothWays<'_> {
        type Output = (u32, Vec<[f64; 2]>);

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Self::Output {
            let Self(part, others, behind) = self;
            let abreast = Abreast::new(others.iter());
            let (mut found, mut back) = ([0.0; LANES], [0.0; LANES]);
            let far = abreast.exchange_far(simd, part, behind, &mut found);
            let mut both = Vec::new();
            for (other, found) in others.iter().zip(found) {
                Abreast::new([part].into_iter()).exchange_far(simd, other, behind, &mut back);
                both.push([found, back[0]]);
            }
            (far, both)
        }
    }

    #[test]
    fn far_parallelograms_exchange_what_the_judge_says() {
        let mut next = random();
        // So near for their size, and off by no more than this share.
        for (nearness, bound) in [(0.02, 1e-6), (0.1, 1e-6), (FAR * 0.999, 5e-6)] {
            for _ in 0..50 {
                let mut vector = || DVec3::new(next() - 0.5, next() - 0.5, next() - 0.5);
                let here = Part::new(vector(), vector(), vector(), FacetShape::Parallelogram);
                let mut others = Vec::new();
                while others.len() < LANES {
                    let there = Part::new(vector(), vector(), vector(), FacetShape::Parallelogram);
                    let way = vector().normalize() * ((here.radius + there.radius) / nearness);
                    let origin = here.centre + way - (there.centre - there.origin);
                    let there = Part::new(origin, there.u, there.v, there.shape);
                    let above = |a: &Part, b: &Part| a.heights(b.centre, b.normal).0 > 1e-3 * a.radius;
                    if above(&here, &there) && above(&there, &here) {
                        others.push(there);
                    }
                }
                let (far, both) = simd::run(Level::best(), BothWays(&here, &others, false));
                assert_eq!(far, 0xffff);
                for (other, [found, back]) in others.iter().zip(&both) {
                    // Whoever looks.
                    assert_eq!(found, back);
                    let judged = exact::between(here.outline().corners(), other.outline().corners());
                    // The judge's own error is absolute.
                    let off = (found - judged * here.area).abs();
                    let allowed = (bound * judged + 1e-12) * here.area;
                    assert!(off < allowed, "{nearness}: {found}, off by {off:e}");
                }
                for level in Level::available() {
                    assert_eq!(simd::run(level, BothWays(&here, &others, false)).1, both, "{level:?}");
                }
                let turned: Vec<Part> = others.iter().map(Part::turned).collect();
                let (far, behind) = simd::run(Level::best(), BothWays(&here, &turned, true));
                assert_eq!(far, 0xffff);
                for ([front, _], [behind, _]) in both.iter().zip(&behind) {
                    assert!((front - behind).abs() < 1e-6 * front, "{front} {behind}");
                }
            }
        }
    }

    #[test]
    fn near_ones_and_triangles_are_not_far() {
        let here = Part::new(DVec3::ZERO, DVec3::X, DVec3::Y, FacetShape::Parallelogram);
        let at = |height: f64, shape| Part::new(DVec3::Z * height, DVec3::Y, DVec3::X, shape);
        let far = 2.0_f64.sqrt() / FAR;
        let others = [
            at(far * 0.99, FacetShape::Parallelogram),
            at(far * 1.01, FacetShape::Parallelogram),
            at(far * 2.0, FacetShape::Triangle),
        ];
        assert_eq!(simd::run(Level::best(), BothWays(&here, &others, false)).0, 0b010);
        let triangle = Part::triangle([DVec3::ZERO, DVec3::X, DVec3::Y]);
        assert_eq!(simd::run(Level::best(), BothWays(&triangle, &others, false)).0, 0);
    }
}
