//! What two flat parts exchange, were nothing else in the way: G = A_i F_ij = A_j F_ji, an area.
//!
//! Of parts that are small for their distance by Gauss quadrature of cos cos / π r² over both, in single precision,
//! sixteen points at a time: as many as keep the error to a few millionths of it. Of those nearer by the double contour
//! integral, the inner integral in closed form, and the outer one too where edges are parallel; else graded towards
//! where edges meet. (Parallelograms still farther apart are `abreast.rs`'s, where many are asked for at once.)
//!
//! Which of two parts comes first is the caller's to say, and his answer the same bits only for the same order.
//!
//! \[Sparrow\] Sparrow, A New and Simpler Formulation for Radiative Angle Factors, 1963.

use std::f64::consts::{FRAC_1_PI, PI};
use std::sync::LazyLock;

use glam::DVec3;

use super::parts::Part;
use crate::simd::{self, Kernel, LANES, Level, Simd};
use crate::visibility::FacetShape;

/// Points along a side, by how near the parts are: up to this sum of their radii over the distance of their centres the
/// quadrature errs by a few millionths at most, and mostly less (the tests hold it to the judge, [`super::exact`]).
const LEVELS: [(f64, usize); 3] = [(0.2, 3), (0.42, 4), (0.56, 6)];

/// The most points that a part is given.
const MOST_POINTS: usize = 48;

/// Parts nearer than the last level, but farther than this, are halved, so often at most.
const HALVED_UP_TO: f64 = 1.0;
const HALVINGS: u32 = 3;

/// The points of a part, along its sides from its centre, and their share of its area.
#[derive(Clone, Debug)]
struct Rule {
    points: usize,
    u: [f32; MOST_POINTS],
    v: [f32; MOST_POINTS],
    weight: [f32; MOST_POINTS],
}

/// For each level, of a parallelogram and of a triangle.
static RULES: LazyLock<[[Rule; 2]; LEVELS.len()]> = LazyLock::new(|| {
    LEVELS.map(|(_, n)| [Rule::new(n, FacetShape::Parallelogram), Rule::new(n, FacetShape::Triangle)])
});

/// Abscissas on 0..1 and weights.
pub(super) type Quadrature = Vec<(f64, f64)>;

/// The Gauss-Legendre rule of n points, by Newton's method.
pub(super) fn gauss(n: usize) -> Quadrature {
    let root = |k: usize| {
        let mut x = (PI * (k as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..20 {
            let (mut before, mut value) = (0.0, 1.0);
            for m in 0..n {
                let m = m as f64;
                (before, value) = (value, ((2.0 * m + 1.0) * x * value - m * before) / (m + 1.0));
            }
            slope = n as f64 * (x * value - before) / (x * x - 1.0);
            x -= value / slope;
        }
        (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..n).map(root).collect()
}

impl Rule {
    fn new(n: usize, shape: FacetShape) -> Self {
        let none = [0.0; MOST_POINTS];
        let mut rule = Self { points: n * n, u: none, v: none, weight: none };
        let mut total = 0.0;
        let along = gauss(n);
        for (k, (&(s, a), &(t, b))) in
            along.iter().flat_map(|s| along.iter().map(move |t| (s, t))).enumerate()
        {
            let (u, v, weight) = match shape {
                FacetShape::Parallelogram => (s - 0.5, t - 0.5, a * b),
                FacetShape::Triangle => (s * (1.0 - t) - 1.0 / 3.0, s * t - 1.0 / 3.0, a * b * s),
            };
            (rule.u[k], rule.v[k]) = (u as f32, v as f32);
            rule.weight[k] = weight as f32;
            total += weight;
        }
        for weight in &mut rule.weight {
            *weight /= total as f32;
        }
        rule
    }
}

/// G of two parts of which each lies above the other's plane, or on it.
#[inline(always)]
pub(super) fn exchange<S: Simd>(simd: S, first: &Part, second: &Part) -> f64 {
    let between = second.centre - first.centre;
    let distance = between.length();
    let ratio = (first.radius + second.radius) / distance;
    let mut level = 0;
    while level < LEVELS.len() && ratio > LEVELS[level].0 {
        level += 1;
    }
    if level < LEVELS.len() {
        by_points(simd, level, first, second, between, distance)
    } else {
        near(first, second, ratio, HALVINGS)
    }
}

/// The same of parts that are not far from one another.
#[inline(never)]
fn near(first: &Part, second: &Part, ratio: f64, halvings: u32) -> f64 {
    if ratio < HALVED_UP_TO && halvings > 0 {
        let sum = |parts: [f64; 2]| parts[0] + parts[1];
        return if first.radius >= second.radius {
            sum(first.halves().map(|half| far_or_near(&half, second, halvings - 1)))
        } else {
            sum(second.halves().map(|half| far_or_near(first, &half, halvings - 1)))
        };
    }
    contour(first.outline().corners(), second.outline().corners())
}

fn far_or_near(first: &Part, second: &Part, halvings: u32) -> f64 {
    let between = second.centre - first.centre;
    let distance = between.length();
    let ratio = (first.radius + second.radius) / distance;
    match LEVELS.iter().position(|&(most, _)| ratio <= most) {
        Some(level) => simd::run(Level::best(), ByPoints { level, first, second, between, distance }),
        None => near(first, second, ratio, halvings),
    }
}

struct ByPoints<'a> {
    level: usize,
    first: &'a Part,
    second: &'a Part,
    between: DVec3,
    distance: f64,
}

impl Kernel for ByPoints<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> f64 {
        by_points(simd, self.level, self.first, self.second, self.between, self.distance)
    }
}

/// Vectors in single precision, the parts' distance for unit.
#[inline(always)]
fn narrowed(v: DVec3, scale: f64) -> [f32; 3] {
    [(v.x * scale) as f32, (v.y * scale) as f32, (v.z * scale) as f32]
}

/// The `block`th sixteen points of a part, from `at`.
#[inline(always)]
fn points<S: Simd>(
    simd: S,
    rule: &Rule,
    block: usize,
    at: [f32; 3],
    u: [f32; 3],
    v: [f32; 3],
) -> [S::Floats; 3] {
    let s = simd.load(rule.u[block * LANES..].first_chunk().expect("a block of points"));
    let t = simd.load(rule.v[block * LANES..].first_chunk().expect("a block of points"));
    let mut points = [s; 3];
    for axis in 0..3 {
        let along = simd.fused(simd.splat(v[axis]), t, simd.splat(at[axis]));
        points[axis] = simd.fused(simd.splat(u[axis]), s, along);
    }
    points
}

#[inline(always)]
fn dot<S: Simd>(simd: S, a: [f32; 3], b: [S::Floats; 3]) -> S::Floats {
    let xy = simd.fused(simd.splat(a[1]), b[1], simd.mul(simd.splat(a[0]), b[0]));
    simd.fused(simd.splat(a[2]), b[2], xy)
}

/// G by quadrature over both.
#[inline(always)]
fn by_points<S: Simd>(
    simd: S,
    level: usize,
    first: &Part,
    second: &Part,
    between: DVec3,
    distance: f64,
) -> f64 {
    let rules = &RULES[level];
    let rule_of = |part: &Part| &rules[usize::from(part.shape == FacetShape::Triangle)];
    let (rule, other) = (rule_of(first), rule_of(second));
    let scale = 1.0 / distance;
    let [u, v, other_u, other_v] = [first.u, first.v, second.u, second.v].map(|side| narrowed(side, scale));
    let [normal, other_normal] = [first.normal, second.normal].map(|normal| narrowed(normal, 1.0));
    let [to_second, to_first] = [between, -between].map(|way| narrowed(way, scale));
    // The points of the first from the second's centre, and how far they rise above its plane.
    let none = [0.0_f32; MOST_POINTS];
    let [mut xs, mut ys, mut zs, mut heights] = [none; 4];
    for block in 0..rule.points.div_ceil(LANES) {
        let here = points(simd, rule, block, to_first, u, v);
        let weight = simd.load(rule.weight[block * LANES..].first_chunk().expect("a block of weights"));
        let height = simd.mul(dot(simd, other_normal, here), weight);
        let columns = [&mut xs, &mut ys, &mut zs, &mut heights];
        for (column, values) in columns.into_iter().zip([here[0], here[1], here[2], height]) {
            simd.store(values, column[block * LANES..].first_chunk_mut().expect("a block of points"));
        }
    }
    let mut sum = simd.splat(0.0);
    for block in 0..other.points.div_ceil(LANES) {
        let there = points(simd, other, block, [0.0; 3], other_u, other_v);
        let weight = simd.load(other.weight[block * LANES..].first_chunk().expect("a block of weights"));
        // How far the points of the second rise above the first's plane.
        let level =
            simd.splat(normal[0] * to_second[0] + normal[1] * to_second[1] + normal[2] * to_second[2]);
        let height = simd.mul(simd.add(dot(simd, normal, there), level), weight);
        let mut sum_here = simd.splat(0.0);
        for k in 0..rule.points {
            let x = simd.sub(simd.splat(xs[k]), there[0]);
            let y = simd.sub(simd.splat(ys[k]), there[1]);
            let z = simd.sub(simd.splat(zs[k]), there[2]);
            let r = simd.fused(z, z, simd.fused(y, y, simd.mul(x, x)));
            let share = simd.div(simd.splat(heights[k]), simd.mul(r, r));
            sum_here = simd.add(sum_here, share);
        }
        sum = simd.fused(sum_here, height, sum);
    }
    let mean = simd.sum_double(simd.widen(sum));
    (mean * first.area * second.area * scale * scale * FRAC_1_PI).max(0.0)
}

/// Outer quadratures, by how many of its lengths an interval is away from the inner edge.
static OUTER: LazyLock<[(f64, Quadrature); 3]> =
    LazyLock::new(|| [(3.0, gauss(4)), (1.2, gauss(6)), (0.6, gauss(10))]);

/// Intervals are halved so often at most: towards a common corner the integrand has a logarithm's kink, which a
/// thousandth of an edge leaves without weight.
const GRADINGS: u32 = 10;

/// Edges that turn from one another by less than this are parallel: what a turned scene leaves of right angles.
const PARALLEL: f64 = 1e-8;

/// G = ∮∮ ln r dr·dr' / 2π along both outlines (\[Sparrow\], eq. 9), of convex polygons each above the other's plane.
pub(super) fn contour(first: &[DVec3], second: &[DVec3]) -> f64 {
    // From a corner of the first and in lengths of both, so that the logarithms are small.
    let here = first[0];
    let far = |corners: &[DVec3]| corners.iter().fold(0.0_f64, |most, c| most.max(c.distance(here)));
    let unit = far(first).max(far(second));
    let scale = 1.0 / unit;
    let edge = |corners: &[DVec3], k: usize| {
        let next = if k + 1 == corners.len() { 0 } else { k + 1 };
        ((corners[k] - here) * scale, (corners[next] - here) * scale)
    };
    let mut sum = 0.0;
    for k in 0..first.len() {
        let outer = edge(first, k);
        for m in 0..second.len() {
            sum += edges(outer, edge(second, m));
        }
    }
    (sum * unit * unit * 0.5 * FRAC_1_PI).max(0.0)
}

/// ∫∫ ln r dr·dr' along two edges.
fn edges((a, b): (DVec3, DVec3), (c, d): (DVec3, DVec3)) -> f64 {
    let (outer, inner) = (b - a, d - c);
    let dot = outer.dot(inner);
    let (length, inner_length) = (outer.length(), inner.length());
    if dot.abs() <= 1e-14 * length * inner_length {
        return 0.0;
    }
    let (along, inner_along) = (outer / length, inner / inner_length);
    let cosine = dot / (length * inner_length);
    if along.cross(inner_along).length_squared() <= PARALLEL * PARALLEL {
        return cosine * parallel(a - c, inner_along, length * cosine.signum(), inner_length);
    }
    let edge = InnerEdge { start: c, end: d, along: inner_along, length: inner_length };
    // Where the lines come nearest to one another along the outer one, and how far off the real numbers they would
    // meet.
    let sine = 1.0 - cosine * cosine;
    let (to_inner, across) = (c - a, along.cross(inner_along));
    let nearest = (to_inner.dot(along) - to_inner.dot(inner_along) * cosine) / sine;
    let apart = to_inner.dot(across).powi(2) / (sine * sine);
    cosine * edge.graded(&Outer { start: a, along, nearest, apart }, 0.0, length, GRADINGS)
}

/// ∫∫ ln r ds ds' along parallel edges: the second antiderivative of ln √(x² + h²) is (x² - h²)/2 ln r - 3x²/4 + x h
/// atan(x/h). `length` is negative where they run against one another.
fn parallel(between: DVec3, along: DVec3, length: f64, inner_length: f64) -> f64 {
    let x = between.dot(along);
    let h = (between - along * x).length();
    let twice = |x: f64| {
        let squared = x * x + h * h;
        let logarithm = if squared > 0.0 { 0.25 * (x * x - h * h) * squared.ln() } else { 0.0 };
        logarithm - 0.75 * x * x + x * h * x.atan2(h)
    };
    let sum = twice(x + length) - twice(x) - twice(x + length - inner_length) + twice(x - inner_length);
    sum * length.signum()
}

/// The edge that is integrated along in closed form.
struct InnerEdge {
    start: DVec3,
    end: DVec3,
    along: DVec3,
    length: f64,
}

/// The edge that points are taken along.
struct Outer {
    start: DVec3,
    along: DVec3,
    /// Where h, the distance from the inner edge's line, is least, and the square of how far beside this, in imaginary
    /// numbers, it would be none: there its root has a kink.
    nearest: f64,
    apart: f64,
}

impl InnerEdge {
    /// ∫ of [`InnerEdge::inner`] along the outer edge from `from` to `to`, halved towards where it is not smooth: the
    /// ends of the inner edge, and where the lines meet.
    fn graded(&self, outer: &Outer, from: f64, to: f64, gradings: u32) -> f64 {
        let length = to - from;
        let middle = 0.5 * (from + to);
        let point = outer.start + outer.along * middle;
        let ends = point.distance_squared(self.start).min(point.distance_squared(self.end));
        let away = ends.min((middle - outer.nearest).powi(2) + outer.apart).sqrt() / length;
        let rule = OUTER.iter().find(|(least, _)| away >= *least);
        if rule.is_none() && gradings > 0 {
            return self.graded(outer, from, middle, gradings - 1)
                + self.graded(outer, middle, to, gradings - 1);
        }
        let (_, points) = rule.unwrap_or(&OUTER[2]);
        let mut sum = 0.0;
        for &(s, weight) in points {
            sum += weight * self.inner(outer.start + outer.along * (from + s * length));
        }
        sum * length
    }

    /// ∫ ln r along the edge from a point: with the distance h from its line,
    /// ∫ ln √(h² + x²) dx = x ln √(h² + x²) - x + h atan(x / h).
    fn inner(&self, point: DVec3) -> f64 {
        let (near, far) = (point - self.start, point - self.end);
        let foot = near.dot(self.along);
        let h = near.cross(self.along).length();
        let (x, y) = (-foot, self.length - foot);
        let half_log = |x: f64, squared: f64| if squared > 0.0 { 0.5 * x * squared.ln() } else { 0.0 };
        let logarithms = half_log(y, far.length_squared()) - half_log(x, near.length_squared());
        // atan(y/h) - atan(x/h), as one.
        let angle = if h > 0.0 { (h * self.length).atan2(h * h + x * y) } else { 0.0 };
        logarithms - self.length + h * angle
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factors::exact;
    use crate::geometry::chance::random;

    struct Pair<'a>(&'a Part, &'a Part);

    impl Kernel for Pair<'_> {
        type Output = f64;

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> f64 {
            exchange(simd, self.0, self.1)
        }
    }

    #[test]
    fn parts_near_and_far_exchange_what_the_judge_says() {
        let mut next = random();
        let mut judged = 0;
        while judged < 400 {
            let mut vector = || DVec3::new(next() - 0.5, next() - 0.5, next() - 0.5);
            let shape = if judged % 2 == 0 { FacetShape::Parallelogram } else { FacetShape::Triangle };
            let here = Part::new(vector(), vector(), vector(), shape);
            let there = Part::new(vector(), vector(), vector(), shape);
            let way = vector().normalize();
            let distance = (here.radius + there.radius) / (0.04 + 1.2 * next() * next());
            let there = Part::new(
                here.centre + way * distance - (there.centre - there.origin),
                there.u,
                there.v,
                shape,
            );
            let above = |a: &Part, b: &Part| a.heights(b.centre, b.normal).0 > 1e-3 * a.radius;
            if !above(&here, &there) || !above(&there, &here) {
                continue;
            }
            judged += 1;
            let answer = exact::between(here.outline().corners(), there.outline().corners()) * here.area;
            // The judge's own error is absolute: as a share of the factor it is the greater, the smaller that is.
            let bound = 5e-6 * answer + 1e-12 * here.area;
            let first = simd::run(Level::best(), Pair(&here, &there));
            assert!((first - answer).abs() < bound, "{distance}: {first}, not {answer}");
            for level in Level::available() {
                assert_eq!(simd::run(level, Pair(&here, &there)), first, "{level:?}");
            }
        }
    }

    #[test]
    fn edges_all_but_parallel_are_no_worse() {
        // Turned by ever smaller angles, a wall that stands on the floor, and one beside it.
        for turn in [1e-3, 1e-6, 3e-8, 1e-8, 1e-9, 1e-12, 0.0_f64] {
            for beside in [0.0, 0.2] {
                let along = DVec3::new(turn.sin(), turn.cos(), 0.0);
                let floor = Part::new(DVec3::ZERO, DVec3::X, DVec3::Y, FacetShape::Parallelogram);
                let at = DVec3::new(-0.01 - beside, 0.0, 0.0);
                let wall = Part::new(at, along, DVec3::Z, FacetShape::Parallelogram);
                let found = contour(floor.outline().corners(), wall.outline().corners());
                let answer = exact::between(floor.outline().corners(), wall.outline().corners());
                assert!((found - answer).abs() < 1e-7, "{turn} {beside}: {found}, not {answer}");
            }
        }
    }
}
