//! What lies between a lit point and a light.

use glam::Vec3;

use crate::math::frame::Frame;
use crate::math::pdf::PdfW;
use crate::tracer::bsdf::Scattering;

/// The point that is to be lit.
#[derive(Clone, Copy, Debug)]
pub struct LitPoint {
    /// Position, world space.
    pub p: Vec3,
    /// Unit shading normal on the side that is seen.
    pub n: Vec3,
    /// The surface also lets light through from the other side.
    pub through: bool,
    /// The material has a peak that no choice of a light knows: where lights are few, each of them is sampled.
    pub glossy: bool,
}

impl LitPoint {
    /// A point of `bsdf` in `frame`, seen from the side of the local direction `eye`.
    #[inline]
    pub fn of(p: Vec3, frame: &Frame, (bsdf, eye): (&impl Scattering, Vec3)) -> Self {
        let n = if eye.z < 0.0 { -frame.n } else { frame.n };
        Self { p, n, through: bsdf.transmits(), glossy: bsdf.is_glossy() }
    }
}

/// A direction towards a light.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit direction to the light.
    pub wi: Vec3,
    /// The point on the light; `None` is infinitely far.
    pub target: Option<Vec3>,
    /// Factor on the light's spectrum: 1, or 1/r² for a point; times the inverse of its share where one sample stands
    /// for those of several lights.
    pub scale: f32,
    /// Density, including the choice of the light once it comes out of [`Lights::sample`](super::Lights::sample).
    pub pdf: PdfW,
    /// Cannot be met by chance.
    pub delta: bool,
}
