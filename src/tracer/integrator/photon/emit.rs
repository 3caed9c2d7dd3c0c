//! Light paths: where they leave photons.
//!
//! They take points of the sequence in a random order. In the order of the sequence neighbouring photons would keep a
//! distance, wherever light arrives without having been spread; the area of the k nearest is then about k − ½ cells large,
//! not k − 1 as among independent points ([`Disc`](crate::tracer::photon_map::Disc)), and a caustic stays darker by
//! 1/(2k) for good: 2.1 % were measured with k = 24, 65 536 light paths and a point light.

use std::ops::Range;

use crate::math::bits::mix;
use crate::tracer::Sampler;
use crate::tracer::photon_map::{Arrival, PhotonBatch, PhotonLayer, wavelength_number, wavelengths};
use crate::tracer::subpath::{Vertex, Walk};

use super::{PhotonTracer, spreads};

/// Makes the numbers of light paths others than those of the camera paths of the same index.
const SEED: u32 = 0x5bd1_e995;

/// Traces the light paths of these numbers and leaves their photons in `batch`, in their order.
pub(super) fn light_paths(tracer: &PhotonTracer, paths: Range<u64>, batch: &mut PhotonBatch) {
    for path in paths {
        light_path(tracer, path, batch);
    }
}

fn light_path(tracer: &PhotonTracer, path: u64, batch: &mut PhotonBatch) {
    let context = &tracer.context;
    let (scene, longest) = (&context.scene, context.longest());
    let sampler = Sampler::at(mix(path), context.seed ^ SEED);
    let number = wavelength_number(sampler.camera().wavelength);
    let lambda = context.white().unwrap_or_else(|| wavelengths(number));
    let numbers = sampler.light();
    let Some(emission) = scene.lights.emit(&numbers.emission()) else { return };
    let emitted = scene.lights.spectrum(emission.light, -emission.direction, &lambda);
    let Some(mut walk) = Walk::from_light(lambda, &emission, emitted) else { return };
    let mut ray = emission.ray();
    let mut spread = false;
    // One more segment leads to the camera.
    while walk.depth() + 1 < longest {
        let Some(hit) = scene.closest(&ray) else { return };
        let vertex = walk.arrive(scene, hit);
        let here = spreads(&vertex.bsdf);
        if here && vertex.depth > 1 && can_be_seen(&vertex) {
            let (layer, wanted) = match spread {
                true => (PhotonLayer::Global, context.photons.gather),
                false => (PhotonLayer::Caustic, context.photons.caustics),
            };
            if wanted {
                batch.push(layer, &arrival(&vertex, number));
            }
        }
        let u = numbers.vertex(walk.depth() - 1);
        match walk.scatter(&vertex, &u, context.rr_depth) {
            Some(next) => ray = next,
            None => return,
        }
        // The link is 0 after a delta: the coat's mirror spreads nothing.
        spread |= here && walk.step().link > 0.0;
    }
}

/// The side that is lit reflects something at the path's wavelengths.
fn can_be_seen(vertex: &Vertex) -> bool {
    vertex.bsdf.eval(vertex.wo, vertex.wo).is_some_and(|(f, _)| !f.is_black())
}

fn arrival(vertex: &Vertex, wavelengths: u16) -> Arrival {
    let Vertex { hit, throughput, wavelength_mis, depth, .. } = vertex;
    // A photon of the hero alone counts four times by its wavelengths.
    let (counts, hero_only) = (wavelength_mis.weight(), wavelength_mis.is_alone());
    let counts = if hero_only { 0.25 * counts } else { counts };
    let ng = hit.point.ng;
    Arrival {
        position: hit.point.p,
        direction: hit.wo,
        normal: if hit.wo.dot(ng) < 0.0 { -ng } else { ng },
        flux: *throughput * counts,
        wavelengths,
        hero_only,
        depth: *depth,
    }
}
