//! `pointillist regress run --time-against`.
#![cfg(unix)]

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::regress::{folder, prepare, regress, run, scene, text, update, write};

/// A program of this shell script, in which `$report` and `$picture` are the files that it is to write.
///
/// A process of its own writes it: a file that the child of another thread still holds open for writing cannot be started.
fn program(place: &Path, name: &str, script: &str) -> PathBuf {
    let path = place.join(name);
    let script = format!(
        "#!/bin/sh\nlast=\nfor word; do case $last in -o) picture=$word;; --json) report=$word;; esac; last=$word; done\n{script}\n"
    );
    let write = "printf %s \"$1\" > \"$0\" && chmod 755 \"$0\"";
    let made = Command::new("/bin/sh").args(["-c", write]).arg(&path).arg(script).status().unwrap();
    assert!(made.success());
    path
}

/// A folder of one case with its reference.
fn one_case(name: &str) -> PathBuf {
    let place = folder(name);
    prepare(&place, "[[case]]\nscene = \"a.xml\"\n", &["a.xml"]);
    update(&place);
    place
}

fn against<'a>(program: &'a Path, more: &[&'a str]) -> Vec<&'a str> {
    [&["--time-against", program.to_str().unwrap()][..], more].concat()
}

fn figure<'a>(case: &'a Value, name: &str) -> &'a Value {
    let figures = case["timing"]["figures"].as_array().unwrap();
    figures.iter().find(|figure| figure["name"] == name).unwrap_or_else(|| panic!("{case}"))
}

/// This program is not slower than itself.
#[test]
fn the_same_program_is_not_slower() {
    let place = one_case("timed_itself");
    let own = Path::new(env!("CARGO_BIN_EXE_pointillist"));
    let cases = run(&place, &against(own, &["--most-time-pairs", "10", "--fail-on-slower", "50"]), 0);
    let timing = &cases[0]["timing"];
    assert_ne!(timing["verdict"], "untimed", "{timing}");
    assert!((5..=10).contains(&timing["pairs"].as_u64().unwrap()), "{timing}");
    for name in ["tracing a path", "rendering", "the whole process"] {
        assert!(figure(&cases[0], name)["ratio"]["value"].as_f64().unwrap() > 0.0);
    }
    let page = std::fs::read_to_string(place.join("results/index.html")).unwrap();
    assert!(page.contains("Time against another program"));
    // Without the option there are no times.
    assert!(run(&place, &[], 0)[0].get("timing").is_none());
}

/// What sleeps takes longer as a process, and not where it does not sleep.
#[test]
fn a_program_that_sleeps_is_found() {
    let place = one_case("timed_sleep");
    let own = env!("CARGO_BIN_EXE_pointillist");
    let sleeps = program(&place, "sleeps", &format!("sleep 1; exec '{own}' \"$@\""));
    let pairs = ["--time-pairs", "8", "--most-time-pairs", "8"];
    let cases = run(&place, &against(&sleeps, &pairs), 0);
    let process = figure(&cases[0], "the whole process");
    assert!(process["certain"][1].as_f64().unwrap() < 1.0, "{cases:?}");
    let output = regress(&place, &[&["run"][..], &against(&sleeps, &pairs)].concat(), 0);
    assert!(text(&output.stdout).contains("faster: "), "{}", text(&output.stdout));
}

/// A case that became slower is red only on request, and then with its name.
#[test]
fn a_slower_case_is_red_on_request() {
    let place = one_case("timed_slower");
    let report = r#"echo '{"paths_per_trace_second": 1e15, "seconds": {"render": 1e-9}}' > "$report""#;
    let fast = program(&place, "fast", &format!(": > \"$picture\"; {report}"));
    let cases = run(&place, &against(&fast, &[]), 0);
    assert_eq!(cases[0]["timing"]["verdict"], "slower", "{cases:?}");
    assert_eq!(cases[0]["verdict"], "same-bits");
    let words = [&["run"][..], &against(&fast, &["--fail-on-slower", "10"])].concat();
    let output = regress(&place, &words, 1);
    assert!(
        text(&output.stderr).contains("certainly slower by more than 10 %: a"),
        "{}",
        text(&output.stderr)
    );
}

/// Another program that does not render is told, and red only on request.
#[test]
fn a_program_that_fails_is_no_time() {
    let place = one_case("timed_fails");
    let fails = program(&place, "fails", "echo its last words; exit 3");
    let cases = run(&place, &against(&fails, &[]), 0);
    assert_eq!(cases[0]["timing"]["verdict"], "untimed");
    assert!(cases[0]["timing"]["sentence"].as_str().unwrap().contains("its last words"), "{cases:?}");
    run(&place, &against(&fails, &["--fail-on-slower", "10"]), 2);
    let output = regress(&place, &["run", "--time-against", "/none/such"], 2);
    assert!(text(&output.stderr).contains("there is no such file"), "{}", text(&output.stderr));
    regress(&place, &["run", "--fail-on-slower", "10"], 2);
}

/// Every run says how long its renderings took, and each pass where there is a GPU.
#[test]
fn every_run_captures_times() {
    for (name, device) in [("times_cpu", "devices = [\"cpu\"]"), ("times_gpu", "")] {
        let place = folder(name);
        let manifest =
            format!("[defaults]\n{device}\nspp = 2\nmost_seeds = 8\n[[case]]\nscene = \"a.xml\"\n");
        write(&place, "regress.toml", &manifest);
        write(&place, "a.xml", &scene(0.5));
        update(&place);
        let junit = place.join("junit.xml");
        let cases = run(&place, &["--junit", junit.to_str().unwrap()], 0);
        let times = &cases[0]["times"];
        for key in ["seconds", "paths_per_trace_second"] {
            assert!(times[key].as_f64().unwrap() > 0.0, "{key}: {times}");
        }
        assert!(cases[0]["command"].as_array().unwrap().iter().all(|word| word != "--gpu-timings"));
        let passes: Vec<Value> = times["passes"].as_array().cloned().unwrap_or_default();
        assert!(passes.iter().all(|pass| pass["milliseconds"].as_f64().unwrap() > 0.0), "{times}");
        let files = [junit, place.join("results/index.html"), place.join("results/history.jsonl")];
        let [junit, page, history] = files.map(|file| std::fs::read_to_string(file).unwrap());
        assert!(junit.contains("for a rendering"), "{junit}");
        assert!(history.contains("paths_per_trace_second"), "{history}");
        let has_splat = passes.iter().any(|pass| pass["name"] == "splat");
        let is_gpu = device.is_empty();
        assert_eq!(
            [
                has_splat,
                junit.contains("GPU pass splat"),
                page.contains("GPU's passes"),
                history.contains("splat")
            ],
            [is_gpu; 4],
            "{times}"
        );
    }
}

/// The times of shards make a merged run red as those of a whole run do.
#[test]
fn times_of_shards_are_joined() {
    let place = one_case("timed_shards");
    let report = r#"echo '{"paths_per_trace_second": 1e15, "seconds": {"render": 1e-9}}' > "$report""#;
    let fast = program(&place, "fast", &format!(": > \"$picture\"; {report}"));
    let [shard, joined, junit] =
        ["shard", "joined", "junit.xml"].map(|name| place.join(name).display().to_string());
    let merge = |more: &[&str], code: i32| {
        let words = [&["merge", &shard, "--results", &joined, "--junit", &junit][..], more].concat();
        let output = regress(&place, &words, code);
        (text(&output.stderr), std::fs::read_to_string(&junit).unwrap())
    };
    run(&place, &against(&fast, &["--shard", "1/1", "--results", &shard]), 0);
    let (_, xml) = merge(&[], 0);
    assert!(xml.contains("failures=\"0\"") && xml.contains("fast: slower"), "{xml}");
    let (told, xml) = merge(&["--fail-on-slower", "10", "--annotations", "github"], 1);
    assert!(told.contains("certainly slower by more than 10 %: a"), "{told}");
    assert!(xml.contains("failure type=\"slower\""), "{xml}");
    // What was not timed is not passed over.
    run(&place, &["--shard", "1/1", "--results", &shard, "--fresh"], 0);
    merge(&[], 0);
    let (told, xml) = merge(&["--fail-on-slower", "10"], 2);
    assert!(told.contains("not timed: a") && xml.contains("error type=\"not timed\""), "{told}{xml}");
}
