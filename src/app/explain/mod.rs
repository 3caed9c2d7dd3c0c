//! `pointillist explain`: what a scene and these options call for, effect by effect, why, and what it costs.

mod cost;
pub mod price;
mod table;

use std::path::Path;
use std::sync::Arc;

use miette::Result;
use serde::Serialize;

use super::args::ExplainArgs;
use super::bench::{as_render, measure};
use super::device::Device;
use super::plan::{Entry, plan};
use super::render::{prepare, run_spec, threads};
use super::report::{Seconds, check_json, print, write_json};
use super::run_spec::RunSpec;
use super::{auto, interrupt, method, tell};
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
    check_json(args.json.as_deref(), &args.source.scene)?;
    interrupt::listen();
    let like = as_render(&args.source, &args.display);
    let (input, (scene, camera), device) = prepare(&like, &mut Seconds::default())?;
    let loaded = &input.loaded;
    for warning in &loaded.warnings {
        tell(&format!("{:?}", miette::Report::new(warning.clone())));
    }
    let mut run = run_spec(&like, &input, device.name());
    let (scene, threads) = (Arc::new(scene), threads(&like));
    auto::settle(&mut run, &scene, &camera, threads);
    auto::say(&run);
    let settings = args.display.settings();
    run.spec.variance = variance(&settings);
    let mut plan = plan(&loaded.desc, &run, &settings);
    let (mut memory, mut pipelines) = (None, None);
    if !args.no_costs {
        price::charge(&mut plan, &loaded.desc, (&scene, &camera), (&run, price::THOROUGH))?;
        if let Device::Vulkan(gpu) = &device {
            let inventory = cost::charge(&mut plan, (&settings, run.integrator), |settings, integrator| {
                let spec = FilmSpec { variance: variance(settings), ..run.spec };
                let run = RunSpec { integrator, spec, ..run.clone() };
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
            integrator: method::name(run.integrator),
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
