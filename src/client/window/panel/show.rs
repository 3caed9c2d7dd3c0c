//! Draws the whole panel.

use egui::{Align2, Ui};

use crate::client::window::action::UserAction;
use crate::client::window::keys::KeyTable;
use crate::client::window::panel::controls::PanelControls;
use crate::client::window::panel::data::PanelData;
use crate::client::window::panel::over_picture::{self, GAP, PictureArea};
use crate::client::window::panel::tools::PanelTools;
use crate::client::window::panel::{dock, maps, palette, sections, style};

/// Draws the panel; returns the actions that the user asks for in the dock and in the palette, in order. Those that tools ask for while they are
/// drawn stand in their own queue.
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
        over_picture::corner(&ctx, picture.area, "message", Align2::CENTER_BOTTOM, |ui, room| {
            ui.set_max_width(room.x - 2.0 * GAP);
            ui.colored_label(style::BRIGHT, message);
        });
    }
    if controls.help {
        sections::keys(&ctx, &mut controls.help, keys);
    }
    let command = palette::show(&ctx, &mut controls.palette, keys);
    actions.into_iter().map(UserAction::Window).chain(command).collect()
}
