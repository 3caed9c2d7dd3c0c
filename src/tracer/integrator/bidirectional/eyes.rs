//! Camera subpaths of two eyes that share their first vertex ([`super::super::pair`]), and light subpaths that are connected to both cameras.
//!
//! A path of an eye e, from a light to its first vertex x and to the eye, is found by camera subpaths, of both eyes where they share x, and by light
//! subpaths that are connected to the camera of e. With q_e the density of x by camera rays of e and p_e that of the direction at x by the
//! material seen from e, camera subpaths of both eyes together, half of them of each, have the density q̄ · p̄ = (q_e p_e + q_f p_f) / 2, where
//!
//! ```text
//! q̄ = (q_e + q_f) / 2     p̄ = w_e p_e + w_f p_f     w_e = q_e / (q_e + q_f)
//! ```
//!
//! **Wherever weights ask for the density of a shared x, or of the direction there, by a camera subpath, they are given q̄ and p̄.** No other density of
//! a path depends on the eye. So the weights of all strategies that find a path are made of one set of densities, which is the same
//!
//! - whichever eye the camera subpath is of: q̄ and p̄ do not change when both eyes change places;
//! - for t ≥ 2 and for t = 1: whether x is shared depends on x, the point of the lens and both eyes alone, which a vertex of a light subpath knows
//!   as well ([`RenderContext::faces`]).
//!
//! Hence they sum to one over the strategies for each path of each eye. What a strategy with t ≥ 2 finds for e by subpaths of either eye g, with the
//! weight w_e of its sample and the MIS weight W, is
//!
//! ```text
//! Σ_g ∫ q_g p_g · w_e · (f_e / p̄) · W  =  ∫ (q_e + q_f) p̄ · w_e · (f_e / p̄) · W  =  ∫ q_e f_e W
//! ```
//!
//! since Σ_g q_g p_g = (q_e + q_f) p̄, and likewise without directions where x itself is connected: what subpaths of e alone would find. Paths by a delta at
//! x are found by subpaths of e alone, with the factor 1 / w_e. Where x is not shared all densities are those of one eye, whose samples are the means
//! of two camera subpaths: then both eyes have as many camera subpaths for their light subpaths, which are those of both, as one eye alone has, and
//! numbers of samples in the weights stay the same.

use glam::Vec4;

use crate::color::Xyz;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::bsdf::{BsdfSample, Scattering};
use crate::tracer::camera::CameraView;
use crate::tracer::integrator::RenderContext;
use crate::tracer::integrator::context::CameraConnection;
use crate::tracer::integrator::pair::{FacedVertex, FirstVertex, ForEyes, SharedVertex};
use crate::tracer::light_groups::LightCredits;
use crate::tracer::sampler::VertexNumbers;
use crate::tracer::subpath::{SubpathVertex, VertexScattering};
use crate::tracer::walk::Walk;

use super::strategies::{PathContribution, camera_weight};
use super::tracer::BidirectionalTracer;

impl<C: LightCredits> PathContribution<C> {
    /// Finds out whether the path of `own` is one of the `other` eye, too, at `vertex`, its first, whose density then is that of both.
    #[inline(never)]
    pub(super) fn meet_first<B: Scattering>(
        &mut self,
        own: &RenderContext,
        other: &RenderContext,
        vertex: &mut SubpathVertex<B>,
        lens: [f32; 2],
    ) {
        self.first = FirstVertex::of(own, other, &vertex.surface, lens, &mut self.radiance);
        if let FirstVertex::Shared(path) = &self.first {
            vertex.mis.fwd *= 0.5 / path.vertex.weights.own;
        }
    }

    /// The first vertex, if both eyes share it.
    pub(super) fn shared_vertex(&self) -> Option<SharedVertex> {
        match &self.first {
            FirstVertex::Shared(path) => Some(path.vertex),
            FirstVertex::OfOne | FirstVertex::Alone => None,
        }
    }

    /// The sample `s` of the material at `vertex`, with which `walk` goes on: for both eyes where they share the vertex. `None` where it is black
    /// for both.
    #[inline(always)]
    pub(super) fn go_on<B: Scattering>(
        &mut self,
        vertex: &SubpathVertex<B>,
        s: &BsdfSample,
        walk: &mut Walk<false>,
    ) -> Option<BsdfSample> {
        let Some(path) = self.first.shared_at(vertex.depth) else { return Some(*s) };
        // Lights that its own eye alone sees along deltas.
        path.add_alone(std::mem::take(&mut self.radiance));
        path.go_on(&vertex.surface, s, walk)
    }

    /// Adds what a connection contributes, by the shares of both eyes where the camera's vertex is shared.
    #[inline(always)]
    pub(super) fn add(&mut self, value: SampledSpectrum, shares: Option<&ForEyes<SampledSpectrum>>) {
        match (&mut self.first, shares) {
            (FirstVertex::Shared(path), Some(shares)) => path.add(value, shares),
            _ => self.radiance += value,
        }
    }

    /// The radiance so far, of the eye that sees more, summed over the wavelengths.
    pub(super) fn brightness(&self) -> f32 {
        match &self.first {
            FirstVertex::Shared(path) => {
                let ForEyes { own, other } = path.radiance(self.radiance).map(|seen| seen.0.element_sum());
                own.max(other)
            }
            FirstVertex::OfOne | FirstVertex::Alone => self.radiance.0.element_sum(),
        }
    }

    /// The factor on what only paths of its own eye find.
    pub(super) fn factor_alone(&self) -> f32 {
        match &self.first {
            FirstVertex::Shared(path) => path.factor_alone(),
            FirstVertex::OfOne | FirstVertex::Alone => 1.0,
        }
    }
}

impl BidirectionalTracer {
    /// As [`add_direct`](Self::add_direct), if both eyes share `vertex`. Returns whether they do.
    #[inline(always)]
    pub(super) fn add_shared_direct<B: Scattering>(
        &self,
        path: &mut PathContribution<B::Credits>,
        vertex: &SubpathVertex<B>,
        u: &VertexNumbers,
    ) -> bool {
        let shared = path.first.shared_at(vertex.depth).map(|path| path.vertex);
        if let Some(shared) = &shared {
            self.add_direct_of_both(path, vertex, shared, u);
        }
        shared.is_some()
    }

    #[inline(never)]
    fn add_direct_of_both<B: Scattering>(
        &self,
        path: &mut PathContribution<B::Credits>,
        vertex: &SubpathVertex<B>,
        shared: &SharedVertex,
        u: &VertexNumbers,
    ) {
        let scatter = |d| shared.scatter_to(&vertex.surface, d);
        let direct = self.sample_light(path, vertex, u, |d| scatter(d).map(|(scattering, _)| scattering));
        let Some((_, sample, direct)) = direct else { return };
        let shares = scatter(sample.wi).map(|(_, shares)| shares);
        path.add(direct, shares.as_ref());
    }

    /// t = 1 of two eyes: connects a vertex of the light subpath to both cameras, and returns the samples of the light stream of this eye and of
    /// the `other`.
    #[inline(never)]
    pub(super) fn to_both_cameras<B: Scattering>(
        &self,
        other: &RenderContext,
        lambda: &SampledWavelengths,
        lens: [f32; 2],
        vertex: &SubpathVertex<B>,
    ) -> [Option<([f32; 2], Xyz)>; 2] {
        let eyes = ForEyes { own: &self.context, other };
        let surface = &vertex.surface;
        let views = eyes.map(|eye| eye.view_of(surface, lens));
        let connect = |eye, view: Option<CameraView>| CameraEdge::new(eye, lambda, vertex, view?);
        let connected =
            ForEyes { own: connect(eyes.own, views.own), other: connect(eyes.other, views.other) };
        if [&connected.own, &connected.other].into_iter().flatten().all(|edge| edge.factor.is_black()) {
            return [None, None];
        }
        let is_open = |eye: &RenderContext, edge: &Option<CameraEdge>, view: &CameraView| match edge {
            Some(edge) => edge.factor.0 == Vec4::ONE,
            None => eye.is_open(&surface.hit, view),
        };
        let faced = match views {
            ForEyes { own: Some(own), other: Some(other) } if self.context.may_share(surface) => {
                FacedVertex::in_views(surface, ForEyes { own, other })
            }
            _ => None,
        };
        let faced = faced.filter(|FacedVertex { views, .. }| {
            is_open(eyes.own, &connected.own, &views.own)
                && is_open(eyes.other, &connected.other, &views.other)
        });
        let Some(FacedVertex { wo, weights, .. }) = faced else {
            let splat = |eye, edge: Option<CameraEdge>| edge?.splat(eye, lambda, vertex, None);
            return [splat(eyes.own, connected.own), splat(eyes.other, connected.other)];
        };
        // The density of going back along the light subpath, which a connection knows.
        let pdf = |edge: &Option<CameraEdge>, eye| match edge {
            Some(edge) => edge.connection.scattering.rev_w,
            None => surface.bsdf.eval(eye, surface.wo).map_or(0.0, |(_, pdf)| pdf.0),
        };
        let mean =
            weights.own * pdf(&connected.own, wo.own) + weights.other * pdf(&connected.other, wo.other);
        let splat =
            |eye, edge: Option<CameraEdge>, weight| edge?.splat(eye, lambda, vertex, Some((weight, mean)));
        [splat(eyes.own, connected.own, weights.own), splat(eyes.other, connected.other, weights.other)]
    }
}

/// A vertex of a light subpath, connected to a camera.
#[derive(Clone, Copy, Debug)]
struct CameraEdge {
    connection: CameraConnection,
    /// The factor of what stands in between; 1 for nothing.
    factor: SampledSpectrum,
}

impl CameraEdge {
    #[inline]
    fn new<B: Scattering>(
        eye: &RenderContext,
        lambda: &SampledWavelengths,
        vertex: &SubpathVertex<B>,
        view: CameraView,
    ) -> Option<Self> {
        let connection = eye.connect_in_view(vertex, view)?;
        Some(Self { factor: eye.camera_factor(vertex, lambda, &connection), connection })
    }

    /// The sample of the light stream. `shared` has the weight of camera samples of this eye, and the mean density of both eyes to go from the
    /// vertex to the one before, if both share the vertex.
    fn splat<B: Scattering>(
        &self,
        eye: &RenderContext,
        lambda: &SampledWavelengths,
        vertex: &SubpathVertex<B>,
        shared: Option<(f32, f32)>,
    ) -> Option<([f32; 2], Xyz)> {
        let CameraConnection { view, scattering, value } = &self.connection;
        let density = view.uv_per_steradian / eye.window_area() * scattering.cos / view.distance2;
        let weight = match shared {
            None => camera_weight(&vertex.mis, scattering, density),
            Some((share, mean)) => {
                let scattering = VertexScattering { rev_w: mean, ..*scattering };
                camera_weight(&vertex.mis, &scattering, density * (0.5 / share))
            }
        };
        let value = *value * weight * self.factor;
        (!value.is_black()).then(|| (view.uv, lambda.to_xyz(value)))
    }
}
