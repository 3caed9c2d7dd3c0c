//! Materials of version 0.6 that Mitsuba 3 has not, and what stands in the place of coats and polarisers.

use std::path::Path;

use miette::Severity;
use pointillist::scene::desc::{BsdfDesc, BsdfId, Facets, MaskDesc, MixtureDesc, WardVariant};
use pointillist::scene::edit::{BsdfNumber, Edits, NewValue, Target, editable};
use pointillist::scene::{FindingKind, Loaded, SceneError, load_str};
use pointillist::spectrum::Spectrum;
use pointillist::tracer::{MaterialClass, Scene};

/// A disk of a material, in the second line of a scene of version 0.6.
fn try_read(material: &str) -> Result<Loaded, SceneError> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/plugins/t.xml");
    let others = "<sensor type='perspective'/><emitter type='constant'/>";
    let scene = format!("<scene version='0.6.0'>{others}\n<shape type='disk'>{material}</shape></scene>");
    load_str(&beside.display().to_string(), &scene, &[])
}

/// What is said beside that the file is of version 0.6.
fn read(material: &str) -> (Loaded, Vec<(String, bool)>) {
    let loaded = try_read(material).unwrap_or_else(|e| panic!("{material}: {e:?}"));
    Scene::prepare(&loaded.desc).unwrap_or_else(|e| panic!("{material}: {e:?}"));
    let warnings = loaded.warnings.iter().filter(|w| !w.to_string().contains("0.6.0"));
    let told = warnings.map(|w| (w.to_string(), miette::Diagnostic::severity(w) == Some(Severity::Advice)));
    let told = told.collect();
    (loaded, told)
}

fn shown(loaded: &Loaded) -> BsdfDesc {
    loaded.desc.bsdfs[loaded.desc.shapes[0].bsdf.0 as usize].clone()
}

/// The material of a file of which nothing needs to be told.
fn bsdf(material: &str) -> BsdfDesc {
    let (loaded, told) = read(material);
    assert!(told.is_empty(), "{material}: {told:?}");
    shown(&loaded)
}

/// The material, and the only thing that is told: its words, and whether it is no more than a remark.
fn bsdf_told(material: &str) -> (BsdfDesc, String, bool) {
    let (loaded, told) = read(material);
    let [(words, advice)] = told.as_slice() else { panic!("{material}: {told:?}") };
    (shown(&loaded), words.clone(), *advice)
}

fn float(name: &str, value: f32) -> String {
    format!("<float name='{name}' value='{value}'/>")
}

fn of(plugin: &str, inner: &str) -> String {
    format!("<bsdf type='{plugin}'>{inner}</bsdf>")
}

fn constant(v: f32) -> Spectrum {
    Spectrum::Constant(v)
}

/// Parameters as version 0.6 writes them, and its defaults.
#[test]
fn parameters_and_defaults() {
    let BsdfDesc::RoughDiffuse(matt) = bsdf(&of("roughdiffuse", "")) else { panic!("rough diffuse") };
    assert!(matt.reflectance == constant(0.5) && matt.alpha == constant(0.2) && !matt.use_fast_approx);
    let text = format!(
        "<spectrum name='diffuseReflectance' value='.25'/>{}<boolean name='useFastApprox' value='true'/>",
        float("alpha", 0.0)
    );
    let BsdfDesc::RoughDiffuse(matt) = bsdf(&of("roughdiffuse", &text)) else { panic!("rough diffuse") };
    assert!(matt.reflectance == constant(0.25) && matt.alpha == constant(0.0) && matt.use_fast_approx);

    let BsdfDesc::Phong(phong) = bsdf(&of("phong", "")) else { panic!("phong") };
    assert!(phong.exponent == constant(30.0) && phong.specular_reflectance == constant(0.2), "{phong:?}");
    assert!(phong.diffuse_reflectance == constant(0.5), "{phong:?}");
    let text = format!("{}<spectrum name='specularReflectance' value='.25'/>", float("exponent", 7.5));
    let BsdfDesc::Phong(phong) = bsdf(&of("phong", &text)) else { panic!("phong") };
    assert!(phong.exponent == constant(7.5) && phong.specular_reflectance == constant(0.25));

    let BsdfDesc::Ward(ward) = bsdf(&of("ward", "")) else { panic!("ward") };
    assert!(ward.variant == WardVariant::Balanced && ward.roughness.alpha == [0.1; 2], "{ward:?}");
    assert!(ward.specular_reflectance == constant(0.2) && ward.diffuse_reflectance == constant(0.5));
    for (name, variant) in
        [("ward", WardVariant::Ward), ("ward-duer", WardVariant::Duer), ("balanced", WardVariant::Balanced)]
    {
        let text = format!("{}<string name='variant' value='{name}'/>", float("alphaU", 0.25));
        let BsdfDesc::Ward(ward) = bsdf(&of("ward", &text)) else { panic!("ward") };
        assert!(ward.variant == variant && ward.roughness.alpha == [0.25, 0.1], "{ward:?}");
    }

    let sheet = |text: &str| match bsdf(&of("difftrans", text)) {
        BsdfDesc::DiffuseTransmitter(sheet) => sheet.transmittance,
        other => panic!("{other:?}"),
    };
    assert_eq!(sheet(""), constant(0.5));
    assert_eq!(sheet("<spectrum name='transmittance' value='.75'/>"), constant(0.75));
}

/// None of them is traced by the code for Lambert's reflectors or for mirrors.
#[test]
fn material_classes() {
    for (plugin, class) in [
        ("diffuse", MaterialClass::Diffuse),
        ("roughdiffuse", MaterialClass::General),
        ("difftrans", MaterialClass::General),
        ("phong", MaterialClass::General),
        ("ward", MaterialClass::General),
    ] {
        let (loaded, _) = read(&of(plugin, ""));
        let scene = Scene::prepare(&loaded.desc).expect("valid");
        assert_eq!(scene.material_class(), class, "{plugin}");
    }
}

fn mixture(weights: &str, inner: &str) -> String {
    of("mixturebsdf", &format!("<string name='weights' value='{weights}'/>{inner}"))
}

const MATT: &str = "<bsdf type='diffuse'/>";
const SHINY: &str = "<bsdf type='roughconductor'/>";

#[test]
fn mixtures() {
    let shares = |bsdf: &BsdfDesc| match bsdf {
        BsdfDesc::Mixture(MixtureDesc { parts }) => parts.iter().map(|part| part.1).collect::<Vec<_>>(),
        other => panic!("{other:?}"),
    };
    let three = format!("{MATT}{SHINY}<bsdf type='phong'/>");
    assert_eq!(shares(&bsdf(&mixture("0.5, 0.25 .25", &three))), [0.5, 0.25, 0.25]);
    // The rest is black.
    let (loaded, told) = read(&mixture("0.5, 0.25", &format!("{MATT}{SHINY}")));
    assert!(told.is_empty(), "{told:?}");
    assert_eq!(shares(&shown(&loaded)), [0.5, 0.25, 0.25]);
    let BsdfDesc::Mixture(MixtureDesc { parts }) = shown(&loaded) else { panic!("a mixture") };
    let BsdfDesc::Diffuse(rest) = &loaded.desc.bsdfs[parts[2].0.0 as usize] else { panic!("black") };
    assert!(rest.reflectance.is_black());
    // Thirds that a file rounds leave nothing.
    let thirds = shares(&bsdf(&mixture("0.333, 0.333, 0.3333", &three)));
    assert!(thirds.len() == 3 && (thirds.iter().sum::<f32>() - 1.0).abs() < 1e-6, "{thirds:?}");
    let (scaled, words, advice) = bsdf_told(&mixture("1, 3", &format!("{MATT}{SHINY}")));
    assert!(shares(&scaled) == [0.25, 0.75] && words.contains("add up to 4") && !advice, "{words}");
    // One within another, and with holes.
    let nested = mixture("0.5 0.5", &format!("{}{MATT}", mixture("0.5 0.5", &format!("{SHINY}{MATT}"))));
    bsdf(&nested);
    bsdf(&of("mask", &nested));
    for (bad, kind) in [
        (of("mixturebsdf", MATT), FindingKind::Missing),
        (mixture("1", &format!("{MATT}{SHINY}")), FindingKind::Value),
        (mixture("", ""), FindingKind::Value),
        (mixture("0, 0", &format!("{MATT}{SHINY}")), FindingKind::Value),
        (mixture("2, -1", &format!("{MATT}{SHINY}")), FindingKind::Value),
        (mixture("half, half", &format!("{MATT}{SHINY}")), FindingKind::Value),
        (mixture(".2 .2 .2 .2 .2", &MATT.repeat(5)), FindingKind::Limit),
        // With its rest it is five.
        (mixture(".2 .2 .2 .2", &MATT.repeat(4)), FindingKind::Limit),
    ] {
        let error = try_read(&bad).expect_err("this must be refused");
        assert_eq!((error.kind(), error.location().1), (kind, 2), "{bad}: {error:?}");
    }
    let error = try_read(&mixture(".2 .2 .2 .2", &MATT.repeat(4))).expect_err("five");
    assert!(error.to_string().contains("0.200"), "{error}");
    assert_eq!(
        shares(&bsdf(&mixture("0.5 0 0.5 0 0", &MATT.repeat(5)))),
        [0.5, 0.5],
        "nothing of the others"
    );
    // A sheet has both sides already.
    let sheet = mixture("0.5, 0.5", &format!("<bsdf type='difftrans'/>{MATT}"));
    assert!(try_read(&of("twosided", &sheet)).is_err() && try_read(&sheet).is_ok());
}

/// What is out of range is refused at its place, or told.
#[test]
fn faults() {
    for bad in [
        of("phong", &float("exponent", -1.0)),
        of("ward", "<string name='variant' value='novel'/>"),
        of("ward", &float("alphaU", -1.0)),
        of("roughdiffuse", &float("alpha", -1.0)),
        of("difftrans", "<spectrum name='transmittance' value='-1'/>"),
    ] {
        let error = try_read(&bad).expect_err("this must be refused");
        assert_eq!(error.location().1, 2, "{bad}: {error:?}");
    }
    let (sharp, words, advice) = bsdf_told(&of("phong", &float("exponent", 1e9)));
    let BsdfDesc::Phong(sharp) = sharp else { panic!("{sharp:?}") };
    assert!(sharp.exponent == constant(1e6) && words.contains("counts as") && !advice, "{words}");
    let much = "<spectrum name='specularReflectance' value='.8'/>";
    for plugin in ["phong", "ward"] {
        let (_, words, advice) = bsdf_told(&of(plugin, much));
        assert!(words.contains("add up to more than 1") && !advice, "{words}");
    }
}

/// A map of normals is taken by whatever name it has, if it is the only texture.
#[test]
fn normal_maps_by_other_names() {
    let picture = |name: &str| {
        format!(
            "<texture {name} type='bitmap'><string name='filename' value='bsdf_normalmap.png'/>\
             <boolean name='raw' value='true'/></texture>"
        )
    };
    for name in ["", "name='normals'", "name='map'"] {
        let (map, words, advice) = bsdf_told(&of("normalmap", &format!("{}{MATT}", picture(name))));
        assert!(matches!(map, BsdfDesc::NormalMap(_)) && advice && words.contains("normalmap"), "{words}");
    }
    bsdf(&of("normalmap", &format!("{}{MATT}", picture("name='normalmap'"))));
    let two = format!("{}{}{MATT}", picture("name='a'"), picture("name='b'"));
    assert_eq!(try_read(&of("normalmap", &two)).expect_err("which").kind(), FindingKind::Missing);
    // Another texture beside the right one is told of.
    let (_, told) =
        read(&of("normalmap", &format!("{}{}{MATT}", picture("name='normalmap'"), picture("name='b'"))));
    assert!(told.len() == 1 && told[0].0.contains("no `b`"), "{told:?}");
}

/// Parameters and defaults of coats; what they stand over, and what is refused.
#[test]
fn coats() {
    for plugin in ["coating", "roughcoating"] {
        let bare = bsdf(&of(plugin, MATT));
        let coat = bare.coat().expect("a coat");
        assert!((coat.eta - 1.5168 / 1.000_277).abs() < 1e-3 && coat.thickness == 1.0, "{coat:?}");
        assert!(*coat.sigma_a == constant(0.0) && *coat.specular_reflectance == constant(1.0), "{coat:?}");
        let alpha = coat.roughness.map(|roughness| (roughness.facets, roughness.alpha));
        assert_eq!(alpha, (plugin == "roughcoating").then_some((Facets::Beckmann, [0.1; 2])));
        let text = [
            float("intIOR", 1.75) + &float("extIOR", 1.25) + &float("thickness", 0.5),
            "<spectrum name='sigmaA' value='2.5'/><spectrum name='specularReflectance' value='.25'/>".into(),
            SHINY.into(),
        ];
        let full = bsdf(&of(plugin, &text.concat()));
        let coat = full.coat().expect("a coat");
        assert!((coat.eta - 1.4).abs() < 1e-6 && coat.thickness == 0.5, "{coat:?}");
        assert!(*coat.sigma_a == constant(2.5) && *coat.specular_reflectance == constant(0.25), "{coat:?}");
        // Without bound as a colour, and by a texture.
        let (loaded, told) = read(&of(plugin, &format!("<rgb name='sigma_a' value='0.5, 2, 8'/>{MATT}")));
        assert!(told.is_empty(), "{told:?}");
        let [r, _, b] = shown(&loaded).coat().expect("a coat").sigma_a.mean().reflected_rgb();
        assert!((r - 0.5).abs() < 0.2 && (b - 8.0).abs() < 0.4, "{r} {b}");
        let board = "<texture type='checkerboard' name='sigma_a'/>";
        assert!(bsdf(&of(plugin, &format!("{board}{MATT}"))).coat().expect("a coat").sigma_a.varies());
        // Within a pair, a mixture and a map, and over them.
        let picture = "<texture type='bitmap' name='m'><string name='filename' value='bsdf_bumpmap.png'/><boolean name='raw' value='true'/></texture>";
        let both = of("blendbsdf", &format!("{}{MATT}{SHINY}", float("weight", 0.5)));
        for inner in [MATT, SHINY, &of("plastic", ""), &of("twosided", MATT), &of("difftrans", ""), &both] {
            let coated = of(plugin, inner);
            bsdf(&coated);
            bsdf(&of("bumpmap", &format!("{picture}{coated}")));
            bsdf(&of(plugin, &of("bumpmap", &format!("{picture}{inner}"))));
            bsdf(&of("mask", &coated));
            bsdf(&of("blendbsdf", &format!("{}{coated}{MATT}", float("weight", 0.5))));
        }
        let (_, words, advice) = bsdf_told(&of(plugin, &of("mask", MATT)));
        assert!(advice && words.contains("holes"), "{words}");
        for (bad, kind) in [
            (String::new(), FindingKind::Parameter),
            (format!("{MATT}{MATT}"), FindingKind::Parameter),
            (float("thickness", -1.0) + MATT, FindingKind::Value),
            (format!("<spectrum name='sigmaA' value='-1'/>{MATT}"), FindingKind::Value),
            (of("coating", MATT), FindingKind::Plugin),
            (of("twosided", &of("roughcoating", MATT)), FindingKind::Plugin),
        ] {
            let error = try_read(&of(plugin, &bad)).expect_err("this must be refused");
            assert_eq!((error.kind(), error.location().1), (kind, 2), "{bad}: {error:?}");
        }
        let (loaded, _) = read(&of("twosided", &of(plugin, MATT)));
        let scene = Scene::prepare(&loaded.desc).expect("valid");
        assert_eq!(scene.material_class(), MaterialClass::Mixed);
    }
}

/// The weights of a mixture count in proportion; a coat's numbers and colours are its own.
#[test]
fn weights_and_coats_can_be_edited() {
    let (loaded, _) = read(&mixture("0.5, 0.25 .25", &format!("{MATT}{SHINY}<bsdf type='phong'/>")));
    let bsdf = loaded.desc.shapes[0].bsdf;
    let labels: Vec<String> = editable(&loaded.desc, 0).into_iter().map(|value| value.label).collect();
    for label in ["weight of the first part", "weight of the third part", "exponent of the third part"] {
        assert!(labels.iter().any(|known| known == label), "no {label} in {labels:?}");
    }
    let mut edits = Edits::default();
    for (number, value) in [(BsdfNumber::Weight1, 1.0), (BsdfNumber::Weight3, 0.75)] {
        edits.set(Target::Number(bsdf, number), NewValue::Number(value)).expect("in range");
    }
    let changed = edits.apply(&loaded.desc).expect("the material is there");
    let BsdfDesc::Mixture(mixture) = &changed.bsdfs[bsdf.0 as usize] else { panic!("a mixture") };
    let shares: Vec<f32> = mixture.shares().map(|(_, share)| share).collect();
    assert_eq!(shares, [0.5, 0.125, 0.375]);
    Scene::prepare(&loaded.desc).expect("valid").edited(&changed).expect("valid");
    assert!(edits.set(Target::Number(bsdf, BsdfNumber::Weight1), NewValue::Number(-0.1)).is_err());
    // A mixture of nothing is black, and has no fourth weight.
    for number in [BsdfNumber::Weight1, BsdfNumber::Weight2, BsdfNumber::Weight3] {
        edits.set(Target::Number(bsdf, number), NewValue::Number(0.0)).expect("in range");
    }
    Scene::prepare(&edits.apply(&loaded.desc).expect("valid")).expect("valid");
    assert!(Target::Number(bsdf, BsdfNumber::Weight4).get(&loaded.desc).is_err());

    let (loaded, _) = read(&of("roughcoating", MATT));
    let values = editable(&loaded.desc, 0);
    for label in
        ["thickness of the coat", "roughness of the coat", "index of refraction of the coat", "reflectance"]
    {
        assert!(values.iter().any(|value| value.label == label), "no {label} in {values:?}");
    }
    let mut edits = Edits::default();
    let bsdf = loaded.desc.shapes[0].bsdf;
    for (number, value) in [(BsdfNumber::Thickness, 2.0), (BsdfNumber::Alpha, 0.5)] {
        edits.set(Target::Number(bsdf, number), NewValue::Number(value)).expect("in range");
    }
    let changed = edits.apply(&loaded.desc).expect("valid");
    let coat = changed.bsdfs[bsdf.0 as usize].coat().expect("a coat");
    assert_eq!((coat.thickness, coat.roughness.map(|r| r.alpha)), (2.0, Some([0.5; 2])));
}

/// What polarises lets through what it lets through of unpolarised light.
#[test]
fn stand_ins() {
    let (plastic, words, advice) = bsdf_told(&of("pplastic", &float("alpha", 0.25)));
    let BsdfDesc::RoughPlastic(plastic) = plastic else { panic!("{plastic:?}") };
    assert!(plastic.roughness.alpha == [0.25; 2] && advice && words.contains("pplastic"), "{words}");

    let half = "<spectrum name='transmittance' value='.5'/>";
    let theta = float("theta", 30.0);
    for (plugin, inner, through) in [
        ("polarizer", "", 0.5),
        ("polarizer", half, 0.25),
        ("polarizer", &theta, 0.5),
        ("circular", "", 0.5),
        ("retarder", "", 1.0),
        ("retarder", half, 0.5),
    ] {
        let (mask, words, advice) = bsdf_told(&of(plugin, inner));
        let BsdfDesc::Mask(MaskDesc { opacity, .. }) = mask else { panic!("{mask:?}") };
        assert!((opacity.mean_scalar() - (1.0 - through)).abs() < 1e-5, "{plugin}: {opacity:?}");
        assert!(advice && words.contains(plugin), "{words}");
    }
    // What has no equivalent is refused by its name.
    for plugin in ["hanrahankrueger", "irawan", "hk"] {
        let error = try_read(&of(plugin, "")).expect_err("not supported");
        assert_eq!((error.kind(), error.location().1), (FindingKind::Plugin, 2));
        assert!(error.to_string().contains(plugin), "{error}");
    }
}

/// Numbers and colours can be changed, also within a mixture.
#[test]
fn values_can_be_edited() {
    let parts = [of("roughdiffuse", ""), of("phong", ""), of("ward", ""), of("difftrans", "")].concat();
    let (loaded, _) = read(&mixture("0.25 0.25 0.25 0.25", &parts));
    let values = editable(&loaded.desc, 0);
    let labels: Vec<&str> = values.iter().map(|value| value.label.as_str()).collect();
    for label in [
        "reflectance of the first part",
        "roughness of the first part",
        "exponent of the second part",
        "specular reflectance of the second part",
        "roughness of the third part",
        "specular transmittance of the fourth part",
    ] {
        assert!(labels.contains(&label), "no {label} in {labels:?}");
    }
    for (number, value, plugin) in [
        (BsdfNumber::Alpha, 0.7, "roughdiffuse"),
        (BsdfNumber::Exponent, 80.0, "phong"),
        (BsdfNumber::Alpha, 0.3, "ward"),
    ] {
        let at = loaded.desc.bsdfs.iter().position(|bsdf| bsdf.plugin() == plugin).expect("a part");
        let target = Target::Number(BsdfId(at as u32), number);
        let mut edits = Edits::default();
        edits.set(target, NewValue::Number(value)).expect("in range");
        let changed = edits.apply(&loaded.desc).expect("the material is there");
        let now =
            editable(&changed, 0).into_iter().find(|value| value.target == target).expect("still there");
        let NewValue::Number(now) = now.value else { panic!("a number") };
        assert!((now - value).abs() < 1e-6 && editable(&changed, 0) != values);
    }
}
