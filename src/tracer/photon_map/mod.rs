//! Progressive photon map (paper §3.4): photons are added while samples are rendered, and no thread waits for them.
//!
//! ```text
//! any thread:  PhotonMap::claim → trace light paths → Claim::deposit(PhotonBatch)
//!                 last deposit of a generation: sort, merge (Forest), publish one pointer
//! any thread:  PhotonMap::latest or ::finished(g) → Arc<Snapshot> → Forest::nearest → Disc, or Forest::along a Beam
//! ```
//!
//! - `photon` packs one photon.
//! - `morton` and `tree`: **space is split, not the photons**, in the middle of the longest side of the scene's box. So no
//!   photon's position in the tree depends on the others, and trees are merged like sorted lists. `forest` keeps a
//!   logarithmic number of trees and traverses them.
//! - `publish`: **a generation** is a fixed range of light paths. Its photons appear all at once, in an order that no
//!   scheduling can change: a [`Snapshot`] holds all photons of the generations 0 … g − 1 and is a pure function of g.
//!   **Readers never wait**, because a snapshot is immutable and the latest one is reached by one atomic load.
//! - `schedule` ties the number of generations, the radius and the number of neighbours to the sample's index, so that a
//!   sample does not depend on the thread or the time.
//!
//! A photon takes 32 bytes and a split 16. There is one split for about 3.5 photons.

mod forest;
mod morton;
mod photon;
mod publish;
mod schedule;
mod tree;

pub use forest::{Beam, Disc, Forest, Neighbour, QueryScratch};
pub use morton::{MAX_DEPTH, MortonGrid};
pub use photon::{Arrival, ArrivalSite, Photon, wavelength_number, wavelengths};
pub use publish::{Claim, PhotonBatch, PhotonLayer, PhotonMap, Snapshot};
pub use schedule::{Lookup, Schedule};
pub use tree::{LEAF, PhotonTree, SortedPhotons, Wanted};
