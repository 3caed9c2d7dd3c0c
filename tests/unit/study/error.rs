//! Tests of `study::error`.

use pointillist::math::bits::mix;
use pointillist::study::error::*;
use pointillist::study::error_tile::{ReplicatePixel, TILE};

/// Noise of a known size: 5 % of the luminance in either replicate, independent.
fn noisy(side: usize, seed: u64) -> Vec<ReplicatePixel> {
    let uniform = |i: u64| (mix(i) >> 11) as f64 / (1u64 << 53) as f64;
    // Sums of twelve uniform numbers less six: variance 1.
    let normal = |i: u64| (0..12).map(|k| uniform(seed << 40 ^ i << 4 ^ k)).sum::<f64>() - 6.0;
    let pixel = |i: usize| {
        let [a, b] = [0, 1].map(|r| (1.0 + 0.05 * normal(2 * i as u64 + r)) as f32);
        ReplicatePixel { mean: [(a + b) / 2.0; 3], difference: [a - b; 3], factor: 0.25, seen: true }
    };
    (0..side * side).map(pixel).collect()
}

#[test]
fn the_error_is_that_of_the_mean_and_its_interval_holds_the_truth() {
    let (side, mut held) = (64, 0);
    for seed in 0..200 {
        let pixels = noisy(side, seed);
        let field = ErrorField::new(&pixels, [side; 2]).expect("every pixel was seen");
        let figures = field.estimate(TileSubset::All);
        let median = figures.relative[0].value * 1.01;
        assert!((median / (0.05 / 2f64.sqrt()) - 1.0).abs() < 0.08, "{median}");
        let mean: Vec<[f32; 3]> = pixels.iter().map(|pixel| pixel.mean).collect();
        let truth = vec![[1.0; 3]; side * side];
        let against = ErrorField::against(&mean, &truth, [side; 2]).expect("two pictures");
        held += usize::from(figures.relative[1].holds(against.estimate(TileSubset::All).relative[1].value));
        let noise = ErrorField::noise(&pixels, &truth, [side; 2]).expect("every pixel was seen");
        let ratio =
            noise.estimate(TileSubset::All).rel_mse.value / against.estimate(TileSubset::All).rel_mse.value;
        assert!((ratio - 1.0).abs() < 0.2, "{ratio}");
    }
    // 90 % of 200, within three standard deviations and what 16 selections do to a tail.
    assert!((165..=195).contains(&held), "{held}");
}

/// The mean of two independent pictures, the second of nine times as many samples, and what is stated of it, tile by tile.
#[test]
fn the_error_of_mixed_pictures_is_that_of_their_mean() {
    let (side, mut held) = (64, 0);
    for seed in 0..100 {
        let mut pixels = noisy(side, seed);
        let better = |mut pixel: ReplicatePixel| {
            pixel.mean = pixel.mean.map(|c| 1.0 + (c - 1.0) / 3.0);
            pixel.difference = pixel.difference.map(|d| d / 3.0);
            pixel
        };
        let others = OtherSamples {
            origin: [16, -8],
            size: [40, 32],
            pixels: noisy(side, seed + 1000)[..40 * 32].iter().copied().map(better).collect(),
            per_pixel: vec![9.0; 40 * 32],
        };
        let before = pixels.clone();
        let mut per_pixel = vec![1.0; side * side];
        others.mix_into(&mut pixels, side, &mut per_pixel);
        let inside = |i: usize| (16..56).contains(&(i % side)) && i / side < 24;
        assert!((0..side * side).all(|i| inside(i) || pixels[i] == before[i]));
        assert!((0..side * side).all(|i| per_pixel[i] == if inside(i) { 10.0 } else { 1.0 }));
        let part = |pixels: &[ReplicatePixel]| -> Vec<ReplicatePixel> {
            (0..side * side).filter(|i| inside(*i)).map(|i| pixels[i]).collect()
        };
        let (pixels, size) = (part(&pixels), [40, 24]);
        let figures = ErrorField::new(&pixels, size).expect("every pixel was seen").estimate(TileSubset::All);
        // A tenth of the variance of one sample per pixel.
        let median = figures.relative[0].value * 1.01;
        assert!((median / (0.05 / 20f64.sqrt()) - 1.0).abs() < 0.15, "{median}");
        let mean: Vec<[f32; 3]> = pixels.iter().map(|pixel| pixel.mean).collect();
        let against = ErrorField::against(&mean, &[[1.0; 3]; 40 * 24], size).expect("two pictures");
        held += usize::from(figures.relative[1].holds(against.estimate(TileSubset::All).relative[1].value));
    }
    // 90 % of 100 within three standard deviations; a tail of 15 tiles is held a little less often.
    assert!((78..=99).contains(&held), "{held}");
}

#[test]
fn black_pictures_and_tiny_ones_are_no_trouble() {
    let black = vec![ReplicatePixel { factor: 0.25, seen: true, ..ReplicatePixel::default() }; 64];
    let field = ErrorField::new(&black, [8, 8]).expect("every pixel was seen");
    assert_eq!(field.estimate(TileSubset::HeldOut).relative[1].value, 0.0);
    assert!(field.coarse([12, 12]).is_empty() && field.map() == [0.0]);
    let one = noisy(1, 7);
    let field = ErrorField::new(&one, [1, 1]).expect("one pixel");
    assert!(field.estimate(TileSubset::Deciding).relative[1].value >= 0.0);
    assert!(ErrorField::new(&[], [0, 0]).is_none());
    let unseen = vec![ReplicatePixel::default(); 64];
    assert!(ErrorField::new(&unseen, [8, 8]).is_none());
}

#[test]
fn both_halves_of_a_picture_say_the_same() {
    let field = ErrorField::new(&noisy(128, 3), [128; 2]).expect("every pixel was seen");
    let [a, b] =
        [TileSubset::Deciding, TileSubset::HeldOut].map(|part| field.estimate(part).relative[0].value);
    assert!((a / b - 1.0).abs() < 0.05 && a != b, "{a} {b}");
    assert_eq!(field.coarse([4, 4]).len(), 16);
}

/// If one tile alone has met what makes its error, three others may be about to (the rule of three). Where all tiles are alike, three more of them
/// are next to nothing.
#[test]
fn the_upper_end_of_rel_mse_allows_for_three_more_tiles_like_the_largest() {
    let side = 128;
    let even = noisy(side, 1);
    let alone: Vec<ReplicatePixel> = (0..side * side)
        .map(|i| match i % side < TILE && i / side < TILE {
            true => even[i],
            false => ReplicatePixel { mean: [1.0; 3], difference: [0.0; 3], ..even[i] },
        })
        .collect();
    let upper = |pixels: &[ReplicatePixel]| {
        let field = ErrorField::new(pixels, [side; 2]).expect("every pixel was seen");
        let rel_mse = field.estimate(TileSubset::All).rel_mse;
        rel_mse.high / rel_mse.value
    };
    let [even, alone] = [upper(&even), upper(&alone)];
    assert!(even < 1.25 && alone >= 4.0, "{even} {alone}");
}
