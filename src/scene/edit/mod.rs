//! Changes made to a scene after it was read: what can be changed of an object, applying it, saving it.
//!
//! ```text
//! SceneDesc as read ─ editable ─▶ Editable { label, target, value } ─ the panel ─▶ Edits::set
//!        └──────────── Edits::apply ─▶ SceneDesc as edited ─ tracer::Scene::edited ─▶ Scene
//! Edits::write ─▶ XML: <sensor> <include> <edit>… ─ scene::load ─▶ the same SceneDesc
//! ```
//!
//! Edits are always applied to the description as it was read, so that nothing drifts and undoing is removing. What can be edited is
//! one table in `parameters.rs`, with that of media in `medium.rs`: a [`Target`] is one variant and one line of it. `target.rs` has types
//! and ranges, `objects.rs` lists what an object has and names it, `save.rs` writes the file, `saved.rs` reads the changes back,
//! `named.rs` makes changes by the names that files have.

mod camera_text;
mod medium;
mod named;
pub(crate) mod objects;
pub(crate) mod parameters;
mod save;
pub(crate) mod saved;
pub(crate) mod target;

use crate::scene::desc::{CameraDesc, SceneDesc};

pub use named::{NamedEditError, NamedValue, named_values};
pub use objects::{Editable, editable, light_name, lights_and_media, material_name, medium_name, shape_name};
pub use save::SaveError;
pub use target::{BsdfNumber, EditError, NewValue, Target};

/// All changes relative to the file; at most one per target.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Edits {
    /// The camera, if it was moved.
    pub camera: Option<CameraDesc>,
    /// Values in the order in which they were first changed.
    pub values: Vec<(Target, NewValue)>,
}

impl Edits {
    /// True when there are no changes.
    pub fn is_empty(&self) -> bool {
        self.camera.is_none() && self.values.is_empty()
    }

    /// The value set for a target, if it was.
    pub fn get(&self, target: Target) -> Option<NewValue> {
        self.values.iter().find(|(t, _)| *t == target).map(|(_, v)| *v)
    }

    /// Sets a value, in the place of an earlier one for the same target. [`Edits::apply`] says whether the scene has
    /// that target.
    ///
    /// # Errors
    ///
    /// [`EditError::Value`] when the target cannot have this value; nothing is changed then.
    pub fn set(&mut self, target: Target, value: NewValue) -> Result<(), EditError> {
        target.check(value)?;
        match self.values.iter_mut().find(|(t, _)| *t == target) {
            Some((_, known)) => *known = value,
            None => self.values.push((target, value)),
        }
        Ok(())
    }

    /// The same changes for another reading of the scene, and how many have lost their object. An object is known by its `id`; one
    /// without, by its place among those of its kind while their number is the same.
    pub fn carried(&self, from: &SceneDesc, to: &SceneDesc) -> (Self, usize) {
        // Media are counted anew.
        let camera = self.camera.clone().map(|camera| CameraDesc { medium: to.camera.medium, ..camera });
        let mut carried = Self { camera, values: Vec::new() };
        for (target, value) in &self.values {
            let (parameter, index) = target.parameter();
            let new =
                objects::find(to, parameter.object, objects::address(from, parameter.object, index), index);
            let new = new.map(parameter.target).filter(|target| target.get(to).is_ok());
            carried.values.extend(new.map(|target| (target, *value)));
        }
        let lost = self.values.len() - carried.values.len();
        (carried, lost)
    }

    /// The scene with all changes. `original` is the description as it was read, never one that is edited already.
    ///
    /// # Errors
    ///
    /// [`EditError`] for the first change that the scene has no place for.
    pub fn apply(&self, original: &SceneDesc) -> Result<SceneDesc, EditError> {
        let mut desc = original.clone();
        if let Some(camera) = &self.camera {
            desc.camera = camera.clone();
        }
        for (target, value) in &self.values {
            target.set(&mut desc, *value)?;
        }
        Ok(desc)
    }
}
