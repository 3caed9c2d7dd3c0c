//! Every model of scattering, for paths that [record](crate::tracer::record) what they do.

use glam::Vec3;

use crate::math::pdf::PdfW;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::medium::{MediumSides, PhaseFunction};
use crate::tracer::record::{PathEvent, record};
use crate::tracer::wavelength_mis::Dispersion;

use super::diffuse::Diffuse;
use super::models::{InMedia, Material, Scattering};
use super::scattering::{BsdfSample, DeltaLobes, MaterialEvalContext, ScatteringModel};

/// Every model of scattering, and what it is asked is recorded.
#[derive(Clone, Copy, Debug)]
pub struct Recorded(InMedia);

impl From<Diffuse> for Recorded {
    fn from(bsdf: Diffuse) -> Self {
        Self(bsdf.into())
    }
}

impl Scattering for Recorded {
    const RECORDS: bool = true;
    type Credits = ();
    type Media = MediumSides;

    fn of(material: &Material, context: &MaterialEvalContext, lambda: &SampledWavelengths) -> Self {
        Self(InMedia::of(material, context, lambda))
    }

    fn of_phase(phase: PhaseFunction) -> Self {
        Self(InMedia::of_phase(phase))
    }
}

impl ScatteringModel for Recorded {
    fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        let value = self.0.eval(wo, wi);
        record(PathEvent::Evaluated { wo, wi, value });
        value
    }

    fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        let sample = self.0.sample(wo, u, lobe);
        record(PathEvent::Sampled { wo, u: u.into(), lobe, sample });
        sample
    }

    fn sample_from_light(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        let sample = self.0.sample_from_light(wo, u, lobe);
        record(PathEvent::Sampled { wo, u: u.into(), lobe, sample });
        sample
    }

    fn pdf_from_light(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.0.pdf_from_light(wo, wi)
    }

    fn projected_area(&self, d: Vec3) -> f32 {
        self.0.projected_area(d)
    }

    fn as_diffuse(&self) -> Option<&Diffuse> {
        self.0.as_diffuse()
    }

    fn has_diffuse_part(&self) -> bool {
        self.0.has_diffuse_part()
    }

    fn is_delta(&self) -> bool {
        self.0.is_delta()
    }

    fn is_glossy(&self) -> bool {
        self.0.is_glossy()
    }

    fn transmits(&self) -> bool {
        self.0.transmits()
    }

    fn is_dispersive(&self) -> bool {
        self.0.is_dispersive()
    }

    fn dispersion(&self, wo: Vec3, wi: Vec3) -> Dispersion {
        self.0.dispersion(wo, wi)
    }

    fn delta_lobes(&self, wo: Vec3) -> DeltaLobes {
        self.0.delta_lobes(wo)
    }

    fn delta_lobe(&self, wo: Vec3, lobe: f32, transmitted: bool) -> f32 {
        self.0.delta_lobe(wo, lobe, transmitted)
    }

    fn refract(&self, wo: Vec3, lane: usize) -> Option<(Vec3, f32)> {
        self.0.refract(wo, lane)
    }
}
