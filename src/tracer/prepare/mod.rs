//! Preparation: from a scene description to a scene that can be traced.
//!
//! `geometry` transforms shapes to primitives in world space and checks them, `groups` adds groups and instances, `backs`
//! finds primitives that lie back to back, `tangents` determines the directions of brushed surfaces, `lights` and `materials`
//! convert lights and BSDFs. `structure` decides whether an edit can keep the geometry.

pub(super) mod backs;
mod error;
mod geometry;
mod groups;
mod lights;
mod materials;
mod structure;
mod tangents;

use std::sync::Arc;

use crate::scene::SceneDesc;
use crate::scene::desc::FilmDesc;

use super::accel::{Accel, Shapes, collect_in_huge_pages};
use super::effects::{self, planned};
use super::light::{BoundingSphere, Lights};
use super::primitives::{Face, Primitives};
use super::scene::{MaterialClass, Scene};
use geometry::Geometry;
use groups::PreparedGroups;
use lights::{add_light, spectra};

pub use error::PrepareError;
pub(super) use structure::SceneStructure;

/// The size of the picture, which a camera needs in addition to its description.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PrepareOptions {
    /// Width of the full film in pixels, before the crop. Only the ratio to the height matters.
    pub width: u32,
    /// Height of the full film in pixels.
    pub height: u32,
}

impl PrepareOptions {
    /// The size that the scene file specifies.
    pub fn from_film(film: &FilmDesc) -> Self {
        Self { width: film.width, height: film.height }
    }
}

/// References to cache lines have 28 bits. They suffice even if every primitive takes a block (4 lines) and a node (4 lines).
const MAX_PRIMITIVES: usize = 33_000_000;

/// Prepares a scene with the plan of effects applied.
pub(super) fn prepare(desc: &SceneDesc) -> Result<Scene, PrepareError> {
    let planned = planned(desc);
    let mut scene = general(&planned)?;
    (scene.white, scene.material_class) = (effects::white(&planned), effects::material_class(&planned));
    Ok(scene)
}

/// Prepares a scene for all effects.
pub(super) fn general(desc: &SceneDesc) -> Result<Scene, PrepareError> {
    let (materials, surfaces) = materials::of(desc)?;
    let mut geometry = Geometry::default();
    for shape in &desc.shapes {
        geometry.add(desc, shape)?;
    }
    let shown = geometry.add_groups(desc)?;
    let mut geometry = geometry.finish();
    let count = geometry.prims.len() + shown.instances.len();
    if count > MAX_PRIMITIVES {
        return Err(PrepareError::TooManyPrimitives { count });
    }
    for (light, i) in desc.lights.iter().zip(geometry.emitting..) {
        add_light(light, i, &mut geometry);
    }
    let spectra = spectra(desc);
    let dark = geometry.lights.iter().all(|l| l.is_black() || spectra[l.spectrum as usize].is_black());
    // The reader has already reported a scene without any light.
    if dark && !spectra.is_empty() {
        geometry.notices.push("no light of the scene can be used: the picture will be black".to_owned());
    }
    let (lights, notices) = (std::mem::take(&mut geometry.lights), std::mem::take(&mut geometry.notices));
    let primitives = primitives(geometry, shown);
    let (lo, hi) = primitives.accel.bounds();
    // An empty scene has no size, and any positive number serves.
    let radius = (0.5 * (hi - lo).length()).max(f32::MIN_POSITIVE);
    let lights = Lights::new(lights, spectra, BoundingSphere { center: 0.5 * (lo + hi), radius });
    let structure = Arc::new(SceneStructure::of(desc));
    let (primitives, white, material_class) = (Arc::new(primitives), None, MaterialClass::General);
    Ok(Scene { primitives, surfaces, materials, lights, white, material_class, notices, structure })
}

/// `scene` with the materials and spectra of `desc`, or a new scene if more than those has changed.
pub(super) fn edited(scene: &Scene, desc: &SceneDesc) -> Result<Scene, PrepareError> {
    if *scene.structure != SceneStructure::of(desc) {
        let mut anew = prepare(desc)?;
        let walked = anew.walk_by(scene.kernel());
        assert!(walked, "the processor is the same, and nobody else has the new geometry");
        return Ok(anew);
    }
    let desc = &planned(desc);
    let (materials, surfaces) = materials::of(desc)?;
    Ok(Scene {
        primitives: scene.primitives.clone(),
        surfaces,
        materials,
        lights: scene.lights.relit(spectra(desc)),
        white: effects::white(desc),
        material_class: effects::material_class(desc),
        notices: scene.notices.clone(),
        structure: scene.structure.clone(),
    })
}

fn primitives(geometry: Geometry, shown: PreparedGroups) -> Primitives {
    let Geometry { corners, quads, triangles, disks, spheres, prims, normals, backs, tangents, .. } =
        geometry;
    let PreparedGroups { groups, instances, placements } = shown;
    let shapes =
        Shapes { triangles: &corners, quads: &quads, disks: disks.clone(), spheres: spheres.clone() };
    let accel = Accel::with_instances(shapes, &groups, &instances);
    drop(corners);
    let round = prims[triangles.len()..].to_vec();
    let faces = collect_in_huge_pages(triangles.iter().zip(&prims).map(|(t, record)| Face::new(*t, *record)));
    let normals = collect_in_huge_pages(normals.into_iter());
    Primitives { accel, faces, disks, spheres, round, normals, backs, tangents, placements }
}
