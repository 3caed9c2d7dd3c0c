//! Times of a case, and how they compare with those of another program: lines of text, and parts of a case's section on the page.

use maud::{Markup, html};

use super::wording;
use crate::regress::case_times::{CaseTimes, PassTime};
use crate::regress::run_report::{CaseReport, RunReport};
use crate::regress::timing::{CaseTiming, TIMING_HEADS, explanation, rows};
use crate::render::figures::human;
use crate::study::format::duration;
use crate::study::pages::parts::{cell, details, listing, maybe, table};

/// What a reader of absolute times has to know.
pub const NEVER_JUDGED: &str = "Times of renderings are shown and never judged, since they depend on the machine and on what else it does; \
     ratios of interleaved renderings are judged, with --time-against.";

/// How long a rendering took, and how fast the tracer was.
pub fn of_renderings(times: &CaseTimes) -> String {
    let speed = times.paths_per_trace_second.filter(|speed| speed.is_finite());
    let speed = speed.map(|speed| format!(", {} paths/s of each thread", human(speed))).unwrap_or_default();
    format!("{} for a rendering{speed} (medians)", duration(times.seconds))
}

/// All times of a case, a line each: those of its renderings and their passes, and how they compare with those of another program.
pub fn all_lines(case: &CaseReport) -> String {
    let mut text = String::new();
    if let Some(times) = &case.times {
        text += &format!("time: {}\n", of_renderings(times));
        for pass in &times.passes {
            text +=
                &format!("GPU pass {}: {}\n", wording::one_line(&pass.name), milliseconds(pass.milliseconds));
        }
    }
    if let Some(timing) = &case.timing {
        text += &against(timing);
        for row in rows(timing) {
            let [name, now, other, change, shown] = row.map(|text| wording::one_line(&text));
            text += &format!("{name}: {now} against {other}, ratio − 1: {change}: {shown}\n");
        }
    }
    text
}

/// The outcome of times against another program in one line.
pub fn against(timing: &CaseTiming) -> String {
    let [program, sentence] =
        [&timing.against.display().to_string(), &timing.sentence].map(|text| wording::one_line(text));
    format!("time against {program}: {}, {} pairs: {sentence}\n", timing.verdict.name(), timing.pairs)
}

fn milliseconds(time: f64) -> String {
    duration(1e-3 * time)
}

/// The passes of the GPU, folded away; `before` are the times of an earlier run.
pub fn passes(times: &CaseTimes, before: Option<&CaseTimes>) -> Markup {
    let earlier = |pass: &PassTime| before.and_then(|before| before.pass(&pass.name)).map(milliseconds);
    let table = listing(
        "Passes of the GPU",
        &times.passes,
        &[
            ("Pass", &|pass| cell(wording::one_line(&pass.name))),
            ("this run", &|pass| cell(milliseconds(pass.milliseconds))),
            ("the run before", &|pass| maybe(earlier(pass))),
        ],
    );
    html! { @if !times.passes.is_empty() { (details("Times of the GPU's passes", table)) } }
}

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

    #[test]
    fn times_are_told_on_terminal_and_page_only_where_there_are_any() {
        let mut report = sample::report();
        assert_eq!(lines(&report), "");
        let without = terminal(&report);
        let timing = sample::slower();
        report.cases[1].timing = Some(timing.clone());
        let with = terminal(&report);
        assert!(with.starts_with(&without) && with.len() > without.len(), "{with}");
        assert!(with.contains(": slower, 5 pairs: slower: rendering +30"), "{with}");
        let page = section(&timing, 0.01).into_string();
        for part in ["&lt;other&gt;", "rendering", "slower", "1.3 s", "5 pairs"] {
            assert!(page.contains(part), "{part}: {page}");
        }
    }

    #[test]
    fn times_of_renderings_are_lines_and_a_table_of_passes() {
        let mut case = sample::changed();
        assert_eq!(all_lines(&case), "");
        (case.times, case.timing) = (Some(sample::times()), Some(sample::slower()));
        let text = all_lines(&case);
        for part in [
            "time: 0.25 s for a rendering, 614.0 k paths/s of each thread",
            "\nGPU pass splat: 1.5 ms\n",
            "\ntime against <other>: slower, 5 pairs: slower: rendering +30",
            "\nrendering: 1.3 s against 1.0 s, ratio − 1: +30",
        ] {
            assert!(text.contains(part), "{part}: {text}");
        }
        let mut before = sample::times();
        before.passes[1].milliseconds = 7.0;
        before.passes.remove(0);
        let table = passes(&sample::times(), Some(&before)).into_string();
        for part in ["<details>", "splat", "1.5 ms", "7.0 ms", "—"] {
            assert!(table.contains(part), "{part}: {table}");
        }
        let none = CaseTimes { passes: Vec::new(), ..sample::times() };
        assert_eq!(passes(&none, None).into_string(), "");
    }
}
