//! The reference of `error_view`: the relative standard error of one stream as grey (the paper's Figure 5, right).

use glam::Vec3;
use rayon::prelude::*;

use crate::client::reference::reconstruct::{ReconstructParameters, StreamView};
use crate::image::Grid;

/// Grey in X, Y and Z: 0 is exact, 1 an error of 100 % or more; black without samples. `None` without memory.
pub fn error_view(p: &ReconstructParameters, stream: Option<&StreamView<'_>>) -> Option<Grid<Vec3>> {
    let (width, height) = (p.spec.width as usize, p.spec.height as usize);
    let mut picture = Grid::try_filled(width, height, Vec3::ZERO)?;
    let Some(stream) = stream.filter(|stream| stream.variance.is_some()) else {
        return Some(picture);
    };
    let (extent, pad) = (p.spec.padded_extent(), p.spec.pad() as f32);
    picture.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, out) in row.iter_mut().enumerate() {
            let at = [x as f32 + 0.5 + pad, y as f32 + 0.5 + pad];
            let uv = [0, 1].map(|i| at[i] / extent[i] as f32);
            let r = stream.relative_variance(p, uv, stream.lod.base).map_or(0.0, |(_, r)| r);
            *out = Vec3::splat(r.sqrt().min(1.0));
        }
    });
    Some(picture)
}
