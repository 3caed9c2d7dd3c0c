//! What media do along a line of sight: layers beside the picture, and the features of the noise filter.

use std::path::Path;
use std::sync::Arc;

use glam::{DAffine3, DQuat, DVec3, Vec3};

use crate::support::scenes::*;
use pointillist::color::Xyz;
use pointillist::math::random::Random;
use pointillist::scene;
use pointillist::scene::desc::aov::{channel_count, parse};
use pointillist::scene::desc::texture::WrapMode;
use pointillist::scene::desc::volume::{VolumeGrid, VolumeTexture};
use pointillist::scene::desc::*;
use pointillist::spectrum::{SampledWavelengths, Spectrum};
use pointillist::stream::{SampleSink, UvWindow};
use pointillist::tracer::aov::AovTracer;
use pointillist::tracer::features::{Features, features};
use pointillist::tracer::integrator::{BidirectionalTracer, RenderContext};
use pointillist::tracer::medium::CameraMedium;
use pointillist::tracer::record::{PathEvent, Trail, recorded};
use pointillist::tracer::{Camera, Integrator, PathTracer};

/// Reflectance of the wall.
const WALL: f32 = 0.6;

/// A wall at z = 0 that the camera at z = 3 looks at; it faces the camera.
fn wall() -> SceneDesc {
    let mut desc = empty();
    desc.camera = look(DVec3::new(0.0, 0.0, 3.0), DVec3::NEG_Z, 20.0);
    let matt = material(&mut desc, grey(WALL));
    shape(&mut desc, ShapeKind::Rectangle, DAffine3::from_scale(DVec3::splat(4.0)), matt, 0.0);
    environment(&mut desc);
    desc
}

/// Adds a slab of a medium from z = 1 to z = 2.
fn add_slab(desc: &mut SceneDesc, sigma_t: f32, albedo: f32) {
    let fog = medium(desc, sigma_t, albedo, PhaseDesc::Isotropic);
    let (half, middle) = (DVec3::new(4.0, 4.0, 0.5), DVec3::new(0.0, 0.0, 1.5));
    let slab = DAffine3::from_scale_rotation_translation(half, DQuat::IDENTITY, middle);
    boundary(desc, ShapeKind::Cube, slab, fog);
}

/// The values of layers in the middle of the picture.
fn layers(desc: &SceneDesc, list: &str) -> Vec<f32> {
    let layers = parse(list).expect("a list of layers").layers;
    let (scene, camera) = (prepare(desc), Camera::of(desc).expect("the camera is valid"));
    let mut values = vec![f32::NAN; channel_count(&layers)];
    AovTracer::new(&scene, &camera, &layers).along(&camera.ray([0.5; 2], [0.5; 2]).unwrap(), &mut values);
    values
}

/// The features in the middle of the picture.
fn seen(desc: &SceneDesc) -> Features {
    let (scene, camera) = (prepare(desc), Camera::of(desc).expect("the camera is valid"));
    let ray = camera.ray([0.5; 2], [0.5; 2]).unwrap();
    let medium = CameraMedium::of(&scene, &camera, &UvWindow::PICTURE).along(&scene, &ray);
    features(&scene, ray, medium, &SampledWavelengths::sample(0.15))
}

#[track_caller]
fn near(found: f32, expected: f64, what: &str) {
    let off = (f64::from(found) - expected).abs();
    assert!(off <= 2e-5 * expected.abs().max(1.0), "{what}: {found}, not {expected}");
}

/// Mean distance of the first collision on a stretch of this length, if there is one.
fn mean_distance(sigma: f64, length: f64) -> f64 {
    1.0 / sigma - length * (-sigma * length).exp() / (1.0 - (-sigma * length).exp())
}

const LIST: &str = "transmittance,scattering_depth,depth,shape_index,albedo";

/// Boundaries are looked through, and what lies between them has a closed form.
#[test]
fn layers_of_a_slab_before_a_wall() {
    for (sigma, albedo) in [(0.7, 0.9), (1e-4, 0.5), (9.0, 0.2)] {
        let mut desc = wall();
        add_slab(&mut desc, sigma, albedo);
        let found = layers(&desc, LIST);
        let sigma = f64::from(sigma);
        let transmittance = (-sigma).exp();
        let wall = f64::from(WALL);
        let expected = [transmittance, transmittance, transmittance, 1.0 + mean_distance(sigma, 1.0), 3.0];
        for (i, expected) in expected.into_iter().chain([1.0, wall, wall, wall]).enumerate() {
            near(found[i], expected, &format!("density {sigma}, channel {i}"));
        }
        // The near clip plane is where distances begin.
        desc.camera.near_clip = 0.75;
        let cut = layers(&desc, LIST);
        near(cut[0], transmittance, "transmittance behind the near clip plane");
        near(cut[3], 0.25 + mean_distance(sigma, 1.0), "scattering depth from there");
        near(cut[4], 2.25, "depth from there");
        desc.camera = look(DVec3::new(0.0, 0.0, 1.5), DVec3::NEG_Z, 20.0);
        let within = layers(&desc, LIST);
        near(within[0], (-0.5 * sigma).exp(), "transmittance from within");
        near(within[3], mean_distance(sigma, 0.5), "scattering depth from within");
        near(within[4], 1.5, "depth from within");
    }
}

/// Without a surface a line of sight has no end, and without media there is nothing to see of them.
#[test]
fn layers_of_endless_fog_and_of_none() {
    let mut desc = empty();
    environment(&mut desc);
    desc.camera = look(DVec3::ZERO, DVec3::Z, 20.0);
    assert_eq!(layers(&desc, LIST)[..5], [1.0, 1.0, 1.0, 0.0, 0.0], "nothing at all");
    desc.camera.medium = Some(medium(&mut desc, 0.25, 0.5, PhaseDesc::Isotropic));
    let endless = layers(&desc, LIST);
    assert_eq!(endless[..3], [0.0; 3]);
    near(endless[3], 4.0, "a mean free path");
    assert_eq!(layers(&wall(), LIST)[..4], [1.0, 1.0, 1.0, 0.0], "a wall in vacuum");
    let mut dark = wall();
    add_slab(&mut dark, 2.0, 0.0);
    let dark = layers(&dark, LIST);
    near(dark[0], (-2.0f64).exp(), "what absorbs");
    assert_eq!(dark[3], 0.0, "nothing scatters");
}

/// Extinction that depends on the wavelength gives a colour, and red light comes from further away.
#[test]
fn layers_of_a_coloured_medium() {
    let mut desc = wall();
    add_slab(&mut desc, 1.0, 0.9);
    desc.media[0].sigma_t = Spectrum::unbounded_rgb([0.5, 1.0, 2.0]).into();
    let found = layers(&desc, LIST);
    // A spectrum is no three numbers: this is near, not equal.
    for (i, sigma) in [0.5f64, 1.0, 2.0].into_iter().enumerate() {
        assert!((f64::from(found[i]) - (-sigma).exp()).abs() < 0.1, "channel {i}: {}", found[i]);
    }
    assert!(found[0] > found[1] && found[1] > found[2], "{found:?}");
    let [least, most] = [mean_distance(2.0, 1.0), mean_distance(0.5, 1.0)].map(|d| 1.0 + d as f32);
    assert!(found[3] > least && found[3] < most, "{}", found[3]);
}

/// On a grid, against the interpolation summed up in small steps.
#[test]
fn layers_of_a_medium_on_a_grid() {
    let size = [19, 9, 11];
    let mut random = Random(5);
    let values: Vec<f32> = (0..size.iter().product::<usize>()).map(|_| random.within(0.0, 2.0)).collect();
    let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.4, 0.3, 0.2);
    let placed = DAffine3::from_scale_rotation_translation(
        DVec3::new(3.0, 2.0, 2.5),
        turn,
        turn * DVec3::new(-1.5, -1.0, -1.25) + DVec3::new(0.0, 0.0, 1.3),
    );
    for nearest in [false, true] {
        let grid = Arc::new(VolumeGrid::new(size, 1, values.clone()));
        let volume = VolumeTexture::new(grid, placed.inverse(), WrapMode::Clamp, nearest);
        // The slab is far wider than the grid, outside of which there is nothing.
        let mut desc = wall();
        add_slab(&mut desc, 1.0, 0.8);
        desc.media[0].sigma_t = texture::SpectrumTexture::Volume(Arc::new(volume.clone()));
        desc.media[0].scale = 0.7;
        let found = layers(&desc, LIST);
        let (steps, mut depth, mut first, mut all) = (200_000, 0.0f64, 0.0, 0.0);
        for i in 0..steps {
            let (t, dt) = (1.0 + (f64::from(i) + 0.5) / f64::from(steps), 1.0 / f64::from(steps));
            let at = placed.inverse().transform_point3(DVec3::new(0.0, 0.0, 3.0 - t));
            let inside = at.min_element() >= 0.0 && at.max_element() <= 1.0;
            let density = if inside { volume.coefficient(at.as_vec3())[0] } else { 0.0 };
            let sigma = 0.7 * f64::from(density);
            let met = sigma * (-(depth + 0.5 * sigma * dt)).exp() * dt;
            (depth, first, all) = (depth + sigma * dt, first + t * met, all + met);
        }
        let off = f64::from(found[0]) / (-depth).exp() - 1.0;
        assert!(depth > 0.1 && off.abs() < 1e-4, "transmittance {}, not {}", found[0], (-depth).exp());
        let off = f64::from(found[3]) / (first / all) - 1.0;
        assert!(off.abs() < 3e-4, "scattering depth {}, not {}", found[3], first / all);
        // The filter's features take larger steps.
        let (share, fog) = ((-depth).exp(), seen(&desc));
        let part = share / (share + 0.8 * (1.0 - share));
        assert!((f64::from(fog.normal.length()) - part).abs() < 0.15, "{fog:?}, share {part}");
    }
}

/// Features in fog are means of those of the surface and of the fog, by the shares in which both are seen.
#[test]
fn features_in_fog() {
    let clear = seen(&wall());
    assert!((clear.albedo - WALL).abs().max_element() < 1e-5 && !clear.is_detached, "{clear:?}");
    for (sigma, albedo) in [(0.01, 0.9), (0.7, 0.9), (3.0, 0.5), (200.0, 1.0), (1.0, 0.0)] {
        let mut desc = wall();
        add_slab(&mut desc, sigma, albedo);
        let found = seen(&desc);
        let (sigma, albedo) = (f64::from(sigma), f64::from(albedo));
        let transmittance = (-sigma).exp();
        let scattered = albedo * (1.0 - transmittance);
        let share = transmittance / (transmittance + scattered);
        let what = format!("density {sigma}, albedo {albedo}");
        for lane in found.albedo.to_array() {
            near(lane, transmittance * f64::from(WALL) + scattered, &what);
        }
        near(found.normal.z, share, &what);
        near(found.distance, 3.0 * share + (1.0 - share) * (1.0 + mean_distance(sigma, 1.0)), &what);
        assert_eq!(found.is_detached, share < 0.95, "{what}");
    }
    // A medium that is not there changes nothing.
    let mut desc = wall();
    add_slab(&mut desc, 0.0, 0.5);
    let found = seen(&desc);
    near(found.distance, f64::from(clear.distance), "distance through nothing");
    near(found.normal.z, f64::from(clear.normal.z), "normal through nothing");
    near(found.albedo.x, f64::from(clear.albedo.x), "albedo through nothing");
    assert!(!found.is_detached);
}

/// A lamp that dense fog hides is no feature; seen in a mirror behind fog, a wall has the features of both ways.
#[test]
fn features_of_lamps_and_mirrors_in_fog() {
    for (sigma, emits) in [(0.5, true), (20.0, false)] {
        let mut desc = wall();
        let last = desc.shapes.last_mut().expect("the wall");
        last.emission = Some(Spectrum::Constant(3.0));
        add_slab(&mut desc, sigma, 0.9);
        assert_eq!(seen(&desc).emits, emits, "density {sigma}");
    }
    // The wall becomes a mirror, and what it shows is behind the camera.
    let mut desc = wall();
    desc.bsdfs[0] = ConductorDesc {
        eta: Spectrum::Constant(0.0),
        k: Spectrum::Constant(1.0),
        specular_reflectance: Spectrum::Constant(1.0).into(),
    }
    .into();
    let matt = material(&mut desc, grey(WALL));
    let behind = DAffine3::from_translation(DVec3::new(0.0, 0.0, 5.0))
        * DAffine3::from_rotation_x(std::f64::consts::PI)
        * DAffine3::from_scale(DVec3::splat(4.0));
    shape(&mut desc, ShapeKind::Rectangle, behind, matt, 0.0);
    let clear = seen(&desc);
    near(clear.distance, 8.0, "to the mirror and back");
    let sigma = 0.3f64;
    add_slab(&mut desc, sigma as f32, 1.0);
    let found = seen(&desc);
    // The mirror reflects the share `mirror`; the slab is passed at 1 to 2 and at 4 to 5.
    let mirror = f64::from(clear.albedo.x) / f64::from(WALL);
    let (once, twice) = ((-sigma).exp(), (-2.0 * sigma).exp());
    let shares = [1.0 - once, once * mirror * (1.0 - once), twice * mirror];
    let all: f64 = shares.iter().sum();
    let inside = mean_distance(sigma, 1.0);
    let distances = [1.0 + inside, 4.0 + inside, 8.0];
    let expected = shares.iter().zip(distances).map(|(share, d)| share * d).sum::<f64>() / all;
    near(found.distance, expected, "mean distance");
    near(found.normal.length(), shares[2] / all, "share of the wall");
    let albedo = shares[0] + shares[1] + shares[2] * f64::from(WALL);
    near(found.albedo.x, albedo, "albedo");
    assert!(found.is_detached && clear.is_detached && found.normal.dot(Vec3::NEG_Z) > 0.0, "{found:?}");
}

/// Takes no samples: only the record of paths counts.
struct Ignored;

impl SampleSink for Ignored {
    fn camera(&mut self, _: [f32; 2], _: Xyz, _: f32) {}
    fn light(&mut self, _: [f32; 2], _: Xyz) {}
}

/// Counts the segments of recorded paths that boundaries interrupt, and asserts that each leads from the vertex before straight to its end.
fn interrupted<I: Integrator + From<RenderContext>>(context: &RenderContext) -> usize {
    let (tracer, mut scratch, mut trail, mut count) =
        (I::from(context.clone()), I::Scratch::default(), Trail::default(), 0);
    // Paths split into branches from the index 8192 on.
    for index in (0..200).chain(1 << 14..(1 << 14) + 200) {
        for event in recorded(|| tracer.trace(index, &mut scratch, &mut Ignored)) {
            match event {
                PathEvent::Begins(_) => trail.clear(),
                PathEvent::Meets(carried, hit) => {
                    let p = hit.point.p;
                    let Some(from) = trail.meets(&carried, p) else { continue };
                    let length = p.distance(from);
                    count += usize::from(hit.hit.t < 0.99 * length);
                    let beside = (from - p - hit.wo * length).length();
                    assert!(beside <= 1e-3 * length.max(0.01), "index {index}: {beside} beside {length}");
                }
                _ => {}
            }
        }
    }
    count
}

/// Segments of recorded paths begin at the vertex before, across boundaries and in branches.
#[test]
fn segments_begin_at_the_vertex_before() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/fog.xml");
    let desc = scene::load(&path, &[]).expect("the scene is valid").desc;
    let camera = Camera::of(&desc).expect("the camera is valid");
    let scene = Arc::new(prepare(&desc).recorded());
    let context = RenderContext::new(scene, camera, &desc.integrator, 3, UvWindow::PICTURE);
    // The air of the room ends before the walls do.
    assert!(interrupted::<PathTracer>(&context) > 10);
    assert!(interrupted::<BidirectionalTracer>(&context) > 10);
}
