//! A camera for a scene whose author left none.
//!
//! There is no one rule for a closed room, a room with an open side, and a thing on a plinth. So many cameras are
//! tried, inside and out, each takes a picture the size of a stamp, and the one that shows most of the scene's lit
//! sides is kept. No chance is involved: the same scene gets the same camera.

use glam::DVec3;

use crate::patches;
use crate::scene::{BackFaces, Camera, Scene};
use crate::visibility::{Facet, FacetShape, Facets, ItemBuffer, NOTHING, View};

/// The stamp's size, in the 4:3 of the window.
const STAMP: [usize; 2] = [40, 30];
/// Half the window's width and height at distance 1, seen from outside: 53° by 41°.
const OUTSIDE: [f64; 2] = [0.5, 0.375];
/// Likewise from inside: 75° by 60°.
const INSIDE: [f64; 2] = [0.77, 0.5775];
/// From this many facets on, fewer cameras are tried.
const MANY_FACETS: usize = 20_000;
/// What a view straight at a side, and a view straight from above or below, are worth beside others: they show things
/// flat.
const FRONTAL: f64 = 0.85;
const PLAN: f64 = 0.75;
/// What a back is worth beside a front, in scenes whose backs are lit: there a room is a room even where its author wound
/// some walls the wrong way round, and yet nobody wants to see a box from within.
const LIT_BACK: f64 = 0.4;
/// How much better a camera must be than those tried before it: the first ones are the customary ones.
const BETTER: f64 = 1.05;

/// A camera that frames `scene` sensibly, +y up: into a room through its open side, or from within where it has none;
/// at a thing from outside and above. Its window is 4:3; pictures of another shape show more.
pub fn frame(scene: &Scene) -> Camera {
    let default = camera(DVec3::ZERO, DVec3::NEG_Z, OUTSIDE);
    // One patch a surface, or a triangle, is the least that facets can carry: the scene's own subdivision is not asked.
    let Ok(patches) = patches::subdivide(scene, f64::MIN_POSITIVE) else { return default };
    let facets = Facets::new(scene, &patches);
    let Some(bounds) = Bounds::of(facets.as_slice()) else { return default };

    let mut stamps = Stamps::new(scene, &facets, &bounds);
    let mut best: Option<(f64, Camera)> = None;
    for camera in candidates(&facets, &bounds) {
        let merit = stamps.merit(&camera) * roundness(camera.forward);
        if best.is_none_or(|(least, _)| merit > least * BETTER) {
            best = Some((merit, camera));
        }
    }
    best.map_or(default, |(_, camera)| camera)
}

/// How well depth can be read in a view along `forward`.
fn roundness(forward: DVec3) -> f64 {
    if forward.y.abs() > 0.999 {
        PLAN
    } else if forward.abs().max_element() > 0.999 {
        FRONTAL
    } else {
        1.0
    }
}

/// A box along the axes.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    low: DVec3,
    high: DVec3,
}

impl Bounds {
    /// `None` where there is nothing, or nothing finite.
    fn of(facets: &[Facet]) -> Option<Self> {
        let mut bounds = Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };
        for facet in facets {
            let (corners, count) = facet.corners();
            for corner in corners[..count].iter().filter(|corner| corner.is_finite()) {
                bounds.low = bounds.low.min(*corner);
                bounds.high = bounds.high.max(*corner);
            }
        }
        (bounds.low.x <= bounds.high.x && bounds.size() > 0.0 && bounds.size().is_finite()).then_some(bounds)
    }

    /// The diagonal's length.
    fn size(&self) -> f64 {
        (self.high - self.low).length()
    }

    fn centre(&self) -> DVec3 {
        self.at(DVec3::splat(0.5))
    }

    /// The point at a share, 0..1, of each side.
    fn at(&self, share: DVec3) -> DVec3 {
        self.low + (self.high - self.low) * share
    }

    fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|k| self.at(DVec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64)))
    }
}

/// A camera that looks along `forward`, which is not vertical or else sees -z at the top of its picture (from above).
fn camera(eye: DVec3, forward: DVec3, [across, upward]: [f64; 2]) -> Camera {
    let forward = forward.normalize();
    let right = forward.cross(DVec3::Y);
    let right = if right.length() > 1e-6 { right.normalize() } else { DVec3::X };
    Camera {
        eye,
        forward,
        right,
        up: right.cross(forward),
        horizontal: [-across, across],
        vertical: [-upward, upward],
        near: 0.0,
        far: f64::INFINITY,
        viewport: [0.0, 1.0, 0.0, 1.0],
    }
}

/// Directions, seen from above, of a view from a corner: each leaves one side facing the eye more than the other, as
/// three-quarter views do.
const ASIDE: [(f64, f64); 8] =
    [(-0.6, -1.0), (0.6, -1.0), (-0.6, 1.0), (0.6, 1.0), (-1.0, 0.6), (1.0, 0.6), (-1.0, -0.6), (1.0, -0.6)];

/// The cameras to try, the most customary first.
fn candidates(facets: &Facets, bounds: &Bounds) -> Vec<Camera> {
    let few = facets.as_slice().len() < MANY_FACETS;
    let mut cameras = Vec::new();

    // From each corner, above before below: how one looks at a thing. The first have +z in
    // front, x to the right and y up, as on paper.
    for height in [-0.55, 0.45] {
        for (x, z) in ASIDE.into_iter().take(if few { 8 } else { 4 }) {
            cameras.push(fitted(bounds, DVec3::new(x, height, z)));
        }
    }

    // Straight at each side of the scene: where a room is open, this looks into it as into a stage.
    let sides = [DVec3::NEG_Z, DVec3::Z, DVec3::NEG_X, DVec3::X, DVec3::NEG_Y, DVec3::Y];
    cameras.extend(sides.map(|forward| fitted(bounds, forward)));

    // From within: a little above half the height, from the corners and sides before the middle, towards the middle
    // and all around.
    let places: &[f64] = if few { &[0.06, 0.94, 0.27, 0.73, 0.5] } else { &[0.06, 0.94, 0.5] };
    let headings = if few { 8 } else { 4 };
    let centre = bounds.at(DVec3::new(0.5, 0.42, 0.5));
    for &x in places {
        for &z in places {
            let eye = bounds.at(DVec3::new(x, 0.55, z));
            let inward = centre - eye;
            if inward.with_y(0.0).length() > 1e-3 * bounds.size() {
                cameras.push(camera(eye, inward, INSIDE));
            }
            if few || (x, z) == (0.5, 0.5) {
                for heading in 0..headings {
                    let (sin, cos) =
                        (std::f64::consts::TAU * f64::from(heading) / f64::from(headings)).sin_cos();
                    cameras.push(camera(eye, DVec3::new(sin, -0.08, -cos), INSIDE));
                }
            }
        }
    }
    cameras
}

/// A camera outside that looks along `forward` and holds the whole of `bounds` tightly in its window.
fn fitted(bounds: &Bounds, forward: DVec3) -> Camera {
    let mut camera = camera(bounds.centre(), forward, OUTSIDE);
    let local = bounds.corners().map(|corner| {
        let p = corner - bounds.centre();
        DVec3::new(p.dot(camera.right), p.dot(camera.up), p.dot(camera.forward))
    });
    // For each edge of the window, the plane through the eye that just holds every corner. Two opposite planes cross
    // in a line, which says how far back and how far aside the eye must be; the farther back of the two pairs rules.
    let pair = |axis: fn(DVec3) -> f64, half: f64| {
        let greatest =
            |sign: f64| local.iter().map(|&p| sign * axis(p) - half * p.z).fold(f64::NEG_INFINITY, f64::max);
        let (upper, lower) = (greatest(1.0), greatest(-1.0));
        ((upper + lower) / (2.0 * half), (upper - lower) / 2.0)
    };
    let (back_x, aside) = pair(|p| p.x, OUTSIDE[0]);
    let (back_y, above) = pair(|p| p.y, OUTSIDE[1]);
    // A hair's breadth of air around it; and never inside the scene, however flat it is.
    let nearest = local.iter().map(|p| -p.z).fold(0.0, f64::max) + 1e-3 * bounds.size();
    let back = (back_x.max(back_y) * 1.02).max(nearest);
    camera.eye += camera.right * aside + camera.up * above - camera.forward * back;
    camera
}

/// Takes small pictures and judges them.
struct Stamps<'a> {
    facets: &'a Facets,
    buffer: ItemBuffer,
    /// Each facet's area.
    area: Vec<f64>,
    /// What showing a unit of a facet's area is worth: half by the share of all area, half by the share of its
    /// surface's area, so that small things count. Everything shown is worth 1.
    worth: Vec<f64>,
    /// What is nearer than this is in the way.
    too_near: f64,
    /// What a back is worth beside a front.
    back_worth: f64,
    /// For each facet, the area of it that the picture at hand shows.
    seen: Vec<f64>,
}

impl<'a> Stamps<'a> {
    fn new(scene: &Scene, facets: &'a Facets, bounds: &Bounds) -> Self {
        let area: Vec<f64> = facets
            .as_slice()
            .iter()
            .map(|facet| {
                let whole = facet.u.cross(facet.v).length();
                if facet.shape == FacetShape::Triangle { whole / 2.0 } else { whole }
            })
            .collect();
        let total: f64 = area.iter().sum();
        let mut of_surface = vec![0.0; scene.surfaces.len()];
        for (facet, area) in facets.as_slice().iter().zip(&area) {
            of_surface[facet.surface as usize] += area;
        }
        let things = of_surface.iter().filter(|&&area| area > 0.0).count() as f64;
        let worth = facets
            .as_slice()
            .iter()
            .map(|facet| {
                0.5 / total + 0.5 / (things * of_surface[facet.surface as usize].max(f64::MIN_POSITIVE))
            })
            .collect();
        Self {
            facets,
            buffer: ItemBuffer::default(),
            worth,
            seen: vec![0.0; area.len()],
            area,
            too_near: 0.04 * bounds.size(),
            back_worth: if scene.back_faces == BackFaces::Lit { LIT_BACK } else { 0.0 },
        }
    }

    /// How good a camera is: how much of the scene's front it shows, less what shows backs or stands in the way,
    /// and somewhat less where much of the picture is empty.
    fn merit(&mut self, camera: &Camera) -> f64 {
        let view = View {
            eye: camera.eye,
            right: camera.right,
            up: camera.up,
            forward: camera.forward,
            horizontal: camera.horizontal,
            vertical: [camera.vertical[1], camera.vertical[0]],
            width: STAMP[0],
            height: STAMP[1],
            near: 0.0,
            far: f64::INFINITY,
        };
        self.buffer.draw(self.facets, &view);
        let cell = (view.cell_width() * view.cell_height()).abs();
        let (mut shows, mut hindered) = (0.0, 0.0);
        let cells = (0..view.height).flat_map(|y| (0..view.width).map(move |x| (x, y)));
        for (x, y) in cells.clone() {
            let (number, inverse_depth) = (self.buffer.facets(y)[x], self.buffer.inverse_depths(y)[x]);
            if number == NOTHING {
                continue;
            }
            let direction = view.direction(x as f64, y as f64);
            let depth = 1.0 / f64::from(inverse_depth);
            let facing = -self.facets[number].normal.dot(direction);
            let mut worth = if facing > 0.0 { 1.0 } else { self.back_worth };
            if depth * direction.length() < self.too_near {
                worth = 0.0;
            }
            shows += worth;
            hindered += 1.0 - worth;
            // The cell, at distance 1 along `forward`, thrown onto the surface along the ray: grazing angles count
            // for much, so no facet counts for more than it has.
            self.seen[number as usize] += worth * cell * depth * depth / facing.abs().max(1e-9);
        }
        let mut shown = 0.0;
        for (x, y) in cells {
            let number = self.buffer.facets(y)[x];
            if number != NOTHING {
                let number = number as usize;
                shown += self.seen[number].min(self.area[number]) * self.worth[number];
                self.seen[number] = 0.0;
            }
        }
        let count = (STAMP[0] * STAMP[1]) as f64;
        let clear = shows / f64::max(shows + hindered, 1.0);
        shown * clear * (shows / count).sqrt()
    }
}
