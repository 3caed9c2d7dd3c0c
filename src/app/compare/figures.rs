//! The figures.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::app::args::compare::MetricArg;
use crate::image::compare::{
    Measured, PIXELS_PER_DEGREE, Picture, RelMse, Worst, delta_e, flip, rel_mse, rel_mse_map,
    relative_standard_error, smape, worst, z_map, z_test,
};
use crate::image::{Grid, ImageError};

/// Level of the z-test for the whole picture.
const ALPHA: f64 = 0.01;

/// Two pictures of the same size.
pub struct Pair {
    /// What is judged.
    pub picture: Picture,
    /// What it is judged by.
    pub reference: Picture,
    /// Both as they are displayed: linear sRGB in [0, 1], NaN for what is not finite.
    pub displayed: [Grid<[f32; 3]>; 2],
}

/// One figure. Field names are JSON keys.
#[derive(Debug, Serialize)]
pub struct Figure {
    /// Its name.
    pub metric: &'static str,
    /// The number that stands for it.
    pub value: f64,
    /// What else there is to say.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub details: BTreeMap<&'static str, f64>,
    /// The worst pixel; `None` when no pixel differs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub worst: Option<Pixel>,
    /// What it means.
    pub meaning: &'static str,
}

/// A pixel and its figure.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Pixel {
    /// Column, 0 at the left.
    pub x: usize,
    /// Row, 0 at the top.
    pub y: usize,
    /// Its figure.
    pub value: f32,
}

impl From<Worst> for Pixel {
    fn from(Worst { x, y, value }: Worst) -> Self {
        Self { x, y, value }
    }
}

/// The figures in this order, and the map of `mapped` if it is one of them.
///
/// # Errors
///
/// [`ImageError::TooLarge`], and [`ImageError::Channel`] for a figure that [`missing`] refuses.
pub fn all(
    pair: &Pair,
    metrics: &[MetricArg],
    mapped: Option<MetricArg>,
) -> Result<(Vec<Figure>, Option<Grid<f32>>), ImageError> {
    let (mut figures, mut map) = (Vec::new(), None);
    for &metric in metrics {
        let (figure, of_this) = one(pair, metric)?;
        figures.push(figure);
        if mapped == Some(metric) {
            map = Some(of_this);
        }
    }
    Ok((figures, map))
}

/// Why a figure cannot be had; `None` if it can.
pub fn missing(metric: MetricArg, pair: &Pair) -> Option<ImageError> {
    let measured = |picture: &Picture| picture.measured().err();
    match metric {
        MetricArg::Rse => measured(&pair.picture),
        MetricArg::Z => measured(&pair.picture).or_else(|| measured(&pair.reference)),
        _ => None,
    }
}

/// A figure and its map.
fn one(pair: &Pair, metric: MetricArg) -> Result<(Figure, Grid<f32>), ImageError> {
    let (a, b) = (&pair.picture, &pair.reference);
    let [shown_a, shown_b] = &pair.displayed;
    let (value, details, map) = match metric {
        MetricArg::Relmse | MetricArg::Trimmed => {
            let RelMse { whole, trimmed } = rel_mse(&a.rgb, &b.rgb)?;
            let value = if metric == MetricArg::Relmse { whole } else { trimmed };
            (value, vec![], rel_mse_map(&a.rgb, &b.rgb)?)
        }
        MetricArg::Smape => {
            let smape = smape(&a.rgb, &b.rgb)?;
            (smape.mean, vec![], smape.map)
        }
        MetricArg::Flip => {
            let flip = flip(shown_a, shown_b, PIXELS_PER_DEGREE)?;
            (flip.mean, vec![], flip.map)
        }
        MetricArg::DeltaE => {
            let delta_e = delta_e(shown_a, shown_b)?;
            (delta_e.mean, vec![("p95", delta_e.p95)], delta_e.map)
        }
        MetricArg::Rse => noise(a.measured()?)?,
        MetricArg::Z => equality(a.measured()?, b.measured()?)?,
    };
    let figure = Figure {
        metric: metric.name(),
        value,
        details: details.into_iter().collect(),
        worst: worst(&map).map(Pixel::from),
        meaning: metric.meaning(),
    };
    Ok((figure, map))
}

type Measure = (f64, Vec<(&'static str, f64)>, Grid<f32>);

/// Value, details and map of the relative standard error.
fn noise(picture: &Measured) -> Result<Measure, ImageError> {
    let error = relative_standard_error(picture)?;
    let details = vec![("p95", error.p95), ("p99", error.p99), ("skipped", error.skipped as f64)];
    Ok((error.median, details, error.map))
}

/// Value, details and map of the z-test.
fn equality(picture: &Measured, reference: &Measured) -> Result<Measure, ImageError> {
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
