//! Compares the present picture with reference pictures: snapshots of this session and EXR files.

mod references;
mod tab;

use std::path::PathBuf;

use egui::{Context, Ui};
use miette::{IntoDiagnostic, Result, miette};

use crate::client::window::action::{Action, ActionQueue};
use crate::client::window::keys::{ToolKey, Trigger, command, tool_key};
use crate::client::window::panel::{
    FileChooser, PanelData, PanelTab, PictureArea, PictureOverlay, SectionPlace, ToolPresence,
};
use crate::viewer::tools::tool::{ONLY_FLAT, Tool, ToolContext};

use references::References;
use tab::{CompareControls, CompareMode, ComparisonData};

/// What the user can do with the comparison.
#[derive(Clone, Debug, PartialEq)]
pub enum CompareAction {
    /// Keeps the present picture as a snapshot.
    KeepSnapshot,
    /// Asks for an EXR file to compare with.
    ChooseFile,
    /// Compares with this EXR file.
    With(PathBuf),
    /// Removes a picture of the list.
    Forget(usize),
    /// Shows the selected picture, or the present one again.
    Toggle,
}

/// The comparison of the picture with others.
#[derive(Default)]
pub struct Comparison {
    references: References,
    controls: CompareControls,
    data: ComparisonData,
    dialog: FileChooser,
}

impl Tool for Comparison {
    type Action = CompareAction;

    fn keys() -> Vec<ToolKey<CompareAction>> {
        use Trigger::Char;
        let snapshot = "keep a snapshot to compare with";
        let toggle = "show the snapshot, or the picture again";
        let tab = command("show the tab Compare", Action::ShowTab(PanelTab::Compare));
        vec![
            tool_key("K", snapshot, &[Char('k')], CompareAction::KeepSnapshot)
                .below("pause the render, or go on"),
            tool_key("T", toggle, &[Char('t')], CompareAction::Toggle).below(snapshot),
            tab.below("show the tab Scene"),
        ]
    }

    fn perform(&mut self, action: CompareAction, context: &mut ToolContext<'_>) -> Result<Option<String>> {
        if !matches!(action, CompareAction::Forget(_)) {
            context.check_one_eye("a comparison")?;
        }
        match action {
            CompareAction::KeepSnapshot => {
                context.check_light_is_shown()?;
                context.check_is_flat()?;
                let name = self.references.keep(context.session, context.picture)?;
                self.controls.chosen = self.references.last();
                return Ok(Some(format!("{name} kept: T compares with it")));
            }
            CompareAction::ChooseFile => {
                let folder = std::env::current_dir().into_diagnostic()?;
                self.dialog.ask_file("Compare with a picture", &folder, ("OpenEXR pictures", &["exr"]));
            }
            CompareAction::With(path) => {
                context.check_is_flat()?;
                let name = self.references.read(&path)?;
                (self.controls.chosen, self.controls.is_shown) = (self.references.last(), true);
                return Ok(Some(format!("comparing with {name}")));
            }
            CompareAction::Forget(place) => {
                self.references.forget(place);
                let controls = &mut self.controls;
                controls.chosen -= usize::from(place < controls.chosen);
                controls.chosen = controls.chosen.min(self.references.last());
                controls.is_shown &= !self.references.is_empty();
            }
            CompareAction::Toggle if self.references.is_empty() => {
                return Err(miette!("there is nothing to compare with: K keeps a snapshot"));
            }
            CompareAction::Toggle => {
                context.check_is_flat()?;
                self.controls.is_shown ^= true;
            }
        }
        Ok(None)
    }

    fn update(&mut self, context: &mut ToolContext<'_>, data: &mut PanelData) {
        if context.panel.looks_around() && std::mem::take(&mut self.controls.is_shown) {
            context.say(format!("the comparison ends: {ONLY_FLAT}"));
        }
        if self.controls.is_shown
            && let Err(error) = context.check_one_eye("a comparison")
        {
            self.controls.is_shown = false;
            context.say(error.to_string());
        }
        let settings = &context.panel.controls.settings;
        self.data = self.references.data(&self.controls, settings, context.session, context.picture);
        if let Some(map) = self.references.map(&self.controls) {
            data.overlay = PictureOverlay::Map(map);
        }
        data.compared = self.references.curve(&self.controls);
    }

    fn section(&mut self, place: SectionPlace, ui: &mut Ui, queue: &mut ActionQueue<CompareAction>) {
        if place == SectionPlace::Compare {
            tab::show(ui, &self.data, &mut self.controls, queue);
        }
    }

    fn over_picture(&mut self, ctx: &Context, picture: PictureArea, queue: &mut ActionQueue<CompareAction>) {
        tab::draw(ctx, picture, &self.data, &mut self.controls);
        if let Some(path) = self.dialog.show(ctx) {
            queue.ask(CompareAction::With(path));
        }
    }

    fn presence(&self, _: &ToolContext<'_>) -> ToolPresence {
        match (self.dialog.is_open(), self.controls.is_shown, self.controls.mode) {
            (true, ..) => ToolPresence::Modal,
            (_, true, CompareMode::Split) => ToolPresence::Interactive,
            (_, true, _) => ToolPresence::Drawn,
            _ => ToolPresence::Hidden,
        }
    }

    fn is_busy(&self) -> bool {
        self.references.is_busy()
    }
}
