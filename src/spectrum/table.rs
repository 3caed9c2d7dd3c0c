//! Spectra given as measured points.

use glam::Vec4;

use super::{LAMBDA_MAX, LAMBDA_MIN};

/// One end of a straight piece.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Knot {
    lambda: f32,
    value: f32,
    /// Change per nm up to the next knot.
    slope: f32,
}

/// Piecewise linear, zero outside the first and last point.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    knots: Vec<Knot>,
    /// For each nm of the simulated range, the last knot at or below it: looking up is a load, not a search.
    guide: Vec<u32>,
    max: f32,
}

const CELLS: usize = (LAMBDA_MAX - LAMBDA_MIN) as usize;

impl Table {
    /// Points `(wavelength nm, value)`: at least two, wavelengths ascending, values finite and not negative.
    pub fn new(points: &[(f32, f32)]) -> Option<Self> {
        let valid = |p: &(f32, f32)| p.0.is_finite() && p.1.is_finite() && p.1 >= 0.0;
        let ascending = points.windows(2).all(|w| w[0].0 < w[1].0);
        if points.len() < 2 || !ascending || !points.iter().all(valid) {
            return None;
        }
        let slope = |i: usize| match points.get(i + 1) {
            Some(next) => (next.1 - points[i].1) / (next.0 - points[i].0),
            None => 0.0,
        };
        let knots: Vec<Knot> = points
            .iter()
            .enumerate()
            .map(|(i, &(lambda, value))| Knot { lambda, value, slope: slope(i) })
            .collect();
        let guide = (0..=CELLS + 1)
            .map(|cell| {
                let above = knots.partition_point(|k| k.lambda <= LAMBDA_MIN + cell as f32);
                above.saturating_sub(1) as u32
            })
            .collect();
        let max = points.iter().map(|p| p.1).fold(0.0, f32::max);
        Some(Self { knots, guide, max })
    }

    /// The same with every value multiplied by `factor` (not negative) and cut to `max`.
    pub fn scaled(&self, factor: f32, max: f32) -> Self {
        let points: Vec<(f32, f32)> =
            self.knots.iter().map(|k| (k.lambda, (k.value * factor).min(max))).collect();
        Self::new(&points).unwrap_or_else(|| self.clone())
    }

    /// The value at `lambda` nm.
    #[inline]
    pub fn at(&self, lambda: f32) -> f32 {
        if !(lambda >= self.knots[0].lambda && lambda <= self.knots[self.knots.len() - 1].lambda) {
            return 0.0;
        }
        let cell = ((lambda - LAMBDA_MIN) as usize).min(CELLS);
        let (low, high) = if (LAMBDA_MIN..=LAMBDA_MAX).contains(&lambda) {
            (self.guide[cell] as usize, self.guide[cell + 1] as usize)
        } else {
            (0, self.knots.len() - 1)
        };
        // Knots in (low, high] lie within this cell: mostly none or one, so one comparison decides.
        let within = match high.saturating_sub(low) {
            0 => 0,
            1 => usize::from(self.knots[high].lambda <= lambda),
            _ => self.knots[low + 1..=high].partition_point(|k| k.lambda <= lambda),
        };
        let knot = self.knots[low + within];
        (knot.value + (lambda - knot.lambda) * knot.slope).max(0.0)
    }

    /// The values at four wavelengths.
    pub fn at_each(&self, lambda: Vec4) -> Vec4 {
        Vec4::from_array(lambda.to_array().map(|lambda| self.at(lambda)))
    }

    /// The largest value.
    pub fn max(&self) -> f32 {
        self.max
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The definition, by search through all pieces.
    fn naive(points: &[(f32, f32)], lambda: f32) -> f32 {
        points
            .windows(2)
            .find(|w| lambda >= w[0].0 && lambda <= w[1].0)
            .map_or(0.0, |w| w[0].1 + (lambda - w[0].0) / (w[1].0 - w[0].0) * (w[1].1 - w[0].1))
    }

    #[test]
    fn interpolates_like_the_definition() {
        let regular: Vec<_> = (0..95).map(|i| (360.0 + 5.0 * i as f32, (i % 7) as f32)).collect();
        let spike = vec![(500.0, 0.0), (500.01, 100.0), (500.02, 0.0), (500.5, 1.0), (700.25, 2.0)];
        let wide = vec![(1.0, 3.0), (5000.0, 4.0)];
        let outside = vec![(100.0, 1.0), (200.0, 2.0)];
        for points in [regular, spike, wide, outside] {
            let table = Table::new(&points).expect("valid points");
            for i in 0..60_000 {
                let lambda = 350.0 + i as f32 * 0.0083;
                let (got, exact) = (table.at(lambda), naive(&points, lambda));
                // Steep pieces magnify the rounding of the wavelength itself.
                assert!((got - exact).abs() < 1e-4 * (1.0 + table.max()), "{lambda}: {got} {exact}");
            }
            assert_eq!(table.at(points[0].0), points[0].1);
            assert_eq!(table.at(f32::NAN), 0.0);
        }
    }

    #[test]
    fn refuses_what_is_no_spectrum() {
        let bad: [&[(f32, f32)]; 7] = [
            &[],
            &[(500.0, 1.0)],
            &[(500.0, 1.0), (500.0, 2.0)],
            &[(500.0, 1.0), (400.0, 2.0)],
            &[(400.0, f32::NAN), (500.0, 1.0)],
            &[(400.0, 1.0), (f32::INFINITY, 1.0)],
            &[(400.0, -0.1), (500.0, 1.0)],
        ];
        for points in bad {
            assert_eq!(Table::new(points), None, "{points:?}");
        }
    }
}
