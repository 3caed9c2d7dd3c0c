//! The structure of a scene: the parts of its description that determine geometry and the list of lights.

use std::sync::Arc;

use glam::{DAffine3, DVec3};

use crate::scene::SceneDesc;
use crate::scene::desc::{LightDesc, Mesh, ShapeDesc, ShapeKind};
use crate::spectrum::EmissionMap;

use super::tangents;

/// A description without its materials and spectra. An edit that keeps it needs no new geometry.
#[derive(Debug)]
pub(in crate::tracer) struct SceneStructure {
    shapes: Vec<ShapeStructure>,
    groups: Vec<Vec<ShapeStructure>>,
    meshes: Vec<Arc<Mesh>>,
    lights: Vec<LightStructure>,
}

/// A light that is not a shape, without its spectrum.
#[derive(Debug)]
enum LightStructure {
    Constant,
    Map { map: Arc<EmissionMap>, to_world: DAffine3 },
    Point(DVec3),
}

/// A shape without its material and emission spectrum.
#[derive(Debug, PartialEq)]
struct ShapeStructure {
    kind: ShapeKind,
    to_world: DAffine3,
    flip_normals: bool,
    emits: bool,
    brushed: bool,
}

impl SceneStructure {
    /// The structure of `desc`.
    pub(super) fn of(desc: &SceneDesc) -> Self {
        Self {
            shapes: structures(desc, &desc.shapes),
            groups: desc.groups.iter().map(|group| structures(desc, &group.shapes)).collect(),
            meshes: desc.meshes.clone(),
            lights: desc.lights.iter().map(light_structure).collect(),
        }
    }

    /// True if `desc` has the same structure. Meshes and maps are compared by pointer, not by value.
    pub(super) fn matches(&self, desc: &SceneDesc) -> bool {
        let Self { shapes, groups, meshes, lights } = self;
        let same = |known: &[ShapeStructure], shapes: &[ShapeDesc]| {
            known.len() == shapes.len() && known.iter().zip(shapes).all(|(a, b)| *a == structure(desc, b))
        };
        same(shapes, &desc.shapes)
            && groups.len() == desc.groups.len()
            && groups.iter().zip(&desc.groups).all(|(a, b)| same(a, &b.shapes))
            && meshes.len() == desc.meshes.len()
            && meshes.iter().zip(&desc.meshes).all(|(a, b)| Arc::ptr_eq(a, b))
            && lights.len() == desc.lights.len()
            && lights.iter().zip(&desc.lights).all(|(a, b)| a.matches(b))
    }
}

fn structures(desc: &SceneDesc, shapes: &[ShapeDesc]) -> Vec<ShapeStructure> {
    shapes.iter().map(|shape| structure(desc, shape)).collect()
}

fn structure(desc: &SceneDesc, shape: &ShapeDesc) -> ShapeStructure {
    ShapeStructure {
        kind: shape.kind.clone(),
        to_world: shape.to_world,
        flip_normals: shape.flip_normals,
        emits: shape.emission.is_some(),
        brushed: tangents::is_brushed(desc, shape.bsdf),
    }
}

fn light_structure(light: &LightDesc) -> LightStructure {
    match light {
        LightDesc::Constant { .. } => LightStructure::Constant,
        LightDesc::Map { map, to_world, .. } => LightStructure::Map { map: map.clone(), to_world: *to_world },
        LightDesc::Point { position, .. } => LightStructure::Point(*position),
    }
}

impl LightStructure {
    fn matches(&self, light: &LightDesc) -> bool {
        match (self, light) {
            (LightStructure::Constant, LightDesc::Constant { .. }) => true,
            (LightStructure::Map { map, to_world }, LightDesc::Map { map: other, to_world: turned, .. }) => {
                Arc::ptr_eq(map, other) && to_world == turned
            }
            (LightStructure::Point(position), LightDesc::Point { position: other, .. }) => position == other,
            _ => false,
        }
    }
}
