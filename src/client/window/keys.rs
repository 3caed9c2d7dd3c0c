//! What keys and buttons do: one table, from which the mapping is looked up and the list of keys in the window is drawn.

use winit::keyboard::KeyCode;

use crate::client::window::input::Intent;
use crate::client::window::navigation::Gesture;
use crate::client::window::panel::Action;

/// Degrees by which a key or a step of the wheel changes the field of view.
pub const FOV_STEP: f64 = 2.0;

/// What a line of the table reacts to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Trigger {
    /// A character of the keyboard's layout, without Ctrl; letters in either case. Not while the right button is held.
    Char(char),
    /// The same with Ctrl; `true`: and with Shift.
    Ctrl(char, bool),
    /// A key by its place. Not while the right button is held.
    Key(KeyCode),
    /// Mouse and held keys: the state machine knows them.
    Hand,
}

/// What a line of the table does.
#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// This.
    Intent(Intent),
    /// Focuses on the point under the cursor.
    FocusAtCursor,
    /// Described only.
    Hand,
}

/// One line of the table.
#[derive(Clone, Debug)]
pub struct Binding {
    /// Keys as the user reads them.
    pub keys: &'static str,
    /// What they do.
    pub meaning: &'static str,
    /// When.
    pub triggers: &'static [Trigger],
    /// What.
    pub effect: Effect,
}

/// Lines of one subject.
#[derive(Clone, Copy, Debug)]
pub struct Group {
    /// Subject.
    pub title: &'static str,
    /// Lines.
    pub bindings: &'static [Binding],
}

const fn hand(keys: &'static str, meaning: &'static str) -> Binding {
    Binding { keys, meaning, triggers: &[Trigger::Hand], effect: Effect::Hand }
}

const fn key(
    keys: &'static str,
    meaning: &'static str,
    triggers: &'static [Trigger],
    intent: Intent,
) -> Binding {
    Binding { keys, meaning, triggers, effect: Effect::Intent(intent) }
}

/// All lines.
pub const GROUPS: &[Group] = &[
    Group { title: "Camera", bindings: CAMERA },
    Group { title: "Camera moves", bindings: MOVES },
    Group { title: "Picture", bindings: PICTURE },
    Group { title: "Window", bindings: WINDOW },
];

const CAMERA: &[Binding] = &[
    hand("Left drag", "orbit"),
    hand("Middle drag, Shift+left drag", "pan"),
    hand("Wheel", "closer, farther"),
    hand("Right drag", "look around"),
    hand("Right held + W A S D Q E", "fly; Q down, E up, Shift faster"),
    hand("Right held + wheel", "flying speed"),
    hand("Ctrl+wheel", "field of view"),
    key("[", "narrower field of view", &[Trigger::Char('[')], Intent::Gesture(Gesture::Fov(-FOV_STEP))),
    key("]", "wider field of view", &[Trigger::Char(']')], Intent::Gesture(Gesture::Fov(FOV_STEP))),
    Binding {
        keys: "F, double click",
        meaning: "focus on the point under the cursor",
        triggers: &[Trigger::Char('f')],
        effect: Effect::FocusAtCursor,
    },
];

const MOVES: &[Binding] = &[
    key("Ctrl+Z", "undo", &[Trigger::Ctrl('z', false)], Intent::Action(Action::Undo)),
    key(
        "Ctrl+Shift+Z, Ctrl+Y",
        "redo",
        &[Trigger::Ctrl('z', true), Trigger::Ctrl('y', false)],
        Intent::Action(Action::Redo),
    ),
    key(
        "R, Home",
        "the file's camera",
        &[Trigger::Char('r'), Trigger::Key(KeyCode::Home)],
        Intent::Action(Action::ResetCamera),
    ),
];

const PICTURE: &[Binding] = &[
    hand("Click", "select an object"),
    key("X", "select nothing", &[Trigger::Char('x')], Intent::Action(Action::Deselect)),
    key("P", "save the picture as PNG", &[Trigger::Char('p')], Intent::Action(Action::SavePng)),
    key("E", "save the sums as EXR", &[Trigger::Char('e')], Intent::Action(Action::SaveExr)),
    key(
        "Ctrl+S",
        "save the scene's changes",
        &[Trigger::Ctrl('s', false)],
        Intent::Action(Action::SaveScene),
    ),
    key("C", "copy the command of this picture", &[Trigger::Char('c')], Intent::Action(Action::CopyCommand)),
];

const WINDOW: &[Binding] = &[
    key("Tab", "show or hide the panel", &[Trigger::Key(KeyCode::Tab)], Intent::TogglePanel),
    key("?, F1", "this list", &[Trigger::Char('?'), Trigger::Key(KeyCode::F1)], Intent::ToggleHelp),
    key("Esc", "close the list, select nothing", &[Trigger::Key(KeyCode::Escape)], Intent::Cancel),
    key("Ctrl+Q", "quit", &[Trigger::Ctrl('q', false)], Intent::Quit),
];

/// The effect of a key that was pressed: its place, the character that the layout gives it, and whether Ctrl, Shift and
/// the right mouse button are held.
pub fn effect(
    code: Option<KeyCode>,
    text: Option<char>,
    [ctrl, shift, flying]: [bool; 3],
) -> Option<&'static Effect> {
    let text = text.and_then(|c| c.to_lowercase().next());
    let fires = |trigger: &Trigger| match *trigger {
        Trigger::Char(c) => !ctrl && !flying && text == Some(c),
        Trigger::Ctrl(c, with_shift) => ctrl && shift == with_shift && text == Some(c),
        Trigger::Key(k) => !ctrl && !flying && code == Some(k),
        Trigger::Hand => false,
    };
    let mut bindings = GROUPS.iter().flat_map(|group| group.bindings);
    bindings.find(|b| b.triggers.iter().any(fires)).map(|b| &b.effect)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_trigger_stands_twice() {
        let all: Vec<Trigger> = GROUPS
            .iter()
            .flat_map(|g| g.bindings)
            .flat_map(|b| b.triggers.iter().copied())
            .filter(|t| *t != Trigger::Hand)
            .collect();
        for (i, trigger) in all.iter().enumerate() {
            assert!(!all[..i].contains(trigger), "{trigger:?} stands twice");
        }
    }

    #[test]
    fn every_line_can_be_reached_and_says_something() {
        for binding in GROUPS.iter().flat_map(|g| g.bindings) {
            assert!(!binding.keys.is_empty() && !binding.meaning.is_empty());
            for trigger in binding.triggers {
                let found = match *trigger {
                    Trigger::Char(c) => effect(None, Some(c), [false; 3]),
                    Trigger::Ctrl(c, shift) => effect(None, Some(c), [true, shift, false]),
                    Trigger::Key(code) => effect(Some(code), None, [false; 3]),
                    Trigger::Hand => continue,
                };
                assert_eq!(found, Some(&binding.effect), "{}", binding.keys);
            }
        }
    }

    #[test]
    fn plain_keys_are_silent_while_flying_and_with_control() {
        for c in ['w', 'a', 's', 'd', 'q', 'e', 'E', 'p', 'f'] {
            assert_eq!(effect(None, Some(c), [false, false, true]), None, "{c}");
        }
        assert_eq!(effect(None, Some('p'), [true, false, false]), None);
        assert_eq!(effect(Some(KeyCode::Tab), None, [true, false, false]), None);
        assert!(effect(None, Some('Z'), [true, true, false]).is_some());
    }
}
