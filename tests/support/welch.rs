//! Welch's test: do two groups of repetitions have the same mean, when their variances differ and both are small?

/// Mean and variance of the mean of some repetitions.
pub fn moments(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let n = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / n;
    (mean, values.map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0) / n)
}

/// Student's t of two means, differences up to `bias` (absolute) counting as none, and its degrees of freedom by Welch
/// and Satterthwaite; `n` repetitions each.
pub fn t(a: (f64, f64), b: (f64, f64), bias: f64, n: f64) -> (f64, f64) {
    // The rounding of single precision, for what both know without noise.
    let variance = (a.1 + b.1).max((1e-6 * a.0.abs().max(b.0.abs())).powi(2) + 1e-30);
    let off = ((a.0 - b.0).abs() - bias).max(0.0);
    let freedom = variance * variance * (n - 1.0) / (a.1 * a.1 + b.1 * b.1).max(1e-300);
    (off.copysign(a.0 - b.0) / variance.sqrt(), freedom.clamp(n - 1.0, 2.0 * (n - 1.0)))
}

/// The probability that |t| is at least this large by chance, with `freedom` degrees of freedom: the incomplete beta
/// function I_x(ν/2, 1/2) at x = ν / (ν + t²), as the integral of Student's density by Simpson's rule in θ, t = √ν tan θ,
/// where it is a power of the cosine.
pub fn p_value(t: f64, freedom: f64) -> f64 {
    const STEPS: usize = 2000;
    let power = |theta: f64| theta.cos().max(0.0).powf(freedom - 1.0);
    let integral = |from: f64, to: f64| {
        let h = (to - from) / STEPS as f64;
        let at = |i: usize| power(from + h * i as f64);
        let inner: f64 = (1..STEPS).map(|i| at(i) * if i % 2 == 1 { 4.0 } else { 2.0 }).sum();
        (at(0) + inner + at(STEPS)) * h / 3.0
    };
    let end = std::f64::consts::FRAC_PI_2;
    integral((t.abs() / freedom.sqrt()).atan(), end) / integral(0.0, end)
}
