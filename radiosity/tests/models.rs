//! Meshes from modelling programs: each triangle may have a colour of its own.

mod rooms;

use glam::DVec3;
use radiosity::light::Rgb;
use radiosity::patches;
use radiosity::scene::{Material, Mesh, Place, Shape, Surface};
use rooms::scene_of;

#[test]
fn a_triangles_own_coefficients_go_before_the_materials() {
    let mesh = Mesh {
        vertices: vec![DVec3::ZERO, DVec3::X, DVec3::ONE, DVec3::Y],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        diffuse: vec![Rgb::grey(0.2), Rgb::grey(0.6)],
        ..Mesh::default()
    };
    let material = Material { diffuse: Rgb::grey(0.4), emission: Rgb::grey(3.0), ..Material::default() };
    let surface = Surface { name: "rug".into(), shape: Shape::Mesh(mesh), material, place: Place::default() };
    let patches = patches::subdivide(&scene_of([surface]), 1.0).unwrap();
    assert_eq!(patches.reflectance, [Rgb::grey(0.2), Rgb::grey(0.6)]);
    assert_eq!(patches.emission, [Rgb::grey(3.0); 2]);
}
