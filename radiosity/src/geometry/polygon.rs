//! Simple planar polygons: normal, area, flatness, and cutting into triangles.
//!
//! A polygon is its corners in order; the edge from the last to the first is understood. Lengths are judged
//! against the polygon's own diameter, so no function here knows a unit.

use glam::{DVec2, DVec3};

/// Edges that come nearer to one another than this part of the diameter count as touching.
const TOUCHING: f64 = 1e-9;
/// Distances below this part of the diameter are rounding errors.
const ROUNDING: f64 = 1e-12;

/// Half the sum of the cross products of successive corners (Newell): its direction is the normal of the
/// side from which the corners run counter-clockwise, its length the area.
pub fn area_vector(corners: &[DVec3]) -> DVec3 {
    let Some((&first, rest)) = corners.split_first() else { return DVec3::ZERO };
    rest.windows(2).map(|pair| (pair[0] - first).cross(pair[1] - first)).sum::<DVec3>() * 0.5
}

/// The diagonal of the axis-parallel box about the points: between one and √3 times their greatest distance.
/// Zero for none.
pub fn diameter(points: &[DVec3]) -> f64 {
    let Some((&first, rest)) = points.split_first() else { return 0.0 };
    let (low, high) = rest.iter().fold((first, first), |(low, high), &p| (low.min(p), high.max(p)));
    (high - low).length()
}

/// The thickness of the slab, across [`area_vector`], that holds every corner: zero for a planar polygon, and
/// where there is no area to tell the plane by.
pub fn thickness(corners: &[DVec3]) -> f64 {
    let Some(normal) = area_vector(corners).try_normalize() else { return 0.0 };
    // From the first corner, so that a polygon far from the origin loses no digits.
    let heights = corners.iter().map(|p| (*p - corners[0]).dot(normal));
    let (low, high) = heights.fold((0.0_f64, 0.0_f64), |(low, high), h| (low.min(h), high.max(h)));
    high - low
}

/// Whether the polygon turns left at every corner, by more than a rounding error, and once around in all. A
/// corner of 180° makes it not convex in this sense.
pub fn is_convex(corners: &[DVec3]) -> bool {
    flatten(corners).is_some_and(|flat| turns_left_once(&flat))
}

/// Two edges that cross or touch where they should not, as the numbers of their first corners: none in a
/// simple polygon. Neighbouring edges touch at their common corner only. Quadratic in the number of corners.
///
/// Where all corners lie on one line, it is edges 0 and 1.
pub fn crossing(corners: &[DVec3]) -> Option<[usize; 2]> {
    if let Some(flat) = flatten(corners) {
        return if turns_left_once(&flat) { None } else { crossing_flat(&flat) };
    }
    // The areas of a figure of eight cancel out; its plane is that of its two longest reaches.
    let longest = |a: DVec3, b: DVec3| if b.length_squared() > a.length_squared() { b } else { a };
    let reaches = || corners.iter().map(|&p| p - corners[0]);
    let far = reaches().fold(DVec3::ZERO, longest);
    let across = reaches().map(|reach| far.cross(reach)).fold(DVec3::ZERO, longest);
    project(corners, across).and_then(|flat| crossing_flat(&flat)).or(Some([0, 1]))
}

/// Triangles that cover the polygon, as indices of its corners, each with the polygon's own winding; `None` where it is
/// not a simple polygon (its edges cross or touch).
///
/// A convex polygon is a fan about its first corner. Of any other the roundest ear is cut off first, until a
/// triangle is left (Meisters 1975: a simple polygon has two ears); corners of 180° give no triangle of
/// zero area. Quadratic in the number of corners, where the polygon is not convex.
pub fn triangulate(corners: &[DVec3]) -> Option<Vec<[u32; 3]>> {
    let flat = flatten(corners)?;
    if turns_left_once(&flat) {
        return Some((1..corners.len() as u32 - 1).map(|k| [0, k, k + 1]).collect());
    }
    if crossing_flat(&flat).is_some() {
        return None;
    }
    cut_ears(&flat)
}

/// The centroid where it lies on the polygon; else the centroid of the largest of its triangles.
///
/// Of corners that are no simple polygon it is their mean.
pub fn inner_point(corners: &[DVec3]) -> DVec3 {
    let mean = || corners.iter().sum::<DVec3>() / corners.len().max(1) as f64;
    let Some(triangles) = triangulate(corners) else { return mean() };
    let normal = area_vector(corners).normalize_or_zero();
    let (mut moment, mut total, mut largest) = (DVec3::ZERO, 0.0, (0.0, corners[0]));
    for triangle in &triangles {
        // Relative to the first corner, as the centroid of a small polygon far away needs every digit.
        let [a, b, c] = triangle.map(|k| corners[k as usize] - corners[0]);
        let area = (b - a).cross(c - a).dot(normal) * 0.5;
        let centroid = (a + b + c) / 3.0;
        moment += centroid * area;
        total += area;
        if area > largest.0 {
            largest = (area, corners[0] + centroid);
        }
    }
    let centroid = corners[0] + moment / total;
    let inside = triangles.iter().any(|triangle| {
        let [a, b, c] = triangle.map(|k| corners[k as usize]);
        [(a, b), (b, c), (c, a)].iter().all(|(p, q)| {
            (*q - *p).cross(centroid - *p).dot(normal) >= -ROUNDING * (*q - *p).length_squared()
        })
    });
    if inside && !near_edge(corners, centroid) { centroid } else { largest.1 }
}

/// The part of the polygon on the side of the plane through `point` to which `normal` points (Sutherland & Hodgman 1974).
/// Corners off the plane by a rounding error are on it. Of a concave polygon the parts may hang together by edges along the
/// plane, there and back; empty where nothing is left.
pub fn above_plane(corners: &[DVec3], point: DVec3, normal: DVec3) -> Vec<DVec3> {
    let limit = ROUNDING * (diameter(corners) + corners.first().map_or(0.0, |corner| corner.distance(point)));
    let height = |corner: DVec3| {
        let height = (corner - point).dot(normal);
        if height.abs() <= limit { 0.0 } else { height }
    };
    if !corners.iter().any(|&corner| height(corner) > 0.0) {
        return Vec::new();
    }
    let mut kept = Vec::with_capacity(corners.len() + 2);
    for (&a, &b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        let (from, to) = (height(a), height(b));
        if from >= 0.0 {
            kept.push(a);
        }
        if from * to < 0.0 {
            kept.push(a + (b - a) * (from / (from - to)));
        }
    }
    kept
}

/// Whether a point of the polygon's plane is as good as on an edge, which is no place to look out from. No
/// convex polygon has its centroid there, unless it is all edge.
fn near_edge(corners: &[DVec3], point: DVec3) -> bool {
    let limit = diameter(corners) * TOUCHING;
    (0..corners.len()).any(|k| {
        let (a, b) = (corners[k], corners[(k + 1) % corners.len()]);
        let along = ((point - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
        point.distance(a.lerp(b, along)) < limit
    })
}

/// The corners in the polygon's own plane, as [`project`] gives them, counter-clockwise. `None` where there are
/// too few, or no area to tell the plane by.
fn flatten(corners: &[DVec3]) -> Option<Vec<DVec2>> {
    let (area, diameter) = (area_vector(corners), diameter(corners));
    let plane = corners.len() >= 3 && area.length() > ROUNDING * diameter * diameter;
    if plane { project(corners, area) } else { None }
}

/// The corners in the plane across `normal`, the first at the origin and the diameter 1, counter-clockwise where
/// they are so about it.
fn project(corners: &[DVec3], normal: DVec3) -> Option<Vec<DVec2>> {
    let normal = normal.try_normalize()?;
    let diameter = diameter(corners);
    let x = normal.any_orthonormal_vector();
    let y = normal.cross(x);
    let flat = corners.iter().map(|p| (*p - corners[0]) / diameter).map(|p| DVec2::new(p.dot(x), p.dot(y)));
    diameter.is_finite().then(|| flat.collect())
}

/// Twice the signed area of a triangle: positive when it runs counter-clockwise.
fn twice_area(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

/// Whether the corner b turns left by more than a rounding error.
fn turns_left(a: DVec2, b: DVec2, c: DVec2) -> bool {
    let (before, after) = (b - a, c - b);
    before.perp_dot(after) > ROUNDING * (before.length() + after.length()).powi(2)
}

fn turns_left_once(flat: &[DVec2]) -> bool {
    let n = flat.len();
    let mut turns_back = 0;
    for k in 0..n {
        let (a, b, c) = (flat[k], flat[(k + 1) % n], flat[(k + 2) % n]);
        if !turns_left(a, b, c) {
            return false;
        }
        turns_back += usize::from(b.x >= a.x && c.x < b.x);
    }
    // A pentagram turns left throughout as well, but twice around: its edges turn back towards -x twice.
    turns_back == 1
}

fn crossing_flat(flat: &[DVec2]) -> Option<[usize; 2]> {
    let n = flat.len();
    let edge = |k: usize| (flat[k], flat[(k + 1) % n]);
    for i in 0..n {
        // An edge and the next share a corner, but neither comes back to the other.
        let ((a, b), c) = (edge(i), flat[(i + 2) % n]);
        if distance_to_segment(c, a, b) < TOUCHING || distance_to_segment(a, b, c) < TOUCHING {
            return Some([i, (i + 1) % n]);
        }
    }
    // From left to right, each edge is held against those that begin before it ends.
    let mut by_left: Vec<usize> = (0..n).collect();
    let left = |k: usize| edge(k).0.x.min(edge(k).1.x);
    by_left.sort_by(|&i, &j| left(i).total_cmp(&left(j)));
    for (rank, &i) in by_left.iter().enumerate() {
        let (a, b) = edge(i);
        let (low, high) = (a.min(b) - TOUCHING, a.max(b) + TOUCHING);
        for &j in by_left[rank + 1..].iter().take_while(|&&j| left(j) <= high.x) {
            let neighbours = i.abs_diff(j) == 1 || i.abs_diff(j) == n - 1;
            let (c, d) = edge(j);
            let apart = c.y.max(d.y) < low.y || c.y.min(d.y) > high.y;
            if !neighbours && !apart && segments_meet(a, b, c, d) {
                return Some([i.min(j), i.max(j)]);
            }
        }
    }
    None
}

fn distance_to_segment(point: DVec2, a: DVec2, b: DVec2) -> f64 {
    let length_squared = (b - a).length_squared();
    if length_squared == 0.0 {
        return point.distance(a);
    }
    let along = ((point - a).dot(b - a) / length_squared).clamp(0.0, 1.0);
    point.distance(a + (b - a) * along)
}

/// Whether two segments cross, or come near enough to count as touching.
fn segments_meet(a: DVec2, b: DVec2, c: DVec2, d: DVec2) -> bool {
    let apart = |p: f64, q: f64| (p > 0.0) != (q > 0.0);
    let cross =
        apart(twice_area(a, b, c), twice_area(a, b, d)) && apart(twice_area(c, d, a), twice_area(c, d, b));
    cross
        || [(a, c, d), (b, c, d), (c, a, b), (d, a, b)]
            .iter()
            .any(|&(point, from, to)| distance_to_segment(point, from, to) < TOUCHING)
}

/// Ear clipping of a simple polygon that runs counter-clockwise.
///
/// An ear is a corner that turns left and whose triangle holds no other corner. Each corner remembers the
/// first corner, by number, found in its triangle: corners only ever leave, so its search goes on from
/// there, and begins anew only when one of its neighbours is cut. That makes the whole quadratic.
fn cut_ears(flat: &[DVec2]) -> Option<Vec<[u32; 3]>> {
    let n = flat.len();
    let mut alive = vec![true; n];
    let mut before: Vec<usize> = (0..n).map(|k| (k + n - 1) % n).collect();
    let mut after: Vec<usize> = (0..n).map(|k| (k + 1) % n).collect();
    let mut searched = vec![0; n];
    let mut roundness: Vec<f64> =
        (0..n).map(|k| ear_roundness(flat[before[k]], flat[k], flat[after[k]])).collect();
    let mut triangles = Vec::with_capacity(n - 2);

    for left in (3..=n).rev() {
        let mut best: Option<usize> = None;
        for k in 0..n {
            if !alive[k] || roundness[k] <= best.map_or(0.0, |b| roundness[b]) {
                continue;
            }
            let (i, j) = (before[k], after[k]);
            let inside = triangle_test([flat[i], flat[k], flat[j]]);
            let blocks = |p: usize| alive[p] && inside(flat[p]) && p != i && p != j && p != k;
            while searched[k] < n && !blocks(searched[k]) {
                searched[k] += 1;
            }
            if searched[k] == n {
                best = Some(k);
            }
        }
        let ear = best?;
        let (i, j) = (before[ear], after[ear]);
        triangles.push([i as u32, ear as u32, j as u32]);
        if left == 3 {
            break;
        }
        alive[ear] = false;
        (after[i], before[j]) = (j, i);
        for k in [i, j] {
            searched[k] = 0;
            roundness[k] = ear_roundness(flat[before[k]], flat[k], flat[after[k]]);
        }
    }
    Some(triangles)
}

/// Area over the square of the longest side; zero where the corner b does not turn left.
fn ear_roundness(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    if !turns_left(a, b, c) {
        return 0.0;
    }
    let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
    twice_area(a, b, c) / longest
}

/// Whether points lie in a counter-clockwise triangle, or on its edge but for a rounding error.
fn triangle_test([a, b, c]: [DVec2; 3]) -> impl Fn(DVec2) -> bool {
    let sides = [(c, a), (a, b), (b, c)].map(|(from, to)| (from, to, -ROUNDING * from.distance(to)));
    move |p| sides.iter().all(|&(from, to, least)| twice_area(from, to, p) >= least)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn flat(points: &[[f64; 2]]) -> Vec<DVec3> {
        points.iter().map(|p| DVec3::new(p[0], p[1], 0.0)).collect()
    }

    fn check_cover(corners: &[DVec3], triangles: &[[u32; 3]]) {
        let whole = area_vector(corners);
        let mut sum = 0.0;
        for t in triangles {
            let area = area_vector(&t.map(|k| corners[k as usize])).dot(whole.normalize());
            assert!(area > 0.0, "{t:?} is turned over or empty");
            sum += area;
        }
        assert_eq!(triangles.len(), corners.len() - 2);
        assert!((sum / whole.length() - 1.0).abs() < 1e-9, "{sum} is not {}", whole.length());
    }

    /// A U: its centroid lies outside of it.
    const U: [[f64; 2]; 8] =
        [[0.0, 0.0], [3.0, 0.0], [3.0, 5.0], [2.0, 5.0], [2.0, 1.0], [1.0, 1.0], [1.0, 5.0], [0.0, 5.0]];

    #[test]
    fn a_square_is_a_fan_about_its_first_corner() {
        let square = flat(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        assert!(is_convex(&square));
        assert_eq!(triangulate(&square), Some(vec![[0, 1, 2], [0, 2, 3]]));
        assert_eq!(inner_point(&square), DVec3::new(0.5, 0.5, 0.0));
    }

    #[test]
    fn a_u_is_cut_and_looked_out_of_from_within() {
        let u = flat(&U);
        assert!(!is_convex(&u));
        check_cover(&u, &triangulate(&u).unwrap());
        let p = inner_point(&u);
        assert!(!(1.0..=2.0).contains(&p.x) || p.y < 1.0, "{p} is in the gap");
        let backwards: Vec<_> = u.iter().rev().copied().collect();
        check_cover(&backwards, &triangulate(&backwards).unwrap());
    }

    #[test]
    fn the_centroid_of_an_l_is_its_area_centroid() {
        let l = flat(&[[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [3.0, 3.0], [3.0, 2.0], [0.0, 2.0]]);
        // 4 x 2 at (2, 1), and 1 x 1 at (3.5, 2.5).
        let expected = DVec3::new((8.0 * 2.0 + 3.5) / 9.0, (8.0 + 2.5) / 9.0, 0.0);
        assert!(inner_point(&l).abs_diff_eq(expected, 1e-12));
    }

    #[test]
    fn straight_corners_make_no_empty_triangle() {
        let ruled =
            flat(&[[0.0, 0.0], [0.1, 0.0], [0.2, 0.0], [0.3, 0.0], [0.3, 0.1], [0.3, 0.2], [0.0, 0.2]]);
        check_cover(&ruled, &triangulate(&ruled).unwrap());
        let triangle = flat(&[[0.0, 0.0], [0.5, 0.5], [1.0, 1.0], [0.0, 1.0]]);
        check_cover(&triangle, &triangulate(&triangle).unwrap());
    }

    #[test]
    fn what_crosses_or_touches_itself_is_not_cut() {
        let bow_tie = flat(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]);
        let uneven_bow_tie = flat(&[[0.0, 0.0], [3.0, 3.0], [3.0, 0.0], [0.0, 1.0]]);
        let pentagram: Vec<_> = (0..5)
            .map(|k| {
                let angle = f64::from(k) * 0.8 * std::f64::consts::PI;
                DVec3::new(angle.cos(), angle.sin(), 0.0)
            })
            .collect();
        let spike = flat(&[[0.0, 0.0], [2.0, 0.0], [1.0, 0.0], [1.0, 1.0]]);
        let keyhole = flat(&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 0.0], [0.0, 4.0]]);
        assert_eq!(crossing(&bow_tie), Some([0, 2]));
        for polygon in [bow_tie, uneven_bow_tie, pentagram, spike, keyhole] {
            assert_eq!(triangulate(&polygon), None, "{polygon:?}");
            assert!(crossing(&polygon).is_some());
            assert!(inner_point(&polygon).is_finite());
        }
        assert_eq!(crossing(&flat(&[[0.0, 0.0], [3.0, 3.0], [3.0, 0.0], [0.0, 1.0]])), Some([0, 2]));
    }

    #[test]
    fn too_little_is_no_polygon() {
        for corners in [vec![], vec![DVec3::ONE], vec![DVec3::ZERO, DVec3::X], vec![DVec3::ONE; 5]] {
            assert_eq!(triangulate(&corners), None);
            assert!(inner_point(&corners).is_finite());
        }
        assert_eq!(triangulate(&[DVec3::NAN; 4]), None);
        assert_eq!(triangulate(&[DVec3::ZERO, DVec3::X, DVec3::X * 2.0]), None);
    }

    #[test]
    fn a_square_with_a_lifted_corner_is_half_as_thick() {
        let tent = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.02), DVec3::Y];
        assert!((thickness(&tent) - 0.01).abs() < 1e-5);
        assert!(thickness(&tent[..3]) < 1e-15);
    }

    #[test]
    fn a_comb_of_thousands_of_corners_is_cut_in_no_time() {
        let mut comb: Vec<DVec3> = vec![DVec3::new(0.0, -1.0, 0.0), DVec3::new(1000.0, -1.0, 0.0)];
        comb.extend((0..=1000).rev().map(|k| DVec3::new(f64::from(k), f64::from(k % 2) * 50.0, 0.0)));
        check_cover(&comb, &triangulate(&comb).unwrap());
    }

    prop_compose! {
        /// Corners at growing angles about a centre, somewhere in space, in some plane.
        fn star()(radii in prop::collection::vec(0.05_f64..1.0, 3..40), axis in prop::array::uniform3(-1.0_f64..1.0),
                  turn in 0.0_f64..6.0, centre in prop::array::uniform3(-5.0_f64..5.0), size in -3..4) -> Vec<DVec3> {
            let plane = glam::DQuat::from_scaled_axis(DVec3::from_array(axis) * turn);
            let n = radii.len() as f64;
            radii.iter().enumerate().map(|(k, r)| {
                let angle = k as f64 / n * std::f64::consts::TAU;
                (plane * DVec3::new(angle.cos(), angle.sin(), 0.0) * *r + DVec3::from_array(centre)) * 10_f64.powi(size)
            }).collect()
        }
    }

    proptest! {
        #[test]
        fn stars_are_covered_once_and_looked_out_of_from_within(corners in star()) {
            let triangles = triangulate(&corners).expect("a star is simple");
            check_cover(&corners, &triangles);
            let p = inner_point(&corners);
            let normal = area_vector(&corners).normalize();
            let within = |t: &[u32; 3]| {
                let [a, b, c] = t.map(|k| corners[k as usize]);
                [(a, b), (b, c), (c, a)].iter().all(|(a, b)| (*b - *a).cross(p - *a).dot(normal) > -1e-12 * (*b - *a).length())
            };
            prop_assert!(triangles.iter().any(within));
        }

        #[test]
        fn any_points_are_cut_or_refused_but_never_panic(points in prop::collection::vec(prop::array::uniform3(-2_i8..3), 0..12)) {
            let corners: Vec<_> = points.iter().map(|p| DVec3::from_array(p.map(f64::from))).collect();
            if let Some(triangles) = triangulate(&corners) {
                prop_assert!(triangles.iter().flatten().all(|&k| (k as usize) < corners.len()));
                prop_assert_eq!(crossing(&corners), None);
            }
            let _ = (inner_point(&corners), thickness(&corners), is_convex(&corners));
        }
    }
}
