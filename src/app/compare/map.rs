//! The map of a figure as a file.

use std::path::Path;

use miette::{IntoDiagnostic, Result};

use crate::app::args::CompareArgs;
use crate::app::args::compare::MetricArg;
use crate::color::{Profile, palette};
use crate::image::exr::Layers;
use crate::image::png::{Picture, Transfer};
use crate::image::write::Format;
use crate::image::{Attribute, Grid, exr, png};

/// Writes the map and says how it is to be read.
///
/// EXR holds the numbers themselves in the channel `Y`. PNG shows them in the colours of [`palette`], black for 0 up to
/// the figure of [`scale`].
///
/// # Errors
///
/// Whatever the file system says; a file is replaced only once the new one is complete.
pub fn write(path: &Path, metric: MetricArg, map: &Grid<f32>, args: &CompareArgs) -> Result<String> {
    let attributes = vec![
        ("metric".to_owned(), Attribute::Text(metric.name().to_owned())),
        ("picture".to_owned(), Attribute::Text(args.picture.display().to_string())),
        ("reference".to_owned(), Attribute::Text(args.reference.display().to_string())),
    ];
    let (width, height) = (map.width(), map.height());
    let file = path.display();
    if Format::of(path).into_diagnostic()? == Format::Exr {
        let mut layers = Layers { width, height, attributes, ..Layers::default() };
        layers.push("Y", map.pixels().iter().copied());
        exr::write(path, &layers).into_diagnostic()?;
        return Ok(format!("{file}: {} of every pixel", metric.name()));
    }
    let (brightest, shown) = scale(metric);
    let rgb: Vec<[u8; 3]> = map.pixels().iter().map(|&v| palette::color(shown(v) / brightest)).collect();
    let picture = Picture {
        // A side of more than 2^32 pixels was not read.
        width: width as u32,
        height: height as u32,
        rgb: &rgb,
        transfer: Transfer::Srgb,
        primaries: Profile::srgb().primaries,
    };
    png::write(path, picture, &attributes).into_diagnostic()?;
    let root = if matches!(metric, MetricArg::Relmse | MetricArg::Trimmed) { "the root of " } else { "" };
    Ok(format!(
        "{file}: {root}{} from 0, black, to {brightest}, pale yellow; teal where there is none",
        metric.name()
    ))
}

/// The figure that is shown brightest, and what is shown of a figure: relative errors are seen better than their squares, and
/// a z of either sign alike.
fn scale(metric: MetricArg) -> (f32, fn(f32) -> f32) {
    match metric {
        MetricArg::Relmse | MetricArg::Trimmed => (1.0, f32::sqrt),
        MetricArg::Smape | MetricArg::Flip | MetricArg::Rse => (1.0, |v| v),
        MetricArg::DeltaE => (0.2, |v| v),
        MetricArg::Z => (5.0, f32::abs),
    }
}
