//! A rough interface as the paper has it, in single precision, line by line: Walter et al., *Microfacet Models for Refraction through Rough
//! Surfaces*, EGSR 2007. The naive method beside the renderer's.

use std::f32::consts::{PI, TAU};

use glam::Vec3;

use pointillist::math::pdf::PdfW;
use pointillist::spectrum::SampledSpectrum;
use pointillist::tracer::bsdf::{BsdfSample, ScatteringModel};

/// GGX facets of roughness `alpha` between media, `eta` = index behind over that in front.
#[derive(Clone, Copy, Debug)]
pub struct Textbook {
    pub alpha: f32,
    pub eta: f32,
}

impl Textbook {
    /// Equation 33.
    fn d(&self, m: Vec3) -> f32 {
        let (cos2, alpha2) = (m.z * m.z, self.alpha * self.alpha);
        let tan2 = (1.0 - cos2) / cos2;
        if m.z > 0.0 { alpha2 / (PI * cos2 * cos2 * (alpha2 + tan2).powi(2)) } else { 0.0 }
    }

    /// Equation 34.
    fn g1(&self, v: Vec3, m: Vec3) -> f32 {
        let tan2 = (1.0 - v.z * v.z) / (v.z * v.z);
        if v.dot(m) / v.z > 0.0 { 2.0 / (1.0 + (1.0 + self.alpha * self.alpha * tan2).sqrt()) } else { 0.0 }
    }

    /// Equation 22.
    fn fresnel(c: f32, eta: f32) -> f32 {
        let g2 = eta * eta - 1.0 + c * c;
        if g2 < 0.0 {
            return 1.0;
        }
        let g = g2.sqrt();
        let quotient = (c * (g + c) - 1.0) / (c * (g - c) + 1.0);
        0.5 * ((g - c) / (g + c)).powi(2) * (1.0 + quotient * quotient)
    }

    fn eta_from(&self, wo: Vec3) -> f32 {
        if wo.z > 0.0 { self.eta } else { 1.0 / self.eta }
    }
}

impl ScatteringModel for Textbook {
    /// Equations 20 and 21 with the densities of equations 38 to 41 for normals chosen by D·cos.
    fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        let (eta, side) = (self.eta_from(wo), 1f32.copysign(wo.z));
        let (wo, wi) = (wo.with_z(wo.z * side), wi.with_z(wi.z * side));
        let mirrors = wi.z > 0.0;
        let half = if mirrors { wo + wi } else { -(wo + wi * eta) };
        let m = half.normalize();
        let m = if m.z < 0.0 { -m } else { m };
        let (o, i) = (wo.dot(m), wi.dot(m));
        let f = Self::fresnel(o, eta);
        let g = self.g1(wo, m) * self.g1(wi, m);
        let normals = self.d(m) * m.z;
        let (value, pdf) = if mirrors {
            (f * g * self.d(m) / (4.0 * wo.z), f * normals / (4.0 * i.abs()))
        } else {
            let jacobian = eta * eta * i.abs() / (o + eta * i).powi(2);
            let value = (o / wo.z).abs() * (1.0 - f) * g * self.d(m) * jacobian / (eta * eta);
            (value, (1.0 - f) * normals * jacobian)
        };
        (pdf > 0.0 || pdf.is_nan()).then(|| (SampledSpectrum::splat(value), PdfW(pdf)))
    }

    /// Equations 35, 36, 39 and 40.
    fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        let (eta, side) = (self.eta_from(wo), 1f32.copysign(wo.z));
        let up = wo.with_z(wo.z * side);
        let theta = (self.alpha * (u[0] / (1.0 - u[0])).sqrt()).atan();
        let (sin_phi, cos_phi) = (TAU * u[1]).sin_cos();
        let m = Vec3::new(theta.sin() * cos_phi, theta.sin() * sin_phi, theta.cos());
        let c = up.dot(m);
        if c <= 0.0 {
            return None;
        }
        let transmitted = lobe >= Self::fresnel(c, eta);
        let wi = if transmitted {
            let inverse = 1.0 / eta;
            m * (inverse * c - (1.0 + inverse * inverse * (c * c - 1.0)).sqrt()) - up * inverse
        } else {
            m * (2.0 * c) - up
        };
        if (wi.z < 0.0) != transmitted {
            return None;
        }
        let wi = wi.with_z(wi.z * side);
        let (value, pdf) = self.eval(wo, wi)?;
        let eta2 = if transmitted { eta * eta } else { 1.0 };
        let sample = BsdfSample::reflection(wi, value * (1.0 / pdf.0), pdf);
        Some(BsdfSample { transmitted, eta2, ..sample })
    }
}
