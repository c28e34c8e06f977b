//! The patches of a surface parted along the lines where others meet it, so that none lies on both sides of a wall.
//!
//! A surface is a net of flat convex faces here, with corners in common. A line parts each face that it crosses; where it ends
//! within a face it is drawn on to the face's border, and no further. A point that is put on an edge is a corner of the faces on
//! both sides of it, so that the net stays without gaps.

use std::collections::{HashMap, HashSet};

use glam::DVec3;

use super::Pieces;
use super::cut::Lie;
use super::refinement::{Origin, Place, Refinement};
use crate::geometry::boxes::{BoxTree, bounds};
use crate::geometry::contact::Contact;
use crate::geometry::polygon;
use crate::scene::Parallelogram;

/// A line that comes as near as this to a corner runs through it, and no part of a face is narrower: a share of the face's
/// own width.
const SNAP: f64 = 0.01;

/// The most lines that part one face, the longest first: what has more stands on it with a fringe of short ones.
const MOST_LINES: usize = 256;

/// Halves of a cell that differ by less than this from one plane are one face, relative to its size.
const FLAT: f64 = 1e-9;

/// The faces of a surface.
pub(super) struct Net {
    points: Vec<DVec3>,
    /// What was put between two points that had an edge in common, the lesser first.
    middles: HashMap<[u32; 2], u32>,
    /// Cell by cell.
    faces: Vec<Face>,
    /// For each cell, the area of its faces.
    cell_area: Vec<f64>,
}

#[derive(Clone)]
struct Face {
    /// Counter-clockwise seen from the front.
    corners: Vec<u32>,
    /// The patch that it is (part of) as long as it is not parted, and which quarter of it.
    place: Place,
}

/// A face is quartered where something stands nearer to its centre than this many times the way from there to its farthest
/// corner: those that touch it, and not those behind them.
const NEAR: f64 = 1.25;

/// What becomes of a surface that is parted.
pub(super) struct Parted {
    pub(super) lies: Vec<Lie>,
    /// Of each, where it comes from.
    pub(super) origins: Vec<Origin>,
    pub(super) pieces: Pieces,
}

/// An edge at the border of a net: its ends, in the order of their coordinates, and the normal of its face.
pub(super) struct BorderEdge {
    pub(super) ends: [u32; 2],
    pub(super) key: [[u64; 3]; 2],
    pub(super) normal: DVec3,
}

/// A line to part faces by.
struct Line {
    from: DVec3,
    along: DVec3,
    length: f64,
    stands: bool,
}

impl Net {
    /// Of a parallelogram cut into equal cells.
    pub(super) fn of_cells(surface: u32, p: &Parallelogram, columns: u32, rows: u32) -> Self {
        let mut points = Vec::with_capacity((columns as usize + 1) * (rows as usize + 1));
        for row in 0..=rows {
            for column in 0..=columns {
                let [s, t] =
                    [(column, columns), (row, rows)].map(|(k, count)| f64::from(k) / f64::from(count));
                points.push(p.origin + p.u * s + p.v * t);
            }
        }
        let turned = p.u.cross(p.v).dot(p.normal) < 0.0;
        let corner = |column: u32, row: u32| row * (columns + 1) + column;
        let mut faces = Vec::with_capacity(columns as usize * rows as usize);
        for row in 0..rows {
            for column in 0..columns {
                let (next, above) = (column + 1, row + 1);
                let mut corners =
                    vec![corner(column, row), corner(next, row), corner(next, above), corner(column, above)];
                if turned {
                    corners.reverse();
                }
                faces.push(Face { corners, place: Place::of_cell(surface, row * columns + column) });
            }
        }
        Self { points, middles: HashMap::new(), faces, cell_area: Vec::new() }.measured()
    }

    /// With the areas of its cells.
    fn measured(mut self) -> Self {
        let area = |face: &Face| polygon::area_vector(&self.places(&face.corners)).length();
        let cells = self.faces.chunk_by(|one, other| one.place.cell == other.place.cell);
        self.cell_area = cells.map(|faces| faces.iter().map(area).sum()).collect();
        self
    }

    /// Of a surface in pieces, its patches counted from 0. The two halves of a flat cell are one face.
    pub(super) fn of_pieces(surface: u32, pieces: &Pieces) -> Self {
        let (points, middles, faces) = (Vec::new(), HashMap::new(), Vec::new());
        let mut net = Self { points, middles, faces, cell_area: Vec::new() };
        let mut numbers = HashMap::new();
        let mut at = 0;
        for patches in pieces.patch.chunk_by(|one, other| one == other) {
            let (triangles, cell) = (&pieces.triangles[at..at + patches.len()], patches[0]);
            at += patches.len();
            let place = |face: u32| Place { face, ..Place::of_cell(surface, cell) };
            let mut number = |point: DVec3| {
                *numbers.entry(key(point)).or_insert_with(|| {
                    net.points.push(point);
                    net.points.len() as u32 - 1
                })
            };
            match *triangles {
                [one, other] if let Some(corners) = quadrilateral(one, other) => {
                    let corners = corners.map(&mut number).to_vec();
                    net.faces.push(Face { corners, place: place(0) });
                }
                _ => net.faces.extend(triangles.iter().zip(0..).map(|(triangle, face)| {
                    let corners = triangle.map(&mut number).to_vec();
                    Face { corners, place: place(face) }
                })),
            }
        }
        net.measured()
    }

    fn places(&self, corners: &[u32]) -> Vec<DVec3> {
        corners.iter().map(|&k| self.points[k as usize]).collect()
    }

    /// The corners, with what was put between them since.
    fn with_middles(&self, corners: &[u32]) -> Vec<u32> {
        let mut all = Vec::with_capacity(corners.len());
        for (&from, &to) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            all.push(from);
            let mut ahead = vec![to];
            let mut at = from;
            while let Some(&next) = ahead.last() {
                match self.middles.get(&[at.min(next), at.max(next)]) {
                    Some(&middle) => ahead.push(middle),
                    None => {
                        at = next;
                        ahead.pop();
                        if !ahead.is_empty() {
                            all.push(at);
                        }
                    }
                }
            }
        }
        all
    }

    fn add(&mut self, point: DVec3) -> u32 {
        self.points.push(point);
        self.points.len() as u32 - 1
    }

    /// A point on the edge from `a` to `b`, where a height over the line that parts them is nought.
    fn crossing(&mut self, (a, height_a): (u32, f64), (b, height_b): (u32, f64)) -> u32 {
        let ((low, from), (high, to)) =
            if a < b { ((a, height_a), (b, height_b)) } else { ((b, height_b), (a, height_a)) };
        let [start, end] = [low, high].map(|k| self.points[k as usize]);
        let point = self.add(start + (end - start) * (from / (from - to)));
        self.middles.insert([low, high], point);
        point
    }

    /// The two parts of a face on either side of a line, or none where it does not cross it. `normal` is the face's, and what
    /// is no farther than `snap` from the line is on it.
    fn part(&mut self, corners: &[u32], line: &Line, normal: DVec3, snap: f64) -> Option<[Vec<u32>; 2]> {
        let across = normal.cross(line.along);
        let exact = |net: &Self, k: u32| (net.points[k as usize] - line.from).dot(across);
        let beside = |side: f64| corners.iter().all(|&k| side * exact(self, k) >= -snap);
        if beside(1.0) || beside(-1.0) {
            return None;
        }
        let mut corners = self.with_middles(corners);
        let height = |net: &Self, k: u32| match exact(net, k) {
            height if height.abs() <= snap => 0.0,
            height => height,
        };
        // From the first corner above the line: above, on it, below, on it.
        let count = corners.len();
        let first = (0..count).find(|&k| {
            height(self, corners[k]) > 0.0 && height(self, corners[(k + count - 1) % count]) <= 0.0
        })?;
        corners.rotate_left(first);
        let heights: Vec<f64> = corners.iter().map(|&k| height(self, k)).collect();
        let run = |from: usize, wanted: fn(f64) -> bool| {
            from + heights[from..].iter().take_while(|&&height| wanted(height)).count()
        };
        let above = run(0, |height| height > 0.0);
        let on = run(above, |height| height == 0.0);
        let below = run(on, |height| height < 0.0);
        if below == on || run(below, |height| height == 0.0) != count {
            return None;
        }
        // Where the line enters and leaves: of corners on it the nearest, else a point of the edge between.
        let nearest = |net: &Self, range: std::ops::Range<usize>| {
            range.min_by(|&i, &j| exact(net, corners[i]).abs().total_cmp(&exact(net, corners[j]).abs()))
        };
        let place = |net: &Self, corner: Option<usize>, [i, j]: [usize; 2]| match corner {
            Some(k) => net.points[corners[k] as usize],
            None => {
                let [p, q] = [i, j].map(|k| net.points[corners[k] as usize]);
                p + (q - p) * (heights[i] / (heights[i] - heights[j]))
            }
        };
        let (out, back) = (nearest(self, above..on), nearest(self, below..count));
        let (out_edge, back_edge) = ([on - 1, on], [below - 1, 0]);
        let ends = [place(self, out, out_edge), place(self, back, back_edge)];
        let [reach_out, reach_back] = ends.map(|end| (end - line.from).dot(line.along));
        let (least, most) = (reach_out.min(reach_back), reach_out.max(reach_back));
        if most.min(line.length) - least.max(0.0) <= snap {
            return None;
        }
        let mut end = |corner: Option<usize>, [i, j]: [usize; 2]| match corner {
            Some(k) => corners[k],
            None => self.crossing((corners[i], heights[i]), (corners[j], heights[j])),
        };
        let (out_point, back_point) = (end(out, out_edge), end(back, back_edge));
        // The line's own ends within the face are corners too: from there on nothing stands.
        let mut chord: Vec<f64> = [0.0, line.length]
            .into_iter()
            .filter(|&at| at > least + snap && at < most - snap)
            .map(|at| (at - reach_out) / (reach_back - reach_out))
            .collect();
        chord.sort_by(f64::total_cmp);
        let chord: Vec<u32> =
            chord.into_iter().map(|share| self.add(ends[0] + (ends[1] - ends[0]) * share)).collect();

        let (out, back) = (out.unwrap_or(on), back.unwrap_or(count));
        let mut upper = corners[..out].to_vec();
        upper.push(out_point);
        upper.extend(&chord);
        upper.push(back_point);
        upper.extend(corners.iter().skip(back + 1));
        let mut lower = vec![out_point];
        lower.extend(&corners[(out + 1).min(on)..back]);
        lower.push(back_point);
        lower.extend(chord.iter().rev());
        Some([upper, lower])
    }

    /// Quarter the faces that are near to where something stands, their quarters likewise, so many times over. Faces grow with
    /// their distance: each is no nearer than its own size, and so about twice as long as the next nearer, at most.
    pub(super) fn grade(&mut self, contacts: &[Contact], halvings: u32) {
        let ends: Vec<[DVec3; 2]> =
            contacts.iter().filter(|contact| contact.stands).map(|contact| contact.ends).collect();
        let tree = BoxTree::new(ends.iter().map(|ends| bounds(ends, 0.0)));
        for _ in 0..halvings {
            for face in std::mem::take(&mut self.faces) {
                let places = self.places(&face.corners);
                let centre = places.iter().sum::<DVec3>() / places.len() as f64;
                let near = NEAR * places.iter().map(|place| place.distance(centre)).fold(0.0, f64::max);
                let mut found = false;
                tree.overlapping(bounds(&[centre], near), |line| {
                    let [a, b] = ends[line as usize];
                    let along = ((centre - a).dot(b - a) / a.distance_squared(b)).clamp(0.0, 1.0);
                    found |= centre.distance(a + (b - a) * along) < near;
                });
                if found {
                    let quarters = self.quarters(&face);
                    self.faces.extend(quarters);
                } else {
                    self.faces.push(face);
                }
            }
        }
    }

    /// Quarter the faces that a refinement names, and of their quarters those that it names.
    pub(super) fn refine(&mut self, refinement: &Refinement) {
        let mut open = std::mem::take(&mut self.faces);
        open.reverse();
        while let Some(face) = open.pop() {
            if refinement.is_quartered(face.place) {
                open.extend(self.quarters(&face).into_iter().rev());
            } else {
                self.faces.push(face);
            }
        }
    }

    /// Quarter faces until none has an edge that others have cut into more than two. Returns whether any was.
    pub(super) fn balance(&mut self) -> bool {
        let mut any = false;
        loop {
            let before = self.faces.len();
            for face in std::mem::take(&mut self.faces) {
                if self.edges(&face).any(|ends| self.is_quartered(ends)) {
                    let quarters = self.quarters(&face);
                    self.faces.extend(quarters);
                } else {
                    self.faces.push(face);
                }
            }
            if self.faces.len() == before {
                return any;
            }
            any = true;
        }
    }

    fn edges<'a>(&self, face: &'a Face) -> impl Iterator<Item = [u32; 2]> + use<'a> {
        face.corners.iter().zip(face.corners.iter().cycle().skip(1)).map(|(&from, &to)| [from, to])
    }

    /// Whether one of the halves of an edge has a point between its ends.
    fn is_quartered(&self, [a, b]: [u32; 2]) -> bool {
        self.middle([a, b])
            .is_some_and(|middle| self.middle([a, middle]).is_some() || self.middle([middle, b]).is_some())
    }

    /// What was put between two points.
    pub(super) fn middle(&self, [a, b]: [u32; 2]) -> Option<u32> {
        self.middles.get(&[a.min(b), a.max(b)]).copied()
    }

    /// Put a point between two, half way.
    pub(super) fn halve(&mut self, [a, b]: [u32; 2]) -> u32 {
        let ends = [a.min(b), a.max(b)];
        self.middles.get(&ends).copied().unwrap_or_else(|| {
            let [from, to] = ends.map(|k| self.points[k as usize]);
            let middle = self.add((from + to) * 0.5);
            self.middles.insert(ends, middle);
            middle
        })
    }

    /// The edges that have a face on one side only.
    pub(super) fn border(&self) -> Vec<BorderEdge> {
        let mut edges: HashMap<[u32; 2], (usize, u32)> = HashMap::new();
        for (index, face) in self.faces.iter().enumerate() {
            for [a, b] in self.edges(face) {
                edges.entry([a.min(b), a.max(b)]).or_insert((index, 0)).1 += 1;
            }
        }
        let mut border: Vec<BorderEdge> = edges
            .into_iter()
            .filter(|(_, (_, count))| *count == 1)
            .map(|(mut ends, (index, _))| {
                let mut key = ends.map(|k| key(self.points[k as usize]));
                if key[0] > key[1] {
                    (ends, key) = ([ends[1], ends[0]], [key[1], key[0]]);
                }
                let normal = polygon::area_vector(&self.places(&self.faces[index].corners));
                BorderEdge { ends, key, normal: normal.normalize_or_zero() }
            })
            .collect();
        border.sort_unstable_by_key(|edge| edge.ends);
        border
    }

    /// Four of a triangle or quadrilateral, by the middles of its edges. Those of a quadrilateral lie as its own edges do, row
    /// by row, so that they are a grid again to whoever looks for one.
    fn quarters(&mut self, face: &Face) -> Vec<Face> {
        let place = face.place;
        let quarter = |corners: &[u32], k: u32| Face { corners: corners.to_vec(), place: place.quarter(k) };
        match face.corners[..] {
            [a, b, c] => {
                let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|ends| self.halve(ends));
                let corners = [[ab, bc, ca], [a, ab, ca], [ab, b, bc], [ca, bc, c]];
                corners.iter().zip(0..).map(|(corners, k)| quarter(corners, k)).collect()
            }
            [a, b, c, d] => {
                let [ab, bc, cd, da] = [[a, b], [b, c], [c, d], [d, a]].map(|ends| self.halve(ends));
                let places = self.places(&face.corners);
                let inner = self.add(places.iter().sum::<DVec3>() * 0.25);
                let corners =
                    [[a, ab, inner, da], [ab, b, bc, inner], [da, inner, cd, d], [inner, bc, c, cd]];
                corners.iter().zip(0..).map(|(corners, k)| quarter(corners, k)).collect()
            }
            _ => unreachable!("no other faces are there before any is parted"),
        }
    }

    /// Part the faces by `contacts`. `lies` are the patches as they were; `None` where all stays as it was.
    pub(super) fn parted(mut self, contacts: &[Contact], lies: &[Lie], tolerance: f64) -> Option<Parted> {
        let graded = !self.middles.is_empty();
        let lines = lines(contacts);
        let planes: Vec<(DVec3, f64)> = self.faces.iter().map(|face| self.plane(face)).collect();
        let tree = BoxTree::new(
            self.faces.iter().zip(&planes).map(|(face, plane)| bounds(&self.places(&face.corners), plane.1)),
        );
        let mut lines_of = vec![Vec::new(); self.faces.len()];
        for (line, index) in lines.iter().zip(0_u32..) {
            let ends = [line.from, line.from + line.along * line.length];
            tree.overlapping(bounds(&ends, tolerance), |face| {
                let place = self.points[self.faces[face as usize].corners[0] as usize];
                let (normal, snap) = planes[face as usize];
                let counts = line.length > snap && lines_of[face as usize].len() < MOST_LINES;
                if counts && ends.iter().all(|&end| (end - place).dot(normal).abs() <= 4.0 * tolerance) {
                    lines_of[face as usize].push(index);
                }
            });
        }
        drop(tree);
        let faces = std::mem::take(&mut self.faces);
        let mut parts: Vec<Vec<Vec<u32>>> = faces.iter().map(|face| vec![face.corners.clone()]).collect();
        for (face, index) in (0..faces.len()).zip(0..) {
            let (normal, snap) = planes[face];
            for &line in &lines_of[face] {
                let line = &lines[line as usize];
                for part in std::mem::take(&mut parts[index]) {
                    match self.part(&part, line, normal, snap) {
                        Some(two) => parts[index].extend(two),
                        None => parts[index].push(part),
                    }
                }
            }
        }
        for part in parts.iter_mut().flatten() {
            *part = self.with_middles(part);
        }
        let sharp = self.sharp(&parts, &lines_of, &lines, &planes).or_else(|| graded.then(HashSet::new))?;
        Some(self.finish(&faces, &parts, &sharp, lies))
    }

    /// The plane of a face by its normal, and how near to a line counts as on it.
    fn plane(&self, face: &Face) -> (DVec3, f64) {
        let places = self.places(&face.corners);
        let area_vector = polygon::area_vector(&places);
        let longest = (places.iter().zip(places.iter().cycle().skip(1)))
            .map(|(a, b)| a.distance(*b))
            .fold(0.0, f64::max);
        let area = area_vector.length();
        (area_vector.normalize_or_zero(), if area > 0.0 { SNAP * area / longest } else { 0.0 })
    }

    /// The edges that something stands on, the lesser corner first; `None` where no face was parted and nothing stands
    /// between two of them.
    fn sharp(
        &self,
        parts: &[Vec<Vec<u32>>],
        lines_of: &[Vec<u32>],
        lines: &[Line],
        planes: &[(DVec3, f64)],
    ) -> Option<HashSet<[u32; 2]>> {
        let mut sharp: HashMap<[u32; 2], bool> = HashMap::new();
        let mut parted = false;
        for ((parts, of_face), &(normal, snap)) in parts.iter().zip(lines_of).zip(planes) {
            parted |= parts.len() > 1;
            for part in parts.iter().filter(|_| !of_face.is_empty()) {
                for (&from, &to) in part.iter().zip(part.iter().cycle().skip(1)) {
                    let ends = [from, to].map(|k| self.points[k as usize]);
                    let on = of_face.iter().any(|&line| {
                        let line = &lines[line as usize];
                        let across = normal.cross(line.along);
                        let along = ((ends[0] + ends[1]) * 0.5 - line.from).dot(line.along);
                        line.stands
                            && (0.0..=line.length).contains(&along)
                            && ends.iter().all(|&end| (end - line.from).dot(across).abs() <= 1.5 * snap)
                    });
                    if on {
                        sharp.entry([from.min(to), from.max(to)]).or_insert(false);
                    }
                }
            }
        }
        // Those that have a face on either side.
        let mut between = false;
        for part in parts.iter().flatten() {
            for (&from, &to) in part.iter().zip(part.iter().cycle().skip(1)) {
                if let Some(seen) = sharp.get_mut(&[from.min(to), from.max(to)]) {
                    between |= std::mem::replace(seen, true);
                }
            }
        }
        (parted || between).then(|| sharp.into_keys().collect())
    }

    /// Patches of the parts, cell by cell: a cell that nothing crosses is the patch that it was; of one that is crossed every
    /// flat part is a patch.
    fn finish(
        &self,
        faces: &[Face],
        parts: &[Vec<Vec<u32>>],
        sharp: &HashSet<[u32; 2]>,
        lies: &[Lie],
    ) -> Parted {
        let (count, pieces) = (lies.len(), Pieces::default());
        let mut parted =
            Parted { lies: Vec::with_capacity(count), origins: Vec::with_capacity(count), pieces };
        let mut at = 0;
        for (cell, &cell_area) in
            faces.chunk_by(|one, other| one.place.cell == other.place.cell).zip(&self.cell_area)
        {
            let parts = &parts[at..at + cell.len()];
            at += cell.len();
            let lie = &lies[cell[0].place.cell as usize];
            let whole = parts.iter().all(|parts| parts.len() == 1)
                && cell.iter().all(|face| face.place.path == Place::WHOLE);
            if whole {
                parted.origins.push(Origin { place: cell[0].place, part: 0 });
            }
            for (face, parts) in cell.iter().zip(parts) {
                for (part, number) in parts.iter().zip(0..) {
                    let places = self.places(part);
                    let patch = parted.lies.len() as u32;
                    if !whole {
                        // What neighbours put on the edges of one that is not parted changes nothing of it.
                        let own = if parts.len() == 1 { self.places(&face.corners) } else { places.clone() };
                        parted.lies.push(lie_of(&own, lie, cell_area));
                        parted.origins.push(Origin { place: face.place, part: number });
                    }
                    for triangle in triangles(&places) {
                        let edges = (0..3).filter(|&k| {
                            let [from, to] = [k, (k + 1) % 3].map(|k| part[triangle[k] as usize]);
                            sharp.contains(&[from.min(to), from.max(to)])
                        });
                        parted.pieces.sharp.push(edges.fold(0, |edges, k| edges | 1 << k));
                        parted.pieces.triangles.push(triangle.map(|k| places[k as usize]));
                        parted.pieces.patch.push(patch);
                    }
                }
            }
            if whole {
                parted.lies.push(*lie);
            }
        }
        parted
    }
}

/// A position, for those that are the same to the bit to be one. Adding zero makes -0 and 0 the same.
fn key(point: DVec3) -> [u64; 3] {
    (point + DVec3::ZERO).to_array().map(f64::to_bits)
}

/// The lines of contacts, the longest first: what goes through parts the faces before what ends among them.
fn lines(contacts: &[Contact]) -> Vec<Line> {
    let line = |&Contact { ends: [from, to], stands, .. }: &Contact| {
        let length = from.distance(to);
        Line { from, along: (to - from) / length, length, stands }
    };
    let mut lines: Vec<Line> = contacts.iter().map(line).collect();
    lines.sort_by(|one, other| other.length.total_cmp(&one.length));
    lines
}

/// The patch that is a part of a cell.
fn lie_of(places: &[DVec3], cell: &Lie, cell_area: f64) -> Lie {
    let area_vector = polygon::area_vector(places);
    let (mut moment, mut sum) = (DVec3::ZERO, 0.0);
    for pair in places[1..].windows(2) {
        let [p, q] = [pair[0] - places[0], pair[1] - places[0]];
        let area = p.cross(q).length();
        moment += (p + q) * (area / 3.0);
        sum += area;
    }
    let normal = area_vector.normalize_or_zero();
    // How far it reaches along either tangent, in parts of the cell.
    let [u, v] = cell.tangents;
    let cross = u.cross(v);
    let reach = |dual: DVec3| {
        let along = places.iter().map(|&place| (place - places[0]).dot(dual) / cross.length_squared());
        let (low, high) = along.fold((0.0_f64, 0.0_f64), |(low, high), at| (low.min(at), high.max(at)));
        high - low
    };
    Lie {
        centre: places[0] + moment / sum,
        normal,
        tangents: [u * reach(v.cross(cross)), v * reach(cross.cross(u))],
        area: cell.area * (area_vector.length() / cell_area),
        triangle: cell.triangle,
    }
}

/// Triangles of a convex face, which may have corners of 180°.
fn triangles(places: &[DVec3]) -> Vec<[u32; 3]> {
    let fan = || (1..places.len() as u32 - 1).map(|k| [0, k, k + 1]).collect();
    polygon::triangulate(places).unwrap_or_else(fan)
}

/// The corners of two triangles that are the halves of one flat convex quadrilateral.
fn quadrilateral(one: [DVec3; 3], other: [DVec3; 3]) -> Option<[DVec3; 4]> {
    let k = (0..3).find(|&k| !other.contains(&one[k]))?;
    let apex = other.into_iter().find(|corner| !one.contains(corner))?;
    let corners = [one[k], one[(k + 1) % 3], apex, one[(k + 2) % 3]];
    let flat = polygon::thickness(&corners) <= FLAT * polygon::diameter(&corners);
    (flat && polygon::is_convex(&corners)).then_some(corners)
}
