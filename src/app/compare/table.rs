//! The figures for people.

use std::fmt::Write;

use super::{Compared, Figure, Side};

/// One line for each figure, then what is to be known about the pictures and the map.
pub fn table(compared: &Compared<'_>, notes: &[String]) -> String {
    let mut out = String::new();
    let worst: Vec<String> = compared.metrics.iter().map(worst).collect();
    let width = worst.iter().map(|w| w.chars().count()).chain([11]).max().unwrap_or(0);
    // Writing to a string does not fail.
    let _ = writeln!(out, "{:<9}{:<12}{:<width$}  MEANING", "METRIC", "VALUE", "WORST PIXEL");
    for (figure, worst) in compared.metrics.iter().zip(&worst) {
        let value = number(figure.value);
        let _ = writeln!(out, "{:<9}{value:<12}{worst:<width$}  {}", figure.metric, figure.meaning);
        if !figure.details.is_empty() {
            let details: Vec<String> = figure.details.iter().map(|(k, v)| detail(k, *v)).collect();
            let _ = writeln!(out, "{:<9}{}", "", details.join(", "));
        }
    }
    for left_out in compared.left_out {
        let _ = writeln!(out, "{:<9}{:<12}{}", left_out.metric, "–", left_out.reason);
    }
    for side in [&compared.picture, &compared.reference] {
        out += &about(side);
    }
    for note in notes {
        let _ = writeln!(out, "{note}");
    }
    out
}

/// What is unusual about a file.
fn about(side: &Side<'_>) -> String {
    let mut out = String::new();
    if !side.layer.is_empty() {
        let _ = writeln!(out, "{}: layer {}", side.file.display(), side.layer);
    }
    if side.not_finite > 0 {
        let plural = if side.not_finite == 1 { " is" } else { "s are" };
        let (file, n) = (side.file.display(), side.not_finite);
        let _ = writeln!(out, "{file}: {n} pixel{plural} not finite; they count as wrong");
    }
    out
}

fn worst(figure: &Figure) -> String {
    let Some(pixel) = figure.worst else { return "none".to_owned() };
    format!("{} at {},{}", number(f64::from(pixel.value)), pixel.x, pixel.y)
}

fn detail(name: &str, value: f64) -> String {
    let name = name.replace('_', " ").replace("z2", "z²");
    // Counts as they are.
    if value.fract() == 0.0 && value.abs() < 1e15 {
        format!("{name} {value}")
    } else {
        format!("{name} {}", number(value))
    }
}

/// Four significant digits.
fn number(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        v if !v.is_finite() => value.to_string(),
        v if (1e-4..1e5).contains(&v) => {
            let digits = (3 - v.log10().floor() as i32).max(0) as usize;
            format!("{value:.digits$}")
        }
        _ => format!("{value:.3e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_four_digits() {
        for (value, text) in [
            (0.0, "0"),
            (0.012_345_6, "0.01235"),
            (1.0, "1.000"),
            (-12_345.6, "-12346"),
            (1.234_56e-7, "1.235e-7"),
            (2e9, "2.000e9"),
            (f64::INFINITY, "inf"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(number(value), text);
        }
        assert_eq!(detail("mean_z2", 3.0), "mean z² 3");
    }
}
