//! Layers beside the picture, and the integrators that ask for them.

use miette::{Diagnostic, Severity};
use pointillist::image::stereo::Eye;
use pointillist::scene::desc::IntegratorKind;
use pointillist::scene::desc::aov::{AovDesc, AovKind, channel_count, parse};
use pointillist::scene::{FindingKind, Loaded, SceneError, limits, load_str};

fn read(integrator: &str) -> Result<Loaded, SceneError> {
    let rest = "<sensor type=\"perspective\"/><emitter type=\"constant\"/>";
    load_str("t.xml", &format!("<scene version=\"3.0.0\">{rest}\n{integrator}</scene>"), &[])
}

fn layers(list: &str) -> Vec<AovDesc> {
    parse(list).unwrap_or_else(|e| panic!("{list}: {e}")).layers
}

#[test]
fn lists_name_layers_and_channels() {
    let all = layers(
        "a:albedo, dd.y:depth,pp:position uv,n:sh_normal,\tgn:geo_normal,i:prim_index,s:shape_index,t:transmittance,sd:scattering_depth,dd:disparity",
    );
    let channels: Vec<String> = all.iter().flat_map(AovDesc::channels).collect();
    let wanted = "a.R a.G a.B dd.y.T pp.X pp.Y pp.Z uv.U uv.V n.X n.Y n.Z gn.X gn.Y gn.Z i.I s.I t.R t.G t.B sd.T dd.x";
    assert_eq!(channels.join(" "), wanted);
    assert_eq!((all.len(), channel_count(&all)), (AovKind::names().len(), 22));
    let text: Vec<String> = all.iter().map(ToString::to_string).collect();
    assert_eq!(layers(&text.join(",")), all, "what is written is read back");
    // Each eye has a disparity of its own, and all else by the same name.
    let two = layers("disparity,depth");
    let names = |eye| two.iter().flat_map(|layer| layer.channels_of(Some(eye))).collect::<Vec<_>>();
    assert_eq!(names(Eye::Left), ["disparityL.x", "depth.T"]);
    assert_eq!(names(Eye::Right), ["disparityR.x", "depth.T"]);
    // Layers of the same name may have different channels.
    assert_eq!(layers("x:depth,x:albedo").len(), 2);
    assert!(layers(" , ").is_empty());
}

#[test]
fn what_names_no_layer_is_refused() {
    let long = format!("{}:depth", "n".repeat(65));
    let many = (0..=limits::AOVS).map(|i| format!("d{i}:depth")).collect::<Vec<_>>().join(",");
    for list in
        ["a:albedos", "depth:", ":depth", "a:Albedo", "camera:position", "x:depth,x:depth", &long, &many]
    {
        let error = parse(list).expect_err(list);
        assert!(!error.is_empty() && error.len() < 400, "{error}");
    }
    assert!(parse("a:albedos").expect_err("unknown").contains("sh_normal"), "the known types are named");
    let (layers, left_out) =
        parse("d:depth,u:dp_du").map(|list| (list.layers, list.left_out)).expect("known");
    assert_eq!((layers.len(), left_out), (1, vec!["u:dp_du".to_owned()]));
}

#[test]
fn integrators_ask_for_layers() {
    let aov = |list: &str, inner: &str| {
        format!("<integrator type=\"aov\"><string name=\"aovs\" value=\"{list}\"/>{inner}</integrator>")
    };
    let inner = "<integrator type=\"path\"><integer name=\"max_depth\" value=\"3\"/></integrator>";
    let read_one = |text: &str| read(text).unwrap_or_else(|e| panic!("{text}: {e:?}"));
    let both = read_one(&aov("dd.y:depth,nn:sh_normal", inner));
    assert_eq!((both.desc.integrator.max_depth, both.warnings.len()), (Some(3), 0));
    assert_eq!(both.desc.integrator.aovs, layers("dd.y:depth,nn:sh_normal"));
    let alone = read_one(&aov("dd.y:depth", ""));
    assert_eq!((alone.desc.integrator.kind, alone.warnings.len()), (IntegratorKind::Path, 1));
    let moment = format!("<integrator type=\"moment\">{}</integrator>", aov("depth", inner));
    assert_eq!(read_one(&moment).desc.integrator.aovs, layers("depth"));
    let partly = read_one(&aov("depth,x:duv_dx", inner));
    assert_eq!((partly.desc.integrator.aovs.len(), partly.warnings.len()), (1, 1));
    assert_ne!(partly.warnings[0].severity(), Some(Severity::Advice), "a layer that is missing is a warning");
    let wrong = read(&aov("a:albedos", inner)).expect_err("unknown");
    assert_eq!((wrong.kind(), wrong.location().1), (FindingKind::Value, 2));
    let depth = read_one("<integrator type=\"depth\"/>");
    assert_eq!((depth.desc.integrator.kind, depth.warnings.len()), (IntegratorKind::Depth, 1));
}
