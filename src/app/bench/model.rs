//! Bytes that a pass moves, by design: what its shader reads and writes, not what caches save or tiles waste.
//!
//! Every texel of an image counts once per pass that reads it and once per pass that writes it (a blur that reads a texel for
//! several outputs still counts it once). A blended sprite reads and writes every texel of its footprint; a clear writes the
//! target. Passes that are not listed have no figure.

use crate::client::{FilmSpec, SplatFilter};

/// Texels that a sprite covers.
fn footprint(filter: SplatFilter) -> f64 {
    match filter {
        SplatFilter::Gaussian => 25.0,
        SplatFilter::Tent => 4.0,
        SplatFilter::Box => 1.0,
    }
}

/// Bytes of one run of pass `name` on a film of `spec`, with `samples` samples in the batch; `masking`: noise is masked.
pub fn bytes(name: &str, spec: &FilmSpec, samples: f64, masking: bool) -> Option<f64> {
    let [width, height] = spec.padded_extent().map(f64::from);
    let film = width * height;
    let picture = f64::from(spec.width) * f64::from(spec.height);
    let slots = f64::from(spec.batch_slots());
    let vertices = 24.0 * samples;
    let sprites = samples * footprint(spec.filter);
    let (color, scalar) = (16.0, 4.0);
    // Levels 1 and up of a mip chain hold a third of level 0.
    let chain = 1.0 / 3.0;
    Some(match name {
        // Sums of colour and variance, two floats each.
        "clear" => film * 2.0 * (color + scalar),
        "splat" => film * slots * color + vertices + sprites * 2.0 * color,
        // Old hi and lo and the batch in; new hi and lo and the means out.
        "fold" => film * (color * (2.0 + slots) + 3.0 * color),
        // The means in; with the fold of the variance, which is part of the scope.
        "variance" => {
            film * slots * scalar + vertices + sprites * (color + 2.0 * scalar) + fold_variance(film, slots)
        }
        "variance fold" => fold_variance(film, slots),
        "readback" | "copy" => picture * color * 2.0,
        "tonemap" => picture * (color + scalar),
        // One level of the camera stream at least; its neighbour is a quarter of it.
        "reconstruct" => film * color * 1.25 + picture * color,
        // The whole chain of colour and variance. Without masking only the levels are built that the level of detail asks for,
        // none once there are several samples per pixel: no figure.
        "mips" if masking => film * (color + scalar) * (1.0 + 2.0 * chain),
        "atlas" => film * color * 2.0 * (1.0 + chain),
        _ => return None,
    })
}

fn fold_variance(film: f64, slots: f64) -> f64 {
    film * 4.0 * (2.0 + slots + 2.0)
}
