//! The layout of the dock: its width and its tabs.

use egui_tiles::{Tile, Tree};

/// Width of the dock at first, points.
pub const WIDTH: f32 = 340.0;

/// Least width of the dock, points.
pub(super) const LEAST_WIDTH: f32 = 200.0;

/// Least width of the picture beside the dock, points: in a narrower window there is no dock.
pub(super) const LEAST_PICTURE: f32 = 64.0;

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
