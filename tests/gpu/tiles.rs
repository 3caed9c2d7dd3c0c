//! The reconstruction in a compute shader against that in a fragment shader, and both against the reference.

use crate::common::{assert_silent, open_with, scene, settings, spec};
use crate::reference::{coarse_reference_picture, difference};
use pointillist::client::background::BackgroundPolicy;
use pointillist::client::film::VulkanFilm;
use pointillist::client::{
    Film, FilmCounts, FilmData, FilmSpec, Masking, Reconstruction, ReconstructionKernel, Settings,
    SplatFilter,
};
use pointillist::gpu::{DeviceKind, Gpu, GpuOptions};
use pointillist::math::random::Random;
use std::sync::Arc;
use std::time::Duration;

/// Devices that run the fragment shader and the compute shader.
fn devices() -> [Arc<Gpu>; 2] {
    [false, true].map(|compute| open_with(GpuOptions { compute: Some(compute), ..GpuOptions::default() }))
}

/// Each device has compiled its own shader alone: every case was computed in two ways.
fn assert_two_ways(devices: &[Arc<Gpu>; 2]) {
    for (gpu, [wanted, other]) in devices.iter().zip([["frag", "comp"], ["comp", "frag"]]) {
        let pipelines = gpu.inventory().pipelines;
        let has = |stage| pipelines.iter().any(|name| name.starts_with(&format!("reconstruct.{stage}")));
        assert!(has(wanted) && !has(other), "not {wanted} alone: {pipelines:?}");
        assert_silent(gpu);
    }
}

/// The picture of two films, one on each of the [`devices`], which is the same bit for bit on lavapipe; on a GPU rounding may differ.
fn equal_pictures(
    films: &mut [VulkanFilm; 2],
    settings: &Settings,
    detail: u32,
    what: &str,
) -> Vec<[f32; 3]> {
    let [wanted, got] = films.each_mut().map(|film| film.reconstruct(settings, detail).expect("reconstruct"));
    let apart = difference(&got, &wanted);
    assert!(apart < 4e-5, "{what}: {apart}");
    if crate::common::gpu().info().kind == DeviceKind::Cpu {
        let bits = |picture: &[[f32; 3]]| picture.iter().map(|v| v.map(f32::to_bits)).collect::<Vec<_>>();
        assert!(bits(&got) == bits(&wanted), "{what}: {apart}, but not the same bits");
    }
    got
}

/// Random sums, empty texels among them, of streams with these levels of detail by the number of samples.
fn sums(spec: FilmSpec, lods: [Option<f64>; 2], seed: u64) -> FilmData {
    let [width, height] = spec.padded_extent();
    let texels = f64::from(width) * f64::from(height);
    let samples = lods.map(|lod| lod.map_or(0, |lod| (texels * (-2.0 * lod).exp2()).round().max(1.0) as u64));
    let mut random = Random(seed);
    let mut stream = |samples: u64| -> Vec<[f32; 4]> {
        let mut texel = || {
            let w = if random.f32() < 0.1 { 0.0 } else { 0.5 + random.f32() };
            [w * random.f32(), w * random.f32(), w * random.f32(), w]
        };
        if samples == 0 { Vec::new() } else { (0..texels as usize).map(|_| texel()).collect() }
    };
    let [camera, light] = samples.map(&mut stream);
    let [camera_samples, light_samples] = samples;
    let counts = FilmCounts {
        camera_samples,
        light_samples,
        camera_paths: camera_samples,
        light_paths: light_samples,
    };
    let (camera_variance, light_variance) = (Vec::new(), Vec::new());
    FilmData { width, height, camera, light, camera_variance, light_variance, luminance_scale: 1.0, counts }
}

/// Below -1, where a texel stands for itself; the two kernels between -1 and 0; 0; between levels; the coarsest level.
const LODS: [f64; 7] = [-1.2, -0.8, -0.3, 0.0, 1.3, 2.9, 20.0];

/// Pictures below a workgroup, of a whole one, odd ones, very different sides, and many workgroups; with margins and without.
const PICTURES: [([u32; 2], SplatFilter); 9] = [
    ([1, 1], SplatFilter::Gaussian),
    ([1, 1], SplatFilter::Box),
    ([7, 5], SplatFilter::Tent),
    ([16, 16], SplatFilter::Box),
    ([33, 17], SplatFilter::Box),
    ([61, 43], SplatFilter::Gaussian),
    ([100, 3], SplatFilter::Box),
    ([130, 97], SplatFilter::Gaussian),
    ([1027, 19], SplatFilter::Gaussian),
];

#[test]
fn tiles_hold_what_pixels_read() {
    let devices = devices();
    let settings = settings(Reconstruction::Gaussian, 0.0);
    for (i, ([width, height], filter)) in PICTURES.into_iter().enumerate() {
        let spec = FilmSpec { variance: None, ..spec(width, height, filter) };
        let mut films = devices.each_ref().map(|gpu| VulkanFilm::new(gpu.clone(), spec).expect("a film"));
        for (j, lod) in LODS.into_iter().enumerate() {
            let other = LODS[(i + j) % LODS.len()];
            for lods in [[Some(lod), None], [None, Some(lod)], [Some(lod), Some(other)]] {
                let data = sums(spec, lods, (LODS.len() * i + j) as u64);
                films.iter_mut().for_each(|film| film.restore(&data).expect("restore"));
                for detail in [1, 2, 4] {
                    let what = format!("{width}×{height} {filter:?}, levels {lods:?}, detail {detail}");
                    let got = equal_pictures(&mut films, &settings, detail, &what);
                    let worst = difference(&got, &coarse_reference_picture(&data, spec, &settings, detail));
                    assert!(worst < 4e-5, "{what}: {worst} from the reference");
                }
            }
        }
    }
    assert_two_ways(&devices);
}

#[test]
fn tiles_are_as_large_as_the_kernel() {
    let devices = devices();
    let spec = FilmSpec { variance: None, ..spec(61, 43, SplatFilter::Gaussian) };
    let mut films = devices.each_ref().map(|gpu| VulkanFilm::new(gpu.clone(), spec).expect("a film"));
    for lod in LODS {
        let data = sums(spec, [Some(lod), Some(lod)], 3);
        films.iter_mut().for_each(|film| film.restore(&data).expect("restore"));
        for (taps, exponent) in [(2, 8), (3, 0), (4, 1), (5, 0), (7, 8), (8, 0)] {
            let kernel = ReconstructionKernel { taps, exponent };
            let settings = Settings { kernel, ..settings(Reconstruction::Gaussian, 0.0) };
            let what = format!("{kernel:?}, level {lod}");
            let got = equal_pictures(&mut films, &settings, 1, &what);
            let worst = difference(&got, &coarse_reference_picture(&data, spec, &settings, 1));
            assert!(worst < 4e-5, "{what}: {worst} from the reference");
        }
    }
    assert_two_ways(&devices);
}

/// Coarse sums, several pixels for each texel, or a little more than one where the sides do not divide.
#[test]
fn tiles_of_coarse_sums() {
    let devices = devices();
    let spec = spec(183, 121, SplatFilter::Gaussian);
    let mut films = devices.each_ref().map(|gpu| VulkanFilm::new(gpu.clone(), spec).expect("a film"));
    for count in [1, 100, 4_000] {
        for film in &mut films {
            film.begin_coarsely().expect("coarse sums");
            film.add(&scene(&spec, count, 7, 3)).expect("add");
        }
        for detail in [1, 2, 4] {
            let what = format!("{count} samples, detail {detail}");
            equal_pictures(&mut films, &settings(Reconstruction::Gaussian, 0.0), detail, &what);
        }
    }
    assert_two_ways(&devices);
}

/// Sums that the bilateral filter has changed, which are shown texel by texel.
#[test]
fn tiles_of_filtered_sums() {
    let devices = devices();
    let spec = spec(61, 43, SplatFilter::Gaussian);
    let [width, height] = spec.padded_extent();
    let mut films = devices.each_ref().map(|gpu| VulkanFilm::new(gpu.clone(), spec).expect("a film"));
    for film in &mut films {
        film.add(&scene(&spec, (5 * width * height) as usize, 8, 0)).expect("add");
    }
    let settings = Settings { masking: Masking::Bilateral, ..settings(Reconstruction::Gaussian, 0.5) };
    equal_pictures(&mut films, &settings, 1, "filtered");
    assert_two_ways(&devices);
}

/// A film that does not wait shows the picture of before while the compute shader is compiled, as it does for fragment shaders.
#[test]
fn tiled_pipelines_are_compiled_aside() {
    let [_, gpu] = devices();
    let spec = spec(64, 48, SplatFilter::Gaussian);
    let mut film = VulkanFilm::new(gpu.clone(), spec).expect("a film");
    film.set_background_policy(BackgroundPolicy::Background);
    film.add(&scene(&spec, 2_000, 4, 2)).expect("add");
    film.flush().expect("flush");
    let mut gives_up = |taps: u32| {
        let kernel = ReconstructionKernel { taps, exponent: 8 };
        let settings = Settings { kernel, ..settings(Reconstruction::Gaussian, 0.0) };
        let mut frame = gpu.begin().expect("a frame");
        film.paint(&mut frame.cmd(), &settings, 1, &mut []).expect("paint");
        gpu.wait(frame.submit().expect("submit")).expect("wait");
        film.has_given_up()
    };
    assert!(!gives_up(5), "there is nothing to show meanwhile");
    assert!(gives_up(3), "it has waited");
    while gives_up(3) {
        std::thread::sleep(Duration::from_millis(1));
    }
    let pipelines = gpu.inventory().pipelines;
    let tiled = pipelines.iter().filter(|name| name.starts_with("reconstruct.comp")).count();
    assert_eq!(tiled, 2, "{pipelines:?}");
    assert_silent(&gpu);
}
