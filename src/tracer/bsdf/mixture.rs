//! A mixture of materials in fixed shares, some of which may be nothing: `blendbsdf` and `mask`, however they are nested.

use glam::{Vec2, Vec3};

use crate::math::pdf::PdfW;
use crate::scene::desc::MOST_PARTS;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};

use super::scattering::{BsdfSample, LAST_LOBE, MaterialModel, Scattering, ScatteringModel};
use super::thin::straight;
use super::{Diffuse, Material, Unmixed};

/// The end of a part's lobes; the last number below its share may round up to the next part.
const LAST_OF_PART: f32 = 1.0 - 1e-6;

/// A mixture, seen from one side of a surface.
#[derive(Clone, Debug, Default)]
pub struct MixtureMaterial {
    /// The materials, at most [`MOST_PARTS`].
    pub parts: Vec<MaterialPart>,
    /// The share of what passes straight, holes of a mask. With the shares of the parts at most 1.
    pub passes: f32,
}

/// A material that a mixture is made of.
#[derive(Clone, Debug)]
pub struct MaterialPart {
    /// The material, itself no mixture.
    pub material: Material,
    /// Its share.
    pub share: f32,
    /// It is evaluated in the frame of the front although the mixture is that of a back.
    pub turned: bool,
}

impl MaterialModel for MixtureMaterial {
    type Bsdf = Mixture;

    fn bsdf(&self, uv: Vec2, lambda: &SampledWavelengths) -> Mixture {
        let nothing =
            MixedPart { bsdf: Diffuse::new(SampledSpectrum::ZERO).into(), share: 0.0, turned: false };
        let part = |part: &MaterialPart| MixedPart {
            bsdf: Unmixed::of(&part.material, uv, lambda),
            share: part.share,
            turned: part.turned,
        };
        let parts = std::array::from_fn(|i| self.parts.get(i).map_or(nothing, part));
        Mixture { parts, passes: self.passes }
    }
}

/// A mixture at the wavelengths of a path. One of its parts is chosen by its share; of what is no delta all parts count.
#[derive(Clone, Copy, Debug)]
pub struct Mixture {
    parts: [MixedPart; MOST_PARTS],
    passes: f32,
}

#[derive(Clone, Copy, Debug)]
struct MixedPart {
    bsdf: Unmixed,
    share: f32,
    turned: bool,
}

impl MixedPart {
    /// A direction in the part's own frame, or back from it: a turn by 180° about the s axis.
    fn turn(&self, w: Vec3) -> Vec3 {
        if self.turned { Vec3::new(w.x, -w.y, -w.z) } else { w }
    }
}

impl Mixture {
    /// The part to which a lobe number belongs, with the first such number.
    fn part_at(&self, lobe: f32) -> Option<(&MixedPart, f32)> {
        let mut first = 0.0;
        for part in &self.parts {
            if lobe < first + part.share {
                return Some((part, first));
            }
            first += part.share;
        }
        None
    }

    fn any(&self, is: impl Fn(&Unmixed) -> bool) -> bool {
        self.parts.iter().any(|part| part.share > 0.0 && is(&part.bsdf))
    }
}

impl ScatteringModel for Mixture {
    /// The sum of all parts that are no deltas.
    fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        let (mut value, mut pdf) = (SampledSpectrum::ZERO, 0.0);
        for part in self.parts.iter().filter(|part| part.share > 0.0) {
            if let Some((f, p)) = part.bsdf.eval(part.turn(wo), part.turn(wi)) {
                value += f * part.share;
                pdf += p.0 * part.share;
            }
        }
        (pdf > 0.0).then_some((value, PdfW(pdf)))
    }

    fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        let Some((part, first)) = self.part_at(lobe) else {
            return (self.passes > 0.0).then(|| straight(wo, SampledSpectrum::ONE, self.passes));
        };
        let s = part.bsdf.sample(part.turn(wo), u, ((lobe - first) / part.share).min(LAST_LOBE))?;
        let wi = part.turn(s.wi);
        if s.delta {
            return Some(BsdfSample { wi, pdf: PdfW(s.pdf.0 * part.share), ..s });
        }
        let (value, pdf) = self.eval(wo, wi)?;
        let weight = value * (1.0 / pdf.0);
        weight.is_finite().then_some(BsdfSample { wi, weight, pdf, ..s })
    }

    fn has_diffuse_part(&self) -> bool {
        self.any(Unmixed::has_diffuse_part)
    }

    fn is_delta(&self) -> bool {
        !self.any(|bsdf| !bsdf.is_delta())
    }

    fn is_glossy(&self) -> bool {
        self.any(Unmixed::is_glossy)
    }

    fn transmits(&self) -> bool {
        self.any(Unmixed::transmits)
    }

    fn delta_lobe(&self, lobe: f32, transmitted: bool) -> f32 {
        let end = if transmitted { LAST_OF_PART } else { 0.0 };
        self.part_at(lobe).map_or(lobe, |(part, first)| first + part.share * end)
    }
}
