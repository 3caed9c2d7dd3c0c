//! What of a description the geometry and the list of lights were made from.

use std::sync::Arc;

use glam::{DAffine3, DVec3};

use crate::scene::SceneDesc;
use crate::scene::desc::{LightDesc, Mesh, ShapeDesc, ShapeKind};
use crate::spectrum::EmissionMap;

use super::tangents;

/// Remembers everything of a description but its materials and spectra, to know whether another one differs in
/// those only.
#[derive(Debug)]
pub(in crate::tracer) struct Origin {
    shapes: Vec<Form>,
    groups: Vec<Vec<Form>>,
    meshes: Vec<Arc<Mesh>>,
    lights: Vec<LightForm>,
}

/// A light that is not a shape, without its spectrum.
#[derive(Debug)]
enum LightForm {
    Constant,
    Map { map: Arc<EmissionMap>, to_world: DAffine3 },
    Point(DVec3),
}

/// A shape without its looks.
#[derive(Debug, PartialEq)]
struct Form {
    kind: ShapeKind,
    to_world: DAffine3,
    flip_normals: bool,
    emits: bool,
    brushed: bool,
}

impl Origin {
    /// What `desc` says.
    pub(super) fn of(desc: &SceneDesc) -> Self {
        Self {
            shapes: forms(desc, &desc.shapes),
            groups: desc.groups.iter().map(|group| forms(desc, &group.shapes)).collect(),
            meshes: desc.meshes.clone(),
            lights: desc.lights.iter().map(light_form).collect(),
        }
    }

    /// True when `desc` says the same. Meshes and maps are the same only if they are shared, not if they are equal.
    pub(super) fn fits(&self, desc: &SceneDesc) -> bool {
        let Self { shapes, groups, meshes, lights } = self;
        let same = |forms: &[Form], shapes: &[ShapeDesc]| {
            forms.len() == shapes.len() && forms.iter().zip(shapes).all(|(a, b)| *a == form(desc, b))
        };
        same(shapes, &desc.shapes)
            && groups.len() == desc.groups.len()
            && groups.iter().zip(&desc.groups).all(|(a, b)| same(a, &b.shapes))
            && meshes.len() == desc.meshes.len()
            && meshes.iter().zip(&desc.meshes).all(|(a, b)| Arc::ptr_eq(a, b))
            && lights.len() == desc.lights.len()
            && lights.iter().zip(&desc.lights).all(|(a, b)| a.is_that_of(b))
    }
}

fn forms(desc: &SceneDesc, shapes: &[ShapeDesc]) -> Vec<Form> {
    shapes.iter().map(|shape| form(desc, shape)).collect()
}

fn form(desc: &SceneDesc, shape: &ShapeDesc) -> Form {
    Form {
        kind: shape.kind.clone(),
        to_world: shape.to_world,
        flip_normals: shape.flip_normals,
        emits: shape.emission.is_some(),
        brushed: tangents::is_brushed(desc, shape.bsdf),
    }
}

fn light_form(light: &LightDesc) -> LightForm {
    match light {
        LightDesc::Constant { .. } => LightForm::Constant,
        LightDesc::Map { map, to_world, .. } => LightForm::Map { map: map.clone(), to_world: *to_world },
        LightDesc::Point { position, .. } => LightForm::Point(*position),
    }
}

impl LightForm {
    fn is_that_of(&self, light: &LightDesc) -> bool {
        match (self, light) {
            (LightForm::Constant, LightDesc::Constant { .. }) => true,
            (LightForm::Map { map, to_world }, LightDesc::Map { map: other, to_world: turned, .. }) => {
                Arc::ptr_eq(map, other) && to_world == turned
            }
            (LightForm::Point(position), LightDesc::Point { position: other, .. }) => position == other,
            _ => false,
        }
    }
}
