//! Prices as they are measured: a line on standard output for each.

use std::cell::{Cell, RefCell};
use std::path::Path;

use crate::cmd::explain::{COLUMNS, wrapped};
use crate::render::effect_plan::{Cost, EffectSide, PlannedEffect};
use crate::render::figures::print;
use crate::render::process;
use crate::render::progress::Steps;

/// The list that grows by a line with every price, above a progress bar.
pub struct PriceList {
    steps: Steps,
    /// Nothing is printed, or nobody reads any more.
    silent: Cell<bool>,
    /// The prices do not go into a file, so that nobody wants them when nobody reads.
    only_printed: bool,
    unread: Cell<bool>,
    /// Effects of this side that have no price.
    free: RefCell<Vec<&'static str>>,
}

impl PriceList {
    /// A list of so many measurements, whose figures go to `json` as well; it is not printed if that is standard output.
    pub fn new(steps: usize, json: Option<&Path>) -> Self {
        Self {
            steps: Steps::new(steps as u64),
            silent: Cell::new(json == Some(Path::new("-"))),
            only_printed: json.is_none(),
            unread: Cell::default(),
            free: RefCell::default(),
        }
    }

    /// Prints the title of the prices of one side.
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

    /// Names what is measured now.
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

    /// Prints which effects have no price, and `why`.
    pub fn without_price(&self, why: &str) {
        let free = self.free.take();
        if !free.is_empty() && !self.is_over() {
            self.print(&wrapped("  no price       ", &format!(" {}: {why}", free.join(", ")), COLUMNS));
        }
    }

    /// Prints these words while the bar is away.
    pub fn print(&self, words: &str) {
        if !self.silent.get() && !self.steps.suspend(|| print(words, "the prices")) {
            self.silent.set(true);
            self.unread.set(self.only_printed);
        }
    }

    /// Whether the rest is not wanted any more.
    pub fn is_over(&self) -> bool {
        self.unread.get() || process::is_interrupted()
    }
}

fn words(cost: &Cost) -> String {
    // Nothing is not less than nothing.
    let share = cost.share.map(|s| format!("{:5.1} %", (1e3 * s).round() * 0.1 + 0.0));
    let ms = cost.milliseconds.map(|ms| format!("{ms:.2} ms"));
    let bytes = cost.bytes.filter(|b| *b > 0).map(|b| format!("{:.1} MB", b as f64 * 1e-6));
    let if_on = cost.if_on.map(|ms| format!("would take {ms:.2} ms"));
    let once = cost.once.map(|ms| format!("and {ms:.0} ms once per view"));
    let if_on_share = cost.if_on_share.map(|s| format!("with it ×{:.2}", 1.0 + s));
    [share, ms, bytes, if_on, once, if_on_share].into_iter().flatten().collect::<Vec<_>>().join("  ")
}
