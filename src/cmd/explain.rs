//! `pointillist explain`: which effects a scene and these options need, why, and what each costs.
//!
//! The plan is printed as soon as the scene is loaded. Measurements follow: machines and time ([`budget`]), and the prices of effects, each
//! as soon as it is known ([`effect_price`] for the tracer's, [`client_price`] for the client's).

mod budget;
mod client_price;
mod price_list;

use std::io::IsTerminal;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use miette::Result;
use serde::Serialize;

use self::budget::Budget;
pub use self::budget::farm_cost;
use self::client_price::{ClientFrames, charge_filter, is_yardstick};
use self::price_list::PriceList;
use crate::client::memory::{FilmContents, film_memory};
use crate::client::{FilmSpec, Settings};
use crate::cmd::args::ExplainArgs;
use crate::cmd::bench::{BenchJob, measure};
use crate::gpu::Inventory;
use crate::render::device::Device;
use crate::render::effect_plan::{EffectSide, PlannedEffect, plan};
use crate::render::figures::{Seconds, check_json, print, write_json};
use crate::render::load::{self, Opened};
use crate::render::run_spec::{RunSpec, shown_variance};
use crate::render::warnings::{tell_notices, tell_warnings};
use crate::render::{effect_price, method, process};
use crate::study::ErrorTarget;

/// Number of frames whose passes are timed, and the time limit.
const FRAMES: u32 = 24;
const FRAMES_AT_MOST: Duration = Duration::from_secs(3);

/// Columns available on every terminal.
const COLUMNS: usize = 80;

/// Contents of the `--json` file. Field names are JSON keys.
#[derive(Debug, Serialize)]
struct Explained<'a> {
    version: &'static str,
    scene: &'a Path,
    integrator: &'static str,
    /// Reason for the method, if the choice was automatic.
    #[serde(skip_serializing_if = "Option::is_none")]
    auto: Option<&'a str>,
    /// The device whose passes are timed.
    device: &'a str,
    /// Effects with their costs, as far as measured.
    plan: &'a [PlannedEffect],
    /// Bytes of every image and buffer of the film on a Vulkan device, computed from its specification.
    film_memory: &'a [(String, u64)],
    /// Bytes of every image and buffer on the device; with `--prices`.
    #[serde(skip_serializing_if = "Option::is_none")]
    memory: Option<Vec<(String, u64)>>,
    /// Pipelines, by shader and specialization; with `--prices`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pipelines: Option<Vec<String>>,
    /// Machines and time to an error target; with `--error`.
    #[serde(skip_serializing_if = "Option::is_none")]
    budget: Option<&'a Budget>,
}

/// Runs the subcommand.
pub fn explain(args: &ExplainArgs) -> Result<()> {
    check_json(args.json.as_deref(), &args.source.scene)?;
    process::listen_for_interrupt();
    let mut seconds = Seconds::default();
    let Opened { input, scene, camera, device } = load::open(&args.source, &mut seconds)?;
    tell_warnings(&input.loaded.warnings, &args.source);
    tell_notices(scene.notices(), &args.source);
    let mut run = input.run(&args.source, device.name());
    let (scene, threads) = (Arc::new(scene), args.source.threads());
    method::choose(&mut run, &scene, &camera, threads);
    method::tell_choice(&run);
    let settings = args.display.settings();
    run.film.variance = shown_variance(&settings);
    let mut plan = plan(&input.loaded.desc, &run, &settings);
    let atlas = matches!(&device, Device::Vulkan(gpu) if !gpu.fetches_any_level());
    let contents = FilmContents { streams: run.integrator.streams(), samples: usize::MAX, eyes: 1 };
    let film_memory = film_memory(&run.film, &settings, contents, atlas);
    let silent = args.json.as_deref() == Some(Path::new("-"));
    let say = |words: &str| silent || print(words, "the plan");
    let columns = std::io::stdout().is_terminal().then_some(COLUMNS);
    let unknown =
        if args.prices { "" } else { "PRICES            --prices measures what each effect costs\n" };
    say(&(table(&plan, &run, columns) + &memory_words(&film_memory, &run.film) + unknown));
    let budget = args.error.map(|error| {
        let setup = seconds.load + seconds.prepare;
        let subject = budget::TrialSubject { run: &run, scene: &scene, camera: &camera, threads, setup };
        Budget::measure(&subject, ErrorTarget { error, at: args.error_at }, args.trial)
    });
    let budget = budget.transpose()?;
    say(&budget.as_ref().map(Budget::words).unwrap_or_default());
    let inventory = if args.prices {
        let subject =
            effect_price::Subject { desc: &input.loaded.desc, scene: &scene, camera: &camera, run: &run };
        charge(&mut plan, subject, &settings, &device, args)?
    } else {
        None
    };
    let of_picture = |(name, _): &(String, u64)| !is_yardstick(name);
    let memory = |from: &Inventory| from.memory.iter().filter(|m| of_picture(m)).cloned().collect();
    let explained = Explained {
        version: env!("CARGO_PKG_VERSION"),
        scene: &run.scene,
        integrator: run.integrator.name(),
        auto: run.auto.as_ref().map(|a| a.reason.as_str()),
        device: &run.device,
        plan: &plan,
        film_memory: &film_memory,
        memory: inventory.as_ref().map(memory),
        pipelines: inventory.map(|inventory| inventory.pipelines),
        budget: budget.as_ref(),
    };
    args.json.as_deref().map_or(Ok(()), |path| write_json(&explained, path))
}

/// Measures and prints the cost of each effect. Returns the resources on the device, if it got that far.
fn charge(
    plan: &mut [PlannedEffect],
    subject: effect_price::Subject<'_>,
    settings: &Settings,
    device: &Device,
    args: &ExplainArgs,
) -> Result<Option<Inventory>> {
    let effect_price::Subject { scene, camera, run, .. } = subject;
    let frames = ClientFrames::new(settings, run.integrator);
    let traced = plan.iter().filter(|entry| entry.effect.is_some()).count();
    let shown = if matches!(device, Device::Vulkan(_)) { frames.steps(plan) } else { 0 };
    // Plus one for the noise filter.
    let list = PriceList::new(traced + 1 + shown, args.json.as_deref());
    list.title(EffectSide::Tracer);
    list.begin("preparing");
    let mut timer = effect_price::EffectTimer::new(subject, effect_price::THOROUGH);
    for entry in plan.iter_mut().filter(|entry| entry.effect.is_some()) {
        if list.is_over() {
            break;
        }
        list.begin(entry.name);
        match timer.charge(entry) {
            Ok(()) => list.priced(entry),
            Err(error) => list.print(&format!("  {:<21}cannot be measured: {error}\n", entry.name)),
        }
        list.done();
    }
    list.without_price("can neither be left out here nor added as a small example");
    let mut inventory = None;
    if !list.is_over() {
        list.title(EffectSide::Client);
        charge_filter(plan, &list, scene, camera, &run.film);
        if let Device::Vulkan(gpu) = device {
            inventory = frames.charge(plan, &list, |settings, integrator| {
                let film = FilmSpec { variance: shown_variance(settings), ..run.film };
                let run = RunSpec { integrator, film, ..run.clone() };
                let (scene, camera) = (scene.clone(), camera.clone());
                let (threads, frames, at_most) = (args.source.threads(), FRAMES, FRAMES_AT_MOST);
                let job = BenchJob {
                    gpu,
                    run: &run,
                    scene,
                    camera,
                    right_eye: None,
                    threads,
                    settings,
                    frames,
                    at_most,
                };
                measure(job, None)
            })?;
            list.without_price("no pass or memory of their own");
        } else {
            list.print("  (the others are measured on a Vulkan device)\n");
        }
    }
    if process::is_interrupted() {
        list.print("  stopped by Ctrl-C: the rest was not measured\n");
    }
    Ok(inventory)
}

/// Total device memory of the film, with or without a device.
fn memory_words(memory: &[(String, u64)], film: &FilmSpec) -> String {
    let bytes: u64 = memory.iter().map(|(_, bytes)| bytes).sum();
    let pixels = u64::from(film.width) * u64::from(film.height);
    format!(
        "DEVICE MEMORY     {:.1} MB in images and buffers of the film, {} bytes per pixel\n",
        bytes as f64 * 1e-6,
        bytes / pixels.max(1)
    )
}

/// One line per effect, the tracer's first; wrapped if `columns` is given.
fn table(plan: &[PlannedEffect], run: &RunSpec, columns: Option<usize>) -> String {
    let (film, folder) = (&run.film, run.scene.parent().unwrap_or(Path::new("")));
    let mut out = format!(
        "{}: {}×{} pixels, {}, {}\n",
        run.scene.display(),
        film.width,
        film.height,
        run.integrator.name(),
        run.device
    );
    for (side, title) in [
        (EffectSide::Tracer, "TRACER            on   why (object of the scene)\n"),
        (EffectSide::Client, "CLIENT            on   why\n"),
    ] {
        out += title;
        for entry in plan.iter().filter(|e| e.side == side) {
            let on = if entry.on { "yes" } else { "–" };
            let place = entry.place.as_deref().map(|place| {
                let near = Path::new(place).strip_prefix(folder).unwrap_or(Path::new(place));
                format!(" ({})", near.display())
            });
            let why = format!("{}{}", entry.reason, place.unwrap_or_default());
            let start = format!("  {:<16}{on:<5}", entry.name);
            out += &wrapped(&start, &why, columns.unwrap_or(usize::MAX));
        }
    }
    out
}

/// `start` followed by `words`, wrapped to this many columns, with the words aligned.
fn wrapped(start: &str, words: &str, columns: usize) -> String {
    let indent = start.chars().count();
    let (mut out, mut column) = (start.to_owned(), indent);
    for (i, word) in words.split(' ').enumerate() {
        let length = word.chars().count();
        if i > 0 && column + 1 + length > columns {
            out += &format!("\n{:indent$}{word}", "");
            column = indent + length;
        } else {
            let space = if i > 0 { " " } else { "" };
            out += &format!("{space}{word}");
            column += space.len() + length;
        }
    }
    out + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_reasons_go_on_below_themselves() {
        let start = "  glossy          yes  ";
        let text = wrapped(start, "roughplastic is rough (5 more like it) (scene.xml:148:3)", 64);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(
            lines,
            [
                "  glossy          yes  roughplastic is rough (5 more like it)",
                "                       (scene.xml:148:3)"
            ]
        );
        assert_eq!(wrapped(start, "a b", usize::MAX), format!("{start}a b\n"));
    }
}
