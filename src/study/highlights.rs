//! Highlights missing from a picture: small lamps in mirrors and glass, which the tracer finds one by one
//! ([`highlights`](crate::stream::Witnessed::highlights)), with the expected number of samples that hit each.
//!
//! Of highlights that n samples per pixel are expected to hit m times, the fraction exp(−m) has not been hit (Poisson). Few pixels of a
//! tile lack them, so that their mean square exceeds the square of their mean.

use crate::stream::Highlight;
use crate::study::error_tile::TILE;
use crate::study::picture_tile::PictureTile;

/// Highlights missing from one tile.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LackedHighlights {
    /// Mean luminance.
    pub light: f64,
    /// Mean square over the pixels.
    pub square: f64,
    /// Mean square over pixels, relative to squared luminance plus 0.01, as in relMSE.
    pub relative: f64,
}

/// A highlight counts as found if less than this fraction of it is missing.
const HARDLY: f64 = 1e-3;

/// Relative standard deviation of [`LackedHighlights`]: few chains find a highlight, and cones blur it.
pub(super) const HIGHLIGHT_DEVIATION: f64 = 0.5;

/// Missing highlights of each tile; empty if there are none.
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
        // The film's filter spreads the light of one pixel over several.
        let covered = highlight.pixels.max(1.0 / energy).min(pixels);
        let level = highlight.light / covered;
        let luminance = tile.light - tile.rare + level;
        lacked.light += unmet * highlight.light;
        lacked.square += unmet * covered * level * level;
        lacked.relative += unmet * covered * level * level / (luminance * luminance + 0.01);
    }
    for (lacked, tile) in lacked.iter_mut().zip(picture) {
        // Light carried by single samples consists of highlights that were hit.
        let left = if lacked.light > 0.0 { (1.0 - tile.rare / lacked.light).max(0.0) } else { 0.0 };
        let LackedHighlights { light, square, relative } = *lacked;
        *lacked = LackedHighlights { light: left * light, square: left * square, relative: left * relative };
    }
    lacked
}
