//! The program that `tools/fuzz` runs: libFuzzer around the target that the variable `POINTILLIST_FUZZ` names.
//!
//! One program for all targets, because each would link the whole library. An input fails by a panic, by a message without a place, by
//! holding more than [`MEMORY`], and by the time limit of libFuzzer. libFuzzer cannot bound memory itself without a sanitizer.

#![no_main]
#![allow(clippy::unwrap_used, reason = "a panic is the message")]

use std::path::PathBuf;
use std::sync::OnceLock;

use libfuzzer_sys::fuzz_target;

#[path = "../../../tests/support/held_memory.rs"]
mod held_memory;
#[path = "../../../tests/support/messages.rs"]
mod messages;
mod targets;

use targets::Target;

/// The target, and a folder of its own for files that it reads by name.
static TARGET: OnceLock<(&Target, PathBuf)> = OnceLock::new();

fn target() -> (&'static Target, PathBuf) {
    let name = std::env::var("POINTILLIST_FUZZ").unwrap_or_default();
    let target = targets::ALL.iter().find(|target| target.name == name);
    let target = target.unwrap_or_else(|| panic!("POINTILLIST_FUZZ={name} names none of the targets"));
    let folder = std::env::temp_dir().join(format!("pointillist-fuzz-{name}-{}", std::process::id()));
    targets::prepare(&folder);
    (target, folder)
}

fuzz_target!(|bytes: &[u8]| {
    let (target, folder) = TARGET.get_or_init(target);
    let start = held_memory::start();
    (target.read)(folder, bytes);
    let peak = held_memory::peak_since(start);
    assert!(peak < held_memory::MOST, "held {peak} bytes");
});
