//! Model of the memory traffic of passes: bytes that their shaders read and write, ignoring what caches save or tiles waste.
//!
//! Every texel of an image counts once per pass that reads it and once per pass that writes it; a blur that reads a texel for several
//! outputs still counts it once. A blended sprite reads and writes every texel that it covers; a clear writes the target.

use crate::client::film::VulkanFilm;
use crate::client::lod::StreamLod;
use crate::client::pass::reconstruct::levels_needed;
use crate::client::settings::{FilmSpec, Reconstruction, SplatFilter, Summation};
use crate::client::upload::STRIDE;

/// The model in one sentence.
pub const MODEL: &str = "every texel read and written once per pass, blended sprites read and write what they cover; \
                         mips and reconstruct by the level of detail; `variance` includes `variance fold`; \
                         `adaptive filter`, of light streams, takes the place of `mips`";

/// Bytes of a texel of colour, of variance or edges, of the adaptive filter's statistics, and of the encoded picture in 8 bits.
const COLOR: f64 = 16.0;
const SCALAR: f64 = 4.0;
const STATISTICS: f64 = 8.0;
const ENCODED: f64 = 4.0;

/// Inputs of the model for the passes of one stream.
#[derive(Clone, Copy, Debug)]
pub struct PassTraffic {
    /// The film.
    pub film: FilmSpec,
    /// The sums have one texel per 4×4 pixels.
    pub is_coarse: bool,
    /// Samples of the stream in the batch.
    pub samples: f64,
    /// Samples of the stream on the film, which determine the mip levels that are read.
    pub on_film: u64,
    /// Picture pixels per reconstructed one, along each axis.
    pub detail: u32,
    /// Whether noise is masked.
    pub is_masked: bool,
    /// Whether the stream is filtered adaptively, so that its mips are not needed.
    pub is_adaptive: bool,
}

/// Passes of a batch and of a repaint, in their order.
pub const PASSES: [&str; 10] = [
    "clear",
    "splat",
    "fold",
    "variance",
    "variance fold",
    "mips",
    "adaptive filter",
    "reconstruct",
    "tonemap",
    "show",
];

impl PassTraffic {
    /// A full batch of a still picture with one sample per pixel.
    pub fn still(film: FilmSpec) -> Self {
        let on_film = u64::from(film.width) * u64::from(film.height);
        let samples = film.batch_capacity() as f64;
        Self { film, is_coarse: false, samples, on_film, detail: 1, is_masked: false, is_adaptive: false }
    }

    /// A frame of a moving picture in which this many samples arrive, which are all there are.
    pub fn moving(film: FilmSpec, samples: u64) -> Self {
        Self { is_coarse: true, samples: samples as f64, on_film: samples, ..Self::still(film) }
    }

    /// The specification of the sums.
    fn sums(&self) -> FilmSpec {
        if self.is_coarse { VulkanFilm::coarse_spec(&self.film) } else { self.film }
    }

    /// Bytes moved by one run of the pass of this name; `None` for passes without a model. The fold of the variance is included in
    /// `variance` as well. Those of the adaptive filter are told whether the stream is filtered by it or not.
    pub fn bytes(&self, pass: &str) -> Option<f64> {
        let sums = self.sums();
        let extent = sums.padded_extent();
        let texels = f64::from(extent[0]) * f64::from(extent[1]);
        let picture = f64::from(self.film.width) * f64::from(self.film.height);
        let drawn = picture / f64::from(self.detail * self.detail);
        let slots = f64::from(sums.batch_slots());
        let vertices = STRIDE as f64 * self.samples;
        let sprites = self.samples * footprint(sums.filter);
        let floats = if sums.sums == Summation::TwoFloat { 2.0 } else { 1.0 };
        let has_variance = sums.variance.is_some();
        let of_variance = |bytes: f64| if has_variance { bytes } else { 0.0 };
        // Sums and remainders are read and written, and the batch is read.
        let fold_variance = texels * SCALAR * (2.0 + 2.0 + slots);
        Some(match pass {
            "clear" => texels * (floats * COLOR + of_variance(2.0 * SCALAR)),
            "splat" => texels * slots * COLOR + vertices + sprites * 2.0 * COLOR,
            // The means are written as well.
            "fold" => texels * COLOR * (2.0 * floats + slots) + of_variance(texels * COLOR),
            "variance" if has_variance => {
                texels * (slots * SCALAR + COLOR) + vertices + sprites * 2.0 * SCALAR + fold_variance
            }
            "variance fold" if has_variance => fold_variance,
            "mips" if self.is_adaptive => 0.0,
            "mips" => self.mips(extent),
            "adaptive filter" => adaptive_filter([sums.width, sums.height]),
            "atlas" => texels * COLOR * 2.0 * (1.0 + 1.0 / 3.0),
            "reconstruct" if self.is_adaptive => {
                texels_of([sums.width, sums.height], 0) * COLOR + drawn * COLOR
            }
            "reconstruct" => self.reconstruct(extent) + drawn * COLOR,
            "tonemap" => drawn * COLOR + picture * ENCODED,
            "show" => 2.0 * picture * ENCODED,
            "readback" | "copy" => 2.0 * picture * COLOR,
            _ => return None,
        })
    }

    /// Level of detail, and number of mip levels.
    fn level(&self, [width, height]: [u32; 2]) -> Option<StreamLod> {
        let levels = width.max(height).ilog2() as usize + 1;
        StreamLod::new(u64::from(width) * u64::from(height), self.on_film, levels)
    }

    /// Each level that is built is written once, and the one below it is read.
    fn mips(&self, extent: [u32; 2]) -> f64 {
        let Some(lod) = self.level(extent) else { return 0.0 };
        let levels = levels_needed(Reconstruction::Gaussian, self.is_masked, &lod);
        let texel = COLOR + if self.is_masked { SCALAR } else { 0.0 };
        let pair = |level: u32| texels_of(extent, level - 1) + texels_of(extent, level);
        (1..levels).map(|level| texel * pair(level)).fold(0.0, |sum, bytes| sum + bytes)
    }

    /// Each level that is read counts once: two levels, or all if noise is masked.
    fn reconstruct(&self, extent: [u32; 2]) -> f64 {
        let Some(lod) = self.level(extent) else { return 0.0 };
        if self.is_masked {
            let all = 0..=lod.max_level as u32;
            return all.map(|level| (COLOR + SCALAR) * texels_of(extent, level)).sum();
        }
        let near = lod.base.max(0.0) as u32;
        let far = if lod.base < 0.0 { 0.0 } else { texels_of(extent, near + 1) };
        COLOR * (texels_of(extent, near) + far)
    }
}

/// The passes of [`AdaptiveFilterPass`](crate::client::pass::adaptive_filter::AdaptiveFilterPass) on sums of this extent without overscan.
fn adaptive_filter(extent: [u32; 2]) -> f64 {
    let last = extent[0].max(extent[1]).ilog2();
    let texels = |level: u32| texels_of(extent, level);
    // Statistics of the sums; of every further level from the one below, and its edges.
    let measured = (COLOR + STATISTICS) * texels(0)
        + (1..=last)
            .map(|level| STATISTICS * texels(level - 1) + (2.0 * STATISTICS + SCALAR) * texels(level))
            .sum::<f64>();
    // Each level but the last: what has come to it is read twice, what it keeps is written, read, and blended with what coarser ones have;
    // of the next one statistics and edges are read, what it gets is written, and what it has kept is read.
    let kept = |level| 6.0 * COLOR * texels(level) + (STATISTICS + SCALAR + 2.0 * COLOR) * texels(level + 1);
    measured + (0..last).map(kept).sum::<f64>()
}

/// Texels of a mip level.
fn texels_of(extent: [u32; 2], level: u32) -> f64 {
    extent.map(|n| f64::from((n >> level).max(1))).iter().product()
}

/// Texels that a sprite covers.
fn footprint(filter: SplatFilter) -> f64 {
    match filter {
        SplatFilter::Gaussian | SplatFilter::Scaled(_) => 36.0,
        SplatFilter::Tent => 4.0,
        SplatFilter::Box => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::client::settings::VarianceForm;

    fn film(width: u32, height: u32) -> FilmSpec {
        let (filter, variance) = (SplatFilter::Gaussian, Some(VarianceForm::Product));
        FilmSpec { width, height, filter, variance, sums: Summation::TwoFloat }
    }

    /// The draws of the adaptive filter on 4×2 pixels, one by one, with levels of 8, 2 and 1 texels.
    #[test]
    fn draws_of_the_adaptive_filter_are_counted() {
        let draws = [
            8 * (16 + 8),                  // statistics
            8 * 8 + 2 * 8,                 // their first level
            2 * 8 + 8,                     // and their second
            2 * (8 + 4),                   // edges of the first level
            8 + 4,                         // and of the second
            8 * 16 + 2 * (8 + 4) + 8 * 16, // what the finest level keeps
            8 * 16 + 8 * 16 + 2 * 16,      // and passes on
            2 * 16 + (8 + 4) + 2 * 16,     // what the next level keeps
            2 * 16 + 2 * 16 + 16,          // and passes on
            16 + 2 * 2 * 16,               // what the last one has is added to the next,
            2 * 16 + 2 * 8 * 16,           // and that to the finest
        ];
        let light = PassTraffic { is_adaptive: true, ..PassTraffic::still(film(4, 2)) };
        assert_eq!(light.bytes("adaptive filter"), Some(f64::from(draws.iter().sum::<i32>())));
        assert_eq!(PassTraffic::still(film(1, 1)).bytes("adaptive filter"), Some(24.0), "no coarser level");
    }

    /// The adaptive filter reads what mips would be made of, and its result has one level without overscan.
    #[test]
    fn adaptively_filtered_streams_have_no_mips() {
        let camera = PassTraffic { on_film: 100, ..PassTraffic::still(film(64, 32)) };
        let light = PassTraffic { is_adaptive: true, ..camera };
        assert!(camera.bytes("mips").is_some_and(|bytes| bytes > 0.0));
        assert_eq!(light.bytes("mips"), Some(0.0));
        assert_eq!(light.bytes("reconstruct"), Some(2.0 * 16.0 * 64.0 * 32.0));
        // A moving picture is filtered at a quarter of the extent.
        let moving = |film| PassTraffic::moving(film, 100).bytes("adaptive filter");
        assert_eq!(moving(film(64, 32)), PassTraffic::still(film(16, 8)).bytes("adaptive filter"));
        assert!(PASSES.into_iter().all(|pass| light.bytes(pass).is_some()));
    }
}
