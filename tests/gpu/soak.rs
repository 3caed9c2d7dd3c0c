//! A short soak: `tools/bench soak` is the long one.

use std::time::Duration;

use crate::support::place::root;
use crate::unrest::{Conservation, SoakPlan, soak};

/// Twenty seconds of edits, aborts, resizes, reloads, lost devices, exhausted memory, bad samples, slow clients and workers that panic: every
/// sample is accounted for, and pictures are those of undisturbed renders, bit for bit.
#[test]
fn nothing_is_lost_in_twenty_seconds() {
    let scene = |name: &str| root().join("scenes").join(name);
    let plan = SoakPlan {
        time: Duration::from_secs(20),
        seed: 18,
        threads: 2,
        scenes: vec![scene("cornell_spheres.xml")],
        full_disk: None,
        validation: true,
    };
    let report = soak(&plan, |_, _| {});
    println!("{:?}\n{:?}, {} pictures", report.acts, report.conservation, report.pictures);
    assert!(report.faults.is_empty(), "{}", report.faults.join("\n"));
    let Conservation { made, rejected, discarded, sent, stale, accepted } = report.conservation;
    assert_eq!((made, sent), (rejected + discarded + sent, stale + accepted));
    assert_eq!(report.validation_messages, 0);
    assert!(report.pictures >= 4 && rejected > 0, "{report:?}");
}
