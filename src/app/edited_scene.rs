//! A scene with changes: edits of values and effects that are forced, always applied to the scene as it was read.

use std::sync::Arc;

use miette::{IntoDiagnostic, Result};

use super::args::effects::Forced;
use super::load;
use crate::scene::SceneDesc;
use crate::scene::desc::CameraDesc;
use crate::scene::edit::Edits;
use crate::tracer::{Camera, PrepareOptions, Scene};

/// The scene as it is traced, and how it differs from the file's; the camera is not part of it.
#[derive(Clone)]
pub struct EditedScene {
    /// The scene as it was read, with the size that the command line asks for.
    original: SceneDesc,
    /// The scene with all edits and forced effects.
    desc: SceneDesc,
    /// `desc`, prepared for tracing.
    scene: Arc<Scene>,
    edits: Edits,
    forced: Vec<Forced>,
}

impl EditedScene {
    /// A scene without changes, and the same prepared for tracing.
    pub fn new(original: SceneDesc, scene: Scene) -> Self {
        let desc = original.clone();
        Self { original, desc, scene: Arc::new(scene), edits: Edits::default(), forced: Vec::new() }
    }

    /// The description as it was read.
    pub fn original(&self) -> &SceneDesc {
        &self.original
    }

    /// The description of what is traced, but for the camera.
    pub fn desc(&self) -> &SceneDesc {
        &self.desc
    }

    /// What is traced.
    pub fn scene(&self) -> Arc<Scene> {
        self.scene.clone()
    }

    /// The values that were changed.
    pub fn edits(&self) -> &Edits {
        &self.edits
    }

    /// The effects that are forced on or off.
    pub fn forced(&self) -> &[Forced] {
        &self.forced
    }

    /// The film has another size than in the file, and no crop.
    pub fn set_film(&mut self, width: u32, height: u32) {
        for desc in [&mut self.original, &mut self.desc] {
            (desc.film.width, desc.film.height, desc.film.crop) = (width, height, None);
        }
    }

    /// Prepares the scene with these edits and these effects in the place of the present ones. On an error it stays as it was.
    pub fn change(&mut self, edits: Edits, forced: Vec<Forced>) -> Result<()> {
        let mut desc = edits.apply(&self.original).into_diagnostic()?;
        forced.iter().try_for_each(|forced| load::force(&mut desc, *forced))?;
        self.scene = Arc::new(self.scene.edited(&desc).into_diagnostic()?);
        (self.desc, self.edits, self.forced) = (desc, edits, forced);
        Ok(())
    }

    /// This camera, for a picture of this size in pixels.
    pub fn camera(&self, camera: CameraDesc, [width, height]: [u32; 2]) -> Result<Camera> {
        // A lens that is forced off is gone from there.
        let camera = CameraDesc { aperture_radius: self.desc.camera.aperture_radius, ..camera };
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
