//! The reference of `tonemap`: scene-linear XYZ becomes encoded display RGB (paper §4.2, steps 6 to 8).
//!
//! The paper scales X and Z "by Y/Y'", which is the ratio upside down: it is Y'/Y.

use glam::{Mat3, Vec3};
use rayon::prelude::*;

use crate::client::compiled_effects;
use crate::client::dither::thresholds;
use crate::client::reference::curves::{MAX_TONE_INPUT, agx, pbr_neutral};
use crate::client::settings::{ColorOutput, DisplayImage, DisplayView, Settings, ToneCurve};
use crate::client::zones;
use crate::color::pq;
use crate::color::profile::{rec709_from_xyz, rec709_luminance};
use crate::image::Grid;

/// Below this argument `1 − exp(−t)` is taken from its series, which does not cancel.
const SERIES_BELOW: f32 = 1e-2;

/// Upper bound on `X/Y` and `Z/Y`: no real stimulus comes near it, and an infinite ratio would have no hue.
const MAX_CHROMATICITY_RATIO: f32 = 1e4;

/// Maps scene-linear colours to the display as these settings say.
pub struct ToneMapper<'a> {
    settings: &'a Settings,
    /// Matrix `P` from the output of the tone curve to linear RGB: from XYZ for the paper's curve, where white of luminance 1 maps to `(1,
    /// 1, 1)`, and from Rec.709 for the others.
    from_xyz: Mat3,
}

impl<'a> ToneMapper<'a> {
    /// The mapper of these settings.
    pub fn new(settings: &'a Settings) -> Self {
        Self { settings, from_xyz: compiled_effects::matrix(settings) }
    }

    /// The largest displayed luminance, 1 being diffuse white.
    pub fn ceiling(&self) -> f32 {
        let is_wide = self.settings.output != ColorOutput::Sdr;
        if is_wide { self.settings.peak as f32 / pq::DIFFUSE_WHITE } else { 1.0 }
    }

    /// Display-linear RGB of a pixel, 1 being diffuse white.
    pub fn linear(&self, xyz: Vec3) -> Vec3 {
        match self.settings.view {
            // Error views are grey and shown without a tone curve.
            DisplayView::CameraVariance | DisplayView::LightVariance => Vec3::splat(xyz.y.clamp(0.0, 1.0)),
            DisplayView::FalseColor => zones::ZONE_COLORS[zones::zone(self.settings.exposure * xyz.y)].into(),
            DisplayView::Picture | DisplayView::Clipping => self.curved(xyz),
        }
    }

    /// As [`linear`](Self::linear), with stripes on clipped or black pixels in the clipping view.
    fn marked(&self, xyz: Vec3, [x, y]: [usize; 2]) -> Vec3 {
        let rgb = self.linear(xyz);
        let stripe = (x + y) >> 2 & 1 == 0;
        match self.settings.view {
            DisplayView::Clipping if stripe && rgb.max_element() >= zones::CLIPPED * self.ceiling() => {
                zones::CLIPPED_MARK.into()
            }
            DisplayView::Clipping if stripe && rgb.max_element() <= zones::BLACK => zones::BLACK_MARK.into(),
            _ => rgb,
        }
    }

    /// The encoded value of a pixel before rounding: 0 … 1, or any positive number for [`ColorOutput::ScRgb`].
    pub fn signal(&self, xyz: Vec3, pixel: [usize; 2]) -> Vec3 {
        let rgb = self.marked(xyz, pixel);
        match (self.settings.output, &self.settings.profile.transfer) {
            (ColorOutput::ScRgb, _) => rgb * (pq::DIFFUSE_WHITE / pq::SCRGB_WHITE),
            (ColorOutput::Hdr10, _) => {
                Vec3::from(rgb.to_array().map(|c| pq::encode(c * (pq::DIFFUSE_WHITE / pq::PQ_PEAK))))
            }
            (ColorOutput::Sdr, Some(table)) => table.apply(rgb),
            (ColorOutput::Sdr, None) => rgb.powf(1.0 / self.settings.gamma),
        }
    }

    /// Display-linear RGB in `[0, ceiling]` of a scene-linear colour.
    fn curved(&self, xyz: Vec3) -> Vec3 {
        let (Settings { exposure, contrast, curve, .. }, ceiling) = (self.settings, self.ceiling());
        let t = (exposure * xyz.y).powf(*contrast);
        if !(xyz.y > 0.0 && t > 0.0) {
            return Vec3::ZERO;
        }
        // X/Y is computed first, because Y'/Y overflows for tiny Y.
        let ratio = |v: f32| if v > 0.0 { (v / xyz.y).min(MAX_CHROMATICITY_RATIO) } else { 0.0 };
        let color = Vec3::new(ratio(xyz.x), 1.0, ratio(xyz.z));
        if *curve == ToneCurve::Paper {
            let luminance = ceiling * one_minus_exp(t / ceiling);
            return desaturate(self.from_xyz * (color * luminance), luminance, ceiling);
        }
        let y = t.min(MAX_TONE_INPUT);
        let rgb = desaturate(rec709_from_xyz() * (color * y), y, 1e12);
        let rgb = if *curve == ToneCurve::AgX { agx(rgb) } else { pbr_neutral(rgb, ceiling) };
        let luminance = rec709_luminance().dot(rgb).clamp(0.0, ceiling);
        desaturate(self.from_xyz * rgb, luminance, ceiling)
    }
}

/// The whole picture in 8 bits, rows in parallel.
pub fn tonemap(picture: &Grid<Vec3>, settings: &Settings) -> DisplayImage {
    let mapper = ToneMapper::new(settings);
    let mut rgb = vec![[0; 3]; picture.pixels().len()];
    let width = picture.width().max(1);
    let rows = picture.pixels().par_chunks(width);
    rgb.par_chunks_mut(width).zip(rows).enumerate().for_each(|(y, (out, row))| {
        for (x, (out, &xyz)) in out.iter_mut().zip(row).enumerate() {
            let t = Vec3::from(thresholds(settings.dither, x, y));
            *out = (mapper.signal(xyz, [x, y]) * 255.0 + t).floor().to_array().map(|c| c as u8);
        }
    });
    DisplayImage { width: picture.width() as u32, height: picture.height() as u32, rgb }
}

/// `1 − exp(−t)` without cancellation.
#[inline]
fn one_minus_exp(t: f32) -> f32 {
    if t < SERIES_BELOW {
        t * (1.0 - t * (0.5 - t * (1.0 / 6.0 - t * (1.0 / 24.0))))
    } else {
        1.0 - (-t).exp()
    }
}

/// Moves `rgb` towards the grey of its own luminance by the least amount that brings every channel into
/// `[0, ceiling]`; luminance is unchanged.
#[inline]
fn desaturate(rgb: Vec3, luminance: f32, ceiling: f32) -> Vec3 {
    let mut keep = 1.0f32;
    for c in rgb.to_array() {
        if c > ceiling {
            keep = keep.min((ceiling - luminance) / (c - luminance));
        } else if c < 0.0 {
            keep = keep.min(luminance / (luminance - c));
        }
    }
    (Vec3::splat(luminance) + (rgb - luminance) * keep).clamp(Vec3::ZERO, Vec3::splat(ceiling))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The series and the exponential agree near the switch and far below it.
    #[test]
    fn one_minus_exp_has_its_digits() {
        for i in 0..2000 {
            let t = 1e-9 * 1.013f32.powi(i);
            let exact = -(-f64::from(t)).exp_m1();
            let error = (f64::from(one_minus_exp(t)) / exact - 1.0).abs();
            assert!(error < if t < SERIES_BELOW { 2e-7 } else { 6e-6 }, "{t}: {error}");
        }
    }
}
