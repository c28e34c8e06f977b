//! Exact form factors of polygons that nothing stands between: what the other methods are judged by.
//!
//! \[Lambert\] Lambert, Photometria, 1760: from a point to a polygon, in closed form. \[Sparrow\] Sparrow, A New and
//! Simpler Formulation for Radiative Angle Factors, 1963: between two polygons, as an integral along both outlines.

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::DVec3;

use crate::geometry::polygon;

/// The form factor from a point of a surface with this unit `normal` to a planar polygon: the share of what the surface
/// sends out there that arrives at the polygon's front (corners counter-clockwise seen from it), were nothing else in
/// the way. What lies below the surface's own plane is left out; 0 where the point is behind the polygon.
///
/// \[Lambert\]; exact but for rounding, 1e-14 or so.
pub fn from_point(point: DVec3, normal: DVec3, corners: &[DVec3]) -> f64 {
    seen_from(point, normal, polygon::above_plane(corners, point, normal)).clamp(0.0, 1.0)
}

/// The same of a polygon that lies above the surface's plane as it is; negative where the point is behind it.
pub(crate) fn seen_from(point: DVec3, normal: DVec3, corners: impl IntoIterator<Item = DVec3>) -> f64 {
    let mut corners = corners.into_iter().map(|corner| corner - point);
    let Some(first) = corners.next() else { return 0.0 };
    let (mut a, mut sum) = (first, 0.0);
    for b in corners.chain([first]) {
        let cross = a.cross(b);
        let sine = cross.length();
        // An edge that runs through the point itself spans no angle.
        if sine > 0.0 {
            sum += sine.atan2(a.dot(b)) * cross.dot(normal) / sine;
        }
        a = b;
    }
    // Seen from the front the corners run the other way round about the line of sight.
    -sum / TAU
}

/// The form factor from one planar polygon to another, front to front (corners counter-clockwise seen from it), were
/// nothing else in the way: the share of what leaves `from` evenly that arrives at `to`. Convex or concave; they may
/// touch, share an edge or part of one, or reach behind one another, but not pass through one another. 0 for a polygon
/// without area.
///
/// F A = ∮∮ ln r dr·dr' / 2π along both outlines (\[Sparrow\], eq. 9), the inner integral in closed form, the outer one
/// by Gauss quadrature, halved until it stands still. Within 1e-12 or so of the exact answer, absolutely, and 1e-10
/// relatively for form factors above 1e-6; some 10 to 100 µs.
pub fn between(from: &[DVec3], to: &[DVec3]) -> f64 {
    let area = polygon::area_vector(from).length();
    let [normal_from, normal_to] =
        [from, to].map(|corners| polygon::area_vector(corners).normalize_or_zero());
    if normal_from == DVec3::ZERO || normal_to == DVec3::ZERO {
        return 0.0;
    }
    // Only what lies before the other exchanges light, and that is a matter of planes.
    let sending = polygon::above_plane(from, to[0], normal_to);
    let receiving = polygon::above_plane(to, from[0], normal_from);
    if sending.is_empty() || receiving.is_empty() {
        return 0.0;
    }
    // Any constant may be added to the logarithm, for the outlines are closed: with lengths in their own distance it is
    // small.
    let unit = polygon::diameter(&[&sending[..], &receiving].concat());
    let mut sum = 0.0;
    for (a, b) in edges(&sending) {
        for (c, d) in edges(&receiving) {
            sum += Edges::new([a / unit, b / unit], [c / unit, d / unit]).map_or(0.0, |pair| pair.integral());
        }
    }
    (sum * unit * unit * 0.5 * FRAC_1_PI / area).clamp(0.0, 1.0)
}

fn edges(corners: &[DVec3]) -> impl Iterator<Item = (DVec3, DVec3)> {
    corners.iter().copied().zip(corners.iter().copied().cycle().skip(1))
}

/// Two edges, one of each outline.
struct Edges {
    /// From where, in which direction, how far the outer integral runs.
    start: DVec3,
    along: DVec3,
    length: f64,
    /// The same of the inner one.
    inner_start: DVec3,
    inner_along: DVec3,
    inner_length: f64,
}

/// Gauss-Legendre abscissas on -1..1 and weights; the others mirror these. Ten points: exact to degree 19.
const GAUSS: [(f64, f64); 5] = [
    (0.148_874_338_981_631_2, 0.295_524_224_714_752_9),
    (0.433_395_394_129_247_2, 0.269_266_719_309_996_3),
    (0.679_409_568_299_024_4, 0.219_086_362_515_982),
    (0.865_063_366_688_984_5, 0.149_451_349_150_580_6),
    (0.973_906_528_517_171_7, 0.066_671_344_308_688_1),
];

/// Halves of an outer integral that agree with the whole to this share of both lengths are not halved again.
const AGREEMENT: f64 = 2e-15;

/// How often an interval is halved at most: towards a common corner the integrand has a logarithm's kink, which 2^-40
/// of an edge leaves without weight.
const HALVINGS: u32 = 40;

impl Edges {
    /// `None` where the edges are at right angles, and give nothing.
    fn new([a, b]: [DVec3; 2], [c, d]: [DVec3; 2]) -> Option<Self> {
        let (length, inner_length) = ((b - a).length(), (d - c).length());
        if length == 0.0 || inner_length == 0.0 || (b - a).dot(d - c) == 0.0 {
            return None;
        }
        Some(Self {
            start: a,
            along: (b - a) / length,
            length,
            inner_start: c,
            inner_along: (d - c) / inner_length,
            inner_length,
        })
    }

    /// ∫∫ ln r dr·dr'.
    fn integral(&self) -> f64 {
        let whole = self.gauss(0.0, self.length);
        self.along.dot(self.inner_along) * self.halved(0.0, self.length, whole, HALVINGS)
    }

    fn halved(&self, from: f64, to: f64, whole: f64, halvings: u32) -> f64 {
        let middle = 0.5 * (from + to);
        let (left, right) = (self.gauss(from, middle), self.gauss(middle, to));
        let halves = left + right;
        if (halves - whole).abs() <= AGREEMENT * self.length * self.inner_length || halvings == 0 {
            return halves;
        }
        self.halved(from, middle, left, halvings - 1) + self.halved(middle, to, right, halvings - 1)
    }

    fn gauss(&self, from: f64, to: f64) -> f64 {
        let (centre, half) = (0.5 * (from + to), 0.5 * (to - from));
        let pair = |&(x, weight): &(f64, f64)| {
            weight * (self.inner(centre - half * x) + self.inner(centre + half * x))
        };
        half * GAUSS.iter().map(pair).sum::<f64>()
    }

    /// ∫ ln r along the inner edge, seen from the point `s` along the outer one: with the distance h from the inner
    /// edge's line, ∫ ln √(h² + x²) dx = x ln √(h² + x²) - x + h atan(x / h).
    fn inner(&self, s: f64) -> f64 {
        let to_point = self.start + self.along * s - self.inner_start;
        let foot = to_point.dot(self.inner_along);
        // Not by subtraction of squares, which would lose the digits of what is near.
        let h = to_point.cross(self.inner_along).length();
        let up_to = |x: f64| {
            let r = h.hypot(x);
            let logarithm = if r > 0.0 { x * r.ln() } else { 0.0 };
            logarithm - x + h * x.atan2(h)
        };
        up_to(self.inner_length - foot) - up_to(-foot)
    }
}
