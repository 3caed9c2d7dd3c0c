//! The section of a case on the page.

use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use maud::{Markup, html};

use super::case_pictures::{CasePictures, STRONGEST_Z, SignedZMap, flip_color, located, z_color};
use super::course::{course, verdict_class};
use super::history::RunHistory;
use super::{timing_section, wording};
use crate::image::ImageError;
use crate::regress::judgement::{JudgedTest, Judgement};
use crate::regress::run_report::{CaseReport, CaseVerdict, RunReport};
use crate::study::format::seconds_of;
use crate::study::pages::chart::shortened;
use crate::study::pages::parts::{cell, command, details, listing, maybe};

/// Lines of the log that are shown.
const LOG_LINES: usize = 30;
/// Bytes of the log's end that are read for them.
const LOG_BYTES: u64 = 64 * 1024;

/// All that is known of a case, with the heading `id`.
pub fn section(
    case: &CaseReport,
    id: &str,
    pictures: &CasePictures,
    history: &RunHistory,
    report: &RunReport,
    results: &Path,
) -> Markup {
    html! {
        section id=(id) {
            h2 { (name(case)) " " (badge(case)) }
            p.takeaway { (wording::one_line(&case.sentence)) }
            @for problem in &pictures.problems { p.warn { (wording::one_line(problem)) } }
            @if case.verdict == CaseVerdict::SameBits { (details("Picture and figures", body(case, pictures, history))) }
            @else { (body(case, pictures, history)) }
            @if let Some(timing) = &case.timing { (timing_section::section(timing, report.false_alarm)) }
            @if let Some(log) = &case.log { (log_end(case, &located(log, [results, &report.folder]))) }
        }
    }
}

/// The name of a case, without control characters.
pub fn name(case: &CaseReport) -> String {
    shortened(&case.name, 120)
}

/// The verdict in its colour.
pub fn badge(case: &CaseReport) -> Markup {
    let class = if wording::is_undecided(case) { "v-undecided" } else { verdict_class(case.verdict) };
    html! { span class={ "badge " (class) } { (wording::verdict(case)) } }
}

fn body(case: &CaseReport, pictures: &CasePictures, history: &RunHistory) -> Markup {
    html! {
        (maps(case, pictures))
        @if let Some(judgement) = &case.judgement { (statistics(judgement)) }
        (course(case, history))
        (origin(case))
    }
}

/// The pictures: this run against the reference, and the maps of their difference.
fn maps(case: &CaseReport, pictures: &CasePictures) -> Markup {
    let case = name(case);
    html! {
        div.maps {
            @match (&pictures.picture, &pictures.reference) {
                (Some(now), Some(reference)) => { (slider(&case, now, reference)) }
                (Some(now), None) => {
                    figure { img src=(now) alt={ (case) ", this run" } decoding="async"; figcaption { "This run." } }
                }
                (None, _) => {}
            }
            @if let Some((map, mean)) = &pictures.flip {
                figure {
                    img src=(map) alt={ (case) ", FLIP map of this run against the reference" } decoding="async";
                    (scale("0", "1", flip_color))
                    figcaption { "FLIP: how visible the difference is when both alternate; mean " (wording::number(*mean)) "." }
                }
            }
            @if let Some(SignedZMap { uri: map, largest }) = &pictures.z {
                figure {
                    img src=(map) alt={ (case) ", map of the difference in standard errors" } decoding="async";
                    (scale(&format!("−{STRONGEST_Z}"), &format!("+{STRONGEST_Z}"), |at| z_color((2.0 * at - 1.0) * STRONGEST_Z)))
                    figcaption {
                        "z: difference of luminance over its standard error, red where this run is brighter, blue where it is darker, teal "
                        "where it is not known."
                        @if let Some((z, [x, y])) = largest { " Largest: " (wording::number(f64::from(*z))) " at pixel " (x) "," (y) "." }
                    }
                }
            }
        }
        @if pictures.step > 1 {
            p.dim {
                "Each pixel shown stands for " (pictures.step) " × " (pictures.step) " of the picture: their mean, and of z the value of largest magnitude."
            }
        }
    }
}

/// Both pictures in one place with a boundary that moves.
fn slider(case: &str, now: &str, reference: &str) -> Markup {
    html! {
        figure {
            div.ab {
                img.then src=(reference) alt={ (case) ", reference" } decoding="async";
                img.now src=(now) alt={ (case) ", this run" } decoding="async";
                input type="range" min="0" max="100" value="50" aria-label={ "Boundary between this run and the reference of " (case) };
                span.line aria-hidden="true" {}
                span.now.side aria-hidden="true" { "this run" }
                span.then.side aria-hidden="true" { "reference" }
            }
            figcaption { "Drag, or use the arrow keys; the space bar changes from one to the other." }
        }
    }
}

/// The colours of a map from the smallest to the largest value.
fn scale(low: &str, high: &str, color: impl Fn(f32) -> [u8; 3]) -> Markup {
    let stops: Vec<String> =
        (0..=24).map(|i| color(i as f32 / 24.0)).map(|[r, g, b]| format!("rgb({r} {g} {b})")).collect();
    html! {
        span.scale aria-hidden="true" style={ "background: linear-gradient(to right, " (stops.join(", ")) ")" } {}
        span.ends.dim { span { (low) } span { (high) } }
    }
}

fn statistics(judgement: &Judgement) -> Markup {
    let place = |test: &JudgedTest| test.place.map(|[x, y]| format!("{x}, {y}"));
    let tests = listing(
        "Tests",
        &judgement.tests,
        &[
            ("Test", &|test| cell(wording::one_line(&test.name))),
            ("statistic", &|test| cell(wording::number(test.statistic))),
            ("p, corrected", &|test| cell(wording::number(test.p_value))),
            ("at pixel", &|test| maybe(place(test))),
        ],
    );
    html! {
        h3 { "Statistics" }
        p {
            "A difference at least as large has the probability " (wording::number(judgement.p_value))
            " if nothing has changed. With 90 % probability a change of the whole picture's brightness by "
            (wording::percent(judgement.detectable)) " would have been found, or one of a single area of 8 × 8 pixels by "
            (wording::percent(judgement.detectable_area)) "."
        }
        (tests)
    }
}

/// How the case was rendered, and the command that repeats it.
fn origin(case: &CaseReport) -> Markup {
    let path = |path: &Option<PathBuf>| path.as_ref().map(|path| path.display().to_string());
    let rows = [
        ("Scene", Some(case.scene.display().to_string())),
        ("Method", Some(case.method.clone())),
        ("Device and driver", Some(case.device.clone())),
        (
            "Renderings",
            Some(format!("{} of {} samples per pixel, other seeds each", case.renderings, case.spp)),
        ),
        ("Time of all", Some(seconds_of(case.seconds))),
        ("Time of each", case.times.as_ref().map(timing_section::of_renderings)),
        ("Tolerance", Some(case.tolerance.clone())),
        ("Picture", path(&case.picture)),
        ("Reference", path(&case.reference)),
    ];
    html! {
        dl {
            @for (name, value) in &rows {
                @let value = value.as_deref().map(wording::one_line).unwrap_or_default();
                div { dt { (name) } dd { @if value.is_empty() { "none" } @else { (value) } } }
            }
        }
        @if !case.command.is_empty() {
            p { "To repeat the first rendering:" }
            (command(&wording::printable(&wording::command(case))))
        }
    }
}

/// The last lines of the log; open for a broken case.
fn log_end(case: &CaseReport, path: &Path) -> Markup {
    let lines = match tail(path) {
        Ok(lines) => html! { pre { (lines) } },
        Err(error) => html! { p.warn { "The log cannot be shown: " (error.to_string()) "." } },
    };
    html! {
        details open[case.verdict == CaseVerdict::Broken] {
            summary { "The last lines of the log, " (path.display()) }
            (lines)
        }
    }
}

/// The last lines of a text file, without what terminals take for commands.
fn tail(path: &Path) -> Result<String, ImageError> {
    let read = || -> std::io::Result<Vec<u8>> {
        let mut file = std::fs::File::open(path)?;
        let length = file.metadata()?.len();
        file.seek(SeekFrom::Start(length.saturating_sub(LOG_BYTES)))?;
        let mut bytes = Vec::new();
        file.take(LOG_BYTES).read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    let bytes = read().map_err(|source| ImageError::Read { path: path.to_path_buf(), source })?;
    let text = wording::printable(&String::from_utf8_lossy(&bytes));
    let lines: Vec<&str> = text.lines().collect();
    Ok(lines[lines.len().saturating_sub(LOG_LINES)..].join("\n"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regress::report::sample;

    #[test]
    fn a_long_log_is_shown_from_its_end() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("case.log");
        let text: String = (0..20_000).map(|i| format!("\u{1b}[31mline {i}\n")).collect();
        std::fs::write(&path, text).expect("written");
        let end = tail(&path).expect("a log");
        assert_eq!(end.lines().count(), LOG_LINES);
        assert!(end.ends_with("line 19999") && !end.contains('\u{1b}'), "{end}");
        let missing = log_end(&sample::changed(), &folder.path().join("none.log")).into_string();
        assert!(missing.contains("The log cannot be shown: cannot read"), "{missing}");
    }
}
