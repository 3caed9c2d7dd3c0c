//! Part 4: GPU cost of each display setting, and its effect on the picture.

use std::time::{Duration, Instant};

use miette::Result;

use crate::client::settings::OptionNames;
use crate::client::{
    AdaptiveFilter, FilmSpec, Glare, Masking, Reconstruction, ReconstructionKernel, Settings, SplatFilter,
    Summation, VarianceForm,
};
use crate::cmd::bench::{self, BenchJob};
use crate::cmd::study::converge;
use crate::cmd::study::folder::StudyFolder;
use crate::cmd::study::pictures::{difference, linear};
use crate::cmd::study::renderer::{RenderLimit, StudyRenderer};
use crate::cmd::study::session::{StudySession, TimeBudget};
use crate::image::compare::rel_mse;
use crate::render::process;
use crate::render::run_spec::RunSpec;
use crate::study::Interval;
use crate::study::data::DisplayPrice;
use crate::study::measurement::Measurement;

/// Samples per pixel of the judged pictures: the paper's Figure 2, and a higher one.
const SAMPLES: [f64; 2] = [0.1, 4.0];

/// Number of frames whose passes are timed.
const FRAMES: u32 = 16;

/// Radii and windows of the reconstruction, `(name, 2R, E)`: the paper's values, then R and E varied.
const KERNELS: [(&str, u32, u32); 7] = [
    ("R = 2.5, E = 8", 5, 8),
    ("R = 1.5, E = 8", 3, 8),
    ("R = 3.5, E = 8", 7, 8),
    ("R = 2.5, E = 2", 5, 2),
    ("R = 2.5, E = 32", 5, 32),
    ("R = 2.5, cut off", 5, 0),
    ("R = 1.5, cut off", 3, 0),
];

/// Passes of a batch of samples; all others belong to a repaint.
const BATCH: [&str; 3] = ["splat", "fold", "variance"];

/// One value of a setting: complete display settings and film, and its price, initially unmeasured.
struct DisplaySetting {
    settings: Settings,
    spec: FilmSpec,
    price: DisplayPrice,
}

pub fn display(session: &mut StudySession, budget: &TimeBudget) -> Result<()> {
    let run = session.chosen();
    let StudySession { renderer, folder, judge, .. } = session;
    let Some(reference) = judge.shown(renderer).cloned() else { return Ok(()) };
    // Longest measurement so far, which decides whether there is time for another.
    let mut longest = 0.0f64;
    let speed = converge::speed(folder, run.integrator);
    for samples in SAMPLES {
        let paths = (samples * renderer.texels()).round() as u64;
        let mut film = None;
        for setting in settings(renderer) {
            let same = |p: &DisplayPrice| setting.is_of(p) && p.samples_per_pixel == samples;
            if folder.has(|m| matches!(m, Measurement::Display(price) if same(price))) {
                continue;
            }
            let start = Instant::now();
            // A picture of more samples takes longer.
            let traced = if speed > 0.0 { paths as f64 / speed } else { 4e-6 * paths as f64 };
            let expected = longest.max(if film == Some(setting.spec) { 0.1 } else { 1.0 + traced });
            if process::is_interrupted() || budget.left() < expected {
                return Ok(());
            }
            let run = RunSpec { film: setting.spec, ..run.clone() };
            // Settings that need the variance, and splat filters, need another film.
            if film != Some(setting.spec) {
                if renderer.trace(&run, RenderLimit::Paths(paths))?.driven.interrupted {
                    return Ok(());
                }
                film = Some(setting.spec);
            }
            let DisplayPrice { knob, setting: name, .. } = &setting.price;
            budget.say(&format!("{knob} {name} at {samples} samples per pixel"));
            let shown = linear(&renderer.show(&setting.settings)?, &setting.settings);
            let milliseconds = match samples == SAMPLES[0] {
                true => time(renderer, &run, &setting)?,
                false => earlier(folder, &setting),
            };
            folder.keep(Measurement::Display(DisplayPrice {
                milliseconds,
                rel_mse: rel_mse(&shown, &reference).ok().map(|error| error.whole),
                flip: Some(difference(&shown, &reference).0),
                samples_per_pixel: samples,
                ..setting.price
            }))?;
            longest = longest.max(start.elapsed().as_secs_f64());
        }
    }
    Ok(())
}

/// Whether the last setting was judged at the last number of samples.
pub fn is_complete(folder: &StudyFolder) -> bool {
    let last = |price: &DisplayPrice| price.setting == "box" && price.samples_per_pixel == SAMPLES[1];
    folder.has(|m| matches!(m, Measurement::Display(price) if last(price)))
}

/// All settings; each differs from the defaults in one value.
fn settings(renderer: &StudyRenderer) -> Vec<DisplaySetting> {
    let usual = Settings { vm: 0.0, ..renderer.settings.before_glare() };
    let plain = FilmSpec { variance: None, ..renderer.run.film };
    let varied = FilmSpec { variance: Some(VarianceForm::Product), ..plain };
    let mut all = Vec::new();
    let mut add = |knob: &str, name: &str, settings: &Settings, spec: FilmSpec, default| {
        let per_sample = matches!(knob, "filter" | "variance" | "sums");
        let [knob, setting] = [knob, name].map(str::to_string);
        let price = DisplayPrice { knob, setting, default, per_sample, ..DisplayPrice::default() };
        all.push(DisplaySetting { settings: settings.clone(), spec, price });
    };
    for (name, reconstruction) in [
        ("windowed Gaussian", Reconstruction::Gaussian),
        ("Catmull–Rom", Reconstruction::CatmullRom),
        ("mips", Reconstruction::Mipmap),
        ("none", Reconstruction::None),
    ] {
        let settings = Settings { reconstruction, ..usual.clone() };
        add("reconstruction", name, &settings, plain, reconstruction == usual.reconstruction);
    }
    for (name, taps, exponent) in KERNELS {
        let settings = Settings {
            reconstruction: Reconstruction::Gaussian,
            kernel: ReconstructionKernel { taps, exponent },
            ..usual.clone()
        };
        add("kernel", name, &settings, plain, settings == usual);
    }
    add("sums", "two floats", &usual, plain, true);
    let one = FilmSpec { sums: Summation::Plain, ..plain };
    add("sums", "one float", &usual, one, false);
    add("variance", "not kept", &usual, plain, true);
    let glare = Settings { glare: Some(Glare::default()), ..usual.clone() };
    add("glare", "photopic", &glare, plain, false);
    add("variance", "kept", &usual, varied, false);
    for (name, masking) in [("low-pass", Masking::LowPass), ("bilateral", Masking::Bilateral)] {
        add("masking", name, &Settings { vm: 1.0, masking, ..usual.clone() }, varied, false);
    }
    // Without light samples there is nothing to filter.
    let filters = [AdaptiveFilter::Off, AdaptiveFilter::Light];
    for filter in filters.into_iter().filter(|_| renderer.run.integrator.streams()[1]) {
        let settings = Settings { adaptive_filter: filter, ..usual.clone() };
        add("adaptive filter", &filter.name(), &settings, plain, settings == usual);
    }
    for (name, filter) in [
        ("Gaussian, 5×5 texels", SplatFilter::Gaussian),
        ("tent", SplatFilter::Tent),
        ("box", SplatFilter::Box),
    ] {
        add("filter", name, &usual, FilmSpec { filter, ..plain }, filter == SplatFilter::default());
    }
    all
}

/// GPU milliseconds per repaint or per million samples; `None` without a device with timestamps.
fn time(renderer: &StudyRenderer, run: &RunSpec, setting: &DisplaySetting) -> Result<Option<Interval>> {
    let Some(gpu) = renderer.device.gpu() else { return Ok(None) };
    let run = RunSpec { film: setting.spec, ..run.clone() };
    let job = BenchJob {
        gpu,
        run: &run,
        scene: renderer.scene.clone(),
        camera: renderer.camera.clone(),
        right_eye: None,
        threads: renderer.threads,
        settings: &setting.settings,
        frames: FRAMES,
        at_most: Duration::MAX,
    };
    let measured = bench::measure(job, None)?;
    let wanted = |name: &&str| *name != "copy" && BATCH.contains(name) == setting.price.per_sample;
    let mut frames = vec![0.0; measured.frames.len()];
    for (_, times) in measured.passes.iter().filter(|(name, _)| wanted(name)) {
        frames.iter_mut().zip(times).for_each(|(frame, time)| *frame += time);
    }
    let scale = match setting.price.per_sample {
        true => 1e6 * frames.len() as f64 / (measured.samples as f64).max(1.0),
        false => 1.0,
    };
    Ok(Interval::of_median(&frames).map(|mean| mean.map(|ms| ms * scale)))
}

impl DisplaySetting {
    /// Whether a price belongs to this setting.
    fn is_of(&self, price: &DisplayPrice) -> bool {
        (&price.knob, &price.setting) == (&self.price.knob, &self.price.setting)
    }
}

/// Time measured at the first number of samples.
fn earlier(folder: &StudyFolder, setting: &DisplaySetting) -> Option<Interval> {
    folder.measurements.iter().rev().find_map(|measured| match measured {
        Measurement::Display(price) if setting.is_of(price) => price.milliseconds,
        _ => None,
    })
}
