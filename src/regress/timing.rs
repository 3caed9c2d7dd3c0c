//! Whether a case takes longer with this program than with another: ratios of times of interleaved renderings, with intervals.
//!
//! Both programs render the same scene with the same seed by turns, A B B A and so on, so that a clock that drifts (a processor that gets
//! warm, a neighbour that comes and goes) favours neither. Only the ratio of the two times of a pair is looked at: an absolute time says
//! more about the machine than about the program.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::math::quantile::nearest_rank;
use crate::study::Interval;
use crate::study::format::{duration, increase, percent, round_percent, with_plain_spaces};
use crate::study::interval::student;

/// Smallest relative difference of times that is told, added to every interval. A program's speed depends on the placement of its code and the
/// size of its environment by about as much, which no number of pairs averages out (Mytkowicz et al., *Producing Wrong Data Without Doing
/// Anything Obviously Wrong!*, ASPLOS 2009); the wall clock of a process is looked at in steps of about as much, too.
const SYSTEMATIC: f64 = 0.005;

/// Differences as small as this need no more pairs.
const NARROW: f64 = 0.02;

/// How a case's times compare with those of another program. Field names are JSON keys.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CaseTiming {
    /// The other program.
    pub against: PathBuf,
    /// Hash of its file.
    pub against_hash: String,
    /// Pairs of renderings.
    pub pairs: u32,
    /// What was found.
    pub verdict: TimingVerdict,
    /// One sentence about it, or why the case could not be timed.
    pub sentence: String,
    /// Tracing, rendering, the whole process, and each pass of the GPU.
    pub figures: Vec<TimedFigure>,
}

/// Outcome of timing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TimingVerdict {
    /// No difference was shown; the sentence says how large one could be.
    AsFast,
    /// This program is faster.
    Faster,
    /// This program is slower, at least in one of the figures.
    Slower,
    /// One of the programs did not render the case.
    Untimed,
}

impl TimingVerdict {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::AsFast => "as fast",
            Self::Faster => "faster",
            Self::Slower => "slower",
            Self::Untimed => "not timed",
        }
    }
}

/// One kind of time, with this program and the other. Field names are JSON keys.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimedFigure {
    /// What was timed.
    pub name: String,
    /// Medians over all pairs of this program and the other, in seconds.
    pub seconds: [f64; 2],
    /// Geometric mean of the ratios of pairs, this program over the other, with its 90 % interval: above 1 is slower.
    pub ratio: Interval,
    /// The ratio's interval that is wrong in some figure of some case with the probability of a false alarm of the run.
    pub certain: [f64; 2],
}

impl TimedFigure {
    /// Judges pairs of times in seconds, this program and the other; `false_alarm` is the probability that a figure without a difference shows
    /// one. `None` for fewer than two pairs, and for times that are not positive.
    ///
    /// The interval is Student's on logarithms of ratios: pairs are independent, and a ratio's error is relative.
    pub fn of_pairs(name: &str, pairs: &[[f64; 2]], false_alarm: f64) -> Option<Self> {
        if pairs.len() < 2 || pairs.iter().flatten().any(|time| !(time.is_finite() && *time > 0.0)) {
            return None;
        }
        let logs: Vec<f64> = pairs.iter().map(|[now, other]| (now / other).ln()).collect();
        let n = logs.len() as f64;
        let mean = logs.iter().sum::<f64>() / n;
        let variance = logs.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let half = student(0.5 * false_alarm, n - 1.0) * (variance / n).sqrt() + SYSTEMATIC;
        let seconds = [0, 1].map(|side| {
            let mut times: Vec<f64> = pairs.iter().map(|pair| pair[side]).collect();
            median(&mut times).unwrap_or(f64::NAN)
        });
        Some(Self {
            name: name.to_owned(),
            seconds,
            ratio: Interval::of_mean(&logs)?.map(f64::exp),
            certain: [(mean - half).exp(), (mean + half).exp()],
        })
    }

    /// What the figure shows.
    pub fn verdict(&self) -> TimingVerdict {
        match self.certain {
            [low, _] if low > 1.0 => TimingVerdict::Slower,
            [_, high] if high < 1.0 => TimingVerdict::Faster,
            _ => TimingVerdict::AsFast,
        }
    }

    /// The largest relative difference that the pairs allow.
    pub fn within(&self) -> f64 {
        (self.certain[1] - 1.0).max(1.0 - self.certain[0])
    }

    /// More pairs could say more.
    pub fn is_open(&self) -> bool {
        self.verdict() == TimingVerdict::AsFast && self.within() > NARROW
    }
}

impl CaseTiming {
    /// The outcome of figures; `missing` are names of times that not all renderings report.
    pub fn of_figures(
        [against, against_hash]: [&str; 2],
        pairs: u32,
        figures: Vec<TimedFigure>,
        missing: &[String],
    ) -> Self {
        let of = |verdict: TimingVerdict| {
            let shown = figures.iter().filter(|figure| figure.verdict() == verdict);
            shown.map(|figure| format!("{} {}", figure.name, change(&figure.ratio))).collect::<Vec<_>>()
        };
        let [slower, faster] = [TimingVerdict::Slower, TimingVerdict::Faster].map(of);
        let verdict = match (slower.is_empty(), faster.is_empty()) {
            _ if figures.is_empty() => TimingVerdict::Untimed,
            (false, _) => TimingVerdict::Slower,
            (true, false) => TimingVerdict::Faster,
            (true, true) => TimingVerdict::AsFast,
        };
        let mut parts = Vec::new();
        for (word, found) in [("slower", &slower), ("faster", &faster)] {
            if !found.is_empty() {
                parts.push(format!("{word}: {}", found.join(", ")));
            }
        }
        if verdict == TimingVerdict::AsFast {
            let within: Vec<String> = figures
                .iter()
                .map(|figure| format!("{} within {}", figure.name, percent(figure.within())))
                .collect();
            parts.push(format!("as fast: {}", within.join(", ")));
        }
        if figures.is_empty() {
            parts.push("the reports of the renderings have no times in common".to_owned());
        }
        if !missing.is_empty() {
            parts.push(format!("not all renderings report {}", missing.join(", ")));
        }
        Self {
            against: against.into(),
            against_hash: against_hash.to_owned(),
            pairs,
            verdict,
            sentence: parts.join("; "),
            figures,
        }
    }

    /// A case that could not be timed, for this reason.
    pub fn failed([against, against_hash]: [&str; 2], reason: String) -> Self {
        Self {
            against: against.into(),
            against_hash: against_hash.to_owned(),
            pairs: 0,
            verdict: TimingVerdict::Untimed,
            sentence: reason,
            figures: Vec::new(),
        }
    }

    /// Whether some figure is shown to be slower by more than this fraction.
    pub fn is_slower_by(&self, fraction: f64) -> bool {
        self.figures.iter().any(|figure| figure.certain[0] > 1.0 + fraction.max(0.0))
    }
}

/// Headings of [`rows`].
pub const TIMING_HEADS: [&str; 5] = ["Time of", "this program", "the other", "ratio − 1", "shown"];

/// A row for each figure: its name, the medians of both programs, the change of the ratio with its 90 % interval, and what that shows.
pub fn rows(timing: &CaseTiming) -> Vec<[String; 5]> {
    let row = |figure: &TimedFigure| {
        let [now, other] = figure.seconds.map(duration);
        let shown = match figure.verdict() {
            TimingVerdict::AsFast => format!("as fast within {}", percent(figure.within())),
            verdict => verdict.name().to_owned(),
        };
        [figure.name.clone(), now, other, change(&figure.ratio), shown]
    };
    timing.figures.iter().map(row).collect()
}

/// What the ratios mean. `false_alarm` is that of the run.
pub fn explanation(timing: &CaseTiming, false_alarm: f64) -> String {
    format!(
        "Times against {} are compared by the ratios of interleaved renderings, with 90 % intervals. If no case became slower or faster, a \
         run says so of one with a probability of at most {}.",
        timing.against.display(),
        round_percent(false_alarm)
    )
}

/// `+12 % (90 %: +10 to +14)`, with spaces for terminals.
fn change(ratio: &Interval) -> String {
    with_plain_spaces(&increase(ratio).prose())
}

/// The median of times; `None` of none.
pub(super) fn median(times: &mut [f64]) -> Option<f64> {
    times.sort_unstable_by(f64::total_cmp);
    nearest_rank(times, 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers around 0 with a standard deviation of 1, from a fixed sequence.
    fn noise(seed: u32) -> impl Iterator<Item = f64> {
        let mut state = u64::from(seed) + 1;
        let mut uniform = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        std::iter::from_fn(move || Some((0..12).map(|_| uniform()).sum::<f64>() - 6.0))
    }

    /// Pairs whose first time is longer by `factor`, with 2 % of noise.
    fn pairs(factor: f64, count: usize, seed: u32) -> Vec<[f64; 2]> {
        let mut noise = noise(seed);
        let mut time = |mean: f64| mean * (0.02 * noise.next().unwrap_or(0.0)).exp();
        (0..count).map(|_| [time(factor), time(1.0)]).collect()
    }

    #[test]
    fn a_slower_program_is_found_and_no_other() {
        let judged = |factor, seed| {
            TimedFigure::of_pairs("tracing", &pairs(factor, 10, seed), 0.01).map(|figure| figure.verdict())
        };
        let count = |factor, verdict| (0..400).filter(|seed| judged(factor, *seed) == Some(verdict)).count();
        // 1 % of 400 is 4, and the systematic part makes it less.
        assert!(count(1.0, TimingVerdict::AsFast) >= 394);
        assert!(count(1.1, TimingVerdict::Slower) >= 390);
        assert!(count(1.0 / 1.1, TimingVerdict::Faster) >= 390);
    }

    #[test]
    fn a_common_drift_is_no_difference() {
        let drifting: Vec<[f64; 2]> =
            pairs(1.0, 10, 3).iter().zip(1..).map(|(pair, i)| pair.map(|time| time * f64::from(i))).collect();
        let figure = TimedFigure::of_pairs("rendering", &drifting, 0.01).expect("a figure");
        assert_eq!(figure.verdict(), TimingVerdict::AsFast);
        assert!(figure.within() < 0.1, "{figure:?}");
    }

    #[test]
    fn times_without_noise_are_not_judged_too_finely() {
        let figure = |ratio: f64| TimedFigure::of_pairs("x", &[[ratio, 1.0]; 5], 0.01).expect("a figure");
        assert_eq!(figure(1.002).verdict(), TimingVerdict::AsFast);
        assert!(!figure(1.002).is_open());
        assert_eq!(figure(1.02).verdict(), TimingVerdict::Slower);
        for wrong in [vec![[1.0, 1.0]], vec![[1.0, 0.0]; 3], vec![[f64::NAN, 1.0]; 3], vec![]] {
            assert_eq!(TimedFigure::of_pairs("x", &wrong, 0.01), None, "{wrong:?}");
        }
    }

    #[test]
    fn sentences_and_limits_follow_from_the_figures() {
        let figure = |name: &str, ratio: f64| {
            TimedFigure::of_pairs(name, &[[ratio, 1.0], [ratio * 1.001, 1.0]], 0.1).expect("a figure")
        };
        let timing = |figures| CaseTiming::of_figures(["other", ""], 2, figures, &[]);
        let mixed = timing(vec![figure("tracing", 1.2), figure("rendering", 0.8), figure("process", 1.0)]);
        assert_eq!(mixed.verdict, TimingVerdict::Slower);
        assert!(mixed.sentence.starts_with("slower: tracing +20"), "{}", mixed.sentence);
        assert!(mixed.sentence.contains("; faster: rendering −20"), "{}", mixed.sentence);
        assert!(mixed.is_slower_by(0.1) && !mixed.is_slower_by(0.3));
        let equal = timing(vec![figure("process", 1.0)]);
        assert_eq!(equal.verdict, TimingVerdict::AsFast);
        assert!(equal.sentence.starts_with("as fast: process within"), "{}", equal.sentence);
        assert!(!equal.is_slower_by(0.0));
        assert_eq!(timing(Vec::new()).verdict, TimingVerdict::Untimed);
        assert_eq!(rows(&mixed).len(), 3);
        assert_eq!(rows(&mixed)[0][4], "slower");
        assert!(explanation(&mixed, 0.01).contains("against other are"));
    }
}
