//! Pictures composed of several on the Vulkan device: regions with samples of their own, and mixes of lights.

use crate::common::{assert_silent, film, gpu, scene, settings, spec};
use glam::{Mat3, Vec3};
use pointillist::client::pass::compose::PictureLayer;
use pointillist::client::{Film, Reconstruction, SplatFilter};
use pointillist::gpu::Region;
use pointillist::image::stereo::Eye;

/// Inside is the mean with the region's share, outside nothing has changed, at every internal resolution.
#[test]
fn a_region_is_mixed_with_its_share_and_nothing_else_changes() {
    let (whole_spec, region_spec) =
        (spec(65, 50, SplatFilter::Gaussian), spec(24, 16, SplatFilter::Gaussian));
    let settings = settings(Reconstruction::Gaussian, 0.0);
    let origin = [20, 12];
    // Two parts of it with shares of their own, and one that is left out.
    let part = |x, width| Region { origin: [x, 12], extent: [width, 16] };
    let parts = [(part(20, 8), 0.75), (part(28, 12), 0.25)];
    for detail in [1, 2, 4] {
        let (mut whole, mut region) = (film(whole_spec), film(region_spec));
        whole.add(&scene(&whole_spec, 40_000, 5, 0)).expect("add");
        region.add(&scene(&region_spec, 30_000, 6, 0)).expect("add");
        let alone = whole.reconstruct(&settings, detail).expect("reconstruct");
        let inset = region.reconstruct(&settings, detail).expect("reconstruct");
        let mut frame = gpu().begin().expect("a frame");
        let xyz = region.linear(&mut frame.cmd(), None, &settings, detail).expect("linear");
        let mut regions = [PictureLayer { xyz, origin, matrix: Mat3::IDENTITY, shares: parts.to_vec() }];
        whole.paint(&mut frame.cmd(), &settings, detail, &mut regions).expect("paint");
        gpu().wait(frame.submit().expect("submit")).expect("wait");
        let extent = [65, 50];
        let shown =
            whole.shown(Eye::Left, Region { origin: [0, 0], extent }).expect("read").expect("painted").xyz;
        let coarse = |x: u32, y: u32, width: u32| (y / detail * width.div_ceil(detail) + x / detail) as usize;
        for (i, shown) in shown.iter().enumerate() {
            let [x, y] = [i as u32 % 65, i as u32 / 65];
            let before = Vec3::from(alone[coarse(x, y, 65)]);
            if (20..40).contains(&x) && (12..28).contains(&y) {
                let share = if x < 28 { 0.75 } else { 0.25 };
                let own = Vec3::from(inset[coarse(x - 20, y - 12, 24)]);
                let expected = before.lerp(own, share);
                let off = (Vec3::from(*shown) - expected).abs().max_element();
                assert!(off <= 1e-5 * expected.max_element().max(1e-3), "{x} {y}: {shown:?} {expected}");
            } else {
                assert_eq!(Vec3::from(*shown), before, "{x} {y}");
            }
        }
    }
    assert_silent(gpu());
}

/// A mix is the sum of its layers, each through its matrix; nothing of what was there before is left.
#[test]
fn a_mix_is_the_sum_of_its_layers() {
    let spec = spec(65, 50, SplatFilter::Gaussian);
    let settings = settings(Reconstruction::Gaussian, 0.0);
    let matrices = [Mat3::from_diagonal(Vec3::new(2.0, 0.5, 1.0)), Mat3::from_cols_array(&[0.1; 9])];
    for detail in [1, 2] {
        let mut whole = film(spec);
        whole.add(&scene(&spec, 20_000, 7, 0)).expect("add");
        let mut groups = [8, 9].map(|seed| {
            let mut group = film(spec);
            group.add(&scene(&spec, 20_000, seed, 0)).expect("add");
            group
        });
        let pictures: Vec<_> = groups
            .iter_mut()
            .map(|group| group.reconstruct(&settings, detail).expect("reconstruct"))
            .collect();
        whole.flush().expect("flush");
        let mut frame = gpu().begin().expect("a frame");
        whole.paint(&mut frame.cmd(), &settings, detail, &mut []).expect("paint");
        let mut layers = Vec::new();
        for (group, matrix) in groups.iter_mut().zip(matrices) {
            let xyz = group.linear(&mut frame.cmd(), None, &settings, detail).expect("linear");
            let all = Region { origin: [0, 0], extent: [65, 50] };
            layers.push(PictureLayer { xyz, origin: [0, 0], matrix, shares: vec![(all, 1.0)] });
        }
        whole.paint_sum(&mut frame.cmd(), &settings, detail, &mut layers).expect("paint");
        gpu().wait(frame.submit().expect("submit")).expect("wait");
        let region = Region { origin: [0, 0], extent: [65, 50] };
        let shown = whole.shown(Eye::Left, region).expect("read").expect("painted").xyz;
        for (i, shown) in shown.iter().enumerate() {
            let [x, y] = [i as u32 % 65, i as u32 / 65];
            let at = (y / detail * 65u32.div_ceil(detail) + x / detail) as usize;
            let expected: Vec3 =
                pictures.iter().zip(matrices).map(|(picture, matrix)| matrix * Vec3::from(picture[at])).sum();
            let off = (Vec3::from(*shown) - expected).abs().max_element();
            assert!(off <= 1e-5 * expected.max_element().max(1e-3), "{x} {y}: {shown:?} {expected}");
        }
    }
    assert_silent(gpu());
}
