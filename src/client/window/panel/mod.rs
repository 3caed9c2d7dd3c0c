//! The panel: display controls, figures, the selected object, and buttons. Pure egui over plain data: [`show`] draws
//! [`PanelData`], changes [`PanelControls`] in place and returns the [`Action`]s that the user asks for.

mod controls;
mod data;
mod error;
mod figures;
mod loading;
mod maps;
mod sections;
pub mod style;

pub use data::*;
pub use loading::{LoadingData, show_loading};

use egui::{
    Align2, Area, CollapsingHeader, Context, Frame, Id, Margin, Order, RichText, ScrollArea, Ui, Vec2,
};

use egui_plot::Plot;

use crate::client::settings::{Settings, SplatFilter};
use crate::client::window::action::Action;
use crate::color::Profile;

/// What the user changes in the panel.
#[derive(Clone, Debug)]
pub struct PanelControls {
    /// Display settings; a change of them never restarts the server.
    pub settings: Settings,
    /// The exposure follows the light of the scene, until the user chooses one.
    pub follow_light: bool,
    /// Splat filter; a change of it starts the film anew from the kept samples.
    pub filter: SplatFilter,
    /// The profile that was read from a file, so that it can be chosen again after another one.
    pub own_profile: Option<Profile>,
    /// Whether the panel is shown.
    pub visible: bool,
    /// Whether the list of keys is shown.
    pub help: bool,
    /// The map that is shown over the picture.
    pub map: MapChoice,
    /// Target error: the relative error that 95 % of the picture shall stay below.
    pub target: f64,
}

/// Width of the contents, points.
const WIDTH: f32 = 292.0;
/// Distance from the window's edge, points.
const GAP: f32 = 8.0;

/// Draws the panel; returns the actions that the user asks for, in order.
///
/// Figures change at most ten times a second, so that they can be read; everything else is as fresh as `data`.
pub fn show(ui: &mut Ui, data: &PanelData, controls: &mut PanelControls) -> Vec<Action> {
    let ctx = ui.ctx().clone();
    style::apply(&ctx);
    let mut actions = Vec::new();
    maps::show(&ctx, &data.overlay);
    if let Some(message) = &data.message {
        corner(&ctx, "message", Align2::CENTER_BOTTOM, |ui, room| {
            ui.set_max_width(room.x - 2.0 * GAP);
            ui.colored_label(style::BRIGHT, message);
        });
    }
    if controls.help {
        sections::keys(&ctx, &mut controls.help);
    }
    if !controls.visible {
        return actions;
    }
    let settled = figures::settled(&ctx, data);
    sheet(&ctx, |ui| {
        if let Some(selection) = &data.selection {
            section(ui, "Selection", true, |ui| sections::selection(ui, selection, &mut actions));
        }
        section(ui, "Error", true, |ui| error::show(ui, data.error.as_deref(), &mut controls.target));
        section(ui, "Figures", true, |ui| figures::show(ui, &settled, &mut actions));
        section(ui, "Display", true, |ui| controls::show(ui, controls));
        section(ui, "Effects", false, |ui| {
            sections::effects(ui, &data.effects, data.costs, &mut actions);
        });
        sections::left_out(ui, &data.left_out);
        if data.rejected.total > 0 {
            section(ui, &format!("Rejected: {}", data.rejected.total), false, |ui| {
                sections::rejected(ui, &data.rejected);
            });
        }
        section(ui, "Frame times", true, |ui| figures::frame_times(ui, &settled));
        section(ui, "Camera and files", true, |ui| {
            sections::camera_and_files(ui, data, controls, &mut actions);
        });
        section(ui, "Passes", false, |ui| figures::passes(ui, &settled));
    });
    actions
}

/// The size that is left inside the window's edge; `None` where the window is too small to draw into.
fn room(ctx: &Context, margin: Vec2) -> Option<Vec2> {
    let room = ctx.content_rect().shrink(GAP).size() - margin;
    (room.x >= 60.0 && room.y >= 40.0).then_some(room)
}

/// Draws a sheet at the window's left edge, which scrolls when the window is too low.
fn sheet(ctx: &Context, contents: impl FnOnce(&mut Ui)) {
    let frame = Frame::new().fill(style::BACK).inner_margin(Margin::same(8));
    let Some(room) = room(ctx, frame.total_margin().sum()) else { return };
    let space = ctx.content_rect().shrink(GAP);
    let area = Area::new(Id::new("panel")).order(Order::Middle).fixed_pos(space.min).fade_in(false);
    area.show(ctx, |ui| {
        // An area offers only what it used last; sections may have been opened since.
        ui.set_max_size(space.size());
        frame.show(ui, |ui| {
            let width = WIDTH.min(room.x);
            ui.set_width(width);
            ScrollArea::vertical().max_height(room.y).min_scrolled_height(0.0).show(ui, |ui| {
                // Room for the scroll bar, which floats over the contents.
                ui.set_width(width - 8.0);
                contents(ui);
            });
        });
    });
}

/// Draws a small sheet at an edge of the window, over the picture; `contents` is told the room that there is.
fn corner(ctx: &Context, id: &str, align: Align2, contents: impl FnOnce(&mut Ui, Vec2)) {
    let Some(room) = room(ctx, Vec2::ZERO) else { return };
    let order = if id == "message" { Order::Foreground } else { Order::Middle };
    let area = Area::new(Id::new(id)).order(order).fade_in(false).interactable(false);
    area.anchor(align, align.to_sign() * -GAP).show(ctx, |ui| {
        Frame::new().fill(style::BACK).inner_margin(Margin::same(8)).show(ui, |ui| contents(ui, room));
    });
}

/// Draws a section that folds.
fn section(ui: &mut Ui, title: &str, open: bool, contents: impl FnOnce(&mut Ui)) {
    // What follows a colon may change while the section stays open.
    let name = title.split(':').next();
    CollapsingHeader::new(RichText::new(title).color(style::BRIGHT).heading())
        .id_salt(name)
        .default_open(open)
        .show_unindented(ui, |ui| {
            contents(ui);
            ui.add_space(4.0);
        });
}

/// A plot of this height, in points, with bounds of its own that the pointer does not move.
fn still_plot(id: &str, height: f32) -> Plot<'static> {
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
fn trimmed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    if decimals == 0 { text } else { text.trim_end_matches('0').trim_end_matches('.').to_owned() }
}
