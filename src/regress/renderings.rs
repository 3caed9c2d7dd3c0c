//! Independent renderings of a case by one renderer.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::Deserialize;

use super::case_times::RenderingTimes;
use super::child::run_child;
use super::evidence::{Evidence, EvidenceSum};
use super::plan::{CaseRenderer, RegressCase, RegressPlan};
use crate::image::compare::Picture;
use crate::image::write::atomically;
use crate::render::process;
use crate::render::timings::trace_path;

/// Why a case has no outcome.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CaseStop {
    /// Ctrl-C.
    Interrupted,
    /// It could not be rendered or compared: a sentence.
    Broken(String),
}

impl CaseStop {
    /// A case is broken for this reason.
    pub fn broken(reason: impl std::fmt::Display) -> Self {
        Self::Broken(reason.to_string())
    }
}

/// What is rendered, by whom, and where the files go.
#[derive(Clone, Debug)]
pub struct CaseRenderings {
    renderer: CaseRenderer,
    /// This program.
    program: PathBuf,
    /// Folder of the plan, in which commands run: absolute.
    folder: PathBuf,
    /// The scene relative to it.
    scene: PathBuf,
    size: Option<[u32; 2]>,
    spp: u64,
    timeout: Duration,
    /// Begins the path of every file of these renderings.
    place: PathBuf,
    log: PathBuf,
    /// The seeds so far, in order.
    seeds: Vec<u32>,
    /// What the pictures of these seeds say together.
    sum: EvidenceSum,
    tally: RenderingTally,
}

/// How many renderings there are, and how they were made.
#[derive(Clone, Debug, Default)]
pub struct RenderingTally {
    /// Number of renderings.
    pub count: u32,
    /// Their wall clock in all, in seconds.
    pub seconds: f64,
    /// Times of each.
    pub times: Vec<RenderingTimes>,
    /// Device and driver, or the name of the program, once there is a rendering.
    pub device: Option<String>,
    /// The command of the first rendering.
    pub command: Vec<String>,
    /// They can be repeated bit for bit.
    pub deterministic: bool,
}

/// The part of a render's report that is read.
#[derive(Deserialize)]
struct RenderedBy {
    device: String,
    driver: Option<String>,
}

impl CaseRenderings {
    /// None yet, of a case by its own renderer. `place` is the folder of the files and `kind` begins their names.
    pub fn new(
        plan: &RegressPlan,
        case: &RegressCase,
        program: &Path,
        [place, log]: [&Path; 2],
        kind: &str,
    ) -> Self {
        Self {
            renderer: case.renderer.clone(),
            program: program.to_path_buf(),
            folder: plan.folder.canonicalize().unwrap_or_else(|_| plan.folder.clone()),
            scene: case.scene.strip_prefix(&plan.folder).unwrap_or(&case.scene).to_path_buf(),
            size: case.size,
            spp: case.budget.spp,
            timeout: case.budget.timeout,
            place: place.join(kind),
            log: log.to_path_buf(),
            seeds: Vec::new(),
            sum: EvidenceSum::default(),
            tally: RenderingTally { deterministic: case.tolerance.same_bits, ..RenderingTally::default() },
        }
    }

    /// The same by another renderer.
    pub fn by(self, renderer: &CaseRenderer, spp: u64) -> Self {
        Self { renderer: renderer.clone(), spp, ..self }
    }

    /// The same such that they can be repeated bit for bit, as far as the renderer is this program. They are, in any case, where the class of
    /// tolerance asks for bits.
    pub fn repeatable(mut self, is_wanted: bool) -> Self {
        self.tally.deterministic |= is_wanted && matches!(self.renderer, CaseRenderer::Pointillist { .. });
        self
    }

    /// What there is so far.
    pub fn tally(&self) -> &RenderingTally {
        &self.tally
    }

    /// Adds a rendering for each seed. One that is there from an interrupted run is taken as it is.
    ///
    /// # Errors
    /// When one fails or takes too long; when Ctrl-C was pressed before one began.
    pub fn add(&mut self, seeds: impl IntoIterator<Item = u32>) -> Result<(), CaseStop> {
        for seed in seeds {
            if process::is_interrupted() {
                return Err(CaseStop::Interrupted);
            }
            let [output, report, time, capture] =
                ["exr", "json", "seconds", "csv"].map(|extension| file(&self.place, seed, extension));
            let words = self.words(seed, &output, &report);
            // Written last: a picture without it may be cut off.
            let known = std::fs::read_to_string(&time).ok().and_then(|text| text.trim().parse::<f64>().ok());
            let seconds = match known.filter(|_| output.is_file()) {
                Some(seconds) => seconds,
                None => self.render(seed, &words, [&output, &time, &capture])?,
            };
            let pixels = |path: &Path| Picture::read(path, None).map(|picture| picture.rgb);
            let earlier = |number: usize| pixels(&file(&self.place, self.seeds[number], "exr"));
            let added = pixels(&output).and_then(|now| self.sum.add(&now, earlier));
            added.map_err(CaseStop::broken)?;
            self.seeds.push(seed);
            self.tally.count += 1;
            self.tally.seconds += seconds;
            self.tally.times.push(RenderingTimes::read(seconds, &report, &capture));
            if self.tally.command.is_empty() {
                self.tally.device = self.rendered_by(&report);
                self.tally.command = words;
            }
        }
        Ok(())
    }

    /// The file of the rendering with this seed, which is there after [`Self::add`].
    pub fn picture(&self, seed: u32) -> PathBuf {
        file(&self.place, seed, "exr")
    }

    /// Hash of each rendering, in order.
    pub fn hashes(&self) -> &[String] {
        self.sum.hashes()
    }

    /// What the renderings say together; the variance of a single one is given by its file or estimated.
    ///
    /// # Errors
    /// Where there is none, and when a single one cannot be read.
    pub fn evidence(&self) -> Result<Evidence, CaseStop> {
        let evidence = match self.seeds[..] {
            [only] => Evidence::of_single(&self.picture(only)),
            _ => self.sum.evidence(),
        };
        evidence.map_err(CaseStop::broken)
    }

    /// Runs the program for one seed, with a capture of the GPU's passes, and writes its wall clock in seconds beside the picture.
    fn render(
        &self,
        seed: u32,
        words: &[String],
        [output, time, capture]: [&Path; 3],
    ) -> Result<f64, CaseStop> {
        let mut words = words.to_vec();
        if self.captures_passes() {
            words.extend(["--gpu-timings".to_owned(), capture.display().to_string()]);
        }
        let seconds = self.run(seed, &words, output)?;
        // Nobody reads the trace that comes with a capture, and long renderings have a large one. It may not be there.
        let _ = std::fs::remove_file(trace_path(capture));
        atomically(time, seconds.to_string().as_bytes()).map_err(CaseStop::broken)?;
        Ok(seconds)
    }

    /// Whether a rendering can capture passes of a GPU: there may be one, and the options of the case ask for no capture of their own.
    ///
    /// A capture costs nothing with lavapipe: 0.955 ± 0.007 times the processor time, 24 pairs of deterministic renderings by turns (Cornell box,
    /// 128², 32 spp), of which the last was compared and wrote the same file.
    pub(super) fn captures_passes(&self) -> bool {
        match &self.renderer {
            CaseRenderer::Pointillist { device, options, .. } => {
                let known = [device, &self.tally.device];
                known.iter().all(|device| device.as_deref() != Some("cpu"))
                    && !options.iter().any(|word| word.starts_with("--gpu-timings"))
            }
            CaseRenderer::Command { .. } => false,
        }
    }

    /// Runs these words for one seed; their wall clock in seconds.
    ///
    /// # Errors
    /// When the program fails, takes too long or writes no picture to `output`.
    pub(super) fn run(&self, seed: u32, words: &[String], output: &Path) -> Result<f64, CaseStop> {
        let start = Instant::now();
        run_child(words, &self.folder, &self.log, self.timeout)
            .map_err(|error| CaseStop::broken(format!("the rendering with seed {seed} {error}")))?;
        let seconds = start.elapsed().as_secs_f64();
        if !output.is_file() {
            let message = format!(
                "the rendering with seed {seed} ended well, but wrote no picture to {}",
                output.display()
            );
            return Err(CaseStop::Broken(message));
        }
        Ok(seconds)
    }

    /// The words of the command for one seed.
    pub(super) fn words(&self, seed: u32, output: &Path, report: &Path) -> Vec<String> {
        let text = |path: &Path| path.display().to_string();
        let (scene, output) = (text(&self.scene), text(output));
        match &self.renderer {
            CaseRenderer::Pointillist { .. } => {
                let mut words = vec![text(&self.program), "render".into(), scene];
                let files = ["-o", &output, "--json", &text(report), "--quiet"];
                words.extend(files.map(str::to_owned));
                words.extend(self.tally.deterministic.then(|| "--deterministic".to_owned()));
                words.extend(picture_options(&self.renderer, self.size, self.spp, seed).unwrap_or_default());
                words
            }
            CaseRenderer::Command { words, .. } => {
                let [width, height] = self.size.unwrap_or_default();
                let values = [
                    ("{scene}", scene),
                    ("{output}", output),
                    ("{seed}", seed.to_string()),
                    ("{spp}", self.spp.to_string()),
                    ("{width}", width.to_string()),
                    ("{height}", height.to_string()),
                ];
                let mut words: Vec<String> = words.iter().map(|word| replaced(word, &values)).collect();
                // A program named by a relative path is relative to the manifest, as the scenes are.
                if let Some(program) = words.first_mut().filter(|word| word.contains('/')) {
                    *program = text(&self.folder.join(&program));
                }
                words
            }
        }
    }

    /// Device and driver by the report of a render, or the name of another program.
    fn rendered_by(&self, report: &Path) -> Option<String> {
        if let CaseRenderer::Command { name, .. } = &self.renderer {
            return Some(name.clone());
        }
        let RenderedBy { device, driver } =
            serde_json::from_str(&std::fs::read_to_string(report).ok()?).ok()?;
        Some(driver.map_or_else(|| device.clone(), |driver| format!("{device}, {driver}")))
    }
}

/// The file of the rendering with this seed, of those whose paths begin with `place`.
fn file(place: &Path, seed: u32, extension: &str) -> PathBuf {
    let mut path = place.as_os_str().to_owned();
    path.push(format!("-{seed}.{extension}"));
    path.into()
}

/// The options of `render` that decide what picture of a scene a seed has; `None` of another program.
pub fn picture_options(
    renderer: &CaseRenderer,
    size: Option<[u32; 2]>,
    spp: u64,
    seed: u32,
) -> Option<Vec<String>> {
    let CaseRenderer::Pointillist { method, device, options } = renderer else { return None };
    let mut words = Vec::new();
    let mut option = |name: &str, value: String| words.extend([name.to_owned(), value]);
    option("--spp", spp.to_string());
    option("--seed", seed.to_string());
    if let Some([width, height]) = size {
        option("--size", format!("{width}x{height}"));
    }
    for (name, value) in [("--integrator", method), ("--device", device)] {
        if let Some(value) = value {
            option(name, value.clone());
        }
    }
    // Variances come from the spread over seeds: no rendering has to know its own.
    if !options.iter().any(|word| word.starts_with("--replicates")) {
        option("--replicates", "1".into());
    }
    words.extend(options.iter().cloned());
    Some(words)
}

/// A word with its names in braces replaced by their values, from the left; values stay as they are.
fn replaced(word: &str, values: &[(&str, String)]) -> String {
    let (mut out, mut rest) = (String::new(), word);
    while let Some(at) = rest.find('{') {
        out += &rest[..at];
        rest = &rest[at..];
        match values.iter().find(|(name, _)| rest.starts_with(name)) {
            Some((name, value)) => {
                out += value;
                rest = &rest[name.len()..];
            }
            None => {
                out.push('{');
                rest = &rest[1..];
            }
        }
    }
    out + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_in_braces_are_replaced_once() {
        let values = [("{scene}", "{seed}.xml".to_owned()), ("{seed}", "7".to_owned())];
        assert_eq!(replaced("a{scene}:{seed}{x}{", &values), "a{seed}.xml:7{x}{");
    }
}
