//! A rough interface between two transparent media, with dispersion (Walter et al., *Microfacet Models for
//! Refraction through Rough Surfaces*, EGSR 2007, eq. 20 and 21).

use glam::{Vec3, Vec4};

use crate::math::pdf::PdfW;
use crate::spectrum::SampledSpectrum;

use super::microfacet::Microfacet;
use super::{BsdfSample, fresnel};

/// A microfacet interface: each facet is a smooth dielectric and scatters once.
///
/// The facet and the lobe are the same for all lanes; reflection is right for every one of them. With dispersion
/// each lane refracts elsewhere, and as in [`Dielectric`](super::Dielectric) only the hero goes on: a sample says so,
/// and while companions are carried the value of a refraction is the hero's alone, four times: it stands for all
/// four lanes, as it does after a sample. Thus light found by sampling the light and by sampling the material is one
/// quantity, and multiple importance sampling is right.
#[derive(Clone, Copy, Debug)]
pub struct RoughDielectric {
    /// Index behind over index in front, per lane.
    eta: Vec4,
    reflection: SampledSpectrum,
    transmission: SampledSpectrum,
    microfacet: Microfacet,
    dispersive: bool,
    hero_only: bool,
}

/// Both directions on the side where `wo` is above the horizon.
struct Facing {
    wo: Vec3,
    /// Index of the far side over that of the near side, per lane.
    eta: Vec4,
    /// +1, or −1 where the surface is seen from behind: the factor on z.
    side: f32,
}

/// One facet seen from `wo`.
struct Facet {
    m: Vec3,
    /// Cosine to `wo`.
    cos: f32,
    /// Reflectance per lane, and the share of samples that reflect.
    r: Vec4,
    q: f32,
    /// Density of the facet over its cosine: D(m) / σ(wo).
    density: f32,
}

impl RoughDielectric {
    /// `eta` = [behind, in front]; `factors` = [reflection, transmission]; `flags` = (the media disperse, only
    /// the hero wavelength is carried).
    ///
    /// `None` when the indices are so close (1e-4, reflectance below 3e-9) that no facet can be told from the
    /// directions: then the surface is a smooth [`Dielectric`](super::Dielectric) that lets everything through.
    #[inline]
    pub fn new(
        eta: [SampledSpectrum; 2],
        factors: [SampledSpectrum; 2],
        microfacet: Microfacet,
        flags: (bool, bool),
    ) -> Option<Self> {
        let [reflection, transmission] = factors;
        let (dispersive, hero_only) = flags;
        let eta = eta[0].0 / eta[1].0;
        let apart = (eta.x - 1.0).abs() > 1e-4;
        apart.then_some(Self { eta, reflection, transmission, microfacet, dispersive, hero_only })
    }

    /// Reflection for `wi` on the side of `wo`, refraction on the other.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        let facing = self.facing(wo)?;
        let wi = Vec3::new(wi.x, wi.y, wi.z * facing.side);
        if wi.z > 0.0 {
            let facet = self.facet(&facing, (facing.wo + wi).normalize_or_zero())?;
            let pdf = 0.25 * facet.q * facet.density;
            let value = SampledSpectrum(facet.r * (0.25 * facet.density * self.microfacet.g1(wi)));
            return (pdf > 0.0).then_some((value * self.reflection, PdfW(pdf)));
        }
        // From the lighter medium's side the sum points into the denser one.
        let half = facing.wo + wi * facing.eta.x;
        let facet = self.facet(&facing, half.normalize_or_zero() * 1f32.copysign(half.z))?;
        let cos_i = -wi.dot(facet.m);
        if cos_i <= 0.0 || wi.z == 0.0 {
            return None;
        }
        let jacobian = jacobian(&facing, &facet, cos_i);
        let pdf = (1.0 - facet.q) * facet.density * facet.cos * jacobian;
        let scale = facet.density * facet.cos * jacobian * self.microfacet.g1(wi);
        (pdf > 0.0)
            .then_some((self.transmittance(&facing, &facet) * scale * self.hero_stands_for(), PdfW(pdf)))
    }

    /// Reflects or refracts in a visible facet.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        let facing = self.facing(wo)?;
        let facet = self.facet(&facing, self.microfacet.sample_visible(facing.wo, u))?;
        let Facet { m, cos, q, density, .. } = facet;
        let reflects = lobe < q;
        let hero = facing.eta.x;
        let (wi, weight, pdf, eta2) = if reflects {
            let wi = m * (2.0 * cos) - facing.wo;
            (wi, SampledSpectrum(facet.r / q) * self.reflection, 0.25 * q * density, 1.0)
        } else {
            let cos_i = (1.0 - (1.0 - cos) * (1.0 + cos) / (hero * hero)).max(0.0).sqrt();
            let wi = m * (cos / hero - cos_i) - facing.wo / hero;
            let pdf = (1.0 - q) * density * cos * jacobian(&facing, &facet, cos_i);
            (wi, self.transmittance(&facing, &facet) * (1.0 / (1.0 - q)), pdf, hero * hero)
        };
        let wi = wi.normalize();
        let right_side = if reflects { wi.z > 0.0 } else { wi.z < 0.0 };
        if !right_side || pdf.is_nan() || pdf <= 0.0 {
            return None;
        }
        Some(BsdfSample {
            wi: Vec3::new(wi.x, wi.y, wi.z * facing.side),
            weight: weight * self.microfacet.g1(wi),
            pdf: PdfW(pdf),
            delta: false,
            transmitted: !reflects,
            hero_only: !reflects && self.dispersive && !self.hero_only,
            eta2,
        })
    }

    /// `None` for a grazing view, which meets no facet.
    #[inline]
    fn facing(&self, wo: Vec3) -> Option<Facing> {
        let (eta, side) = if wo.z > 0.0 { (self.eta, 1.0) } else { (1.0 / self.eta, -1.0) };
        (wo.z != 0.0).then(|| Facing { wo: Vec3::new(wo.x, wo.y, wo.z * side), eta, side })
    }

    /// `None` for a facet that is not seen, or where there is none.
    #[inline]
    fn facet(&self, facing: &Facing, m: Vec3) -> Option<Facet> {
        let cos = facing.wo.dot(m).min(1.0);
        let density = self.microfacet.d(m) / self.microfacet.cross_section(facing.wo);
        if cos.is_nan() || cos <= 0.0 || density <= 0.0 {
            return None;
        }
        let r = fresnel::dielectric(cos, facing.eta);
        let q = if self.hero_only { r.x } else { r.element_sum() * 0.25 };
        Some(Facet { m, cos, r, q, density })
    }

    /// (1 − F)·factor·(nₒ/nᵢ)² per lane.
    #[inline]
    fn transmittance(&self, facing: &Facing, facet: &Facet) -> SampledSpectrum {
        SampledSpectrum((1.0 - facet.r) / (facing.eta.x * facing.eta.x)) * self.transmission
    }

    /// What the value of a refraction at the hero wavelength counts for, per lane.
    #[inline]
    fn hero_stands_for(&self) -> SampledSpectrum {
        let alone = self.dispersive && !self.hero_only;
        SampledSpectrum(if alone { Vec4::X * 4.0 } else { Vec4::ONE })
    }
}

/// Solid angle of facets per solid angle of refracted directions, for the hero (Walter et al., eq. 17).
#[inline]
fn jacobian(facing: &Facing, facet: &Facet, cos_i: f32) -> f32 {
    let eta = facing.eta.x;
    let half = facet.cos - eta * cos_i;
    eta * eta * cos_i / (half * half)
}
