//! From a scene description to a scene: world space, checks, lights, tree.

pub(super) mod backs;
mod error;
mod geometry;
mod materials;

use glam::Vec3;

use crate::scene::SceneDesc;
use crate::scene::desc::{FilmDesc, LightDesc};
use crate::spectrum::Spectrum;

use super::accel::{Accel, PrimRange};
use super::light::{ConstantLight, Light, LightShape, Lights, PointLight};
use super::scene::Scene;
use geometry::Geometry;

pub use error::PrepareError;

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
    let (materials, sides) = materials::prepare(&desc.bsdfs)?;
    let mut geometry = Geometry::default();
    for shape in &desc.shapes {
        geometry.add(desc, shape, &sides)?;
    }
    let geometry = geometry.finish();
    let count = geometry.prims.len();
    if count > MAX_PRIMITIVES {
        return Err(PrepareError::TooManyPrimitives { count });
    }
    let accel =
        Accel::new(&geometry.corners, &geometry.quads, geometry.disks.clone(), geometry.spheres.clone());
    let (mut lights, mut spectra) = (geometry.lights, geometry.spectra);
    let mut notices = geometry.notices;
    for light in &desc.lights {
        add_light(light, &mut lights, &mut spectra, &mut notices);
    }
    // A scene without any light has been told of where it was read.
    let wanted = !desc.lights.is_empty() || desc.shapes.iter().any(|s| s.emission.is_some());
    if lights.is_empty() && wanted {
        notices.push("no light of the scene can be used: the picture will be black".to_owned());
    }
    let (lo, hi) = accel.bounds();
    // An empty scene has no size; any positive number serves, there is nothing to compare with.
    let radius = (0.5 * (hi - lo).length()).max(f32::MIN_POSITIVE);
    Ok(Scene {
        accel,
        triangles: geometry.triangles,
        disks: geometry.disks,
        spheres: geometry.spheres,
        prims: geometry.prims,
        normals: geometry.normals,
        backs: geometry.backs,
        surfaces: geometry.surfaces,
        materials,
        lights: Lights::new(lights, spectra, radius),
        notices,
    })
}

/// Adds a light that is not a shape, unless it is unusable or a second environment.
fn add_light(
    desc: &LightDesc,
    lights: &mut Vec<Light>,
    spectra: &mut Vec<Spectrum>,
    notices: &mut Vec<String>,
) {
    let (shape, spectrum) = match desc {
        LightDesc::Constant { radiance, place } => {
            if lights.iter().any(|l| matches!(l.shape, LightShape::Constant(_))) {
                notices.push(format!(
                    "line {}: a scene has one environment; this second one is ignored",
                    place.line
                ));
                return;
            }
            (LightShape::Constant(ConstantLight), radiance)
        }
        LightDesc::Point { position, intensity, place } => {
            let position: Vec3 = position.as_vec3();
            if !position.is_finite() {
                notices.push(format!(
                    "line {}: the point light's position is not finite; it is ignored",
                    place.line
                ));
                return;
            }
            (LightShape::Point(PointLight { position }), intensity)
        }
    };
    lights.push(Light { shape, spectrum: spectra.len() as u32, prims: PrimRange::NONE });
    spectra.push(spectrum.clone());
}
