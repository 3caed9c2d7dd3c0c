//! What a tool of the window is, and what it may use of the window.

use std::path::{Path, PathBuf};
use std::time::Instant;

use egui::{Context, Ui};
use miette::{Result, miette};
use winit::event::WindowEvent;

use crate::client::window::action::ActionQueue;
use crate::client::window::keys::ToolKey;
use crate::client::window::panel::{PanelData, PictureArea, SectionPlace, ToolPresence};
use crate::render::process::tell;
use crate::viewer::context::SessionContext;
use crate::viewer::editor::SceneEditor;
use crate::viewer::metrics::ViewerMetrics;
use crate::viewer::panel::{CursorPlace, ViewerPanel};
use crate::viewer::picture::LivePicture;
use crate::viewer::preferences::Preferences;
use crate::viewer::session::RenderSession;

/// A tool of the window: state of its own, actions, keys, and a part of the panel that shows its state.
///
/// All functions may be left out.
pub trait Tool {
    /// What the user can do with it; [`Infallible`](std::convert::Infallible) for a tool that only shows something.
    type Action;

    /// Its lines of the key table and the command palette.
    fn keys() -> Vec<ToolKey<Self::Action>> {
        Vec::new()
    }

    /// Performs an action; returns a message for the user.
    ///
    /// # Errors
    ///
    /// The message of the error is shown to the user in the same way.
    fn perform(&mut self, _action: Self::Action, _context: &mut ToolContext<'_>) -> Result<Option<String>> {
        Ok(None)
    }

    /// Called when another scene was opened; returns a message for the user if a file of the tool beside the scene cannot be read.
    fn open_scene(&mut self, _scene: &Path) -> Option<String> {
        None
    }

    /// Handles an event of the window before the panel does; returns true if it has consumed the event.
    fn hear(&mut self, _event: &WindowEvent, _context: &mut ToolContext<'_>) -> bool {
        false
    }

    /// Handles a click in the picture, at this place in pixels.
    ///
    /// # Errors
    ///
    /// The message is shown to the user.
    fn click(&mut self, _place: [f64; 2], _context: &mut ToolContext<'_>) -> Result<()> {
        Ok(())
    }

    /// Called once per frame, after samples have been read.
    fn frame(&mut self, _now: Instant, _context: &mut ToolContext<'_>) {}

    /// Discards results that this change invalidates.
    fn forget(&mut self, _change: ViewChange) {}

    /// Takes over results of other threads and begins work that is due; returns whether the window must be redrawn.
    fn poll(&mut self, _context: &mut ToolContext<'_>) -> bool {
        false
    }

    /// Updates what it shows, before the panel is drawn. It may change the data of the panel, too.
    fn update(&mut self, _context: &mut ToolContext<'_>, _data: &mut PanelData) {}

    /// Draws its section at this place of the dock, if it has one there.
    fn section(&mut self, _place: SectionPlace, _ui: &mut Ui, _queue: &mut ActionQueue<Self::Action>) {}

    /// Draws what it shows over the picture, and its dialogs.
    fn over_picture(&mut self, _: &Context, _: PictureArea, _queue: &mut ActionQueue<Self::Action>) {}

    /// How much of it is visible outside of the dock.
    fn presence(&self, _context: &ToolContext<'_>) -> ToolPresence {
        ToolPresence::Hidden
    }

    /// Whether it computes something that the panel will show.
    fn is_busy(&self) -> bool {
        false
    }
}

/// What is told of maps, regions and comparisons while the window looks around in a panorama.
pub const ONLY_FLAT: &str = "this needs the flat panorama: A shows it";

/// A change of what the window shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ViewChange {
    /// Scene, camera or method have changed.
    Edited,
    /// The picture has another size.
    Resized,
    /// The picture begins anew.
    Epoch,
}

/// What a tool may use of the window.
pub struct ToolContext<'a> {
    pub session: &'a mut RenderSession,
    pub picture: &'a mut LivePicture,
    pub editor: &'a mut SceneEditor,
    pub panel: &'a mut ViewerPanel,
    pub metrics: &'a mut ViewerMetrics,
    pub preferences: &'a mut Preferences,
    pub options: &'a SessionContext,
    /// When the render was paused; `None` while it traces.
    pub paused: &'a mut Option<Instant>,
    /// Whether the tracer rests until the pictures are read that a preview lacks.
    pub rests_for_pictures: bool,
    /// Position of the window that the action is about, physical pixels.
    pub at: Option<[f64; 2]>,
    /// Whether the next click in the picture is for an action that the user has begun.
    pub asks_place: bool,
    /// Set by a tool that has changed what is traced.
    pub has_edited: bool,
    /// Set by a tool whose window must be drawn anew.
    pub redraws: bool,
    /// Scene or model that a tool asks the window to open.
    pub opens: Option<PathBuf>,
    /// Size of a picture that a tool asks the window to make room for.
    pub asks_room: Option<[u32; 2]>,
}

impl ToolContext<'_> {
    /// Tells the user in the panel, and on standard error.
    pub fn say(&mut self, message: String) {
        tell(&message);
        self.panel.host.say(message);
    }

    /// Resumes after a pause.
    pub fn go_on(&mut self) {
        if let Some(since) = self.paused.take() {
            self.picture.stood_still(since.elapsed());
        }
    }

    /// The place of the picture, in pixels, that the action is about; of two eyes that in the left one's.
    ///
    /// # Errors
    ///
    /// If it lies outside of the picture.
    pub fn place(&self) -> Result<[f64; 2]> {
        Ok(self.cursor_place()?.picture.to_array())
    }

    /// The same, and the place of what is displayed there.
    ///
    /// # Errors
    ///
    /// If it lies outside of the picture.
    pub fn cursor_place(&self) -> Result<CursorPlace> {
        let at = self.at.ok_or_else(|| miette!("there is no picture here"))?;
        Ok(self.panel.on_picture(at)?.in_left_eye(self.editor, self.session.size()))
    }

    /// The place under the cursor, while over the picture; of two eyes that in the left one's.
    pub fn cursor(&self) -> Option<CursorPlace> {
        Some(self.panel.cursor()?.in_left_eye(self.editor, self.session.size()))
    }

    /// Checks that the picture is that of one eye, for `what` goes with no other.
    ///
    /// # Errors
    ///
    /// If there are two; the message says what to do.
    pub fn check_one_eye(&self, what: &str) -> Result<()> {
        match self.editor.rig() {
            Some(_) => Err(miette!("{what} goes with one eye only: switch stereo off first (Ctrl+E)")),
            None => Ok(()),
        }
    }

    /// Checks that the window shows the whole picture, and no view into a panorama.
    ///
    /// # Errors
    ///
    /// If it shows a view; the message says what to do.
    pub fn check_is_flat(&self) -> Result<()> {
        match self.panel.looks_around() {
            true => Err(miette!("{ONLY_FLAT}")),
            false => Ok(()),
        }
    }

    /// Checks that the window shows light.
    ///
    /// # Errors
    ///
    /// If it shows an error estimate instead; the message says what to do.
    pub fn check_light_is_shown(&self) -> Result<()> {
        match self.panel.controls.settings.view.is_error() {
            true => Err(miette!("the error is shown, not light: choose “Show: Picture” on the tab Look")),
            false => Ok(()),
        }
    }
}
