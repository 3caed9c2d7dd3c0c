//! The plan of effects changes no sample: the scene as planned, traced by special code, gives the samples of the same scene with every
//! effect on, traced by the general code, in every scene of `scenes/` and in random ones that combine everything.

use std::fs;
use std::path::Path;
use std::sync::{Arc, LazyLock};

use crate::support::bsdfs::{BSDFS, BsdfEntry};
use pointillist::color::Xyz;
use pointillist::scene::{SceneDesc, load, load_str};
use pointillist::stream::{SampleSink, UvWindow};
use pointillist::tracer::integrator::{
    BidirectionalTracer, CAMERA_SUBPATHS, CheckedIntegrator, ParticleTracer, PathTracer, PhotonTracer,
    RenderContext, VcmTracer,
};
use pointillist::tracer::{Camera, Integrator, Scene};
use proptest::prelude::*;

/// Counts samples, adds up luminance, and keeps the least and the most of x over y.
#[derive(Default)]
struct Sum {
    samples: u64,
    y: f64,
    squares: f64,
    colours: Option<[f32; 2]>,
}

impl SampleSink for Sum {
    fn camera(&mut self, _: [f32; 2], value: Xyz, _: f32) {
        self.samples += 1;
        self.y += f64::from(value.y);
        self.squares += f64::from(value.y).powi(2);
        if value.y > 0.0 {
            let colour = value.x / value.y;
            let [least, most] = self.colours.unwrap_or([colour; 2]);
            self.colours = Some([least.min(colour), most.max(colour)]);
        }
    }

    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        self.camera(uv, value, 1.0);
    }
}

fn render_context(desc: &SceneDesc, scene: Scene) -> RenderContext {
    RenderContext::new(Arc::new(scene), Camera::of(desc).unwrap(), &desc.integrator, 11, UvWindow::PICTURE)
}

/// Traces each of `count` indices twice and panics on a difference. Returns how many paths a rounding has decided.
fn checked<I: Integrator + From<RenderContext>>(
    context: &RenderContext,
    general: &Arc<Scene>,
    count: u64,
) -> u64 {
    let checked = CheckedIntegrator::<I>::new(context.clone(), general.clone(), 1.0);
    let mut scratch = Default::default();
    // Paths that split and the first ones, which do not.
    for index in (0..count / 2).chain(1 << 20..(1 << 20) + count / 2) {
        checked.trace(index, &mut scratch, &mut Sum::default());
    }
    let [compared, different] = checked.tally().counts();
    assert_eq!(compared, 2 * (count / 2));
    different
}

fn check_all(desc: &SceneDesc, count: u64) -> u64 {
    let context = render_context(desc, Scene::prepare(desc).unwrap());
    let general = &Arc::new(Scene::prepare_general(desc).unwrap());
    checked::<PathTracer>(&context, general, count)
        + checked::<ParticleTracer>(&context, general, count)
        + checked::<BidirectionalTracer>(&context, general, count / CAMERA_SUBPATHS)
}

/// Traces the first `count` indices in these scenes, all of whose light paths both sides trace, and finds no difference.
fn all_as_planned<I: Integrator + From<RenderContext>>(scenes: &[&str], count: u64) {
    for name in scenes {
        let desc = load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name), &[]).unwrap().desc;
        let context = render_context(&desc, Scene::prepare(&desc).unwrap());
        let general = Arc::new(Scene::prepare_general(&desc).unwrap());
        let checked = CheckedIntegrator::<I>::new(context, general, 1.0);
        let mut scratch = Default::default();
        (0..count).for_each(|index| checked.trace(index, &mut scratch, &mut Sum::default()));
        assert_eq!(checked.tally().counts(), [count, 0], "{name}");
    }
}

/// A sample of photon mapping is made of many paths.
#[test]
fn photons_are_as_planned() {
    all_as_planned::<PhotonTracer>(&["cornell.xml", "cornell_spheres.xml", "rough.xml"], 2000);
}

#[test]
fn merging_is_as_planned() {
    let scenes = ["cornell.xml", "cornell_spheres.xml", "rough.xml", "caustic.xml"];
    all_as_planned::<VcmTracer>(&scenes, 500);
}

#[test]
fn every_scene_is_as_planned() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let (mut special, mut classes) = (0, [0; 5]);
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "xml") {
            let desc = load(&path, &[]).unwrap().desc;
            let scene = Scene::prepare(&desc).unwrap();
            special += usize::from(scene.white().is_some());
            classes[scene.material_class() as usize] += 1;
            let different = check_all(&desc, 4096);
            assert!(different <= 1, "{different} paths of {} were decided by a rounding", path.display());
        }
    }
    // No scene mixes materials.
    let [diffuse, smooth, rough, _, in_media] = classes;
    assert!(
        special >= 1 && [diffuse, smooth, rough, in_media].iter().all(|n| *n >= 1),
        "not all special code is used: {classes:?}"
    );
}

/// A value, grey or coloured.
fn colour(grey: bool) -> BoxedStrategy<String> {
    if grey {
        (0.05..0.95f32).prop_map(|v| format!("{v}")).boxed()
    } else {
        (0.05..0.95f32, 0.05..0.95f32, 0.05..0.95f32).prop_map(|(r, g, b)| format!("{r}, {g}, {b}")).boxed()
    }
}

/// A plugin of the list with random values, and with one of its variants.
fn listed(entry: &'static BsdfEntry, grey: bool) -> BoxedStrategy<String> {
    // What is there and does nothing must not be taken for something that does.
    let black = Just("0".to_string());
    let colours = prop::collection::vec(prop_oneof![5 => colour(grey), 1 => black], entry.colours.len());
    let shares = prop::collection::vec(prop_oneof![Just(0.0f32), Just(1.0), 0.1..0.9f32], entry.shares.len());
    let alphas = prop::collection::vec(0.02..0.6f32, entry.alphas.len());
    let variants: Vec<&str> =
        entry.variants.iter().filter(|(_, coloured)| !(grey && *coloured)).map(|v| v.0).collect();
    let text = move |(colours, shares, alphas, variant): (Vec<String>, Vec<f32>, Vec<f32>, &str)| {
        let colours = entry.colours.iter().zip(colours);
        let colours: String = colours.map(|(name, v)| format!("<rgb name='{name}' value='{v}'/>")).collect();
        let numbers = entry.shares.iter().zip(shares).chain(entry.alphas.iter().zip(alphas));
        let numbers: String =
            numbers.map(|(name, v)| format!("<float name='{name}' value='{v}'/>")).collect();
        entry.with(&(variant.to_owned() + &colours + &numbers))
    };
    (colours, shares, alphas, prop::sample::select(variants)).prop_map(text).boxed()
}

/// Which materials a scene may have: matt ones, also smooth ones, also rough ones.
fn material(grey: bool, class: usize) -> BoxedStrategy<String> {
    // The list does not change while the tests run.
    static CLASSES: LazyLock<Vec<usize>> =
        LazyLock::new(|| BSDFS.iter().map(|b| b.class() as usize).collect());
    let of_class = BSDFS.iter().zip(CLASSES.iter()).filter(|(_, own)| **own <= class.min(2));
    let mut all: Vec<_> = of_class.map(|(entry, _)| listed(entry, grey)).collect();
    let matt = colour(grey)
        .prop_map(|v| format!("<bsdf type='diffuse'><rgb name='reflectance' value='{v}'/></bsdf>"));
    all.push(matt.prop_map(|bsdf| format!("<bsdf type='twosided'>{bsdf}</bsdf>")).boxed());
    let unseen = "<bsdf type='conductor'><rgb name='specular_reflectance' value='0'/></bsdf>";
    all.push(Just(unseen.to_string()).boxed());
    if class > 0 {
        all.push(Just("<bsdf type='null'/>".to_string()).boxed());
    }
    let one = prop::strategy::Union::new(all).boxed();
    let share = 0.0..1.0f32;
    let mask = (one.clone(), share.clone())
        .prop_map(|(bsdf, v)| format!("<bsdf type='mask'>{bsdf}{}</bsdf>", share_of("opacity", v)));
    let blend = (one.clone(), one.clone(), share)
        .prop_map(|(a, b, v)| format!("<bsdf type='blendbsdf'>{a}{b}{}</bsdf>", share_of("weight", v)));
    // The last class has mixtures, too.
    if class == 3 { prop_oneof![2 => one, 1 => mask, 1 => blend].boxed() } else { one }
}

/// A share of this name: below a half the same everywhere, else in squares of that and of nothing.
fn share_of(name: &str, v: f32) -> String {
    if v < 0.5 {
        return format!("<float name='{name}' value='{v}'/>");
    }
    let colors = format!("<float name='color0' value='{v}'/><float name='color1' value='0'/>");
    let squares = "<transform name='to_uv'><scale value='4'/></transform>";
    format!("<texture type='checkerboard' name='{name}'>{colors}{squares}</texture>")
}

fn scene((grey, class): (bool, usize)) -> impl Strategy<Value = (bool, String)> {
    let objects = prop::collection::vec(
        (
            material(grey, class),
            prop_oneof![Just("sphere"), Just("cube"), Just("disk")],
            -2.0..2.0f32,
            0.3..1.0f32,
        ),
        1..5,
    );
    let lights = prop::collection::vec((0..4u8, colour(grey), -2.0..2.0f32), 1..4);
    (material(grey, class), objects, lights, any::<bool>()).prop_map(move |(floor, objects, lights, lens)| {
        let (sensor, radius) = match lens {
            true => ("thinlens", "<float name='aperture_radius' value='0.1'/><float name='focus_distance' value='5'/>"),
            false => ("perspective", ""),
        };
        let mut text = format!(
            "<scene version='3.0.0'><sensor type='{sensor}'>{radius}<float name='fov' value='45'/><transform \
             name='to_world'><lookat origin='0, 2, -6' target='0, 0.7, 0' up='0, 1, 0'/></transform></sensor>\
             <shape type='rectangle'><transform name='to_world'><scale value='4'/><rotate x='1' angle='-90'/>\
             </transform>{floor}</shape>"
        );
        for (i, (bsdf, shape, x, size)) in objects.iter().enumerate() {
            text += &format!(
                "<shape type='{shape}'><transform name='to_world'><scale value='{size}'/><translate x='{x}' \
                 y='{size}' z='{i}'/></transform>{bsdf}</shape>"
            );
        }
        let several = lights.len() > 1;
        for (i, (kind, value, x)) in lights.into_iter().enumerate() {
            text += &match kind {
                3 if i == 0 && several => "<emitter type='constant'><rgb name='radiance' value='0'/></emitter>".to_string(),
                // A scene has one environment.
                0 if i == 0 => format!("<emitter type='constant'><rgb name='radiance' value='{value}'/></emitter>"),
                0 | 1 => format!(
                    "<emitter type='point'><point name='position' x='{x}' y='4' z='-1'/><rgb name='intensity' \
                     value='{value}'/></emitter>"
                ),
                _ => format!(
                    "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='90'/><translate \
                     x='{x}' y='4'/></transform><emitter type='area'><rgb name='radiance' value='{value}'/>\
                     </emitter></shape>"
                ),
            };
        }
        (grey, text + "</scene>")
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 192, failure_persistence: None, ..ProptestConfig::default() })]

    /// A scene made without colour has no wavelengths in its plan, and one with colours has.
    #[test]
    fn random_scenes_are_as_planned((grey, text) in (any::<bool>(), 0..4usize).prop_flat_map(scene)) {
        let desc = load_str("random.xml", &text, &[]).unwrap().desc;
        prop_assert_eq!(Scene::prepare(&desc).unwrap().white().is_some(), grey);
        check_all(&desc, 384);
    }
}

/// A photon counts at wavelengths of its own, so that single samples cannot be compared: the mean is.
#[test]
fn photons_without_colour_have_the_same_mean() {
    let desc = load_str("grey.xml", GREY, &[]).unwrap().desc;
    let mean = |spectral: bool| {
        let scene = if spectral { Scene::prepare_general(&desc) } else { Scene::prepare(&desc) };
        let tracer = PhotonTracer::new(render_context(&desc, scene.unwrap()), true);
        let (mut scratch, mut sum, count) = (Default::default(), Sum::default(), 1 << 17);
        (0..count).for_each(|index| tracer.trace(index, &mut scratch, &mut sum));
        let [least, most] = sum.colours.expect("something is lit");
        let mean = sum.y / count as f64;
        (mean, (sum.squares / count as f64 - mean * mean) / count as f64, most / least - 1.0)
    };
    let ((white, v0, one), (drawn, v1, several)) = (mean(false), mean(true));
    let z = (white - drawn) / (v0 + v1).sqrt();
    assert!(z.abs() < 4.0, "{white} and {drawn}: z = {z}");
    assert!(
        one < 1e-4 && several > 0.01,
        "colours differ by {one} without and {several} with drawn wavelengths"
    );
}

const GREY: &str = "<scene version='3.0.0'><integrator type='photon'/><sensor type='perspective'><float name='fov' value='40'/>\
    <transform name='to_world'><lookat origin='0, 2, -6' target='0, 0.7, 0' up='0, 1, 0'/></transform></sensor>\
    <shape type='rectangle'><transform name='to_world'><scale value='4'/><rotate x='1' angle='-90'/></transform>\
    <bsdf type='diffuse'><rgb name='reflectance' value='0.6'/></bsdf></shape>\
    <shape type='sphere'><transform name='to_world'><translate y='1'/></transform>\
    <bsdf type='dielectric'><float name='int_ior' value='1.5'/></bsdf></shape>\
    <shape type='rectangle'><transform name='to_world'><rotate x='1' angle='90'/><translate y='4'/></transform>\
    <emitter type='area'><rgb name='radiance' value='5'/></emitter></shape></scene>";
