//! The films of a render without a window: those of a state that it keeps, exact ones, or those of the device.

use std::path::PathBuf;
use std::sync::Arc;

use miette::{IntoDiagnostic, Result};

use crate::client::Film;
use crate::client::reference::ExactFilm;
use crate::render::device::Device;
use crate::render::run_spec::RunSpec;
use crate::render::state::identity::luminance_scale;
use crate::render::state::{Identity, KeptState, OpenState, PlannedGoal, Recorder};
use crate::study::ExactReplicates;
use crate::tracer::{Camera, Scene};

/// What films are for.
pub struct FilmOrder<'a> {
    pub run: &'a RunSpec,
    /// Files of the scene.
    pub files: &'a [PathBuf],
    pub scene: &'a Arc<Scene>,
    /// The camera, or that of the left eye.
    pub camera: &'a Camera,
    /// The camera of the right eye, if there are two.
    pub right_eye: Option<&'a Camera>,
    pub device: &'a Device,
    pub threads: usize,
}

/// Films of a render, with what a state that is kept holds beside them.
pub struct RenderFilms {
    /// The film of the camera, or of the left eye.
    pub film: Box<dyn Film>,
    /// The film of the right eye, if there are two.
    pub right_eye: Option<Box<dyn Film>>,
    /// Writes the state, if one is kept.
    pub recorder: Option<Recorder>,
    /// Sums of the replicates of the picture or of the left eye's, and of the right eye's, in the state.
    pub replicates: [Option<ExactReplicates>; 2],
}

impl RenderFilms {
    /// Films of the state, if one is `kept` for a render to `goal`; otherwise empty ones.
    ///
    /// # Errors
    ///
    /// Those of [`KeptState::open`], and of films.
    pub fn open(order: &FilmOrder<'_>, kept: Option<KeptState>, goal: PlannedGoal) -> Result<Self> {
        let FilmOrder { run, files, scene, camera, right_eye, device, threads } = *order;
        if let Some(kept) = kept {
            let identity = Identity::of(run, files, scene, camera, right_eye)?;
            let OpenState { file, every, state } = kept.open(run, identity, goal, threads)?;
            let (mut right_film, mut replicates) = (None, [state.sums.replicates, None]);
            if let Some(sums) = state.right_eye {
                (right_film, replicates[1]) = (Some(sums.film), sums.replicates);
            }
            return Ok(Self {
                film: Box::new(state.sums.film),
                right_eye: right_film.map(|film| Box::new(film) as Box<dyn Film>),
                recorder: Some(Recorder::new(file, every, state.about)),
                replicates,
            });
        }
        // Exact sums, so that the bits equal those of a picture merged from parts.
        let is_exact = run.deterministic && device.gpu().is_none() && run.reweighted.is_none();
        let scale = is_exact.then(|| luminance_scale(run, scene, camera, right_eye));
        let new = || -> Result<Box<dyn Film>> {
            match scale {
                Some(scale) => Ok(Box::new(ExactFilm::new(run.film, threads, scale).into_diagnostic()?)),
                None => device.client(run.film, threads, run.reweighted),
            }
        };
        Ok(Self {
            film: new()?,
            right_eye: right_eye.map(|_| new()).transpose()?,
            recorder: None,
            replicates: [None, None],
        })
    }
}
