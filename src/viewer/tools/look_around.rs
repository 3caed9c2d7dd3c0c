//! Looking around in a panorama: the window displays a perspective view into it, which is turned without tracing anything. It does so from the
//! beginning in scenes whose camera shows all directions.

use egui::Ui;
use glam::{DVec2, UVec2};
use miette::{Result, miette};
use winit::keyboard::KeyCode;

use crate::client::post_process::{PanoramaProjection, PanoramaView};
use crate::client::window::action::ActionQueue;
use crate::client::window::keys::{BoundAction, KeyBinding, ToolKey, Trigger, mouse, tool_key};
use crate::client::window::panel::{PanelData, SectionPlace};
use crate::scene::SceneDesc;
use crate::scene::desc::{CubeLayout, FisheyeDesc, FisheyeMapping, ProjectionDesc, StereoEyes};
use crate::viewer::tools::tool::{Tool, ToolContext};

/// Part of the view's width or height by which an arrow key turns it.
const ARROW: f64 = 0.1;

/// What the user can do with the view into a panorama.
#[derive(Clone, Debug, PartialEq)]
pub enum LookAroundAction {
    /// Looks around, or shows the whole panorama flat.
    Toggle,
    /// Turns the view by fractions of its size, as a drag.
    Turn([f64; 2]),
    /// Widens the view, degrees.
    Widen(f64),
}

/// The view into the panorama that the scene's camera shows.
#[derive(Default)]
pub struct LookAroundTool {
    /// The panorama that the display settings fit, if there is one; `None` before the first scene, and when everything begins anew.
    fitted: Option<Option<PanoramaProjection>>,
    /// The last view, to return to.
    last: Option<PanoramaView>,
    /// Whether the window looks around; `None` without a panorama.
    shown: Option<bool>,
}

impl LookAroundTool {
    /// Makes the display settings those of an opened scene again.
    pub fn begin_anew(&mut self) {
        (self.fitted, self.last) = (None, None);
    }
}

impl Tool for LookAroundTool {
    type Action = LookAroundAction;

    fn keys() -> Vec<ToolKey<LookAroundAction>> {
        use KeyCode::{ArrowDown, ArrowLeft, ArrowRight, ArrowUp};
        use Trigger::{Char, Key};
        let toggle = "look around in a panorama, or show it flat";
        let drag = "while looking around: turn the view, widen it; the camera stays";
        let turn =
            |name: &str, x: f64, y: f64| (name.to_owned(), LookAroundAction::Turn([x * ARROW, y * ARROW]));
        let arrows = KeyBinding {
            keys: "Arrows",
            meaning: "while looking around: turn the view",
            triggers: &[Key(ArrowLeft), Key(ArrowRight), Key(ArrowUp), Key(ArrowDown)],
            action: BoundAction::Each(vec![
                turn("Look to the left in a panorama", 1.0, 0.0),
                turn("Look to the right in a panorama", -1.0, 0.0),
                turn("Look up in a panorama", 0.0, 1.0),
                turn("Look down in a panorama", 0.0, -1.0),
            ]),
        };
        vec![
            tool_key("A", toggle, &[Char('a')], LookAroundAction::Toggle)
                .below("a pixel of the picture as one of the window"),
            mouse("Left drag, wheel", drag).below(toggle),
            arrows.below(drag),
        ]
    }

    fn perform(&mut self, action: LookAroundAction, context: &mut ToolContext<'_>) -> Result<Option<String>> {
        let view = context.panel.controls.settings.look_around();
        let (next, message) = match (action, view) {
            (LookAroundAction::Toggle, Some(view)) => {
                self.last = Some(view);
                (None, Some("the whole panorama, flat: A looks around in it".to_owned()))
            }
            (LookAroundAction::Toggle, None) => {
                context.check_light_is_shown()?;
                let ahead = panorama(context.editor.desc(), context.session.size());
                let ahead = ahead.map_err(|why| miette!("{why}"))?;
                let last = self.last.filter(|last| last.projection == ahead.projection);
                let view = last.map_or(ahead, |last| PanoramaView { lens: ahead.lens, ..last });
                (Some(view), Some(HOW_TO.to_owned()))
            }
            (_, None) => return Err(miette!("this turns the view into a panorama: A looks around in one")),
            (LookAroundAction::Turn(by), Some(view)) => {
                let extent = UVec2::from(context.session.size()).as_vec2();
                (Some(view.turned(DVec2::from(by), extent)), None)
            }
            (LookAroundAction::Widen(by), Some(view)) => (Some(view.widened(by as f32)), None),
        };
        context.panel.change_settings(|settings| settings.post.look_around.view = next);
        Ok(message)
    }

    /// Fits the display settings to the scene: a panorama that is opened is looked around in, and a view that was asked for in any other way gets
    /// the projection of the scene, or ends where that is no panorama.
    fn poll(&mut self, context: &mut ToolContext<'_>) -> bool {
        let found = panorama(context.editor.desc(), context.session.size());
        let projection = found.ok().map(|ahead| ahead.projection);
        let is_new = self.fitted.replace(projection) != Some(projection);
        let view = context.panel.controls.settings.post.look_around.view;
        let next = match (view, found) {
            (Some(view), Ok(PanoramaView { projection, lens, .. })) => {
                Some(PanoramaView { projection, lens, ..view })
            }
            (None, Ok(ahead)) if is_new && !ahead.projection.is_fisheye() => Some(ahead),
            _ => None,
        };
        if next == view {
            return false;
        }
        context.panel.change_settings(|settings| settings.post.look_around.view = next);
        context.asks_room = next.filter(|_| view.is_none()).and_then(|_| room(context.session.size()));
        if next.map(|next| next.projection) != view.map(|view| view.projection) {
            context.say(found.map_or_else(str::to_owned, |_| HOW_TO.to_owned()));
        }
        true
    }

    fn update(&mut self, context: &mut ToolContext<'_>, _: &mut PanelData) {
        let is_panorama = panorama(context.editor.desc(), context.session.size()).is_ok();
        self.shown = is_panorama.then_some(context.panel.controls.settings.post.look_around.view.is_some());
    }

    fn section(&mut self, place: SectionPlace, ui: &mut Ui, queue: &mut ActionQueue<LookAroundAction>) {
        if let Some(shown) = self.shown.filter(|_| place == SectionPlace::LookTop) {
            show(ui, shown, queue);
        }
    }
}

/// The size of window that the frame of a view into a strip fills with as many pixels as the strip has; `None` where the picture is no strip.
fn room(size: [u32; 2]) -> Option<[u32; 2]> {
    let picture = DVec2::from(size.map(f64::from));
    let frame = PanoramaView::frame(picture);
    let scale = (picture.element_product() / frame.element_product()).sqrt();
    (frame != picture).then(|| (frame * scale).round().as_uvec2().to_array())
}

/// What is told when looking around begins.
const HOW_TO: &str = "looking around in a panorama: drag turns, the wheel widens, A shows all of it flat";

/// Draws the switch.
fn show(ui: &mut Ui, mut shown: bool, queue: &mut ActionQueue<LookAroundAction>) {
    let hint = "Shows a view into the panorama, which dragging turns; nothing is traced anew  A";
    if ui.checkbox(&mut shown, "Look around in the panorama").on_hover_text(hint).clicked() {
        queue.ask(LookAroundAction::Toggle);
    }
}

/// The view ahead into pictures of this scene of this size.
///
/// # Errors
///
/// Where there is nothing to look around in; the message says why.
fn panorama(desc: &SceneDesc, size: [u32; 2]) -> Result<PanoramaView, &'static str> {
    if desc.film.crop.is_some() {
        return Err("there is nothing to look around in: the film shows a crop of the picture");
    }
    let projection = match &desc.camera.projection {
        ProjectionDesc::Spherical => PanoramaProjection::Spherical,
        ProjectionDesc::Stereo(stereo) => match stereo.eyes {
            StereoEyes::OverUnder => PanoramaProjection::OverUnder,
            StereoEyes::Left | StereoEyes::Right => PanoramaProjection::Spherical,
        },
        ProjectionDesc::CubeMap(layout) => match layout {
            CubeLayout::Block => PanoramaProjection::CubeBlock,
            CubeLayout::Row => PanoramaProjection::CubeRow,
            CubeLayout::Column => PanoramaProjection::CubeColumn,
            CubeLayout::Cross => PanoramaProjection::CubeCross,
        },
        ProjectionDesc::Fisheye(fisheye) => {
            if fisheye.distortion != [0.0; 4] || desc.camera.principal_point_offset != DVec2::ZERO {
                return Err("the picture of a fisheye lens that is distorted or shifted is shown flat only");
            }
            return Ok(fisheye_view(fisheye, size));
        }
        _ => return Err("there is nothing to look around in: the camera shows no panorama"),
    };
    Ok(PanoramaView::ahead(projection))
}

/// The view ahead into a picture of a fisheye lens. Its field of view may be given along any side of the picture; a view has it along the shorter.
fn fisheye_view(fisheye: &FisheyeDesc, size: [u32; 2]) -> PanoramaView {
    let [width, height] = size.map(|n| f64::from(n.max(1)));
    let half = fisheye.mapping.radius(0.5 * fisheye.fov.to_radians());
    let radius = fisheye.fov_axis.of_half(half, width / height).min_element();
    let (projection, angle) = match fisheye.mapping {
        FisheyeMapping::Equidistant => (PanoramaProjection::FisheyeEquidistant, radius),
        FisheyeMapping::Equisolid => {
            (PanoramaProjection::FisheyeEquisolid, 2.0 * (0.5 * radius).min(1.0).asin())
        }
        FisheyeMapping::Stereographic => {
            (PanoramaProjection::FisheyeStereographic, 2.0 * (0.5 * radius).atan())
        }
        FisheyeMapping::Orthographic => (PanoramaProjection::FisheyeOrthographic, radius.min(1.0).asin()),
    };
    PanoramaView { lens: (2.0 * angle).to_degrees() as f32, ..PanoramaView::ahead(projection) }
}

#[cfg(test)]
mod tests {
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;

    use super::*;
    use crate::client::window::action::UserAction;

    #[test]
    fn the_switch_asks_for_the_other_state() {
        let draw = |ui: &mut Ui, queue: &mut ActionQueue<LookAroundAction>| show(ui, true, queue);
        let mut harness = Harness::builder().build_ui_state(draw, ActionQueue::default());
        harness.run_steps(2);
        assert_eq!(harness.state_mut().take(), []);
        harness.get_by_label("Look around in the panorama").click();
        harness.run_steps(2);
        assert_eq!(harness.state_mut().take(), [UserAction::Tool(LookAroundAction::Toggle)]);
    }

    #[test]
    fn panoramas_are_told_from_other_cameras() {
        let of = |sensor: &str| {
            let text = format!(
                "<scene version=\"3.0.0\"><sensor {sensor}</sensor><shape type=\"sphere\"/><emitter type=\"constant\"/></scene>"
            );
            let desc = crate::scene::load_str("t.xml", &text, &[]).expect("valid").desc;
            panorama(&desc, [96, 64])
        };
        let ahead = |projection| Ok(PanoramaView::ahead(projection));
        assert_eq!(of("type=\"spherical\">"), ahead(PanoramaProjection::Spherical));
        let cross = "type=\"cubemap\"><string name=\"layout\" value=\"cross\"/>";
        assert_eq!(of(cross), ahead(PanoramaProjection::CubeCross));
        assert_eq!(of("type=\"ods\">"), ahead(PanoramaProjection::OverUnder));
        // A row of faces of 96 pixels is shown in a frame of twice its height, with as many pixels.
        assert_eq!(
            [room([576, 96]), room([96, 576]), room([400, 200])],
            [Some([333, 166]), Some([166, 333]), None]
        );
        // 90 degrees along the longer side of 96 × 64 pixels.
        let fisheye =
            "type=\"fisheye\"><float name=\"fov\" value=\"90\"/><string name=\"fov_axis\" value=\"x\"/>";
        let lens = of(fisheye).map(|view| view.lens);
        assert!(lens.is_ok_and(|lens| (lens - 60.0).abs() < 1e-3), "{lens:?}");
        let refused = of("type=\"perspective\"><float name=\"fov\" value=\"40\"/>");
        assert!(refused.is_err_and(|why| why.contains("nothing to look around in")));
        let crop = "type=\"spherical\"><film type=\"hdrfilm\"><integer name=\"width\" value=\"64\"/>\
                    <integer name=\"height\" value=\"32\"/><integer name=\"crop_width\" value=\"32\"/>\
                    <integer name=\"crop_height\" value=\"16\"/></film>";
        assert!(of(crop).is_err_and(|why| why.contains("a crop")));
    }
}
