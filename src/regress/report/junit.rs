//! JUnit XML, as CI servers read it.
//!
//! The file keeps to what the schemas of Ant (windyroad's `JUnit.xsd`) and Jenkins (`junit-10.xsd`) have in common with what GitLab reads: a
//! device is a `testsuite` with its `properties`, since a `testcase` may have none. So the times of a case stand in its `system-out`.

use maud::{Markup, PreEscaped, html};

use super::{timing_section, wording};
use crate::regress::run_report::{CaseReport, CaseVerdict, RunReport};
use crate::regress::timing::TimingVerdict;
use crate::render::process::machine_name;

/// The report as JUnit XML: a failure for a changed case, and for a slower one if that makes the run red; an error for a broken one, and for
/// one that could not be timed if that does.
pub fn junit(report: &RunReport) -> String {
    let all: Vec<&CaseReport> = report.cases.iter().collect();
    let mut devices: Vec<&str> = Vec::new();
    for case in &all {
        if !devices.contains(&case.device.as_str()) {
            devices.push(&case.device);
        }
    }
    let suites = devices.into_iter().enumerate().map(|(id, device)| {
        let cases: Vec<&CaseReport> = all.iter().copied().filter(|case| case.device == device).collect();
        suite(report, id, device, &cases)
    });
    let root = html! {
        (PreEscaped("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"))
        testsuites name="pointillist regress" tests=(all.len()) failures=(count(report, &all, Red::Failure))
            errors=(count(report, &all, Red::Error)) time=(seconds(report.seconds)) {
            @for suite in suites { (suite) }
            "\n"
        }
    };
    root.into_string() + "\n"
}

fn suite(report: &RunReport, id: usize, device: &str, cases: &[&CaseReport]) -> Markup {
    let name = if device.is_empty() { "no device" } else { device };
    // The schema wants neither fractions of a second nor a time zone: all times are UTC.
    let timestamp: String = xml(&report.started).chars().take("2026-11-30T22:05:07".len()).collect();
    let host = machine_name().unwrap_or_else(|| "localhost".into());
    let properties = [
        ("device", xml(name)),
        ("version", xml(&report.version)),
        ("false_alarm", report.false_alarm.to_string()),
    ];
    html! {
        "\n"
        testsuite id=(id) package="regress" name=(xml(name)) timestamp=(timestamp) hostname=(xml(&host)) tests=(cases.len())
            failures=(count(report, cases, Red::Failure)) errors=(count(report, cases, Red::Error)) skipped="0"
            time=(seconds(cases.iter().map(|case| case.seconds).filter(|s| s.is_finite()).sum())) {
            properties { @for (name, value) in &properties { property name=(name) value=(value) {} } }
            @for case in cases { (test_case(report, case)) }
            system-out {} system-err {}
        }
    }
}

/// What makes a case red: one element, as the schemas allow no more.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Red {
    Failure,
    Error,
}

/// Whether a case is red, with the type and the message of the element that says so. The picture comes before the times.
fn red<'a>(report: &RunReport, case: &'a CaseReport) -> Option<(Red, &'static str, &'a str)> {
    let timing = case.timing.as_ref().map_or("", |timing| timing.sentence.as_str());
    match (case.verdict, report.time_failure(case)) {
        (CaseVerdict::Broken, _) => Some((Red::Error, "broken", case.sentence.as_str())),
        (CaseVerdict::Changed, _) => Some((Red::Failure, "changed", case.sentence.as_str())),
        (_, Some(TimingVerdict::Untimed)) => Some((Red::Error, "not timed", timing)),
        (_, Some(_)) => Some((Red::Failure, "slower", timing)),
        (_, None) => None,
    }
}

fn test_case(report: &RunReport, case: &CaseReport) -> Markup {
    // Servers show the words between dots as folders.
    let class = case.scene.with_extension("").display().to_string();
    let class = class.trim_start_matches(['.', '/']).replace('.', "_").replace(['/', '\\'], ".");
    let out = format!("{}: {}\n{}", wording::verdict(case), case.sentence, timing_section::all_lines(case));
    html! {
        "\n"
        testcase name=(xml(&case.name)) classname=(xml(&class)) time=(seconds(case.seconds)) {
            @match red(report, case) {
                Some((Red::Failure, kind, message)) => {
                    failure type=(kind) message=(xml(message)) { (xml(&details(case))) }
                }
                Some((Red::Error, kind, message)) => {
                    error type=(kind) message=(xml(message)) { (xml(&details(case))) }
                }
                None => {}
            }
            system-out { (xml(&out)) }
        }
    }
}

/// Everything that is known of a case that is not as it should be.
fn details(case: &CaseReport) -> String {
    let mut text = format!("{}\n", case.sentence);
    if let Some(judgement) = &case.judgement {
        text +=
            &format!("change of brightness {}, p {}\n", wording::brightness(case), wording::p_value(case));
        for test in &judgement.tests {
            let place = test.place.map_or_else(String::new, |[x, y]| format!(" at pixel {x},{y}"));
            let [statistic, p] = [test.statistic, test.p_value].map(wording::number);
            text += &format!("{}: {statistic}, p {p}{place}\n", test.name);
        }
    }
    if let Some(timing) = &case.timing {
        text += &timing_section::against(timing);
    }
    text += &format!("method {}, device {}\n", case.method, case.device);
    text + &format!("to repeat: {}\n", wording::command(case))
}

fn count(report: &RunReport, cases: &[&CaseReport], kind: Red) -> usize {
    cases.iter().filter(|case| red(report, case).is_some_and(|(known, ..)| known == kind)).count()
}

/// A decimal number: the schema takes no exponents.
fn seconds(value: f64) -> String {
    if value.is_finite() { format!("{value:.3}") } else { "0.000".into() }
}

/// `text` without what XML 1.0 does not allow (section 2.2). Markup is escaped by the template.
fn xml(text: &str) -> String {
    wording::printable(text).replace(['\u{fffe}', '\u{ffff}'], "")
}

#[cfg(test)]
mod tests {
    use roxmltree::{Document, Node};

    use super::*;
    use crate::regress::report::sample;
    use crate::regress::timing::CaseTiming;

    /// Attributes that the schemas allow; the first ones they require.
    const SUITE: (&[&str], &[&str]) = (
        &["name", "tests", "failures", "errors", "time", "timestamp", "hostname"],
        &["id", "package", "skipped"],
    );
    const CASE: (&[&str], &[&str]) = (&["name", "classname", "time"], &[]);
    const OUTCOME: (&[&str], &[&str]) = (&["type", "message"], &[]);

    #[track_caller]
    fn has_attributes(node: Node<'_, '_>, (required, optional): (&[&str], &[&str])) {
        for name in required {
            assert!(node.has_attribute(*name), "{name} of {node:?}");
        }
        for attribute in node.attributes() {
            assert!(
                required.contains(&attribute.name()) || optional.contains(&attribute.name()),
                "{attribute:?}"
            );
        }
    }

    #[track_caller]
    fn number(node: Node<'_, '_>, name: &str) -> f64 {
        let text = node.attribute(name).expect("an attribute");
        assert!(text.chars().all(|c| c.is_ascii_digit() || c == '.'), "{name} is {text}");
        text.parse().expect("a number")
    }

    fn names<'a>(node: Node<'a, '_>) -> Vec<&'a str> {
        node.children().filter(Node::is_element).map(|child| child.tag_name().name()).collect()
    }

    /// The rules of `JUnit.xsd` and `junit-10.xsd`.
    #[track_caller]
    fn check(text: &str) {
        assert!(text.starts_with("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites "), "{text}");
        let tree = Document::parse(text).unwrap_or_else(|e| panic!("{e}: {text}"));
        let root = tree.root_element();
        has_attributes(root, (&["name", "tests", "failures", "errors", "time"], &[]));
        let mut sums = [0.0; 3];
        for suite in root.children().filter(Node::is_element) {
            assert_eq!(suite.tag_name().name(), "testsuite");
            has_attributes(suite, SUITE);
            let timestamp = suite.attribute("timestamp").expect("a timestamp");
            let pattern =
                timestamp.chars().map(|c| if c.is_ascii_digit() { '0' } else { c }).collect::<String>();
            assert_eq!(pattern, "0000-00-00T00:00:00");
            let children = names(suite);
            let cases: Vec<_> = suite.children().filter(|n| n.has_tag_name("testcase")).collect();
            let order = [vec!["properties"], vec!["testcase"; cases.len()], vec!["system-out", "system-err"]];
            assert_eq!(children, order.concat());
            for property in suite.descendants().filter(|n| n.has_tag_name("property")) {
                has_attributes(property, (&["name", "value"], &[]));
            }
            let outcomes =
                |name: &str| cases.iter().filter(|case| names(**case).contains(&name)).count() as f64;
            for (sum, (attribute, count)) in sums.iter_mut().zip([
                ("tests", cases.len() as f64),
                ("failures", outcomes("failure")),
                ("errors", outcomes("error")),
            ]) {
                assert_eq!(number(suite, attribute), count, "{attribute}");
                *sum += count;
            }
            let time: f64 = cases.iter().map(|case| number(*case, "time")).sum();
            assert!((number(suite, "time") - time).abs() < 1e-3 * (1.0 + cases.len() as f64));
            for case in cases {
                has_attributes(case, CASE);
                let outcome: Vec<Node<'_, '_>> = case
                    .children()
                    .filter(|n| n.has_tag_name("failure") || n.has_tag_name("error"))
                    .collect();
                outcome.iter().for_each(|outcome| has_attributes(*outcome, OUTCOME));
                assert!(outcome.len() <= 1 && names(case).last() == Some(&"system-out"), "{case:?}");
                assert_eq!(names(case).len(), outcome.len() + 1);
            }
        }
        let totals = ["tests", "failures", "errors"].map(|name| number(root, name));
        assert_eq!(totals, sums);
    }

    #[test]
    fn the_file_keeps_to_the_schemas() {
        let mut report = sample::report();
        report.cases[2].device = String::new();
        report.started = "2026-11-30T22:05:07.123456Z".into();
        let text = junit(&report);
        check(&text);
        let tree = Document::parse(&text).expect("XML");
        let case = |name: &str| {
            tree.descendants()
                .find(|n| n.has_tag_name("testcase") && n.attribute("name") == Some(name))
                .unwrap_or_else(|| panic!("no case {name}"))
        };
        let child =
            |name: &str, tag: &str| case(name).children().find(|n| n.has_tag_name(tag)).expect("a child");
        assert_eq!(child("cornell", "failure").attribute("message"), Some("Red is brighter by 0.5 %."));
        assert!(
            child("cornell", "failure")
                .text()
                .is_some_and(|t| t.contains("areas of 8×8 pixels: 4.1, p 0.40 at pixel 8,16"))
        );
        assert_eq!(
            child("fog", "error").attribute("message"),
            Some("The program ended with exit code 101 & “panic”.")
        );
        assert_eq!(
            child("prism", "system-out").text(),
            Some("equal within noise: No difference beyond noise.\n")
        );
        assert_eq!(case("prism").attribute("classname"), Some("scenes.prism"));
        assert_eq!(case("fog").parent().and_then(|n| n.attribute("name")), Some("no device"));
        let devices: Vec<_> = tree
            .descendants()
            .filter(|n| n.has_tag_name("property") && n.attribute("name") == Some("device"))
            .filter_map(|n| n.attribute("value"))
            .collect();
        assert_eq!(devices, [report.cases[0].device.as_str(), "no device"]);
    }

    #[test]
    fn times_are_told_and_red_only_on_request() {
        let mut report = sample::report();
        for case in &mut report.cases {
            (case.times, case.timing) = (Some(sample::times()), Some(sample::slower()));
        }
        report.cases[3].timing = Some(CaseTiming::failed(["other", ""], "It & failed.".into()));
        let outcomes = |report: &RunReport| -> Vec<(String, String)> {
            let text = junit(report);
            check(&text);
            let tree = Document::parse(&text).expect("XML");
            let red = tree.descendants().filter(|n| n.has_tag_name("failure") || n.has_tag_name("error"));
            let attribute = |n: Node<'_, '_>, name: &str| n.attribute(name).unwrap_or_default().to_owned();
            red.map(|n| (attribute(n, "type"), attribute(n, "message"))).collect()
        };
        let kinds =
            |report: &RunReport| outcomes(report).into_iter().map(|(kind, _)| kind).collect::<Vec<_>>();
        assert_eq!(kinds(&report), ["changed", "broken"]);
        report.fail_on_slower = Some(50.0);
        assert_eq!(kinds(&report), ["changed", "broken", "not timed"]);
        report.fail_on_slower = Some(10.0);
        // A changed case is red for its picture; what its times say is among the details.
        assert_eq!(kinds(&report), ["changed", "slower", "broken", "not timed"]);
        let all = outcomes(&report);
        assert!(all[1].1.starts_with("slower: rendering +30") && all[3].1 == "It & failed.", "{all:?}");
        let text = junit(&report);
        for part in ["GPU pass splat: 1.5 ms", "time against &lt;other&gt;: slower", "0.25 s for a rendering"]
        {
            assert!(text.contains(part), "{part}: {text}");
        }
        if let Some(name) = machine_name() {
            let tree = Document::parse(&text).expect("XML");
            let suite = tree.descendants().find(|n| n.has_tag_name("testsuite"));
            assert_eq!(suite.and_then(|n| n.attribute("hostname")), Some(name.as_str()));
        }
    }

    #[test]
    fn no_text_breaks_the_file() {
        let mut report = sample::report();
        report.fail_on_slower = Some(0.0);
        report.version = sample::HOSTILE.into();
        for (i, case) in report.cases.iter_mut().enumerate() {
            (case.name, case.sentence) = (format!("{i}{}", sample::HOSTILE), sample::HOSTILE.into());
            (case.device, case.method) = (sample::HOSTILE.into(), sample::HOSTILE.into());
            case.command = vec![sample::HOSTILE.into()];
            case.scene = sample::HOSTILE.into();
            let mut times = sample::times();
            times.passes[0].name = sample::HOSTILE.into();
            (times.seconds, times.passes[0].milliseconds) = (f64::NAN, f64::INFINITY);
            case.times = Some(times);
            case.timing = Some(CaseTiming::failed([sample::HOSTILE; 2], sample::HOSTILE.into()));
            case.seconds = [f64::NAN, f64::INFINITY, 1e-9, 1e9][i];
        }
        check(&junit(&report));
        report.cases.clear();
        check(&junit(&report));
    }
}
