//! The panel: display controls and buttons, in a dock beside the picture. Pure egui over plain data: [`show()`] draws [`PanelData`], changes
//! [`PanelControls`] in place and returns the actions that the user asks for. Tools draw their own sections, figures and objects among them,
//! at the places that [`SectionPlace`] names.

mod controls;
mod data;
mod dialog;
mod dock;
pub(super) mod layout;
mod loading;
mod look;
mod maps;
mod over_picture;
mod palette;
mod plots;
mod sections;
mod show;
pub mod style;
mod tabs;
mod tools;
mod widgets;

pub use controls::PanelControls;
pub use data::*;
pub use dialog::FileChooser;
pub use layout::{PanelLayout, PanelTab, WIDTH};
pub use loading::{LoadingData, show_loading};
pub use over_picture::PictureArea;
pub use palette::CommandPalette;
pub use plots::{still_plot, trimmed};
pub use show::show;
pub use tools::{PanelTools, SectionPlace, ToolPresence};
pub use widgets::{choice, section};
