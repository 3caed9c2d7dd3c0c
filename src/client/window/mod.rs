//! What a window needs besides the film: camera navigation, the panel, the frame plan. The only place below `app` that knows
//! winit and egui. Nothing here knows the server or the scene: `app/view` joins the two sides through plain data.
//!
//! ```text
//! winit event ─input (keys)─▶ Intent ─┬─ Gesture ─history─▶ navigation::Pose ─▶ camera of the next epoch
//!                                     └─ Action  ◀─panel::show── Readout, Controls
//! presented frames, edits ─statistics─▶ Readout
//! ```

pub mod history;
pub mod input;
pub mod keys;
pub mod navigation;
pub mod panel;
pub mod statistics;
