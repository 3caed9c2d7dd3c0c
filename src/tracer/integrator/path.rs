//! Path tracing from the camera with next-event estimation (Kajiya 1986).
//!
//! # Splitting
//!
//! At its first vertex that is no delta a path may take several light samples and go on in several branches (Arvo and
//! Kirk 1990, *Particle Transport and Image Synthesis*). The best number of either is proportional to √(variance / cost)
//! (Bolin and Meyer 1997, *An Error Metric for Monte Carlo Ray Tracing*), where the variance of the light samples and of the
//! branches stands against what all of them share: edges and textures within a pixel, and colour. relMSE times processor
//! time relative to one branch and one light sample, 128² pixels, 24 paths per pixel:
//!
//! | branches / light samples | 1 / 1 | 1 / 2 | 2 / 1 | 2 / 2 | 4 / 1 | 4 / 4 | 8 / 1 |
//! |---|---|---|---|---|---|---|---|
//! | Cornell box | 1 | | .89 | .95 | .90 | .99 | 1.03 |
//! | landscape, constant sky and a lamp | 1 | 1.16 | 1.14 | | 1.56 | | 2.5 |
//! | landscape, sky and sun | 1 | .77 | | .85 | 1.5 | 1.1 | |
//! | landscape, sky and a lamp | 1 | .93 | | | 1.9 | 1.4 | |
//! | Veach's plates | 1 | .97 | 1.15 | .98 | 1.9 | 1.45 | 3.2 |
//!
//! Indirect light, which is what branches look for, is a large part of the noise where surfaces are bright, and on dark ones it
//! is small. The light sample is noisy where it chooses among several lights or among the directions of an environment.
//! Hence the rule of [`Splits`]: two branches on bright diffuse surfaces and on glossy ones, whose branches find lights as well, else
//! one; two light samples where there is such a choice, else one.
//!
//! Roulette may end branches from the second segment on (`tracer/roulette.rs`), whether or not there are several.
//!
//! The first pictures consist of single samples: there, many places seen once are worth more than few seen well. So the
//! first paths of the sequence do not split.

use crate::spectrum::SampledSpectrum;
use crate::stream::{PathCounts, SampleSink};
use crate::tracer::accel::Ray;
use crate::tracer::bsdf::{Bsdf, CreditedBsdf, Diffuse, InMedia, Recorded, Scattering, Smooth, Unmixed};
use crate::tracer::interaction::SurfaceInteraction;
use crate::tracer::light_groups::LightCredits;
use crate::tracer::medium::{FreeFlight, PathMedia};
use crate::tracer::output::send_camera;
use crate::tracer::record::PathEvent;
use crate::tracer::sampler::VertexNumbers;
use crate::tracer::vertex::SurfaceVertex;
use crate::tracer::walk::Walk;
use crate::tracer::{MaterialClass, Sampler, Scene, TracingMode};

use super::direct_lighting::{PathState, Splitting, TakenEmission};
use super::lit_flight::LitFlight;
use super::pair::{CameraPlace, ForEyes, SamplePair};
use super::{Integrator, RenderContext};

/// From this albedo on, at one of the wavelengths of the path, a diffuse surface is bright enough for two branches. It is no round
/// number, so that rounding decides for no surface.
const BRIGHT: f32 = 0.437;

/// So many paths from the beginning of the sequence stay whole: about a hundredth of a second on one core.
const WHOLE_PATHS: u64 = 8192;

/// How a path splits at a vertex.
#[derive(Clone, Copy, Debug)]
struct Splits {
    /// Binary logarithm of the number of branches.
    branches: u32,
    /// Binary logarithm of the number of light samples.
    lights: u32,
}

impl Splits {
    /// The path stays whole.
    const NONE: Self = Self { branches: 0, lights: 0 };

    /// This split, and each of its parts once more into `1 << more`.
    #[inline]
    fn and(self, more: u32) -> Self {
        Self { branches: self.branches + more, lights: self.lights + more }
    }

    /// The split at `vertex`. It depends on the material and the lights alone, so that no estimate is biased by it.
    #[inline]
    fn at<B: Scattering>(scene: &Scene, vertex: &SurfaceVertex<B>) -> Self {
        let bright = match vertex.bsdf.as_diffuse() {
            Some(diffuse) => diffuse.albedo.max_element() >= BRIGHT,
            None => vertex.bsdf.is_glossy(),
        };
        Self { branches: u32::from(bright), lights: u32::from(!scene.lights().is_single_surface()) }
    }
}

/// Traces paths from the camera. Each vertex also samples a light, and both ways of finding a light are combined by
/// multiple importance sampling. The code is compiled for each [`MaterialClass`] and [`TracingMode`]: the choice is
/// one branch per path.
#[derive(Clone, Debug)]
pub struct PathTracer {
    /// Scene, view and settings.
    pub context: RenderContext,
}

impl PathTracer {
    /// Each class of materials has a function of its own, whose stack holds nothing of the others.
    #[inline(never)]
    fn trace_as<B: Scattering>(&self, index: u64, out: &mut impl SampleSink) {
        let RenderContext { camera, scene, .. } = &self.context;
        let start = self.context.screen.start(index);
        let sampler = self.context.sampler(start.index);
        let numbers = sampler.camera();
        let uv = self.context.place(numbers.screen);
        let lambda = self.context.wavelengths(numbers.wavelength);
        // Where noise is measured there is no picture to begin.
        let whole = index < WHOLE_PATHS && self.context.places.is_none();
        let splitting = if whole { Splitting::Never } else { Splitting::Pending };
        let mut path = PathState::<B::Credits>::new(lambda, splitting, self.context.medium);
        B::record(|| PathEvent::Begins((&path.walk).into()));
        if let Some(ray) = camera.ray(uv, numbers.lens) {
            if let Some(other) = self.context.partner() {
                let pair =
                    self.follow_pair::<B>(other, path, ray, CameraPlace { uv, lens: numbers.lens }, &sampler);
                return pair.send(start.weight, out);
            }
            self.follow::<B>(&mut path, ray, &sampler);
        }
        B::record(|| PathEvent::Estimate { lambda, radiance: path.radiance });
        path.credits.settle(&lambda);
        let value = lambda.to_xyz(path.radiance);
        send_camera(out, scene.lights(), uv, value, start.weight, &path.credits);
    }

    /// Follows `path` along `ray` to its end.
    #[inline]
    fn follow<B: Scattering>(&self, path: &mut PathState<B::Credits>, mut ray: Ray, sampler: &Sampler) {
        let scene = &self.context.scene;
        while let (Some(hit), lit) = self.fly::<B>(path, &mut ray, sampler) {
            let vertex = SurfaceVertex::<B>::new(scene, hit, &path.walk.lambda, path.walk.medium);
            B::record(|| PathEvent::Meets((&path.walk).into(), hit));
            let Some(next) = self.meet(path, &vertex, sampler, lit.as_ref()) else { return };
            ray = next;
        }
        B::record(|| PathEvent::Leaves((&path.walk).into()));
    }

    /// Adds direct light at `vertex`, to which `flight` led, and returns the ray to go on with, unless the path ends there or goes on in branches.
    #[inline(always)]
    fn meet<B: Scattering>(
        &self,
        path: &mut PathState<B::Credits>,
        vertex: &SurfaceVertex<B>,
        sampler: &Sampler,
        flight: Option<&LitFlight>,
    ) -> Option<Ray> {
        let u = sampler.vertex(path.walk.depth - 1);
        if !vertex.bsdf.is_delta() {
            if path.splits() {
                self.split(path, vertex, sampler, flight);
                return None;
            }
            path.add_direct(&self.context.scene, vertex, &u, flight);
        }
        self.scatter(path, vertex, sampler, &u)
    }

    /// Follows the path of one eye through `uv` to its end. It is one of the `other` eye, too, if that sees its first vertex.
    #[inline(never)]
    fn follow_pair<B: Scattering>(
        &self,
        other: &RenderContext,
        mut path: PathState<B::Credits>,
        mut ray: Ray,
        CameraPlace { uv, lens }: CameraPlace,
        sampler: &Sampler,
    ) -> SamplePair {
        let scene = &self.context.scene;
        let lambda = path.walk.lambda;
        let (Some(hit), lit) = self.fly::<B>(&mut path, &mut ray, sampler) else {
            return SamplePair::alone(uv, lambda.to_xyz(path.radiance));
        };
        let vertex = SurfaceVertex::<B>::new(scene, hit, &path.walk.lambda, path.walk.medium);
        let Some(shared) = self.context.share(other, &vertex, lens) else {
            path.double_branches();
            if let Some(ray) = self.meet(&mut path, &vertex, sampler, lit.as_ref()) {
                self.follow::<B>(&mut path, ray, sampler);
            }
            return SamplePair::alone(uv, lambda.to_xyz(path.radiance));
        };
        // What was found on the way to the vertex is not shared.
        let before = path.radiance * (1.0 / shared.weights.own);
        path.radiance = SampledSpectrum::ZERO;
        let splits = if path.splits() { Splits::at(scene, &vertex) } else { Splits::NONE };
        let (mut own, mut seen_by_other) = (before, SampledSpectrum::ZERO);
        for number in 0..1 << splits.lights {
            let mut lit = path.branch(1 << splits.lights);
            let u = sampler.branch(number, splits.lights).vertex(0);
            seen_by_other += lit.add_shared_direct(&self.context, &vertex, &shared, &u);
            own += lit.radiance;
        }
        for number in 0..1 << splits.branches {
            let mut branch = path.branch(1 << splits.branches);
            let sampler = sampler.branch(number, splits.branches);
            let u = sampler.vertex(0);
            let Some(s) = Walk::<false>::sample(&vertex, &u) else { continue };
            // Deltas are seen by one eye alone.
            let throughput = branch.walk.throughput;
            branch.walk.throughput *= 1.0 / shared.weights.own;
            branch.add_light_behind_deltas(&self.context, &vertex, &s);
            own += branch.radiance;
            branch.radiance = SampledSpectrum::ZERO;
            let (s, shares) = match s.delta {
                true => (s, ForEyes::OWN),
                false => {
                    branch.walk.throughput = throughput;
                    let Some(of_both) = shared.share_sample(&vertex, &s) else { continue };
                    of_both
                }
            };
            if let Some(wi) = branch.scatter(&vertex, &s)
                && branch.roulette(self.context.rr_depth, u.roulette).is_some()
            {
                self.follow::<B>(&mut branch, vertex.hit.spawn(wi), &sampler);
                own += branch.radiance * shares.own;
                seen_by_other += branch.radiance * shares.other;
            }
        }
        let seen = ForEyes { own, other: seen_by_other };
        SamplePair::shared(uv, &shared, seen.map(|radiance| lambda.to_xyz(radiance)))
    }

    /// Flies along `ray` to the next vertex and returns it with the flight that is [lit](LitFlight) and ends there, if it is. The light of point
    /// lights along that is added.
    #[inline(always)]
    fn fly<B: Scattering>(
        &self,
        path: &mut PathState<B::Credits>,
        ray: &mut Ray,
        sampler: &Sampler,
    ) -> (Option<SurfaceInteraction>, Option<LitFlight>) {
        let RenderContext { scene, .. } = &self.context;
        let depth = path.walk.depth;
        let flight = FreeFlight::of::<B>(scene, || sampler.flight(depth));
        if !B::Media::PRESENT || scene.lights().points().is_none() || depth + 1 >= self.context.longest() {
            let hit = path.arrive::<B>(&self.context, ray, flight, TakenEmission::All, |_, _| ());
            return (hit, None);
        }
        let (mut before, mut first) = (path.walk, None);
        let hit = path.arrive::<B>(&self.context, ray, flight.whole(), TakenEmission::All, |walk, piece| {
            first = first.or_else(|| LitFlight::new(scene, before, piece));
            before = *walk;
        });
        let Some(lit) = first else { return (hit, None) };
        lit.add_direct::<B>(scene, path, sampler.along_flight(depth));
        (hit, Some(lit).filter(LitFlight::scatters))
    }

    /// Takes the light samples of `vertex` and goes on from there in branches.
    fn split<B: Scattering>(
        &self,
        path: &mut PathState<B::Credits>,
        vertex: &SurfaceVertex<B>,
        sampler: &Sampler,
        flight: Option<&LitFlight>,
    ) {
        let scene = &self.context.scene;
        let splits = Splits::at(scene, vertex).and(path.more_branches());
        let mut lit = path.branch(1 << splits.lights);
        for number in 0..1 << splits.lights {
            let u = sampler.branch(number, splits.lights).vertex(path.walk.depth - 1);
            lit.add_direct(scene, vertex, &u, flight);
        }
        path.join(&lit);
        for number in 0..1 << splits.branches {
            let mut branch = path.branch(1 << splits.branches);
            let sampler = sampler.branch(number, splits.branches);
            let u = sampler.vertex(path.walk.depth - 1);
            if let Some(ray) = self.scatter(&mut branch, vertex, &sampler, &u) {
                self.follow::<B>(&mut branch, ray, &sampler);
            }
            path.join(&branch);
        }
    }

    /// Samples the material at `vertex` and returns the ray to go on with.
    #[inline]
    fn scatter<B: Scattering>(
        &self,
        path: &mut PathState<B::Credits>,
        vertex: &SurfaceVertex<B>,
        sampler: &Sampler,
        u: &VertexNumbers,
    ) -> Option<Ray> {
        let s = Walk::<false>::sample(vertex, u)?;
        path.add_light_behind_deltas(&self.context, vertex, &s);
        if s.hero_only {
            // Only the weight, so that the compiler keeps the sample in registers.
            self.follow_each_wavelength(path, vertex, s.weight, sampler, u.roulette);
            return None;
        }
        let wi = path.scatter(vertex, &s)?;
        path.roulette(self.context.rr_depth, u.roulette)?;
        B::record(|| PathEvent::Throughput(path.walk.throughput));
        Some(vertex.hit.spawn(wi))
    }

    /// Follows each wavelength to its end after the dispersive delta of this weight. All use the same random numbers, so that
    /// what they have in common has no colour noise.
    #[cold]
    fn follow_each_wavelength<B: Scattering>(
        &self,
        path: &mut PathState<B::Credits>,
        vertex: &SurfaceVertex<B>,
        weight: SampledSpectrum,
        sampler: &Sampler,
        u: f32,
    ) {
        for (walk, s) in { path.walk }.split_wavelengths(vertex, weight) {
            let mut own = path.alone(walk);
            if let Some(wi) = own.scatter(vertex, &s)
                && own.roulette(self.context.rr_depth, u).is_some()
            {
                self.follow::<B>(&mut own, vertex.hit.spawn(wi), sampler);
                path.join(&own);
            }
        }
    }
}

impl Integrator for PathTracer {
    type Scratch = ();

    fn trace(&self, index: u64, _: &mut (), out: &mut impl SampleSink) {
        let scene = &self.context.scene;
        match (scene.tracing_mode(), scene.material_class()) {
            (TracingMode::Plain, MaterialClass::Diffuse) => self.trace_as::<Diffuse>(index, out),
            (TracingMode::Plain, MaterialClass::Specular) => self.trace_as::<Smooth>(index, out),
            (TracingMode::Plain, MaterialClass::General) => self.trace_as::<Unmixed>(index, out),
            (TracingMode::Plain, MaterialClass::Mixed) => self.trace_as::<Bsdf>(index, out),
            (TracingMode::Plain, MaterialClass::InMedia) => self.trace_as::<InMedia>(index, out),
            (TracingMode::Record, _) => self.trace_as::<Recorded>(index, out),
            (TracingMode::LightGroups, _) => self.trace_as::<CreditedBsdf>(index, out),
        }
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
