//! Groups of lights: their parts are the picture's samples and no others, each part has the light of its own group only, and the picture
//! is that of a render without groups, bit for bit.

use std::path::Path;
use std::sync::Arc;

use pointillist::color::Xyz;
use pointillist::scene::light_groups::{each, emitters, of_sources};
use pointillist::scene::{SceneDesc, load, load_str};
use pointillist::stream::{SampleSink, UvWindow, faults};
use pointillist::tracer::integrator::{
    BidirectionalTracer, ParticleTracer, PathTracer, PhotonTracer, RenderContext, VcmTracer,
};
use pointillist::tracer::{Camera, Integrator, Scene};

/// A sample and its parts: none where groups are not told, one of a group by itself on the light stream.
#[derive(Debug, Clone, PartialEq)]
struct Sent {
    uv: [f32; 2],
    value: Xyz,
    /// 0 of the light stream.
    weight: f32,
    parts: Vec<(usize, Xyz)>,
}

#[derive(Default)]
struct SentSamples(Vec<Sent>);

impl SampleSink for SentSamples {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        self.0.push(Sent { uv, value, weight, parts: Vec::new() });
    }

    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        self.camera(uv, value, 0.0);
    }

    fn camera_by_groups(&mut self, uv: [f32; 2], value: Xyz, weight: f32, parts: &[Xyz]) {
        self.0.push(Sent { uv, value, weight, parts: parts.iter().copied().enumerate().collect() });
    }

    fn light_of_group(&mut self, uv: [f32; 2], value: Xyz, group: u8) {
        self.0.push(Sent { uv, value, weight: 0.0, parts: vec![(usize::from(group), value)] });
    }
}

/// Traces a few thousand paths in a scene with and without groups and checks that the samples are the same and the sums of their parts. Calls
/// `check` for each part, with its group, and returns how many parts of each group have light.
fn compare<I: Integrator + From<RenderContext>>(
    desc: &SceneDesc,
    groups: &[u8],
    count: u64,
    check: &impl Fn(usize, Xyz),
) -> Vec<u64> {
    let number = groups.iter().max().map_or(0, |last| usize::from(*last) + 1);
    let plain = Arc::new(Scene::prepare(desc).expect("the scene is valid"));
    let grouped = Arc::new(plain.with_light_groups(groups, number));
    let samples = |scene: &Arc<Scene>| {
        let camera = Camera::of(desc).expect("the camera is valid");
        let context = RenderContext::new(scene.clone(), camera, &desc.integrator, 5, UvWindow::PICTURE);
        let (tracer, mut scratch, mut sent) = (I::from(context), Default::default(), SentSamples::default());
        // Paths that split, and the first ones, which do not.
        for index in (0..count).chain(16_384..16_384 + count) {
            tracer.trace(index, &mut scratch, &mut sent);
        }
        faults::take();
        sent.0
    };
    let (plain, grouped) = (samples(&plain), samples(&grouped));
    assert_eq!(plain.len(), grouped.len());
    let mut lit = vec![0; number];
    for (plain, grouped) in plain.iter().zip(&grouped) {
        assert_eq!(*plain, Sent { parts: Vec::new(), ..grouped.clone() }, "the samples of the picture");
        assert_eq!(grouped.parts.len(), if grouped.weight > 0.0 { number } else { 1 });
        let sum = grouped.parts.iter().fold(Xyz::BLACK, |sum, (_, part)| sum + *part);
        let [x, y, z] = [grouped.value.x, grouped.value.y, grouped.value.z];
        let rounding = 2e-5 * x.max(y).max(z);
        for (sum, value) in [(sum.x, x), (sum.y, y), (sum.z, z)] {
            assert!((sum - value).abs() <= rounding, "{sum} of parts is not {value}");
        }
        for (group, part) in &grouped.parts {
            if part.x + part.y + part.z > 0.0 {
                lit[*group] += 1;
                check(*group, *part);
            }
        }
    }
    lit
}

/// Compares by all integrators of light.
fn compare_all(
    desc: &SceneDesc,
    groups: &[u8],
    count: u64,
    check: impl Fn(usize, Xyz),
) -> Vec<(&'static str, Vec<u64>)> {
    vec![
        ("path", compare::<PathTracer>(desc, groups, count, &check)),
        ("light", compare::<ParticleTracer>(desc, groups, count, &check)),
        ("bidirectional", compare::<BidirectionalTracer>(desc, groups, count / 8, &check)),
        ("photon", compare::<PhotonTracer>(desc, groups, count, &check)),
        ("vcm", compare::<VcmTracer>(desc, groups, count / 8, &check)),
    ]
}

/// A spectrum that is 0 outside these wavelengths.
fn band(name: &str, [low, high]: [u32; 2], value: u32) -> String {
    let steps = format!("{}:0, {low}:{value}, {high}:{value}, {}:0", low - 1, high + 1);
    format!("<spectrum name='{name}' value='{steps}'/>")
}

/// Lamps of three bands of the spectrum, blue, green and red, and everything that paths do: dispersion, smooth and rough glass,
/// mirrors, coats, mixtures, several lights to choose from, lights seen over chains of mirrors.
fn room(environment: &str, hide_emitters: bool) -> SceneDesc {
    let ball = |x: f64, bsdf: &str| {
        format!(
            "<shape type='sphere'><transform name='to_world'><scale value='.6'/><translate x='{x}' y='.6'/></transform>{bsdf}</shape>"
        )
    };
    let lamp = |x: f64, nm| {
        format!(
            "<shape type='sphere'><transform name='to_world'><scale value='.4'/><translate x='{x}' y='3' z='-1'/></transform>\
             <emitter type='area'>{}</emitter></shape>",
            // So bright that light paths choose lamps as well as the environment.
            band("radiance", nm, 3000)
        )
    };
    let text = format!(
        "<scene version='3.0.0'><integrator type='path'><boolean name='hide_emitters' value='{hide_emitters}'/></integrator>\
         <sensor type='thinlens'><float name='aperture_radius' value='.02'/><float name='focus_distance' value='6'/>\
         <float name='fov' value='45'/><transform name='to_world'><lookat origin='0, 2, -6' target='0, 1, 0' up='0, 1, 0'/>\
         </transform></sensor><shape type='rectangle'><transform name='to_world'><scale value='4'/><rotate x='1' angle='-90'/>\
         </transform><bsdf type='diffuse'><rgb name='reflectance' value='.7, .6, .5'/></bsdf></shape>{}{}{}{}{}{}{}{}{environment}</scene>",
        ball(-2.6, "<bsdf type='dielectric'><string name='int_ior' value='sf11'/></bsdf>"),
        ball(
            -1.3,
            "<bsdf type='roughdielectric'><float name='alpha' value='.2'/><string name='int_ior' value='bk7'/></bsdf>"
        ),
        ball(0.0, "<bsdf type='conductor'><string name='material' value='Au'/></bsdf>"),
        ball(1.3, "<bsdf type='plastic'/>"),
        ball(
            2.6,
            "<bsdf type='blendbsdf'><float name='weight' value='.5'/><bsdf type='roughconductor'/><bsdf type='diffuse'/></bsdf>"
        ),
        lamp(-1.5, BLUE),
        lamp(1.5, RED),
        if environment.is_empty() {
            format!(
                "<emitter type='point'><point name='position' x='0' y='4' z='-2'/>{}</emitter>",
                band("intensity", GREEN, 200)
            )
        } else {
            String::new()
        },
    );
    let text = text.replace("ENVIRONMENT", &band("radiance", GREEN, 3));
    load_str("room.xml", &text, &[]).expect("the scene is valid").desc
}

const BLUE: [u32; 2] = [410, 465];
const GREEN: [u32; 2] = [530, 545];
const RED: [u32; 2] = [650, 700];

/// In the bands of the lamps and 30 nm around them, which is how far photons blur colours that a prism has parted, one of X, Y and Z is the
/// largest.
fn is_of_its_lamp(group: usize, part: Xyz) {
    let Xyz { x, y, z } = part;
    let fits = [z > x.max(y), x > y.max(z), y > x.max(z)];
    assert!(fits[group], "light of another lamp in group {group}: {part:?}");
}

#[test]
fn parts_have_the_light_of_their_group() {
    let constant = "<emitter type='constant'>ENVIRONMENT</emitter>";
    for (environment, hidden) in [(constant, false), (constant, true), ("", false), ("", true)] {
        let desc = room(environment, hidden);
        for (method, lit) in compare_all(&desc, &[0, 1, 2], 8192, is_of_its_lamp) {
            println!("{method}, environment {environment:?}, hidden {hidden}: {lit:?}");
            assert!(lit.iter().all(|n| *n > 30), "{method}: {lit:?}");
        }
    }
}

/// A ball of a medium that shines red in one that shines blue, with a green point in it, before a green sky: media are counted behind all lights.
#[test]
fn media_that_shine_are_in_groups() {
    let medium = |id: &str, nm, albedo: f64| {
        format!(
            "<medium type='homogeneous' id='{id}'><float name='sigma_t' value='.5'/><float name='albedo' value='{albedo}'/>{}</medium>",
            band("radiance", nm, 20)
        )
    };
    let ball = |radius: f64, sides: &str| {
        format!(
            "<shape type='sphere'><float name='radius' value='{radius}'/><bsdf type='null'/>{sides}</shape>"
        )
    };
    let text = format!(
        "<scene version='3.0.0'><integrator type='volpath'/><sensor type='perspective'><transform name='to_world'>\
         <lookat origin='0, 0, -4' target='0, 0, 0' up='0, 1, 0'/></transform></sensor>{}{}{}{}<emitter type='point'>{}</emitter><emitter type='constant'>{}</emitter></scene>",
        medium("outer", BLUE, 0.5),
        medium("inner", RED, 0.5),
        ball(2.0, "<ref name='interior' id='outer'/>"),
        ball(1.0, "<ref name='interior' id='inner'/><ref name='exterior' id='outer'/>"),
        band("intensity", GREEN, 8),
        band("radiance", GREEN, 1)
    );
    let desc = load_str("balls.xml", &text, &[]).expect("the scene is valid").desc;
    let groups = each(emitters(&desc), &[]);
    let names: Vec<&str> = groups.iter().map(|group| group.name.as_str()).collect();
    assert_eq!(names, ["outer", "inner", "point", "constant"]);
    let check = |group: usize, part| is_of_its_lamp(group.min(2), part);
    for (method, lit) in compare_all(&desc, &of_sources(&groups), 1024, check) {
        println!("{method}: {lit:?}");
        match method {
            // Light paths do not begin in media.
            "light" => assert!(lit[..2] == [0, 0] && lit[2..].iter().all(|n| *n > 30), "{method}: {lit:?}"),
            _ => assert!(lit.iter().all(|n| *n > 30), "{method}: {lit:?}"),
        }
    }
}

/// A group may have several lights, and one may have none.
#[test]
fn lights_may_share_a_group() {
    let desc = room("", false);
    for (method, lit) in compare_all(&desc, &[2, 0, 2], 1024, |_, _| ()) {
        assert!(lit[0] > 10 && lit[1] == 0 && lit[2] > 10, "{method}: {lit:?}");
    }
}

/// Every scene of the folder, with its lights in turn in two groups: meshes, maps, projectors, spots, beams, instances, curves.
#[test]
fn parts_add_up_in_every_scene() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for entry in std::fs::read_dir(folder).expect("the folder is there") {
        let path = entry.expect("it can be read").path();
        if path.extension().is_none_or(|ending| ending != "xml") {
            continue;
        }
        println!("{}", path.display());
        let desc = load(&path, &[]).expect("the scene is valid").desc;
        compare_all(&desc, &[0, 1, 0, 1, 0, 1], 512, |_, _| ());
    }
}
