//! Workflow commands of GitHub Actions, which show messages beside the scene files of a pull request.
//!
//! Format and escapes: `@actions/core`, `command.ts`, and GitHub's page *Workflow commands for GitHub Actions*.

use super::wording;
use crate::regress::bisect::normalised;
use crate::regress::run_report::{CaseReport, CaseVerdict, RunReport};
use crate::regress::timing::TimingVerdict;

/// One command a line: an error for each changed or broken case, a warning for each undecided one; a warning for each case that is slower than
/// with another program or could not be timed, which is an error if it makes the run red; and the summary as a notice. The scene
/// files are named as seen from the folder in which the program was started, which should be that of the repository.
pub fn annotations(report: &RunReport) -> String {
    let mut text = String::new();
    for case in report.cases.iter().filter(|case| wording::is_notable(case)) {
        let level = if case.verdict >= CaseVerdict::Changed { "error" } else { "warning" };
        let mut message = case.sentence.clone();
        if !case.command.is_empty() {
            message += &format!("\nTo repeat it: {}", wording::command(case));
        }
        text += &at_scene(report, case, level, &wording::verdict(case), &message);
    }
    for case in &report.cases {
        let notable = |verdict| matches!(verdict, TimingVerdict::Slower | TimingVerdict::Untimed);
        let Some(timing) = case.timing.as_ref().filter(|timing| notable(timing.verdict)) else { continue };
        let level = if report.time_failure(case).is_some() { "error" } else { "warning" };
        let message = format!("{}\nThe other program: {}", timing.sentence, timing.against.display());
        text += &at_scene(report, case, level, timing.verdict.name(), &message);
    }
    let summary: Vec<String> = [
        Some(wording::counts(report)),
        Some(wording::false_alarm(report)),
        wording::power(report),
        wording::timed(report),
    ]
    .into_iter()
    .flatten()
    .collect();
    text + &format!("::notice title={}::{}\n", property("Regression renders"), data(&summary.join("\n")))
}

/// A command that shows a message at the scene file of a case.
fn at_scene(report: &RunReport, case: &CaseReport, level: &str, outcome: &str, message: &str) -> String {
    let path = normalised(&report.folder.join(&case.scene)).display().to_string();
    let title = format!("{}: {outcome}", case.name);
    format!("::{level} file={},title={}::{}\n", property(&path), property(&title), data(message))
}

/// The message of a command.
fn data(text: &str) -> String {
    wording::printable(text).replace('%', "%25").replace('\n', "%0A")
}

/// The value of a property, in which the separators of properties are escaped as well.
fn property(text: &str) -> String {
    data(text).replace(':', "%3A").replace(',', "%2C")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regress::report::sample;
    use crate::regress::timing::CaseTiming;

    #[test]
    fn changed_and_broken_cases_are_errors_at_their_scenes() {
        let mut report = sample::report();
        let text = annotations(&report);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(
            lines[0],
            "::error file=tests/regress/scenes/cornell.xml,title=cornell%3A changed::Red is brighter by 0.5 %25.%0A\
             To repeat it: pointillist render 'my scene.xml' --spp 64"
        );
        assert!(
            lines[1]
                .starts_with("::error file=tests/regress/scenes/fog.xml,title=fog%3A broken::The program")
        );
        assert!(lines[2].starts_with("::notice title=Regression renders::4 cases: 1 broken"), "{text}");
        assert_eq!(lines.len(), 3, "{text}");
        report.cases[1].judgement.as_mut().expect("a judgement").undecided = true;
        assert!(
            annotations(&report)
                .contains("\n::warning file=tests/regress/scenes/prism.xml,title=prism%3A equal")
        );
    }

    #[test]
    fn slower_cases_are_warnings_and_errors_on_request() {
        let mut report = sample::report();
        report.cases[1].timing = Some(sample::slower());
        report.cases[3].timing = Some(CaseTiming::failed(["other", ""], "It failed.".into()));
        let text = annotations(&report);
        let lines: Vec<&str> = text.lines().collect();
        let prism = "file=tests/regress/scenes/prism.xml,title=prism%3A slower::slower: rendering +30";
        assert!(lines[2].starts_with(&format!("::warning {prism}")), "{text}");
        assert!(lines[2].ends_with("The other program: <other>"), "{text}");
        assert!(
            lines[3]
                .starts_with("::warning file=tests/regress/scenes/mirror.xml,title=mirror%3A not timed::It")
        );
        assert!(
            lines[4].contains("Times of 2 cases against another program: 1 slower and 1 not timed."),
            "{text}"
        );
        report.fail_on_slower = Some(10.0);
        let text = annotations(&report);
        assert!(text.contains(&format!("\n::error {prism}")) && !text.contains("::warning"), "{text}");
        report.fail_on_slower = Some(50.0);
        assert!(annotations(&report).contains(&format!("\n::warning {prism}")));
    }

    #[test]
    fn no_text_begins_another_command_or_property() {
        let mut report = sample::report();
        let case = &mut report.cases[0];
        (case.name, case.sentence) = (sample::HOSTILE.into(), sample::HOSTILE.into());
        case.scene = "a,title=b::c.xml".into();
        let text = annotations(&report);
        assert_eq!(text.lines().count(), 3, "{text}");
        let first = text.lines().next().unwrap_or_default();
        assert!(first.contains("file=tests/regress/a%2Ctitle=b%3A%3Ac.xml,title="), "{first}");
        assert!(first.contains("%25,:[31m%0A::error::"), "{first}");
    }
}
