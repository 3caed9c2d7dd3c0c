//! `pointillist shard`: one part of a picture, rendered into a state.

use miette::{IntoDiagnostic, Result};

use super::args::{RenderArgs, ShardArgs};
use super::outputs::Outputs;
use super::state::{KeptState, Share, StateFile};
use super::{render, tell};
use crate::image::write::{check_place, same_file};

/// Runs the subcommand.
///
/// # Errors
///
/// Those of a render, and when the output is the state of something else.
pub fn shard(args: ShardArgs) -> Result<()> {
    let ShardArgs { source, of, number, samples, spp, aov, output, state_every, json, quiet } = args;
    let share = Share { number, of };
    let mut args = RenderArgs { samples, spp, aov, json, quiet, ..RenderArgs::of(source).into_diagnostic()? };
    if let Some(other) = args.json.iter().chain([&args.source.scene]).find(|other| same_file(other, &output))
    {
        return Err(miette::miette!("-o would overwrite {}; choose another name", other.display()));
    }
    check_place(&output).into_diagnostic()?;
    let from = output.exists().then(|| StateFile::open(&output)).transpose()?;
    if let Some(StateFile { about, .. }) = &from
        && about.share != Some(share)
    {
        return Err(miette::miette!(
            help = "choose another name for the output",
            "{} is the state of {}, not of part {number} of {of}",
            output.display(),
            about.share.map_or("a whole picture".to_string(), |share| share.to_string())
        ));
    }
    if let Some(StateFile { about, .. }) = &from
        && about.is_complete()
        && !args.quiet
    {
        tell(&format!("{} is complete already", output.display()));
    }
    KeptState::check(&mut args)?;
    let outputs = Outputs::check(Vec::new(), args.json.as_ref(), &args.source.scene)?;
    let kept = KeptState { file: output.clone(), every: state_every, from, share: Some(share) };
    render::run(&args, &outputs, Some(kept))?;
    match StateFile::open(&output)?.about.is_complete() {
        true => Ok(()),
        // Whoever deals out the parts must not take it for done.
        false => Err(miette::miette!(
            help = "the same command goes on with it",
            "{share} was stopped before its end; {} holds what is there",
            output.display()
        )),
    }
}
