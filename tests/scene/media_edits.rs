//! Media that are edited, saved and read back.

use std::path::Path;

use crate::editable::essence;
use pointillist::scene::desc::{MediumId, PhaseDesc};
use pointillist::scene::edit::{Edits, NewValue, Target, editable, lights_and_media};
use pointillist::scene::{load, load_str};
use pointillist::spectrum::Spectrum;

/// A scene with media that can be edited.
const FOGGY: &str = "<scene version='3.0.0'><emitter type='constant'/>
    <medium type='homogeneous' id='fog'><rgb name='sigma_t' value='.2 .4 .8'/><float name='albedo' value='.9'/><phase type='hg'/></medium>
    <sensor type='perspective'><ref id='fog'/></sensor>
    <shape type='cube' id='box'><bsdf type='null'/><ref name='interior' id='fog'/></shape>
    <shape type='sphere'><bsdf type='null'/><ref name='exterior' id='fog'/><medium name='interior' type='homogeneous'>
        <float name='scale' value='5'/><float name='radiance' value='2'/></medium></shape>
</scene>";

/// A scene with a fire, a black body of these temperatures.
fn fire(temperature: &str) -> String {
    format!(
        "<scene version='3.0.0'><sensor type='perspective'/><shape type='cube'><bsdf type='null'/>
    <medium type='heterogeneous' id='fire' name='interior'>{temperature}<float name='emission_scale' value='0.5'/></medium></shape></scene>"
    )
}

/// The emission of a fire is edited by a factor, which is saved and read back; its temperature stays.
#[test]
fn fires_can_be_edited() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fire_saved");
    std::fs::create_dir_all(&folder).unwrap();
    let mut grid = b"VOL\x03".to_vec();
    [1, 2, 1, 1, 1_i32].iter().for_each(|n| grid.extend(n.to_le_bytes()));
    [0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.5, 1.0_f32].iter().for_each(|v| grid.extend(v.to_le_bytes()));
    std::fs::write(folder.join("kelvin.vol"), grid).unwrap();
    let on_grid =
        "<volume name='temperature' type='gridvolume'><string name='filename' value='kelvin.vol'/></volume>
        <float name='temperature_scale' value='2000'/>";
    let (original, saved) = (folder.join("fire.xml"), folder.join("saved.xml"));
    for temperature in [on_grid, "<float name='temperature' value='1500'/>"] {
        std::fs::write(&original, fire(temperature)).unwrap();
        let desc = load(&original, &[]).unwrap().desc;
        let emission = Target::MediumEmission(MediumId(0));
        assert_eq!(emission.get(&desc), Ok(NewValue::Scale(1.0)));
        let mut edits = Edits::default();
        edits.set(emission, NewValue::Scale(2.5)).unwrap();
        let applied = edits.apply(&desc).unwrap();
        let [before, after] = [&desc, &applied].map(|desc| desc.media[0].emission.as_ref().unwrap());
        assert_eq!(after.radiance, before.radiance.scaled(2.5));
        let means = [before, after].map(|light| light.grid.as_ref().map(|grid| grid.volume().mean()));
        assert_eq!(means[0], means[1]);
        if temperature == on_grid {
            assert_eq!((means[0], &after.radiance), (Some([1500.0; 3]), &Spectrum::Constant(1.25)));
        }
        edits.write(&saved, &original, &[], &desc).unwrap();
        let text = std::fs::read_to_string(&saved).unwrap();
        let line = "<edit object=\"medium\" id=\"fire\" name=\"emission_scale\" value=\"2.5\"/>";
        assert!(text.contains(line), "{text}");
        let read = load(&saved, &[]).unwrap().desc;
        assert_eq!(read.media[0].emission.as_ref().unwrap().radiance, after.radiance);
    }
}

#[test]
fn media_can_be_edited() {
    let desc = load_str("fog.xml", FOGGY, &[]).unwrap().desc;
    let labels = |i| editable(&desc, i).into_iter().map(|e| e.label).collect::<Vec<_>>();
    assert_eq!(
        labels(0),
        [
            "density of medium \"fog\" (interior, shared by 2 shapes)",
            "extinction colour of medium \"fog\" (interior, shared by 2 shapes)",
            "albedo of medium \"fog\" (interior, shared by 2 shapes)",
            "mean cosine of scattering of medium \"fog\" (interior, shared by 2 shapes)",
        ]
    );
    assert_eq!(
        labels(1)[..5],
        [
            "density of the medium (interior)",
            "extinction colour of the medium (interior)",
            "albedo of the medium (interior)",
            "emission of the medium (interior)",
            "density of medium \"fog\" (exterior, shared by 2 shapes)",
        ]
    );
    assert!(lights_and_media(&desc).iter().any(|e| e.label.contains("around the camera")));
    let (fog, other) = (MediumId(0), MediumId(1));
    assert_eq!(Target::Density(other).get(&desc), Ok(NewValue::Scale(1.0)));
    assert_eq!(Target::Asymmetry(fog).get(&desc), Ok(NewValue::Number(0.8)));
    assert!(Target::Asymmetry(other).get(&desc).is_err());
    let NewValue::Rgb(colour) = Target::ExtinctionColor(fog).get(&desc).unwrap() else { panic!() };
    assert!(colour.iter().zip([0.25, 0.5, 1.0]).all(|(a, b)| (a - b).abs() < 0.01), "{colour:?}");

    let mut edits = Edits::default();
    edits.set(Target::Density(fog), NewValue::Scale(2.5)).unwrap();
    edits.set(Target::ExtinctionColor(fog), NewValue::Rgb([0.5, 0.25, 0.125])).unwrap();
    edits.set(Target::Albedo(fog), NewValue::Rgb([0.5, 0.6, 0.7])).unwrap();
    edits.set(Target::Asymmetry(fog), NewValue::Number(-0.25)).unwrap();
    edits.set(Target::Density(other), NewValue::Scale(0.1)).unwrap();
    assert!(Target::MediumEmission(fog).get(&desc).is_err());
    edits.set(Target::MediumEmission(other), NewValue::Scale(2.5)).unwrap();
    assert!(edits.set(Target::Asymmetry(fog), NewValue::Number(1.0)).is_err());
    assert!(edits.set(Target::Density(fog), NewValue::Scale(-1.0)).is_err());
    let applied = edits.apply(&desc).unwrap();
    let changed = &applied.media[0];
    assert_eq!((changed.scale, &changed.phase), (2.5, &PhaseDesc::HenyeyGreenstein { g: -0.25 }));
    assert_eq!(changed.albedo, Spectrum::reflectance_rgb([0.5, 0.6, 0.7]));
    let extinction = changed.sigma_t.uniform().unwrap().reflected_rgb();
    let close = extinction.iter().zip([0.8, 0.4, 0.2]).all(|(a, b)| (a - b).abs() < 0.01);
    assert!(close, "{extinction:?}");
    assert_eq!(applied.media[1].scale, 0.5);
    assert_eq!(applied.media[1].emission.as_ref().unwrap().radiance, Spectrum::d65(5.0));
}

/// Changes and a moved camera are saved, and the scene that is read back is the edited one.
#[test]
fn edits_of_media_are_saved() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("media_saved");
    std::fs::create_dir_all(&folder).unwrap();
    let original = folder.join("fog.xml");
    std::fs::write(&original, FOGGY).unwrap();
    let desc = load(&original, &[]).unwrap().desc;
    let mut edits = Edits::default();
    edits.set(Target::Density(MediumId(0)), NewValue::Scale(2.5)).unwrap();
    edits.set(Target::Albedo(MediumId(0)), NewValue::Rgb([0.5, 0.6, 0.7])).unwrap();
    edits.set(Target::Asymmetry(MediumId(0)), NewValue::Number(-0.25)).unwrap();
    edits.set(Target::Density(MediumId(1)), NewValue::Scale(0.1)).unwrap();
    edits.set(Target::MediumEmission(MediumId(1)), NewValue::Scale(2.5)).unwrap();
    let mut camera = desc.camera.clone();
    camera.to_world.translation.x += 1.0;
    edits.camera = Some(camera);
    let saved = folder.join("saved.xml");
    edits.write(&saved, &original, &[], &desc).unwrap();
    let text = std::fs::read_to_string(&saved).unwrap();
    for line in [
        "<edit object=\"medium\" id=\"fog\" name=\"density_scale\" value=\"2.5\"/>",
        "<edit object=\"medium\" index=\"1\" count=\"2\" type=\"homogeneous\" name=\"density_scale\" value=\"0.1\"/>",
        "<edit object=\"medium\" index=\"1\" count=\"2\" type=\"homogeneous\" name=\"emission_scale\" value=\"2.5\"/>",
        "<ref id=\"fog\"/>",
    ] {
        assert!(text.contains(line), "{text}");
    }
    let read = load(&saved, &[]).unwrap().desc;
    assert_eq!(read.camera.medium, Some(MediumId(0)));
    assert_eq!(essence(&read), essence(&edits.apply(&desc).unwrap()));
    // A medium without an id cannot be named by another sensor.
    let inline = FOGGY.replace(
        "<sensor type='perspective'><ref id='fog'/>",
        "<sensor type='perspective'><medium type='homogeneous'/>",
    );
    std::fs::write(&original, inline).unwrap();
    let desc = load(&original, &[]).unwrap().desc;
    let edits = Edits { camera: Some(desc.camera.clone()), values: Vec::new() };
    let error = edits.write(&saved, &original, &[], &desc).expect_err("no name");
    assert!(error.to_string().contains("no id"), "{error}");
}
