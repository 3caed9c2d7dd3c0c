//! Prints prices as they are measured, one line each.

use std::cell::{Cell, RefCell};
use std::path::Path;

use crate::cmd::explain::{COLUMNS, wrapped};
use crate::render::effect_plan::{Cost, EffectSide, PlannedEffect};
use crate::render::figures::print;
use crate::render::process;
use crate::render::progress::Steps;

/// List of prices that grows during the measurement, above a progress bar.
pub struct PriceList {
    steps: Steps,
    /// Printing is off, or the reader has closed the pipe.
    silent: Cell<bool>,
    /// Prices are only printed, so that measuring can end when the pipe is closed.
    only_printed: bool,
    unread: Cell<bool>,
    /// Effects of the present side without a price.
    free: RefCell<Vec<&'static str>>,
}

impl PriceList {
    /// A list of `steps` measurements, also written to `json`; not printed if that is standard output.
    pub fn new(steps: usize, json: Option<&Path>) -> Self {
        Self {
            steps: Steps::new(steps as u64),
            silent: Cell::new(json == Some(Path::new("-"))),
            only_printed: json.is_none(),
            unread: Cell::default(),
            free: RefCell::default(),
        }
    }

    /// Prints the heading of one side's prices.
    pub fn title(&self, side: EffectSide) {
        self.print(match side {
            EffectSide::Tracer => {
                "PRICES: TRACER    share of a path's time; × is its time with a small example\n"
            }
            EffectSide::Client => {
                "PRICES: CLIENT    share of device time, per frame, device memory of its own\n"
            }
        });
    }

    /// Names the measurement in progress.
    pub fn begin(&self, what: impl Into<String>) {
        self.steps.begin(what);
    }

    /// A measurement has ended.
    pub fn done(&self) {
        self.steps.done();
    }

    /// Prints the price of an effect, or notes that it has none.
    pub fn priced(&self, entry: &PlannedEffect) {
        let words = words(&entry.cost);
        if words.is_empty() {
            self.free.borrow_mut().push(entry.name);
        } else {
            let on = if entry.on { "yes" } else { "–" };
            self.print(&format!("  {:<16}{on:<5}{words}\n", entry.name));
        }
    }

    /// Prints the effects without a price, and `why`.
    pub fn without_price(&self, why: &str) {
        let free = self.free.take();
        if !free.is_empty() && !self.is_over() {
            self.print(&wrapped("  no price       ", &format!(" {}: {why}", free.join(", ")), COLUMNS));
        }
    }

    /// Prints text with the progress bar hidden.
    pub fn print(&self, words: &str) {
        if !self.silent.get() && !self.steps.suspend(|| print(words, "the prices")) {
            self.silent.set(true);
            self.unread.set(self.only_printed);
        }
    }

    /// Whether the remaining measurements are no longer wanted.
    pub fn is_over(&self) -> bool {
        self.unread.get() || process::is_interrupted()
    }
}

fn words(cost: &Cost) -> String {
    // Adding 0.0 turns −0 into 0.
    let share = cost.share.map(|s| format!("{:5.1} %", (1e3 * s).round() * 0.1 + 0.0));
    let ms = cost.milliseconds.map(|ms| format!("{ms:.2} ms"));
    let bytes = cost.bytes.filter(|b| *b > 0).map(|b| format!("{:.1} MB", b as f64 * 1e-6));
    let if_on = cost.if_on.map(|ms| format!("would take {ms:.2} ms"));
    let once = cost.once.map(|ms| format!("and {ms:.0} ms once per view"));
    let if_on_share = cost.if_on_share.map(|s| format!("with it ×{:.2}", 1.0 + s));
    [share, ms, bytes, if_on, once, if_on_share].into_iter().flatten().collect::<Vec<_>>().join("  ")
}
