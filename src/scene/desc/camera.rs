//! The camera and its film.

use glam::{DAffine3, DVec2, DVec3};

use super::ids::{MediumId, Place};

/// A camera: looks along +z of its own space, +y up, **+x to the left**.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct CameraDesc {
    /// How places of the picture become rays.
    pub projection: ProjectionDesc,
    /// Camera space to world space.
    pub to_world: DAffine3,
    /// Offset of the principal point, as a fraction of the film size; of no effect on panoramas.
    pub principal_point_offset: DVec2,
    /// Near clip distance: along z where the picture is a plane, else along the ray.
    pub near_clip: f64,
    /// Far clip distance, likewise.
    pub far_clip: f64,
    /// The medium that it is in, where the file says so.
    pub medium: Option<MediumId>,
    /// Its place in the file.
    #[serde(skip)]
    pub place: Place,
}

/// How places of the picture become rays.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum ProjectionDesc {
    /// Mitsuba's `perspective`; with an aperture its `thinlens`; with a distortion also the `perspective_rdist` of Mitsuba 0.6.
    Perspective(PerspectiveDesc),
    /// Rays are parallel: the picture shows −1 to 1 along x of camera space, which [`CameraDesc::to_world`] may scale.
    Orthographic,
    /// A fisheye lens, which shows angles of up to 360 degrees in a circle.
    Fisheye(FisheyeDesc),
    /// All directions by longitude and latitude (equirectangular), the `spherical` of Mitsuba 0.6.
    Spherical,
    /// All directions on the six faces of a cube.
    CubeMap(CubeLayout),
    /// All directions by longitude and latitude, for two eyes (omnidirectional stereo).
    Stereo(StereoDesc),
    /// Rays along z from the points of a disk of this radius; every place of the picture has all of them. Mitsuba's `radiancemeter` has the radius
    /// 0, one ray, and its `distant` a disk before the whole scene.
    Beam(f64),
    /// All directions above a surface, seen from all of it: Mitsuba's `irradiancemeter`. Camera space is that of the shape; it may be scaled and its
    /// z mirrored. The mean over the picture is the irradiance / π.
    Irradiance(MeterSurface),
    /// Several cameras side by side from left to right, each on an equal part of the film: Mitsuba's `batch`. Their transforms lead to the space of
    /// this one, whose clip distances are not used.
    Batch(Vec<CameraDesc>),
}

/// The surface of a meter, in the space of its shape.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum MeterSurface {
    /// −1 to 1 along x and y, seen from +z.
    Rectangle,
    /// Around the origin with the radius 1, seen from +z.
    Disk,
    /// Seen from outside; from inside where the radius is negative.
    Sphere {
        /// Its centre.
        center: DVec3,
        /// Its radius.
        radius: f64,
    },
}

/// A picture on a plane, seen through a pinhole or a thin lens.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PerspectiveDesc {
    /// Full field of view along [`PerspectiveDesc::fov_axis`] without the distortion, in degrees.
    pub fov: f64,
    /// The axis along which `fov` is measured.
    pub fov_axis: FovAxis,
    /// The lens.
    pub lens: LensDesc,
    /// Its distortion.
    pub distortion: Option<DistortionDesc>,
}

/// A thin lens.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LensDesc {
    /// Radius of the aperture in world units, for one with blades that of the circle around it; 0 is a pinhole.
    pub radius: f64,
    /// Distance along z of the plane in focus; of no effect on a pinhole.
    pub focus_distance: f64,
    /// Number of blades, whose aperture is a regular polygon; 0 is a round one.
    pub blades: u32,
    /// Angle by which the polygon is turned counter-clockwise in the picture, from where a corner points up, in degrees.
    pub blade_rotation: f64,
    /// Squeeze of an anamorphic lens: the aperture is narrower along x by this factor.
    pub squeeze: f64,
}

impl LensDesc {
    /// A round lens.
    pub const fn round(radius: f64, focus_distance: f64) -> Self {
        Self { radius, focus_distance, blades: 0, blade_rotation: 0.0, squeeze: 1.0 }
    }

    /// A pinhole.
    pub const PINHOLE: Self = Self::round(0.0, 0.0);

    /// Whether its aperture is a disk.
    pub fn is_round(&self) -> bool {
        self.blades == 0 && self.squeeze == 1.0
    }
}

/// The distortion of a lens as `projectPoints` of OpenCV has it, which takes undistorted places (x right, y down in the plane z = 1) to
/// distorted ones. With r² = x² + y²,
///
/// ```text
/// q  = (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶)
/// x' = x q + 2 p1 x y + p2 (r² + 2 x²) + s1 r² + s2 r⁴
/// y' = y q + p1 (r² + 2 y²) + 2 p2 x y + s3 r² + s4 r⁴
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct DistortionDesc {
    /// Radial coefficients k1 to k6 (Brown 1966 has k1 to k3; the others are the denominator's).
    pub radial: [f64; 6],
    /// Tangential coefficients p1 and p2 (Conrady 1919).
    pub tangential: [f64; 2],
    /// Thin-prism coefficients s1 to s4.
    pub prism: [f64; 4],
}

/// A fisheye lens.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct FisheyeDesc {
    /// How angles to the axis become radii.
    pub mapping: FisheyeMapping,
    /// Full field of view along [`FisheyeDesc::fov_axis`] without the distortion, in degrees.
    pub fov: f64,
    /// The axis along which `fov` is measured.
    pub fov_axis: FovAxis,
    /// Full angle of the image circle, in degrees: the lens shows nothing beyond.
    pub image_circle: f64,
    /// k1 to k4 of OpenCV's fisheye model, which takes angles θ to θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸) before the mapping.
    pub distortion: [f64; 4],
}

/// Radius in the picture of an angle θ to the axis, for the focal length 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum FisheyeMapping {
    /// θ.
    Equidistant,
    /// 2 sin(θ / 2): equal solid angles have equal areas.
    Equisolid,
    /// 2 tan(θ / 2): angles are kept.
    Stereographic,
    /// sin θ: areas are those of projected solid angles; no more than 180 degrees.
    Orthographic,
}

impl FisheyeMapping {
    /// The largest angle to the axis that it shows, in degrees.
    pub fn largest_angle(self) -> f64 {
        match self {
            Self::Equidistant | Self::Equisolid => 180.0,
            Self::Stereographic => 179.0,
            Self::Orthographic => 90.0,
        }
    }

    /// The radius of an angle in radians.
    pub fn radius(self, angle: f64) -> f64 {
        match self {
            Self::Equidistant => angle,
            Self::Equisolid => 2.0 * (0.5 * angle).sin(),
            Self::Stereographic => 2.0 * (0.5 * angle).tan(),
            Self::Orthographic => angle.sin(),
        }
    }
}

/// Where the six faces of a cube stand in the picture, as seen from within. The faces beside each other in a cross adjoin; up and down stand in
/// the same way in the other layouts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum CubeLayout {
    /// 3 × 2: right, left, up; below down, front, back.
    Block,
    /// 6 × 1: right, left, up, down, front, back.
    Row,
    /// 1 × 6: the same from top to bottom.
    Column,
    /// 4 × 3: left, front, right, back in the middle row, up and down above and below the front.
    Cross,
}

/// Omnidirectional stereo: the rays of an eye are tangents to a horizontal circle around the camera.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct StereoDesc {
    /// Distance of the eyes, the diameter of the circle, in world units.
    pub interocular: f64,
    /// Which eyes the picture shows.
    pub eyes: StereoEyes,
}

/// The eyes that a picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum StereoEyes {
    /// The left one above the right one.
    OverUnder,
    /// The left one.
    Left,
    /// The right one.
    Right,
}

impl CameraDesc {
    /// Its picture on a plane, if it is a perspective camera.
    pub fn perspective(&self) -> Option<&PerspectiveDesc> {
        match &self.projection {
            ProjectionDesc::Perspective(perspective) => Some(perspective),
            _ => None,
        }
    }

    /// The same to change.
    pub fn perspective_mut(&mut self) -> Option<&mut PerspectiveDesc> {
        match &mut self.projection {
            ProjectionDesc::Perspective(perspective) => Some(perspective),
            _ => None,
        }
    }

    /// True where all rays are parallel.
    pub fn is_orthographic(&self) -> bool {
        self.projection == ProjectionDesc::Orthographic
    }

    /// The radius of its lens; 0 where it has none.
    pub fn lens_radius(&self) -> f64 {
        self.perspective().map_or(0.0, |perspective| perspective.lens.radius)
    }

    /// The camera with another radius of its lens, if it can have one.
    pub fn with_lens_radius(mut self, radius: f64) -> Self {
        if let Some(perspective) = self.perspective_mut() {
            perspective.lens.radius = radius;
        }
        self
    }
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
        self.of_half((0.5 * fov.to_radians()).tan(), aspect)
    }

    /// Half of the extent of a picture of this width over its height, which is `half` along this axis.
    pub fn of_half(self, half: f64, aspect: f64) -> DVec2 {
        let along_x = match self {
            FovAxis::X => true,
            FovAxis::Y => false,
            FovAxis::Smaller => aspect <= 1.0,
            FovAxis::Larger => aspect > 1.0,
            FovAxis::Diagonal => {
                let x = half / (1.0 + 1.0 / (aspect * aspect)).sqrt();
                return DVec2::new(x, x / aspect);
            }
        };
        if along_x { DVec2::new(half, half / aspect) } else { DVec2::new(half * aspect, half) }
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
