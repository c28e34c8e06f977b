//! How the mouse and the keys move the camera. No window in here: angles, lengths and points in, a camera out.
//!
//! What is under the pointer stays under it, as far as a gesture allows: a pan or a look-around carries the picture
//! along, a turn revolves about the point that was grasped, a zoom goes towards what is pointed at. The horizon stays
//! as level as the author's camera had it, and the poles are a stop, not a somersault.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;
use radiosity::scene::Camera;

use super::projection::Bounds;

/// The nearest that zooming goes to what it goes to, as a share of the scene's radius.
const NEAREST: f64 = 2e-3;
/// The farthest that zooming goes away, likewise.
const FARTHEST: f64 = 1e3;
/// How long flying takes to reach its speed, and to stop. \[s\]
const FLY_SMOOTHING: f64 = 0.09;
/// How long a jump to another view takes. \[s\]
const GLIDE: f64 = 0.25;
/// What framing leaves free around the edge.
const FRAME_MARGIN: f64 = 1.06;

/// Which way the camera looks: `yaw` about the world's y, 0 along -z; `pitch` above the horizon; `roll` about the line
/// of sight. \[radians\]
#[derive(Clone, Copy, Debug, PartialEq)]
struct Attitude {
    yaw: f64,
    pitch: f64,
    roll: f64,
}

impl Attitude {
    fn of(camera: &Camera) -> Self {
        let f = camera.forward;
        let pitch = f.y.clamp(-1.0, 1.0).asin();
        if f.x.hypot(f.z) < 1e-6 {
            // Straight up or down, where the top of the picture tells the heading.
            let up = if f.y < 0.0 { camera.up } else { -camera.up };
            return Self { yaw: up.x.atan2(-up.z), pitch, roll: 0.0 };
        }
        let yaw = f.x.atan2(-f.z);
        let level = Self { yaw, pitch, roll: 0.0 };
        let [right, up, _] = level.axes();
        Self { roll: camera.right.dot(up).atan2(camera.right.dot(right)), ..level }
    }

    /// Right, up, forward.
    fn axes(&self) -> [DVec3; 3] {
        let (sin_yaw, cos_yaw) = self.yaw.sin_cos();
        let (sin_pitch, cos_pitch) = self.pitch.sin_cos();
        let (sin_roll, cos_roll) = self.roll.sin_cos();
        let forward = DVec3::new(sin_yaw * cos_pitch, sin_pitch, -cos_yaw * cos_pitch);
        let level = DVec3::new(cos_yaw, 0.0, sin_yaw);
        let above = level.cross(forward);
        [level * cos_roll + above * sin_roll, above * cos_roll - level * sin_roll, forward]
    }

    fn turned(self, yaw: f64, pitch: f64) -> Self {
        Self {
            yaw: (self.yaw + yaw).rem_euclid(2.0 * PI),
            pitch: (self.pitch + pitch).clamp(-FRAC_PI_2, FRAC_PI_2),
            ..self
        }
    }
}

/// A jump under way.
#[derive(Clone, Debug)]
struct Glide {
    from: Camera,
    to: Camera,
    /// 0..1.
    done: f64,
}

/// The camera, and what moves it.
#[derive(Clone, Debug)]
pub(super) struct CameraControl {
    camera: Camera,
    home: Camera,
    bounds: Bounds,
    /// What turning goes about.
    pivot: DVec3,
    /// Of flying. \[lengths / s\]
    velocity: DVec3,
    glide: Option<Glide>,
    clip: Clip,
}

/// The author's clipping planes, which cut the scene open for whoever looks in from outside. They stay where they are
/// while the eye comes nearer or goes back, and are forgotten by who flies through them.
#[derive(Clone, Copy, Debug)]
struct Clip {
    near: f64,
    far: f64,
    /// How far the eye has come along its line of sight.
    advance: f64,
}

impl CameraControl {
    /// At `home`, in a scene within `bounds`.
    pub(super) fn new(home: Camera, bounds: Bounds) -> Self {
        let clip = Clip { near: home.near, far: home.far, advance: 0.0 };
        let mut control = Self {
            camera: home,
            home,
            bounds,
            pivot: bounds.centre(),
            velocity: DVec3::ZERO,
            glide: None,
            clip,
        };
        control.jump(home);
        control
    }

    pub(super) fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Another scene, with the camera as it is; `home` is where Home leads from now on.
    pub(super) fn set_scene(&mut self, home: Camera, bounds: Bounds) {
        (self.home, self.bounds) = (home, bounds);
    }

    /// Look through `camera` at once, exactly.
    pub(super) fn jump(&mut self, camera: Camera) {
        self.camera = camera;
        self.clip = Clip { near: camera.near, far: camera.far, advance: 0.0 };
        self.glide = None;
        self.velocity = DVec3::ZERO;
        // The middle of what is seen, about as far away as the scene's centre.
        let [x, y] = [camera.horizontal, camera.vertical].map(|[a, b]| (a + b) * 0.5);
        let distance = (self.bounds.centre() - camera.eye).dot(camera.forward);
        let distance = distance.max(0.1 * self.bounds.radius());
        self.pivot = camera.eye + (camera.forward + camera.right * x + camera.up * y) * distance;
    }

    /// Go to `camera` in a quarter of a second.
    pub(super) fn glide_to(&mut self, camera: Camera) {
        self.glide = Some(Glide { from: self.camera, to: camera, done: 0.0 });
        self.velocity = DVec3::ZERO;
    }

    /// Where the first view was.
    pub(super) fn home(&self) -> &Camera {
        &self.home
    }

    /// Turn about `point` from now on.
    pub(super) fn grasp(&mut self, point: Option<DVec3>) {
        self.pivot = point.filter(|point| point.is_finite()).unwrap_or_else(|| self.bounds.centre());
        self.stop();
    }

    /// A hand on the mouse ends whatever the camera does by itself.
    fn stop(&mut self) {
        if let Some(glide) = self.glide.take() {
            // As far as it came; the lens and clipping are those of where it was going.
            self.clip = Clip { near: glide.to.near, far: glide.to.far, advance: 0.0 };
        }
    }

    /// Turn the scene with the hand: the camera about the pivot, by angles. \[radians\]
    pub(super) fn orbit(&mut self, yaw: f64, pitch: f64) {
        self.stop();
        let before = self.camera;
        self.turn(yaw, pitch);
        let from_pivot = before.eye - self.pivot;
        let local = [before.right, before.up, before.forward].map(|axis| from_pivot.dot(axis));
        self.camera.eye = self.pivot
            + self.camera.right * local[0]
            + self.camera.up * local[1]
            + self.camera.forward * local[2];
    }

    /// Turn the head, by angles. \[radians\]
    pub(super) fn look_around(&mut self, yaw: f64, pitch: f64) {
        self.stop();
        self.turn(yaw, pitch);
    }

    fn turn(&mut self, yaw: f64, pitch: f64) {
        let attitude = Attitude::of(&self.camera).turned(yaw, pitch);
        [self.camera.right, self.camera.up, self.camera.forward] = attitude.axes();
    }

    /// Move the camera in its own plane so that what lies at the pivot's depth goes from direction `from` to direction
    /// `to` (both with 1 along `forward`).
    pub(super) fn pan(&mut self, from: DVec3, to: DVec3) {
        self.stop();
        let depth = (self.pivot - self.camera.eye).dot(self.camera.forward);
        let shift = (from - to) * depth.max(NEAREST * self.bounds.radius());
        self.camera.eye += shift;
        self.pivot += shift;
    }

    /// The distance to `point` becomes `factor` times what it is: less than 1 goes nearer, and never through. Where the
    /// pointer meets nothing, the point lies along its `direction` as deep as the pivot.
    pub(super) fn zoom(&mut self, point: Option<DVec3>, direction: DVec3, factor: f64) {
        self.stop();
        if !(factor.is_finite() && factor > 0.0) {
            return;
        }
        let radius = self.bounds.radius();
        let point = point.filter(|point| point.is_finite()).unwrap_or_else(|| {
            let depth = (self.pivot - self.camera.eye).dot(self.camera.forward);
            self.camera.eye + direction * depth.max(0.05 * radius)
        });
        let away = self.camera.eye - point;
        let distance = away.length();
        let (least, most) = (NEAREST * radius, FARTHEST * radius);
        let wanted =
            if factor < 1.0 { (distance * factor).max(least.min(distance)) } else { distance * factor };
        let wanted = if factor > 1.0 { wanted.min(most.max(distance)) } else { wanted };
        if distance > 0.0 {
            self.advance(away * (wanted / distance - 1.0));
            self.pivot = point;
        }
    }

    /// Move the eye, the clipping planes staying behind.
    fn advance(&mut self, shift: DVec3) {
        self.camera.eye += shift;
        let clip = &mut self.clip;
        clip.advance = (clip.advance + shift.dot(self.camera.forward)).min(clip.near);
        self.camera.near = if clip.near > 0.0 { (clip.near - clip.advance).max(0.0) } else { 0.0 };
        self.camera.far = clip.far.max(clip.far - clip.advance);
    }

    /// Fly for `seconds`: `wish` is to the right, up and forward, each -1, 0 or 1. Whether it still moves.
    pub(super) fn fly(&mut self, wish: DVec3, fast: bool, seconds: f64) -> bool {
        let camera = &self.camera;
        if wish != DVec3::ZERO {
            self.glide = None;
        } else if self.velocity == DVec3::ZERO {
            return false;
        }
        // A room in some four seconds, or in one.
        let speed = self.bounds.radius() * if fast { 2.0 } else { 0.5 };
        let wanted = camera.right * wish.x + camera.up * wish.y + camera.forward * wish.z;
        let wanted = wanted.normalize_or_zero() * speed;
        let seconds = seconds.clamp(0.0, 0.1);
        self.velocity += (wanted - self.velocity) * (1.0 - (-seconds / FLY_SMOOTHING).exp());
        if wish == DVec3::ZERO && self.velocity.length() < 1e-3 * speed {
            self.velocity = DVec3::ZERO;
        }
        let shift = self.velocity * seconds;
        self.advance(shift);
        self.pivot += shift;
        if self.camera.near == 0.0 {
            // Through the wall: it closes behind.
            self.clip.near = 0.0;
            self.clip.advance = 0.0;
        }
        self.velocity != DVec3::ZERO
    }

    /// Go on with a jump under way. Whether it still moves.
    pub(super) fn tick(&mut self, seconds: f64) -> bool {
        let Some(glide) = &mut self.glide else { return false };
        glide.done += seconds.clamp(0.0, 0.1) / GLIDE;
        if glide.done >= 1.0 {
            let to = glide.to;
            self.jump(to);
        } else {
            let t = glide.done * glide.done * (3.0 - 2.0 * glide.done);
            self.camera = between(&glide.from, &glide.to, t);
        }
        true
    }

    /// From where, looking the same way, all of `points` are in view, just; through a window of the shape of
    /// `aspect`, width over height. What the author cut away in front stays cut away; a partial viewport is let go.
    pub(super) fn framing(&self, points: &[DVec3], aspect: f64) -> Camera {
        let mut camera = self.glide.as_ref().map_or(self.camera, |glide| glide.to);
        camera.viewport = [0.0, 1.0, 0.0, 1.0];
        let bounds = Bounds::around(points.iter().copied());
        if points.is_empty() {
            return camera;
        }
        // The window that is seen, wider than the camera's own where the picture is, then a little smaller for a margin.
        let centre = [camera.horizontal, camera.vertical].map(|[a, b]| (a + b) * 0.5);
        let half = [camera.horizontal, camera.vertical].map(|[a, b]| (b - a).abs() * 0.5);
        let stretch = aspect / (half[0] / half[1]);
        let half = [half[0] * stretch.max(1.0), half[1] * (1.0 / stretch).max(1.0)];
        let axes = [camera.right, camera.up];
        let mut back = f64::INFINITY;
        let mut sides = [[0.0; 2]; 2];
        let window = [0, 1].map(|k| {
            let reach = half[k] / FRAME_MARGIN;
            [centre[k] - reach, centre[k] + reach]
        });
        for k in 0..2 {
            // x - e <= r (z - d) and x - e >= l (z - d) for every point; both tight where the eye is farthest forward.
            let [l, r] = window[k];
            let at = |slope: f64| points.iter().map(move |p| p.dot(axes[k]) - slope * p.dot(camera.forward));
            sides[k] = [at(r).fold(f64::NEG_INFINITY, f64::max), at(l).fold(f64::INFINITY, f64::min)];
            back = back.min((sides[k][1] - sides[k][0]) / (r - l));
        }
        // Not closer than so that a single point still has something around it.
        let nearest = points.iter().map(|p| p.dot(camera.forward)).fold(f64::INFINITY, f64::min);
        let back = back.min(nearest - NEAREST * self.bounds.radius().max(bounds.radius()));
        let across =
            [0, 1].map(|k| (sides[k][0] + window[k][1] * back + sides[k][1] + window[k][0] * back) * 0.5);
        let eye = camera.right * across[0] + camera.up * across[1] + camera.forward * back;
        let advance = (eye - camera.eye).dot(camera.forward);
        camera.eye = eye;
        if camera.near > 0.0 {
            camera.near = (camera.near - advance).max(0.0);
        }
        camera.far = camera.far.max(camera.far - advance);
        camera
    }

    /// From where `point` is in the middle of the window and what lies within `reach` of it is in view, through a window
    /// of the shape of `aspect`; along the line from `point` to the eye, and not farther than now where `only_nearer`.
    pub(super) fn looking_at(&self, point: DVec3, reach: f64, aspect: f64, only_nearer: bool) -> Camera {
        let mut camera = self.camera;
        let away = camera.eye - point;
        let distance = away.length();
        let shape = |[a, b]: [f64; 2]| (b - a).abs();
        let (across, upward) = (shape(camera.horizontal), shape(camera.vertical));
        let half = 0.5 * if aspect > across / upward { upward } else { across.min(across / aspect) };
        let wanted = (reach * FRAME_MARGIN / half).max(NEAREST * self.bounds.radius());
        let wanted = if only_nearer { wanted.min(distance) } else { wanted };
        if !(distance > 0.0 && wanted.is_finite()) {
            return camera;
        }
        camera.eye = point + away * (wanted / distance);
        // The middle of an off-axis window is not where the camera looks: turn by the angle between the two.
        let [x, y] = [camera.horizontal, camera.vertical].map(|[a, b]| (a + b) * 0.5);
        let middle = (camera.forward + camera.right * x + camera.up * y).normalize();
        let heading = |forward: DVec3| Attitude::of(&Camera { forward, ..camera });
        let (from, to) = (heading(middle), heading(-away / distance));
        let attitude = Attitude::of(&camera).turned(to.yaw - from.yaw, to.pitch - from.pitch);
        [camera.right, camera.up, camera.forward] = attitude.axes();
        camera.near = (camera.near - (distance - wanted)).max(0.0);
        camera
    }

    /// The box about the scene.
    pub(super) fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    /// The vertical angle of view. \[radians\]
    pub(super) fn field_of_view(&self) -> f64 {
        let [low, high] = self.camera.vertical;
        (high.atan() - low.atan()).abs()
    }

    /// A window of this vertical angle, about the line of sight. \[radians\]
    pub(super) fn set_field_of_view(&mut self, angle: f64) {
        let shape = |[a, b]: [f64; 2]| (b - a).abs();
        let ratio = shape(self.camera.horizontal) / shape(self.camera.vertical);
        let half = (angle.clamp(0.01, 2.8) * 0.5).tan();
        self.camera.vertical = [-half, half];
        self.camera.horizontal = [-half * ratio, half * ratio];
    }
}

/// `t` of the way from one camera to another, turning the shorter way.
fn between(from: &Camera, to: &Camera, t: f64) -> Camera {
    let mix = |a: f64, b: f64| if b.is_finite() && a.is_finite() { a + (b - a) * t } else { b };
    let (a, b) = (Attitude::of(from), Attitude::of(to));
    let angle = |a: f64, b: f64| a + ((b - a + PI).rem_euclid(2.0 * PI) - PI) * t;
    let attitude =
        Attitude { yaw: angle(a.yaw, b.yaw), pitch: mix(a.pitch, b.pitch), roll: angle(a.roll, b.roll) };
    let [right, up, forward] = attitude.axes();
    let pair = |a: [f64; 2], b: [f64; 2]| [mix(a[0], b[0]), mix(a[1], b[1])];
    Camera {
        eye: from.eye.lerp(to.eye, t),
        right,
        up,
        forward,
        horizontal: pair(from.horizontal, to.horizontal),
        vertical: pair(from.vertical, to.vertical),
        near: mix(from.near, to.near),
        far: to.far.max(from.far),
        viewport: to.viewport,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// At `eye`, looking level along -z, and seeing a little more to the right than to the left.
    fn camera(eye: [f64; 3]) -> Camera {
        Camera {
            eye: DVec3::from(eye),
            forward: DVec3::NEG_Z,
            right: DVec3::X,
            up: DVec3::Y,
            horizontal: [-0.4, 0.6],
            vertical: [-0.4, 0.35],
            near: 0.0,
            far: f64::INFINITY,
            viewport: [0.0, 1.0, 0.0, 1.0],
        }
    }

    fn control() -> CameraControl {
        let bounds = Bounds { low: DVec3::splat(-2.0), high: DVec3::new(2.0, 1.0, 3.0) };
        CameraControl::new(camera([0.5, 0.2, 9.0]), bounds)
    }

    fn is_rigid(camera: &Camera) -> bool {
        let unit = |v: DVec3| (v.length() - 1.0).abs() < 1e-9;
        unit(camera.right)
            && unit(camera.up)
            && unit(camera.forward)
            && camera.right.abs_diff_eq(camera.forward.cross(camera.up), 1e-9)
    }

    /// Where the picture shows `point`: window coordinates at distance 1.
    fn seen_at(camera: &Camera, point: DVec3) -> [f64; 2] {
        let p = point - camera.eye;
        [p.dot(camera.right), p.dot(camera.up)].map(|value| value / p.dot(camera.forward))
    }

    #[test]
    fn a_new_camera_is_the_authors_to_the_bit() {
        let control = control();
        assert_eq!(control.camera(), &camera([0.5, 0.2, 9.0]));
    }

    proptest! {
        #[test]
        fn orbiting_keeps_the_pivot_where_it_is_seen(
            yaw in -3.0..3.0, pitch in -0.7..0.7, x in -1.0..1.0, y in -1.0..1.0, z in -1.0..1.0,
        ) {
            let mut control = control();
            let pivot = DVec3::new(x, y, z);
            let before = seen_at(control.camera(), pivot);
            let distance = control.camera().eye.distance(pivot);
            control.grasp(Some(pivot));
            control.orbit(yaw, pitch);
            let after = seen_at(control.camera(), pivot);
            prop_assert!((0..2).all(|k| (before[k] - after[k]).abs() < 1e-9));
            prop_assert!((control.camera().eye.distance(pivot) - distance).abs() < 1e-9);
            prop_assert!(is_rigid(control.camera()));
            prop_assert!(control.camera().right.y.abs() < 1e-12, "the horizon is level");
        }

        #[test]
        fn the_poles_stop_and_do_not_flip(pitch in 1.6..100.0, sign in prop::bool::ANY, yaw in -9.0..9.0) {
            let mut control = control();
            let sign = if sign { 1.0 } else { -1.0 };
            control.orbit(yaw, 0.0);
            let heading = Attitude::of(control.camera()).yaw;
            for _ in 0..5 {
                control.orbit(0.0, sign * pitch);
                prop_assert!(control.camera().forward.y * sign > 0.999_999);
                prop_assert!(is_rigid(control.camera()));
            }
            control.orbit(0.0, -0.5 * sign);
            let turned = (Attitude::of(control.camera()).yaw - heading + PI).rem_euclid(2.0 * PI) - PI;
            prop_assert!(turned.abs() < 1e-6, "the heading survives the pole: {turned}");
            prop_assert!(control.camera().up.y > 0.0, "and nothing is upside down");
        }

        #[test]
        fn panning_keeps_what_is_grasped_under_the_pointer(
            from in prop::array::uniform2(-0.3..0.3), to in prop::array::uniform2(-0.3..0.3), z in -2.0..2.0,
        ) {
            let mut control = control();
            let direction = |camera: &Camera, [x, y]: [f64; 2]| camera.right * x + camera.up * y + camera.forward;
            let (a, b) = (direction(control.camera(), from), direction(control.camera(), to));
            let grasped = control.camera().eye + a * (9.0 - z);
            control.grasp(Some(grasped));
            control.pan(a, b);
            let seen = seen_at(control.camera(), grasped);
            prop_assert!((0..2).all(|k| (seen[k] - to[k]).abs() < 1e-9), "{seen:?} {to:?}");
        }

        #[test]
        fn zooming_keeps_the_point_in_place_and_never_passes_it(
            factors in prop::collection::vec(0.2..1.2_f64, 1..60), x in -1.0..1.0, y in -1.0..1.0,
        ) {
            let mut control = control();
            let point = DVec3::new(x, y, 0.3);
            let before = seen_at(control.camera(), point);
            for factor in factors {
                control.zoom(Some(point), DVec3::NEG_Z, factor);
                prop_assert!((point - control.camera().eye).dot(control.camera().forward) > 0.0);
            }
            let after = seen_at(control.camera(), point);
            prop_assert!((0..2).all(|k| (before[k] - after[k]).abs() < 1e-6));
        }

        #[test]
        fn framing_shows_all_and_wastes_little(
            yaw in -3.0..3.0, pitch in -1.5..1.5, aspect in 0.3..3.0, z in -50.0..50.0,
        ) {
            let mut control = control();
            control.look_around(yaw, pitch);
            let points = Bounds { low: DVec3::new(-1.0, -2.0, z), high: DVec3::new(2.0, 0.0, z + 1.0) }.corners();
            let framed = control.framing(&points, aspect);
            prop_assert_eq!(framed.forward, control.camera().forward);
            let own: f64 = 1.0 / 0.75;
            let [mut least, mut slack] = [f64::INFINITY; 2];
            for (range, seen, stretch) in
                [(framed.horizontal, 0, (aspect / own).max(1.0)), (framed.vertical, 1, (own / aspect).max(1.0))]
            {
                let centre = (range[0] + range[1]) * 0.5;
                let half = (range[1] - range[0]) * 0.5 * stretch;
                let reach = points.map(|p| {
                    least = least.min((p - framed.eye).dot(framed.forward));
                    (seen_at(&framed, p)[seen] - centre).abs() / half
                });
                let most = reach.into_iter().fold(0.0, f64::max);
                prop_assert!(most <= 1.0 / FRAME_MARGIN + 1e-6 || most < 1.0, "{most}");
                slack = slack.min(1.0 - most);
            }
            prop_assert!(least > 0.0);
            prop_assert!(slack < 0.2, "{slack}");
        }
    }

    #[test]
    fn a_tilted_horizon_stays_as_tilted() {
        let mut tilted = camera([0.0, 0.0, 8.0]);
        let (sin, cos) = 0.3_f64.sin_cos();
        (tilted.right, tilted.up) = (DVec3::new(cos, sin, 0.0), DVec3::new(-sin, cos, 0.0));
        let mut control = CameraControl::new(tilted, control().bounds);
        control.orbit(1.0, 0.4);
        assert!((Attitude::of(control.camera()).roll - 0.3).abs() < 1e-9);
        assert!(is_rigid(control.camera()));
    }

    #[test]
    fn looking_straight_down_has_a_heading() {
        let down = Camera { forward: DVec3::NEG_Y, up: DVec3::NEG_Z, ..camera([0.0, 9.0, 0.0]) };
        let mut control = CameraControl::new(down, control().bounds);
        control.look_around(0.0, 0.3);
        assert!(control.camera().forward.z < -0.2 && control.camera().right.abs_diff_eq(DVec3::X, 1e-9));
    }

    #[test]
    fn the_authors_clipping_stays_in_place_when_zooming() {
        let cut = Camera { near: 4.0, far: 20.0, ..camera([0.0, 0.0, 9.0]) };
        let mut control = CameraControl::new(cut, control().bounds);
        let plane = |control: &CameraControl| control.camera().eye.z - control.camera().near;
        control.zoom(Some(DVec3::ZERO), DVec3::NEG_Z, 0.8);
        assert!((plane(&control) - 5.0).abs() < 1e-9);
        control.zoom(Some(DVec3::ZERO), DVec3::NEG_Z, 4.0);
        assert!((plane(&control) - 5.0).abs() < 1e-9);
        assert!(control.camera().far > 20.0, "what was seen is still seen");
        control.orbit(0.5, 0.2);
        let near = control.camera().near;
        assert!(near > 4.0);
        // Through it and back again by zooming.
        for factor in [0.1, 10.0] {
            control.zoom(Some(control.pivot), DVec3::NEG_Z, factor);
        }
        assert!(control.camera().near > 0.0);
    }

    #[test]
    fn flying_through_the_cut_closes_it() {
        let cut = Camera { near: 4.0, ..camera([0.0, 0.0, 9.0]) };
        let mut control = CameraControl::new(cut, control().bounds);
        for _ in 0..100 {
            control.fly(DVec3::Z, true, 0.05);
        }
        assert_eq!(control.camera().near, 0.0);
        for _ in 0..100 {
            control.fly(DVec3::NEG_Z, true, 0.05);
        }
        assert_eq!(control.camera().near, 0.0);
    }

    #[test]
    fn flying_starts_and_stops_softly() {
        let mut control = control();
        let start = control.camera().eye;
        assert!(!control.fly(DVec3::ZERO, false, 0.016));
        assert!(control.fly(DVec3::Z, false, 0.016));
        let first = control.camera().eye.distance(start);
        let mut steps = 0;
        while control.fly(DVec3::ZERO, false, 0.016) {
            steps += 1;
            assert!(steps < 200);
        }
        let radius = control.bounds.radius();
        assert!(first > 0.0 && first < 0.016 * radius);
        assert!(control.camera().eye.distance(start) < 0.1 * radius);
    }

    #[test]
    fn a_jump_arrives_exactly() {
        let mut control = control();
        control.orbit(2.0, 0.5);
        control.glide_to(*control.home());
        let mut steps = 0;
        while control.tick(0.02) {
            assert!(is_rigid(control.camera()));
            steps += 1;
            assert!(steps < 100);
        }
        assert_eq!(control.camera(), control.home());
    }

    #[test]
    fn a_new_angle_of_view_straightens_the_window() {
        let mut control = control();
        control.set_field_of_view(1.0);
        assert!((control.field_of_view() - 1.0).abs() < 1e-12);
        let camera = control.camera();
        assert_eq!(camera.horizontal[0], -camera.horizontal[1]);
        let ratio = camera.horizontal[1] / camera.vertical[1];
        assert!((ratio - 1.0 / 0.75).abs() < 1e-12);
    }
}
