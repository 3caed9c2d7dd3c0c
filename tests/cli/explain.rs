//! `pointillist explain`: the plan is printed at once, and prices after it, one by one.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::Value;

/// The costs of an effect in JSON.
const COSTS: [&str; 6] = ["share", "milliseconds", "if_on", "once", "if_on_share", "bytes"];

fn explain() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pointillist"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).args(["explain", "scenes/cornell_spheres.xml"]);
    command.args(["--size", "64x64", "--device", "cpu"]);
    command
}

fn has_cost(entry: &Value) -> bool {
    COSTS.iter().any(|cost| entry.get(cost).is_some())
}

/// Nothing is measured unless it is asked for, and the words hold what the JSON holds.
#[test]
fn the_plan_takes_no_measurement() {
    let output = explain().output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    let json: Value = serde_json::from_slice(&explain().arg("--json").output().unwrap().stdout).unwrap();
    for key in ["memory", "pipelines", "budget"] {
        assert!(json.get(key).is_none(), "{key}");
    }
    let plan = json["plan"].as_array().unwrap();
    assert!(plan.len() > 20, "{plan:?}");
    for entry in plan {
        assert!(!has_cost(entry), "{entry}");
        let [name, reason] = ["effect", "reason"].map(|key| entry[key].as_str().unwrap());
        let on = if entry["on"] == true { "yes" } else { "–" };
        let place = entry["place"].as_str().map(|place| place.trim_start_matches("scenes/"));
        let said = |line: &str| {
            let line = line.split_whitespace().collect::<Vec<_>>().join(" ");
            line.starts_with(&format!("{name} {on} {reason}")) && line.contains(place.unwrap_or(""))
        };
        assert!(text.lines().any(said), "{entry} in:\n{text}");
    }
    let order = ["64×64 pixels", "TRACER", "CLIENT", "DEVICE MEMORY", "PRICES"];
    let at = order.map(|words| text.find(words).unwrap_or_else(|| panic!("{words} in:\n{text}")));
    assert!(at.is_sorted(), "{text}");
    assert!(text.contains("--prices"), "{text}");
}

/// Every price is printed as soon as it is known. Ctrl-C ends the measurement, and what was measured stays.
#[cfg(unix)]
#[test]
fn prices_stream_until_ctrl_c() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("explain_cli");
    std::fs::create_dir_all(&folder).unwrap();
    let json = folder.join("interrupted.json");
    let mut command = explain();
    command.arg("--prices").arg(format!("--json={}", json.display()));
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines().map(Result::unwrap);
    let price = |line: &String| line.contains(" %") || line.contains('×');
    assert!(lines.by_ref().any(|line| line.starts_with("PRICES: TRACER")));
    let first = lines.next().unwrap();
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(price(&first) && kill.unwrap().success(), "{first}");
    let rest: Vec<String> = lines.collect();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(rest.last().unwrap().contains("stopped by Ctrl-C"), "{rest:?}");
    let written: Value = serde_json::from_slice(&std::fs::read(json).unwrap()).unwrap();
    let entries = written["plan"].as_array().unwrap();
    let measured = entries.iter().filter(|entry| has_cost(entry)).count();
    assert_eq!(measured, 1 + rest.iter().filter(|line| price(line)).count());
    // There are 15 effects of the tracer, which take about half a second each.
    assert!((1..8).contains(&measured), "{measured} were measured: {rest:?}");
}

/// Each effect of the tracer has a price or is named among those without one.
#[test]
fn every_effect_is_accounted_for() {
    let output = explain().arg("--prices").output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    let (plan, prices) = text.split_once("PRICES: TRACER").unwrap();
    let (prices, _) = prices.split_once("PRICES: CLIENT").unwrap();
    let (_, plan) = plan.split_once("TRACER").unwrap();
    let (plan, _) = plan.split_once("CLIENT").unwrap();
    let names: Vec<&str> = plan.lines().skip(1).map(|line| line.split_whitespace().next().unwrap()).collect();
    assert_eq!(names.len(), 19, "{plan}");
    let words: Vec<&str> = prices.split(|c: char| c != '-' && !c.is_alphanumeric()).collect();
    for name in names {
        assert_eq!(words.iter().filter(|word| **word == name).count(), 1, "{name} in:\n{prices}");
    }
}

/// Who reads the first lines only does not wait for the others to be measured.
#[test]
fn prices_end_when_nobody_reads() {
    let mut child = explain().arg("--prices").stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    drop(child.stdout.take());
    let begin = std::time::Instant::now();
    assert!(child.wait().unwrap().success());
    assert!(begin.elapsed().as_secs() < 4, "it has measured all of them for nobody");
}
