//! `pointillist render`: a scene file becomes pictures.

use std::sync::Arc;
use std::time::{Duration, Instant};

use miette::{IntoDiagnostic, Result};

use super::args::RenderArgs;
use super::device::Device;
use super::drive::{Drive, Driven, Onlookers, drive};
use super::load::Opened;
use super::load::SceneInput;
use super::method::{self, CheckOrder, RenderOrder};
use super::observer::{Beside, Observer};
use super::outputs::Outputs;
use super::progress::{Goal, Progress};
use super::report::{ErrorReport, PlanCheck, Rejected, RejectedExample, RenderReport, Seconds, write_json};
use super::run_spec::RunSpec;
use super::timings::{self, TimingCapture};
use super::{load, plan, predictions, process, tell};
use crate::client::{Client, VarianceForm};
use crate::scene::Loaded;
use crate::server::{Server, Stats};
use crate::stream::Cause;
use crate::stream::Lanes;
use crate::stream::control::Epoch;
use crate::study::ErrorTarget;
use crate::tracer::integrator::PlanCheckTally;
use crate::tracer::{Camera, Scene};

/// Runs the subcommand.
///
/// # Errors
///
/// Whatever stops the run. Outputs are checked before anything is rendered, and replaced only when complete.
pub fn render(args: &RenderArgs) -> Result<()> {
    let start = Instant::now();
    if args.error.is_some() && (args.replicates == 1 || args.check_plan > 0.0) {
        return Err(miette::miette!(
            help = "leave --replicates and --check-plan away",
            "--error needs the error of the picture, which one randomisation alone does not tell"
        ));
    }
    let outputs = Outputs::plan(args)?;
    if let Some(path) = &args.gpu_timings {
        timings::check(path, outputs.files().chain(&args.json).chain([&args.source.scene]))?;
    }
    process::listen_for_interrupt();
    let mut seconds = Seconds::default();
    let Opened { input, scene, camera, device } = load::open(&args.source, &mut seconds)?;
    let loaded = &input.loaded;
    load::tell_warnings(loaded);
    let notices = scene.notices().to_vec();
    for notice in &notices {
        tell(&format!("warning: {notice}"));
    }
    let mut run = run_spec(args, &input, device.name());
    run.film.variance = outputs.read_variance(&args.display.settings()).then_some(VarianceForm::Product);
    let (simd, scene, choosing) = (scene.kernel().name(), Arc::new(scene), Instant::now());
    let threads = args.source.threads();
    method::choose(&mut run, &scene, &camera, threads);
    seconds.choose = choosing.elapsed().as_secs_f64();
    if !args.quiet {
        method::tell_choice(&run);
    }
    let mut client = device.client(run.film, threads)?;
    let (server, mut lanes) = Server::start_with(threads, device.tracing_priority()).into_diagnostic()?;
    let mut timings = capture(args, &device, &server)?;
    let check = check(args, loaded)?;
    let observer = run.replicated.then(|| Observer::start(&run, target(args), Beside::Render)).transpose()?;
    let order = ((scene, camera), check);
    let (driven, tally) =
        trace(args, &run, order, (&server, &mut lanes, &mut client), (&mut timings, observer.as_ref()))?;
    let stats = server.stats();
    server.term();
    let known = observer.map(|observer| observer.end());

    let mut report = report(&run, &client, &stats, &driven);
    seconds.render = driven.wall.as_secs_f64();
    seconds.rasterise = driven.rasterise.as_secs_f64();
    seconds.trace = tracing_time(&stats).as_secs_f64();
    let prefix = driven.complete || run.deterministic;
    let writing = Instant::now();
    let written = outputs.write(&mut client, (&run, prefix), &args.display.settings(), &mut seconds);
    if let Some(mut timings) = timings {
        timings.client("display and write", writing)?;
        timings.finish(&server)?;
    }
    written?;
    seconds.total = start.elapsed().as_secs_f64();
    report.seconds = seconds;
    report.plan = plan::plan(&loaded.desc, &run, &args.display.settings());
    report.left_out = run.left_out().collect();
    if tally.as_ref().is_some_and(|tally| tally.counts()[0] == 0) {
        tell(&format!("note: --check-plan {} has compared no path: give a larger share", args.check_plan));
    }
    if let Some((state, kept)) = &known {
        predictions::log(&run, kept);
        report.error = ErrorReport::new(state, &run, (target(args), args.error_at.into()), driven.reached);
    }
    report.plan_check = tally.as_ref().map(|tally| PlanCheck::from(tally.counts()));
    report.warnings = loaded.warnings.iter().map(ToString::to_string).chain(notices).collect();
    (report.threads, report.simd) = (threads, simd);
    report.outputs = outputs.files().cloned().collect();
    report.peak_memory_bytes = process::peak_memory_bytes();
    if let Some(path) = &args.json {
        write_json(&report, path)?;
    }
    if !args.quiet {
        tell(&report.summary());
    }
    if let Some((index, message)) = driven.panicked {
        return Err(miette::miette!(
            "path {index} panicked: {message}; the picture holds what was traced before. Please report it with the scene \
             and this command: {}",
            again(&run, tally.as_deref(), index)
        ));
    }
    Ok(())
}

/// The command that traces what went wrong at `index` again; what differs from the plan is differing together with all that did.
fn again(run: &RunSpec, tally: Option<&PlanCheckTally>, index: u64) -> String {
    let Some((first, last)) = tally.and_then(PlanCheckTally::reach) else { return run.command(index, 1) };
    let per_index = method::paths_per_index(run.integrator);
    run.command(first, (last - first + 1) * per_index) + " --check-plan 1"
}

/// What `--check-plan` asks for.
fn check(args: &RenderArgs, loaded: &Loaded) -> Result<Option<CheckOrder>> {
    if args.check_plan == 0.0 {
        return Ok(None);
    }
    let general = Arc::new(load::prepare(Scene::prepare_general, &loaded.desc, args.source.simd)?);
    Ok(Some(CheckOrder { share: args.check_plan, general }))
}

fn run_spec(args: &RenderArgs, input: &SceneInput, device: String) -> RunSpec {
    let run = RunSpec::of(&args.source, input, device);
    RunSpec {
        first_index: args.first_index,
        spp: args.spp.unwrap_or(run.spp),
        deterministic: args.deterministic,
        // The plan is checked path by path, whatever randomisation they are of.
        replicated: args.replicates > 1 && args.check_plan == 0.0,
        ..run
    }
}

/// What `--error` asks for.
fn target(args: &RenderArgs) -> Option<ErrorTarget> {
    args.error.map(|error| ErrorTarget { error, at: args.error_at.into() })
}

/// Renders until the sample count, the time or Ctrl-C.
fn trace(
    args: &RenderArgs,
    run: &RunSpec,
    ((scene, camera), check): ((Arc<Scene>, Camera), Option<CheckOrder>),
    (server, lanes, client): (&Server, &mut Lanes, &mut Client),
    (timings, observer): (&mut Option<TimingCapture>, Option<&Observer>),
) -> Result<(Driven, Option<Arc<PlanCheckTally>>)> {
    let [pw, ph] = run.film.padded_extent().map(u64::from);
    let wanted = args.samples.unwrap_or_else(|| run.spp.saturating_mul(pw * ph));
    let first = run.first_index;
    let counted = args.samples.is_some() || args.spp.is_some();
    let (range, goal) = match (args.time, args.error) {
        (Some(limit), _) => (first..u64::MAX, Goal::Time(limit)),
        (None, Some(_)) if !counted => (first..u64::MAX, Goal::Error),
        (None, _) => (first..first.saturating_add(wanted), Goal::Paths(wanted)),
    };
    let epoch = Epoch(1);
    let order = RenderOrder { scene, camera, range, window: run.film.window(), epoch, check };
    let tally = method::start(server, run, order, &mut None)?;
    let bar = Progress::new(goal, args.quiet);
    let plan = Drive {
        epoch,
        first_index: first,
        deterministic: run.deterministic,
        time: args.time,
        texels: (pw * ph) as f64,
        quantity: args.error_at.into(),
    };
    let driven = drive(plan, server, lanes, client, Onlookers { bar: &bar, timings, observer });
    bar.finish();
    driven.map(|driven| (driven, tally))
}

/// Begins what `--gpu-timings` asks for.
fn capture(args: &RenderArgs, device: &Device, server: &Server) -> Result<Option<TimingCapture>> {
    let Some(path) = &args.gpu_timings else { return Ok(None) };
    if device.gpu().is_none() {
        tell("note: no GPU is used, so --gpu-timings holds the spans of the CPU only");
    }
    server.set_tracing(true);
    TimingCapture::new(path, device.gpu()).map(Some)
}

fn tracing_time(stats: &Stats) -> Duration {
    let total = stats.total();
    total.cpu.unwrap_or(total.busy)
}

fn report(run: &RunSpec, client: &Client, stats: &Stats, driven: &Driven) -> RenderReport {
    let counts = client.counts();
    let [pw, ph] = run.film.padded_extent().map(f64::from);
    let total = stats.total();
    let rejections = total.rejections;
    let example = |&(index, cause): &(u64, Cause)| RejectedExample {
        index,
        cause: cause.describe().to_string(),
        replay: run.command(index, 1),
    };
    let per = |n: u64, time: Duration| n as f64 / time.as_secs_f64().max(1e-9);
    RenderReport {
        version: env!("CARGO_PKG_VERSION"),
        scene: run.scene.clone(),
        width: run.film.width,
        height: run.film.height,
        integrator: run.integrator.name(),
        auto: run.auto.clone(),
        camera_samples: counts.camera_samples,
        light_samples: counts.light_samples,
        camera_paths: counts.camera_paths,
        light_paths: counts.light_paths,
        samples_per_pixel: counts.paths() as f64 / (pw * ph),
        samples_per_second: per(counts.paths(), driven.wall),
        paths_per_trace_second: per(counts.paths(), tracing_time(stats)),
        rejected: Rejected {
            total: rejections.total(),
            by_cause: Cause::ALL.iter().map(|&c| (c.describe().to_string(), rejections.count(c))).collect(),
            examples: rejections.examples().iter().map(example).collect(),
        },
        device: run.device.clone(),
        seed: run.seed,
        deterministic: run.deterministic,
        interrupted: driven.interrupted,
        ..RenderReport::default()
    }
}
