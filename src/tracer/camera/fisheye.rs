//! Fisheye lenses.

use glam::{DVec2, DVec3};

use crate::scene::desc::{FisheyeDesc, FisheyeMapping};

use super::local_ray::LocalRay;

/// Steps in which a fold of the distortion is looked for.
const STEPS: u32 = 4096;

/// A fisheye lens, in places of the picture for the focal length 1, x to the left and y up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fisheye {
    mapping: FisheyeMapping,
    k: [f64; 4],
    /// The largest angle to the axis that it shows, radians: of the image circle, the mapping, and where the distortion folds over.
    limit: f64,
}

impl Fisheye {
    pub(super) fn new(desc: &FisheyeDesc) -> Self {
        let widest = (0.5 * desc.image_circle).min(desc.mapping.largest_angle()).to_radians();
        let mut new = Self { mapping: desc.mapping, k: desc.distortion, limit: widest };
        let is_regular = |angle: f64| {
            let (distorted, slope) = new.distorted(angle);
            slope > 0.0 && distorted <= desc.mapping.largest_angle().to_radians()
        };
        let at = |i: u32| widest * f64::from(i) / f64::from(STEPS);
        if new.is_distorted()
            && let Some(i) = (1..=STEPS).find(|i| !is_regular(at(*i)))
        {
            let (mut inside, mut outside) = (at(i - 1), at(i));
            for _ in 0..60 {
                let middle = 0.5 * (inside + outside);
                *(if is_regular(middle) { &mut inside } else { &mut outside }) = middle;
            }
            new.limit = inside;
        }
        new
    }

    fn is_distorted(&self) -> bool {
        self.k != [0.0; 4]
    }

    /// The distorted angle, and its derivative.
    fn distorted(&self, angle: f64) -> (f64, f64) {
        let [k1, k2, k3, k4] = self.k;
        let a = angle * angle;
        let factor = 1.0 + a * (k1 + a * (k2 + a * (k3 + a * k4)));
        let slope = 1.0 + a * (3.0 * k1 + a * (5.0 * k2 + a * (7.0 * k3 + a * 9.0 * k4)));
        (angle * factor, slope)
    }

    /// The radius of an angle to the axis, and its derivative.
    fn radius(&self, angle: f64) -> (f64, f64) {
        let (distorted, slope) = self.distorted(angle);
        let derivative = match self.mapping {
            FisheyeMapping::Equidistant => 1.0,
            FisheyeMapping::Equisolid => (0.5 * distorted).cos(),
            FisheyeMapping::Stereographic => (0.5 * distorted).cos().powi(-2),
            FisheyeMapping::Orthographic => distorted.cos(),
        };
        (self.mapping.radius(distorted), derivative * slope)
    }

    /// The angle to the axis of a radius; `None` beyond the limit.
    fn angle(&self, radius: f64) -> Option<f64> {
        let distorted = match self.mapping {
            FisheyeMapping::Equidistant => radius,
            FisheyeMapping::Equisolid if radius <= 2.0 => 2.0 * (0.5 * radius).asin(),
            FisheyeMapping::Stereographic => 2.0 * (0.5 * radius).atan(),
            FisheyeMapping::Orthographic if radius <= 1.0 => radius.asin(),
            FisheyeMapping::Equisolid | FisheyeMapping::Orthographic => return None,
        };
        let angle = if self.is_distorted() { self.undistorted(distorted)? } else { distorted };
        (angle <= self.limit).then_some(angle)
    }

    /// The angle that the distortion takes to `to`, by Newton's method within an interval that is halved where it leaves that.
    fn undistorted(&self, to: f64) -> Option<f64> {
        let (mut low, mut high) = (0.0, self.limit);
        if to > self.distorted(high).0 {
            return None;
        }
        let mut at = to.min(high);
        for _ in 0..100 {
            let (place, slope) = self.distorted(at);
            *(if place < to { &mut low } else { &mut high }) = at;
            let next = at + (to - place) / slope;
            let next = if next > low && next < high { next } else { 0.5 * (low + high) };
            if (next - at).abs() <= 1e-15 * at {
                return Some(next);
            }
            at = next;
        }
        Some(at)
    }

    /// Area of the picture per steradian at an angle: r dr dφ over sin θ dθ dφ.
    fn density(&self, angle: f64) -> f64 {
        let (radius, slope) = self.radius(angle);
        if angle < 1e-6 { slope * slope } else { radius * slope / angle.sin().max(1e-9) }
    }

    pub(super) fn ray(&self, at: DVec2) -> Option<LocalRay> {
        let radius = at.length();
        let angle = self.angle(radius)?;
        let (sin, cos) = angle.sin_cos();
        let across = if radius > 0.0 { at * (sin / radius) } else { DVec2::ZERO };
        Some(LocalRay { from: DVec3::ZERO, direction: across.extend(cos), density: self.density(angle) })
    }

    /// The place of a direction of any length, and its density.
    pub(super) fn place(&self, direction: DVec3) -> Option<(DVec2, f64)> {
        let across = direction.truncate();
        let angle = across.length().atan2(direction.z);
        let place = across.normalize_or_zero() * self.radius(angle).0;
        (angle <= self.limit).then(|| (place, self.density(angle)))
    }
}
