//! Gauss–Legendre rules (Abramowitz and Stegun, table 25.4).

/// Nodes on `[−1, 1]` and weights, 2 points: exact for cubics.
pub const GAUSS_2: [(f64, f64); 2] = [(-0.577_350_269_189_625_8, 1.0), (0.577_350_269_189_625_8, 1.0)];

/// Nodes on `[−1, 1]` and weights, 4 points: exact up to degree 7.
pub const GAUSS_4: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    (-0.339_981_043_584_856_26, 0.652_145_154_862_546_2),
    (0.339_981_043_584_856_26, 0.652_145_154_862_546_2),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
];

/// `∫_a^b f` for three functions at once, 4 points on each of `panels` equal parts.
pub fn integrate([a, b]: [f64; 2], panels: usize, f: impl Fn(f64) -> [f64; 3]) -> [f64; 3] {
    let half = 0.5 * (b - a) / panels as f64;
    let mut sum = [0.0; 3];
    for panel in 0..panels {
        let middle = a + (2 * panel + 1) as f64 * half;
        for (node, weight) in GAUSS_4 {
            add(&mut sum, f(middle + node * half), weight * half);
        }
    }
    sum
}

/// `∬ f(x, y)` over the square of side 1 about `center`, 2×2 points on each of `n × n` equal parts.
pub fn integrate_pixel(center: [f64; 2], n: usize, f: impl Fn(f64, f64) -> [f64; 3]) -> [f64; 3] {
    let half = 0.5 / n as f64;
    let at = |origin: f64, part: usize, node: f64| origin - 0.5 + ((2 * part + 1) as f64 + node) * half;
    let mut sum = [0.0; 3];
    for (row, column) in (0..n * n).map(|i| (i / n, i % n)) {
        for (v, _) in GAUSS_2 {
            for (u, _) in GAUSS_2 {
                add(&mut sum, f(at(center[0], column, u), at(center[1], row, v)), half * half);
            }
        }
    }
    sum
}

/// `sum += weight · value`.
pub fn add(sum: &mut [f64; 3], value: [f64; 3], weight: f64) {
    for (sum, value) in sum.iter_mut().zip(value) {
        *sum += weight * value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_exact() {
        let [a, b, c] = integrate([1.0, 3.0], 1, |x| [x.powi(7), x, 1.0]);
        assert!((a - 820.0).abs() < 1e-10 && (b - 4.0).abs() < 1e-13 && (c - 2.0).abs() < 1e-13);
        let [a, b, _] = integrate_pixel([2.0, 1.0], 3, |x, y| [x * x * y, 1.0, 0.0]);
        assert!((a - (4.0 + 1.0 / 12.0)).abs() < 1e-13 && (b - 1.0).abs() < 1e-13);
    }
}
