//! A scene with changes: edits of values and effects that are forced, always applied to the scene as it was read.

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

/// The scene as it is traced, and how it differs from the file's; of the camera only its lens is part of it.
#[derive(Clone)]
pub struct EditedScene {
    /// The scene as it was read, with the size that the command line asks for.
    original: SceneDesc,
    /// `desc`, prepared for tracing.
    scene: Arc<Scene>,
    change: SceneChange,
}

/// What differs from the file, and the description with it.
#[derive(Clone)]
struct SceneChange {
    /// The scene with all edits and forced effects.
    desc: SceneDesc,
    edits: Edits,
    forced: Vec<Forced>,
}

/// A changed scene that a thread prepares.
pub struct ScenePreparation {
    change: SceneChange,
    began: Instant,
    job: Job<Result<Scene, PrepareError>>,
}

/// A changed scene that is prepared.
pub struct ChangedScene {
    change: SceneChange,
    scene: Scene,
    /// How long it took.
    pub took: Duration,
}

impl EditedScene {
    /// A scene without changes, and the same prepared for tracing.
    pub fn new(original: SceneDesc, scene: Scene) -> Self {
        let change = SceneChange { desc: original.clone(), edits: Edits::default(), forced: Vec::new() };
        Self { original, scene: Arc::new(scene), change }
    }

    /// The description as it was read.
    pub fn original(&self) -> &SceneDesc {
        &self.original
    }

    /// The description of what is traced, but for the camera.
    pub fn desc(&self) -> &SceneDesc {
        &self.change.desc
    }

    /// What is traced.
    pub fn scene(&self) -> Arc<Scene> {
        self.scene.clone()
    }

    /// The values that were changed, and the lens.
    pub fn edits(&self) -> &Edits {
        &self.change.edits
    }

    /// The effects that are forced on or off.
    pub fn forced(&self) -> &[Forced] {
        &self.change.forced
    }

    /// The film has another size than in the file, and no crop.
    pub fn set_film(&mut self, width: u32, height: u32) {
        for desc in [&mut self.original, &mut self.change.desc] {
            (desc.film.width, desc.film.height, desc.film.crop) = (width, height, None);
        }
    }

    /// Edits without what [`camera`](Self::camera) is given: of a camera only the radius of its lens remains.
    pub fn without_pose(&self, edits: Edits) -> Edits {
        let file = &self.original.camera;
        let lens = edits.camera.filter(|camera| camera.aperture_radius != file.aperture_radius);
        let lens = lens.map(|lens| CameraDesc { aperture_radius: lens.aperture_radius, ..file.clone() });
        Edits { camera: lens, values: edits.values }
    }

    fn changed(&self, edits: Edits, forced: Vec<Forced>) -> Result<SceneChange> {
        let mut desc = edits.apply(&self.original).into_diagnostic()?;
        forced.iter().try_for_each(|forced| load::force(&mut desc, *forced))?;
        Ok(SceneChange { desc, edits, forced })
    }

    /// Prepares the scene with these edits and these effects in the place of the present ones. On an error it stays as it was.
    pub fn change(&mut self, edits: Edits, forced: Vec<Forced>) -> Result<()> {
        let change = self.changed(edits, forced)?;
        self.scene = Arc::new(self.scene.edited(&change.desc).into_diagnostic()?);
        self.change = change;
        Ok(())
    }

    /// As [`change`](Self::change), on another thread: the present scene is traced until [`adopt`](Self::adopt).
    ///
    /// # Errors
    ///
    /// When the scene has no place for the edits, or the system gives no thread.
    pub fn begin(&self, edits: Edits, forced: Vec<Forced>) -> Result<ScenePreparation> {
        let (change, scene) = (self.changed(edits, forced)?, self.scene());
        let desc = change.desc.clone();
        let job =
            Job::start("preparing the changed scene", move |_| scene.edited(&desc)).into_diagnostic()?;
        Ok(ScenePreparation { change, began: Instant::now(), job })
    }

    /// Traces the changed scene from now on.
    pub fn adopt(&mut self, changed: ChangedScene) {
        (self.change, self.scene) = (changed.change, Arc::new(changed.scene));
    }

    /// This camera, for a picture of this size in pixels.
    pub fn camera(&self, camera: CameraDesc, [width, height]: [u32; 2]) -> Result<Camera> {
        // A lens that is forced off is gone from there.
        let camera = CameraDesc { aperture_radius: self.desc().camera.aperture_radius, ..camera };
        let film = &self.original.film;
        // The picture is the crop window: the whole film keeps its proportion to it.
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
    /// Waits this long for the scene; gives the preparation back where it is not ready.
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
