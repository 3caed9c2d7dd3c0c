//! Spheres around a scene and around parts of it.

use glam::Vec3;

/// A sphere around something, in rendering space.
#[derive(Clone, Copy, Debug, Default)]
pub struct BoundingSphere {
    /// Centre.
    pub center: Vec3,
    /// Radius.
    pub radius: f32,
}

impl BoundingSphere {
    /// A sphere around everything.
    pub(super) const EVERYTHING: Self = Self { center: Vec3::ZERO, radius: f32::INFINITY };

    /// Power over π of an environment of radiance 1 around this scene.
    pub(super) fn environment_power(&self) -> f32 {
        4.0 * std::f32::consts::PI * self.radius * self.radius
    }

    /// The sphere around spheres.
    fn around(spheres: &[Self]) -> Self {
        if spheres.iter().any(|s| s.radius == f32::INFINITY) {
            return Self::EVERYTHING;
        }
        let bounds =
            |(lo, hi): (Vec3, Vec3), s: &Self| (lo.min(s.center - s.radius), hi.max(s.center + s.radius));
        let (lo, hi) = spheres.iter().fold((Vec3::MAX, Vec3::MIN), bounds);
        let center = 0.5 * (lo + hi);
        let radius = spheres.iter().map(|s| s.center.distance(center) + s.radius).fold(0.0, f32::max);
        Self { center, radius }
    }

    /// At most `most` spheres around all of these: where they are more, those of neighbours become one.
    pub(super) fn few(spheres: Vec<Self>, most: usize) -> Vec<Self> {
        let mut groups = vec![spheres];
        groups.retain(|group| !group.is_empty());
        while groups.len() < most {
            let radius = |group: &Vec<Self>| if group.len() > 1 { Self::around(group).radius } else { -1.0 };
            let widest = groups.iter().enumerate().max_by(|a, b| radius(a.1).total_cmp(&radius(b.1)));
            let Some((i, _)) = widest.filter(|(_, group)| group.len() > 1) else { break };
            let halves = halves(groups.swap_remove(i));
            groups.extend(halves);
        }
        groups.iter().map(|group| Self::around(group)).collect()
    }

    /// False only where the ray from `p` in the unit direction `d` misses the sphere; true for some that pass close by, and where a number
    /// is not finite.
    #[inline]
    pub(super) fn may_be_hit(&self, p: Vec3, d: Vec3) -> bool {
        let to_center = self.center - p;
        let (d2, along) = (to_center.length_squared(), to_center.dot(d));
        let r2 = self.radius * self.radius;
        // Squared distances lose digits in proportion to how far away the sphere is.
        let outer = r2 + ROUNDING * (d2 + r2);
        let passes_by = d2 - along * along > outer;
        let is_behind = along < 0.0 && d2 > outer;
        !(passes_by || is_behind)
    }
}

/// Bound on the error of a squared distance, relative to the largest one: several times what rounding makes of it.
const ROUNDING: f32 = 1e-5;

/// Halves of more than one sphere, on either side of the median of their centres along the longest axis.
fn halves(mut spheres: Vec<BoundingSphere>) -> [Vec<BoundingSphere>; 2] {
    let bounds = |(lo, hi): (Vec3, Vec3), s: &BoundingSphere| (lo.min(s.center), hi.max(s.center));
    let (lo, hi) = spheres.iter().fold((Vec3::MAX, Vec3::MIN), bounds);
    let axis = (hi - lo).max_position();
    spheres.sort_by(|a, b| a.center[axis].total_cmp(&b.center[axis]));
    let upper = spheres.split_off(spheres.len() / 2);
    [spheres, upper]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::bits::mix;

    /// Rays through a point of a sphere, from near and far, never miss it; most others do.
    #[test]
    fn rays_that_hit_are_never_taken_for_misses() {
        let number = |i: u64| (mix(i) >> 40) as f32 / (1u64 << 24) as f32 - 0.5;
        let point = |i: u64| Vec3::new(number(3 * i), number(3 * i + 1), number(3 * i + 2));
        let (mut hit, mut met) = (0, 0);
        for i in 0..200_000 {
            let far = 10f32.powi((i % 9) as i32 - 2);
            let sphere = BoundingSphere { center: far * point(4 * i), radius: 0.01 + number(7 * i).abs() };
            let (p, on) =
                (100.0 * point(4 * i + 1), sphere.center + sphere.radius * point(4 * i + 2).normalize());
            assert!(sphere.may_be_hit(p, (on - p).normalize()), "{sphere:?} from {p}");
            let d = point(4 * i + 3).normalize();
            let exact = {
                let (to, d) = ((sphere.center - p).as_dvec3(), d.as_dvec3().normalize());
                let along = to.dot(d);
                to.length() < f64::from(sphere.radius)
                    || along > 0.0 && (to - along * d).length() < f64::from(sphere.radius)
            };
            (hit, met) = (hit + u32::from(exact), met + u32::from(sphere.may_be_hit(p, d)));
            assert!(!exact || sphere.may_be_hit(p, d));
        }
        assert!(met <= hit + hit / 10 + 2000, "{met} of {hit}");
        assert!(BoundingSphere::EVERYTHING.may_be_hit(Vec3::ONE, Vec3::X));
        let merged = BoundingSphere::few(vec![BoundingSphere::EVERYTHING, BoundingSphere::default()], 1);
        assert!(merged[0].may_be_hit(Vec3::ONE, Vec3::X));
    }
}
