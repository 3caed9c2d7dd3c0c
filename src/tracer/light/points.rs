//! The lights that are points, one of which a camera path samples from along each of its flights through a medium.

use glam::Vec3;

use crate::math::distribution::Distribution;

use super::shapes::{Light, with_light};
use super::source::LightSource;

/// A light that is a point, and the probability with which it is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointChoice {
    /// Its index among all lights.
    pub light: u32,
    /// Its position in rendering space.
    pub position: Vec3,
    /// The probability with which it is chosen.
    pub probability: f32,
}

/// The lights of a scene that are points, chosen by their power: the choice does not depend on a place.
#[derive(Clone, Debug)]
pub struct PointLights {
    /// Indices among all lights, in ascending order, and positions.
    lights: Vec<(u32, Vec3)>,
    choice: Distribution,
}

impl PointLights {
    /// Those of `lights`, whose powers are `powers`; `None` where there is none that shines.
    pub(super) fn of(lights: &[Light], powers: &[f32]) -> Option<Self> {
        let position = |light: &Light| with_light!(&light.shape, l => l.position());
        let points = lights.iter().zip(powers).enumerate();
        let points = points.filter_map(|(i, (light, power))| Some((i as u32, position(light)?, *power)));
        let points: Vec<_> = points.filter(|(.., power)| *power > 0.0).collect();
        let powers: Vec<f32> = points.iter().map(|(.., power)| *power).collect();
        let choice = Distribution::new(&powers)?;
        let lights = points.into_iter().map(|(light, position, _)| (light, position)).collect();
        Some(Self { lights, choice })
    }

    /// One of them, by `u` in [0, 1).
    #[inline]
    pub fn choose(&self, u: f64) -> PointChoice {
        self.at(self.choice.sample(u).index)
    }

    /// The light of this index among all lights; `None` where it is no point.
    #[inline]
    pub fn of_light(&self, light: u32) -> Option<PointChoice> {
        self.lights.binary_search_by_key(&light, |(light, _)| *light).ok().map(|slot| self.at(slot))
    }

    #[inline]
    fn at(&self, slot: usize) -> PointChoice {
        let (light, position) = self.lights[slot];
        PointChoice { light, position, probability: self.choice.probability(slot) }
    }
}
