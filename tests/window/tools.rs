//! The panel, found by what a screen reader would say of them and used by mouse and keyboard, without a display. The tools have such
//! tests beside their code.

use egui::{Key, Modifiers};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use pointillist::client::window::action::Action;
use pointillist::client::window::panel::{PanelControls, PanelData, PanelTab};

use crate::headless_panel::{controls, readout, show};

/// The panel with its data, and the actions that it asked for.
struct Tools {
    data: PanelData,
    controls: PanelControls,
    actions: Vec<Action>,
}

fn harness(data: PanelData, controls: PanelControls) -> Harness<'static, Tools> {
    let tools = Tools { data, controls, actions: Vec::new() };
    let draw = |ui: &mut egui::Ui, tools: &mut Tools| {
        tools.actions.extend(show(ui, &tools.data, &mut tools.controls));
    };
    let mut harness = Harness::builder().with_size([900.0, 900.0]).build_ui_state(draw, tools);
    harness.run_steps(3);
    harness
}

fn taken(harness: &mut Harness<'static, Tools>) -> Vec<Action> {
    harness.run_steps(2);
    std::mem::take(&mut harness.state_mut().actions)
}

#[test]
fn tabs_are_brought_to_the_front_by_their_names() {
    let mut harness = harness(readout(), controls());
    for tab in PanelTab::ALL {
        harness.get_by_label(tab.title()).click();
        harness.run_steps(2);
        assert!(harness.state().controls.layout.shows(tab), "{tab:?}");
        let others = PanelTab::ALL.into_iter().filter(|other| *other != tab);
        assert!(others.into_iter().all(|other| !harness.state().controls.layout.shows(other)));
    }
}

#[test]
fn commands_are_found_and_run_by_keyboard_alone() {
    let mut harness = harness(readout(), controls());
    harness.state_mut().controls.palette.toggle();
    harness.run_steps(2);
    harness.event(egui::Event::Text("full".to_owned()));
    harness.run_steps(2);
    harness.get_by_label("Full screen");
    harness.key_press(Key::Enter);
    assert_eq!(taken(&mut harness), [Action::ToggleFullscreen]);
    assert!(!harness.state().controls.palette.is_open);
    // Escape runs nothing.
    harness.state_mut().controls.palette.toggle();
    harness.run_steps(2);
    harness.key_press(Key::Escape);
    assert_eq!(taken(&mut harness), []);
    assert!(!harness.state().controls.palette.is_open);
    // The arrows choose.
    harness.state_mut().controls.palette.toggle();
    harness.run_steps(2);
    harness.event(egui::Event::Text("field of view".to_owned()));
    harness.run_steps(2);
    harness.key_press(Key::ArrowDown);
    harness.run_steps(2);
    harness.key_press(Key::Enter);
    let [Action::Gesture(_)] = taken(&mut harness)[..] else {
        panic!("the second command is the wider view")
    };
}

/// Any size of the picture can be typed; only the whole number counts.
#[test]
fn the_picture_is_given_a_size() {
    let mut harness = harness(PanelData { extent: [512, 384], ..readout() }, controls());
    harness.get_by_label("Fill window").click();
    assert_eq!(taken(&mut harness), [Action::FillWindow]);
    let field = |harness: &Harness<'static, Tools>, n: usize| {
        harness.get_all_by_role(egui::accesskit::Role::SpinButton).nth(n).expect("a number").click();
    };
    for (n, text, wanted) in [(0, "1024", [1024, 384]), (1, "768", [512, 768])] {
        field(&harness, n);
        harness.run_steps(2);
        harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
        harness.event(egui::Event::Text(text.to_owned()));
        assert_eq!(taken(&mut harness), [], "the number may go on");
        harness.key_press(Key::Enter);
        assert_eq!(taken(&mut harness), [Action::SetPictureSize(wanted)]);
    }
    // The same number again asks for nothing, and so does one that is given up.
    field(&harness, 0);
    harness.run_steps(2);
    harness.key_press(Key::Enter);
    assert_eq!(taken(&mut harness), []);
    let types = |harness: &mut Harness<'static, Tools>, text: &str| {
        harness.run_steps(2);
        harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
        harness.event(egui::Event::Text(text.to_owned()));
        harness.run_steps(2);
    };
    field(&harness, 0);
    types(&mut harness, "700");
    harness.key_press(Key::Escape);
    assert_eq!(taken(&mut harness), []);
    // Both sides are one change.
    field(&harness, 0);
    types(&mut harness, "1024");
    harness.key_press(Key::Tab);
    assert_eq!(taken(&mut harness), []);
    types(&mut harness, "768");
    harness.key_press(Key::Enter);
    assert_eq!(taken(&mut harness), [Action::SetPictureSize([1024, 768])]);
}

#[test]
fn the_panel_is_entered_and_used_by_keyboard() {
    let mut harness = harness(readout(), controls());
    harness.state_mut().controls.enters = true;
    harness.run_steps(2);
    // The first button of the bar has the keyboard.
    harness.key_press(Key::Enter);
    assert_eq!(taken(&mut harness), [Action::OpenDialog]);
    harness.key_press(Key::Tab);
    harness.run_steps(2);
    harness.key_press(Key::Tab);
    harness.run_steps(2);
    harness.key_press(Key::Enter);
    assert_eq!(taken(&mut harness), [Action::Undo]);
    harness.key_press_modifiers(Modifiers::SHIFT, Key::Tab);
    harness.run_steps(2);
    harness.key_press(Key::Enter);
    assert_eq!(taken(&mut harness), [Action::SaveDialog]);
}
