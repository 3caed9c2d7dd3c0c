//! Lights with textures: samples follow their density, every emitting part can be sampled, and the density of a hit is that of
//! the sample.

use std::sync::Arc;

use glam::{Affine2, DAffine3, DVec3, Vec2, Vec3};

use crate::support::agreement::{Method, Plan, measure};
use crate::support::scenes::*;
use pointillist::scene::desc::emission_texture::{EmissionProfile, EmissionTexels, EmissionTexture};
use pointillist::scene::desc::texture::WrapMode;
use pointillist::scene::desc::*;
use pointillist::spectrum::{EmissionMap, SampledWavelengths, Spectrum};
use pointillist::stream::UvWindow;
use pointillist::tracer::Scene;
use pointillist::tracer::accel::Ray;
use pointillist::tracer::light::{EmissionOrigin, LightSampleContext};
use pointillist::tracer::sampler::LightNumbers;

fn picture(width: usize, values: &[f32], wrap: WrapMode, nearest: bool) -> EmissionTexture {
    let rgb: Vec<[f32; 3]> = values.iter().map(|v| [*v; 3]).collect();
    let map = Arc::new(EmissionMap::new(width, &rgb).expect("radiance"));
    EmissionTexture { texels: EmissionTexels::Picture(map), to_uv: Affine2::IDENTITY, wrap, nearest }
}

/// A bright spot in the dark, an uneven picture, one texel, one row, a checkerboard, a picture repeated and turned, one of many
/// texels of which few shine.
fn textures() -> Vec<(&'static str, EmissionTexture)> {
    let mut random = Random(5);
    let mut spot = vec![0.0; 16 * 9];
    spot[3 * 16 + 12] = 1e4;
    let uneven: Vec<f32> = (0..9 * 6).map(|i| if i % 5 == 0 { 0.0 } else { random.f32() }).collect();
    let mut sparse = vec![0.0; 700 * 300];
    (0..20).for_each(|i| sparse[i * 10_007 + 13] = 5.0);
    let turn = Affine2::from_scale_angle_translation(Vec2::new(2.5, 3.1), 0.6, Vec2::new(0.3, -0.8));
    let turned = |texture| EmissionTexture { to_uv: turn, ..texture };
    let colors = [Spectrum::D65(2.0), Spectrum::Constant(0.0)];
    vec![
        ("spot", picture(16, &spot, WrapMode::Repeat, false)),
        ("spot, nearest", picture(16, &spot, WrapMode::Clamp, true)),
        ("uneven", picture(9, &uneven, WrapMode::Clamp, false)),
        ("one texel", picture(1, &[2.0], WrapMode::Repeat, false)),
        ("one row", picture(3, &[1.0, 0.0, 3.0], WrapMode::Mirror, false)),
        ("squares", EmissionTexture::checkerboard(colors, turn)),
        ("repeated", turned(picture(9, &uneven, WrapMode::Repeat, true))),
        ("mirrored", turned(picture(16, &spot, WrapMode::Mirror, false))),
        ("sparse", picture(700, &sparse, WrapMode::Repeat, false)),
    ]
}

/// All shapes that emit, about 1 from the origin.
fn shapes() -> Vec<(&'static str, ShapeKind, DAffine3, bool)> {
    let before = DAffine3::from_translation(DVec3::new(0.1, -0.2, 1.0)) * DAffine3::from_rotation_x(3.0);
    let wide = before * DAffine3::from_scale(DVec3::new(0.9, 0.6, 1.0));
    let beside = DAffine3::from_translation(DVec3::new(0.3, 0.2, 2.0)) * DAffine3::from_rotation_y(0.7);
    let tube =
        ShapeKind::Cylinder { p0: DVec3::new(-0.6, 0.0, 0.1), p1: DVec3::new(0.7, 0.1, 0.0), radius: 0.4 };
    vec![
        ("rectangle", ShapeKind::Rectangle, wide, false),
        (
            "mirrored rectangle",
            ShapeKind::Rectangle,
            wide * DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0)),
            false,
        ),
        ("disk", ShapeKind::Disk, wide, false),
        ("sphere", sphere(DVec3::new(0.1, 0.0, 0.0), 0.7), beside, false),
        ("sphere around", sphere(DVec3::ZERO, 4.0), beside, true),
        ("cylinder", tube.clone(), beside, false),
        ("cylinder around", tube, DAffine3::from_scale(DVec3::splat(5.0)), true),
        ("cube", ShapeKind::Cube, beside * DAffine3::from_scale(DVec3::splat(0.5)), false),
        ("mesh", ShapeKind::Mesh(MeshId(0)), wide, false),
    ]
}

/// Two triangles with texture coordinates.
fn screen() -> Mesh {
    let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    Mesh {
        positions: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        uvs: vec![Vec2::new(0.0, 1.0), Vec2::new(1.0, 1.0), Vec2::new(1.0, 0.0), Vec2::new(0.0, 0.0)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

fn lit(kind: ShapeKind, to_world: DAffine3, flip: bool, profile: EmissionProfile) -> SceneDesc {
    let mut desc = empty();
    desc.meshes.push(Arc::new(screen()));
    let m = material(&mut desc, grey(0.0));
    shape(&mut desc, kind, to_world, m, 1.0);
    let light = desc.shapes.last_mut().expect("just added");
    (light.flip_normals, light.emission_profile) = (flip, profile);
    desc
}

fn with(texture: EmissionTexture) -> EmissionProfile {
    EmissionProfile { texture: Some(Arc::new(texture)), along_normal: false }
}

const AT: LightSampleContext = LightSampleContext { p: Vec3::ZERO, n: Vec3::Z, through: true, glossy: false };

/// Calls `visit` with directions, densest at right angles to y, spread over the sphere; each stands for the solid angle returned.
fn over_the_sphere(n: u32, mut visit: impl FnMut(Vec3)) -> f64 {
    for i in 0..n {
        for j in 0..2 * n {
            let (z, phi) = (
                1.0 - (2 * i + 1) as f32 / n as f32,
                (2 * j + 1) as f32 / (2 * n) as f32 * std::f32::consts::PI,
            );
            let r = (1.0 - z * z).sqrt();
            visit(Vec3::new(r * phi.cos(), z, r * phi.sin()));
        }
    }
    4.0 * std::f64::consts::PI / f64::from(2 * n * n)
}

/// Emission that arrives from `wi`, and the density of sampling it.
fn seen(scene: &Scene, wi: Vec3, lambda: &SampledWavelengths) -> Option<(f32, f32)> {
    let hit = scene.closest(&Ray::new(AT.p, wi))?;
    let light = hit.emitter()?;
    let value = scene.lights().spectrum(light, hit.point.p, wi, lambda);
    Some((value.0.x, scene.lights().pdf(light, AT, wi, Some(&hit.point)).0))
}

/// What is sampled is hit where it was sampled, with the density and the value of the sample; what shines can be sampled; and
/// sampling finds as much light as a grid over all directions.
#[test]
fn samples_and_hits_agree() {
    let lambda = SampledWavelengths::sample(0.4);
    for (what, texture) in textures() {
        for (on, kind, to_world, flip) in shapes() {
            let scene = prepare(&lit(kind, to_world, flip, with(texture.clone())));
            let mut random = Random(3);
            let (n, mut missed, mut sum, mut squares) = (20_000, 0, 0.0, 0.0);
            for _ in 0..n {
                let (choice, u) = (random.f64(), [random.f32(), random.f32()]);
                let Some((light, sample)) = scene.lights().sample(AT, choice, u) else { continue };
                let target = sample.target.expect("a place");
                let value = scene.lights().spectrum(light, target, sample.wi, &lambda).0.x;
                assert!(sample.pdf.0 > 0.0 && sample.pdf.0.is_finite() && value.is_finite());
                let (hit, pdf) = seen(&scene, sample.wi, &lambda).unwrap_or_default();
                // At an edge of the shape, of a cell or of a texel rounding may decide otherwise.
                let same =
                    (pdf / sample.pdf.0 - 1.0).abs() < 1e-2 && (hit - value).abs() <= 0.05 * value.max(1e-3);
                missed += u32::from(!same);
                let x = f64::from(value / sample.pdf.0);
                (sum, squares) = (sum + x, squares + x * x);
            }
            assert!(
                missed < n / 50,
                "{what} on {on}: {missed} of {n} samples are not hit as they were sampled"
            );
            let (mut all, mut densities, mut dark) = (0.0, 0.0, 0);
            // Texels that shine alone are small on a small shape.
            let fine = if on == "cube" && what.starts_with("spot") { 800 } else { 300 };
            let step = over_the_sphere(fine, |wi| {
                let Some((value, pdf)) = seen(&scene, wi, &lambda) else { return };
                dark += u32::from(value > 0.0 && pdf == 0.0);
                (all, densities) = (all + f64::from(value), densities + f64::from(pdf));
            });
            assert!(dark <= 2, "{what} on {on}: {dark} directions shine and cannot be sampled");
            // The grid is coarser than what shines there.
            if what == "sparse" {
                continue;
            }
            let (mean, nf) = (sum / f64::from(n), f64::from(n));
            let error = ((squares / nf - mean * mean) / nf).sqrt();
            let off = (mean - all * step).abs();
            assert!(
                off <= 4.0 * error + 0.05 * all * step,
                "{what} on {on}: {mean} ± {error}, grid {}",
                all * step
            );
            assert!(
                densities * step < 1.15,
                "{what} on {on}: the density integrates to {}",
                densities * step
            );
        }
    }
}

/// Rays leave the light with the densities that they are told to have, and carry as much as the whole of it emits.
#[test]
fn emission_has_its_density() {
    let lambda = SampledWavelengths::sample(0.4);
    for along_normal in [false, true] {
        for (what, texture) in textures() {
            for (on, kind, to_world, flip) in shapes() {
                let profile = EmissionProfile { along_normal, ..with(texture.clone()) };
                let scene = prepare(&lit(kind, to_world, flip, profile));
                let mut random = Random(9);
                let (n, mut by_texture, mut squares) = (4000, 0.0, 0.0);
                for _ in 0..n {
                    let place = [random.f32(), random.f32()];
                    let direction = [random.f32(), random.f32()];
                    let u = LightNumbers { choice: random.f64(), place, direction, aim: 0.5 };
                    let Some(emission) = scene.lights().emit(&u) else { continue };
                    let pdf = emission.pdf;
                    let beam = pdf.origin == EmissionOrigin::Beam;
                    assert!(beam == along_normal && (!beam || emission.direction == emission.from.ng));
                    let x = f64::from(scene.lights().emitted(&emission, &lambda).0.x / pdf.vertex);
                    (by_texture, squares) = (by_texture + x, squares + x * x);
                }
                // The spread of ∫ emission dA tells how well points follow the texture: evenly chosen ones have 1e2 for the spot.
                let mean = by_texture / f64::from(n);
                let spread = squares / f64::from(n) / (mean * mean) - 1.0;
                // Cells of a triangle are not aligned with texels, and none can tell what lies on either side of a texel's edge in it.
                let most = if on == "mesh" { 20.0 } else { 6.0 };
                assert!(mean > 0.0 && spread < most, "{what} on {on}: relative variance {spread}");
            }
        }
    }
}

/// A screen of two triangles is sampled at its bright spot, on the triangle that has it.
#[test]
fn a_spot_on_a_screen_is_sampled() {
    let (_, texture) = textures().swap_remove(0);
    let (_, kind, to_world, flip) = shapes().swap_remove(8);
    let scene = prepare(&lit(kind, to_world, flip, with(texture)));
    let mut random = Random(1);
    let lambda = SampledWavelengths::sample(0.4);
    let (mut bright, n) = (0, 2000);
    for _ in 0..n {
        let sample = scene.lights().sample(AT, random.f64(), [random.f32(), random.f32()]);
        bright += u32::from(sample.is_some_and(|(light, s)| {
            let p = s.target.expect("a place");
            scene.lights().spectrum(light, p, s.wi, &lambda).0.x > 0.0
        }));
    }
    assert!(bright > n * 6 / 10, "{bright} of {n}");
}

/// What a lamp that shines along its normal throws onto a floor is exact: albedo / π times its exitance. Path tracing does not find it.
#[test]
fn light_along_the_normal_is_found_from_the_light() {
    let mut desc = empty();
    desc.camera = look(DVec3::new(0.0, 0.0, 2.0), -DVec3::Z, 20.0);
    (desc.film.width, desc.film.height) = (4, 4);
    let white = material(&mut desc, grey(0.6));
    shape(&mut desc, ShapeKind::Rectangle, DAffine3::from_scale(DVec3::splat(4.0)), white, 0.0);
    let down = DAffine3::from_translation(DVec3::new(0.0, 0.0, 3.0))
        * DAffine3::from_rotation_x(std::f64::consts::PI);
    shape(&mut desc, ShapeKind::Rectangle, down * DAffine3::from_scale(DVec3::splat(1.5)), white, 2.0);
    let (_, texture) = textures().swap_remove(3);
    let texture = Some(Arc::new(texture));
    for (texture, exitance) in [(None, 2.0), (texture, 4.0)] {
        desc.shapes[1].emission_profile = EmissionProfile { texture, along_normal: true };
        desc.integrator.max_depth = Some(2);
        let plan = Plan { side: 4, paths_per_pixel: 4096, seeds: 8, window: UvWindow::PICTURE };
        let exact = 0.6 * exitance / std::f64::consts::PI;
        for (method, expected) in [
            (Method::Path, 0.0),
            (Method::Particle, exact),
            (Method::Bidirectional, exact),
            (Method::Photon, exact),
        ] {
            // A lookup of photons sees past the edge of the lit square.
            let within = if method == Method::Photon { 0.05 } else { 0.02 };
            let found = measure(&desc, method, plan);
            let mean = found.mean.iter().sum::<f64>() / 16.0;
            assert!((mean - expected).abs() <= within * exact, "{method:?}: {mean} instead of {expected}");
        }
    }
}
