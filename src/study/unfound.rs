//! Light missing from a picture, as included in the stated error.

use crate::math::bits::mix;
use crate::stream::WitnessedArea;
use crate::study::highlights::{HIGHLIGHT_DEVIATION, LackedHighlights};
use crate::study::interval::Z90;
use crate::study::picture_tile::PictureTile;

/// Up to this fraction, two rare samples of a tile lie in one place by chance.
const BY_CHANCE: f64 = 0.25;

/// Light missing from an unknown subset of tiles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScatteredLight {
    /// As many tiles as are estimated to lack it, ascending; chosen among those that have received no rare sample.
    pub tiles: Vec<usize>,
    /// Mean luminance that each of them lacks.
    pub light: f64,
    /// Root mean square over pixels of the missing luminance; exceeds the mean if it is concentrated in few pixels, as for highlights.
    pub rms: f64,
    /// Relative standard deviation of `light` and `rms`.
    pub deviation: f64,
}

/// Distribution of the light of caustics over the pixels of a tile, and its colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CausticSpots {
    /// Fraction of the pixels that receive it, assuming it is equal in all of these.
    pub part: f64,
    /// Lower bound of that fraction: attributes all scatter between samples to unevenness, including that of photons.
    pub least_part: f64,
    /// Mean square of linear Rec.709 over squared luminance: 1 for grey.
    pub colors: f64,
}

/// Lower bound of [`CausticSpots::colors`]: squared luminance is at most 3 · (0.2126² + 0.7152² + 0.0722²) of the mean square.
const LEAST_COLORS: f64 = 0.588;

impl CausticSpots {
    /// Estimate from what witnesses have found; grey and even if their sum of squared luminance is not above `rounding`.
    pub(super) fn of(area: &WitnessedArea, rounding: f64) -> Self {
        let [luminance, colors] = area.caustic_squares;
        let samples = area.samples.max(1.0);
        if luminance.is_nan() || luminance <= rounding {
            return Self::default();
        }
        let part = |squares: f64| {
            let part = area.caustics * area.caustics / (squares.max(rounding) * samples);
            part.clamp(1.0 / samples, 1.0)
        };
        Self {
            part: part(area.caustic_pairs),
            least_part: part(luminance),
            colors: (colors / luminance).max(LEAST_COLORS),
        }
    }

    /// Fraction of the pixels at this number of standard deviations from the estimate: at the upper end of a 90 % interval of a mean square
    /// the lower bound, at the lower end 1.
    fn part(&self, deviations: f64) -> f64 {
        let end = if deviations > 0.0 { self.least_part } else { 1.0 };
        self.part * (end / self.part).powf((deviations.abs() / Z90).min(1.0))
    }

    /// Fractions at which an error is extremal at this number of standard deviations, if it is largest at the fraction `most`: both ends,
    /// and `most` if it lies between them.
    fn parts(&self, deviations: f64, most: f64) -> [f64; 3] {
        let (part, end) = (self.part(0.0), self.part(deviations));
        [part, end, most.clamp(part.min(end), part.max(end))]
    }
}

impl Default for CausticSpots {
    /// Grey and even.
    fn default() -> Self {
        Self { part: 1.0, least_part: 1.0, colors: 1.0 }
    }
}

/// Light missing from a picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UnfoundLight {
    /// Missing mean luminance per tile, row-major.
    pub light: Vec<f64>,
    /// Caustics part of `light`.
    pub caustic_light: Vec<f64>,
    /// Luminance of each tile, present and missing.
    pub brightness: Vec<f64>,
    /// Relative standard deviation of `light`.
    pub deviation: f64,
    /// Caustics possibly missing from each tile: mean luminance at the upper end of the 90 % interval of their fraction, even if
    /// insignificant; empty without witnesses.
    pub possible: Vec<f64>,
    /// Distribution of caustics in each tile; empty without witnesses.
    pub spots: Vec<CausticSpots>,
    /// Highlights missing from each tile in addition; empty if there are none.
    pub highlights: Vec<LackedHighlights>,
    /// Light missing from an unknown subset of tiles, in addition.
    pub scattered: ScatteredLight,
    /// Light found by witnesses and missing from the picture, as a fraction of all light; `None` without witnesses.
    pub share: Option<f64>,
    /// Caustics part of `share`.
    pub caustics: f64,
    /// Highlights part of `share`.
    pub in_highlights: f64,
}

impl UnfoundLight {
    /// Adds missing highlights.
    pub(super) fn add_highlights(&mut self, highlights: Vec<LackedHighlights>, picture: &[PictureTile]) {
        for (brightness, lacked) in self.brightness.iter_mut().zip(&highlights) {
            *brightness += lacked.light;
        }
        let light: f64 = highlights.iter().map(|lacked| lacked.light).sum();
        let known: f64 = self.light.iter().sum();
        let shown: f64 = picture.iter().map(|tile| tile.light).sum();
        if light > 0.0 && shown > 0.0 {
            let before = if known > 0.0 { self.caustics * (shown + known) } else { 0.0 };
            let all = shown + known + light;
            self.share = Some((known + light) / all);
            (self.caustics, self.in_highlights) = (before / all, light / all);
        }
        self.share = self.share.or(Some(0.0));
        self.highlights = highlights;
    }

    /// Mean luminance known to be missing from a tile.
    fn known(&self, tile: usize) -> f64 {
        self.light[tile] + self.highlights.get(tile).map_or(0.0, |lacked| lacked.light)
    }

    /// Mean luminance of caustics and of other light missing from a tile according to witnesses, at this number of standard deviations from
    /// their estimate.
    pub(super) fn known_to_lack(&self, tile: usize, deviations: f64) -> [f64; 2] {
        let UnfoundLight { light, caustic_light, deviation, possible, .. } = self;
        let [all, caustics, possible] =
            [light, caustic_light, possible].map(|of| of.get(tile).copied().unwrap_or_default());
        let times = factor(*deviation, deviations);
        [(caustics * times).max(possible * deviations / Z90), (all - caustics).max(0.0) * times]
    }

    /// Mean square over pixels of the luminance missing from a tile, at this number of standard deviations from the estimate.
    pub(super) fn lacks(&self, tile: usize, deviations: f64) -> f64 {
        let UnfoundLight { highlights, scattered, spots, .. } = self;
        let [caustics, other] = self.known_to_lack(tile, deviations);
        let part = spots.get(tile).copied().unwrap_or_default().part(deviations);
        let uneven = (1.0 / part - 1.0) * caustics * caustics;
        let more = if self.is_scattered(tile) {
            scattered.rms * factor(scattered.deviation, deviations)
        } else {
            0.0
        };
        let lacked = highlights.get(tile).map_or(0.0, |lacked| lacked.square);
        (caustics + other + more).powi(2) + uneven + lacked * factor(HIGHLIGHT_DEVIATION, deviations)
    }

    /// Mean over the pixels of a tile of the squared missing luminance over squared luminance plus 0.01, as in relMSE; `luminance`: of the
    /// tile.
    pub(super) fn lacks_relative(&self, tile: usize, luminance: f64, deviations: f64) -> f64 {
        let UnfoundLight { highlights, scattered, spots, .. } = self;
        let square = |lacks: f64, of: f64| lacks * lacks / (of * of + 0.01);
        // The expected missing light is part of the luminance.
        let shown = (luminance - self.known_to_lack(tile, 0.0).iter().sum::<f64>()).max(0.0);
        let [caustics, other] = self.known_to_lack(tile, deviations);
        // Caustics fall on a fraction of the pixels, which are correspondingly brighter.
        let spots = spots.get(tile).copied().unwrap_or_default();
        let of_part = |part: f64| {
            let there = caustics / part;
            let squares = spots.colors * there * there + 2.0 * there * other + other * other;
            let in_part = squares / ((shown + other + there).powi(2) + 0.01);
            part * in_part + (1.0 - part) * square(other, shown + other)
        };
        // At the smallest fraction caustics are so bright that few pixels determine their relative error; it is largest at about the
        // fraction where they are as bright as all other light.
        let parts = spots.parts(deviations, caustics / (shown + other).max(f64::MIN_POSITIVE));
        let known = match deviations {
            d if d > 0.0 => parts.map(of_part).into_iter().fold(0.0, f64::max),
            d if d < 0.0 => parts.map(of_part).into_iter().fold(f64::INFINITY, f64::min),
            _ => of_part(spots.part),
        };
        let lacked = highlights.get(tile).map_or(0.0, |lacked| lacked.relative);
        let known = known + lacked * factor(HIGHLIGHT_DEVIATION, deviations);
        if !self.is_scattered(tile) || scattered.light <= 0.0 {
            return known;
        }
        // A fraction of the pixels lacks all of it, and is correspondingly brighter.
        let part = (scattered.light / scattered.rms).powi(2);
        let lacks = scattered.light / part * factor(scattered.deviation, deviations);
        known + part * square(lacks, luminance + lacks)
    }

    /// Whether the tile is in the chosen subset that lacks scattered light.
    fn is_scattered(&self, tile: usize) -> bool {
        self.scattered.tiles.binary_search(&tile).is_ok()
    }

    /// Luminance of a tile including missing light, where its neighbourhood suggests `luminance`.
    pub(super) fn luminance_of(&self, tile: usize, luminance: f64) -> f64 {
        let shown = self.brightness.get(tile).copied().unwrap_or_default();
        if self.is_scattered(tile) { luminance.max(shown + self.scattered.light) } else { luminance }
    }

    /// Adds light missing from an unknown subset of tiles.
    pub(super) fn add_scattered(&mut self, picture: &[PictureTile]) {
        self.scattered = scattered(picture, self);
    }
}

/// Factor on a light of relative standard deviation `deviation` at this number of standard deviations: lognormal, since it is never
/// negative, and light found by few paths may be several times as much.
fn factor(deviation: f64, deviations: f64) -> f64 {
    (deviations * deviation.powi(2).ln_1p().sqrt()).exp()
}

/// Light missing from an unknown subset of tiles, estimated from the light found in exactly one sample (Good 1953): in expectation, as much
/// is not found at all. The number of these tiles is estimated by Chao (1984).
fn scattered(picture: &[PictureTile], unfound: &UnfoundLight) -> ScatteredLight {
    let met = |n: f64| picture.iter().filter(move |tile| tile.count == n);
    let [once, twice] = [1.0, 2.0].map(|n| met(n).count() as f64);
    let mut tiles: Vec<usize> =
        (0..picture.len()).filter(|&i| picture[i].count == 0.0 && unfound.known(i) == 0.0).collect();
    let number = (once * (once - 1.0) / (2.0 * (twice + 1.0))).round();
    // Includes what witnesses have found in tiles without rare samples.
    let known: f64 = (0..picture.len()).filter(|&i| picture[i].count == 0.0).map(|i| unfound.known(i)).sum();
    let light = (met(1.0).map(|tile| tile.rare).sum::<f64>() - known) / number;
    if number < 1.0 || light <= 0.0 {
        return ScatteredLight::default();
    }
    // The subset is unknown, so any tiles are chosen.
    tiles.sort_unstable_by_key(|&i| mix(i as u64));
    tiles.truncate(number as usize);
    tiles.sort_unstable();
    // Two samples in one place contribute four times the square of one; in two places, twice.
    let [one, two] =
        [1.0, 2.0].map(|n| met(n).map(|tile| tile.peak).sum::<f64>() / met(n).count().max(1) as f64);
    let points = if one > 0.0 { 2.0 * two / one - 1.0 } else { 0.0 };
    let points = ((points - BY_CHANCE) / (1.0 - BY_CHANCE)).clamp(0.0, 1.0);
    let rms = light * (points * one + 1.0 - points).max(1.0).sqrt();
    ScatteredLight { tiles, light, rms, deviation: 1.0 / once.sqrt() }
}
