//! The number of photons of a generation, and the first radius of lookups among them.

use std::f32::consts::PI;

use glam::Vec3;

use crate::scene::desc::PhotonDesc;
use crate::tracer::photon_map::Schedule;

use super::extent::Extent;
use super::{PATHS, SAMPLES_PER_GENERATION};

/// Radius around the first beams in media over the distance to which four times the photons of a lookup lie.
const BEAM: f32 = 1.0 / 3.0;

/// Such a radius over the largest side of the box of the photons, where too few of them lie in media to tell.
const SPARSE_BEAM: f32 = 0.02;

/// Number of photons of a lookup in the global layer.
const NEIGHBOURS: usize = 12;

/// The schedule for photons of this extent.
///
/// On surfaces the first radius is that of a disc of four times the wanted photons, if the two photons that a light path leaves on
/// average lay evenly on the sides of the box: where light is about even, the number of photons bounds a lookup, and in the
/// dark the radius does. In media it is a share of the distance to which four times the wanted photons lie around a photon. Settings in `desc` take the place of these.
/// The samples of a generation are divided among so many `eyes`.
pub(super) fn schedule(extent: &Extent, desc: &PhotonDesc, eyes: u64) -> Schedule {
    let [min, max] = extent.bounds;
    let side = (max - min).max(Vec3::ZERO).min(Vec3::splat(1e12));
    let area = 2.0 * (side.x * side.y + side.y * side.z + side.z * side.x);
    let photons = 2.0 * PATHS as f32;
    let neighbours = desc.lookup_size.map_or(NEIGHBOURS, |n| n as usize);
    let radius = (4.0 * neighbours as f32 * area / (PI * photons)).sqrt();
    // A scene that is a line or a point has photons in no area at all.
    let radius = radius.max(1e-3 * side.max_element()).max(f32::MIN_POSITIVE);
    let sparse = SPARSE_BEAM * side.max_element();
    let beam_radius = extent.spacing(4 * neighbours, PATHS).map_or(sparse, |spacing| BEAM * spacing);
    Schedule {
        paths_per_generation: PATHS,
        samples_per_generation: SAMPLES_PER_GENERATION / eyes,
        radius: desc.initial_radius.unwrap_or(radius),
        beam_radius: desc.initial_radius.unwrap_or(beam_radius.max(f32::MIN_POSITIVE)),
        alpha: desc.alpha.unwrap_or(0.0),
        neighbours,
    }
}
