//! The error of the picture: present value, curve, and predicted time to the target.

mod plot;
mod summary;

use egui::{ComboBox, RichText, Ui};
use miette::Result;

use crate::client::window::action::ActionQueue;
use crate::client::window::panel::{PanelData, SectionPlace, section, style};
use crate::viewer::tools::tool::{Tool, ToolContext};

use summary::{ErrorSummary, UnfoundSummary, error_summary, eye_words};

/// Selectable error targets, with their labels.
const TARGETS: [(f64, &str); 7] = [
    (0.1, "10 %"),
    (0.05, "5 %"),
    (0.02, "2 %"),
    (0.01, "1 %"),
    (0.005, "0.5 %"),
    (0.002, "0.2 %"),
    (0.001, "0.1 %"),
];

/// What the user can do about the error.
#[derive(Clone, Debug, PartialEq)]
pub enum ErrorAction {
    /// Sets the relative error that 95 % of the picture shall stay below.
    SetTarget(f64),
    /// Changes to the method of this name, which finds light that the picture lacks.
    FindBy(&'static str),
}

/// The error as the panel shows it.
#[derive(Default)]
pub struct ErrorFigures {
    /// `None` where the render is not divided into replicates.
    summary: Option<ErrorSummary>,
    /// `[seconds, error]` of the checkpoints of the picture that is compared with.
    compared: Vec<[f64; 2]>,
    target: f64,
    /// Of two eyes, whose error it is, and those of both.
    of_eyes: Option<String>,
    /// Name of the integrator in use.
    method: &'static str,
}

impl Tool for ErrorFigures {
    type Action = ErrorAction;

    fn perform(&mut self, action: ErrorAction, context: &mut ToolContext<'_>) -> Result<Option<String>> {
        match action {
            ErrorAction::SetTarget(error) => context.picture.aim(error),
            ErrorAction::FindBy(name) => context.has_edited |= context.session.set_method(Some(name)),
        }
        Ok(None)
    }

    fn update(&mut self, context: &mut ToolContext<'_>, data: &mut PanelData) {
        let (picture, run) = (&context.picture, context.session.run_spec());
        self.method = run.integrator.name();
        let states = picture.states_of_eyes();
        self.of_eyes = states.and_then(|[left, right]| eye_words(picture.worse_eye(), [&left, &right]));
        self.target = picture.target().error;
        self.compared = std::mem::take(&mut data.compared);
        self.summary = picture.present_observer().map(|observer| {
            if picture.mix.is_mixing() {
                let message = "not known of a mix of lights".to_owned();
                return ErrorSummary { message, ..ErrorSummary::default() };
            }
            let filtered = picture.filtered_error(run, &context.panel.controls.settings);
            error_summary(observer, run, self.target, context.session.is_through(), filtered)
        });
    }

    fn section(&mut self, place: SectionPlace, ui: &mut Ui, queue: &mut ActionQueue<ErrorAction>) {
        if place == SectionPlace::Render {
            section(ui, "Error", true, |ui| show(ui, self, queue));
        }
    }
}

/// Draws the section.
fn show(ui: &mut Ui, tool: &ErrorFigures, queue: &mut ActionQueue<ErrorAction>) {
    let Some(error) = &tool.summary else {
        ui.colored_label(style::DIM, "Not known: one randomisation only (--replicates 1).");
        return;
    };
    figures(ui, error);
    if let Some(of_eyes) = &tool.of_eyes {
        ui.colored_label(style::DIM, of_eyes).on_hover_text(
            "The worse one decides when the target is reached. The interval of both together is that of fully correlated errors",
        );
    }
    ui.horizontal(|ui| {
        ui.colored_label(style::DIM, "Target")
            .on_hover_text("Relative error that 95 % of the picture shall stay below");
        let name = TARGETS.iter().find(|(value, _)| *value == tool.target).map_or("–", |(_, name)| name);
        ComboBox::from_id_salt("target").width(56.0).selected_text(name).show_ui(ui, |ui| {
            for (value, name) in TARGETS {
                if ui.selectable_label(value == tool.target, name).clicked() {
                    queue.ask(ErrorAction::SetTarget(value));
                }
            }
        });
    });
    // The line is reserved even before the first checkpoint, so that the layout does not jump.
    let message = if error.quantiles.is_some() { error.message.as_str() } else { "" };
    ui.colored_label(style::ACCENT, message);
    if let Some(UnfoundSummary { text, method }) = &error.unfound {
        ui.label(text);
        if let Some(method) = method.filter(|method| *method != tool.method)
            && ui.button(format!("Find it by {method}")).clicked()
        {
            queue.ask(ErrorAction::FindBy(method));
        }
    }
    if let Some(warning) = &error.warning {
        ui.colored_label(ui.visuals().warn_fg_color, "Light is still being found").on_hover_text(warning);
    }
    plot::show(ui, error, &tool.compared, tool.target);
}

fn figures(ui: &mut Ui, error: &ErrorSummary) {
    let Some([median, p95, p99]) = &error.quantiles else {
        ui.horizontal(|ui| {
            ui.label(RichText::new("–").color(style::BRIGHT).size(16.0));
            ui.colored_label(style::DIM, format!("error {}", error.message));
        });
        ui.label(RichText::new(" ").small());
        return;
    };
    ui.horizontal(|ui| {
        ui.label(RichText::new(&p95[0]).color(style::BRIGHT).size(16.0));
        ui.colored_label(style::DIM, format!("or less in 95 % (90 %: {})", p95[1]));
    })
    .response
    .on_hover_text(
        "Relative error of neighbourhoods of 8×8 pixels: the standard error of their luminance, before any blur that \
         hides noise",
    );
    ui.horizontal(|ui| {
        for (name, [value, interval]) in [("median", median), ("99 %", p99)] {
            ui.label(RichText::new(format!("{name} {value} ({interval})")).small().color(style::DIM));
        }
    });
    if let Some(filtered) = &error.filtered {
        ui.label(RichText::new(filtered).small().color(style::DIM)).on_hover_text(
            "This is the error that 95 % of the picture as it is shown do not exceed. It is estimated from 4 samples per pixel on (16 \
             after a move of the camera), and again whenever there are half as many more. It is not known where photons blur the \
             picture, fireflies are reweighted, light is known to be missing, or regions have samples of their own",
        );
    }
}

#[cfg(test)]
mod tests;
