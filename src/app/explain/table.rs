//! The plan for people.

use std::fmt::Write;

use crate::app::plan::{EffectSide, PlannedEffect};

/// One line for each effect, the tracer's first.
pub fn table(plan: &[PlannedEffect]) -> String {
    let mut out = String::new();
    // Writing to a string does not fail.
    for (side, title) in [
        (
            EffectSide::Tracer,
            "TRACER            on   cost: share of a path's time; × is its time with a small example of what is off",
        ),
        (
            EffectSide::Client,
            "CLIENT            on   cost: share of device time, per frame, device memory of its own",
        ),
    ] {
        let entries = || plan.iter().filter(|e| e.side == side);
        let width = entries().map(|e| cost(e).chars().count()).max().unwrap_or(0);
        let _ = writeln!(out, "{title}");
        for entry in entries() {
            let on = if entry.on { "yes" } else { "–" };
            let _ = write!(out, "  {:<16}{on:<5}{:<width$}  {}", entry.name, cost(entry), entry.reason);
            let _ = match &entry.place {
                Some(place) => writeln!(out, "  ({place})"),
                None => writeln!(out),
            };
        }
    }
    if plan.iter().all(|e| e.cost.bytes.is_none()) {
        out += "  (the client's costs are measured on a Vulkan device)\n";
    }
    out
}

fn cost(entry: &PlannedEffect) -> String {
    let cost = &entry.cost;
    let share = cost.share.map(|s| format!("{:5.1} %", 100.0 * s));
    let ms = cost.milliseconds.map(|ms| format!("{ms:.2} ms"));
    let bytes = cost.bytes.filter(|b| *b > 0).map(|b| format!("{:.1} MB", b as f64 * 1e-6));
    let if_on = cost.if_on.map(|ms| format!("would take {ms:.2} ms"));
    let if_on_share = cost.if_on_share.map(|s| format!("with it ×{:.2}", 1.0 + s));
    [share, ms, bytes, if_on, if_on_share].into_iter().flatten().collect::<Vec<_>>().join("  ")
}
