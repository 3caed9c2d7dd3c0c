//! `pointillist regress`: verdicts and exit codes, broken cases, interrupted runs, shards, references.
#![cfg(unix)]

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

/// A folder for one test, with nothing in it.
pub fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("regress_cli").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// A sphere of this albedo under a square light, in 16×16 pixels.
pub fn scene(albedo: f64) -> String {
    format!(
        r#"<scene version="3.0.0">
<integrator type="path"/>
<sensor type="perspective"><float name="fov" value="30"/>
<transform name="to_world"><lookat origin="0,1,5" target="0,0,0" up="0,1,0"/></transform>
<film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/></film></sensor>
<shape type="sphere"><bsdf type="diffuse"><rgb name="reflectance" value="{albedo}"/></bsdf></shape>
<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="90"/><translate y="3"/></transform>
<emitter type="area"><rgb name="radiance" value="4"/></emitter></shape>
</scene>
"#
    )
}

const SMALL: &str = "[defaults]\ndevices = [\"cpu\"]\nspp = 2\nmost_seeds = 16\n";

/// Writes a manifest with the defaults of small cases, and scenes by their names.
pub fn prepare(place: &Path, manifest: &str, scenes: &[&str]) {
    write(place, "regress.toml", &format!("{SMALL}{manifest}"));
    scenes.iter().for_each(|name| write(place, name, &scene(0.5)));
}

pub fn write(place: &Path, name: &str, text: &str) {
    std::fs::write(place.join(name), text).unwrap();
}

pub fn command(place: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pointillist"));
    command.arg("regress").arg(words[0]).arg(place).args(&words[1..]);
    command
}

/// Runs the subcommand, and checks its exit code.
#[track_caller]
pub fn regress(place: &Path, words: &[&str], code: i32) -> Output {
    let output = command(place, words).output().unwrap();
    assert_eq!(
        output.status.code(),
        Some(code),
        "{words:?}: {}{}",
        text(&output.stdout),
        text(&output.stderr)
    );
    output
}

pub fn text(bytes: &[u8]) -> String {
    // Errors are wrapped at the width of a terminal.
    String::from_utf8_lossy(bytes).replace("\n  │ ", " ")
}

/// Runs all cases, and returns the report by its cases.
#[track_caller]
pub fn run(place: &Path, words: &[&str], code: i32) -> Vec<Value> {
    let file = place.join("report.json");
    let json = file.display().to_string();
    regress(place, &[&["run", "--json", &json][..], words].concat(), code);
    cases(&file)
}

fn cases(file: &Path) -> Vec<Value> {
    let report: Value = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    report["cases"].as_array().unwrap().clone()
}

#[track_caller]
pub fn update(place: &Path) {
    regress(place, &["update", "--reason", "a test"], 0);
}

fn sentence(case: &Value) -> &str {
    case["sentence"].as_str().unwrap()
}

/// Waits until something is there.
#[track_caller]
pub fn wait_for(child: &mut Child, file: &Path) {
    let deadline = Instant::now() + Duration::from_secs(60);
    while !file.exists() {
        assert!(Instant::now() < deadline, "{} is still not there", file.display());
        assert!(child.try_wait().unwrap().is_none(), "the run has ended without {}", file.display());
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Nothing changed: green, and the run says what it would have found. An albedo of another value: red, and only that case.
#[test]
fn what_has_changed_is_found_and_nothing_else() {
    let place = folder("changed");
    prepare(&place, "[[case]]\nscene = \"*.xml\"\n", &["a.xml", "b.xml"]);
    // Without references there is nothing to compare with, and the message says what to do.
    let cases = run(&place, &[], 2);
    assert!(sentence(&cases[0]).contains("regress update"), "{cases:?}");
    update(&place);
    // By the reference's own seeds.
    let cases = run(&place, &[], 0);
    for case in &cases {
        assert_eq!(case["verdict"], "same-bits", "{case}");
        assert!(sentence(case).contains("all bits of 8 renderings"), "{case}");
        assert!(case["renderings"] == 8 && case["judgement"].is_null(), "{case}");
        assert!(Path::new(case["reference"].as_str().unwrap()).exists());
    }
    // By others.
    let cases = run(&place, &["--seed-base", "5000"], 0);
    assert_eq!(cases.len(), 2);
    for case in &cases {
        assert_eq!(case["verdict"], "equal-within-noise", "{case}");
        assert!(sentence(case).contains("would have been found"), "{case}");
        assert!(case["judgement"]["detectable"].as_f64().unwrap() > 0.0);
        assert_eq!(case["device"], "cpu");
        assert!(case["renderings"].as_u64().unwrap() >= 8);
        assert!(case["command"].as_array().unwrap().iter().any(|word| word == "render"));
        let picture = place.join("results").join(case["picture"].as_str().unwrap());
        assert!(picture.exists() && Path::new(case["reference"].as_str().unwrap()).exists());
    }
    assert!(!place.join("results/a").exists() && !place.join("results/.unfinished").exists());
    assert!(place.join("results/index.html").exists() && place.join("results/history.jsonl").exists());
    // The same command, the same verdict.
    run(&place, &[], 0);
    write(&place, "b.xml", &scene(0.6));
    let cases = run(&place, &[], 1);
    assert_eq!([&cases[0]["verdict"], &cases[1]["verdict"]], ["same-bits", "changed"]);
    assert!(sentence(&cases[1]).contains("brightness R +"), "{cases:?}");
    // One case alone, judged as in the whole run.
    assert_eq!(run(&place, &["--case", "a"], 0).len(), 1);
    let output = regress(&place, &["run", "--case", "c"], 2);
    assert!(text(&output.stderr).contains("no case has c"), "{}", text(&output.stderr));
    // Accepted.
    regress(&place, &["update", "b", "--reason", "lighter"], 0);
    run(&place, &[], 0);
}

/// The seeds of all renderings in the log of a case, in order.
fn seeds_in_log(place: &Path, name: &str) -> Vec<u32> {
    let log = std::fs::read_to_string(place.join(format!("results/{name}.log"))).unwrap();
    let after = log.split("--seed ").skip(1);
    after.map(|rest| rest.split_whitespace().next().unwrap().parse().unwrap()).collect()
}

/// Other bits are no change where the class does not ask for them: they cost one rendering, and others decide.
#[test]
fn other_bits_alone_are_no_change() {
    let place = folder("other_bits");
    prepare(&place, "[[case]]\nscene = \"a.xml\"\n", &["a.xml"]);
    update(&place);
    run(&place, &[], 0);
    assert_eq!(seeds_in_log(&place, "a"), (0..8).collect::<Vec<_>>());
    // Far below what noise hides.
    write(&place, "a.xml", &scene(0.500_01));
    let case = &run(&place, &[], 0)[0];
    assert_eq!(case["verdict"], "equal-within-noise", "{case}");
    assert!(sentence(case).starts_with("no difference"), "{case}");
    let count = u32::try_from(case["renderings"].as_u64().unwrap()).unwrap();
    let wanted: Vec<u32> = [0].into_iter().chain(1000..1000 + count).collect();
    assert_eq!(seeds_in_log(&place, "a"), wanted);
    assert!(case["command"].as_array().unwrap().iter().any(|word| word == "--deterministic"), "{case}");
}

/// Of several methods with one reference, only the first can have its bits.
#[test]
fn only_the_owner_of_a_reference_is_compared_by_bits() {
    let place = folder("one_reference");
    let manifest = "[[case]]\nscene = \"a.xml\"\nmethods = [\"path\", \"bidirectional\"]\none_reference = [\"methods\"]\n";
    prepare(&place, manifest, &["a.xml"]);
    update(&place);
    let cases = run(&place, &[], 0);
    assert_eq!(
        [&cases[0]["verdict"], &cases[1]["verdict"]],
        ["same-bits", "equal-within-noise"],
        "{cases:?}"
    );
    assert_eq!(seeds_in_log(&place, "a+bidirectional")[0], 1000);
}

/// A reference whose case is no more is named, in one line, by runs of all cases.
#[test]
fn references_without_a_case_are_told() {
    let place = folder("unused");
    prepare(&place, "[[case]]\nscene = \"*.xml\"\n", &["a.xml", "b.xml"]);
    update(&place);
    std::fs::remove_file(place.join("b.xml")).unwrap();
    let told = |words: &[&str]| {
        let output = regress(&place, &[&["run"][..], words].concat(), 0);
        let told = text(&output.stderr);
        let lines = told.lines().filter(|line| line.contains("no case of this manifest is compared with"));
        lines.map(str::to_owned).collect::<Vec<_>>()
    };
    let lines = told(&[]);
    assert!(matches!(&lines[..], [line] if line.contains("b.exr") && !line.contains("a.exr")), "{lines:?}");
    assert!(told(&["--case", "a"]).is_empty());
    assert!(told(&["--shard", "1/2"]).is_empty());
}

#[test]
fn a_broken_case_is_not_the_end() {
    let place = folder("broken");
    let manifest = r#"timeout = 60
[renderer.hangs]
command = ["/bin/sh", "-c", "sleep 600 & sleep 600", "{scene}", "{output}", "{seed}"]
[renderer.crashes]
command = ["/bin/sh", "-c", "echo its last words; kill -ABRT $$", "{scene}", "{output}", "{seed}"]
[renderer.idle]
command = ["true", "{scene}", "{output}", "{seed}"]
[[case]]
scene = "fine.xml"
[[case]]
scene = "syntax.xml"
against = "fine"
[[case]]
name = "hangs"
scene = "fine.xml"
renderer = "hangs"
against = "fine"
timeout = 0.3
[[case]]
name = "crashes"
scene = "fine.xml"
renderer = "crashes"
against = "fine"
[[case]]
name = "idle"
scene = "fine.xml"
renderer = "idle"
against = "fine"
"#;
    prepare(&place, manifest, &["fine.xml"]);
    write(&place, "syntax.xml", "<scene version=\"3.0.0\">\n  <shape type=\"blob\"/>\n</scene>\n");
    update(&place);
    let start = Instant::now();
    let cases = run(&place, &[], 2);
    assert!(start.elapsed() < Duration::from_secs(120));
    let verdicts: Vec<&str> = cases.iter().map(|case| case["verdict"].as_str().unwrap()).collect();
    assert_eq!(verdicts, ["same-bits", "broken", "broken", "broken", "broken"]);
    for (case, wanted) in cases[1..].iter().zip([
        "syntax.xml:2:",
        "took longer than 0.3 s",
        "was ended by signal 6 (SIGABRT): its last words",
        "wrote no picture",
    ]) {
        assert!(sentence(case).contains(wanted), "{case}");
        assert!(place.join("results").join(case["log"].as_str().unwrap()).exists(), "{case}");
    }
}

/// Renders when the file `go` is there.
const WAITING: &str = r#"until [ -e go ]; do sleep 0.02; done
exec "$PROGRAM" render "$1" -o "$2" --seed "$3" --spp 2 --replicates 1 --device cpu --quiet
"#;

/// A plan of two cases whose second waits for a file.
fn waiting(name: &str) -> PathBuf {
    let place = folder(name);
    let manifest = r#"[renderer.waits]
command = ["/bin/sh", "waiting", "{scene}", "{output}", "{seed}"]
[[case]]
scene = "a.xml"
[[case]]
name = "b"
scene = "a.xml"
renderer = "waits"
against = "a"
"#;
    prepare(&place, manifest, &["a.xml"]);
    write(&place, "waiting", WAITING);
    update(&place);
    place
}

fn begin_waiting(place: &Path) -> Child {
    let mut command = command(place, &["run"]);
    command.env("PROGRAM", env!("CARGO_BIN_EXE_pointillist"));
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    wait_for(&mut child, &place.join("results/b.log"));
    child
}

/// Goes on after the end of a waiting run: the finished case is left as it is.
#[track_caller]
fn goes_on(place: &Path) {
    let first = place.join("results/a.json");
    let written = || std::fs::metadata(&first).unwrap().modified().unwrap();
    let before = written();
    let again = || {
        let mut command = command(place, &["run"]);
        let output = command.env("PROGRAM", env!("CARGO_BIN_EXE_pointillist")).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    };
    again();
    assert_eq!(written(), before);
    // A run that came to its end is not continued.
    again();
    assert_ne!(written(), before);
}

#[test]
fn a_run_that_was_killed_goes_on() {
    let place = waiting("killed");
    let mut child = begin_waiting(&place);
    child.kill().unwrap();
    child.wait().unwrap();
    write(&place, "go", "");
    goes_on(&place);
}

#[test]
fn ctrl_c_ends_after_the_rendering_in_progress() {
    let place = waiting("interrupted");
    let child = begin_waiting(&place);
    let sent = Command::new("kill").args(["-s", "INT", &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    write(&place, "go", "");
    let output = child.wait_with_output().unwrap();
    let errors = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{errors}");
    assert!(errors.contains("interrupted: 1 cases"), "{errors}");
    assert!(place.join("results/b/seed-1000.exr").exists(), "the rendering in progress is kept");
    goes_on(&place);
}

#[test]
fn mistakes_of_manifest_and_options_are_told() {
    let place = folder("mistakes");
    prepare(&place, "seed = 3\n[[case]]\nscene = \"a.xml\"\n", &["a.xml"]);
    let output = regress(&place, &["run"], 2);
    let errors = text(&output.stderr);
    assert!(errors.contains("regress.toml:5:1") && errors.contains("did you mean `seeds`?"), "{errors}");
    prepare(&place, "[[case]]\nscene = \"a.xml\"\n", &[]);
    regress(&place, &["update"], 2);
    regress(&place, &["run", "--shard", "3/2"], 2);
    let results = place.display().to_string();
    let output = regress(&place, &["run", "--results", &results], 2);
    assert!(text(&output.stderr).contains("would be mixed with scenes"), "{}", text(&output.stderr));
    let output = regress(&place, &["list"], 0);
    assert!(text(&output.stdout).contains("regress update"), "{}", text(&output.stdout));
}

/// What is of somebody else in the folder of the results stays there.
#[test]
fn folders_that_are_not_of_a_run_stay() {
    let place = folder("others");
    prepare(&place, "[[case]]\nscene = \"a.xml\"\n", &["a.xml"]);
    std::fs::create_dir_all(place.join("results/a")).unwrap();
    write(&place, "results/a/thesis.txt", "years of work");
    let output = regress(&place, &["run"], 2);
    assert!(text(&output.stderr).contains("is not of a regression run"), "{}", text(&output.stderr));
    assert!(place.join("results/a/thesis.txt").exists());
}

/// A shard for a merge is no failure to a scheduler, whatever its verdicts; called again, it keeps what it has until it is merged.
#[test]
fn a_shard_for_a_merge_is_kept_until_then() {
    let place = folder("for_merge");
    prepare(&place, "[[case]]\nscene = \"*.xml\"\n", &["a.xml", "b.xml"]);
    update(&place);
    write(&place, "b.xml", &scene(0.6));
    let [one, joined] = ["one", "joined"].map(|name| place.join(name).display().to_string());
    let shard = ["run", "--shard", "1/1", "--for-merge", "--results", one.as_str()];
    let written = || std::fs::metadata(place.join("one/a.json")).unwrap().modified().unwrap();
    regress(&place, &shard, 0);
    let first = written();
    regress(&place, &shard, 0);
    assert_eq!(written(), first);
    regress(&place, &["merge", &one, "--results", &joined], 1);
    assert!(!place.join("one/.unfinished-1-of-1").exists());
    // Of a case that several shards have, as of another number of shards before, the newest counts.
    let two = place.join("two").display().to_string();
    regress(&place, &["run", "--shard", "1/2", "--results", &two, "--seed-base", "5000"], 0);
    let json = place.join("merged.json").display().to_string();
    regress(&place, &["merge", &two, &one, "--results", &joined, "--json", &json], 1);
    let merged = cases(Path::new(&json));
    let is_of_two = |case: &Value| case["command"].as_array().unwrap().iter().any(|word| word == "5000");
    assert!(is_of_two(&merged[0]) && !is_of_two(&merged[1]), "{merged:?}");
    // What is judged can be chosen, as in the run.
    regress(&place, &["merge", &one, "--case", "a", "--results", &joined], 0);
    regress(&place, &["merge", &one, "--case", "c", "--results", &joined], 2);
    regress(&place, &shard, 0);
    assert_ne!(written(), first);
    // A whole run has an exit code of its own.
    regress(&place, &["run", "--for-merge"], 2);
}

/// Each shard has its cases, and together they are the whole run.
#[test]
fn shards_together_are_the_whole_run() {
    let place = folder("shards");
    prepare(&place, "[[case]]\nscene = \"*.xml\"\n", &["a.xml", "b.xml", "c.xml"]);
    update(&place);
    write(&place, "c.xml", &scene(0.6));
    let seeds = ["--seed-base", "3000"];
    let whole = run(&place, &seeds, 1);
    let [one, two, joined] = ["one", "two", "joined"].map(|name| place.join(name).display().to_string());
    let names = |cases: &[Value]| cases.iter().map(|case| case["name"].clone()).collect::<Vec<_>>();
    let shard = |of: &str, results: &str, code: i32| {
        names(&run(&place, &[&["--shard", of, "--results", results][..], &seeds].concat(), code))
    };
    assert_eq!(shard("1/2", &one, 1), ["a", "c"]);
    // What is missing is not passed over.
    let json = place.join("merged.json").display().to_string();
    regress(&place, &["merge", &one, "--results", &joined, "--json", &json], 2);
    let missing = &cases(Path::new(&json))[1];
    assert!(missing["verdict"] == "broken" && sentence(missing).contains("every shard"), "{missing}");
    assert_eq!(shard("2/2", &two, 0), ["b"]);
    regress(&place, &["merge", &one, &two, "--results", &joined, "--json", &json], 1);
    let merged = cases(Path::new(&json));
    assert_eq!(names(&merged), names(&whole));
    for (a, b) in merged.iter().zip(&whole) {
        for key in ["verdict", "renderings", "tolerance", "device", "method", "spp", "picture", "reference"] {
            assert_eq!(a[key], b[key], "{key} of {a}");
        }
        // Samples are added up in a fixed order, as those of the references.
        let [a, b] = [a, b].map(|case| case["judgement"]["brightness"][1][0].as_f64().unwrap());
        assert!((a - b).abs() < 1e-12 * b, "{a} {b}");
        assert!(Path::new(&joined).join(merged[0]["picture"].as_str().unwrap()).exists());
    }
    // Results of another scene are not taken for those of this one.
    write(&place, "b.xml", &scene(0.7));
    regress(&place, &["merge", &one, &two, "--results", &joined, "--json", &json], 2);
    assert!(sentence(&cases(Path::new(&json))[1]).contains("another manifest, scene or reference"));
}

#[test]
fn references_are_shown_before_they_are_written() {
    let place = folder("update");
    prepare(&place, "[[case]]\nscene = \"a.xml\"\n", &["a.xml"]);
    let output = regress(&place, &["update", "--dry-run"], 0);
    assert!(
        text(&output.stdout).contains("a: would be written: new reference of 16 renderings"),
        "{output:?}"
    );
    assert!(!place.join("references").exists() && !place.join("results").exists());
    update(&place);
    let file = place.join("references/a.exr");
    let bytes = std::fs::read(&file).unwrap();
    let holds = |text: &str| bytes.windows(text.len()).any(|window| window == text.as_bytes());
    for text in ["a test", "sceneHash", "device", "0..16", "--seed 0", env!("CARGO_PKG_VERSION")] {
        assert!(holds(text), "{text}");
    }
    write(&place, "a.xml", &scene(0.6));
    let output = regress(&place, &["update", "--dry-run"], 0);
    assert!(text(&output.stdout).contains("brightness R +"), "{}", text(&output.stdout));
    assert!(std::fs::read(&file).unwrap() == bytes);
    // A scene that cannot be rendered leaves its reference as it is.
    write(&place, "a.xml", "<scene");
    let output = regress(&place, &["update", "--reason", "wrong"], 2);
    assert!(text(&output.stdout).contains("a.xml:1:"), "{}", text(&output.stdout));
    assert!(std::fs::read(&file).unwrap() == bytes);
}

/// The class `strict` compares bits, and where they differ says what the expectations do.
#[test]
fn strict_cases_have_the_same_bits() {
    let place = folder("strict");
    prepare(&place, "tolerance = \"strict\"\n[[case]]\nscene = \"a.xml\"\n", &["a.xml"]);
    update(&place);
    let cases = run(&place, &[], 0);
    assert_eq!(cases[0]["verdict"], "same-bits", "{cases:?}");
    let output = regress(&place, &["update", "--reason", "again"], 0);
    assert!(text(&output.stdout).contains("a: kept: all bits"), "{}", text(&output.stdout));
    // Far below what noise hides.
    write(&place, "a.xml", &scene(0.500_01));
    let cases = run(&place, &[], 1);
    assert_eq!(cases[0]["verdict"], "changed");
    let sentence = sentence(&cases[0]);
    assert!(
        sentence.contains("8 of 8 renderings have other bits") && sentence.contains("noise"),
        "{sentence}"
    );
    // A reference of another class of this program has bits to compare, too.
    prepare(&place, "[[case]]\nscene = \"a.xml\"\n", &[]);
    regress(&place, &["update", "--reason", "of another class"], 0);
    prepare(&place, "tolerance = \"strict\"\n[[case]]\nscene = \"a.xml\"\n", &[]);
    assert_eq!(run(&place, &[], 0)[0]["verdict"], "same-bits");
    // One that another program rendered has them only where the class asks for them.
    let program = env!("CARGO_BIN_EXE_pointillist");
    let other = format!(
        r#"[renderer.other]
command = ["{program}", "render", "{{scene}}", "-o", "{{output}}", "--seed", "{{seed}}", "--spp", "2", "--device", "cpu", "--quiet"]
[[case]]
scene = "a.xml"
renderer = "other"
"#
    );
    prepare(&place, &other, &[]);
    regress(&place, &["update", "--reason", "in any order"], 0);
    prepare(&place, &format!("tolerance = \"strict\"\n{other}"), &[]);
    let cases = run(&place, &[], 2);
    assert!(cases[0]["sentence"].as_str().unwrap().contains("regress update"), "{cases:?}");
}

/// Another program, here this one by a script, is rendered in the same run; its pictures are kept beside.
#[test]
fn another_program_is_rendered_in_the_same_run() {
    let place = folder("peer");
    let program = env!("CARGO_BIN_EXE_pointillist");
    let manifest = format!(
        r#"[renderer.peer]
command = ["{program}", "render", "{{scene}}", "-o", "{{output}}", "--seed", "{{seed}}", "--spp", "{{spp}}", "--device", "cpu", "--quiet"]
spp = 4
[[case]]
scene = "a.xml"
against = "peer"
"#
    );
    prepare(&place, &manifest, &["a.xml"]);
    let cases = run(&place, &[], 0);
    assert_eq!(cases[0]["verdict"], "equal-within-noise", "{cases:?}");
    let reference = Path::new(cases[0]["reference"].as_str().unwrap());
    assert!(reference.ends_with("a.against.exr") && reference.exists());
    let output = regress(&place, &["update", "--dry-run"], 0);
    assert!(text(&output.stdout).contains("a: kept: is compared with another program"));
}
