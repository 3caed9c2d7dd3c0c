//! What tools add to the panel, which gives them places and knows none of them by name.

use egui::{Context, Ui};

use crate::client::window::panel::over_picture::PictureArea;

/// A place in the dock where tools draw sections, one below the other in the order of their list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SectionPlace {
    /// The tab Render, below the size of the picture.
    Render,
    /// The tab Look, above the controls.
    LookTop,
    /// The tab Scene, in the section of the selection.
    Selection,
    /// The tab Inspect.
    Inspect,
    /// The tab Compare.
    Compare,
    /// At the end of the tab Scene.
    SceneEnd,
    /// At the beginning of the tab Files.
    FilesTop,
    /// In the middle of the tab Files.
    Files,
    /// At the end of the tab Files.
    FilesEnd,
}

/// How much of a tool is visible outside of the dock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum ToolPresence {
    /// Nothing.
    #[default]
    Hidden,
    /// Something that is drawn only.
    Drawn,
    /// Something that reacts to the pointer.
    Interactive,
    /// A dialog, which takes all keys.
    Modal,
}

/// The tools as the panel sees them.
pub trait PanelTools {
    /// Draws the sections at this place.
    fn sections(&mut self, place: SectionPlace, ui: &mut Ui);

    /// Draws what the tools show over the picture.
    fn over_picture(&mut self, ctx: &Context, picture: PictureArea);
}

/// No tools.
impl PanelTools for () {
    fn sections(&mut self, _: SectionPlace, _: &mut Ui) {}

    fn over_picture(&mut self, _: &Context, _: PictureArea) {}
}
