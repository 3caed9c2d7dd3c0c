//! The ways to complete a path: what each contributes.

use glam::Vec3;

use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::stream::SampleSink;
use crate::tracer::bsdf::Scattering;
use crate::tracer::light::{LightSample, LitEdge};
use crate::tracer::sampler::VertexNumbers;
use crate::tracer::subpath::{Vertex, Walk};

use super::BidirectionalTracer;
use super::found::Found;
use super::weight::{self, Meeting};

impl BidirectionalTracer {
    /// s = 0: the camera subpath has come upon a light, if `vertex` is one.
    #[inline]
    pub(super) fn meet_light<B: Scattering>(
        &self,
        found: &mut Found,
        last: Option<&Vertex<B>>,
        vertex: &Vertex<B>,
    ) {
        let Vertex { hit, throughput, wavelength_mis, chain, .. } = vertex;
        let Some(light) = hit.light.filter(|_| hit.wo.dot(hit.point.ng) > 0.0) else { return };
        let lights = &self.context.scene.lights;
        let weight = last.map_or(1.0, |last| {
            let direct = lights.pdf(light, last.lit_point(last.wo), (-hit.wo, Some(&hit.point)));
            let emission = lights.emission_pdf(light, hit.point.p, hit.wo);
            weight::met(chain, &Meeting { direct, emission })
        });
        let emitted = self.emission(found, light, -hit.wo);
        found.radiance += *throughput * emitted * (weight * wavelength_mis.weight());
    }

    /// s = 0: the camera subpath has left the scene in `direction`.
    pub(super) fn meet_environment<B: Scattering>(
        &self,
        found: &mut Found,
        walk: &Walk<false>,
        (last, direction): (Option<&Vertex<B>>, Vec3),
    ) {
        let lights = &self.context.scene.lights;
        let Some(light) = lights.environment() else { return };
        let weight = last.map_or(1.0, |last| {
            let direct = lights.pdf(light, last.lit_point(last.wo), (direction, None));
            let emission = lights.emission_pdf(light, Vec3::ZERO, -direction);
            weight::met(&walk.step().far(), &Meeting { direct, emission })
        });
        let emitted = self.emission(found, light, direction);
        found.radiance += walk.throughput * emitted * (weight * walk.wavelength_mis.weight());
    }

    /// s = 1: light that arrives straight from a sampled light.
    #[inline]
    pub(super) fn direct<B: Scattering>(&self, found: &mut Found, vertex: &Vertex<B>, u: &VertexNumbers) {
        let (lights, at) = (&self.context.scene.lights, vertex.lit_point(vertex.wo));
        let sampled = lights.sample_by(at, (u.light_choice, u.light), |light, sample| {
            self.unshadowed(found, vertex, (light, sample))
        });
        if let Some((light, sample, value)) = sampled
            && self.context.scene.visible(&vertex.hit, light, &sample)
        {
            found.radiance += value;
        }
    }

    /// What a sample of a light gives if nothing shadows it; `None` for nothing.
    #[inline]
    fn unshadowed<B: Scattering>(
        &self,
        found: &mut Found,
        vertex: &Vertex<B>,
        (light, sample): (u32, &LightSample),
    ) -> Option<SampledSpectrum> {
        let scattered = vertex.scatter_to::<false>(sample.wi)?;
        let emitted = self.emission(found, light, sample.wi);
        let value = vertex.throughput * scattered.value * emitted * (sample.scale / sample.pdf.0);
        if value.is_black() || !value.is_finite() {
            return None;
        }
        let target = sample.target.unwrap_or(Vec3::ZERO);
        let density = self.context.scene.lights.walk_over_direct(&LitEdge {
            light,
            target,
            direction: -sample.wi,
            distance2: target.distance_squared(vertex.hit.point.p),
            cos: scattered.cos,
            direct: sample.pdf,
        });
        let counts = vertex.wavelength_mis.and(scattered.wavelength_mis).weight();
        let value = value * (counts * weight::next_event(&vertex.chain, &scattered, (sample, density)));
        (!value.is_black()).then_some(value)
    }

    /// t = 1: a vertex of the light subpath as the camera sees it.
    #[inline]
    pub(super) fn to_camera<B: Scattering>(
        &self,
        (lambda, lens): (&SampledWavelengths, [f32; 2]),
        vertex: &Vertex<B>,
        out: &mut impl SampleSink,
    ) {
        let Some(seen) = self.context.see(vertex, lens) else { return };
        let pdf = seen.view.uv_per_steradian / self.context.window_area();
        let density = pdf * seen.scattered.cos / seen.view.distance2;
        let value = seen.value * weight::seen(&vertex.chain, &seen.scattered, density);
        if !value.is_black() && self.context.is_open(vertex, &seen.view) {
            out.light(seen.view.uv, lambda.to_xyz(value));
        }
    }

    /// The spectrum of `light` along `wi`, remembered: most paths meet one light again and again.
    #[inline]
    fn emission(&self, found: &mut Found, light: u32, wi: Vec3) -> SampledSpectrum {
        match found.emission {
            Some((known, value)) if known == light => value,
            _ => {
                let lights = &self.context.scene.lights;
                let value = lights.spectrum(light, wi, &found.lambda);
                if !lights.is_directional(light) {
                    found.emission = Some((light, value));
                }
                value
            }
        }
    }
}
