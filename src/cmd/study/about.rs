//! Subject of a study: scene, methods, machine, and the parts still missing.

use std::path::PathBuf;
use std::time::Instant;

use miette::Result;

use crate::cmd::args::StudyArgs;
use crate::cmd::args::study::StudySection;
use crate::cmd::explain::farm_cost;
use crate::cmd::study::folder::{self, StudyFolder};
use crate::cmd::study::renderer::{StudyRenderer, cpu};
use crate::cmd::study::session::{PARTS, StudySession, wanted};
use crate::cmd::study::{display, options};
use crate::gpu;
use crate::render::options::SceneOptions;
use crate::render::run_spec::{ChoiceReport, quoted};
use crate::render::{calendar, method};
use crate::scene::desc::{IntegratorKind, IntegratorTraits};
use crate::study::data::{AutoChoice, DroppedMethod, Machine, Study};
use crate::study::measurement::Measurement;

/// Runs the automatic choice of the method, and stores the result with the time it took.
pub fn choose(renderer: &mut StudyRenderer, folder: &mut StudyFolder) -> Result<ChoiceReport> {
    let mut run = renderer.run(IntegratorKind::Auto, 1);
    let start = Instant::now();
    method::choose(&mut run, &renderer.scene, &renderer.camera, renderer.threads);
    let seconds = start.elapsed().as_secs_f64();
    let choice = run.auto.ok_or_else(|| miette::miette!("no method was chosen"))?;
    let reason = choice.reason.rsplit_once(" — ").map_or_else(String::new, |(_, reason)| reason.to_string());
    let auto = AutoChoice { method: choice.kind.name().to_string(), reason, seconds };
    folder.keep(Measurement::Auto(auto))?;
    Ok(choice)
}

/// Methods to compare: the requested ones, or all that can render the picture. The reasons for leaving out others are stored.
pub fn methods(args: &StudyArgs, session: &mut StudySession) -> Result<Vec<IntegratorKind>> {
    if let Some(dark) = args.methods.iter().find(|kind| !kind.shows_light()) {
        miette::bail!("--methods {} shows no light, so there is nothing to compare", dark.name());
    }
    let choice = session.choice.clone();
    let mut methods: Vec<IntegratorKind> = Vec::new();
    // `auto` is measured as the method it chooses.
    for kind in
        args.methods.iter().map(|kind| if *kind == IntegratorKind::Auto { choice.kind } else { *kind })
    {
        if !methods.contains(&kind) {
            methods.push(kind);
        }
    }
    if methods.iter().all(|kind| kind.has_photons()) && !methods.is_empty() && args.against.is_none() {
        // Methods with photons cannot estimate their own bias, so an unbiased one is included.
        methods.push(IntegratorKind::Bidirectional);
    }
    if !methods.is_empty() {
        return Ok(methods);
    }
    for kind in IntegratorKind::candidates() {
        let tried = choice.candidates.iter().find(|tried| tried.method == kind.name());
        let IntegratorTraits { extends, finds_deltas, finds_beams, .. } = kind.traits();
        let reason = match (tried, extends) {
            (None, Some(same)) => {
                format!("is {} where the picture shows no mirrors and no glass", same.name())
            }
            (Some(tried), _) if !tried.complete && !finds_deltas => {
                "alone cannot show mirrors and glass, nor light that media emit".into()
            }
            (Some(tried), _) if !tried.complete && !finds_beams => {
                "cannot find light that leaves along normals only".into()
            }
            _ => {
                methods.push(kind);
                continue;
            }
        };
        let dropped = DroppedMethod { method: kind.name().to_string(), reason };
        session.folder.keep(Measurement::Dropped(dropped))?;
    }
    // Determines the order before anything has been measured.
    let time = |kind: &IntegratorKind| {
        let tried = choice.candidates.iter().find(|tried| tried.method == kind.name());
        tried.and_then(|tried| tried.relative_time).unwrap_or(f64::INFINITY)
    };
    methods.sort_by(|a, b| time(a).total_cmp(&time(b)));
    Ok(methods)
}

/// Options of the scene, in the form of the other subcommands.
pub fn source(args: &StudyArgs, scene: PathBuf) -> SceneOptions {
    SceneOptions {
        defines: args.defines.clone(),
        lenient: args.lenient,
        verbose: args.verbose,
        size: args.size,
        threads: args.threads,
        simd: args.simd.into(),
        filter: args.filter,
        device: args.device.clone(),
        ..SceneOptions::of(scene)
    }
}

/// Description of a study: scene, machine and missing parts.
pub fn about(args: &StudyArgs, renderer: &StudyRenderer, folder: &StudyFolder) -> Study {
    let there = |knob: StudySection| match knob {
        StudySection::Methods => folder.has(|m| matches!(m, Measurement::Run(_))),
        // Within the section this part is measured last.
        StudySection::Effects => folder.has(|m| matches!(m, Measurement::Unused { .. })),
        StudySection::Options => options::is_complete(folder),
        StudySection::Display => display::is_complete(folder),
        StudySection::Numeric => folder.has(|m| matches!(m, Measurement::Numeric(_))),
        StudySection::Replicates => folder.has(|m| matches!(m, Measurement::Scheme(_))),
    };
    let missing = PARTS.into_iter().filter(|(knob, ..)| wanted(args, *knob) && !there(*knob));
    let spec = renderer.run.film;
    Study {
        format: folder::FORMAT,
        scene: args.scene.as_ref().map(|path| path.display().to_string()).unwrap_or_default(),
        size: [spec.width, spec.height],
        machine: machine(renderer),
        load_seconds: renderer.load_seconds,
        farm: farm_cost(renderer.load_seconds, renderer.texels(), true),
        missing: missing.map(|(.., name)| name.to_string()).collect(),
        ..Study::default()
    }
}

pub fn command() -> String {
    let words = std::env::args_os().skip(1).map(|word| quoted(&word.to_string_lossy()));
    std::iter::once("pointillist".to_string()).chain(words).collect::<Vec<_>>().join(" ")
}

/// Machine properties that measurements depend on.
fn machine(renderer: &StudyRenderer) -> Machine {
    let device = &renderer.run.device;
    let driver =
        gpu::devices().ok().and_then(|all| all.into_iter().find(|d| d.name == *device).map(|d| d.driver));
    Machine {
        cpu: format!("{}, {}", cpu(), renderer.scene.kernel().name()),
        threads: renderer.threads,
        device: device.clone(),
        driver: driver.unwrap_or_default(),
        program: format!("pointillist {}", env!("CARGO_PKG_VERSION")),
        date: calendar::today(),
    }
}
