//! One bad value among good ones.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use pointillist::color::Xyz;
use pointillist::scene::desc::{IntegratorDesc, LightDesc, Place, SceneDesc};
use pointillist::scene::load;
use pointillist::spectrum::Spectrum;
use pointillist::stream::{SampleSink, UvWindow, faults};
use pointillist::tracer::integrator::{
    BidirectionalTracer, PathTracer, PhotonScratch, PhotonTracer, RenderContext, SeesPhotons,
};
use pointillist::tracer::{Camera, Integrator, Scene};

use crate::Row;
use crate::support::scenes;

const PATHS: u64 = 20_000;

/// A grey ball in an even sky of radiance 1, and beside it a lamp so bright that no number holds what it contributes.
fn ball_and_lamp() -> SceneDesc {
    let mut desc = scenes::empty();
    desc.camera = scenes::look(DVec3::new(0.0, 0.0, -4.0), DVec3::Z, 10.0);
    let grey = scenes::material(&mut desc, scenes::grey(0.5));
    scenes::shape(&mut desc, scenes::sphere(DVec3::ZERO, 1.0), DAffine3::IDENTITY, grey, 0.0);
    desc.lights.push(LightDesc::Constant { radiance: Spectrum::Constant(1.0), place: Place::default() });
    let position = DVec3::new(0.0, 2.0, -2.0);
    desc.lights.push(LightDesc::Point {
        position,
        intensity: Spectrum::Constant(f32::MAX),
        place: Place::default(),
    });
    desc
}

/// Sums of luminance over camera samples: of all, and of those of paths that raised no fault.
#[derive(Default)]
struct Sums {
    all: Cell<f64>,
    pending: Cell<f64>,
    clean: Cell<f64>,
}

impl SampleSink for &Sums {
    fn camera(&mut self, _: [f32; 2], value: Xyz, _: f32) {
        assert!(value.is_finite(), "{value:?}");
        self.all.set(self.all.get() + f64::from(value.y));
        self.pending.set(self.pending.get() + f64::from(value.y));
    }

    fn light(&mut self, _: [f32; 2], _: Xyz) {}
}

/// Mean luminance, and the same if a fault rejects the whole path; how many faults.
fn means<I: Integrator>(tracer: &I) -> ([f64; 2], usize) {
    let (sums, mut scratch, mut count) = (Sums::default(), I::Scratch::default(), 0);
    let camera_paths = tracer.paths_per_index().camera;
    for index in 0..PATHS / camera_paths {
        tracer.trace(index, &mut scratch, &mut &sums);
        let raised = faults::take();
        let (value, _) = (sums.pending.replace(0.0), count += raised.len());
        if raised.is_empty() {
            sums.clean.set(sums.clean.get() + value);
        }
    }
    ([sums.all.get(), sums.clean.get()].map(|sum| sum / PATHS as f64), count)
}

/// A light sample that is not finite is left out and counted; what else a path finds stays.
#[test]
fn b12_one_bad_light_sample() {
    let desc = ball_and_lamp();
    let (scene, camera) = (Arc::new(Scene::prepare(&desc).unwrap()), Camera::of(&desc).unwrap());
    let unlimited = IntegratorDesc::default();
    let context = RenderContext::new(scene, camera, &unlimited, 0, UvWindow::PICTURE);
    let of = |name: &str, ([all, clean], count): ([f64; 2], usize)| {
        assert!(count as u64 > PATHS / 20, "{name}: only {count} faults");
        Row {
            case: &format!("B12 a lamp too bright for any number beside a sky, {name}"),
            measure: "error of what the sky shows",
            // A surface of albedo ½ in a sky of radiance 1 has radiance ½; Y of radiance 1 at all wavelengths is 1.
            figure: (all / 0.5 - 1.0).abs(),
            naive: ("the whole path is rejected", (clean / 0.5 - 1.0).abs()),
            bound: 0.02,
        }
        .check();
    };
    of("Path", means(&PathTracer::from(context.clone())));
    of("Bidirectional", means(&BidirectionalTracer::from(context.clone())));
    of("Photon", means(&PhotonTracer::from(context)));
}

/// A surface whose albedo is no number costs the connections and light samples of its own vertices, and nothing else: it is black.
#[test]
fn b11_one_bad_surface() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell.xml");
    let mut desc = load(&file, &[]).unwrap().desc;
    let bad = scenes::material(&mut desc, scenes::grey(0.0));
    desc.shapes.iter_mut().find(|shape| shape.emission.is_none()).unwrap().bsdf = bad;
    let context = |albedo: f32| {
        let mut desc = desc.clone();
        desc.bsdfs[bad.0 as usize] = scenes::grey(albedo);
        let (scene, camera) = (Arc::new(Scene::prepare(&desc).unwrap()), Camera::of(&desc).unwrap());
        RenderContext::new(scene, camera, &IntegratorDesc::default(), 0, UvWindow::PICTURE)
    };
    let of = |name: &str, (black, none): ([f64; 2], usize), ([all, clean], count): ([f64; 2], usize)| {
        assert!(none == 0 && count as u64 > PATHS / 20, "{name}: {none} and {count} faults");
        Row {
            case: &format!("B11 Cornell box with a wall whose albedo is no number, {name}"),
            measure: "difference of the mean to that with a black wall",
            figure: (all / black[0] - 1.0).abs(),
            naive: ("the whole path is rejected", (clean / black[0] - 1.0).abs()),
            bound: 1e-3,
        }
        .check();
    };
    of("Path", means(&PathTracer::from(context(0.0))), means(&PathTracer::from(context(f32::NAN))));
    let bidirectional = |albedo| means(&BidirectionalTracer::from(context(albedo)));
    of("Bidirectional", bidirectional(0.0), bidirectional(f32::NAN));
}

/// The last sample of the camera stream.
struct Last(Xyz);

impl SampleSink for Last {
    fn camera(&mut self, _: [f32; 2], value: Xyz, _: f32) {
        self.0 = value;
    }

    fn light(&mut self, _: [f32; 2], _: Xyz) {}
}

/// A sample of photon mapping sees the newest photons. Traced again with as many generations of them it is the same, bit for bit; by its
/// index alone it sees those that the index demands.
#[test]
fn b8_photons_are_seen_again() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell_spheres.xml");
    let desc = load(&file, &[]).unwrap().desc;
    let (scene, camera) = (Arc::new(Scene::prepare(&desc).unwrap()), Camera::of(&desc).unwrap());
    let context = RenderContext::new(scene, camera, &desc.integrator, 0, UvWindow::PICTURE);
    let value = |tracer: &PhotonTracer, scratch: &mut PhotonScratch, index| {
        let mut last = Last(Xyz::BLACK);
        tracer.trace(index, scratch, &mut last);
        [last.0.x, last.0.y, last.0.z].map(f32::to_bits)
    };
    let (render, mut scratch) = (PhotonTracer::new(context.clone(), false), PhotonScratch::default());
    // Begun far out in the sequence, where more photons are demanded.
    for index in 40_000..44_000 {
        value(&render, &mut scratch, index);
    }
    let indices = 0..256;
    let seen: Vec<_> = indices
        .clone()
        .map(|index| (value(&render, &mut scratch, index), faults::generations().unwrap()))
        .collect();
    assert!(seen.iter().all(|(_, generations)| *generations > 1), "the map has not grown");
    // As few tracers as there are generations: each grows its photons anew.
    let differ = |again: &dyn Fn(u64) -> PhotonTracer| {
        let mut tracers = BTreeMap::new();
        let other = |(index, (before, generations)): &(u64, &([u32; 3], u64))| {
            let (tracer, scratch) = tracers
                .entry(*generations)
                .or_insert_with(|| (again(*generations), PhotonScratch::default()));
            value(tracer, scratch, *index) != *before
        };
        indices.clone().zip(&seen).filter(other).count() as f64 / seen.len() as f64
    };
    let new = || PhotonTracer::new(context.clone(), true);
    Row {
        case: "B8 256 samples of photon mapping traced again",
        measure: "share that differs by a bit",
        figure: differ(&|generations| new().seeing(generations)),
        naive: ("by the index alone", differ(&|_| new())),
        bound: 0.0,
    }
    .check();
}
