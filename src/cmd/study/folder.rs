//! Directory of a study: its measurements, one per line, and the files generated from them; and the pages of many studies, `pointillist
//! study --collect`.

use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use miette::{IntoDiagnostic, Result, WrapErr};
use serde::{Deserialize, Serialize};

use crate::cmd::study::renderer::{StudyRenderer, cpu};
use crate::image::write::atomically;
use crate::render::process::tell;
use crate::study::data::Study;
use crate::study::measurement::Measurement;
use crate::study::pages;

/// First line of the file: the subject of the measurements. Measurements of another subject are rejected.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct FolderHeader {
    format: u32,
    program: String,
    /// Hash of the scene's description and of the display settings.
    scene: String,
    size: [u32; 2],
    filter: String,
    cpu: String,
    threads: usize,
    simd: String,
    device: String,
}

pub const FORMAT: u32 = 2;

pub struct StudyFolder {
    path: PathBuf,
    file: std::fs::File,
    /// Measurements of this run and of earlier ones.
    pub measurements: Vec<Measurement>,
    grown: bool,
}

const LINES: &str = "measurements.jsonl";

impl StudyFolder {
    /// Opens or creates a directory; one with the study of another subject is rejected.
    pub fn open(path: &Path, renderer: &StudyRenderer) -> Result<Self> {
        let cannot = |what: &str| format!("cannot {what} {}", path.display());
        std::fs::create_dir_all(path).into_diagnostic().wrap_err_with(|| cannot("make the folder"))?;
        let lines = path.join(LINES);
        let text = match std::fs::read_to_string(&lines) {
            Err(error) if error.kind() == ErrorKind::NotFound => String::new(),
            read => read.into_diagnostic().wrap_err_with(|| format!("cannot read {}", lines.display()))?,
        };
        let heading = heading(renderer);
        let mut parts = text.split_inclusive('\n');
        if let Some(first) = parts.next() {
            let there: Option<FolderHeader> = serde_json::from_str(first).ok();
            miette::ensure!(
                there.as_ref() == Some(&heading),
                help = "give another folder with -o, or remove this one",
                "{} holds the study of another scene, size, filter, display, machine, --simd or version of the program",
                path.display()
            );
        }
        // An incomplete last line was cut off when an earlier run was interrupted.
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        let read: Vec<Option<Measurement>> =
            parts.filter(|line| line.ends_with('\n')).map(|line| serde_json::from_str(line).ok()).collect();
        let broken = read.iter().filter(|line| line.is_none()).count();
        if broken > 0 {
            tell(&format!("note: {broken} lines of {} cannot be read and do not count", lines.display()));
        }
        let mut measured = Vec::new();
        read.into_iter().flatten().for_each(|line| take(&mut measured, line));
        let file = std::fs::OpenOptions::new().create(true).append(true).open(&lines);
        let mut file = file.into_diagnostic().wrap_err_with(|| cannot("write into"))?;
        file.set_len(whole as u64).into_diagnostic()?;
        if whole == 0 {
            writeln!(file, "{}", serde_json::to_string(&heading).into_diagnostic()?).into_diagnostic()?;
        }
        Ok(Self { path: path.to_path_buf(), file, measurements: measured, grown: false })
    }

    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Writes a measurement immediately.
    pub fn keep(&mut self, measured: Measurement) -> Result<()> {
        let line = serde_json::to_string(&measured).into_diagnostic()? + "\n";
        let written = self.file.write_all(line.as_bytes()).into_diagnostic();
        written.wrap_err_with(|| format!("cannot write {}", self.path.join(LINES).display()))?;
        take(&mut self.measurements, measured);
        self.grown = true;
        Ok(())
    }

    pub fn has(&self, kind: impl Fn(&Measurement) -> bool) -> bool {
        self.measurements.iter().any(kind)
    }

    /// Whether this run has added measurements.
    pub fn has_grown(&self) -> bool {
        self.grown
    }

    /// Writes page, table, JSON and charts. If one cannot be written, the others still are.
    pub fn publish(&self, study: &Study) -> Result<()> {
        let json = serde_json::to_string_pretty(study).into_diagnostic()? + "\n";
        let texts =
            [("study.json", json), ("study.csv", pages::csv(study)), ("index.html", pages::html(study))];
        let texts = texts.into_iter().chain(pages::svg_files(study));
        let written = texts.map(|(name, text)| atomically(&self.path.join(name), text.as_bytes()));
        written.fold(Ok(()), Result::and).into_diagnostic()
    }
}

/// Adds a measurement, replacing an earlier one of the same kind. If the reference file changes, measurements against the previous one are
/// discarded.
fn take(all: &mut Vec<Measurement>, new: Measurement) {
    let same = |old: &Measurement| match (old, &new) {
        (Measurement::Reference(_), Measurement::Reference(_))
        | (Measurement::Auto(_), Measurement::Auto(_)) => true,
        (Measurement::Run(old), Measurement::Run(new)) => old.is_same(new),
        (Measurement::Dropped(old), Measurement::Dropped(new)) => old.method == new.method,
        _ => false,
    };
    let place = all.iter().position(same);
    if let (Some(place), Measurement::Reference(new)) = (place, &new)
        && let Measurement::Reference(old) = &all[place]
        && old.file != new.file
    {
        all.clear();
    }
    match place.filter(|place| *place < all.len()) {
        Some(place) => all[place] = new,
        None => all.push(new),
    }
}

fn heading(renderer: &StudyRenderer) -> FolderHeader {
    let run = &renderer.run;
    FolderHeader {
        format: FORMAT,
        program: env!("CARGO_PKG_VERSION").to_string(),
        scene: hash(&(&renderer.desc, &renderer.settings)),
        size: [run.film.width, run.film.height],
        filter: format!("{:?}", run.film.filter),
        cpu: cpu(),
        threads: renderer.threads,
        simd: renderer.scene.kernel().name().to_string(),
        device: run.device.clone(),
    }
}

/// Hash of the debug form of a description.
fn hash(desc: &impl std::fmt::Debug) -> String {
    let mut hasher = blake3::Hasher::new();
    // Hashing never fails.
    let _ = write!(hasher, "{desc:?}");
    hasher.finalize().to_hex()[..16].to_owned()
}
/// Reads `FOLDER/*/study.json` and writes `index.html`, a page for each, and its plots into `output`.
pub fn collect(folder: &Path, output: &Path) -> Result<()> {
    let studies = read_studies(folder)?;
    std::fs::create_dir_all(output)
        .into_diagnostic()
        .wrap_err_with(|| format!("cannot make {}", output.display()))?;
    let linked: Vec<(String, &Study)> =
        studies.iter().map(|(name, study)| (format!("{name}.html"), study)).collect();
    let mut files = vec![("index.html".to_string(), pages::index(&linked))];
    for (name, study) in &studies {
        files.push((format!("{name}.html"), pages::html(study)));
        files.extend(pages::svg_files(study).map(|(end, text)| (format!("{name}-{end}"), text)));
    }
    for (name, text) in &files {
        atomically(&output.join(name), text.as_bytes()).into_diagnostic()?;
    }
    tell(&format!("{} studies: {}", studies.len(), output.join("index.html").display()));
    Ok(())
}

/// Directory names and their studies, in the order of the names.
fn read_studies(folder: &Path) -> Result<Vec<(String, Study)>> {
    let cannot = || format!("cannot read {}", folder.display());
    let mut found: Vec<PathBuf> = std::fs::read_dir(folder)
        .into_diagnostic()
        .wrap_err_with(cannot)?
        .filter_map(|entry| Some(entry.ok()?.path().join("study.json")))
        .filter(|file| file.exists())
        .collect();
    found.sort();
    let parse = |file: &PathBuf| -> Result<(String, Study)> {
        let text = std::fs::read_to_string(file).into_diagnostic()?;
        let study: Study = serde_json::from_str(&text).into_diagnostic()?;
        let name = file.parent().and_then(Path::file_name).unwrap_or_default();
        Ok((name.to_string_lossy().into_owned(), study))
    };
    let mut studies = Vec::new();
    for file in &found {
        match parse(file) {
            Ok(study) if study.1.format == FORMAT => studies.push(study),
            Ok(_) => tell(&format!("note: {} is of another version and left out", file.display())),
            Err(error) => tell(&format!("note: {} is no study and left out: {error}", file.display())),
        }
    }
    miette::ensure!(
        !studies.is_empty(),
        help = "`pointillist study SCENE.xml -o FOLDER/NAME` makes one",
        "there is no study in {}",
        folder.display()
    );
    Ok(studies)
}
