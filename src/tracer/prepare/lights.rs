//! The lights of a scene that are not shapes, and the spectra of all.

use glam::Vec3;

use crate::scene::SceneDesc;
use crate::scene::desc::LightDesc;
use crate::spectrum::Spectrum;
use crate::tracer::accel::PrimRange;
use crate::tracer::light::{ConstantLight, EnvironmentMap, Light, LightShape, PointLight};

use super::geometry::Geometry;

/// The spectra of a scene's lights: first of each emitting shape, then of each other light.
pub(super) fn spectra(desc: &SceneDesc) -> Vec<Spectrum> {
    let shapes = desc.shapes.iter().filter_map(|s| s.emission.as_ref());
    shapes.chain(desc.lights.iter().map(LightDesc::spectrum)).cloned().collect()
}

/// Adds a light that is not a shape, with the index of its spectrum, unless it is unusable or a second environment.
pub(super) fn add_light(desc: &LightDesc, spectrum: u32, geometry: &mut Geometry) {
    let Geometry { lights, notices, .. } = geometry;
    if desc.is_environment() && lights.iter().any(Light::is_environment) {
        let line = desc.place().line;
        notices.push(format!("line {line}: a scene has one environment; this second one is ignored"));
        return;
    }
    let shape = match desc {
        LightDesc::Constant { .. } => LightShape::Constant(ConstantLight),
        LightDesc::Map { map, to_world, .. } => {
            LightShape::Map(EnvironmentMap::new(map.clone(), to_world.matrix3))
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
