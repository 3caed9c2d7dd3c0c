//! `pointillist study --collect`: one page of many studies.

use std::path::{Path, PathBuf};

use miette::{IntoDiagnostic, Result, WrapErr};

use super::folder::FORMAT;
use crate::app::tell;
use crate::image::write::atomically;
use crate::study::data::Study;
use crate::study::pages;

/// Reads `FOLDER/*/study.json` and writes `index.html`, a page for each, and its plots into `output`.
pub fn collect(folder: &Path, output: &Path) -> Result<()> {
    let studies = read(folder)?;
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

/// Names of the folders and their studies, in the order of the names.
fn read(folder: &Path) -> Result<Vec<(String, Study)>> {
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
