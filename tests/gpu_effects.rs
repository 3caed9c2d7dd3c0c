//! Effects of the display on the Vulkan device: internal resolution, curves, dither, outputs, against their twins.

mod gpu_support;

use gpu_support::{assert_silent, film, gpu, scene, settings, spec};
use pointillist::client::film::VulkanFilm;
use pointillist::client::{Reconstruction, Settings, SplatFilter};
use pointillist::gpu::{Region, read_image};

/// What `paint` shows at this internal resolution, its texels' bytes.
fn painted(film: &mut VulkanFilm, settings: &Settings, detail: u32) -> Vec<u8> {
    let gpu = gpu().clone();
    film.flush().expect("flush");
    let extent = [film.spec().width, film.spec().height];
    let mut frame = gpu.begin().expect("a frame");
    film.paint(&mut frame.cmd(), settings, detail).expect("paint");
    frame.submit().expect("submit");
    // Recorded twice: the image is lent for one call.
    let mut frame = gpu.begin().expect("a frame");
    let image = film.paint(&mut frame.cmd(), settings, detail).expect("paint");
    frame.submit().expect("submit");
    read_image(&gpu, image, Region { origin: [0, 0], extent }).expect("read")
}

/// Detail 1 is the picture as ever; coarser ones are close to it, smooth, and of full size.
#[test]
fn coarse_pictures_are_interpolated() {
    let spec = spec(101, 67, SplatFilter::Gaussian);
    let mut film = film(spec);
    film.add(&scene(&spec, 60_000, 5, 0)).expect("add");
    let settings = settings(Reconstruction::Gaussian, 0.0);
    let fine = painted(&mut film, &settings, 1);
    let shown = film.display(&settings).expect("display");
    assert!(fine.chunks_exact(4).zip(&shown.rgb).all(|(a, b)| a[..3] == b[..]), "paint differs from display");
    for detail in [2u32, 4] {
        let coarse = painted(&mut film, &settings, detail);
        let xyz = film.reconstruct_coarse(&settings, detail).expect("reconstruct");
        assert_eq!(xyz.len() as u32, 101u32.div_ceil(detail) * 67u32.div_ceil(detail));
        let mean = |v: &[u8]| v.iter().map(|c| f64::from(*c)).sum::<f64>() / v.len() as f64;
        assert!((mean(&coarse) / mean(&fine) - 1.0).abs() < 0.02, "detail {detail} changes the mean");
        // The edge in the middle: interpolated, it takes at least two steps; enlarged pixels would take it in one.
        let row = &coarse[101 * 4 * 30..][..101 * 4];
        let across: Vec<_> = (44..58).map(|x| row[4 * x].abs_diff(row[4 * x + 4])).collect();
        let (total, most) = (row[4 * 58].abs_diff(row[4 * 44]), across.iter().max());
        assert!(total > 40 && most < Some(&(total * 6 / 10)), "detail {detail}: {across:?} of {total}");
    }
    assert_silent(gpu());
}
