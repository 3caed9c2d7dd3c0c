//! The page: one HTML file that fetches nothing, with a script for its sliders only.

use std::path::Path;

use maud::{Markup, PreEscaped, html};

use super::case_pictures::CasePictures;
use super::case_section::{badge, name, section};
use super::history::{self, RunHistory};
use super::{timing_section, wording};
use crate::image::ImageError;
use crate::regress::run_report::{CaseReport, CaseVerdict, RunReport};
use crate::regress::timing::TimingVerdict;
use crate::study::format::seconds_of;
use crate::study::pages::chart::shortened;
use crate::study::pages::document;
use crate::study::pages::parts::{cell, listing};

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("slider.js");

/// A case, the anchor of its section, and its pictures.
struct ShownCase<'a> {
    case: &'a CaseReport,
    id: String,
    pictures: CasePictures,
}

/// The page of a run. Pictures, logs and the history are read from the folder of the results; a picture or log that cannot be read is said on
/// the page.
///
/// # Errors
/// [`ImageError::Read`] for a history that is there and cannot be read.
pub fn html(report: &RunReport, results: &Path) -> Result<String, ImageError> {
    let history = RunHistory::with(report, results)?;
    let mut cases: Vec<ShownCase<'_>> = report
        .cases
        .iter()
        .enumerate()
        .map(|(i, case)| ShownCase {
            case,
            id: format!("case-{i}"),
            pictures: CasePictures::read(case, &report.folder, results),
        })
        .collect();
    // The sort is stable: cases of one verdict stay in the order of the manifest.
    cases.sort_by_key(|shown| {
        let is_slow = report.time_failure(shown.case).is_some();
        std::cmp::Reverse((
            shown.case.verdict.max(CaseVerdict::EqualWithinNoise),
            is_slow,
            wording::is_undecided(shown.case),
        ))
    });
    let folder = std::path::absolute(&report.folder).unwrap_or_else(|_| report.folder.clone());
    let folder = shortened(&folder.display().to_string(), 120);
    let body = html! {
        main.broad {
            header { h1 { "Regression renders of " (folder) } p.dim { (subtitle(report)) } }
            (summary(report, &history, results))
            (table(&cases))
            p.dim { (timing_section::NEVER_JUDGED) }
            @for ShownCase { case, id, pictures } in &cases { (section(case, id, pictures, &history, report, results)) }
        }
        script { (PreEscaped(SCRIPT)) }
    };
    Ok(document(&format!("{}: {folder}", headline(report)), STYLE, body))
}

/// The outcome of the run in a few words.
fn headline(report: &RunReport) -> &'static str {
    let failed = |failure| report.cases.iter().any(|case| report.time_failure(case) == Some(failure));
    match report.cases.iter().map(|case| case.verdict).max() {
        None => "Nothing was compared",
        Some(CaseVerdict::Broken) => "Broken",
        Some(CaseVerdict::Changed) => "Changed",
        Some(_) if failed(TimingVerdict::Untimed) => "Not timed",
        Some(_) if failed(TimingVerdict::Slower) => "Slower",
        Some(CaseVerdict::EqualWithinNoise | CaseVerdict::SameBits) => "Nothing has changed",
    }
}

fn subtitle(report: &RunReport) -> String {
    let version = shortened(&report.version, 60);
    let started = shortened(&report.started.replace('T', " ").replace('Z', " UTC"), 40);
    format!("pointillist {version} · {started} · {}", seconds_of(report.seconds))
}

fn summary(report: &RunReport, history: &RunHistory, results: &Path) -> Markup {
    let undecided = report.cases.iter().filter(|case| wording::is_undecided(case)).count();
    html! {
        div.answer {
            p.headline { (headline(report)) "." }
            ul {
                li { (wording::counts(report)) }
                li { (wording::false_alarm(report)) }
                @if let Some(power) = wording::power(report) { li { (power) } }
                @if let Some(timed) = wording::timed(report) { li { (timed) } }
                @if undecided > 0 {
                    li.warn { "Undecided within the budget, which more renderings would change: " (undecided) " of these." }
                }
                @if !history.damaged.is_empty() { li.warn { (history::damage(&history::file(results), &history.damaged)) "." } }
            }
        }
    }
}

fn table(cases: &[ShownCase<'_>]) -> Markup {
    listing(
        "Cases",
        cases,
        &[
            ("Case", &|shown| html! { a href={ "#" (shown.id) } { (name(shown.case)) } }),
            ("picture", &|shown| match &shown.pictures.thumbnail {
                Some(uri) => {
                    html! { img.small src=(uri) alt={ (name(shown.case)) ", this run, small" } decoding="async"; }
                }
                None => cell("—"),
            }),
            ("verdict", &|shown| badge(shown.case)),
            ("brightness", &|shown| cell(wording::brightness(shown.case))),
            ("p", &|shown| cell(wording::p_value(shown.case))),
            ("would be found", &|shown| cell(wording::detectable(shown.case))),
            ("renderings", &|shown| html! { (shown.case.renderings) " × " (shown.case.spp) " spp" }),
            ("time", &|shown| cell(seconds_of(shown.case.seconds))),
        ],
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regress::report::{record, sample};

    fn checked(report: &RunReport, results: &Path) -> String {
        let page = html(report, results).expect("a page");
        assert!(page.starts_with("<!DOCTYPE html>") && page.ends_with("</html>\n"));
        assert_eq!(page.matches("<script").count(), 1, "only the page's own script");
        for bad in
            ["src=\"http", "href=\"http", "url(http", "@import", "javascript:", "NaN", ">inf", "undefined"]
        {
            assert!(!page.contains(bad), "{bad}");
        }
        page
    }

    #[test]
    fn the_worst_cases_come_first() {
        let results = tempfile::tempdir().expect("a folder");
        let page = checked(&sample::report(), results.path());
        let at = |text: &str| page.find(text).unwrap_or_else(|| panic!("{text} is missing"));
        let order = ["case-2", "case-0", "case-1", "case-3"].map(|id| at(&format!("<section id=\"{id}\">")));
        assert!(order.is_sorted(), "{order:?}");
        for part in [
            "<p class=\"headline\">Broken.</p>",
            "4 cases: 1 broken",
            "at most 1 %.",
            "href=\"#case-2\"",
            "areas of 8×8 pixels",
            "exit code 101 &amp; “panic”",
            "pointillist render 'my scene.xml' --spp 64",
            "llvmpipe (LLVM 15.0.6, 256 bits), Mesa 22.3.6",
            "prefers-color-scheme: dark",
            "begins with this run",
            "shown and never judged",
        ] {
            at(part);
        }
    }

    #[test]
    fn damage_is_said_on_the_page() {
        let results = tempfile::tempdir().expect("a folder");
        std::fs::write(history::file(results.path()), "???\n").expect("written");
        let mut report = sample::report();
        record(&report, results.path()).expect("recorded");
        report.started = "2026-12-01T08:00:00Z".into();
        report.cases[2].log = Some("none.log".into());
        let page = checked(&report, results.path());
        for part in ["line 1 is damaged", "The log cannot be shown: cannot read", "2026-12-01 08:00"] {
            assert!(page.contains(part), "{part}");
        }
        std::fs::write(results.path().join("none.log"), "it <broke>\n").expect("written");
        assert!(checked(&report, results.path()).contains("it &lt;broke&gt;"));
    }

    #[test]
    fn no_text_and_no_number_breaks_the_page() {
        let results = tempfile::tempdir().expect("a folder");
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -1.0, 1e300, 1e-300] {
            let mut report = sample::report();
            for case in &mut report.cases {
                (case.name, case.sentence) = (sample::HOSTILE.into(), sample::HOSTILE.into());
                (case.device, case.method, case.tolerance) =
                    (sample::HOSTILE.into(), sample::HOSTILE.into(), sample::HOSTILE.into());
                (case.scene, case.command) = (sample::HOSTILE.into(), vec![sample::HOSTILE.into()]);
                case.seconds = bad;
                let mut times = sample::times();
                times.passes[1].name = sample::HOSTILE.into();
                (times.seconds, times.paths_per_trace_second) = (bad, Some(bad));
                times.passes[0].milliseconds = bad;
                case.times = Some(times);
                if let Some(judgement) = &mut case.judgement {
                    judgement.brightness = [[bad, 1.0], [1.0, bad], [bad; 2]];
                    (judgement.p_value, judgement.detectable, judgement.detectable_area) = (bad, bad, bad);
                    judgement.tests[0].statistic = bad;
                    judgement.tests[1].name = sample::HOSTILE.into();
                }
            }
            (report.seconds, report.false_alarm, report.version) = (bad, bad, sample::HOSTILE.into());
            (report.folder, report.started) = (sample::HOSTILE.into(), sample::HOSTILE.into());
            record(&RunReport { started: "earlier".into(), ..report.clone() }, results.path())
                .expect("recorded");
            checked(&report, results.path());
        }
        checked(&RunReport { cases: Vec::new(), ..sample::report() }, results.path());
    }
}
