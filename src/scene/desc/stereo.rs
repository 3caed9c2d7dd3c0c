//! Stereo rigs: the cameras of two eyes in the place of one, and the depths that are comfortable to look at.
//!
//! Both eyes look along the axis of the camera, which lies in the middle between them. Where they shall converge at a distance their pictures
//! are shifted and not their axes turned: turned-in pictures are trapezoids of opposite sense, and what is left or right
//! of their middle stands at another height for one eye than for the other (Woods, Docherty, Koch, “Image distortions in
//! stereoscopic video systems”, SPIE 1915, 1993).

use super::camera::{CameraDesc, PerspectiveDesc, ProjectionDesc};
use super::ids::Place;

/// Two eyes side by side.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct StereoRig {
    /// Distance between the eyes, world units.
    pub interocular: f64,
    /// What the eyes look at.
    pub convergence: StereoConvergence,
}

/// What the eyes of a rig look at.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum StereoConvergence {
    /// Infinity: everything is in front of the screen.
    Parallel,
    /// The plane at this distance along the camera's axis, world units: what is there has the same place in both pictures, and is seen in
    /// the plane of the screen.
    OffAxis {
        /// The distance.
        distance: f64,
    },
}

/// The convergence that a user asks for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum ConvergenceChoice {
    /// [`StereoConvergence::OffAxis`] at the distance in focus or, for a pinhole, at that of what is seen in the middle.
    #[default]
    Subject,
    /// [`StereoConvergence::OffAxis`] at this distance, world units.
    Distance(f64),
    /// [`StereoConvergence::Parallel`].
    Parallel,
}

/// The distance of the subject over that of the eyes (the “1/30 rule” of stereo photography).
const SUBJECT_PER_INTEROCULAR: f64 = 30.0;

/// Why there are no cameras for two eyes.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StereoRigError {
    /// The distance between the eyes is of no use.
    #[error("the distance between the eyes must be a finite number above 0, not {0}")]
    Interocular(f64),
    /// The distance of convergence is of no use.
    #[error(
        "the distance at which the eyes converge must be a finite number above 0, not {0}; parallel eyes converge at infinity"
    )]
    Distance(f64),
    /// A convergence that is no number and of no known name.
    #[error(
        "`{0}` is no convergence of the eyes: give a distance in units of the scene, `parallel` or `subject`"
    )]
    Unknown(String),
    /// Toed-in eyes.
    #[error(
        "toed-in eyes are not offered: their pictures are trapezoids of opposite sense, so that points beside the middle stand at different \
         heights for both eyes, which strains them; a distance shifts the pictures instead and shows the same depth"
    )]
    ToedIn,
    /// Nothing tells the distance of convergence.
    #[error(
        "nothing is seen in the middle of the picture, so the eyes have nothing to converge at: give the distance, or `parallel`"
    )]
    NoSubject,
    /// The camera is none with a plane of projection and a centre.
    #[error(
        "the camera at line {}, column {} has no stereo pictures of two eyes: only those of `perspective` and `thinlens` without distortion can be \
         shifted so that both converge at a distance; for a panorama use the camera `ods`",
        place.line, place.column
    )]
    Projection {
        /// The camera's place in the scene file.
        place: Place,
    },
    /// The screen is of no use.
    #[error(
        "the width of the screen and the distance it is seen from must be finite numbers above 0, not {width} and {distance}"
    )]
    Screen {
        /// Its width in metres.
        width: f64,
        /// The viewer's distance in metres.
        distance: f64,
    },
}

impl ConvergenceChoice {
    /// Reads `subject`, `parallel` or a distance.
    ///
    /// # Errors
    ///
    /// Other words, toed-in eyes by the reason against them, and distances that are not finite or not above 0.
    pub fn parse(text: &str) -> Result<Self, StereoRigError> {
        match text {
            "subject" => Ok(Self::Subject),
            "parallel" => Ok(Self::Parallel),
            "toed-in" | "toe-in" => Err(StereoRigError::ToedIn),
            _ => {
                let distance = text.parse().map_err(|_| StereoRigError::Unknown(text.to_owned()))?;
                positive(distance).map(Self::Distance).ok_or(StereoRigError::Distance(distance))
            }
        }
    }
}

/// `n` if it is finite and above 0.
fn positive(n: f64) -> Option<f64> {
    (n.is_finite() && n > 0.0).then_some(n)
}

/// Half of the width of the camera's full film in the plane at distance 1.
fn half_width(camera: &CameraDesc, aspect: f64) -> Result<f64, StereoRigError> {
    match &camera.projection {
        ProjectionDesc::Perspective(PerspectiveDesc { fov, fov_axis, distortion: None, .. }) => {
            Ok(fov_axis.half_extent(*fov, aspect).x)
        }
        _ => Err(StereoRigError::Projection { place: camera.place }),
    }
}

impl StereoRig {
    /// The rig that a user asks for in the place of a camera; without a distance between the eyes that is 1/30 of the distance of the
    /// subject. The subject is what is in focus or, for a pinhole, at the distance `middle` along the axis: that of what is seen in the middle
    /// of the picture, `None` where nothing is.
    ///
    /// # Errors
    ///
    /// Distances that are not finite or not above 0, and a missing subject where it is needed.
    pub fn of(
        interocular: Option<f64>,
        convergence: ConvergenceChoice,
        camera: &CameraDesc,
        middle: Option<f64>,
    ) -> Result<Self, StereoRigError> {
        let focus = match &camera.projection {
            ProjectionDesc::Perspective(PerspectiveDesc { lens, .. }) if lens.radius > 0.0 => {
                Some(lens.focus_distance)
            }
            _ => None,
        };
        let subject = || {
            let distance = focus.or(middle).ok_or(StereoRigError::NoSubject)?;
            positive(distance).ok_or(StereoRigError::Distance(distance))
        };
        let convergence = match convergence {
            ConvergenceChoice::Parallel => StereoConvergence::Parallel,
            ConvergenceChoice::Distance(distance) => StereoConvergence::OffAxis { distance },
            ConvergenceChoice::Subject => StereoConvergence::OffAxis { distance: subject()? },
        };
        let interocular = match (interocular, convergence) {
            (Some(interocular), _) => interocular,
            (None, StereoConvergence::OffAxis { distance }) => distance / SUBJECT_PER_INTEROCULAR,
            (None, StereoConvergence::Parallel) => subject()? / SUBJECT_PER_INTEROCULAR,
        };
        let rig = Self { interocular, convergence };
        rig.check().map(|()| rig)
    }

    fn check(&self) -> Result<(), StereoRigError> {
        positive(self.interocular).ok_or(StereoRigError::Interocular(self.interocular))?;
        if let StereoConvergence::OffAxis { distance } = self.convergence {
            positive(distance).ok_or(StereoRigError::Distance(distance))?;
        }
        Ok(())
    }

    /// One over the distance of convergence; 0 for parallel eyes.
    fn per_distance(&self) -> f64 {
        match self.convergence {
            StereoConvergence::Parallel => 0.0,
            StereoConvergence::OffAxis { distance } => 1.0 / distance,
        }
    }

    /// The cameras of the left and the right eye; `aspect` is the width over the height of the full film.
    ///
    /// # Errors
    ///
    /// A camera of another projection, and distances that are not finite or not above 0.
    pub fn eyes(&self, camera: &CameraDesc, aspect: f64) -> Result<[CameraDesc; 2], StereoRigError> {
        self.check()?;
        let half = half_width(camera, aspect)?;
        // +x of camera space is to the left, and world units do not scale with it.
        let aside = 0.5 * self.interocular;
        let left = camera.to_world.matrix3.x_axis.normalize_or_zero() * aside;
        // The point (0, 0, d) lies at −aside/d in the left eye's plane z = 1, which is as far right in the film.
        let shift = 0.5 * aside * self.per_distance() / half;
        Ok([1.0, -1.0].map(|sign| {
            let mut eye = camera.clone();
            eye.to_world.translation += sign * left;
            eye.principal_point_offset.x += sign * shift;
            eye
        }))
    }

    /// Disparities in pictures of this `width`, in any unit, that show the full film; `aspect` is that over their height. Its errors are those of
    /// [`StereoRig::eyes`].
    pub fn disparity(
        &self,
        camera: &CameraDesc,
        aspect: f64,
        width: f64,
    ) -> Result<Disparity, StereoRigError> {
        self.check()?;
        let scale = width * self.interocular / (2.0 * half_width(camera, aspect)?);
        Ok(Disparity { scale, offset: scale * self.per_distance() })
    }
}

/// Disparity by depth: how far right a point is in the left eye's picture, less how far in the right eye's.
///
/// It is positive in front of the distance of convergence (crossed) and negative behind (uncrossed); stereo matching has the same sign
/// (Scharstein and Szeliski, IJCV 2002).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disparity {
    /// The unit of the picture's width, such as pixels, times world units.
    pub scale: f64,
    /// What is subtracted: the disparity of parallel eyes at the distance of convergence.
    pub offset: f64,
}

impl Disparity {
    /// At the depth `z` along the camera's axis, world units; infinity is a depth.
    pub fn at(&self, z: f64) -> f64 {
        self.scale / z - self.offset
    }
}
