//! `pointillist compare`: difference of a picture to a reference by several metrics, from EXR files of any program.

use std::collections::BTreeMap;
use std::path::Path;

use clap::ValueEnum;
use miette::{IntoDiagnostic, Report, Result};
use serde::Serialize;
use serde_json::Value;

use crate::client::{Settings, develop};
use crate::cmd::args::CompareArgs;
use crate::cmd::args::compare::Metric;
use crate::color::{Profile, palette};
use crate::image::compare::{
    Measured, MetricMap, PIXELS_PER_DEGREE, Picture, Worst, delta_e, flip, rel_mse, rel_mse_map,
    relative_standard_error, smape, worst, z_map, z_test,
};
use crate::image::exr::Layers;
use crate::image::png::{PngPicture, Transfer};
use crate::image::write::{FileFormat, check_place, check_target, same_file};
use crate::image::{Attribute, Grid, ImageError, exr, png};
use crate::render::figures::{is_special, publish};

/// Significance level of the z-test over the whole picture.
const ALPHA: f64 = 0.01;

/// Contents of the `--json` file. Field names are JSON keys; an infinite metric is null.
#[derive(Debug, Serialize)]
struct CompareReport<'a> {
    version: &'static str,
    picture: ComparedFile<'a>,
    reference: ComparedFile<'a>,
    width: usize,
    height: usize,
    /// Brightness `B` of the tone curve, for the metrics on displayed colours.
    exposure: f32,
    metrics: &'a [MetricResult],
    /// Metrics that the files do not support, and why.
    left_out: &'a [LeftOut],
    #[serde(skip_serializing_if = "Option::is_none")]
    map: Option<&'a Path>,
}

/// One of the two compared files.
#[derive(Debug, Serialize)]
struct ComparedFile<'a> {
    file: &'a Path,
    /// Name of the layer; empty for the unnamed one.
    layer: &'a str,
    /// Number of pixels with a non-finite channel.
    not_finite: usize,
}

/// Result of one metric.
#[derive(Debug, Serialize)]
struct MetricResult {
    metric: String,
    value: f64,
    /// Further values by name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    details: BTreeMap<&'static str, f64>,
    /// Pixel with the largest difference; `None` if no pixel differs.
    #[serde(skip_serializing_if = "Option::is_none")]
    worst: Option<Worst>,
    meaning: String,
}

/// A metric that the files do not support.
#[derive(Debug, Serialize)]
struct LeftOut {
    metric: String,
    reason: String,
}

/// Two pictures of the same size.
struct Pictures {
    picture: Picture,
    reference: Picture,
    /// Both as displayed: linear sRGB in [0, 1], NaN where not finite.
    displayed: [Grid<[f32; 3]>; 2],
}

/// Runs the subcommand.
///
/// # Errors
///
/// For a file that cannot be read, is not a picture or would be overwritten; for pictures of different sizes; for a requested metric that
/// the files do not support.
pub fn compare(args: &CompareArgs) -> Result<()> {
    check_places(args)?;
    let pictures = read(args)?;
    let (wanted, left_out) = choose(&args.metrics, &pictures)?;
    let mapped = args.metrics.first().copied().unwrap_or(Metric::Flip);
    let (mut metrics, mut note) = (Vec::new(), None);
    for metric in wanted {
        let (result, map) = measure(&pictures, metric).into_diagnostic()?;
        if let Some(path) = args.map.as_ref().filter(|_| metric == mapped) {
            note = Some(write_map(path, metric, &map, args)?);
        }
        metrics.push(result);
    }
    let [picture, reference] = [(&args.picture, &pictures.picture), (&args.reference, &pictures.reference)]
        .map(|(file, read)| ComparedFile { file, layer: &read.layer, not_finite: read.not_finite() });
    let report = CompareReport {
        version: env!("CARGO_PKG_VERSION"),
        width: pictures.picture.rgb.width(),
        height: pictures.picture.rgb.height(),
        picture,
        reference,
        exposure: args.exposure,
        metrics: &metrics,
        left_out: &left_out,
        map: args.map.as_deref(),
    };
    publish(&table(&report, note.as_deref()), "the metrics", &report, args.json.as_deref())
}

/// Checks, before anything is read, that map and report can be written and overwrite neither picture nor each other.
fn check_places(args: &CompareArgs) -> Result<()> {
    if let Some(map) = &args.map {
        check_target(map).into_diagnostic()?;
    }
    let json = args.json.as_deref().filter(|path| !is_special(path));
    if let Some(json) = json {
        check_place(json).into_diagnostic()?;
    }
    for (option, path) in [("--map", args.map.as_deref()), ("--json", json)] {
        let Some(path) = path else { continue };
        for (input, what) in [(&args.picture, "picture"), (&args.reference, "reference")] {
            if same_file(path, input) {
                return Err(miette::miette!(
                    "{option} {} would overwrite the {what}: give another name",
                    path.display()
                ));
            }
        }
    }
    match (&args.map, json) {
        (Some(map), Some(json)) if same_file(map, json) => {
            Err(miette::miette!("--map and --json name the same file {}: give two names", map.display()))
        }
        _ => Ok(()),
    }
}

/// Reads both pictures and applies the tone curve.
fn read(args: &CompareArgs) -> Result<Pictures> {
    let [of_picture, of_reference] = match &args.layers[..] {
        [] => [None, None],
        [both] => [Some(both.as_str()); 2],
        [picture, reference] => [Some(picture.as_str()), Some(reference.as_str())],
        _ => return Err(miette::miette!("--layer takes one name for both files, or one for each")),
    };
    let picture = Picture::read(&args.picture, of_picture).map_err(advise)?;
    let reference = Picture::read(&args.reference, of_reference).map_err(advise)?;
    side_by_side(picture, reference, args.exposure)
}

/// Both pictures, and both as displayed with this brightness, if they are of one size.
fn side_by_side(picture: Picture, reference: Picture, exposure: f32) -> Result<Pictures> {
    let size = |p: &Picture| (p.rgb.width(), p.rgb.height());
    let (a, b) = (size(&picture), size(&reference));
    if a != b {
        return Err(miette::miette!(
            help = "render or cut both to the same size",
            "{} has {}×{} pixels and {} has {}×{}: they cannot be compared",
            picture.path.display(),
            a.0,
            a.1,
            reference.path.display(),
            b.0,
            b.1
        ));
    }
    let settings = Settings { exposure, ..Settings::default() };
    let displayed = [&picture, &reference].map(|p| develop::shown(&p.rgb, &settings));
    Ok(Pictures { picture, reference, displayed })
}

/// Adds advice to a read error, unless its message contains it already.
fn advise(error: ImageError) -> Report {
    let help = match &error {
        ImageError::Read { .. } => "check the path: the picture comes first, then the reference",
        ImageError::Layer { .. } => {
            "`--layer NAME` chooses one for both files, `--layer NAME,NAME` one for each"
        }
        _ => return Report::msg(error),
    };
    miette::miette!(help = help, "{error}")
}

/// The requested metrics, each once, or all that the files support; and the unsupported ones.
fn choose(metrics: &[Metric], pictures: &Pictures) -> Result<(Vec<Metric>, Vec<LeftOut>)> {
    let (mut wanted, mut left_out) = (Vec::new(), Vec::new());
    let asked = !metrics.is_empty();
    for &metric in if asked { metrics } else { Metric::value_variants() } {
        match missing(metric, pictures) {
            _ if wanted.contains(&metric) => {}
            None => wanted.push(metric),
            Some(reason) if asked => {
                return Err(miette::miette!(
                    help = "`pointillist render -o FILE.exr` stores it; or leave {0} out of --metric",
                    "{0} cannot be measured: {reason}",
                    metric.name()
                ));
            }
            Some(reason) => left_out.push(LeftOut { metric: metric.name(), reason: reason.to_string() }),
        }
    }
    Ok((wanted, left_out))
}

/// A metric of two pictures in memory.
#[derive(Debug)]
pub struct ComparedPictures {
    /// The metric, with the keys that `pointillist compare --json` has for it.
    pub metric: Value,
    /// Its value in every pixel.
    pub map: Grid<f32>,
}

/// Compares a picture with a reference of the same size by metrics of these names, or by all that they allow; the metrics on displayed colours
/// see them with this brightness, or as the program shows them.
///
/// # Errors
///
/// For an unknown metric or one that the pictures do not support, for pictures without a main layer, and for pictures of different sizes.
pub fn compare_layers(
    [picture, reference]: [&Layers; 2],
    metrics: &[String],
    exposure: Option<f32>,
) -> Result<Vec<ComparedPictures>> {
    let of = |name: &str, layers| Picture::choose(Path::new(name), layers, None).map_err(advise);
    let exposure = exposure.unwrap_or(Settings::default().exposure);
    if !(exposure > 0.0 && exposure.is_finite()) {
        return Err(miette::miette!("the exposure {exposure} is not a positive number"));
    }
    let pictures = side_by_side(of("the picture", picture)?, of("the reference", reference)?, exposure)?;
    let known = |name: &String| {
        let names = || Metric::value_variants().iter().map(|m| m.name()).collect::<Vec<_>>().join(", ");
        Metric::from_str(name, false)
            .map_err(|_| miette::miette!("there is no metric `{name}`; the metrics are {}", names()))
    };
    let metrics = metrics.iter().map(known).collect::<Result<Vec<_>>>()?;
    let (wanted, _) = choose(&metrics, &pictures)?;
    let compared = |metric| {
        let (result, map) = measure(&pictures, metric).into_diagnostic()?;
        Ok(ComparedPictures { metric: serde_json::to_value(&result).into_diagnostic()?, map })
    };
    wanted.into_iter().map(compared).collect()
}

/// Why the files do not support a metric; `None` if they do.
fn missing(metric: Metric, pictures: &Pictures) -> Option<ImageError> {
    let variance = |picture: &Picture| picture.measured().err();
    match metric {
        Metric::Rse => variance(&pictures.picture),
        Metric::Z => variance(&pictures.picture).or_else(|| variance(&pictures.reference)),
        _ => None,
    }
}

/// Computes a metric and its map.
fn measure(pictures: &Pictures, metric: Metric) -> Result<(MetricResult, Grid<f32>), ImageError> {
    let (a, b) = (&pictures.picture, &pictures.reference);
    let [shown_a, shown_b] = &pictures.displayed;
    let (value, details, map) = match metric {
        Metric::Relmse => (rel_mse(&a.rgb, &b.rgb)?.whole, vec![], rel_mse_map(&a.rgb, &b.rgb)?),
        Metric::Trimmed => (rel_mse(&a.rgb, &b.rgb)?.trimmed, vec![], rel_mse_map(&a.rgb, &b.rgb)?),
        Metric::Smape => without_details(smape(&a.rgb, &b.rgb)?),
        Metric::Flip => without_details(flip(shown_a, shown_b, PIXELS_PER_DEGREE)?),
        Metric::DeltaE => {
            let distance = delta_e(shown_a, shown_b)?;
            (distance.mean, vec![("p95", distance.quantile(0.95))], distance.map)
        }
        Metric::Rse => noise(a.measured()?)?,
        Metric::Z => equality(a.measured()?, b.measured()?)?,
    };
    let result = MetricResult {
        metric: metric.name(),
        value,
        details: details.into_iter().collect(),
        worst: worst(&map),
        meaning: metric.meaning(),
    };
    Ok((result, map))
}

/// Value, details and map of a metric.
type Measurement = (f64, Vec<(&'static str, f64)>, Grid<f32>);

fn without_details(metric: MetricMap) -> Measurement {
    (metric.mean, vec![], metric.map)
}

fn noise(picture: &Measured) -> Result<Measurement, ImageError> {
    let error = relative_standard_error(picture)?;
    let details = vec![("p95", error.p95), ("p99", error.p99), ("skipped", error.skipped as f64)];
    Ok((error.median, details, error.map))
}

fn equality(picture: &Measured, reference: &Measured) -> Result<Measurement, ImageError> {
    let test = z_test(picture, reference, ALPHA)?;
    let details = vec![
        ("critical_z", test.critical_z),
        ("mean_ratio", test.mean_ratio),
        ("mean_ratio_error", test.mean_ratio_error),
        ("mean_z2", test.mean_z2),
        ("skipped", test.skipped as f64),
    ];
    Ok((test.accepted, details, z_map(picture, reference)?))
}

/// Writes the map and returns a description of its scale.
///
/// EXR holds the values themselves in the channel `Y`. PNG shows them in the colours of [`palette`], black for 0 up to
/// the value of [`map_scale`].
fn write_map(path: &Path, metric: Metric, map: &Grid<f32>, args: &CompareArgs) -> Result<String> {
    let name = metric.name();
    let text = |name: &str, value: String| (name.to_owned(), Attribute::Text(value));
    let attributes = vec![
        text("metric", name.clone()),
        text("picture", args.picture.display().to_string()),
        text("reference", args.reference.display().to_string()),
    ];
    let (width, height) = (map.width(), map.height());
    let file = path.display();
    if FileFormat::of(path).into_diagnostic()? == FileFormat::Exr {
        let mut layers = Layers { width, height, attributes, ..Layers::default() };
        layers.push("Y", map.pixels().iter().copied());
        exr::write(path, &layers).into_diagnostic()?;
        return Ok(format!("{file}: {name} of every pixel"));
    }
    let (brightest, shown) = map_scale(metric);
    let rgb: Vec<[u8; 3]> = map.pixels().iter().map(|&v| palette::color(shown(v) / brightest)).collect();
    let picture = PngPicture {
        // Sides of more than 2^32 pixels are rejected when reading.
        width: width as u32,
        height: height as u32,
        rgb: &rgb,
        transfer: Transfer::Srgb,
        primaries: Profile::srgb().primaries,
    };
    png::write(path, picture, &attributes).into_diagnostic()?;
    let root = if matches!(metric, Metric::Relmse | Metric::Trimmed) { "the root of " } else { "" };
    Ok(format!("{file}: {root}{name} from 0, black, to {brightest}, pale yellow; teal where there is none"))
}

/// Value displayed brightest, and the mapping applied before: relative squared errors are shown as their roots, and z without its sign.
fn map_scale(metric: Metric) -> (f32, fn(f32) -> f32) {
    match metric {
        Metric::Relmse | Metric::Trimmed => (1.0, f32::sqrt),
        Metric::Smape | Metric::Flip | Metric::Rse => (1.0, |v| v),
        Metric::DeltaE => (0.2, |v| v),
        Metric::Z => (5.0, f32::abs),
    }
}

/// One line per metric, followed by anomalies of the pictures and the `note` about the map.
fn table(report: &CompareReport<'_>, note: Option<&str>) -> String {
    let worst = |result: &MetricResult| match result.worst {
        Some(worst) => format!("{} at {},{}", number(f64::from(worst.value)), worst.x, worst.y),
        None => "none".to_owned(),
    };
    let worst: Vec<String> = report.metrics.iter().map(worst).collect();
    let width = worst.iter().map(|w| w.chars().count()).chain([11]).max().unwrap_or(0);
    let mut out = format!("{:<9}{:<12}{:<width$}  MEANING\n", "METRIC", "VALUE", "WORST PIXEL");
    for (result, worst) in report.metrics.iter().zip(&worst) {
        let value = number(result.value);
        out += &format!("{:<9}{value:<12}{worst:<width$}  {}\n", result.metric, result.meaning);
        if !result.details.is_empty() {
            let details: Vec<String> = result.details.iter().map(|(k, v)| detail(k, *v)).collect();
            out += &format!("{:<9}{}\n", "", details.join(", "));
        }
    }
    for left_out in report.left_out {
        out += &format!("{:<9}{:<12}{}\n", left_out.metric, "–", left_out.reason);
    }
    for ComparedFile { file, layer, not_finite } in [&report.picture, &report.reference] {
        let file = file.display();
        if !layer.is_empty() {
            out += &format!("{file}: layer {layer}\n");
        }
        if *not_finite > 0 {
            let plural = if *not_finite == 1 { " is" } else { "s are" };
            out += &format!("{file}: {not_finite} pixel{plural} not finite; they count as wrong\n");
        }
    }
    out + &note.map(|note| format!("{note}\n")).unwrap_or_default()
}

fn detail(name: &str, value: f64) -> String {
    let name = name.replace('_', " ").replace("z2", "z²");
    // Counts are printed in full.
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
