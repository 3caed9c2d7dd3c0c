//! `--stereo`: the pictures of two eyes from one render, each on a film of its own.

use miette::{IntoDiagnostic, Result};

use crate::accounting::observer::Observer;
use crate::client::{ClientError, Film};
use crate::render::options::{RenderOptions, StereoOptions};
use crate::render::run_spec::RunSpec;
use crate::scene::SceneDesc;
use crate::scene::desc::{ComfortableDepth, StereoRig, StereoScreen};
use crate::stream::{BlockEyes, PathCounts, Sample};
use crate::tracer::{Camera, PrepareOptions, Scene};

/// The right eye of a render; the left one has the render's own camera and film.
pub struct RightEye {
    /// Its camera.
    pub camera: Camera,
    /// Its film.
    pub film: Box<dyn Film>,
    /// Observer of the error of its picture, if there is one.
    pub observer: Option<Observer>,
    /// Which samples of a block are whose.
    pub eyes: BlockEyes,
}

/// Refuses options that two eyes do not go with, before any work.
pub fn check(args: &RenderOptions) -> Result<()> {
    if args.stereo.is_none() {
        return Ok(());
    }
    let refused = [
        (args.check_plan > 0.0, "--check-plan compares the samples of one eye", "leave --check-plan away"),
        (
            args.reweight_fireflies.is_some(),
            "--reweight-fireflies compares samples of equal weight",
            "leave --reweight-fireflies away",
        ),
    ];
    match refused.into_iter().find(|(wrong, ..)| *wrong) {
        Some((_, why, advice)) => Err(miette::miette!(help = advice, "--stereo: {why}")),
        None => Ok(()),
    }
}

/// The rig for the camera of a scene, the cameras of its eyes, and one line about it.
///
/// # Errors
///
/// Those of [`StereoRig::of`] and [`StereoRig::eyes`].
pub fn set_up(
    options: &StereoOptions,
    desc: &SceneDesc,
    scene: &Scene,
    middle: &Camera,
) -> Result<(StereoRig, [Camera; 2], String)> {
    let axis = desc.camera.to_world.matrix3.z_axis.normalize_or_zero();
    let origin = desc.space.point(desc.camera.to_world.translation);
    let seen = middle.ray([0.5; 2], [0.5; 2]).and_then(|ray| scene.closest(&ray));
    let depth = seen.map(|hit| (hit.point.p.as_dvec3() - origin).dot(axis) / desc.space.scale);
    let rig =
        StereoRig::of(options.interocular, options.convergence, &desc.camera, depth).into_diagnostic()?;
    let film = &desc.film;
    let aspect = f64::from(film.width) / f64::from(film.height);
    let descs = rig.eyes(&desc.camera, aspect).into_diagnostic()?;
    let camera =
        |eye| Camera::new(eye, film, &PrepareOptions::from_film(film)).map(|c| c.placed(&desc.space));
    let [left, right] = &descs;
    let cameras = [camera(left).into_diagnostic()?, camera(right).into_diagnostic()?];
    let comfortable =
        ComfortableDepth::of(&rig, &desc.camera, aspect, StereoScreen::default()).into_diagnostic()?;
    Ok((rig, cameras, format!("{rig}; {comfortable}")))
}

impl RightEye {
    /// The right eye of a run.
    pub fn new(camera: Camera, film: Box<dyn Film>, run: &RunSpec) -> Self {
        Self { camera, film, observer: None, eyes: run.eyes() }
    }

    /// Adds its samples by paths of both eyes to its film, and passes copies to its observer.
    ///
    /// # Errors
    ///
    /// Those of [`Film::add`].
    pub fn add(
        &mut self,
        first_index: u64,
        paths: PathCounts,
        samples: &[Sample],
    ) -> Result<(), ClientError> {
        self.film.count_paths(paths);
        if let Some(observer) = &self.observer {
            observer.samples(first_index, paths, samples);
        }
        self.film.add(samples)
    }
}
