//! From a scene description to a scene: world space, checks, lights, tree.

pub(super) mod backs;
mod error;
mod geometry;
mod materials;
mod origin;
mod tangents;

use std::sync::Arc;

use glam::Vec3;

use crate::scene::SceneDesc;
use crate::scene::desc::{FilmDesc, LightDesc};
use crate::spectrum::Spectrum;

use super::accel::{Accel, PrimRange};
use super::features::built::{self, if_environment};
use super::features::{self, decide};
use super::light::{ConstantLight, EnvironmentMap, Extent, Light, LightShape, Lights, PointLight};
use super::primitives::Primitives;
use super::scene::Scene;
use geometry::Geometry;

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

/// Primitive ids must leave room for two flag bits and a block number.
const MAX_PRIMITIVES: usize = 500_000_000;

pub(super) fn prepare(desc: &SceneDesc) -> Result<Scene, PrepareError> {
    refuse_lacking(desc)?;
    let (materials, surfaces) = materials::of(desc)?;
    let mut geometry = Geometry::default();
    for shape in &desc.shapes {
        geometry.add(desc, shape)?;
    }
    let mut geometry = geometry.finish();
    let count = geometry.prims.len();
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
    let primitives = primitives(geometry);
    let (lo, hi) = primitives.accel.bounds();
    // An empty scene has no size; any positive number serves, there is nothing to compare with.
    let radius = (0.5 * (hi - lo).length()).max(f32::MIN_POSITIVE);
    let lights = Lights::new(lights, spectra, Extent { center: 0.5 * (lo + hi), radius });
    let origin = Arc::new(Origin::of(desc));
    let white = features::white(desc);
    Ok(Scene { primitives: Arc::new(primitives), surfaces, materials, lights, white, notices, origin })
}

/// `scene` with the materials and spectra of `desc`, or a new one where more than those has changed.
pub(super) fn edited(scene: &Scene, desc: &SceneDesc) -> Result<Scene, PrepareError> {
    if !scene.origin.fits(desc) {
        return prepare(desc);
    }
    refuse_lacking(desc)?;
    let (materials, surfaces) = materials::of(desc)?;
    Ok(Scene {
        primitives: scene.primitives.clone(),
        surfaces,
        materials,
        lights: scene.lights.relit(spectra(desc)),
        white: features::white(desc),
        notices: scene.notices.clone(),
        origin: scene.origin.clone(),
    })
}

/// Refuses what this build lacks on purpose.
fn refuse_lacking(desc: &SceneDesc) -> Result<(), PrepareError> {
    if built::IS_WHOLE {
        return Ok(());
    }
    let wanted = decide(desc, desc.integrator.kind).into_iter().filter(|d| d.on).map(|d| d.feature);
    built::lacking(wanted).map_or(Ok(()), |feature| Err(PrepareError::Lacking { effect: feature.name() }))
}

fn primitives(geometry: Geometry) -> Primitives {
    let Geometry { corners, quads, triangles, disks, spheres, prims, normals, backs, tangents, .. } =
        geometry;
    let accel = Accel::new(&corners, &quads, disks.clone(), spheres.clone());
    Primitives { accel, triangles, disks, spheres, prims, normals, backs, tangents }
}

/// The spectra of a scene's lights: of each shape that emits, then of each light that is not a shape.
fn spectra(desc: &SceneDesc) -> Vec<Spectrum> {
    let shapes = desc.shapes.iter().filter_map(|s| s.emission.as_ref());
    shapes.chain(desc.lights.iter().map(LightDesc::spectrum)).cloned().collect()
}

/// Adds a light that is not a shape and has spectrum `spectrum`, unless it is unusable or a second environment.
fn add_light(desc: &LightDesc, spectrum: u32, geometry: &mut Geometry) {
    let Geometry { lights, notices, .. } = geometry;
    if desc.is_environment() && lights.iter().any(Light::is_environment) {
        let line = desc.place().line;
        notices.push(format!("line {line}: a scene has one environment; this second one is ignored"));
        return;
    }
    let shape = match desc {
        LightDesc::Constant { .. } => LightShape::Constant(if_environment(ConstantLight)),
        LightDesc::Map { map, to_world, .. } => {
            LightShape::Map(if_environment(EnvironmentMap::new(map.clone(), to_world.matrix3)))
        }
        LightDesc::Point { position, place, .. } => {
            let position: Vec3 = position.as_vec3();
            if !position.is_finite() {
                notices.push(format!(
                    "line {}: the point light's position is not finite; it is ignored",
                    place.line
                ));
                return;
            }
            LightShape::Point(PointLight { position })
        }
    };
    lights.push(Light { shape, spectrum, prims: PrimRange::NONE });
}
