//! Light paths: where they leave photons, and which photons a sample sees.
//!
//! Light paths take points of the sequence in a random order. In the order of the sequence neighbouring photons would keep a
//! distance, wherever light arrives without having been spread; the area of the k nearest is then about k − ½ cells large,
//! not k − 1 as among independent points ([`Disc`](crate::tracer::photon_map::Disc)), and a caustic stays darker by
//! 1/(2k) for good: 2.1 % were measured with k = 24, 65 536 light paths and a point light.

use std::ops::Range;
use std::sync::Arc;

use crate::math::bits::mix;
use crate::math::random::Random;
use crate::stream::{FaultyValue, faults};
use crate::tracer::bsdf::{Bsdf, InMedia, Recorded, Scattering, Unmixed};
use crate::tracer::integrator::RenderContext;
use crate::tracer::light::EmissionOrigin;
use crate::tracer::medium::{FreeFlight, PathMedia};
use crate::tracer::photon_map::{
    Arrival, ArrivalSite, PhotonBatch, PhotonLayer, Snapshot, Wanted, wavelength_number, wavelengths,
};
use crate::tracer::record::PathEvent;
use crate::tracer::subpath::SubpathVertex;
use crate::tracer::{MaterialClass, Sampler, TracingMode};

use super::tracer::{PhotonPaths, PhotonScratch, PhotonTracer};

/// Makes the random numbers of light paths differ from those of the camera paths of the same index.
const SEED: u32 = 0x5bd1_e995;

/// Number of samples after which a worker asks for a newer snapshot.
const SAMPLES_PER_SNAPSHOT: u32 = 64;

/// Least number of samples between two claims of light paths: a render that begins far out in the sequence goes on with
/// its samples while it catches up.
const SAMPLES_PER_CLAIM: u32 = 16;

/// From this vertex on a light path leaves a photon in a medium with the probability of this number over the vertex's: a path that is scattered
/// hundreds of times in milk does not fill the map alone.
const ALWAYS_KEPT: u32 = 8;

impl PhotonTracer {
    /// Traces this index's share of light paths and returns the photons that it sees; `None` when nobody waits for it.
    pub(in crate::tracer::integrator) fn snapshot(
        &self,
        index: u64,
        scratch: &mut PhotonScratch,
        wanted: Wanted<'_>,
    ) -> Option<Arc<Snapshot>> {
        let trace = |paths: Range<u64>, batch: &mut PhotonBatch| {
            trace_light_paths(&self.context, self.photon_paths, paths, batch)
        };
        scratch.samples = scratch.samples.wrapping_add(1);
        if scratch.samples.is_multiple_of(SAMPLES_PER_CLAIM)
            && let Some(claim) = self.map.claim(self.schedule.paths_ahead(index))
        {
            let mut batch = PhotonBatch::default();
            trace(claim.paths(), &mut batch);
            claim.deposit(batch, wanted);
        }
        let demanded = self.generations.unwrap_or_else(|| self.schedule.generations(index));
        let needed = demanded.min(self.map.last());
        let known = scratch.snapshot.take().filter(|known| match self.deterministic {
            true => known.generations == needed,
            false => !scratch.samples.is_multiple_of(SAMPLES_PER_SNAPSHOT),
        });
        if known.is_some() {
            return known;
        }
        let newest = (!self.deterministic).then(|| self.map.latest()).filter(|s| s.generations > 0);
        let needed = if self.deterministic { needed } else { 1 };
        newest.or_else(|| self.map.wait(needed, trace, wanted))
    }

    /// Traces the light path of this number, for its [record](crate::tracer::record), and forgets its photons.
    pub fn trace_light_path(&self, number: u64) {
        let (batch, photon_paths) = (&mut PhotonBatch::default(), self.photon_paths);
        match self.context.scene.tracing_mode() {
            TracingMode::Record => trace_light_path::<Recorded>(&self.context, photon_paths, number, batch),
            TracingMode::Plain | TracingMode::LightGroups => {
                trace_plain_light_path(&self.context, photon_paths, number, batch);
            }
        }
    }
}

/// Traces the light paths of these numbers and leaves their photons in `batch`.
pub(super) fn trace_light_paths(
    context: &RenderContext,
    photon_paths: PhotonPaths,
    paths: Range<u64>,
    batch: &mut PhotonBatch,
) {
    paths.for_each(|path| {
        trace_plain_light_path(context, photon_paths, path, batch);
        faults::of_light_path(path);
    });
}

/// As [`trace_light_path`], without a record.
fn trace_plain_light_path(
    context: &RenderContext,
    photon_paths: PhotonPaths,
    path: u64,
    batch: &mut PhotonBatch,
) {
    match context.scene.material_class() {
        MaterialClass::Mixed => trace_light_path::<Bsdf>(context, photon_paths, path, batch),
        MaterialClass::InMedia => trace_light_path::<InMedia>(context, photon_paths, path, batch),
        _ => trace_light_path::<Unmixed>(context, photon_paths, path, batch),
    }
}

/// Traces the light path of this number and leaves its photons in `batch`.
fn trace_light_path<B: Scattering>(
    context: &RenderContext,
    photon_paths: PhotonPaths,
    path: u64,
    batch: &mut PhotonBatch,
) {
    let (scene, longest) = (&context.scene, context.longest());
    let sampler = Sampler::at(mix(path), context.photon_seed() ^ SEED);
    let number = wavelength_number(sampler.camera().wavelength);
    let lambda = context.white().unwrap_or_else(|| wavelengths(number));
    let numbers = sampler.light();
    let Some(emission) = scene.lights.emit(&numbers.emission()) else { return };
    let emitted = scene.lights.emitted(&emission, &lambda);
    let group = scene.lights.group(emission.light).unwrap_or_default();
    let Some(mut subpath) = scene.light_subpath(lambda, &emission, emitted) else { return };
    B::record(|| PathEvent::Begins((&subpath.walk).into()));
    let mut ray = emission.ray();
    let mut spread = false;
    let beam = emission.pdf.origin == EmissionOrigin::Beam;
    // One more segment leads to the camera.
    while subpath.walk.depth + 1 < longest {
        let mut flight = FreeFlight::of::<B>(scene, || numbers.flight(subpath.walk.depth));
        let next = scene.next_light_vertex::<B>(&mut subpath.walk, &mut ray, &mut flight);
        let Some(hit) = next else { break };
        let vertex: SubpathVertex<B> = subpath.arrive(scene, hit);
        B::record(|| PathEvent::Meets((&subpath.walk).into(), hit));
        let here = photon_paths.spread_at(&vertex.surface);
        // Next-event estimation finds what arrives straight from a light, but from a beam.
        if here && (vertex.depth > 1 || beam) && reflects(&vertex) {
            let (layer, wanted) = match spread {
                true => (PhotonLayer::Global, context.photons.gather),
                false => (PhotonLayer::Caustic, context.photons.caustics),
            };
            if wanted && let Some(arrival) = arrival(context, &vertex, number, path) {
                let layer = layer.of_media(vertex.surface.hit.is_in_medium());
                let arrival = Arrival { group, ..arrival };
                if !batch.push(layer, &arrival) && !arrival.flux.is_finite() {
                    faults::raise(
                        FaultyValue::Photon,
                        arrival.flux.into(),
                        vertex.surface.hit.known_surface(),
                        None,
                    );
                }
            }
        }
        let u = numbers.vertex(subpath.walk.depth - 1);
        let Some(next) = subpath.scatter(&vertex, &u, context.rr_depth) else { return };
        ray = next;
        // The link is 0 after a delta: the coat's mirror spreads nothing.
        let delta = subpath.previous.link == 0.0;
        if !delta && photon_paths == PhotonPaths::Specular {
            return;
        }
        spread |= here && !delta;
    }
    B::record(|| PathEvent::Leaves((&subpath.walk).into()));
}

/// True if the lit side scatters anything at the wavelengths of the path, back or through: else no camera path gathers there.
fn reflects<B: Scattering>(vertex: &SubpathVertex<B>) -> bool {
    let surface = &vertex.surface;
    surface.bsdf.transmits() || surface.bsdf.eval(surface.wo, surface.wo).is_some_and(|(f, _)| !f.is_black())
}

/// What the light path of this number leaves at `vertex`; `None` where it is chosen to leave nothing.
fn arrival<B: Scattering>(
    context: &RenderContext,
    vertex: &SubpathVertex<B>,
    wavelengths: u16,
    path: u64,
) -> Option<Arrival> {
    let SubpathVertex { surface, throughput, wavelength_mis, depth, .. } = vertex;
    let hit = &surface.hit;
    // A photon of the hero alone counts four times by its wavelengths.
    let (weight, hero_only) = (wavelength_mis.weight(), wavelength_mis.is_alone());
    let weight = if hero_only { 0.25 * weight } else { weight };
    let (site, scale) = match B::Media::PRESENT && hit.is_in_medium() {
        // Both the photon and the path that gathers it meet the surface by chance; one chance is enough.
        false => (ArrivalSite::Surface(hit.facing_normal()), weight / context.scene.opacity(hit)),
        true => {
            let kept = (ALWAYS_KEPT as f32 / *depth as f32).min(1.0);
            if Random(mix(path ^ u64::from(context.photon_seed()) << 32) ^ u64::from(*depth)).f32() >= kept {
                return None;
            }
            (ArrivalSite::Medium(surface.medium_towards(hit.wo)), weight / kept)
        }
    };
    let flux = *throughput * scale;
    Some(Arrival {
        position: hit.point.p,
        direction: hit.wo,
        site,
        flux,
        wavelengths,
        hero_only,
        depth: *depth,
        group: 0,
    })
}
