//! Lights against exact values, and lights that touch each other: back to back, tessellated, meeting in edges. None may shadow its
//! neighbour.

use std::sync::Arc;

use std::f64::consts::PI;

use glam::{DAffine3, DMat3, DVec3, Vec3};

use crate::support::scenes::*;
use pointillist::scene::desc::*;
use pointillist::spectrum::{EmissionMap, SampledWavelengths, Spectrum};
use pointillist::tracer::accel::PrimRange;
use pointillist::tracer::bounding_sphere::BoundingSphere;
use pointillist::tracer::light::{
    DirectionSampling, DirectionalLight, Light, LightShape, Lights, SpotLight, SunDisc, SunSkyLight,
};
use pointillist::tracer::sampler::LightNumbers;

/// A floor of albedo 0.6 at z = 1, looked at from close by: one point, at the origin of x and y.
fn floor() -> SceneDesc {
    let mut desc = empty();
    desc.camera = look(DVec3::new(0.02, 0.0, 0.999), DVec3::new(-0.02, 0.0, 0.001), 1e-3);
    let m = material(&mut desc, grey(0.6));
    let turn = DAffine3::from_translation(DVec3::Z) * DAffine3::from_rotation_x(PI);
    shape(&mut desc, ShapeKind::Rectangle, turn * DAffine3::from_scale(DVec3::splat(30.0)), m, 0.0);
    desc.integrator.max_depth = Some(2);
    desc
}

/// A rectangle of n × n cells in place of [`ShapeKind::Rectangle`], two triangles each.
fn tessellated(n: u32) -> Mesh {
    let corner = |i: u32| i as f32 / n as f32 * 2.0 - 1.0;
    let positions =
        (0..=n).flat_map(|y| (0..=n).map(move |x| Vec3::new(corner(x), corner(y), 0.0))).collect();
    let row = n + 1;
    let cell = |x: u32, y: u32| {
        let a = y * row + x;
        [[a, a + 1, a + row + 1], [a, a + row + 1, a + row]]
    };
    let triangles = (0..n).flat_map(|y| (0..n).flat_map(move |x| cell(x, y))).collect();
    Mesh { positions, triangles, ..Mesh::default() }
}

/// Mean luminance and standard error with one light under `to_world`.
fn lit_by(n: Option<u32>, to_world: DAffine3) -> (f64, f64) {
    let mut desc = floor();
    let m = material(&mut desc, grey(0.0));
    let kind = match n {
        Some(n) => {
            desc.meshes.push(Arc::new(tessellated(n)));
            ShapeKind::Mesh(MeshId(0))
        }
        None => ShapeKind::Rectangle,
    };
    shape(&mut desc, kind, to_world, m, 1.0);
    mean(&desc, 1 << 17)
}

/// A light of 2 triangles and one of 200 give the same: neighbours that share an edge do not shadow each other, also
/// where the light is met at a grazing angle or lies far from the origin.
#[test]
fn a_tessellated_light_is_as_bright_as_a_whole_one() {
    let up = |x: f64, z: f64| DAffine3::from_translation(DVec3::new(x, 0.0, z));
    for (what, to_world) in [
        ("above", up(0.0, 0.0)),
        ("grazing", up(8.0, 0.9) * DAffine3::from_scale(DVec3::new(7.0, 3.0, 1.0))),
        ("inclined", up(1.5, 0.2) * DAffine3::from_rotation_y(-1.1)),
        ("next to it", up(0.0, 0.999) * DAffine3::from_scale(DVec3::splat(0.02))),
    ] {
        let (whole, whole_error) = lit_by(None, to_world);
        assert!(whole > 1e-4, "{what}: the case is dark");
        for n in [1, 10] {
            let (parts, error) = lit_by(Some(n), to_world);
            let z = (parts - whole) / (error * error + whole_error * whole_error).sqrt();
            assert!(z.abs() < 4.0, "{what}, {} triangles: {parts} instead of {whole}, z = {z:.1}", 2 * n * n);
        }
    }
}

/// A prism of 360 sides, each of two triangles, in place of a cylinder along z of radius 1 from 0 to 1.
fn prism() -> Mesh {
    const SIDES: u32 = 360;
    let corner = |i: u32| {
        let (y, x) = (f64::from(i / 2) / f64::from(SIDES) * 2.0 * PI).sin_cos();
        Vec3::new(x as f32, y as f32, (i % 2) as f32)
    };
    let side = |i: u32| {
        let [a, b, c, d] = [2 * i, 2 * i + 1, (2 * i + 2) % (2 * SIDES), (2 * i + 3) % (2 * SIDES)];
        [[a, c, d], [a, d, b]]
    };
    let (positions, triangles) = ((0..2 * SIDES).map(corner).collect(), (0..SIDES).flat_map(side).collect());
    Mesh { positions, triangles, ..Mesh::default() }
}

/// A cylinder, round or stretched and sheared, is as bright as a prism of many sides, outside and inside.
#[test]
fn a_cylinder_is_as_bright_as_a_prism() {
    let beside = DAffine3::from_translation(DVec3::new(-0.8, 0.3, 0.2)) * DAffine3::from_rotation_y(1.1);
    let narrow = DAffine3::from_scale(DVec3::new(0.4, 0.4, 2.0));
    let mut sheared = narrow * DAffine3::from_scale(DVec3::new(0.3, 1.0, 1.0));
    sheared.matrix3.z_axis += DVec3::new(0.3, 0.2, 0.0);
    let around =
        DAffine3::from_translation(DVec3::new(0.2, -0.1, -1.0)) * DAffine3::from_scale(DVec3::splat(1.9));
    for (what, to_world, flip) in [
        ("round", beside * narrow, false),
        ("mirrored", beside * narrow * DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0)), false),
        ("stretched", beside * sheared, false),
        ("inside", around, true),
        ("inside, from beside it", beside * DAffine3::from_scale(DVec3::new(0.4, 0.4, 0.2)), true),
    ] {
        let lit = |kind: ShapeKind| {
            let mut desc = floor();
            let m = material(&mut desc, grey(0.0));
            desc.meshes.push(Arc::new(prism()));
            // The front of a mesh is turned by a mirror, that of a cylinder is not.
            let turned = matches!(kind, ShapeKind::Mesh(_)) && to_world.matrix3.determinant() < 0.0;
            shape(&mut desc, kind, to_world, m, 1.0);
            desc.shapes.last_mut().expect("just added").flip_normals = flip != turned;
            mean(&desc, 1 << 17)
        };
        let exact = lit(ShapeKind::Cylinder { p0: DVec3::ZERO, p1: DVec3::Z, radius: 1.0 });
        let sides = lit(ShapeKind::Mesh(MeshId(0)));
        assert!(exact.0 > 1e-3, "{what}: the case is dark: {exact:?}");
        let z = (exact.0 - sides.0) / exact.1.hypot(sides.1);
        assert!(z.abs() < 4.0, "{what}: {exact:?} instead of {sides:?}, z = {z:.1}");
    }
}

/// How Mitsuba's scenes say "emits on both sides": two shapes in the same place, one with `flip_normals`. From either
/// side the light is what the shape on that side gives alone: the back never hides or shadows the front.
#[test]
fn coincident_shapes_back_to_back_emit_on_both_sides() {
    let ball = sphere(DVec3::ZERO, 0.7);
    let tube = ShapeKind::Cylinder { p0: DVec3::NEG_Y, p1: DVec3::Y, radius: 0.7 };
    for kind in [ShapeKind::Rectangle, ShapeKind::Disk, ShapeKind::Mesh(MeshId(0)), ball, tube] {
        for (i, turn) in [0.0, 0.3, 1.2, 1.5].into_iter().enumerate() {
            let build = |sides: &[bool]| {
                let mut desc = floor();
                desc.meshes.push(Arc::new(tessellated(3)));
                let m = material(&mut desc, grey(0.0));
                let at = DAffine3::from_translation(DVec3::new(0.4 * i as f64, 0.1, -0.3))
                    * DAffine3::from_rotation_y(-turn);
                for &flip in sides {
                    shape(&mut desc, kind.clone(), at, m, 1.0);
                    desc.shapes.last_mut().expect("just added").flip_normals = flip;
                }
                desc
            };
            let front = mean(&build(&[false]), 1 << 16);
            for sides in [[false, true], [true, false]] {
                let both = mean(&build(&sides), 1 << 16);
                // Half of the samples choose the side that faces away: more noise, the same mean.
                let z = (both.0 - front.0) / both.1.hypot(front.1);
                assert!(z.abs() < 4.0, "{kind:?} turned {turn}: {both:?} instead of {front:?}");
            }
        }
    }
}

/// `twosided` is about scattering: around the material of a light it makes the dark side reflect, not emit.
#[test]
fn a_two_sided_material_does_not_emit_from_the_back() {
    for flip in [false, true] {
        let mut desc = empty();
        let white = material(&mut desc, grey(0.5));
        let both = material(&mut desc, BsdfDesc::TwoSided(TwoSidedDesc { front: white, back: white }));
        // The camera looks along +z, at the back of a rectangle whose normal is +z.
        shape(&mut desc, ShapeKind::Rectangle, DAffine3::from_translation(DVec3::Z), both, 3.0);
        desc.shapes[0].flip_normals = flip;
        environment(&mut desc);
        // Reflection of the environment of radiance 1, and the emission only from the front.
        assert_mean(&desc, if flip { 3.5 } else { 0.5 }, 1e-2, &format!("front seen: {flip}"));
    }
}

/// Back to back with different emission and material: each side shows its own, in whatever order they come.
#[test]
fn each_side_shows_its_own() {
    for kind in [ShapeKind::Rectangle, ShapeKind::Disk, ShapeKind::Cube] {
        for order in [[false, true], [true, false]] {
            let mut desc = empty();
            let black = material(&mut desc, grey(0.0));
            let at = DAffine3::from_translation(DVec3::Z * 3.0);
            for flip in order {
                shape(&mut desc, kind.clone(), at, black, if flip { 5.0 } else { 2.0 });
                desc.shapes.last_mut().expect("just added").flip_normals = flip;
            }
            // A cube's outside is seen, of the others the side of the flipped normal.
            let expected = if matches!(kind, ShapeKind::Cube) { 2.0 } else { 5.0 };
            assert_mean(&desc, expected, 1e-2, &format!("{kind:?} {order:?}"));
        }
    }
}

/// What a floor of albedo 0.6 reflects where its irradiance is this.
fn reflected(irradiance: f64) -> f64 {
    0.6 / PI * irradiance
}

#[test]
fn parallel_light_is_seen_by_its_cosine() {
    for angle in [0.0, 0.4, 1.3, 1.7] {
        let mut desc = floor();
        let (sin, cos) = f64::sin_cos(angle);
        let (direction, irradiance) = (DVec3::new(0.0, sin, cos), Spectrum::Constant(3.0));
        desc.lights.push(LightDesc::Directional { direction, irradiance, place: Place::default() });
        let expected = reflected(3.0 * cos.max(0.0));
        let (found, error) = mean(&desc, 1 << 10);
        assert!(
            (found - expected).abs() <= 1e-4 * expected + 4.0 * error,
            "{angle}: {found} instead of {expected}"
        );
    }
}

fn spot(axis: DVec3, [beam_width, cutoff_angle]: [f64; 2]) -> LightDesc {
    let (position, intensity, place) = (DVec3::ZERO, Spectrum::Constant(5.0), Place::default());
    LightDesc::Spot(SpotDesc { position, axis, beam_width, cutoff_angle, intensity, texture: None, place })
}

/// Full within the beam, falling in proportion to the angle to nothing at the cutoff; values of Mitsuba 3.9.1.
#[test]
fn a_spot_falls_off_as_mitsubas() {
    for (angle, share) in [
        (0.0, 1.0),
        (5.0, 1.0),
        (9.9, 1.0),
        (15.0, 0.208_333 / 0.25),
        (25.0, 0.5),
        (39.0, 0.008_333_34 / 0.25),
        (41.0, 0.0),
    ] {
        let mut desc = floor();
        let (sin, cos) = f64::to_radians(angle).sin_cos();
        desc.lights.push(spot(DVec3::new(sin, 0.0, cos), [10.0, 40.0]));
        let expected = reflected(5.0 * share);
        let (found, error) = mean(&desc, 1 << 10);
        assert!(
            (found - expected).abs() <= 1e-3 * expected + 4.0 * error,
            "{angle}: {found} instead of {expected}"
        );
    }
}

/// The rays that leave a light carry its power: of a spot the integral of its intensity, of parallel light what passes through a
/// disk as large as the scene, of a sky and its sun the integral of radiance over directions and that disk.
#[test]
fn emitted_rays_carry_the_power_of_the_light() {
    let lambda = SampledWavelengths::sample(0.4);
    let scene = BoundingSphere { center: Vec3::new(1.0, 2.0, 3.0), radius: 2.5 };
    let axis = Vec3::new(1.0, -2.0, 0.5).normalize();
    let spot = |beam: f32, cutoff: f32| LightShape::Spot(SpotLight::new(Vec3::X, axis, beam, cutoff));
    let disk = PI * 2.5f64.powi(2);
    let integral = |beam: f64, cutoff: f64| {
        let step = cutoff / 1e5;
        let ring = |i: usize| {
            let angle = (i as f64 + 0.5) * step;
            let share = if angle <= beam { 1.0 } else { (cutoff - angle) / (cutoff - beam) };
            2.0 * PI * angle.sin() * share * step
        };
        (0..100_000).map(ring).sum::<f64>()
    };
    let sky = Arc::new(EmissionMap::new(2, &[[2.0; 3], [2.0; 3], [2.0; 3], [2.0; 3]]).expect("radiance"));
    let sun_sky = |radiance: f32| {
        let sun = SunDisc::new(axis, 0.05, Spectrum::D65(radiance));
        LightShape::SunSky(SunSkyLight::new(sky.clone(), up(axis), sun))
    };
    let disc = 2.0 * PI * (1.0 - 0.05f64.cos());
    let half = 2.0 * PI * 2.0;
    for (shape, expected, what) in [
        (LightShape::Directional(DirectionalLight { direction: axis }), disk, "directional"),
        (spot(0.3, 0.7), integral(0.3, 0.7), "spot"),
        (spot(0.5, 0.5), integral(0.5, 0.5), "spot with an edge"),
        (spot(1.0, 3.0), integral(1.0, 3.0), "wide spot"),
        (sun_sky(0.0), disk * half, "sky"),
        (sun_sky(3e3), disk * (half + 3e3 * disc), "sky and sun"),
    ] {
        let white = matches!(shape, LightShape::SunSky(_));
        let d65 = if white { f64::from(Spectrum::D65(1.0).sample(&lambda).0.x) } else { 1.0 };
        let light = Light { shape, spectrum: 0, prims: PrimRange::NONE };
        let lights = Lights::new(Arc::new([light]), vec![Spectrum::Constant(1.0)], scene);
        let (n, mut random) = (1 << 16, Random(3));
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..n {
            let mut pair = || [random.f32(), random.f32()];
            let numbers = LightNumbers { place: pair(), direction: pair(), choice: 0.5, aim: 0.5 };
            let Some(emission) = lights.emit(&numbers) else { continue };
            assert_eq!(lights.emission_pdf(0, emission.from.p, emission.direction), emission.pdf, "{what}");
            let spectrum = lights.emitted(&emission, &lambda);
            let power = f64::from(spectrum.0.x * emission.scale()) / d65;
            (sum, squares) = (sum + power, squares + power * power);
        }
        let mean = sum / f64::from(n);
        let error = ((squares / f64::from(n) - mean * mean).max(0.0) / f64::from(n)).sqrt();
        assert!(
            (mean - expected).abs() < 4.0 * error + 2e-3 * expected,
            "{what}: {mean} ± {error}, not {expected}"
        );
    }
}

/// A turn that takes +y to where `axis` stands 60° above the horizon.
fn up(axis: Vec3) -> DMat3 {
    let axis = axis.as_dvec3();
    let side = axis.any_orthonormal_vector();
    let up = axis * 60f64.to_radians().sin() + side * 60f64.to_radians().cos();
    let ahead = up.any_orthonormal_vector();
    DMat3::from_cols(up.cross(ahead), up, ahead)
}

/// A sky and its sun: what is sampled has the density that is told, which integrates to 1, over the disc and beside it.
#[test]
fn sun_and_sky_are_sampled_by_their_density() {
    let texels: Vec<[f32; 3]> =
        (0..8 * 5).map(|i| [if i < 24 { 1.0 + (i % 5) as f32 } else { 0.0 }; 3]).collect();
    let map = Arc::new(EmissionMap::new(8, &texels).expect("radiance"));
    let axis = Vec3::new(0.3, 0.8, -0.5).normalize();
    for half_angle in [0.0047f64, 0.3] {
        let sun = SunDisc::new(axis, half_angle, Spectrum::Constant(1e6));
        let light = SunSkyLight::new(map.clone(), up(axis), sun);
        let (n, mut random) = (100_000, Random(9));
        let (mut within, mut of_sky) = (0, 0.0);
        for _ in 0..n {
            let (wi, pdf) = light.sample_direction([random.f32(), random.f32()]).expect("it shines");
            assert_eq!(light.pdf_direction(wi), pdf);
            within += u32::from(f64::from(wi.dot(axis)) > (half_angle * 1.001).cos());
            // The mean of 1 / pdf over samples is the solid angle of all that can be sampled, here outside of the disc.
            of_sky += if f64::from(wi.dot(axis)) > (half_angle * 1.01).cos() {
                0.0
            } else {
                1.0 / f64::from(pdf.0)
            };
        }
        // The integral of the density over the disc, by points spread over it.
        let frame = pointillist::math::frame::Frame::new(axis);
        let cone = 2.0 * (0.5 * half_angle).sin().powi(2);
        let mut density = 0.0;
        for i in 0..10_000u32 {
            let u = [(i as f32 + 0.5) / 1e4, (i as f32 * 0.618_034).fract()];
            let r = (1.0 - (1.0 - f64::from(u[0]) * cone).powi(2)).sqrt() as f32;
            let (sin, cos) = (std::f32::consts::TAU * u[1]).sin_cos();
            let local = Vec3::new(r * cos, r * sin, (1.0 - f64::from(u[0]) * cone) as f32);
            density +=
                f64::from(light.pdf_direction(frame.to_world(local).normalize()).0) * 2.0 * PI * cone / 1e4;
        }
        let share = f64::from(within) / f64::from(n);
        let spread = (share * (1.0 - share) / f64::from(n)).sqrt();
        assert!((share - density).abs() < 4.0 * spread + 5e-3, "{half_angle}: {share}, not {density}");
        assert!(share > 0.4, "{half_angle}: the sun is hardly sampled: {share}");
        let sky = of_sky / f64::from(n);
        assert!((4.0..4.0 * PI).contains(&sky), "{half_angle}: solid angle {sky}");
    }
}
