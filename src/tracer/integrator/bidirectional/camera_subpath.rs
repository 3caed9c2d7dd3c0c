//! The subpath from the camera, with what it finds by itself: emission, and direct light by next-event estimation.

use crate::tracer::Sampler;
use crate::tracer::bsdf::Scattering;
use crate::tracer::camera::CameraRay;
use crate::tracer::integrator::RenderContext;
use crate::tracer::integrator::direct_lighting::add_emitted_by_medium;
use crate::tracer::integrator::prefix::Prefix;
use crate::tracer::medium::FreeFlight;
use crate::tracer::record::PathEvent;
use crate::tracer::specular_chain::SpecularChain;
use crate::tracer::subpath::{Subpath, SubpathVertex};
use crate::tracer::walk::Walk;

use super::strategies::{PathContribution, SPLAT_SAMPLES};
use super::tracer::BidirectionalTracer;

impl BidirectionalTracer {
    /// Walks from the camera through `uv`, adds the emission and the direct light that it finds, and leaves the vertices that
    /// can be connected in `vertices`. It is one of the `other` eye, too, if there is such and it sees the first vertex. Lights that merging finds
    /// are left to it, where it is in use. Returns whether the first surface scattered as a delta.
    #[inline(always)]
    pub(super) fn trace_camera_subpath<B: Scattering>(
        &self,
        path: &mut PathContribution<B::Credits>,
        mut other: Option<&RenderContext>,
        uv: [f64; 2],
        sampler: &Sampler,
        merging: bool,
        vertices: &mut Vec<SubpathVertex<B>>,
    ) -> bool {
        let context = &self.context;
        let RenderContext { scene, camera, rr_depth, .. } = context;
        let longest = context.longest();
        let lens = sampler.camera().lens;
        let Some(CameraRay { mut ray, from, uv_per_steradian }) = camera.start(uv, lens) else {
            // A path of nothing, so that those of an index can be counted.
            let nothing = Subpath::from_camera(path.lambda, None, 1.0, 0.0, context.medium);
            B::record(|| PathEvent::Begins((&nothing.walk).into()));
            return false;
        };
        // A ray that no light path finds is as after a delta.
        let (pdf, splats) = match uv_per_steradian > 0.0 {
            true => (uv_per_steradian / context.window_area(), SPLAT_SAMPLES),
            false => (1.0, 0.0),
        };
        let mut subpath = Subpath::from_camera(path.lambda, from, pdf, splats, context.medium);
        B::record(|| PathEvent::Begins((&subpath.walk).into()));
        // Where next-event estimation would have found the light that is hit next.
        let mut last = None;
        let (mut prefix, mut specular, mut chain) = (Prefix::CAMERA, false, SpecularChain::CAMERA);
        let mut flight = FreeFlight::of::<B>(scene, || sampler.flight(0));
        while subpath.walk.depth < longest {
            let next = context.next_vertex::<B>(&mut subpath.walk, &mut ray, &mut flight, |_, piece| {
                add_emitted_by_medium::<B, _>(&mut path.radiance, &mut path.credits, scene.lights(), &piece);
            });
            let Some(hit) = next else {
                if !(merging && prefix.is_merged())
                    && let Some(light) = context.environment(subpath.walk.depth)
                {
                    self.add_environment(path, light, &subpath, last, ray.direction);
                }
                break;
            };
            if scene.passes(&mut ray, &hit) {
                if !(merging && prefix.is_merged()) {
                    let vertex = subpath.clone().arrive(scene, hit);
                    self.add_emitted::<B>(path, last, &vertex, chain.probability());
                }
                subpath.walk.pass::<B>(scene, &hit, ray.direction);
                continue;
            }
            let mut vertex: SubpathVertex<B> = subpath.arrive(scene, hit);
            if !(merging && prefix.is_merged()) {
                self.add_emitted(path, last, &vertex, chain.probability());
            }
            if subpath.walk.depth == longest {
                break;
            }
            B::record(|| PathEvent::Meets((&subpath.walk).into(), hit));
            let numbers = sampler.vertex(subpath.walk.depth - 1);
            if let Some(other) = other.take() {
                path.meet_first(context, other, &mut vertex, lens);
            }
            if !vertex.surface.bsdf.is_delta() && !self.add_shared_direct(path, &vertex, &numbers) {
                self.add_direct(path, &vertex, &numbers);
            }
            last = Some(vertex.surface.light_context());
            let next = Walk::<false>::sample(&vertex.surface, &numbers).and_then(|s| {
                self.add_light_behind_deltas(path, &mut chain, &vertex, &s);
                let s = path.go_on(&vertex, &s, &mut subpath.walk)?;
                subpath.scatter_into(&vertex, &s, &numbers, *rr_depth)
            });
            let diffuse = vertex.surface.bsdf.has_diffuse_part();
            if !vertex.surface.bsdf.is_delta() {
                vertices.push(vertex);
            }
            // The link is 0 after a delta. Merging has a roulette of its own, so that it does not matter whether this walk goes on.
            prefix = prefix.then(subpath.previous.link == 0.0, diffuse);
            specular |= subpath.walk.depth == 1 && prefix.is_specular();
            let Some(next) = next else { return specular };
            ray = next;
            flight = FreeFlight::of::<B>(scene, || sampler.flight(subpath.walk.depth));
        }
        B::record(|| PathEvent::Leaves((&subpath.walk).into()));
        specular
    }
}
