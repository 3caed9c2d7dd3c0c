//! The first ray of a light subpath, and its densities.

use glam::Vec3;

use crate::math::frame::Frame;
use crate::math::warp;
use crate::tracer::accel::Ray;
use crate::tracer::bounding_sphere::BoundingSphere;
use crate::tracer::shape::SurfacePoint;

/// A sampled ray that leaves a light: the beginning of a light subpath.
#[derive(Clone, Copy, Debug)]
pub struct Emission {
    /// The light.
    pub light: u32,
    /// The point where the ray leaves the light; for the environment a point of the disk, outside the scene.
    pub from: SurfacePoint,
    /// Unit direction of the ray, world space.
    pub direction: Vec3,
    /// The densities of the ray.
    pub pdf: EmissionPdf,
}

/// The densities of one emitted ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmissionPdf {
    /// Where the ray comes from, which decides the units of the densities.
    pub origin: EmissionOrigin,
    /// Density of the light's vertex, with the choice of the light: per unit of area, per steradian for the environment
    /// (whose vertex is a direction), a probability for a point and for a single direction.
    pub vertex: f32,
    /// Density of the direction per steradian, 1 for a beam; of a light infinitely far away that of the point on the disk, per unit of area.
    pub next: f32,
    /// Cosine of the ray to the light's normal, ≥ 0; 1 without a normal.
    pub cos: f32,
}

/// Where a light subpath begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EmissionOrigin {
    /// A point of a surface.
    Surface,
    /// A point of a surface that emits along its normal only, which no path finds from its other end.
    Beam,
    /// A point light, which no path hits by chance.
    Point,
    /// Infinitely far away.
    Infinite,
    /// Infinitely far away in a single direction, which no path hits by chance.
    Parallel,
}

impl EmissionOrigin {
    /// True for a light that no path hits by chance.
    #[inline]
    pub fn is_delta(self) -> bool {
        matches!(self, Self::Beam | Self::Point | Self::Parallel)
    }

    /// True for a light infinitely far away.
    #[inline]
    pub fn is_far(self) -> bool {
        matches!(self, Self::Infinite | Self::Parallel)
    }
}

impl Emission {
    /// None where a density is 0 or underflowed: such a ray has no weight.
    #[inline]
    pub(super) fn usable(self) -> Option<Self> {
        (self.pdf.vertex > 0.0 && self.pdf.next > 0.0).then_some(self)
    }

    /// The ray.
    #[inline]
    pub fn ray(&self) -> Ray {
        match self.pdf.origin {
            EmissionOrigin::Surface | EmissionOrigin::Beam => self.from.spawn(self.direction),
            _ => Ray::new(self.from.p, self.direction),
        }
    }

    /// The factor on the light's spectrum: cosine over the densities.
    #[inline]
    pub fn scale(&self) -> f32 {
        self.pdf.cos / self.pdf.vertex / self.pdf.next
    }
}

/// Density of a direction that is uniform over the sphere.
pub(super) const UNIFORM_PDF: f32 = 0.25 * std::f32::consts::FRAC_1_PI;

/// The ray of direction `d` from a point of the disk before the scene, by the numbers `place`.
#[inline]
pub(super) fn infinite_ray(d: Vec3, place: [f32; 2], scene: BoundingSphere) -> (SurfacePoint, Vec3) {
    let frame = Frame::new(d);
    let xy = warp::disk(place);
    let offset = frame.s * xy.x + frame.t * xy.y - d;
    (SurfacePoint { p: scene.center + offset * scene.radius, error: Vec3::ZERO, ng: d }, d)
}

/// The densities of a ray from infinity whose direction has the density `vertex`.
#[inline]
pub(super) fn infinite_pdf(vertex: f32, scene: BoundingSphere) -> EmissionPdf {
    // The density of a point on a disk as large as the scene.
    let next = std::f32::consts::FRAC_1_PI / (scene.radius * scene.radius);
    EmissionPdf { origin: EmissionOrigin::Infinite, vertex, next, cos: 1.0 }
}

/// The densities of a ray in `direction` from a point of a surface that has the density `vertex` and the normal `n`.
#[inline]
pub(super) fn surface_pdf(n: Vec3, direction: Vec3, vertex: f32) -> EmissionPdf {
    let cos = n.dot(direction).max(0.0);
    let next = warp::cosine_hemisphere_pdf(cos);
    EmissionPdf { origin: EmissionOrigin::Surface, vertex, next, cos }
}
