//! The energy audit: what is emitted is absorbed or escapes.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DAffine3, DQuat, DVec3};

use pointillist::scene::desc::{SceneDesc, ShapeKind};
use pointillist::scene::{load, load_str};
use pointillist::spectrum::Spectrum;
use pointillist::spectrum::dispersion::Ior;
use pointillist::stream::UvWindow;
use pointillist::tracer::bsdf::{InMedia, ScatteringModel};
use pointillist::tracer::integrator::RenderContext;
use pointillist::tracer::medium::MediumIndex;
use pointillist::tracer::subpath::{Subpath, SubpathVertex};
use pointillist::tracer::{Camera, Sampler, Scene};

use crate::Row;
use crate::support::agreement::Method;
use crate::support::audit::{Audit, AuditPlan, Balance, audit, audit_of_media};
use crate::support::scenes::{empty, glass, grey, look, material, shape, sphere};

const PLAN: AuditPlan = AuditPlan { indices: 8192, seeds: 32, clear: true };

fn cornell_spheres_file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell_spheres.xml")
}

fn cornell_spheres() -> SceneDesc {
    load(&cornell_spheres_file(), &[]).unwrap().desc
}

/// What a walk forgets.
#[derive(Clone, Copy, PartialEq)]
enum Forgotten {
    /// That refraction scales radiance and not flux.
    Adjoint,
    /// To divide by the probability of survival.
    Reweighting,
}

/// The audit of walks over the vertices that the methods walk over, where each step is tampered with.
fn naive<const FROM_LIGHT: bool>(desc: &SceneDesc, forgotten: Forgotten) -> f64 {
    let scene = Arc::new(Scene::prepare(desc).unwrap());
    let camera = Camera::of(desc).unwrap();
    let books = |seed: u32| {
        let context =
            RenderContext::new(scene.clone(), camera.clone(), &desc.integrator, seed, UvWindow::PICTURE);
        let mut audit = Audit::new(u64::from(seed), PLAN.clear);
        for index in 0..PLAN.indices {
            naive_path::<FROM_LIGHT>(&context, index, forgotten, &mut audit);
        }
        if FROM_LIGHT { audit.light } else { audit.camera }
    };
    let all: Vec<_> = (0..PLAN.seeds).map(books).collect();
    Balance::of(&all, PLAN.indices as f64).unwrap().distance()
}

fn naive_path<const FROM_LIGHT: bool>(
    context: &RenderContext,
    index: u64,
    forgotten: Forgotten,
    audit: &mut Audit,
) {
    let RenderContext { scene, camera, seed, .. } = context;
    let sampler = Sampler::at(index, *seed);
    let lambda = pointillist::spectrum::SampledWavelengths::sample(sampler.camera().wavelength);
    if FROM_LIGHT {
        let numbers = sampler.light();
        let Some(emission) = scene.lights().emit(&numbers.emission()) else { return };
        let emitted = scene.lights().emitted(&emission, &lambda);
        let Some(subpath) = Subpath::from_light(lambda, &emission, emitted, MediumIndex::VACUUM) else {
            return;
        };
        let vertex = |depth| numbers.vertex(depth);
        naive_walk(scene, subpath, emission.ray(), vertex, forgotten, audit);
    } else {
        let numbers = sampler.camera();
        let ray = camera.ray(numbers.screen, numbers.lens).unwrap();
        let subpath = Subpath::from_camera(lambda, Some(ray.origin), 1.0, 1.0, MediumIndex::VACUUM);
        naive_walk(scene, subpath, ray, |depth| sampler.vertex(depth), forgotten, audit);
    }
}

fn naive_walk<const FROM_LIGHT: bool>(
    scene: &Scene,
    mut subpath: Subpath<FROM_LIGHT>,
    mut ray: pointillist::tracer::accel::Ray,
    numbers: impl Fn(u32) -> pointillist::tracer::sampler::VertexNumbers,
    forgotten: Forgotten,
    audit: &mut Audit,
) {
    audit.begins((&subpath.walk).into());
    while let Some(hit) = scene.closest(&ray) {
        let vertex: SubpathVertex<InMedia> = subpath.arrive(scene, hit);
        audit.meets((&subpath.walk).into(), &vertex.surface);
        let u = numbers(subpath.walk.depth - 1);
        // No roulette arms before the first segment.
        let mut whole = subpath.clone();
        whole.walk.depth = 0;
        let survived = whole.scatter(&vertex, &u, u32::MAX).is_some();
        let Some(next) = subpath.scatter(&vertex, &u, 5) else { return };
        match forgotten {
            Forgotten::Reweighting if survived => subpath.walk.throughput = whole.walk.throughput,
            Forgotten::Adjoint if vertex.surface.bsdf.is_delta() => {
                let surface = &vertex.surface;
                let sample = surface.bsdf.sample_from_light(surface.wo, u.bsdf, u.lobe).unwrap();
                subpath.walk.throughput *= 1.0 / sample.eta2;
            }
            _ => {}
        }
        ray = next;
    }
    audit.leaves((&subpath.walk).into());
}

/// Checks the books of a scene by each of these methods.
fn check(scene: &str, desc: &SceneDesc, methods: &[Method], naive: impl Fn(bool) -> (&'static str, f64)) {
    for &method in methods {
        for (from_light, balance) in [false, true].into_iter().zip(audit(desc, method, PLAN)) {
            let Some(balance) = balance else { continue };
            println!("{method:?}, light {from_light}: {balance:?}");
            assert!(balance.error < 0.01, "{method:?}: the audit is too coarse: {balance:?}");
            let what = if from_light { "light" } else { "importance from the camera" };
            Row {
                case: &format!("N24 {scene}, {method:?}, {what}"),
                measure: "what is found nowhere, in standard errors",
                figure: balance.distance(),
                naive: naive(from_light),
                bound: 4.0,
            }
            .check();
        }
    }
}

/// A mirror ball and a ball of clear glass in a room: what roulette ends is made up for by what it spares. The books of either end
/// are balanced within four standard errors of 32 randomisations.
#[test]
fn n24_energy_audit_of_a_room() {
    let desc = cornell_spheres();
    let methods = [Method::Path, Method::Particle, Method::Bidirectional, Method::Photon];
    let [light, camera] =
        [naive::<true>(&desc, Forgotten::Reweighting), naive::<false>(&desc, Forgotten::Reweighting)];
    let naive = |from_light| ("roulette without division", if from_light { light } else { camera });
    check("Cornell box with spheres", &desc, &methods, naive);
}

/// A lamp within a ball of clear glass over a floor: refraction scales radiance by η² and leaves flux as it is.
#[test]
fn n24_energy_audit_of_a_lamp_in_glass() {
    let mut desc = empty();
    desc.camera = look(DVec3::new(0.0, -6.0, 0.5), DVec3::Y, 60.0);
    let bsdfs = [grey(0.5), glass(Ior::Constant(1.5)), grey(0.7)].map(|bsdf| material(&mut desc, bsdf));
    shape(&mut desc, sphere(DVec3::ZERO, 0.2), DAffine3::IDENTITY, bsdfs[0], 1.0);
    shape(&mut desc, sphere(DVec3::ZERO, 1.0), DAffine3::IDENTITY, bsdfs[1], 0.0);
    let floor = DAffine3::from_scale_rotation_translation(
        DVec3::new(3.0, 3.0, 1.0),
        DQuat::IDENTITY,
        DVec3::NEG_Z * 1.5,
    );
    shape(&mut desc, ShapeKind::Rectangle, floor, bsdfs[2], 0.0);
    let adjoint = naive::<true>(&desc, Forgotten::Adjoint);
    let methods = [Method::Particle, Method::Photon];
    check("lamp in a glass ball", &desc, &methods, |_| ("weights of radiance for flux", adjoint));
}

/// The room full of a fog that absorbs blue most, in which the clear ball holds milk: what flights through media, and boundaries between them,
/// take from a path is what media absorb.
#[test]
fn n24_energy_audit_of_a_room_full_of_fog() {
    let text = std::fs::read_to_string(cornell_spheres_file()).unwrap();
    let media = "<medium type='homogeneous' id='fog'><rgb name='sigma_t' value='.08 .1 .12'/><rgb name='albedo' value='.9 .8 .5'/>\
                 <phase type='hg'><float name='g' value='.6'/></phase></medium>\
                 <medium type='homogeneous' id='milk'><float name='sigma_t' value='2'/><float name='albedo' value='.95'/></medium>\
                 <shape type='cube'><transform name='to_world'><scale x='3' y='3' z='3'/><translate y='2.75'/></transform>\
                 <bsdf type='null'/><ref name='interior' id='fog'/></shape>";
    let sides = "<ref name='interior' id='milk'/><ref name='exterior' id='fog'/>";
    let glass = "<float name=\"ext_ior\" value=\"1\"/>\n    </bsdf>";
    let floor = "<shape type=\"rectangle\" id=\"floor\">";
    let path = "<integrator type=\"path\">";
    assert!([glass, floor, path].iter().all(|part| text.contains(part)));
    let text = text.replace(glass, &format!("{glass}{sides}")).replace(floor, &format!("{media}{floor}"));
    let text = text.replace(path, "<integrator type=\"volpath\">");
    let desc = load_str("fog.xml", &text, &[]).unwrap().desc;
    // As if what a medium scatters were all that came there.
    let mut without_loss = desc.clone();
    without_loss.media.iter_mut().for_each(|medium| medium.albedo = Spectrum::Constant(1.0).into());
    let short = AuditPlan { indices: PLAN.indices / 8, ..PLAN };
    for method in [Method::Path, Method::Particle, Method::Bidirectional, Method::Photon] {
        let naive =
            audit_of_media(&desc, &without_loss, method, short).map(|b| b.map_or(0.0, |b| b.distance()));
        check("room full of fog", &desc, &[method], |from_light| {
            ("a weight without the albedo", naive[usize::from(from_light)])
        });
    }
}

/// What light paths begin with is the power of the light: π times area times radiance. Without the cosine of the way out it would be
/// twice that.
#[test]
fn n24_emitted_power() {
    let desc = cornell_spheres();
    let lamp = desc.shapes.iter().find(|shape| shape.emission.is_some()).unwrap();
    assert_eq!(lamp.kind, ShapeKind::Rectangle);
    let [x, y] = [lamp.to_world.matrix3.x_axis, lamp.to_world.matrix3.y_axis];
    let radiance = f64::from(lamp.emission.as_ref().unwrap().luminance());
    let unit = desc.space.scale;
    let power = PI * 4.0 * x.cross(y).length() * radiance * unit * unit;
    for method in [Method::Particle, Method::Photon] {
        let [_, light] = audit(&desc, method, PLAN);
        let error = |emitted: f64| (emitted / power - 1.0).abs();
        let emitted = light.unwrap().emitted;
        Row {
            case: &format!("N24 Cornell box with spheres, {method:?}"),
            measure: "relative error of the emitted power",
            figure: error(emitted),
            naive: ("radiance uniform over the hemisphere", error(2.0 * emitted)),
            bound: 2e-3,
        }
        .check();
    }
}
