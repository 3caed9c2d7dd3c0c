//! Where results come from: hashes of scenes, references and programs, and the attributes of references.

use std::collections::{BTreeSet, HashMap};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use serde::{Deserialize, Serialize};

use super::evidence::Evidence;
use super::plan::{CaseRenderer, ReferenceSource, RegressCase, RegressPlan};
use crate::image::ImageError;
use crate::render::calendar;
use crate::scene::{self, LoadOptions};

/// Names of the attributes of a reference that are read again.
const SEEDS: &str = "seeds";
const DETERMINISTIC: &str = "deterministic";
const DEVICE: &str = "device";

/// Everything that the result of a case depends on: a result is kept only for the same key.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CaseKey {
    /// The case as it was asked for.
    pub case: String,
    /// Hash of the scene's files.
    pub scene: String,
    /// Hash of the reference.
    pub reference: String,
    /// Hash of the programs.
    pub program: String,
    /// First seed that was asked for.
    pub seed_base: Option<u32>,
}

/// Hashes of files, each made once.
#[derive(Debug, Default)]
pub struct FileHashes {
    /// The file that holds this program's code, where the program is only a script that loads it.
    library: Option<PathBuf>,
    scenes: Mutex<HashMap<PathBuf, String>>,
    files: Mutex<HashMap<PathBuf, String>>,
}

impl FileHashes {
    /// None yet. `library` is the file that holds this program's code, where the program is only a script that loads it.
    pub fn of_library(library: Option<PathBuf>) -> Self {
        Self { library, ..Self::default() }
    }

    /// The key of a case. Paths enter relative to the folder of the plan, so that machines can share results.
    pub fn key(
        &self,
        plan: &RegressPlan,
        case: &RegressCase,
        program: &Path,
        seed_base: Option<u32>,
    ) -> CaseKey {
        let scene = case.scene.strip_prefix(&plan.folder).unwrap_or(&case.scene);
        let asked = (&case.name, scene, &case.renderer, case.size, case.budget, &case.tolerance);
        let asked = format!("{asked:?} {} {}", plan.false_alarm, plan.cases.len());
        let own = self.program(plan, &case.renderer, program);
        let (reference, program) = match &case.reference {
            ReferenceSource::Stored(name) => (self.file(&stored(plan, name)), own),
            ReferenceSource::Picture(path) => (self.file(path), own),
            ReferenceSource::Rendered { renderer, spp } => {
                let other = self.program(plan, renderer, program);
                (format!("{renderer:?} {spp}"), hash(&[own.as_bytes(), other.as_bytes()]))
            }
        };
        CaseKey {
            case: hash(&[asked.as_bytes()]),
            scene: self.scene(&case.scene),
            reference,
            program,
            seed_base,
        }
    }

    /// Hash of a scene and of every file that it names, as far as this program can read it.
    pub fn scene(&self, path: &Path) -> String {
        if let Some(known) = lock(&self.scenes).get(path) {
            return known.clone();
        }
        let progress = Arc::default();
        // What is wrong with the scene is told by its rendering.
        let _ = scene::load_telling(path, &LoadOptions { defines: &[], lenient: true }, &progress);
        let mut files: BTreeSet<PathBuf> = progress.files().into_iter().collect();
        files.insert(path.to_path_buf());
        let hashes: Vec<String> = files.iter().map(|file| self.file(file)).collect();
        let hash = hash(&hashes.iter().map(String::as_bytes).collect::<Vec<_>>());
        lock(&self.scenes).insert(path.to_path_buf(), hash.clone());
        hash
    }

    /// Hash of a renderer: of this program, or of the files among the words of another one's command.
    fn program(&self, plan: &RegressPlan, renderer: &CaseRenderer, program: &Path) -> String {
        match renderer {
            CaseRenderer::Pointillist { .. } => self.file(self.library.as_deref().unwrap_or(program)),
            CaseRenderer::Command { words, .. } => {
                let files = words.iter().map(|word| plan.folder.join(word));
                let on_path = words.first().and_then(|word| on_path(word));
                let files = files.filter(|path| path.is_file()).chain(on_path);
                let hashes: Vec<String> = files.map(|path| self.file(&path)).collect();
                hash(&hashes.iter().map(String::as_bytes).collect::<Vec<_>>())
            }
        }
    }

    /// Hash of the bytes of a file; `missing` if it cannot be read.
    pub(super) fn file(&self, path: &Path) -> String {
        if let Some(known) = lock(&self.files).get(path) {
            return known.clone();
        }
        let mut hasher = blake3::Hasher::new();
        let read = std::fs::File::open(path).and_then(|mut file| std::io::copy(&mut file, &mut hasher));
        let hash = read.map_or_else(|_| "missing".to_owned(), |_| hasher.finalize().to_hex().to_string());
        lock(&self.files).insert(path.to_path_buf(), hash.clone());
        hash
    }
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Hash of texts in order.
fn hash(parts: &[&[u8]]) -> String {
    let mut hasher = blake3::Hasher::new();
    for part in parts {
        hasher.update(&(part.len() as u64).to_le_bytes());
        hasher.update(part);
    }
    hasher.finalize().to_hex().to_string()
}

/// The file of a program that is called by its name alone.
fn on_path(word: &str) -> Option<PathBuf> {
    if word.contains('/') {
        return None;
    }
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path).map(|folder| folder.join(word)).find(|file| file.is_file())
}

/// The file of a stored reference.
pub fn stored(plan: &RegressPlan, name: &str) -> PathBuf {
    plan.references.join(format!("{name}.exr"))
}

/// Files in the folder of the references that no case of the plan is compared with, in the order of their names.
pub fn unused_references(plan: &RegressPlan) -> Vec<PathBuf> {
    let used: BTreeSet<PathBuf> = plan
        .cases
        .iter()
        .filter_map(|case| match &case.reference {
            ReferenceSource::Stored(name) => Some(stored(plan, name)),
            ReferenceSource::Picture(path) => Some(path.clone()),
            ReferenceSource::Rendered { .. } => None,
        })
        .collect();
    // Without the folder there is no reference, as every case says.
    let files = std::fs::read_dir(&plan.references).into_iter().flatten().flatten().map(|file| file.path());
    let mut unused: Vec<PathBuf> =
        files.filter(|path| path.extension().is_some_and(|e| e == "exr") && !used.contains(path)).collect();
    unused.sort();
    unused
}

/// How evidence was made: attributes of its file.
#[derive(Clone, Debug, Default)]
pub struct Provenance {
    /// Why the reference is as it is; `None` for evidence of a run.
    pub reason: Option<String>,
    /// The scene, relative to the folder of the plan.
    pub scene: String,
    /// Hash of the scene's files.
    pub scene_hash: String,
    /// The command of the first rendering.
    pub command: String,
    /// Device and driver.
    pub device: String,
    /// Seeds of the renderings.
    pub seeds: Range<u32>,
    /// Samples per pixel of one rendering.
    pub spp: u64,
    /// Renderings can be repeated bit for bit.
    pub deterministic: bool,
}

impl Provenance {
    /// As attributes of an EXR file.
    pub fn attributes(&self) -> Vec<(String, String)> {
        let seeds = format!("{}..{}", self.seeds.start, self.seeds.end);
        let all = [
            ("reason", self.reason.clone()),
            ("scene", Some(self.scene.clone())),
            ("sceneHash", Some(self.scene_hash.clone())),
            ("command", Some(self.command.clone())),
            ("version", Some(env!("CARGO_PKG_VERSION").to_owned())),
            (DEVICE, Some(self.device.clone())),
            ("date", Some(calendar::now())),
            (SEEDS, Some(seeds)),
            ("spp", Some(self.spp.to_string())),
            (DETERMINISTIC, Some(self.deterministic.to_string())),
        ];
        all.into_iter().filter_map(|(name, value)| Some((name.to_owned(), value?))).collect()
    }
}

/// A reference on disk.
#[derive(Clone, Debug)]
pub struct StoredReference {
    /// What its renderings say.
    pub evidence: Evidence,
    /// Their seeds; `None` for a reference that `regress update` has not written.
    pub seeds: Option<Range<u32>>,
    /// They can be repeated bit for bit.
    pub deterministic: bool,
    /// Device and driver; `None` for a reference that `regress update` has not written.
    pub device: Option<String>,
}

impl StoredReference {
    /// The seeds whose renderings have the hashes of the evidence, in order; `None` where bits cannot be compared.
    pub fn repeatable(&self) -> Option<&Range<u32>> {
        self.seeds.as_ref().filter(|seeds| self.deterministic && self.evidence.hashes.len() == seeds.len())
    }

    /// Reads a reference.
    ///
    /// # Errors
    /// Those of [`Evidence::read`].
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let (evidence, attributes) = Evidence::read(path)?;
        let value =
            |name: &str| attributes.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str());
        let seeds = value(SEEDS).and_then(|text| {
            let (first, end) = text.split_once("..")?;
            Some(first.parse().ok()?..end.parse().ok()?)
        });
        let (deterministic, device) =
            (value(DETERMINISTIC) == Some("true"), value(DEVICE).map(str::to_owned));
        Ok(Self { evidence, seeds, deterministic, device })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regress::manifest::read_plan;

    /// A result is kept only as long as nothing changes that it depends on.
    #[test]
    fn keys_follow_what_results_depend_on() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a file");
        write("a.xml", "<scene version=\"3.0.0\"><include filename=\"b.part\"/></scene>");
        write("b.part", "<scene version=\"3.0.0\"/>");
        write("program", "1");
        let key = || {
            let plan = read_plan(folder.path(), None).expect("a plan");
            FileHashes::default().key(&plan, &plan.cases[0], &folder.path().join("program"), None)
        };
        let first = key();
        assert_eq!(first, key());
        assert_eq!(first.reference, "missing");
        write("b.part", "<scene version=\"3.0.0\"> </scene>");
        let second = key();
        assert_ne!(first.scene, second.scene);
        assert_eq!(first.case, second.case);
        write("program", "2");
        assert_ne!(second.program, key().program);
        write("regress.toml", "[[case]]\nscene = \"a.xml\"\nspp = 3\n");
        assert_ne!(second.case, key().case);
    }

    /// Where the program is a script, the library that it loads is what pictures depend on.
    #[test]
    fn keys_follow_the_library_of_a_script() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a file");
        write("a.xml", "<scene version=\"3.0.0\"/>");
        write("script", "1");
        write("library", "1");
        let plan = read_plan(folder.path(), None).expect("a plan");
        let key = || {
            let hashes = FileHashes::of_library(Some(folder.path().join("library")));
            hashes.key(&plan, &plan.cases[0], &folder.path().join("script"), None)
        };
        let first = key();
        write("script", "2");
        assert_eq!(first, key());
        write("library", "2");
        assert_ne!(first.program, key().program);
    }

    /// References of cases that are no more: told by a run, because nothing else would.
    #[test]
    fn references_without_a_case_are_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a file");
        write("a.xml", "<scene/>");
        write(
            "regress.toml",
            "[[case]]\nscene = \"a.xml\"\n[[case]]\nname = \"b\"\nscene = \"a.xml\"\nagainst = \"references/p.exr\"\n",
        );
        let unused = || {
            let plan = read_plan(folder.path(), None).expect("a plan");
            unused_references(&plan)
        };
        assert!(unused().is_empty());
        std::fs::create_dir(folder.path().join("references")).expect("a folder");
        for name in ["a.exr", "z.exr", "p.exr", "old.exr", "notes.txt"] {
            write(&format!("references/{name}"), "");
        }
        let names = ["old.exr", "z.exr"].map(|name| folder.path().join("references").join(name));
        assert_eq!(unused(), names);
    }
}
