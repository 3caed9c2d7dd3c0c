//! Every bsdf plugin has an entry in `tests/support/bsdfs.rs`, and every plugin of a bsdf or a light a scene and a golden reference of it; and
//! readers of bsdfs take no parameter that is unknown or impossible.

use std::path::Path;

use crate::support::bsdfs::{BSDFS, MADE_OF_OTHERS, STAND_INS, shown};
use pointillist::scene::load_str;
use pointillist::scene::mitsuba::plugin_names;

/// The two halves of `sunsky`, whose scene shows both.
const HALVES: &[&str] = &["sky", "sun"];

/// The plugins of a kind.
fn named(kind: &str) -> Vec<&'static str> {
    plugin_names().into_iter().find(|(name, _)| *name == kind).unwrap().1
}

#[test]
fn every_bsdf_is_in_the_list_of_general_tests() {
    let all = named("bsdf");
    for plugin in &all {
        let listed = BSDFS.iter().any(|entry| entry.plugin == *plugin);
        assert!(
            listed || MADE_OF_OTHERS.contains(plugin) || STAND_INS.contains(plugin),
            "tests/support/bsdfs.rs has no entry for the bsdf `{plugin}`: add one to BSDFS, or its name to MADE_OF_OTHERS or \
             STAND_INS"
        );
    }
    let listed = BSDFS.iter().map(|entry| &entry.plugin).chain(MADE_OF_OTHERS).chain(STAND_INS);
    for plugin in listed {
        assert!(all.contains(plugin), "there is no bsdf `{plugin}`");
    }
}

#[test]
fn every_bsdf_and_every_light_has_a_scene_and_a_golden_reference() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for kind in ["bsdf", "emitter"] {
        let shown = |plugin: &&str| !(STAND_INS.contains(plugin) || HALVES.contains(plugin));
        for plugin in named(kind).into_iter().filter(shown) {
            let name = format!("{kind}_{plugin}");
            let scene = root.join(format!("scenes/plugins/{name}.xml"));
            assert!(scene.exists(), "add a scene that shows the {kind} `{plugin}`: {}", scene.display());
            let golden = root.join(format!("tests/golden/references/{name}.exr"));
            let advice = "pointillist regress update tests/golden";
            assert!(golden.exists(), "make the golden reference of {name}: {advice} {name} --reason …");
        }
    }
}

#[test]
fn parameters_are_known_and_possible() {
    let read = |bsdf: &str| {
        let text = format!(
            "<scene version='3.0.0'><sensor type='perspective'/><emitter type='constant'/><shape type='sphere'>{bsdf}</shape></scene>"
        );
        load_str("bsdf.xml", &text, &[])
    };
    for entry in BSDFS {
        let plugin = entry.plugin;
        let plain = read(&entry.with("")).unwrap();
        assert!(plain.warnings.is_empty(), "{plugin} by default: {:?}", plain.warnings);
        let unknown = read(&entry.with("<float name='no_such_number' value='1'/>")).unwrap();
        assert_eq!(unknown.warnings.len(), 1, "{plugin} with an unknown parameter");
        for name in entry.colours {
            let negative = entry.with(&format!("<spectrum name='{name}' value='-1'/>"));
            assert!(read(&negative).is_err(), "{plugin} takes a negative {name}");
        }
        for name in entry.alphas {
            let negative = entry.with(&format!("<float name='{name}' value='-1'/>"));
            assert!(read(&negative).is_err(), "{plugin} takes a negative {name}");
        }
        for (variant, _) in entry.variants {
            assert!(!shown(&entry.with(variant)).bsdfs.is_empty(), "{plugin} with {variant}");
        }
    }
}
