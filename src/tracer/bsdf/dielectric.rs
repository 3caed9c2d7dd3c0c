//! Interfaces between two transparent media, smooth and rough, with dispersion. The rough one is that of Walter et al., *Microfacet
//! Models for Refraction through Rough Surfaces*, EGSR 2007, eq. 20 and 21.

use glam::{Vec3, Vec4};

use crate::math::pdf::PdfW;
use crate::scene::desc::texture::TexturePoint;
use crate::scene::desc::{AlphaTexture, DielectricDesc, RoughDielectricDesc};
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::wavelength_mis::{self, Dispersion, WavelengthMis};

use super::microfacet::{bend, refracting_half, refracting_normal};
use super::scattering::lobe_probability;
use super::{BsdfSample, DeltaLobes, MaterialModel, Microfacet, ScatteringModel, Unmixed, fresnel};

/// A smooth interface, which needs no preparation.
pub type DielectricMaterial = DielectricDesc;

impl MaterialModel for DielectricMaterial {
    type Bsdf = Dielectric;

    #[inline]
    fn bsdf(&self, at: &TexturePoint, lambda: &SampledWavelengths) -> Dielectric {
        let factors =
            [self.specular_reflectance.sample(at, lambda), self.specular_transmittance.sample(at, lambda)];
        Dielectric::new([self.int_ior.sample(lambda), self.ext_ior.sample(lambda)], factors)
    }
}

/// A smooth dielectric.
///
/// Reflection is the same direction for every wavelength, refraction is not when the media are dispersive: then
/// each wavelength goes its own way ([`ScatteringModel::refract`]). The lobe is chosen by the mean reflectance of the carried
/// wavelengths, whichever is the hero, and each lane gets its own reflectance over that mean: the single-sample
/// estimator with the balance heuristic over wavelengths (Wilkie et al., *Hero Wavelength Spectral Sampling*, 2014, §3).
#[derive(Clone, Copy, Debug)]
pub struct Dielectric {
    /// Index behind over index in front, per lane.
    eta: Vec4,
    reflection: SampledSpectrum,
    transmission: SampledSpectrum,
    is_dispersive: bool,
}

impl Dielectric {
    /// `eta` = [behind, in front]; `factors` = [reflection, transmission].
    #[inline]
    pub fn new(eta: [SampledSpectrum; 2], factors: [SampledSpectrum; 2]) -> Self {
        let eta = eta[0].0 / eta[1].0;
        let [reflection, transmission] = factors;
        Self { eta, reflection, transmission, is_dispersive: wavelength_mis::disperses(eta) }
    }

    /// The refraction where `eta` is the index of the far side over that of the near side and `r` the reflectance, chosen with this
    /// probability.
    #[inline]
    fn refracted(&self, wo: Vec3, eta: Vec4, r: Vec4, probability: f32) -> Option<BsdfSample> {
        let hero_only = self.is_dispersive;
        let wi = match refract(wo, eta.x) {
            Some(wi) => wi,
            None if hero_only => -wo,
            None => return None,
        };
        let (pdf, eta2) = (PdfW(probability), eta * eta);
        let weight = SampledSpectrum((1.0 - r) / (probability * eta2)) * self.transmission;
        Some(BsdfSample { wi, weight, pdf, delta: true, transmitted: true, hero_only, eta2: eta2.x })
    }

    /// Index of the far side over that of the side of `wo`.
    #[inline]
    fn eta_from(&self, wo: Vec3) -> Vec4 {
        if wo.z >= 0.0 { self.eta } else { 1.0 / self.eta }
    }
}

impl ScatteringModel for Dielectric {
    /// Reflects or refracts; always delta. Where the hero alone is totally reflected, a refraction has its lane black
    /// and no direction of its own: straight through.
    #[inline]
    fn sample(&self, wo: Vec3, _: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        let eta = self.eta_from(wo);
        let r = fresnel::dielectric(wo.z.abs().min(1.0), eta);
        let q = lobe_probability(r.element_sum() * 0.25);
        match lobe < q {
            true => Some(BsdfSample::mirror(wo, SampledSpectrum(r / q) * self.reflection, q)),
            false => self.refracted(wo, eta, r, 1.0 - q),
        }
    }

    #[inline]
    fn is_delta(&self) -> bool {
        true
    }

    #[inline]
    fn delta_lobes(&self, wo: Vec3) -> DeltaLobes {
        let eta = self.eta_from(wo);
        let r = fresnel::dielectric(wo.z.abs().min(1.0), eta);
        let refracts = r.element_sum() < 4.0;
        let mirrored = BsdfSample::mirror(wo, SampledSpectrum(r) * self.reflection, 1.0);
        [Some(mirrored), if refracts { self.refracted(wo, eta, r, 1.0) } else { None }]
    }

    #[inline]
    fn is_dispersive(&self) -> bool {
        self.is_dispersive
    }

    #[inline]
    fn refract(&self, wo: Vec3, lane: usize) -> Option<(Vec3, f32)> {
        let eta = self.eta_from(wo)[lane];
        Some((refract(wo, eta)?, eta * eta))
    }
}

/// Snell's law: `eta` = index of the far side over that of the near side. `None` on total reflection.
/// Straight through, to the bit, for `eta` = 1.
#[inline]
fn refract(wo: Vec3, eta: f32) -> Option<Vec3> {
    if eta == 1.0 {
        return Some(-wo);
    }
    let through = fresnel::through(wo.z.abs().min(1.0), eta)?;
    let inverse = 1.0 / eta;
    Some(Vec3::new(-wo.x * inverse, -wo.y * inverse, -(through * inverse).copysign(wo.z)).normalize())
}

/// A rough interface.
#[derive(Clone, Debug)]
pub struct RoughDielectricMaterial {
    /// The interface as it would be without facets.
    smooth: DielectricMaterial,
    microfacet: Microfacet,
    /// Its roughness, where that varies.
    alpha: Option<Box<AlphaTexture>>,
}

impl From<RoughDielectricDesc> for RoughDielectricMaterial {
    fn from(desc: RoughDielectricDesc) -> Self {
        let RoughDielectricDesc { int_ior, ext_ior, specular_reflectance, specular_transmittance, .. } = desc;
        let smooth = DielectricMaterial { int_ior, ext_ior, specular_reflectance, specular_transmittance };
        Self { smooth, microfacet: Microfacet::new(desc.roughness), alpha: desc.alpha }
    }
}

impl MaterialModel for RoughDielectricMaterial {
    type Bsdf = Unmixed;

    /// A smooth interface where the indices are the same.
    #[inline]
    fn bsdf(&self, at: &TexturePoint, lambda: &SampledWavelengths) -> Unmixed {
        let smooth = self.smooth.bsdf(at, lambda);
        match RoughDielectric::new(smooth, &self.microfacet.textured(self.alpha.as_deref(), at)) {
            Some(rough) => rough.into(),
            None => smooth.into(),
        }
    }
}

/// A microfacet interface: each facet is a smooth dielectric and scatters once.
///
/// The facet and the lobe are the hero's; reflection has one direction for all lanes and one density, the share of
/// reflections being the mean reflectance of the lanes. With dispersion a pair of directions belongs to another facet at
/// each wavelength: every lane's value is that of its own, and [`ScatteringModel::dispersion`] says how readily each would have
/// chosen it. Values and weights of a refraction hold the factor of [`WavelengthMis::of`].
///
/// Where the two indices are so close that all refracted directions are one in single precision ([`Microfacet::resolves`]), refraction
/// is a delta, whose lanes go as through a smooth interface. What passes straight is not hidden: the facets in its way are as clear.
#[derive(Clone, Copy, Debug)]
pub struct RoughDielectric {
    smooth: Dielectric,
    microfacet: Microfacet,
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
    /// Reflectance per lane, and the probability of reflection.
    r: Vec4,
    q: f32,
    /// Density of the facet over its cosine: D(m) / σ(wo).
    density: f32,
}

impl RoughDielectric {
    /// The interface of `smooth` with these facets. `None` where the indices are the same: then the surface is `smooth`, which lets
    /// everything through.
    #[inline]
    pub fn new(smooth: Dielectric, microfacet: &Microfacet) -> Option<Self> {
        (smooth.eta.x != 1.0).then_some(Self { smooth, microfacet: *microfacet })
    }

    /// `None` for a grazing view, which meets no facet.
    #[inline]
    fn facing(&self, wo: Vec3) -> Option<Facing> {
        let (eta, side) = (self.smooth.eta_from(wo), if wo.z > 0.0 { 1.0 } else { -1.0 });
        (wo.z != 0.0).then(|| Facing { wo: Vec3::new(wo.x, wo.y, wo.z * side), eta, side })
    }

    /// `None` for a facet that is not seen, or where there is none; `cos` is its cosine to `wo`.
    #[inline]
    fn facet(&self, facing: &Facing, m: Vec3, cos: f32) -> Option<Facet> {
        let cos = cos.min(1.0);
        let density = self.microfacet.d(m) / self.microfacet.cross_section(facing.wo);
        if cos.is_nan() || cos <= 0.0 || density <= 0.0 {
            return None;
        }
        let r = fresnel::dielectric(cos, facing.eta);
        let q = lobe_probability(r.element_sum() * 0.25);
        Some(Facet { m, cos, r, q, density })
    }

    /// The value of a refraction per lane, each by the facet that refracts it so, without colour and masking of `wi`.
    fn lanes(&self, facing: &Facing, wi: Vec3) -> Vec4 {
        let over_section = 1.0 / self.microfacet.cross_section(facing.wo);
        let lane = |eta: f32| {
            let half = refracting_half(facing.wo, wi, eta);
            let m = refracting_normal(half);
            let cos = facing.wo.dot(m).min(1.0);
            let lit = cos > 0.0 && wi.dot(m) < 0.0;
            let passed = 1.0 - fresnel::dielectric(cos.max(0.0), Vec4::splat(eta)).x;
            let through = fresnel::through(cos, eta).unwrap_or(0.0);
            let bend = bend(cos, eta, through);
            let value = self.microfacet.d(m) * over_section * cos * through * passed / (eta * bend * bend);
            // A NaN is no value.
            let resolved = self.microfacet.resolves_refraction(half, facing.wo, eta);
            if lit && value > 0.0 && resolved { value.min(f32::MAX) } else { 0.0 }
        };
        Vec4::from_array(facing.eta.to_array().map(lane))
    }
}

impl ScatteringModel for RoughDielectric {
    /// Reflection for `wi` on the side of `wo`, refraction on the other.
    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        let facing = self.facing(wo)?;
        let wi = Vec3::new(wi.x, wi.y, wi.z * facing.side);
        if wi.z > 0.0 {
            let half = facing.wo + wi;
            if !self.microfacet.resolves(half) {
                return None;
            }
            // As a product of the normal and a direction the cosine would have lost its digits where both directions graze.
            let length = half.length();
            let facet = self.facet(&facing, half * (1.0 / length), 0.5 * length)?;
            let pdf = 0.25 * facet.q * facet.density;
            let value = SampledSpectrum(facet.r * (0.25 * facet.density * self.microfacet.g1(wi)));
            return (pdf > 0.0).then_some((value * self.smooth.reflection, PdfW(pdf)));
        }
        let eta = facing.eta.x;
        let half = refracting_half(facing.wo, wi, eta);
        let m = refracting_normal(half);
        let facet = self.facet(&facing, m, facing.wo.dot(m))?;
        let through = fresnel::through(facet.cos, eta)?;
        let bend = bend(facet.cos, eta, through);
        if wi.dot(facet.m) >= 0.0 || wi.z == 0.0 || !self.microfacet.resolves_refraction(half, facing.wo, eta)
        {
            return None;
        }
        let jacobian = eta * through / (bend * bend);
        let pdf = (1.0 - facet.q) * facet.density * facet.cos * jacobian;
        let g1 = self.microfacet.g1(wi);
        let value = if self.smooth.is_dispersive {
            let lanes = self.lanes(&facing, wi);
            lanes * WavelengthMis::of(lanes * facing.eta).map_or(0.0, |(_, own)| own)
        } else {
            (1.0 - facet.r) * (facet.density * facet.cos * jacobian / (eta * eta))
        };
        (pdf > 0.0).then_some((SampledSpectrum(value * g1) * self.smooth.transmission, PdfW(pdf)))
    }

    /// Reflects or refracts in a visible facet.
    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        let facing = self.facing(wo)?;
        let m = self.microfacet.sample_visible(facing.wo, u);
        let facet = self.facet(&facing, m, facing.wo.dot(m))?;
        let Facet { m, cos, q, density, .. } = facet;
        let reflects = lobe < q;
        let hero = facing.eta.x;
        let (wi, weight, pdf, eta2) = if reflects {
            let wi = m * (2.0 * cos) - facing.wo;
            (wi, SampledSpectrum(facet.r / q) * self.smooth.reflection, 0.25 * q * density, 1.0)
        } else {
            let through = fresnel::through(cos, hero)?;
            let bend = bend(cos, hero, through);
            let wi = (facing.wo + m * bend) * (-1.0 / hero);
            let pdf = (1.0 - q) * density * cos * hero * through / (bend * bend);
            let scale = 1.0 / (hero * hero * (1.0 - q));
            let weight = SampledSpectrum((1.0 - facet.r) * scale) * self.smooth.transmission;
            (wi, weight, pdf, hero * hero)
        };
        let wi = wi.normalize();
        // By the rounded direction, as `eval` will see it.
        let delta = match reflects {
            true => !self.microfacet.resolves(facing.wo + wi),
            false => {
                let half = refracting_half(facing.wo, wi, hero);
                !self.microfacet.resolves_refraction(half, facing.wo, hero)
            }
        };
        let straight = delta && !reflects;
        let weight = if self.smooth.is_dispersive && !reflects && !delta {
            // The hero's weight, to each lane's value over the hero's.
            let lanes = self.lanes(&facing, wi);
            let g = lanes * facing.eta;
            WavelengthMis::of(g)?;
            let own = (1.0 - facet.r.x) / (hero * (1.0 - q) * g.max_element());
            SampledSpectrum(lanes * own) * self.smooth.transmission
        } else {
            weight
        };
        let right_side = if reflects { wi.z > 0.0 } else { wi.z < 0.0 };
        let chosen = if reflects { q } else { 1.0 - q };
        let pdf = if delta { chosen } else { pdf };
        if !right_side || pdf.is_nan() || pdf <= 0.0 {
            return None;
        }
        Some(BsdfSample {
            wi: Vec3::new(wi.x, wi.y, wi.z * facing.side),
            weight: if straight { weight } else { weight * self.microfacet.g1(wi) },
            pdf: PdfW(pdf),
            delta,
            transmitted: !reflects,
            hero_only: straight && self.smooth.is_dispersive,
            eta2,
        })
    }

    #[inline]
    fn is_glossy(&self) -> bool {
        true
    }

    #[inline]
    fn transmits(&self) -> bool {
        true
    }

    #[inline]
    fn is_dispersive(&self) -> bool {
        self.smooth.is_dispersive
    }

    #[inline]
    fn refract(&self, wo: Vec3, lane: usize) -> Option<(Vec3, f32)> {
        self.smooth.refract(wo, lane)
    }

    /// The shares of the lanes in a refraction between `wo` and `wi`. Lanes do not part in a reflection.
    fn dispersion(&self, wo: Vec3, wi: Vec3) -> Dispersion {
        let Some(facing) = self.facing(wo).filter(|_| self.smooth.is_dispersive && wo.z * wi.z < 0.0) else {
            return Dispersion::NONE;
        };
        let lanes = self.lanes(&facing, Vec3::new(wi.x, wi.y, wi.z * facing.side));
        // With the index it is the same from both sides.
        let wavelength_mis = WavelengthMis::of(lanes * facing.eta)
            .map_or(WavelengthMis::ALL, |(wavelength_mis, _)| wavelength_mis);
        let relative = facing.eta / facing.eta.x;
        Dispersion { wavelength_mis, eta2: relative * relative }
    }
}
