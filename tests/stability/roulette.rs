//! Russian roulette over the random numbers of the sequence, which are multiples of 2⁻²⁴.

use pointillist::tracer::roulette::survival_factor;

use crate::Row;

const GRID: f64 = (1u64 << 24) as f64;

/// The mean of a factor over all random numbers that let a path live, which are the smallest ones.
fn mean(factor: impl Fn(f32) -> Option<f32>) -> f64 {
    let at = |k: u32| factor((f64::from(k) / GRID) as f32);
    let (mut low, mut high) = (0, 1 << 24);
    while low < high {
        let middle = (low + high) / 2;
        (low, high) = if at(middle).is_some() { (middle + 1, high) } else { (low, middle) };
    }
    f64::from(low) / GRID * f64::from(at(0).unwrap_or(0.0))
}

/// Paths that carry next to nothing survive as often as their factor says.
#[test]
fn b5_paths_that_carry_little() {
    for (case, exponents) in [("1e-9 to 1e-6", -9.0..-6.0), ("1e-6 to .95", -6.0..-0.0223)] {
        let count = 4000;
        let step = (exponents.end - exponents.start) / f64::from(count);
        let worst = |mean: &dyn Fn(f32) -> f64| {
            let at = |i: i32| (10f64.powf(exponents.start + step * f64::from(i))) as f32;
            (0..count).map(|i| (mean(at(i)) - 1.0).abs()).fold(0.0, f64::max)
        };
        Row {
            case: &format!("B5 roulette, probabilities of {case}"),
            measure: "largest error of the mean factor",
            figure: worst(&|p| mean(|u| survival_factor(p, true, u))),
            naive: ("u < p", worst(&|p| mean(|u| (u < p).then(|| 1.0 / p)))),
            bound: 2e-7,
        }
        .check();
    }
}
