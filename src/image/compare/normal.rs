//! The normal distribution's tails.

/// The `z` that a standard normal variable exceeds on either side with probability `p`.
pub fn critical_value(p: f64) -> f64 {
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..100 {
        let z = 0.5 * (low + high);
        if erfc(z / std::f64::consts::SQRT_2) > p { low = z } else { high = z }
    }
    0.5 * (low + high)
}

/// Complementary error function for `x ≥ 0`, relative error below 1e-10 (Abramowitz, Stegun 7.1.6, 7.1.14).
fn erfc(x: f64) -> f64 {
    let scale = (-x * x).exp() / std::f64::consts::PI.sqrt();
    if x < 2.5 {
        // erf(x) = 2/√π e^(−x²) Σ 2^k x^(2k+1) / (1·3·…·(2k+1))
        let (mut term, mut sum) = (x, x);
        for k in 1..100 {
            term *= 2.0 * x * x / f64::from(2 * k + 1);
            sum += term;
        }
        1.0 - 2.0 * scale * sum
    } else {
        // Continued fraction x + (1/2)/(x + 1/(x + (3/2)/(x + …))), from the inside out.
        let fraction = (1..=60).rev().fold(x, |f, k| x + 0.5 * f64::from(k) / f);
        scale / fraction
    }
}
