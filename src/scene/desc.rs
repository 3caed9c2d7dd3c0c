//! The scene as plain data: what the file says after names, units and defaults are resolved.
//!
//! Everything the tracer needs and nothing it computes. Spectra are resolved here because only the
//! reader knows whether a colour is a reflectance or an emission.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

use glam::{DAffine3, DVec2, DVec3, Vec2, Vec3, Vec4};

use super::emission_texture::EmissionProfile;
use super::rendering_space::RenderingSpace;
use crate::spectrum::Spectrum;

pub use super::aov::{AovDesc, AovKind};
pub use super::bsdf::{
    AlphaTexture, BlendDesc, BsdfDesc, BumpDesc, BumpMapDesc, CoatDesc, CoatingDesc, ConductorDesc,
    DielectricDesc, DiffuseDesc, DiffuseTransmitterDesc, Facets, LobeTexture, MOST_PARTS, MaskDesc,
    MixtureDesc, NormalMapDesc, NullDesc, PhongDesc, PlasticDesc, PrincipledDesc, PrincipledLobes,
    PrincipledThinDesc, RoughCoatingDesc, RoughConductorDesc, RoughDielectricDesc, RoughDiffuseDesc,
    RoughPlasticDesc, Roughness, SHARPEST_PHONG, ThinDielectricDesc, ThinFilmDesc, TwoSidedDesc, WardDesc,
    WardVariant,
};
pub use super::lights::{LightDesc, ProjectorDesc, SpotDesc, SpotTextureDesc, SunSkyDesc};

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
    /// Names and places of the materials and lights, for messages and for saving changes.
    pub names: Names,
    /// Where the scene is traced ([`SceneDesc::place`]).
    pub space: RenderingSpace,
}

impl SceneDesc {
    /// A material and all that it is made of, each once. Also ends where materials form a circle, which preparing refuses.
    pub(crate) fn made_of(&self, id: BsdfId) -> Vec<&BsdfDesc> {
        let (mut all, mut open, mut seen) = (Vec::new(), vec![id], BTreeSet::new());
        while let Some(id) = open.pop() {
            if let Some(bsdf) = self.bsdfs.get(id.0 as usize).filter(|_| seen.insert(id.0)) {
                open.extend(bsdf.nested());
                all.push(bsdf);
            }
        }
        all
    }

    /// The shapes whose surfaces are seen where `shape` stands: itself, or those of the group that it shows.
    pub fn parts<'a>(&'a self, shape: &'a ShapeDesc) -> &'a [ShapeDesc] {
        match shape.kind {
            ShapeKind::Instance(id) => self.groups.get(id.0 as usize).map_or(&[], |group| &group.shapes),
            _ => std::slice::from_ref(shape),
        }
    }

    /// How many faces a shape has, of which each is a light if it emits.
    pub fn faces(&self, shape: &ShapeDesc) -> usize {
        match shape.kind {
            ShapeKind::Mesh(id) => self.meshes.get(id.0 as usize).map_or(0, |mesh| mesh.triangles.len()),
            ShapeKind::Cube => 6,
            _ => 1,
        }
    }

    /// For each group, true if an instance shows it.
    pub fn shown(&self) -> Vec<bool> {
        let mut shown = vec![false; self.groups.len()];
        for shape in &self.shapes {
            if let ShapeKind::Instance(id) = shape.kind
                && let Some(group) = shown.get_mut(id.0 as usize)
            {
                *group = true;
            }
        }
        shown
    }

    /// Every shape that has a surface in the world, each once: those of the scene itself that are no instances, then those
    /// of the groups that are shown.
    pub fn surfaces(&self) -> impl Iterator<Item = &ShapeDesc> {
        let own = self.shapes.iter().filter(|s| !matches!(s.kind, ShapeKind::Instance(_)));
        let groups = self.groups.iter().zip(self.shown()).filter(|(_, shown)| *shown);
        own.chain(groups.flat_map(|(group, _)| &group.shapes))
    }
}

/// A place in a source file; lines and columns count from 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// Index into [`SceneDesc::files`].
    pub file: u32,
    /// Line.
    pub line: u32,
    /// Column, in characters.
    pub column: u32,
}

/// Names and places of objects whose descriptions have none; empty for a scene that was not read from a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Names {
    /// Names of [`SceneDesc::bsdfs`].
    pub bsdfs: Vec<Name>,
    /// Names of [`SceneDesc::lights`].
    pub lights: Vec<Name>,
}

/// The name of an element of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Name {
    /// Its `id`, if it has one.
    pub id: Option<String>,
    /// Its place; line 0 for an object that is not in the file, such as the material of a shape that names none.
    pub place: Place,
}

/// Index into [`SceneDesc::bsdfs`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub struct BsdfId(pub u32);

impl BsdfId {
    /// The material of an instance: the shapes of its group have materials of their own.
    pub const NONE: BsdfId = BsdfId(u32::MAX);
}

/// Index into [`SceneDesc::meshes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MeshId(pub u32);

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

/// The light transport method and its parameters.
#[derive(Clone, Debug)]
pub struct IntegratorDesc {
    /// The method.
    pub kind: IntegratorKind,
    /// Longest path in segments (1 = only what is emitted towards the camera, 2 = direct light); `None` is unlimited.
    pub max_depth: Option<u32>,
    /// Path depth from which Russian roulette may end a path.
    pub rr_depth: u32,
    /// Lights are not seen directly by the camera.
    pub hide_emitters: bool,
    /// Four wavelengths are drawn for each path even where nothing has a colour.
    pub spectral: bool,
    /// Parameters of photon mapping.
    pub photons: PhotonDesc,
    /// Layers that are written beside the picture.
    pub aovs: Vec<AovDesc>,
}

impl Default for IntegratorDesc {
    /// The integrator of a scene that names none, as in Mitsuba.
    fn default() -> Self {
        Self {
            kind: IntegratorKind::Path,
            max_depth: None,
            rr_depth: 5,
            hide_emitters: false,
            spectral: false,
            photons: PhotonDesc::default(),
            aovs: Vec::new(),
        }
    }
}

/// Parameters of photon lookups; those that are `None` follow from the size of the scene.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PhotonDesc {
    /// Radius of the first lookups, m; the largest there is.
    pub initial_radius: Option<f32>,
    /// α of Knaus and Zwicker 2011 in [0, 1): r² falls as n^(α−1).
    pub alpha: Option<f64>,
    /// Photons of a lookup, at most.
    pub lookup_size: Option<u32>,
    /// Photons that only mirrors, glass and coats have met are looked up.
    pub caustics: bool,
    /// All other photons are gathered.
    pub gather: bool,
}

impl Default for PhotonDesc {
    fn default() -> Self {
        Self { initial_radius: None, alpha: None, lookup_size: None, caustics: true, gather: true }
    }
}

/// The methods the program has. The comments are the help of `--integrator`.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, serde::Serialize, serde::Deserialize,
)]
pub enum IntegratorKind {
    /// Path tracing: from the camera, with next-event estimation at each vertex.
    #[default]
    Path,
    /// Particle tracing: from the lights, each vertex connected to the camera. Nothing is seen in mirrors or glass.
    Light,
    /// Bidirectional path tracing: subpaths from both ends, connected at every vertex.
    Bidirectional,
    /// One-pass photon mapping: final gathering from photons that light paths leave. It converges: its blur shrinks as it goes.
    Photon,
    /// Vertex connection and merging: bidirectional path tracing, but caustics seen in mirrors and through glass are found by
    /// photons. Their blur shrinks as it goes; all else is unbiased.
    Vcm,
    /// No light: the distance to the first surface, as grey.
    Depth,
    /// The method that suits the scene, chosen by a short trial of each; the program says why. Path tracing until then.
    Auto,
}

impl IntegratorKind {
    /// The method's name on the command line and in files.
    pub const fn name(self) -> &'static str {
        match self {
            IntegratorKind::Auto => "auto",
            IntegratorKind::Path => "path",
            IntegratorKind::Light => "light",
            IntegratorKind::Bidirectional => "bidirectional",
            IntegratorKind::Photon => "photon",
            IntegratorKind::Vcm => "vcm",
            IntegratorKind::Depth => "depth",
        }
    }

    /// True for the methods whose camera paths gather photons.
    pub const fn has_photons(self) -> bool {
        matches!(self, IntegratorKind::Photon | IntegratorKind::Vcm)
    }

    /// True for the methods that connect subpaths from both ends.
    pub const fn is_bidirectional(self) -> bool {
        matches!(self, IntegratorKind::Bidirectional | IntegratorKind::Vcm)
    }
}

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
    /// Turns normals, and with them the emitting side, around.
    pub flip_normals: bool,
    /// Its material; [`BsdfId::NONE`] of an instance.
    pub bsdf: BsdfId,
    /// Emitted radiance, from the side of the normal only (as Mitsuba's `area`): a `twosided` material scatters on
    /// both sides and still emits on one. To emit on both, put two shapes in the same place, the second with
    /// [`ShapeDesc::flip_normals`]; each is then seen, lit and emits on its own side only.
    pub emission: Option<Spectrum>,
    /// How the emission varies; [`ShapeDesc::emission`] is a factor on its texture.
    pub emission_profile: EmissionProfile,
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
    /// The round side of a cylinder, without caps, normals outwards.
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
    /// All shapes of a group, `to_world` taking its space to the world's. Turns no normals and emits nothing.
    Instance(GroupId),
}

/// Curves of one file.
#[derive(Clone, Debug, PartialEq)]
pub struct Curves {
    /// How control points make a curve.
    pub basis: CurveBasis,
    /// Control points of all curves: positions in object space, and radii.
    pub points: Vec<Vec4>,
    /// Index of the first of the [`CurveBasis::points`] control points of each segment.
    pub starts: Vec<u32>,
}

/// How control points make a curve.
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

/// Index into [`SceneDesc::groups`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct GroupId(pub u32);

/// Shapes in a space of their own, Mitsuba's `shapegroup`: seen only through instances ([`ShapeKind::Instance`]).
#[derive(Clone, Debug)]
pub struct GroupDesc {
    /// `id` of the element, for messages.
    pub id: Option<String>,
    /// Its place in the file.
    pub place: Place,
    /// Its shapes, which neither emit nor are instances; `to_world` takes them to the space of the group.
    pub shapes: Vec<ShapeDesc>,
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
    /// The number of each triangle in its file; empty where that is its index, because none before it was left out.
    pub numbers: Vec<u32>,
    /// What the materials of its shapes ask for besides; may be empty.
    pub attributes: Vec<MeshAttribute>,
}

impl Mesh {
    /// The number in the file of the triangle of this index.
    pub fn number(&self, index: usize) -> u32 {
        self.numbers.get(index).copied().unwrap_or(index as u32)
    }
}

/// One or three numbers at every vertex or on every triangle of a mesh, Mitsuba's mesh attribute.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshAttribute {
    /// Its name, which begins with `vertex_` or `face_`.
    pub name: String,
    /// The numbers of a vertex or triangle: 1, or 3 for a colour in linear Rec.709.
    pub channels: usize,
    /// The numbers, those of a vertex or triangle together.
    pub values: Vec<f32>,
}

impl MeshAttribute {
    /// The beginning of names of attributes of vertices.
    pub const VERTEX: &str = "vertex_";

    /// The beginning of names of attributes of triangles.
    pub const FACE: &str = "face_";

    /// It has numbers for triangles, not for vertices.
    pub fn is_of_faces(&self) -> bool {
        self.name.starts_with(Self::FACE)
    }
}
