//! What the user asks for, with the mouse, a key or a button of the panel.

use std::path::PathBuf;

use crate::client::window::keys::CursorAction;
use crate::client::window::navigation::Gesture;
use crate::client::window::panel::{GizmoMode, PanelTab, ParameterValue};

/// One wish of the user. Positions are physical pixels of the window.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Moves the camera.
    Gesture(Gesture),
    /// Ends a camera move: the next gesture is an entry of its own in the history.
    EndMove,
    /// Selects the object that is seen here.
    Pick([f64; 2]),
    /// Turns the camera to the point that is seen here.
    FocusAt([f64; 2]),
    /// Focuses the lens at the distance of the point that is seen here.
    FocusLensAt([f64; 2]),
    /// Does this where the user clicks next.
    AskPlace(CursorAction),
    /// Exposes the picture for the light that is seen here.
    MeterAt([f64; 2]),
    /// Changes the exposure by steps of a sixth of a stop.
    Expose(f64),
    /// Zooms the picture that is shown in or out by steps of the wheel; the place here stays where it is.
    ZoomAt([f64; 2], f64),
    /// Moves the magnified picture by pixels of the window.
    PanView([f64; 2]),
    /// Shows the whole picture.
    ResetView,
    /// Shows a pixel of the picture as one of the window; the place here stays where it is.
    ShowPixels([f64; 2]),
    /// Makes a picture of this size, in pixels.
    SetPictureSize([u32; 2]),
    /// Makes a picture that fills the window without scaling.
    FillWindow,
    /// Shows the rectangle between these places, which is being dragged; none any more where there are none.
    DragRegion(Option<[[f64; 2]; 2]>),
    /// Traces the rectangle between these places and nothing else.
    TraceRegion([[f64; 2]; 2]),
    /// Lets the user drag a rectangle that is traced alone, or releases the one that is.
    ToggleRegion,
    /// Selects nothing.
    Deselect,
    /// Takes the last change or camera move back.
    Undo,
    /// Repeats the change that was taken back last.
    Redo,
    /// Moves the camera back to where the scene file puts it.
    ResetCamera,
    /// Lets the gizmo move, turn or scale.
    SetGizmo(GizmoMode),
    /// Lets it do the next of these.
    NextGizmo,
    /// Sets the field of view, in degrees.
    SetFov(f64),
    /// Changes a parameter of the selected object.
    Edit {
        /// Place in [`Selection::parameters`](crate::client::window::panel::Selection::parameters).
        index: usize,
        /// The new value.
        value: ParameterValue,
    },
    /// Leaves an effect out of the picture, or takes it in again.
    SetEffect {
        /// Name of the effect.
        name: &'static str,
        /// Whether it takes part.
        on: bool,
    },
    /// Measures what the effects of the tracer cost.
    MeasureCosts,
    /// Lets the brightness follow the light of the scene, or fixes it where it is.
    ToggleFollowLight,
    /// Traces light by this method, or by the one that suits the scene.
    SetMethod(Option<&'static str>),
    /// Saves the displayed picture.
    SavePng,
    /// Saves the sums of the film.
    SaveExr,
    /// Saves camera and edits as a scene file that includes the original.
    SaveScene,
    /// Copies the command line that repeats this picture.
    CopyCommand,
    /// Asks for a scene or a model to open.
    OpenDialog,
    /// Opens this scene or model.
    Open(PathBuf),
    /// Asks for a name under which to save.
    SaveDialog,
    /// Saves under this name, which the user has chosen: by its ending the displayed picture, the sums or the scene.
    SaveAs(PathBuf),
    /// Keeps the view under a number, 1 to 9.
    KeepView(u8),
    /// Goes to the view that is kept under a number.
    GoToView(u8),
    /// Traces the groups of lights, so that they can be mixed, or none of them any more.
    ToggleLightMix,
    /// Multiplies the light of a group.
    SetMix {
        /// Its place.
        group: usize,
        /// Factors on linear R, G, B.
        factor: [f32; 3],
    },
    /// Shows a group of lights alone, or all of them again.
    SoloMix(usize),
    /// Shows all lights as they are.
    ResetMix,
    /// Whether lights keep their colours where their factors are sought.
    KeepMixColors(bool),
    /// Asks for a picture that the light mix is to look like.
    MixDialog,
    /// Finds the light mix that looks most like this picture.
    MixLike(PathBuf),
    /// Adds the place that is seen here as one whose colour is known.
    AddMixTarget([f64; 2]),
    /// Chooses the colour of such a place, display-linear R, G, B.
    SetMixTarget {
        /// Its place in the list.
        place: usize,
        /// The colour.
        color: [f32; 3],
    },
    /// Forgets such a place.
    ForgetMixTarget(usize),
    /// Keeps the present picture as a snapshot.
    KeepSnapshot,
    /// Asks for an EXR file to compare with.
    CompareDialog,
    /// Compares with this EXR file.
    CompareWith(PathBuf),
    /// Forgets a snapshot.
    ForgetSnapshot(usize),
    /// Shows the chosen snapshot, or the present picture again.
    ToggleSnapshot,
    /// Reads no samples, so that the tracer stops soon, until it is asked for again.
    TogglePause,
    /// Fills the screen with the window, or leaves it.
    ToggleFullscreen,
    /// Makes all text larger or smaller by steps.
    ScaleText(i8),
    /// Brings a tab of the panel to the front.
    ShowTab(PanelTab),
    /// Gives the keyboard to the panel.
    EnterPanel,
    /// Shows or hides the palette of commands.
    TogglePalette,
    /// Shows or hides the panel.
    TogglePanel,
    /// Shows or hides the list of keys.
    ToggleHelp,
    /// Closes the list of keys, or selects nothing when it is closed.
    Cancel,
    /// Closes the window.
    Quit,
}
