//! Input: the meaning of drags, clicks, the wheel and keys.

use std::convert::Infallible;
use std::time::{Duration, Instant};

use glam::DVec2;
use pointillist::client::window::action::{Action, UserAction};
use pointillist::client::window::input::{InputEvent, InputState};
use pointillist::client::window::keys::KeyTable;
use pointillist::client::window::navigation::Gesture;
use winit::event::MouseButton;
use winit::keyboard::KeyCode;

struct Hand(InputState, Instant);

impl Hand {
    fn new() -> Self {
        let mut hand = Self(InputState::new([200, 100]), Instant::now());
        hand.to(50.0, 50.0);
        hand
    }

    fn give(&mut self, signal: InputEvent) -> Vec<Action> {
        let actions = self.0.take(signal, self.1, &KeyTable::<Infallible>::new(Vec::new()));
        let of_window = |action| match action {
            UserAction::Window(action) => action,
            UserAction::Tool(_) | UserAction::ToolAt(..) | UserAction::AskPlace(_) => panic!("no tools"),
        };
        actions.into_iter().map(of_window).collect()
    }

    fn to(&mut self, x: f64, y: f64) -> Vec<Action> {
        self.give(InputEvent::Cursor(DVec2::new(x, y)))
    }

    fn button(&mut self, button: MouseButton, down: bool) -> Vec<Action> {
        self.give(InputEvent::Button(button, down))
    }

    fn key(&mut self, code: KeyCode, text: char) -> Vec<Action> {
        self.give(InputEvent::Key(Some(code), Some(text), true))
    }
}

#[test]
fn buttons_drag_what_they_should() {
    use MouseButton::{Left, Middle, Right};
    let by = DVec2::new(0.1, 0.2);
    let cases = [
        (Left, false, Gesture::Orbit(by)),
        (Left, true, Gesture::Pan(by)),
        (Middle, false, Gesture::Pan(by)),
        (Right, false, Gesture::Look(by)),
    ];
    for (button, shift, gesture) in cases {
        let mut hand = Hand::new();
        hand.give(InputEvent::Modifiers(false, shift));
        assert_eq!(hand.button(button, true), [Action::EndMove]);
        assert_eq!(hand.to(52.0, 51.0), [], "within the threshold");
        assert_eq!(hand.to(70.0, 70.0), [Action::Gesture(gesture)], "nothing of the way is lost");
        assert!(hand.0.is_dragging());
        // Another button in between changes nothing.
        let other = if button == Left { Right } else { Left };
        assert_eq!((hand.button(other, true), hand.button(other, false)), (vec![], vec![]));
        assert_eq!(hand.button(button, false), [Action::EndMove]);
        assert_eq!(hand.to(90.0, 90.0), []);
    }
}

#[test]
fn clicks_pick_and_double_clicks_focus() {
    let mut hand = Hand::new();
    let click = |hand: &mut Hand, after: u64| {
        hand.1 += Duration::from_millis(after);
        hand.button(MouseButton::Left, true);
        hand.to(52.0, 50.0);
        let intents = hand.button(MouseButton::Left, false);
        hand.to(50.0, 50.0);
        intents
    };
    assert_eq!(click(&mut hand, 0), [Action::Pick([50.0, 50.0])]);
    assert_eq!(click(&mut hand, 300), [Action::FocusAt([50.0, 50.0])]);
    assert_eq!(click(&mut hand, 300), [Action::Pick([50.0, 50.0])], "a third click begins anew");
    assert_eq!(click(&mut hand, 900), [Action::Pick([50.0, 50.0])]);
    assert_eq!(hand.key(KeyCode::KeyZ, 'z'), [Action::ShowPixels([50.0, 50.0])]);
    hand.give(InputEvent::CursorLeft);
    assert_eq!(hand.key(KeyCode::KeyZ, 'z'), []);
    assert_eq!(hand.button(MouseButton::Left, true), [], "no cursor, no press");
}

#[test]
fn flying_needs_the_right_button_and_keeps_other_keys_silent() {
    let mut hand = Hand::new();
    assert_eq!(hand.key(KeyCode::KeyW, 'w'), []);
    assert_eq!(hand.0.tick(0.01), None);
    assert_eq!(hand.key(KeyCode::KeyE, 'e'), [Action::SaveExr]);
    for key in [KeyCode::KeyW, KeyCode::KeyE] {
        assert_eq!(hand.give(InputEvent::Key(Some(key), None, false)), []);
    }
    hand.button(MouseButton::Right, true);
    assert_eq!(hand.0.tick(0.01), None, "none is held any more");
    assert_eq!(hand.key(KeyCode::KeyE, 'e'), []);
    assert_eq!(hand.key(KeyCode::KeyD, 'd'), []);
    let Some(Gesture::Fly(slow)) = hand.0.tick(0.01) else { panic!("no flight") };
    assert!((slow.length() - 0.01 * hand.0.speed()).abs() < 1e-15 && slow.x > 0.0 && slow.x == slow.y);
    hand.give(InputEvent::Modifiers(false, true));
    let Some(Gesture::Fly(fast)) = hand.0.tick(0.01) else { panic!("no flight") };
    assert!((fast.length() / slow.length() - 4.0).abs() < 1e-12);
    let speed = hand.0.speed();
    assert_eq!(hand.give(InputEvent::Wheel(2.0)), []);
    assert!(hand.0.speed() > speed * 1.5);
    let Some(Gesture::Fly(long)) = hand.0.tick(100.0) else { panic!("no flight") };
    assert!(long.length() <= hand.0.speed() * 0.4 + 1e-12, "a stall does not throw the camera away");
    assert_eq!(hand.button(MouseButton::Right, false), [Action::EndMove]);
    assert!(!hand.0.is_moving() && hand.0.tick(0.01).is_none());
}

/// The result is the same whether the key or the button comes first, and again after the button was released.
#[test]
fn a_key_held_before_the_button_flies_too() {
    let mut hand = Hand::new();
    hand.key(KeyCode::KeyW, 'w');
    for _ in 0..2 {
        assert!(!hand.0.is_moving());
        hand.button(MouseButton::Right, true);
        let Some(Gesture::Fly(by)) = hand.0.tick(0.01) else { panic!("no flight") };
        assert!(by.z > 0.0);
        hand.button(MouseButton::Right, false);
    }
}

#[test]
fn keys_that_step_are_one_move_until_they_rest() {
    let mut hand = Hand::new();
    let wider = Action::Gesture(Gesture::Fov(2.0));
    assert_eq!(hand.key(KeyCode::BracketRight, ']'), [Action::EndMove, wider.clone()]);
    assert_eq!(hand.key(KeyCode::BracketRight, ']'), std::slice::from_ref(&wider));
    hand.1 += Duration::from_secs(1);
    assert_eq!(hand.key(KeyCode::BracketRight, ']'), [Action::EndMove, wider]);
}

#[test]
fn losing_the_keyboard_releases_everything() {
    let mut hand = Hand::new();
    hand.button(MouseButton::Right, true);
    hand.key(KeyCode::KeyW, 'w');
    assert!(hand.0.is_moving());
    hand.0.tick(0.01);
    assert_eq!(hand.give(InputEvent::FocusLost), [Action::EndMove]);
    assert!(!hand.0.is_moving() && !hand.0.is_dragging());
    assert_eq!(hand.to(90.0, 90.0), []);
    assert_eq!(hand.button(MouseButton::Right, false), []);
}

#[test]
fn the_wheel_moves_and_rests() {
    let mut hand = Hand::new();
    assert_eq!(hand.give(InputEvent::Wheel(1.0)), [Action::EndMove, Action::Gesture(Gesture::Dolly(1.0))]);
    assert_eq!(hand.give(InputEvent::Wheel(-0.25)), [Action::Gesture(Gesture::Dolly(-0.25))]);
    hand.1 += Duration::from_secs(1);
    hand.give(InputEvent::Modifiers(false, true));
    assert_eq!(hand.give(InputEvent::Wheel(1.0)), [Action::EndMove, Action::Gesture(Gesture::Fov(-2.0))]);
    assert_eq!(hand.give(InputEvent::SideWheel(1.0)), [Action::Gesture(Gesture::Fov(-2.0))]);
    hand.give(InputEvent::Modifiers(true, false));
    assert_eq!(hand.give(InputEvent::Wheel(2.0)), [Action::ZoomAt([50.0, 50.0], 2.0)]);
    hand.give(InputEvent::Modifiers(true, true));
    assert_eq!(hand.give(InputEvent::Wheel(-1.0)), [Action::Expose(-1.0)]);
    hand.give(InputEvent::Modifiers(false, false));
    assert_eq!(hand.give(InputEvent::SideWheel(1.0)), []);
    assert_eq!(hand.give(InputEvent::Wheel(f64::NAN)), []);
}

#[test]
fn dragging_with_ctrl_moves_the_magnified_picture() {
    let mut hand = Hand::new();
    hand.give(InputEvent::Modifiers(true, false));
    hand.button(MouseButton::Left, true);
    assert_eq!(hand.to(62.0, 45.0), [Action::PanView([12.0, -5.0])]);
    assert_eq!(hand.button(MouseButton::Left, false), [Action::EndMove]);
    hand.button(MouseButton::Left, true);
    assert_eq!(hand.button(MouseButton::Left, false), [], "and selects nothing");
}

#[test]
fn fractions_are_those_of_the_picture() {
    let mut hand = Hand::new();
    // A wide window shows a narrow picture.
    hand.give(InputEvent::Size(DVec2::new(900.0, 300.0), DVec2::new(400.0, 0.0)));
    hand.button(MouseButton::Left, true);
    let [Action::Gesture(Gesture::Orbit(by))] = hand.to(90.0, 50.0)[..] else { panic!("no orbit") };
    assert!((by.x - 0.1).abs() < 1e-15);
}

/// While a view into a panorama is displayed, the left button and the wheel change it; the other buttons move the camera.
#[test]
fn the_left_button_turns_a_view() {
    use MouseButton::{Left, Right};
    for shift in [false, true] {
        let mut hand = Hand::new();
        hand.0.set_looks_around(true);
        hand.give(InputEvent::Modifiers(false, shift));
        hand.button(Left, true);
        assert_eq!(hand.to(70.0, 70.0), [Action::TurnView([0.1, 0.2])]);
        hand.button(Left, false);
        hand.button(Right, true);
        let by = DVec2::new(0.1, -0.2);
        assert_eq!(hand.to(90.0, 50.0), [Action::Gesture(Gesture::Look(by))]);
        hand.button(Right, false);
        let [Action::WidenView(by)] = hand.give(InputEvent::Wheel(1.0))[..] else { panic!("no view") };
        assert!(by < 0.0, "away from the user is closer");
    }
    let mut hand = Hand::new();
    hand.0.set_looks_around(true);
    assert_eq!(hand.key(KeyCode::BracketRight, ']'), [Action::WidenView(2.0)]);
    hand.0.set_looks_around(false);
    assert!(matches!(
        hand.key(KeyCode::BracketRight, ']')[..],
        [Action::EndMove, Action::Gesture(Gesture::Fov(_))]
    ));
    hand.give(InputEvent::Modifiers(true, false));
    hand.0.set_looks_around(true);
    hand.button(Left, true);
    assert_eq!(
        hand.to(70.0, 70.0),
        [Action::PanView([20.0, 20.0])],
        "the magnified picture is moved as ever"
    );
}

/// Ctrl and Shift drag a rectangle, and so does the left button once it is asked for; a click drags none.
#[test]
fn a_rectangle_is_dragged() {
    let now = Instant::now();
    let mut input = InputState::new([100, 100]);
    let send = |input: &mut InputState, event| input.respond(event, now);
    for asked in [false, true] {
        input.ask_region(asked);
        send(&mut input, InputEvent::Modifiers(!asked, !asked));
        send(&mut input, InputEvent::Cursor(DVec2::new(10.0, 20.0)));
        send(&mut input, InputEvent::Button(MouseButton::Left, true));
        assert_eq!(send(&mut input, InputEvent::Cursor(DVec2::new(11.0, 20.0))), []);
        let drawn = [[10.0, 20.0], [60.0, 50.0]];
        let moved = send(&mut input, InputEvent::Cursor(DVec2::new(60.0, 50.0)));
        assert_eq!(moved, [Action::DragRegion(Some(drawn))]);
        assert_eq!(
            send(&mut input, InputEvent::Button(MouseButton::Left, false)),
            [Action::TraceRegion(drawn)]
        );
        assert!(!input.asks_region());
    }
    send(&mut input, InputEvent::Modifiers(true, true));
    send(&mut input, InputEvent::Button(MouseButton::Left, true));
    assert_eq!(send(&mut input, InputEvent::Button(MouseButton::Left, false)), []);
    send(&mut input, InputEvent::Button(MouseButton::Left, true));
    assert_eq!(send(&mut input, InputEvent::FocusLost), [Action::DragRegion(None)]);
}
