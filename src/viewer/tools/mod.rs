//! The tools of the window. Each is one file or folder, which holds its state, its actions, what they do, its keys, and its part of the
//! panel; and one line of the list below.

mod bookmarks;
mod camera;
mod comparison;
mod effects;
mod error;
mod exposure;
mod figures;
mod files;
mod frame_times;
mod gizmo;
mod histogram;
mod inspector;
mod light_mix;
mod look_around;
mod maps;
mod outline;
mod parameters;
mod region;
mod rejected;
mod selection;
mod stereo;
mod tool;

use std::path::Path;
use std::time::Instant;

use egui::{Context, Ui};
use miette::Result;
use winit::event::WindowEvent;

use crate::client::window::action::{ActionQueue, UserAction};
use crate::client::window::keys::{KeyTable, ToolKey};
use crate::client::window::panel::{PanelData, PanelTools, PictureArea, SectionPlace, ToolPresence};
use crate::viewer::tools::tool::Tool;

pub use camera::CameraAction;
pub use exposure::ExposureAction;
pub use files::{FileAction, layers_in};
pub use look_around::LookAroundAction;
pub use region::RegionAction;
pub use tool::{ToolContext, ViewChange};

/// Makes of the list of tools the struct that holds them, the enum of their actions, and what passes on to each.
macro_rules! tools {
    ($($Name:ident $name:ident: $Tool:ty,)*) => {
        /// All tools.
        #[derive(Default)]
        pub struct Tools {
            $(pub $name: $Tool,)*
            /// What the user has asked for while they were drawn.
            queue: ActionQueue<ToolAction>,
        }

        /// An action of one of the tools.
        #[derive(Clone, Debug, PartialEq)]
        pub enum ToolAction {
            $($Name(<$Tool as Tool>::Action),)*
        }

        impl Tools {
            /// The keys of the window and of all tools.
            pub fn keys() -> KeyTable<ToolAction> {
                let mut keys: Vec<ToolKey<ToolAction>> = Vec::new();
                $(keys.extend(<$Tool>::keys().into_iter().map(|key| key.map(ToolAction::$Name)));)*
                KeyTable::new(keys)
            }

            /// Performs an action; returns a message for the user.
            pub fn perform(&mut self, action: ToolAction, context: &mut ToolContext<'_>) -> Result<Option<String>> {
                match action {
                    $(ToolAction::$Name(action) => self.$name.perform(action, context),)*
                }
            }

            /// Updates what the tools show.
            pub fn update(&mut self, context: &mut ToolContext<'_>, data: &mut PanelData) {
                $(self.$name.update(context, data);)*
            }

            /// Tells them of another scene; returns messages for the user.
            pub fn open_scene(&mut self, scene: &Path) -> Vec<String> {
                [$(self.$name.open_scene(scene),)*].into_iter().flatten().collect()
            }

            /// Called once per frame, after samples have been read.
            pub fn frame(&mut self, now: Instant, context: &mut ToolContext<'_>) {
                $(self.$name.frame(now, context);)*
            }

            /// Passes on an event of the window; returns true if a tool has consumed it.
            pub fn hear(&mut self, event: &WindowEvent, context: &mut ToolContext<'_>) -> bool {
                false $(|| self.$name.hear(event, context))*
            }

            /// Passes on a click in the picture, at this place in pixels.
            pub fn click(&mut self, place: [f64; 2], context: &mut ToolContext<'_>) -> Result<()> {
                $(self.$name.click(place, context)?;)*
                Ok(())
            }

            /// Discards results that this change invalidates.
            pub fn forget(&mut self, change: ViewChange) {
                $(self.$name.forget(change);)*
            }

            /// Takes over results of other threads; returns whether the window must be redrawn.
            pub fn poll(&mut self, context: &mut ToolContext<'_>) -> bool {
                [$(self.$name.poll(context),)*].contains(&true)
            }

            /// How much of the tools is visible outside of the dock.
            pub fn presence(&self, context: &ToolContext<'_>) -> ToolPresence {
                [$(self.$name.presence(context),)*].into_iter().max().unwrap_or_default()
            }

            /// Whether a tool computes something that the panel will show.
            pub fn is_busy(&self) -> bool {
                false $(|| self.$name.is_busy())*
            }

            /// Takes what the user has asked for while the tools were drawn.
            pub fn take_actions(&mut self) -> Vec<UserAction<ToolAction>> {
                self.queue.take()
            }
        }

        impl PanelTools for Tools {
            fn sections(&mut self, place: SectionPlace, ui: &mut Ui) {
                $(
                    let mut queue = ActionQueue::default();
                    self.$name.section(place, ui, &mut queue);
                    self.queue.extend(queue, ToolAction::$Name);
                )*
            }

            fn over_picture(&mut self, ctx: &Context, picture: PictureArea) {
                $(
                    let mut queue = ActionQueue::default();
                    self.$name.over_picture(ctx, picture, &mut queue);
                    self.queue.extend(queue, ToolAction::$Name);
                )*
            }
        }
    };
}

// What is drawn over the picture is drawn in this order, and so are sections at the same place of the dock. The comparison comes after the
// maps, since its own map takes the place of theirs, and before the error, to whose plot it gives a curve.
tools! {
    LookAround look_around: look_around::LookAroundTool,
    Exposure exposure: exposure::AutoExposure,
    Histogram histogram: histogram::HistogramTool,
    Maps maps: maps::MapOverlay,
    Compare compare: comparison::Comparison,
    Outline outline: outline::Outline,
    Region region: region::RegionTool,
    Gizmo gizmo: gizmo::Gizmo,
    Selection selection: selection::SelectionTool,
    Inspect inspector: inspector::Inspector,
    Error error: error::ErrorFigures,
    Figures figures: figures::FigureTable,
    Camera camera: camera::CameraTool,
    Stereo stereo: stereo::StereoTool,
    LightMix light_mix: light_mix::LightMixTool,
    Effects effects: effects::EffectList,
    Rejected rejected: rejected::RejectedView,
    FrameTimes frame_times: frame_times::FrameTimePlot,
    Bookmarks bookmarks: bookmarks::CameraBookmarks,
    Files files: files::FileTool,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every tool finds the line that its keys stand below, and no key has two meanings.
    #[test]
    fn the_keys_of_all_tools_fit_together() {
        let keys = Tools::keys();
        let all: Vec<_> = keys.bindings().flat_map(|binding| binding.triggers.iter().copied()).collect();
        for (i, trigger) in all.iter().enumerate() {
            assert!(!all[..i].contains(trigger), "{trigger:?} stands twice");
        }
    }
}
