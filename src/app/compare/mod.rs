//! `pointillist compare`: how far a picture is from a reference, by several figures, from anybody's EXR files.

mod figures;
mod files;
mod map;
mod table;

use std::path::Path;

use miette::{IntoDiagnostic, Result};
use serde::Serialize;

use super::args::CompareArgs;
use super::args::compare::MetricArg;
use super::report::{print, write_json};
use figures::{Figure, Pair, missing};

/// What `--json` writes. Field names are JSON keys; a figure that is infinite is null.
#[derive(Debug, Serialize)]
struct Compared<'a> {
    version: &'static str,
    picture: Side<'a>,
    reference: Side<'a>,
    width: usize,
    height: usize,
    /// Brightness `B` before the figures of displayed colours.
    exposure: f32,
    metrics: &'a [Figure],
    /// Figures that the files do not allow, and why.
    left_out: &'a [LeftOut],
    #[serde(skip_serializing_if = "Option::is_none")]
    map: Option<&'a Path>,
}

/// One of the two pictures.
#[derive(Debug, Serialize)]
struct Side<'a> {
    file: &'a Path,
    /// Name of the layer; empty for the one without.
    layer: &'a str,
    /// Pixels with a channel that is not finite.
    not_finite: usize,
}

/// A figure that could not be had.
#[derive(Debug, Serialize)]
struct LeftOut {
    metric: &'static str,
    reason: String,
}

/// Runs the subcommand.
///
/// # Errors
///
/// A file that cannot be read, is no picture or would be overwritten; pictures of different sizes; a figure that was asked
/// for and needs what the files lack.
pub fn compare(args: &CompareArgs) -> Result<()> {
    files::check_places(args)?;
    let pair = files::read(args)?;
    let (wanted, left_out) = choose(args, &pair)?;
    let mapped = args.metrics.first().copied().unwrap_or(MetricArg::Flip);
    let (figures, map) = figures::all(&pair, &wanted, args.map.as_ref().map(|_| mapped)).into_diagnostic()?;
    let mut notes = Vec::new();
    if let (Some(path), Some(map)) = (&args.map, &map) {
        notes.push(map::write(path, mapped, map, args)?);
    }
    let [picture, reference] = [(&args.picture, &pair.picture), (&args.reference, &pair.reference)]
        .map(|(file, read)| Side { file, layer: &read.layer, not_finite: read.not_finite() });
    let compared = Compared {
        version: env!("CARGO_PKG_VERSION"),
        width: pair.picture.rgb.width(),
        height: pair.picture.rgb.height(),
        picture,
        reference,
        exposure: args.exposure,
        metrics: &figures,
        left_out: &left_out,
        map: args.map.as_deref(),
    };
    if args.json.as_deref() != Some("-".as_ref()) {
        print(&table::table(&compared, &notes), "the figures");
    }
    args.json.as_ref().map_or(Ok(()), |path| write_json(&compared, path))
}

/// The figures asked for, each once, or all that can be had, and those that cannot.
fn choose(args: &CompareArgs, pair: &Pair) -> Result<(Vec<MetricArg>, Vec<LeftOut>)> {
    use clap::ValueEnum;
    let (mut wanted, mut left_out) = (Vec::new(), Vec::new());
    let asked = !args.metrics.is_empty();
    for &metric in if asked { &args.metrics } else { MetricArg::value_variants() } {
        match missing(metric, pair) {
            _ if wanted.contains(&metric) => {}
            None => wanted.push(metric),
            Some(reason) if asked => {
                return Err(miette::miette!(
                    help = "`pointillist render -o FILE.exr` stores it; or leave {0} out of --metric",
                    "{0} cannot be had: {reason}",
                    metric.name()
                ));
            }
            Some(reason) => left_out.push(LeftOut { metric: metric.name(), reason: reason.to_string() }),
        }
    }
    Ok((wanted, left_out))
}
