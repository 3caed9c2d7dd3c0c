//! Is a pixel's mean dominated by one sample? The share of the largest sample of a pixel in its sum, by method.
//!
//! Usage: `largest [paths per pixel] [side] [scene]...`; 10^6 paths for each of 16 × 16 pixels of the Cornell scenes if not
//! said. Pixels are those of a picture of 512 × 512 for all methods from the camera, which look at one pixel at a time. A
//! light path cannot be told to meet one pixel: for particles the picture has 16 × 16 pixels, 10^6 light paths for each.

#![allow(clippy::unwrap_used, reason = "a measuring tool: a panic is the message")]

#[allow(dead_code, unused_imports, reason = "each tool uses a part")]
#[path = "../tests/support/largest.rs"]
mod largest;

use std::path::Path;

use largest::{Tally, by_particles, by_pixel, worst};
use pointillist::scene::desc::IntegratorKind;

fn main() {
    let mut args = std::env::args().skip(1);
    let paths: u64 = args.next().map_or(1_000_000, |a| a.parse().expect("paths per pixel"));
    let side: usize = args.next().map_or(16, |a| a.parse().expect("side of the grid in pixels"));
    let mut scenes: Vec<String> = args.collect();
    if scenes.is_empty() {
        scenes = ["cornell", "cornell_spheres"].map(|s| format!("scenes/{s}.xml")).to_vec();
    }
    println!("{side} x {side} pixels, {paths} paths for each");
    for name in scenes {
        let desc = pointillist::scene::load(Path::new(&name), &[]).unwrap().desc;
        let plan = (side, paths);
        report(&name, "path", side, &by_pixel(&desc, IntegratorKind::Path, plan));
        report(&name, "bidirectional", side, &by_pixel(&desc, IntegratorKind::Bidirectional, plan));
        report(&name, "photon", side, &by_pixel(&desc, IntegratorKind::Photon, plan));
        report(&name, "light", side, &by_particles(&desc, plan));
    }
}

fn report(scene: &str, method: &str, side: usize, tallies: &[Tally]) {
    let (pixel, share) = worst(tallies);
    let mut shares: Vec<f64> = tallies.iter().map(Tally::share).collect();
    shares.sort_by(f64::total_cmp);
    let median = shares[shares.len() / 2];
    let Tally { samples, sum, largest } = tallies[pixel];
    println!(
        "{scene} {method}: largest share {:.3} % in pixel ({}, {}) of the grid ({samples} samples, largest {largest:.3e} of \
         {sum:.3e}); median {:.4} %",
        100.0 * share,
        pixel % side,
        pixel / side,
        100.0 * median,
    );
}
