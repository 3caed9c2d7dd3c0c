//! Media on grids, phase functions that are peaks, and extinction that depends on the wavelength.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3, Vec3};

use pointillist::color::{Xyz, cie};
use pointillist::scene::desc::texture::{SpectrumTexture, WrapMode};
use pointillist::scene::desc::volume::{VolumeGrid, VolumeTexture};
use pointillist::scene::desc::*;
use pointillist::spectrum::{SampledSpectrum, SampledWavelengths, Spectrum};
use pointillist::stream::SampleSink;
use pointillist::tracer::Integrator;
use pointillist::tracer::bsdf::ScatteringModel;
use pointillist::tracer::medium::PhaseFunction;

use crate::Row;
use crate::media::{DISTANCE, METHODS, PLAN, STANDARD_ERRORS, apart, cube, found, largest_distance};
use crate::support::agreement::{Method, Plan};
use crate::support::scenes::*;
use crate::support::welch;

/// A grid that fills the unit cube of `to_world`.
pub(crate) fn grid(size: [usize; 3], values: Vec<f32>, to_world: DAffine3) -> SpectrumTexture {
    let grid = Arc::new(VolumeGrid::new(size, 1, values));
    SpectrumTexture::Volume(Arc::new(VolumeTexture::new(grid, to_world.inverse(), WrapMode::Clamp, false)))
}

fn grid_medium(desc: &mut SceneDesc, sigma_t: SpectrumTexture, scale: f64, albedo: f32) -> MediumId {
    let albedo = Spectrum::Constant(albedo).into();
    let phase = PhaseDesc::Isotropic;
    desc.media.push(MediumDesc { sigma_t, albedo, scale, phase, emission: None });
    MediumId(desc.media.len() as u32 - 1)
}

/// A grid medium in the unit cube in even light, seen by a narrow camera.
fn cloud(size: [usize; 3], values: Vec<f32>, scale: f64, albedo: f32) -> SceneDesc {
    let mut desc = empty();
    desc.camera = look(DVec3::new(0.4, 0.4, -1.0), DVec3::Z, 0.01);
    let cloud = grid_medium(&mut desc, grid(size, values, DAffine3::IDENTITY), scale, albedo);
    boundary(&mut desc, ShapeKind::Cube, cube(DVec3::ZERO, DVec3::ONE), cloud);
    environment(&mut desc);
    desc
}

/// The interpolation of a grid of one channel at a place of its unit cube, in double precision: between the centres of its cells, clamped beyond
/// those at the edge.
fn interpolated(size: [usize; 3], values: &[f32], at: DVec3) -> f64 {
    let place = at * DVec3::from_array(size.map(|n| n as f64)) - 0.5;
    let (cell, part) = (place.floor(), place - place.floor());
    (0..8)
        .map(|corner| {
            let index = [0, 1, 2].map(|axis| {
                let upper = f64::from(corner >> axis & 1);
                (cell[axis] + upper).clamp(0.0, size[axis] as f64 - 1.0) as usize
            });
            let weight = |axis: usize| if corner >> axis & 1 == 1 { part[axis] } else { 1.0 - part[axis] };
            let value = values[(index[2] * size[1] + index[1]) * size[0] + index[0]];
            f64::from(value) * weight(0) * weight(1) * weight(2)
        })
        .sum()
}

/// Voxels that are no density count as 0.
#[test]
fn m5_voxels_that_are_no_numbers() {
    let size = [6, 5, 4];
    let mut random = Random(15);
    let mut values: Vec<f32> = (0..size.iter().product()).map(|_| random.within(0.5, 4.0)).collect();
    let hostile =
        [0.0, -0.0, -3.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1e30, f32::MIN_POSITIVE / 2.0];
    for (i, value) in values.iter_mut().enumerate().filter(|(i, _)| i % 3 == 1) {
        *value = hostile[i / 3 % hostile.len()];
    }
    let zeroed: Vec<f32> = values.iter().map(|v| if *v > 0.0 && v.is_finite() { *v } else { 0.0 }).collect();
    let scene = |values: &[f32]| {
        let mut desc = cloud(size, values.to_vec(), 2.0, 0.8);
        desc.camera = look(DVec3::new(0.5, 0.5, -1.0), DVec3::Z, 45.0);
        desc
    };
    let [as_it_is, clean] = [&values, &zeroed].map(|values| luminances(&scene(values), 1 << 13));
    let differ = as_it_is.iter().zip(&clean).filter(|(a, b)| a.to_bits() != b.to_bits()).count();
    assert!(clean.iter().any(|y| (y - 1.0).abs() > 1e-3), "the cloud is seen");
    let places = 1 << 12;
    let raw = (0..places).filter(|_| {
        let at = DVec3::new(random.f64(), random.f64(), random.f64());
        interpolated(size, &values, at) != interpolated(size, &zeroed, at)
    });
    Row {
        case: "M5 40 of 120 voxels zero, negative, infinite or no number",
        measure: "share of paths that differ from those with zeros there",
        figure: differ as f64 / as_it_is.len() as f64,
        naive: ("values as they are: share of places", raw.count() as f64 / f64::from(places)),
        bound: 0.0,
    }
    .check();
}

/// A grid of one voxel is the same everywhere in its cube.
#[test]
fn m6_grid_of_one_voxel() {
    let scene = |one_voxel: bool| {
        let mut desc = cloud([1; 3], vec![3.0], 1.0, 0.9);
        if !one_voxel {
            desc.media[0].sigma_t = Spectrum::Constant(3.0).into();
        }
        desc.camera = look(DVec3::new(0.5, 0.5, -1.0), DVec3::Z, 50.0);
        desc.lights.clear();
        let intensity = Spectrum::Constant(5.0);
        let position = DVec3::new(1.6, 0.3, 1.7);
        desc.lights.push(LightDesc::Point { position, intensity, place: Place::default() });
        desc
    };
    let plan = Plan { side: 4, ..PLAN };
    let methods = [Method::Path, Method::Bidirectional, Method::Particle];
    let distance =
        |method: Method| apart(found(&scene(true), method, plan), found(&scene(false), method, plan));
    let figure = methods.into_iter().map(distance).fold(0.0, f64::max);
    // Zeros beyond the only point leave three quarters of the depth along the middle.
    let middle = |depth: f64| {
        let mut desc = scene(false);
        desc.media[0].sigma_t = Spectrum::Constant(depth as f32).into();
        found(&desc, Method::Path, plan)
    };
    let naive = apart(middle(2.25), middle(3.0));
    Row {
        case: "M6 a grid of one voxel, against a homogeneous medium",
        measure: STANDARD_ERRORS,
        figure,
        naive: ("zeros around the grid", naive),
        bound: DISTANCE,
    }
    .check();
}

fn phase(g: f64) -> PhaseFunction {
    PhaseFunction::new(&PhaseDesc::HenyeyGreenstein { g }).unwrap()
}

/// Henyey and Greenstein's lobe, in double precision: 1 − cos θ is given, of the angle to the peak.
fn lobe(g: f64, off: f64) -> f64 {
    let a = g.abs();
    (1.0 - a * a) / (4.0 * PI * ((1.0 - a) * (1.0 - a) + 2.0 * a * off).powf(1.5))
}

/// A peak of 1e-3 radians: its density, and the directions that are sampled.
#[test]
fn m8_peaked_phase_functions() {
    let wo = Vec3::new(0.36, -0.48, 0.8);
    for g in [0.999, -0.999] {
        let phase = phase(g);
        let peak = if g > 0.0 { -wo } else { wo }.as_dvec3().normalize();
        let (x, _) = peak.any_orthonormal_pair();
        let (mut figure, mut naive) = (0f64, 0f64);
        let (mut sum, mut cosine) = (0.0, 0.0);
        // Steps that are fine near both poles: cos θ = tanh x.
        let steps = 20_000;
        for i in 0..steps {
            let s = 13.0 * ((f64::from(i) + 0.5) / f64::from(steps) * 2.0 - 1.0);
            let wi = (peak * s.tanh() + x / s.cosh()).as_vec3();
            let exact = {
                let wi = wi.as_dvec3().normalize();
                lobe(g, 0.5 * (wi - peak).length_squared())
            };
            let density = f64::from(phase.density(wo, wi));
            let weight = 2.0 * PI / s.cosh().powi(2) * 26.0 / f64::from(steps);
            (sum, cosine) = (sum + density * weight, cosine + density * weight * s.tanh());
            figure = figure.max((density / exact - 1.0).abs());
            let (g32, cos) = (g as f32, (-wo).dot(wi));
            let textbook = (1.0 - g32 * g32)
                / (4.0 * std::f32::consts::PI)
                / (1.0 + g32 * g32 - 2.0 * g32 * cos).powf(1.5);
            let off = (f64::from(textbook) / exact - 1.0).abs();
            naive = if off.is_nan() { f64::INFINITY } else { naive.max(off) };
        }
        assert!((sum - 1.0).abs() < 1e-3, "g = {g}: the density has the integral {sum}");
        assert!((cosine - g.abs()).abs() < 1e-3, "g = {g}: mean cosine {cosine}");
        Row {
            case: &format!("M8 phase function of g = {g}"),
            measure: "largest relative error of the density",
            figure,
            naive: ("(1 − g²) / (1 + g² − 2g cos θ)^1.5", naive),
            bound: 1e-3,
        }
        .check();
        let (mut figure, mut naive, mut mean) = (0f64, 0f64, 0.0);
        let count = 1 << 14;
        for i in 0..count {
            let u = (i as f32 + 0.5) / count as f32;
            let s = phase.sample(wo, [u, (i as f32 * 0.618_034).fract()], 0.5).unwrap();
            assert!(s.wi.is_finite() && s.pdf.0 > 0.0 && s.pdf.0.is_finite(), "g = {g}: {s:?}");
            let off = |wi: Vec3| 0.5 * (wi.as_dvec3().normalize() - peak).length_squared();
            // The inverse of the distribution, in double precision.
            let (a, u) = (g.abs(), f64::from(u));
            // 1 − cos θ = (root² − (1 − a)²) / 2a without the difference, which cancels.
            let exact = {
                let step = 1.0 - a + 2.0 * a * u;
                let root = (1.0 - a * a) / step;
                let difference = 2.0 * a * (1.0 - a) * (1.0 - u) / step;
                difference * (root + 1.0 - a) / (2.0 * a)
            };
            figure = figure.max((off(s.wi) / exact - 1.0).abs());
            mean += (1.0 - off(s.wi)) / f64::from(count);
            let (g32, u) = (a as f32, u as f32);
            let root = (1.0 - g32 * g32) / (1.0 - g32 + 2.0 * g32 * u);
            let cos = (1.0 + g32 * g32 - root * root) / (2.0 * g32);
            naive = naive.max(((1.0 - f64::from(cos)) / exact - 1.0).abs());
        }
        assert!((mean - g.abs()).abs() < 1e-5, "g = {g}: samples have the mean cosine {mean}");
        Row {
            case: &format!("M8 samples of a phase function of g = {g}"),
            measure: "largest relative error of 1 − cos θ",
            figure,
            naive: ("(1 + g² − ((1 − g²) / (1 − g + 2gu))²) / 2g", naive),
            bound: 5e-2,
        }
        .check();
    }
}

/// One voxel of 1e4 beside a path through densities of 1: bounds are far above what there is.
#[test]
fn m9_bounds_that_are_far_too_large() {
    let size = [16; 3];
    let mut values = vec![1.0; 4096];
    // In the box of eight voxels through which the camera looks along voxel 6.
    values[(2 * 16 + 2) * 16 + 2] = 1e4;
    let expected = (-1f64).exp();
    let desc = cloud(size, values.clone(), 1.0, 0.0);
    let along = |z: f64| interpolated(size, &values, DVec3::new(0.4, 0.4, z));
    assert!((0..1000).all(|i| (along(f64::from(i) * 1e-3) - 1.0).abs() < 1e-12), "the voxel is not met");
    let plan = Plan { side: 1, paths_per_pixel: 256, ..PLAN };
    let figure = largest_distance(&desc, &[Method::Path, Method::Bidirectional], plan, expected);
    // A flight of at most 1000 tentative collisions, each of which is one in 1e4 times.
    let naive = (1.0 - 1e-4f64).powi(1000) * (-0.5f64).exp();
    Row {
        case: "M9 a voxel of 1e4 in the same bounds as densities of 1",
        measure: STANDARD_ERRORS,
        figure,
        naive: ("flights of at most 1000 tentative collisions", apart((naive, 0.0), (expected, 0.0))),
        bound: DISTANCE,
    }
    .check();
}

/// Keeps X, Y and Z of every camera sample.
#[derive(Default)]
struct Colors(Vec<[f64; 3]>);

impl SampleSink for Colors {
    fn camera(&mut self, _: [f32; 2], value: Xyz, _: f32) {
        self.0.push([value.x, value.y, value.z].map(f64::from));
    }

    fn light(&mut self, _: [f32; 2], _: Xyz) {}
}

/// Mean and relative variance of a sample of each channel, and the variance of the mean, from runs of samples.
fn statistics(samples: &[[f64; 3]], channel: usize) -> ((f64, f64), f64) {
    let moments = welch::moments(samples.iter().map(|v| v[channel]));
    (moments, moments.1 * samples.len() as f64 / moments.0.powi(2))
}

/// Extinction that is 1e4 times as large for red as for blue, through which light goes straight on.
#[test]
fn m10_chromatic_extinction() {
    let points = [(380.0, 1e-3), (450.0, 1e-3), (620.0, 10.0), (780.0, 10.0)];
    let table = Spectrum::table(&points).unwrap();
    let mut desc = empty();
    desc.camera = look(DVec3::new(0.1, 0.2, -3.0), DVec3::Z, 0.01);
    desc.media.push(MediumDesc {
        sigma_t: table.clone().into(),
        albedo: Spectrum::Constant(0.0).into(),
        scale: 1.0,
        phase: PhaseDesc::Isotropic,
        emission: None,
    });
    boundary(&mut desc, ShapeKind::Cube, cube(DVec3::splat(-0.5), DVec3::splat(0.5)), MediumId(0));
    environment(&mut desc);
    let eval = |lambda: f32| f64::from(table.eval(glam::Vec4::splat(lambda)).x);
    let expected = cie::integrate(|lambda, _| (-eval(lambda)).exp()).to_array();
    let tracer = tracer(&desc);
    let mut colors = Colors::default();
    (0..1 << 16).for_each(|index| tracer.trace(index, &mut (), &mut colors));
    let mut random = Random(77);
    let by_hero: Vec<[f64; 3]> = (0..1 << 16)
        .map(|_| {
            let lambda = SampledWavelengths::sample(random.f32());
            let extinction = table.sample(&lambda).0;
            let passes = -(-random.f64()).ln_1p() > f64::from(extinction.x);
            // T of each wavelength over the probability of the hero.
            let value = if passes { (-(extinction - extinction.x)).exp() } else { glam::Vec4::ZERO };
            let xyz = lambda.to_xyz(SampledSpectrum(value));
            [xyz.x, xyz.y, xyz.z].map(f64::from)
        })
        .collect();
    let (mut distance, mut figure) = (0f64, 0f64);
    for (channel, expected) in expected.into_iter().enumerate() {
        let (moments, ours) = statistics(&colors.0, channel);
        let (hero, theirs) = statistics(&by_hero, channel);
        println!(
            "channel {channel}: {:.5} ± {:.5}, expected {:.5}; by the hero alone {:.5} ± {:.5}",
            moments.0,
            moments.1.sqrt(),
            expected,
            hero.0,
            hero.1.sqrt()
        );
        distance = distance.max(apart(moments, (expected, 0.0)));
        figure = figure.max(ours / theirs);
    }
    assert!(distance < DISTANCE, "the means are {distance} standard errors away");
    Row {
        case: "M10 extinction from 1e-3 to 10 with the wavelength",
        measure: "variance of X, Y or Z of a sample over that of the naive method",
        figure,
        naive: ("distances by the hero alone", 1.0),
        bound: 0.1,
    }
    .check();
}

/// A scene of media at any place: fog in a box on a floor, and a cloud on a grid.
fn far_scene(at: DVec3) -> SceneDesc {
    let mut desc = empty();
    desc.camera = look(at + DVec3::new(0.0, -4.0, 1.5), DVec3::new(0.0, 4.0, -0.8), 40.0);
    let moved = DAffine3::from_translation(at);
    let matt = material(&mut desc, grey(0.6));
    shape(&mut desc, ShapeKind::Rectangle, moved * DAffine3::from_scale(DVec3::splat(3.0)), matt, 0.0);
    let fog = medium(&mut desc, 0.8, 0.8, PhaseDesc::HenyeyGreenstein { g: 0.3 });
    let fog_box = cube(DVec3::new(-2.0, -1.0, 0.0), DVec3::new(0.0, 1.0, 1.0));
    boundary(&mut desc, ShapeKind::Cube, moved * fog_box, fog);
    let mut random = Random(3);
    let values = (0..60).map(|_| random.within(0.0, 4.0)).collect();
    let corner = moved * DAffine3::from_translation(DVec3::new(0.2, -0.5, 0.1));
    let cloud = grid_medium(&mut desc, grid([5, 4, 3], values, corner), 1.0, 0.8);
    boundary(&mut desc, ShapeKind::Cube, corner * cube(DVec3::ZERO, DVec3::ONE), cloud);
    let position = at + DVec3::new(0.5, -0.5, 2.5);
    let intensity = Spectrum::Constant(8.0);
    desc.lights.push(LightDesc::Point { position, intensity, place: Place::default() });
    desc
}

/// Media at a place a million times their size away are the same.
#[test]
fn m11_media_far_away() {
    let plan = Plan { side: 4, paths_per_pixel: 4096, ..PLAN };
    let by = DVec3::new(1e6, -3e5, 1e5);
    // Photons are too noisy for the naive method to fail by.
    for method in METHODS.into_iter().filter(|method| *method != Method::Photon) {
        let here = found(&far_scene(DVec3::ZERO), method, plan);
        let mut there = far_scene(by);
        let naive = found(&there, method, plan);
        there.place();
        let there = found(&there, method, plan);
        println!("{method:?}: {here:?} {there:?} {naive:?}");
        Row {
            case: &format!("M11 fog and a cloud on a grid, moved by 1e6 times their size, {method:?}"),
            measure: STANDARD_ERRORS,
            figure: apart(there, here),
            naive: ("coordinates of the file", apart(naive, here)),
            bound: DISTANCE,
        }
        .check();
    }
}

/// A grid that is mirrored and sheared: transmittances along rays, against the integral of its interpolation.
#[test]
fn m12_grids_mirrored_and_sheared() {
    let size = [5, 4, 3];
    let mut random = Random(12);
    let values: Vec<f32> = (0..60).map(|_| random.within(0.0, 6.0)).collect();
    let shear =
        DMat3::from_cols(DVec3::new(-1.2, 0.1, 0.0), DVec3::new(0.5, 0.9, 0.2), DVec3::new(-0.3, 0.4, 1.1));
    assert!(shear.determinant() < 0.0);
    let to_world = DAffine3::from_mat3_translation(shear, DVec3::new(0.4, -0.6, -0.5));
    // The same grid without the mirror.
    let upright = DAffine3::from_mat3_translation(
        DMat3::from_diagonal(DVec3::new(1.2, 0.9, 1.1)),
        to_world.translation - DVec3::X * 1.2,
    );
    let depth = |to_world: DAffine3, from: DVec3, towards: DVec3| {
        let (to_unit, steps) = (to_world.inverse(), 40_000);
        let dt = 6.0 / f64::from(steps);
        let at = |i: i32| to_unit.transform_point3(from + towards * ((f64::from(i) + 0.5) * dt));
        let inside = |p: &DVec3| p.min_element() >= 0.0 && p.max_element() <= 1.0;
        (0..steps).map(at).filter(inside).map(|p| interpolated(size, &values, p) * dt).sum::<f64>()
    };
    let (mut figure, mut naive, mut seen) = (0f64, 0f64, 0);
    for _ in 0..8 {
        let from = random.direction() * 3.0;
        let target = to_world.transform_point3(DVec3::new(random.f64(), random.f64(), random.f64()));
        let towards = (target - from).normalize();
        let mut desc = empty();
        desc.camera = look(from, towards, 1e-3);
        let cloud = grid_medium(&mut desc, grid(size, values.clone(), to_world), 1.0, 0.0);
        boundary(&mut desc, sphere(DVec3::ZERO, 2.9), DAffine3::IDENTITY, cloud);
        environment(&mut desc);
        let expected = (-depth(to_world, from, towards)).exp();
        let plan = Plan { side: 1, ..PLAN };
        figure = figure.max(largest_distance(&desc, &[Method::Path, Method::Bidirectional], plan, expected));
        naive = naive.max(apart(((-depth(upright, from, towards)).exp(), 0.0), (expected, 0.0)));
        seen += u32::from(expected < 0.9);
    }
    assert!(seen >= 4, "most rays go through the cloud: {seen}");
    Row {
        case: "M12 a grid mirrored and sheared, along 8 rays",
        measure: STANDARD_ERRORS,
        figure,
        naive: ("a box of the same sides", naive),
        bound: DISTANCE,
    }
    .check();
}
