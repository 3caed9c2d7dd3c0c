//! Lights of UsdLux by their closed forms: radiance, and what a light of that radiance gives.

use std::f64::consts::PI;

use glam::DVec3;
use pointillist::scene::SceneDesc;
use pointillist::scene::desc::{LightDesc, ShapeKind};

use super::usd::{stage, triangle};

/// A triangle and a light `L` of this type, which is moved, turned and doubled in size.
fn lit(test: &str, kind: &str, more: &str) -> (SceneDesc, Vec<String>) {
    stage(
        test,
        &format!(
            "{}def {kind} \"L\" {{\n{more}\n double3 xformOp:translate = (1, 2, 3)\n float xformOp:rotateX = 90\n \
             float3 xformOp:scale = (2, 2, 2)\n \
             uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:rotateX\", \"xformOp:scale\"]\n}}\n",
            triangle("t", "")
        ),
    )
}

/// The shape of the light, and its luminance.
fn shape(desc: &SceneDesc) -> (&pointillist::scene::desc::ShapeDesc, f64) {
    let shape = desc.shapes.iter().find(|shape| shape.emission.is_some()).expect("a shape that shines");
    (shape, f64::from(shape.emission.as_ref().unwrap().luminance()))
}

fn is(measured: f64, wanted: f64) -> bool {
    (measured / wanted - 1.0).abs() < 0.01
}

const BRIGHT: &str = " float inputs:intensity = 3\n float inputs:exposure = 2";
const NORMAL: &str = " float inputs:intensity = 3\n float inputs:exposure = 2\n bool inputs:normalize = true";

#[test]
fn shapes_have_the_radiance_that_is_asked_for() {
    // Radii and lengths are doubled by the transform.
    for (kind, size, area) in [
        ("SphereLight", " float inputs:radius = 0.25", 4.0 * PI * 0.25),
        ("DiskLight", " float inputs:radius = 0.25", PI * 0.25),
        ("RectLight", " float inputs:width = 2\n float inputs:height = 0.5", 4.0),
        ("CylinderLight", " float inputs:radius = 0.25\n float inputs:length = 2", 2.0 * PI * 0.5 * 4.0),
    ] {
        let (desc, warnings) = lit(&format!("light-{kind}"), kind, &format!("{size}\n{BRIGHT}"));
        assert!(warnings.is_empty(), "{kind}: {warnings:?}");
        assert!(is(shape(&desc).1, 12.0), "{kind}: {}", shape(&desc).1);
        let (desc, _) = lit(&format!("light-normal-{kind}"), kind, &format!("{size}\n{NORMAL}"));
        assert!(is(shape(&desc).1, 12.0 / area), "{kind}: {} {}", shape(&desc).1, 12.0 / area);
        assert_eq!(desc.lights.len(), 0, "no sky beside a light");
    }
}

/// Rectangles and disks shine along −z of their prim, which the transform turns to +y; cylinders lie along x.
#[test]
fn shapes_of_lights_lie_where_they_should() {
    let corner = |kind: &str, more: &str, p: DVec3| {
        let (desc, _) = lit(&format!("place-{kind}"), kind, more);
        let (shape, _) = shape(&desc);
        (shape.to_world.transform_point3(p), shape.to_world.transform_vector3(DVec3::Z).normalize())
    };
    let (_, front) = corner("DiskLight", " float inputs:radius = 0.25", DVec3::X);
    assert!(front.distance(DVec3::Y) < 1e-6, "{front}");
    let (place, front) =
        corner("RectLight", " float inputs:width = 2\n float inputs:height = 0.5", DVec3::ONE);
    assert!(front.distance(DVec3::Y) < 1e-6, "{front}");
    let from = place - DVec3::new(1.0, 2.0, 3.0) - front * (place - DVec3::new(1.0, 2.0, 3.0)).dot(front);
    assert!((from.x.abs() - 2.0).abs() < 1e-6 && (from.z.abs() - 0.5).abs() < 1e-6, "{from}");
    let (desc, _) = lit("place-cylinder", "CylinderLight", " float inputs:length = 2");
    let ShapeKind::Cylinder { p0, p1, radius } = shape(&desc).0.kind else { panic!() };
    assert!(p0.distance(DVec3::new(-1.0, 2.0, 3.0)) < 1e-6 && p1.distance(DVec3::new(3.0, 2.0, 3.0)) < 1e-6);
    assert!((radius - 1.0).abs() < 1e-9);
}

/// A ball of radius r and radiance L has the intensity L π r² to all sides; with `normalize` that is a quarter of the power.
#[test]
fn small_lights_are_points_and_spots() {
    let intensity = |test: &str, more: &str| {
        let (desc, warnings) = lit(
            test,
            "SphereLight",
            &format!(" bool treatAsPoint = true\n float inputs:radius = 0.25\n{more}"),
        );
        assert!(warnings.is_empty(), "{warnings:?}");
        let [LightDesc::Point { position, intensity, .. }] = desc.lights.as_slice() else {
            panic!("{:?}", desc.lights)
        };
        assert_eq!(*position, DVec3::new(1.0, 2.0, 3.0));
        f64::from(intensity.luminance())
    };
    assert!(is(intensity("point", BRIGHT), 12.0 * PI * 0.25));
    assert!(is(intensity("point-normal", NORMAL), 3.0));
    let cone = " float inputs:radius = 0.25\n float inputs:shaping:cone:angle = 30\n float inputs:shaping:cone:softness = 0.5";
    let (desc, warnings) = lit("spot", "SphereLight", &format!("{cone}\n{BRIGHT}"));
    assert!(warnings.len() == 1 && warnings[0].contains("spot"), "{warnings:?}");
    let [LightDesc::Spot(spot)] = desc.lights.as_slice() else { panic!("{:?}", desc.lights) };
    assert!(
        spot.axis.distance(DVec3::Y) < 1e-6 && is(f64::from(spot.intensity.luminance()), 12.0 * PI * 0.25)
    );
    assert_eq!((spot.cutoff_angle, spot.beam_width), (30.0, 15.0));
}

/// The irradiance of a disk of the sky of half angle θ is L π sin²θ where it is faced.
#[test]
fn a_distant_light_has_its_irradiance() {
    let irradiance = |test: &str, more: &str| {
        let (desc, _) = lit(test, "DistantLight", more);
        let [LightDesc::Directional { direction, irradiance, .. }] = desc.lights.as_slice() else {
            panic!("{:?}", desc.lights)
        };
        assert!(direction.distance(DVec3::Y) < 1e-6, "{direction}");
        f64::from(irradiance.luminance())
    };
    let half = 1.0_f64.to_radians();
    assert!(is(
        irradiance("sun", " float inputs:intensity = 1000\n float inputs:angle = 2"),
        1000.0 * PI * half.sin().powi(2)
    ));
    assert!(is(
        irradiance(
            "sun-normal",
            " float inputs:intensity = 5\n float inputs:angle = 2\n bool inputs:normalize = 1"
        ),
        5.0
    ));
    assert!(is(irradiance("sun-sharp", " float inputs:intensity = 5\n float inputs:angle = 0"), 5.0));
}

/// Colours of black bodies as `UsdLux.BlackbodyTemperatureAsRgb` gives them.
#[test]
fn temperatures_are_colors_of_luminance_one() {
    for (kelvin, wanted) in [
        (2000, [2.520_566_2, 0.646_888_26, 0.020_403_985]),
        (4500, [1.300_933, 0.945_619_6, 0.652_555_76]),
        (9000, [0.904_302_1, 0.993_889, 1.342_325_9]),
    ] {
        let more = format!(
            " bool treatAsPoint = true\n bool inputs:normalize = true\n float inputs:intensity = 4\n \
             bool inputs:enableColorTemperature = true\n float inputs:colorTemperature = {kelvin}"
        );
        let (desc, _) = lit(&format!("kelvin-{kelvin}"), "SphereLight", &more);
        let [LightDesc::Point { intensity, .. }] = desc.lights.as_slice() else {
            panic!("{:?}", desc.lights)
        };
        let rgb = intensity.emitted_rgb();
        assert!(rgb.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 0.05), "{kelvin}: {rgb:?} {wanted:?}");
    }
}

/// A dome of one colour is constant; a picture is around y, and one dome counts.
#[test]
fn a_dome_is_all_around() {
    let (desc, warnings) = stage(
        "dome",
        &format!(
            "{}def DomeLight \"D\" {{\n float inputs:intensity = 2\n}}\ndef DomeLight \"E\" {{\n}}\n",
            triangle("t", "")
        ),
    );
    let [LightDesc::Constant { radiance, .. }] = desc.lights.as_slice() else { panic!("{:?}", desc.lights) };
    assert!(is(f64::from(radiance.luminance()), 2.0));
    assert!(warnings.len() == 1 && warnings[0].contains("one light all around"), "{warnings:?}");
}

/// A mesh with `MeshLightAPI` shines as it is told.
#[test]
fn meshes_shine() {
    let mesh = triangle("t", " float inputs:intensity = 6")
        .replace("\"t\" {", "\"t\" (prepend apiSchemas = [\"MeshLightAPI\"]) {");
    let (desc, warnings) = stage("mesh-light", &mesh);
    assert!(warnings.is_empty(), "{warnings:?}");
    assert!(is(shape(&desc).1, 6.0));
}
