//! Light that leaves a light: the first ray of a light subpath, and the densities of a given one.
//!
//! A surface chooses a point, then a direction by the cosine. The environment is the other way round: first the
//! direction, which takes the place of the point, then where the ray passes, on a disk that is perpendicular to it and as
//! large as the scene (Veach 1997, §8.2.2.4; Pharr, Jakob, Humphreys, *Physically Based Rendering*, 4th ed., §16.1.2).

use glam::Vec3;

use crate::math::float::safe_origin;
use crate::math::frame::Frame;
use crate::math::pdf::PdfW;
use crate::math::warp;
use crate::tracer::accel::Ray;
use crate::tracer::sampler::LightNumbers;
use crate::tracer::shape::SurfacePoint;

use super::{Light, LightShape, Lights};

/// What a light subpath begins with.
#[derive(Clone, Copy, Debug)]
pub struct Emission {
    /// Which light.
    pub light: u32,
    /// Where it leaves the light; for the environment a point of the disk, outside the scene.
    pub from: SurfacePoint,
    /// Where it goes: unit length, world space.
    pub direction: Vec3,
    /// How likely that was.
    pub pdf: EmissionPdf,
}

/// The densities of one emitted ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmissionPdf {
    /// From what sort of light it comes, and so what the densities are per unit of.
    pub origin: Origin,
    /// Of the light's vertex, with the choice of the light: per unit of area, per steradian for the environment
    /// (whose vertex is a direction), a probability for a point.
    pub vertex: f32,
    /// Of what follows: per steradian; per unit of area of the disk for the environment.
    pub next: f32,
    /// Cosine of the ray to the light's normal, ≥ 0; 1 without a normal.
    pub cos: f32,
}

/// Sorts of light, by where a light subpath begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// A point of a surface.
    Surface,
    /// The only point there is: nothing meets it by chance.
    Point,
    /// Infinitely far away.
    Far,
}

/// The sphere around a scene.
#[derive(Clone, Copy, Debug, Default)]
pub struct Extent {
    /// World space.
    pub center: Vec3,
    /// World units.
    pub radius: f32,
}

impl Extent {
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
            Origin::Surface => Ray::new(safe_origin(p, error, ng, self.direction), self.direction),
            Origin::Point | Origin::Far => Ray::new(p, self.direction),
        }
    }

    /// What the light's spectrum is multiplied with: cosine over the densities.
    #[inline]
    pub fn scale(&self) -> f32 {
        self.pdf.cos / self.pdf.vertex / self.pdf.next
    }
}

impl Lights {
    /// Chooses a light by power, and a ray that leaves it.
    #[inline]
    pub fn emit(&self, u: &LightNumbers) -> Option<Emission> {
        let chosen = self.by_power.as_ref()?.sample(u.choice);
        let light = &self.lights[chosen.index];
        let (from, direction) = match &light.shape {
            LightShape::Constant(_) => self.emit_far(warp::sphere(u.direction), u.place),
            LightShape::Map(map) => self.emit_far(-map.sample_direction(u.direction)?.0, u.place),
            LightShape::Point(l) => {
                let d = warp::sphere(u.direction);
                (SurfacePoint { p: l.position, error: Vec3::ZERO, ng: d }, d)
            }
            _ => {
                let from = light.point(u.place)?;
                (from, Frame::new(from.ng).to_world(warp::cosine_hemisphere(u.direction)))
            }
        };
        let index = chosen.index as u32;
        let pdf = self.emission_pdf(index, from.p, direction);
        // A density of 0 is one that underflowed: such a ray has no weight.
        (pdf.vertex > 0.0 && pdf.next > 0.0).then_some(Emission { light: index, from, direction, pdf })
    }

    /// A ray of direction `d` from a point of the disk before the scene.
    fn emit_far(&self, d: Vec3, place: [f32; 2]) -> (SurfacePoint, Vec3) {
        let frame = Frame::new(d);
        let xy = warp::disk(place);
        let offset = frame.s * xy.x + frame.t * xy.y - d;
        (SurfacePoint { p: self.extent.center + offset * self.extent.radius, error: Vec3::ZERO, ng: d }, d)
    }

    /// The densities with which [`Lights::emit`] sends a ray from the point `p` of `light` in `direction`; `p` is not
    /// looked at for the environment.
    #[inline]
    pub fn emission_pdf(&self, light: u32, p: Vec3, direction: Vec3) -> EmissionPdf {
        const UNIFORM: f32 = 0.25 * std::f32::consts::FRAC_1_PI;
        let choice = self.by_power.as_ref().map_or(0.0, |c| c.probability(light as usize));
        let light = &self.lights[light as usize];
        match &light.shape {
            LightShape::Constant(_) => EmissionPdf {
                origin: Origin::Far,
                vertex: choice * UNIFORM,
                next: self.extent.disk_pdf(),
                cos: 1.0,
            },
            LightShape::Map(map) => EmissionPdf {
                origin: Origin::Far,
                vertex: choice * map.pdf_direction(-direction).0,
                next: self.extent.disk_pdf(),
                cos: 1.0,
            },
            LightShape::Point(_) => {
                EmissionPdf { origin: Origin::Point, vertex: choice, next: UNIFORM, cos: 1.0 }
            }
            _ => {
                let cos = light.normal(p).dot(direction).max(0.0);
                let vertex = choice / light.extent(0.0);
                let next = warp::cosine_hemisphere_pdf(cos);
                EmissionPdf { origin: Origin::Surface, vertex, next, cos }
            }
        }
    }

    /// How much denser a light subpath chooses the edge from `light` to a point it lights than next-event estimation
    /// does, which chose the direction `-direction` with density `direct` from there: the quotient of the former, for
    /// both ends of the edge, and of the latter, per unit of area at the lit point, whose surface is inclined by `cos`.
    #[inline]
    pub fn walk_over_direct(&self, edge: &LitEdge) -> f32 {
        let LitEdge { light, target, direction, distance2, cos, direct } = *edge;
        let pdf = self.emission_pdf(light, target, direction);
        let scale = match pdf.origin {
            // cos / d² of the light turns both densities into ones by area and drops out.
            Origin::Surface => pdf.next / pdf.cos,
            Origin::Point => pdf.next / distance2,
            Origin::Far => pdf.next,
        };
        pdf.vertex / direct.0 * (scale * cos)
    }
}

/// The edge between a light and a point that next-event estimation lights.
#[derive(Clone, Copy, Debug)]
pub struct LitEdge {
    /// The light.
    pub light: u32,
    /// The point on it; not looked at for the environment.
    pub target: Vec3,
    /// Unit direction from the light.
    pub direction: Vec3,
    /// Squared length.
    pub distance2: f32,
    /// |cos| at the lit point, geometric.
    pub cos: f32,
    /// Density of next-event estimation.
    pub direct: PdfW,
}

impl Light {
    /// A point of the surface, uniformly by area; `None` for what has none.
    #[inline]
    fn point(&self, u: [f32; 2]) -> Option<SurfacePoint> {
        match &self.shape {
            LightShape::Triangle(l) => Some(l.point(u)),
            LightShape::Parallelogram(l) => Some(l.point(u)),
            LightShape::Disk(l) => Some(l.point(u)),
            LightShape::Sphere(l) => Some(l.point(u)),
            LightShape::Point(_) | LightShape::Constant(_) | LightShape::Map(_) => None,
        }
    }

    /// The unit normal of the side that emits, at the point `p` of the surface; zero for what has none.
    #[inline]
    fn normal(&self, p: Vec3) -> Vec3 {
        match &self.shape {
            LightShape::Triangle(l) => l.normal(),
            LightShape::Parallelogram(l) => l.normal(),
            LightShape::Disk(l) => l.normal(),
            LightShape::Sphere(l) => l.normal(p),
            LightShape::Point(_) | LightShape::Constant(_) | LightShape::Map(_) => Vec3::ZERO,
        }
    }
}
