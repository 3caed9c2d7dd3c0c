//! Who computes on which cores.

use crate::gpu::DeviceKind;

/// Part of the processor that the display is planned to take where it has no device of its own, in percent. A sample of the
/// Cornell box costs half as much again to draw with lavapipe as to trace; pictures and panel take the rest.
const DISPLAY_PERCENT: u32 = 65;

/// The plan by which tracer and display share the processor, in words.
///
/// As many threads trace as there are cores (or as the user asks for), in the background of everything else. A device of its
/// own leaves the processor to them: the loop needs little. Where the device is the processor (lavapipe), its driver draws
/// on all cores at once, so that an edit is shown soonest, and the tracer has them between.
pub fn plan(threads: usize, device: DeviceKind) -> String {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    if device == DeviceKind::Cpu {
        format!(
            "{threads} threads trace on {cores} cores while the display leaves them: it draws on the processor, \
             {DISPLAY_PERCENT} % planned"
        )
    } else {
        format!("{threads} threads trace on {cores} cores; the display has a device of its own")
    }
}
