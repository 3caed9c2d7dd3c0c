//! Triangles, disks and spheres as the tracer stores them: checked, in single precision.
//!
//! Each has its bounds, its intersection with a ray, and the surface point at a hit, with a bound on its error.

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
    /// Bound on the distance of `p` from the true surface, along each axis.
    pub error: Vec3,
    /// Unit geometric normal on the front, as materials and emission define it.
    pub ng: Vec3,
}
