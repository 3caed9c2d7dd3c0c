//! Everything that emits.
//!
//! Conventions: `wi` points from the lit point to the light, unit length, world space. A density is per
//! steradian at the lit point and includes the probability of choosing the light; sample and pdf are pairs:
//! [`Lights::pdf`] returns for a direction exactly what [`Lights::sample`] would have reported for it, and 0
//! where it would never have chosen it. Where each light is sampled ([`LitPoint::glossy`]) the probability of choosing
//! a light is 1. A delta light has the probability of its choice as density and
//! [`LightSample::delta`] set. `None` means that sampling failed: no light from there.

mod area;
mod build;
mod choice;
mod cluster;
mod constant;
mod emission;
mod envmap;
mod lights;
mod point;
mod sample;
mod sphere;
mod tree;

use glam::Vec3;

use crate::math::pdf::PdfW;

use super::accel::PrimRange;
use super::shape::SurfacePoint;

pub use area::{DiskLight, ParallelogramLight, TriangleLight};
pub use constant::ConstantLight;
pub use emission::{Emission, EmissionPdf, Extent, LitEdge, Origin};
pub use envmap::EnvironmentMap;
pub use lights::Lights;
pub use point::PointLight;
pub use sample::{LightSample, LitPoint};
pub use sphere::SphereLight;

/// The geometry of a light.
#[derive(Clone, Debug)]
pub enum LightShape {
    /// One triangle of a mesh.
    Triangle(TriangleLight),
    /// A rectangle under an affine map.
    Parallelogram(ParallelogramLight),
    /// A disk.
    Disk(DiskLight),
    /// A sphere.
    Sphere(SphereLight),
    /// A point.
    Point(PointLight),
    /// The same from all around.
    Constant(ConstantLight),
    /// A picture of what is all around.
    Map(EnvironmentMap),
}

/// Anything that emits.
#[derive(Clone, Debug)]
pub struct Light {
    /// Where it emits from.
    pub shape: LightShape,
    /// Index into the spectra of [`Lights`].
    pub spectrum: u32,
    /// Its own primitives, which never shadow it.
    pub prims: PrimRange,
}

impl Light {
    #[inline(always)]
    fn sample(&self, at: LitPoint, u: [f32; 2]) -> Option<LightSample> {
        match &self.shape {
            LightShape::Triangle(l) => l.sample(at, u),
            LightShape::Parallelogram(l) => l.sample(at, u),
            LightShape::Disk(l) => l.sample(at, u),
            LightShape::Sphere(l) => l.sample(at, u),
            LightShape::Point(l) => l.sample(at),
            LightShape::Constant(l) => l.sample(at, u),
            LightShape::Map(l) => l.sample(u),
        }
    }

    #[inline]
    fn pdf(&self, at: LitPoint, wi: Vec3, hit: Option<&SurfacePoint>) -> PdfW {
        match (&self.shape, hit) {
            (LightShape::Triangle(l), Some(hit)) => l.pdf(at, hit),
            (LightShape::Parallelogram(l), Some(hit)) => l.pdf(at, hit),
            (LightShape::Disk(l), Some(hit)) => l.pdf(at, hit),
            (LightShape::Sphere(l), Some(_)) => l.pdf(at),
            (LightShape::Constant(l), None) => l.pdf(at, wi),
            (LightShape::Map(l), None) => l.pdf_direction(wi),
            _ => PdfW::ZERO,
        }
    }

    /// True for light that comes from infinitely far, from all around; a scene has at most one.
    #[inline]
    pub fn is_environment(&self) -> bool {
        matches!(self.shape, LightShape::Constant(_) | LightShape::Map(_))
    }

    /// True when it gives no light whatever its spectrum.
    pub fn is_black(&self) -> bool {
        matches!(&self.shape, LightShape::Map(l) if l.is_black())
    }

    /// Power over π, up to the spectrum: area for a surface, 4 for a point, and so on.
    fn extent(&self, scene_radius: f32) -> f32 {
        match &self.shape {
            LightShape::Triangle(l) => l.area(),
            LightShape::Parallelogram(l) => l.area(),
            LightShape::Disk(l) => l.area(),
            LightShape::Sphere(l) => l.area(),
            LightShape::Point(_) => 4.0,
            LightShape::Constant(_) => 4.0 * std::f32::consts::PI * scene_radius * scene_radius,
            LightShape::Map(l) => {
                4.0 * std::f32::consts::PI * scene_radius * scene_radius * l.mean_luminance()
            }
        }
    }
}
