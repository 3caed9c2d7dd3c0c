//! Is a pixel's mean dominated by one sample? The share of the largest sample of a pixel in its sum, by method.
//!
//! Pixels are those of a picture of 512 × 512 for all methods from the camera, which look at one pixel at a time. A
//! light path cannot be told to meet one pixel: for particles the picture has 16 × 16 pixels, 10^6 light paths for each.

use std::path::{Path, PathBuf};

use pointillist::scene::desc::IntegratorKind;

use super::common::Outcome;
use super::support::largest::{Tally, by_particles, by_pixel, worst};

/// What to measure.
#[derive(clap::Args)]
pub struct Arguments {
    /// Paths for each pixel
    #[arg(default_value_t = 1_000_000)]
    paths: u64,
    /// Side of the grid in pixels
    #[arg(default_value_t = 16)]
    side: usize,
    /// Scene files; the Cornell scenes when not given
    #[arg(default_values = ["scenes/cornell.xml", "scenes/cornell_spheres.xml"])]
    scenes: Vec<PathBuf>,
}

/// Measures every scene by every method.
pub fn run(arguments: &Arguments) -> Outcome {
    let Arguments { paths, side, ref scenes } = *arguments;
    println!("{side} x {side} pixels, {paths} paths for each");
    for name in scenes {
        let desc = pointillist::scene::load(name, &[])?.desc;
        report(name, "path", side, &by_pixel(&desc, IntegratorKind::Path, side, paths));
        report(name, "bidirectional", side, &by_pixel(&desc, IntegratorKind::Bidirectional, side, paths));
        report(name, "photon", side, &by_pixel(&desc, IntegratorKind::Photon, side, paths));
        report(name, "light", side, &by_particles(&desc, side, paths));
    }
    Ok(())
}

fn report(scene: &Path, method: &str, side: usize, tallies: &[Tally]) {
    let (pixel, share) = worst(tallies);
    let mut shares: Vec<f64> = tallies.iter().map(Tally::share).collect();
    shares.sort_by(f64::total_cmp);
    let median = shares[shares.len() / 2];
    let Tally { samples, sum, largest } = tallies[pixel];
    println!(
        "{} {method}: largest share {:.3} % in pixel ({}, {}) of the grid ({samples} samples, largest {largest:.3e} of \
         {sum:.3e}); median {:.4} %",
        scene.display(),
        100.0 * share,
        pixel % side,
        pixel / side,
        100.0 * median,
    );
}
