//! `pointillist shard`: renders one part of a picture into a state.

use miette::{IntoDiagnostic, Result};

use crate::cmd::args::ShardArgs;
use crate::image::write::{check_place, same_file};
use crate::render::batch;
use crate::render::options::RenderOptions;
use crate::render::outputs::Outputs;
use crate::render::process::tell;
use crate::render::state::{KeptState, Share, StateFile};

/// Runs the subcommand.
///
/// # Errors
///
/// Those of a render, and if the output is an unrelated state.
pub fn shard(args: ShardArgs) -> Result<()> {
    let ShardArgs { source, of, number, samples, spp, aov, output, state_every, json, quiet } = args;
    let share = Share { number, of };
    let mut args =
        RenderOptions { samples, spp, aov: aov.map(|list| list.0), json, quiet, ..RenderOptions::of(source) };
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
    batch::run(&args, &outputs, Some(kept))?;
    match StateFile::open(&output)?.about.is_complete() {
        true => Ok(()),
        // An error, so that the caller that distributes parts does not count this one as done.
        false => Err(miette::miette!(
            help = "the same command goes on with it",
            "{share} was stopped before its end; {} holds what is there",
            output.display()
        )),
    }
}
