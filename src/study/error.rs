//! The error of a picture, from the difference of its replicates.
//!
//! Of two independent pictures a and b of equal expectation, the mean has the variance (a − b)²/4 in the mean, whatever the
//! sequence within each: that is exact, and needs no reference. One pixel's difference says little; the errors that are stated
//! are those of neighbourhoods of 8×8 pixels, and of the whole picture.
//!
//! A picture's mean and its replicates' difference are uncorrelated and, where noise is symmetric, independent: what is decided
//! by the difference does not bias the picture.

use crate::math::bits::mix;
use crate::study::interval::{Interval, Z90};

/// Pixels along each side of a neighbourhood.
pub const TILE: usize = 8;

/// Relative errors are relative to a neighbourhood's luminance and this share of the picture's, so that black has one.
pub const FLOOR: f64 = 0.01;

/// Share of the pixels that both replicates must have reached before an error is stated.
const SEEN: f64 = 0.9;

/// Neighbourhoods below which a picture is not divided into parts.
const FEW: usize = 16;

/// Selections of half of what is known, to see how far figures depend on chance.
const HALVES: usize = 16;

/// One pixel, linear Rec.709.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pixel {
    /// Mean of the replicates, weighted by their samples.
    pub mean: [f32; 3],
    /// First less second.
    pub difference: [f32; 3],
    /// Variance of the mean in units of the squared difference: product of the weights, 1/4 for equal ones.
    pub factor: f32,
    /// Both replicates have samples there.
    pub seen: bool,
}

/// Which neighbourhoods a figure is taken from. Decisions are made from one half and results stated from the other, or the result
/// would be the luckiest of all that were looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// All.
    All,
    /// The white squares of a chessboard.
    Decide,
    /// The black ones.
    State,
}

impl Part {
    /// True for a neighbourhood in this column and row.
    fn holds(self, x: usize, y: usize) -> bool {
        match self {
            Part::All => true,
            Part::Decide => (x + y).is_multiple_of(2),
            Part::State => !(x + y).is_multiple_of(2),
        }
    }
}

/// What is known of one pixel.
struct Value {
    /// What its error is relative to.
    luminance: f64,
    /// Squared error by channel.
    squares: [f64; 3],
    /// Squared error of luminance.
    square: f64,
}

/// What is known of one quarter of a neighbourhood: sums over its pixels.
#[derive(Clone, Copy, Debug, Default)]
struct Quarter {
    pixels: f64,
    /// Squared error of luminance.
    square: f64,
    /// Squared error as relMSE has it.
    relative: f64,
}

/// A neighbourhood of [`TILE`]² pixels.
#[derive(Clone, Copy, Debug, Default)]
struct Tile {
    quarters: [Quarter; 4],
    luminance: f64,
}

/// The error of a picture, to be asked for figures.
#[derive(Clone, Debug)]
pub struct ErrorField {
    /// Columns and rows of neighbourhoods.
    grid: [usize; 2],
    tiles: Vec<Tile>,
    /// Mean luminance of the picture.
    mean: f64,
}

/// Figures, each with the interval that holds the error of this very picture with 90 %.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Figures {
    /// Relative error that half, 95 % and 99 % of the neighbourhoods stay below.
    pub relative: [Interval; 3],
    /// relMSE over RGB.
    pub rel_mse: Interval,
    /// Mean square error of luminance.
    pub mean_square: f64,
}

/// The quantiles of [`Figures::relative`].
pub const QUANTILES: [f64; 3] = [0.5, 0.95, 0.99];

fn luminance(rgb: [f32; 3]) -> f64 {
    crate::image::compare::luminance(rgb)
}

impl ErrorField {
    /// The error of a picture of `size` pixels. `None` while too few of them have been reached by both replicates.
    ///
    /// relMSE divides by the square of a pixel's true luminance. A noisy one in its place would hide the error of just those pixels
    /// that are too bright, so that the mean of a quarter of the neighbourhood takes it.
    pub fn new(pixels: &[Pixel], size: [usize; 2]) -> Option<Self> {
        let [columns, side] = [size[0].div_ceil(TILE / 2), TILE / 2];
        // Of the neighbourhood that a pixel lies in, the quarter.
        let quarter = move |[x, y]: [usize; 2]| y / side * columns + x / side;
        let places = move || (0..size[1]).flat_map(move |y| (0..size[0]).map(move |x| [x, y]));
        let mut means = vec![(0.0, 0.0); columns * size[1].div_ceil(side)];
        for (pixel, at) in pixels.iter().zip(places()).filter(|(pixel, _)| pixel.seen) {
            let (sum, count) = &mut means[quarter(at)];
            (*sum, *count) = (*sum + luminance(pixel.mean), *count + 1.0);
        }
        let squared =
            |pixel: &Pixel| pixel.difference.map(|d| f64::from(d).powi(2) * f64::from(pixel.factor));
        let value = |(pixel, at): (&Pixel, [usize; 2])| {
            let (sum, count) = means[quarter(at)];
            let square = luminance(pixel.difference).powi(2) * f64::from(pixel.factor);
            pixel.seen.then(|| Value { luminance: sum / count, squares: squared(pixel), square })
        };
        Self::of(pixels.iter().zip(places()).map(value), (pixels.len(), size))
    }

    /// The error of a picture whose true colours are known, from its replicates all the same: what of the
    /// [true error](Self::against) is noise. Linear Rec.709, all of `size` pixels.
    pub fn noise(pixels: &[Pixel], reference: &[[f32; 3]], size: [usize; 2]) -> Option<Self> {
        let value = |(pixel, reference): (&Pixel, &[f32; 3])| {
            let [factor, y] = [f64::from(pixel.factor), luminance(pixel.difference)];
            let squares = pixel.difference.map(|d| f64::from(d).powi(2) * factor);
            pixel.seen.then(|| Value { luminance: luminance(*reference), squares, square: y * y * factor })
        };
        Self::of(pixels.iter().zip(reference).map(value), (pixels.len().min(reference.len()), size))
    }

    /// The true error of a picture, against its reference: linear Rec.709, both of `size` pixels.
    pub fn against(picture: &[[f32; 3]], reference: &[[f32; 3]], size: [usize; 2]) -> Option<Self> {
        let value = |(x, r): (&[f32; 3], &[f32; 3])| {
            let difference = [x[0] - r[0], x[1] - r[1], x[2] - r[2]];
            let squares = difference.map(|d| f64::from(d).powi(2));
            Some(Value { luminance: luminance(*r), squares, square: luminance(difference).powi(2) })
        };
        Self::of(picture.iter().zip(reference).map(value), (picture.len().min(reference.len()), size))
    }

    /// From `count` values, row by row.
    fn of(
        mut values: impl Iterator<Item = Option<Value>>,
        (count, [width, height]): (usize, [usize; 2]),
    ) -> Option<Self> {
        let grid = [width.div_ceil(TILE), height.div_ceil(TILE)];
        let mut tiles = vec![Tile::default(); grid[0] * grid[1]];
        let (mut seen, mut sum) = (0usize, 0.0);
        if count != width * height || count == 0 {
            return None;
        }
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            let Some(Some(Value { luminance, squares, square })) = values.next() else { continue };
            let tile = &mut tiles[y / TILE * grid[0] + x / TILE];
            let quarter = &mut tile.quarters[x % TILE / (TILE / 2) + 2 * (y % TILE / (TILE / 2))];
            quarter.pixels += 1.0;
            quarter.square += square;
            quarter.relative += squares.iter().sum::<f64>() / 3.0 / (luminance * luminance + 0.01);
            tile.luminance += luminance;
            (seen, sum) = (seen + 1, sum + luminance);
        }
        (seen as f64 >= SEEN * count as f64).then(|| Self { grid, tiles, mean: sum / seen as f64 })
    }

    /// Columns and rows of the neighbourhoods.
    pub fn grid(&self) -> [usize; 2] {
        self.grid
    }

    /// Relative error of every neighbourhood, row by row; 0 where nothing is known.
    pub fn map(&self) -> Vec<f64> {
        self.tiles.iter().map(|tile| self.relative(tile, &[0, 1, 2, 3]).unwrap_or(0.0)).collect()
    }

    /// Mean square error of luminance.
    pub fn mean_square(&self) -> f64 {
        let quarters = || self.tiles.iter().flat_map(|tile| tile.quarters);
        let [square, pixels] = quarters().fold([0.0; 2], |[s, p], q| [s + q.square, p + q.pixels]);
        if pixels > 0.0 { square / pixels } else { 0.0 }
    }

    /// Mean square error of luminance on a coarser grid of so many columns and rows, relative to the picture's squared mean
    /// luminance; row by row. Nothing for a picture of fewer neighbourhoods than cells.
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

    fn relative(&self, tile: &Tile, quarters: &[usize]) -> Option<f64> {
        let all: f64 = tile.quarters.iter().map(|q| q.pixels).sum();
        let pixels: f64 = quarters.iter().map(|&q| tile.quarters[q].pixels).sum();
        let square: f64 = quarters.iter().map(|&q| tile.quarters[q].square).sum();
        let against = (tile.luminance / all).abs() + FLOOR * self.mean.abs();
        (pixels > 0.0 && against > 0.0).then(|| (square / pixels).sqrt() / against)
    }

    /// Quantiles and relMSE of a part, from the first `count` of the quarters that `choose` orders for every tile.
    fn values(&self, part: Part, choose: impl Fn(usize) -> [usize; 4], count: usize) -> [f64; 4] {
        let mut errors = Vec::with_capacity(self.tiles.len());
        let (mut relative, mut pixels) = (0.0, 0.0);
        for (i, tile) in
            self.tiles.iter().enumerate().filter(|(i, _)| part.holds(i % self.grid[0], i / self.grid[0]))
        {
            let quarters = choose(i);
            errors.extend(self.relative(tile, &quarters[..count]));
            for &q in &quarters[..count] {
                relative += tile.quarters[q].relative;
                pixels += tile.quarters[q].pixels;
            }
        }
        errors.sort_unstable_by(f64::total_cmp);
        let at =
            |q: f64| errors.get((q * errors.len() as f64) as usize).or(errors.last()).copied().unwrap_or(0.0);
        let [a, b, c] = QUANTILES.map(at);
        [a, b, c, if pixels > 0.0 { relative / pixels } else { 0.0 }]
    }

    /// The figures and their intervals; those of the whole where a part holds none. Errors are 0 where nothing has luminance.
    ///
    /// How far a figure would differ with other replicates is seen by taking half of each neighbourhood at random: the difference to
    /// the whole has the variance that the whole has (half-samples; McCarthy 1969). The true error of this picture varies as
    /// much again, independently.
    pub fn figures(&self, part: Part) -> Figures {
        let part = if self.tiles.len() < FEW { Part::All } else { part };
        let whole = self.values(part, |_| [0, 1, 2, 3], 4);
        let (mut sums, mut squares) = ([0.0; 4], [0.0; 4]);
        for half in 0..HALVES as u64 {
            let choose = |tile: usize| {
                let word = mix(tile as u64 ^ half << 40);
                let mut kept = [0, 1, 2, 3];
                // A random order of the quarters; the first half is kept.
                for i in (1..4).rev() {
                    kept.swap(i, (word >> (16 * i)) as usize % (i + 1));
                }
                kept
            };
            let some = self.values(part, choose, 2);
            for i in 0..4 {
                let log = if whole[i] > 0.0 { (some[i] / whole[i]).max(1e-9).ln() } else { 0.0 };
                (sums[i], squares[i]) = (sums[i] + log, squares[i] + log * log);
            }
        }
        // Around their own mean: quantiles of fewer pixels lie further out, all of them.
        let count = HALVES as f64;
        let variance = |i: usize| ((squares[i] - sums[i] * sums[i] / count) / (count - 1.0)).max(0.0);
        let interval = |i: usize| Interval::of_log(whole[i], (2.0 * variance(i)).sqrt());
        Figures {
            relative: [interval(0), interval(1), interval(2)],
            rel_mse: interval(3),
            mean_square: self.mean_square(),
        }
    }
}

impl Figures {
    /// Standard deviation of the logarithm of the stated error alone, without that of the true one: what a fit weighs it by.
    pub fn log_deviation(interval: &Interval) -> f64 {
        if interval.value > 0.0 {
            (interval.high / interval.value).ln() / Z90 / std::f64::consts::SQRT_2
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noise of a known size: 5 % of the luminance in either replicate, independent.
    fn noisy(side: usize, seed: u64) -> Vec<Pixel> {
        let uniform = |i: u64| (mix(i) >> 11) as f64 / (1u64 << 53) as f64;
        // Sums of twelve uniform numbers less six: variance 1.
        let normal = |i: u64| (0..12).map(|k| uniform(seed << 40 ^ i << 4 ^ k)).sum::<f64>() - 6.0;
        let pixel = |i: usize| {
            let [a, b] = [0, 1].map(|r| (1.0 + 0.05 * normal(2 * i as u64 + r)) as f32);
            Pixel { mean: [(a + b) / 2.0; 3], difference: [a - b; 3], factor: 0.25, seen: true }
        };
        (0..side * side).map(pixel).collect()
    }

    #[test]
    fn the_error_is_that_of_the_mean_and_its_interval_holds_the_truth() {
        let (side, mut held) = (64, 0);
        for seed in 0..200 {
            let pixels = noisy(side, seed);
            let field = ErrorField::new(&pixels, [side; 2]).expect("every pixel was seen");
            let figures = field.figures(Part::All);
            let median = figures.relative[0].value * 1.01;
            assert!((median / (0.05 / 2f64.sqrt()) - 1.0).abs() < 0.08, "{median}");
            let mean: Vec<[f32; 3]> = pixels.iter().map(|pixel| pixel.mean).collect();
            let truth = vec![[1.0; 3]; side * side];
            let against = ErrorField::against(&mean, &truth, [side; 2]).expect("two pictures");
            held += usize::from(figures.relative[1].holds(against.figures(Part::All).relative[1].value));
            let noise = ErrorField::noise(&pixels, &truth, [side; 2]).expect("every pixel was seen");
            let ratio = noise.figures(Part::All).rel_mse.value / against.figures(Part::All).rel_mse.value;
            assert!((ratio - 1.0).abs() < 0.2, "{ratio}");
        }
        // 90 % of 200, within three standard deviations and what 16 selections do to a tail.
        assert!((165..=195).contains(&held), "{held}");
    }

    #[test]
    fn black_pictures_and_tiny_ones_are_no_trouble() {
        let black = vec![Pixel { factor: 0.25, seen: true, ..Pixel::default() }; 64];
        let field = ErrorField::new(&black, [8, 8]).expect("every pixel was seen");
        assert_eq!(field.figures(Part::State).relative[1].value, 0.0);
        assert!(field.coarse([12, 12]).is_empty() && field.map() == [0.0]);
        let one = noisy(1, 7);
        let field = ErrorField::new(&one, [1, 1]).expect("one pixel");
        assert!(field.figures(Part::Decide).relative[1].value >= 0.0);
        assert!(ErrorField::new(&[], [0, 0]).is_none());
        let unseen = vec![Pixel::default(); 64];
        assert!(ErrorField::new(&unseen, [8, 8]).is_none());
    }

    #[test]
    fn both_halves_of_a_picture_say_the_same() {
        let field = ErrorField::new(&noisy(128, 3), [128; 2]).expect("every pixel was seen");
        let [a, b] = [Part::Decide, Part::State].map(|part| field.figures(part).relative[0].value);
        assert!((a / b - 1.0).abs() < 0.05 && a != b, "{a} {b}");
        assert_eq!(field.coarse([4, 4]).len(), 16);
    }
}
