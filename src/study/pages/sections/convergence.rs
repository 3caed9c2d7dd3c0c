//! Part 1: how the error falls.

use crate::study::data::{Method, Point, Study};
use crate::study::pages::escape::xml;
use crate::study::pages::number::{Figure, THIN, count, figure, percent, root, seconds_of};
use crate::study::pages::parts::{
    cell, heading, heads, list, maybe, method, missing, more, note, plot, section, table,
};
use crate::study::pages::plot::{Lines, looks};
use crate::study::pages::sections::{curves, pictures, snapshots};
use crate::study::pages::verdict;

/// The sentence to take away.
pub fn takeaway(study: &Study) -> String {
    let Some(seconds) = verdict::shared_seconds(study) else { return "No curve has been measured.".into() };
    let own = study.methods.iter().filter(|m| !m.peer);
    let mut errors: Vec<_> =
        own.filter_map(|m| Some((m, verdict::error_of(verdict::at_time(m, seconds)?)?))).collect();
    errors.sort_by(|a, b| a.1.value.total_cmp(&b.1.value));
    let Some(((best, least), rest)) = errors.split_first() else {
        return "No curve has been measured.".into();
    };
    let mut text = format!(
        "After {}, {} is within {} at 95{THIN}% of the picture",
        seconds_of(seconds),
        best.name,
        percent(least).prose()
    );
    let others: Vec<String> =
        rest.iter().map(|(m, e)| format!("{} within {}", m.name, percent(e).main)).collect();
    text += &if others.is_empty() { ".".into() } else { format!(", {}.", list(&others)) };
    let flat: Vec<String> =
        study.methods.iter().filter(|m| verdict::flat(m)).map(|m| m.name.clone()).collect();
    if !flat.is_empty() {
        text +=
            &format!(" The error of {} falls slower than noise does (slope flatter than −0.4).", list(&flat));
    }
    text
}

/// The section.
pub fn html(study: &Study) -> String {
    let mut body = String::new();
    if study.methods.iter().all(|m| m.points.is_empty()) {
        body += &missing(study, "Curves were", "convergence");
        return section("convergence", "1  Convergence", &takeaway(study), &body);
    }
    body += &drawn(
        &curves::at_most(study),
        "Error against time, both logarithmic. Bands and bars: 90 %. Dotted, hollow markers: the curve drawn further, to the prices of part 2.",
    );
    body += &drawn(
        &curves::overall(study),
        "Root of relMSE, which every program can be measured by; it weighs the few worst pixels. Dotted: the fitted slope drawn further.",
    );
    body += &drawn(
        &curves::by_samples(study),
        "The same against samples: what a path is worth, without what it costs.",
    );
    let bias = curves::bias(study);
    if !bias.is_empty() {
        body += &drawn(
            &bias,
            "Bias (line) and noise (thin) of the methods that are off by more than noise: bias² = MSE − variance.",
        );
    }
    body += &ends(study);
    body += &slopes(study);
    body += &more("Every measured point", &points(study));
    body += &note(&how(study));
    body += &snapshots::html(study);
    body += &heading("Equal-time pictures");
    body += &pictures::html(study);
    section("convergence", "1  Convergence", &takeaway(study), &body)
}

fn drawn(lines: &Lines, caption: &str) -> String {
    if lines.is_empty() { String::new() } else { plot(&lines.label, caption, |size| lines.draw(size)) }
}

/// Where each method ended.
fn ends(study: &Study) -> String {
    let row = |(m, look): (&Method, _)| {
        let last = m.points.last()?;
        let rel = |i: usize| maybe(last.relative.as_ref().map(|r| r[i]), percent);
        Some(vec![
            method(&m.name, look),
            seconds_of(last.seconds),
            rel(0),
            rel(1),
            rel(2),
            rms(&last.rel_mse),
            rms(&last.rel_mse_trimmed),
            cell(&figure(&last.flip, 1.0, "")),
        ])
    };
    let rows: Vec<_> = study.methods.iter().zip(looks(&study.methods)).filter_map(row).collect();
    let heads = heads(&[
        "At the end of the curve",
        "time",
        "50 % within",
        "95 % within",
        "99 % within",
        "RMS error",
        "… without the worst 0.1 %",
        "FLIP",
    ]);
    table("Errors at the ends of the curves", &heads, &rows)
}

/// How fast each method's error falls, and what is to be warned of.
fn slopes(study: &Study) -> String {
    let row = |(m, look): (&Method, _)| {
        let slope = |s: &Option<crate::study::Interval>| maybe(*s, |s| figure(s, 1.0, ""));
        let mut flags = m.flags.clone();
        if flags.is_empty() && verdict::flat(m) {
            flags.push("slope flatter than −0.4: heavy tail or bias".into());
        }
        let flags = format!("<span class=\"text warn\">{}</span>", xml(&flags.join("; ")));
        vec![method(&m.name, look), slope(&m.slope), slope(&m.slope_samples), flags]
    };
    let measured = study.methods.iter().zip(looks(&study.methods)).filter(|(m, _)| !m.points.is_empty());
    let rows: Vec<_> = measured.map(row).collect();
    table(
        "Slopes of the curves",
        &heads(&["Slope of RMS error", "against seconds", "against samples", "to be wary of"]),
        &rows,
    )
}

fn points(study: &Study) -> String {
    let row = |m: &Method, look, p: &Point| {
        vec![
            method(&m.name, look),
            seconds_of(p.seconds),
            count(p.samples_per_pixel),
            p.runs.to_string(),
            rms(&p.rel_mse),
            rms(&p.rel_mse_trimmed),
            maybe(p.relative.as_ref().map(|r| r[1]), percent),
            maybe(p.noise.as_ref().and_then(root), percent),
            maybe(p.bias.as_ref().and_then(root), percent),
            cell(&figure(&p.smape, 1.0, "")),
            cell(&figure(&p.flip, 1.0, "")),
            seconds_of(p.trace_seconds),
            seconds_of(p.splat_seconds),
            seconds_of(p.display_seconds),
        ]
    };
    let each = study.methods.iter().zip(looks(&study.methods));
    let rows: Vec<_> = each.flat_map(|(m, look)| m.points.iter().map(move |p| row(m, look, p))).collect();
    let heads = heads(&[
        "Method",
        "time",
        "samples/pixel",
        "runs",
        "RMS error",
        "trimmed",
        "95 % within",
        "noise",
        "bias",
        "SMAPE",
        "FLIP",
        "tracing (CPU)",
        "splatting",
        "display",
    ]);
    table("Every measured point", &heads, &rows)
}

/// The root of a relMSE as a cell.
fn rms(rel_mse: &crate::study::Interval) -> String {
    cell(&root(rel_mse).map_or_else(Figure::none, |r| percent(&r)))
}

fn how(study: &Study) -> String {
    let runs = study.methods.iter().flat_map(|m| m.points.iter().map(|p| p.runs));
    let (least, most) = runs.fold((usize::MAX, 0), |(a, b), n| (a.min(n), b.max(n)));
    let runs = match (least, most) {
        (a, b) if a >= b => format!("{b}"),
        (a, b) => format!("{a} to {b}"),
    };
    let own = study.reference.as_ref().and_then(|r| r.rel_mse).filter(|e| e.is_finite() && *e >= 0.0);
    let own = own.map_or_else(String::new, |e| {
        format!(
            " The reference's own error (relMSE {}) is taken off.",
            figure(&crate::study::Interval::exact(e), 1.0, "").main
        )
    });
    format!(
        "relMSE = mean((x − ref)² / (ref_Y² + 0.01)) of the unblurred linear picture against the reference; plots show its root.{own} \
         “95 % within” is the relative standard error that 95 % of the picture, in areas of 8×8 pixels, stays below; it comes \
         from independent randomisations of the same index range ({runs} runs per point), never from the spread of neighbouring \
         samples. Times are wall-clock seconds of tracing and splatting; loading the scene and compiling shaders ({} here) are \
         left out. Slopes are least-squares fits of the logarithms; −0.5 is what independent noise gives.",
        seconds_of(study.load_seconds)
    )
}
