//! Camera paths for two eyes that share their first vertex (paper §6: stereo).
//!
//! A path from one eye, `own`, that meets a surface at x is also one of the other eye, if that sees x: what comes after x is the same, only the
//! material at x is seen from another direction. So it gives both eyes a sample, for the price of a shadow ray and of a few more evaluations of
//! one material. The samples of each eye then come from two techniques, its own camera rays and those of the other eye, and are weighted
//! by multiple importance sampling (Veach and Guibas 1995, the balance heuristic):
//!
//! - **Place.** Per unit of area at x, camera rays of an eye e have the density qₑ = (uv per steradian) · |cos θ| / d². Per unit of the screen
//!   of e, samples have the density 1 by rays of e, and q_f / qₑ by those of the other eye f. Each counts with the weight
//!   wₑ = qₑ / (qₑ + q_f), so that the weights have the density wₑ · (1 + q_f / qₑ) = 1 everywhere on the screen: the mean of the
//!   samples, Σ w·value / Σ w, is that of the picture.
//! - **Direction.** The direction ωᵢ at x is sampled with the density pₑ of the eye e whose path it is, and weighted as if with the mean
//!   p̄ = w_own · p_own + w_other · p_other of both, whichever eye it was. The throughput behind x is fₑ cos / p̄ for the eye e; p̄ also is the density
//!   in the MIS weights of next-event estimation. What is left is bounded wherever a path of one eye alone would be, however different the
//!   highlights of both eyes are.
//! - **What is not shared**: x on a delta, on a light, on a dispersive material or in a scene with media, and x that the other eye does not see
//!   or sees from the other side of the surface. Then only `own` has a sample, of weight 1, and takes twice as many branches, because
//!   its place of the screen has half of the paths. Deltas of a mixture at a shared x are seen by `own` alone: what they show counts 1 / w_own.
//!
//! All conditions depend on x and the point of the lens alone, and on both eyes in the same way, so that paths of both agree on them.
//!
//! Path tracing, bidirectional tracing ([`super::bidirectional`], with weights of its own) and photon mapping share paths by these rules; the latter
//! two trace two paths, whose mean is the sample, where path tracing takes twice as many branches.

use glam::{Vec3, Vec4};

use crate::color::Xyz;
use crate::math::pdf::PdfW;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::stream::{FaultyValue, MAX_VALUE, SampleSink, faults};
use crate::tracer::accel::PrimRange;
use crate::tracer::bsdf::{BsdfSample, Scattering};
use crate::tracer::camera::CameraView;
use crate::tracer::interaction::SurfaceInteraction;
use crate::tracer::light::{LightSample, Lights};
use crate::tracer::light_groups::LightCredits;
use crate::tracer::mis;
use crate::tracer::sampler::VertexNumbers;
use crate::tracer::subpath::VertexScattering;
use crate::tracer::vertex::SurfaceVertex;
use crate::tracer::walk::Walk;
use crate::tracer::wavelength_mis::WavelengthMis;

use super::RenderContext;
use super::direct_lighting::PathState;

/// A value for each eye of a pair: for the one whose path it is, and for the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ForEyes<T> {
    pub(super) own: T,
    pub(super) other: T,
}

impl<T> ForEyes<T> {
    /// `of` both values.
    #[inline]
    pub(super) fn map<U>(self, mut of: impl FnMut(T) -> U) -> ForEyes<U> {
        ForEyes { own: of(self.own), other: of(self.other) }
    }
}

impl ForEyes<SampledSpectrum> {
    /// All for the eye whose path it is.
    pub(super) const OWN: Self = Self { own: SampledSpectrum::ONE, other: SampledSpectrum::ZERO };

    /// All for both.
    const BOTH: Self = Self { own: SampledSpectrum::ONE, other: SampledSpectrum::ONE };

    /// Nothing for either.
    pub(super) const NOTHING: Self = Self { own: SampledSpectrum::ZERO, other: SampledSpectrum::ZERO };
}

/// Where a camera path begins.
#[derive(Clone, Copy, Debug)]
pub(super) struct CameraPlace {
    pub(super) uv: [f64; 2],
    /// The numbers that choose the point of the lens.
    pub(super) lens: [f32; 2],
}

/// The samples of a path: that of its own eye, and that of the other, if they share its first vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct SamplePair {
    own: EyeSample,
    other: Option<EyeSample>,
}

/// A camera sample.
#[derive(Clone, Copy, Debug)]
struct EyeSample {
    uv: [f32; 2],
    value: Xyz,
    weight: f32,
}

impl SamplePair {
    /// The sample of one eye.
    pub(super) fn alone(uv: [f64; 2], value: Xyz) -> Self {
        Self { own: EyeSample { uv: uv.map(|c| c as f32), value, weight: 1.0 }, other: None }
    }

    /// Samples of both.
    pub(super) fn shared(uv: [f64; 2], shared: &SharedVertex, value: ForEyes<Xyz>) -> Self {
        let ForEyes { own, other } = shared.weights;
        Self {
            own: EyeSample { uv: uv.map(|c| c as f32), value: value.own, weight: own },
            other: Some(EyeSample { uv: shared.uv, value: value.other, weight: other }),
        }
    }

    /// Sends the samples, each with `weight` times its own.
    pub(super) fn send(&self, weight: f32, out: &mut impl SampleSink) {
        let EyeSample { uv, value, weight: share } = self.own;
        out.camera(uv, value, weight * share);
        if let Some(EyeSample { uv, value, weight: share }) = self.other {
            out.camera_of_other_eye(uv, value, weight * share);
        }
    }
}

/// A vertex before both eyes, whatever stands in between.
#[derive(Clone, Copy, Debug)]
pub(super) struct FacedVertex {
    pub(super) views: ForEyes<CameraView>,
    /// The directions to the eyes, in the shading frame.
    pub(super) wo: ForEyes<Vec3>,
    /// The weights of the samples of both eyes, each above 0; their sum is 1.
    pub(super) weights: ForEyes<f32>,
}

/// The first vertex of a path, seen by both eyes.
#[derive(Clone, Copy, Debug)]
pub(super) struct SharedVertex {
    /// Where the other eye sees it.
    pub(super) uv: [f32; 2],
    /// The direction to the other eye, in the shading frame.
    pub(super) wo: Vec3,
    /// The weights of the samples of both eyes.
    pub(super) weights: ForEyes<f32>,
}

/// A camera path of one eye on its way, whose first vertex both share.
#[derive(Clone, Copy, Debug)]
pub(super) struct SharedPath {
    pub(super) vertex: SharedVertex,
    /// What the first vertex shows to each eye.
    pub(super) found: ForEyes<SampledSpectrum>,
    /// The share of each eye in what lies behind.
    pub(super) shares: ForEyes<SampledSpectrum>,
}

impl SharedPath {
    /// A path that has come to its first vertex, after it has found `before` on the way there.
    pub(super) fn new(vertex: SharedVertex, before: SampledSpectrum) -> Self {
        let mut path = Self { vertex, found: ForEyes::NOTHING, shares: ForEyes::OWN };
        path.add_alone(before);
        path
    }

    /// Adds what the first vertex shows to both, of which these are the shares.
    #[inline]
    pub(super) fn add(&mut self, value: SampledSpectrum, shares: &ForEyes<SampledSpectrum>) {
        self.found.own += value * shares.own;
        self.found.other += value * shares.other;
    }

    /// Adds what only paths of its own eye find, of whose samples those of the weight w_own are a part.
    pub(super) fn add_alone(&mut self, value: SampledSpectrum) {
        self.found.own += value * self.factor_alone();
    }

    /// The factor on what only paths of its own eye find.
    pub(super) fn factor_alone(&self) -> f32 {
        1.0 / self.vertex.weights.own
    }

    /// The sample `s` of the material at the first `vertex`, with which `walk` goes on for both eyes; a delta is seen by its own alone. `None`
    /// where it is black for both.
    pub(super) fn go_on<B: Scattering>(
        &mut self,
        vertex: &SurfaceVertex<B>,
        s: &BsdfSample,
        walk: &mut Walk<false>,
    ) -> Option<BsdfSample> {
        if s.delta {
            walk.throughput *= self.factor_alone();
            return Some(*s);
        }
        let (s, shares) = self.vertex.share_sample(vertex, s)?;
        self.shares = shares;
        Some(s)
    }

    /// What each eye sees, where the path has found `behind` behind its first vertex.
    pub(super) fn radiance(&self, behind: SampledSpectrum) -> ForEyes<SampledSpectrum> {
        let Self { found, shares, .. } = self;
        ForEyes { own: found.own + behind * shares.own, other: found.other + behind * shares.other }
    }
}

/// Which eyes have a sample by a camera path.
#[derive(Clone, Copy, Debug)]
pub(super) enum FirstVertex {
    /// There is one eye, or the path has met nothing.
    OfOne,
    /// Its own eye alone, of two.
    Alone,
    /// Both.
    Shared(SharedPath),
}

impl FirstVertex {
    /// Which eyes see `vertex`, the first of a path of `own`, which has found `before` on the way there.
    pub(super) fn of<B: Scattering>(
        own: &RenderContext,
        other: &RenderContext,
        vertex: &SurfaceVertex<B>,
        lens: [f32; 2],
        before: &mut SampledSpectrum,
    ) -> Self {
        let Some(shared) = own.share(other, vertex, lens) else { return Self::Alone };
        Self::Shared(SharedPath::new(shared, std::mem::take(before)))
    }

    /// What each eye sees at the wavelengths of the path, which has found `behind` behind its first vertex.
    pub(super) fn seen(&self, behind: SampledSpectrum, lambda: &SampledWavelengths) -> ForEyes<Xyz> {
        match self {
            Self::Shared(path) => {
                let ForEyes { own, other } = path.radiance(behind);
                let color = lambda.to_xyz(own);
                // What is diffuse looks the same to both.
                ForEyes { own: color, other: if other == own { color } else { lambda.to_xyz(other) } }
            }
            Self::OfOne | Self::Alone => ForEyes { own: lambda.to_xyz(behind), other: Xyz::BLACK },
        }
    }

    /// The path, if both eyes share its first vertex and it has so many segments that it is there.
    #[inline]
    pub(super) fn shared_at(&mut self, depth: u32) -> Option<&mut SharedPath> {
        match self {
            Self::Shared(path) if depth == 1 => Some(path),
            _ => None,
        }
    }
}

/// The values of f·|cos| of both eyes for one direction, over their greatest in each lane, which is `most`.
struct SharedScattering {
    most: SampledSpectrum,
    shares: ForEyes<SampledSpectrum>,
    /// The mean density of both eyes.
    pdf: PdfW,
}

impl SharedVertex {
    /// The material at `vertex` for both eyes; `None` where it is black for both.
    #[inline]
    fn eval<B: Scattering>(&self, vertex: &SurfaceVertex<B>, wi: Vec3) -> Option<SharedScattering> {
        if vertex.bsdf.as_diffuse().is_some() {
            // It looks the same to both.
            let (most, pdf) = vertex.bsdf.eval(vertex.wo, wi)?;
            return (!most.is_black()).then_some(SharedScattering { most, shares: ForEyes::BOTH, pdf });
        }
        let of = |wo| vertex.bsdf.eval(wo, wi).unwrap_or((SampledSpectrum::ZERO, PdfW(0.0)));
        let (own, other) = (of(vertex.wo), of(self.wo));
        let ForEyes { own: w_own, other: w_other } = self.weights;
        let pdf = PdfW(w_own * own.1.0 + w_other * other.1.0);
        let most = SampledSpectrum(own.0.0.max(other.0.0));
        if most.is_black() || pdf.0.is_nan() || pdf.0 <= 0.0 {
            return None;
        }
        let share = |f: SampledSpectrum| SampledSpectrum(f.0 / most.0.max(Vec4::splat(f32::MIN_POSITIVE)));
        Some(SharedScattering { most, shares: ForEyes { own: share(own.0), other: share(other.0) }, pdf })
    }

    /// The sample `s` of the material at `vertex`, which is no delta, weighted for both eyes, and the share of each eye in what it finds.
    pub(super) fn share_sample<B: Scattering>(
        &self,
        vertex: &SurfaceVertex<B>,
        s: &BsdfSample,
    ) -> Option<(BsdfSample, ForEyes<SampledSpectrum>)> {
        let SharedScattering { most, shares, pdf } = self.eval(vertex, s.wi)?;
        Some((BsdfSample { weight: most * (1.0 / pdf.0), pdf, ..*s }, shares))
    }

    /// How the vertex scatters to both eyes from the world-space direction `d`, as [`SubpathVertex::scatter_to`] says it of one: the greater of
    /// both values, the mean of both densities, and the share of each eye.
    ///
    /// [`SubpathVertex::scatter_to`]: crate::tracer::subpath::SubpathVertex::scatter_to
    #[inline]
    pub(super) fn scatter_to<B: Scattering>(
        &self,
        vertex: &SurfaceVertex<B>,
        d: Vec3,
    ) -> Option<(VertexScattering, ForEyes<SampledSpectrum>)> {
        let local = vertex.frame.to_local(d);
        let through = local.z * vertex.wo.z < 0.0;
        if !vertex.hit.sides_agree(d, through) {
            return None;
        }
        let SharedScattering { most, shares, pdf } = self.eval(vertex, local)?;
        let scattering = VertexScattering {
            value: most,
            wavelength_mis: WavelengthMis::ALL,
            fwd_w: pdf.0,
            // Nothing chooses a camera, so that no weight asks for it.
            rev_w: 0.0,
            cos: vertex.cosine(d),
            through,
        };
        Some((scattering, shares))
    }
}

impl RenderContext {
    /// The vertex at the end of the first segment as the other eye sees it; `None` where the eyes do not share it. `lens` has the numbers that chose the
    /// point of the lens.
    pub(super) fn share<B: Scattering>(
        &self,
        other: &RenderContext,
        vertex: &SurfaceVertex<B>,
        lens: [f32; 2],
    ) -> Option<SharedVertex> {
        let FacedVertex { views, wo, weights } = self.faces(other, vertex, lens)?;
        // What has passed a surface that is not all there is not shared, for both eyes.
        let shared = self.is_open(&vertex.hit, &views.other)
            && (!self.scene.has_holes() || self.is_open(&vertex.hit, &views.own));
        shared.then_some(SharedVertex { uv: views.other.uv, wo: wo.other, weights })
    }

    /// `vertex` before this eye and the other, if they share it unless something stands in between.
    pub(super) fn faces<B: Scattering>(
        &self,
        other: &RenderContext,
        vertex: &SurfaceVertex<B>,
        lens: [f32; 2],
    ) -> Option<FacedVertex> {
        let point = vertex.hit.point.p;
        if !self.may_share(vertex) {
            return None;
        }
        FacedVertex::in_views(
            vertex,
            ForEyes {
                own: self.camera.view(point, lens, &self.window)?,
                other: other.camera.view(point, lens, &other.window)?,
            },
        )
    }

    /// False where each eye has paths of its own, whatever it sees.
    #[inline]
    pub(super) fn may_share<B: Scattering>(&self, vertex: &SurfaceVertex<B>) -> bool {
        let SurfaceVertex { hit, bsdf, .. } = vertex;
        let is_alone = bsdf.is_delta() || bsdf.is_dispersive() || hit.light.is_some();
        !(is_alone || self.hide_emitters || self.scene.media().is_some())
    }

    /// True where nothing at all stands between `hit` and the eye that has this view of it.
    pub(super) fn is_open(&self, hit: &SurfaceInteraction, view: &CameraView) -> bool {
        self.scene.open_share(&hit.spawn_to(view.origin, -view.direction), PrimRange::NONE) == 1.0
    }
}

impl FacedVertex {
    /// `vertex`, which eyes [may share](RenderContext::may_share), in these views.
    pub(super) fn in_views<B: Scattering>(
        vertex: &SurfaceVertex<B>,
        views: ForEyes<CameraView>,
    ) -> Option<Self> {
        let SurfaceVertex { hit, frame, .. } = vertex;
        // Where several places of a picture show the vertex, its density is not that of one.
        if views.own.choices != 1.0 || views.other.choices != 1.0 {
            return None;
        }
        let cosines = views.map(|view| -view.direction.dot(hit.point.ng));
        let wo = views.map(|view| frame.to_local(-view.direction));
        if cosines.own * cosines.other <= 0.0 || wo.own.z * wo.other.z <= 0.0 {
            return None;
        }
        let density = |view: &CameraView, cosine: f32| view.uv_per_steradian * cosine.abs() / view.distance2;
        let (own, other) = (density(&views.own, cosines.own), density(&views.other, cosines.other));
        let weights = ForEyes { own: own / (own + other), other: other / (own + other) };
        (weights.own > 0.0 && weights.other > 0.0).then_some(Self { views, wo, weights })
    }
}

impl<C: LightCredits> PathState<C> {
    /// As [`add_direct`](Self::add_direct) at a vertex that both eyes share. Returns what the other eye sees.
    pub(super) fn add_shared_direct<B: Scattering>(
        &mut self,
        context: &RenderContext,
        vertex: &SurfaceVertex<B>,
        shared: &SharedVertex,
        u: &VertexNumbers,
    ) -> SampledSpectrum {
        let (scene, walk) = (&context.scene, self.walk);
        let lights = scene.lights();
        let sampled = lights.sample_by_contribution(
            vertex.light_context(),
            u.light_choice,
            u.light,
            |light, sample| self.shared_contribution(lights, vertex, shared, light, sample),
        );
        let Some((light, sample, value)) = sampled else { return SampledSpectrum::ZERO };
        let value = value * vertex.light_factor(scene, light, &sample, (&walk).into());
        if value.is_black() {
            return SampledSpectrum::ZERO;
        }
        let shares =
            shared.eval(vertex, vertex.frame.to_local(sample.wi)).map(|scattering| scattering.shares);
        let Some(ForEyes { own, other }) = shares else { return SampledSpectrum::ZERO };
        self.radiance += value * own;
        value * other
    }

    /// The greater of the contributions of a light sample to both eyes, if nothing occludes it.
    fn shared_contribution<B: Scattering>(
        &mut self,
        lights: &Lights,
        vertex: &SurfaceVertex<B>,
        shared: &SharedVertex,
        light: u32,
        sample: &LightSample,
    ) -> Option<SampledSpectrum> {
        let wi = vertex.frame.to_local(sample.wi);
        let SharedScattering { most, pdf, .. } = shared.eval(vertex, wi)?;
        if !vertex.hit.sides_agree(sample.wi, vertex.wo.z * wi.z < 0.0) {
            return None;
        }
        let weight = if sample.delta { 1.0 } else { mis::power(sample.pdf, pdf) };
        let emission = self.emission_of(lights, light, sample);
        let value = self.walk.throughput
            * most
            * emission
            * (self.wavelength_weight * sample.scale * weight / sample.pdf.0);
        if !value.is_within(MAX_VALUE) {
            faults::raise(FaultyValue::LightSample, value.into(), vertex.hit.known_surface(), Some(light));
            return None;
        }
        (!value.is_black()).then_some(value)
    }
}
