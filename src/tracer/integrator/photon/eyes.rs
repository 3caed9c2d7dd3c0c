//! Camera paths of photon mapping for two eyes that share their first vertex ([`pair`](crate::tracer::integrator::pair)).
//!
//! Both eyes gather the same photons, around the same vertices: these depend on the place alone. What a photon contributes is evaluated at its own
//! wavelengths, step by step, for both eyes at once: they differ in the direction from the first vertex alone, where the photon itself may lie. All
//! steps have the densities of both.

use glam::Vec3;

use crate::color::Xyz;
use crate::tracer::Sampler;
use crate::tracer::accel::Ray;
use crate::tracer::bsdf::{BsdfSample, Scattering};
use crate::tracer::integrator::RenderContext;
use crate::tracer::integrator::pair::{FirstVertex, ForEyes, SamplePair};
use crate::tracer::light_groups::LightCredits;
use crate::tracer::sampler::VertexNumbers;
use crate::tracer::vertex::SurfaceVertex;

use super::camera_path::{CameraPath, PathStart};
use super::recorded_step::RecordedStep;
use super::tracer::PhotonScratch;

impl PathStart<'_> {
    /// Follows a path of one eye through `uv` along `ray`. It is one of the `other` eye, too, if that sees its first vertex; if not, there are two
    /// paths, whose mean is the sample.
    #[inline(never)]
    pub(super) fn trace_pair<B: Scattering>(
        self,
        other: &RenderContext,
        uv: [f64; 2],
        ray: Ray,
        sampler: &Sampler,
        scratch: &mut PhotonScratch,
    ) -> SamplePair {
        let mut path = self.begin::<B::Credits>(scratch);
        path.other_eye = Some((other, sampler.camera().lens));
        path.follow::<B>(ray, sampler);
        let (first, seen) = path.end_for_eyes();
        match first {
            FirstVertex::Shared(path) => SamplePair::shared(uv, &path.vertex, seen),
            FirstVertex::OfOne => SamplePair::alone(uv, seen.own),
            FirstVertex::Alone => {
                let (second, _) = self.begin(scratch).trace::<B>(ray, &sampler.branch(1, 1));
                SamplePair::alone(uv, (seen.own + second) * 0.5)
            }
        }
    }
}

impl<C: LightCredits> CameraPath<'_, C> {
    /// Finds out whether the path is one of the `other` eye, too, at `vertex`, its first. `lens` has the numbers of the lens.
    #[inline(never)]
    pub(super) fn meet_first<B: Scattering>(
        &mut self,
        other: &RenderContext,
        vertex: &SurfaceVertex<B>,
        lens: [f32; 2],
    ) {
        self.first = FirstVertex::of(&self.tracer.context, other, vertex, lens, &mut self.state.radiance);
    }

    /// Adds direct light at `vertex` for both eyes, if they share it. Returns whether they do.
    #[inline]
    pub(super) fn add_shared_direct<B: Scattering>(
        &mut self,
        vertex: &SurfaceVertex<B>,
        u: &VertexNumbers,
    ) -> bool {
        let Some(path) = self.first.shared_at(self.state.walk.depth) else { return false };
        path.found.other += self.state.add_shared_direct(&self.tracer.context, vertex, &path.vertex, u);
        path.found.own += std::mem::take(&mut self.state.radiance);
        true
    }

    /// The sample `s` of the material at `vertex`, for both eyes where they share the vertex. `None` where it is black for both.
    #[inline]
    pub(super) fn go_on<B: Scattering>(
        &mut self,
        vertex: &SurfaceVertex<B>,
        s: &BsdfSample,
    ) -> Option<BsdfSample> {
        let Some(path) = self.first.shared_at(self.state.walk.depth) else { return Some(*s) };
        // Lights that its own eye alone sees along deltas.
        path.add_alone(std::mem::take(&mut self.state.radiance));
        path.go_on(vertex, s, &mut self.state.walk)
    }

    /// The factor on the step with the sample `s` at the last vertex: a delta at the first vertex is seen by its own eye alone.
    #[inline]
    pub(super) fn factor_alone(&mut self, s: &BsdfSample) -> f32 {
        match self.first.shared_at(self.state.walk.depth) {
            Some(path) if s.delta => path.factor_alone(),
            _ => 1.0,
        }
    }

    /// The direction to the other eye at the first vertex, in its shading frame, if that eye sees what photons show at the last.
    #[inline]
    pub(super) fn other_eye_at_first(&self) -> Option<Vec3> {
        let FirstVertex::Shared(path) = &self.first else { return None };
        // Where paths are shared there are no media: the first step is that from the first vertex. What a delta shows there its own eye sees alone.
        let by_delta = self.scratch.steps.first().is_some_and(RecordedStep::is_delta);
        (!by_delta).then_some(path.vertex.wo)
    }

    /// Which eyes see the first vertex, and the colour of the path for each.
    fn end_for_eyes(self) -> (FirstVertex, ForEyes<Xyz>) {
        let ForEyes { own, other } = self.first.seen(self.state.radiance, &self.state.walk.lambda);
        (self.first, ForEyes { own: self.xyz + own, other: self.xyz_of_other + other })
    }
}
