//! Particle tracing: paths from lights, each vertex connected to the camera (Dutré, Lafortune and Willems 1993).

use crate::color::Xyz;
use crate::spectrum::SampledWavelengths;
use crate::stream::{PathCounts, SampleSink, UvWindow};
use crate::tracer::accel::Ray;
use crate::tracer::bsdf::{Bsdf, CreditedBsdf, Diffuse, InMedia, Recorded, Scattering, Smooth, Unmixed};
use crate::tracer::camera::CameraRay;
use crate::tracer::medium::FreeFlight;
use crate::tracer::output::send_light;
use crate::tracer::record::{PathEvent, record};
use crate::tracer::sampler::{CameraNumbers, LightSampler};
use crate::tracer::subpath::{Subpath, SubpathVertex};
use crate::tracer::{MaterialClass, Sampler, TracingMode};

use super::{Integrator, RenderContext};

/// Traces paths from lights. It fills the light stream only: every vertex that the camera sees adds a density over uv.
///
/// It cannot find what a delta shows (the room in a mirror, a lamp behind glass): no vertex of a light path lies on the
/// camera, and a delta scatters nothing towards a given point. Nor does it find what media emit: its paths begin on lights.
#[derive(Clone, Debug)]
pub struct ParticleTracer {
    /// Scene, view and settings.
    pub context: RenderContext,
}

impl Integrator for ParticleTracer {
    type Scratch = ();

    fn trace(&self, index: u64, _: &mut (), out: &mut impl SampleSink) {
        let context = &self.context;
        let scene = &context.scene;
        let sampler = Sampler::at(index, context.seed);
        let CameraNumbers { lens, wavelength, .. } = sampler.camera();
        let lambda = context.wavelengths(wavelength);
        if context.camera.has_parallel_rays() {
            self.add_backdrop(lens, &lambda, out);
        }
        let numbers = sampler.light();
        let Some(emission) = scene.lights.emit(&numbers.emission()) else { return };
        let emitted = scene.lights.emitted(&emission, &lambda);
        let group = scene.lights.group(emission.light);
        if context.longest() >= 1 && !emitted.is_black() {
            let sample = |eye: &RenderContext| {
                let (view, factor) = eye.connect_light_to_camera(&emission, &lambda, lens)?;
                Some((view.uv, lambda.to_xyz(emitted * factor)))
            };
            self.send(out, group, sample);
        }
        let Some(subpath) = scene.light_subpath(lambda, &emission, emitted) else { return };
        let ray = emission.ray();
        match (scene.tracing_mode(), scene.material_class()) {
            (TracingMode::Plain, MaterialClass::Diffuse) => {
                self.follow::<Diffuse>(subpath, ray, &numbers, None, out)
            }
            (TracingMode::Plain, MaterialClass::Specular) => {
                self.follow::<Smooth>(subpath, ray, &numbers, None, out)
            }
            (TracingMode::Plain, MaterialClass::General) => {
                self.follow::<Unmixed>(subpath, ray, &numbers, None, out)
            }
            (TracingMode::Plain, MaterialClass::Mixed) => {
                self.follow::<Bsdf>(subpath, ray, &numbers, None, out)
            }
            (TracingMode::Plain, MaterialClass::InMedia) => {
                self.follow::<InMedia>(subpath, ray, &numbers, None, out)
            }
            (TracingMode::Record, _) => {
                record(PathEvent::Begins((&subpath.walk).into()));
                self.follow::<Recorded>(subpath, ray, &numbers, None, out);
            }
            (TracingMode::LightGroups, _) => self.follow::<CreditedBsdf>(subpath, ray, &numbers, group, out),
        }
    }

    fn paths_per_index(&self) -> PathCounts {
        PathCounts { camera: 0, light: 1 }
    }

    fn wavelength_number(index: u64, context: &RenderContext) -> f32 {
        Sampler::at(index, context.seed).camera().wavelength
    }
}

impl From<RenderContext> for ParticleTracer {
    fn from(context: RenderContext) -> Self {
        Self { context }
    }
}

impl ParticleTracer {
    /// Sends the light sample of each eye, whose light comes from this group, if there are groups.
    #[inline(always)]
    fn send(
        &self,
        out: &mut impl SampleSink,
        group: Option<u8>,
        sample: impl Fn(&RenderContext) -> Option<([f32; 2], Xyz)>,
    ) {
        if let Some((uv, value)) = sample(&self.context) {
            send_light(out, uv, value * self.context.light_share(), group);
        }
        if let Some(other) = self.context.partner()
            && let Some((uv, value)) = sample(other)
        {
            out.light_of_other_eye(uv, value);
        }
    }

    /// Adds what a camera of parallel rays sees of the environment: no light path takes just their direction. The numbers of the lens,
    /// which such a camera has not, choose a place of the picture.
    #[cold]
    fn add_backdrop(&self, place: [f32; 2], lambda: &SampledWavelengths, out: &mut impl SampleSink) {
        let context = &self.context;
        let Some(light) = context.environment(0).filter(|_| context.longest() >= 1) else { return };
        let UvWindow { min, max } = context.window;
        let uv = [0, 1].map(|i| min[i] + (max[i] - min[i]) * place[i]);
        let Some(start) = context.camera.start(uv.map(f64::from), place) else { return };
        let CameraRay { ray, from: None, .. } = start else { return };
        let emitted = context.scene.lights.spectrum(light, ray.origin, ray.direction, lambda);
        let factor = context.open_factor(&ray, context.medium_along(&ray), lambda);
        if !(emitted * factor).is_black() {
            let value = lambda.to_xyz(emitted * factor * context.window_area());
            send_light(out, uv, value, context.scene.lights.group(light));
        }
    }

    /// Follows a subpath along `ray` to its end and connects each vertex to the camera. Its light comes from this group, if there are groups.
    fn follow<B: Scattering>(
        &self,
        mut subpath: Subpath<true>,
        mut ray: Ray,
        numbers: &LightSampler,
        group: Option<u8>,
        out: &mut impl SampleSink,
    ) {
        let context = &self.context;
        while subpath.walk.depth + 1 < context.longest() {
            let mut flight = FreeFlight::of::<B>(&context.scene, || numbers.flight(subpath.walk.depth));
            let next = context.scene.next_light_vertex::<B>(&mut subpath.walk, &mut ray, &mut flight);
            let Some(hit) = next else { break };
            let vertex: SubpathVertex<B> = subpath.arrive(&context.scene, hit);
            B::record(|| PathEvent::Meets((&subpath.walk).into(), hit));
            let u = numbers.vertex(subpath.walk.depth - 1);
            let lambda = &subpath.walk.lambda;
            self.send(out, group, |eye| {
                let connection = eye.connect_to_camera(&vertex, u.light)?;
                let factor = eye.camera_factor(&vertex, lambda, &connection);
                (!factor.is_black()).then(|| (connection.view.uv, lambda.to_xyz(connection.value * factor)))
            });
            let each = |own, ray| self.follow::<B>(own, ray, numbers, group, out);
            let Some(next) = subpath.scatter_each(&vertex, &u, context.rr_depth, each) else { return };
            ray = next;
        }
        B::record(|| PathEvent::Leaves((&subpath.walk).into()));
    }
}
