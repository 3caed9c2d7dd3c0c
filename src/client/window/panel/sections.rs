//! The size of the picture, and the list of keys.

use egui::{Align2, DragValue, Grid, Key, Order, ScrollArea, Ui, Window};

use crate::client::window::action::Action;
use crate::client::window::keys::KeyTable;
use crate::client::window::panel::data::PanelData;
use crate::client::window::panel::style;

/// Largest side of a picture, pixels, as of `--size`.
const LARGEST_SIDE: u32 = 16384;

/// Draws the picture size, which can be edited, and its zoom. Typed or dragged values take effect once neither side is being edited, so
/// that both sides change at once; Escape discards them.
pub(super) fn picture_size(ui: &mut Ui, data: &PanelData, actions: &mut Vec<Action>) {
    let id = ui.id().with("picture size");
    let mut size = ui.data(|memory| memory.get_temp(id)).unwrap_or(data.extent);
    ui.horizontal(|ui| {
        ui.colored_label(style::DIM, "Picture");
        let mut is_edited = false;
        for (i, side) in size.iter_mut().enumerate() {
            if i > 0 {
                ui.colored_label(style::DIM, "×");
            }
            let field = DragValue::new(side).range(1..=LARGEST_SIDE).clamp_existing_to_range(false);
            let field = field.update_while_editing(false);
            let field = ui.add(field).on_hover_text(
                "Width and height of the picture, pixels. The window only scales it. Another shape begins with no samples",
            );
            is_edited |= field.dragged() || field.has_focus();
        }
        // When the focus moves between the two fields, neither has it for one pass. After Escape, too, a field takes over what was typed,
        // one pass later.
        let (goes_on, gives_up) = ui.input(|input| (input.key_pressed(Key::Tab), input.key_pressed(Key::Escape)));
        let given_up = id.with("given up");
        let has_given_up = ui.data_mut(|memory| memory.remove_temp::<()>(given_up)).is_some() || gives_up;
        if gives_up {
            ui.data_mut(|memory| memory.insert_temp(given_up, ()));
        }
        match is_edited || goes_on && size != data.extent {
            true => _ = ui.data_mut(|memory| memory.insert_temp(id, size)),
            false => {
                ui.data_mut(|memory| memory.remove::<[u32; 2]>(id));
                if size != data.extent && !has_given_up {
                    actions.push(Action::SetPictureSize(size));
                }
            }
        }
        if ui.button("Fill window").on_hover_text("A picture as large as its part of the window  N").clicked() {
            actions.push(Action::FillWindow);
        }
        let zoom = data.view.viewport.zoom();
        if zoom != 1.0 {
            ui.colored_label(style::DIM, format!("shown at {:.0} %", 100.0 * zoom));
        }
    });
}

/// Draws the list of keys in the middle of the window until it is closed.
pub(super) fn keys<T: Clone>(ctx: &egui::Context, open: &mut bool, keys: &KeyTable<T>) {
    let room = ctx.content_rect().height() - 60.0;
    let window =
        Window::new("Keys").open(open).collapsible(false).resizable(false).fade_in(false).fade_out(false);
    let window = window.order(Order::Foreground).anchor(Align2::CENTER_CENTER, [0.0, 0.0]);
    window.show(ctx, |ui| {
        ScrollArea::vertical().max_height(room.max(40.0)).show(ui, |ui| {
            for group in keys.groups() {
                ui.colored_label(style::BRIGHT, group.title);
                Grid::new(group.title).num_columns(2).min_col_width(170.0).show(ui, |ui| {
                    for binding in group.bindings.iter().filter(|binding| !binding.keys.is_empty()) {
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
