//! Highlights that a picture lacks: small lamps in mirrors and glass, which the tracer finds one by one
//! ([`highlights`](crate::stream::Witnessed::highlights)), with the number of samples that meet each in expectation.
//!
//! Of those that n samples of each pixel meet m times, the part exp(−m) has not been met (Poisson). Few pixels of a tile lack them, so that their mean
//! square is larger than the square of their mean.

use crate::stream::Highlight;
use crate::study::error_tile::TILE;
use crate::study::picture_tile::PictureTile;

/// The highlights that one tile lacks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LackedHighlights {
    /// Mean luminance.
    pub light: f64,
    /// Mean square over the pixels.
    pub square: f64,
    /// The same relative to squared luminance plus 0.01, as in relMSE.
    pub relative: f64,
}

/// A highlight of which less has not been met is known.
const HARDLY: f64 = 1e-3;

/// Relative deviation of [`LackedHighlights`]: few chains find a highlight, and cones blur it.
pub(super) const HIGHLIGHT_DEVIATION: f64 = 0.5;

/// The highlights that the tiles of a picture have not met; empty where there are none.
pub(super) fn lacked_highlights(
    highlights: &[Highlight],
    picture: &[PictureTile],
    [width, height]: [usize; 2],
    per_pixel: f64,
    energy: f64,
) -> Vec<LackedHighlights> {
    if highlights.is_empty() {
        return Vec::new();
    }
    let columns = width.div_ceil(TILE);
    let mut lacked = vec![LackedHighlights::default(); picture.len()];
    for highlight in highlights {
        let Some((tile, lacked)) = picture.get(highlight.area).zip(lacked.get_mut(highlight.area)) else {
            continue;
        };
        let [x, y] = [highlight.area % columns * TILE, highlight.area / columns * TILE];
        let pixels = ((width - x).min(TILE) * (height - y).min(TILE)) as f64;
        let unmet = (-per_pixel * highlight.chance).exp() / pixels;
        if unmet * pixels < HARDLY {
            continue;
        }
        // The film's filter spreads what lies in one pixel.
        let covered = highlight.pixels.max(1.0 / energy).min(pixels);
        let level = highlight.light / covered;
        let luminance = tile.light - tile.rare + level;
        lacked.light += unmet * highlight.light;
        lacked.square += unmet * covered * level * level;
        lacked.relative += unmet * covered * level * level / (luminance * luminance + 0.01);
    }
    for (lacked, tile) in lacked.iter_mut().zip(picture) {
        // What single samples carry are highlights that were met.
        let left = if lacked.light > 0.0 { (1.0 - tile.rare / lacked.light).max(0.0) } else { 0.0 };
        let LackedHighlights { light, square, relative } = *lacked;
        *lacked = LackedHighlights { light: left * light, square: left * square, relative: left * relative };
    }
    lacked
}
