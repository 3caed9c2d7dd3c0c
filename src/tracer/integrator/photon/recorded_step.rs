//! The steps of a camera path that can be evaluated again.

use glam::{Vec3, Vec4};

use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::Scene;
use crate::tracer::bsdf::{BsdfSample, Material, MaterialEvalContext, Scattering};
use crate::tracer::integrator::pair::ForEyes;
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

    /// The weights of this step at other wavelengths as two eyes see it, the other from the direction `wo` in the shading frame.
    #[inline]
    pub(super) fn weights_for_eyes<B: Scattering>(
        &self,
        scene: &Scene,
        lambda: &SampledWavelengths,
        wo: Vec3,
    ) -> ForEyes<SampledSpectrum> {
        match self {
            Self::Surface(scattering) => scattering.weights_for_eyes::<B>(scene, lambda, wo),
            Self::InMedium(_) | Self::Flight(_) => {
                let weight = self.weight::<B>(scene, lambda);
                ForEyes { own: weight, other: weight }
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
        let value = match self.delta {
            true => self.value_of_delta(&bsdf),
            false => self.value(material, &bsdf, lambda, self.wo),
        };
        value * self.scale
    }

    /// The weights of this scattering at other wavelengths as two eyes see it, the other from the direction `wo` in the shading frame, which sees
    /// nothing by a delta.
    #[inline]
    fn weights_for_eyes<B: Scattering>(
        &self,
        scene: &Scene,
        lambda: &SampledWavelengths,
        wo: Vec3,
    ) -> ForEyes<SampledSpectrum> {
        let material = scene.material(self.material);
        let bsdf = B::of(material, &self.context, lambda);
        let values = match self.delta {
            true => ForEyes { own: self.value_of_delta(&bsdf), other: SampledSpectrum::ZERO },
            false => ForEyes { own: self.wo, other: wo }.map(|wo| self.value(material, &bsdf, lambda, wo)),
        };
        values.map(|value| value * self.scale)
    }

    /// f·|cos| of the same delta per lane; zero where these wavelengths never choose it.
    #[inline]
    fn value_of_delta<B: Scattering>(&self, bsdf: &B) -> SampledSpectrum {
        match bsdf.sample(self.wo, [0.5; 2], self.lobe) {
            Some(s) if s.delta && s.transmitted == self.transmitted => s.weight * s.pdf.0,
            _ => SampledSpectrum::ZERO,
        }
    }

    /// f·|cos| per lane in the direction `wo`. Where colours part, values hold a factor of the hero's, so each wavelength is evaluated alone.
    #[inline]
    fn value<B: Scattering>(
        &self,
        material: &Material,
        bsdf: &B,
        lambda: &SampledWavelengths,
        wo: Vec3,
    ) -> SampledSpectrum {
        let at = |bsdf: &B| bsdf.eval(wo, self.wi).map_or(SampledSpectrum::ZERO, |(f, _)| f);
        if !bsdf.is_dispersive() {
            return at(bsdf);
        }
        let lane = |i: usize| at(&B::of(material, &self.context, &lambda.alone(i))).0[i];
        SampledSpectrum(Vec4::from_array([0, 1, 2, 3].map(lane)))
    }
}
