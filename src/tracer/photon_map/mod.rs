//! One-pass photon map (paper §3.4): photons are added while samples are rendered, and nobody waits for them.
//!
//! ```text
//! any thread:  PhotonMap::claim → trace light paths → Claim::deposit(Batch)
//!                 last deposit of a generation: sort, merge (Forest), publish one pointer
//! any thread:  PhotonMap::latest or ::finished(g) → Arc<Snapshot> → Forest::nearest / ::within → Disc
//! ```
//!
//! - **Space is split, not the photons** (`space`): in the middle of the longest side of the scene's box, so that no
//!   photon's place in the tree depends on the others, and trees are merged by sorting (`tree`).
//! - **A generation** is a fixed range of light paths. Its photons appear all at once, in an order that no scheduling
//!   can change; a [`Snapshot`] is all photons of the generations 0 … g − 1 and is a pure function of g.
//! - **Readers never wait** (`publish`): a snapshot is immutable, and reaching the latest costs one atomic load.
//!   The paper's reader-writer lock around one growing tree is kept to be measured against (`locked`).
//! - **The schedule** (`schedule`) ties the number of generations, the radius and the number of neighbours to the
//!   sample's index, so that a sample does not depend on who renders it or when.
//! - Caustic photons and the others are two layers of one map ([`Layer`]): one light path feeds both.
//!
//! Bytes per photon: 32, plus 16 per split: one split to about 3.5 photons.

mod disc;
mod forest;
mod locked;
mod photon;
mod publish;
mod query;
mod schedule;
mod snapshot;
mod space;
mod tree;

pub use disc::Disc;
pub use forest::Forest;
pub use locked::{GrownTree, LockedTree};
pub use photon::{Arrival, Photon, wavelength_number, wavelengths};
pub use publish::{Claim, PhotonMap};
pub use query::{Near, QueryScratch};
pub use schedule::{Lookup, Schedule};
pub use snapshot::{Batch, Layer, Snapshot};
pub use space::{MAX_DEPTH, Space};
pub use tree::{LEAF, Run, Tree, Wanted};
