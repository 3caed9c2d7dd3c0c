//! Preparation: from a scene description to a scene that can be traced.
//!
//! `coincident` finds primitives in the same place. `geometry` transforms shapes to primitives in world space, checks them and adds their lights, `lights` adds the others, `groups` adds groups and instances,
//! `materials` converts BSDFs, `specular` finds what casts caustics and what is seen over mirrors and glass. `structure` decides whether an edit can
//! keep the geometry.

mod coincident;
mod error;
mod geometry;
mod groups;
mod lights;
mod materials;
mod specular;
mod structure;

use std::sync::Arc;

use crate::scene::SceneDesc;
use crate::scene::desc::FilmDesc;
use crate::spectrum::Spectrum;

use super::accel::{Accel, Shapes, TriangleSource};
use super::bounding_sphere::BoundingSphere;
use super::bsdf::Material;
use super::effects::{self, planned};
use super::light::Lights;
use super::medium::Media;
use super::primitives::Primitives;
use super::scene::{MaterialClass, Scene, TracingMode};
use error::MAX_PRIMITIVES;
use geometry::Geometry;
use groups::PreparedGroups;
use materials::SceneMaterials;

pub use error::PrepareError;
pub(super) use specular::SpecularUse;
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

/// From this number of primitives on, memory that building has left over is given back.
const MANY_PRIMITIVES: usize = 1 << 18;

impl Scene {
    /// Makes `desc` ready for tracing: world space, tree, lights, materials; of these what its plan of effects calls for
    /// ([`effects::planned`]).
    ///
    /// Primitives that cannot be traced (triangles without area, coordinates that are not finite or beyond
    /// 1e12 in rendering space) are dropped, counted and reported in [`Scene::notices`].
    ///
    /// ```
    /// use pointillist::scene;
    /// use pointillist::tracer::accel::Ray;
    /// use pointillist::tracer::{Camera, Scene};
    ///
    /// let desc = scene::load("scenes/cornell.xml".as_ref(), &[])?.desc;
    /// let (scene, camera) = (Scene::prepare(&desc)?, Camera::of(&desc)?);
    /// let ray: Ray = camera.ray([0.5, 0.5], [0.5, 0.5]).expect("it shows something in the middle");
    /// assert!(scene.closest(&ray).is_some(), "the middle of the picture shows a surface");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`PrepareError`] when an id points nowhere, or materials form a circle.
    pub fn prepare(desc: &SceneDesc) -> Result<Scene, PrepareError> {
        Scene::prepare_by(desc, None)
    }

    /// As [`Scene::prepare`], with the tree of `before`, refitted, where it is one for the same primitives, and the tables of its materials.
    fn prepare_by(desc: &SceneDesc, before: Option<&Scene>) -> Result<Scene, PrepareError> {
        let planned = planned(desc);
        let mut scene = Scene::prepare_all(&planned, before)?;
        (scene.white, scene.material_class) = (effects::white(&planned), effects::material_class(&planned));
        Ok(scene)
    }

    /// As [`Scene::prepare`], but with everything, whether `desc` calls for it or not: `--check-plan` compares with it.
    pub fn prepare_general(desc: &SceneDesc) -> Result<Scene, PrepareError> {
        Scene::prepare_all(desc, None)
    }

    fn prepare_all(desc: &SceneDesc, before: Option<&Scene>) -> Result<Scene, PrepareError> {
        let structure = Arc::new(SceneStructure::of(desc));
        let (space, spectra) = (desc.space, spectra(desc));
        let desc = &desc.in_rendering_space();
        let known = before.map_or(&[][..], |scene| &scene.materials);
        let SceneMaterials { materials, surfaces, opacities } = materials::of(desc, known)?;
        let mut geometry = Geometry::of(desc);
        for shape in &desc.shapes {
            geometry.add(desc, shape)?;
        }
        let shown = geometry.add_groups(desc)?;
        let mut geometry = geometry.finish();
        if let hidden @ 1.. = geometry.coincident.hidden {
            geometry.notices.push(format!(
                "{hidden} faces lie in the same place as others and face the same way: only one of each is seen"
            ));
        }
        let count = geometry.faces.count() + geometry.round.len() + shown.instances.len();
        if count > MAX_PRIMITIVES {
            return Err(PrepareError::TooManyPrimitives { count });
        }
        for (light, i) in desc.lights.iter().zip(geometry.emitting..) {
            geometry.add_light(light, i);
        }
        let dark = geometry.lights.iter().all(|l| l.is_black() || spectra[l.spectrum as usize].is_black());
        // The reader has already reported a scene without any light.
        if dark && !spectra.is_empty() {
            geometry.notices.push("no light of the scene can be used: the picture will be black".to_owned());
        }
        let (lights, notices) = (std::mem::take(&mut geometry.lights), std::mem::take(&mut geometry.notices));
        let primitives = primitives(geometry, shown, before.map(Scene::accel));
        if count >= MANY_PRIMITIVES {
            crate::memory::return_free_memory();
        }
        let (lo, hi) = primitives.accel.bounds();
        // An empty scene has no size, and any positive number serves.
        let radius = (0.5 * (hi - lo).length()).max(f32::MIN_POSITIVE);
        let extent = BoundingSphere { center: 0.5 * (lo + hi), radius };
        let (casters, chains) = specular::of(desc);
        let lights = Lights::new(lights.into(), spectra, extent).aiming_at(casters);
        let (primitives, white) = (Arc::new(primitives), None);
        let media = Media::of(desc)?;
        let mixes = materials.iter().any(|material| matches!(material, Material::Mixture(_)));
        let material_class = match mixes {
            _ if media.is_some() => MaterialClass::InMedia,
            true => MaterialClass::Mixed,
            false => MaterialClass::General,
        };
        let mut scene = Scene {
            primitives,
            surfaces,
            materials,
            opacities,
            lights,
            specular_uses: SpecularUse::of_surfaces(desc),
            chains,
            media: media.map(Arc::new),
            white,
            material_class,
            tracing_mode: TracingMode::default(),
            notices,
            space,
            structure,
        };
        scene.place_lights_in_media(desc);
        Ok(scene)
    }

    /// This scene with the materials and the light of `desc`, in effect the same as [`Scene::prepare`] of `desc`.
    ///
    /// Where `desc` is this scene's description with other materials and other spectra, the primitives and their tree
    /// are shared and the cost does not depend on them; only the selection of lights is prepared anew. Where anything else
    /// differs (a shape moved, a light came or went, a mesh that is not shared), everything is prepared; the tree is refitted where its
    /// primitives have only moved. The kernel stays.
    ///
    /// A light whose emission becomes zero stays a light: it is hit and then emits nothing, and is never chosen while
    /// another light shines.
    pub fn edited(&self, desc: &SceneDesc) -> Result<Scene, PrepareError> {
        if *self.structure != SceneStructure::of(desc) {
            let anew = Scene::prepare_by(desc, Some(self))?.with_kernel(self.kernel());
            return Ok(anew.expect("the processor is the same, and nobody else has the new geometry"));
        }
        let desc = &planned(desc);
        let SceneMaterials { materials, surfaces, opacities } =
            materials::of(&desc.with_materials_in_rendering_space(), &self.materials)?;
        let (mut lights, mut chains) = (self.lights.relit(spectra(desc)), self.chains.clone());
        lights.set_kernel(self.accel().available_kernel());
        let specular_uses = SpecularUse::of_surfaces(desc);
        if specular_uses != self.specular_uses {
            let casters;
            (casters, chains) = specular::of(&desc.in_rendering_space());
            lights = lights.aiming_at(casters);
        }
        let media = if desc.has_media() { Media::of(&desc.in_rendering_space())? } else { None };
        let media = media.map(|media| match self.media() {
            Some(before) => media.with_places_of(before),
            None => media,
        });
        let mut scene = Scene {
            primitives: self.primitives.clone(),
            surfaces,
            materials,
            opacities,
            lights,
            specular_uses,
            chains,
            media: media.map(Arc::new),
            white: effects::white(desc),
            material_class: effects::material_class(desc),
            tracing_mode: TracingMode::default(),
            notices: self.notices.clone(),
            space: self.space,
            structure: self.structure.clone(),
        };
        if self.media().is_none() && scene.media().is_some() {
            scene.place_lights_in_media(&desc.in_rendering_space());
        }
        Ok(scene)
    }
}

/// The spectra of a scene's lights in rendering space: first of each emitting shape, then of each other light.
fn spectra(desc: &SceneDesc) -> Vec<Spectrum> {
    let shapes = desc.shapes.iter().filter_map(|s| s.emission.clone());
    shapes.chain(desc.lights.iter().map(|light| light.spectrum_in(&desc.space))).collect()
}

fn primitives(geometry: Geometry, shown: PreparedGroups, before: Option<&Accel>) -> Primitives {
    let Geometry { faces, quads, disks, spheres, cylinders, curves, round, backs, tangents, uvs, .. } =
        geometry;
    let PreparedGroups { groups, instances, placements } = shown;
    let shapes = Shapes {
        triangles: &faces,
        quads: &quads,
        disks: disks.clone(),
        spheres: spheres.clone(),
        cylinders: cylinders.clone(),
        curves: curves.clone(),
    };
    let refitted = before.and_then(|accel| accel.refitted(&shapes, &groups, &instances));
    let accel = refitted.unwrap_or_else(|| Accel::new(shapes, &groups, &instances));
    let faces = faces.into_huge_pages();
    Primitives { accel, faces, disks, spheres, cylinders, curves, round, backs, tangents, uvs, placements }
}
