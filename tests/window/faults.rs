//! Calls of the window system that fail, devices that are lost: the window stays open, and the picture keeps its samples.

use std::time::{Duration, Instant};

use crate::endings::{ENDED, PATHS, paths_in, view};
use crate::support::desktop::Desktop;
use crate::viewer::{Listened, PATIENCE, end, end_when, figures, folder, png, words};

/// What the viewer says when a call has failed, and when it works again.
const FAILED: &str = "which is tried again";
const AGAIN: &str = "the window is drawn again";

/// The results of each call in one run, one after the other: those that the window's images follow by themselves, and errors.
const CASES: [(&str, &[&str], &[&str]); 4] = [
    (
        "surface",
        &[],
        &["ERROR_OUT_OF_HOST_MEMORY", "ERROR_OUT_OF_DEVICE_MEMORY", "ERROR_INITIALIZATION_FAILED"],
    ),
    (
        "swapchain",
        &["ERROR_SURFACE_LOST_KHR"],
        &[
            "ERROR_OUT_OF_HOST_MEMORY",
            "ERROR_OUT_OF_DEVICE_MEMORY",
            "ERROR_INITIALIZATION_FAILED",
            "ERROR_NATIVE_WINDOW_IN_USE_KHR",
        ],
    ),
    ("acquire", FOLLOWED, UNKNOWN),
    ("present", FOLLOWED, UNKNOWN),
];
const FOLLOWED: &[&str] = &[
    "ERROR_OUT_OF_DATE_KHR",
    "ERROR_SURFACE_LOST_KHR",
    "ERROR_FULL_SCREEN_EXCLUSIVE_MODE_LOST_EXT",
    "SUBOPTIMAL_KHR",
];
const UNKNOWN: &[&str] = &["ERROR_OUT_OF_HOST_MEMORY", "ERROR_OUT_OF_DEVICE_MEMORY", "ERROR_UNKNOWN"];

/// Faults of a call, four calls apart. What is made only when something is lost is lost before.
fn faults(call: &str, results: &[&str]) -> Vec<String> {
    let mut faults = Vec::new();
    for (i, result) in results.iter().enumerate() {
        let at = 4 * (i + 1);
        match call {
            "surface" | "swapchain" => {
                let cause =
                    if call == "surface" { "ERROR_SURFACE_LOST_KHR" } else { "ERROR_OUT_OF_DATE_KHR" };
                faults.push(format!("acquire,{at},1,{cause}"));
                // The first is made at the start; each fault takes two, and one works.
                faults.push(format!("{call},{},2,{result}", 1 + 3 * i));
            }
            _ => faults.push(format!("{call},{at},2,{result}")),
        }
    }
    faults.into_iter().flat_map(|fault| ["--fail-call".to_owned(), fault]).collect()
}

/// Whatever call fails, how often: the picture at the end is that of a window without faults, byte by byte.
#[test]
fn failing_calls_cost_neither_window_nor_samples() {
    let desktop = Desktop::start(300, 300);
    let picture = |name: &str| {
        let folder = folder(name);
        let bytes = std::fs::read(folder.join("last.png")).unwrap();
        std::fs::remove_dir_all(folder).unwrap();
        bytes
    };
    let output = end_when(view(&desktop, &folder("faultless"), &["--deterministic"]), &[ENDED]);
    assert!(output.status.success(), "{}", words(&output));
    let wanted = picture("faultless");
    for (call, followed, errors) in CASES {
        let folder = folder(call);
        let planned = faults(call, &[followed, errors].concat());
        let options: Vec<&str> =
            ["--deterministic"].into_iter().chain(planned.iter().map(String::as_str)).collect();
        let mut viewer = Listened::new(view(&desktop, &folder, &options));
        viewer.wait_for(ENDED);
        viewer.wait_for_times(AGAIN, errors.len());
        let output = viewer.terminate();
        let said = words(&output);
        assert!(output.status.success(), "{call}: {said}");
        assert_eq!(said.matches(AGAIN).count(), errors.len(), "{call}: {said}");
        assert!(said.matches(FAILED).count() == errors.len() && !said.contains("panicked"), "{call}: {said}");
        let seen = figures(&folder);
        assert_eq!((&seen["device_losses"], &seen["validation_messages"]), (&0.into(), &0.into()), "{said}");
        assert_eq!(paths_in(&folder), PATHS);
        assert!(picture(call) == wanted, "{call}: another picture");
    }
}

/// Number of calls of a run, more than an undisturbed one has; how many lie between two that fail; what is said of each, and how many must
/// fail at least.
const CALLS: [(&str, usize, usize, &str, usize); 3] = [
    ("allocation", 40, 20, "no GPU memory for", 20),
    ("mapping", 20, 10, "could not be mapped", 7),
    ("pipeline", 30, 15, "vkCreate", 11),
];

/// Windows that are open at the same time.
const AT_ONCE: usize = 4;

/// Whatever allocation, mapping or pipeline of film and repaint fails, each of them in one of many windows: the window stays open, says so,
/// and the picture is that of a window without faults, byte by byte. Those of the panel are egui's own.
#[test]
fn failing_resources_cost_neither_window_nor_samples() {
    let desktop = Desktop::start(300, 300);
    let options = ["--deterministic", "--glare", "photopic", "--vm", "0.5"];
    let run = |name: &str, faults: &[String]| {
        let folder = folder(name);
        let options: Vec<&str> = options.into_iter().chain(faults.iter().map(String::as_str)).collect();
        let mut viewer = Listened::new(view(&desktop, &folder, &options));
        viewer.wait_for(ENDED);
        // Glare is computed beside the picture, and is in it later.
        std::thread::sleep(Duration::from_millis(500));
        let output = viewer.terminate();
        let said = words(&output);
        assert!(output.status.success() && !said.contains("panicked"), "{name}: {said}");
        let seen = figures(&folder);
        assert_eq!((&seen["device_losses"], &seen["validation_messages"]), (&0.into(), &0.into()), "{said}");
        assert_eq!(paths_in(&folder), PATHS, "{said}");
        let (_, _, pixels) = png(&folder.join("last.png"));
        std::fs::remove_dir_all(folder).unwrap();
        (pixels, said)
    };
    let (wanted, _) = run("resources", &[]);
    for (call, calls, between, words, least) in CALLS {
        let check = |first: usize| {
            let at = (first..calls).step_by(between);
            let faults: Vec<String> = at
                .flat_map(|at| ["--fail-call".into(), format!("{call},{at},1,ERROR_OUT_OF_DEVICE_MEMORY")])
                .collect();
            let (picture, said) = run(&format!("{call}-{first}"), &faults);
            // Where the last reading of the picture fails, the processor computes it, which rounds in another way.
            let most = u8::from(said.contains("the picture is made without the device"));
            let is_equal = picture.iter().zip(&wanted).all(|(a, b)| a.abs_diff(*b) <= most);
            assert!(is_equal && picture.len() == wanted.len(), "{call} {first}: another picture: {said}");
            said.matches(words).count()
        };
        // A window mostly waits: several are open at once.
        let told: usize = std::thread::scope(|scope| {
            let check = &check;
            let lanes = (0..AT_ONCE)
                .map(|lane| scope.spawn(move || (lane..between).step_by(AT_ONCE).map(check).sum::<usize>()));
            lanes.collect::<Vec<_>>().into_iter().map(|lane| lane.join().unwrap()).sum()
        });
        println!("{told} failures of {call}");
        assert!(told >= least, "{call}: only {told} failures");
    }
}

/// A device, a surface or images that cannot be made at first are tried again.
#[test]
fn a_window_opens_in_the_end() {
    let desktop = Desktop::start(300, 300);
    for fault in ["surface,0,3,ERROR_INITIALIZATION_FAILED", "swapchain,0,3,ERROR_OUT_OF_DEVICE_MEMORY"] {
        let folder = folder("opens");
        let output = end_when(view(&desktop, &folder, &["--fail-call", fault]), &[ENDED, FAILED]);
        let said = words(&output);
        assert!(output.status.success() && said.contains("no device can be opened"), "{said}");
        assert_eq!(paths_in(&folder), PATHS);
        std::fs::remove_dir_all(folder).unwrap();
    }
    // For ever is one error.
    let folder = folder("never");
    let output = end(view(&desktop, &folder, &["--fail-call", "surface,0,9999,ERROR_UNKNOWN"]));
    let said = words(&output);
    assert!(output.status.code() == Some(1) && said.contains("vkCreateSurfaceKHR failed"), "{said}");
    std::fs::remove_dir_all(&folder).unwrap();
    std::fs::create_dir(&folder).unwrap();
    let large = ["--size", "2000x2000", "--device-memory", "48", "-o", "last.png"];
    let output = end(crate::viewer::view(&desktop, &folder, &large));
    let said = words(&output);
    assert!(output.status.code() == Some(1) && said.contains("no GPU memory for"), "{said}");
    // What was traced meanwhile is in the picture.
    assert!(!said.contains("panicked") && folder.join("last.png").exists(), "{said}");
    std::fs::remove_dir_all(folder).unwrap();
}

/// A device that was lost, and cannot be opened again at once, is waited for. One that is lost after it has worked for a while is replaced,
/// however many were before.
#[test]
fn devices_may_be_lost_more_than_once() {
    let desktop = Desktop::start(300, 300);
    let folder = folder("losses");
    let options = ["--size", "96x96", "--no-panel", "-o", "last.exr", "--json", "figures.json"];
    let losses = ["--lose-device-after", "20", "--lose-device-after", "500"];
    let fault = ["--fail-call", "surface,1,4,ERROR_INITIALIZATION_FAILED"];
    let viewer = crate::viewer::view(&desktop, &folder, &[&options[..], &losses, &fault].concat());
    let mut viewer = Listened::new(viewer);
    viewer.wait_for("is open again");
    // Every move is a frame.
    let start = Instant::now();
    desktop.pointer(48, 48);
    desktop.button(1, true);
    for i in 0.. {
        if viewer.times("is open again") == 2 || start.elapsed() > PATIENCE {
            break;
        }
        desktop.pointer(40 + i % 16, 48);
        std::thread::sleep(Duration::from_millis(5));
    }
    desktop.button(1, false);
    std::thread::sleep(Duration::from_secs(1));
    let output = viewer.terminate();
    let (said, seen) = (words(&output), figures(&folder));
    assert!(output.status.success() && said.contains("no device can be opened"), "{said}");
    assert_eq!((&seen["device_losses"], &seen["validation_messages"]), (&2.into(), &0.into()), "{said}");
    assert!(paths_in(&folder) > 1000, "{} paths", paths_in(&folder));
    std::fs::remove_dir_all(folder).unwrap();
}
