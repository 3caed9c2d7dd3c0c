//! A vertex of a path: where it meets a surface, with the material there, or scatters in a medium.

use glam::Vec3;

use crate::math::frame::Frame;
use crate::spectrum::SampledWavelengths;

use super::bsdf::{Bsdf, Scattering};
use super::interaction::SurfaceInteraction;
use super::light::LightSampleContext;
use super::medium::{MediumIndex, PathMedia};
use super::scene::{Scene, SurfaceMaterial};

/// A path vertex: a hit and its material at the wavelengths of the path, or a point in a medium and its phase function.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceVertex<B: Scattering = Bsdf> {
    /// The hit; `hit.wo` points back along the path, world space.
    pub hit: SurfaceInteraction,
    /// The shading frame of `bsdf` and `wo`; in a medium around `hit.wo`, or world space where the phase function lies in that.
    pub frame: Frame,
    /// The material at the wavelengths of the path.
    pub bsdf: B,
    /// `hit.wo` in `frame`.
    pub wo: Vec3,
    /// The media on both of its sides.
    pub media: B::Media,
}

impl<B: Scattering> SurfaceVertex<B> {
    /// Evaluates the material of `hit` at `lambda`, or the phase function of `medium`, through which the path came there.
    #[inline(always)]
    pub fn new(
        scene: &Scene,
        hit: SurfaceInteraction,
        lambda: &SampledWavelengths,
        medium: MediumIndex,
    ) -> Self {
        if B::Media::PRESENT && hit.is_in_medium() {
            let media = B::Media::at(medium, || None);
            let phase = scene.phase_function(medium, hit.point.p);
            let (frame, wo) = match phase.is_oriented() {
                true => (Frame::WORLD, hit.wo),
                false => (Frame::new(hit.wo), Vec3::Z),
            };
            return Self { frame, bsdf: B::of_phase(phase), wo, hit, media };
        }
        let (frame, bsdf) = match scene.is_parametrized() {
            false => {
                let SurfaceMaterial { material, frame, context } = scene.uniform_material(&hit);
                (frame, B::of(material, &context, lambda))
            }
            // A copy, so that the compiler keeps the hit in registers.
            true => Self::parametrized(scene, &{ hit }, lambda),
        };
        let media = B::Media::at(medium, || scene.media_at(&hit, medium));
        Self { frame, bsdf, wo: frame.to_local(hit.wo), hit, media }
    }

    /// Out of line, so that scenes without textures do not move around what only textures ask for.
    #[inline(never)]
    fn parametrized(scene: &Scene, hit: &SurfaceInteraction, lambda: &SampledWavelengths) -> (Frame, B) {
        let surface = scene.surface_material(hit);
        (surface.frame, surface.bsdf(lambda))
    }

    /// |cos| of the angle between the world-space direction `d` and the geometric normal; in a medium, which has none, the
    /// [projected area](crate::tracer::bsdf::ScatteringModel::projected_area) of its particles.
    #[inline(always)]
    pub fn cosine(&self, d: Vec3) -> f32 {
        match B::Media::PRESENT && self.hit.is_in_medium() {
            true => self.bsdf.projected_area(d),
            false => d.dot(self.hit.point.ng).abs(),
        }
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
        let n = if B::Media::PRESENT && self.hit.is_in_medium() { Vec3::ZERO } else { n };
        let (through, glossy) = (self.bsdf.transmits(), self.bsdf.is_glossy());
        LightSampleContext { p: self.hit.point.p, n, through, glossy }
    }
}
