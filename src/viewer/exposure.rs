//! Auto-exposure: set at once for the first picture, then adapted smoothly.

use std::time::Instant;

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

impl AutoExposure {
    /// The exposure to show now, given the metered one if known; `None` if it stays unchanged.
    pub fn step(&mut self, wanted: Option<f32>, now: Instant) -> Option<f32> {
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
    pub fn start_from(&mut self, exposure: f32) {
        *self = Self { shown: Some(exposure), changing: None };
    }

    /// Whether adaptation is in progress.
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
        // A dark scene: the exposure rises to four times the value, step by step, without overshoot.
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
