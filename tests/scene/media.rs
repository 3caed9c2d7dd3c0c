//! Participating media: what is read of them, where they are, and what is refused.

use std::path::Path;

use glam::{DVec3, Vec4};
use miette::{Diagnostic, Severity};

use pointillist::scene::desc::texture::SpectrumTexture;
use pointillist::scene::desc::{MediumDesc, MediumId, MediumInterface, PhaseDesc, SceneDesc};
use pointillist::scene::{
    FindingKind, LoadOptions, Loaded, SceneError, SceneWarning, load_str, load_str_with,
};
use pointillist::spectrum::Spectrum;

pub(crate) const SENSOR: &str = "<sensor type='perspective'/><emitter type='constant'/>";

/// A scene of this version whose body begins in line 2.
pub(crate) fn try_version(version: &str, body: &str, lenient: bool) -> Result<Loaded, SceneError> {
    let text = format!("<scene version='{version}'>{SENSOR}\n{body}</scene>");
    load_str_with("t.xml", &text, &LoadOptions { defines: &[], lenient })
}

pub(crate) fn read(body: &str) -> Loaded {
    try_version("3.0.0", body, false).unwrap_or_else(|e| panic!("{body}: {e:?}"))
}

/// The only medium of a scene, in a cube, read without a word.
fn medium_of(version: &str, plugin: &str, inner: &str) -> MediumDesc {
    let body = format!(
        "<shape type='cube'><bsdf type='null'/><medium type='{plugin}' name='interior'>{inner}</medium></shape>"
    );
    let loaded = try_version(version, &body, false).unwrap_or_else(|e| panic!("{inner}: {e:?}"));
    let old = usize::from(version.starts_with('0'));
    assert_eq!(loaded.warnings.len(), old, "{inner}: {:?}", loaded.warnings);
    let [medium] = loaded.desc.media.as_slice() else { panic!("{inner}: {}", loaded.desc.media.len()) };
    medium.clone()
}

pub(crate) fn medium(inner: &str) -> MediumDesc {
    medium_of("3.0.0", "homogeneous", inner)
}

pub(crate) fn phase(inner: &str) -> PhaseDesc {
    medium(inner).phase
}

/// Kind and place of the error of a scene, which says these words in its message or its help.
pub(crate) fn refused(body: &str, words: &str) -> (FindingKind, usize, usize) {
    let error = try_version("3.0.0", body, false).map(|_| ()).expect_err(body);
    let help = Diagnostic::help(&error).map(|help| help.to_string()).unwrap_or_default();
    assert!(format!("{error} {help}").contains(words), "{body}: {error} ({help})");
    let (_, line, column) = error.location();
    (error.kind(), line, column)
}

pub(crate) fn advice<'a>(loaded: &'a Loaded, words: &str) -> &'a SceneWarning {
    let found = loaded.warnings.iter().find(|warning| warning.to_string().contains(words));
    let found = found.unwrap_or_else(|| panic!("no `{words}` in {:?}", loaded.warnings));
    assert_eq!(found.severity(), Some(Severity::Advice), "{found:?}");
    found
}

pub(crate) fn constant(value: f32) -> Spectrum {
    Spectrum::Constant(value)
}

/// The values at 450, 550, 600 and 650 nm.
pub(crate) fn values(texture: &SpectrumTexture) -> [f32; 4] {
    texture.uniform().expect("the same everywhere").eval(Vec4::new(450.0, 550.0, 600.0, 650.0)).to_array()
}

fn near(found: [f32; 4], expected: [f32; 4], tolerance: f32) {
    let close = |(a, b): (f32, f32)| (a - b).abs() <= tolerance * b.abs().max(1e-3);
    assert!(found.into_iter().zip(expected).all(close), "{found:?}, not {expected:?}");
}

/// A grid of 2 × 2 × 2 numbers in a folder of its own.
pub(crate) fn folder(name: &str) -> std::path::PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("media_{name}"));
    let _ = std::fs::remove_dir_all(&folder); // not there the first time
    std::fs::create_dir_all(&folder).unwrap();
    let mut grid = b"VOL\x03".to_vec();
    [1, 2, 2, 2, 1_i32].iter().for_each(|n| grid.extend(n.to_le_bytes()));
    [0.0, 0.0, 0.0, 1.0, 1.0, 1.0_f32].iter().for_each(|v| grid.extend(v.to_le_bytes()));
    (0..8_u8).for_each(|i| grid.extend((f32::from(i) * 2.0).to_le_bytes()));
    std::fs::write(folder.join("smoke.vol"), grid).unwrap();
    folder
}

/// As Mitsuba 3.9.1 prints them.
#[test]
fn defaults_are_those_of_mitsuba() {
    for plugin in ["homogeneous", "heterogeneous"] {
        let body = format!(
            "<shape type='cube'><bsdf type='null'/><medium type='{plugin}' name='interior'/></shape>"
        );
        let loaded = read(&body);
        let [MediumDesc { sigma_t, albedo, scale, phase, emission }] = loaded.desc.media.as_slice() else {
            panic!()
        };
        assert!(emission.is_none());
        assert!(*sigma_t == constant(1.0) && *albedo == constant(0.75), "{plugin}");
        assert_eq!((*scale, phase), (1.0, &PhaseDesc::Isotropic));
        // Mitsuba cuts the second kind to a box.
        assert_eq!(loaded.warnings.len(), usize::from(plugin == "heterogeneous"), "{:?}", loaded.warnings);
    }
}

/// The values of `get_scattering_coefficients` in Mitsuba 3.9.1, spectral mode, at `scale` 3, of which the last is σₜ.
#[test]
fn colours_up_to_one_are_those_of_mitsuba() {
    let desc = medium(
        "<rgb name='sigma_t' value='.1 .5 .9'/><rgb name='albedo' value='.9 .5 .1'/><float name='scale' value='3'/>",
    );
    assert_eq!(desc.scale, 3.0);
    let sigma_t = values(&desc.sigma_t).map(|v| 3.0 * v);
    near(sigma_t, [2.595_15, 1.370_76, 0.768_888, 0.461_524], 0.02);
    let [t, albedo] = [sigma_t, values(&desc.albedo)];
    let scattered = [0, 1, 2, 3].map(|i| t[i] * albedo[i]);
    near(scattered, [0.350_819, 0.744_407, 0.571_815, 0.390_562], 0.02);
}

#[test]
fn coefficients_are_numbers_colours_spectra_and_volumes() {
    assert_eq!(medium("<float name='sigma_t' value='7.5'/>").sigma_t, constant(7.5));
    assert_eq!(medium("<spectrum name='sigma_t' value='3'/>").sigma_t, constant(3.0));
    assert_eq!(medium("<rgb name='sigma_t' value='2'/>").sigma_t, constant(2.0));
    assert_eq!(medium("<float name='albedo' value='.25'/>").albedo, constant(0.25));
    let steep = medium("<spectrum name='sigma_t' value='400:1, 700:5'/>");
    near(values(&steep.sigma_t), [1.0 + 2.0 / 3.0, 3.0, 3.0 + 2.0 / 3.0, 4.0 + 1.0 / 3.0], 1e-5);
    // Mitsuba refuses what is above 1.
    let large = medium("<rgb name='sigma_t' value='1 5 9'/>");
    let wide = Spectrum::unbounded_rgb([1.0, 5.0, 9.0]);
    assert_eq!(large.sigma_t, wide);
    let inner = |value: &str| format!("<volume type='constvolume' name='sigma_t'>{value}</volume>");
    assert_eq!(medium(&inner("<float name='value' value='9'/>")).sigma_t, constant(9.0));
    assert_eq!(medium(&inner("<rgb name='value' value='1 5 9'/>")).sigma_t, wide);
    let small = medium(&inner("<rgb name='value' value='.1 .5 .9'/>"));
    assert_eq!(small.sigma_t, Spectrum::reflectance_rgb([0.1, 0.5, 0.9]));
    let albedo = medium("<volume type='constvolume' name='albedo'><float name='value' value='.5'/></volume>");
    assert_eq!(albedo.albedo, constant(0.5));
    assert!(albedo.is_homogeneous() && albedo.plugin() == "homogeneous");
}

/// Mitsuba's colour grid of (1, 5, 9) has these values, which are those of an unbounded colour.
#[test]
fn a_colour_above_one_is_what_mitsubas_grids_make_of_it() {
    let found = Spectrum::extinction_rgb([1.0, 5.0, 9.0]);
    near(values(&found.into()), [8.677_41, 4.611_1, 2.583_23, 1.359_63], 0.03);
}

#[test]
fn grids_vary_in_space() {
    let folder = folder("grids");
    let scene = |medium: &str| {
        let text = format!(
            "<scene version='3.0.0'>{SENSOR}\n<shape type='cube'><bsdf type='null'/>{medium}</shape></scene>"
        );
        load_str(&folder.join("scene.xml").display().to_string(), &text, &[])
    };
    let grid = |name: &str| {
        format!(
            "<volume type='gridvolume' name='{name}'><string name='filename' value='smoke.vol'/></volume>"
        )
    };
    let of = |plugin: &str, inner: &str| {
        scene(&format!("<medium type='{plugin}' name='interior'>{inner}</medium>"))
    };
    let loaded = of("heterogeneous", &format!("{}{}", grid("sigma_t"), grid("albedo"))).unwrap();
    assert_eq!(loaded.warnings.len(), 0, "{:?}", loaded.warnings);
    let desc = &loaded.desc.media[0];
    assert!(!desc.is_homogeneous() && desc.plugin() == "heterogeneous");
    let SpectrumTexture::Volume(density) = &desc.sigma_t else { panic!("{:?}", desc.sigma_t) };
    assert_eq!(density.mean(), [7.0; 3]);
    assert!(matches!(desc.albedo, SpectrumTexture::Volume(_)));
    // What varies is written as such, and parts of σₜ do not vary.
    for (plugin, inner, words) in [
        ("homogeneous", grid("sigma_t"), "`sigma_t` is a grid"),
        ("homogeneous", grid("albedo"), "`albedo` is a grid"),
        ("heterogeneous", grid("sigma_s"), "`sigma_s` is a grid"),
    ] {
        let error = of(plugin, &inner).map(|_| ()).expect_err(words);
        assert!(error.to_string().contains(words) && error.location().1 == 2, "{error:?}");
    }
}

/// σₜ is the sum of both, and the albedo the share of σₛ, wavelength by wavelength.
#[test]
fn scattering_and_absorption_are_read_as_well() {
    let numbers = medium("<float name='sigma_s' value='3'/><float name='sigma_a' value='1'/>");
    assert!(numbers.sigma_t == constant(4.0) && numbers.albedo == constant(0.75));
    let clear = medium("<float name='sigma_a' value='2'/>");
    assert!(clear.sigma_t == constant(2.0) && clear.albedo == constant(0.0));
    let milk = medium("<float name='sigma_s' value='2'/>");
    assert!(milk.sigma_t == constant(2.0) && milk.albedo == constant(1.0));
    let nothing = medium("<float name='sigma_s' value='0'/>");
    assert!(nothing.sigma_t == constant(0.0) && nothing.albedo == constant(0.0));
    let spectra = medium(
        "<spectrum name='sigma_s' value='360:1, 830:1'/><spectrum name='sigma_a' value='400:0, 800:4'/>",
    );
    near(values(&spectra.sigma_t), [1.5, 2.5, 3.0, 3.5], 1e-5);
    near(values(&spectra.albedo), [1.0 / 1.5, 1.0 / 2.5, 1.0 / 3.0, 1.0 / 3.5], 1e-4);
    let colours = medium("<rgb name='sigma_s' value='.3 .2 .1'/><rgb name='sigma_a' value='.1 .2 .3'/>");
    let [s, a] = [[0.3, 0.2, 0.1], [0.1, 0.2, 0.3]].map(|rgb| values(&Spectrum::unbounded_rgb(rgb).into()));
    near(values(&colours.sigma_t), [0, 1, 2, 3].map(|i| s[i] + a[i]), 1e-4);
    near(values(&colours.albedo), [0, 1, 2, 3].map(|i| s[i] / (s[i] + a[i])), 1e-4);
}

/// Jensen et al. 2001, table 1.
#[test]
fn measured_materials_have_names() {
    let of = |name: &str| medium(&format!("<string name='material' value='{name}'/>"));
    for (name, scattering, absorption) in [
        ("skin1", [0.74, 0.88, 1.01], [0.032, 0.17, 0.48]),
        ("Wholemilk", [2.55, 3.21, 3.77], [0.0011, 0.0024, 0.014]),
        ("KETCHUP", [0.18, 0.07, 0.03], [0.061, 0.97, 1.45]),
    ] {
        let SpectrumTexture::Uniform(sigma_t) = of(name).sigma_t else { panic!("{name}") };
        for (found, (s, a)) in sigma_t.reflected_rgb().into_iter().zip(scattering.into_iter().zip(absorption))
        {
            let (wanted, found): (f32, f32) = (s + a, found);
            assert!((found - wanted).abs() < 0.02 * wanted.max(0.1), "{name}: {found}, not {wanted}");
        }
        // The share of light that ketchup scatters in the blue is that of no other.
        let albedo = values(&of(name).albedo);
        assert!(albedo.iter().all(|v| (0.0..=1.0).contains(v)), "{name}: {albedo:?}");
        assert_eq!(albedo[0] < 0.1, name == "KETCHUP", "{name}: {albedo:?}");
    }
    near(values(&of("spectralon").albedo), [1.0; 4], 1e-6);
    let at = refused(
        "<medium type='homogeneous'><string name='material' value='skim1'/></medium>",
        "did you mean `skin1`?",
    );
    assert_eq!(at, (FindingKind::Value, 2, 59));
}

#[test]
fn phase_functions() {
    assert_eq!(phase("<phase type='isotropic'/>"), PhaseDesc::Isotropic);
    assert_eq!(phase("<phase type='rayleigh'/>"), PhaseDesc::Rayleigh);
    assert_eq!(phase("<phase type='hg'/>"), PhaseDesc::HenyeyGreenstein { g: 0.8 });
    let hg = "<phase type='hg'><float name='g' value='-.3'/></phase>";
    assert_eq!(phase(hg), PhaseDesc::HenyeyGreenstein { g: -0.3 });
    let both = PhaseDesc::Blend {
        weight: 0.25,
        phases: Box::new([PhaseDesc::HenyeyGreenstein { g: -0.3 }, PhaseDesc::Isotropic]),
    };
    for weight in [
        "<float name='weight' value='.25'/>",
        "<volume type='constvolume' name='weight'><float name='value' value='.25'/></volume>",
    ] {
        assert_eq!(
            phase(&format!("<phase type='blendphase'>{weight}{hg}<phase type='isotropic'/></phase>")),
            both
        );
    }
    // By reference, too.
    let loaded = read(&format!(
        "{}<medium type='homogeneous' id='m'><ref id='p'/></medium>",
        hg.replace("'hg'", "'hg' id='p'")
    ));
    assert_eq!(loaded.desc.media[0].phase, PhaseDesc::HenyeyGreenstein { g: -0.3 });
}

/// Each is told at its value.
#[test]
fn what_cannot_be_is_refused_with_its_place() {
    use FindingKind::{Limit, Missing, Parameter, Plugin, Reference, Value};
    let of = |inner: &str| format!("<medium type='homogeneous'>{inner}</medium>");
    let in_phase = |inner: &str| of(&format!("<phase {inner}</phase>"));
    let hg = "<phase type='hg'/>";
    for (inner, words, kind) in [
        ("<float name='sigma_t' value='-1'/>", "negative", Value),
        ("<rgb name='sigma_t' value='1 -1 1'/>", "negative", Value),
        ("<float name='sigma_t' value='1e13'/>", "above 1e12", Value),
        ("<float name='sigma_t' value='inf'/>", "finite", Value),
        ("<float name='albedo' value='1.5'/>", "makes energy", Value),
        ("<rgb name='albedo' value='.5 2 .5'/>", "an albedo is in [0, 1]", Value),
        ("<spectrum name='albedo' value='400:.5, 700:1.5'/>", "makes energy", Value),
        ("<float name='albedo' value='-.1'/>", "negative", Value),
        ("<float name='scale' value='-2'/>", "from 0 to 1e12", Value),
        ("<float name='sigma_s' value='-2'/>", "negative", Value),
    ] {
        let (found, line, column) = refused(&of(inner), words);
        let wanted = 28 + inner.find("value='").unwrap() + "value='".len();
        assert_eq!((found, line, column), (kind, 2, wanted), "{inner}");
    }
    for (inner, words, kind) in [
        ("type='hg'><float name='g' value='1'/>", "between -1 and 1", Value),
        ("type='hg'><float name='g' value='-1.5'/>", "between -1 and 1", Value),
        ("type='hg'><float name='g' value='.99999999999'/>", "between -1 and 1", Value),
        ("type='blendphase'>", "two phase functions", Parameter),
        ("type='tabphase'>", "needs `values`", Missing),
        ("type='tabphase'><string name='values' value='1'/>", "two values at least", Value),
        ("type='tabphase'><string name='values' value=''/>", "two values at least", Value),
        ("type='tabphase'><string name='values' value='0, 0'/>", "are 0", Value),
        ("type='tabphase'><string name='values' value='1, -2, 1'/>", "-2 is negative", Value),
        ("type='tabphase'><string name='values' value='1, nan'/>", "finite", Value),
        ("type='tabphase'><string name='values' value='1; 2'/>", "not a number", Value),
        ("type='sggx'>", "needs `S`", Missing),
        ("type='sggx'><float name='S' value='1'/>", "six numbers", Value),
        (
            "type='sggx'><volume name='S' type='constvolume'><float name='value' value='1'/></volume>",
            "six numbers",
            Plugin,
        ),
        (
            "type='sggx'><volume name='S' type='constvolume'><string name='value' value='1 1 1'/></volume>",
            "these are 3",
            Value,
        ),
        (
            "type='sggx'><volume name='S' type='constvolume'><string name='value' value='1 1 1 2 0 0'/></volume>",
            "positive definite",
            Value,
        ),
        (
            "type='sggx'><volume name='S' type='constvolume'><string name='value' value='0 0 0 0 0 0'/></volume>",
            "positive definite",
            Value,
        ),
        (
            "type='sggx'><volume name='S' type='constvolume'><string name='value' value='1 1 -1 0 0 0'/></volume>",
            "positive definite",
            Value,
        ),
        (
            "type='sggx'><volume name='S' type='constvolume'><string name='value' value='1 1 inf 0 0 0'/></volume>",
            "finite",
            Value,
        ),
        ("type='hgg'>", "did you mean `hg`?", Plugin),
    ] {
        assert_eq!(refused(&in_phase(inner), words).0, kind, "{inner}");
    }
    let grid = "<volume type='gridvolume' name='weight'><string name='filename' value='none.vol'/></volume>";
    for (weight, words, kind) in [
        ("", "needs `weight`", Missing),
        ("<float name='weight' value='1.5'/>", "from 0 to 1", Value),
        (grid, "`gridvolume`", Plugin),
    ] {
        assert_eq!(
            refused(&in_phase(&format!("type='blendphase'>{weight}{hg}{hg}")), words).0,
            kind,
            "{weight}"
        );
    }
    assert_eq!(refused(&of(&hg.repeat(2)), "a second <phase>").0, Parameter);
    assert_eq!(refused("<medium type='homogenous'/>", "did you mean `homogeneous`?").0, Plugin);
    let circle = "<phase type='blendphase' id='p'><float name='weight' value='1'/><ref id='p'/><phase type='hg'/></phase>\
                  <medium type='homogeneous'><ref id='p'/></medium>";
    assert_eq!(refused(circle, "contains itself").0, Reference);
    let deep = (0..4).fold(hg.to_owned(), |inner, _| {
        format!("<phase type='blendphase'><float name='weight' value='.5'/>{}</phase>", inner.repeat(2))
    });
    assert_eq!(refused(&of(&deep), "more than 4 others").0, Limit);
    for both in [
        "<float name='sigma_t' value='1'/><float name='sigma_s' value='1'/>",
        "<float name='albedo' value='1'/><string name='material' value='skin1'/>",
        "<float name='sigma_a' value='1'/><string name='material' value='skin1'/>",
    ] {
        assert_eq!(refused(&of(both), "not both").0, Value, "{both}");
    }
    let folder = folder("curves");
    std::fs::write(folder.join("hair.txt"), "0 0 0 .1\n0 0 1 .1\n").unwrap();
    let hair = folder.join("hair.txt");
    let hair = format!(
        "<shape type='linearcurve'><string name='filename' value='{}'/><medium name='exterior' type='homogeneous'/></shape>",
        hair.display()
    );
    assert_eq!(refused(&hair, "curves bound no medium").0, Plugin);
    let shape = |inner: &str| format!("<shape type='cube'>{inner}</shape>");
    let wrong = shape("<phase type='hg' name='interior'/>");
    assert_eq!(refused(&wrong, "`interior` is a <medium>"), (Parameter, 2, 20));
    assert_eq!(refused(&shape("<ref name='interior' id='nothing'/>"), "no element with the id").0, Reference);
}

/// One description for each element, whoever refers to it; and names for messages.
#[test]
fn media_are_shared() {
    let loaded = read(
        "<medium type='homogeneous' id='fog'><float name='sigma_t' value='2'/></medium>\
         <shape type='cube'><bsdf type='null'/><ref name='interior' id='fog'/></shape>\
         <shape type='sphere'><bsdf type='null'/><ref name='exterior' id='fog'/>\
         <medium name='interior' type='homogeneous'/></shape>\
         <shape type='merge'><shape type='disk'><ref name='exterior' id='fog'/></shape></shape>\
         <shape type='shapegroup' id='g'><shape type='cube'><bsdf type='null'/><ref name='interior' id='fog'/></shape></shape>\
         <shape type='instance'><ref id='g'/></shape><shape type='rectangle'/>",
    );
    assert_eq!(loaded.warnings.len(), 0, "{:?}", loaded.warnings);
    let desc = loaded.desc;
    assert_eq!(desc.media.len(), 2);
    let ids: Vec<_> = desc.names.media.iter().map(|name| (name.id.as_deref(), name.place.line)).collect();
    assert_eq!(ids, [(Some("fog"), 2), (None, 2)]);
    let [fog, other] = [Some(MediumId(0)), Some(MediumId(1))];
    let sides: Vec<_> = desc.shapes.iter().map(|s| s.medium_interface).collect();
    let interface = |interior, exterior| MediumInterface { interior, exterior };
    let none = MediumInterface::default();
    assert_eq!(sides, [interface(fog, None), interface(other, fog), interface(None, fog), none, none]);
    assert_eq!(desc.groups[0].shapes[0].medium_interface, interface(fog, None));
    assert_eq!(desc.camera.medium, None);
}

#[test]
fn a_sensor_is_in_a_medium() {
    let scene = |medium: &str| {
        format!(
            "<scene version='3.0.0'><emitter type='constant'/><medium type='homogeneous' id='a'/>\
             <shape type='cube'><bsdf type='null'/><ref id='a' name='interior'/></shape>\
             <sensor type='perspective'>{medium}</sensor></scene>"
        )
    };
    let of = |medium: &str| {
        let loaded = load_str("t.xml", &scene(medium), &[]).unwrap();
        assert_eq!(loaded.warnings.len(), 0, "{:?}", loaded.warnings);
        (loaded.desc.camera.medium, loaded.desc.media.len())
    };
    assert_eq!(of(""), (None, 1));
    assert_eq!(of("<ref id='a'/>"), (Some(MediumId(0)), 1));
    assert_eq!(of("<ref id='a' name='medium'/>"), (Some(MediumId(0)), 1));
    assert_eq!(of("<medium type='homogeneous'/>"), (Some(MediumId(1)), 2));
    assert!(load_str("t.xml", &scene("<ref id='a'/><medium type='homogeneous'/>"), &[]).is_err());
}

/// What has no effect is told.
#[test]
fn remarks() {
    let loaded = read("<medium type='homogeneous' id='fog'/>");
    assert_eq!(advice(&loaded, "refers to this medium").location().1, 2);
    let medium = "<medium type='homogeneous' id='fog'/>\
                  <shape type='cube'><bsdf type='null'/><ref name='interior' id='fog'/></shape>";
    for body in [
        "<emitter type='point'><ref id='fog'/></emitter>",
        "<shape type='disk'><emitter type='area'><ref id='fog'/></emitter></shape>",
    ] {
        let loaded = read(&format!("{medium}{body}"));
        assert_eq!(loaded.warnings.len(), 1, "{:?}", loaded.warnings);
        advice(&loaded, "the medium around an emitter");
    }
    // Mitsuba's default bsdf hides what is within.
    let opaque = read("<shape type='cube'><medium name='interior' type='homogeneous'/></shape>");
    advice(&opaque, "it is opaque");
    assert_eq!(opaque.warnings.len(), 1);
    let idle = read(
        "<shape type='cube'><bsdf type='null'/><medium name='interior' type='homogeneous'>\
         <boolean name='has_spectral_extinction' value='true'/><boolean name='sample_emitters' value='true'/>\
         <float name='majorant_factor' value='1'/><integer name='majorant_resolution_factor' value='8'/>\
         <string name='strategy' value='balance'/><string name='method' value='woodcock'/></medium></shape>",
    );
    assert_eq!(idle.warnings.len(), 1, "{:?}", idle.warnings);
    advice(&idle, "have no effect");
    // A name that a shape has not, and a parameter that a medium has not, may be slips: warnings.
    for slip in [
        "<shape type='cube'><medium type='homogeneous'/></shape>",
        "<shape type='cube'><medium name='inside' type='homogeneous'/></shape>",
        "<shape type='cube'><bsdf type='null'/><medium name='interior' type='homogeneous'><float name='sigma' value='1'/></medium></shape>",
        "<shape type='cube'><subsurface type='singlescatter'/></shape>",
    ] {
        let loaded = read(slip);
        let [warning] = loaded.warnings.as_slice() else { panic!("{slip}: {:?}", loaded.warnings) };
        assert_ne!(warning.severity(), Some(Severity::Advice), "{warning:?}");
    }
    for (body, words) in [
        ("<shape type='shapegroup' id='g'><shape type='cube'/><ref id='fog'/></shape>", "no medium"),
        (
            "<shape type='shapegroup' id='g'><shape type='cube'/></shape><shape type='instance'><ref id='g'/><ref id='fog'/></shape>",
            "no medium",
        ),
    ] {
        assert_eq!(refused(&format!("{medium}{body}"), words).0, FindingKind::Parameter);
    }
}

/// A lenient run leaves out media that are not known, and scatters evenly in place of unknown phase functions.
#[test]
fn lenient_runs() {
    let shape = |inner: &str| format!("<shape type='cube'><bsdf type='null'/>{inner}</shape>");
    let read = |body: &str| try_version("3.0.0", body, true).unwrap_or_else(|e| panic!("{e:?}"));
    let unknown = format!(
        "<medium type='novel' id='m'/>{}",
        shape("<ref name='interior' id='m'/><medium name='exterior' type='homogeneous'/>")
    );
    let loaded = read(&unknown);
    let [warning] = loaded.warnings.as_slice() else { panic!("{:?}", loaded.warnings) };
    assert!(warning.to_string().contains("left out"), "{warning}");
    let interface = MediumInterface { interior: None, exterior: Some(MediumId(0)) };
    assert_eq!(loaded.desc.shapes[0].medium_interface, interface);
    let loaded = read(&shape(
        "<medium name='interior' type='homogeneous'><phase type='forward'/><float name='scale' value='2'/></medium>",
    ));
    assert!(loaded.warnings[0].to_string().contains("isotropic"), "{:?}", loaded.warnings);
    assert_eq!((loaded.desc.media[0].scale, &loaded.desc.media[0].phase), (2.0, &PhaseDesc::Isotropic));
}

#[test]
fn files_of_version_0_6() {
    let parts = "<rgb name='sigmaS' value='3'/><rgb name='sigmaA' value='1'/>";
    let desc = medium_of("0.6.0", "homogeneous", parts);
    assert!(desc.sigma_t == constant(4.0) && desc.albedo == constant(0.75));
    let desc = medium_of("0.6.0", "homogeneous", "<spectrum name='sigmaT' value='2.5'/>");
    assert_eq!(desc.sigma_t, constant(2.5));
    let body = "<shape type='cube'><bsdf type='null'/><medium type='heterogeneous' name='interior'>\
                <string name='method' value='woodcock'/><float name='scale' value='100'/>\
                <volume name='density' type='constvolume'><float name='value' value='.5'/></volume>\
                <volume name='albedo' type='constvolume'><spectrum name='value' value='.9'/></volume>\
                <phase type='hg'><float name='g' value='.1'/></phase></medium></shape>";
    let loaded = try_version("0.6.0", body, false).unwrap();
    let desc = &loaded.desc.media[0];
    assert!(desc.sigma_t == constant(0.5) && desc.albedo == constant(0.9) && desc.scale == 100.0);
    assert_eq!(desc.phase, PhaseDesc::HenyeyGreenstein { g: 0.1 });
    // In a file of today, a density is a slip.
    let today = try_version("3.0.0", body, false).unwrap();
    assert!(
        today.warnings.iter().any(|w| w.to_string().contains("has no `density`")),
        "{:?}",
        today.warnings
    );
}

/// σₜ is per length: where the scene is made 2⁻ⁿ times as large, it is 2ⁿ times as large.
#[test]
fn media_move_to_rendering_space() {
    let folder = folder("moved");
    let text = format!(
        "<scene version='3.0.0'>{SENSOR}<shape type='cube'><transform name='to_world'><scale value='100'/></transform>\
         <bsdf type='null'/><medium name='interior' type='heterogeneous'><float name='scale' value='3'/>\
         <volume name='sigma_t' type='gridvolume'><string name='filename' value='smoke.vol'/>\
         <transform name='to_world'><scale value='100'/></transform></volume></medium></shape></scene>"
    );
    let desc = load_str(&folder.join("scene.xml").display().to_string(), &text, &[]).unwrap().desc;
    let scale = desc.space.scale;
    assert!(scale < 0.1, "{scale}");
    let moved = desc.in_rendering_space();
    assert_eq!(moved.media[0].scale, 3.0 / scale);
    // Depth over the scene is the same, and the grid has moved with it.
    let at = |desc: &SceneDesc, p: DVec3| {
        let at = pointillist::scene::desc::texture::TexturePoint { p: p.as_vec3(), ..Default::default() };
        desc.media[0].sigma_t.scalar(&at)
    };
    for p in [DVec3::splat(50.0), DVec3::new(30.0, 60.0, 70.0), DVec3::new(80.0, 20.0, 45.0)] {
        let (before, after) = (at(&desc, p), at(&moved, desc.space.point(p)));
        assert!(before > 0.0 && (before - after).abs() < 1e-4 * before, "{p}: {before} {after}");
    }
}
