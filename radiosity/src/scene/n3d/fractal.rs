//! Fractal triangles (FR): the middles of edges moved at random, and again in each of the four triangles that they make
//! (Fournier, Fussell & Carpenter 1982). What FR's three numbers mean to N3D is not known; this is our reading.

use std::collections::HashMap;

use glam::DVec3;

use crate::scene::Mesh;

/// The most times that triangles are cut: 4⁸ of them.
pub(super) const DEEPEST: i64 = 8;
/// The farthest that an edge's middle may move, as a part of the edge's length: farther, it would pass the ends.
pub(super) const ROUGHEST: f64 = 0.5;

/// The triangles of `corners` after `depth` rounds.
///
/// How a middle moves follows from the ends of its edge and the seed alone, so that whoever shares the edge agrees, within
/// this triangle or beside it.
pub(super) fn triangles(corners: [DVec3; 3], depth: u32, roughness: f64, seed: f64) -> Mesh {
    let mut mesh = Mesh { vertices: corners.to_vec(), triangles: vec![[0, 1, 2]], ..Mesh::default() };
    for _ in 0..depth {
        let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
        let mut triangles = Vec::with_capacity(4 * mesh.triangles.len());
        for &[a, b, c] in &mesh.triangles {
            let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[from, to]| {
                *middles.entry([from.min(to), from.max(to)]).or_insert_with(|| {
                    let ends = [from, to].map(|end| mesh.vertices[end as usize]);
                    mesh.vertices.push(moved_middle(ends, roughness, seed));
                    mesh.vertices.len() as u32 - 1
                })
            });
            triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        mesh.triangles = triangles;
    }
    mesh
}

fn moved_middle([a, b]: [DVec3; 2], roughness: f64, seed: f64) -> DVec3 {
    let bits = |p: DVec3| (p + DVec3::ZERO).to_array().map(f64::to_bits);
    // The order in which the ends are named does not matter.
    let (low, high) = (bits(a).min(bits(b)), bits(a).max(bits(b)));
    let mut state = (seed + 0.0).to_bits();
    for word in low.into_iter().chain(high) {
        state = scrambled(state ^ word);
    }
    let mut draw = || {
        state = scrambled(state);
        (state >> 11) as f64 / (1_u64 << 53) as f64 * 2.0 - 1.0
    };
    // A point of the unit ball: the first of a cube's that lies in it.
    let way = loop {
        let way = DVec3::new(draw(), draw(), draw());
        if way.length_squared() <= 1.0 {
            break way;
        }
    };
    (a + b) * 0.5 + way * (roughness * a.distance(b))
}

/// SplitMix64: a step of it, and its output, in one (Steele, Lea & Flood 2014).
fn scrambled(state: u64) -> u64 {
    let mut z = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y];

    #[test]
    fn without_roughness_it_is_the_triangle_itself() {
        let mesh = triangles(CORNERS, 3, 0.0, 7.0);
        assert_eq!((mesh.triangles.len(), mesh.vertices.len()), (64, 45));
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|k| mesh.vertices[k as usize]);
            (b - a).cross(c - a) * 0.5
        };
        assert!(mesh.triangles.iter().all(|t| area(t).abs_diff_eq(DVec3::Z * (0.5 / 64.0), 1e-15)));
    }

    #[test]
    fn who_shares_an_edge_shares_its_points_and_a_seed_is_one_shape() {
        let far = DVec3::new(0.4, 0.9, 0.8);
        let (one, other) =
            (triangles(CORNERS, 4, 0.2, 7.0), triangles([DVec3::Y, DVec3::X, far], 4, 0.2, 7.0));
        // 2⁴ + 1 points on the edge from (1, 0, 0) to (0, 1, 0), which only the two share.
        let shared = one.vertices.iter().filter(|&p| other.vertices.contains(p)).count();
        assert_eq!(shared, 17);
        assert_eq!(triangles(CORNERS, 4, 0.2, 7.0), one);
        assert_ne!(triangles(CORNERS, 4, 0.2, 8.0), one);
    }

    #[test]
    fn no_middle_moves_farther_than_its_roughness() {
        for seed in 0..50 {
            let middle = moved_middle([DVec3::ZERO, DVec3::X * 2.0], 0.3, f64::from(seed));
            assert!(middle.distance(DVec3::X) <= 0.6 + 1e-12);
        }
    }
}
