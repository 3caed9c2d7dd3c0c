//! Phase functions by a table over the cosine of the scattering angle.
//!
//! Vertices are plain values that are copied, and a table is too large for that. So tables live as long as the program, one for each
//! distinct list of values, and a vertex has a reference: a scene that is edited or loaded again finds its table there.

use std::f64::consts::TAU;
use std::sync::{Mutex, PoisonError};

use glam::Vec3;

use crate::math::warp;

/// All tables so far.
static TABLES: Mutex<Vec<&'static PhaseTable>> = Mutex::new(Vec::new());

/// A density that is linear between equal steps of the cosine, from −1 to 1.
#[derive(Debug)]
pub(super) struct PhaseTable {
    /// Per steradian, at each step.
    density: Box<[f32]>,
    /// The probability of all that lies below each step: from 0 to 1.
    below: Box<[f64]>,
    most: f32,
}

impl PhaseTable {
    /// The table of these values, which need not be normalised; `None` for fewer than two, for one that is negative or not finite, and where
    /// all are 0.
    pub(super) fn shared(values: &[f64]) -> Option<&'static Self> {
        let table = Self::new(values)?;
        let mut tables = TABLES.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = tables.iter().find(|known| known.density == table.density) {
            return Some(known);
        }
        let table: &'static Self = Box::leak(Box::new(table));
        tables.push(table);
        Some(table)
    }

    fn new(values: &[f64]) -> Option<Self> {
        let most = values.iter().copied().fold(0.0, f64::max);
        let usable = values.iter().all(|v| *v >= 0.0 && v.is_finite());
        if values.len() < 2 || !usable || most <= 0.0 {
            return None;
        }
        // Over the largest, so that no sum overflows.
        let relative = |i: usize| values[i] / most;
        let mut sum = 0.0;
        let mut below = vec![0.0];
        for i in 1..values.len() {
            sum += 0.5 * (relative(i - 1) + relative(i));
            below.push(sum);
        }
        below.iter_mut().for_each(|v| *v /= sum);
        let step = 2.0 / (values.len() - 1) as f64;
        let scale = 1.0 / (sum * step * TAU);
        let density = (0..values.len()).map(|i| (relative(i) * scale) as f32).collect();
        Some(Self { density, below: below.into(), most: scale as f32 })
    }

    /// The largest density per steradian.
    pub(super) fn most(&self) -> f32 {
        self.most
    }

    /// Steps within a unit of the cosine.
    #[inline]
    fn steps_per_cosine(&self) -> f32 {
        0.5 * (self.density.len() - 1) as f32
    }

    /// The density per steradian of going on in the direction `forward` turned to `wi`, unit vectors.
    #[inline]
    pub(super) fn eval(&self, forward: Vec3, wi: Vec3) -> f32 {
        let (last, per_cosine) = (self.density.len() - 1, self.steps_per_cosine());
        // 1 ∓ cos θ of unit vectors is half their squared distance, without cancellation near either pole.
        let at = match forward.dot(wi) > 0.0 {
            true => last as f32 - 0.5 * forward.distance_squared(wi) * per_cosine,
            false => 0.5 * (-forward).distance_squared(wi) * per_cosine,
        };
        let index = (at as usize).min(last - 1);
        let part = (at - index as f32).clamp(0.0, 1.0);
        self.density[index] + (self.density[index + 1] - self.density[index]) * part
    }

    /// The cosine of the angle to `forward` as 1 − cos θ if it is positive, and otherwise as 1 + cos θ and true.
    #[inline]
    pub(super) fn sample_cosine(&self, u: f32) -> (f32, bool) {
        let (last, u) = (self.density.len() - 1, f64::from(u));
        let index = self.below.partition_point(|below| *below <= u).clamp(1, last) - 1;
        let (start, end) = (self.below[index], self.below[index + 1]);
        let within = ((u - start) / (end - start).max(f64::MIN_POSITIVE)) as f32;
        let part = warp::linear(within, self.density[index], self.density[index + 1]);
        let (behind, ahead) = (index as f32 + part, (last - index) as f32 - part);
        let backwards = behind < ahead;
        (behind.min(ahead) / self.steps_per_cosine(), backwards)
    }
}
