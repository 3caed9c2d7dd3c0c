//! The transform gizmo: converts a dragged handle over the selected object into its transform.

use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};

use crate::client::window::panel::{GizmoDrawing, GizmoHandle, GizmoMode};
use crate::viewer::editor::SceneEditor;

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

/// A camera ray in world space through a position of the picture.
#[derive(Clone, Copy, Debug)]
pub struct SightLine {
    /// Position in pixels of the picture.
    pub place: DVec2,
    pub origin: DVec3,
    /// Unit length.
    pub direction: DVec3,
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
    pub mode: GizmoMode,
    drag: Option<GizmoDrag>,
}

impl Gizmo {
    /// Whether a handle is being dragged.
    pub fn is_dragging(&self) -> bool {
        self.drag.is_some()
    }

    /// Ends the drag; returns whether there was one.
    pub fn release(&mut self) -> bool {
        self.drag.take().is_some()
    }

    /// Grabs the handle under the cursor, if any, and begins to transform the selected object. `zoom`: window points per picture pixel.
    pub fn press(&mut self, editor: &mut SceneEditor, at: DVec2, size: [u32; 2], zoom: f64) -> bool {
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
    pub fn transform(&self, editor: &SceneEditor, at: DVec2, size: [u32; 2]) -> Option<DAffine3> {
        let drag = self.drag?;
        transform(&drag, editor.sight_line(at, size)?)
    }

    /// Geometry of the gizmo, with the handle under the cursor; `None` without a selection, or if the object is behind the camera.
    pub fn drawing(
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
            assert!(gizmo.release());
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
            gizmo.release();
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
        assert!(gizmo.release());
        // Nothing is grabbed elsewhere, or without a selection.
        assert!(!gizmo.press(&mut editor, DVec2::new(3.0, 3.0), SIZE, 1.0));
        editor.select(None);
        assert!(!gizmo.press(&mut editor, from, SIZE, 1.0));
    }
}
