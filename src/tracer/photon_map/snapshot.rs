//! What goes into a map, in layers, and what comes out of it.

use glam::Vec3;

use super::forest::Forest;
use super::photon::{Arrival, Photon};

/// What a photon is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// Met by final gathering: everything but caustics.
    Global = 0,
    /// Came over mirrors, glass and metal only, smooth or rough, which keep no photons; looked up directly.
    Caustic = 1,
}

/// Number of layers.
pub(super) const LAYERS: usize = 2;

/// Photons of one claim, in the order of their light paths.
#[derive(Debug, Default)]
pub struct Batch {
    pub(super) positions: [Vec<Vec3>; LAYERS],
    pub(super) photons: [Vec<Photon>; LAYERS],
}

impl Batch {
    /// Adds a photon; returns false, and adds nothing, where [`Photon::new`] refuses it.
    pub fn push(&mut self, layer: Layer, arrival: &Arrival) -> bool {
        let Some(photon) = Photon::new(arrival) else { return false };
        self.positions[layer as usize].push(arrival.position);
        self.photons[layer as usize].push(photon);
        true
    }

    pub(super) fn append(&mut self, mut other: Batch) {
        for layer in 0..LAYERS {
            self.positions[layer].append(&mut other.positions[layer]);
            self.photons[layer].append(&mut other.photons[layer]);
        }
    }
}

/// All photons of the first generations. Immutable.
#[derive(Clone, Debug, Default)]
pub struct Snapshot {
    pub(super) layers: [Forest; LAYERS],
    pub(super) generations: u64,
    pub(super) light_paths: u64,
}

impl Snapshot {
    /// The photons of a layer.
    #[inline]
    pub fn layer(&self, layer: Layer) -> &Forest {
        &self.layers[layer as usize]
    }

    /// How many generations it holds.
    #[inline]
    pub fn generations(&self) -> u64 {
        self.generations
    }

    /// Light paths its photons come from: what their flux is to be divided by.
    #[inline]
    pub fn light_paths(&self) -> u64 {
        self.light_paths
    }
}
