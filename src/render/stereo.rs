//! `--stereo`: the pictures of two eyes from one render, each on a film of its own.

use miette::{IntoDiagnostic, Result};

use crate::accounting::observer::Observer;
use crate::client::{ClientError, Film};
use crate::render::device::Device;
use crate::render::options::{RenderOptions, StereoOptions};
use crate::render::run_spec::RunSpec;
use crate::scene::SceneDesc;
use crate::scene::desc::{ComfortableDepth, StereoRig, StereoScreen};
use crate::stream::{Block, BlockEyes, Sample};
use crate::tracer::{Camera, PrepareOptions, Scene};

/// The right eye of a render; the left one has the render's own camera and film.
pub struct RightEye {
    /// Its camera.
    pub camera: Camera,
    /// Its film.
    pub film: Box<dyn Film>,
    /// Observer of the error of its picture, if there is one.
    pub observer: Option<Observer>,
    /// Whether indices alternate between replicates.
    replicated: bool,
}

/// Refuses options that two eyes do not go with, before any work.
pub fn check(args: &RenderOptions) -> Result<()> {
    if args.stereo.is_none() {
        return Ok(());
    }
    let refused = [
        (args.adaptive, "--adaptive steers the samples by the error of one picture", "leave --adaptive away"),
        (args.check_plan > 0.0, "--check-plan compares the samples of one eye", "leave --check-plan away"),
        (args.light_groups.is_some(), "light groups are those of one eye", "leave --light-groups away"),
        (
            args.reweight_fireflies.is_some(),
            "--reweight-fireflies compares samples of equal weight",
            "leave --reweight-fireflies away",
        ),
        (
            args.state.is_some() || args.resume,
            "the state of a render holds one eye",
            "leave --state and --resume away",
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
    /// The right eye with an empty film like that of the left.
    ///
    /// # Errors
    ///
    /// As for the film of the left eye.
    pub fn new(camera: Camera, run: &RunSpec, device: &Device, threads: usize) -> Result<Self> {
        let film = device.client(run.film, threads, None)?;
        Ok(Self { camera, film, observer: None, replicated: run.replicated })
    }

    /// The samples of the left and of the right eye in a block.
    pub fn of_eyes<'a>(&self, block: &'a Block) -> [&'a [Sample]; 2] {
        BlockEyes::Both { replicated: self.replicated }.split(block)
    }

    /// Adds samples of the right eye in this block to its film, and passes copies to its observer.
    pub fn add(&mut self, block: &Block, samples: &[Sample]) -> Result<(), ClientError> {
        let header = &block.header;
        self.film.count_paths(header.paths);
        if let Some(observer) = &self.observer {
            observer.samples(header.first_index, header.paths, samples);
        }
        self.film.add(samples)
    }
}
