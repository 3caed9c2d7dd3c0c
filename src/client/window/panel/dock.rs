//! The dock beside the picture: a bar of buttons, and tabs below, which can be rearranged.

use egui::{Button, Frame, Margin, Panel, Rect, ScrollArea, Ui, WidgetText};
use egui_tiles::{Behavior, SimplificationOptions, TileId, Tree, UiResponse};

use crate::client::window::action::Action;
use crate::client::window::panel::controls::PanelControls;
use crate::client::window::panel::data::PanelData;
use crate::client::window::panel::layout::{LEAST_PICTURE, LEAST_WIDTH, PanelTab};
use crate::client::window::panel::tabs;
use crate::client::window::panel::tools::PanelTools;

/// Draws the dock; returns the area that it leaves to the picture.
pub(super) fn show(
    ui: &mut Ui,
    data: &PanelData,
    controls: &mut PanelControls,
    tools: &mut dyn PanelTools,
    actions: &mut Vec<Action>,
) -> Rect {
    let window = ui.ctx().content_rect();
    let width = controls.layout.width_in(window.width());
    if width == 0.0 {
        return window;
    }
    let frame = Frame::new().fill(ui.visuals().panel_fill).inner_margin(Margin::same(0));
    let panel = Panel::right("dock").frame(frame).resizable(true).default_size(width);
    let panel = panel.size_range(LEAST_WIDTH..=(window.width() - LEAST_PICTURE));
    let shown = panel.show(ui, |ui| {
        bar(ui, data, &mut controls.enters, actions);
        let mut tree = std::mem::replace(&mut controls.layout.tabs, Tree::empty("tabs"));
        let mut behaviour = TabContents { data, controls, tools, actions };
        tree.ui(&mut behaviour, ui);
        controls.layout.tabs = tree;
    });
    let dock = shown.response.rect;
    controls.layout.width = dock.width();
    Rect::from_min_max(window.min, egui::pos2(dock.left(), window.bottom()))
}

/// Draws the bar of the most important buttons.
fn bar(ui: &mut Ui, data: &PanelData, enters: &mut bool, actions: &mut Vec<Action>) {
    let names = |verb: &str, change: &Option<String>, keys: &str| match change {
        Some(change) => format!("{verb} {change}  {keys}"),
        None => format!("There is nothing to {}  {keys}", verb.to_lowercase()),
    };
    let undo = names("Undo", &data.undo, "Ctrl+Z");
    let redo = names("Redo", &data.redo, "Ctrl+Shift+Z");
    let buttons = [
        ("Open…", "Opens a scene or a model  Ctrl+O", Action::OpenDialog),
        (
            "Save…",
            "Saves the picture or the scene under a name of your choice  Ctrl+Shift+S",
            Action::SaveDialog,
        ),
        ("Undo", undo.as_str(), Action::Undo),
        ("Redo", redo.as_str(), Action::Redo),
        ("Commands", "Finds a command by its name  Ctrl+K", Action::TogglePalette),
        ("?", "Lists the keys  F1", Action::ToggleHelp),
    ];
    Frame::new().inner_margin(Margin::symmetric(8, 4)).show(ui, |ui| {
        ui.horizontal_wrapped(|ui| {
            for (text, hint, action) in buttons {
                let can = match action {
                    Action::Undo => data.undo.is_some(),
                    Action::Redo => data.redo.is_some(),
                    _ => true,
                };
                let button = ui.add_enabled(can, Button::new(text));
                if std::mem::take(enters) {
                    button.request_focus();
                }
                if button.on_hover_text(hint).on_disabled_hover_text(hint).clicked() {
                    actions.push(action);
                }
            }
        });
    });
}

/// Draws the contents of the tabs.
struct TabContents<'a> {
    data: &'a PanelData,
    controls: &'a mut PanelControls,
    tools: &'a mut dyn PanelTools,
    actions: &'a mut Vec<Action>,
}

impl Behavior<PanelTab> for TabContents<'_> {
    fn pane_ui(&mut self, ui: &mut Ui, _: TileId, tab: &mut PanelTab) -> UiResponse {
        Frame::new().inner_margin(Margin::same(8)).show(ui, |ui| {
            ScrollArea::vertical().id_salt(tab.title()).auto_shrink(false).show(ui, |ui| {
                // Leaves room for the scroll bar, which overlays the contents.
                ui.set_max_width(ui.available_width() - 8.0);
                tabs::show(ui, *tab, self.data, self.controls, self.tools, self.actions);
            });
        });
        UiResponse::None
    }

    fn tab_title_for_pane(&mut self, tab: &PanelTab) -> WidgetText {
        tab.title().into()
    }

    fn simplification_options(&self) -> SimplificationOptions {
        SimplificationOptions { all_panes_must_have_tabs: true, ..SimplificationOptions::default() }
    }

    fn tab_title_spacing(&self, _: &egui::Visuals) -> f32 {
        5.0
    }

    fn tab_bar_height(&self, _: &egui::Style) -> f32 {
        22.0
    }
}
