//! Reads `regress.toml`, or finds scenes by convention. `README.md` has every key.

mod check;
mod glob;

use std::collections::{BTreeMap, BTreeSet};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::Duration;

use miette::{IntoDiagnostic, Result, WrapErr};
use serde::Deserialize;
use toml::Spanned;

use self::check::ManifestText;
use super::plan::{CaseBudget, CaseRenderer, CaseTolerance, ReferenceSource, RegressCase, RegressPlan};
use crate::scene::desc::IntegratorKind;
use crate::scene::suggest;

/// Name of the manifest.
pub const MANIFEST: &str = "regress.toml";

/// What a folder without a manifest stands for.
const CONVENTION: &str = "[[case]]\nscene = \"*.xml\"\n[[case]]\nscene = \"*/scene.xml\"\n";

/// The whole file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ManifestFile {
    references: Option<PathBuf>,
    false_alarm: Option<Spanned<f64>>,
    #[serde(default)]
    defaults: CaseTable,
    #[serde(default)]
    tolerance: BTreeMap<String, ToleranceTable>,
    #[serde(default)]
    renderer: BTreeMap<String, RendererTable>,
    #[serde(default, rename = "case")]
    cases: Vec<Spanned<CaseTable>>,
}

/// `[[case]]`, or `[defaults]`, which has neither `name` nor `scene` nor `except`.
#[derive(Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct CaseTable {
    name: Option<Spanned<String>>,
    scene: Option<Spanned<String>>,
    except: Option<Spanned<Vec<Spanned<String>>>>,
    renderer: Option<Spanned<String>>,
    methods: Option<Spanned<Vec<Spanned<String>>>>,
    devices: Option<Spanned<Vec<String>>>,
    options: Option<Spanned<Vec<String>>>,
    size: Option<Spanned<[u32; 2]>>,
    spp: Option<Spanned<u64>>,
    seeds: Option<Spanned<u32>>,
    most_seeds: Option<Spanned<u32>>,
    reference_seeds: Option<Spanned<u32>>,
    detect: Option<Spanned<f64>>,
    timeout: Option<Spanned<f64>>,
    tolerance: Option<Spanned<String>>,
    against: Option<Spanned<String>>,
    one_reference: Option<Vec<Spanned<String>>>,
}

/// `[tolerance.NAME]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ToleranceTable {
    #[serde(default)]
    bits: bool,
    relative: Option<Spanned<f64>>,
}

/// `[renderer.NAME]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RendererTable {
    command: Spanned<Vec<String>>,
    spp: Option<Spanned<u64>>,
}

impl CaseTable {
    /// The keys of this table, and those of `defaults` that it lacks.
    fn or(self, defaults: CaseTable) -> Self {
        Self {
            name: self.name,
            scene: self.scene,
            except: self.except,
            renderer: self.renderer.or(defaults.renderer),
            methods: self.methods.or(defaults.methods),
            devices: self.devices.or(defaults.devices),
            options: self.options.or(defaults.options),
            size: self.size.or(defaults.size),
            spp: self.spp.or(defaults.spp),
            seeds: self.seeds.or(defaults.seeds),
            most_seeds: self.most_seeds.or(defaults.most_seeds),
            reference_seeds: self.reference_seeds.or(defaults.reference_seeds),
            detect: self.detect.or(defaults.detect),
            timeout: self.timeout.or(defaults.timeout),
            tolerance: self.tolerance.or(defaults.tolerance),
            against: self.against.or(defaults.against),
            one_reference: self.one_reference.or(defaults.one_reference),
        }
    }
}

/// Reads the plan of a folder: its manifest, or without one every `*.xml` and `*/scene.xml` in it.
///
/// `device` replaces the devices of all cases that this program renders.
///
/// # Errors
///
/// For a folder or a manifest that cannot be read, with line and column where the manifest is at fault; when there is no scene.
pub fn read_plan(folder: &Path, device: Option<&str>) -> Result<RegressPlan> {
    if !folder.is_dir() {
        return Err(miette::miette!(
            help = "give the folder that holds the scenes or a regress.toml",
            "{} is not a folder",
            folder.display()
        ));
    }
    let path = folder.join(MANIFEST);
    let (text, by_convention) = match std::fs::read_to_string(&path) {
        Ok(text) => (text, false),
        Err(error) if error.kind() == ErrorKind::NotFound => (CONVENTION.to_owned(), true),
        Err(error) => {
            return Err(error).into_diagnostic().wrap_err_with(|| format!("cannot read {}", path.display()));
        }
    };
    let text = ManifestText { name: path.display().to_string(), text };
    let file: ManifestFile = text.parse()?;
    let mut reader =
        ManifestReader { folder, text: &text, file: &file, device, by_convention, cases: vec![] };
    for table in &file.cases {
        reader.add(table)?;
    }
    let cases = reader.finish()?;
    if cases.is_empty() {
        return Err(miette::miette!(
            help = "put scene files there, or write a regress.toml with [[case]] and scene = \"…\"",
            "{} holds no scene: neither *.xml nor */scene.xml",
            folder.display()
        ));
    }
    let false_alarm = match &file.false_alarm {
        Some(given) => text.within(given, 1e-9, 0.5, "a probability, such as 0.01")?,
        None => 0.01,
    };
    let references = folder.join(file.references.unwrap_or_else(|| "references".into()));
    Ok(RegressPlan { folder: folder.to_path_buf(), references, cases, false_alarm })
}

/// Turns tables into cases.
struct ManifestReader<'a> {
    folder: &'a Path,
    text: &'a ManifestText,
    file: &'a ManifestFile,
    device: Option<&'a str>,
    /// Patterns that match nothing are no error.
    by_convention: bool,
    /// With the place in the manifest that names the case.
    cases: Vec<(RegressCase, std::ops::Range<usize>)>,
}

impl ManifestReader<'_> {
    /// Adds all cases of a table.
    fn add(&mut self, table: &Spanned<CaseTable>) -> Result<()> {
        let (text, own) = (self.text, table.get_ref());
        let defaults = &self.file.defaults;
        for (key, place) in [
            ("name", defaults.name.as_ref().map(Spanned::span)),
            ("scene", defaults.scene.as_ref().map(Spanned::span)),
            ("except", defaults.except.as_ref().map(Spanned::span)),
        ] {
            if let Some(place) = place {
                let help = format!("write `{key}` in a [[case]]");
                return Err(text.error(place, &help, format!("`{key}` is no default")));
            }
        }
        let case = own.clone().or(self.file.defaults.clone());
        let Some(scene) = &case.scene else {
            let help = "write scene = \"FILE\", or a pattern such as \"scenes/*.xml\"";
            return Err(text.error(table.span(), help, "this case has no scene".into()));
        };
        let found = glob::expand(self.folder, scene.get_ref());
        if found.is_empty() && !self.by_convention {
            let help =
                format!("names are relative to {}; `*` stands for any part of a name", self.folder.display());
            return Err(text.error(scene.span(), &help, format!("no file is called {}", scene.get_ref())));
        }
        // An exception leaves the names of the other cases as they are.
        let several = found.len() > 1;
        for path in self.without_exceptions(&case, found)? {
            let named = scene_name(&path);
            let base = match &case.name {
                Some(name) if several => format!("{}-{named}", name.get_ref()),
                Some(name) => name.get_ref().clone(),
                None => named,
            };
            let place = case.name.as_ref().map_or(scene.span(), Spanned::span);
            self.add_scene(own, &case, &path, &base, place)?;
        }
        Ok(())
    }

    /// The files of a pattern but for those that `except` names.
    fn without_exceptions(&self, case: &CaseTable, found: Vec<PathBuf>) -> Result<Vec<PathBuf>> {
        let Some(except) = &case.except else { return Ok(found) };
        let is_meant =
            |word: &Spanned<String>, path: &PathBuf| glob::matches(word.get_ref(), &scene_name(path));
        if let Some(word) =
            except.get_ref().iter().find(|word| !found.iter().any(|path| is_meant(word, path)))
        {
            let names: Vec<String> = found.iter().map(|path| scene_name(path)).collect();
            let otherwise =
                "name a scene as its case is named, without folder and ending; `*` stands for any part";
            let help = suggest::nearest_or(word.get_ref(), names.iter().map(String::as_str), otherwise);
            let message = format!("no scene of this case is called {}", word.get_ref());
            return Err(self.text.error(word.span(), &help, message));
        }
        let is_left = |path: &PathBuf| !except.get_ref().iter().any(|word| is_meant(word, path));
        let left: Vec<PathBuf> = found.into_iter().filter(is_left).collect();
        if left.is_empty() {
            let help = "leave the case out, or some of these names";
            return Err(self.text.error(except.span(), help, "no scene of this case is left".into()));
        }
        Ok(left)
    }

    /// Adds the product of methods and devices of a scene.
    fn add_scene(
        &mut self,
        own: &CaseTable,
        case: &CaseTable,
        scene: &Path,
        base: &str,
        place: std::ops::Range<usize>,
    ) -> Result<()> {
        let tolerance = self.tolerance(case)?;
        let budget = self.budget(case, tolerance.same_bits)?;
        let size = case.size.as_ref().map(|size| self.text.size(size)).transpose()?;
        let renderers = match &case.renderer {
            Some(name) => vec![(String::new(), String::new(), self.command(own, name, size)?)],
            None => self.own_renderers(case)?,
        };
        for (method, device, renderer) in &renderers {
            let reference = self.reference(case, base, &budget, size, [method, device], &renderers)?;
            if tolerance.same_bits && !matches!(reference, ReferenceSource::Stored(_)) {
                let place = case.against.as_ref().map_or(place.clone(), Spanned::span);
                let help = "take another class of tolerance, or leave `against` out";
                let message = format!(
                    "class {} asks for the same bits, which only a stored reference has",
                    tolerance.class
                );
                return Err(self.text.error(place, help, message));
            }
            let made = RegressCase {
                name: file_name(&format!("{base}{method}{device}")),
                scene: self.folder.join(scene),
                renderer: renderer.clone(),
                size,
                budget,
                tolerance: tolerance.clone(),
                reference,
            };
            self.cases.push((made, place.clone()));
        }
        Ok(())
    }

    /// This program by each method on each device, with the parts of the name that tell them apart.
    fn own_renderers(&self, case: &CaseTable) -> Result<Vec<(String, String, CaseRenderer)>> {
        let options = case.options.as_ref().map(|options| options.get_ref().clone()).unwrap_or_default();
        if let Some(given) = &case.options {
            self.text.check_options(given)?;
        }
        let mut methods = Vec::new();
        for method in case.methods.iter().flat_map(|list| list.get_ref()) {
            self.text.check_word(method, "method", &method_names())?;
            methods.push(method.get_ref().clone());
        }
        let listed = case.devices.as_ref().map(|list| list.get_ref().clone()).unwrap_or_default();
        let name_device = listed.len() > 1;
        let devices = self.device.map_or(listed, |device| vec![device.to_owned()]);
        let name_method = methods.len() > 1;
        let some_or_none = |list: Vec<String>| match list.is_empty() {
            true => vec![None],
            false => list.into_iter().map(Some).collect(),
        };
        let devices: Vec<Option<String>> = some_or_none(devices);
        let mut made = Vec::new();
        for method in some_or_none(methods) {
            for device in devices.clone() {
                let part = |named: bool, word: &Option<String>| match word {
                    Some(word) if named => format!("+{word}"),
                    _ => String::new(),
                };
                let parts = [part(name_method, &method), part(name_device, &device)];
                let [of_method, of_device] = parts;
                let options = options.clone();
                let renderer = CaseRenderer::Pointillist { method: method.clone(), device, options };
                made.push((of_method, of_device, renderer));
            }
        }
        Ok(made)
    }

    /// Another program as the renderer of a case.
    fn command(
        &self,
        own: &CaseTable,
        name: &Spanned<String>,
        size: Option<[u32; 2]>,
    ) -> Result<CaseRenderer> {
        let of_pointillist = [
            ("methods", own.methods.as_ref().map(Spanned::span)),
            ("devices", own.devices.as_ref().map(Spanned::span)),
            ("options", own.options.as_ref().map(Spanned::span)),
        ];
        for (key, place) in of_pointillist {
            if let Some(place) = place {
                let help = "write such words into the renderer's command";
                let message = format!(
                    "`{key}` is for cases that Pointillist renders, not for the renderer {}",
                    name.get_ref()
                );
                return Err(self.text.error(place, help, message));
            }
        }
        self.renderer(name, size).map(|(renderer, _)| renderer)
    }

    /// A program of the table `renderer`, and its samples per pixel if they are given.
    fn renderer(
        &self,
        name: &Spanned<String>,
        size: Option<[u32; 2]>,
    ) -> Result<(CaseRenderer, Option<u64>)> {
        let known: Vec<&str> = self.file.renderer.keys().map(String::as_str).collect();
        self.text.check_word(name, "renderer", &known)?;
        let table = &self.file.renderer[name.get_ref()];
        self.text.check_command(&table.command, size.is_some())?;
        let spp = table.spp.as_ref().map(|spp| self.text.at_least(spp, 1)).transpose()?;
        let words = table.command.get_ref().clone();
        Ok((CaseRenderer::Command { name: name.get_ref().clone(), words }, spp))
    }

    /// What a case is compared with.
    fn reference(
        &self,
        case: &CaseTable,
        base: &str,
        budget: &CaseBudget,
        size: Option<[u32; 2]>,
        [method, device]: [&str; 2],
        all: &[(String, String, CaseRenderer)],
    ) -> Result<ReferenceSource> {
        let mut parts = [method.to_owned(), device.to_owned()];
        for word in case.one_reference.iter().flatten() {
            self.text.check_word(
                word,
                "kind of renderings that can share a reference",
                &["methods", "devices"],
            )?;
            let first =
                all.first().map(|(method, device, _)| [method.clone(), device.clone()]).unwrap_or_default();
            let at = usize::from(word.get_ref() == "devices");
            // With `--device` the list is not what the manifest says.
            let of_manifest = case.devices.as_ref().and_then(|list| list.get_ref().first());
            parts[at] = match of_manifest {
                Some(name) if at == 1 && !device.is_empty() => format!("+{name}"),
                _ => first[at].clone(),
            };
        }
        let Some(against) = &case.against else {
            return Ok(ReferenceSource::Stored(file_name(&format!("{base}{}{}", parts[0], parts[1]))));
        };
        if let Some(shared) = case.one_reference.iter().flatten().next() {
            let help = "leave out one of them";
            let message = "`one_reference` is about stored references, and `against` names another one";
            return Err(self.text.error(shared.span(), help, message.into()));
        }
        let word = against.get_ref();
        if self.file.renderer.contains_key(word) {
            let (renderer, spp) = self.renderer(against, size)?;
            return Ok(ReferenceSource::Rendered { renderer, spp: spp.unwrap_or(budget.spp) });
        }
        if Path::new(word).extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
            return Ok(ReferenceSource::Picture(self.folder.join(word.replace("{scene}", base))));
        }
        // That there is such a case is checked when all are known.
        Ok(ReferenceSource::Stored(word.clone()))
    }

    fn budget(&self, case: &CaseTable, same_bits: bool) -> Result<CaseBudget> {
        let text = self.text;
        let spp = case.spp.as_ref().map_or(Ok(16), |spp| text.at_least(spp, 1))?;
        let seeds = |given: &Option<Spanned<u32>>, least: u32, default: u32| match given {
            Some(given) => text.seeds(given, least),
            None => Ok(default.max(least)),
        };
        let first = seeds(&case.seeds, 2, 8)?;
        let most = seeds(&case.most_seeds, first, 32)?;
        // Bits are compared with as many renderings as a run has at first.
        let reference_seeds = seeds(&case.reference_seeds, 2, if same_bits { first } else { most })?;
        let detect = case.detect.as_ref();
        let detect =
            detect.map(|d| text.within(d, 1e-6, 1.0, "a relative change, such as 0.005")).transpose()?;
        let timeout = match &case.timeout {
            Some(given) => text.within(given, 0.01, 1e7, "a number of seconds")?,
            None => 600.0,
        };
        let timeout = Duration::from_secs_f64(timeout);
        Ok(CaseBudget { spp, seeds: first, most_seeds: most, reference_seeds, detect, timeout })
    }

    fn tolerance(&self, case: &CaseTable) -> Result<CaseTolerance> {
        let Some(name) = &case.tolerance else { return Ok(class("noise", false, 0.0)) };
        let class_name = name.get_ref().as_str();
        match self.file.tolerance.get(class_name) {
            Some(table) => {
                let relative = table.relative.as_ref();
                let relative =
                    relative.map(|r| self.text.within(r, 0.0, 1.0, "a relative difference")).transpose()?;
                Ok(class(class_name, table.bits, relative.unwrap_or(0.0)))
            }
            None if class_name == "noise" => Ok(class("noise", false, 0.0)),
            None if class_name == "strict" => Ok(class("strict", true, 0.0)),
            None => {
                let own = self.file.tolerance.keys().map(String::as_str);
                let known: Vec<&str> = own.chain(["noise", "strict"]).collect();
                self.text.check_word(name, "class of tolerance", &known)?;
                Ok(class(class_name, false, 0.0))
            }
        }
    }

    /// All cases, after the checks that need them all.
    fn finish(self) -> Result<Vec<RegressCase>> {
        let mut names = BTreeSet::new();
        for (case, place) in &self.cases {
            if !names.insert(case.name.as_str()) {
                let help = "give one of them another `name`";
                return Err(self.text.error(
                    place.clone(),
                    help,
                    format!("two cases are called {}", case.name),
                ));
            }
        }
        for table in &self.file.cases {
            let against = table.get_ref().against.as_ref().or(self.file.defaults.against.as_ref());
            let Some(against) = against else { continue };
            let word = against.get_ref();
            let is_picture = Path::new(word).extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
            // With `--device` cases are not called as in the manifest: a reference that is missing is told by the run.
            if !is_picture && self.device.is_none() && !self.file.renderer.contains_key(word) {
                let known: Vec<&str> =
                    names.iter().copied().chain(self.file.renderer.keys().map(String::as_str)).collect();
                self.text.check_word(against, "case, renderer or .exr file", &known)?;
            }
        }
        Ok(self.cases.into_iter().map(|(case, _)| case).collect())
    }
}

fn class(name: &str, same_bits: bool, relative: f64) -> CaseTolerance {
    CaseTolerance { class: name.to_owned(), same_bits, relative }
}

/// Names of the methods on the command line.
fn method_names() -> Vec<&'static str> {
    use clap::ValueEnum;
    IntegratorKind::value_variants().iter().map(|kind| kind.name()).collect()
}

/// A scene is called as its file, and `scene.xml` as its folder.
fn scene_name(path: &Path) -> String {
    let name = |part: Option<&std::ffi::OsStr>| part.map(|part| part.to_string_lossy().into_owned());
    let folder = path.parent().and_then(|folder| name(folder.file_name()));
    match (name(path.file_stem()).unwrap_or_default(), folder) {
        (stem, Some(folder)) if stem == "scene" && !folder.is_empty() => folder,
        (stem, _) => stem,
    }
}

/// A name with only the characters that a file of a case may have.
fn file_name(name: &str) -> String {
    let fine = |c: char| c.is_alphanumeric() || "_-.+".contains(c);
    let name: String = name.chars().map(|c| if fine(c) { c } else { '_' }).collect();
    // Not hidden, and neither `.` nor `..`.
    if name.starts_with('.') { format!("_{name}") } else { name }
}

#[cfg(test)]
mod tests;
