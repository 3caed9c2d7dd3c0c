//! The transform gizmo: handles over the selected object along the world axes, which move, rotate or scale it when dragged.

use egui::{Color32, Context, LayerId, Shape, Stroke, StrokeKind, Ui, vec2};
use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};
use miette::Result;
use winit::event::{ElementState, MouseButton, WindowEvent};

use crate::client::window::action::ActionQueue;
use crate::client::window::keys::{ToolKey, Trigger, tool_key};
use crate::client::window::panel::{PanelData, PanelTab, PictureArea, SectionPlace, style};
use crate::viewer::editor::{SceneEditor, SightLine};
use crate::viewer::tools::tool::{Tool, ToolContext};

/// Length of the handles, in points.
const LENGTH: f64 = 70.0;

/// Radius around a handle within which the cursor grabs it, in points.
const REACH: f64 = 8.0;

/// Vertices of a rotation ring.
const RING: usize = 48;

/// A ring seen at a smaller angle than this (as a sine) rotates by screen-space angles.
const FLAT: f64 = 0.2;

/// Range of the scale factor of one drag.
const FACTORS: (f64, f64) = (0.01, 100.0);

/// The unit vectors of the world's axes.
const AXES: [DVec3; 3] = [DVec3::X, DVec3::Y, DVec3::Z];

/// Mode of the gizmo.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GizmoMode {
    /// Moves the object.
    #[default]
    Move,
    /// Rotates the object.
    Turn,
    /// Scales the object.
    Scale,
}

impl GizmoMode {
    /// All modes with their names.
    pub const ALL: [(Self, &str); 3] = [(Self::Move, "Move"), (Self::Turn, "Turn"), (Self::Scale, "Scale")];

    /// The mode after this one.
    pub fn next(self) -> Self {
        match self {
            Self::Move => Self::Turn,
            Self::Turn => Self::Scale,
            Self::Scale => Self::Move,
        }
    }
}

/// A part of the gizmo that can be dragged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GizmoHandle {
    /// Along or about a world axis: 0, 1, 2 for x, y, z.
    Axis(usize),
    /// Move: in the picture plane; turn: about its normal; scale: uniformly.
    Center,
}

/// Geometry of the gizmo. Positions are pixels of the picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GizmoDrawing {
    /// Mode of the gizmo.
    pub mode: GizmoMode,
    /// Centre of the object.
    pub pivot: [f64; 2],
    /// Line vertices of each axis.
    pub axes: [Vec<[f64; 2]>; 3],
    /// The handle being dragged or under the pointer.
    pub hot: Option<GizmoHandle>,
}

/// What the user can do with the gizmo besides dragging it.
#[derive(Clone, Debug, PartialEq)]
pub enum GizmoAction {
    /// Sets the mode.
    Set(GizmoMode),
    /// Changes to the next mode.
    Next,
}

/// A handle that is being dragged.
#[derive(Clone, Copy, Debug)]
struct GizmoDrag {
    handle: GizmoHandle,
    mode: GizmoMode,
    /// Centre of the object at the start of the drag: `pivot` in world space, `center` in pixels of the picture.
    pivot: DVec3,
    center: DVec2,
    start: SightLine,
    /// Window points per picture pixel.
    zoom: f64,
}

/// Mode of the gizmo, and the handle being dragged.
#[derive(Debug, Default)]
pub struct Gizmo {
    mode: GizmoMode,
    drag: Option<GizmoDrag>,
    /// Whether an object is selected.
    has_object: bool,
    /// Whether a view into a panorama is displayed, which has no handles.
    looks_around: bool,
    /// The gizmo as the panel shows it.
    drawn: Option<GizmoDrawing>,
}

impl Tool for Gizmo {
    type Action = GizmoAction;

    fn keys() -> Vec<ToolKey<GizmoAction>> {
        let next = "move, turn or scale the selected object";
        vec![tool_key("G", next, &[Trigger::Char('g')], GizmoAction::Next).below("select an object")]
    }

    fn perform(&mut self, action: GizmoAction, _: &mut ToolContext<'_>) -> Result<Option<String>> {
        self.mode = match action {
            GizmoAction::Set(mode) => mode,
            GizmoAction::Next => self.mode.next(),
        };
        Ok(None)
    }

    fn hear(&mut self, event: &WindowEvent, context: &mut ToolContext<'_>) -> bool {
        let left = MouseButton::Left;
        match event {
            WindowEvent::MouseInput { state: ElementState::Pressed, button, .. } if *button == left => {
                self.take_hold(context)
            }
            _ if self.drag.is_none() => false,
            WindowEvent::CursorMoved { position, .. } => {
                let at = context.panel.viewport.to_left_eye(DVec2::new(position.x, position.y));
                let by = self.transform(context.editor, at, context.session.size());
                match by.map(|by| context.editor.set_transform(by)) {
                    Some(Ok(has_edited)) => context.has_edited |= has_edited,
                    None => {}
                    Some(Err(error)) => context.say(error.to_string()),
                }
                context.redraws = true;
                false
            }
            WindowEvent::MouseInput { state: ElementState::Released, button, .. } if *button == left => {
                self.end(context)
            }
            WindowEvent::Focused(false) => self.end(context),
            _ => false,
        }
    }

    fn update(&mut self, context: &mut ToolContext<'_>, _: &mut PanelData) {
        let (size, zoom) = (context.session.size(), context.panel.points_per_pixel());
        let cursor = context.cursor().map(|cursor| cursor.picture);
        self.has_object = context.editor.selected().is_some();
        self.looks_around = context.panel.looks_around();
        self.drawn = if is_shown(context) { self.drawing(context.editor, cursor, size, zoom) } else { None };
    }

    fn section(&mut self, place: SectionPlace, ui: &mut Ui, queue: &mut ActionQueue<GizmoAction>) {
        if place == SectionPlace::Selection && self.has_object {
            choice(ui, self.mode, queue);
            if self.looks_around {
                ui.colored_label(style::DIM, "The handles are over the flat panorama: A shows it.");
            }
        }
    }

    fn over_picture(&mut self, ctx: &Context, picture: PictureArea, _: &mut ActionQueue<GizmoAction>) {
        if let Some(drawing) = &self.drawn {
            draw(ctx, picture, drawing);
        }
    }
}

/// Whether the gizmo is shown: an object is selected, the tab that edits it is open, and what is displayed is the picture itself.
fn is_shown(context: &ToolContext<'_>) -> bool {
    let panel = &context.panel;
    context.editor.selected().is_some()
        && panel.controls.layout.shows(PanelTab::Scene)
        && !panel.looks_around()
}

impl Gizmo {
    /// Grabs the handle under the cursor when the left button goes down; returns whether there was one.
    fn take_hold(&mut self, context: &mut ToolContext<'_>) -> bool {
        let panel = &context.panel;
        let is_free =
            !panel.host.is_under_pointer() && !panel.input.is_dragging() && !panel.input.is_ctrl_held();
        // While the user is asked to click a position, the click goes to the picture, even over a handle.
        let is_free = is_free && !panel.input.asks_region() && !context.asks_place;
        if !is_free || !is_shown(context) {
            return false;
        }
        let (size, zoom) = (context.session.size(), panel.points_per_pixel());
        context.cursor().is_some_and(|at| self.press(context.editor, at.picture, size, zoom))
    }

    /// Ends the drag. The panel hears the event, too.
    fn end(&mut self, context: &mut ToolContext<'_>) -> bool {
        self.drag = None;
        context.editor.end_change();
        context.redraws = true;
        false
    }

    /// Grabs the handle under the cursor, if any, and begins to transform the selected object. `zoom`: window points per picture pixel.
    fn press(&mut self, editor: &mut SceneEditor, at: DVec2, size: [u32; 2], zoom: f64) -> bool {
        let Some(drawing) = self.drawing(editor, None, size, zoom) else { return false };
        let (Some(handle), Some(shape)) = (handle_at(&drawing, at, REACH / zoom), editor.selected()) else {
            return false;
        };
        let (Some(start), Some(pivot)) = (editor.sight_line(at, size), editor.selected_pivot()) else {
            return false;
        };
        if !editor.begin_transform(shape) {
            return false;
        }
        let center = DVec2::from(drawing.pivot);
        self.drag = Some(GizmoDrag { handle, mode: self.mode, pivot, center, start, zoom });
        true
    }

    /// Transform of the drag for this cursor position; `None` without a drag, and if the position determines none.
    fn transform(&self, editor: &SceneEditor, at: DVec2, size: [u32; 2]) -> Option<DAffine3> {
        let drag = self.drag?;
        transform(&drag, editor.sight_line(at, size)?)
    }

    /// Geometry of the gizmo, with the handle under the cursor; `None` without a selection, or if the object is behind the camera.
    fn drawing(
        &self,
        editor: &SceneEditor,
        cursor: Option<DVec2>,
        size: [u32; 2],
        zoom: f64,
    ) -> Option<GizmoDrawing> {
        let world = editor.selected_pivot()?;
        let pivot = editor.project(world, size)?;
        let project = |point: DVec3| editor.project(point, size);
        // Scaled so that the least foreshortened axis has its full length in the window.
        let small = 1e-3 * editor.distance_to(world);
        let per_unit = AXES
            .iter()
            .filter_map(|axis| project(world + *axis * small))
            .map(|end| DVec2::from(end).distance(DVec2::from(pivot)) / small)
            .fold(0.0, f64::max);
        let length = LENGTH / zoom / per_unit;
        if !length.is_finite() || length <= 0.0 {
            return None;
        }
        let axes = AXES.map(|axis| match self.mode {
            GizmoMode::Turn => {
                let across = axis.any_orthonormal_vector();
                let up = axis.cross(across);
                let point = |i: usize| {
                    let (sin, cos) = (std::f64::consts::TAU * i as f64 / RING as f64).sin_cos();
                    project(world + (across * cos + up * sin) * length)
                };
                (0..=RING).filter_map(point).collect()
            }
            _ => [Some(pivot), project(world + axis * length)].into_iter().flatten().collect::<Vec<_>>(),
        });
        let mut drawing = GizmoDrawing { mode: self.mode, pivot, axes, hot: None };
        let under = cursor.and_then(|at| handle_at(&drawing, at, REACH / zoom));
        drawing.hot = self.drag.map(|drag| drag.handle).or(under);
        Some(drawing)
    }
}

/// Handle within `reach` of a position, all in picture pixels: the centre first, then the nearest.
fn handle_at(drawing: &GizmoDrawing, at: DVec2, reach: f64) -> Option<GizmoHandle> {
    if at.distance(DVec2::from(drawing.pivot)) <= reach {
        return Some(GizmoHandle::Center);
    }
    let away = |line: &Vec<[f64; 2]>| {
        let segments = line.windows(2).map(|ends| to_segment(at, ends[0].into(), ends[1].into()));
        segments.fold(f64::INFINITY, f64::min)
    };
    let distances = drawing.axes.iter().map(away).enumerate();
    let (axis, distance) = distances.min_by(|a, b| a.1.total_cmp(&b.1))?;
    (distance <= reach).then_some(GizmoHandle::Axis(axis))
}

/// Distance of a point from a line segment.
fn to_segment(at: DVec2, from: DVec2, to: DVec2) -> f64 {
    let along = to - from;
    let t = (at - from).dot(along) / along.length_squared().max(1e-12);
    at.distance(from + along * t.clamp(0.0, 1.0))
}

/// World-space transform of an object whose handle was dragged to this camera ray.
fn transform(drag: &GizmoDrag, now: SightLine) -> Option<DAffine3> {
    let GizmoDrag { handle, mode, pivot, center, start, zoom } = *drag;
    let about = |matrix: DMat3| {
        DAffine3::from_translation(pivot) * DAffine3::from_mat3(matrix) * DAffine3::from_translation(-pivot)
    };
    let factor = |factor: f64| factor.is_finite().then(|| factor.clamp(FACTORS.0, FACTORS.1));
    // Angle in the picture, counter-clockwise as displayed.
    let seen_angle = || {
        let [from, to] = [start.place - center, now.place - center];
        (from.length() > 1.0 && to.length() > 1.0).then(|| -from.angle_to(to))
    };
    match (mode, handle) {
        (GizmoMode::Move, GizmoHandle::Axis(i)) => {
            let [from, to] = [start, now].map(|line| along_axis(pivot, AXES[i], line));
            Some(DAffine3::from_translation(AXES[i] * (to? - from?)))
        }
        (GizmoMode::Move, GizmoHandle::Center) => {
            let [from, to] = [start, now].map(|line| on_plane(pivot, start.direction, line));
            Some(DAffine3::from_translation(to? - from?))
        }
        (GizmoMode::Turn, handle) => {
            let (axis, is_flat) = match handle {
                GizmoHandle::Axis(i) => (AXES[i], AXES[i].dot(start.direction).abs() < FLAT),
                // Towards the camera.
                GizmoHandle::Center => (-start.direction, true),
            };
            let angle = if is_flat {
                seen_angle()? * if axis.dot(start.direction) > 0.0 { -1.0 } else { 1.0 }
            } else {
                let [from, to] = [start, now].map(|line| on_plane(pivot, axis, line).map(|at| at - pivot));
                let (from, to) = (from?, to?);
                axis.dot(from.cross(to)).atan2(from.dot(to))
            };
            Some(about(DMat3::from_quat(DQuat::from_axis_angle(axis, angle))))
        }
        (GizmoMode::Scale, GizmoHandle::Axis(i)) => {
            let [from, to] = [start, now].map(|line| along_axis(pivot, AXES[i], line));
            let by = factor(to? / from?)?;
            Some(about(DMat3::from_diagonal(DVec3::ONE + AXES[i] * (by - 1.0))))
        }
        (GizmoMode::Scale, GizmoHandle::Center) => {
            // Dragging right or up enlarges: at the centre itself there is no distance whose ratio could be taken.
            let away = (now.place - start.place) * zoom;
            let by = factor(((away.x - away.y) / (2.0 * LENGTH)).exp2())?;
            Some(about(DMat3::from_diagonal(DVec3::splat(by))))
        }
    }
}

/// Signed distance from `pivot` along `axis` to the point closest to a camera ray; `None` if both are parallel.
fn along_axis(pivot: DVec3, axis: DVec3, line: SightLine) -> Option<f64> {
    let (between, cos) = (pivot - line.origin, axis.dot(line.direction));
    let sin2 = 1.0 - cos * cos;
    (sin2 > 1e-4).then(|| (cos * line.direction.dot(between) - axis.dot(between)) / sin2)
}

/// Intersection of a camera ray with the plane through `pivot` with this normal; `None` if they do not meet.
fn on_plane(pivot: DVec3, normal: DVec3, line: SightLine) -> Option<DVec3> {
    let cos = normal.dot(line.direction);
    let t = normal.dot(pivot - line.origin) / cos;
    (cos.abs() > 1e-6 && t > 0.0).then(|| line.origin + line.direction * t)
}

/// Colours of the axes x, y and z.
const AXIS_COLORS: [Color32; 3] =
    [Color32::from_rgb(235, 85, 80), Color32::from_rgb(110, 200, 90), Color32::from_rgb(85, 140, 245)];

/// Half the side of the handles' squares, points.
const KNOB: f32 = 4.0;

/// Draws it over the picture.
fn draw(ctx: &Context, picture: PictureArea, gizmo: &GizmoDrawing) {
    let painter = ctx.layer_painter(LayerId::background()).with_clip_rect(picture.area);
    let point = |place: &[f64; 2]| picture.point(DVec2::from(*place));
    let color = |handle: GizmoHandle, color: Color32| {
        if gizmo.hot == Some(handle) { style::ACCENT } else { color }
    };
    for (axis, line) in gizmo.axes.iter().enumerate() {
        let color = color(GizmoHandle::Axis(axis), AXIS_COLORS[axis]);
        let points: Vec<_> = line.iter().map(point).collect();
        // A dark outline beneath keeps it visible on any picture.
        painter.add(Shape::line(points.clone(), Stroke::new(4.0, Color32::from_black_alpha(110))));
        painter.add(Shape::line(points.clone(), Stroke::new(2.0, color)));
        let Some(end) = points.last().filter(|_| gizmo.mode != GizmoMode::Turn) else { continue };
        match gizmo.mode {
            GizmoMode::Scale => {
                let square = egui::Rect::from_center_size(*end, vec2(2.0 * KNOB, 2.0 * KNOB));
                painter.rect_filled(square, 0.0, color);
            }
            _ => _ = painter.circle_filled(*end, KNOB, color),
        }
    }
    let center = egui::Rect::from_center_size(point(&gizmo.pivot), vec2(2.0 * KNOB, 2.0 * KNOB));
    let color = color(GizmoHandle::Center, Color32::WHITE);
    painter.rect_stroke(center, 0.0, Stroke::new(1.5, color), StrokeKind::Middle);
}

/// Draws the buttons that select the mode.
fn choice(ui: &mut Ui, mode: GizmoMode, queue: &mut ActionQueue<GizmoAction>) {
    ui.horizontal(|ui| {
        for (choice, name) in GizmoMode::ALL {
            let button = ui.selectable_label(choice == mode, name);
            if button.on_hover_text("Drag a handle over the object in the picture  G").clicked() {
                queue.ask(GizmoAction::Set(choice));
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracer::Scene;

    const SIZE: [u32; 2] = [400, 400];

    fn editor() -> SceneEditor {
        let text = "<scene version=\"3.0.0\"><sensor type=\"perspective\"><float name=\"fov\" value=\"40\"/>\
                    <transform name=\"to_world\"><lookat origin=\"3,4,8\" target=\"0.5,0,0\" up=\"0,1,0\"/></transform>\
                    <film type=\"hdrfilm\"><integer name=\"width\" value=\"400\"/>\
                    <integer name=\"height\" value=\"400\"/></film></sensor>\
                    <shape type=\"sphere\" id=\"ball\"><point name=\"center\" x=\"1\" y=\"0.5\" z=\"0\"/></shape>\
                    <emitter type=\"constant\"/></scene>";
        let desc = crate::scene::load_str("t.xml", text, &[]).expect("valid").desc;
        let scene = Scene::prepare(&desc).expect("valid");
        let mut editor = SceneEditor::new(desc, scene).expect("a camera");
        editor.select(Some(0));
        editor
    }

    /// End of a handle in the picture.
    fn end(gizmo: &Gizmo, editor: &SceneEditor, axis: usize) -> DVec2 {
        let drawing = gizmo.drawing(editor, None, SIZE, 1.0).expect("a selection");
        drawing.axes[axis].last().copied().expect("a line").into()
    }

    #[test]
    fn what_is_moved_along_an_axis_stays_under_the_cursor() {
        for (axis, along) in AXES.into_iter().enumerate() {
            let (mut gizmo, mut editor) = (Gizmo::default(), editor());
            let pivot = editor.selected_pivot().expect("a ball");
            let (from, center) = (end(&gizmo, &editor, axis), editor.project(pivot, SIZE).expect("seen"));
            let to = from + (from - DVec2::from(center)) * 0.7;
            assert!(gizmo.press(&mut editor, from, SIZE, 1.0), "axis {axis}");
            let by = gizmo.transform(&editor, to, SIZE).expect("a transform");
            assert!(by.matrix3.abs_diff_eq(DMat3::IDENTITY, 1e-12));
            let shift = by.translation;
            assert!(shift.dot(along) > 0.1 && shift.cross(along).length() < 1e-9, "{shift}");
            editor.set_transform(by).expect("valid");
            let moved = end(&gizmo, &editor, axis);
            // Handles have a constant length in the picture, so the end is near the target, not exactly on it.
            assert!(moved.distance(to) < 0.15 * from.distance(to), "{moved} {to}");
            assert!(gizmo.drag.take().is_some());
        }
    }

    #[test]
    fn the_center_follows_the_cursor_exactly() {
        let (mut gizmo, mut editor) = (Gizmo::default(), editor());
        let center =
            DVec2::from(editor.project(editor.selected_pivot().expect("a ball"), SIZE).expect("seen"));
        assert!(gizmo.press(&mut editor, center, SIZE, 1.0));
        let to = center + DVec2::new(31.0, -17.0);
        let by = gizmo.transform(&editor, to, SIZE).expect("a transform");
        editor.set_transform(by).expect("valid");
        let moved = editor.project(editor.selected_pivot().expect("a ball"), SIZE).expect("seen");
        assert!(to.distance(DVec2::from(moved)) < 0.5, "{moved:?} {to}");
    }

    #[test]
    fn rings_turn_and_boxes_scale() {
        let (mut gizmo, mut editor) = (Gizmo { mode: GizmoMode::Turn, ..Gizmo::default() }, editor());
        let pivot = editor.selected_pivot().expect("a ball");
        for axis in 0..3 {
            let ring = gizmo.drawing(&editor, None, SIZE, 1.0).expect("a selection").axes[axis].clone();
            let handle = |i: usize| DVec2::from(ring[i]);
            assert!(gizmo.press(&mut editor, handle(4), SIZE, 1.0), "axis {axis}");
            let by = gizmo.transform(&editor, handle(10), SIZE).expect("a transform");
            gizmo.drag = None;
            assert!(by.transform_point3(pivot).distance(pivot) < 1e-9, "it turns about its centre");
            let (turned_about, angle) = DQuat::from_mat3(&by.matrix3).to_axis_angle();
            // Six of 48 steps, about the axis of a ring; another ring may lie over it.
            let is_axis = AXES.iter().any(|a| turned_about.dot(*a).abs() > 0.999);
            assert!(is_axis && (angle.abs() - 0.785).abs() < 0.6, "{turned_about} {angle}");
        }
        gizmo.mode = GizmoMode::Scale;
        let from = end(&gizmo, &editor, 1);
        let center = DVec2::from(editor.project(pivot, SIZE).expect("seen"));
        assert!(gizmo.press(&mut editor, from, SIZE, 1.0));
        let by = gizmo.transform(&editor, center + (from - center) * 2.0, SIZE).expect("a transform");
        let [x, y, z] = [by.matrix3.x_axis.x, by.matrix3.y_axis.y, by.matrix3.z_axis.z];
        assert!(x == 1.0 && z == 1.0 && (y - 2.0).abs() < 0.2, "{x} {y} {z}");
        assert!(gizmo.drag.take().is_some());
        // Nothing is grabbed elsewhere, or without a selection.
        assert!(!gizmo.press(&mut editor, DVec2::new(3.0, 3.0), SIZE, 1.0));
        editor.select(None);
        assert!(!gizmo.press(&mut editor, from, SIZE, 1.0));
    }
}
