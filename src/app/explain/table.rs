//! The plan for people.

use std::fmt::Write;

use crate::app::plan::{Entry, Side};

/// One line for each effect, the tracer's first.
pub fn table(plan: &[Entry]) -> String {
    let mut out = String::new();
    for (side, title) in [
        (Side::Tracer, "TRACER            on   share of tracing time saved without it"),
        (Side::Client, "CLIENT            on   share of device time, ms per frame, device memory of its own"),
    ] {
        // Writing to a string does not fail.
        let _ = writeln!(out, "{title}");
        for entry in plan.iter().filter(|e| e.side == side) {
            let on = if entry.on { "yes" } else { "–" };
            let cost = cost(entry);
            let _ = write!(out, "  {:<16}{on:<4} {cost:<26}{}", entry.effect, entry.reason);
            match &entry.place {
                Some(place) => {
                    let _ = writeln!(out, "  ({place})");
                }
                None => out.push('\n'),
            }
        }
    }
    out
}

fn cost(entry: &Entry) -> String {
    let cost = &entry.cost;
    let share = cost.share.map(|s| format!("{:5.1} %", 100.0 * s));
    let if_on = cost.if_on.map(|ms| format!("would take {ms:.2} ms"));
    let ms = cost.milliseconds.map(|ms| format!("{ms:.2} ms"));
    let bytes = cost.bytes.filter(|b| *b > 0).map(|b| format!("{:.1} MB", b as f64 * 1e-6));
    [share, ms, if_on, bytes].into_iter().flatten().collect::<Vec<_>>().join("  ")
}
