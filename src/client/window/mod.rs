//! What a window needs besides the film: camera navigation, the panel, the frame plan. The only place below `app` that knows
//! winit and egui. Nothing here knows the server or the scene: `app/view` joins the two sides through plain data.

pub mod navigation;
pub mod panel;
