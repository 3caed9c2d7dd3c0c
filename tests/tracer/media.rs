//! Participating media against closed forms: transmittance, single scattering, the flux through slabs, and what is lost in none.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DQuat, DVec3};

use crate::support::agreement::{Method, Plan, repeat};
use crate::support::scenes::*;
use crate::support::welch;
use pointillist::scene::desc::texture::{SpectrumTexture, WrapMode};
use pointillist::scene::desc::volume::{VolumeGrid, VolumeTexture};
use pointillist::scene::desc::*;
use pointillist::spectrum::Spectrum;
use pointillist::stream::UvWindow;
use pointillist::tracer::bsdf::{CreditedBsdf, InMedia, Recorded};
use pointillist::tracer::effects::{Effect, without};
use pointillist::tracer::integrator::RenderContext;
use pointillist::tracer::medium::FreeFlight;
use pointillist::tracer::{Camera, Integrator, PathTracer, Scene};

const HG: fn(f64) -> PhaseDesc = |g| PhaseDesc::HenyeyGreenstein { g };

/// Mean over pictures and pixels, and its standard error by the pictures.
pub(crate) fn mean_of(desc: &SceneDesc, method: Method, plan: Plan) -> (f64, f64) {
    let pictures = repeat(desc, method, plan);
    let (mean, variance) =
        welch::moments(pictures.iter().map(|picture| picture.iter().sum::<f64>() / picture.len() as f64));
    (mean, variance.sqrt())
}

/// Asserts the mean that each of these methods finds, within four standard errors and within `within` of it.
pub(crate) fn assert_means(
    desc: &SceneDesc,
    methods: &[Method],
    plan: Plan,
    expected: f64,
    within: f64,
    what: &str,
) {
    for &method in methods {
        let (mean, error) = mean_of(desc, method, plan);
        println!("{what}, {method:?}: {mean:.6} ± {error:.6}, expected {expected:.6}");
        let off = (mean - expected).abs();
        assert!(off <= 4.0 * error + 1e-5 * expected, "{what}, {method:?}: {mean} ± {error}, not {expected}");
        assert!(off <= within * expected, "{what}, {method:?}: {mean} ± {error}, not {expected}");
    }
}

/// A floor below a slab of thickness 1, lit from above through it. The camera is between both.
fn floor_below_slab(sigma_t: f32) -> SceneDesc {
    let mut desc = empty();
    desc.camera = look(DVec3::new(0.0, 0.0, 0.5), DVec3::NEG_Z, 30.0);
    desc.integrator.max_depth = Some(2);
    let matt = material(&mut desc, grey(0.5));
    shape(&mut desc, ShapeKind::Rectangle, DAffine3::IDENTITY, matt, 0.0);
    let absorbing = medium(&mut desc, sigma_t, 0.0, PhaseDesc::Isotropic);
    let slab = DAffine3::from_scale_rotation_translation(
        DVec3::new(8.0, 8.0, 0.5),
        DQuat::IDENTITY,
        DVec3::new(0.0, 0.0, 1.5),
    );
    boundary(&mut desc, ShapeKind::Cube, slab, absorbing);
    let irradiance = Spectrum::Constant(PI as f32);
    desc.lights.push(LightDesc::Directional { direction: DVec3::NEG_Z, irradiance, place: Place::default() });
    desc
}

/// The transmittance of an edge is that of Beer and Lambert, to single precision.
#[test]
fn transmittance_is_exponential() {
    let (clear, _) = mean(&floor_below_slab(0.0), 64);
    for depth in [1e-6, 1e-4, 1e-2, 0.1, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 80.0] {
        let (found, _) = mean(&floor_below_slab(depth), 64);
        let expected = (-f64::from(depth)).exp();
        let off = found / clear / expected - 1.0;
        // Distances and the optical depth are single-precision numbers, each rounded a few times.
        let rounding = 6.0 * f64::from(f32::EPSILON / 2.0) * f64::from(depth);
        assert!(off.abs() < rounding.max(1e-5), "optical depth {depth}: {} of {expected}", found / clear);
    }
    // Beyond what single precision holds there is nothing, and nothing breaks.
    let (found, _) = mean(&floor_below_slab(1e6), 64);
    assert_eq!(found, 0.0);
}

/// A medium that shines with radiance 1 at all wavelengths.
fn shine(desc: &mut SceneDesc, medium: MediumId) {
    desc.media[medium.0 as usize].emission =
        Some(MediumEmission { radiance: Spectrum::Constant(1.0), grid: None });
}

/// One number in the unit cube of `to_grid`, under D65 where it is light.
pub(crate) fn one_number(value: f32, to_grid: DAffine3) -> Arc<VolumeTexture> {
    let grid = Arc::new(VolumeGrid::new([1; 3], 1, vec![value]));
    Arc::new(VolumeTexture::new(grid, to_grid, WrapMode::Clamp, false))
}

/// What a slab emits along a ray that is scattered nowhere on its way to the camera: (1 − α) Lₑ (1 − exp(−σₜ d)).
#[test]
fn an_emissive_slab_has_its_closed_form() {
    let methods = [Method::Path, Method::Photon, Method::Bidirectional, Method::Vcm];
    for (sigma_t, albedo) in [(1e-3f32, 0.0f32), (0.3, 0.25), (2.0, 0.0), (40.0, 0.9)] {
        let mut desc = empty();
        desc.integrator.max_depth = Some(1);
        let fire = medium(&mut desc, sigma_t, albedo, PhaseDesc::Isotropic);
        shine(&mut desc, fire);
        let slab = DAffine3::from_translation(DVec3::new(0.0, 0.0, 3.0));
        boundary(&mut desc, ShapeKind::Cube, slab, fire);
        let (depth, absorbed) = (2.0 * f64::from(sigma_t), 1.0 - f64::from(albedo));
        let expected = absorbed * -(-depth).exp_m1();
        let plan = Plan { side: 1, paths_per_pixel: 512, seeds: 8, window: UvWindow::PICTURE };
        for method in methods {
            let (found, _) = mean_of(&desc, method, plan);
            let off = (found / expected - 1.0).abs();
            // The field of view is a degree: rays at its edge are a little longer.
            assert!(off < 3e-4, "σₜ {sigma_t}, albedo {albedo}, {method:?}: {found}, not {expected}");
        }
        assert_eq!(
            mean_of(&desc, Method::Particle, plan),
            (0.0, 0.0),
            "no path from a light begins in a medium"
        );
        // On a grid it is found where light would be absorbed, and under D65.
        let box_of_slab =
            DAffine3::from_scale(DVec3::splat(0.5)) * DAffine3::from_translation(DVec3::new(1.0, 1.0, -2.0));
        let radiance = MediumEmission {
            radiance: Spectrum::Constant(0.5),
            grid: Some(EmissionGrid::Colors(one_number(2.0, box_of_slab))),
        };
        desc.media[0].emission = Some(radiance);
        desc.media[0].sigma_t = SpectrumTexture::Volume(one_number(sigma_t, box_of_slab));
        let plan = Plan { side: 1, paths_per_pixel: 1 << 14, seeds: 16, window: UvWindow::PICTURE };
        let within = if sigma_t < 0.01 { 0.3 } else { 0.02 };
        for method in methods {
            let (found, error) = mean_of(&desc, method, plan);
            let off = (found - expected).abs();
            let what = format!("slab on a grid, σₜ {sigma_t}, {method:?}: {found} ± {error}, not {expected}");
            assert!(off <= 4.0 * error + 5e-4 * expected && off <= within * expected, "{what}");
        }
    }
}

/// A medium as bright as what is around it is not seen, whatever it absorbs and scatters (Kirchhoff's law).
#[test]
fn a_medium_in_equilibrium_is_invisible() {
    let plan = Plan { side: 4, paths_per_pixel: 2048, seeds: 16, window: UvWindow::PICTURE };
    let fibres = PhaseDesc::Microflakes(MicroflakeDesc::Uniform([0.9, 0.5, 0.2, 0.1, -0.2, 0.05]));
    let around =
        DAffine3::from_scale(DVec3::splat(0.5)) * DAffine3::from_translation(DVec3::new(1.0, 1.0, -2.0));
    let colored = Spectrum::unbounded_rgb([0.3, 1.0, 3.0]);
    for (sigma_t, albedo, phase) in [
        (SpectrumTexture::from(Spectrum::Constant(3.0)), 0.0, PhaseDesc::Isotropic),
        (Spectrum::Constant(2.0).into(), 0.6, HG(0.7)),
        (Spectrum::Constant(3.0).into(), 0.5, fibres),
        (Spectrum::Constant(3.0).into(), 0.5, flakes_on_a_grid()),
        (colored.into(), 0.5, PhaseDesc::Rayleigh),
        (SpectrumTexture::Volume(one_number(2.0, around)), 0.7, HG(-0.4)),
    ] {
        let mut desc = empty();
        desc.camera.perspective_mut().unwrap().fov = 20.0;
        let gas = medium(&mut desc, 1.0, albedo, phase);
        desc.media[0].sigma_t = sigma_t;
        shine(&mut desc, gas);
        boundary(&mut desc, sphere(DVec3::new(0.0, 0.0, 3.0), 1.0), DAffine3::IDENTITY, gas);
        environment(&mut desc);
        let what = format!("equilibrium {:?}", desc.media[0].phase);
        assert_means(&desc, &[Method::Path, Method::Photon], plan, 1.0, 5e-3, &what);
        assert_means(&desc, &[Method::Bidirectional, Method::Vcm], plan, 1.0, 2e-2, &what);
    }
}

/// Light of a medium that walls scatter, with photons of the walls' own light around: a closed oven in equilibrium is 1 everywhere.
#[test]
fn an_oven_full_of_shining_gas() {
    let mut desc = empty();
    desc.camera.perspective_mut().unwrap().fov = 60.0;
    let gas = medium(&mut desc, 0.4, 0.5, HG(0.3));
    shine(&mut desc, gas);
    desc.camera.medium = Some(gas);
    let wall = material(&mut desc, grey(0.6));
    shape(&mut desc, sphere(DVec3::ZERO, 2.0), DAffine3::IDENTITY, wall, 0.4);
    desc.shapes[0].flip_normals = true;
    let plan = Plan { side: 4, paths_per_pixel: 2048, seeds: 16, window: UvWindow::PICTURE };
    assert_means(&desc, &[Method::Path, Method::Bidirectional, Method::Vcm], plan, 1.0, 1e-2, "oven");
    // Photons blur what they show.
    let (found, _) = mean_of(&desc, Method::Photon, plan);
    assert!((found - 1.0).abs() < 2e-2, "oven by photons: {found}");
}

/// Microflakes that turn and grow from one end of the box [−1, 1]² × [2, 4] to the other.
fn flakes_on_a_grid() -> PhaseDesc {
    let grid =
        |values: [[f32; 3]; 2]| Arc::new(VolumeGrid::new([1, 1, 2], 3, values.as_flattened().to_vec()));
    let grids = [grid([[0.9, 0.1, 0.1], [0.1, 0.3, 0.4]]), grid([[0.0; 3], [0.1, -0.05, 0.2]])];
    let to_grid =
        DAffine3::from_scale(DVec3::splat(0.5)) * DAffine3::from_translation(DVec3::new(1.0, 1.0, -2.0));
    PhaseDesc::Microflakes(MicroflakeDesc::Grid(Arc::new(MicroflakeGrid::new(
        grids,
        to_grid,
        WrapMode::Clamp,
        false,
    ))))
}

/// Microflakes scale extinction by the area that they have seen along a ray, the same everywhere and on a grid.
#[test]
fn microflakes_hide_by_their_area() {
    let s: [f64; 6] = [0.09, 0.5, 0.81, 0.1, -0.12, 0.2];
    let numbers = s.map(|v| v as f32);
    let grids = [[numbers[0], numbers[1], numbers[2]], [numbers[3], numbers[4], numbers[5]]]
        .map(|half| Arc::new(VolumeGrid::new([1; 3], 3, half.to_vec())));
    let grid = MicroflakeGrid::new(grids, DAffine3::IDENTITY, WrapMode::Clamp, false);
    for flakes in [MicroflakeDesc::Uniform(s), MicroflakeDesc::Grid(Arc::new(grid))] {
        for toward in [DVec3::X, DVec3::Z, DVec3::new(0.36, -0.48, 0.8)] {
            let mut desc = empty();
            desc.camera = look(-2.0 * toward, toward, 0.01);
            let smoke = medium(&mut desc, 1.5, 0.0, PhaseDesc::Microflakes(flakes.clone()));
            boundary(&mut desc, sphere(DVec3::ZERO, 1.0), DAffine3::IDENTITY, smoke);
            environment(&mut desc);
            let [x, y, z] = toward.to_array();
            let square = s[0] * x * x
                + s[1] * y * y
                + s[2] * z * z
                + 2.0 * (s[3] * x * y + s[4] * x * z + s[5] * y * z);
            let expected = (-3.0 * square.sqrt()).exp();
            let (found, error) = mean(&desc, 1 << 14);
            let off = (found - expected).abs();
            assert!(
                off <= 4.0 * error + 1e-6,
                "{flakes:?} along {toward}: {found} ± {error}, not {expected}"
            );
        }
    }
}

/// A ball of a medium without loss in even light is not seen, whatever its density and phase function.
#[test]
fn a_medium_without_loss_is_invisible_in_even_light() {
    let plan = Plan { side: 4, paths_per_pixel: 4096, seeds: 16, window: UvWindow::PICTURE };
    let fibres = PhaseDesc::Microflakes(MicroflakeDesc::Uniform([0.9, 0.5, 0.2, 0.1, -0.2, 0.05]));
    let table = PhaseDesc::Tabulated { values: [0.5, 0.0, 0.2, 3.0].into() };
    for (sigma_t, phase) in [
        (0.5, PhaseDesc::Isotropic),
        (4.0, HG(0.7)),
        (3.0, HG(-0.9)),
        (2.0, PhaseDesc::Rayleigh),
        (3.0, table.clone()),
        (4.0, fibres.clone()),
        (2.0, PhaseDesc::Blend { weight: 0.4, phases: Box::new([table, fibres]) }),
        (4.0, flakes_on_a_grid()),
    ] {
        let mut desc = empty();
        desc.camera.perspective_mut().unwrap().fov = 20.0;
        let cloud = medium(&mut desc, sigma_t, 1.0, phase);
        boundary(&mut desc, sphere(DVec3::new(0.0, 0.0, 3.0), 1.0), DAffine3::IDENTITY, cloud);
        environment(&mut desc);
        let what = format!("furnace {sigma_t}");
        assert_means(&desc, &[Method::Path], plan, 1.0, 1e-3, &what);
        // Noisier methods come as near as so many paths let them.
        assert_means(&desc, &[Method::Bidirectional, Method::Vcm], plan, 1.0, 1e-2, &what);
        assert_means(&desc, &[Method::Particle, Method::Photon], plan, 1.0, 3e-2, &what);
    }
}

/// Light of a point that is scattered once in an infinite medium, against the integral along the camera's ray.
#[test]
fn single_scattering_of_a_point_light() {
    let (extinction, albedo, g) = (0.7, 0.8, 0.5);
    let mut desc = empty();
    desc.integrator.max_depth = Some(2);
    desc.camera.medium = Some(medium(&mut desc, extinction, albedo, HG(g)));
    desc.camera.perspective_mut().unwrap().fov = 0.01;
    let position = DVec3::new(0.6, 0.0, 1.5);
    let intensity = Spectrum::Constant(4.0);
    desc.lights.push(LightDesc::Point { position, intensity, place: Place::default() });
    let extinction = f64::from(extinction);
    let steps = 400_000;
    let expected: f64 = (0..steps)
        .map(|i| {
            let dt = 40.0 / f64::from(steps);
            let t = (f64::from(i) + 0.5) * dt;
            let to = position - DVec3::Z * t;
            let d = to.length();
            // Light goes along −to, and on along −z.
            let cos = (-to / d).dot(DVec3::NEG_Z);
            let phase = (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cos).powf(1.5));
            extinction * f64::from(albedo) * (-extinction * (t + d)).exp() * phase * 4.0 / (d * d) * dt
        })
        .sum();
    let plan = Plan { side: 1, paths_per_pixel: 1 << 14, seeds: 16, window: UvWindow::PICTURE };
    assert_means(&desc, &[Method::Path, Method::Bidirectional], plan, expected, 1e-2, "single scattering");
    // From the light a camera this narrow is hardly found: a wide one, against paths.
    desc.camera.perspective_mut().unwrap().fov = 40.0;
    let plan = Plan { side: 2, paths_per_pixel: 1 << 14, seeds: 16, window: UvWindow::PICTURE };
    let (by_paths, error) = mean_of(&desc, Method::Path, plan);
    let (by_particles, other) = mean_of(&desc, Method::Particle, plan);
    let z = (by_paths - by_particles) / error.hypot(other);
    assert!(z.abs() < 4.0, "{by_paths} ± {error} by paths, {by_particles} ± {other} by particles");
}

/// Nodes and weights of Gauss and Legendre on [0, 1].
const NODES: [f64; 4] = [0.069_431_844_2, 0.330_009_478_2, 0.669_990_521_8, 0.930_568_155_8];
const WEIGHTS: [f64; 4] = [0.173_927_422_6, 0.326_072_577_4, 0.326_072_577_4, 0.173_927_422_6];

/// The share of even light that a slab without loss lets through, which scatters isotropically: Heaslet and Warming, *Radiative transport
/// and wall temperature slip in an absorbing planar medium*, 1965, table 1.
#[test]
fn flux_through_a_slab_without_loss() {
    for (depth, expected) in [(0.5, 0.7040), (1.0, 0.5532), (2.0, 0.3900)] {
        let (mut flux, mut variance) = (0.0, 0.0);
        for (mu, weight) in NODES.into_iter().zip(WEIGHTS) {
            let mut desc = empty();
            let cloud = medium(&mut desc, depth, 1.0, PhaseDesc::Isotropic);
            let black = material(&mut desc, grey(0.0));
            let wide = DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(400.0, 400.0, 1.0)));
            let at = |z: f64| DAffine3::from_translation(DVec3::new(0.0, 0.0, z)) * wide;
            shape(&mut desc, ShapeKind::Rectangle, at(-0.01), black, 1.0);
            let half = DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(400.0, 400.0, 0.5)));
            let slab = DAffine3::from_translation(DVec3::new(0.0, 0.0, 0.5)) * half;
            boundary(&mut desc, ShapeKind::Cube, slab, cloud);
            let towards = DVec3::new((1.0f64 - mu * mu).sqrt(), 0.0, -mu);
            desc.camera = look(DVec3::new(0.0, 0.0, 1.5) - towards, towards, 0.01);
            let plan = Plan { side: 1, paths_per_pixel: 1 << 14, seeds: 8, window: UvWindow::PICTURE };
            let (radiance, error) = mean_of(&desc, Method::Path, plan);
            flux += 2.0 * mu * weight * radiance;
            variance += (2.0 * mu * weight * error).powi(2);
        }
        let error = variance.sqrt();
        println!("slab {depth}: {flux:.5} ± {error:.5}, expected {expected}");
        // Four nodes are worth three digits, and so is the table.
        assert!(
            (flux - expected).abs() < 4.0 * error + 2e-3,
            "slab {depth}: {flux} ± {error}, not {expected}"
        );
    }
}

/// A deep medium reflects of even light what its albedo was made for, whichever way it scatters.
#[test]
fn a_deep_medium_is_as_bright_as_was_asked_for() {
    for (asked, g) in [(0.2, 0.0), (0.5, 0.6), (0.8, 0.0)] {
        let (mut reflected, mut variance) = (0.0, 0.0);
        for (mu, weight) in NODES.into_iter().zip(WEIGHTS) {
            let mut desc = empty();
            let deep = medium(&mut desc, 1.0, single_scattering_albedo(asked as f32, g as f32), HG(g));
            let black = material(&mut desc, grey(0.0));
            let wide = |z: f64, half: f64| {
                let size = DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(400.0, 400.0, half)));
                DAffine3::from_translation(DVec3::new(0.0, 0.0, z)) * size
            };
            shape(&mut desc, ShapeKind::Rectangle, wide(-120.01, 1.0), black, 0.0);
            boundary(&mut desc, ShapeKind::Cube, wide(-60.0, 60.0), deep);
            environment(&mut desc);
            let towards = DVec3::new((1.0f64 - mu * mu).sqrt(), 0.0, -mu);
            desc.camera = look(DVec3::Z - towards, towards, 0.01);
            let plan = Plan { side: 1, paths_per_pixel: 1 << 12, seeds: 8, window: UvWindow::PICTURE };
            let (radiance, error) = mean_of(&desc, Method::Path, plan);
            reflected += 2.0 * mu * weight * radiance;
            variance += (2.0 * mu * weight * error).powi(2);
        }
        let error = variance.sqrt();
        println!("g {g}: {reflected:.5} ± {error:.5}, asked for {asked}");
        // The fit of the albedo is as close as that, and so are four nodes.
        let off = f64::abs(reflected - asked);
        assert!(off < 4.0 * error + 4e-3, "g {g}: {reflected} ± {error}, asked for {asked}");
        assert!(error < 0.01, "too much noise to tell: {error}");
    }
}

/// Glass of `principled`, as smooth as it can be, loses next to nothing: neither does a medium without loss within it.
#[test]
fn a_medium_without_loss_in_principled_glass_is_invisible_in_even_light() {
    let plan = Plan { side: 4, paths_per_pixel: 1024, seeds: 16, window: UvWindow::PICTURE };
    for (eta, sigma_t, phase) in [(1.33, 2.0, PhaseDesc::Isotropic), (1.5, 0.7, HG(0.6))] {
        let mut desc = empty();
        desc.camera.perspective_mut().unwrap().fov = 20.0;
        let one = || Spectrum::Constant(1.0).into();
        let lobes = PrincipledLobes {
            roughness: 0.0,
            anisotropic: 0.0,
            metallic: 0.0,
            eta,
            spec_tint: 0.0,
            sheen: 0.0,
            sheen_tint: 0.0,
            flatness: 0.0,
            clearcoat: 0.0,
            clearcoat_gloss: 0.0,
        };
        let textures = Vec::new();
        let glass = PrincipledDesc { base_color: one(), spec_trans: one(), lobes, textures, thin_film: None };
        let glass = material(&mut desc, glass.into());
        shape(&mut desc, sphere(DVec3::new(0.0, 0.0, 3.0), 1.0), DAffine3::IDENTITY, glass, 0.0);
        let milk = medium(&mut desc, sigma_t, 1.0, phase);
        desc.shapes[0].medium_interface = MediumInterface { interior: Some(milk), exterior: None };
        environment(&mut desc);
        // Light subpaths do not show what lobes as narrow as these show to the camera.
        for (method, least) in [(Method::Path, 0.01), (Method::Photon, 0.03)] {
            let (mean, error) = mean_of(&desc, method, plan);
            println!("index {eta}, {method:?}: {mean:.6} ± {error:.6}");
            assert!((mean - 1.0).abs() < 4.0 * error + 1e-3, "index {eta}, {method:?}: {mean} ± {error}");
            assert!(error < least, "too much noise to tell: {error}");
        }
    }
}

/// What absorbs and scatters nothing is not there, to the bit.
#[test]
fn a_medium_of_density_zero_is_invisible() {
    let mut desc = empty();
    desc.camera.perspective_mut().unwrap().fov = 40.0;
    let matt = material(&mut desc, grey(0.7));
    shape(&mut desc, sphere(DVec3::new(0.0, 0.0, 3.0), 1.0), DAffine3::IDENTITY, matt, 0.0);
    environment(&mut desc);
    let before = luminances(&desc, 4096);
    let nothing = medium(&mut desc, 0.0, 0.5, PhaseDesc::Isotropic);
    desc.camera.medium = Some(nothing);
    assert_eq!(before, luminances(&desc, 4096));
}

/// Code for media that serves scenes without any, of paths that are recorded or tell of groups of lights, draws no flights in these.
#[test]
fn flights_take_numbers_in_media_only() {
    let mut desc = empty();
    let asked = |desc: &SceneDesc| {
        let (scene, mut numbers) = (prepare(desc), 0);
        let mut number = || {
            numbers += 1;
            0.5
        };
        FreeFlight::of::<Recorded>(&scene, &mut number);
        FreeFlight::of::<CreditedBsdf>(&scene, &mut number);
        FreeFlight::of::<InMedia>(&scene, &mut number);
        numbers
    };
    assert_eq!(asked(&desc), 0);
    desc.camera.medium = Some(medium(&mut desc, 0.1, 0.5, PhaseDesc::Isotropic));
    assert_eq!(asked(&desc), 3);
}

/// A boundary goes through a box where it does, but for rounding, and not where only its bounding box does.
#[test]
fn boxes_that_a_boundary_cuts() {
    let turn = DQuat::from_rotation_z(PI / 4.0);
    for center in [DVec3::ZERO, DVec3::new(500.0, -300.0, 200.0)] {
        let cuts = |kind: ShapeKind, to_world: DAffine3, at: DVec3, half: f64| {
            let mut desc = empty();
            let fog = medium(&mut desc, 1.0, 0.5, PhaseDesc::Isotropic);
            boundary(&mut desc, kind, DAffine3::from_translation(center) * to_world, fog);
            let corners = [-half, half].map(|half| (center + at + half).as_vec3());
            prepare(&desc).is_cut_by_medium_boundary(corners)
        };
        let cube = |at, half| cuts(ShapeKind::Cube, DAffine3::from_quat(turn), at, half);
        let on_face = DVec3::new(0.5f64.sqrt(), 0.5f64.sqrt(), 0.3);
        assert!(cube(on_face, 0.0) && cube(on_face, 0.1) && cube(on_face * 0.95, 0.1));
        assert!(cube(DVec3::ZERO, 1.0) && cube(DVec3::ZERO, 10.0));
        // In the bounding box of that face.
        assert!(
            !cube(DVec3::new(0.9, 0.0, 0.3), 0.0) && !cube(on_face * 0.9, 0.01) && !cube(DVec3::ZERO, 0.5)
        );
        assert!(!cube(on_face * 1.1, 0.01) && !cube(DVec3::X * 9.0, 1.0));
        let ball = |at, half| cuts(sphere(DVec3::ZERO, 1.0), DAffine3::IDENTITY, at, half);
        assert!(ball(DVec3::new(0.36, -0.48, 0.8), 0.0) && ball(DVec3::ZERO, 0.6) && ball(DVec3::X, 0.01));
        assert!(!ball(DVec3::ZERO, 0.5) && !ball(DVec3::splat(0.9), 0.1) && !ball(DVec3::X * 0.9, 0.05));
        let disk = |at, half| cuts(ShapeKind::Disk, DAffine3::IDENTITY, at, half);
        assert!(disk(DVec3::X * 0.5, 0.0) && disk(DVec3::Z * 0.05, 0.1) && !disk(DVec3::Z * 0.2, 0.1));
    }
}

/// A floor that is as large as the bottom of the fog on it hides that from below, though one face is the back of the other.
#[test]
fn fog_hides_no_floor_of_its_size() {
    for floor_first in [true, false] {
        let mut desc = empty();
        let black = material(&mut desc, grey(0.0));
        let floor = |desc: &mut SceneDesc| {
            let to_world = DAffine3::from_translation(DVec3::NEG_Z);
            shape(desc, ShapeKind::Rectangle, to_world, black, 0.0);
        };
        if floor_first {
            floor(&mut desc);
        }
        let fog = medium(&mut desc, 1.0, 0.0, PhaseDesc::Isotropic);
        boundary(&mut desc, ShapeKind::Cube, DAffine3::IDENTITY, fog);
        if !floor_first {
            floor(&mut desc);
        }
        environment(&mut desc);
        for (from, towards) in [(DVec3::Z * -3.0, DVec3::Z), (DVec3::ZERO, DVec3::NEG_Z)] {
            desc.camera = look(from, towards, 10.0);
            assert_eq!(mean(&desc, 256).0, 0.0, "from {from}, floor first: {floor_first}");
        }
        desc.camera = look(DVec3::ZERO, DVec3::Z, 0.01);
        let (found, error) = mean(&desc, 1 << 14);
        assert!((found - (-1f64).exp()).abs() <= 4.0 * error + 1e-6, "upwards: {found} ± {error}");
    }
}

/// A camera finds out by itself what it is in, wherever it has moved.
#[test]
fn a_camera_that_moves_knows_its_medium() {
    let picture = |z: f64, named: bool| {
        let mut desc = empty();
        // So narrow that the chord through the ball is the same all over the picture.
        desc.camera = look(DVec3::new(0.0, 0.0, z), DVec3::Z, 0.01);
        let smoke = medium(&mut desc, 1.0, 0.0, PhaseDesc::Isotropic);
        boundary(&mut desc, sphere(DVec3::ZERO, 1.0), DAffine3::IDENTITY, smoke);
        desc.camera.medium = named.then_some(smoke);
        environment(&mut desc);
        mean(&desc, 1 << 14)
    };
    for named in [true, false] {
        for (z, length) in [(-3.0, 2.0), (0.0, 1.0), (0.5, 0.5), (2.0, 0.0f64)] {
            let (found, error) = picture(z, named);
            let expected = (-length).exp();
            let off = (found - expected).abs();
            assert!(
                off <= 4.0 * error + 1e-6,
                "camera at {z}, named {named}: {found} ± {error}, not {expected}"
            );
        }
    }
}

/// Where nothing is scattered nothing is left to chance: every path has the transmittance as its weight.
#[test]
fn a_medium_that_only_absorbs_makes_no_noise() {
    let paths = |sigma_t: f32| {
        let mut desc = empty();
        // So narrow that the chord through the ball is the same all over the picture.
        desc.camera = look(DVec3::new(0.0, 0.0, -3.0), DVec3::Z, 0.01);
        let tea = medium(&mut desc, sigma_t, 0.0, HG(0.5));
        boundary(&mut desc, sphere(DVec3::ZERO, 1.0), DAffine3::IDENTITY, tea);
        environment(&mut desc);
        luminances(&desc, 256)
    };
    for sigma_t in [0.1f32, 0.6, 2.0] {
        let expected = (-2.0 * f64::from(sigma_t)).exp();
        for (clear, found) in paths(0.0).into_iter().zip(paths(sigma_t)) {
            let off = f64::from(found) / f64::from(clear) / expected - 1.0;
            assert!(off.abs() < 1e-5, "{sigma_t}: {found} of {clear}, not {expected}");
        }
    }
}

/// Media that an edit takes out and another one brings back are traced as before, and so are those whose density is edited.
#[test]
fn media_come_and_go_with_edits() {
    let mut desc = empty();
    desc.camera.perspective_mut().unwrap().fov = 20.0;
    let cloud = medium(&mut desc, 2.0, 0.5, HG(0.3));
    boundary(&mut desc, sphere(DVec3::new(0.0, 0.0, 3.0), 1.0), DAffine3::IDENTITY, cloud);
    environment(&mut desc);
    let traced = |scene: Scene| {
        let camera = Camera::of(&desc).expect("the camera is valid");
        let context = RenderContext::new(scene.into(), camera, &desc.integrator, 0, UvWindow::PICTURE);
        let (tracer, mut sink) = (PathTracer { context }, Luminances::default());
        (0..512).for_each(|index| tracer.trace(index, &mut (), &mut sink));
        sink.0
    };
    let prepared = |desc: &SceneDesc| Scene::prepare(desc).expect("the scene is valid");
    let edited = |scene: &Scene, desc: &SceneDesc| scene.edited(desc).expect("the scene is valid");
    let (scene, mut clear) = (prepared(&desc), desc.clone());
    without(&mut clear, Effect::Media).expect("media can be left out");
    let mut dense = desc.clone();
    dense.media[0].scale = 3.0;
    let before = traced(scene.clone());
    let gone = edited(&scene, &clear);
    assert!(gone.media().is_none() && traced(gone.clone()) != before);
    assert_eq!(traced(edited(&gone, &desc)), before, "brought back");
    let after = traced(edited(&scene, &dense));
    assert!(after != before && after == traced(prepared(&dense)), "three times as dense");
}
