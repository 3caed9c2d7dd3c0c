//! A sky with a sun in it.

use std::sync::Arc;

use glam::{DMat3, Vec3};

use crate::math::frame::Frame;
use crate::math::pdf::PdfW;
use crate::math::warp;
use crate::spectrum::{EmissionMap, SampledSpectrum, SampledWavelengths, Spectrum};

use super::{DirectionSampling, EnvironmentMap};

/// The disc of the sun, which is equally bright all over.
#[derive(Clone, Debug)]
pub struct SunDisc {
    /// Unit direction to its middle, world space.
    direction: Vec3,
    /// 1 − cos of its half angle.
    cone: f32,
    radiance: Spectrum,
}

impl SunDisc {
    /// The disc around the unit vector `direction` with this half angle in radians.
    pub fn new(direction: Vec3, half_angle: f64, radiance: Spectrum) -> Self {
        Self { direction, cone: (2.0 * (0.5 * half_angle).sin().powi(2)) as f32, radiance }
    }

    #[inline]
    fn contains(&self, wi: Vec3) -> bool {
        // The square of a chord is 2 (1 − cos), without cancellation.
        wi.distance_squared(self.direction) <= 2.0 * self.cone
    }
}

/// A picture of the sky above the horizon, and the sun before it. Directions are chosen from both; nothing comes from below the
/// horizon, where the picture would reach by half a row.
#[derive(Clone, Debug)]
pub struct SunSkyLight {
    sky: EnvironmentMap,
    sun: SunDisc,
    /// Unit direction to the zenith, world space.
    up: Vec3,
    /// The probability with which emission chooses the sun.
    share: f32,
    /// The probability with which next-event estimation chooses the sun: what is left are directions brighter than the sky's
    /// mean.
    excess_share: f32,
    mean_luminance: f32,
}

/// Bounds of the probability of the sun where sky and sun shine: what the sun does not reach is lit by the sky.
const SHARE: [f32; 2] = [0.1, 0.5];

impl SunSkyLight {
    /// The sky of `map`, turned by `to_world`, as [`EnvironmentMap::new`] takes them, and the sun.
    pub fn new(map: Arc<EmissionMap>, to_world: DMat3, sun: SunDisc) -> Self {
        let sky = EnvironmentMap::new(map, to_world);
        // The share of all directions times luminance.
        let of_sun = 0.5 * sun.cone * sun.radiance.luminance();
        let mean_luminance = sky.mean_luminance() + of_sun;
        let share = sun_share(of_sun, sky.mean_luminance());
        let excess_share = sun_share(of_sun, sky.mean_luminance() * sky.excess());
        Self { sky, sun, up: to_world.y_axis.as_vec3(), share, excess_share, mean_luminance }
    }
}

/// The probability of the sun where it brings the light `sun` and the sky `sky`.
fn sun_share(sun: f32, sky: f32) -> f32 {
    let share = if sun > 0.0 { sun / (sun + sky) } else { 0.0 };
    if share > 0.0 && sky > 0.0 { share.clamp(SHARE[0], SHARE[1]) } else { share }
}

impl SunSkyLight {
    /// A direction to the sun with the probability `share`, or one that `sample` takes of the sky; and its density, with that of the sky by
    /// `pdf`.
    #[inline]
    fn sample_with(
        &self,
        [u, v]: [f32; 2],
        share: f32,
        sample: impl FnOnce([f32; 2]) -> Option<(Vec3, PdfW)>,
        pdf: impl FnOnce(Vec3) -> PdfW,
    ) -> Option<(Vec3, PdfW)> {
        // The numbers are stretched again.
        let (wi, sky) = if u < share {
            let local = warp::cone([u / share, v], self.sun.cone);
            let wi = Frame::new(self.sun.direction).to_world(local).normalize();
            (wi, pdf(wi))
        } else {
            sample([((u - share) / (1.0 - share)).min(1.0 - f32::EPSILON), v])?
        };
        let pdf = self.pdf_with(wi, share, sky);
        (pdf.0 > 0.0).then_some((wi, pdf))
    }

    /// The density of [`SunSkyLight::sample_with`], where that of the sky is `sky`.
    #[inline]
    fn pdf_with(&self, wi: Vec3, share: f32, sky: PdfW) -> PdfW {
        let sun = if self.sun.contains(wi) { share * warp::cone_pdf(self.sun.cone) } else { 0.0 };
        PdfW(sun + (1.0 - share) * sky.0)
    }
}

impl DirectionSampling for SunSkyLight {
    #[inline]
    fn sample_direction(&self, u: [f32; 2]) -> Option<(Vec3, PdfW)> {
        let Self { sky, share, .. } = self;
        self.sample_with(u, *share, |u| sky.sample_direction(u), |wi| sky.pdf_direction(wi))
    }

    #[inline]
    fn pdf_direction(&self, wi: Vec3) -> PdfW {
        self.pdf_with(wi, self.share, self.sky.pdf_direction(wi))
    }

    #[inline]
    fn sample_excess(&self, u: [f32; 2]) -> Option<(Vec3, PdfW)> {
        let Self { sky, excess_share, .. } = self;
        self.sample_with(u, *excess_share, |u| sky.sample_excess(u), |wi| sky.pdf_excess(wi))
    }

    #[inline]
    fn pdf_excess(&self, wi: Vec3) -> PdfW {
        self.pdf_with(wi, self.excess_share, self.sky.pdf_excess(wi))
    }

    fn excess(&self) -> f32 {
        let sky = self.sky.mean_luminance();
        let of_sun = self.mean_luminance - sky;
        if self.mean_luminance > 0.0 { (of_sun + sky * self.sky.excess()) / self.mean_luminance } else { 0.0 }
    }

    #[inline]
    fn radiance(&self, wi: Vec3, lambda: &SampledWavelengths) -> SampledSpectrum {
        if wi.dot(self.up) < 0.0 {
            return SampledSpectrum::ZERO;
        }
        let sky = self.sky.radiance(wi, lambda);
        if self.sun.contains(wi) { sky + self.sun.radiance.sample(lambda) } else { sky }
    }

    fn mean_luminance(&self) -> f32 {
        self.mean_luminance
    }
}
