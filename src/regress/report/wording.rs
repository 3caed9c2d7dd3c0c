//! Sentences and numbers that all reports share.

use crate::regress::judgement::Judgement;
use crate::regress::run_report::{CaseReport, CaseVerdict, RunReport};
use crate::regress::timing::TimingVerdict;
use crate::render::run_spec::quoted;
use crate::study::format::{goal, significant, with_plain_spaces};
use crate::study::pages::parts::list;

/// Names of the channels.
pub const CHANNELS: [&str; 3] = ["red", "green", "blue"];

/// All verdicts, from worst to best.
pub const VERDICTS: [CaseVerdict; 4] =
    [CaseVerdict::Broken, CaseVerdict::Changed, CaseVerdict::EqualWithinNoise, CaseVerdict::SameBits];

/// `12 cases: 1 changed, 8 equal within noise and 3 same bits`.
pub fn counts(report: &RunReport) -> String {
    let all = report.cases.len();
    if all == 0 {
        return "No case was run.".into();
    }
    let counted: Vec<String> = VERDICTS
        .iter()
        .map(|verdict| (report.cases.iter().filter(|case| case.verdict == *verdict).count(), verdict.name()))
        .filter(|(count, _)| *count > 0)
        .map(|(count, name)| format!("{count} {name}"))
        .collect();
    format!("{all} case{}: {}.", if all == 1 { "" } else { "s" }, list(&counted))
}

/// `Times of 12 cases against another program: 1 slower and 11 as fast.`; `None` of a run without any.
pub fn timed(report: &RunReport) -> Option<String> {
    let verdicts: Vec<TimingVerdict> =
        report.cases.iter().filter_map(|case| Some(case.timing.as_ref()?.verdict)).collect();
    let counted: Vec<String> =
        [TimingVerdict::Slower, TimingVerdict::Untimed, TimingVerdict::Faster, TimingVerdict::AsFast]
            .iter()
            .map(|verdict| (verdicts.iter().filter(|known| *known == verdict).count(), verdict.name()))
            .filter(|(count, _)| *count > 0)
            .map(|(count, name)| format!("{count} {name}"))
            .collect();
    let all = verdicts.len();
    let cases = format!("{all} case{}", if all == 1 { "" } else { "s" });
    (all > 0).then(|| format!("Times of {cases} against another program: {}.", list(&counted)))
}

/// What the level of false alarms means.
pub fn false_alarm(report: &RunReport) -> String {
    let level = with_plain_spaces(&goal(report.false_alarm));
    format!("If nothing has changed, a run calls some case changed with a probability of at most {level}.")
}

/// What this run would have missed: the smallest change of brightness that every compared case would have found. `None` if nothing was
/// compared by statistics, unless every case has the same bits.
pub fn power(report: &RunReport) -> Option<String> {
    if !report.cases.is_empty() && report.cases.iter().all(|case| case.verdict == CaseVerdict::SameBits) {
        return Some(
            "Every bit of these renderings is that of the references, so that noise hides no change in them."
                .into(),
        );
    }
    let found = |case: &CaseReport| Some(case.judgement.as_ref()?.detectable);
    let judged = report.cases.iter().filter_map(|case| Some((case, found(case)?)));
    let judged = judged.filter(|(case, size)| case.verdict != CaseVerdict::SameBits && size.is_finite());
    let (least, size) = judged.max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(format!(
        "A change of the whole picture's brightness by {} or more would have been found in every compared case with a probability of \
         90 %; {} is the least sensitive one.",
        percent(size),
        one_line(&least.name)
    ))
}

/// Whether more than the table must be said of a case: it is broken, changed or undecided.
pub fn is_notable(case: &CaseReport) -> bool {
    case.verdict >= CaseVerdict::Changed || is_undecided(case)
}

/// Whether the budget was spent before the statistics could decide.
pub fn is_undecided(case: &CaseReport) -> bool {
    case.verdict < CaseVerdict::Changed && case.judgement.as_ref().is_some_and(|j| j.undecided)
}

/// The verdict in words, with a remark where it is not certain.
pub fn verdict(case: &CaseReport) -> String {
    format!("{}{}", case.verdict.name(), if is_undecided(case) { ", undecided" } else { "" })
}

/// The channel whose brightness differs most from the reference in units of its standard error, with its relative change and that error.
/// `None` if no channel has a finite one.
pub fn largest_change(judgement: &Judgement) -> Option<(usize, [f64; 2])> {
    let changes = judgement.brightness.iter().map(|[ratio, error]| [ratio - 1.0, *error]).enumerate();
    let score = |[change, error]: [f64; 2]| if change == 0.0 { 0.0 } else { change.abs() / error };
    changes
        .filter(|(_, change)| change.iter().all(|x| x.is_finite()))
        .max_by(|a, b| score(a.1).total_cmp(&score(b.1)))
}

/// The change of brightness with its standard error in per cent: `+0.31 ± 0.05 % (red)`.
pub fn brightness(case: &CaseReport) -> String {
    let Some((channel, [change, error])) = case.judgement.as_ref().and_then(largest_change) else {
        return "—".into();
    };
    if change == 0.0 && error == 0.0 {
        return "0 %".into();
    }
    if change.abs() > 1e3 {
        return format!("× {} ({})", number(1.0 + change), CHANNELS[channel]);
    }
    // Two digits of the error, or of a change that is exact.
    let scale = 100.0 * if error > 0.0 { error } else { change.abs() };
    let decimals = (1.0 - scale.log10().floor()).clamp(0.0, 8.0) as usize;
    let [change, error] =
        [format!("{:+.decimals$}", 100.0 * change), format!("{:.decimals$}", 100.0 * error)];
    format!("{} ± {error} % ({})", change.replace('-', "−"), CHANNELS[channel])
}

/// The p value of a case.
pub fn p_value(case: &CaseReport) -> String {
    case.judgement.as_ref().map_or_else(|| "—".into(), |j| number(j.p_value))
}

/// The smallest change of brightness that would have been found.
pub fn detectable(case: &CaseReport) -> String {
    case.judgement.as_ref().map_or_else(|| "—".into(), |j| percent(j.detectable))
}

/// A number with two significant digits.
pub fn number(value: f64) -> String {
    if value.is_nan() { "—".into() } else { with_plain_spaces(&significant(value, 2)) }
}

/// A fraction in per cent with two significant digits.
pub fn percent(fraction: f64) -> String {
    if fraction.is_finite() { format!("{} %", number(100.0 * fraction)) } else { "—".into() }
}

/// The command of a case, to be pasted into a shell.
pub fn command(case: &CaseReport) -> String {
    case.command.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
}

/// `text` without control characters other than line feeds and tabs.
pub fn printable(text: &str) -> String {
    text.chars().filter(|c| !c.is_control() || matches!(c, '\n' | '\t')).collect()
}

/// [`printable`] text in one line.
pub fn one_line(text: &str) -> String {
    printable(text).split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regress::report::sample;

    #[test]
    fn sentences_follow_from_the_numbers() {
        let mut report = sample::report();
        assert_eq!(counts(&report), "4 cases: 1 broken, 1 changed, 1 equal within noise and 1 same bits.");
        assert!(false_alarm(&report).ends_with("at most 1 %."), "{}", false_alarm(&report));
        let power_text = power(&report).unwrap_or_default();
        assert!(power_text.contains("by 0.32 % or more"), "{power_text}");
        assert!(power_text.contains("prism is the least"), "{power_text}");
        report.cases.retain(|case| case.judgement.is_none());
        assert_eq!(power(&report), None);
        report.cases.retain(|case| case.verdict == CaseVerdict::SameBits);
        assert!(power(&report).is_some_and(|text| text.starts_with("Every bit")));
        report.cases.clear();
        assert_eq!(counts(&report), "No case was run.");
    }

    #[test]
    fn the_channel_that_differs_most_is_shown_with_its_error() {
        let mut case = sample::changed();
        assert_eq!(brightness(&case), "+0.500 ± 0.060 % (red)");
        let set = |case: &mut CaseReport, channels: [[f64; 2]; 3]| {
            if let Some(judgement) = &mut case.judgement {
                judgement.brightness = channels;
            }
        };
        set(&mut case, [[1.1, 0.1], [0.9, 0.01], [1.0, 0.0]]);
        assert_eq!(brightness(&case), "−10.0 ± 1.0 % (green)");
        set(&mut case, [[1.0, 0.0]; 3]);
        assert_eq!(brightness(&case), "0 %");
        // Without any noise the smallest change counts most.
        set(&mut case, [[1.5, 0.1], [1.0, 0.0], [1.002, 0.0]]);
        assert_eq!(brightness(&case), "+0.20 ± 0.00 % (blue)");
        set(&mut case, [[1.0, 0.1], [1e9, 1.0], [1.0, 0.1]]);
        assert_eq!(brightness(&case), "× 1.0·10⁹ (green)");
        set(&mut case, [[f64::NAN, 0.1], [f64::INFINITY, 0.0], [1.0, f64::NAN]]);
        assert_eq!(brightness(&case), "—");
        case.judgement = None;
        assert_eq!(
            (brightness(&case), p_value(&case), detectable(&case)),
            ("—".into(), "—".into(), "—".into())
        );
    }

    #[test]
    fn text_of_other_programs_is_made_printable() {
        assert_eq!(printable("a\u{1b}[31m\r\n\tb\0"), "a[31m\n\tb");
        assert_eq!(one_line(" a\n b\t c "), "a b c");
    }
}
