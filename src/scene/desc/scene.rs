//! The whole scene: its lists of objects, and queries over them.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

use super::bsdf::BsdfDesc;
use super::camera::{CameraDesc, FilmDesc};
use super::ids::{BsdfId, Names};
use super::integrator::IntegratorDesc;
use super::light::LightDesc;
use super::medium::{MediumDesc, MediumInterface};
use super::mesh::Mesh;
use super::rendering_space::RenderingSpace;
use super::shape::{GroupDesc, ShapeDesc, ShapeKind};

/// A whole scene.
#[derive(Clone, Debug)]
pub struct SceneDesc {
    /// Files the scene was read from; [`Place::file`](super::Place::file) points here, the first is the one named by the user.
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
    /// Meshes in object space; [`MeshId`](super::MeshId) indexes here. Shared, so that a description is cheap to clone.
    pub meshes: Vec<Arc<Mesh>>,
    /// Shapes, each with its transform, material and emission; instances of groups among them.
    pub shapes: Vec<ShapeDesc>,
    /// Shapes in spaces of their own, seen where instances show them; [`GroupId`](super::GroupId) indexes here.
    pub groups: Vec<GroupDesc>,
    /// Lights that are not shapes.
    pub lights: Vec<LightDesc>,
    /// Participating media; [`MediumId`](super::MediumId) indexes here.
    pub media: Vec<MediumDesc>,
    /// Names and places of the materials, lights and media, for messages and for saving changes.
    pub names: Names,
    /// The rendering space, chosen by [`SceneDesc::place`].
    pub space: RenderingSpace,
}

impl SceneDesc {
    /// A material and all that are nested in it, each once. Terminates for cyclic materials, too, which preparing the scene refuses.
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

    /// True where a surface that is shown, or the camera, names a medium, and the method knows media.
    pub fn has_media(&self) -> bool {
        !self.integrator.surfaces_only && self.names_media()
    }

    /// True where media are traced and one of them emits light.
    pub fn has_emissive_media(&self) -> bool {
        self.has_media()
            && self.used_media().into_iter().filter_map(|i| self.media.get(i)).any(MediumDesc::shines)
    }

    /// True where a surface that is shown, or the camera, names a medium.
    pub fn names_media(&self) -> bool {
        self.camera.medium.is_some() || self.surfaces().any(|shape| shape.medium_interface.is_transition())
    }

    /// Indices of the media that surfaces that are shown and the camera name, each once; those of ids that point nowhere, too.
    pub fn used_media(&self) -> BTreeSet<usize> {
        let sides = |shape: &ShapeDesc| {
            let MediumInterface { interior, exterior } = shape.medium_interface;
            [interior, exterior]
        };
        let named = self.surfaces().flat_map(sides).chain([self.camera.medium]).flatten();
        named.map(|id| id.0 as usize).collect()
    }

    /// The shapes whose surfaces `shape` shows: itself, or those of its group for an instance.
    pub fn parts<'a>(&'a self, shape: &'a ShapeDesc) -> &'a [ShapeDesc] {
        match shape.kind {
            ShapeKind::Instance(id) => self.groups.get(id.0 as usize).map_or(&[], |group| &group.shapes),
            _ => std::slice::from_ref(shape),
        }
    }

    /// Number of faces of a shape, each of which is a light if the shape emits.
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

    /// Every shape with a surface, each once: the scene's own shapes except instances, then the shapes of groups that have an
    /// instance.
    pub fn surfaces(&self) -> impl Iterator<Item = &ShapeDesc> {
        let own = self.shapes.iter().filter(|s| !matches!(s.kind, ShapeKind::Instance(_)));
        let groups = self.groups.iter().zip(self.shown()).filter(|(_, shown)| *shown);
        own.chain(groups.flat_map(|(group, _)| &group.shapes))
    }
}
