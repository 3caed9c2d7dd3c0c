//! The inspector: the pixel under the pointer and, after a click, the paths that made a pixel.

mod paths;
mod tab;

use std::convert::Infallible;

use egui::{Context, Ui};
use miette::Result;

use crate::client::window::action::{Action, ActionQueue};
use crate::client::window::keys::{ToolKey, Trigger, key};
use crate::client::window::panel::{PanelData, PanelTab, PictureArea, SectionPlace};
use crate::viewer::tools::tool::{Tool, ToolContext, ViewChange};

use paths::{PixelStudy, reading};
use tab::PixelReading;

/// What the inspector shows.
#[derive(Default)]
pub struct Inspector {
    /// The last clicked pixel.
    study: PixelStudy,
    /// The pixel under the pointer.
    pixel: Option<PixelReading>,
    /// Whether its tab is visible.
    is_shown: bool,
}

impl Tool for Inspector {
    type Action = Infallible;

    fn keys() -> Vec<ToolKey<Infallible>> {
        let show = Action::ShowTab(PanelTab::Inspect);
        let inspect = key("I", "inspect the pixel under the cursor", &[Trigger::Char('i')], show);
        vec![inspect.below("go to the panel by keyboard; Escape leaves it")]
    }

    fn click(&mut self, place: [f64; 2], context: &mut ToolContext<'_>) -> Result<()> {
        if context.panel.controls.layout.shows(PanelTab::Inspect) {
            let pixel = place.map(|at| at as u32);
            self.study.begin(pixel, context.session, context.picture, context.editor)?;
        }
        Ok(())
    }

    fn forget(&mut self, change: ViewChange) {
        // An epoch may begin with the same view, whose paths stay.
        if change != ViewChange::Epoch {
            self.study.clear();
        }
    }

    fn poll(&mut self, _: &mut ToolContext<'_>) -> bool {
        self.study.take()
    }

    fn update(&mut self, context: &mut ToolContext<'_>, _: &mut PanelData) {
        self.is_shown = context.panel.controls.layout.shows(PanelTab::Inspect);
        let shows = self.is_shown && !context.panel.controls.settings.view.is_error();
        let cursor = if shows { context.cursor() } else { None };
        let ToolContext { session, picture, editor, panel, .. } = context;
        let settings = &panel.controls.settings;
        self.pixel = cursor.and_then(|at| reading(at, session, picture, editor, settings.exposure));
    }

    fn section(&mut self, place: SectionPlace, ui: &mut Ui, _: &mut ActionQueue<Infallible>) {
        if place == SectionPlace::Inspect {
            tab::show(ui, self.pixel.as_ref(), self.study.paths().as_ref(), self.study.is_busy());
        }
    }

    fn over_picture(&mut self, ctx: &Context, picture: PictureArea, _: &mut ActionQueue<Infallible>) {
        if let Some(paths) = self.study.paths().filter(|_| self.is_shown) {
            tab::draw_paths(ctx, picture, &paths);
        }
    }

    fn is_busy(&self) -> bool {
        self.study.is_busy()
    }
}
