//! User actions, from the mouse, a key or a button of the panel: those of the window itself, and those of its tools, which the window
//! passes on without knowing them.

use crate::client::window::navigation::Gesture;
use crate::client::window::panel::layout::PanelTab;

/// A user action. `T`: actions of the tools.
#[derive(Clone, Debug, PartialEq)]
pub enum UserAction<T> {
    /// An action of the window itself.
    Window(Action),
    /// An action of a tool.
    Tool(T),
    /// An action of a tool at this position, physical pixels of the window.
    ToolAt(T, [f64; 2]),
    /// Performs an action of a tool at the next position that the user clicks.
    AskPlace(T),
}

impl<T> UserAction<T> {
    /// The same action, where `convert` takes those of the tools to another type.
    pub fn map<U>(self, convert: impl FnOnce(T) -> U) -> UserAction<U> {
        match self {
            Self::Window(action) => UserAction::Window(action),
            Self::Tool(action) => UserAction::Tool(convert(action)),
            Self::ToolAt(action, at) => UserAction::ToolAt(convert(action), at),
            Self::AskPlace(action) => UserAction::AskPlace(convert(action)),
        }
    }
}

/// Actions that the user asks for while a tool draws its part of the panel, in order.
#[derive(Clone, Debug)]
pub struct ActionQueue<T>(Vec<UserAction<T>>);

impl<T> Default for ActionQueue<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> ActionQueue<T> {
    /// Asks for an action of the tool.
    pub fn ask(&mut self, action: T) {
        self.0.push(UserAction::Tool(action));
    }

    /// Asks for an action of the tool at the next position that the user clicks.
    pub fn ask_at_place(&mut self, action: T) {
        self.0.push(UserAction::AskPlace(action));
    }

    /// Asks for an action of the window.
    pub fn ask_window(&mut self, action: Action) {
        self.0.push(UserAction::Window(action));
    }

    /// Adds the actions of another queue, where `convert` takes those of its tool to the type of this one.
    pub fn extend<U>(&mut self, other: ActionQueue<U>, convert: impl Fn(U) -> T) {
        self.0.extend(other.0.into_iter().map(|action| action.map(&convert)));
    }

    /// Takes the actions.
    pub fn take(&mut self) -> Vec<UserAction<T>> {
        std::mem::take(&mut self.0)
    }
}

/// An action that the input or the dock knows: the viewer performs it, or passes it on to the tool that does. Positions are physical pixels of the window.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Moves the camera.
    Gesture(Gesture),
    /// Ends a camera move: the next gesture begins a new history entry.
    EndMove,
    /// Selects the object at this position.
    Pick([f64; 2]),
    /// Turns the camera to the surface point at this position.
    FocusAt([f64; 2]),
    /// Performs this at the next position that the user clicks.
    AskPlace(CursorAction),
    /// Changes the exposure by this many steps of a sixth of a stop.
    Expose(f64),
    /// Zooms the displayed picture by steps of the wheel, about this position.
    ZoomAt([f64; 2], f64),
    /// Turns the view into a panorama, by fractions of the displayed picture's size: the panorama follows the cursor.
    TurnView([f64; 2]),
    /// Widens the view into a panorama, degrees.
    WidenView(f64),
    /// Moves the magnified picture by pixels of the window.
    PanView([f64; 2]),
    /// Shows the whole picture.
    ResetView,
    /// Shows the picture at 1:1, keeping the point at this position in place.
    ShowPixels([f64; 2]),
    /// Resizes the picture, in pixels.
    SetPictureSize([u32; 2]),
    /// Resizes the picture to fill the window at 1:1.
    FillWindow,
    /// The user drags a rectangle between these positions; `None`: not any more.
    DragRegion(Option<[[f64; 2]; 2]>),
    /// The user has dragged a rectangle between these positions.
    TraceRegion([[f64; 2]; 2]),
    /// Undoes the last change or camera move.
    Undo,
    /// Redoes the change that was undone last.
    Redo,
    /// Returns to scene, camera, method, display and panel as they were opened.
    StartOver,
    /// Saves the sums of the film.
    SaveExr,
    /// Opens the dialog for a scene or model.
    OpenDialog,
    /// Opens the dialog for a file name to save under.
    SaveDialog,
    /// Pauses or resumes: while paused no samples are read, so that the tracer stops soon.
    TogglePause,
    /// Fills the screen with the window, or leaves it.
    ToggleFullscreen,
    /// Scales all text by this many steps.
    ScaleText(i8),
    /// Brings a tab of the panel to the front.
    ShowTab(PanelTab),
    /// Gives the keyboard focus to the panel.
    EnterPanel,
    /// Shows or hides the palette of commands.
    TogglePalette,
    /// Shows or hides the panel.
    TogglePanel,
    /// Shows or hides the list of keys.
    ToggleHelp,
    /// Leaves what was begun; else closes the list of keys, releases the region, or clears the selection.
    Cancel,
    /// Closes the window.
    Quit,
}

/// Actions at the cursor position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CursorAction {
    /// Zooms the picture in by a step.
    ZoomIn,
    /// Zooms it out by a step.
    ZoomOut,
    /// Shows the picture at 1:1.
    ShowPixels,
}

impl CursorAction {
    /// The action at a position of the window.
    pub fn at(self, at: [f64; 2]) -> Action {
        match self {
            Self::ZoomIn => Action::ZoomAt(at, 1.0),
            Self::ZoomOut => Action::ZoomAt(at, -1.0),
            Self::ShowPixels => Action::ShowPixels(at),
        }
    }
}
