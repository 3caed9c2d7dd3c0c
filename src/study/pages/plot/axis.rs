//! Axes: where a figure lies, and which figures are written beside.

use crate::study::pages::number::{THIN, plain};

/// An axis from `low` at `start` to `high` at `end`.
#[derive(Clone, Copy, Debug)]
pub struct Axis {
    /// The figures at the ends.
    pub range: [f64; 2],
    /// Where these lie.
    pub ends: [f64; 2],
    /// Logarithmic.
    pub log: bool,
}

impl Axis {
    /// A logarithmic axis that holds all positive figures, at most ten decades below the largest.
    pub fn log(figures: impl IntoIterator<Item = f64>, ends: [f64; 2]) -> Self {
        let fine = figures.into_iter().filter(|x| x.is_finite() && (1e-30..1e30).contains(x));
        let (low, high) = fine.fold((f64::INFINITY, 0f64), |(low, high), x| (low.min(x), high.max(x)));
        let range = match (low, high) {
            (_, 0.0) => [0.1, 10.0],
            (low, high) if high < 1.5 * low => [low / 2.0, high * 2.0],
            (low, high) => {
                let low = low.max(high * 1e-10);
                let room = (high / low).powf(0.04);
                [low / room, high * room]
            }
        };
        Self { range, ends, log: true }
    }

    /// A linear axis that holds 0 and all figures.
    pub fn linear(figures: impl IntoIterator<Item = f64>, ends: [f64; 2]) -> Self {
        let fine = figures.into_iter().filter(|x| x.abs() < 1e30);
        let (low, high) = fine.fold((0f64, 0f64), |(low, high), x| (low.min(x), high.max(x)));
        let range = if high - low > 0.0 { [low, high] } else { [0.0, 1.0] };
        Self { range, ends, log: false }
    }

    /// Where `x` lies; at an end if it is beyond or no figure of this axis.
    pub fn at(&self, x: f64) -> f64 {
        let [low, high] = self.range;
        let share = if self.log { (x / low).ln() / (high / low).ln() } else { (x - low) / (high - low) };
        let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
        self.ends[0] + share * (self.ends[1] - self.ends[0])
    }

    /// True if `x` lies on the axis.
    pub fn holds(&self, x: f64) -> bool {
        (self.range[0]..=self.range[1]).contains(&x)
    }

    /// Ticks at 1, 2 and 5 times powers of ten; those that are written out are `true` and at least `room` apart.
    pub fn ticks(&self, room: f64) -> Vec<(f64, bool)> {
        if self.log { self.log_ticks(room) } else { self.linear_ticks(room) }
    }

    fn log_ticks(&self, room: f64) -> Vec<(f64, bool)> {
        let [low, high] = self.range.map(f64::log10);
        let decade = (self.ends[1] - self.ends[0]).abs() / (high - low).max(1e-9);
        let every = (room / decade).ceil().max(1.0) as i32;
        let few = |k: f64| match k {
            1.0 => true,
            _ => decade * 0.3 >= room,
        };
        let powers = (low.floor() as i32).max(-40)..=(high.ceil() as i32).min(40);
        let all = powers.flat_map(|p| [1.0, 2.0, 5.0].map(|k| (p, k)));
        let ticks = all.filter_map(|(p, k)| {
            let x = k * 10f64.powi(p);
            let written = few(k) && p.rem_euclid(every) == 0;
            (self.holds(x) && (k == 1.0 || decade > 24.0)).then_some((x, written))
        });
        let mut ticks: Vec<(f64, bool)> = ticks.collect();
        if ticks.iter().filter(|(_, written)| *written).count() < 2 {
            // Less than a decade with too little room: the outermost ticks.
            let last = ticks.len().saturating_sub(1);
            for (i, tick) in ticks.iter_mut().enumerate() {
                tick.1 = i == 0 || i == last;
            }
        }
        ticks
    }

    fn linear_ticks(&self, room: f64) -> Vec<(f64, bool)> {
        let [low, high] = self.range;
        let most = ((self.ends[1] - self.ends[0]).abs() / room).floor().clamp(1.0, 10.0);
        let least = (high - low) / most;
        let power = 10f64.powf(least.log10().floor());
        let steps = [1.0, 2.0, 5.0, 10.0].map(|k| k * power);
        // The first step that leaves room, unless nothing but 0 would then be written.
        let step = steps.into_iter().find(|s| *s >= least * 0.999).unwrap_or(high - low);
        let step = if step > high.max(-low) {
            steps.into_iter().rfind(|s| *s <= high.max(-low)).unwrap_or(step)
        } else {
            step
        };
        let first = (low / step).ceil();
        (0..12).map(|i| (first + f64::from(i)) * step).filter(|x| self.holds(*x)).map(|x| (x, true)).collect()
    }
}

/// What is written at a tick.
pub fn label(x: f64) -> String {
    // Ticks are k·10^p: one digit, or two in steps of 25.
    let text = plain(x, 2);
    match text.split_once('.') {
        Some((whole, rest)) if !rest.contains('·') => {
            let rest = rest.trim_end_matches('0');
            if rest.is_empty() { whole.to_string() } else { format!("{whole}.{rest}") }
        }
        _ => text.replace(".0·", "·"),
    }
}

/// The same for shares.
pub fn percent_label(x: f64) -> String {
    format!("{}{THIN}%", label(100.0 * x))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_at_1_2_5() {
        let axis = Axis::log([0.5, 60.0], [0.0, 600.0]);
        let written: Vec<f64> = axis.ticks(50.0).into_iter().filter(|t| t.1).map(|t| t.0).collect();
        let expected = [0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0];
        assert!(written.iter().zip(expected).all(|(a, b)| (a / b - 1.0).abs() < 1e-9), "{written:?}");
        assert_eq!(Axis::linear([0.3, 0.9], [0.0, 300.0]).ticks(60.0).len(), 5);
        let labels = [0.5, 20.0, 1e-6, 2e5].map(|x| label(x).replace(THIN, " "));
        assert_eq!(labels, ["0.5", "20", "1·10⁻⁶", "200 000"]);
    }

    #[test]
    fn axes_take_anything() {
        let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -1.0, 1e-300, 1e300];
        for figures in [&bad[..], &[], &[1.0], &[1.0, f64::NAN]] {
            let both = [
                Axis::log(figures.iter().copied(), [0.0, 100.0]),
                Axis::linear(figures.iter().copied(), [9.0, 1.0]),
            ];
            for axis in both {
                assert!(axis.ticks(20.0).len() < 200);
                for x in bad {
                    assert!(axis.at(x).is_finite());
                }
            }
        }
    }
}
