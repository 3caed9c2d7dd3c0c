//! The shared map: photons from all threads, published in whole generations.
//!
//! Render threads claim small ranges of light paths and deposit their photons as batches. The thread that deposits the last
//! batch of a generation sorts and merges it, outside every lock that a depositor or reader takes, and swaps one pointer
//! (`arc-swap`). Readers keep their snapshot for as long as they like.
//!
//! The content of a snapshot depends on its number alone: batches are put into the order of their light paths, and
//! generations are merged in order. A claim that is dropped without a deposit (its thread gave up) is handed out again,
//! and a merge that was given up is begun again by whoever needs it: everything that takes longer than a millisecond
//! checks now and then whether it is [`Wanted`]. The map stops growing with the first snapshot that holds a given number
//! of photons, which again depends on nothing else.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, TryLockError};

use arc_swap::ArcSwap;
use glam::Vec3;

use super::forest::Forest;
use super::morton::MortonGrid;
use super::photon::{Arrival, Photon};
use super::tree::{SortedPhotons, Wanted};

/// Snapshots that are kept: one thread may be this many generations behind another.
const KEPT: usize = 16;

/// A photon map that grows while it is read. All threads share it. It belongs to one epoch of one scene.
#[derive(Debug)]
pub struct PhotonMap {
    grid: Arc<MortonGrid>,
    paths_per_generation: u64,
    /// The first light path that nobody has claimed.
    next: AtomicU64,
    /// Photons at which the map stops growing.
    limit: usize,
    /// The last generation: the first one with `limit` photons.
    last: AtomicU64,
    /// True while `Collecting::returned` holds claims: spares the lock.
    returned: AtomicBool,
    collecting: Mutex<Collecting>,
    /// Held while a generation is merged. Threads try it and never wait for it.
    publisher: Mutex<()>,
    /// The last [`KEPT`] snapshots, oldest first, never empty.
    published: ArcSwap<Vec<Arc<Snapshot>>>,
    /// Signalled when a snapshot is published, and when a claim or a merge is given up.
    news: Condvar,
}

#[derive(Debug, Default)]
struct Collecting {
    /// Batches of each incomplete generation, with their first light paths.
    open: BTreeMap<u64, Vec<(u64, PhotonBatch)>>,
    /// Generations that are complete and sorted, but not merged.
    ready: BTreeMap<u64, [SortedPhotons; LAYERS]>,
    /// Claims that were dropped without a deposit.
    returned: Vec<Range<u64>>,
    /// Number of merges that were given up.
    given_up: u64,
}

/// Light paths of one claim. A generation is a whole number of claims.
const CLAIM: u64 = 64;

/// Locks `mutex`. Its data stays valid if a holder panics, because every change is a single push, insert or removal.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl PhotonMap {
    /// An empty map over the box of the scene, which stops growing once it holds `limit` photons. `paths_per_generation` is rounded
    /// up to a multiple of 64.
    pub fn new(min: Vec3, max: Vec3, paths_per_generation: u64, limit: usize) -> Self {
        let whole = paths_per_generation.max(1).next_multiple_of(CLAIM);
        Self::over(Arc::new(MortonGrid::new(min, max)), whole, limit)
    }

    fn over(grid: Arc<MortonGrid>, paths_per_generation: u64, limit: usize) -> Self {
        Self {
            grid,
            paths_per_generation,
            next: AtomicU64::new(0),
            limit,
            last: AtomicU64::new(u64::MAX),
            returned: AtomicBool::new(false),
            collecting: Mutex::default(),
            publisher: Mutex::default(),
            published: ArcSwap::from_pointee(vec![Arc::default()]),
            news: Condvar::new(),
        }
    }

    /// Claims a range of light paths below number `until` (rounded up to whole claims) that nobody has traced. `None` if all
    /// are claimed. Cheap enough to call with every sample: `map.claim(schedule.paths_ahead(index))`.
    pub fn claim(&self, until: u64) -> Option<Claim<'_>> {
        if self.returned.load(Ordering::Relaxed) {
            let mut collecting = lock(&self.collecting);
            if let Some(paths) = collecting.returned.pop() {
                self.returned.store(!collecting.returned.is_empty(), Ordering::Relaxed);
                return Some(Claim { map: self, paths, adding: false, done: false });
            }
        }
        let last = self.last.load(Ordering::Relaxed);
        let until = until.min(last.saturating_mul(self.paths_per_generation));
        let end = |start| (start < until).then(|| start + CLAIM);
        let start = self.next.fetch_update(Ordering::Relaxed, Ordering::Relaxed, end).ok()?;
        Some(Claim { map: self, paths: start..start + CLAIM, adding: false, done: false })
    }

    /// The newest snapshot. Never waits.
    #[inline]
    pub fn latest(&self) -> Arc<Snapshot> {
        let kept = self.published.load();
        Arc::clone(kept.last().expect("the list starts with one snapshot and never loses its last"))
    }

    /// The snapshot of exactly `generations` generations (or the last one, if the map has stopped growing before), if it is
    /// finished and still kept. Never waits.
    #[inline]
    pub fn finished(&self, generations: u64) -> Option<Arc<Snapshot>> {
        let generations = generations.min(self.last.load(Ordering::Acquire));
        self.published.load().iter().find(|s| s.generations == generations).cloned()
    }

    /// The snapshot of exactly `generations` generations, or `None` soon after `wanted` returns false. This thread helps to make it: it
    /// calls `trace(light paths, batch)` while there are unclaimed ones, then sleeps until the other threads have finished theirs. Two threads can never wait
    /// for each other, provided that `trace` does not use this map.
    ///
    /// A thread that slept until the snapshot was no longer kept (`KEPT` generations) makes it again, alone: this is slow,
    /// but gives the same result.
    pub fn wait(
        &self,
        generations: u64,
        mut trace: impl FnMut(Range<u64>, &mut PhotonBatch),
        wanted: Wanted<'_>,
    ) -> Option<Arc<Snapshot>> {
        let paths = generations.saturating_mul(self.paths_per_generation);
        let mut again = None;
        loop {
            let map = again.as_ref().unwrap_or(self);
            if let Some(snapshot) = map.finished(generations) {
                return Some(snapshot);
            }
            if !wanted() {
                return None;
            }
            if map.latest().generations > generations {
                again = Some(Self::over(Arc::clone(&self.grid), self.paths_per_generation, self.limit));
            } else if let Some(claim) = map.claim(paths) {
                let mut batch = PhotonBatch::default();
                trace(claim.paths(), &mut batch);
                claim.deposit(batch, wanted);
            } else {
                // Read first, so that a merge that is given up from here on is noticed.
                let given_up = lock(&map.collecting).given_up;
                map.publish(wanted);
                map.sleep(generations, given_up);
            }
        }
    }

    /// The generation at which the map has stopped growing, or `u64::MAX` before.
    pub fn last(&self) -> u64 {
        self.last.load(Ordering::Acquire)
    }

    /// Sleeps until the snapshot is there, a claim was returned, or more than `given_up` merges were given up.
    fn sleep(&self, generations: u64, given_up: u64) {
        let asleep = |c: &mut Collecting| {
            let newest = self.latest().generations;
            let there = newest >= generations.min(self.last.load(Ordering::Acquire));
            !there && c.returned.is_empty() && c.given_up == given_up
        };
        drop(self.news.wait_while(lock(&self.collecting), asleep));
    }

    fn add(&self, paths: Range<u64>, batch: PhotonBatch, wanted: Wanted<'_>) {
        let generation = paths.start / self.paths_per_generation;
        let complete = {
            let mut collecting = lock(&self.collecting);
            let batches = collecting.open.entry(generation).or_default();
            batches.push((paths.start, batch));
            let all = batches.len() as u64 * CLAIM == self.paths_per_generation;
            if all { collecting.open.remove(&generation) } else { None }
        };
        let Some(mut batches) = complete else { return };
        batches.sort_unstable_by_key(|b| b.0);
        let mut all = PhotonBatch::default();
        batches.into_iter().for_each(|(_, batch)| all.append(batch));
        let runs =
            std::array::from_fn(|l| SortedPhotons::sorted(&self.grid, &all.positions[l], &all.photons[l]));
        lock(&self.collecting).ready.insert(generation, runs);
        self.publish(wanted);
    }

    /// Merges and publishes the generations that are ready, in order, unless another thread is already doing so.
    fn publish(&self, wanted: Wanted<'_>) {
        loop {
            let guard = match self.publisher.try_lock() {
                Ok(guard) => guard,
                Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
                Err(TryLockError::WouldBlock) => return,
            };
            let newest = self.latest();
            if newest.generations >= self.last.load(Ordering::Relaxed) {
                return;
            }
            let runs = lock(&self.collecting).ready.get(&newest.generations).cloned();
            if let Some(runs) = runs
                && !self.swap(&newest, runs, wanted)
            {
                drop(guard);
                lock(&self.collecting).given_up += 1;
                self.news.notify_all();
                return;
            }
            drop(guard);
            // Read after the release: generations that became ready before it were left to this thread.
            let next = self.latest().generations;
            if !lock(&self.collecting).ready.contains_key(&next) {
                return;
            }
        }
    }

    /// Merges one generation and publishes the snapshot. False if the merge was given up.
    fn swap(&self, newest: &Snapshot, runs: [SortedPhotons; LAYERS], wanted: Wanted<'_>) -> bool {
        let mut layers = newest.layers.clone();
        for (layer, run) in layers.iter_mut().zip(runs) {
            let Some(grown) = layer.grown(&self.grid, run, wanted) else { return false };
            *layer = grown;
        }
        let generations = newest.generations + 1;
        let photons = layers.iter().map(Forest::len).sum::<usize>();
        let light_paths = generations * self.paths_per_generation;
        let snapshot = Snapshot { layers, generations, light_paths };
        let mut kept = Vec::clone(&self.published.load());
        kept.push(Arc::new(snapshot));
        let surplus = kept.len().saturating_sub(KEPT);
        kept.drain(..surplus);
        if photons >= self.limit {
            self.last.store(generations, Ordering::Release);
        }
        self.published.store(Arc::new(kept));
        // Under the lock, so that a thread between its last check and its sleep cannot miss the notification.
        lock(&self.collecting).ready.remove(&newest.generations);
        self.news.notify_all();
        true
    }
}

/// Light paths that one thread traces for the map. If dropped without a deposit, they are handed to another thread.
#[derive(Debug)]
#[must_use]
pub struct Claim<'a> {
    map: &'a PhotonMap,
    paths: Range<u64>,
    adding: bool,
    done: bool,
}

impl Claim<'_> {
    /// Indices of the light paths.
    pub fn paths(&self) -> Range<u64> {
        self.paths.clone()
    }

    /// Deposits the photons of all of these light paths, in order. Leaves a merge that falls due to other threads soon after
    /// `wanted` returns false.
    pub fn deposit(mut self, batch: PhotonBatch, wanted: Wanted<'_>) {
        self.adding = true;
        self.map.add(self.paths(), batch, wanted);
        self.done = true;
    }
}

impl Drop for Claim<'_> {
    fn drop(&mut self) {
        if self.done {
            return;
        }
        if self.adding {
            // A panic, such as out of memory: the photons are lost, so the map must stop growing here.
            self.map.last.store(self.map.latest().generations, Ordering::Release);
            drop(lock(&self.map.collecting));
        } else {
            let mut collecting = lock(&self.map.collecting);
            collecting.returned.push(self.paths());
            // Stored under the lock, so that whoever sees the range sees the flag.
            self.map.returned.store(true, Ordering::Relaxed);
        }
        self.map.news.notify_all();
    }
}

/// The photon maps of Jensen's method, on surfaces and in media: one light path feeds all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PhotonLayer {
    /// The global map, for final gathering: all photons but caustic ones.
    Global = 0,
    /// The caustic map, for direct density estimation: photons that arrived over mirrors, glass and metal only, smooth or
    /// rough. These surfaces store no photons themselves.
    Caustic = 1,
    /// As `Global`, where light is scattered in a medium.
    VolumeGlobal = 2,
    /// As `Caustic`, where light is scattered in a medium.
    VolumeCaustic = 3,
}

const LAYERS: usize = 4;

impl PhotonLayer {
    /// This layer on surfaces, or in media.
    #[inline]
    pub fn of_media(self, in_medium: bool) -> Self {
        match (self, in_medium) {
            (Self::Global | Self::VolumeGlobal, true) => Self::VolumeGlobal,
            (Self::Caustic | Self::VolumeCaustic, true) => Self::VolumeCaustic,
            (Self::Global | Self::VolumeGlobal, false) => Self::Global,
            (Self::Caustic | Self::VolumeCaustic, false) => Self::Caustic,
        }
    }
}

/// Photons of one claim, in the order of their light paths.
#[derive(Debug, Default)]
pub struct PhotonBatch {
    positions: [Vec<Vec3>; LAYERS],
    photons: [Vec<Photon>; LAYERS],
}

impl PhotonBatch {
    /// Adds a photon. Returns false, and adds nothing, if [`Photon::new`] refuses it.
    pub fn push(&mut self, layer: PhotonLayer, arrival: &Arrival) -> bool {
        let Some(photon) = Photon::new(arrival) else { return false };
        self.positions[layer as usize].push(arrival.position);
        self.photons[layer as usize].push(photon);
        true
    }

    /// The positions of the photons of a layer, m.
    pub fn positions_of(&self, layer: PhotonLayer) -> &[Vec3] {
        &self.positions[layer as usize]
    }

    /// The positions of its photons, m.
    pub fn positions(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.positions.iter().flatten().copied()
    }

    fn append(&mut self, mut other: PhotonBatch) {
        for layer in 0..LAYERS {
            self.positions[layer].append(&mut other.positions[layer]);
            self.photons[layer].append(&mut other.photons[layer]);
        }
    }
}

/// All photons of the first generations. Immutable.
#[derive(Clone, Debug, Default)]
pub struct Snapshot {
    layers: [Forest; LAYERS],
    /// Number of generations.
    pub generations: u64,
    /// Number of light paths of these generations, by which the flux is to be divided.
    pub light_paths: u64,
}

impl Snapshot {
    /// The photons of a layer.
    #[inline]
    pub fn layer(&self, layer: PhotonLayer) -> &Forest {
        &self.layers[layer as usize]
    }
}
