//! Tests of `client::window::keys`.

use Trigger::{Char, Ctrl, Key};
use pointillist::client::window::action::UserAction;
use pointillist::client::window::keys::*;
use winit::keyboard::KeyCode;

/// The keys of the window with one action of a tool on two keys.
fn table() -> KeyTable<u8> {
    let binding = KeyBinding {
        keys: "Ctrl+8, 8",
        meaning: "one of two",
        triggers: &[Ctrl('8', false), Char('8')],
        action: BoundAction::Each(vec![("One".into(), 1), ("Two".into(), 2)]),
    };
    KeyTable::new(vec![binding.below("undo")])
}

/// The tool stands where it asks to, and each of its keys has an action of its own.
#[test]
fn tools_have_keys() {
    let table = table();
    let meanings: Vec<_> = table.bindings().map(|binding| binding.meaning).collect();
    let at = meanings.iter().position(|meaning| *meaning == "one of two").expect("a line");
    assert_eq!((meanings[at - 1], meanings[at + 1]), ("undo", "redo"));
    let pressed = |ctrl| table.lookup(None, Some('8'), Held { ctrl, ..Held::default() });
    assert_eq!(pressed(true), Some(BoundAction::Action(UserAction::Tool(1))));
    assert_eq!(pressed(false), Some(BoundAction::Action(UserAction::Tool(2))));
}

#[test]
fn no_trigger_stands_twice() {
    let all: Vec<Trigger> = table().bindings().flat_map(|b| b.triggers.iter().copied()).collect();
    for (i, trigger) in all.iter().enumerate() {
        assert!(!all[..i].contains(trigger), "{trigger:?} stands twice");
    }
}

#[test]
fn every_line_can_be_reached_and_says_something() {
    let table = KeyTable::<u8>::new(Vec::new());
    for binding in table.bindings() {
        assert!(!binding.meaning.is_empty());
        // Commands without a key stand in the palette.
        let is_command = matches!(binding.action, BoundAction::Action(_));
        assert!(!binding.keys.is_empty() || is_command && binding.triggers.is_empty());
        let is_described = binding.action == BoundAction::Described;
        assert_eq!(binding.triggers.is_empty(), is_described || binding.keys.is_empty());
        for trigger in binding.triggers {
            let found = match *trigger {
                Char(c) => table.lookup(None, Some(c), Held::default()),
                Ctrl(c, shift) => table.lookup(None, Some(c), Held { ctrl: true, shift, flying: false }),
                Key(code) => table.lookup(Some(code), None, Held::default()),
            };
            assert_eq!(found.as_ref(), Some(&binding.action), "{}", binding.keys);
        }
    }
}

#[test]
fn plain_keys_are_silent_while_flying_and_with_control() {
    let table = table();
    let flying = Held { flying: true, ..Held::default() };
    let ctrl = Held { ctrl: true, ..Held::default() };
    for c in ['w', 'a', 's', 'd', 'q', 'e', 'E', 'p', 'f'] {
        assert_eq!(table.lookup(None, Some(c), flying), None, "{c}");
    }
    assert_eq!(table.lookup(None, Some('p'), ctrl), None);
    assert_eq!(table.lookup(Some(KeyCode::Tab), None, ctrl), None);
    assert!(table.lookup(None, Some('Z'), Held { shift: true, ..ctrl }).is_some());
}
