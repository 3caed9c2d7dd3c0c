//! Where paths meet surfaces: a hit, and a hit with its material.

use glam::Vec3;

use crate::math::float::{SHADOW_T_MAX, safe_origin};
use crate::math::frame::Frame;
use crate::spectrum::SampledWavelengths;

use super::Scene;
use super::accel::{Hit, Ray};
use super::bsdf::{Bsdf, Material, MaterialEvalContext, Scattering};
use super::light::LightSampleContext;
use super::shape::SurfacePoint;

impl SurfacePoint {
    /// A ray that leaves in direction `d` (world space) and cannot hit this surface at once.
    #[inline]
    pub fn spawn(&self, d: Vec3) -> Ray {
        Ray::new(safe_origin(self.p, self.error, self.ng, d), d)
    }

    /// A ray that ends just before the world-space point `target`, seen from here in direction `towards`.
    #[inline]
    pub fn spawn_to(&self, target: Vec3, towards: Vec3) -> Ray {
        let origin = safe_origin(self.p, self.error, self.ng, towards);
        Ray::between(origin, target, SHADOW_T_MAX)
    }
}

/// A point where a ray met a surface.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceInteraction {
    /// Position, its error bound and geometric normal, world space.
    pub point: SurfacePoint,
    /// Shading normal, on the front.
    pub n: Vec3,
    /// Unit direction back along the ray, world space.
    pub wo: Vec3,
    /// The primitive that was hit, and where; `t` counts from where the ray began behind what it has passed.
    pub hit: Hit,
    /// Index of the surface in the scene, which has the materials of its two sides.
    pub surface: u32,
    /// The light that this primitive belongs to, if it emits.
    pub light: Option<u32>,
    /// The shading normal is interpolated and may differ from the geometric one.
    pub smooth: bool,
}

impl SurfaceInteraction {
    /// The light that this point belongs to, if it emits to where the ray came from.
    #[inline(always)]
    pub fn emitter(&self) -> Option<u32> {
        self.light.filter(|_| self.wo.dot(self.point.ng) > 0.0)
    }

    /// The geometric normal on the side of `wo`.
    #[inline]
    pub fn facing_normal(&self) -> Vec3 {
        let ng = self.point.ng;
        if self.wo.dot(ng) < 0.0 { -ng } else { ng }
    }

    /// A ray that leaves in direction `d` (world space) and cannot hit this surface at once.
    #[inline]
    pub fn spawn(&self, d: Vec3) -> Ray {
        self.point.spawn(d)
    }

    /// A ray that ends just before the world-space point `target`, seen from here in direction `towards`.
    #[inline]
    pub fn spawn_to(&self, target: Vec3, towards: Vec3) -> Ray {
        self.point.spawn_to(target, towards)
    }

    /// False when an interpolated normal lets light through a surface that should reflect it, or the reverse: the geometric
    /// normal must have `wo` and `wi` (world space) on the same sides as the shading normal has them.
    #[inline]
    pub fn sides_agree(&self, wi: Vec3, transmitted: bool) -> bool {
        if !self.smooth {
            return true;
        }
        let same = self.wo.dot(self.point.ng) * wi.dot(self.point.ng) > 0.0;
        same != transmitted
    }
}

/// The material that a surface shows at a point to the side that it is seen from.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceMaterial<'a> {
    /// The material.
    pub material: &'a Material,
    /// The shading frame that it is evaluated in.
    pub frame: Frame,
    /// The point at which it is evaluated.
    pub context: MaterialEvalContext,
}

impl SurfaceMaterial<'_> {
    /// The material at the wavelengths of a path.
    #[inline(always)]
    pub fn bsdf<B: Scattering>(&self, lambda: &SampledWavelengths) -> B {
        B::of(self.material, &self.context, lambda)
    }
}

/// A path vertex on a surface: a hit and its material at the wavelengths of the path.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceVertex<B = Bsdf> {
    /// The hit; `hit.wo` points back along the path, world space.
    pub hit: SurfaceInteraction,
    /// The shading frame of `bsdf` and `wo`.
    pub frame: Frame,
    /// The material at the wavelengths of the path.
    pub bsdf: B,
    /// `hit.wo` in `frame`.
    pub wo: Vec3,
}

impl<B: Scattering> SurfaceVertex<B> {
    /// Evaluates the material of `hit` at `lambda`.
    #[inline(always)]
    pub fn new(scene: &Scene, hit: SurfaceInteraction, lambda: &SampledWavelengths) -> Self {
        let (frame, bsdf) = match scene.is_parametrized() {
            false => {
                let SurfaceMaterial { material, frame, context } = scene.uniform_material(&hit);
                (frame, B::of(material, &context, lambda))
            }
            // A copy, so that the compiler keeps the hit in registers.
            true => Self::parametrized(scene, &{ hit }, lambda),
        };
        Self { frame, bsdf, wo: frame.to_local(hit.wo), hit }
    }

    /// Out of line, so that scenes without textures do not move around what only textures ask for.
    #[inline(never)]
    fn parametrized(scene: &Scene, hit: &SurfaceInteraction, lambda: &SampledWavelengths) -> (Frame, B) {
        let surface = scene.surface_material(hit);
        (surface.frame, surface.bsdf(lambda))
    }

    /// The context for sampling a light from here, seen from the side that the path came from.
    #[inline]
    pub fn light_context(&self) -> LightSampleContext {
        self.light_context_from(self.wo)
    }

    /// The context for sampling a light from here, seen from the side of the local direction `eye`.
    #[inline]
    pub fn light_context_from(&self, eye: Vec3) -> LightSampleContext {
        let n = if eye.z < 0.0 { -self.frame.n } else { self.frame.n };
        let (through, glossy) = (self.bsdf.transmits(), self.bsdf.is_glossy());
        LightSampleContext { p: self.hit.point.p, n, through, glossy }
    }
}
