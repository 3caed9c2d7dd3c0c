//! The list of keys, from the table that also maps them.

use egui::{Align2, Grid, Order, ScrollArea, Window};

use crate::client::window::keys::GROUPS;
use crate::client::window::panel::style;

/// Shows the list in the middle of the window until it is closed.
pub(super) fn show(ctx: &egui::Context, open: &mut bool) {
    let room = ctx.content_rect().height() - 60.0;
    let window =
        Window::new("Keys").open(open).collapsible(false).resizable(false).fade_in(false).fade_out(false);
    let window = window.order(Order::Foreground).anchor(Align2::CENTER_CENTER, [0.0, 0.0]);
    window.show(ctx, |ui| {
        ScrollArea::vertical().max_height(room.max(40.0)).show(ui, |ui| {
            for group in GROUPS {
                ui.colored_label(style::BRIGHT, group.title);
                Grid::new(group.title).num_columns(2).min_col_width(170.0).show(ui, |ui| {
                    for binding in group.bindings {
                        ui.colored_label(style::ACCENT, binding.keys);
                        ui.label(binding.meaning);
                        ui.end_row();
                    }
                });
                ui.add_space(4.0);
            }
        });
    });
}
