//! A case from run to run: small plots of brightness, time and speed, and a table of the runs.
//!
//! The plots hold nothing but shapes, a path for all points of a kind, and their numbers stand in the table: a case costs about 10 kB of the
//! page after 30 runs.

use maud::{Markup, html};

use super::history::{PastCase, PastRun, RunHistory};
use super::{timing_section, wording};
use crate::regress::run_report::{CaseReport, CaseVerdict};
use crate::render::figures::human;
use crate::study::Interval;
use crate::study::format::{increase, seconds_of};
use crate::study::interval::Z90;
use crate::study::pages::parts::{Column, cell, details, listing, maybe};

/// Most runs that are shown.
const RUNS: usize = 30;
/// Width and height of a plot in its own units; it is stretched to its place on the page.
const SIZE: [f64; 2] = [300.0, 60.0];
/// Room around the points.
const EDGE: f64 = 5.0;

/// What one run found of the case.
type Past<'a> = (&'a PastRun, &'a PastCase);

/// Brightness and times from run to run, and the passes of the GPU.
pub fn course(case: &CaseReport, history: &RunHistory) -> Markup {
    let past: Vec<Past<'_>> = history.of_case(&case.name).collect();
    let past = &past[past.len().saturating_sub(RUNS)..];
    let channel = case.judgement.as_ref().and_then(wording::largest_change).map_or(1, |(channel, _)| channel);
    let brightness = format!("brightness, {}", wording::CHANNELS[channel]);
    let mut before = past.iter().rev().skip(1).filter(|(_, earlier)| earlier.device == case.device);
    let before = before.find_map(|(_, earlier)| earlier.times.as_ref());
    html! {
        h3 { "From run to run" }
        @if past.len() < 2 { p.dim { "The history of this case begins with this run." } }
        @else {
            div.plots {
                (plot(&brightness, past, |case| change(case, channel), |i| increase(&i.map(|x| 1.0 + x)).main))
                (plot("time of a rendering", past, |case| exact(seconds(case)), |i| seconds_of(i.value)))
                (plot("speed of a tracer's thread", past, |case| exact(speed(case)), |i| format!("{} paths/s", human(i.value))))
            }
            @if past.iter().any(|(_, earlier)| earlier.device != case.device) {
                p.dim { "Some runs were on another device or driver." }
            }
            (runs(past, channel, &brightness))
        }
        @if let Some(times) = &case.times { (timing_section::passes(times, before)) }
    }
}

/// Change of brightness against the reference with its 90 % interval.
fn change(case: &PastCase, channel: usize) -> Option<Interval> {
    let change = case.brightness[channel]? - 1.0;
    let half = Z90 * case.standard_error[channel].unwrap_or(0.0);
    Some(Interval { value: change, low: change - half, high: change + half })
}

fn seconds(case: &PastCase) -> Option<f64> {
    Some(case.times.as_ref()?.seconds)
}

fn speed(case: &PastCase) -> Option<f64> {
    case.times.as_ref()?.paths_per_trace_second
}

fn exact(value: Option<f64>) -> Option<Interval> {
    value.map(Interval::exact)
}

/// A point for each run from the oldest to the latest, in the colour of its verdict, on a scale that holds 0. Empty if no run has a value.
fn plot(
    title: &str,
    past: &[Past<'_>],
    value: impl Fn(&PastCase) -> Option<Interval>,
    label: impl Fn(&Interval) -> String,
) -> Markup {
    let values: Vec<Option<Interval>> = past.iter().map(|(_, case)| value(case)?.cleaned()).collect();
    let ends = || values.iter().flatten().flat_map(|i| [i.low, i.high]).filter(|end| end.is_finite());
    let (low, high) = (ends().fold(0.0, f64::min), ends().fold(0.0, f64::max));
    let least = values.iter().flatten().min_by(|a, b| a.value.total_cmp(&b.value));
    let most = values.iter().flatten().max_by(|a, b| a.value.total_cmp(&b.value));
    let (Some(least), Some(most), true) = (least, most, (high - low).is_finite()) else { return html! {} };
    let [width, height] = SIZE.map(|side| side - 2.0 * EDGE);
    let x = |i: usize| EDGE + width * i as f64 / (past.len() - 1).max(1) as f64;
    let y = |value: f64| match high > low {
        true => EDGE + height * (high - value.clamp(low, high)) / (high - low),
        false => EDGE + height / 2.0,
    };
    let (mut line, mut whiskers, mut last) = (String::new(), String::new(), None);
    for (i, value) in values.iter().enumerate().filter_map(|(i, value)| Some((i, value.as_ref()?))) {
        // A run without a value interrupts the line.
        let step = if last.is_some_and(|last| last + 1 == i) { 'L' } else { 'M' };
        line += &format!("{step}{:.1} {:.1}", x(i), y(value.value));
        if value.high > value.low {
            whiskers += &format!("M{:.1} {:.1}V{:.1}", x(i), y(value.low), y(value.high));
        }
        last = Some(i);
    }
    let dots = |verdict: CaseVerdict| -> String {
        let of_verdict =
            past.iter().zip(&values).enumerate().filter(|(_, ((_, case), _))| case.verdict == verdict);
        let point = |(i, (_, value)): (usize, (&Past<'_>, &Option<Interval>))| {
            Some(format!("M{:.1} {:.1}h0", x(i), y(value.as_ref()?.value)))
        };
        of_verdict.filter_map(point).collect()
    };
    let latest = values.last().and_then(Option::as_ref).map_or_else(|| "—".to_owned(), &label);
    let [from, to] = [least, most].map(|i| label(&Interval::exact(i.value)));
    let text = format!("{title}: {latest}; {from} to {to} in {} runs", past.len());
    html! {
        figure {
            svg viewBox={ "0 0 " (SIZE[0]) " " (SIZE[1]) } preserveAspectRatio="none" role="img" aria-label=(text) {
                path.zero d={ "M0 " (format!("{:.1}", y(0.0))) "H" (SIZE[0]) } {}
                path.line d=(line) {}
                @if !whiskers.is_empty() { path.whisker d=(whiskers) {} }
                @for verdict in wording::VERDICTS {
                    @let dots = dots(verdict);
                    @if !dots.is_empty() { path class={ "dots " (verdict_class(verdict)) } d=(dots) {} }
                }
            }
            figcaption { (text) "." }
        }
    }
}

/// The class of a verdict's colour.
pub fn verdict_class(verdict: CaseVerdict) -> &'static str {
    match verdict {
        CaseVerdict::Broken => "v-broken",
        CaseVerdict::Changed => "v-changed",
        CaseVerdict::EqualWithinNoise => "v-equal",
        CaseVerdict::SameBits => "v-same",
    }
}

/// The runs as a table from the latest to the oldest, folded away.
fn runs(past: &[Past<'_>], channel: usize, brightness: &str) -> Markup {
    let rows: Vec<Past<'_>> = past.iter().rev().copied().collect();
    // Date and time to the minute.
    let date = |(run, _): &Past<'_>| {
        cell(run.date.replace('T', " ").chars().take("2026-11-30 22:05".len()).collect::<String>())
    };
    let of_brightness =
        |(_, case): &Past<'_>| maybe(change(case, channel).map(|i| increase(&i.map(|x| 1.0 + x))));
    let timing = |(_, case): &Past<'_>| maybe(case.timing.as_ref().map(|timing| timing.verdict.name()));
    let columns: [Column<'_, Past<'_>>; 6] = [
        ("Run (UTC)", &date),
        ("verdict", &|(_, case)| cell(case.verdict.name())),
        (brightness, &of_brightness),
        ("time of a rendering", &|(_, case)| maybe(seconds(case).map(seconds_of))),
        ("paths/s of a thread", &|(_, case)| maybe(speed(case).map(human))),
        ("against another program", &timing),
    ];
    let shown = if past.iter().any(|(_, case)| case.timing.is_some()) { 6 } else { 5 };
    details(&format!("The last {} runs", past.len()), listing("Runs", &rows, &columns[..shown]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regress::report::sample;

    /// The sample's run with times, and an earlier one without.
    fn two_runs() -> (CaseReport, RunHistory) {
        let mut report = sample::report();
        (report.cases[0].times, report.cases[0].timing) = (Some(sample::times()), Some(sample::slower()));
        let folder = tempfile::tempdir().expect("a folder");
        let mut history = RunHistory::with(&report, folder.path()).expect("a history");
        assert!(course(&report.cases[0], &history).into_string().contains("begins with this run"));
        let mut earlier = history.runs[0].clone();
        earlier.date = "2026-11-29T10:00:00Z".into();
        let case = &mut earlier.cases[0];
        (case.verdict, case.brightness[0], case.times, case.timing) =
            (CaseVerdict::EqualWithinNoise, Some(0.9991), None, None);
        history.runs.insert(0, earlier);
        (report.cases.swap_remove(0), history)
    }

    #[test]
    fn the_course_begins_with_the_second_run() {
        let (case, mut history) = two_runs();
        let text = course(&case, &history).into_string();
        for part in [
            "2026-11-29 10:00",
            "2026-11-30 22:05",
            "brightness, red: +0.5",
            "in 2 runs",
            "time of a rendering: 0.25",
            "614.0 k paths/s",
            "GPU&#39;s passes",
            ">slower<",
        ] {
            let part = part.replace("&#39;", "'");
            assert!(text.contains(&part), "{part}: {text}");
        }
        assert!(text.contains("−0.0") && !text.contains("another device"), "{text}");
        assert_eq!(text.matches("<svg").count(), 3);
        // The run without times has no point and no number.
        assert_eq!(text.matches("h0").count(), 4, "{text}");
        history.runs[0].cases[0].device = "another".into();
        assert!(course(&case, &history).into_string().contains("another device"));
    }

    #[test]
    fn runs_without_a_value_interrupt_the_line() {
        let (_, history) = two_runs();
        let values = [Some(1.0), Some(2.0), None, Some(1.5)];
        let mut cases: Vec<PastCase> = vec![history.runs[1].cases[0].clone(); 4];
        for (case, value) in cases.iter_mut().zip(values) {
            case.brightness[0] = value;
        }
        let past: Vec<Past<'_>> = cases.iter().map(|case| (&history.runs[0], case)).collect();
        let drawn =
            plot("x", &past, |case| exact(case.brightness[0]), |i| format!("{:.1}", i.value)).into_string();
        assert!(drawn.contains("d=\"M5.0 30.0L101.7 5.0M295.0 17.5\""), "{drawn}");
        assert!(drawn.contains("x: 1.5; 1.0 to 2.0 in 4 runs"), "{drawn}");
        assert!(!drawn.contains("whisker"), "{drawn}");
        for wrong in [None, Some(f64::NAN), Some(f64::INFINITY)] {
            assert_eq!(plot("x", &past, |_| exact(wrong), |_| String::new()).into_string(), "");
        }
        assert!(
            plot("x", &past, |_| exact(Some(0.0)), |_| String::new()).into_string().contains("M5.0 30.0L")
        );
    }
}
