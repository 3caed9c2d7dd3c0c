//! The maps of error and cost over the picture: which one the user has chosen. What they show is the subject of
//! [`maps`](crate::viewer::maps).

use std::convert::Infallible;
use std::time::Instant;

use egui::Ui;

use crate::client::window::action::ActionQueue;
use crate::client::window::panel::{MapChoice, PanelData, SectionPlace, ToolPresence, choice};
use crate::viewer::maps::MapCache;
use crate::viewer::tools::tool::{Tool, ToolContext, ViewChange};

/// The chosen map, and the most recent maps.
#[derive(Default)]
pub struct MapOverlay {
    chosen: MapChoice,
    cache: MapCache,
}

impl Tool for MapOverlay {
    type Action = Infallible;

    fn forget(&mut self, change: ViewChange) {
        if change == ViewChange::Epoch {
            self.cache.begin_epoch();
        }
    }

    fn update(&mut self, context: &mut ToolContext<'_>, data: &mut PanelData) {
        let (session, observer) = (&context.session, context.picture.observer.as_ref());
        data.overlay = self.cache.overlay(self.chosen, session, observer, Instant::now());
    }

    fn section(&mut self, place: SectionPlace, ui: &mut Ui, _: &mut ActionQueue<Infallible>) {
        if place == SectionPlace::LookTop {
            let kinds =
                [("None", MapChoice::None), ("Error map", MapChoice::Error), ("Cost map", MapChoice::Cost)];
            let hint = "Over the picture its relative error, or the time that paths take by region";
            choice(ui, ("Overlay", hint), &mut self.chosen, &MapChoice::default(), &kinds);
        }
    }

    fn presence(&self, _: &ToolContext<'_>) -> ToolPresence {
        if self.chosen == MapChoice::None { ToolPresence::Hidden } else { ToolPresence::Drawn }
    }
}
