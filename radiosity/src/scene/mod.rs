//! What the author wrote: surfaces, their materials and subdivision, and the camera.
//!
//! Only readers build a [`Scene`]; no later stage writes to it. Positions are in world space, in the
//! scene's own unit of length, in double precision as they were written.

mod camera;
mod coincident;
mod error;
mod file;
pub mod gltf;
mod image;
mod mesh_builder;
mod mesh_check;
pub mod n3d;
mod number;
pub mod obj;
mod paint;
mod plates;
mod source;
mod suggest;
mod texture;

use std::path::Path;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

pub use camera::Camera;
pub use coincident::{Overlap, coincident, overlaps};
pub use error::{Place, SceneError, Warning};
pub use mesh_check::{Found, MeshFaults, check_meshes};
pub use paint::{Paint, TextureOn};
pub use texture::{Texture, Wrap};

use crate::light::Rgb;

/// A scene as its author wrote it.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// The path it was read from, as given, or any name: what reports and messages call it.
    pub name: String,
    /// Every surface, in file order. A surface's index here is its *object number* everywhere.
    pub surfaces: Vec<Surface>,
    /// The author's camera, where there is one.
    pub camera: Option<Camera>,
    /// What a surface is when seen from behind, unless the caller asks otherwise.
    pub back_faces: BackFaces,
    /// What was read but plays no part in radiosity, in plain words.
    pub warnings: Vec<Warning>,
}

/// What a patch is to whoever sees it from behind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BackFaces {
    /// It blocks and is black: physically, a one-sided surface.
    Black,
    /// It is the same patch, as lit as its front: what N3D does.
    #[default]
    Lit,
}

/// One atomic object: a shape with a material.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// What its author called it; empty where nobody did, as always in a .scn.
    pub name: String,
    /// Its geometry and subdivision.
    pub shape: Shape,
    /// Its coefficients.
    pub material: Material,
    /// Where it begins in the file; [`Place::default`], 0:0, in a format without lines.
    pub place: Place,
}

/// The geometry of a surface, in world space.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A parallelogram cut into a grid of patches (`QD`).
    Parallelogram(Parallelogram),
    /// A planar polygon, one patch (`PG`, `TI`).
    Polygon(Polygon),
    /// Any other quadrilateral whose corners all turn the same way, flat or not, cut into a grid of patches (`QD`).
    Quadrilateral(Quadrilateral),
    /// Triangles that share vertices, one patch a triangle (`VO`).
    Mesh(Mesh),
    /// The triangles of a fractal (`FR`), one patch each.
    Fractal(Mesh),
    /// The unit sphere wherever an affine map takes it, so ellipsoids too (`SP`).
    Sphere(Curved),
    /// The unit cylinder along x, without caps, wherever an affine map takes it (`CL`).
    Cylinder(Curved),
}

/// `origin + s u + t v`, s and t in 0..1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parallelogram {
    /// The corner s1.
    pub origin: DVec3,
    /// s2 - s1: the columns run along it.
    pub u: DVec3,
    /// s4 - s1: the rows run along it.
    pub v: DVec3,
    /// Unit normal of the front. Parallel to `u × v`; opposed to it where a mirroring transform acted, for
    /// the author's front stays the front.
    pub normal: DVec3,
    /// Patches along `u`, as written (n).
    pub columns: u32,
    /// Patches along `v`, as written (m).
    pub rows: u32,
}

/// A quadrilateral spanned by straight lines between opposite sides (bilinear). It need not be flat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quadrilateral {
    /// The corners s1, s2, s3, s4: the columns run from s1 to s2, the rows from s1 to s4.
    pub corners: [DVec3; 4],
    /// Whether the front is the side from which the corners run clockwise: where a mirroring transform acted, for the
    /// author's front stays the front.
    pub mirrored: bool,
    /// Patches from s1 to s2, as written (n).
    pub columns: u32,
    /// Patches from s1 to s4, as written (m).
    pub rows: u32,
}

/// A unit sphere or cylinder ([`Parametric`](crate::geometry::curved::Parametric)) taken somewhere by an invertible affine map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curved {
    /// From the unit shape to the scene.
    pub map: DAffine3,
    /// Whether the front is the inside (`IN`), as of a room. Else it is the outside, be the map a mirror or not.
    pub inward: bool,
    /// Patches once around, as written (n).
    pub columns: u32,
    /// Patches from pole to pole, or along the axis, as written (m).
    pub rows: u32,
}

/// A simple planar polygon, convex or concave.
#[derive(Clone, Debug, PartialEq)]
pub struct Polygon {
    /// Its corners, counter-clockwise seen from the front; the first is not repeated.
    pub vertices: Vec<DVec3>,
}

/// Triangles over shared vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// The vertices.
    pub vertices: Vec<DVec3>,
    /// Three indices into `vertices` a triangle, from 0, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Diffuse reflectance, one a triangle, in place of the material's, which is then their mean by area; empty
    /// where the material's holds for all of them.
    pub diffuse: Vec<Rgb>,
    /// Emitted exitance, likewise.
    pub emission: Vec<Rgb>,
    /// How the reflectance varies over the triangles themselves, whose means then stand in `diffuse`: what a patch that is
    /// less than a triangle asks.
    pub diffuse_paint: Option<Arc<Paint>>,
    /// How the emission does, likewise.
    pub emission_paint: Option<Arc<Paint>>,
    /// What stood in the file and could carry no light.
    pub left_out: LeftOut,
}

/// Triangles of a mesh that its reader left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LeftOut {
    /// Those without area: two corners in one place, or all three on one line.
    pub flat: u64,
    /// Those that stood there already, with the same corners and the same front.
    pub repeated: u64,
}

/// A surface's coefficients. Radiosity reads two of them; the others are kept as the author wrote them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Material {
    /// Diffuse reflectance ρ (`CD`, `GD`), without unit. N3D does not clamp it, and neither do we.
    pub diffuse: Rgb,
    /// Emitted exitance E (`CE`): power per area, in the scene's unit.
    pub emission: Rgb,
    /// `CS`.
    pub specular: Rgb,
    /// `CA`.
    pub ambient: Rgb,
    /// `TD`.
    pub diffuse_transmission: Rgb,
    /// `TS`.
    pub specular_transmission: Rgb,
    /// `TA`.
    pub ambient_transmission: Rgb,
    /// `CR`.
    pub mirror: Rgb,
    /// `CT`.
    pub transparency: Rgb,
    /// `CO`.
    pub shadow: Rgb,
}

impl Shape {
    /// Every vertex of the shape; of a curved one the two ends of the box about it.
    pub fn vertices(&self) -> Vec<DVec3> {
        match self {
            Self::Parallelogram(p) => p.corners().to_vec(),
            Self::Polygon(p) => p.vertices.clone(),
            Self::Quadrilateral(q) => q.corners.to_vec(),
            Self::Mesh(m) | Self::Fractal(m) => m.vertices.clone(),
            Self::Sphere(c) => {
                let [x, y, z] = c.axes();
                c.boxed(&[c.map.translation], [x, y, z])
            }
            Self::Cylinder(c) => {
                let [x, y, z] = c.axes();
                c.boxed(&[c.map.translation, c.map.translation + x], [DVec3::ZERO, y, z])
            }
        }
    }

    /// The parallelogram that it is, where it is one that may be cut into equal cells.
    pub fn parallelogram(&self) -> Option<Parallelogram> {
        match self {
            Self::Parallelogram(p) => Some(*p),
            Self::Polygon(p) => match p.vertices[..] {
                [a, b, c, d]
                    if (a + c - b - d).length() <= PARALLEL * (c - a).length().max((d - b).length()) =>
                {
                    let (u, v) = (b - a, d - a);
                    let normal = u.cross(v).normalize_or_zero();
                    Some(Parallelogram { origin: a, u, v, normal, columns: 1, rows: 1 })
                }
                _ => None,
            },
            _ => None,
        }
    }
}

/// What is nearer than this, relative to the scene's longest side, touches: what numbers in single precision, and written
/// with six digits, leave of walls that were to stand on a floor.
pub const TOUCHING: f64 = 1e-6;

/// How far a polygon's corners may lie from a parallelogram's, relative to its longer diagonal, to be cut as one.
const PARALLEL: f64 = 1e-12;

impl Curved {
    /// Where the map takes the unit vectors.
    pub fn axes(&self) -> [DVec3; 3] {
        let linear = self.map.matrix3;
        [linear.x_axis, linear.y_axis, linear.z_axis]
    }

    /// The ends of the box about ellipses, or ellipsoids, with these half axes about `centres`.
    fn boxed(&self, centres: &[DVec3], half_axes: [DVec3; 3]) -> Vec<DVec3> {
        let squares = half_axes.into_iter().map(|axis| axis * axis).sum::<DVec3>();
        let reach = DVec3::new(squares.x.sqrt(), squares.y.sqrt(), squares.z.sqrt());
        let low = centres.iter().fold(DVec3::INFINITY, |low, &centre| low.min(centre - reach));
        let high = centres.iter().fold(DVec3::NEG_INFINITY, |high, &centre| high.max(centre + reach));
        vec![low, high]
    }
}

impl Surface {
    /// Emitted exitance and diffuse reflectance of a mesh's triangle, counted from 0: its own, or the material's. On
    /// any other shape they are the material's everywhere.
    pub fn coefficients(&self, triangle: usize) -> (Rgb, Rgb) {
        let own = |column: &[Rgb], all: Rgb| column.get(triangle).copied().unwrap_or(all);
        match &self.shape {
            Shape::Mesh(mesh) => {
                (own(&mesh.emission, self.material.emission), own(&mesh.diffuse, self.material.diffuse))
            }
            _ => (self.material.emission, self.material.diffuse),
        }
    }

    /// Whether they vary over the triangles of a mesh.
    pub fn is_painted(&self) -> bool {
        let paints = |mesh: &Mesh| mesh.diffuse_paint.is_some() || mesh.emission_paint.is_some();
        matches!(&self.shape, Shape::Mesh(mesh) if paints(mesh))
    }

    /// The means of [`Surface::coefficients`] over parts of a mesh's triangle.
    pub fn coefficients_over(&self, triangle: usize, parts: &[[DVec3; 3]]) -> (Rgb, Rgb) {
        let (emission, diffuse) = self.coefficients(triangle);
        let Shape::Mesh(mesh) = &self.shape else { return (emission, diffuse) };
        let corners = mesh.triangles[triangle].map(|k| mesh.vertices[k as usize]);
        let over = |paint: &Option<Arc<Paint>>, all: Rgb| {
            paint.as_ref().map_or(all, |paint| paint.over(triangle, corners, parts))
        };
        (over(&mesh.emission_paint, emission), over(&mesh.diffuse_paint, diffuse))
    }
}

impl Parallelogram {
    /// The four corners s1, s2, s3, s4.
    pub fn corners(&self) -> [DVec3; 4] {
        [self.origin, self.origin + self.u, self.origin + self.u + self.v, self.origin + self.v]
    }
}

/// Read a scene file, by the kind its name's ending tells (`.scn`, `.obj`, `.gltf`, `.glb`), with the camera that
/// stands beside it. A name that tells nothing (`/dev/stdin`) is read as N3D's `.scn`.
///
/// # Errors
/// [`SceneError::Syntax`] where something written in the file is wrong, [`SceneError::File`] where it could
/// not be read at all, or has no lines to point at.
pub fn read(path: &Path) -> Result<Scene, SceneError> {
    let refuse = |message: &str| {
        Err(SceneError::File { file: path.display().to_string(), message: message.to_owned() })
    };
    let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
    match ending.to_str() {
        Some("vsn") => refuse("this is a view, a camera without a scene: name the .scn file it belongs to"),
        Some("gltf" | "glb") => gltf::read(path),
        Some("obj") => obj::read(path),
        _ => n3d::read(path),
    }
}
