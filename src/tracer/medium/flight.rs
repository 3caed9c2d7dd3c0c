//! The free flight of a path to its next vertex, and the transmittance of an edge between two vertices.

use glam::{Vec3, Vec4};

use crate::math::bits::mix;
use crate::math::float::{SHADOW_T_MAX, safe_origin};
use crate::math::random::Random;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::Scene;
use crate::tracer::accel::{PrimRange, Ray};
use crate::tracer::bsdf::Scattering;
use crate::tracer::interaction::SurfaceInteraction;
use crate::tracer::light::LightSample;
use crate::tracer::opacity::{MOST_PASSED, meets, past};
use crate::tracer::shape::SurfacePoint;
use crate::tracer::vertex::SurfaceVertex;
use crate::tracer::walk::Walk;
use crate::tracer::wavelength_mis::WavelengthMis;

use super::emission::EmissionField;
use super::grid::{GridMedium, TrackedRay};
use super::{Coefficients, Media, Medium, MediumIndex, MediumKind, PathMedia};

/// How far a path flies from one vertex to the next, in all media on its way together.
#[derive(Clone, Copy, Debug)]
pub struct FreeFlight {
    /// The optical depth at the hero that is left before it scatters; on a grid that of the bound, before the next tentative collision.
    optical_depth: f64,
    /// Decides collisions on grids.
    random: Random,
    /// The distance to the next surface is asked for wherever the flight ends.
    whole: bool,
}

impl FreeFlight {
    /// A flight by the number `u` in (0, 1), which is asked for only in a scene with media.
    #[inline(always)]
    pub fn of<B: Scattering>(scene: &Scene, u: impl FnOnce() -> f64) -> Self {
        let u = if B::Media::PRESENT && scene.media().is_some() { u() } else { 0.0 };
        let random = Random(mix(u.to_bits()));
        Self { optical_depth: -(-u).ln_1p(), random, whole: false }
    }

    /// The same flight, of which each piece knows the distance to the next surface.
    pub fn whole(self) -> Self {
        Self { whole: true, ..self }
    }
}

impl Scene {
    /// The first vertex on `ray`, whose direction has unit length: a surface at which `meets` is true, given how much of it is there, or a
    /// point in a medium. `ray` then begins behind what it has passed, and `walk` is in the medium there and has the weight of the way.
    ///
    /// One surface more than [`MOST_PASSED`] is met. `record` receives each piece of the flight, and the walk at its end.
    pub(in crate::tracer) fn fly<const FROM_LIGHT: bool>(
        &self,
        media: &Media,
        walk: &mut Walk<FROM_LIGHT>,
        flight: &mut FreeFlight,
        ray: &mut Ray,
        meets: impl Fn(&Ray, &SurfaceInteraction, f32) -> bool,
        mut record: impl FnMut(&Walk<FROM_LIGHT>, FlightPiece),
    ) -> Option<SurfaceInteraction> {
        let mut passed = 0;
        loop {
            let medium = media.get(walk.medium);
            // Where a path is scattered soon, what lies far behind need not be found.
            let reach = medium.map_or(f32::INFINITY, |medium| medium.reach(ray, flight, &walk.lambda));
            let at = self.first(&Ray { t_max: ray.t_max.min(reach), ..*ray });
            if let Some(medium) = medium {
                let end = at.map_or(ray.t_max, |at| at.hit.t);
                let piece = walk.fly_through(medium, flight, ray, end);
                record(walk, piece);
                if piece.scatters {
                    let p = ray.origin + ray.direction * piece.length;
                    let p = at.map_or(p, |at| at.keep_before(p));
                    return Some(SurfaceInteraction::in_medium(p, -ray.direction, piece.length));
                }
            }
            let at = at?;
            if meets(ray, &at, self.opacity(&at)) || passed == MOST_PASSED {
                return Some(at);
            }
            let beside = self.beside(media, &at, ray.direction);
            let met = beside.iter().find(|other| meets(ray, other, self.opacity(other)));
            if let Some(other) = met {
                return Some(*other);
            }
            passed += 1;
            walk.medium = media.behind_all(&at, &beside, ray.direction, walk.medium);
            *ray = past(ray, &at);
        }
    }
}

impl Scene {
    /// The next vertex of a light path on `ray`, whose direction has unit length.
    #[inline(always)]
    pub(in crate::tracer) fn next_light_vertex<B: Scattering>(
        &self,
        walk: &mut Walk<true>,
        ray: &mut Ray,
        flight: &mut FreeFlight,
    ) -> Option<SurfaceInteraction> {
        match self.media().filter(|_| B::Media::PRESENT) {
            None => self.closest(ray),
            Some(media) => self.fly(media, walk, flight, ray, meets, |_, _| ()),
        }
    }
}

impl Medium {
    /// An upper bound of the distance at which this flight can end, with a margin for rounding: nothing farther need be intersected.
    #[inline]
    fn reach(&self, ray: &Ray, flight: &FreeFlight, lambda: &SampledWavelengths) -> f32 {
        match &self.kind {
            // What it emits up to the surface counts.
            _ if self.emission.is_some() || flight.whole => f32::INFINITY,
            MediumKind::Homogeneous(medium) if !medium.only_absorbs() => {
                let area = self.phase.along(ray.direction).most();
                let free = (flight.optical_depth / f64::from(medium.at(lambda, area).extinction.x)) as f32;
                1.001 * free + 1e-3 * ray.origin.abs().max_element()
            }
            MediumKind::Homogeneous(_) | MediumKind::Grid(_) => f32::INFINITY,
        }
    }
}

impl<const FROM_LIGHT: bool> Walk<FROM_LIGHT> {
    /// Flies through a medium for at most the distance `end`, and takes the weight of that.
    #[inline]
    fn fly_through(&mut self, medium: &Medium, flight: &mut FreeFlight, ray: &Ray, end: f32) -> FlightPiece {
        let area = medium.phase.along(ray.direction);
        let mut piece = FlightPiece {
            medium: self.medium,
            origin: ray.origin,
            direction: ray.direction,
            area: area.most(),
            end,
            length: end,
            scatters: false,
            relative: WavelengthMis::ALL,
            ln_most: 0.0,
            emitted: SampledSpectrum::ZERO,
        };
        let Medium { kind, emission, .. } = medium;
        match kind {
            MediumKind::Homogeneous(medium) => {
                let coefficients = medium.at(&self.lambda, piece.area);
                if !FROM_LIGHT && let Some(emission) = emission {
                    let Coefficients { extinction, albedo } = coefficients;
                    let depth = Vec4::select(extinction.cmpgt(Vec4::ZERO), extinction * end, Vec4::ZERO);
                    let met = Vec4::from_array(depth.to_array().map(|depth| -(-depth).exp_m1()));
                    let emitted = met * (1.0 - albedo) * emission.at(ray.origin, &self.lambda);
                    piece.emitted = self.carried_light(emitted);
                }
                if medium.only_absorbs() {
                    let (ln_transmittance, _) = piece.density(&coefficients);
                    self.throughput *= SampledSpectrum(ln_transmittance.exp());
                    return piece;
                }
                let hero = f64::from(coefficients.extinction.x);
                // Infinite where the extinction of the hero is 0.
                let free = (flight.optical_depth / hero) as f32;
                let scatters = free < end;
                let length = free.min(end);
                if !scatters && hero > 0.0 {
                    flight.optical_depth -= hero * f64::from(end);
                }
                let piece = FlightPiece { length, scatters, ..piece };
                let (density, kept) = piece.density(&coefficients);
                let (relative, ln_most) = self.weigh(density, kept);
                FlightPiece { relative, ln_most, ..piece }
            }
            MediumKind::Grid(grid) => {
                let lambda = self.lambda;
                let tracked = TrackedRay { ray: *ray, end, area, lambda: &lambda };
                self.track_through(grid, emission.as_ref(), &tracked, flight, piece)
            }
        }
    }

    /// The light that is emitted where this walk is, as the path counts it.
    #[inline]
    fn carried_light(&self, emitted: Vec4) -> SampledSpectrum {
        self.throughput * SampledSpectrum(emitted) * self.wavelength_weight()
    }

    /// Flies through a medium on a grid.
    fn track_through(
        &mut self,
        grid: &GridMedium,
        emission: Option<&EmissionField>,
        tracked: &TrackedRay<'_>,
        flight: &mut FreeFlight,
        piece: FlightPiece,
    ) -> FlightPiece {
        let TrackedRay { lambda, .. } = tracked;
        let FlightPiece { mut length, mut emitted, .. } = piece;
        let FreeFlight { optical_depth, random, .. } = flight;
        let scatters = grid.track(tracked, optical_depth, random, |collision| {
            if !FROM_LIGHT && let Some(emission) = emission {
                let albedo = collision.albedo.unwrap_or_else(|| grid.albedo_at(collision.p, lambda));
                let absorbed = collision.real * (1.0 - albedo);
                emitted += self.carried_light(absorbed * emission.at(collision.p, lambda));
            }
            if collision.albedo.is_some() {
                length = collision.t;
            }
            self.weigh(collision.density, collision.albedo.unwrap_or(Vec4::ONE));
        });
        FlightPiece { length, scatters, emitted, ..piece }
    }

    /// Multiplies the throughput by the weight of a flight for which each lane has a density of this logarithm, times `kept`, the albedo at a
    /// collision. Returns the densities over the largest of them, and the logarithm of that.
    #[inline]
    fn weigh(&mut self, density: Vec4, kept: Vec4) -> (WavelengthMis, f32) {
        // Where colours do not part, every lane has the density of the hero, which cancels.
        if density == Vec4::splat(density.x) {
            self.throughput *= SampledSpectrum(kept);
            return (WavelengthMis::ALL, density.x);
        }
        let (relative, most) = relative_densities(density, self.carried_wavelengths());
        let of_flight = WavelengthMis::relative(relative);
        let (wavelength_mis, scale) = self.wavelength_mis.and(of_flight).normalized();
        self.wavelength_mis = wavelength_mis;
        self.throughput *= SampledSpectrum(relative * kept * scale);
        (of_flight, most)
    }
}

/// The densities of these logarithms over the largest of those of the wavelengths that are carried, and its logarithm: at a large optical
/// depth only their quotients are numbers.
#[inline]
fn relative_densities(density: Vec4, carried: WavelengthMis) -> (Vec4, f32) {
    let carried = carried.carried();
    let most = Vec4::select(carried, density, Vec4::NEG_INFINITY).max_element();
    (Vec4::select(carried, (density - most).exp(), Vec4::ZERO), most)
}

/// A piece of a free flight, within one medium.
#[derive(Clone, Copy, Debug)]
pub(in crate::tracer) struct FlightPiece {
    /// The medium.
    pub(in crate::tracer) medium: MediumIndex,
    /// Where it begins.
    pub(in crate::tracer) origin: Vec3,
    /// Its unit direction.
    pub(in crate::tracer) direction: Vec3,
    /// The projected area of the particles in its direction; a bound of that on a grid.
    area: f32,
    /// The distance from there to the next surface; not known where the medium scatters the path before, unless the flight is
    /// [whole](FreeFlight::whole).
    pub(in crate::tracer) end: f32,
    /// How long it is.
    pub(in crate::tracer) length: f32,
    /// It ends with a scattering.
    scatters: bool,
    /// The densities of the lanes over the largest of them.
    relative: WavelengthMis,
    /// The logarithm of that.
    ln_most: f32,
    /// The light of the medium that a camera path finds on it, times what the path carries there.
    pub(in crate::tracer) emitted: SampledSpectrum,
}

impl Walk<false> {
    /// This walk, which is where `piece` begins, if it is scattered on that at the distance `t` from there; `None` where the density of
    /// distances has no closed form.
    pub(in crate::tracer) fn scattered_on(
        mut self,
        piece: &FlightPiece,
        media: &Media,
        t: f32,
    ) -> Option<Self> {
        let coefficients = piece.coefficients(media, &self.lambda)?;
        let (density, kept) = FlightPiece { length: t, scatters: true, ..*piece }.density(&coefficients);
        self.medium = piece.medium;
        self.weigh(density, kept);
        Some(self)
    }
}

impl FlightPiece {
    /// The coefficients along it, where the density of its length has a closed form: in a homogeneous medium that scatters.
    fn coefficients(&self, media: &Media, lambda: &SampledWavelengths) -> Option<Coefficients> {
        match &media.get(self.medium)?.kind {
            MediumKind::Homogeneous(medium) if !medium.only_absorbs() => Some(medium.at(lambda, self.area)),
            MediumKind::Homogeneous(_) | MediumKind::Grid(_) => None,
        }
    }

    /// The extinction of the hero along it, where the density of its length has a closed form.
    pub(in crate::tracer) fn hero_extinction(
        &self,
        media: &Media,
        lambda: &SampledWavelengths,
    ) -> Option<f32> {
        self.coefficients(media, lambda).map(|coefficients| coefficients.extinction.x)
    }

    /// True where it ends with a scattering.
    pub(in crate::tracer) fn scatters(&self) -> bool {
        self.scatters
    }

    /// The logarithm of the density with which each lane would choose it, and the share of light that is left after it.
    #[inline]
    fn density(&self, coefficients: &Coefficients) -> (Vec4, Vec4) {
        let Coefficients { extinction, albedo } = *coefficients;
        // ∞ · 0 would be NaN.
        let depth = Vec4::select(extinction.cmpgt(Vec4::ZERO), extinction * self.length, Vec4::ZERO);
        if self.scatters { (extinction.ln() - depth, albedo) } else { (-depth, Vec4::ONE) }
    }

    /// Its beginning of this length, of a path that carries these wavelengths.
    #[inline]
    pub(in crate::tracer) fn until(
        &self,
        length: f32,
        media: &Media,
        lambda: &SampledWavelengths,
        carried: WavelengthMis,
    ) -> Self {
        let piece = Self { length, scatters: false, ..*self };
        match media.get(self.medium).map(|medium| &medium.kind) {
            Some(MediumKind::Homogeneous(medium)) => {
                let (density, _) = piece.density(&medium.at(lambda, self.area));
                let (relative, ln_most) = relative_densities(density, carried);
                Self { relative: WavelengthMis::relative(relative), ln_most, ..piece }
            }
            // All wavelengths have the same extinction there, or the path carries one alone.
            Some(MediumKind::Grid(_)) | None => piece,
        }
    }

    /// The densities with which each lane would have chosen the flights of a path, those in `before` and this one.
    pub(in crate::tracer) fn and(&self, before: WavelengthMis) -> WavelengthMis {
        before.and(self.relative)
    }

    /// Its value at other wavelengths, which have the same extinction where it is on a grid, over the largest of the densities. With all pieces of a
    /// path it is multiplied by the weight of their [wavelengths](Self::and).
    pub(in crate::tracer) fn weight(&self, media: &Media, lambda: &SampledWavelengths) -> SampledSpectrum {
        match media.get(self.medium).map(|medium| &medium.kind) {
            None => SampledSpectrum::ONE,
            Some(MediumKind::Homogeneous(medium)) => {
                let (density, kept) = self.density(&medium.at(lambda, self.area));
                SampledSpectrum((density - self.ln_most).exp() * kept)
            }
            Some(MediumKind::Grid(grid)) if self.scatters => {
                SampledSpectrum(grid.albedo_at(self.origin + self.direction * self.length, lambda))
            }
            Some(MediumKind::Grid(_)) => SampledSpectrum::ONE,
        }
    }
}

/// The wavelengths of an edge, and the wavelength MIS of both subpaths that it connects.
#[derive(Clone, Copy, Debug)]
pub(in crate::tracer) struct EdgeWavelengths<'a> {
    /// The wavelengths.
    pub(in crate::tracer) lambda: &'a SampledWavelengths,
    /// With which the contribution of the edge has been weighted.
    pub(in crate::tracer) mis: WavelengthMis,
}

/// An edge that is not sampled: a ray from one vertex to another.
struct Edge<'a> {
    ray: Ray,
    medium: MediumIndex,
    wavelengths: EdgeWavelengths<'a>,
}

impl Scene {
    /// The factor on the contribution of an edge along `ray`, which begins in `medium`: its transmittance, and what that changes in the weight of
    /// the wavelengths. `passes` returns the share of light that goes straight on at a surface, given how much of it is there.
    #[inline]
    pub(in crate::tracer) fn edge_factor<M: PathMedia>(
        &self,
        medium: MediumIndex,
        ray: &Ray,
        skip: PrimRange,
        wavelengths: EdgeWavelengths<'_>,
    ) -> SampledSpectrum {
        match self.media().filter(|_| M::PRESENT) {
            None => SampledSpectrum::splat(self.open_share(ray, skip)),
            Some(media) => {
                let edge = Edge { ray: *ray, medium, wavelengths };
                let occluded = self.accel().occluded(ray, skip);
                let blocked = occluded && !self.has_holes();
                let passes = |at: &SurfaceInteraction, opacity: f32| {
                    if skip.contains(at.hit.prim) { 1.0 } else { (1.0 - opacity).max(0.0) }
                };
                if blocked {
                    SampledSpectrum::ZERO
                } else {
                    self.edge_in_media(media, &edge, occluded, passes)
                }
            }
        }
    }

    /// As [`edge_factor`](Self::edge_factor), where lights are looked through.
    pub(in crate::tracer) fn unlit_edge_factor(
        &self,
        media: &Media,
        medium: MediumIndex,
        ray: &Ray,
        wavelengths: EdgeWavelengths<'_>,
    ) -> SampledSpectrum {
        let passes = |at: &SurfaceInteraction, opacity: f32| {
            if at.light.is_some() { 1.0 } else { (1.0 - opacity).max(0.0) }
        };
        self.edge_in_media(media, &Edge { ray: *ray, medium, wavelengths }, true, passes)
    }

    /// The factor of an edge; `meets_surfaces` is false where nothing lies on it.
    fn edge_in_media(
        &self,
        media: &Media,
        edge: &Edge<'_>,
        meets_surfaces: bool,
        passes: impl Fn(&SurfaceInteraction, f32) -> f32,
    ) -> SampledSpectrum {
        let Edge { mut ray, mut medium, wavelengths: EdgeWavelengths { lambda, mis } } = *edge;
        // The end of a ray to a point is a little before the point.
        let unit = ray.direction.length();
        let mut beyond = if ray.t_max < f32::INFINITY { ray.t_max * (1.0 / SHADOW_T_MAX - 1.0) } else { 0.0 };
        let (mut share, mut tracked, mut passed) = (1.0, Vec4::ONE, 0);
        // Optical depths of media that scatter, and of those that only absorb.
        let [mut depth, mut absorbed] = [Vec4::ZERO; 2];
        let mut random = None;
        loop {
            let at = if meets_surfaces { self.first(&ray) } else { None };
            let end = at.map_or(ray.t_max + beyond, |at| at.hit.t);
            let direction = ray.direction / unit;
            match media.get(medium) {
                None => {}
                Some(Medium { kind: MediumKind::Homogeneous(medium), phase, .. }) => {
                    let extinction = medium.at(lambda, phase.along(direction).most()).extinction;
                    let met = extinction.cmpgt(Vec4::ZERO);
                    let depth = if medium.only_absorbs() { &mut absorbed } else { &mut depth };
                    *depth += Vec4::select(met, extinction * (end * unit), Vec4::ZERO);
                }
                Some(Medium { kind: MediumKind::Grid(grid), phase, .. }) => {
                    let ray = Ray::new(ray.origin, direction);
                    let random = random.get_or_insert_with(|| Random(hash(&ray)));
                    let area = phase.along(direction);
                    tracked *= grid.transmittance(&TrackedRay { ray, end: end * unit, area, lambda }, random);
                }
            }
            let Some(at) = at else { break };
            share *= passes(&at, self.opacity(&at));
            let beside = self.beside(media, &at, ray.direction);
            share *= beside.iter().map(|other| passes(other, self.opacity(other))).product::<f32>();
            if share == 0.0 || passed == MOST_PASSED {
                return SampledSpectrum::ZERO;
            }
            passed += 1;
            medium = media.behind_all(&at, &beside, ray.direction, medium);
            ray = past(&ray, &at);
            beyond = if ray.t_max > 0.0 { beyond } else { 0.0 };
            ray.t_max = ray.t_max.max(0.0);
        }
        let transmittance = (-depth).exp() * tracked;
        let carried = mis.carried();
        let most = Vec4::select(carried, transmittance, Vec4::ZERO).max_element();
        if most <= 0.0 || most.is_nan() {
            return SampledSpectrum::ZERO;
        }
        let relative = Vec4::select(carried, transmittance / most, Vec4::ZERO);
        let before = mis.weight();
        if before <= 0.0 {
            return SampledSpectrum::ZERO;
        }
        let weight = mis.and(WavelengthMis::relative(relative)).weight() / before;
        SampledSpectrum(transmittance * (-absorbed).exp() * (share * relative.x * weight))
    }
}

/// A number that depends on every bit of a ray: it decides what happens along an edge, whenever that is asked for.
fn hash(ray: &Ray) -> u64 {
    let (o, d) = (ray.origin, ray.direction);
    let pair = |hash, [a, b]: [f32; 2]| mix(hash ^ (u64::from(a.to_bits()) << 32 | u64::from(b.to_bits())));
    [[o.x, o.y], [o.z, d.x], [d.y, d.z]].into_iter().fold(0, pair)
}

impl<B: Scattering> SurfaceVertex<B> {
    /// The medium into which a path leaves this vertex in the world-space direction `d`.
    #[inline(always)]
    pub(in crate::tracer) fn medium_towards(&self, d: Vec3) -> MediumIndex {
        self.media.towards(self.hit.point.ng, d)
    }

    /// The factor on what arrives here from the light of `sample`: 1 where nothing stands in between and no medium either.
    #[inline(always)]
    pub(in crate::tracer) fn light_factor(
        &self,
        scene: &Scene,
        light: u32,
        sample: &LightSample,
        wavelengths: EdgeWavelengths<'_>,
    ) -> SampledSpectrum {
        let (ray, skip) = match sample.target {
            Some(target) => (self.hit.spawn_to(target, sample.wi), scene.lights().prims(light)),
            None => (self.hit.spawn(sample.wi), PrimRange::NONE),
        };
        let mis = match B::Media::PRESENT && self.bsdf.is_dispersive() {
            true => {
                let wi = self.frame.to_local(sample.wi);
                wavelengths.mis.and(self.bsdf.dispersion(self.wo, wi).wavelength_mis)
            }
            false => wavelengths.mis,
        };
        let wavelengths = EdgeWavelengths { mis, ..wavelengths };
        scene.edge_factor::<B::Media>(self.medium_towards(sample.wi), &ray, skip, wavelengths)
    }

    /// The factor on what a connection to the vertex `to` contributes, in the unit direction `d`: 1 where nothing stands in between and no
    /// medium either.
    #[inline]
    pub(in crate::tracer) fn connection_factor(
        &self,
        scene: &Scene,
        to: &Self,
        d: Vec3,
        wavelengths: EdgeWavelengths<'_>,
    ) -> SampledSpectrum {
        let SurfacePoint { p, error, ng } = to.hit.point;
        // Both ends are moved off their surfaces: each may be hit a rounding error early.
        let ray = self.hit.spawn_to(safe_origin(p, error, ng, -d), d);
        scene.edge_factor::<B::Media>(self.medium_towards(d), &ray, PrimRange::NONE, wavelengths)
    }
}
