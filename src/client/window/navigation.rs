//! Camera moves: pure functions from a pose and a gesture to the next pose. Their history stands in
//! [`history`](crate::client::window::history).
//!
//! Every move is relative to the distance between eye and target, so that a scene in millimetres feels like one in
//! kilometres; scaling a scene by a power of two scales every pose exactly. A move whose result would not be finite, or
//! whose eye would fall onto its target, leaves the pose as it is.

use std::f64::consts::PI;

use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};

/// Least and greatest field of view that a gesture reaches, degrees.
pub const FOV: (f64, f64) = (1.0, 175.0);

/// Least angle to the poles when orbiting and looking, radians; beyond, the picture would turn over.
const POLE: f64 = 0.5 * PI / 180.0;

/// Factor on the distance per step of the wheel.
const DOLLY: f64 = 0.9;

/// Least distance between eye and target, relative to the greatest coordinate: far above the rounding of `f64`.
const NEAREST: f64 = 1e-9;

/// Position and orientation of the camera, in world space.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Pose {
    /// Position.
    pub eye: DVec3,
    /// Point that it looks at and orbits around; its distance from `eye` is the scale of all moves.
    pub target: DVec3,
    /// World direction that stays up, unit length.
    pub up: DVec3,
    /// Field of view in degrees, along the axis that the scene file measures it.
    pub fov: f64,
    /// Whether the file's camera is mirrored (its transform has a negative determinant).
    pub mirrored: bool,
}

/// One move of the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gesture {
    /// Turns around the target, by fractions of the picture's size: the scene follows the cursor, half a turn per picture.
    Orbit(DVec2),
    /// Shifts eye and target in the picture plane, by fractions of the picture's size: a point at the target's distance
    /// stays under the cursor.
    Pan(DVec2),
    /// Moves towards the target; 1 is one step of the wheel.
    Dolly(f64),
    /// Moves freely along camera right, up, forward, in units of the distance to the target.
    Fly(DVec3),
    /// Looks around from a fixed eye, by fractions of the picture's size: the view follows the cursor, two fields of view
    /// per picture.
    Look(DVec2),
    /// Widens the field of view, degrees.
    Fov(f64),
    /// Looks at this point from where it stands, and orbits around it from now on.
    Focus(DVec3),
}

impl Pose {
    /// The pose of a camera transform (Mitsuba's convention: looks along +z, +y up, +x to the left) looking at a point
    /// `distance` ahead (a positive number; anything else counts as 1).
    ///
    /// A camera that stands level on the world's y or z axis keeps that axis up, so that orbiting keeps the horizon
    /// level; any other camera keeps its own up.
    pub fn of(to_world: &DAffine3, fov: f64, distance: f64) -> Self {
        let (eye, axes) = (to_world.translation, to_world.matrix3);
        let forward = axes.z_axis.normalize_or(DVec3::Z);
        let own = axes.y_axis.reject_from_normalized(forward).normalize_or(forward.any_orthonormal_vector());
        let distance = if distance > 0.0 && distance.is_finite() { distance } else { 1.0 };
        Self {
            eye,
            target: eye + forward * distance,
            up: level_axis(own, forward).unwrap_or(own),
            fov,
            mirrored: axes.determinant() < 0.0,
        }
    }

    /// The camera transform, in Mitsuba's convention: columns left, up, forward (rotation, with a mirror image where the
    /// file's camera had one) and the eye.
    pub fn to_world(&self) -> DAffine3 {
        let [right, up, forward] = self.axes();
        let left = if self.mirrored { right } else { -right };
        DAffine3::from_mat3_translation(DMat3::from_cols(left, up, forward), self.eye)
    }

    /// Distance from eye to target.
    pub fn distance(&self) -> f64 {
        self.eye.distance(self.target)
    }

    /// The next pose, in a window as wide as high. See [`Pose::apply_in`].
    #[must_use]
    pub fn apply(&self, gesture: Gesture) -> Self {
        self.apply_in(gesture, DVec2::ONE)
    }

    /// The next pose. `shape` is half the picture's width and height at distance 1, divided by `tan(fov / 2)`: (1, 1/aspect)
    /// where the field of view is measured along x, (aspect, 1) along y; only [`Gesture::Pan`] and [`Gesture::Look`] ask.
    #[must_use]
    pub fn apply_in(&self, gesture: Gesture, shape: DVec2) -> Self {
        let next = match gesture {
            Gesture::Orbit(by) => self.orbit(by),
            Gesture::Pan(by) => self.pan(by, shape),
            Gesture::Dolly(steps) => self.dolly(steps),
            Gesture::Fly(by) => self.shift(by),
            Gesture::Look(by) => self.look(by, shape),
            Gesture::Fov(by) => self.widen(by),
            Gesture::Focus(point) => self.focus(point),
        };
        if next.is_usable() { next } else { *self }
    }

    /// Whether all numbers are finite and eye and target differ.
    pub fn is_usable(&self) -> bool {
        let reach = self.eye.abs().max(self.target.abs()).max_element();
        let finite =
            self.eye.is_finite() && self.target.is_finite() && self.up.is_finite() && self.fov.is_finite();
        // Squares of distances must neither vanish nor overflow.
        finite && reach < 1e100 && self.distance() > (NEAREST * reach).max(1e-100)
    }

    /// Right, up, forward in world space, orthonormal (right as the eye sees it, without the mirror).
    fn axes(&self) -> [DVec3; 3] {
        let forward = (self.target - self.eye).normalize_or(DVec3::Z);
        let right = forward.cross(self.up);
        let right = if right.length() > 1e-9 { right.normalize() } else { forward.any_orthonormal_vector() };
        [right, right.cross(forward), forward]
    }

    fn orbit(&self, by: DVec2) -> Self {
        let [_, _, forward] = self.axes();
        // Down moves the eye up, over the scene: the scene follows the cursor.
        let forward = self.turn(forward, -by.x * self.handed() * PI, by.y * PI);
        Self { eye: self.target - forward * self.distance(), ..*self }
    }

    fn look(&self, by: DVec2, shape: DVec2) -> Self {
        let [_, _, forward] = self.axes();
        let fields = 2.0 * (shape * (0.5 * self.fov.to_radians()).tan()).map(f64::atan);
        let angles = 2.0 * by * fields;
        let forward = self.turn(forward, -angles.x * self.handed(), angles.y);
        Self { target: self.eye + forward * self.distance(), ..*self }
    }

    fn pan(&self, by: DVec2, shape: DVec2) -> Self {
        let half = shape * (0.5 * self.fov.to_radians()).tan();
        self.shift(DVec3::new(-2.0 * by.x * half.x, 2.0 * by.y * half.y, 0.0))
    }

    /// Moves along right, up, forward as the picture shows them, in units of the distance.
    fn shift(&self, by: DVec3) -> Self {
        let [right, up, forward] = self.axes();
        let shift = (right * by.x * self.handed() + up * by.y + forward * by.z) * self.distance();
        Self { eye: self.eye + shift, target: self.target + shift, ..*self }
    }

    fn dolly(&self, steps: f64) -> Self {
        Self { eye: self.target + (self.eye - self.target) * DOLLY.powf(steps), ..*self }
    }

    fn widen(&self, by: f64) -> Self {
        // A file may lie outside; it is not pulled in by a move in the right direction.
        let (least, greatest) = (FOV.0.min(self.fov), FOV.1.max(self.fov));
        Self { fov: (self.fov + by).clamp(least, greatest), ..*self }
    }

    /// A point right above or below is viewed at the pole's limit angle, keeping the previous heading.
    fn focus(&self, point: DVec3) -> Self {
        let next = Self { target: point, ..*self };
        let forward = (point - self.eye).normalize_or_zero();
        if next.is_usable() && self.up.cross(forward).length() < POLE.sin() {
            let [right, _, _] = self.axes();
            let heading = self.up.cross(right).normalize_or_zero();
            let away = self.up * forward.dot(self.up).signum() * POLE.cos() + heading * POLE.sin();
            return Self { target: self.eye + away * next.distance(), ..*self };
        }
        next
    }

    /// Turns a unit direction around `up` by `yaw` (counter-clockwise seen from above) and away from `up` by `pitch`, not
    /// over the poles; radians.
    fn turn(&self, direction: DVec3, yaw: f64, pitch: f64) -> DVec3 {
        let [right, up, _] = self.axes();
        let polar = self.up.cross(direction).length().atan2(self.up.dot(direction));
        // A direction that already lies beyond the limit may stay there, but goes no further.
        let next = (polar + pitch).clamp(POLE.min(polar), (PI - POLE).max(polar));
        // The horizontal part; seen from a pole the picture's up is the best heading there is.
        let flat = self.up.cross(right).normalize_or(up);
        let flat = DQuat::from_axis_angle(self.up, yaw) * flat;
        (self.up * next.cos() + flat * next.sin()).normalize_or(direction)
    }

    /// −1 in a mirror, where left and right of the picture are exchanged.
    fn handed(&self) -> f64 {
        if self.mirrored { -1.0 } else { 1.0 }
    }
}

/// The axis of the world on which a camera with this own up stands level, if there is one; y goes before z unless z is
/// much nearer.
fn level_axis(own: DVec3, forward: DVec3) -> Option<DVec3> {
    let side = own.cross(forward);
    let upright = |axis: DVec3, least: f64| {
        let height = own.dot(axis);
        (side.dot(axis).abs() < 1e-6 && height.abs() > least)
            .then_some((height.abs(), axis * height.signum()))
    };
    match (upright(DVec3::Y, 0.1), upright(DVec3::Z, 0.3)) {
        (Some((y, _)), Some((z, axis))) if z > 2.0 * y => Some(axis),
        (Some((_, axis)), _) | (None, Some((_, axis))) => Some(axis),
        (None, None) => None,
    }
}
