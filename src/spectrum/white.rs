//! Light of one white: what all lights of an achromatic scene have in common.

use std::sync::LazyLock;

use glam::{DMat3, DVec3, Vec4};

use super::{SampledWavelengths, Spectrum};
use crate::color::cie;

/// Which white a light has: spectra of the same one differ by a factor only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum White {
    /// Equal at all wavelengths.
    Equal,
    /// CIE D65.
    D65,
}

/// Wavelengths of which every white is a mixture, nm. In the triangle of their colours lie both whites; which they are does not
/// matter otherwise, since all that paths meet is grey.
const NODES: [f64; 3] = [450.0, 545.0, 610.0];

impl White {
    /// The white of a spectrum; `None` for a colour, and for a white that is neither.
    pub fn of(spectrum: &Spectrum) -> Option<Self> {
        match spectrum {
            Spectrum::Constant(_) => Some(White::Equal),
            Spectrum::D65(_) => Some(White::D65),
            _ => None,
        }
    }

    /// Its spectrum, of luminance 1.
    pub fn spectrum(self) -> Spectrum {
        match self {
            White::Equal => Spectrum::Constant(1.0),
            White::D65 => Spectrum::D65(1.0),
        }
    }

    /// Wavelengths that stand for this white: of a value in proportion to [`White::spectrum`],
    /// [`to_xyz`](SampledWavelengths::to_xyz) is the XYZ of the whole spectrum and no estimate of it. A path without colour that
    /// carries these has no noise of wavelengths.
    pub fn wavelengths(self) -> SampledWavelengths {
        static ALL: LazyLock<[SampledWavelengths; 2]> =
            LazyLock::new(|| [White::Equal, White::D65].map(quadrature));
        ALL[self as usize]
    }
}

/// Solves Σ w(λ) · observer(λ) · white(λ) = XYZ(white) for the weights of the nodes; the last of them takes two lanes.
fn quadrature(white: White) -> SampledWavelengths {
    let spectrum = white.spectrum();
    let value = |lambda: f64| f64::from(spectrum.eval(Vec4::splat(lambda as f32)).x);
    let column = |lambda: f64| cie::Rows::get().at(lambda as f32).truncate().as_dvec3() * value(lambda);
    let whole: DVec3 = cie::integrate(|lambda, _| value(f64::from(lambda)));
    let weights = DMat3::from_cols(column(NODES[0]), column(NODES[1]), column(NODES[2])).inverse() * whole;
    let [a, b, c] = weights.to_array();
    let pdf = [a, b, 0.5 * c, 0.5 * c].map(|weight| (0.25 / weight) as f32);
    SampledWavelengths::of([NODES[0], NODES[1], NODES[2], NODES[2]].map(|nm| nm as f32).into(), pdf.into())
}
