//! The noise filter on the device against the one on the processor.

use crate::common::{assert_silent, gpu, open};
use glam::{Vec3, Vec4};
use pointillist::client::pass::wavelet::WaveletPass;
use pointillist::client::wavelet::{HalfPicture, PixelFeatures, WaveletFilter};
use pointillist::gpu::DeviceCall;
use pointillist::image::Grid;
use pointillist::math::random::Random;

/// Two walls and a lamp, with noise, bright samples that only one half has, and pixels that one or both halves miss.
fn halves(size: [usize; 2], seed: u64) -> [HalfPicture; 2] {
    let mut random = Random(seed);
    [0, 1].map(|_| {
        let pixel = |i: usize| {
            let (x, y) = (i % size[0], i / size[0]);
            let light = if x * 2 < size[0] { 0.3 } else { 1.2 } * (1.0 + 0.3 * (0.7 * y as f32).sin());
            let noise = -random.f32().max(1e-6).ln();
            let outlier = if random.f32() < 0.01 { 300.0 } else { 1.0 };
            let count = [0.0, 1.0, 2.0, 7.0][(random.f32() * 4.0) as usize % 4];
            (Vec3::new(1.1, 1.0, 0.4) * light * noise * outlier).extend(count)
        };
        let pixels = (0..size[0] * size[1]).map(pixel).map(|v| if v.w > 0.0 { v } else { Vec4::ZERO });
        Grid::from_rows(size[0], size[1], pixels.collect()).expect("of this size")
    })
}

fn features(size: [usize; 2], seed: u64) -> [Grid<PixelFeatures>; 2] {
    let mut random = Random(seed);
    [0, 1].map(|_| {
        let pixel = |i: usize| {
            let (x, y) = (i % size[0], i / size[0]);
            let is_left = x * 2 < size[0];
            PixelFeatures {
                albedo: Vec3::splat(0.5 + 0.05 * random.f32()),
                normal: if is_left { Vec3::X } else { Vec3::new(0.0, 0.6, 0.8) },
                distance: 3.0 + 0.1 * y as f32,
                emits: !is_left && y < 5,
            }
        };
        let pixels = (0..size[0] * size[1]).map(pixel).collect();
        Grid::from_rows(size[0], size[1], pixels).expect("of this size")
    })
}

/// Largest and root mean square difference over the picture, each relative to the larger value of the pixel.
fn differences(got: &Grid<Vec3>, wanted: &Grid<Vec3>) -> [f32; 2] {
    let relative = |(a, b): (&Vec3, &Vec3)| {
        let least = Vec3::splat(f32::MIN_POSITIVE);
        ((*a - *b).abs() / a.abs().max(b.abs()).max(least)).max_element()
    };
    let all: Vec<f32> = got.pixels().iter().zip(wanted.pixels()).map(relative).collect();
    let squares: f32 = all.iter().map(|d| d * d).sum();
    [all.iter().fold(0.0, |most, d| d.max(most)), (squares / all.len() as f32).sqrt()]
}

/// Weights have eleven bits on the device; everything else differs by rounding. What is left where bands of bright samples cancel differs most.
#[test]
fn the_device_filters_as_the_processor_does() {
    let mut last = None;
    // The second and third use the memory of the one before.
    for (size, seed) in [([1, 1], 1), ([7, 3], 2), ([150, 91], 3), ([150, 91], 4), ([33, 128], 5)] {
        let features = features(size, seed);
        let mut pass = WaveletPass::after(last.take(), gpu(), features.each_ref()).expect("a device");
        let mut twin = WaveletFilter::after(None, size, Some(features.each_ref())).expect("memory");
        for seed in [10 + seed, 20 + seed] {
            let halves = halves(size, seed);
            let got = pass.filtered(halves.each_ref()).expect("a device");
            let wanted = twin.filtered(halves.each_ref()).expect("memory");
            let [most, usual] = differences(&got.picture, &wanted.picture);
            assert!(most < 0.02 && usual < 5e-4, "{size:?}: {most:e}, root mean square {usual:e}");
            let gains = got.finest.pixels().iter().zip(wanted.finest.pixels());
            let error = gains.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(error < 1e-3, "gain, {size:?}: {error:e}");
        }
        last = Some(pass);
    }
    assert_silent(gpu());
}

/// Memory that is exhausted is an error, and the device is as good as before.
#[test]
fn exhausted_memory_is_an_error() {
    let gpu = open(false);
    let features = features([64, 64], 1);
    gpu.faults().fail_after(DeviceCall::Allocation, 5);
    assert!(WaveletPass::after(None, &gpu, features.each_ref()).is_err());
    gpu.faults().fail_after(DeviceCall::Allocation, u64::MAX);
    let mut pass = WaveletPass::after(None, &gpu, features.each_ref()).expect("memory");
    pass.filtered(halves([64, 64], 2).each_ref()).expect("a picture");
}
