//! What projections make: rays in camera space, and places of the film.

use glam::{DVec2, DVec3};

/// Overscan beyond which pictures of all directions show nothing, as a share of the film.
pub(super) const OVERSCAN: f64 = 0.5;

/// A ray in camera space.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalRay {
    /// The point of the lens, or of the circle of the eyes, that it goes through.
    pub(super) from: DVec3,
    /// Its direction, of any length; of the ray to a point the way there.
    pub(super) direction: DVec3,
    /// Area of places per steradian of camera space.
    pub(super) density: f64,
}

/// A place that shows a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct FilmImage {
    pub(super) at: DVec2,
    pub(super) ray: LocalRay,
}
