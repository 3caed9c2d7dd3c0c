//! A direction towards a light, and the point that it is sampled from.

use glam::Vec3;

use crate::math::pdf::PdfW;

/// The lit point, as far as light sampling depends on it; `LightSampleContext` in pbrt-v4.
#[derive(Clone, Copy, Debug)]
pub struct LightSampleContext {
    /// Position, world space.
    pub p: Vec3,
    /// Unit shading normal on the side that is seen; 0 in a medium, which has none.
    pub n: Vec3,
    /// The surface also lets light through from the other side.
    pub through: bool,
    /// The material has a peak, which the choice of a light does not consider: where lights are few, each is sampled.
    pub glossy: bool,
}

/// A sampled direction towards a light.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit direction to the light.
    pub wi: Vec3,
    /// The point on the light; `None` if it is infinitely far.
    pub target: Option<Vec3>,
    /// Factor on the light's spectrum: 1, or 1/r² for a point; times the inverse of its share where one sample stands
    /// for those of several lights.
    pub scale: f32,
    /// Density, including the choice of the light once it comes out of [`Lights::sample`](super::Lights::sample).
    pub pdf: PdfW,
    /// No path can hit the light by chance.
    pub delta: bool,
}
