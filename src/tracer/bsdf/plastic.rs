//! A diffuse base under a transparent coat, smooth or rough, one-sided: black from behind.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec3, Vec4};

use crate::math::pdf::PdfW;
use crate::math::warp;
use crate::scene::desc::texture::SpectrumTexture;
use crate::scene::desc::texture::TexturePoint;
use crate::scene::desc::{PlasticDesc, RoughPlasticDesc};
use crate::spectrum::dispersion::{Ior, SODIUM_D};
use crate::spectrum::{SampledSpectrum, SampledWavelengths, Spectrum};

use super::scattering::{carried_mean, lobe_probability};
use super::{BsdfSample, DeltaLobes, MaterialModel, Microfacet, ScatteringModel, fresnel};

/// A diffuse base under a smooth coat.
#[derive(Clone, Debug)]
pub struct PlasticMaterial {
    desc: PlasticDesc,
    /// The share of diffuse light from within that the coat lets out.
    escape: Spectrum,
}

impl From<PlasticDesc> for PlasticMaterial {
    fn from(desc: PlasticDesc) -> Self {
        Self { escape: smooth_escape(&desc.int_ior, &desc.ext_ior), desc }
    }
}

impl MaterialModel for PlasticMaterial {
    type Bsdf = Plastic;

    #[inline]
    fn bsdf(&self, at: &TexturePoint, lambda: &SampledWavelengths) -> Plastic {
        let desc = &self.desc;
        let eta = [desc.int_ior.sample(lambda), desc.ext_ior.sample(lambda)];
        let albedo = desc.diffuse_reflectance.sample(at, lambda);
        let base = Base { albedo, escape: self.escape.sample(lambda), nonlinear: desc.nonlinear };
        Plastic::new(eta, desc.specular_reflectance.sample(at, lambda), base, lambda.is_hero_only())
    }

    fn diffuse_texture(&self) -> Option<&SpectrumTexture> {
        Some(&self.desc.diffuse_reflectance)
    }
}

/// The share of diffuse light from within that a smooth coat lets out; a table over wavelengths where a medium disperses.
fn smooth_escape(int_ior: &Ior, ext_ior: &Ior) -> Spectrum {
    let at = |nm: f32| {
        let lambda = Vec4::splat(nm);
        fresnel::diffuse_escape(int_ior.eval(lambda).x / ext_ior.eval(lambda).x)
    };
    let constant = Spectrum::Constant(at(550.0));
    if !int_ior.is_dispersive() && !ext_ior.is_dispersive() {
        return constant;
    }
    let points: Vec<(f32, f32)> = (0..=50).map(|i| 350.0 + 10.0 * i as f32).map(|nm| (nm, at(nm))).collect();
    Spectrum::table(&points).unwrap_or(constant)
}

/// A smooth coat over Lambert, with the light that the coat sends back to the base; the model of Mitsuba 3's `plastic`.
///
/// Both a delta and a diffuse material: `eval` is the diffuse base alone, and its density counts that the
/// base was chosen; a sample of the coat is delta.
#[derive(Clone, Copy, Debug)]
pub struct Plastic {
    /// Index of the coat over that of the outside, per lane.
    eta: Vec4,
    coat: SampledSpectrum,
    /// Albedo of the base, with internal scattering and 1/η².
    base: SampledSpectrum,
    /// Share of the coat in what can be reflected.
    coat_share: f32,
    hero_only: bool,
}

/// The diffuse base under a coat, and the scattering between the two.
#[derive(Clone, Copy, Debug)]
pub struct Base {
    /// Albedo of the base.
    pub albedo: SampledSpectrum,
    /// The share of diffuse light from within that the coat lets out.
    pub escape: SampledSpectrum,
    /// Light is coloured anew at every reflection from the base, not once.
    pub nonlinear: bool,
}

impl Base {
    /// Albedo of the base with all of its reflections within a coat of index `eta`, over η².
    #[inline]
    fn within(&self, eta: Vec4) -> SampledSpectrum {
        // 1 − each · (1 − escape), without the difference that loses all digits where nearly nothing escapes.
        let each = if self.nonlinear { self.albedo.0 } else { Vec4::ONE };
        let rest = (1.0 - each) + each * self.escape.0;
        SampledSpectrum(self.albedo.0 / (rest * eta * eta))
    }
}

impl Plastic {
    /// `eta` = [coat, outside]; `coat`: factor on the reflection of the coat; `hero_only`: only the hero wavelength
    /// is carried.
    #[inline]
    pub fn new(eta: [SampledSpectrum; 2], coat: SampledSpectrum, base: Base, hero_only: bool) -> Self {
        let eta = eta[0].0 / eta[1].0;
        let coat_share = share(coat, base.albedo, hero_only);
        Self { eta, coat, base: base.within(eta), coat_share, hero_only }
    }

    #[inline]
    fn fresnel(&self, w: Vec3) -> Vec4 {
        fresnel::dielectric(w.z.min(1.0), self.eta)
    }

    /// Probability of choosing the coat; `None` when nothing is reflected at all.
    #[inline]
    fn coat_probability(&self, f_o: Vec4) -> Option<f32> {
        let f = if self.hero_only { f_o.x } else { f_o.element_sum() * 0.25 };
        coat_probability(f, 1.0 - f, self.coat_share)
    }
}

impl ScatteringModel for Plastic {
    /// The base: `albedo / escape · (1 − Fₒ)(1 − Fᵢ) cos θᵢ / (π η²)`.
    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return None;
        }
        let f_o = self.fresnel(wo);
        let pdf = (1.0 - self.coat_probability(f_o)?) * warp::cosine_hemisphere_pdf(wi.z);
        let value = self.base * SampledSpectrum((1.0 - f_o) * (1.0 - self.fresnel(wi)));
        (pdf > 0.0).then_some((value * (wi.z * FRAC_1_PI), PdfW(pdf)))
    }

    /// The mirror direction of the coat, or a cosine-weighted one of the base.
    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let f_o = self.fresnel(wo);
        let p = self.coat_probability(f_o)?;
        if lobe < p {
            return Some(BsdfSample::mirror(wo, SampledSpectrum(f_o / p) * self.coat, p));
        }
        let wi = warp::cosine_hemisphere(u);
        let pdf = PdfW((1.0 - p) * warp::cosine_hemisphere_pdf(wi.z));
        let weight = self.base * SampledSpectrum((1.0 - f_o) * (1.0 - self.fresnel(wi)) / (1.0 - p));
        Some(BsdfSample::reflection(wi, weight, pdf))
    }

    #[inline]
    fn delta_lobes(&self, wo: Vec3) -> DeltaLobes {
        let mirrored = || BsdfSample::mirror(wo, SampledSpectrum(self.fresnel(wo)) * self.coat, 1.0);
        [(wo.z > 0.0).then(mirrored), None]
    }

    #[inline]
    fn has_diffuse_part(&self) -> bool {
        true
    }
}

/// The part of `coat` in the sum of both, as the carried wavelengths see it; 1 when both are black.
#[inline]
fn share(coat: SampledSpectrum, base: SampledSpectrum, hero_only: bool) -> f32 {
    let (coat, base) = (carried_mean(coat, hero_only), carried_mean(base, hero_only));
    if base > 0.0 { coat / (coat + base) } else { 1.0 }
}

/// Probability of choosing a coat that reflects and lets through these parts of the light; `None` when nothing is reflected at all.
#[inline]
fn coat_probability(reflected: f32, through: f32, coat_share: f32) -> Option<f32> {
    let (coat, base) = (reflected * coat_share, through * (1.0 - coat_share));
    (coat + base > 0.0).then(|| lobe_probability(coat / (coat + base)))
}

/// A diffuse base under a rough coat.
#[derive(Clone, Debug)]
pub struct RoughPlasticMaterial {
    coat: Coat,
    /// Factor on the reflection of the coat.
    reflectance: SpectrumTexture,
    /// Albedo of the base.
    base: SpectrumTexture,
    /// The share of diffuse light from within that the coat lets out.
    escape: f32,
    /// Light is coloured at every reflection between coat and base.
    nonlinear: bool,
}

impl From<RoughPlasticDesc> for RoughPlasticMaterial {
    /// Tabulates the coat by its index at the sodium line.
    fn from(desc: RoughPlasticDesc) -> Self {
        let (eta, microfacet) = coat_of(&desc);
        Self {
            coat: Coat { eta, microfacet, transmittance: Transmittance::of(&microfacet, eta) },
            reflectance: desc.specular_reflectance,
            base: desc.diffuse_reflectance,
            escape: 1.0 - internal_reflectance(&microfacet, eta),
            nonlinear: desc.nonlinear,
        }
    }
}

impl RoughPlasticMaterial {
    /// The material of another description, with the tables of this one; `None` where it has another coat.
    pub fn with_same_coat(&self, desc: &RoughPlasticDesc) -> Option<Self> {
        let same = coat_of(desc) == (self.coat.eta, self.coat.microfacet);
        same.then(|| Self {
            reflectance: desc.specular_reflectance.clone(),
            base: desc.diffuse_reflectance.clone(),
            nonlinear: desc.nonlinear,
            ..self.clone()
        })
    }
}

/// Index and facets of a coat.
fn coat_of(desc: &RoughPlasticDesc) -> (f32, Microfacet) {
    let lambda = Vec4::splat(SODIUM_D);
    (desc.int_ior.eval(lambda).x / desc.ext_ior.eval(lambda).x, Microfacet::new(desc.roughness))
}

impl MaterialModel for RoughPlasticMaterial {
    type Bsdf = RoughPlastic;

    #[inline]
    fn bsdf(&self, at: &TexturePoint, lambda: &SampledWavelengths) -> RoughPlastic {
        let escape = SampledSpectrum::splat(self.escape);
        let base = Base { albedo: self.base.sample(at, lambda), escape, nonlinear: self.nonlinear };
        RoughPlastic::new(&self.coat, self.reflectance.sample(at, lambda), base, lambda.is_hero_only())
    }

    fn diffuse_texture(&self) -> Option<&SpectrumTexture> {
        Some(&self.base)
    }
}

/// A rough coat over Lambert, with the light that the coat sends back to the base; the model of Mitsuba 3's
/// `roughplastic`. The index of the coat is the same for all wavelengths, and what it lets through is tabulated over the angle.
#[derive(Clone, Copy, Debug)]
pub struct RoughPlastic {
    coat: Coat,
    /// Factor on the reflection of the coat.
    reflectance: SampledSpectrum,
    /// Albedo of the base, with internal scattering and 1/η².
    base: SampledSpectrum,
    /// Share of the coat in what can be reflected.
    coat_share: f32,
}

/// A rough coat.
#[derive(Clone, Copy, Debug)]
pub struct Coat {
    /// Its index over that of the outside.
    pub eta: f32,
    /// Its facets, the same along both tangents.
    pub microfacet: Microfacet,
    /// The share of light that it lets through, to the base and out again.
    pub transmittance: Transmittance,
}

/// A direction into which a rough coat reflects.
#[derive(Clone, Copy, Debug)]
pub(super) struct CoatSample {
    /// The direction, which may be below the horizon.
    pub(super) wi: Vec3,
    /// The weight of a reflection that single precision does not tell from a single direction ([`Microfacet::resolves`]).
    pub(super) delta: Option<f32>,
}

impl Coat {
    /// `F D G₁G₁ / (4 cos θₒ)` and the density of the choice, both directions above the horizon; `None` for what is a delta.
    #[inline]
    pub(super) fn reflection(&self, wo: Vec3, wi: Vec3) -> Option<(f32, f32)> {
        let Self { eta, microfacet, .. } = self;
        let half = wo + wi;
        microfacet.resolves(half).then(|| {
            let length = half.length();
            let density = microfacet.d(half * (1.0 / length)) / (4.0 * microfacet.cross_section(wo));
            // As a product of the normal and a direction the cosine would have lost its digits where both directions graze.
            let r = fresnel::dielectric((0.5 * length).min(1.0), Vec4::splat(*eta)).x;
            (r * density * microfacet.g1(wi), density)
        })
    }

    /// Mirrors in a visible facet.
    #[inline]
    pub(super) fn sample_reflection(&self, wo: Vec3, u: [f32; 2]) -> CoatSample {
        let Self { eta, microfacet, .. } = self;
        let m = microfacet.sample_visible(wo, u);
        let cos = wo.dot(m);
        let wi = (m * (2.0 * cos) - wo).normalize();
        let delta = (!microfacet.resolves(wo + wi)).then(|| {
            let r = fresnel::dielectric(cos.clamp(0.0, 1.0), Vec4::splat(*eta)).x;
            r * microfacet.g1(wi)
        });
        CoatSample { wi, delta }
    }
}

impl RoughPlastic {
    /// `reflectance`: factor on the reflection of the coat; `hero_only`: only the hero wavelength is carried.
    #[inline]
    pub fn new(coat: &Coat, reflectance: SampledSpectrum, base: Base, hero_only: bool) -> Self {
        let coat_share = share(reflectance, base.albedo, hero_only);
        Self { coat: *coat, reflectance, base: base.within(Vec4::splat(coat.eta)), coat_share }
    }
}

impl ScatteringModel for RoughPlastic {
    /// `F D G₁G₁ / (4 cos θₒ)` of the coat and `albedo / escape · Tₒ Tᵢ cos θᵢ / (π η²)` of the base.
    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return None;
        }
        let transmittance = &self.coat.transmittance;
        let t_o = transmittance.at(wo.z);
        let p = coat_probability(1.0 - t_o, t_o, self.coat_share)?;
        let (coat, density) = match self.coat.reflection(wo, wi) {
            Some((value, density)) => (self.reflectance * value, density),
            None => (SampledSpectrum::ZERO, 0.0),
        };
        let base = self.base * (t_o * transmittance.at(wi.z) * wi.z * FRAC_1_PI);
        let pdf = p * density + (1.0 - p) * warp::cosine_hemisphere_pdf(wi.z);
        (pdf > 0.0).then_some((coat + base, PdfW(pdf)))
    }

    /// Mirrors in a visible facet of the coat, or a cosine-weighted direction of the base; both parts count for either.
    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let t_o = self.coat.transmittance.at(wo.z);
        let p = coat_probability(1.0 - t_o, t_o, self.coat_share)?;
        let wi = if lobe < p {
            let CoatSample { wi, delta } = self.coat.sample_reflection(wo, u);
            if let Some(weight) = delta {
                let weight = self.reflectance * (weight / p);
                return (wi.z > 0.0).then_some(BsdfSample::delta(wi, weight, p));
            }
            wi
        } else {
            warp::cosine_hemisphere(u)
        };
        let (value, pdf) = self.eval(wo, wi)?;
        let weight = value * (1.0 / pdf.0);
        Some(BsdfSample::reflection(wi, weight, pdf))
    }

    #[inline]
    fn has_diffuse_part(&self) -> bool {
        true
    }

    #[inline]
    fn is_glossy(&self) -> bool {
        true
    }
}

/// Nodes of the table, evenly in √cos θ: near grazing angles the curve is steep.
const NODES: usize = 16;

/// Points of the quadrature over visible normals in each of its two numbers.
const POINTS: u32 = 32;

/// Cosines over which Mitsuba takes the mean of what comes back from within, both ends included.
const COSINES: u32 = 64;

/// The share of light that a rough interface lets through by one refraction, over the cosine of the angle to the normal:
/// ∫ (1 − F) G₁ over the visible normals.
///
/// Kept small (32 bytes), because it is part of every `Bsdf`. Cubic between its nodes: for indices from 1.3 to 2 within
/// 2e-3, next to grazing angles (cosines below 0.1) within 6e-3.
#[derive(Clone, Copy, Debug)]
pub struct Transmittance([u16; NODES]);

impl Transmittance {
    /// The table of an interface with these facets (the same along both tangents) and index `eta`, far over near side.
    pub fn of(microfacet: &Microfacet, eta: f32) -> Self {
        let mut nodes = [0; NODES];
        for (i, node) in nodes.iter_mut().enumerate() {
            let t = i as f32 / (NODES - 1) as f32;
            let share =
                over_visible(microfacet, (t * t).max(1e-6), |wo, m| refracted(microfacet, eta, wo, m));
            *node = (share.clamp(0.0, 1.0) * f64::from(u16::MAX)).round() as u16;
        }
        Self(nodes)
    }

    /// The share at a cosine from 0 to 1.
    #[inline]
    pub fn at(&self, cos: f32) -> f32 {
        let x = cos.clamp(0.0, 1.0).sqrt() * (NODES - 1) as f32;
        let first = (x as usize).clamp(1, NODES - 3) - 1;
        let f = x - first as f32;
        // Lagrange's polynomial through four neighbours.
        let (a, b, c, d) = (f, f - 1.0, f - 2.0, f - 3.0);
        let weights = Vec4::new(b * c * d / -6.0, a * c * d * 0.5, a * b * d * -0.5, a * b * c / 6.0);
        let node = |i: usize| f32::from(self.0[first + i]);
        let values = Vec4::new(node(0), node(1), node(2), node(3));
        (weights.dot(values) / f32::from(u16::MAX)).clamp(0.0, 1.0)
    }
}

/// The share of diffuse light from within that a rough coat of index `eta` (coat over outside) throws back: twice the mean
/// of ∫ F G₁ cos θ over 64 cosines from 0 to 1.
///
/// That is how Mitsuba sums it; with both ends in the mean it is below the integral, so that a base comes out darker by
/// 0.6 % (roughness 0.5) to 1.6 % (0.02) than it would. A scene made for Mitsuba looks the same here.
pub fn internal_reflectance(microfacet: &Microfacet, eta: f32) -> f32 {
    let within = 1.0 / eta;
    let sum: f64 = (0..COSINES)
        .map(|i| (i as f32 / (COSINES - 1) as f32).max(1e-6))
        .map(|cos| {
            f64::from(cos) * over_visible(microfacet, cos, |wo, m| reflected(microfacet, within, wo, m))
        })
        .sum();
    (2.0 * sum / f64::from(COSINES)).clamp(0.0, 1.0) as f32
}

/// The mean of `f` over the visible normals from an angle of this cosine.
fn over_visible(microfacet: &Microfacet, cos: f32, f: impl Fn(Vec3, Vec3) -> f32) -> f64 {
    let wo = Vec3::new(((1.0 - cos) * (1.0 + cos)).max(0.0).sqrt(), 0.0, cos);
    // Denser towards the edges of the square, where the facets are that face away: there the integrand is steep.
    let at = |i: u32| {
        let t = (i as f32 + 0.5) / POINTS as f32;
        (t * t * (3.0 - 2.0 * t), 6.0 * t * (1.0 - t))
    };
    let (mut sum, mut total) = (0.0, 0.0);
    for ((u, du), (v, dv)) in (0..POINTS).flat_map(|i| (0..POINTS).map(move |j| (at(i), at(j)))) {
        sum += f64::from(du * dv * f(wo, microfacet.sample_visible(wo, [u, v])));
        total += f64::from(du * dv);
    }
    sum / total
}

fn reflected(microfacet: &Microfacet, eta: f32, wo: Vec3, m: Vec3) -> f32 {
    let cos = wo.dot(m).clamp(0.0, 1.0);
    let wi = m * (2.0 * cos) - wo;
    if wi.z > 0.0 { fresnel::dielectric(cos, Vec4::splat(eta)).x * microfacet.g1(wi) } else { 0.0 }
}

fn refracted(microfacet: &Microfacet, eta: f32, wo: Vec3, m: Vec3) -> f32 {
    let cos = wo.dot(m).clamp(0.0, 1.0);
    let through = fresnel::through(cos, eta).unwrap_or(0.0);
    let wi = (m * (cos - through) - wo) / eta;
    let passed = 1.0 - fresnel::dielectric(cos, Vec4::splat(eta)).x;
    if wi.z < 0.0 { passed * microfacet.g1(wi.normalize_or_zero()) } else { 0.0 }
}
