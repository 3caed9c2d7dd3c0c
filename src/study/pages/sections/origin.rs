//! The end: machine, versions, reference, the command that repeats it all.

use crate::study::Interval;
use crate::study::data::Study;
use crate::study::pages::escape::xml;
use crate::study::pages::number::{count, figure, seconds_of};
use crate::study::pages::parts::{command, command_of, paragraph};

/// The section.
pub fn html(study: &Study) -> String {
    let m = &study.machine;
    let mut rows = vec![
        ("Scene", study.scene.clone()),
        ("Picture", format!("{} × {} pixels", study.size[0], study.size[1])),
        ("Processor", m.cpu.clone()),
        ("Tracing threads", if m.threads == 0 { String::new() } else { m.threads.to_string() }),
        ("Vulkan device", m.device.clone()),
        ("Driver", m.driver.clone()),
        ("Program", m.program.clone()),
        ("Date", m.date.clone()),
        ("Loading, left out of all times", seconds_of(study.load_seconds)),
    ];
    if let Some(r) = &study.reference {
        rows.push(("Reference", r.file.clone()));
        rows.push(("… made by", made_by(r)));
        let own = r.rel_mse.map_or_else(|| "unknown".into(), |e| figure(&Interval::exact(e), 1.0, "").main);
        rows.push(("… its own relMSE", own));
    }
    let peers: Vec<&str> = study.methods.iter().filter(|m| m.peer).map(|m| m.name.as_str()).collect();
    if !peers.is_empty() {
        rows.push(("Compared with", peers.join(", ")));
    }
    let row = |(name, value): &(&str, String)| {
        let value = if value.is_empty() { "unknown" } else { value };
        format!("<div><dt>{}</dt><dd>{}</dd></div>\n", xml(name), xml(value))
    };
    let list: String = rows.iter().map(row).collect();
    let mut body = format!("<dl>\n{list}</dl>\n");
    if !study.missing.is_empty() {
        body += &paragraph(&format!("Asked for and not there yet: {}.", study.missing.join("; ")));
    }
    format!(
        "<section id=\"origin\">\n<h2>Machine and command</h2>\n{body}<p>To repeat it, or to go on where it stopped:</p>\n{}</section>\n",
        command(&command_of(study))
    )
}

/// How the reference was made.
pub fn made_by(r: &crate::study::data::Reference) -> String {
    let mut text = r.made_by.clone();
    if r.samples_per_pixel > 0.0 {
        text += &format!(", {} samples per pixel", count(r.samples_per_pixel));
    }
    if r.seconds > 0.0 {
        text += &format!(", {}", seconds_of(r.seconds));
    }
    text
}
