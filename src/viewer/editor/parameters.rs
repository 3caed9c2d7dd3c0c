//! The parameters of the scene that the user edits: those of the selected shape, or of the lights, and of the lens.

use std::sync::Arc;

use glam::{DAffine3, DVec3};
use miette::{IntoDiagnostic, Result};

use crate::client::window::navigation::Pose;
use crate::scene::edit::{Edits, NewValue, Target, editable, lights_and_media, shape_name};
use crate::viewer::editor::transform::TransformDrag;
use crate::viewer::editor::{EditorState, SceneEditor, SelectedShape};

/// The selected object or, if nothing is selected, the lights of the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Selection {
    /// `id` of the object, or its kind and line in the file.
    pub name: String,
    /// Whether it is a selection that can be cleared.
    pub selected: bool,
    /// Editable parameters.
    pub parameters: Vec<SceneParameter>,
}

/// An editable parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneParameter {
    /// Label of the parameter.
    pub label: String,
    /// What it changes.
    pub edits: EditedValue,
    /// Present value.
    pub value: ParameterValue,
}

/// What an editable parameter changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EditedValue {
    /// A parameter of an object in the scene.
    Of(Target),
    /// The centre of the selected shape.
    Position,
    /// Lens radius.
    Aperture,
    /// Focus distance.
    Focus,
}

/// Value of an editable parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParameterValue {
    /// A factor ≥ 0 on the file's value, shown logarithmically.
    Scale(f64),
    /// Linear Rec.709 reflectance or emission colour, 0 … 1.
    Color([f32; 3]),
    /// A number within bounds.
    Number {
        /// Present value.
        value: f64,
        /// Least value.
        min: f64,
        /// Greatest value.
        max: f64,
    },
    /// On or off.
    Switch(bool),
    /// A point or a direction in world space.
    Vector {
        /// Present value.
        value: [f64; 3],
        /// Step of the value when dragged.
        step: f64,
    },
}

impl SceneEditor {
    /// The selected shape with its editable parameters. Without a selection: those of media, and of lights without a shape that could be clicked at,
    /// if there are any.
    pub fn selection(&self) -> Option<Selection> {
        let editables = match self.selected {
            Some(SelectedShape { shape, .. }) => editable(self.original(), shape),
            None => lights_and_media(self.original()),
        };
        let step = 0.01 * self.pose().distance();
        let of = |value, target: Target| match value {
            NewValue::Scale(factor) => Some(ParameterValue::Scale(factor)),
            NewValue::Rgb(rgb) => Some(ParameterValue::Color(rgb.map(|c| c as f32))),
            NewValue::Number(value) => {
                let [min, max] = target.bounds();
                Some(ParameterValue::Number { value, min, max })
            }
            NewValue::Switch(on) => Some(ParameterValue::Switch(on)),
            NewValue::Vector(value) => {
                let step = if matches!(target, Target::LightDirection(_)) { 0.01 } else { step };
                Some(ParameterValue::Vector { value, step })
            }
            NewValue::Transform(_) => None,
        };
        let edits = &self.state().edits;
        let values = editables.into_iter().filter_map(|one| {
            let value = edits.get(one.target).unwrap_or(one.value);
            let value = of(value, one.target)?;
            Some(SceneParameter { label: one.label, edits: EditedValue::Of(one.target), value })
        });
        let mut parameters: Vec<_> = values.collect();
        if let Some(pivot) = self.selected_pivot() {
            let value = ParameterValue::Vector { value: pivot.to_array(), step };
            let label = "position".to_owned();
            parameters.push(SceneParameter { label, edits: EditedValue::Position, value });
        }
        let name = match self.selected {
            Some(SelectedShape { shape, .. }) => shape_name(self.original(), shape),
            None if parameters.is_empty() => return None,
            None if self.original().has_media() => "Lights and media".to_owned(),
            None => "Lights".to_owned(),
        };
        Some(Selection { name, selected: self.selected.is_some(), parameters })
    }

    /// Sets a parameter of the selection or the lens to a new value. On an error, such as a value out of range, nothing changes. Returns
    /// whether another scene or camera is traced now; otherwise a later [`follow`](Self::follow) takes the change over.
    pub fn edit(&mut self, SceneParameter { label, edits, value }: SceneParameter) -> Result<bool> {
        let number = match value {
            ParameterValue::Number { value, .. } => value,
            _ => 0.0,
        };
        match edits {
            EditedValue::Of(target) => {
                let value = match value {
                    ParameterValue::Scale(factor) => NewValue::Scale(factor),
                    ParameterValue::Color(rgb) => NewValue::Rgb(rgb.map(f64::from)),
                    ParameterValue::Number { value, .. } => NewValue::Number(value),
                    ParameterValue::Switch(on) => NewValue::Switch(on),
                    ParameterValue::Vector { value, .. } => NewValue::Vector(value),
                };
                let (what, object) = match self.selected {
                    Some(SelectedShape { shape, .. }) => (target.label(), shape_name(self.original(), shape)),
                    None => (label.as_str(), String::new()),
                };
                self.set_value(target, value, what, object)
            }
            EditedValue::Position => {
                let (Some(SelectedShape { shape, .. }), ParameterValue::Vector { value, .. }) =
                    (self.selected, value)
                else {
                    return Ok(false);
                };
                if self.drag.is_none() {
                    self.begin_transform(shape);
                }
                let Some(TransformDrag { pivot, .. }) = self.drag else { return Ok(false) };
                self.set_transform(DAffine3::from_translation(DVec3::from(value) - pivot))
            }
            EditedValue::Aperture => {
                let same = number == self.original().camera.lens_radius();
                let state = EditorState { aperture: (!same).then_some(number), ..self.state().clone() };
                let changed = self.history.change("lens", "radius of the lens", state);
                Ok(self.follow()? || changed)
            }
            EditedValue::Focus => {
                let pose = self.pose();
                let ahead = (pose.target - pose.eye).normalize_or(DVec3::Z);
                let pose = Pose { target: pose.eye + ahead * number, ..pose };
                Ok(self.set_pose("distance in focus", pose))
            }
        }
    }

    /// Sets a parameter; `what` names the change in the history. Returns whether another scene is traced now.
    pub(super) fn set_value(
        &mut self,
        target: Target,
        value: NewValue,
        what: &str,
        object: String,
    ) -> Result<bool> {
        let mut edits = Edits::clone(&self.state().edits);
        edits.set(target, value).into_diagnostic()?;
        let change = if object.is_empty() { what.to_owned() } else { format!("{what} of `{object}`") };
        let state = EditorState { edits: Arc::new(edits), ..self.state().clone() };
        self.history.change(&format!("{target:?}"), &change, state);
        self.follow()
    }
}
