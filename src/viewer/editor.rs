//! The scene editor: the scene as loaded from its file and the user's changes to it (camera moves, object parameters, transforms,
//! forced effects) in one undo history. It saves the changes as a scene file.
//!
//! A change enters the history at once. The changed scene is prepared on a thread ([`ScenePreparation`]); if that takes longer than
//! a few frames, the old scene is traced meanwhile. `parameters` edits what the panel shows of objects and lights;
//! `transform` moves, rotates and scales objects; `lens` has the parameters of the camera's lens, `stereo` two eyes in its place.

mod lens;
pub mod parameters;
mod stereo;
mod transform;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use glam::{DAffine3, DMat3, DVec2, DVec3};
use miette::{IntoDiagnostic, Result};

use crate::client::window::history::UndoHistory;
use crate::client::window::navigation::{Gesture, Pose};
use crate::render::edited_scene::{EditedScene, ScenePreparation};
use crate::render::forced::Forced;
use crate::render::run_spec::RunSpec;
use crate::scene::SceneDesc;
use crate::scene::desc::{CameraDesc, FovAxis, ProjectionDesc, StereoRig};
use crate::scene::edit::{Edits, shape_name};
use crate::stream::UvWindow;
use crate::tracer::accel::Ray;
use crate::tracer::effects::{Effect, decide};
use crate::tracer::medium::CameraMedium;
use crate::tracer::{Camera, MediumPick, Pick, Scene};
use crate::viewer::saves::free_path;

use transform::TransformDrag;

pub use stereo::SeenDepth;
pub use transform::SightLine;

/// Editable state: one entry of the undo history.
#[derive(Clone, Debug, PartialEq)]
struct EditorState {
    pose: Pose,
    /// Lens radius in scene units, if changed from the file's.
    aperture: Option<f64>,
    /// Changed parameters. Their camera is unused; `pose` has it.
    edits: Arc<Edits>,
    /// Effects that are forced on or off.
    forced: Arc<Vec<Forced>>,
}

/// The selected shape.
#[derive(Clone, Copy, Debug)]
struct SelectedShape {
    shape: u32,
    /// Bounding box in object space; `None` if empty.
    bounds: Option<[DVec3; 2]>,
}

/// The traced scene and its changes against the file.
pub struct SceneEditor {
    /// The scene with edited parameters and forced effects. Its camera is ignored; the history has the camera.
    edited: EditedScene,
    /// The scene being prepared, to be traced next.
    preparing: Option<ScenePreparation>,
    /// How long the last preparation took.
    took: Duration,
    /// Undo history of all changes.
    history: UndoHistory<EditorState>,
    /// The state that was opened: the file's, with the effects that the command line forces.
    opened: EditorState,
    selected: Option<SelectedShape>,
    drag: Option<TransformDrag>,
    /// The eyes, if there are two.
    rig: Option<StereoRig>,
    /// The last saved changes and the file they were saved to.
    saved: Option<(Edits, PathBuf)>,
}

/// Lens numbers of the ray through the centre of the lens.
const CENTER: [f32; 2] = [0.5; 2];

/// Stands for the field of view of panoramas and fisheye lenses in navigation, degrees.
const OTHER_FOV: f64 = 90.0;

/// If a changed scene is ready within this time, it is traced without showing the old one again.
const PATIENCE: Duration = Duration::from_millis(40);

impl SceneEditor {
    /// An editor of a scene without changes.
    pub fn new(original: SceneDesc, scene: Scene) -> Result<Self> {
        let camera = Camera::of(&original).into_diagnostic()?;
        let ahead = camera.ray([0.5, 0.5], CENTER).and_then(|ray| scene.pick(&ray));
        let ahead = ahead.map_or(1.0, |pick| f64::from(pick.distance));
        // A thin-lens camera's target lies in the plane of focus and stays there as the camera moves.
        let lens = original.camera.perspective().map(|p| p.lens).filter(|lens| lens.radius > 0.0);
        let ahead = lens.map_or(ahead, |lens| lens.focus_distance);
        let home = Pose::of(&original.camera.to_world, pose_fov(&original.camera, ahead), ahead);
        let state = EditorState { pose: home, aperture: None, edits: Arc::default(), forced: Arc::default() };
        Ok(Self {
            edited: EditedScene::new(original, scene),
            preparing: None,
            took: Duration::ZERO,
            history: UndoHistory::new(state.clone()),
            opened: state,
            selected: None,
            drag: None,
            rig: None,
            saved: None,
        })
    }

    /// Scene being traced.
    pub fn scene(&self) -> Arc<Scene> {
        self.edited.scene()
    }

    /// Description of the scene being traced, except for the camera.
    pub fn desc(&self) -> &SceneDesc {
        self.edited.desc()
    }

    fn original(&self) -> &SceneDesc {
        self.edited.original()
    }

    fn state(&self) -> &EditorState {
        self.history.state()
    }

    /// Camera pose.
    pub fn pose(&self) -> Pose {
        self.state().pose
    }

    /// Camera parameters for a scene file: the original's if unchanged.
    fn camera_desc(&self) -> CameraDesc {
        let (pose, camera) = (self.pose(), self.original().camera.clone());
        let aperture_radius = self.aperture();
        if !self.is_moved() && aperture_radius == camera.lens_radius() {
            return camera;
        }
        if camera.is_orthographic() {
            return CameraDesc { to_world: self.parallel_to_world(pose), ..camera };
        }
        let to_world = match (self.is_moved(), &camera.projection) {
            (false, _) => camera.to_world,
            // The surface of a meter keeps its size.
            (true, ProjectionDesc::Irradiance(_)) => {
                let matrix = camera.to_world.matrix3;
                let [x, y, z] = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(DVec3::length);
                pose.to_world() * DAffine3::from_scale(DVec3::new(x, y, z))
            }
            (true, _) => pose.to_world(),
        };
        let mut camera = CameraDesc { to_world, ..camera };
        if let Some(perspective) = camera.perspective_mut() {
            perspective.fov = pose.fov;
            perspective.lens.radius = aperture_radius;
            // A lens is focused on the target.
            if aperture_radius > 0.0 {
                perspective.lens.focus_distance = pose.distance();
            }
        }
        camera
    }

    /// Camera-to-world transform of an orthographic camera in this pose. At the target it shows the same extent as a perspective camera
    /// with the pose's field of view. It keeps the original distance from the target, so that its near plane cuts off nothing that was
    /// visible before.
    fn parallel_to_world(&self, pose: Pose) -> DAffine3 {
        let matrix = self.original().camera.to_world.matrix3;
        let [x, y, z] = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(DVec3::length);
        let width = (0.5 * pose.fov.to_radians()).tan() * pose.distance();
        let rigid = pose.to_world();
        let eye = pose.target - rigid.matrix3.z_axis * self.opened.pose.distance();
        let scale = DMat3::from_diagonal(DVec3::new(width, width * y / x, z));
        DAffine3::from_mat3_translation(rigid.matrix3 * scale, eye)
    }

    /// Camera for a picture of this size in pixels.
    pub fn camera(&self, size: [u32; 2]) -> Result<Camera> {
        self.edited.camera(self.camera_desc(), size)
    }

    /// Field of view, degrees.
    pub fn fov(&self) -> f64 {
        self.pose().fov
    }

    /// Whether the user can change the field of view: not that of fisheye lenses, panoramas, single rays and several cameras.
    pub fn has_fov(&self) -> bool {
        let camera = &self.original().camera;
        camera.is_orthographic() || camera.perspective().is_some()
    }

    /// Moves the camera of a picture of this size; returns whether anything changed. Until [`end_change`](Self::end_change), moves of the
    /// same kind share one history entry; flying and looking count as one kind.
    pub fn gesture(&mut self, gesture: Gesture, size: [u32; 2]) -> bool {
        let camera = &self.original().camera;
        if matches!(gesture, Gesture::Fov(_)) && !self.has_fov() {
            return false;
        }
        let shape = shape(camera.perspective().map_or(FovAxis::X, |perspective| perspective.fov_axis), size);
        let name = match gesture {
            Gesture::Orbit(_) => "orbit of the camera",
            Gesture::Pan(_) => "pan of the camera",
            Gesture::Dolly(_) => "dolly of the camera",
            Gesture::Fly(_) | Gesture::Look(_) => "flight of the camera",
            Gesture::Fov(_) => "field of view",
            Gesture::Focus(_) => "focus of the camera",
        };
        self.set_pose(name, self.pose().apply_in(gesture, shape))
    }

    /// Sets the field of view in degrees; returns whether it changed.
    pub fn set_fov(&mut self, fov: f64) -> bool {
        self.gesture(Gesture::Fov(fov - self.fov()), [1, 1])
    }

    /// Resets the camera to the file's pose; returns whether it was elsewhere.
    pub fn reset_camera(&mut self) -> bool {
        self.end_change();
        self.set_pose("reset of the camera", self.opened.pose)
    }

    /// Returns to the scene and the camera that were opened, as one change that can be undone. Call [`follow`](Self::follow) afterwards.
    pub fn start_over(&mut self) {
        self.end_change();
        self.history.change("start over", "start over", self.opened.clone());
        self.end_change();
        self.select(None);
    }

    /// Moves the camera to a pose; returns whether it was elsewhere.
    pub fn go_to(&mut self, pose: Pose) -> bool {
        self.end_change();
        let moved = pose.is_usable() && self.set_pose("view of the camera", pose);
        self.end_change();
        moved
    }

    fn set_pose(&mut self, name: &str, pose: Pose) -> bool {
        let state = EditorState { pose, ..self.state().clone() };
        self.history.change(name, name, state)
    }

    /// Ends a drag or a run of steps: the next change begins a new history entry.
    pub fn end_change(&mut self) {
        self.drag = None;
        self.history.end();
    }

    /// Undoes the last change and returns its name. Call [`follow`](Self::follow) afterwards.
    pub fn undo(&mut self) -> Option<String> {
        self.drag = None;
        self.history.undo()
    }

    /// Redoes the last undone change and returns its name. Call [`follow`](Self::follow) afterwards.
    pub fn redo(&mut self) -> Option<String> {
        self.drag = None;
        self.history.redo()
    }

    /// Whether the camera differs from the file's.
    fn is_moved(&self) -> bool {
        self.pose() != self.opened.pose
    }

    /// Surface visible at a position of a picture of this size, both in pixels.
    pub fn pick(&self, at: [f64; 2], size: [u32; 2]) -> Option<Pick> {
        let (_, ray) = self.ray_through(at, size)?;
        self.scene().pick(&ray)
    }

    /// Medium that hides what is behind it at a position of a picture of this size, both in pixels.
    pub fn pick_medium(&self, at: [f64; 2], size: [u32; 2]) -> Option<MediumPick> {
        let (camera, ray) = self.ray_through(at, size)?;
        let scene = self.scene();
        let medium = CameraMedium::of(&scene, &camera, &UvWindow::PICTURE).along(&scene, &ray);
        scene.pick_medium(&ray, medium)
    }

    /// Ray through the lens centre and a position of a picture of this size, both in pixels; `None` beside the picture.
    fn ray_through(&self, at: [f64; 2], size: [u32; 2]) -> Option<(Camera, Ray)> {
        let uv = [at[0] / f64::from(size[0].max(1)), at[1] / f64::from(size[1].max(1))];
        let inside = uv.iter().all(|x| (0.0..1.0).contains(x));
        let camera = self.seeing_camera(size).ok().filter(|_| inside)?;
        let ray = camera.ray(uv, CENTER)?;
        Some((camera, ray))
    }

    /// The selected shape.
    pub fn selected(&self) -> Option<u32> {
        self.selected.map(|selected| selected.shape)
    }

    /// Distance of a world-space point from the camera.
    pub fn distance_to(&self, place: DVec3) -> f64 {
        self.pose().eye.distance(place)
    }

    /// Selects a shape, or clears the selection.
    pub fn select(&mut self, shape: Option<u32>) {
        self.end_change();
        self.selected =
            shape.map(|shape| SelectedShape { shape, bounds: self.original().object_bounds(shape) });
    }

    /// Whether there are parameter changes since the last save.
    pub fn has_unsaved_changes(&self) -> bool {
        let edits = self.edits();
        !edits.values.is_empty() && self.saved.as_ref().is_none_or(|(saved, _)| *saved != edits)
    }

    /// Edits and forced effects of the present history state, from which the scene is prepared.
    fn wanted(&self) -> (Edits, Vec<Forced>) {
        let EditorState { aperture, edits, forced, .. } = self.state();
        let camera = self.original().camera.clone();
        let camera = aperture.map(|radius| camera.with_lens_radius(radius));
        (Edits { camera, values: edits.values.clone() }, forced.to_vec())
    }

    /// Brings the traced scene up to date with the history. Must be called after every change and then polled, because another thread
    /// prepares the scene. Returns whether another scene is traced from now on.
    ///
    /// # Errors
    ///
    /// When the scene cannot be prepared; the last change is then undone.
    pub fn follow(&mut self) -> Result<bool> {
        let followed = self.try_follow();
        if followed.is_err() {
            self.preparing = None;
            self.history.undo();
        }
        followed
    }

    fn try_follow(&mut self) -> Result<bool> {
        let mut adopted = false;
        loop {
            let patience = if self.took > PATIENCE { Duration::ZERO } else { PATIENCE };
            let (preparation, patience) = match self.preparing.take() {
                Some(preparation) => (preparation, Duration::ZERO),
                None => {
                    let (edits, forced) = self.wanted();
                    if *self.edited.edits() == edits && self.edited.forced() == forced {
                        return Ok(adopted);
                    }
                    (self.edited.begin(edits, forced)?, patience)
                }
            };
            match preparation.wait(patience)? {
                Ok(changed) => {
                    self.took = changed.took;
                    self.edited.adopt(changed);
                    adopted = true;
                }
                Err(preparation) => {
                    self.preparing = Some(preparation);
                    return Ok(adopted);
                }
            }
        }
    }

    /// Whether a changed scene is being prepared.
    pub fn is_preparing(&self) -> bool {
        self.preparing.is_some()
    }

    /// Forces an effect on or off, as if the file said so. On an error the scene stays unchanged.
    pub fn force(&mut self, new: Forced) -> Result<()> {
        let others = self.forced().iter().filter(|forced| forced.effect != new.effect);
        let forced: Vec<Forced> = others.copied().chain([new]).collect();
        self.edited.change(self.edited.edits().clone(), forced.clone())?;
        self.opened = EditorState { forced: Arc::new(forced), ..self.state().clone() };
        self.history = UndoHistory::new(self.opened.clone());
        Ok(())
    }

    /// Toggles an effect: one that the scene needs is forced off, any other is forced on; toggling again removes the override. Blocks until
    /// the scene is prepared.
    pub fn switch(&mut self, effect: Effect) -> Result<()> {
        let mut forced = self.state().forced.to_vec();
        forced.retain(|forced| forced.effect != effect);
        if forced.len() == self.state().forced.len() {
            let plan = decide(self.desc(), self.desc().integrator.kind);
            let is_on = plan.iter().any(|decision| decision.effect == effect && decision.on);
            forced.push(Forced { effect, on: !is_on });
        }
        let (edits, _) = self.wanted();
        self.edited.change(edits, forced.clone())?;
        self.preparing = None;
        self.end_change();
        let state = EditorState { forced: Arc::new(forced), ..self.state().clone() };
        self.history.change("effects", &format!("switch of {}", effect.name()), state);
        self.end_change();
        Ok(())
    }

    /// Transfers history and edits, matched by name, from an earlier load of the same scene. Returns the number of changes in the present
    /// state that have lost their object or are no longer valid.
    pub fn take_over(&mut self, old: Self) -> usize {
        let name = |desc: &SceneDesc, shape| shape_name(desc, shape);
        let known = |s: &SelectedShape| name(old.original(), s.shape) == name(self.original(), s.shape);
        let selected = old.selected.filter(known).map(|s| s.shape);
        let (_, lost) = old.state().edits.carried(old.original(), self.original());
        let initial = self.history.clone();
        // Cache: many history states share their edits.
        let mut carried: Option<[Arc<Edits>; 2]> = None;
        let mut carry = |edits: Arc<Edits>| match &carried {
            Some([from, to]) if Arc::ptr_eq(from, &edits) => to.clone(),
            _ => {
                let to = Arc::new(edits.carried(old.edited.original(), self.edited.original()).0);
                carried = Some([edits, to.clone()]);
                to
            }
        };
        let [home, before] = [&*self, &old].map(|editor| editor.opened.pose);
        let history = old.history.clone().map(|state| EditorState {
            pose: if state.pose == before { home } else { state.pose },
            edits: carry(state.edits),
            ..state
        });
        self.history = history;
        self.select(selected);
        let (edits, forced) = self.wanted();
        let changes = edits.values.len() + forced.len();
        match self.edited.change(edits, forced) {
            Ok(()) => lost,
            Err(_) => {
                let pose = self.pose();
                self.history = initial;
                self.set_pose("camera", pose);
                lost + changes
            }
        }
    }

    /// The effects that are forced on or off.
    pub fn forced(&self) -> &[Forced] {
        self.edited.forced()
    }

    /// All changes of the traced scene against the file.
    pub fn edits(&self) -> Edits {
        let camera = self.camera_desc();
        let camera = (camera != self.original().camera).then_some(camera);
        Edits { camera, values: self.edited.edits().values.clone() }
    }

    /// Saves camera and edits as a scene file that includes the original, unless they are saved already. `name` is the name of the scene.
    pub fn save(&mut self, name: &str, run: &RunSpec) -> Result<PathBuf> {
        let edits = self.edits();
        if let Some((saved, path)) = &self.saved
            && *saved == edits
            && path.exists()
        {
            return Ok(path.clone());
        }
        let path = free_path(name, "xml", |_| false)?;
        edits.write(&path, &run.scene, &run.defines, self.original()).into_diagnostic()?;
        self.saved = Some((edits, path.clone()));
        Ok(path)
    }

    /// Specification of the render of the present scene. If camera or scene were changed, a scene file with the changes is saved first.
    pub fn present_run_spec(&mut self, name: &str, run: &RunSpec) -> Result<RunSpec> {
        let mut present = RunSpec { size: Some((run.film.width, run.film.height)), ..run.clone() };
        if !self.edits().is_empty() {
            present.scene = self.save(name, run)?;
            present.defines.clear();
        }
        Ok(present)
    }

    /// Saves camera and edits in a scene file at this path that includes the original.
    pub fn save_as(&mut self, path: &Path, run: &RunSpec) -> Result<()> {
        let edits = self.edits();
        edits.write(path, &run.scene, &run.defines, self.original()).into_diagnostic()?;
        self.saved = Some((edits, path.to_path_buf()));
        Ok(())
    }

    /// Camera description for the user.
    pub fn camera_words(&self) -> String {
        let pose = self.pose();
        let v = |v: glam::DVec3| format!("({:.3}, {:.3}, {:.3})", v.x, v.y, v.z);
        let fov = if self.has_fov() { format!(", {:.1}°", pose.fov) } else { String::new() };
        format!("{} to {}{fov}", v(pose.eye), v(pose.target))
    }
}

impl SceneEditor {
    /// Name of the change that undo would revert, such as `move of ball`.
    pub fn undo_name(&self) -> Option<&str> {
        self.history.undo_name()
    }

    /// Name of the change that redo would repeat.
    pub fn redo_name(&self) -> Option<&str> {
        self.history.redo_name()
    }
}

/// Field of view of the pose of a camera whose target is at distance `ahead`. For an orthographic camera, one with the same extent there.
/// For one whose field of view is its projection's own, a usual one, by which navigation knows how far to move.
fn pose_fov(camera: &CameraDesc, ahead: f64) -> f64 {
    match &camera.projection {
        ProjectionDesc::Orthographic => {
            2.0 * (camera.to_world.matrix3.x_axis.length() / ahead).atan().to_degrees()
        }
        ProjectionDesc::Perspective(perspective) => perspective.fov,
        _ => OTHER_FOV,
    }
}

/// Half the picture's extent at distance 1, in units of `tan(fov / 2)`, for navigation.
fn shape(axis: FovAxis, [width, height]: [u32; 2]) -> DVec2 {
    let aspect = f64::from(width.max(1)) / f64::from(height.max(1));
    let along_x = DVec2::new(1.0, aspect.recip());
    let along_y = DVec2::new(aspect, 1.0);
    match axis {
        FovAxis::X => along_x,
        FovAxis::Y => along_y,
        FovAxis::Diagonal => along_y.normalize(),
        FovAxis::Smaller if aspect < 1.0 => along_x,
        FovAxis::Larger if aspect >= 1.0 => along_x,
        FovAxis::Smaller | FovAxis::Larger => along_y,
    }
}

#[cfg(test)]
mod tests;
