//! Translation, rotation and scaling of objects, as the gizmo and the position field of the panel request them.

use glam::{DAffine3, DMat3, DVec2, DVec3};
use miette::Result;

use crate::scene::edit::{NewValue, Target, shape_name};

use crate::viewer::editor::{CENTER, SceneEditor, SelectedShape};

/// A transform in progress, dragged by the user.
#[derive(Clone, Copy, Debug)]
pub(super) struct TransformDrag {
    shape: u32,
    /// Object-to-world transform at the start of the drag.
    start: DAffine3,
    /// Centre of the shape at the start of the drag.
    pub(super) pivot: DVec3,
}

/// A camera ray in world space through a position of the picture.
#[derive(Clone, Copy, Debug)]
pub struct SightLine {
    /// Position in pixels of the picture.
    pub place: DVec2,
    pub origin: DVec3,
    /// Unit length.
    pub direction: DVec3,
}

impl SceneEditor {
    /// Centre of the selected shape in world space, which is the pivot of rotation and scale.
    pub fn selected_pivot(&self) -> Option<DVec3> {
        let SelectedShape { shape, bounds } = self.selected?;
        let [low, high] = bounds?;
        Some(self.to_world(shape)?.transform_point3(0.5 * (low + high)))
    }

    /// Object-to-world transform of a shape with its last edit applied.
    fn to_world(&self, shape: u32) -> Option<DAffine3> {
        let file = self.original().shapes.get(shape as usize)?.to_world;
        match self.state().edits.get(Target::ToWorld(shape)) {
            Some(NewValue::Transform(to_world)) => Some(to_world),
            _ => Some(file),
        }
    }

    /// Begins to transform a shape and selects it; returns whether the shape has any extent. The drag ends with
    /// [`end_change`](Self::end_change).
    pub fn begin_transform(&mut self, shape: u32) -> bool {
        self.select(Some(shape));
        let start = self.to_world(shape).zip(self.selected_pivot());
        self.drag = start.map(|(start, pivot)| TransformDrag { shape, start, pivot });
        self.drag.is_some()
    }

    /// Applies `by`, in world space, to the shape's transform at the time of [`begin_transform`](Self::begin_transform). All calls until
    /// [`end_change`](Self::end_change) share one history entry. Returns whether another scene is traced now.
    ///
    /// # Errors
    ///
    /// When the transform is singular; nothing changes then.
    pub fn set_transform(&mut self, by: DAffine3) -> Result<bool> {
        let Some(TransformDrag { shape, start, .. }) = self.drag else { return Ok(false) };
        let rigid = (by.matrix3.transpose() * by.matrix3).abs_diff_eq(DMat3::IDENTITY, 1e-9);
        let what = match rigid {
            true if by.matrix3.abs_diff_eq(DMat3::IDENTITY, 1e-12) => "move",
            true => "turn",
            false => "scaling",
        };
        self.set_value(
            Target::ToWorld(shape),
            NewValue::Transform(by * start),
            what,
            shape_name(self.original(), shape),
        )
    }

    /// Camera ray through a position of a picture of this size, in pixels; `None` where the camera shows nothing there.
    pub fn sight_line(&self, place: DVec2, size: [u32; 2]) -> Option<SightLine> {
        let uv = (place / DVec2::from(size.map(f64::from))).to_array();
        let ray = self.seeing_camera(size).ok()?.ray(uv, CENTER)?;
        let direction = ray.direction.as_dvec3().normalize_or(DVec3::Z);
        Some(SightLine { place, origin: self.original().space.world_point(ray.origin), direction })
    }

    /// Projects a world-space point into a picture of this size, in pixels, possibly outside its edges; `None` behind the camera.
    pub fn project(&self, point: DVec3, size: [u32; 2]) -> Option<[f64; 2]> {
        let uv = self.seeing_camera(size).ok()?.screen_position(self.original().space.point(point))?;
        Some([uv.x * f64::from(size[0]), uv.y * f64::from(size[1])])
    }
}
