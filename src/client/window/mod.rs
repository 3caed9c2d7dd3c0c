//! Window support besides the film: mouse and keyboard input, camera navigation, and the egui panel. Independent of server and scene:
//! `viewer` connects both sides through plain data.
//!
//! ```text
//! winit event ─ input ─ keys ─▶ UserAction ─▶ viewer ─▶ history ─▶ navigation::Pose ─▶ camera of the next epoch
//!       │                         ▲
//!       └─▶ host ─▶ panel::show ──┘ ◀── PanelData, PanelControls, PanelTools
//! ```
//!
//! [`action`] lists the user actions of the window itself; those of its tools are of a type that the viewer defines. [`keys`] is the table of
//! key bindings, to which tools add theirs; [`input`] converts mouse and key events to actions; [`host`]
//! runs egui in the window, and [`panel`] draws it; [`viewport`] maps the visible part of the picture to the window; [`statistics`]
//! computes percentiles of recent values.

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
