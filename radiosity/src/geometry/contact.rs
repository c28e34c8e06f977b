//! Where flat plates cross or stand on one another.

use std::f64::consts::FRAC_1_SQRT_2;

use glam::DVec3;

use super::boxes::{BoxTree, bounds};
use super::polygon;

/// A triangle or parallelogram.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plate {
    /// The corners, counter-clockwise seen from the front; of a triangle the last stands twice.
    corners: [DVec3; 4],
    count: usize,
    /// Unit normal of the front.
    normal: DVec3,
    /// Bit k: the edge from corner k to the next is a border of its surface, or a fold of it, and no mere seam between
    /// two plates of one plane.
    border: u8,
    /// Plates of one body that has no contact with itself carry its number.
    body: Option<u32>,
}

/// A line on a plate where another plate crosses it, stands on it, or lies on it and ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// The plate that the line is on.
    pub plate: u32,
    /// The plate that makes it.
    pub by: u32,
    /// From where to where.
    pub ends: [DVec3; 2],
    /// Whether the other rises above the front, or hovers over it: what is on one side of the line may be hidden from the
    /// other. Else it lies flat on the plate, and hides nothing.
    pub stands: bool,
    /// Whether the line leaves the plate's own border.
    pub inner: bool,
}

impl Plate {
    /// A plate of three or four corners; `border` tells of each edge, bit by bit, whether it is one to be seen.
    ///
    /// # Panics
    ///
    /// Where there are fewer corners, or more.
    pub fn new(corners: &[DVec3], normal: DVec3, border: u8, body: Option<u32>) -> Self {
        let (corners, count) = match *corners {
            [a, b, c] => ([a, b, c, c], 3),
            [a, b, c, d] => ([a, b, c, d], 4),
            _ => panic!("a plate of {} corners", corners.len()),
        };
        Self { corners, count, normal, border, body }
    }

    fn corners(&self) -> &[DVec3] {
        &self.corners[..self.count]
    }

    /// Its area.
    pub fn area(&self) -> f64 {
        polygon::area_vector(self.corners()).length()
    }

    /// The same plate elsewhere.
    fn moved(&self, by: DVec3) -> Self {
        Self { corners: self.corners.map(|corner| corner + by), ..*self }
    }

    /// Each edge, with the unit vector in the plane that points inward from it.
    fn edges(&self) -> impl Iterator<Item = (DVec3, DVec3, DVec3)> {
        (0..self.count).map(|k| {
            let (from, to) = (self.corners[k], self.corners[(k + 1) % self.count]);
            (from, to, self.normal.cross(to - from).normalize_or_zero())
        })
    }

    /// The part of the line from `p` to `q`, in the plate's plane, that is within it or less than `tolerance` outside.
    fn clip(&self, [p, q]: [DVec3; 2], tolerance: f64) -> Option<[DVec3; 2]> {
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        for (from, _, inward) in self.edges() {
            let [at_p, at_q] = [p, q].map(|point| (point - from).dot(inward) + tolerance);
            match (at_p < 0.0, at_q < 0.0) {
                (true, true) => return None,
                (true, false) => enter = enter.max(at_p / (at_p - at_q)),
                (false, true) => leave = leave.min(at_p / (at_p - at_q)),
                (false, false) => {}
            }
        }
        let at = |t: f64| if t == 1.0 { q } else { p + (q - p) * t };
        (enter < leave).then(|| [at(enter), at(leave)])
    }

    /// The inward vector of the edge that both points lie on, if there is one.
    fn border_of(&self, ends: [DVec3; 2], tolerance: f64) -> Option<DVec3> {
        let on = |point: DVec3, from: DVec3, inward: DVec3| (point - from).dot(inward).abs() <= tolerance;
        let mut edges = self.edges();
        edges.find(|&(from, _, inward)| ends.iter().all(|&end| on(end, from, inward))).map(|edge| edge.2)
    }
}

/// Every contact between the plates, ordered by the plate that it is on. What is nearer than `tolerance` touches; and what
/// is over a plate's front, no higher than `hover` has it for that plate, is taken as if it were let down on it.
///
/// Two plates that meet edge to edge at less than 45 degrees from flat are one bent surface, and in no contact; nor are
/// tiles that lie flush, edge to edge in one plane. What is behind a plate's front is no matter to it.
pub fn contacts(plates: &[Plate], hover: &[f64], tolerance: f64) -> Vec<Contact> {
    let tree = BoxTree::new(plates.iter().map(|plate| bounds(plate.corners(), tolerance)));
    let mut found = Vec::new();
    for ((plate, &hover), index) in plates.iter().zip(hover).zip(0..) {
        let mut near = Vec::new();
        tree.overlapping(bounds(plate.corners(), tolerance + hover), |other| near.push(other));
        near.sort_unstable();
        for other in near {
            let by = &plates[other as usize];
            if other != index && (by.body.is_none() || by.body != plate.body) {
                on_plate(plate, by, hover, tolerance, |ends, stands, inner| {
                    found.push(Contact { plate: index, by: other, ends, stands, inner });
                });
            }
        }
    }
    found
}

/// Pairs of plates, the later second, that face one way in one plane and lie on one another, if only in part; with the
/// area that they share, and a point of it.
pub fn overlaps(plates: &[Plate], tolerance: f64) -> Vec<([u32; 2], f64, DVec3)> {
    let tree = BoxTree::new(plates.iter().map(|plate| bounds(plate.corners(), tolerance)));
    let mut found = Vec::new();
    for (plate, index) in plates.iter().zip(0..) {
        tree.overlapping(bounds(plate.corners(), tolerance), |other| {
            let by = &plates[other as usize];
            let off = |corner: &DVec3| (corner - plate.corners[0]).dot(plate.normal).abs() > tolerance;
            if other <= index || by.normal.dot(plate.normal) <= 0.0 || by.corners().iter().any(off) {
                return;
            }
            let within = (plate.edges()).fold(by.corners().to_vec(), |part, (from, _, inward)| {
                polygon::above_plane(&part, from, inward)
            });
            let area = polygon::area_vector(&within).length();
            if area > 4.0 * tolerance * polygon::diameter(&within) {
                found.push(([index, other], area, within.iter().sum::<DVec3>() / within.len() as f64));
            }
        });
    }
    found.sort_unstable_by_key(|&(pair, ..)| pair);
    found
}

/// The contacts on `plate` that `by` makes.
fn on_plate(
    plate: &Plate,
    by: &Plate,
    hover: f64,
    tolerance: f64,
    mut put: impl FnMut([DVec3; 2], bool, bool),
) {
    let height = |corner: &DVec3| (corner - plate.corners[0]).dot(plate.normal);
    let lowest = by.corners().iter().map(height).fold(f64::INFINITY, f64::min);
    let hovers = lowest > tolerance && lowest <= hover;
    let by = &if hovers { by.moved(plate.normal * -lowest) } else { *by };
    let heights: [f64; 4] = by.corners.map(|corner| match height(&corner) {
        height if height.abs() <= tolerance => 0.0,
        height => height,
    });
    let (low, high) = heights.iter().fold((0.0_f64, 0.0_f64), |(low, high), &h| (low.min(h), high.max(h)));
    let long = |ends: [DVec3; 2]| ends[0].distance(ends[1]) > 4.0 * tolerance;
    if low == 0.0 && high == 0.0 {
        // In one plane: the other's border, where it runs over this one.
        for (k, (from, to, _)) in by.edges().enumerate() {
            if by.border >> k & 1 == 0 {
                continue;
            }
            let within = plate.clip([from, to], tolerance).filter(|&ends| long(ends));
            let Some(ends) = within else { continue };
            // Flush tiles hide nothing from each other; what hovers does, also along the edge between two plates.
            let inner = plate.border_of(ends, 2.0 * tolerance).is_none();
            if inner || hovers {
                put(ends, hovers, inner);
            }
        }
        return;
    }
    if high == 0.0 || heights[..by.count].iter().all(|&h| h > 0.0) {
        return;
    }
    // Where the other meets this one's plane: from the first point to the one farthest from it.
    let mut line: Option<[DVec3; 2]> = None;
    let mut on_its_edge = 0;
    let mut meet = |point: DVec3| match &mut line {
        None => line = Some([point, point]),
        Some([first, last]) => {
            if point.distance_squared(*first) > last.distance_squared(*first) {
                *last = point;
            }
        }
    };
    for k in 0..by.count {
        let next = (k + 1) % by.count;
        let (here, there) = (heights[k], heights[next]);
        if here == 0.0 {
            meet(by.corners[k]);
            on_its_edge += 1;
        }
        if here * there < 0.0 {
            meet(by.corners[k] + (by.corners[next] - by.corners[k]) * (here / (here - there)));
        }
    }
    let Some(ends) = line.and_then(|line| plate.clip(line, tolerance)).filter(|&ends| long(ends)) else {
        return;
    };
    match plate.border_of(ends, 2.0 * tolerance) {
        None => put(ends, true, true),
        Some(inward) => {
            // Edge to edge they may be one bent surface.
            let middle = (ends[0] + ends[1]) * 0.5;
            let along = (ends[1] - ends[0]).normalize_or_zero();
            let reach = by.corners().iter().fold(DVec3::ZERO, |reach, &corner| {
                let across = (corner - middle).reject_from(along);
                if across.length_squared() > reach.length_squared() { across } else { reach }
            });
            let bent = on_its_edge == 2 && reach.normalize_or_zero().dot(-inward) > FRAC_1_SQRT_2;
            if !bent {
                put(ends, true, false);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plate(corners: &[[f64; 3]]) -> Plate {
        let corners: Vec<DVec3> = corners.iter().map(|&corner| corner.into()).collect();
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        Plate::new(&corners, normal, 15, None)
    }

    /// A floor of 4 by 4 that faces +z.
    fn floor() -> Plate {
        plate(&[[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [0.0, 4.0, 0.0]])
    }

    fn on_floor(other: Plate) -> Vec<Contact> {
        contacts(&[floor(), other], &[0.1; 2], 1e-6)
            .into_iter()
            .filter(|contact| contact.plate == 0)
            .collect()
    }

    /// A wall over x = 1, from y = 1 to 9, with its foot and its head at these heights.
    fn wall(foot: f64, head: f64) -> Plate {
        plate(&[[1.0, 1.0, foot], [1.0, 9.0, foot], [1.0, 9.0, head], [1.0, 1.0, head]])
    }

    #[test]
    fn a_wall_that_stands_on_the_floor_or_runs_through_it_leaves_a_line() {
        for foot in [0.0, -1.0, 1e-7, -1e-7, 0.05] {
            let found = on_floor(wall(foot, 3.0));
            assert_eq!(found.len(), 1, "{foot}");
            let contact = found[0];
            assert!(contact.stands && contact.inner);
            let mut ys = contact.ends.map(|end| end.y);
            ys.sort_by(f64::total_cmp);
            assert!((ys[0] - 1.0).abs() < 1e-5 && (ys[1] - 4.0).abs() < 1e-5, "{ys:?}");
            assert!(contact.ends.iter().all(|end| (end.x - 1.0).abs() < 1e-12 && end.z.abs() < 2e-7));
        }
        for (foot, head) in [(0.11, 3.0), (-3.0, 0.0), (-3.0, -1.0)] {
            assert_eq!(on_floor(wall(foot, head)), [], "from {foot} to {head}");
        }
    }

    #[test]
    fn a_rug_is_outlined_and_tiles_side_by_side_are_not() {
        let rug = on_floor(plate(&[[1.0, 1.0, 0.0], [1.0, 2.0, 0.0], [6.0, 2.0, 0.0], [6.0, 1.0, 0.0]]));
        assert_eq!(rug.len(), 3);
        assert!(rug.iter().all(|contact| !contact.stands && contact.inner));
        let length: f64 = rug.iter().map(|contact| contact.ends[0].distance(contact.ends[1])).sum();
        assert!((length - 7.0).abs() < 1e-4);
        // The same hovering: the floor is hidden under it.
        let rug = on_floor(plate(&[[1.0, 1.0, 0.04], [1.0, 2.0, 0.04], [6.0, 2.0, 0.04], [6.0, 1.0, 0.04]]));
        assert_eq!(rug.len(), 3);
        assert!(
            rug.iter().all(|contact| contact.stands && contact.ends.iter().all(|end| end.z.abs() < 1e-12))
        );
        let tile = plate(&[[4.0, 0.0, 0.0], [8.0, 0.0, 0.0], [8.0, 4.0, 0.0], [4.0, 4.0, 0.0]]);
        assert_eq!(on_floor(tile), []);
    }

    #[test]
    fn edge_to_edge_a_bend_is_no_contact_and_a_corner_is() {
        let beside = |degrees: f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            plate(&[[4.0, 0.0, 0.0], [4.0 + cos, 0.0, sin], [4.0 + cos, 4.0, sin], [4.0, 4.0, 0.0]])
        };
        assert_eq!(on_floor(beside(30.0)), []);
        let corner = on_floor(beside(90.0));
        assert!(matches!(corner[..], [Contact { stands: true, inner: false, .. }]), "{corner:?}");
        assert_eq!(on_floor(beside(-90.0)), []);
    }

    #[test]
    fn a_body_has_no_contact_with_itself() {
        let of_body = |plate: Plate| Plate { body: Some(7), ..plate };
        assert_eq!(contacts(&[of_body(floor()), of_body(wall(0.0, 1.0))], &[0.1; 2], 1e-6), []);
    }
}
