//! `pointillist explain`: which effects a scene and these options call for, why, and what each costs.
//!
//! [`price`] measures the tracer's effects, `charge_client` those of the client.

mod budget;
pub mod price;

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use miette::Result;
use serde::Serialize;

use self::budget::Budget;
pub use self::budget::farm_cost;
use super::args::ExplainArgs;
use super::bench::{BenchJob, PassTimes, measure};
use super::denoise::ViewFilter;
use super::device::Device;
use super::filtered_picture::{FilteredPicture, HalfMeans};
use super::load::{self, Opened};
use super::plan::{EffectSide, PlannedEffect, plan, streams};
use super::report::{Seconds, check_json, publish};
use super::run_spec::{RunSpec, shown_variance};
use super::{method, process};
use crate::client::effect_list::ClientEffect;
use crate::client::memory::film_memory;
use crate::client::{Denoise, FilmSpec, Settings};
use crate::color::Xyz;
use crate::gpu::Inventory;
use crate::scene::desc::IntegratorKind;
use crate::stream::{CHUNK, PathCounts, Sample};
use crate::study::{ErrorTarget, Replicates};
use crate::tracer::{Camera, Scene};

/// Frames whose passes are timed.
const FRAMES: u32 = 24;

/// Pictures that are filtered, to measure it.
const FILTERED: usize = 7;

/// What `--json` writes. The names of the fields are the keys in JSON.
#[derive(Debug, Serialize)]
struct Explained<'a> {
    version: &'static str,
    scene: &'a Path,
    integrator: &'static str,
    /// The reason for the method, if the program chose it.
    #[serde(skip_serializing_if = "Option::is_none")]
    auto: Option<&'a str>,
    /// The device on which the passes were timed.
    device: &'a str,
    plan: &'a [PlannedEffect],
    /// Bytes of every image and buffer that a Vulkan device takes for the film, computed from its specification.
    film_memory: &'a [(String, u64)],
    /// Bytes of every image and buffer on the device.
    #[serde(skip_serializing_if = "Option::is_none")]
    memory: Option<Vec<(String, u64)>>,
    /// Pipelines, by shader and what it is specialised for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pipelines: Option<Vec<String>>,
    /// Machines and time to an error.
    #[serde(skip_serializing_if = "Option::is_none")]
    budget: Option<&'a Budget>,
}

/// Runs the subcommand.
pub fn explain(args: &ExplainArgs) -> Result<()> {
    check_json(args.json.as_deref(), &args.source.scene)?;
    process::listen_for_interrupt();
    let mut seconds = Seconds::default();
    let Opened { input, scene, camera, device } = load::open(&args.source, &mut seconds)?;
    let loaded = &input.loaded;
    load::tell_warnings(loaded);
    let mut run = RunSpec::of(&args.source, &input, device.name());
    let (scene, threads) = (Arc::new(scene), args.source.threads());
    method::choose(&mut run, &scene, &camera, threads);
    method::tell_choice(&run);
    let settings = args.display.settings();
    run.film.variance = shown_variance(&settings);
    let mut plan = plan(&loaded.desc, &run, &settings);
    let atlas = matches!(&device, Device::Vulkan(gpu) if !gpu.fetches_any_level());
    let film_memory = film_memory(&run.film, &settings, streams(run.integrator), usize::MAX, atlas);
    let (mut memory, mut pipelines) = (None, None);
    if !args.no_costs {
        let subject = price::Subject { desc: &loaded.desc, scene: &scene, camera: &camera, run: &run };
        price::charge(&mut plan, subject, price::THOROUGH)?;
        charge_filter(&mut plan, &scene, &camera, &run.film);
        if let Device::Vulkan(gpu) = &device {
            let inventory = charge_client(&mut plan, &settings, run.integrator, |settings, integrator| {
                let film = FilmSpec { variance: shown_variance(settings), ..run.film };
                let run = RunSpec { integrator, film, ..run.clone() };
                let (scene, camera) = (scene.clone(), camera.clone());
                measure(BenchJob { gpu, run: &run, scene, camera, threads, settings, frames: FRAMES }, None)
            })?;
            let of_picture = |(name, _): &(String, u64)| !is_yardstick(name);
            memory = Some(inventory.memory.into_iter().filter(of_picture).collect());
            pipelines = Some(inventory.pipelines);
        }
    }
    let budget = args.error.map(|error| {
        let setup = seconds.load + seconds.prepare;
        let subject = budget::TrialSubject { run: &run, scene: &scene, camera: &camera, threads, setup };
        Budget::measure(&subject, ErrorTarget { error, at: args.error_at }, args.trial)
    });
    let budget = budget.transpose()?;
    let explained = Explained {
        version: env!("CARGO_PKG_VERSION"),
        scene: &run.scene,
        integrator: run.integrator.name(),
        auto: run.auto.as_ref().map(|a| a.reason.as_str()),
        device: &run.device,
        plan: &plan,
        film_memory: &film_memory,
        memory,
        pipelines,
        budget: budget.as_ref(),
    };
    let words = table(&plan)
        + &memory_words(&film_memory, &run.film)
        + &budget.as_ref().map(Budget::words).unwrap_or_default();
    publish(&words, "the plan", &explained, args.json.as_deref())
}

/// Measures time and memory of the client's effects. `measure` runs frames with these settings by this method; it is called
/// once as asked for, and once for every effect that is switched to see the difference. Returns the resources of the first
/// run.
fn charge_client(
    plan: &mut [PlannedEffect],
    settings: &Settings,
    kind: IntegratorKind,
    mut measure: impl FnMut(&Settings, IntegratorKind) -> Result<PassTimes>,
) -> Result<Inventory> {
    let base = measure(settings, kind)?;
    let all = time_of(&base, |_| true);
    for entry in plan {
        // These work on the processor.
        if ["noise-filter", "reprojection"].contains(&entry.name) {
            continue;
        }
        let Some(ClientEffect { passes, changes, images, can_switch, .. }) = entry.client else { continue };
        let other = match entry.name {
            "light-stream" if !entry.on => Some(measure(settings, IntegratorKind::Bidirectional)?),
            // The variance comes with what reads it.
            "variance" if !entry.on => Some(measure(&switched(settings, "masking", true), kind)?),
            name if can_switch && (!entry.on || !changes.is_empty()) => {
                Some(measure(&switched(settings, name, !entry.on), kind)?)
            }
            _ => None,
        };
        let [own, changed] = [passes, changes].map(|names| {
            let of = |measured| time_of(measured, |name| names.contains(&name));
            (of(&base), other.as_ref().map_or(0.0, of))
        });
        let cost = &mut entry.cost;
        let something = |ms: f64| Some(ms).filter(|ms| *ms > 0.0);
        if entry.on {
            let changed = if other.is_some() { changed.0 - changed.1 } else { 0.0 };
            cost.milliseconds = something(own.0 + changed);
            cost.share = cost.milliseconds.map(|ms| ms / all);
        } else if other.is_some() {
            cost.if_on = something(own.1 + changed.1 - changed.0);
        }
        let of_its_own = |name: &str| entry.on && images.iter().any(|image| name.starts_with(image));
        let memory = base.inventory.memory.iter().filter(|(name, _)| of_its_own(name));
        cost.bytes = Some(memory.map(|(_, bytes)| bytes).sum());
    }
    Ok(base.inventory)
}

/// Measures the noise filter, which works on the processor: a picture, and what it traces once per view.
fn charge_filter(plan: &mut [PlannedEffect], scene: &Scene, camera: &Camera, film: &FilmSpec) {
    let Some(entry) = plan.iter_mut().find(|entry| entry.name == "noise-filter") else { return };
    let milliseconds = |since: Instant| since.elapsed().as_secs_f64() * 1e3;
    let start = Instant::now();
    let Some(mut filter) = ViewFilter::new(scene, camera, film, &process::is_interrupted) else {
        return;
    };
    entry.cost.once = Some(milliseconds(start));
    let mut replicates = Replicates::new([film.width, film.height], film.filter.energy());
    for (first_index, y) in (0..2).flat_map(|half| (0..film.height).map(move |y| (half * CHUNK, y))) {
        let place = |at: u32, size: u32| (at as f32 + 0.5) / size as f32;
        let sample = |x| Sample {
            uv: [place(x, film.width), place(y, film.height)],
            xyz: Xyz { x: 1.0, y: 1.0, z: 1.0 },
            w: 1.0,
        };
        let row: Vec<_> = (0..film.width).map(sample).collect();
        replicates.add(first_index, PathCounts { camera: row.len() as u64, light: 0 }, &row);
    }
    let mut times: Vec<_> = (0..FILTERED)
        .filter_map(|_| {
            let start = Instant::now();
            let halves = HalfMeans::of(&replicates).ok()?;
            let made = FilteredPicture::of(&replicates, &halves, None, &mut filter, Denoise::Wavelet);
            made.ok().map(|_| milliseconds(start))
        })
        .collect();
    times.sort_by(f64::total_cmp);
    let median = times.get(times.len() / 2).copied();
    match entry.on {
        true => entry.cost.milliseconds = median,
        false => entry.cost.if_on = median,
    }
}

fn switched(settings: &Settings, effect: &str, on: bool) -> Settings {
    let mut settings = settings.clone();
    settings.switch(effect, on);
    settings
}

/// Median milliseconds per frame of the passes that `is` accepts, without passes inside other passes.
fn time_of(measured: &PassTimes, is: impl Fn(&str) -> bool) -> f64 {
    let median = |times: &[f64]| times.get(times.len() / 2).copied().unwrap_or(0.0);
    // The fold of the variance is part of its pass.
    let counts = |name: &str| !is_yardstick(name) && name != "variance fold" && is(name);
    measured.passes.iter().filter(|(name, _)| counts(name)).map(|(_, times)| median(times)).sum()
}

/// True for passes and images of the yardstick, which are no part of the picture.
fn is_yardstick(name: &str) -> bool {
    name.starts_with("copy")
}

/// The device memory of the film in all, whether or not there is a device.
fn memory_words(memory: &[(String, u64)], film: &FilmSpec) -> String {
    let bytes: u64 = memory.iter().map(|(_, bytes)| bytes).sum();
    let pixels = u64::from(film.width) * u64::from(film.height);
    format!(
        "DEVICE MEMORY     {:.1} MB in images and buffers of the film, {} bytes per pixel\n",
        bytes as f64 * 1e-6,
        bytes / pixels.max(1)
    )
}

/// One line for each effect, the tracer's first.
fn table(plan: &[PlannedEffect]) -> String {
    let mut out = String::new();
    for (side, title) in [
        (
            EffectSide::Tracer,
            "TRACER            on   cost: share of a path's time; × is its time with a small example of what is off",
        ),
        (
            EffectSide::Client,
            "CLIENT            on   cost: share of device time, per frame, device memory of its own",
        ),
    ] {
        let entries = || plan.iter().filter(|e| e.side == side);
        let width = entries().map(|e| cost(e).chars().count()).max().unwrap_or(0);
        out += &format!("{title}\n");
        for entry in entries() {
            let on = if entry.on { "yes" } else { "–" };
            let place = entry.place.as_ref().map_or(String::new(), |place| format!("  ({place})"));
            let (name, cost, reason) = (entry.name, cost(entry), &entry.reason);
            out += &format!("  {name:<16}{on:<5}{cost:<width$}  {reason}{place}\n");
        }
    }
    if plan.iter().all(|e| e.cost.bytes.is_none()) {
        out += "  (the client's costs are measured on a Vulkan device)\n";
    }
    out
}

fn cost(entry: &PlannedEffect) -> String {
    let cost = &entry.cost;
    let share = cost.share.map(|s| format!("{:5.1} %", 100.0 * s));
    let ms = cost.milliseconds.map(|ms| format!("{ms:.2} ms"));
    let bytes = cost.bytes.filter(|b| *b > 0).map(|b| format!("{:.1} MB", b as f64 * 1e-6));
    let if_on = cost.if_on.map(|ms| format!("would take {ms:.2} ms"));
    let once = cost.once.map(|ms| format!("and {ms:.0} ms once per view"));
    let if_on_share = cost.if_on_share.map(|s| format!("with it ×{:.2}", 1.0 + s));
    [share, ms, bytes, if_on, once, if_on_share].into_iter().flatten().collect::<Vec<_>>().join("  ")
}
