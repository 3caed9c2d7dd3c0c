//! The error of a picture, estimated from the difference of its replicates.
//!
//! Let a and b be independent pictures of equal expectation, whose sums [`Replicates`](crate::study::Replicates) keeps. The
//! picture that is shown is their mean, and (a − b)²/4 is an unbiased estimate of its variance. This holds for any sampling
//! sequence within a and within b, because only the two randomisations have to be independent, and it needs no reference. They are
//! in any pixel, but which pixels they have visited is not independent: halfway through a round of all pixels each has visited those that the other has
//! not ([`cells`](crate::tracer::sampler::cells)). After 3, 5 and 7 samples per pixel, half of a round, 95 % of the Cornell box by paths is stated with
//! .95 to 1.00 of the true error by a box filter and .99 to 1.02 by a Gaussian, after 4 and 8 with .99 and .99 to 1.00. One
//! pixel's difference says little, so errors are stated for tiles of 8×8 pixels and for the whole picture.
//!
//! Mean and difference of the replicates are uncorrelated, and independent where the noise is symmetric: a decision that
//! depends on the difference does not bias the picture.

use crate::image::compare::luminance;
use crate::math::bits::mix;
use crate::study::blur::Blur;
use crate::study::error_tile::{
    BrightPixel, ErrorTile, FLOOR, PixelError, QuarterSums, ReplicatePixel, TILE, is_far_above, place_bright,
    quarter_of,
};
use crate::study::interval::{Interval, Z90, student_95};
use crate::study::unfound::UnfoundLight;

/// Share of the pixels that both replicates must have reached before an error is stated.
const MIN_COVERAGE: f64 = 0.9;

/// A picture of fewer tiles is not divided into deciding and held-out tiles.
const MIN_TILES: usize = 16;

/// Number of half-samples from which intervals are estimated.
const HALF_SAMPLES: usize = 16;

/// Half-width of a 90 % interval in units of a standard deviation estimated from this number of half-samples.
fn half_interval() -> f64 {
    student_95((HALF_SAMPLES - 1) as f64)
}

/// Standard deviation of the logarithm of relMSE in addition to the scatter of its tiles, because the mean of a quarter replaces the
/// luminance of its pixels.
const DIVISOR_DEVIATION: f64 = 0.05;

/// Expected number of rare events of which none occurs with a probability of 5 %.
const UNMET: f64 = 3.0;

/// The light of the largest samples is spread over this many tiles on each side.
const SPREAD: usize = 2;

/// Samples of other renders in a rectangle of a picture, or in all of it.
#[derive(Clone, Debug, PartialEq)]
pub struct OtherSamples {
    /// First pixel of the rectangle, which may begin outside the picture.
    pub origin: [i64; 2],
    /// Columns and rows.
    pub size: [usize; 2],
    /// Pixels, row-major.
    pub pixels: Vec<ReplicatePixel>,
    /// Paths per pixel, for each pixel.
    pub per_pixel: Vec<f32>,
}

impl OtherSamples {
    /// Mixes them into the pixels of a picture of this width, weighted by paths per pixel, and adds theirs to `per_pixel`.
    pub fn mix_into(&self, picture: &mut [ReplicatePixel], width: usize, per_pixel: &mut [f32]) {
        let height = picture.len() / width.max(1);
        let row = |y: usize| y as i64 + self.origin[1];
        for y in (0..self.size[1]).filter(|y| (0..height as i64).contains(&row(*y))) {
            for x in 0..self.size[0] {
                let column = x as i64 + self.origin[0];
                if (0..width as i64).contains(&column) {
                    let (to, from) = (row(y) as usize * width + column as usize, y * self.size[0] + x);
                    per_pixel[to] += self.per_pixel[from];
                    let share = self.per_pixel[from] / per_pixel[to].max(f32::MIN_POSITIVE);
                    picture[to] = picture[to].mixed(&self.pixels[from], share);
                }
            }
        }
    }
}

impl ReplicatePixel {
    /// Weighted mean of this pixel and another of the same expectation; `share`: weight of the other. Differences of independent pictures
    /// add up, so that the squared sum times the factor is in expectation the variance of the mean.
    fn mixed(&self, other: &Self, share: f32) -> Self {
        if !(self.seen && other.seen) {
            return if other.seen { *other } else { *self };
        }
        let parts = [1.0 - share, share];
        let sum = |a: [f32; 3], b: [f32; 3], [for_a, for_b]: [f32; 2]| -> [f32; 3] {
            std::array::from_fn(|c| a[c] * for_a + b[c] * for_b)
        };
        // Assumes equal weights of the replicates of either pixel, for which the factor is 1/4.
        let weights = [parts[0] * 2.0 * self.factor.sqrt(), parts[1] * 2.0 * other.factor.sqrt()];
        Self {
            mean: sum(self.mean, other.mean, parts),
            difference: sum(self.difference, other.difference, weights),
            factor: 0.25,
            seen: true,
        }
    }
}

/// The tiles that an estimate is taken from. A render that stops at a target decides by one half of the tiles and states the
/// error of the other: a held-out half avoids the bias of stopping at a lucky checkpoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TileSubset {
    /// All tiles.
    All,
    /// The white squares of a chessboard, which decide whether a target is reached.
    Deciding,
    /// The black squares, whose error is stated.
    HeldOut,
}

impl TileSubset {
    /// The subset that is used of this number of tiles: all of them if they are too few to be divided.
    pub(super) fn among(self, tiles: usize) -> Self {
        if tiles < MIN_TILES { TileSubset::All } else { self }
    }

    /// Whether the tile in this column and row belongs to the subset.
    pub(super) fn contains(self, x: usize, y: usize) -> bool {
        match self {
            TileSubset::All => true,
            TileSubset::Deciding => (x + y).is_multiple_of(2),
            TileSubset::HeldOut => !(x + y).is_multiple_of(2),
        }
    }
}

/// Error of a picture per tile; [`estimate`](Self::estimate) computes the stated error.
#[derive(Clone, Debug)]
pub struct ErrorField {
    /// Columns and rows of tiles.
    grid: [usize; 2],
    tiles: Vec<ErrorTile>,
    /// Mean luminance of the picture.
    mean: f64,
    /// Light found by witnesses and missing from the picture.
    unfound: UnfoundLight,
    /// Bias common to both replicates.
    blur: Blur,
    bright: Vec<BrightPixel>,
}

/// Errors of a picture. Each interval is meant to contain the true error of this very picture with a probability of 90 %. The actual
/// coverage is lower if light is found late and no [witness](crate::study::witness) finds it, and for relMSE if light subpaths are shared
/// over the picture: `tools/README.md` has the coverage scene by scene.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ErrorEstimate {
    /// Relative errors that 50 %, 95 % and 99 % of the tiles stay below.
    pub relative: [Interval; 3],
    /// relMSE over RGB.
    pub rel_mse: Interval,
    /// Mean square error of luminance.
    pub mean_square: f64,
}

/// The quantiles of [`ErrorEstimate::relative`].
pub(super) const QUANTILES: [f64; 3] = [0.5, 0.95, 0.99];

/// The [`QUANTILES`] of the relative errors of some tiles; 0 without tiles.
pub(super) fn quantiles(mut errors: Vec<f64>) -> [f64; 3] {
    errors.sort_unstable_by(f64::total_cmp);
    let at = |q: f64| errors.get((q * errors.len() as f64) as usize).or(errors.last()).copied();
    QUANTILES.map(|q| at(q).unwrap_or(0.0))
}

/// Mean luminance of the tile quarter that contains a pixel, for a picture of `size` pixels.
fn quarter_means(pixels: &[ReplicatePixel], size: [usize; 2]) -> impl Fn(usize) -> f64 {
    let [columns, side] = [size[0].div_ceil(TILE / 2), TILE / 2];
    let quarter = move |[x, y]: [usize; 2]| y / side * columns + x / side;
    let places = move || (0..size[1]).flat_map(move |y| (0..size[0]).map(move |x| [x, y]));
    let mut means = vec![(0.0, 0.0); columns * size[1].div_ceil(side)];
    for (pixel, at) in pixels.iter().zip(places()).filter(|(pixel, _)| pixel.seen) {
        let (sum, count) = &mut means[quarter(at)];
        (*sum, *count) = (*sum + luminance(pixel.mean), *count + 1.0);
    }
    move |i: usize| {
        let (sum, count) = means[quarter([i % size[0], i / size[0]])];
        sum / count
    }
}

/// Per pixel, the squared error (mean of R, G and B) over the squared denominator of stated errors: the local luminance plus [`FLOOR`] of
/// the picture's. It is 0 if a replicate has no samples, or if the picture is black. `None` while the replicates have reached too few
/// pixels.
pub(super) fn relative_squares(pixels: &[ReplicatePixel], size: [usize; 2]) -> Option<Vec<f64>> {
    let near = quarter_means(pixels, size);
    let seen = || pixels.iter().enumerate().filter(|(_, pixel)| pixel.seen);
    let (sum, count) = seen().fold((0.0, 0.0), |(sum, n), (_, pixel)| (sum + luminance(pixel.mean), n + 1.0));
    if count == 0.0 || count < MIN_COVERAGE * pixels.len() as f64 {
        return None;
    }
    let mut relative = vec![0.0; pixels.len()];
    for (i, pixel) in seen() {
        let against = near(i).abs() + FLOOR * (sum / count).abs();
        let squares: f64 = pixel.difference.iter().map(|d| f64::from(*d).powi(2)).sum();
        if against > 0.0 {
            relative[i] = squares / 3.0 * f64::from(pixel.factor) / (against * against);
        }
    }
    Some(relative)
}

impl ErrorField {
    /// Error of a picture of `size` pixels. `None` while both replicates have reached too few of them.
    ///
    /// relMSE divides by the squared true luminance of a pixel. Dividing by the noisy luminance would hide the error of exactly those
    /// pixels that are too bright, so the mean of a quarter of the tile is used, except for pixels far brighter than that
    /// (`error_tile.rs`).
    pub fn new(pixels: &[ReplicatePixel], size: [usize; 2]) -> Option<Self> {
        let near = quarter_means(pixels, size);
        let mut field = Self::of_replicates(pixels, &near, |_| None, size)?;
        for (i, pixel) in pixels.iter().enumerate().filter(|(_, pixel)| pixel.seen) {
            let (x, y) = (i % size[0], i / size[0]);
            let place = [y / TILE * field.grid[0] + x / TILE, quarter_of(x, y)];
            let quarter = &mut field.tiles[place[0]].quarters[place[1]];
            let (mean, difference) = (luminance(pixel.mean), luminance(pixel.difference).abs());
            // The factor does not tell which replicate has more samples; this is the smallest possible value.
            let low = mean - (0.5 + (0.25 - f64::from(pixel.factor)).max(0.0).sqrt()) * difference;
            let high = low + difference;
            if is_far_above(high, quarter.least().max(0.0) + FLOOR * field.mean.abs()) {
                let squares = pixel.difference.map(|d| f64::from(d).powi(2) * f64::from(pixel.factor));
                let colors = squares.iter().sum::<f64>() / 3.0;
                quarter.colors = (quarter.colors - colors).max(0.0);
                field.bright.push(BrightPixel { place, mean, low, high, colors });
            }
        }
        field.place_bright();
        Some(field)
    }

    fn place_bright(&mut self) {
        place_bright(&mut self.tiles, &self.bright, self.mean.abs());
    }

    /// The noise of a picture from its replicates, relative to the luminance of a reference: the part of the
    /// [true error](Self::against) that is not bias. Linear Rec.709, all of `size` pixels.
    pub fn noise(pixels: &[ReplicatePixel], reference: &[[f32; 3]], size: [usize; 2]) -> Option<Self> {
        let truth = |i: usize| luminance(reference[i]);
        let is_whole = reference.len() == pixels.len();
        is_whole.then(|| Self::of_replicates(pixels, truth, |i| Some(truth(i)), size)).flatten()
    }

    /// Error of `pixels`; `near` and `relative_to` yield the [luminances](PixelError) of each.
    fn of_replicates(
        pixels: &[ReplicatePixel],
        near: impl Fn(usize) -> f64,
        relative_to: impl Fn(usize) -> Option<f64>,
        size: [usize; 2],
    ) -> Option<Self> {
        let error = |(i, pixel): (usize, &ReplicatePixel)| {
            let factor = f64::from(pixel.factor);
            let squares = pixel.difference.map(|d| f64::from(d).powi(2) * factor);
            let difference = luminance(pixel.difference);
            let (luminance, relative_to, square) = (near(i), relative_to(i), difference.powi(2) * factor);
            pixel.seen.then_some(PixelError { luminance, relative_to, difference, squares, square })
        };
        Self::of(pixels.iter().enumerate().map(error), size)
    }

    /// The true error of a picture against its reference, linear Rec.709, both of `size` pixels.
    pub fn against(picture: &[[f32; 3]], reference: &[[f32; 3]], size: [usize; 2]) -> Option<Self> {
        let value = |(x, r): (&[f32; 3], &[f32; 3])| {
            let difference = [x[0] - r[0], x[1] - r[1], x[2] - r[2]];
            let squares = difference.map(|d| f64::from(d).powi(2));
            let (own, square) = (luminance(*r), luminance(difference).powi(2));
            Some(PixelError { luminance: own, relative_to: Some(own), difference: 0.0, squares, square })
        };
        (picture.len() == reference.len())
            .then(|| Self::of(picture.iter().zip(reference).map(value), size))
            .flatten()
    }

    /// Sums the errors of all pixels, row-major.
    pub(super) fn of(
        mut errors: impl ExactSizeIterator<Item = Option<PixelError>>,
        [width, height]: [usize; 2],
    ) -> Option<Self> {
        let grid = [width.div_ceil(TILE), height.div_ceil(TILE)];
        let mut tiles = vec![ErrorTile::default(); grid[0] * grid[1]];
        let (mut seen, mut sum, count) = (0usize, 0.0, errors.len());
        if count != width * height || count == 0 {
            return None;
        }
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            let Some(Some(pixel)) = errors.next() else { continue };
            let PixelError { luminance, relative_to, difference, squares, square } = pixel;
            let tile = &mut tiles[y / TILE * grid[0] + x / TILE];
            let quarter = &mut tile.quarters[quarter_of(x, y)];
            quarter.pixels += 1.0;
            quarter.square += square;
            quarter.luminance += luminance;
            tile.luminance += luminance;
            quarter.difference += difference;
            let colors = squares.iter().sum::<f64>() / 3.0;
            match relative_to {
                Some(own) => quarter.relative += colors / (own * own + 0.01),
                None => quarter.colors += colors,
            }
            (seen, sum) = (seen + 1, sum + luminance);
        }
        (seen as f64 >= MIN_COVERAGE * count as f64).then(|| {
            let (unfound, blur) = (UnfoundLight::default(), Blur::default());
            Self { grid, tiles, mean: sum / seen as f64, unfound, blur, bright: Vec::new() }
        })
    }

    /// Sum of the luminance of each tile's pixels, row by row.
    pub fn luminances(&self) -> impl Iterator<Item = f64> + '_ {
        self.tiles.iter().map(|tile| tile.luminance)
    }

    /// Spreads `excess`, the part of each tile's luminance carried by few samples, over its neighbourhood of 5×5 tiles.
    ///
    /// Relative errors divide by luminance. If rare samples carry much of it, a tile that has received one is too bright and its relative
    /// error too small; tiles without are too dark. The neighbourhood gives a better estimate of their brightness.
    pub fn spread(&mut self, excess: &[f64]) {
        let [columns, rows] = self.grid;
        if excess.len() < self.tiles.len() {
            return;
        }
        let known = |(tile, excess): (&mut ErrorTile, &f64)| {
            let excess = excess.clamp(0.0, tile.luminance.max(0.0));
            [excess, tile.level(excess), tile.pixels()]
        };
        let known: Vec<[f64; 3]> = self.tiles.iter_mut().zip(excess).map(known).collect();
        let near = |i: usize, n: usize| i.saturating_sub(SPREAD)..(i + SPREAD + 1).min(n);
        for (i, tile) in self.tiles.iter_mut().enumerate() {
            let (x, y) = (i % columns, i / columns);
            let around =
                near(y, rows).flat_map(|y| near(x, columns).map(move |x| y * columns + x)).map(|j| known[j]);
            let [light, taken, area] = around.fold([0.0; 3], |a, b| std::array::from_fn(|i| a[i] + b[i]));
            if area > 0.0 {
                let [excess, _, pixels] = known[i];
                tile.luminance += pixels * light / area - excess;
                tile.brighten(pixels * taken / area);
            }
        }
        self.place_bright();
    }

    /// Adds light missing from the picture to the error of its tiles, and to their luminance.
    pub(super) fn add_unfound(&mut self, unfound: UnfoundLight) {
        for (tile, brightness) in self.tiles.iter_mut().zip(&unfound.brightness) {
            tile.luminance = tile.luminance.max(brightness * tile.pixels());
        }
        self.unfound = unfound;
    }

    /// Adds a bias common to both replicates. Returns its fraction of the squared relative error, summed over all tiles; `None` if it is
    /// insignificant.
    pub(super) fn add_blur(&mut self, blur: Blur) -> Option<f64> {
        self.blur = blur;
        let tiles = 0..self.tiles.len();
        let all: f64 = self.map().iter().map(|relative| relative * relative).sum();
        let blurred = |i| Some(self.blur.square(i, 0.0) / self.divisor(i)?.powi(2));
        let share = if all > 0.0 { tiles.filter_map(blurred).sum::<f64>() / all } else { 0.0 };
        self.blur.is_significant.then_some(share)
    }

    /// Denominator of the relative error of a tile; `None` for a black picture.
    fn divisor(&self, i: usize) -> Option<f64> {
        let pixels = self.tiles[i].pixels();
        let against =
            self.unfound.luminance_of(i, self.tiles[i].luminance / pixels).abs() + FLOOR * self.mean.abs();
        (pixels > 0.0 && against > 0.0).then_some(against)
    }

    /// Columns and rows of tiles.
    pub fn grid(&self) -> [usize; 2] {
        self.grid
    }

    /// Relative error of every tile, row-major; 0 if unknown.
    pub fn map(&self) -> Vec<f64> {
        (0..self.tiles.len()).map(|i| self.relative(i, &[0, 1, 2, 3], 0.0).unwrap_or(0.0)).collect()
    }

    /// Mean square error of luminance.
    pub fn mean_square(&self) -> f64 {
        let [mut square, mut pixels] = [0.0; 2];
        for (i, tile) in self.tiles.iter().enumerate() {
            for quarter in tile.quarters {
                let more = self.unfound.lacks(i, 0.0) + self.blur.square(i, 0.0);
                square += quarter.square + quarter.pixels * more;
                pixels += quarter.pixels;
            }
        }
        if pixels > 0.0 { square / pixels } else { 0.0 }
    }

    /// Mean square error of luminance on a coarser grid, relative to the picture's squared mean luminance, row-major. Empty if the picture
    /// has fewer tiles than the grid has cells.
    pub fn coarse(&self, [columns, rows]: [usize; 2]) -> Vec<f32> {
        if self.grid[0] < columns || self.grid[1] < rows {
            return Vec::new();
        }
        let mut sums = vec![[0.0; 2]; columns * rows];
        for (i, tile) in self.tiles.iter().enumerate() {
            let (x, y) = (i % self.grid[0] * columns / self.grid[0], i / self.grid[0] * rows / self.grid[1]);
            for quarter in tile.quarters {
                let sum = &mut sums[y * columns + x];
                *sum = [sum[0] + quarter.square, sum[1] + quarter.pixels];
            }
        }
        let scale = self.mean.powi(2).max(1e-30);
        sums.iter()
            .map(|[square, pixels]| if *pixels > 0.0 { (square / pixels / scale) as f32 } else { 0.0 })
            .collect()
    }

    fn relative(&self, i: usize, quarters: &[usize], deviations: f64) -> Option<f64> {
        let tile = &self.tiles[i];
        let pixels: f64 = quarters.iter().map(|&q| tile.quarters[q].pixels).sum();
        let square: f64 = quarters.iter().map(|&q| tile.quarters[q].square).sum();
        // The light that the tile may lack is also part of its luminance.
        let [may, is] = [deviations, 0.0].map(|d| self.unfound.known_to_lack(i, d).iter().sum::<f64>());
        let against = self.divisor(i)? + (may - is).max(0.0);
        // Negative if more noise of a reference is subtracted than there is.
        let square =
            (square / pixels).max(0.0) + self.unfound.lacks(i, deviations) + self.blur.square(i, deviations);
        (pixels > 0.0).then(|| square.sqrt() / against)
    }

    /// Quantiles and relMSE of some tiles, from the first `count` quarters of each tile in the order given by `choose`, including missing
    /// light at this number of standard deviations from its estimate.
    fn values(
        &self,
        subset: TileSubset,
        choose: impl Fn(usize) -> [usize; 4],
        count: usize,
        deviations: f64,
    ) -> [f64; 4] {
        let mut errors = Vec::with_capacity(self.tiles.len());
        let (mut relative, mut pixels) = (0.0, 0.0);
        for (i, tile) in
            self.tiles.iter().enumerate().filter(|(i, _)| subset.contains(i % self.grid[0], i / self.grid[0]))
        {
            let quarters = choose(i);
            errors.extend(self.relative(i, &quarters[..count], deviations));
            let luminance = tile.luminance / tile.pixels().max(1.0);
            let more = self.unfound.lacks_relative(i, luminance, deviations)
                + self.blur.square(i, deviations) / (luminance * luminance + 0.01);
            for &q in &quarters[..count] {
                relative += tile.quarters[q].relative() + tile.quarters[q].pixels * more;
                pixels += tile.quarters[q].pixels;
            }
        }
        let [a, b, c] = quantiles(errors);
        [a, b, c, if pixels > 0.0 { relative / pixels } else { 0.0 }]
    }

    /// Largest contribution of a single tile to relMSE.
    fn largest_of_sum(&self, subset: TileSubset) -> f64 {
        let of_tile = |(i, tile): (usize, &ErrorTile)| {
            let counts = subset.contains(i % self.grid[0], i / self.grid[0]);
            counts.then(|| (tile.quarters.iter().map(QuarterSums::relative).sum::<f64>(), tile.pixels()))
        };
        let all = || self.tiles.iter().enumerate().filter_map(of_tile);
        let pixels: f64 = all().map(|(_, pixels)| pixels).sum();
        all().map(|(relative, _)| relative).fold(0.0, f64::max) / pixels.max(1.0)
    }

    /// Estimates the error of some tiles (of all in a tiny picture) with intervals. Errors of a black picture are 0.
    ///
    /// The variance of each number is estimated by balanced half-samples (McCarthy 1969): recomputing a number from a
    /// random half of each tile scatters it by about as much as the number itself scatters. The true error of this picture
    /// varies as much again, independently, which makes the factor 2 in the interval. Student's t allows for the small number of
    /// half-samples.
    ///
    /// If few tiles dominate relMSE, it is heavy-tailed: events like the one in the largest tile may not have occurred in others yet. The
    /// number of such events of which none occurs with a probability of 5 % is three (the rule of three, Hanley and Lippman-Hand 1983).
    pub fn estimate(&self, tiles: TileSubset) -> ErrorEstimate {
        let tiles = tiles.among(self.tiles.len());
        let whole = self.values(tiles, |_| [0, 1, 2, 3], 4, 0.0);
        let is_uncertain = self.unfound.deviation > 0.0
            || self.unfound.possible.iter().any(|light| *light > 0.0)
            || !self.unfound.highlights.is_empty()
            || !self.unfound.scattered.tiles.is_empty()
            || self.blur.deviation > 0.0;
        // Evaluated at both ends of the 90 % interval, because the error is not a power of the number of standard deviations.
        let [more, less] = [Z90, -Z90].map(|deviations| match is_uncertain {
            true => self.values(tiles, |_| [0, 1, 2, 3], 4, deviations),
            false => whole,
        });
        let (mut sums, mut squares) = ([0.0; 4], [0.0; 4]);
        for half in 0..HALF_SAMPLES as u64 {
            let choose = |tile: usize| {
                let word = mix(tile as u64 ^ half << 40);
                let mut kept = [0, 1, 2, 3];
                // A random order of the quarters; the first two are used.
                for i in (1..4).rev() {
                    kept.swap(i, (word >> (16 * i)) as usize % (i + 1));
                }
                kept
            };
            let some = self.values(tiles, choose, 2, 0.0);
            for i in 0..4 {
                let log = if whole[i] > 0.0 { (some[i] / whole[i]).max(1e-9).ln() } else { 0.0 };
                (sums[i], squares[i]) = (sums[i] + log, squares[i] + log * log);
            }
        }
        // Scatter around their own mean, because quantiles of fewer pixels are all biased outwards.
        let count = HALF_SAMPLES as f64;
        let variance = |i: usize| ((squares[i] - sums[i] * sums[i] / count) / (count - 1.0)).max(0.0);
        let widened = half_interval() / Z90;
        // Upper and lower part.
        let of_bias = |i: usize| {
            let whole = whole[i];
            let log = |ratio: f64| if whole > 0.0 { ratio.max(1.0).ln() / Z90 } else { 0.0 };
            [log(more[i] / whole), log(whole / less[i].max(0.1 * whole))]
        };
        let is_guessed =
            self.tiles.iter().flat_map(|tile| &tile.quarters).any(|quarter| quarter.colors > 0.0);
        let interval = |i: usize| {
            let scatter = widened * (2.0 * variance(i)).sqrt();
            if i < 3 || !is_guessed {
                return Interval::of_logs(whole[i], of_bias(i).map(|bias| scatter.hypot(bias)));
            }
            let deviations = of_bias(i).map(|bias| scatter.hypot(bias).hypot(DIVISOR_DEVIATION));
            let mut of_sum = Interval::of_logs(whole[i], deviations);
            of_sum.high += UNMET * self.largest_of_sum(tiles);
            of_sum
        };
        ErrorEstimate {
            relative: [interval(0), interval(1), interval(2)],
            rel_mse: interval(3),
            mean_square: self.mean_square(),
        }
    }
}

impl ErrorEstimate {
    /// Standard deviation of the logarithm of the stated error alone, excluding the variation of the true error; used as weight in a fit.
    pub fn log_deviation(interval: &Interval) -> f64 {
        if interval.value > 0.0 {
            (interval.value / interval.low).ln() / half_interval() / std::f64::consts::SQRT_2
        } else {
            0.0
        }
    }
}
