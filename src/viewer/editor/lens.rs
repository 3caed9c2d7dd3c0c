//! Lens radius and focus of the camera.

use glam::DVec3;
use miette::{Result, miette};

use crate::client::window::navigation::Pose;

use crate::viewer::editor::SceneEditor;
use crate::viewer::editor::parameters::{EditedValue, ParameterValue, SceneParameter};

/// Largest lens radius on the slider, as a fraction of the distance to the target.
const WIDEST: f64 = 0.05;

/// Range of the focus slider, as multiples of the distance to the target.
const FOCUS: [f64; 2] = [0.02, 10.0];

impl SceneEditor {
    /// Radius of the lens.
    pub(super) fn aperture(&self) -> f64 {
        self.state().aperture.unwrap_or(self.original().camera.lens_radius())
    }

    /// Lens parameters; none for a camera that cannot have a lens.
    pub fn lens_parameters(&self) -> Vec<SceneParameter> {
        let mut parameters = Vec::new();
        if self.original().camera.perspective().is_none() {
            return parameters;
        }
        let (distance, aperture) = (self.pose().distance(), self.aperture());
        // Bounds that stay constant while the focus changes.
        let reach = self.opened.pose.distance();
        let value = ParameterValue::Number { value: aperture, min: 0.0, max: (WIDEST * reach).max(aperture) };
        let label = "radius of the lens".to_owned();
        parameters.push(SceneParameter { label, edits: EditedValue::Aperture, value });
        if aperture > 0.0 {
            let [min, max] = FOCUS.map(|distances| distances * reach);
            let value =
                ParameterValue::Number { value: distance, min: min.min(distance), max: max.max(distance) };
            let label = "distance in focus".to_owned();
            parameters.push(SceneParameter { label, edits: EditedValue::Focus, value });
        }
        parameters
    }

    /// Focuses the lens at the distance of a world-space point without turning the camera; returns whether anything changed.
    ///
    /// # Errors
    ///
    /// For a pinhole camera; the message says what to do.
    pub fn focus_at(&mut self, place: DVec3) -> Result<bool> {
        if self.original().camera.perspective().is_none() {
            return Err(miette!("this camera has no lens: everything is in focus"));
        }
        if self.aperture() <= 0.0 {
            return Err(miette!(
                "a pinhole has everything in focus: give the lens a radius first (tab Scene, Camera)"
            ));
        }
        let pose = self.pose();
        let ahead = (pose.target - pose.eye).normalize_or(DVec3::Z);
        let distance = (place - pose.eye).dot(ahead);
        self.end_change();
        let changed = distance > 0.0
            && self.set_pose("distance in focus", Pose { target: pose.eye + ahead * distance, ..pose });
        self.end_change();
        Ok(changed)
    }
}
