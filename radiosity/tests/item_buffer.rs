//! The item buffer against a twin that draws every facet, one at a time and a cell at a time, on scenes made to be
//! difficult; and its laws: nothing falls between two facets, and every processor gives the same bits.

mod rooms;

use glam::{DMat3, DVec3};
use proptest::prelude::*;
use radiosity::form_factors::hemicube::{CellWeights, Hemicube, Scratch};
use radiosity::patches::subdivide;
use radiosity::scene::{BackFaces, Material, Mesh, Place, Scene, Shape, Surface};
use radiosity::simd::Level;
use radiosity::visibility::{Facet, Facets, ItemBuffer, NOTHING, RayTree, View};

use rooms::{plate, scene_of, sides};

/// How many facets reach beyond their edges in the twin, in cells, as in the item buffer.
const EDGE_TOLERANCE: f64 = 4e-6;

/// Edges this near a cell's centre, in cells, and distances so nearly the same, are for rounding to decide.
const DOUBTFUL: f64 = 2e-4;

/// What a cell of the twin shows.
#[derive(Clone, Copy, Debug)]
struct Shown {
    facet: u32,
    inverse_depth: f64,
    /// Whether an edge or another facet is so near that rounding decides.
    doubtful: bool,
}

/// The twin: homogeneous edge functions of every facet at every cell, in double precision, nothing left out.
fn plain_item_buffer(facets: &Facets, view: &View) -> Vec<Shown> {
    let none = Shown { facet: NOTHING, inverse_depth: 1.0 / view.far, doubtful: false };
    let mut shown = vec![none; view.width * view.height];
    let step = [view.right * view.cell_width(), view.up * view.cell_height()];
    for (facet, number) in facets.as_slice().iter().zip(0..) {
        let (corners, count) = facet.corners();
        let corners: Vec<DVec3> = corners[..count].iter().map(|&corner| corner - view.eye).collect();
        let normal = facet.u.cross(facet.v);
        let offset = normal.dot(corners[0]);
        let reach = corners.iter().map(|corner| corner.length()).fold(0.0, f64::max);
        if offset.abs() <= 1e-10 * reach * normal.length() {
            continue;
        }
        for (k, cell) in shown.iter_mut().enumerate() {
            let direction = view.direction((k % view.width) as f64, (k / view.width) as f64);
            // How far the cell's centre lies inside of the nearest edge, in cells.
            let mut inside = f64::INFINITY;
            for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
                let edge = a.cross(*b) * offset.signum();
                let reach: f64 = step.iter().map(|step| edge.dot(*step).abs()).sum();
                if reach > 0.0 {
                    inside = inside.min(edge.dot(direction) / reach);
                } else if edge.dot(direction) < 0.0 {
                    inside = f64::NEG_INFINITY;
                }
            }
            let inverse_depth = normal.dot(direction) / offset;
            if inverse_depth < -DOUBTFUL || inside < -DOUBTFUL {
                continue;
            }
            let near = (inverse_depth - cell.inverse_depth).abs()
                <= DOUBTFUL * inverse_depth.abs().max(cell.inverse_depth.abs());
            let doubtful = inside < DOUBTFUL || near && cell.facet != NOTHING;
            let wins = inside >= -EDGE_TOLERANCE && inverse_depth > cell.inverse_depth;
            if wins {
                // What was doubtful and lies behind is hidden now.
                let doubtful = doubtful || near && cell.doubtful;
                *cell = Shown { facet: number, inverse_depth, doubtful };
            } else if doubtful && inverse_depth >= cell.inverse_depth * (1.0 - DOUBTFUL) {
                cell.doubtful = true;
            }
        }
    }
    shown
}

/// The buffer holds what the twin shows, in every cell where rounding does not decide.
fn assert_seen_alike(facets: &Facets, view: &View) -> Result<(), TestCaseError> {
    let plain = plain_item_buffer(facets, view);
    let mut buffers = Vec::new();
    for level in Level::available() {
        let mut buffer = ItemBuffer::default();
        buffer.draw_at(level, facets, view);
        buffers.push(buffer);
    }
    let doubtful = plain.iter().filter(|cell| cell.doubtful).count();
    prop_assert!(doubtful * 4 < plain.len(), "{doubtful} of {} cells say nothing", plain.len());
    for y in 0..view.height {
        for other in &buffers[1..] {
            prop_assert_eq!(buffers[0].facets(y), other.facets(y));
            prop_assert_eq!(buffers[0].inverse_depths(y), other.inverse_depths(y));
        }
        for x in 0..view.width {
            let cell = &plain[y * view.width + x];
            let (found, depth) = (buffers[0].facets(y)[x], f64::from(buffers[0].inverse_depths(y)[x]));
            if cell.doubtful {
                continue;
            }
            prop_assert_eq!(found, cell.facet, "cell ({}, {}): {:?}, not at {}", x, y, cell, depth);
            prop_assert!(
                (depth - cell.inverse_depth).abs() <= 1e-5 * cell.inverse_depth.abs(),
                "{depth} {cell:?}"
            );
        }
    }
    Ok(())
}

fn mesh(vertices: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Surface {
    Surface {
        shape: Shape::Mesh(Mesh { vertices, triangles, ..Mesh::default() }),
        name: String::new(),
        material: Material::default(),
        place: Place::default(),
    }
}

fn point(extent: f64) -> impl Strategy<Value = DVec3> {
    let along = -extent..extent;
    (along.clone(), along.clone(), along).prop_map(|(x, y, z)| DVec3::new(x, y, z))
}

/// Surfaces of every difficult kind.
fn difficult_surface() -> impl Strategy<Value = Surface> {
    let wide = (point(4.0), point(2.0), point(2.0))
        .prop_filter("area", |(_, u, v)| u.cross(*v).length() > 1e-3)
        .prop_map(|(origin, u, v)| plate(origin.into(), u.into(), v.into(), 1));
    // A triangle a hundred times to a million times as long as it is wide.
    let sliver = (point(4.0), point(3.0), point(1.0), 2..6_i32).prop_map(|(a, along, aside, digits)| {
        mesh(vec![a, a + along, a + along * 0.4 + aside * 0.1_f64.powi(digits)], vec![[0, 1, 2]])
    });
    // Triangles that share a corner and edges: a fan, closed or folded.
    let fan = (point(3.0), proptest::collection::vec(point(1.5), 3..9)).prop_map(|(tip, around)| {
        let count = around.len() as u32;
        let vertices = [tip].into_iter().chain(around.into_iter().map(|d| tip + d)).collect();
        mesh(vertices, (1..count).map(|k| [0, k, k + 1]).collect())
    });
    // Through the eye's own plane, and beside it.
    let through = (point(3.0), point(3.0), 0.05..3.0_f64).prop_map(|(a, b, below)| {
        mesh(
            vec![DVec3::new(a.x, a.y, -below), DVec3::new(b.x, b.y, -below), (a + b).with_z(2.0)],
            vec![[0, 1, 2]],
        )
    });
    // So small that it lies between the cells' centres, or covers one.
    let speck = (point(3.0), point(0.05), point(0.05))
        .prop_map(|(origin, u, v)| mesh(vec![origin, origin + u, origin + v], vec![[0, 1, 2]]));
    prop_oneof![3 => wide, 1 => sliver, 1 => fan, 1 => through, 2 => speck]
}

fn facets_of(scene: &Scene) -> Facets {
    Facets::new(scene, &subdivide(scene, 1.0).unwrap())
}

fn view(size: [usize; 2], turn: DMat3, near_far: [f64; 2]) -> View {
    View {
        eye: DVec3::ZERO,
        right: turn.x_axis,
        up: turn.y_axis,
        forward: turn.z_axis,
        horizontal: [-1.0, 1.0],
        vertical: [0.7, -0.9],
        width: size[0],
        height: size[1],
        near: near_far[0],
        far: near_far[1],
    }
}

fn rotation() -> impl Strategy<Value = DMat3> {
    (point(1.0), 0.0..6.0_f64)
        .prop_map(|(axis, angle)| DMat3::from_axis_angle(axis.try_normalize().unwrap_or(DVec3::Z), angle))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn the_buffer_shows_what_drawing_everything_shows(
        surfaces in proptest::collection::vec(difficult_surface(), 1..90),
        turn in rotation(),
        mirrored: bool,
        size in (3..70_usize, 2..40_usize),
        near_far in prop_oneof![Just([0.0, f64::INFINITY]), Just([0.8, 3.0])],
    ) {
        let mut view = view([size.0, size.1], turn, near_far);
        if mirrored {
            view.right = -view.right;
        }
        let facets = facets_of(&scene_of(surfaces));
        // The twin knows no near plane: what lies before it is no part of the scene then.
        if near_far[0] == 0.0 {
            assert_seen_alike(&facets, &view)?;
        } else {
            let mut buffer = ItemBuffer::default();
            buffer.draw(&facets, &view);
            for y in 0..view.height {
                for &depth in buffer.inverse_depths(y) {
                    prop_assert!(depth <= (1.0 / near_far[0]) as f32 && depth >= (1.0 / near_far[1]) as f32);
                }
            }
        }
    }

    #[test]
    fn a_crowd_behind_a_wall_is_not_seen_and_one_before_it_is(
        specks in proptest::collection::vec((point(1.0), point(0.3), point(0.3)), 200..600),
        gap in 0.0..0.5_f64,
        turn in rotation(),
    ) {
        // A wall with a slit before hundreds of triangles, and some, small, just before the wall: what hides the ones must
        // not hide the others.
        let wall = |x: f64, width: f64| plate([x, -9.0, 1.0], [width, 0.0, 0.0], [0.0, 18.0, 0.0], 1);
        let crowd = specks.iter().enumerate().flat_map(|(k, &(at, u, v))| match k % 3 {
            0 => {
                let at = DVec3::new(at.x, at.y, 0.93 + 0.05 * at.z);
                [at, at + u * 0.1, at + v * 0.1]
            }
            _ => {
                let at = at * 2.0 + DVec3::Z * 4.0;
                [at, at + u, at + v]
            }
        });
        let triangles = (0..specks.len() as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]);
        let mut surfaces = vec![wall(-9.0, 9.0 - gap), wall(gap, 9.0)];
        surfaces.push(mesh(crowd.collect(), triangles.collect()));
        for surface in &mut surfaces {
            match &mut surface.shape {
                Shape::Parallelogram(p) => {
                    (p.origin, p.u, p.v, p.normal) = (turn * p.origin, turn * p.u, turn * p.v, turn * p.normal);
                }
                Shape::Mesh(m) => m.vertices.iter_mut().for_each(|vertex| *vertex = turn * *vertex),
                _ => {}
            }
        }
        assert_seen_alike(&facets_of(&scene_of(surfaces)), &view([48, 48], turn, [0.0, f64::INFINITY]))?;
    }
}

/// A box whose six sides are cut into meshes, each more finely than the one before: T-junctions all along its edges.
fn patchwork(turn: DMat3, cuts: [u32; 6]) -> Vec<Surface> {
    let walls = sides([-1.0, -1.2, -0.8], [1.1, 0.9, 1.3], 1, true);
    let meshes = walls.iter().zip(cuts).map(|(wall, cuts)| {
        let Shape::Parallelogram(p) = &wall.shape else { unreachable!("sides are parallelograms") };
        let share = |k: u32| f64::from(k) / f64::from(cuts);
        let lattice = (0..=cuts).flat_map(|row| (0..=cuts).map(move |column| (column, row)));
        let vertices =
            lattice.map(|(column, row)| turn * (p.origin + p.u * share(column) + p.v * share(row)));
        let cells = (0..cuts).flat_map(|row| (0..cuts).map(move |column| row * (cuts + 1) + column));
        let triangles = cells.flat_map(|a| [[a, a + 1, a + cuts + 2], [a, a + cuts + 2, a + cuts + 1]]);
        mesh(vertices.collect(), triangles.collect())
    });
    meshes.collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn no_light_leaks_where_meshes_of_different_fineness_meet(
        turn in rotation(),
        cuts in proptest::array::uniform6(1..9_u32),
        // All of them within the box: who stands outside has no closed room about.
        things in proptest::collection::vec((point(0.25), point(0.2), point(0.2)), 0..4),
        precision in prop_oneof![Just(24_u32), Just(50), Just(100)],
    ) {
        let mut surfaces = patchwork(turn, cuts);
        let flat = |u: DVec3, v: DVec3| u.cross(v).length() > 1e-3;
        surfaces.extend(things.iter().filter(|(_, u, v)| flat(*u, *v)).map(|&(origin, u, v)| {
            plate((turn * origin).into(), (turn * u).into(), (turn * v).into(), 2)
        }));
        let scene = scene_of(surfaces);
        let patches = subdivide(&scene, 1.0).unwrap();
        let facets = Facets::new(&scene, &patches);
        let hemicube =
            Hemicube::new(&patches, &facets, BackFaces::Lit, CellWeights::new(precision).unwrap());
        let tree = RayTree::new(&facets);
        let mut scratch = Scratch::default();
        for patch in 0..patches.len() {
            let row = hemicube.row(patch, &mut scratch);
            prop_assert!((row.sum() - 1.0).abs() < 2e-6, "patch {}: {}", patch, row.sum());
            if patch % 40 == 0 {
                // And the light comes from where rays say: they differ by cells on edges.
                let by_rays = hemicube.row_by_rays(patch, &tree);
                let apart: f64 = (0..patches.len()).map(|j| (row.get(j) - by_rays.get(j)).abs()).sum();
                prop_assert!(apart < 0.01, "patch {}: {}", patch, apart);
            }
        }
    }
}

#[test]
fn what_is_seen_nearly_edge_on_stands_at_its_true_depth() {
    // Within one block of sixteen cells the plane comes from behind the eye to before it.
    let axes = [
        [0.6722216508266284, -0.5812441852861153, 0.45855561192837074],
        [0.5812441852861153, 0.7979664939980216, 0.15938842971679434],
        [-0.45855561192837074, 0.15938842971679434, 0.8742551568286069],
    ];
    let turn = DMat3::from_cols_array_2d(&axes);
    let plate = plate(
        [0.43901757786128737, 0.4356897345492103, 0.30905134105764853],
        [-1.4409250443825823, -1.4496102264285675, -1.0643296246967424],
        [0.0, 0.0, 1.5915618957701694],
        1,
    );
    assert_seen_alike(&facets_of(&scene_of([plate])), &view([10, 38], turn, [0.0, f64::INFINITY])).unwrap();
}

#[test]
fn of_two_coincident_facets_the_one_that_sends_light_is_seen() {
    // A two-sided sheet as two surfaces back to back, in either order, over a floor: each side shows its own front.
    let floor = plate([-1.0, -1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], 1);
    let corners = vec![DVec3::new(-3.0, -3.0, 1.0), DVec3::new(3.0, -3.0, 1.0), DVec3::new(0.0, 4.0, 1.0)];
    let up = mesh(corners.clone(), vec![[0, 1, 2]]);
    let down = mesh(corners, vec![[0, 2, 1]]);
    for sheets in [[up.clone(), down.clone()], [down, up]] {
        let [first, second] = sheets;
        let scene = scene_of([floor.clone(), first, second]);
        let patches = subdivide(&scene, 1.0).unwrap();
        let facets = Facets::new(&scene, &patches);
        let hemicube = Hemicube::new(&patches, &facets, BackFaces::Black, CellWeights::new(50).unwrap());
        let row = hemicube.row(0, &mut Scratch::default());
        let facing = (1..3).find(|&patch| patches.normal[patch].z < 0.0).unwrap();
        assert!(row.get(facing) > 0.5, "{}", row.get(facing));
        assert_eq!(row.get(3 - facing), 0.0);
    }
}

#[test]
fn neighbours_in_one_plane_share_it_without_gap_or_overlap() {
    // A ceiling of 9 plates side by side is seen like one of 9 patches.
    let floor = || plate([-1.0, -1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], 4);
    let one = scene_of([floor(), plate([-3.0, -3.0, 1.5], [0.0, 6.0, 0.0], [6.0, 0.0, 0.0], 3)]);
    let tiles = (0..9).map(|k| {
        let (column, row) = (f64::from(k % 3), f64::from(k / 3));
        plate([-3.0 + 2.0 * row, -3.0 + 2.0 * column, 1.5], [0.0, 2.0, 0.0], [2.0, 0.0, 0.0], 1)
    });
    let many = scene_of([floor()].into_iter().chain(tiles));
    let rows = [one, many].map(|scene| {
        let patches = subdivide(&scene, 1.0).unwrap();
        let facets = Facets::new(&scene, &patches);
        let hemicube = Hemicube::new(&patches, &facets, BackFaces::Lit, CellWeights::new(100).unwrap());
        let mut scratch = Scratch::default();
        (0..16).map(|patch| hemicube.row(patch, &mut scratch)).collect::<Vec<_>>()
    });
    for (one, many) in rows[0].iter().zip(&rows[1]) {
        assert!((one.sum() - many.sum()).abs() < 1e-6, "{} {}", one.sum(), many.sum());
        for ceiling in 16..25 {
            let apart = (one.get(ceiling) - many.get(ceiling)).abs();
            assert!(apart < 1e-6, "patch {ceiling}: {} {}", one.get(ceiling), many.get(ceiling));
        }
    }
}

/// A facet's corners through which nothing is seen: no area, or no number at all.
#[test]
fn what_has_no_area_is_not_drawn() {
    let line = mesh(vec![DVec3::X, DVec3::X * 2.0, DVec3::new(3.0, 0.0, 1e-320)], vec![[0, 1, 2], [0, 0, 1]]);
    let facets = facets_of(&scene_of([line, plate([-1.0, -1.0, 2.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], 1)]));
    let mut buffer = ItemBuffer::default();
    buffer.draw(&facets, &view([20, 20], DMat3::IDENTITY, [0.0, f64::INFINITY]));
    let square = facets.as_slice().iter().position(|facet: &Facet| facet.u == DVec3::X * 2.0).unwrap() as u32;
    let seen: Vec<u32> = (0..20).flat_map(|y| buffer.facets(y).to_vec()).collect();
    assert!(seen.contains(&square) && seen.iter().all(|&facet| facet == square || facet == NOTHING));
}
