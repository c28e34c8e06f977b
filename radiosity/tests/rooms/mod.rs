//! Small scenes that the tests share, built in place.

#![allow(dead_code, unreachable_pub, reason = "each test binary uses its own part")]

use glam::{DMat3, DVec3};
use radiosity::light::Rgb;
use radiosity::patches::Patches;
use radiosity::scene::{BackFaces, Material, Mesh, Parallelogram, Place, Scene, Shape, Surface};

/// A square (or parallelogram) of `cells` by `cells` patches, grey, dark; its front is where `u × v` points.
pub fn plate(origin: [f64; 3], u: [f64; 3], v: [f64; 3], cells: u32) -> Surface {
    let (origin, u, v) = (DVec3::from(origin), DVec3::from(u), DVec3::from(v));
    Surface {
        name: String::new(),
        shape: Shape::Parallelogram(Parallelogram {
            origin,
            u,
            v,
            normal: u.cross(v).normalize(),
            columns: cells,
            rows: cells,
        }),
        material: Material { diffuse: Rgb::grey(0.5), ..Material::default() },
        place: Place::default(),
    }
}

/// A scene of these surfaces, both sides lit.
pub fn scene_of(surfaces: impl IntoIterator<Item = Surface>) -> Scene {
    Scene {
        name: "test".into(),
        surfaces: surfaces.into_iter().collect(),
        camera: None,
        back_faces: BackFaces::Lit,
        warnings: Vec::new(),
    }
}

/// The six sides of a box; fronts inward, or outward.
pub fn sides(low: [f64; 3], high: [f64; 3], cells: u32, inward: bool) -> Vec<Surface> {
    let (l, h) = (DVec3::from(low), DVec3::from(high));
    let d = h - l;
    let (x, y, z) = (DVec3::X * d.x, DVec3::Y * d.y, DVec3::Z * d.z);
    // Origin, u, v with u × v into the box.
    let faces = [(l, x, y), (l + z, y, x), (l, z, x), (l + y, x, z), (l, y, z), (l + x, z, y)];
    let plates = faces.into_iter().map(|(origin, u, v)| {
        let (u, v) = if inward { (u, v) } else { (v, u) };
        plate(origin.into(), u.into(), v.into(), cells)
    });
    plates.collect()
}

/// An empty unit cube: floor z = 0 first, then the ceiling, then the walls.
pub fn cube(cells: u32) -> Scene {
    scene_of(sides([0.0; 3], [1.0; 3], cells, true))
}

/// A closed room with a closed box in the air, one in a corner of the floor (its exposed sides only, so that nothing lies
/// flush with anything), and a thin plate.
pub fn furnished_room() -> Scene {
    let mut surfaces = sides([0.0; 3], [4.0, 3.0, 2.5], 6, true);
    surfaces.extend(sides([1.0, 1.0, 0.2], [2.0, 1.7, 0.8], 3, false));
    // Top, the side towards +y, the side towards -x.
    let corner = sides([3.0, 0.0, 0.0], [4.0, 1.0, 1.6], 3, false);
    surfaces.extend([1, 3, 4].map(|k| corner[k].clone()));
    surfaces.push(plate([0.5, 2.0, 1.5], [1.0, 0.0, 0.0], [0.0, 0.6, 0.2], 4));
    scene_of(surfaces)
}

/// The same, turned and far from the origin, so that no coordinate is a round number.
pub fn tilted_room() -> Scene {
    tilted(furnished_room())
}

/// A scene of parallelograms, likewise.
pub fn tilted(mut scene: Scene) -> Scene {
    let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7);
    for surface in &mut scene.surfaces {
        if let Shape::Parallelogram(p) = &mut surface.shape {
            p.origin = turn * p.origin + DVec3::new(31.7, -12.3, 5.9);
            (p.u, p.v, p.normal) = (turn * p.u, turn * p.v, turn * p.normal);
        }
    }
    scene
}

/// A scene of parallelograms, every patch of theirs in two triangles, halved now this way, now that, surface by surface.
pub fn triangulated(mut scene: Scene) -> Scene {
    for (surface, number) in scene.surfaces.iter_mut().zip(0..) {
        let Shape::Parallelogram(p) = &surface.shape else { continue };
        let share = |k: u32, count: u32| f64::from(k) / f64::from(count);
        let lattice = (0..=p.rows).flat_map(|row| (0..=p.columns).map(move |column| (column, row)));
        let at = |(column, row)| p.origin + p.u * share(column, p.columns) + p.v * share(row, p.rows);
        let vertices = lattice.map(at).collect();
        let along = p.columns + 1;
        let cells = (0..p.rows).flat_map(|row| (0..p.columns).map(move |column| row * along + column));
        let halves = |a: u32| {
            let (b, c, d) = (a + 1, a + along + 1, a + along);
            if number % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[d, a, b], [d, b, c]] }
        };
        let triangles = cells.flat_map(halves).collect();
        surface.shape = Shape::Mesh(Mesh { vertices, triangles, ..Mesh::default() });
    }
    scene
}

/// Give every surface this emission and reflectance.
pub fn paint(scene: &mut Scene, paint: impl Fn(usize) -> (Rgb, Rgb)) {
    for (index, surface) in scene.surfaces.iter_mut().enumerate() {
        (surface.material.emission, surface.material.diffuse) = paint(index);
    }
}

/// Whatever was read, these are patches: some, each with an area and a normal.
pub fn assert_sound(patches: &Patches) {
    assert!(!patches.is_empty());
    assert!(patches.area.iter().all(|&area| area.is_finite() && area > 0.0));
    assert!(patches.normal.iter().all(|normal| (normal.length() - 1.0).abs() < 1e-9));
}
