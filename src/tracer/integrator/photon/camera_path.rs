//! A camera path of photon mapping: emission and next-event estimation as in path tracing, and density estimation from the photons around
//! its vertices on surfaces, and around its flights in media.

use glam::{Vec3, Vec4};

use crate::color::Xyz;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::stream::{FaultyValue, MAX_VALUE, faults};
use crate::tracer::accel::Ray;
use crate::tracer::bsdf::Scattering;
use crate::tracer::integrator::RenderContext;
use crate::tracer::integrator::direct_lighting::{PathState, Splitting, TakenEmission};
use crate::tracer::integrator::pair::{FirstVertex, ForEyes};
use crate::tracer::integrator::prefix::Prefix;
use crate::tracer::interaction::SurfaceInteraction;
use crate::tracer::light_groups::LightCredits;
use crate::tracer::medium::{FlightPiece, FreeFlight, Media, PathMedia};
use crate::tracer::photon_map::{Disc, Lookup, Photon, PhotonLayer, Snapshot};
use crate::tracer::record::PathEvent;
use crate::tracer::sampler::VertexNumbers;
use crate::tracer::scene::SurfaceMaterial;
use crate::tracer::specular_chain::SpecularChain;
use crate::tracer::vertex::SurfaceVertex;
use crate::tracer::walk::Walk;
use crate::tracer::wavelength_mis::WavelengthMis;
use crate::tracer::{Sampler, Scene};

use super::recorded_step::RecordedStep;
use super::tracer::{PhotonScratch, PhotonTracer};

/// A path whose wavelength MIS weight exceeds this goes on with the hero alone: 1 is no dispersion, 4 is complete.
const DISPERSED: f32 = 2.0;

/// Photons of a lookup in the caustic layer, which is seen directly, over those of one in the global layer.
const CAUSTIC: usize = 2;

/// Photons count whose normal has at least this cosine to that of the vertex.
const SAME_SURFACE: f32 = 0.7;

/// Least radius of a disc over the largest: where many photons lie in one point the estimate stays finite.
const SMALLEST: f32 = 1e-4;

/// Half of the first window of wavelengths, nm.
pub(super) const WINDOW: f32 = 30.0;

/// The kinds of scattering so far, which decide whether emission that is hit next counts or is left to photons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PathClass {
    /// Mirrored only: lights that are hit and lights that are sampled both count.
    Mirrored,
    /// Spread last: likewise.
    Spread,
    /// Spread, then mirrored: a light found from here is a caustic, which the photons show.
    Caustic,
}

/// The arguments of a camera path.
#[derive(Clone, Copy)]
pub(super) struct PathStart<'a> {
    pub(super) tracer: &'a PhotonTracer,
    /// The photons that it sees.
    pub(super) snapshot: &'a Snapshot,
    pub(super) lookup: Lookup,
    /// Chooses its wavelengths, in [0, 1).
    pub(super) wavelength: f32,
}

/// A camera path on its way.
pub(super) struct CameraPath<'a, C> {
    pub(super) tracer: &'a PhotonTracer,
    pub(super) snapshot: &'a Snapshot,
    pub(super) lookup: Lookup,
    pub(super) scratch: &'a mut PhotonScratch,
    pub(super) state: PathState<C>,
    /// Contribution of photons, and of all that was found before the secondary wavelengths were terminated.
    pub(super) xyz: Xyz,
    class: PathClass,
    /// Photons account for all further light except emission hit by the next ray, and that of media.
    gathered: bool,
    /// Only the emission of media is still to be found.
    only_media: bool,
    /// The wavelengths that would have chosen the flights through media.
    pub(super) flights: WavelengthMis,
    /// The other of two eyes, and the numbers of the lens, until the path comes to its first vertex.
    pub(super) other_eye: Option<(&'a RenderContext, [f32; 2])>,
    /// Which eyes see the first vertex.
    pub(super) first: FirstVertex,
    /// As `xyz`, for the other eye where both share the first vertex.
    pub(super) xyz_of_other: Xyz,
}

impl<'a> PathStart<'a> {
    /// The path at the camera.
    pub fn begin<C: LightCredits>(self, scratch: &'a mut PhotonScratch) -> CameraPath<'a, C> {
        let Self { tracer, snapshot, lookup, wavelength } = self;
        scratch.steps.clear();
        scratch.gathered = 0.0;
        let state =
            PathState::new(tracer.context.wavelengths(wavelength), Splitting::Never, tracer.context.medium);
        let (xyz, class) = (Xyz::BLACK, PathClass::Mirrored);
        let chromatic_grids = tracer.context.scene.media().is_some_and(Media::has_chromatic_grids);
        let mut path = CameraPath {
            tracer,
            snapshot,
            lookup,
            scratch,
            state,
            xyz,
            class,
            gathered: false,
            only_media: false,
            flights: WavelengthMis::ALL,
            other_eye: None,
            first: FirstVertex::OfOne,
            xyz_of_other: Xyz::BLACK,
        };
        // Where photons are gathered along a flight, it has the same extinction for all wavelengths that the path carries.
        if chromatic_grids {
            path.drop_companions();
        }
        path
    }
}

impl<C: LightCredits> CameraPath<'_, C> {
    /// Follows the path along `ray` to its end and returns what it found, in all and by groups of lights.
    pub fn trace<B: Scattering<Credits = C>>(mut self, ray: Ray, sampler: &Sampler) -> (Xyz, C) {
        self.follow::<B>(ray, sampler);
        self.end()
    }

    /// Follows the path along `ray` to its end.
    #[inline]
    pub(super) fn follow<B: Scattering<Credits = C>>(&mut self, mut ray: Ray, sampler: &Sampler) {
        let mut from = ray.origin;
        let media_shine = self.tracer.context.scene.media().is_some_and(Media::shine);
        loop {
            let flight = self.flight_start();
            let hit = self.arrive::<B>(&mut ray, sampler, self.taken());
            if self.gathered && !media_shine {
                break;
            }
            self.only_media |= self.gathered;
            let mut beam_radius = 0.0;
            if B::Media::PRESENT {
                if !self.only_media {
                    self.gather_along::<B>(&flight, PhotonLayer::VolumeCaustic, from);
                    if self.class != PathClass::Mirrored {
                        self.gather_along::<B>(&flight, PhotonLayer::VolumeGlobal, from);
                        beam_radius = self.beam_radius();
                    }
                }
                self.drop_parted_companions();
            }
            let Some(hit) = hit else { break };
            // The last ray was too short for the photons at its end to stand for what it saw.
            let radius = if hit.is_in_medium() { beam_radius } else { self.reach(PhotonLayer::Global).1 };
            let near = from.distance_squared(hit.point.p) < radius * radius;
            let Some(next) = self.shade::<B>(hit, near, &sampler.vertex(self.state.walk.depth - 1)) else {
                break;
            };
            (ray, from) = (next, next.origin);
        }
    }

    /// The emission that photons do not account for.
    fn taken(&self) -> TakenEmission {
        match self.only_media || self.class == PathClass::Caustic {
            true => TakenEmission::OfMedia,
            false => TakenEmission::All,
        }
    }

    /// Follows the path along `ray` while its light can be found by merging only, and returns the contribution of photons, in all and by groups
    /// of lights.
    pub fn merge<B: Scattering<Credits = C>>(mut self, mut ray: Ray, sampler: &Sampler) -> (Xyz, C) {
        let context = &self.tracer.context;
        let mut prefix = Prefix::CAMERA;
        // The camera subpath adds lights behind chains of deltas.
        self.state.chain = SpecularChain::PathAlone;
        loop {
            let (flight, from) = (self.flight_start(), ray.origin);
            let hit = self.arrive::<B>(&mut ray, sampler, TakenEmission::Nothing);
            if B::Media::PRESENT {
                if prefix.is_specular() {
                    self.gather_along::<B>(&flight, PhotonLayer::VolumeCaustic, from);
                }
                self.drop_parted_companions();
            }
            let Some(hit) = hit else { break };
            let vertex =
                SurfaceVertex::<B>::new(&context.scene, hit, &self.state.walk.lambda, self.state.walk.medium);
            let diffuse = self.tracer.photon_paths.spread_at(&vertex);
            if diffuse && prefix.is_specular() && !hit.is_in_medium() {
                self.gather(&vertex, PhotonLayer::Caustic);
            }
            let u = sampler.vertex(self.state.walk.depth - 1);
            let Some(next) = self.scatter(&vertex, diffuse, &u) else { break };
            let delta = self.scratch.steps.last().is_some_and(RecordedStep::is_delta);
            prefix = prefix.then(delta, diffuse);
            if prefix == Prefix::Connectable {
                break;
            }
            ray = next;
        }
        self.end()
    }

    /// Caustics on the first surface along `ray`, by its photons.
    pub fn seen<B: Scattering<Credits = C>>(mut self, mut ray: Ray, sampler: &Sampler) -> Xyz {
        let context = &self.tracer.context;
        let (flight, from) = (self.flight_start(), ray.origin);
        let hit = self.arrive::<B>(&mut ray, sampler, TakenEmission::Nothing);
        if B::Media::PRESENT {
            self.gather_along::<B>(&flight, PhotonLayer::VolumeCaustic, from);
            self.drop_parted_companions();
        }
        if let Some(hit) = hit {
            let vertex =
                SurfaceVertex::<B>::new(&context.scene, hit, &self.state.walk.lambda, self.state.walk.medium);
            if vertex.bsdf.has_diffuse_part() && !hit.is_in_medium() {
                self.gather(&vertex, PhotonLayer::Caustic);
            }
        }
        self.end().0
    }

    /// The next vertex on `ray`, as [`PathState::arrive`] finds it.
    #[inline(always)]
    fn arrive<B: Scattering<Credits = C>>(
        &mut self,
        ray: &mut Ray,
        sampler: &Sampler,
        takes: TakenEmission,
    ) -> Option<SurfaceInteraction> {
        let Self { tracer, state, scratch, flights, .. } = self;
        let record = |_: &_, piece: FlightPiece| {
            *flights = piece.and(*flights);
            scratch.steps.push(RecordedStep::Flight(piece));
        };
        let flight = FreeFlight::of::<B>(&tracer.context.scene, || sampler.flight(state.walk.depth));
        state.arrive::<B>(&tracer.context, ray, flight, takes, record)
    }

    /// Goes on with the hero alone where a flight has parted the wavelengths.
    fn drop_parted_companions(&mut self) {
        if !self.state.walk.lambda.is_hero_only() && self.is_dispersed() {
            self.drop_companions();
        }
    }

    /// True where photons at the secondary wavelengths would be evaluated along a path that these hardly take. It is the same for every hero.
    fn is_dispersed(&self) -> bool {
        self.state.walk.wavelength_mis.weight() > DISPERSED
    }

    /// Goes on with the hero alone.
    #[cold]
    fn drop_companions(&mut self) {
        let ForEyes { own, other } = self.first.seen(self.state.radiance, &self.state.walk.lambda);
        (self.xyz, self.xyz_of_other) = (self.xyz + own, self.xyz_of_other + other);
        if let FirstVertex::Shared(path) = &mut self.first {
            path.found = ForEyes::NOTHING;
        }
        self.state.drop_companions();
    }

    /// The colour of the path, in all and by groups of lights.
    fn end(mut self) -> (Xyz, C) {
        self.state.credits.settle(&self.state.walk.lambda);
        (self.xyz + self.state.walk.lambda.to_xyz(self.state.radiance), self.state.credits)
    }

    /// Samples a light, gathers photons (global ones unless `near`) and chooses the ray to go on with.
    fn shade<B: Scattering>(
        &mut self,
        hit: SurfaceInteraction,
        near: bool,
        u: &VertexNumbers,
    ) -> Option<Ray> {
        let scene = &self.tracer.context.scene;
        let vertex = SurfaceVertex::<B>::new(scene, hit, &self.state.walk.lambda, self.state.walk.medium);
        B::record(|| PathEvent::Meets((&self.state.walk).into(), hit));
        let diffuse = self.tracer.photon_paths.spread_at(&vertex);
        if let Some((other, lens)) = self.other_eye.take() {
            self.meet_first(other, &vertex, lens);
        }
        if self.only_media {
            return self.scatter(&vertex, diffuse, u);
        }
        let samples_light = diffuse || self.class == PathClass::Mirrored && !vertex.bsdf.is_delta();
        if samples_light && !self.add_shared_direct(&vertex, u) {
            self.state.add_direct(scene, &vertex, u, None);
        }
        if diffuse {
            // Photons in a medium were gathered along the flight.
            let on_surface = !hit.is_in_medium();
            if on_surface {
                self.gather(&vertex, PhotonLayer::Caustic);
            }
            if self.class != PathClass::Mirrored && !near {
                if on_surface {
                    self.gather(&vertex, PhotonLayer::Global);
                }
                self.gathered = true;
            }
        }
        self.scatter(&vertex, diffuse, u)
    }

    fn scatter<B: Scattering>(
        &mut self,
        vertex: &SurfaceVertex<B>,
        diffuse: bool,
        u: &VertexNumbers,
    ) -> Option<Ray> {
        let s = Walk::<false>::sample(vertex, u)?;
        if !self.only_media {
            self.state.add_light_behind_deltas(&self.tracer.context, vertex, &s);
        }
        let s = self.go_on(vertex, &s)?;
        let wi = self.state.scatter(vertex, &s)?;
        if s.hero_only || s.transmitted && vertex.bsdf.is_dispersive() && self.is_dispersed() {
            self.drop_companions();
        }
        let spread = diffuse && !s.delta;
        self.class = match self.class {
            _ if spread => PathClass::Spread,
            PathClass::Mirrored => PathClass::Mirrored,
            PathClass::Spread | PathClass::Caustic => PathClass::Caustic,
        };
        // The coat's mirror was not in what the photons contributed.
        self.gathered &= spread;
        let factor = self.state.roulette(self.tracer.context.rr_depth, u.roulette)?;
        B::record(|| PathEvent::Throughput(self.state.walk.throughput));
        let factor = factor * self.factor_alone(&s);
        let step = RecordedStep::new(&self.tracer.context.scene, vertex, &s, u.lobe, factor);
        self.scratch.steps.push(step);
        Some(vertex.hit.spawn(wi))
    }

    /// Adds the density estimate from the photons of `layer` around `vertex`.
    fn gather<B: Scattering>(&mut self, vertex: &SurfaceVertex<B>, layer: PhotonLayer) {
        let forest = self.snapshot.layer(layer);
        if forest.is_empty() {
            return;
        }
        let (wanted, radius, window) = self.reach(layer);
        let normal = vertex.hit.facing_normal();
        // Photons on the other side count where the surface transmits.
        let through = vertex.bsdf.transmits();
        // The last segment leads here.
        let segments = self.tracer.context.longest() - self.state.walk.depth;
        let hero = self.state.walk.lambda.lambda().x;
        let accept = |photon: &Photon| {
            photon.depth() <= segments
                && (photon.normal().dot(normal) > SAME_SURFACE
                    || through && photon.normal().dot(normal) < -SAME_SURFACE)
                && window.is_none_or(|w| lanes_near(photon, hero, w) > 0.0)
        };
        let throughput = self.state.walk.throughput * self.state.wavelength_weight;
        let other_eye = self.other_eye_at_first();
        let Self { scratch, tracer, state, snapshot, flights, .. } = self;
        let found = forest.nearest(vertex.hit.point.p, radius, wanted, &mut scratch.query, accept);
        let Some(disc) = Disc::new(found, wanted, radius, radius * SMALLEST) else { return };
        let scale = 1.0 / disc.area / snapshot.light_paths as f32;
        let scene = &tracer.context.scene;
        let path = RecordedPath {
            scene,
            steps: &scratch.steps,
            surface: scene.surface_material(&vertex.hit),
            white: tracer.context.white(),
        };
        let (mut xyz, mut xyz_of_other, mut value) = (Xyz::BLACK, Xyz::BLACK, SampledSpectrum::ZERO);
        let mut kish = KishSums::default();
        for near in disc.counted {
            let photon = forest.photon(near);
            match window {
                None => {
                    let scale = scale * flights.weight();
                    let found = match other_eye {
                        None => path.at_wavelengths_of(photon, vertex, scale),
                        Some(wo) => {
                            let ForEyes { own, other } = path.seen_by_both(photon, vertex, wo, scale);
                            xyz_of_other += other;
                            own
                        }
                    };
                    xyz += found;
                    kish.add(found.y);
                    state.credits.add_color(photon.group(), found);
                }
                Some(w) => {
                    let flux = lanes_near(photon, hero, w) * scale;
                    let found = at_the_hero(photon, vertex, throughput * flux);
                    value += found;
                    kish.add(found.0.x);
                    state.credits.add_to(photon.group(), found);
                }
            }
        }
        self.xyz += xyz;
        self.xyz_of_other += xyz_of_other;
        self.state.radiance += value;
        scratch.gathered += kish.effective_number();
        B::record(|| PathEvent::Gathered { photons: disc.counted.len(), area: disc.area, xyz: self.xyz });
    }

    /// How many photons a lookup asks for, within which radius, and within which distance (nm) of the hero if the path
    /// carries that alone.
    pub(super) fn reach(&self, layer: PhotonLayer) -> (usize, f32, Option<f32>) {
        let more = if layer == PhotonLayer::Caustic { CAUSTIC } else { 1 };
        let wanted = self.lookup.neighbours * more;
        if !self.state.walk.lambda.is_hero_only() {
            return (wanted, self.lookup.radius, None);
        }
        // Blur over place and over wavelength shrink together; disc times window holds as many photons as before.
        let shrink = shrink(&self.lookup);
        (wanted, self.tracer.schedule.radius * shrink, Some(WINDOW * shrink))
    }
}

/// What the two radii of a path that carries the hero alone, and its window of wavelengths, are multiplied by.
pub(super) fn shrink(lookup: &Lookup) -> f32 {
    1.0 / (lookup.generations.max(1) as f32).cbrt()
}

/// Sums of single contributions and of their squares: luminances, or values at the hero alone.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct KishSums {
    sum: f32,
    squares: f32,
}

impl KishSums {
    #[inline]
    pub(super) fn add(&mut self, y: f32) {
        (self.sum, self.squares) = (self.sum + y, self.squares + y * y);
    }

    /// (Σ x)² / Σ x² (Kish 1965).
    pub(super) fn effective_number(&self) -> f32 {
        if self.squares > 0.0 { self.sum * self.sum / self.squares } else { 0.0 }
    }
}

/// A path to be evaluated again at the wavelengths of photons.
struct RecordedPath<'a> {
    scene: &'a Scene,
    steps: &'a [RecordedStep],
    /// The material where the photons are.
    surface: SurfaceMaterial<'a>,
    /// The wavelengths of every photon, where nothing has a colour.
    white: Option<SampledWavelengths>,
}

impl RecordedPath<'_> {
    /// Contribution of a photon, with throughput and material evaluated at the photon's wavelengths.
    #[inline]
    fn at_wavelengths_of<B: Scattering>(
        &self,
        photon: &Photon,
        vertex: &SurfaceVertex<B>,
        scale: f32,
    ) -> Xyz {
        let lambda = self.white.unwrap_or_else(|| photon.wavelengths());
        let bsdf = self.surface.bsdf::<B>(&lambda);
        let Some(f) = scattered(vertex, vertex.wo, &bsdf, photon.direction()) else { return Xyz::BLACK };
        let weight = |t: SampledSpectrum, s: &RecordedStep| t * s.weight::<B>(self.scene, &lambda);
        let throughput = self.steps.iter().fold(SampledSpectrum::ONE, weight);
        let value = photon.flux() * f * throughput * scale;
        lambda.to_xyz(sound(value, vertex.hit.known_surface()))
    }

    /// As [`at_wavelengths_of`](Self::at_wavelengths_of), for both eyes, of which the other is seen from the first vertex in the direction `wo`
    /// of the shading frame. They differ in that direction alone, so that all materials are made once for both.
    #[inline(never)]
    fn seen_by_both<B: Scattering>(
        &self,
        photon: &Photon,
        vertex: &SurfaceVertex<B>,
        wo: Vec3,
        scale: f32,
    ) -> ForEyes<Xyz> {
        let lambda = self.white.unwrap_or_else(|| photon.wavelengths());
        let bsdf = self.surface.bsdf::<B>(&lambda);
        let scattered_to = |wo| {
            let f = scattered(vertex, wo, &bsdf, photon.direction());
            f.map_or(SampledSpectrum::ZERO, |f| photon.flux() * f * scale)
        };
        let values = match self.steps.split_first() {
            None => ForEyes { own: vertex.wo, other: wo }.map(scattered_to),
            Some((first, behind)) => {
                let weight = |t: SampledSpectrum, s: &RecordedStep| t * s.weight::<B>(self.scene, &lambda);
                let value = behind.iter().fold(scattered_to(vertex.wo), weight);
                first.weights_for_eyes::<B>(self.scene, &lambda, wo).map(|weight| value * weight)
            }
        };
        let to_xyz = |value| lambda.to_xyz(sound(value, vertex.hit.known_surface()));
        let own = to_xyz(values.own);
        // What is diffuse looks the same to both.
        let other = if values.other == values.own { own } else { to_xyz(values.other) };
        ForEyes { own, other }
    }
}

/// Contribution of a photon to a path that carries its hero wavelength only; `throughput` includes the flux there.
#[inline]
fn at_the_hero<B: Scattering>(
    photon: &Photon,
    vertex: &SurfaceVertex<B>,
    throughput: SampledSpectrum,
) -> SampledSpectrum {
    let f = scattered(vertex, vertex.wo, &vertex.bsdf, photon.direction());
    sound(f.map_or(SampledSpectrum::ZERO, |f| throughput * f), vertex.hit.known_surface())
}

/// `value`, the contribution of a photon on a surface or in a medium, or zero if it is not finite, which is a fault.
#[inline]
pub(super) fn sound(value: SampledSpectrum, surface: Option<u32>) -> SampledSpectrum {
    if value.is_within(MAX_VALUE) {
        return value;
    }
    faults::raise(FaultyValue::Gathering, value.into(), surface, None);
    SampledSpectrum::ZERO
}

/// f·|cos θₛ| / |cos θ| from the world-space direction `wi` into the path, in the direction `wo` of the shading frame: flux is measured with the
/// geometric cosine.
#[inline]
fn scattered<B: Scattering>(
    vertex: &SurfaceVertex<B>,
    wo: Vec3,
    bsdf: &B,
    wi: Vec3,
) -> Option<SampledSpectrum> {
    let local = vertex.frame.to_local(wi);
    if !vertex.hit.sides_agree(wi, wo.z * local.z < 0.0) {
        return None;
    }
    let (f, _) = bsdf.eval(wo, local)?;
    let cos = if vertex.hit.smooth { wi.dot(vertex.hit.point.ng).abs() } else { local.z.abs() };
    Some(f * (1.0 / cos))
}

/// The photon's flux per nm at `hero`, estimated from its lanes nearer than `window` nm (Epanechnikov's kernel).
#[inline]
pub(super) fn lanes_near(photon: &Photon, hero: f32, window: f32) -> f32 {
    let lambda = photon.wavelengths();
    let pdf = lambda.pdf();
    let x = (lambda.lambda() - hero) / window;
    let kernel = (1.0 - x * x).max(Vec4::ZERO) * (0.75 / window);
    let carried = pdf.cmpgt(Vec4::ZERO);
    Vec4::select(carried, photon.flux().0 * kernel * 0.25 / pdf, Vec4::ZERO).element_sum()
}
