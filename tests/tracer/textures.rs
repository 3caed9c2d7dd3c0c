//! Textures: the coordinates of every shape, lookups, and what a scene without them keeps.
//!
//! Expected numbers are those of Mitsuba 3.9.1 (`scalar_rgb`) for the same shapes, rays and texels.

use glam::{Affine2, Vec2, Vec3};
use pointillist::image::bitmap::Bitmap;
use pointillist::scene::texture::{BitmapTexture, SpectrumTexture, WrapMode};
use pointillist::scene::{self, SceneDesc};
use pointillist::spectrum::{SampledWavelengths, Spectrum};
use pointillist::tracer::Scene;
use pointillist::tracer::accel::Ray;
use std::sync::Arc;

fn desc(shape: &str) -> SceneDesc {
    let board = "<bsdf type=\"twosided\"><bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"checkerboard\"/></bsdf></bsdf>";
    let text = format!(
        "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><emitter type=\"constant\"/>\
         <shape type=\"{shape}\">{board}</shape></scene>"
    );
    scene::load_str("test.xml", &text, &[]).expect("a valid scene").desc
}

#[test]
fn coordinates_are_those_of_mitsuba() {
    let along = |axis: usize, sign: f32| {
        let mut d = Vec3::ZERO;
        d[axis] = -sign;
        d
    };
    let cases = [
        ("rectangle", [0.3, 0.6, 5.0], (2, 1.0), [0.65, 0.8]),
        ("rectangle", [0.3, 0.6, -5.0], (2, -1.0), [0.65, 0.8]),
        ("rectangle", [-0.7, 0.2, 5.0], (2, 1.0), [0.15, 0.6]),
        ("disk", [0.3, 0.6, 5.0], (2, 1.0), [0.670_820_4, 0.176_208_21]),
        ("sphere", [0.3, 0.6, 5.0], (2, 1.0), [0.176_208_21, 0.234_057_87]),
        ("sphere", [0.3, 0.6, -5.0], (2, -1.0), [0.176_208_21, 0.765_942_1]),
        ("sphere", [-5.0, 0.2, 0.4], (0, -1.0), [0.464_987_8, 0.369_010_15]),
        ("sphere", [0.2, -5.0, 0.4], (1, -1.0), [0.785_012_2, 0.369_010_18]),
        ("cube", [0.3, 0.6, 5.0], (2, 1.0), [0.8, 0.65]),
        ("cube", [0.3, 0.6, -5.0], (2, -1.0), [0.2, 0.65]),
        ("cube", [5.0, 0.2, 0.4], (0, 1.0), [0.6, 0.3]),
        ("cube", [-5.0, 0.2, 0.4], (0, -1.0), [0.6, 0.7]),
        ("cube", [0.2, 5.0, 0.4], (1, 1.0), [0.4, 0.3]),
        ("cube", [0.2, -5.0, 0.4], (1, -1.0), [0.7, 0.6]),
    ];
    for (shape, from, (axis, sign), expected) in cases {
        let scene = Scene::prepare(&desc(shape)).expect("a scene");
        let hit = scene.closest(&Ray::new(Vec3::from(from), along(axis, sign))).expect("the shape is met");
        let off = (hit.uv - Vec2::from(expected)).abs().max_element();
        assert!(off < 2e-6, "{shape} from {from:?}: {} and not {expected:?}", hit.uv);
    }
}

/// 3 × 2 texels: red, green and blue above three greys.
fn bitmap(wrap: WrapMode, nearest: bool) -> SpectrumTexture {
    let mut texels = vec![[0.5; 3]; 6];
    (0..3).for_each(|i| texels[i] = std::array::from_fn(|c| if c == i { 1.0 } else { 0.0 }));
    let bitmap = Arc::new(Bitmap::from_linear(3, texels));
    SpectrumTexture::Bitmap(BitmapTexture::new(bitmap, Affine2::IDENTITY, wrap, nearest))
}

#[test]
fn lookups_are_those_of_mitsuba() {
    let lambda = SampledWavelengths::sample(0.3);
    let is = |texture: &SpectrumTexture, u: f32, v: f32, rgb: [f32; 3]| {
        let (found, expected) =
            (texture.sample(Vec2::new(u, v), &lambda), Spectrum::reflectance_rgb(rgb).sample(&lambda));
        let off = (found.0 - expected.0).abs().max_element();
        assert!(off < 0.03, "({u}, {v}) is {found:?} and not {expected:?} of {rgb:?}");
    };
    let [red, green, blue, grey] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.5; 3]];
    let nearest = bitmap(WrapMode::Repeat, true);
    for (u, v, rgb) in [
        (0.1, 0.1, red),
        (0.5, 0.1, green),
        (0.9, 0.1, blue),
        (0.1, 0.9, grey),
        (1.1, 0.1, red),
        (-0.1, 0.1, blue),
    ] {
        is(&nearest, u, v, rgb);
    }
    for (u, clamped, mirrored) in
        [(1.1, blue, blue), (1.5, blue, green), (1.9, blue, red), (-0.1, red, red), (-0.5, red, green)]
    {
        is(&bitmap(WrapMode::Clamp, true), u, 0.1, clamped);
        is(&bitmap(WrapMode::Mirror, true), u, 0.1, mirrored);
    }
    let bilinear = bitmap(WrapMode::Repeat, false);
    is(&bilinear, 1.0 / 3.0, 0.25, [0.5, 0.5, 0.0]);
    is(&bilinear, 0.0, 0.25, [0.5, 0.0, 0.5]);
    is(&bilinear, 1.0 / 6.0, 0.5, [0.75, 0.25, 0.25]);
    is(&bilinear, 1.0 / 6.0, 0.0, [0.75, 0.25, 0.25]);
    for nonsense in [f32::NAN, f32::INFINITY, -1e30, 1e30] {
        assert!(bilinear.sample(Vec2::new(nonsense, 0.3), &lambda).is_finite(), "{nonsense}");
        assert!(nearest.sample(Vec2::new(0.3, nonsense), &lambda).is_finite(), "{nonsense}");
    }
}

/// Greys are exact, and other colours are near the fit to them alone; nothing reflects more than it gets.
#[test]
fn colors_of_textures_are_those_of_rgb() {
    let lambda = SampledWavelengths::sample(0.7);
    let mut random = pointillist::math::random::Random(5);
    let (mut sum, n) = (0.0, 2000);
    for i in 0..n {
        let power = [1.0, 2.2, 4.0][i % 3];
        let rgb = [0; 3].map(|_| random.f64().powf(power) as f32);
        let found = Spectrum::textured_rgb(rgb, &lambda).0;
        assert!(found.min_element() >= 0.0 && found.max_element() <= 1.0, "{rgb:?}: {found}");
        sum += (found - Spectrum::reflectance_rgb(rgb).sample(&lambda).0).abs().max_element() / n as f32;
    }
    assert!(sum < 3e-3, "mean difference {sum}");
    for grey in [0.0, 0.002, 0.5, 1.0] {
        assert_eq!(Spectrum::textured_rgb([grey; 3], &lambda).0, glam::Vec4::splat(grey));
    }
}
