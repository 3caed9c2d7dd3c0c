//! `pointillist merge`: merges the parts of a picture.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use miette::{IntoDiagnostic, Result, WrapErr};
use serde::Serialize;

use crate::client::oidn::OidnQuality;
use crate::client::{Denoise, Film, Settings};
use crate::cmd::args::MergeArgs;
use crate::denoise::filtered_picture::{FilteredView, UNKNOWN_FILTERED_ERROR};
use crate::denoise::view_filter::{self, OidnOptions};
use crate::image::write::{check_place, same_file};
use crate::render::figures::{Seconds, check_json, human, print, write_json};
use crate::render::outputs::{Extras, Outputs};
use crate::render::process::tell;
use crate::render::report::ErrorReport;
use crate::render::run_spec::RunEnd;
use crate::render::state::{IndexRanges, RenderState, Share, StateFile, StateHeader};
use crate::render::{layers, load, method};
use crate::study::curve::PowerLaw;
use crate::study::format::{percent, round_percent};
use crate::study::witness::Witnesses;
use crate::study::{
    AccumulatedSamples, ErrorEstimate, ErrorMonitor, ErrorStatus, ErrorTarget, Interval, MonitorProgress,
    SamplesApart,
};
use crate::tracer::{Camera, Scene};

/// Report of a merge. Field names are JSON keys.
#[derive(Debug, Serialize)]
struct MergeReport {
    version: &'static str,
    scene: PathBuf,
    width: u32,
    height: u32,
    integrator: &'static str,
    /// Number of states added.
    states: usize,
    /// States left out, and why.
    left_out: Vec<String>,
    /// Indices in the sums, and missing indices of the picture.
    indices: IndexRanges,
    missing: IndexRanges,
    /// Number of parts that the picture was divided into, and the numbers of those with missing indices.
    #[serde(skip_serializing_if = "Option::is_none")]
    of: Option<u64>,
    missing_parts: Vec<u64>,
    camera_paths: u64,
    light_paths: u64,
    samples_per_pixel: f64,
    /// Seconds of rendering, over all parts.
    seconds: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<ErrorReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    further: Option<Further>,
}

/// Additional work to reach an error target.
#[derive(Debug, Serialize)]
struct Further {
    target: f64,
    /// Required over existing samples, with the 90 % interval.
    samples: Interval,
    /// Range of additional part numbers to render, besides the missing ones: first, last.
    #[serde(skip_serializing_if = "Option::is_none")]
    parts: Option<[u64; 2]>,
}

/// Runs the subcommand.
///
/// # Errors
///
/// For a state that is damaged or of another picture; for parts that are missing or duplicated, unless they may be left out; and when an
/// output cannot be written. Outputs are written only after all states were added.
pub fn merge(args: &MergeArgs) -> Result<()> {
    let states = files(&args.states)?;
    let targets = Targets::plan(args, &states)?;
    let threads = args.threads.map_or(0, usize::from);
    let mut merged = Merged::read(args, &states, threads)?;
    let status = merged.measure();
    let mut report = merged.report(args, &status);
    if !report.missing.ranges().is_empty() && !args.allow_missing && !targets.pictures.is_empty() {
        return Err(miette::miette!(
            help = "render them, or give --allow-missing for a picture of what is there",
            "parts of the picture are missing: {}",
            missing_words(&report)
        ));
    }
    if let Some(state) = &targets.state {
        merged.state.write(state)?;
    }
    if !targets.pictures.is_empty() {
        let filtered = merged.write_pictures(args, &targets.pictures, &status)?;
        report.error = report.error.map(|error| error.with_filtered(filtered.as_ref()));
    }
    if let Some(json) = &args.json {
        write_json(&report, json)?;
    }
    if !args.quiet && args.json.as_deref() != Some(Path::new("-")) {
        print(&summary(&report, args), "the summary");
    }
    Ok(())
}

/// Expands directories to the states in them.
fn files(named: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for path in named {
        if !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        let unread = || format!("cannot read the folder {}", path.display());
        let entries = std::fs::read_dir(path).into_diagnostic().wrap_err_with(unread)?;
        let entries = entries.map(|entry| entry.map(|entry| entry.path()));
        let mut all = entries.collect::<std::io::Result<Vec<_>>>().into_diagnostic().wrap_err_with(unread)?;
        all.retain(|path| is_state(path));
        if all.is_empty() {
            return Err(miette::miette!("there is no file named .state in {}", path.display()));
        }
        all.sort();
        files.append(&mut all);
    }
    Ok(files)
}

fn is_state(path: &Path) -> bool {
    let hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
    !hidden && path.extension().is_some_and(|e| e.eq_ignore_ascii_case("state"))
}

/// Output paths.
struct Targets {
    pictures: Outputs,
    state: Option<PathBuf>,
}

impl Targets {
    /// Checks all outputs before any input is read.
    fn plan(args: &MergeArgs, inputs: &[PathBuf]) -> Result<Self> {
        view_filter::check(args.denoise)?;
        let (states, pictures): (Vec<&PathBuf>, Vec<&PathBuf>) =
            args.outputs.iter().partition(|path| is_state(path));
        let [first, ..] = inputs else { return Err(miette::miette!("there is no state to merge")) };
        if states.len() > 1 {
            return Err(miette::miette!("one -o FILE.state is enough"));
        }
        if let Some(state) = states.first() {
            check_place(state).into_diagnostic()?;
        }
        for output in args.outputs.iter().chain(&args.json) {
            if let Some(input) = inputs.iter().find(|input| same_file(input, output)) {
                return Err(miette::miette!(
                    help = "choose another name",
                    "{} would be overwritten, and it is one of the states to merge",
                    input.display()
                ));
            }
        }
        check_json(args.json.as_deref(), first)?;
        let pictures = Outputs::check(pictures.into_iter().cloned().collect(), args.json.as_ref(), first)?;
        Ok(Self { pictures, state: states.first().map(|path| (*path).clone()) })
    }
}

/// Scene and view of the states.
struct MergedView {
    scene: Arc<Scene>,
    camera: Camera,
}

impl MergedView {
    /// Loads the scene of this state.
    ///
    /// # Errors
    ///
    /// If the scene is missing or has changed.
    fn open(about: &StateHeader, threads: Option<u16>) -> Result<Self> {
        let run = &about.run;
        let opened = load::open(&run.source(threads), &mut Seconds::default())?;
        if crate::render::state::identity::hash_of_files(&opened.input.files)? != about.identity.scene {
            return Err(miette::miette!(
                help = "states are merged without their scene, too; --denoise, layers and the error of light that only other methods find need it",
                "{} has changed since the states were rendered",
                run.scene.display()
            ));
        }
        Ok(Self { scene: Arc::new(opened.scene), camera: opened.camera })
    }
}

/// Samples of the first states, and their number of paths.
struct MergedPart {
    samples: SamplesApart,
    paths: u64,
}

/// Sum of the states.
struct Merged {
    state: RenderState,
    /// Scene of the states, or why it could not be loaded; `None` until needed.
    view: Option<Result<MergedView>>,
    /// Witness paths, which find light that the states may lack.
    witnesses: Option<Witnesses>,
    /// Copies of the sums at two moments, the later with at least twice as many paths, if the error of the denoised picture is wanted. In
    /// the end the one closer to half of all paths serves as the part kept apart for the estimate.
    apart: Vec<MergedPart>,
    wants_filtered_error: bool,
    /// Indices of the whole picture.
    picture: Range<u64>,
    shares: Vec<Share>,
    added: usize,
    left_out: Vec<String>,
    /// Error after some of the states, to fit its decrease.
    progress: MonitorProgress,
}

impl Merged {
    /// Adds the files one by one. At most two films are in memory, plus the scene if found.
    fn read(args: &MergeArgs, states: &[PathBuf], threads: usize) -> Result<Self> {
        let mut merged: Option<Self> = None;
        let mut places: Vec<(Range<u64>, &Path)> = Vec::new();
        let mut left_out = Vec::new();
        for path in states {
            let checked = StateFile::open(path).and_then(|file| {
                check_one_eye(&file)?;
                if let Some(Self { state: RenderState { about, .. }, .. }) = &merged {
                    about.check_same(&file.about, path)?;
                    check_new(&about.indices, &places, &file)?;
                }
                Ok(file)
            });
            let file = match checked {
                Err(error) if args.allow_missing => {
                    tell(&format!("warning: left out: {error}"));
                    left_out.push(error.to_string());
                    continue;
                }
                checked => checked?,
            };
            places.extend(file.about.indices.ranges().iter().map(|range| (range.clone(), path.as_path())));
            match &mut merged {
                Some(merged) => merged.add(file)?,
                None => merged = Some(Self::first(file, args, threads)?),
            }
        }
        let merged = merged.ok_or_else(|| miette::miette!("none of the states can be merged"))?;
        Ok(Self { left_out, ..merged })
    }

    fn first(file: StateFile, args: &MergeArgs, threads: usize) -> Result<Self> {
        let about = file.about.clone();
        let StateHeader { program, run, identity, picture, goal, .. } = about.clone();
        let empty = StateHeader { program, ..StateHeader::empty(run, identity, picture, goal) };
        let state = RenderState::new(empty, threads)?;
        // Without replicates no error is estimated.
        let view = state.sums.replicates.as_ref().map(|_| MergedView::open(&about, args.threads));
        let witnesses = match &view {
            None => None,
            Some(Ok(MergedView { scene, camera })) => method::witnesses(&about.run, scene, camera),
            Some(Err(error)) => {
                let causes: Vec<String> = error.chain().map(ToString::to_string).collect();
                let causes = causes.join(": ");
                tell(&format!(
                    "note: the stated error knows nothing of light that only other methods find: {causes}"
                ));
                None
            }
        };
        let mut merged = Self {
            state,
            view,
            witnesses,
            apart: Vec::new(),
            wants_filtered_error: args.denoise != Denoise::Off && about.run.can_state_filtered_error(),
            picture: about.picture.clone(),
            shares: Vec::new(),
            added: 0,
            left_out: Vec::new(),
            progress: MonitorProgress::default(),
        };
        merged.add(file)?;
        Ok(merged)
    }

    fn add(&mut self, file: StateFile) -> Result<()> {
        let about = file.about.clone();
        if let Some(replicates) = self.state.sums.replicates.as_ref().filter(|_| self.wants_filtered_error) {
            let paths = replicates.paths();
            if paths > 0 && self.apart.last().is_none_or(|part| paths >= 2 * part.paths) {
                self.apart.drain(..self.apart.len().saturating_sub(1));
                self.apart.push(MergedPart { samples: SamplesApart::so_far(&replicates.rounded()), paths });
            }
        }
        self.state.add(file)?;
        self.picture = self.picture.start.min(about.picture.start)..self.picture.end.max(about.picture.end);
        self.shares.extend(about.share);
        self.added += 1;
        if self.added.is_power_of_two() {
            self.measure();
        }
        Ok(())
    }

    /// Estimates the present error.
    fn measure(&mut self) -> ErrorStatus {
        let Some(replicates) = &self.state.sums.replicates else { return ErrorStatus::default() };
        let film = &self.state.about.run.film;
        let size = [film.width, film.height];
        let accumulated = AccumulatedSamples::new(size, film.filter.energy()).exact(replicates.clone());
        let monitor = ErrorMonitor::new(size, None).that_blurs(self.state.about.run.is_blurred());
        let mut monitor = monitor.resumed(self.progress.clone());
        self.witnesses.take().into_iter().for_each(|witnesses| monitor.set_witnesses(witnesses));
        monitor.take_checkpoint(&accumulated, self.state.about.seconds);
        self.witnesses = monitor.take_witnesses();
        self.progress.checkpoints = monitor.status().checkpoints.clone();
        monitor.status().clone()
    }

    /// Indices that the picture should have.
    fn wanted(&self) -> Range<u64> {
        match self.picture.end {
            u64::MAX => {
                self.picture.start..self.state.about.indices.ranges().last().map_or(0, |range| range.end)
            }
            _ => self.picture.clone(),
        }
    }

    fn report(&mut self, args: &MergeArgs, status: &ErrorStatus) -> MergeReport {
        let about = &mut self.state.about;
        about.counts = self.state.sums.film.counts();
        let about = &self.state.about;
        let (run, wanted) = (&about.run, self.wanted());
        let missing = about.indices.missing(wanted.clone());
        let of = self.shares.first().map(|share| share.of);
        let of = of.filter(|of| self.shares.iter().all(|share| share.of == *of));
        let lacks = |number: &u64| {
            let part = Share { number: *number, of: of.unwrap_or(1) }.indices(&self.picture);
            about.indices.missing(part).count() > 0
        };
        let last = self.shares.iter().map(|share| share.number).max().unwrap_or(0).max(of.unwrap_or(0));
        let missing_parts = if of.is_some() { (1..=last).filter(lacks).collect() } else { Vec::new() };
        let target = args.error.map(|error| ErrorTarget { error, at: args.error_at });
        let further = target.and_then(|target| self.further(status, target, of.map(|of| (of, last))));
        let reached = target.is_some_and(|target| {
            let error = status.estimate.relative[target.at.index()].value;
            error > 0.0 && error <= target.error
        });
        MergeReport {
            version: env!("CARGO_PKG_VERSION"),
            scene: run.scene.clone(),
            width: run.film.width,
            height: run.film.height,
            integrator: run.integrator.name(),
            states: self.added,
            left_out: self.left_out.clone(),
            indices: about.indices.clone(),
            missing,
            of,
            missing_parts,
            camera_paths: about.counts.camera_paths,
            light_paths: about.counts.light_paths,
            samples_per_pixel: about.samples_per_pixel(),
            seconds: about.seconds,
            error: ErrorReport::new(status, run, target, args.error_at, reached, args.denoise),
            further,
        }
    }

    /// Additional work to reach `target`; `None` if it is reached, or the decrease of the error is unknown.
    fn further(
        &self,
        status: &ErrorStatus,
        target: ErrorTarget,
        parts: Option<(u64, u64)>,
    ) -> Option<Further> {
        let error = status.estimate.relative[target.at.index()];
        if error.value <= target.error {
            return None;
        }
        let (x, deviation) =
            PowerLaw::new(&status.checkpoints, self.state.about.run.is_blurred())?.until(target.error)?;
        let factor = |z: f64| (x + z * deviation).max(0.0).exp();
        let z = crate::study::interval::Z90;
        let samples = Interval { value: factor(0.0), low: factor(-z), high: factor(z) };
        let parts = parts.map(|(of, last)| {
            let there = self.state.about.indices.count() as f64;
            let wanted = IndexRanges::one(self.wanted()).count().max(1) as f64;
            let more = (there * samples.value - wanted).max(0.0) / wanted * of as f64;
            [last + 1, of + more.ceil() as u64]
        });
        Some(Further { target: target.error, samples, parts: parts.filter(|[first, last]| first <= last) })
    }

    /// Writes the pictures. Returns the error of the denoised picture, if known.
    fn write_pictures(
        mut self,
        args: &MergeArgs,
        outputs: &Outputs,
        status: &ErrorStatus,
    ) -> Result<Option<ErrorEstimate>> {
        let about = &self.state.about;
        let mut run = about.run.clone();
        run.first_index = about.indices.ranges().first().map_or(0, |range| range.start);
        let mut end = RunEnd { prefix: about.indices.ranges().len() <= 1, ..RunEnd::default() };
        let rejections = &about.rejections;
        end.rejected = (rejections.total() > 0).then(|| {
            let samples = rejections.samples();
            format!(
                "{samples} samples and {} contributions to samples rejected",
                rejections.total() - samples
            )
        });
        let settings = Settings { denoise: args.denoise, ..args.display.settings() };
        let (mut extras, mut filtered_error) = (Extras::default(), None);
        let wants_layers = outputs.writes_exr() && !run.aovs.is_empty();
        if wants_layers || args.denoise != Denoise::Off {
            let view = self.view.unwrap_or_else(|| MergedView::open(about, args.threads));
            let MergedView { scene, camera } = view?;
            if wants_layers {
                extras.layers = layers::trace(&run, &scene, &camera, about.samples_per_pixel());
            }
            if args.denoise != Denoise::Off {
                let replicates = self.state.sums.replicates.as_ref().ok_or_else(|| {
                    miette::miette!(
                        help = "leave --denoise away",
                        "--denoise needs two randomisations, and the states have one"
                    )
                })?;
                let threads = args.threads.map_or_else(|| OidnOptions::default().threads, usize::from);
                let oidn = OidnOptions { threads, quality: OidnQuality::High };
                let data = self.state.sums.film.develop().into_diagnostic()?;
                let view = FilteredView { scene: &scene, camera: &camera, film: &run.film };
                let wants_error = run.states_filtered_error(status);
                // The part closer to half of all paths.
                let off = |part: &&MergedPart| (2 * part.paths).abs_diff(replicates.paths());
                let apart = self.apart.iter().min_by_key(off).map(|part| &part.samples);
                let apart = apart.filter(|_| wants_error);
                let filtered = view.filter(&replicates.rounded(), apart, &data, args.denoise, oidn);
                let (picture, error) = filtered.into_diagnostic()?;
                if wants_error && error.is_none() && !args.quiet {
                    tell(UNKNOWN_FILTERED_ERROR);
                }
                (extras.denoised, filtered_error) = (Some(picture), error);
            }
        }
        end.describe(status, args.error_at);
        outputs.write(&mut self.state.sums.film, &run, &end, &settings, extras, &mut Seconds::default())?;
        Ok(filtered_error)
    }
}

/// Rejects states of two eyes, which are not divided into parts.
fn check_one_eye(file: &StateFile) -> Result<()> {
    match file.about.right_eye {
        None => Ok(()),
        Some(_) => Err(miette::miette!(
            help = "`render --resume FILE` goes on with it and writes its pictures",
            "{} holds the pictures of two eyes, and `merge` adds those of one",
            file.path.display()
        )),
    }
}

/// Rejects indices that are in `there` already, naming the file of `places` they came from.
fn check_new(there: &IndexRanges, places: &[(Range<u64>, &Path)], file: &StateFile) -> Result<()> {
    let Some(twice) = file.about.indices.ranges().iter().find_map(|range| there.common(range)) else {
        return Ok(());
    };
    let holder = places.iter().find(|(range, _)| range.contains(&twice.start));
    let holder = holder.map_or("another state".to_string(), |(_, path)| path.display().to_string());
    Err(miette::miette!(
        help = "merge one of them only",
        "{holder} and {} both hold the indices {}–{}",
        file.path.display(),
        twice.start,
        twice.end - 1
    ))
}

fn missing_words(report: &MergeReport) -> String {
    let indices = format!("indices {}", report.missing);
    match (&report.missing_parts[..], report.of) {
        ([], _) | (_, None) => indices,
        (parts, Some(of)) => {
            let shown: Vec<String> = parts.iter().take(10).map(u64::to_string).collect();
            let more =
                if parts.len() > 10 { format!(" and {} more", parts.len() - 10) } else { String::new() };
            format!("{}{more} of {of} ({indices})", shown.join(", "))
        }
    }
}

/// Summary for the user.
fn summary(report: &MergeReport, args: &MergeArgs) -> String {
    let MergeReport { states, width, height, integrator, samples_per_pixel, seconds, .. } = report;
    let mut text = format!(
        "{states} states: {width}×{height}, {integrator}, {samples_per_pixel:.1} samples per pixel ({} paths) in {seconds:.1} s of rendering",
        human(report.camera_paths.max(report.light_paths) as f64)
    );
    if let Some(error) = &report.error {
        text += &error.summary();
    }
    if !report.missing.ranges().is_empty() {
        text += &format!("\nmissing: {}", missing_words(report));
    }
    match (&report.further, args.error) {
        (Some(Further { target, samples, parts }), _) => {
            let Interval { value, low, high } = samples;
            text += &format!(
                "\n{} in {} of the picture needs about {value:.1} times the samples (90 %: {low:.1} to {high:.1})",
                round_percent(*target),
                args.error_at.share()
            );
            if let (Some([first, last]), Some(of)) = (parts, report.of) {
                text += &format!(": `shard --of {of}` with --number {first} to {last}");
            }
        }
        (None, Some(error)) if report.error.as_ref().is_some_and(|known| known.reached) => {
            text += &format!("\n{} is reached", percent(error));
        }
        _ => {}
    }
    text + "\n"
}
