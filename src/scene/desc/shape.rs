//! Shapes and groups of shapes.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec4};

use super::emission_texture::EmissionProfile;
use super::ids::{BsdfId, GroupId, MeshId, Place};
use super::medium::MediumInterface;
use crate::spectrum::Spectrum;

/// A surface in the scene.
#[derive(Clone, Debug)]
pub struct ShapeDesc {
    /// `id` of the element, for messages.
    pub id: Option<String>,
    /// Its place in the file.
    pub place: Place,
    /// Geometry in object space.
    pub kind: ShapeKind,
    /// Object space to world space.
    pub to_world: DAffine3,
    /// Flips normals, and with them the emitting side.
    pub flip_normals: bool,
    /// Its material; [`BsdfId::NONE`] of an instance.
    pub bsdf: BsdfId,
    /// Emitted radiance, from the side of the normal only (as Mitsuba's `area`): a `twosided` material scatters on
    /// both sides and still emits on one. To emit on both, put two shapes in the same place, the second with
    /// [`ShapeDesc::flip_normals`]; each is then seen, lit and emits on its own side only.
    pub emission: Option<Spectrum>,
    /// Variation of the emission; [`ShapeDesc::emission`] is a factor on its texture.
    pub emission_profile: EmissionProfile,
    /// The media on both of its sides.
    pub medium_interface: MediumInterface,
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
    /// A cylinder without caps, normals outwards.
    Cylinder {
        /// The centre of one end.
        p0: DVec3,
        /// The centre of the other end.
        p1: DVec3,
        /// Radius.
        radius: f64,
    },
    /// Unit disk in z = 0, normal +z.
    Disk,
    /// [−1, 1]² in z = 0, normal +z.
    Rectangle,
    /// [−1, 1]³, normals outwards.
    Cube,
    /// Curves with a thickness, seen from outside only. `to_world` moves their control points and leaves their radii.
    Curves(Arc<Curves>),
    /// All shapes of a group, transformed from its space by `to_world`. Flips no normals and emits nothing.
    Instance(GroupId),
}

impl ShapeKind {
    /// Mitsuba's name of the plugin; `obj` for every mesh.
    pub fn plugin(&self) -> &'static str {
        match self {
            ShapeKind::Mesh(_) => "obj",
            ShapeKind::Sphere { .. } => "sphere",
            ShapeKind::Cylinder { .. } => "cylinder",
            ShapeKind::Disk => "disk",
            ShapeKind::Rectangle => "rectangle",
            ShapeKind::Cube => "cube",
            ShapeKind::Curves(_) => "curves",
            ShapeKind::Instance(_) => "instance",
        }
    }
}

/// Curves of one file.
#[derive(Clone, Debug, PartialEq)]
pub struct Curves {
    /// The basis by which control points define a curve.
    pub basis: CurveBasis,
    /// Control points of all curves: positions in object space, and radii.
    pub points: Vec<Vec4>,
    /// Index of the first of the [`CurveBasis::points`] control points of each segment.
    pub starts: Vec<u32>,
}

/// The basis by which control points define a curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CurveBasis {
    /// Straight from each to the next, with round joints and ends.
    Linear,
    /// A uniform cubic B-spline, open at the ends.
    BSpline,
}

impl CurveBasis {
    /// Control points of a segment.
    pub const fn points(self) -> usize {
        match self {
            CurveBasis::Linear => 2,
            CurveBasis::BSpline => 4,
        }
    }
}

/// Shapes in a space of their own, Mitsuba's `shapegroup`: visible only through instances ([`ShapeKind::Instance`]).
#[derive(Clone, Debug)]
pub struct GroupDesc {
    /// `id` of the element, for messages.
    pub id: Option<String>,
    /// Its place in the file.
    pub place: Place,
    /// Its shapes, which neither emit nor are instances; their `to_world` is to the space of the group.
    pub shapes: Vec<ShapeDesc>,
}
