//! Normals that are interpolated between the corners of triangles: a mesh of facets that looks round.

use std::sync::Arc;

use crate::scene::SceneDesc;
use crate::scene::desc::{Mesh, ShapeDesc, ShapeKind};

use super::entry::{Entry, by, possible};
use super::used::{Object, known};

pub(super) const ENTRY: Entry = Entry {
    name: "smooth-normals",
    at_run_time: "whether the triangle that is met has normals (Primitives::interaction)",
    find: |used, _| {
        let mut all = used.desc.surfaces().filter(|shape| has_normals(used.desc, shape));
        let first = all.next().map(|shape| {
            let name = shape.id.as_ref().map_or("mesh".to_string(), |id| format!("mesh \"{id}\""));
            Object { name, place: known(shape.place), others: all.count() }
        });
        by(first, "has a normal at every corner", "every surface is as it is: flat, or a quadric")
    },
    refusal: possible,
    without,
    // Where to put a normal is the mesh's to say.
    with: |_| false,
};

fn has_normals(desc: &SceneDesc, shape: &ShapeDesc) -> bool {
    matches!(&shape.kind, ShapeKind::Mesh(id) if desc.meshes.get(id.0 as usize).is_some_and(|m| !m.normals.is_empty()))
}

/// Facets.
fn without(desc: &mut SceneDesc) {
    for mesh in desc.meshes.iter_mut().filter(|mesh| !mesh.normals.is_empty()) {
        *mesh = Arc::new(Mesh { normals: Vec::new(), ..Mesh::clone(mesh) });
    }
}
