//! Least squares with factors that are not negative (Lawson and Hanson 1974, *Solving Least Squares Problems*, ch. 23).

/// Sums of a weighted least-squares problem of a few unknowns: its normal equations.
#[derive(Clone, Debug)]
pub struct NormalEquations {
    /// Σ w a aᵀ, row by row.
    matrix: Vec<f64>,
    /// Σ w a b.
    vector: Vec<f64>,
}

impl NormalEquations {
    /// No equations in `unknowns` unknowns.
    pub fn new(unknowns: usize) -> Self {
        Self { matrix: vec![0.0; unknowns * unknowns], vector: vec![0.0; unknowns] }
    }

    /// Adds the equation Σ aᵢ xᵢ = b with a weight. One with a number that is not finite is left out.
    pub fn add(&mut self, a: &[f64], b: f64, weight: f64) {
        if !(b.is_finite() && weight.is_finite() && a.iter().all(|a| a.is_finite())) {
            return;
        }
        for (row, (ai, vector)) in self.matrix.chunks_mut(a.len()).zip(a.iter().zip(&mut self.vector)) {
            row.iter_mut().zip(a).for_each(|(m, aj)| *m += weight * ai * aj);
            *vector += weight * ai * b;
        }
    }

    /// The unknowns from 0 on with the least sum of squared errors. `usual` decides what the equations leave open: it is an equation xᵢ = `usual`
    /// for each unknown, of next to no weight.
    pub fn solve(mut self, usual: f64) -> Vec<f64> {
        let n = self.vector.len();
        let trace: f64 = (0..n).map(|i| self.matrix[i * n + i]).sum();
        let ridge = if trace > 0.0 { LEAST_WEIGHT * trace / n as f64 } else { 1.0 };
        for i in 0..n {
            self.matrix[i * n + i] += ridge;
            self.vector[i] += ridge * usual;
        }
        self.active_set()
    }

    /// Frees one unknown after the other from 0, the one whose error falls fastest first, and puts those back that would become negative.
    fn active_set(&self) -> Vec<f64> {
        let n = self.vector.len();
        let (mut x, mut free) = (vec![0.0; n], vec![false; n]);
        // Each round lowers the error, and no set of free unknowns comes twice: the bound is for rounding.
        for _ in 0..3 * n + 10 {
            let gain = |i: usize| {
                let row = &self.matrix[i * n..(i + 1) * n];
                let gradient = self.vector[i] - row.iter().zip(&x).map(|(m, x)| m * x).sum::<f64>();
                gradient / self.matrix[i * n + i].sqrt()
            };
            let scale =
                (0..n).map(|i| self.vector[i].abs() / self.matrix[i * n + i].sqrt()).fold(0.0, f64::max);
            let best = (0..n).filter(|i| !free[*i]).map(|i| (gain(i), i)).max_by(|a, b| a.0.total_cmp(&b.0));
            let Some((_, next)) = best.filter(|(gain, _)| *gain > ROUNDING * scale) else { break };
            free[next] = true;
            loop {
                let wanted = self.solve_free(&free);
                let negative = |i: &usize| free[*i] && wanted[*i] <= 0.0;
                let share = |i: usize| x[i] / (x[i] - wanted[i]);
                let Some(step) = (0..n).filter(negative).map(share).min_by(f64::total_cmp) else {
                    x = wanted;
                    break;
                };
                let first = (0..n).filter(negative).find(|i| share(*i) <= step);
                for i in 0..n {
                    x[i] += step * (wanted[i] - x[i]);
                    if free[i] && (Some(i) == first || x[i] <= 0.0) {
                        (x[i], free[i]) = (0.0, false);
                    }
                }
            }
        }
        x
    }

    /// The solution in the free unknowns, where all others are 0, by Cholesky's factors.
    fn solve_free(&self, free: &[bool]) -> Vec<f64> {
        let n = self.vector.len();
        let at: Vec<usize> = (0..n).filter(|i| free[*i]).collect();
        let m = at.len();
        let (mut l, mut y) = (vec![0.0; m * m], vec![0.0; m]);
        for i in 0..m {
            for j in 0..=i {
                let sum =
                    self.matrix[at[i] * n + at[j]] - (0..j).map(|k| l[i * m + k] * l[j * m + k]).sum::<f64>();
                l[i * m + j] = if i == j { sum.max(f64::MIN_POSITIVE).sqrt() } else { sum / l[j * m + j] };
            }
            y[i] = (self.vector[at[i]] - (0..i).map(|k| l[i * m + k] * y[k]).sum::<f64>()) / l[i * m + i];
        }
        let mut x = vec![0.0; n];
        for i in (0..m).rev() {
            x[at[i]] = (y[i] - (i + 1..m).map(|k| l[k * m + i] * x[at[k]]).sum::<f64>()) / l[i * m + i];
        }
        x
    }
}

/// The weight of the usual values over that of the equations.
const LEAST_WEIGHT: f64 = 1e-9;

/// A value below this share of the largest counts as 0.
const ROUNDING: f64 = 1e-12;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;

    /// The conditions of Karush, Kuhn and Tucker, which only the solution meets: no unknown is negative, the error does not fall with any, and
    /// not with less of one that is positive.
    #[test]
    fn solutions_are_the_best() {
        let (mut random, mut zeros) = (Random(5), 0);
        for case in 0..500 {
            let n = 1 + case % 8;
            let mut equations = NormalEquations::new(n);
            for _ in 0..3 * n {
                let a: Vec<f64> = (0..n).map(|_| f64::from(random.f32())).collect();
                equations.add(&a, 2.0 * f64::from(random.f32()) - 0.5, f64::from(random.f32()));
            }
            let x = equations.clone().solve(1.0);
            for i in 0..n {
                let row = &equations.matrix[i * n..(i + 1) * n];
                let gradient = row.iter().zip(&x).map(|(m, x)| m * x).sum::<f64>() - equations.vector[i];
                zeros += usize::from(x[i] == 0.0);
                assert!(x[i] >= 0.0 && gradient >= -1e-6, "case {case}: {x:?}, gradient {gradient}");
                assert!(x[i] == 0.0 || gradient <= 1e-6, "case {case}: {x:?}, gradient {gradient}");
            }
        }
        assert!((200..2000).contains(&zeros), "too easy or too hard: {zeros} unknowns are 0");
    }

    #[test]
    fn what_is_left_open_is_as_usual() {
        let mut equations = NormalEquations::new(3);
        equations.add(&[2.0, 0.0, 0.0], 6.0, 1.0);
        equations.add(&[0.0, f64::NAN, 0.0], 6.0, 1.0);
        equations.add(&[0.0, 0.0, 1.0], -1.0, 1.0);
        let x = equations.solve(1.0);
        assert!((x[0] - 3.0).abs() < 1e-6 && (x[1] - 1.0).abs() < 1e-6 && x[2] == 0.0, "{x:?}");
        assert_eq!(NormalEquations::new(2).solve(1.0), [1.0, 1.0]);
    }
}
