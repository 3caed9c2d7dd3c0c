//! Moving, turning and scaling objects: what a gizmo over the picture, and the position in the panel, ask for.

use glam::{DAffine3, DMat3, DVec3};
use miette::Result;

use crate::scene::edit::{NewValue, Target, shape_name};

use crate::viewer::editor::{SceneEditor, SelectedShape};

/// A transform that the user drags.
#[derive(Clone, Copy, Debug)]
pub(super) struct TransformDrag {
    shape: u32,
    /// Object space to world space at its start.
    start: DAffine3,
    /// The centre of the shape then.
    pub(super) pivot: DVec3,
}

impl SceneEditor {
    /// The centre of the selected shape, world space: what it turns about.
    pub fn selected_pivot(&self) -> Option<DVec3> {
        let SelectedShape { shape, bounds } = self.selected?;
        let [low, high] = bounds?;
        Some(self.to_world(shape)?.transform_point3(0.5 * (low + high)))
    }

    /// The transform of a shape as it was changed last: object space to world space.
    fn to_world(&self, shape: u32) -> Option<DAffine3> {
        let file = self.original().shapes.get(shape as usize)?.to_world;
        match self.state().edits.get(Target::ToWorld(shape)) {
            Some(NewValue::Transform(to_world)) => Some(to_world),
            _ => Some(file),
        }
    }

    /// Begins to move, turn or scale a shape, which becomes the selected one; returns whether there is anything of it. The drag ends with
    /// [`end_change`](Self::end_change).
    pub fn begin_transform(&mut self, shape: u32) -> bool {
        self.select(Some(shape));
        let start = self.to_world(shape).zip(self.selected_pivot());
        self.drag = start.map(|(start, pivot)| TransformDrag { shape, start, pivot });
        self.drag.is_some()
    }

    /// Moves, turns or scales the shape by `by`, in world space, from where it was when [`begin_transform`](Self::begin_transform) was
    /// called. All until [`end_change`](Self::end_change) is one entry of the history. Returns whether another scene is traced now.
    ///
    /// # Errors
    ///
    /// When the transform has no inverse; nothing is changed then.
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

    /// Where a point of world space is in a picture of this size, in pixels, perhaps beyond its edges; `None` behind the camera.
    pub fn project(&self, point: DVec3, size: [u32; 2]) -> Option<[f64; 2]> {
        let uv = self.camera(size).ok()?.screen_position(self.original().space.point(point))?;
        Some([uv.x * f64::from(size[0]), uv.y * f64::from(size[1])])
    }
}
