//! What the user asks for, with the mouse, a key or a button of the panel.

use crate::client::window::navigation::Gesture;
use crate::client::window::panel::ParameterValue;

/// One wish of the user. Positions are physical pixels of the window.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Moves the camera.
    Gesture(Gesture),
    /// Ends a camera move: the next gesture is an entry of its own in the history.
    EndMove,
    /// Selects the object that is seen here.
    Pick([f64; 2]),
    /// Focuses the camera on the point that is seen here.
    FocusAt([f64; 2]),
    /// Selects nothing.
    Deselect,
    /// Takes the last camera move back.
    Undo,
    /// Repeats the camera move that was taken back last.
    Redo,
    /// Moves the camera back to where the scene file puts it.
    ResetCamera,
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
    /// Shows or hides the panel.
    TogglePanel,
    /// Shows or hides the list of keys.
    ToggleHelp,
    /// Closes the list of keys, or selects nothing when it is closed.
    Cancel,
    /// Closes the window.
    Quit,
}
