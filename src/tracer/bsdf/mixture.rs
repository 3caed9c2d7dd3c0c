//! A mixture of materials in shares that may vary over a surface: `blendbsdf`, however blends are nested.
//!
//! Holes of the surface are no part of it: rays pass them before they ask for a material (`tracer/opacity.rs`).

use glam::{Vec3, Vec4};

use crate::math::pdf::PdfW;
use crate::scene::desc::MOST_PARTS;
use crate::scene::desc::texture::TexturePoint;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::sampler::{NUMBER_STEP, attainable};
use crate::tracer::wavelength_mis::Dispersion;

use super::bump::{Bump, BumpMaterial};
use super::coating::{Coating, CoatingMaterial};
use super::diffuse::Diffuse;
use super::models::{Material, Scattering, Unmixed};
use super::scattering::{BsdfSample, LAST_LOBE, MaterialEvalContext, MaterialModel, ScatteringModel};
use super::share::SurfaceShare;

/// A mixture, seen from one side of a surface.
#[derive(Clone, Debug, Default)]
pub struct MixtureMaterial {
    /// The materials, at most [`MOST_PARTS`].
    pub parts: Vec<MaterialPart>,
    /// The shares add up to less than 1 where the surface has holes: they are taken of what is there.
    pub has_holes: bool,
}

/// A material that a mixture is made of.
#[derive(Clone, Debug)]
pub struct MaterialPart {
    /// The material, itself no mixture.
    pub material: Material,
    /// Its share.
    pub share: SurfaceShare,
    /// It is evaluated in the frame of the front although the mixture is that of a back.
    pub turned: bool,
    /// It is evaluated in a frame of its own, if it has a map of normals or heights; `turned` has no effect then.
    pub bump: Option<BumpMaterial>,
    /// The layer over it.
    pub coat: Option<PartCoat<CoatingMaterial>>,
}

/// A layer over a part of a mixture.
#[derive(Clone, Copy, Debug)]
pub struct PartCoat<C> {
    /// The layer.
    pub coat: C,
    /// It is tilted with the material under it: otherwise it is flat, and the map of normals or heights, if there is one, is under it.
    pub tilted: bool,
}

impl MaterialModel for MixtureMaterial {
    type Bsdf = Mixture;

    /// The mixture on a flat surface that lies in the plane of its texture coordinates.
    fn bsdf(&self, at: &TexturePoint, lambda: &SampledWavelengths) -> Mixture {
        self.at(&MaterialEvalContext::flat(*at), lambda)
    }

    fn at(&self, context: &MaterialEvalContext, lambda: &SampledWavelengths) -> Mixture {
        let bsdf = Diffuse::new(SampledSpectrum::ZERO).into();
        let nothing = MixedPart { bsdf, share: 0.0, chance: 0.0, turned: false, bump: None, coat: None };
        let part = |part: &MaterialPart| MixedPart {
            bsdf: Unmixed::of(&part.material, context, lambda),
            share: part.share.at(&context.texture),
            chance: 0.0,
            turned: part.turned,
            bump: part.bump.as_ref().map(|bump| bump.at(context)),
            coat: part.coat.as_ref().map(|PartCoat { coat, tilted }| PartCoat {
                coat: coat.at(&context.texture, lambda),
                tilted: *tilted,
            }),
        };
        let mut parts: [MixedPart; MOST_PARTS] =
            std::array::from_fn(|i| self.parts.get(i).map_or(nothing, part));
        if self.has_holes {
            let there: f32 = parts.iter().map(|part| part.share).sum();
            let scale = if there > 0.0 { 1.0 / there } else { 0.0 };
            parts.iter_mut().for_each(|part| part.share *= scale);
        }
        choose_by_share(&mut parts);
        let several_refract =
            parts.iter().filter(|part| part.share > 0.0 && part.bsdf.transmits()).count() > 1;
        Mixture { parts, several_refract }
    }

    fn diffuse_reflectance(
        &self,
        at: &TexturePoint,
        lambda: &SampledWavelengths,
        wo: Vec3,
    ) -> SampledSpectrum {
        self.parts.iter().fold(SampledSpectrum::ZERO, |sum, part| {
            let wo = if part.turned { Vec3::new(wo.x, -wo.y, -wo.z) } else { wo };
            sum + part.material.diffuse_reflectance(at, lambda, wo) * part.share.at(at)
        })
    }
}

/// A mixture at the wavelengths of a path. One of its parts is chosen by its share; of what is no delta all parts count.
#[derive(Clone, Copy, Debug)]
pub struct Mixture {
    parts: [MixedPart; MOST_PARTS],
    /// Light that goes through is refracted by several of the parts: the factor (nᵢ/nₒ)² of a direction is a mean of theirs.
    several_refract: bool,
}

#[derive(Clone, Copy, Debug)]
struct MixedPart {
    bsdf: Unmixed,
    share: f32,
    /// The probability with which it is chosen: its share of what is not black, rounded to the grid of random numbers.
    chance: f32,
    turned: bool,
    bump: Option<Bump>,
    coat: Option<PartCoat<Coating>>,
}

impl MixedPart {
    fn is_black(&self) -> bool {
        self.coat.is_none() && self.bsdf.as_diffuse().is_some_and(|diffuse| diffuse.albedo.is_black())
    }

    /// A direction in the part's own frame, or back from it: a turn by 180° about the s axis.
    fn turn(&self, w: Vec3) -> Vec3 {
        if self.turned { Vec3::new(w.x, -w.y, -w.z) } else { w }
    }

    fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        match (&self.coat, &self.bump) {
            (None, _) => Uncoated(self).eval(wo, wi),
            (Some(PartCoat { coat, tilted: true }), Some(bump)) => bump.eval(&coat.over(self.bsdf), wo, wi),
            (Some(PartCoat { coat, .. }), _) => coat.over(Uncoated(self)).eval(wo, wi),
        }
    }

    fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        match (&self.coat, &self.bump) {
            (None, _) => Uncoated(self).sample(wo, u, lobe),
            (Some(PartCoat { coat, tilted: true }), Some(bump)) => {
                bump.sample(&coat.over(self.bsdf), wo, u, lobe)
            }
            (Some(PartCoat { coat, .. }), _) => coat.over(Uncoated(self)).sample(wo, u, lobe),
        }
    }

    /// A sample of a delta of this part as one of the mixture.
    fn delta(&self, s: BsdfSample) -> BsdfSample {
        BsdfSample { pdf: PdfW(s.pdf.0 * self.chance), weight: s.weight * (self.share / self.chance), ..s }
    }

    fn sample_from_light(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        match (&self.coat, &self.bump) {
            (None, _) => Uncoated(self).sample_from_light(wo, u, lobe),
            (Some(PartCoat { coat, tilted: true }), Some(bump)) => {
                bump.sample_from_light(&coat.over(self.bsdf), wo, u, lobe)
            }
            (Some(PartCoat { coat, .. }), _) => coat.over(Uncoated(self)).sample_from_light(wo, u, lobe),
        }
    }

    fn pdf_from_light(&self, wo: Vec3, wi: Vec3) -> f32 {
        match (&self.coat, &self.bump) {
            (None, _) => Uncoated(self).pdf_from_light(wo, wi),
            (Some(PartCoat { coat, tilted: true }), Some(bump)) => {
                bump.pdf_from_light(&coat.over(self.bsdf), wo, wi)
            }
            (Some(PartCoat { coat, .. }), _) => coat.over(Uncoated(self)).pdf_from_light(wo, wi),
        }
    }

    /// The first number of the delta that `lobe` chooses, of a part with a coat.
    fn delta_lobe(&self, coat: &Coating, wo: Vec3, lobe: f32) -> f32 {
        coat.over(Uncoated(self)).delta_lobe(wo, lobe, false)
    }
}

/// A part without its coat.
#[derive(Clone, Copy)]
struct Uncoated<'a>(&'a MixedPart);

impl ScatteringModel for Uncoated<'_> {
    fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        let part = self.0;
        match &part.bump {
            None => part.bsdf.eval(part.turn(wo), part.turn(wi)),
            Some(bump) => bump.eval(&part.bsdf, wo, wi),
        }
    }

    fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        let part = self.0;
        match &part.bump {
            None => {
                let s = part.bsdf.sample(part.turn(wo), u, lobe)?;
                Some(BsdfSample { wi: part.turn(s.wi), ..s })
            }
            Some(bump) => bump.sample(&part.bsdf, wo, u, lobe),
        }
    }

    fn sample_from_light(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        match &self.0.bump {
            None => self.sample(wo, u, lobe),
            Some(bump) => bump.sample_from_light(&self.0.bsdf, wo, u, lobe),
        }
    }

    fn pdf_from_light(&self, wo: Vec3, wi: Vec3) -> f32 {
        let part = self.0;
        match &part.bump {
            None => part.bsdf.pdf_from_light(part.turn(wo), part.turn(wi)),
            Some(bump) => bump.pdf_from_light(&part.bsdf, wo, wi),
        }
    }

    fn as_diffuse(&self) -> Option<&Diffuse> {
        let part = self.0;
        part.bsdf.as_diffuse().filter(|_| part.bump.is_none() && !part.turned)
    }
}

/// Gives the parts their chances: multiples of the grid's step, none of them 0 where the share is not, which add up to 1. Black parts are
/// never chosen, because their paths end: directions would be rarer than their density says.
fn choose_by_share(parts: &mut [MixedPart; MOST_PARTS]) {
    let chosen = |part: &MixedPart| part.share > 0.0 && !part.is_black();
    let mut left = parts.iter().filter(|part| chosen(part)).count();
    let scale = match parts.iter().any(|part| part.share > 0.0 && part.is_black()) {
        true => 1.0 / parts.iter().filter(|part| chosen(part)).map(|part| part.share).sum::<f32>(),
        false => 1.0,
    };
    let (mut before, mut shares) = (0.0, 0.0);
    for part in parts.iter_mut().filter(|part| chosen(part)) {
        (shares, left) = (shares + part.share * scale, left - 1);
        let last = 1.0 - left as f32 * NUMBER_STEP;
        let end =
            if left == 0 { 1.0 } else { attainable(shares.min(1.0)).max(before + NUMBER_STEP).min(last) };
        (part.chance, before) = (end - before, end);
    }
}

impl Mixture {
    /// The part to which a lobe number belongs, with the first such number.
    fn part_at(&self, lobe: f32) -> Option<(&MixedPart, f32)> {
        let mut first = 0.0;
        for part in &self.parts {
            if lobe < first + part.chance {
                return Some((part, first));
            }
            first += part.chance;
        }
        None
    }

    fn any(&self, is: impl Fn(&Unmixed) -> bool) -> bool {
        self.parts.iter().any(|part| part.share > 0.0 && is(&part.bsdf))
    }

    /// True where a part has a rough coat.
    fn any_rough_coat(&self) -> bool {
        let is_rough = |coat: PartCoat<Coating>| coat.coat.is_rough();
        self.parts.iter().any(|part| part.share > 0.0 && part.coat.is_some_and(is_rough))
    }
}

impl ScatteringModel for Mixture {
    /// The sum of all parts that are no deltas.
    fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        let (mut value, mut pdf) = (SampledSpectrum::ZERO, 0.0);
        for part in self.parts.iter().filter(|part| part.share > 0.0) {
            if let Some((f, p)) = part.eval(wo, wi) {
                value += f * part.share;
                pdf += p.0 * part.chance;
            }
        }
        (pdf > 0.0).then_some((value, PdfW(pdf)))
    }

    fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        let (part, first) = self.part_at(lobe)?;
        let s = part.sample(wo, u, ((lobe - first) / part.chance).min(LAST_LOBE))?;
        if s.delta {
            return Some(part.delta(s));
        }
        let (value, pdf) = self.eval(wo, s.wi)?;
        let weight = value * (1.0 / pdf.0);
        let eta2 = if self.several_refract { 1.0 } else { s.eta2 };
        Some(BsdfSample { weight, pdf, eta2, ..s })
    }

    fn sample_from_light(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        if self.parts.iter().all(|part| part.bump.is_none()) {
            return self.sample(wo, u, lobe);
        }
        let (part, first) = self.part_at(lobe)?;
        let s = part.sample_from_light(wo, u, ((lobe - first) / part.chance).min(LAST_LOBE))?;
        if s.delta {
            return Some(part.delta(s));
        }
        // Each part has a cosine of its own, so that the value is that of the reverse: of light that comes from `wo`.
        let pdf = self.pdf_from_light(wo, s.wi);
        let weight = self.eval(s.wi, wo)?.0 * ((s.wi.z / wo.z).abs() / pdf);
        Some(BsdfSample { weight, pdf: PdfW(pdf), eta2: 1.0, ..s })
    }

    fn pdf_from_light(&self, wo: Vec3, wi: Vec3) -> f32 {
        let parts = self.parts.iter().filter(|part| part.share > 0.0);
        parts.map(|part| part.chance * part.pdf_from_light(wo, wi)).sum()
    }

    fn has_diffuse_part(&self) -> bool {
        self.any(Unmixed::has_diffuse_part)
    }

    fn is_delta(&self) -> bool {
        !self.any(|bsdf| !bsdf.is_delta()) && !self.any_rough_coat()
    }

    fn is_glossy(&self) -> bool {
        self.any(Unmixed::is_glossy) || self.any_rough_coat()
    }

    fn transmits(&self) -> bool {
        self.any(Unmixed::transmits)
    }

    fn is_dispersive(&self) -> bool {
        self.several_refract
    }

    /// No colours part, but the factor that takes radiance to flux is that of all parts together: from values both ways, by reciprocity.
    fn dispersion(&self, wo: Vec3, wi: Vec3) -> Dispersion {
        let (Some((there, _)), Some((back, _))) = (self.eval(wo, wi), self.eval(wi, wo)) else {
            return Dispersion::NONE;
        };
        let eta2 = (back.0 * wi.z.abs()) / (there.0 * wo.z.abs());
        let usable = there.0.cmpgt(Vec4::ZERO) & eta2.is_finite_mask();
        Dispersion { eta2: Vec4::select(usable, eta2, Vec4::ONE), ..Dispersion::NONE }
    }

    fn delta_lobe(&self, wo: Vec3, lobe: f32, transmitted: bool) -> f32 {
        let number = |(part, first): (&MixedPart, f32)| match (transmitted, &part.coat) {
            (true, _) => first + (part.chance - NUMBER_STEP),
            (false, None) => first,
            (false, Some(PartCoat { coat, .. })) => {
                let within = part.delta_lobe(coat, wo, ((lobe - first) / part.chance).min(LAST_LOBE));
                first + within * part.chance
            }
        };
        self.part_at(lobe).map_or(lobe, number)
    }
}
