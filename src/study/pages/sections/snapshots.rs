//! Part 1, continued: the same methods after 1/30, 1/3, 3 and 30 seconds, as in the paper's Figures 3 and 4.

use crate::study::data::{Method, Point, Study};
use crate::study::measured::FIGURES;
use crate::study::pages::escape::{picture, xml};
use crate::study::pages::number::{THIN, percent, plain};
use crate::study::pages::parts::{heading, list, method, note};
use crate::study::pages::plot::{Look, looks};
use crate::study::pages::verdict;

/// A row of pictures per method; nothing if there are none.
pub fn html(study: &Study) -> String {
    let rows: Vec<String> =
        study.methods.iter().zip(looks(&study.methods)).filter_map(|(m, look)| row(m, look)).collect();
    if rows.is_empty() {
        return String::new();
    }
    let seen = |seconds: f64| study.methods.iter().any(|m| at(m, seconds).is_some());
    let late: Vec<String> = FIGURES.into_iter().filter(|&seconds| !seen(seconds)).map(name).collect();
    let mut text = "The displayed picture, its error at 95 % of the picture, and its FLIP.".to_string();
    if !late.is_empty() {
        text += &format!(" {} did not fit into the budget.", list(&late));
    }
    heading("As time goes on") + &rows.concat() + &note(&text)
}

/// The pictures of a method, `None` if it has none.
fn row(m: &Method, look: Look) -> Option<String> {
    let cells: String =
        FIGURES.into_iter().filter_map(|seconds| cell(&m.name, seconds, at(m, seconds)?)).collect();
    (!cells.is_empty()).then(|| {
        format!("<p class=\"dim\">{}</p>\n<div class=\"snapshots\">\n{cells}</div>\n", method(&m.name, look))
    })
}

/// The point of a time, if it has a picture.
fn at(m: &Method, seconds: f64) -> Option<&Point> {
    m.points.iter().find(|point| point.budget == seconds && point.picture.is_some())
}

fn cell(of: &str, seconds: f64, point: &Point) -> Option<String> {
    let uri = picture(point.picture.as_deref()?)?;
    let error = verdict::error_of(point).map_or_else(String::new, |e| format!(": {}", percent(&e).main));
    Some(format!(
        "<figure><img src=\"{}\" alt=\"{}\"/><figcaption>{}{}, FLIP {}</figcaption></figure>\n",
        xml(uri),
        xml(&format!("{of} after {}", name(seconds))),
        xml(&name(seconds)),
        xml(&error),
        plain(point.flip.value, 2),
    ))
}

/// `1/30 s`.
fn name(seconds: f64) -> String {
    match seconds {
        s if s < 1.0 => format!("1/{:.0}{THIN}s", 1.0 / s),
        s => format!("{s:.0}{THIN}s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::pages::sample;

    #[test]
    fn the_times_of_the_paper_stand_side_by_side() {
        let mut study = sample::study();
        let text = html(&study);
        for time in ["1/30", "1/3", "3", "30"] {
            assert!(text.contains(&format!("path after {time}{THIN}s")), "{time}: {text}");
        }
        assert!(!text.contains("did not fit"));
        for m in &mut study.methods {
            m.points.retain(|p| p.budget < 3.0);
        }
        let text = html(&study);
        assert!(text.contains(&format!("3{THIN}s and 30{THIN}s did not fit")), "{text}");
        study.methods.clear();
        assert_eq!(html(&study), "");
    }
}
