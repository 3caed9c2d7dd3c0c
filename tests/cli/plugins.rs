//! `pointillist plugins`, and that the tables of scenes/README.md are what it prints.

use std::process::{Command, Output};

fn plugins(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_pointillist")).arg("plugins").args(args).output().unwrap()
}

fn printed(args: &[&str]) -> String {
    let output = plugins(args);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn the_tables_of_the_readme_are_what_the_program_prints() {
    let readme = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/README.md");
    let text = std::fs::read_to_string(readme).unwrap();
    let (_, committed) =
        text.split_once("documentation/notes.rs. -->").expect("the comment above the tables");
    let printed = printed(&["--markdown"]);
    let difference = committed.trim().lines().zip(printed.trim().lines()).find(|(a, b)| a != b);
    assert!(
        committed.trim() == printed.trim(),
        "scenes/README.md is not what `pointillist plugins --markdown` prints; call tools/plugins. First difference: {difference:?}"
    );
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
