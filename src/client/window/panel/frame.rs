//! What the panel stands in: a floating sheet at the left, with sections that fold.

use egui::{Align2, Area, CollapsingHeader, Frame, Id, Margin, Order, RichText, ScrollArea, Ui};

use crate::client::window::panel::style;

/// Width of the contents, points.
const WIDTH: f32 = 292.0;
/// Distance from the window's edge, points.
const GAP: f32 = 8.0;

/// The sheet; scrolls when the window is too low.
pub(super) fn floating(ctx: &egui::Context, contents: impl FnOnce(&mut Ui)) {
    let space = ctx.content_rect().shrink(GAP);
    let frame = Frame::new().fill(style::BACK).inner_margin(Margin::same(8));
    let room = space.size() - frame.total_margin().sum();
    if room.x < 60.0 || room.y < 40.0 {
        return;
    }
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

/// A line at the bottom, over the picture.
pub(super) fn message(ctx: &egui::Context, text: &str) {
    let room = ctx.content_rect().shrink(GAP).size();
    if room.x < 60.0 || room.y < 40.0 {
        return;
    }
    let area = Area::new(Id::new("message")).order(Order::Foreground).fade_in(false).interactable(false);
    area.anchor(Align2::CENTER_BOTTOM, [0.0, -GAP]).show(ctx, |ui| {
        Frame::new().fill(style::BACK).inner_margin(Margin::same(8)).show(ui, |ui| {
            ui.set_max_width(room.x - 2.0 * GAP);
            ui.colored_label(style::BRIGHT, text);
        });
    });
}

/// A section that folds.
pub(super) fn section(ui: &mut Ui, title: &str, open: bool, contents: impl FnOnce(&mut Ui)) {
    CollapsingHeader::new(RichText::new(title).color(style::BRIGHT).heading())
        .default_open(open)
        .show_unindented(ui, |ui| {
            contents(ui);
            ui.add_space(4.0);
        });
}
