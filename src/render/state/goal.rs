//! The state that a render keeps or resumes.

use std::ops::Range;
use std::path::PathBuf;
use std::time::Duration;

use miette::{IntoDiagnostic, Result};

use crate::image::stereo::StereoLayout;
use crate::image::write::{check_place, same_file};
use crate::render::options::{RenderOptions, SceneOptions, StereoOptions};
use crate::render::run_spec::RunSpec;
use crate::render::state::file::{RenderState, StateFile};
use crate::render::state::header::{RenderGoal, Share, StateHeader};
use crate::render::state::identity::Identity;
use crate::scene::desc::ConvergenceChoice;
use crate::study::ErrorTarget;

/// The state that a render keeps.
pub struct KeptState {
    pub file: PathBuf,
    /// Time between two states.
    pub every: Duration,
    /// State to resume, if any.
    pub from: Option<StateFile>,
    /// The part of the picture that is rendered, if divided.
    pub share: Option<Share>,
}

impl KeptState {
    /// The state requested by `--state` or `--resume`; with the latter, replaces `args` by those of the resumed render.
    ///
    /// # Errors
    ///
    /// When the state cannot be read, when `--state` would overwrite one, and for incompatible options.
    pub fn plan(args: &mut RenderOptions) -> Result<Option<Self>> {
        let (file, from) = match (&args.state, args.resume) {
            (state, true) => {
                let old = args.source.scene.clone();
                let from = StateFile::open(&old)?;
                check_free(args, &from.about.run)?;
                let file = state.clone().unwrap_or(old);
                resume(args, &from.about);
                (file, Some(from))
            }
            (Some(state), false) => (state.clone(), None),
            (None, false) => return Ok(None),
        };
        let goes_on = from.as_ref().is_some_and(|from| same_file(&from.path, &file));
        if !goes_on && file.exists() {
            return Err(miette::miette!(
                help = "`render --resume FILE` goes on with it; or choose another name",
                "--state {} exists already",
                file.display()
            ));
        }
        check_place(&file).into_diagnostic()?;
        let others = args.outputs.iter().chain(&args.json).chain([&args.source.scene]);
        if let Some(other) = others.into_iter().find(|other| same_file(other, &file)) {
            return Err(miette::miette!("--state would overwrite {}; choose another name", other.display()));
        }
        Self::check(args)?;
        // With a goal of its own it is a render of the whole picture.
        let share = from.as_ref().and_then(|from| from.about.share).filter(|_| !args.has_goal());
        Ok(Some(Self { file, every: args.state_every, from, share }))
    }

    /// Rejects options that are incompatible with a state, and sets those that it requires.
    pub fn check(args: &mut RenderOptions) -> Result<()> {
        let refused = [
            (
                args.reweight_fireflies.is_some(),
                "--reweight-fireflies",
                "it needs a film for each brightness",
            ),
            (args.adaptive, "--adaptive", "where its samples lie depends on a pilot"),
            (args.check_plan > 0.0, "--check-plan", "it renders no picture to go on with"),
            (args.light_groups.is_some(), "--light-groups", "it holds the sums of one picture"),
            (
                args.source.device.as_deref().is_some_and(|d| d != "cpu"),
                "--device",
                "its sums are made on the processor",
            ),
        ];
        if let Some((_, option, why)) = refused.into_iter().find(|(given, ..)| *given) {
            return Err(miette::miette!(
                help = format!("leave {option} away"),
                "a state cannot be kept with {option}: {why}"
            ));
        }
        args.source.device = Some("cpu".to_string());
        args.deterministic = true;
        Ok(())
    }

    /// State of a run: empty, or the resumed one.
    ///
    /// # Errors
    ///
    /// When the resumed state belongs to another picture.
    pub fn open(
        self,
        run: &RunSpec,
        identity: Identity,
        goal: PlannedGoal,
        threads: usize,
    ) -> Result<OpenState> {
        let empty = StateHeader::empty(run.clone(), identity, goal.picture, goal.part);
        let about = StateHeader { share: self.share, ..empty };
        let mut state = RenderState::new(about, threads)?;
        if let Some(from) = self.from {
            state.about.check_same(&from.about, &from.path)?;
            if self.share.is_some() && from.about.goal.indices != state.about.goal.indices {
                return Err(miette::miette!(
                    help = "give the number of samples with which it was begun, or another name for the file",
                    "{} is a part of a picture with another number of samples",
                    from.path.display()
                ));
            }
            state.about.progress = from.about.progress.clone();
            state.add(from)?;
        }
        Ok(OpenState { file: self.file, every: self.every, state })
    }
}

/// Goal of a render, and the indices of the whole picture that it is part of.
#[derive(Clone, Debug)]
pub struct PlannedGoal {
    pub picture: Range<u64>,
    pub part: RenderGoal,
}

impl PlannedGoal {
    /// The goal of the command line or, if it specifies none, of the resumed state.
    pub fn new(args: &RenderOptions, run: &RunSpec, kept: Option<&KeptState>) -> Self {
        let from = kept.and_then(|kept| kept.from.as_ref()).filter(|_| !args.has_goal());
        if let Some(StateFile { about, .. }) = from {
            return Self { picture: about.picture.clone(), part: about.goal.clone() };
        }
        let error = args.error.map(|error| ErrorTarget { error, at: args.error_at });
        let [width, height] = run.film.padded_extent().map(u64::from);
        let counted = args.samples.is_some() || args.spp.is_some() || error.is_none();
        let paths = args.samples.unwrap_or_else(|| run.spp.saturating_mul(width * height));
        let indices = paths.div_ceil(run.integrator.paths_per_index());
        let end = match args.time.is_none() && counted {
            true => run.first_index.saturating_add(indices),
            false => u64::MAX,
        };
        let picture = run.first_index..end;
        let share = kept.and_then(|kept| kept.share);
        let indices = share.map_or(picture.clone(), |share| share.indices(&picture));
        Self { picture, part: RenderGoal { indices, time: args.time, error } }
    }
}

/// A state in memory, and its file.
pub struct OpenState {
    pub file: PathBuf,
    pub every: Duration,
    pub state: RenderState,
}

/// Rejects options that determine samples, since those of the state, which are in `run`, apply.
fn check_free(args: &RenderOptions, run: &RunSpec) -> Result<()> {
    let SceneOptions { defines, lenient, size, integrator, effects, max_depth, seed, filter, .. } =
        &args.source;
    let given = [
        (!defines.is_empty(), "-D"),
        (*lenient, "--lenient"),
        (size.is_some(), "--size"),
        (integrator.is_some(), "--integrator"),
        (!effects.is_empty(), "--effects"),
        (max_depth.is_some(), "--max-depth"),
        (*seed != 0, "--seed"),
        (filter.is_some(), "--filter"),
        (args.replicates != 2, "--replicates"),
        (args.first_index != 0, "--first-index"),
        (args.stereo.is_some() && run.stereo.is_none(), "--stereo"),
        (args.stereo.is_some_and(|eyes| eyes.interocular.is_some()), "--interocular"),
        (args.stereo.is_some_and(|eyes| eyes.convergence != ConvergenceChoice::default()), "--convergence"),
    ];
    match given.into_iter().find(|(given, _)| *given) {
        None => Ok(()),
        Some((_, option)) => Err(miette::miette!(
            help = format!("leave {option} away; scene and settings are those of the state"),
            "{option} cannot be changed when a render goes on"
        )),
    }
}

/// Replaces `args` by those of the render described by `about`, unless they specify another goal.
fn resume(args: &mut RenderOptions, about: &StateHeader) {
    let SceneOptions { simd, verbose, .. } = args.source;
    args.source = SceneOptions { simd, verbose, ..about.run.source(args.source.threads) };
    args.replicates = if about.run.replicated { 2 } else { 1 };
    args.first_index = about.picture.start;
    let layout = args.stereo.map_or(Some(StereoLayout::default()), |eyes| eyes.layout);
    args.stereo = about.run.stereo.as_ref().map(|rig| StereoOptions::of_rig(rig, layout));
    args.aov = Some(args.aov.take().unwrap_or_else(|| about.run.aovs.clone()));
}
