//! The page of a scene, put together from its sections: one file, nothing fetched, nothing that has to run.

use crate::study::data::Study;
use crate::study::pages::escape::{short, xml};
use crate::study::pages::number::seconds_of;
use crate::study::pages::plot::STYLE;
use crate::study::pages::sections::{
    answer, convergence, display, effects, numeric, origin, predictions, prices, stability,
};
use crate::study::pages::verdict;

/// How the page looks.
const PAGE: &str = include_str!("style.css");

/// The page of a study: HTML that is XML as well, with all pictures inside.
pub fn html(study: &Study) -> String {
    let name = verdict::name(study);
    let mut body = format!(
        "<header>\n<h1>{}</h1>\n<p class=\"dim\">{}</p>\n</header>\n",
        xml(&name),
        xml(&under(study))
    );
    body += &answer::html(study);
    body += CONTENTS;
    body += &convergence::html(study);
    body += &prices::html(study);
    body += &effects::html(study);
    body += &display::html(study);
    body += &numeric::html(study);
    body += &predictions::html(study);
    body += &stability::html(study);
    body += &origin::html(study);
    page(&format!("{}: what accuracy costs in time", short(&name, 80)), &body)
}

const CONTENTS: &str = "<nav><a href=\"#convergence\">1 Convergence</a> <a href=\"#prices\">2 Prices</a> \
    <a href=\"#effects\">3 Effects</a> <a href=\"#display\">4 Display</a> <a href=\"#numeric\">5 Numeric choices</a> \
    <a href=\"#predictions\">6 Predictions</a> <a href=\"#stability\">7 Stability</a> <a href=\"#origin\">Machine</a></nav>\n";

/// The line under the title.
fn under(study: &Study) -> String {
    let m = &study.machine;
    let mut parts = vec!["What accuracy costs in time".to_string()];
    if study.size != [0, 0] {
        parts.push(format!("{} × {} pixels", study.size[0], study.size[1]));
    }
    let threads = if m.threads == 0 { String::new() } else { format!("{} threads of ", m.threads) };
    if !m.cpu.is_empty() {
        parts.push(format!("{threads}{}", m.cpu));
    }
    parts.extend([&m.device, &m.program, &m.date].into_iter().filter(|s| !s.is_empty()).cloned());
    if let Some(seconds) = verdict::shared_seconds(study) {
        parts.push(format!("{} per method", seconds_of(seconds)));
    }
    parts.join(" · ")
}

/// A whole page around its body.
pub fn page(title: &str, body: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html xmlns=\"http://www.w3.org/1999/xhtml\" lang=\"en-GB\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
         <meta name=\"color-scheme\" content=\"light dark\"/>\n<title>{}</title>\n<style>\n{PAGE}{STYLE}</style>\n</head>\n\
         <body>\n<main>\n{body}</main>\n</body>\n</html>\n",
        xml(title)
    )
}
