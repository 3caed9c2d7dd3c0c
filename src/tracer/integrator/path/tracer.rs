//! One path: what it hits, and what it finds there.

use std::sync::Arc;

use glam::Vec3;

use crate::math::frame::Frame;
use crate::scene::desc::IntegratorDesc;
use crate::spectrum::SampledSpectrum;
use crate::stream::{PathCounts, SampleSink, UvWindow};
use crate::tracer::accel::Ray;
use crate::tracer::bsdf::{Bsdf, BsdfSample, Diffuse, Scattering, Smooth};
use crate::tracer::integrator::{Integrator, RenderContext, Special};
use crate::tracer::interaction::SurfaceInteraction;
use crate::tracer::light::{LightSample, LitPoint};
use crate::tracer::sampler::VertexNumbers;
use crate::tracer::{Camera, MaterialClass, Sampler, Scene, mis};

use super::carried::Carried;
use super::splitting::{BITS, WHOLE};

/// Traces paths from the camera; each vertex also samples a light, and both ways of finding a light are
/// combined by multiple importance sampling. A path splits at its first vertex that is no delta, if it is not among the first of the
/// sequence. The code is made for what the surfaces of the scene are ([`Scene::material_class`]): the choice is one branch per path.
#[derive(Clone, Debug)]
pub struct PathTracer {
    /// Scene, view and settings.
    pub context: RenderContext,
}

/// A hit with its material at the wavelengths of the path.
struct Vertex<'a, B> {
    hit: &'a SurfaceInteraction,
    /// The frame `wo` and the material are in.
    frame: Frame,
    bsdf: B,
    wo: Vec3,
}

impl<'a, B: Scattering> Vertex<'a, B> {
    #[inline]
    fn new(scene: &Scene, path: &Carried, hit: &'a SurfaceInteraction) -> Self {
        let (material, frame) = scene.material(hit);
        Self { frame, bsdf: B::of(material, &path.lambda), wo: frame.to_local(hit.wo), hit }
    }

    #[inline]
    fn lit_point(&self) -> LitPoint {
        LitPoint::of(self.hit.point.p, &self.frame, (&self.bsdf, self.wo))
    }
}

impl PathTracer {
    /// A path tracer with the settings of a scene file.
    pub fn new(
        scene: Arc<Scene>,
        camera: Camera,
        desc: &IntegratorDesc,
        seed: u32,
        window: UvWindow,
    ) -> Self {
        Self { context: RenderContext::new(scene, camera, desc, seed, window) }
    }

    /// Follows `path` along `ray` to its end.
    #[inline]
    fn follow<B: Scattering>(&self, path: &mut Carried, mut ray: Ray, sampler: &Sampler) {
        while let Some(hit) = self.arrive(path, &ray) {
            let vertex = Vertex::<B>::new(&self.context.scene, path, &hit);
            let u = sampler.vertex(path.depth);
            if !vertex.bsdf.is_delta() {
                if path.splits() {
                    return self.split(path, &vertex, sampler);
                }
                self.direct(path, &vertex, &u);
            }
            match self.scatter(path, &vertex, sampler, &u) {
                Some(next) => ray = next,
                None => return,
            }
        }
    }

    /// Goes on from `vertex` in several branches. Of one light a single sample is seldom noisy; of several every branch
    /// chooses its own.
    fn split<B: Scattering>(&self, path: &mut Carried, vertex: &Vertex<B>, sampler: &Sampler) {
        let together = self.context.scene.lights.len() <= 1;
        if together {
            self.direct(path, vertex, &sampler.vertex(path.depth));
        }
        for number in 0..1 << BITS {
            let (mut branch, sampler) = (path.branch(1 << BITS), sampler.branch(number, BITS));
            let u = sampler.vertex(path.depth);
            if !together {
                self.direct(&mut branch, vertex, &u);
            }
            if let Some(ray) = self.scatter(&mut branch, vertex, &sampler, &u) {
                self.follow::<B>(&mut branch, ray, &sampler);
            }
            path.add(branch.radiance);
        }
    }

    /// What `path` meets along `ray`, if it goes on from there. Light that shines back is added.
    #[inline(always)]
    fn arrive(&self, path: &mut Carried, ray: &Ray) -> Option<SurfaceInteraction> {
        let RenderContext { scene, hide_emitters, .. } = &self.context;
        let longest = self.context.longest();
        if path.depth >= longest {
            return None;
        }
        let hidden = path.depth == 0 && *hide_emitters;
        let hit = if hidden { scene.closest_unlit(*ray) } else { scene.closest(ray) };
        let Some(hit) = hit else {
            if !hidden && let Some(light) = scene.lights.environment() {
                let pdf = |at| scene.lights.pdf(light, at, (ray.direction, None));
                path.meet(&scene.lights, (light, ray.direction), pdf);
            }
            return None;
        };
        if let Some(light) = hit.light
            && hit.wo.dot(hit.point.ng) > 0.0
        {
            let pdf = |at| scene.lights.pdf(light, at, (ray.direction, Some(&hit.point)));
            path.meet(&scene.lights, (light, ray.direction), pdf);
        }
        (path.depth + 1 < longest).then_some(hit)
    }

    /// Light that arrives straight from a sampled light.
    #[inline]
    fn direct<B: Scattering>(&self, path: &mut Carried, vertex: &Vertex<B>, u: &VertexNumbers) {
        let scene = &self.context.scene;
        let numbers = (u.light_choice, u.light);
        let found = scene.lights.sample_by(vertex.lit_point(), numbers, |light, sample| {
            self.unshadowed(path, vertex, (light, sample))
        });
        // The shadow ray is the costly part: ask only if the path carries light.
        if let Some((light, sample, value)) = found
            && scene.visible(vertex.hit, light, &sample)
        {
            path.add(value);
        }
    }

    /// What a sample of a light adds to the path if nothing shadows it; `None` for nothing.
    #[inline]
    fn unshadowed<B: Scattering>(
        &self,
        path: &mut Carried,
        vertex: &Vertex<B>,
        (light, sample): (u32, &LightSample),
    ) -> Option<SampledSpectrum> {
        let wi = vertex.frame.to_local(sample.wi);
        let (f, pdf) = vertex.bsdf.eval(vertex.wo, wi)?;
        if !vertex.hit.sides_agree(sample.wi, vertex.wo.z * wi.z < 0.0) {
            return None;
        }
        let weight = if sample.delta { 1.0 } else { mis::power(sample.pdf, pdf) };
        let emission = path.emission(&self.context.scene.lights, light, sample.wi);
        let counts = path.counts_after(&vertex.bsdf, (vertex.wo, wi));
        let value = path.throughput * f * emission * (counts * sample.scale * weight / sample.pdf.0);
        (!value.is_black()).then_some(value)
    }

    /// Samples the material at `vertex`; the ray to go on with.
    #[inline]
    fn scatter<B: Scattering>(
        &self,
        path: &mut Carried,
        vertex: &Vertex<B>,
        sampler: &Sampler,
        u: &VertexNumbers,
    ) -> Option<Ray> {
        let s = vertex.bsdf.sample(vertex.wo, u.bsdf, u.lobe)?;
        if s.hero_only {
            self.each_alone(path, vertex, &s, (sampler, u.roulette));
            return None;
        }
        let wi = vertex.frame.to_world(s.wi);
        if !vertex.hit.sides_agree(wi, s.transmitted) {
            return None;
        }
        path.follow(&s, (&vertex.bsdf, vertex.wo), || vertex.lit_point());
        path.roulette(self.context.rr_depth, u.roulette).then(|| vertex.hit.spawn(wi))
    }

    /// Colours part for good: follows each wavelength to its end, all with the same numbers, so that what they have in
    /// common has no colour.
    #[cold]
    fn each_alone<B: Scattering>(
        &self,
        path: &mut Carried,
        vertex: &Vertex<B>,
        s: &BsdfSample,
        (sampler, u): (&Sampler, f32),
    ) {
        for lane in 0..4 {
            let Some((wi, eta2)) = vertex.bsdf.refract(vertex.wo, lane) else { continue };
            let wi = vertex.frame.to_world(wi);
            let mut own = path.alone(lane, (s.weight, eta2));
            if vertex.hit.sides_agree(wi, true) && own.roulette(self.context.rr_depth, u) {
                self.follow::<B>(&mut own, vertex.hit.spawn(wi), sampler);
                path.add(own.radiance);
            }
        }
    }
}

impl Integrator for PathTracer {
    type Scratch = ();

    fn trace(&self, index: u64, _: &mut (), out: &mut impl SampleSink) {
        let RenderContext { seed, camera, .. } = &self.context;
        let sampler = Sampler::at(index, *seed);
        let numbers = sampler.camera();
        let uv = self.context.place(numbers.screen);
        let lambda = self.context.wavelengths(numbers.wavelength);
        // Where noise is measured there is no picture to begin.
        let whole = index < WHOLE && self.context.places.is_none();
        let mut path = Carried::new(lambda, whole);
        let ray = camera.ray(uv, numbers.lens);
        match self.context.scene.material_class() {
            MaterialClass::Diffuse => self.follow::<Diffuse>(&mut path, ray, &sampler),
            MaterialClass::Specular => self.follow::<Smooth>(&mut path, ray, &sampler),
            MaterialClass::General => self.follow::<Bsdf>(&mut path, ray, &sampler),
        }
        out.camera(uv.map(|c| c as f32), lambda.to_xyz(path.radiance), 1.0);
    }

    fn paths_per_index(&self) -> PathCounts {
        PathCounts { camera: 1, light: 0 }
    }
}

impl From<RenderContext> for PathTracer {
    fn from(context: RenderContext) -> Self {
        Self { context }
    }
}

impl Special for PathTracer {}
