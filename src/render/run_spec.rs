//! Specification of a run, stored in the picture file so that the picture can be reproduced.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::client::compiled_effects::Effects;
use crate::client::{
    FilmSpec, OptionNames, ReconstructionKernel, ScaledFilter, Settings, SplatFilter, VarianceForm,
};
use crate::image::Attribute;
use crate::image::mix::MixRgb;
use crate::render::forced::Forced;
use crate::render::options::SceneOptions;
use crate::scene::desc::{
    AovDesc, IntegratorKind, PhotonDesc, ReconstructionFilter, SceneDesc, StereoConvergence, StereoRig,
};
use crate::stream::{BlockEyes, Rejected};
use crate::study::format::percent;
use crate::study::{ErrorQuantile, ErrorStatus};
use crate::tracer::accel::SimdKernel;
use crate::tracer::choice::IntegratorChoice;
use crate::tracer::effects::{Effect, refusal};

/// Everything that determines the sums of a film, except the number of paths.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RunSpec {
    pub scene: PathBuf,
    /// `-D` values.
    pub defines: Vec<(String, String)>,
    /// Unsupported plugins are replaced or skipped.
    pub lenient: bool,
    /// Size from the command line; `None` for the scene's film.
    pub size: Option<(u32, u32)>,
    /// Size, filter, variance form.
    pub film: FilmSpec,
    pub max_depth: Option<u32>,
    /// Path length from which on Russian roulette applies.
    pub rr_depth: u32,
    /// Emitters are invisible to the camera.
    pub hide_emitters: bool,
    pub integrator: IntegratorKind,
    /// Parameters of photon mapping.
    pub photons: PhotonDesc,
    /// Additional layers of an EXR file.
    pub aovs: Vec<AovDesc>,
    /// Reason for the method, if the choice was automatic.
    pub auto: Option<ChoiceReport>,
    /// Effects forced on or off against what the scene needs.
    pub effects: Vec<Forced>,
    /// Samples per pixel if neither count nor time is given.
    pub spp: u64,
    pub seed: u32,
    pub first_index: u64,
    /// Samples are rasterised in index order.
    pub deterministic: bool,
    /// Divided into replicates, from which the error is estimated.
    pub replicated: bool,
    /// Adaptive sampling: more camera paths where a pilot found larger errors.
    #[serde(default)]
    pub adaptive: bool,
    /// Light groups with layers in the file, in the syntax of `--light-groups`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light_groups: Option<String>,
    /// The eyes, if there are two.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stereo: Option<StereoRig>,
    /// The device that rasterised it.
    pub device: String,
    /// Threshold κ of firefly reweighting; `None` if off.
    pub reweighted: Option<f32>,
}

/// Outcome of a run, for the metadata of its picture file.
#[derive(Clone, Debug, Default)]
pub struct RunEnd {
    /// The paths form a prefix of the sequence, without gaps.
    pub prefix: bool,
    /// Rejected values, in one line.
    pub rejected: Option<String>,
    /// Notes by attribute name: error, a warning if it is unreliable, and composition of the picture.
    pub notes: Vec<(&'static str, String)>,
}

impl RunEnd {
    /// Adds notes about the error of the picture.
    pub fn describe(&mut self, error: &ErrorStatus, at: ErrorQuantile) {
        self.notes.clear();
        if error.checkpoints.is_empty() {
            return;
        }
        let stated = percent(error.held_out.relative[at.index()].value);
        self.notes.push(("error", format!("{stated} or less in {} of the picture", at.share())));
        let largest = percent(error.late.largest.one);
        self.notes.push(("largestSample", format!("{largest} of the light")));
        self.notes.extend(error.late.warning().map(|warning| ("warning", warning)));
        self.notes.extend(error.late.unfound().map(|unfound| ("unfound", unfound)));
    }
}

/// The chosen method and the reason. Field names are JSON keys.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ChoiceReport {
    /// The method.
    #[serde(skip)]
    pub kind: IntegratorKind,
    pub reason: String,
    /// Methods compared in the trial; empty if witness paths decided.
    pub candidates: Vec<Candidate>,
}

/// A method in the trial.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Candidate {
    pub method: String,
    /// Whether it can find all light that the picture contains.
    pub complete: bool,
    /// Estimated time to equal error, relative to the chosen method's; absent if it is never reached.
    pub relative_time: Option<f64>,
    /// Relative variance per path, including missed light.
    pub variance: f64,
    /// Fraction of the light that its trial missed.
    pub missed: f64,
    /// Cost of a path, in units of beginning one.
    pub cost: f64,
    /// Mean luminance in its trial.
    pub mean: f64,
}

impl From<IntegratorChoice> for ChoiceReport {
    fn from(choice: IntegratorChoice) -> Self {
        let best = choice.ratings.iter().find(|r| r.kind == choice.kind).map_or(1.0, |r| r.time());
        let candidates = choice.ratings.iter().map(|r| Candidate {
            method: r.kind.name().to_string(),
            complete: r.complete,
            relative_time: Some(r.time() / best).filter(|t| t.is_finite()),
            variance: r.variance,
            missed: r.missed,
            cost: r.cost,
            mean: r.mean,
        });
        let reason = format!("auto: {} — {}", choice.kind.name(), choice.reason);
        Self { kind: choice.kind, reason, candidates: candidates.collect() }
    }
}

/// Attribute of a picture file that names the light groups.
pub const LIGHT_GROUPS: &str = "lightGroups";

/// Default samples per pixel if neither command line nor scene specifies them.
const DEFAULT_SPP: u64 = 16;

impl RunSpec {
    /// Whether the method blurs the picture by photon density estimation.
    pub fn is_blurred(&self) -> bool {
        self.photons.blur(self.integrator)
    }

    /// Whether the error of the denoised picture can be estimated: the estimate misses bias common to both randomisations
    /// ([`filtered_error`](crate::denoise::filtered_picture::filtered_error)).
    pub fn can_state_filtered_error(&self) -> bool {
        self.replicated && !self.is_blurred() && self.reweighted.is_none()
    }

    /// Whether it can be stated, given this state of the picture's error.
    pub fn states_filtered_error(&self, state: &ErrorStatus) -> bool {
        self.can_state_filtered_error()
            && !state.checkpoints.is_empty()
            && state.late.unfound().is_none()
            && state.late.warning().is_none()
    }

    /// The run specified by options and scene. It begins at index 0, in any order of rasterisation.
    pub fn of(source: &SceneOptions, desc: &SceneDesc, forced: &[Forced], device: String) -> Self {
        let film = &desc.film;
        let (width, height) = film.crop.map_or((film.width, film.height), |c| (c.width, c.height));
        let from_file = || match film.rfilter {
            Some(ReconstructionFilter::Box) => SplatFilter::Box,
            Some(ReconstructionFilter::Tent { radius: 1.0 }) => SplatFilter::Tent,
            Some(ReconstructionFilter::Tent { radius }) => {
                SplatFilter::Scaled(ScaledFilter::Tent { radius: thousandths(radius) })
            }
            Some(ReconstructionFilter::Gaussian { stddev }) => {
                SplatFilter::Scaled(ScaledFilter::Gaussian { stddev: thousandths(stddev) })
            }
            None => SplatFilter::Gaussian,
        };
        let filter = source.filter.unwrap_or_else(from_file);
        let integrator = &desc.integrator;
        Self {
            scene: source.scene.clone(),
            defines: source.defines.clone(),
            lenient: source.lenient,
            size: source.size,
            first_index: 0,
            film: FilmSpec {
                width,
                height,
                filter,
                variance: Some(VarianceForm::Product),
                sums: Default::default(),
            },
            max_depth: source.max_depth.unwrap_or(integrator.max_depth),
            rr_depth: integrator.rr_depth,
            hide_emitters: integrator.hide_emitters,
            integrator: source.integrator.unwrap_or(integrator.kind),
            photons: integrator.photons,
            aovs: integrator.aovs.clone(),
            auto: None,
            effects: forced.to_vec(),
            spp: desc.samples_per_pixel.unwrap_or(DEFAULT_SPP),
            seed: source.seed,
            deterministic: false,
            replicated: true,
            adaptive: false,
            light_groups: None,
            stereo: None,
            device,
            reweighted: None,
        }
    }

    /// Options that reproduce this run on the CPU.
    pub fn source(&self, threads: Option<u16>) -> SceneOptions {
        SceneOptions {
            scene: self.scene.clone(),
            loaded: None,
            defines: self.defines.clone(),
            lenient: self.lenient,
            verbose: false,
            size: self.size,
            integrator: Some(self.integrator),
            effects: self.effects.clone(),
            max_depth: Some(self.max_depth),
            threads,
            simd: SimdKernel::best(),
            seed: self.seed,
            // A scaled filter is specified by the scene only.
            filter: Some(self.film.filter).filter(|filter| !matches!(filter, SplatFilter::Scaled(_))),
            device: Some("cpu".to_string()),
        }
    }

    /// Attributes of the picture file, independent of time, number of threads and SIMD kernel. `paths`: number of paths traced.
    pub fn attributes(&self, paths: u64, outcome: &RunEnd) -> Vec<(String, Attribute)> {
        let text = |name: &str, value: String| (name.to_string(), Attribute::Text(value));
        let mut attributes = vec![
            text("renderer", format!("pointillist {}", env!("CARGO_PKG_VERSION"))),
            text("scene", self.scene.display().to_string()),
            text("device", self.device.clone()),
            text("integrator", self.integrator.name().to_string()),
            text("command", self.command(self.first_index, paths)),
        ];
        if let Some(chosen) = &self.auto {
            attributes.push(text("auto", chosen.reason.clone()));
        }
        let off: Vec<&str> = self.left_out().collect();
        if !off.is_empty() {
            attributes.push(text("leftOut", off.join(", ")));
        }
        attributes.extend(outcome.rejected.clone().map(|rejected| text("rejected", rejected)));
        if let Some(kappa) = self.reweighted {
            let how = format!(
                "reweighted (Zirr, Hanika, Dachsbacher 2018), κ = {kappa}: the picture is biased, and less so with each sample"
            );
            attributes.push(text("fireflies", how));
        }
        attributes.extend(self.light_groups.iter().map(|groups| text(LIGHT_GROUPS, groups.clone())));
        attributes.extend(outcome.notes.iter().map(|(name, value)| text(name, value.clone())));
        if !outcome.prefix {
            let note = "the run was stopped: its paths are not exactly the first ones of the sequence, and the \
                        command gives a picture of the same error but not the same picture";
            attributes.push(text("stopped", note.to_string()));
        }
        attributes
    }

    /// Effects left out although scene and method need them.
    pub fn left_out(&self) -> impl Iterator<Item = &'static str> {
        let off = self.effects.iter().filter(|forced| !forced.on).map(|forced| forced.effect);
        off.filter(|effect| refusal(*effect, self.integrator).is_none()).map(Effect::name)
    }

    /// The eyes that its blocks carry samples of.
    pub fn eyes(&self) -> BlockEyes {
        let replicated = self.replicated;
        match (&self.stereo, &self.light_groups) {
            (None, _) => BlockEyes::One,
            (Some(_), None) => BlockEyes::Both { replicated },
            (Some(_), Some(_)) => BlockEyes::Apart { replicated },
        }
    }

    /// Command line that traces `paths` paths from `first` on identically. Threads and `--simd` are left out: they do not change a path,
    /// and another machine may not support them.
    pub fn command(&self, first: u64, paths: u64) -> String {
        let mut command = self.scene_options("render");
        if !self.aovs.is_empty() {
            let aovs: Vec<String> = self.aovs.iter().map(ToString::to_string).collect();
            command += &format!(" --aov {}", quoted(&aovs.join(",")));
        }
        if let Some(groups) = &self.light_groups {
            command += &format!(" --light-groups {}", quoted(groups));
        }
        if let Some(rig) = &self.stereo {
            let convergence = match rig.convergence {
                StereoConvergence::Parallel => "parallel".to_string(),
                StereoConvergence::OffAxis { distance } => distance.to_string(),
            };
            command += &format!(" --stereo --interocular {} --convergence {convergence}", rig.interocular);
        }
        if first > 0 {
            command += &format!(" --first-index {first}");
        }
        command += &format!(" --samples {paths}");
        if let Some(kappa) = self.reweighted {
            command += &format!(" --reweight-fireflies={kappa}");
        }
        if self.adaptive {
            command += " --adaptive";
        }
        if self.deterministic {
            command += " --deterministic";
        }
        command + " --device " + &quoted(&self.device)
    }

    /// Command line that traces the path of a rejected value again and prints its vertices.
    pub fn replay(&self, rejected: &Rejected) -> String {
        if self.adaptive {
            return "with --adaptive a path cannot be traced by itself: render without, and replay what is rejected there".to_string();
        }
        if self.stereo.is_some() {
            return "with --stereo indices are those of two eyes: render without, and replay what is rejected there".to_string();
        }
        let mut command = self.scene_options("replay") + &format!(" --index {}", rejected.index);
        if let Some(generations) = rejected.generations.filter(|_| self.integrator.has_photons()) {
            command += &format!(" --generations {generations}");
        }
        if let Some(number) = rejected.light_path {
            command += &format!(" --light-path {number}");
        }
        command
    }

    /// Part of a command line that determines the path of each index.
    fn scene_options(&self, subcommand: &str) -> String {
        let mut command = format!("pointillist {subcommand} {}", quoted(&self.scene.display().to_string()));
        for (name, value) in &self.defines {
            command += &format!(" -D {}", quoted(&format!("{name}={value}")));
        }
        if self.lenient {
            command += " --lenient";
        }
        if let Some((width, height)) = self.size {
            command += &format!(" --size {width}x{height}");
        }
        command += &format!(" --integrator {}", self.integrator.name());
        if !self.effects.is_empty() {
            let effects: Vec<String> = self.effects.iter().map(ToString::to_string).collect();
            command += &format!(" --effects {}", effects.join(","));
        }
        let depth = self.max_depth.map_or("-1".to_string(), |d| d.to_string());
        // A scaled filter is specified by the scene only: there is no option for it.
        let filter = match self.film.filter {
            SplatFilter::Scaled(_) => String::new(),
            named => format!(" --filter {}", named.name()),
        };
        command += &format!(" --seed {} --max-depth {depth}{filter}", self.seed);
        if !self.replicated {
            command += " --replicates 1";
        }
        command
    }
}

/// A size in pixels as the film's filters store it, in thousandths.
fn thousandths(size: f64) -> u16 {
    (1000.0 * size).round().clamp(1.0, f64::from(u16::MAX)) as u16
}

/// Form of variance that a film needs for these settings.
pub fn shown_variance(settings: &Settings) -> Option<VarianceForm> {
    Effects::new(settings, 1).reads_variance().then_some(VarianceForm::Product)
}

/// Display settings as command-line options.
pub fn display_options(s: &Settings) -> String {
    let mut options = format!(
        "--reconstruct {} --vm {} --exposure {} --contrast {} --gamma {} --profile {}",
        s.reconstruction.name(),
        s.vm,
        s.exposure,
        s.contrast,
        s.gamma,
        quoted(&s.profile.name)
    );
    // Options with default values are left out.
    if s.kernel != ReconstructionKernel::default() {
        let exponent = match s.kernel.exponent {
            0 => "none".to_string(),
            exponent => exponent.to_string(),
        };
        options += &format!(" --kernel {},{exponent}", s.kernel.radius());
    }
    let default = Settings::default();
    let mut add = |option: &str, value: String, usual: bool| {
        if !usual {
            options += &format!(" --{option} {value}");
        }
    };
    add("masking", s.masking.name(), s.masking == default.masking);
    let filter = s.adaptive_filter;
    add("adaptive-filter", filter.name(), filter == default.adaptive_filter);
    add("denoise", s.denoise.name(), s.denoise == default.denoise);
    add("show", s.view.name(), s.view == default.view);
    add("curve", s.curve.name(), s.curve == default.curve);
    add("dither", s.dither.name(), s.dither == default.dither);
    if let Some(glare) = s.glare {
        options += &format!(" --glare {} --view-angle {}", glare.adaptation.name(), glare.view_angle);
    }
    options + &s.post.options()
}

/// Quotes `text` for a shell: in single quotes unless it is plain.
pub fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=+,:@%".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        return text.to_string();
    }
    format!("'{}'", text.replace('\'', r"'\''"))
}

/// The option of `pointillist mix` that sets these factors.
pub fn mix_option(name: &str, [r, g, b]: MixRgb) -> String {
    let factors = if r == g && g == b { r.to_string() } else { format!("{r},{g},{b}") };
    format!("--set {}", quoted(&format!("{name}={factors}")))
}

#[cfg(test)]
mod tests {
    use super::quoted;

    #[test]
    fn only_what_must_be_is_quoted() {
        assert_eq!(quoted("scenes/cornell.xml"), "scenes/cornell.xml");
        assert_eq!(quoted("a b"), "'a b'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
    }
}
