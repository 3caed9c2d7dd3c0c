//! Two eyes in the place of the camera: their rig, which stays as it is while the camera moves, their cameras, and the depths they see.

use glam::DVec3;
use miette::{IntoDiagnostic, Result};

use crate::image::stereo::Eye;
use crate::scene::desc::{ComfortableDepth, ConvergenceChoice, StereoRig, StereoScreen};
use crate::tracer::Camera;
use crate::viewer::editor::{CENTER, SceneEditor};

/// Columns and rows of the rays that find the depths of what is seen.
const DEPTH_RAYS: [u32; 2] = [24, 16];

/// What two eyes see of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenDepth {
    /// The nearest and the farthest depth along the camera's axis, world units; `None` where nothing is seen.
    pub range: Option<[f64; 2]>,
    /// The depths that are comfortable to look at.
    pub comfortable: ComfortableDepth,
}

impl SceneEditor {
    /// The eyes, if there are two.
    pub fn rig(&self) -> Option<StereoRig> {
        self.rig
    }

    /// Sees with these two eyes from the next epoch on, or with the camera alone.
    ///
    /// # Errors
    ///
    /// Those of [`StereoRig::eyes`]; nothing changes then.
    pub fn set_rig(&mut self, rig: Option<StereoRig>) -> Result<()> {
        if let Some(rig) = rig {
            rig.eyes(&self.camera_desc(), 1.0).into_diagnostic()?;
        }
        self.rig = rig;
        Ok(())
    }

    /// Sees with the two eyes that are asked for. The subject is what is in focus or in the middle of the picture, or else what the camera
    /// orbits about.
    ///
    /// # Errors
    ///
    /// Those of [`StereoRig::of`] and [`set_rig`](Self::set_rig).
    pub fn open_eyes(
        &mut self,
        interocular: Option<f64>,
        convergence: ConvergenceChoice,
        size: [u32; 2],
    ) -> Result<()> {
        let middle = self.pick(size.map(|n| 0.5 * f64::from(n)), size);
        let depth = middle.map(|pick| self.depth(pick.position)).filter(|depth| *depth > 0.0);
        let depth = depth.unwrap_or(self.pose().distance());
        let rig = StereoRig::of(interocular, convergence, &self.camera_desc(), Some(depth));
        self.set_rig(Some(rig.into_diagnostic()?))
    }

    /// Depth of a world-space point along the axis of the camera, world units.
    pub fn depth(&self, point: DVec3) -> f64 {
        let to_world = self.camera_desc().to_world;
        (point - to_world.translation).dot(to_world.matrix3.z_axis.normalize_or_zero())
    }

    /// Width over height of the full film of a picture of this size, which may be a part of it.
    fn film_aspect(&self, [width, height]: [u32; 2]) -> f64 {
        let film = &self.original().film;
        let [across, down] = film.crop.map_or([1.0; 2], |crop| {
            [(film.width, crop.width), (film.height, crop.height)]
                .map(|(whole, part)| f64::from(whole) / f64::from(part.max(1)))
        });
        f64::from(width) * across / (f64::from(height.max(1)) * down)
    }

    /// The cameras of the left and of the right eye for pictures of this size; `None` for one eye.
    pub fn eyes(&self, size: [u32; 2]) -> Result<Option<[Camera; 2]>> {
        let Some(rig) = self.rig else { return Ok(None) };
        let [left, right] = rig.eyes(&self.camera_desc(), self.film_aspect(size)).into_diagnostic()?;
        Ok(Some([self.edited.camera(left, size)?, self.edited.camera(right, size)?]))
    }

    /// The cameras through which the picture is seen, for pictures of this size: one, or those of the left and of the right eye.
    pub fn cameras(&self, size: [u32; 2]) -> Result<Vec<Camera>> {
        match self.eyes(size)? {
            Some(eyes) => Ok(eyes.into()),
            None => Ok(vec![self.camera(size)?]),
        }
    }

    /// The camera through which the picture is seen: that of the left eye, if there are two.
    pub fn seeing_camera(&self, size: [u32; 2]) -> Result<Camera> {
        match self.eyes(size)? {
            Some([left, _]) => Ok(left),
            None => self.camera(size),
        }
    }

    /// The place in the left eye's picture of what an eye sees at a place of its own, both in pixels. Where the right eye sees nothing, or what
    /// the left one does not have in its picture, it is the same place.
    pub fn in_left_eye(&self, (eye, place): (Eye, [f64; 2]), size: [u32; 2]) -> [f64; 2] {
        let found = || {
            let [left, right] = self.eyes(size).ok()??;
            let ray = right.ray([0, 1].map(|i| place[i] / f64::from(size[i].max(1))), CENTER)?;
            let point = self.scene().pick(&ray)?.position;
            let uv = left.screen_position(self.original().space.point(point))?;
            let inside = [uv.x, uv.y].iter().all(|x| (0.0..1.0).contains(x));
            inside.then(|| [uv.x * f64::from(size[0]), uv.y * f64::from(size[1])])
        };
        if eye == Eye::Left { place } else { found().unwrap_or(place) }
    }

    /// What two eyes see of the scene in pictures of this size, found by a few rays; `None` for one eye.
    pub fn seen_depth(&self, size: [u32; 2]) -> Option<SeenDepth> {
        let (rig, camera) = (self.rig?, self.seeing_camera(size).ok()?);
        let scene = self.scene();
        let comfortable =
            ComfortableDepth::of(&rig, &self.camera_desc(), self.film_aspect(size), StereoScreen::default());
        let [columns, rows] = DEPTH_RAYS;
        let places = (0..rows).flat_map(|y| (0..columns).map(move |x| [x, y]));
        let depths = places.filter_map(|[x, y]| {
            let uv = [(f64::from(x) + 0.5) / f64::from(columns), (f64::from(y) + 0.5) / f64::from(rows)];
            let pick = scene.pick(&camera.ray(uv, CENTER)?)?;
            Some(self.depth(pick.position))
        });
        let range = depths.fold(None, |range: Option<[f64; 2]>, depth| {
            let [near, far] = range.unwrap_or([depth; 2]);
            Some([near.min(depth), far.max(depth)])
        });
        Some(SeenDepth { range, comfortable: comfortable.ok()? })
    }
}

impl SeenDepth {
    /// Whether all that is seen is comfortable to look at.
    pub fn is_comfortable(&self) -> bool {
        self.range.is_none_or(|[near, far]| near >= self.comfortable.near && far <= self.comfortable.far)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::desc::StereoConvergence;
    use crate::tracer::Scene;

    const SIZE: [u32; 2] = [200, 100];

    /// A camera of this kind six units in front of a wall.
    fn editor(sensor: &str) -> SceneEditor {
        let text = format!(
            "<scene version=\"3.0.0\"><sensor type=\"{sensor}\"><transform name=\"to_world\">\
             <lookat origin=\"0,0,6\" target=\"0,0,0\" up=\"0,1,0\"/></transform></sensor><shape type=\"rectangle\">\
             <transform name=\"to_world\"><scale value=\"20\"/></transform></shape><emitter type=\"constant\"/></scene>"
        );
        let text = text.replace("\"perspective\">", "\"perspective\"><float name=\"fov\" value=\"60\"/>");
        let desc = crate::scene::load_str("t.xml", &text, &[]).expect("valid").desc;
        let scene = Scene::prepare(&desc).expect("valid");
        SceneEditor::new(desc, scene).expect("a camera")
    }

    #[test]
    fn a_point_is_found_in_the_pictures_of_both_eyes() {
        let mut user = editor("perspective");
        assert!(user.eyes(SIZE).expect("valid").is_none() && user.seen_depth(SIZE).is_none());
        user.open_eyes(None, ConvergenceChoice::Subject, SIZE).expect("a wall");
        let rig = user.rig().expect("two eyes");
        let StereoConvergence::OffAxis { distance } = rig.convergence else { panic!("{rig}") };
        assert!((distance - 6.0).abs() < 1e-4 && (rig.interocular - 0.2).abs() < 1e-5, "{rig}");
        let near = |found: [f64; 2], x: f64| (found[0] - x).abs() < 1e-2 && (found[1] - 40.0).abs() < 1e-2;
        let found = |user: &SceneEditor, eye, x: f64| user.in_left_eye((eye, [x, 40.0]), SIZE);
        assert!(near(found(&user, Eye::Right, 120.0), 120.0), "the wall is in the plane of the screen");
        let seen = user.seen_depth(SIZE).expect("two eyes");
        let [first, last] = seen.range.expect("a wall");
        assert!((first - 6.0).abs() < 1e-4 && (last - 6.0).abs() < 1e-4 && seen.is_comfortable(), "{seen:?}");
        // Parallel eyes see the wall as far apart as it is near.
        let parallel = StereoRig { convergence: StereoConvergence::Parallel, ..rig };
        user.set_rig(Some(parallel)).expect("valid");
        let shift = 100.0 / 30f64.to_radians().tan() * rig.interocular / 6.0;
        assert!(near(found(&user, Eye::Right, 120.0), 120.0 + shift));
        assert!(near(found(&user, Eye::Left, 120.0), 120.0));
        assert!(near(found(&user, Eye::Right, 199.0), 199.0), "it is beside the left eye's picture");
        assert!(!user.seen_depth(SIZE).expect("two eyes").is_comfortable());
        user.set_rig(None).expect("one eye");
        assert!(user.eyes(SIZE).expect("valid").is_none());
    }

    #[test]
    fn cameras_without_two_eyes_are_refused() {
        let mut user = editor("orthographic");
        assert!(user.open_eyes(None, ConvergenceChoice::Subject, SIZE).is_err() && user.rig().is_none());
    }
}
