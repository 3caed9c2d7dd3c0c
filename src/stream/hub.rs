//! The state that both ends of the stream share: which epoch may run, and the two wake-up signals.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use crate::stream::control::Epoch;
use crate::stream::signal::Signal;

/// Instead of an epoch: nothing may run.
const NONE: u64 = u64::MAX;

/// The state that both ends of the lanes share.
#[derive(Debug)]
pub struct Hub {
    /// The epoch that may run at this moment, or [`NONE`].
    running: AtomicU64,
    /// Rung when a slot becomes free or `running` changes. Parked workers wait for it.
    pub(super) space: Signal,
    /// Rung when a block or an event arrives. The consumer waits for it.
    pub(super) data: Signal,
    /// The newest epoch whose render has ended, or 0.
    ended: AtomicU64,
    /// Counts calls of [`Hub::announce`] and [`Hub::end`].
    pub(super) events: AtomicU64,
    /// The consumer's end is gone.
    closed: AtomicBool,
}

impl Default for Hub {
    fn default() -> Self {
        Self {
            running: AtomicU64::new(NONE),
            space: Signal::default(),
            data: Signal::default(),
            ended: AtomicU64::new(0),
            events: AtomicU64::new(0),
            closed: AtomicBool::new(false),
        }
    }
}

impl Hub {
    /// True while `epoch` may run. Workers ask between two paths: it costs one relaxed load.
    #[inline]
    pub fn is_running(&self, epoch: Epoch) -> bool {
        let running = self.running.load(Ordering::Relaxed);
        running == epoch.0 && running != NONE
    }

    /// True while nothing may run.
    pub fn is_idle(&self) -> bool {
        self.running.load(Ordering::Relaxed) == NONE
    }

    /// Lets `epoch` run, or nothing, and wakes parked workers. Nothing runs once the consumer is gone.
    pub fn run(&self, epoch: Option<Epoch>) {
        self.running.store(epoch.map_or(NONE, |epoch| epoch.0), Ordering::SeqCst);
        if self.closed.load(Ordering::SeqCst) {
            // This load comes after the store above: whichever of `run` and `close` comes second, nothing runs.
            self.running.store(NONE, Ordering::SeqCst);
        }
        self.space.ring();
    }

    /// Stops `epoch` if it is the one that runs.
    pub fn stop(&self, epoch: Epoch) {
        // The exchange fails when another epoch runs already. Then there is nothing to stop.
        let _ = self.running.compare_exchange(epoch.0, NONE, Ordering::SeqCst, Ordering::SeqCst);
        self.space.ring();
    }

    /// Declares that every block of `epoch` is in the lanes. The producer calls it once its last worker is done.
    pub fn end(&self, epoch: Epoch) {
        self.ended.fetch_max(epoch.0, Ordering::Release);
        self.announce();
    }

    /// Wakes the consumer from [`Lanes::wait`](crate::stream::Lanes::wait), because an event waits for it.
    pub fn announce(&self) {
        self.events.fetch_add(1, Ordering::SeqCst);
        self.data.ring();
    }

    /// True once [`Hub::end`] was called for `epoch` or a newer one. All blocks of `epoch` are visible then.
    pub(super) fn has_ended(&self, epoch: Epoch) -> bool {
        self.ended.load(Ordering::Acquire) >= epoch.0
    }

    pub(super) fn close(&self) {
        self.closed.store(true, Ordering::SeqCst);
        self.run(None);
    }
}
