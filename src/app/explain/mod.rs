//! `pointillist explain`: what a scene and these options call for, effect by effect, why, and what it costs.

mod cost;
mod price;
mod table;

use std::path::Path;
use std::sync::Arc;

use miette::{IntoDiagnostic, Result};
use serde::Serialize;

use super::args::ExplainArgs;
use super::bench::{as_render, measure};
use super::device::Device;
use super::plan::{Entry, plan};
use super::render::{facts, prepare, threads};
use super::report::{Seconds, is_special, write_json};
use super::{auto, interrupt, method, tell};
use crate::client::{Glare, Settings};
use crate::image::write::{check_place, destination};

/// Frames whose passes are timed.
const FRAMES: u32 = 24;

/// What `--json` writes. Field names are JSON keys.
#[derive(Debug, Serialize)]
struct Explained<'a> {
    version: &'static str,
    scene: &'a Path,
    integrator: &'static str,
    /// Why, where the program chose it.
    #[serde(skip_serializing_if = "Option::is_none")]
    auto: Option<&'a str>,
    /// Where passes were timed.
    device: &'a str,
    plan: &'a [Entry],
    /// Images and buffers on the device, bytes.
    #[serde(skip_serializing_if = "Option::is_none")]
    memory: Option<Vec<(String, u64)>>,
    /// Pipelines, by shader and what it is specialised for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pipelines: Option<Vec<String>>,
}

/// Runs the subcommand.
///
/// # Errors
///
/// Whatever stops the run: the scene, the device, the place of `--json`.
pub fn explain(args: &ExplainArgs) -> Result<()> {
    if let Some(json) = args.json.as_ref().filter(|p| !is_special(p)) {
        check_place(json).into_diagnostic()?;
        if destination(json).ok() == destination(&args.source.scene).ok() {
            return Err(miette::miette!("--json {} would overwrite the scene", json.display()));
        }
    }
    interrupt::listen();
    let like = as_render(&args.source, &args.display);
    let (loaded, (scene, camera), device) = prepare(&like, &mut Seconds::default())?;
    for warning in &loaded.warnings {
        tell(&format!("{:?}", miette::Report::new(warning.clone())));
    }
    let mut facts = facts(&like, &loaded, device.name());
    let (scene, threads) = (Arc::new(scene), threads(&like));
    auto::settle(&mut facts, &scene, &camera, threads);
    auto::say(&facts);
    let settings = args.display.settings();
    let mut plan = plan(&loaded.desc, &facts, &settings);
    let (mut memory, mut pipelines) = (None, None);
    if !args.no_costs {
        let on: Vec<_> = plan.iter().filter(|e| e.on).filter_map(|e| e.feature).collect();
        for (feature, share) in price::shares(&loaded.desc, (&scene, &camera), &facts, &on)? {
            plan.iter_mut().filter(|e| e.feature == Some(feature)).for_each(|e| e.cost.share = share);
        }
        if let Device::Vulkan(gpu) = &device {
            let job = (&facts, (scene, camera), threads);
            let measured = measure(gpu, job.clone(), (&settings, FRAMES))?;
            let inventory = measured.inventory.clone();
            let would = measure(gpu, job, (&everything(&settings), FRAMES))?;
            cost::charge(&mut plan, &measured, &would);
            let of_picture = |(name, _): &(String, u64)| !cost::is_yardstick(name);
            memory = Some(inventory.memory.into_iter().filter(of_picture).collect());
            pipelines = Some(inventory.pipelines);
        }
    }
    if args.json.as_deref() != Some("-".as_ref()) {
        print(&table::table(&plan));
    }
    if let Some(path) = &args.json {
        let explained = Explained {
            version: env!("CARGO_PKG_VERSION"),
            scene: &facts.scene,
            integrator: method::name(facts.integrator),
            auto: facts.auto.as_ref().map(|a| a.reason.as_str()),
            device: &facts.device,
            plan: &plan,
            memory,
            pipelines,
        };
        write_json(&explained, path)?;
    }
    Ok(())
}

/// These settings with every effect on that was off.
fn everything(settings: &Settings) -> Settings {
    let mut all = settings.clone();
    if all.vm == 0.0 {
        all.vm = 1.0;
    }
    all.glare = all.glare.or_else(|| Some(Glare::default()));
    all
}

/// Nobody may be reading any more: that is no error.
fn print(text: &str) {
    use std::io::Write;
    if std::io::stdout().write_all(text.as_bytes()).is_err() {
        tell("nobody reads the plan");
    }
}
