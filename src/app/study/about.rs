//! What a study is about: the scene as other subcommands take it, the methods, and the head of what comes out.

use std::path::PathBuf;

use miette::Result;

use super::folder::{self, StudyFolder};
use super::stage::StudyRenderer;
use super::{display, machine};
use crate::app::args::StudyArgs;
use crate::app::args::scene::SceneArgs;
use crate::app::args::study::Knob;
use crate::app::run_spec::quoted;
use crate::scene::desc::IntegratorKind;
use crate::study::data::Study;
use crate::study::measurement::Measurement;

/// The methods that are compared.
///
/// # Errors
///
/// Where nothing is left to compare.
pub fn methods(args: &StudyArgs) -> Result<Vec<IntegratorKind>> {
    use IntegratorKind::{Auto, Bidirectional, Light, Path, Photon};
    if args.methods.contains(&Auto) {
        return Err(miette::miette!(
            help = "name those that are to be compared, or leave --methods away",
            "--methods auto is a choice among methods, not one of them"
        ));
    }
    let all = || vec![Path, Light, Bidirectional, Photon];
    Ok(if args.methods.is_empty() { all() } else { args.methods.clone() })
}

/// What is traced, as other subcommands take it.
pub fn source(args: &StudyArgs, scene: PathBuf) -> SceneArgs {
    SceneArgs {
        scene,
        defines: args.defines.clone(),
        size: args.size,
        integrator: None,
        effects: Vec::new(),
        max_depth: None,
        threads: args.threads,
        simd: args.simd,
        seed: 0,
        filter: Some(args.filter),
        device: args.device.clone(),
    }
}

/// Scene and machine; and what is not there yet.
pub fn about(args: &StudyArgs, stage: &StudyRenderer, folder: &StudyFolder) -> Study {
    let has = |f: &dyn Fn(&Measurement) -> bool| folder.measurements.iter().any(f);
    let mut missing = Vec::new();
    for (knob, name, there) in [
        (
            Knob::Methods,
            "convergence, prices, pictures, predictions, stability: --knobs methods",
            has(&|m| matches!(m, Measurement::Run(_))),
        ),
        // What is measured last.
        (Knob::Effects, "effects: --knobs effects", has(&|m| matches!(m, Measurement::Unused { .. }))),
        (Knob::Display, "display: --knobs display", display::is_complete(folder)),
        (Knob::Numeric, "numeric choices: --knobs numeric", has(&|m| matches!(m, Measurement::Numeric(_)))),
        (Knob::Replicates, "replicates: --knobs replicates", has(&|m| matches!(m, Measurement::Scheme(_)))),
    ] {
        if !there && (args.knobs.is_empty() || args.knobs.contains(&knob)) {
            missing.push(name.to_string());
        }
    }
    let spec = stage.run.film;
    Study {
        format: folder::FORMAT,
        scene: args.scene.as_ref().map(|path| path.display().to_string()).unwrap_or_default(),
        size: [spec.width, spec.height],
        machine: machine::machine(&stage.run.device, (stage.threads, stage.scene.kernel())),
        load_seconds: stage.load_seconds,
        missing,
        ..Study::default()
    }
}

/// The command that this program was started by.
pub fn command() -> String {
    let words = std::env::args_os().skip(1).map(|word| quoted(&word.to_string_lossy()));
    std::iter::once("pointillist".to_string()).chain(words).collect::<Vec<_>>().join(" ")
}
