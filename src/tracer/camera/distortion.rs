//! The distortion of lenses of perspective cameras.

use glam::{DMat2, DVec2};

use crate::scene::desc::DistortionDesc;

/// The largest radius in the plane z = 1 at which folds are looked for: 89.8 degrees to the axis.
const WIDEST: f64 = 300.0;

/// Steps along the radius, and directions, in which folds are looked for.
const STEPS: u32 = 1024;
const DIRECTIONS: u32 = 64;

/// A distortion in the plane z = 1 of camera space, where x is to the left and y up, as [`DistortionDesc`] has it with x to the right and y down.
///
/// Far from the axis a polynomial folds over: two directions would have one place. The lens shows what is nearer to the axis than
/// `reach`, the radius of the largest disk in which the symmetric part of the derivative is positive definite. A map with this property on
/// a convex set is one to one there, so that both ways agree about what is shown. Without tangential terms this is the radius of the fold itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Distortion {
    radial: [f64; 6],
    tangential: [f64; 2],
    prism: [f64; 4],
    /// Infinite where no fold was found.
    reach: f64,
}

impl Distortion {
    pub(super) fn new(desc: &DistortionDesc) -> Self {
        // With both axes turned about, terms of even degree change their sign.
        let (tangential, prism) = (desc.tangential.map(|p| -p), desc.prism.map(|s| -s));
        let mut new = Self { radial: desc.radial, tangential, prism, reach: f64::INFINITY };
        new.reach = new.first_fold();
        new
    }

    /// The largest radius up to which nothing folds.
    fn first_fold(&self) -> f64 {
        let directions = if self.is_radial() { 1 } else { DIRECTIONS };
        let is_regular = |radius: f64| {
            (0..directions).all(|i| {
                let turn = std::f64::consts::TAU * f64::from(i) / f64::from(directions);
                self.is_regular(radius * DVec2::from_angle(turn))
            })
        };
        // Even steps of the angle to the axis.
        let widest = WIDEST.atan();
        let radius = |i: u32| (widest * f64::from(i) / f64::from(STEPS)).tan();
        let Some(i) = (1..=STEPS).find(|i| !is_regular(radius(*i))) else { return f64::INFINITY };
        let (mut inside, mut outside) = (radius(i - 1), radius(i));
        for _ in 0..60 {
            let middle = 0.5 * (inside + outside);
            *(if is_regular(middle) { &mut inside } else { &mut outside }) = middle;
        }
        inside
    }

    fn is_radial(&self) -> bool {
        self.tangential == [0.0; 2] && self.prism == [0.0; 4]
    }

    /// Whether the symmetric part of the derivative is positive definite at a place.
    fn is_regular(&self, at: DVec2) -> bool {
        let (_, m) = self.apply(at);
        let (trace, off) = (m.x_axis.x + m.y_axis.y, 0.5 * (m.x_axis.y + m.y_axis.x));
        let determinant = m.x_axis.x * m.y_axis.y - off * off;
        let [.., k4, k5, k6] = self.radial;
        let r2 = at.length_squared();
        let denominator = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6));
        denominator > 0.0 && trace > 0.0 && determinant > 0.0
    }

    /// The factor on a place at the squared radius `r2`, and its derivative by that.
    fn radial(&self, r2: f64) -> (f64, f64) {
        let [k1, k2, k3, k4, k5, k6] = self.radial;
        let above = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let below = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6));
        let d_above = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3);
        let d_below = k4 + r2 * (2.0 * k5 + r2 * 3.0 * k6);
        (above / below, (d_above * below - above * d_below) / (below * below))
    }

    /// The distorted place, and the derivative.
    fn apply(&self, at: DVec2) -> (DVec2, DMat2) {
        let (x, y, r2) = (at.x, at.y, at.length_squared());
        let (q, dq) = self.radial(r2);
        let [p1, p2] = self.tangential;
        let [s1, s2, s3, s4] = self.prism;
        let (sx, sy) = (r2 * (s1 + r2 * s2), r2 * (s3 + r2 * s4));
        let (dsx, dsy) = (s1 + 2.0 * r2 * s2, s3 + 2.0 * r2 * s4);
        let place = DVec2::new(
            x * q + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x) + sx,
            y * q + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y + sy,
        );
        let by_x = DVec2::new(
            q + 2.0 * x * x * dq + 2.0 * p1 * y + 6.0 * p2 * x + 2.0 * x * dsx,
            2.0 * x * y * dq + 2.0 * p1 * x + 2.0 * p2 * y + 2.0 * x * dsy,
        );
        let by_y = DVec2::new(
            2.0 * x * y * dq + 2.0 * p1 * x + 2.0 * p2 * y + 2.0 * y * dsx,
            q + 2.0 * y * y * dq + 6.0 * p1 * y + 2.0 * p2 * x + 2.0 * y * dsy,
        );
        (place, DMat2::from_cols(by_x, by_y))
    }

    /// The distorted place of an undistorted one, and how many times larger areas are there; `None` beyond the reach of the lens.
    pub(super) fn distort(&self, at: DVec2) -> Option<(DVec2, f64)> {
        if at.length_squared() > self.reach * self.reach {
            return None;
        }
        let (place, derivative) = self.apply(at);
        Some((place, derivative.determinant()))
    }

    /// The inverse: the undistorted place, and how many times larger areas are at the distorted one. `None` for places that the lens does not
    /// reach.
    pub(super) fn undistort(&self, to: DVec2) -> Option<(DVec2, f64)> {
        let mut at = self.radial_inverse(to.length()) * to.normalize_or_zero();
        let (mut place, mut derivative) = self.apply(at);
        for _ in 0..60 {
            let off = to - place;
            if off.length_squared() <= 1e-30 * (1.0 + to.length_squared()) {
                break;
            }
            // Newton's step, shortened until it leads nearer and stays within reach.
            let step = derivative.inverse() * off;
            let tried = (0..40).find_map(|i| {
                let next = (at + step * 0.5f64.powi(i)).clamp_length_max(self.reach);
                let (there, derivative) = self.apply(next);
                (there.distance_squared(to) < off.length_squared()).then_some((next, there, derivative))
            });
            let Some(next) = tried else { break };
            (at, place, derivative) = next;
        }
        let found = place.distance_squared(to) <= 1e-20 * (1.0 + to.length_squared());
        found.then(|| (at, derivative.determinant()))
    }

    /// The radius that the radial part takes to `to`, by Newton's method within an interval that is halved where it leaves that; the reach where
    /// there is none.
    fn radial_inverse(&self, to: f64) -> f64 {
        let distorted = |r: f64| {
            let (q, dq) = self.radial(r * r);
            (r * q, q + 2.0 * r * r * dq)
        };
        let mut high = to.max(1.0).min(self.reach);
        while high < self.reach && distorted(high).0 < to && high < 1e8 {
            high = (2.0 * high).min(self.reach);
        }
        let (mut low, mut at) = (0.0, to.min(high));
        for _ in 0..100 {
            let (place, slope) = distorted(at);
            *(if place < to { &mut low } else { &mut high }) = at;
            let next = at + (to - place) / slope;
            let next = if next > low && next < high { next } else { 0.5 * (low + high) };
            if (next - at).abs() <= 1e-15 * at {
                return next;
            }
            at = next;
        }
        at
    }
}
