//! `pointillist bench --bytes`: memory traffic of passes and size of images by design, at common picture sizes.

use serde::Serialize;

use crate::client::traffic::{MODEL, PASSES, PassTraffic};
use crate::client::{FilmSpec, Settings, SplatFilter, Summation, VarianceForm};
use crate::render::figures::human;

/// Width and height of the pictures.
const SIZES: [[u32; 2]; 3] = [[512, 512], [1920, 1080], [3840, 2160]];

/// Samples of a stream per frame while the camera moves: 4 million per second.
const MOVING_SAMPLES: u64 = 65_536;

/// Bytes of one stream at several picture sizes. Field names are JSON keys.
#[derive(Debug, Serialize)]
pub struct BytesReport {
    model: &'static str,
    sizes: Vec<SizeBytes>,
}

/// Bytes of one stream at one picture size.
#[derive(Debug, Serialize)]
struct SizeBytes {
    width: u32,
    height: u32,
    /// Samples of a full batch.
    batch_samples: usize,
    /// Bytes moved by a full batch of one stream and by a repaint at one sample per pixel, by pass.
    passes: Vec<(&'static str, f64)>,
    /// Bytes of a frame of a moving picture, by pass.
    moving_passes: Vec<(&'static str, f64)>,
    /// Bytes per million samples of the passes whose cost does not depend on the number of samples.
    folded_per_million_samples: f64,
    /// As `folded_per_million_samples`, plus vertices and sprites.
    per_million_samples: f64,
    /// Bytes of a frame of a moving picture of the camera stream.
    moving_frame: f64,
}

impl BytesReport {
    /// Traffic of films with this filter; with noise masking if the settings enable it.
    pub fn new(filter: SplatFilter, settings: &Settings) -> Self {
        let (variance, sums) = (Some(VarianceForm::Product), Summation::TwoFloat);
        let film = |[width, height]: [u32; 2]| FilmSpec { width, height, filter, variance, sums };
        let of = |size| SizeBytes::new(film(size), settings);
        Self { model: MODEL, sizes: SIZES.map(of).into() }
    }

    /// Formats the report as a table.
    pub fn table(&self) -> String {
        let mut out = format!("MB of one stream by design: {MODEL}\n{:<34}", "");
        let row = |name: &str, of: &dyn Fn(&SizeBytes) -> String| {
            let cells: String = self.sizes.iter().map(|size| format!("{:>12}", of(size))).collect();
            format!("{name:<34}{cells}\n")
        };
        let mega = |bytes: f64| format!("{:.1}", bytes * 1e-6);
        out += row("", &|size| format!("{}×{}", size.width, size.height)).trim_start();
        out += &row("samples of a full batch", &|size| human(size.batch_samples as f64));
        let of = |passes: &[(&str, f64)], i: usize| passes.get(i).map_or(String::new(), |(_, b)| mega(*b));
        for (i, name) in PASSES.into_iter().enumerate() {
            out += &row(name, &|size| of(&size.passes, i));
        }
        out += &row("per million samples, without sprites", &|size| mega(size.folded_per_million_samples));
        out += &row("per million samples", &|size| mega(size.per_million_samples));
        for (i, name) in PASSES.into_iter().enumerate() {
            out += &row(&format!("moving: {name}"), &|size| of(&size.moving_passes, i));
        }
        out += &row("a frame of a moving picture", &|size| mega(size.moving_frame));
        out
    }
}

impl SizeBytes {
    fn new(film: FilmSpec, settings: &Settings) -> Self {
        let is_masked = settings.vm > 0.0;
        let still = PassTraffic { is_masked, ..PassTraffic::still(film) };
        let moving = PassTraffic { is_masked, ..PassTraffic::moving(film, MOVING_SAMPLES) };
        let of = |traffic: &PassTraffic| -> Vec<_> {
            PASSES.into_iter().map(|pass| (pass, traffic.bytes(pass).unwrap_or(0.0))).collect()
        };
        let sum = |traffic: &PassTraffic, passes: &[&str]| -> f64 {
            passes.iter().filter_map(|pass| traffic.bytes(pass)).sum()
        };
        let batch = ["splat", "fold", "variance"];
        let millions = still.samples * 1e-6;
        // The fold of the variance is included in the variance, and the camera stream is not filtered adaptively.
        let all: Vec<_> =
            PASSES.into_iter().filter(|pass| !["variance fold", "adaptive filter"].contains(pass)).collect();
        Self {
            width: film.width,
            height: film.height,
            batch_samples: film.batch_capacity(),
            passes: of(&still),
            moving_passes: of(&moving),
            folded_per_million_samples: sum(&PassTraffic { samples: 0.0, ..still }, &batch) / millions,
            per_million_samples: sum(&still, &batch) / millions,
            moving_frame: sum(&moving, &all),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::client::memory::{FilmContents, film_memory};

    /// Design targets for a 4K picture: at most .4 GB per million samples besides sprites, .6 GB for a frame of a moving picture, and 389
    /// MB of memory for the sums of a stream.
    #[test]
    fn a_picture_of_4k_moves_little() {
        let report = BytesReport::new(SplatFilter::Gaussian, &Settings { vm: 1.0, ..Settings::default() });
        let largest = report.sizes.last().expect("a size");
        assert_eq!([largest.width, largest.height], [3840, 2160]);
        assert!(largest.folded_per_million_samples < 0.4e9, "{largest:?}");
        assert!(largest.moving_frame < 0.6e9, "{largest:?}");
        let table = report.table();
        assert!(table.lines().all(|line| !line.contains("NaN")) && table.contains("3840×2160"), "{table}");
        let film = FilmSpec {
            width: 3840,
            height: 2160,
            filter: SplatFilter::Gaussian,
            variance: Some(VarianceForm::Product),
            sums: Summation::TwoFloat,
        };
        let contents = FilmContents { streams: [true, false], samples: 0, eyes: 1 };
        let memory = film_memory(&film, &Settings::default(), contents, false);
        let stream: u64 = memory.iter().filter(|(name, _)| name.starts_with("camera")).map(|(_, b)| b).sum();
        assert!(stream <= 389_000_000, "{memory:?}");
    }
}
