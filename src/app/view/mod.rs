//! `pointillist view`: the window, always interactive, whatever the tracer is doing (paper §4.2, Figure 1).
//!
//! One thread runs the loop; the server's workers trace beside it and are never waited for.
//!
//! ```text
//!            ┌──────────────────────────────── frame ───────────────────────────────┐
//!  winit ──▶ messages ──▶ read samples ──▶ rasterise them ──▶ repaint ──▶ panel ──▶ swap
//!            user, server  lanes, kept        film             film      overlay  swapchain
//!                 │ edit: next epoch
//!                 ▼
//!  server ── workers ──▶ lanes
//! ```
//!
//! [`handler`] hears winit and decides when a frame is due; [`frame`] reads like the paper's list; [`session`] is the server's
//! side, [`screen`] the device's; [`user`] the camera and what was edited; [`ui`] the panel; [`watching`] the error and the
//! maps; [`ending`] what is left behind.

mod actions;
mod cores;
mod costs;
mod ending;
mod figures;
mod frame;
mod handler;
mod refit;
mod saving;
mod screen;
mod session;
mod start;
mod ui;
mod user;
mod viewer;
mod watching;

pub use start::view;
