//! Who computes on which cores.

use crate::app::device::CPU;
use crate::gpu::{self, DeviceKind};

/// Part of the processor that the display is planned to take where it has no device of its own, in percent. A sample of the
/// Cornell box costs half as much again to draw with lavapipe as to trace; pictures and panel take the rest.
const DISPLAY_PERCENT: u32 = 65;

/// How tracer and display share the processor.
#[derive(Clone, Debug)]
pub struct Cores {
    /// Threads that trace.
    pub tracing: usize,
    /// The plan in words, for people.
    pub words: String,
}

impl Cores {
    /// Shares `cores` cores. `threads` is what the user asked for.
    ///
    /// As many threads trace as there are cores, in the background of everything else. A device of its own leaves the
    /// processor to them: the loop needs little. Where the device is the processor (lavapipe), its driver draws on all
    /// cores at once, so that an edit is shown soonest, and the tracer has them between.
    pub fn plan(cores: usize, threads: Option<usize>, device: Option<&str>) -> Self {
        let tracing = threads.unwrap_or(cores).max(1);
        let words = if is_processor(device) {
            format!(
                "{tracing} of {cores} cores trace while the display leaves them: it draws on the processor, {DISPLAY_PERCENT} % planned"
            )
        } else {
            format!("{tracing} of {cores} cores trace; the display has a device of its own")
        };
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
