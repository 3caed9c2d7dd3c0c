//! The program as a user meets it: files in, files out, messages, exit codes.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Duration;

/// An empty folder for one test.
fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cli").join(name);
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

fn program() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pointillist"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).env("POINTILLIST_VALIDATION", "1");
    command
}

fn run(args: &[&str]) -> Output {
    program().args(args).output().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[track_caller]
fn succeed(args: &[&str]) -> Output {
    let output = run(args);
    assert!(output.status.success(), "{args:?} failed:\n{}", stderr(&output));
    assert!(!stderr(&output).contains("Validation"), "{}", stderr(&output));
    output
}

/// The bytes of a deterministic picture of the Cornell box with spheres.
fn picture(dir: &Path, device: &str, threads: &str, extra: &[&str]) -> Vec<u8> {
    let out = dir.join(format!("{device}-{threads}.exr"));
    let file = out.to_str().unwrap();
    let mut args =
        vec!["render", "scenes/cornell_spheres.xml", "-o", file, "--size", "61x47", "--samples", "150k"];
    args.extend(["--deterministic", "--quiet", "--device", device, "--threads", threads]);
    args.extend(extra);
    succeed(&args);
    fs::read(out).unwrap()
}

#[test]
fn deterministic_pictures_have_the_same_bytes_for_any_thread_count() {
    let dir = folder("deterministic");
    // "0" is the first Vulkan device, lavapipe where there is no GPU.
    for device in ["cpu", "0"] {
        let one = picture(&dir, device, "1", &[]);
        for threads in ["1", "2", "7"] {
            assert!(one == picture(&dir, device, threads, &[]), "{device}: {threads} threads differ from 1");
        }
        // The comparison can tell pictures apart.
        assert!(one != picture(&dir, device, "1", &["--seed", "1"]), "{device}: the seed changes nothing");
    }
}

#[test]
fn json_says_what_was_done() {
    let dir = folder("json");
    let png = dir.join("a.png");
    let output = succeed(&[
        "render",
        "scenes/furnace.xml",
        "-o",
        png.to_str().unwrap(),
        "--size",
        "32x32",
        "--spp",
        "4",
        "--json",
        "-",
        "--quiet",
        "--device",
        "cpu",
        "--threads",
        "2",
    ]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["width"], 32);
    // 4 per texel of the film, which is padded by 3 texels for the Gaussian filter unless the file says box.
    let paths = json["camera_paths"].as_u64().unwrap();
    assert!((4 * 32 * 32..=4 * 38 * 38).contains(&paths), "{paths}");
    assert_eq!(json["camera_samples"].as_u64().unwrap() + json["rejected"]["total"].as_u64().unwrap(), paths);
    assert_eq!(json["rejected"]["total"], 0);
    assert_eq!(json["light_paths"], 0);
    assert!(json["seconds"]["total"].as_f64().unwrap() > 0.0);
    assert!(json["peak_memory_bytes"].as_u64().unwrap() > 1 << 20);
    assert!(png.exists());
}

/// Every method fills its streams, says its name, and gives the same bytes for any number of threads.
#[test]
fn methods_of_light_transport() {
    let dir = folder("methods");
    for (method, streams) in [
        ("path", [9000, 0]),
        ("light", [0, 9000]),
        ("bidirectional", [9000, 4500]),
        ("photon", [9000, 0]),
        ("vcm", [9000, 4500]),
    ] {
        let exr = dir.join("method.exr");
        let file = exr.to_str().unwrap();
        let mut args =
            vec!["render", "scenes/cornell.xml", "-o", file, "--size", "16x16", "--samples", "9000"];
        args.extend(["--integrator", method, "--deterministic", "--quiet", "--device", "cpu", "--json", "-"]);
        let mut pictures = Vec::new();
        for threads in ["1", "3"] {
            let output = succeed(&[&args[..], &["--threads", threads]].concat());
            let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
            assert_eq!(json["integrator"], method);
            assert_eq!([&json["camera_paths"], &json["light_paths"]], streams, "{method}");
            assert_eq!(json["light_samples"].as_u64().unwrap() > 0, streams[1] > 0);
            assert_eq!(json["rejected"]["total"], 0);
            pictures.push(fs::read(&exr).unwrap());
        }
        assert!(pictures[0] == pictures[1], "{method}: 3 threads differ from 1");
    }
}

/// The chosen method is stated and recorded, gives the bytes of that method, and does not depend on the number of threads.
#[test]
fn a_method_is_chosen() {
    let dir = folder("auto");
    let render = |name: &str, options: &[&str]| {
        let exr = dir.join(name);
        let (file, scene) = (exr.to_str().unwrap(), "scenes/cove.xml");
        let args = ["render", scene, "-o", file, "--size", "16x16", "--samples", "9000", "--device", "cpu"];
        let output = succeed(&[&args[..], &["--deterministic", "--json", "-"], options].concat());
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        (json, stderr(&output), fs::read(&exr).unwrap())
    };
    let (json, words, bytes) = render("a.exr", &["--integrator", "auto", "--threads", "1"]);
    assert_eq!(json["integrator"], "bidirectional");
    let reason = json["auto"]["reason"].as_str().unwrap();
    assert!(reason.starts_with("auto: bidirectional — ") && !reason.contains('\n'), "{reason}");
    assert!(words.contains(reason), "{words}");
    assert_eq!(json["auto"]["candidates"].as_array().unwrap().len(), 4);
    let text = String::from_utf8_lossy(&bytes).into_owned();
    assert!(text.contains(reason) && text.contains("--integrator bidirectional"), "not in the file");
    let (_, _, again) = render("a.exr", &["--integrator", "auto", "--threads", "3"]);
    assert!(bytes == again, "another number of threads gives another picture");
    let (json, words, quiet) = render("a.exr", &["--integrator", "auto", "--quiet"]);
    assert!(words.is_empty(), "{words}");
    assert_eq!(json["integrator"], "bidirectional");
    assert!(quiet == bytes);
    // Asked for by name there is no reason to give.
    let (json, words, _) = render("b.exr", &["--integrator", "light"]);
    assert!(json["auto"].is_null() && !words.contains("auto:"), "{words}");
}

#[test]
fn bad_arguments_are_answered_before_any_work() {
    let dir = folder("arguments");
    let nowhere = dir.join("no/such/folder/a.png");
    let scene = "scenes/furnace.xml";
    let cases: &[(&[&str], &str)] = &[
        (&["render", "no-such-scene.xml", "-o", "a.png"], "no-such-scene.xml"),
        (&["render", scene, "-o", nowhere.to_str().unwrap()], "no/such/folder"),
        (&["render", scene, "-o", "picture.jpeg"], "picture.jpeg"),
        (&["render", scene, "--spp", "0"], "--spp"),
        (&["render", scene, "--integrator", "bidir"], "path, light, bidirectional, photon, vcm, depth, auto"),
        (&["view", scene, "--integrator", "Auto"], "path, light, bidirectional, photon, vcm, depth, auto"),
        (&["render", scene, "--spp", "4", "--time", "3"], "--time"),
        (&["render", scene, "--time", "1e300"], "--time"),
        (&["render", scene, "--profile", "srbg"], "srbg"),
        (&["render", scene, "--device", "no such device"], "no such device"),
        (&["render", scene, "--json", nowhere.to_str().unwrap()], "no/such/folder"),
        (&["render", scene, "--json", scene], "overwrite"),
        (&["render", scene, "-o", "target/a.png", "--json", "./target/a.png"], "overwrite"),
        (&["render", scene, "-D", "nothing"], "NAME=VALUE"),
        (&["render", scene, "--gpu-timings", nowhere.to_str().unwrap()], "no/such/folder"),
        (&["render", scene, "--gpu-timings", "-"], "--gpu-timings"),
        (&["render", scene, "--gpu-timings", scene], "overwrite"),
        (&["render", scene, "--json", "target/a.json", "--gpu-timings", "target/a"], "overwrite"),
        (&["bench", scene, "--frames", "0"], "--frames"),
        (&["bench", scene, "--device", "cpu"], "--device cpu"),
        (&["bench", scene, "--json", nowhere.to_str().unwrap()], "no/such/folder"),
    ];
    for (args, expected) in cases {
        let output = run(args);
        let text = stderr(&output);
        assert!(!output.status.success(), "{args:?} succeeded");
        // miette folds long lines: compare without white space.
        let squeeze = |s: &str| s.chars().filter(|c| !c.is_whitespace() && *c != '│').collect::<String>();
        assert!(
            squeeze(&text).contains(&squeeze(expected)),
            "{args:?} does not mention {expected:?}:\n{text}"
        );
        assert!(!text.contains("panicked"), "{text}");
    }
}

/// Without a GPU the capture holds the CPU's spans and says so.
#[test]
fn bench_and_timings_say_what_was_measured() {
    let dir = folder("bench");
    let (csv, png) = (dir.join("t.csv"), dir.join("a.png"));
    let [table, out] = [&csv, &png].map(|p| p.to_str().unwrap());
    let base = ["scenes/furnace.xml", "--size", "32x32", "--threads", "1"];
    let args = ["render", "-q", "-o", out, "--device", "cpu", "--gpu-timings", table];
    assert!(stderr(&succeed(&[&args[..], &base].concat())).contains("CPU only"));
    assert!(fs::read_to_string(&csv).unwrap().contains("nothing to time on a GPU"));

    let output = succeed(&[&["bench", "--device", "0", "--frames", "60", "--json", "-"][..], &base].concat());
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&json["frames"], &json["width"]), (&60.into(), &32.into()));
    assert!(json["gpu"]["driver"].as_str().is_some_and(|d| !d.is_empty()), "{json}");
    assert!(json["command"].as_array().unwrap().iter().any(|w| w == "--frames"), "{json}");
    let passes = json["passes"].as_array().unwrap();
    for name in ["splat", "fold", "variance", "reconstruct", "tonemap", "copy"] {
        let pass = passes.iter().find(|p| p["name"] == name).unwrap_or_else(|| panic!("{name}: {json}"));
        assert!(pass["milliseconds"]["p50"].as_f64() <= pass["milliseconds"]["p95"].as_f64(), "{pass}");
        assert!(pass["bytes"].as_f64().is_some_and(|b| b > 0.0), "{pass}");
    }
}

#[test]
fn ctrl_c_writes_what_is_there() {
    let dir = folder("interrupt");
    let (exr, json) = (dir.join("a.exr"), dir.join("a.json"));
    let child = program()
        .args(["render", "scenes/cornell.xml", "-o", exr.to_str().unwrap(), "--json", json.to_str().unwrap()])
        .args(["--size", "32x32", "--time", "300", "--device", "cpu"])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_secs(2));
    // Twice, as `timeout` and some shells send it: that is one wish.
    let kill = Command::new("sh").arg("-c").arg(format!("kill -INT {0}; kill -INT {0}", child.id())).status();
    assert!(kill.unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(stderr(&output).contains("Ctrl-C"), "{}", stderr(&output));
    assert!(exr.exists());
    let report: serde_json::Value = serde_json::from_slice(&fs::read(json).unwrap()).unwrap();
    assert_eq!(report["interrupted"], true);
    assert!(report["camera_samples"].as_u64().unwrap() > 0);
    let left: Vec<_> = fs::read_dir(&dir).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left.len(), 2, "temporary files were left behind: {left:?}");
}

/// What is found out after the file was read reaches the user; a time beyond every clock and closed pipes are no panic.
#[test]
fn odd_but_valid_requests() {
    let dir = folder("odd");
    let (scene, png) = (dir.join("huge.xml"), dir.join("a.png"));
    let text = "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><emitter type=\"constant\"/>\n<shape type=\"cube\">\
                <transform name=\"to_world\"><scale value=\"1e30\"/></transform></shape></scene>";
    fs::write(&scene, text).unwrap();
    let base =
        ["render", scene.to_str().unwrap(), "-o", png.to_str().unwrap(), "--size", "4x4", "--device", "cpu"];
    let output = succeed(&[&base[..], &["--spp", "1", "--json", "-", "-q"]].concat());
    assert!(stderr(&output).contains("6 primitives"), "{}", stderr(&output));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(json["warnings"][0].as_str().unwrap().contains("6 primitives"));

    let mut child =
        program().args(base).args(["--time", "1e15", "-q"]).stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(Duration::from_millis(500));
    assert!(child.try_wait().unwrap().is_none(), "{}", stderr(&child.wait_with_output().unwrap()));
    child.kill().unwrap();
    child.wait().unwrap();

    for args in [vec!["devices"], [&base[..], &["--spp", "1"]].concat()] {
        let mut child = program().args(&args).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop((child.stdout.take(), child.stderr.take()));
        assert!(child.wait().unwrap().success(), "{args:?} with nobody to read");
    }
}

#[test]
fn an_old_picture_survives_a_failed_run() {
    let dir = folder("survive");
    let out = dir.join("old.png");
    fs::write(&out, b"old").unwrap();
    let scene = dir.join("broken.xml");
    fs::write(&scene, "<scene version=\"3.0.0\">\n  <shape type=\"no-such-shape\"/>\n</scene>\n").unwrap();
    let output = run(&["render", scene.to_str().unwrap(), "-o", out.to_str().unwrap()]);
    let text = stderr(&output);
    assert!(!output.status.success());
    assert!(text.contains("broken.xml:2:"), "no place in:\n{text}");
    assert!(text.contains("no-such-shape"), "{text}");
    assert_eq!(fs::read(&out).unwrap(), b"old");
}

#[test]
fn devices_are_listed() {
    let output = succeed(&["devices"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains("cpu"), "{text}");
    assert!(text.lines().count() >= 2, "no Vulkan device is listed:\n{text}");
    assert!(text.lines().any(|line| line.contains(" MB of memory")), "{text}");
}

/// Light that no sum could hold is not silently black: its samples are counted, with the path that made them.
#[test]
fn light_beyond_the_range_is_reported() {
    let dir = folder("too-bright");
    let scene = dir.join("bright.xml");
    let text = r#"<scene version="3.0.0">
        <sensor type="perspective"><film type="hdrfilm"/></sensor>
        <emitter type="constant"><spectrum name="radiance" value="1e32"/></emitter>
    </scene>"#;
    fs::write(&scene, text).unwrap();
    let (scene, json, out) = (scene, dir.join("r.json"), dir.join("r.exr"));
    let [scene, report, out] = [&scene, &json, &out].map(|p| p.to_str().unwrap());
    let args =
        ["render", scene, "-o", out, "--size", "8x8", "--samples", "1k", "--device", "cpu", "--json", report];
    let output = succeed(&args);
    assert!(stderr(&output).contains("contributions to samples rejected"), "{}", stderr(&output));
    let json: serde_json::Value = serde_json::from_slice(&fs::read(&json).unwrap()).unwrap();
    let rejected = &json["rejected"];
    assert_eq!(rejected["by_cause"]["too large"], rejected["total"]);
    assert!(rejected["total"].as_u64().unwrap() > 900, "{json}");
    let origin = rejected["by_origin"][0]["what"].as_str().unwrap();
    assert!(origin.starts_with("emission too large, from ") && origin.contains("constant"), "{origin}");
    let header = String::from_utf8_lossy(&fs::read(out).unwrap()).into_owned();
    assert!(header.contains("emission too large"), "the picture's file names what was rejected");
}

/// The command that the report names traces the path of a rejected value again, by every method, to the same value.
#[test]
fn rejected_values_are_replayed() {
    let dir = folder("replay");
    let scene = dir.join("bright.xml");
    // A lamp as bright as can be over a floor, in a soft sky.
    let text = r#"<scene version="3.0.0">
        <sensor type="perspective"><film type="hdrfilm"/>
            <transform name="to_world"><lookat origin="0,3,-3" target="0,0,0" up="0,1,0"/></transform></sensor>
        <emitter type="constant"><spectrum name="radiance" value="1"/></emitter>
        <emitter type="point" id="lamp"><point name="position" value="0,1e-4,0"/><spectrum name="intensity" value="1e30"/></emitter>
        <shape type="rectangle" id="floor"><transform name="to_world"><rotate x="1" angle="-90"/></transform></shape>
        <shape type="sphere" id="ball"><point name="center" value="0.5,0.3,0"/><float name="radius" value="0.3"/>
            <bsdf type="roughconductor" id="steel"/></shape>
    </scene>"#;
    fs::write(&scene, text).unwrap();
    let (scene, report, out) = (scene, dir.join("r.json"), dir.join("r.png"));
    let [scene, report, out] = [&scene, &report, &out].map(|p| p.to_str().unwrap());
    for method in ["path", "light", "bidirectional", "photon", "vcm"] {
        let mut args =
            vec!["render", scene, "-o", out, "--size", "16x16", "--samples", "64k", "--device", "cpu"];
        args.extend(["--integrator", method, "--json", report, "--max-depth", "4"]);
        succeed(&args);
        let json: serde_json::Value = serde_json::from_slice(&fs::read(report).unwrap()).unwrap();
        let examples = json["rejected"]["examples"].as_array().unwrap();
        assert!(!examples.is_empty(), "{method}: {}", json["rejected"]);
        for example in examples.iter().step_by(examples.len().div_ceil(4)) {
            let command = example["replay"].as_str().unwrap();
            let output = succeed(&command.split_whitespace().skip(1).collect::<Vec<_>>());
            let (told, what) = (String::from_utf8(output.stdout).unwrap(), example["what"].as_str().unwrap());
            assert!(told.contains(&format!("rejected: {what}")), "{method}: {command}\n{what}\n{told}");
        }
    }
}
