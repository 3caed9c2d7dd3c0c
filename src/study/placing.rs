//! Where in a picture the squares lie whose sum is known: noisy values of its tiles, made into values that a picture may have.

/// A tile is averaged with so many tiles to each side.
const NEAR: usize = 2;

/// Values of the tiles of a grid, row by row, whose sum is that of `values` and of which none is negative; their deviations are about proportional to
/// `noise`. All are 0 where the sum is not positive.
pub(super) fn placed(values: &[f64], noise: &[f64], grid: [usize; 2]) -> Vec<f64> {
    let total: f64 = values.iter().sum();
    if total > 0.0 {
        thresholded(&clearest(&with_variances(values, noise), grid, Noisy::clarity), total)
    } else {
        vec![0.0; values.len()]
    }
}

/// The values by soft thresholding (Donoho 1995), none of them negative and all of them together of this sum: the threshold is the same multiple of the
/// deviation of each, so that where there is noise alone nearly nothing is left.
fn thresholded(values: &[Noisy], total: f64) -> Vec<f64> {
    let left = |multiple: f64| {
        values.iter().map(move |Noisy { value, variance }| (value - multiple * variance.sqrt()).max(0.0))
    };
    let [mut low, mut high] = [0.0, 1e3];
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if left(middle).sum::<f64>() > total { low = middle } else { high = middle }
    }
    left(high).collect()
}

/// A mean and its variance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Noisy {
    pub(super) value: f64,
    pub(super) variance: f64,
}

impl Noisy {
    /// How many deviations it is above nothing.
    pub(super) fn clarity(&self) -> f64 {
        self.value / self.variance.sqrt().max(f64::MIN_POSITIVE)
    }

    /// The factor by which it counts as more than noise: 0 up to two deviations.
    pub(super) fn clearly(&self) -> f64 {
        let deviations = self.clarity().abs();
        if deviations > 2.0 { 1.0 - 4.0 / (deviations * deviations) } else { 0.0 }
    }
}

/// The values of tiles whose deviations are about proportional to their noise: the sum of all variances is that of the squares of all values.
fn with_variances(values: &[f64], noise: &[f64]) -> Vec<Noisy> {
    let square = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
    let scale = square(values) / square(noise).max(f64::MIN_POSITIVE);
    values
        .iter()
        .zip(noise)
        .map(|(value, noise)| Noisy { value: *value, variance: scale * noise * noise })
        .collect()
}

/// For each tile of a grid the mean of itself alone, or with its neighbours, or with theirs too: that of which `clarity` is largest.
pub(super) fn clearest(
    tiles: &[Noisy],
    [columns, rows]: [usize; 2],
    clarity: impl Fn(&Noisy) -> f64,
) -> Vec<Noisy> {
    let mean = |i: usize, reach: usize| {
        let near = |at: usize, len: usize| at.saturating_sub(reach)..(at + reach + 1).min(len);
        let (x, y) = (i % columns, i / columns);
        let around = near(y, rows).flat_map(|y| near(x, columns).map(move |x| y * columns + x));
        let [value, variance, count] = around.fold([0.0; 3], |[value, variance, count], j| {
            [value + tiles[j].value, variance + tiles[j].variance, count + 1.0]
        });
        Noisy { value: value / count, variance: variance / (count * count) }
    };
    let clearest = |i: usize| {
        let candidates = (0..=NEAR).map(|reach| mean(i, reach));
        candidates.max_by(|a, b| clarity(a).total_cmp(&clarity(b)))
    };
    (0..tiles.len()).filter_map(clearest).collect()
}
