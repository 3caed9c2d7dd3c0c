//! Photon mapping against path tracing and closed forms, within its bias; and against itself, bit for bit.

use std::sync::Arc;

use glam::{DAffine3, DVec3};

use crate::support::agreement::{Method, PathReference, Plan, measure};
use crate::support::scenes::*;
use crate::support::synthetic::{gather_in, render_all};
use pointillist::scene::desc::*;
use pointillist::server::{RenderJob, Server};
use pointillist::spectrum::{Spectrum, dispersion::Ior};
use pointillist::stream::{DrainOrder, Epoch, FinishReason, UvWindow};
use pointillist::tracer::Camera;
use pointillist::tracer::integrator::{PhotonTracer, RenderContext};

const PLAN: Plan = Plan { side: 16, paths_per_pixel: 128, seeds: 16, window: UvWindow::PICTURE };

fn scene(name: &str) -> SceneDesc {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    let mut desc = pointillist::scene::load(&path, &[]).expect("the scene can be read").desc;
    (desc.film.width, desc.film.height) = (16, 16);
    desc
}

/// The pictures agree in their mean within `bias` (besides noise), and in `share` of the pixels.
fn assert_within(desc: &SceneDesc, plan: Plan, share: f64, bias: f64) {
    let test = PathReference::new(desc, plan).compare(Method::Photon);
    let off = (test.mean_ratio - 1.0).abs();
    assert!(off <= 4.0 * test.mean_ratio_error + bias, "{test:?}");
    assert!(test.accepted >= share, "{test:?}");
}

/// 32 768 samples of each seed: two generations. The corners of the box are too dark by what a first disc of half a metre
/// misses behind them.
#[test]
fn cornell_box() {
    assert_within(&scene("cornell.xml"), PLAN, 0.9, 0.006);
}

#[test]
fn glass_and_mirror() {
    assert_within(&scene("cornell_spheres.xml"), PLAN, 0.9, 0.01);
}

/// Photons are not gathered on rough metal and rough glass: paths go on through them from both ends.
#[test]
fn rough_metal_and_glass() {
    // 262 144 samples of each seed. With 32 768 the bias of photon mapping shows in 27 of the 256 pixels, whichever reference they are
    // compared with (path tracing, or eight times as many paths of it or from both ends), with 262 144 in 21, at a tenth of the variance.
    let plan = Plan { paths_per_pixel: 1024, ..PLAN };
    assert_within(&scene("rough.xml"), plan, 0.9, 0.02);
}

/// A floor under a sheet of glass of index 1, which changes nothing but that no light can be sampled through it: the
/// picture is that without the sheet. All light on the floor is a caustic seen through a delta, from a lamp that
/// nothing can meet.
#[test]
fn caustic_seen_through_glass() {
    let blind = measure(&lamp_over_floor(true), Method::Path, Plan { seeds: 4, ..PLAN });
    assert_eq!(blind.mean.iter().sum::<f64>(), 0.0, "path tracing cannot see it");
    let bare = measure(&lamp_over_floor(false), Method::Path, PLAN);
    // Under the lamp, 2.5 m above, a disc of radius r is darker than its middle by r² / h²: 2 % in the first generation, and
    // the mean of 1/g of that over 16. With light paths in the order of the sequence 2.1 % would remain (`emit`).
    let plan = Plan { paths_per_pixel: 1024, seeds: 8, ..PLAN };
    let through = measure(&lamp_over_floor(true), Method::Photon, plan);
    let test = pointillist::image::compare::z_test(&through, &bare, 0.01).expect("equal sizes");
    println!("{test:?}");
    let bound = 4.0 * test.mean_ratio_error + 0.004;
    assert!(bound < 0.018, "the noise hides what the test is for: {test:?}");
    assert!((test.mean_ratio - 1.0).abs() < bound, "{test:?}");
}

/// Camera paths through dispersive glass carry one wavelength, and take the photons near it.
#[test]
fn dispersion() {
    let mut desc = empty();
    desc.camera = look(DVec3::new(0.0, -4.0, 3.0), DVec3::new(0.0, 4.0, -2.8), 40.0);
    (desc.film.width, desc.film.height) = (16, 16);
    let white = material(&mut desc, grey(0.7));
    shape(&mut desc, ShapeKind::Rectangle, DAffine3::from_scale(DVec3::splat(3.0)), white, 0.0);
    let flint =
        material(&mut desc, glass(Ior::named("sf11").or_else(|| Ior::named("bk7")).expect("a glass")));
    shape(&mut desc, sphere(DVec3::new(0.0, 0.0, 0.9), 0.9), DAffine3::IDENTITY, flint, 0.0);
    environment(&mut desc);
    assert_within(&desc, PLAN, 0.9, 0.02);
    // Ground so finely that wavelengths have parted as if it were smooth.
    let sf11 = Ior::named("sf11").expect("a named glass");
    let (int_ior, ext_ior) = (sf11, Ior::Constant(1.0));
    let roughness = Roughness { facets: Facets::Ggx, alpha: [1e-3; 2] };
    let [specular_reflectance, specular_transmittance] = [(); 2].map(|()| Spectrum::Constant(1.0).into());
    let ground = BsdfDesc::RoughDielectric(RoughDielectricDesc {
        int_ior,
        ext_ior,
        specular_reflectance,
        specular_transmittance,
        roughness,
        alpha: None,
    });
    desc.bsdfs[1] = ground;
    assert_within(&desc, PLAN, 0.9, 0.02);
}

/// A picture from another camera reuses the photons of the one before.
#[test]
fn photons_outlast_a_move_of_the_camera() {
    let desc = scene("cornell.xml");
    let scene = Arc::new(prepare(&desc));
    let tracer = |seed, deterministic| {
        let camera = Camera::of(&desc).expect("valid");
        let context = RenderContext::new(scene.clone(), camera, &desc.integrator, seed, UvWindow::PICTURE);
        PhotonTracer::new(context, deterministic)
    };
    let first = tracer(0, false);
    let _ = render_all(1, RenderJob::new(Arc::new(first.clone()), 0..100));
    let paths = |t: &PhotonTracer| t.map.latest().light_paths;
    assert!(paths(&first) > 0);
    assert_eq!(paths(&tracer(0, false).after(&first)), paths(&first));
    for other in [tracer(1, false), tracer(0, true)] {
        assert_eq!(paths(&other.after(&first)), 0);
    }
}

/// Depths are counted alike by camera paths, light paths and both together, and lights may be hidden. The edges of the
/// mirror's caustics are blurred.
#[test]
fn settings() {
    let mut desc = scene("cornell_spheres.xml");
    let plan = Plan { paths_per_pixel: 64, ..PLAN };
    for (max_depth, hide_emitters) in [(Some(1), false), (Some(2), true), (Some(3), false), (Some(4), true)] {
        desc.integrator.max_depth = max_depth;
        desc.integrator.hide_emitters = hide_emitters;
        println!("{max_depth:?} {hide_emitters}");
        assert_within(&desc, plan, 0.8, 0.01);
    }
}

/// Inside a closed sphere that emits 1 and reflects half, radiance is 2: the disc's area is that of the cap that photons
/// are found in, so nothing but noise remains. In a cube the edges are too dark. A white ball in a uniform
/// environment cannot be seen.
#[test]
fn furnaces() {
    let closed = |kind: ShapeKind, scale: DVec3| {
        let mut desc = empty();
        desc.camera.perspective_mut().unwrap().fov = 70.0;
        let m = material(&mut desc, grey(0.5));
        shape(&mut desc, kind, DAffine3::from_scale(scale), m, 1.0);
        desc.shapes[0].flip_normals = true;
        desc
    };
    let mut ball = empty();
    ball.camera.perspective_mut().unwrap().fov = 50.0;
    let white = material(&mut ball, grey(1.0));
    shape(&mut ball, sphere(DVec3::Z * 3.0, 1.0), DAffine3::IDENTITY, white, 0.0);
    environment(&mut ball);
    let room = closed(sphere(DVec3::new(0.1, 0.0, 0.2), 1.0), DVec3::ONE);
    let cube = closed(ShapeKind::Cube, DVec3::new(1.0, 1.5, 2.0));
    for (name, desc, expected, bias) in
        [("sphere", room, 2.0, 0.002), ("cube", cube, 2.0, 0.01), ("ball", ball, 1.0, 0.0)]
    {
        let found = measure(&desc, Method::Photon, Plan { side: 8, paths_per_pixel: 512, ..PLAN });
        let pixels = found.mean.len() as f64;
        let mean = found.mean.iter().sum::<f64>() / pixels;
        let error = found.variance.iter().sum::<f64>().sqrt() / pixels;
        println!("{name}: {mean} ± {error}");
        // Without colour there is hardly any noise left; rounding remains.
        let most = 4.0 * error + (bias + 1e-6) * expected;
        assert!((mean - expected).abs() <= most, "{name}: {mean} ± {error}");
        assert!(error < 0.01 * expected, "{name}: the case is too easy: ± {error}");
    }
}

/// Photons at which the maps of the following tests stop growing: after about half of their samples.
const LIMIT: usize = 15_000;

fn tracer_of(desc: &SceneDesc) -> Arc<PhotonTracer> {
    let camera = Camera::of(desc).expect("the camera is valid");
    let context = RenderContext::new(Arc::new(prepare(desc)), camera, &desc.integrator, 5, UvWindow::PICTURE);
    let tracer = PhotonTracer::new(context, true);
    // Small generations: the range of these tests has many.
    let schedule = tracer.schedule;
    let schedule = pointillist::tracer::photon_map::Schedule {
        paths_per_generation: 512,
        samples_per_generation: 1500,
        ..schedule
    };
    Arc::new(tracer.with_schedule(schedule, LIMIT))
}

/// Bit for bit, for any number of threads, past the limit of the map; with the glass that it takes for caustic photons.
#[test]
fn pictures_do_not_depend_on_the_number_of_threads() {
    let desc = scene("cornell_spheres.xml");
    let mut expected = None;
    for threads in [1, 2, 3] {
        let (server, mut lanes) = Server::start(threads).expect("threads");
        let tracer = tracer_of(&desc);
        let job = RenderJob { deadline: None, ..RenderJob::new(tracer.clone(), 100..40_000) };
        server.render(job, Epoch(4)).expect("first epoch");
        let order = DrainOrder::Index { first: 100 };
        let (got, reason) = gather_in(order, &server, &mut lanes, Epoch(4));
        assert_eq!((reason, lanes.next_index()), (FinishReason::Complete, 40_000));
        let generations = tracer.map.latest().generations;
        assert!(
            (5..25).contains(&generations),
            "{generations} generations: the limit was not met on the way"
        );
        let sequence = got.sequence();
        assert!(sequence == *expected.get_or_insert(sequence.clone()), "{threads} threads");
    }
}

/// Ranges rendered apart, each with a map of its own, are the samples of the whole.
#[test]
fn ranges_rendered_apart_fit_together() {
    let desc = scene("cornell_spheres.xml");
    let render = |range, threads| {
        let (got, reason) = render_all(threads, RenderJob::new(tracer_of(&desc), range));
        assert_eq!(reason, FinishReason::Complete);
        got.multiset()
    };
    let whole = render(0..20_000, 2);
    let mut pieces = [render(12_345..20_000, 2), render(0..12_345, 1)].concat();
    pieces.sort_unstable();
    assert!(pieces == whole);
}
