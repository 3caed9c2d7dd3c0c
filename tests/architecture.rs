//! The layout of the sources: which module may import which, where window and Vulkan crates and `unsafe` may stand, how long a file
//! may be, and that a type name stands once.
//!
//! One crate has no crate boundaries inside that would enforce this, so these tests read the sources. They report every breach with
//! file and line.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Every module and the modules of ours it may name in a `crate::` path. Who may name `render` may name what `render` may.
const MAY_IMPORT: &[(&str, &str)] = &[
    ("math", ""),
    ("memory", ""),
    ("job", ""),
    ("color", "math"),
    ("spectrum", "math color"),
    ("image", "math color memory"),
    ("stream", "math color"),
    ("remote", "math color stream"),
    ("scene", "math color spectrum image"),
    ("tracer", "math memory color spectrum scene stream"),
    ("server", "math job tracer scene stream"),
    ("gpu", "memory"),
    ("client", "job gpu stream color image math"),
    ("study", "image color math stream"),
    ("accounting", "job color stream study"),
    ("denoise", "math color spectrum image scene stream study gpu client tracer accounting"),
    (
        "render",
        "math job accounting color spectrum image stream study gpu client scene tracer server remote denoise",
    ),
    ("regress", "render"),
    ("viewer", "memory render"),
    ("cmd", "memory render viewer regress"),
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
    // Values of options may derive `ValueEnum`, and post-processes of the client declare their own options; all others stand in `cmd`.
    ("viewer", &["clap::Args", "clap::Parser", "clap::Subcommand"]),
];

/// Longest file, in lines: a limit and not a goal.
const LONGEST: usize = 600;

/// External crates and the only places that may name them.
const PLACES: &[(&[&str], &[&str])] = &[
    (&["ash", "vk", "ash_window", "gpu_allocator"], &["src/gpu/"]),
    (&["egui_winit", "egui_ash_renderer"], &["src/client/window/"]),
    // A tool draws its own part of the panel.
    (&["egui", "egui_plot"], &["src/client/window/", "src/viewer/tools/"]),
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
    let table: BTreeMap<&str, Vec<&str>> =
        MAY_IMPORT.iter().map(|(module, names)| (*module, names.split_whitespace().collect())).collect();
    for (module, names) in &table {
        let mut allowed = names.clone();
        if names.contains(&"render") {
            allowed.extend(&table["render"]);
        }
        for name in &allowed {
            assert!(table.contains_key(name), "the row of {module} names {name}, which is no module");
        }
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
fn modules_do_not_name_forbidden_crates() {
    for (module, forbidden) in FORBIDDEN {
        check(&sources(module), |_, line| {
            let named = forbidden.iter().find(|f| line.contains(**f))?;
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
fn the_top_level_has_no_other_files() {
    let known =
        ["Cargo.toml", "Cargo.lock", "src", "glsl", "scenes", "tests", "tools", "README.md", "target"];
    for entry in fs::read_dir(root()).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let fine = known.contains(&name.as_str()) || name.starts_with('.') || name.starts_with("LICENSE");
        assert!(fine, "{name} does not belong at the top level");
    }
}

/// What the folders of `scene` may import of `scene`: descriptions know of no file format, and a format knows of no editor.
const INSIDE_SCENE: &[(&str, &[&str])] = &[
    ("desc", &["limits"]),
    ("mesh", &["desc", "diagnostic", "files", "leftovers", "limits"]),
    ("model", &["desc", "mesh", "diagnostic", "files", "leftovers", "limits"]),
    ("mitsuba", &["desc", "mesh", "model", "diagnostic", "files", "limits", "suggest"]),
    ("edit", &["desc", "mitsuba", "diagnostic", "limits", "suggest"]),
];

/// Files that import each other can be understood only together. Up to three may, as a trait and what implements it often do.
#[test]
fn no_circle_of_imports_has_more_than_three_files() {
    for (module, _) in MAY_IMPORT {
        let graph = FileGraph::of(module);
        if let Some(circle) = graph.circles().iter().find(|circle| circle.len() > 3) {
            let (files, names) = (circle.len(), circle.join("\n"));
            panic!("{module}: {files} files import each other in a circle, at most three may:\n{names}");
        }
    }
}

#[test]
fn the_parts_of_a_scene_import_only_downwards() {
    let graph = FileGraph::of("scene");
    let part = |module: &str| module.split("::").nth(1).unwrap_or("mod").to_owned();
    for (module, file) in &graph.files {
        let Some((_, allowed)) = INSIDE_SCENE.iter().find(|(name, _)| *name == part(module)) else {
            continue;
        };
        for imported in graph.imported_by(module).into_iter().map(part) {
            let fine = imported == part(module) || allowed.contains(&imported.as_str());
            assert!(fine, "{}: scene::{} must not import scene::{imported}", file.name, part(module));
        }
    }
}

#[test]
fn the_graph_of_files_sees_through_re_exports() {
    let file = |(module, text): (&str, &str)| (module.to_owned(), SourceFile::new(module, text));
    let graph = |files: &[(&str, &str)]| FileGraph { files: files.iter().copied().map(file).collect() };
    let circle = graph(&[
        ("m", "mod a;\nmod b;\npub use a::{\n    First,\n    deep::{Second as Other},\n};\n"),
        ("m::a", "use super::b::Third; // use super::Other;\n"),
        ("m::a::deep", "fn f() { crate::m::First::new() }\n"),
        ("m::b", "use crate::m::{Other, self};\n#[cfg(test)]\nmod tests { use super::super::a; }\n"),
    ]);
    assert!(circle.imported_by("m").is_empty(), "re-exports are no imports");
    assert_eq!(circle.imported_by("m::b"), ["m", "m::a::deep"]);
    assert_eq!(circle.imported_by("m::a::deep"), ["m::a"]);
    assert_eq!(circle.circles(), [["m::a", "m::a::deep", "m::b"]]);
}

/// The files of a module, and which of them import which.
struct FileGraph {
    /// By the path of the module that a file is, such as `scene::desc`.
    files: BTreeMap<String, SourceFile>,
}

/// What the search for circles needs to know of a source file.
struct SourceFile {
    /// Its name, for messages.
    name: String,
    /// Its code but for tests, comments, texts and `use` declarations.
    code: String,
    /// The names that it imports, with their paths, and whether the declaration is public: a re-export.
    imports: Vec<Import>,
}

/// One name of a `use` declaration.
struct Import {
    alias: String,
    path: Vec<String>,
    is_public: bool,
}

impl FileGraph {
    fn of(module: &str) -> Self {
        let modules = sources(module).into_iter().map(|file| {
            let name = relative(&file);
            let path = name.trim_start_matches("src/").trim_end_matches(".rs").trim_end_matches("/mod");
            (path.replace('/', "::"), SourceFile::new(&name, &fs::read_to_string(&file).unwrap()))
        });
        Self { files: modules.collect() }
    }

    /// The files that a file imports. A name that a `mod.rs` only re-exports counts as imported from the file that defines it.
    fn imported_by(&self, module: &str) -> Vec<&str> {
        let file = &self.files[module];
        let used = |import: &&Import| !import.is_public || words(&file.code).any(|word| word == import.alias);
        let declared = file.imports.iter().filter(used).map(|import| import.path.clone());
        let written = paths_in(&file.code).filter(|path| {
            let is_local = file.imports.iter().any(|import| import.alias == path[0]);
            !is_local && path.len() > 1
        });
        let mut found: Vec<&str> =
            declared.chain(written).filter_map(|path| self.defining(module, &path, 0)).collect();
        found.sort_unstable();
        found.dedup();
        found.retain(|other| *other != module);
        found
    }

    /// The module whose file defines what `path` names in `module`; `None` for what is not of this graph.
    fn defining(&self, module: &str, path: &[String], depth: usize) -> Option<&str> {
        let mut names = path.iter().map(String::as_str).peekable();
        let mut at = match *names.peek()? {
            "crate" => {
                names.next();
                names.next()?.to_owned()
            }
            _ => module.to_owned(),
        };
        while let Some(&name) = names.peek() {
            let child = format!("{at}::{name}");
            match name {
                "self" => {}
                "super" => at.truncate(at.rfind("::")?),
                _ if self.files.contains_key(&child) => at = child,
                _ => break,
            }
            names.next();
        }
        let (at, file) = self.files.get_key_value(&at)?;
        let rest: Vec<String> = names.map(str::to_owned).collect();
        if at == module && path.first().is_some_and(|first| rest.first() == Some(first)) && depth == 0 {
            return None;
        }
        let again = file.imports.iter().find(|import| Some(&import.alias) == rest.first());
        match again.filter(|_| depth < 8) {
            None => {
                let globs = file.imports.iter().filter(|import| import.alias == "*" && depth < 8);
                let mut through = globs.filter_map(|glob| {
                    let path = [&glob.path[..glob.path.len() - 1], &rest].concat();
                    self.defining(at, &path, depth + 1)
                });
                let named = |other: &&str| words(&self.files[*other].code).any(|word| word == rest[0]);
                through.find(|other| *other != at && !rest.is_empty() && named(other)).or(Some(at))
            }
            Some(import) => {
                let path: Vec<String> = import.path.iter().chain(&rest[1..]).cloned().collect();
                let elsewhere = self.defining(at, &path, depth + 1);
                // What is imported from another module is not of this graph.
                if elsewhere.is_none() && import.path[0] != "crate" { Some(at) } else { elsewhere }
            }
        }
    }

    /// All circles: sets of files each of which reaches each other.
    fn circles(&self) -> Vec<Vec<&str>> {
        let imports: BTreeMap<&str, Vec<&str>> =
            self.files.keys().map(|module| (module.as_str(), self.imported_by(module))).collect();
        let mut reached: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
        for start in imports.keys() {
            let (seen, mut open) = (reached.entry(start).or_default(), vec![*start]);
            while let Some(module) = open.pop() {
                open.extend(imports[module].iter().filter(|other| seen.insert(**other)));
            }
        }
        let circle = |start: &&str| -> Vec<&str> {
            let both = |other: &&&str| reached[**other].contains(*start) && reached[*start].contains(**other);
            imports.keys().filter(both).map(|other| self.files[*other].name.as_str()).collect()
        };
        let circles: BTreeSet<Vec<&str>> =
            imports.keys().map(circle).filter(|found| found.len() > 1).collect();
        circles.into_iter().collect()
    }
}

impl SourceFile {
    fn new(name: &str, text: &str) -> Self {
        let product = text.split("#[cfg(test)]\nmod ").next().unwrap_or("");
        let code: String = product.lines().flat_map(|line| [code(line), "\n"]).collect();
        let (mut rest, mut imports) = (String::new(), Vec::new());
        for statement in code.split_inclusive(';') {
            let start = statement.match_indices("use ").map(|(at, _)| at).find(|&at| {
                let before = statement[..at].trim_end_matches(' ').rsplit('\n').next().unwrap_or("").trim();
                before.is_empty() || before.starts_with("pub")
            });
            match start {
                None => rest += statement,
                Some(at) => {
                    let line = statement[..at].rfind('\n').map_or(0, |end| end + 1);
                    let is_public = statement[line..at].trim().starts_with("pub");
                    rest += &statement[..line];
                    let tree = statement[at + 4..].trim_end_matches(';');
                    read_use_tree(tree, &[], is_public, &mut imports);
                }
            }
        }
        Self { name: name.to_owned(), code: rest, imports }
    }
}

/// Adds what a `use` declaration, or a part of it behind `prefix`, imports.
fn read_use_tree(tree: &str, prefix: &[String], is_public: bool, imports: &mut Vec<Import>) {
    let tree = tree.trim();
    let (head, inside) = tree.split_once('{').map_or((tree, None), |(head, rest)| (head, Some(rest)));
    let (head, alias) = head.split_once(" as ").map_or((head, None), |(head, alias)| (head, Some(alias)));
    let names = head.split("::").map(str::trim).filter(|name| !name.is_empty()).map(str::to_owned);
    let mut path: Vec<String> = prefix.iter().cloned().chain(names).collect();
    let Some(inside) = inside else {
        if path.last().is_some_and(|name| name == "self") && path.len() > 1 && !prefix.is_empty() {
            path.pop();
        }
        let alias = alias.map(str::trim).or(path.last().map(String::as_str)).unwrap_or("").to_owned();
        return imports.push(Import { alias, path, is_public });
    };
    let inside = inside.rsplit_once('}').map_or(inside, |(inside, _)| inside);
    let (mut depth, mut start) = (0, 0);
    for (at, sign) in inside.char_indices().chain([(inside.len(), ',')]) {
        match sign {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                if !inside[start..at].trim().is_empty() {
                    read_use_tree(&inside[start..at], &path, is_public, imports);
                }
                start = at + 1;
            }
            _ => {}
        }
    }
}

/// The words of a text of code.
fn words(code: &str) -> impl Iterator<Item = &str> {
    code.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|word| !word.is_empty())
}

/// The paths in a text of code that begin with a name in lower case, as modules have.
fn paths_in(code: &str) -> impl Iterator<Item = Vec<String>> {
    let paths = code.split(|c: char| !c.is_alphanumeric() && c != '_' && c != ':');
    let paths = paths.filter(|path| path.contains("::") && path.starts_with(|c: char| c.is_lowercase()));
    paths.map(|path| path.split("::").filter(|name| !name.is_empty()).map(str::to_owned).collect())
}
