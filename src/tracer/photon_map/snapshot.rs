//! The input of the map, a batch of photons, and its output, a snapshot.

use glam::Vec3;

use super::forest::Forest;
use super::photon::{Arrival, Photon};

/// The two photon maps of Jensen's method: one light path feeds both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PhotonLayer {
    /// The global map, for final gathering: all photons but caustic ones.
    Global = 0,
    /// The caustic map, for direct density estimation: photons that arrived over mirrors, glass and metal only, smooth or
    /// rough. These surfaces store no photons themselves.
    Caustic = 1,
}

/// Number of layers.
pub(super) const LAYERS: usize = 2;

/// Photons of one claim, in the order of their light paths.
#[derive(Debug, Default)]
pub struct PhotonBatch {
    pub(super) positions: [Vec<Vec3>; LAYERS],
    pub(super) photons: [Vec<Photon>; LAYERS],
}

impl PhotonBatch {
    /// Adds a photon. Returns false, and adds nothing, if [`Photon::new`] refuses it.
    pub fn push(&mut self, layer: PhotonLayer, arrival: &Arrival) -> bool {
        let Some(photon) = Photon::new(arrival) else { return false };
        self.positions[layer as usize].push(arrival.position);
        self.photons[layer as usize].push(photon);
        true
    }

    pub(super) fn append(&mut self, mut other: PhotonBatch) {
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
    pub fn layer(&self, layer: PhotonLayer) -> &Forest {
        &self.layers[layer as usize]
    }

    /// Number of generations.
    #[inline]
    pub fn generations(&self) -> u64 {
        self.generations
    }

    /// Number of light paths of these generations, by which the flux is to be divided.
    #[inline]
    pub fn light_paths(&self) -> u64 {
        self.light_paths
    }
}
