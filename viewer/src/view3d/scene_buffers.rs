//! A scene as the GPU wants it: corners of triangles, a record a facet, values in rows of texels. No GPU in here.

use std::collections::HashMap;

use glam::DVec3;
use radiosity::light::Rgb;
use radiosity::patches::Patches;
use radiosity::scene::{BackFaces, Scene, coincident};
use radiosity::shade::{Joints, PieceCorners};
use radiosity::visibility::{Cells, Facet, FacetShape, Facets};

use super::projection::Bounds;

/// Texels in a row of every texture that is a list, as a power of two.
pub(super) const ROW_SHIFT: u32 = 11;
/// Texels in a row.
pub(super) const ROW: usize = 1 << ROW_SHIFT;

/// What is shown on the surfaces, one value a patch.
#[derive(Clone, Debug)]
pub(crate) enum Values {
    /// Light, or a reflectance: exposed, tone-mapped, shown as it is.
    Colour(Vec<Rgb>),
    /// A quantity, shown through a colour map.
    Scalar {
        /// One a patch; what is no number is hatched.
        values: Vec<f32>,
        /// What the ends of the colour map stand for.
        range: [f32; 2],
        /// Equal ratios are equally far apart on it, rather than equal differences.
        logarithmic: bool,
    },
}

/// A corner of a triangle: where it is, from the scene's centre, and facet * 4 + corner.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct Vertex {
    pub(super) position: [f32; 3],
    pub(super) mark: u32,
}

/// The values of a list of patches, or corners: red, green, blue, or a scalar in red; 1 where they are numbers. Where
/// they are not, all four are 0: what is interpolated is weighted by how much of it is known.
pub(super) type Texel = [f32; 4];

/// A scene, ready to be uploaded.
#[derive(Debug)]
pub(super) struct SceneBuffers {
    pub(super) bounds: Bounds,
    /// Of parallelograms: three a triangle, counter-clockwise seen from the front.
    pub(super) grids: Vec<Vertex>,
    /// Of facets that are triangles, likewise.
    pub(super) triangles: Vec<Vertex>,
    /// First patch; columns, or where a triangle's corners begin; rows; inner edges, or of a grid that others go on with
    /// where its values begin, and 1.
    pub(super) facets: Vec<[u32; 4]>,
    /// Feet and tips of the patches' normals, from the scene's centre; the fourth is 0 at the foot, 1 at the tip.
    pub(super) normals: Vec<[f32; 4]>,
    /// Whether surfaces lie on one another, as the two sides of a sheet do.
    pub(super) sheets: bool,
    corners: PieceCorners,
    joints: Joints,
    patches: usize,
}

impl SceneBuffers {
    pub(super) fn new(scene: &Scene, patches: &Patches, facets: &Facets) -> Self {
        let bounds = Bounds::of(facets);
        let centre = bounds.centre();
        let mut buffers = Self {
            bounds,
            grids: Vec::new(),
            triangles: Vec::new(),
            facets: Vec::with_capacity(facets.as_slice().len()),
            normals: normals(patches, centre),
            sheets: !coincident(scene, BackFaces::Lit).is_empty(),
            corners: PieceCorners::new(scene, patches),
            joints: Joints::new(scene, facets),
            patches: patches.len(),
        };
        let pieces: usize =
            (0..patches.blocks.len() as u32).map(|k| buffers.corners.of_surface(k).len()).sum();
        let ringed = 3 * pieces as u32 + 1;
        for (surface, block) in (0..).zip(&patches.blocks) {
            let range = facets.of_surface(surface);
            let of_surface = &facets.as_slice()[range.start as usize..range.end as usize];
            // Where every facet is a patch of its own, all its edges are borders.
            let inner = match of_surface.len() > block.patches().len() {
                true => inner_edges(of_surface),
                false => Vec::new(),
            };
            let first_piece = buffers.corners.of_surface(surface).start;
            for (k, facet) in of_surface.iter().enumerate() {
                let record = match facet.cells {
                    Cells::Grid { first, columns, rows } => {
                        let values = buffers.joints.start(range.start + k as u32);
                        [first, columns, rows, values.map_or(0, |start| ringed + start)]
                    }
                    Cells::One(patch) => {
                        [patch, 3 * (first_piece + k) as u32, 1, inner.get(k).copied().unwrap_or(0)]
                    }
                };
                buffers.push(facet, record, centre);
            }
        }
        buffers
    }

    fn push(&mut self, facet: &Facet, record: [u32; 4], centre: DVec3) {
        let number = self.facets.len() as u32;
        self.facets.push(record);
        let (corners, _) = facet.corners();
        let vertex = |at: usize, corner: u32| {
            let position = (corners[at] - centre).as_vec3().to_array();
            Vertex { position, mark: number << 2 | corner }
        };
        // Corners of the square are named 0..3; a triangle has 0, 1 and 3, where u = 0 and v = 1.
        // A mirrored surface has its front where u × v does not point.
        let mirrored = facet.normal.dot(facet.u.cross(facet.v)) < 0.0;
        let ordered = |[a, b, c]: [Vertex; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
        let (a, b, c) = (vertex(0, 0), vertex(1, 1), vertex(2, 2));
        match facet.shape {
            FacetShape::Parallelogram => {
                self.grids.extend(ordered([a, b, c]));
                self.grids.extend(ordered([a, c, vertex(3, 3)]));
            }
            FacetShape::Triangle => self.triangles.extend(ordered([a, b, vertex(2, 3)])),
        }
    }

    pub(super) fn patch_count(&self) -> usize {
        self.patches
    }

    /// The texels of `values`: those of the patches, then those of the corners of triangles and of grids that others go on
    /// with. `None` where there is not one value a patch.
    pub(super) fn texels(&self, values: &Values) -> Option<[Vec<Texel>; 2]> {
        let patches: Vec<Texel> = match values {
            Values::Colour(colours) => colours.iter().map(|&colour| texel(colour)).collect(),
            Values::Scalar { values, .. } => values.iter().map(|&value| scalar_texel(value)).collect(),
        };
        if patches.len() != self.patches {
            return None;
        }
        let between = |values: &[Rgb], to_texel: fn(Rgb) -> Texel| -> Vec<Texel> {
            let corners = self.corners.values(values).into_iter().flatten();
            corners.chain(self.joints.values(values)).map(to_texel).collect()
        };
        let corners = match values {
            Values::Colour(colours) => between(colours, texel),
            Values::Scalar { values, .. } => {
                let grey: Vec<Rgb> = values.iter().map(|&value| Rgb::grey(f64::from(value))).collect();
                between(&grey, |colour| scalar_texel(colour.r as f32))
            }
        };
        Some([patches, corners])
    }
}

fn texel(colour: Rgb) -> Texel {
    // Beyond what a float holds is beyond what a screen shows; squares of it must not overflow either.
    let channel = |value: f64| value.clamp(-1e18, 1e18) as f32;
    let [r, g, b] = colour.to_array();
    if (r + g + b).is_nan() { [0.0; 4] } else { [channel(r), channel(g), channel(b), 1.0] }
}

fn scalar_texel(value: f32) -> Texel {
    if value.is_nan() { [0.0; 4] } else { [value.clamp(-1e18, 1e18), 0.0, 0.0, 1.0] }
}

/// For each triangle of a surface, which of its edges (v = 0, u = 0, u + v = 1, from bit 0 on) it shares with another of the
/// same patch.
fn inner_edges(triangles: &[Facet]) -> Vec<u32> {
    let ends = |facet: &Facet| {
        let ([a, b, c, _], _) = facet.corners();
        [[a, b], [a, c], [b, c]].map(|edge| {
            let mut bits = edge.map(|corner| corner.to_array().map(f64::to_bits));
            bits.sort_unstable();
            bits
        })
    };
    // u and v are differences: the far corners come back with a rounding error, so that edges are matched by what is
    // equal to nine digits of the largest one's size.
    let reach = triangles.iter().map(|t| t.u.length().max(t.v.length())).fold(0.0, f64::max);
    let snapped = |facet: &Facet| {
        let snap = |point: DVec3| ((point - triangles[0].origin) / (reach * 1e-9)).round() + DVec3::ZERO;
        let origin = snap(facet.origin);
        let (u, v) = (snap(facet.origin + facet.u) - origin, snap(facet.origin + facet.v) - origin);
        ends(&Facet { origin, u, v, ..*facet })
    };
    let mut count = HashMap::new();
    let patch = |facet: &Facet| facet.patch_at(0.0, 0.0);
    for facet in triangles {
        for edge in snapped(facet) {
            *count.entry((patch(facet), edge)).or_insert(0) += 1;
        }
    }
    triangles
        .iter()
        .map(|facet| {
            let edges = snapped(facet).into_iter().enumerate();
            edges.filter(|(_, edge)| count[&(patch(facet), *edge)] > 1).map(|(k, _)| 1 << k).sum()
        })
        .collect()
}

/// A line a patch, half as long as the patch is wide; it begins a hair above it, so as not to lie in it.
fn normals(patches: &Patches, centre: DVec3) -> Vec<[f32; 4]> {
    let lines = (0..patches.len()).flat_map(|i| {
        let length = 0.5 * patches.area[i].max(0.0).sqrt();
        let foot = patches.centre[i] - centre + patches.normal[i] * (0.03 * length);
        let tip = foot + patches.normal[i] * length;
        [(foot, 0.0), (tip, 1.0)].map(|(p, end)| {
            let [x, y, z] = p.as_vec3().to_array();
            [x, y, z, end]
        })
    });
    lines.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity::patches::subdivide;
    use radiosity::scene::{BackFaces, Material, Mesh, Parallelogram, Place, Polygon, Shape, Surface};

    fn scene(shapes: Vec<Shape>) -> Scene {
        let surface = |shape| Surface {
            name: String::new(),
            shape,
            material: Material::default(),
            place: Place::default(),
        };
        Scene {
            name: "test".into(),
            surfaces: shapes.into_iter().map(surface).collect(),
            camera: None,
            back_faces: BackFaces::Lit,
            warnings: Vec::new(),
        }
    }

    fn buffers(scene: &Scene) -> SceneBuffers {
        let patches = subdivide(scene, 1.0).unwrap();
        SceneBuffers::new(scene, &patches, &Facets::new(scene, &patches))
    }

    fn shapes() -> Vec<Shape> {
        let plate = |flip: f64| {
            Shape::Parallelogram(Parallelogram {
                origin: DVec3::new(1e6, 0.0, 0.0),
                u: DVec3::X,
                v: DVec3::Y,
                normal: DVec3::Z * flip,
                columns: 3,
                rows: 2,
            })
        };
        let square = [[0.0, 0.0], [1.0, 0.0], [1.1, 1.3], [0.0, 1.0]];
        let vertices: Vec<_> = square.map(|[x, y]| DVec3::new(1e6 + x, y, 0.1)).into();
        let triangles = vec![[0, 1, 2], [0, 2, 3]];
        vec![
            plate(1.0),
            plate(-1.0),
            Shape::Polygon(Polygon { vertices: vertices.clone() }),
            Shape::Mesh(Mesh { vertices, triangles, ..Mesh::default() }),
        ]
    }

    #[test]
    fn triangles_run_counter_clockwise_about_the_front() {
        let scene = scene(shapes());
        let buffers = buffers(&scene);
        assert_eq!((buffers.facets.len(), buffers.grids.len(), buffers.triangles.len()), (6, 12, 12));
        let vertices = [&buffers.grids[..], &buffers.triangles].concat();
        let at = |k: usize| glam::Vec3::from(vertices[k].position);
        for first in (0..24).step_by(3) {
            let front = (at(first + 1) - at(first)).cross(at(first + 2) - at(first)).z;
            assert_eq!(front < 0.0, (6..12).contains(&first), "{first}");
        }
        // Far from the origin positions keep their digits.
        assert!(vertices.iter().all(|v| v.position[0].abs() < 1.0));
    }

    #[test]
    fn a_polygon_hides_the_edges_inside_it() {
        let buffers = buffers(&scene(shapes()));
        let inner: u32 = buffers.facets[2..4].iter().map(|facet| facet[3].count_ones()).sum();
        assert_eq!(inner, 2, "the diagonal, seen from both of its triangles");
        assert_eq!(buffers.facets[4], [13, 6, 1, 0]);
        assert_eq!(buffers.facets[5], [14, 9, 1, 0]);
    }

    #[test]
    fn values_are_one_a_patch_and_three_a_triangle() {
        let buffers = buffers(&scene(shapes()));
        let count = buffers.patch_count();
        assert_eq!(count, 15);
        let mut values = vec![1.0; count];
        values[4] = f32::NAN;
        let scalar = |values| Values::Scalar { values, range: [0.0, 1.0], logarithmic: false };
        let [patches, corners] = buffers.texels(&scalar(values)).unwrap();
        assert_eq!((patches.len(), corners.len()), (15, 12));
        assert_eq!((patches[3], patches[4]), ([1.0, 0.0, 0.0, 1.0], [0.0; 4]));
        assert!(buffers.texels(&scalar(vec![1.0; 3])).is_none());
        assert!(buffers.texels(&Values::Colour(vec![Rgb::WHITE; count + 1])).is_none());
        let huge = buffers.texels(&Values::Colour(vec![Rgb::grey(f64::INFINITY); count])).unwrap();
        assert!(huge.iter().flatten().flatten().all(|value| value.is_finite()));
    }
}
