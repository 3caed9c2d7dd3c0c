//! Hero wavelength sampling.

use std::sync::LazyLock;

use glam::{Vec3, Vec4};

use super::SampledSpectrum;
use crate::color::{Xyz, cie};

/// The four wavelengths of one path, in nm, with their densities in 1/nm.
#[derive(Clone, Copy, Debug)]
pub struct SampledWavelengths {
    lambda: Vec4,
    pdf: Vec4,
}

/// Pieces of equal probability in the inverse of the cumulative distribution.
const PIECES: usize = 1024;

/// `[start, width]` in nm of each piece. Within a piece the wavelength is uniform, so `1 / (PIECES · width)` is its
/// exact density, however roughly the pieces follow [`density`].
static INVERSE: LazyLock<[[f32; 2]; PIECES]> = LazyLock::new(inverse);

/// The density of sampled wavelengths: three Gaussian lobes on a floor.
///
/// The figures minimise the noise of linear Rec.709 red, green and blue, relative to luminance, of four stratified
/// wavelengths, averaged over seven smooth reflectances (white to saturated) under each of D65, illuminant A, equal
/// energy and a warm lamp. The primaries and not X, Y, Z are what is looked at: red is 3.2 X − 1.5 Y − 0.5 Z, and in
/// that difference a lobe too wide or too narrow shows up magnified. A saturated red wall has a tenth of the noise
/// in red that a density made for X, Y and Z gives it.
fn density(lambda: f64) -> f64 {
    let lobe = |center: f64, width: f64| (-0.5 * ((lambda - center) / width).powi(2)).exp();
    1.25 * lobe(630.0, 34.0) + 1.36 * lobe(544.0, 48.0) + lobe(444.0, 22.0) + 0.01
}

fn inverse() -> [[f32; 2]; PIECES] {
    const STEPS_PER_NM: usize = 32;
    const STEPS: usize = cie::COUNT * STEPS_PER_NM;
    // Where the observer is zero nothing can be seen, so nothing is drawn there.
    let start = f64::from(cie::FIRST_NM) - 0.5;
    let at = |step: f64| start + step / STEPS_PER_NM as f64;
    let total: f64 = (0..STEPS).map(|i| density(at(i as f64 + 0.5))).sum();

    let mut edges = [at(STEPS as f64) as f32; PIECES + 1];
    let (mut below, mut next) = (0.0, 0);
    for i in 0..STEPS {
        let here = density(at(i as f64 + 0.5)) / total;
        while next < PIECES && below + here >= next as f64 / PIECES as f64 {
            edges[next] = at(i as f64 + (next as f64 / PIECES as f64 - below) / here) as f32;
            next += 1;
        }
        below += here;
    }
    std::array::from_fn(|i| [edges[i], edges[i + 1] - edges[i]])
}

impl SampledWavelengths {
    /// Chooses a hero wavelength from `u` in [0, 1) and three companions at equal steps of the cumulative
    /// distribution (Wilkie et al. 2014, *Hero Wavelength Spectral Sampling*), over the range in which the
    /// observer sees anything (379.5–780.5 nm).
    #[inline]
    pub fn sample(u: f32) -> Self {
        let steps = Vec4::new(0.0, 0.25, 0.5, 0.75) + u;
        let x = (steps - steps.floor()) * PIECES as f32;
        let pieces = &*INVERSE;
        let [a, b, c, d] = x.to_array().map(|x| {
            let i = (x as usize).min(PIECES - 1);
            (pieces[i], x - i as f32)
        });
        let start = Vec4::new(a.0[0], b.0[0], c.0[0], d.0[0]);
        let width = Vec4::new(a.0[1], b.0[1], c.0[1], d.0[1]);
        let lambda = start + width * Vec4::new(a.1, b.1, c.1, d.1);
        Self { lambda, pdf: (width * PIECES as f32).recip() }
    }

    /// These wavelengths, nm, with these densities, 1/nm.
    pub(super) fn of(lambda: Vec4, pdf: Vec4) -> Self {
        Self { lambda, pdf }
    }

    /// The wavelengths, in nm; the hero is the first.
    #[inline]
    pub fn lambda(&self) -> Vec4 {
        self.lambda
    }

    /// The densities, per nm; zero in a terminated lane.
    #[inline]
    pub fn pdf(&self) -> Vec4 {
        self.pdf
    }

    /// True once only the hero wavelength is carried.
    #[inline]
    pub fn is_hero_only(&self) -> bool {
        self.pdf.y == 0.0 && self.pdf.z == 0.0 && self.pdf.w == 0.0
    }

    /// Drops the companions, as a path must where a delta interface sends each wavelength its own way.
    /// Does nothing when they are already dropped.
    #[inline]
    pub fn terminate_companions(&mut self) {
        if !self.is_hero_only() {
            self.pdf = Vec4::new(self.pdf.x * 0.25, 0.0, 0.0, 0.0);
        }
    }

    /// Four times the wavelength of one lane: what a path is evaluated at that carries no other. Of a value that is black
    /// in the other lanes, [`SampledWavelengths::to_xyz`] is the same as before.
    #[inline]
    pub fn alone(&self, lane: usize) -> Self {
        Self { lambda: Vec4::splat(self.lambda[lane]), pdf: Vec4::splat(self.pdf[lane]) }
    }

    /// Estimates the CIE XYZ of radiance `l`: mean over the lanes of `l · observer / pdf`, divided by ∫ȳ dλ
    /// so that radiance 1 at all wavelengths has Y = 1 (as pbrt-v4 `SampledSpectrum::ToXYZ`).
    ///
    /// A terminated lane counts nothing, whatever `l` holds there.
    #[inline]
    pub fn to_xyz(&self, l: SampledSpectrum) -> Xyz {
        let carried = self.pdf.cmpgt(Vec4::ZERO);
        let weight = Vec4::select(carried, l.0 * 0.25 / self.pdf, Vec4::ZERO);
        let rows = cie::Rows::get();
        let [a, b, c, d] = self.lambda.to_array();
        let sum =
            rows.at(a) * weight.x + rows.at(b) * weight.y + rows.at(c) * weight.z + rows.at(d) * weight.w;
        let Vec3 { x, y, z } = sum.truncate();
        Xyz::new(x, y, z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wavelengths_lie_where_the_observer_sees() {
        for u in [0.0, f32::MIN_POSITIVE, 0.249_999_99, 0.25, 0.5, 0.75, 1.0 - f32::EPSILON / 2.0] {
            let s = SampledWavelengths::sample(u);
            assert!(s.lambda().min_element() >= 379.5 && s.lambda().max_element() <= 780.5, "{u}: {s:?}");
            assert!(s.pdf().min_element() > 0.0 && s.pdf().is_finite(), "{u}: {s:?}");
        }
    }

    #[test]
    fn density_is_that_of_the_wavelengths() {
        // ∫ pdf dλ over each companion's quarter, by the change of variables dλ/du · pdf = 1.
        let n = 4096;
        for i in 0..n {
            let u = i as f32 / n as f32;
            let h = 0.25 / n as f32;
            let (a, b) = (SampledWavelengths::sample(u), SampledWavelengths::sample(u + h));
            let product = (b.lambda() - a.lambda()) / h * a.pdf();
            // f32 wavelengths near 600 nm are 6e-5 nm apart, and u steps by 6e-5.
            assert!((product - 1.0).abs().max_element() < 0.05, "{u}: {product}");
        }
    }

    #[test]
    fn inverse_follows_the_density() {
        let total: f64 = (0..4010).map(|i| density(379.55 + f64::from(i) * 0.1) * 0.1).sum();
        for (i, [start, width]) in INVERSE.iter().enumerate() {
            let expected = density(f64::from(start + width / 2.0)) / total;
            let pdf = 1.0 / (PIECES as f64 * f64::from(*width));
            assert!((pdf / expected - 1.0).abs() < 0.05, "piece {i} at {start} nm: {pdf} {expected}");
        }
    }

    #[test]
    fn terminating_twice_is_terminating_once() {
        let mut s = SampledWavelengths::sample(0.3);
        let hero = s.pdf().x;
        s.terminate_companions();
        assert!(s.is_hero_only());
        s.terminate_companions();
        assert_eq!(s.pdf(), Vec4::new(hero / 4.0, 0.0, 0.0, 0.0));
    }

    #[test]
    fn terminated_lanes_count_nothing() {
        let mut s = SampledWavelengths::sample(0.6);
        s.terminate_companions();
        let clean = s.to_xyz(SampledSpectrum(Vec4::new(2.0, 0.0, 0.0, 0.0)));
        let dirty = s.to_xyz(SampledSpectrum(Vec4::new(2.0, f32::NAN, f32::INFINITY, -7.0)));
        assert_eq!(clean, dirty);
        assert!(clean.is_finite());
    }
}
