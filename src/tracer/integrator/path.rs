//! Path tracing from the camera with next-event estimation.

use std::sync::Arc;

use glam::{Vec3, Vec4};

use crate::color::Xyz;
use crate::math::frame::Frame;
use crate::math::pdf::PdfW;
use crate::scene::desc::IntegratorDesc;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::stream::{PathCounts, SampleSink, UvWindow};
use crate::tracer::accel::Ray;
use crate::tracer::bsdf::{Bsdf, BsdfSample};
use crate::tracer::heroes::Heroes;
use crate::tracer::interaction::SurfaceInteraction;
use crate::tracer::light::LitPoint;
use crate::tracer::sampler::VertexNumbers;
use crate::tracer::{Camera, Sampler, Scene, mis, roulette};

use super::Integrator;

/// Traces paths from the camera; each vertex also samples a light, and both ways of finding a light are
/// combined by multiple importance sampling.
///
/// Depth counts as in Mitsuba: `max_depth` segments at most, so 1 shows lights only and 2 direct light.
#[derive(Clone, Debug)]
pub struct PathTracer {
    /// The scene.
    pub scene: Arc<Scene>,
    /// Where it is seen from.
    pub camera: Camera,
    /// Which randomisation of the sequence.
    pub seed: u32,
    /// The part of the screen to cover.
    pub window: UvWindow,
    /// Longest path in segments; `None` is unlimited.
    pub max_depth: Option<u32>,
    /// Number of segments from which roulette may end a path; above 1024 it is 1024.
    pub rr_depth: u32,
    /// The camera looks through lights.
    pub hide_emitters: bool,
}

/// What a path carries from vertex to vertex.
struct Walk {
    /// What materials and lights are evaluated at: the wavelengths of the path, or one of them alone.
    lambda: SampledWavelengths,
    /// Product of the weights so far.
    throughput: SampledSpectrum,
    /// Radiance found so far at the wavelengths of the path.
    radiance: SampledSpectrum,
    /// The wavelengths that would have chosen the same way, and what it counts for.
    heroes: (Heroes, f32),
    /// Undoes the radiance scaling of refraction for roulette.
    eta2: f32,
    /// How the last direction was chosen; `None` by a delta.
    last: Option<(LitPoint, PdfW)>,
    /// Emission at the wavelengths of the path: light, value.
    emission: Option<(u32, SampledSpectrum)>,
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
        let IntegratorDesc { max_depth, rr_depth, hide_emitters, .. } = *desc;
        Self { scene, camera, seed, window, max_depth, rr_depth, hide_emitters }
    }

    /// The CIE XYZ radiance along a ray.
    #[inline]
    fn radiance(&self, ray: Ray, sampler: &Sampler, wavelength: f32) -> Xyz {
        let lambda = SampledWavelengths::sample(wavelength);
        let mut walk = Walk {
            lambda,
            throughput: SampledSpectrum::ONE,
            radiance: SampledSpectrum::ZERO,
            heroes: (Heroes::ALL, 1.0),
            eta2: 1.0,
            last: None,
            emission: None,
        };
        self.walk(&mut walk, ray, sampler, 0);
        lambda.to_xyz(walk.radiance)
    }

    /// Goes on along `ray` with the path's segment number `first`.
    #[inline]
    fn walk(&self, walk: &mut Walk, mut ray: Ray, sampler: &Sampler, first: u32) {
        let max_depth = self.max_depth.unwrap_or(u32::MAX);
        for depth in first..max_depth {
            let hidden = depth == 0 && self.hide_emitters;
            let hit = if hidden { self.scene.closest_unlit(ray) } else { self.scene.closest(&ray) };
            let Some(hit) = hit else {
                if !hidden && let Some(light) = self.scene.lights.environment() {
                    let pdf = |at| self.scene.lights.pdf(light, at, (ray.direction, None));
                    walk.meet(self, light, ray.direction, pdf);
                }
                return;
            };
            if let Some(light) = hit.light
                && hit.wo.dot(hit.point.ng) > 0.0
            {
                let pdf = |at| self.scene.lights.pdf(light, at, (ray.direction, Some(&hit.point)));
                walk.meet(self, light, ray.direction, pdf);
            }
            if depth + 1 == max_depth {
                return;
            }
            match self.scatter(walk, &hit, sampler, depth) {
                Some(next) => ray = next,
                None => return,
            }
        }
    }

    /// Samples a light and the material at `hit`; the ray to go on with.
    #[inline]
    fn scatter(
        &self,
        walk: &mut Walk,
        hit: &SurfaceInteraction,
        sampler: &Sampler,
        depth: u32,
    ) -> Option<Ray> {
        let u = &sampler.vertex(depth);
        let (material, frame) = self.scene.material(hit);
        let vertex = Vertex { hit, frame, bsdf: material.bsdf(&walk.lambda), wo: frame.to_local(hit.wo) };
        if !vertex.bsdf.is_delta() {
            self.direct(walk, &vertex, u);
        }
        let s = vertex.bsdf.sample(vertex.wo, u.bsdf, u.lobe)?;
        if s.hero_only {
            self.each_alone(walk, &vertex, &s, (sampler, depth));
            return None;
        }
        let wi = frame.to_world(s.wi);
        if !hit.sides_agree(wi, s.transmitted) {
            return None;
        }
        walk.throughput *= s.weight;
        walk.eta2 *= s.eta2;
        walk.last = (!s.delta).then(|| (vertex.lit_point(), s.pdf));
        if s.transmitted && vertex.bsdf.parts_colors() {
            let heroes = walk.heroes.0.and(vertex.bsdf.part(vertex.wo, s.wi).heroes);
            walk.heroes = (heroes, heroes.weight());
        }
        self.survives(walk, depth, u).then(|| hit.spawn(wi))
    }

    /// Roulette before segment `depth` + 1.
    #[inline]
    fn survives(&self, walk: &mut Walk, depth: u32, u: &VertexNumbers) -> bool {
        walk.roulette(depth + 1 >= self.rr_depth.min(roulette::LATEST), u.roulette)
    }

    /// Colours part for good: follows each wavelength to its end, all with the same numbers, so that what they have in
    /// common has no colour.
    #[cold]
    fn each_alone(&self, walk: &mut Walk, vertex: &Vertex, s: &BsdfSample, at: (&Sampler, u32)) {
        let (sampler, depth) = at;
        for lane in 0..4 {
            let Some((wi, eta2)) = vertex.bsdf.refract(vertex.wo, lane) else { continue };
            let wi = vertex.frame.to_world(wi);
            let mut own = Walk {
                lambda: walk.lambda.alone(lane),
                throughput: walk.throughput * SampledSpectrum(s.weight.0 * Vec4::AXES[lane]),
                radiance: SampledSpectrum::ZERO,
                eta2: walk.eta2 * eta2,
                last: None,
                ..*walk
            };
            if vertex.hit.sides_agree(wi, true) && self.survives(&mut own, depth, &sampler.vertex(depth)) {
                self.walk(&mut own, vertex.hit.spawn(wi), sampler, depth + 1);
                walk.radiance += own.radiance;
            }
        }
    }

    /// Light that arrives straight from a sampled light.
    #[inline]
    fn direct(&self, walk: &mut Walk, vertex: &Vertex, u: &VertexNumbers) {
        let sampled = self.scene.lights.sample(vertex.lit_point(), u.light_choice, u.light);
        let Some((light, sample)) = sampled else { return };
        let wi = vertex.frame.to_local(sample.wi);
        let Some((f, pdf)) = vertex.bsdf.eval(vertex.wo, wi) else { return };
        if !vertex.hit.sides_agree(sample.wi, vertex.wo.z * wi.z < 0.0) {
            return;
        }
        let weight = if sample.delta { 1.0 } else { mis::power(sample.pdf, pdf) };
        let emission = walk.emission(self, light, sample.wi);
        let value = walk.throughput * f * emission * (sample.scale * weight / sample.pdf.0);
        let value = value * walk.counts_after(vertex, wi);
        // The shadow ray is the costly part: ask only if the path carries light.
        if !value.is_black() && self.scene.visible(vertex.hit, light, &sample) {
            walk.radiance += value;
        }
    }
}

/// A hit with its material at the wavelengths of the path.
struct Vertex<'a> {
    hit: &'a SurfaceInteraction,
    /// The frame `wo` and the material are in.
    frame: Frame,
    bsdf: Bsdf,
    wo: Vec3,
}

impl Vertex<'_> {
    #[inline]
    fn lit_point(&self) -> LitPoint {
        let n = if self.wo.z < 0.0 { -self.frame.n } else { self.frame.n };
        LitPoint { p: self.hit.point.p, n }
    }
}

impl Walk {
    /// The spectrum of `light` seen along `wi`, remembered if it is the same everywhere: most paths meet one light
    /// again and again.
    #[inline]
    fn emission(&mut self, tracer: &PathTracer, light: u32, wi: Vec3) -> SampledSpectrum {
        match self.emission {
            Some((known, value)) if known == light => value,
            _ => {
                let lights = &tracer.scene.lights;
                let value = lights.spectrum(light, wi, &self.lambda);
                if !lights.is_directional(light) {
                    self.emission = Some((light, value));
                }
                value
            }
        }
    }

    /// Adds the emission of a light met by chance along `wi`; `pdf` is its density for light sampling from a lit point.
    #[inline]
    fn meet(&mut self, tracer: &PathTracer, light: u32, wi: Vec3, pdf: impl FnOnce(LitPoint) -> PdfW) {
        let weight = self.last.map_or(1.0, |(at, chosen)| mis::power(chosen, pdf(at)));
        let emission = self.emission(tracer, light, wi);
        self.radiance += self.throughput * emission * (weight * self.heroes.1);
    }

    /// What the path counts for that goes on from `vertex` to `wi`.
    #[inline]
    fn counts_after(&self, vertex: &Vertex, wi: Vec3) -> f32 {
        match vertex.bsdf.parts_colors() {
            true => self.heroes.0.and(vertex.bsdf.part(vertex.wo, wi).heroes).weight(),
            false => self.heroes.1,
        }
    }

    /// Ends paths that carry little, in proportion, once `armed`. False when this one ends.
    #[inline]
    fn roulette(&mut self, armed: bool, u: f32) -> bool {
        let factor = roulette::survivor(self.throughput.max_element() * self.eta2, armed, u);
        factor.map(|factor| self.throughput *= factor).is_some()
    }
}

impl Integrator for PathTracer {
    type Scratch = ();

    fn trace(&self, index: u64, _: &mut (), out: &mut impl SampleSink) {
        let sampler = Sampler::at(index, self.seed);
        let numbers = sampler.camera();
        let UvWindow { min, max } = self.window;
        let uv = [0, 1].map(|i| {
            let (lo, hi) = (f64::from(min[i]), f64::from(max[i]));
            lo + (hi - lo) * numbers.screen[i]
        });
        let value = self.radiance(self.camera.ray(uv, numbers.lens), &sampler, numbers.wavelength);
        out.camera(uv.map(|c| c as f32), value, 1.0);
    }

    fn paths_per_index(&self) -> PathCounts {
        PathCounts { camera: 1, light: 0 }
    }
}
