//! From RGB to a smooth spectrum: finds the [`Sigmoid`] that looks like a colour under D65.
//!
//! The optimisation of Jakob and Hanika 2019, §3.2, run for each colour of the scene instead of once for a table of
//! all colours: Levenberg–Marquardt in CIELAB, where an error counts as much as it is seen. Some ten steps
//! of about 2 µs each.

use std::sync::LazyLock;

use glam::{DMat3, DVec3};

use super::sigmoid::{Sigmoid, normalised};
use crate::color::{cie, profile};

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

/// The smooth reflectance that looks like linear Rec.709 `rgb` (each in [0, 1]) under D65.
///
/// All of the RGB cube lies within the solid of these spectra: a grid over it, refined towards its faces, is met
/// within ΔE*ab = 3e-4 throughout.
pub(super) fn reflectance(rgb: DVec3) -> Sigmoid {
    let target = relative_xyz(rgb);
    // Start from the grey of the same luminance, where S(c₂) = Y.
    let y = target.y.clamp(1e-6, 1.0 - 1e-6);
    let start = DVec3::new(0.0, 0.0, (y - 0.5) / (y * (1.0 - y)).sqrt());
    Sigmoid { coefficients: fit(start, lab(target)).as_vec3().to_array() }
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

/// Levenberg–Marquardt from `start` towards the CIELAB colour `target`: the coefficients.
fn fit(start: DVec3, target: DVec3) -> DVec3 {
    let mut at = start;
    let (mut residual, mut jacobian) = linearise(at, target);
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
        let (next_residual, next_jacobian) = linearise(at - step, target);
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
fn linearise(c: DVec3, target: DVec3) -> (DVec3, DMat3) {
    let (mut xyz, mut by_c) = (DVec3::ZERO, [DVec3::ZERO; 3]);
    for &(t, weight) in WEIGHTS.iter() {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_those_of_the_residual() {
        let (c, target) = (DVec3::new(-1.3, 0.7, 0.2), DVec3::new(50.0, 10.0, -20.0));
        let (r, j) = linearise(c, target);
        for (axis, column) in [(DVec3::X, j.x_axis), (DVec3::Y, j.y_axis), (DVec3::Z, j.z_axis)] {
            let h = 1e-6;
            let numeric = (linearise(c + axis * h, target).0 - r) / h;
            assert!((numeric - column).abs().max_element() < 1e-3, "{axis}: {numeric} {column}");
        }
    }

    #[test]
    fn lab_is_that_of_the_cie() {
        assert!((lab(DVec3::ONE) - DVec3::new(100.0, 0.0, 0.0)).length() < 1e-9);
        // The sRGB red primary: L* = 53.24, a* = 80.09, b* = 67.20 under D65.
        let red = lab(relative_xyz(DVec3::X));
        assert!((red - DVec3::new(53.24, 80.09, 67.20)).length() < 0.1, "{red}");
    }
}
