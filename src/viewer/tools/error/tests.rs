//! The section of the error: what it states, and what it asks for.

use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;

use super::*;
use crate::client::window::action::UserAction;

fn known() -> ErrorSummary {
    let curve = |t: f64| [t, 0.2 * t.powf(-0.6)];
    let word = |value: &str, interval: &str| [value.to_owned(), interval.to_owned()];
    ErrorSummary {
        quantiles: Some([
            word("1.10 %", "1.05–1.16 %"),
            word("2.31 %", "2.19–2.44 %"),
            word("3.40 %", "3.11–3.72 %"),
        ]),
        filtered: Some("0.91 % (0.84–0.99 %) through the noise filter".into()),
        checkpoints: (0..16).map(|i| curve(0.6 * 1.25f64.powi(i))).collect(),
        fit: (0..20).map(|i| curve(3.0 * 1.25f64.powi(i))).collect(),
        prediction: Some([62.0, 56.0, 75.0]),
        warning: None,
        unfound: None,
        message: "1 % in about 42 s (90 %: 36–55 s)".into(),
        seconds: 20.0,
    }
}

fn harness(summary: Option<ErrorSummary>) -> Harness<'static, ActionQueue<ErrorAction>> {
    let tool = ErrorFigures { summary, target: 0.01, ..ErrorFigures::default() };
    let draw = move |ui: &mut Ui, queue: &mut ActionQueue<ErrorAction>| show(ui, &tool, queue);
    let mut harness = Harness::builder().build_ui_state(draw, ActionQueue::default());
    harness.run_steps(3);
    assert_eq!(harness.state_mut().take(), [], "nothing comes by itself");
    harness
}

#[test]
fn error_and_prediction_are_told() {
    let full = harness(Some(known()));
    for what in [
        "2.31 %",
        "or less in 95 % (90 %: 2.19–2.44 %)",
        "median 1.10 % (1.05–1.16 %)",
        "99 % 3.40 % (3.11–3.72 %)",
        "0.91 % (0.84–0.99 %) through the noise filter",
        "1 % in about 42 s (90 %: 36–55 s)",
    ] {
        full.get_by_label(what);
    }
    // Nothing known yet, and nothing to be known.
    let message = "not known yet: after 4 samples per pixel".to_owned();
    let early = harness(Some(ErrorSummary { message, ..ErrorSummary::default() }));
    early.get_by_label("error not known yet: after 4 samples per pixel");
    assert!(early.query_by_label("2.31 %").is_none());
    harness(None).get_by_label("Not known: one randomisation only (--replicates 1).");
}

#[test]
fn a_target_and_a_method_are_chosen() {
    let unfound = UnfoundSummary { text: "light is missing".into(), method: Some("light") };
    let mut harness = harness(Some(ErrorSummary { unfound: Some(unfound), ..known() }));
    harness.get_by_role(egui::accesskit::Role::ComboBox).click();
    harness.run_steps(2);
    harness.get_by_label("0.5 %").click();
    harness.run_steps(2);
    assert_eq!(harness.state_mut().take(), [UserAction::Tool(ErrorAction::SetTarget(0.005))]);
    harness.get_by_label("Find it by light").click();
    harness.run_steps(2);
    assert_eq!(harness.state_mut().take(), [UserAction::Tool(ErrorAction::FindBy("light"))]);
}

#[test]
fn hostile_errors_are_shown_without_a_panic() {
    let odd = [f64::NAN, f64::INFINITY, -1.0, 0.0, 1e300, 1e-300];
    for (a, b) in odd.into_iter().flat_map(|a| odd.map(|b| (a, b))) {
        harness(Some(ErrorSummary {
            checkpoints: vec![[a, b], [b, a]],
            fit: vec![[a, a], [b, b]],
            prediction: Some([a, b, a]),
            seconds: b,
            ..known()
        }));
    }
}

/// Of two eyes the error is that of the worse, which is said.
#[test]
fn the_worse_eye_is_named() {
    let words = "That is the right eye's picture, the worse one. Left 2.20 %, right 2.31 %, both 2.26 % (2.14–2.39 %)";
    assert!(harness(Some(known())).query_by_label(words).is_none());
    let tool =
        ErrorFigures { summary: Some(known()), of_eyes: Some(words.to_owned()), ..ErrorFigures::default() };
    let draw = move |ui: &mut Ui, queue: &mut ActionQueue<ErrorAction>| show(ui, &tool, queue);
    let mut harness = Harness::builder().build_ui_state(draw, ActionQueue::default());
    harness.run_steps(2);
    harness.get_by_label(words);
}
