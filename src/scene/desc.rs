//! The scene as plain data: what the file says after names, units and defaults are resolved.
//!
//! Everything the tracer needs and nothing it computes. Spectra are resolved here because only the
//! reader knows whether a colour is a reflectance or an emission.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DAffine3, DVec2, DVec3, Vec2, Vec3};

use crate::spectrum::{EmissionMap, Spectrum};

pub use super::bsdf::{
    BsdfDesc, ConductorDesc, DielectricDesc, DiffuseDesc, Facets, PlasticDesc, RoughConductorDesc,
    RoughDielectricDesc, RoughPlasticDesc, Roughness, TwoSidedDesc,
};
pub use super::group::{GroupDesc, GroupId};
pub use super::names::{Name, Names, Place};
pub use super::transport::{IntegratorDesc, IntegratorKind, PhotonDesc};

/// A whole scene.
#[derive(Clone, Debug)]
pub struct SceneDesc {
    /// Files the scene was read from; [`Place::file`] points here, the first is the one named by the user.
    pub files: Vec<PathBuf>,
    /// The camera.
    pub camera: CameraDesc,
    /// Picture size and reconstruction filter.
    pub film: FilmDesc,
    /// Light transport method and depth.
    pub integrator: IntegratorDesc,
    /// Sample count the file asks for, per pixel.
    pub samples_per_pixel: Option<u64>,
    /// Materials; [`BsdfId`] indexes here.
    pub bsdfs: Vec<BsdfDesc>,
    /// Meshes in object space; [`MeshId`] indexes here. Shared, so that a description is cheap to clone.
    pub meshes: Vec<Arc<Mesh>>,
    /// Shapes, each with its transform, material and emission; instances of groups among them.
    pub shapes: Vec<ShapeDesc>,
    /// Shapes in spaces of their own, seen where instances show them; [`GroupId`] indexes here.
    pub groups: Vec<GroupDesc>,
    /// Lights that are not shapes.
    pub lights: Vec<LightDesc>,
    /// What the file calls the materials and lights, for messages and for saving changes.
    pub names: Names,
}

/// Index into [`SceneDesc::bsdfs`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BsdfId(pub u32);

impl BsdfId {
    /// Of an instance: the shapes of its group have materials of their own.
    pub const NONE: BsdfId = BsdfId(u32::MAX);
}

/// Index into [`SceneDesc::meshes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MeshId(pub u32);

/// A perspective camera, Mitsuba's `perspective` or, with an aperture, `thinlens`: looks along +z of its own space, +y up, **+x to the left**.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraDesc {
    /// Camera space to world space.
    pub to_world: DAffine3,
    /// Full field of view along [`CameraDesc::fov_axis`], in degrees.
    pub fov: f64,
    /// What `fov` is measured along.
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
    /// Where it stands in the file.
    pub place: Place,
}

/// The direction along which a field of view is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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

/// The picture.
#[derive(Clone, Debug)]
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
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReconstructionFilter {
    /// Exactly one texel.
    Box,
    /// A tent of radius 1.
    Tent,
    /// A windowed Gaussian.
    Gaussian,
}

/// A surface in the scene.
#[derive(Clone, Debug)]
pub struct ShapeDesc {
    /// `id` of the element, for messages.
    pub id: Option<String>,
    /// Where it stands in the file.
    pub place: Place,
    /// Geometry in object space.
    pub kind: ShapeKind,
    /// Object space to world space.
    pub to_world: DAffine3,
    /// Turn normals (and with them the emitting side) around.
    pub flip_normals: bool,
    /// Its material; [`BsdfId::NONE`] of an instance.
    pub bsdf: BsdfId,
    /// Emitted radiance, from the side of the normal only (as Mitsuba's `area`): a `twosided` material scatters on
    /// both sides and still emits on one. What shall emit on both is two shapes in the same place, the second with
    /// [`ShapeDesc::flip_normals`]; each is then seen, lit and lights from its own side only.
    pub emission: Option<Spectrum>,
}

/// Geometry of a shape, in object space, as Mitsuba defines the plugin of the same name.
#[derive(Clone, Debug, PartialEq)]
pub enum ShapeKind {
    /// Triangles.
    Mesh(MeshId),
    /// Sphere.
    Sphere {
        /// Centre.
        center: DVec3,
        /// Radius.
        radius: f64,
    },
    /// Unit disk in z = 0, normal +z.
    Disk,
    /// [−1, 1]² in z = 0, normal +z.
    Rectangle,
    /// [−1, 1]³, normals outwards.
    Cube,
    /// All shapes of a group, `to_world` taking its space to the world's. Turns no normals and emits nothing.
    Instance(GroupId),
}

/// An indexed triangle mesh; already checked: indices in range, vertices finite, no triangle without area.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Positions, object space.
    pub positions: Vec<Vec3>,
    /// Shading normals per vertex; empty for a faceted mesh.
    pub normals: Vec<Vec3>,
    /// Texture coordinates per vertex; may be empty.
    pub uvs: Vec<Vec2>,
    /// Vertex indices.
    pub triangles: Vec<[u32; 3]>,
}

/// A light that is not a shape.
#[derive(Clone, Debug)]
pub enum LightDesc {
    /// The same radiance from everywhere (Mitsuba's `constant`).
    Constant {
        /// Radiance.
        radiance: Spectrum,
        /// Where it stands in the file.
        place: Place,
    },
    /// Radiance from all around by a picture (Mitsuba's `envmap`).
    Map {
        /// Radiance by latitude (the rows, from +y) and longitude. Shared, so that a description is cheap to clone.
        map: Arc<EmissionMap>,
        /// Factor on it, the same at every wavelength.
        scale: Spectrum,
        /// The map's space to world space: a rotation, or one with a mirror; moving it changes nothing.
        to_world: DAffine3,
        /// Where it stands in the file.
        place: Place,
    },
    /// A point (Mitsuba's `point`).
    Point {
        /// Position in world space.
        position: DVec3,
        /// Radiant intensity.
        intensity: Spectrum,
        /// Where it stands in the file.
        place: Place,
    },
}

impl LightDesc {
    /// True when it shines from infinitely far, from all around; a scene has at most one such light.
    pub fn is_environment(&self) -> bool {
        matches!(self, LightDesc::Constant { .. } | LightDesc::Map { .. })
    }

    /// Where it stands in the file.
    pub fn place(&self) -> Place {
        match self {
            LightDesc::Constant { place, .. }
            | LightDesc::Map { place, .. }
            | LightDesc::Point { place, .. } => *place,
        }
    }

    /// Its radiance or intensity; of a map, the factor on it.
    pub fn spectrum(&self) -> &Spectrum {
        match self {
            LightDesc::Constant { radiance, .. } => radiance,
            LightDesc::Map { scale, .. } => scale,
            LightDesc::Point { intensity, .. } => intensity,
        }
    }

    /// True when it gives no light.
    pub fn is_black(&self) -> bool {
        self.spectrum().is_black() || matches!(self, LightDesc::Map { map, .. } if map.is_black())
    }

    /// Its radiance or intensity, or the factor on it, to change.
    pub fn spectrum_mut(&mut self) -> &mut Spectrum {
        match self {
            LightDesc::Constant { radiance, .. } => radiance,
            LightDesc::Map { scale, .. } => scale,
            LightDesc::Point { intensity, .. } => intensity,
        }
    }
}
