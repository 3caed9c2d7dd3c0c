//! A few paths from both ends, to compare a picture with that another method renders.

use crate::scene::desc::IntegratorKind;
use crate::stream::UvWindow;
use crate::tracer::integrator::{BidirectionalTracer, RenderContext};

use super::SEED;
use super::decide::{BLOCKS, mean_of};
use super::trial::{MomentGrid, Trial};

/// Mean luminance by `paths` paths from both ends and its variance, in each of 4×4 blocks of the picture, row by row.
pub fn probe(context: &RenderContext, paths: u64) -> Vec<[f64; 2]> {
    let context = RenderContext { seed: SEED, window: UvWindow::PICTURE, ..context.clone() };
    let grid = MomentGrid::trace(&BidirectionalTracer { context }, paths);
    let trial = Trial { kind: IntegratorKind::Bidirectional, paths, cost: 0.0, grid };
    (0..BLOCKS * BLOCKS).map(|block| <[f64; 2]>::from(mean_of(&trial, block))).collect()
}
