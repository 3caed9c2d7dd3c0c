//! What a window needs besides the film: mouse and keys, camera navigation, and the panel, which egui draws. Nothing here knows
//! the server or the scene: `viewer` joins the two sides through plain data.
//!
//! ```text
//! winit event ─ input ─ keys ─▶ Action ─▶ viewer ─▶ history ─▶ navigation::Pose ─▶ camera of the next epoch
//!       │                         ▲
//!       └─▶ host ─▶ panel::show ──┘ ◀── PanelData, PanelControls
//! ```
//!
//! [`action`] lists what the user can ask for; [`keys`] is the one table of keys; [`input`] turns mouse and keys into actions;
//! [`host`] runs egui in the window, and [`panel`] is what it draws; [`viewport`] knows which part of the picture is shown where;
//! [`statistics`] has the percentiles of recent values.

pub mod action;
pub mod history;
pub mod host;
pub mod input;
pub mod keys;
pub mod navigation;
pub mod panel;
pub mod panel_renderer;
pub mod statistics;
pub mod viewport;
