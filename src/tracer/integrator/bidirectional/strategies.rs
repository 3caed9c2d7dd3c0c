//! The contribution of each strategy, and its MIS weight by the power heuristic over all strategies.
//!
//! [`SubpathMis`] holds what the rest of a subpath adds to the weight; here is what the completing edge adds. Connections of
//! two subpaths (s ≥ 2, t ≥ 2) are chosen in [`super::connections`].

use glam::Vec3;

use crate::color::Xyz;
use crate::math::pdf::PdfW;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::stream::{FaultyValue, MAX_VALUE, faults};
use crate::tracer::bsdf::{BsdfSample, Scattering};
use crate::tracer::integrator::delta_chains::LightBehindDeltas;
use crate::tracer::integrator::direct_lighting::{EmissionCache, sample_direct};
use crate::tracer::integrator::pair::FirstVertex;
use crate::tracer::light::{Emission, EmissionOrigin, EmissionPdf, LightSample, LightSampleContext, Lights};
use crate::tracer::light_groups::LightCredits;
use crate::tracer::medium::EdgeWavelengths;
use crate::tracer::record::PathEvent;
use crate::tracer::sampler::VertexNumbers;
use crate::tracer::specular_chain::SpecularChain;
use crate::tracer::subpath::{Subpath, SubpathVertex, VertexScattering};
use crate::tracer::subpath_mis::{CONNECTION_SAMPLES, SubpathMis, quotient, weight};

use super::tracer::{BidirectionalTracer, CAMERA_SUBPATHS, LIGHT_SUBPATHS};

/// Samples that the strategy t = 1 counts as in weights, for one of next-event estimation. It has [`LIGHT_SUBPATHS`] for [`CAMERA_SUBPATHS`],
/// but a splat that reaches a pixel by chance is worse than its density says, which the weights compare: from the camera the pixel is always
/// reached.
pub(super) const SPLAT_SAMPLES: f32 = 0.4 * LIGHT_SUBPATHS as f32 / CAMERA_SUBPATHS as f32;

/// The radiance of one path of the camera stream, summed over all strategies.
pub(super) struct PathContribution<C> {
    /// The wavelengths of the path.
    pub(super) lambda: SampledWavelengths,
    /// Radiance at them; where two eyes share the first vertex, what was found behind it.
    pub(super) radiance: SampledSpectrum,
    /// The radiance by groups of lights.
    pub(super) credits: C,
    /// Which eyes see the first vertex.
    pub(super) first: FirstVertex,
    emission: EmissionCache,
}

impl<C: LightCredits> PathContribution<C> {
    pub(super) fn new(lambda: SampledWavelengths) -> Self {
        let (radiance, credits) = (SampledSpectrum::ZERO, C::default());
        Self { lambda, radiance, credits, first: FirstVertex::OfOne, emission: EmissionCache::default() }
    }

    /// Adds the radiance of a light that was hit by chance, if it is a number.
    #[inline]
    fn add_emission(&mut self, lights: &Lights, value: SampledSpectrum, surface: Option<u32>, light: u32) {
        match value.is_within(MAX_VALUE) {
            true => {
                self.radiance += value;
                self.credits.add(lights, light, value);
            }
            false => faults::raise(FaultyValue::Emission, value.into(), surface, Some(light)),
        }
    }
}

/// The weight of s = 0, a light that was hit by chance: `mis` is that of the vertex on the light, or of the direction in
/// which the scene was left. `light_pdf` is the density of next-event estimation from the vertex before, per steradian;
/// `emission` has the densities with which a light subpath begins with this edge.
#[inline]
fn emitted_weight(mis: &SubpathMis, light_pdf: PdfW, emission: EmissionPdf) -> f32 {
    // After a delta no other strategy finds the edge, however large its density.
    let one = if mis.link[0] > 0.0 { quotient(light_pdf.0, mis.fwd_w) } else { 0.0 };
    let two = quotient(emission.vertex, mis.fwd) * mis.previous_sum(emission.next);
    weight(one, two)
}

/// The weight of s = 1, next-event estimation. `density` is that of a light subpath to choose vertex and edge, over
/// next-event estimation's for the latter, per unit of area at the vertex.
#[inline]
fn direct_weight(mis: &SubpathMis, scattering: &VertexScattering, sample: &LightSample, density: f32) -> f32 {
    let hit = if sample.delta { 0.0 } else { quotient(scattering.fwd_w, sample.pdf.0) };
    weight(mis.sum(density, scattering.rev_w, scattering.through), hit)
}

/// The weight of s ≥ 2, t ≥ 2: an edge of squared length 1 / `inverse` between two subpaths, each of which scatters to the
/// other.
#[inline]
pub(super) fn connection_weight(
    camera: &SubpathMis,
    at_camera: &VertexScattering,
    light: &SubpathMis,
    at_light: &VertexScattering,
    inverse: f32,
) -> f32 {
    let from_camera =
        camera.sum(at_light.fwd_w * at_camera.cos * inverse, at_camera.rev_w, at_camera.through);
    let from_light = light.sum(at_camera.fwd_w * at_light.cos * inverse, at_light.rev_w, at_light.through);
    let samples = f64::from(CONNECTION_SAMPLES);
    weight(from_camera / samples, from_light / samples)
}

/// The weight of t = 1. `density` is the camera's of the vertex, per unit of area.
#[inline]
pub(super) fn camera_weight(mis: &SubpathMis, scattering: &VertexScattering, density: f32) -> f32 {
    let others = mis.sum(density, scattering.rev_w, scattering.through);
    weight(0.0, others / f64::from(SPLAT_SAMPLES))
}

impl BidirectionalTracer {
    /// The links of the first vertex of a light subpath: the density with which next-event estimation would have chosen
    /// the light's vertex over that of the walk, for an eye on the side of the light and for one on the other side.
    pub(super) fn link_to_light<B: Scattering>(
        &self,
        vertex: &SubpathVertex<B>,
        emission: &Emission,
    ) -> [f32; 2] {
        let (lights, surface) = (&self.context.scene.lights, &vertex.surface);
        let on = (emission.pdf.origin == EmissionOrigin::Surface).then_some(&emission.from);
        [surface.wo, -surface.wo].map(|eye| {
            let context = surface.light_context_from(eye);
            if emission.pdf.origin == EmissionOrigin::Beam {
                return 0.0;
            }
            if emission.pdf.origin.is_delta() {
                return lights.probability(emission.light, context) / emission.pdf.vertex;
            }
            let pdf = lights.pdf(emission.light, context, surface.hit.wo, on);
            pdf.0 * vertex.mis.back / emission.pdf.vertex
        })
    }

    /// s = 0: adds the emission of the light at `vertex`, if it is on one, times `factor`. `last` is the vertex before, as a point that lights
    /// are sampled from.
    #[inline(always)]
    pub(super) fn add_emitted<B: Scattering>(
        &self,
        path: &mut PathContribution<B::Credits>,
        last: Option<LightSampleContext>,
        vertex: &SubpathVertex<B>,
        factor: f32,
    ) {
        let hit = &vertex.surface.hit;
        let Some(light) = hit.emitter() else { return };
        let lights = &self.context.scene.lights;
        let weight = last.map_or(1.0, |last| {
            let pdf = lights.pdf(light, last, -hit.wo, Some(&hit.point));
            emitted_weight(&vertex.mis, pdf, lights.aimed_emission_pdf(light, hit.point.p, hit.wo))
        });
        let emitted = path.emission.emission(lights, light, hit.point.p, -hit.wo, &path.lambda);
        let value = vertex.throughput * emitted * (weight * factor * vertex.wavelength_mis.weight());
        path.add_emission(lights, value, hit.known_surface(), light);
        B::record(|| PathEvent::Radiance(path.radiance));
    }

    /// s = 0, which is the only strategy here: adds the lights that are seen from `vertex` along chains of deltas, except in the direction of `s`, in
    /// which the subpath continues.
    #[inline(always)]
    pub(super) fn add_light_behind_deltas<B: Scattering>(
        &self,
        path: &mut PathContribution<B::Credits>,
        chain: &mut SpecularChain,
        vertex: &SubpathVertex<B>,
        s: &BsdfSample,
    ) {
        let found = self.context.light_behind_deltas(chain, &vertex.surface, s, &path.lambda, vertex.depth);
        if let Some(LightBehindDeltas { radiance, credits }) = found {
            let value = vertex.throughput * radiance;
            match value.is_within(MAX_VALUE) {
                true => {
                    path.radiance += value;
                    path.credits.add_all(&credits, vertex.throughput);
                }
                false => faults::raise(
                    FaultyValue::Emission,
                    value.into(),
                    vertex.surface.hit.known_surface(),
                    None,
                ),
            }
            B::record(|| PathEvent::Radiance(path.radiance));
        }
    }

    /// s = 0: adds the emission of the environment `light`, where the camera subpath leaves the scene in `direction`.
    pub(super) fn add_environment<C: LightCredits>(
        &self,
        path: &mut PathContribution<C>,
        light: u32,
        subpath: &Subpath<false>,
        last: Option<LightSampleContext>,
        direction: Vec3,
    ) {
        let lights = &self.context.scene.lights;
        let weight = last.map_or(1.0, |last| {
            let pdf = lights.pdf(light, last, direction, None);
            let emission = lights.aimed_emission_pdf(light, last.p, -direction);
            emitted_weight(&subpath.previous.infinite(), pdf, emission)
        });
        let emitted = path.emission.emission(lights, light, Vec3::ZERO, direction, &path.lambda);
        let value = subpath.walk.throughput * emitted * (weight * subpath.walk.wavelength_mis.weight());
        path.add_emission(lights, value, None, light);
    }

    /// s = 1: adds light that arrives at `vertex` straight from a light, by next-event estimation.
    #[inline(always)]
    pub(super) fn add_direct<B: Scattering>(
        &self,
        path: &mut PathContribution<B::Credits>,
        vertex: &SubpathVertex<B>,
        u: &VertexNumbers,
    ) {
        let direct = self.sample_light(path, vertex, u, |wi| vertex.scatter_to::<false>(wi));
        if let Some((light, _, direct)) = direct {
            path.radiance += direct;
            path.credits.add(&self.context.scene.lights, light, direct);
        }
    }

    /// Samples a light from `vertex`, which scatters to it as `scatter` says, and returns it with the sample and what that contributes.
    #[inline(always)]
    pub(super) fn sample_light<B: Scattering>(
        &self,
        path: &mut PathContribution<B::Credits>,
        vertex: &SubpathVertex<B>,
        u: &VertexNumbers,
        scatter: impl Fn(Vec3) -> Option<VertexScattering>,
    ) -> Option<(u32, LightSample, SampledSpectrum)> {
        let lights = &self.context.scene.lights;
        let wavelengths = EdgeWavelengths { lambda: &{ path.lambda }, mis: vertex.wavelength_mis };
        sample_direct(&self.context.scene, &vertex.surface, u, wavelengths, |light, sample| {
            let scattering = scatter(sample.wi)?;
            let at = sample.target.unwrap_or(Vec3::ZERO);
            let emitted = path.emission.emission(lights, light, at, sample.wi, &path.lambda);
            let value = vertex.throughput * scattering.value * emitted * (sample.scale / sample.pdf.0);
            if value.is_black() {
                return None;
            }
            let p = vertex.surface.hit.point.p;
            let density = lights.emission_over_direct(light, sample, p, scattering.cos);
            let wavelength_weight = vertex.wavelength_mis.and(scattering.wavelength_mis).weight();
            let value =
                value * (wavelength_weight * direct_weight(&vertex.mis, &scattering, sample, density));
            if !value.is_within(MAX_VALUE) {
                faults::raise(
                    FaultyValue::LightSample,
                    value.into(),
                    vertex.surface.hit.known_surface(),
                    Some(light),
                );
                return None;
            }
            (!value.is_black()).then_some(value)
        })
    }

    /// t = 1: connects a vertex of the light subpath to the camera, and returns the sample of the light stream.
    #[inline]
    pub(super) fn to_camera<B: Scattering>(
        &self,
        lambda: &SampledWavelengths,
        lens: [f32; 2],
        vertex: &SubpathVertex<B>,
    ) -> Option<([f32; 2], Xyz)> {
        let eye = &self.context;
        let connection = eye.connect_to_camera(vertex, lens)?;
        let (view, scattering) = (&connection.view, &connection.scattering);
        let pdf = view.uv_per_steradian / eye.window_area();
        let density = pdf * scattering.cos / view.distance2;
        let value = connection.value * camera_weight(&vertex.mis, scattering, density);
        if value.is_black() {
            return None;
        }
        let factor = eye.camera_factor(vertex, lambda, &connection);
        (!factor.is_black()).then(|| (view.uv, lambda.to_xyz(value * factor)))
    }
}
