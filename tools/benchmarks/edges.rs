//! Rays at the edges of closed meshes, and rays that leave surfaces: how many of 10⁷ go where no ray can.

use pointillist::tracer::accel::{Accel, Shapes};
use rayon::prelude::*;

use super::common::Outcome;
use super::support::accel::{CLOSED, leaks};
use super::support::spawned::{KINDS, OFFSETS, SIZES, self_hits};

/// What to measure.
#[derive(clap::Args)]
pub struct Arguments {
    /// Rays at all closed meshes together, and rays for each size and distance from the origin
    #[arg(default_value_t = 10_000_000)]
    rays: u64,
}

/// Counts both.
pub fn run(arguments: &Arguments) -> Outcome {
    let rays = arguments.rays;
    println!("| closed mesh | rays | missed | not occluded | too far |\n|---|---|---|---|---|");
    for closed in &CLOSED {
        let mesh = closed.triangles();
        let accel = Accel::new(Shapes { triangles: &mesh, ..Shapes::default() }, &[], &[]);
        let count = rays.div_ceil(CLOSED.len() as u64);
        let found = leaks(&accel, &mesh, closed, (0..count).into_par_iter());
        println!(
            "| {} | {} | {} | {} | {} |",
            closed.name, found.rays, found.missed, found.unoccluded, found.late
        );
    }
    println!(
        "\n| size | sizes from the origin | rays that leave | hit what they leave | moved by 1e-4 |\n|---|---|---|---|---|"
    );
    for (size, offset) in SIZES.into_iter().flat_map(|size| OFFSETS.map(|offset| (size, offset))) {
        let each = rays.div_ceil(KINDS.len() as u64);
        let found: Vec<[u64; 2]> = KINDS.par_iter().map(|kind| self_hits(kind, size, offset, each)).collect();
        let [again, fixed] = [0, 1].map(|i| found.iter().map(|f| f[i]).sum::<u64>());
        println!("| {size:e} | {offset:e} | {} | {again} | {fixed} |", each * KINDS.len() as u64);
    }
    Ok(())
}
