//! Key and mouse bindings: one table, used to dispatch keys and to draw the list of keys and the command palette. Tools add their own.

use winit::keyboard::KeyCode;

use crate::client::window::action::{Action, CursorAction, UserAction};
use crate::client::window::navigation::Gesture;
use crate::client::window::panel::layout::PanelTab;

/// Degrees per key press or wheel step when changing the field of view.
pub const FOV_STEP: f64 = 2.0;

/// Key press that triggers a binding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Trigger {
    /// A character of the keyboard layout, without Ctrl, in either case. Ignored while the right button is held.
    Char(char),
    /// A character with Ctrl; `true` requires Shift as well.
    Ctrl(char, bool),
    /// A physical key. Ignored while the right button is held.
    Key(KeyCode),
}

/// Action of a binding. `T`: actions of the tools.
#[derive(Clone, Debug, PartialEq)]
pub enum BoundAction<T> {
    /// Performs this action.
    Action(UserAction<T>),
    /// Performs an action of the window at the cursor.
    AtCursor(CursorAction),
    /// Performs an action of a tool at the cursor.
    ToolAtCursor(T),
    /// Performs one action for each trigger, in their order; each has a name of its own in the palette.
    Each(Vec<(String, T)>),
    /// Describes mouse buttons and held keys, which [`input`](crate::client::window::input) interprets.
    Described,
}

/// One binding of the table.
#[derive(Clone, Debug)]
pub struct KeyBinding<T> {
    /// Keys as displayed to the user; empty for a command without a key.
    pub keys: &'static str,
    /// Description for the user.
    pub meaning: &'static str,
    /// Key presses that trigger it; empty for a binding that is only displayed.
    pub triggers: &'static [Trigger],
    /// The action.
    pub action: BoundAction<T>,
}

/// Bindings of one subject.
#[derive(Clone, Debug)]
pub struct KeyGroup<T> {
    /// The subject.
    pub title: &'static str,
    /// Its lines.
    pub bindings: Vec<KeyBinding<T>>,
}

/// A binding of a tool, with its place in the table.
#[derive(Clone, Debug)]
pub struct ToolKey<T> {
    /// Meaning of the binding above it.
    pub below: &'static str,
    /// The binding.
    pub binding: KeyBinding<T>,
}

impl<T> KeyBinding<T> {
    /// The binding of a tool, placed in the table below the one of this meaning.
    pub fn below(self, meaning: &'static str) -> ToolKey<T> {
        ToolKey { below: meaning, binding: self }
    }
}

impl<T> ToolKey<T> {
    /// The same binding, where `convert` takes the tool's actions to another type.
    pub fn map<U>(self, convert: impl Fn(T) -> U) -> ToolKey<U> {
        let Self { below, binding: KeyBinding { keys, meaning, triggers, action } } = self;
        let action = match action {
            BoundAction::Action(action) => BoundAction::Action(action.map(convert)),
            BoundAction::AtCursor(action) => BoundAction::AtCursor(action),
            BoundAction::ToolAtCursor(action) => BoundAction::ToolAtCursor(convert(action)),
            BoundAction::Each(all) => {
                BoundAction::Each(all.into_iter().map(|(name, action)| (name, convert(action))).collect())
            }
            BoundAction::Described => BoundAction::Described,
        };
        ToolKey { below, binding: KeyBinding { keys, meaning, triggers, action } }
    }
}

/// Describes what a mouse gesture does.
pub fn mouse<T>(keys: &'static str, meaning: &'static str) -> KeyBinding<T> {
    KeyBinding { keys, meaning, triggers: &[], action: BoundAction::Described }
}

/// An action of the window.
pub fn key<T>(
    keys: &'static str,
    meaning: &'static str,
    triggers: &'static [Trigger],
    action: Action,
) -> KeyBinding<T> {
    KeyBinding { keys, meaning, triggers, action: BoundAction::Action(UserAction::Window(action)) }
}

/// An action of a tool.
pub fn tool_key<T>(
    keys: &'static str,
    meaning: &'static str,
    triggers: &'static [Trigger],
    action: T,
) -> KeyBinding<T> {
    KeyBinding { keys, meaning, triggers, action: BoundAction::Action(UserAction::Tool(action)) }
}

/// An action of a tool at the cursor.
pub fn tool_at_cursor<T>(
    keys: &'static str,
    meaning: &'static str,
    triggers: &'static [Trigger],
    action: T,
) -> KeyBinding<T> {
    KeyBinding { keys, meaning, triggers, action: BoundAction::ToolAtCursor(action) }
}

fn at_cursor<T>(
    keys: &'static str,
    meaning: &'static str,
    triggers: &'static [Trigger],
    action: CursorAction,
) -> KeyBinding<T> {
    KeyBinding { keys, meaning, triggers, action: BoundAction::AtCursor(action) }
}

/// A command of the window without a key, listed in the palette only.
pub fn command<T>(meaning: &'static str, action: Action) -> KeyBinding<T> {
    key("", meaning, &[], action)
}

use Trigger::{Char, Ctrl, Key};

/// All bindings of the window and its tools.
#[derive(Clone, Debug)]
pub struct KeyTable<T> {
    groups: Vec<KeyGroup<T>>,
}

impl<T: Clone> KeyTable<T> {
    /// The bindings of the window, with those of tools added below the lines that they name, which may be of a tool before them.
    pub fn new(tools: Vec<ToolKey<T>>) -> Self {
        let mut groups = vec![
            KeyGroup { title: "Camera", bindings: camera() },
            KeyGroup { title: "Changes", bindings: changes() },
            KeyGroup { title: "Picture", bindings: picture() },
            KeyGroup { title: "Files", bindings: files() },
            KeyGroup { title: "Window", bindings: window() },
        ];
        for ToolKey { below, binding } in tools {
            let is_above = |binding: &KeyBinding<T>| binding.meaning == below;
            let group = groups.iter().position(|group| group.bindings.iter().any(is_above));
            debug_assert!(group.is_some(), "no binding has the meaning {below:?}");
            let bindings = &mut groups[group.unwrap_or(0)].bindings;
            let line = bindings.iter().position(is_above).map_or(bindings.len(), |line| line + 1);
            bindings.insert(line, binding);
        }
        Self { groups }
    }

    /// The bindings by subject.
    pub fn groups(&self) -> &[KeyGroup<T>] {
        &self.groups
    }

    /// All bindings.
    pub fn bindings(&self) -> impl Iterator<Item = &KeyBinding<T>> {
        self.groups.iter().flat_map(|group| &group.bindings)
    }

    /// Looks up a pressed key: physical key, and character of the keyboard layout.
    pub fn lookup(&self, code: Option<KeyCode>, text: Option<char>, held: Held) -> Option<BoundAction<T>> {
        let text = text.and_then(|c| c.to_lowercase().next());
        let plain = !held.ctrl && !held.flying;
        let fires = |trigger: &Trigger| match *trigger {
            Char(c) => plain && text == Some(c),
            Ctrl(c, with_shift) => held.ctrl && held.shift == with_shift && text == Some(c),
            Key(k) => plain && code == Some(k),
        };
        self.bindings().find_map(|binding| {
            let number = binding.triggers.iter().position(fires)?;
            Some(match &binding.action {
                BoundAction::Each(all) => {
                    let (_, action) = all.get(number)?;
                    BoundAction::Action(UserAction::Tool(action.clone()))
                }
                action => action.clone(),
            })
        })
    }
}

fn camera<T>() -> Vec<KeyBinding<T>> {
    vec![
        mouse("Left drag", "orbit"),
        mouse("Middle drag, Shift+left drag", "pan"),
        mouse("Wheel", "closer, farther"),
        mouse("Right drag", "look around"),
        mouse("Right held + W A S D Q E", "fly; Q down, E up, Shift faster"),
        mouse("Right held + wheel", "flying speed"),
        mouse("Shift+wheel", "field of view"),
        key("[", "narrower field of view", &[Char('[')], Action::Gesture(Gesture::Fov(-FOV_STEP))),
        key("]", "wider field of view", &[Char(']')], Action::Gesture(Gesture::Fov(FOV_STEP))),
    ]
}

fn changes<T>() -> Vec<KeyBinding<T>> {
    vec![
        mouse("Click", "select an object"),
        key("Ctrl+Z", "undo", &[Ctrl('z', false)], Action::Undo),
        key("Ctrl+Shift+Z, Ctrl+Y", "redo", &[Ctrl('z', true), Ctrl('y', false)], Action::Redo),
        key(
            "Ctrl+Shift+R",
            "start over: scene, camera, method, display and panel as they were opened",
            &[Ctrl('r', true)],
            Action::StartOver,
        ),
    ]
}

fn picture<T>() -> Vec<KeyBinding<T>> {
    vec![
        mouse("Ctrl+wheel", "zoom into the picture"),
        mouse("Ctrl+left drag", "move the magnified picture"),
        at_cursor("+", "zoom into the picture at the cursor", &[Char('+'), Char('=')], CursorAction::ZoomIn),
        at_cursor("-", "zoom out of the picture", &[Char('-')], CursorAction::ZoomOut),
        key("0", "the whole picture", &[Char('0')], Action::ResetView),
        at_cursor("Z", "a pixel of the picture as one of the window", &[Char('z')], CursorAction::ShowPixels),
        key("N", "a new picture, as large as the window", &[Char('n')], Action::FillWindow),
        key("Space", "pause the render, or go on", &[Key(KeyCode::Space)], Action::TogglePause),
    ]
}

fn files<T>() -> Vec<KeyBinding<T>> {
    vec![
        key("Ctrl+O", "open a scene or a model", &[Ctrl('o', false)], Action::OpenDialog),
        key("Ctrl+Shift+S", "save picture or scene as …", &[Ctrl('s', true)], Action::SaveDialog),
        key("E", "save the sums as EXR", &[Char('e')], Action::SaveExr),
    ]
}

fn window<T>() -> Vec<KeyBinding<T>> {
    vec![
        key("Tab", "show or hide the panel", &[Key(KeyCode::Tab)], Action::TogglePanel),
        key("F6", "go to the panel by keyboard; Escape leaves it", &[Key(KeyCode::F6)], Action::EnterPanel),
        command("show the tab Render", Action::ShowTab(PanelTab::Render)),
        command("show the tab Look", Action::ShowTab(PanelTab::Look)),
        command("show the tab Scene", Action::ShowTab(PanelTab::Scene)),
        command("show the tab Files", Action::ShowTab(PanelTab::Files)),
        key("Ctrl+K", "find a command by its name", &[Ctrl('k', false)], Action::TogglePalette),
        key("F11", "full screen", &[Key(KeyCode::F11)], Action::ToggleFullscreen),
        key(
            "Ctrl+Plus",
            "larger text",
            &[Ctrl('+', false), Ctrl('=', false), Ctrl('+', true)],
            Action::ScaleText(1),
        ),
        key("Ctrl+Minus", "smaller text", &[Ctrl('-', false)], Action::ScaleText(-1)),
        key("?, F1", "this list", &[Char('?'), Key(KeyCode::F1)], Action::ToggleHelp),
        key(
            "Esc",
            "close the list, release the region, select nothing",
            &[Key(KeyCode::Escape)],
            Action::Cancel,
        ),
        key("Ctrl+Q", "quit", &[Ctrl('q', false)], Action::Quit),
    ]
}

/// Modifiers held while a key is pressed.
#[derive(Clone, Copy, Debug, Default)]
pub struct Held {
    /// Ctrl.
    pub ctrl: bool,
    /// Shift.
    pub shift: bool,
    /// The right mouse button: letters fly the camera.
    pub flying: bool,
}
