//! Number formatting: as many digits as the interval supports, units, a real minus sign.
//!
//! The space before a unit is narrow and does not break ([`THIN`]). Terminals and the window get ordinary spaces by
//! [`with_plain_spaces`], which [`percent`], [`round_percent`], [`duration`] and [`remaining`] apply.

use std::fmt;

use crate::study::Interval;
use crate::study::monitor::{ErrorQuantile, ErrorStatus};

/// Narrow no-break space.
pub const THIN: char = '\u{202f}';

/// A formatted number and its 90 % interval.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FormattedInterval {
    /// The number with its unit: `42 s`.
    pub main: String,
    /// `36–55`, in the same unit; `None` for a number that is exact or missing.
    pub range: Option<String>,
}

impl FormattedInterval {
    /// Stands for a missing number.
    pub fn none() -> Self {
        Self { main: "—".into(), range: None }
    }

    /// `42 s (90 %: 36–55)`.
    pub fn prose(&self) -> String {
        match &self.range {
            Some(range) => format!("{} (90{THIN}%: {range})", self.main),
            None => self.main.clone(),
        }
    }
}

impl fmt::Display for FormattedInterval {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.range {
            Some(range) => write!(f, "{} ({range})", self.main),
            None => f.write_str(&self.main),
        }
    }
}

/// The same text with ordinary spaces, for terminals and the window.
pub fn with_plain_spaces(text: &str) -> String {
    text.replace([THIN, '\u{a0}'], " ")
}

/// A share in per cent for a terminal: `0.98 %`.
pub fn percent(share: f64) -> String {
    with_plain_spaces(&percent_of(share))
}

/// A chosen share in per cent for a terminal: `1 %`, `0.5 %`.
pub fn round_percent(share: f64) -> String {
    with_plain_spaces(&goal(share))
}

/// A time for a terminal: `8.3 s`, `42 s`, `12 min`, `3.4 h`, `5.0 days`.
pub fn duration(seconds: f64) -> String {
    with_plain_spaces(&seconds_of(seconds))
}

/// The time from `now` to a predicted one, for a terminal: `42 s (90 %: 36–55 s)`.
pub fn remaining(now: f64, seconds: Interval) -> String {
    let left = seconds.map(|s| (s - now).max(0.0));
    let [value, low, high] = [left.value, left.low, left.high].map(duration);
    // A unit common to both bounds is written once.
    let unit = |text: &str| text.split_once(' ').map(|(_, unit)| unit.to_string());
    let short = if unit(&low) == unit(&high) { low.split(' ').next().unwrap_or(&low) } else { &low };
    format!("{value} (90 %: {short}–{high})")
}

impl ErrorStatus {
    /// `error 2.31 %, 1 % in about 42 s (90 %: 36–55 s)`, as far as it is known.
    pub fn sentence(&self, at: ErrorQuantile) -> String {
        let Some(last) = self.checkpoints.last() else { return "error not known yet".to_string() };
        let error = percent(self.estimate.relative[at.index()].value);
        match self.prediction {
            _ if self.late.warning().is_some() => {
                format!("error {error} or more, light is still being found")
            }
            Some(prediction) => {
                let time = remaining(last.seconds, prediction.seconds);
                format!("error {error}, {} in about {time}", round_percent(prediction.target))
            }
            None => format!("error {error}"),
        }
    }
}

/// `x` with so many significant digits.
pub fn significant(x: f64, digits: usize) -> String {
    if !x.is_finite() || x == 0.0 {
        return at(x, 0);
    }
    match exponent(x, digits) {
        power if (-4..7).contains(&power) => at(x, power - digits as i32 + 1),
        power => format!("{}·10{}", at(x / 10f64.powi(power), 1 - digits as i32), raised(power)),
    }
}

/// An interval converted to a unit `scale` times smaller than its own; `unit` is appended verbatim.
pub fn with_unit(i: &Interval, scale: f64, unit: &str) -> FormattedInterval {
    let Some(i) = i.map(|x| x * scale).cleaned() else { return FormattedInterval::none() };
    let digits = digits(&i);
    let power = exponent(i.value, digits);
    let (main, range) = if i.value == 0.0 || (-4..7).contains(&power) {
        let place = if i.value == 0.0 { zero_place(&i) } else { power - digits as i32 + 1 };
        (format!("{}{unit}", at(i.value, place)), span(&i, place))
    } else {
        let small = i.map(|x| x / 10f64.powi(power));
        let (place, ten) = (1 - digits as i32, format!("·10{}", raised(power)));
        (format!("{}{ten}{unit}", at(small.value, place)), format!("({}){ten}", span(&small, place)))
    };
    FormattedInterval { main, range: (i.low != i.high).then_some(range) }
}

/// A share with its interval in per cent.
pub fn percent_interval(share: &Interval) -> FormattedInterval {
    with_unit(share, 100.0, "\u{202f}%")
}

/// A share in per cent, with two or three digits.
pub fn percent_of(share: f64) -> String {
    if !share.is_finite() {
        return "—".into();
    }
    let decimals = match 100.0 * share.abs() {
        p if p >= 99.5 || p == 0.0 => 0,
        p if p >= 9.95 => 1,
        p if p >= 0.1 => 2,
        _ => 3,
    };
    format!("{}{THIN}%", at(100.0 * share, -decimals))
}

/// A chosen (not measured) fraction in per cent: `1 %`, `0.5 %`.
pub fn goal(share: f64) -> String {
    format!("{}{THIN}%", trimmed(&significant(100.0 * share, 2)))
}

/// Removes trailing zeros of decimals.
pub fn trimmed(number: &str) -> &str {
    match number.contains('.') && !number.contains('·') {
        true => number.trim_end_matches('0').trim_end_matches('.'),
        false => number,
    }
}

/// A ratio of times as an increase: `+23 % (+21 to +25)`.
pub fn increase(i: &Interval) -> FormattedInterval {
    let Some(i) = i.cleaned() else { return FormattedInterval::none() };
    let added = i.map(|x| 100.0 * (x - 1.0));
    // As many decimals as half the interval supports.
    let half = (added.high - added.low) / 2.0;
    let place = if half > 0.0 && half.is_finite() { (half.log10().floor() as i32).clamp(-2, 1) } else { -1 };
    let signed = |x: f64| {
        format!("{}{}", if at(x, place).starts_with('−') || x <= 0.0 { "" } else { "+" }, at(x, place))
    };
    let range = (i.low != i.high).then(|| format!("{} to {}", signed(added.low), signed(added.high)));
    FormattedInterval { main: format!("{}{THIN}%", signed(added.value)), range }
}

/// A ratio: `× 2.3 (1.6–3.4)`.
pub fn factor(i: &Interval) -> FormattedInterval {
    let FormattedInterval { main, range } = with_unit(i, 1.0, "");
    FormattedInterval { main: if main == "—" { main } else { format!("×{THIN}{main}") }, range }
}

/// A time, in the unit that suits it.
pub fn seconds(i: &Interval) -> FormattedInterval {
    let (factor, unit) = unit(i.value);
    with_unit(i, factor, &format!("{THIN}{unit}"))
}

/// A time without an interval.
pub fn seconds_of(x: f64) -> String {
    if !x.is_finite() {
        return "—".into();
    }
    let (factor, unit) = unit(x);
    format!("{}{THIN}{unit}", significant(x * factor, if x * factor >= 100.0 { 3 } else { 2 }))
}

/// A count: `12 345`, `1.2 M`.
pub fn count(x: f64) -> String {
    match x.abs() {
        a if (1e9..1e12).contains(&a) => format!("{}{THIN}G", significant(x * 1e-9, 2)),
        a if (1e6..1e9).contains(&a) => format!("{}{THIN}M", significant(x * 1e-6, 2)),
        a if (1e3..1e6).contains(&a) || x.fract() == 0.0 => at(x, 0),
        _ => significant(x, 2),
    }
}

fn unit(x: f64) -> (f64, &'static str) {
    match x.abs() {
        0.0 => (1.0, "s"),
        x if x < 0.1 => (1e3, "ms"),
        x if x < 119.5 => (1.0, "s"),
        x if x < 7170.0 => (1.0 / 60.0, "min"),
        x if x < 172_000.0 => (1.0 / 3600.0, "h"),
        x if x < 6e7 => (1.0 / 86_400.0, "days"),
        _ => (1.0 / 31_557_600.0, "years"),
    }
}

/// Significant digits that an interval supports: 2 where it is wide, up to 4.
fn digits(i: &Interval) -> usize {
    match (i.high - i.low) / (2.0 * i.value.abs()) {
        0.0 => 3,
        w if w < 0.01 => 4,
        w if w < 0.1 => 3,
        _ => 2,
    }
}

fn zero_place(i: &Interval) -> i32 {
    let half = (i.high - i.low) / 2.0;
    if half > 0.0 && half.is_finite() { half.log10().floor() as i32 - 1 } else { 0 }.clamp(-6, 0)
}

/// The decimal exponent of `x`, rounded to so many digits.
fn exponent(x: f64, digits: usize) -> i32 {
    if x == 0.0 || !x.is_finite() {
        return 0;
    }
    let written = format!("{:.*e}", digits.saturating_sub(1), x.abs());
    written.rsplit_once('e').and_then(|(_, power)| power.parse().ok()).unwrap_or(0)
}

fn span(i: &Interval, place: i32) -> String {
    let dash = if i.low < 0.0 { " to " } else { "–" };
    format!("{}{dash}{}", at(i.low, place), at(i.high, place))
}

/// Rounds `x` at the decimal place `10^place`; thousands are separated from 10 000 on.
fn at(x: f64, place: i32) -> String {
    if x.is_nan() {
        return "—".into();
    }
    let sign = if x < 0.0 { "−" } else { "" };
    if x.is_infinite() || x.abs() > 1e15 {
        return format!("{sign}∞");
    }
    let step = 10f64.powi(place.max(0));
    let rounded = if place > 0 { (x.abs() / step).round() * step } else { x.abs() };
    let text = format!("{:.*}", (-place).clamp(0, 12) as usize, rounded);
    let sign = if text.chars().all(|c| c == '0' || c == '.') { "" } else { sign };
    let (whole, rest) = text.split_at(text.find('.').unwrap_or(text.len()));
    let mut grouped = whole.to_string();
    for i in (1..whole.len()).filter(|i| whole.len() > 4 && (whole.len() - i) % 3 == 0).rev() {
        grouped.insert(i, THIN);
    }
    format!("{sign}{grouped}{rest}")
}

fn raised(power: i32) -> String {
    let digits = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    power.to_string().chars().map(|c| c.to_digit(10).map_or('⁻', |d| digits[d as usize])).collect()
}
