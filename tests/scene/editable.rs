//! A scene with a little of everything that can be edited, and sets of edits of it.

use glam::DVec3;

use pointillist::scene::desc::*;
use pointillist::scene::edit::*;
use pointillist::scene::load_str;

/// The scene.
pub const SCENE: &str = r#"<scene version="3.0.0">
    <default name="glow" value="5"/>
    <sensor type="perspective"><transform name="to_world"><lookat origin="0.1, 1, 4" target="0, 0.5, 0" up="0, 1, 0"/></transform>
        <float name="fov" value="45"/>
        <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="24"/><rfilter type="tent"/></film>
        <sampler type="independent"><integer name="sample_count" value="12"/></sampler></sensor>
    <bsdf type="twosided" id="white"><bsdf type="diffuse"><rgb name="reflectance" value="0.7, 0.6, 0.5"/></bsdf></bsdf>
    <bsdf type="diffuse" id="red"><rgb name="reflectance" value="0.8, 0.1, 0.1"/></bsdf>
    <shape type="rectangle" id="floor"><transform name="to_world"><rotate x="1" angle="-90"/><scale value="4"/></transform><ref id="white"/></shape>
    <shape type="cube"><transform name="to_world"><scale value="0.4"/><translate x="-1" y="0.4"/></transform><ref id="red"/></shape>
    <shape type="cube"><transform name="to_world"><scale value="0.3"/><translate x="1" z="-1" y="0.4"/></transform><ref id="red"/></shape>
    <shape type="sphere"><float name="radius" value="0.5"/><point name="center" x="0.2" y="0.6" z="0.5"/>
        <bsdf type="dielectric"><float name="int_ior" value="1.5"/></bsdf></shape>
    <shape type="rectangle" id="lamp &amp; shade"><transform name="to_world"><rotate x="1" angle="90"/><translate y="3"/></transform>
        <emitter type="area"><rgb name="radiance" value="$glow"/></emitter></shape>
    <shape type="disk"><transform name="to_world"><rotate y="1"  angle="90"/><translate x="-3" y="1"/></transform>
        <emitter type="area"><spectrum name="radiance" value="400:1, 600:2, 700:1"/></emitter></shape>
    <emitter type="constant"><rgb name="radiance" value="0.1, 0.2, 0.4"/></emitter>
    <emitter type="point" id="bulb"><point name="position" x="1" y="2" z="1"/><float name="intensity" value="2"/></emitter>
</scene>
"#;

/// Its description.
pub fn example() -> SceneDesc {
    load_str("example.xml", SCENE, &[]).unwrap().desc
}

/// Everything about a scene but where it was read from.
pub fn essence(desc: &SceneDesc) -> String {
    let mut desc = desc.clone();
    desc.files.clear();
    desc.camera.place = Place::default();
    let of_groups = desc.groups.iter_mut().flat_map(|group| {
        group.place = Place::default();
        &mut group.shapes
    });
    desc.shapes.iter_mut().chain(of_groups).for_each(|s| s.place = Place::default());
    desc.names
        .bsdfs
        .iter_mut()
        .chain(&mut desc.names.lights)
        .chain(&mut desc.names.media)
        .for_each(|n| n.place = Place::default());
    for light in &mut desc.lights {
        match light {
            LightDesc::Constant { place, .. }
            | LightDesc::Map { place, .. }
            | LightDesc::SunSky(SunSkyDesc { place, .. })
            | LightDesc::Directional { place, .. }
            | LightDesc::Spot(SpotDesc { place, .. })
            | LightDesc::Projector(ProjectorDesc { place, .. })
            | LightDesc::Point { place, .. } => *place = Place::default(),
        }
    }
    // A negative zero is the same matrix.
    desc.camera.to_world.translation += DVec3::ZERO;
    format!("{desc:?}").replace("-0.0", "0.0")
}

/// Sets of edits, each unlike the others.
pub fn several() -> Vec<Vec<(Target, NewValue)>> {
    let dark = |i| (Target::Emission(i), NewValue::Scale(0.0));
    let out = |i| (Target::Light(i), NewValue::Scale(0.0));
    let (red, glass) = (BsdfId(2), BsdfId(3));
    vec![
        vec![(Target::Emission(4), NewValue::Scale(2.5))],
        vec![(Target::Emission(5), NewValue::Scale(0.3)), (Target::Light(1), NewValue::Scale(7.0))],
        vec![(Target::Reflectance(red), NewValue::Rgb([0.1, 0.7, 1.0 / 3.0]))],
        vec![(Target::Reflectance(BsdfId(0)), NewValue::Rgb([0.25; 3]))],
        vec![(Target::IntIor(glass), NewValue::Number(1.8)), (Target::Light(0), NewValue::Scale(1e-7))],
        vec![dark(4)],
        vec![dark(4), dark(5), out(0), out(1)],
        vec![(Target::Emission(4), NewValue::Scale(1e30)), (Target::Light(1), NewValue::Scale(1e30))],
    ]
}

/// As edits.
pub fn edits(values: &[(Target, NewValue)]) -> Edits {
    let mut edits = Edits::default();
    values.iter().for_each(|(t, v)| edits.set(*t, *v).unwrap());
    edits
}
