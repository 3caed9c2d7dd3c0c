//! Timestamps by named scope, read only after their frame has completed.

use std::sync::atomic::Ordering;

use ash::vk;

use crate::gpu::commands::cmd::Cmd;
use crate::gpu::device::Gpu;
use crate::gpu::error::{GpuError, Named};
use crate::gpu::timing::rows::{FrameTimes, Readings};

/// Timestamps per frame: twice the number of scopes; further scopes of a frame are counted as untimed.
const QUERIES: u32 = 256;

/// The sum of one scope's runs.
#[derive(Clone, Debug, PartialEq)]
pub struct ScopeTime {
    /// Name given to [`Cmd::scope`].
    pub name: &'static str,
    /// How often it ran.
    pub count: u64,
    /// Time between its first and last command, milliseconds, summed over the runs.
    pub milliseconds: f64,
}

/// The timestamps of one frame in flight.
pub(in crate::gpu) struct Timers {
    pool: vk::QueryPool,
    /// Nanoseconds per step; 0 where there are no timestamps.
    tick: f32,
    /// Name and depth of each scope; its timestamps are 2i and 2i + 1.
    scopes: Vec<(&'static str, u32)>,
    /// Open scopes.
    depth: u32,
    /// Scopes for which no timestamps were left.
    untimed: u32,
    on: bool,
}

impl Timers {
    pub fn new(device: &ash::Device, tick: f32) -> Result<Self, GpuError> {
        let info =
            vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(QUERIES);
        // SAFETY: no feature is needed for timestamps.
        let pool = unsafe { device.create_query_pool(&info, None) }.named("vkCreateQueryPool")?;
        Ok(Self { pool, tick, scopes: Vec::new(), depth: 0, untimed: 0, on: false })
    }

    /// Names the pool of frame `i`.
    pub fn name(&self, gpu: &Gpu, i: usize) {
        gpu.name(self.pool, &format!("frame {i} timestamps"));
    }

    /// Forgets the last frame's scopes. The frame must have completed.
    pub fn restart(&mut self, device: &ash::Device, on: bool) {
        self.scopes.clear();
        (self.depth, self.untimed) = (0, 0);
        self.on = on && self.tick > 0.0;
        if self.on {
            // SAFETY: hostQueryReset is enabled, and the frame that used the pool has completed.
            unsafe { device.reset_query_pool(self.pool, 0, QUERIES) };
        }
    }

    /// Adds the scopes of the completed frame `times` to `readings` and forgets them.
    pub fn read(&mut self, device: &ash::Device, mut times: FrameTimes, readings: &mut Readings) {
        if self.scopes.is_empty() {
            return;
        }
        let mut ticks = vec![0_u64; 2 * self.scopes.len()];
        // SAFETY: the frame has completed, so every timestamp of it has been written.
        let read =
            unsafe { device.get_query_pool_results(self.pool, 0, &mut ticks, vk::QueryResultFlags::TYPE_64) };
        let scopes = std::mem::take(&mut self.scopes);
        times.untimed = std::mem::take(&mut self.untimed);
        if read.is_err() {
            return;
        }
        let runs =
            scopes.iter().zip(ticks.chunks_exact(2)).map(|((name, depth), t)| (*name, *depth, [t[0], t[1]]));
        for (name, _, [start, end]) in runs.clone() {
            let milliseconds = end.saturating_sub(start) as f64 * f64::from(self.tick) * 1e-6;
            match readings.totals.iter_mut().find(|t| t.name == name) {
                Some(total) => {
                    total.count += 1;
                    total.milliseconds += milliseconds;
                }
                None => readings.totals.push(ScopeTime { name, count: 1, milliseconds }),
            }
        }
        readings.frame(times, runs);
    }

    /// # Safety
    ///
    /// The device is idle.
    pub unsafe fn destroy(self, device: &ash::Device) {
        // SAFETY: the caller promises that nothing is pending.
        unsafe { device.destroy_query_pool(self.pool, None) };
    }
}

/// Names the GPU work recorded while it lives; closing is dropping, so a scope cannot leak.
/// Dereferences to the [`Cmd`] that it borrows.
pub struct Scope<'c, 'f> {
    cmd: &'c mut Cmd<'f>,
    end: Option<u32>,
}

impl<'f> Cmd<'f> {
    /// Opens a label and, when timing is on, a pair of timestamps. Scopes may nest.
    #[must_use = "the scope ends when the guard is dropped"]
    pub fn scope<'c>(&'c mut self, name: &'static str) -> Scope<'c, 'f> {
        self.begin_label(name);
        let first = 2 * self.timers.scopes.len() as u32;
        let end = (self.timers.on && first + 2 <= QUERIES).then_some(first + 1);
        if end.is_some() {
            let depth = self.timers.depth;
            self.timers.scopes.push((name, depth));
            self.timestamp(first);
        } else if self.timers.on {
            self.timers.untimed += 1;
        }
        self.timers.depth += 1;
        Scope { cmd: self, end }
    }

    fn timestamp(&mut self, query: u32) {
        self.gpu.queries.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the query was reset when the frame began and is written once.
        unsafe {
            self.gpu.device.cmd_write_timestamp2(
                self.raw,
                vk::PipelineStageFlags2::ALL_COMMANDS,
                self.timers.pool,
                query,
            );
        }
    }
}

impl Drop for Scope<'_, '_> {
    fn drop(&mut self) {
        if let Some(query) = self.end {
            self.cmd.timestamp(query);
        }
        self.cmd.timers.depth -= 1;
        self.cmd.end_label();
    }
}

impl<'f> std::ops::Deref for Scope<'_, 'f> {
    type Target = Cmd<'f>;

    fn deref(&self) -> &Cmd<'f> {
        self.cmd
    }
}

impl<'f> std::ops::DerefMut for Scope<'_, 'f> {
    fn deref_mut(&mut self) -> &mut Cmd<'f> {
        self.cmd
    }
}
