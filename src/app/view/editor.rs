//! The scene editor: the scene as the file has it, and what the user has changed of it: camera moves, values of objects,
//! effects that are forced on or off. It saves the changes as a scene file.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec2, DVec3};
use miette::{IntoDiagnostic, Result};

use crate::app::args::effects::Forced;
use crate::app::edited_scene::EditedScene;
use crate::app::run_spec::RunSpec;
use crate::app::view::saves::free_path;
use crate::client::window::history::CameraHistory;
use crate::client::window::navigation::{Gesture, Pose};
use crate::client::window::panel::{ParameterValue, SceneParameter, Selection};
use crate::scene::SceneDesc;
use crate::scene::desc::{CameraDesc, FovAxis};
use crate::scene::edit::{Editable, Edits, NewValue, editable, lights, shape_name};
use crate::tracer::effects::{Effect, decide};
use crate::tracer::{Camera, Pick, Scene};

/// The scene as it is traced, and how it differs from the file's.
pub struct SceneEditor {
    /// The scene with all edits of values and forced effects; the camera is the history's.
    edited: EditedScene,
    /// Moves of the camera, to undo and redo them.
    pub history: CameraHistory,
    selected: Option<u32>,
    /// The changes that were saved last, and their file.
    saved: Option<(Edits, PathBuf)>,
}

/// Lens numbers of the ray through the centre of the lens.
const CENTER: [f32; 2] = [0.5; 2];

impl SceneEditor {
    /// An editor of a scene without changes.
    pub fn new(original: SceneDesc, scene: Scene) -> Result<Self> {
        let camera = Camera::of(&original).into_diagnostic()?;
        let ahead = scene.pick(&camera.ray([0.5, 0.5], CENTER)).map_or(1.0, |pick| f64::from(pick.distance));
        // The target of a camera with a lens lies where the lens is focused, and stays in focus as the camera moves.
        let lens = original.camera.aperture_radius > 0.0;
        let ahead = if lens { original.camera.focus_distance } else { ahead };
        let home = Pose::of(&original.camera.to_world, pose_fov(&original.camera, ahead), ahead);
        let history = CameraHistory::new(home);
        Ok(Self { edited: EditedScene::new(original, scene), history, selected: None, saved: None })
    }

    /// The scene that is traced.
    pub fn scene(&self) -> Arc<Scene> {
        self.edited.scene()
    }

    /// The description of the scene that is traced, but for the camera.
    pub fn desc(&self) -> &SceneDesc {
        self.edited.desc()
    }

    fn original(&self) -> &SceneDesc {
        self.edited.original()
    }

    /// The camera as a scene file says it: the file's own where it was not moved.
    fn camera_desc(&self) -> CameraDesc {
        let (pose, camera) = (self.history.pose(), self.original().camera.clone());
        if !self.is_moved() {
            return camera;
        }
        if camera.orthographic {
            return CameraDesc { to_world: self.parallel_to_world(pose), ..camera };
        }
        let lens = camera.aperture_radius > 0.0;
        let focus_distance = if lens { pose.distance() } else { camera.focus_distance };
        CameraDesc { to_world: pose.to_world(), fov: pose.fov, focus_distance, ..camera }
    }

    /// The transform of a camera of parallel rays in this pose. It shows as much as a perspective camera of the pose's field of view does
    /// at the target, and stays as far from the target as it was, so that nothing is cut off that was seen.
    fn parallel_to_world(&self, pose: Pose) -> DAffine3 {
        let matrix = self.original().camera.to_world.matrix3;
        let [x, y, z] = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(DVec3::length);
        let width = (0.5 * pose.fov.to_radians()).tan() * pose.distance();
        let rigid = pose.to_world();
        let eye = pose.target - rigid.matrix3.z_axis * self.history.home().distance();
        let scale = DMat3::from_diagonal(DVec3::new(width, width * y / x, z));
        DAffine3::from_mat3_translation(rigid.matrix3 * scale, eye)
    }

    /// The camera for a picture of this size in pixels.
    pub fn camera(&self, size: [u32; 2]) -> Result<Camera> {
        self.edited.camera(self.camera_desc(), size)
    }

    /// Field of view, degrees.
    pub fn fov(&self) -> f64 {
        self.history.pose().fov
    }

    /// Moves the camera in a window of this size; returns whether anything changed.
    pub fn gesture(&mut self, gesture: Gesture, size: [u32; 2]) -> bool {
        let shape = shape(self.original().camera.fov_axis, size);
        self.history.apply(gesture, shape)
    }

    /// Whether the camera is elsewhere than where the file puts it.
    fn is_moved(&self) -> bool {
        self.history.pose() != self.history.home()
    }

    /// The surface that is seen at this position of a picture of this size, both in pixels.
    pub fn pick(&self, at: [f64; 2], size: [u32; 2]) -> Option<Pick> {
        let uv = [at[0] / f64::from(size[0].max(1)), at[1] / f64::from(size[1].max(1))];
        let inside = uv.iter().all(|x| (0.0..1.0).contains(x));
        let camera = self.camera(size).ok().filter(|_| inside)?;
        self.scene().pick(&camera.ray(uv, CENTER))
    }

    /// The selected shape.
    pub fn selected(&self) -> Option<u32> {
        self.selected
    }

    /// Selects a shape, or nothing.
    pub fn select(&mut self, shape: Option<u32>) {
        self.selected = shape;
    }

    /// The values of the selected shape that can be changed, as they are now; where nothing is selected, those of the lights that
    /// have no shape to click at.
    fn editables(&self) -> Vec<Editable> {
        let mut all = match self.selected {
            Some(shape) => editable(self.original(), shape),
            None => lights(self.original()),
        };
        for one in &mut all {
            one.value = self.edited.edits().get(one.target).unwrap_or(one.value);
        }
        all
    }

    /// The selected shape, or the lights, for the panel.
    pub fn selection(&self) -> Option<Selection> {
        let parameters = self.editables().into_iter().map(|one| SceneParameter {
            value: match one.value {
                NewValue::Scale(factor) => ParameterValue::Scale(factor),
                NewValue::Rgb(rgb) => ParameterValue::Color(rgb.map(|c| c as f32)),
                NewValue::Number(value) => {
                    let [min, max] = one.target.bounds();
                    ParameterValue::Number { value, min, max }
                }
            },
            label: one.label,
        });
        let parameters: Vec<SceneParameter> = parameters.collect();
        let name = match self.selected {
            Some(shape) => shape_name(self.original(), shape),
            None if parameters.is_empty() => return None,
            None => "Lights".to_owned(),
        };
        Some(Selection { name, selected: self.selected.is_some(), parameters })
    }

    /// Changes parameter `index` of the selected shape. On an error, such as a value out of range, the scene stays as it was.
    pub fn edit(&mut self, index: usize, value: ParameterValue) -> Result<()> {
        let Some(one) = self.editables().into_iter().nth(index) else { return Ok(()) };
        let value = match value {
            ParameterValue::Scale(factor) => NewValue::Scale(factor),
            ParameterValue::Color(rgb) => NewValue::Rgb(rgb.map(f64::from)),
            ParameterValue::Number { value, .. } => NewValue::Number(value),
        };
        let mut edits = self.edited.edits().clone();
        edits.set(one.target, value).into_diagnostic()?;
        self.edited.change(edits, self.forced().to_vec())
    }

    /// Forces an effect on or off. On an error the scene stays as it was.
    pub fn force(&mut self, new: Forced) -> Result<()> {
        let others = self.forced().iter().filter(|forced| forced.effect != new.effect);
        let forced = others.copied().chain([new]).collect();
        self.edited.change(self.edited.edits().clone(), forced)
    }

    /// Switches an effect: one that the scene calls for is forced off, any other is forced on, until it is switched back.
    pub fn switch(&mut self, effect: Effect) -> Result<()> {
        let mut forced = self.forced().to_vec();
        forced.retain(|forced| forced.effect != effect);
        if forced.len() == self.forced().len() {
            let plan = decide(self.desc(), self.desc().integrator.kind);
            let is_on = plan.iter().any(|decision| decision.effect == effect && decision.on);
            forced.push(Forced { effect, on: !is_on });
        }
        self.edited.change(self.edited.edits().clone(), forced)
    }

    /// Takes over from another reading of the same scene: where the camera was moved to, the effects that are forced, and the edits,
    /// by name. Returns the number of changes that have lost their object or have become impossible.
    pub fn take_over(&mut self, old: Self) -> usize {
        let name = |desc: &SceneDesc, shape| shape_name(desc, shape);
        self.selected = old.selected.filter(|s| name(old.original(), *s) == name(self.original(), *s));
        let (edits, mut lost) = old.edited.edits().carried(old.original(), self.original());
        let forced = old.forced().iter().filter(|forced| !self.forced().contains(forced));
        let forced: Vec<Forced> = forced.copied().collect();
        let changes = edits.values.len();
        if !edits.is_empty() && self.edited.change(edits, self.forced().to_vec()).is_err() {
            lost += changes;
        }
        if old.is_moved() {
            self.history = old.history.with_home(self.history.home());
        }
        lost + forced.into_iter().filter(|forced| self.force(*forced).is_err()).count()
    }

    /// The effects that are forced on or off.
    pub fn forced(&self) -> &[Forced] {
        self.edited.forced()
    }

    /// All changes against the file.
    pub fn edits(&self) -> Edits {
        let camera = self.is_moved().then(|| self.camera_desc());
        Edits { camera, ..self.edited.edits().clone() }
    }

    /// Saves camera and edits as a scene that includes the original, unless that was done already. `name` is the name of the
    /// scene.
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

    /// Saves camera and edits as a scene under this name that includes the original.
    pub fn save_as(&mut self, path: &Path, run: &RunSpec) -> Result<()> {
        self.edits().write(path, &run.scene, &run.defines, self.original()).into_diagnostic()
    }

    /// The camera in words.
    pub fn camera_words(&self) -> String {
        let pose = self.history.pose();
        let v = |v: glam::DVec3| format!("({:.3}, {:.3}, {:.3})", v.x, v.y, v.z);
        format!("{} to {}, {:.1}°", v(pose.eye), v(pose.target), pose.fov)
    }
}

/// The field of view of the pose of a camera whose target is `ahead`; of parallel rays one that shows as much there.
fn pose_fov(camera: &CameraDesc, ahead: f64) -> f64 {
    match camera.orthographic {
        true => 2.0 * (camera.to_world.matrix3.x_axis.length() / ahead).atan().to_degrees(),
        false => camera.fov,
    }
}

/// Half the picture's extent at distance 1 in units of `tan(fov / 2)`, as navigation wants it.
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
mod tests {
    use super::*;

    #[test]
    fn shape_follows_the_axis() {
        let wide = [200, 100];
        assert_eq!(shape(FovAxis::X, wide), DVec2::new(1.0, 0.5));
        assert_eq!(shape(FovAxis::Y, wide), DVec2::new(2.0, 1.0));
        assert_eq!(shape(FovAxis::Smaller, wide), shape(FovAxis::Y, wide));
        assert_eq!(shape(FovAxis::Larger, wide), shape(FovAxis::X, wide));
        assert_eq!(shape(FovAxis::Smaller, [100, 200]), shape(FovAxis::X, [100, 200]));
        assert!((shape(FovAxis::Diagonal, wide).length() - 1.0).abs() < 1e-12);
    }

    /// A camera of parallel rays turns, moves and zooms, and is saved as what it is.
    #[test]
    fn parallel_rays_stay_parallel() {
        let text = "<scene version=\"3.0.0\"><sensor type=\"orthographic\"><transform name=\"to_world\"><scale x=\"2\" y=\"3\" z=\"0.5\"/>\
                    <lookat origin=\"0,0,5\" target=\"0,0,0\" up=\"0,1,0\"/></transform></sensor>\
                    <shape type=\"rectangle\"/><emitter type=\"constant\"/></scene>";
        let desc = crate::scene::load_str("t.xml", text, &[]).expect("valid").desc;
        let home = desc.camera.to_world;
        let scene = Scene::prepare(&desc).expect("valid");
        let mut user = SceneEditor::new(desc, scene).expect("a camera");
        let lengths = |m: DMat3| [m.x_axis, m.y_axis, m.z_axis].map(DVec3::length);
        assert!(user.gesture(Gesture::Dolly(1.0), [200, 100]));
        let near = user.camera_desc().to_world;
        let [x, y, z] = lengths(near.matrix3);
        assert!((x - 1.8).abs() < 1e-9 && (y - 2.7).abs() < 1e-9 && (z - 0.5).abs() < 1e-9, "{x} {y} {z}");
        assert!((near.translation - home.translation).length() < 1e-9, "the eye stays where it is");
        assert!(user.pick([100.0, 50.0], [200, 100]).is_some_and(|pick| pick.shape == 0));
        for gesture in [
            Gesture::Orbit(DVec2::new(0.1, 0.2)),
            Gesture::Pan(DVec2::new(0.1, 0.1)),
            Gesture::Fly(DVec3::ONE),
            Gesture::Look(DVec2::new(0.1, 0.0)),
            Gesture::Fov(500.0),
            Gesture::Fov(-500.0),
        ] {
            assert!(user.gesture(gesture, [200, 100]), "{gesture:?}");
            assert!(user.camera([200, 100]).is_ok(), "{gesture:?}");
        }
        // What is panned by a tenth of the width moves by a tenth of what is seen.
        while user.history.undo().is_some() {}
        user.gesture(Gesture::Pan(DVec2::new(0.1, 0.0)), [200, 100]);
        let moved = user.camera_desc().to_world.translation.distance(home.translation);
        assert!((moved - 0.4).abs() < 1e-9, "{moved}");
    }

    /// A lens stays focused as in the file until the camera moves, and then on the target; a pinhole has no focus.
    #[test]
    fn a_lens_focuses_on_the_target() {
        let focus_after = |sensor: &str, point: DVec3| {
            let text = format!("<scene version=\"3.0.0\">{sensor}<emitter type=\"constant\"/></scene>");
            let desc = crate::scene::load_str("t.xml", &text, &[]).expect("valid").desc;
            let scene = Scene::prepare(&desc).expect("valid");
            let mut user = SceneEditor::new(desc, scene).expect("a camera");
            let before = user.camera_desc().focus_distance;
            user.gesture(Gesture::Focus(point), [200, 100]);
            (before, user.camera_desc().focus_distance)
        };
        let lens = "<sensor type=\"thinlens\"><float name=\"aperture_radius\" value=\"0.1\"/>\
                    <float name=\"focus_distance\" value=\"2.5\"/></sensor>";
        let (before, after) = focus_after(lens, DVec3::new(1.0, 2.0, 2.0));
        assert!(before == 2.5 && (after - 3.0).abs() < 1e-12, "{before} {after}");
        assert_eq!(focus_after("<sensor type=\"perspective\"/>", DVec3::new(1.0, 2.0, 2.0)), (0.0, 0.0));
    }
}
