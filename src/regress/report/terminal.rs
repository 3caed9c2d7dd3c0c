//! Table and sentences for the terminal.

use super::{timing_section, wording};
use crate::regress::run_report::{CaseReport, CaseVerdict, RunReport};
use crate::study::format::duration;
use crate::study::pages::chart::shortened;

/// Most characters of a case's name.
const NAME: usize = 40;

/// Headings of the table.
const HEADS: [&str; 6] = ["CASE", "VERDICT", "BRIGHTNESS", "P VALUE", "WOULD BE FOUND", "TIME"];

/// Table of all cases in the order of the manifest; what is broken, changed or undecided, with the command that repeats it; the summary.
pub fn terminal(report: &RunReport) -> String {
    text(report, false)
}

/// [`terminal`] with verdicts in the colours of ANSI terminals.
pub fn terminal_in_colors(report: &RunReport) -> String {
    text(report, true)
}

fn text(report: &RunReport, in_colors: bool) -> String {
    let rows: Vec<[String; 6]> = report.cases.iter().map(row).collect();
    let width = |i: usize| {
        let cells = rows.iter().map(|row| row[i].chars().count());
        cells.chain([HEADS[i].chars().count()]).max().unwrap_or(0)
    };
    let widths: [usize; 6] = std::array::from_fn(width);
    let mut text = String::new();
    if !rows.is_empty() {
        text += &line(&HEADS.map(String::from), &widths, None);
    }
    for (case, row) in report.cases.iter().zip(&rows) {
        text += &line(row, &widths, in_colors.then(|| color(case)));
    }
    for case in report.cases.iter().filter(|case| wording::is_notable(case)) {
        text += &format!("\n{}: {}: {}\n", one(&case.name), wording::verdict(case), one(&case.sentence));
        if !case.command.is_empty() {
            text += &format!("  to repeat: {}\n", wording::printable(&wording::command(case)));
        }
        if let Some(log) = case.log.as_ref().filter(|_| case.verdict == CaseVerdict::Broken) {
            text += &format!("  its log: {}\n", log.display());
        }
    }
    text += &format!("\n{}\n{}\n", wording::counts(report), wording::false_alarm(report));
    if let Some(power) = wording::power(report) {
        text += &format!("{power}\n");
    }
    text + &timing_section::lines(report)
}

fn row(case: &CaseReport) -> [String; 6] {
    [
        shortened(&one(&case.name), NAME),
        wording::verdict(case),
        wording::brightness(case),
        wording::p_value(case),
        wording::detectable(case),
        duration(case.seconds),
    ]
}

/// One line: names at the left, numbers at the right of their columns. The verdict is the second cell.
fn line(cells: &[String; 6], widths: &[usize; 6], color: Option<&str>) -> String {
    let padded: [String; 6] = std::array::from_fn(|i| {
        let room = " ".repeat(widths[i].saturating_sub(cells[i].chars().count()));
        match (i, color) {
            (1, Some(color)) => format!("{color}{}\u{1b}[0m{room}", cells[i]),
            (0 | 1, _) => format!("{}{room}", cells[i]),
            _ => format!("{room}{}", cells[i]),
        }
    });
    padded.join("  ").trim_end().to_owned() + "\n"
}

fn one(text: &str) -> String {
    wording::one_line(text)
}

/// Red, yellow or green (ECMA-48, Select Graphic Rendition).
fn color(case: &CaseReport) -> &'static str {
    match case.verdict {
        CaseVerdict::Broken | CaseVerdict::Changed => "\u{1b}[1;31m",
        _ if wording::is_undecided(case) => "\u{1b}[33m",
        CaseVerdict::EqualWithinNoise | CaseVerdict::SameBits => "\u{1b}[32m",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regress::report::sample;

    #[test]
    fn the_table_is_aligned_and_bad_cases_are_explained() {
        let report = sample::report();
        let table = terminal(&report);
        let lines: Vec<&str> = table.lines().collect();
        assert!(lines[0].starts_with("CASE"), "{table}");
        let at = |line: &str, word: &str| line.find(word).map(|i| line[..i].chars().count());
        let column = at(lines[0], "VERDICT");
        for (line, verdict) in lines[1..].iter().zip(["changed", "equal within noise", "broken", "same bits"])
        {
            assert_eq!(at(line, verdict), column, "{table}");
            assert_eq!(line.chars().count(), lines[0].chars().count(), "{table}");
        }
        for part in [
            "+0.500 ± 0.060 % (red)",
            "cornell: changed: Red is brighter by 0.5 %.",
            "fog: broken: The program ended",
            "to repeat: pointillist render 'my scene.xml' --spp 64",
            "1.2 s",
            "4 cases: 1 broken",
        ] {
            assert!(table.contains(part), "{part}: {table}");
        }
        assert!(!table.contains("prism: equal"), "{table}");
    }

    #[test]
    fn colors_change_nothing_else_and_names_cannot_print_them() {
        let mut report = sample::report();
        let colored = terminal_in_colors(&report);
        let plain =
            ["\u{1b}[1;31m", "\u{1b}[32m", "\u{1b}[0m"].iter().fold(colored.clone(), |t, c| t.replace(c, ""));
        assert!(colored.contains("\u{1b}[1;31mbroken\u{1b}[0m") && plain == terminal(&report), "{colored}");
        for case in &mut report.cases {
            (case.name, case.sentence) = (sample::HOSTILE.into(), sample::HOSTILE.into());
            case.command = vec![sample::HOSTILE.into()];
        }
        assert!(!terminal(&report).contains('\u{1b}'));
    }

    #[test]
    fn an_undecided_case_is_said() {
        let mut report = sample::report();
        report.cases[1].judgement.as_mut().expect("a judgement").undecided = true;
        let table = terminal(&report);
        assert!(table.contains("equal within noise, undecided"), "{table}");
        assert!(table.contains("prism: equal within noise, undecided: No difference"), "{table}");
    }
}
