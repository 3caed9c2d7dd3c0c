//! Part 3: what each effect costs and what it is worth.

use crate::study::Interval;
use crate::study::data::{EffectPrice, Study};
use crate::study::pages::escape::{picture, xml};
use crate::study::pages::number::{THIN, clean, extra, percent_of, plain, times};
use crate::study::pages::parts::{heading, heads, maybe, missing, note, plot, section, table};
use crate::study::pages::plot::axis::label;
use crate::study::pages::plot::{Mark, Panel, Row, Rows};
use crate::study::pages::verdict;

/// The sentence to take away.
pub fn takeaway(study: &Study) -> String {
    let mut text = match verdict::dearest(study) {
        Some((effect, time)) => {
            format!("The dearest effect is {}: {} time per path.", effect.name, extra(&time).prose())
        }
        None => "No effect of this scene has a measured price.".into(),
    };
    let lost =
        study.effects.iter().filter(|e| e.on).filter_map(|e| Some((e, e.loss.filter(|l| l.is_finite())?)));
    if let Some((effect, loss)) = lost.max_by(|a, b| a.1.total_cmp(&b.1)) {
        text += &format!(" The picture loses most without {} (FLIP {}).", effect.name, plain(loss, 2));
    }
    text + &unused(study).map_or_else(String::new, |u| format!(" {u}"))
}

/// What the effects cost that the scene does not call for.
pub fn unused(study: &Study) -> Option<String> {
    let ratio = clean(study.unused_effects.as_ref()?)?;
    let cost = if ratio.value < 1.0 && !ratio.holds(1.0) { "is not free" } else { "costs nothing" };
    Some(format!(
        "What the scene does not call for {cost}: as planned, paths are traced {} as fast as by the code for everything.",
        times(&ratio).prose()
    ))
}

/// Costs of the effects that are on, dearest first; then of those that are off and were priced.
pub fn rows(study: &Study) -> Rows {
    let time = |e: &EffectPrice| e.time.as_ref().and_then(clean).map_or(f64::NEG_INFINITY, |t| t.value);
    let mut sorted: Vec<&EffectPrice> = study.effects.iter().filter(|e| priced(e)).collect();
    sorted.sort_by(|a, b| b.on.cmp(&a.on).then(time(b).total_cmp(&time(a))));
    let both = sorted.iter().any(|e| !e.on) && sorted.iter().any(|e| e.on);
    let mut last = None;
    let mut row = |e: &EffectPrice| {
        let begins = both && last != Some(e.on);
        last = Some(e.on);
        let group = if e.on { "the scene calls for" } else { "not called for: what it would cost" };
        Row {
            group: begins.then(|| group.to_string()),
            name: e.name.clone(),
            class: if e.on { "m0" } else { "n0" },
            marker: 0,
            hollow: !e.on,
            figures: vec![
                e.time.map(|t| t.map(|x| 100.0 * (x - 1.0))),
                e.variance.map(|v| Interval::exact(100.0 * v)),
                e.loss.map(Interval::exact),
            ],
        }
    };
    let rows: Vec<Row> = sorted.into_iter().map(&mut row).collect();
    let per_cent = |x: f64| format!("{}{THIN}%", label(x));
    let panel =
        |title: &str, tick, figure| Panel { title: title.into(), mark: Mark::Bar, tick, figure, base: None };
    let panels = vec![
        panel("time per path", per_cent, |i| extra(&i.map(|x| 1.0 + x / 100.0)).main),
        panel("of the variance", per_cent, |i| percent_of(i.value / 100.0)),
        panel("loss (FLIP)", label, |i| plain(i.value, 2)),
    ];
    Rows { label: "Time, share of variance and loss of picture, by effect".into(), panels, rows }
}

fn priced(e: &EffectPrice) -> bool {
    e.time.is_some() || e.variance.is_some() || e.loss.is_some()
}

/// The section.
pub fn html(study: &Study) -> String {
    let rows = rows(study);
    let mut body = String::new();
    if rows.is_empty() {
        body += &missing(study, "Prices of effects were", "effects");
    } else {
        body += &plot(
            &rows.label,
            "Time of a path with the effect over the time without; share of the variance that it brings (negative: less noise with \
             it); how visibly the picture changes without it.",
            |size| rows.draw(size),
        );
    }
    body += &list(study);
    body += &pictures(study);
    if !study.effects.is_empty() {
        body += &note(
            "An effect is left out of the scene before it is made ready, with the code for it; time per path is measured with and \
             without in turn, and the ratio is taken pair by pair. Variance is compared at equal numbers of paths, and so \
             is loss: by how much the mean FLIP against the reference grows without the effect. Noise hides small losses. What the scene does not call for is checked by the speed \
             of a program with all of it over that of one without.",
        );
    }
    section("effects", "3  Price of each effect", &takeaway(study), &body)
}

fn list(study: &Study) -> String {
    let row = |e: &EffectPrice| {
        vec![
            xml(&e.name),
            if e.on { "on".into() } else { "<span class=\"dim\">off</span>".into() },
            maybe(e.time, extra),
            e.variance.map_or_else(|| "—".into(), percent_of),
            e.loss.map_or_else(|| "—".into(), |l| plain(l, 2)),
            format!("<span class=\"text\">{}</span>", xml(&e.reason)),
        ]
    };
    let rows: Vec<_> = study.effects.iter().map(row).collect();
    table(
        "Prices of effects",
        &heads(&["Effect", "plan", "time per path", "of the variance", "loss (FLIP)", "why"]),
        &rows,
    )
}

fn pictures(study: &Study) -> String {
    let one = |e: &EffectPrice| {
        let uri = picture(e.picture.as_deref()?)?;
        let loss = e.loss.map_or_else(String::new, |l| format!(", FLIP {}", plain(l, 2)));
        let text = xml(&format!("without {}{loss}", e.name));
        Some(format!(
            "<figure><img src=\"{}\" alt=\"{text}\"/><figcaption>{text}</figcaption></figure>\n",
            xml(uri)
        ))
    };
    let all: String = study.effects.iter().filter_map(one).collect();
    if all.is_empty() {
        all
    } else {
        format!("{}<div class=\"pictures\">\n{all}</div>\n", heading("The picture without it"))
    }
}
