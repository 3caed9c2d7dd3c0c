//! The reconstruction: equal to the formula in f64, without steps as LoD changes, and safe beside empty
//! regions, where Catmull–Rom without a floor for its weight is not.

use glam::Vec4;

use pointillist::client::lod::StreamLod;
use pointillist::client::reference::mips::{pyramid, trilinear};
use pointillist::client::reference::reconstruct::{
    ReconstructParameters, StreamView, catmull_rom, level_of_detail, reconstruct,
};
use pointillist::client::{FilmSpec, Reconstruction, ReconstructionKernel, SplatFilter};
use pointillist::image::Grid;
use pointillist::math::random::Random;

const SIZE: usize = 53;

fn spec() -> FilmSpec {
    FilmSpec {
        width: SIZE as u32,
        height: SIZE as u32,
        filter: SplatFilter::Box,
        variance: Some(Default::default()),
        sums: Default::default(),
    }
}

/// Levels of an image of noise in colour and weight.
fn levels() -> Vec<Grid<Vec4>> {
    let mut random = Random(9);
    let mut next = || random.f32();
    let texels = (0..SIZE * SIZE).map(|_| Vec4::new(next(), next(), next(), 1.0) * (0.1 + next()));
    pyramid(Grid::from_rows(SIZE, SIZE, texels.collect()).expect("53² texels")).expect("memory")
}

fn parameters(method: Reconstruction) -> ReconstructParameters {
    ReconstructParameters {
        spec: spec(),
        method,
        kernel: ReconstructionKernel::default(),
        vm: 0.0,
        luminance_scale: 1.0,
        light_scale: 1.0,
        detail: 1,
    }
}

/// The picture at a fixed LoD; on the light stream, which shows sums rather than quotients.
fn at_lod(levels: &[Grid<Vec4>], method: Reconstruction, lod: f32, light: bool) -> Vec<[f32; 3]> {
    let max_level = (levels.len() - 1) as f32;
    let lod = StreamLod { raw: lod, base: lod, variance: 0.0, max_level };
    let view = StreamView { color: levels, variance: None, lod, summed: light, filtered: false };
    let (camera, light) = if light { (None, Some(&view)) } else { (Some(&view), None) };
    let picture = reconstruct(&parameters(method), camera, light).expect("memory");
    picture.pixels().iter().map(|v| v.to_array()).collect()
}

/// Σ g T / Σ g over the whole level, by the formulas of the paper's §4.3, in f64.
fn exact_level(level: &Grid<Vec4>, p: [f64; 2], sigma: f64) -> [f64; 4] {
    let (mut sum, mut total) = ([0.0; 4], 0.0);
    for y in 0..level.height() {
        for x in 0..level.width() {
            let d2 = (x as f64 + 0.5 - p[0]).powi(2) + (y as f64 + 0.5 - p[1]).powi(2);
            let t = (d2.sqrt() / 2.5).min(1.0);
            let g = (-sigma * d2).exp() * (1.0 - (t * t * (3.0 - 2.0 * t)).powi(8));
            total += g;
            for (sum, v) in sum.iter_mut().zip(level.at(x, y).to_array()) {
                *sum += g * f64::from(v);
            }
        }
    }
    sum.map(|s| s / total)
}

fn exact(levels: &[Grid<Vec4>], x: usize, y: usize, lod: f64) -> [f64; 3] {
    let at = |level: usize, sigma: f64| {
        let grid = &levels[level];
        let place = |i: usize, size: usize| (i as f64 + 0.5) / SIZE as f64 * size as f64;
        exact_level(grid, [place(x, grid.width()), place(y, grid.height())], sigma)
    };
    let v = if lod < 0.0 {
        at(0, 16f64.powf(-lod))
    } else {
        let (level, f) = (lod as usize, lod.fract());
        let near = at(level, 4f64.powf(-f));
        let far = if f > 0.0 { at(level + 1, 4f64.powf(1.0 - f)) } else { near };
        std::array::from_fn(|k| near[k] * (1.0 - f) + far[k] * f)
    };
    [v[0] / v[3], v[1] / v[3], v[2] / v[3]]
}

#[test]
fn gaussian_is_the_formula() {
    let levels = levels();
    for lod in [-0.9f32, -0.3, 0.0, 0.4, 1.7, 2.0, 3.99, 5.0] {
        let picture = at_lod(&levels, Reconstruction::Gaussian, lod, false);
        for (x, y) in [(0, 0), (SIZE - 1, 0), (7, 31), (26, 26), (SIZE - 1, SIZE - 1), (13, 50)] {
            let wanted = exact(&levels, x, y, f64::from(lod));
            for (found, wanted) in picture[y * SIZE + x].into_iter().zip(wanted) {
                assert!((f64::from(found) - wanted).abs() < 2e-4 * wanted.max(0.1), "LoD {lod} at {x},{y}");
            }
        }
    }
}

/// No sudden pops as LoD changes (the paper's reason for two levels), where one level alone does pop.
#[test]
fn gaussian_has_no_steps() {
    let levels = levels();
    let difference = |a: &[[f32; 3]], b: &[[f32; 3]]| {
        a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    };
    for light in [false, true] {
        for lod in [0.0f32, 1.0, 2.0, 3.0, 4.0] {
            let below = at_lod(&levels, Reconstruction::Gaussian, lod - 1e-4, light);
            let above = at_lod(&levels, Reconstruction::Gaussian, lod + 1e-4, light);
            assert!(difference(&below, &above) < 2e-3, "{} at LoD {lod}", difference(&below, &above));
        }
    }
    let (one, two) = (
        at_lod(&levels, Reconstruction::Gaussian, 1.0, false),
        at_lod(&levels, Reconstruction::Gaussian, 2.0, false),
    );
    assert!(difference(&one, &two) > 0.05, "levels differ by {}", difference(&one, &two));
}

/// At level 0 every interpolating way returns the texel.
#[test]
fn sharp_ways_return_the_texel() {
    let levels = levels();
    let texels = at_lod(&levels, Reconstruction::None, -1.0, true);
    for (method, lod) in [
        (Reconstruction::Gaussian, -1.0),
        (Reconstruction::CatmullRom, -1.0),
        (Reconstruction::CatmullRom, 0.0),
        (Reconstruction::Mipmap, -0.5),
    ] {
        let picture = at_lod(&levels, method, lod, true);
        for (a, b) in picture.as_flattened().iter().zip(texels.as_flattened()) {
            assert!((a - b).abs() < 1e-5, "{method:?}: {a} {b}");
        }
    }
}

/// Beside an empty region the spline's weight all but cancels; the quotient must stay near the data.
#[test]
fn spline_beside_an_empty_region() {
    let value = Vec4::new(0.2, 0.5, 0.3, 1.0);
    let half = |x: usize| if x < SIZE / 2 { value * (1.0 + 0.3 * (x % 3) as f32) } else { Vec4::ZERO };
    let texels = (0..SIZE * SIZE).map(|i| half(i % SIZE)).collect();
    let levels = pyramid(Grid::from_rows(SIZE, SIZE, texels).expect("53² texels")).expect("memory");
    for lod in [0.5, 1.0, 1.5, 2.3] {
        for c in at_lod(&levels, Reconstruction::CatmullRom, lod, false) {
            assert!(c == [0.0; 3] || (c[1] - 0.5).abs() < 1e-4, "LoD {lod}: {c:?}");
        }
    }
    // With another colour beside it, the unguarded quotient leaves the range of the colours by far.
    let texels: Vec<Vec4> = (0..SIZE * SIZE)
        .map(|i| match i % SIZE {
            0..=23 => Vec4::new(1.0, 1.0, 1.0, 1.0),
            24 => Vec4::new(0.0, 0.0, 0.0, 0.05),
            _ => Vec4::ZERO,
        })
        .collect();
    let levels = pyramid(Grid::from_rows(SIZE, SIZE, texels).expect("53² texels")).expect("memory");
    let naive = |p: f32| catmull_rom(&levels[0], [p, 20.0]);
    let worst =
        (0..400).map(|i| naive(22.0 + i as f32 * 0.01)).map(|v| (v.y / v.w).abs()).fold(0.0, f32::max);
    assert!(worst > 2.0, "{worst}");
    for lod in [0.5, 1.0, 1.5, 2.3] {
        for c in at_lod(&levels, Reconstruction::CatmullRom, lod, false) {
            assert!(c[1].abs() < 2.0, "LoD {lod}: {c:?}");
        }
    }
}

/// Noise masking: the noisy half is blurred more than the clean half, and only with Vm.
#[test]
fn noise_is_masked_where_it_is() {
    let spec = spec();
    let noisy = |i: usize| if i % SIZE < SIZE / 2 { 4.0 } else { 0.0 };
    let color = (0..SIZE * SIZE).map(|_| Vec4::splat(4.0)).collect();
    let color = pyramid(Grid::from_rows(SIZE, SIZE, color).expect("53² texels")).expect("memory");
    let variance = (0..SIZE * SIZE).map(noisy).collect();
    let variance = pyramid(Grid::from_rows(SIZE, SIZE, variance).expect("53² texels")).expect("memory");
    let samples = 4 * (SIZE * SIZE) as u64;
    let lod = StreamLod::new((SIZE * SIZE) as u64, samples, color.len()).expect("has samples");
    let view = StreamView { color: &color, variance: Some(&variance), lod, summed: false, filtered: false };
    let mut p = ReconstructParameters { vm: 0.5, ..parameters(Reconstruction::Gaussian) };
    let (left, right) = (level_of_detail(&p, &view, [0.2, 0.5]), level_of_detail(&p, &view, [0.8, 0.5]));
    assert!(left > right + 0.5 && right >= lod.base, "{left} {right}");
    // Relative variance of the mean on the left: v' = (n + 2)/(n + 1), n = 4·4^0.5, over 4 samples.
    let n = 8.0f32;
    let r = (n + 2.0) / (n + 1.0) / (1.0 + 0.02 * 0.02) / 4.0;
    assert!((left - (-1.0 + 0.5 * 0.5 * (r / 0.0025).log2())).abs() < 0.01, "{left}");
    p.vm = 0.0;
    assert_eq!(level_of_detail(&p, &view, [0.2, 0.5]), lod.base);
    assert_eq!(spec.pad(), 0);
}

/// Trilinear filtering is continuous over levels and clamps at the edge.
#[test]
fn trilinear_is_continuous() {
    let levels = levels();
    for i in 0..100 {
        let (uv, lod) = ([(i * 7 % 100) as f32 * 0.01, i as f32 * 0.01], (i % 5) as f32);
        let (a, b) = (trilinear(&levels, uv, lod - 1e-4), trilinear(&levels, uv, lod + 1e-4));
        assert!((a - b).abs().max_element() < 1e-3);
    }
    assert_eq!(trilinear(&levels, [-1.0, -1.0], 0.0), levels[0].at(0, 0));
    assert_eq!(trilinear(&levels, [2.0, 2.0], 99.0), levels[levels.len() - 1].at(0, 0));
}
