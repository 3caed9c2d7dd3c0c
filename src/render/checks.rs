//! Checks the options of a render before any work.

use miette::Result;

use crate::client::{Denoise, DisplayView};
use crate::denoise::view_filter;
use crate::render::options::RenderOptions;
use crate::render::outputs::Outputs;
use crate::render::{adaptive, light_groups, stereo, timings};

/// Checks options and, as `plan` does it, the outputs, before any work.
///
/// # Errors
///
/// When options exclude each other, and those of `plan`.
pub fn check(args: &RenderOptions, plan: impl FnOnce(&RenderOptions) -> Result<Outputs>) -> Result<Outputs> {
    if args.error.is_some() && (args.replicates == 1 || args.check_plan > 0.0) {
        return Err(miette::miette!(
            help = "leave --replicates and --check-plan away",
            "--error needs the error of the picture, which one randomisation alone does not tell"
        ));
    }
    if args.denoise != Denoise::Off {
        let divided = args.replicates > 1 && args.check_plan == 0.0;
        let needs = [
            (divided, "two randomisations", "leave --replicates and --check-plan away"),
            (args.display.view == DisplayView::Picture, "the picture to be shown", "leave --show away"),
            (args.reweight_fireflies.is_none(), "all samples alike", "leave --reweight-fireflies away"),
        ];
        if let Some((_, what, advice)) = needs.iter().find(|(given, ..)| !given) {
            return Err(miette::miette!(help = *advice, "--denoise needs {what}"));
        }
        view_filter::check(args.denoise)?;
    }
    if args.adaptive {
        adaptive::check(args)?;
    }
    let outputs = plan(args)?;
    light_groups::check(args, &outputs)?;
    stereo::check(args)?;
    if let Some(path) = &args.gpu_timings {
        timings::check(path, outputs.files().chain(&args.json).chain([&args.source.scene]))?;
    }
    Ok(outputs)
}
