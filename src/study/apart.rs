//! Part of each replicate's samples kept apart (a hold-out), so that a noise filter can be evaluated on each replicate alone.
//!
//! A noise filter separates noise from detail by comparing two pictures of independent samples. To filter one replicate without the other
//! ([`denoised`](crate::study::denoised)), the replicate itself must be split in two.

use crate::math::bits::mix;
use crate::stream::{CHUNK, PathCounts, Sample};
use crate::study::Replicates;

/// If either part of a replicate is below this fraction, it is too noisy for the filter to estimate the noise of both.
const LEAST_SHARE: f64 = 0.2;

/// Sums over the held-out samples of each replicate.
#[derive(Clone, Debug)]
pub struct SamplesApart {
    sums: Replicates,
    /// Whether half of the future samples are added.
    grows: bool,
}

impl SamplesApart {
    /// Holds out half of the samples that are added to these sums from now on; the sums must be empty.
    pub fn half_to_come(sums: &Replicates) -> Self {
        Self { sums: sums.empty(), grows: true }
    }

    /// Holds out all samples of these sums so far.
    pub fn so_far(sums: &Replicates) -> Self {
        Self { sums: sums.clone(), grows: false }
    }

    /// Adds a block if it is held out; the block is also added to the sums of all samples. See [`Replicates::add`].
    pub fn add(&mut self, first_index: u64, paths: PathCounts, samples: &[Sample]) {
        // The half is chosen by a hash, since the chunk number itself may correlate with positions in the picture.
        if self.grows && mix(first_index / CHUNK) & 1 == 0 {
            self.sums.add(first_index, paths, samples);
        }
    }

    /// One replicate as a picture with two replicates: its held-out samples, and its others among `all`. `None` if either has too few.
    pub fn alone(&self, all: &Replicates, replicate: usize) -> Option<Replicates> {
        let alone = all.divided(&self.sums, replicate);
        let [some, others] = alone.paths_of_parts().map(|paths| paths as f64);
        (some.min(others) >= LEAST_SHARE * (some + others) && some > 0.0).then_some(alone)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Xyz;

    /// Chunk `chunk` adds samples of luminance `chunk` + 1 to all pixels.
    fn add(chunks: std::ops::Range<u64>, sums: &mut Replicates, mut apart: Option<&mut SamplesApart>) {
        for chunk in chunks {
            let place = |i: u64| [(i % 16) as f32 / 16.0, (i / 16 % 16) as f32 / 16.0];
            let y = (chunk + 1) as f32;
            let samples: Vec<Sample> =
                (0..CHUNK).map(|i| Sample { uv: place(i), xyz: Xyz::new(y, y, y), w: 1.0 }).collect();
            let paths = PathCounts { camera: CHUNK, light: 0 };
            sums.add(chunk * CHUNK, paths, &samples);
            if let Some(apart) = &mut apart {
                apart.add(chunk * CHUNK, paths, &samples);
            }
        }
    }

    fn empty() -> Replicates {
        Replicates::new([16; 2], 1.0)
    }

    #[test]
    fn halves_of_a_replicate_are_the_replicate() {
        let mut sums = empty();
        let mut apart = SamplesApart::half_to_come(&sums);
        add(0..64, &mut sums, Some(&mut apart));
        for replicate in 0..2 {
            let alone = apart.alone(&sums, replicate).expect("both halves have samples");
            let mean = |half: usize| alone.half(half, 0..1)[0];
            let ([a, .., na], [b, .., nb]) = (mean(0), mean(1));
            let [all, .., n] = sums.half(replicate, 0..1)[0];
            assert!((na + nb - n).abs() < 1e-3 && na > 0.25 * n && nb > 0.25 * n, "{na}, {nb} of {n}");
            assert!(((a * na + b * nb) / n - all).abs() < 1e-3 * all, "{a}, {b}: {all}");
        }
    }

    /// A resumed render holds out its earlier samples; if these are nearly all or only a few, nothing is estimated.
    #[test]
    fn samples_from_before_are_apart_unless_one_part_is_small() {
        for (before, after, is_told) in [(32, 32, true), (16, 48, true), (60, 4, false), (4, 60, false)] {
            let mut sums = empty();
            add(0..before, &mut sums, None);
            let mut apart = SamplesApart::so_far(&sums);
            add(before..before + after, &mut sums, Some(&mut apart));
            let alone = apart.alone(&sums, 1);
            assert_eq!(alone.is_some(), is_told, "{before} and {after}");
            if let Some(alone) = alone {
                let [y, ..] = alone.half(0, 0..1)[0];
                assert!(y <= before as f32 && alone.half(1, 0..1)[0][0] > before as f32, "{y}");
            }
        }
    }
}
