//! Convex polygons of a plane, and what is cut out of them.

use glam::DVec2;

/// Convex polygons, one after the other.
#[derive(Clone, Debug, Default)]
pub(crate) struct FlatPieces {
    corners: Vec<DVec2>,
    /// Where each ends.
    ends: Vec<usize>,
}

impl FlatPieces {
    pub(crate) fn clear(&mut self) {
        self.corners.clear();
        self.ends.clear();
    }

    pub(crate) fn push(&mut self, corners: impl IntoIterator<Item = DVec2>) {
        self.corners.extend(corners);
        self.ends.push(self.corners.len());
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &[DVec2]> {
        let mut start = 0;
        self.ends.iter().map(move |&end| &self.corners[std::mem::replace(&mut start, end)..end])
    }

    /// Add what of a piece lies outside of the convex polygon within all `lines`, and leave what lies inside in
    /// `inside[0]`, which is empty where there is none. A point (x, y) is within a line (a, b, c) where a + b x + c y
    /// >= 0.
    pub(crate) fn add_outside(
        &mut self,
        piece: &[DVec2],
        lines: impl Iterator<Item = [f64; 3]>,
        inside: &mut [Vec<DVec2>; 2],
    ) {
        let before = (self.corners.len(), self.ends.len());
        inside[0].clear();
        inside[0].extend_from_slice(piece);
        for line in lines {
            let [all, within] = inside;
            match side(all, line) {
                Side::Within => continue,
                Side::Without => all.clear(),
                Side::Both => {
                    within.clear();
                    let start = self.corners.len();
                    part(all, line, within, &mut self.corners);
                    std::mem::swap(all, within);
                    if self.corners.len() - start < 3 {
                        self.corners.truncate(start);
                    } else {
                        self.ends.push(self.corners.len());
                    }
                }
            }
            if all.len() < 3 {
                all.clear();
                // All of it is outside, and stays in one piece.
                self.corners.truncate(before.0);
                self.ends.truncate(before.1);
                self.push(piece.iter().copied());
                return;
            }
        }
    }
}

fn height(corner: DVec2, [a, b, c]: [f64; 3]) -> f64 {
    a + b * corner.x + c * corner.y
}

/// On which side of a line a polygon lies.
enum Side {
    Within,
    Without,
    Both,
}

/// Most polygons are on one side, and are not to be copied to be told so.
fn side(corners: &[DVec2], line: [f64; 3]) -> Side {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for &corner in corners {
        let height = height(corner, line);
        (low, high) = (low.min(height), high.max(height));
    }
    if low > 0.0 {
        Side::Within
    } else if high < 0.0 {
        Side::Without
    } else {
        Side::Both
    }
}

/// Part a convex polygon by a line.
fn part(corners: &[DVec2], line: [f64; 3], within: &mut Vec<DVec2>, without: &mut Vec<DVec2>) {
    let Some(&last) = corners.last() else { return };
    let (mut before, mut from) = (last, height(last, line));
    for &corner in corners {
        let to = height(corner, line);
        if from * to < 0.0 {
            let crossing = before + (corner - before) * (from / (from - to));
            within.push(crossing);
            without.push(crossing);
        }
        if to >= 0.0 {
            within.push(corner);
        }
        if to <= 0.0 {
            without.push(corner);
        }
        (before, from) = (corner, to);
    }
}
