//! Camera moves: pure functions from a pose and a gesture to the next pose, and their history.

use glam::{DAffine3, DVec2, DVec3};

/// Where the camera stands and looks, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Position.
    pub eye: DVec3,
    /// Point that it looks at and orbits around; its distance from `eye` is the scale of all moves.
    pub target: DVec3,
    /// World direction that stays up, unit length.
    pub up: DVec3,
    /// Field of view in degrees, along the axis that the scene file measures it.
    pub fov: f64,
}

/// One move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gesture {
    /// Turns around the target, by fractions of the window's size.
    Orbit(DVec2),
    /// Shifts eye and target in the picture plane, by fractions of the window's size.
    Pan(DVec2),
    /// Moves towards the target; 1 is one step of the wheel.
    Dolly(f64),
    /// Moves freely along camera right, up, forward, in units of the distance to the target.
    Fly(DVec3),
    /// Looks around from a fixed eye, by fractions of the window's size.
    Look(DVec2),
    /// Widens the field of view, degrees.
    Fov(f64),
    /// Looks at this point from where it stands, and orbits around it from now on.
    Focus(DVec3),
}

impl Pose {
    /// The pose of a camera transform (Mitsuba's convention: looks along +z, +y up, +x to the left) looking at a point
    /// `distance` ahead.
    pub fn of(to_world: &DAffine3, fov: f64, distance: f64) -> Self {
        let (eye, forward) = (to_world.translation, to_world.matrix3.z_axis.normalize_or(DVec3::Z));
        let up = to_world.matrix3.y_axis.normalize_or(DVec3::Y);
        Self { eye, target: eye + forward * distance, up, fov }
    }
}
