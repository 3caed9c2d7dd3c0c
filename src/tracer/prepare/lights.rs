//! Lights that are not shapes.

use glam::DVec3;

use crate::scene::desc::{LightDesc, ProjectorDesc, SpotDesc, SunSkyDesc};
use crate::tracer::accel::PrimRange;
use crate::tracer::light::{
    ConstantLight, DirectionalLight, EnvironmentMap, Light, LightShape, PointLight, ProjectorLight,
    SpotLight, SunDisc, SunSkyLight,
};

use super::geometry::Geometry;

impl Geometry {
    /// Adds a light that is not a shape, with the index of its spectrum, unless it is unusable or a second environment.
    pub(super) fn add_light(&mut self, desc: &LightDesc, spectrum: u32) {
        let line = desc.place().line;
        if desc.is_environment() && self.lights.iter().any(Light::is_environment) {
            let second = "a scene has one environment; this second one is ignored";
            self.notices.push(format!("line {line}: {second}"));
            return;
        }
        let finite = |v: DVec3| Some(v.as_vec3()).filter(|v| v.is_finite());
        let unit = |v: DVec3| v.as_vec3().try_normalize();
        let shape = match desc {
            LightDesc::Constant { .. } => Some(LightShape::Constant(ConstantLight)),
            LightDesc::Map { map, to_world, .. } => {
                Some(LightShape::Map(EnvironmentMap::new(map.clone(), to_world.matrix3)))
            }
            LightDesc::SunSky(SunSkyDesc { sky, to_world, sun_direction, sun_half_angle, sun, .. }) => {
                unit(*sun_direction).map(|direction| {
                    let sun = SunDisc::new(direction, sun_half_angle.to_radians(), sun.clone());
                    LightShape::SunSky(SunSkyLight::new(sky.clone(), to_world.matrix3, sun))
                })
            }
            LightDesc::Directional { direction, .. } => {
                unit(*direction).map(|direction| LightShape::Directional(DirectionalLight { direction }))
            }
            LightDesc::Spot(SpotDesc { position, axis, beam_width, cutoff_angle, texture, .. }) => {
                let [beam, cutoff] = [*beam_width, *cutoff_angle].map(|angle| angle.to_radians() as f32);
                let usable = 0.0 <= beam && beam <= cutoff && cutoff <= std::f32::consts::PI;
                let place = finite(*position).zip(unit(*axis)).filter(|_| usable);
                place.map(|(position, axis)| {
                    let light = SpotLight::new(position, axis, beam, cutoff);
                    LightShape::Spot(match texture.as_deref() {
                        Some(t) => light.with_texture(t.texture.clone(), t.to_world),
                        None => light,
                    })
                })
            }
            LightDesc::Projector(ProjectorDesc { to_world, half_size, picture, .. }) => {
                let luminances = picture.as_ref().map(|picture| self.luminances(picture));
                let half = half_size.as_vec2();
                let usable = half.min_element() > 0.0 && half.is_finite();
                finite(to_world.translation).filter(|_| usable).map(|position| {
                    let matrix = to_world.matrix3;
                    let light = ProjectorLight::new(position, matrix, half, luminances.as_deref());
                    LightShape::Projector(Box::new(light))
                })
            }
            LightDesc::Point { position, .. } => {
                finite(*position).map(|position| LightShape::Point(PointLight { position }))
            }
        };
        let Some(shape) = shape else {
            let nowhere = "the light's position, direction or angles are not usable; it is ignored";
            self.notices.push(format!("line {line}: {nowhere}"));
            return;
        };
        self.lights.push(Light { shape, spectrum, prims: PrimRange::NONE });
    }
}
