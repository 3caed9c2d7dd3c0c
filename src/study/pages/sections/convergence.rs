//! Part 1: decrease of the error with time and samples.

use maud::{Markup, html};

use crate::study::Interval;
use crate::study::data::{CurvePoint, MethodResult, Study};
use crate::study::format::{THIN, count, percent_interval, seconds_of, with_unit};
use crate::study::pages::chart::{ChartCurve, ChartPoint, CurveChart, MethodStyle, extension, styled};
use crate::study::pages::parts::{cell, curves, details, list, listing, maybe, method, missing, note};
use crate::study::pages::sections::pictures;
use crate::study::pages::verdict;

pub fn conclusion(study: &Study) -> String {
    let shared = verdict::shared_seconds(study);
    let error = |m| Some((m, verdict::error_of(verdict::at_time(m, shared?)?)?));
    let mut errors: Vec<(&MethodResult, Interval)> =
        verdict::own(study).into_iter().filter_map(error).collect();
    errors.sort_by(|a, b| a.1.value.total_cmp(&b.1.value));
    let Some(((best, least), rest)) = errors.split_first() else {
        return "No curve has been measured.".into();
    };
    let mut text = format!(
        "After {}, {} is within {} at 95{THIN}% of the picture",
        seconds_of(shared.unwrap_or_default()),
        best.name,
        percent_interval(least).prose()
    );
    let others: Vec<String> =
        rest.iter().map(|(m, e)| format!("{} within {}", m.name, percent_interval(e).main)).collect();
    text += &if others.is_empty() { ".".into() } else { format!(", {}.", list(&others)) };
    let flat: Vec<String> =
        study.methods.iter().filter(|m| verdict::flat(m)).map(|m| m.name.clone()).collect();
    if !flat.is_empty() {
        let flat = list(&flat);
        text += &format!(" The error of {flat} falls more slowly than noise does (slope flatter than −0.4).");
    }
    text
}

pub fn body(study: &Study) -> Markup {
    html! {
        @if study.methods.iter().all(|m| m.points.is_empty()) { (missing(study, "Curves were", "convergence")) }
        @else {
            (curves(&at_95_percent(study), "Error against time, both axes logarithmic. Bands and bars: 90 % intervals. Dotted with hollow \
                markers: the times of part 2 that are predicted."))
            (curves(&overall(study), "Root of relMSE, the one error that can be measured for every program; a few very bad pixels dominate \
                it. Dotted: the fitted slope, extrapolated."))
            (curves(&by_samples(study), "The same against samples: the quality of a path, regardless of its cost."))
            (curves(&bias(study), "Bias (thick) and noise (thin) of the methods whose error is more than noise: bias² = MSE − variance."))
            (last_errors(study))
            (slopes(study))
            (details("Every measured point", every_point(study)))
            (note(&how(study)))
            (pictures::html(study))
        }
    }
}

type Styled<'a> = (&'a MethodResult, MethodStyle);

fn curve(
    (m, style): Styled<'_>,
    x: impl Fn(&CurvePoint) -> f64,
    y: impl Fn(&CurvePoint) -> Option<Interval>,
) -> ChartCurve {
    let point = |p: &CurvePoint| {
        let (x, y) = (x(p), y(p)?);
        let mut note = format!("{} after {}", percent_interval(&y).prose(), seconds_of(p.seconds));
        if p.samples_per_pixel > 0.0 {
            note += &format!(", {} samples per pixel", count(p.samples_per_pixel));
        }
        Some(ChartPoint { x, y, note })
    };
    ChartCurve::new(&m.name, style, m.points.iter().filter_map(point))
}

/// Chart of the non-empty curves.
fn chart(
    label: &'static str,
    x_name: &'static str,
    y_name: &'static str,
    curves: impl Iterator<Item = ChartCurve>,
) -> CurveChart {
    let curves = curves.filter(|c| !c.points.is_empty()).collect();
    CurveChart { label, x_name, y_name, curves, targets: Vec::new() }
}

/// Error at the 95 % quantile against seconds, extrapolated to errors that were not measured.
fn at_95_percent(study: &Study) -> CurveChart {
    let make = |(m, style): Styled<'_>| {
        let mut c = curve((m, style), |p| p.seconds, |p| p.relative.map(|r| r[1]));
        let last = c.points.last().map(|p| [p.x, p.y.value]);
        let extrapolated = m.prices.iter().filter(|p| !p.measured);
        let mut far: Vec<[f64; 2]> = extrapolated
            .filter_map(|p| Some([verdict::price(m, p.error)?.1.value, p.error]))
            .filter(|far| last.is_some_and(|[x, y]| far[0] > x && far[1] < y && far[0] < 200.0 * x))
            .collect();
        far.sort_by(|a, b| a[0].total_cmp(&b[0]));
        if !far.is_empty() {
            c.marked = true;
            c.beyond = last.into_iter().chain(far).collect();
        }
        c
    };
    let y_name = "relative error that 95 % of the picture stays below";
    let label = "Relative error at 95 % of the picture against seconds";
    let chart = chart(label, "seconds", y_name, styled(study).map(make));
    CurveChart { targets: verdict::errors(&study.methods), ..chart }
}

/// Root of relMSE against `x` with the fitted slope, extrapolated by a factor.
fn root_mean_square(
    study: &Study,
    label: &'static str,
    x_name: &'static str,
    x: impl Fn(&CurvePoint) -> f64 + Copy,
    slope: impl Fn(&MethodResult) -> Option<Interval>,
    further: f64,
) -> CurveChart {
    let end = study.methods.iter().flat_map(|m| m.points.last()).map(x).fold(0.0, f64::max);
    let make = |(m, style): Styled<'_>| {
        let mut c = curve((m, style), x, |p| p.rel_mse?.root());
        c.beyond = extension(&c.points, slope(m).filter(|_| !m.biased), further * end);
        c
    };
    chart(label, x_name, "relative RMS error of the picture", styled(study).map(make))
}

/// Root of relMSE against seconds, of all methods and other programs.
pub fn overall(study: &Study) -> CurveChart {
    let label = "Relative root mean square error against seconds";
    root_mean_square(study, label, "seconds", |p| p.seconds, |m| m.slope, 4.0)
}

fn by_samples(study: &Study) -> CurveChart {
    let label = "Relative root mean square error against samples per pixel";
    let x_name = "samples (paths) per pixel";
    root_mean_square(study, label, x_name, |p| p.samples_per_pixel, |m| m.slope_samples, 2.0)
}

/// √bias and √noise of the biased methods.
fn bias(study: &Study) -> CurveChart {
    let both = |(m, style): Styled<'_>| {
        let mut bias = curve((m, style), |p| p.seconds, |p| p.bias?.root());
        bias.name = format!("{}: bias", m.name);
        let hollow = MethodStyle { hollow: true, ..style };
        let mut noise = curve((m, hollow), |p| p.seconds, |p| p.noise?.root());
        (noise.name, noise.thin) = (format!("{}: noise", m.name), true);
        [bias, noise]
    };
    let biased = styled(study).filter(|(m, _)| verdict::biased(m));
    let y_name = "root of the mean square, relative";
    chart("Bias and noise against seconds", "seconds", y_name, biased.flat_map(both))
}

fn last_errors(study: &Study) -> Markup {
    let ends = styled(study).filter_map(|(m, style)| Some((m, style, m.points.last()?)));
    listing(
        "Errors at the ends of the curves",
        &ends.collect::<Vec<_>>(),
        &[
            ("At the end of the curve", &|(m, style, _)| method(&m.name, *style)),
            ("time", &|(.., p)| cell(seconds_of(p.seconds))),
            ("50 % within", &|(.., p)| within(p, 0)),
            ("95 % within", &|(.., p)| within(p, 1)),
            ("99 % within", &|(.., p)| within(p, 2)),
            ("RMS error", &|(.., p)| rms(p.rel_mse)),
            ("RMS error, trimmed", &|(.., p)| rms(p.rel_mse_trimmed)),
            ("FLIP", &|(.., p)| maybe(p.flip.map(|flip| with_unit(&flip, 1.0, "")))),
            ("FLIP, filtered", &|(.., p)| maybe(p.flip_filtered.map(|flip| with_unit(&flip, 1.0, "")))),
        ],
    )
}

/// Slope of each method's error curve, with warnings.
fn slopes(study: &Study) -> Markup {
    let slope = |s: Option<Interval>| maybe(s.map(|s| with_unit(&s, 1.0, "")));
    let measured = styled(study).filter(|(m, _)| !m.points.is_empty());
    listing(
        "Slopes of the curves",
        &measured.collect::<Vec<_>>(),
        &[
            ("Slope of the RMS error", &|(m, style)| method(&m.name, *style)),
            ("against seconds", &|(m, _)| slope(m.slope)),
            ("against samples", &|(m, _)| slope(m.slope_samples)),
            ("warnings", &|(m, _)| html! { span.text.warn { (verdict::flags(m).join("; ")) } }),
        ],
    )
}

fn every_point(study: &Study) -> Markup {
    let points = styled(study).flat_map(|(m, style)| m.points.iter().map(move |p| (m, style, p)));
    listing(
        "Every measured point",
        &points.collect::<Vec<_>>(),
        &[
            ("Method", &|(m, style, _)| method(&m.name, *style)),
            ("time", &|(.., p)| cell(seconds_of(p.seconds))),
            ("samples/pixel", &|(.., p)| cell(count(p.samples_per_pixel))),
            ("runs", &|(.., p)| cell(p.runs)),
            ("RMS error", &|(.., p)| rms(p.rel_mse)),
            ("RMS error, trimmed", &|(.., p)| rms(p.rel_mse_trimmed)),
            ("95 % within", &|(.., p)| within(p, 1)),
            ("noise", &|(.., p)| rms(p.noise)),
            ("bias", &|(.., p)| rms(p.bias)),
            ("SMAPE", &|(.., p)| maybe(p.smape.map(|smape| with_unit(&smape, 1.0, "")))),
            ("FLIP", &|(.., p)| maybe(p.flip.map(|flip| with_unit(&flip, 1.0, "")))),
            ("FLIP, filtered", &|(.., p)| maybe(p.flip_filtered.map(|flip| with_unit(&flip, 1.0, "")))),
            ("tracing (CPU)", &|(.., p)| cell(seconds_of(p.trace_seconds))),
            ("splatting", &|(.., p)| cell(seconds_of(p.splat_seconds))),
            ("display", &|(.., p)| cell(seconds_of(p.display_seconds))),
        ],
    )
}

/// The relative error at one of the quantiles of the picture.
fn within(p: &CurvePoint, quantile: usize) -> Markup {
    maybe(p.relative.map(|r| percent_interval(&r[quantile])))
}

fn rms(square: Option<Interval>) -> Markup {
    maybe(square.and_then(|square| square.root()).map(|root| percent_interval(&root)))
}

fn how(study: &Study) -> String {
    let runs = study.methods.iter().flat_map(|m| m.points.iter().map(|p| p.runs));
    let (least, most) = runs.fold((usize::MAX, 0), |(a, b), n| (a.min(n), b.max(n)));
    let runs = if least >= most { most.to_string() } else { format!("{least} to {most}") };
    let own = study.reference.as_ref().and_then(|r| r.rel_mse).filter(|e| e.is_finite() && *e >= 0.0);
    let own = own.map_or_else(String::new, |e| {
        let e = with_unit(&Interval::exact(e), 1.0, "").main;
        format!(
            " The reference is made of all pictures by unbiased methods; each is judged by the others, and their known variance is subtracted \
             (relMSE {e} of all of them). Where a picture is not clearly worse than its reference, its error is that of its replicates."
        )
    });
    format!(
        "relMSE = mean((x − ref)² / (ref_Y² + 0.01)) of the unblurred linear picture against the reference; the charts show its root; trimmed is without the worst 0.1 % of pixels.{own} \
         “95 % within” is the relative standard error that 95 % of the picture, in tiles of 8×8 pixels, stays below. It is known \
         where every pixel has a sample; before, only what is displayed is judged. {runs} runs per point. Times \
         are wall-clock seconds of tracing and splatting; loading the scene and compiling shaders ({} here) is left out. Slopes are \
         least-squares fits of the logarithms; independent noise gives −0.5.",
        seconds_of(study.load_seconds)
    )
}
