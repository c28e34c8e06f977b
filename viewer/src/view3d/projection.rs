//! From the engine's view to the GPU's clip space.

use glam::{DVec3, DVec4};
use radiosity::visibility::{Facets, View};

/// The nearest that is drawn, as a share of the farthest, where the camera does not say: a depth buffer of 24 bits then
/// tells apart what lies 1/8000 of the scene apart at its far end.
const NEAREST: f64 = 5e-4;

/// The box about a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bounds {
    pub(super) low: DVec3,
    pub(super) high: DVec3,
}

impl Bounds {
    /// Of the finite corners; a point where there is none.
    pub(super) fn of(facets: &Facets) -> Self {
        let corners = facets.as_slice().iter().flat_map(|facet| {
            let (corners, count) = facet.corners();
            corners.into_iter().take(count)
        });
        Self::around(corners)
    }

    /// Of the finite ones of `points`.
    pub(super) fn around(points: impl IntoIterator<Item = DVec3>) -> Self {
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let finite = points.into_iter().filter(|point| point.is_finite());
        let (low, high) = finite.fold(none, |(low, high), point| (low.min(point), high.max(point)));
        if low.x <= high.x { Self { low, high } } else { Self { low: DVec3::ZERO, high: DVec3::ZERO } }
    }

    pub(super) fn centre(&self) -> DVec3 {
        (self.low + self.high) * 0.5
    }

    /// Half the diagonal; never 0.
    pub(super) fn radius(&self) -> f64 {
        let radius = (self.high - self.low).length() * 0.5;
        if radius > 0.0 && radius.is_finite() { radius } else { 1.0 }
    }

    pub(super) fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|k| {
            let pick = |bit: usize, low: f64, high: f64| if k >> bit & 1 == 0 { low } else { high };
            DVec3::new(
                pick(0, self.low.x, self.high.x),
                pick(1, self.low.y, self.high.y),
                pick(2, self.low.z, self.high.z),
            )
        })
    }
}

/// What the vertex shader multiplies by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Projection {
    /// Clip space from positions relative to the scene's centre, column by column.
    pub(super) clip_from_scene: [f32; 16],
    /// Whether the picture mirrors the world, so that fronts run clockwise in it.
    pub(super) mirrored: bool,
}

impl Projection {
    /// The projection of `view`, its depths spread over `bounds` as far as its own clipping planes allow.
    pub(super) fn new(view: &View, bounds: &Bounds) -> Self {
        let depths = bounds.corners().map(|corner| (corner - view.eye).dot(view.forward));
        let farthest = depths.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let nearest = depths.into_iter().fold(f64::INFINITY, f64::min);
        // A little more than the box, so that rounding clips nothing that lies in its sides.
        let far = (farthest + 1e-3 * bounds.radius()).min(view.far).max(1e-9 * bounds.radius());
        let near = (nearest - 1e-3 * bounds.radius()).max(NEAREST * far).max(view.near).min(far * 0.999_999);

        let [left, right] = view.horizontal;
        let [top, bottom] = view.vertical;
        let (across, upward) = (right - left, top - bottom);
        let x = view.right * (2.0 / across) - view.forward * ((right + left) / across);
        let y = view.up * (2.0 / upward) - view.forward * ((top + bottom) / upward);
        let z = view.forward * ((far + near) / (far - near));
        let shift = bounds.centre() - view.eye;
        let rows = [
            x.extend(x.dot(shift)),
            y.extend(y.dot(shift)),
            z.extend(z.dot(shift) - 2.0 * far * near / (far - near)),
            view.forward.extend(view.forward.dot(shift)),
        ];
        let handed = view.right.dot(view.forward.cross(view.up));
        Self { clip_from_scene: columns(rows), mirrored: handed * across * upward < 0.0 }
    }
}

fn columns(rows: [DVec4; 4]) -> [f32; 16] {
    std::array::from_fn(|k| rows[k % 4][k / 4] as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view() -> View {
        View {
            eye: DVec3::new(1.0, 2.0, 9.0),
            right: DVec3::X,
            up: DVec3::Y,
            forward: DVec3::NEG_Z,
            horizontal: [-0.2, 0.6],
            vertical: [0.5, -0.1],
            width: 80,
            height: 60,
            near: 0.0,
            far: f64::INFINITY,
        }
    }

    fn bounds() -> Bounds {
        Bounds { low: DVec3::new(-1.0, -2.0, -3.0), high: DVec3::new(3.0, 4.0, 5.0) }
    }

    fn project(projection: &Projection, point: DVec3) -> DVec4 {
        let point = point.extend(1.0).as_vec4();
        let m = projection.clip_from_scene;
        let row = |r: usize| (0..4).map(|c| f64::from(m[4 * c + r] * point[c])).sum::<f64>();
        DVec4::new(row(0), row(1), row(2), row(3))
    }

    #[test]
    fn a_point_lands_in_the_cell_that_looks_at_it() {
        let (view, bounds) = (view(), bounds());
        let projection = Projection::new(&view, &bounds);
        for (x, y, depth) in [(-0.5, -0.5, 5.0), (79.5, 59.5, 7.0), (20.0, 33.0, 11.0)] {
            let point = view.eye + view.direction(x, y) * depth;
            let clip = project(&projection, point - bounds.centre());
            let column = (clip.x / clip.w * 0.5 + 0.5) * 80.0 - 0.5;
            let row = (0.5 - clip.y / clip.w * 0.5) * 60.0 - 0.5;
            assert!((column - x).abs() < 1e-4 && (row - y).abs() < 1e-4, "{column} {row}");
            assert!((clip.w - depth).abs() < 1e-5 && clip.z.abs() <= clip.w);
        }
        assert!(!projection.mirrored);
        assert!(Projection::new(&View { horizontal: [0.6, -0.2], ..view }, &bounds).mirrored);
    }

    #[test]
    fn the_whole_scene_lies_between_the_planes() {
        let bounds = bounds();
        for distance in [6.0, 20.0, 1e4] {
            let eye = bounds.centre() + DVec3::Z * distance;
            let projection = Projection::new(&View { eye, ..view() }, &bounds);
            for corner in bounds.corners() {
                let clip = project(&projection, corner - bounds.centre());
                assert!(clip.z.abs() <= clip.w, "{distance}: {clip}");
            }
        }
    }

    #[test]
    fn the_cameras_own_planes_clip() {
        let view = View { near: 5.0, far: 9.0, ..view() };
        let projection = Projection::new(&view, &bounds());
        let inside = |depth: f64| {
            let clip = project(&projection, view.eye + view.forward * depth - bounds().centre());
            clip.z.abs() <= clip.w
        };
        assert!(!inside(4.99) && inside(5.01) && inside(8.99) && !inside(9.01));
    }

    #[test]
    fn nothing_at_all_is_still_a_projection() {
        let none = Bounds::around([]);
        for eye in [DVec3::ZERO, DVec3::ONE, DVec3::NEG_Z * 1e6] {
            let projection = Projection::new(&View { eye, ..view() }, &none);
            assert!(projection.clip_from_scene.iter().all(|value| value.is_finite()), "{projection:?}");
        }
    }
}
