//! `pointillist explain`: what a scene and these options call for, effect by effect, why, and what it costs.

mod cost;
pub mod price;
mod table;

use std::path::Path;
use std::sync::Arc;

use miette::Result;
use serde::Serialize;

use super::args::ExplainArgs;
use super::bench::measure;
use super::device::Device;
use super::load::{self, Opened};
use super::plan::{PlannedEffect, plan};
use super::report::{Seconds, check_json, print, write_json};
use super::run_spec::RunSpec;
use super::{method, process};
use crate::client::effects::Effects;
use crate::client::{FilmSpec, Settings, VarianceForm};

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
    plan: &'a [PlannedEffect],
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
    check_json(args.json.as_deref(), &args.source.scene)?;
    process::listen_for_interrupt();
    let Opened { input, scene, camera, device } = load::open(&args.source, &mut Seconds::default())?;
    let loaded = &input.loaded;
    load::tell_warnings(loaded);
    let mut run = RunSpec::of(&args.source, &input, device.name());
    let (scene, threads) = (Arc::new(scene), args.source.threads());
    method::choose(&mut run, &scene, &camera, threads);
    method::tell_choice(&run);
    let settings = args.display.settings();
    run.film.variance = variance(&settings);
    let mut plan = plan(&loaded.desc, &run, &settings);
    let (mut memory, mut pipelines) = (None, None);
    if !args.no_costs {
        price::charge(&mut plan, &loaded.desc, (&scene, &camera), (&run, price::THOROUGH))?;
        if let Device::Vulkan(gpu) = &device {
            let inventory = cost::charge(&mut plan, (&settings, run.integrator), |settings, integrator| {
                let film = FilmSpec { variance: variance(settings), ..run.film };
                let run = RunSpec { integrator, film, ..run.clone() };
                measure(gpu, (&run, (scene.clone(), camera.clone()), threads), (settings, FRAMES))
            })?;
            let of_picture = |(name, _): &(String, u64)| !cost::is_yardstick(name);
            memory = Some(inventory.memory.into_iter().filter(of_picture).collect());
            pipelines = Some(inventory.pipelines);
        }
    }
    if args.json.as_deref() != Some("-".as_ref()) {
        print(&table::table(&plan), "the plan");
    }
    if let Some(path) = &args.json {
        let explained = Explained {
            version: env!("CARGO_PKG_VERSION"),
            scene: &run.scene,
            integrator: run.integrator.name(),
            auto: run.auto.as_ref().map(|a| a.reason.as_str()),
            device: &run.device,
            plan: &plan,
            memory,
            pipelines,
        };
        write_json(&explained, path)?;
    }
    Ok(())
}

/// As `render` has it for a picture without further layers.
fn variance(settings: &Settings) -> Option<VarianceForm> {
    Effects::new(settings, 1).reads_variance().then_some(VarianceForm::Product)
}
