//! User actions, from the mouse, a key or a button of the panel.

use std::path::PathBuf;

use crate::client::window::keys::CursorAction;
use crate::client::window::navigation::Gesture;
use crate::client::window::panel::{GizmoMode, PanelTab, ParameterValue};

/// A user action. Positions are physical pixels of the window.
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
    /// Focuses the lens at the distance of the surface point at this position.
    FocusLensAt([f64; 2]),
    /// Performs this at the next position that the user clicks.
    AskPlace(CursorAction),
    /// Sets the exposure from the light at this position.
    MeterAt([f64; 2]),
    /// Changes the exposure by this many steps of a sixth of a stop.
    Expose(f64),
    /// Zooms the displayed picture by steps of the wheel, about this position.
    ZoomAt([f64; 2], f64),
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
    /// Shows the rectangle being dragged between these positions; `None` removes it.
    DragRegion(Option<[[f64; 2]; 2]>),
    /// Restricts tracing to the rectangle between these positions.
    TraceRegion([[f64; 2]; 2]),
    /// Asks the user to drag a region to be traced alone, or releases the traced region.
    ToggleRegion,
    /// Clears the selection.
    Deselect,
    /// Undoes the last change or camera move.
    Undo,
    /// Redoes the change that was undone last.
    Redo,
    /// Moves the camera back to where the scene file puts it.
    ResetCamera,
    /// Sets the mode of the gizmo.
    SetGizmo(GizmoMode),
    /// Switches the gizmo to the next mode.
    NextGizmo,
    /// Sets the field of view, in degrees.
    SetFov(f64),
    /// Changes a parameter of the selected object.
    Edit {
        /// Index in [`Selection::parameters`](crate::client::window::panel::Selection::parameters).
        index: usize,
        /// The new value.
        value: ParameterValue,
    },
    /// Switches an effect of the picture off or on.
    SetEffect {
        /// Name of the effect.
        name: &'static str,
        /// Whether the effect is on.
        on: bool,
    },
    /// Measures the costs of the tracer's effects.
    MeasureCosts,
    /// Switches auto-exposure on, or off at the present exposure.
    ToggleFollowLight,
    /// Selects the integrator of this name; `None` for the automatic choice.
    SetMethod(Option<&'static str>),
    /// Saves the displayed picture.
    SavePng,
    /// Saves the sums of the film.
    SaveExr,
    /// Saves camera and edits as a scene file that includes the original.
    SaveScene,
    /// Copies the command line that repeats this picture.
    CopyCommand,
    /// Opens the dialog for a scene or model.
    OpenDialog,
    /// Opens this scene or model.
    Open(PathBuf),
    /// Opens the dialog for a file name to save under.
    SaveDialog,
    /// Saves to this path; the extension selects the displayed picture, the sums or the scene.
    SaveAs(PathBuf),
    /// Stores the view under a number, 1 to 9.
    KeepView(u8),
    /// Goes to the view stored under a number.
    GoToView(u8),
    /// Switches the tracing of light groups, for the light mix, on or off.
    ToggleLightMix,
    /// Sets the factor of a light group.
    SetMix {
        /// Index of the group.
        group: usize,
        /// Factors on linear R, G, B.
        factor: [f32; 3],
    },
    /// Shows one light group alone, or all of them again.
    SoloMix(usize),
    /// Resets all factors of the light mix to 1.
    ResetMix,
    /// Sets whether the fit of the light mix changes intensities only and keeps tints.
    KeepMixColors(bool),
    /// Opens the dialog for an example picture of the light mix.
    MixDialog,
    /// Fits the light mix to this picture.
    MixLike(PathBuf),
    /// Adds the pixel at this position as a colour target of the light mix.
    AddMixTarget([f64; 2]),
    /// Sets the colour of a target, display-linear R, G, B.
    SetMixTarget {
        /// Index of the target.
        place: usize,
        /// Its new colour.
        color: [f32; 3],
    },
    /// Removes a target.
    ForgetMixTarget(usize),
    /// Keeps the present picture as a snapshot.
    KeepSnapshot,
    /// Asks for an EXR file to compare with.
    CompareDialog,
    /// Compares with this EXR file.
    CompareWith(PathBuf),
    /// Removes a snapshot.
    ForgetSnapshot(usize),
    /// Shows the selected snapshot, or the present picture again.
    ToggleSnapshot,
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
    /// Closes the list of keys; if it is closed already, clears the selection.
    Cancel,
    /// Closes the window.
    Quit,
}
