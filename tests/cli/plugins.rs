//! `pointillist plugins`, and its documentation of plugins: that it is up to date and complete.

use std::process::{Command, Output};
use std::sync::LazyLock;

#[path = "../../tools/make/plugins/mod.rs"]
mod documentation;

use documentation::{ParameterDoc, PluginKind};

static DOCUMENTED: LazyLock<Vec<PluginKind>> = LazyLock::new(|| documentation::plugins().unwrap());

fn plugins(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_pointillist")).arg("plugins").args(args).output().unwrap()
}

fn printed(args: &[&str]) -> String {
    let output = plugins(args);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn the_committed_documentation_is_up_to_date() {
    for (name, text) in documentation::files(&DOCUMENTED).unwrap() {
        let committed = std::fs::read_to_string(&name).unwrap();
        let difference = committed.lines().zip(text.lines()).find(|(a, b)| a != b);
        assert!(
            committed == text,
            "{}: call tools/plugins. First difference: {difference:?}",
            name.display()
        );
    }
}

#[test]
fn kinds_and_plugins_are_found_by_name() {
    let kind = printed(&["rfilter"]);
    assert!(kind.starts_with("rfilter\n") && kind.contains("  gaussian\n") && !kind.contains("roughplastic"));
    let plugin = printed(&["sphere"]);
    assert!(
        plugin.starts_with("shape\n") && plugin.contains("radius") && plugin.contains("float = 1"),
        "{plugin}"
    );
    assert!(!plugin.contains("cylinder"));
    let refused = plugins(&["nothing"]);
    let message = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(
        !refused.status.success() && message.contains("`nothing`") && message.contains("rfilter"),
        "{message}"
    );
}

#[test]
fn notes_are_about_plugins_that_exist() {
    let all = &*DOCUMENTED;
    for (kind, name, _) in documentation::notes::NOTES {
        let known = all.iter().find(|k| k.name == *kind).expect("a kind");
        assert!(
            name.is_empty() || known.plugins.iter().any(|p| p.name == *name),
            "{kind} `{name}` does not exist"
        );
    }
}

/// What a few readers are known to ask for: required, by default, without effect, nested, and only if another one is given.
#[test]
fn parameters_are_what_readers_ask_for() {
    let all = &*DOCUMENTED;
    let find = |kind: &str, plugin: &str, name: &str| {
        let kind = all.iter().find(|k| k.name == kind).expect("a kind");
        let plugin = kind.plugins.iter().find(|p| p.name == plugin).expect("a plugin");
        plugin.parameters.iter().find(|p| p.name == name).cloned().unwrap_or_default()
    };
    let radius = find("shape", "sphere", "radius");
    assert_eq!((radius.value.as_str(), radius.default.as_deref()), ("float", Some("1")));
    let file = find("shape", "obj", "filename");
    assert!(file.required && file.value == "file", "{file:?}");
    assert!(find("bsdf", "blendbsdf", "weight").required);
    let inner = find("bsdf", "blendbsdf", "bsdf");
    assert!(inner.nested && inner.required, "{inner:?}");
    let axis = find("sensor", "perspective", "fov_axis");
    assert!(axis.value == "string" && !axis.required, "{axis:?}");
    assert!(find("film", "hdrfilm", "banner").idle);
    assert_eq!(find("shape", "sphere", "filename"), ParameterDoc::default());
    assert!(find("emitter", "area", "radiance").value.contains("spectrum"));
}
