//! Path tracing from the camera with next-event estimation (Kajiya 1986).
//!
//! # Splitting
//!
//! On the Cornell box the camera ray and the light seen from its first hit take 40 % of a path's time and make 1 % of
//! its noise: what is left of the noise comes from the one direction in which the path goes on. So it goes on in four, at
//! its first vertex that is no delta. With four wavelengths, 256² pixels, 16 paths per pixel, relMSE times processor time
//! relative to that of one branch:
//!
//! | branches | 1 | 2 | 4 | 8 | 16 |
//! |---|---|---|---|---|---|
//! | roulette as without branches | 1 | 0.84 | 0.79 | 0.73 | 0.79 |
//! | roulette from the second segment on | | | 0.69–0.72 | 0.66–0.70 | 0.74 |
//!
//! (After Arvo and Kirk 1990, *Particle Transport and Image Synthesis*, and the efficiency of Bolin and Meyer 1997, *An
//! Error Metric for Monte Carlo Ray Tracing*.) More than four gain little and would make single samples slow.
//!
//! The first pictures consist of single samples: there, many places seen once are worth more than few seen well. So the
//! first paths of the sequence do not split.

use crate::stream::{PathCounts, SampleSink};
use crate::tracer::accel::Ray;
use crate::tracer::bsdf::{Bsdf, BsdfSample, Diffuse, Scattering, Smooth, Unmixed};
use crate::tracer::interaction::SurfaceVertex;
use crate::tracer::record::{PathEvent, Recorded, record};
use crate::tracer::sampler::VertexNumbers;
use crate::tracer::{MaterialClass, Sampler};

use super::direct_lighting::{PathState, Splitting};
use super::{Integrator, RenderContext};

/// Binary logarithm of the number of branches.
const BRANCH_BITS: u32 = 2;

/// So many paths from the beginning of the sequence stay whole: about a hundredth of a second on one core.
const WHOLE_PATHS: u64 = 8192;

/// Traces paths from the camera. Each vertex also samples a light, and both ways of finding a light are combined by
/// multiple importance sampling. The code is compiled for each [`MaterialClass`]: the choice is one branch per path.
#[derive(Clone, Debug)]
pub struct PathTracer {
    /// Scene, view and settings.
    pub context: RenderContext,
}

impl PathTracer {
    /// Follows `path` along `ray` to its end.
    #[inline]
    fn follow<B: Scattering>(&self, path: &mut PathState, mut ray: Ray, sampler: &Sampler) {
        let scene = &self.context.scene;
        while let Some(hit) = path.arrive::<B>(&self.context, &mut ray, true) {
            let vertex = SurfaceVertex::<B>::new(scene, hit, &path.lambda);
            B::record(|| PathEvent::Meets((&*path).into(), hit));
            let u = sampler.vertex(path.depth);
            if !vertex.bsdf.is_delta() {
                if path.splits() {
                    return self.split(path, &vertex, sampler);
                }
                path.add_direct(scene, &vertex, &u);
            }
            let Some(next) = self.scatter(path, &vertex, sampler, &u) else { return };
            ray = next;
        }
        B::record(|| PathEvent::Leaves((&*path).into()));
    }

    /// Goes on from `vertex` in several branches. Of one light a single sample is seldom noisy; of several every branch
    /// chooses its own.
    fn split<B: Scattering>(&self, path: &mut PathState, vertex: &SurfaceVertex<B>, sampler: &Sampler) {
        let scene = &self.context.scene;
        let one_light = scene.lights().len() <= 1;
        if one_light {
            path.add_direct(scene, vertex, &sampler.vertex(path.depth));
        }
        for number in 0..1 << BRANCH_BITS {
            let (mut branch, sampler) = (path.branch(1 << BRANCH_BITS), sampler.branch(number, BRANCH_BITS));
            let u = sampler.vertex(path.depth);
            if !one_light {
                branch.add_direct(scene, vertex, &u);
            }
            if let Some(ray) = self.scatter(&mut branch, vertex, &sampler, &u) {
                self.follow::<B>(&mut branch, ray, &sampler);
            }
            path.radiance += branch.radiance;
        }
    }

    /// Samples the material at `vertex` and returns the ray to go on with.
    #[inline]
    fn scatter<B: Scattering>(
        &self,
        path: &mut PathState,
        vertex: &SurfaceVertex<B>,
        sampler: &Sampler,
        u: &VertexNumbers,
    ) -> Option<Ray> {
        let s = vertex.bsdf.sample(vertex.wo, u.bsdf, u.lobe)?;
        if s.hero_only {
            self.follow_each_wavelength(path, vertex, &s, sampler, u.roulette);
            return None;
        }
        let wi = vertex.frame.to_world(s.wi);
        if !vertex.hit.sides_agree(wi, s.transmitted) {
            return None;
        }
        path.scatter(vertex, &s)?;
        path.roulette(self.context.rr_depth, u.roulette)?;
        B::record(|| PathEvent::Throughput(path.throughput));
        Some(vertex.hit.spawn(wi))
    }

    /// Follows each wavelength to its end where dispersion parts them for good. All use the same random numbers, so that
    /// what they have in common has no colour noise.
    #[cold]
    fn follow_each_wavelength<B: Scattering>(
        &self,
        path: &mut PathState,
        vertex: &SurfaceVertex<B>,
        s: &BsdfSample,
        sampler: &Sampler,
        u: f32,
    ) {
        for lane in 0..4 {
            let Some((wi, eta2)) = vertex.bsdf.refract(vertex.wo, lane) else { continue };
            let wi = vertex.frame.to_world(wi);
            let mut own = path.alone(lane, s, eta2);
            if vertex.hit.sides_agree(wi, true) && own.roulette(self.context.rr_depth, u).is_some() {
                self.follow::<B>(&mut own, vertex.hit.spawn(wi), sampler);
                path.radiance += own.radiance;
            }
        }
    }
}

impl Integrator for PathTracer {
    type Scratch = ();

    fn trace(&self, index: u64, _: &mut (), out: &mut impl SampleSink) {
        let RenderContext { seed, camera, scene, .. } = &self.context;
        let sampler = Sampler::at(index, *seed);
        let numbers = sampler.camera();
        let uv = self.context.place(numbers.screen);
        let lambda = self.context.wavelengths(numbers.wavelength);
        // Where noise is measured there is no picture to begin.
        let whole = index < WHOLE_PATHS && self.context.places.is_none();
        let mut path = PathState::new(lambda, if whole { Splitting::Never } else { Splitting::Pending });
        let ray = camera.ray(uv, numbers.lens);
        match scene.material_class() {
            MaterialClass::Diffuse => self.follow::<Diffuse>(&mut path, ray, &sampler),
            MaterialClass::Specular => self.follow::<Smooth>(&mut path, ray, &sampler),
            MaterialClass::General => self.follow::<Unmixed>(&mut path, ray, &sampler),
            MaterialClass::Mixed => self.follow::<Bsdf>(&mut path, ray, &sampler),
            MaterialClass::Recorded => {
                record(PathEvent::Begins((&path).into()));
                self.follow::<Recorded>(&mut path, ray, &sampler);
            }
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
