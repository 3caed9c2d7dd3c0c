//! Values at the wavelengths of one path.

use std::ops::{Add, AddAssign, Mul, MulAssign};

use glam::Vec4;

/// Radiance, reflectance or throughput at the four wavelengths of one path, in lane order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SampledSpectrum(pub Vec4);

impl SampledSpectrum {
    /// Zero at every wavelength.
    pub const ZERO: Self = Self(Vec4::ZERO);
    /// One at every wavelength.
    pub const ONE: Self = Self(Vec4::ONE);

    /// The same value at every wavelength.
    #[inline]
    pub fn splat(v: f32) -> Self {
        Self(Vec4::splat(v))
    }

    /// True for numbers from 0 to `most`; false where one is not a number.
    #[inline]
    pub fn is_within(self, most: f32) -> bool {
        (self.0.cmpge(Vec4::ZERO) & self.0.cmple(Vec4::splat(most))).all()
    }

    /// True when every lane is exactly zero.
    #[inline]
    pub fn is_black(self) -> bool {
        self.0 == Vec4::ZERO
    }

    /// The largest lane.
    #[inline]
    pub fn max_element(self) -> f32 {
        self.0.max_element()
    }

    /// The mean of the lanes.
    #[inline]
    pub fn mean(self) -> f32 {
        self.0.element_sum() * 0.25
    }

    /// True when every lane is finite.
    #[inline]
    pub fn is_finite(self) -> bool {
        self.0.is_finite()
    }
}

impl From<SampledSpectrum> for [f32; 4] {
    fn from(spectrum: SampledSpectrum) -> Self {
        spectrum.0.to_array()
    }
}

impl Add for SampledSpectrum {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        Self(self.0 + o.0)
    }
}
impl AddAssign for SampledSpectrum {
    #[inline]
    fn add_assign(&mut self, o: Self) {
        self.0 += o.0;
    }
}
impl Mul for SampledSpectrum {
    type Output = Self;
    #[inline]
    fn mul(self, o: Self) -> Self {
        Self(self.0 * o.0)
    }
}
impl MulAssign for SampledSpectrum {
    #[inline]
    fn mul_assign(&mut self, o: Self) {
        self.0 *= o.0;
    }
}
impl Mul<f32> for SampledSpectrum {
    type Output = Self;
    #[inline]
    fn mul(self, s: f32) -> Self {
        Self(self.0 * s)
    }
}
impl MulAssign<f32> for SampledSpectrum {
    #[inline]
    fn mul_assign(&mut self, s: f32) {
        self.0 *= s;
    }
}
