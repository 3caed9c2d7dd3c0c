//! What the client's effects cost: time of their passes, memory of their images; and what those that are off would cost.

use miette::Result;

use crate::app::bench::Measured;
use crate::app::plan::PlannedEffect;
use crate::client::Settings;
use crate::client::effect_list::ClientEffect;
use crate::gpu::Inventory;
use crate::scene::desc::IntegratorKind;

/// Charges time and memory to the client's effects. `measure` runs frames with these settings by this method; it is called for
/// what is asked for, and once for every effect that is switched to see the difference. Returns what the first run had on the
/// device.
///
/// # Errors
///
/// Those of `measure`.
pub fn charge(
    plan: &mut [PlannedEffect],
    (settings, kind): (&Settings, IntegratorKind),
    mut measure: impl FnMut(&Settings, IntegratorKind) -> Result<Measured>,
) -> Result<Inventory> {
    let base = measure(settings, kind)?;
    let all = time_of(&base, |_| true);
    for entry in plan {
        let Some(listed) = &entry.listed else { continue };
        let &ClientEffect { passes, changes, images, can_switch, .. } = listed;
        let other = match entry.name {
            "light-stream" if !entry.on => Some(measure(settings, IntegratorKind::Bidirectional)?),
            // The variance comes with what reads it.
            "variance" if !entry.on => Some(measure(&switched(settings, "masking", true), kind)?),
            name if can_switch && (!entry.on || !changes.is_empty()) => {
                Some(measure(&switched(settings, name, !entry.on), kind)?)
            }
            _ => None,
        };
        let [own, changed] = [passes, changes].map(|names| {
            let of = |measured| time_of(measured, |name| names.contains(&name));
            (of(&base), other.as_ref().map_or(0.0, of))
        });
        let cost = &mut entry.cost;
        let something = |ms: f64| Some(ms).filter(|ms| *ms > 0.0);
        if entry.on {
            let changed = if other.is_some() { changed.0 - changed.1 } else { 0.0 };
            cost.milliseconds = something(own.0 + changed);
            cost.share = cost.milliseconds.map(|ms| ms / all);
        } else if other.is_some() {
            cost.if_on = something(own.1 + changed.1 - changed.0);
        }
        let of_its_own = |name: &str| entry.on && images.iter().any(|image| name.starts_with(image));
        let memory = base.inventory.memory.iter().filter(|(name, _)| of_its_own(name));
        cost.bytes = Some(memory.map(|(_, bytes)| bytes).sum());
    }
    Ok(base.inventory)
}

fn switched(settings: &Settings, effect: &str, on: bool) -> Settings {
    let mut settings = settings.clone();
    settings.switch(effect, on);
    settings
}

/// Median milliseconds per frame of the passes of which `is` holds, without those that are nested in others.
fn time_of(measured: &Measured, is: impl Fn(&str) -> bool) -> f64 {
    let median = |times: &[f64]| times.get(times.len() / 2).copied().unwrap_or(0.0);
    // The fold of the variance is part of its pass.
    let counts = |name: &str| !is_yardstick(name) && name != "variance fold" && is(name);
    measured.passes.iter().filter(|(name, _)| counts(name)).map(|(_, times)| median(times)).sum()
}

/// What measures, and is no part of the picture.
pub fn is_yardstick(name: &str) -> bool {
    name.starts_with("copy")
}
