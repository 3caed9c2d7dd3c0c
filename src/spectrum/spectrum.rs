//! Spectra that scenes are made of.

use std::sync::Arc;

use glam::{DVec3, Vec3, Vec3A, Vec4};

use super::reflectance_table::ReflectanceTable;
use super::table::Table;
use super::upsample::{self, Sigmoid};
use super::{LAMBDA_MAX, LAMBDA_MIN, SampledSpectrum, SampledWavelengths};
use crate::color::{Profile, cie};

/// A function of wavelength, ready to be evaluated in the hot loop. Cheap to clone.
#[derive(Clone, Debug, PartialEq)]
pub enum Spectrum {
    /// The same value at every wavelength.
    Constant(f32),
    /// CIE D65, scaled to Y = 1, times a factor.
    D65(f32),
    /// A smooth reflectance.
    Sigmoid(Sigmoid),
    /// A smooth reflectance times a factor.
    Scaled {
        /// The factor.
        scale: f32,
        /// The spectrum that it is applied to.
        shape: Sigmoid,
    },
    /// A smooth reflectance lit by D65, times a factor: the light of a coloured lamp.
    Emission {
        /// The factor.
        scale: f32,
        /// Filter before a D65 lamp.
        shape: Sigmoid,
    },
    /// Measured points.
    Table(Arc<Table>),
}

/// Larger components are cut: sums over a picture must stay finite in single precision.
pub(crate) const BRIGHTEST: f32 = 1e30;

impl Spectrum {
    /// The values at the wavelengths of a path.
    #[inline]
    pub fn sample(&self, lambda: &SampledWavelengths) -> SampledSpectrum {
        SampledSpectrum(self.eval(lambda.lambda()))
    }

    /// The values at any four wavelengths, in nm.
    #[inline]
    pub fn eval(&self, lambda: Vec4) -> Vec4 {
        match self {
            Spectrum::Constant(v) => Vec4::splat(*v),
            Spectrum::D65(scale) => d65(lambda) * *scale,
            Spectrum::Sigmoid(shape) => shape.eval(lambda),
            Spectrum::Scaled { scale, shape } => shape.eval(lambda) * *scale,
            Spectrum::Emission { scale, shape } => shape.eval(lambda) * d65(lambda) * *scale,
            Spectrum::Table(table) => table.at_each(lambda),
        }
    }

    /// A reflectance that looks like linear Rec.709 `rgb` (each in [0, 1], clamped) under D65:
    /// Jakob and Hanika 2019. Greys are exactly constant.
    ///
    /// Takes up to a millisecond: for scene loading, not for the hot loop.
    pub fn reflectance_rgb(rgb: [f32; 3]) -> Self {
        let rgb = rgb.map(|v| clean(v, 1.0));
        if let [r, g, b] = rgb
            && r == g
            && g == b
        {
            return Spectrum::Constant(r);
        }
        Spectrum::Sigmoid(upsample::reflectance(DVec3::from_array(rgb.map(f64::from))))
    }

    /// The values of [`Spectrum::reflectance_rgb`] at the wavelengths of a path, within some thousandths, for textures: in tens of
    /// nanoseconds, by a table that the first call makes.
    #[inline]
    pub fn textured_rgb(rgb: Vec3A, lambda: &SampledWavelengths) -> SampledSpectrum {
        if rgb.x == rgb.y && rgb.y == rgb.z {
            return SampledSpectrum::splat(rgb.x);
        }
        let (shape, scale) = ReflectanceTable::get().find(rgb);
        SampledSpectrum((shape.eval(lambda.lambda()) * scale).min(Vec4::ONE))
    }

    /// Makes the table of [`Spectrum::textured_rgb`] if it is not there yet.
    pub fn prepare_textures() {
        ReflectanceTable::get();
    }

    /// The emission of a light of colour `rgb` (linear Rec.709, unbounded): a smooth spectrum times D65,
    /// as Mitsuba's spectral mode makes it. RGB (1, 1, 1) is D65 with Y = 1.
    pub fn emission_rgb(rgb: [f32; 3]) -> Self {
        match Self::unbounded_rgb(rgb) {
            Spectrum::Constant(v) => Spectrum::D65(v),
            Spectrum::Scaled { scale, shape } => Spectrum::Emission { scale, shape },
            other => other,
        }
    }

    /// Any non-negative `rgb` that is neither reflectance nor emission: scaled smooth spectrum.
    ///
    /// The brightest component lies at half of the smooth spectrum's range, where it is smoothest
    /// (as pbrt-v4 `RGBUnboundedSpectrum` and Mitsuba 3 `d65` with a colour).
    pub fn unbounded_rgb(rgb: [f32; 3]) -> Self {
        let rgb = rgb.map(|v| clean(v, BRIGHTEST));
        let [r, g, b] = rgb;
        if r == g && g == b {
            return Spectrum::Constant(r);
        }
        let scale = 2.0 * r.max(g).max(b);
        match Self::reflectance_rgb(rgb.map(|v| v / scale)) {
            Spectrum::Sigmoid(shape) => Spectrum::Scaled { scale, shape },
            // Components so close, or so small, that their quotients are equal.
            _ => Spectrum::Constant(0.5 * scale),
        }
    }

    /// The extinction coefficient of a medium of colour `rgb`: up to 1 as [`Spectrum::reflectance_rgb`], as Mitsuba's spectral mode, and
    /// above, where Mitsuba refuses it, as [`Spectrum::unbounded_rgb`].
    pub fn extinction_rgb(rgb: [f32; 3]) -> Self {
        match rgb.iter().any(|v| *v > 1.0) {
            true => Self::unbounded_rgb(rgb),
            false => Self::reflectance_rgb(rgb),
        }
    }

    /// CIE D65 times `scale`, normalised as Mitsuba's `d65` plugin: scale 1 gives Y = 1.
    pub fn d65(scale: f32) -> Self {
        Spectrum::D65(scale)
    }

    /// Linear interpolation between `(wavelength nm, value)` pairs in ascending order, zero outside
    /// (as Mitsuba's `irregular`). `None` if there are fewer than two, if wavelengths are not strictly
    /// ascending, or if a figure is negative or not finite.
    pub fn table(points: &[(f32, f32)]) -> Option<Self> {
        Table::new(points).map(|t| Spectrum::Table(Arc::new(t)))
    }

    /// This spectrum times `factor`; a factor that is negative or not a number counts as 0, and products are cut to
    /// what sums over a picture can hold.
    pub fn scaled(&self, factor: f32) -> Self {
        let factor = clean(factor, BRIGHTEST);
        let times = |v: f32| clean(v * factor, BRIGHTEST);
        match self {
            Spectrum::Constant(v) => Spectrum::Constant(times(*v)),
            Spectrum::D65(v) => Spectrum::D65(times(*v)),
            Spectrum::Sigmoid(shape) => Spectrum::Scaled { scale: factor, shape: *shape },
            Spectrum::Scaled { scale, shape } => Spectrum::Scaled { scale: times(*scale), shape: *shape },
            Spectrum::Emission { scale, shape } => Spectrum::Emission { scale: times(*scale), shape: *shape },
            Spectrum::Table(table) => Spectrum::Table(Arc::new(table.scaled(factor, BRIGHTEST))),
        }
    }

    /// The colour in linear Rec.709 that a surface of this reflectance has under D65; white is (1, 1, 1). What
    /// [`Spectrum::reflectance_rgb`] undoes, nearly. Components may lie outside [0, 1].
    pub fn reflected_rgb(&self) -> [f32; 3] {
        if let Spectrum::Constant(v) = self {
            return [*v; 3];
        }
        rgb_of(|lambda| (self.eval(Vec4::splat(lambda)) * d65(Vec4::splat(lambda))).x)
    }

    /// The colour in linear Rec.709 of a light with this spectrum, relative to the profile's white D65; components may be
    /// negative.
    pub fn emitted_rgb(&self) -> [f32; 3] {
        rgb_of(|lambda| self.eval(Vec4::splat(lambda)).x)
    }

    /// True when the value does not depend on wavelength.
    pub fn is_constant(&self) -> bool {
        matches!(self, Spectrum::Constant(_))
    }

    /// True when the value is zero at every wavelength.
    pub fn is_black(&self) -> bool {
        match self {
            Spectrum::Constant(v) | Spectrum::D65(v) => *v == 0.0,
            Spectrum::Sigmoid(_) => false,
            Spectrum::Scaled { scale, .. } | Spectrum::Emission { scale, .. } => *scale == 0.0,
            Spectrum::Table(table) => table.max() == 0.0,
        }
    }

    /// The largest value over the simulated range (an upper bound is enough).
    pub fn max(&self) -> f32 {
        match self {
            Spectrum::Constant(v) => *v,
            Spectrum::D65(scale) => scale * brightest_d65(),
            Spectrum::Sigmoid(shape) => shape.max(LAMBDA_MIN, LAMBDA_MAX),
            Spectrum::Scaled { scale, shape } => scale * shape.max(LAMBDA_MIN, LAMBDA_MAX),
            Spectrum::Emission { scale, shape } => {
                scale * shape.max(LAMBDA_MIN, LAMBDA_MAX) * brightest_d65()
            }
            Spectrum::Table(table) => table.max(),
        }
    }

    /// The luminance Y of the spectrum taken as radiance (for choosing lights by power).
    pub fn luminance(&self) -> f32 {
        match self {
            Spectrum::Constant(v) | Spectrum::D65(v) => *v,
            _ => cie::integrate(|lambda, _| f64::from(self.eval(Vec4::splat(lambda)).x)).y as f32,
        }
    }
}

/// Linear Rec.709 of a spectrum of radiance over wavelength in nm.
pub(super) fn rgb_of(radiance: impl Fn(f32) -> f32) -> [f32; 3] {
    let xyz = cie::integrate(|lambda, _| f64::from(radiance(lambda)));
    (Profile::srgb().from_xyz * Vec3::new(xyz.x as f32, xyz.y as f32, xyz.z as f32)).to_array()
}

/// `v` cut to [0, max]; NaN, unlike with `clamp`, is 0.
fn clean(v: f32, max: f32) -> f32 {
    if v > 0.0 { v.min(max) } else { 0.0 }
}

/// D65 with Y = 1 at four wavelengths in nm.
#[inline]
fn d65(lambda: Vec4) -> Vec4 {
    let rows = cie::Rows::get();
    let [a, b, c, d] = lambda.to_array();
    Vec4::new(rows.at(a).w, rows.at(b).w, rows.at(c).w, rows.at(d).w)
}

fn brightest_d65() -> f32 {
    cie::Rows::get().iter().map(|(_, row)| row.w).fold(0.0, f32::max)
}
