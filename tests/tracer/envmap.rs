//! Environment maps: samples follow their density, and every emitting part can be sampled.

use std::f32::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3, Vec3};

use crate::support::scenes::*;
use pointillist::scene::desc::*;
use pointillist::scene::edit::{Edits, NewValue, Target};
use pointillist::scene::load_str;
use pointillist::spectrum::{EmissionMap, SampledWavelengths, Spectrum};
use pointillist::tracer::light::{
    DirectionSampling, EnvironmentMap, LightSampleContext, LightSource, Lights,
};
use pointillist::tracer::sampler::LightNumbers;

/// A turn about no axis of the map.
fn askew() -> DMat3 {
    DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(-1.1) * DMat3::from_rotation_z(2.3)
}

fn grey_map(width: usize, values: &[f32]) -> Arc<EmissionMap> {
    let rgb: Vec<[f32; 3]> = values.iter().map(|v| [*v; 3]).collect();
    Arc::new(EmissionMap::new(width, &rgb).expect("radiance"))
}

/// `size` texels of `sky`, the one at `at` of 10⁴.
fn sun(size: [usize; 2], at: [usize; 2], sky: f32) -> Arc<EmissionMap> {
    let [width, height] = size;
    let mut values = vec![sky; width * height];
    values[at[1] * width + at[0]] = 1e4;
    grey_map(width, &values)
}

/// Maps of all kinds: plain, uneven, with a sun at the seam, a pole, in the dark; of one, two and a few texels.
fn maps() -> Vec<(&'static str, Arc<EmissionMap>)> {
    let mut random = Random(7);
    let uneven: Vec<f32> = (0..9 * 6).map(|i| if i % 5 == 0 { 0.0 } else { random.f64() as f32 }).collect();
    vec![
        ("one texel", grey_map(1, &[2.0])),
        ("one column", grey_map(1, &[1.0, 0.0, 3.0])),
        ("one row", grey_map(3, &[1.0, 0.0, 3.0])),
        ("uneven", grey_map(9, &uneven)),
        ("sun", sun([16, 9], [5, 3], 1.0)),
        ("sun in the dark", sun([16, 9], [11, 6], 0.0)),
        ("sun at the left edge", sun([16, 9], [0, 4], 0.0)),
        ("sun at the right edge", sun([16, 9], [15, 4], 0.1)),
        ("sun at the upper pole", sun([7, 5], [2, 0], 0.0)),
        ("sun at the lower pole", sun([7, 5], [6, 4], 0.0)),
    ]
}

const BINS: (usize, usize) = (24, 12);
/// Points per side of a bin where its density is integrated.
const STEPS: usize = 48;

/// The direction at these shares of longitude and of height.
fn direction(u: f32, v: f32) -> Vec3 {
    let (sin, cos) = (TAU * u).sin_cos();
    let z = 1.0 - 2.0 * v;
    let r = (1.0 - z * z).sqrt();
    Vec3::new(r * cos, r * sin, z)
}

fn bin(d: Vec3) -> usize {
    let share = |v: f32, n: usize| ((v * n as f32) as usize).min(n - 1);
    let u = d.y.atan2(d.x) / TAU;
    share((0.5 - 0.5 * d.z).clamp(0.0, 1.0), BINS.1) * BINS.0 + share(u - u.floor(), BINS.0)
}

/// Calls `visit` at the middles of a fine grid over the sphere; each stands for the solid angle returned.
fn over_the_sphere(mut visit: impl FnMut(Vec3)) -> f64 {
    let (nu, nv) = (BINS.0 * STEPS, BINS.1 * STEPS);
    for v in 0..nv {
        for u in 0..nu {
            visit(direction((u as f32 + 0.5) / nu as f32, (v as f32 + 0.5) / nv as f32));
        }
    }
    4.0 * std::f64::consts::PI / (nu * nv) as f64
}

#[test]
fn the_density_is_that_of_what_is_sampled() {
    for (what, map) in maps() {
        let light = EnvironmentMap::new(map, askew());
        let mut expected = vec![0.0; BINS.0 * BINS.1];
        let step = over_the_sphere(|d| expected[bin(d)] += f64::from(light.pdf_direction(d).0));
        expected.iter_mut().for_each(|v| *v *= step);
        let total: f64 = expected.iter().sum();
        assert!((total - 1.0).abs() < 5e-3, "{what}: the density integrates to {total}");
        let n = 100_000;
        let mut counts = vec![0.0; expected.len()];
        let mut random = Random(11);
        for _ in 0..n {
            let u = [random.f32(), random.f32()];
            let (wi, pdf) = light.sample_direction(u).expect("it shines");
            assert!(pdf == light.pdf_direction(wi) && pdf.0 > 0.0 && pdf.0.is_finite(), "{what}: {pdf:?}");
            assert!((wi.length() - 1.0).abs() < 1e-6);
            counts[bin(wi)] += 1.0;
        }
        // Bins where little is expected count as one.
        let (mut chi2, mut bins, mut rest) = (0.0, 0, (0.0, 0.0));
        for (e, c) in expected.iter().zip(&counts) {
            let e = e / total * f64::from(n);
            if e < 10.0 {
                rest = (rest.0 + e, rest.1 + c);
            } else {
                (chi2, bins) = (chi2 + (c - e).powi(2) / e, bins + 1);
            }
        }
        if rest.0 >= 5.0 {
            (chi2, bins) = (chi2 + (rest.1 - rest.0).powi(2) / rest.0, bins + 1);
        } else {
            assert!(rest.1 < 25.0, "{what}: {} samples where {} are expected", rest.1, rest.0);
        }
        let freedom = f64::from(bins - 1);
        let limit = freedom + 4.0 * (2.0 * freedom).sqrt() + 4.0;
        assert!(chi2 < limit, "{what}: χ² = {chi2:.0} at {freedom} degrees of freedom");
    }
}

/// Between nodes radiance falls to zero over a whole cell: all of it can be sampled.
#[test]
fn what_shines_is_never_missed_and_what_is_dark_never_chosen() {
    let lambda = SampledWavelengths::sample(0.4);
    for (what, map) in maps() {
        let light = EnvironmentMap::new(map, askew());
        let (mut lit, mut dark) = (0, 0);
        over_the_sphere(|d| {
            let (radiance, pdf) = (light.radiance(d, &lambda).0, light.pdf_direction(d).0);
            assert!(radiance.is_finite() && pdf.is_finite() && pdf >= 0.0, "{what}: {radiance} {pdf}");
            assert!(radiance.max_element() == 0.0 || pdf > 0.0, "{what}: {d} shines and cannot be chosen");
            lit += u32::from(radiance.max_element() > 0.0);
            dark += u32::from(pdf == 0.0);
        });
        assert!(lit > 0 && (dark > 0 || !what.contains("dark")), "{what}: {lit} lit, {dark} dark");
    }
}

/// The mean of radiance over density is the integral of radiance, with little noise: luminance is what is sampled.
#[test]
fn estimates_have_the_right_mean_and_little_noise() {
    let lambda = SampledWavelengths::sample(0.4);
    for (what, map) in maps() {
        let light = EnvironmentMap::new(map, askew());
        let radiance = |d| f64::from(light.radiance(d, &lambda).0.x);
        let mut sum = 0.0;
        let exact = over_the_sphere(|d| sum += radiance(d)) * sum;
        let (n, mut random) = (50_000, Random(5));
        let (mut total, mut square) = (0.0, 0.0);
        for _ in 0..n {
            let (wi, pdf) = light.sample_direction([random.f32(), random.f32()]).expect("it shines");
            let v = radiance(wi) / f64::from(pdf.0);
            (total, square) = (total + v, square + v * v);
        }
        let mean = total / f64::from(n);
        let spread = (square / f64::from(n) - mean * mean).max(0.0).sqrt();
        let off = (mean - exact).abs();
        assert!(off < 4.0 * spread / f64::from(n).sqrt() + 3e-3 * exact, "{what}: {mean}, not {exact}");
        assert!(spread < 0.6 * exact, "{what}: a single sample is off by {}", spread / exact);
        // How bright the light is thought to be when one is chosen; Y of the constant factor 1 under D65.
        let luminance = exact / (4.0 * std::f64::consts::PI);
        let d65 = f64::from(Spectrum::D65(1.0).sample(&lambda).0.x);
        assert!((f64::from(light.mean_luminance()) / (luminance / d65) - 1.0).abs() < 1e-2, "{what}");
    }
}

/// Next-event estimation samples what is brighter than the mean, with a density whose integral is 1, and nothing else.
#[test]
fn next_event_estimation_samples_what_exceeds_the_mean() {
    let mut random = Random(8);
    let mut uneven = 0;
    for (what, map) in maps() {
        let light = EnvironmentMap::new(map, askew());
        if light.excess() == 0.0 {
            assert!(light.sample_excess([0.3, 0.6]).is_none(), "{what}: even, and sampled");
            continue;
        }
        uneven += 1;
        let mut sum = 0.0;
        let step = over_the_sphere(|d| sum += f64::from(light.pdf_excess(d).0));
        assert!((sum * step - 1.0).abs() < 2e-2, "{what}: the integral is {}", sum * step);
        for _ in 0..1000 {
            let u = [random.f32(), random.f32()];
            let Some((wi, pdf)) = light.sample_excess(u) else { panic!("{what}: it has an excess") };
            assert!(pdf == light.pdf_excess(wi) && pdf.0 > 0.0 && pdf.0.is_finite(), "{what}: {pdf:?}");
        }
    }
    assert!(uneven > 0);
}

/// As Mitsuba 3.9.1: +y is up; the middle of the picture lies along +z, a quarter from the left along +x.
#[test]
fn orientation() {
    let lambda = SampledWavelengths::sample(0.5);
    let (width, height) = (8, 5);
    let values: Vec<f32> = (0..width * height).map(|i| 1.0 + i as f32).collect();
    let map = grey_map(width, &values);
    let light = EnvironmentMap::new(map.clone(), DMat3::IDENTITY);
    let d65 = Spectrum::D65(1.0).sample(&lambda).0.x;
    let seen = |light: &EnvironmentMap, d: Vec3| light.radiance(d, &lambda).0.x / d65;
    let row = |y: usize, x: f32| 1.0 + (y * width) as f32 + x;
    let close = |a: f32, b: f32| assert!((a - b).abs() < 1e-3, "{a} instead of {b}");
    close(seen(&light, Vec3::Z), row(2, 3.5));
    close(seen(&light, Vec3::X), row(2, 1.5));
    close(seen(&light, Vec3::NEG_X), row(2, 5.5));
    // Behind, the last column meets the first.
    close(seen(&light, Vec3::NEG_Z), row(2, 3.5));
    close(seen(&light, Vec3::new(1e-4, 0.0, -1.0).normalize()), row(2, 3.5));
    close(seen(&light, Vec3::new(0.0, 1.0, 1.0).normalize()), row(1, 3.5));
    close(seen(&light, Vec3::new(0.0, -1.0, 1.0).normalize()), row(3, 3.5));
    for (pole, y) in [(Vec3::Y, 0), (Vec3::NEG_Y, 4)] {
        assert!((row(y, 0.0)..=row(y, 7.0)).contains(&seen(&light, pole)));
    }
    // What `to_world` takes +z to is what shows the middle.
    let turned = EnvironmentMap::new(map, askew());
    close(seen(&turned, (askew() * DVec3::Z).as_vec3()), row(2, 3.5));
    close(seen(&turned, (askew() * DVec3::new(0.0, 1.0, 1.0).normalize()).as_vec3()), row(1, 3.5));
}

fn map_light(map: Arc<EmissionMap>) -> LightDesc {
    let to_world = DAffine3::from_mat3(askew());
    LightDesc::Map { map, scale: Spectrum::Constant(0.5), to_world, place: Place::default() }
}

/// A white floor that faces the camera, under a map; what it reflects is known by integration.
#[test]
fn a_floor_is_lit_as_the_integral_says() {
    for (what, map) in maps() {
        let mut desc = empty();
        desc.integrator.max_depth = Some(2);
        let white = material(&mut desc, grey(0.8));
        let facing = DAffine3::from_translation(DVec3::Z) * DAffine3::from_rotation_x(std::f64::consts::PI);
        shape(&mut desc, ShapeKind::Rectangle, facing, white, 0.0);
        desc.lights.push(map_light(map.clone()));
        let light = EnvironmentMap::new(map, askew());
        // Greys: luminance is the value at any wavelength over that of D65.
        let lambda = SampledWavelengths::sample(0.4);
        let d65 = Spectrum::D65(1.0).sample(&lambda).0.x;
        let mut sum = 0.0;
        let step = over_the_sphere(|d| {
            sum += f64::from(light.radiance(d, &lambda).0.x / d65 * (-d.z).max(0.0));
        });
        let expected = 0.5 * 0.8 * sum * step / f64::from(PI);
        let (found, error) = mean(&desc, 1 << 16);
        let off = (found - expected).abs();
        assert!(off <= 4.0 * error + 4e-3 * expected, "{what}: {found} ± {error} instead of {expected}");
        assert!(error < 0.02 * expected + 1e-6, "{what}: noise {}", error / expected);
    }
}

/// Seen directly, without anything in between: the map itself, times its scale; twice as bright after an edit.
#[test]
fn the_background_is_the_map() {
    let mut desc = empty();
    desc.lights.push(map_light(grey_map(1, &[3.0])));
    let scene = prepare(&desc);
    assert!(scene.notices().is_empty(), "{:?}", scene.notices());
    assert_mean(&desc, 1.5, 1e-2, "3 times one half");
    let edits = Edits { camera: None, values: vec![(Target::Light(0), NewValue::Scale(2.0))] };
    let brighter = edits.apply(&desc).expect("a light");
    assert_mean(&brighter, 3.0, 1e-2, "twice that");
    let lambda = SampledWavelengths::sample(0.2);
    let see = |s: &pointillist::tracer::Scene| s.lights().spectrum(0, Vec3::ZERO, Vec3::X, &lambda).0;
    assert_eq!(see(&scene.edited(&brighter).expect("valid")), see(&scene) * 2.0);
    // Another map is another scene, even if nothing else differs.
    desc.lights[0] = map_light(grey_map(1, &[12.0]));
    let other = scene.edited(&desc).expect("valid");
    assert!((see(&other) / see(&scene) - 4.0).abs().max_element() < 1e-5);
}

#[test]
fn a_black_map_is_night() {
    let light = EnvironmentMap::new(grey_map(4, &[0.0; 12]), askew());
    assert!(light.sample_direction([0.3, 0.6]).is_none() && light.is_black());
    assert_eq!(light.pdf_direction(Vec3::X).0, 0.0);
    let mut desc = empty();
    let white = material(&mut desc, grey(0.8));
    shape(&mut desc, sphere(DVec3::Z * 3.0, 1.0), DAffine3::IDENTITY, white, 0.0);
    desc.lights.push(map_light(grey_map(4, &[0.0; 12])));
    assert!(prepare(&desc).notices().iter().any(|n| n.contains("black")));
    assert_eq!(mean(&desc, 1000), (0.0, 0.0));
}

/// Both kinds of environment, sampled without a reference point: density and directions agree, and only one is used.
#[test]
fn directions_that_do_not_depend_on_the_point() {
    let mut desc = empty();
    environment(&mut desc);
    desc.lights.push(map_light(grey_map(2, &[1.0, 2.0, 3.0, 4.0])));
    let scene = prepare(&desc);
    assert!(scene.notices().iter().any(|n| n.contains("one environment")), "{:?}", scene.notices());
    assert_eq!((scene.lights().len(), scene.lights().environment()), (1, Some(0)));
    desc.lights.remove(0);
    let mapped = prepare(&desc);
    for lights in [scene.lights(), mapped.lights()] {
        let numbers = LightNumbers { place: [0.5; 2], direction: [0.3, 0.6], choice: 0.5, aim: 0.5 };
        let emission = lights.emit(&numbers).expect("it shines");
        assert_eq!(lights.emission_pdf(0, Vec3::ZERO, emission.direction), emission.pdf);
        let wi = -emission.direction;
        let lit = LightSampleContext { p: Vec3::ZERO, n: wi, through: false, glossy: false };
        let Some((light, sample)) = lights.sample(lit, 0.5, [0.3, 0.6]) else {
            // The constant one is left to scattering.
            assert!(!lights.varies(0) && lights.probability(0, lit) == 0.0);
            continue;
        };
        assert!(light == 0 && sample.target.is_none() && !sample.delta);
        let again = lights.pdf(0, lit, sample.wi, None);
        assert!((again.0 / sample.pdf.0 - 1.0).abs() < 1e-5, "{again:?} {:?}", sample.pdf);
    }
}

/// Linear Rec.709 of the first light of `text`, seen in direction `d`.
fn seen(lights: &Lights, d: DVec3) -> [f64; 3] {
    let n = 500;
    let mut xyz = DVec3::ZERO;
    for i in 0..n {
        let lambda = SampledWavelengths::sample((i as f32 + 0.5) / n as f32);
        let value = lambda.to_xyz(lights.spectrum(0, Vec3::ZERO, d.normalize().as_vec3(), &lambda));
        xyz += DVec3::new(value.x.into(), value.y.into(), value.z.into()) / f64::from(n);
    }
    let rows =
        [[3.240_45, -1.537_14, -0.498_53], [-0.969_27, 1.876_01, 0.041_56], [0.055_64, -0.204_03, 1.057_23]];
    rows.map(|row| DVec3::from_array(row).dot(xyz))
}

fn daylight(params: &str) -> pointillist::tracer::Scene {
    let text = format!(
        "<scene version=\"3.0.0\"><emitter type=\"sunsky\">{params}</emitter><sensor type=\"perspective\"/></scene>"
    );
    prepare(&load_str("sky.xml", &text, &[]).expect("valid").desc)
}

/// The sky in directions of all kinds: what Mitsuba 3.9.1 shows in spectral mode, at two turbidities, elevations and albedos.
#[test]
fn the_sky_is_that_of_the_model() {
    let clear = "<vector name=\"sun_direction\" value=\"0, 3, 4\"/><float name=\"sun_scale\" value=\"0\"/>";
    let hazy = "<vector name=\"sun_direction\" value=\"-0.8, 0.3, 0.2\"/><float name=\"sun_scale\" value=\"0\"/>\
                <float name=\"turbidity\" value=\"6.5\"/><float name=\"albedo\" value=\"0.1\"/>";
    let [clear, hazy] = [clear, hazy].map(daylight);
    for (scene, d, expected) in [
        (&clear, [0.0, 0.0, 1.0], [0.029_89, 0.047_88, 0.092_69]),
        (&clear, [0.5, 0.5, 0.3], [0.074_60, 0.114_42, 0.186_46]),
        (&clear, [-0.3, 0.9, 0.05], [0.191_26, 0.246_50, 0.297_55]),
        (&clear, [0.0, 0.55, 0.83], [0.148_69, 0.171_04, 0.201_73]),
        (&clear, [0.9, -0.1, 0.02], [0.144_52, 0.179_21, 0.204_27]),
        (&hazy, [0.0, 0.0, 1.0], [0.016_07, 0.023_91, 0.035_78]),
        (&hazy, [0.5, 0.5, 0.3], [0.041_55, 0.055_38, 0.069_19]),
        (&hazy, [-0.3, 0.9, 0.05], [0.164_61, 0.139_46, 0.094_79]),
        (&hazy, [0.0, 0.55, 0.83], [0.023_73, 0.032_97, 0.045_12]),
        (&hazy, [0.9, -0.1, 0.02], [0.079_53, 0.079_47, 0.067_26]),
    ] {
        let found = seen(scene.lights(), DVec3::from_array(d));
        let most = expected.iter().fold(0.0f64, |a, b| a.max(*b));
        let off = (0..3).map(|i| (found[i] - expected[i]).abs() / most).fold(0.0, f64::max);
        println!("{d:?}: {found:?}, off by {off:.4}");
        assert!(off < 0.01, "{d:?}: {found:?} instead of {expected:?}");
    }
    assert_eq!(seen(clear.lights(), DVec3::new(0.1, 0.1, -0.1)), [0.0; 3]);
}

/// The sun, in its disc and beside it: what Mitsuba 3.9.1 shows in spectral mode, also of another size.
#[test]
fn the_sun_is_that_of_the_model() {
    for (turbidity, elevation, expected) in [
        (2, 10.0, [14_971.5, 8_983.5, 3_269.2]),
        (2, 80.0, [21_368.9, 17_698.1, 13_837.7]),
        (3, 25.0, [18_599.6, 13_928.8, 8_695.1]),
        (3, 45.0, [20_284.2, 16_287.6, 11_915.9]),
        (6, 10.0, [8_983.2, 5_173.4, 1_939.6]),
        (6, 25.0, [15_650.4, 11_530.6, 7_259.0]),
    ] {
        let (z, x) = f64::to_radians(elevation).sin_cos();
        let direction = DVec3::new(x, 0.0, z);
        for (aperture, shrunk) in [(0.5358f64, 1.0), (2.0, 0.071_77)] {
            let scene = daylight(&format!(
                "<vector name=\"sun_direction\" value=\"{x}, 0, {z}\"/><float name=\"sky_scale\" value=\"0\"/>\
                 <float name=\"turbidity\" value=\"{turbidity}\"/><float name=\"sun_aperture\" value=\"{aperture}\"/>",
            ));
            let found = seen(scene.lights(), direction);
            let off = (0..3).map(|i| (found[i] / shrunk / expected[i] - 1.0).abs()).fold(0.0, f64::max);
            println!("turbidity {turbidity}, {elevation}°: {found:?}, off by {off:.4}");
            assert!(off < 0.015, "{turbidity} {elevation}: {found:?} instead of {expected:?} × {shrunk}");
            let beside =
                |turn: f64| seen(scene.lights(), DMat3::from_rotation_z(turn.to_radians()) * direction)[1];
            let half = (0.5 * aperture).to_radians().sin() / x;
            assert!(
                beside(0.98 * half.asin().to_degrees()) > 0.0
                    && beside(1.02 * half.asin().to_degrees()) == 0.0
            );
        }
    }
}

/// By place and time, as Mitsuba 3.9.1 tells the sun's direction.
#[test]
fn where_the_sun_stands() {
    let value = |pairs: &str| {
        let one = |pair: &str| {
            let (name, value) = pair.split_once('=').expect("a pair");
            format!("<float name=\"{name}\" value=\"{value}\"/>")
        };
        let params: String = pairs.split_whitespace().map(one).collect();
        let text = format!(
            "<scene version=\"3.0.0\"><emitter type=\"sunsky\">{params}</emitter><sensor type=\"perspective\"/></scene>"
        );
        let desc = load_str("sky.xml", &text, &[]).expect("valid").desc;
        let LightDesc::SunSky(sky) = &desc.lights[0] else { panic!("a sky") };
        sky.sun_direction
    };
    for (pairs, expected) in [
        ("", [0.051_385_4, 0.691_748, 0.720_308]),
        ("hour=9.5 month=3 latitude=50 longitude=10 timezone=1", [0.585_769, -0.706_396, 0.397_34]),
        (
            "year=2024 month=12 day=24 hour=12 minute=30 second=15 latitude=-33 longitude=151 timezone=10",
            [-0.160_88, 0.138_413, 0.977_22],
        ),
    ] {
        let found = value(pairs);
        assert!((found - DVec3::from_array(expected)).length() < 2e-3, "{pairs}: {found}");
    }
}
