//! What scene text means, against facts worked out by hand or read from Mitsuba 3.9.1.

use glam::{DAffine3, DMat3, DVec3};
use miette::{GraphicalReportHandler, GraphicalTheme, Severity};
use pointillist::scene::desc::{
    BsdfDesc, ConductorDesc, Crop, DielectricDesc, DiffuseDesc, FovAxis, LightDesc, PhotonDesc,
    ReconstructionFilter, ShapeDesc, ShapeKind, TwoSidedDesc,
};
use pointillist::scene::{FindingKind, Loaded, SceneError, load_str};
use pointillist::spectrum::{Spectrum, dispersion::Ior};

const SENSOR: &str = "<sensor type=\"perspective\"><float name=\"fov\" value=\"40\"/></sensor>";
const LIGHT: &str = "<emitter type=\"constant\"/>";

fn try_read(body: &str, overrides: &[(&str, &str)]) -> Result<Loaded, SceneError> {
    let overrides: Vec<(String, String)> =
        overrides.iter().map(|(n, v)| ((*n).into(), (*v).into())).collect();
    load_str("t.xml", &format!("<scene version=\"3.0.0\">\n{body}\n</scene>"), &overrides)
}

/// Reads a body beside a sensor and a light; no warning may come.
fn read(body: &str) -> Loaded {
    let loaded = try_read(&format!("{SENSOR}{LIGHT}{body}"), &[]).unwrap_or_else(|e| panic!("{body}: {e:?}"));
    assert!(loaded.warnings.is_empty(), "{body}: {:?}", loaded.warnings);
    loaded
}

fn refuse(body: &str) -> SceneError {
    match try_read(&format!("{SENSOR}{LIGHT}{body}"), &[]) {
        Ok(_) => panic!("this must be refused: {body}"),
        Err(e) => e,
    }
}

fn shape(body: &str) -> ShapeDesc {
    read(&format!("<shape type=\"rectangle\">{body}</shape>")).desc.shapes.remove(0)
}

fn transform(steps: &str) -> DAffine3 {
    shape(&format!("<transform name=\"to_world\">{steps}</transform>")).to_world
}

fn bsdf(text: &str) -> BsdfDesc {
    let desc = read(&format!("<shape type=\"disk\">{text}</shape>")).desc;
    desc.bsdfs[desc.shapes[0].bsdf.0 as usize].clone()
}

fn radiance(text: &str) -> Spectrum {
    shape(&format!("<emitter type=\"area\">{text}</emitter>")).emission.expect("given")
}

fn render(d: &dyn miette::Diagnostic) -> String {
    let mut out = String::new();
    let handler = GraphicalReportHandler::new_themed(GraphicalTheme::unicode_nocolor());
    handler.render_report(&mut out, d).expect("a string never fails");
    out
}

fn assert_matrix(steps: &str, rows: [[f64; 4]; 3]) {
    let m = transform(steps);
    let linear = DMat3::from_cols_array_2d(&rows.map(|r| [r[0], r[1], r[2]])).transpose();
    let wanted = DAffine3 { matrix3: linear, translation: DVec3::new(rows[0][3], rows[1][3], rows[2][3]) };
    assert!(m.abs_diff_eq(wanted, 1e-6), "{steps}: {m:?}, wanted {wanted:?}");
}

#[test]
#[allow(clippy::approx_constant)] // printed numbers are what they are
fn transforms_are_mitsubas() {
    assert_matrix("<translate x=\"1\"/>", [[1., 0., 0., 1.], [0., 1., 0., 0.], [0., 0., 1., 0.]]);
    assert_matrix("<translate value=\"2\"/>", [[1., 0., 0., 2.], [0., 1., 0., 2.], [0., 0., 1., 2.]]);
    assert_matrix("<scale value=\"2 3, 4\"/>", [[2., 0., 0., 0.], [0., 3., 0., 0.], [0., 0., 4., 0.]]);
    assert_matrix("<scale y=\"-3\"/>", [[1., 0., 0., 0.], [0., -3., 0., 0.], [0., 0., 1., 0.]]);
    // In document order: first to (1,0,0), then a quarter turn about z takes it to (0,1,0).
    let turn = "<translate x=\"1\"/><rotate value=\"0,0,1\" angle=\"90\"/>";
    assert_matrix(turn, [[0., -1., 0., 0.], [1., 0., 0., 1.], [0., 0., 1., 0.]]);
    let other = "<rotate z=\"1\" angle=\"90\"/><translate x=\"1\"/>";
    assert_matrix(other, [[0., -1., 0., 1.], [1., 0., 0., 0.], [0., 0., 1., 0.]]);
    // Printed by Mitsuba 3.9.1.
    assert_matrix(
        "<lookat origin=\"1,2,3\" target=\"4,6,8\" up=\"0,1,0\"/>",
        [
            [0.857493, -0.291043, 0.424264, 1.],
            [0., 0.824621, 0.565685, 2.],
            [-0.514496, -0.485071, 0.7071068, 3.],
        ],
    );
    let no_up = "<lookat origin=\"0\" target=\"0,0,1\"/>";
    assert_matrix(no_up, [[0., 1., 0., 0.], [-1., 0., 0., 0.], [0., 0., 1., 0.]]);
    let nine = "<matrix value=\"1 2 3 4 5 6 7 8 10\"/>";
    assert_matrix(nine, [[1., 2., 3., 0.], [4., 5., 6., 0.], [7., 8., 10., 0.]]);
    let sixteen = "<matrix value=\"1 0 0 5 0 1 0 6 0 0 1 7 0 0 0 1\"/>";
    assert_matrix(sixteen, [[1., 0., 0., 5.], [0., 1., 0., 6.], [0., 0., 1., 7.]]);
}

/// Mitsuba 3.9.1 takes a cube to 1.754 where it is turned by 35° about (1, 1, 0): not a rotation, and not what the file asks for.
#[test]
fn an_axis_of_another_length_is_a_direction_and_told() {
    let turned = |steps: &str| {
        let body = format!(
            "{SENSOR}{LIGHT}\n<shape type=\"cube\"><transform name=\"to_world\">{steps}</transform></shape>"
        );
        let loaded = try_read(&body, &[]).expect("valid");
        (loaded.desc.shapes[0].to_world, loaded.warnings)
    };
    let unit = std::f64::consts::FRAC_1_SQRT_2;
    let (wanted, silent) = turned(&format!("<rotate value=\"{unit},{unit},0\" angle=\"35\"/>"));
    assert!(silent.is_empty(), "{silent:?}");
    let (given, told) =
        turned("<translate x=\"2\"/><rotate value=\"1,1,0\" angle=\"35\"/><translate x=\"-1\"/>");
    let moved = DAffine3::from_translation(DVec3::new(-1.0, 0.0, 0.0)) * wanted;
    let moved = moved * DAffine3::from_translation(DVec3::new(2.0, 0.0, 0.0));
    assert!(given.abs_diff_eq(moved, 1e-9), "{given:?}");
    let [told] = &told[..] else { panic!("{told:?}") };
    assert!(told.to_string().contains("has not the length 1"), "{told}");
    // As exact as files write it.
    assert!(turned("<rotate value=\"0.7071,0.7071,0\" angle=\"35\"/>").1.is_empty());
}

#[test]
fn impossible_transforms_are_refused_at_their_place() {
    for steps in [
        "<scale z=\"0\"/>",
        "<scale value=\"1e-39\"/>",
        "<matrix value=\"1 2 3 2 4 6 0 0 1\"/>",
        "<matrix value=\"1 2 3\"/>",
        "<matrix value=\"1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1\"/>",
        "<rotate angle=\"30\"/>",
        "<rotate x=\"1\" angle=\"nan\"/>",
        "<lookat origin=\"1\" target=\"1\" up=\"0,1,0\"/>",
        "<lookat origin=\"0\" target=\"0,1,0\" up=\"0,1,0\"/>",
        "<translate x=\"1e38\"/><scale value=\"1e30\"/>",
        "<translate value=\"1\" x=\"2\"/>",
        "<float name=\"a\" value=\"1\"/>",
    ] {
        let e = refuse(&format!(
            "\n<shape type=\"rectangle\"><transform name=\"to_world\">{steps}</transform></shape>"
        ));
        assert_eq!(e.location().1, 3, "{steps}: {e:?}");
    }
    // Very large and very small are not flat.
    let m = transform("<scale value=\"1e-12\"/><translate x=\"1e6\"/>");
    assert_eq!((m.matrix3.x_axis.x, m.translation.x), (1e-12, 1e6));
}

#[test]
fn names_defaults_and_overrides() {
    let body = "<default name=\"w\" value=\"2\"/><default name=\"width\" value=\"$w\"/>\
                <shape type=\"sphere\"><float name=\"radius\" value=\"$width$w\"/></shape>";
    let radius = |overrides: &[(&str, &str)]| {
        let loaded = try_read(&format!("{SENSOR}{LIGHT}{body}"), overrides).expect("valid");
        match loaded.desc.shapes[0].kind {
            ShapeKind::Sphere { radius, .. } => (radius, loaded.warnings),
            _ => panic!("a sphere"),
        }
    };
    assert_eq!(radius(&[]).0, 22.0);
    assert_eq!(radius(&[("w", "3")]).0, 33.0);
    assert_eq!(radius(&[("width", "5"), ("w", "1")]).0, 51.0);
    let (_, warnings) = radius(&[("hight", "5")]);
    assert_eq!(warnings.len(), 1);
    assert!(render(&warnings[0]).contains("-D hight=5"), "{}", render(&warnings[0]));
    let e = refuse("<shape type=\"sphere\"><float name=\"radius\" value=\"$none\"/></shape>");
    assert_eq!(e.kind(), FindingKind::Reference);
}

#[test]
fn references_and_aliases_share_one_material() {
    let desc = read(
        "<shape type=\"disk\"><ref id=\"a\"/></shape><bsdf type=\"diffuse\" id=\"a\"/><alias id=\"a\" as=\"b\"/>\
         <shape type=\"disk\"><ref id=\"b\"/></shape><shape type=\"disk\"/><shape type=\"disk\"/>",
    )
    .desc;
    let ids: Vec<u32> = desc.shapes.iter().map(|s| s.bsdf.0).collect();
    assert_eq!(ids, [0, 0, 1, 1]);
    for bad in [
        "<shape type=\"disk\"><ref id=\"nothing\"/></shape>",
        "<bsdf type=\"diffuse\" id=\"a\"/><bsdf type=\"diffuse\" id=\"a\"/>",
        "<bsdf type=\"twosided\" id=\"a\"><ref id=\"a\"/></bsdf>",
        "<alias id=\"later\" as=\"b\"/><bsdf type=\"diffuse\" id=\"later\"/>",
    ] {
        assert_eq!(refuse(bad).kind(), FindingKind::Reference, "{bad}");
    }
}

#[test]
fn default_materials() {
    assert!(
        matches!(bsdf(""), BsdfDesc::Diffuse(DiffuseDesc { reflectance }) if reflectance == Spectrum::Constant(0.5))
    );
    // A lamp without a material reflects nothing, as in Mitsuba.
    assert!(
        matches!(bsdf("<emitter type=\"area\"/>"), BsdfDesc::Diffuse(DiffuseDesc { reflectance }) if reflectance.is_black())
    );
}

#[test]
fn spectra_of_each_role() {
    let diffuse = |value: &str| match bsdf(&format!("<bsdf type=\"diffuse\">{value}</bsdf>")) {
        BsdfDesc::Diffuse(DiffuseDesc { reflectance }) => reflectance,
        other => panic!("{other:?}"),
    };
    assert_eq!(diffuse("<spectrum name=\"reflectance\" value=\"0.3\"/>"), Spectrum::Constant(0.3));
    assert_eq!(diffuse("<float name=\"reflectance\" value=\"0.3\"/>"), Spectrum::Constant(0.3));
    let rgb = [0.1, 0.2, 0.7];
    assert_eq!(diffuse("<rgb name=\"reflectance\" value=\".1 .2 .7\"/>"), Spectrum::reflectance_rgb(rgb));
    let table = Spectrum::table(&[(400.0, 0.1), (500.0, 0.9)]).expect("ascending");
    assert_eq!(diffuse("<spectrum name=\"reflectance\" value=\"400:0.1, 500:0.9\"/>"), table);
    let irregular = "<spectrum name=\"reflectance\" type=\"irregular\">\
                     <string name=\"wavelengths\" value=\"400, 500\"/><string name=\"values\" value=\".1 .9\"/></spectrum>";
    assert_eq!(diffuse(irregular), table);
    let regular = "<spectrum name=\"reflectance\" type=\"regular\"><float name=\"wavelength_min\" value=\"400\"/>\
                   <float name=\"wavelength_max\" value=\"500\"/><string name=\"values\" value=\".1 .9\"/></spectrum>";
    assert_eq!(diffuse(regular), table);
    // In a light, colours and plain numbers multiply D65, and a spectrum is what it says.
    assert_eq!(radiance(""), Spectrum::d65(1.0));
    assert_eq!(radiance("<float name=\"radiance\" value=\"2\"/>"), Spectrum::d65(2.0));
    assert_eq!(radiance("<rgb name=\"radiance\" value=\"1 2 3\"/>"), Spectrum::emission_rgb([1.0, 2.0, 3.0]));
    assert_eq!(radiance("<spectrum name=\"radiance\" value=\"2\"/>"), Spectrum::Constant(2.0));
    let scaled = "<spectrum name=\"radiance\" type=\"d65\"><float name=\"scale\" value=\"3\"/></spectrum>";
    assert_eq!(radiance(scaled), Spectrum::d65(3.0));
    for bad in [
        "<rgb name=\"reflectance\" value=\"2 0 0\"/>",
        "<rgb name=\"reflectance\" value=\"-1\"/>",
        "<spectrum name=\"reflectance\" value=\"500:1, 400:1\"/>",
        "<spectrum name=\"reflectance\" value=\"500:1\"/>",
        "<spectrum name=\"reflectance\" value=\"400:1, 500:nan\"/>",
        "<spectrum name=\"reflectance\" value=\"inf\"/>",
        "<spectrum name=\"reflectance\"/>",
        "<spectrum name=\"reflectance\" filename=\"not/there.spd\"/>",
        "<texture name=\"reflectance\" type=\"bitmap\"/>",
    ] {
        refuse(&format!("<bsdf type=\"diffuse\">{bad}</bsdf>"));
    }
}

#[test]
fn glass_metal_and_two_sides() {
    let glass = bsdf(
        "<bsdf type=\"dielectric\"><float name=\"int_ior\" value=\"1.5\"/><string name=\"ext_ior\" value=\"air\"/></bsdf>",
    );
    let BsdfDesc::Dielectric(DielectricDesc { int_ior, ext_ior, specular_reflectance, .. }) = glass else {
        panic!("glass")
    };
    assert_eq!((int_ior, Some(ext_ior)), (Ior::Constant(1.5), Ior::named("air")));
    assert_eq!(specular_reflectance, Spectrum::Constant(1.0));
    let one = Spectrum::Constant(1.0);
    for mirror in [
        "<bsdf type=\"conductor\"/>",
        "<bsdf type=\"conductor\"><string name=\"material\" value=\"none\"/></bsdf>",
    ] {
        let BsdfDesc::Conductor(ConductorDesc { eta, k, .. }) = bsdf(mirror) else { panic!("metal") };
        assert!(eta.is_black() && k == one);
    }
    let desc =
        read("<bsdf type=\"twosided\" id=\"t\"><bsdf type=\"diffuse\"/><bsdf type=\"conductor\"/></bsdf>")
            .desc;
    assert!(
        matches!(desc.bsdfs[2], BsdfDesc::TwoSided(TwoSidedDesc { front, back }) if front.0 == 0 && back.0 == 1)
    );
    for bad in [
        "<bsdf type=\"dielectric\"><string name=\"int_ior\" value=\"unobtainium\"/></bsdf>",
        "<bsdf type=\"dielectric\"><float name=\"int_ior\" value=\"0\"/></bsdf>",
        "<bsdf type=\"conductor\"><string name=\"material\" value=\"unobtainium\"/></bsdf>",
        "<bsdf type=\"conductor\"><string name=\"material\" value=\"Au\"/><float name=\"k\" value=\"1\"/></bsdf>",
        "<bsdf type=\"twosided\"/>",
        "<bsdf type=\"twosided\"><bsdf type=\"twosided\"><bsdf type=\"diffuse\"/></bsdf></bsdf>",
        "<bsdf type=\"difuse\"/>",
    ] {
        refuse(bad);
    }
}

#[test]
fn shapes_and_lights() {
    let desc = read(
        "<shape type=\"sphere\" id=\"s\"><point name=\"center\" value=\"1,2,3\"/><float name=\"radius\" value=\"2\"/>\
         <boolean name=\"flip_normals\" value=\"true\"/></shape><shape type=\"cube\"/>\
         <emitter type=\"point\"><point name=\"position\" x=\"1\" y=\"2\" z=\"3\"/></emitter>\
         <emitter type=\"point\"><transform name=\"to_world\"><translate x=\"4\"/></transform></emitter>",
    )
    .desc;
    let ShapeKind::Sphere { center, radius } = desc.shapes[0].kind else { panic!("a sphere") };
    assert_eq!((center, radius, desc.shapes[0].flip_normals), (DVec3::new(1.0, 2.0, 3.0), 2.0, true));
    assert_eq!((desc.shapes[0].id.as_deref(), desc.shapes[0].place.line), (Some("s"), 2));
    let position = |i: usize| match &desc.lights[i] {
        LightDesc::Point { position, .. } => *position,
        other => panic!("{other:?}"),
    };
    assert_eq!((position(1), position(2)), (DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 0.0, 0.0)));
    for bad in [
        "<shape type=\"sphere\"><float name=\"radius\" value=\"-1\"/></shape>",
        "<shape type=\"sphere\"><transform name=\"to_world\"><scale x=\"2\"/></transform></shape>",
        "<shape type=\"sphere\"><point name=\"center\" x=\"1\"/></shape>",
        "<shape type=\"sphere\"><integer name=\"radius\" value=\"1.5\"/></shape>",
        "<shape type=\"sphere\"><string name=\"radius\" value=\"1\"/></shape>",
        "<shape type=\"sphere\"><float name=\"radius\" value=\"1\"/><float name=\"radius\" value=\"1\"/></shape>",
        "<shape type=\"sphere\"><bsdf type=\"diffuse\"/><bsdf type=\"diffuse\"/></shape>",
        "<shape type=\"obj\"/>",
        "<shape type=\"obj\"><string name=\"filename\" value=\"not/there.obj\"/></shape>",
        "<shape type=\"disk\"><emitter type=\"point\"/></shape>",
        "<emitter type=\"area\"/>",
        "<emitter type=\"constant\"/>",
    ] {
        refuse(bad);
    }
}

fn camera(body: &str, film: &str) -> Result<Loaded, SceneError> {
    try_read(
        &format!("{LIGHT}<sensor type=\"perspective\">{body}<film type=\"hdrfilm\">{film}</film></sensor>"),
        &[],
    )
}

#[test]
fn cameras_and_films() {
    let c = camera("<float name=\"principal_point_offset_x\" value=\"0.25\"/>", "").expect("valid").desc;
    // 50 mm on 35 mm film: 2 atan(43.2666 / 100) along the diagonal.
    assert!(
        (c.camera.perspective().unwrap().fov - 46.793).abs() < 1e-3,
        "{}",
        c.camera.perspective().unwrap().fov
    );
    assert_eq!(c.camera.perspective().unwrap().fov_axis, FovAxis::Diagonal);
    assert_eq!((c.camera.near_clip, c.camera.far_clip, c.camera.principal_point_offset.x), (1e-2, 1e4, 0.25));
    assert_eq!((c.film.width, c.film.height, c.film.crop, c.film.rfilter), (768, 576, None, None));
    let crop = "<integer name=\"width\" value=\"100\"/><integer name=\"height\" value=\"50\"/>\
                <integer name=\"crop_offset_x\" value=\"10\"/><integer name=\"crop_width\" value=\"90\"/><rfilter type=\"tent\"/>";
    let c = camera("<float name=\"fov\" value=\"50\"/><string name=\"fov_axis\" value=\"larger\"/>", crop)
        .expect("valid")
        .desc;
    assert_eq!(c.film.crop, Some(Crop { x: 10, y: 0, width: 90, height: 50 }));
    assert_eq!(
        (c.camera.perspective().unwrap().fov_axis, c.film.rfilter),
        (FovAxis::Larger, Some(ReconstructionFilter::Tent { radius: 1.0 }))
    );
    for (body, film) in [
        ("<float name=\"fov\" value=\"180\"/>", ""),
        ("<float name=\"fov\" value=\"20\"/><string name=\"focal_length\" value=\"50mm\"/>", ""),
        ("<string name=\"focal_length\" value=\"0mm\"/>", ""),
        ("<float name=\"near_clip\" value=\"2\"/><float name=\"far_clip\" value=\"1\"/>", ""),
        ("<transform name=\"to_world\"><scale value=\"2\"/></transform>", ""),
        ("", "<integer name=\"width\" value=\"0\"/>"),
        ("", "<integer name=\"width\" value=\"65536\"/><integer name=\"height\" value=\"65536\"/>"),
        ("", "<integer name=\"crop_width\" value=\"769\"/>"),
        ("", "<integer name=\"crop_offset_x\" value=\"9223372036854775807\"/>"),
    ] {
        assert!(camera(body, film).is_err(), "{body} {film}");
    }
    // Sizes that cannot be splatted become the nearest, with a remark.
    for (plugin, name, value, filter, remarks) in [
        ("tent", "radius", 1.5, ReconstructionFilter::Tent { radius: 1.5 }, 0),
        ("tent", "radius", 9.0, ReconstructionFilter::Tent { radius: 3.0 }, 1),
        ("gaussian", "stddev", 0.7, ReconstructionFilter::Gaussian { stddev: 0.7 }, 0),
        ("gaussian", "stddev", 2.0, ReconstructionFilter::Gaussian { stddev: 0.75 }, 1),
        ("gaussian", "radius", 2.0, ReconstructionFilter::Gaussian { stddev: 0.5 }, 1),
        ("lanczos", "radius", 2.0, ReconstructionFilter::Tent { radius: 1.0 }, 2),
    ] {
        let film = format!("<rfilter type=\"{plugin}\"><float name=\"{name}\" value=\"{value}\"/></rfilter>");
        let c = camera("", &film).expect("valid");
        assert_eq!((c.desc.film.rfilter, c.warnings.len()), (Some(filter), remarks), "{film}");
    }
    assert!(camera("", "<rfilter type=\"tent\"><float name=\"radius\" value=\"0\"/></rfilter>").is_err());
    let mitchell = camera("", "<rfilter type=\"mitchell\"/>").expect("valid");
    assert_eq!(
        (mitchell.desc.film.rfilter, mitchell.warnings.len()),
        (Some(ReconstructionFilter::Tent { radius: 1.0 }), 1)
    );
}

#[test]
fn integrators() {
    let depth = |text: &str| {
        let i = read(&format!("<integrator type=\"path\">{text}</integrator>")).desc.integrator;
        (i.max_depth, i.rr_depth, i.hide_emitters)
    };
    assert_eq!(depth(""), (None, 5, false));
    assert_eq!(depth("<integer name=\"max_depth\" value=\"-1\"/>"), (None, 5, false));
    let all = "<integer name=\"max_depth\" value=\"7\"/><integer name=\"rr_depth\" value=\"3\"/><boolean name=\"hide_emitters\" value=\"true\"/>";
    assert_eq!(depth(all), (Some(7), 3, true));
    refuse("<integrator type=\"path\"><integer name=\"max_depth\" value=\"-2\"/></integrator>");
    refuse("<integrator type=\"path\"><float name=\"max_depth\" value=\"2\"/></integrator>");
    let photons = |text: &str| format!("<integrator type=\"photon\">{text}</integrator>");
    let all = "<float name=\"initial_radius\" value=\"0.2\"/><float name=\"alpha\" value=\"0.5\"/><integer name=\"lookup_size\" value=\"40\"/>";
    let PhotonDesc { initial_radius, alpha, lookup_size, .. } = read(&photons(all)).desc.integrator.photons;
    assert_eq!((initial_radius, alpha, lookup_size), (Some(0.2), Some(0.5), Some(40)));
    assert_eq!(read(&photons("")).desc.integrator.photons, PhotonDesc::default());
    for (name, value) in
        [("initial_radius", "0"), ("initial_radius", "1e-30"), ("alpha", "1"), ("alpha", "-0.1")]
    {
        refuse(&photons(&format!("<float name=\"{name}\" value=\"{value}\"/>")));
    }
    for size in ["0", "1", "4097"] {
        refuse(&photons(&format!("<integer name=\"lookup_size\" value=\"{size}\"/>")));
    }
    let auto = try_read(&format!("{SENSOR}{LIGHT}<integrator type=\"auto\"/>"), &[]).expect("valid");
    assert!(auto.warnings.is_empty());
    assert_eq!(auto.desc.integrator.kind, pointillist::scene::desc::IntegratorKind::Auto);
    let other = try_read(&format!("{SENSOR}{LIGHT}<integrator type=\"prbvolpath\"/>"), &[]).expect("valid");
    assert!(other.warnings[0].to_string().contains("prbvolpath"));
}

#[test]
fn nothing_is_ignored_in_silence() {
    let warned = |body: &str, words: &str| {
        let loaded = try_read(&format!("{SENSOR}{LIGHT}\n{body}"), &[]).unwrap_or_else(|e| panic!("{e:?}"));
        assert_eq!(loaded.warnings.len(), 1, "{body}: {:?}", loaded.warnings);
        let text = render(&loaded.warnings[0]);
        assert!(text.contains("t.xml:3:") && text.contains(words), "{text}");
    };
    warned("<shape type=\"sphere\"><float name=\"radus\" value=\"1\"/></shape>", "did you mean `radius`?");
    warned("<bsdf type=\"diffuse\"><rgb name=\"color\" value=\"1\"/></bsdf>", "known here: reflectance");
    warned("<shape type=\"disk\">hello</shape>", "text between elements");
    warned("<sensor type=\"perspective\"/>", "another sensor");
    warned("<path value=\"not/there\"/>", "no folder");
    let seated = render(&refuse("<shape type=\"disk\"><sensor type=\"perspective\"/></shape>"));
    assert!(seated.contains("no sensor stands in a shape but for an `irradiancemeter`"), "{seated}");
    let film = camera("", "<string name=\"pixel_format\" value=\"rgb\"/>").expect("valid");
    assert_eq!(miette::Diagnostic::severity(&film.warnings[0]), Some(Severity::Advice));
    let dark = try_read(SENSOR, &[]).expect("valid");
    assert!(dark.warnings[0].to_string().contains("no light"));
    let old =
        load_str("t.xml", &format!("<scene version=\"0.6.0\">{SENSOR}{LIGHT}</scene>"), &[]).expect("valid");
    assert!(old.warnings[0].to_string().contains("0.6.0"));
}

#[test]
fn errors_show_the_line_and_what_to_do() {
    let text = render(&refuse("\n  <shape type=\"spere\"/>"));
    assert!(text.contains("t.xml:3:16") && text.contains("<shape type=\"spere\"/>"), "{text}");
    assert!(text.contains("did you mean `sphere`?"), "{text}");
    for (body, words) in [
        ("<shpae type=\"sphere\"/>", "did you mean `shape`?"),
        ("<shape typ=\"sphere\"/>", "did you mean `type`?"),
        ("<shape/>", "needs the attribute `type`"),
        ("<float name=\"a\" value=\"1\"/>", "not supported at this place"),
        ("<include filename=\"t.xml\"/>", "includes itself"),
        ("<shape type=\"disk\"><translate x=\"1\"/></shape>", "cannot stand in"),
        ("<shape type=\"disk\">", "t.xml:"),
    ] {
        let text = render(&refuse(body));
        assert!(text.contains(words), "{body}: {text}");
    }
    let e = load_str("t.xml", LIGHT, &[]).expect_err("no scene");
    assert!(render(&e).contains("t.xml:1:1"), "{e:?}");
}
