//! Converts timestamps of the device to the host's monotonic clock; the methods are described in [`timing`](super).

use std::ffi::CStr;
use std::time::{Duration, Instant};

use ash::{ext, khr, vk};

/// Age at which a calibration is renewed: at 10 ppm the clocks drift apart by 1 µs in that time.
const EVERY: Duration = Duration::from_millis(100);

/// Readings per calibration, of which the most precise one is used.
const TRIES: usize = 4;

/// Largest assumed relative drift between the clocks, used where frames bound the offset.
const DRIFT: f64 = 1e-4;

/// Extension function that reads the device's clock.
pub(super) enum CalibrationReader {
    Khr(khr::calibrated_timestamps::Device),
    Ext(ext::calibrated_timestamps::Device),
}

/// The same moment on both clocks.
#[derive(Clone, Copy, Debug)]
struct Calibration {
    ticks: u64,
    host: Instant,
    /// Largest error of `host`, nanoseconds.
    error: f64,
}

/// Converts timestamps to moments on the host's clock.
pub(in crate::gpu) struct DeviceClock {
    reader: Option<CalibrationReader>,
    /// Nanoseconds per tick.
    period: f64,
    /// Valid bits of a timestamp.
    pub bits: u32,
    now: Option<Calibration>,
    /// Largest error so far, and largest correction at a recalibration, nanoseconds.
    pub worst: f64,
    pub correction: f64,
}

/// The extension of this device for reading the clock of timestamps, if available.
pub(in crate::gpu) fn extension(
    entry: &ash::Entry,
    instance: &ash::Instance,
    device: vk::PhysicalDevice,
    offered: &[vk::ExtensionProperties],
) -> Option<&'static CStr> {
    let has = |name: &CStr| offered.iter().any(|e| e.extension_name_as_c_str() == Ok(name));
    // Both are equivalent; older validation layers know only VK_EXT_calibrated_timestamps and warn about the other.
    // SAFETY: plain queries through an extension that the device has.
    let (name, domains) = unsafe {
        if has(ext::calibrated_timestamps::NAME) {
            let loader = ext::calibrated_timestamps::Instance::new(entry, instance);
            let domains = loader.get_physical_device_calibrateable_time_domains(device);
            (ext::calibrated_timestamps::NAME, domains)
        } else if has(khr::calibrated_timestamps::NAME) {
            let loader = khr::calibrated_timestamps::Instance::new(entry, instance);
            let domains = loader.get_physical_device_calibrateable_time_domains(device);
            (khr::calibrated_timestamps::NAME, domains)
        } else {
            return None;
        }
    };
    domains.is_ok_and(|d| d.contains(&vk::TimeDomainKHR::DEVICE)).then_some(name)
}

impl DeviceClock {
    /// The clock of an open device with timestamps of `bits` valid bits and `period` nanoseconds per tick; `None` where
    /// there are no timestamps. `calibrated` is the [`extension`] that was enabled.
    pub fn new(
        instance: &ash::Instance,
        device: &ash::Device,
        calibrated: Option<&CStr>,
        bits: u32,
        period: f32,
    ) -> Option<Self> {
        let reader = calibrated.map(|name| {
            if name == khr::calibrated_timestamps::NAME {
                CalibrationReader::Khr(khr::calibrated_timestamps::Device::new(instance, device))
            } else {
                CalibrationReader::Ext(ext::calibrated_timestamps::Device::new(instance, device))
            }
        });
        (bits > 0 && period > 0.0).then(|| Self::with(reader, f64::from(period), bits))
    }

    pub(super) fn with(reader: Option<CalibrationReader>, period: f64, bits: u32) -> Self {
        Self { reader, period, bits, now: None, worst: 0.0, correction: 0.0 }
    }

    /// Whether the device's clock can be read.
    pub fn is_calibrated(&self) -> bool {
        self.reader.is_some()
    }

    /// Recalibrates if the last reading is too old.
    pub fn calibrate(&mut self) {
        let Some(reader) = &self.reader else { return };
        let age = self.now.map(|c| c.host.elapsed());
        if age.is_some_and(|age| age < EVERY) {
            return;
        }
        let tries = (0..TRIES).filter_map(|_| read(reader));
        let best = tries.min_by(|a, b| a.error.total_cmp(&b.error));
        // A disturbed reading is worse than a good one that has drifted for a second.
        let fine = |c: &Calibration| {
            age.is_none_or(|a| a > Duration::from_secs(1)) || c.error < 2.0 * self.worst.max(5e3)
        };
        match best {
            Some(next) if fine(&next) => self.adopt(next),
            Some(_) => {}
            None => self.reader = None, // the call failed: frames bound the offset from now on
        }
    }

    fn adopt(&mut self, next: Calibration) {
        if self.now.is_some() {
            let jump = self.distance(self.host(next.ticks), next.host);
            self.correction = self.correction.max(jump.abs());
        }
        self.worst = self.worst.max(next.error);
        self.now = Some(next);
    }

    /// If the clock cannot be read, a frame narrows the bounds of the offset: its first timestamp is later than `submitted`, its last one
    /// earlier than `seen`.
    pub fn align(&mut self, first: u64, last: u64, submitted: Instant, seen: Instant) {
        if self.reader.is_some() {
            return;
        }
        // Bounds on the host time of `first`.
        let length = self.elapsed(first, last);
        let latest = seen.checked_sub(Duration::from_nanos(length as u64)).unwrap_or(seen);
        let (mut low, mut high) = (0.0, self.distance(submitted, latest).max(0.0));
        if let Some(known) = self.now {
            let middle = self.distance(submitted, self.host(first));
            let slack = known.error + DRIFT * self.ticks_between(known.ticks, first).abs();
            // If the clocks drift faster than assumed, only this frame's bounds are used.
            if middle - slack <= high && middle + slack >= low {
                (low, high) = (low.max(middle - slack), high.min(middle + slack));
            }
        }
        let (middle, error) = (0.5 * (low + high), 0.5 * (high - low));
        let host = submitted + Duration::from_nanos(middle.max(0.0) as u64);
        self.now = Some(Calibration { ticks: first, host, error });
        self.worst = self.worst.max(error);
    }

    /// Largest error of the present calibration, nanoseconds.
    pub fn error(&self) -> f64 {
        self.now.map_or(f64::INFINITY, |c| c.error)
    }

    /// Host time of a timestamp; the present time before the first calibration.
    pub fn host(&self, ticks: u64) -> Instant {
        let Some(known) = self.now else { return Instant::now() };
        let ns = self.ticks_between(known.ticks, ticks);
        let away = Duration::from_nanos(ns.abs() as u64);
        let moved = if ns < 0.0 { known.host.checked_sub(away) } else { known.host.checked_add(away) };
        moved.unwrap_or(known.host)
    }

    /// Signed nanoseconds between two timestamps; the counter may have wrapped around in between.
    fn ticks_between(&self, from: u64, to: u64) -> f64 {
        let unused = self.unused_bits();
        let ticks = (to.wrapping_sub(from) << unused) as i64 >> unused;
        ticks as f64 * self.period
    }

    /// Nanoseconds from one timestamp to a later one: the counter may have wrapped around once between them.
    pub fn elapsed(&self, from: u64, to: u64) -> f64 {
        let unused = self.unused_bits();
        let ticks = to.wrapping_sub(from) << unused >> unused;
        ticks as f64 * self.period
    }

    /// Number of invalid high bits of a timestamp.
    fn unused_bits(&self) -> u32 {
        64 - self.bits.clamp(1, 64)
    }

    /// Nanoseconds from `a` to `b`.
    fn distance(&self, a: Instant, b: Instant) -> f64 {
        b.saturating_duration_since(a).as_nanos() as f64 - a.saturating_duration_since(b).as_nanos() as f64
    }
}

/// Reads the device's clock between two readings of the host's.
fn read(reader: &CalibrationReader) -> Option<Calibration> {
    let domain = [vk::CalibratedTimestampInfoKHR::default().time_domain(vk::TimeDomainKHR::DEVICE)];
    let before = Instant::now();
    // SAFETY: the extension is enabled and the domain offered, as `extension` has checked.
    let read = unsafe {
        match reader {
            CalibrationReader::Khr(loader) => loader.get_calibrated_timestamps(&domain),
            CalibrationReader::Ext(loader) => loader.get_calibrated_timestamps(&domain),
        }
    };
    let half = before.elapsed() / 2;
    let ticks = *read.ok()?.0.first()?;
    Some(Calibration { ticks, host: before + half, error: half.as_nanos() as f64 })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A 36-bit counter that wraps around between two timestamps still yields their distance.
    #[test]
    fn counters_wrap() {
        let clock = DeviceClock::with(None, 2.0, 36);
        assert_eq!(clock.ticks_between((1 << 36) - 10, 5), 30.0);
        assert_eq!(clock.ticks_between(5, (1 << 36) - 10), -30.0);
        assert_eq!(DeviceClock::with(None, 1.0, 64).ticks_between(u64::MAX, 4), 5.0);
        assert_eq!(clock.elapsed((1 << 36) - 10, 5), 30.0);
        assert_eq!(clock.elapsed(5, (1 << 36) - 10), 2.0 * ((1_u64 << 36) - 15) as f64);
        assert_eq!(DeviceClock::with(None, 1.0, 64).elapsed(u64::MAX, 4), 5.0);
        // Bits above the valid ones are ignored.
        assert_eq!(clock.elapsed(7 << 36 | 100, 3 << 40 | 110), 20.0);
    }

    /// Without a readable clock, frames bound the offset, tighter with every frame, and the true value stays within the bounds.
    #[test]
    fn frames_bound_the_offset() {
        let mut clock = DeviceClock::with(None, 1.0, 64);
        let start = Instant::now() + Duration::from_secs(5);
        let at = |ns: u64| start + Duration::from_nanos(ns);
        let device = |ns: u64| 777_000 + ns; // the device's clock at a moment of the host's
        for (i, (queued, late)) in [(500, 9_000), (3_000, 400), (100, 700)].into_iter().enumerate() {
            let t = 1_000_000 * i as u64;
            let (first, last) = (device(t + queued), device(t + queued + 20_000));
            clock.align(first, last, at(t), at(t + queued + 20_000 + late));
            let off = clock.distance(clock.host(first), at(t + queued)).abs();
            assert!(off <= clock.error() + 2.0, "off by {off} ns, bound {}", clock.error());
        }
        assert!(clock.error() <= 900.0, "{} ns after three frames", clock.error());
    }
}
