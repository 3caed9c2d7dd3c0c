//! The layout of the sources: which module may import which, where window and Vulkan crates and `unsafe` may stand, how long a file
//! may be, and that a type name stands once.
//!
//! One crate has no crate boundaries inside that would enforce this, so these tests read the sources. They report every breach with
//! file and line.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Every module and the modules of ours it may name in a `crate::` path.
const MAY_IMPORT: &[(&str, &[&str])] = &[
    ("math", &[]),
    ("memory", &[]),
    ("job", &[]),
    ("color", &["math"]),
    ("spectrum", &["math", "color"]),
    ("image", &["math", "color", "memory"]),
    ("stream", &["math", "color"]),
    ("remote", &["math", "color", "stream"]),
    ("scene", &["math", "color", "spectrum", "image"]),
    ("tracer", &["math", "memory", "color", "spectrum", "scene", "stream"]),
    ("server", &["math", "job", "tracer", "scene", "stream"]),
    ("gpu", &[]),
    ("client", &["job", "gpu", "stream", "color", "image", "math"]),
    ("study", &["image", "color", "math", "stream"]),
    (
        "denoise",
        &["math", "color", "spectrum", "image", "scene", "stream", "study", "gpu", "client", "tracer"],
    ),
    (
        "render",
        &[
            "math", "job", "color", "spectrum", "image", "stream", "study", "gpu", "client", "scene",
            "tracer", "server", "remote", "denoise",
        ],
    ),
    (
        "viewer",
        &[
            "math", "job", "color", "spectrum", "image", "stream", "study", "gpu", "client", "scene",
            "tracer", "server", "remote", "denoise", "render",
        ],
    ),
    (
        "cmd",
        &[
            "math", "job", "color", "spectrum", "image", "stream", "study", "gpu", "client", "scene",
            "tracer", "server", "remote", "denoise", "render", "viewer",
        ],
    ),
];

/// External crates that a module must not touch.
const FORBIDDEN: &[(&str, &[&str])] = &[
    ("math", &["ash::", "rayon::", "std::thread", "std::fs"]),
    ("color", &["ash::", "rayon::", "std::thread", "std::fs"]),
    ("spectrum", &["ash::", "rayon::", "std::thread", "std::fs"]),
    ("stream", &["ash::", "rayon::"]),
    ("scene", &["ash::", "obvhs::"]),
    ("tracer", &["ash::", "std::thread", "std::time", "std::fs"]),
    ("server", &["ash::", "winit::"]),
    ("remote", &["ash::", "winit::", "rayon::"]),
    ("study", &["ash::", "winit::", "rayon::", "std::thread", "std::time"]),
    ("denoise", &["winit::", "egui::"]),
    ("render", &["clap::", "winit::", "egui::"]),
    // Its values of options name themselves (`ValueEnum`); the options are the command line's.
    ("viewer", &["clap::Args", "clap::Parser", "clap::Subcommand"]),
];

/// Longest file, in lines. A cap against monsters and no aim: judgement comes first, and what belongs together stays together.
const LONGEST: usize = 600;

/// External crates and the only places that may name them.
const PLACES: &[(&[&str], &[&str])] = &[
    (&["ash", "vk", "ash_window", "gpu_allocator"], &["src/gpu/"]),
    (&["egui", "egui_plot", "egui_winit", "egui_ash_renderer"], &["src/client/window/"]),
    // The event loop needs the window itself.
    (&["winit"], &["src/client/window/", "src/viewer/"]),
];

/// Where `unsafe` may stand.
const UNSAFE: &[&str] = &[
    "src/memory.rs",
    "src/stream/ring.rs",
    "src/gpu/",
    "src/tracer/accel/",
    "src/tracer/integrator/bidirectional/importance.rs",
    "src/client/wavelet/bands.rs",
    "src/client/oidn/library.rs",
];

/// The sources of a module: its file, or all in its folder.
fn sources(module: &str) -> Vec<PathBuf> {
    let folder = root().join("src").join(module);
    if folder.is_dir() { rust_files(&folder) } else { vec![folder.with_extension("rs")] }
}

fn rust_files(dir: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![dir.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())) {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn relative(path: &Path) -> String {
    path.strip_prefix(root()).unwrap().display().to_string()
}

/// The code of a line: what stands before a `//` comment.
fn code(line: &str) -> &str {
    line.split("//").next().unwrap_or("")
}

/// Calls `visit` for every line of code of a file, with its number, and fails with what it returned.
fn check(files: &[PathBuf], visit: impl Fn(&str, &str) -> Option<String>) {
    assert!(!files.is_empty(), "no source files were found");
    let mut breaches = Vec::new();
    for file in files {
        let name = relative(file);
        for (number, line) in fs::read_to_string(file).unwrap().lines().enumerate() {
            if let Some(what) = visit(&name, code(line)) {
                breaches.push(format!("{name}:{}: {what}", number + 1));
            }
        }
    }
    assert!(breaches.is_empty(), "{}", breaches.join("\n"));
}

#[test]
fn modules_import_only_downwards() {
    for (module, allowed) in MAY_IMPORT {
        check(&sources(module), |_, line| {
            line.split("crate::").skip(1).find_map(|path| {
                let end = path.find(|c: char| !c.is_alphanumeric() && c != '_');
                let named = &path[..end.unwrap_or(path.len())];
                let fine = named == *module || allowed.contains(&named);
                (!fine).then(|| format!("{module} must not import {named:?}"))
            })
        });
    }
}

#[test]
fn every_module_is_in_the_table() {
    let text = fs::read_to_string(root().join("src/lib.rs")).unwrap();
    for line in text.lines() {
        let module = line.strip_prefix("pub mod ").or(line.strip_prefix("mod "));
        if let Some(name) = module.and_then(|l| l.strip_suffix(';')) {
            assert!(
                MAY_IMPORT.iter().any(|(m, _)| *m == name),
                "src/lib.rs: module {name} is not in the table"
            );
        }
    }
}

#[test]
fn paths_cannot_dodge_the_table() {
    check(&rust_files(&root().join("src")), |name, line| {
        let dodge =
            line.contains("super::super") || line.contains("use crate::{") || line.contains("pointillist::");
        (dodge && name != "src/main.rs").then(|| "write the path as crate::module::…".to_string())
    });
}

#[test]
fn modules_leave_foreign_ground_alone() {
    for (module, forbidden) in FORBIDDEN {
        check(&sources(module), |_, line| {
            let named = forbidden.iter().find(|f| line.contains(**f))?;
            // Files are the scene reader's business only in its loaders; tests may do what they like.
            Some(format!("{module} must not use {named}"))
        });
    }
}

#[test]
fn window_and_vulkan_crates_stay_in_their_places() {
    check(&rust_files(&root().join("src")), |name, line| {
        let named = |krate: &str| {
            line.match_indices(&format!("{krate}::")).any(|(at, _)| {
                !line[..at].ends_with(|before: char| before.is_alphanumeric() || before == '_')
            })
        };
        PLACES.iter().find_map(|(crates, places)| {
            let krate = crates.iter().find(|krate| named(krate))?;
            let allowed = places.iter().any(|place| name.starts_with(place));
            (!allowed).then(|| format!("{krate} may be named only in {}", places.join(", ")))
        })
    });
}

#[test]
fn files_stay_small() {
    let mut files = rust_files(&root().join("src"));
    files.extend(rust_files(&root().join("tests")));
    files.extend(rust_files(&root().join("tools")));
    for file in files {
        let name = relative(&file);
        let text = fs::read_to_string(&file).unwrap();
        let lines = text.lines().count();
        assert!(lines <= LONGEST, "{name}: {lines} lines, the cap is {LONGEST}");
        // A mod.rs says what is where: documentation does not count.
        let of_code = text.lines().filter(|line| !code(line).trim().is_empty()).count();
        assert!(
            !file.ends_with("mod.rs") || of_code <= 200,
            "{name}: {of_code} lines of code, a mod.rs has at most 200"
        );
    }
}

/// A reader who meets a name knows which type it is. Test modules may name what they like.
/// Associated types do not count.
#[test]
fn a_type_name_stands_once() {
    let mut places: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for file in rust_files(&root().join("src")) {
        let text = fs::read_to_string(&file).unwrap();
        let product = text.split("#[cfg(test)]\nmod ").next().unwrap_or("");
        for (number, line) in product.lines().enumerate() {
            let mut words =
                code(line).split(|c: char| !c.is_alphanumeric() && c != '_').filter(|w| !w.is_empty());
            let kind = words.find(|word| !["pub", "crate", "super", "in", "unsafe"].contains(word));
            if let (Some("struct" | "enum" | "trait" | "union"), Some(name)) = (kind, words.next()) {
                places.entry(name.into()).or_default().push(format!("{}:{}", relative(&file), number + 1));
            }
        }
    }
    let twice = places.iter().filter(|(_, at)| at.len() > 1);
    let twice: Vec<_> = twice.map(|(name, at)| format!("{name}: {}", at.join(", "))).collect();
    assert!(twice.is_empty(), "type names that stand twice:\n{}", twice.join("\n"));
}

#[test]
fn unsafe_stays_in_its_place() {
    check(&rust_files(&root().join("src")), |name, line| {
        let word = line.split(|c: char| !c.is_alphanumeric() && c != '_').any(|w| w == "unsafe");
        let allowed = UNSAFE.iter().any(|place| name.starts_with(place));
        (word && !allowed).then(|| format!("unsafe stands only in {}", UNSAFE.join(", ")))
    });
}

#[test]
fn the_top_level_is_what_the_readme_says() {
    let known =
        ["Cargo.toml", "Cargo.lock", "src", "glsl", "scenes", "tests", "tools", "README.md", "target"];
    for entry in fs::read_dir(root()).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let fine = known.contains(&name.as_str()) || name.starts_with('.') || name.starts_with("LICENSE");
        assert!(fine, "{name} does not belong at the top level");
    }
}
