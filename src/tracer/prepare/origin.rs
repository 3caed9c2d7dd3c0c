//! What of a description the geometry and the list of lights were made from.

use std::sync::Arc;

use glam::{DAffine3, DVec3};

use crate::scene::SceneDesc;
use crate::scene::desc::{LightDesc, Mesh, ShapeDesc, ShapeKind};

/// Remembers everything of a description but its materials and spectra, to know whether another one differs in
/// those only.
#[derive(Debug)]
pub(in crate::tracer) struct Origin {
    shapes: Vec<Form>,
    meshes: Vec<Arc<Mesh>>,
    /// Positions of the point lights; `None` for an environment.
    lights: Vec<Option<DVec3>>,
}

/// A shape without its looks.
#[derive(Debug, PartialEq)]
struct Form {
    kind: ShapeKind,
    to_world: DAffine3,
    flip_normals: bool,
    emits: bool,
}

impl Origin {
    /// What `desc` says.
    pub(super) fn of(desc: &SceneDesc) -> Self {
        Self {
            shapes: desc.shapes.iter().map(form).collect(),
            meshes: desc.meshes.clone(),
            lights: desc.lights.iter().map(position).collect(),
        }
    }

    /// True when `desc` says the same. Meshes are the same only if they are shared, not if they are equal.
    pub(super) fn fits(&self, desc: &SceneDesc) -> bool {
        let Self { shapes, meshes, lights } = self;
        shapes.len() == desc.shapes.len()
            && meshes.len() == desc.meshes.len()
            && meshes.iter().zip(&desc.meshes).all(|(a, b)| Arc::ptr_eq(a, b))
            && shapes.iter().zip(&desc.shapes).all(|(a, b)| *a == form(b))
            && lights.iter().copied().eq(desc.lights.iter().map(position))
    }
}

fn form(shape: &ShapeDesc) -> Form {
    Form {
        kind: shape.kind.clone(),
        to_world: shape.to_world,
        flip_normals: shape.flip_normals,
        emits: shape.emission.is_some(),
    }
}

fn position(light: &LightDesc) -> Option<DVec3> {
    match light {
        LightDesc::Constant { .. } => None,
        LightDesc::Point { position, .. } => Some(*position),
    }
}
