//! Errors and predictions for people.

use crate::study::interval::Interval;
use crate::study::watch::{Quantity, State};

/// A share in per cent with two or three digits: `0.98 %`.
pub fn percent(share: f64) -> String {
    let value = 100.0 * share;
    match value {
        v if !v.is_finite() => "–".to_string(),
        v if v >= 99.5 => format!("{v:.0} %"),
        v if v >= 9.95 => format!("{v:.1} %"),
        v if v >= 0.1 => format!("{v:.2} %"),
        v => format!("{v:.3} %"),
    }
}

/// A round share as it is typed: `1 %`, `0.5 %`.
pub fn round_percent(share: f64) -> String {
    let text = format!("{:.4}", 100.0 * share);
    format!("{} %", text.trim_end_matches('0').trim_end_matches('.'))
}

/// A time in the unit that suits it: `8.3 s`, `42 s`, `12 min`, `3.4 h`, `5 days`.
pub fn duration(seconds: f64) -> String {
    match seconds {
        s if !s.is_finite() => "–".to_string(),
        s if s < 9.95 => format!("{s:.1} s"),
        s if s < 120.0 => format!("{s:.0} s"),
        s if s < 7200.0 => format!("{:.0} min", s / 60.0),
        s if s < 48.0 * 3600.0 => format!("{:.1} h", s / 3600.0),
        s => format!("{:.0} days", s / 86_400.0),
    }
}

/// From `now` on until then, with the interval: `42 s (90 %: 36–55 s)`.
pub fn when(now: f64, seconds: Interval) -> String {
    let left = seconds.map(|s| (s - now).max(0.0));
    let [value, low, high] = [left.value, left.low, left.high].map(duration);
    // Both ends in one unit have it once.
    let unit = |text: &str| text.split_once(' ').map(|(_, unit)| unit.to_string());
    let short = if unit(&low) == unit(&high) { low.split(' ').next().unwrap_or(&low) } else { &low };
    format!("{value} (90 %: {short}–{high})")
}

impl State {
    /// `error 2.31 %, 1 % in about 42 s (90 %: 36–55 s)`; what it cannot know yet it says so.
    pub fn sentence(&self, at: Quantity) -> String {
        let Some(last) = self.looks.last() else { return "error not known yet".to_string() };
        let error = percent(self.figures.relative[at.index()].value);
        match self.prediction {
            Some(said) => {
                format!(
                    "error {error}, {} in about {}",
                    round_percent(said.target),
                    when(last.seconds, said.seconds)
                )
            }
            None => format!("error {error}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::curve::Look;
    use crate::study::error::Figures;
    use crate::study::prediction::Prediction;

    #[test]
    fn errors_and_times_read_well() {
        assert_eq!([0.0098, 0.123, 1.5, 0.0004].map(percent), ["0.98 %", "12.3 %", "150 %", "0.040 %"]);
        assert_eq!([0.01, 0.005, 0.0001, 0.2].map(round_percent), ["1 %", "0.5 %", "0.01 %", "20 %"]);
        assert_eq!(
            [2.04, 42.0, 600.0, 1e4, 1e6].map(duration),
            ["2.0 s", "42 s", "10 min", "2.8 h", "12 days"]
        );
        let mut state = State::default();
        assert_eq!(state.sentence(Quantity::P95), "error not known yet");
        state.looks.push(Look { seconds: 10.0, samples: 1.0, error: 0.0231, deviation: 0.1 });
        state.figures = Figures { relative: [Interval::exact(0.0231); 3], ..Figures::default() };
        assert_eq!(state.sentence(Quantity::P95), "error 2.31 %");
        let seconds = Interval { value: 52.0, low: 46.0, high: 65.0 };
        state.prediction = Some(Prediction { at: 10.0, error: 0.0231, target: 0.01, seconds });
        assert_eq!(state.sentence(Quantity::P95), "error 2.31 %, 1 % in about 42 s (90 %: 36–55 s)");
        let seconds = Interval { value: 52.0, low: 46.0, high: 650.0 };
        state.prediction =
            Some(Prediction { seconds, ..Prediction { at: 10.0, error: 0.0231, target: 0.01, seconds } });
        assert_eq!(state.sentence(Quantity::P95), "error 2.31 %, 1 % in about 42 s (90 %: 36 s–11 min)");
    }
}
