//! The file of compiled pipelines: written once, loaded by the next run, and never a reason to fail.

use std::path::{Path, PathBuf};
use std::process::Command;

/// A folder of this test's own, empty.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("pipelines").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// Renders on the first Vulkan device with this state folder; returns what the program says.
#[track_caller]
fn render(state: &Path, picture: &Path) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pointillist"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).env("POINTILLIST_STATE", state);
    command.env("POINTILLIST_LOG", "info");
    command.args(["render", "scenes/cornell.xml", "--size", "32x32", "--samples", "4k", "--device", "0"]);
    let output = command.args(["--quiet", "-o"]).arg(picture).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    said
}

fn only_file(folder: &Path) -> PathBuf {
    let files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert_eq!(files.len(), 1, "{files:?}");
    files[0].clone()
}

#[test]
fn pipelines_are_kept_from_run_to_run() {
    let place = folder("kept");
    let (state, picture) = (place.join("state"), place.join("a.png"));
    let said = render(&state, &picture);
    assert!(!said.contains("pipelines"), "{said}");
    let file = only_file(&state.join("pipelines"));
    let (bytes, written) =
        (std::fs::read(&file).unwrap(), std::fs::metadata(&file).unwrap().modified().unwrap());
    let wanted = std::fs::read(&picture).unwrap();

    // The next run loads them, has nothing to add, and shows the same picture.
    let said = render(&state, &picture);
    assert!(!said.contains("pipelines"), "{said}");
    assert_eq!(std::fs::metadata(&file).unwrap().modified().unwrap(), written);
    assert!(std::fs::read(&picture).unwrap() == wanted);

    // A file that is damaged, cut off, empty or something else is told of in one line, and replaced.
    let damaged = {
        let mut bytes = bytes.clone();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        bytes
    };
    for bad in [damaged, bytes[..bytes.len() - 3].to_vec(), Vec::new(), b"hello\n".repeat(1000)] {
        std::fs::write(&file, &bad).unwrap();
        let said = render(&state, &picture);
        let lines = said.lines().filter(|line| line.contains("pipelines are compiled anew")).count();
        assert_eq!(lines, 1, "{said}");
        assert!(std::fs::read(&picture).unwrap() == wanted);
        assert_eq!(only_file(&state.join("pipelines")), file);
        assert!(std::fs::read(&file).unwrap() == bytes, "it is not replaced");
    }
}

/// A folder that cannot be made, and a file that cannot be read, cost one line of the log each and nothing else.
#[test]
fn what_cannot_be_written_is_only_told() {
    let place = folder("refused");
    let (state, picture) = (place.join("state"), place.join("a.png"));
    std::fs::create_dir_all(&state).unwrap();
    std::fs::write(state.join("pipelines"), "a file where a folder should be").unwrap();
    let said = render(&state, &picture);
    let about: Vec<_> = said.lines().filter(|line| line.contains("pipelines")).collect();
    assert!(about.len() <= 2 && about.iter().any(|line| line.contains("are not kept")), "{said}");
}
