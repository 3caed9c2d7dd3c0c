//! What the outputs say, and that nothing in a study breaks them.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

use super::sections::{answer, convergence, effects, pictures, predictions, prices, stability};
use super::{convergence_svg, csv, effects_svg, html, index, prices_svg, sample, terminal};
use crate::study::Interval;
use crate::study::data::*;

/// Parses a page or a drawing as XML.
fn parses(text: &str) {
    let xml = text.strip_prefix("<!DOCTYPE html>\n").unwrap_or(text);
    let tree =
        roxmltree::Document::parse(xml).unwrap_or_else(|e| panic!("{e}:\n{}", &xml[..xml.len().min(2000)]));
    for node in tree.descendants().filter(|n| n.is_element()) {
        for attribute in
            node.attributes().filter(|a| ["d", "x", "y", "cx", "x1", "width"].contains(&a.name()))
        {
            let bad = ["NaN", "inf"].iter().any(|b| attribute.value().contains(b));
            assert!(!bad, "{}=\"{}\"", attribute.name(), attribute.value());
        }
        let fetched = ["src", "href"].iter().filter_map(|a| node.attribute(*a)).any(|u| u.contains("://"));
        assert!(!fetched && !node.has_tag_name("script"), "{:?} fetches or runs something", node.tag_name());
    }
}

/// All outputs of a study, checked.
fn all(study: &Study) {
    for text in [
        html(study),
        convergence_svg(study),
        prices_svg(study),
        effects_svg(study),
        index(&[("a.html".into(), study)]),
    ] {
        parses(&text);
    }
    let table = terminal(study);
    assert!(table.lines().count() <= 24, "{table}");
    assert!(table.lines().all(|l| l.chars().count() <= 100), "{table}");
    assert_eq!(rows(&csv(study)).iter().map(Vec::len).filter(|n| *n != 14).count(), 0);
}

/// CSV read back: cells of each line.
fn rows(text: &str) -> Vec<Vec<String>> {
    let (mut rows, mut row, mut cell, mut quoted) = (vec![], vec![], String::new(), false);
    for c in text.chars() {
        match c {
            '"' => quoted = !quoted,
            ',' if !quoted => row.push(std::mem::take(&mut cell)),
            '\n' if !quoted => {
                row.push(std::mem::take(&mut cell));
                rows.push(std::mem::take(&mut row));
            }
            c => cell.push(c),
        }
    }
    rows
}

fn plainly(text: &str) -> String {
    text.replace(['\u{202f}', '\u{a0}'], " ")
}

#[test]
fn a_full_study_is_well_formed() {
    all(&sample::study());
}

#[test]
fn sentences_follow_from_the_figures() {
    let mut study = sample::study();
    assert_eq!(
        plainly(&answer::headline(&study)),
        "Use bidirectional: 1 % at 95 % of the picture in about 52 s (90 %: 46–58)."
    );
    let reasons = plainly(&answer::reasons(&study).join("\n"));
    assert!(reasons.contains("Runner-up: photon, × 1.5 (90 %: 1.3–1.8) of its time."), "{reasons}");
    assert!(reasons.contains("For 5 % already, photon is sooner"), "{reasons}");
    assert!(
        reasons.contains("Mitsuba 3.9.1 path needs × 11 (90 %: 9–14) of its time for the same relMSE."),
        "{reasons}"
    );
    assert!(reasons.contains("Dearest effect: transmission, +31 %"), "{reasons}");
    assert!(answer::caveats(&study)[0].starts_with("photon: slope flatter than −0.4"));
    assert!(plainly(&prices::takeaway(&study)).contains("path 4.7 min"), "{}", prices::takeaway(&study));
    assert!(
        plainly(&prices::takeaway(&study)).contains("to halve 1 % takes 2.6 min"),
        "{}",
        prices::takeaway(&study)
    );
    assert!(
        convergence::takeaway(&study).contains("bidirectional is within"),
        "{}",
        convergence::takeaway(&study)
    );
    assert!(effects::takeaway(&study).contains("costs nothing: as planned"));
    assert!(pictures::takeaway(&study).unwrap().contains("bidirectional has the least error in"));
    assert!(predictions::takeaway(&study).ends_with("as often as stated."));
    assert!(plainly(&stability::takeaway(&study)).starts_with("2 of 84 M paths"));
    // Other figures, other sentences.
    study.methods[0].prices[2].seconds = Some(Interval::exact(3.0));
    study.methods[0].prices[2].measured = true;
    assert_eq!(plainly(&answer::headline(&study)), "Use path: 1 % at 95 % of the picture in 3.00 s.");
    study.predictions = Some(PredictionScore { known: 100, held: 50, open: 0, ratio: 1.0 });
    assert!(predictions::takeaway(&study).contains("too narrow"));
    study.unused_effects = Some(Interval { value: 0.9, low: 0.88, high: 0.92 });
    assert!(effects::takeaway(&study).contains("is not free"));
    for method in &mut study.methods {
        method.prices.truncate(1);
    }
    assert!(plainly(&answer::headline(&study)).starts_with("Use photon: 5 % at 95 %"));
    assert!(answer::reasons(&study)[0].starts_with("No curve tells when 1"));
}

#[test]
fn what_is_missing_is_said() {
    let study = Study { missing: vec!["effects".into()], ..Study::default() };
    all(&study);
    let page = html(&study);
    assert!(page.contains("Nothing has been measured yet."));
    assert!(page.contains("asked for and not finished (effects)"));
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
    assert!(!html(&study).contains("<script") && !html(&study).contains("javascript:"));
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
                    (p.rel_mse, p.rel_mse_trimmed) = (interval, interval);
                    (p.noise, p.bias, p.relative) = (Some(interval), Some(interval), Some([interval; 3]));
                    (p.smape, p.flip) = (Interval::exact(bad), Interval::exact(bad));
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
    study.regions = Some(Regions { seconds: 1.0, grid: [usize::MAX, 3], winner: vec![99], margin: vec![] });
    all(&study);
    study.regions = Some(Regions { seconds: 1.0, grid: [1, 1], winner: vec![99], margin: vec![] });
    study.methods =
        (0..40).map(|i| Method { name: format!("method {i}"), ..study.methods[i % 4].clone() }).collect();
    study.missing = (0..40).map(|i| format!("part {i}")).collect();
    all(&study);
}

#[test]
fn the_terminal_has_the_answer_and_the_prices() {
    let table = terminal(&sample::study());
    assert!(
        table.contains("Use bidirectional: 1 % at 95 % of the picture in about 52 s (90 %: 46–58)."),
        "{table}"
    );
    for word in [
        "Mitsuba 3.9.1 path",
        "beyond",
        "≈ 52 s",
        "Predictions  52 of 57",
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
    study.methods[0].points[0].rel_mse = Interval { value: 1.234_567_890_123e-7, low: f64::NAN, high: 1e300 };
    let rows = rows(&csv(&study));
    let column = |name: &str| rows[0].iter().position(|h| h == name).unwrap();
    let (part, figure, value, low, high) =
        (column("part"), column("figure"), column("value"), column("low"), column("high"));
    let first = rows.iter().find(|r| r[figure] == "rel_mse").unwrap();
    assert_eq!(first[value].parse::<f64>().unwrap(), 1.234_567_890_123e-7);
    assert_eq!((first[low].as_str(), first[high].parse::<f64>().unwrap()), ("", 1e300));
    assert_eq!(first[column("subject")], "a, b", "quotation marks are doubled; this reader drops them");
    assert_eq!(rows.iter().filter(|r| r[part] == "price").count(), 12);
    for row in &rows[1..] {
        for i in [value, low, high] {
            assert!(row[i].is_empty() || row[i].parse::<f64>().is_ok(), "{row:?}");
        }
    }
}

#[test]
fn drawings_alone_know_light_and_dark() {
    let study = sample::study();
    for svg in [convergence_svg(&study), prices_svg(&study), effects_svg(&study)] {
        assert!(
            svg.starts_with("<svg xmlns=")
                && svg.contains("prefers-color-scheme: dark")
                && svg.contains("class=\"paper\"")
        );
    }
    assert_eq!(
        html(&study).matches("prefers-color-scheme: dark").count(),
        2,
        "one for the page, one for its plots"
    );
}
