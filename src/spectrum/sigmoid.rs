//! Smooth reflectances with three coefficients (Jakob and Hanika 2019, *A Low-Dimensional Function Space for
//! Efficient Spectral Upsampling*).

use glam::Vec4;

/// `S(c₀ t² + c₁ t + c₂)` with `S(p) = ½ + p / (2 √(1 + p²))` (their eq. 1) and `t = (λ − 580 nm) / 200 nm`.
///
/// Always in [0, 1]. The wavelength is shifted and scaled so that single precision is enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sigmoid {
    /// c₀, c₁, c₂.
    pub coefficients: [f32; 3],
}

const CENTER: f32 = 580.0;
const SCALE: f32 = 200.0;

/// The variable of the polynomial at `lambda` nm.
pub(super) fn normalised(lambda: f64) -> f64 {
    (lambda - f64::from(CENTER)) / f64::from(SCALE)
}

impl Sigmoid {
    /// Values at four wavelengths in nm.
    #[inline]
    pub fn eval(&self, lambda: Vec4) -> Vec4 {
        let [c0, c1, c2] = self.coefficients;
        let t = (lambda - CENTER) * (1.0 / SCALE);
        let p = (t * c0 + c1) * t + c2;
        // The distance of S from its nearer bound. As ½ − ½|p|/√(1 + p²) it would cancel for dark colours.
        let root = (p * p + 1.0).sqrt();
        let tail = 0.5 / (root * (root + p.abs()));
        Vec4::select(p.cmplt(Vec4::ZERO), tail, 1.0 - tail)
    }

    /// The largest value for wavelengths from `min` to `max` nm.
    pub fn max(&self, min: f32, max: f32) -> f32 {
        let [c0, c1, _] = self.coefficients;
        // S is monotone, so its extremes are those of the parabola.
        let vertex = if c0 < 0.0 { CENTER - SCALE * c1 / (2.0 * c0) } else { min };
        self.eval(Vec4::new(min, max, vertex.clamp(min, max), min)).max_element()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_the_sigmoid_of_the_paper_and_exact_where_the_plain_form_cancels() {
        for c2 in [-3000.0, -400.0, -2.0, -0.1, 0.0, 0.3, 5.0, 400.0] {
            let s = Sigmoid { coefficients: [0.0, 0.0, c2] };
            let got = f64::from(s.eval(Vec4::splat(500.0)).x);
            let p = f64::from(c2);
            let exact = 0.5 + p / (2.0 * (1.0 + p * p).sqrt());
            assert!((got / exact - 1.0).abs() < 1e-6, "{c2}: {got} {exact}");
        }
        // The plain form in single precision at p = −3000: 2.8e-8 becomes 0 or 3e-8.
        let p = -3000.0_f32;
        let plain = 0.5 + p / (2.0 * (1.0 + p * p).sqrt());
        assert!((plain / 2.777_777e-8 - 1.0).abs() > 0.05, "{plain}");
    }

    #[test]
    fn huge_coefficients_stay_within_bounds() {
        for c in [[1e30, -1e30, 1e30], [-3e38, 0.0, 3e38], [f32::MIN_POSITIVE; 3]] {
            let v = Sigmoid { coefficients: c }.eval(Vec4::new(360.0, 500.0, 581.0, 830.0));
            assert!(v.cmpge(Vec4::ZERO).all() && v.cmple(Vec4::ONE).all(), "{c:?} {v}");
        }
    }

    #[test]
    fn max_bounds_every_wavelength() {
        for coefficients in [[-4.0, 1.0, 0.5], [3.0, -2.0, 0.0], [0.0, 2.0, -1.0], [-0.1, 5.0, 0.0]] {
            let s = Sigmoid { coefficients };
            let bound = s.max(360.0, 830.0);
            let seen = (3600..=8300).map(|l| s.eval(Vec4::splat(l as f32 / 10.0)).x).fold(0.0, f32::max);
            assert!(seen <= bound + 1e-6 && seen > bound - 1e-4, "{coefficients:?}: {seen} {bound}");
        }
    }
}
