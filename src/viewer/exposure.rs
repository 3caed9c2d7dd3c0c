//! An exposure that follows the light of the scene, as an eye does: at once in the first picture, then eased.

use std::time::Instant;

/// Time after which 63 % of a change is made, seconds.
const TIME_CONSTANT: f32 = 0.2;

/// Changes of light by a smaller factor than this (a natural logarithm) are not followed: noise would make the picture flicker.
const NOTICED: f32 = 0.08;

/// A change is complete when this much of it (a natural logarithm) is left.
const COMPLETE: f32 = 0.01;

/// The exposure that is shown.
#[derive(Clone, Copy, Debug, Default)]
pub struct AutoExposure {
    /// `None` before the first picture.
    shown: Option<f32>,
    /// A change is being made, and was last brought on at this time.
    changing: Option<Instant>,
}

impl AutoExposure {
    /// The exposure to show now, given the one that the light of the scene asks for, if it is known; `None` where it stays as it is.
    pub fn step(&mut self, wanted: Option<f32>, now: Instant) -> Option<f32> {
        let wanted = wanted?;
        let Some(shown) = self.shown else {
            self.shown = Some(wanted);
            return Some(wanted);
        };
        let away = (wanted / shown).ln();
        match self.changing {
            None if away.abs() < NOTICED => return None,
            // From here on it is a change.
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

    /// Begins from this exposure, which the user has chosen.
    pub fn start_from(&mut self, exposure: f32) {
        *self = Self { shown: Some(exposure), changing: None };
    }

    /// Whether a change is being made.
    pub fn is_changing(&self) -> bool {
        self.changing.is_some()
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
        // Darkness: four times the exposure, a step at a time, and never beyond.
        let mut last = 2.0;
        for ms in (100..2000).step_by(16) {
            if let Some(next) = light.step(Some(8.0), at(ms)) {
                assert!(next > last && next < 8.0 && next / last < 1.2, "{last} to {next} at {ms} ms");
                last = next;
            }
        }
        assert!(last > 7.9 && !light.is_changing(), "{last}");
    }
}
