//! Sums over tiles of a picture, from which its [error](crate::study::error) is computed, and the luminance in the denominator of relMSE.

/// Mean and difference of the replicates in one pixel, linear Rec.709.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReplicatePixel {
    /// Mean of the replicates, weighted by their samples.
    pub mean: [f32; 3],
    /// First replicate minus second.
    pub difference: [f32; 3],
    /// Factor by which the squared difference becomes the variance of the mean: product of the replicates' weights, 1/4 if these are equal.
    pub factor: f32,
    /// Whether both replicates have samples here.
    pub seen: bool,
}

/// Errors are relative to a tile's mean luminance plus this share of the picture's, so that black tiles have a relative error
/// too.
pub const FLOOR: f64 = 0.01;

/// Width and height of a tile in pixels.
pub const TILE: usize = 8;

/// A pixel counts as far above its surroundings from this multiple of their luminance on.
const FAR: f64 = 4.0;

/// The error of one pixel.
pub(super) struct PixelError {
    /// Luminance of the pixel, or the mean of its quarter of a tile.
    pub(super) luminance: f64,
    /// Luminance in the denominator of relMSE; `None` if the mean of its tile quarter is used.
    pub(super) relative_to: Option<f64>,
    /// Luminance of the first replicate minus that of the second; 0 if the true luminance is known.
    pub(super) difference: f64,
    /// Squared error by channel.
    pub(super) squares: [f64; 3],
    /// Squared error of luminance.
    pub(super) square: f64,
}

/// Sums over the pixels of one quarter of a tile.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct QuarterSums {
    pub(super) pixels: f64,
    /// Squared error of luminance.
    pub(super) square: f64,
    /// Luminance.
    pub(super) luminance: f64,
    /// Luminance of the first replicate minus that of the second.
    pub(super) difference: f64,
    /// Squared error (mean of R, G and B) of the pixels without a known luminance.
    pub(super) colors: f64,
    /// Squared error relative to squared luminance, as in relMSE, of the other pixels.
    pub(super) relative: f64,
    /// As `relative`, of bright pixels.
    pub(super) bright: f64,
}

impl QuarterSums {
    pub(super) fn mean(&self) -> f64 {
        if self.pixels > 0.0 { self.luminance / self.pixels } else { 0.0 }
    }

    /// Mean by the replicate with less light.
    pub(super) fn least(&self) -> f64 {
        if self.pixels > 0.0 { self.mean() - 0.5 * self.difference.abs() / self.pixels } else { 0.0 }
    }

    /// Squared error relative to squared luminance, as in relMSE, of all pixels.
    pub(super) fn relative(&self) -> f64 {
        let mean = self.mean();
        self.relative + self.bright + self.colors / (mean * mean + 0.01)
    }
}

/// Sums of a tile of [`TILE`]² pixels.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ErrorTile {
    pub(super) quarters: [QuarterSums; 4],
    /// Luminance.
    pub(super) luminance: f64,
}

impl ErrorTile {
    pub(super) fn pixels(&self) -> f64 {
        self.quarters.iter().map(|quarter| quarter.pixels).sum()
    }

    /// Takes so much luminance from the brightest quarters, so that they come down to the same mean, but from none what both replicates have
    /// seen of it. Returns what it has taken.
    pub(super) fn level(&mut self, excess: f64) -> f64 {
        let before: f64 = self.quarters.iter().map(|quarter| quarter.luminance).sum();
        let mut excess = excess.clamp(0.0, before.max(0.0));
        let mut order = [0, 1, 2, 3];
        order.sort_unstable_by(|a, b| self.quarters[*b].mean().total_cmp(&self.quarters[*a].mean()));
        let mut level = self.quarters[order[0]].mean();
        for above in 1..=4 {
            let next = order.get(above).map_or(f64::NEG_INFINITY, |quarter| self.quarters[*quarter].mean());
            let pixels: f64 = order[..above].iter().map(|quarter| self.quarters[*quarter].pixels).sum();
            if pixels > 0.0 {
                let down = (level - next).min(excess / pixels);
                (level, excess) = (level - down, excess - down * pixels);
            }
        }
        for quarter in &mut self.quarters {
            let least = quarter.least() * quarter.pixels;
            quarter.luminance = quarter.luminance.min((level * quarter.pixels).max(least));
        }
        before - self.quarters.iter().map(|quarter| quarter.luminance).sum::<f64>()
    }

    /// Adds luminance, to all pixels the same.
    pub(super) fn brighten(&mut self, by: f64) {
        let pixels = self.pixels();
        for quarter in &mut self.quarters {
            quarter.luminance += if pixels > 0.0 { by * quarter.pixels / pixels } else { 0.0 };
        }
    }
}

/// A pixel far brighter than its surroundings in at least one replicate: either a bright feature, such as the edge of a lamp, or a firefly.
/// The estimate of Good (1953) yields the fraction of such pixels' light that would recur in further samples: four times the number of
/// pixels bright in both replicates over the number of those bright in one, counted by octaves of their luminance.
#[derive(Clone, Copy, Debug)]
pub(super) struct BrightPixel {
    /// Tile and quarter.
    pub(super) place: [usize; 2],
    /// Luminance.
    pub(super) mean: f64,
    /// Luminance in the replicate that has less, as a lower bound.
    pub(super) low: f64,
    /// Luminance in the other replicate.
    pub(super) high: f64,
    /// Squared error, mean of R, G and B.
    pub(super) colors: f64,
}

impl BrightPixel {
    /// Whether both replicates hold about as much light far above these surroundings.
    fn is_in_both(&self, surroundings: f64) -> bool {
        self.low > (FAR * surroundings).max(0.25 * self.high)
    }
}

/// Weight of the ratio over all octaves, as a number of bright pixels in one octave.
const FEW: f64 = 4.0;

/// Number of octaves distinguished.
const OCTAVES: usize = 16;

/// The quarter of its tile that the pixel in this column and row lies in.
pub(super) fn quarter_of(x: usize, y: usize) -> usize {
    x % TILE / (TILE / 2) + 2 * (y % TILE / (TILE / 2))
}

/// Whether a luminance is far above that of its surroundings.
pub(super) fn is_far_above(luminance: f64, surroundings: f64) -> bool {
    luminance > FAR * surroundings
}

/// Adds the errors of bright pixels, relative to the estimate of their luminance.
pub(super) fn place_bright(tiles: &mut [ErrorTile], bright: &[BrightPixel], mean: f64) {
    let near = |tiles: &[ErrorTile], pixel: &BrightPixel| {
        let [tile, quarter] = pixel.place;
        tiles[tile].quarters[quarter].mean().max(0.0) + FLOOR * mean
    };
    // Octaves begin at a sixteenth of the picture's mean.
    let octave = |pixel: &BrightPixel| {
        let ratio = 16.0 * pixel.high / mean.max(f64::MIN_POSITIVE);
        (ratio.max(1.0).log2() as usize).min(OCTAVES - 1)
    };
    // Number of pixels per octave that are bright in one replicate, and in both.
    let mut met = [[0.0f64; 2]; OCTAVES];
    for pixel in bright {
        let near = near(tiles, pixel);
        met[octave(pixel)][usize::from(pixel.is_in_both(near))] += 1.0;
    }
    let [one, both] = met.iter().fold([0.0; 2], |sum, met| [sum[0] + met[0], sum[1] + met[1]]);
    let all = if one > 0.0 { 4.0 * both / one } else { 1.0 };
    // If there are few, the ratio over all octaves gets the weight [`FEW`].
    let shares = met.map(|[one, both]| ((4.0 * both + FEW * all) / (one + FEW)).min(1.0));
    tiles.iter_mut().flat_map(|tile| &mut tile.quarters).for_each(|quarter| quarter.bright = 0.0);
    for pixel in bright {
        let surroundings = near(tiles, pixel);
        let recurring = if pixel.is_in_both(surroundings) { 1.0 } else { shares[octave(pixel)] };
        let [tile, quarter] = pixel.place;
        let quarter = &mut tiles[tile].quarters[quarter];
        // Includes the luminance that the surroundings attribute to rare samples.
        let own = quarter.mean().max(recurring * pixel.mean);
        quarter.bright += pixel.colors / (own * own + 0.01);
    }
}
