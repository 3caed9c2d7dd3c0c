//! The CIE 1931 2° standard observer and CIE standard illuminant D65 as one table for the hot loop.
//!
//! `cie_1931.csv` holds the CIE's datasets at 1 nm from 380 to 780 nm. They are read once, on first use, into rows
//! `[x̄, ȳ, z̄, D65]` of 16 bytes, so that turning one wavelength into XYZ costs one load. Every curve is taken as
//! constant over the 1 nm around its sample. All integrals in the program are then exact sums over the rows, and a
//! Monte Carlo estimate over wavelengths converges to exactly these sums.

use std::sync::LazyLock;

use glam::{DVec3, Vec4};

/// Wavelength of the first sample of the tables, in nm; the curves are zero half a nanometre below it.
pub const FIRST_NM: f32 = 380.0;

/// Samples in the tables, at 1 nm: the last lies at 780 nm, the curves are zero half a nanometre above it.
pub const COUNT: usize = 401;

/// The observer and D65, with a row of zeros at either end for invisible wavelengths.
struct CieData {
    rows: [Vec4; COUNT + 2],
    /// ∫ȳ dλ in nm.
    y_integral: f64,
}

static TABLE: LazyLock<CieData> = LazyLock::new(CieData::read);

impl CieData {
    fn read() -> Self {
        let lines = include_str!("cie_1931.csv").lines().filter(|line| !line.starts_with('#'));
        let (observer, d65): (Vec<DVec3>, Vec<f64>) = lines
            .map(|line| {
                let mut values = line.split(',').skip(1).map(|v| v.parse().expect("the file holds numbers"));
                let mut next = || values.next().expect("the file has five columns");
                (DVec3::new(next(), next(), next()), next())
            })
            .unzip();
        let y_integral: f64 = observer.iter().map(|o| o.y).sum();
        let d65_y: f64 = observer.iter().zip(&d65).map(|(o, e)| o.y * e).sum();

        let mut rows = [Vec4::ZERO; COUNT + 2];
        for (row, (o, e)) in rows[1..].iter_mut().zip(observer.iter().zip(&d65)) {
            *row = (o / y_integral).extend(e * y_integral / d65_y).as_vec4();
        }
        Self { rows, y_integral }
    }
}

/// The rows, for the hot loop: take them once, then look up as often as needed.
#[derive(Clone, Copy)]
pub struct Rows(&'static [Vec4; COUNT + 2]);

impl Rows {
    /// The rows; the first call in the program reads them (microseconds).
    #[inline]
    pub fn get() -> Self {
        Rows(&TABLE.rows)
    }

    /// `[x̄, ȳ, z̄, D65]` at `lambda` nm: the observer in 1/nm, divided by ∫ȳ dλ, and D65 scaled to Y = 1;
    /// zero outside the tables and for NaN.
    #[inline]
    pub fn at(self, lambda: f32) -> Vec4 {
        // A cast from float saturates (and takes NaN to 0), so only the upper end needs care.
        let i = (lambda - (FIRST_NM - 1.5)) as usize;
        self.0[i.min(COUNT + 1)]
    }

    /// The samples with their wavelengths in nm, as [`Rows::at`] has them.
    pub fn iter(self) -> impl Iterator<Item = (f32, Vec4)> {
        self.0[1..=COUNT].iter().enumerate().map(|(i, row)| (FIRST_NM + i as f32, *row))
    }
}

/// ∫ȳ dλ of the 1931 observer, in nm (106.86).
pub fn y_integral() -> f64 {
    TABLE.y_integral
}

/// XYZ of D65 scaled to Y = 1: the white of the whole program, and what RGB (1, 1, 1) stands for.
pub fn d65_white() -> DVec3 {
    integrate(|_, row| f64::from(row.w))
}

/// XYZ of the spectrum `f(λ in nm, row)`, on the scale where D65 has Y = 1.
pub fn integrate(mut f: impl FnMut(f32, Vec4) -> f64) -> DVec3 {
    Rows::get()
        .iter()
        .fold(DVec3::ZERO, |sum, (lambda, row)| sum + row.truncate().as_dvec3() * f(lambda, row))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_those_of_the_cie() {
        // CIE 15: ȳ(555) = 1.0000, x̄(600) = 1.0622, z̄(450) = 1.77211; D65(560)/D65(500) = 100/109.354.
        let y = y_integral() as f32;
        assert!((y - 106.857).abs() < 2e-3, "{y}");
        assert!((Rows::get().at(555.0).y * y - 1.0).abs() < 1e-6);
        assert!((Rows::get().at(600.0).x * y - 1.0622).abs() < 1e-6);
        assert!((Rows::get().at(450.0).z * y - 1.77211).abs() < 1e-6);
        let ratio = Rows::get().at(560.0).w / Rows::get().at(500.0).w;
        assert!((ratio - 100.0 / 109.354).abs() < 1e-6);
    }

    #[test]
    fn equal_energy_and_d65_have_their_whites() {
        let e = integrate(|_, _| 1.0);
        assert!((e.y - 1.0).abs() < 1e-6 && (e - DVec3::ONE).abs().max_element() < 2e-4, "{e}");
        let w = d65_white();
        assert!((w.y - 1.0).abs() < 1e-6);
        // CIE 15: x = 0.31272, y = 0.32903.
        assert!((w.x / w.element_sum() - 0.31272).abs() < 5e-5, "{w}");
        assert!((w.y / w.element_sum() - 0.32903).abs() < 5e-5, "{w}");
    }

    #[test]
    fn nothing_is_seen_outside_the_tables() {
        for lambda in [f32::NEG_INFINITY, -1.0, 0.0, 360.0, 379.4, 780.6, 830.0, 1e9, f32::INFINITY, f32::NAN]
        {
            assert_eq!(Rows::get().at(lambda), Vec4::ZERO, "{lambda}");
        }
        assert_ne!(Rows::get().at(379.6).x, 0.0);
        assert_ne!(Rows::get().at(780.4).x, 0.0);
    }
}
