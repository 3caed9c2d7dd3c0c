//! The depths that are comfortable to look at on a screen.

use std::fmt;

use super::camera::CameraDesc;
use super::stereo::{Disparity, StereoConvergence, StereoRig, StereoRigError};

/// The screen that stereo pictures are shown on, in their full width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StereoScreen {
    /// Width of the picture, metres.
    pub width: f64,
    /// The viewer's distance, metres.
    pub distance: f64,
}

impl Default for StereoScreen {
    /// A monitor on a desk.
    fn default() -> Self {
        Self { width: 0.6, distance: 0.7 }
    }
}

/// Distance between a viewer's pupils, metres: the mean of adults (Dodgson, “Variation and extrema of human interpupillary distance”, 2004).
const PUPILS: f64 = 0.063;

/// Largest comfortable angle between the directions in which the eyes converge for a point and for the screen, which they focus on, degrees
/// (Lambooij, Fortuin, Heynderickx, IJsselsteijn, “Visual discomfort and visual fatigue of stereoscopic displays: a review”, Journal of
/// Imaging Science and Technology 53(3), 2009).
const LARGEST_CONFLICT: f64 = 1.0;

/// Depths whose disparity is comfortable, along the axis of the camera in world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ComfortableDepth {
    /// The nearest.
    pub near: f64,
    /// The farthest; it may be infinite.
    pub far: f64,
    /// The screen that they are comfortable on.
    pub screen: StereoScreen,
}

impl ComfortableDepth {
    /// The depths at which the vergence of a viewer's eyes is within `LARGEST_CONFLICT` of that for the screen, and at which they need not
    /// diverge. `aspect` is the width over the height of the picture.
    ///
    /// A point with the parallax p on the screen (its place for the right eye less that for the left one, metres) is seen under the vergence
    /// 2 atan((e − p) / 2D), with the distance e of the pupils and D of the screen. In the scene p = W · b / 2h · (1/d − 1/z), with the width
    /// W of the screen, half of that of the film at distance 1 h, the distance b of the eyes, that of their convergence d, and the depth z.
    ///
    /// # Errors
    ///
    /// A screen of no size, and those of [`StereoRig::eyes`].
    pub fn of(
        rig: &StereoRig,
        camera: &CameraDesc,
        aspect: f64,
        screen: StereoScreen,
    ) -> Result<Self, StereoRigError> {
        let StereoScreen { width, distance } = screen;
        if !(width.is_finite() && width > 0.0 && distance.is_finite() && distance > 0.0) {
            return Err(StereoRigError::Screen { width, distance });
        }
        // In metres, with the opposite sign of the parallax.
        let Disparity { scale, offset } = rig.disparity(camera, aspect, width)?;
        let screen_vergence = 2.0 * (0.5 * PUPILS / distance).atan();
        let parallax = |conflict: f64| {
            let half_vergence = 0.5 * (screen_vergence + conflict.to_radians());
            PUPILS - 2.0 * distance * half_vergence.max(0.0).tan()
        };
        let depth = |parallax: f64| {
            let per_depth = (offset - parallax) / scale;
            if per_depth > 0.0 { 1.0 / per_depth } else { f64::INFINITY }
        };
        let (near, far) = (depth(parallax(LARGEST_CONFLICT)), depth(parallax(-LARGEST_CONFLICT)));
        Ok(Self { near, far, screen })
    }
}

impl fmt::Display for ComfortableDepth {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let StereoScreen { width, distance } = self.screen;
        let near = rounded(self.near);
        match self.far {
            f64::INFINITY => write!(f, "depths from {near} units on are comfortable to look at")?,
            far => write!(f, "depths from {near} to {} units are comfortable to look at", rounded(far))?,
        }
        write!(
            f,
            " on a screen {width} m wide from {distance} m: the eyes converge within {LARGEST_CONFLICT}° of it (Lambooij et al. 2009)"
        )
    }
}

impl fmt::Display for StereoRig {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "two eyes, {} units apart, ", rounded(self.interocular))?;
        match self.convergence {
            StereoConvergence::Parallel => write!(f, "parallel"),
            StereoConvergence::OffAxis { distance } => {
                write!(f, "the plane of the screen at a distance of {} units", rounded(distance))
            }
        }
    }
}

/// Three digits.
fn rounded(n: f64) -> String {
    let digits = (2.0 - n.abs().log10().floor()).clamp(0.0, 12.0);
    format!("{n:.*}", digits as usize)
}
