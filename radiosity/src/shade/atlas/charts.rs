//! Surfaces made flat.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use uvunwrap::{Density, MeshInput, Options, Packing};

use super::AtlasError;
use crate::patches::Patches;
use crate::scene::{Curved, Scene, Shape};
use crate::shade::crease::{PieceCorners, merged_vertices};
use crate::visibility::{Cells, Facets};

/// A facet, or a piece of a surface, by number, and where its corners at (0, 0), (1, 0) and (0, 1) lie in the flat.
type Flat = (u32, [DVec2; 3]);

/// A chart before it has a place.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FlatChart {
    /// Its facets, from 0 to `extent`.
    pub(super) facets: Vec<Flat>,
    /// Its size, in the scene's unit of length.
    pub(super) extent: DVec2,
    /// Of one facet cut into a grid, its columns and rows.
    pub(super) cells: Option<[u32; 2]>,
}

/// The charts of a scene, surface by surface.
pub(super) fn charts(
    scene: &Scene,
    patches: &Patches,
    facets: &Facets,
) -> Result<Vec<FlatChart>, AtlasError> {
    let corners = PieceCorners::new(scene, patches);
    let of_surface = |surface: usize| {
        let numbers = facets.of_surface(surface as u32);
        let Some(pieces) = &patches.pieces[surface] else {
            return Ok(numbers.filter_map(|number| grid(facets, number)).collect());
        };
        let natural = match &scene.surfaces[surface].shape {
            Shape::Sphere(curved) => unrolled(curved, &pieces.triangles, sphere),
            Shape::Cylinder(curved) => unrolled(curved, &pieces.triangles, cylinder),
            _ => None,
        };
        let found = match natural {
            Some(corners) => vec![(0..).zip(corners).collect()],
            None => flattened(&pieces.triangles, &corners, corners.of_surface(surface as u32).start)
                .map_err(|why| AtlasError::Unwrap { surface, why: why.to_string() })?,
        };
        let first = numbers.start;
        Ok(found.into_iter().map(|chart| from_zero(chart, first)).collect())
    };
    let all: Vec<Vec<_>> =
        (0..scene.surfaces.len()).into_par_iter().map(of_surface).collect::<Result<_, _>>()?;
    Ok(all.into_iter().flatten().collect())
}

/// The chart of a facet that is cut into a grid.
fn grid(facets: &Facets, number: u32) -> Option<FlatChart> {
    let facet = &facets[number];
    let Cells::Grid { columns, rows, .. } = facet.cells else { return None };
    let extent = DVec2::new(facet.u.length(), facet.v.length());
    let corners = [DVec2::ZERO, DVec2::new(extent.x, 0.0), DVec2::new(0.0, extent.y)];
    Some(FlatChart { facets: vec![(number, corners)], extent, cells: Some([columns, rows]) })
}

/// Pieces, the first of them facet `first`, moved to where their coordinates begin with 0.
fn from_zero(pieces: Vec<Flat>, first: u32) -> FlatChart {
    let none = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    let (low, high) =
        pieces.iter().flat_map(|(_, at)| at).fold(none, |(low, high), &p| (low.min(p), high.max(p)));
    let facets = pieces.into_iter().map(|(piece, at)| (first + piece, at.map(|p| p - low))).collect();
    FlatChart { facets, extent: high - low, cells: None }
}

/// What a point of a unit sphere or cylinder, how far around it is, 0..1, and how far along, is in the flat.
struct Roll {
    /// From a point to around, unless it is a pole, and along.
    flat: fn(DVec3) -> (Option<f64>, f64),
    /// The lengths of once around and of all along, of the shape where its axes are these.
    size: fn([DVec3; 3]) -> DVec2,
}

fn sphere() -> Roll {
    Roll {
        flat: |p| {
            let radius = p.x.hypot(p.z);
            let around = (radius > 1e-9).then(|| p.x.atan2(p.z) / TAU);
            (around, radius.atan2(-p.y) / PI)
        },
        // An ellipse is about as long as a circle of its axes' mean square.
        size: |[x, y, z]| {
            let equator = (x.length_squared() + z.length_squared()) / 2.0;
            DVec2::new(TAU * equator.sqrt(), PI * ((equator + y.length_squared()) / 2.0).sqrt())
        },
    }
}

fn cylinder() -> Roll {
    Roll {
        flat: |p| (Some(p.z.atan2(p.y) / TAU), p.x),
        size: |[x, y, z]| {
            DVec2::new(TAU * ((y.length_squared() + z.length_squared()) / 2.0).sqrt(), x.length())
        },
    }
}

/// The corners of a sphere's or cylinder's pieces, slit along the line where it begins and ends, and at a sphere's poles
/// piece by piece. `None` where it is squashed flat.
fn unrolled(curved: &Curved, triangles: &[[DVec3; 3]], roll: fn() -> Roll) -> Option<Vec<[DVec2; 3]>> {
    let axes = curved.axes();
    let [x, y, z] = axes.map(DVec3::length);
    let squashed = curved.map.matrix3.determinant().abs() <= 1e-9 * x * y * z;
    let inverse = (!squashed).then(|| curved.map.inverse())?;
    let Roll { flat, size } = roll();
    let size = size(axes);
    let near = |around: f64, middle: f64| middle + (around - middle + 0.5).rem_euclid(1.0) - 0.5;
    let corners = triangles.iter().map(|triangle| {
        let points = triangle.map(|corner| flat(inverse.transform_point3(corner)));
        // Next to each other, whole turns left aside; the middle of them in the first turn.
        let known = points.iter().filter_map(|&(around, _)| around);
        let first = known.clone().next().unwrap_or(0.0);
        let (sum, count) =
            known.fold((0.0, 0.0), |(sum, count), around| (sum + near(around, first), count + 1.0));
        let middle = (sum / f64::max(count, 1.0)).rem_euclid(1.0);
        points.map(|(around, along)| DVec2::new(around.map_or(middle, |at| near(at, middle)), along) * size)
    });
    Some(corners.collect())
}

/// Texels that the unwrapper thinks of along the longest side of a mesh: how fine it looks, for the packing is ours.
const UNWRAPPED_TEXELS: f32 = 256.0;

/// Other triangles, parted at creases and made flat: charts of them, each with where its corners lie, in the scene's unit.
/// They are the pieces of `corners` from `first` on.
fn flattened(
    triangles: &[[DVec3; 3]],
    corners: &PieceCorners,
    first: usize,
) -> Result<Vec<Vec<Flat>>, uvunwrap::Error> {
    let vertex = merged_vertices(triangles);
    let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = triangles.iter().flatten().fold(none, |(low, high), &p| (low.min(p), high.max(p)));
    let unit = (high - low).max_element().max(f64::MIN_POSITIVE);
    let positions: Vec<[f32; 3]> =
        triangles.iter().flatten().map(|&p| ((p - low) / unit).to_array().map(|x| x as f32)).collect();
    let mesh =
        MeshInput { seams: Some(&seams(&vertex, corners, first)), ..MeshInput::new(&positions, &vertex) };
    let options = Options {
        density: Density::Fixed { texels_per_unit: UNWRAPPED_TEXELS, page_size: None },
        packing: Packing::Fast,
        padding: 1,
        ..Options::default()
    };
    let atlas = uvunwrap::generate(&[mesh], &options)?;
    let scale =
        DVec2::new(atlas.width.into(), atlas.height.into()) * (unit / f64::from(atlas.texels_per_unit));
    let mut charts = vec![Vec::new(); atlas.chart_count as usize];
    let flat = &atlas.meshes[0];
    for (piece, indices) in flat.indices.chunks_exact(3).enumerate() {
        let vertices = [0, 1, 2].map(|k| &flat.vertices[indices[k] as usize]);
        let at = vertices.map(|vertex| DVec2::from(vertex.uv.map(f64::from)) * scale);
        match vertices[0].chart {
            Some(chart) => charts[chart as usize].push((piece as u32, at)),
            // Too thin for the unwrapper, all about it too: as it lies in its plane.
            None => charts.push(vec![(piece as u32, in_its_plane(triangles[piece]))]),
        }
    }
    charts.retain(|chart| !chart.is_empty());
    Ok(charts)
}

/// For each side of each triangle, whether shading has a break there.
fn seams(vertex: &[u32], corners: &PieceCorners, first: usize) -> Vec<[bool; 3]> {
    let count = vertex.len() / 3;
    let mut sides: Vec<([u32; 2], usize, usize)> = Vec::with_capacity(vertex.len());
    for triangle in 0..count {
        for k in 0..3 {
            let [a, b] = [k, (k + 1) % 3].map(|k| vertex[3 * triangle + k]);
            sides.push(([a.min(b), a.max(b)], triangle, k));
        }
    }
    sides.sort_unstable();
    let mut seams = vec![[false; 3]; count];
    for shared in sides.chunk_by(|one, other| one.0 == other.0) {
        // What shading joins at the lesser end, and at the greater.
        let joined = |&(ends, triangle, _): &([u32; 2], usize, usize)| {
            let shared = corners.shared(first + triangle);
            ends.map(|end| (0..3).find(|&k| vertex[3 * triangle + k] == end).map(|k| shared[k]))
        };
        if shared.iter().any(|side| joined(side) != joined(&shared[0])) {
            shared.iter().for_each(|&(_, triangle, k)| seams[triangle][k] = true);
        }
    }
    seams
}

fn in_its_plane([a, b, c]: [DVec3; 3]) -> [DVec2; 3] {
    let along = (b - a).normalize_or_zero();
    let third = (c - a).dot(along);
    [DVec2::ZERO, DVec2::new(a.distance(b), 0.0), DVec2::new(third, (c - a - along * third).length())]
}
