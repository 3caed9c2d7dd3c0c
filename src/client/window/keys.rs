//! What keys and mouse buttons do: one table, which maps keys to actions and from which the window's list of keys is drawn.

use winit::keyboard::KeyCode;

use crate::client::window::action::Action;
use crate::client::window::navigation::Gesture;

/// Degrees by which a key or a step of the wheel changes the field of view.
pub const FOV_STEP: f64 = 2.0;

/// The key press that a line of the table reacts to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Trigger {
    /// A character of the keyboard's layout, without Ctrl; letters in either case. Not while the right button is held.
    Char(char),
    /// A character with Ctrl; `true` demands Shift as well.
    Ctrl(char, bool),
    /// A key by its place on the keyboard. Not while the right button is held.
    Key(KeyCode),
}

/// What a line of the table does.
#[derive(Clone, Debug, PartialEq)]
pub enum BoundAction {
    /// Performs this action.
    Action(Action),
    /// Focuses on the point under the cursor.
    FocusAtCursor,
    /// Describes mouse buttons and held keys, which [`input`](crate::client::window::input) interprets.
    Described,
}

/// One line of the table.
#[derive(Clone, Debug)]
pub struct KeyBinding {
    /// Keys as the user reads them.
    pub keys: &'static str,
    /// What they do, as the user reads it.
    pub meaning: &'static str,
    /// Key presses that fire it; none for a line that only describes.
    pub triggers: &'static [Trigger],
    /// What it does.
    pub action: BoundAction,
}

/// Lines of one subject.
#[derive(Clone, Copy, Debug)]
pub struct KeyGroup {
    /// The subject.
    pub title: &'static str,
    /// Its lines.
    pub bindings: &'static [KeyBinding],
}

const fn mouse(keys: &'static str, meaning: &'static str) -> KeyBinding {
    KeyBinding { keys, meaning, triggers: &[], action: BoundAction::Described }
}

const fn key(
    keys: &'static str,
    meaning: &'static str,
    triggers: &'static [Trigger],
    action: Action,
) -> KeyBinding {
    KeyBinding { keys, meaning, triggers, action: BoundAction::Action(action) }
}

use Trigger::{Char, Ctrl, Key};

/// All lines.
pub const GROUPS: &[KeyGroup] = &[
    KeyGroup { title: "Camera", bindings: CAMERA },
    KeyGroup { title: "Camera moves", bindings: MOVES },
    KeyGroup { title: "Picture", bindings: PICTURE },
    KeyGroup { title: "Window", bindings: WINDOW },
];

const CAMERA: &[KeyBinding] = &[
    mouse("Left drag", "orbit"),
    mouse("Middle drag, Shift+left drag", "pan"),
    mouse("Wheel", "closer, farther"),
    mouse("Right drag", "look around"),
    mouse("Right held + W A S D Q E", "fly; Q down, E up, Shift faster"),
    mouse("Right held + wheel", "flying speed"),
    mouse("Ctrl+wheel", "field of view"),
    key("[", "narrower field of view", &[Char('[')], Action::Gesture(Gesture::Fov(-FOV_STEP))),
    key("]", "wider field of view", &[Char(']')], Action::Gesture(Gesture::Fov(FOV_STEP))),
    KeyBinding {
        keys: "F, double click",
        meaning: "focus on the point under the cursor",
        triggers: &[Char('f')],
        action: BoundAction::FocusAtCursor,
    },
];

const MOVES: &[KeyBinding] = &[
    key("Ctrl+Z", "undo", &[Ctrl('z', false)], Action::Undo),
    key("Ctrl+Shift+Z, Ctrl+Y", "redo", &[Ctrl('z', true), Ctrl('y', false)], Action::Redo),
    key("R, Home", "the file's camera", &[Char('r'), Key(KeyCode::Home)], Action::ResetCamera),
];

const PICTURE: &[KeyBinding] = &[
    mouse("Click", "select an object"),
    key("X", "select nothing", &[Char('x')], Action::Deselect),
    key("B", "fix the brightness, or let it follow the light", &[Char('b')], Action::ToggleFollowLight),
    key("P", "save the picture as PNG", &[Char('p')], Action::SavePng),
    key("E", "save the sums as EXR", &[Char('e')], Action::SaveExr),
    key("Ctrl+S", "save the scene's changes", &[Ctrl('s', false)], Action::SaveScene),
    key("C", "copy the command of this picture", &[Char('c')], Action::CopyCommand),
];

const WINDOW: &[KeyBinding] = &[
    key("Tab", "show or hide the panel", &[Key(KeyCode::Tab)], Action::TogglePanel),
    key("?, F1", "this list", &[Char('?'), Key(KeyCode::F1)], Action::ToggleHelp),
    key("Esc", "close the list, select nothing", &[Key(KeyCode::Escape)], Action::Cancel),
    key("Ctrl+Q", "quit", &[Ctrl('q', false)], Action::Quit),
];

/// What is held while a key is pressed.
#[derive(Clone, Copy, Debug, Default)]
pub struct Held {
    /// Ctrl.
    pub ctrl: bool,
    /// Shift.
    pub shift: bool,
    /// The right mouse button: letters fly the camera.
    pub flying: bool,
}

/// Looks up a key that was pressed: its place, and the character that the keyboard's layout gives it.
pub fn lookup(code: Option<KeyCode>, text: Option<char>, held: Held) -> Option<&'static BoundAction> {
    let text = text.and_then(|c| c.to_lowercase().next());
    let plain = !held.ctrl && !held.flying;
    let fires = |trigger: &Trigger| match *trigger {
        Char(c) => plain && text == Some(c),
        Ctrl(c, with_shift) => held.ctrl && held.shift == with_shift && text == Some(c),
        Key(k) => plain && code == Some(k),
    };
    let mut bindings = GROUPS.iter().flat_map(|group| group.bindings);
    bindings.find(|b| b.triggers.iter().any(fires)).map(|b| &b.action)
}
