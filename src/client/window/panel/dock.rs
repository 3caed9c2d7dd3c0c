//! The dock beside the picture: a bar of buttons, and tabs below, which can be rearranged.

use egui::{Align2, Button, Context, Frame, Margin, Panel, Rect, ScrollArea, Ui, Vec2, WidgetText};
use egui_tiles::{Behavior, SimplificationOptions, Tile, TileId, Tree, UiResponse};

use crate::client::window::action::Action;
use crate::client::window::panel::{GAP, PanelControls, PanelData, PanelTools, style, tabs};

/// Width of the dock at first, points.
pub const WIDTH: f32 = 340.0;

/// Least width of the dock, points.
const LEAST_WIDTH: f32 = 200.0;

/// Least width of the picture beside the dock, points: in a narrower window there is no dock.
const LEAST_PICTURE: f32 = 64.0;

/// A tab of the dock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PanelTab {
    /// Error, figures and effects of the render.
    Render,
    /// How the picture is displayed.
    Look,
    /// The selected object, the lights and the camera.
    Scene,
    /// The pixel under the pointer.
    Inspect,
    /// Snapshots and other pictures beside the present one.
    Compare,
    /// Scenes, pictures and views on the disk.
    Files,
}

impl PanelTab {
    /// All tabs, in the order of the dock.
    pub const ALL: [Self; 6] =
        [Self::Render, Self::Look, Self::Scene, Self::Inspect, Self::Compare, Self::Files];

    /// Title of the tab.
    pub fn title(self) -> &'static str {
        match self {
            Self::Render => "Render",
            Self::Look => "Look",
            Self::Scene => "Scene",
            Self::Inspect => "Inspect",
            Self::Compare => "Compare",
            Self::Files => "Files",
        }
    }
}

/// Layout of the dock.
#[derive(Clone, Debug)]
pub struct PanelLayout {
    /// Whether there is a dock.
    pub is_open: bool,
    /// Width in points, as set by the user.
    pub width: f32,
    /// Factor on the size of all text.
    pub font_scale: f32,
    /// The tabs.
    pub tabs: Tree<PanelTab>,
}

impl PanelLayout {
    /// A dock with all tabs in one group.
    pub fn new(is_open: bool) -> Self {
        let tabs = Tree::new_tabs("tabs", PanelTab::ALL.to_vec());
        Self { is_open, width: WIDTH, font_scale: 1.0, tabs }
    }

    /// Brings a tab to the front.
    pub fn bring(&mut self, tab: PanelTab) {
        self.tabs.make_active(|_, tile| matches!(tile, Tile::Pane(pane) if *pane == tab));
    }

    /// Whether a tab is visible.
    pub fn shows(&self, tab: PanelTab) -> bool {
        let mut panes = self.tabs.active_tiles().into_iter();
        self.is_open
            && panes.any(|id| matches!(self.tabs.tiles.get(id), Some(Tile::Pane(pane)) if *pane == tab))
    }

    /// Width that the dock takes of a window of this width, points; 0 if closed.
    pub fn width_in(&self, window: f32) -> f32 {
        let room = window - LEAST_PICTURE;
        if self.is_open && room >= LEAST_WIDTH { self.width.clamp(LEAST_WIDTH, room) } else { 0.0 }
    }
}

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

/// Draws a small sheet at an edge of the picture's area; `contents` receives the available size.
pub(super) fn corner(
    ctx: &Context,
    area: Rect,
    id: &str,
    align: Align2,
    contents: impl FnOnce(&mut Ui, Vec2),
) {
    let space = area.shrink(GAP);
    if space.width() < 60.0 || space.height() < 40.0 {
        return;
    }
    let order = if id == "message" { egui::Order::Foreground } else { egui::Order::Middle };
    let sheet = egui::Area::new(egui::Id::new(id)).order(order).fade_in(false).interactable(false);
    sheet.pivot(align).fixed_pos(align.pos_in_rect(&space)).constrain_to(space).show(ctx, |ui| {
        let frame = Frame::new().fill(style::BACK).inner_margin(Margin::same(8));
        frame.show(ui, |ui| contents(ui, space.size()));
    });
}
