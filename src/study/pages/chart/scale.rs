//! Axes: positions of values, and ticks.

use crate::study::format::{THIN, significant, trimmed};

/// Maps values to positions along an axis, linearly or logarithmically.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    pub range: [f64; 2],
    pub ends: [f64; 2],
    logarithmic: bool,
}

impl Scale {
    /// A logarithmic scale over all positive values, at most ten decades.
    pub fn logarithmic(values: impl IntoIterator<Item = f64>, ends: [f64; 2]) -> Self {
        let usable = values.into_iter().filter(|x| (1e-30..1e30).contains(x));
        let (low, high) = usable.fold((f64::INFINITY, 0f64), |(low, high), x| (low.min(x), high.max(x)));
        let range = match (low, high) {
            (_, 0.0) => [0.1, 10.0],
            (low, high) if high < 1.5 * low => [low / 2.0, high * 2.0],
            (low, high) => {
                let low = low.max(high * 1e-10);
                let room = (high / low).powf(0.04);
                [low / room, high * room]
            }
        };
        Self { range, ends, logarithmic: true }
    }

    /// A linear scale over 0 and all values.
    pub fn linear(values: impl IntoIterator<Item = f64>, ends: [f64; 2]) -> Self {
        let usable = values.into_iter().filter(|x| x.abs() < 1e30);
        let (low, high) = usable.fold((0f64, 0f64), |(low, high), x| (low.min(x), high.max(x)));
        let range = if high - low > 0.0 { [low, high] } else { [0.0, 1.0] };
        Self { range, ends, logarithmic: false }
    }

    /// Position of `x`, clamped to the ends; an end for NaN.
    pub fn at(&self, x: f64) -> f64 {
        let [low, high] = self.range;
        let share =
            if self.logarithmic { (x / low).ln() / (high / low).ln() } else { (x - low) / (high - low) };
        let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
        self.ends[0] + share * (self.ends[1] - self.ends[0])
    }

    pub fn holds(&self, x: f64) -> bool {
        (self.range[0]..=self.range[1]).contains(&x)
    }

    /// Round tick values at least about `room` apart: 1, 2 and 5 times powers of ten, or every n-th power alone.
    pub fn ticks(&self, room: f64) -> Vec<f64> {
        let mut ticks = if self.logarithmic { self.powers(room) } else { self.steps(room) };
        ticks.retain(|x| self.holds(*x));
        if ticks.len() < 2 && self.logarithmic { self.range.to_vec() } else { ticks }
    }

    fn powers(&self, room: f64) -> Vec<f64> {
        let [low, high] = self.range.map(f64::log10);
        let decade = (self.ends[1] - self.ends[0]).abs() / (high - low);
        let (step, digits): (usize, &[f64]) = if 0.3 * decade >= room {
            (1, &[1.0, 2.0, 5.0])
        } else {
            ((room / decade).ceil() as usize, &[1.0])
        };
        let powers = (low.floor() as i32..=high.ceil() as i32).step_by(step.max(1));
        powers.flat_map(|p| digits.iter().map(move |k| k * 10f64.powi(p))).collect()
    }

    fn steps(&self, room: f64) -> Vec<f64> {
        let [low, high] = self.range;
        let most = ((self.ends[1] - self.ends[0]).abs() / room).floor().clamp(1.0, 10.0);
        let least = (high - low) / most;
        let power = 10f64.powf(least.log10().floor());
        let steps = [10.0, 5.0, 2.0, 1.0].map(|k| k * power);
        // The smallest step that leaves room, but not so large that 0 would be the only tick.
        let mut fitting = steps.into_iter().filter(|s| *s <= high.max(-low));
        let roomy = fitting.clone().rfind(|s| *s >= least * 0.999);
        let step = roomy.or_else(|| fitting.next()).unwrap_or(high - low);
        let first = (low / step).ceil();
        (0..12).map(|i| (first + f64::from(i)) * step).collect()
    }
}

pub fn tick_label(x: f64) -> String {
    trimmed(&significant(x, 2)).replace(".0·", "·")
}

/// As the plain label, with `x` as a fraction in per cent.
pub fn percent_label(x: f64) -> String {
    format!("{}{THIN}%", tick_label(x))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::format::with_plain_spaces;

    #[test]
    fn ticks_are_round() {
        let written = Scale::logarithmic([0.5, 60.0], [0.0, 600.0]).ticks(50.0);
        let expected = [0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0];
        assert!(written.iter().zip(expected).all(|(a, b)| (a / b - 1.0).abs() < 1e-9), "{written:?}");
        assert_eq!(Scale::linear([0.3, 0.9], [0.0, 300.0]).ticks(60.0).len(), 5);
        let labels = [0.5, 20.0, 1e-6, 2e5].map(|x| with_plain_spaces(&tick_label(x)));
        assert_eq!(labels, ["0.5", "20", "1·10⁻⁶", "200 000"]);
    }

    #[test]
    fn scales_take_any_value() {
        let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -1.0, 1e-300, 1e300];
        for values in [&bad[..], &[], &[1.0], &[1.0, f64::NAN], &[1.6, 1.9]] {
            let values = || values.iter().copied();
            for scale in [Scale::logarithmic(values(), [0.0, 100.0]), Scale::linear(values(), [9.0, 1.0])] {
                assert!(scale.ticks(20.0).len() < 200 && bad.iter().all(|x| scale.at(*x).is_finite()));
            }
        }
    }
}
