//! Photons around the flights of a camera path through media.

use std::f32::consts::PI;

use glam::Vec3;

use crate::color::Xyz;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::Scene;
use crate::tracer::bsdf::Scattering;
use crate::tracer::light_groups::LightCredits;
use crate::tracer::medium::{FlightPiece, Media, MediumIndex};
use crate::tracer::photon_map::{Beam, Lookup, Photon, PhotonLayer, Schedule};
use crate::tracer::record::PathEvent;
use crate::tracer::wavelength_mis::WavelengthMis;

use super::camera_path::{CameraPath, KishSums, WINDOW, lanes_near, shrink, sound};
use super::recorded_step::RecordedStep;
use super::tracer::{PhotonScratch, PhotonTracer};

/// Largest radius around a flight at the first generation, in free paths.
pub(super) const FREE_PATHS: f32 = 0.5;

/// What a camera path was like before a flight.
pub(super) struct FlightStart {
    /// Throughput at the hero, with the weight of its wavelengths.
    throughput: SampledSpectrum,
    /// The wavelengths that would have chosen the path up to there, and those that would have chosen its flights.
    carried: WavelengthMis,
    flights: WavelengthMis,
    /// Number of recorded steps.
    steps: usize,
    /// Number of segments.
    depth: u32,
}

impl<C: LightCredits> CameraPath<'_, C> {
    /// The path before its next flight.
    #[inline]
    pub(super) fn flight_start(&self) -> FlightStart {
        let Self { state, scratch, flights, .. } = self;
        FlightStart {
            throughput: state.walk.throughput * state.wavelength_weight,
            carried: state.walk.carried_wavelengths(),
            flights: *flights,
            steps: scratch.steps.len(),
            depth: state.walk.depth,
        }
    }

    /// Adds the beam radiance estimate (Jarosz, Zwicker and Jensen 2008, *The Beam Radiance Estimate for Volumetric Photon Mapping*) from the
    /// photons of `layer` around the flight since `start` from the vertex at `from`. The beam ends where the flight does, so that what the medium lets
    /// pass is in the probability of getting there (a short beam: Jarosz, Nowrouzezahrai, Sadeghi and Jensen 2011, *A Comprehensive Theory of
    /// Volumetric Radiance Estimation Using Photon Points and Beams*).
    ///
    /// Global photons nearer to the vertex than the radius are left out: a path that is scattered there goes on.
    pub(super) fn gather_along<B: Scattering<Credits = C>>(
        &mut self,
        start: &FlightStart,
        layer: PhotonLayer,
        from: Vec3,
    ) {
        let forest = self.snapshot.layer(layer);
        let context = &self.tracer.context;
        let Some(media) = context.scene.media().filter(|_| !forest.is_empty()) else { return };
        if start.depth >= context.longest() {
            return;
        }
        let segments = context.longest() - start.depth - 1;
        let lambda = self.state.walk.lambda;
        let Self { scratch, state, tracer, snapshot, lookup, .. } = self;
        let PhotonScratch { steps, query, gathered, .. } = &mut **scratch;
        let (mut xyz, mut value, mut kish) = (Xyz::BLACK, SampledSpectrum::ZERO, KishSums::default());
        let FlightStart { mut throughput, mut flights, .. } = *start;
        for (i, step) in steps.iter().enumerate().skip(start.steps) {
            let RecordedStep::Flight(piece) = step else { continue };
            let FlightPiece { origin, direction, length, medium, .. } = *piece;
            let reach = BeamReach::of(&context.scene, &tracer.schedule, lookup, medium, &lambda);
            let (before, flights_before) = (throughput, flights);
            throughput *= piece.weight(media, &lambda);
            flights = piece.and(flights);
            let phase = media.phase(medium, origin);
            let Some((BeamReach { radius, window }, phase)) = reach.zip(phase) else { continue };
            let varies = media.phase_varies(medium);
            let area = (PI * radius * radius).max(f32::MIN_POSITIVE);
            let scale = 1.0 / area / snapshot.light_paths as f32;
            let nearest = if layer == PhotonLayer::VolumeGlobal { radius } else { 0.0 };
            let mut photons = 0;
            let passed = origin.distance(from);
            let path = RecordedFlight { scene: &context.scene, steps: &steps[..i], white: context.white() };
            forest.along(&Beam { origin, direction, length }, radius, query, |photon, t| {
                if photon.depth() > segments || !photon.is_in(medium) || passed + t < nearest {
                    return;
                }
                photons += 1;
                let there = if varies { media.phase(medium, origin + direction * t) } else { None };
                let phase = there.as_ref().unwrap_or(&phase);
                let p = phase.density(photon.direction(), -direction) * scale;
                match window {
                    None => {
                        let piece = piece.until(t, media, &lambda, start.carried);
                        let weight = piece.and(flights_before).weight();
                        let found = path.at_wavelengths_of::<B>(photon, media, &piece, p * weight);
                        xyz += found;
                        kish.add(found.y);
                        state.credits.add_color(photon.group(), found);
                    }
                    Some(w) => {
                        let flux = lanes_near(photon, lambda.lambda().x, w);
                        let found = sound(before * (flux * p), None);
                        value += found;
                        kish.add(found.0.x);
                        state.credits.add_to(photon.group(), found);
                    }
                }
            });
            B::record(|| PathEvent::Gathered { photons, area, xyz: self.xyz + xyz });
        }
        *gathered += kish.effective_number();
        self.xyz += xyz;
        self.state.radiance += value;
    }

    /// How far away a vertex in a medium is at least at which global photons stand for what the flight to it has seen.
    pub(super) fn beam_radius(&self) -> f32 {
        let Self { tracer: PhotonTracer { context, schedule, .. }, lookup, state, .. } = self;
        let walk = &state.walk;
        let reach = BeamReach::of(&context.scene, schedule, lookup, walk.medium, &walk.lambda);
        reach.map_or(0.0, |reach| reach.radius)
    }
}

/// Which photons count around a flight.
#[derive(Clone, Copy, Debug)]
struct BeamReach {
    radius: f32,
    /// Largest distance (nm) from the hero if the path carries that alone.
    window: Option<f32>,
}

impl BeamReach {
    /// Around a flight in `medium`; `None` where nothing is scattered. Light varies within a free path, so that no photon from much farther counts.
    fn of(
        scene: &Scene,
        schedule: &Schedule,
        lookup: &Lookup,
        medium: MediumIndex,
        lambda: &SampledWavelengths,
    ) -> Option<Self> {
        let first = schedule.beam_radius.min(FREE_PATHS * scene.media()?.free_path(medium)?);
        Some(match lambda.is_hero_only() {
            false => Self { radius: first * lookup.beam_share, window: None },
            true => Self { radius: first * shrink(lookup), window: Some(WINDOW * shrink(lookup)) },
        })
    }
}

/// A path before one of its flights, to be evaluated again at the wavelengths of photons around that.
struct RecordedFlight<'a> {
    scene: &'a Scene,
    steps: &'a [RecordedStep],
    /// The wavelengths of every photon, where nothing has a colour.
    white: Option<SampledWavelengths>,
}

impl RecordedFlight<'_> {
    /// Contribution of a photon beside the end of `piece`, the flight up to there.
    #[inline]
    fn at_wavelengths_of<B: Scattering>(
        &self,
        photon: &Photon,
        media: &Media,
        piece: &FlightPiece,
        scale: f32,
    ) -> Xyz {
        let lambda = self.white.unwrap_or_else(|| photon.wavelengths());
        let weight = |t: SampledSpectrum, s: &RecordedStep| t * s.weight::<B>(self.scene, &lambda);
        let throughput = self.steps.iter().fold(piece.weight(media, &lambda), weight);
        lambda.to_xyz(sound(photon.flux() * throughput * scale, None))
    }
}
