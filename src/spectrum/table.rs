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
        // `array::map` makes a function call of each value here.
        let mut values = lambda.to_array();
        for value in &mut values {
            *value = self.at(*value);
        }
        Vec4::from_array(values)
    }

    /// The largest value.
    pub fn max(&self) -> f32 {
        self.max
    }
}
