//! Figures as people read them: as many digits as the interval bears out, units, a real minus.
//!
//! The space before a unit is narrow and does not break (U+202F); `terminal` makes it an ordinary one.

use std::fmt;

use crate::study::Interval;

/// Narrow no-break space.
pub const THIN: char = '\u{202f}';

/// A figure and its 90 % interval, in words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Figure {
    /// The figure with its unit: `42 s`.
    pub main: String,
    /// `36–55`, in the same unit; `None` if it is known exactly or nothing is known.
    pub range: Option<String>,
}

impl Figure {
    /// What stands for a figure that is not there.
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

impl fmt::Display for Figure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.range {
            Some(range) => write!(f, "{} ({range})", self.main),
            None => f.write_str(&self.main),
        }
    }
}

/// An interval that can be shown: a finite value, bounds in order around it. `None` if there is no value.
pub fn clean(i: &Interval) -> Option<Interval> {
    let bound = |x: f64| if x.is_nan() { i.value } else { x };
    let (a, b) = (bound(i.low), bound(i.high));
    let ordered = Interval { value: i.value, low: a.min(b).min(i.value), high: a.max(b).max(i.value) };
    i.value.is_finite().then_some(ordered)
}

/// The root of a mean square with its interval; a negative one, which is noise, is 0.
pub fn root(i: &Interval) -> Option<Interval> {
    clean(i).map(|i| i.map(|x| x.max(0.0).sqrt()))
}

/// `x` with so many significant digits.
pub fn plain(x: f64, digits: usize) -> String {
    if !x.is_finite() || x == 0.0 {
        return at(x, 0);
    }
    let power = exponent(x, digits);
    let place = power - digits as i32 + 1;
    if (-4..7).contains(&power) {
        return at(x, place);
    }
    format!("{}·10{}", at(x / 10f64.powi(power), 1 - digits as i32), raised(power))
}

/// A figure in a unit that is `factor` times smaller than that of `i`; the unit is written as it is given.
pub fn figure(i: &Interval, factor: f64, unit: &str) -> Figure {
    let Some(i) = clean(&i.map(|x| x * factor)) else { return Figure::none() };
    let digits = digits(&i);
    let power = exponent(i.value, digits);
    let known = i.low == i.high;
    if i.value == 0.0 || (-4..7).contains(&power) {
        let place = if i.value == 0.0 { zero_place(&i) } else { power - digits as i32 + 1 };
        let range = (!known).then(|| span(&i, place));
        return Figure { main: format!("{}{unit}", at(i.value, place)), range };
    }
    let small = i.map(|x| x / 10f64.powi(power));
    let (place, scale) = (1 - digits as i32, format!("·10{}", raised(power)));
    let range = (!known).then(|| format!("({}){scale}", span(&small, place)));
    Figure { main: format!("{}{scale}{unit}", at(small.value, place)), range }
}

/// A share as per cent.
pub fn percent(i: &Interval) -> Figure {
    figure(i, 100.0, "\u{202f}%")
}

/// A share as per cent, without an interval.
pub fn percent_of(x: f64) -> String {
    if !x.is_finite() {
        return "—".into();
    }
    format!("{}{THIN}%", plain(100.0 * x, 2))
}

/// A share that was chosen, not measured, as per cent: `1 %`, `0.5 %`.
pub fn goal(x: f64) -> String {
    let text = plain(100.0 * x, 2);
    let short = match text.split_once('.') {
        Some((whole, rest)) if rest.chars().all(|c| c.is_ascii_digit()) => {
            format!("{whole}.{rest}").trim_end_matches('0').trim_end_matches('.').to_string()
        }
        _ => text,
    };
    format!("{short}{THIN}%")
}

/// What a ratio of times adds: `+23 % (+21 to +25)`.
pub fn extra(i: &Interval) -> Figure {
    let Some(i) = clean(i) else { return Figure::none() };
    let added = i.map(|x| 100.0 * (x - 1.0));
    // As many decimals as half the interval bears out.
    let half = (added.high - added.low) / 2.0;
    let place = if half > 0.0 && half.is_finite() { (half.log10().floor() as i32).clamp(-2, 1) } else { -1 };
    let signed = |x: f64| {
        format!("{}{}", if at(x, place).starts_with('−') || x <= 0.0 { "" } else { "+" }, at(x, place))
    };
    let range = (i.low != i.high).then(|| format!("{} to {}", signed(added.low), signed(added.high)));
    Figure { main: format!("{}{THIN}%", signed(added.value)), range }
}

/// A ratio: `× 2.3 (1.6–3.4)`.
pub fn times(i: &Interval) -> Figure {
    let figure = figure(i, 1.0, "");
    if figure.main == "—" {
        figure
    } else {
        Figure { main: format!("×{THIN}{}", figure.main), range: figure.range }
    }
}

/// A time, in the unit that suits it.
pub fn seconds(i: &Interval) -> Figure {
    let (factor, unit) = unit(i.value);
    figure(i, factor, &format!("{THIN}{unit}"))
}

/// A time without an interval.
pub fn seconds_of(x: f64) -> String {
    if !x.is_finite() {
        return "—".into();
    }
    let (factor, unit) = unit(x);
    format!("{}{THIN}{unit}", plain(x * factor, if x * factor >= 100.0 { 3 } else { 2 }))
}

/// A count: `12 345`, `1.2 M`.
pub fn count(x: f64) -> String {
    let (factor, unit) = match x.abs() {
        a if a >= 1e12 => (1.0, ""),
        a if a >= 1e9 => (1e-9, "G"),
        a if a >= 1e6 => (1e-6, "M"),
        a if a >= 1e3 => return at(x, 0),
        _ => (1.0, ""),
    };
    if unit.is_empty() && x.fract() == 0.0 {
        return at(x, 0);
    }
    let space = if unit.is_empty() { String::new() } else { THIN.to_string() };
    format!("{}{space}{unit}", plain(x * factor, 2))
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

/// Digits that an interval bears out: 2 where it is wide, up to 4.
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
    format!("{:.*e}", digits.saturating_sub(1), x.abs())
        .rsplit('e')
        .next()
        .and_then(|e| e.parse().ok())
        .unwrap_or(0)
}

fn span(i: &Interval, place: i32) -> String {
    let dash = if i.low < 0.0 { " to " } else { "–" };
    format!("{}{dash}{}", at(i.low, place), at(i.high, place))
}

/// `x` rounded at the decimal place `10^place`, thousands apart from 10 000 on.
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
    if whole.len() < 5 {
        return format!("{sign}{text}");
    }
    let mut grouped = String::new();
    for (i, c) in whole.chars().enumerate() {
        if i > 0 && (whole.len() - i) % 3 == 0 {
            grouped.push(THIN);
        }
        grouped.push(c);
    }
    format!("{sign}{grouped}{rest}")
}

fn raised(power: i32) -> String {
    let digit = |c| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        c => c.to_digit(10).and_then(|d| char::from_u32(0x2070 + d)).unwrap_or(c),
    };
    power.to_string().chars().map(digit).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn i(value: f64, low: f64, high: f64) -> Interval {
        Interval { value, low, high }
    }

    fn plainly(figure: &Figure) -> String {
        figure.to_string().replace(THIN, " ")
    }

    #[test]
    fn figures_have_the_digits_that_they_bear_out() {
        assert_eq!(plainly(&seconds(&i(42.3, 36.1, 55.2))), "42 s (36–55)");
        assert_eq!(plainly(&seconds(&i(0.0421, 0.0412, 0.0431))), "42.1 ms (41.2–43.1)");
        assert_eq!(plainly(&seconds(&i(754.0, 600.0, 900.0))), "13 min (10–15)");
        assert_eq!(plainly(&times(&i(1.0021, 0.9971, 1.0081))), "× 1.002 (0.997–1.008)");
        assert_eq!(plainly(&percent(&i(0.0123, 0.0123, 0.0123))), "1.23 %");
        assert_eq!(plainly(&figure(&i(1.21e-5, 1.0e-5, 1.5e-5), 1.0, "")), "1.2·10⁻⁵ ((1.0–1.5)·10⁻⁵)");
        assert_eq!(plainly(&figure(&i(-0.5, -0.52, -0.48), 1.0, "")), "−0.500 (−0.520 to −0.480)");
        assert_eq!(plainly(&extra(&i(1.23, 1.21, 1.25))), "+23 % (+21 to +25)");
        assert_eq!(plainly(&extra(&i(1.001, 0.997, 1.005))), "+0.1 % (−0.3 to +0.5)");
    }

    #[test]
    fn nothing_is_made_of_nothing() {
        for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(seconds(&Interval::exact(x)), Figure::none());
            assert_eq!(extra(&Interval::exact(x)), Figure::none());
            assert_eq!(percent_of(x), "—");
        }
        assert_eq!(plainly(&seconds(&i(2.0, 1.0, f64::INFINITY))), "2.0 s (1.0–∞)");
        assert_eq!(seconds(&Interval::exact(0.0)).main.replace(THIN, " "), "0 s");
        for x in [1e300, -1e300, 1e-300, -1e-300, 5e-324, 9.999_999, 999_999.5] {
            assert!(!figure(&i(x, x / 2.0, x * 2.0), 1.0, "").main.is_empty() && !count(x).is_empty());
        }
        assert_eq!(count(12345.0).replace(THIN, " "), "12 345");
        assert_eq!(count(1_234_567.0).replace(THIN, " "), "1.2 M");
    }
}
