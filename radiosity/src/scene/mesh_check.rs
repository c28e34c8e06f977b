//! What is wrong with meshes: holes, edges that too many triangles share, fronts that disagree.

use std::collections::HashMap;

use glam::DVec3;

use super::{LeftOut, Scene, Shape};

/// A kind of fault, how often it is there, and where for example.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Found {
    /// How often.
    pub count: u64,
    /// The middle of the first edge, in the order of the file, and its surface.
    pub example: Option<(DVec3, u32)>,
}

/// What [`check_meshes`] finds. Light leaks through holes, and a triangle whose front is turned away is black from
/// where it should be seen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeshFaults {
    /// Triangles of all meshes.
    pub triangles: u64,
    /// Edges that one triangle has alone: the rim of a hole or of a sheet, or where meshes meet without sharing
    /// corners.
    pub open: Found,
    /// Edges of more than two triangles: sheets that meet, walls inside a solid.
    pub crowded: Found,
    /// Edges whose two triangles face opposite sides: one of them has its front turned the wrong way.
    pub turned: Found,
    /// What the reader left out.
    pub left_out: LeftOut,
}

impl Found {
    fn add(&mut self, ends: [DVec3; 2], surface: u32) {
        self.count += 1;
        self.example.get_or_insert(((ends[0] + ends[1]) * 0.5, surface));
    }
}

/// Corners that fall into one cell of a grid this fine, as a part of the scene's extent, are one: instances put what
/// belongs together where rounding takes it. A millionth, made crooked, so that no round coordinate lies on a border
/// of the grid.
const TOGETHER: f64 = 1.234_567e-6;

/// Examine the meshes of a scene, all together, for a solid may well be several of them. Corners about a millionth of
/// the scene's extent apart are one. A triangle that lies on another, facing the other way, is the back of a sheet,
/// and not counted with its front.
pub fn check_meshes(scene: &Scene) -> MeshFaults {
    let mut faults = MeshFaults::default();
    let meshes = || {
        scene.surfaces.iter().zip(0..).filter_map(|(surface, index)| match &surface.shape {
            Shape::Mesh(mesh) => Some((mesh, index)),
            _ => None,
        })
    };
    let all = || meshes().flat_map(|(mesh, _)| &mesh.vertices);
    let low = all().fold(DVec3::INFINITY, |low, &vertex| low.min(vertex));
    let high = all().fold(DVec3::NEG_INFINITY, |high, &vertex| high.max(vertex));
    let cell = TOGETHER * (high - low).max_element();
    let mut vertices: HashMap<[i64; 3], u32> = HashMap::new();
    // Each triangle by its corners in order, whichever way it faces.
    let mut there: HashMap<[u32; 3], ()> = HashMap::new();
    let mut edges: Vec<Edge> = Vec::new();
    for (mesh, index) in meshes() {
        faults.left_out.flat += mesh.left_out.flat;
        faults.left_out.repeated += mesh.left_out.repeated;
        for triangle in &mesh.triangles {
            faults.triangles += 1;
            let positions = triangle.map(|k| mesh.vertices[k as usize]);
            let corners = positions.map(|position| {
                let next = vertices.len() as u32;
                let place = ((position - low) / cell).to_array().map(|x| x.round() as i64);
                *vertices.entry(place).or_insert(next)
            });
            let mut sorted = corners;
            sorted.sort_unstable();
            if there.insert(sorted, ()).is_some() {
                continue;
            }
            for k in 0..3 {
                let [from, to] = [corners[k], corners[(k + 1) % 3]];
                edges.push(Edge {
                    ends: [from.min(to), from.max(to)],
                    number: edges.len() as u32,
                    along: from < to,
                    middle: [positions[k], positions[(k + 1) % 3]],
                    surface: index,
                });
            }
        }
    }
    edges.sort_unstable_by_key(|edge| (edge.ends, edge.number));
    let mut shared: Vec<&[Edge]> = edges.chunk_by(|one, other| one.ends == other.ends).collect();
    // In the order of the file again, so that the first example is the first there.
    shared.sort_unstable_by_key(|edges| edges[0].number);
    for edges in shared {
        let first = &edges[0];
        match edges {
            [_] => faults.open.add(first.middle, first.surface),
            [a, b] if a.along == b.along => faults.turned.add(first.middle, first.surface),
            [_, _] => {}
            _ => faults.crowded.add(first.middle, first.surface),
        }
    }
    faults
}

/// An edge of a triangle.
struct Edge {
    /// Its corners, the lesser first.
    ends: [u32; 2],
    number: u32,
    /// Whether the triangle runs from the lesser to the greater.
    along: bool,
    middle: [DVec3; 2],
    surface: u32,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::obj;

    fn faults(faces: &str) -> MeshFaults {
        let cube = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nv .5 .5 2\n";
        check_meshes(&obj::parse_scene("cube.obj", format!("{cube}{faces}").as_bytes(), |_| None).unwrap())
    }

    /// Each face of another material, and so a surface of its own.
    const CUBE: &str =
        "f 4 3 2 1\nusemtl a\nf 5 6 7 8\nusemtl b\nf 1 2 6 5\nf 2 3 7 6\nusemtl c\nf 3 4 8 7\n";

    #[test]
    fn a_closed_cube_has_no_fault() {
        let found = faults(&format!("{CUBE}f 4 1 5 8"));
        assert_eq!(found, MeshFaults { triangles: 12, ..MeshFaults::default() });
    }

    #[test]
    fn a_hole_a_turned_face_and_a_fin_are_found() {
        let open = faults(CUBE).open;
        assert_eq!((open.count, open.example), (4, Some((DVec3::new(0.0, 0.5, 0.0), 0))));
        let turned = faults(&format!("{CUBE}f 8 5 1 4"));
        assert_eq!((turned.turned.count, turned.open.count), (4, 0));
        let fin = faults(&format!("{CUBE}f 4 1 5 8\nf 5 6 9"));
        assert_eq!((fin.crowded.count, fin.open.count, fin.turned.count), (1, 2, 0));
        assert_eq!(fin.crowded.example.map(|(place, _)| place), Some(DVec3::new(0.5, 0.0, 1.0)));
    }

    #[test]
    fn the_back_of_a_sheet_is_no_fault_of_its_own() {
        let sheet = faults("f 1 2 3\nf 3 2 1\nf 1 1 2");
        assert_eq!((sheet.open.count, sheet.crowded.count, sheet.left_out.flat), (3, 0, 1));
    }
}
