//! Black bodies: Planck's law, M. Planck, *Ueber das Gesetz der Energieverteilung im Normalspectrum*, Annalen der Physik 309(3), 1901.

use glam::Vec4;

use super::spectrum::rgb_of;

/// The hottest black body, K.
pub const HOTTEST: f64 = 1e9;

/// Planck's constant J s, the speed of light m/s, Boltzmann's constant J/K (exact since 2019).
const H: f64 = 6.626_070_15e-34;
const C: f64 = 299_792_458.0;
const K: f64 = 1.380_649e-23;

/// Spectral radiance of a black body of temperature `kelvin` in K, above 0, at a wavelength in nm: in W m⁻² sr⁻¹ nm⁻¹.
pub fn radiance(nm: f64, kelvin: f64) -> f64 {
    let m = nm * 1e-9;
    1e-9 * 2.0 * H * C * C / (m.powi(5) * (H * C / (m * K * kelvin)).exp_m1())
}

/// [`radiance`] at four wavelengths in nm, in single precision, for the hot loop. What is not above 0 K is dark.
#[inline]
pub fn radiance_at(lambda: Vec4, kelvin: f32) -> Vec4 {
    /// 2 h c² in W m⁻² sr⁻¹ nm⁴.
    const FIRST: f32 = (2.0 * H * C * C * 1e36) as f32;
    /// h c / k in nm K.
    const SECOND: f32 = (H * C / K * 1e9) as f32;
    if kelvin <= 0.0 || kelvin.is_nan() {
        return Vec4::ZERO;
    }
    let inverse = lambda.recip();
    let squared = inverse * inverse;
    // Of a cold body this is infinite, and its radiance 0.
    let mut denominator = (inverse * (SECOND / kelvin)).to_array();
    for value in &mut denominator {
        *value = value.exp_m1();
    }
    FIRST * squared * squared * inverse / Vec4::from_array(denominator)
}

/// The colours of black bodies up to the temperature `hottest` in K: a function from K to linear Rec.709, relative to white of D65 with Y = 1, whose
/// negative components are 0. It interpolates in a table, within a thousandth of the brightest component.
pub fn colors(hottest: f32) -> impl Fn(f32) -> [f32; 3] {
    const PIECES: usize = 4096;
    /// Light of a colder body is 0 in single precision, K.
    const COLDEST: f64 = 100.0;
    let hottest = f64::from(hottest).clamp(2.0 * COLDEST, HOTTEST);
    let step = (hottest / COLDEST).ln() / PIECES as f64;
    let knot = |i: usize| {
        let kelvin = COLDEST * (step * i as f64).exp();
        rgb_of(|nm| radiance(f64::from(nm), kelvin) as f32).map(|v| v.max(0.0))
    };
    let table: Vec<[f32; 3]> = (0..=PIECES).map(knot).collect();
    move |kelvin| {
        let at = (f64::from(kelvin) / COLDEST).ln() / step;
        if at < 0.0 || at.is_nan() {
            return [0.0; 3];
        }
        let piece = (at as usize).min(PIECES - 1);
        let share = (at - piece as f64).min(1.0) as f32;
        std::array::from_fn(|i| table[piece][i] + (table[piece + 1][i] - table[piece][i]) * share)
    }
}
