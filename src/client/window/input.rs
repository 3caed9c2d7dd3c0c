//! Turns the window's events into [`UserAction`]s. The state machine works on [`InputEvent`]s, plain data that a test can make;
//! [`InputState::on_window_event`] only translates winit's events into them.

use std::time::{Duration, Instant};

use glam::{DVec2, DVec3};
use winit::event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent};
use winit::keyboard::{Key, KeyCode, PhysicalKey};

use crate::client::window::action::{Action, UserAction};
use crate::client::window::keys::{self, BoundAction, Held, KeyTable};
use crate::client::window::navigation::Gesture;

/// Physical pixels that the cursor may move between press and release of a click.
const CLICK: f64 = 4.0;
/// Longest interval between the clicks of a double click.
const DOUBLE_CLICK: Duration = Duration::from_millis(400);
/// A step of the wheel or of a key after a pause of this length begins a new history entry.
const STEP_REST: Duration = Duration::from_millis(500);
/// Touchpad scrolling, in physical pixels, that equals one step of the wheel.
const PIXELS_PER_STEP: f64 = 40.0;
/// Degrees by which a step of the wheel widens the view into a panorama.
const VIEW_STEP: f64 = 5.0;
/// Initial flying speed, in distances to the target per second.
const SPEED: f64 = 0.8;
/// Range of the flying speed.
const SPEEDS: (f64, f64) = (1e-3, 1e3);
/// Factor on the flying speed while Shift is held.
const SHIFT_SPEED: f64 = 4.0;
/// Factor on the flying speed per step of the wheel.
const WHEEL_SPEED: f64 = 1.25;
/// Upper bound on the time step of flying, seconds, so that a stall does not throw the camera away.
const LONGEST_TICK: f64 = 0.1;

/// An event of mouse or keyboard as plain data. Positions are physical pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InputEvent {
    /// The cursor is here.
    Cursor(DVec2),
    /// The cursor has left the window.
    CursorLeft,
    /// A mouse button went down or up.
    Button(MouseButton, bool),
    /// Steps of the wheel, or touchpad pixels ÷ `PIXELS_PER_STEP`; positive is away from the user.
    Wheel(f64),
    /// As `Wheel`, sideways: some systems send this for the wheel with Shift.
    SideWheel(f64),
    /// A key went down or up (without repetitions): its physical key, and the layout's character.
    Key(Option<KeyCode>, Option<char>, bool),
    /// Whether Ctrl and Shift are held.
    Modifiers(bool, bool),
    /// The window has lost the keyboard focus.
    FocusLost,
    /// Size of the picture's area in the window, and displayed size of the whole picture.
    Size(DVec2, DVec2),
}

/// A held mouse button.
#[derive(Clone, Copy, Debug)]
struct Press {
    button: MouseButton,
    from: DVec2,
    /// Whether Shift was held when the button went down.
    shift: bool,
    /// Whether Ctrl was held when the button went down.
    ctrl: bool,
    /// Whether a region is being dragged.
    region: bool,
    /// Whether the cursor has moved too far for a click.
    dragging: bool,
}

/// State of mouse and keyboard: which buttons and keys are held, and where the cursor is.
#[derive(Clone, Debug)]
pub struct InputState {
    /// Size of the picture's area of the window.
    area: DVec2,
    /// Displayed size of the whole picture; camera moves are fractions of it.
    picture: DVec2,
    cursor: Option<DVec2>,
    press: Option<Press>,
    last_click: Option<(Instant, DVec2)>,
    /// Time of the last step of the wheel, or of a key that moves the camera.
    last_step: Option<Instant>,
    ctrl: bool,
    shift: bool,
    /// Which keys of [`FLYING`] are held.
    held: [bool; FLYING.len()],
    speed: f64,
    /// Whether the next drag with the left button selects a region.
    asks_region: bool,
    /// Whether a view into a panorama is displayed, which the left button and the wheel change instead of the camera.
    looks_around: bool,
}

/// Keys for flying, with directions in camera space: right, up, forward.
const FLYING: [(KeyCode, DVec3); 6] = [
    (KeyCode::KeyW, DVec3::Z),
    (KeyCode::KeyS, DVec3::NEG_Z),
    (KeyCode::KeyA, DVec3::NEG_X),
    (KeyCode::KeyD, DVec3::X),
    (KeyCode::KeyQ, DVec3::NEG_Y),
    (KeyCode::KeyE, DVec3::Y),
];

impl InputState {
    /// Nothing held; `size`: area of the picture in physical pixels.
    pub fn new(size: [u32; 2]) -> Self {
        Self {
            area: DVec2::from(size.map(f64::from)),
            picture: DVec2::from(size.map(f64::from)).max(DVec2::ONE),
            cursor: None,
            press: None,
            last_click: None,
            last_step: None,
            ctrl: false,
            shift: false,
            held: [false; FLYING.len()],
            speed: SPEED,
            asks_region: false,
            looks_around: false,
        }
    }

    /// Sets whether a view into a panorama is displayed.
    pub fn set_looks_around(&mut self, looks_around: bool) {
        self.looks_around = looks_around;
    }

    /// Handles a window event. An event `captured` by the panel starts nothing here, but a release still ends what was started.
    pub fn on_window_event<T: Clone>(
        &mut self,
        event: &WindowEvent,
        captured: bool,
        keys: &KeyTable<T>,
    ) -> Vec<UserAction<T>> {
        let Some(signal) = translate(event, self.looks_around) else { return Vec::new() };
        let starts = matches!(
            signal,
            InputEvent::Button(_, true)
                | InputEvent::Wheel(_)
                | InputEvent::SideWheel(_)
                | InputEvent::Key(_, _, true)
        );
        if captured && starts { Vec::new() } else { self.take(signal, Instant::now(), keys) }
    }

    /// Handles an event that happened at `now`; keys mean what the table says.
    pub fn take<T: Clone>(
        &mut self,
        signal: InputEvent,
        now: Instant,
        keys: &KeyTable<T>,
    ) -> Vec<UserAction<T>> {
        if let InputEvent::Key(code, text, pressed) = signal {
            return self.key(code, text, pressed, now, keys);
        }
        self.respond(signal, now).into_iter().map(UserAction::Window).collect()
    }

    /// Handles an event that is no key, at `now`.
    pub fn respond(&mut self, signal: InputEvent, now: Instant) -> Vec<Action> {
        match signal {
            InputEvent::Cursor(at) => self.cursor_to(at),
            InputEvent::CursorLeft => {
                // While a button is held the window system keeps reporting the cursor, even outside the window.
                if self.press.is_none() {
                    self.cursor = None;
                }
                Vec::new()
            }
            InputEvent::Button(button, true) => self.press(button),
            InputEvent::Button(button, false) => self.release(button, now),
            InputEvent::Wheel(steps) => self.wheel(steps, now),
            InputEvent::SideWheel(steps) if self.shift => self.wheel(steps, now),
            InputEvent::SideWheel(_) => Vec::new(),
            InputEvent::Key(..) => Vec::new(),
            InputEvent::Modifiers(ctrl, shift) => {
                (self.ctrl, self.shift) = (ctrl, shift);
                Vec::new()
            }
            InputEvent::FocusLost => {
                let press = self.press.take();
                let moved = press.is_some_and(|p| p.dragging);
                (self.ctrl, self.shift, self.held) = (false, false, [false; FLYING.len()]);
                match press {
                    Some(Press { region: true, .. }) => vec![Action::DragRegion(None)],
                    _ if moved => vec![Action::EndMove],
                    _ => Vec::new(),
                }
            }
            InputEvent::Size(area, picture) => {
                (self.area, self.picture) = (area, picture.max(DVec2::ONE));
                Vec::new()
            }
        }
    }

    /// Flying motion of the last `dt` seconds, while the right button and a flying key are held.
    pub fn tick(&mut self, dt: f64) -> Option<Gesture> {
        if !self.is_flying() || dt.is_nan() || dt <= 0.0 {
            return None;
        }
        let held = FLYING.iter().zip(self.held).filter(|(_, held)| *held);
        let direction = held.map(|((_, direction), _)| *direction).sum::<DVec3>().normalize_or_zero();
        if direction == DVec3::ZERO {
            return None;
        }
        // The press now counts as a drag: its release ends a move and is not a click.
        if let Some(press) = &mut self.press {
            press.dragging = true;
        }
        let faster = if self.shift { SHIFT_SPEED } else { 1.0 };
        Some(Gesture::Fly(direction * (self.speed * faster * dt.min(LONGEST_TICK))))
    }

    /// Whether a flying key is held, so that [`InputState::tick`] must be called every frame.
    pub fn is_moving(&self) -> bool {
        self.is_flying() && self.held.contains(&true)
    }

    /// Whether a button pressed over the picture is still held, so that the panel must not react.
    pub fn is_dragging(&self) -> bool {
        self.press.is_some()
    }

    /// The cursor, physical pixels; `None` outside the window.
    pub fn cursor(&self) -> Option<DVec2> {
        self.cursor
    }

    /// Sets whether the next drag with the left button selects a region.
    pub fn ask_region(&mut self, asks: bool) {
        self.asks_region = asks;
    }

    /// Cancels the dragging of a region, even if the button is held.
    pub fn cancel_region(&mut self) {
        self.asks_region = false;
        self.press.take_if(|press| press.region);
    }

    /// Whether the next drag with the left button selects a region.
    pub fn asks_region(&self) -> bool {
        self.asks_region
    }

    /// Whether Ctrl is held.
    pub fn is_ctrl_held(&self) -> bool {
        self.ctrl
    }

    /// Flying speed, distances to the target per second.
    pub fn speed(&self) -> f64 {
        self.speed
    }

    fn is_flying(&self) -> bool {
        self.press.is_some_and(|p| p.button == MouseButton::Right)
    }

    fn cursor_to(&mut self, at: DVec2) -> Vec<Action> {
        let before = self.cursor.replace(at);
        let (Some(press), Some(before)) = (&mut self.press, before) else { return Vec::new() };
        // The first motion of a drag includes the distance swallowed by the click threshold.
        let from = if press.dragging { before } else { press.from };
        press.dragging |= at.distance(press.from) > CLICK;
        let by = (at - from) / self.picture;
        if !press.dragging || by == DVec2::ZERO {
            return Vec::new();
        }
        if press.region {
            return vec![Action::DragRegion(Some([press.from.to_array(), at.to_array()]))];
        }
        if press.ctrl && press.button == MouseButton::Left {
            return vec![Action::PanView((at - from).to_array())];
        }
        if self.looks_around && press.button == MouseButton::Left {
            return vec![Action::TurnView(by.to_array())];
        }
        vec![Action::Gesture(match press.button {
            MouseButton::Right => Gesture::Look(by),
            MouseButton::Left if !press.shift => Gesture::Orbit(by),
            _ => Gesture::Pan(by),
        })]
    }

    fn press(&mut self, button: MouseButton) -> Vec<Action> {
        let known = matches!(button, MouseButton::Left | MouseButton::Middle | MouseButton::Right);
        // The first button decides. A press without a cursor position can only be an unsupported touch.
        if let (true, None, Some(from)) = (known, self.press, self.cursor) {
            let (shift, ctrl) = (self.shift, self.ctrl);
            let region = button == MouseButton::Left && (self.asks_region || shift && ctrl);
            self.press = Some(Press { button, from, shift, ctrl, region, dragging: false });
            return vec![Action::EndMove];
        }
        Vec::new()
    }

    fn release(&mut self, button: MouseButton, now: Instant) -> Vec<Action> {
        let Some(press) = self.press.take_if(|p| p.button == button) else { return Vec::new() };
        if press.region && press.dragging {
            self.asks_region = false;
            let to = self.cursor.unwrap_or(press.from);
            return vec![Action::TraceRegion([press.from.to_array(), to.to_array()])];
        }
        if press.dragging {
            return vec![Action::EndMove];
        }
        if button != MouseButton::Left || press.shift || press.ctrl {
            return Vec::new();
        }
        let again = self.last_click.take().is_some_and(|(when, at)| {
            now.saturating_duration_since(when) <= DOUBLE_CLICK && at.distance(press.from) <= CLICK
        });
        if again {
            return vec![Action::FocusAt(press.from.to_array())];
        }
        self.last_click = Some((now, press.from));
        vec![Action::Pick(press.from.to_array())]
    }

    fn wheel(&mut self, steps: f64, now: Instant) -> Vec<Action> {
        if !steps.is_finite() || steps == 0.0 {
            return Vec::new();
        }
        if self.is_flying() {
            self.speed = (self.speed * WHEEL_SPEED.powf(steps)).clamp(SPEEDS.0, SPEEDS.1);
            return Vec::new();
        }
        match (self.ctrl, self.shift, self.cursor) {
            (true, true, _) => vec![Action::Expose(steps)],
            (true, false, Some(at)) => vec![Action::ZoomAt(at.to_array(), steps)],
            (true, false, None) => Vec::new(),
            (false, false, _) if self.looks_around => vec![Action::WidenView(-VIEW_STEP * steps)],
            (false, true, _) => self.step(Gesture::Fov(-keys::FOV_STEP * steps), now),
            (false, false, _) => self.step(Gesture::Dolly(steps), now),
        }
    }

    /// A step of the wheel or of a key; after a pause a new history entry begins. A panorama has no field of view, but the view into it does.
    fn step(&mut self, gesture: Gesture, now: Instant) -> Vec<Action> {
        if let (true, Gesture::Fov(by)) = (self.looks_around, gesture) {
            return vec![Action::WidenView(by)];
        }
        let last = self.last_step.replace(now);
        let rested = last.is_none_or(|last| now.saturating_duration_since(last) > STEP_REST);
        rested.then_some(Action::EndMove).into_iter().chain([Action::Gesture(gesture)]).collect()
    }

    fn key<T: Clone>(
        &mut self,
        code: Option<KeyCode>,
        text: Option<char>,
        pressed: bool,
        now: Instant,
        keys: &KeyTable<T>,
    ) -> Vec<UserAction<T>> {
        let flying = self.is_flying();
        if let Some(place) = FLYING.iter().position(|(key, _)| Some(*key) == code) {
            // Recorded even before the right button is pressed, since the camera flies from then on.
            self.held[place] = pressed;
        }
        if !pressed {
            return Vec::new();
        }
        let held = Held { ctrl: self.ctrl, shift: self.shift, flying };
        let cursor = self.cursor.filter(|at| at.cmplt(self.area).all()).map(|at| at.to_array());
        match (keys.lookup(code, text, held), cursor) {
            (Some(BoundAction::Action(UserAction::Window(Action::Gesture(gesture)))), _) => {
                self.step(gesture, now).into_iter().map(UserAction::Window).collect()
            }
            (Some(BoundAction::Action(action)), _) => vec![action],
            (Some(BoundAction::AtCursor(action)), Some(at)) => vec![UserAction::Window(action.at(at))],
            (Some(BoundAction::ToolAtCursor(action)), Some(at)) => vec![UserAction::ToolAt(action, at)],
            _ => Vec::new(),
        }
    }
}

/// Translates a winit event; `None` if it does not concern mouse or keyboard. Keys count once while they are held, except for arrows that turn a
/// view.
fn translate(event: &WindowEvent, looks_around: bool) -> Option<InputEvent> {
    use KeyCode::{ArrowDown, ArrowLeft, ArrowRight, ArrowUp};
    let repeats = |key: &PhysicalKey| {
        looks_around && matches!(key, PhysicalKey::Code(ArrowLeft | ArrowRight | ArrowUp | ArrowDown))
    };
    Some(match event {
        WindowEvent::CursorMoved { position, .. } => InputEvent::Cursor(DVec2::new(position.x, position.y)),
        WindowEvent::CursorLeft { .. } => InputEvent::CursorLeft,
        WindowEvent::MouseInput { state, button, .. } => {
            InputEvent::Button(*button, *state == ElementState::Pressed)
        }
        WindowEvent::MouseWheel { delta, .. } => {
            let (x, y) = match delta {
                MouseScrollDelta::LineDelta(x, y) => (f64::from(*x), f64::from(*y)),
                MouseScrollDelta::PixelDelta(by) => (by.x / PIXELS_PER_STEP, by.y / PIXELS_PER_STEP),
            };
            if y == 0.0 { InputEvent::SideWheel(x) } else { InputEvent::Wheel(y) }
        }
        WindowEvent::KeyboardInput { event, .. } if !event.repeat || repeats(&event.physical_key) => {
            let code = match event.physical_key {
                PhysicalKey::Code(code) => Some(code),
                PhysicalKey::Unidentified(_) => None,
            };
            let text = match &event.logical_key {
                Key::Character(text) => text.chars().next(),
                _ => None,
            };
            InputEvent::Key(code, text, event.state == ElementState::Pressed)
        }
        WindowEvent::ModifiersChanged(modifiers) => {
            let state = modifiers.state();
            InputEvent::Modifiers(state.control_key(), state.shift_key())
        }
        WindowEvent::Focused(false) => InputEvent::FocusLost,
        _ => return None,
    })
}
