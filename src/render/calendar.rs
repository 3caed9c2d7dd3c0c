//! Dates of reports, in UTC.

use std::time::{SystemTime, UNIX_EPOCH};

/// Today as `2026-11-21`.
pub fn today() -> String {
    date(seconds() / 86_400)
}

/// Now as `2026-11-21T08:15:00Z` (RFC 3339).
pub fn now() -> String {
    let now = seconds();
    let (day, second) = (now / 86_400, now % 86_400);
    format!("{}T{:02}:{:02}:{:02}Z", date(day), second / 3600, second / 60 % 60, second % 60)
}

/// Seconds since 1970.
fn seconds() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs()
}

/// The day that is so many days after 1 January 1970, by the civil calendar (H. Hinnant, *chrono-compatible low-level date algorithms*).
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
