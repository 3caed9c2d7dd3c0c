//! Times against another program: lines for the terminal, and a part of a case's section on the page.

use maud::{Markup, html};

use super::wording;
use crate::regress::run_report::RunReport;
use crate::regress::timing::{CaseTiming, TIMING_HEADS, explanation, rows};
use crate::study::pages::parts::{cell, table};

/// A line for each case that was to be timed, and what it means; nothing for a run without timing.
pub fn lines(report: &RunReport) -> String {
    let timed = report.cases.iter().filter_map(|case| Some((case, case.timing.as_ref()?)));
    let mut text = String::new();
    for (case, timing) in timed {
        if text.is_empty() {
            text += &format!("\n{}\n", wording::printable(&explanation(timing, report.false_alarm)));
        }
        let (name, sentence) = (wording::one_line(&case.name), wording::one_line(&timing.sentence));
        text += &format!("{name}: {}, {} pairs: {sentence}\n", timing.verdict.name(), timing.pairs);
    }
    text
}

/// The times of a case.
pub fn section(timing: &CaseTiming, false_alarm: f64) -> Markup {
    let rows: Vec<Vec<Markup>> = rows(timing)
        .iter()
        .map(|row| row.iter().map(|text| cell(wording::one_line(text))).collect())
        .collect();
    html! {
        h3 { "Time against another program: " (timing.verdict.name()) }
        p { (wording::one_line(&timing.sentence)) "." }
        (table("Times", &TIMING_HEADS, &rows))
        p.dim { (timing.pairs) " pairs. " (wording::one_line(&explanation(timing, false_alarm))) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regress::report::{sample, terminal};
    use crate::regress::timing::TimedFigure;

    #[test]
    fn times_are_told_on_terminal_and_page_only_where_there_are_any() {
        let mut report = sample::report();
        assert_eq!(lines(&report), "");
        let without = terminal(&report);
        let figure = TimedFigure::of_pairs("rendering", &[[1.3, 1.0]; 5], 0.01).expect("a figure");
        let timing = CaseTiming::of_figures(["<other>", ""], 5, vec![figure], &[]);
        report.cases[1].timing = Some(timing.clone());
        let with = terminal(&report);
        assert!(with.starts_with(&without) && with.len() > without.len(), "{with}");
        assert!(with.contains(": slower, 5 pairs: slower: rendering +30"), "{with}");
        let page = section(&timing, 0.01).into_string();
        for part in ["&lt;other&gt;", "rendering", "slower", "1.3 s", "5 pairs"] {
            assert!(page.contains(part), "{part}: {page}");
        }
    }
}
