//! Warnings about a scene as a user meets them: few lines, and with `--verbose` and `--json` all of them.

use std::fmt::Write;
use std::path::Path;
use std::process::{Command, Output};

/// Runs a subcommand on a scene of 40 shapes with slips of three kinds, and 20 settings of the film without effect.
fn run(subcommand: &[&str]) -> Output {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("warnings_cli");
    std::fs::create_dir_all(&folder).unwrap();
    let scene = folder.join("slips.xml");
    let mut text = "<scene version=\"3.0.0\">\n<emitter type=\"constant\"/>\n".to_owned();
    text += "<sensor type=\"perspective\"><film type=\"hdrfilm\">\n";
    for i in 0..20 {
        writeln!(text, "<float name=\"odd_{}\" value=\"1\"/>", "x".repeat(i)).unwrap();
    }
    text += "</film></sensor>\n";
    for i in 0..40 {
        let name = ["strange", "peculiar", "rare"][i % 3];
        let place = format!("<transform name=\"to_world\"><translate x=\"{}\"/></transform>", 3 * i);
        writeln!(text, "<shape type=\"cube\"><float name=\"{name}\" value=\"1\"/>{place}</shape>").unwrap();
    }
    std::fs::write(&scene, text + "</scene>").unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_pointillist"));
    command.current_dir(&folder).arg(subcommand[0]).arg("slips.xml").args(&subcommand[1..]);
    let output = command.args(["--size", "8x8", "--device", "cpu"]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    output
}

#[test]
fn a_first_use_does_not_scroll_the_screen_away() {
    let render = ["render", "--spp", "1", "-o", "slips.png", "--json", "-", "-q"];
    for subcommand in [&render[..], &["explain"]] {
        let output = run(subcommand);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(said.lines().count() <= 7, "{said}");
        let kinds = [("`strange`", 13, 25), ("`peculiar`", 12, 26), ("`rare`", 12, 27)];
        for (name, more, line) in kinds {
            let words = |text: &str| text.contains(name) && text.starts_with("warning: ");
            let found = said.lines().find(|text| words(text)).unwrap_or_else(|| panic!("{name} in {said}"));
            assert!(found.contains(&format!("slips.xml:{line}:20; {more} more like it")), "{found}");
        }
        assert!(
            said.contains("20 remarks on what has no effect") && said.contains("all 40 warnings"),
            "{said}"
        );
    }
}

#[test]
fn nothing_is_lost() {
    let output = run(&["render", "--spp", "1", "-o", "slips.png", "--json", "-", "-q", "--verbose"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    for line in (4..24).chain(25..65) {
        assert!(said.contains(&format!("slips.xml:{line}:")), "line {line} in:\n{said}");
    }
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["warnings"].as_array().unwrap().len(), 60);
}
