//! Which screen position each camera path begins at, and its weight: evenly over the screen, or more often where the picture
//! needs it.
//!
//! # Adaptive sampling
//!
//! A picture is rendered in two stages. The **pilot** samples the screen evenly; from it the error of every region is estimated
//! (`study::regions`), relative to what stated errors are relative to. The **main** stage gives each region camera paths in
//! proportion to the root of its squared relative error, which minimises the sum of these squares for a given number of paths (Neyman
//! allocation), and a quarter of an even share to every region, so that what the pilot has not met is still found (a defensive
//! mixture, Hesterberg 1995). Light that the pilot has not met is found with noise all the same, and what a path costs is not asked.
//!
//! Regions are squares of the sequence's screen ([`ScreenSquares`]): within each, paths are those that an even render with as many
//! paths there would trace, with all of their low discrepancy. Rounds of 16 paths per region visit regions in an order that covers the screen
//! evenly at any time.
//!
//! # Why it is unbiased
//!
//! A sample of the main stage has the weight 1/d, d being the density of paths in its region over the mean. So every filter over
//! the screen has the same weight as in an even render, also where it reaches over borders of regions, and the picture is the
//! ratio of the same expectations. The numbers of paths depend on samples of the pilot, but on none of the main stage, which has a
//! randomisation of its own: each stage by itself estimates the picture without bias, whatever the other has found. Both are
//! summed, each pilot sample with the weight ½, so that the pilot's share of the sum of weights is the same in every pixel and
//! depends on no sample's value. A pilot sample counts half because there are fewer of them where the picture needs more: the
//! weight is that of least variance if the densities vary by about 2.
//!
//! Light paths are the same everywhere on the screen, in both stages. MIS weights ignore the density; they sum up to one
//! for any.
//!
//! # Steered sampling
//!
//! After a move of the camera some of a render's paths, at its beginning, are steered to where the picture that was carried over to the new
//! view shows least (`denoise::steering`): they follow a density that depends on no sample of this render, and all others are even. A steered
//! sample has the weight 1/d, too, so that the expected sum of weights is even at any time, whichever part of the steered paths has been traced. Steered paths
//! take a part of the same sequence, `APART`, that no even path reaches.

use std::ops::Range;
use std::sync::Arc;

use crate::tracer::sampler::cells::ScreenCells;
use crate::tracer::sampler::squares::{MAX_LEVEL, ScreenSquares};

/// Mean number of paths per region in one round.
const PER_ROUND: u32 = 16;

/// Paths per region in one round at least.
const LEAST: u32 = PER_ROUND / 4;

/// Texels of a region at least.
const REGION_TEXELS: f64 = 16.0;

/// Differs from the seed of the main stage by this, and so from the seeds of small numbers and of replicates.
const PILOT_SEED: u32 = 0x2545_f491;

/// The share of an even sample's weight that one of the pilot has.
const PILOT_WEIGHT: f32 = 0.5;

/// Index in the sequence from which on steered paths take theirs: a power of two beyond the number of paths of any render.
const APART: u64 = 1 << 40;

/// How camera paths are distributed over the screen.
#[derive(Clone, Debug, Default)]
pub enum ScreenSampling {
    /// Evenly.
    #[default]
    Even,
    /// Evenly, before an adaptive render.
    Pilot,
    /// In proportion to a density.
    Adaptive(AdaptiveScreen),
    /// Some paths in proportion to a density, those before and after them evenly.
    Steered(SteeredScreen),
}

/// A density over the screen, and which paths follow it.
#[derive(Clone, Debug)]
pub struct SteeredScreen {
    screen: AdaptiveScreen,
    /// Numbers of the paths, counted as those of [`ScreenSampling::start`].
    paths: Range<u64>,
}

/// A density over the screen and the sequence of one seed that follows it.
#[derive(Clone, Debug)]
pub struct AdaptiveScreen {
    density: Arc<ScreenDensity>,
    squares: Arc<ScreenSquares>,
}

/// The start of a camera path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraStart {
    /// Index in the sequence.
    pub index: u64,
    /// Weight of its sample.
    pub weight: f32,
}

/// The number of paths of each region in a round.
#[derive(Clone, Debug, PartialEq)]
pub struct ScreenDensity {
    level: u32,
    /// Paths per round of each region, in the order of [`interleave`](crate::math::bits::interleave).
    counts: Vec<u32>,
    /// For each place of a round the region, and how many paths of the round come before there.
    places: Vec<[u32; 2]>,
}

impl ScreenDensity {
    /// Binary logarithm of the number of regions along each side of a film of so many texels: regions of 16 to 64 texels, where there are not too many.
    pub fn level(texels: f64) -> u32 {
        ((texels / REGION_TEXELS).max(1.0).log2() / 2.0).min(f64::from(MAX_LEVEL)) as u32
    }

    /// The density for regions of these squared relative errors at equal numbers of paths, 4^level of them in the order of
    /// [`interleave`](crate::math::bits::interleave). Where none has an error it is even.
    ///
    /// # Panics
    ///
    /// When the number of regions is no power of four.
    pub fn new(errors: &[f64]) -> Self {
        let level = errors.len().trailing_zeros() / 2;
        assert_eq!(errors.len(), 1 << (2 * level), "regions");
        let wanted: Vec<f64> = errors.iter().map(|error| error.max(0.0).sqrt()).collect();
        let total: f64 = wanted.iter().sum();
        let wanted = |i: usize| {
            if total > 0.0 && total.is_finite() { wanted[i] / total } else { 1.0 / errors.len() as f64 }
        };
        // Rounded sums: the counts add up, and each is off by less than one.
        let rest = f64::from(PER_ROUND - LEAST) * errors.len() as f64;
        let (mut sum, mut before) = (0.0, 0);
        let counts: Vec<u32> = (0..errors.len())
            .map(|i| {
                sum += wanted(i);
                let up_to = if i + 1 == errors.len() { rest } else { (sum * rest).round().min(rest) } as u32;
                LEAST + (up_to - std::mem::replace(&mut before, up_to))
            })
            .collect();
        let owners: Vec<u32> = (0..)
            .zip(&counts)
            .flat_map(|(region, count)| std::iter::repeat_n(region, *count as usize))
            .collect();
        // In bit-reversed order, places in a row lie far apart.
        let bits = owners.len().trailing_zeros();
        let mut done = vec![0; counts.len()];
        let places = (0..owners.len() as u32).map(|place| {
            let region = owners[(place.reverse_bits() >> (u32::BITS - bits)) as usize];
            let before = &mut done[region as usize];
            *before += 1;
            [region, *before - 1]
        });
        let places = places.collect();
        Self { level, counts, places }
    }

    /// Density of paths in each region over the mean, in the order of [`interleave`](crate::math::bits::interleave).
    pub fn relative(&self) -> impl ExactSizeIterator<Item = f32> + '_ {
        self.counts.iter().map(|count| *count as f32 / PER_ROUND as f32)
    }
}

impl ScreenSampling {
    /// The sampling of the main stage, for a render of this seed and of a picture of these cells.
    pub fn adaptive(density: Arc<ScreenDensity>, seed: u32, cells: &ScreenCells) -> Self {
        Self::Adaptive(AdaptiveScreen::new(density, seed, cells))
    }

    /// Sampling in which `paths`, numbered as those of [`start`](Self::start), follow a density, for a render of this seed and of a picture of
    /// these cells.
    pub fn steered(density: Arc<ScreenDensity>, paths: Range<u64>, seed: u32, cells: &ScreenCells) -> Self {
        Self::Steered(SteeredScreen { screen: AdaptiveScreen::new(density, seed, cells), paths })
    }

    /// The same for another seed.
    pub fn with_seed(&self, seed: u32, cells: &ScreenCells) -> Self {
        match self {
            Self::Even => Self::Even,
            Self::Pilot => Self::Pilot,
            Self::Adaptive(screen) => Self::adaptive(screen.density.clone(), seed, cells),
            Self::Steered(SteeredScreen { screen, paths }) => {
                Self::steered(screen.density.clone(), paths.clone(), seed, cells)
            }
        }
    }

    /// The seed of this stage of a render of seed `seed`.
    pub fn seed(&self, seed: u32) -> u32 {
        if matches!(self, Self::Pilot) { seed ^ PILOT_SEED } else { seed }
    }

    /// The start of camera path number `path`.
    #[inline]
    pub fn start(&self, path: u64) -> CameraStart {
        match self {
            Self::Even => CameraStart { index: path, weight: 1.0 },
            Self::Pilot => CameraStart { index: path, weight: PILOT_WEIGHT },
            Self::Adaptive(screen) => screen.start(path, 0),
            Self::Steered(SteeredScreen { screen, paths }) if paths.contains(&path) => {
                screen.start(path - paths.start, APART)
            }
            Self::Steered(_) => CameraStart { index: path, weight: 1.0 },
        }
    }

    /// The number by which what comes with camera path `path` is enumerated, such as light subpaths, where the path does not take its turn in the
    /// sequence; `None` where it does. No other path of the render has this number.
    pub fn out_of_turn(&self, path: u64) -> Option<u64> {
        match self {
            Self::Even | Self::Pilot => None,
            Self::Adaptive(_) => Some(path),
            Self::Steered(SteeredScreen { paths, .. }) => paths.contains(&path).then_some(APART + path),
        }
    }
}

impl AdaptiveScreen {
    fn new(density: Arc<ScreenDensity>, seed: u32, cells: &ScreenCells) -> Self {
        let squares = Arc::new(ScreenSquares::new(density.level, seed, cells));
        Self { density, squares }
    }

    /// The start of the path of this number, in the part of the sequence that begins at index `from`, a multiple of the number of regions.
    #[inline]
    fn start(&self, path: u64, from: u64) -> CameraStart {
        let ScreenDensity { level, counts, places } = &*self.density;
        // A power of two.
        let (round, place) = (path >> places.len().trailing_zeros(), path & (places.len() as u64 - 1));
        let [region, before] = places[place as usize];
        let count = counts[region as usize];
        let visit = (from >> (2 * level)) + round * u64::from(count) + u64::from(before);
        CameraStart {
            index: self.squares.index(region as usize, visit),
            weight: PER_ROUND as f32 / count as f32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::bits::interleave;
    use crate::math::random::Random;
    use crate::tracer::Sampler;

    fn errors(level: u32) -> Vec<f64> {
        let mut random = Random(5);
        (0..1 << (2 * level)).map(|_| f64::from(random.f32()).powi(6)).collect()
    }

    #[test]
    fn paths_are_proportional_to_the_root_of_the_error_above_a_quarter() {
        let errors = errors(4);
        let density = ScreenDensity::new(&errors);
        let total: f64 = errors.iter().map(|error| error.sqrt()).sum();
        for (error, density) in errors.iter().zip(density.relative()) {
            let wanted = 0.25 + 0.75 * error.sqrt() / total * 256.0;
            assert!((f64::from(density) - wanted).abs() < 1.0 / 16.0, "{density} {wanted}");
        }
        let mean = density.relative().map(f64::from).sum::<f64>() / 256.0;
        assert_eq!((mean, density.places.len()), (1.0, 4096));
        for nothing in [0.0, f64::NAN] {
            assert!(ScreenDensity::new(&[nothing; 16]).relative().all(|density| density == 1.0));
        }
    }

    #[test]
    fn regions_have_64_texels_at_most_until_they_are_too_many() {
        let texels = |side: f64| side * side / f64::from(1 << (2 * ScreenDensity::level(side * side)));
        for side in [8.0, 33.0, 64.0, 200.0, 512.0, 1000.0] {
            assert!((16.0..=64.0).contains(&texels(side)), "{side}: {}", texels(side));
        }
        assert_eq!((ScreenDensity::level(1.0), ScreenDensity::level(1e9)), (0, MAX_LEVEL));
    }

    /// A round has as many paths in each region as the density says, each region's are those of the even sequence one after the other, and
    /// their weights add up to the same everywhere: the map of the sequence to the screen integrates to one.
    #[test]
    fn every_region_has_its_part_of_the_sequence() {
        let (level, seed, rounds) = (3, 7, 4);
        let cells = ScreenCells::of_pixels([512.0; 2]);
        let density = Arc::new(ScreenDensity::new(&errors(level)));
        let sampling = ScreenSampling::adaptive(density.clone(), seed, &cells);
        let even = ScreenSquares::new(level, seed, &cells);
        let mut seen: Vec<Vec<CameraStart>> = vec![Vec::new(); 64];
        for path in 0..rounds * 1024 {
            let start = sampling.start(path);
            let at = Sampler::in_cells(start.index, seed, &cells).camera().screen.map(|x| (x * 8.0) as u32);
            seen[interleave(at) as usize].push(start);
        }
        for (region, (starts, density)) in seen.iter().zip(density.relative()).enumerate() {
            assert_eq!(starts.len() as f32, density * 16.0 * rounds as f32);
            let weight: f64 = starts.iter().map(|start| f64::from(start.weight)).sum();
            assert!((weight / 64.0 - 1.0).abs() < 1e-5, "region {region}: {weight}");
            for (visit, start) in (0..).zip(starts) {
                assert_eq!(start.index, even.index(region, visit));
            }
        }
        // Far fewer paths than a round, and they lie all over the screen.
        let mut quarters = [0; 4];
        for path in 0..64 {
            let screen = Sampler::in_cells(sampling.start(path).index, seed, &cells).camera().screen;
            quarters[interleave(screen.map(|x| (x * 2.0) as u32)) as usize] += 1;
        }
        let wanted: Vec<f32> = density.relative().collect();
        for (quarter, wanted) in quarters.iter().zip(wanted.chunks(16)) {
            let wanted = wanted.iter().sum::<f32>();
            assert!((*quarter as f32 - wanted).abs() <= 1.0, "{quarter} {wanted}");
        }
    }

    /// 4^k paths of a region lie one in each of its 2^k × 2^k squares, as those of an even render do.
    #[test]
    fn within_a_region_paths_are_stratified() {
        let (level, seed) = (2, 3);
        let cells = ScreenCells::of_pixels([512.0; 2]);
        let density = Arc::new(ScreenDensity::new(&errors(level)));
        let sampling = ScreenSampling::adaptive(density.clone(), seed, &cells);
        let mut places: Vec<Vec<[f64; 2]>> = vec![Vec::new(); 16];
        for path in 0..256 * 64 {
            let screen = Sampler::in_cells(sampling.start(path).index, seed, &cells).camera().screen;
            places[interleave(screen.map(|x| (4.0 * x) as u32)) as usize].push(screen);
        }
        for (region, places) in places.iter().enumerate() {
            for k in 1..=4 {
                let side = f64::from(1 << k);
                let mut cells = vec![0; 1 << (2 * k)];
                for screen in &places[..1 << (2 * k)] {
                    let cell = screen.map(|x| ((4.0 * x).fract() * side) as u32);
                    cells[interleave(cell) as usize] += 1;
                }
                assert!(cells.iter().all(|count| *count == 1), "region {region}, level {k}: {cells:?}");
            }
        }
    }

    /// Steered paths have the places and weights of an adaptive screen, in a part of the sequence of their own; all others are those of an even screen.
    #[test]
    fn only_the_steered_paths_leave_the_order_of_the_sequence() {
        let (level, seed, steered) = (3, 7, 1024..3072);
        let cells = ScreenCells::of_pixels([512.0; 2]).beside(1);
        let density = Arc::new(ScreenDensity::new(&errors(level)));
        let adaptive = ScreenSampling::adaptive(density.clone(), seed, &cells);
        let sampling =
            ScreenSampling::steered(density.clone(), steered.clone(), 0, &cells).with_seed(seed, &cells);
        let region = |index: u64| {
            let screen = Sampler::in_cells(index, seed, &cells).camera().screen;
            interleave(screen.map(|x| (x * 8.0) as u32)) as usize
        };
        let mut weights = vec![0.0; 64];
        for path in 0..4096 {
            let start = sampling.start(path);
            if !steered.contains(&path) {
                assert_eq!(start, ScreenSampling::Even.start(path));
                assert_eq!(sampling.out_of_turn(path), None);
                continue;
            }
            let same = adaptive.start(path - steered.start);
            assert_eq!((start.weight, region(start.index)), (same.weight, region(same.index)));
            assert!(start.index >= APART && sampling.out_of_turn(path).is_some_and(|number| number >= APART));
            weights[region(start.index)] += f64::from(start.weight);
        }
        // Two rounds of 16 paths on average in each region.
        assert!(weights.iter().all(|weight| (weight / 32.0 - 1.0).abs() < 1e-5), "{weights:?}");
    }

    #[test]
    fn stages_have_randomisations_of_their_own() {
        let density = Arc::new(ScreenDensity::new(&errors(3)));
        let cells = ScreenCells::of_pixels([512.0; 2]);
        let main = ScreenSampling::adaptive(density, 9, &cells);
        assert_eq!((ScreenSampling::Even.seed(9), main.seed(9)), (9, 9));
        assert_ne!(ScreenSampling::Pilot.seed(9) & 0x7fff_ffff, 9);
        assert_eq!(ScreenSampling::Pilot.start(5), CameraStart { index: 5, weight: 0.5 });
        let ScreenSampling::Adaptive(other) = main.with_seed(10, &cells) else { panic!("adaptive") };
        let ScreenSampling::Adaptive(main) = main else { panic!("adaptive") };
        assert!(Arc::ptr_eq(&other.density, &main.density));
        let first = |screen: &AdaptiveScreen| (0..64).map(|i| screen.squares.index(i, 0)).collect::<Vec<_>>();
        assert_ne!(first(&other), first(&main));
    }
}
