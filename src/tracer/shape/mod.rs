//! Shapes as the tracer holds them: world space, single precision, checked.
//!
//! Each knows its bounds, how a ray meets it, and the point there with a bound on its error.

mod disk;
mod sphere;
mod triangle;

use glam::Vec3;

pub use disk::Disk;
pub use sphere::Sphere;
pub use triangle::Triangle;

/// A point on a shape.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Position, world space.
    pub p: Vec3,
    /// Bound on the distance of `p` to the true surface, per axis.
    pub error: Vec3,
    /// Unit geometric normal, on the side that materials and emission call the front.
    pub ng: Vec3,
}
