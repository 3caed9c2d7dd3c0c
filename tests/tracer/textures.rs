//! Textures: the coordinates of every shape, lookups, and what a scene without them keeps.
//!
//! Expected numbers are those of Mitsuba 3.9.1 (`scalar_rgb`) for the same shapes, rays and texels.

use glam::{Affine2, Vec2, Vec3, Vec3A, Vec4};
use pointillist::image::bitmap::Bitmap;
use pointillist::scene::desc::texture::{
    BitmapTexture, Checkerboard, SpectrumTexture, TexturePoint, WrapMode,
};
use pointillist::scene::{self, SceneDesc};
use pointillist::spectrum::{SampledWavelengths, Spectrum};
use pointillist::tracer::Scene;
use pointillist::tracer::accel::Ray;
use std::sync::Arc;

use crate::support::scenes::in_world_space;

fn desc(shape: &str) -> SceneDesc {
    let board = "<bsdf type=\"twosided\"><bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"checkerboard\"/></bsdf></bsdf>";
    let text = format!(
        "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><emitter type=\"constant\"/>\
         <shape type=\"{shape}\">{board}</shape></scene>"
    );
    in_world_space(scene::load_str("test.xml", &text, &[]).expect("a valid scene").desc)
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
        let uv = scene.surface_material(&hit).context.texture.uv;
        let off = (uv - Vec2::from(expected)).abs().max_element();
        assert!(off < 2e-6, "{shape} from {from:?}: {uv} and not {expected:?}");
    }
}

/// (u, v) of the point that a ray of this direction from this origin meets first.
fn met(shape: &str, origin: [f32; 3], direction: Vec3) -> TexturePoint {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/plugins/test.xml");
    let text = format!(
        "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><emitter type=\"constant\"/>{shape}</scene>"
    );
    let desc = in_world_space(scene::load_str(folder, &text, &[]).unwrap_or_else(|e| panic!("{e:?}")).desc);
    let scene = Scene::prepare(&desc).expect("a scene");
    let hit = scene.closest(&Ray::new(origin.into(), direction)).expect("the shape is met");
    scene.surface_material(&hit).context.texture
}

const BOARD: &str = "<bsdf type=\"twosided\"><bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"checkerboard\"/></bsdf></bsdf>";

#[test]
fn coordinates_of_cylinders_are_those_of_mitsuba() {
    let place = "<point name=\"p0\" x=\"1\" y=\"0\" z=\"0\"/><point name=\"p1\" x=\"1\" y=\"2\" z=\"1\"/><float name=\"radius\" value=\".5\"/>";
    let turned = "<boolean name=\"flip_normals\" value=\"true\"/><transform name=\"to_world\"><scale y=\"2\"/>\
                  <rotate x=\"1\" angle=\"-70\"/></transform>";
    for (more, from, direction, expected) in [
        ("", [5.0, 0.2, 0.3], -Vec3::X, [0.032_047_1, 0.3]),
        ("", [-5.0, 0.2, 0.7], Vec3::X, [0.467_953, 0.7]),
        ("", [0.3, 5.0, 0.25], -Vec3::Y, [0.201_507, 0.25]),
        ("", [0.3, -5.0, 0.9], Vec3::Y, [0.798_493, 0.9]),
        (place, [-5.0, 0.5, 0.3], Vec3::X, [0.514_254, 0.26]),
        (place, [1.0, 1.0, 5.0], -Vec3::Z, [0.75, 0.611_803]),
        (turned, [5.0, 0.2, 0.3], -Vec3::X, [0.982_978, 0.290_545]),
        (turned, [-5.0, 0.3, 0.7], Vec3::X, [0.544_768, 0.521_322]),
    ] {
        let uv = met(&format!("<shape type=\"cylinder\">{more}{BOARD}</shape>"), from, direction).uv;
        let off = (uv - Vec2::from(expected)).abs().max_element();
        assert!(off < 3e-6, "{more} from {from:?}: {uv} and not {expected:?}");
    }
}

/// `obj` turns v upside down unless told otherwise, `ply` does not.
#[test]
fn coordinates_of_meshes_are_those_of_mitsuba() {
    for (kind, more, [x, y], expected) in [
        ("ply", "", [-0.5, -0.25], [0.25, 0.375]),
        ("ply", "<boolean name=\"flip_tex_coords\" value=\"true\"/>", [-0.5, -0.25], [0.25, 0.625]),
        ("obj", "", [-0.5, -0.25], [0.25, 0.625]),
        ("obj", "", [0.3, 0.6], [0.65, 0.2]),
        ("obj", "<boolean name=\"flip_tex_coords\" value=\"false\"/>", [0.3, 0.6], [0.65, 0.8]),
    ] {
        let shape = format!(
            "<shape type=\"{kind}\"><string name=\"filename\" value=\"patch.{kind}\"/>{more}{BOARD}</shape>"
        );
        let uv = met(&shape, [x, y, 5.0], -Vec3::Z).uv;
        assert!((uv - Vec2::from(expected)).abs().max_element() < 2e-6, "{shape}: {uv} and not {expected:?}");
    }
}

/// Barycentric means at vertices, one value on a face: by hand, and as Mitsuba has them.
#[test]
fn mesh_attributes_are_interpolated() {
    let patch = |more: &str, material: &str| {
        format!(
            "<shape type=\"ply\"><string name=\"filename\" value=\"patch.ply\"/>{more}<bsdf type=\"twosided\">{material}</bsdf></shape>"
        )
    };
    let texture = |name: &str, attribute: &str| {
        format!(
            "<texture name=\"{name}\" type=\"mesh_attribute\"><string name=\"name\" value=\"{attribute}\"/></texture>"
        )
    };
    let of = |color: &str, number: &str| {
        format!(
            "<bsdf type=\"principled\">{}{}</bsdf>",
            texture("base_color", color),
            texture("roughness", number)
        )
    };
    let at = |shape: &str, [x, y]: [f32; 2]| {
        // Both ends of the range are used; which is whose, the order of reading decides.
        let mut values = met(shape, [x, y, 5.0], -Vec3::Z).attributes;
        values.sort_by(f32::total_cmp);
        values
    };
    for ([x, y], vertices, faces) in [
        ([-0.5, -0.25], [0.725, 0.575, 0.7, 0.15], [0.3, 0.6, 0.3, 0.9]),
        ([0.3, 0.6], [0.555, 0.525, 0.495, 0.18], [0.8, 0.6, 0.5, 0.7]),
        ([0.7, -0.9], [0.39, 0.63, 0.24, 0.43], [0.25, 0.35, 0.7, 0.4]),
    ] {
        for (material, mut expected) in [
            (of("vertex_color", "vertex_rough"), vertices),
            (of("face_color", "face_shine"), faces),
            (of("face_color", "vertex_rough"), [faces[0], faces[1], faces[2], vertices[3]]),
        ] {
            expected.sort_by(f32::total_cmp);
            for more in ["", "<boolean name=\"flip_normals\" value=\"true\"/>"] {
                let found = at(&patch(more, &material), [x, y]);
                let off = |(a, b): (&f32, &f32)| (a - b).abs() < 2e-6;
                assert!(
                    found.iter().zip(&expected).all(off),
                    "{material} {more}: {found:?} and not {expected:?}"
                );
            }
        }
    }
    // By hand: vertices 0, 1 and 4 with weights ½, ¼ and ¼ at x = −½, y = −¾.
    let expected = [0.5 * 0.8 + 0.25 * 0.7 + 0.25 * 0.9, 0.5 * 0.2 + 0.25 * 0.6 + 0.25 * 0.9];
    let found = at(&patch("", &of("vertex_color", "vertex_rough")), [-0.5, -0.75]);
    assert!(
        expected.iter().all(|v: &f32| found.iter().any(|f| (f - v).abs() < 2e-6)),
        "{found:?} has not {expected:?}"
    );
    // A surface without them has zeros, and instances have them.
    let group = format!(
        "<shape type=\"shapegroup\" id=\"g\">{}</shape><shape type=\"instance\"><ref id=\"g\"/>\
         <transform name=\"to_world\"><translate x=\"3\"/></transform></shape>",
        patch("", &of("vertex_color", "vertex_rough"))
    );
    assert_eq!(at(&group, [2.5, -0.75]), found);
    assert_eq!(at(&patch("", "<bsdf type=\"diffuse\"/>"), [-0.5, -0.75]), [0.0; 4]);
}

/// Numbers of Mitsuba's `eval_1`.
#[test]
fn numbers_of_textures_are_those_of_mitsuba() {
    for (file, raw, nearest, expected) in [
        ("ramp.png", false, false, [0.191_103, 0.698_514]),
        ("ramp.png", false, true, [0.174_647, 0.730_461]),
        ("ramp.png", true, false, [0.472_314, 0.850_980]),
        ("ramp.png", true, true, [0.454_902, 0.870_588]),
        ("letter.png", true, false, [0.841_572, 0.841_572]),
        ("letter.png", false, false, [0.679_049, 0.679_049]),
        ("letter_rgba.png", true, false, [0.841_572, 0.841_572]),
    ] {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/plugins").join(file);
        let bytes = std::fs::read(&path).expect("it is there");
        let bitmap = Arc::new(Bitmap::decode(&path, &bytes, raw, 64).expect("a picture"));
        let texture = BitmapTexture::new(bitmap, Affine2::IDENTITY, WrapMode::Repeat, nearest);
        let texture = SpectrumTexture::Bitmap(texture);
        for (uv, expected) in [[0.335, 0.805], [0.9, 0.05]].into_iter().zip(expected) {
            let found = texture.scalar(&Vec2::from(uv).into());
            // Weights of luminance are rounded differently.
            assert!(
                (found - expected).abs() < 5e-5,
                "{file} {raw} {nearest} {uv:?}: {found} and not {expected}"
            );
        }
    }
    let constant = SpectrumTexture::from(Spectrum::Constant(1.7));
    assert_eq!((constant.scalar(&TexturePoint::default()), constant.mean_scalar()), (1.7, 1.7));
    let bright = Bitmap::from_linear(1, vec![[3.0; 3], [f32::NAN; 3], [-1.0; 3], [0.5; 3]]);
    let bright = BitmapTexture::new(Arc::new(bright), Affine2::IDENTITY, WrapMode::Repeat, true);
    let bright = SpectrumTexture::Bitmap(bright);
    let values = [0.1, 0.3, 0.6, 0.9].map(|v| bright.scalar(&Vec2::new(0.5, v).into()));
    assert_eq!(values, [3.0, 0.0, 0.0, 0.5]);
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
        let (found, expected) = (
            texture.sample(&Vec2::new(u, v).into(), &lambda),
            Spectrum::reflectance_rgb(rgb).sample(&lambda),
        );
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
    let greys = Arc::new(Bitmap::from_linear(2, vec![[0.2; 3], [0.9; 3]]));
    let greys =
        SpectrumTexture::Bitmap(BitmapTexture::new(greys, Affine2::IDENTITY, WrapMode::Repeat, false));
    for nonsense in [f32::NAN, f32::INFINITY, -1e30, 1e30, -1e20, 3e18] {
        for (texture, uv) in [
            (&bilinear, Vec2::new(nonsense, 0.3)),
            (&nearest, Vec2::new(0.3, nonsense)),
            (&greys, Vec2::new(nonsense, 0.3)),
        ] {
            let found = texture.sample(&uv.into(), &lambda).0;
            assert!(found.cmpge(Vec4::ZERO).all() && found.cmple(Vec4::ONE).all(), "{nonsense}: {found}");
        }
    }
}

/// One number for a colour: values of Mitsuba's `eval_1`, whose luminance has other last digits.
#[test]
fn numbers_are_those_of_mitsuba() {
    let is = |texture: &SpectrumTexture, [u, v]: [f32; 2], expected: f32| {
        let found = texture.scalar(&Vec2::new(u, v).into());
        assert!((found - expected).abs() < 1e-4, "({u}, {v}) is {found} and not {expected}");
    };
    let nearest = bitmap(WrapMode::Repeat, true);
    let [red, green, blue] = [0.212_671, 0.715_16, 0.072_169];
    for (uv, expected) in [([0.1, 0.2], red), ([0.5, 0.2], green), ([0.9, 0.2], blue), ([0.5, 0.8], 0.5)] {
        is(&nearest, uv, expected);
    }
    is(&bitmap(WrapMode::Repeat, false), [0.3, 0.4], 0.439_566_6);
    let grey = Arc::new(Bitmap::from_linear(1, vec![[0.3; 3]]));
    let grey = SpectrumTexture::Bitmap(BitmapTexture::new(grey, Affine2::IDENTITY, WrapMode::Clamp, false));
    assert_eq!(grey.scalar(&Vec2::new(0.4, 7.0).into()), grey.mean().reflected_rgb()[0], "a grey is exact");
    let [color0, color1] = [0.9, 0.1].map(|v| Spectrum::Constant(v).into());
    let board = Checkerboard { color0, color1, to_uv: Affine2::IDENTITY };
    let board = SpectrumTexture::Checkerboard(Arc::new(board));
    for (uv, expected) in [([0.2, 0.2], 0.1), ([0.7, 0.2], 0.9), ([0.2, 0.7], 0.9), ([0.7, 0.7], 0.1)] {
        is(&board, uv, expected);
    }
    is(&Spectrum::Constant(0.7).into(), [0.0, 0.0], 0.7);
    is(&Spectrum::reflectance_rgb([1.0, 0.0, 0.0]).into(), [0.0, 0.0], red);
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
        let found = Spectrum::textured_rgb(rgb.into(), &lambda).0;
        assert!(found.min_element() >= 0.0 && found.max_element() <= 1.0, "{rgb:?}: {found}");
        sum += (found - Spectrum::reflectance_rgb(rgb).sample(&lambda).0).abs().max_element() / n as f32;
    }
    assert!(sum < 3e-3, "mean difference {sum}");
    for grey in [0.0, 0.002, 0.5, 1.0] {
        assert_eq!(Spectrum::textured_rgb(Vec3A::splat(grey), &lambda).0, glam::Vec4::splat(grey));
    }
}
