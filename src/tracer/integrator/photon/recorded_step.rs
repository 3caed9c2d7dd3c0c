//! The steps of a camera path that can be evaluated again.

use glam::{Vec3, Vec4};

use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::Scene;
use crate::tracer::bsdf::{BsdfSample, Material, MaterialEvalContext, Scattering};
use crate::tracer::medium::FlightPiece;
use crate::tracer::vertex::SurfaceVertex;

/// One step of a camera path, to be evaluated again at the wavelengths of a photon.
#[derive(Clone, Copy, Debug)]
pub(super) enum RecordedStep {
    /// A scattering at a surface.
    Surface(RecordedScattering),
    /// A scattering in a medium, which depends on no wavelength: roulette's factor.
    InMedium(f32),
    /// A flight through a medium.
    Flight(FlightPiece),
}

impl RecordedStep {
    /// The scattering `sample` at `vertex`, which roulette has let go on with this factor. The number `lobe` has chosen its lobe.
    pub(super) fn new<B: Scattering>(
        scene: &Scene,
        vertex: &SurfaceVertex<B>,
        sample: &BsdfSample,
        lobe: f32,
        roulette: f32,
    ) -> Self {
        match vertex.hit.is_in_medium() {
            true => Self::InMedium(roulette),
            false => Self::Surface(RecordedScattering::new(scene, vertex, sample, lobe, roulette)),
        }
    }

    /// This step, which is no delta, seen from another direction `wo` in the shading frame.
    pub(super) fn seen_from(self, wo: Vec3) -> Self {
        match self {
            Self::Surface(scattering) => Self::Surface(RecordedScattering { wo, ..scattering }),
            Self::InMedium(_) | Self::Flight(_) => self,
        }
    }

    /// True for a scattering from a delta.
    pub(super) fn is_delta(&self) -> bool {
        matches!(self, Self::Surface(RecordedScattering { delta: true, .. }))
    }

    /// The weight of this step at other wavelengths.
    #[inline]
    pub(super) fn weight<B: Scattering>(
        &self,
        scene: &Scene,
        lambda: &SampledWavelengths,
    ) -> SampledSpectrum {
        match self {
            Self::Surface(scattering) => scattering.weight::<B>(scene, lambda),
            Self::InMedium(roulette) => SampledSpectrum::splat(*roulette),
            Self::Flight(piece) => {
                scene.media().map_or(SampledSpectrum::ONE, |media| piece.weight(media, lambda))
            }
        }
    }
}

/// A scattering at a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct RecordedScattering {
    /// The index of the material.
    material: u32,
    context: MaterialEvalContext,
    wo: Vec3,
    wi: Vec3,
    delta: bool,
    transmitted: bool,
    /// A lobe number that chooses the same delta.
    lobe: f32,
    /// Roulette's factor over the density with which the direction, or the delta, was chosen.
    scale: f32,
}

impl RecordedScattering {
    /// The scattering `sample` at `vertex`, which roulette has let go on with this factor.
    fn new<B: Scattering>(
        scene: &Scene,
        vertex: &SurfaceVertex<B>,
        sample: &BsdfSample,
        lobe: f32,
        roulette: f32,
    ) -> Self {
        let BsdfSample { wi, pdf, delta, transmitted, .. } = *sample;
        let scale = 1.0 / pdf.0 * roulette;
        let lobe = vertex.bsdf.delta_lobe(vertex.wo, lobe, transmitted);
        let material = scene.material_index(&vertex.hit);
        let context = scene.surface_material(&vertex.hit).context;
        Self { material, context, wo: vertex.wo, wi, delta, transmitted, lobe, scale }
    }

    /// The weight of this scattering at other wavelengths.
    #[inline]
    fn weight<B: Scattering>(&self, scene: &Scene, lambda: &SampledWavelengths) -> SampledSpectrum {
        let material = scene.material(self.material);
        let bsdf = B::of(material, &self.context, lambda);
        let value = if self.delta {
            // The same lobe; where these wavelengths never choose it, its value is zero.
            match bsdf.sample(self.wo, [0.5; 2], self.lobe) {
                Some(s) if s.delta && s.transmitted == self.transmitted => s.weight * s.pdf.0,
                _ => SampledSpectrum::ZERO,
            }
        } else {
            self.value(material, &bsdf, lambda)
        };
        value * self.scale
    }

    /// f·|cos| per lane. Where colours part, values hold a factor of the hero's, so each wavelength is evaluated alone.
    #[inline]
    fn value<B: Scattering>(
        &self,
        material: &Material,
        bsdf: &B,
        lambda: &SampledWavelengths,
    ) -> SampledSpectrum {
        let at = |bsdf: &B| bsdf.eval(self.wo, self.wi).map_or(SampledSpectrum::ZERO, |(f, _)| f);
        if !bsdf.is_dispersive() {
            return at(bsdf);
        }
        let lane = |i: usize| at(&B::of(material, &self.context, &lambda.alone(i))).0[i];
        SampledSpectrum(Vec4::from_array([0, 1, 2, 3].map(lane)))
    }
}
