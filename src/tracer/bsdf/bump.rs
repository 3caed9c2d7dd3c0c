//! Normal maps and bump maps: a frame of its own for a material, tilted against the shading frame.
//!
//! Semantics are those of Mitsuba 3.9: the normal of a map is one in the shading frame. A nested material is evaluated in the tilted
//! frame, its cosine included. Nothing is scattered between directions that lie on different sides of the shading frame and the tilted
//! one, so that no direction below the surface carries light.
//!
//! # From lights
//!
//! A normal that faces away from the eye is turned around the shading normal, so that the frame depends on the direction to the eye. A
//! path from a light does not know that direction yet: it chooses one of the two frames, goes on in it, and ends where the direction
//! that it found belongs to the other ([`Bump::sample_from_light`]). Its weight has |cos θₗ'·cos θₑ| / |cos θₑ'·cos θₗ| in it, l towards
//! the light, e towards the eye, primed against the tilted normal: the correction of Veach 1997, §5.3.

use glam::Vec3;

use crate::math::frame::Frame;
use crate::math::pdf::PdfW;
use crate::scene::desc::texture::BitmapTexture;
use crate::scene::desc::{BsdfDesc, BumpDesc};
use crate::spectrum::SampledSpectrum;
use crate::tracer::sampler::attainable;

use super::scattering::{BsdfSample, LAST_LOBE, MaterialEvalContext, ScatteringModel};

/// A map of normals or heights over a material.
#[derive(Clone, Debug)]
pub struct BumpMaterial {
    map: Map,
    flips: bool,
    shadows: bool,
    mirrors: Mirrors,
}

/// The picture of a map.
#[derive(Clone, Debug)]
enum Map {
    Normals(BitmapTexture),
    /// Heights and a factor on them.
    Heights(BitmapTexture, f32),
}

/// Factors of ±1 on local directions: a back is the mirror image of a front, as in Mitsuba, where it is turned around here.
#[derive(Clone, Copy, Debug)]
pub struct Mirrors {
    /// From the frame of the side that is seen to that of the map.
    pub before: Vec3,
    /// From the tilted frame to that of the material within.
    pub after: Vec3,
}

impl BumpMaterial {
    /// The map that `desc` is; `None` for any other material.
    pub fn new(desc: &BsdfDesc, mirrors: Mirrors) -> Option<Self> {
        let (map, bump) = match desc {
            BsdfDesc::NormalMap(desc) => (Map::Normals(desc.normals.clone()), &desc.bump),
            BsdfDesc::BumpMap(desc) => (Map::Heights(desc.heights.clone(), desc.scale), &desc.bump),
            _ => return None,
        };
        let BumpDesc { flip_invalid_normals, use_shadowing_function, .. } = *bump;
        Some(Self { map, flips: flip_invalid_normals, shadows: use_shadowing_function, mirrors })
    }

    /// The map at a point.
    pub fn at(&self, context: &MaterialEvalContext) -> Bump {
        let normal = match &self.map {
            Map::Normals(normals) => normals.vector(context.texture.uv) * 2.0 - 1.0,
            Map::Heights(heights, scale) => tilted_by(heights.gradient(context.texture.uv) * *scale, context),
        };
        let normal = normal.try_normalize().unwrap_or(Vec3::Z);
        Bump { normal, flips: self.flips, shadows: self.shadows, mirrors: self.mirrors }
    }
}

/// The normal, in the shading frame, of a surface that is displaced along its normal by heights with these derivatives by u and v.
fn tilted_by(slope: glam::Vec2, context: &MaterialEvalContext) -> Vec3 {
    let frame = context.frame();
    let [du, dv] = [context.dp_du, context.dp_dv].map(|v| frame.to_local(v));
    let (du, dv) = if du == Vec3::ZERO || dv == Vec3::ZERO { (Vec3::X, Vec3::Y) } else { (du, dv) };
    let normal = du.with_z(slope.x).cross(dv.with_z(slope.y));
    if frame.to_world(normal).dot(context.ng) < 0.0 { -normal } else { normal }
}

/// A map at a point.
#[derive(Clone, Copy, Debug)]
pub struct Bump {
    /// Unit normal in the frame of the map.
    normal: Vec3,
    flips: bool,
    shadows: bool,
    mirrors: Mirrors,
}

impl Bump {
    /// f·|cos θᵢ| and density of `bsdf` in the tilted frame.
    pub(super) fn eval(
        &self,
        bsdf: &impl ScatteringModel,
        wo: Vec3,
        wi: Vec3,
    ) -> Option<(SampledSpectrum, PdfW)> {
        let (wo, wi) = (wo * self.mirrors.before, wi * self.mirrors.before);
        let tilted = self.tilted(self.is_flipped(wo));
        let (value, pdf) = bsdf.eval(tilted.inwards(wo)?, tilted.inwards(wi)?)?;
        Some((value * self.shadowing(wi), pdf))
    }

    /// Samples `bsdf` in the tilted frame.
    pub(super) fn sample(
        &self,
        bsdf: &impl ScatteringModel,
        wo: Vec3,
        u: [f32; 2],
        lobe: f32,
    ) -> Option<BsdfSample> {
        let wo = wo * self.mirrors.before;
        let tilted = self.tilted(self.is_flipped(wo));
        let s = bsdf.sample(tilted.inwards(wo)?, u, lobe)?;
        let wi = tilted.outwards(s.wi)?;
        Some(BsdfSample { wi: wi * self.mirrors.before, weight: s.weight * self.shadowing(wi), ..s })
    }

    /// Samples `bsdf` for a path from a light.
    pub(super) fn sample_from_light(
        &self,
        bsdf: &impl ScatteringModel,
        wo: Vec3,
        u: [f32; 2],
        lobe: f32,
    ) -> Option<BsdfSample> {
        let wo = wo * self.mirrors.before;
        let chance = self.chance_of_flipped(wo)?;
        let flipped = lobe < chance;
        let (first, share) = if flipped { (0.0, chance) } else { (chance, 1.0 - chance) };
        let tilted = self.tilted(flipped);
        let within = tilted.inwards(wo)?;
        let s = bsdf.sample(within, u, ((lobe - first) / share).min(LAST_LOBE))?;
        let wi = tilted.outwards(s.wi).filter(|wi| self.is_flipped(*wi) == flipped)?;
        let cosines = (within.z * wi.z / (s.wi.z * wo.z)).abs();
        Some(BsdfSample {
            wi: wi * self.mirrors.before,
            weight: s.weight * (self.shadowing(wo) * cosines / share),
            pdf: PdfW(s.pdf.0 * share),
            ..s
        })
    }

    /// The density of [`sample_from_light`](Self::sample_from_light).
    pub(super) fn pdf_from_light(&self, bsdf: &impl ScatteringModel, wo: Vec3, wi: Vec3) -> f32 {
        let (wo, wi) = (wo * self.mirrors.before, wi * self.mirrors.before);
        let Some(chance) = self.chance_of_flipped(wo) else { return 0.0 };
        let flipped = self.is_flipped(wi);
        let (tilted, share) = (self.tilted(flipped), if flipped { chance } else { 1.0 - chance });
        match (tilted.inwards(wo), tilted.inwards(wi)) {
            (Some(wo), Some(wi)) if share > 0.0 => share * bsdf.pdf_from_light(wo, wi),
            _ => 0.0,
        }
    }

    /// True where the normal that is seen from `wo` is the turned one.
    fn is_flipped(&self, wo: Vec3) -> bool {
        self.flips && wo.z * wo.dot(self.normal) <= 0.0
    }

    /// The probability with which a path from a light takes the turned normal; `None` where neither normal is lit.
    fn chance_of_flipped(&self, wo: Vec3) -> Option<f32> {
        let lit = |flipped: bool| self.tilted(flipped).inwards(wo).is_some();
        match (lit(false), self.flips && lit(true)) {
            (false, false) => None,
            (true, false) => Some(0.0),
            (false, true) => Some(1.0),
            // Few directions see it: about the angle between normals over π of the hemisphere.
            (true, true) => Some(attainable(0.5 * self.normal.truncate().length().min(1.0))),
        }
    }

    fn tilted(&self, flipped: bool) -> TiltedFrame {
        let n = self.normal;
        let n = if flipped { Vec3::new(-n.x, -n.y, n.z) } else { n };
        TiltedFrame { frame: Frame::along(n, Vec3::X), after: self.mirrors.after }
    }

    /// The share of the light from `wi` that the microfacets that a tilted normal stands for do not hide.
    fn shadowing(&self, wi: Vec3) -> f32 {
        if !self.shadows {
            return 1.0;
        }
        let tan2 = |w: Vec3| w.truncate().length_squared() / (w.z * w.z);
        // A roughness of the same mean slope.
        let alpha2 = (0.125 * tan2(self.normal)).min(1.0);
        2.0 / (1.0 + (1.0 + alpha2 * tan2(wi)).sqrt())
    }
}

/// The frame of the material within, in that of the map.
struct TiltedFrame {
    frame: Frame,
    after: Vec3,
}

impl TiltedFrame {
    /// A direction as the material within sees it; `None` where it lies on different sides of the two frames.
    fn inwards(&self, w: Vec3) -> Option<Vec3> {
        let within = self.frame.to_local(w);
        (within.z * w.z > 0.0).then_some(within * self.after)
    }

    /// The reverse.
    fn outwards(&self, within: Vec3) -> Option<Vec3> {
        let within = within * self.after;
        let w = self.frame.to_world(within);
        (within.z * w.z > 0.0).then_some(w)
    }
}
