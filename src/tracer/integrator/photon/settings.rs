//! How many photons, and how far a lookup reaches, in a scene of this size.

use std::f32::consts::PI;

use glam::Vec3;

use crate::scene::desc::PhotonDesc;
use crate::tracer::photon_map::Schedule;

/// Light paths of one generation: traced in a few hundredths of a second, so that the first picture is not kept waiting.
const PATHS: u64 = 4096;

/// Samples to a generation: four to a light path.
const SAMPLES: u64 = 16_384;

/// Photons of a lookup in the global layer.
const NEIGHBOURS: usize = 12;

/// Photons at which a map stops growing: 1.3 GB, and up to 2.5 times as much in all while its largest trees are merged. From there on noise goes on
/// shrinking and blur does not.
pub(super) const LIMIT: usize = 1 << 25;

/// The schedule for a scene in the box from `min` to `max`.
///
/// The first radius is that of a disc of four times the wanted photons, if the two photons that a light path leaves on
/// average lay evenly on the sides of the box: where light is about even, the number of photons bounds a lookup, and in the
/// dark the radius does.
/// What `desc` says takes the place of that.
pub(super) fn schedule((min, max): (Vec3, Vec3), desc: &PhotonDesc) -> Schedule {
    let side = (max - min).max(Vec3::ZERO).min(Vec3::splat(1e12));
    let area = 2.0 * (side.x * side.y + side.y * side.z + side.z * side.x);
    let photons = 2.0 * PATHS as f32;
    let neighbours = desc.lookup_size.map_or(NEIGHBOURS, |n| n as usize);
    let radius = (4.0 * neighbours as f32 * area / (PI * photons)).sqrt();
    // A scene that is a line or a point has photons in no area at all.
    let radius = radius.max(1e-3 * side.max_element()).max(f32::MIN_POSITIVE);
    Schedule {
        paths_per_generation: PATHS,
        samples_per_generation: SAMPLES,
        radius: desc.initial_radius.unwrap_or(radius),
        alpha: desc.alpha.unwrap_or(0.0),
        neighbours,
    }
}
