//! What the benchmarks share with the tests.

#![allow(dead_code, unused_imports, reason = "the tests use more of it")]

#[path = "../../tests/support/accel/mod.rs"]
pub mod accel;
#[path = "../../tests/support/agreement.rs"]
pub mod agreement;
#[path = "../../tests/support/audit.rs"]
pub mod audit;
#[path = "../../tests/support/desktop.rs"]
pub mod desktop;
#[path = "../../tests/support/largest.rs"]
pub mod largest;
#[path = "../../tests/support/proxy.rs"]
pub mod proxy;
#[path = "../../tests/support/scenes/mod.rs"]
pub mod scenes;
#[path = "../../tests/support/soak/mod.rs"]
pub mod soak;
#[path = "../../tests/support/spawned.rs"]
pub mod spawned;
#[path = "../../tests/support/welch.rs"]
pub mod welch;
#[path = "../../tests/support/xserver.rs"]
pub mod xserver;
