//! From a scene description to a scene: world space, checks, lights, tree.

pub(super) mod backs;
mod error;
mod geometry;
mod groups;
mod lights;
mod materials;
mod origin;
mod tangents;

use std::sync::Arc;

use crate::scene::SceneDesc;
use crate::scene::desc::FilmDesc;

use super::accel::{Accel, in_large_pages};
use super::effects::{self, planned};
use super::light::{BoundingSphere, Lights};
use super::primitives::{Face, Primitives};
use super::scene::{MaterialClass, Scene};
use geometry::Geometry;
use groups::Shown;
use lights::{add_light, spectra};

pub use error::PrepareError;
pub(super) use origin::Origin;

/// The size of the picture, which a camera has to know beside its description.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PrepareOptions {
    /// Width of the full film in pixels, before the crop; only the ratio to the height matters.
    pub width: u32,
    /// Height of the full film in pixels.
    pub height: u32,
}

impl PrepareOptions {
    /// The size the scene file asks for.
    pub fn from_film(film: &FilmDesc) -> Self {
        Self { width: film.width, height: film.height }
    }
}

/// Even if every one has a block of its own (4 lines of memory) and a node (4 lines), references to lines have bits enough.
const MAX_PRIMITIVES: usize = 33_000_000;

/// The scene as planned.
pub(super) fn prepare(desc: &SceneDesc) -> Result<Scene, PrepareError> {
    let planned = planned(desc);
    let mut scene = general(&planned)?;
    (scene.white, scene.material_class) = (effects::white(&planned), effects::material_class(&planned));
    Ok(scene)
}

/// The scene for whatever it may hold.
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
    // A scene without any light has been told of where it was read.
    if dark && !spectra.is_empty() {
        geometry.notices.push("no light of the scene can be used: the picture will be black".to_owned());
    }
    let (lights, notices) = (std::mem::take(&mut geometry.lights), std::mem::take(&mut geometry.notices));
    let primitives = primitives(geometry, shown);
    let (lo, hi) = primitives.accel.bounds();
    // An empty scene has no size; any positive number serves, there is nothing to compare with.
    let radius = (0.5 * (hi - lo).length()).max(f32::MIN_POSITIVE);
    let lights = Lights::new(lights, spectra, BoundingSphere { center: 0.5 * (lo + hi), radius });
    let origin = Arc::new(Origin::of(desc));
    let (primitives, white, material_class) = (Arc::new(primitives), None, MaterialClass::General);
    Ok(Scene { primitives, surfaces, materials, lights, white, material_class, notices, origin })
}

/// `scene` with the materials and spectra of `desc`, or a new one where more than those has changed.
pub(super) fn edited(scene: &Scene, desc: &SceneDesc) -> Result<Scene, PrepareError> {
    if !scene.origin.fits(desc) {
        let mut anew = prepare(desc)?;
        let walked = anew.walk_by(scene.kernel());
        assert!(walked, "the processor is the same, and nobody else has the new tree");
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
        origin: scene.origin.clone(),
    })
}

fn primitives(geometry: Geometry, shown: Shown) -> Primitives {
    let Geometry { corners, quads, triangles, disks, spheres, prims, normals, backs, tangents, .. } =
        geometry;
    let Shown { groups, instances, placements } = shown;
    let shown = (&groups[..], &instances[..]);
    let accel = Accel::with_instances((&corners, &quads), disks.clone(), spheres.clone(), shown);
    drop(corners);
    let round = prims[triangles.len()..].to_vec();
    let faces = in_large_pages(triangles.iter().zip(&prims).map(|(t, record)| Face::new(*t, *record)));
    let normals = in_large_pages(normals.into_iter());
    Primitives { accel, faces, disks, spheres, round, normals, backs, tangents, placements }
}
