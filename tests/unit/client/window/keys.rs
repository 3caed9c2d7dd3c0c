//! Tests of `client::window::keys`.

use Trigger::{Char, Ctrl, Key};
use pointillist::client::window::keys::*;
use winit::keyboard::KeyCode;

fn bindings() -> impl Iterator<Item = &'static KeyBinding> {
    GROUPS.iter().flat_map(|group| group.bindings)
}

#[test]
fn no_trigger_stands_twice() {
    let all: Vec<Trigger> = bindings().flat_map(|b| b.triggers.iter().copied()).collect();
    for (i, trigger) in all.iter().enumerate() {
        assert!(!all[..i].contains(trigger), "{trigger:?} stands twice");
    }
}

#[test]
fn every_line_can_be_reached_and_says_something() {
    for binding in bindings() {
        assert!(!binding.meaning.is_empty());
        // Commands without a key stand in the palette.
        let is_command = matches!(binding.action, BoundAction::Action(_));
        assert!(!binding.keys.is_empty() || is_command && binding.triggers.is_empty());
        let is_described = binding.action == BoundAction::Described;
        assert_eq!(binding.triggers.is_empty(), is_described || binding.keys.is_empty());
        for trigger in binding.triggers {
            let found = match *trigger {
                Char(c) => lookup(None, Some(c), Held::default()),
                Ctrl(c, shift) => lookup(None, Some(c), Held { ctrl: true, shift, flying: false }),
                Key(code) => lookup(Some(code), None, Held::default()),
            };
            assert_eq!(found, Some(&binding.action), "{}", binding.keys);
        }
    }
}

#[test]
fn plain_keys_are_silent_while_flying_and_with_control() {
    let flying = Held { flying: true, ..Held::default() };
    let ctrl = Held { ctrl: true, ..Held::default() };
    for c in ['w', 'a', 's', 'd', 'q', 'e', 'E', 'p', 'f'] {
        assert_eq!(lookup(None, Some(c), flying), None, "{c}");
    }
    assert_eq!(lookup(None, Some('p'), ctrl), None);
    assert_eq!(lookup(Some(KeyCode::Tab), None, ctrl), None);
    assert!(lookup(None, Some('Z'), Held { shift: true, ..ctrl }).is_some());
}
