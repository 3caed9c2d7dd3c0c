//! Points that emit the same in all directions.

use glam::Vec3;

use crate::math::pdf::PdfW;

use super::{LightSample, LitPoint};

/// A point.
#[derive(Clone, Debug)]
pub struct PointLight {
    /// World space.
    pub position: Vec3,
}

impl PointLight {
    #[inline]
    pub(super) fn sample(&self, at: LitPoint) -> Option<LightSample> {
        let to = self.position - at.p;
        let distance2 = to.length_squared();
        let scale = 1.0 / distance2;
        // A light at the very point it lights has no direction.
        scale.is_finite().then(|| LightSample {
            wi: to * (1.0 / distance2.sqrt()),
            target: Some(self.position),
            scale,
            pdf: PdfW(1.0),
            delta: true,
        })
    }
}
