//! A transparent layer over another material: the model of Weidlich and Wilkie 2007, *Arbitrarily Layered Micro-Facet Surfaces*, as
//! version 0.6 of Mitsuba documents it for `coating` and `roughcoating`.
//!
//! Light is reflected by the layer, or refracted into it, scattered by the material within, and refracted out again. What the layer
//! throws back to the material within is lost, and so the surface returns less than `plastic` does. With η the index of the layer over that of
//! the outside, T its transmittance and primes for refracted directions,
//!
//! f(ωₒ, ωᵢ) = f′(ωₒ′, ωᵢ′) · T(ωₒ) T(ωᵢ) / η² · exp(−σ d (1/|cos θₒ′| + 1/|cos θᵢ′|)):
//!
//! the flux that enters is E′ = T E, and the radiance that leaves L = T L′ / η². A density of refracted directions becomes one of
//! directions outside by dω′/dω = |cos θᵢ| / (η² |cos θᵢ′|). Coats cover both sides alike.
//!
//! A coat over several materials in shares is the same as these materials with a coat each, so that it is a property of a part of a
//! [mixture](super::Mixture) and no model of its own.

use glam::{Vec3, Vec4};

use crate::math::pdf::PdfW;
use crate::math::warp;
use crate::scene::desc::CoatDesc;
use crate::scene::desc::texture::{SpectrumTexture, TexturePoint};
use crate::spectrum::{SampledSpectrum, SampledWavelengths};

use super::plastic::{Coat, CoatSample, Transmittance};
use super::scattering::{BsdfSample, LAST_LOBE, LEAST_LOBE, ScatteringModel, lobe_probability};
use super::{Microfacet, fresnel};

/// A coat before the wavelengths of a path are known.
#[derive(Clone, Debug)]
pub struct CoatingMaterial {
    eta: f32,
    thickness: f32,
    sigma_a: SpectrumTexture,
    reflectance: SpectrumTexture,
    /// The facets of a rough coat, with their table.
    rough: Option<Coat>,
    /// Share of the reflection in the choice between it and what is within, where both have the same light.
    share: f32,
}

impl CoatingMaterial {
    /// The coat of a description. The table of a rough one is taken over from one of `before`, if it has the same facets.
    pub fn new(desc: &CoatDesc<'_>, before: impl IntoIterator<Item = Coat>) -> Self {
        let CoatDesc { eta, thickness, .. } = *desc;
        let rough = desc.roughness.filter(|_| eta != 1.0).map(|roughness| {
            let microfacet = Microfacet::new(roughness);
            let same = |coat: &Coat| (coat.eta, coat.microfacet) == (eta, microfacet);
            let known = before.into_iter().find(same);
            known.unwrap_or_else(|| Coat {
                eta,
                microfacet,
                transmittance: Transmittance::of(&microfacet, eta),
            })
        });
        let (sigma_a, reflectance) = (desc.sigma_a.clone(), desc.specular_reflectance.clone());
        let [reflected, within] =
            [reflectance.mean_scalar(), (-2.0 * sigma_a.mean_scalar() * thickness).exp()];
        let share = reflected / (reflected + within.max(f32::MIN_POSITIVE));
        Self { eta, thickness, sigma_a, reflectance, rough, share: share.clamp(0.0, 1.0) }
    }

    /// The table of a rough coat.
    pub fn rough(&self) -> Option<Coat> {
        self.rough
    }

    /// The coat at a point and the wavelengths of a path.
    pub fn at(&self, at: &TexturePoint, lambda: &SampledWavelengths) -> Coating {
        Coating {
            eta: self.eta,
            depth: SampledSpectrum(
                (self.sigma_a.sample(at, lambda) * self.thickness).0.min(Vec4::splat(f32::MAX)),
            ),
            reflectance: self.reflectance.sample(at, lambda),
            rough: self.rough,
            share: self.share,
        }
    }
}

/// A coat at the wavelengths of a path.
#[derive(Clone, Copy, Debug)]
pub struct Coating {
    eta: f32,
    /// σ d.
    depth: SampledSpectrum,
    reflectance: SampledSpectrum,
    rough: Option<Coat>,
    share: f32,
}

/// The direction `w` through an interface to a medium of relative index `eta`, on the same side; `None` where all is reflected.
fn refracted(w: Vec3, eta: f32) -> Option<Vec3> {
    if eta == 1.0 {
        return Some(w);
    }
    let (cos, across) = (fresnel::through(w.z.abs(), eta)? / eta, w.truncate() / eta);
    // Near the normal a cosine has few digits of the sine, and light that fans out would lose them.
    let cos = match across.length_squared() {
        sin2 if eta < 1.0 && w.z.abs() > 0.5 => (1.0 - sin2).max(0.0).sqrt(),
        _ => cos.min(1.0),
    };
    Some(across.extend(cos.copysign(w.z)))
}

impl Coating {
    /// True for a rough coat.
    pub fn is_rough(&self) -> bool {
        self.rough.is_some()
    }

    /// Over this material.
    pub(super) fn over<B>(&self, within: B) -> Coated<'_, B> {
        Coated { coat: self, within }
    }

    /// The share of light from `w` that is refracted into the coat.
    fn transmittance(&self, w: Vec3) -> f32 {
        let cos = w.z.abs().min(1.0);
        match &self.rough {
            Some(coat) => coat.transmittance.at(cos),
            None => 1.0 - fresnel::dielectric(cos, Vec4::splat(self.eta)).x,
        }
    }

    /// Transmittance of the coat for light that enters from one of two directions and leaves in the other; both `outside`, and refracted `within`.
    fn passes(&self, outside: [Vec3; 2], within: [Vec3; 2]) -> SampledSpectrum {
        let [a, b] = outside.map(|w| self.transmittance(w));
        let [c, d] = within.map(|w| 1.0 / w.z.abs());
        // A clear coat of no index is nothing also where light grazes.
        let kept = (-self.depth.0 * (c + d)).map(f32::exp);
        let kept = Vec4::select(self.depth.0.cmpgt(Vec4::ZERO), kept, Vec4::ONE);
        SampledSpectrum(kept * (a * b))
    }

    /// f·|cos θᵢ| of the reflection by the coat, and the density with which it is sampled; `None` where it is a delta.
    fn reflection(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, f32)> {
        let coat = self.rough.as_ref().filter(|_| wo.z * wi.z > 0.0)?;
        let up = |w: Vec3| w.with_z(w.z.abs());
        let (value, density) = coat.reflection(up(wo), up(wi))?;
        Some((self.reflectance * value, density))
    }

    /// Chooses the reflection; `p` is the probability of that.
    fn sample_reflection(&self, wo: Vec3, u: [f32; 2], p: f32) -> Option<BsdfSample> {
        let Some(coat) = &self.rough else {
            let r = fresnel::dielectric(wo.z.abs().min(1.0), Vec4::splat(self.eta)).x;
            return Some(BsdfSample::mirror(wo, self.reflectance * (r / p), p));
        };
        let CoatSample { wi, delta } = coat.sample_reflection(wo.with_z(wo.z.abs()), u);
        if wi.z <= 0.0 {
            return None;
        }
        let wi = wi.with_z(wi.z.copysign(wo.z));
        Some(match delta {
            Some(weight) => BsdfSample::delta(wi, self.reflectance * (weight / p), p),
            // `eval` says the rest.
            None => BsdfSample::reflection(wi, SampledSpectrum::ZERO, PdfW(p)),
        })
    }
}

/// A material under a coat.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coated<'a, B> {
    coat: &'a Coating,
    within: B,
}

impl<B: ScatteringModel> Coated<'_, B> {
    /// Probability of choosing the reflection; `None` where nothing is chosen.
    fn chance(&self, wo: Vec3) -> Option<f32> {
        if self.within.as_diffuse().is_some_and(|diffuse| diffuse.albedo.is_black()) {
            return Some(1.0);
        }
        let through = self.coat.transmittance(wo);
        let (reflected, within) = ((1.0 - through) * self.coat.share, through * (1.0 - self.coat.share));
        (reflected + within > 0.0).then(|| lobe_probability(reflected / (reflected + within)))
    }

    /// Both directions refracted, and dω′/dω of the second.
    fn inwards(&self, wo: Vec3, wi: Vec3) -> Option<([Vec3; 2], f32)> {
        let eta = self.coat.eta;
        let within = [refracted(wo, eta)?, refracted(wi, eta)?];
        let narrowing = if eta == 1.0 { 1.0 } else { (wi.z / within[1].z).abs() / (eta * eta) };
        Some((within, narrowing))
    }

    /// f·|cos θᵢ| and density of what is within, chosen alone. Of a diffuse material directions outside are chosen: those within would for the
    /// most part not get out.
    fn within(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, f32)> {
        let (within, narrowing) = self.inwards(wo, wi)?;
        let (value, density) = match self.within.as_diffuse() {
            Some(diffuse) => {
                let (value, PdfW(density)) = diffuse.eval(wo, wi)?;
                (value * (1.0 / (self.coat.eta * self.coat.eta)), density)
            }
            None => {
                let (value, PdfW(density)) = self.within.eval(within[0], within[1])?;
                (value * narrowing, density * narrowing)
            }
        };
        Some((value * self.coat.passes([wo, wi], within), density))
    }

    /// Chooses with `sample`, which is that of the material within or its form from lights, with the density `pdf`.
    fn sample_by(
        &self,
        wo: Vec3,
        u: [f32; 2],
        lobe: f32,
        sample: impl FnOnce(&B, Vec3, [f32; 2], f32) -> Option<BsdfSample>,
    ) -> Option<BsdfSample> {
        let p = self.chance(wo)?;
        if lobe < p {
            return self.coat.sample_reflection(wo, u, p);
        }
        if self.within.as_diffuse().is_some() {
            let wi = warp::cosine_hemisphere(u);
            return (wo.z > 0.0).then(|| BsdfSample::reflection(wi, SampledSpectrum::ZERO, PdfW(1.0 - p)));
        }
        let eta = self.coat.eta;
        let inner = refracted(wo, eta)?;
        let s = sample(&self.within, inner, u, ((lobe - p) / (1.0 - p)).min(LAST_LOBE))?;
        // Mirrored and straight directions are those of the reflection above, bit for bit.
        let wi = match s.wi {
            w if w == Vec3::new(-inner.x, -inner.y, inner.z) => Vec3::new(-wo.x, -wo.y, wo.z),
            w if w == -inner => -wo,
            w => refracted(w, 1.0 / eta)?,
        };
        let weight = s.weight * self.coat.passes([wo, wi], [inner, s.wi]) * (1.0 / (1.0 - p));
        Some(BsdfSample { wi, weight, pdf: PdfW(s.pdf.0 * (1.0 - p)), ..s })
    }
}

impl<B: ScatteringModel> ScatteringModel for Coated<'_, B> {
    /// The reflection of a rough coat, and what is within.
    #[inline(never)]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        let p = self.chance(wo)?;
        let (mut value, mut pdf) = (SampledSpectrum::ZERO, 0.0);
        if let Some((v, density)) = self.coat.reflection(wo, wi) {
            (value, pdf) = (v, p * density);
        }
        if p < 1.0
            && let Some((v, density)) = self.within(wo, wi)
        {
            value += v;
            pdf += (1.0 - p) * density;
        }
        (pdf > 0.0).then_some((value, PdfW(pdf)))
    }

    #[inline(never)]
    fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        let s = self.sample_by(wo, u, lobe, |within, wo, u, lobe| within.sample(wo, u, lobe))?;
        if s.delta {
            return Some(s);
        }
        let (value, pdf) = self.eval(wo, s.wi)?;
        Some(BsdfSample { weight: value * (1.0 / pdf.0), pdf, ..s })
    }

    #[inline(never)]
    fn sample_from_light(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        let s = self.sample_by(wo, u, lobe, |within, wo, u, lobe| within.sample_from_light(wo, u, lobe))?;
        if s.delta {
            return Some(s);
        }
        // By the value of the reverse, which is known for whatever is within.
        let pdf = self.pdf_from_light(wo, s.wi);
        let weight = self.eval(s.wi, wo)?.0 * ((s.wi.z / wo.z).abs() / pdf);
        Some(BsdfSample { weight, pdf: PdfW(pdf), ..s })
    }

    fn pdf_from_light(&self, wo: Vec3, wi: Vec3) -> f32 {
        let Some(p) = self.chance(wo) else { return 0.0 };
        let reflection = self.coat.reflection(wo, wi).map_or(0.0, |(_, density)| density);
        if p >= 1.0 {
            return reflection;
        }
        let within = match self.within.as_diffuse() {
            Some(diffuse) => diffuse.pdf_from_light(wo, wi),
            None => self
                .inwards(wo, wi)
                .map_or(0.0, |([wo, wi], narrowing)| self.within.pdf_from_light(wo, wi) * narrowing),
        };
        p * reflection + (1.0 - p) * within
    }

    fn delta_lobe(&self, wo: Vec3, lobe: f32, transmitted: bool) -> f32 {
        match self.chance(wo) {
            _ if transmitted => LAST_LOBE,
            // A little beyond the first number, so that rounding does not choose the reflection: no delta within is as rare.
            Some(p) if lobe >= p => p + (1.0 - p) * (0.25 * LEAST_LOBE),
            _ => 0.0,
        }
    }
}
