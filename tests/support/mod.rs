//! What several test programs share. Every `main.rs` takes it with `#[path = "../support/mod.rs"] mod support;`.

#![allow(dead_code, unused_imports, reason = "each test program uses a part")]

pub mod accel;
pub mod agreement;
pub mod audit;
pub mod bmp;
pub mod bsdfs;
pub mod desktop;
pub mod device;
pub mod glare;
pub mod largest;
pub mod models;
pub mod place;
pub mod proxy;
pub mod scenes;
pub mod spawned;
pub mod synthetic;
pub mod welch;
pub mod xserver;
