//! The panel: display controls, figures, the selected object, and buttons, in a dock beside the picture. Pure egui over plain data:
//! [`show`] draws [`PanelData`], changes [`PanelControls`] in place and returns the actions that the user asks for. Tools draw their own
//! sections at the places that [`SectionPlace`] names.

mod controls;
mod data;
mod dialog;
mod dock;
mod error;
mod figures;
mod loading;
mod look;
mod maps;
mod over_picture;
mod palette;
mod sections;
pub mod style;
mod tabs;
mod tools;

pub use controls::choice;
pub use data::*;
pub use dialog::FileChooser;
pub use dock::{PanelLayout, PanelTab, WIDTH};
pub use loading::{LoadingData, show_loading};
pub use over_picture::PictureArea;
pub use palette::CommandPalette;
pub use sections::parameters;
pub use tabs::section;
pub use tools::{PanelTools, SectionPlace, ToolPresence};

use egui::{Align2, Ui, Vec2};

use egui_plot::Plot;

use crate::client::settings::{Settings, SplatFilter};
use crate::client::window::action::{Action, UserAction};
use crate::client::window::keys::KeyTable;
use crate::color::Profile;

/// Controls that the user changes in the panel.
#[derive(Debug)]
pub struct PanelControls {
    /// Display settings; a change of them never restarts the server.
    pub settings: Settings,
    /// Auto-exposure, until the user sets an exposure.
    pub auto_exposure: bool,
    /// Splat filter; a change refills the film from the retained samples.
    pub filter: SplatFilter,
    /// Profile read from a file, kept so that it can be selected again.
    pub own_profile: Option<Profile>,
    /// The dock: whether it is open, how wide, which tabs.
    pub layout: PanelLayout,
    /// Whether the list of keys is shown.
    pub help: bool,
    /// The palette of commands.
    pub palette: CommandPalette,
    /// The dialog that asks for a scene to open.
    pub open_dialog: FileChooser,
    /// The dialog that asks for a name to save under.
    pub save_dialog: FileChooser,
    /// Whether the panel takes the keyboard focus with the next run.
    pub enters: bool,
    /// Error target: relative error that 95 % of the picture shall stay below.
    pub target: f64,
}

/// Distance of overlays from the edges of the picture area, points.
const GAP: f32 = 8.0;

impl PanelControls {
    /// Whether the palette or a file dialog is open, which takes all keys.
    pub fn is_modal(&self) -> bool {
        self.palette.is_open || self.open_dialog.is_open() || self.save_dialog.is_open()
    }
}

/// Draws the panel; returns the user's actions but for those of the tools, in order.
///
/// Numbers change at most ten times a second, so that they can be read; everything else is as recent as `data`.
pub fn show<T: Clone>(
    ui: &mut Ui,
    data: &PanelData,
    controls: &mut PanelControls,
    tools: &mut dyn PanelTools,
    keys: &KeyTable<T>,
) -> Vec<UserAction<T>> {
    let ctx = ui.ctx().clone();
    style::apply(&ctx);
    let mut actions = Vec::new();
    let area = dock::show(ui, data, controls, tools, &mut actions);
    let picture = PictureArea { area, view: data.view };
    maps::show(&ctx, picture, &data.overlay);
    tools.over_picture(&ctx, picture);
    over_picture::show(&ctx, picture);
    if let Some(message) = &data.message {
        dock::corner(&ctx, picture.area, "message", Align2::CENTER_BOTTOM, |ui, room| {
            ui.set_max_width(room.x - 2.0 * GAP);
            ui.colored_label(style::BRIGHT, message);
        });
    }
    if controls.help {
        sections::keys(&ctx, &mut controls.help, keys);
    }
    actions.extend(controls.open_dialog.show(&ctx).map(Action::Open));
    actions.extend(controls.save_dialog.show(&ctx).map(Action::SaveAs));
    let command = palette::show(&ctx, &mut controls.palette, keys);
    actions.into_iter().map(UserAction::Window).chain(command).collect()
}

/// A plot of this height, in points, with fixed bounds that the pointer does not move.
pub fn still_plot(id: &str, height: f32) -> Plot<'static> {
    Plot::new(id)
        .height(height)
        .show_x(false)
        .show_y(false)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_axis_zoom_drag(false)
        .allow_double_click_reset(false)
        .set_margin_fraction(Vec2::ZERO)
        .auto_bounds(false)
}

/// Writes a number with this many decimals, without trailing zeros.
pub fn trimmed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    if decimals == 0 { text } else { text.trim_end_matches('0').trim_end_matches('.').to_owned() }
}
