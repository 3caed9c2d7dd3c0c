//! The plots of part 1: error against seconds and against samples, bias and noise.

use crate::study::Interval;
use crate::study::data::{Method, Point, Study};
use crate::study::pages::number::{THIN, clean, count, percent, root, seconds_of};
use crate::study::pages::plot::lines::{extension, note};
use crate::study::pages::plot::{Dot, Lines, Look, Series, looks};
use crate::study::pages::verdict;

/// What is drawn upwards.
fn series(
    m: &Method,
    look: Look,
    x: impl Fn(&Point) -> f64,
    y: impl Fn(&Point) -> Option<Interval>,
) -> Series {
    let dot = |p: &Point| {
        let y = y(p)?;
        let samples = match p.samples_per_pixel {
            n if n > 0.0 => format!(", {} samples per pixel", count(n)),
            _ => String::new(),
        };
        let text = note(&format!("{}{samples}", seconds_of(p.seconds)), &percent(&y).prose());
        Some(Dot { x: x(p), y, note: text })
    };
    let mut dots: Vec<Dot> = m.points.iter().filter_map(dot).collect();
    dots.sort_by(|a, b| a.x.total_cmp(&b.x));
    Series { name: m.name.clone(), look, dots, beyond: Vec::new(), marked: false, thin: false }
}

fn each(study: &Study, make: impl Fn(&Method, Look) -> Series) -> Vec<Series> {
    let all = study.methods.iter().zip(looks(&study.methods)).map(|(m, look)| make(m, look));
    all.filter(|s| !s.dots.is_empty()).collect()
}

/// Error at 95 % of the picture against seconds; dotted on to the prices that were not measured.
pub fn at_most(study: &Study) -> Lines {
    let make = |m: &Method, look| {
        let mut s = series(m, look, |p| p.seconds, |p| clean(&p.relative.as_ref()?[1]));
        let last = s.dots.last().map(|d| [d.x, d.y.value]);
        let mut far: Vec<[f64; 2]> = m
            .prices
            .iter()
            .filter(|p| !p.measured)
            .filter_map(|p| Some([verdict::price(m, p.error)?.1.value, p.error]))
            .filter(|far| last.is_some_and(|[x, y]| far[0] > x && far[1] < y && far[0] < 200.0 * x))
            .collect();
        far.sort_by(|a, b| a[0].total_cmp(&b[0]));
        s.marked = !far.is_empty();
        s.beyond = if far.is_empty() { far } else { last.into_iter().chain(far).collect() };
        s
    };
    Lines {
        label: format!("Relative error at 95{THIN}% of the picture against seconds"),
        x_name: "seconds".into(),
        y_name: format!("relative error that 95{THIN}% of the picture stays below"),
        series: each(study, make),
        targets: verdict::errors(&study.methods),
    }
}

/// Root of relMSE against seconds, of all methods and peers, with the fitted slope.
pub fn overall(study: &Study) -> Lines {
    let end = study.methods.iter().flat_map(|m| m.points.last()).map(|p| p.seconds).fold(0.0, f64::max) * 4.0;
    let make = |m: &Method, look| {
        let mut s = series(m, look, |p| p.seconds, |p| root(&p.rel_mse));
        s.beyond = extension(&s.dots, m.slope.as_ref().filter(|_| !m.biased), end);
        s
    };
    Lines {
        label: "Relative root mean square error against seconds".into(),
        x_name: "seconds".into(),
        y_name: "relative RMS error of the picture".into(),
        series: each(study, make),
        targets: Vec::new(),
    }
}

/// The same against samples per pixel.
pub fn by_samples(study: &Study) -> Lines {
    let end =
        study.methods.iter().flat_map(|m| m.points.last()).map(|p| p.samples_per_pixel).fold(0.0, f64::max)
            * 2.0;
    let make = |m: &Method, look| {
        let mut s = series(m, look, |p| p.samples_per_pixel, |p| root(&p.rel_mse));
        s.beyond = extension(&s.dots, m.slope_samples.as_ref().filter(|_| !m.biased), end);
        s
    };
    Lines {
        label: "Relative root mean square error against samples per pixel".into(),
        x_name: "samples (paths) per pixel".into(),
        y_name: "relative RMS error of the picture".into(),
        series: each(study, make),
        targets: Vec::new(),
    }
}

/// Bias and noise of the methods that are biased, as roots.
pub fn bias(study: &Study) -> Lines {
    let mut all = Vec::new();
    for (m, look) in study.methods.iter().zip(looks(&study.methods)).filter(|(m, _)| verdict::biased(m)) {
        let mut off = series(m, look, |p| p.seconds, |p| root(p.bias.as_ref()?));
        off.name = format!("{}: bias", m.name);
        let mut noise = series(m, look, |p| p.seconds, |p| root(p.noise.as_ref()?));
        (noise.name, noise.thin) = (format!("{}: noise", m.name), true);
        noise.look.hollow = true;
        all.extend([off, noise]);
    }
    Lines {
        label: "Bias and noise against seconds".into(),
        x_name: "seconds".into(),
        y_name: "root of the mean square, relative".into(),
        series: all,
        targets: Vec::new(),
    }
}
