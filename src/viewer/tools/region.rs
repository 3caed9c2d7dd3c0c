//! Regions of the picture that are traced alone: dragged, shown and released. Their samples are those of
//! [`Regions`](crate::viewer::picture::regions::Regions).

use egui::{Align2, Color32, Context, FontId, LayerId, Rect, Stroke, StrokeKind, Ui, vec2};
use glam::DVec2;
use miette::{Result, miette};

use crate::client::window::action::ActionQueue;
use crate::client::window::keys::{ToolKey, Trigger, mouse, tool_key};
use crate::client::window::panel::{PanelData, PictureArea, SectionPlace, ToolPresence, style};
use crate::denoise::noise_filter::EpochView;
use crate::gpu::Region;
use crate::viewer::picture::regions::{RegionDrawing, rectangle_between};
use crate::viewer::tools::tool::{Tool, ToolContext};

/// What the user can do with regions. Positions are physical pixels of the window.
#[derive(Clone, Debug, PartialEq)]
pub enum RegionAction {
    /// Asks the user to drag a region to be traced alone, or releases the traced region.
    Toggle,
    /// Shows the rectangle being dragged between these positions; `None` removes it.
    Drag(Option<[[f64; 2]; 2]>),
    /// Restricts tracing to the rectangle between these positions.
    Trace([[f64; 2]; 2]),
    /// Releases the traced region.
    Release,
}

/// The region that is dragged or traced.
#[derive(Default)]
pub struct RegionTool {
    /// Rectangle that the user is dragging.
    dragged: Option<Region>,
    /// The region as it is drawn.
    drawing: Option<RegionDrawing>,
}

impl RegionTool {
    /// Removes the rectangle being dragged; returns whether there was one.
    pub fn stop_drag(&mut self) -> bool {
        self.dragged.take().is_some()
    }
}

impl Tool for RegionTool {
    type Action = RegionAction;

    fn keys() -> Vec<ToolKey<RegionAction>> {
        let drag = "trace a rectangle of the picture and nothing else";
        let toggle = "drag a rectangle that is traced alone, or release it";
        vec![
            mouse("Ctrl+Shift+left drag", drag).below("fix the brightness, or let it follow the light"),
            tool_key("Ctrl+B", toggle, &[Trigger::Ctrl('b', false)], RegionAction::Toggle).below(drag),
        ]
    }

    fn perform(&mut self, action: RegionAction, context: &mut ToolContext<'_>) -> Result<Option<String>> {
        match action {
            RegionAction::Toggle if context.session.is_in_region() => return release(context),
            RegionAction::Release => return release(context),
            RegionAction::Toggle => {
                context.check_is_flat()?;
                context.check_one_eye("a region")?;
                let asks = !context.panel.input.asks_region();
                context.panel.input.ask_region(asks);
                if asks {
                    let message = "Drag a rectangle over the picture; Escape leaves it";
                    context.panel.host.pin(message.to_owned());
                }
            }
            RegionAction::Drag(places) => {
                let places = places.filter(|_| !context.panel.looks_around());
                self.dragged = places.map(|places| rectangle(places, context));
            }
            RegionAction::Trace(places) => {
                self.dragged = None;
                context.check_is_flat()?;
                return trace(rectangle(places, context), context).map(Some);
            }
        }
        Ok(None)
    }

    fn update(&mut self, context: &mut ToolContext<'_>, _: &mut PanelData) {
        let dragged =
            |Region { origin, extent }| RegionDrawing { origin, extent, is_traced: false, per_pixel: 0.0 };
        self.drawing = self.dragged.map(dragged).or_else(|| context.picture.regions.drawing());
    }

    fn section(&mut self, place: SectionPlace, ui: &mut Ui, queue: &mut ActionQueue<RegionAction>) {
        if place == SectionPlace::Render {
            show(ui, self.drawing.filter(|region| region.is_traced), queue);
        }
    }

    fn over_picture(&mut self, ctx: &Context, picture: PictureArea, _: &mut ActionQueue<RegionAction>) {
        // A view into a panorama shows it as no rectangle; the tab Render tells of it.
        if let Some(region) = self.drawing.filter(|_| picture.view.viewport.is_flat()) {
            frame(ctx, picture, region);
        }
    }

    fn presence(&self, context: &ToolContext<'_>) -> ToolPresence {
        match self.dragged.is_some() || context.session.is_in_region() {
            true => ToolPresence::Drawn,
            false => ToolPresence::Hidden,
        }
    }
}

/// Rectangle of the picture spanned by two window positions.
fn rectangle([from, to]: [[f64; 2]; 2], context: &ToolContext<'_>) -> Region {
    let [from, to] = [from, to].map(|at| context.panel.viewport.to_left_eye(at.into()));
    rectangle_between(from, to, context.session.size())
}

/// Restricts tracing to a rectangle of the picture until it is released or an edit begins a new epoch; returns a message.
fn trace(rectangle: Region, context: &mut ToolContext<'_>) -> Result<String> {
    context.check_one_eye("a region")?;
    if context.session.is_stale() || !context.picture.is_seen() {
        return Err(miette!("there is no picture of this view yet: drag the region again"));
    }
    let camera = context.editor.camera(context.session.size())?;
    let view = EpochView { scene: context.editor.scene(), camera };
    let ToolContext { picture, session, editor, panel, .. } = context;
    picture.begin_region(rectangle, session, view, editor, &panel.controls.settings)?;
    context.go_on();
    let [width, height] = rectangle.extent;
    Ok(format!("only {width}×{height} pixels are traced: Ctrl+B or Escape releases them"))
}

/// Releases the traced region and resumes the whole picture; returns a message.
fn release(context: &mut ToolContext<'_>) -> Result<Option<String>> {
    context.go_on();
    let released = context.picture.end_region(context.session, context.editor)?;
    Ok(released.then(|| "the whole picture is traced again".to_owned()))
}

/// Draws information about the traced region, or how to trace one.
fn show(ui: &mut Ui, region: Option<RegionDrawing>, queue: &mut ActionQueue<RegionAction>) {
    ui.horizontal(|ui| {
        let (name, hint) = match region {
            Some(_) => {
                ("Release the region", "Renders the whole picture again; the region keeps its samples")
            }
            None => ("Render a region", "Renders only a rectangle of the picture, which you drag"),
        };
        if ui.button(name).on_hover_text(format!("{hint}  Ctrl+B")).clicked() {
            queue.ask(RegionAction::Toggle);
        }
    });
    if let Some(RegionDrawing { extent: [width, height], per_pixel, .. }) = region {
        let words = format!("{width}×{height} pixels with {per_pixel:.0} paths each; the error is theirs");
        ui.colored_label(style::ACCENT, words);
    }
}

/// A rectangle of the picture, with its size while it is dragged.
fn frame(ctx: &Context, picture: PictureArea, region: RegionDrawing) {
    let painter = ctx.layer_painter(LayerId::background()).with_clip_rect(picture.area);
    let [x, y, width, height] =
        [region.origin[0], region.origin[1], region.extent[0], region.extent[1]].map(f64::from);
    let rect =
        Rect::from_min_max(picture.point(DVec2::new(x, y)), picture.point(DVec2::new(x + width, y + height)));
    let color = if region.is_traced { style::ACCENT } else { style::BRIGHT };
    for (width, color) in [(3.0, Color32::from_black_alpha(110)), (1.2, color)] {
        painter.rect_stroke(rect, 0.0, Stroke::new(width, color), StrokeKind::Outside);
    }
    if !region.is_traced {
        let text = format!("{} × {}", region.extent[0], region.extent[1]);
        let at = rect.left_top() + vec2(4.0, 3.0);
        for (shift, color) in [(1.0, Color32::from_black_alpha(160)), (0.0, style::BRIGHT)] {
            let font = FontId::proportional(12.0);
            painter.text(at + vec2(shift, shift), Align2::LEFT_TOP, &text, font, color);
        }
    }
}

#[cfg(test)]
mod tests {
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;

    use super::*;
    use crate::client::window::action::UserAction;

    #[test]
    fn a_region_is_told_and_released() {
        let toggles = |region: Option<RegionDrawing>, told: Option<&str>, button: &str| {
            let draw = move |ui: &mut Ui, queue: &mut ActionQueue<RegionAction>| show(ui, region, queue);
            let mut harness = Harness::builder().build_ui_state(draw, ActionQueue::default());
            harness.run_steps(2);
            told.into_iter().for_each(|told| _ = harness.get_by_label(told));
            harness.get_by_label(button).click();
            harness.run_steps(2);
            assert_eq!(harness.state_mut().take(), [UserAction::Tool(RegionAction::Toggle)]);
        };
        toggles(None, None, "Render a region");
        let region = RegionDrawing { origin: [8, 4], extent: [40, 24], is_traced: true, per_pixel: 123.4 };
        let told = "40×24 pixels with 123 paths each; the error is theirs";
        toggles(Some(region), Some(told), "Release the region");
    }
}
