//! The thin principled material: B. Burley, *Extending the Disney BRDF to a BSDF with Integrated Subsurface Scattering*, SIGGRAPH 2015
//! course notes, §5.3, with the values of Mitsuba 3's `principledthin`. Both sides look alike.
//!
//! Mitsuba refuses a facet that sends light through the surface and yet to its own upper side, and asks that of the direction to the
//! light alone, which is not reciprocal. Here each of the two directions refuses half.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec3, Vec4};

use crate::math::pdf::PdfW;
use crate::math::warp;
use crate::scene::desc::texture::{SpectrumTexture, TexturePoint};
use crate::scene::desc::{PrincipledLobes, PrincipledThinDesc};
use crate::spectrum::{SampledSpectrum, SampledWavelengths};

use super::principled::{diffuse_shape, luminance, schlick, schlick_of};
use super::scattering::lobe_probability;
use super::{BsdfSample, MaterialModel, Microfacet, ScatteringModel, fresnel};

/// A thin principled material with the luminance of its base colour.
#[derive(Clone, Debug)]
pub struct PrincipledThinMaterial {
    desc: PrincipledThinDesc,
    luminance: f32,
}

impl From<PrincipledThinDesc> for PrincipledThinMaterial {
    fn from(desc: PrincipledThinDesc) -> Self {
        Self { luminance: luminance(&desc.base_color.mean()), desc }
    }
}

impl MaterialModel for PrincipledThinMaterial {
    type Bsdf = PrincipledThin;

    #[inline]
    fn bsdf(&self, at: &TexturePoint, lambda: &SampledWavelengths) -> PrincipledThin {
        let base = self.desc.base_color.sample(at, lambda);
        let mean = if lambda.is_hero_only() { base.0.x } else { base.mean() };
        let through = self.desc.transmittance.sample(at, lambda).0.x;
        let [specular, diffuse] =
            [&self.desc.spec_trans, &self.desc.diff_trans].map(|share| share.scalar(at));
        let shares = [specular.min(1.0), (0.5 * diffuse).min(1.0), through];
        PrincipledThin::new(
            base,
            [mean, self.desc.base_color.luminance_at(at).unwrap_or(self.luminance)],
            shares,
            self.desc.lobes.at(&self.desc.textures, at),
        )
    }

    fn diffuse_texture(&self) -> Option<&SpectrumTexture> {
        Some(&self.desc.base_color)
    }
}

/// The thin principled material at the wavelengths of a path.
#[derive(Clone, Copy, Debug)]
pub struct PrincipledThin {
    base: SampledSpectrum,
    /// Mean of the base colour over the carried wavelengths, and its luminance.
    mean: f32,
    luminance: f32,
    /// Shares of the microfacets in everything and of what the diffuse part lets through in that; factor on all that is let through.
    specular: f32,
    diffuse_through: f32,
    through: f32,
    lobes: PrincipledLobes,
}

/// Probabilities of the lobes, multiples of 2⁻²⁴.
struct ThinLobeChoice {
    mirrored: f32,
    passed: f32,
    diffuse: f32,
    diffuse_through: f32,
}

impl PrincipledThin {
    /// `base`: the base colour, with its mean over the carried wavelengths and its luminance; `shares`: that of the microfacets in
    /// everything, that of transmission in the diffuse part, and the factor on all transmission.
    #[inline]
    pub fn new(
        base: SampledSpectrum,
        [mean, luminance]: [f32; 2],
        [specular, diffuse_through, through]: [f32; 3],
        lobes: PrincipledLobes,
    ) -> Self {
        Self { base, mean, luminance, specular, diffuse_through, through, lobes }
    }

    /// The facets that mirror, or those that let through: a pane is rough on both of its faces (Burley 2015, fig. 15).
    fn microfacet(&self, passes: bool) -> Microfacet {
        let PrincipledLobes { roughness, eta, .. } = self.lobes;
        let roughness = if passes { (0.65 * eta - 0.35) * roughness } else { roughness };
        Microfacet::new(self.lobes.facets(roughness))
    }

    fn tint(&self) -> Vec4 {
        if self.luminance > 0.0 { self.base.0 / self.luminance } else { Vec4::ONE }
    }

    fn reflectance(&self, cos: f32) -> Vec4 {
        let PrincipledLobes { eta, spec_tint, .. } = self.lobes;
        let glass = fresnel::dielectric(cos, Vec4::splat(eta));
        let r0 = self.tint() * ((eta - 1.0) / (eta + 1.0)).powi(2);
        let tinted = r0 + (1.0 - r0) * schlick_of(cos, eta);
        glass + (tinted - glass) * spec_tint
    }

    fn choice(&self, cos: f32) -> Option<ThinLobeChoice> {
        let glass = fresnel::dielectric(cos.min(1.0), Vec4::splat(self.lobes.eta)).x;
        let diffuse = 1.0 - self.specular;
        let mirrored = self.specular * glass.max(0.2);
        let passed = self.specular * (1.0 - glass).max(0.2) * self.mean * self.through;
        let reflected = diffuse * (1.0 - self.diffuse_through) * (self.mean + 0.3 * self.lobes.sheen);
        let through = diffuse * self.diffuse_through * self.mean * self.through;
        let all = mirrored + passed + reflected + through;
        (all > 0.0).then(|| {
            // Each takes what it wants of what the others have left.
            let [mirrored, passed, diffuse] =
                [mirrored, passed, reflected].map(|v| lobe_probability(v / all));
            let passed = passed.min(1.0 - mirrored);
            let diffuse = diffuse.min(1.0 - mirrored - passed);
            let rest = 1.0 - mirrored - passed - diffuse;
            // Rounding leaves a little where there is no other lobe.
            let diffuse_through = if through > 0.0 { rest } else { 0.0 };
            ThinLobeChoice { mirrored, passed, diffuse, diffuse_through }
        })
    }

    /// Reflectance or transmittance of the microfacets, divided by their density; `folded` is the mirror image of a direction below.
    fn specular(&self, wo: Vec3, folded: Vec3, m: Vec3, passes: bool) -> Vec4 {
        let d = (0.5 * (wo + folded).length()).min(1.0);
        let color = match passes {
            true => {
                let glass = fresnel::dielectric(d, Vec4::splat(self.lobes.eta));
                let below = |w: Vec3| 0.5 * f32::from(w.with_z(-w.z).dot(m) < 0.0);
                self.base.0 * (1.0 - glass) * (self.through * (below(wo) + below(folded)))
            }
            false => self.reflectance(d),
        };
        color * (self.specular * self.microfacet(passes).g1(folded))
    }

    /// Value and density where `wo` is above the horizon.
    fn eval_above(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        let choice = self.choice(wo.z)?;
        let passes = wi.z < 0.0;
        let folded = Vec3::new(wi.x, wi.y, wi.z.abs());
        let half = wo + folded;
        let m = half.normalize_or_zero();
        let d = (0.5 * half.length()).min(1.0);
        let cosine = warp::cosine_hemisphere_pdf(folded.z);
        let (mut value, mut pdf) = (Vec4::ZERO, 0.0);
        let microfacet = self.microfacet(passes);
        if self.specular > 0.0 && microfacet.resolves(half) {
            let density = microfacet.d(m) / (4.0 * microfacet.cross_section(wo));
            value += self.specular(wo, folded, m, passes) * density;
            pdf += (if passes { choice.passed } else { choice.mirrored }) * density;
        }
        let diffuse = 1.0 - self.specular;
        if passes {
            value += self.base.0 * (diffuse * self.diffuse_through * self.through * cosine);
            pdf += choice.diffuse_through * cosine;
        } else {
            let PrincipledLobes { sheen, sheen_tint, .. } = self.lobes;
            let mut here = self.base.0 * (FRAC_1_PI * diffuse_shape(&self.lobes, wo.z, wi.z, d));
            if sheen > 0.0 {
                here += (Vec4::ONE + (self.tint() - Vec4::ONE) * sheen_tint) * (sheen * schlick(d));
            }
            value += here * (diffuse * (1.0 - self.diffuse_through) * wi.z);
            pdf += choice.diffuse * cosine;
        }
        (pdf > 0.0).then_some((SampledSpectrum(value), PdfW(pdf)))
    }
}

impl ScatteringModel for PrincipledThin {
    /// The sum of the lobes of the side of `wi`.
    #[inline(never)]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        let flip = |w: Vec3| Vec3::new(w.x, w.y, w.z * 1f32.copysign(wo.z));
        (wo.z != 0.0 && wi.z != 0.0).then(|| self.eval_above(flip(wo), flip(wi)))?
    }

    /// A direction of one lobe; all of those on its side count.
    #[inline(never)]
    fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let up = Vec3::new(wo.x, wo.y, wo.z.abs());
        let ThinLobeChoice { mirrored, passed, diffuse, .. } = self.choice(up.z)?;
        let transmitted = lobe >= mirrored + diffuse;
        let mut facet = None;
        let above = if lobe < mirrored || lobe >= 1.0 - passed {
            let m = self.microfacet(transmitted).sample_visible(up, u);
            facet = Some(m);
            (m * (2.0 * up.dot(m)) - up).normalize()
        } else {
            warp::cosine_hemisphere(u)
        };
        if above.z.is_nan() || above.z <= 0.0 {
            return None;
        }
        let side = if transmitted { -above.z } else { above.z };
        let wi = Vec3::new(above.x, above.y, side * 1f32.copysign(wo.z));
        if let Some(m) = facet.filter(|_| !self.microfacet(transmitted).resolves(up + above)) {
            let probability = if transmitted { passed } else { mirrored };
            let weight = SampledSpectrum(self.specular(up, above, m, transmitted) / probability);
            let sample = BsdfSample::delta(wi, weight, probability);
            return Some(BsdfSample { transmitted, ..sample });
        }
        let (value, pdf) = self.eval_above(up, Vec3::new(above.x, above.y, side))?;
        let weight = value * (1.0 / pdf.0);
        Some(BsdfSample { transmitted, ..BsdfSample::reflection(wi, weight, pdf) })
    }

    #[inline]
    fn has_diffuse_part(&self) -> bool {
        self.specular < 1.0
    }

    #[inline]
    fn is_glossy(&self) -> bool {
        self.specular > 0.0
    }

    #[inline]
    fn transmits(&self) -> bool {
        self.through > 0.0 && (self.specular > 0.0 || self.diffuse_through > 0.0)
    }
}
