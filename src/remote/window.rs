//! How many bytes of samples may be on their way: enough that the link never waits for credit, and no more, since samples that are on their
//! way when the scene is edited are in the way of the new ones.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Bytes before the first measurement.
const FIRST: f64 = 8192.0;

/// Fewest and most bytes.
const BOUNDS: [f64; 2] = [512.0, 16e6];

/// Time between two measurements, and how many of them are looked at.
const INTERVAL: Duration = Duration::from_millis(50);
const RECENT: usize = 20;

/// Shortest delay that is reckoned with: threads on both sides must have had their turn.
const DELAY: Duration = Duration::from_millis(20);

/// The credit of a connection.
///
/// Twice the product of the rate at which bytes come and of the delay may be on its way, so that the rate may double between two
/// measurements where the link allows it.
pub(super) struct CreditWindow {
    bytes: f64,
    /// Bytes that were granted and have not come.
    outstanding: f64,
    /// The time from which pings are counted, in microseconds.
    pub begin: Instant,
    measured: Instant,
    counted: u64,
    /// Bytes per second.
    rates: VecDeque<f64>,
    /// Shortest time from a ping to its answer.
    delay: Option<Duration>,
}

impl Default for CreditWindow {
    fn default() -> Self {
        let now = Instant::now();
        Self {
            bytes: FIRST,
            outstanding: 0.0,
            begin: now,
            measured: now,
            counted: 0,
            rates: VecDeque::with_capacity(RECENT),
            delay: None,
        }
    }
}

impl CreditWindow {
    /// A ping with this number was answered.
    pub fn answered(&mut self, stamp: u64) {
        let delay = self.begin.elapsed().saturating_sub(Duration::from_micros(stamp));
        self.delay = Some(self.delay.map_or(delay, |least| least.min(delay)));
    }

    /// So many bytes of samples came.
    pub fn took(&mut self, bytes: usize) {
        self.outstanding -= bytes as f64;
    }

    /// Credit to be granted now: 0 while it is less than a quarter of the window, so that not every frame is answered.
    pub fn grant(&mut self) -> u32 {
        let grant = self.bytes - self.outstanding;
        if grant < 0.25 * self.bytes {
            return 0;
        }
        self.outstanding += grant.floor();
        grant as u32
    }

    /// Adapts the window to `bytes`, the count of all that came; returns the rate in bytes per second, now and then.
    pub fn measure(&mut self, bytes: u64) -> Option<f64> {
        let time = self.measured.elapsed();
        if time < INTERVAL {
            return None;
        }
        let rate = (bytes - self.counted) as f64 / time.as_secs_f64();
        (self.measured, self.counted) = (Instant::now(), bytes);
        if self.rates.len() == RECENT {
            self.rates.pop_front();
        }
        self.rates.push_back(rate);
        // The largest: pauses of the tracer or of this side say nothing of the link.
        let best = self.rates.iter().copied().fold(0.0, f64::max);
        let delay = self.delay.unwrap_or_default().clamp(DELAY, Duration::from_secs(1));
        self.bytes = (2.0 * best * delay.as_secs_f64()).clamp(BOUNDS[0], BOUNDS[1]);
        Some(self.rates.iter().sum::<f64>() / self.rates.len() as f64)
    }
}
