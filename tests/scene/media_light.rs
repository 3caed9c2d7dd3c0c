//! Tables and microflakes as phase functions, and media that shine.

use crate::media::{SENSOR, advice, constant, folder, medium, phase, read, refused, values};
use pointillist::scene::desc::{EmissionGrid, MicroflakeDesc, PhaseDesc};
use pointillist::scene::{FindingKind, load_str};
use pointillist::spectrum::{Spectrum, blackbody};

/// What a medium emits, which Mitsuba does not know: as the `radiance` of an area light, or a grid under D65.
#[test]
fn media_shine() {
    let radiance = |inner: &str| {
        let light = medium(inner).emission.expect("it shines");
        assert!(light.grid.is_none() && !light.is_black());
        light.radiance
    };
    assert_eq!(radiance("<float name='radiance' value='3'/>"), Spectrum::d65(3.0));
    assert_eq!(radiance("<rgb name='radiance' value='4 2 1'/>"), Spectrum::emission_rgb([4.0, 2.0, 1.0]));
    assert_eq!(radiance("<spectrum name='radiance' value='2'/>"), constant(2.0));
    let fire = radiance(
        "<spectrum name='radiance' type='blackbody'><float name='temperature' value='1900'/></spectrum>",
    );
    let [blue, .., red] = values(&fire.into());
    assert!(red > 20.0 * blue, "{red} {blue}");
    let dark = medium("<float name='radiance' value='0'/>");
    assert!(!dark.shines() && dark.emission.is_some() && !medium("").shines());
    let folder = folder("glow");
    let scene = |plugin: &str| {
        let text = format!(
            "<scene version='3.0.0'><sensor type='perspective'/>\n<shape type='cube'><bsdf type='null'/><medium type='{plugin}' name='interior'>\
             <volume type='gridvolume' name='radiance'><string name='filename' value='smoke.vol'/></volume></medium></shape></scene>"
        );
        load_str(&folder.join("scene.xml").display().to_string(), &text, &[])
    };
    let loaded = scene("heterogeneous").unwrap();
    // It is the only light, and its density is the same everywhere.
    assert_eq!(loaded.warnings.len(), 1, "{:?}", loaded.warnings);
    advice(&loaded, "does not vary");
    let mut fire = loaded.desc.media[0].clone();
    assert!(fire.shines() && !fire.is_homogeneous());
    let light = fire.emission.as_mut().unwrap();
    assert_eq!(light.grid.as_ref().unwrap().volume().mean(), [7.0; 3]);
    light.make_uniform();
    assert_eq!(light.radiance, Spectrum::d65(7.0));
    let error = scene("homogeneous").map(|_| ()).expect_err("it varies");
    assert!(error.to_string().contains("`radiance` is a grid") && error.location().1 == 2, "{error:?}");
    for (inner, words) in [
        ("<float name='radiance' value='-1'/>", "negative"),
        ("<rgb name='radiance' value='1 nan 1'/>", "number"),
    ] {
        let (kind, line, _) = refused(&format!("<medium type='homogeneous'>{inner}</medium>"), words);
        assert_eq!((kind, line), (FindingKind::Value, 2), "{inner}");
    }
    // Particles alone do not find it.
    let text = format!(
        "<scene version='3.0.0'><integrator type='light'/>{SENSOR}\n<shape type='cube'><bsdf type='null'/>\
         <medium type='homogeneous' name='interior'><float name='radiance' value='3'/></medium></shape></scene>"
    );
    let loaded = load_str("t.xml", &text, &[]).unwrap();
    assert!(loaded.warnings.iter().any(|w| w.to_string().contains("does not find")), "{:?}", loaded.warnings);
}

/// The light of a black body: its temperature is one number, in units of `temperature_scale`, and `emission_scale` a factor on all emission.
#[test]
fn media_glow_by_temperature() {
    let radiance = |inner: &str| {
        let light = medium(inner).emission.expect("it shines");
        assert!(light.grid.is_none() && !light.is_black());
        light.radiance
    };
    let body = radiance(
        "<spectrum name='radiance' type='blackbody'><float name='temperature' value='1900'/></spectrum>",
    );
    for inner in [
        "<float name='temperature' value='1900'/>",
        "<integer name='temperature' value='1900'/>",
        "<volume name='temperature' type='constvolume'><float name='value' value='1900'/></volume>",
        "<float name='temperature' value='0.5'/><float name='temperature_scale' value='3800'/>",
    ] {
        assert_eq!(radiance(inner), body, "{inner}");
    }
    let twice = radiance("<float name='temperature' value='1900'/><float name='emission_scale' value='2'/>");
    assert_eq!(twice, body.scaled(2.0));
    let lamp = radiance("<float name='radiance' value='3'/><float name='emission_scale' value='2'/>");
    assert_eq!(lamp, Spectrum::d65(6.0));
    let dark = medium("<float name='temperature' value='1900'/><float name='emission_scale' value='0'/>");
    assert!(!dark.shines());
    for (inner, words) in [
        ("<float name='radiance' value='1'/><float name='temperature' value='1900'/>", "not both"),
        ("<float name='temperature' value='0'/>", "above 0 K and not above 1e9 K"),
        ("<float name='temperature' value='-300'/>", "above 0 K"),
        ("<float name='temperature' value='2e9'/>", "not above 1e9 K"),
        ("<float name='temperature' value='nan'/>", "not a finite number"),
        ("<float name='temperature' value='inf'/>", "not a finite number"),
        (
            "<float name='temperature' value='2'/><float name='temperature_scale' value='1e9'/>",
            "not above 1e9 K",
        ),
        (
            "<float name='temperature' value='2'/><float name='temperature_scale' value='0'/>",
            "the factor on `temperature` is above 0",
        ),
        (
            "<float name='temperature' value='2'/><float name='emission_scale' value='-1'/>",
            "the factor on the emission is from 0 to 1e12",
        ),
        (
            "<volume name='temperature' type='constvolume'><float name='value' value='-2'/></volume>",
            "above 0 K",
        ),
    ] {
        let (kind, line, _) = refused(&format!("<medium type='homogeneous'>{inner}</medium>"), words);
        assert_eq!((kind, line), (FindingKind::Value, 2), "{inner}");
    }
    for (inner, words, kind) in [
        (
            "<rgb name='temperature' value='1'/>",
            "a <float> or a <volume>, not a <rgb>",
            FindingKind::Parameter,
        ),
        ("<volume name='temperature' type='constvolume'/>", "needs `value`", FindingKind::Missing),
    ] {
        let found = refused(&format!("<medium type='homogeneous'>{inner}</medium>"), words);
        assert_eq!((found.0, found.1), (kind, 2), "{inner}");
    }
    // Factors on nothing are told.
    let loaded = read(
        "<medium type='homogeneous' id='m'><float name='temperature_scale' value='2'/><float name='emission_scale' value='2'/></medium>",
    );
    for words in ["has no `temperature`", "has no `radiance` or `temperature`"] {
        assert!(loaded.warnings.iter().any(|w| w.to_string().contains(words)), "{:?}", loaded.warnings);
    }
}

/// Grids of temperatures, in units of `temperature_scale`: what cannot be one is dark, and is told.
#[test]
fn media_glow_by_grids_of_temperatures() {
    let folder = folder("kelvin");
    let write = |name: &str, channels: i32, points: &[f32]| {
        let mut grid = b"VOL\x03".to_vec();
        let count = points.len() as i32 / channels;
        [1, count, 1, 1, channels].iter().for_each(|n| grid.extend(n.to_le_bytes()));
        [0.0, 0.0, 0.0, 1.0, 1.0, 1.0_f32].iter().for_each(|v| grid.extend(v.to_le_bytes()));
        points.iter().for_each(|v| grid.extend(v.to_le_bytes()));
        std::fs::write(folder.join(name), grid).unwrap();
    };
    let scene = |plugin: &str, file: &str, inner: &str| {
        let text = format!(
            "<scene version='3.0.0'>{SENSOR}\n<shape type='cube'><bsdf type='null'/><medium type='{plugin}' name='interior'>\
             <volume type='gridvolume' name='temperature'><string name='filename' value='{file}'/></volume>{inner}</medium></shape></scene>"
        );
        load_str(&folder.join("scene.xml").display().to_string(), &text, &[])
    };
    let scales = "<float name='temperature_scale' value='200'/><float name='emission_scale' value='3'/>";
    let loaded = scene("heterogeneous", "smoke.vol", scales).unwrap();
    // It is the only light, and its density is the same everywhere.
    assert_eq!(loaded.warnings.len(), 1, "{:?}", loaded.warnings);
    advice(&loaded, "does not vary");
    let fire = loaded.desc.media[0].clone();
    assert!(fire.shines() && !fire.is_homogeneous());
    let light = fire.emission.unwrap();
    let Some(EmissionGrid::Temperatures(kelvin)) = &light.grid else { panic!("{:?}", light.grid) };
    assert_eq!((kelvin.mean(), &light.radiance), ([1400.0; 3], &constant(3.0)));
    // Its mean colour is the mean of the colours, and not the colour of the mean.
    let color = blackbody::colors(2800.0);
    let mean = (0..8).fold([0.0; 3], |sum, i| {
        let rgb = color(400.0 * i as f32);
        [0, 1, 2].map(|c| sum[c] + rgb[c] / 8.0)
    });
    let mut uniform = light.clone();
    uniform.make_uniform();
    assert!(uniform.grid.is_none());
    let expected = Spectrum::emission_rgb(mean.map(|v| 3.0 * v)).emitted_rgb();
    for (found, expected) in uniform.radiance.emitted_rgb().into_iter().zip(expected) {
        assert!((found - expected).abs() < 1e-3 * mean[0], "{found}, not {expected}");
    }
    let mut grey = light;
    grey.make_grey();
    let Some(EmissionGrid::Colors(colors)) = &grey.grid else { panic!("{:?}", grey.grid) };
    let luminance = 0.2126 * mean[0] + 0.7152 * mean[1] + 0.0722 * mean[2];
    assert!(colors.is_grey() && (colors.mean()[0] / luminance - 1.0).abs() < 1e-3, "{:?}", colors.mean());

    // Without a factor it is too cold to be seen.
    let cold = scene("heterogeneous", "smoke.vol", "").unwrap();
    assert!(cold.warnings.iter().any(|w| w.to_string().contains("above 14 K")), "{:?}", cold.warnings);
    write("bad.vol", 1, &[1500.0, 0.0, -1.0, f32::NAN, f32::INFINITY, 2e9, 1e9, 1300.0]);
    let loaded = scene("heterogeneous", "bad.vol", "").unwrap();
    let told = |words: &str| loaded.warnings.iter().any(|w| w.to_string().contains(words));
    assert!(told("4 of the 8 temperatures") && loaded.warnings.len() == 2, "{:?}", loaded.warnings);
    let light = loaded.desc.media[0].emission.as_ref().unwrap();
    let mean = light.grid.as_ref().unwrap().volume().mean()[0];
    assert!((mean / ((1e9 + 2800.0) / 8.0) - 1.0).abs() < 1e-6, "{mean}");
    write("dark.vol", 1, &[0.0, -1.0]);
    assert!(!scene("heterogeneous", "dark.vol", "").unwrap().desc.media[0].shines());

    write("color.vol", 3, &[1500.0, 1400.0, 1300.0]);
    for (plugin, file, words) in [
        ("heterogeneous", "color.vol", "this grid has 3 channels"),
        ("homogeneous", "smoke.vol", "`temperature` is a grid"),
        ("heterogeneous", "nothing.vol", "nothing.vol"),
    ] {
        let error = scene(plugin, file, scales).map(|_| ()).expect_err(file);
        assert!(error.to_string().contains(words) && error.location().1 == 2, "{error:?}");
    }
}

#[test]
fn tables_and_microflakes() {
    let values =
        |text: &str| phase(&format!("<phase type='tabphase'><string name='values' value='{text}'/></phase>"));
    assert_eq!(values("0.5, 1, 1e3"), PhaseDesc::Tabulated { values: [0.5, 1.0, 1e3].into() });
    assert_eq!(values("0 2"), PhaseDesc::Tabulated { values: [0.0, 2.0].into() });
    let six = "<volume name='S' type='constvolume'><string name='value' value='.5, .7, .3, .1, -.05, .08'/></volume>";
    let uniform = PhaseDesc::Microflakes(MicroflakeDesc::Uniform([0.5, 0.7, 0.3, 0.1, -0.05, 0.08]));
    assert_eq!(phase(&format!("<phase type='sggx'>{six}</phase>")), uniform);
    // Mitsuba's blend leaves out what flakes hide.
    let blend = "<phase type='blendphase'><float name='weight' value='.25'/><phase type='isotropic'/>";
    let loaded = read(&format!(
        "<medium type='homogeneous' id='m'>{blend}<phase type='sggx'>{six}</phase></phase></medium>"
    ));
    advice(&loaded, "which Mitsuba leaves out");
    assert!(loaded.desc.media[0].is_homogeneous());
}

/// Grids of six channels: one matrix everywhere is uniform, others vary, and those of no ellipsoid are refused.
#[test]
fn microflakes_on_grids() {
    let folder = folder("flakes");
    let write = |name: &str, channels: i32, points: &[f32]| {
        let mut grid = b"VOL\x03".to_vec();
        let count = points.len() as i32 / channels;
        [1, count, 1, 1, channels].iter().for_each(|n| grid.extend(n.to_le_bytes()));
        [0.0, 0.0, 0.0, 1.0, 1.0, 1.0_f32].iter().for_each(|v| grid.extend(v.to_le_bytes()));
        points.iter().for_each(|v| grid.extend(v.to_le_bytes()));
        std::fs::write(folder.join(name), grid).unwrap();
    };
    let (one, other, nothing) =
        ([1.0, 0.5, 0.25, 0.0, 0.25, 0.125], [0.5, 0.5, 0.5, 0.0, 0.0, 0.0], [0.0f32; 6]);
    write("one.vol", 6, &[one, one].concat());
    write("two.vol", 6, &[one, other, nothing].concat());
    write("bad.vol", 6, &[one, [1.0, 1.0, 1.0, 0.0, 2.0, 0.0], [1.0, 1.0, f32::NAN, 0.0, 0.0, 0.0]].concat());
    let of = |file: &str| {
        let text = format!(
            "<scene version='3.0.0'>{SENSOR}\n<shape type='cube'><bsdf type='null'/><medium type='homogeneous' name='interior'>\
             <phase type='sggx'><volume name='S' type='gridvolume'><string name='filename' value='{file}'/></volume></phase></medium></shape></scene>"
        );
        load_str(&folder.join("scene.xml").display().to_string(), &text, &[])
    };
    let uniform = of("one.vol").unwrap().desc.media[0].clone();
    assert_eq!(uniform.phase, PhaseDesc::Microflakes(MicroflakeDesc::Uniform(one.map(f64::from))));
    assert!(uniform.is_homogeneous());
    let loaded = of("two.vol").unwrap();
    assert_eq!(loaded.warnings.len(), 0, "{:?}", loaded.warnings);
    let mut varying = loaded.desc.media[0].clone();
    assert!(varying.phase.varies() && varying.plugin() == "heterogeneous");
    let PhaseDesc::Microflakes(MicroflakeDesc::Grid(grid)) = &varying.phase else {
        panic!("{:?}", varying.phase)
    };
    assert_eq!(grid.mean(), [0.5, 1.0 / 3.0, 0.25, 0.0, 0.25 / 3.0, 0.125 / 3.0]);
    assert!(grid.most() >= 1.0 && grid.most() < 1.5, "{}", grid.most());
    varying.phase.make_uniform();
    assert!(varying.is_homogeneous());
    for (file, words) in [("bad.vol", "2 of the 3 matrices"), ("smoke.vol", "six channels")] {
        let error = of(file).map(|_| ()).expect_err(file);
        assert!(error.to_string().contains(words) && error.location().1 == 2, "{error:?}");
    }
}
