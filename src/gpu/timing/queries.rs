//! The timestamp queries of one frame in flight.

use ash::vk;

use crate::gpu::error::{GpuError, Named};
use crate::gpu::timing::rows::{FrameTimes, Readings};

/// Timestamps per frame, two per scope; scopes beyond are counted as untimed.
const QUERIES: u32 = 256;

/// The timestamps of one frame in flight.
pub(in crate::gpu) struct Timers {
    pub pool: vk::QueryPool,
    /// Whether the queue has timestamps.
    stamps: bool,
    /// Name and depth of each scope, whose timestamps are 2i and 2i + 1. Without timestamps, only scopes of depth 0.
    scopes: Vec<(&'static str, u32)>,
    /// Number of open scopes.
    depth: u32,
    /// Number of scopes without timestamps left.
    untimed: u32,
    on: bool,
}

impl Timers {
    pub fn new(device: &ash::Device, stamps: bool) -> Result<Self, GpuError> {
        let info =
            vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(QUERIES);
        // SAFETY: no feature is needed for timestamps.
        let pool = unsafe { device.create_query_pool(&info, None) }.named("vkCreateQueryPool")?;
        Ok(Self { pool, stamps, scopes: Vec::new(), depth: 0, untimed: 0, on: false })
    }

    /// Resets for another frame. The previous one must have completed.
    pub fn restart(&mut self, device: &ash::Device, on: bool) {
        self.scopes.clear();
        (self.depth, self.untimed) = (0, 0);
        self.on = on;
        if self.on && self.stamps {
            // SAFETY: hostQueryReset is enabled, and the frame that used the pool has completed.
            unsafe { device.reset_query_pool(self.pool, 0, QUERIES) };
        }
    }

    /// Opens a scope; returns the index of its first timestamp query, or `None` if it is not timed. The second query follows.
    pub fn open(&mut self, name: &'static str) -> Option<u32> {
        let first = 2 * self.scopes.len() as u32;
        let wanted = self.on && (self.stamps || self.depth == 0);
        let timed = wanted && first + 2 <= QUERIES;
        if timed {
            self.scopes.push((name, self.depth));
        }
        self.untimed += u32::from(wanted && !timed);
        self.depth += 1;
        (timed && self.stamps).then_some(first)
    }

    /// Closes the innermost scope.
    pub fn close(&mut self) {
        self.depth -= 1;
    }

    /// Adds the scopes of the completed frame `times` to `readings` and clears them.
    pub fn read(&mut self, device: &ash::Device, mut times: FrameTimes, readings: &mut Readings) {
        if self.scopes.is_empty() {
            return;
        }
        let scopes = std::mem::take(&mut self.scopes);
        times.untimed = std::mem::take(&mut self.untimed);
        if !self.stamps {
            let names: Vec<_> = scopes.iter().map(|(name, _)| *name).collect();
            return readings.frame_of_host(times, &names);
        }
        let mut ticks = vec![0_u64; 2 * scopes.len()];
        // SAFETY: the frame has completed, so every timestamp of it has been written.
        let read =
            unsafe { device.get_query_pool_results(self.pool, 0, &mut ticks, vk::QueryResultFlags::TYPE_64) };
        if read.is_ok() {
            let runs = scopes.iter().zip(ticks.chunks_exact(2));
            readings.frame(times, runs.map(|((name, depth), t)| (*name, *depth, [t[0], t[1]])));
        }
    }

    /// # Safety
    ///
    /// The device is idle.
    pub unsafe fn destroy(self, device: &ash::Device) {
        // SAFETY: the caller promises that nothing is pending.
        unsafe { device.destroy_query_pool(self.pool, None) };
    }
}
