//! The bias of photon density estimation, which shrinks over time: photon mapping, and the caustics gathered by vertex merging.
//!
//! Both replicates of such a picture have the same blur, so that their difference does not show it. But the blur shrinks as the number of
//! photons grows: the gathering area falls as g^(α − 1) with the generation g of the photon map, and with it the bias of smoothly lit
//! surfaces; the bias of edges falls with the radius, its square root (`tracer/integrator/photon`). So the first samples of a render are
//! blurred more than the last ones, by an amount known from the photon schedule. [`BlurWatch`] keeps the sums of a moment in the middle of
//! the render. With E the picture of the samples before it and L that of the samples after it, E − L is a known multiple of the bias of the
//! whole, plus noise. The replicates have separate photon maps, so that the noise of E₁ − L₁ and of E₂ − L₂ is independent, and
//! (E₁ − L₁)(E₂ − L₂) is an unbiased estimate of the square of their common part. It is averaged over neighbouring tiles and pictures. If
//! it is insignificant, the stated error excludes it, and the upper end of its interval includes its upper bound. Bias of structures
//! finer than all gathering discs so far does not shrink, and is not detected.

use crate::stream::{PathCounts, REPLICATES, replicate};
use crate::study::error_tile::{FLOOR, TILE};
use crate::study::interval::Z90;
use crate::study::noisy::Noisy;
use crate::study::replicates::{ReplicateSums, Replicates};

/// Schedule by which the blur of a method shrinks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlurSchedule {
    /// Camera samples of one replicate per generation of the photon map.
    pub samples_per_generation: u64,
    /// Camera samples per index.
    pub samples_per_index: u64,
    /// Exponent α of the gathering area, which falls as g^(α − 1) with the generation g.
    pub alpha: f64,
    /// Generation from which on the number of photons is constant.
    pub last_generation: u64,
}

/// Estimated blur bias of a picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Blur {
    /// Mean squared bias of luminance per tile, row-major; if not [significant](Self::is_significant), an upper bound of it.
    pub squares: Vec<f64>,
    /// Relative standard deviation of the sum over all tiles.
    pub deviation: f64,
    /// Whether it exceeds what noise can explain.
    pub is_significant: bool,
}

impl Blur {
    /// Mean squared blur of a tile at this number of standard deviations from the estimate. An insignificant blur is estimated as 0, but
    /// may be present within the interval.
    pub fn square(&self, tile: usize, deviations: f64) -> f64 {
        let square = self.squares.get(tile).copied().unwrap_or_default();
        let middle = if self.is_significant { 1.0 } else { 0.0 };
        square * (middle + deviations * self.deviation).max(0.0)
    }
}

/// Monitors how the blur of a render shrinks.
#[derive(Clone, Debug, Default)]
pub struct BlurWatch {
    moment: Option<Moment>,
    known: Option<KnownBlur>,
}

/// Number of samples, and sums of the gathering areas and radii that they used, relative to the first generation.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BlurredSamples {
    samples: f64,
    areas: f64,
    radii: f64,
}

/// Sums of luminance at one moment of a render.
#[derive(Clone, Debug)]
struct Moment {
    paths: u64,
    blurred: BlurredSamples,
    parts: [LuminanceSums; REPLICATES],
}

/// Sums of one replicate: camera stream with weights, and light stream.
#[derive(Clone, Debug)]
struct LuminanceSums {
    camera: Vec<[f32; 2]>,
    light: Vec<f32>,
    paths: PathCounts,
}

/// Estimate of the blur at a given number of samples.
#[derive(Clone, Debug)]
struct KnownBlur {
    blurred: BlurredSamples,
    /// Squared bias of each tile over the squared denominator of relative errors, as in [`Blur`].
    relative: Vec<f64>,
    deviation: f64,
    is_significant: bool,
    /// Standard deviation of the mean of `relative` due to noise.
    noise: f64,
}

/// The squared difference of early and late samples common to both replicates.
struct CommonDifference {
    /// Per tile, relative to brightness; if insignificant, the upper end of its 90 % interval.
    relative: Vec<f64>,
    /// Mean over all tiles, and its standard deviation.
    mean: f64,
    deviation: f64,
    /// Whether the mean exceeds what noise can explain.
    is_significant: bool,
}

/// The blur is estimated once the paths exceed those of the kept moment by this factor.
const COMPARED: f64 = 1.5;

/// Once the paths exceed those of the kept moment by this factor, a new moment is kept and the present estimate is final; before, there are
/// too few late samples to refute the previous estimate.
const RENEWED: f64 = 3.0;

/// If the ratio of the bias to the early–late difference exceeds this, the difference is uninformative.
const LARGEST_RATIO: f64 = 3.0;

/// The squared bias of a tile is averaged over this many tiles on each side.
const NEAR: usize = 2;

impl BlurSchedule {
    /// Samples of a replicate from this index on that see about the same photon map.
    fn samples(&self, index: u64, samples: u64) -> BlurredSamples {
        let generation = 1 + index.saturating_mul(self.samples_per_index) / self.samples_per_generation;
        let area = (generation.min(self.last_generation) as f64).powf(self.alpha - 1.0);
        let samples = samples as f64;
        BlurredSamples { samples, areas: samples * area, radii: samples * area.sqrt() }
    }
}

impl BlurredSamples {
    /// Adds a block that begins at this index.
    pub(super) fn add(&mut self, schedule: &BlurSchedule, first_index: u64, paths: PathCounts) {
        let (_, index) = replicate(first_index);
        *self = self.plus(&schedule.samples(index, paths.camera), 1.0);
    }

    fn plus(&self, other: &Self, times: f64) -> Self {
        Self {
            samples: self.samples + times * other.samples,
            areas: self.areas + times * other.areas,
            radii: self.radii + times * other.radii,
        }
    }

    /// Mean areas and radii, to which the biases of smoothly lit surfaces and of edges, respectively, are proportional.
    fn means(&self) -> [f64; 2] {
        [self.areas, self.radii].map(|sum| sum / self.samples.max(1.0))
    }

    /// Ratio of the squared bias of all samples to the squared difference before and after a moment, by both laws.
    fn of_whole(&self, moment: &Self) -> [f64; 2] {
        let ([whole, early], late) = ([self, moment].map(Self::means), self.plus(moment, -1.0).means());
        [0, 1].map(|law| (whole[law] / (early[law] - late[law]).max(f64::MIN_POSITIVE)).powi(2))
    }

    /// Ratio of the squared bias of all samples to that of the earlier ones, averaged over both laws.
    fn over(&self, before: &Self) -> f64 {
        let [now, then] = [self, before].map(Self::means);
        0.5 * [0, 1].map(|law| (now[law] / then[law]).powi(2)).iter().sum::<f64>()
    }
}

impl BlurWatch {
    /// The blur of the picture of these sums, whose samples are blurred this much; `None` while there is too little data.
    pub(super) fn update(&mut self, sums: &Replicates, blurred_so_far: BlurredSamples) -> Option<Blur> {
        let paths = sums.paths();
        let since = self.moment.as_ref().map_or(f64::INFINITY, |moment| paths as f64 / moment.paths as f64);
        if let Some(moment) = self.moment.as_ref().filter(|_| since >= COMPARED) {
            let found = Self::found(sums, blurred_so_far, moment);
            let less_noise = |found: &KnownBlur| {
                self.known.as_ref().is_none_or(|k| found.noise < k.noise * found.blurred.over(&k.blurred))
            };
            let is_clearer = found.as_ref().is_some_and(less_noise);
            if is_clearer || since >= RENEWED {
                self.known = found;
            }
        }
        if since >= RENEWED {
            self.moment = Some(Moment::of(sums, blurred_so_far));
        }
        let KnownBlur { blurred, relative, deviation, is_significant, .. } = self.known.as_ref()?;
        let later = blurred_so_far.over(blurred);
        let against = brightness(sums)?;
        let squares =
            relative.iter().zip(against).map(|(square, against)| square * later * against * against);
        Some(Blur { squares: squares.collect(), deviation: *deviation, is_significant: *is_significant })
    }

    /// Estimate from the samples before and after the moment.
    fn found(sums: &Replicates, now: BlurredSamples, moment: &Moment) -> Option<KnownBlur> {
        let [areas, radii] = now.of_whole(&moment.blurred);
        let ratio = 0.5 * (areas + radii);
        if ratio.is_nan() || ratio > LARGEST_RATIO * LARGEST_RATIO {
            return None;
        }
        // It is unknown how the blur is divided between the two laws.
        let apart = 0.5 * (areas - radii).abs() / ratio;
        let common = compare(sums, moment)?;
        let is_significant = common.is_significant;
        Some(KnownBlur {
            blurred: now,
            deviation: match is_significant {
                true => (common.deviation / common.mean).hypot(apart).min(1.0),
                false => 1.0 / Z90,
            },
            is_significant,
            noise: common.deviation * ratio,
            relative: common.relative.into_iter().map(|square| square * ratio).collect(),
        })
    }
}

impl Moment {
    fn of(sums: &Replicates, blurred: BlurredSamples) -> Self {
        let luminances = |part: &ReplicateSums| LuminanceSums {
            camera: part.camera.iter().map(|[_, y, _, w]| [*y, *w]).collect(),
            light: part.light.iter().map(|[_, y, ..]| *y).collect(),
            paths: part.paths,
        };
        Self { paths: sums.paths().max(1), blurred, parts: sums.parts.each_ref().map(luminances) }
    }
}

impl LuminanceSums {
    fn at(&self, pixel: usize) -> ([f32; 2], f32) {
        let camera = self.camera.get(pixel).copied().unwrap_or_default();
        (camera, self.light.get(pixel).copied().unwrap_or_default())
    }

    /// Sums before this moment, with luminance only, in the layout of `now`.
    fn early(&self, now: &ReplicateSums) -> ReplicateSums {
        let seen = |i: usize| self.at(i).0;
        ReplicateSums {
            camera: (0..now.camera.len()).map(seen).map(|[y, w]| [0.0, y, 0.0, w]).collect(),
            light: (0..now.light.len()).map(|i| [0.0, self.at(i).1, 0.0, 0.0]).collect(),
            paths: self.paths,
        }
    }

    /// Sums after this moment up to `now`.
    fn late(&self, now: &ReplicateSums) -> ReplicateSums {
        let seen = |(i, [_, y, _, w]): (usize, &[f32; 4])| {
            let ([before, weight], _) = self.at(i);
            [0.0, y - before, 0.0, w - weight]
        };
        let arrived = |(i, [_, y, ..]): (usize, &[f32; 4])| [0.0, y - self.at(i).1, 0.0, 0.0];
        ReplicateSums {
            camera: now.camera.iter().enumerate().map(seen).collect(),
            light: now.light.iter().enumerate().map(arrived).collect(),
            paths: PathCounts {
                camera: now.paths.camera.saturating_sub(self.paths.camera),
                light: now.paths.light.saturating_sub(self.paths.light),
            },
        }
    }
}

/// Denominators of relative errors, per tile; `None` if there is no picture yet.
fn brightness(sums: &Replicates) -> Option<Vec<f64>> {
    let [width, height] = sums.size();
    let mut tiles = Tiles::new([width, height]);
    for (i, [_, y, _, w]) in sums.whole(0..height).into_iter().enumerate() {
        if w > 0.0 {
            tiles.add(i, f64::from(y));
        }
    }
    let tiles: Vec<Option<f64>> = tiles.means().into_iter().map(|tile| tile.map(|tile| tile.value)).collect();
    let (sum, count) =
        tiles.iter().flatten().fold((0.0, 0.0), |(sum, count), tile| (sum + tile, count + 1.0));
    let mean: f64 = if count > 0.0 { sum / count } else { return None };
    Some(tiles.iter().map(|tile| tile.unwrap_or(mean).abs() + FLOOR * mean.abs()).collect())
}

/// The early–late difference common to both replicates. `None` if too few tiles have both early and late samples, or if the picture is
/// black.
fn compare(sums: &Replicates, moment: &Moment) -> Option<CommonDifference> {
    let size @ [_, height] = sums.size();
    // Luminance of each pixel with samples.
    let picture = |part: ReplicateSums| -> Vec<Option<f32>> {
        let scale = part.light_scale(size);
        let pixels = part.xyz(size, sums.kernel(), 0..height, scale);
        pixels.into_iter().map(|[_, y, _, w]| (w > 0.0).then_some(y)).collect()
    };
    let difference = |(now, before): (&ReplicateSums, &LuminanceSums)| -> Vec<Option<f32>> {
        let early = picture(before.early(now));
        early.into_iter().zip(picture(before.late(now))).map(|(e, l)| Some(e? - l?)).collect()
    };
    let [first, second] = std::array::from_fn(|r| difference((&sums.parts[r], &moment.parts[r])));
    let mut tiles = Tiles::new(size);
    for (i, pair) in first.iter().zip(&second).enumerate() {
        if let (Some(a), Some(b)) = pair {
            tiles.add(i, f64::from(*a) * f64::from(*b));
        }
    }
    let against = brightness(sums)?;
    let relative = |(tile, against): (Option<Noisy>, &f64)| {
        let Noisy { value, variance } = tile?;
        let divisor = against * against;
        Some(Noisy { value: value / divisor, variance: variance / (divisor * divisor) })
    };
    let relative: Vec<Option<Noisy>> = tiles.means().into_iter().zip(&against).map(relative).collect();
    let known: Vec<Noisy> = relative.iter().copied().flatten().collect();
    if known.len() < 2 {
        return None;
    }
    let count = known.len() as f64;
    let mean = known.iter().map(|tile| tile.value).sum::<f64>() / count;
    let deviation = known.iter().map(|tile| tile.variance).sum::<f64>().sqrt() / count;
    if !(mean.is_finite() && deviation.is_finite()) {
        return None;
    }
    let is_significant = mean > Z90 * deviation;
    let placed_mean = if is_significant { mean } else { mean.max(0.0) + Z90 * deviation };
    let relative = placed(&tiles.clearest(&relative), placed_mean * count);
    Some(CommonDifference { relative, mean, deviation, is_significant })
}

/// Soft thresholding to non-negative values with this total: the threshold is the same multiple of each value's standard deviation, so that
/// pure noise is nearly removed.
fn placed(values: &[Noisy], total: f64) -> Vec<f64> {
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

/// Sums over the quarters of tiles of 8×8 pixels.
struct Tiles {
    width: usize,
    grid: [usize; 2],
    quarters: Vec<[[f64; 2]; 4]>,
}

impl Tiles {
    fn new([width, height]: [usize; 2]) -> Self {
        let grid = [width.div_ceil(TILE), height.div_ceil(TILE)];
        Self { width, grid, quarters: vec![[[0.0; 2]; 4]; grid[0] * grid[1]] }
    }

    /// Adds the value of one pixel.
    fn add(&mut self, pixel: usize, value: f64) {
        let (x, y) = (pixel % self.width, pixel / self.width);
        let half = |at: usize| at % TILE / (TILE / 2);
        let [sum, count] = &mut self.quarters[y / TILE * self.grid[0] + x / TILE][half(x) + 2 * half(y)];
        (*sum, *count) = (*sum + value, *count + 1.0);
    }

    /// Mean of each tile; `None` if nothing was added.
    fn means(&self) -> Vec<Option<Noisy>> {
        let mean = |quarters: &[[f64; 2]; 4]| {
            let seen = || quarters.iter().filter(|[_, count]| *count > 0.0);
            let (parts, count) = (seen().count() as f64, seen().map(|[_, count]| count).sum::<f64>());
            let value = seen().map(|[sum, _]| sum).sum::<f64>() / count;
            let squares: f64 = seen().map(|[sum, count]| (sum / count - value).powi(2)).sum();
            (parts > 0.0).then(|| Noisy { value, variance: squares / (parts - 1.0).max(1.0) / parts })
        };
        self.quarters.iter().map(mean).collect()
    }

    /// For each tile the most significant of three means: of itself, with its neighbours, and with theirs too.
    fn clearest(&self, tiles: &[Option<Noisy>]) -> Vec<Noisy> {
        let mean = |i: usize, reach: usize| Noisy::mean_around(tiles, self.grid, i, reach);
        let clearest = |i: usize| {
            let neighbours = mean(i, 1);
            // Four quarters yield a poor estimate of their own variance.
            let alone = tiles[i].map(|tile| Noisy { value: tile.value, variance: 9.0 * neighbours.variance });
            let candidates = [Some(mean(i, NEAR)), Some(neighbours), alone];
            let best =
                candidates.into_iter().flatten().max_by(|a, b| a.deviations().total_cmp(&b.deviations()));
            best.unwrap_or(neighbours)
        };
        (0..tiles.len()).map(clearest).collect()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

    use super::*;
    use crate::color::Xyz;
    use crate::math::random::Random;
    use crate::stream::{CHUNK, Sample};

    const SIDE: usize = 64;
    const SCHEDULE: BlurSchedule = BlurSchedule {
        samples_per_generation: 4 * CHUNK,
        samples_per_index: 1,
        alpha: 0.0,
        last_generation: u64::MAX,
    };

    /// Monitors a picture of luminance 1 whose left half is too bright by `bias` times the photon generation to the power `law`, with
    /// noise of 50 % in every sample. Returns the estimate, and the mean of the true squared bias.
    fn watched(seed: u64, bias: f64, law: f64, per_pixel: u64) -> (Option<Blur>, f64) {
        let (mut sums, mut random) = (Replicates::new([SIDE as u32; 2], 1.0), Random(seed));
        let (mut watch, mut blurred) = (BlurWatch::default(), BlurredSamples::default());
        let chunks = per_pixel * (SIDE * SIDE) as u64 / CHUNK;
        let (mut known, mut brighter) = (None, 0.0);
        for chunk in 0..chunks {
            let (_, own) = replicate(chunk * CHUNK);
            let generation = 1 + own / SCHEDULE.samples_per_generation;
            let excess = bias * (generation as f64).powf(-law);
            brighter += excess / chunks as f64;
            let sample = |random: &mut Random| {
                let uv = [random.f32(), random.f32()];
                let bias = if uv[0] < 0.5 { excess as f32 } else { 0.0 };
                let y = 1.0 + bias + 1.732 * (random.f32() - 0.5);
                Sample { uv, xyz: Xyz::new(y, y, y), w: 1.0 }
            };
            let samples: Vec<Sample> = (0..CHUNK).map(|_| sample(&mut random)).collect();
            let paths = PathCounts { camera: CHUNK, light: 0 };
            sums.add(chunk * CHUNK, paths, &samples);
            blurred.add(&SCHEDULE, chunk * CHUNK, paths);
            if (chunk + 1).is_power_of_two() && chunk + 1 >= chunks / 16 {
                known = watch.update(&sums, blurred);
            }
        }
        (known, 0.5 * brighter * brighter)
    }

    fn mean(blur: &Blur) -> f64 {
        blur.squares.iter().sum::<f64>() / blur.squares.len() as f64
    }

    #[test]
    fn blur_is_told_by_how_it_shrinks_and_where_it_is() {
        for law in [1.0, 0.5] {
            let (mut held, mut logs) = (0, 0.0);
            for seed in 0..20 {
                let (blur, truth) = watched(seed, 0.5, law, 32);
                let blur = blur.unwrap();
                let of_truth = mean(&blur) / truth;
                held += usize::from((of_truth - 1.0).abs() <= 1.645 * blur.deviation * of_truth);
                logs += of_truth.ln() / 20.0;
                // Means over neighbours extend slightly across the edge.
                let left = |i: &usize| i % (SIDE / TILE) < SIDE / TILE / 2;
                let there: f64 = (0..blur.squares.len()).filter(left).map(|i| blur.squares[i]).sum();
                assert!(there > 0.7 * blur.squares.iter().sum::<f64>(), "law {law}, seed {seed}: {blur:?}");
            }
            assert!(held >= 17, "law {law}: {held} of 20 intervals held");
            // A single difference does not reveal the law; the estimate assumes the mean of both.
            assert!(logs.abs() < 1.2, "law {law}: stated over true square {}", logs.exp());
        }
    }

    #[test]
    fn without_blur_hardly_ever_any_is_told() {
        let told = |seed: &u64| watched(100 + seed, 0.0, 1.0, 32).0.is_some_and(|blur| blur.is_significant);
        let told = (0..40).filter(told).count();
        // By design one in twenty; 7 or more of 40 would happen once in 300 times.
        assert!(told < 7, "in {told} of 40 pictures noise is taken for blur");
    }

    #[test]
    fn blur_that_may_be_noise_counts_upwards_alone() {
        // So weak that it is rarely significant.
        let (bias, mut held, mut uncertain) = (0.15, 0, 0);
        for seed in 0..40 {
            let (blur, truth) = watched(200 + seed, bias, 1.0, 8);
            let Some(blur) = blur.filter(|blur| !blur.is_significant) else { continue };
            let at = |deviations: f64| {
                let tiles = blur.squares.len();
                (0..tiles).map(|i| blur.square(i, deviations)).sum::<f64>() / tiles as f64
            };
            assert_eq!((at(0.0), at(-1.0)), (0.0, 0.0));
            uncertain += 1;
            held += usize::from(truth < at(Z90));
        }
        assert!(uncertain > 10, "{uncertain} of 40 are not significant");
        assert!(10 * held >= 9 * uncertain, "the upper end held in {held} of {uncertain}");
    }

    #[test]
    fn before_photons_have_become_more_nothing_is_known() {
        let (mut sums, mut random) = (Replicates::new([SIDE as u32; 2], 1.0), Random(1));
        let schedule = BlurSchedule { samples_per_generation: 1 << 30, ..SCHEDULE };
        let (mut watch, mut blurred) = (BlurWatch::default(), BlurredSamples::default());
        for chunk in 0..64 {
            let sample = |random: &mut Random| {
                let (uv, y) = ([random.f32(), random.f32()], random.f32());
                Sample { uv, xyz: Xyz::new(y, y, y), w: 1.0 }
            };
            let samples: Vec<Sample> = (0..CHUNK).map(|_| sample(&mut random)).collect();
            let paths = PathCounts { camera: CHUNK, light: 0 };
            sums.add(chunk * CHUNK, paths, &samples);
            blurred.add(&schedule, chunk * CHUNK, paths);
            assert_eq!(watch.update(&sums, blurred), None);
        }
    }
}
