//! What other renderers' files ask for and this program has not: methods, films, unknown plugins.

use miette::{Diagnostic, Severity};
use pointillist::scene::desc::{BsdfDesc, DiffuseDesc, IntegratorDesc, IntegratorKind, ReconstructionFilter};
use pointillist::scene::{FindingKind, LoadOptions, Loaded, SceneError, SceneWarning, load_str_with};
use pointillist::spectrum::Spectrum;

fn try_read(body: &str, lenient: bool) -> Result<Loaded, SceneError> {
    let text = format!("<scene version=\"3.0.0\">\n{body}</scene>");
    load_str_with("t.xml", &text, &LoadOptions { defines: &[], lenient })
}

const SENSOR: &str = "<sensor type=\"perspective\"/><emitter type=\"constant\"/>";

fn read(body: &str) -> Loaded {
    try_read(&format!("{SENSOR}{body}"), false).unwrap_or_else(|e| panic!("{body}: {e:?}"))
}

fn is_advice(warning: &SceneWarning) -> bool {
    warning.severity() == Some(Severity::Advice)
}

fn words(warnings: &[SceneWarning]) -> String {
    warnings.iter().map(|w| format!("{w:?}\n")).collect()
}

/// The integrator of a file, and if all that was said is advice.
fn integrator(body: &str) -> (IntegratorDesc, bool) {
    let loaded = read(body);
    (loaded.desc.integrator, loaded.warnings.iter().all(is_advice))
}

#[test]
fn foreign_methods_become_ours() {
    use IntegratorKind::{Auto, Bidirectional, Depth, Light, Path, Photon};
    for (name, kind, known) in [
        ("volpath", Path, true),
        ("volpathmis", Path, true),
        ("prb", Path, true),
        ("prbvolpath", Path, true),
        ("volpath_simple", Path, true),
        ("bdpt", Bidirectional, true),
        ("mlt", Bidirectional, true),
        ("pssmlt", Bidirectional, true),
        ("erpt", Bidirectional, true),
        ("ppm", Photon, true),
        ("sppm", Photon, true),
        ("photonmapper", Photon, true),
        ("ptracer", Light, true),
        ("path_guiding_integrator", Auto, false),
        ("depth", Depth, true),
    ] {
        let text =
            format!("<integrator type=\"{name}\"><integer name=\"max_depth\" value=\"7\"/></integrator>");
        let (read, advice) = integrator(&text);
        assert_eq!((read.kind, read.max_depth, advice), (kind, Some(7), known), "{name}");
    }
    let (direct, advice) = integrator(
        "<integrator type=\"direct\"><integer name=\"shading_samples\" value=\"4\"/></integrator>",
    );
    assert!(advice && direct.kind == Path && direct.max_depth == Some(2), "{direct:?}");
}

/// The settings of a method that ours stands for are told of in one line.
#[test]
fn settings_of_foreign_methods_are_one_remark() {
    let text = "<integrator type=\"sppm\"><integer name=\"photon_count\" value=\"1000\"/><integer name=\"k_nn\" value=\"5\"/>\
                <float name=\"initial_radius\" value=\"0\"/><boolean name=\"hide_emitters\" value=\"true\"/></integrator>";
    let loaded = read(text);
    assert_eq!(loaded.warnings.len(), 2, "{}", words(&loaded.warnings));
    assert!(
        loaded.warnings[1].to_string().contains("`photon_count` and 2 more"),
        "{}",
        words(&loaded.warnings)
    );
    assert!(loaded.desc.integrator.hide_emitters);
    // A slip in one of ours is a warning: it may change the picture.
    assert!(!integrator("<integrator type=\"path\"><integer name=\"max_dept\" value=\"3\"/></integrator>").1);
}

/// The depth of a nested integrator is that of the picture.
#[test]
fn wrappers_use_what_they_hold() {
    let inner = "<integrator type=\"path\" id=\"p\"><integer name=\"max_depth\" value=\"3\"/></integrator>";
    for wrapper in ["moment", "aov", "adaptive", "something_of_theirs"] {
        let text = format!(
            "<integrator type=\"{wrapper}\"><integer name=\"max_depth\" value=\"9\"/>\
             <string name=\"aovs\" value=\"dd.y:depth\"/>{inner}</integrator>"
        );
        let (read, advice) = integrator(&text);
        assert_eq!((read.kind, read.max_depth, advice), (IntegratorKind::Path, Some(3), true), "{wrapper}");
    }
    let twice =
        format!("<integrator type=\"moment\"><integrator type=\"aov\">{inner}</integrator></integrator>");
    assert_eq!(integrator(&twice).0.max_depth, Some(3));
    let circle = "<integrator type=\"moment\" id=\"m\"><ref id=\"m\"/></integrator>";
    let refused = try_read(&format!("{SENSOR}{circle}"), false).expect_err("a circle");
    assert_eq!((refused.kind(), refused.location().1), (FindingKind::Reference, 2));
}

#[test]
fn films_filters_and_samplers_are_remarks() {
    let sensor = |inner: &str| {
        let text = format!("<sensor type=\"perspective\">{inner}</sensor><emitter type=\"constant\"/>");
        let loaded = try_read(&text, false).unwrap_or_else(|e| panic!("{inner}: {e:?}"));
        assert!(loaded.warnings.iter().all(is_advice), "{}", words(&loaded.warnings));
        (loaded.desc, loaded.warnings.len())
    };
    let film = "<integer name=\"width\" value=\"32\"/><float name=\"oddity\" value=\"1\"/><float name=\"gamma\" value=\"2.2\"/>";
    for (name, remarks) in [("ldrfilm", 2), ("tiledhdrfilm", 2), ("mfilm", 2), ("theirfilm", 3)] {
        let (desc, count) = sensor(&format!("<film type=\"{name}\">{film}</film>"));
        assert_eq!((desc.film.width, count), (32, remarks), "{name}");
    }
    for (name, filter) in [
        ("mitchell", ReconstructionFilter::Tent { radius: 1.0 }),
        ("catmullrom", ReconstructionFilter::Tent { radius: 1.0 }),
        ("lanczos", ReconstructionFilter::Tent { radius: 1.0 }),
        ("theirs", ReconstructionFilter::Gaussian { stddev: 0.5 }),
    ] {
        let (desc, count) = sensor(&format!("<film type=\"hdrfilm\"><rfilter type=\"{name}\"/></film>"));
        assert_eq!((desc.film.rfilter, count), (Some(filter), 1), "{name}");
    }
    let sampler = "<integer name=\"sample_count\" value=\"8\"/><float name=\"oddity\" value=\"1\"/>";
    for (name, remarks) in [("sobol", 1), ("theirs", 2)] {
        let (desc, count) = sensor(&format!("<sampler type=\"{name}\">{sampler}</sampler>"));
        assert_eq!((desc.samples_per_pixel, count), (Some(8), remarks));
    }
}

/// What changes light and is not known is an error, and in a lenient run a warning with its place.
#[test]
fn a_lenient_run_leaves_out_what_is_not_supported() {
    let read = |body: &str| {
        try_read(&format!("{SENSOR}<shape type=\"cube\"/>{body}"), true).unwrap_or_else(|e| panic!("{e:?}"))
    };
    let refused = |body: &str| {
        let error = try_read(&format!("{SENSOR}{body}"), false).expect_err(body);
        assert!(error.kind() == FindingKind::Plugin && error.location().1 == 2, "{error:?}");
        error
    };
    let told = |loaded: &Loaded, words: &str| {
        let [warning] = loaded.warnings.as_slice() else { panic!("{:?}", loaded.warnings) };
        assert!(!is_advice(warning) && warning.location().1 == 2, "{warning:?}");
        assert!(warning.to_string().contains("novel") && warning.to_string().contains(words), "{warning}");
    };
    let color = "<rgb name=\"color\" value=\"1\"/>";
    for (body, instead) in [
        (format!("<shape type=\"novel\">{color}</shape>"), "left out"),
        (format!("<emitter type=\"novel\">{color}</emitter>"), "left out"),
    ] {
        let help = Diagnostic::help(&refused(&body)).map(|h| h.to_string()).unwrap_or_default();
        assert!(help.contains("--lenient"), "{help}");
        let loaded = read(&body);
        told(&loaded, instead);
        assert_eq!((loaded.desc.shapes.len(), loaded.desc.lights.len()), (1, 1));
    }
    let magenta = |loaded: &Loaded, id: usize| {
        let BsdfDesc::Diffuse(DiffuseDesc { reflectance }) = &loaded.desc.bsdfs[id] else {
            panic!("diffuse")
        };
        assert_eq!(*reflectance, Spectrum::reflectance_rgb([0.9, 0.0, 0.9]));
    };
    let inner = format!("<bsdf type=\"novel\">{color}</bsdf>");
    for body in [inner.clone(), format!("<bsdf type=\"twosided\">{inner}</bsdf>")] {
        let body = format!("<shape type=\"disk\">{body}</shape>");
        refused(&body);
        let loaded = read(&body);
        told(&loaded, "magenta");
        assert_eq!(loaded.desc.shapes.len(), 2);
        magenta(&loaded, 1);
    }
    // The texture is what is not known: the material is what changes.
    let textured = "<bsdf type=\"diffuse\"><texture type=\"novel\" name=\"reflectance\"/></bsdf>";
    refused(textured);
    magenta(&read(textured), 1);
    // The shape stays, without its light.
    let lamp = "<shape type=\"disk\"><emitter type=\"novel\"/></shape>";
    refused(lamp);
    let loaded = read(lamp);
    told(&loaded, "left out");
    assert!(loaded.desc.shapes[1].emission.is_none());
    // A group stays, without what it cannot have; a group without anything is left out, and what shows it.
    let group = |inner: &str| {
        format!(
            "<shape type=\"shapegroup\" id=\"g\"><shape type=\"novel\"/>{inner}</shape><shape type=\"instance\"><ref id=\"g\"/></shape>"
        )
    };
    let loaded = read(&group("<shape type=\"disk\"/>"));
    told(&loaded, "left out");
    assert_eq!((loaded.desc.groups[0].shapes.len(), loaded.desc.shapes.len()), (1, 2));
    let loaded = read(&group(""));
    assert_eq!((loaded.desc.groups.len(), loaded.desc.shapes.len()), (0, 1), "{}", words(&loaded.warnings));
    // What is no question of support stays an error.
    for wrong in [
        "<shape type=\"sphere\"><float name=\"radius\" value=\"-1\"/></shape>",
        "<shape type=\"obj\"/>",
        "<shpe/>",
    ] {
        assert!(try_read(&format!("{SENSOR}{wrong}"), true).is_err(), "{wrong}");
    }
}

/// Files of other people are read without a change; what is left out or rendered in another way is told.
#[test]
fn scenes_that_others_made_are_read_as_they_are() {
    for (name, shapes) in [("staircase2", 30), ("veach-bidir", 10)] {
        let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}/scene.xml"));
        let loaded = pointillist::scene::load(&file, &[]).unwrap_or_else(|e| panic!("{e:?}"));
        assert!(loaded.desc.shapes.len() >= shapes, "{name}: {}", loaded.desc.shapes.len());
        let known = ["have no area", "path_guiding_integrator"];
        for warning in loaded.warnings.iter().filter(|warning| !is_advice(warning)) {
            let shown = warning.to_string();
            assert!(known.iter().any(|words| shown.contains(words)), "{name}: {warning:?}");
        }
    }
}

/// What the list of plugins says of those that Mitsuba has besides is what a file that names one is told.
#[test]
fn plugins_that_are_not_supported_are_refused_with_the_reason() {
    for (kind, name, why) in pointillist::scene::UNSUPPORTED {
        let plugin = format!("<{kind} type='{name}'/>");
        let sensor = "<sensor type='perspective'/>";
        let body = match *kind {
            "shape" | "emitter" | "integrator" => format!("{sensor}{plugin}"),
            "sensor" => plugin,
            "bsdf" => format!("{sensor}<shape type='sphere'>{plugin}</shape>"),
            "texture" => format!(
                "{sensor}<shape type='sphere'><bsdf type='diffuse'><texture name='reflectance' type='{name}'/></bsdf></shape>"
            ),
            "phase" => format!("{sensor}<medium type='homogeneous'>{plugin}</medium>"),
            _ => panic!("where does a {kind} stand?"),
        };
        let told = match try_read(&body, false) {
            Err(error) => error.to_string(),
            Ok(loaded) if *kind == "integrator" => format!("{:?}", loaded.warnings),
            Ok(_) => panic!("{kind} {name} is no error"),
        };
        assert!(told.contains(why) && told.contains(name), "{kind} {name}: {told}");
    }
}

/// Media of a file whose integrator knows surfaces only are left out, and that is told; any other has them.
#[test]
fn integrators_that_know_surfaces_only_leave_media_out() {
    let fog =
        "<shape type=\"cube\"><bsdf type=\"null\"/><medium name=\"interior\" type=\"homogeneous\"/></shape>";
    for (name, surfaces_only) in [
        ("path", true),
        ("direct", true),
        ("ptracer", true),
        ("volpath", false),
        ("volpathmis", false),
        ("bidirectional", false),
        ("auto", false),
    ] {
        let loaded = read(&format!("<integrator type=\"{name}\"/>{fog}"));
        let told =
            loaded.warnings.iter().filter(|warning| warning.to_string().contains("media are left out"));
        assert_eq!(told.count(), usize::from(surfaces_only), "{name}: {:?}", loaded.warnings);
        assert_eq!((loaded.desc.names_media(), loaded.desc.has_media()), (true, !surfaces_only), "{name}");
    }
}
