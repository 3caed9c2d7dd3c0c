//! Tests of `tracer::integrator::check`.

use pointillist::color::Xyz;
use pointillist::scene::load_str;
use pointillist::stream::SampleSink;
use pointillist::stream::UvWindow;
use pointillist::tracer::Scene;
use pointillist::tracer::effects::{Effect, without};
use pointillist::tracer::integrator::*;
use pointillist::tracer::integrator::{Integrator, RenderContext};
use pointillist::tracer::{Camera, PathTracer};
use std::sync::Arc;

/// Counts samples.
#[derive(Default)]
struct CountingSink(u64);

impl SampleSink for CountingSink {
    fn camera(&mut self, _: [f32; 2], _: Xyz, _: f32) {
        self.0 += 1;
    }

    fn light(&mut self, _: [f32; 2], _: Xyz) {
        self.0 += 1;
    }
}

const PRISM: &str = "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='30'/>\
    <transform name='to_world'><lookat origin='0, 0, -6' target='0, 0, 0' up='0, 1, 0'/></transform></sensor>\
    <shape type='sphere'><bsdf type='dielectric'><string name='int_ior' value='bk7'/></bsdf></shape>\
    <shape type='rectangle'><transform name='to_world'><rotate y='1' angle='180'/><translate x='1' z='3'/></transform>\
    <emitter type='area'><rgb name='radiance' value='5, 4, 3'/></emitter></shape></scene>";

/// A plan that forgets one of `forgotten`.
fn checked(forgotten: &[Effect], share: f64) -> CheckedIntegrator<PathTracer> {
    let desc = load_str("check.xml", PRISM, &[]).expect("a scene").desc;
    let mut less = desc.clone();
    forgotten.iter().for_each(|effect| without(&mut less, *effect).expect("possible"));
    let scene = |desc| Arc::new(Scene::prepare(desc).expect("a scene"));
    let camera = Camera::of(&desc).expect("a camera");
    let context = RenderContext::new(scene(&less), camera, &desc.integrator, 0, UvWindow::PICTURE);
    CheckedIntegrator::new(context, Arc::new(Scene::prepare_general(&desc).expect("a scene")), share)
}

#[test]
fn a_wrong_plan_is_refuted() {
    let trace = |checked: &CheckedIntegrator<PathTracer>, count| {
        let mut samples = CountingSink::default();
        (0..count).for_each(|index| checked.trace(index, &mut Default::default(), &mut samples));
        samples.0
    };
    let right = checked(&[], 1.0);
    assert_eq!((trace(&right, 4000), right.tally().counts()), (4000, [4000, 0]));
    for effect in [Effect::Dispersion, Effect::Transmission, Effect::Deltas] {
        let wrong = checked(&[effect], 1.0);
        let caught = std::panic::catch_unwind(|| trace(&wrong, 4000));
        let message = *caught.expect_err("it differs").downcast::<String>().expect("words");
        assert!(message.contains("refuted by 1 of") && message.contains("everything"), "{message}");
        let (first, last) = wrong.tally().reach().expect("one differs");
        assert_eq!((first, wrong.tally().counts()), (last, [first + 1, 1]));
    }
    // A hundredth of the paths is a hundredth of the paths.
    let some = checked(&[], 0.01);
    trace(&some, 100_000);
    assert!((900..1100).contains(&some.tally().counts()[0]), "{:?}", some.tally());
}
