//! Every integrator takes the random numbers of its camera paths by visits to the cells of its picture.

use std::collections::HashSet;

use pointillist::color::Xyz;
use pointillist::stream::{SampleSink, UvWindow};
use pointillist::tracer::integrator::{
    BidirectionalTracer, Integrator, PathTracer, PhotonTracer, RenderContext, Replicated,
};
use pointillist::tracer::{Camera, Scene};

/// Binary logarithm of the side of the picture.
const BITS: u32 = 6;

/// Camera paths of one index of bidirectional path tracing and of one group.
const BOTH_ENDS: (u64, u64) = (8, 32);

fn context(size: u32) -> RenderContext {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell.xml");
    let desc = pointillist::scene::load(&path, &[]).expect("the scene can be read").desc;
    let (scene, camera) = (Scene::prepare(&desc).unwrap().into(), Camera::of(&desc).unwrap());
    RenderContext::new(scene, camera, &desc.integrator, 2, UvWindow::PICTURE).of_size([size; 2])
}

#[derive(Default)]
struct Values(Vec<Xyz>);

impl SampleSink for Values {
    fn camera(&mut self, _: [f32; 2], value: Xyz, _: f32) {
        self.0.push(value);
    }
    fn light(&mut self, _: [f32; 2], _: Xyz) {}
}

/// In the first visit pictures have the same samples that take the same part of the sequence; in later ones each has its own.
fn depends_on_visits<I: Integrator>(make: impl Fn(RenderContext) -> I, paths_per_index: u64) {
    let trace = |size: u32, first: u64| {
        let (tracer, mut scratch, mut values) =
            (make(context(size)), I::Scratch::default(), Values::default());
        let first = first / paths_per_index;
        (first..first + 64 / paths_per_index)
            .for_each(|index| tracer.trace(index, &mut scratch, &mut values));
        values.0
    };
    // Both take the whole screen of the sequence.
    let (small, large) = (1 << BITS, 1 << (2 * BITS));
    assert_eq!(trace(small, 0), trace(large, 0));
    let (a, b) = (trace(small, 4 << (2 * BITS)), trace(large, 4 << (2 * BITS)));
    let same = a.iter().zip(&b).filter(|(a, b)| a == b).count();
    // A path that takes no number of a padded block is the same.
    assert!(same < a.len() * 3 / 4, "{same} of {} samples are the same", a.len());
}

#[test]
fn paths_depend_on_visits() {
    depends_on_visits(PathTracer::from, 1);
}

#[test]
fn paths_from_both_ends_depend_on_visits() {
    depends_on_visits(BidirectionalTracer::from, BOTH_ENDS.0);
}

#[test]
fn gathering_paths_depend_on_visits() {
    depends_on_visits(|context| PhotonTracer::new(context, true), 1);
}

/// The groups that visit a pixel, eight in a row, have one wavelength in each eighth. Of groups that happen to come next they have not.
#[test]
fn groups_of_a_pixel_have_stratified_wavelengths() {
    let context = context(1 << BITS);
    let (per_index, per_group) = BOTH_ENDS;
    let groups_per_visit = (1 << (2 * BITS)) / per_group;
    let wavelength =
        |group: u64| BidirectionalTracer::wavelength_number(group * per_group / per_index, &context);
    let eighths = |groups: &[u64]| {
        groups.iter().map(|&group| (8.0 * wavelength(group)) as u32).collect::<HashSet<u32>>().len()
    };
    let bits = per_group.trailing_zeros();
    let seed = |group: u64| context.cells.visit_of_group(group, bits, context.seed).seed;
    let groups = 8 * groups_per_visit..16 * groups_per_visit;
    let mut by_chance = 0;
    for first in 8 * groups_per_visit..9 * groups_per_visit {
        let own: Vec<u64> = groups.clone().filter(|&group| seed(group) == seed(first)).collect();
        assert_eq!((own.len(), eighths(&own)), (8, 8), "the groups of {first}");
        let next: Vec<u64> = (first..first + 8).collect();
        by_chance += usize::from(eighths(&next) == 8);
    }
    assert!(by_chance <= 2, "{by_chance}");
}

/// The two randomisations of a picture share out its pixels: at one sample per pixel each has one.
#[test]
fn one_sample_per_pixel_is_one_in_each() {
    const SIDE: usize = 64;

    struct Counts(Vec<u32>);

    impl SampleSink for Counts {
        fn camera(&mut self, uv: [f32; 2], _: Xyz, _: f32) {
            let [x, y] = uv.map(|c| (c * SIDE as f32) as usize);
            self.0[y * SIDE + x] += 1;
        }
        fn light(&mut self, _: [f32; 2], _: Xyz) {}
    }

    let tracer = Replicated::new(&context(SIDE as u32), true, PathTracer::from);
    let mut counts = Counts(vec![0; SIDE * SIDE]);
    (0..(SIDE * SIDE) as u64).for_each(|index| tracer.trace(index, &mut Default::default(), &mut counts));
    assert!(counts.0.iter().all(|count| *count == 1), "{:?}", counts.0);
}
