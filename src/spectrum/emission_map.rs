//! A picture whose texels are emission spectra, for environment maps and textured lights.

use std::fmt;

use glam::Vec4;

use super::spectrum::BRIGHTEST;
use super::upsample::{ChromaTable, Sigmoid};
use super::{SampledSpectrum, SampledWavelengths, Spectrum};

/// Luminance of linear Rec.709 components.
const LUMINANCE: [f32; 3] = [0.2126, 0.7152, 0.0722];

/// A texel with a radiance that no light can have.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "texel ({x}, {y}) is {}, {}, {}: radiance is finite and not negative; repair the picture, by setting such texels to 0",
    rgb[0], rgb[1], rgb[2]
)]
pub struct TexelError {
    /// Column from the left, from 0.
    pub x: usize,
    /// Row from the top, from 0.
    pub y: usize,
    /// The texel.
    pub rgb: [f32; 3],
}

/// Texels that [`repair`] changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TexelRepairs {
    /// Texels with a component that is infinite or no number.
    pub not_finite: usize,
    /// Other texels with a negative component.
    pub negative: usize,
}

/// Makes radiance of what a picture holds: texels that are not finite become black, and negative components 0.
pub fn repair(texels: &mut [[f32; 3]]) -> TexelRepairs {
    let mut repairs = TexelRepairs::default();
    for texel in texels {
        if !texel.iter().all(|v| v.is_finite()) {
            *texel = [0.0; 3];
            repairs.not_finite += 1;
        } else if texel.iter().any(|v| *v < 0.0) {
            *texel = texel.map(|v| v.max(0.0));
            repairs.negative += 1;
        }
    }
    repairs
}

/// Texels in rows from the top, each a smooth spectrum times D65 as [`Spectrum::emission_rgb`] makes it.
/// 20 bytes per texel.
pub struct EmissionMap {
    width: usize,
    height: usize,
    /// Rows before a single one is doubled.
    rows: usize,
    /// Coefficients of the shape, and its factor.
    texels: Vec<[f32; 4]>,
    /// Luminance Y of each texel.
    luminances: Vec<f32>,
}

impl EmissionMap {
    /// Makes the spectra of linear Rec.709 `rgb`, rows of `width` texels from the top. A single row is doubled.
    ///
    /// # Errors
    ///
    /// The first texel that is negative or not finite.
    ///
    /// # Panics
    ///
    /// If there is no texel, or not full rows of them.
    pub fn new(width: usize, rgb: &[[f32; 3]]) -> Result<Self, TexelError> {
        assert!(width > 0 && !rgb.is_empty() && rgb.len().is_multiple_of(width), "rows of {width} texels");
        if let Some(i) = rgb.iter().position(|t| !t.iter().all(|v| v.is_finite() && *v >= 0.0)) {
            return Err(TexelError { x: i % width, y: i / width, rgb: rgb[i] });
        }
        let mut table = ChromaTable::new();
        let mut texels: Vec<[f32; 4]> = rgb.iter().map(|rgb| texel(*rgb, &mut table)).collect();
        let luminance = |rgb: &[f32; 3]| (0..3).map(|i| rgb[i].min(BRIGHTEST) * LUMINANCE[i]).sum();
        let mut luminances: Vec<f32> = rgb.iter().map(luminance).collect();
        if rgb.len() == width {
            texels.extend_from_within(..);
            luminances.extend_from_within(..);
        }
        Ok(Self { width, height: texels.len() / width, rows: rgb.len() / width, texels, luminances })
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows, at least 2.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Rows of the picture: 1 where [`EmissionMap::height`] has doubled it.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Luminance Y of the texel in column `x` of row `y`, which must exist.
    #[inline]
    pub fn luminance(&self, x: usize, y: usize) -> f32 {
        self.luminances[y * self.width + x]
    }

    /// True when all texels are black.
    pub fn is_black(&self) -> bool {
        self.luminances.iter().all(|y| *y == 0.0)
    }

    /// True when every texel is D65, of whatever brightness.
    pub fn is_grey(&self) -> bool {
        self.texels.iter().all(|[c0, c1, _, scale]| *scale == 0.0 || (*c0 == 0.0 && *c1 == 0.0))
    }

    /// The map whose texels are D65 of the same luminance.
    pub fn grey(&self) -> Self {
        // The sigmoid of 0 is ½.
        let texels = self.luminances.iter().map(|y| [0.0, 0.0, 0.0, 2.0 * y]).collect();
        Self { texels, luminances: self.luminances.clone(), ..*self }
    }

    /// Bilinear between the texels `cell` (column, row), the next column, which after the last is the first, and the
    /// next row, which must exist; `offset` from the first, in [0, 1].
    #[inline]
    pub fn bilinear(
        &self,
        [x, y]: [usize; 2],
        [s, t]: [f32; 2],
        lambda: &SampledWavelengths,
    ) -> SampledSpectrum {
        let next = if x + 1 == self.width { 0 } else { x + 1 };
        let (s0, t0) = (1.0 - s, 1.0 - t);
        let above = [([x, y], s0 * t0), ([next, y], s * t0)];
        let below = [([x, y + 1], s0 * t), ([next, y + 1], s * t)];
        self.blend([above[0], above[1], below[0], below[1]], lambda)
    }

    /// The sum of these texels (column, row), which must exist, each with its weight.
    #[inline]
    pub fn blend<const N: usize>(
        &self,
        texels: [([usize; 2], f32); N],
        lambda: &SampledWavelengths,
    ) -> SampledSpectrum {
        let mut sum = Vec4::ZERO;
        for ([x, y], weight) in texels {
            let [c0, c1, c2, scale] = self.texels[y * self.width + x];
            sum += Sigmoid { coefficients: [c0, c1, c2] }.eval(lambda.lambda()) * (scale * weight);
        }
        SampledSpectrum(sum) * Spectrum::D65(1.0).sample(lambda)
    }
}

fn texel(rgb: [f32; 3], table: &mut ChromaTable) -> [f32; 4] {
    let rgb = rgb.map(|v| v.min(BRIGHTEST));
    let brightest = rgb[0].max(rgb[1]).max(rgb[2]);
    if brightest == 0.0 {
        return [0.0; 4];
    }
    let [c0, c1, c2] = table.shape(rgb).coefficients;
    [c0, c1, c2, 2.0 * brightest]
}

impl fmt::Debug for EmissionMap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "EmissionMap({} × {})", self.width, self.height)
    }
}
