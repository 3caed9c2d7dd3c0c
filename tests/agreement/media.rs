//! Participating media: all methods agree, whatever lies where.

use std::path::Path;

use crate::pairs::{PHOTONS, PLAN, assert_all_pairs, assert_pairs};
use crate::support::agreement::Method;
use pointillist::scene::SceneDesc;
use pointillist::scene::load_str;

/// A floor of 6 × 6, and what else `more` says; the camera holds `around`.
fn floor_and(around: &str, more: &str) -> SceneDesc {
    let text = format!(
        "<scene version='3.0.0'><integrator type='volpath'><integer name='max_depth' value='8'/></integrator>\
         <sensor type='perspective'><float name='fov' value='45'/>{around}<film type='hdrfilm'>\
         <integer name='width' value='8'/><integer name='height' value='8'/></film><transform name='to_world'>\
         <lookat origin='0, -4, 2' target='0, 0, .7' up='0, 0, 1'/></transform></sensor>\
         <shape type='rectangle'><transform name='to_world'><scale value='3'/></transform><bsdf type='twosided'>\
         <bsdf type='diffuse'><rgb name='reflectance' value='.7 .6 .5'/></bsdf></bsdf></shape>{more}</scene>"
    );
    let place = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/plugins/media.xml");
    load_str(place.to_str().expect("UTF-8"), &text, &[]).unwrap_or_else(|e| panic!("{e}")).desc
}

const LAMP: &str = "<shape type='rectangle'><transform name='to_world'><scale value='.7'/><rotate x='1' angle='180'/>\
                    <translate x='.5' z='3'/></transform><emitter type='area'><rgb name='radiance' value='9 8 6'/></emitter></shape>";
const POINT: &str = "<emitter type='point'><point name='position' x='.8' y='-.5' z='2.4'/><rgb name='intensity' value='9 9 12'/></emitter>";
const SKY: &str = "<emitter type='constant'><rgb name='radiance' value='.5 .6 .8'/></emitter>";
const NULL: &str = "<bsdf type='null'/>";

fn ball(bsdf: &str, inside: &str) -> String {
    format!(
        "<shape type='sphere'><point name='center' x='0' y='0' z='.8'/><float name='radius' value='.7'/>{bsdf}{inside}</shape>"
    )
}

/// The bias of photons that is let pass below a ball of clear glass: they blur the caustic there by a seventh with so few samples, without media
/// as well.
const BELOW_A_BALL: f64 = 0.2;

/// A medium that a shape holds.
fn medium(side: &str, inside: &str) -> String {
    format!("<medium type='homogeneous' name='{side}'>{inside}</medium>")
}

fn box_of(inside: &str) -> String {
    format!(
        "<shape type='cube'><transform name='to_world'><scale x='2' y='4.5' z='2'/><translate z='1.5'/></transform>{NULL}{inside}</shape>"
    )
}

/// Fog in which camera, lamp, floor and a matt ball are.
#[test]
fn a_room_full_of_fog() {
    let fog = "<medium type='homogeneous' id='fog'><float name='sigma_t' value='.25'/><rgb name='albedo' value='.9 .8 .7'/>\
               <phase type='hg'><float name='g' value='.5'/></phase></medium>";
    let more = fog.to_owned() + LAMP + &ball("", "") + &box_of("<ref name='interior' id='fog'/>");
    assert_all_pairs("fog", &floor_and("<ref id='fog'/>", &more), PLAN, PHOTONS);
}

/// A rough glass ball of a milky medium, in which light of a lamp and of a sky is scattered often.
#[test]
fn milk_in_rough_glass() {
    let milk = medium("interior", "<float name='sigma_t' value='3'/><rgb name='albedo' value='.95 .9 .7'/>");
    let glass = "<bsdf type='roughdielectric'><float name='alpha' value='.4'/><float name='int_ior' value='1.3'/></bsdf>";
    assert_all_pairs("milk", &floor_and("", &(ball(glass, &milk) + LAMP + SKY)), PLAN, PHOTONS);
}

/// Fog in a smooth glass ball, lit from outside: light that is scattered once in there is found by chance, or by photons in the fog.
#[test]
fn fog_in_smooth_glass() {
    let fog = medium(
        "interior",
        "<float name='sigma_t' value='1.2'/><rgb name='albedo' value='.9 .8 .7'/>\
         <phase type='hg'><float name='g' value='.4'/></phase>",
    );
    let glass = "<bsdf type='dielectric'><float name='int_ior' value='1.3'/></bsdf>";
    assert_all_pairs("fog in glass", &floor_and("", &(ball(glass, &fog) + LAMP + SKY)), PLAN, BELOW_A_BALL);
}

/// Tea, which only absorbs, red the least, in rough glass, next to a fog that scatters.
#[test]
fn tea_in_rough_glass() {
    let tea = medium("interior", "<rgb name='sigma_t' value='.1 .5 2'/><float name='albedo' value='0'/>");
    let glass = "<bsdf type='roughdielectric'><float name='alpha' value='.4'/><float name='int_ior' value='1.3'/></bsdf>";
    let fog = medium("interior", "<rgb name='sigma_t' value='.1 .12 .15'/><float name='albedo' value='.8'/>");
    let fog = format!(
        "<shape type='cube'><transform name='to_world'><scale x='.6' y='.6' z='.6'/><translate x='-1.4' z='.8'/></transform>{NULL}{fog}</shape>"
    );
    assert_all_pairs("tea", &floor_and("", &(ball(glass, &tea) + &fog + LAMP + SKY)), PLAN, BELOW_A_BALL);
}

/// Milk in rough glass of `principled`, which also has a diffuse part that is seen from outside only.
#[test]
fn milk_in_principled_glass() {
    let milk = medium("interior", "<float name='sigma_t' value='3'/><rgb name='albedo' value='.95 .9 .7'/>");
    let glass = "<bsdf type='principled'><rgb name='base_color' value='.9 .95 .8'/><float name='spec_trans' value='.8'/>\
                 <float name='roughness' value='.65'/><float name='eta' value='1.3'/></bsdf>";
    assert_all_pairs("principled milk", &floor_and("", &(ball(glass, &milk) + LAMP + SKY)), PLAN, PHOTONS);
}

/// Wax: light enters in all directions and is scattered, mostly forwards; long wavelengths go farther.
#[test]
fn wax_within_a_surface_that_transmits_diffusely() {
    let wax = medium(
        "interior",
        "<rgb name='sigma_t' value='2 3 4'/><rgb name='albedo' value='.97 .9 .7'/><phase type='hg'><float name='g' value='.4'/></phase>",
    );
    let skin = "<bsdf type='principledthin'><rgb name='base_color' value='.9 .85 .8'/><float name='diff_trans' value='1.6'/>\
                <float name='roughness' value='.7'/><float name='eta' value='1.4'/></bsdf>";
    assert_all_pairs("wax", &floor_and("", &(ball(skin, &wax) + LAMP + SKY)), PLAN, PHOTONS);
}

/// A cloud whose extinction depends on the wavelength, twenty times as much for blue as for red, under a point light.
#[test]
fn a_chromatic_cloud() {
    let cloud = medium(
        "interior",
        "<rgb name='sigma_t' value='.05 .3 .95'/><float name='scale' value='4'/><float name='albedo' value='.9'/><phase type='rayleigh'/>",
    );
    assert_all_pairs("chromatic", &floor_and("", &(ball(NULL, &cloud) + POINT)), PLAN, PHOTONS);
}

/// A point light within a box of fog of colours: camera paths sample it along their flights as well.
#[test]
fn a_point_in_chromatic_fog() {
    let fog = medium(
        "interior",
        "<rgb name='sigma_t' value='.15 .3 .6'/><float name='albedo' value='.8'/><phase type='hg'><float name='g' value='.5'/></phase>",
    );
    let fog = format!(
        "<shape type='cube'><transform name='to_world'><scale x='2' y='2' z='2'/><translate z='1.5'/></transform>{NULL}{fog}</shape>"
    );
    assert_all_pairs("point in fog", &floor_and("", &(fog + POINT + &ball("", ""))), PLAN, PHOTONS);
}

/// Three points, a spot, a lamp and a sky, in a box of fog and outside of it: a light is chosen among points for a distance along a flight, and
/// among all at its end, by importance, or each where the phase function has a peak.
#[test]
fn several_points_in_fog() {
    let at = |x: f64, z: f64, value: u32| {
        format!(
            "<emitter type='point'><point name='position' x='{x}' y='.4' z='{z}'/><rgb name='intensity' value='{value}'/></emitter>"
        )
    };
    let spot = "<emitter type='spot'><rgb name='intensity' value='9 8 7'/><float name='cutoff_angle' value='30'/>\
                <transform name='to_world'><lookat origin='-1.4, .3, 2.2' target='.3, .2, .3' up='0, 1, 0'/></transform></emitter>";
    let lights = at(-1.0, 1.0, 1) + &at(1.2, 0.6, 2) + &at(0.3, 4.0, 4) + spot + LAMP + SKY;
    for (g, name) in [(0.0, "several points, isotropic"), (0.6, "several points, a peak")] {
        let fog = format!(
            "<float name='sigma_t' value='.4'/><float name='albedo' value='.8'/><phase type='hg'><float name='g' value='{g}'/></phase>"
        );
        let fog = format!(
            "<shape type='cube'><transform name='to_world'><scale x='2' y='2' z='1.5'/><translate z='1'/></transform>{NULL}{}</shape>",
            medium("interior", &fog)
        );
        assert_all_pairs(name, &floor_and("", &(fog + &lights + &ball("", ""))), PLAN, PHOTONS);
    }
}

/// A grid of densities in a box, lit by a lamp and a sky.
#[test]
fn a_cloud_on_a_grid() {
    let cloud = "<medium type='heterogeneous' name='interior'><volume name='sigma_t' type='gridvolume'>\
                 <string name='filename' value='texture_volume_numbers.vol'/><transform name='to_world'>\
                 <translate x='-.5' y='-.5'/><scale value='1.4'/></transform></volume><float name='scale' value='4'/>\
                 <float name='albedo' value='.8'/><phase type='hg'><float name='g' value='-.4'/></phase></medium>";
    assert_all_pairs("grid", &floor_and("", &(box_of(cloud) + LAMP + SKY)), PLAN, PHOTONS);
}

/// A ball of flat flakes that lie askew, and of a table that scatters to the sides, under a lamp and a sky.
#[test]
fn flakes_and_a_table() {
    let cloud = medium(
        "interior",
        "<float name='sigma_t' value='3'/><rgb name='albedo' value='.9 .8 .7'/><phase type='blendphase'><float name='weight' value='.3'/>\
         <phase type='sggx'><volume name='S' type='constvolume'><string name='value' value='.3, .5, .8, .1, -.2, .3'/></volume></phase>\
         <phase type='tabphase'><string name='values' value='.2, 1, 1.5, .5, 2'/></phase></phase>",
    );
    assert_all_pairs("flakes", &floor_and("", &(ball(NULL, &cloud) + LAMP + SKY)), PLAN, PHOTONS);
}

/// A fire that is dense for blue light, over a floor that its own light falls on. Particles do not find it.
#[test]
fn a_fire() {
    let fire = medium(
        "interior",
        "<rgb name='sigma_t' value='1 2 4'/><float name='albedo' value='.4'/><rgb name='radiance' value='5 2 .5'/>",
    );
    let floor = floor_and("", &(ball(NULL, &fire) + SKY));
    assert_pairs(
        "fire",
        &floor,
        &[Method::Path, Method::Bidirectional, Method::Photon, Method::Vcm],
        PLAN,
        PHOTONS,
    );
}

/// A shining ball in a medium in glass, next to a mirror: photons through glass, chains of deltas and media together.
#[test]
fn a_lamp_in_a_medium_in_glass() {
    let fog = "<medium type='homogeneous' id='fog'><float name='sigma_t' value='1.5'/><float name='albedo' value='.7'/></medium>";
    let glass = ball(
        "<bsdf type='dielectric'><float name='int_ior' value='1.2'/></bsdf>",
        "<ref name='interior' id='fog'/>",
    );
    let lamp = "<shape type='sphere'><point name='center' x='.1' y='0' z='.9'/><float name='radius' value='.2'/>\
                <ref name='exterior' id='fog'/><emitter type='area'><rgb name='radiance' value='20 18 15'/></emitter></shape>";
    assert_all_pairs("lamp in glass", &floor_and("", &(fog.to_owned() + &glass + lamp)), PLAN, PHOTONS);
}

/// Thin fog around everything whose extinction differs by half between red and blue: photons are gathered through it at their own wavelengths.
#[test]
fn mild_chromatic_fog() {
    let fog = "<medium type='homogeneous' id='fog'><rgb name='sigma_t' value='.2 .25 .3'/><rgb name='albedo' value='.6 .8 .9'/></medium>";
    let white = "<bsdf type='diffuse'><rgb name='reflectance' value='.8'/></bsdf>";
    let more = fog.to_owned() + LAMP + &ball(white, "") + &box_of("<ref name='interior' id='fog'/>");
    assert_all_pairs("chromatic fog", &floor_and("<ref id='fog'/>", &more), PLAN, PHOTONS);
}
