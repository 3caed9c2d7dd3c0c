//! The camera and its film.

use glam::{DAffine3, DVec2};

use super::ids::{MediumId, Place};

/// A camera, Mitsuba's `perspective`, with an aperture `thinlens`, or `orthographic`: looks along +z of its own space, +y up, **+x to the left**.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct CameraDesc {
    /// Rays are parallel: the picture shows −1 to 1 along x of camera space, which [`CameraDesc::to_world`] may scale. It has neither field
    /// of view nor lens.
    pub orthographic: bool,
    /// Camera space to world space.
    pub to_world: DAffine3,
    /// Full field of view along [`CameraDesc::fov_axis`], in degrees.
    pub fov: f64,
    /// The axis along which `fov` is measured.
    pub fov_axis: FovAxis,
    /// Offset of the principal point, as a fraction of the film size.
    pub principal_point_offset: DVec2,
    /// Near clip distance along z.
    pub near_clip: f64,
    /// Far clip distance along z.
    pub far_clip: f64,
    /// Radius of the lens in world units; 0 is a pinhole.
    pub aperture_radius: f64,
    /// Distance along z of the plane in focus; of no effect on a pinhole.
    pub focus_distance: f64,
    /// The medium that it is in, where the file says so.
    pub medium: Option<MediumId>,
    /// Its place in the file.
    #[serde(skip)]
    pub place: Place,
}

/// The direction along which a field of view is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum FovAxis {
    /// Horizontal.
    X,
    /// Vertical.
    Y,
    /// Corner to corner.
    Diagonal,
    /// The shorter side.
    Smaller,
    /// The longer side.
    Larger,
}

impl FovAxis {
    /// Half of the extent of a picture of this width over its height in the plane z = 1, seen under `fov` degrees.
    pub fn half_extent(self, fov: f64, aspect: f64) -> DVec2 {
        let tan = (0.5 * fov.to_radians()).tan();
        let along_x = match self {
            FovAxis::X => true,
            FovAxis::Y => false,
            FovAxis::Smaller => aspect <= 1.0,
            FovAxis::Larger => aspect > 1.0,
            FovAxis::Diagonal => {
                let x = tan / (1.0 + 1.0 / (aspect * aspect)).sqrt();
                return DVec2::new(x, x / aspect);
            }
        };
        if along_x { DVec2::new(tan, tan / aspect) } else { DVec2::new(tan * aspect, tan) }
    }
}

/// The picture.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmDesc {
    /// Width of the full film in pixels.
    pub width: u32,
    /// Height of the full film in pixels.
    pub height: u32,
    /// The part of the film to render; `None` is all of it.
    pub crop: Option<Crop>,
    /// The filter the file asks for.
    pub rfilter: Option<ReconstructionFilter>,
}

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crop {
    /// Left edge.
    pub x: u32,
    /// Top edge.
    pub y: u32,
    /// Width.
    pub width: u32,
    /// Height.
    pub height: u32,
}

/// A filter the client knows how to splat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ReconstructionFilter {
    /// Exactly one texel.
    Box,
    /// A tent.
    Tent {
        /// Its reach, pixels.
        radius: f64,
    },
    /// A Gaussian less its value at four times the standard deviation, where it ends.
    Gaussian {
        /// Standard deviation, pixels.
        stddev: f64,
    },
}
