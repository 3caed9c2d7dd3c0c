//! Progress bars: share done, rate, remaining time.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::render::figures::human;
use crate::study::{ErrorQuantile, ErrorStatus};

/// Goal of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    Paths(u64),
    Time(Duration),
    /// An error target, whose duration is unknown.
    Error,
}

/// Progress of consecutive measurements. Draws on standard error, if that is a terminal.
pub struct Steps {
    bar: ProgressBar,
}

impl Steps {
    /// Begins with none of `count` measurements done.
    pub fn new(count: u64) -> Self {
        let bar = ProgressBar::with_draw_target(Some(count), ProgressDrawTarget::stderr_with_hz(8));
        let style =
            ProgressStyle::with_template("{bar:24} {pos} of {len}  {msg}  {elapsed} gone, {eta} left");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar.enable_steady_tick(Duration::from_millis(250));
        Self { bar }
    }

    /// Names the measurement that begins.
    pub fn begin(&self, what: impl Into<String>) {
        self.bar.set_message(what.into());
    }

    /// A measurement is done.
    pub fn done(&self) {
        self.bar.inc(1);
    }

    /// Runs `print` with the bar hidden.
    pub fn suspend<R>(&self, print: impl FnOnce() -> R) -> R {
        self.bar.suspend(print)
    }
}

impl Drop for Steps {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// Draws on standard error; draws nothing when asked to be quiet or where there is no terminal.
pub struct Progress {
    bar: ProgressBar,
    goal: Goal,
}

impl Progress {
    /// Starts at zero.
    pub fn new(goal: Goal, quiet: bool) -> Self {
        let length = match goal {
            Goal::Paths(n) => n,
            Goal::Time(t) => u64::try_from(t.as_millis()).unwrap_or(u64::MAX),
            Goal::Error => 1000,
        };
        let target = if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr_with_hz(8) };
        let bar = ProgressBar::with_draw_target(Some(length), target);
        let left = if goal == Goal::Error { "" } else { ", {eta} left" };
        let style = ProgressStyle::with_template(&format!(
            "{{bar:24}} {{percent:>3}} %  {{msg}}  {{elapsed}} gone{left}"
        ));
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self { bar, goal }
    }

    /// Updates the bar; `error`: the error so far, if known.
    pub fn update(
        &self,
        paths: u64,
        pixels: f64,
        elapsed: Duration,
        error: Option<(&ErrorStatus, ErrorQuantile)>,
    ) {
        let seconds = elapsed.as_secs_f64().max(1e-9);
        let predicted =
            error.and_then(|(state, _)| state.prediction).map_or(f64::INFINITY, |said| said.seconds.value);
        self.bar.set_position(match self.goal {
            Goal::Paths(_) => paths,
            Goal::Time(_) => elapsed.as_millis() as u64,
            Goal::Error => (999.0 * seconds / predicted.max(seconds)) as u64,
        });
        let spp = paths as f64 / pixels;
        let known = error.map(|(state, at)| format!("  {}", state.sentence(at))).unwrap_or_default();
        self.bar.set_message(format!("{spp:.1} spp  {} paths/s{known}", human(paths as f64 / seconds)));
    }

    /// Share of the work that is done, 0 to 1.
    pub fn share(&self) -> f64 {
        let length = self.bar.length().unwrap_or(0).max(1);
        (self.bar.position() as f64 / length as f64).min(1.0)
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
