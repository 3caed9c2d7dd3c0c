//! The exposure: metered at a place, changed by steps, or automatic. Auto-exposure is set at once for the first picture, then adapted
//! smoothly.

use std::time::Instant;

use glam::Vec3;
use miette::{IntoDiagnostic, Result, miette};

use crate::client::light_meter::exposure_for;
use crate::client::window::keys::{ToolKey, Trigger, mouse, tool_at_cursor, tool_key};
use crate::gpu::Region;
use crate::viewer::tools::tool::{Tool, ToolContext};

/// Exposure change per step of the mouse wheel, in stops.
const EXPOSURE_STEP: f32 = 1.0 / 6.0;

/// Half the side of the square over which the meter averages, in pixels.
const SPOT: u32 = 4;

/// Time constant of the exponential adaptation, seconds: 63 % of a change is made after this time.
const TIME_CONSTANT: f32 = 0.2;

/// Dead band, as a natural logarithm of the exposure ratio: smaller changes are ignored, since noise would make the picture flicker.
const NOTICED: f32 = 0.08;

/// Adaptation ends when the remaining difference is below this (natural logarithm of the exposure ratio).
const COMPLETE: f32 = 0.01;

/// The displayed exposure.
#[derive(Clone, Copy, Debug, Default)]
pub struct AutoExposure {
    /// `None` before the first picture.
    shown: Option<f32>,
    /// Time of the last adaptation step, while adaptation is in progress.
    changing: Option<Instant>,
}

/// What the user can do with the exposure.
#[derive(Clone, Debug, PartialEq)]
pub enum ExposureAction {
    /// Sets it from the light at a place.
    Meter,
    /// Changes it by this many steps of a sixth of a stop.
    Step(f64),
    /// Switches auto-exposure on, or off at the present exposure.
    ToggleAutomatic,
}

impl Tool for AutoExposure {
    type Action = ExposureAction;

    fn keys() -> Vec<ToolKey<ExposureAction>> {
        let meter = "expose for the light under the cursor";
        let automatic = "fix the brightness, or let it follow the light";
        vec![
            mouse("Ctrl+Shift+wheel", "brightness").below("a new picture, as large as the window"),
            tool_at_cursor("M", meter, &[Trigger::Char('m')], ExposureAction::Meter).below("brightness"),
            tool_key("B", automatic, &[Trigger::Char('b')], ExposureAction::ToggleAutomatic).below(meter),
        ]
    }

    fn perform(&mut self, action: ExposureAction, context: &mut ToolContext<'_>) -> Result<Option<String>> {
        let exposure = match action {
            ExposureAction::ToggleAutomatic => {
                context.panel.controls.auto_exposure ^= true;
                return Ok(None);
            }
            ExposureAction::Meter => {
                context.check_light_is_shown()?;
                let mean = f64::from(spot(context)?.y);
                exposure_for(mean).ok_or_else(|| miette!("there is no light here to expose for"))?
            }
            ExposureAction::Step(steps) => {
                let exposure = context.panel.controls.settings.exposure;
                (exposure * 2f32.powf(steps as f32 * EXPOSURE_STEP)).clamp(1e-6, 1e9)
            }
        };
        context.panel.controls.auto_exposure = false;
        context.panel.change_settings(|settings| settings.exposure = exposure);
        Ok(None)
    }

    fn frame(&mut self, now: Instant, context: &mut ToolContext<'_>) {
        let controls = &mut context.panel.controls;
        if !controls.auto_exposure {
            return self.start_from(controls.settings.exposure);
        }
        let metered = context.picture.metered().filter(|_| !context.picture.is_frozen());
        if let Some(exposure) = self.step(metered, now) {
            controls.settings.exposure = exposure;
            context.picture.expose();
        }
    }

    fn is_busy(&self) -> bool {
        self.changing.is_some()
    }
}

/// Mean displayed colour around the place of the action, scene-linear XYZ.
fn spot(context: &mut ToolContext<'_>) -> Result<Vec3> {
    let size = context.session.size();
    let place = context.cursor_place()?.shown.to_array().map(|at| at as u32);
    let low = place.map(|at| at.saturating_sub(SPOT));
    let extent = [0, 1].map(|i| (place[i] + SPOT + 1).min(size[i]).saturating_sub(low[i]).max(1));
    let shown = context.picture.shown(Region { origin: low, extent }).into_diagnostic()?;
    let spot = shown.map_or(Vec::new(), |shown| shown.xyz);
    Ok(spot.iter().map(|xyz| Vec3::from(*xyz)).sum::<Vec3>() / spot.len().max(1) as f32)
}

impl AutoExposure {
    /// The exposure to show now, given the metered one if known; `None` if it stays unchanged.
    fn step(&mut self, wanted: Option<f32>, now: Instant) -> Option<f32> {
        let wanted = wanted?;
        let Some(shown) = self.shown else {
            self.shown = Some(wanted);
            return Some(wanted);
        };
        let away = (wanted / shown).ln();
        match self.changing {
            None if away.abs() < NOTICED => return None,
            // Beginning of an adaptation.
            None => {
                self.changing = Some(now);
                return None;
            }
            Some(_) if away.abs() < COMPLETE => {
                self.changing = None;
                return None;
            }
            Some(_) => {}
        }
        let since = self.changing.replace(now).map_or(0.0, |last| (now - last).as_secs_f32());
        let next = shown * (away * (1.0 - (-since / TIME_CONSTANT).exp())).exp();
        self.shown = Some(next);
        Some(next)
    }

    /// Continues from an exposure that the user has set.
    fn start_from(&mut self, exposure: f32) {
        *self = Self { shown: Some(exposure), changing: None };
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn the_first_is_shown_at_once_and_others_are_eased() {
        let (mut light, start) = (AutoExposure::default(), Instant::now());
        let at = |ms: u64| start + Duration::from_millis(ms);
        assert_eq!(light.step(None, at(0)), None);
        assert_eq!(light.step(Some(2.0), at(1)), Some(2.0));
        // Noise.
        assert_eq!(light.step(Some(2.1), at(20)), None);
        assert_eq!(light.step(Some(1.9), at(40)), None);
        // A dark scene: the exposure rises to four times the value, step by step, without overshoot.
        let mut last = 2.0;
        for ms in (100..2000).step_by(16) {
            if let Some(next) = light.step(Some(8.0), at(ms)) {
                assert!(next > last && next < 8.0 && next / last < 1.2, "{last} to {next} at {ms} ms");
                last = next;
            }
        }
        assert!(last > 7.9 && !light.is_busy(), "{last}");
    }
}
