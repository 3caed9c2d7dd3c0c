//! The structure of a scene: the parts of its description that determine geometry and the list of lights.

use std::sync::Arc;

use glam::{DAffine3, DVec2, DVec3};

use crate::scene::SceneDesc;
use crate::scene::desc::RenderingSpace;
use crate::scene::desc::emission_texture::{EmissionProfile, EmissionTexture};
use crate::scene::desc::{LightDesc, MediumId, MediumInterface, Mesh, ShapeDesc, ShapeKind, SpotTextureDesc};
use crate::spectrum::{EmissionMap, Spectrum};
use crate::tracer::{tangents, texture_coordinates};

/// A description without its materials and spectra. An edit that keeps it needs no new geometry.
#[derive(Debug, PartialEq)]
pub(in crate::tracer) struct SceneStructure {
    space: RenderingSpace,
    shapes: Vec<ShapeStructure>,
    groups: Vec<Vec<ShapeStructure>>,
    meshes: Vec<SameAllocation<Mesh>>,
    lights: Vec<LightStructure>,
    /// The medium that the camera names, which may be the only use of one.
    medium_of_camera: Option<MediumId>,
}

/// Data that counts as equal only if it is the same allocation.
#[derive(Debug)]
struct SameAllocation<T>(Arc<T>);

impl<T> PartialEq for SameAllocation<T> {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

/// A shape without its material and emission spectrum.
#[derive(Debug, PartialEq)]
struct ShapeStructure {
    kind: ShapeKind,
    to_world: DAffine3,
    flip_normals: bool,
    emits: bool,
    emission_profile: EmissionProfile,
    medium_interface: MediumInterface,
    brushed: bool,
    bumpy: bool,
    textured: bool,
    placed: bool,
}

/// A light that is not a shape, without its spectrum.
#[derive(Debug, PartialEq)]
enum LightStructure {
    Constant,
    Map {
        map: SameAllocation<EmissionMap>,
        to_world: DAffine3,
    },
    SunSky {
        sky: SameAllocation<EmissionMap>,
        to_world: DAffine3,
        sun: (DVec3, f64, Spectrum),
    },
    Directional(DVec3),
    /// Position, axis, and both angles.
    Spot([DVec3; 2], [f64; 2], Option<SameAllocation<SpotTextureDesc>>),
    Projector {
        picture: Option<SameAllocation<EmissionTexture>>,
        to_world: DAffine3,
        half_size: DVec2,
    },
    Point(DVec3),
}

impl SceneStructure {
    pub(super) fn of(desc: &SceneDesc) -> Self {
        let media = desc.has_media();
        let shape = |shape: &ShapeDesc| ShapeStructure {
            kind: shape.kind.clone(),
            to_world: shape.to_world,
            flip_normals: shape.flip_normals,
            emits: shape.emission.is_some(),
            emission_profile: shape.emission_profile.clone(),
            medium_interface: if media { shape.medium_interface } else { MediumInterface::default() },
            brushed: tangents::is_brushed(desc, shape.bsdf),
            bumpy: tangents::has_bump(desc, shape.bsdf),
            placed: texture_coordinates::is_placed(desc, shape.bsdf),
            textured: texture_coordinates::is_textured(desc, shape.bsdf),
        };
        let light = |light: &LightDesc| match light {
            LightDesc::Constant { .. } => LightStructure::Constant,
            LightDesc::Map { map, to_world, .. } => {
                LightStructure::Map { map: SameAllocation(map.clone()), to_world: *to_world }
            }
            LightDesc::SunSky(s) => LightStructure::SunSky {
                sky: SameAllocation(s.sky.clone()),
                to_world: s.to_world,
                sun: (s.sun_direction, s.sun_half_angle, s.sun.clone()),
            },
            LightDesc::Directional { direction, .. } => LightStructure::Directional(*direction),
            LightDesc::Spot(s) => {
                let texture = s.texture.clone().map(SameAllocation);
                LightStructure::Spot([s.position, s.axis], [s.beam_width, s.cutoff_angle], texture)
            }
            LightDesc::Projector(p) => LightStructure::Projector {
                picture: p.picture.clone().map(SameAllocation),
                to_world: p.to_world,
                half_size: p.half_size,
            },
            LightDesc::Point { position, .. } => LightStructure::Point(*position),
        };
        Self {
            space: desc.space,
            shapes: desc.shapes.iter().map(shape).collect(),
            groups: desc.groups.iter().map(|group| group.shapes.iter().map(shape).collect()).collect(),
            meshes: desc.meshes.iter().cloned().map(SameAllocation).collect(),
            lights: desc.lights.iter().map(light).collect(),
            medium_of_camera: desc.camera.medium.filter(|_| media),
        }
    }
}
