//! The outputs show the right values, and nothing in a study breaks them.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

use super::sections::{answer, convergence, effects, pictures, predictions, prices, stability};
use super::{csv, html, index, sample, svg_files, terminal};
use crate::study::Interval;
use crate::study::data::*;
use crate::study::format::with_plain_spaces;

/// A page has no script, fetches nothing, and has no number that is none.
fn check_page(page: &str) {
    assert!(page.starts_with("<!DOCTYPE html>") && page.ends_with("</html>\n"));
    for fetched in
        ["<script", "src=\"http", "href=\"http", "url(http", "@import", "javascript:", "NaN\"", "\"inf"]
    {
        assert!(!page.contains(fetched), "{fetched}");
    }
}

/// A drawing is XML without numbers that SVG does not know.
fn check_svg(svg: &str) {
    let tree = roxmltree::Document::parse(svg).unwrap_or_else(|e| panic!("{e}:\n{svg}"));
    for attribute in tree.descendants().flat_map(|n| n.attributes()) {
        let numeric = ["d", "x", "y", "width", "transform"].contains(&attribute.name());
        let bad = ["NaN", "inf"].iter().any(|b| attribute.value().contains(b));
        assert!(!(numeric && bad), "{attribute:?}");
    }
    assert!(
        svg.starts_with("<svg xmlns=")
            && svg.contains("prefers-color-scheme: dark")
            && svg.contains("class=\"paper\"")
    );
}

/// All outputs of a study, checked.
fn all(study: &Study) {
    check_page(&html(study));
    check_page(&index(&[("a.html".into(), study)]));
    svg_files(study).iter().for_each(|(_, svg)| check_svg(svg));
    let table = terminal(study);
    assert!(table.lines().count() <= 24, "{table}");
    assert!(table.lines().all(|l| l.chars().count() <= 100), "{table}");
    rows(&csv(study));
}

/// CSV read back: cells of each line, which must be equally many.
fn rows(text: &str) -> Vec<::csv::StringRecord> {
    let mut reader = ::csv::ReaderBuilder::new().has_headers(false).from_reader(text.as_bytes());
    reader.records().map(|record| record.unwrap()).collect()
}

#[test]
fn a_full_study_has_all_outputs() {
    let study = sample::study();
    all(&study);
    let page = html(&study);
    assert_eq!(page.matches("prefers-color-scheme: dark").count(), 2);
    for part in ["class=\"chart wide\"", "class=\"regions\"", "At the end of the curve"] {
        assert!(page.contains(part), "{part}");
    }
}

#[test]
fn sentences_follow_from_the_figures() {
    let mut study = sample::study();
    assert_eq!(
        with_plain_spaces(&answer::headline(&study)),
        "Use bidirectional: 95 % of the picture is within 5 % after 2.1 s (90 %: 1.9–2.3) and within 1 % after about 52 s (90 %: 46–58)."
    );
    let reasons = with_plain_spaces(&answer::reasons(&study).join("\n"));
    assert!(reasons.contains("Runner-up: photon takes × 1.5 (90 %: 1.3–1.8) as long."), "{reasons}");
    assert!(reasons.contains("For a preview at 5 %, photon is faster"), "{reasons}");
    assert!(
        reasons.contains("Mitsuba 3.9.1 path takes × 11 (90 %: 9–14) as long for the same relMSE."),
        "{reasons}"
    );
    assert!(
        reasons.contains("Without transmission, paths by bidirectional would take 24 % less time."),
        "{reasons}"
    );
    assert!(reasons.contains("On machines such as this one, 1 % takes 14 s on 4 and"), "{reasons}");
    assert!(
        reasons.contains("--integrator auto takes path after a trial of 0.40 s, which takes × "),
        "{reasons}"
    );
    assert!(answer::warnings(&study)[0].starts_with("photon: slope flatter than −0.4"));
    assert!(
        with_plain_spaces(&prices::conclusion(&study)).contains("path 4.7 min"),
        "{}",
        prices::conclusion(&study)
    );
    assert!(
        with_plain_spaces(&prices::conclusion(&study)).contains("halving an error of 1 % takes 2.6 min"),
        "{}",
        prices::conclusion(&study)
    );
    assert!(
        convergence::conclusion(&study).contains("bidirectional is within"),
        "{}",
        convergence::conclusion(&study)
    );
    assert!(effects::conclusion(&study).contains("cost nothing: the specialised code"));
    assert!(pictures::conclusion(&study).unwrap().contains("bidirectional has the least error in"));
    assert!(predictions::conclusion(&study).ends_with("as often as stated."));
    assert!(with_plain_spaces(&stability::conclusion(&study)).starts_with("2 of 84 M paths"));
    // Other figures, other sentences.
    study.methods[0].prices[2].seconds = Some(Interval::exact(3.0));
    study.methods[0].prices[2].measured = true;
    let headline = with_plain_spaces(&answer::headline(&study));
    assert!(headline.starts_with("Use path: 95 % of the picture is within 5 % after 11"), "{headline}");
    assert!(headline.ends_with(" and within 1 % after 3.00 s."), "{headline}");
    study.predictions = Some(PredictionScore { known: 100, held: 50, open: 0, ratio: 1.0 });
    assert!(predictions::conclusion(&study).contains("too narrow"));
    study.unused_effects = Some(Interval { value: 0.9, low: 0.88, high: 0.92 });
    assert!(effects::conclusion(&study).contains("are not free"));
    for method in &mut study.methods {
        method.prices.truncate(1);
    }
    assert!(
        with_plain_spaces(&answer::headline(&study))
            .starts_with("Use photon: 95 % of the picture is within 5 %")
    );
    assert!(answer::reasons(&study).iter().any(|reason| reason.starts_with("Nothing tells when 1")));
    // A difference that chance does not explain.
    study.stability[1].alarm = true;
    assert!(
        answer::warnings(&study)
            .iter()
            .any(|w| w.starts_with("bidirectional: the picture's mean brightness is"))
    );
    assert!(stability::conclusion(&study).contains("bidirectional differs by more than chance"));
}

#[test]
fn what_is_missing_is_said() {
    let study = Study { missing: vec!["effects".into()], ..Study::default() };
    all(&study);
    let page = html(&study);
    assert!(page.contains("Nothing has been measured yet."));
    assert!(page.contains("requested but not finished (effects)"));
    assert!(page.contains("pointillist study SCENE.xml"));
    assert!(index(&[]).contains("No scene has been studied yet."));
}

#[test]
fn names_cannot_break_out() {
    let mut study = sample::study();
    let bad = "<script>alert('x')</script>&\"\u{0}\u{1b}[31m".repeat(8);
    study.scene = format!("{bad}.xml");
    study.machine.cpu = bad.clone();
    study.command = bad.clone();
    study.methods[0].name = bad.clone();
    study.methods[1].flags = vec![bad.clone()];
    study.methods[0].picture = Some("javascript:alert(1)".into());
    study.effects[0].name = bad.clone();
    study.effects[0].reason = bad.clone();
    study.display[0].knob = bad.clone();
    study.numeric[0].choice = bad.clone();
    study.stability[1].rejected[0] = (bad.clone(), 1, bad.clone());
    study.missing = vec![bad];
    all(&study);
}

#[test]
fn figures_cannot_break_anything() {
    let edges = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -1.0, 1e300, -1e300, 1e-300, 5e-324];
    for bad in edges {
        for interval in [
            Interval::exact(bad),
            Interval { value: 1.0, low: bad, high: bad },
            Interval { value: bad, low: 1.0, high: 2.0 },
        ] {
            let mut study = sample::study();
            for m in &mut study.methods {
                (m.slope, m.slope_samples, m.efficiency) = (Some(interval), Some(interval), Some(interval));
                for p in m.points.iter_mut().skip(1) {
                    (p.rel_mse, p.rel_mse_trimmed) = (Some(interval), Some(interval));
                    (p.noise, p.bias, p.relative) = (Some(interval), Some(interval), Some([interval; 3]));
                    (p.smape, p.flip) = (Some(Interval::exact(bad)), Some(Interval::exact(bad)));
                    p.samples_per_pixel = bad;
                }
                m.points[0].seconds = bad;
                m.prices[..].iter_mut().for_each(|p| p.seconds = Some(interval));
            }
            study.methods[1].prices[1].error = bad;
            (study.effects[0].time, study.effects[0].variance, study.effects[0].loss) =
                (Some(interval), Some(bad), Some(bad));
            (study.display[0].milliseconds, study.display[0].rel_mse) = (Some(interval), Some(bad));
            (study.numeric[0].time, study.numeric[0].error) = (interval, interval);
            (study.schemes[0].error, study.unused_effects) = (interval, Some(interval));
            study.predictions = Some(PredictionScore { known: 1, held: 7, open: 0, ratio: bad });
            study.stability[0].energy = Some(interval);
            (study.options[0].paths, study.options[0].error) = (Some(bad), Some(interval));
            (study.options[0].flip, study.options[0].seconds) = (Some([bad, 0.1]), bad);
            study.farm = FarmCost { setup: bad, merge: bad };
            study.regions.as_mut().unwrap().margin.fill(bad);
            all(&study);
        }
    }
}

#[test]
fn few_and_many_and_odd_parts_are_fine() {
    let mut study = sample::study();
    study.methods.truncate(1);
    study.methods[0].points.truncate(1);
    study.methods[0].prices.clear();
    all(&study);
    study.methods[0].points.clear();
    all(&study);
    let mut study = sample::study();
    study.size = [0, 0];
    study.regions =
        Some(RegionWinners { seconds: 1.0, grid: [usize::MAX, 3], winner: vec![99], margin: vec![] });
    all(&study);
    study.regions = Some(RegionWinners { seconds: 1.0, grid: [1, 1], winner: vec![99], margin: vec![] });
    study.methods = (0..40)
        .map(|i| MethodResult { name: format!("method {i}"), ..study.methods[i % 4].clone() })
        .collect();
    study.missing = (0..40).map(|i| format!("part {i}")).collect();
    all(&study);
}

#[test]
fn the_terminal_has_the_answer_and_the_prices() {
    let table = terminal(&sample::study());
    // The answer, in lines that fit.
    let words: Vec<&str> = table.split_whitespace().collect();
    let answer = "Use bidirectional: 95 % of the picture is within 5 % after 2.1 s (90 %: 1.9–2.3) and within 1 % after about 52 s";
    assert!(words.join(" ").contains(answer), "{table}");
    for word in [
        "Mitsuba 3.9.1 path",
        "not known",
        "Without transmission",
        "Runner-up: photon",
        "≈ 52 s",
        "90 % held    52 of 57 predictions",
        "! photon: slope",
        "transmission +31 %",
    ] {
        assert!(table.contains(word), "{word}:\n{table}");
    }
}

#[test]
fn csv_reads_back_as_the_same_numbers() {
    let mut study = sample::study();
    study.methods[0].name = "a, \"b\"".into();
    study.methods[0].points[0].rel_mse =
        Some(Interval { value: 1.234_567_890_123e-7, low: f64::NAN, high: 1e300 });
    let rows = rows(&csv(&study));
    let column = |name: &str| rows[0].iter().position(|h| h == name).unwrap();
    let (part, figure, value, low, high) =
        (column("part"), column("figure"), column("value"), column("low"), column("high"));
    let first = rows.iter().find(|r| &r[figure] == "rel_mse").unwrap();
    assert_eq!(first[value].parse::<f64>().unwrap(), 1.234_567_890_123e-7);
    assert_eq!((&first[low], first[high].parse::<f64>().unwrap()), ("", 1e300));
    assert_eq!(&first[column("subject")], "a, \"b\"");
    assert_eq!(rows.iter().filter(|r| &r[part] == "price").count(), 12);
    for row in &rows[1..] {
        for i in [value, low, high] {
            assert!(row[i].is_empty() || row[i].parse::<f64>().is_ok(), "{row:?}");
        }
    }
}
