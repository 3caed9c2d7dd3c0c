//! Adaptive filtering of the light stream on the device against its reference.

use crate::common::{Both, assert_silent, film, gpu, scene, spec};
use crate::reference::difference;
use glam::Vec4;
use pointillist::client::film::VulkanFilm;
use pointillist::client::lod::StreamLod;
use pointillist::client::reference::adaptive_filter::adaptive_filter;
use pointillist::client::reference::reconstruct::{ReconstructParameters, StreamView, reconstruct};
use pointillist::client::{AdaptiveFilter, Film, FilmData, FilmSpec, Reconstruction, Settings, SplatFilter};
use pointillist::image::Grid;
use pointillist::stream::PathCounts;

fn settings(adaptive_filter: AdaptiveFilter) -> Settings {
    Settings { adaptive_filter, ..Settings::default() }
}

/// The reference's picture of a film's light stream.
fn wanted(data: &FilmData, spec: FilmSpec, detail: u32) -> Vec<[f32; 3]> {
    let sums = data.light.iter().map(|sum| Vec4::from_array(*sum)).collect();
    let sums = Grid::from_rows(data.width as usize, data.height as usize, sums).expect("a grid");
    let inverse_scale = data.luminance_scale.recip();
    let filtered = adaptive_filter(sums, inverse_scale, detail.ilog2() as usize).expect("memory");
    let lod = StreamLod::new(1, data.counts.light_samples, 1).expect("samples");
    let view = StreamView {
        color: std::slice::from_ref(&filtered),
        variance: None,
        lod,
        summed: true,
        filtered: true,
    };
    let p = ReconstructParameters {
        spec,
        method: Reconstruction::Gaussian,
        kernel: Default::default(),
        vm: 0.0,
        luminance_scale: data.luminance_scale,
        light_scale: data.counts.light_scale(spec.width, spec.height),
        detail,
    };
    let picture = reconstruct(&p, None, Some(&view)).expect("memory");
    picture.pixels().iter().map(|v| v.to_array()).collect()
}

/// From one sample to many a texel, at all internal resolutions, odd and thin sizes included.
#[test]
fn adaptive_pictures_equal_the_reference() {
    for (width, height) in [(131, 67), (64, 64), (2, 3), (1, 9)] {
        let spec = spec(width, height, SplatFilter::Gaussian);
        for count in [1, 60, 3_000, 100_000] {
            let mut film = film(spec);
            film.add(&scene(&spec, count, 5, 1)).expect("add");
            film.count_paths(PathCounts { camera: 0, light: count as u64 });
            let data = film.develop().expect("develop");
            for detail in [1, 2, 4] {
                let got = film.reconstruct(&settings(AdaptiveFilter::Light), detail).expect("reconstruct");
                let off = difference(&got, &wanted(&data, spec, detail));
                assert!(off < 5e-5, "{width}×{height}, detail {detail}, {count} samples: {off}");
            }
        }
    }
    assert_silent(gpu());
}

/// Both streams, all reconstructions, with noise masking of the other stream: the whole way to the screen.
#[test]
fn adaptive_displays_equal_the_reference() {
    for (width, height) in [(95, 62), (1, 1)] {
        let mut both = Both::new(spec(width, height, SplatFilter::Gaussian));
        for (count, every_light) in [(40, 2), (2_000, 3), (60_000, 2)] {
            both.add_scene(count, every_light);
            for reconstruction in crate::common::RECONSTRUCTIONS {
                for vm in [0.0, 0.5] {
                    let settings = Settings { reconstruction, vm, ..settings(AdaptiveFilter::Light) };
                    both.assert_display(
                        &settings,
                        20,
                        &format!("{reconstruction:?}, Vm {vm}, {count} samples"),
                    );
                }
            }
        }
    }
    assert_silent(gpu());
}

/// Sums of a moving picture, one texel per 4×4 pixels, show the light of those at full resolution.
#[test]
fn coarse_sums_are_filtered_too() {
    let spec = spec(96, 64, SplatFilter::Gaussian);
    let samples = scene(&spec, 300, 9, 1);
    let mean = |film: &mut VulkanFilm| {
        film.add(&samples).expect("add");
        film.count_paths(PathCounts { camera: 0, light: 300 });
        film.flush().expect("flush");
        let shown = film.reconstruct(&settings(AdaptiveFilter::Light), 1).expect("reconstruct");
        shown.iter().map(|xyz| f64::from(xyz[1])).sum::<f64>() / shown.len() as f64
    };
    let mut film = film(spec);
    let fine = mean(&mut film);
    film.begin_coarsely().expect("coarse sums");
    let coarse = mean(&mut film);
    assert!((coarse / fine - 1.0).abs() < 0.03, "{coarse} instead of {fine}");
    assert_silent(gpu());
}
