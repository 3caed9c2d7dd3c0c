//! The principled material: B. Burley, *Physically Based Shading at Disney*, SIGGRAPH 2012 course notes, and *Extending the Disney BRDF
//! to a BSDF with Integrated Subsurface Scattering*, SIGGRAPH 2015 course notes, with the values of Mitsuba 3's `principled`.
//!
//! Four lobes: diffuse (with retro-reflection, sheen and a flat look of scattering within), a microfacet reflection between metal and
//! glass, a microfacet refraction, and a clear coat, which is a second reflection with long tails. From behind there is only glass.
//! The parts are added as the papers add them, not so that energy is kept: bright, rough or sheeny settings reflect a little more than
//! arrives at grazing angles.

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use glam::{Vec3, Vec4};

use crate::math::pdf::PdfW;
use crate::math::trigonometry;
use crate::math::warp;
use crate::scene::desc::texture::{SpectrumTexture, TexturePoint};
use crate::scene::desc::{PrincipledDesc, PrincipledLobes};
use crate::spectrum::{SampledSpectrum, SampledWavelengths, Spectrum};

use super::microfacet::{bend, refracting_half, refracting_normal, resolves};
use super::scattering::lobe_probability;
use super::thin_film::index_of;
use super::{BsdfSample, MaterialModel, Microfacet, ScatteringModel, ThinFilm, fresnel};

/// At least this share of the samples from the front goes to the microfacets: most of them may reflect little, and yet the grazing ones
/// reflect everything.
const LEAST_SPECULAR: f32 = 0.2;

/// α of the masking of the clear coat, and its reflectance at normal incidence (Burley 2012, §5.6).
const COAT_MASKING: f32 = 0.25;
const COAT_REFLECTANCE: f32 = 0.04;

/// A principled material with the luminance of its base colour.
#[derive(Clone, Debug)]
pub struct PrincipledMaterial {
    desc: PrincipledDesc,
    luminance: f32,
}

impl From<PrincipledDesc> for PrincipledMaterial {
    fn from(desc: PrincipledDesc) -> Self {
        let spec_trans = desc.spec_trans.into_scalar();
        Self { luminance: luminance(&desc.base_color.mean()), desc: PrincipledDesc { spec_trans, ..desc } }
    }
}

impl MaterialModel for PrincipledMaterial {
    type Bsdf = Principled;

    #[inline]
    fn bsdf(&self, at: &TexturePoint, lambda: &SampledWavelengths) -> Principled {
        let base = self.desc.base_color.sample(at, lambda);
        let mean = if lambda.is_hero_only() { base.0.x } else { base.mean() };
        let glass = self.desc.spec_trans.scalar(at).min(1.0);
        Principled::new(
            base,
            [mean, self.desc.base_color.luminance_at(at).unwrap_or(self.luminance)],
            glass,
            self.desc.lobes.at(&self.desc.textures, at),
        )
        .under(ThinFilm::of(self.desc.thin_film.as_deref(), at, lambda))
    }

    fn diffuse_texture(&self) -> Option<&SpectrumTexture> {
        Some(&self.desc.base_color)
    }
}

/// The principled material at the wavelengths of a path.
#[derive(Clone, Copy, Debug)]
pub struct Principled {
    base: SampledSpectrum,
    /// Mean of the base colour over the carried wavelengths: chooses between lobes.
    mean: f32,
    /// Luminance of the base colour: what its tint has none of.
    luminance: f32,
    /// Share of the refraction and of the diffuse part in everything.
    glass: f32,
    diffuse: f32,
    lobes: PrincipledLobes,
    microfacet: Microfacet,
    film: ThinFilm,
}

/// Probabilities of the lobes other than the microfacets, seen from one side.
struct LobeChoice {
    diffuse: f32,
    coat: f32,
}

impl LobeChoice {
    /// The probability of the microfacets: exact, because the others are multiples of 2⁻²⁴.
    fn facets(&self) -> f32 {
        1.0 - self.diffuse - self.coat
    }
}

/// The side of the surface that is seen: `wo` is above the horizon, and `eta` the index of the far side over that of the near side.
#[derive(Clone, Copy)]
struct SeenFrom {
    wo: Vec3,
    eta: f32,
    front: bool,
}

/// A facet and what it does with light from one direction.
struct SeenFacet {
    /// Cosine to `wo`.
    cos: f32,
    /// Density of the facet over its cosine: D(m) / σ(wo).
    density: f32,
    /// Reflectance of glass at this angle, per lane.
    glass: Vec4,
    /// Reflectance of the material per lane.
    reflectance: Vec4,
    /// Probabilities of reflection and of refraction.
    mirrored: f32,
    passed: f32,
}

impl Principled {
    /// `base`: the base colour, with its mean over the carried wavelengths and its luminance; `spec_trans`: share of glass in what is
    /// not metal.
    #[inline]
    pub fn new(
        base: SampledSpectrum,
        [mean, luminance]: [f32; 2],
        spec_trans: f32,
        lobes: PrincipledLobes,
    ) -> Self {
        let rest = 1.0 - lobes.metallic;
        let (glass, diffuse) = (rest * spec_trans, rest * (1.0 - spec_trans));
        Self {
            base,
            mean,
            luminance,
            glass,
            diffuse,
            lobes,
            microfacet: Microfacet::new(lobes.facets(lobes.roughness)),
            film: ThinFilm::default(),
        }
    }

    /// This material with a film on its facets.
    #[inline]
    pub fn under(self, film: ThinFilm) -> Self {
        Self { film, ..self }
    }

    /// The base colour without its luminance.
    fn tint(&self) -> Vec4 {
        if self.luminance > 0.0 { self.base.0 / self.luminance } else { Vec4::ONE }
    }

    /// Reflectance of a facet per lane, seen from the front, where glass would reflect `glass` (Burley 2015, §4.2).
    fn reflectance(&self, cos: f32, glass: Vec4) -> Vec4 {
        let PrincipledLobes { metallic, spec_tint, eta, .. } = self.lobes;
        let rest = 1.0 - metallic;
        let weight = schlick_of(cos, eta);
        let toward_one = |r0: Vec4| r0 + (1.0 - r0) * weight;
        let mut metal = toward_one(self.base.0);
        if !self.film.is_absent() {
            metal = self.film.over(metal, cos, index_of(self.base.0));
        }
        let mut sum = rest * (1.0 - spec_tint) * glass + metallic * metal;
        if spec_tint > 0.0 {
            let r0 = ((eta - 1.0) / (eta + 1.0)).powi(2);
            sum += rest * spec_tint * toward_one(self.tint() * r0);
        }
        sum
    }

    /// Reflectance of a facet of glass per lane.
    fn glass_reflectance(&self, cos: f32, SeenFrom { eta, front, .. }: SeenFrom) -> Vec4 {
        let bare = Vec4::splat(fresnel::dielectric(cos, Vec4::splat(eta)).x);
        if self.film.is_absent() {
            return bare;
        }
        // A film reflects the same to both sides: it is asked from outside.
        match if front { Some(cos) } else { fresnel::through(cos, eta).map(|through| through / eta) } {
            Some(outside) => self.film.over(bare, outside.min(1.0), Vec4::splat(self.lobes.eta)),
            None => Vec4::ONE,
        }
    }

    /// `None` for a facet that is not seen, that does nothing, or where there is none; `cos` is its cosine to `wo`.
    fn facet(&self, seen: SeenFrom, m: Vec3, cos: f32, choice: &LobeChoice) -> Option<SeenFacet> {
        let (SeenFrom { wo, front, .. }, cos) = (seen, cos.min(1.0));
        let density = self.microfacet.d(m) / self.microfacet.cross_section(wo);
        if cos.is_nan() || cos <= 0.0 || density <= 0.0 {
            return None;
        }
        let glass = self.glass_reflectance(cos, seen);
        let reflectance = match front {
            // A surface without an index has no reflection, whatever it is made of.
            _ if glass.max_element() <= 0.0 => Vec4::ZERO,
            true => self.reflectance(cos, glass),
            false => self.glass * glass,
        };
        let through = self.glass * (1.0 - glass.element_sum() * 0.25) * self.mean.sqrt();
        let reflected = reflectance.element_sum() * 0.25;
        let both = reflected + through;
        (both > 0.0).then(|| {
            let mirrored = lobe_probability(choice.facets() * (reflected / both));
            SeenFacet { cos, density, glass, reflectance, mirrored, passed: choice.facets() - mirrored }
        })
    }

    /// The lobes by what they reflect, roughly; from behind there are only microfacets.
    fn choice(&self, cos: f32, front: bool) -> LobeChoice {
        if !front {
            return LobeChoice { diffuse: 0.0, coat: 0.0 };
        }
        let schlick = schlick(cos);
        let glass = fresnel::dielectric(cos.min(1.0), Vec4::splat(self.lobes.eta)).x;
        let specular = self.lobes.metallic * (self.mean + (1.0 - self.mean) * schlick)
            + (1.0 - self.lobes.metallic) * glass
            + self.glass * (1.0 - glass) * self.mean.sqrt();
        let sheen =
            if self.diffuse > 0.0 { 0.3 * self.lobes.sheen * (1.0 - self.lobes.metallic) } else { 0.0 };
        let diffuse = self.diffuse * self.mean + sheen;
        let coat =
            0.25 * self.lobes.clearcoat * (COAT_REFLECTANCE + (1.0 - COAT_REFLECTANCE) * schlick).max(0.2);
        let all = (diffuse + coat) / (1.0 - LEAST_SPECULAR);
        let total = (diffuse + coat + specular).max(all).max(f32::MIN_POSITIVE);
        LobeChoice { diffuse: lobe_probability(diffuse / total), coat: lobe_probability(coat / total) }
    }

    /// α of the clear coat's facets.
    fn coat_alpha(&self) -> f32 {
        0.1 + (0.001 - 0.1) * self.lobes.clearcoat_gloss
    }

    /// The diffuse part and the sheen (Burley 2012, §5.5), without |cos θᵢ|. `d`: cosine between the half vector and either direction.
    fn diffuse(&self, cos_o: f32, cos_i: f32, d: f32) -> SampledSpectrum {
        let PrincipledLobes { sheen, sheen_tint, metallic, .. } = self.lobes;
        let mut value =
            self.base.0 * (self.diffuse * FRAC_1_PI * diffuse_shape(&self.lobes, cos_o, cos_i, d));
        if sheen > 0.0 {
            let color = Vec4::ONE + (self.tint() - Vec4::ONE) * sheen_tint;
            value += color * (sheen * (1.0 - metallic) * schlick(d));
        }
        SampledSpectrum(value)
    }

    /// Reflection; both directions above the horizon.
    fn reflect(&self, wo: Vec3, wi: Vec3, eta: f32, front: bool) -> Option<(SampledSpectrum, PdfW)> {
        let choice = self.choice(wo.z, front);
        let (half, mut value, mut pdf) = (wo + wi, SampledSpectrum::ZERO, 0.0);
        // The cosine, which as a product of the normal and a direction would have lost its digits where both directions graze.
        let (m, d) = (half.normalize_or_zero(), 0.5 * half.length());
        let resolved = self.microfacet.resolves(half);
        let seen = SeenFrom { wo, eta, front };
        if let Some(facet) = self.facet(seen, m, d, &choice).filter(|_| resolved) {
            let density = 0.25 * facet.density;
            value += SampledSpectrum(facet.reflectance * (density * self.microfacet.g1(wi)));
            pdf += facet.mirrored * density;
        }
        if front && self.lobes.clearcoat > 0.0 && d > 0.0 && resolves(half, self.coat_alpha()) {
            let normals = gtr1(m, self.coat_alpha());
            value += SampledSpectrum::splat(0.25 * normals * self.coat(wo, wi, d, eta));
            pdf += choice.coat * normals * m.z / (4.0 * d);
        }
        if front && self.diffuse > 0.0 {
            value += self.diffuse(wo.z, wi.z, d) * wi.z;
            pdf += choice.diffuse * warp::cosine_hemisphere_pdf(wi.z);
        }
        (pdf > 0.0).then_some((value, PdfW(pdf)))
    }

    /// The reflection of the clear coat over a quarter of its normals; `d`: cosine between the half vector and either direction.
    fn coat(&self, wo: Vec3, wi: Vec3, d: f32, eta: f32) -> f32 {
        let fresnel = COAT_REFLECTANCE + (1.0 - COAT_REFLECTANCE) * schlick_of(d, eta);
        self.lobes.clearcoat * fresnel * coat_masking(wo.z) * coat_masking(wi.z) * wi.z
    }

    /// Refraction; `wo` above the horizon, `wi` below (Walter et al., *Microfacet Models for Refraction through Rough Surfaces*, EGSR 2007,
    /// eq. 17 and 21).
    fn refract(&self, wo: Vec3, wi: Vec3, eta: f32, front: bool) -> Option<(SampledSpectrum, PdfW)> {
        if self.glass <= 0.0 {
            return None;
        }
        let half = refracting_half(wo, wi, eta);
        let m = refracting_normal(half);
        let facet = self.facet(SeenFrom { wo, eta, front }, m, wo.dot(m), &self.choice(wo.z, front))?;
        let through = fresnel::through(facet.cos, eta)?;
        let bend = bend(facet.cos, eta, through);
        if wi.dot(m) >= 0.0 || wi.z == 0.0 || !self.microfacet.resolves_refraction(half, wo, eta) {
            return None;
        }
        let density = facet.density * facet.cos * through / (eta * bend * bend);
        let pdf = facet.passed * density * eta * eta;
        let value = self.passes(&facet) * (density * self.microfacet.g1(wi));
        (pdf > 0.0).then_some((SampledSpectrum(value), PdfW(pdf)))
    }

    /// Transmittance of a microfacet, per lane.
    fn passes(&self, facet: &SeenFacet) -> Vec4 {
        self.base.0.map(f32::sqrt) * (self.glass * (Vec4::ONE - facet.glass))
    }

    /// `wo` on the side where it is above the horizon: that, the factor on z, and the index of the far side over that of the near side.
    /// `None` for a grazing view, and from behind where there is no glass.
    fn facing(&self, wo: Vec3) -> Option<(Vec3, f32, f32)> {
        let seen = wo.z > 0.0 || wo.z < 0.0 && self.glass > 0.0;
        let (side, eta) = if wo.z > 0.0 { (1.0, self.lobes.eta) } else { (-1.0, 1.0 / self.lobes.eta) };
        seen.then(|| (Vec3::new(wo.x, wo.y, wo.z.abs()), side, eta))
    }
}

impl ScatteringModel for Principled {
    /// The sum of all lobes for `wi` on the side of `wo`, refraction on the other.
    #[inline(never)]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        let (wo, side, eta) = self.facing(wo)?;
        let (wi, front) = (Vec3::new(wi.x, wi.y, wi.z * side), side > 0.0);
        if wi.z > 0.0 { self.reflect(wo, wi, eta, front) } else { self.refract(wo, wi, eta, front) }
    }

    /// A direction of one lobe; all of them count.
    #[inline(never)]
    fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        let (up, side, eta) = self.facing(wo)?;
        let choice = self.choice(up.z, side > 0.0);
        let mirrored = |m: Vec3| (m * (2.0 * up.dot(m)) - up).normalize();
        let mut transmitted = false;
        // The weight and the probability of a lobe that is one direction.
        let mut delta = None;
        let wi = if lobe < choice.diffuse {
            warp::cosine_hemisphere(u)
        } else if lobe < choice.diffuse + choice.coat {
            let m = sample_gtr1(self.coat_alpha(), u);
            let (d, wi) = (up.dot(m), mirrored(m));
            if !resolves(up + wi, self.coat_alpha()) {
                let weight = self.coat(up, wi, d, eta) * d / (choice.coat * m.z);
                delta = (d > 0.0).then_some((Vec4::splat(weight), choice.coat));
            }
            wi
        } else {
            let m = self.microfacet.sample_visible(up, u);
            let seen = SeenFrom { wo: up, eta, front: side > 0.0 };
            let facet = self.facet(seen, m, up.dot(m), &choice)?;
            transmitted = lobe - choice.diffuse - choice.coat >= facet.mirrored;
            if transmitted {
                let through = fresnel::through(facet.cos, eta)?;
                let bend = bend(facet.cos, eta, through);
                let wi = ((up + m * bend) * (-1.0 / eta)).normalize();
                if !self.microfacet.resolves_refraction(refracting_half(up, wi, eta), up, eta) {
                    delta = Some((self.passes(&facet) / (facet.passed * eta * eta), facet.passed));
                }
                wi
            } else {
                let wi = mirrored(m);
                if !self.microfacet.resolves(up + wi) {
                    let weight = facet.reflectance * (self.microfacet.g1(wi) / facet.mirrored);
                    delta = Some((weight, facet.mirrored));
                }
                wi
            }
        };
        if (wi.z < 0.0) != transmitted {
            return None;
        }
        let wi = Vec3::new(wi.x, wi.y, wi.z * side);
        let eta2 = if transmitted { eta * eta } else { 1.0 };
        if let Some((weight, probability)) = delta {
            let sample = BsdfSample::delta(wi, SampledSpectrum(weight), probability);
            return Some(BsdfSample { transmitted, eta2, ..sample });
        }
        let (value, pdf) = self.eval(wo, wi)?;
        let weight = value * (1.0 / pdf.0);
        Some(BsdfSample { transmitted, eta2, ..BsdfSample::reflection(wi, weight, pdf) })
    }

    #[inline]
    fn has_diffuse_part(&self) -> bool {
        self.diffuse > 0.0
    }

    #[inline]
    fn is_glossy(&self) -> bool {
        true
    }

    #[inline]
    fn transmits(&self) -> bool {
        self.glass > 0.0
    }
}

/// The luminance of a base colour under D65.
pub(super) fn luminance(base_color: &Spectrum) -> f32 {
    let [r, g, b] = base_color.reflected_rgb();
    (0.2126 * r + 0.7152 * g + 0.0722 * b).max(0.0)
}

/// The diffuse part over that of Lambert, with retro-reflection (Burley 2012, §5.3) and flatness (2015, §5.1).
pub(super) fn diffuse_shape(lobes: &PrincipledLobes, cos_o: f32, cos_i: f32, d: f32) -> f32 {
    let PrincipledLobes { roughness, flatness, .. } = *lobes;
    let (o, i) = (schlick(cos_o), schlick(cos_i));
    let retro = 2.0 * roughness * d * d;
    let shape = (1.0 - 0.5 * o) * (1.0 - 0.5 * i) + retro * (o + i + o * i * (retro - 1.0));
    if flatness == 0.0 {
        return shape;
    }
    // Hanrahan and Krueger's scattering within a surface, roughly.
    let at = |f: f32| 1.0 + (0.5 * retro - 1.0) * f;
    let within = 1.25 * (at(o) * at(i) * (1.0 / (cos_o + cos_i) - 0.5) + 0.5);
    shape + (within - shape) * flatness
}

/// Schlick's weight (1 − cos)⁵.
pub(super) fn schlick(cos: f32) -> f32 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    let m2 = m * m;
    m2 * m2 * m
}

/// Schlick's weight on the side of the lighter medium: of the refracted direction, where `eta` (far over near side) is below 1.
pub(super) fn schlick_of(cos: f32, eta: f32) -> f32 {
    if eta > 1.0 {
        return schlick(cos);
    }
    schlick((1.0 - (1.0 - cos) * (1.0 + cos) / (eta * eta)).max(0.0).sqrt())
}

/// Density of the normals of the clear coat (Burley 2012, eq. 4 with γ = 1).
fn gtr1(m: Vec3, alpha: f32) -> f32 {
    let alpha2 = alpha * alpha;
    let spread = m.truncate().length_squared() + alpha2 * m.z * m.z;
    (alpha2 - 1.0) / (PI * alpha2.ln() * spread)
}

/// A normal with density [`gtr1`] times its cosine.
fn sample_gtr1(alpha: f32, u: [f32; 2]) -> Vec3 {
    let alpha2 = alpha * alpha;
    // sin² θ = (α^(2 − 2u) − α²) / (1 − α²).
    let sin2 = ((alpha2.powf(1.0 - u[1]) - alpha2) / (1.0 - alpha2)).clamp(0.0, 1.0);
    let (sin_phi, cos_phi) = trigonometry::sin_cos(TAU * u[0]);
    let sin = sin2.sqrt();
    Vec3::new(cos_phi * sin, sin_phi * sin, (1.0 - sin2).sqrt())
}

/// Smith's G₁ of GGX.
fn coat_masking(cos: f32) -> f32 {
    let sin2 = (1.0 - cos) * (1.0 + cos);
    2.0 * cos / (cos + (cos * cos + COAT_MASKING * COAT_MASKING * sin2.max(0.0)).sqrt())
}
