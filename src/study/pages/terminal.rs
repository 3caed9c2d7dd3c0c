//! The summary for the terminal: one screen of at most 24 lines of 100 characters.

use crate::study::Interval;
use crate::study::data::{EffectPrice, MethodResult, OptionPrice, Study};
use crate::study::format::{
    FormattedInterval, factor, goal, increase, percent_interval, seconds, with_plain_spaces, with_unit,
};
use crate::study::pages::chart::shortened;
use crate::study::pages::parts::list;
use crate::study::pages::sections::{answer, numeric, predictions, stability};
use crate::study::pages::verdict;

/// Characters in a line.
const WIDTH: usize = 100;
/// Lines.
const HEIGHT: usize = 24;

/// Number of reasons below the headline.
const REASONS: usize = 3;

/// Answer, price list, and one line per further part.
pub fn terminal(study: &Study) -> String {
    let mut lines = vec![title(study)];
    lines.extend(wrapped(&answer::headline(study)));
    // Machines, most expensive effect, runner-up.
    lines.extend(answer::reasons(study).iter().take(REASONS).flat_map(|reason| wrapped(reason)));
    lines.push(String::new());
    lines.extend(prices(study));
    lines.push(String::new());
    lines.extend(parts(study));
    let warnings = answer::warnings(study);
    let room = HEIGHT.saturating_sub(lines.len());
    let more = warnings.len().saturating_sub(room);
    for (i, warning) in warnings.iter().take(room).enumerate() {
        let last = more > 0 && i + 1 == room;
        lines.push(if last { format!("! … and {} more", more + 1) } else { format!("! {warning}") });
    }
    let line = |l: &String| shortened(with_plain_spaces(l).trim_end(), WIDTH) + "\n";
    lines.iter().map(line).collect()
}

/// Wraps a sentence to the width.
fn wrapped(sentence: &str) -> Vec<String> {
    let mut lines = vec![String::new()];
    // A number and its unit are not separated.
    for word in sentence.split(' ') {
        let last = lines.len() - 1;
        if !lines[last].is_empty() && lines[last].chars().count() + 1 + word.chars().count() > WIDTH {
            lines.push(String::new());
        }
        let last = lines.len() - 1;
        let space = if lines[last].is_empty() { "" } else { " " };
        lines[last] += &format!("{space}{word}");
    }
    lines.truncate(3);
    lines
}

fn title(study: &Study) -> String {
    let m = &study.machine;
    let threads = if m.threads == 0 { String::new() } else { format!(", {} threads", m.threads) };
    let cpu =
        if m.cpu.is_empty() { String::new() } else { format!(" · {}{threads}", shortened(&m.cpu, 40)) };
    let name = shortened(&verdict::name(study), 30);
    format!("{name} · {}×{}{cpu} · {}", study.size[0], study.size[1], m.date)
}

/// Most methods listed.
const MOST: usize = 7;

fn prices(study: &Study) -> Vec<String> {
    let mut errors = verdict::errors(&study.methods);
    errors.truncate(4);
    let mut head = format!("{:<22}", "time to an error of");
    for error in &errors {
        head += &right(&goal(*error), 11);
    }
    head += &format!("{}{}", right("slope", 9), right("at the end", 22));
    let mut lines = vec![head];
    lines.extend(study.methods.iter().map(|m| row(m, &errors)));
    let more = lines.len().saturating_sub(1 + MOST);
    if more > 0 {
        lines.truncate(MOST);
        lines.push(format!("… and {} more", more + 1));
    }
    lines
}

fn row(m: &MethodResult, errors: &[f64]) -> String {
    let mut line = format!("{:<22}", shortened(&m.name, 21));
    for error in errors {
        let text = match verdict::price(m, *error) {
            Some((p, time)) => format!("{}{}", if p.measured { "" } else { "≈ " }, seconds(&time).main),
            None if m.prices.is_empty() => "—".into(),
            None => "not known".into(),
        };
        line += &right(&text, 11);
    }
    let slope = m.slope.map_or_else(|| "—".into(), |s| with_unit(&s, 1.0, "").main);
    let end = match verdict::error_now(m) {
        Some((error, at)) => {
            format!("{} at {}", percent_interval(&error).main, seconds(&Interval::exact(at)).main)
        }
        None => "—".into(),
    };
    line + &right(&slope, 9) + &right(&end, 22)
}

fn parts(study: &Study) -> Vec<String> {
    let priced = study.effects.iter().filter(|e| e.on).filter_map(|e| Some((e, e.time?)));
    let mut effects: Vec<_> = priced.filter(|(_, time)| time.value.is_finite()).collect();
    effects.sort_by(|a, b| b.1.value.total_cmp(&a.1.value));
    let cost =
        |(e, time): &(&EffectPrice, Interval)| format!("{} {}", shortened(&e.name, 20), increase(time).main);
    let costs: Vec<String> = effects.iter().take(4).map(cost).collect();
    let mut lines = Vec::new();
    if !costs.is_empty() {
        let unused = study.unused_effects.as_ref().map_or_else(FormattedInterval::none, factor);
        lines.push(format!("Effects      {}", list(&costs)));
        let what = "effects not used: specialised code";
        lines.push(format!("             {what} {unused} as fast as the general code"));
    }
    if let Some(auto) = &study.auto {
        let trial = seconds(&Interval::exact(auto.seconds)).main;
        lines.push(format!("Auto         takes {} after a trial of {trial}", auto.method));
    }
    let change = |o: &OptionPrice| Some(format!("{} error {}", o.name, factor(&o.error?).main));
    let options: Vec<String> = study.options.iter().filter_map(change).collect();
    if !options.is_empty() {
        lines.push(format!("Options      {}", list(&options)));
    }
    let defaults = study.display.iter().filter(|d| d.default && !d.per_sample).filter_map(|d| d.milliseconds);
    if let Some(ms) = defaults.max_by(|a, b| a.value.total_cmp(&b.value)) {
        lines.push(format!("Display      {} per repaint with the defaults", with_unit(&ms, 1.0, " ms")));
    }
    if !study.numeric.is_empty() {
        lines.push(format!("Arithmetic   {}", numeric::summary(study)));
    }
    let pictures: usize = study.stated.iter().map(|s| s.pictures).sum();
    let errors: usize = study.stated.iter().map(|s| s.held[1]).sum();
    let predicted = study.predictions.as_ref().map_or([0; 2], |p| [p.held, p.known]);
    let held = |[held, known]: [usize; 2], what: &str| {
        let share = Interval::of_share(held, known).as_ref().map(percent_interval)?;
        Some(format!("{held} of {known} {what}, {share}"))
    };
    let all = [held(predicted, "predictions"), held([errors, pictures], "stated errors")];
    let all: Vec<String> = all.into_iter().flatten().collect();
    if study.predictions.as_ref().is_some_and(|p| p.known == 0) {
        lines.push(format!("Predictions  {}", predictions::conclusion(study)));
    }
    if !all.is_empty() {
        lines.push(format!("90 % held    {}", list(&all)));
    }
    if !study.stability.is_empty() {
        lines.push(format!("Stability    {}", stability::summary(study)));
    }
    lines
}

fn right(text: &str, width: usize) -> String {
    let text = with_plain_spaces(text);
    format!("{}{text}", " ".repeat(width.saturating_sub(text.chars().count()).max(1)))
}
