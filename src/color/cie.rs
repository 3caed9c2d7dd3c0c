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
        Self { rows }
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
