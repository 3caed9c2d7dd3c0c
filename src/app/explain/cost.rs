//! What the client's effects cost: time of their passes, memory of their images.

use crate::app::bench::Measured;
use crate::app::plan::{Entry, Side};

/// Charges time and memory to the client's effects: `measured` with those that are on, `would` with as many as there are.
pub fn charge(plan: &mut [Entry], measured: &Measured, would: &Measured) {
    let passes = passes(measured);
    let all: f64 = passes.iter().map(|(_, ms)| ms).sum();
    for entry in plan.iter_mut().filter(|e| e.side == Side::Client) {
        let own = |name: &str| entry.images.iter().any(|image| name.starts_with(image));
        let memory = &measured.inventory.memory;
        entry.cost.bytes = Some(memory.iter().filter(|(name, _)| own(name)).map(|(_, bytes)| bytes).sum());
        let of = |passes: &[(&str, f64)]| -> Option<f64> {
            let own = passes.iter().filter(|(name, _)| entry.passes.contains(name));
            Some(own.map(|(_, ms)| ms).sum()).filter(|ms| *ms > 0.0)
        };
        if entry.on {
            entry.cost.milliseconds = of(&passes);
            entry.cost.share = entry.cost.milliseconds.map(|ms| ms / all);
        } else {
            entry.cost.if_on = of(&self::passes(would));
        }
    }
}

/// Median milliseconds of the passes that are not nested in others.
fn passes(measured: &Measured) -> Vec<(&str, f64)> {
    let median = |times: &[f64]| times.get(times.len() / 2).copied().unwrap_or(0.0);
    // The fold of the variance is part of its pass.
    let outer = |name: &str| !is_yardstick(name) && name != "variance fold";
    measured.passes.iter().filter(|(n, _)| outer(n)).map(|(n, times)| (*n, median(times))).collect()
}

/// What measures, and is no part of the picture.
pub fn is_yardstick(name: &str) -> bool {
    name.starts_with("copy")
}
