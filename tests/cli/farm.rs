//! Renders in parts through the engines of `tools/farm`, with a worker killed in the middle: the picture is that of one render, and the
//! verdicts are those of one regression run.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use super::regress::{prepare, scene, update, write};
use super::state::{runs, same};

/// A folder for one test, empty; its name has a blank.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("farm").join(format!("{name} parts"));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// A script of `tools/farm` that runs this program, with its temporary files in `place`.
fn script(name: &str, place: &Path) -> Command {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut command = Command::new(root.join("tools/farm").join(name));
    command.current_dir(root).env("POINTILLIST", env!("CARGO_BIN_EXE_pointillist")).env("TMPDIR", place);
    command
}

/// The output of a script that succeeds.
#[track_caller]
fn succeeds(command: &mut Command) -> Output {
    let output = command.output().unwrap();
    assert!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

/// Installs Dask where that has not been done, which is no part of what is tested.
fn install_dask(place: &Path) {
    succeeds(script("python", place).args(["-c", "import distributed, kubernetes_validate"]));
}

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell.xml");
const SETTINGS: [&str; 6] = ["--size", "64x64", "--spp", "120", "--seed", "5"];

/// The picture of one render.
fn whole(place: &Path) -> PathBuf {
    let picture = place.join("whole.exr");
    let output = ["-o", picture.to_str().unwrap(), "--device", "cpu", "--deterministic", "--quiet"];
    runs(&[&["render", SCENE], &SETTINGS[..], &output].concat());
    picture
}

/// A running program.
struct Process {
    id: String,
    parent: String,
}

impl Process {
    /// The program that renders a part to a file in `place`, if one does.
    fn of_part(place: &Path) -> Option<Self> {
        let program = format!("{}\0shard\0", env!("CARGO_BIN_EXE_pointillist"));
        let place = format!("\0{}/", place.display());
        std::fs::read_dir("/proc").unwrap().flatten().find_map(|entry| {
            let words = String::from_utf8(std::fs::read(entry.path().join("cmdline")).ok()?).ok()?;
            if !words.starts_with(&program) || !words.contains(&place) {
                return None;
            }
            Some(Self { id: entry.file_name().into_string().ok()?, parent: status(&entry.path(), "PPid:")? })
        })
    }

    /// True while it runs: a dead one may wait to be collected.
    fn runs(&self) -> bool {
        status(&Path::new("/proc").join(&self.id), "State:").is_some_and(|state| !state.starts_with('Z'))
    }
}

/// A line of the status of a process.
fn status(process: &Path, key: &str) -> Option<String> {
    let status = std::fs::read_to_string(process.join("status")).ok()?;
    status.lines().find_map(|line| Some(line.strip_prefix(key)?.trim().to_string()))
}

/// What `find` finds before the engine ends.
#[track_caller]
fn wait_for<T>(engine: &mut Child, what: &str, mut find: impl FnMut() -> Option<T>) -> T {
    let deadline = Instant::now() + Duration::from_secs(60);
    while Instant::now() < deadline && engine.try_wait().unwrap().is_none() {
        if let Some(found) = find() {
            return found;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    let _ = engine.kill();
    panic!("{what} was not seen");
}

#[track_caller]
fn send(signal: &str, id: &str) {
    assert!(Command::new("kill").args(["-s", signal, id]).status().unwrap().success());
}

/// The engine has come to its end, and the picture is complete and that of one render.
#[track_caller]
fn ends_well(engine: Child, place: &Path) {
    let output = engine.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    same(&whole(place), &place.join("picture.exr"));
}

/// A part whose program is killed is tried again by GNU parallel, and goes on where its state ends.
#[test]
fn parallel_renders_a_part_again_whose_program_was_killed() {
    let place = folder("parallel");
    let mut command = script("parallel", &place);
    command.arg("-d").arg(&place).args(["--of", "3", "--jobs", "2", SCENE]).args(SETTINGS);
    command.args(["--state-every", "0.05"]);
    let mut engine = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let state = place.join("1.state");
    wait_for(&mut engine, "a state", || state.exists().then_some(()));
    let part = wait_for(&mut engine, "the first part", || Process::of_part(&place));
    send("KILL", &part.id);
    ends_well(engine, &place);
    // Called again, it leaves complete parts alone.
    let written = || std::fs::metadata(&state).unwrap().modified().unwrap();
    let before = written();
    let mut command = script("parallel", &place);
    succeeds(command.arg("-d").arg(&place).args(["--of", "3", SCENE]).args(SETTINGS));
    assert_eq!(written(), before);
}

/// A part whose worker is killed is given to another worker by Dask. The program of the dead worker ends, too.
#[test]
fn dask_renders_a_part_again_whose_worker_was_killed() {
    let place = folder("dask");
    install_dask(&place);
    let mut command = script("dask", &place);
    command.arg("-d").arg(&place).args(["--of", "4", "--workers", "2", SCENE]).args(SETTINGS);
    let mut engine = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let part = wait_for(&mut engine, "a part", || Process::of_part(&place));
    // Stopped, it cannot come to its end by itself.
    send("STOP", &part.id);
    send("KILL", &part.parent);
    wait_for(&mut engine, "the end of a part without a worker", || (!part.runs()).then_some(()));
    ends_well(engine, &place);
    // Called again, it renders what is missing.
    std::fs::remove_file(place.join("3.state")).unwrap();
    std::fs::remove_file(place.join("picture.exr")).unwrap();
    let mut command = script("dask", &place);
    let output = succeeds(command.arg("-d").arg(&place).args(["--of", "4", SCENE]).args(SETTINGS));
    assert!(String::from_utf8_lossy(&output.stdout).contains("1 parts"), "{output:?}");
    same(&place.join("whole.exr"), &place.join("picture.exr"));
}

/// What cannot be rendered is named, and the script fails.
#[test]
fn parts_that_fail_are_told() {
    let place = folder("failing");
    let broken = place.join("broken.xml");
    std::fs::write(&broken, "<scene").unwrap();
    let none = place.join("none.xml");
    for (scene, wanted) in [(&broken, "jobs.log"), (&none, "cannot read the scene")] {
        let mut command = script("parallel", &place);
        let output = command.arg("-d").arg(&place).args(["--of", "2"]).arg(scene).output().unwrap();
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && error.contains(wanted), "{error}");
    }
    assert!(!place.join("picture.exr").exists());
}

/// How the programs of [`SCENES`] render, after a line of their own.
const RENDER: &str =
    r#"exec "$PROGRAM" render "$1" -o "$2" --seed "$3" --spp 2 --replicates 1 --device cpu --quiet"#;

/// Four cases, of which two shards have the odd and the even ones.
const SCENES: &str = r#"[renderer.counted]
command = ["/bin/sh", "counted", "{scene}", "{output}", "{seed}"]
[renderer.killer]
command = ["/bin/sh", "killer", "{scene}", "{output}", "{seed}"]
[[case]]
scene = "a.xml"
[[case]]
name = "b"
scene = "a.xml"
renderer = "counted"
against = "a"
[[case]]
scene = "c.xml"
[[case]]
name = "d"
scene = "a.xml"
renderer = "killer"
against = "a"
"#;

/// A folder with [`SCENES`] and their references. Case `b` writes down which seeds it renders, case `d` kills the program that runs it, once.
fn scenes(place: &Path) -> PathBuf {
    let scenes = place.join("scenes");
    std::fs::create_dir(&scenes).unwrap();
    prepare(&scenes, SCENES, &["a.xml", "c.xml"]);
    write(&scenes, "counted", &format!("echo \"$3\" >> seeds\n{RENDER}\n"));
    let kill = "if mkdir killed 2> /dev/null; then kill -KILL $PPID; exit 1; fi";
    write(&scenes, "killer", &format!("{kill}\n{RENDER}\n"));
    update(&scenes);
    scenes
}

/// Runs regression renders in two parts, checks the exit code of the script, and returns the names of those of the four cases that have changed.
#[track_caller]
fn changed(engine: &str, options: &[&str], place: &Path, code: i32) -> Vec<String> {
    let report = place.join("report.json");
    let mut command = script(engine, place);
    command
        .args(["--regress", "--of", "2"])
        .args(options)
        .arg("-d")
        .arg(place.join("out"))
        .arg(place.join("scenes"));
    command
        .args(["--device", "cpu", "--json"])
        .arg(&report)
        .env("PROGRAM", env!("CARGO_BIN_EXE_pointillist"));
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(code), "{}", String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_str(&std::fs::read_to_string(report).unwrap()).unwrap();
    let cases = report["cases"].as_array().unwrap();
    let names: Vec<&str> = cases.iter().map(|case| case["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["a", "b", "c", "d"]);
    let of_verdict = cases.iter().zip(names).filter(|(case, _)| case["verdict"] == "changed");
    of_verdict.map(|(_, name)| name.to_owned()).collect()
}

/// A shard that is killed goes on where it was; one with a red case is no failure, and the exit code is that of the merge.
#[test]
fn parallel_runs_regression_renders_in_shards() {
    let place = folder("regress");
    let scenes = scenes(&place);
    let options = ["--jobs", "2"];
    assert!(changed("parallel", &options, &place, 0).is_empty());
    assert!(scenes.join("killed").exists() && place.join("out/results/index.html").exists());
    let seeds = std::fs::read_to_string(scenes.join("seeds")).unwrap();
    let mut different: Vec<&str> = seeds.lines().collect();
    different.sort_unstable();
    different.dedup();
    assert!(different.len() >= 8 && different.len() == seeds.lines().count(), "rendered again: {seeds}");
    // What was merged is rendered anew by the next call.
    write(&scenes, "c.xml", &scene(0.9));
    assert_eq!(changed("parallel", &options, &place, 1), ["c"]);
    assert!(std::fs::read_to_string(scenes.join("seeds")).unwrap().len() > seeds.len());
    let jobs = std::fs::read_to_string(place.join("out/jobs.log")).unwrap();
    let codes: Vec<&str> = jobs.lines().skip(1).filter_map(|job| job.split('\t').nth(6)).collect();
    assert_eq!(codes, ["0", "0"], "a red case was tried again: {jobs}");
}

/// Results of shards travel through Dask, and a shard whose program is killed is begun anew.
#[test]
fn dask_runs_regression_renders_in_shards() {
    let place = folder("regress dask");
    install_dask(&place);
    let scenes = scenes(&place);
    write(&scenes, "c.xml", &scene(0.9));
    assert_eq!(changed("dask", &["--workers", "2"], &place, 1), ["c"]);
    assert!(scenes.join("killed").exists() && place.join("out/results/c.exr").exists());
}

/// The Kubernetes manifest is one by the schema, in which a misspelt key is not.
#[test]
fn the_kubernetes_manifest_is_valid() {
    let place = folder("kubernetes");
    install_dask(&place);
    let validate = |manifest: &Path| {
        let mut command = script("python", &place);
        command.args(["-m", "kubernetes_validate", "--strict"]).arg(manifest).output().unwrap()
    };
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/farm/kubernetes.yaml");
    let output = validate(&manifest);
    assert!(output.status.success(), "{output:?}");
    let text = std::fs::read_to_string(&manifest).unwrap();
    let misspelt = place.join("misspelt.yaml");
    std::fs::write(&misspelt, text.replace("completionMode", "completionsMode")).unwrap();
    assert!(!validate(&misspelt).status.success());
}
