//! Small scenes, built in place.

use glam::DVec3;
use radiosity::light::Rgb;
use radiosity::scene::{BackFaces, Material, Parallelogram, Place, Scene, Shape, Surface};

/// A closed cube of side 2 whose ceiling shines; every wall of another grey.
pub(super) fn cube(cells: u32) -> Scene {
    let (l, d) = (DVec3::splat(-1.0), 2.0);
    let (x, y, z) = (DVec3::X * d, DVec3::Y * d, DVec3::Z * d);
    let faces = [(l, x, y), (l + z, y, x), (l, z, x), (l + y, x, z), (l, y, z), (l + x, z, y)];
    let surface = |(index, (origin, u, v)): (usize, (DVec3, DVec3, DVec3))| Surface {
        name: String::new(),
        shape: Shape::Parallelogram(Parallelogram {
            origin,
            u,
            v,
            normal: u.cross(v).normalize(),
            columns: cells,
            rows: cells,
        }),
        material: Material {
            diffuse: Rgb::grey(0.3 + 0.1 * index as f64),
            emission: if index == 1 { Rgb::new(4.0, 3.0, 2.0) } else { Rgb::BLACK },
            ..Material::default()
        },
        place: Place { line: 1 + index as u32, column: 1 },
    };
    Scene {
        name: "cube".into(),
        surfaces: faces.into_iter().enumerate().map(surface).collect(),
        camera: None,
        back_faces: BackFaces::Lit,
        warnings: Vec::new(),
    }
}
