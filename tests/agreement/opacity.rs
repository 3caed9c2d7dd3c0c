//! Surfaces with holes: all methods agree, and with what the same light gives that was dimmed by hand.

use crate::pairs::{PHOTONS, PLAN, assert_all_pairs};
use crate::support::agreement::{Method, Plan, repeat};
use crate::support::welch;
use pointillist::scene::SceneDesc;
use pointillist::scene::load_str;
use pointillist::stream::UvWindow;

/// A floor of 6 × 6, white on both sides, seen from above at an angle, and what else `more` says.
fn floor_and(more: &str) -> SceneDesc {
    let text = format!(
        "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='50'/><film type='hdrfilm'>\
         <integer name='width' value='8'/><integer name='height' value='8'/></film><transform name='to_world'>\
         <lookat origin='0, -4, 3' target='0, 0, .2' up='0, 0, 1'/></transform></sensor>\
         <bsdf type='twosided' id='white'><bsdf type='diffuse'><rgb name='reflectance' value='.7'/></bsdf></bsdf>\
         <shape type='rectangle'><transform name='to_world'><scale value='3'/></transform><ref id='white'/></shape>\
         {more}</scene>"
    );
    load_str("opacity.xml", &text, &[]).unwrap_or_else(|e| panic!("{e}")).desc
}

/// Squares of two opacities, `count` times four of them.
fn squares(name: &str, [a, b]: [f32; 2], count: u32) -> String {
    format!(
        "<texture type='checkerboard' name='{name}'><float name='color0' value='{a}'/><float name='color1' value='{b}'/>\
         <transform name='to_uv'><scale value='{count}'/></transform></texture>"
    )
}

fn mask(opacity: &str) -> String {
    format!("<bsdf type='mask'>{opacity}<ref id='white'/></bsdf>")
}

/// A square above the floor, `size` from its middle to its edges, facing down where `size` is negative.
fn plate(z: f32, size: f32, inside: &str) -> String {
    let turn = if size < 0.0 { "<rotate x='1' angle='180'/>" } else { "" };
    format!(
        "<shape type='rectangle'><transform name='to_world'><scale value='{}'/>{turn}<translate z='{z}'/></transform>\
         {inside}</shape>",
        size.abs()
    )
}

fn number(name: &str, v: f32) -> String {
    format!("<float name='{name}' value='{v}'/>")
}

const LAMP: &str = "<emitter type='area'><rgb name='radiance' value='8'/></emitter>";
const POINT: &str = "<emitter type='point'><point name='position' x='.3' y='.2' z='4'/><rgb name='intensity' value='20'/></emitter>";
const PARALLEL: &str = "<emitter type='directional'><vector name='direction' x='.2' y='.1' z='-1'/><rgb name='irradiance' value='2'/></emitter>";

/// A plate with holes and half open squares between a lamp and the floor, seen from both.
#[test]
fn a_textured_mask_before_a_lamp() {
    let more = plate(3.0, -0.8, LAMP) + &plate(1.2, 1.2, &mask(&squares("opacity", [0.9, 0.2], 2)));
    assert_all_pairs("textured mask", &floor_and(&more), PLAN, PHOTONS);
}

/// A ball with holes close to the floor, white within: photons on it must not count on the floor, nor light that passes twice.
#[test]
fn a_ball_with_holes_near_the_floor() {
    let ball = format!(
        "<shape type='sphere'><point name='center' x='0' y='0' z='.9'/><float name='radius' value='.75'/>{}</shape>",
        mask(&number("opacity", 0.6))
    );
    let sky = "<emitter type='constant'><rgb name='radiance' value='.5'/></emitter>";
    assert_all_pairs("ball", &floor_and(&(plate(3.0, -0.8, LAMP) + &ball + sky)), PLAN, PHOTONS);
}

/// A blend whose weight varies, one part of which has holes, before a lamp; the parts are a rough metal and paper.
#[test]
fn a_textured_blend() {
    let metal =
        "<bsdf type='twosided'><bsdf type='roughconductor'><float name='alpha' value='.4'/></bsdf></bsdf>";
    let blend = format!(
        "<bsdf type='blendbsdf'>{}{metal}{}</bsdf>",
        squares("weight", [0.8, 0.1], 3),
        mask(&squares("opacity", [1.0, 0.3], 2))
    );
    let more = plate(3.0, -0.8, LAMP) + &plate(0.8, 1.2, &blend);
    assert_all_pairs("textured blend", &floor_and(&more), PLAN, PHOTONS);
}

/// Two rough glasses of different indices in one plate, lit from behind.
#[test]
fn a_blend_of_two_glasses() {
    let glass = |index: f32, colour: &str| {
        format!(
            "<bsdf type='roughdielectric'><float name='alpha' value='.4'/><float name='int_ior' value='{index}'/>\
             <rgb name='specular_transmittance' value='{colour}'/></bsdf>"
        )
    };
    let ball = format!(
        "<shape type='sphere'><point name='center' x='0' y='0' z='1.1'/><float name='radius' value='.8'/><bsdf type='blendbsdf'>{}{}{}</bsdf></shape>",
        number("weight", 0.5),
        glass(1.2, ".2, .9, .9"),
        glass(2.2, ".9, .3, .2")
    );
    // With fewer paths a block's mean over a seed is far from normally distributed: what light meets both glasses is rare and bright.
    let plan = Plan { paths_per_pixel: 4 * PLAN.paths_per_pixel, ..PLAN };
    assert_all_pairs("two glasses", &floor_and(&(plate(3.0, -0.8, LAMP) + &ball)), plan, PHOTONS);
}

/// A lamp with holes before a brighter one: it emits as if it were whole, and what passes it is seen behind it.
#[test]
fn an_emitter_with_holes() {
    let front = mask(&number("opacity", 0.5)) + &LAMP.replace('8', "2");
    let more = plate(3.5, -0.8, LAMP) + &plate(2.0, -0.6, &front);
    assert_all_pairs("emitter with holes", &floor_and(&more), PLAN, PHOTONS);
}

const FEW: Plan = Plan { side: 4, paths_per_pixel: 256, seeds: 16, window: UvWindow::PICTURE };

/// Both scenes have the same mean by each of these methods.
fn assert_same(name: &str, a: &SceneDesc, b: &SceneDesc, methods: &[Method]) {
    for &method in methods {
        let mean = |desc: &SceneDesc| {
            // Few light paths end in the view.
            let more = if method == Method::Particle { 8 } else { 1 };
            let pictures = repeat(desc, method, Plan { paths_per_pixel: more * FEW.paths_per_pixel, ..FEW });
            welch::moments(pictures.iter().map(|p| p.iter().sum::<f64>() / p.len() as f64))
        };
        let [a, b] = [mean(a), mean(b)];
        println!("{name}, {method:?}: {:.5} ± {:.5}, {:.5} ± {:.5}", a.0, a.1.sqrt(), b.0, b.1.sqrt());
        let error = (a.1 + b.1).sqrt();
        assert!(a.0 > 0.0 && (a.0 - b.0).abs() < 5.0 * error + 1e-5 * a.0, "{name}, {method:?}: {a:?} {b:?}");
        assert!(error < 0.02 * a.0, "{name}, {method:?}: too much noise to tell");
    }
}

const ALL: [Method; 4] = [Method::Path, Method::Particle, Method::Bidirectional, Method::Photon];

/// Black plates that are larger than what the camera sees, so that all light passes them and none of it comes back.
fn shades(opacities: &[f32]) -> String {
    let shade = |(i, opacity): (usize, &f32)| {
        let black = "<bsdf type='diffuse'><rgb name='reflectance' value='0'/></bsdf>";
        let inside = format!("<bsdf type='mask'>{}{black}</bsdf>", number("opacity", *opacity));
        plate(3.2 + 0.1 * i as f32, 4.5, &inside)
    };
    opacities.iter().enumerate().map(shade).collect()
}

/// Light of no extent is found by rays towards it alone: a method that stops these at a mask shows black.
#[test]
fn point_and_parallel_light_through_masks() {
    for (light, dimmed) in [(POINT, POINT.replace("20", "5")), (PARALLEL, PARALLEL.replace("'2'", "'.5'"))] {
        let dimmed = floor_and(&dimmed);
        assert_same("one mask", &floor_and(&(light.to_string() + &shades(&[0.75]))), &dimmed, &ALL);
        assert_same("two masks", &floor_and(&(light.to_string() + &shades(&[0.5, 0.5]))), &dimmed, &ALL);
    }
}

/// A mask in a group, shown turned and stretched, is the same mask beside it.
#[test]
fn masks_in_instances() {
    let plate = |to_world: &str| {
        let bsdf = mask(&squares("opacity", [0.9, 0.1], 2));
        format!("<shape type='rectangle'>{bsdf}<transform name='to_world'>{to_world}</transform></shape>")
    };
    let (inner, outer) =
        ("<scale value='.5'/>", "<rotate y='1' angle='20'/><scale x='2' y='1.5'/><translate z='1.2'/>");
    let direct = floor_and(&(POINT.to_string() + &plate(&format!("{inner}{outer}"))));
    let shown = format!(
        "{POINT}<shape type='shapegroup' id='g'>{}</shape><shape type='instance'><ref id='g'/><transform name='to_world'>{outer}\
         </transform></shape>",
        plate(inner)
    );
    assert_same("instance", &direct, &floor_and(&shown), &ALL);
}

/// A surface that is not there, around everything that matters, changes nothing; nor does it count as a segment of a path.
#[test]
fn null_around_an_object() {
    let ball = "<shape type='sphere'><point name='center' x='0' y='0' z='1'/><float name='radius' value='.6'/><bsdf type='plastic'/></shape>";
    let limit = "<integrator type='path'><integer name='max_depth' value='3'/></integrator>";
    let nulls: String = [1.0, 1.1]
        .iter()
        .map(|r| {
            format!(
                "<shape type='sphere'><point name='center' x='0' y='0' z='1'/><float name='radius' value='{r}'/><bsdf type='null'/></shape>"
            )
        })
        .collect();
    let plain = format!("{limit}{POINT}{ball}");
    assert_same("null", &floor_and(&plain), &floor_and(&(plain.clone() + &nulls)), &ALL);
}
