//! The plan of effects: which are on in every scene, with a reason that points into the file, and which go off when forced off.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use pointillist::scene::desc::{IntegratorKind, ProjectionDesc};
use pointillist::scene::{SceneDesc, load, load_str};
use pointillist::tracer::effects::{Effect, decide, force_on, with, without};
use pointillist::tracer::{Camera, Scene};

use crate::support::scenes::luminances;

const METHODS: [IntegratorKind; 4] =
    [IntegratorKind::Path, IntegratorKind::Light, IntegratorKind::Bidirectional, IntegratorKind::Photon];

fn scenes() -> Vec<(String, SceneDesc)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut files: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.retain(|p| p.extension().is_some_and(|e| e == "xml"));
    files.sort();
    let name = |p: &Path| p.file_stem().unwrap().to_str().unwrap().to_string();
    files.iter().map(|p| (name(p), load(p, &[]).unwrap().desc)).collect()
}

fn on(desc: &SceneDesc, kind: IntegratorKind) -> BTreeSet<&'static str> {
    decide(desc, kind).into_iter().filter(|d| d.on).map(|d| d.effect.name()).collect()
}

#[test]
fn every_scene_has_its_effects() {
    for (name, desc) in scenes() {
        let expected: &[&str] = match name.as_str() {
            "brushed" => &["wavelengths", "transmission", "glossy", "environment", "light-choice"],
            "candle" => &[
                "wavelengths",
                "glossy",
                "environment",
                "light-choice",
                "smooth-normals",
                "opacity",
                "media",
            ],
            "caustic" => &["wavelengths", "transmission", "deltas", "light-choice", "smooth-normals"],
            "cornell" => &["wavelengths"],
            "cornell_spheres" => &["wavelengths", "transmission", "deltas"],
            "cove" => &["wavelengths", "light-choice", "smooth-normals"],
            "fire" => &[
                "wavelengths",
                "environment",
                "smooth-normals",
                "opacity",
                "media",
                "grid-media",
                "emissive-media",
            ],
            "fog" => &["wavelengths", "transmission", "deltas", "opacity", "media"],
            "furnace" => &["environment"],
            "instances" => &["wavelengths", "glossy", "environment", "light-choice", "smooth-normals"],
            "milk" => &[
                "wavelengths",
                "transmission",
                "deltas",
                "environment",
                "light-choice",
                "smooth-normals",
                "media",
                "chromatic-media",
            ],
            "prism" => {
                &["wavelengths", "dispersion", "transmission", "deltas", "light-choice", "smooth-normals"]
            }
            "rough" => &["wavelengths", "transmission", "deltas", "glossy", "environment", "light-choice"],
            "smoke" => &["wavelengths", "environment", "light-choice", "opacity", "media", "grid-media"],
            "veach_door" => &["wavelengths", "transmission", "deltas", "smooth-normals"],
            "veach_plates" => &["wavelengths", "glossy", "light-choice"],
            other => panic!("say what {other} has"),
        };
        assert_eq!(on(&desc, IntegratorKind::Path), expected.iter().copied().collect(), "{name}");
        assert!(on(&desc, IntegratorKind::Bidirectional).contains("light-stream"), "{name}");
        let focuses = expected.iter().any(|e| ["deltas", "glossy"].contains(e));
        assert_eq!(on(&desc, IntegratorKind::Photon).contains("caustic-photons"), focuses, "{name}");
    }
}

/// An effect that is on because of an object names the place of that object in the file.
#[test]
fn reasons_point_into_the_file() {
    for (name, desc) in scenes() {
        for decision in decide(&desc, IntegratorKind::Photon) {
            assert!(!decision.reason.is_empty());
            let Some(place) = decision.place else {
                assert!(!decision.on, "{name}: {decision:?} does not say where");
                continue;
            };
            let text = fs::read_to_string(&desc.files[place.file as usize]).unwrap();
            let line = text.lines().nth(place.line as usize - 1).unwrap();
            let from: String = line.chars().skip(place.column as usize - 1).collect();
            let tags = ["<bsdf", "<shape", "<emitter", "<sensor", "<medium"];
            assert!(tags.iter().any(|tag| from.starts_with(tag)), "{name}: {decision:?} points at {from}");
        }
    }
}

/// An effect that is forced off is off, no other comes on, and the rest can be traced.
#[test]
fn what_is_forced_off_is_off() {
    let mut refused = BTreeSet::new();
    for (name, desc) in scenes() {
        for (kind, effect) in METHODS.into_iter().flat_map(|k| Effect::ALL.map(|f| (k, f))) {
            let mut less = desc.clone();
            less.integrator.kind = kind;
            let before = on(&less, kind);
            match without(&mut less, effect) {
                Err(advice) => {
                    assert!(advice.contains("choose") || advice.contains("leave"), "{advice}");
                    refused.insert((effect.name(), kind == IntegratorKind::Photon));
                }
                Ok(()) => {
                    let after = on(&less, kind);
                    assert!(!after.contains(effect.name()), "{name}: {effect:?} is still on");
                    assert!(after.is_subset(&before), "{name}: without {effect:?} there is {after:?}");
                    Scene::prepare(&less).unwrap();
                    Camera::of(&less).unwrap();
                }
            }
        }
    }
    let expected = [
        ("caustic-photons", false),
        ("gather", false),
        ("light-choice", false),
        ("light-choice", true),
        ("light-stream", false),
        ("light-stream", true),
    ];
    assert_eq!(refused, expected.into_iter().collect());
}

/// A rectangle of this material under a uniform sky.
fn desc(bsdf: &str) -> SceneDesc {
    let text = format!(
        "<scene version='3.0.0'><sensor type='perspective'><transform name='to_world'><lookat origin='0, 0, 4' target='0, 0, 0' \
         up='0, 1, 0'/></transform></sensor><emitter type='constant'/><shape type='rectangle'>{bsdf}</shape></scene>"
    );
    load_str("plan.xml", &text, &[]).unwrap().desc
}

/// Holes call for opacity; a mask without any does not, and is traced as the material that it holds, bit for bit.
#[test]
fn opacity_is_called_for_by_holes() {
    let matt = "<bsdf type='diffuse'/>";
    let mask = |opacity: &str| desc(&format!("<bsdf type='mask'>{matt}{opacity}</bsdf>"));
    let board = "<texture type='checkerboard' name='opacity'/>";
    let blend =
        format!("<bsdf type='blendbsdf'>{matt}<bsdf type='null'/><float name='weight' value='.3'/></bsdf>");
    for (desc, textured) in
        [(mask(""), false), (mask(board), true), (desc("<bsdf type='null'/>"), false), (desc(&blend), false)]
    {
        let effects = on(&desc, IntegratorKind::Path);
        assert!(effects.contains("opacity") && effects.contains("textures") == textured, "{effects:?}");
        let mut closed = desc.clone();
        without(&mut closed, Effect::Opacity).unwrap();
        assert!(!on(&closed, IntegratorKind::Path).contains("opacity"));
        assert!(luminances(&closed, 4096) != luminances(&desc, 4096), "holes are seen");
        let mut even = desc.clone();
        without(&mut even, Effect::Textures).unwrap();
        assert!(!on(&even, IntegratorKind::Path).contains("textures"), "an opacity is a texture too");
    }
    let whole = mask("<float name='opacity' value='1'/>");
    assert!(!on(&whole, IntegratorKind::Path).contains("opacity"));
    assert_eq!(luminances(&whole, 4096), luminances(&desc(matt), 4096));
}

/// What is off is put in for what it costs: into something matt, where there is any.
#[test]
fn examples_of_surfaces_are_on() {
    for effect in [Effect::Opacity, Effect::Textures, Effect::Bump] {
        let mut more = desc("<bsdf type='diffuse'/>");
        assert!(!on(&more, IntegratorKind::Path).contains(effect.name()));
        assert!(with(&mut more, effect) && on(&more, IntegratorKind::Path).contains(effect.name()));
        Scene::prepare(&more).unwrap();
        let mut metal = desc("<bsdf type='conductor'/>");
        assert!(!with(&mut metal, effect), "{}: nothing is matt", effect.name());
    }
}

/// Why there is no lens is said by the camera that there is.
#[test]
fn what_camera_has_no_lens() {
    let mut desc = desc("<bsdf type='diffuse'/>");
    for (orthographic, reason) in [(false, "pinhole"), (true, "parallel")] {
        if orthographic {
            desc.camera.projection = ProjectionDesc::Orthographic;
        }
        let lens =
            decide(&desc, IntegratorKind::Path).into_iter().find(|d| d.effect == Effect::Lens).unwrap();
        assert!(!lens.on && lens.reason.contains(reason), "{lens:?}");
    }
}

/// Media call for what they are, and are left out of a file whose integrator knows surfaces only, unless they are forced on.
#[test]
fn media_call_for_their_effects() {
    let read = |integrator: &str, medium: &str| {
        let text = format!(
            "<scene version='3.0.0'><integrator type='{integrator}'/><sensor type='perspective'><transform name='to_world'>\
             <lookat origin='0, 0, 4' target='0, 0, 0' up='0, 1, 0'/></transform></sensor><emitter type='constant'/>\
             <shape type='sphere'><bsdf type='null'/>{medium}</shape></scene>"
        );
        let place = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/plugins/media.xml");
        load_str(place.to_str().unwrap(), &text, &[]).unwrap().desc
    };
    let medium = |kind: &str, sigma_t: &str| {
        format!("<medium type='{kind}' name='interior'>{sigma_t}<float name='albedo' value='.5'/></medium>")
    };
    let grey = medium("homogeneous", "<float name='sigma_t' value='2'/>");
    let colored = medium("homogeneous", "<rgb name='sigma_t' value='.2 .4 .8'/>");
    let grid = "<volume name='sigma_t' type='gridvolume'><string name='filename' value='texture_volume_numbers.vol'/></volume>";
    let grid = medium("heterogeneous", grid);
    let fire = medium("homogeneous", "<rgb name='radiance' value='3'/>");
    let coal = medium("homogeneous", "<rgb name='radiance' value='3 2 1'/>");
    for (medium, expected) in [
        (&grey, vec!["media"]),
        (&colored, vec!["media", "chromatic-media", "wavelengths"]),
        (&grid, vec!["media", "grid-media"]),
        (&fire, vec!["media", "emissive-media"]),
        (&coal, vec!["media", "emissive-media", "wavelengths"]),
    ] {
        let desc = read("volpath", medium);
        let effects = on(&desc, IntegratorKind::Path);
        let always = ["opacity", "environment"];
        assert_eq!(effects, expected.into_iter().chain(always).collect(), "{medium}");
        for effect in [Effect::Media, Effect::GridMedia, Effect::ChromaticMedia, Effect::EmissiveMedia] {
            let mut less = desc.clone();
            without(&mut less, effect).unwrap();
            assert!(!on(&less, IntegratorKind::Path).contains(effect.name()), "{medium}: {effect:?}");
            Scene::prepare(&less).unwrap();
        }
    }
    let shines = |kind| on(&read("volpath", &fire), kind).contains("emissive-media");
    assert!(shines(IntegratorKind::Photon) && !shines(IntegratorKind::Light), "particles do not find it");
    let mut surfaces = read("path", &grey);
    assert!(!on(&surfaces, IntegratorKind::Path).contains("media"));
    let clear = luminances(&surfaces, 1024);
    assert!(clear.iter().all(|y| (y - clear[0]).abs() < 1e-6), "an even sky");
    force_on(&mut surfaces, Effect::Media).unwrap();
    assert!(on(&surfaces, IntegratorKind::Path).contains("media"));
    assert_eq!(luminances(&surfaces, 1024), luminances(&read("volpath", &grey), 1024));
    assert!(luminances(&surfaces, 1024) != clear);
}

/// A haze is put into a scene for what media cost, where it leaves anything to see.
#[test]
fn an_example_of_media_is_on() {
    let mut sky = desc("<bsdf type='diffuse'/>");
    assert!(!with(&mut sky, Effect::Media), "an endless haze would swallow the sky");
    let (_, mut room) = scenes().into_iter().find(|(name, _)| name == "cornell").unwrap();
    assert!(with(&mut room, Effect::Media) && on(&room, IntegratorKind::Path).contains("media"));
    assert!(with(&mut room, Effect::ChromaticMedia));
    assert!(on(&room, IntegratorKind::Path).contains("chromatic-media"));
    assert!(with(&mut room, Effect::EmissiveMedia));
    assert!(on(&room, IntegratorKind::Path).contains("emissive-media"));
    Scene::prepare(&room).unwrap();
}
