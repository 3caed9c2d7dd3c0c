//! The machine of a study.

use crate::gpu;
use crate::study::data::Machine;
use crate::tracer::accel::SimdKernel;

/// The processor's name, as far as the system tells.
pub fn cpu() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    let name = name.map_or(std::env::consts::ARCH, |(_, name)| name.trim());
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!("{name}, {cores} cores")
}

/// Everything that a figure depends on besides the scene.
pub fn machine(device: &str, (threads, kernel): (usize, SimdKernel)) -> Machine {
    let driver =
        gpu::devices().ok().and_then(|all| all.into_iter().find(|d| d.name == device).map(|d| d.driver));
    Machine {
        cpu: format!("{}, {}", cpu(), kernel.name()),
        threads,
        device: device.to_string(),
        driver: driver.unwrap_or_default(),
        program: format!("pointillist {}", env!("CARGO_PKG_VERSION")),
        date: today(),
    }
}

/// Today as `2026-11-21`, by the civil calendar (H. Hinnant, *chrono-compatible low-level date algorithms*), UTC.
fn today() -> String {
    let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
    date(since.as_secs() / 86_400)
}

fn date(days: u64) -> String {
    // Days since 1 March 0000, in eras of 400 years.
    let days = days + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day + 2) / 153;
    let (of_month, month) = (day - (153 * month + 2) / 5 + 1, if month < 10 { month + 3 } else { month - 9 });
    let year = era * 400 + year + u64::from(month <= 2);
    format!("{year:04}-{month:02}-{of_month:02}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_become_dates() {
        assert_eq!(
            [0, 59, 11_016, 20_778].map(date),
            ["1970-01-01", "1970-03-01", "2000-02-29", "2026-11-21"]
        );
    }
}
