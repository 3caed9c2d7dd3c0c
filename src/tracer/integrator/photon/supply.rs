//! Photons for a sample: its share of light paths, and the snapshot that it sees.

use std::sync::Arc;

use crate::tracer::photon_map::{PhotonBatch, Snapshot, Wanted};

use super::{PhotonScratch, PhotonTracer, emit};

/// Paths between two looks for a newer snapshot.
const EVERY: u32 = 64;

/// Paths between two claims of light paths at least: a render that begins far out in the sequence goes on with its
/// samples while it catches up.
const SHARE: u32 = 16;

impl PhotonTracer {
    /// Traces this index's share of light paths, and returns the photons that it sees; `None` when nobody waits for it.
    pub(super) fn photons(
        &self,
        index: u64,
        scratch: &mut PhotonScratch,
        wanted: Wanted<'_>,
    ) -> Option<Arc<Snapshot>> {
        let trace = |paths, batch: &mut PhotonBatch| emit::light_paths(self, paths, batch);
        scratch.path = scratch.path.wrapping_add(1);
        if scratch.path.is_multiple_of(SHARE)
            && let Some(claim) = self.map.claim(self.schedule.paths_ahead(index))
        {
            let mut batch = PhotonBatch::default();
            trace(claim.paths(), &mut batch);
            claim.deposit_while(batch, wanted);
        }
        let needed = self.schedule.generations(index).min(self.map.last());
        let known = scratch.snapshot.take().filter(|known| match self.deterministic {
            true => known.generations() == needed,
            false => !scratch.path.is_multiple_of(EVERY),
        });
        if known.is_some() {
            return known;
        }
        let newest = (!self.deterministic).then(|| self.map.latest()).filter(|s| s.generations() > 0);
        let needed = if self.deterministic { needed } else { 1 };
        newest.or_else(|| self.map.wait_while(needed, trace, wanted))
    }
}
