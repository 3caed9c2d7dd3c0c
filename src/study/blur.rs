//! The bias of methods that blur less and less: photon mapping, and the caustics that vertex merging gathers.
//!
//! Both replicates of such a picture are blurred alike, so that their difference does not show it. But the blur shrinks while photons
//! become more: the area that a sample gathers from falls as g^(α − 1) with the generations g of the photon map, and with it the bias of smoothly
//! lit surfaces; that of edges falls with the radius, the root of that (`tracer/integrator/photon`). So the first samples of a render are blurred
//! more than the last ones, by an amount that the schedule of the photons tells. [`BlurWatch`] keeps the sums of a moment in the middle of the
//! render. With E the picture of the samples before it and L that of the samples after it, E − L is the bias of the whole times a known number,
//! and noise. Both replicates have photon maps of their own, so that the noise of E₁ − L₁ and that of E₂ − L₂ are independent, and
//! (E₁ − L₁)(E₂ − L₂) is an unbiased estimate of the square of what they have in common.
//!
//! Blur is a matter of several pixels, and noise of one. So both differences are divided into means of blocks of 8×8, 4×4, 2×2 and single pixels, each less
//! that of the block around it (Haar 1910), and the products of each size are judged by themselves: their sum T over the picture counts by the factor
//! 1 − V/T², or not at all (James and Stein 1961), where V is the sum of their squares. One product that is larger than all others together makes both
//! alike, so that a firefly is not taken for blur. What noise may hide widens the interval of the stated error.

use crate::stream::{PathCounts, REPLICATES, replicate};
use crate::study::error::{FLOOR, TILE};
use crate::study::placing::placed;
use crate::study::replicates::{ReplicateSums, Replicates};

/// How the blur of a method shrinks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlurSchedule {
    /// Camera samples of one replicate from one generation of photons to the next.
    pub samples_per_generation: u64,
    /// Camera samples of one index.
    pub samples_per_index: u64,
    /// Exponent α of the area, which falls as g^(α − 1) with the generations g.
    pub alpha: f64,
    /// The generation from which on photons do not become more.
    pub last_generation: u64,
}

/// The bias of a picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Blur {
    /// Mean square over the pixels of each tile, of luminance, row by row.
    pub squares: Vec<f64>,
    /// The deviation of their sum, as a share of it.
    pub deviation: f64,
    /// The deviation of each mean square on top of that, which is not clear from noise.
    pub unclear: Vec<f64>,
}

/// Watches how the blur of a render shrinks.
#[derive(Clone, Debug)]
pub struct BlurWatch {
    schedule: BlurSchedule,
    blurred: BlurredSamples,
    moment: Option<Moment>,
    known: Option<KnownBlur>,
}

/// Samples, and the sums of the areas and of the radii that they gathered from, relative to those of the first generation.
#[derive(Clone, Copy, Debug, Default)]
struct BlurredSamples {
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

/// Those of one replicate: of the camera stream with their weights, and of the light stream.
#[derive(Clone, Debug)]
struct LuminanceSums {
    camera: Vec<[f32; 2]>,
    light: Vec<f32>,
    paths: PathCounts,
}

/// What is known of the blur, as of these samples.
#[derive(Clone, Debug)]
struct KnownBlur {
    blurred: BlurredSamples,
    /// Squared bias of each tile over the square of what errors are relative to.
    relative: Vec<f64>,
    deviation: f64,
    /// What is not clear from noise, likewise.
    unclear: Vec<f64>,
}

/// The blur is computed from so many times the paths of the kept moment on.
const COMPARED: f64 = 1.5;

/// From so many times the paths of the kept moment on another one is kept, and what is found decides: before, late samples are too few to
/// refute what was known.
const RENEWED: f64 = 3.0;

/// Beyond this ratio of the bias to the difference of early and late samples, the difference tells nothing.
const LARGEST_RATIO: f64 = 3.0;

impl BlurSchedule {
    /// Some samples from this index of a replicate on, which see about the same photons.
    fn samples(&self, index: u64, samples: u64) -> BlurredSamples {
        let generation = 1 + index.saturating_mul(self.samples_per_index) / self.samples_per_generation;
        let area = (generation.min(self.last_generation) as f64).powf(self.alpha - 1.0);
        let samples = samples as f64;
        BlurredSamples { samples, areas: samples * area, radii: samples * area.sqrt() }
    }
}

impl BlurredSamples {
    fn plus(&self, other: &Self, times: f64) -> Self {
        Self {
            samples: self.samples + times * other.samples,
            areas: self.areas + times * other.areas,
            radii: self.radii + times * other.radii,
        }
    }

    /// The means of areas and radii, to which the biases of smoothly lit surfaces and of edges are proportional.
    fn means(&self) -> [f64; 2] {
        [self.areas, self.radii].map(|sum| sum / self.samples.max(1.0))
    }

    /// The squared bias of all samples over the squared difference of those before and after a moment, by both laws.
    fn of_whole(&self, moment: &Self) -> [f64; 2] {
        let ([whole, early], late) = ([self, moment].map(Self::means), self.plus(moment, -1.0).means());
        [0, 1].map(|law| (whole[law] / (early[law] - late[law]).max(f64::MIN_POSITIVE)).powi(2))
    }

    /// The squared bias of all samples over that of the first of them, mean of both laws.
    fn over(&self, before: &Self) -> f64 {
        let [now, then] = [self, before].map(Self::means);
        0.5 * [0, 1].map(|law| (now[law] / then[law]).powi(2)).iter().sum::<f64>()
    }
}

impl BlurWatch {
    /// Nothing is known yet.
    pub fn new(schedule: BlurSchedule) -> Self {
        Self { schedule, blurred: BlurredSamples::default(), moment: None, known: None }
    }

    /// A block that begins at this index is added to the sums.
    pub(super) fn add(&mut self, first_index: u64, paths: PathCounts) {
        let (_, index) = replicate(first_index);
        self.blurred = self.blurred.plus(&self.schedule.samples(index, paths.camera), 1.0);
    }

    /// The blur of the picture of these sums; `None` while too little is known of it, or nothing.
    pub(super) fn update(&mut self, sums: &Replicates) -> Option<Blur> {
        let paths = sums.paths();
        let since = self.moment.as_ref().map_or(f64::INFINITY, |moment| paths as f64 / moment.paths as f64);
        if let Some(moment) = self.moment.as_ref().filter(|_| since >= COMPARED) {
            let found = self.found(sums, moment);
            let then =
                self.known.as_ref().map(|known| known.uncertainty() * self.blurred.over(&known.blurred));
            let is_clearer = |found: &KnownBlur| then.is_none_or(|then| found.uncertainty() < then);
            if found.as_ref().is_some_and(is_clearer) || since >= RENEWED {
                self.known = found;
            }
        }
        if since >= RENEWED {
            self.moment = Some(Moment::of(sums, self.blurred));
        }
        let KnownBlur { blurred, relative, deviation, unclear } = self.known.as_ref()?;
        let later = self.blurred.over(blurred);
        let against = brightness(sums)?;
        let now = |relative: &[f64]| {
            relative
                .iter()
                .zip(&against)
                .map(|(square, against)| square * later * against * against)
                .collect()
        };
        Some(Blur { squares: now(relative), deviation: *deviation, unclear: now(unclear) })
    }

    /// What the samples before and after the moment tell.
    fn found(&self, sums: &Replicates, moment: &Moment) -> Option<KnownBlur> {
        let [areas, radii] = self.blurred.of_whole(&moment.blurred);
        let ratio = 0.5 * (areas + radii);
        if ratio.is_nan() || ratio > LARGEST_RATIO * LARGEST_RATIO {
            return None;
        }
        // Nobody knows how much of the blur follows which law.
        let apart = 0.5 * (areas - radii).abs() / ratio;
        let CommonDifference { squares, deviation, unclear } = compare(sums, moment)?;
        Some(KnownBlur {
            blurred: self.blurred,
            relative: squares.into_iter().map(|square| square * ratio).collect(),
            deviation: deviation.hypot(apart).min(1.0),
            unclear: unclear.into_iter().map(|square| square * ratio).collect(),
        })
    }
}

impl KnownBlur {
    /// The deviation of the sum of squares.
    fn uncertainty(&self) -> f64 {
        let [known, unclear] = [&self.relative, &self.unclear].map(|squares| squares.iter().sum::<f64>());
        (known * self.deviation).hypot(unclear)
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

    /// The sums before this moment, as sums of samples of which luminance alone is known; as large as those of `now`.
    fn early(&self, now: &ReplicateSums) -> ReplicateSums {
        let seen = |i: usize| self.at(i).0;
        ReplicateSums {
            camera: (0..now.camera.len()).map(seen).map(|[y, w]| [0.0, y, 0.0, w]).collect(),
            light: (0..now.light.len()).map(|i| [0.0, self.at(i).1, 0.0, 0.0]).collect(),
            paths: self.paths,
        }
    }

    /// The sums after this moment up to `now`.
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

/// What relative errors divide by, tile by tile; `None` where there is no picture yet.
fn brightness(sums: &Replicates) -> Option<Vec<f64>> {
    let [width, height] = sums.size();
    let columns = width.div_ceil(TILE);
    let mut tiles = vec![(0.0, 0.0); columns * height.div_ceil(TILE)];
    for (i, [_, y, _, w]) in sums.whole(0..height).into_iter().enumerate() {
        let (sum, count) = &mut tiles[i / width / TILE * columns + i % width / TILE];
        if w > 0.0 {
            (*sum, *count) = (*sum + f64::from(y), *count + 1.0);
        }
    }
    let means: Vec<Option<f64>> =
        tiles.iter().map(|(sum, count)| (*count > 0.0).then(|| sum / count)).collect();
    let (sum, count) =
        means.iter().flatten().fold((0.0, 0.0), |(sum, count), mean| (sum + mean, count + 1.0));
    let mean: f64 = if count > 0.0 { sum / count } else { return None };
    Some(means.iter().map(|tile| tile.unwrap_or(mean).abs() + FLOOR * mean.abs()).collect())
}

/// What early and late samples of both replicates have in common.
struct CommonDifference {
    /// Its square, tile by tile, relative to brightness: what is clearly more than noise.
    squares: Vec<f64>,
    /// The deviation of their sum, as a share of it.
    deviation: f64,
    /// The deviation of what is not clear from noise, which is as large a part of all noise in each tile.
    unclear: Vec<f64>,
}

/// `None` where there are too few samples.
fn compare(sums: &Replicates, moment: &Moment) -> Option<CommonDifference> {
    let size @ [_, height] = sums.size();
    // Luminance of each pixel that has samples.
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
    let grid = size.map(|n| n.div_ceil(TILE));
    let mut tiles = vec![PixelPairs::default(); grid[0] * grid[1]];
    for (i, pair) in first.iter().zip(&second).enumerate() {
        if let (Some(a), Some(b)) = pair {
            let (x, y) = (i % size[0], i / size[0]);
            tiles[y / TILE * grid[0] + x / TILE].add([x % TILE, y % TILE], [*a, *b].map(f64::from));
        }
    }
    let against = brightness(sums)?;
    let relative = |(tile, against): (&PixelPairs, &f64)| tile.products().map(|p| p / (against * against));
    let products: Vec<[f64; SIZES]> = tiles.iter().zip(&against).map(relative).collect();
    let (mut counts, mut variance, mut unclear) = ([0.0; SIZES], 0.0, 0.0);
    for size in 0..SIZES {
        let of_size = || products.iter().map(|products| products[size]);
        let (total, squares) = (of_size().sum::<f64>(), of_size().map(|p| p * p).sum::<f64>());
        if total > 0.0 {
            counts[size] = (1.0 - squares / (total * total)).max(0.0);
        }
        let known = counts[size];
        (variance, unclear) = (variance + known * known * squares, unclear + (1.0 - known) * squares);
    }
    let counted = |products: &[f64; SIZES]| products.iter().zip(counts).map(|(p, counts)| p * counts).sum();
    let known: Vec<f64> = products.iter().map(counted).collect();
    let total: f64 = known.iter().sum();
    let noise: Vec<f64> =
        tiles.iter().zip(&against).map(|(tile, against)| tile.noise() / (against * against)).collect();
    let part = unclear.sqrt() / noise.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    Some(CommonDifference {
        squares: if total > 0.0 { placed(&known, &noise, grid) } else { vec![0.0; known.len()] },
        deviation: if total > 0.0 { variance.sqrt() / total } else { 0.0 },
        unclear: noise.into_iter().map(|noise| noise * part).collect(),
    })
}

/// Sizes of blocks: 8, 4, 2 and 1 pixels to a side.
const SIZES: usize = TILE.ilog2() as usize + 1;

/// What two pictures show in the pixels of one tile.
#[derive(Clone, Copy, Debug, Default)]
struct PixelPairs {
    pixels: [[Option<[f64; 2]>; TILE]; TILE],
}

impl PixelPairs {
    fn add(&mut self, [x, y]: [usize; 2], pair: [f64; 2]) {
        self.pixels[y][x] = Some(pair);
    }

    /// For each size of blocks the product of what the means of both pictures over a block are above those over the block around it, mean over all
    /// pixels. All sizes together make the mean product of the pixels.
    fn products(&self) -> [f64; SIZES] {
        let mut products = [0.0; SIZES];
        let count = self.mean([0, 0], TILE).map_or(0.0, |(_, count)| count);
        for (at, product) in products.iter_mut().enumerate() {
            let side = TILE >> at;
            let corners = (0..TILE).step_by(side).flat_map(|y| (0..TILE).step_by(side).map(move |x| [x, y]));
            for corner in corners {
                let Some((own, pixels)) = self.mean(corner, side) else { continue };
                let around = 2 * side;
                let outer = match at {
                    0 => [0.0; 2],
                    _ => self.mean(corner.map(|n| n / around * around), around).map_or(own, |(mean, _)| mean),
                };
                *product += pixels / count * (own[0] - outer[0]) * (own[1] - outer[1]);
            }
        }
        products
    }

    /// Mean square over the pixels of what is different in both pictures.
    fn noise(&self) -> f64 {
        let pairs = || self.pixels.iter().flatten().flatten();
        pairs().map(|[a, b]| (a - b).powi(2)).sum::<f64>() / pairs().count().max(1) as f64
    }

    /// The means over the pixels of a block, and their number; `None` where there is none.
    fn mean(&self, [x, y]: [usize; 2], side: usize) -> Option<([f64; 2], f64)> {
        let rows = &self.pixels[y..y + side];
        let pixels = rows.iter().flat_map(|row| row[x..x + side].iter().flatten());
        let ([a, b], count) =
            pixels.fold(([0.0; 2], 0.0), |([a, b], count), pair| ([a + pair[0], b + pair[1]], count + 1.0));
        (count > 0.0).then(|| ([a / count, b / count], count))
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

    /// Tells of a picture of luminance 1 that is too bright in its left half, by `bias` over the generations of photons to the power `law`, with
    /// noise of 50 % in every sample: what is known of its blur, and the mean of its true square.
    fn watched(seed: u64, bias: f64, law: f64, per_pixel: u64) -> (Option<Blur>, f64) {
        let (mut sums, mut random) = (Replicates::new([SIDE as u32; 2], 1.0), Random(seed));
        let mut watch = BlurWatch::new(SCHEDULE);
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
            watch.add(chunk * CHUNK, paths);
            if (chunk + 1).is_power_of_two() && chunk + 1 >= chunks / 16 {
                known = watch.update(&sums);
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
                let unclear = blur.unclear.iter().sum::<f64>() / blur.unclear.len() as f64;
                let deviation = (blur.deviation * of_truth).hypot(unclear / truth);
                held += usize::from((of_truth - 1.0).abs() <= 1.645 * deviation);
                logs += of_truth.ln() / 20.0;
                // Means over neighbours reach a little beyond the edge.
                let left = |i: &usize| i % (SIDE / TILE) < SIDE / TILE / 2;
                let there: f64 = (0..blur.squares.len()).filter(left).map(|i| blur.squares[i]).sum();
                assert!(there > 0.7 * blur.squares.iter().sum::<f64>(), "law {law}, seed {seed}: {blur:?}");
            }
            assert!(held >= 17, "law {law}: {held} of 20 intervals held");
            // Their difference alone does not tell which law it follows; either is taken for the mean of both.
            assert!(logs.abs() < 1.2, "law {law}: stated over true square {}", logs.exp());
        }
    }

    #[test]
    fn without_blur_hardly_any_is_told() {
        let told = |seed: u64| mean(&watched(100 + seed, 0.0, 1.0, 32).0.unwrap());
        let told = (0..40).map(told).sum::<f64>() / 40.0;
        // The variance of a sample is 1/4.
        let variance = 0.25 / 32.0;
        assert!(told < 0.15 * variance, "noise of {variance} is taken for blur of {told}");
    }

    #[test]
    fn before_photons_have_become_more_nothing_is_known() {
        let (mut sums, mut random) = (Replicates::new([SIDE as u32; 2], 1.0), Random(1));
        let schedule = BlurSchedule { samples_per_generation: 1 << 30, ..SCHEDULE };
        let mut watch = BlurWatch::new(schedule);
        for chunk in 0..64 {
            let sample = |random: &mut Random| {
                let (uv, y) = ([random.f32(), random.f32()], random.f32());
                Sample { uv, xyz: Xyz::new(y, y, y), w: 1.0 }
            };
            let samples: Vec<Sample> = (0..CHUNK).map(|_| sample(&mut random)).collect();
            let paths = PathCounts { camera: CHUNK, light: 0 };
            sums.add(chunk * CHUNK, paths, &samples);
            watch.add(chunk * CHUNK, paths);
            assert_eq!(watch.update(&sums), None);
        }
    }
}
