//! Who computes on which cores.

use crate::app::device::CPU;
use crate::gpu::{self, DeviceKind};

/// How tracer and display share the processor.
#[derive(Clone, Debug)]
pub struct Cores {
    /// Threads that trace.
    pub tracing: usize,
    /// The plan in words, for people.
    pub words: String,
}

impl Cores {
    /// Shares `cores` cores, before any thread starts. `threads` is what the user asked for.
    ///
    /// A device of its own leaves the processor to the tracer: the loop needs little. Where the device is the processor
    /// (lavapipe), a quarter of the cores, at least one, is the display's, and the driver is told to use no more.
    pub fn plan(cores: usize, threads: Option<usize>, device: Option<&str>) -> Self {
        if !is_processor(device) {
            let tracing = threads.unwrap_or(cores).max(1);
            let words = format!("{tracing} of {cores} cores trace; the display has a device of its own");
            return Self { tracing, words };
        }
        let display = cores.div_ceil(4);
        let tracing = threads.unwrap_or(cores - display).max(1);
        let display = gpu::reserve_driver_threads(cores.saturating_sub(tracing).max(1));
        let over = if tracing + display > cores { ", which is more than there are" } else { "" };
        let words = format!(
            "{tracing} tracing and {display} displaying on {cores} cores{over}: the device is the processor"
        );
        Self { tracing, words }
    }
}

/// True when the device that will be taken computes on the processor.
fn is_processor(wish: Option<&str>) -> bool {
    let Ok(devices) = gpu::devices() else { return false };
    let by_wish = wish.filter(|wish| *wish != CPU).and_then(|wish| {
        let lower = wish.to_lowercase();
        devices.iter().find(|d| d.index.to_string() == lower || d.name.to_lowercase().contains(&lower))
    });
    let best = || devices.iter().filter(|d| d.is_suitable()).min_by_key(|d| d.kind);
    by_wish.or_else(best).is_some_and(|d| d.kind == DeviceKind::Cpu)
}
