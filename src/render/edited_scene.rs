//! A scene with edits and forced effects, always applied to the scene as loaded.

use std::sync::Arc;
use std::time::{Duration, Instant};

use miette::{IntoDiagnostic, Result};

use crate::job::Job;
use crate::render::forced::Forced;
use crate::render::load;
use crate::scene::SceneDesc;
use crate::scene::desc::CameraDesc;
use crate::scene::edit::Edits;
use crate::tracer::{Camera, PrepareError, PrepareOptions, Scene};

/// The traced scene and its changes against the file. Of the camera it contains only the lens.
#[derive(Clone)]
pub struct EditedScene {
    /// The scene as loaded, with the size from the command line.
    original: SceneDesc,
    /// `desc`, prepared for tracing.
    scene: Arc<Scene>,
    change: SceneChange,
}

/// Changes against the file, and the resulting description.
#[derive(Clone)]
struct SceneChange {
    /// The scene with all edits and forced effects.
    desc: SceneDesc,
    edits: Edits,
    forced: Vec<Forced>,
}

/// A changed scene being prepared by a thread.
pub struct ScenePreparation {
    change: SceneChange,
    began: Instant,
    job: Job<Result<Scene, PrepareError>>,
}

/// A changed scene, prepared for tracing.
pub struct ChangedScene {
    change: SceneChange,
    scene: Scene,
    /// Time that preparing it took.
    pub took: Duration,
}

impl EditedScene {
    /// A scene without changes, and its prepared form.
    pub fn new(original: SceneDesc, scene: Scene) -> Self {
        let change = SceneChange { desc: original.clone(), edits: Edits::default(), forced: Vec::new() };
        Self { original, scene: Arc::new(scene), change }
    }

    /// Description of the scene as loaded.
    pub fn original(&self) -> &SceneDesc {
        &self.original
    }

    /// Description of the traced scene, except for the camera.
    pub fn desc(&self) -> &SceneDesc {
        &self.change.desc
    }

    /// Traced scene.
    pub fn scene(&self) -> Arc<Scene> {
        self.scene.clone()
    }

    /// Edited parameters, including the lens.
    pub fn edits(&self) -> &Edits {
        &self.change.edits
    }

    /// The effects that are forced on or off.
    pub fn forced(&self) -> &[Forced] {
        &self.change.forced
    }

    /// Overrides the film size and removes the crop window.
    pub fn set_film(&mut self, width: u32, height: u32) {
        for desc in [&mut self.original, &mut self.change.desc] {
            (desc.film.width, desc.film.height, desc.film.crop) = (width, height, None);
        }
    }

    /// Removes from the edits what [`camera`](Self::camera) receives separately: of the camera only the lens radius remains.
    pub fn without_pose(&self, edits: Edits) -> Edits {
        let file = &self.original.camera;
        let lens = edits.camera.filter(|camera| camera.lens_radius() != file.lens_radius());
        let lens = lens.map(|lens| file.clone().with_lens_radius(lens.lens_radius()));
        Edits { camera: lens, values: edits.values }
    }

    fn changed(&self, edits: Edits, forced: Vec<Forced>) -> Result<SceneChange> {
        let mut desc = edits.apply(&self.original).into_diagnostic()?;
        forced.iter().try_for_each(|forced| load::force(&mut desc, *forced))?;
        Ok(SceneChange { desc, edits, forced })
    }

    /// Replaces edits and forced effects and prepares the scene. On an error it stays unchanged.
    pub fn change(&mut self, edits: Edits, forced: Vec<Forced>) -> Result<()> {
        let change = self.changed(edits, forced)?;
        self.scene = Arc::new(self.scene.edited(&change.desc).into_diagnostic()?);
        self.change = change;
        Ok(())
    }

    /// As [`change`](Self::change), on another thread; the present scene is traced until [`adopt`](Self::adopt).
    ///
    /// # Errors
    ///
    /// When the scene does not have an edited object, or no thread can be started.
    pub fn begin(&self, edits: Edits, forced: Vec<Forced>) -> Result<ScenePreparation> {
        let (change, scene) = (self.changed(edits, forced)?, self.scene());
        let desc = change.desc.clone();
        let job =
            Job::start("preparing the changed scene", move |_| scene.edited(&desc)).into_diagnostic()?;
        Ok(ScenePreparation { change, began: Instant::now(), job })
    }

    /// Replaces the traced scene by the changed one.
    pub fn adopt(&mut self, changed: ChangedScene) {
        (self.change, self.scene) = (changed.change, Arc::new(changed.scene));
    }

    /// Prepares this camera for a picture of this size in pixels.
    pub fn camera(&self, camera: CameraDesc, [width, height]: [u32; 2]) -> Result<Camera> {
        // A lens that is forced off is absent from the description.
        let camera = camera.with_lens_radius(self.desc().camera.lens_radius());
        let film = &self.original.film;
        // The picture is the crop window; the whole film keeps its proportion to it.
        let whole = |n: u32, of: u32, part: u32| {
            (f64::from(n) * f64::from(of) / f64::from(part.max(1))).round().clamp(1.0, 1e6) as u32
        };
        let options = match film.crop {
            Some(crop) => PrepareOptions {
                width: whole(width, film.width, crop.width),
                height: whole(height, film.height, crop.height),
            },
            None => PrepareOptions { width, height },
        };
        Ok(Camera::new(&camera, film, &options).into_diagnostic()?.placed(&self.original.space))
    }
}

impl ScenePreparation {
    /// Waits up to `time` for the scene; returns the preparation if it is not ready.
    ///
    /// # Errors
    ///
    /// When the scene cannot be prepared.
    pub fn wait(self, time: Duration) -> Result<Result<ChangedScene, Self>> {
        let Self { change, began, job } = self;
        match job.wait_for(time) {
            Ok(scene) => {
                let scene = scene.into_diagnostic()?.into_diagnostic()?;
                Ok(Ok(ChangedScene { scene, change, took: began.elapsed() }))
            }
            Err(job) => Ok(Err(Self { change, began, job })),
        }
    }
}
