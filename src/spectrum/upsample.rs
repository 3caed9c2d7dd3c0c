//! From RGB to smooth spectra: the [`Sigmoid`] of Jakob and Hanika 2019, *A Low-Dimensional Function Space for Efficient
//! Spectral Upsampling*, its fit to one colour, and a table of fits for the many colours of a picture.
//!
//! Their optimisation (§3.2) runs for each colour of the scene instead of once for a table of all colours:
//! Levenberg–Marquardt in CIELAB, where an error counts as much as it is seen. Some ten steps of about 2 µs each.

use std::sync::LazyLock;

use glam::{DMat3, DVec3, Vec4};

use crate::color::{cie, profile};

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
fn normalised(lambda: f64) -> f64 {
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

/// Colour difference (ΔE*ab) at which the fit is as good as its result in single precision.
const GOOD: f64 = 1e-4;

/// Most steps of one fit. Most colours need 4–10, the corners of the RGB cube up to 44.
const STEPS: usize = 60;

/// For each sample of the observer: the variable `t`, and D65 · observer relative to the XYZ of D65.
static WEIGHTS: LazyLock<Vec<(f64, DVec3)>> = LazyLock::new(|| {
    let white = cie::d65_white();
    cie::Rows::get()
        .iter()
        .map(|(lambda, row)| {
            (normalised(f64::from(lambda)), row.truncate().as_dvec3() * f64::from(row.w) / white)
        })
        .collect()
});

/// As [`WEIGHTS`] at a fifth of the samples, every 5 nm, for the many fits of a table. Smooth reflectances have the same colour by
/// both within ΔE*ab = .03.
static COARSE_WEIGHTS: LazyLock<Vec<(f64, DVec3)>> = LazyLock::new(|| {
    let few: Vec<(f64, DVec3)> = WEIGHTS.iter().copied().step_by(5).collect();
    let sum: DVec3 = few.iter().map(|(_, weight)| *weight).sum();
    few.into_iter().map(|(t, weight)| (t, weight / sum)).collect()
});

/// The smooth reflectance that looks like linear Rec.709 `rgb` (each in [0, 1]) under D65.
///
/// All of the RGB cube lies within the solid of these spectra: a grid over it, refined towards its faces, is met
/// within ΔE*ab = 3e-4 throughout.
pub(super) fn reflectance(rgb: DVec3) -> Sigmoid {
    let target = relative_xyz(rgb);
    // Start from the grey of the same luminance, where S(c₂) = Y.
    let y = target.y.clamp(1e-6, 1.0 - 1e-6);
    let start = DVec3::new(0.0, 0.0, (y - 0.5) / (y * (1.0 - y)).sqrt());
    Sigmoid { coefficients: fit(start, lab(target), &WEIGHTS).as_vec3().to_array() }
}

/// As [`reflectance`] within what its neighbours in a table differ by, in a tenth of the time: starting from that of a similar
/// colour, and by fewer samples.
pub(super) fn reflectance_near(rgb: DVec3, similar: Sigmoid) -> Sigmoid {
    let start = DVec3::from_array(similar.coefficients.map(f64::from));
    Sigmoid { coefficients: fit(start, lab(relative_xyz(rgb)), &COARSE_WEIGHTS).as_vec3().to_array() }
}

/// XYZ of linear Rec.709 divided by white.
fn relative_xyz(rgb: DVec3) -> DVec3 {
    profile::xyz_from_rec709() * rgb / cie::d65_white()
}

/// CIELAB (CIE 15:2018, §8.2.1) of XYZ relative to white.
fn lab(xyz: DVec3) -> DVec3 {
    let f = DVec3::from_array(xyz.to_array().map(|v| lab_curve(v).0));
    DVec3::new(116.0 * f.y - 16.0, 500.0 * (f.x - f.y), 200.0 * (f.y - f.z))
}

/// The curve of CIELAB and its derivative: a cube root, with a straight line near black.
fn lab_curve(v: f64) -> (f64, f64) {
    const EDGE: f64 = 6.0 / 29.0;
    if v > EDGE * EDGE * EDGE {
        let root = v.cbrt();
        (root, 1.0 / (3.0 * root * root))
    } else {
        let slope = 1.0 / (3.0 * EDGE * EDGE);
        (v * slope + 4.0 / 29.0, slope)
    }
}

/// Levenberg–Marquardt from `start` towards the CIELAB colour `target`, which `weights` measure: the coefficients.
fn fit(start: DVec3, target: DVec3, weights: &[(f64, DVec3)]) -> DVec3 {
    let mut at = start;
    let (mut residual, mut jacobian) = linearise(at, target, weights);
    let mut damping = 1e-3;
    for _ in 0..STEPS {
        if residual.length() <= GOOD {
            break;
        }
        let normal = jacobian.transpose() * jacobian;
        let diagonal = DVec3::new(normal.x_axis.x, normal.y_axis.y, normal.z_axis.z);
        let damped = normal + DMat3::from_diagonal(diagonal * damping + DVec3::splat(1e-12));
        let step = damped.inverse() * (jacobian.transpose() * residual);
        if !step.is_finite() {
            break;
        }
        let (next_residual, next_jacobian) = linearise(at - step, target, weights);
        if next_residual.length() < residual.length() {
            (at, residual, jacobian) = (at - step, next_residual, next_jacobian);
            damping = (damping * 0.2).max(1e-9);
        } else {
            damping *= 5.0;
        }
    }
    at
}

/// Difference to `target` in CIELAB, and its derivatives by the three coefficients as columns.
fn linearise(c: DVec3, target: DVec3, weights: &[(f64, DVec3)]) -> (DVec3, DMat3) {
    let (mut xyz, mut by_c) = (DVec3::ZERO, [DVec3::ZERO; 3]);
    for &(t, weight) in weights {
        let p = (c.x * t + c.y) * t + c.z;
        let cosine = 1.0 / (1.0 + p * p).sqrt();
        xyz += weight * (0.5 + 0.5 * p * cosine);
        let slope = weight * (0.5 * cosine * cosine * cosine);
        by_c[0] += slope * (t * t);
        by_c[1] += slope * t;
        by_c[2] += slope;
    }
    let by_xyz = xyz.to_array().map(|v| lab_curve(v).1);
    let columns = by_c.map(|d| {
        let f = d * DVec3::from_array(by_xyz);
        DVec3::new(116.0 * f.y, 500.0 * (f.x - f.y), 200.0 * (f.y - f.z))
    });
    (lab(xyz) - target, DMat3::from_cols(columns[0], columns[1], columns[2]))
}

/// Nodes along each axis of the table.
const NODES: usize = 65;

/// Finds the [`Sigmoid`] of colours whose brightest component is ½, as emission is made of.
///
/// Such a colour is which component is the brightest, and how the other two compare with it: a table of two
/// dimensions for each of red, green and blue. Its nodes are fitted when they are first needed (some 20 µs each) and
/// lie densest where those ratios are near 0, where coefficients change most. Between nodes coefficients are
/// interpolated: colours are met within 10⁻³ of their brightest component (held by a test). Greys are exact.
#[derive(Debug)]
pub(super) struct ChromaTable {
    /// `[brightest][second ratio][first ratio]`.
    nodes: Vec<Option<[f32; 3]>>,
}

impl ChromaTable {
    /// An empty table.
    pub(super) fn new() -> Self {
        Self { nodes: vec![None; 3 * NODES * NODES] }
    }

    /// The smooth spectrum, with values around ½, of the chromaticity of `rgb`, whose components are finite and not
    /// negative and not all 0.
    pub(super) fn shape(&mut self, rgb: [f32; 3]) -> Sigmoid {
        let brightest = (1..3).fold(0, |m, i| if rgb[i] > rgb[m] { i } else { m });
        let ratio = |i: usize| (rgb[(brightest + i) % 3] / rgb[brightest]).sqrt() * (NODES - 1) as f32;
        let (a, b) = (ratio(1), ratio(2));
        let (x, y) = ((a as usize).min(NODES - 2), (b as usize).min(NODES - 2));
        let (s, t) = (a - x as f32, b - y as f32);
        let mut coefficients = [0.0; 3];
        for (dx, dy, weight) in
            [(0, 0, (1.0 - s) * (1.0 - t)), (1, 0, s * (1.0 - t)), (0, 1, (1.0 - s) * t), (1, 1, s * t)]
        {
            if weight > 0.0 {
                let node = self.node(brightest, x + dx, y + dy);
                (0..3).for_each(|i| coefficients[i] += weight * node[i]);
            }
        }
        Sigmoid { coefficients }
    }

    fn node(&mut self, brightest: usize, x: usize, y: usize) -> [f32; 3] {
        *self.nodes[(brightest * NODES + y) * NODES + x].get_or_insert_with(|| {
            if (x, y) == (NODES - 1, NODES - 1) {
                return [0.0; 3];
            }
            let component = |i: usize| 0.5 * (i as f64 / (NODES - 1) as f64).powi(2);
            let mut rgb = [0.5; 3];
            (rgb[(brightest + 1) % 3], rgb[(brightest + 2) % 3]) = (component(x), component(y));
            reflectance(DVec3::from_array(rgb)).coefficients
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectrum::Spectrum;

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

    #[test]
    fn derivatives_are_those_of_the_residual() {
        let (c, target) = (DVec3::new(-1.3, 0.7, 0.2), DVec3::new(50.0, 10.0, -20.0));
        let (r, j) = linearise(c, target, &WEIGHTS);
        for (axis, column) in [(DVec3::X, j.x_axis), (DVec3::Y, j.y_axis), (DVec3::Z, j.z_axis)] {
            let h = 1e-6;
            let numeric = (linearise(c + axis * h, target, &WEIGHTS).0 - r) / h;
            assert!((numeric - column).abs().max_element() < 1e-3, "{axis}: {numeric} {column}");
        }
    }

    /// Colours that the coarse fits match by their own measure, they match by the exact one, too.
    #[test]
    fn fewer_samples_measure_the_same_colours() {
        let mut worst = 0.0_f64;
        for i in 0..343 {
            let rgb = DVec3::new((i % 7) as f64, (i / 7 % 7) as f64, (i / 49) as f64) * 0.15 + 0.02;
            let Sigmoid { coefficients } = reflectance_near(rgb, reflectance(rgb));
            let c = DVec3::from_array(coefficients.map(f64::from));
            worst = worst.max(linearise(c, lab(relative_xyz(rgb)), &WEIGHTS).0.length());
        }
        assert!(worst > 0.0 && worst < 0.03, "{worst}");
    }

    #[test]
    fn lab_is_that_of_the_cie() {
        assert!((lab(DVec3::ONE) - DVec3::new(100.0, 0.0, 0.0)).length() < 1e-9);
        // The sRGB red primary: L* = 53.24, a* = 80.09, b* = 67.20 under D65.
        let red = lab(relative_xyz(DVec3::X));
        assert!((red - DVec3::new(53.24, 80.09, 67.20)).length() < 0.1, "{red}");
    }

    /// Colours on and off the nodes, saturated ones, greys: what the interpolated spectrum looks like under D65.
    #[test]
    fn colours_are_met() {
        let mut table = ChromaTable::new();
        let levels = [0.0f32, 1e-4, 1e-3, 0.013, 0.09, 0.3, 0.57, 0.93, 1.0];
        let mut worst = (0f32, [0.0; 3]);
        for brightest in 0..3 {
            for a in levels {
                for b in levels {
                    let mut rgb = [1.0; 3];
                    (rgb[(brightest + 1) % 3], rgb[(brightest + 2) % 3]) = (a, b);
                    let found = Spectrum::Scaled { scale: 2.0, shape: table.shape(rgb) }.reflected_rgb();
                    let off = (0..3).map(|i| (found[i] - rgb[i]).abs()).fold(0.0, f32::max);
                    if off > worst.0 {
                        worst = (off, rgb);
                    }
                }
            }
        }
        assert!(worst.0 < 1e-3, "{worst:?}");
        assert_eq!(table.shape([7.0; 3]).coefficients, [0.0; 3]);
    }
}
