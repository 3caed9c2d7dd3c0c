//! The same radiance from everywhere.

use crate::math::frame::Frame;
use crate::math::pdf::PdfW;
use crate::math::warp;
use glam::Vec3;

use super::{LightSample, LitPoint};

/// A constant environment. What matters about a direction is the cosine at the lit point, so that is what
/// directions are chosen by: only the hemisphere that is seen is sampled.
#[derive(Clone, Debug)]
pub struct ConstantLight;

impl ConstantLight {
    /// A unit direction towards the environment and its density per steradian; the same for every point of the scene.
    #[inline]
    pub fn sample_direction(&self, u: [f32; 2]) -> (Vec3, PdfW) {
        (warp::sphere(u), self.pdf_direction())
    }

    /// The density of [`ConstantLight::sample_direction`].
    #[inline]
    pub fn pdf_direction(&self) -> PdfW {
        PdfW(warp::cone_pdf(2.0))
    }

    #[inline]
    pub(super) fn sample(&self, at: LitPoint, u: [f32; 2]) -> Option<LightSample> {
        let local = warp::cosine_hemisphere(u);
        let pdf = PdfW(warp::cosine_hemisphere_pdf(local.z));
        Some(LightSample {
            wi: Frame::new(at.n).to_world(local),
            target: None,
            scale: 1.0,
            pdf,
            delta: false,
        })
    }

    #[inline]
    pub(super) fn pdf(&self, at: LitPoint, wi: Vec3) -> PdfW {
        PdfW(warp::cosine_hemisphere_pdf(wi.dot(at.n)))
    }
}
