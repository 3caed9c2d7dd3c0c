//! Workflow commands of GitHub Actions, which show messages beside the scene files of a pull request.
//!
//! Format and escapes: `@actions/core`, `command.ts`, and GitHub's page *Workflow commands for GitHub Actions*.

use super::wording;
use crate::regress::run_report::{CaseVerdict, RunReport};

/// One command a line: an error for each changed or broken case, a warning for each undecided one, and the summary as a notice. The scene
/// files are named as seen from the folder in which the program was started, which should be that of the repository.
pub fn annotations(report: &RunReport) -> String {
    let mut text = String::new();
    for case in report.cases.iter().filter(|case| wording::is_notable(case)) {
        let level = if case.verdict >= CaseVerdict::Changed { "error" } else { "warning" };
        let path = report.folder.join(&case.scene).display().to_string();
        let path = path.strip_prefix("./").unwrap_or(&path);
        let title = format!("{}: {}", case.name, wording::verdict(case));
        let mut message = case.sentence.clone();
        if !case.command.is_empty() {
            message += &format!("\nTo repeat it: {}", wording::command(case));
        }
        text +=
            &format!("::{level} file={},title={}::{}\n", property(path), property(&title), data(&message));
    }
    let summary: Vec<String> =
        [Some(wording::counts(report)), Some(wording::false_alarm(report)), wording::power(report)]
            .into_iter()
            .flatten()
            .collect();
    text + &format!("::notice title={}::{}\n", property("Regression renders"), data(&summary.join("\n")))
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
