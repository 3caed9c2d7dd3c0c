//! Lights that are not shapes, as plain data.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec2, DVec3};

use super::emission_texture::EmissionTexture;
use super::ids::Place;
use super::rendering_space::RenderingSpace;
use super::texture::SpectrumTexture;
use crate::spectrum::{EmissionMap, Spectrum};

/// A light that is not a shape.
#[derive(Clone, Debug)]
pub enum LightDesc {
    /// The same radiance from everywhere (Mitsuba's `constant`).
    Constant {
        /// Radiance.
        radiance: Spectrum,
        /// Its place in the file.
        place: Place,
    },
    /// Radiance from all around by a picture (Mitsuba's `envmap`).
    Map {
        /// Radiance by latitude (the rows, from +y) and longitude. Shared, so that a description is cheap to clone.
        map: Arc<EmissionMap>,
        /// Factor on it, the same at every wavelength.
        scale: Spectrum,
        /// The map's space to world space: a rotation, possibly with a reflection; a translation has no effect.
        to_world: DAffine3,
        /// Its place in the file.
        place: Place,
    },
    /// A sky with a sun in it (Mitsuba's `sunsky`).
    SunSky(SunSkyDesc),
    /// Light from one direction, infinitely far away (Mitsuba's `directional`).
    Directional {
        /// Unit direction of propagation, world space.
        direction: DVec3,
        /// Irradiance of a surface that faces it.
        irradiance: Spectrum,
        /// Its place in the file.
        place: Place,
    },
    /// A point that emits into a cone (Mitsuba's `spot`).
    Spot(SpotDesc),
    /// A point that projects a picture (Mitsuba's `projector`).
    Projector(ProjectorDesc),
    /// A point (Mitsuba's `point`).
    Point {
        /// Position in world space.
        position: DVec3,
        /// Radiant intensity.
        intensity: Spectrum,
        /// Its place in the file.
        place: Place,
    },
}

/// A sky as an environment map, and the disc of the sun.
#[derive(Clone, Debug)]
pub struct SunSkyDesc {
    /// Radiance of the sky, as that of [`LightDesc::Map`]; black below the horizon.
    pub sky: Arc<EmissionMap>,
    /// The picture's space to world space: a rotation.
    pub to_world: DAffine3,
    /// Unit direction to the sun, world space.
    pub sun_direction: DVec3,
    /// Angular radius of the sun, in degrees.
    pub sun_half_angle: f64,
    /// Radiance of the sun.
    pub sun: Spectrum,
    /// Factor on both, the same at every wavelength.
    pub scale: Spectrum,
    /// Its place in the file.
    pub place: Place,
}

/// A point light with constant intensity within a beam, which falls off to 0 at the cutoff angle.
#[derive(Clone, Debug)]
pub struct SpotDesc {
    /// Position in world space.
    pub position: DVec3,
    /// Unit axis of the beam, world space.
    pub axis: DVec3,
    /// Half angle of the beam, in degrees.
    pub beam_width: f64,
    /// Angle to the axis beyond which nothing is emitted, in degrees; at least the beam width.
    pub cutoff_angle: f64,
    /// Radiant intensity within the beam.
    pub intensity: Spectrum,
    /// Texture that modulates the intensity.
    pub texture: Option<Arc<SpotTextureDesc>>,
    /// Its place in the file.
    pub place: Place,
}

/// The texture of a spot light.
#[derive(Clone, Debug)]
pub struct SpotTextureDesc {
    /// Factor on the intensity; (0, 0) to (1, 1) is the square around the cutoff cone on a plane perpendicular to the axis.
    pub texture: SpectrumTexture,
    /// The spot's space, in which it shines along +z, to world space.
    pub to_world: DMat3,
}

/// A point light that projects a picture onto the plane at distance 1 along the z axis of its space. The irradiance there is π times the
/// picture's value, as with Mitsuba's.
#[derive(Clone, Debug)]
pub struct ProjectorDesc {
    /// Its space to world space: a rotation, possibly with a reflection, and its position. The picture's left edge is at +x, its upper edge at
    /// +y.
    pub to_world: DAffine3,
    /// Half of the picture's width and height at distance 1.
    pub half_size: DVec2,
    /// The picture, unless it is constant.
    pub picture: Option<Arc<EmissionTexture>>,
    /// Factor on the picture, or its constant value.
    pub irradiance: Spectrum,
    /// Its place in the file.
    pub place: Place,
}

impl LightDesc {
    /// True for an environment light, of which a scene has at most one.
    pub fn is_environment(&self) -> bool {
        match self {
            LightDesc::Constant { .. } | LightDesc::Map { .. } | LightDesc::SunSky(_) => true,
            LightDesc::Directional { .. }
            | LightDesc::Spot(_)
            | LightDesc::Projector(_)
            | LightDesc::Point { .. } => false,
        }
    }

    /// The point that it shines from; `None` for light from infinitely far away.
    pub fn position(&self) -> Option<DVec3> {
        match self {
            LightDesc::Point { position, .. } | LightDesc::Spot(SpotDesc { position, .. }) => Some(*position),
            LightDesc::Projector(ProjectorDesc { to_world, .. }) => Some(to_world.translation),
            LightDesc::Constant { .. }
            | LightDesc::Map { .. }
            | LightDesc::SunSky(_)
            | LightDesc::Directional { .. } => None,
        }
    }

    /// Mitsuba's name of the plugin.
    pub fn plugin(&self) -> &'static str {
        match self {
            LightDesc::Constant { .. } => "constant",
            LightDesc::Map { .. } => "envmap",
            LightDesc::SunSky(_) => "sunsky",
            LightDesc::Directional { .. } => "directional",
            LightDesc::Spot(_) => "spot",
            LightDesc::Projector(_) => "projector",
            LightDesc::Point { .. } => "point",
        }
    }

    /// Its place in the file.
    pub fn place(&self) -> Place {
        match self {
            LightDesc::Constant { place, .. }
            | LightDesc::Map { place, .. }
            | LightDesc::SunSky(SunSkyDesc { place, .. })
            | LightDesc::Directional { place, .. }
            | LightDesc::Spot(SpotDesc { place, .. })
            | LightDesc::Projector(ProjectorDesc { place, .. })
            | LightDesc::Point { place, .. } => *place,
        }
    }

    /// Its radiance, irradiance or intensity; of a map or a sky, the factor on it.
    pub fn spectrum(&self) -> &Spectrum {
        match self {
            LightDesc::Constant { radiance, .. } => radiance,
            LightDesc::Map { scale, .. } | LightDesc::SunSky(SunSkyDesc { scale, .. }) => scale,
            LightDesc::Directional { irradiance, .. }
            | LightDesc::Projector(ProjectorDesc { irradiance, .. }) => irradiance,
            LightDesc::Spot(SpotDesc { intensity, .. }) | LightDesc::Point { intensity, .. } => intensity,
        }
    }

    /// [`spectrum`](Self::spectrum) in a rendering space: the intensity of a point light scales with the square of lengths.
    pub fn spectrum_in(&self, space: &RenderingSpace) -> Spectrum {
        let is_point = match self {
            LightDesc::Point { .. } | LightDesc::Spot(_) | LightDesc::Projector(_) => true,
            LightDesc::Constant { .. }
            | LightDesc::Map { .. }
            | LightDesc::SunSky(_)
            | LightDesc::Directional { .. } => false,
        };
        match is_point && space.scale != 1.0 {
            true => self.spectrum().scaled((space.scale * space.scale) as f32),
            false => self.spectrum().clone(),
        }
    }

    /// True when it emits nothing.
    pub fn is_black(&self) -> bool {
        let dark = match self {
            LightDesc::Map { map, .. } => map.is_black(),
            LightDesc::SunSky(light) => light.sky.is_black() && light.sun.is_black(),
            LightDesc::Projector(light) => light.picture.as_ref().is_some_and(|picture| picture.is_black()),
            LightDesc::Spot(light) => light.texture.as_ref().is_some_and(|t| t.texture.is_black()),
            LightDesc::Constant { .. } | LightDesc::Directional { .. } | LightDesc::Point { .. } => false,
        };
        dark || self.spectrum().is_black()
    }

    /// Its radiance, irradiance or intensity, or the factor on it, mutably.
    pub fn spectrum_mut(&mut self) -> &mut Spectrum {
        match self {
            LightDesc::Constant { radiance, .. } => radiance,
            LightDesc::Map { scale, .. } | LightDesc::SunSky(SunSkyDesc { scale, .. }) => scale,
            LightDesc::Directional { irradiance, .. }
            | LightDesc::Projector(ProjectorDesc { irradiance, .. }) => irradiance,
            LightDesc::Spot(SpotDesc { intensity, .. }) | LightDesc::Point { intensity, .. } => intensity,
        }
    }
}
