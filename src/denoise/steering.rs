//! Steering: after a move of the camera, the first samples of the new view go where the reprojected picture shows least (frameless
//! rendering, Bishop et al. 1994; adaptive frameless rendering, Dayal et al. 2005).
//!
//! A pixel of the reprojected picture is worth W samples of the new view: 0 where the surface was not visible before, fewer behind mirrors,
//! glass and media, after a move towards a surface, and where samples contradicted the picture ([`reprojection`](crate::denoise::reprojection));
//! and fewer with its age, because every reprojection resamples it. When the first n₀ = `FIRST_SAMPLES` samples per pixel are mixed in, its
//! variance is that of 1/(n₀ + W) samples. Regions of the screen get camera paths in proportion to the root of the mean of that, which
//! minimises the sum of the variances for a given number of paths, and a quarter of an even share at least ([`ScreenDensity::new`]). A few
//! thousand rays ([`probes`]) suffice for the map, so that it is there before the reprojected picture.
//!
//! The map depends on the previous view and on surfaces, and on no sample of the new view. With weights of 1/density the picture is that of
//! even samples, without bias, and so is the mean of both ([`tracer::screen`](crate::tracer::screen)). Where the density is low, the weights of
//! steered samples are large and remain in the sums: n even samples and s steered ones per pixel are worth (n + s)² / (n + s/d) even ones
//! at density d. So steering ends after [`STEERED_SAMPLES`]: a region of the density 2 then has as many samples of its own as a reprojected
//! picture is worth at most. The loss, where the density is ½, is 2 / (n + s) from then on, and 1 % at 200 samples per pixel.
//!
//! The sub-pixel variance of the film, which the views of the error and noise masking read, counts samples by their weights as the mean does.

use std::sync::Arc;

use crate::denoise::reprojection::{CarriedWorth, KnownView, MOST_WORTH, ViewSurfaces, carried_worth};
use crate::denoise::view_filter::FeatureGrid;
use crate::math::bits::interleave;
use crate::stream::UvWindow;
use crate::tracer::screen::ScreenDensity;

/// Samples per pixel of the new view that are steered, on average.
pub const STEERED_SAMPLES: f32 = 0.5 * MOST_WORTH;

/// Samples per pixel from which on new samples show more than a reprojected picture: then none are steered.
pub const NEEDLESS_FROM: f32 = MOST_WORTH;

/// Samples per pixel at which the variance of the displayed picture is to be least: those of the first denoised picture.
const FIRST_SAMPLES: f32 = 0.1;

/// Number of moves after which a reprojected picture is worth half: each blurs it a little.
const HALF_AGE: f32 = 4.0;

/// Greatest density over the mean below which samples stay even.
const LEAST_CONTRAST: f32 = 1.25;

/// Primary rays for a map: about so many along each side of the picture, and least distance in pixels.
const PROBES: f64 = 128.0;
const LEAST_STEP: usize = 2;

/// Texels of a picture in whose regions of 16 to 64 ([`ScreenDensity::level`]) there are 4 to 16 of these rays, over the number of the rays.
const TEXELS_PER_PROBE: f64 = 4.0;

/// The primary rays from which the map of a picture of this size is made.
pub fn probes([width, height]: [usize; 2]) -> FeatureGrid {
    let step = ((width as f64 * height as f64).sqrt() / PROBES).ceil() as usize;
    FeatureGrid { half: 0, step: step.max(LEAST_STEP) }
}

/// How densely the first samples of a view are traced over its picture.
#[derive(Clone, Debug)]
pub struct SteeringMap {
    /// `None` where samples stay even, because the reprojected picture is about as good everywhere.
    density: Option<Arc<ScreenDensity>>,
    /// Density over the mean of each region, in the order of [`interleave`].
    relative: Vec<f32>,
    /// Column of regions of each column of pixels, and row of regions of each row.
    regions: [Vec<u32>; 2],
}

impl SteeringMap {
    /// The map for a render of this window of the screen, from `known` to the surfaces that the [`probes`] of the view hit. `None` where
    /// [`carried_worth`] is.
    pub fn new(known: &KnownView, to: &ViewSurfaces, window: &UvWindow) -> Option<Self> {
        let carried = carried_worth(known, to)?;
        let UvWindow { min, max } = window;
        let level = ScreenDensity::level(carried.len() as f64 * TEXELS_PER_PROBE);
        let side = 1u32 << level;
        let region_of = |axis: usize, uv: f32| {
            let place = (uv - min[axis]) / (max[axis] - min[axis]);
            ((place * side as f32) as u32).min(side - 1)
        };
        let mut sums = vec![[0.0; 2]; (side * side) as usize];
        for CarriedWorth { uv, samples, moves } in &carried {
            let [sum, count] = &mut sums[interleave([0, 1].map(|axis| region_of(axis, uv[axis]))) as usize];
            let worth = samples / (1.0 + moves / HALF_AGE);
            (*sum, *count) = (*sum + f64::from(1.0 / (FIRST_SAMPLES + worth)), *count + 1.0);
        }
        // Regions without a ray, along the border, have the mean of the picture.
        let mean = sums.iter().map(|[sum, _]| sum).sum::<f64>() / carried.len() as f64;
        let variances: Vec<f64> =
            sums.iter().map(|[sum, count]| if *count > 0.0 { sum / count } else { mean }).collect();
        let density = ScreenDensity::new(&variances);
        let relative: Vec<f32> = density.relative().collect();
        let is_even = relative.iter().all(|density| *density < LEAST_CONTRAST);
        let size = to.size();
        let regions = [0, 1].map(|axis| {
            let uv = |pixel: usize| (pixel as f32 + 0.5) / size[axis] as f32;
            (0..size[axis]).map(|pixel| region_of(axis, uv(pixel))).collect()
        });
        Some(Self { density: (!is_even).then(|| Arc::new(density)), relative, regions })
    }

    /// The density of the steered samples; `None` where samples stay even.
    pub fn density(&self) -> Option<&Arc<ScreenDensity>> {
        self.density.as_ref()
    }

    /// The number of even samples that have the variance of those in pixel `(x, y)`, where there are `samples` per pixel in the picture, the first of
    /// them steered.
    pub fn effective_samples(&self, [x, y]: [usize; 2], samples: f32) -> f32 {
        if self.density.is_none() || samples <= 0.0 {
            return samples;
        }
        let region = interleave([self.regions[0][x], self.regions[1][y]]) as usize;
        let steered = samples.min(STEERED_SAMPLES);
        samples * samples / (samples - steered + steered / self.relative[region])
    }
}
