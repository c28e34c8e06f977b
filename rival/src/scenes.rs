//! The scenes that both are measured on.

use std::path::Path;

use glam::DVec3;
use radiosity::patches;
use radiosity::scene::{self, BackFaces, Material, Mesh, Parallelogram, Place, Scene, Shape, Surface};

/// A scene with the subdivision that cuts it into the patches wanted.
pub struct Task {
    pub name: &'static str,
    pub scene: Scene,
    pub subdivision: f64,
}

/// All of them.
pub fn tasks() -> Vec<Task> {
    let office = read("office");
    let whole = |name, scene| Task { name, scene, subdivision: 1.0 };
    vec![
        whole("Cornell, quads only", cornell_quads()),
        whole("Cornell, as measured", read("cornell")),
        Task { name: "office, quads", subdivision: for_about(&office, 8000.0), scene: office.clone() },
        whole("Cornell, triangles", tessellated(&cornell_quads(), 32_000.0, 0.0)),
        whole("office, triangles", tessellated(&office, 32_000.0, 0.0)),
        whole("Cornell, triangles askew", tessellated(&cornell_quads(), 32_000.0, 0.2)),
        whole("office, triangles askew", tessellated(&office, 32_000.0, 0.2)),
    ]
}

fn read(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes").join(name).with_extension("scn");
    scene::read(&path).unwrap_or_else(|error| panic!("{error}"))
}

/// The subdivision that makes about so many patches.
fn for_about(scene: &Scene, wanted: f64) -> f64 {
    let (mut low, mut high) = (1e-3, 1e3);
    for _ in 0..60 {
        let middle = f64::sqrt(low * high);
        let count = patches::count(scene, middle).expect("a positive factor") as f64;
        (low, high) = if count < wanted { (middle, high) } else { (low, middle) };
    }
    high
}

/// The Cornell box of 23 parallelograms and 2,000 patches of 30 mm: straight walls, the ceiling cut round the lamp.
fn cornell_quads() -> Scene {
    let mut surfaces = Vec::new();
    let mut quad = |origin: [f64; 3], u: [f64; 3], v: [f64; 3]| {
        let (origin, u, v) = (DVec3::from(origin), DVec3::from(u), DVec3::from(v));
        let cells = |side: DVec3| (side.length() / 30.0).round().max(1.0) as u32;
        let normal = u.cross(v).normalize();
        let shape = Parallelogram { origin, u, v, normal, columns: cells(u), rows: cells(v) };
        surfaces.push(surface(Shape::Parallelogram(shape)));
    };
    let (width, height, depth) = (556.0, 548.8, 559.2);
    quad([0.0, 0.0, 0.0], [0.0, 0.0, depth], [width, 0.0, 0.0]);
    quad([0.0, 0.0, depth], [0.0, height, 0.0], [width, 0.0, 0.0]);
    quad([0.0, 0.0, 0.0], [0.0, height, 0.0], [0.0, 0.0, depth]);
    quad([width, 0.0, 0.0], [0.0, 0.0, depth], [0.0, height, 0.0]);
    let (across, along) = ([0.0, 213.0, 343.0, width], [0.0, 227.0, 332.0, depth]);
    for x in across.windows(2) {
        for z in along.windows(2) {
            quad([x[0], height, z[0]], [x[1] - x[0], 0.0, 0.0], [0.0, 0.0, z[1] - z[0]]);
        }
    }
    // A block: its height, and three corners of its base in a row, clockwise seen from above.
    let blocks = [
        (165.0, [[130.0, 65.0], [82.0, 225.0], [240.0, 272.0]]),
        (330.0, [[423.0, 247.0], [265.0, 296.0], [314.0, 456.0]]),
    ];
    for (top, [a, b, c]) in blocks {
        let (u, v) = ([b[0] - a[0], b[1] - a[1]], [c[0] - b[0], c[1] - b[1]]);
        let flat = |[x, z]: [f64; 2]| [x, 0.0, z];
        let back = |[x, z]: [f64; 2]| [-x, 0.0, -z];
        let up = [0.0, top, 0.0];
        let d = [c[0] - u[0], c[1] - u[1]];
        quad([a[0], top, a[1]], flat(u), flat(v));
        for (corner, side) in [(a, flat(u)), (b, flat(v)), (c, back(u)), (d, back(v))] {
            quad(flat(corner), side, up);
        }
    }
    Scene {
        name: "Cornell on quads".into(),
        surfaces,
        camera: None,
        back_faces: BackFaces::Lit,
        warnings: Vec::new(),
    }
}

fn surface(shape: Shape) -> Surface {
    Surface { name: String::new(), shape, material: Material::default(), place: Place::default() }
}

/// Every parallelogram as a mesh of triangles, about `wanted` in all, each a patch of its own: a lattice, or with the corners
/// within it moved by up to so much of a cell along it, none.
fn tessellated(scene: &Scene, wanted: f64, askew: f64) -> Scene {
    let factor = for_about(scene, 0.5 * wanted);
    let scaled = |cells: u32| ((f64::from(cells) * factor).round() as u32).max(1);
    let mesh = |p: &Parallelogram| {
        let (columns, rows) = (scaled(p.columns), scaled(p.rows));
        let vertices = (0..=rows).flat_map(|row| (0..=columns).map(move |column| (row, column)));
        let vertices = vertices.map(|(row, column)| {
            let moved = |k: u32, count: u32, by: f64| match k {
                k if k == 0 || k == count => f64::from(k) / f64::from(count),
                _ => (f64::from(k) + askew * by.sin()) / f64::from(count),
            };
            let along = f64::from(row * 31 + column * 17);
            p.origin + p.u * moved(column, columns, along) + p.v * moved(row, rows, along * 1.7)
        });
        let flipped = p.u.cross(p.v).dot(p.normal) < 0.0;
        let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| row * (columns + 1) + column));
        let triangles = cells.flat_map(|a| {
            let (b, c, d) = (a + 1, a + columns + 2, a + columns + 1);
            if flipped { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] }
        });
        Shape::Mesh(Mesh {
            vertices: vertices.collect(),
            triangles: triangles.collect(),
            ..Mesh::default()
        })
    };
    let surfaces = scene.surfaces.iter().map(|s| {
        let shape = match &s.shape {
            Shape::Parallelogram(p) => mesh(p),
            other => other.clone(),
        };
        Surface { shape, ..s.clone() }
    });
    Scene { surfaces: surfaces.collect(), ..scene.clone() }
}
