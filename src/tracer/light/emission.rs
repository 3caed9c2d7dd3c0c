//! Emission: the first ray of a light subpath, and the densities of a given one.
//!
//! From a surface a point is sampled, then a direction by the cosine. From the environment it is the other way round: first
//! the direction, which takes the place of the point, then where the ray passes, on a disk that is perpendicular to it and as
//! large as the scene (Veach 1997, §8.2.2.4; Pharr, Jakob, Humphreys, *Physically Based Rendering*, 4th ed., §16.1.2).

use glam::Vec3;

use crate::math::float::safe_origin;
use crate::math::frame::Frame;
use crate::math::warp;
use crate::tracer::accel::Ray;
use crate::tracer::sampler::LightNumbers;
use crate::tracer::shape::SurfacePoint;

use super::{LightSample, LightSource, Lights, with_light};

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
    /// (whose vertex is a direction), a probability for a point.
    pub vertex: f32,
    /// Density of the direction per steradian; for the environment of the point on the disk, per unit of area.
    pub next: f32,
    /// Cosine of the ray to the light's normal, ≥ 0; 1 without a normal.
    pub cos: f32,
}

/// Where a light subpath begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EmissionOrigin {
    /// A point of a surface.
    Surface,
    /// A point light, which no path hits by chance.
    Point,
    /// Infinitely far away.
    Infinite,
}

/// The sphere around a scene.
#[derive(Clone, Copy, Debug, Default)]
pub struct BoundingSphere {
    /// Centre, world space.
    pub center: Vec3,
    /// Radius in world units.
    pub radius: f32,
}

impl BoundingSphere {
    /// Power over π of an environment of radiance 1.
    pub(super) fn environment_power(&self) -> f32 {
        4.0 * std::f32::consts::PI * self.radius * self.radius
    }

    /// Density of a point on the disk as large as the scene.
    fn disk_pdf(&self) -> f32 {
        std::f32::consts::FRAC_1_PI / (self.radius * self.radius)
    }
}

impl Emission {
    /// The ray.
    #[inline]
    pub fn ray(&self) -> Ray {
        let SurfacePoint { p, error, ng } = self.from;
        match self.pdf.origin {
            EmissionOrigin::Surface => Ray::new(safe_origin(p, error, ng, self.direction), self.direction),
            EmissionOrigin::Point | EmissionOrigin::Infinite => Ray::new(p, self.direction),
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
    EmissionPdf { origin: EmissionOrigin::Infinite, vertex, next: scene.disk_pdf(), cos: 1.0 }
}

/// The densities of a ray in `direction` from a point of a surface that has the density `vertex` and the normal `n`.
#[inline]
pub(super) fn surface_pdf(n: Vec3, direction: Vec3, vertex: f32) -> EmissionPdf {
    let cos = n.dot(direction).max(0.0);
    let next = warp::cosine_hemisphere_pdf(cos);
    EmissionPdf { origin: EmissionOrigin::Surface, vertex, next, cos }
}

impl Lights {
    /// Chooses a light by power, and a ray that leaves it.
    #[inline]
    pub fn emit(&self, u: &LightNumbers) -> Option<Emission> {
        let chosen = self.by_power.as_ref()?.sample(u.choice);
        let shape = &self.lights[chosen.index].shape;
        let (from, direction) = with_light!(shape, l => l.emit(u, self.scene))?;
        let light = chosen.index as u32;
        let pdf = self.emission_pdf(light, from.p, direction);
        // A density of 0 is one that underflowed: such a ray has no weight.
        (pdf.vertex > 0.0 && pdf.next > 0.0).then_some(Emission { light, from, direction, pdf })
    }

    /// The densities with which [`Lights::emit`] sends a ray from the point `p` of `light` (not used for the environment) in
    /// `direction`.
    #[inline]
    pub fn emission_pdf(&self, light: u32, p: Vec3, direction: Vec3) -> EmissionPdf {
        let choice = self.by_power.as_ref().map_or(0.0, |c| c.probability(light as usize));
        let shape = &self.lights[light as usize].shape;
        with_light!(shape, l => l.emission_pdf(p, direction, self.scene, choice))
    }

    /// The density with which a light subpath begins with the edge of `sample`, for both of its ends, over that of next-event
    /// estimation from the lit point `p`; per unit of area there. `cos` is |cos| at the lit point, geometric.
    #[inline]
    pub fn emission_over_direct(&self, light: u32, sample: &LightSample, p: Vec3, cos: f32) -> f32 {
        let target = sample.target.unwrap_or(Vec3::ZERO);
        let pdf = self.emission_pdf(light, target, -sample.wi);
        let scale = match pdf.origin {
            // cos / d² of the light turns both densities into ones by area and drops out.
            EmissionOrigin::Surface => pdf.next / pdf.cos,
            EmissionOrigin::Point => pdf.next / target.distance_squared(p),
            EmissionOrigin::Infinite => pdf.next,
        };
        pdf.vertex / sample.pdf.0 * (scale * cos)
    }
}
